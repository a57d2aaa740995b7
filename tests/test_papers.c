/* The papers' way, whole: every pair searched anew by GJK and EPA, circles too; the contact point
   at walls; EPA's residual; branch directions; the swarm's settings. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"

#include <math.h>

#define KN 1e7

enum { GRAINS = 24, WALLS = 3 };

typedef struct heap {
    scene s;
    dem2d_particle_id grains[GRAINS];
} heap;

static dem2d_shape *make_shape(int kind) {
    const dem2d_vec corners[4] = {{0, 0}, {2, 0.2}, {1.6, 1.5}, {0.2, 1.2}};
    const double a[4] = {2.0, 0, 0.08, 0.03}, b[4] = {0, 0, 0.05, 0.02};
    if (kind == 0) return make_disc(1);
    if (kind == 1) return make_ellipse(1.3, 0.8);
    return kind == 2 ? make_polygon(corners, 4, 0) : make_series(a, b, 3);
}

/* A heap of circles, ellipses, polygons and FS in a box, while it is falling. */
static heap make_heap(dem2d_solver solver, dem2d_face_rule faces) {
    const dem2d_material_desc material = stone_desc(KN, 0.3);
    dem2d_world_desc desc = {0};
    dem2d_shape_id shapes[4];
    heap h;
    desc.time_step = 1e-4, desc.gravity.y = -9.81, desc.local_damping = 0.3;
    desc.solver = solver, desc.faces = faces;
    h.s = open_scene(&desc, &material);
    for (int k = 0; k < 4; k++) shapes[k] = give_shape(&h.s, make_shape(k));
    for (int i = 0; i < GRAINS; i++) {
        const dem2d_vec at = vec(0.035 + 0.062 * (i % 4), 0.035 + 0.062 * (double)(i / 4));
        dem2d_particle_desc grain = grain_desc(&h.s, shapes[(i * 7) % 4], 0.025, at);
        grain.angle = i;
        h.grains[i] = add_grain(&h.s, &grain);
    }
    add_floor(&h.s), add_plane(&h.s, 0, 0, 1, 0), add_plane(&h.s, 0.26, 0, -1, 0);
    return h;
}

/* Looks and support calls that a step of the papers makes for the present positions: of each pair
   whose bounding circles overlap, GJK and EPA from the line of centres. */
static void expect_step(const heap *h, int64_t *looks, int64_t *gaps, int64_t *calls) {
    dem2d_contact_desc desc = {0};
    desc.solver = DEM2D_GJK_EPA, desc.tolerance = 1e-8, desc.skip_points = true;
    *looks = *gaps = *calls = 0;
    for (int i = 0; i < GRAINS; i++)
        for (int k = 0; k < i; k++) {
            dem2d_particle_info a, b;
            dem2d_contact contact;
            assert_ok(dem2d_world_get_particle(h->s.world, h->grains[k], &a));
            assert_ok(dem2d_world_get_particle(h->s.world, h->grains[i], &b));
            const double dx = b.pose.position.x - a.pose.position.x;
            const double dy = b.pose.position.y - a.pose.position.y;
            if (sqrt(dx * dx + dy * dy) >= a.radius + b.radius) continue;
            const dem2d_shape *one = dem2d_world_shape(h->s.world, a.shape);
            const dem2d_shape *other = dem2d_world_shape(h->s.world, b.shape);
            assert_ok(dem2d_pair_overlap(one, a.pose, other, b.pose, &desc, &contact));
            if (contact.depth > 0)
                assert_ok(dem2d_pair_contact(one, a.pose, other, b.pose, &desc, &contact));
            ++*looks;
            *gaps += !(contact.depth > 0);
            *calls += contact.support_calls;
        }
}

/* Support calls at walls: one for each grain but circles that reaches a wall with its bounding
   circle. */
static int64_t wall_calls(const heap *h) {
    int64_t calls = 0;
    for (int i = 0; i < GRAINS; i++) {
        dem2d_particle_info grain;
        dem2d_shape_info shape;
        assert_ok(dem2d_world_get_particle(h->s.world, h->grains[i], &grain));
        assert_ok(dem2d_shape_get(dem2d_world_shape(h->s.world, grain.shape), &shape));
        if (shape.type == DEM2D_CIRCLE) continue;
        calls += grain.pose.position.y < grain.radius;
        calls += grain.pose.position.x < grain.radius;
        calls += 0.26 - grain.pose.position.x < grain.radius;
    }
    return calls;
}

static void test_every_pair_anew(void **state) {
    (void)state;
    heap h = make_heap(DEM2D_GJK_EPA, DEM2D_ONE_POINT);
    for (int step = 0; step < 3000; step++) {
        int64_t looks = 0, gaps = 0, calls = 0, walls = 0;
        const bool ask = step % 100 == 0;
        const dem2d_stats before = stats_of(&h.s);
        if (ask) expect_step(&h, &looks, &gaps, &calls), walls = wall_calls(&h);
        assert_ok(dem2d_world_step(h.s.world, 1, NULL));
        if (!ask) continue;
        const dem2d_stats after = stats_of(&h.s);
        assert_int_equal(after.collisions - before.collisions, looks);
        assert_int_equal(after.separations - before.separations, gaps);
        assert_int_equal(after.support_calls - before.support_calls, calls + walls);
    }
    const dem2d_stats end = stats_of(&h.s);
    assert_true(end.contacts + end.wall_contacts > GRAINS / 2); /* the scene has some */
    assert_true(end.proofs[DEM2D_BY_FORM] == 0 && end.proofs[DEM2D_BY_POLYTOPE] > 0);
    dem2d_world_destroy(h.s.world);
}

/* Of the papers' rule the middle between support point and foot point, else the foot point; the
   rule decides nothing else of the first contacts. Half-planes and segments. */
static void test_wall_point(void **state) {
    (void)state;
    for (int i = 0; i < 4 * 2 * 2; i++) {
        const bool one = i & 1, segment = i & 2;
        dem2d_world_desc desc = {0};
        dem2d_material_desc stone = {0};
        dem2d_material_id material;
        dem2d_particle_desc grain = {0};
        dem2d_particle_id id;
        dem2d_wall_desc wall = {0};
        dem2d_wall_id floor;
        dem2d_world *world;
        dem2d_contact_info contact;
        dem2d_support support;
        int count;
        desc.time_step = 1e-5, desc.faces = one ? DEM2D_ONE_POINT : DEM2D_TWO_POINTS;
        desc.contact_tolerance = 1e-13;
        assert_ok(dem2d_world_create(&desc, &world));
        stone.density = 2700, stone.normal_stiffness = KN;
        assert_ok(dem2d_world_add_material(world, &stone, &material));
        dem2d_shape *shape = make_shape(i / 4);
        const dem2d_pose pose = dem2d_pose_make(0.3, 0, 0.4, 0.1);
        assert_ok(dem2d_shape_support(shape, pose, vec(0, -1), &support));
        assert_ok(dem2d_world_add_shape(world, shape, &grain.shape));
        dem2d_shape_destroy(shape);
        grain.material = wall.material = material;
        grain.scale = 0.1, grain.angle = 0.4;
        grain.position = vec(0.3, -support.point.y - 1e-3); // 1 mm deep
        wall.normal = vec(0, 1);
        wall.segment = segment, wall.point = vec(segment ? 2 : 0, 0);
        if (segment) wall.end = vec(-2, 0);
        assert_ok(dem2d_world_add_particle(world, &grain, &id));
        assert_ok(dem2d_world_add_wall(world, &wall, &floor));
        assert_ok(dem2d_world_step(world, 1, NULL));
        assert_ok(dem2d_world_contacts(world, &contact, 1, &count));
        assert_int_equal(count, 1);
        assert_int_equal(contact.points, 1);
        assert_within(contact.depth, 1e-3, 1e-12);
        assert_within(contact.point.x, support.point.x, 1e-7); // rho times the error of the normal
        assert_within(contact.point.y, one ? -5e-4 : 0, 1e-12);
        assert_within(contact.normal_force, KN * 1e-3, 1e-4);
        dem2d_world_destroy(world);
    }
}

/* EPA's residual: |W| less the polytope's distance. It is never below the error of the depth, ends
   small for smooth shapes, rises now and then ([P] sec. 5.2.2), and is 0 of other solvers. */
static void test_residual(void **state) {
    (void)state;
    uint64_t random = 7;
    int rises = 0;
    for (int i = 0; i < 400; i++) {
        dem2d_shape *a = make_shape(1 + i % 3), *b = make_shape(1 + i / 3 % 3);
        const dem2d_pose at = dem2d_pose_make(0, 0, random_between(&random, 0, 6), 1);
        const double angle = random_between(&random, 0, 6), far = random_between(&random, 0.3, 1.2);
        const dem2d_pose there = dem2d_pose_make(far * cos(angle), far * sin(angle), i, 1);
        dem2d_contact_desc desc = {0};
        dem2d_contact c;
        double last = HUGE_VAL;
        assert_ok(dem2d_pair_contact(a, at, b, there, &desc, &c));
        assert_true(c.residual == 0);
        desc.solver = DEM2D_GJK_EPA;
        for (desc.max_iterations = 1; desc.max_iterations < 40; desc.max_iterations++) {
            assert_ok(dem2d_pair_contact(a, at, b, there, &desc, &c));
            if (c.state == DEM2D_SEPARATED) break;
            if (c.residual == 0) continue; // GJK is not done
            assert_true(c.error <= c.residual + 1e-13);
            rises += c.residual > last * (1 + 1e-9);
            last = c.residual;
            if (c.state == DEM2D_PENETRATING) break;
        }
        const bool smooth = i % 3 != 1 && i / 3 % 3 != 1;
        if (smooth && c.state == DEM2D_PENETRATING) assert_true(last < 1e-8); // tolerance 5e-10
        dem2d_shape_destroy(a);
        dem2d_shape_destroy(b);
    }
    assert_true(rises > 0);
}

/* [P] sec. 5.3: contacts by the direction of their branch, which of grains that are no circles is
   not their normal's. */
static void test_branch_directions(void **state) {
    (void)state;
    enum { BINS = 9, MOST = 4 * GRAINS };
    heap h = make_heap(DEM2D_CERTIFIED, DEM2D_TWO_POINTS);
    dem2d_contact_info contacts[MOST];
    double values[BINS], expected[BINS] = {0}, normals[BINS];
    int count, others = 0;
    assert_ok(dem2d_world_step(h.s.world, 4000, NULL));
    assert_ok(dem2d_world_contacts(h.s.world, contacts, MOST, &count));
    assert_in_range(count, GRAINS, MOST);
    for (int i = 0; i < count; i++) {
        if (contacts[i].b.generation == 0) continue;
        const double angle =
            atan2(contacts[i].branch.y, contacts[i].branch.x) / (2 * (double)TEST_PI);
        expected[(int)(BINS * (angle < 0 ? angle + 1 : angle))]++;
        expected[(int)(BINS * (angle + 0.5))]++;
    }
    assert_ok(dem2d_world_histogram(h.s.world, DEM2D_HISTOGRAM_ALONG_BRANCH, BINS, values));
    assert_ok(dem2d_world_histogram(h.s.world, DEM2D_HISTOGRAM_NORMAL, BINS, normals));
    for (int i = 0; i < BINS; i++) {
        assert_true(values[i] == expected[i]);
        others += values[i] != normals[i];
    }
    assert_true(others > 0);
    dem2d_world_destroy(h.s.world);
}

/* The settings are what is used: the defaults given give the same bits, others not. */
static void test_swarm_settings(void **state) {
    (void)state;
    enum { POINTS = 40, ARCS = 5, WAYS = 5 };
    static const int settings[WAYS][3] = {
        {0, 0, 0}, {30, 60, 256}, {12, 60, 256}, {30, 20, 256}, {30, 60, 64}};
    dem2d_vec points[POINTS];
    dem2d_fit_report report[WAYS];
    for (int i = 0; i < POINTS; i++) {
        const double t = 2 * (double)TEST_PI * i / POINTS,
                     r = 1 + 0.2 * sin(2 * t) + 0.05 * cos(5 * t);
        points[i] = vec(r * cos(t), r * sin(t));
    }
    for (int i = 0; i < WAYS; i++) {
        dem2d_fit_desc desc = {0};
        dem2d_shape *shape;
        desc.model = DEM2D_BEZIER, desc.method = DEM2D_FIT_SWARM, desc.count = ARCS;
        desc.birds = settings[i][0], desc.moves = settings[i][1], desc.pixels = settings[i][2];
        assert_ok(dem2d_outline_fit(NULL, points, POINTS, &desc, &shape, &report[i]));
        dem2d_shape_destroy(shape);
        assert_int_equal(report[i].iterations, ARCS * (desc.moves > 0 ? desc.moves : 60));
        if (i == 1) assert_same_bits(report[1].coverage, report[0].coverage);
        if (i > 1) assert_true(report[i].coverage != report[0].coverage);
        assert_within(report[i].coverage, report[0].coverage, 0.02);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_pair_anew), cmocka_unit_test(test_wall_point),
        cmocka_unit_test(test_residual),        cmocka_unit_test(test_branch_directions),
        cmocka_unit_test(test_swarm_settings),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
