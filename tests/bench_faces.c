/* bench_faces [--quick] - what the two rules for contacts of faces do to the energy, and what
   they cost.

   A box rocks on a floor; 64 grains (sharp polygons, rounded ones, ellipses, Fourier series) fly
   about between four walls, without friction, damping or gravity, fast enough for overlaps of
   0.1 % of the radius, in steps of a 200th of the contact time. The energy of a gas is read when no
   contact is open: then it is kinetic only, and free of the leapfrog's error inside a contact. A
   few collisions of two corners make up most of the drift, so it is that of three runs (quick:
   one), each with its own places and velocities. Exit status: 0, 1 if a scene failed, 2 for bad
   usage. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#define BENCH_NAME "bench_faces"
#include "bench.h"
#include "world_scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define KN 1e7
#define DENSITY 2000.0
#define GRAINS 64
#define SIDE 8 /* grains in a row at the start */
#define TEMPLATES 16
#define ORDER 8
#define FRACTION 0.3 /* of the area */
#define RADIUS 0.5   /* m, of the circle of equal area */
#define RUNS 3       /* of each gas; quick: 1 */

enum { POLYGONS, ROUNDED, ELLIPSES, SERIES, KINDS };

static const char *const kind_names[KINDS] = {"sharp polygons", "rounded polygons", "ellipses",
                                              "Fourier series"};
static const char *const rule_names[DEM2D_FACE_RULE_COUNT] = {"two points", "one point"};

/* What a run gives; energies in parts of the energy of the motion. */
typedef struct outcome {
    double drift;  /* at the end; of some runs the root of the mean square */
    double worst;  /* greatest on the way */
    double ns;     /* per particle and step */
    double deep;   /* mean over the looks at open contacts of the greatest overlap / radius */
    int64_t steps; /* taken */
} outcome;

/* Of motion, springs and height. */
static double energy_in(const scene *s) {
    const dem2d_energy e = energy_of(s);
    return e.translational + e.rotational + e.normal + e.tangential + e.potential;
}

static scene make_scene(dem2d_face_rule rule, double time_step, double gravity) {
    const dem2d_material_desc stone = material_desc(DENSITY, KN, 0, 0);
    dem2d_world_desc desc = {0};
    desc.time_step = time_step, desc.gravity.y = -gravity, desc.faces = rule;
    return open_scene(&desc, &stone);
}

/* --- a rocking box -------------------------------------------------------------------------- */

/* 1 m wide and high, released at 3 degrees on one corner. */
static outcome rock(dem2d_face_rule rule, double time) {
    const double tilt = 3 * PI / 180, gravity = 9.81, dt = 1e-4,
                 height = (cos(tilt) + sin(tilt)) / 2;
    outcome o = {0, 0, 0, 0, 0};
    const scene s = make_scene(rule, dt, gravity);
    add_floor(&s);
    add_shape(&s, make_box(1, 1), DEM2D_FREE, vec(0, height), tilt, vec(0, 0), 0);
    step(&s, 1);
    const double first = energy_in(&s), lifted = DENSITY * gravity * (height - 0.5);
    const double start = seconds();
    const int looks = (int)(time / (10 * dt));
    for (int i = 0; i < looks; i++) {
        step(&s, 10);
        o.drift = (energy_in(&s) - first) / lifted;
        o.worst = fmax(o.worst, fabs(o.drift));
    }
    o.steps = 10 * (int64_t)looks;
    o.ns = (seconds() - start) / (double)o.steps * 1e9;
    close_scene(&s);
    return o;
}

/* --- templates ------------------------------------------------------------------------------ */

static dem2d_shape *make_template(int kind, int index) {
    const int sides = 4 + index % 4; /* corners on a circle at uneven angles */
    double a[ORDER + 1], b[ORDER + 1];
    dem2d_virtual_desc desc = {0};
    dem2d_vec points[7];
    if (kind == ELLIPSES) return make_ellipse(1 + (index + 0.5) / TEMPLATES, 1);
    desc.radius = 1, desc.elongation = 0.1, desc.roundness = 0.04, desc.roughness = 0.01;
    desc.seed = (uint64_t)index;
    expect_ok(dem2d_fourier_virtual(&desc, ORDER, a, b), "virtual grain");
    if (kind == SERIES) return make_series(a, b, ORDER);
    for (int k = 0; k < sides; k++) {
        const double t = 2 * PI * (k + uniform(-0.25, 0.25)) / sides;
        points[k] = vec(cos(t), sin(t));
    }
    return make_polygon(points, sides, kind == ROUNDED ? 0.15 : 0);
}

/* --- a gas ---------------------------------------------------------------------------------- */

/* Grains of equal area on a lattice that fills the box; velocities of one size. */
static scene make_gas(dem2d_face_rule rule, int kind, int run) {
    const double area = PI * RADIUS * RADIUS, half_mass = DENSITY * area / 2;
    const double side = sqrt(GRAINS * area / FRACTION), cell = side / SIDE;
    const double contact_time = PI * sqrt(half_mass / KN);
    /* relative speed v gives an overlap of v sqrt(m / k) */
    const double speed = 1e-3 * RADIUS / sqrt(half_mass / KN) / sqrt(2);
    dem2d_shape_id ids[TEMPLATES];
    double scale[TEMPLATES];
    const scene s = make_scene(rule, contact_time / 200, 0);
    random_state = 1 + (uint64_t)run;
    add_plane(&s, 0, 0, 1, 0), add_plane(&s, side, 0, -1, 0);
    add_plane(&s, 0, 0, 0, 1), add_plane(&s, 0, side, 0, -1);
    for (int i = 0; i < TEMPLATES; i++) {
        dem2d_shape *shape = make_template(kind, i);
        dem2d_shape_info info;
        expect_ok(dem2d_shape_get(shape, &info), "shape");
        ids[i] = give_shape(&s, shape);
        scale[i] = RADIUS / info.equivalent;
    }
    for (int i = 0; i < GRAINS; i++) {
        const double way = uniform(0, 2 * PI);
        dem2d_particle_desc grain =
            grain_desc(&s, ids[i % TEMPLATES], scale[i % TEMPLATES],
                       vec((i % SIDE + 0.5) * cell, (i / SIDE + 0.5) * cell));
        grain.angle = uniform(0, 2 * PI);
        grain.velocity = vec(speed * cos(way), speed * sin(way));
        grain.angular_velocity = uniform(-1, 1) * speed / RADIUS;
        add_grain(&s, &grain);
    }
    return s;
}

/* Steps until no contact is open; false when that takes too long. */
static bool wait_for_free_flight(const scene *s, int64_t *steps) {
    for (int i = 0; i < 200000; i++, ++*steps) {
        if (contacts_of(s, NULL, 0) == 0) return true;
        step(s, 1);
    }
    return false;
}

static outcome fly(dem2d_face_rule rule, int kind, int run, int steps) {
    const int chunk = 1000;
    outcome o = {0, 0, 0, 0, 0};
    int open_looks = 0;
    const scene s = make_gas(rule, kind, run);
    double spent = 0, first = 0;
    for (bool started = false; o.steps < steps || !started; started = true) {
        const double start = seconds();
        step(&s, started ? chunk : 1);
        spent += seconds() - start;
        o.steps += started ? chunk : 1;
        const double deepest = packing_of(&s).max_overlap;
        if (deepest > 0) o.deep += deepest, open_looks++;
        const double resumed = seconds();
        if (!wait_for_free_flight(&s, &o.steps))
            bench_fail("%s, %s: always a contact", kind_names[kind], rule_names[rule]);
        spent += seconds() - resumed;
        const double now = energy_in(&s);
        if (!started) first = now;
        o.drift = now / first - 1;
        o.worst = fmax(o.worst, fabs(o.drift));
    }
    if (open_looks > 0) o.deep /= open_looks;
    o.ns = spent / ((double)o.steps * GRAINS) * 1e9;
    close_scene(&s);
    return o;
}

static outcome fly_often(dem2d_face_rule rule, int kind, int runs, int steps) {
    outcome sum = {0, 0, 0, 0, 0};
    for (int run = 0; run < runs; run++) {
        const outcome o = fly(rule, kind, run, steps);
        sum.drift += o.drift * o.drift / runs;
        sum.worst = fmax(sum.worst, o.worst);
        sum.ns += o.ns / runs, sum.deep += o.deep / runs, sum.steps += o.steps;
    }
    sum.drift = sqrt(sum.drift);
    return sum;
}

/* --- table ---------------------------------------------------------------------------------- */

static void print_row(const char *scene, int rule, const outcome *o) {
    printf("%-18s %-14s %12.2e %12.2e %10lld %10.1f", scene, rule_names[rule], o->drift, o->worst,
           (long long)o->steps, o->ns);
    if (o->deep > 0)
        printf(" %9.3f %%\n", 100 * o->deep);
    else
        printf(" %11s\n", "-");
    fflush(stdout);
}

int main(int argc, char **argv) {
    const bool quick = argc == 2 && strcmp(argv[1], "--quick") == 0;
    double loss[KINDS][DEM2D_FACE_RULE_COUNT];
    if (argc > 1 && !quick) {
        fprintf(stderr, "usage: bench_faces [--quick]\n");
        return 2;
    }
    const int steps = quick ? 50000 : 1000000;
    printf("%-18s %-14s %12s %12s %10s %10s %11s\n", "scene", "rule", "drift", "worst", "steps",
           "ns", "overlap");
    for (int rule = 0; rule < DEM2D_FACE_RULE_COUNT; rule++) {
        const outcome o = rock((dem2d_face_rule)rule, 20);
        print_row("rocking box", rule, &o);
    }
    for (int kind = 0; kind < KINDS; kind++)
        for (int rule = 0; rule < DEM2D_FACE_RULE_COUNT; rule++) {
            const outcome o = fly_often((dem2d_face_rule)rule, kind, quick ? 1 : RUNS, steps);
            loss[kind][rule] = o.drift;
            print_row(kind_names[kind], rule, &o);
        }
    printf("drift: change of the energy, of that of the motion; ns: per particle and step;\n"
           "overlap: mean of the greatest at a time, of the radius\n");
    printf("sharp polygons, two points against one: %.2e against %.2e, %s\n",
           loss[POLYGONS][DEM2D_TWO_POINTS], loss[POLYGONS][DEM2D_ONE_POINT],
           loss[POLYGONS][DEM2D_TWO_POINTS] <= loss[POLYGONS][DEM2D_ONE_POINT] ? "no more is lost"
                                                                               : "MORE is lost");
    return 0;
}
