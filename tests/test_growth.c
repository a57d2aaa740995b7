/* Growth of grains to a solid fraction or a stress: what it reaches, what it leaves as it was, and
   bits that depend on nothing but the scene. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"

/* A box of side 1 m with grains of two sizes at a solid fraction of 0.45: discs, or discs, ellipses
   and rounded polygons by turns. */
static scene open_box(int count, bool mixed, double friction, double skin, const dem2d_env *env) {
    static const dem2d_vec corners[4] = {{-1, -0.7}, {1, -0.8}, {0.9, 0.6}, {-0.7, 0.9}};
    static const dem2d_grade sizes[3] = {{1, 0.5}, {1.4, 0.5}, {1.4, 1}};
    dem2d_world_desc desc = {0};
    dem2d_material_desc stone = stone_desc(1e8, friction);
    dem2d_grain_kind kinds[3] = {{0}};
    dem2d_grading_desc grading = {0};
    dem2d_fill_desc fill = {0};
    dem2d_filling done;
    dem2d_shape *shapes[3];
    double dt;
    desc.time_step = 1e-6, desc.skin = skin, desc.env = env, desc.local_damping = 0.05;
    stone.normal_stiffness = 1e8, stone.damping_ratio = 0.2;
    scene s = open_scene(&desc, &stone);
    add_floor(&s);
    add_plane(&s, 0, 0, 1, 0), add_plane(&s, 1, 1, -1, 0), add_plane(&s, 1, 1, 0, -1);
    assert_ok(dem2d_shape_create_circle(NULL, 1, &shapes[0]));
    assert_ok(dem2d_shape_create_ellipse(NULL, 1.3, 0.9, &shapes[1]));
    assert_ok(dem2d_shape_create_polygon(NULL, corners, 4, 0.2, &shapes[2]));
    for (int i = 0; i < 3; i++) {
        kinds[i].share = 1, kinds[i].grain.material = s.material;
        kinds[i].grain.shape = give_shape(&s, shapes[i]);
    }
    grading.points = sizes, grading.point_count = 3, grading.measure = DEM2D_MEASURE_NUMBER;
    grading.kinds = kinds, grading.kind_count = mixed ? 3 : 1;
    fill.grading = &grading, fill.count = count, fill.solid_fraction = 0.45;
    fill.region.box.upper = vec(1, 1), fill.method = DEM2D_FILL_RANDOM, fill.seed = 3;
    assert_ok(dem2d_world_fill(s.world, &fill, NULL, 0, &done));
    assert_ok(dem2d_world_choose_time_step(s.world, 0.8, &dt));
    assert_ok(dem2d_world_set_time_step(s.world, dt));
    return s;
}

static dem2d_growth_desc to_stress(double friction) {
    dem2d_growth_desc d = {0};
    d.area = 1, d.stress = 1e5, d.friction = friction, d.local_damping = 0.2;
    return d;
}

/* The friction that contacts have, the damping and the time step of the world. */
static void check_restored(const scene *s, double time_step) {
    dem2d_pair_desc pair;
    dem2d_world_desc now;
    assert_ok(dem2d_world_get_pair(s->world, s->material, s->material, &pair));
    assert_ok(dem2d_world_get_desc(s->world, &now));
    assert_true(pair.friction == 0.3 && now.local_damping == 0.05);
    assert_true(now.time_step == time_step);
}

/* A solid fraction is met to rounding, all free grains have grown by one factor; a fixed grain and
   a sensor have not; friction and damping are as before. */
static void test_fraction(void **state) {
    scene s = open_box(60, true, 0.3, 0, NULL);
    dem2d_particle_id ids[70], fixed, sensor;
    double scales[70], area = 0;
    dem2d_growth done;
    dem2d_particle_info info;
    dem2d_world_desc now;
    int count;
    (void)state;
    assert_ok(dem2d_world_particles(s.world, ids, 70, &count));
    info = grain_of(&s, ids[0]);
    dem2d_particle_desc other = grain_desc(&s, info.shape, 0.001, vec(-1, -1));
    other.motion = DEM2D_FIXED;
    fixed = add_grain(&s, &other);
    other.motion = DEM2D_FREE, other.groups.sensor = true;
    sensor = add_grain(&s, &other);
    for (int i = 0; i < count; i++) scales[i] = grain_of(&s, ids[i]).pose.scale;
    assert_ok(dem2d_world_get_desc(s.world, &now));
    dem2d_growth_desc d = to_stress(0);
    d.stress = 0, d.solid_fraction = 0.6, d.rate = 20;
    assert_ok(dem2d_world_grow(s.world, &d, 20, &done));
    assert_true(!done.reached && done.steps == 20);
    const double first = done.factor;
    assert_ok(dem2d_world_grow(s.world, &d, 1000000, &done));
    assert_true(done.reached);
    assert_near(done.solid_fraction, 0.6, 1e-12);
    for (int i = 0; i < count; i++) {
        info = grain_of(&s, ids[i]);
        assert_near(info.pose.scale, scales[i] * first * done.factor, 1e-10);
        area += info.mass / 2700;
    }
    assert_near(area + grain_of(&s, fixed).mass / 2700, 0.6, 1e-11);
    assert_true(grain_of(&s, fixed).pose.scale == 0.001);
    assert_true(grain_of(&s, sensor).pose.scale == 0.001);
    check_restored(&s, now.time_step);
    d.solid_fraction = 0.55; /* back */
    assert_ok(dem2d_world_grow(s.world, &d, 1000000, &done));
    assert_true(done.reached && done.factor < 1);
    d.stress = 1;
    assert_result(dem2d_world_grow(s.world, &d, 10, &done), DEM2D_OUT_OF_RANGE);
    d.solid_fraction = d.stress = 0;
    assert_result(dem2d_world_grow(s.world, &d, 10, &done), DEM2D_OUT_OF_RANGE);
    d.solid_fraction = 0.6, d.area = 0;
    assert_result(dem2d_world_grow(s.world, &d, 10, &done), DEM2D_OUT_OF_RANGE);
    d.area = 1, d.rate = 0;
    assert_result(dem2d_world_grow(s.world, &d, 10, &done), DEM2D_OUT_OF_RANGE);
    d.rate = 1, d.solid_fraction = 1e-9; /* less than the fixed grain has */
    assert_result(dem2d_world_grow(s.world, &d, 10, &done), DEM2D_OUT_OF_RANGE);
    close_scene(&s);
}

/* The stress and rest are reached, measured by the forces on the walls, too; without friction the
   packing of discs is denser than with friction, and has more contacts. */
static void test_stress(void **state) {
    double fraction[2], contacts[2];
    (void)state;
    for (int k = 0; k < 2; k++) {
        scene s = open_box(150, false, 0.5, 0, NULL);
        const dem2d_growth_desc d = to_stress(k == 0 ? 0 : 0.5);
        dem2d_growth done;
        dem2d_wall_id walls[4];
        double pressure = 0;
        int count;
        assert_ok(dem2d_world_grow(s.world, &d, 400000, &done));
        assert_true(done.reached);
        assert_near(done.stress, 1e5, 0.01);
        assert_true(done.unbalanced <= 0.01);
        assert_true(done.steps < 20000); /* of steps near the safe one; others are many more */
        assert_ok(dem2d_world_walls(s.world, walls, 4, &count));
        for (int i = 0; i < 4; i++) {
            const dem2d_vec force = wall_of(&s, walls[i]).force, n = wall_of(&s, walls[i]).normal;
            pressure -= (force.x * n.x + force.y * n.y) / 4; /* each is 1 m long */
        }
        assert_near(pressure, 1e5, 0.03); /* of what is not at rest */
        fraction[k] = done.solid_fraction;
        contacts[k] = packing_of(&s).coordination_loaded;
        close_scene(&s);
    }
    assert_true(fraction[0] > fraction[1] + 0.01);
    assert_true(contacts[0] > contacts[1] + 0.3);
    assert_between(fraction[0], 0.78, 0.845);
    assert_between(fraction[1], 0.74, 0.82);
}

/* The same bits with another skin, in several calls, and in a world that was saved and loaded in
   between: growth uses up the bounds of gaps and lists as far as it has to. */
static void test_bits(void **state) {
    enum { STEPS = 1000 };
    static const double skins[4] = {0, 0.5, 0.02, 0};
    uint64_t hashes[4];
    (void)state;
    for (int k = 0; k < 4; k++) {
        scene s = open_box(40, true, 0.3, skins[k], NULL);
        dem2d_growth_desc d = to_stress(0.1);
        dem2d_growth done;
        d.rate = 3; /* an inertial number of 0.05 */
        if (k < 3) {
            assert_ok(dem2d_world_grow(s.world, &d, STEPS, &done));
        } else {
            assert_ok(dem2d_world_grow(s.world, &d, STEPS - 600, &done));
            scene_bytes bytes = scene_save(s.world);
            const scene other = scene_load(&s, &bytes);
            free(bytes.bytes);
            close_scene(&s);
            s = other;
            assert_ok(dem2d_world_grow(s.world, &d, 200, &done));
            assert_ok(dem2d_world_grow(s.world, &d, 400, &done));
        }
        assert_true(done.stress > 1e3 && done.steps > 0 && !done.reached);
        step(&s, 100);
        hashes[k] = dem2d_world_hash(s.world);
        close_scene(&s);
    }
    assert_true(hashes[0] == hashes[1] && hashes[0] == hashes[2]);
    assert_true(hashes[0] == hashes[3]);
}

/* In tens where the time step stays, that of a small sensor, which does not grow: also the time is
   the same. */
static void test_tens(void **state) {
    uint64_t hashes[2];
    (void)state;
    for (int k = 0; k < 2; k++) {
        scene s = open_box(40, false, 0.3, 0, NULL);
        const dem2d_groups sensor = {.sensor = true};
        const dem2d_particle_id id =
            add_shape(&s, make_disc(0.01), DEM2D_FREE, vec(0.5, 0.5), 0, vec(0, 0), 0);
        assert_ok(dem2d_world_set_groups(s.world, id, sensor));
        dem2d_growth_desc d = to_stress(0.1);
        dem2d_growth done;
        d.rate = 1e-3;
        for (int i = 0; i < (k == 0 ? 1 : 100); i++)
            assert_ok(dem2d_world_grow(s.world, &d, k == 0 ? 1000 : 10, &done));
        assert_true(done.stress == 0);
        hashes[k] = dem2d_world_hash(s.world);
        close_scene(&s);
    }
    assert_true(hashes[0] == hashes[1]);
}

/* The area of a cell can be taken if it stays as it is: not where the cell is stretched or a stress
   along a or b is held. */
static void check_area_stays(const scene *s) {
    const dem2d_growth_desc d = {.stress = 1e5};
    dem2d_growth done;
    for (int k = 0; k < 6; k++) {
        dem2d_deformation_desc how = {.xx = k == 0, .yy = k == 1, .xy = k == 4};
        how.hold_xx = k == 2, how.stress_xx = k == 2;
        how.hold_yy = k == 3, how.stress_yy = k == 3;
        assert_ok(dem2d_world_deform(s->world, &how));
        assert_result(dem2d_world_grow(s->world, &d, 10, &done),
                      k < 4 ? DEM2D_OUT_OF_RANGE : DEM2D_OK);
    }
}

/* In an oblique cell the area is that of the cell, and the stress is reached that the cell measures;
   the bits do not depend on the skin. */
static void test_cell(void **state) {
    uint64_t hashes[2];
    (void)state;
    for (int k = 0; k < 2; k++) {
        const dem2d_grade sizes[2] = {{0.1, 0}, {0.16, 1}};
        dem2d_material_desc stone = stone_desc(1e8, 0.3);
        dem2d_world_desc desc = {0};
        dem2d_grain_kind kinds[2] = {{0}};
        dem2d_grading_desc grading = {0};
        dem2d_fill_desc fill = {0};
        dem2d_filling filled;
        dem2d_growth_desc d = to_stress(0.1);
        dem2d_growth done;
        dem2d_cell_info cell;
        double dt;
        stone.normal_stiffness = 1e8, stone.damping_ratio = 0.2;
        desc.time_step = 1e-6, desc.local_damping = 0.05, desc.skin = k == 0 ? 0.02 : 0.5;
        desc.cell.a = vec(1, 0), desc.cell.b = vec(0.4, 0.6);
        scene s = open_scene(&desc, &stone);
        for (int i = 0; i < 2; i++) {
            kinds[i].share = 1, kinds[i].grain.material = s.material;
            kinds[i].grain.shape = give_shape(&s, i == 0 ? make_disc(1) : make_ellipse(1.3, 0.9));
        }
        grading.points = sizes, grading.point_count = 2, grading.kinds = kinds;
        grading.kind_count = 2;
        fill.grading = &grading, fill.solid_fraction = 0.45, fill.method = DEM2D_FILL_RANDOM;
        assert_ok(dem2d_world_fill(s.world, &fill, NULL, 0, &filled));
        assert_near(filled.solid_fraction, 0.45, 0.02);
        assert_ok(dem2d_world_choose_time_step(s.world, 0.8, &dt));
        assert_ok(dem2d_world_set_time_step(s.world, dt));
        d.area = 0;
        assert_ok(dem2d_world_grow(s.world, &d, 400000, &done));
        assert_true(done.reached);
        assert_ok(dem2d_world_get_cell(s.world, &cell));
        assert_near(done.stress, (cell.contact.xx + cell.contact.yy) / 2, 1e-12);
        assert_near(done.stress, 1e5, 0.01);
        assert_near(done.solid_fraction, packing_of(&s).solid_area / 0.6, 1e-12);
        assert_between(done.solid_fraction, 0.78, 0.9);
        hashes[k] = dem2d_world_hash(s.world);
        check_area_stays(&s);
        close_scene(&s);
    }
    assert_true(hashes[0] == hashes[1]);
}

/* A step that fails for want of memory: the result is its own; friction, damping and time step are
   the world's again. A time step of the world that is too long does not matter to growth. */
static void test_failing(void **state) {
    test_env env;
    (void)state;
    test_env_init(&env);
    scene s = open_box(60, true, 0.3, 0, &env.env);
    const dem2d_growth_desc d = to_stress(0);
    dem2d_growth done = {0};
    dem2d_world_desc now;
    assert_ok(dem2d_world_get_desc(s.world, &now));
    for (int k = 1; k < 4; k++) {
        test_env_fail(&env, k);
        assert_result(dem2d_world_grow(s.world, &d, 100000, &done), DEM2D_OUT_OF_MEMORY);
        test_env_fail(&env, 0);
        assert_int_equal(done.steps, 0);
        check_restored(&s, now.time_step);
    }
    assert_ok(dem2d_world_set_time_step(s.world, 1e-3));
    assert_ok(dem2d_world_grow(s.world, &d, 100000, &done));
    assert_true(done.reached);
    check_restored(&s, 1e-3);
    assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_TIME_STEP);
    close_scene(&s);
    assert_clean(&env);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fraction), cmocka_unit_test(test_stress),
        cmocka_unit_test(test_bits),     cmocka_unit_test(test_tens),
        cmocka_unit_test(test_failing),  cmocka_unit_test(test_cell),
    };
    return cmocka_run_group_tests_name("growth", tests, NULL, NULL);
}
