/* Contacts of two shapes, and of a shape and a wall, against oracles that share no code with them:
   inverse construction (choose normal and depth, then place B), a search in long double built on
   the shapes' formulas, closed forms, integer Minkowski sums, and what must not change when the
   same pair is swapped, turned, scaled or moved. */
#include "dem2d.h"
#include "testing.h"

#include <float.h>

/* Depths come from sums of a few products of the size R_A + R_B + |d|: some roundings of it. */
#define ROUNDING (64 * DBL_EPSILON)
/* The library's default for dem2d_contact_desc.tolerance. */
#define TOLERANCE 1e-10

typedef long double real;

/* --- one shape of each kind, and its support function in long double ------------------------- */

enum { CIRCLE, ELLIPSE, POLYGON, ROUNDED, BEZIER, FOURIER, CUSTOM, KINDS };

typedef struct sample {
    dem2d_shape *shape;
    dem2d_shape_info info;
} sample;

static sample samples[KINDS];
/* Lower bounds of the radius of curvature, by hand; the polybezier's least is 0.5195. */
static const double rho_bound[KINDS] = {0.8, 0.3, 0, 0.25, 0.51, 0.9 - 3 * 0.1 - 8 * 0.05, 0.644};

static const dem2d_vec corners[5] = {
    {-0.9, -0.6}, {0.7, -0.8}, {1.1, 0.1}, {0.4, 0.9}, {-0.6, 0.7}};
static const dem2d_vec triangle[3] = {{-0.5, -0.4}, {0.8, -0.3}, {0.1, 0.7}};
/* Four arcs with a common tangent at each joint: half ellipses with axes 1.1 and 0.7, height 0.75,
   and the handle length of a circle. */
#define HANDLE 0.5522847498
static const dem2d_vec egg[12] = {{1.1, 0},   {1.1, HANDLE * 0.75},   {HANDLE * 1.1, 0.75},
                                  {0, 0.75},  {HANDLE * -0.7, 0.75},  {-0.7, HANDLE * 0.75},
                                  {-0.7, 0},  {-0.7, HANDLE * -0.75}, {HANDLE * -0.7, -0.75},
                                  {0, -0.75}, {HANDLE * 1.1, -0.75},  {1.1, HANDLE * -0.75}};
static const double fourier_a[4] = {1.8, 0.2, 0.06, 0.03};
static const double fourier_b[4] = {0, -0.1, 0.08, 0.04};

/* Ellipse with half axes 0.9 and 0.7, grown by 0.1. */
static dem2d_vec grown_ellipse(void *user, dem2d_vec u, double *rho) {
    (void)user;
    const double h = sqrt(0.81 * u.x * u.x + 0.49 * u.y * u.y);
    if (rho) *rho = 0.81 * 0.49 / (h * h * h) + 0.1;
    return vec((0.81 / h + 0.1) * u.x, (0.49 / h + 0.1) * u.y);
}

static dem2d_vec round_custom(void *user, dem2d_vec u, double *rho) {
    const double radius = *(const double *)user;
    if (rho) *rho = radius;
    return vec(radius * u.x, radius * u.y);
}

static int create_samples(void **state) {
    (void)state;
    dem2d_custom_desc custom = {0};
    custom.support = grown_ellipse;
    assert_ok(dem2d_shape_create_circle(NULL, 0.8, &samples[CIRCLE].shape));
    assert_ok(dem2d_shape_create_ellipse(NULL, 1.2, 0.6, &samples[ELLIPSE].shape));
    assert_ok(dem2d_shape_create_polygon(NULL, corners, 5, 0, &samples[POLYGON].shape));
    assert_ok(dem2d_shape_create_polygon(NULL, triangle, 3, 0.25, &samples[ROUNDED].shape));
    assert_ok(dem2d_shape_create_bezier(NULL, egg, 4, &samples[BEZIER].shape));
    assert_ok(dem2d_shape_create_fourier(NULL, fourier_a, fourier_b, 3, &samples[FOURIER].shape));
    assert_ok(dem2d_shape_create_custom(NULL, &custom, &samples[CUSTOM].shape));
    for (int i = 0; i < KINDS; i++) assert_ok(dem2d_shape_get(samples[i].shape, &samples[i].info));
    return 0;
}

static int destroy_samples(void **state) {
    (void)state;
    for (int i = 0; i < KINDS; i++) dem2d_shape_destroy(samples[i].shape);
    return 0;
}

static real ellipse_value(real a, real b, real x, real y) {
    return sqrtl(a * a * x * x + b * b * y * y);
}

static real polygon_value(const dem2d_vec *points, int count, real x, real y) {
    real best = -HUGE_VALL;
    for (int i = 0; i < count; i++) best = fmaxl(best, points[i].x * x + points[i].y * y);
    return best;
}

/* Both roots of the arc's derivative along the direction, and the ends. */
static real arc_value(const dem2d_vec *q0, const dem2d_vec *q1, const dem2d_vec *q2,
                      const dem2d_vec *q3, real x, real y) {
    const real p[4] = {q0->x * x + q0->y * y, q1->x * x + q1->y * y, q2->x * x + q2->y * y,
                       q3->x * x + q3->y * y};
    const real c = p[1] - p[0], b = p[2] - 2 * p[1] + p[0];
    const real a = p[3] - 3 * p[2] + 3 * p[1] - p[0], root = b * b - a * c;
    real best = fmaxl(p[0], p[3]);
    if (root < 0) return best;
    const real sum = -b - copysignl(sqrtl(root), b), ts[2] = {sum / a, c / sum};
    for (int i = 0; i < 2; i++) {
        const real t = ts[i], s = 1 - t;
        if (!(t > 0 && t < 1)) continue;
        best = fmaxl(best, s * s * s * p[0] + 3 * s * s * t * p[1] + 3 * s * t * t * p[2] +
                               t * t * t * p[3]);
    }
    return best;
}

/* Support value of a template in its own coordinates, before it was moved to its centroid. */
static real data_value(int kind, real x, real y) {
    real best = -HUGE_VALL;
    switch (kind) {
    case CIRCLE:
        return 0.8L * hypotl(x, y);
    case ELLIPSE:
        return ellipse_value(1.2, 0.6, x, y);
    case POLYGON:
        return polygon_value(corners, 5, x, y);
    case ROUNDED:
        return polygon_value(triangle, 3, x, y) + 0.25L;
    case BEZIER:
        for (int i = 0; i < 4; i++)
            best = fmaxl(best, arc_value(&egg[3 * i], &egg[3 * i + 1], &egg[3 * i + 2],
                                         &egg[(3 * i + 3) % 12], x, y));
        return best;
    case FOURIER:
        best = fourier_a[0] / 2;
        for (int n = 1; n <= 3; n++)
            best += fourier_a[n] * cosl(n * atan2l(y, x)) + fourier_b[n] * sinl(n * atan2l(y, x));
        return best;
    default:
        return ellipse_value(0.9, 0.7, x, y) + 0.1L;
    }
}

/* --- a pair, its support value, and a search for the least one ------------------------------- */

typedef struct pair {
    int a, b; /* kinds */
    dem2d_pose pose_a, pose_b;
} pair;

static real posed_value(int kind, const dem2d_pose *pose, real x, real y) {
    const real c = pose->rotation.c, s = pose->rotation.s;
    const real lx = c * x + s * y, ly = c * y - s * x;
    const dem2d_vec offset = samples[kind].info.offset;
    return pose->scale * (data_value(kind, lx, ly) - offset.x * lx - offset.y * ly);
}

/* h_A(u) + h_B(-u) - d.u */
static real pair_value(const pair *p, real x, real y) {
    const real dx = (real)p->pose_b.position.x - p->pose_a.position.x;
    const real dy = (real)p->pose_b.position.y - p->pose_a.position.y;
    return posed_value(p->a, &p->pose_a, x, y) + posed_value(p->b, &p->pose_b, -x, -y) - dx * x -
           dy * y;
}

static double pair_size(const pair *p) {
    const double dx = p->pose_b.position.x - p->pose_a.position.x;
    const double dy = p->pose_b.position.y - p->pose_a.position.y;
    return p->pose_a.scale * samples[p->a].info.circumscribed +
           p->pose_b.scale * samples[p->b].info.circumscribed + hypot(dx, dy);
}

static real golden_section(const pair *p, real low, real high) {
    const real ratio = 0.618033988749894848204586834L;
    real t0 = high - ratio * (high - low), t1 = low + ratio * (high - low);
    real f0 = pair_value(p, cosl(t0), sinl(t0)), f1 = pair_value(p, cosl(t1), sinl(t1));
    for (int i = 0; i < 90; i++) { /* 0.618^90 = 2e-19: all of a long double */
        if (f0 < f1) {
            high = t1, t1 = t0, f1 = f0, t0 = high - ratio * (high - low);
            f0 = pair_value(p, cosl(t0), sinl(t0));
        } else {
            low = t0, t0 = t1, f0 = f1, t1 = low + ratio * (high - low);
            f1 = pair_value(p, cosl(t1), sinl(t1));
        }
    }
    return fminl(f0, f1);
}

/* Depth by trying directions all round, then refining each dip that could be the least: h changes
   by no more than the size of the pair per radian. */
static real scan(const pair *p) {
    enum { DIRECTIONS = 4000 };
    static real values[DIRECTIONS];
    const real step = 2 * TEST_PI / DIRECTIONS, slope = pair_size(p);
    real least = HUGE_VALL;
    for (int i = 0; i < DIRECTIONS; i++) {
        values[i] = pair_value(p, cosl(i * step), sinl(i * step));
        least = fminl(least, values[i]);
    }
    real best = least;
    for (int i = 0; i < DIRECTIONS; i++) {
        const real before = values[(i + DIRECTIONS - 1) % DIRECTIONS];
        const real after = values[(i + 1) % DIRECTIONS];
        if (values[i] > before || values[i] > after || values[i] > least + slope * step) continue;
        best = fminl(best, golden_section(p, (i - 1) * step, (i + 1) * step));
    }
    return best;
}

/* --- what holds for every answer ------------------------------------------------------------- */

/* A witness lies in its shape and reaches the support value along the normal. */
static void check_witness(int kind, const dem2d_pose *pose, dem2d_vec point, real nx, real ny,
                          double slack) {
    const real x = (real)point.x - pose->position.x, y = (real)point.y - pose->position.y;
    assert_between(x * nx + y * ny, posed_value(kind, pose, nx, ny) - slack, HUGE_VALL);
    for (int i = 0; i < 8; i++) {
        const real c = cosl(i * TEST_PI / 4), s = sinl(i * TEST_PI / 4);
        assert_between(x * c + y * s, -HUGE_VALL, posed_value(kind, pose, c, s) + slack);
    }
}

static void check_bounds(const pair *p, const dem2d_contact *c, real truth) {
    const double slack = ROUNDING * pair_size(p);
    assert_true(c->error >= 0);
    assert_between(truth, (real)c->depth - c->error - slack, (real)c->depth + slack);
    assert_true(c->state == DEM2D_SEPARATED || c->state == DEM2D_TOUCHING ||
                c->state == DEM2D_PENETRATING || c->state == DEM2D_UNRESOLVED);
    if (c->state == DEM2D_SEPARATED) assert_true(truth <= slack);
    if (c->state == DEM2D_PENETRATING) assert_true(truth >= -slack);
    if (c->state == DEM2D_TOUCHING) /* not told from a touch */
        assert_true(fabsl(truth) <= c->error + 4 * slack);
}

/* Second derivative of the support value along the normal that was found: rho - h. */
static double bend(const pair *p, const dem2d_contact *c) {
    const dem2d_vec n = c->normal;
    dem2d_support a, b;
    assert_ok(dem2d_shape_support(samples[p->a].shape, p->pose_a, n, &a));
    assert_ok(dem2d_shape_support(samples[p->b].shape, p->pose_b, vec(-n.x, -n.y), &b));
    return a.rho + b.rho - c->depth;
}

/* Where h hardly bends (a disc deep in another) all its chords fall short of it alike: EPA needs
   about sqrt(1 / tolerance) of them, and may stop at its cap with the bounds it has. */
#define FLAT 0.1 /* of the size; the number of chords goes as 1 / sqrt(FLAT) */

static void check_resolved(const pair *p, const dem2d_contact *c) {
    const double size = pair_size(p);
    if (c->state == DEM2D_UNRESOLVED) {
        assert_true(c->depth > 0);
        assert_between(fabs(bend(p, c)), 0, FLAT * size);
    } else
        assert_between(c->error, 0, (TOLERANCE + ROUNDING) * size);
}

static void check_converged(const pair *p, const dem2d_contact *c) {
    const double size = pair_size(p), slack = c->error + ROUNDING * size;
    const real nx = c->normal.x, ny = c->normal.y;
    check_resolved(p, c);
    assert_within(hypotl(nx, ny), 1, 8 * DBL_EPSILON);
    assert_within(pair_value(p, nx, ny), c->depth, slack);
    assert_within((c->point_a.x - (real)c->point_b.x) * nx +
                      (c->point_a.y - (real)c->point_b.y) * ny,
                  c->depth, slack + c->error); /* of the direction before the last step, perhaps */
    assert_within(c->point.x, (c->point_a.x + (real)c->point_b.x) / 2, ROUNDING * size);
    assert_within(c->point.y, (c->point_a.y + (real)c->point_b.y) / 2, ROUNDING * size);
    check_witness(p->a, &p->pose_a, c->point_a, nx, ny, slack);
    check_witness(p->b, &p->pose_b, c->point_b, -nx, -ny, slack);
}

static dem2d_contact ask(const pair *p, const dem2d_contact_desc *desc) {
    dem2d_contact c;
    assert_ok(dem2d_pair_contact(samples[p->a].shape, p->pose_a, samples[p->b].shape, p->pose_b,
                                 desc, &c));
    return c;
}

/* All three questions about a pair whose depth is known. */
static dem2d_contact check_pair(const pair *p, const dem2d_contact_desc *desc, real truth) {
    const dem2d_contact contact = ask(p, desc);
    dem2d_contact other;
    check_converged(p, &contact);
    check_bounds(p, &contact, truth);
    assert_ok(dem2d_pair_overlap(samples[p->a].shape, p->pose_a, samples[p->b].shape, p->pose_b,
                                 desc, &other));
    check_bounds(p, &other, truth);
    assert_int_not_equal(other.state, DEM2D_UNRESOLVED); /* yes or no can always be said */
    assert_true(other.support_calls >= 1);
    assert_ok(dem2d_pair_distance(samples[p->a].shape, p->pose_a, samples[p->b].shape, p->pose_b,
                                  desc, &other));
    check_bounds(p, &other, truth);
    if (other.state == DEM2D_SEPARATED) check_converged(p, &other);
    return contact;
}

/* Numbers are drawn one by one: C leaves the order of arguments to the compiler. */
static dem2d_vec random_vec(uint64_t *random, double reach) {
    const double x = random_between(random, -reach, reach);
    return vec(x, random_between(random, -reach, reach));
}

static dem2d_pose random_pose(uint64_t *random, double reach) {
    const dem2d_vec at = random_vec(random, reach);
    const double angle = random_between(random, -4, 4);
    return dem2d_pose_make(at.x, at.y, angle, random_between(random, 0.5, 2));
}

static pair random_pair(uint64_t *random, int a, int b) {
    const dem2d_pose pose_a = random_pose(random, 1);
    return (pair){a, b, pose_a, random_pose(random, 1)};
}

/* Places B so that the pair's support value along u is delta, with slope zero. */
static void place(pair *p, dem2d_vec u, double delta) {
    dem2d_pose pose_a = p->pose_a, pose_b = p->pose_b;
    dem2d_support a, b;
    pose_a.position = pose_b.position = vec(0, 0);
    assert_ok(dem2d_shape_support(samples[p->a].shape, pose_a, u, &a));
    assert_ok(dem2d_shape_support(samples[p->b].shape, pose_b, vec(-u.x, -u.y), &b));
    p->pose_b.position.x = p->pose_a.position.x + (a.point.x - b.point.x - delta * u.x);
    p->pose_b.position.y = p->pose_a.position.y + (a.point.y - b.point.y - delta * u.y);
}

/* Depths below this are decided by a zero slope alone (METHODS: h'(u) = 0 and h(u) < least rho). */
static double certified(const pair *p) {
    return p->pose_a.scale * rho_bound[p->a] + p->pose_b.scale * rho_bound[p->b];
}

/* With r the least radius of curvature, h(u') >= delta + (r - delta)(1 - u.u'). */
static void check_normal(const pair *p, const dem2d_contact *c, dem2d_vec u, double delta) {
    const double spare = certified(p) - delta;
    if (spare <= 0) return;
    const double square = 2 * (c->error + 2 * ROUNDING * pair_size(p)) / spare;
    assert_between(hypot(c->normal.x - u.x, c->normal.y - u.y), 0, sqrt(square));
}

/* --- inverse construction -------------------------------------------------------------------- */

static void test_chosen_depths(void **state) {
    (void)state;
    static const double gaps[] = {-3, -0.3, -1e-3, -1e-6, -1e-9};  /* of the size */
    static const double overlaps[] = {1e-9, 1e-6, 1e-3, 0.3, 0.9}; /* of the certified depth */
    uint64_t random = 1;
    for (int i = 0; i < KINDS * KINDS * 8; i++) {
        const int a = i % KINDS, b = i / KINDS % KINDS;
        for (int k = 0; k < 2 * COUNT_OF(gaps); k++) {
            pair p = random_pair(&random, a, b);
            const dem2d_vec u = direction(random_between(&random, -3.2, 3.2));
            const double r = certified(&p), size = p.pose_a.scale + p.pose_b.scale;
            const double delta =
                k < COUNT_OF(gaps) ? gaps[k] * size : overlaps[k - COUNT_OF(gaps)] * r;
            if (delta == 0) continue; /* two sharp polygons: no depth is certified */
            place(&p, u, delta);
            const dem2d_contact c = check_pair(&p, NULL, delta);
            check_normal(&p, &c, u, delta);
        }
    }
}

/* Exact touch and its neighbourhood: the sign of the answer follows the sign of the depth. */
static void test_touch(void **state) {
    (void)state;
    static const double sweep[] = {-1e-12,      -1e-13, -1e-14, -1e-15, -DBL_EPSILON, 0,
                                   DBL_EPSILON, 1e-15,  1e-14,  1e-13,  1e-12};
    uint64_t random = 2;
    for (int i = 0; i < KINDS * KINDS * 4; i++) {
        pair p = random_pair(&random, i % KINDS, i / KINDS % KINDS);
        const dem2d_vec u = direction(random_between(&random, -3.2, 3.2));
        for (int k = 0; k < COUNT_OF(sweep); k++) {
            const double delta = sweep[k] * (p.pose_a.scale + p.pose_b.scale);
            /* two sharp polygons: a positive depth may be larger than the certified least */
            if (delta > 0 && certified(&p) <= 0) continue;
            place(&p, u, delta);
            check_pair(&p, NULL, delta);
        }
    }
}

static void test_scanned_depths(void **state) {
    (void)state;
    uint64_t random = 3;
    for (int i = 0; i < KINDS * KINDS * 3; i++) {
        pair p = random_pair(&random, i % KINDS, i / KINDS % KINDS);
        check_pair(&p, NULL, scan(&p));
    }
}

/* --- closed forms ---------------------------------------------------------------------------- */

static void test_two_circles(void **state) {
    (void)state;
    uint64_t random = 4;
    for (int i = 0; i < 500; i++) {
        pair p = random_pair(&random, CIRCLE, CIRCLE);
        if (i % 5 == 0) p.pose_b.position = p.pose_a.position;
        const real dx = (real)p.pose_b.position.x - p.pose_a.position.x;
        const real dy = (real)p.pose_b.position.y - p.pose_a.position.y;
        const real depth = 0.8L * (p.pose_a.scale + (real)p.pose_b.scale) - hypotl(dx, dy);
        const dem2d_contact c = check_pair(&p, NULL, depth);
        assert_int_equal(c.support_calls, 0);
        if (depth > -1e-9L) continue;
        /* the line of centres separates circles at once */
        dem2d_contact overlap;
        assert_ok(dem2d_pair_overlap(samples[CIRCLE].shape, p.pose_a, samples[CIRCLE].shape,
                                     p.pose_b, NULL, &overlap));
        assert_int_equal(overlap.state, DEM2D_SEPARATED);
        assert_int_equal(overlap.support_calls, 1);
    }
}

/* Signed distance of a point to a counter-clockwise polygon, negative inside. */
static real point_distance(const real (*points)[2], int count, real x, real y) {
    real outside = HUGE_VALL, inside = -HUGE_VALL;
    for (int i = 0; i < count; i++) {
        const real *p = points[i], *q = points[(i + 1) % count];
        const real ex = q[0] - p[0], ey = q[1] - p[1], length = hypotl(ex, ey);
        const real px = x - p[0], py = y - p[1];
        const real t = fminl(1, fmaxl(0, (px * ex + py * ey) / (length * length)));
        outside = fminl(outside, hypotl(px - t * ex, py - t * ey));
        inside = fmaxl(inside, (px * ey - py * ex) / length);
    }
    return inside <= 0 ? inside : outside;
}

static void test_circle_and_polygon(void **state) {
    (void)state;
    uint64_t random = 5;
    for (int i = 0; i < 500; i++) {
        pair p = random_pair(&random, CIRCLE, POLYGON);
        real points[5][2];
        for (int k = 0; k < 5; k++) {
            const real c = p.pose_b.rotation.c, s = p.pose_b.rotation.s;
            const real x = corners[k].x - (real)samples[POLYGON].info.offset.x;
            const real y = corners[k].y - (real)samples[POLYGON].info.offset.y;
            points[k][0] = p.pose_b.position.x + p.pose_b.scale * (c * x - s * y);
            points[k][1] = p.pose_b.position.y + p.pose_b.scale * (s * x + c * y);
        }
        const dem2d_vec centre = p.pose_a.position;
        const real depth =
            0.8L * p.pose_a.scale - point_distance((const real(*)[2])points, 5, centre.x, centre.y);
        check_pair(&p, NULL, depth);
    }
}

/* Copies of one ellipse, not turned: a point against the ellipse scaled by the sum of the scales.
   On the long axis, inside the evolute, the nearest point is off the axis. */
static real homothetic_depth(real a, real b, real scale, real x, real y) {
    if (x == 0) return scale * b - fabsl(y);
    if (fabsl(x) >= scale * (a * a - b * b) / a) return scale * a - fabsl(x);
    return b * sqrtl(scale * scale - x * x / (a * a - b * b));
}

static void check_bound(const dem2d_contact *c, real truth, double size) {
    assert_between(truth, (real)c->depth - c->error - ROUNDING * size,
                   (real)c->depth + ROUNDING * size);
    assert_within(hypot(c->normal.x, c->normal.y), 1, 8 * DBL_EPSILON);
}

static void check_within(const dem2d_contact *c, real truth, double size) {
    assert_int_not_equal(c->state, DEM2D_UNRESOLVED);
    assert_between(c->error, 0, (TOLERANCE + ROUNDING) * size);
    check_bound(c, truth, size);
}

/* Ordinary ellipses, needles end to end and side by side, sizes far from 1, and a garbage start. */
static void test_homothetic_ellipses(void **state) {
    (void)state;
    static const double axes[][2] = {{1.2, 0.6}, {1, 1e-4}, {3e60, 1e60}, {1e-60, 5e-61}};
    static const double offsets[] = {0, 1e-3, 0.3, 0.75, 0.9, 0.999, 1, 1.001, 2};
    for (int i = 0; i < COUNT_OF(axes) * COUNT_OF(offsets) * 4; i++) {
        const double *axis = axes[i / 4 / COUNT_OF(offsets)];
        const double f = offsets[i / 4 % COUNT_OF(offsets)] * 2.5;
        const double x = i & 1 ? f * axis[0] : 0, y = i & 1 ? 0 : f * axis[1];
        dem2d_contact_desc desc = {0};
        dem2d_shape *shape;
        dem2d_contact c;
        if (i & 2) desc.start = vec(-0.3, 0.95);
        assert_ok(dem2d_shape_create_ellipse(NULL, axis[0], axis[1], &shape));
        dem2d_pose a = still(), b = still();
        b.scale = 1.5, b.position = vec(x, y);
        assert_ok(dem2d_pair_contact(shape, a, shape, b, &desc, &c));
        const real truth = homothetic_depth(axis[0], axis[1], 2.5L, x, y);
        const double size = 2.5 * axis[0] + hypot(x, y);
        /* 0.75 of the first and last ellipse is the cusp of the evolute: rho - h = 0 there */
        if (c.state == DEM2D_UNRESOLVED) assert_near(x, 1.875 * axis[0], 1e-15);
        if (c.state == DEM2D_UNRESOLVED)
            check_bound(&c, truth, size);
        else
            check_within(&c, truth, size);
        dem2d_shape_destroy(shape);
    }
}

/* Odd harmonics only: every width is a[0], so the depth is a[0] - |d|. */
static void test_constant_width(void **state) {
    (void)state;
    const double a[6] = {2, 0, 0, 0.06, 0, 0.01}, b[6] = {0, 0, 0, 0.03, 0, -0.01};
    uint64_t random = 6;
    dem2d_shape *shape;
    assert_ok(dem2d_shape_create_fourier(NULL, a, b, 5, &shape));
    for (int i = 0; i < 200; i++) {
        dem2d_pose pose_a = random_pose(&random, 0), pose_b;
        dem2d_contact c;
        pose_a.scale = 1, pose_b = pose_a;
        const double distance = i ? random_between(&random, 0, 3) : 0;
        const dem2d_vec u = direction(i);
        pose_b.position = vec(distance * u.x, distance * u.y);
        assert_ok(dem2d_pair_contact(shape, pose_a, shape, pose_b, NULL, &c));
        const real truth = 2 - hypotl(pose_b.position.x, pose_b.position.y);
        /* rho is 2 all round: rho - h is the distance */
        if (c.state == DEM2D_UNRESOLVED && distance < FLAT * 2.2)
            check_bound(&c, truth, 2.2 + distance);
        else
            check_within(&c, truth, 2.2 + distance);
    }
    dem2d_shape_destroy(shape);
}

static dem2d_shape *rectangle(double width, double height) {
    const dem2d_vec points[4] = {{0, 0}, {width, 0}, {width, height}, {0, height}};
    dem2d_shape *shape;
    assert_ok(dem2d_shape_create_polygon(NULL, points, 4, 0, &shape));
    return shape;
}

/* Upright rectangles 2 x 1: separated corners, faces that meet over a part of their length, vertex
   on vertex, collinear edges. Where one face normal is the answer it is found exactly, and the
   contact point is inside the common part of the faces. */
static void test_rectangles(void **state) {
    (void)state;
    static const double at[][2] = {{2.5, 1.5}, {2.5, 0.3},    {2, 0},     {2, 0.5},    {2, 1},
                                   {1.9, 0.5}, {0, 1},        {1, 1},     {1.5, -1},   {0.5, -0.9},
                                   {0, 0.1},   {-2.25, -1.5}, {-2, 0.99}, {-1.5, 0.25}};
    dem2d_shape *shape = rectangle(2, 1);
    for (int i = 0; i < COUNT_OF(at); i++) {
        dem2d_pose a = still(), b = still();
        dem2d_contact c, again;
        b.position = vec(at[i][0], at[i][1]);
        const double ox = 2 - fabs(at[i][0]), oy = 1 - fabs(at[i][1]);
        const real truth = ox < 0 && oy < 0 ? -hypotl(ox, oy) : fmin(ox, oy);
        assert_ok(dem2d_pair_contact(shape, a, shape, b, NULL, &c));
        assert_ok(dem2d_pair_contact(shape, a, shape, b, NULL, &again));
        check_within(&c, truth, 2.3 + hypot(at[i][0], at[i][1]));
        assert_memory_equal(&c.normal, &again.normal, sizeof c.normal);
        /* a direction that reaches the answer, also where a cone of them does */
        const double h =
            fabs(c.normal.x) * 2 + fabs(c.normal.y) - at[i][0] * c.normal.x - at[i][1] * c.normal.y;
        assert_within(h, truth, TOLERANCE * 5);
        if (ox == oy || (ox <= 0 && oy <= 0)) continue;
        const double sideways = ox < oy ? c.point.y - at[i][1] / 2 : c.point.x - at[i][0] / 2;
        assert_within(ox < oy ? c.normal.y : c.normal.x, 0, 1e-5);
        assert_between(fabs(sideways), 0, fmax(ox, oy) / 2 + TOLERANCE * 5);
    }
    dem2d_shape_destroy(shape);
}

/* Two diamonds tip to tip: any normal between those of the four edges, always the same one. */
static void test_vertex_on_vertex(void **state) {
    (void)state;
    const dem2d_vec points[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    dem2d_shape *shape;
    dem2d_contact c, again;
    dem2d_pose a = still(), b = still();
    assert_ok(dem2d_shape_create_polygon(NULL, points, 4, 0, &shape));
    static const double gaps[] = {0, 1e-12, 1e-6, 0.5};
    for (int i = 0; i < COUNT_OF(gaps); i++) {
        b.position = vec(2 + gaps[i], 0);
        assert_ok(dem2d_pair_contact(shape, a, shape, b, NULL, &c));
        assert_ok(dem2d_pair_contact(shape, a, shape, b, NULL, &again));
        check_within(&c, -gaps[i], 4.5);
        assert_memory_equal(&c, &again, sizeof c.state);
        assert_memory_equal(&c.normal, &again.normal, sizeof c.normal);
        assert_between(c.normal.x, sqrt(0.5) - 1e-6, 1 + DBL_EPSILON);
        assert_within(c.point.x, 1 + gaps[i] / 2, 1e-9);
    }
    dem2d_shape_destroy(shape);
}

/* --- shapes and places that are hard --------------------------------------------------------- */

/* Concentric copies: the depth is the least width; regular polygons have many such directions. */
static void test_concentric(void **state) {
    (void)state;
    for (int i = 0; i < KINDS; i++) {
        pair p = {i, i, dem2d_pose_make(0.3, -0.2, 0.7, 1), dem2d_pose_make(0.3, -0.2, 0.7, 1)};
        check_pair(&p, NULL, scan(&p));
        p.pose_b = dem2d_pose_make(0.3, -0.2, -0.4, 1.5);
        check_pair(&p, NULL, scan(&p));
    }
    for (int n = 3; n <= 12; n++) {
        dem2d_vec points[12];
        dem2d_shape *shape;
        dem2d_contact c, again;
        for (int i = 0; i < n; i++) points[i] = direction((double)(2 * i * TEST_PI / n));
        assert_ok(dem2d_shape_create_polygon(NULL, points, n, 0, &shape));
        assert_ok(dem2d_pair_contact(shape, still(), shape, still(), NULL, &c));
        assert_ok(dem2d_pair_contact(shape, still(), shape, still(), NULL, &again));
        const real apothem = cosl(TEST_PI / n);
        check_within(&c, n % 2 ? 1 + apothem : 2 * apothem, 2);
        assert_memory_equal(&c.normal, &again.normal, sizeof c.normal);
        dem2d_shape_destroy(shape);
    }
}

/* One inside the other, and sizes up to a million apart. */
static void test_unequal_sizes(void **state) {
    (void)state;
    static const double ratios[] = {1e-3, 1e-6, 1e3, 1e6};
    uint64_t random = 7;
    for (int i = 0; i < KINDS * KINDS * COUNT_OF(ratios); i++) {
        pair p = random_pair(&random, i % KINDS, i / KINDS % KINDS);
        p.pose_b.scale = ratios[i / (KINDS * KINDS)];
        const double reach = 0.4 * fmax(1, p.pose_b.scale);
        p.pose_a.position = vec(0, 0);
        p.pose_b.position = random_vec(&random, reach);
        if (i % 4 == 0) check_pair(&p, NULL, scan(&p)); /* the scan is slow */
        const dem2d_vec u = direction(random_between(&random, -3.2, 3.2));
        place(&p, u, -0.01 * p.pose_a.scale);
        check_pair(&p, NULL, -0.01 * p.pose_a.scale);
        if (certified(&p) <= 0) continue;
        place(&p, u, 0.5 * certified(&p));
        check_pair(&p, NULL, 0.5 * certified(&p));
    }
}

/* Long rectangles whose faces are nearly parallel. With B turned by t the sharpest corner of B goes
   down by half its width times sin t; A's normal and B's are the only candidates. */
static void test_nearly_parallel(void **state) {
    (void)state;
    dem2d_shape *shape = rectangle(1000, 2);
    for (int i = -16; i <= -3; i++) {
        const double t = pow(10, i), overlap = 0.01;
        dem2d_pose a = still(), b = still();
        dem2d_contact c;
        b.rotation.s = t, b.rotation.c = sqrt((1 - t) * (1 + t));
        b.position = vec(100, 2 - overlap);
        assert_ok(dem2d_pair_contact(shape, a, shape, b, NULL, &c));
        const real s = t, q = sqrtl((1 - s) * (1 + s)), y = b.position.y;
        const real along_a = 1 + 500 * s + q - y;                 /* normal (0, 1) */
        const real along_b = 1 + 500 * s + q - (q * y - 100 * s); /* normal (-s, q) */
        check_within(&c, fminl(along_a, along_b), 1102);
        assert_within(c.normal.x, 0, t + 1e-4);
    }
    dem2d_shape_destroy(shape);
}

/* A pair far from the origin, moved by what a double can hold: not one bit changes. */
static void test_far_from_origin(void **state) {
    (void)state;
    uint64_t random = 8;
    for (int i = 0; i < KINDS * KINDS * 4; i++) {
        pair p = random_pair(&random, i % KINDS, i / KINDS % KINDS);
        dem2d_vec *ends[2] = {&p.pose_a.position, &p.pose_b.position};
        for (int k = 0; k < 2; k++) {
            ends[k]->x = floor(ends[k]->x * 0x1p20) * 0x1p-20;
            ends[k]->y = floor(ends[k]->y * 0x1p20) * 0x1p-20;
        }
        const dem2d_contact near = ask(&p, NULL);
        for (int k = 0; k < 2; k++) ends[k]->x += 0x1p27, ends[k]->y -= 0x1p26;
        const dem2d_contact far = ask(&p, NULL);
        assert_same_bits(far.depth, near.depth);
        assert_same_bits(far.normal.x, near.normal.x);
        assert_same_bits(far.normal.y, near.normal.y);
        assert_int_equal(far.support_calls, near.support_calls);
    }
}

/* Needles 10,000 to 1, crossed: 45 degrees off is 1.41 deep, along either axis 1.0001. */
static void test_crossed_needles(void **state) {
    (void)state;
    static const dem2d_vec starts[] = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {-1, 1e-8}, {1e150, 3e149}};
    dem2d_shape *needles[2];
    assert_ok(dem2d_shape_create_ellipse(NULL, 1, 1e-4, &needles[0]));
    needles[1] = rectangle(2, 2e-4);
    for (int i = 0; i < 2 * COUNT_OF(starts); i++) {
        dem2d_contact_desc desc = {0};
        dem2d_pose a = still(), b = still();
        dem2d_contact c;
        desc.start = starts[i / 2];
        b.rotation = (dem2d_rot){0, 1};
        assert_ok(dem2d_pair_contact(needles[i % 2], a, needles[i % 2], b, &desc, &c));
        check_within(&c, 1.0001L, 2);
        b.position.x = 1.0002; /* the tip stands off the other's side */
        assert_ok(dem2d_pair_contact(needles[i % 2], a, needles[i % 2], b, &desc, &c));
        check_within(&c, -0.0001L, 3.1);
        assert_int_equal(c.state, DEM2D_SEPARATED);
    }
    dem2d_shape_destroy(needles[0]);
    dem2d_shape_destroy(needles[1]);
}

/* Curvature that reaches 0 at two points, and below 0 by a hair. */
static void test_zero_curvature(void **state) {
    (void)state;
    const double b[3] = {0, 0, 0};
    double a[3] = {2, 0, 1.0 / 3};
    dem2d_shape *shape, *none = NULL;
    assert_ok(dem2d_shape_create_fourier(NULL, a, b, 2, &shape));
    a[2] = (1 + 1e-12) / 3;
    assert_result(dem2d_shape_create_fourier(NULL, a, b, 2, &none), DEM2D_NEGATIVE_CURVATURE);
    assert_null(none);
    for (int i = 0; i <= 40; i++) {
        dem2d_pose far = still();
        dem2d_contact c;
        far.position = vec(0.08 * i, 0);
        assert_ok(dem2d_pair_contact(shape, still(), shape, far, NULL, &c));
        /* h(t) = 2 + (2/3) cos 2t - x cos t = 4/3 + (4/3) k^2 - x k with k = cos t */
        const real x = far.position.x, k = fminl(1, 3 * x / 8);
        check_within(&c, 4 / 3.0L + 4 / 3.0L * k * k - x * k, 2.7 + (double)x);
    }
    dem2d_shape_destroy(shape);
}

/* --- lattice polygons and their exact Minkowski difference ----------------------------------- */

typedef struct lattice {
    int64_t x, y;
} lattice;

static int64_t turn(lattice o, lattice p, lattice q) {
    return (p.x - o.x) * (q.y - o.y) - (p.y - o.y) * (q.x - o.x);
}

static int compare_lattice(const void *left, const void *right) {
    const lattice *a = left, *b = right;
    if (a->x != b->x) return a->x < b->x ? -1 : 1;
    return a->y < b->y ? -1 : a->y > b->y;
}

/* Strict convex hull, counter-clockwise; 0 if it has no area. hull has room for 2 count. */
static int lattice_hull(lattice *points, int count, lattice *hull) {
    int n = 0;
    qsort(points, (size_t)count, sizeof *points, compare_lattice);
    for (int pass = 0; pass < 2; pass++) {
        const int base = n;
        for (int i = 0; i < count; i++) {
            const lattice p = points[pass ? count - 1 - i : i];
            while (n - base >= 2 && turn(hull[n - 2], hull[n - 1], p) <= 0) n--;
            hull[n++] = p;
        }
        n--; /* the next pass starts there */
    }
    return n >= 3 ? n : 0;
}

/* Signed depth of the origin in a lattice polygon; exact apart from one division or root. */
static real lattice_depth(const lattice *hull, int count) {
    real points[64][2];
    for (int i = 0; i < count; i++) points[i][0] = (real)hull[i].x, points[i][1] = (real)hull[i].y;
    return -point_distance((const real(*)[2])points, count, 0, 0);
}

static int random_lattice(uint64_t *random, lattice *hull) {
    lattice points[7];
    const int count = 3 + random_below(random, 5);
    const int span = 2 + random_below(random, 5);
    for (int i = 0; i < count; i++)
        points[i].x = random_below(random, span), points[i].y = random_below(random, span);
    return lattice_hull(points, count, hull);
}

static dem2d_shape *lattice_shape(const lattice *hull, int count, dem2d_pose *pose) {
    dem2d_vec points[14];
    dem2d_shape *shape;
    dem2d_shape_info info;
    for (int i = 0; i < count; i++) points[i] = vec((double)hull[i].x, (double)hull[i].y);
    assert_ok(dem2d_shape_create_polygon(NULL, points, count, 0, &shape));
    assert_ok(dem2d_shape_get(shape, &info));
    *pose = still();
    pose->position = info.offset;
    return shape;
}

static void test_lattice(void **state) {
    (void)state;
    uint64_t random = 9;
    int touching = 0;
    for (int round = 0; round < 20000; round++) {
        lattice a[14], b[14], differences[49], hull[98];
        const int na = random_lattice(&random, a), nb = random_lattice(&random, b);
        if (!na || !nb) continue;
        lattice shift;
        shift.x = random_below(&random, 9) - 4, shift.y = random_below(&random, 9) - 4;
        for (int i = 0; i < na * nb; i++) {
            differences[i].x = a[i / nb].x - b[i % nb].x - shift.x;
            differences[i].y = a[i / nb].y - b[i % nb].y - shift.y;
        }
        const int count = lattice_hull(differences, na * nb, hull);
        const real truth = lattice_depth(hull, count);
        dem2d_pose pose_a, pose_b;
        dem2d_contact c, overlap;
        dem2d_shape *shape_a = lattice_shape(a, na, &pose_a);
        dem2d_shape *shape_b = lattice_shape(b, nb, &pose_b);
        pose_b.position.x += (double)shift.x, pose_b.position.y += (double)shift.y;
        assert_ok(dem2d_pair_contact(shape_a, pose_a, shape_b, pose_b, NULL, &c));
        assert_ok(dem2d_pair_overlap(shape_a, pose_a, shape_b, pose_b, NULL, &overlap));
        check_within(&c, truth, 20);
        if (truth == 0) touching++;
        if (truth < 0) assert_int_equal(c.state, DEM2D_SEPARATED);
        if (truth > 0) assert_int_equal(c.state, DEM2D_PENETRATING);
        if (truth != 0) assert_int_equal(overlap.state, c.state);
        if (truth == 0) assert_within(c.depth, 0, c.error + 20 * ROUNDING);
        dem2d_shape_destroy(shape_a);
        dem2d_shape_destroy(shape_b);
    }
    assert_true(touching > 100); /* or the cases that matter were not met */
}

/* --- what must not change -------------------------------------------------------------------- */

static void test_swapped(void **state) {
    (void)state;
    uint64_t random = 10;
    for (int i = 0; i < KINDS * KINDS * 20; i++) {
        const pair p = random_pair(&random, i % KINDS, i / KINDS % KINDS);
        const pair q = {p.b, p.a, p.pose_b, p.pose_a};
        const dem2d_contact c = ask(&p, NULL), s = ask(&q, NULL);
        assert_same_bits(s.depth, c.depth);
        assert_same_bits(s.normal.x, -c.normal.x);
        assert_same_bits(s.normal.y, -c.normal.y);
    }
}

static void test_scaled_and_turned(void **state) {
    (void)state;
    static const int powers[] = {-200, -40, 1, 40, 200};
    uint64_t random = 11;
    for (int i = 0; i < KINDS * KINDS * 10; i++) {
        const pair p = random_pair(&random, i % KINDS, i / KINDS % KINDS);
        const dem2d_contact c = ask(&p, NULL);
        for (int k = 0; k < COUNT_OF(powers) + 1; k++) {
            pair q = p;
            dem2d_pose *poses[2] = {&q.pose_a, &q.pose_b};
            const int power = k < COUNT_OF(powers) ? powers[k] : 0;
            for (int j = 0; j < 2; j++) {
                const dem2d_pose old = *poses[j];
                poses[j]->scale = ldexp(old.scale, power);
                poses[j]->position =
                    vec(ldexp(old.position.x, power), ldexp(old.position.y, power));
                if (power) continue;
                poses[j]->position = vec(-old.position.y, old.position.x);
                poses[j]->rotation = (dem2d_rot){-old.rotation.s, old.rotation.c};
            }
            const dem2d_contact s = ask(&q, NULL);
            assert_same_bits(s.depth, ldexp(c.depth, power));
            assert_same_bits(s.normal.x, power ? c.normal.x : -c.normal.y);
            assert_same_bits(s.normal.y, power ? c.normal.y : c.normal.x);
            assert_int_equal(s.state, c.state);
        }
    }
}

/* The depth is 1-Lipschitz in the position, and moving B by depth along the normal gives touching.
 */
static void test_moved(void **state) {
    (void)state;
    uint64_t random = 12;
    for (int i = 0; i < KINDS * KINDS * 10; i++) {
        const pair p = random_pair(&random, i % KINDS, i / KINDS % KINDS);
        const dem2d_contact c = ask(&p, NULL);
        const double slack = ROUNDING * pair_size(&p);
        pair q = p;
        q.pose_b.position.x += c.depth * c.normal.x, q.pose_b.position.y += c.depth * c.normal.y;
        const dem2d_contact touch = ask(&q, NULL);
        assert_within(touch.depth, 0, touch.error + c.error + slack);
        const double step = pow(10, random_between(&random, -8, 0));
        const dem2d_vec u = direction(i);
        q = p, q.pose_b.position.x += step * u.x, q.pose_b.position.y += step * u.y;
        const dem2d_contact moved = ask(&q, NULL);
        assert_within(moved.depth, c.depth, step + moved.error + c.error + slack);
    }
}

/* One disc as circle, ellipse, Fourier series of order 0 and custom shape. */
static void test_representations(void **state) {
    (void)state;
    double radius = 0.8;
    const double a[1] = {1.6}, b[1] = {0};
    dem2d_shape *discs[4];
    dem2d_custom_desc custom = {0};
    custom.support = round_custom, custom.user = &radius, custom.rho_min = radius;
    assert_ok(dem2d_shape_create_circle(NULL, radius, &discs[0]));
    assert_ok(dem2d_shape_create_ellipse(NULL, radius, radius, &discs[1]));
    assert_ok(dem2d_shape_create_fourier(NULL, a, b, 0, &discs[2]));
    assert_ok(dem2d_shape_create_custom(NULL, &custom, &discs[3]));
    uint64_t random = 13;
    for (int i = 0; i < KINDS * 20; i++) {
        const pair p = random_pair(&random, CIRCLE, i % KINDS);
        dem2d_contact first = {0}, c;
        for (int k = 0; k < 4; k++) {
            assert_ok(
                dem2d_pair_contact(discs[k], p.pose_a, samples[p.b].shape, p.pose_b, NULL, &c));
            if (k == 0) first = c;
            assert_within(c.depth, first.depth, c.error + first.error + ROUNDING * pair_size(&p));
        }
    }
    for (int k = 0; k < 4; k++) dem2d_shape_destroy(discs[k]);
}

/* Garbage in the cache: the depth is the same to its bound. */
static void test_start(void **state) {
    (void)state;
    static const dem2d_vec starts[] = {
        {1, 0},       {0, -1},      {1e150, -1e150}, {-3e-300, 1e-300},
        {0, -5e-324}, {1e300, 1e8}, {-1, -1e-16}};
    uint64_t random = 14;
    for (int i = 0; i < KINDS * KINDS * 5; i++) {
        const pair p = random_pair(&random, i % KINDS, i / KINDS % KINDS);
        const dem2d_contact cold = ask(&p, NULL);
        for (int k = 0; k <= COUNT_OF(starts); k++) {
            dem2d_contact_desc desc = {0};
            if (k < COUNT_OF(starts))
                desc.start = starts[k];
            else
                desc.start = vec(-cold.normal.x, -cold.normal.y); /* as wrong as can be */
            const dem2d_contact c = ask(&p, &desc);
            check_converged(&p, &c);
            if (bend(&p, &cold) > FLAT * pair_size(&p)) assert_int_equal(c.state, cold.state);
            assert_within(c.depth, cold.depth, c.error + cold.error + ROUNDING * pair_size(&p));
        }
    }
}

/* Stopped after one round: the bounds still hold, and an answer given is right. */
static void test_iteration_cap(void **state) {
    (void)state;
    uint64_t random = 15;
    dem2d_contact_desc desc = {0};
    int unresolved = 0;
    desc.max_iterations = 1;
    desc.solver = DEM2D_GJK_EPA; /* the certified one needs no more rounds than it has looks */
    for (int i = 0; i < KINDS * KINDS * 10; i++) {
        pair p = random_pair(&random, i % KINDS, i / KINDS % KINDS);
        const double delta = certified(&p) > 0 ? 0.5 * certified(&p) : -0.1;
        place(&p, direction(random_between(&random, -3.2, 3.2)), delta);
        const dem2d_contact c = ask(&p, &desc);
        check_bounds(&p, &c, delta);
        assert_true(isfinite(c.depth) && isfinite(c.error));
        if (c.state == DEM2D_UNRESOLVED)
            unresolved++;
        else
            check_converged(&p, &c);
    }
    assert_true(unresolved > 100); /* one round can't settle most smooth overlaps */
}

/* --- walls ----------------------------------------------------------------------------------- */

static void test_walls(void **state) {
    (void)state;
    uint64_t random = 16;
    for (int i = 0; i < KINDS * 200; i++) {
        const int kind = i % KINDS;
        const dem2d_pose pose = random_pose(&random, 2);
        const dem2d_vec u = direction(random_between(&random, -3.2, 3.2));
        const double length = pow(10, random_between(&random, -3, 3));
        const dem2d_vec on = random_vec(&random, 2);
        dem2d_contact c;
        assert_ok(
            dem2d_wall_contact(samples[kind].shape, pose, on, vec(length * u.x, length * u.y), &c));
        const double size = 2 * samples[kind].info.circumscribed * pose.scale + 4;
        const real height = ((real)pose.position.x - on.x) * u.x +
                            ((real)pose.position.y - on.y) * u.y; /* below 0: centre behind */
        assert_within(c.depth, posed_value(kind, &pose, -u.x, -u.y) - height, ROUNDING * size);
        assert_within(c.error, 0, ROUNDING * size);
        assert_int_equal(c.support_calls, 1);
        assert_within(hypot(c.normal.x + u.x, c.normal.y + u.y), 0, 8 * DBL_EPSILON);
        assert_int_equal(c.state, c.depth > 0 ? DEM2D_PENETRATING : DEM2D_SEPARATED);
        assert_within((c.point_b.x - on.x) * u.x + (c.point_b.y - on.y) * u.y, 0, ROUNDING * size);
        assert_within(c.point_a.x - c.point_b.x, c.depth * c.normal.x, ROUNDING * size);
        assert_within(c.point_a.y - c.point_b.y, c.depth * c.normal.y, ROUNDING * size);
        assert_within(c.point.x, c.point_b.x, 0); /* the foot, on the wall */
        assert_within(c.point.y, c.point_b.y, 0);
        check_witness(kind, &pose, c.point_a, -u.x, -u.y, ROUNDING * size);
    }
}

/* A face flat on the wall, from above the wall to wholly behind it. */
static void test_wall_along_face(void **state) {
    (void)state;
    dem2d_shape *shape = rectangle(4, 2);
    for (int i = 0; i < 4; i++) {
        static const double heights[] = {1.5, 1, 0.25, -3};
        dem2d_pose pose = still();
        dem2d_contact c;
        pose.position = vec(7, heights[i]);
        assert_ok(dem2d_wall_contact(shape, pose, vec(0, 0), vec(0, 2), &c));
        assert_within(c.depth, 1 - heights[i], ROUNDING);
        assert_between(c.point.x, 5 - ROUNDING, 9 + ROUNDING);
        assert_within(c.normal.y, -1, DBL_EPSILON);
    }
    dem2d_shape_destroy(shape);
}

/* --- many pairs ------------------------------------------------------------------------------ */

/* Aligned, concentric, equal, far apart, tiny: by chance, often together. */
static pair degenerate_pair(uint64_t *random) {
    static const double scales[] = {1, 1, 0.5, 1e-6, 1e6};
    const int a = random_below(random, KINDS);
    pair p = random_pair(random, a, random_below(random, KINDS));
    if (random_below(random, 3) == 0) p.pose_b.rotation = p.pose_a.rotation;
    if (random_below(random, 3) == 0) p.pose_b.scale = scales[random_below(random, 5)];
    if (random_below(random, 4) == 0) p.pose_a.rotation = (dem2d_rot){1, 0};
    if (random_below(random, 4) == 0) p.pose_b.position.x = p.pose_a.position.x;
    if (random_below(random, 4) == 0) p.pose_b.position.y = p.pose_a.position.y;
    if (random_below(random, 10) == 0) p.pose_b = p.pose_a;
    return p;
}

static double support_value(const pair *p, dem2d_vec u) {
    const double dx = p->pose_b.position.x - p->pose_a.position.x;
    const double dy = p->pose_b.position.y - p->pose_a.position.y;
    dem2d_support a, b;
    assert_ok(dem2d_shape_support(samples[p->a].shape, p->pose_a, u, &a));
    assert_ok(dem2d_shape_support(samples[p->b].shape, p->pose_b, vec(-u.x, -u.y), &b));
    return a.value + b.value - dx * u.x - dy * u.y;
}

static void test_many_pairs(void **state) {
    (void)state;
    uint64_t random = 17;
    for (int i = 0; i < 100000; i++) {
        const pair p = degenerate_pair(&random);
        const dem2d_contact c = ask(&p, NULL);
        const double size = pair_size(&p), slack = c.error + ROUNDING * size;
        check_resolved(&p, &c);
        assert_within(hypot(c.normal.x, c.normal.y), 1, 8 * DBL_EPSILON);
        assert_within(support_value(&p, c.normal), c.depth, slack);
        assert_true(c.state != DEM2D_SEPARATED || c.depth <= ROUNDING * size);
        assert_true(c.state != DEM2D_PENETRATING || c.depth >= -ROUNDING * size);
        assert_within((c.point_a.x - c.point_b.x) * c.normal.x +
                          (c.point_a.y - c.point_b.y) * c.normal.y,
                      c.depth, slack + c.error);
        for (int k = 0; k < 3; k++) {
            const dem2d_vec u = direction(random_between(&random, -3.2, 3.2));
            assert_between(support_value(&p, u), c.depth - slack, HUGE_VALL);
        }
    }
}

/* --- errors ---------------------------------------------------------------------------------- */

typedef dem2d_result pair_fn(const dem2d_shape *, dem2d_pose, const dem2d_shape *, dem2d_pose,
                             const dem2d_contact_desc *, dem2d_contact *);

static void check_errors(pair_fn *call) {
    static const struct {
        double x, scale, tolerance, start;
        int cap;
        dem2d_result result;
    } rows[] = {
        {NAN, 1, 0, 0, 0, DEM2D_NOT_FINITE},       {INFINITY, 1, 0, 0, 0, DEM2D_NOT_FINITE},
        {0, NAN, 0, 0, 0, DEM2D_NOT_FINITE},       {0, 0, 0, 0, 0, DEM2D_OUT_OF_RANGE},
        {0, -1, 0, 0, 0, DEM2D_OUT_OF_RANGE},      {0, 1, -1e-9, 0, 0, DEM2D_OUT_OF_RANGE},
        {0, 1, NAN, 0, 0, DEM2D_NOT_FINITE},       {0, 1, 0, NAN, 0, DEM2D_NOT_FINITE},
        {0, 1, 0, -INFINITY, 0, DEM2D_NOT_FINITE}, {0, 1, 0, 0, -1, DEM2D_OUT_OF_RANGE},
    };
    const dem2d_shape *shape = samples[ELLIPSE].shape;
    dem2d_contact c, before;
    memset(&c, 0x5a, sizeof c), before = c;
    for (int i = 0; i < COUNT_OF(rows); i++) {
        dem2d_contact_desc desc = {0};
        dem2d_pose pose = still();
        pose.position.x = rows[i].x, pose.scale = rows[i].scale;
        desc.tolerance = rows[i].tolerance, desc.max_iterations = rows[i].cap;
        desc.start.y = rows[i].start;
        assert_result(call(shape, still(), shape, pose, &desc, &c), rows[i].result);
        assert_result(call(shape, pose, shape, still(), &desc, &c), rows[i].result);
    }
    assert_result(call(NULL, still(), shape, still(), NULL, &c), DEM2D_NULL_ARGUMENT);
    assert_result(call(shape, still(), NULL, still(), NULL, &c), DEM2D_NULL_ARGUMENT);
    assert_result(call(shape, still(), shape, still(), NULL, NULL), DEM2D_NULL_ARGUMENT);
    assert_memory_equal(&c, &before, sizeof c);
}

static void test_errors(void **state) {
    (void)state;
    check_errors(dem2d_pair_overlap);
    check_errors(dem2d_pair_distance);
    check_errors(dem2d_pair_contact);
}

static void test_wall_errors(void **state) {
    (void)state;
    const dem2d_shape *shape = samples[FOURIER].shape;
    dem2d_pose bad = still(), flat = still();
    dem2d_contact c, before;
    bad.rotation.s = NAN, flat.scale = 0;
    memset(&c, 0x5a, sizeof c), before = c;
    const dem2d_vec o = {0, 0}, up = {0, 1}, nan_vec = {NAN, 0}, huge = {0, INFINITY};
    assert_result(dem2d_wall_contact(NULL, still(), o, up, &c), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_wall_contact(shape, still(), o, up, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_wall_contact(shape, bad, o, up, &c), DEM2D_NOT_FINITE);
    assert_result(dem2d_wall_contact(shape, flat, o, up, &c), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_wall_contact(shape, still(), nan_vec, up, &c), DEM2D_NOT_FINITE);
    assert_result(dem2d_wall_contact(shape, still(), o, huge, &c), DEM2D_NOT_FINITE);
    assert_result(dem2d_wall_contact(shape, still(), o, o, &c), DEM2D_OUT_OF_RANGE);
    assert_memory_equal(&c, &before, sizeof c);
}

/* Sizes and places whose squares are no normal numbers are refused, by creation and by queries. */
static void test_extreme_sizes(void **state) {
    (void)state;
    dem2d_shape *shape = NULL;
    dem2d_contact c;
    assert_result(dem2d_shape_create_ellipse(NULL, 1e-170, 5e-171, &shape), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_shape_create_ellipse(NULL, 1e200, 5e199, &shape), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_shape_create_circle(NULL, 1e-320, &shape), DEM2D_OUT_OF_RANGE);
    const dem2d_vec far[] = {{0, 0}, {1e150, 0}, {0, 1e150}};
    assert_result(dem2d_shape_create_polygon(NULL, far, 3, 0, &shape), DEM2D_OUT_OF_RANGE);
    assert_null(shape);
    assert_ok(dem2d_shape_create_ellipse(NULL, 2, 1, &shape));
    const double scales[] = {1, 1e-165, 1e300}, offsets[] = {1e200, 0, 1e300};
    for (int i = 0; i < 3; i++) {
        const dem2d_pose a = dem2d_pose_make(0, 0, 0, scales[i]);
        const dem2d_pose b = dem2d_pose_make(offsets[i], 0, 0, scales[i]);
        assert_result(dem2d_pair_contact(shape, a, shape, b, NULL, &c), DEM2D_OUT_OF_RANGE);
        assert_result(dem2d_pair_overlap(shape, a, shape, b, NULL, &c), DEM2D_OUT_OF_RANGE);
        assert_result(dem2d_pair_distance(shape, a, shape, b, NULL, &c), DEM2D_OUT_OF_RANGE);
    }
    dem2d_shape_destroy(shape);
}

/* A corner of a rounded square over another's, as deep as the rounding: h hardly bends there. */
static void test_flat_minimum(void **state) {
    (void)state;
    const dem2d_vec square[] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    dem2d_shape *shape;
    assert_ok(dem2d_shape_create_polygon(NULL, square, 4, 0.05, &shape));
    for (double e = 1e-5; e < 1e-2; e *= 2) {
        dem2d_contact c;
        assert_ok(dem2d_pair_contact(shape, dem2d_pose_make(0, 0, 0, 1), shape,
                                     dem2d_pose_make(2 + e, 2 + e, 0, 1), NULL, &c));
        assert_int_equal(c.state, DEM2D_PENETRATING);
        assert_within(c.depth, 0.1L - e * sqrtl(2), c.error + 1e-14);
    }
    dem2d_shape_destroy(shape);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chosen_depths),
        cmocka_unit_test(test_touch),
        cmocka_unit_test(test_scanned_depths),
        cmocka_unit_test(test_two_circles),
        cmocka_unit_test(test_circle_and_polygon),
        cmocka_unit_test(test_homothetic_ellipses),
        cmocka_unit_test(test_constant_width),
        cmocka_unit_test(test_rectangles),
        cmocka_unit_test(test_vertex_on_vertex),
        cmocka_unit_test(test_concentric),
        cmocka_unit_test(test_unequal_sizes),
        cmocka_unit_test(test_nearly_parallel),
        cmocka_unit_test(test_far_from_origin),
        cmocka_unit_test(test_crossed_needles),
        cmocka_unit_test(test_zero_curvature),
        cmocka_unit_test(test_lattice),
        cmocka_unit_test(test_swapped),
        cmocka_unit_test(test_scaled_and_turned),
        cmocka_unit_test(test_moved),
        cmocka_unit_test(test_representations),
        cmocka_unit_test(test_start),
        cmocka_unit_test(test_iteration_cap),
        cmocka_unit_test(test_walls),
        cmocka_unit_test(test_wall_along_face),
        cmocka_unit_test(test_many_pairs),
        cmocka_unit_test(test_extreme_sizes),
        cmocka_unit_test(test_flat_minimum),
        cmocka_unit_test(test_errors),
        cmocka_unit_test(test_wall_errors),
    };
    return cmocka_run_group_tests(tests, create_samples, destroy_samples);
}
