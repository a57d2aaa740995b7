/* Shapes: creation and its errors, support against oracles in long double that share no code with
   the header, boxes, outlines, facts, containment. */
#include "dem2d.h"

#include "testing.h"

#include <float.h>
#include <limits.h>

#define KAPPA 0.5522847498 /* handle length of a quarter circle */

/* --- models: input data at a power-of-two scale, and their true support function -------------- */

typedef struct truth {
    long double x, y, h; /* farthest point and support value, about the origin of the input */
    bool unique;         /* false where another point is nearly as far */
} truth;

static const dem2d_vec pentagon[5] = {{0, 0}, {4, -1}, {6, 2}, {3, 5}, {-1, 3}};
static const double fs8_a[9] = {4, .1, .12, .03, .01, 0, .004, 0, .002};
static const double fs8_b[9] = {0, -.2, .05, -.02, .015, .003, 0, .001, .001};

/* Coefficients from 1 to 1e-20; a0 makes the sufficient test hold. */
static void fs64(double *a, double *b) {
    for (int n = 0; n <= 64; n++) {
        const double size = pow(10, -20 * n / 64.0);
        a[n] = size * cos(n), b[n] = size * sin(n);
    }
    a[0] = 20, b[0] = 0;
}

/* A smooth chain in a polygon: from middle to middle of its edges, handles a part of the way to
   the corner between. A part of 2/3 gives parabolas (M4 = 0). */
static void cut_corners(const dem2d_vec *p, int n, double part, dem2d_vec *control) {
    for (int i = 0; i < n; i++) {
        const dem2d_vec a = p[i], b = p[(i + 1) % n], c = p[(i + 2) % n];
        const dem2d_vec from = {(a.x + b.x) / 2, (a.y + b.y) / 2};
        const dem2d_vec to = {(b.x + c.x) / 2, (b.y + c.y) / 2};
        control[3 * i] = from;
        control[3 * i + 1] = vec(from.x + part * (b.x - from.x), from.y + part * (b.y - from.y));
        control[3 * i + 2] = vec(to.x + part * (b.x - to.x), to.y + part * (b.y - to.y));
    }
}

/* Four copies of a few control points, each turned by a right angle: exact. */
static void turn_four(const dem2d_vec *quarter, int count, dem2d_vec *control) {
    for (int i = 0; i < count; i++) {
        dem2d_vec p = quarter[i];
        for (int side = 0; side < 4; side++) {
            control[side * count + i] = p;
            p = vec(-p.y, p.x);
        }
    }
}

static const dem2d_vec circle_quarter[3] = {{1, 0}, {1, KAPPA}, {KAPPA, 1}};
/* A side with equally spaced collinear points (M3 = M4 = 0), then a round corner. */
static const dem2d_vec flat_quarter[6] = {{2.5, -1.5}, {2.5, -.5}, {2.5, .5},
                                          {2.5, 1.5},  {2.5, 2},   {2, 2.5}};

static void scale_points(double scale, int count, const dem2d_vec *in, dem2d_vec *out) {
    for (int i = 0; i < count; i++) out[i] = vec(scale * in[i].x, scale * in[i].y);
}

static dem2d_result try_circle(const dem2d_env *env, double scale, dem2d_shape **shape) {
    return dem2d_shape_create_circle(env, 1.5 * scale, shape);
}

static dem2d_result try_ellipse(const dem2d_env *env, double scale, dem2d_shape **shape) {
    return dem2d_shape_create_ellipse(env, 3 * scale, 0.75 * scale, shape);
}

static dem2d_result try_polygon(const dem2d_env *env, double scale, dem2d_shape **shape) {
    dem2d_vec points[5];
    scale_points(scale, 5, pentagon, points);
    return dem2d_shape_create_polygon(env, points, 5, 0, shape);
}

static dem2d_result try_rounded(const dem2d_env *env, double scale, dem2d_shape **shape) {
    dem2d_vec points[5];
    scale_points(scale, 5, pentagon, points);
    return dem2d_shape_create_polygon(env, points, 5, 0.7 * scale, shape);
}

static dem2d_result try_arcs(const dem2d_env *env, double scale, const dem2d_vec *control, int arcs,
                             dem2d_shape **shape) {
    dem2d_vec scaled[3 * 16];
    scale_points(scale, 3 * arcs, control, scaled);
    return dem2d_shape_create_bezier(env, scaled, arcs, shape);
}

static dem2d_result try_cubic(const dem2d_env *env, double scale, dem2d_shape **shape) {
    dem2d_vec control[15];
    cut_corners(pentagon, 5, 0.8, control);
    return try_arcs(env, scale, control, 5, shape);
}

static dem2d_result try_parabola(const dem2d_env *env, double scale, dem2d_shape **shape) {
    dem2d_vec control[15];
    cut_corners(pentagon, 5, 2.0 / 3, control);
    return try_arcs(env, scale, control, 5, shape);
}

static dem2d_result try_flat(const dem2d_env *env, double scale, dem2d_shape **shape) {
    dem2d_vec control[24];
    turn_four(flat_quarter, 6, control);
    return try_arcs(env, scale, control, 8, shape);
}

static dem2d_result try_series(const dem2d_env *env, double scale, const double *a, const double *b,
                               int order, dem2d_shape **shape) {
    double scaled_a[65], scaled_b[65];
    for (int n = 0; n <= order; n++) scaled_a[n] = scale * a[n], scaled_b[n] = scale * b[n];
    return dem2d_shape_create_fourier(env, scaled_a, scaled_b, order, shape);
}

static dem2d_result try_fs8(const dem2d_env *env, double scale, dem2d_shape **shape) {
    return try_series(env, scale, fs8_a, fs8_b, 8, shape);
}

static dem2d_result try_fs64(const dem2d_env *env, double scale, dem2d_shape **shape) {
    double a[65], b[65];
    fs64(a, b);
    return try_series(env, scale, a, b, 64, shape);
}

static dem2d_vec ellipse_callback(void *user, dem2d_vec u, double *rho) {
    const double s = *(const double *)user, a = 3 * s, b = 0.75 * s;
    const double h = sqrt(a * a * u.x * u.x + b * b * u.y * u.y);
    if (rho) *rho = (a / h) * (a / h) * (b / h) * b;
    return vec(a * a * u.x / h, b * b * u.y / h);
}

static dem2d_result try_custom(const dem2d_env *env, double scale, dem2d_shape **shape) {
    static double scales[16]; /* the shape keeps a pointer to its size */
    static int next;
    double *kept = &scales[next++ % 16];
    *kept = scale;
    dem2d_custom_desc desc = {0};
    desc.support = ellipse_callback, desc.user = kept;
    desc.rho_min = 0.75 * 0.75 / 3 * scale, desc.inscribed = 0.75 * scale;
    return dem2d_shape_create_custom(env, &desc, shape);
}

static truth true_ellipse(long double a, long double b, long double ux, long double uy) {
    const long double h = hypotl(a * ux, b * uy);
    return (truth){a * a * ux / h, b * b * uy / h, h, true};
}

static truth true_polygon(const dem2d_vec *p, int n, long double r, long double ux,
                          long double uy) {
    truth best = {0, 0, -HUGE_VALL, true};
    long double second = -HUGE_VALL;
    for (int i = 0; i < n; i++) {
        const long double h = p[i].x * ux + p[i].y * uy;
        if (h > best.h) {
            second = best.h;
            best = (truth){p[i].x, p[i].y, h, true};
        } else if (h > second) {
            second = h;
        }
    }
    best.unique = best.h - second > 1e-9L; /* corners are a few units apart */
    return (truth){best.x + r * ux, best.y + r * uy, best.h + r, best.unique};
}

static truth true_series(const double *a, const double *b, int order, long double ux,
                         long double uy) {
    const long double t = atan2l(uy, ux);
    long double h = a[0] / 2.0L, slope = 0;
    for (int n = 1; n <= order; n++) {
        const long double c = cosl(n * t), s = sinl(n * t);
        h += a[n] * c + b[n] * s, slope += n * (b[n] * c - a[n] * s);
    }
    return (truth){h * ux - slope * uy, h * uy + slope * ux, h, true};
}

static truth on_arc(const dem2d_vec *q[4], long double t, long double ux, long double uy) {
    const long double s = 1 - t;
    const long double w[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
    truth at = {0, 0, 0, true};
    for (int k = 0; k < 4; k++) at.x += w[k] * q[k]->x, at.y += w[k] * q[k]->y;
    at.h = at.x * ux + at.y * uy;
    return at;
}

/* Dense scan of the parameter, then golden section about the best sample of each arc. */
static truth true_bezier(const dem2d_vec *control, int arcs, long double ux, long double uy) {
    const long double golden = (sqrtl(5) - 1) / 2;
    truth best = {0, 0, -HUGE_VALL, true};
    for (int arc = 0; arc < arcs; arc++) {
        const dem2d_vec *q[4];
        for (int k = 0; k < 4; k++) q[k] = &control[(3 * arc + k) % (3 * arcs)];
        int top = 0;
        for (int i = 1; i <= 32; i++)
            if (on_arc(q, i / 32.0L, ux, uy).h > on_arc(q, top / 32.0L, ux, uy).h) top = i;
        long double from = (top > 0 ? top - 1 : 0) / 32.0L, to = (top < 32 ? top + 1 : 32) / 32.0L;
        for (int step = 0; step < 60; step++) {
            const long double left = to - golden * (to - from), right = from + golden * (to - from);
            if (on_arc(q, left, ux, uy).h < on_arc(q, right, ux, uy).h)
                from = left;
            else
                to = right;
        }
        const long double ends[3] = {0, (from + to) / 2, 1};
        for (int k = 0; k < 3; k++) {
            const truth at = on_arc(q, ends[k], ux, uy);
            if (at.h > best.h) best = at;
        }
    }
    return best;
}

static truth truth_circle(long double ux, long double uy) {
    return (truth){1.5L * ux, 1.5L * uy, 1.5L, true};
}
static truth truth_ellipse(long double ux, long double uy) {
    return true_ellipse(3, 0.75L, ux, uy);
}
static truth truth_polygon(long double ux, long double uy) {
    return true_polygon(pentagon, 5, 0, ux, uy);
}
static truth truth_rounded(long double ux, long double uy) {
    return true_polygon(pentagon, 5, 0.7, ux, uy);
}
static truth truth_cubic(long double ux, long double uy) {
    dem2d_vec control[15];
    cut_corners(pentagon, 5, 0.8, control);
    return true_bezier(control, 5, ux, uy);
}
static truth truth_parabola(long double ux, long double uy) {
    dem2d_vec control[15];
    cut_corners(pentagon, 5, 2.0 / 3, control);
    return true_bezier(control, 5, ux, uy);
}
static truth truth_flat(long double ux, long double uy) {
    dem2d_vec control[24];
    turn_four(flat_quarter, 6, control);
    truth at = true_bezier(control, 8, ux, uy);
    at.unique = fabsl(ux) > 1e-4L && fabsl(uy) > 1e-4L;
    return at;
}
static truth truth_fs8(long double ux, long double uy) {
    return true_series(fs8_a, fs8_b, 8, ux, uy);
}
static truth truth_fs64(long double ux, long double uy) {
    double a[65], b[65];
    fs64(a, b);
    return true_series(a, b, 64, ux, uy);
}

typedef struct model {
    const char *name;
    dem2d_result (*make)(const dem2d_env *env, double scale, dem2d_shape **shape);
    truth (*truth)(long double ux, long double uy);
    /* of the farthest point, in R: round-off for closed forms; golden section finds a parameter
       only to the square root of the long double round-off */
    long double point_error;
    dem2d_shape_type type;
    int count;
    double rounding;
} model;

static const model models[] = {
    {"circle", try_circle, truth_circle, 1e-14L, DEM2D_CIRCLE, 0, 0},
    {"ellipse", try_ellipse, truth_ellipse, 1e-14L, DEM2D_ELLIPSE, 0, 0},
    {"polygon", try_polygon, truth_polygon, 1e-14L, DEM2D_POLYGON, 5, 0},
    {"rounded", try_rounded, truth_rounded, 1e-14L, DEM2D_POLYGON, 5, 0.7},
    {"cubic", try_cubic, truth_cubic, 1e-8L, DEM2D_BEZIER, 5, 0},
    {"parabola", try_parabola, truth_parabola, 1e-8L, DEM2D_BEZIER, 5, 0},
    {"flat", try_flat, truth_flat, 1e-8L, DEM2D_BEZIER, 8, 0},
    {"fs8", try_fs8, truth_fs8, 1e-14L, DEM2D_FOURIER, 8, 0},
    {"fs64", try_fs64, truth_fs64, 2e-14L, DEM2D_FOURIER, 64, 0},
    {"custom", try_custom, truth_ellipse, 1e-14L, DEM2D_CUSTOM, 0, 0},
};
#define EACH_MODEL(m) (const model *m = models; m < models + COUNT_OF(models); m++)

static dem2d_shape *make(const model *m, double scale, dem2d_shape_info *info) {
    dem2d_shape *shape = NULL;
    const dem2d_result result = m->make(NULL, scale, &shape);
    if (result) print_error("%s\n", m->name);
    assert_ok(result);
    assert_ok(dem2d_shape_get(shape, info));
    return shape;
}

static double reach(const dem2d_shape_info *info) {
    return info->circumscribed + hypot(info->offset.x, info->offset.y);
}

/* --- creation --------------------------------------------------------------------------------- */

/* A creation that fails: the right result, logged, output as it was, nothing left. */
static void check_rejected(const test_env *env, const char *name, dem2d_result got,
                           dem2d_result expected, const dem2d_shape *shape, const void *before) {
    if (got != expected || env->log.count == 0 || env->log.result != expected)
        print_error("%s: log \"%s\" (index %d)\n", name, env->log.text, env->log.index);
    assert_result(got, expected);
    assert_ptr_equal(shape, before);
    assert_true(env->log.count > 0);
    assert_result(env->log.result, expected);
    assert_clean(env);
}

static void circles_and_ellipses_are_checked(void **state) {
    (void)state;
    static const struct {
        double value;
        dem2d_result result;
    } bad[] = {{0, DEM2D_ZERO_AREA},          {-1, DEM2D_OUT_OF_RANGE},
               {-1e-300, DEM2D_OUT_OF_RANGE}, {NAN, DEM2D_NOT_FINITE},
               {HUGE_VAL, DEM2D_NOT_FINITE},  {-HUGE_VAL, DEM2D_NOT_FINITE}};
    test_env env;
    for (int i = 0; i < COUNT_OF(bad); i++) {
        dem2d_shape *shape = (dem2d_shape *)&env;
        test_env_init(&env);
        dem2d_result got = dem2d_shape_create_circle(&env.env, bad[i].value, &shape);
        check_rejected(&env, "circle", got, bad[i].result, shape, &env);
        assert_logged(&env, bad[i].result, -1, "radius");
        test_env_init(&env);
        got = dem2d_shape_create_ellipse(&env.env, bad[i].value, 1, &shape);
        check_rejected(&env, "a", got, bad[i].result, shape, &env);
        assert_logged(&env, bad[i].result, -1, "a");
        test_env_init(&env);
        got = dem2d_shape_create_ellipse(&env.env, 1, bad[i].value, &shape);
        check_rejected(&env, "b", got, bad[i].result, shape, &env);
        assert_logged(&env, bad[i].result, -1, "b");
    }
    assert_result(dem2d_shape_create_circle(NULL, 1, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_create_ellipse(NULL, 1, 1, NULL), DEM2D_NULL_ARGUMENT);
}

typedef struct bad_polygon {
    const char *name;
    dem2d_vec points[8];
    int count;
    double rounding;
    dem2d_result result;
    int index, other; /* what the log may name; -9: not checked */
    const char *word;
} bad_polygon;

static const bad_polygon bad_polygons[] = {
    {"none", {{0, 0}}, 0, 0, DEM2D_TOO_FEW_POINTS, -1, -9, NULL},
    {"negative count", {{0, 0}}, -1, 0, DEM2D_TOO_FEW_POINTS, -1, -9, NULL},
    {"two", {{0, 0}, {1, 0}}, 2, 0, DEM2D_TOO_FEW_POINTS, -1, -9, NULL},
    {"NaN", {{0, 0}, {1, 0}, {1, NAN}}, 3, 0, DEM2D_NOT_FINITE, 2, 2, NULL},
    {"infinite", {{0, 0}, {-HUGE_VAL, 0}, {1, 1}}, 3, 0, DEM2D_NOT_FINITE, 1, 1, NULL},
    {"duplicate", {{0, 0}, {1, 0}, {1, 0}, {0, 1}}, 4, 0, DEM2D_DUPLICATE_POINT, 1, 2, NULL},
    {"closed twice", {{0, 0}, {1, 0}, {0, 1}, {0, 0}}, 4, 0, DEM2D_DUPLICATE_POINT, 3, 0, NULL},
    {"all the same", {{1, 1}, {1, 1}, {1, 1}}, 3, 0, DEM2D_DUPLICATE_POINT, -9, -9, NULL},
    {"collinear", {{0, 0}, {1, 0}, {3, 0}}, 3, 0, DEM2D_ZERO_AREA, -9, -9, NULL},
    {"oblique", {{0, 0}, {1, 2}, {3, 6}, {2, 4}}, 4, 0.1, DEM2D_ZERO_AREA, -9, -9, NULL},
    {"dart", {{0, 0}, {2, 0}, {.5, .5}, {0, 2}}, 4, 0, DEM2D_NOT_CONVEX, 2, 2, NULL},
    {"dart, clockwise", {{0, 2}, {.5, .5}, {2, 0}, {0, 0}}, 4, 0, DEM2D_NOT_CONVEX, 1, 1, NULL},
    {"dent of 1e-6", {{0, 0}, {1, 1e-6}, {2, 0}, {1, 2}}, 4, 0, DEM2D_NOT_CONVEX, 1, 1, NULL},
    {"bow tie", {{0, 0}, {2, 2}, {2, 0}, {0, 1}}, 4, 0, DEM2D_NOT_CONVEX, -9, -9, NULL},
    {"pentagram",
     {{0, 1}, {-.6, -.8}, {.95, .3}, {-.95, .3}, {.6, -.8}},
     5,
     0,
     DEM2D_NOT_CONVEX,
     -9,
     -9,
     NULL},
    {"twice around",
     {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}, {1, 0}, {1, 1}, {0, 1}},
     8,
     0,
     DEM2D_NOT_CONVEX,
     -9,
     -9,
     NULL},
    {"rounding -1", {{0, 0}, {1, 0}, {0, 1}}, 3, -1, DEM2D_OUT_OF_RANGE, -1, -1, "rounding"},
    {"rounding NaN", {{0, 0}, {1, 0}, {0, 1}}, 3, NAN, DEM2D_NOT_FINITE, -1, -1, "rounding"},
};

static void polygons_are_checked(void **state) {
    (void)state;
    for (int i = 0; i < COUNT_OF(bad_polygons); i++) {
        const bad_polygon *bad = &bad_polygons[i];
        test_env env;
        test_env_init(&env);
        dem2d_shape *shape = (dem2d_shape *)&env;
        const dem2d_result got =
            dem2d_shape_create_polygon(&env.env, bad->points, bad->count, bad->rounding, &shape);
        check_rejected(&env, bad->name, got, bad->result, shape, &env);
        if (bad->index != -9 && env.log.index != bad->other)
            assert_logged(&env, bad->result, bad->index, bad->word);
        if (bad->word) assert_logged(&env, bad->result, -1, bad->word);
    }
    dem2d_shape *shape;
    assert_result(dem2d_shape_create_polygon(NULL, NULL, 3, 0, &shape), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_create_polygon(NULL, pentagon, 5, 0, NULL), DEM2D_NULL_ARGUMENT);
}

/* The same polygon with points on its edges, to rounding, or clockwise. */
static void polygons_are_cleaned(void **state) {
    (void)state;
    static const struct {
        dem2d_vec points[8];
        int count;
    } square[] = {
        {{{0, 0}, {1, 0}, {2, 0}, {2, 2}, {2. / 3, 2}, {0, 2}, {0, 0.1}}, 7},
        {{{1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}, {0, 0}}, 8},
        {{{0, 0}, {0, 2}, {2, 2}, {2, 0}}, 4},
        {{{2, 2}, {2, 1.5}, {2, 1}, {2, 0}, {0, 0}, {0, 2}}, 6},
        /* 1e-17 of the size out and in: neither a vertex nor a dent */
        {{{0, 0}, {1, -1e-17}, {2, 0}, {2, 2}, {1, 2}, {0, 2}}, 6},
        {{{0, 0}, {1, 1e-17}, {2, 0}, {2, 2}, {0, 2}}, 5},
    };
    for (int i = 0; i < COUNT_OF(square); i++) {
        dem2d_shape *shape;
        dem2d_shape_info info;
        assert_ok(dem2d_shape_create_polygon(NULL, square[i].points, square[i].count, 0, &shape));
        assert_ok(dem2d_shape_get(shape, &info));
        assert_int_equal(info.count, 4);
        assert_near(info.mass.area, 4, 1e-15L);
        assert_near(info.mass.polar_moment, 8.0L / 3, 2e-15L);
        assert_near(info.offset.x, 1, 1e-15L);
        assert_near(info.offset.y, 1, 1e-15L);
        for (int k = 0; k < 50; k++) {
            const dem2d_vec u = direction(0.13 * k);
            dem2d_support support;
            assert_ok(dem2d_shape_support(shape, still(), u, &support));
            assert_within(support.value, fabsl((long double)u.x) + fabsl((long double)u.y), 2e-15L);
        }
        dem2d_shape_destroy(shape);
    }
}

static void check_bezier(const char *name, const dem2d_vec *control, int arcs,
                         dem2d_result expected, int index, int other) {
    test_env env;
    test_env_init(&env);
    dem2d_shape *shape = (dem2d_shape *)&env;
    const dem2d_result got = dem2d_shape_create_bezier(&env.env, control, arcs, &shape);
    check_rejected(&env, name, got, expected, shape, &env);
    if (index != -9 && env.log.index != other) assert_logged(&env, expected, index, NULL);
}

static void beziers_are_checked(void **state) {
    (void)state;
    dem2d_vec c[24], twice[24];
    turn_four(circle_quarter, 3, c);
    check_bezier("one arc", c, 1, DEM2D_TOO_FEW_POINTS, -1, -1);
    check_bezier("too many arcs", c, INT_MAX / 12 + 1, DEM2D_OUT_OF_RANGE, -1, -1);
    check_bezier("none", c, 0, DEM2D_TOO_FEW_POINTS, -1, -1);
    check_bezier("negative", c, -4, DEM2D_TOO_FEW_POINTS, -1, -1);
    for (int i = 0; i < 24; i++) twice[i] = c[i % 12];
    check_bezier("twice around", twice, 8, DEM2D_NOT_CONVEX, -9, -9);
    for (int i = 0; i < 24; i++) twice[i] = vec(1, 2);
    check_bezier("a point", twice, 4, DEM2D_ZERO_AREA, -9, -9);
    c[4].y = NAN;
    check_bezier("NaN", c, 4, DEM2D_NOT_FINITE, 4, 1);
    /* A corner at the joint of arcs 0 and 1: each arc and the outline are still convex. */
    turn_four(circle_quarter, 3, c);
    c[4].y = 0.95;
    check_bezier("corner", c, 4, DEM2D_NOT_SMOOTH, 1, 0);
    /* 1e-4 rad off: more than the rounding of any file */
    c[4].y = 1 - 1e-4 * KAPPA;
    check_bezier("slight corner", c, 4, DEM2D_NOT_SMOOTH, 1, 0);
    /* Handles of arc 2 beyond the crossing of the tangents: it bends the wrong way first. */
    turn_four(circle_quarter, 3, c);
    c[7].y = -1.5, c[8].x = -1.5;
    check_bezier("dent", c, 4, DEM2D_NOT_CONVEX, 2, 2);
    /* Squares of four flat arcs: tangents differ at the corners, with or without a handle. */
    const dem2d_vec sides[][3] = {{{1.5, -1.5}, {1.5, -.5}, {1.5, .5}},
                                  {{1.5, -1.5}, {1.5, -1.5}, {1.5, 1.5}}};
    for (int i = 0; i < 2; i++) {
        turn_four(sides[i], 3, c);
        check_bezier("square", c, 4, DEM2D_NOT_SMOOTH, -9, -9);
    }
    dem2d_shape *shape;
    assert_result(dem2d_shape_create_bezier(NULL, NULL, 4, &shape), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_create_bezier(NULL, c, 4, NULL), DEM2D_NULL_ARGUMENT);
}

/* A round square of eight arcs, some of them degenerate: Q0 = Q1, Q2 = Q3, four equal steps on a
   line (M3 = M4 = 0). Clockwise is the same shape. */
static void flat_and_clockwise_beziers(void **state) {
    (void)state;
    static const dem2d_vec quarters[][6] = {
        {{2.5, -1.5}, {2.5, -.5}, {2.5, .5}, {2.5, 1.5}, {2.5, 2}, {2, 2.5}},
        {{2.5, -1.5}, {2.5, -1.5}, {2.5, .5}, {2.5, 1.5}, {2.5, 2}, {2, 2.5}},
        {{2.5, -1.5}, {2.5, 0}, {2.5, 1.5}, {2.5, 1.5}, {2.5, 2}, {2, 2.5}},
        {{2.5, -1.5}, {2.5, -1.5}, {2.5, 1.5}, {2.5, 1.5}, {2.5, 2}, {2, 2.5}},
        {{2.5, -1.5}, {2.5, -1.2}, {2.5, 1.2}, {2.5, 1.5}, {2.5, 1.5}, {2.5, 2.5}},
        {{2.5, -1.5}, {2.5, -1.2}, {2.5, 1.2}, {2.5, 1.5}, {2.5, 2.5}, {1.5, 2.5}},
    };
    for (int i = 0; i < 2 * COUNT_OF(quarters); i++) {
        dem2d_vec control[24], turned[24];
        turn_four(quarters[i / 2], 6, control);
        for (int k = 0; k < 24; k++) turned[k] = control[(24 - k) % 24];
        dem2d_shape *shape;
        dem2d_shape_info info;
        assert_ok(dem2d_shape_create_bezier(NULL, i % 2 ? turned : control, 8, &shape));
        assert_ok(dem2d_shape_get(shape, &info));
        /* by its symmetry */
        assert_within(hypot(info.offset.x, info.offset.y), 0, 1e-15L);
        for (int k = 0; k < 64; k++) {
            const dem2d_vec u =
                k < 4 ? vec((k == 0) - (k == 1), (k == 2) - (k == 3)) : direction(0.1 * k);
            dem2d_support support;
            assert_ok(dem2d_shape_support(shape, still(), u, &support));
            assert_within(support.value, true_bezier(control, 8, u.x, u.y).h, 1e-14L);
            assert_true(support.rho >= info.rho_min * (1 - 1e-12));
            if (k < 4) assert_near(support.value, 2.5L, 1e-15L);
        }
        dem2d_shape_destroy(shape);
    }
}

static void check_series(const char *name, const double *a, const double *b, int order,
                         dem2d_result expected, int index, const char *word) {
    test_env env;
    test_env_init(&env);
    dem2d_shape *shape = (dem2d_shape *)&env;
    const dem2d_result got = dem2d_shape_create_fourier(&env.env, a, b, order, &shape);
    check_rejected(&env, name, got, expected, shape, &env);
    if (word) assert_logged(&env, expected, index, word);
}

static void series_are_checked(void **state) {
    (void)state;
    double a[9] = {4}, b[9] = {NAN}; /* b[0] is not read */
    check_series("order", a, b, -1, DEM2D_OUT_OF_RANGE, -1, "order");
    a[2] = HUGE_VAL;
    check_series("a infinite", a, b, 8, DEM2D_NOT_FINITE, 2, "a");
    a[2] = 0, b[8] = NAN;
    check_series("b NaN", a, b, 8, DEM2D_NOT_FINITE, 8, "b");
    b[8] = 0, a[0] = 0;
    check_series("zero", a, b, 8, DEM2D_ZERO_AREA, -9, NULL);
    check_series("zero, order 0", a, b, 0, DEM2D_ZERO_AREA, -9, NULL);
    a[0] = 2, a[2] = 0.4; /* rho = 1 - 1.2 cos 2t */
    check_series("clearly", a, b, 8, DEM2D_NEGATIVE_CURVATURE, -9, NULL);
    dem2d_shape *shape;
    assert_result(dem2d_shape_create_fourier(NULL, NULL, b, 8, &shape), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_create_fourier(NULL, a, NULL, 8, &shape), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_create_fourier(NULL, a, b, 8, NULL), DEM2D_NULL_ARGUMENT);
}

/* One pair of order n with a0/2 = (n^2 - 1) |c_n|: rho touches 0, which is allowed; 1e-12 of a0/2
   less is not. The (3, 4, 5) triangle gives |c_n| at a phase that no sample hits. */
static void series_at_the_limit(void **state) {
    (void)state;
    for (int n = 2; n <= 16; n++) {
        for (int phase = 0; phase < 3; phase++) {
            double a[17] = {0}, b[17] = {0};
            a[0] = 2 * (n * n - 1) * 5;
            a[n] = phase == 0 ? -5 : phase == 1 ? 3 : 0, b[n] = phase == 0 ? 0 : phase == 1 ? 4 : 5;
            dem2d_shape *shape;
            assert_ok(dem2d_shape_create_fourier(NULL, a, b, n, &shape));
            dem2d_shape_info info;
            assert_ok(dem2d_shape_get(shape, &info));
            assert_between(info.rho_min, 0, 1e-13L * a[0]);
            dem2d_shape_destroy(shape);
            a[0] *= 1 - 1e-12;
            check_series("limit", a, b, n, DEM2D_NEGATIVE_CURVATURE, -9, NULL);
        }
    }
}

static dem2d_vec bad_callback(void *user, dem2d_vec u, double *rho) {
    if (rho) *rho = 0;
    return vec(*(const double *)user * u.x, *(const double *)user * u.y);
}

static void customs_are_checked(void **state) {
    (void)state;
    static double one = 1, zero = 0, nan_size = NAN;
    struct {
        dem2d_custom_desc desc;
        dem2d_result result;
        const char *word;
    } bad[] = {
        {{0}, DEM2D_NULL_ARGUMENT, "support"},
        {{bad_callback, &one, -1, 0, {0, {0, 0}, 0}, 0, 0}, DEM2D_OUT_OF_RANGE, "rho_min"},
        {{bad_callback, &one, NAN, 0, {0, {0, 0}, 0}, 0, 0}, DEM2D_NOT_FINITE, "rho_min"},
        {{bad_callback, &one, 0, -1, {0, {0, 0}, 0}, 0, 0}, DEM2D_OUT_OF_RANGE, "inscribed"},
        {{bad_callback, &one, 0, HUGE_VAL, {0, {0, 0}, 0}, 0, 0}, DEM2D_NOT_FINITE, "inscribed"},
        {{bad_callback, &one, 0, 0, {0, {0, 0}, 0}, 2, 0}, DEM2D_OUT_OF_RANGE, "outline_points"},
        {{bad_callback, &one, 0, 0, {0, {0, 0}, 0}, -1, 0}, DEM2D_OUT_OF_RANGE, "outline_points"},
        {{bad_callback, &one, 0, 0, {NAN, {0, 0}, 1}, 0, 0}, DEM2D_NOT_FINITE, NULL},
        {{bad_callback, &one, 0, 0, {1, {0, NAN}, 1}, 0, 0}, DEM2D_NOT_FINITE, NULL},
        {{bad_callback, &one, 0, 0, {1, {0, 0}, -1}, 0, 0}, DEM2D_OUT_OF_RANGE, NULL},
        {{bad_callback, &zero, 0, 0, {0, {0, 0}, 0}, 0, 0}, DEM2D_ZERO_AREA, NULL},
        {{bad_callback, &nan_size, 0, 0, {0, {0, 0}, 0}, 0, 0}, DEM2D_NOT_FINITE, NULL},
    };
    for (int i = 0; i < COUNT_OF(bad); i++) {
        test_env env;
        test_env_init(&env);
        dem2d_shape *shape = (dem2d_shape *)&env;
        const dem2d_result got = dem2d_shape_create_custom(&env.env, &bad[i].desc, &shape);
        check_rejected(&env, "custom", got, bad[i].result, shape, &env);
        if (bad[i].word) assert_logged(&env, bad[i].result, -1, bad[i].word);
    }
    dem2d_shape *shape;
    assert_result(dem2d_shape_create_custom(NULL, NULL, &shape), DEM2D_NULL_ARGUMENT);
    bad[1].desc.rho_min = 0;
    assert_result(dem2d_shape_create_custom(NULL, &bad[1].desc, NULL), DEM2D_NULL_ARGUMENT);
}

static void every_allocation_can_fail(void **state) {
    (void)state;
    for
        EACH_MODEL(m) {
            int failed = 0;
            for (int k = 1;; k++) {
                assert_true(k < 100);
                test_env env;
                test_env_init(&env);
                test_env_fail(&env, k);
                dem2d_shape *shape = (dem2d_shape *)&env;
                const dem2d_result result = m->make(&env.env, 1, &shape);
                if (result == DEM2D_OK) {
                    dem2d_shape_info info;
                    assert_ok(dem2d_shape_get(shape, &info));
                    assert_int_equal(info.bytes, env.bytes);
                    dem2d_shape_destroy(shape);
                    assert_clean(&env);
                    break;
                }
                failed++;
                check_rejected(&env, m->name, result, DEM2D_OUT_OF_MEMORY, shape, &env);
            }
            assert_true(failed > 0);
        }
    dem2d_shape_destroy(NULL);
}

/* --- support ---------------------------------------------------------------------------------- */

static void check_support(const model *m, const dem2d_shape *shape, const dem2d_shape_info *info,
                          dem2d_vec d) {
    dem2d_support s;
    assert_ok(dem2d_shape_support(shape, still(), d, &s));
    const long double length = hypotl(d.x, d.y), ux = d.x / length, uy = d.y / length;
    const truth t = m->truth(ux, uy);
    const long double h = t.h - (info->offset.x * ux + info->offset.y * uy), size = reach(info);
    if (fabsl(s.value - h) > 1e-14L * size) print_error("%s: (%a, %a)\n", m->name, d.x, d.y);
    /* the rounding of u, of the sums and of the centroid: a dozen eps of the size each */
    assert_within(s.value, h, 1e-14L * size);
    assert_within(s.direction.x, ux, 4e-16L);
    assert_within(s.direction.y, uy, 4e-16L);
    assert_within(s.point.x * ux + s.point.y * uy, s.value, 2e-15L * size);
    if (!t.unique) return;
    assert_within(s.point.x, t.x - info->offset.x, m->point_error * size);
    assert_within(s.point.y, t.y - info->offset.y, m->point_error * size);
}

/* Axes, diagonals, edge normals of the pentagon, and their neighbours by one ulp. */
static int hard_directions(dem2d_vec *d) {
    static const dem2d_vec base[] = {{1, 0},  {0, 1},   {-1, 0},  {0, -1},  {1, 1},
                                     {-1, 1}, {-1, -1}, {1, -1},  {-1, -4}, {3, -2},
                                     {3, 3},  {-2, 4},  {-3, -1}, {3, 4},   {0.6, 0.8}};
    int count = 0;
    for (int i = 0; i < COUNT_OF(base); i++) {
        d[count++] = base[i];
        for (int k = 0; k < 2; k++) {
            const double to = k ? 9 : -9;
            d[count++] = vec(nextafter(base[i].x, to), base[i].y);
            d[count++] = vec(base[i].x, nextafter(base[i].y, to));
        }
        d[count++] = vec(base[i].x + 1e-17, base[i].y - 1e-16);
    }
    return count;
}

static void support_is_the_farthest_point(void **state) {
    (void)state;
    for
        EACH_MODEL(m) {
            dem2d_shape_info info;
            dem2d_shape *shape = make(m, 1, &info);
            dem2d_vec hard[128];
            const int count = hard_directions(hard);
            for (int i = 0; i < count; i++) check_support(m, shape, &info, hard[i]);
            uint64_t random = 7;
            for (int i = 0; i < 300; i++)
                check_support(m, shape, &info,
                              vec(random_between(&random, -1, 1), random_between(&random, -1, 1)));
            dem2d_shape_destroy(shape);
        }
}

/* rho = h + h'' by central differences with steps 1e-4 and 2e-4: truncation h'''' e^2 / 12 is
   below 1e-6 of the size for these shapes; where the two steps disagree there is a joint. */
static void rho_is_the_radius_of_curvature(void **state) {
    (void)state;
    for
        EACH_MODEL(m) {
            dem2d_shape_info info;
            dem2d_shape *shape = make(m, 1, &info);
            uint64_t random = 11;
            int compared = 0;
            for (int i = 0; i < 100; i++) {
                const dem2d_vec d = direction(random_between(&random, 0, 6.3));
                const long double t = atan2l(d.y, d.x), step = 1e-4L;
                long double h[5], rho[3];
                for (int k = 0; k < 5; k++)
                    h[k] = m->truth(cosl(t + (k - 2) * step), sinl(t + (k - 2) * step)).h;
                for (int k = 1; k < 3; k++)
                    rho[k] = h[2] + (h[2 + k] - 2 * h[2] + h[2 - k]) / (k * k * step * step);
                if (fabsl(rho[1] - rho[2]) > 1e-5L * (info.circumscribed + rho[1])) continue;
                compared++;
                dem2d_support s;
                assert_ok(dem2d_shape_support(shape, still(), d, &s));
                assert_within(s.rho, rho[1], 2e-5L * (info.circumscribed + rho[1]));
                if (m->type == DEM2D_POLYGON) assert_within(s.rho, m->rounding, 1e-15L);
                assert_true(s.rho >= info.rho_min * (1 - 1e-12));
            }
            assert_true(compared > 80);
            dem2d_shape_destroy(shape);
        }
    dem2d_shape_info info;
    dem2d_shape *shape = NULL;
    assert_ok(try_flat(NULL, 1, &shape));
    assert_ok(dem2d_shape_get(shape, &info));
    dem2d_support s;
    assert_ok(dem2d_shape_support(shape, still(), vec(0, 3), &s));
    assert_true(s.rho > 0); /* of the round arc at one end of the flat */
    assert_between(s.point.x, -1.5L - 1e-14L, 1.5L + 1e-14L);
    dem2d_shape_destroy(shape);
}

/* Any length of direction: from denormal to the largest doubles. */
static void directions_of_any_length(void **state) {
    (void)state;
    static const int powers[] = {-1074, -1060, -1030, -1022, -499, -1, 0, 3, 499, 1020};
    for
        EACH_MODEL(m) {
            dem2d_shape_info info;
            dem2d_shape *shape = make(m, 1, &info);
            for (int i = 0; i < COUNT_OF(powers); i++) {
                check_support(m, shape, &info, vec(ldexp(3, powers[i]), ldexp(-4, powers[i])));
                check_support(m, shape, &info, vec(0, ldexp(-1, powers[i])));
            }
            check_support(m, shape, &info, vec(DBL_MAX, -DBL_MAX));
            check_support(m, shape, &info, vec(1e-310, 2e-310));
            check_support(m, shape, &info, vec(1, -1e-310));
            check_support(m, shape, &info, vec(-1e150, 1e-150));
            dem2d_shape_destroy(shape);
        }
}

static void bad_support_queries(void **state) {
    (void)state;
    const dem2d_pose ok = still();
    const struct {
        dem2d_pose pose;
        dem2d_vec d;
        dem2d_result result;
    } bad[] = {
        {ok, {0, 0}, DEM2D_OUT_OF_RANGE},
        {ok, {-0.0, 0}, DEM2D_OUT_OF_RANGE},
        {ok, {NAN, 1}, DEM2D_NOT_FINITE},
        {ok, {1, HUGE_VAL}, DEM2D_NOT_FINITE},
        {{{0, 0}, {1, 0}, 0}, {1, 0}, DEM2D_OUT_OF_RANGE},
        {{{0, 0}, {1, 0}, -1}, {1, 0}, DEM2D_OUT_OF_RANGE},
        {{{0, 0}, {1, 0}, NAN}, {1, 0}, DEM2D_NOT_FINITE},
        {{{0, NAN}, {1, 0}, 1}, {1, 0}, DEM2D_NOT_FINITE},
        {{{0, 0}, {NAN, 0}, 1}, {1, 0}, DEM2D_NOT_FINITE},
    };
    dem2d_shape_info info;
    dem2d_shape *shape = make(&models[0], 1, &info);
    dem2d_support s, before;
    memset(&s, 0x5a, sizeof s), before = s;
    for (int i = 0; i < COUNT_OF(bad); i++) {
        assert_result(dem2d_shape_support(shape, bad[i].pose, bad[i].d, &s), bad[i].result);
        assert_memory_equal(&s, &before, sizeof s);
        if (i < 4) continue;
        dem2d_box box;
        dem2d_vec points[8];
        bool inside;
        assert_result(dem2d_shape_aabb(shape, bad[i].pose, &box), bad[i].result);
        assert_result(dem2d_shape_outline(shape, bad[i].pose, 8, points), bad[i].result);
        assert_result(dem2d_shape_contains(shape, bad[i].pose, vec(0, 0), &inside), bad[i].result);
    }
    dem2d_box box;
    dem2d_vec points[8];
    bool inside;
    assert_result(dem2d_shape_contains(shape, ok, vec(0, NAN), &inside), DEM2D_NOT_FINITE);
    assert_result(dem2d_shape_support(NULL, ok, vec(1, 0), &s), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_support(shape, ok, vec(1, 0), NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_get(NULL, &info), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_get(shape, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_aabb(NULL, ok, &box), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_aabb(shape, ok, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_outline(NULL, ok, 8, points), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_outline(shape, ok, 8, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_outline(shape, ok, 2, points), DEM2D_TOO_FEW_POINTS);
    assert_result(dem2d_shape_outline(shape, ok, -1, points), DEM2D_TOO_FEW_POINTS);
    assert_result(dem2d_shape_contains(NULL, ok, vec(0, 0), &inside), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_contains(shape, ok, vec(0, 0), NULL), DEM2D_NULL_ARGUMENT);
    dem2d_shape_destroy(shape);
}

/* Input times 2^k: every length times 2^k, to the bit. 2^199 is about 1e60. */
static void sizes_are_exact_powers_of_two(void **state) {
    (void)state;
    static const int powers[] = {-199, -40, 1, 40, 199};
    for
        EACH_MODEL(m) {
            dem2d_shape_info one, info;
            dem2d_shape *unit = make(m, 1, &one);
            for (int i = 0; i < COUNT_OF(powers); i++) {
                const int k = powers[i];
                dem2d_shape *shape = make(m, ldexp(1, k), &info);
                assert_same_bits(info.mass.area, ldexp(one.mass.area, 2 * k));
                assert_same_bits(info.mass.polar_moment, ldexp(one.mass.polar_moment, 4 * k));
                assert_same_bits(info.offset.x, ldexp(one.offset.x, k));
                assert_same_bits(info.circumscribed, ldexp(one.circumscribed, k));
                assert_same_bits(info.inscribed, ldexp(one.inscribed, k));
                assert_same_bits(info.rho_min, ldexp(one.rho_min, k));
                assert_same_bits(info.equivalent, ldexp(one.equivalent, k));
                for (int j = 0; j < 64; j++) {
                    const dem2d_vec u = direction(0.1 * j);
                    const dem2d_pose pose = {{0, 0}, {1, 0}, ldexp(1, k)};
                    dem2d_support a, b, c;
                    assert_ok(dem2d_shape_support(unit, still(), u, &a));
                    assert_ok(dem2d_shape_support(shape, still(), u, &b));
                    assert_ok(dem2d_shape_support(unit, pose, u, &c));
                    assert_true(b.value == ldexp(a.value, k) && c.value == b.value);
                    assert_true(b.point.x == ldexp(a.point.x, k) && c.point.x == b.point.x);
                    assert_true(b.point.y == ldexp(a.point.y, k) && c.point.y == b.point.y);
                    assert_true(b.rho == ldexp(a.rho, k) && c.rho == b.rho);
                }
                dem2d_shape_destroy(shape);
            }
            dem2d_shape_destroy(unit);
        }
}

/* Turned by exact right angles (== and not bits: the sign of a zero may differ). */
static void right_angles_are_exact(void **state) {
    (void)state;
    for
        EACH_MODEL(m) {
            dem2d_shape_info info;
            dem2d_shape *shape = make(m, 1, &info);
            for (int i = 0; i < 100; i++) {
                dem2d_support a, b;
                const dem2d_vec u = direction(0.0628 * i);
                dem2d_pose pose = still();
                assert_ok(dem2d_shape_support(shape, pose, u, &a));
                pose.rotation.c = 0, pose.rotation.s = 1;
                assert_ok(dem2d_shape_support(shape, pose, vec(-u.y, u.x), &b));
                assert_true(b.value == a.value && b.rho == a.rho);
                assert_true(b.point.x == -a.point.y && b.point.y == a.point.x);
                pose.rotation.c = -1, pose.rotation.s = 0;
                assert_ok(dem2d_shape_support(shape, pose, vec(-u.x, -u.y), &b));
                assert_true(b.point.x == -a.point.x && b.point.y == -a.point.y);
            }
            dem2d_shape_destroy(shape);
        }
}

/* 3 to 1000 vertices on an ellipse 3:1; every edge normal, its neighbours, and random ones. */
static void polygons_of_many_vertices(void **state) {
    (void)state;
    static const int counts[] = {3, 4, 5, 8, 9, 16, 17, 33, 100, 1000};
    uint64_t random = 3;
    for (int i = 0; i < COUNT_OF(counts); i++) {
        const int n = counts[i];
        static dem2d_vec points[1000];
        for (int k = 0; k < n; k++) {
            const dem2d_vec u = direction(6.283185 * (k + random_between(&random, 0, 0.8)) / n);
            points[k] = vec(3 * u.x + 10, u.y - 20);
        }
        dem2d_shape *shape;
        dem2d_shape_info info;
        assert_ok(dem2d_shape_create_polygon(NULL, points, n, 0, &shape));
        assert_ok(dem2d_shape_get(shape, &info));
        assert_int_equal(info.count, n);
        for (int k = 0; k < 4 * n; k++) {
            const dem2d_vec p = points[k / 4], q = points[(k / 4 + 1) % n];
            dem2d_vec d = {q.y - p.y, p.x - q.x};
            if (k % 4 == 1) d.x = nextafter(d.x, 9);
            if (k % 4 == 2) d.x = nextafter(d.x, -9);
            if (k % 4 == 3) d = direction(random_between(&random, 0, 6.3));
            const long double length = hypotl(d.x, d.y), ux = d.x / length, uy = d.y / length;
            const long double h =
                true_polygon(points, n, 0, ux, uy).h - (info.offset.x * ux + info.offset.y * uy);
            dem2d_support s;
            assert_ok(dem2d_shape_support(shape, still(), d, &s));
            /* points lie about 25 from the origin: 8 eps of that */
            assert_within(s.value, h, 5e-14L);
            if (k % 4 == 3) assert_true(s.rho == 0);
        }
        dem2d_shape_destroy(shape);
    }
}

/* --- boxes, outlines, facts, containment -------------------------------------------------------
 */

#define RIM 2048
typedef struct rim {
    long double ux[RIM], uy[RIM], h[RIM]; /* true support about the centroid */
} rim;

static void rim_make(const model *m, const dem2d_shape_info *info, rim *r) {
    for (int i = 0; i < RIM; i++) {
        const long double t = 2 * TEST_PI * (i + 0.3L) / RIM;
        r->ux[i] = cosl(t), r->uy[i] = sinl(t);
        r->h[i] =
            m->truth(r->ux[i], r->uy[i]).h - info->offset.x * r->ux[i] - info->offset.y * r->uy[i];
    }
}

/* How deep a point lies inside: the least gap to the tangents. Outside it is negative. */
static long double rim_depth(const rim *r, dem2d_vec p) {
    long double depth = HUGE_VALL;
    for (int i = 0; i < RIM; i++) depth = fminl(depth, r->h[i] - p.x * r->ux[i] - p.y * r->uy[i]);
    return depth;
}

static void boxes_are_exact(void **state) {
    (void)state;
    for
        EACH_MODEL(m) {
            dem2d_shape_info info;
            dem2d_shape *shape = make(m, 1, &info);
            for (int i = 0; i < 50; i++) {
                const double angle = 0.13 * i;
                const dem2d_pose pose = {{10, -4}, {cos(angle), sin(angle)}, 2.5};
                dem2d_box box;
                assert_ok(dem2d_shape_aabb(shape, pose, &box));
                long double side[4];
                for (int k = 0; k < 4; k++) {
                    const dem2d_vec u = {(k == 0) - (k == 1), (k == 2) - (k == 3)};
                    const long double x =
                        (long double)pose.rotation.c * u.x + pose.rotation.s * u.y;
                    const long double y =
                        (long double)pose.rotation.c * u.y - pose.rotation.s * u.x;
                    side[k] = 2.5L * (m->truth(x, y).h - info.offset.x * x - info.offset.y * y);
                }
                const long double allowed = 4e-14L * reach(&info);
                assert_within(box.upper.x, 10 + side[0], allowed);
                assert_within(box.lower.x, 10 - side[1], allowed);
                assert_within(box.upper.y, -4 + side[2], allowed);
                assert_within(box.lower.y, -4 - side[3], allowed);
            }
            dem2d_shape_destroy(shape);
        }
}

/* Points of an outline touch a tangent: the nearest of RIM directions is at most pi / RIM away, so
   a boundary point seems 1.2e-6 R deep at most (R^2 / rho more where it is flat). */
static void outlines_lie_on_the_boundary(void **state) {
    (void)state;
    static const int counts[] = {3, 7, 100, 400};
    static rim r;
    for
        EACH_MODEL(m) {
            dem2d_shape_info info;
            dem2d_shape *shape = make(m, 1, &info);
            rim_make(m, &info, &r);
            for (int i = 0; i < COUNT_OF(counts); i++) {
                const int n = counts[i];
                dem2d_vec p[400], q[400];
                const dem2d_pose pose = {{5, -7}, {0.6, 0.8}, 0.5};
                assert_ok(dem2d_shape_outline(shape, still(), n, p));
                assert_ok(dem2d_shape_outline(shape, pose, n, q));
                long double area = 0;
                for (int k = 0; k < n; k++) {
                    const dem2d_vec a = p[k], b = p[(k + 1) % n], c = p[(k + 2) % n];
                    const long double size = info.circumscribed;
                    /* a tangent misses a point between two directions by up to (pi / RIM) of the
                       distance along a flat side */
                    assert_between(rim_depth(&r, a), -1e-14L * reach(&info), 2e-3L * size);
                    const long double turn = ((long double)b.x - a.x) * (c.y - b.y) -
                                             ((long double)b.y - a.y) * (c.x - b.x);
                    if (turn < -1e-14L * size * size) print_error("%s, %d points\n", m->name, n);
                    assert_true(turn >= -1e-14L * size * size);
                    assert_true(hypot(b.x - a.x, b.y - a.y) > 0);
                    area += ((long double)a.x * b.y - (long double)a.y * b.x) / 2;
                    assert_within(q[k].x, 5 + 0.5L * (0.6L * a.x - 0.8L * a.y), 1e-14L * size);
                    assert_within(q[k].y, -7 + 0.5L * (0.8L * a.x + 0.6L * a.y), 1e-14L * size);
                }
                assert_between(area, 0, info.mass.area * (1 + 1e-14L));
                if (n == 400) assert_near(area, info.mass.area, 2e-3L);
            }
            dem2d_shape_destroy(shape);
        }
}

static void facts_hold(void **state) {
    (void)state;
    static rim r;
    for
        EACH_MODEL(m) {
            dem2d_shape_info info;
            dem2d_shape *shape = make(m, 1, &info);
            assert_int_equal(info.type, m->type);
            assert_int_equal(info.count, m->count);
            assert_same_bits(info.rounding, m->rounding);
            assert_true(info.mass.centroid.x == 0 && info.mass.centroid.y == 0);
            assert_near(info.equivalent, sqrtl(info.mass.area / TEST_PI), 1e-15L);
            rim_make(m, &info, &r);
            long double least = HUGE_VALL, most = 0;
            for (int i = 0; i < RIM; i++) {
                dem2d_support s;
                const dem2d_vec u = vec((double)r.ux[i], (double)r.uy[i]);
                assert_ok(dem2d_shape_support(shape, still(), u, &s));
                least = fminl(least, r.h[i]);
                most = fmaxl(most, hypotl(s.point.x, s.point.y));
                assert_true(s.rho >= info.rho_min * (1 - 1e-12));
            }
            /* safe on their side; and of use: within 1 % of the truth, but for four-call boxes */
            assert_true(info.circumscribed >= most * (1 - 1e-15L));
            assert_true(info.circumscribed <= most * (m->type == DEM2D_CUSTOM ? 1.5L : 1.01L));
            assert_between(info.inscribed, 0.99L * least, least * (1 + 1e-14L));
            assert_true(info.rho_min >= 0);
            if (m->type == DEM2D_CIRCLE) assert_same_bits(info.rho_min, 1.5);
            if (m->type == DEM2D_ELLIPSE) assert_near(info.rho_min, 0.1875L, 1e-14L);
            if (m->type == DEM2D_POLYGON) assert_same_bits(info.rho_min, m->rounding);
            if (m->type == DEM2D_FOURIER) assert_true(info.rho_min > 0);
            dem2d_shape_destroy(shape);
        }
}

static void containment(void **state) {
    (void)state;
    static rim r;
    const dem2d_pose pose = {{3, -2}, {-0.28, 0.96}, 4};
    for
        EACH_MODEL(m) {
            dem2d_shape_info info;
            dem2d_shape *shape = make(m, 1, &info);
            rim_make(m, &info, &r);
            uint64_t random = 5;
            int in = 0, out = 0;
            bool inside;
            for (int i = 0; i < 300; i++) {
                const double size = 1.2 * info.circumscribed;
                const dem2d_vec p = {random_between(&random, -size, size),
                                     random_between(&random, -size, size)};
                const dem2d_vec q = {3 + 4 * (-0.28 * p.x - 0.96 * p.y),
                                     -2 + 4 * (0.96 * p.x - 0.28 * p.y)};
                const long double depth = rim_depth(&r, p);
                assert_ok(dem2d_shape_contains(shape, pose, q, &inside));
                if (depth > 4e-3L * size) assert_true(inside), in++;
                if (depth < -1e-12L * size) assert_false(inside), out++;
            }
            assert_true(in > 20 && out > 50);
            /* across the boundary: a support point, and 1e-9 of its distance in and out of it */
            for (int i = 0; i < 100; i++) {
                dem2d_support s;
                assert_ok(dem2d_shape_support(shape, still(), direction(0.0628 * i), &s));
                for (int k = -1; k <= 1; k++) {
                    const dem2d_vec p = {s.point.x * (1 + 1e-9 * k), s.point.y * (1 + 1e-9 * k)};
                    assert_ok(dem2d_shape_contains(shape, still(), p, &inside));
                    assert_int_equal(inside, k <= 0);
                }
            }
            dem2d_shape_destroy(shape);
        }
}

/* --- rotations, poses, texts -------------------------------------------------------------------
 */

static void rotations_and_poses(void **state) {
    (void)state;
    uint64_t random = 1;
    for (int i = 0; i < 2000; i++) {
        const double sizes[] = {1e-300, 1e-8, 1, 4, 1e3, 1e6, 0x1p30};
        double angle = sizes[i % 7] * random_between(&random, -1, 1);
        if (i < 40) angle = (i - 20) * 1.5707963267948966;
        const dem2d_rot rot = dem2d_rot_make(angle);
        assert_within(rot.c, cosl(angle), 4e-16L);
        assert_within(rot.s, sinl(angle), 4e-16L);
        assert_within((long double)rot.c * rot.c + (long double)rot.s * rot.s, 1, 5e-16L);
        const double back = dem2d_rot_angle(rot); /* in (-pi, pi]: -pi comes back as pi */
        assert_within(remainderl(back - atan2l(rot.s, rot.c), 2 * TEST_PI), 0, 1e-15L);
        assert_true(back > -3.141592653589793 && back <= 3.141592653589793);
    }
    assert_same_bits(dem2d_rot_make(0).c, 1);
    assert_true(dem2d_rot_make(0).s == 0);
    assert_near(dem2d_rot_angle((dem2d_rot){-1, 0}), TEST_PI, 2e-16L);
    const dem2d_pose pose = dem2d_pose_make(1, -2, 0.5, 3);
    assert_true(pose.position.x == 1 && pose.position.y == -2 && pose.scale == 3);
    assert_same_bits(pose.rotation.s, dem2d_rot_make(0.5).s);
}

static void texts_and_version(void **state) {
    (void)state;
    char version[32];
    snprintf(version, sizeof version, "%d.%d.%d", DEM2D_VERSION / 10000, DEM2D_VERSION / 100 % 100,
             DEM2D_VERSION % 100);
    assert_string_equal(version, DEM2D_VERSION_STRING);
    assert_int_equal(dem2d_version(), DEM2D_VERSION);
    for (int i = 0; i < DEM2D_RESULT_COUNT; i++) {
        const char *text = dem2d_result_text((dem2d_result)i);
        assert_non_null(text);
        for (int k = 0; k < i; k++)
            assert_string_not_equal(text, dem2d_result_text((dem2d_result)k));
    }
    assert_string_equal(dem2d_result_text(DEM2D_OK), "no error");
    assert_non_null(dem2d_result_text(DEM2D_RESULT_COUNT));
    assert_non_null(dem2d_result_text((dem2d_result)1000));
}

/* rho = (1 + cos 2t)^n is 0 to order 2n at two angles: decided, and quickly. */
static void flat_valleys(void **state) {
    (void)state;
    for (int n = 2; n <= 32; n *= 2) {
        double a[65] = {2}, b[65] = {0}, c = 1;
        for (int k = 1; k <= n; k++) {
            c *= (double)(n - k + 1) / (n + k);
            a[2 * k] = 2 * c / (1 - 4.0 * k * k);
        }
        dem2d_convexity convexity;
        dem2d_shape *shape;
        assert_ok(dem2d_fourier_convexity(a, b, 2 * n, &convexity));
        assert_between(convexity.rho_min_lower, -1e-12L, convexity.rho_min_upper);
        assert_ok(dem2d_shape_create_fourier(NULL, a, b, 2 * n, &shape));
        dem2d_shape_destroy(shape);
    }
}

static void angles_without_digits(void **state) {
    (void)state;
    const double angles[] = {NAN, HUGE_VAL, -HUGE_VAL, 1.1e9, -1e300};
    for (int i = 0; i < 5; i++) {
        const dem2d_rot q = dem2d_rot_make(angles[i]);
        assert_true(isnan(q.c) && isnan(q.s));
    }
    const dem2d_rot q = dem2d_rot_make(1073741824.0);
    assert_within(hypotl(q.c, q.s), 1, 4e-16L);
}

/* Half an allocator is none: what malloc made must go to free. */
static void allocator_without_release(void **state) {
    (void)state;
    test_env env;
    dem2d_shape *shape;
    test_env_init(&env);
    env.env.release = NULL;
    assert_ok(dem2d_shape_create_circle(&env.env, 1, &shape));
    assert_int_equal(env.calls, 0);
    dem2d_shape_destroy(shape);
}

/* The offending arc is named in the caller's numbering, clockwise or not. */
static void clockwise_arcs_are_named(void **state) {
    (void)state;
    const double k = 0.5522847498;
    const dem2d_vec circle[12] = {{1, 0},  {1, k},   {k, 1},   {0, 1},  {-k, 1}, {-1, k},
                                  {-1, 0}, {-1, -k}, {-k, -1}, {0, -1}, {k, -1}, {1, -k}};
    for (int turn = 0; turn < 2; turn++) {
        dem2d_vec p[12];
        test_env env;
        dem2d_shape *shape = NULL;
        for (int i = 0; i < 12; i++) p[i] = circle[turn ? (12 - i) % 12 : i];
        p[10].x *= 0.1, p[10].y *= 0.1; /* bends arc 3 the wrong way */
        test_env_init(&env);
        assert_result(dem2d_shape_create_bezier(&env.env, p, 4, &shape), DEM2D_NOT_CONVEX);
        assert_int_equal(env.log.index, 3);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(circles_and_ellipses_are_checked),
        cmocka_unit_test(polygons_are_checked),
        cmocka_unit_test(polygons_are_cleaned),
        cmocka_unit_test(beziers_are_checked),
        cmocka_unit_test(flat_and_clockwise_beziers),
        cmocka_unit_test(series_are_checked),
        cmocka_unit_test(series_at_the_limit),
        cmocka_unit_test(customs_are_checked),
        cmocka_unit_test(every_allocation_can_fail),
        cmocka_unit_test(support_is_the_farthest_point),
        cmocka_unit_test(rho_is_the_radius_of_curvature),
        cmocka_unit_test(directions_of_any_length),
        cmocka_unit_test(bad_support_queries),
        cmocka_unit_test(sizes_are_exact_powers_of_two),
        cmocka_unit_test(right_angles_are_exact),
        cmocka_unit_test(polygons_of_many_vertices),
        cmocka_unit_test(boxes_are_exact),
        cmocka_unit_test(outlines_lie_on_the_boundary),
        cmocka_unit_test(facts_hold),
        cmocka_unit_test(containment),
        cmocka_unit_test(rotations_and_poses),
        cmocka_unit_test(texts_and_version),
        cmocka_unit_test(flat_valleys),
        cmocka_unit_test(angles_without_digits),
        cmocka_unit_test(allocator_without_release),
        cmocka_unit_test(clockwise_arcs_are_named),
    };
    return cmocka_run_group_tests_name("shapes", tests, NULL, NULL);
}
