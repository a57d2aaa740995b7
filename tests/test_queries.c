/* Questions of space: boxes, points, shapes, rays, the nearest, against loops over all particles
   and walls with support values that the test computes itself. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"

/* --- an oracle: support values in fixed directions ---------------------------------------------
   Angles of particles are multiples of the angle between two directions, and so are those of the
   edges of polygons: the table of a template is the table of each of its particles. What follows
   from tangents in these directions is exact to (their angle)^2/8 of the size. */

enum { DIRECTIONS = 1440, DISC = 0, ELLIPSE, BOX, ROUNDED, LOBES, OVAL, KINDS };

static const double half_turn = 3.14159265358979323846;
static dem2d_vec unit_of[DIRECTIONS];
static double support_of[KINDS][DIRECTIONS], radius_of[KINDS];
static dem2d_vec offset_of[KINDS];

static const double lobes_a[4] = {0.09, 0.001, 0.002, 0.003}, lobes_b[4] = {0, 0, 0.001, 0};
static const double oval_reach[4] = {0.05, 0.03, 0.04, 0.06};
static const dem2d_vec rounded_corners[5] = {
    {0, 0}, {0.06, 0}, {0.09, 0.03}, {0.09, 0.05}, {0, 0.05}};

static dem2d_shape *make_kind(int kind) {
    if (kind == DISC) return make_disc(0.05);
    if (kind == ELLIPSE) return make_ellipse(0.06, 0.025);
    if (kind == BOX) return make_box(0.1, 0.04);
    if (kind == ROUNDED) return make_polygon(rounded_corners, 5, 0.008);
    if (kind == LOBES) return make_series(lobes_a, lobes_b, 3);
    return make_oval(oval_reach, 0.5522847498);
}

static double greatest(const dem2d_vec *points, int count, double x, double y) {
    double most = -1e9;
    for (int i = 0; i < count; i++) most = fmax(most, points[i].x * x + points[i].y * y);
    return most;
}

static double oval_support(double x, double y) {
    dem2d_vec p[12], points[4 * 501];
    oval_points(oval_reach, 0.5522847498, p);
    for (int i = 0; i < 4 * 501; i++) {
        const dem2d_vec *q = p + i / 501 * 3, last = p[(i / 501 * 3 + 3) % 12];
        const double t = i % 501 / 500.0, s = 1 - t;
        const double w[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
        points[i].x = w[0] * q[0].x + w[1] * q[1].x + w[2] * q[2].x + w[3] * last.x;
        points[i].y = w[0] * q[0].y + w[1] * q[1].y + w[2] * q[2].y + w[3] * last.y;
    }
    return greatest(points, 4 * 501, x, y);
}

/* Of a template about its centroid, in any direction. */
static double kind_support(int kind, double angle) {
    const double x = cos(angle), y = sin(angle);
    const dem2d_vec box[4] = {{0, 0}, {0.1, 0}, {0.1, 0.04}, {0, 0.04}};
    double h = 0;
    if (kind == DISC) h = 0.05;
    if (kind == ELLIPSE) h = hypot(0.06 * x, 0.025 * y);
    if (kind == BOX) h = greatest(box, 4, x, y);
    if (kind == ROUNDED) h = greatest(rounded_corners, 5, x, y) + 0.008;
    if (kind == OVAL) h = oval_support(x, y);
    for (int n = 0; n < 4 && kind == LOBES; n++)
        h += (n == 0 ? 0.5 : 1) * (lobes_a[n] * cos(n * angle) + lobes_b[n] * sin(n * angle));
    return h - x * offset_of[kind].x - y * offset_of[kind].y;
}

static int oracle_make(void **state) {
    (void)state;
    for (int i = 0; i < DIRECTIONS; i++) unit_of[i] = direction(i * 2 * half_turn / DIRECTIONS);
    for (int kind = 0; kind < KINDS; kind++) {
        dem2d_shape *shape = make_kind(kind);
        dem2d_shape_info info;
        assert_ok(dem2d_shape_get(shape, &info));
        offset_of[kind] = info.offset, radius_of[kind] = info.circumscribed;
        for (int i = 0; i < DIRECTIONS; i++)
            support_of[kind][i] = kind_support(kind, i * 2 * half_turn / DIRECTIONS);
        dem2d_shape_destroy(shape);
    }
    return 0;
}

typedef struct body {
    int kind, turn; /* turned by so many directions */
    double scale;
    dem2d_vec at;
    dem2d_particle_id id;
    bool there;
} body;

/* A half-plane, a segment, or a segment of a chain. */
typedef struct plane {
    bool segment;
    dem2d_vec from, to, normal;
    dem2d_wall_id id;
    int part;
} plane;

static double body_support(const body *b, int i) {
    return b->scale * support_of[b->kind][(i - b->turn + 2 * DIRECTIONS) % DIRECTIONS];
}

static double dot(dem2d_vec a, dem2d_vec b) {
    return a.x * b.x + a.y * b.y;
}

static dem2d_vec minus(dem2d_vec a, dem2d_vec b) {
    return vec(a.x - b.x, a.y - b.y);
}

/* Gap between a body and another, by the best of the directions; below 0 they overlap. */
static double gap_of(const body *a, const body *b) {
    double most = -1e9;
    const dem2d_vec d = minus(b->at, a->at);
    for (int i = 0; i < DIRECTIONS; i++) {
        const double h = body_support(a, i) + body_support(b, (i + DIRECTIONS / 2) % DIRECTIONS);
        most = fmax(most, dot(d, unit_of[i]) - h);
    }
    return most;
}

static double box_gap(const body *a, const dem2d_box *box) {
    double most = -1e9;
    for (int i = 0; i < DIRECTIONS; i++) {
        const dem2d_vec u = unit_of[i];
        const dem2d_vec p =
            vec(u.x > 0 ? box->lower.x : box->upper.x, u.y > 0 ? box->lower.y : box->upper.y);
        most = fmax(most, dot(minus(p, a->at), u) - body_support(a, i));
    }
    return most;
}

/* Where a ray enters a body, and where it leaves it: from > to when it does not hit. */
static void ray_of(const body *a, dem2d_vec o, dem2d_vec d, double *from, double *to) {
    *from = -1e9, *to = 1e9;
    for (int i = 0; i < DIRECTIONS; i++) {
        const double speed = dot(unit_of[i], d);
        const double height = body_support(a, i) - dot(minus(o, a->at), unit_of[i]);
        if (speed < 0) *from = fmax(*from, height / speed);
        if (speed > 0) *to = fmin(*to, height / speed);
        if (speed == 0 && height < 0) *to = -1e9;
    }
}

static double segment_gap(const plane *w, dem2d_vec p) {
    const dem2d_vec along = minus(w->to, w->from), to = minus(p, w->from);
    const double share = fmin(1, fmax(0, dot(to, along) / dot(along, along)));
    return hypot(to.x - share * along.x, to.y - share * along.y);
}

static double plane_gap(const plane *w, dem2d_vec p) {
    return w->segment ? segment_gap(w, p) : dot(minus(p, w->from), w->normal);
}

/* --- a scene -----------------------------------------------------------------------------------
 */

enum { BODIES = 240, PLANES = 8 }; /* half-planes, segment, open chain, closed chain */

typedef struct crowd {
    scene s;
    dem2d_shape *shape[KINDS];
    dem2d_shape_id shape_id[KINDS];
    body bodies[BODIES];
    plane planes[PLANES];
    uint64_t random;
} crowd;

static const dem2d_box arena = {{0, 0}, {2, 2}};

static dem2d_vec place_in(crowd *c, const dem2d_box *box) {
    const double x = random_between(&c->random, box->lower.x, box->upper.x);
    return vec(x, random_between(&c->random, box->lower.y, box->upper.y));
}

/* Sizes from 0.2 to 4, most of them small. */
static body random_body(crowd *c) {
    body b = {0};
    b.kind = random_below(&c->random, KINDS), b.turn = random_below(&c->random, DIRECTIONS);
    b.scale = 0.2 * pow(20, pow(random_between(&c->random, 0, 1), 3));
    b.at = place_in(c, &arena), b.there = true;
    return b;
}

static double angle_at(int turn) {
    return turn * 2 * half_turn / DIRECTIONS;
}

static void crowd_add(crowd *c, body *b) {
    dem2d_particle_desc desc = grain_desc(&c->s, c->shape_id[b->kind], b->scale, b->at);
    desc.angle = angle_at(b->turn), desc.motion = DEM2D_FIXED;
    desc.groups.sensor = b->turn % 7 == 0;
    b->id = add_grain(&c->s, &desc);
}

static const dem2d_vec paddle[3] = {{0.3, 1.2}, {0.6, 1.3}, {0.4, 1.6}};
static const dem2d_vec paddle_pivot = {0.45, 1.35};
#define PADDLE_TURN 0.7 /* rad, in the one step that is made */
#define CROWD_STEP 1e-6

/* The walls: half-planes; a one-sided chain, a sensor, a paddle that turns. */
static void crowd_add_planes(crowd *c) {
    const dem2d_vec open[3] = {{0.2, 0.5}, {0.9, 0.7}, {1.4, 0.4}};
    dem2d_wall_desc desc = plane_desc(&c->s, vec(0, 0.1), vec(0, 1));
    for (int i = 0; i < PLANES; i++) {
        plane *w = &c->planes[i];
        w->segment = i >= 2;
        if (i >= 3) w->part = (i - 3) % 2;
        if (i >= 5) w->part = i - 5;
    }
    c->planes[0].from = desc.point, c->planes[0].normal = desc.normal;
    c->planes[0].id = add_wall(&c->s, &desc);
    const double length = hypot(1, 0.2);
    desc.point = c->planes[1].from = vec(1.9, 0), desc.normal = vec(-1, 0.2);
    c->planes[1].normal = vec(-1 / length, 0.2 / length);
    c->planes[1].id = add_wall(&c->s, &desc);
    desc.segment = true, desc.groups.sensor = true;
    desc.point = c->planes[2].from = vec(1, 1.2), desc.end = c->planes[2].to = vec(1, 1.9);
    c->planes[2].id = add_wall(&c->s, &desc);
    desc.segment = desc.groups.sensor = false, desc.points = open, desc.count = 3;
    desc.one_sided = true;
    const dem2d_wall_id chain = add_wall(&c->s, &desc);
    desc.one_sided = false, desc.points = paddle, desc.closed = true, desc.pivot = paddle_pivot;
    desc.mode = DEM2D_WALL_MOVING, desc.angular_velocity = PADDLE_TURN / CROWD_STEP;
    const dem2d_wall_id turning = add_wall(&c->s, &desc);
    for (int i = 3; i < PLANES; i++) {
        plane *w = &c->planes[i];
        const dem2d_vec *points = i < 5 ? open : paddle;
        w->id = i < 5 ? chain : turning;
        w->from = points[w->part], w->to = points[(w->part + 1) % 3];
    }
}

/* The step: the paddle turns about its pivot, all else is fixed. */
static void crowd_step(crowd *c) {
    const dem2d_vec u = direction(PADDLE_TURN);
    dem2d_vec at[3];
    step(&c->s, 1);
    for (int k = 0; k < 3; k++) {
        const dem2d_vec arm = minus(paddle[k], paddle_pivot);
        at[k] = vec(paddle_pivot.x + u.x * arm.x - u.y * arm.y,
                    paddle_pivot.y + u.y * arm.x + u.x * arm.y);
    }
    for (int k = 0; k < 3; k++)
        c->planes[5 + k].from = at[k], c->planes[5 + k].to = at[(k + 1) % 3];
}

static void crowd_make(crowd *c, uint64_t seed) {
    const dem2d_material_desc material = stone_desc(1e6, 0.3);
    dem2d_world_desc desc = {0};
    memset(c, 0, sizeof *c);
    c->random = seed, desc.time_step = CROWD_STEP;
    c->s = open_scene(&desc, &material);
    for (int kind = 0; kind < KINDS; kind++)
        c->shape_id[kind] = copy_shape(&c->s, c->shape[kind] = make_kind(kind));
    for (int i = 0; i < BODIES; i++) {
        c->bodies[i] = random_body(c);
        crowd_add(c, &c->bodies[i]);
    }
    crowd_add_planes(c);
}

static void crowd_end(crowd *c) {
    for (int kind = 0; kind < KINDS; kind++) dem2d_shape_destroy(c->shape[kind]);
    close_scene(&c->s);
}

/* Some are removed, some put elsewhere, some added in their places. */
static void crowd_shuffle(crowd *c) {
    for (int i = 0; i < BODIES; i++) {
        body *b = &c->bodies[i];
        const int what = random_below(&c->random, 6);
        if (what == 0 && b->there) {
            assert_ok(dem2d_world_remove_particle(c->s.world, b->id));
            b->there = false;
        } else if (what == 1 && b->there) {
            b->at = place_in(c, &arena), b->turn = random_below(&c->random, DIRECTIONS);
            assert_ok(dem2d_world_move_particle(c->s.world, b->id, b->at, angle_at(b->turn)));
        } else if (what == 2 && !b->there) {
            *b = random_body(c);
            crowd_add(c, b);
        }
    }
}

/* --- what a query must find --------------------------------------------------------------------
 */

enum { MOST = BODIES + PLANES };

/* Of each body and wall whether it is found; or it is too near to tell. */
typedef enum answer { NO, YES, NEAR } answer;

static answer answer_of(double gap, double size) {
    return fabs(gap) <= 1e-5 * size ? NEAR : gap < 0 ? YES : NO;
}

static bool same_particle(dem2d_particle_id a, dem2d_particle_id b) {
    return a.index == b.index && a.generation == b.generation;
}

/* What was found is what must be, each once and in order. */
static void check_found(const crowd *c, const answer *expected, const dem2d_found *found,
                        int count) {
    bool seen[MOST] = {false};
    int64_t last = -1;
    for (int k = 0; k < count; k++) {
        const bool wall = found[k].wall.generation != 0;
        const int64_t rank = wall ? ((int64_t)found[k].wall.index + 1) << 32 | found[k].part
                                  : (int64_t)found[k].particle.index;
        assert_true(wall != (found[k].particle.generation != 0));
        assert_true(rank > last);
        last = rank;
        for (int i = 0; i < MOST; i++)
            if (i < BODIES ? !wall && c->bodies[i].there &&
                                 same_particle(c->bodies[i].id, found[k].particle)
                           : wall && c->planes[i - BODIES].id.index == found[k].wall.index &&
                                 c->planes[i - BODIES].part == found[k].part)
                seen[i] = true;
    }
    for (int i = 0; i < MOST; i++) {
        if (expected[i] == NEAR || seen[i] == (expected[i] == YES)) continue;
        print_error("item %d: found %d\n", i, seen[i]);
        fail();
    }
}

static double size_of(const body *b) {
    return b->scale * radius_of[b->kind];
}

/* --- tests of regions --------------------------------------------------------------------------
 */

static answer box_meets_plane(const plane *w, const dem2d_box *box) {
    if (!w->segment) {
        const dem2d_vec p = vec(w->normal.x > 0 ? box->lower.x : box->upper.x,
                                w->normal.y > 0 ? box->lower.y : box->upper.y);
        return answer_of(plane_gap(w, p), 1);
    }
    /* two convex sets: normals of the box, and of the segment */
    const dem2d_vec along = minus(w->to, w->from), middle = vec((box->lower.x + box->upper.x) / 2,
                                                                (box->lower.y + box->upper.y) / 2);
    const dem2d_vec half = vec(box->upper.x - middle.x, box->upper.y - middle.y);
    const double length = hypot(along.x, along.y);
    const dem2d_vec across = vec(-along.y / length, along.x / length);
    double gap =
        fmax(fmin(w->from.x, w->to.x) - box->upper.x, box->lower.x - fmax(w->from.x, w->to.x));
    gap = fmax(gap, fmax(fmin(w->from.y, w->to.y) - box->upper.y,
                         box->lower.y - fmax(w->from.y, w->to.y)));
    gap = fmax(gap, fabs(dot(minus(middle, w->from), across)) - fabs(across.x) * half.x -
                        fabs(across.y) * half.y);
    return answer_of(gap, 1);
}

static void check_box(crowd *c, const dem2d_box *box, bool is_point) {
    answer expected[MOST] = {NO};
    dem2d_found found[MOST];
    int count;
    for (int i = 0; i < BODIES; i++) {
        const body *b = &c->bodies[i];
        const double x = fmax(box->lower.x, fmin(b->at.x, box->upper.x)) - b->at.x;
        const double y = fmax(box->lower.y, fmin(b->at.y, box->upper.y)) - b->at.y;
        if (!b->there || hypot(x, y) > 1.01 * size_of(b)) continue;
        if (b->kind == DISC)
            expected[i] = hypot(x, y) <= size_of(b) ? YES : NO;
        else
            expected[i] = answer_of(box_gap(b, box), size_of(b));
    }
    for (int i = 0; i < PLANES; i++) expected[BODIES + i] = box_meets_plane(&c->planes[i], box);
    if (is_point)
        assert_ok(dem2d_world_query_point(c->s.world, box->lower, NULL, found, MOST, &count));
    else
        assert_ok(dem2d_world_query_box(c->s.world, box, NULL, found, MOST, &count));
    check_found(c, expected, found, count);
}

static void check_shape(crowd *c) {
    const body q = random_body(c);
    const dem2d_pose pose = dem2d_pose_make(q.at.x, q.at.y, angle_at(q.turn), q.scale);
    answer expected[MOST] = {NO};
    dem2d_found found[MOST];
    int count;
    for (int i = 0; i < BODIES; i++) {
        const body *b = &c->bodies[i];
        const double reach = size_of(b) + size_of(&q);
        if (!b->there || hypot(b->at.x - q.at.x, b->at.y - q.at.y) > 1.01 * reach) continue;
        expected[i] = answer_of(gap_of(&q, b), reach);
    }
    for (int i = 0; i < PLANES; i++) {
        const plane *w = &c->planes[i];
        double most = -1e9;
        for (int k = 0; k < DIRECTIONS && w->segment; k++) {
            const dem2d_vec u = unit_of[k];
            const double from = dot(minus(w->from, q.at), u), to = dot(minus(w->to, q.at), u);
            most = fmax(most, fmin(from, to) - body_support(&q, k));
        }
        for (int k = 0; k < 2; k++) { /* the normals of walls are not among the directions */
            const dem2d_vec along = minus(w->to, w->from);
            dem2d_vec u = w->segment ? vec(-along.y, along.x) : w->normal;
            const double length = hypot(u.x, u.y) * (k == 0 ? -1 : 1);
            if (!w->segment && k == 1) break;
            u = vec(u.x / length, u.y / length);
            const double angle = atan2(u.y, u.x) - angle_at(q.turn);
            const double gap = dot(minus(w->from, q.at), u) - q.scale * kind_support(q.kind, angle);
            most = fmax(most, gap);
        }
        expected[BODIES + i] = answer_of(most, 1);
    }
    assert_ok(
        dem2d_world_query_shape(c->s.world, c->shape[q.kind], pose, NULL, found, MOST, &count));
    check_found(c, expected, found, count);
}

/* --- tests of rays and the nearest -------------------------------------------------------------
 */

/* A hit is on the surface of a body, whose normal there is the hit's: it is on the tangent of that
   normal, and in the body. */
static void check_surface(const body *b, const dem2d_hit *hit) {
    const dem2d_vec p = minus(hit->point, b->at);
    const double angle = atan2(hit->normal.y, hit->normal.x) - angle_at(b->turn);
    const double fine = b->kind == OVAL ? 5e-6 : 1e-9; /* its outline is sampled */
    assert_within(dot(p, hit->normal), b->scale * kind_support(b->kind, angle), fine * size_of(b));
    assert_within(hypot(hit->normal.x, hit->normal.y), 1, 1e-12);
    for (int i = 0; i < DIRECTIONS; i++)
        assert_true(dot(p, unit_of[i]) <= body_support(b, i) + fine * size_of(b));
}

/* Distance along the ray; below 0: none. */
static double ray_plane(const plane *w, dem2d_vec o, dem2d_vec d) {
    const dem2d_vec along = minus(w->to, w->from), to = minus(w->from, o);
    if (!w->segment) {
        const double height = plane_gap(w, o);
        return height <= 0 ? 0 : -height / dot(d, w->normal);
    }
    const double sine = d.x * along.y - d.y * along.x;
    const double share = (to.x * d.y - to.y * d.x) / sine;
    return share >= 0 && share <= 1 ? (to.x * along.y - to.y * along.x) / sine : -1;
}

static const body *body_of(const crowd *c, dem2d_particle_id id) {
    for (int i = 0; i < BODIES; i++)
        if (c->bodies[i].there && same_particle(c->bodies[i].id, id)) return &c->bodies[i];
    fail_msg("no such body");
    return NULL;
}

/* All hits of a ray, then the first of them. */
static void check_ray(crowd *c, double length) {
    const dem2d_vec o = place_in(c, &arena);
    const dem2d_vec d = direction(random_between(&c->random, 0, 2 * half_turn));
    const double end = length > 0 ? length : 1e6;
    answer expected[MOST] = {NO};
    double distance[MOST] = {0};
    dem2d_found found[MOST];
    dem2d_hit hits[MOST], first;
    int count;
    for (int i = 0; i < BODIES; i++) {
        const body *b = &c->bodies[i];
        double from, to;
        if (!b->there || fabs(d.x * (b->at.y - o.y) - d.y * (b->at.x - o.x)) > size_of(b)) continue;
        ray_of(b, o, d, &from, &to);
        distance[i] = fmax(from, 0);
        expected[i] = from > to || to < 0 || from > end ? NO : YES;
        if (fabs(from - to) < 0.02 * size_of(b) || fabs(to) < 1e-4 * size_of(b) ||
            fabs(from - end) < 1e-3 * size_of(b) || fabs(from) < 1e-3 * size_of(b))
            expected[i] = NEAR;
    }
    for (int i = 0; i < PLANES; i++) {
        distance[BODIES + i] = ray_plane(&c->planes[i], o, d);
        expected[BODIES + i] = distance[BODIES + i] >= 0 && distance[BODIES + i] <= end ? YES : NO;
    }
    assert_ok(dem2d_world_cast_ray_all(c->s.world, o, d, length, NULL, hits, MOST, &count));
    for (int k = 0; k < count; k++) {
        found[k] = hits[k].found;
        assert_true(k == 0 || hits[k].distance >= hits[k - 1].distance);
        assert_within(hits[k].point.x, o.x + hits[k].distance * d.x, 1e-12);
        assert_within(hits[k].point.y, o.y + hits[k].distance * d.y, 1e-12);
        assert_true(dot(hits[k].normal, d) < 0);
        if (found[k].wall.generation != 0) continue;
        const body *b = body_of(c, found[k].particle);
        const int at = (int)(b - c->bodies);
        if (hits[k].distance > 0) check_surface(b, &hits[k]);
        if (expected[at] == YES) {
            const double grazing = hits[k].distance > 0 ? -dot(hits[k].normal, d) : 1;
            assert_within(hits[k].distance, distance[at], 1e-4 * size_of(b) / grazing);
        }
    }
    /* in the order of ids, as lists are */
    for (int k = 1; k < count; k++)
        for (int j = k; j > 0; j--) {
            const bool wall[2] = {found[j - 1].wall.generation != 0, found[j].wall.generation != 0};
            const int64_t at = (int64_t)found[j].wall.index << 32 | found[j].part;
            const int64_t before = (int64_t)found[j - 1].wall.index << 32 | found[j - 1].part;
            const bool less = wall[0] != wall[1] ? wall[0]
                              : wall[0]          ? at < before
                                        : found[j].particle.index < found[j - 1].particle.index;
            if (!less) break;
            const dem2d_found swap = found[j];
            found[j] = found[j - 1], found[j - 1] = swap;
        }
    check_found(c, expected, found, count);
    assert_ok(dem2d_world_cast_ray(c->s.world, o, d, length, NULL, &first));
    if (count > 0) {
        assert_same_bits(first.distance, hits[0].distance);
        assert_memory_equal(&first.normal, &hits[0].normal, sizeof first.normal);
        assert_memory_equal(&first.found.particle, &hits[0].found.particle,
                            sizeof(dem2d_particle_id));
        assert_memory_equal(&first.found.wall, &hits[0].found.wall, sizeof(dem2d_wall_id));
        assert_int_equal(first.found.part, hits[0].found.part);
    }
    assert_true(count > 0 || (first.found.particle.generation == 0 &&
                              first.found.wall.generation == 0 && first.distance == 0));
}

static void check_nearest(crowd *c) {
    const dem2d_box around = {{-0.5, 0}, {3, 3}};
    const dem2d_query_desc only = {.skip_walls = random_below(&c->random, 2) == 0};
    const dem2d_vec p = place_in(c, &around);
    double least = 1e9;
    dem2d_hit hit;
    for (int i = 0; i < BODIES; i++) {
        const body *b = &c->bodies[i];
        if (!b->there || hypot(b->at.x - p.x, b->at.y - p.y) - size_of(b) > least) continue;
        double gap = -1e9;
        for (int k = 0; k < DIRECTIONS; k++)
            gap = fmax(gap, dot(minus(p, b->at), unit_of[k]) - body_support(b, k));
        least = fmin(least, fmax(gap, 0));
    }
    for (int i = 0; i < PLANES && !only.skip_walls; i++)
        least = fmin(least, fmax(0, plane_gap(&c->planes[i], p)));
    assert_ok(dem2d_world_nearest(c->s.world, p, 0, &only, &hit));
    assert_within(hit.distance, least, 1e-5 * (least + 0.2));
    assert_within(hypot(hit.point.x - p.x, hit.point.y - p.y), hit.distance, 1e-12);
    if (hit.distance > 0) {
        assert_within(dot(minus(p, hit.point), hit.normal), hit.distance, 1e-12);
        if (hit.found.particle.generation != 0) /* the normal has half the digits of the distance */
            assert_within(hit.distance, least, 1e-5 * (least + 0.2));
    }
    if (least > 1e-3) { /* out of range */
        assert_ok(dem2d_world_nearest(c->s.world, p, least * 0.99, &only, &hit));
        assert_int_equal(hit.found.particle.generation + hit.found.wall.generation, 0);
    }
}

/* 1e5 random questions with LONG=1, here a fifth of them. */
static void test_random(void **state) {
    (void)state;
    static crowd c;
    const int rounds = test_long() ? 2000 : 400;
    crowd_make(&c, 3);
    for (int round = 0; round < rounds; round++) {
        if (round % 50 == 49) crowd_shuffle(&c);
        if (round == rounds / 2) crowd_step(&c); /* before and after the first step */
        for (int k = 0; k < 10; k++) {
            dem2d_box box;
            const double width = 0.5 * pow(random_between(&c.random, 0, 1), 2);
            box.lower = place_in(&c, &arena);
            box.upper = vec(box.lower.x + width, box.lower.y + 0.3 * width);
            check_box(&c, &box, false);
            box.lower = box.upper = place_in(&c, &arena);
            check_box(&c, &box, true);
            check_shape(&c);
            check_ray(&c, k < 5 ? 0 : 0.7);
            check_nearest(&c);
        }
    }
    crowd_end(&c);
}

/* --- closed forms ------------------------------------------------------------------------------
 */

/* A disc of radius 0.5 at (2, 0), a square of 1 at (5, 0), a floor at y = -1. */
typedef struct bench {
    scene s;
    dem2d_particle_id disc, square;
    dem2d_wall_id floor, post;
} bench;

static bench bench_make(void) {
    const dem2d_material_desc material = stone_desc(1e6, 0.3);
    dem2d_world_desc desc = {0};
    bench b;
    desc.time_step = 1e-6;
    b.s = open_scene(&desc, &material);
    b.disc = add_shape(&b.s, make_disc(0.5), DEM2D_FREE, vec(2, 0), 0, vec(0, 0), 0);
    b.square = add_shape(&b.s, make_box(1, 1), DEM2D_FREE, vec(5, 0), 0, vec(0, 0), 0);
    b.floor = add_plane(&b.s, 0, -1, 0, 2);
    b.post = add_segment(&b.s, vec(8, -0.5), vec(8, 0.5));
    return b;
}

static void expect_hit(const bench *b, dem2d_vec o, dem2d_vec d, double length, double distance,
                       dem2d_vec normal, dem2d_particle_id particle, dem2d_wall_id wall) {
    dem2d_hit hit;
    assert_ok(dem2d_world_cast_ray(b->s.world, o, d, length, NULL, &hit));
    assert_within(hit.distance, distance, 1e-14 * (1 + distance));
    assert_within(hit.normal.x, normal.x, 1e-12);
    assert_within(hit.normal.y, normal.y, 1e-12);
    assert_memory_equal(&hit.found.particle, &particle, sizeof particle);
    assert_memory_equal(&hit.found.wall, &wall, sizeof wall);
}

static void test_rays(void **state) {
    (void)state;
    const bench b = bench_make();
    const dem2d_particle_id no_particle = {0, 0};
    const dem2d_wall_id no_wall = {0, 0};
    const dem2d_vec east = vec(3, 0), none = vec(0, 0);
    dem2d_hit hits[8];
    int count;
    expect_hit(&b, vec(0, 0), east, 0, 1.5, vec(-1, 0), b.disc, no_wall);
    expect_hit(&b, vec(0, 0.3), east, 0, 1.6, vec(-0.8, 0.6), b.disc, no_wall);
    expect_hit(&b, vec(2.1, 0.2), east, 0, 0, vec(-1, 0), b.disc, no_wall); /* begins inside */
    expect_hit(&b, vec(3, 0.25), east, 0, 1.5, vec(-1, 0), b.square, no_wall);
    expect_hit(&b, vec(3, 0.5), east, 0, 1.5, vec(-1, 0), b.square, no_wall); /* along an edge */
    expect_hit(&b, vec(6, 0.25), east, 0, 2, vec(-1, 0), no_particle, b.post);
    expect_hit(&b, vec(10, 0.25), vec(-1, 0), 0, 2, vec(1, 0), no_particle, b.post);
    expect_hit(&b, vec(8, 2), vec(0, -1), 0, 1.5, vec(0, 1), no_particle, b.post); /* its end */
    expect_hit(&b, vec(9, 2), vec(0, -7), 0, 3, vec(0, 1), no_particle, b.floor);
    expect_hit(&b, vec(9, -2), vec(0, 1), 0, 0, vec(0, -1), no_particle, b.floor); /* behind it */
    expect_hit(&b, vec(9, 2), east, 0, 0, none, no_particle, no_wall);
    expect_hit(&b, vec(0, 0), east, 1.49, 0, none, no_particle, no_wall);
    expect_hit(&b, vec(0, 0), vec(-1, 0), 0, 0, none, no_particle, no_wall);
    expect_hit(&b, vec(-1e9, 0), east, 0, 1e9 + 1.5, vec(-1, 0), b.disc, no_wall);
    assert_ok(dem2d_world_cast_ray_all(b.s.world, vec(1.8, 0), east, 0, NULL, hits, 8, &count));
    assert_int_equal(count, 3);
    assert_near(hits[1].distance, 4.5 - 1.8, 1e-14);
    assert_near(hits[2].distance, 8 - 1.8, 1e-14);
    assert_ok(dem2d_world_cast_ray_all(b.s.world, vec(1.8, 0), east, 3, NULL, NULL, 0, &count));
    assert_int_equal(count, 2);
    close_scene(&b.s);
}

/* Any support function: a custom circle and a custom ellipse in which the radius of curvature is
   unknown, from near and far, and grazing. */
static dem2d_vec egg_support(void *user, dem2d_vec u, double *rho) {
    const double b = *(const double *)user, f = 1 / hypot(u.x, b * u.y);
    (void)rho;
    return vec(u.x * f, b * b * u.y * f);
}

static void test_custom_rays(void **state) {
    (void)state;
    for (int k = 0; k < 3; k++) {
        double axis[3] = {1, 0.4, 1e-3};
        bench b = bench_make();
        dem2d_custom_desc desc = {.support = egg_support, .user = &axis[k]};
        dem2d_shape *shape;
        assert_ok(dem2d_shape_create_custom(NULL, &desc, &shape));
        (void)add_shape(&b.s, shape, DEM2D_FREE, vec(0, 10), 0, vec(0, 0), 0);
        for (int i = 0; i < 400; i++) {
            const double height = (1 - pow(0.9, i / 4.0)) * (i % 2 ? 1 : -1); /* towards grazing */
            const double far = i % 4 < 2 ? 3 : 1e6;
            dem2d_hit hit;
            assert_ok(dem2d_world_cast_ray(b.s.world, vec(-far, 10 + axis[k] * height), vec(1, 0),
                                           0, NULL, &hit));
            const double depth = sqrt(1 - height * height);
            assert_true(hit.found.particle.generation != 0);
            assert_within(hit.distance, far - depth,
                          1e-9 / (axis[k] * depth) + 1e-15 * far / depth / depth);
        }
        close_scene(&b.s);
    }
}

/* --- the contract ------------------------------------------------------------------------------
 */

static void test_contract(void **state) {
    (void)state;
    const bench b = bench_make();
    dem2d_world *w = b.s.world;
    const dem2d_box all = {{-10, -10}, {10, 10}}, turned = {{0, 0}, {1, -1}};
    const dem2d_query_desc particles = {.skip_walls = true}, walls = {.skip_particles = true};
    const dem2d_query_desc nothing = {.skip_walls = true, .skip_particles = true};
    dem2d_found found[4];
    dem2d_hit hit;
    int count = -1;
    memset(found, 0x77, sizeof found);
    assert_ok(dem2d_world_query_box(w, &all, NULL, found, 1, &count));
    assert_int_equal(count, 4);
    assert_memory_equal(&found[0].particle, &b.disc, sizeof b.disc);
    assert_int_equal(found[1].particle.index, 0x77777777); /* untouched */
    assert_ok(dem2d_world_query_box(w, &all, &walls, found, 4, &count));
    assert_int_equal(count, 2);
    assert_memory_equal(&found[0].wall, &b.floor, sizeof b.floor);
    assert_ok(dem2d_world_query_box(w, &all, &particles, NULL, 0, &count));
    assert_int_equal(count, 2);
    assert_ok(dem2d_world_query_box(w, &all, &nothing, NULL, 0, &count));
    assert_int_equal(count, 0);
    assert_result(dem2d_world_query_box(w, &turned, NULL, NULL, 0, &count), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_cast_ray(w, vec(0, 0), vec(0, 0), 0, NULL, &hit), DEM2D_OUT_OF_RANGE);
    assert_ok(dem2d_world_nearest(w, vec(2, 1), 0, NULL, &hit));
    assert_near(hit.distance, 0.5, 1e-15);
    assert_memory_equal(&hit.found.particle, &b.disc, sizeof b.disc);
    assert_ok(dem2d_world_nearest(w, vec(2, 1), 0.4, NULL, &hit));
    assert_int_equal(hit.found.particle.generation + hit.found.wall.generation, 0);
    assert_ok(dem2d_world_nearest(w, vec(7, -0.9), 0, NULL, &hit));
    assert_memory_equal(&hit.found.wall, &b.floor, sizeof b.floor);
    close_scene(&b.s);
}

/* Sizes and places of any order; a box as large as numbers go. */
static void test_extremes(void **state) {
    (void)state;
    const dem2d_material_desc material = stone_desc(1e6, 0.3);
    const dem2d_box huge = {{-1e300, -1e300}, {1e300, 1e300}};
    const double sizes[] = {1e-50, 1e-3, 1, 1e50};
    for (int k = 0; k < COUNT_OF(sizes); k++) {
        const double r = sizes[k];
        dem2d_world_desc desc = {0};
        dem2d_hit hit;
        dem2d_found found[3];
        int count;
        desc.time_step = 1e-6;
        scene s = open_scene(&desc, &material);
        assert_ok(dem2d_world_query_box(s.world, &huge, NULL, found, 3, &count)); /* empty */
        assert_int_equal(count, 0);
        add_shape(&s, make_ellipse(2 * r, r), DEM2D_FREE, vec(4 * r, 0), 0, vec(0, 0), 0);
        for (int i = 0; i < 3; i++) /* the same point twice */
            add_shape(&s, make_box(r, r), DEM2D_FREE, vec(100 * r, 0), 0, vec(0, 0), 0);
        assert_ok(dem2d_world_query_box(s.world, &huge, NULL, found, 3, &count));
        assert_int_equal(count, 4);
        assert_ok(
            dem2d_world_query_point(s.world, vec(100.2 * r, 0.2 * r), NULL, found, 3, &count));
        assert_int_equal(count, 3);
        assert_int_equal(found[0].particle.index, 1);
        assert_ok(dem2d_world_cast_ray(s.world, vec(0, 0), vec(r, 0), 0, NULL, &hit));
        assert_near(hit.distance, 2 * r, 1e-14);
        assert_ok(dem2d_world_nearest(s.world, vec(90 * r, 0), 0, NULL, &hit));
        assert_near(hit.distance, 9.5 * r, 1e-12);
        assert_int_equal(hit.found.particle.index, 1);
        close_scene(&s);
    }
}

/* A pile: contacts of each particle are those of the whole list that name it, in its order; queries
   change no bit of the run. */
static void test_pile(void **state) {
    (void)state;
    uint64_t hash[2];
    for (int asks = 0; asks < 2; asks++) {
        const dem2d_material_desc material = stone_desc(1e6, 0.3);
        dem2d_world_desc desc = {0};
        dem2d_particle_id ids[40];
        static dem2d_contact_info all[400], own[40];
        dem2d_found found[40];
        dem2d_hit hit;
        int count;
        desc.time_step = 2e-4, desc.gravity.y = -9.81;
        scene s = open_scene(&desc, &material);
        add_floor(&s), add_plane(&s, -0.35, 0, 1, 0), add_plane(&s, 0.35, 0, -1, 0);
        for (int i = 0; i < 40; i++)
            ids[i] = add_shape(&s, make_kind(i % KINDS), DEM2D_FREE,
                               vec(0.13 * (i % 5) - 0.26, 0.07 + 0.13 * (i / 5)), i, vec(0, -1), 0);
        for (int k = 0; k < 60; k++) {
            step(&s, 100);
            if (!asks) continue;
            const double x = 0.01 * (k - 30);
            assert_ok(dem2d_world_query_point(s.world, vec(x, 0.1), NULL, found, 40, &count));
            assert_ok(dem2d_world_cast_ray(s.world, vec(x, 2), vec(0, -1), 0, NULL, &hit));
            assert_true(hit.found.particle.generation + hit.found.wall.generation > 0);
        }
        const int total = contacts_of(&s, all, 400);
        assert_true(total > 40 && total < 400);
        int sum = 0;
        for (int i = 0; i < 40; i++) {
            int expected = 0;
            assert_ok(dem2d_world_particle_contacts(s.world, ids[i], own, 40, &count));
            for (int walls = 0; walls < 2; walls++)
                for (int k = 0; k < total; k++) {
                    const bool wall = all[k].wall.generation != 0;
                    const bool mine =
                        same_particle(all[k].a, ids[i]) || same_particle(all[k].b, ids[i]);
                    if (!mine || wall != (walls == 1)) continue;
                    assert_true(expected < count);
                    assert_memory_equal(&all[k], &own[expected], sizeof all[k]);
                    expected++, sum += wall ? 2 : 1;
                }
            assert_int_equal(expected, count);
            assert_ok(dem2d_world_particle_contacts(s.world, ids[i], NULL, 0, &expected));
            assert_int_equal(expected, count);
        }
        assert_int_equal(sum, 2 * total);
        hash[asks] = dem2d_world_hash(s.world);
        close_scene(&s);
    }
    assert_true(hash[0] == hash[1]);
}

/* --- counted work ------------------------------------------------------------------------------
 */

static int64_t calls;

static dem2d_vec counted_support(void *user, dem2d_vec u, double *rho) {
    (void)user;
    calls++;
    if (rho != NULL) *rho = 0.4;
    return vec(0.4 * u.x, 0.4 * u.y);
}

/* Boxes in a lattice of discs that count their support points: the work depends on what a box cuts,
   not on how many grains there are; those within the box take none. A ray takes that of the first
   hit alone. */
static void test_work(void **state) {
    (void)state;
    int64_t boxes[2][4], rays[2];
    for (int k = 0; k < 2; k++) {
        const dem2d_material_desc material = stone_desc(1e6, 0.3);
        const int side = k == 0 ? 40 : 120;
        dem2d_custom_desc custom = {.support = counted_support, .rho_min = 0.4, .inscribed = 0.4};
        dem2d_world_desc desc = {0};
        dem2d_shape *shape;
        dem2d_hit hit;
        int count;
        desc.time_step = 1e-6;
        const scene s = open_scene(&desc, &material);
        assert_ok(dem2d_shape_create_custom(NULL, &custom, &shape));
        dem2d_particle_desc grain = grain_desc(&s, give_shape(&s, shape), 1, vec(0, 0));
        for (int i = 0; i < side * side; i++) {
            grain.position = vec(i % side - side / 2, i / side - side / 2);
            add_grain(&s, &grain);
        }
        for (int n = 0; n < 4; n++) {
            const double half = 2 + 4 * n; /* its edges pass through centres */
            const dem2d_box box = {{-half, -half}, {half, half}};
            calls = 0;
            assert_ok(dem2d_world_query_box(s.world, &box, NULL, NULL, 0, &count));
            boxes[k][n] = calls;
            assert_int_equal(count, (int)((2 * half + 1) * (2 * half + 1)));
            assert_true(calls == 0); /* a box has the centres of all that it finds */
        }
        const dem2d_box cut = {{-10.7, -10.7}, {10.7, 10.7}}; /* cuts 4 rows of 21 */
        calls = 0;
        assert_ok(dem2d_world_query_box(s.world, &cut, NULL, NULL, 0, &count));
        boxes[k][0] = calls;
        assert_between((double)calls, 4 * 21, 10 * 4 * 21);
        calls = 0;
        assert_ok(dem2d_world_cast_ray(s.world, vec(-side, 0.1), vec(1, 0), 0, NULL, &hit));
        assert_near(hit.distance, side - side / 2 - sqrt(0.16 - 0.01), 1e-11);
        rays[k] = calls;
        close_scene(&s);
    }
    assert_memory_equal(boxes[0], boxes[1], sizeof boxes[0]);
    assert_between((double)rays[1], 1, (double)rays[0] + 8);
}

/* --- in a periodic cell ------------------------------------------------------------------------
   The oracle is a world without a cell, in which each particle has copies at all cell vectors
   nearby: what it finds of copy (s, t) of particle i is what the cell must tell as image (s, t). */

enum { TWINS = 12, ROWS = 19, COPIES = ROWS * ROWS }; /* copies from -9 to 9 along both */

typedef struct twins {
    scene cell, copies;
    dem2d_vec a, b;
    int count;
    dem2d_particle_id ids[TWINS];
    uint64_t random;
} twins;

static void twins_make(twins *w, dem2d_vec a, dem2d_vec b, int count) {
    const dem2d_material_desc material = stone_desc(1e6, 0.3);
    dem2d_shape_id shapes[KINDS];
    dem2d_world_desc desc = {0};
    memset(w, 0, sizeof *w);
    w->random = 5, w->count = count, desc.time_step = 1e-6;
    desc.cell.a = a, desc.cell.b = b;
    w->cell = open_scene(&desc, &material);
    for (int kind = 0; kind < KINDS; kind++) shapes[kind] = give_shape(&w->cell, make_kind(kind));
    const dem2d_vec far = vec(a.x > 0 ? a.x : 1, b.y > 0 ? b.y : 1);
    for (int i = 0; i < count; i++) {
        dem2d_particle_desc grain = grain_desc(&w->cell, shapes[i % KINDS], 1, far);
        grain.scale = random_between(&w->random, 0.5, 2);
        grain.angle = random_between(&w->random, 0, 6), grain.groups.sensor = i % 5 == 0;
        grain.position.x *= random_between(&w->random, 0, 1);
        grain.position.y *= random_between(&w->random, 0, 1);
        w->ids[i] = add_grain(&w->cell, &grain);
    }
}

/* The copies of what is in the cell now, particle by particle, row by row. */
static void twins_copy(twins *w) {
    const dem2d_material_desc material = stone_desc(1e6, 0.3);
    dem2d_shape_id shapes[KINDS];
    dem2d_world_desc desc = {0};
    dem2d_cell_info now;
    desc.time_step = 1e-6;
    w->copies = open_scene(&desc, &material);
    assert_ok(dem2d_world_get_cell(w->cell.world, &now));
    w->a = now.cell.a, w->b = now.cell.b;
    for (int kind = 0; kind < KINDS; kind++) shapes[kind] = give_shape(&w->copies, make_kind(kind));
    for (int i = 0; i < w->count; i++) {
        const dem2d_particle_info p = grain_of(&w->cell, w->ids[i]);
        for (int k = 0; k < COPIES; k++) {
            const int s = k % ROWS - ROWS / 2, t = k / ROWS - ROWS / 2;
            dem2d_particle_desc grain =
                grain_desc(&w->copies, shapes[i % KINDS], p.pose.scale, p.pose.position);
            if ((s != 0 && !(w->a.x > 0)) || (t != 0 && !(w->b.y > 0))) grain.position.y += 1e6;
            grain.position.x += s * w->a.x + t * w->b.x, grain.position.y += t * w->b.y;
            grain.angle = dem2d_rot_angle(p.pose.rotation), grain.groups.sensor = i % 5 == 0;
            assert_int_equal((int)add_grain(&w->copies, &grain).index, i * COPIES + k);
        }
    }
}

static void twins_end(twins *w) {
    close_scene(&w->cell);
    close_scene(&w->copies);
}

/* An image in the cell, as the index of its copy. */
static int copy_of(const dem2d_found *found) {
    const int s = found->shift[0] + ROWS / 2, t = found->shift[1] + ROWS / 2;
    assert_between(s, 0, ROWS - 1);
    assert_between(t, 0, ROWS - 1);
    return (int)found->particle.index * COPIES + t * ROWS + s;
}

static void check_same(const dem2d_found *images, int count, const dem2d_found *copies, int other) {
    assert_int_equal(count, other);
    for (int i = 0; i < count; i++)
        assert_int_equal(copy_of(&images[i]), (int)copies[i].particle.index);
}

static void check_same_hit(const dem2d_hit *image, const dem2d_hit *copy) {
    assert_int_equal(image->found.particle.generation, copy->found.particle.generation);
    if (image->found.particle.generation == 0) return;
    assert_int_equal(copy_of(&image->found), (int)copy->found.particle.index);
    assert_within(image->distance, copy->distance, 1e-10);
    assert_within(image->point.x, copy->point.x, 1e-9);
    assert_within(image->point.y, copy->point.y, 1e-9);
    assert_within(image->normal.x, copy->normal.x, 1e-4);
    assert_within(image->normal.y, copy->normal.y, 1e-4);
}

enum { MOST_IMAGES = TWINS * COPIES };

/* Regions from a point to three cells, at places up to two cells away. */
static void check_twin_regions(twins *w, dem2d_vec at, double width, const dem2d_query_desc *desc) {
    static dem2d_found found[MOST_IMAGES], other[MOST_IMAGES];
    dem2d_world *const worlds[2] = {w->cell.world, w->copies.world};
    dem2d_shape *shape = make_kind(random_below(&w->random, KINDS));
    dem2d_shape_info info;
    dem2d_box box = {at, {at.x + width, at.y + 0.7 * width}};
    dem2d_pose pose = {at, dem2d_rot_make(random_between(&w->random, 0, 6)), 1};
    int counts[2];
    assert_ok(dem2d_shape_get(shape, &info));
    pose.scale = 0.05 + width / info.circumscribed / 2;
    for (int kind = 0; kind < 3; kind++) {
        for (int k = 0; k < 2; k++) {
            dem2d_found *to = k == 0 ? found : other;
            if (kind == 0)
                assert_ok(
                    dem2d_world_query_box(worlds[k], &box, desc, to, MOST_IMAGES, &counts[k]));
            if (kind == 1)
                assert_ok(
                    dem2d_world_query_point(worlds[k], at, desc, to, MOST_IMAGES, &counts[k]));
            if (kind == 2)
                assert_ok(dem2d_world_query_shape(worlds[k], shape, pose, desc, to, MOST_IMAGES,
                                                  &counts[k]));
        }
        check_same(found, counts[0], other, counts[1]);
    }
    dem2d_shape_destroy(shape);
}

static void check_twin_rays(twins *w, dem2d_vec at, double length, const dem2d_query_desc *desc) {
    static dem2d_hit hits[MOST_IMAGES], other[MOST_IMAGES];
    dem2d_hit first, second;
    int count, more;
    const int eighth = random_below(&w->random, 16); /* often along an axis */
    const dem2d_vec d =
        direction(eighth < 8 ? eighth * half_turn / 4 : random_between(&w->random, 0, 6));
    assert_ok(
        dem2d_world_cast_ray_all(w->cell.world, at, d, length, desc, hits, MOST_IMAGES, &count));
    assert_ok(
        dem2d_world_cast_ray_all(w->copies.world, at, d, length, desc, other, MOST_IMAGES, &more));
    assert_int_equal(count, more);
    for (int i = 0; i < count; i++) check_same_hit(&hits[i], &other[i]);
    assert_ok(dem2d_world_cast_ray(w->cell.world, at, d, length, desc, &first));
    assert_ok(dem2d_world_cast_ray(w->copies.world, at, d, length, desc, &second));
    check_same_hit(&first, &second);
    assert_ok(dem2d_world_nearest(w->cell.world, at, length > 1 ? 0 : length, desc, &first));
    assert_ok(dem2d_world_nearest(w->copies.world, at, length > 1 ? 0 : length, desc, &second));
    check_same_hit(&first, &second);
}

/* Overlaps of the particles themselves, and of new ones. */
static void check_twin_particles(twins *w, dem2d_vec at) {
    static dem2d_found found[MOST_IMAGES], other[MOST_IMAGES];
    for (int i = 0; i < w->count; i++) {
        dem2d_particle_id middle = {(uint32_t)(i * COPIES + COPIES / 2), 1};
        int count, more;
        assert_ok(dem2d_world_particle_overlaps(w->cell.world, w->ids[i], NULL, found, MOST_IMAGES,
                                                &count));
        assert_ok(dem2d_world_particle_overlaps(w->copies.world, middle, NULL, other, MOST_IMAGES,
                                                &more));
        check_same(found, count, other, more);
    }
    double overlaps[2];
    dem2d_particle_desc grain = grain_desc(&w->cell, give_shape(&w->cell, make_disc(0.2)), 1, at);
    assert_ok(dem2d_world_overlap_at(w->cell.world, &grain, &overlaps[0]));
    grain.shape = give_shape(&w->copies, make_disc(0.2));
    assert_ok(dem2d_world_overlap_at(w->copies.world, &grain, &overlaps[1]));
    assert_within(overlaps[0], overlaps[1], 1e-12);
}

/* Upright, tilted by more than itself, periodic along x or b alone, with a single particle; a cell
   that has been sheared and has changed its vector b. */
static void test_cells(void **state) {
    (void)state;
    static const dem2d_vec cells[6][2] = {{{1, 0}, {0, 1.3}},     {{0.8, 0}, {2.1, 1.1}},
                                          {{1, 0}, {0, 0}},       {{0, 0}, {0.4, 0.9}},
                                          {{0.41, 0}, {0, 0.43}}, {{1, 0}, {-0.45, 1}}};
    static twins w;
    for (int k = 0; k < 6; k++) {
        twins_make(&w, cells[k][0], cells[k][1], k == 4 ? 1 : TWINS);
        if (k == 5) {
            dem2d_deformation_desc shear = {0};
            shear.xy = -1000, shear.yy = 100;
            assert_ok(dem2d_world_deform(w.cell.world, &shear));
            step(&w.cell, 300);
        }
        twins_copy(&w);
        for (int round = 0; round < 40; round++) {
            const dem2d_vec at =
                vec(random_between(&w.random, -1, 1.5), random_between(&w.random, -0.8, 1.2));
            const double size = pow(random_between(&w.random, 0, 1), 3);
            const dem2d_query_desc desc = {false, false, round % 3 == 0, 0};
            check_twin_regions(&w, at, k == 4 ? 0.5 * size : size, &desc);
            check_twin_rays(&w, at, k == 4 ? 0.1 + size : 0.1 + 2 * size, &desc);
            if (round < 4 && k != 4) check_twin_particles(&w, at);
        }
        twins_end(&w);
    }
}

/* A wall that is higher than three rows of a cell that leans: a ray crosses rows together, and finds
   nothing in one between others. The first hit is the nearest of all. */
static void test_rows(void **state) {
    (void)state;
    dem2d_world_desc desc = {0};
    uint64_t random = 3;
    desc.time_step = 1e-4, desc.cell.a = vec(4, 0), desc.cell.b = vec(1.5, 1);
    const dem2d_material_desc stone = stone_desc(1e7, 0.5);
    const scene s = open_scene(&desc, &stone);
    (void)add_segment(&s, vec(0, -1.6), vec(0.01, 1.6));
    for (int k = 0; k < 2000; k++) {
        const double angle = random_between(&random, -4, 4);
        const double x = random_between(&random, -3, 3), y = random_between(&random, -2, 2);
        dem2d_hit first, all[64];
        int count;
        assert_ok(
            dem2d_world_cast_ray(s.world, vec(x, y), vec(cos(angle), sin(angle)), 9, NULL, &first));
        assert_ok(dem2d_world_cast_ray_all(s.world, vec(x, y), vec(cos(angle), sin(angle)), 9, NULL,
                                           all, COUNT_OF(all), &count));
        assert_true(count <= COUNT_OF(all));
        assert_int_equal(count > 0, first.found.wall.generation > 0);
        assert_true(count == 0 || first.distance == all[0].distance);
    }
    close_scene(&s);
}

/* Large regions, long rays, distant places; half-planes; what can't be asked. */
static void test_cell_contract(void **state) {
    (void)state;
    const dem2d_material_desc material = stone_desc(1e6, 0.3);
    test_env env;
    dem2d_world_desc desc = {0};
    dem2d_found found[4];
    dem2d_hit hit;
    double overlap;
    int count;
    test_env_init(&env);
    desc.time_step = 1e-6, desc.env = &env.env;
    desc.cell.a = vec(1, 0);
    scene s = open_scene(&desc, &material);
    const dem2d_particle_id disc =
        add_shape(&s, make_disc(0.3), DEM2D_FREE, vec(0.2, 0.5), 0, vec(0, 0), 0);
    const dem2d_wall_id floor = add_plane(&s, 0, 0.25, 0, 1);
    dem2d_box box = {{0, 0.4}, {1000, 0.6}};
    assert_ok(dem2d_world_query_box(s.world, &box, NULL, found, 2, &count));
    assert_int_equal(count, 1001); /* from -0.1 on, ... from 999.9 on */
    assert_int_equal(found[1].shift[0], 1);
    assert_ok(dem2d_world_wall_overlaps(s.world, floor, NULL, found, 4, &count));
    assert_int_equal(count, 1);
    assert_int_equal(found[0].shift[0], 0);
    assert_ok(dem2d_world_cast_ray(s.world, vec(1e6 + 0.75, 0.5), vec(-1, 0), 1e7, NULL, &hit));
    assert_int_equal(hit.found.shift[0], 1000000);
    assert_within(hit.distance, 0.25, 1e-9);
    assert_ok(dem2d_world_cast_ray(s.world, vec(0.75, 0.5), vec(0, -1), 10, NULL, &hit));
    assert_int_equal(hit.found.wall.generation, floor.generation);
    assert_ok(dem2d_world_nearest(s.world, vec(-123456.2, 0.9), 0, NULL, &hit));
    assert_int_equal(hit.found.particle.index, disc.index);
    assert_int_equal(hit.found.shift[0], -123457 + 1);
    assert_ok(dem2d_world_nearest(s.world, vec(0.2, 30), 5, NULL, &hit));
    assert_int_equal(hit.found.particle.generation + hit.found.wall.generation, 0);
    const dem2d_box all = {{-1e300, -1e300}, {1e300, 1e300}};
    assert_result(dem2d_world_query_box(s.world, &all, NULL, found, 4, &count), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "2^30 cells");
    assert_result(dem2d_world_nearest(s.world, vec(1e10, 0), 0, NULL, &hit), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_cast_ray(s.world, vec(0, 0), vec(1, 0), 0, NULL, &hit),
                  DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "length = 0");
    dem2d_particle_desc wide = grain_desc(&s, give_shape(&s, make_disc(0.6)), 1, vec(7.5, 9));
    assert_ok(dem2d_world_overlap_at(s.world, &wide, &overlap)); /* with its own images */
    assert_within(overlap, 0.2, 1e-12);
    wide.groups.sensor = true;
    assert_ok(dem2d_world_overlap_at(s.world, &wide, &overlap));
    assert_within(overlap, 0, 0);
    close_scene(&s);
    assert_clean(&env);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),      cmocka_unit_test(test_rays),
        cmocka_unit_test(test_custom_rays), cmocka_unit_test(test_contract),
        cmocka_unit_test(test_extremes),    cmocka_unit_test(test_pile),
        cmocka_unit_test(test_work),        cmocka_unit_test(test_cells),
        cmocka_unit_test(test_rows),        cmocka_unit_test(test_cell_contract),
    };
    return cmocka_run_group_tests(tests, oracle_make, NULL);
}
