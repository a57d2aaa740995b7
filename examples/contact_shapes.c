/* contact_shapes.c - the geometry layer alone: six kinds of shapes, their distances and depths.

   No world, no time: shapes are made, measured and held against each other, and each answer is
   compared with a closed form. Exit status 1 if one of them is off.

       cc -std=c99 -O2 -I.. contact_shapes.c -lm && ./a.out
*/
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double pi = 3.141592653589793;
static int wrong = 0; // answers off so far

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "contact_shapes: %s\n", dem2d_result_text(result));
    exit(1);
}

/* Prints an answer beside the closed form and counts it if it is off. */
static void compare(const char *what, double answer, double exact, double tolerance) {
    const bool good = fabs(answer - exact) <= tolerance; // false for a NaN
    printf("%-46s %+.12f  closed form %+.12f  %s\n", what, answer, exact, good ? "ok" : "WRONG");
    if (good) return;
    fprintf(stderr, "contact_shapes: %s is off by %g\n", what, answer - exact);
    wrong++;
}

/* A capsule: the segment from (-1, 0) to (1, 0) and all within *user of it. Its radius of curvature
   is *user on the caps and infinite on the flats, which uniform directions never meet. */
static dem2d_vec capsule(void *user, dem2d_vec u, double *rho) {
    const double r = *(const double *)user;
    dem2d_vec point = {r * u.x, r * u.y};
    if (u.x > 0) point.x += 1;
    if (u.x < 0) point.x -= 1;
    if (rho != NULL) *rho = r;
    return point;
}

enum { DISC, OVAL, SQUARE, ROUND4, TRILOBE, CAPSULE, KINDS };
static const char *const names[KINDS] = {"circle, radius 0.5",
                                         "ellipse, half axes 2 and 1",
                                         "square of 2, rounded by 0.25",
                                         "four Bezier arcs, almost a circle",
                                         "Fourier series of constant width 2",
                                         "custom: capsule 3 x 1"};
static const double kappa = 0.5522847498; // control length of the usual four-arc circle
static double cap_radius = 0.5;

static void make_shapes(dem2d_shape *shapes[KINDS]) {
    const dem2d_vec corners[4] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    const double k = kappa;
    const dem2d_vec control[12] = {{1, 0},  {1, k},   {k, 1},   {0, 1},  {-k, 1}, {-1, k},
                                   {-1, 0}, {-1, -k}, {-k, -1}, {0, -1}, {k, -1}, {1, -k}};
    const double a[4] = {2, 0, 0, 0.1}, b[4] = {0, 0, 0, 0}; // odd harmonics: constant width a[0]
    dem2d_custom_desc custom = {0};
    custom.support = capsule;
    custom.user = &cap_radius;
    custom.rho_min = cap_radius;
    custom.inscribed = cap_radius;
    check(dem2d_shape_create_circle(NULL, 0.5, &shapes[DISC]));
    check(dem2d_shape_create_ellipse(NULL, 2, 1, &shapes[OVAL]));
    check(dem2d_shape_create_polygon(NULL, corners, 4, 0.25, &shapes[SQUARE]));
    check(dem2d_shape_create_bezier(NULL, control, 4, &shapes[ROUND4]));
    check(dem2d_shape_create_fourier(NULL, a, b, 3, &shapes[TRILOBE]));
    check(dem2d_shape_create_custom(NULL, &custom, &shapes[CAPSULE]));
}

static void print_facts(dem2d_shape *const shapes[KINDS]) {
    dem2d_shape_info info[KINDS];
    puts("shape                                     area   polar moment  circumscribed  inscribed");
    for (int i = 0; i < KINDS; i++) {
        check(dem2d_shape_get(shapes[i], &info[i]));
        printf("%-36s %9.6f   %12.6f  %13.6f  %9.6f\n", names[i], info[i].mass.area,
               info[i].mass.polar_moment, info[i].circumscribed, info[i].inscribed);
    }
    puts("");
    const double r = 0.25, k = kappa;
    compare("area of the circle", info[DISC].mass.area, pi / 4, 1e-14);
    compare("polar moment of the ellipse", info[OVAL].mass.polar_moment, 2.5 * pi, 1e-12);
    compare("area of the square", info[SQUARE].mass.area, 4 + 8 * r + pi * r * r, 1e-12);
    compare("area of the Bezier arcs", info[ROUND4].mass.area, 2 + 2.4 * k - 0.6 * k * k, 1e-12);
    compare("area of the series", info[TRILOBE].mass.area, pi * (1 - 4 * 0.01), 1e-12);
    compare("area of the capsule (1000 points)", info[CAPSULE].mass.area, 2 + pi / 4, 1e-4);
}

/* Depth of A at the origin, turned by angle_a, and B at (x, y): negative for a gap. */
static double depth(const dem2d_shape *a, double angle_a, const dem2d_shape *b, double x,
                    double y) {
    dem2d_contact contact;
    check(dem2d_pair_contact(a, dem2d_pose_make(0, 0, angle_a, 1), b, dem2d_pose_make(x, y, 0, 1),
                             NULL, &contact));
    return contact.depth;
}

static void compare_pairs(dem2d_shape *const shapes[KINDS]) {
    dem2d_shape *const *s = shapes;
    const double tolerance = 1e-8; // the search stops at 1e-10 of the sizes
    puts("");
    compare("two circles", depth(s[DISC], 0, s[DISC], 0.6, 0), 0.4, tolerance);
    compare("ellipse and circle beyond its tip", depth(s[OVAL], 0, s[DISC], 3, 0), -0.5, tolerance);
    compare("ellipse on end and circle", depth(s[OVAL], pi / 2, s[DISC], 0, 2.4), 0.1, tolerance);
    compare("rounded square and circle", depth(s[SQUARE], 0, s[DISC], 1.6, 0.2), 0.15, tolerance);
    compare("rounded square and circle at its corner", depth(s[SQUARE], 0, s[DISC], 2, 2),
            0.75 - sqrt(2), tolerance);
    compare("rounded square and ellipse", depth(s[SQUARE], 0, s[OVAL], 0, 2.5), -0.25, tolerance);
    compare("Bezier arcs and circle", depth(s[ROUND4], 0, s[DISC], 1.3, 0), 0.2, tolerance);
    compare("two of constant width", depth(s[TRILOBE], 0, s[TRILOBE], 0.9, 1.2), 0.5, tolerance);
    compare("capsule and circle", depth(s[CAPSULE], 0, s[DISC], 2.5, 0), -0.5, tolerance);
    compare("capsule and ellipse", depth(s[CAPSULE], 0, s[OVAL], 0, 1.25), 0.25, tolerance);
}

/* An ellipse leans on a wall: its support value is sqrt(a^2 ux^2 + b^2 uy^2). */
static void compare_wall(const dem2d_shape *ellipse) {
    const dem2d_vec floor_point = {0, 0}, up = {0, 1};
    const dem2d_pose pose = dem2d_pose_make(0, 1, pi / 6, 1);
    dem2d_contact contact;
    dem2d_support lowest;
    check(dem2d_wall_contact(ellipse, pose, floor_point, up, &contact));
    compare("leaning ellipse, depth in the floor", contact.depth, sqrt(4 * 0.25 + 0.75) - 1, 1e-12);
    check(dem2d_shape_support(ellipse, pose, (dem2d_vec){0, -1}, &lowest));
    compare("radius of curvature there", lowest.rho, 4 / pow(1.75, 1.5), 1e-12);
}

int main(void) {
    dem2d_shape *shapes[KINDS];
    make_shapes(shapes);
    print_facts(shapes);
    compare_pairs(shapes);
    compare_wall(shapes[OVAL]);
    for (int i = 0; i < KINDS; i++) dem2d_shape_destroy(shapes[i]);
    if (wrong > 0) fprintf(stderr, "contact_shapes: %d answers are off\n", wrong);
    return wrong > 0;
}
