/* Segment walls: depth and normal against a scan of their points, joints that count once, sliding
   over them, boxes across them, hoppers. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"

#define KN 1e7

static scene make_scene(double friction, dem2d_vec gravity, bool ledger) {
    const dem2d_material_desc material = stone_desc(KN / 2, friction);
    dem2d_world_desc desc = {0};
    desc.time_step = 1e-5, desc.gravity = gravity, desc.ledger = ledger;
    return open_scene(&desc, &material);
}

/* Takes the shape. */
static dem2d_particle_id add(const scene *s, dem2d_shape *shape, dem2d_vec at, double angle,
                             dem2d_vec velocity) {
    return add_shape(s, shape, DEM2D_FREE, at, angle, velocity, 0);
}

enum { DISC, ELLIPSE, BOX, ROUNDED, LOBES, SHAPES };

static dem2d_shape *make_shape(int kind) {
    const dem2d_vec corners[4] = {{0, 0}, {0.1, 0}, {0.1, 0.06}, {0, 0.06}};
    const double a[4] = {0.09, 0, 0, 0.003}, b[4] = {0, 0, 0, 0};
    if (kind == DISC) return make_disc(0.05);
    if (kind == ELLIPSE) return make_ellipse(0.06, 0.03);
    if (kind == LOBES) return make_series(a, b, 3);
    return make_polygon(corners, 4, kind == ROUNDED ? 0.01 : 0);
}

/* Least over all directions of the support value of shape minus segment, by a scan. */
static long double scan_depth(const dem2d_shape *shape, dem2d_pose pose, dem2d_vec from,
                              dem2d_vec to) {
    long double least = 1e9L, best = 0, step = 2 * TEST_PI / 7200;
    for (int round = 0; round < 4; round++) {
        const long double middle = best, width = step;
        const int count = round == 0 ? 7200 : 200;
        if (round > 0) step = 2 * width / count;
        for (int i = 0; i <= count; i++) {
            const long double angle = round == 0 ? i * step : middle - width + i * step;
            const dem2d_vec u = {(double)cosl(angle), (double)sinl(angle)};
            dem2d_support support;
            assert_ok(dem2d_shape_support(shape, pose, u, &support));
            const long double a =
                (from.x - pose.position.x) * cosl(angle) + (from.y - pose.position.y) * sinl(angle);
            const long double b =
                (to.x - pose.position.x) * cosl(angle) + (to.y - pose.position.y) * sinl(angle);
            const long double h = support.value - (a < b ? a : b);
            if (h < least) least = h, best = angle;
        }
    }
    return least;
}

/* One particle near one segment, beside its side or its ends. */
static void test_depth(void **state) {
    (void)state;
    uint64_t random = 5;
    int found = 0;
    for (int i = 0; i < 400; i++) {
        scene s = make_scene(0.3, vec(0, 0), false);
        const double angle = random_between(&random, 0, 6.28), length = i % 2 ? 0.03 : 0.4;
        const dem2d_vec from = vec(1, 2);
        const dem2d_vec to = vec(from.x + length * cos(angle), from.y + length * sin(angle));
        const double place = random_between(&random, -0.05, length + 0.05);
        const double away = random_between(&random, 0.02, 0.06) * (i % 3 ? 1 : -1);
        const dem2d_vec at = vec(from.x + place * cos(angle) - away * sin(angle),
                                 from.y + place * sin(angle) + away * cos(angle));
        const double turn = random_between(&random, 0, 6.28);
        add_segment(&s, from, to);
        dem2d_shape *shape = make_shape(i % SHAPES);
        const dem2d_pose pose = dem2d_pose_make(at.x, at.y, turn, 1);
        const long double depth = scan_depth(shape, pose, from, to);
        add(&s, shape, at, turn, vec(0, 0));
        step(&s, 1);
        dem2d_contact_info contact;
        int count;
        assert_ok(dem2d_world_contacts(s.world, &contact, 1, &count));
        assert_int_equal(count, depth > 0);
        if (depth > 0 && contact.points == 1) assert_within(contact.depth, depth, 1e-9);
        if (depth > 0) {
            assert_within(contact.depth, depth, 1e-4);
            assert_true(contact.wall.generation > 0 && contact.normal_force > 0);
            found++;
        }
        close_scene(&s);
    }
    assert_true(found > 100);
}

/* A shape slides without friction along a floor of pieces, and along one piece: the same. With
   friction, a disc rolls on alike. The ledger closes as well. */
static void test_flat_joints(void **state) {
    (void)state;
    for (int kind = 0; kind < SHAPES; kind++)
        for (int rough = 0; rough < 2; rough++) {
            /* the springs of two points are not shared out over both sides of a joint: a sliding
               box's start anew on one side, each time */
            const bool two = kind == BOX || kind == ROUNDED;
            dem2d_particle_info info[2];
            for (int pieces = 0; pieces < 2; pieces++) {
                scene s = make_scene(rough ? 0.5 : 0, vec(0, -9.81), true);
                const int count = pieces ? 7 : 1;
                for (int k = 0; k < count; k++) /* some to the left, some to the right */
                    if (k % 2)
                        add_segment(&s, vec(2.0 * k / count - 0.5, 0),
                                    vec(2.0 * (k + 1) / count - 0.5, 0));
                    else
                        add_segment(&s, vec(2.0 * (k + 1) / count - 0.5, 0),
                                    vec(2.0 * k / count - 0.5, 0));
                dem2d_shape *shape = make_shape(kind);
                dem2d_support low;
                assert_ok(dem2d_shape_support(shape, still(), vec(0, -1), &low));
                const double y = low.value - 2e-5;
                dem2d_particle_id id = add(&s, shape, vec(0, y), 0, vec(1, 0));
                for (int i = 0; i < 400; i++) {
                    int open;
                    dem2d_contact_info contacts[4];
                    step(&s, 100);
                    assert_ok(dem2d_world_contacts(s.world, contacts, 4, &open));
                    int points = 0;
                    for (int c = 0; c < open; c++) points += contacts[c].points;
                    assert_true(points <= (two ? 2 : 1));
                }
                dem2d_ledger ledger;
                assert_ok(dem2d_world_ledger(s.world, &ledger));
                assert_within(ledger.closure, 0, (rough && two ? 1e-2 : 1e-4) * ledger.given);
                assert_ok(dem2d_world_get_particle(s.world, id, &info[pieces]));
                close_scene(&s);
            }
            const double far = rough && two ? 1e-3 : 2e-5;
            assert_within(info[1].pose.position.x, info[0].pose.position.x, far);
            assert_within(info[1].velocity.x, info[0].velocity.x, 10 * far);
            if (!rough) assert_within(info[0].pose.position.x, 0.4, 1e-6);
            /* rough boxes rock on, each at its own time: by some 5e-5 up and down */
            assert_within(info[1].pose.position.y, info[0].pose.position.y,
                          rough && two ? 1e-4 : 2e-5);
            if (kind == DISC || (two && !rough)) /* the others rock for long */
                assert_within(info[1].velocity.y, info[0].velocity.y, 1e-3);
        }
}

static double total_force(const dem2d_world *world, dem2d_vec *sum) {
    dem2d_contact_info contacts[16];
    int count;
    *sum = vec(0, 0);
    assert_ok(dem2d_world_contacts(world, contacts, 16, &count));
    for (int i = 0; i < count; i++)
        if (contacts[i].wall.generation > 0) {
            sum->x += contacts[i].normal_force * contacts[i].normal.x;
            sum->y += contacts[i].normal_force * contacts[i].normal.y;
        }
    return count;
}

/* A disc on the common end of three segments: one contact, along the line to its centre. In a
   trough: two. */
static void test_joint_kinds(void **state) {
    (void)state;
    dem2d_vec force;
    scene s = make_scene(0, vec(0, 0), false);
    add_segment(&s, vec(0, 0), vec(-1, -1));
    add_segment(&s, vec(1, -1), vec(0, 0));
    add_segment(&s, vec(0, 0), vec(0, -1));
    add(&s, make_shape(DISC), vec(0.01, 0.048), 0, vec(0, 0));
    step(&s, 1);
    assert_int_equal(total_force(s.world, &force), 1);
    const double distance = hypot(0.01, 0.048);
    assert_near(-force.y, KN * (0.05 - distance) * 0.048 / distance, 1e-9);
    close_scene(&s);
    s = make_scene(0, vec(0, 0), false);
    add_segment(&s, vec(-1, 1), vec(0, 0));
    add_segment(&s, vec(0, 0), vec(1, 1));
    add(&s, make_shape(DISC), vec(0, 0.07), 0, vec(0, 0));
    step(&s, 1);
    assert_int_equal(total_force(s.world, &force), 2);
    assert_near(-force.y, 2 * KN * (0.05 - 0.07 / sqrt(2)) / sqrt(2), 1e-9);
    close_scene(&s);
    /* a box on a flat joint: one contact of two points */
    s = make_scene(0, vec(0, 0), false);
    add_segment(&s, vec(-1, 0), vec(0, 0));
    add_segment(&s, vec(0, 0), vec(1, 0));
    add(&s, make_shape(BOX), vec(0.01, 0.03 - 1e-5), 0, vec(0, 0));
    step(&s, 1);
    assert_int_equal(total_force(s.world, &force), 1);
    assert_near(-force.y, 2 * KN * 1e-5, 1e-9);
    close_scene(&s);
}

/* Discs fall through a hopper and out: none is lost in the walls, all arrive below. A segment may
   move, be servo-controlled, replaced and removed. */
static void test_hopper(void **state) {
    (void)state;
    scene s = make_scene(0.1, vec(0, -9.81), false);
    assert_ok(dem2d_world_set_damping(s.world, 0.1, 0));
    assert_ok(dem2d_world_set_time_step(s.world, 4e-5));
    const dem2d_vec left[3] = {{-0.4, 1.2}, {-0.4, 0.5}, {-0.15, 0}};
    for (int k = 0; k < 2; k++) {
        add_segment(&s, left[k], left[k + 1]);
        add_segment(&s, vec(-left[k].x, left[k].y), vec(-left[k + 1].x, left[k + 1].y));
    }
    dem2d_particle_id ids[40];
    for (int i = 0; i < 40; i++)
        ids[i] = add(&s, make_shape(i % SHAPES), vec(-0.26 + 0.13 * (i % 5), 0.55 + 0.13 * (i / 5)),
                     i, vec(0, 0));
    step(&s, 60000); /* the last one is out after about 1.7 s, as the pile happens to fall */
    for (int i = 0; i < 40; i++) {
        dem2d_particle_info info;
        assert_ok(dem2d_world_get_particle(s.world, ids[i], &info));
        assert_true(info.pose.position.y < 0);
        assert_true(isfinite(info.pose.position.x));
    }
    close_scene(&s);
}

static void test_moves(void **state) {
    (void)state;
    scene s = make_scene(0.3, vec(0, 0), false);
    dem2d_wall_id floor_id = add_segment(&s, vec(-0.2, 0), vec(0.2, 0));
    dem2d_particle_id id = add(&s, make_shape(DISC), vec(0, 0.05), 0, vec(0, 0));
    dem2d_wall_desc lid = {0};
    dem2d_wall_id lid_id;
    dem2d_wall_info info;
    lid.material = s.material, lid.segment = true, lid.mode = DEM2D_WALL_SERVO;
    lid.point = vec(0.1, 0.11), lid.end = vec(-0.1, 0.11); /* its left is below */
    lid.stress = 1e4, lid.max_speed = 0.1;
    assert_ok(dem2d_world_add_wall(s.world, &lid, &lid_id));
    assert_ok(dem2d_world_set_damping(s.world, 0.5, 0));
    step(&s, 30000);
    assert_ok(dem2d_world_get_wall(s.world, lid_id, &info));
    assert_near(info.length, 0.2, 1e-14);
    assert_near(info.stress, 1e4, 1e-3);
    assert_near(info.end.y, info.point.y, 1e-12);
    assert_near(info.normal.y, -1, 1e-12);
    dem2d_wall_desc moving = {0};
    moving.material = s.material, moving.segment = true, moving.mode = DEM2D_WALL_MOVING;
    moving.point = vec(-0.2, 0), moving.end = vec(0.2, 0), moving.velocity = vec(0.5, 0);
    assert_ok(dem2d_world_set_wall(s.world, floor_id, &moving));
    step(&s, 1000);
    dem2d_particle_info disc;
    assert_ok(dem2d_world_get_particle(s.world, id, &disc));
    assert_true(disc.velocity.x > 0); /* dragged along */
    moving.end = moving.point;
    assert_result(dem2d_world_set_wall(s.world, floor_id, &moving), DEM2D_OUT_OF_RANGE);
    moving.end.x = (double)NAN;
    assert_result(dem2d_world_set_wall(s.world, floor_id, &moving), DEM2D_NOT_FINITE);
    moving.segment = false, moving.normal = vec(0, 1); /* it would be saved with the wall */
    assert_result(dem2d_world_set_wall(s.world, floor_id, &moving), DEM2D_NOT_FINITE);
    moving.segment = true;
    assert_ok(dem2d_world_remove_wall(s.world, lid_id));
    step(&s, 10);
    close_scene(&s);
}

/* Regular polygons cut through by a longer segment along two of their edges: the overlap is that of
   the nearer edge. The segment has two edges half a turn apart, the next is never passed twice. */
static void test_cut_through(void **state) {
    (void)state;
    for (int corners = 4; corners <= 12; corners += 2)
        for (int i = -9; i <= 9; i++)
            for (int edge = 0; edge < corners; edge++) {
                dem2d_vec points[12];
                dem2d_contact_info contact;
                dem2d_shape *shape;
                int count;
                const double r = 0.05 / cos(TEST_PI / corners), h = i * 0.005;
                for (int k = 0; k < corners; k++) {
                    const dem2d_vec u = direction((2 * k + 1) * TEST_PI / corners);
                    points[k] = vec(r * u.x, r * u.y);
                }
                const dem2d_vec n = direction(2 * edge * TEST_PI / corners);
                assert_ok(dem2d_shape_create_polygon(NULL, points, corners, 0, &shape));
                scene s = make_scene(0, vec(0, 0), false);
                add_segment(&s, vec(h * n.x - 0.2 * n.y, h * n.y + 0.2 * n.x),
                            vec(h * n.x + 0.1 * n.y, h * n.y - 0.1 * n.x));
                add(&s, shape, vec(0, 0), 0, vec(0, 0));
                step(&s, 1);
                assert_ok(dem2d_world_contacts(s.world, &contact, 1, &count));
                assert_int_equal(count, 1);
                assert_within(contact.depth, 0.05 - fabs(h), 1e-14);
                close_scene(&s);
            }
}

/* A disc at the joint of two segments, in line or in a valley, is put elsewhere by less than its
   skin, where it has another contact or none: only the contacts that are there push it. */
static void test_moved_off_joint(void **state) {
    static const dem2d_vec from[2] = {{-0.001, 0.049}, {0, 0.049}};
    static const dem2d_vec to[2] = {{0.001, 0.049}, {0, 0.051}};
    (void)state;
    for (int valley = 0; valley < 2; valley++) {
        const dem2d_material_desc material = stone_desc(0, 0);
        dem2d_contact_info contacts[4];
        dem2d_world_desc desc = {0};
        dem2d_stats stats;
        desc.time_step = 1e-5, desc.skin = 0.3;
        scene s = open_scene(&desc, &material);
        add_segment(&s, vec(-0.5, valley * 0.05), vec(0, 0));
        add_segment(&s, vec(0, 0), vec(0.5, valley * 0.05));
        const dem2d_particle_id id = add(&s, make_shape(DISC), from[valley], 0, vec(0, 0));
        step(&s, 1);
        assert_int_equal(contacts_of(&s, contacts, 4), valley ? 3 : 1);
        const dem2d_particle_info before = grain_of(&s, id);
        assert_true(before.velocity.y > 0);
        assert_ok(dem2d_world_move_particle(s.world, id, to[valley], 0));
        for (int i = 1; i <= 3; i++) {
            const double last = grain_of(&s, id).velocity.y;
            step(&s, 1);
            const int count = contacts_of(&s, contacts, 4);
            assert_int_equal(count, valley ? 0 : 1);
            const double push = count > 0 ? desc.time_step * contacts[0].normal_force : 0;
            assert_within(grain_of(&s, id).velocity.y - last, push / before.mass,
                          1e-12 * before.velocity.y);
        }
        assert_ok(dem2d_world_stats(s.world, &stats));
        assert_int_equal(stats.list_rebuilds, 1);
        close_scene(&s);
    }
}

/* A disc on a crest of two segments, one of them one-sided, the other drawn from either end: it has
   one contact, with the nearest point of the two. */
static void test_one_sided_neighbours(void **state) {
    (void)state;
    for (int which = 0; which < 2; which++)
        for (int back = 0; back < 2; back++)
            for (int i = -4; i <= 4; i++) {
                const dem2d_vec ends[3] = {{-1, -0.1}, {0, 0}, {1, -0.1}};
                const dem2d_vec at = vec(0.001 * i, 0.049);
                dem2d_contact_info contacts[4];
                scene s = make_scene(0, vec(0, 0), false);
                for (int k = 0; k < 2; k++) {
                    const bool turned = k != which && back;
                    dem2d_wall_desc wall = plane_desc(&s, ends[k + turned], vec(0, 0));
                    wall.segment = true, wall.end = ends[k + 1 - turned];
                    wall.one_sided = k == which;
                    add_wall(&s, &wall);
                }
                add(&s, make_shape(DISC), at, 0, vec(0, 0));
                step(&s, 1);
                assert_int_equal(contacts_of(&s, contacts, 4), 1);
                assert_within(contacts[0].depth, 0.05 - hypot(at.x, at.y), 1e-14);
                assert_true(contacts[0].normal_force > 0);
                close_scene(&s);
            }
}

/* A disc spins at a crest and, beside it, in a valley. Segments are added in either order, so that
   of the two at the crest either one counts. All contacts slide: friction is its coefficient times
   the normal forces, less that of the vertex in the valley. */
static void test_friction_beside_crest(void **state) {
    (void)state;
    for (int back = 0; back < 2; back++) {
        const dem2d_vec ends[4] = {{-1, -0.3}, {0, 0}, {0.01, -0.003}, {1, 0.4425}};
        dem2d_contact_info contacts[4];
        double normal = 0, friction = 0;
        scene s = make_scene(0.3, vec(0, 0), false);
        for (int i = 0; i < 3; i++) {
            const int k = back ? 2 - i : i;
            add_segment(&s, ends[k], ends[k + 1]);
        }
        (void)add_shape(&s, make_shape(DISC), DEM2D_FREE, vec(0.004, 0.044), 0, vec(0, 0), 1e4);
        step(&s, 1);
        assert_int_equal(contacts_of(&s, contacts, 4), 3);
        for (int k = 0; k < 3; k++) {
            normal += contacts[k].sign * contacts[k].normal_force;
            friction += fabs(contacts[k].tangential_force);
        }
        assert_near(friction, 0.3 * normal, 1e-12);
        close_scene(&s);
    }
}

/* Of two walls whose contacts with a disc at a crest are the same the later one has the contact,
   whichever way the scene is turned and the walls are drawn: rounding does not decide it. */
static void test_wall_at_crest(void **state) {
    (void)state;
    for (int k = 0; k < 64; k++)
        for (int drawn = 0; drawn < 4; drawn++) {
            const dem2d_vec u = direction(k * TEST_PI / 32), at = vec(1.5 * u.x, 1.5 * u.y);
            const dem2d_vec ends[3] = {{at.x + u.x * -0.1 + u.y, at.y + u.y * -0.1 - u.x},
                                       at,
                                       {at.x + u.x * -0.2 - u.y, at.y + u.y * -0.2 + u.x}};
            dem2d_contact_info contacts[4];
            dem2d_wall_id later;
            scene s = make_scene(0, vec(0, 0), false);
            memset(&later, 0, sizeof later);
            for (int i = 0; i < 2; i++) {
                const int turned = drawn >> i & 1;
                later = add_segment(&s, ends[i + turned], ends[i + 1 - turned]);
            }
            add(&s, make_shape(DISC), vec(at.x + 0.049 * u.x, at.y + 0.049 * u.y), 0, vec(0, 0));
            step(&s, 1);
            assert_int_equal(contacts_of(&s, contacts, 4), 1);
            assert_int_equal(contacts[0].wall.index, later.index);
            close_scene(&s);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_depth),
        cmocka_unit_test(test_flat_joints),
        cmocka_unit_test(test_joint_kinds),
        cmocka_unit_test(test_hopper),
        cmocka_unit_test(test_moves),
        cmocka_unit_test(test_cut_through),
        cmocka_unit_test(test_moved_off_joint),
        cmocka_unit_test(test_one_sided_neighbours),
        cmocka_unit_test(test_friction_beside_crest),
        cmocka_unit_test(test_wall_at_crest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
