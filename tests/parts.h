/* parts.h - the smallest parts of tests, campaigns and benchmarks: numbers that repeat, vectors,
   templates. The same numbers from any compiler, in C99 and C++11. Include it after dem2d.h.

   What can't fail in a test that is right goes through expect_ok: it ends the program with a line
   on stderr. testing.h lets it fail the test instead. */
#ifndef PARTS_H
#define PARTS_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../examples/random.h"

/* Not every user of these files calls all of it. */
#if defined(__GNUC__)
#define PART static __attribute__((unused))
#else
#define PART static
#endif

#define COUNT_OF(array) ((int)(sizeof(array) / sizeof((array)[0])))

#ifndef PARTS_FAIL
#define PARTS_FAIL(what, why) (fprintf(stderr, "%s: %s\n", what, why), exit(1))
#endif

PART void expect_ok(dem2d_result result, const char *what) {
    if (result != DEM2D_OK) PARTS_FAIL(what, dem2d_result_text(result));
}

/* For programs with one sequence of numbers. */
static uint64_t random_state = 1;

/* Uniform in [low, high). */
PART double uniform(double low, double high) {
    return random_between(&random_state, low, high);
}

PART dem2d_vec vec(double x, double y) {
    dem2d_vec v;
    v.x = x, v.y = y;
    return v;
}

PART int compare_doubles(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The median, of an even number the mean of the two in the middle. Sorts the values. */
PART double middle_of(double *values, int count) {
    qsort(values, (size_t)count, sizeof *values, compare_doubles);
    return (values[(count - 1) / 2] + values[count / 2]) / 2;
}

/* --- materials -------------------------------------------------------------------------------- */

/* Springs and friction, no dashpot, no rolling friction. */
PART dem2d_pair_desc pair_desc(double kn, double kt, double friction) {
    dem2d_pair_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.normal_stiffness = kn, desc.tangential_stiffness = kt, desc.friction = friction;
    return desc;
}

PART dem2d_material_desc material_desc(double density, double kn, double kt, double friction) {
    dem2d_material_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.density = density, desc.normal_stiffness = kn, desc.tangential_stiffness = kt;
    desc.friction = friction;
    return desc;
}

/* --- templates -------------------------------------------------------------------------------- */

PART dem2d_shape *make_disc(double radius) {
    dem2d_shape *shape = NULL;
    expect_ok(dem2d_shape_create_circle(NULL, radius, &shape), "circle");
    return shape;
}

PART dem2d_shape *make_ellipse(double a, double b) {
    dem2d_shape *shape = NULL;
    expect_ok(dem2d_shape_create_ellipse(NULL, a, b, &shape), "ellipse");
    return shape;
}

PART dem2d_shape *make_polygon(const dem2d_vec *points, int count, double rounding) {
    dem2d_shape *shape = NULL;
    expect_ok(dem2d_shape_create_polygon(NULL, points, count, rounding, &shape), "polygon");
    return shape;
}

PART dem2d_shape *make_box(double width, double height) {
    dem2d_vec points[4];
    points[0] = vec(0, 0), points[1] = vec(width, 0);
    points[2] = vec(width, height), points[3] = vec(0, height);
    return make_polygon(points, 4, 0);
}

/* Coefficients 0 to order of a support function. */
PART dem2d_shape *make_series(const double *a, const double *b, int order) {
    dem2d_shape *shape = NULL;
    expect_ok(dem2d_shape_create_fourier(NULL, a, b, order, &shape), "Fourier series");
    return shape;
}

/* Points of four arcs that meet on the axes, this far from the origin; the handles along the axes,
   a part of the next reach, make the joints smooth. 0.5522847498 is that of a circle. */
PART void oval_points(const double reach[4], double handle, dem2d_vec points[12]) {
    static const int axis[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    for (int i = 0; i < 4; i++) {
        const int j = (i + 1) % 4;
        const dem2d_vec p = vec(reach[i] * axis[i][0], reach[i] * axis[i][1]);
        const dem2d_vec q = vec(reach[j] * axis[j][0], reach[j] * axis[j][1]);
        points[3 * i] = p;
        points[3 * i + 1] = vec(p.x + handle * q.x, p.y + handle * q.y);
        points[3 * i + 2] = vec(q.x + handle * p.x, q.y + handle * p.y);
    }
}

PART dem2d_shape *make_oval(const double reach[4], double handle) {
    dem2d_vec points[12];
    dem2d_shape *shape = NULL;
    oval_points(reach, handle, points);
    expect_ok(dem2d_shape_create_bezier(NULL, points, 4, &shape), "polybezier");
    return shape;
}

#endif
