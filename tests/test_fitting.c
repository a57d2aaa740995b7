/* Templates from outlines: hulls, Fourier series and their convexity, polybeziers. The areas come
   from an exact count along scan lines that shares no code with the header. */
#define _POSIX_C_SOURCE 200809L /* opendir, for the outlines of DATA */
#include "dem2d.h"

#include "testing.h"
#include "outline_oracle.h"

#include <dirent.h>

/* --- coverage -----------------------------------------------------------------------------------
 */

static double coverage(const dem2d_vec *reference, int n, const dem2d_vec *other, int m) {
    const scan_areas areas = scan_outlines(reference, n, other, m, 1000);
    return 1 - areas.difference / areas.first;
}

/* Coverage of an outline by a shape, which is put where its data was. */
static double coverage_by(const dem2d_vec *points, int count, const dem2d_shape *shape) {
    static dem2d_vec outline[1000];
    dem2d_shape_info info;
    assert_ok(dem2d_shape_get(shape, &info));
    dem2d_pose pose = still();
    pose.position = info.offset;
    assert_ok(dem2d_shape_outline(shape, pose, 1000, outline));
    return coverage(points, count, outline, 1000);
}

/* --- hulls ---------------------------------------------------------------------------------------
 */

static long double cross3(dem2d_vec o, dem2d_vec a, dem2d_vec b) {
    return ((long double)a.x - o.x) * ((long double)b.y - o.y) -
           ((long double)a.y - o.y) * ((long double)b.x - o.x);
}

/* A strictly convex polygon whose corners are given points and that holds all of them is the hull;
   nothing else is. `rounding` is 0 for small integers. */
static void check_hull(const dem2d_vec *points, int n, long double rounding) {
    dem2d_vec hull[500];
    int m = -1;
    assert_ok(dem2d_polygon_hull(NULL, points, n, hull, &m));
    assert_between(m, 3, n);
    for (int i = 0; i < m; i++) {
        const dem2d_vec a = hull[i], b = hull[(i + 1) % m];
        assert_true(cross3(a, b, hull[(i + 2) % m]) > 0);
        bool given = false;
        for (int k = 0; k < n; k++) {
            given = given || (points[k].x == a.x && points[k].y == a.y);
            assert_true(cross3(a, b, points[k]) >= -rounding);
        }
        assert_true(given);
    }
}

static void hulls(void **state) {
    (void)state;
    uint64_t random = 41;
    for (int run = 0; run < 400; run++) {
        dem2d_vec p[500];
        const int n = 3 + random_below(&random, run % 2 ? 60 : 9), size = 2 + run % 7;
        bool flat = true;
        for (int i = 0; i < n; i++) {
            p[i] = vec(random_below(&random, size) - 3, random_below(&random, size));
            for (int k = 0; k < i; k++) flat = flat && cross3(p[0], p[k], p[i]) == 0;
        }
        dem2d_vec hull[500];
        int count;
        if (!flat)
            check_hull(p, n, 0);
        else
            assert_result(dem2d_polygon_hull(NULL, p, n, hull, &count), DEM2D_ZERO_AREA);
    }
    for (int run = 0; run < 30; run++) {
        dem2d_vec p[500];
        for (int i = 0; i < 500; i++) {
            p[i] = direction(random_between(&random, 0, 6.3));
            if (run % 2) p[i].x *= random_between(&random, 0, 1e-3);
        }
        check_hull(p, 500, 1e-15L);
    }
}

/* --- Fourier series
 * ------------------------------------------------------------------------------- */

/* Dense outline of a convex series. */
static void series_outline(const double *a, const double *b, int order, int n, dem2d_vec *p) {
    for (int i = 0; i < n; i++) {
        const long double t = 2 * TEST_PI * (i + 0.37L) / n;
        long double h = a[0] / 2.0L, slope = 0;
        for (int k = 1; k <= order; k++) {
            h += a[k] * cosl(k * t) + b[k] * sinl(k * t);
            slope += k * (b[k] * cosl(k * t) - a[k] * sinl(k * t));
        }
        p[i] =
            vec((double)(h * cosl(t) - slope * sinl(t)), (double)(h * sinl(t) + slope * cosl(t)));
    }
}

/* From n points of its outline the coefficients come back; the polygon lies inside by a part of
   (pi / n)^2, so twice the points leave a quarter of the error. */
static void fit_recovers_a_series(void **state) {
    (void)state;
    const double a[9] = {4, 20, .12, .03, .01, 0, .004, 0, .002};
    const double b[9] = {0, -9, .05, -.02, .015, .003, 0, .001, .001};
    static dem2d_vec p[MOST];
    double error[3], found_a[9], found_b[9];
    for (int i = 0; i < 3; i++) {
        const int n = 500 << i;
        series_outline(a, b, 8, n, p);
        for (int k = 0; i == 1 && k < n / 2; k++) { /* clockwise does not matter */
            const dem2d_vec swap = p[k];
            p[k] = p[n - 1 - k], p[n - 1 - k] = swap;
        }
        assert_ok(dem2d_fourier_fit(NULL, p, n, 8, 4096, found_a, found_b));
        error[i] = a[0] - found_a[0];
        for (int k = 1; k <= 8; k++) {
            assert_within(found_a[k], a[k], 10.0L / n / n);
            assert_within(found_b[k], b[k], 10.0L / n / n);
        }
        assert_between(error[i], 0, 10.0L / n / n);
    }
    assert_between(error[0] / error[1], 3.5, 4.5);
    assert_between(error[1] / error[2], 3.5, 4.5);
    assert_true(found_b[0] == 0);
}

/* Of a convex polygon: a0 = perimeter / pi, and p_n = rho_n / (1 - n^2) with rho_n from the edge
   lengths at the edge normals. 20000 samples alias below 1e-7 of the perimeter. */
static void fit_of_a_polygon(void **state) {
    (void)state;
    static const dem2d_vec p[] = {{0, 0}, {4, -1}, {6, 2}, {3, 5}, {2, 1}, {-1, 3}, {1, 1}};
    static const int hull[] = {0, 1, 2, 3, 5}; /* the others are inside or dents */
    double a[13], b[13];
    assert_ok(dem2d_fourier_fit(NULL, p, 7, 12, 20000, a, b));
    for (int n = 0; n <= 12; n++) {
        long double c = 0, s = 0;
        if (n == 1) continue; /* the Steiner point is not in rho */
        for (int i = 0; i < 5; i++) {
            const dem2d_vec from = p[hull[i]], to = p[hull[(i + 1) % 5]];
            const long double dx = (long double)to.x - from.x, dy = (long double)to.y - from.y;
            const long double length = hypotl(dx, dy), t = atan2l(-dx, dy);
            c += length * cosl(n * t) / TEST_PI, s += length * sinl(n * t) / TEST_PI;
        }
        assert_within(a[n], c / (1 - n * n), 1e-7L);
        assert_within(b[n], s / (1 - n * n), 1e-7L);
    }
    double c[13], d[13];
    assert_ok(dem2d_fourier_fit(NULL, p, 7, 12, 0, a, b));
    assert_ok(dem2d_fourier_fit(NULL, p, 7, 12, 16 * 12 + 64, c, d));
    assert_memory_equal(a, c, sizeof a);
    assert_memory_equal(b, d, sizeof b);
}

/* Least and greatest rho of a series over 1e5 directions, by powers in long double. */
static void scan_rho(const double *a, const double *b, int order, long double *least,
                     long double *most) {
    *least = HUGE_VALL, *most = -HUGE_VALL;
    for (int i = 0; i < 100000; i++) {
        const long double x = cosl(2 * TEST_PI * i / 100000), y = sinl(2 * TEST_PI * i / 100000);
        long double c = x, s = y, rho = a[0] / 2.0L;
        for (int n = 2; n <= order; n++) {
            const long double turned = c * x - s * y;
            s = c * y + s * x, c = turned;
            rho += (1 - n * n) * (a[n] * c + b[n] * s);
        }
        *least = fminl(*least, rho), *most = fmaxl(*most, rho);
    }
}

/* A series with a0/2 = 1 and |rho - 1| about `swing`. */
static void random_series(uint64_t *random, int order, double swing, double *a, double *b) {
    for (int n = 0; n <= order; n++) {
        const double size = n > 1 ? swing / (n * n - 1) / sqrt(order) : 0.3;
        a[n] = size * random_between(random, -1, 1), b[n] = size * random_between(random, -1, 1);
    }
    a[0] = 2, b[0] = 0;
}

static void convexity_brackets_the_scan(void **state) {
    (void)state;
    uint64_t random = 43;
    int convex = 0, loose = 0;
    for (int run = 0; run < 60; run++) {
        static const int orders[] = {0, 1, 2, 3, 5, 8, 13, 20, 32, 64};
        const int order = orders[run % 10];
        double a[65], b[65];
        long double least, most, margin = 1, size = 1;
        random_series(&random, order, run / 10 * 0.7, a, b);
        for (int n = 2; n <= order; n++) {
            const long double weight = (n * n - 1) * hypotl(a[n], b[n]);
            margin -= weight, size += weight;
        }
        scan_rho(a, b, order, &least, &most);
        dem2d_convexity c;
        assert_ok(dem2d_fourier_convexity(a, b, order, &c));
        assert_within(c.sufficient_margin, margin, 1e-14L * size);
        assert_int_equal(c.sufficient, c.sufficient_margin >= 0);
        assert_true(c.exact || !c.sufficient);
        /* the scan is above the true minimum, by at most (order pi / 1e5)^2 / 2 of the swing */
        const long double miss = order * order * 5e-10L * (most - least) + 1e-13L * size;
        assert_true(c.rho_min_lower <= least + 1e-13L * size);
        assert_true(c.rho_min_upper >= least - miss);
        assert_true(c.rho_min_upper <= most + 1e-13L * size);
        /* and of use: the bracket is within 2 % of the swing */
        assert_between(c.rho_min_lower, least - 0.02L * (most - least) - miss, c.rho_min_upper);
        assert_true(c.rho_min_upper <= least + 0.02L * (most - least) + miss);
        if (least < -miss) assert_false(c.exact);
        if (least > 0.02L * (most - least) + miss) assert_true(c.exact);
        dem2d_shape *shape = NULL;
        assert_result(dem2d_shape_create_fourier(NULL, a, b, order, &shape),
                      c.exact ? DEM2D_OK : DEM2D_NEGATIVE_CURVATURE);
        dem2d_shape_destroy(shape);
        convex += c.exact, loose += c.exact && !c.sufficient;
    }
    assert_between(convex, 10, 50); /* both kinds were met, */
    assert_true(loose > 3);         /* and some that only the exact test knows to be convex */
}

static void reduction_makes_it_convex(void **state) {
    (void)state;
    uint64_t random = 47;
    for (int run = 0; run < 40; run++) {
        const int order = 2 + run % 16;
        double a[18], b[18];
        int counts[2] = {0, 0};
        random_series(&random, order, 4, a, b);
        for (int test = DEM2D_SUFFICIENT; test <= DEM2D_EXACT; test++) {
            double ra[18], rb[18];
            memcpy(ra, a, sizeof a), memcpy(rb, b, sizeof b);
            const dem2d_reduction_desc desc = {.test = (dem2d_convexity_test)test};
            assert_ok(dem2d_fourier_reduce(ra, rb, order, &desc, &counts[test]));
            dem2d_convexity c;
            assert_ok(dem2d_fourier_convexity(ra, rb, order, &c));
            assert_true(test == DEM2D_SUFFICIENT ? c.sufficient : c.exact);
            dem2d_shape *shape;
            assert_ok(dem2d_shape_create_fourier(NULL, ra, rb, order, &shape));
            dem2d_shape_destroy(shape);
            /* a0, a1, b1 stay; each pair is a power of the factor times itself, or 0 */
            assert_true(ra[0] == a[0] && ra[1] == a[1] && rb[1] == b[1]);
            double powers = 0;
            for (int n = 2; n <= order; n++) {
                assert_within(ra[n] * (long double)b[n], rb[n] * (long double)a[n], 1e-16L);
                if (ra[n] == 0) continue;
                const double power = log(ra[n] / a[n]) / log(0.9);
                assert_within(power, round(power), 1e-9L);
                powers += round(power);
            }
            assert_true(powers <= counts[test]);
        }
        assert_true(counts[DEM2D_EXACT] <= counts[DEM2D_SUFFICIENT]);
    }
}

static void reduction_options(void **state) {
    (void)state;
    double a[9], b[9], c[9], d[9];
    uint64_t random = 53;
    random_series(&random, 8, 6, a, b);
    memcpy(c, a, sizeof a), memcpy(d, b, sizeof b);
    const dem2d_reduction_desc none = {.test = DEM2D_NO_TEST}, zero = {.test = DEM2D_SUFFICIENT};
    const dem2d_reduction_desc same = {.test = DEM2D_SUFFICIENT, .factor = 0.9, .tolerance = 1e-6};
    const dem2d_reduction_desc steep = {.test = DEM2D_SUFFICIENT, .factor = 0.5, .tolerance = 1e-3};
    int count = -1, other;
    assert_ok(dem2d_fourier_reduce(c, d, 8, &none, &count));
    assert_int_equal(count, 0);
    assert_memory_equal(a, c, sizeof a);
    assert_memory_equal(b, d, sizeof b);
    static const dem2d_reduction_desc bad[] = {
        {.test = DEM2D_SUFFICIENT, .factor = 1},
        {.test = DEM2D_SUFFICIENT, .factor = -0.5},
        {.test = DEM2D_SUFFICIENT, .factor = 1.5},
        {.test = DEM2D_SUFFICIENT, .tolerance = -1},
        {.test = (dem2d_convexity_test)3},
        {.test = DEM2D_EXACT, .factor = NAN},
        {.test = DEM2D_EXACT, .factor = 0.5, .tolerance = NAN},
        {.test = DEM2D_EXACT, .factor = 0.5, .tolerance = HUGE_VAL}};
    for (int i = 0; i < COUNT_OF(bad); i++)
        assert_result(dem2d_fourier_reduce(c, d, 8, &bad[i], &count),
                      i < 5 ? DEM2D_OUT_OF_RANGE : DEM2D_NOT_FINITE);
    static const dem2d_reduction_desc wide = {.test = DEM2D_NO_TEST,
                                              .tolerance = 1.7e308}; /* of a0, above 1 */
    const double wider[3] = {2, 0, 0};
    memcpy(c, wider, sizeof wider);
    assert_ok(dem2d_fourier_reduce(c, d, 2, &wide, NULL));
    memcpy(c, a, sizeof a);
    assert_result(dem2d_fourier_reduce(c, d, -1, &zero, NULL), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_fourier_reduce(NULL, d, 8, &zero, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_fourier_reduce(c, NULL, 8, &zero, NULL), DEM2D_NULL_ARGUMENT);
    c[0] = -2;
    assert_result(dem2d_fourier_reduce(c, d, 8, &zero, NULL), DEM2D_ZERO_AREA);
    c[0] = 2, c[3] = NAN;
    assert_result(dem2d_fourier_reduce(c, d, 8, &zero, NULL), DEM2D_NOT_FINITE);
    c[3] = a[3];
    assert_memory_equal(a, c, sizeof a); /* none of the failures changed a number */
    assert_memory_equal(b, d, sizeof b);
    assert_ok(dem2d_fourier_reduce(a, b, 8, &zero, NULL));
    assert_ok(dem2d_fourier_reduce(c, d, 8, &same, &count));
    assert_memory_equal(a, c, sizeof a); /* 0 means the defaults of the manual */
    assert_memory_equal(b, d, sizeof b);
    random = 53;
    random_series(&random, 8, 6, a, b);
    assert_ok(dem2d_fourier_reduce(a, b, 8, &steep, &other));
    assert_between(other, 1, count - 1);
    for (int n = 2; n <= 8; n++) /* 1e-3 of a0: smaller pairs above the last one left are gone */
        if (hypot(a[n], b[n]) < 1e-3) assert_true(a[n] == 0 && b[n] == 0);
    dem2d_convexity convexity;
    assert_result(dem2d_fourier_convexity(NULL, b, 8, &convexity), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_fourier_convexity(a, NULL, 8, &convexity), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_fourier_convexity(a, b, 8, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_fourier_convexity(a, b, -1, &convexity), DEM2D_OUT_OF_RANGE);
    a[4] = HUGE_VAL;
    assert_result(dem2d_fourier_convexity(a, b, 8, &convexity), DEM2D_NOT_FINITE);
}

/* --- polybeziers
 * ---------------------------------------------------------------------------------- */

/* The shape of the fitted control points; NULL, with a message, when they are none. */
static dem2d_shape *bezier_of(const dem2d_vec *points, int count, int arcs) {
    dem2d_vec control[3 * 20];
    test_env env;
    dem2d_shape *shape = NULL;
    test_env_init(&env);
    assert_ok(dem2d_bezier_fit(&env.env, points, count, arcs, control));
    assert_clean(&env);
    env.env.allocate = NULL, env.env.release = NULL; /* the shape lives longer than env */
    const dem2d_result result = dem2d_shape_create_bezier(&env.env, control, arcs, &shape);
    static int told; /* a few are enough to find the cause */
    if (result && told++ < 10)
        print_error("%d arcs on %d points: %s: %s\n", arcs, count, dem2d_result_text(result),
                    env.log.text);
    return shape;
}

/* 0 when there is no shape. */
static double bezier_coverage(const dem2d_vec *points, int count, int arcs) {
    dem2d_shape *shape = bezier_of(points, count, arcs);
    const double covered = shape ? coverage_by(points, count, shape) : 0;
    dem2d_shape_destroy(shape);
    return covered;
}

/* Round outlines: ten arcs cover all but a thousandth, at any size, place and orientation. */
static void bezier_fit_of_round_outlines(void **state) {
    (void)state;
    static const double sizes[] = {1e-60, 1e-3, 1, 1e6, 1e60};
    dem2d_vec p[400];
    for (int run = 0; run < 4 * COUNT_OF(sizes); run++) {
        const double size = sizes[run / 4], aspect = 1 + 0.3 * (run % 4), tilt = run;
        for (int i = 0; i < 400; i++) {
            const dem2d_vec u = direction((run % 2 ? -1 : 1) * 0.0157079632679489 * i);
            const double x = aspect * u.x, y = u.y;
            p[i].x = size * (x * cos(tilt) - y * sin(tilt) + 3);
            p[i].y = size * (x * sin(tilt) + y * cos(tilt) - 8);
        }
        assert_between(bezier_coverage(p, 400, 10), 0.999, 1);
    }
}

/* Angular outlines whose knots share corners or lie along edges: always a shape. How much it
   covers is bounded only by common sense. */
static void bezier_fit_of_polygons(void **state) {
    (void)state;
    uint64_t random = 59;
    double worst = 1;
    int failed = 0;
    for (int run = 0; run < 60; run++) {
        dem2d_vec p[24];
        int n = 3 + run % 10;
        for (int i = 0; i < n; i++) { /* regular: many edges are normal to a direction */
            p[i] = direction(6.283185307179586 * i / n);
            if (run >= 10 && run < 50) { /* irregular, 3 to 12 corners */
                p[i] = direction(6.283185307179586 * (i + random_between(&random, 0, 0.7)) / n);
                p[i].x *= 1 + run % 3;
            }
        }
        if (run >= 50) { /* rectangles, axis-aligned, up to 10:1 */
            const double w = run - 49, h = 1;
            const dem2d_vec box[4] = {{0, 0}, {w, 0}, {w, h}, {0, h}};
            memcpy(p, box, sizeof box), n = 4;
        }
        for (int arcs = 3; arcs <= 20; arcs++) {
            if (!test_long() && (run + arcs) % 3 > 0 && arcs != 10) continue;
            dem2d_shape *shape = bezier_of(p, n, arcs);
            if (!shape)
                failed++;
            else if (arcs == 10)
                worst = fmin(worst, coverage_by(p, n, shape));
            dem2d_shape_destroy(shape);
        }
    }
    assert_int_equal(failed, 0);
    print_message("polygons: least coverage by 10 arcs %.4f\n", worst);
    assert_true(worst > 0.98);
}

/* Concave outlines with noise, as traced from pictures: waves, spikes, steps of whole pixels. */
static void bezier_fit_of_rough_outlines(void **state) {
    (void)state;
    static const int some[] = {3, 4, 5, 8, 10, 12, 16}; /* multiples of 4 meet the axes */
    uint64_t random = 61;
    int failed = 0;
    for (int run = 0; run < 60; run++) {
        dem2d_vec p[170];
        const double noise = 0.02 * (run % 6), wave = 0.1 * (run % 4);
        const int n = 12 + random_below(&random, 150), lobes = 2 + run % 5;
        for (int i = 0; i < n; i++) {
            const double t = 6.283185307179586 * i / n;
            const double r = 1 + wave * cos(lobes * t) + random_between(&random, -noise, noise);
            p[i] = vec(50 + 30 * r * cos(t), 40 + 20 * r * sin(t));
            if (run % 3 == 0) p[i] = vec(round(p[i].x), round(p[i].y));
        }
        for (int k = 0; k < COUNT_OF(some); k++) {
            if (!test_long() && (run + k) % 2 > 0) continue;
            dem2d_shape *shape = bezier_of(p, n, some[k]);
            failed += !shape;
            dem2d_shape_destroy(shape);
        }
        double a[9], b[9];
        dem2d_shape *shape;
        const dem2d_reduction_desc exact = {.test = DEM2D_EXACT};
        assert_ok(dem2d_fourier_fit(NULL, p, n, 8, 0, a, b));
        assert_ok(dem2d_fourier_reduce(a, b, 8, &exact, NULL));
        assert_ok(dem2d_shape_create_fourier(NULL, a, b, 8, &shape));
        dem2d_shape_destroy(shape);
    }
    assert_int_equal(failed, 0);
}

/* --- errors of all fits
 * ---------------------------------------------------------------------------- */

/* One of the three fits on these points; the outputs are out. */
static dem2d_result fit(int which, const dem2d_env *env, const dem2d_vec *p, int n,
                        double out[64]) {
    dem2d_vec points[16];
    int count = -7;
    dem2d_result result;
    switch (which) {
    case 0:
        return dem2d_fourier_fit(env, p, n, 8, 0, out, out + 9);
    case 1:
        memcpy(points, out, sizeof points);
        result = dem2d_bezier_fit(env, p, n, 4, points);
        break;
    default:
        memcpy(points, out, sizeof points);
        result = dem2d_polygon_hull(env, p, n, points, &count);
        if (result) assert_int_equal(count, -7);
    }
    memcpy(out, points, sizeof points);
    return result;
}

static void fits_check_their_points(void **state) {
    (void)state;
    double out[64], before[64];
    memset(out, 0x5a, sizeof out), memcpy(before, out, sizeof out);
    for (int which = 0; which < 3; which++) {
        for (int i = 0; i < BAD_OUTLINES; i++) {
            test_env env;
            test_env_init(&env);
            const dem2d_result expected = bad_outlines[i].result;
            assert_result(fit(which, &env.env, bad_outlines[i].p, bad_outlines[i].count, out),
                          expected);
            assert_memory_equal(out, before, sizeof out);
            assert_result(env.log.result, expected);
            if (i < 2) assert_logged(&env, expected, 2 + i, NULL);
            assert_clean(&env);
        }
        assert_result(fit(which, NULL, NULL, 4, out), DEM2D_NULL_ARGUMENT);
    }
    const dem2d_vec *p = (const dem2d_vec[]){{0, 0}, {1, 0}, {0, 1}};
    dem2d_vec control[16];
    int count;
    assert_result(dem2d_polygon_hull(NULL, p, 3, NULL, &count), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_polygon_hull(NULL, p, 3, control, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_fourier_fit(NULL, p, 3, 8, 0, NULL, out), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_fourier_fit(NULL, p, 3, 8, 0, out, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_fourier_fit(NULL, p, 3, -1, 0, out, out + 9), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_fourier_fit(NULL, p, 3, 8, 16, out, out + 9), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_fourier_fit(NULL, p, 3, 8, -1, out, out + 9), DEM2D_OUT_OF_RANGE);
    assert_memory_equal(out, before, sizeof out);
    assert_ok(dem2d_fourier_fit(NULL, p, 3, 8, 17, out, out + 9));
    assert_result(dem2d_bezier_fit(NULL, p, 3, 4, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_bezier_fit(NULL, p, 3, 2, control), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_bezier_fit(NULL, p, 3, -1, control), DEM2D_OUT_OF_RANGE);
}

static void every_allocation_can_fail(void **state) {
    (void)state;
    const dem2d_vec p[] = {{0, 0}, {4, -1}, {6, 2}, {3, 5}, {-1, 3}};
    for (int which = 0; which < 3; which++) {
        double out[64], before[64];
        for (int i = 0; i < 64; i++) out[i] = 0.7; /* so small that any sum shows */
        memcpy(before, out, sizeof out);
        for (int k = 1;; k++) {
            test_env env;
            test_env_init(&env);
            test_env_fail(&env, k);
            const dem2d_result result = fit(which, &env.env, p, 5, out);
            assert_clean(&env);
            if (result == DEM2D_OK) {
                assert_true(k > 1 && env.calls == k - 1);
                break;
            }
            assert_logged(&env, DEM2D_OUT_OF_MEMORY, -1, NULL);
            assert_result(result, DEM2D_OUT_OF_MEMORY);
            assert_memory_equal(out, before, sizeof out);
        }
    }
}

/* --- real outlines
 * ---------------------------------------------------------------------------------- */

/* Points of a file whose first line is "x,y"; 0 for another file. */
static int read_outline(const char *folder, const char *name, dem2d_vec *points) {
    char path[1024], line[256];
    const size_t length = strlen(name);
    if (length < 5 || strcmp(name + length - 4, ".csv")) return 0;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    int count = 0;
    if (fgets(line, sizeof line, file) && strncmp(line, "x,y", 3) == 0 &&
        strcspn(line, "\r\n") == 3)
        while (count < MOST && fscanf(file, "%lf,%lf", &points[count].x, &points[count].y) == 2)
            count++;
    fclose(file);
    return count;
}

static void real_outlines(void **state) {
    (void)state;
    const char *folder = data_folder();
    if (!folder) return;
    DIR *dir = opendir(folder);
    assert_non_null(dir);
    int count = 0;
    double bezier = 0, series = 0, worst = 1;
    for (const struct dirent *entry; (entry = readdir(dir));) {
        static dem2d_vec points[MOST];
        const int n = read_outline(folder, entry->d_name, points);
        if (n == 0) continue;
        const double covered = bezier_coverage(points, n, 10);
        assert_true(covered > 0);
        bezier += covered, worst = fmin(worst, covered), count++;
        double a[9], b[9];
        const dem2d_reduction_desc exact = {.test = DEM2D_EXACT};
        dem2d_shape *shape;
        assert_ok(dem2d_fourier_fit(NULL, points, n, 8, 0, a, b));
        assert_ok(dem2d_fourier_reduce(a, b, 8, &exact, NULL));
        assert_ok(dem2d_shape_create_fourier(NULL, a, b, 8, &shape));
        series += coverage_by(points, n, shape);
        dem2d_shape_destroy(shape);
    }
    closedir(dir);
    assert_true(count > 0);
    print_message("%d outlines: mean coverage by 10 arcs %.4f (least %.4f), by order 8 %.4f\n",
                  count, bezier / count, worst, series / count);
    assert_true(bezier / count >= 0.97);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hulls),
        cmocka_unit_test(fit_recovers_a_series),
        cmocka_unit_test(fit_of_a_polygon),
        cmocka_unit_test(convexity_brackets_the_scan),
        cmocka_unit_test(reduction_makes_it_convex),
        cmocka_unit_test(reduction_options),
        cmocka_unit_test(bezier_fit_of_round_outlines),
        cmocka_unit_test(bezier_fit_of_polygons),
        cmocka_unit_test(bezier_fit_of_rough_outlines),
        cmocka_unit_test(fits_check_their_points),
        cmocka_unit_test(every_allocation_can_fail),
        cmocka_unit_test(real_outlines),
    };
    return cmocka_run_group_tests_name("fitting", tests, NULL, NULL);
}
