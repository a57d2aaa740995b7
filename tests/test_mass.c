/* Area, centroid and polar moment: closed forms, and dense polygons in long double for the rest. */
#include "dem2d.h"

#include "testing.h"

#define KAPPA 0.5522847498 /* handle length of a quarter circle */

typedef struct point {
    long double x, y;
} point;

typedef struct moments {
    long double area, x, y, polar; /* polar about the centroid (x, y) */
} moments;

/* A closed curve in smooth pieces: the point of a piece at t in [0, 1). */
typedef struct curve {
    point (*at)(const struct curve *curve, int piece, long double t);
    const dem2d_vec *points; /* control or corner points */
    const double *a, *b;     /* series */
    int pieces;              /* arcs; corners and sides; 1 for a series */
    long double radius;      /* rounding */
    int order;
} curve;

static point bezier_at(const curve *c, int piece, long double t) {
    const long double s = 1 - t, w[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
    point p = {0, 0};
    for (int k = 0; k < 4; k++) {
        const dem2d_vec q = c->points[(3 * piece + k) % (3 * c->pieces)];
        p.x += w[k] * q.x, p.y += w[k] * q.y;
    }
    return p;
}

static point series_at(const curve *c, int piece, long double t) {
    const long double angle = 2 * TEST_PI * t;
    long double h = c->a[0] / 2.0L, slope = 0;
    for (int n = 1; n <= c->order; n++) {
        const long double x = cosl(n * angle), y = sinl(n * angle);
        h += c->a[n] * x + c->b[n] * y, slope += n * (c->b[n] * x - c->a[n] * y);
    }
    (void)piece;
    return (point){h * cosl(angle) - slope * sinl(angle), h * sinl(angle) + slope * cosl(angle)};
}

/* Even pieces are the round corners, odd ones the sides. */
static point rounded_at(const curve *c, int piece, long double t) {
    const int n = c->pieces / 2, i = piece / 2;
    const dem2d_vec before = c->points[(i + n - 1) % n], p = c->points[i];
    const dem2d_vec after = c->points[(i + 1) % n];
    const long double from = atan2l((long double)before.x - p.x, (long double)p.y - before.y);
    const long double to = atan2l((long double)p.x - after.x, (long double)after.y - p.y);
    if (piece % 2) {
        const long double x = p.x + t * ((long double)after.x - p.x);
        const long double y = p.y + t * ((long double)after.y - p.y);
        return (point){x + c->radius * cosl(to), y + c->radius * sinl(to)};
    }
    const long double turn = to < from ? to - from + 2 * TEST_PI : to - from;
    return (point){p.x + c->radius * cosl(from + t * turn),
                   p.y + c->radius * sinl(from + t * turn)};
}

/* Area and moments about the origin of the polygon with n points on each piece. */
static void add_polygon(const curve *c, int n, long double sum[4]) {
    point p = c->at(c, 0, 0);
    for (int k = 0; k < 4; k++) sum[k] = 0;
    for (int i = 1; i <= n * c->pieces; i++) {
        const int next = i % (n * c->pieces);
        const point q = c->at(c, next / n, (long double)(next % n) / n);
        const long double cross = p.x * q.y - p.y * q.x;
        sum[0] += cross / 2;
        sum[1] += cross * (p.x + q.x) / 6;
        sum[2] += cross * (p.y + q.y) / 6;
        sum[3] +=
            cross * (p.x * p.x + p.x * q.x + q.x * q.x + p.y * p.y + p.y * q.y + q.y * q.y) / 12;
        p = q;
    }
}

/* The polygon's errors go as 1/n^2, 1/n^4, ...: two steps of Richardson leave 1/n^6, which at
   n >= 1000 is below 1e-14. */
static moments true_moments(const curve *c) {
    long double sum[3][4], best[4];
    for (int i = 0; i < 3; i++) add_polygon(c, 1000 << i, sum[i]);
    for (int k = 0; k < 4; k++) {
        const long double one = sum[1][k] + (sum[1][k] - sum[0][k]) / 3;
        const long double two = sum[2][k] + (sum[2][k] - sum[1][k]) / 3;
        best[k] = two + (two - one) / 15;
    }
    const long double x = best[1] / best[0], y = best[2] / best[0];
    return (moments){best[0], x, y, best[3] - best[0] * (x * x + y * y)};
}

/* The shape's mass and offset against the truth, then destroys it. */
static void check_shape(dem2d_shape *shape, moments expected, long double tolerance) {
    dem2d_shape_info info;
    dem2d_mass mass;
    assert_ok(dem2d_shape_get(shape, &info));
    assert_ok(dem2d_shape_mass(shape, &mass));
    assert_memory_equal(&mass, &info.mass, sizeof mass);
    assert_near(mass.area, expected.area, tolerance);
    assert_near(mass.polar_moment, expected.polar, tolerance);
    assert_true(mass.centroid.x == 0 && mass.centroid.y == 0);
    const long double size = sqrtl(expected.area) + hypotl(expected.x, expected.y);
    assert_within(info.offset.x, expected.x, tolerance * size);
    assert_within(info.offset.y, expected.y, tolerance * size);
    dem2d_shape_destroy(shape);
}

/* --- templates ---------------------------------------------------------------------------------
 */

static void circles_and_ellipses(void **state) {
    (void)state;
    dem2d_shape *shape;
    for (int i = 0; i < 50; i++) {
        const double a = ldexp(1 + i / 50.0, i - 25), b = a * (0.01 + i);
        assert_ok(dem2d_shape_create_circle(NULL, a, &shape));
        const long double disc = TEST_PI * a * a, oval = TEST_PI * a * b;
        check_shape(shape, (moments){disc, 0, 0, disc * a * a / 2}, 2e-15L);
        assert_ok(dem2d_shape_create_ellipse(NULL, a, b, &shape));
        const long double squares = (long double)a * a + (long double)b * b;
        check_shape(shape, (moments){oval, 0, 0, oval * squares / 4}, 2e-15L);
    }
}

static void triangles_and_rectangles(void **state) {
    (void)state;
    uint64_t random = 17;
    for (int i = 0; i < 200; i++) {
        const double w = random_between(&random, 0.1, 2), h = random_between(&random, 0.1, 2);
        const double apex = random_between(&random, -1, 2), x = random_between(&random, -3, 3);
        dem2d_vec p[4] = {{x, 5}, {x + w, 5}, {x + apex, 5 + h}};
        dem2d_shape *shape;
        assert_ok(dem2d_shape_create_polygon(NULL, p, 3, 0, &shape));
        long double squares = 0, area = 0; /* of the sides of the rounded input */
        for (int k = 0; k < 3; k++) {
            const dem2d_vec a = p[k], b = p[(k + 1) % 3];
            const long double dx = (long double)b.x - a.x, dy = (long double)b.y - a.y;
            squares += dx * dx + dy * dy;
        }
        area = ((long double)p[1].x - p[0].x) * ((long double)p[2].y - p[0].y) / 2;
        check_shape(shape,
                    (moments){area, ((long double)p[0].x + p[1].x + p[2].x) / 3,
                              ((long double)p[0].y + p[1].y + p[2].y) / 3, area * squares / 36},
                    1e-14L);
        p[2] = vec(p[1].x, p[2].y), p[3] = vec(p[0].x, p[2].y);
        assert_ok(dem2d_shape_create_polygon(NULL, p, 4, 0, &shape));
        const long double a = (long double)p[1].x - p[0].x, b = (long double)p[2].y - p[1].y;
        check_shape(shape,
                    (moments){a * b, p[0].x + a / 2, p[0].y + b / 2, a * b * (a * a + b * b) / 12},
                    1e-14L);
    }
}

/* w x h grown by r: the core, four side strips, four quarter discs (first moment r^3/3 about each
   straight edge, polar moment pi r^4/8 about the corner). */
static moments rounded_rectangle(long double w, long double h, long double r) {
    const long double quarter = TEST_PI * r * r / 4;
    const long double area = w * h + 2 * r * (w + h) + 4 * quarter;
    const long double sides = w * r * (w * w + r * r) / 6 + 2 * w * r * (h + r) * (h + r) / 4 +
                              h * r * (h * h + r * r) / 6 + 2 * h * r * (w + r) * (w + r) / 4;
    const long double corners =
        4 * (TEST_PI * r * r * r * r / 8 + quarter * (w * w + h * h) / 4 + (w + h) * r * r * r / 3);
    return (moments){area, 0, 0, w * h * (w * w + h * h) / 12 + sides + corners};
}

static void rounded_polygons(void **state) {
    (void)state;
    static const double radii[] = {1e-9, 0.01, 0.5, 1, 30, 1e6};
    static const dem2d_vec scalene[] = {{1, 1}, {5, 1.5}, {2, 4}};
    static const dem2d_vec pentagon[] = {{0, 0}, {4, -1}, {6, 2}, {3, 5}, {-1, 3}};
    for (int i = 0; i < COUNT_OF(radii); i++) {
        const dem2d_vec box[] = {{-1.5, -1}, {1.5, -1}, {1.5, 1}, {-1.5, 1}};
        dem2d_shape *shape;
        assert_ok(dem2d_shape_create_polygon(NULL, box, 4, radii[i], &shape));
        check_shape(shape, rounded_rectangle(3, 2, radii[i]), 1e-14L);
        curve c = {rounded_at, scalene, NULL, NULL, 6, radii[i], 0};
        assert_ok(dem2d_shape_create_polygon(NULL, scalene, 3, radii[i], &shape));
        check_shape(shape, true_moments(&c), 2e-14L);
        c.points = pentagon, c.pieces = 10;
        assert_ok(dem2d_shape_create_polygon(NULL, pentagon, 5, radii[i], &shape));
        check_shape(shape, true_moments(&c), 2e-14L);
    }
}

/* Four quarters with the usual handle: area 2.800e-4 too large, radius up to 2.725e-4. */
static void bezier_circle(void **state) {
    (void)state;
    const dem2d_vec control[] = {{1, 0},       {1, KAPPA},  {KAPPA, 1},  {0, 1},
                                 {-KAPPA, 1},  {-1, KAPPA}, {-1, 0},     {-1, -KAPPA},
                                 {-KAPPA, -1}, {0, -1},     {KAPPA, -1}, {1, -KAPPA}};
    dem2d_shape *shape;
    assert_ok(dem2d_shape_create_bezier(NULL, control, 4, &shape));
    dem2d_shape_info info;
    assert_ok(dem2d_shape_get(shape, &info));
    assert_within(info.mass.area / TEST_PI - 1, 2.80010526575564e-4L, 1e-15L);
    double most = 0;
    for (int i = 0; i < 2000; i++) {
        dem2d_support support;
        assert_ok(dem2d_shape_support(shape, still(), direction(0.00314159 * i), &support));
        most = fmax(most, hypot(support.point.x, support.point.y));
    }
    /* between two of the directions the greatest radius is missed by far less than 1e-8 */
    assert_within(most - 1, 2.72529994e-4L, 1e-8L);
    assert_between(info.circumscribed, most, 1.001L);
    const curve c = {bezier_at, control, NULL, NULL, 4, 0, 0};
    check_shape(shape, true_moments(&c), 1e-14L);
}

/* Chains through the middles of a polygon's edges, shifted. */
static void beziers(void **state) {
    (void)state;
    static const dem2d_vec corners[] = {{0, 0}, {4, -1}, {6, 2}, {3, 5}, {-1, 3}};
    for (int i = 1; i <= 10; i++) {
        const double part = i / 10.0, shift = 7.0 * (i % 3);
        dem2d_vec control[15];
        for (int k = 0; k < 5; k++) {
            const dem2d_vec a = corners[k], b = corners[(k + 1) % 5], c = corners[(k + 2) % 5];
            const dem2d_vec from = {(a.x + b.x) / 2 + shift, (a.y + b.y) / 2};
            const dem2d_vec to = {(c.x + b.x) / 2 + shift, (c.y + b.y) / 2};
            control[3 * k] = from;
            control[3 * k + 1].x = from.x + part * (b.x + shift - from.x);
            control[3 * k + 1].y = from.y + part * (b.y - from.y);
            control[3 * k + 2].x = to.x + part * (b.x + shift - to.x);
            control[3 * k + 2].y = to.y + part * (b.y - to.y);
        }
        dem2d_shape *shape;
        const curve c = {bezier_at, control, NULL, NULL, 5, 0, 0};
        assert_ok(dem2d_shape_create_bezier(NULL, control, 5, &shape));
        check_shape(shape, true_moments(&c), 5e-14L);
    }
}

/* A random series of this order, convex by the sufficient test, about (cx, cy). */
static void random_series(uint64_t *random, int order, double *a, double *b) {
    double sum = 0;
    for (int n = 1; n <= order; n++) {
        const double size = n == 1 ? 1 : 1.0 / (n * n * n);
        a[n] = size * random_between(random, -1, 1), b[n] = size * random_between(random, -1, 1);
        if (n > 1) sum += (n * n - 1) * hypot(a[n], b[n]);
    }
    a[0] = 2 * (1.1 * sum + 0.1), b[0] = 0;
}

static void series(void **state) {
    (void)state;
    static const int orders[] = {0, 1, 2, 3, 5, 8, 16, 64};
    uint64_t random = 23;
    for (int i = 0; i < 3 * COUNT_OF(orders); i++) {
        const int order = orders[i / 3];
        double a[65], b[65];
        random_series(&random, order, a, b);
        dem2d_shape *shape;
        assert_ok(dem2d_shape_create_fourier(NULL, a, b, order, &shape));
        long double area = TEST_PI * a[0] * a[0] / 4;
        for (int n = 2; n <= order; n++)
            area +=
                TEST_PI / 2 * (1 - n * n) * ((long double)a[n] * a[n] + (long double)b[n] * b[n]);
        dem2d_mass mass;
        assert_ok(dem2d_shape_mass(shape, &mass));
        assert_near(mass.area, area, 1e-14L);
        /* Cauchy: the perimeter is pi a0. Chords are short by at most (pi / n)^2 / 6 and some. */
        dem2d_vec p[2000];
        long double perimeter = 0;
        assert_ok(dem2d_shape_outline(shape, still(), 2000, p));
        for (int k = 0; k < 2000; k++)
            perimeter += hypotl((long double)p[k].x - p[(k + 1) % 2000].x,
                                (long double)p[k].y - p[(k + 1) % 2000].y);
        assert_between(perimeter, TEST_PI * a[0] * (1 - 2e-6L), TEST_PI * a[0] * (1 + 1e-15L));
        const curve c = {series_at, NULL, a, b, 1, 0, order};
        if (order <= 16)
            check_shape(shape, true_moments(&c), 5e-14L);
        else
            dem2d_shape_destroy(shape);
    }
}

static dem2d_vec disc_callback(void *user, dem2d_vec u, double *rho) {
    const double *disc = user; /* radius, centre */
    if (rho) *rho = disc[0];
    return vec(disc[1] + disc[0] * u.x, disc[2] + disc[0] * u.y);
}

/* From outline points: the regular polygon's closed form, area n/2 sin(2 pi / n) R^2 and polar
   moment area R^2 (2 + cos(2 pi / n)) / 6. Given: taken as it is. */
static void customs(void **state) {
    (void)state;
    static double disc[3] = {2, 3, -4};
    static const int counts[] = {0, 3, 10, 500, 100000};
    for (int i = 0; i < COUNT_OF(counts); i++) {
        const int n = counts[i] ? counts[i] : 1000;
        dem2d_custom_desc desc = {0};
        desc.support = disc_callback, desc.user = disc, desc.outline_points = counts[i];
        dem2d_shape *shape;
        assert_ok(dem2d_shape_create_custom(NULL, &desc, &shape));
        const long double angle = 2 * TEST_PI / n, area = n * 2 * sinl(angle);
        /* a hundred thousand terms, each with a few eps */
        check_shape(shape, (moments){area, 3, -4, area * 4 * (2 + cosl(angle)) / 6}, 1e-12L);
    }
    dem2d_custom_desc desc = {0};
    desc.support = disc_callback, desc.user = disc;
    desc.mass.area = 12, desc.mass.centroid = vec(3, -4), desc.mass.polar_moment = 25;
    dem2d_shape *shape;
    assert_ok(dem2d_shape_create_custom(NULL, &desc, &shape));
    dem2d_support support;
    assert_ok(dem2d_shape_support(shape, still(), vec(0, 1), &support));
    assert_within(support.value, 2, 1e-15L * 6);
    check_shape(shape, (moments){12, 3, -4, 25}, 1e-16L);
}

/* Moving the input moves the offset and nothing else. */
static void moving_the_input(void **state) {
    (void)state;
    static const double moves[][2] = {{0.3, -0.7}, {12.5, 40}, {-1e3, 1e3}};
    uint64_t random = 29;
    double a[9], b[9];
    random_series(&random, 8, a, b);
    const dem2d_vec corners[] = {{0, 0}, {4, -1}, {6, 2}, {3, 5}, {-1, 3}};
    for (int i = 0; i < COUNT_OF(moves); i++) {
        dem2d_shape *here[2], *there[2];
        dem2d_vec moved[5];
        for (int k = 0; k < 5; k++)
            moved[k] = vec(corners[k].x + moves[i][0], corners[k].y + moves[i][1]);
        assert_ok(dem2d_shape_create_fourier(NULL, a, b, 8, &here[0]));
        assert_ok(dem2d_shape_create_polygon(NULL, corners, 5, 0.5, &here[1]));
        const double a1 = a[1], b1 = b[1];
        a[1] += moves[i][0], b[1] += moves[i][1];
        assert_ok(dem2d_shape_create_fourier(NULL, a, b, 8, &there[0]));
        assert_ok(dem2d_shape_create_polygon(NULL, moved, 5, 0.5, &there[1]));
        a[1] = a1, b[1] = b1;
        for (int k = 0; k < 2; k++) {
            dem2d_shape_info p, q;
            assert_ok(dem2d_shape_get(here[k], &p));
            assert_ok(dem2d_shape_get(there[k], &q));
            /* the moved input is rounded at the size of the move, and no more is lost */
            const long double allowed = 4e-15L * (1 + fabsl(moves[i][0]) + fabsl(moves[i][1]));
            assert_near(q.mass.area, p.mass.area, allowed);
            assert_near(q.mass.polar_moment, p.mass.polar_moment, allowed);
            assert_within(q.offset.x - moves[i][0], p.offset.x, 4 * allowed);
            assert_within(q.offset.y - moves[i][1], p.offset.y, 4 * allowed);
            dem2d_shape_destroy(here[k]);
            dem2d_shape_destroy(there[k]);
        }
    }
}

/* --- interpolation ------------------------------------------------------------------------------
 */

/* For outlines by uniform directions the error falls as 1/n^2: a hundred times from 100 to 1000
   points. For a nearly round shape it is that of a regular polygon, (2 pi / n)^2 / 6 in area and
   twice that in the polar moment. */
static void interpolation_converges(void **state) {
    (void)state;
    const double a[9] = {4, 0, .05, .02, .01, 0, .002, 0, .001};
    const double b[9] = {0, 0, .02, -.01, 0, .003, 0, .001, 0};
    dem2d_shape *shapes[3];
    const dem2d_vec control[] = {{2, 0},           {2, KAPPA},  {2 * KAPPA, 1},  {0, 1},
                                 {-2 * KAPPA, 1},  {-2, KAPPA}, {-2, 0},         {-2, -KAPPA},
                                 {-2 * KAPPA, -1}, {0, -1},     {2 * KAPPA, -1}, {2, -KAPPA}};
    assert_ok(dem2d_shape_create_fourier(NULL, a, b, 8, &shapes[0]));
    assert_ok(dem2d_shape_create_ellipse(NULL, 2, 1, &shapes[1]));
    assert_ok(dem2d_shape_create_bezier(NULL, control, 4, &shapes[2]));
    for (int i = 0; i < 3; i++) {
        dem2d_mass exact, coarse, fine;
        assert_ok(dem2d_shape_mass(shapes[i], &exact));
        assert_ok(dem2d_shape_mass_interpolated(shapes[i], 100, &coarse));
        assert_ok(dem2d_shape_mass_interpolated(shapes[i], 1000, &fine));
        const double area = 1 - coarse.area / exact.area;
        const double polar = 1 - coarse.polar_moment / exact.polar_moment;
        print_message("shape %d: error at 100 points %.3g in area, %.3g in polar moment\n", i, area,
                      polar);
        assert_between(area / (1 - fine.area / exact.area), 97, 103);
        assert_between(polar / (1 - fine.polar_moment / exact.polar_moment), 97, 103);
        assert_between(area, 6e-4L, i ? 2e-3L : 7.2e-4L);
        assert_between(polar, 1.2e-3L, i ? 5e-3L : 1.45e-3L);
        assert_within(hypot(fine.centroid.x, fine.centroid.y), 0, 1e-4L);
        assert_result(dem2d_shape_mass_interpolated(shapes[i], 2, &fine), DEM2D_TOO_FEW_POINTS);
        assert_result(dem2d_shape_mass_interpolated(shapes[i], -1, &fine), DEM2D_TOO_FEW_POINTS);
        assert_result(dem2d_shape_mass_interpolated(shapes[i], 3, NULL), DEM2D_NULL_ARGUMENT);
        assert_result(dem2d_shape_mass(shapes[i], NULL), DEM2D_NULL_ARGUMENT);
        dem2d_shape_destroy(shapes[i]);
    }
    dem2d_mass mass;
    assert_result(dem2d_shape_mass(NULL, &mass), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_mass_interpolated(NULL, 3, &mass), DEM2D_NULL_ARGUMENT);
}

/* The same numbers as the polygon through the shape's own outline. */
static void interpolation_is_the_outline(void **state) {
    (void)state;
    const dem2d_vec corners[] = {{0, 0}, {4, -1}, {6, 2}, {3, 5}, {-1, 3}};
    static const int counts[] = {3, 4, 17, 100, 999};
    for (int i = 0; i < 2 * COUNT_OF(counts); i++) {
        const int n = counts[i / 2];
        dem2d_shape *shape;
        static dem2d_vec p[999];
        dem2d_mass a, b;
        assert_ok(dem2d_shape_create_polygon(NULL, corners, 5, i % 2 ? 0.5 : 0, &shape));
        assert_ok(dem2d_shape_outline(shape, still(), n, p));
        assert_ok(dem2d_polygon_mass(p, n, &a));
        assert_ok(dem2d_shape_mass_interpolated(shape, n, &b));
        assert_near(b.area, a.area, 1e-13L);
        assert_near(b.polar_moment, a.polar_moment, 1e-13L);
        assert_within(b.centroid.x, a.centroid.x, 1e-13L * 6);
        assert_within(b.centroid.y, a.centroid.y, 1e-13L * 6);
        dem2d_shape_destroy(shape);
    }
}

/* --- polygons ------------------------------------------------------------------------------------
 */

static void check_polygon(const dem2d_vec *p, int n, moments expected) {
    for (int turned = 0; turned < 2; turned++) {
        dem2d_vec q[16];
        dem2d_mass mass;
        for (int k = 0; k < n; k++) q[k] = p[turned ? n - 1 - k : k];
        assert_ok(dem2d_polygon_mass(q, n, &mass));
        assert_near(mass.area, expected.area, 4e-15L);
        assert_near(mass.polar_moment, expected.polar, 1e-14L);
        const long double size = sqrtl(expected.area) + hypotl(expected.x, expected.y);
        assert_within(mass.centroid.x, expected.x, 1e-15L * size);
        assert_within(mass.centroid.y, expected.y, 1e-15L * size);
    }
}

/* An L of three unit squares: area 3, centroid (5/6, 5/6), and by the parallel axes 3/6 + 1 (the
   squares' centres are sqrt(2)/3, sqrt(5)/3 and sqrt(5)/3 away). */
static void simple_polygons(void **state) {
    (void)state;
    static const dem2d_vec shape[] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
    static const double moves[] = {0, 1, -300, 0x1p20, 0x1p40};
    const long double polar = 3 / 6.0L + 2 / 9.0L + 5 / 9.0L + 5 / 9.0L;
    for (int i = 0; i < COUNT_OF(moves); i++) {
        dem2d_vec p[6];
        for (int k = 0; k < 6; k++) p[k] = vec(shape[k].x + moves[i], shape[k].y - moves[i]);
        /* the moved corners are exact, so nothing may be lost far from the origin */
        check_polygon(p, 6, (moments){3, 5 / 6.0L + moves[i], 5 / 6.0L - moves[i], polar});
    }
}

static void bad_polygons(void **state) {
    (void)state;
    const dem2d_vec ok[3] = {{0, 0}, {1, 0}, {0, 1}}, nan[3] = {{0, 0}, {1, NAN}, {0, 1}};
    const dem2d_vec infinite[3] = {{0, 0}, {1, 0}, {0, HUGE_VAL}};
    const dem2d_vec line[3] = {{0, 0}, {1, 1}, {3, 3}}, dot[3] = {{2, 2}, {2, 2}, {2, 2}};
    dem2d_mass mass, before;
    memset(&mass, 0x5a, sizeof mass), before = mass;
    assert_result(dem2d_polygon_mass(NULL, 3, &mass), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_polygon_mass(ok, 3, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_polygon_mass(ok, 2, &mass), DEM2D_TOO_FEW_POINTS);
    assert_result(dem2d_polygon_mass(ok, -3, &mass), DEM2D_TOO_FEW_POINTS);
    assert_result(dem2d_polygon_mass(nan, 3, &mass), DEM2D_NOT_FINITE);
    assert_result(dem2d_polygon_mass(infinite, 3, &mass), DEM2D_NOT_FINITE);
    assert_result(dem2d_polygon_mass(line, 3, &mass), DEM2D_ZERO_AREA);
    assert_result(dem2d_polygon_mass(dot, 3, &mass), DEM2D_ZERO_AREA);
    assert_memory_equal(&mass, &before, sizeof mass);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(circles_and_ellipses),
        cmocka_unit_test(triangles_and_rectangles),
        cmocka_unit_test(rounded_polygons),
        cmocka_unit_test(bezier_circle),
        cmocka_unit_test(beziers),
        cmocka_unit_test(series),
        cmocka_unit_test(customs),
        cmocka_unit_test(moving_the_input),
        cmocka_unit_test(interpolation_converges),
        cmocka_unit_test(interpolation_is_the_outline),
        cmocka_unit_test(simple_polygons),
        cmocka_unit_test(bad_polygons),
    };
    return cmocka_run_group_tests_name("mass", tests, NULL, NULL);
}
