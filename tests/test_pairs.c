/* Contacts of every ordered pair of shape models, with both solvers, against a search in long
   double that proves what it finds (contact_cases.h), exact integer arithmetic for polygons, and
   what must not change when the same pair is swapped, turned, scaled, moved or asked again. */
#include "dem2d.h"
#include "testing.h"
#include "contact_cases.h"

static pool all;

static int create_pool(void **state) {
    (void)state;
    pool_draw(&all, 1);
    return 0;
}

static int destroy_pool(void **state) {
    (void)state;
    pool_destroy(&all);
    return 0;
}

static const model *any(int kind, uint64_t *d) {
    return &all.models[kind][random_below(d, VARIANTS)];
}

/* --- asking, and failing so that it can be done again ---------------------------------------- */

static dem2d_contact ask(const pair *p, const dem2d_contact_desc *desc) {
    dem2d_contact c;
    assert_ok(dem2d_pair_contact(p->a->shape, p->pose_a, p->b->shape, p->pose_b, desc, &c));
    return c;
}

static dem2d_contact_desc with(dem2d_solver solver, spot start) {
    dem2d_contact_desc desc = {0};
    desc.solver = solver, desc.start = spot_rounded(start);
    return desc;
}

static void expect(const char *flaw, const scene *s, const char *asked, const dem2d_contact *c,
                   int line) {
    if (flaw == NULL) return;
    print_scene(s);
    print_answer(asked, c, &s->p);
    print_error("%s: %s\n", asked, flaw);
    _fail(__FILE__, line);
}
#define EXPECT_NONE(flaw, s, asked, c) expect((flaw), (s), (asked), (c), __LINE__)
#define EXPECT(holds, s, asked, c) expect((holds) ? NULL : #holds, (s), (asked), (c), __LINE__)

/* The same bits but for the sign of a zero, which a turn or a swap changes. */
static bool same(double a, double b) {
    return a == b;
}

static bool same_vec(dem2d_vec a, dem2d_vec b) {
    return same(a.x, b.x) && same(a.y, b.y);
}

/* A solver may give up, at its cap of 128 iterations, only where h is so flat, or has so many least
   directions, that one who knows the depth already needs a third of them to prove it. */
static bool is_flat(const pair *p, const truth *t) {
    return proof_halvings(p, t, CASE_TOLERANCE * pair_size(p)) >= 128 / 3;
}

static const char *direction_flaw(const pair *p, const dem2d_contact *c, double tolerance) {
    const real value = pair_value(p, spot_unit(spot_from(c->normal)));
    return normal_flaw(p, c, value, tolerance, depth_slack(p));
}

static void check_answer(const scene *s, const truth *t, const char *asked, dem2d_solver solver,
                         const dem2d_contact *c) {
    EXPECT_NONE(answer_flaw(&s->p, c, CASE_TOLERANCE, solver), s, asked, c);
    EXPECT_NONE(depth_flaw(c, t->lower, t->depth, depth_slack(&s->p)), s, asked, c);
    EXPECT_NONE(direction_flaw(&s->p, c, CASE_TOLERANCE), s, asked, c);
    EXPECT(c->state != DEM2D_UNRESOLVED || is_flat(&s->p, t), s, asked, c);
}

/* --- every pair in every way ----------------------------------------------------------------- */

enum { ASKED = 1 + 3 + GARBAGE + 1 };

/* Cold, warm, with garbage, and by GJK and EPA. */
static void ask_all(const pair *p, const truth *t, dem2d_contact *answers, const char **names) {
    static const real off[3] = {1e-3L, -1e-6L, 0};
    static const char *const warm[3] = {"warm, 1e-3 off", "warm, 1e-6 off", "warm"};
    int n = 0;
    names[n] = "cold", answers[n++] = ask(p, NULL);
    for (int i = 0; i < 3; i++) {
        const dem2d_contact_desc desc = with(DEM2D_CERTIFIED, spot_turned(t->u, off[i]));
        names[n] = warm[i], answers[n++] = ask(p, &desc);
    }
    for (int i = 0; i < GARBAGE; i++) {
        dem2d_contact_desc desc = {0};
        desc.start = garbage_starts[i];
        if (i == GARBAGE - 1) desc.start = spot_rounded(spot_make(-t->u.x, -t->u.y));
        names[n] = i == GARBAGE - 1 ? "opposite start" : "garbage start";
        answers[n++] = ask(p, &desc);
    }
    const dem2d_contact_desc papers = with(DEM2D_GJK_EPA, spot_make(0, 0));
    names[n] = "GJK and EPA", answers[n++] = ask(p, &papers);
}

/* All normals within the directions that the error bounds, and what a last step leaves, allow,
   where these are close together. */
static void check_normals(const scene *s, const truth *t, const dem2d_contact *answers,
                          const char *const *names) {
    for (int i = 0; i < ASKED; i++) {
        const dem2d_contact *c = &answers[i];
        const real off = fabsl(spot_cross(t->u, spot_from(c->normal)));
        if (c->state == DEM2D_UNRESOLVED) continue;
        if (spot_dot(t->u, spot_from(c->normal)) > 0 && off < 1e-9L) continue;
        const real left = c->error + step_slack(&s->p, CASE_TOLERANCE) + 2 * depth_slack(&s->p);
        const real spread = truth_spread(&s->p, t, left);
        EXPECT(spread > 1 || (spot_dot(t->u, spot_from(c->normal)) > 0 && off <= spread), s,
               names[i], c);
    }
}

static void check_scene(const scene *s, bool surfaces) {
    const truth t = find_truth(&s->p);
    dem2d_contact answers[ASKED];
    const char *names[ASKED];
    ask_all(&s->p, &t, answers, names);
    /* the search and the construction agree, or both are worth nothing */
    if (s->known)
        EXPECT(fabsl(t.depth - s->chosen) <= s->places + 1e-16L * pair_size(&s->p), s, names[0],
               &answers[0]);
    if (s->bounded)
        EXPECT(t.depth <= s->chosen + s->places + 1e-16L * pair_size(&s->p), s, names[0],
               &answers[0]);
    for (int i = 0; i < ASKED; i++) {
        const dem2d_solver solver = i == ASKED - 1 ? DEM2D_GJK_EPA : DEM2D_CERTIFIED;
        check_answer(s, &t, names[i], solver, &answers[i]);
        if (surfaces && (i == 0 || i == 3 || i == ASKED - 1))
            EXPECT_NONE(surface_flaw(&s->p, &answers[i], CASE_TOLERANCE), s, names[i], &answers[i]);
    }
    check_normals(s, &t, answers, names);
}

static void test_every_pair(void **state) {
    (void)state;
    uint64_t d = 101;
    for (int i = 0; i < KINDS * KINDS * WAYS * 2; i++) {
        const model *a = any(i % KINDS, &d), *b = any(i / KINDS % KINDS, &d);
        const scene s = scene_draw(a, b, i / (KINDS * KINDS) % WAYS, &d);
        check_scene(&s, i % 3 == 0);
    }
}

/* The two other questions about the same pairs. */
static void test_overlap_and_distance(void **state) {
    (void)state;
    uint64_t d = 102;
    for (int i = 0; i < KINDS * KINDS * WAYS; i++) {
        const model *a = any(i % KINDS, &d), *b = any(i / KINDS % KINDS, &d);
        const scene s = scene_draw(a, b, i / (KINDS * KINDS), &d);
        const truth t = find_truth(&s.p);
        const real slack = depth_slack(&s.p);
        dem2d_contact c;
        assert_ok(dem2d_pair_overlap(a->shape, s.p.pose_a, b->shape, s.p.pose_b, NULL, &c));
        EXPECT_NONE(depth_flaw(&c, t.lower, t.depth, slack), &s, "overlap", &c);
        EXPECT(c.state != DEM2D_UNRESOLVED, &s, "overlap", &c);
        assert_ok(dem2d_pair_distance(a->shape, s.p.pose_a, b->shape, s.p.pose_b, NULL, &c));
        EXPECT_NONE(depth_flaw(&c, t.lower, t.depth, slack), &s, "distance", &c);
        EXPECT(c.state != DEM2D_UNRESOLVED, &s, "distance", &c);
        if (c.state == DEM2D_SEPARATED) {
            check_answer(&s, &t, "distance", DEM2D_GJK_EPA, &c);
            EXPECT_NONE(surface_flaw(&s.p, &c, CASE_TOLERANCE), &s, "distance", &c);
        }
    }
}

/* --- what must not change -------------------------------------------------------------------- */

static scene swapped(const scene *s) {
    scene q = *s;
    q.p = (pair){s->p.b, s->p.a, s->p.pose_b, s->p.pose_a};
    return q;
}

static scene quarter_turned(const scene *s) {
    scene q = *s;
    dem2d_pose *poses[2] = {&q.p.pose_a, &q.p.pose_b};
    for (int i = 0; i < 2; i++) {
        const dem2d_pose old = *poses[i];
        poses[i]->position = vec(-old.position.y, old.position.x);
        poses[i]->rotation = (dem2d_rot){-old.rotation.s, old.rotation.c};
    }
    return q;
}

static bool same_answer(const dem2d_contact *a, const dem2d_contact *b) {
    bool agree = a->state == b->state && a->proof == b->proof && same(a->depth, b->depth) &&
                 same(a->error, b->error) && same_vec(a->normal, b->normal) &&
                 same_vec(a->point_a, b->point_a) && same_vec(a->point_b, b->point_b) &&
                 a->count == b->count;
    for (int i = 0; agree && i < a->count; i++)
        agree = same_vec(a->points[i].position, b->points[i].position) &&
                same(a->points[i].depth, b->points[i].depth) &&
                same(a->points[i].weight, b->points[i].weight);
    return agree;
}

static dem2d_vec quarter(dem2d_vec v) {
    return vec(-v.y, v.x);
}

static dem2d_vec times(dem2d_vec v, int power) {
    return vec(ldexp(v.x, power), ldexp(v.y, power));
}

/* The answer for the same scene turned by a quarter (power 0) or times 2^power. */
static dem2d_contact carried(const dem2d_contact *c, int power) {
    dem2d_contact r = *c;
    dem2d_vec *vectors[5] = {&r.point_a, &r.point_b, &r.point, &r.points[0].position,
                             &r.points[1].position};
    for (int i = 0; i < 3 + c->count; i++)
        *vectors[i] = power ? times(*vectors[i], power) : quarter(*vectors[i]);
    r.normal = power ? c->normal : quarter(c->normal);
    r.depth = ldexp(c->depth, power), r.error = ldexp(c->error, power);
    for (int i = 0; i < c->count; i++) r.points[i].depth = ldexp(c->points[i].depth, power);
    return r;
}

static void check_carried(const scene *s, const dem2d_contact_desc *desc, const dem2d_contact *c) {
    static const int powers[] = {0, -200, -40, 1, 40, 200};
    for (int k = 0; k < COUNT_OF(powers); k++) {
        if (too_near(&s->p) || (!powers[k] && !has_line(&s->p))) continue;
        const scene q = powers[k] ? scene_scaled(s, powers[k]) : quarter_turned(s);
        dem2d_contact_desc moved = *desc;
        if (!powers[k]) moved.start = quarter(desc->start);
        const dem2d_contact expected = carried(c, powers[k]), got = ask(&q.p, &moved);
        EXPECT(same_answer(&got, &expected), &q, powers[k] ? "scaled" : "turned", &got);
    }
}

/* Swapped, turned by a quarter, scaled by powers of two, and asked again. */
static void check_unchanged(const scene *s, dem2d_solver solver) {
    const truth t = find_truth(&s->p);
    const bool unique = truth_unique(&s->p, &t);
    for (int warm = 0; warm < 2; warm++) {
        dem2d_contact_desc desc = with(solver, spot_make(0, 0));
        if (warm) desc = with(solver, spot_turned(t.u, 1e-3L));
        const dem2d_contact c = ask(&s->p, &desc), again = ask(&s->p, &desc);
        EXPECT(same_answer(&c, &again), s, "again", &again);
        check_carried(s, &desc, &c);
        if (!unique || !has_line(&s->p) || too_near(&s->p)) continue;
        const scene q = swapped(s);
        desc.start = vec(-desc.start.x, -desc.start.y);
        const dem2d_contact r = ask(&q.p, &desc);
        EXPECT_NONE(swap_flaw(&s->p, &c, &r), s, "swapped", &r);
    }
}

static void test_unchanged(void **state) {
    (void)state;
    uint64_t d = 103;
    for (int i = 0; i < KINDS * KINDS * WAYS * 2; i++) {
        const model *a = any(i % KINDS, &d), *b = any(i / KINDS % KINDS, &d);
        const scene s = scene_draw(a, b, i / (KINDS * KINDS) % WAYS, &d);
        check_unchanged(&s, i / (KINDS * KINDS * WAYS) ? DEM2D_GJK_EPA : DEM2D_CERTIFIED);
    }
}

/* Near 1e8, moved there by what doubles hold: not one bit of what is relative changes. */
static void test_moved_far(void **state) {
    (void)state;
    uint64_t d = 104;
    for (int i = 0; i < KINDS * KINDS * 8; i++) {
        const model *a = any(i % KINDS, &d), *b = any(i / KINDS % KINDS, &d);
        const scene far = scene_draw(a, b, REMOTE, &d);
        scene near = far;
        near.p.pose_a.position.x -= 0x1p27, near.p.pose_b.position.x -= 0x1p27;
        near.p.pose_a.position.y += 0x1p26, near.p.pose_b.position.y += 0x1p26;
        const dem2d_contact c = ask(&far.p, NULL), r = ask(&near.p, NULL);
        EXPECT(same(c.depth, r.depth) && same(c.error, r.error), &far, "far", &c);
        EXPECT(same_vec(c.normal, r.normal) && c.state == r.state, &far, "far", &c);
        EXPECT(c.count == r.count && c.support_calls == r.support_calls, &far, "far", &c);
    }
}

/* --- touching -------------------------------------------------------------------------------- */

/* Through an exact touch in growing steps: the state goes from a gap over a touch to an overlap
   and never back, and the depth follows. */
static void test_sweep(void **state) {
    (void)state;
    static const double gaps[] = {1e-9,  1e-10, 1e-11, 1e-12, 1e-13, 3e-14,
                                  1e-14, 6e-15, 3e-15, 1e-15, 2e-16};
    enum { STEPS = 2 * COUNT_OF(gaps) + 1 };
    uint64_t d = 105;
    for (int i = 0; i < KINDS * KINDS * 3; i++) {
        const model *a = any(i % KINDS, &d), *b = any(i / KINDS % KINDS, &d);
        scene s = scene_draw(a, b, TOUCHES, &d);
        const spot u = s.u;
        const double size = pair_size(&s.p);
        dem2d_contact last = {0};
        for (int k = 0; k < STEPS; k++) {
            const int from_end = STEPS - 1 - k;
            const double part = k < COUNT_OF(gaps)          ? -gaps[k]
                                : from_end < COUNT_OF(gaps) ? gaps[from_end]
                                                            : 0;
            scene_place(&s, u, part * size);
            const dem2d_contact_desc desc = with(DEM2D_CERTIFIED, u);
            const dem2d_contact c = ask(&s.p, i % 2 ? &desc : NULL);
            const real slack = depth_slack(&s.p) + s.places;
            EXPECT_NONE(answer_flaw(&s.p, &c, CASE_TOLERANCE, DEM2D_CERTIFIED), &s, "sweep", &c);
            EXPECT(c.depth <= s.chosen + c.error + slack, &s, "sweep", &c);
            if (s.known) EXPECT(c.depth >= s.chosen - c.error - slack, &s, "sweep", &c);
            EXPECT(c.state != DEM2D_UNRESOLVED, &s, "sweep", &c);
            if (part < -1e-14) EXPECT(c.state == DEM2D_SEPARATED, &s, "sweep", &c);
            if (part > 1e-14 && s.known) EXPECT(c.state == DEM2D_PENETRATING, &s, "sweep", &c);
            if (k > 0) EXPECT(c.state >= last.state, &s, "sweep", &c);
            last = c;
        }
    }
}

/* The position of B, moved by single steps of a double. */
static void test_sweep_by_ulps(void **state) {
    (void)state;
    uint64_t d = 106;
    for (int i = 0; i < KINDS * KINDS; i++) {
        scene s = scene_draw(any(i % KINDS, &d), any(i / KINDS, &d), TOUCHES, &d);
        scene_place(&s, s.u, 0);
        dem2d_vec *at = &s.p.pose_b.position;
        const double away_x = s.u.x > 0 ? HUGE_VAL : -HUGE_VAL;
        const double away_y = s.u.y > 0 ? HUGE_VAL : -HUGE_VAL;
        for (int k = 0; k < 40; k++) {
            if (fabsl(s.u.x) > fabsl(s.u.y))
                at->x = nextafter(at->x, away_x);
            else
                at->y = nextafter(at->y, away_y);
            const dem2d_contact c = ask(&s.p, NULL);
            const real h = pair_value(&s.p, s.u); /* the depth, to a square of 40 ulp */
            EXPECT_NONE(answer_flaw(&s.p, &c, CASE_TOLERANCE, DEM2D_CERTIFIED), &s, "ulps", &c);
            EXPECT_NONE(depth_flaw(&c, h, h, depth_slack(&s.p)), &s, "ulps", &c);
        }
    }
}

/* --- polygons, exactly ----------------------------------------------------------------------- */

static const model *integer_polygon(uint64_t *d) {
    for (int i = 0; i < 1000; i++) {
        const model *m = any(POLYGON, d);
        if (m->corners) return m;
    }
    fail_msg("no integer polygon in the pool");
    return NULL;
}

/* The normal of an overlap is that of an edge which the integers call the nearest. */
static bool is_least_edge(const lattice *hull, int count, const bool *least, dem2d_vec normal) {
    for (int i = 0; i < count; i++) {
        const lattice p = hull[i], q = hull[(i + 1) % count];
        const spot n = spot_unit(spot_make((real)(q.y - p.y), (real)(p.x - q.x)));
        const real off = hypotl(n.x - normal.x, n.y - normal.y);
        if (least[i] && off <= 8 * DBL_EPSILON) return true;
    }
    return false;
}

static void test_integer_polygons(void **state) {
    (void)state;
    uint64_t d = 107;
    int touches = 0, overlaps = 0;
    for (int i = 0; i < 6000; i++) {
        const model *a = integer_polygon(&d), *b = integer_polygon(&d);
        const scene s = scene_draw(a, b, ON_LATTICE, &d);
        lattice hull[2 * MODEL_LATTICE * MODEL_LATTICE / 4];
        bool least[2 * MODEL_LATTICE * MODEL_LATTICE / 4];
        const int n = lattice_difference(a, s.turns_a, b, s.turns_b, s.shift, hull);
        /* the library adds up the size in its own way: not the same last bits */
        const real depth = lattice_depth(hull, n, least), slack = 1.001L * depth_slack(&s.p);
        dem2d_contact_desc desc = with(DEM2D_CERTIFIED, random_direction(&d));
        for (int warm = 0; warm < 2; warm++) {
            const dem2d_contact c = ask(&s.p, warm ? &desc : NULL);
            EXPECT_NONE(answer_flaw(&s.p, &c, CASE_TOLERANCE, DEM2D_CERTIFIED), &s, "integer", &c);
            EXPECT(fabsl(c.depth - depth) <= slack && c.error <= slack, &s, "integer", &c);
            EXPECT(c.proof == DEM2D_BY_FORM, &s, "integer", &c);
            EXPECT(c.state == (depth < 0   ? DEM2D_SEPARATED
                               : depth > 0 ? DEM2D_PENETRATING
                                           : DEM2D_TOUCHING),
                   &s, "integer", &c);
            if (depth > 0) EXPECT(is_least_edge(hull, n, least, c.normal), &s, "integer", &c);
        }
        desc = with(DEM2D_GJK_EPA, spot_make(0, 0));
        const dem2d_contact c = ask(&s.p, &desc);
        EXPECT_NONE(depth_flaw(&c, depth, depth, slack), &s, "integer, EPA", &c);
        touches += depth == 0, overlaps += depth > 0;
    }
    assert_true(touches > 200 && overlaps > 200); /* or what matters was not met */
}

/* Polygons, sharp or rounded, and circles: edges and corners, to rounding. */
static void test_closed_forms(void **state) {
    (void)state;
    static const int kinds[3] = {CIRCLE, POLYGON, ROUNDED};
    uint64_t d = 108;
    for (int i = 0; i < 9 * WAYS * 12; i++) {
        const model *a = any(kinds[i % 3], &d), *b = any(kinds[i / 3 % 3], &d);
        const scene s = scene_draw(a, b, i / 9 % WAYS, &d);
        const truth t = find_truth(&s.p);
        const real slack = 1.001L * depth_slack(&s.p);
        const dem2d_contact_desc desc = with(DEM2D_CERTIFIED, random_direction(&d));
        for (int warm = 0; warm < 2; warm++) {
            const dem2d_contact c = ask(&s.p, warm ? &desc : NULL);
            check_answer(&s, &t, "closed form", DEM2D_CERTIFIED, &c);
            /* large polygons far from round may be left to branch and bound, to rounding */
            EXPECT(c.proof == DEM2D_BY_FORM || a->count + b->count > 24, &s, "closed form", &c);
            EXPECT(c.error <= 2 * slack, &s, "closed form", &c);
            EXPECT(fabsl(c.depth - t.depth) <= slack, &s, "closed form", &c);
        }
    }
}

/* --- faces ----------------------------------------------------------------------------------- */

enum { SHARP, ROUND, ARCS, FORMS };
#define CUT 0.125

/* A box with flat sides; its corners are cut by arcs but for SHARP. */
static dem2d_shape *box_shape(int form, double width, double height) {
    const double w = width / 2, h = height / 2, cut = form == SHARP ? 0 : CUT;
    const dem2d_vec core[4] = {
        {-w + cut, -h + cut}, {w - cut, -h + cut}, {w - cut, h - cut}, {-w + cut, h - cut}};
    const double handle = 0.5522847498 * CUT;
    dem2d_vec q[24], n = vec(0, -1); /* outward normal of the side that starts at core[i] */
    dem2d_shape *shape;
    if (form != ARCS) {
        assert_ok(dem2d_shape_create_polygon(NULL, core, 4, cut, &shape));
        return shape;
    }
    for (int i = 0; i < 4; i++) {
        const dem2d_vec p = core[i], e = core[(i + 1) % 4], t = vec(-n.y, n.x);
        const dem2d_vec from = vec(p.x + CUT * n.x, p.y + CUT * n.y);
        const dem2d_vec to = vec(e.x + CUT * n.x, e.y + CUT * n.y);
        const dem2d_vec next = vec(e.x + CUT * t.x, e.y + CUT * t.y);
        q[6 * i] = from;
        q[6 * i + 1] = vec(from.x + (to.x - from.x) / 4, from.y + (to.y - from.y) / 4);
        q[6 * i + 2] = to; /* two control points in one */
        q[6 * i + 3] = to;
        q[6 * i + 4] = vec(to.x + handle * t.x, to.y + handle * t.y);
        q[6 * i + 5] = vec(next.x + handle * n.x, next.y + handle * n.y);
        n = t;
    }
    assert_ok(dem2d_shape_create_bezier(NULL, q, 8, &shape));
    return shape;
}

static dem2d_pose turned_pose(dem2d_rot q, double x, double y) {
    return (dem2d_pose){{q.c * x - q.s * y, q.s * x + q.c * y}, q, 1};
}

/* A box 4 x 2 and one 2 x 1 on top of it, moved along, both turned by q: two contact points, at
   the ends of what the flat sides have in common. */
static void check_faces(int form_a, int form_b, double x, double depth, dem2d_rot q) {
    dem2d_shape *a = box_shape(form_a, 4, 2), *b = box_shape(form_b, 2, 1);
    const double flat_a = form_a == SHARP ? 2 : 2 - CUT, flat_b = form_b == SHARP ? 1 : 1 - CUT;
    const double ends[2] = {fmin(flat_a, x + flat_b), fmax(-flat_a, x - flat_b)};
    for (int swap = 0; swap < 2; swap++) {
        const dem2d_pose pa = turned_pose(q, 0, 0), pb = turned_pose(q, x, 1.5 - depth);
        const double sign = swap ? -1 : 1, slack = 1e-12;
        dem2d_contact c;
        assert_ok(swap ? dem2d_pair_contact(b, pb, a, pa, NULL, &c)
                       : dem2d_pair_contact(a, pa, b, pb, NULL, &c));
        assert_within(c.depth, depth, slack);
        assert_within(c.normal.x, -sign * q.s, slack);
        assert_within(c.normal.y, sign * q.c, slack);
        assert_int_equal(c.count, 2);
        for (int i = 0; i < 2; i++) {
            const dem2d_vec p = c.points[i].position;
            assert_within(q.c * p.x + q.s * p.y, ends[swap ? 1 - i : i], slack);
            assert_within(q.c * p.y - q.s * p.x, 1 - depth / 2, slack);
            assert_within(c.points[i].depth, depth, slack);
        }
        assert_between(c.points[0].weight + c.points[1].weight, 1, 2);
    }
    dem2d_shape_destroy(a);
    dem2d_shape_destroy(b);
}

static void test_faces(void **state) {
    (void)state;
    static const double at[] = {0, 0.5, 1.5, 2.25, -1.75};
    static const double depths[] = {1e-9, 1e-4, 0.02, 0.1};
    for (int i = 0; i < FORMS * FORMS * COUNT_OF(at) * COUNT_OF(depths); i++) {
        const double x = at[i / (FORMS * FORMS) % COUNT_OF(at)];
        const double depth = depths[i / (FORMS * FORMS * COUNT_OF(at))];
        check_faces(i % FORMS, i / FORMS % FORMS, x, depth, (dem2d_rot){1, 0});
        check_faces(i % FORMS, i / FORMS % FORMS, x, depth, (dem2d_rot){0, -1});
        check_faces(i % FORMS, i / FORMS % FORMS, x, depth, dem2d_rot_make(0.3));
    }
}

/* Long faces turned by a hair: the depth is exact, and what the contact points do is continuous
   through the parallel: it changes by no more than the ends of the faces move, and does not jump
   when the last bit of the angle does. */
static void test_nearly_parallel(void **state) {
    (void)state;
    static const double hairs[] = {0, 1e-16, -1e-16, 1e-15, -1e-14, 1e-13, -1e-12, 1e-11, 1e-10};
    for (int form = 0; form < FORMS * FORMS; form++) {
        dem2d_shape *a = box_shape(form % FORMS, 1000, 2), *b = box_shape(form / FORMS, 1000, 2);
        const double flat_a = form % FORMS == SHARP ? 500 : 500 - CUT;
        const double flat_b = form / FORMS == SHARP ? 500 : 500 - CUT;
        real force = 0, moment = 0;
        for (int i = 0; i < COUNT_OF(hairs); i++) {
            dem2d_pose pose = {{100, 1.99}, {1, hairs[i]}, 1};
            dem2d_contact c;
            real f, m;
            assert_ok(dem2d_pair_contact(a, still(), b, pose, NULL, &c));
            sum_points(&c, vec(0, 0), &f, &m);
            assert_int_equal(c.count, 2);
            /* B's left end goes down, or A's right end up, seen from the face of the other */
            const real along = hairs[i] > 0 ? flat_b : flat_a - 100;
            assert_within(c.depth, 0.01L + along * fabsl(hairs[i]), c.error + 1e-12);
            assert_within(c.points[0].position.x, flat_a, 1e-6);
            assert_within(c.points[1].position.x, 100 - flat_b, 1e-6);
            if (i == 0) force = f, moment = m;
            /* two ends that move by 1000 times the hair, with arms of 500 */
            assert_within(f, force, 4000 * fabs(hairs[i]) + 1e-11);
            assert_within(m, moment, 500 * (4000 * fabs(hairs[i]) + 1e-11));
        }
        dem2d_shape_destroy(a);
        dem2d_shape_destroy(b);
    }
}

/* --- degenerate cases with answers in closed form -------------------------------------------- */

/* Squares of half size 1 turned by 45 degrees, tip to tip: any normal of the cone. Upright ones
   corner to corner, and a corner on a side. */
static void test_corners(void **state) {
    (void)state;
    const dem2d_vec diamond[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    static const double gaps[] = {0, 1e-15, 1e-12, 1e-6, 0.5};
    dem2d_shape *tip, *box = box_shape(SHARP, 2, 2);
    assert_ok(dem2d_shape_create_polygon(NULL, diamond, 4, 0, &tip));
    for (int i = 0; i < COUNT_OF(gaps); i++) {
        const double gap = gaps[i], slack = 1e-14;
        dem2d_pose at = still();
        dem2d_contact c;
        at.position = vec(2 + gap, 0);
        assert_ok(dem2d_pair_contact(tip, still(), tip, at, NULL, &c));
        assert_within(c.depth, -gap, slack);
        assert_between(c.normal.x, sqrt(0.5) - 1e-12, 1 + DBL_EPSILON);
        assert_within(c.point.x, 1 + gap / 2, slack);
        assert_within(c.point.y, 0, slack);
        if (i > 2) assert_within(c.normal.y, 0, 1e-9);
        at.position = vec(2 + gap, 2 + gap);
        assert_ok(dem2d_pair_contact(box, still(), box, at, NULL, &c));
        assert_within(c.depth, -gap * sqrtl(2), slack);
        assert_between(fmin(c.normal.x, c.normal.y), -1e-15, 1);
        at.position = vec(2 + gap, 0.5);
        assert_ok(dem2d_pair_contact(box, still(), tip, at, NULL, &c));
        assert_within(c.depth, -gap, slack);
        if (gap < 1e-14) continue; /* at a touch the tip's cone holds other normals as well */
        assert_within(c.normal.x, 1, slack);
        assert_within(c.point.y, 0.5, 1e-12);
    }
    dem2d_shape_destroy(tip);
    dem2d_shape_destroy(box);
}

/* One on itself: the depth is the least width. */
static void test_itself(void **state) {
    (void)state;
    for (int k = 0; k < KINDS * VARIANTS; k++) {
        const model *m = &all.models[k / VARIANTS][k % VARIANTS];
        scene s = {0};
        s.way = CONCENTRIC, s.p = (pair){m, m, still(), still()};
        const truth t = find_truth(&s.p);
        for (int solver = 0; solver < DEM2D_SOLVER_COUNT; solver++) {
            const dem2d_contact_desc desc = with((dem2d_solver)solver, spot_make(0, 0));
            const dem2d_contact c = ask(&s.p, &desc);
            check_answer(&s, &t, solver ? "itself, EPA" : "itself", (dem2d_solver)solver, &c);
            EXPECT(c.state == DEM2D_PENETRATING || c.state == DEM2D_UNRESOLVED, &s, "itself", &c);
        }
    }
    for (int n = 3; n <= 40; n++) { /* n or n/2 least widths */
        dem2d_vec points[40];
        dem2d_shape *shape;
        dem2d_contact c, again;
        for (int i = 0; i < n; i++) points[i] = direction((double)(2 * i * TEST_PI / n));
        assert_ok(dem2d_shape_create_polygon(NULL, points, n, 0, &shape));
        assert_ok(dem2d_pair_contact(shape, still(), shape, still(), NULL, &c));
        assert_ok(dem2d_pair_contact(shape, still(), shape, still(), NULL, &again));
        const real apothem = cosl(TEST_PI / n);
        assert_within(c.depth, n % 2 ? 1 + apothem : 2 * apothem, 4 * CASE_ROUNDING);
        assert_true(same_answer(&c, &again));
        dem2d_shape_destroy(shape);
    }
}

/* Needles of 10,000 to 1 crossed, end to end and side by side, from any start. */
static void test_needles(void **state) {
    (void)state;
    static const dem2d_vec starts[] = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {-1, 1e-8}, {1e150, 3e149}};
    static const struct {
        dem2d_rot turn;
        double x, y, depth;
    } rows[] = {{{0, 1}, 0, 0, 1.0001},     {{0, 1}, 1.0002, 0, -1e-4},  {{0, 1}, 1, 0, 1e-4},
                {{1, 0}, 2.0001, 0, -1e-4}, {{1, 0}, 0, 0, 2e-4},        {{1, 0}, 0, 3e-4, -1e-4},
                {{1, 0}, 0, 1e-4, 1e-4},    {{1, 0}, 0, 1.999e-4, 1e-7}, {{0, 1}, 0, 1.0001, 0}};
    dem2d_shape *needles[2] = {NULL, box_shape(SHARP, 2, 2e-4)};
    assert_ok(dem2d_shape_create_ellipse(NULL, 1, 1e-4, &needles[0]));
    for (int i = 0; i < 2 * COUNT_OF(rows) * COUNT_OF(starts); i++) {
        dem2d_contact_desc desc = {0};
        dem2d_contact c;
        const int row = i / 2 % COUNT_OF(rows);
        const dem2d_pose b = {{rows[row].x, rows[row].y}, rows[row].turn, 1};
        desc.start = starts[i / 2 / COUNT_OF(rows)];
        assert_ok(dem2d_pair_contact(needles[i % 2], still(), needles[i % 2], b, &desc, &c));
        const double slack = CASE_ROUNDING * (2.01 + hypot(rows[row].x, rows[row].y));
        assert_int_not_equal(c.state, DEM2D_UNRESOLVED);
        assert_within(c.depth, rows[row].depth, c.error + slack);
        assert_between(c.error, 0, 5e-10);
    }
    dem2d_shape_destroy(needles[0]);
    dem2d_shape_destroy(needles[1]);
}

/* Series whose radius of curvature touches 0, and of order 64 with coefficients from 1e-20 up. */
static void test_series(void **state) {
    (void)state;
    uint64_t d = 109;
    for (int i = 0; i < 40; i++) {
        double a[65] = {2}, b[65] = {0};
        model m = {0};
        const int order = i % 2 ? 64 : 2;
        if (order == 2) a[2] = 1 / 3.0;
        for (int n = 2; order == 64 && n <= 64; n++) {
            const double size = random_scale(&d, 1e-20, 0.5 / (n * n)) / (n * n);
            a[n] = random_between(&d, -size, size), b[n] = random_between(&d, -size, size);
        }
        m.kind = FOURIER;
        m.count = order < MODEL_POINTS ? order + 1 : MODEL_POINTS; /* what is left out is < 1e-7 */
        for (int n = 0; n < m.count; n++) m.points[n] = vec(a[n], b[n]);
        assert_ok(dem2d_shape_create_fourier(NULL, a, b, m.count - 1, &m.shape));
        assert_ok(dem2d_shape_get(m.shape, &m.info));
        scene s = {0};
        s.way = CHOSEN, s.p = (pair){&m, &m, still(), still()};
        if (i % 4 > 1) s.p.pose_b.rotation = dem2d_rot_make(i);
        s.p.pose_b.position = vec(i % 5 * 0.6, i % 3 ? 0 : 0.1 * i);
        const truth t = find_truth(&s.p);
        const dem2d_contact cold = ask(&s.p, NULL);
        check_answer(&s, &t, "series", DEM2D_CERTIFIED, &cold);
        for (int k = 0; k < 4; k++) {
            const dem2d_vec starts[4] = {{1, 0}, {-1, 0}, {0, 1}, {-1, 1e-17}};
            const dem2d_contact_desc desc = with(DEM2D_CERTIFIED, spot_from(starts[k]));
            const dem2d_contact c = ask(&s.p, &desc);
            check_answer(&s, &t, "series, started", DEM2D_CERTIFIED, &c);
        }
        dem2d_shape_destroy(m.shape);
    }
}

/* Directions where one arc or corner hands over to the next, and an ulp beside. */
static void test_joints(void **state) {
    (void)state;
    uint64_t d = 110;
    for (int i = 0; i < 2 * VARIANTS; i++) {
        const model *a = &all.models[i % 2 ? BEZIER : POLYGON][i / 2];
        const model *b = any(random_below(&d, KINDS), &d);
        for (int k = 0; k < a->count; k++) {
            const int next = (k + 1) % a->count;
            const dem2d_vec e =
                vec(a->points[next].x - a->points[k].x, a->points[next].y - a->points[k].y);
            if (e.x == 0 && e.y == 0) continue;
            scene s = {0};
            s.way = CHOSEN, s.p = (pair){a, b, still(), still()};
            spot u = spot_unit(spot_make(e.y, -e.x));
            if (k % 3) u.x = nextafter((double)u.x, k % 3 == 1 ? 2 : -2);
            scene_place(&s, spot_unit(u), k % 2 ? 0 : 1e-3);
            const truth t = find_truth(&s.p);
            const dem2d_contact_desc desc = with(DEM2D_CERTIFIED, s.u);
            const dem2d_contact cold = ask(&s.p, NULL), warm = ask(&s.p, &desc);
            check_answer(&s, &t, "joint", DEM2D_CERTIFIED, &cold);
            check_answer(&s, &t, "joint, warm", DEM2D_CERTIFIED, &warm);
        }
    }
}

/* Data (not poses) of sizes from 1e-60 to 1e60: a square, a circle, an ellipse, a series. */
static void test_sizes(void **state) {
    (void)state;
    static const int powers[] = {-199, -100, 0, 100, 199};
    dem2d_contact first[4] = {{0}};
    for (int i = 0; i < COUNT_OF(powers); i++) {
        const double f = ldexp(1, powers[i]);
        const double a[3] = {2 * f, 0, 0.1 * f}, b[3] = {0, 0, 0.2 * f};
        dem2d_shape *shapes[4] = {box_shape(SHARP, 2 * f, f)};
        assert_ok(dem2d_shape_create_circle(NULL, 0.8 * f, &shapes[1]));
        assert_ok(dem2d_shape_create_ellipse(NULL, f, 0.5 * f, &shapes[2]));
        assert_ok(dem2d_shape_create_fourier(NULL, a, b, 2, &shapes[3]));
        for (int k = 0; k < 4; k++) {
            dem2d_contact c;
            dem2d_pose at = dem2d_pose_make(0.9 * f, 0.7 * f, 0.4, 1);
            assert_ok(dem2d_pair_contact(shapes[k], still(), shapes[3 - k], at, NULL, &c));
            if (i == 0) first[k] = c;
            assert_same_bits(c.depth, ldexp(first[k].depth, powers[i] - powers[0]));
            assert_true(same_vec(c.normal, first[k].normal));
            assert_int_equal(c.state, DEM2D_PENETRATING);
        }
        for (int k = 0; k < 4; k++) dem2d_shape_destroy(shapes[k]);
    }
}

/* The same disc as circle, ellipse, series of order 0, custom shape, and, to 1 - cos(pi/n), as a
   polygon of n corners; a disc grown from a triangle so small that it is a corner. */
static void test_representations(void **state) {
    (void)state;
    enum { DISCS = 6, CORNERS = 360 };
    const double a[1] = {1.6}, b[1] = {0}, tiny = 1e-9;
    const dem2d_vec core[3] = {{tiny, 0}, {-tiny, tiny}, {-tiny, -tiny}};
    model round = {0};
    dem2d_vec ring[CORNERS];
    dem2d_shape *discs[DISCS];
    dem2d_custom_desc custom = {0};
    round.kind = CUSTOM, round.r = 0.8;
    custom.support = custom_support, custom.user = &round, custom.rho_min = 0.8;
    for (int i = 0; i < CORNERS; i++) {
        const dem2d_vec u = direction((double)(2 * TEST_PI * i / CORNERS));
        ring[i] = vec(0.8 * u.x, 0.8 * u.y);
    }
    assert_ok(dem2d_shape_create_circle(NULL, 0.8, &discs[0]));
    assert_ok(dem2d_shape_create_ellipse(NULL, 0.8, 0.8, &discs[1]));
    assert_ok(dem2d_shape_create_fourier(NULL, a, b, 0, &discs[2]));
    assert_ok(dem2d_shape_create_custom(NULL, &custom, &discs[3]));
    assert_ok(dem2d_shape_create_polygon(NULL, core, 3, 0.8 - tiny, &discs[4]));
    assert_ok(dem2d_shape_create_polygon(NULL, ring, CORNERS, 0, &discs[5]));
    static const double off[DISCS] = {0, 0, 0, 0, 3 * 1e-9, 0.8 * 3.9e-5};
    uint64_t d = 111;
    for (int i = 0; i < KINDS * 12; i++) {
        const model *m = any(i % KINDS, &d);
        const dem2d_pose at = {{random_between(&d, 0, 2), random_between(&d, 0, 1)}, {0.6, 0.8}, 1};
        dem2d_contact first = {0}, c;
        for (int k = 0; k < DISCS; k++) {
            assert_ok(dem2d_pair_contact(discs[k], still(), m->shape, at, NULL, &c));
            if (k == 0) first = c;
            assert_within(c.depth, first.depth, c.error + first.error + off[k] + CASE_ROUNDING * 6);
        }
    }
    for (int k = 0; k < DISCS; k++) dem2d_shape_destroy(discs[k]);
}

/* --- options --------------------------------------------------------------------------------- */

/* A cap of one: the bounds hold, and an answer that is given is right. A tolerance is kept. */
static void test_cap_and_tolerance(void **state) {
    (void)state;
    static const double tolerances[] = {1e-3, 1e-6, 1e-14};
    uint64_t d = 112;
    int unresolved = 0;
    for (int i = 0; i < KINDS * KINDS * 6; i++) {
        const model *a = any(i % KINDS, &d), *b = any(i / KINDS % KINDS, &d);
        const scene s = scene_draw(a, b, i % 2 ? CHOSEN : ANYWHERE, &d);
        const truth t = find_truth(&s.p);
        const int style = i / (KINDS * KINDS);
        dem2d_contact_desc desc = with(i & 1 ? DEM2D_GJK_EPA : DEM2D_CERTIFIED, spot_make(0, 0));
        if (style < 3)
            desc.tolerance = tolerances[style];
        else
            desc.max_iterations = style - 2;
        const dem2d_contact c = ask(&s.p, &desc);
        const double tolerance = style < 3 ? tolerances[style] : CASE_TOLERANCE;
        EXPECT_NONE(answer_flaw(&s.p, &c, tolerance, desc.solver), &s, "options", &c);
        EXPECT_NONE(depth_flaw(&c, t.lower, t.depth, depth_slack(&s.p)), &s, "options", &c);
        unresolved += c.state == DEM2D_UNRESOLVED;
    }
    assert_true(unresolved > 20); /* of the rows with a cap */
}

/* Without contact points all else is the same. */
static void test_skip_points(void **state) {
    (void)state;
    uint64_t d = 115;
    for (int i = 0; i < KINDS * KINDS * 4; i++) {
        const model *a = any(i % KINDS, &d), *b = any(i / KINDS % KINDS, &d);
        const scene s = scene_draw(a, b, i % 2 ? CHOSEN : PARALLEL, &d);
        const int solver = i / (KINDS * KINDS) % DEM2D_SOLVER_COUNT;
        dem2d_contact_desc desc = with((dem2d_solver)solver, spot_make(0, 0));
        dem2d_contact with_points = ask(&s.p, &desc);
        desc.skip_points = true;
        const dem2d_contact c = ask(&s.p, &desc);
        EXPECT(c.count == 0, &s, "points skipped", &c);
        with_points.count = 0;
        EXPECT(same_answer(&c, &with_points), &s, "points skipped", &c);
        EXPECT(same_vec(c.point, with_points.point), &s, "points skipped", &c);
    }
}

/* --- walls ----------------------------------------------------------------------------------- */

/* What is wrong with the contact points on a wall along u through `on`; NULL if nothing is. */
static const char *wall_points_flaw(const model *m, const dem2d_pose *pose, dem2d_vec on, spot u,
                                    const dem2d_contact *c, double place) {
    double sum = 0, deepest = -HUGE_VAL;
    if (c->state == DEM2D_SEPARATED) return c->count == 0 ? NULL : "contact points across a gap";
    if (c->count != 1 && c->count != 2) return "neither one nor two contact points";
    for (int i = 0; i < c->count; i++) {
        const dem2d_contact_point *q = &c->points[i];
        const real x = q->position.x, y = q->position.y;
        if (!(fabsl((x - on.x) * u.x + (y - on.y) * u.y) <= place))
            return "a contact point is not on the wall";
        /* two points are on a chord, as far inside as they are less deep than the contact */
        const real off = place + (c->count < 2 ? 0 : c->depth - q->depth + round_slack(m, pose, u));
        if (!(fabsl(depth_in(m, pose, x + q->depth * u.x, y + q->depth * u.y)) <= off))
            return "a contact point is not its depth from the shape's surface";
        if (!(q->weight >= 0 && q->weight <= WEIGHT_MOST)) return "a weight out of range";
        sum += q->weight, deepest = fmax(deepest, q->depth);
    }
    if (!(sum >= WEIGHTS_LEAST && sum <= 1 + WEIGHT_MOST)) return "a sum of weights out of range";
    return fabs(deepest - c->depth) <= place ? NULL : "no contact point as deep as the contact";
}

static const char *wall_flaw(const model *m, const dem2d_pose *pose, dem2d_vec on, spot u,
                             const dem2d_contact *c) {
    const spot d = spot_make((real)pose->position.x - on.x, (real)pose->position.y - on.y);
    const real depth = spot_dot(posed_support(m, pose, u), u) + spot_dot(d, u);
    const double size = m->info.circumscribed * pose->scale + (double)hypotl(d.x, d.y);
    const double slack = CASE_ROUNDING * size, far = fabs(on.x) + fabs(on.y);
    const double place = 2 * slack + 4 * DBL_EPSILON * far;
    const real height = ((real)c->point.x - on.x) * u.x + ((real)c->point.y - on.y) * u.y;
    if (!(fabsl(c->depth - depth) <= c->error + slack)) return "not the depth";
    if (!(c->error >= 0 && c->error <= 1.001 * slack)) return "an error that is no rounding";
    if (c->proof != DEM2D_BY_FORM || c->support_calls != 1) return "not by one support call";
    if (!(hypotl(c->normal.x - u.x, c->normal.y - u.y) <= 4 * DBL_EPSILON)) return "not the normal";
    if (depth < -3 * slack && c->state != DEM2D_SEPARATED) return "a gap that is not called so";
    if (depth > 3 * slack && c->state != DEM2D_PENETRATING) return "an overlap not called so";
    if (c->state == DEM2D_UNRESOLVED) return "unresolved";
    if (!(fabsl(height) <= place)) return "`point` is not on the wall";
    if (!(fabsl(depth_in(m, pose, c->point_a.x, c->point_a.y)) <= place))
        return "`point_a` is not on the shape's surface";
    return wall_points_flaw(m, pose, on, u, c, place);
}

static void check_wall(const model *m, const dem2d_pose *pose, dem2d_vec on, spot n,
                       double length) {
    dem2d_contact c;
    const dem2d_vec wall = spot_rounded(spot_make(length * n.x, length * n.y));
    assert_ok(dem2d_wall_contact(m->shape, *pose, on, wall, &c));
    const char *flaw =
        wall_flaw(m, pose, on, spot_unit(spot_make(-(real)wall.x, -(real)wall.y)), &c);
    if (flaw == NULL) return;
    print_model("shape", m, pose);
    print_answer("wall", &c, &(pair){m, NULL, *pose, {on, {1, 0}, 1}});
    print_error("wall through {%a, %a}, normal {%a, %a}: %s\n", on.x, on.y, wall.x, wall.y, flaw);
    fail();
}

static void test_walls(void **state) {
    (void)state;
    static const double lengths[] = {1, 1e-3, 1e3, 1e150, 1e-160};
    uint64_t d = 113;
    for (int i = 0; i < KINDS * 60; i++) {
        const model *m = any(i % KINDS, &d);
        const scene s = scene_draw(m, m, i % WAYS, &d);
        const spot n = i % 4 ? draw_normal(m, &s.p.pose_b, &d) : random_direction(&d);
        const spot inward = spot_make(-n.x, -n.y);
        const spot a = posed_support(m, &s.p.pose_b, inward);
        /* at a depth from far off to wholly behind the wall, anywhere along it */
        const double along = random_between(&d, -9, 9), f = s.p.pose_b.scale;
        const double depth = i % 3 == 0   ? f * random_scale(&d, 1e-16, 1)
                             : i % 3 == 1 ? -f * random_scale(&d, 1e-16, 1)
                                          : f * random_between(&d, 0, 4);
        const dem2d_vec at = s.p.pose_b.position;
        const dem2d_vec on = {(double)(at.x + a.x + depth * n.x - along * n.y),
                              (double)(at.y + a.y + depth * n.y + along * n.x)};
        check_wall(m, &s.p.pose_b, on, n, lengths[i % COUNT_OF(lengths)]);
    }
}

/* A flat side along the wall: both of its ends, each as deep as it is. */
static void test_wall_faces(void **state) {
    (void)state;
    static const double heights[] = {1 - 1e-9, 0.9, 0.25, -3};
    static const double hairs[] = {0, 1e-16, -1e-12};
    for (int i = 0; i < FORMS * COUNT_OF(heights) * COUNT_OF(hairs); i++) {
        const int form = i % FORMS;
        const double height = heights[i / FORMS % COUNT_OF(heights)];
        const double hair = hairs[i / FORMS / COUNT_OF(heights)];
        const double flat = form == SHARP ? 2 : 2 - CUT;
        dem2d_shape *shape = box_shape(form, 4, 2);
        const dem2d_pose pose = {{7, height}, {1, hair}, 1};
        dem2d_contact c;
        assert_ok(dem2d_wall_contact(shape, pose, vec(0, 0), vec(0, 2), &c));
        assert_within(c.depth, 1 - height, 3e-12);
        assert_int_equal(c.count, 2);
        for (int k = 0; k < 2; k++) { /* the normal is down: turned by +90 degrees it is +x */
            assert_within(c.points[k].position.x, 7 + (k ? flat : -flat), 1e-9);
            assert_within(c.points[k].position.y, 0, 1e-14);
            assert_within(c.points[k].depth, 1 - height, 3e-12);
            assert_between(c.points[k].weight, 0.49, 1);
        }
        dem2d_shape_destroy(shape);
    }
}

/* A turn by 2 pi 1e9 is made of a rotation that is still one, and answers as one. */
static void test_many_turns(void **state) {
    (void)state;
    const double angle = 6.283185307179586 * 1e8; /* 2^30 is the limit */
    const dem2d_pose b = dem2d_pose_make(1, 0.5, angle, 1);
    const real c = b.rotation.c, s = b.rotation.s;
    assert_within(c * c + s * s, 1, 4 * DBL_EPSILON);
    scene x = {0};
    x.way = CHOSEN, x.p = (pair){&all.models[ELLIPSE][0], &all.models[POLYGON][0], still(), b};
    const truth t = find_truth(&x.p);
    const dem2d_contact answer = ask(&x.p, NULL);
    check_answer(&x, &t, "turned often", DEM2D_CERTIFIED, &answer);
}

/* --- many pairs ------------------------------------------------------------------------------ */

/* Against what the construction knows, the value along the normal, and other directions. */
static void test_many_pairs(void **state) {
    (void)state;
    uint64_t d = 114;
    int unresolved = 0;
    for (int i = 0; i < 100000; i++) {
        const model *a = any(random_below(&d, KINDS), &d), *b = any(random_below(&d, KINDS), &d);
        scene s = scene_draw(a, b, random_below(&d, WAYS), &d);
        if (i % 4 == 0) s = scene_scaled(&s, random_below(&d, 401) - 200);
        dem2d_contact_desc desc = with(DEM2D_CERTIFIED, random_direction(&d));
        const dem2d_contact c = ask(&s.p, i % 2 ? &desc : NULL);
        const real slack = depth_slack(&s.p) + s.places;
        EXPECT_NONE(answer_flaw(&s.p, &c, CASE_TOLERANCE, DEM2D_CERTIFIED), &s, "many", &c);
        EXPECT_NONE(direction_flaw(&s.p, &c, CASE_TOLERANCE), &s, "many", &c);
        if (s.known) EXPECT_NONE(depth_flaw(&c, s.chosen, s.chosen, slack), &s, "many", &c);
        if (s.bounded) EXPECT(c.depth - c.error - slack <= s.chosen, &s, "many", &c);
        for (int k = 0; k < 3; k++) {
            const real h = pair_value(&s.p, random_direction(&d));
            EXPECT(h >= c.depth - c.error - slack, &s, "many", &c);
        }
        if (c.state != DEM2D_UNRESOLVED) continue;
        const truth t = find_truth(&s.p);
        check_answer(&s, &t, "many", DEM2D_CERTIFIED, &c);
        unresolved++;
    }
    print_message("%d of 100000 unresolved, all of them flat\n", unresolved);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_pair),
        cmocka_unit_test(test_overlap_and_distance),
        cmocka_unit_test(test_unchanged),
        cmocka_unit_test(test_moved_far),
        cmocka_unit_test(test_sweep),
        cmocka_unit_test(test_sweep_by_ulps),
        cmocka_unit_test(test_integer_polygons),
        cmocka_unit_test(test_closed_forms),
        cmocka_unit_test(test_faces),
        cmocka_unit_test(test_nearly_parallel),
        cmocka_unit_test(test_corners),
        cmocka_unit_test(test_itself),
        cmocka_unit_test(test_needles),
        cmocka_unit_test(test_series),
        cmocka_unit_test(test_joints),
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_representations),
        cmocka_unit_test(test_cap_and_tolerance),
        cmocka_unit_test(test_skip_points),
        cmocka_unit_test(test_walls),
        cmocka_unit_test(test_wall_faces),
        cmocka_unit_test(test_many_turns),
        cmocka_unit_test(test_many_pairs),
    };
    return cmocka_run_group_tests(tests, create_pool, destroy_pool);
}
