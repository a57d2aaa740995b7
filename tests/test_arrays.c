/* Queries of many pairs at once: the answers of the single query, whatever is in the memories; and
   the straight paths for what was in contact before: the bits of the search that they leave out. */
#define DEM2D_STATIC /* only what is called is compiled, which is a quarter */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "testing.h"
#include "contact_cases.h"

enum { PAIRS = 160, STEPS = 12 };

static pool all;

static int create_pool(void **state) {
    (void)state;
    pool_draw(&all, 3);
    return 0;
}

static int destroy_pool(void **state) {
    (void)state;
    pool_destroy(&all);
    return 0;
}

/* Pairs of all kinds, which move, and what is asked of them. */
typedef struct crowd {
    scene scenes[PAIRS];
    dem2d_body bodies[2 * PAIRS];
    dem2d_body_pair pairs[PAIRS];
    dem2d_contact_memory memory[PAIRS];
    dem2d_overlap overlaps[PAIRS];
    dem2d_contact contacts[PAIRS];
} crowd;

static void crowd_place(crowd *c) {
    for (int i = 0; i < PAIRS; i++) {
        const pair *p = &c->scenes[i].p;
        c->bodies[2 * i] = (dem2d_body){p->a->shape, p->pose_a};
        c->bodies[2 * i + 1] = (dem2d_body){p->b->shape, p->pose_b};
        c->pairs[i] = (dem2d_body_pair){2 * i, 2 * i + 1};
    }
}

static void crowd_draw(crowd *c, int first, uint64_t *d) {
    memset(c, 0, sizeof *c);
    for (int i = 0; i < PAIRS; i++) {
        const int k = first + i;
        const model *a = &all.models[k % KINDS][random_below(d, VARIANTS)];
        const model *b = &all.models[k / KINDS % KINDS][random_below(d, VARIANTS)];
        const int way = random_below(d, 2) ? CHOSEN : random_below(d, WAYS);
        c->scenes[i] = scene_draw(a, b, way, d);
    }
    crowd_place(c);
}

/* Each B moves and turns by up to a part of its size. */
static void crowd_move(crowd *c, double part, uint64_t *d) {
    for (int i = 0; i < PAIRS; i++) {
        pair *p = &c->scenes[i].p;
        const double size = part * fmin(p->pose_a.scale, p->pose_b.scale);
        p->pose_b.position.x += size * random_between(d, -1, 1);
        p->pose_b.position.y += size * random_between(d, -1, 1);
        const double angle = dem2d_rot_angle(p->pose_b.rotation) + part * random_between(d, -1, 1);
        p->pose_b.rotation = dem2d_rot_make(angle);
    }
    crowd_place(c);
}

static void crowd_ask(crowd *c, const dem2d_contact_desc *desc) {
    assert_ok(dem2d_pairs_contact(NULL, c->bodies, 2 * PAIRS, c->pairs, PAIRS, desc, c->memory,
                                  c->overlaps, c->contacts));
}

static dem2d_contact ask_one(const pair *p, const dem2d_contact_desc *desc) {
    dem2d_contact c;
    assert_ok(dem2d_pair_contact(p->a->shape, p->pose_a, p->b->shape, p->pose_b, desc, &c));
    return c;
}

static void expect(const char *flaw, const scene *s, const dem2d_contact *c, int line) {
    if (flaw == NULL) return;
    print_scene(s);
    print_answer("array", c, &s->p);
    print_error("%s\n", flaw);
    _fail(__FILE__, line);
}
#define EXPECT_NONE(flaw, s, c) expect((flaw), (s), (c), __LINE__)
#define EXPECT(holds, s, c) expect((holds) ? NULL : #holds, (s), (c), __LINE__)

/* Both bound the same depth, and agree about its sign where it is outside both errors. */
static void check_same(const scene *s, const dem2d_contact *one, const dem2d_contact *c) {
    const double slack = one->error + c->error + 2 * depth_slack(&s->p);
    EXPECT(fabs(one->depth - c->depth) <= slack, s, c);
    if (one->state == DEM2D_UNRESOLVED || c->state == DEM2D_UNRESOLVED) return;
    if (fabs(one->depth) > slack) EXPECT(one->state == c->state, s, c);
}

/* The short answer is a part of the long one. */
static void check_short(const scene *s, const dem2d_contact *c, const dem2d_overlap *o) {
    EXPECT(memcmp(&o->normal, &c->normal, sizeof o->normal) == 0, s, c);
    EXPECT(memcmp(&o->point, &c->point, sizeof o->point) == 0, s, c);
    EXPECT(o->depth == c->depth && o->error == c->error && o->state == c->state, s, c);
}

static void check_crowd(crowd *c, const dem2d_contact_desc *desc) {
    const double tolerance = desc != NULL && desc->tolerance > 0 ? desc->tolerance : 1e-10;
    const dem2d_solver solver = desc != NULL ? desc->solver : DEM2D_CERTIFIED;
    crowd_ask(c, desc);
    for (int i = 0; i < PAIRS; i++) {
        const scene *s = &c->scenes[i];
        const dem2d_contact one = ask_one(&s->p, desc);
        check_same(s, &one, &c->contacts[i]);
        if (desc == NULL || !desc->skip_points)
            EXPECT_NONE(answer_flaw(&s->p, &c->contacts[i], tolerance, solver), s, &c->contacts[i]);
        check_short(s, &c->contacts[i], &c->overlaps[i]);
    }
}

/* --- answers ---------------------------------------------------------------------------------- */

/* With memories of the last step, which was near or far. */
static void test_warm(void **state) {
    static const double parts[] = {0, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1};
    static crowd c;
    uint64_t d = 11;
    (void)state;
    for (int round = 0; round < COUNT_OF(parts); round++) {
        dem2d_contact_desc desc = {0};
        desc.tolerance = round % 2 ? 1e-8 : 0;
        crowd_draw(&c, 7 * round, &d);
        for (int k = 0; k < STEPS; k++) {
            check_crowd(&c, &desc);
            crowd_move(&c, parts[round], &d);
        }
    }
}

/* Whatever is in a memory: of another pair, numbers that are none, features of any size. */
static void test_garbage(void **state) {
    static const double numbers[] = {0, 1, -1, 1e300, -1e-300, HUGE_VAL, -HUGE_VAL, (double)NAN};
    static const int features[] = {0, 1, -1, 2, 3, 7, 1000, INT_MAX, INT_MIN};
    static crowd c;
    uint64_t d = 12;
    (void)state;
    for (int k = 0; k < 4 * STEPS; k++) {
        if (k % 8 == 0) crowd_draw(&c, 5 * k, &d);
        crowd_ask(&c, NULL);
        const dem2d_contact_memory first = c.memory[0];
        for (int i = 0; i < PAIRS; i++) {
            dem2d_contact_memory *m = &c.memory[i];
            if (k % 4 == 0) *m = i + 1 < PAIRS ? c.memory[i + 1] : first;
            if (k % 4 == 1) m->normal = dem2d_pose_make(1, 0, 0, 1).position;
            if (k % 4 == 2)
                m->normal = vec(numbers[random_below(&d, COUNT_OF(numbers))],
                                numbers[random_below(&d, COUNT_OF(numbers))]);
            if (k % 4 == 3) m->normal = vec(-m->normal.x, -m->normal.y);
            for (int j = 0; j < 3 && k % 4 > 0; j++)
                m->feature[j] = features[random_below(&d, COUNT_OF(features))];
        }
        check_crowd(&c, NULL);
    }
}

/* GJK and EPA, a cap, a start. */
static void test_options(void **state) {
    static crowd c;
    uint64_t d = 13;
    (void)state;
    for (int k = 0; k < 4; k++) {
        dem2d_contact_desc desc = {0};
        crowd_draw(&c, 3 * k, &d);
        if (k == 1) desc.start = vec(0.6, 0.8);
        if (k == 2) desc.solver = DEM2D_GJK_EPA;
        if (k == 3) desc.skip_points = true;
        for (int step = 0; step < 3; step++) {
            check_crowd(&c, &desc);
            for (int i = 0; i < PAIRS && k == 3; i++) assert_int_equal(c.contacts[i].count, 0);
            crowd_move(&c, 1e-3, &d);
        }
    }
}

/* Without a memory an answer has the bits of the single query, alone or with the others, whatever
   else is wanted. */
static void test_bits(void **state) {
    static crowd c;
    static dem2d_overlap overlaps[PAIRS];
    static dem2d_contact contacts[PAIRS];
    uint64_t d = 14;
    (void)state;
    for (int k = 0; k < 4; k++) {
        crowd_draw(&c, 11 * k, &d);
        crowd_ask(&c, NULL);
        assert_ok(dem2d_pairs_contact(NULL, c.bodies, 2 * PAIRS, c.pairs, PAIRS, NULL, NULL,
                                      overlaps, NULL));
        assert_ok(dem2d_pairs_contact(NULL, c.bodies, 2 * PAIRS, c.pairs, PAIRS, NULL, NULL, NULL,
                                      contacts));
        for (int i = 0; i < PAIRS; i++) {
            const scene *s = &c.scenes[i];
            const dem2d_contact one = ask_one(&s->p, NULL);
            check_short(s, &one, &c.overlaps[i]);
            check_short(s, &one, &overlaps[i]);
            check_short(s, &contacts[i], &overlaps[i]);
            EXPECT(one.count == contacts[i].count && one.proof == contacts[i].proof, s, &one);
            for (int j = 0; j < one.count; j++)
                EXPECT(one.points[j].depth == contacts[i].points[j].depth &&
                           one.points[j].position.x == contacts[i].points[j].position.x,
                       s, &one);
        }
    }
}

/* Rotations of any length, bodies in several pairs, no pairs at all. */
static void test_bodies(void **state) {
    static crowd c;
    static dem2d_overlap overlaps[PAIRS];
    uint64_t d = 15;
    (void)state;
    crowd_draw(&c, 0, &d);
    crowd_ask(&c, NULL);
    for (int i = 0; i < 2 * PAIRS; i++) {
        dem2d_rot *q = &c.bodies[i].pose.rotation;
        const double length = i % 3 ? 1 : ldexp(1, 2 + i % 5); /* exact */
        q->c *= length, q->s *= length;
    }
    memset(c.memory, 0, sizeof c.memory);
    assert_ok(dem2d_pairs_contact(NULL, c.bodies, 2 * PAIRS, c.pairs, PAIRS, NULL, c.memory,
                                  overlaps, NULL));
    for (int i = 0; i < PAIRS; i++) {
        const scene *s = &c.scenes[i];
        const double slack = 2 * (c.overlaps[i].error + overlaps[i].error + depth_slack(&s->p));
        EXPECT(fabs(overlaps[i].depth - c.overlaps[i].depth) <= slack, s, &c.contacts[i]);
    }
    for (int i = 0; i < PAIRS; i++) c.pairs[i] = (dem2d_body_pair){i + 1, i};
    crowd_place(&c);
    for (int i = 0; i < PAIRS; i++) c.pairs[i] = (dem2d_body_pair){i + 1, i};
    crowd_ask(&c, NULL);
    for (int i = 0; i < PAIRS; i++) {
        const dem2d_body *a = &c.bodies[i + 1], *b = &c.bodies[i];
        dem2d_contact one;
        assert_ok(dem2d_pair_contact(a->shape, a->pose, b->shape, b->pose, NULL, &one));
        assert_true(fabs(one.depth - c.overlaps[i].depth) <= one.error + c.overlaps[i].error);
    }
    assert_ok(dem2d_pairs_contact(NULL, c.bodies, 0, c.pairs, 0, NULL, NULL, overlaps, NULL));
}

/* What is refused leaves all as it was, and says what is wrong. */
static void check_refused(crowd *c, dem2d_result wanted, const char *text) {
    static crowd before;
    test_env env;
    test_env_init(&env);
    before = *c;
    assert_result(dem2d_pairs_contact(&env.env, c->bodies, 2 * PAIRS, c->pairs, PAIRS, NULL,
                                      c->memory, c->overlaps, c->contacts),
                  wanted);
    assert_memory_equal(&before, c, sizeof before);
    assert_non_null(strstr(env.log.text, text));
}

static void test_refused(void **state) {
    static crowd c;
    uint64_t d = 16;
    (void)state;
    crowd_draw(&c, 0, &d);
    crowd_ask(&c, NULL);
    const dem2d_body body = c.bodies[7];
    const dem2d_body_pair couple = c.pairs[9];
    dem2d_body *at = &c.bodies[7];
    at->shape = NULL, check_refused(&c, DEM2D_NULL_ARGUMENT, "bodies[7].shape"), *at = body;
    at->pose.position.y = (double)NAN;
    check_refused(&c, DEM2D_NOT_FINITE, "bodies[7].pose"), *at = body;
    at->pose.rotation.c = HUGE_VAL;
    check_refused(&c, DEM2D_NOT_FINITE, "bodies[7].pose"), *at = body;
    at->pose.rotation.c = at->pose.rotation.s = 0;
    check_refused(&c, DEM2D_OUT_OF_RANGE, "bodies[7].pose"), *at = body;
    at->pose.scale = 0, check_refused(&c, DEM2D_OUT_OF_RANGE, "scale 0"), *at = body;
    at->pose.scale = 1e-200, check_refused(&c, DEM2D_OUT_OF_RANGE, "bodies[7]: radius");
    at->pose.scale = 1e200, check_refused(&c, DEM2D_OUT_OF_RANGE, "bodies[7]: radius"), *at = body;
    at->pose.position.x = -1e200;
    check_refused(&c, DEM2D_OUT_OF_RANGE, "at (-1e+200"), *at = body;
    static const int wrong[][2] = {{-1, 0}, {0, 2 * PAIRS}, {INT_MIN, INT_MAX}, {5, 5}};
    for (int i = 0; i < COUNT_OF(wrong); i++) {
        c.pairs[9] = (dem2d_body_pair){wrong[i][0], wrong[i][1]};
        check_refused(&c, DEM2D_OUT_OF_RANGE, "pairs[9]");
    }
    c.pairs[9] = couple;
    crowd_ask(&c, NULL);
    assert_result(
        dem2d_pairs_contact(NULL, c.bodies, 2 * PAIRS, c.pairs, PAIRS, NULL, c.memory, NULL, NULL),
        DEM2D_NULL_ARGUMENT);
}

/* As large and as small as is allowed: no squares that overflow or vanish. */
static void test_extremes(void **state) {
    static const double scales[][2] = {{1e-137, 0}, {4e-138, 1e-138}, {1e152, 0}, {1e152, 9e152}};
    uint64_t d = 17;
    (void)state;
    for (int k = 0; k < COUNT_OF(scales); k++)
        for (int kind = 0; kind < KINDS; kind++) {
            const model *m = &all.models[kind][random_below(&d, VARIANTS)];
            const double radius = m->info.circumscribed, scale = scales[k][0] / radius;
            const double at = scales[k][1];
            const dem2d_body two[2] = {{m->shape, dem2d_pose_make(-at, -at, 1, scale)},
                                       {m->shape, dem2d_pose_make(at + 0.1 * scale, at, 2, scale)}};
            const dem2d_body_pair one = {0, 1};
            dem2d_overlap o;
            dem2d_contact c;
            assert_ok(dem2d_pairs_contact(NULL, two, 2, &one, 1, NULL, NULL, &o, NULL));
            assert_ok(
                dem2d_pair_contact(two[0].shape, two[0].pose, two[1].shape, two[1].pose, NULL, &c));
            assert_true(isfinite(o.depth) && o.depth == c.depth);
        }
}

/* --- straight paths --------------------------------------------------------------------------- */

static dem2di_pair private_pair(const pair *p) {
    return dem2di_pair_make(p->a->shape, &p->pose_a, p->b->shape, &p->pose_b);
}

static bool same_bits(double a, double b) {
    return memcmp(&a, &b, sizeof a) == 0;
}

static bool same_vecs(dem2d_vec a, dem2d_vec b) {
    return same_bits(a.x, b.x) && same_bits(a.y, b.y);
}

/* The same query of one pair, not in a tile. */
static dem2d_contact ask_apart(const pair *p, const dem2d_contact_memory *memory,
                               const dem2d_contact_desc *used) {
    dem2d_contact c;
    dem2di_pair one = private_pair(p);
    dem2di_feature feature;
    dem2di_search search;
    const dem2d_vec start = dem2di_memory_start(&one, memory, used->start, &feature);
    dem2di_feature_clear(&search);
    dem2di_query_solve(&one, used, &feature, start, &search);
    dem2di_contact_report(&one, &search, &p->pose_a, &p->pose_b, used->skip_points, &c);
    return c;
}

/* Pairs that go on are answered in tiles: with the bits of one pair alone, whatever is wanted. */
static void test_tiles(void **state) {
    static const double parts[] = {0, 1e-8, 1e-6, 1e-5, 1e-4};
    static crowd c;
    static dem2d_contact_memory before[PAIRS], after[PAIRS];
    static dem2d_overlap overlaps[PAIRS];
    int all_pairs = 0, calls_of_one = 0, by_arc = 0;
    uint64_t d = 19;
    (void)state;
    for (int round = 0; round < 4 * COUNT_OF(parts); round++) {
        dem2d_contact_desc desc = {0}, used;
        desc.tolerance = round % 2 ? 1e-8 : 0;
        assert_ok(dem2di_contact_desc_used(NULL, &desc, &used));
        crowd_draw(&c, 7 * round, &d);
        for (int k = 0; k < STEPS / 2; k++) {
            memcpy(before, c.memory, sizeof before);
            memcpy(after, c.memory, sizeof after);
            crowd_ask(&c, &desc);
            assert_ok(dem2d_pairs_contact(NULL, c.bodies, 2 * PAIRS, c.pairs, PAIRS, &desc, after,
                                          overlaps, NULL));
            for (int i = 0; i < PAIRS; i++) {
                const scene *s = &c.scenes[i];
                const dem2d_contact one = ask_apart(&s->p, &before[i], &used);
                const dem2d_contact *got = &c.contacts[i];
                const bool round_pair = s->p.a->kind == CIRCLE && s->p.b->kind == CIRCLE;
                check_short(s, &one, &c.overlaps[i]);
                check_short(s, got, &overlaps[i]);
                EXPECT(round_pair || same_vecs(after[i].normal, c.memory[i].normal), s, got);
                EXPECT(round_pair || memcmp(after[i].feature, c.memory[i].feature,
                                            sizeof after[i].feature) == 0,
                       s, got);
                EXPECT(one.proof == got->proof && one.support_calls == got->support_calls &&
                           one.iterations == got->iterations && one.count == got->count,
                       s, got);
                EXPECT(same_vecs(one.point_a, got->point_a) && same_vecs(one.point_b, got->point_b),
                       s, got);
                EXPECT(memcmp(one.points, got->points, sizeof one.points) == 0, s, got);
                all_pairs++, calls_of_one += k > 0 && got->support_calls == 1;
                by_arc += k > 0 && got->support_calls == 1 && got->proof == DEM2D_BY_ARC;
            }
            crowd_move(&c, parts[round % COUNT_OF(parts)], &d);
        }
    }
    print_message("%d of %d after one evaluation, %d by arcs\n", calls_of_one, all_pairs, by_arc);
    assert_true(calls_of_one > all_pairs / 4 && by_arc > 100);
}

/* Runs of circles of all lengths, some with centres that are in one point or nearly so. */
static void test_circles(void **state) {
    enum { MOST = 11 };
    static const double apart[] = {1, 0, 1e-150, 1e-100, 0.5};
    static dem2d_body bodies[MOST + 1];
    static dem2d_body_pair pairs[MOST];
    static dem2d_overlap overlaps[MOST];
    dem2d_shape *circle[2], *square;
    const dem2d_vec corners[4] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    uint64_t d = 20;
    (void)state;
    assert_ok(dem2d_shape_create_circle(NULL, 1, &circle[0]));
    assert_ok(dem2d_shape_create_circle(NULL, 0.3, &circle[1]));
    assert_ok(dem2d_shape_create_polygon(NULL, corners, 4, 0, &square));
    for (int k = 0; k < 4000; k++) {
        const int count = 1 + random_below(&d, MOST), other = random_below(&d, 3 * count);
        double x = 0;
        for (int i = 0; i <= count; i++) {
            bodies[i].shape = circle[random_below(&d, 2)];
            bodies[i].pose =
                dem2d_pose_make(x, x * random_between(&d, -1, 1), i, random_between(&d, 0.5, 2));
            x += apart[random_below(&d, COUNT_OF(apart))] * random_between(&d, 0.5, 3);
        }
        if (other <= count) bodies[other].shape = square;
        for (int i = 0; i < count; i++) pairs[i] = (dem2d_body_pair){i + 1, i};
        assert_ok(
            dem2d_pairs_contact(NULL, bodies, count + 1, pairs, count, NULL, NULL, overlaps, NULL));
        for (int i = 0; i < count; i++) {
            const dem2d_body *a = &bodies[i + 1], *b = &bodies[i];
            const dem2d_overlap *o = &overlaps[i];
            dem2d_contact c;
            assert_ok(dem2d_pair_contact(a->shape, a->pose, b->shape, b->pose, NULL, &c));
            assert_true(same_vecs(o->normal, c.normal) && same_vecs(o->point, c.point));
            assert_true(same_bits(o->depth, c.depth) && same_bits(o->error, c.error));
            assert_int_equal(o->state, c.state);
        }
    }
    dem2d_shape_destroy(circle[0]);
    dem2d_shape_destroy(circle[1]);
    dem2d_shape_destroy(square);
}

/* Smooth shapes that rest by their radius: the whole search from the same start. */
static void test_smooth_path(void **state) {
    static const double parts[] = {1e-9, 1e-7, 1e-6, 1e-5, 1e-4};
    uint64_t d = 18;
    int tried = 0, straight = 0;
    (void)state;
    for (int i = 0; i < 30000; i++) {
        const model *a = &all.models[random_below(&d, KINDS)][random_below(&d, VARIANTS)];
        const model *b = &all.models[random_below(&d, KINDS)][random_below(&d, VARIANTS)];
        if (a->shape->flat || b->shape->flat || (a->kind == CIRCLE && b->kind == CIRCLE)) continue;
        const scene s = scene_draw(a, b, random_below(&d, 2) ? CHOSEN : TOUCHES, &d);
        const double off = parts[random_below(&d, COUNT_OF(parts))] * random_between(&d, -1, 1);
        dem2d_vec start = spot_rounded(spot_turned(s.u, off));
        if (!dem2di_unit(start, &start)) continue;
        const bool detect = random_below(&d, 2);
        dem2di_pair one = private_pair(&s.p), other = one;
        const dem2di_demand demand =
            dem2di_demand_of(&one, random_below(&d, 2) ? 1e-8 : 1e-10, detect);
        dem2di_search search, long_search;
        dem2di_eval eval, long_eval;
        tried++;
        if (!dem2di_smooth_last(&one, start, &demand, &eval, &search)) continue;
        straight++;
        dem2di_eval_smooth(&other, start, &long_eval);
        dem2di_certified(&other, start, &demand, 128, &long_eval, &long_search);
        assert_true(same_vecs(search.normal, long_search.normal));
        assert_true(same_vecs(search.a, long_search.a) && same_vecs(search.b, long_search.b));
        assert_true(same_bits(search.upper, long_search.upper));
        assert_true(same_bits(search.lower, long_search.lower));
        assert_int_equal(search.proof, long_search.proof);
        assert_int_equal(search.iterations, long_search.iterations);
        assert_int_equal(one.calls, other.calls);
    }
    print_message("%d of %d by the straight path\n", straight, tried);
    assert_true(straight > 1000 && straight < tried);
}

/* Polygons whose corner is said to rest alone have no second contact point. Near the limit: far
   ends of edges in contact, or apart, by some units of rounding. */
static void test_corner_alone(void **state) {
    uint64_t d = 19;
    int held = 0, alone = 0, with_two = 0;
    (void)state;
    for (int i = 0; i < 60000; i++) {
        const model *a = &all.models[POLYGON + random_below(&d, 2)][random_below(&d, VARIANTS)];
        const model *b = &all.models[POLYGON + random_below(&d, 2)][random_below(&d, VARIANTS)];
        scene s = scene_draw(a, b, i % 3 == 0 ? PARALLEL : i % 3 == 1 ? CHOSEN : TOUCHES, &d);
        if (random_below(&d, 2)) { /* nearly parallel faces */
            const double hair = random_scale(&d, 1e-17, 1e-2) * (random_below(&d, 2) ? 1 : -1);
            const double angle = dem2d_rot_angle(s.p.pose_b.rotation) + hair;
            s.p.pose_b.rotation = dem2d_rot_make(angle);
        }
        dem2di_pair p = private_pair(&s.p);
        dem2di_search first, search;
        dem2di_feature_clear(&first);
        dem2di_contact_solve(&p, DEM2D_CERTIFIED, NULL, dem2di_centres(&p), 1e-8, 128, true,
                             &first);
        dem2di_feature_clear(&search);
        if (!(first.upper > 0) || !dem2di_edge_last(&p, &first.feature, &search)) continue;
        held++;
        dem2di_second_point second = dem2di_second_none();
        dem2di_pair_second(&p, &search, &second);
        alone += search.alone, with_two += second.energy > 0;
        if (search.alone && second.energy > 0) {
            print_scene(&s);
            fail();
        }
    }
    print_message("%d held, %d of them alone, %d with two points\n", held, alone, with_two);
    assert_true(alone > 1000 && with_two > 500 && alone + with_two <= held);
}

/* The path is taken wherever it can save something: all but a few of the contacts of one point. */
static void test_corner_alone_often(void **state) {
    static const dem2d_vec corners[4] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    dem2d_shape *square;
    uint64_t d = 20;
    int one_point = 0, alone = 0;
    (void)state;
    assert_ok(dem2d_shape_create_polygon(NULL, corners, 4, 0, &square));
    for (int i = 0; i < 20000; i++) {
        const double tilt = random_between(&d, 1e-3, 0.75), depth = random_scale(&d, 1e-6, 1e-3);
        const dem2d_pose a = dem2d_pose_make(0, 0, 0, 1);
        dem2d_pose b = dem2d_pose_make(random_between(&d, -0.9, 0.9), 0, tilt, 1);
        b.position.y = 1 - depth + cos(tilt) + sin(tilt); /* its lowest corner is at 1 - depth */
        dem2di_pair p = dem2di_pair_make(square, &a, square, &b);
        dem2di_search search;
        dem2d_contact_point points[2];
        const dem2di_feature feature = {0, {2, 0}}; /* the upper edge, the lowest corner */
        if (!dem2di_edge_last(&p, &feature, &search)) continue;
        const bool was = search.alone;
        search.alone = false;
        if (dem2di_pair_points(&p, &search, points) == 2) {
            assert_false(was);
            continue;
        }
        one_point++, alone += was;
    }
    dem2d_shape_destroy(square);
    print_message("%d of %d contacts of one point\n", alone, one_point);
    assert_true(one_point > 10000 && alone > 0.99 * one_point);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_warm),         cmocka_unit_test(test_garbage),
        cmocka_unit_test(test_options),      cmocka_unit_test(test_bits),
        cmocka_unit_test(test_bodies),       cmocka_unit_test(test_refused),
        cmocka_unit_test(test_extremes),     cmocka_unit_test(test_smooth_path),
        cmocka_unit_test(test_corner_alone), cmocka_unit_test(test_corner_alone_often),
        cmocka_unit_test(test_tiles),        cmocka_unit_test(test_circles),
    };
    return cmocka_run_group_tests(tests, create_pool, destroy_pool);
}
