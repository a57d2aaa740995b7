/* Particles and contacts from and into arrays: the bits of the functions for one, in the order of
   ids, dense or in structs of the caller's. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "world_scene.h"

enum { GRAINS = 60 };

/* Shapes of several kinds or circles alone, with holes in the ids, loads and names. */
static scene make_heap(const dem2d_env *env, bool circles, bool friction) {
    static const dem2d_vec box[4] = {{0, 0}, {0.09, 0}, {0.09, 0.06}, {0, 0.06}};
    dem2d_material_desc stone = stone_desc(friction ? 5e6 : 0, friction ? 0.4 : 0);
    dem2d_world_desc desc;
    dem2d_particle_id ids[GRAINS];
    memset(&desc, 0, sizeof desc);
    stone.damping_ratio = circles ? 0 : 0.1, stone.rolling_friction = friction ? 0.1 : 0;
    desc.time_step = 1e-4, desc.gravity = vec(1, -40), desc.env = env;
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id shapes[3] = {give_shape(&s, make_disc(0.05)),
                                      give_shape(&s, make_polygon(box, 4, 0)),
                                      give_shape(&s, make_ellipse(0.05, 0.03))};
    (void)add_floor(&s), (void)add_plane(&s, -0.06, 0, 1, 0), (void)add_plane(&s, 1, 0, -1, 0);
    for (int i = 0; i < GRAINS; i++) {
        dem2d_particle_desc grain =
            grain_desc(&s, shapes[circles ? 0 : i % 3], i % 4 == 0 ? 0.8 : 1,
                       vec(0.1 * (i % 10) + 0.01 * (i / 10 % 2), 0.06 + 0.11 * (i / 10)));
        grain.angular_velocity = friction ? 40 * (i % 5 - 2) : 0;
        grain.name = circles ? 0 : (uint64_t)(GRAINS - i) << 40;
        if (i == 4) grain.motion = DEM2D_FIXED, grain.angular_velocity = 0;
        if (i == 8) grain.motion = DEM2D_DRIVEN;
        ids[i] = add_grain(&s, &grain);
    }
    step(&s, 1500);
    for (int i = 0; i < GRAINS; i += 7) assert_ok(dem2d_world_remove_particle(s.world, ids[i]));
    for (int i = 1; i < GRAINS; i += 7)
        assert_ok(dem2d_world_set_load(s.world, ids[i], vec(i, -i), i % 2 ? 0.5 : 0));
    inside_scatter(s.world, true);
    step(&s, 1500);
    return s;
}

/* All arrays, dense. */
typedef struct columns {
    dem2d_particle_id ids[GRAINS];
    dem2d_vec positions[GRAINS], velocities[GRAINS], forces[GRAINS], loads[GRAINS];
    dem2d_rot rotations[GRAINS];
    double angles[GRAINS], spins[GRAINS], torques[GRAINS], load_torques[GRAINS];
    double masses[GRAINS], inertias[GRAINS], radii[GRAINS], equivalents[GRAINS];
    uint64_t names[GRAINS];
} columns;

static dem2d_particle_arrays arrays_of(columns *c) {
    dem2d_particle_arrays a;
    memset(&a, 0, sizeof a);
    a.ids = c->ids, a.positions = c->positions, a.velocities = c->velocities;
    a.forces = c->forces, a.loads = c->loads, a.rotations = c->rotations, a.angles = c->angles;
    a.angular_velocities = c->spins, a.torques = c->torques, a.load_torques = c->load_torques;
    a.masses = c->masses, a.inertias = c->inertias, a.radii = c->radii;
    a.equivalents = c->equivalents, a.names = c->names;
    return a;
}

static bool same_vec(dem2d_vec a, dem2d_vec b) {
    return memcmp(&a, &b, sizeof a) == 0;
}

static void check_row(const scene *s, const columns *c, int i) {
    const dem2d_particle_info info = grain_of(s, c->ids[i]);
    assert_true(same_vec(info.pose.position, c->positions[i]));
    assert_memory_equal(&info.pose.rotation, &c->rotations[i], sizeof info.pose.rotation);
    assert_within(remainder(dem2d_rot_angle(info.pose.rotation) - c->angles[i], 2 * TEST_PI), 0,
                  1e-15);
    assert_true(fabs(c->angles[i]) <= (double)TEST_PI);
    assert_true(same_vec(info.velocity, c->velocities[i]) && same_vec(info.load, c->loads[i]));
    assert_true(info.force.x == c->forces[i].x && info.force.y == c->forces[i].y);
    assert_same_bits(info.torque, c->torques[i]);
    assert_same_bits(info.angular_velocity, c->spins[i]);
    assert_same_bits(info.load_torque, c->load_torques[i]);
    assert_same_bits(info.mass, c->masses[i]);
    assert_same_bits(info.inertia, c->inertias[i]);
    assert_same_bits(info.radius, c->radii[i]);
    assert_same_bits(info.equivalent, c->equivalents[i]);
    assert_true(info.name == c->names[i]);
}

static void check_all(const scene *s) {
    static columns c;
    dem2d_particle_id ids[GRAINS];
    int count, read;
    const dem2d_particle_arrays a = arrays_of(&c);
    assert_ok(dem2d_world_particles(s->world, ids, GRAINS, &count));
    assert_ok(dem2d_world_read_particles(s->world, &a, GRAINS, &read));
    assert_int_equal(read, count);
    assert_memory_equal(ids, c.ids, (size_t)count * sizeof *ids);
    for (int i = 0; i < count; i++) check_row(s, &c, i);
}

/* In between, edits: contacts that are forgotten have no force. Steps go on to the same bits. */
static void test_read(void **state) {
    (void)state;
    for (int k = 0; k < 4; k++) {
        const scene s = make_heap(NULL, k < 2, k % 2 == 1), t = make_heap(NULL, k < 2, k % 2 == 1);
        dem2d_particle_id ids[GRAINS];
        int count;
        assert_ok(dem2d_world_particles(s.world, ids, GRAINS, &count));
        for (int round = 0; round < 8; round++) {
            const dem2d_particle_id id = ids[round + 5];
            check_all(&s);
            if (round == 2) {
                assert_ok(dem2d_world_move_particle(s.world, id, vec(0.5, 0.9), 1));
                assert_ok(dem2d_world_move_particle(t.world, id, vec(0.5, 0.9), 1));
            }
            if (round == 4) {
                assert_ok(dem2d_world_remove_particle(s.world, id));
                assert_ok(dem2d_world_remove_particle(t.world, id));
            }
            check_all(&s);
            if (round % 2) inside_renew_list(s.world);
            step(&s, 1 + 60 * (round % 3)), step(&t, 1 + 60 * (round % 3));
            assert_true(dem2d_world_hash(s.world) == dem2d_world_hash(t.world));
            assert_true(inside_holds(s.world));
        }
        close_scene(&s), close_scene(&t);
    }
}

/* A struct of the caller's, some fields; fewer rows than particles; what is around is not touched.
 */
typedef struct row {
    double before;
    dem2d_vec position;
    double angle;
    dem2d_vec force;
    double after;
} row;

static void test_stride(void **state) {
    (void)state;
    const scene s = make_heap(NULL, false, true);
    row rows[GRAINS];
    dem2d_particle_id ids[GRAINS];
    dem2d_particle_arrays a;
    int count;
    memset(&a, 0, sizeof a);
    a.stride = sizeof(row);
    a.positions = &rows[0].position, a.angles = &rows[0].angle, a.forces = &rows[0].force;
    for (int i = 0; i < GRAINS; i++) rows[i].before = rows[i].after = rows[i].position.x = 7;
    assert_ok(dem2d_world_read_particles(s.world, &a, 20, &count));
    assert_int_equal(count, GRAINS - (GRAINS + 6) / 7);
    assert_ok(dem2d_world_particles(s.world, ids, GRAINS, &count));
    for (int i = 0; i < GRAINS; i++) {
        assert_true(rows[i].before == 7 && rows[i].after == 7);
        if (i >= 20) assert_true(rows[i].position.x == 7);
        if (i >= 20) continue;
        const dem2d_particle_info info = grain_of(&s, ids[i]);
        assert_true(same_vec(info.pose.position, rows[i].position));
        assert_true(info.force.x == rows[i].force.x && info.force.y == rows[i].force.y);
    }
    assert_ok(dem2d_world_read_particles(s.world, &a, 0, &count));
    memset(&a, 0, sizeof a); /* nothing is wanted but the number */
    assert_ok(dem2d_world_read_particles(s.world, &a, 5, &count));
    assert_int_equal(count, GRAINS - (GRAINS + 6) / 7);
    close_scene(&s);
}

/* Of the instant of the forces: m (v' - v)/dt between two reads is the sum of forces, and the mean
   velocity is the path between two positions over two steps. */
static void test_instant(void **state) {
    (void)state;
    const scene s = make_heap(NULL, false, true);
    static columns c[3], now;
    int count;
    for (int k = 0; k < 3; k++) {
        dem2d_particle_arrays a = arrays_of(&c[k]);
        a.at_forces = true;
        assert_ok(dem2d_world_read_particles(s.world, &a, GRAINS, &count));
        if (k == 0) {
            a = arrays_of(&now);
            assert_ok(dem2d_world_read_particles(s.world, &a, GRAINS, &count));
        }
        step(&s, 1);
    }
    for (int i = 0; i < count; i++) {
        assert_true(same_vec(now.positions[i], c[1].positions[i])); /* the next force pass */
        const double way = c[2].positions[i].x - c[0].positions[i].x;
        assert_within(c[1].velocities[i].x, way / 2e-4, 1e-9);
    }
    close_scene(&s);
}

/* What is written is read again, and is what the functions for one particle do. */
static void test_write(void **state) {
    (void)state;
    for (int k = 0; k < 4; k++) {
        const scene s = make_heap(NULL, k < 2, k % 2 == 1), t = make_heap(NULL, k < 2, k % 2 == 1);
        static columns c;
        dem2d_particle_arrays a = arrays_of(&c);
        int count;
        assert_ok(dem2d_world_read_particles(s.world, &a, GRAINS, &count));
        memset(&a, 0, sizeof a);
        a.positions = c.positions, a.velocities = c.velocities, a.loads = c.loads;
        a.angles = c.angles, a.angular_velocities = c.spins, a.load_torques = c.load_torques;
        for (int i = 0; i < count; i++) {
            const dem2d_particle_info info = grain_of(&s, c.ids[i]);
            const bool fixed = info.motion == DEM2D_FIXED;
            if (i % 3 == 0) c.positions[i].y += 1e-4 * i, c.angles[i] += 0.1;
            if (!fixed) c.velocities[i].x += 0.01 * i, c.spins[i] += k % 2 ? 1 : 0;
            c.loads[i].x = i, c.load_torques[i] = k % 2 ? 0.01 : 0;
            if (i % 3 == 0)
                assert_ok(
                    dem2d_world_move_particle(t.world, c.ids[i], c.positions[i], c.angles[i]));
            assert_ok(dem2d_world_drive_particle(t.world, c.ids[i], info.motion, c.velocities[i],
                                                 c.spins[i]));
            assert_ok(dem2d_world_set_load(t.world, c.ids[i], c.loads[i], c.load_torques[i]));
        }
        assert_ok(dem2d_world_write_particles(s.world, &a, count));
        assert_true(dem2d_world_hash(s.world) == dem2d_world_hash(t.world));
        check_all(&s);
        step(&s, 300), step(&t, 300);
        assert_true(dem2d_world_hash(s.world) == dem2d_world_hash(t.world));
        close_scene(&s), close_scene(&t);
    }
}

/* Read and written back: nothing has moved, no contact has lost its history. */
static void test_written_back(void **state) {
    (void)state;
    for (int k = 0; k < 4; k++) {
        const scene s = make_heap(NULL, k < 2, k % 2 == 1);
        static columns c;
        dem2d_particle_arrays a = arrays_of(&c);
        int count;
        assert_ok(dem2d_world_read_particles(s.world, &a, GRAINS, &count));
        const uint64_t before = dem2d_world_hash(s.world);
        memset(&a, 0, sizeof a);
        a.positions = c.positions, a.velocities = c.velocities, a.angles = c.angles;
        a.angular_velocities = c.spins, a.loads = c.loads, a.load_torques = c.load_torques;
        assert_ok(dem2d_world_write_particles(s.world, &a, count));
        assert_true(dem2d_world_hash(s.world) == before);
        close_scene(&s);
    }
}

/* Rows by ids, in any order; a bad one leaves all as it was. */
static void test_rows(void **state) {
    (void)state;
    test_env env;
    test_env_init(&env);
    const scene s = make_heap(&env.env, false, true);
    static columns c;
    dem2d_particle_arrays a = arrays_of(&c);
    int count;
    assert_ok(dem2d_world_read_particles(s.world, &a, GRAINS, &count));
    memset(&a, 0, sizeof a);
    const dem2d_particle_id some[3] = {c.ids[9], c.ids[2], c.ids[5]};
    dem2d_particle_id ids[3];
    dem2d_vec at[3] = {{0.1, 2}, {0.3, 2}, {0.5, 2}};
    memcpy(ids, some, sizeof ids);
    a.ids = ids, a.positions = at;
    assert_ok(dem2d_world_write_particles(s.world, &a, 3));
    for (int i = 0; i < 3; i++) assert_true(same_vec(grain_of(&s, ids[i]).pose.position, at[i]));
    const uint64_t before = dem2d_world_hash(s.world);
    at[0].x = 9, at[2].y = NAN;
    assert_result(dem2d_world_write_particles(s.world, &a, 3), DEM2D_NOT_FINITE);
    assert_logged(&env, DEM2D_NOT_FINITE, 2, "positions");
    at[2].y = 2, ids[2].generation = 77;
    assert_result(dem2d_world_write_particles(s.world, &a, 3), DEM2D_STALE_ID);
    ids[2] = some[2];
    a.forces = at;
    assert_result(dem2d_world_write_particles(s.world, &a, 3), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "forces");
    a.forces = NULL, a.at_forces = true;
    assert_result(dem2d_world_write_particles(s.world, &a, 3), DEM2D_OUT_OF_RANGE);
    a.at_forces = false, a.ids = NULL, a.positions = c.positions;
    assert_result(dem2d_world_write_particles(s.world, &a, count + 1), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "count");
    double angles[3] = {0, 0, 2e9};
    a.ids = ids, a.positions = NULL, a.angles = angles;
    assert_result(dem2d_world_write_particles(s.world, &a, 3), DEM2D_OUT_OF_RANGE);
    assert_true(dem2d_world_hash(s.world) == before);
    step(&s, 10);
    close_scene(&s);
    assert_clean(&env);
}

/* A fixed particle takes no velocity; no memory for the first load changes nothing. */
static void test_refused(void **state) {
    (void)state;
    test_env env;
    test_env_init(&env);
    dem2d_world_desc desc;
    const dem2d_material_desc stone = stone_desc(0, 0);
    memset(&desc, 0, sizeof desc);
    desc.time_step = 1e-4, desc.env = &env.env;
    const scene s = open_scene(&desc, &stone);
    (void)add_shape(&s, make_disc(0.1), DEM2D_FREE, vec(0, 0), 0, vec(0, 0), 0);
    (void)add_shape(&s, make_disc(0.1), DEM2D_FIXED, vec(1, 0), 0, vec(0, 0), 0);
    dem2d_vec v[2] = {{1, 2}, {0, 3}};
    dem2d_particle_arrays a;
    memset(&a, 0, sizeof a);
    a.velocities = a.loads = v;
    const scene empty = open_scene(&desc, &stone);
    assert_ok(dem2d_world_write_particles(empty.world, &a, 0)); /* of none */
    assert_result(dem2d_world_write_particles(empty.world, &a, 1), DEM2D_OUT_OF_RANGE);
    close_scene(&empty);
    a.loads = NULL;
    const uint64_t before = dem2d_world_hash(s.world);
    assert_result(dem2d_world_write_particles(s.world, &a, 2), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, 1, "velocities");
    v[1].y = 0, a.loads = v;
    for (int fail = 1; fail <= 2; fail++) {
        test_env_fail(&env, fail);
        assert_result(dem2d_world_write_particles(s.world, &a, 2), DEM2D_OUT_OF_MEMORY);
        assert_true(dem2d_world_hash(s.world) == before);
    }
    test_env_fail(&env, 0);
    assert_ok(dem2d_world_write_particles(s.world, &a, 2));
    int count;
    a.velocities = NULL, a.forces = v;
    test_env_fail(&env, 1);
    const dem2d_result result = dem2d_world_read_particles(s.world, &a, 2, &count);
    assert_true(result == DEM2D_OK || result == DEM2D_OUT_OF_MEMORY);
    test_env_fail(&env, 0);
    assert_ok(dem2d_world_read_particles(s.world, &a, 2, &count));
    step(&s, 3);
    close_scene(&s);
    assert_clean(&env);
}

static void test_contacts(void **state) {
    (void)state;
    const scene s = make_heap(NULL, false, true);
    static dem2d_contact_info info[400];
    static dem2d_particle_id a[400], b[400];
    static dem2d_wall_id wall[400];
    static dem2d_vec point[400], normal[400], branch[400];
    static double depth[400], force[400], shear[400], moment[400];
    dem2d_contact_arrays to = {0, a, b, wall, point, normal, branch, depth, force, shear, moment};
    int count;
    const int expected = contacts_of(&s, info, 400);
    assert_between(expected, GRAINS / 2, 400);
    assert_ok(dem2d_world_read_contacts(s.world, &to, 400, &count));
    assert_int_equal(count, expected);
    for (int i = 0; i < count; i++) {
        assert_memory_equal(&a[i], &info[i].a, sizeof *a);
        assert_memory_equal(&b[i], &info[i].b, sizeof *b);
        assert_memory_equal(&wall[i], &info[i].wall, sizeof *wall);
        assert_true(same_vec(point[i], info[i].point) && same_vec(normal[i], info[i].normal));
        assert_true(same_vec(branch[i], info[i].branch));
        assert_same_bits(depth[i], info[i].depth);
        assert_same_bits(force[i], info[i].normal_force);
        assert_same_bits(shear[i], info[i].tangential_force);
        assert_same_bits(moment[i], info[i].moment);
    }
    memset(depth, 0, sizeof depth);
    assert_ok(dem2d_world_read_contacts(s.world, &to, 3, &count));
    assert_true(count == expected && depth[2] == info[2].depth && depth[3] == 0);
    close_scene(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_read),         cmocka_unit_test(test_stride),
        cmocka_unit_test(test_instant),      cmocka_unit_test(test_write),
        cmocka_unit_test(test_written_back), cmocka_unit_test(test_rows),
        cmocka_unit_test(test_refused),      cmocka_unit_test(test_contacts)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
