/* An edit costs what it changes: the neighbour list stays, and contacts keep their history, unless
   the edit moves something beyond its skin or lists other pairs. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"

/* --- rebuilds ----------------------------------------------------------------------------------
 */

/* Grains of three kinds at rest in a box on a segment, with one that is driven far away, and a
   servo wall there. */
typedef struct heap {
    scene s;
    dem2d_particle_id far;
    dem2d_wall_desc plane, segment, lid; /* as they are */
    dem2d_wall_id plane_id, segment_id, lid_id;
} heap;

static heap make_heap(int steps) {
    dem2d_world_desc desc = {0};
    heap h;
    memset(&h, 0, sizeof h);
    desc.time_step = 2e-5, desc.gravity.y = -9.81, desc.local_damping = 0.7, desc.skin = 0.5;
    const dem2d_material_desc stone = stone_desc(8e6, 0.5);
    h.s = open_scene(&desc, &stone);
    (void)add_plane(&h.s, 0.33, 0, -1, 0);
    h.plane = plane_desc(&h.s, vec(0, 0), vec(1, 0));
    h.plane_id = add_wall(&h.s, &h.plane);
    h.segment = plane_desc(&h.s, vec(-0.1, 0), vec(0, 0));
    h.segment.segment = true, h.segment.end = vec(0.4, 0);
    h.segment_id = add_wall(&h.s, &h.segment);
    h.lid = plane_desc(&h.s, vec(0, 9), vec(0, -1));
    h.lid.mode = DEM2D_WALL_SERVO, h.lid.length = 1, h.lid.stress = -1, h.lid.max_speed = 1e-3;
    h.lid_id = add_wall(&h.s, &h.lid);
    for (int i = 0; i < 9; i++) {
        dem2d_shape *shape = i % 3 == 0   ? make_disc(0.025)
                             : i % 3 == 1 ? make_ellipse(0.03, 0.02)
                                          : make_box(0.045, 0.04);
        (void)add_shape(&h.s, shape, DEM2D_FREE,
                        vec(0.035 + 0.065 * (i % 5), 0.03 + 0.065 * (i / 5)), 0.4 * i, vec(0, 0),
                        0);
    }
    h.far = add_shape(&h.s, make_disc(0.03), DEM2D_DRIVEN, vec(0.15, 5), 0, vec(0.01, 0), 1);
    step(&h.s, steps);
    return h;
}

enum { FRICTION = 15, EDITS };

/* Values differ a little from call to call. */
static void edit(heap *h, int which, double by) {
    dem2d_world *w = h->s.world;
    dem2d_pair_desc pair = pair_desc(1e7, 8e6, 0.5);
    switch (which) {
    case 0:
        break;
    case 1:
        assert_ok(dem2d_world_set_gravity(w, vec(by, -9.81 - by)));
        break;
    case 2:
        assert_ok(dem2d_world_set_damping(w, 0.7 + by, fabs(by)));
        break;
    case 3:
        assert_ok(dem2d_world_set_time_step(w, 2e-5 * (1 + by)));
        break;
    case 4:
        pair.normal_stiffness *= 1 + by, pair.friction += by;
        assert_ok(dem2d_world_set_pair(w, h->s.material, h->s.material, &pair));
        break;
    case 5:
        set_velocity(&h->s, h->far, DEM2D_DRIVEN, vec(0.01 + by, by), by);
        break;
    case 6:
        set_velocity(&h->s, h->far, by > 0 ? DEM2D_FREE : DEM2D_DRIVEN, vec(0.01, 0), 0);
        break;
    case 7:
        assert_ok(dem2d_world_set_wall(w, h->segment_id, &h->segment));
        break;
    case 8: /* along itself: nothing moves */
        h->segment.point.x += by, h->segment.end.x += by;
        assert_ok(dem2d_world_set_wall(w, h->segment_id, &h->segment));
        break;
    case 9:
        h->segment.end.y += by / 100;
        assert_ok(dem2d_world_set_wall(w, h->segment_id, &h->segment));
        break;
    case 10:
        h->plane.normal.y += by, h->plane.point.x += by / 100;
        assert_ok(dem2d_world_set_wall(w, h->plane_id, &h->plane));
        break;
    case 11:
        h->segment.mode = by > 0 ? DEM2D_WALL_MOVING : DEM2D_WALL_STILL;
        h->segment.velocity.x = by / 100;
        assert_ok(dem2d_world_set_wall(w, h->segment_id, &h->segment));
        break;
    case 12:
        h->lid.stress = -1 + by, h->lid.max_speed = 1e-3 + by, h->lid.velocity.x = by;
        assert_ok(dem2d_world_set_wall(w, h->lid_id, &h->lid));
        break;
    case 13: {
        const dem2d_pose pose = grain_of(&h->s, h->far).pose;
        assert_ok(dem2d_world_move_particle(w, h->far, vec(pose.position.x, 5 + by), 100 * by));
        break;
    }
    case 14:
        set_velocity(&h->s, h->far, DEM2D_DRIVEN, vec(0, 0), 0);
        break;
    default: /* friction goes and comes */
        pair.friction = by > 0 ? 0 : 0.5;
        assert_ok(dem2d_world_set_pair(w, h->s.material, h->s.material, &pair));
    }
}

static void test_rebuilds(void **state) {
    (void)state;
    heap h = make_heap(30000);
    for (int which = 0; which < EDITS; which++) {
        const dem2d_stats before = stats_of(&h.s);
        const double wound = energy_of(&h.s).tangential;
        for (int k = 0; k < 40; k++) {
            edit(&h, which, k % 2 == 0 ? 1e-6 : -1e-6);
            step(&h.s, 1);
        }
        const dem2d_stats after = stats_of(&h.s);
        assert_int_equal(after.list_rebuilds, before.list_rebuilds);
        if (which != FRICTION) assert_true(energy_of(&h.s).tangential > wound / 2);
    }
    close_scene(&h.s);
}

/* What does need a new list gets it: dashpots that come, a wall or a grain beyond its skin. */
static void test_rebuilt(void **state) {
    (void)state;
    const dem2d_pair_desc dashed = {.normal_stiffness = 1e7,
                                    .tangential_stiffness = 8e6,
                                    .friction = 0.5,
                                    .damping_ratio = 0.1};
    for (int which = 0; which < 5; which++) {
        heap h = make_heap(100);
        dem2d_world *w = h.s.world;
        const int64_t before = stats_of(&h.s).list_rebuilds;
        if (which == 0) assert_ok(dem2d_world_set_pair(w, h.s.material, h.s.material, &dashed));
        h.segment.point.y -= 0.05, h.segment.end.y -= 0.05, h.plane.normal.y = 0.5;
        if (which == 1) assert_ok(dem2d_world_set_wall(w, h.segment_id, &h.segment));
        if (which == 2) assert_ok(dem2d_world_set_wall(w, h.plane_id, &h.plane));
        if (which == 3) assert_ok(dem2d_world_move_particle(w, h.far, vec(0.1, 4.99), 0));
        if (which == 4) assert_ok(dem2d_world_remove_wall(w, h.lid_id));
        step(&h.s, 2);
        assert_int_equal(stats_of(&h.s).list_rebuilds, before + 1);
        close_scene(&h.s);
    }
}

/* --- history -----------------------------------------------------------------------------------
 */

/* A box on a slope of 10 degrees that friction holds, on a segment or a half-plane, which is set
   again in every step: as it is; turned a little; put below the box and back. */
static void test_slope(void **state) {
    (void)state;
    for (int segment = 0; segment < 2; segment++)
        for (int way = 0; way < 3; way++) {
            dem2d_world_desc desc = {0};
            desc.time_step = 5e-5, desc.gravity.y = -9.81, desc.local_damping = 0.3;
            dem2d_material_desc stone = stone_desc(8e4, 0.5);
            stone.density = 2500, stone.normal_stiffness = 1e5;
            const scene s = open_scene(&desc, &stone);
            double slope = 10 * (double)TEST_PI / 180;
            const double c = cos(slope), n = sin(slope);
            dem2d_wall_desc wall = plane_desc(&s, vec(-c, -n), vec(-n, c));
            wall.segment = segment, wall.end = vec(c, n);
            const dem2d_wall_id id = add_wall(&s, &wall);
            const dem2d_vec corners[4] = {
                {-0.01, -0.005}, {0.01, -0.005}, {0.01, 0.005}, {-0.01, 0.005}};
            dem2d_shape *box;
            assert_ok(dem2d_shape_create_polygon(NULL, corners, 4, 0, &box));
            const dem2d_particle_id grain =
                add_shape(&s, box, DEM2D_FREE, vec(-0.005 * n, 0.005 * c), slope, vec(0, 0), 0);
            step(&s, 4000);
            const dem2d_vec start = grain_of(&s, grain).pose.position;
            for (int k = 0; k < 2000; k++) {
                dem2d_wall_desc below = wall;
                below.point.y -= 5, below.end.y -= 5;
                if (way == 2) assert_ok(dem2d_world_set_wall(s.world, id, &below));
                if (way == 1) {
                    slope += 1e-9;
                    wall.point = vec(-cos(slope), -sin(slope));
                    wall.end = vec(cos(slope), sin(slope));
                    wall.normal = vec(-sin(slope), cos(slope));
                }
                assert_ok(dem2d_world_set_wall(s.world, id, &wall));
                step(&s, 1);
            }
            const dem2d_vec end = grain_of(&s, grain).pose.position;
            assert_within(hypot(end.x - start.x, end.y - start.y), 0, 1e-5);
            close_scene(&s);
        }
}

/* Contacts of a grain that is put elsewhere end, also where it stays within its skin; those of the
   others go on. */
static void test_moved(void **state) {
    (void)state;
    for (int shape = 0; shape < 2; shape++) {
        dem2d_world_desc desc = {0};
        dem2d_contact_info list[4];
        dem2d_particle_id ids[3];
        desc.time_step = 1e-5;
        const dem2d_material_desc stone = stone_desc(8e6, 0.5);
        const scene s = open_scene(&desc, &stone);
        for (int i = 0; i < 3; i++)
            ids[i] = add_shape(&s, shape == 0 ? make_disc(0.1) : make_ellipse(0.1, 0.09),
                               DEM2D_DRIVEN, vec(0.19 * i, 0), 0, vec(0, i == 1 ? 0.1 : 0), 0);
        set_velocity(&s, ids[1], DEM2D_FREE, vec(0, 0.1), 0);
        step(&s, 5);
        assert_int_equal(contacts_of(&s, list, 4), 2);
        const double wound = list[0].tangential_force;
        assert_true(wound != 0);
        const int64_t rebuilds = stats_of(&s).list_rebuilds;
        assert_ok(dem2d_world_move_particle(s.world, ids[2], vec(0.38 + 1e-6, 0), 0));
        assert_int_equal(contacts_of(&s, list, 4), 1);
        assert_true(grain_of(&s, ids[2]).force.x == 0);
        step(&s, 1);
        assert_int_equal(contacts_of(&s, list, 4), 2);
        assert_near(list[0].tangential_force, wound * 6 / 5, 1e-2);
        assert_within(list[1].tangential_force, 0, 0.3 * fabs(wound));
        assert_int_equal(stats_of(&s).list_rebuilds, rebuilds);
        close_scene(&s);
    }
}

/* --- pairs that no force can move --------------------------------------------------------------
 */

/* A grain of a motion overlaps another one, or a wall of a mode. Returns the number of contacts,
   and whether there are forces, energy and stress of them. */
static int count_held(const scene *s, bool *felt) {
    const dem2d_stats n = stats_of(s);
    const dem2d_energy e = energy_of(s);
    const dem2d_packing p = packing_of(s);
    dem2d_stress stress;
    assert_ok(dem2d_world_stress(s->world, 1, &stress));
    *felt = e.normal != 0 && p.max_overlap != 0 && stress.xx != 0;
    assert_true(*felt || (e.normal == 0 && p.max_overlap == 0 && stress.xx == 0));
    return n.contacts + n.wall_contacts;
}

static void test_immovable(void **state) {
    (void)state;
    const dem2d_motion motions[] = {DEM2D_FREE, DEM2D_FIXED, DEM2D_DRIVEN};
    dem2d_world_desc desc = {0};
    desc.time_step = 1e-6;
    for (int shape = 0; shape < 3; shape++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 6; b++) { /* 3: a still, 4: a moving, 5: a servo wall */
                dem2d_material_desc stone = stone_desc(8e6, 0.5);
                stone.damping_ratio = shape == 1 ? 0.1 : 0; /* circles as other shapes */
                const scene s = open_scene(&desc, &stone);
                const bool contact = a == 0 || b == 0 || b == 5;
                bool felt;
                const dem2d_particle_id id =
                    add_shape(&s, shape < 2 ? make_disc(0.1) : make_ellipse(0.1, 0.09), motions[a],
                              vec(0, 0), 0, vec(0, 0), 0);
                if (b < 3) {
                    (void)add_shape(&s, shape < 2 ? make_disc(0.1) : make_box(0.2, 0.2), motions[b],
                                    vec(0.19, 0), 0, vec(0, 0), 0);
                } else {
                    dem2d_wall_desc wall = plane_desc(&s, vec(0.09, 0), vec(-1, 0));
                    wall.mode = (dem2d_wall_mode)(b - 3), wall.stress = 1;
                    wall.max_speed = 1e-3, wall.length = 1;
                    (void)add_wall(&s, &wall);
                }
                step(&s, 3);
                assert_int_equal(count_held(&s, &felt), contact);
                assert_int_equal(felt, contact);
                assert_int_equal(grain_of(&s, id).force.x != 0, contact);
                /* held and let go: what was of the last force pass stays until the next */
                const int64_t rebuilds = stats_of(&s).list_rebuilds;
                const dem2d_motion other = a == 2 ? DEM2D_FREE : DEM2D_DRIVEN;
                const bool then = other == DEM2D_FREE || b == 0 || b == 5;
                set_velocity(&s, id, other, vec(0, 0), 0);
                assert_int_equal(count_held(&s, &felt), contact);
                step(&s, 1);
                assert_int_equal(count_held(&s, &felt), then);
                assert_int_equal(stats_of(&s).list_rebuilds - rebuilds, motions[a] == DEM2D_FIXED);
                set_velocity(&s, id, DEM2D_FIXED, vec(0, 0), 0);
                assert_int_equal(count_held(&s, &felt), then);
                step(&s, 1);
                assert_int_equal(count_held(&s, &felt), b == 0 || b == 5);
                close_scene(&s);
            }
}

/* Two discs on a floor, with and without a dashpot. One that becomes too light for the time step is
   found at once, in a list that stays, and nothing changes. */
static void test_lighter(void **state) {
    (void)state;
    for (int damped = 0; damped < 2; damped++) {
        dem2d_world_desc desc = {0};
        dem2d_material_desc stone = stone_desc(1e7, 0.5), light = stone;
        dem2d_material_id other;
        stone.damping_ratio = light.damping_ratio = damped ? 0.01 : 0;
        light.density = 0.27;
        desc.time_step = 5e-5, desc.gravity.y = -9.81, desc.skin = 0.5;
        desc.local_damping = 0.7;
        scene s = open_scene(&desc, &stone);
        assert_ok(dem2d_world_add_material(s.world, &light, &other));
        (void)add_floor(&s);
        (void)add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0.0499), 0, vec(0, 0), 0);
        const dem2d_particle_id id =
            add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0.1496), 0, vec(0, 0), 0);
        step(&s, 200);
        const dem2d_stats before = stats_of(&s);
        assert_int_equal(before.slow_time_step, 0);
        assert_ok(dem2d_world_set_material(s.world, id, other));
        const uint64_t hash = dem2d_world_hash(s.world);
        assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_TIME_STEP);
        assert_true(dem2d_world_hash(s.world) == hash);
        assert_int_equal(stats_of(&s).list_rebuilds, before.list_rebuilds);
        assert_ok(dem2d_world_set_material(s.world, id, s.material));
        step(&s, 1);
        close_scene(&s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rebuilds),  cmocka_unit_test(test_rebuilt),
        cmocka_unit_test(test_slope),     cmocka_unit_test(test_moved),
        cmocka_unit_test(test_immovable), cmocka_unit_test(test_lighter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
