/* What there is in a world, as ids and descs: enough to build it again, and to go on with a servo
   test in a world from a file. Edits of a particle's material, template and scale. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"
#include "inside.h"

/* Grains of all kinds in a box under a servo wall. */
static scene make_press(void) {
    const dem2d_material_desc material = stone_desc(5e5, 0.3), smooth = stone_desc(2e5, 0);
    const dem2d_pair_desc pair = pair_desc(3e6, 1e6, 0.1);
    const double a[4] = {0.08, 0, 0, 0.002}, b[4] = {0, 0, 0, 0};
    dem2d_world_desc desc = {0};
    dem2d_material_id other;
    desc.time_step = 1e-4, desc.gravity = vec(0, -9.81), desc.local_damping = 0.1;
    scene s = open_scene(&desc, &material);
    assert_ok(dem2d_world_add_material(s.world, &smooth, &other));
    assert_ok(dem2d_world_set_pair(s.world, s.material, other, &pair));
    const dem2d_shape_id shapes[3] = {give_shape(&s, make_disc(0.05)),
                                      give_shape(&s, make_box(0.09, 0.06)),
                                      give_shape(&s, make_series(a, b, 3))};
    const dem2d_wall_id left = add_plane(&s, 0, 0, 3, 0), right = add_plane(&s, 0.62, 0, -1, 0);
    add_floor(&s);
    dem2d_wall_desc lid = plane_desc(&s, vec(0, 1), vec(0.01, -3));
    lid.mode = DEM2D_WALL_SERVO, lid.stress = 2000, lid.max_speed = 1;
    lid.spans[0] = left, lid.spans[1] = right, lid.material = other, lid.user_data = 77;
    add_wall(&s, &lid);
    for (int i = 0; i < 40; i++) {
        dem2d_particle_desc grain =
            grain_desc(&s, shapes[i % 3], 1, vec(0.06 + 0.12 * (i % 5), 0.06 + 0.11 * (i / 5)));
        grain.angle = i, grain.user_data = (uint64_t)i;
        add_grain(&s, &grain);
    }
    return s;
}

/* The wall that the caller marked, found without its id. */
static dem2d_wall_id marked_wall(const dem2d_world *world) {
    dem2d_wall_id ids[8];
    int count;
    assert_ok(dem2d_world_walls(world, ids, 8, &count));
    for (int i = 0; i < count; i++) {
        dem2d_wall_info info;
        assert_ok(dem2d_world_get_wall(world, ids[i], &info));
        if (info.user_data == 77) return ids[i];
    }
    fail_msg("no marked wall");
    return ids[0];
}

/* More stress on the marked wall, and some steps. */
static void press_on(dem2d_world *world, double stress) {
    const dem2d_wall_id lid = marked_wall(world);
    dem2d_wall_desc desc;
    assert_ok(dem2d_world_get_wall_desc(world, lid, &desc));
    desc.stress = stress;
    assert_ok(dem2d_world_set_wall(world, lid, &desc));
    assert_ok(dem2d_world_step(world, 2000, NULL));
}

/* A file, another world from it, the same bits. */
static void test_continued(void **state) {
    (void)state;
    scene s = make_press();
    const char *path = "build/test_descs.snapshot";
    dem2d_world *fresh;
    step(&s, 12000);
    assert_true(wall_of(&s, marked_wall(s.world)).force.y > 500);
    assert_ok(dem2d_world_save(s.world, NULL, path));
    press_on(s.world, 4000);
    press_on(s.world, 3000);
    const uint64_t hash = dem2d_world_hash(s.world);
    const double at = wall_of(&s, marked_wall(s.world)).point.y;
    close_scene(&s);
    assert_ok(dem2d_world_load(NULL, path, &fresh));
    press_on(fresh, 4000);
    press_on(fresh, 3000);
    assert_true(dem2d_world_hash(fresh) == hash);
    s.world = fresh;
    assert_same_bits(wall_of(&s, marked_wall(fresh)).point.y, at);
    close_scene(&s);
    remove(path);
}

/* Setting what is there changes no bit of the run and rebuilds nothing. */
static void test_set_again(void **state) {
    (void)state;
    double place[2][3];
    int64_t rebuilds[2];
    for (int k = 0; k < 2; k++) {
        scene s = make_press();
        dem2d_particle_id last = {39, 1};
        for (int n = 0; n < 200; n++) {
            dem2d_wall_id walls[8];
            dem2d_particle_id ids[40];
            dem2d_pair_desc pair;
            int count;
            step(&s, 50);
            if (k == 0) continue;
            assert_ok(dem2d_world_walls(s.world, walls, 8, &count));
            for (int i = 0; i < count; i++) {
                dem2d_wall_desc desc;
                assert_ok(dem2d_world_get_wall_desc(s.world, walls[i], &desc));
                assert_ok(dem2d_world_set_wall(s.world, walls[i], &desc));
            }
            assert_ok(dem2d_world_particles(s.world, ids, 40, &count));
            for (int i = 0; i < count; i++) {
                dem2d_particle_desc desc;
                assert_ok(dem2d_world_get_particle_desc(s.world, ids[i], &desc));
                assert_int_equal(desc.user_data, i);
                assert_ok(dem2d_world_set_material(s.world, ids[i], desc.material));
                assert_ok(dem2d_world_set_shape(s.world, ids[i], desc.shape, desc.scale));
                assert_ok(dem2d_world_set_groups(s.world, ids[i], desc.groups));
                assert_ok(dem2d_world_drive_particle(s.world, ids[i], desc.motion, desc.velocity,
                                                     desc.angular_velocity));
            }
            assert_ok(dem2d_world_get_pair(s.world, s.material, s.material, &pair));
            assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &pair));
        }
        const dem2d_vec at = grain_of(&s, last).pose.position;
        place[k][0] = at.x, place[k][1] = at.y;
        place[k][2] = wall_of(&s, marked_wall(s.world)).point.y;
        rebuilds[k] = stats_of(&s).list_rebuilds;
        close_scene(&s);
    }
    for (int i = 0; i < 3; i++) assert_same_bits(place[0][i], place[1][i]);
    assert_int_equal(rebuilds[0], rebuilds[1]);
}

/* A second world built from descs and lists moves as the first, from before its first step. */
static void test_rebuilt(void **state) {
    (void)state;
    const scene s = make_press();
    dem2d_world_desc desc;
    dem2d_material_id materials[4], material;
    dem2d_shape_id shapes[4], shape;
    dem2d_wall_id walls[8], wall;
    dem2d_particle_id ids[40], id;
    dem2d_world *copy;
    int count[4];
    assert_ok(dem2d_world_get_desc(s.world, &desc));
    assert_ok(dem2d_world_create(&desc, &copy));
    assert_ok(dem2d_world_materials(s.world, materials, 4, &count[0]));
    assert_ok(dem2d_world_shapes(s.world, shapes, 4, &count[1]));
    assert_ok(dem2d_world_walls(s.world, walls, 8, &count[2]));
    assert_ok(dem2d_world_particles(s.world, ids, 40, &count[3]));
    assert_int_equal(count[0], 2);
    assert_int_equal(count[1], 3);
    assert_int_equal(count[2], 4);
    for (int i = 0; i < count[0]; i++) {
        dem2d_material_desc of;
        assert_ok(dem2d_world_get_material_desc(s.world, materials[i], &of));
        assert_ok(dem2d_world_add_material(copy, &of, &material));
    }
    for (int i = 0; i < count[0]; i++)
        for (int j = 0; j <= i; j++) {
            dem2d_pair_desc pair;
            assert_ok(dem2d_world_get_pair(s.world, materials[i], materials[j], &pair));
            assert_ok(dem2d_world_set_pair(copy, materials[i], materials[j], &pair));
        }
    for (int i = 0; i < count[1]; i++)
        assert_ok(dem2d_world_add_shape(copy, dem2d_world_shape(s.world, shapes[i]), &shape));
    for (int i = 0; i < count[2]; i++) {
        dem2d_wall_desc of;
        assert_ok(dem2d_world_get_wall_desc(s.world, walls[i], &of));
        assert_ok(dem2d_world_add_wall(copy, &of, &wall));
    }
    for (int i = 0; i < count[3]; i++) {
        dem2d_particle_desc of;
        assert_ok(dem2d_world_get_particle_desc(s.world, ids[i], &of));
        of.angle = i; /* as given, to the bit */
        assert_ok(dem2d_world_add_particle(copy, &of, &id));
    }
    step(&s, 3000);
    assert_ok(dem2d_world_step(copy, 3000, NULL));
    for (int i = 0; i < count[3]; i++) {
        dem2d_particle_info info;
        assert_ok(dem2d_world_get_particle(copy, ids[i], &info));
        assert_within(info.pose.position.y, grain_of(&s, ids[i]).pose.position.y, 1e-9);
    }
    dem2d_world_destroy(copy);
    close_scene(&s);
}

/* A disc at rest on a floor: more density, stiffness, friction; another template and size. */
static void test_setters(void **state) {
    (void)state;
    const dem2d_material_desc light = stone_desc(5e5, 0.3), dense = material_desc(9000, 2e7, 0, 0);
    dem2d_world_desc desc = {0};
    dem2d_material_id other;
    desc.time_step = 5e-5, desc.gravity = vec(0, -9.81), desc.local_damping = 0.3;
    desc.ledger = true;
    scene s = open_scene(&desc, &light);
    assert_ok(dem2d_world_add_material(s.world, &dense, &other));
    add_floor(&s);
    const dem2d_particle_id id =
        add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0.05), 0, vec(0, 0), 0);
    const dem2d_shape_id box = give_shape(&s, make_box(0.1, 0.1));
    step(&s, 10000);
    const double mass = grain_of(&s, id).mass;
    assert_near(grain_of(&s, id).force.y, mass * 9.81, 1e-3);
    assert_ok(dem2d_world_set_material(s.world, id, other));
    assert_int_equal(stats_of(&s).wall_contacts, 1);
    assert_near(grain_of(&s, id).mass, mass * 9000 / 2700, 1e-14);
    step(&s, 30000);
    const double kn = 2 / (1 / 1e7 + 1 / 2e7);
    assert_near(0.05 - grain_of(&s, id).pose.position.y, grain_of(&s, id).mass * 9.81 / kn, 1e-3);
    assert_ok(dem2d_world_set_shape(s.world, id, box, 1));
    assert_int_equal(stats_of(&s).wall_contacts, 0);
    assert_true(inside_holds(s.world));
    step(&s, 30000);
    assert_near(grain_of(&s, id).mass, 9000 * 0.01, 1e-12);
    assert_near(grain_of(&s, id).force.y, 90 * 9.81, 1e-3);
    assert_near(grain_of(&s, id).pose.position.y, 0.05, 1e-3);
    assert_ok(dem2d_world_set_shape(s.world, id, box, 2)); /* deep in the floor: it is pushed out */
    assert_near(grain_of(&s, id).radius, 0.1 * sqrt(2), 1e-14);
    assert_ok(dem2d_world_move_particle(s.world, id, vec(0, 0.1), 0));
    step(&s, 30000);
    assert_near(grain_of(&s, id).force.y, 360 * 9.81, 1e-3);
    const dem2d_ledger ledger = ledger_of(&s);
    assert_true(fabs(ledger.closure) < 2e-3 * ledger.turnover);
    assert_result(dem2d_world_set_shape(s.world, id, box, 1e200), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_remove_shape(s.world, box), DEM2D_IN_USE);
    close_scene(&s);
}

/* A time step is chosen before the first step: of one disc by hand; in packings of all shapes, with
   walls, two sizes and dashpots, it is below the safe bound, but not far below. */
static void test_choose(void **state) {
    (void)state;
    for (int kind = 0; kind < 8; kind++) {
        const double a[4] = {0.08, 0, 0, 0.002}, b[4] = {0, 0, 0, 0};
        const double reach[4] = {0.05, 0.04, 0.045, 0.06};
        dem2d_material_desc material = stone_desc(5e6, 0.3);
        dem2d_world_desc desc = {0};
        double before, after, safe, limit;
        if (kind == 6) material.damping_ratio = 0.3;
        desc.time_step = 1e-4, desc.gravity = vec(0, -9.81), desc.local_damping = 0.3;
        scene s = open_scene(&desc, &material);
        dem2d_shape *made[5] = {make_disc(0.05), make_ellipse(0.055, 0.04), make_box(0.09, 0.07),
                                make_series(a, b, 3), make_oval(reach, 0.5522847498)};
        dem2d_shape_id shapes[5];
        for (int k = 0; k < 5; k++) shapes[k] = give_shape(&s, made[k]);
        assert_ok(dem2d_world_choose_time_step(s.world, 0.1, &before));
        assert_true(before == HUGE_VAL); /* nothing moves */
        add_floor(&s), add_plane(&s, 0, 0, 1, 0), add_plane(&s, 0.62, 0, -1, 0);
        for (int i = 0; i < 60; i++) {
            dem2d_particle_desc grain = grain_desc(
                &s,
                shapes[kind < 5    ? kind
                       : kind == 5 ? i % 5
                                   : 0],
                kind == 7 && i % 2 ? 0.3 : 1, vec(0.06 + 0.122 * (i % 5), 0.06 + 0.12 * (i / 5)));
            grain.angle = i;
            add_grain(&s, &grain);
        }
        assert_ok(dem2d_world_choose_time_step(s.world, 1, &before));
        assert_ok(dem2d_world_choose_time_step(s.world, 0.25, &after));
        assert_near(after, before / 4, 1e-15);
        if (kind == 0) { /* I = m R^2/2: 12 (kn + 3 kt)/m */
            const double mass = 2700 * (double)TEST_PI * 0.05 * 0.05;
            assert_near(before, 2 / sqrt(12 * (1e7 + 3 * 5e6) / mass), 1e-12);
        }
        assert_ok(dem2d_world_set_time_step(s.world, after));
        step(&s, (int)(2 / after)); /* at rest */
        assert_ok(dem2d_world_time_step_bounds(s.world, &safe, &limit, NULL));
        assert_ok(dem2d_world_choose_time_step(s.world, 1, &after));
        assert_same_bits(after, before); /* whatever the contacts are */
        assert_between(before, safe / 6, safe);
        close_scene(&s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_continued), cmocka_unit_test(test_set_again),
        cmocka_unit_test(test_rebuilt),   cmocka_unit_test(test_setters),
        cmocka_unit_test(test_choose),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
