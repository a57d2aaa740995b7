/* Polybeziers of every kind against an oracle in long double: ten thousand pairs of the campaign
   fuzz_bezier, and the oracle itself against closed forms and brute force. */
#include "dem2d.h"
#include "testing.h"
#include "bezier_oracle.h"

/* --- the oracle ------------------------------------------------------------------------------ */

/* Agreement of the oracle with a closed form, of the size: a few roundings of long double, and
   those of control points to double where the form does not know them. */
#define ORACLE_TOLERANCE 4e-18L

/* A curve as it is, about the origin; the library is not asked. */
static model bare(const curve *c, double scale) {
    model m = {.kind = BEZIER, .count = c->count, .info = {.circumscribed = 1}};
    for (int i = 0; i < c->count; i++)
        m.points[i] = vec((double)c->q[i].x * scale, (double)c->q[i].y * scale);
    return m;
}

static pair bare_pair(const model *a, const model *b, double x, double y) {
    pair p = {a, b, still(), still()};
    p.pose_b.position = vec(x, y);
    return p;
}

/* Four arcs of a circle: on it at knots and in the middle of arcs, outside by 2.725e-4 at most;
   areas differ by 2.800e-4 with the handles 0.5522847498. */
static void test_oracle_circle(void **state) {
    (void)state;
    curve c = {0};
    curve_circle(&c, spot_make(0, 0), 1, 0, 2 * CASE_PI, 4);
    model m = bare(&c, 1);
    real most = 0;
    for (int i = 0; i < 8; i++) {
        const spot u = spot_turned(spot_make(1, 0), i * CASE_PI / 4);
        assert_within(spot_dot(model_support(&m, u), u), 1, 2 * DBL_EPSILON);
    }
    for (int i = 0; i < 20000; i++) {
        const spot u = spot_turned(spot_make(1, 0), i * CASE_PI / 10000);
        most = fmaxl(most, spot_dot(model_support(&m, u), u) - 1);
    }
    assert_within(most, 2.725e-4, 1e-7);
    const real k = 0.5522847498L, area = grain_moments(&m).area;
    /* of a quarter, by the control points (1, 0), (1, k), (k, 1), (0, 1): 1/2 + 3k/5 - 3k^2/20 */
    assert_within(area, 4 * (0.5L + 3 * k / 5 - 3 * k * k / 20), 1e-10);
    assert_within(area / CASE_PI - 1, 2.800e-4, 1e-7);
}

/* A parabola y = 1 - x^2 for |x| <= 1 and its mirror image: cubic arcs hold it exactly. From the
   origin the outline is sqrt(3)/2 away, at x^2 = 1/2; from (0, 3) its top, from (3, 0) its tip. */
static void test_oracle_lens(void **state) {
    (void)state;
    curve c = {0};
    curve_arc(&c, spot_make(-1, 0), spot_make(-1 / 3.0L, -4 / 3.0L),
              spot_make(1 / 3.0L, -4 / 3.0L));
    curve_arc(&c, spot_make(1, 0), spot_make(1 / 3.0L, 4 / 3.0L), spot_make(-1 / 3.0L, 4 / 3.0L));
    model m = bare(&c, 3);
    const pair middle = bare_pair(&m, NULL, 0, 0), above = bare_pair(&m, NULL, 0, 9);
    const pair beside = bare_pair(&m, NULL, 9, 0);
    const truth t = find_truth(&middle);
    assert_within(t.depth, 3 * sqrtl(3) / 2, 3 * ORACLE_TOLERANCE);
    assert_within(t.lower, 3 * sqrtl(3) / 2, 3e-17L * 4);
    assert_within(find_truth(&above).depth, -6, 12 * ORACLE_TOLERANCE);
    assert_within(find_truth(&beside).depth, -6, 12 * ORACLE_TOLERANCE);
    assert_within(grain_moments(&m).area, 9 * 8 / 3.0L, 9 * 10 * ORACLE_TOLERANCE);
    assert_within(grain_moments(&m).polar, 81 * (32 / 105.0L * 2 + 8 / 15.0L),
                  81 * 10 * ORACLE_TOLERANCE);
}

/* Four straight arcs are a square: the same depths as of polygons, in all turns and places. */
static void test_oracle_square(void **state) {
    (void)state;
    uint64_t d = 7;
    for (int i = 0; i < 200; i++) {
        curve c = {0};
        model sharp = {.kind = POLYGON, .count = 4, .info = {.circumscribed = 2}};
        for (int k = 0; k < 4; k++) {
            const spot corner = spot_make(k == 0 || k == 3 ? -1 : 1, k < 2 ? -1 : 1);
            const spot next = spot_make(k < 2 ? 1 : -1, k == 1 || k == 2 ? 1 : -1);
            curve_straight(&c, corner, next, &d);
            sharp.points[k] = spot_rounded(corner);
        }
        model square = bare(&c, 1);
        pair p = bare_pair(&square, &square, random_between(&d, -3, 3), random_between(&d, -3, 3));
        p.pose_b.rotation = draw_rotation(&d);
        pair q = p;
        q.a = q.b = &sharp;
        assert_within(find_truth(&p).depth, find_truth(&q).depth, 12 * ORACLE_TOLERANCE);
    }
}

/* No direction of a hundred thousand has a lower support value than the proof says, and the lowest
   one, followed downhill, comes to the depth. */
static void test_oracle_brute_force(void **state) {
    (void)state;
    const int directions = 100000, pairs = test_long() ? 120 : 12;
    static grain a, b;
    uint64_t d = 11;
    for (int i = 0; i < pairs; i++) {
        grain_draw(&a, i % CURVES, random_bits(&d));
        grain_draw(&b, random_below(&d, CURVES), random_bits(&d));
        if (a.m.shape != NULL && b.m.shape != NULL) {
            const pair p = pair_draw(&a.m, a.size, &b.m, b.size, &d);
            const truth t = find_truth(&p);
            const real size = pair_size(&p);
            real least = HUGE_VALL, step = 2 * CASE_PI / directions, best = 0;
            for (int k = 0; k < directions; k++) {
                const real h = pair_value(&p, spot_turned(spot_make(1, 0), k * step));
                if (h < least) least = h, best = k * step;
            }
            assert_true(least >= t.lower - 1e-18L * size);
            for (; step > 1e-20L; step *= 0.7L)
                for (int side = -1; side <= 1; side += 2) {
                    const real h = pair_value(&p, spot_turned(spot_make(1, 0), best + side * step));
                    if (h < least) least = h, best += side * step;
                }
            assert_within(least, t.depth, 1e-15L * size);
            assert_within(t.lower, t.depth, 1e-15L * size);
        }
        dem2d_shape_destroy(a.m.shape);
        dem2d_shape_destroy(b.m.shape);
    }
}

/* --- the library ----------------------------------------------------------------------------- */

static void test_campaign(void **state) {
    (void)state;
    static campaign all;
    all.series = 2, all.printed = 1;
    campaign_run(&all, 0, 10000);
    assert_int_equal(all.failures, 0);
    for (int k = 0; k < CURVES; k++) assert_true(all.rows[k][AS_DOUBLE].pairs > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_oracle_circle), cmocka_unit_test(test_oracle_lens),
        cmocka_unit_test(test_oracle_square), cmocka_unit_test(test_oracle_brute_force),
        cmocka_unit_test(test_campaign),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
