/* Fits of templates to outlines with their reports, and virtual grains. Coverage comes from scan
   lines, convexity from a long double series, optimality from a dual bound: none of them shares
   code with the header. */
#define _POSIX_C_SOURCE 200809L /* opendir, for the outlines of DATA */
#include "dem2d.h"

#include "testing.h"
#include "outline_oracle.h"

#include <dirent.h>

#define MOST 4096  /* points of an outline */
#define LINES 2000 /* scan lines */
#define ROOM 256   /* crossings of one of them */
#define DENSE 1000 /* points of a template's outline: inside by 7e-6 of the area */

typedef struct outline {
    const char *name;
    int count;
    dem2d_vec p[MOST];
} outline;

/* --- outlines ------------------------------------------------------------------------------- */

enum { ROUND, OVAL, SERIES, BOX, PENTAGON, TRIANGLE, ROUGH, STEPS, STAR, OUTLINES };

static outline given[OUTLINES];

static const double series_a[6] = {2, 0.3, 0.05, 0.02, -0.012, 0.006};
static const double series_b[6] = {0, -0.2, -0.06, 0.01, 0.008, 0.009};

/* Of a convex series, order 5, a0/2 = 1. */
static dem2d_vec on_series(double t) {
    double h = series_a[0] / 2, slope = 0;
    for (int n = 1; n <= 5; n++) {
        h += series_a[n] * cos(n * t) + series_b[n] * sin(n * t);
        slope += n * (series_b[n] * cos(n * t) - series_a[n] * sin(n * t));
    }
    return vec(h * cos(t) - slope * sin(t), h * sin(t) + slope * cos(t));
}

static outline *begin(int which, const char *name, int count) {
    given[which].name = name, given[which].count = count;
    return &given[which];
}

/* Turned by 0.4 and moved, so that nothing is aligned with the axes by chance. */
static void corners(int which, const char *name, const dem2d_vec *p, int count) {
    outline *o = begin(which, name, count);
    for (int i = 0; i < count; i++)
        o->p[i] = vec(0.5 + 0.921 * p[i].x - 0.389 * p[i].y, -1 + 0.389 * p[i].x + 0.921 * p[i].y);
}

static int make_outlines(void **state) {
    static const dem2d_vec box[] = {{-2, -1}, {2, -1}, {2, 1}, {-2, 1}};
    static const dem2d_vec five[] = {{-1, -1}, {1.5, -1.2}, {1.9, 0.4}, {0.3, 1.6}, {-1.3, 0.8}};
    static const dem2d_vec three[] = {{-1, -1}, {2, -0.7}, {0.2, 1.4}};
    dem2d_vec star[10];
    uint64_t random = 71;
    (void)state;
    corners(BOX, "box", box, 4);
    corners(PENTAGON, "pentagon", five, 5);
    corners(TRIANGLE, "triangle", three, 3);
    for (int i = 0; i < 10; i++) {
        const dem2d_vec u = direction(0.2 * 3.14159265358979 * i);
        star[i] = vec((i % 2 ? 0.5 : 1.2) * u.x, (i % 2 ? 0.5 : 1) * u.y);
    }
    corners(STAR, "star", star, 10);
    outline *ring = begin(ROUND, "circle", 400), *oval = begin(OVAL, "ellipse", 400);
    outline *series = begin(SERIES, "series", 1000);
    outline *rough = begin(ROUGH, "rough", 240), *steps = begin(STEPS, "steps", 160);
    for (int i = 0; i < 400; i++) {
        const dem2d_vec u = direction(0.0157079632679489662 * i);
        ring->p[i] = vec(3 + 2 * u.x, 2 * u.y - 1);
        oval->p[i] = vec(3 * 0.8 * u.x - 0.6 * u.y, 3 * 0.6 * u.x + 0.8 * u.y);
    }
    for (int i = 0; i < 1000; i++) series->p[i] = on_series(0.00628318530717958648 * i);
    for (int i = 0; i < 240; i++) { /* dents, lobes and noise, as traced from a picture */
        const double t = 0.0261799387799149437 * i;
        const double r =
            1 + 0.12 * cos(3 * t + 1) + 0.04 * cos(7 * t) + random_between(&random, -0.01, 0.01);
        rough->p[i] = vec(1.5 * r * cos(t), r * sin(t));
    }
    for (int i = 0; i < 160; i++) /* whole pixels, some of them twice as long as others */
        steps->p[i] = vec(round(30 * cos(0.03926990816987 * i) + 6 * cos(0.11780972450961 * i)),
                          round(20 * sin(0.03926990816987 * i)));
    return 0;
}

/* --- oracles -------------------------------------------------------------------------------- */

static long double area_of(const dem2d_vec *p, int n) {
    long double sum = 0;
    for (int i = 0; i < n; i++) {
        const dem2d_vec q = p[(i + 1) % n];
        sum += (long double)(p[i].x - p[0].x) * (q.y - p[0].y) -
               (long double)(q.x - p[0].x) * (p[i].y - p[0].y);
    }
    return fabsl(sum) / 2;
}

/* Mean radius: the unit of lengths in tolerances. */
static double size_of(const outline *o) {
    return (double)sqrtl(area_of(o->p, o->count) / TEST_PI);
}

static crossing lines[LINES][ROOM];
static int crossed[LINES];

/* Lines are tilted: no edge lies along one. */
static dem2d_vec tilt(dem2d_vec p) {
    return vec(0.94 * p.x - 0.341 * p.y, 0.341 * p.x + 0.94 * p.y);
}

static void cross(const dem2d_vec *p, int n, int of, double low, double step) {
    for (int i = 0; i < n; i++) {
        const dem2d_vec a = tilt(p[i]), b = tilt(p[(i + 1) % n]);
        const int first = (int)((fmin(a.y, b.y) - low) / step - 1);
        const int last = (int)((fmax(a.y, b.y) - low) / step + 1);
        for (int k = first > 0 ? first : 0; k <= last && k < LINES; k++) {
            const double y = low + step * (k + 0.5);
            if ((a.y <= y) == (b.y <= y)) continue;
            assert_true(crossed[k] < ROOM);
            lines[k][crossed[k]++] = (crossing){a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x), of};
        }
    }
}

/* 1 - area(symmetric difference) / area(reference): exact along each line, and the midpoint rule
   across them is off by the square of 1/2000 for each corner or crossing. */
static double coverage(const dem2d_vec *reference, int n, const dem2d_vec *other, int m) {
    double low = HUGE_VAL, high = -HUGE_VAL, difference = 0, area = 0;
    for (int i = 0; i < n + m; i++) {
        const double y = tilt(i < n ? reference[i] : other[i - n]).y;
        low = fmin(low, y), high = fmax(high, y);
    }
    memset(crossed, 0, sizeof crossed);
    cross(reference, n, 0, low, (high - low) / LINES);
    cross(other, m, 1, low, (high - low) / LINES);
    for (int k = 0; k < LINES; k++) {
        bool in[2] = {false, false};
        qsort(lines[k], (size_t)crossed[k], sizeof lines[k][0], by_x);
        for (int i = 0; i < crossed[k]; i++) {
            const double length = i > 0 ? lines[k][i].x - lines[k][i - 1].x : 0;
            if (in[0] != in[1]) difference += length;
            if (in[0]) area += length;
            in[lines[k][i].of] = !in[lines[k][i].of];
        }
    }
    return 1 - difference / area;
}

/* Distance of the farthest corner of p from the polygon q, squared. */
static double farthest(const dem2d_vec *p, int n, const dem2d_vec *q, int m) {
    double most = 0;
    for (int i = 0; i < n; i++) {
        double least = HUGE_VAL;
        for (int k = 0; k < m; k++) {
            const dem2d_vec a = q[k], b = q[(k + 1) % m];
            const double ex = b.x - a.x, ey = b.y - a.y, px = p[i].x - a.x, py = p[i].y - a.y;
            const double length = ex * ex + ey * ey;
            const double t = length > 0 ? fmin(fmax((px * ex + py * ey) / length, 0), 1) : 0;
            const double dx = px - t * ex, dy = py - t * ey;
            least = fmin(least, dx * dx + dy * dy);
        }
        most = fmax(most, least);
    }
    return most;
}

static double support_value(const outline *o, dem2d_vec u) {
    double most = -HUGE_VAL;
    for (int i = 0; i < o->count; i++) most = fmax(most, o->p[i].x * u.x + o->p[i].y * u.y);
    return most;
}

/* Coefficients of a template where it lies, from its support values alone. */
static void series_of(const dem2d_shape *shape, dem2d_pose pose, int order, long double *a,
                      long double *b) {
    const int samples = 4 * order + 9;
    for (int n = 0; n <= order; n++) a[n] = b[n] = 0;
    for (int j = 0; j < samples; j++) {
        const double t = (double)(2 * TEST_PI * j / samples);
        dem2d_support s;
        assert_ok(dem2d_shape_support(shape, pose, direction(t), &s));
        const long double h = s.value + (long double)pose.position.x * cosl(t) +
                              (long double)pose.position.y * sinl(t);
        for (int n = 0; n <= order; n++)
            a[n] += 2 * h * cosl(n * t) / samples, b[n] += 2 * h * sinl(n * t) / samples;
    }
}

/* Least radius of curvature over 20000 directions, by powers. */
static long double least_rho(const long double *a, const long double *b, int order) {
    long double least = HUGE_VALL;
    for (int i = 0; i < 20000; i++) {
        const long double x = cosl(2 * TEST_PI * i / 20000), y = sinl(2 * TEST_PI * i / 20000);
        long double c = x, s = y, rho = a[0] / 2;
        for (int n = 2; n <= order; n++) {
            const long double turned = c * x - s * y;
            s = c * y + s * x, c = turned;
            rho += (1 - n * n) * (a[n] * c + b[n] * s);
        }
        least = fminl(least, rho);
    }
    return least;
}

/* --- all models ------------------------------------------------------------------------------ */

typedef struct kind {
    const char *name;
    dem2d_fit_desc desc;
    bool iterates;
} kind;

#define FS(order, how) .model = DEM2D_FOURIER, .count = (order), .method = DEM2D_FIT_##how

static const kind kinds[] = {
    {"circle", {.model = DEM2D_CIRCLE}, false},
    {"ellipse", {.model = DEM2D_ELLIPSE}, true},
    {"polygon 3", {.model = DEM2D_POLYGON, .count = 3}, true},
    {"polygon 6", {.model = DEM2D_POLYGON, .count = 6}, true},
    {"polygon 8", {.model = DEM2D_POLYGON, .count = 8}, false},
    {"bezier 3", {.model = DEM2D_BEZIER, .count = 3}, true},
    {"bezier 10", {.model = DEM2D_BEZIER, .count = 10, .method = DEM2D_FIT_AREA}, true},
    {"swarm 5", {.model = DEM2D_BEZIER, .count = 5, .method = DEM2D_FIT_SWARM}, true},
    {"reduction 8", {FS(8, REDUCTION)}, true},
    {"reduction-exact 8", {FS(8, REDUCTION_EXACT)}, true},
    {"fejer 8", {FS(8, FEJER)}, false},
    {"series 1", {FS(1, DEFAULT)}, false},
    {"series 8", {FS(8, DEFAULT)}, true},
    {"series 16 grain", {FS(16, CONSTRAINED), .scale = DEM2D_SCALE_GRAIN}, true},
    {"series 16 none", {FS(16, CONSTRAINED), .scale = DEM2D_SCALE_NONE, .min_radius = 0.3}, true},
    {"series 12 corners", {FS(12, CONSTRAINED), .corners = true}, true},
};

static bool is_swarm(const kind *k) {
    return k->desc.method == DEM2D_FIT_SWARM;
}

/* One fit that must succeed; the caller destroys the shape. */
static dem2d_shape *fit(const outline *o, const dem2d_fit_desc *desc, dem2d_fit_report *report) {
    dem2d_shape *shape = NULL;
    test_env env;
    test_env_init(&env);
    env.env.allocate = NULL, env.env.release = NULL; /* the shape lives longer than env */
    const dem2d_result result = dem2d_outline_fit(&env.env, o->p, o->count, desc, &shape, report);
    if (result)
        print_error("model %d, method %d, count %d on \"%s\": %s\n", (int)desc->model,
                    (int)desc->method, desc->count, o->name, env.log.text);
    assert_ok(result);
    assert_non_null(shape);
    return shape;
}

/* The coverage of a fit alone. */
static double covers(const outline *o, const dem2d_fit_desc *desc) {
    dem2d_fit_report report;
    dem2d_shape_destroy(fit(o, desc, &report));
    return report.coverage;
}

/* The proved margin lies below what is found, and for series not far below. */
static void check_convexity(const dem2d_shape *shape, const dem2d_fit_report *r, double size) {
    dem2d_shape_info info;
    assert_ok(dem2d_shape_get(shape, &info));
    long double least = HUGE_VALL;
    for (int i = 0; i < 2000; i++) {
        dem2d_support s;
        assert_ok(dem2d_shape_support(shape, r->pose, direction(0.00314159265358979 * i), &s));
        least = fminl(least, s.rho);
    }
    if (info.type == DEM2D_FOURIER) {
        long double a[17], b[17];
        series_of(shape, r->pose, info.count, a, b);
        least = least_rho(a, b, info.count);
        assert_true(r->convexity >= least - 0.02 * size);
    }
    if (info.type == DEM2D_POLYGON) assert_true(r->convexity == 0);
    assert_between(r->convexity, 0, least + 1e-12L * size);
}

/* The greatest radius of curvature is above what is found and, where its peak is broad, not far
   above: apart from straight arcs, where it is infinite. */
static void check_max_radius(const dem2d_shape *shape, const dem2d_fit_report *r) {
    dem2d_shape_info info;
    double most = 0;
    assert_ok(dem2d_shape_get(shape, &info));
    for (int i = 0; i < 2000; i++) {
        dem2d_support s;
        assert_ok(dem2d_shape_support(shape, r->pose, direction(0.00314159265358979 * i), &s));
        if (s.rho < HUGE_VAL) most = fmax(most, s.rho);
    }
    assert_true(r->max_radius == info.rho_max);
    assert_true(r->max_radius >= most * (1 - 1e-12));
    if (info.type != DEM2D_BEZIER) assert_true(r->max_radius <= most * 1.001);
}

/* Every number of a report, by other means. */
static void check_report(const outline *o, const dem2d_fit_desc *desc, const dem2d_shape *shape,
                         const dem2d_fit_report *r) {
    static dem2d_vec p[DENSE];
    const double size = size_of(o), area = (double)area_of(o->p, o->count);
    dem2d_shape_info info;
    assert_ok(dem2d_shape_get(shape, &info));
    assert_int_equal(info.type, desc->model);
    assert_int_equal(r->count, info.count);
    if (desc->model == DEM2D_POLYGON)
        assert_between(r->count, 3, desc->count);
    else
        assert_int_equal(r->count, desc->count);
    assert_within(hypot(r->pose.rotation.c, r->pose.rotation.s), 1, 1e-15L);
    assert_true(r->pose.scale > 0);
    assert_ok(dem2d_shape_outline(shape, r->pose, DENSE, p));
    assert_within(r->coverage, coverage(o->p, o->count, p, DENSE), 1e-4L);
    assert_within(r->difference, (1 - r->coverage) * area, 1e-12L * area);
    /* corners of the template are points of its curve, as many as the header likes: two such
       sets miss each other's farthest one by no more than their spacing */
    const double one = farthest(o->p, o->count, p, DENSE), two = farthest(p, DENSE, o->p, o->count);
    assert_within(r->hausdorff, sqrt(fmax(one, two)), 0.01L * size);
    check_convexity(shape, r, size);
    check_max_radius(shape, r);
    assert_true(r->iterations >= 0);
}

static void every_model_fits_every_outline(void **state) {
    (void)state;
    for (int i = 0; i < OUTLINES; i++) {
        for (int k = 0; k < COUNT_OF(kinds); k++) {
            dem2d_fit_report report;
            if (is_swarm(&kinds[k]) && i != BOX && i != STEPS) continue; /* slow */
            if (!test_long() && (is_swarm(&kinds[k]) ? i != BOX : (i + k) % 3 > 0)) continue;
            dem2d_shape *shape = fit(&given[i], &kinds[k].desc, &report);
            check_report(&given[i], &kinds[k].desc, shape, &report);
            if (i == STEPS && kinds[k].iterates) assert_true(report.iterations > 0);
            dem2d_shape_destroy(shape);
        }
    }
}

/* What is of the model's kind comes back. Less than 1 are 4e-5 that the polygons with 400 corners
   lack, and what searches leave. */
static void own_kind_is_recovered(void **state) {
    (void)state;
    static const struct {
        int of;
        dem2d_fit_desc desc;
        double least;
    } cases[] = {
        {ROUND, {.model = DEM2D_CIRCLE}, 0.9999},
        {ROUND, {.model = DEM2D_ELLIPSE}, 0.9999},
        {OVAL, {.model = DEM2D_ELLIPSE}, 0.9999},
        {ROUND, {FS(2, CONSTRAINED)}, 0.9999},
        {ROUND, {FS(4, FEJER)}, 0.9999},
        {ROUND, {FS(4, REDUCTION)}, 0.9999},
        {SERIES, {FS(5, REDUCTION_EXACT)}, 0.9999},
        {SERIES, {FS(5, CONSTRAINED)}, 0.9999},
        {SERIES, {FS(5, CONSTRAINED), .scale = DEM2D_SCALE_GRAIN}, 0.9999},
        {SERIES, {FS(5, CONSTRAINED), .scale = DEM2D_SCALE_NONE}, 0.9999},
        {SERIES, {FS(9, CONSTRAINED), .corners = true}, 0.9999},
        {BOX, {.model = DEM2D_POLYGON, .count = 4}, 0.9999},
        {BOX, {.model = DEM2D_POLYGON, .count = 8}, 0.9999},
        {PENTAGON, {.model = DEM2D_POLYGON, .count = 5}, 0.9999},
        {TRIANGLE, {.model = DEM2D_POLYGON, .count = 3}, 0.9999},
        {ROUND, {.model = DEM2D_BEZIER, .count = 4}, 0.999},
        {ROUND, {.model = DEM2D_BEZIER, .count = 10}, 0.9999},
        {OVAL, {.model = DEM2D_BEZIER, .count = 10}, 0.999},
    };
    for (int i = 0; i < COUNT_OF(cases); i++)
        assert_between(covers(&given[cases[i].of], &cases[i].desc), cases[i].least, 1);
}

/* --- Fourier series -------------------------------------------------------------------------- */

static void reduction_is_the_papers(void **state) {
    (void)state;
    for (int i = 0; i < OUTLINES; i++) {
        for (int exact = 0; exact < 2; exact++) {
            const dem2d_fit_desc desc = {.model = DEM2D_FOURIER,
                                         .count = 8,
                                         .method = exact ? DEM2D_FIT_REDUCTION_EXACT
                                                         : DEM2D_FIT_REDUCTION};
            const dem2d_reduction_desc how = {.test = exact ? DEM2D_EXACT : DEM2D_SUFFICIENT};
            const outline *o = &given[i];
            double a[9], b[9];
            long double found_a[9], found_b[9];
            int count;
            dem2d_fit_report report;
            dem2d_shape *shape = fit(o, &desc, &report);
            assert_ok(dem2d_fourier_fit(NULL, o->p, o->count, 8, 0, a, b));
            assert_ok(dem2d_fourier_reduce(a, b, 8, &how, &count));
            series_of(shape, report.pose, 8, found_a, found_b);
            for (int n = 0; n <= 8; n++) { /* place and series are rounded once more */
                assert_within(found_a[n], a[n], 1e-13L * a[0]);
                if (n > 0) assert_within(found_b[n], b[n], 1e-13L * a[0]);
            }
            assert_int_equal(report.iterations, count);
            dem2d_shape_destroy(shape);
        }
    }
}

/* a0/2 and pairs of the hull's series in closed form: edge lengths at edge normals. */
static void hull_series(const outline *o, int order, long double *a, long double *b) {
    static dem2d_vec hull[MOST];
    int count;
    assert_ok(dem2d_polygon_hull(NULL, o->p, o->count, hull, &count));
    for (int n = 0; n <= order; n++) {
        a[n] = b[n] = 0;
        for (int i = 0; i < count; i++) {
            const long double dx = (long double)hull[(i + 1) % count].x - hull[i].x;
            const long double dy = (long double)hull[(i + 1) % count].y - hull[i].y;
            const long double part = hypotl(dx, dy) / TEST_PI, t = atan2l(-dx, dy);
            a[n] += part * cosl(n * t), b[n] += part * sinl(n * t);
        }
        if (n == 1) a[n] = b[n] = 0; /* rho does not know the place */
        if (n != 1) a[n] /= 1 - n * n, b[n] /= 1 - n * n;
    }
}

static void fejer_is_convex(void **state) {
    (void)state;
    for (int i = 0; i < OUTLINES; i++) {
        for (int order = 1; order <= 16; order += 1 + order / 2) { /* 1, 2, 4, 7, 11 */
            const dem2d_fit_desc desc = {FS(order, FEJER), .scale = DEM2D_SCALE_NONE};
            long double a[17], b[17], found_a[17], found_b[17];
            dem2d_fit_report report;
            dem2d_shape *shape = fit(&given[i], &desc, &report);
            hull_series(&given[i], order, a, b);
            series_of(shape, report.pose, order, found_a, found_b);
            for (int n = 0; n <= order; n++) {
                const long double factor = 1 - n / (order + 1.0L);
                if (n == 1) continue;
                assert_within(found_a[n], factor * a[n], 1e-12L * a[0]);
                assert_within(found_b[n], factor * b[n], 1e-12L * a[0]);
            }
            assert_true(report.convexity >= 0);
            dem2d_shape_destroy(shape);
        }
    }
}

/* Mean of (p - h)^2 over the directions of an outline's hull. */
static double misfit(const outline *o, const long double *a, const long double *b, int order) {
    double sum = 0;
    for (int i = 0; i < 2000; i++) {
        const double t = 0.00314159265358979324 * (i + 0.5);
        long double p = a[0] / 2;
        for (int n = 1; n <= order; n++) p += a[n] * cosl(n * t) + b[n] * sinl(n * t);
        sum += pow((double)p - support_value(o, direction(t)), 2) / 2000;
    }
    return sum;
}

/* How far the free least-squares fit y0 is from the cone rho >= share a0/2, squared, or less: any
   multipliers prove such a bound (weak duality), and Hildreth's steps, each exact in one of them,
   raise it (over-relaxed by half: fewer sweeps). Units of y0 make the mean square of a change of p
   the square of its length. */
static double distance_to_cone(const double *y0, int order, double share) {
    enum { DIRECTIONS = 256, MOST_TERMS = 33 };
    static double rows[DIRECTIONS][MOST_TERMS];
    double y[MOST_TERMS], weight[DIRECTIONS] = {0}, norm[DIRECTIONS] = {0};
    const int terms = 2 * order + 1;
    memcpy(y, y0, (size_t)terms * sizeof *y);
    for (int j = 0; j < DIRECTIONS; j++) {
        for (int n = 0; n <= order; n++) {
            const double t = (double)(2 * TEST_PI * n * j / DIRECTIONS);
            const double size = sqrt(2.0) * (1 - n * n);
            if (n == 0) rows[j][0] = 1 - share;
            if (n > 0) rows[j][2 * n - 1] = size * cos(t), rows[j][2 * n] = size * sin(t);
        }
        for (int k = 0; k < terms; k++) norm[j] += rows[j][k] * rows[j][k];
    }
    for (int sweep = 0; sweep < 3000; sweep++) {
        for (int j = 0; j < DIRECTIONS; j++) {
            double rho = 0;
            for (int k = 0; k < terms; k++) rho += rows[j][k] * y[k];
            if (weight[j] == 0 && rho >= 0) continue;
            const double step = fmax(-1.5 * rho / norm[j], -weight[j]);
            weight[j] += step;
            for (int k = 0; k < terms; k++) y[k] += step * rows[j][k];
        }
    }
    double length = 0, along = 0; /* y - y0 = sum of weights times rows */
    for (int k = 0; k < terms; k++)
        length += (y[k] - y0[k]) * (y[k] - y0[k]), along += (y[k] - y0[k]) * y0[k];
    return fmax(0, -length - 2 * along);
}

static const struct {
    int of, order;
    double min_radius;
    bool corners;
} constrained[] = {
    {ROUGH, 8, 0, false}, {BOX, 4, 0, false},        {TRIANGLE, 8, 0.3, false},
    {STAR, 12, 0, false}, {TRIANGLE, 8, 0, true},    {BOX, 12, 0, true},
    {STEPS, 8, 0, false}, {PENTAGON, 5, 0.8, false}, {SERIES, 12, 0.01, false},
};

static void constrained_is_convex_and_best(void **state) {
    (void)state;
    for (int i = 0; i < COUNT_OF(constrained); i++) {
        const int order = constrained[i].order;
        const outline *o = &given[constrained[i].of];
        const dem2d_fit_desc desc = {FS(order, CONSTRAINED), .scale = DEM2D_SCALE_NONE,
                                     .min_radius = constrained[i].min_radius,
                                     .corners = constrained[i].corners};
        const double share = desc.corners ? 0 : desc.min_radius > 0 ? desc.min_radius : 0.1;
        long double a[17], b[17], free_a[17] = {0}, free_b[17] = {0};
        double y0[33];
        dem2d_fit_report report;
        dem2d_shape *shape = fit(o, &desc, &report);
        series_of(shape, report.pose, order, a, b);
        assert_true(least_rho(a, b, order) >= (share - 1e-12L) * a[0] / 2);
        for (int j = 0; j < 2000; j++) { /* by the same sum as misfit */
            const double t = 0.00314159265358979324 * (j + 0.5);
            const long double h = support_value(o, direction(t)) / 1000;
            for (int n = 0; n <= order; n++)
                free_a[n] += h * cosl(n * t), free_b[n] += h * sinl(n * t);
        }
        y0[0] = (double)free_a[0] / 2;
        for (int n = 1; n <= order; n++)
            y0[2 * n - 1] = (double)(free_a[n] / sqrtl(2)),
                       y0[2 * n] = (double)(free_b[n] / sqrtl(2));
        const double least = misfit(o, free_a, free_b, order) + distance_to_cone(y0, order, share);
        /* the bound knows 256 directions, the fit a proof for all and samples of its own */
        assert_between(sqrt(misfit(o, a, b, order)), sqrt(least) * (1 - 1e-9),
                       sqrt(least) * 1.01 + 1e-4 * size_of(o));
        dem2d_shape_destroy(shape);
    }
}

static void scale_sets_the_area(void **state) {
    (void)state;
    static dem2d_vec hull[MOST];
    for (int i = 0; i < OUTLINES; i++) {
        for (int run = 0; run < 4; run++) {
            const outline *o = &given[i];
            const dem2d_fit_desc desc = {.model = DEM2D_FOURIER,
                                         .count = 8,
                                         .method =
                                             run < 2 ? DEM2D_FIT_CONSTRAINED : DEM2D_FIT_FEJER,
                                         .scale = run % 2 ? DEM2D_SCALE_GRAIN : DEM2D_SCALE_HULL};
            int count;
            dem2d_mass mass;
            dem2d_fit_report report;
            assert_ok(dem2d_polygon_hull(NULL, o->p, o->count, hull, &count));
            dem2d_shape *shape = fit(o, &desc, &report);
            assert_ok(dem2d_shape_mass(shape, &mass));
            assert_near(mass.area * report.pose.scale * report.pose.scale,
                        run % 2 ? area_of(o->p, o->count) : area_of(hull, count), 1e-12L);
            long double a[9], b[9];
            series_of(shape, report.pose, 8, a, b);
            if (run < 2) assert_true(least_rho(a, b, 8) >= (0.1L - 1e-12L) * a[0] / 2);
            dem2d_shape_destroy(shape);
        }
    }
}

/* --- ellipse, polygon, polybezier ------------------------------------------------------------ */

typedef struct oval {
    double x, y, a, b, angle;
} oval;

static double oval_covers(const outline *o, oval e) {
    static dem2d_vec p[DENSE];
    for (int i = 0; i < DENSE; i++) {
        const dem2d_vec u = direction(0.00628318530717958648 * i);
        const double c = cos(e.angle), s = sin(e.angle), x = e.a * u.x, y = e.b * u.y;
        p[i] = vec(e.x + c * x - s * y, e.y + s * x + c * y);
    }
    return coverage(o->p, o->count, p, DENSE);
}

/* The greatest radius of curvature of an arc from its control points, in long double; -1 for one
   that is straight to rounding. */
static long double flattest(const dem2d_vec q[4], long double size) {
    long double d[3][2], most = 0, across = 0;
    for (int i = 0; i < 3; i++) {
        d[i][0] = (long double)q[i + 1].x - q[i].x;
        d[i][1] = (long double)q[i + 1].y - q[i].y;
    }
    const long double x = (long double)q[3].x - q[0].x, y = (long double)q[3].y - q[0].y;
    for (int i = 0; i < 3; i++) across += fabsl(x * d[i][1] - y * d[i][0]) / hypotl(x, y);
    if (across < 1e-14L * size) return -1;
    for (int i = 0; i <= 1000; i++) {
        const long double t = i / 1000.0L, s = 1 - t;
        long double v[2], a[2];
        for (int j = 0; j < 2; j++) {
            v[j] = 3 * (s * s * d[0][j] + 2 * s * t * d[1][j] + t * t * d[2][j]);
            a[j] = 6 * (s * (d[1][j] - d[0][j]) + t * (d[2][j] - d[1][j]));
        }
        const long double speed = hypotl(v[0], v[1]), turn = v[0] * a[1] - v[1] * a[0];
        most = fmaxl(most, turn > 0 ? speed * speed * speed / turn : HUGE_VALL);
    }
    return most;
}

/* Polybeziers are bounded by 20 of the hull's radius, with straight arcs along straight edges; a
   square is a square then. Without a bound some arc of a square is a thousand times flatter. */
static void polybeziers_are_bounded(void **state) {
    (void)state;
    static const int some[] = {3, 4, 7, 10, 24};
    for (int i = 0; i < OUTLINES; i++) {
        static dem2d_vec hull[MOST];
        const outline *o = &given[i];
        int corners, straight = 0;
        assert_ok(dem2d_polygon_hull(NULL, o->p, o->count, hull, &corners));
        const double radius = sqrt((double)area_of(hull, corners) / 3.14159265358979324);
        for (int k = 0; k < COUNT_OF(some); k++) {
            dem2d_vec q[3 * 24 + 1];
            long double most = 0;
            assert_ok(dem2d_bezier_fit(NULL, o->p, o->count, some[k], q));
            q[3 * some[k]] = q[0];
            for (int j = 0; j < some[k]; j++) {
                const long double one = flattest(&q[3 * j], fabs(q[0].x) + fabs(q[0].y) + radius);
                straight += one < 0 && some[k] == 10;
                most = fmaxl(most, one);
            }
            if (most > 20.000001L * radius)
                print_error("%s, %d arcs: %Lg\n", o->name, some[k], most / radius);
            assert_true(most <= 20.000001L * radius);
        }
        if (i == BOX) assert_int_equal(straight, 4);
        if (i == ROUND) assert_int_equal(straight, 0);
    }
    static const dem2d_fit_desc bounded = {.model = DEM2D_BEZIER, .count = 10};
    static const dem2d_fit_desc tight = {.model = DEM2D_BEZIER, .count = 10, .max_radius = 5};
    static const dem2d_fit_desc free = {.model = DEM2D_BEZIER, .count = 10, .unbounded = true};
    dem2d_fit_report report[3];
    dem2d_shape_destroy(fit(&given[STEPS], &bounded, &report[0]));
    dem2d_shape_destroy(fit(&given[STEPS], &tight, &report[1]));
    dem2d_shape_destroy(fit(&given[STEPS], &free, &report[2]));
    const double size = size_of(&given[STEPS]);
    assert_true(report[1].max_radius <= 5 * size && report[0].max_radius <= 20 * size);
    assert_true(report[1].coverage <= report[0].coverage);
    assert_true(covers(&given[BOX], &bounded) >= 0.999);
    dem2d_shape_destroy(fit(&given[BOX], &free, &report[2]));
    assert_true(report[2].max_radius > 1000 * size_of(&given[BOX]));
}

/* The ellipse with an outline's second moments, turned and sized to its area. */
static oval moment_oval(const outline *o) {
    long double area = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (int i = 0; i < o->count; i++) {
        const long double px = o->p[i].x, py = o->p[i].y;
        const long double qx = o->p[(i + 1) % o->count].x, qy = o->p[(i + 1) % o->count].y;
        const long double w = px * qy - qx * py;
        area += w / 2, x += w * (px + qx) / 6, y += w * (py + qy) / 6;
        xx += w * (px * px + px * qx + qx * qx) / 12, yy += w * (py * py + py * qy + qy * qy) / 12;
        xy += w * (2 * px * py + px * qy + qx * py + 2 * qx * qy) / 24;
    }
    x /= area, y /= area;
    xx = xx / area - x * x, yy = yy / area - y * y, xy = xy / area - x * y;
    const long double half = (xx + yy) / 2, swing = hypotl((xx - yy) / 2, xy);
    const long double aspect = sqrtl((half + swing) / (half - swing));
    const long double b = sqrtl(area / TEST_PI / aspect);
    return (oval){(double)x, (double)y, (double)(b * aspect), (double)b,
                  (double)(0.5L * atan2l(2 * xy, xx - yy))};
}

static void no_ellipse_is_better(void **state) {
    (void)state;
    const dem2d_fit_desc desc = {.model = DEM2D_ELLIPSE};
    uint64_t random = 73;
    for (int i = 0; i < OUTLINES; i++) {
        const outline *o = &given[i];
        dem2d_fit_report r;
        dem2d_shape *shape = fit(o, &desc, &r);
        dem2d_support x, y;
        const dem2d_rot turn = r.pose.rotation;
        assert_ok(dem2d_shape_support(shape, r.pose, vec(turn.c, turn.s), &x));
        assert_ok(dem2d_shape_support(shape, r.pose, vec(-turn.s, turn.c), &y));
        const double size = size_of(o);
        const oval found = {r.pose.position.x, r.pose.position.y, x.value, y.value,
                            atan2(turn.s, turn.c)};
        const double covered = oval_covers(o, found);
        assert_within(r.coverage, covered, 1e-4L);
        assert_true(covered >= oval_covers(o, moment_oval(o)) - 1e-5);
        for (int run = 0; run < 60; run++) {
            const double reach = size * pow(10, -1 - run % 3);
            oval e = found;
            e.x += random_between(&random, -reach, reach),
                e.y += random_between(&random, -reach, reach);
            e.a += random_between(&random, -reach, reach),
                e.b += random_between(&random, -reach, reach);
            e.angle += random_between(&random, -reach, reach) / size;
            assert_true(oval_covers(o, e) <= covered + 2e-4); /* twice the oracle's error */
        }
        dem2d_shape_destroy(shape);
    }
}

static bool is_convex(const dem2d_vec *p, int n) {
    for (int i = 0; i < n; i++) {
        const dem2d_vec a = p[i], b = p[(i + 1) % n], c = p[(i + 2) % n];
        if ((b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x) <= 0) return false;
    }
    return true;
}

/* The hull's points in n uniform directions. */
static int extreme_points(const outline *o, int n, dem2d_vec *p) {
    int count = 0;
    for (int i = 0; i < n; i++) {
        const dem2d_vec u = direction((double)(2 * TEST_PI * i / n));
        int best = 0;
        for (int k = 1; k < o->count; k++)
            if ((o->p[k].x - o->p[best].x) * u.x + (o->p[k].y - o->p[best].y) * u.y > 0) best = k;
        p[count++] = o->p[best];
    }
    return count;
}

static void no_polygon_is_better(void **state) {
    (void)state;
    static const int counts[] = {3, 4, 6, 9};
    uint64_t random = 79;
    for (int run = 0; run < OUTLINES * COUNT_OF(counts); run++) {
        const outline *o = &given[run % OUTLINES];
        const dem2d_fit_desc desc = {.model = DEM2D_POLYGON, .count = counts[run / OUTLINES]};
        if (!test_long() && (run % OUTLINES + run / OUTLINES) % 3 > 0) continue;
        dem2d_vec p[16], other[16];
        dem2d_fit_report r;
        dem2d_shape *shape = fit(o, &desc, &r);
        const int n = r.count;
        assert_ok(dem2d_shape_outline(shape, r.pose, n, p));
        assert_true(is_convex(p, n));
        const double covered = coverage(o->p, o->count, p, n), size = size_of(o);
        const int m = extreme_points(o, desc.count, other);
        assert_true(covered >= coverage(o->p, o->count, other, m) - 1e-5);
        for (int k = 0; k < 40; k++) {
            const double reach = size * pow(10, -1 - k % 3);
            for (int i = 0; i < n; i++) {
                const bool moves = k % 2 == 0 || i == k / 2 % n; /* all of them, or one */
                const double far = moves ? reach : 0;
                other[i] = vec(p[i].x + random_between(&random, -far, far),
                               p[i].y + random_between(&random, -far, far));
            }
            if (is_convex(other, n))
                assert_true(coverage(o->p, o->count, other, n) <= covered + 5e-4);
        }
        dem2d_shape_destroy(shape);
    }
}

static void same_report(const dem2d_fit_report *a, const dem2d_fit_report *b) {
    assert_int_equal(a->count, b->count);
    assert_int_equal(a->iterations, b->iterations);
    assert_same_bits(a->coverage, b->coverage);
    assert_same_bits(a->difference, b->difference);
    assert_same_bits(a->hausdorff, b->hausdorff);
    assert_same_bits(a->convexity, b->convexity);
    assert_same_bits(a->pose.position.x, b->pose.position.x);
    assert_same_bits(a->pose.position.y, b->pose.position.y);
}

static void swarm_repeats_and_area_is_as_good(void **state) {
    (void)state;
    static const int some[] = {ROUGH, STEPS, PENTAGON};
    for (int i = 0; i < COUNT_OF(some); i++) {
        static dem2d_vec p[2][DENSE];
        const outline *o = &given[some[i]];
        dem2d_fit_desc desc = {.model = DEM2D_BEZIER, .count = 10};
        dem2d_fit_report r[2];
        const double area = covers(o, &desc);
        desc.method = DEM2D_FIT_SWARM;
        for (int k = 0; k < 2; k++) {
            desc.seed = 5;
            dem2d_shape *shape = fit(o, &desc, &r[k]);
            assert_ok(dem2d_shape_outline(shape, r[k].pose, DENSE, p[k]));
            dem2d_shape_destroy(shape);
        }
        same_report(&r[0], &r[1]);
        assert_memory_equal(p[0], p[1], sizeof p[0]);
        desc.seed = 6;
        const double other = covers(o, &desc);
        print_message("%s: area %.5f, swarm %.5f, %.5f\n", o->name, area, r[0].coverage, other);
        assert_within(r[0].coverage, other, 0.01L); /* another path to about the same place */
        assert_true(area >= fmax(r[0].coverage, other) - 0.0005);
    }
}

/* --- the least count ------------------------------------------------------------------------- */

static void least_count_reaches(void **state) {
    (void)state;
    static const struct {
        int of, first, enough;
        dem2d_fit_desc desc;
    } cases[] = {
        {ROUGH, 1, 9, {FS(0, CONSTRAINED)}},
        {SERIES, 1, 5, {FS(0, CONSTRAINED), .corners = true}},
        {STEPS, 1, 12, {FS(0, FEJER)}},
        {SERIES, 1, 4, {FS(0, REDUCTION_EXACT)}},
        {ROUGH, 3, 12, {.model = DEM2D_POLYGON}},
        {PENTAGON, 3, 5, {.model = DEM2D_POLYGON}},
        {ROUND, 3, 9, {.model = DEM2D_POLYGON}},
        {ROUND, 3, 6, {.model = DEM2D_BEZIER}},
        {ROUGH, 3, 10, {.model = DEM2D_BEZIER}},
    };
    for (int i = 0; i < COUNT_OF(cases); i++) {
        const outline *o = &given[cases[i].of];
        dem2d_fit_desc desc = cases[i].desc;
        dem2d_fit_report report;
        desc.count = cases[i].first;
        const double low = covers(o, &desc);
        desc.count = cases[i].enough;
        const double asked = 0.3 * low + 0.7 * covers(o, &desc);
        assert_true(asked > low);
        desc.count = 0, desc.coverage = asked;
        dem2d_shape_destroy(fit(o, &desc, &report));
        assert_between(report.count, cases[i].first + 1, cases[i].enough);
        assert_true(report.coverage >= asked);
        for (desc.count = cases[i].first; desc.count < report.count; desc.count++)
            assert_true(covers(o, &desc) < asked);
        assert_near(covers(o, &desc), report.coverage, 1e-9L);
    }
}

/* No convex shape has 99.9 % of a star. */
static void what_is_impossible_is_not_reached(void **state) {
    (void)state;
    static const dem2d_fit_desc descs[] = {
        {FS(0, REDUCTION), .coverage = 0.999},
        {FS(0, FEJER), .coverage = 0.999},
        {.model = DEM2D_BEZIER, .coverage = 0.999},
    };
    for (int i = 0; i < COUNT_OF(descs); i++) {
        dem2d_shape *shape = (dem2d_shape *)&given;
        dem2d_fit_report report, before;
        test_env env;
        test_env_init(&env);
        memset(&report, 0x5a, sizeof report), memcpy(&before, &report, sizeof report);
        const outline *o = &given[STAR];
        assert_result(dem2d_outline_fit(&env.env, o->p, o->count, &descs[i], &shape, &report),
                      DEM2D_NOT_REACHED);
        assert_logged(&env, DEM2D_NOT_REACHED, -1, NULL);
        assert_true(shape == (dem2d_shape *)&given);
        assert_memory_equal(&report, &before, sizeof report);
        assert_clean(&env);
    }
}

/* --- size, place and orientation ------------------------------------------------------------- */

static outline moved; /* too large for the stack */

static void powers_of_two_scale_exactly(void **state) {
    (void)state;
    for (int run = 0; run < 2 * COUNT_OF(kinds); run++) {
        const kind *k = &kinds[run / 2];
        if (is_swarm(k) && run % 2) continue; /* slow */
        const int power = run % 2 ? 40 : -40;
        dem2d_fit_report r[2];
        moved = given[ROUGH];
        for (int i = 0; i < moved.count; i++)
            moved.p[i] = vec(ldexp(moved.p[i].x, power), ldexp(moved.p[i].y, power));
        dem2d_shape_destroy(fit(&given[ROUGH], &k->desc, &r[0]));
        dem2d_shape_destroy(fit(&moved, &k->desc, &r[1]));
        r[0].difference = ldexp(r[0].difference, 2 * power);
        r[0].hausdorff = ldexp(r[0].hausdorff, power);
        r[0].convexity = ldexp(r[0].convexity, power);
        r[0].pose.position.x = ldexp(r[0].pose.position.x, power);
        r[0].pose.position.y = ldexp(r[0].pose.position.y, power);
        same_report(&r[1], &r[0]);
    }
}

/* A grid of 2^-30 keeps the moved outline the same to the last bit; what is left of the move is
   rounding, which a swarm makes another path of. */
static void place_and_orientation_do_not_matter(void **state) {
    (void)state;
    for (int run = 0; run < 2 * COUNT_OF(kinds); run++) {
        const kind *k = &kinds[run / 2];
        if (is_swarm(k) && run % 2) continue; /* slow */
        static outline start;
        dem2d_fit_report r[2];
        start = given[ROUGH];
        for (int i = 0; i < start.count; i++)
            start.p[i] = vec(ldexp(round(ldexp(start.p[i].x, 30)), -30),
                             ldexp(round(ldexp(start.p[i].y, 30)), -30));
        moved = start;
        for (int i = 0; i < moved.count; i++) {
            const dem2d_vec p = start.p[run % 2 ? moved.count - 1 - i : i];
            moved.p[i] = run % 2 ? p : vec(p.x + 1024, p.y - 512);
        }
        dem2d_shape_destroy(fit(&start, &k->desc, &r[0]));
        dem2d_shape_destroy(fit(&moved, &k->desc, &r[1]));
        const bool direct = k->desc.model == DEM2D_CIRCLE || k->desc.model == DEM2D_FOURIER;
        const double close = is_swarm(k) ? 0.01 : direct ? 1e-6 : 1e-4; /* searches stop early */
        assert_within(r[1].coverage, r[0].coverage, close);
        if (run % 2) continue;
        assert_within(r[1].pose.position.x, r[0].pose.position.x + 1024, sqrt(close));
        assert_within(r[1].pose.position.y, r[0].pose.position.y - 512, sqrt(close));
    }
}

/* --- errors ---------------------------------------------------------------------------------- */

static void bad_fits_are_refused(void **state) {
    (void)state;
    static const struct {
        dem2d_fit_desc desc;
        dem2d_result result;
    } bad[] = {
        {{FS(-1, DEFAULT)}, DEM2D_OUT_OF_RANGE},
        {{FS(0, DEFAULT)}, DEM2D_OUT_OF_RANGE}, /* neither count nor coverage */
        {{FS(0, DEFAULT), .coverage = 1}, DEM2D_OUT_OF_RANGE},
        {{FS(0, DEFAULT), .coverage = -0.5}, DEM2D_OUT_OF_RANGE},
        {{FS(0, DEFAULT), .coverage = NAN}, DEM2D_NOT_FINITE},
        {{FS(8, AREA)}, DEM2D_OUT_OF_RANGE},
        {{FS(8, SWARM)}, DEM2D_OUT_OF_RANGE},
        {{FS(8, CONSTRAINED), .min_radius = -0.1}, DEM2D_OUT_OF_RANGE},
        {{FS(8, CONSTRAINED), .min_radius = 1.5}, DEM2D_OUT_OF_RANGE},
        {{FS(8, CONSTRAINED), .min_radius = NAN}, DEM2D_NOT_FINITE},
        {{FS(8, CONSTRAINED), .scale = (dem2d_fit_scale)7}, DEM2D_OUT_OF_RANGE},
        {{.model = DEM2D_FOURIER, .count = 8, .method = (dem2d_fit_method)99}, DEM2D_OUT_OF_RANGE},
        {{.model = DEM2D_BEZIER, .count = 2}, DEM2D_OUT_OF_RANGE},
        {{.model = DEM2D_BEZIER, .count = 8, .method = DEM2D_FIT_FEJER}, DEM2D_OUT_OF_RANGE},
        {{.model = DEM2D_POLYGON, .count = 2}, DEM2D_OUT_OF_RANGE},
        {{.model = DEM2D_POLYGON, .count = 8, .method = DEM2D_FIT_AREA}, DEM2D_OUT_OF_RANGE},
        {{.model = DEM2D_CIRCLE, .method = DEM2D_FIT_SWARM}, DEM2D_OUT_OF_RANGE},
        {{.model = DEM2D_ELLIPSE, .method = DEM2D_FIT_CONSTRAINED}, DEM2D_OUT_OF_RANGE},
        {{.model = DEM2D_CUSTOM, .count = 8}, DEM2D_OUT_OF_RANGE},
        {{.model = (dem2d_shape_type)99, .count = 8}, DEM2D_OUT_OF_RANGE},
    };
    const outline *o = &given[PENTAGON];
    for (int i = 0; i < COUNT_OF(bad); i++) {
        dem2d_shape *shape = NULL;
        dem2d_fit_report report, before;
        test_env env;
        test_env_init(&env);
        memset(&report, 0x5a, sizeof report), memcpy(&before, &report, sizeof report);
        const dem2d_result result =
            dem2d_outline_fit(&env.env, o->p, o->count, &bad[i].desc, &shape, &report);
        if (result != bad[i].result) print_error("case %d:\n", i);
        assert_result(result, bad[i].result);
        assert_logged(&env, bad[i].result, -1, NULL);
        assert_null(shape);
        assert_memory_equal(&report, &before, sizeof report);
        assert_clean(&env);
    }
    dem2d_shape *shape;
    const dem2d_fit_desc *fine = &kinds[0].desc;
    assert_result(dem2d_outline_fit(NULL, NULL, 5, fine, &shape, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_outline_fit(NULL, o->p, 5, NULL, &shape, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_outline_fit(NULL, o->p, 5, fine, NULL, NULL), DEM2D_NULL_ARGUMENT);
    assert_ok(dem2d_outline_fit(NULL, o->p, 5, fine, &shape, NULL)); /* no report is fine */
    dem2d_shape_destroy(shape);
}

static void bad_points_are_refused(void **state) {
    (void)state;
    for (int i = 0; i < BAD_OUTLINES; i++) {
        test_env env;
        dem2d_difference d, before;
        test_env_init(&env);
        for (int k = 0; k < COUNT_OF(kinds); k++) {
            dem2d_shape *shape = NULL;
            assert_result(dem2d_outline_fit(&env.env, bad_outlines[i].p, bad_outlines[i].count,
                                            &kinds[k].desc, &shape, NULL),
                          bad_outlines[i].result);
            assert_int_equal(env.log.result, bad_outlines[i].result);
            assert_null(shape);
        }
        memset(&d, 0x5a, sizeof d), memcpy(&before, &d, sizeof d);
        assert_result(
            dem2d_radial_compare(&env.env, bad_outlines[i].p, bad_outlines[i].count, 4, &d),
            bad_outlines[i].result);
        assert_memory_equal(&d, &before, sizeof d);
        assert_clean(&env);
    }
}

/* One fit, or the radial series for k = -1; how many allocations it took. */
static dem2d_result with_memory(int k, test_env *env, int fail_at) {
    const outline *o = &given[STAR];
    dem2d_shape *shape = NULL;
    dem2d_fit_report report, before;
    dem2d_difference d;
    memset(&report, 0x5a, sizeof report), memcpy(&before, &report, sizeof report);
    memset(&d, 0x5a, sizeof d);
    test_env_init(env);
    test_env_fail(env, fail_at);
    if (k < 0) {
        const dem2d_result result = dem2d_radial_compare(&env->env, o->p, o->count, 8, &d);
        if (result) assert_memory_equal(&d, &before, sizeof d); /* the same filling */
        assert_clean(env);
        return result;
    }
    const dem2d_result result =
        dem2d_outline_fit(&env->env, o->p, o->count, &kinds[k].desc, &shape, &report);
    if (result) {
        assert_null(shape);
        assert_memory_equal(&report, &before, sizeof report);
        assert_logged(env, DEM2D_OUT_OF_MEMORY, -1, NULL);
        assert_clean(env);
    }
    dem2d_shape_destroy(shape);
    assert_clean(env);
    return result;
}

static void every_allocation_can_fail(void **state) {
    (void)state;
    for (int k = -1; k < COUNT_OF(kinds); k++) {
        test_env env;
        assert_ok(with_memory(k, &env, 0));
        const int many = test_long() ? 60 : 20;
        const int calls = env.calls, step = calls < many ? 1 : 1 + calls / many; /* all, or many */
        if (k >= 0) assert_true(calls > 0);
        for (int at = 1; at <= calls; at += step)
            assert_result(with_memory(k, &env, at), DEM2D_OUT_OF_MEMORY);
    }
}

/* --- the radial series ------------------------------------------------------------------------ */

/* Coverage by the radial series about the centroid of an outline that is a star about it: where
   rays leave it, summed over 4096 directions. */
static double radial_covers(const outline *o, int order) {
    enum { RAYS = 4096 };
    static double r[RAYS];
    static dem2d_vec p[RAYS];
    double a[33] = {0}, b[33] = {0};
    dem2d_mass mass;
    assert_ok(dem2d_polygon_mass(o->p, o->count, &mass));
    const dem2d_vec c = mass.centroid;
    for (int j = 0; j < RAYS; j++) {
        const dem2d_vec u = direction((double)(2 * TEST_PI * j / RAYS));
        r[j] = 0;
        for (int i = 0; i < o->count; i++) {
            const dem2d_vec q = o->p[i], e = o->p[(i + 1) % o->count];
            const double dx = e.x - q.x, dy = e.y - q.y, den = u.x * dy - u.y * dx;
            const double t = ((q.x - c.x) * dy - (q.y - c.y) * dx) / den;
            const double s = ((q.x - c.x) * u.y - (q.y - c.y) * u.x) / den;
            if (den != 0 && s >= 0 && s <= 1 && t > r[j]) r[j] = t;
        }
        for (int n = 0; n <= order; n++) {
            const double t = (double)(2 * TEST_PI * n * j / RAYS);
            a[n] += 2 * r[j] * cos(t) / RAYS, b[n] += 2 * r[j] * sin(t) / RAYS;
        }
    }
    for (int j = 0; j < RAYS; j++) {
        const double t = (double)(2 * TEST_PI * j / RAYS);
        double sum = a[0] / 2;
        for (int n = 1; n <= order; n++) sum += a[n] * cos(n * t) + b[n] * sin(n * t);
        p[j] = vec(c.x + sum * cos(t), c.y + sum * sin(t));
    }
    return coverage(o->p, o->count, p, RAYS);
}

static void radial_series_compares(void **state) {
    (void)state;
    static const int orders[] = {1, 2, 4, 8, 16, 32};
    for (int i = 0; i < OUTLINES; i++) {
        for (int k = 0; k < COUNT_OF(orders); k++) {
            const outline *o = &given[i];
            dem2d_difference d;
            assert_ok(dem2d_radial_compare(NULL, o->p, o->count, orders[k], &d));
            /* how r is sampled is the header's choice: corners make a difference of that size */
            assert_within(d.coverage, radial_covers(o, orders[k]), 2e-3L);
            const long double area = area_of(o->p, o->count);
            assert_within(d.area, (1 - d.coverage) * area, 1e-12L * area);
            assert_true(d.hausdorff >= 0);
            if (i == ROUND) assert_true(d.coverage >= 0.9999);
            if (i == OVAL && orders[k] == 32) assert_true(d.coverage >= 0.999);
        }
    }
    const outline *o = &given[BOX];
    dem2d_difference d;
    assert_result(dem2d_radial_compare(NULL, NULL, 4, 4, &d), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_radial_compare(NULL, o->p, 4, 4, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_radial_compare(NULL, o->p, 4, -1, &d), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_radial_compare(NULL, o->p, 4, 0x7fffffff, &d), DEM2D_OUT_OF_RANGE);
}

/* --- virtual grains --------------------------------------------------------------------------- */

/* The amplitude that a description asks for. */
static double asked_for(const dem2d_virtual_desc *desc, int n) {
    if (desc->spectrum) return desc->spectrum[n];
    if (n == 2) return desc->elongation;
    return n < 8 ? desc->roundness * 9 / n / n : desc->roughness * 64 / n / n;
}

static void check_grain(const dem2d_virtual_desc *desc, int order, bool feasible) {
    double a[25], b[25];
    long double la[25], lb[25];
    dem2d_shape *shape;
    assert_ok(dem2d_fourier_virtual(desc, order, a, b));
    assert_ok(dem2d_shape_create_fourier(NULL, a, b, order, &shape));
    dem2d_shape_destroy(shape);
    const long double half = a[0] / 2.0L, share = desc->min_radius > 0 ? desc->min_radius : 0.1;
    long double area = TEST_PI * half * half, common = 1;
    bool first = true;
    for (int n = 0; n <= order; n++) {
        la[n] = a[n], lb[n] = n ? b[n] : 0;
        if (n < 2) continue;
        const long double size = hypotl(la[n], lb[n]) / half, asked = asked_for(desc, n);
        area += TEST_PI / 2 * (1 - n * n) * half * half * size * size;
        if (first && asked > 0) common = size / asked, first = false;
        assert_within(size, common * asked, 1e-12L * asked); /* lowered together */
    }
    assert_near(area, TEST_PI * desc->radius * desc->radius, 1e-12L);
    const long double least = least_rho(la, lb, order) / half;
    assert_true(least >= share - 1e-12L);
    if (feasible)
        assert_within(common, 1, 1e-12L);
    else
        assert_true(common < 1 && least < share + 0.02L); /* and not more than need be */
}

static void virtual_grains_are_convex(void **state) {
    (void)state;
    static const double spectrum[13] = {0, 0, .02, 0, .015, .001, 0, 0, .0004, 0, 0, 0, .0001};
    static const struct {
        dem2d_virtual_desc desc;
        int order;
        bool feasible;
    } cases[] = {
        {{.radius = 1}, 8, true},
        {{.radius = 2, .elongation = 0.1, .roundness = 0.01, .roughness = 1e-4}, 12, true},
        {{.radius = 1e-3, .elongation = 0.3, .min_radius = 0.05}, 2, true},
        {{.radius = 5, .elongation = 0.5}, 4, false},
        {{.radius = 1, .elongation = 0.2, .roundness = 0.2, .roughness = 0.05}, 24, false},
        {{.radius = 1, .roughness = 0.1, .min_radius = 0.5}, 16, false},
        {{.radius = 1, .spectrum = spectrum}, 12, true},
    };
    for (int i = 0; i < COUNT_OF(cases); i++) {
        for (int seed = 0; seed < 12; seed++) {
            dem2d_virtual_desc desc = cases[i].desc;
            desc.seed = (uint64_t)seed;
            check_grain(&desc, cases[i].order, cases[i].feasible);
        }
    }
}

static void virtual_grains_are_seeded(void **state) {
    (void)state;
    dem2d_virtual_desc desc = {.radius = 1, .elongation = 0.1, .roundness = 0.02};
    double first[2][9], sums[3][2] = {{0}};
    for (int seed = 0; seed < 400; seed++) {
        double a[9], b[9], again[2][9];
        desc.seed = (uint64_t)seed;
        assert_ok(dem2d_fourier_virtual(&desc, 8, a, b));
        assert_ok(dem2d_fourier_virtual(&desc, 8, again[0], again[1]));
        assert_memory_equal(a, again[0], sizeof a);
        assert_memory_equal(b, again[1], sizeof b);
        if (seed == 0) memcpy(first[0], a, sizeof a), memcpy(first[1], b, sizeof b);
        if (seed > 0) assert_true(a[2] != first[0][2] && b[3] != first[1][3]);
        for (int n = 2; n <= 4; n++) {
            const double size = hypot(a[n], b[n]);
            sums[n - 2][0] += a[n] / size / 400, sums[n - 2][1] += b[n] / size / 400;
        }
    }
    for (int n = 0; n < 3; n++) /* phases all around: 1/20 is one standard deviation of a mean */
        assert_between(hypot(sums[n][0], sums[n][1]), 0, 0.2);
}

static void bad_virtual_grains_are_refused(void **state) {
    (void)state;
    static const double negative[5] = {0, 0, 0.01, -0.01, 0}, wrong[5] = {0, 0, NAN, 0, 0};
    static const struct {
        dem2d_virtual_desc desc;
        int order;
        dem2d_result result;
    } bad[] = {
        {{.radius = 0}, 4, DEM2D_OUT_OF_RANGE},
        {{.radius = -1}, 4, DEM2D_OUT_OF_RANGE},
        {{.radius = NAN}, 4, DEM2D_NOT_FINITE},
        {{.radius = 1, .elongation = -0.1}, 4, DEM2D_OUT_OF_RANGE},
        {{.radius = 1, .roundness = -0.1}, 4, DEM2D_OUT_OF_RANGE},
        {{.radius = 1, .roughness = HUGE_VAL}, 4, DEM2D_NOT_FINITE},
        {{.radius = 1, .min_radius = -0.1}, 4, DEM2D_OUT_OF_RANGE},
        {{.radius = 1, .min_radius = 1.1}, 4, DEM2D_OUT_OF_RANGE},
        {{.radius = 1, .spectrum = negative}, 4, DEM2D_OUT_OF_RANGE},
        {{.radius = 1, .spectrum = wrong}, 4, DEM2D_NOT_FINITE},
        {{.radius = 1}, -1, DEM2D_OUT_OF_RANGE},
    };
    double a[5] = {7, 7, 7, 7, 7}, b[5] = {7, 7, 7, 7, 7};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        assert_result(dem2d_fourier_virtual(&bad[i].desc, bad[i].order, a, b), bad[i].result);
        for (int n = 0; n < 5; n++) assert_true(a[n] == 7 && b[n] == 7);
    }
    const dem2d_virtual_desc fine = {.radius = 1};
    assert_result(dem2d_fourier_virtual(NULL, 4, a, b), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_fourier_virtual(&fine, 4, NULL, b), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_fourier_virtual(&fine, 4, a, NULL), DEM2D_NULL_ARGUMENT);
}

/* --- real outlines ---------------------------------------------------------------------------- */

/* Points of a file whose first line is "x,y"; false for another file. */
static bool read_outline(const char *folder, const char *name, outline *o) {
    char path[1024], line[256];
    const size_t length = strlen(name);
    o->name = name, o->count = 0;
    if (length < 5 || strcmp(name + length - 4, ".csv")) return false;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    if (fgets(line, sizeof line, file) && strncmp(line, "x,y", 3) == 0 &&
        strcspn(line, "\r\n") == 3)
        while (o->count < MOST &&
               fscanf(file, "%lf,%lf", &o->p[o->count].x, &o->p[o->count].y) == 2)
            o->count++;
    fclose(file);
    return o->count > 0;
}

/* Whether a list of names in the folder, core12.txt, has this file; false without a list. */
static bool is_core(const char *folder, const char *name) {
    char path[1024], word[256];
    bool found = false;
    snprintf(path, sizeof path, "%s/core12.txt", folder);
    FILE *file = fopen(path, "r");
    while (file && !found && fscanf(file, "%255s", word) == 1)
        found = strncmp(name, word, strlen(word)) == 0 && strcmp(name + strlen(word), ".csv") == 0;
    if (file) fclose(file);
    return found;
}

/* What the twelve grains of the list must reach in the mean: their hulls reach 0.980. */
static const struct {
    dem2d_fit_desc desc;
    double least;
} core_aims[] = {
    {{FS(4, DEFAULT)}, 0.919},
    {{FS(8, DEFAULT)}, 0.950},
    {{FS(16, DEFAULT)}, 0.966},
    {{FS(4, DEFAULT), .corners = true}, 0.922},
    {{FS(8, DEFAULT), .corners = true}, 0.953},
    {{FS(16, DEFAULT), .corners = true}, 0.967},
    {{.model = DEM2D_BEZIER, .count = 10}, 0.978},
    {{.model = DEM2D_BEZIER, .count = 10, .unbounded = true}, 0.9794},
};

typedef struct sums {
    int count, slow, core;
    double hull, by_kind[COUNT_OF(kinds)], by_aim[COUNT_OF(core_aims)];
} sums;

static void add_outline(const char *folder, const outline *o, sums *sum) {
    static dem2d_vec hull[MOST];
    int count;
    const bool slow = sum->count++ % 16 == 0; /* for a few of them, what takes long */
    sum->slow += slow;
    assert_ok(dem2d_polygon_hull(NULL, o->p, o->count, hull, &count));
    sum->hull += 2 - (double)(area_of(hull, count) / area_of(o->p, o->count));
    for (int k = 0; k < COUNT_OF(kinds); k++) {
        dem2d_fit_report report;
        if (is_swarm(&kinds[k]) && !slow) continue;
        dem2d_shape *shape = fit(o, &kinds[k].desc, &report);
        if (slow) check_report(o, &kinds[k].desc, shape, &report);
        sum->by_kind[k] += report.coverage;
        dem2d_shape_destroy(shape);
    }
    if (!is_core(folder, o->name)) return;
    sum->core++;
    for (int k = 0; k < COUNT_OF(core_aims); k++) sum->by_aim[k] += covers(o, &core_aims[k].desc);
}

static void real_outlines(void **state) {
    (void)state;
    const char *folder = data_folder();
    if (!folder) return;
    static outline o;
    static sums sum;
    DIR *dir = opendir(folder);
    assert_non_null(dir);
    for (const struct dirent *entry; (entry = readdir(dir));)
        if (read_outline(folder, entry->d_name, &o)) add_outline(folder, &o, &sum);
    closedir(dir);
    assert_true(sum.count > 0);
    const double hull = sum.hull / sum.count; /* about the best of any convex shape */
    print_message("%d outlines, mean coverage: hulls %.4f\n", sum.count, hull);
    for (int k = 0; k < COUNT_OF(kinds); k++) {
        const double mean = sum.by_kind[k] / (is_swarm(&kinds[k]) ? sum.slow : sum.count);
        print_message("%-18s %.4f\n", kinds[k].name, mean);
        if (strcmp(kinds[k].name, "series 8") == 0) assert_true(mean >= hull - 0.05);
        if (strcmp(kinds[k].name, "bezier 10") == 0) assert_true(mean >= hull - 0.01);
    }
    for (int k = 0; sum.core > 0 && k < COUNT_OF(core_aims); k++) {
        const dem2d_fit_desc *desc = &core_aims[k].desc;
        const double mean = sum.by_aim[k] / sum.core;
        print_message("%d of core12.txt, model %d, %2d%s: %.4f, aim %.3f\n", sum.core,
                      (int)desc->model, desc->count, desc->corners ? " corners" : "", mean,
                      core_aims[k].least);
        assert_true(mean >= core_aims[k].least);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_model_fits_every_outline),
        cmocka_unit_test(own_kind_is_recovered),
        cmocka_unit_test(reduction_is_the_papers),
        cmocka_unit_test(fejer_is_convex),
        cmocka_unit_test(constrained_is_convex_and_best),
        cmocka_unit_test(scale_sets_the_area),
        cmocka_unit_test(no_ellipse_is_better),
        cmocka_unit_test(no_polygon_is_better),
        cmocka_unit_test(polybeziers_are_bounded),
        cmocka_unit_test(swarm_repeats_and_area_is_as_good),
        cmocka_unit_test(least_count_reaches),
        cmocka_unit_test(what_is_impossible_is_not_reached),
        cmocka_unit_test(powers_of_two_scale_exactly),
        cmocka_unit_test(place_and_orientation_do_not_matter),
        cmocka_unit_test(bad_fits_are_refused),
        cmocka_unit_test(bad_points_are_refused),
        cmocka_unit_test(every_allocation_can_fail),
        cmocka_unit_test(radial_series_compares),
        cmocka_unit_test(virtual_grains_are_convex),
        cmocka_unit_test(virtual_grains_are_seeded),
        cmocka_unit_test(bad_virtual_grains_are_refused),
        cmocka_unit_test(real_outlines),
    };
    return cmocka_run_group_tests_name("fits", tests, make_outlines, NULL);
}
