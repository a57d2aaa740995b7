/* Polybeziers whose arcs turn by pi, are straight or nearly so, have knots that are smooth only to
   the digits of a file, or are tiny: support, boxes, walls, contacts, faces. The truth is a scan of
   the given arcs in long double. */
#include "dem2d.h"
#include "testing.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

typedef long double real;

enum { ARCS = 8 };

/* A chain of arcs in the plane, before it is turned and rounded. */
typedef struct chain {
    const char *name;
    int arcs;
    double x[3 * ARCS], y[3 * ARCS];
} chain;

static const chain chains[] = {
    {"lens", 2, {-1, -1, 1, 1, 1, -1}, {0, -.6, -.6, 0, .6, .6}},
    {"D", 3, {0, 0, 0, 0, 0, 1.2, 1.2, 1.2, 0}, {.9, .3, -.3, -.9, -1.6, -1.2, 0, 1.2, 1.6}},
    {"stadium",
     4,
     {-1, -.3, .3, 1, 1.6, 1.6, 1, .3, -.3, -1, -1.6, -1.6},
     {-.5, -.5, -.5, -.5, -.5, .5, .5, .5, .5, .5, .5, -.5}},
    {"round square",
     8,
     {-.6, -.2, .2,  .6,  .82,  1,  1,  1,  1,  1,  1,  .82,
      .6,  .2,  -.2, -.6, -.82, -1, -1, -1, -1, -1, -1, -.82},
     {-1, -1, -1, -1, -1, -.82, -.6, -.2, .2,  .6,  .82,  1,
      1,  1,  1,  1,  1,  .82,  .6,  .2,  -.2, -.6, -.82, -1}},
};

/* A chain turned by an angle, its coordinates rounded to digits after the point (0: as they are).
 */
static int make_control(const chain *c, double angle, int digits, dem2d_vec *control) {
    const double unit = digits > 0 ? pow(10, digits) : 0;
    for (int i = 0; i < 3 * c->arcs; i++) {
        double x = cos(angle) * c->x[i] - sin(angle) * c->y[i];
        double y = sin(angle) * c->x[i] + cos(angle) * c->y[i];
        if (digits > 0) x = round(x * unit) / unit, y = round(y * unit) / unit;
        control[i] = vec(x, y);
    }
    return c->arcs;
}

/* A point of arc k, and the farthest value along u, by a scan that is refined. */
static real arc_value(const dem2d_vec *control, int arcs, int k, real t, real ux, real uy) {
    const real s = 1 - t, w[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
    real value = 0;
    for (int i = 0; i < 4; i++) {
        const dem2d_vec q = control[(3 * k + i) % (3 * arcs)];
        value += w[i] * (ux * q.x + uy * q.y);
    }
    return value;
}

static real true_value(const dem2d_vec *control, int arcs, real ux, real uy) {
    real most = -INFINITY;
    for (int k = 0; k < arcs; k++) {
        real best = -INFINITY, at = 0;
        for (int i = 0; i <= 16; i++) {
            const real value = arc_value(control, arcs, k, i / 16.0L, ux, uy);
            if (value > best) best = value, at = i / 16.0L;
        }
        for (real step = 1 / 16.0L; step > 1e-9L; step /= 2)
            for (int side = -1; side <= 1; side += 2) {
                const real t = fminl(1, fmaxl(0, at + side * step / 2));
                const real value = arc_value(control, arcs, k, t, ux, uy);
                if (value > best) best = value, at = t;
            }
        most = fmaxl(most, best);
    }
    return most;
}

/* Every chain turned to many angles, as it is and with few digits: f(control, arcs, shape, kink).
 */
typedef void visit_fn(const dem2d_vec *control, int arcs, const dem2d_shape *shape,
                      const dem2d_shape_info *info);

static void visit(visit_fn *f) {
    static const int digits[] = {0, 7, 9};
    for (int i = 0; i < COUNT_OF(chains); i++)
        for (int j = 0; j < 60; j++) {
            dem2d_vec control[3 * ARCS];
            dem2d_shape *shape;
            dem2d_shape_info info;
            const int arcs = make_control(&chains[i], 0.105 * j, digits[j % 3], control);
            assert_ok(dem2d_shape_create_bezier(NULL, control, arcs, &shape));
            assert_ok(dem2d_shape_get(shape, &info));
            assert_int_equal(info.count, arcs);
            assert_true(info.deviation <= (j % 3 == 0 ? 1e-15 : 1e-6));
            f(control, arcs, shape, &info);
            dem2d_shape_destroy(shape);
        }
}

static void check_questions(const dem2d_vec *control, int arcs, const dem2d_shape *shape,
                            const dem2d_shape_info *info) {
    const dem2d_pose pose = {{0, 0}, {1, 0}, 1};
    dem2d_box box;
    assert_ok(dem2d_shape_aabb(shape, pose, &box));
    const real side[4] = {box.upper.x, box.upper.y, -box.lower.x, -box.lower.y};
    for (int i = 0; i < 40; i++) {
        const double angle = 0.157 * i;
        const dem2d_vec u =
            i < 4 ? vec((i == 0) - (i == 2), (i == 1) - (i == 3)) : vec(cos(angle), sin(angle));
        const real h = true_value(control, arcs, u.x, u.y);
        const real centre = (real)u.x * info->offset.x + (real)u.y * info->offset.y;
        dem2d_support support;
        dem2d_contact c;
        assert_ok(dem2d_shape_support(shape, pose, u, &support));
        assert_within(support.value, h - centre, 1e-13L);
        if (i < 4) assert_within(side[i], h - centre, 1e-13L);
        assert_ok(dem2d_wall_contact(shape, pose, vec(0, 0), vec(-u.x, -u.y), &c));
        assert_within(c.depth, h - centre, c.error + 1e-14L);
    }
    /* the outline is that of the given arcs: every third control point is on it */
    dem2d_vec outline[4 * ARCS];
    assert_ok(dem2d_shape_outline(shape, pose, 4 * arcs, outline));
    for (int k = 0; k < arcs; k++) {
        assert_within(outline[4 * k].x + info->offset.x, control[3 * k].x, 1e-14L);
        assert_within(outline[4 * k].y + info->offset.y, control[3 * k].y, 1e-14L);
    }
}

static void questions_of_given_arcs(void **state) {
    (void)state;
    visit(check_questions);
}

/* Depth of a circle against the arcs: the least of h(u) + r - d.u over many directions, refined. */
static real true_depth(const dem2d_vec *control, int arcs, dem2d_vec d, double r) {
    real best = INFINITY, at = 0;
    for (int i = 0; i < 180; i++) {
        const real a = i * TEST_PI / 90, c = cosl(a), s = sinl(a);
        const real h = true_value(control, arcs, c, s) + r - d.x * c - d.y * s;
        if (h < best) best = h, at = a;
    }
    for (real step = TEST_PI / 90; step > 1e-10L; step /= 2)
        for (int i = -2; i <= 2; i++) {
            const real a = at + i * step / 2, c = cosl(a), s = sinl(a);
            const real h = true_value(control, arcs, c, s) + r - d.x * c - d.y * s;
            if (h < best) best = h, at = a;
        }
    return best;
}

static int visits;

static void check_circles(const dem2d_vec *control, int arcs, const dem2d_shape *shape,
                          const dem2d_shape_info *info) {
    if (visits++ % 20 != 0) return; /* the scan takes long */
    dem2d_shape *circle;
    assert_ok(dem2d_shape_create_circle(NULL, 1, &circle));
    for (int i = 0; i < 6; i++) {
        const double r = 0.4, angle = 1.1 * i + 0.01 * visits, far = 0.3 + 0.3 * i;
        const dem2d_vec at = vec(far * cos(angle), far * sin(angle));
        const dem2d_pose a = {{0, 0}, {1, 0}, 1}, b = {at, {1, 0}, r};
        const dem2d_vec d = vec(at.x + info->offset.x, at.y + info->offset.y);
        dem2d_contact c;
        assert_ok(dem2d_pair_contact(shape, a, circle, b, NULL, &c));
        assert_int_not_equal(c.state, DEM2D_UNRESOLVED);
        assert_within(c.depth, true_depth(control, arcs, d, r), c.error + 1e-13L);
        assert_within(c.point_a.x - c.point_b.x, c.depth * c.normal.x, 1e-6L);
        assert_within(c.point_a.y - c.point_b.y, c.depth * c.normal.y, 1e-6L);
    }
    dem2d_shape_destroy(circle);
}

static void circles_within_the_error(void **state) {
    (void)state;
    visits = 0;
    visit(check_circles);
}

/* Two stadiums side by side meet with their straight sides, a D rests on a wall with its own. */
static void straight_arcs_are_faces(void **state) {
    (void)state;
    for (int i = 0; i < 40; i++) {
        const double angle = 0.16 * i, depth = 0.01, x = 0.3;
        dem2d_vec control[3 * ARCS];
        dem2d_shape *stadium, *half;
        dem2d_contact c;
        const dem2d_pose a = {{0, 0}, {1, 0}, 1};
        assert_ok(dem2d_shape_create_bezier(NULL, control,
                                            make_control(&chains[2], angle, 0, control), &stadium));
        const dem2d_vec n = vec(-sin(angle), cos(angle)), t = vec(cos(angle), sin(angle));
        const double apart = 1 - depth;
        const dem2d_pose b = {{apart * n.x + x * t.x, apart * n.y + x * t.y}, {1, 0}, 1};
        assert_ok(dem2d_pair_contact(stadium, a, stadium, b, NULL, &c));
        assert_within(c.depth, depth, 1e-14L);
        assert_within(c.normal.x, n.x, 1e-14L);
        assert_within(c.normal.y, n.y, 1e-14L);
        assert_int_equal(c.count, 2);
        const dem2d_vec p = c.points[0].position, q = c.points[1].position;
        assert_within(hypot(p.x - q.x, p.y - q.y), 2 - x, 1e-13L);
        assert_ok(dem2d_shape_create_bezier(NULL, control,
                                            make_control(&chains[1], angle, 0, control), &half));
        dem2d_support low;
        assert_ok(dem2d_shape_support(half, a, vec(-t.x, -t.y), &low));
        const double height = low.value - depth;
        assert_ok(dem2d_wall_contact(half, a, vec(-height * t.x, -height * t.y), t, &c));
        assert_within(c.depth, depth, 1e-14L);
        assert_int_equal(c.count, 2);
        dem2d_shape_destroy(stadium);
        dem2d_shape_destroy(half);
    }
}

/* A triangle whose corners are arcs of 1e-13 to 1e-6: its depth in a circle about a corner. */
static void tiny_arcs_are_corners(void **state) {
    (void)state;
    const dem2d_vec corner[3] = {{0, 0}, {2, 0}, {0.5, 1.5}};
    for (int i = 6; i <= 13; i++) {
        const double cut = pow(10, -i);
        dem2d_vec control[18];
        for (int k = 0; k < 3; k++) {
            const dem2d_vec o = corner[k], p = corner[(k + 2) % 3], q = corner[(k + 1) % 3];
            const dem2d_vec in = vec(o.x + cut * (p.x - o.x), o.y + cut * (p.y - o.y));
            const dem2d_vec out = vec(o.x + cut * (q.x - o.x), o.y + cut * (q.y - o.y));
            const dem2d_vec far = vec(q.x + cut * (o.x - q.x), q.y + cut * (o.y - q.y));
            control[6 * k] = in;
            control[6 * k + 1] = vec((in.x + 2 * o.x) / 3, (in.y + 2 * o.y) / 3);
            control[6 * k + 2] = vec((out.x + 2 * o.x) / 3, (out.y + 2 * o.y) / 3);
            control[6 * k + 3] = out;
            control[6 * k + 4] = vec((2 * out.x + far.x) / 3, (2 * out.y + far.y) / 3);
            control[6 * k + 5] = vec((out.x + 2 * far.x) / 3, (out.y + 2 * far.y) / 3);
        }
        dem2d_shape *shape, *circle;
        dem2d_shape_info info;
        assert_ok(dem2d_shape_create_bezier(NULL, control, 6, &shape));
        assert_ok(dem2d_shape_get(shape, &info));
        assert_int_equal(info.count, 6);
        assert_near(info.mass.area, 1.5L, 10 * cut + 1e-14L);
        assert_ok(dem2d_shape_create_circle(NULL, 0.5, &circle));
        const dem2d_pose a = {info.offset, {1, 0}, 1}, b = {{-0.3, -0.1}, {1, 0}, 1};
        dem2d_contact c;
        assert_ok(dem2d_pair_contact(shape, a, circle, b, NULL, &c));
        assert_within(c.depth, 0.5L - hypotl(0.3L, 0.1L), c.error + 2 * cut);
        dem2d_shape_destroy(shape);
        dem2d_shape_destroy(circle);
    }
}

/* Sides that bend by 1e-16 to 1e-4: made, and quickly; a circle on them is met where it is. */
static void nearly_straight_arcs(void **state) {
    (void)state;
    for (int i = 4; i <= 16; i++) {
        dem2d_vec control[3 * ARCS];
        const double bend = pow(10, -i);
        (void)make_control(&chains[2], 0, 0, control);
        control[1].y = control[2].y = -0.5 - bend; /* and knots that stay smooth */
        control[11].y = -0.5 + 0.6 / 0.7 * bend, control[4].y = -0.5 + 0.6 / 0.7 * bend;
        dem2d_shape *shape, *circle;
        dem2d_shape_info info;
        assert_ok(dem2d_shape_create_bezier(NULL, control, 4, &shape));
        assert_ok(dem2d_shape_get(shape, &info));
        assert_ok(dem2d_shape_create_circle(NULL, 0.4, &circle));
        for (int k = -4; k <= 4; k++) {
            const dem2d_pose a = {info.offset, {1, 0}, 1}, b = {{0.2 * k, -0.85}, {1, 0}, 1};
            dem2d_contact c;
            assert_ok(dem2d_pair_contact(shape, a, circle, b, NULL, &c));
            assert_within(c.depth, 0.05L, bend + c.error + 1e-14L);
            assert_within(c.point_a.x, 0.2L * k, 1e-5L + 2 * bend);
            assert_within(c.point_a.y, -0.5L, 2 * bend + 1e-14L);
        }
        dem2d_shape_destroy(shape);
        dem2d_shape_destroy(circle);
    }
}

/* Lengths times 2^k: the same bits, whatever was put right. */
static void scaled_to_the_bit(void **state) {
    (void)state;
    for (int i = 0; i < COUNT_OF(chains); i++)
        for (int digits = 0; digits <= 7; digits += 7) {
            dem2d_vec control[3 * ARCS];
            dem2d_contact c[2];
            const int arcs = make_control(&chains[i], 0.37, digits, control);
            for (int k = 0; k < 2; k++) {
                const double scale = k == 0 ? 1 : 0x1p-180;
                for (int j = 0; j < 3 * arcs; j++)
                    control[j] = vec(scale * control[j].x, scale * control[j].y);
                dem2d_shape *shape;
                assert_ok(dem2d_shape_create_bezier(NULL, control, arcs, &shape));
                const dem2d_pose a = {{0, 0}, {1, 0}, 1},
                                 b = {{scale * 0.9, scale * 1.1}, {0, 1}, 1};
                assert_ok(dem2d_pair_contact(shape, a, shape, b, NULL, &c[k]));
                dem2d_shape_destroy(shape);
            }
            assert_same_bits(c[1].depth, c[0].depth * 0x1p-180);
            assert_same_bits(c[1].error, c[0].error * 0x1p-180);
            assert_same_bits(c[1].point_a.x, c[0].point_a.x * 0x1p-180);
            assert_same_bits(c[1].normal.x, c[0].normal.x);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(questions_of_given_arcs), cmocka_unit_test(circles_within_the_error),
        cmocka_unit_test(straight_arcs_are_faces), cmocka_unit_test(tiny_arcs_are_corners),
        cmocka_unit_test(nearly_straight_arcs),    cmocka_unit_test(scaled_to_the_bit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
