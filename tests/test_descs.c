/* What there is in a world, as ids and descs: enough to build it again, and to go on with a servo
   test in a world from a file, also in another process: this program is that process when it gets
   the names of a snapshot and of a file for its answer. Edits of a particle's material, template and
   scale. */
#if defined(__unix__) || defined(__APPLE__)
#define PROCESSES
#define _POSIX_C_SOURCE 200809L
#include <sys/wait.h>
#include <unistd.h>
#endif

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

/* What is compared of a run that has gone on: all of its state, and what a user reads. */
typedef struct press_end {
    uint64_t hash;
    double at, stress;
} press_end;

/* The test goes on, as a program does that knows the file and its own plan alone. */
static press_end press_to_end(dem2d_world *world) {
    press_end end;
    dem2d_wall_info info;
    memset(&end, 0, sizeof end);
    press_on(world, 4000);
    press_on(world, 3000);
    assert_ok(dem2d_world_get_wall(world, marked_wall(world), &info));
    end.hash = dem2d_world_hash(world), end.at = info.point.y, end.stress = info.stress;
    return end;
}

static press_end press_from_file(const char *path) {
    dem2d_world *fresh;
    assert_ok(dem2d_world_load(NULL, path, &fresh));
    const press_end end = press_to_end(fresh);
    dem2d_world_destroy(fresh);
    return end;
}

#ifdef PROCESSES
static char *program;

/* The same by another process: this program with two names. */
static press_end press_elsewhere(const char *path, const char *answer) {
    char *const arguments[] = {program, (char *)path, (char *)answer, NULL};
    press_end end;
    int status = -1;
    fflush(NULL);
    const pid_t child = fork();
    if (child == 0) {
        execv(program, arguments);
        _exit(127);
    }
    assert_true(child > 0 && waitpid(child, &status, 0) == child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    FILE *file = fopen(answer, "rb");
    assert_non_null(file);
    assert_int_equal(fread(&end, sizeof end, 1, file), 1);
    fclose(file);
    remove(answer);
    return end;
}

/* Exit status. */
static int be_elsewhere(const char *path, const char *answer) {
    const press_end end = press_from_file(path);
    FILE *file = fopen(answer, "wb");
    if (file == NULL) return 1;
    const bool good = fwrite(&end, sizeof end, 1, file) == 1;
    return fclose(file) == 0 && good ? 0 : 1;
}
#endif

/* A file, another world from it here and in another process: the same bits. */
static void test_continued(void **state) {
    (void)state;
    const scene s = make_press();
    const char *path = "build/test_descs.snapshot";
    step(&s, 12000);
    assert_true(wall_of(&s, marked_wall(s.world)).force.y > 500);
    assert_ok(dem2d_world_save(s.world, NULL, path));
    const press_end own = press_to_end(s.world), fresh = press_from_file(path);
    close_scene(&s);
    assert_between(own.stress, 2900, 3100);
    assert_memory_equal(&fresh, &own, sizeof own);
#ifdef PROCESSES
    const press_end other = press_elsewhere(path, "build/test_descs.answer");
    assert_memory_equal(&other, &own, sizeof own);
#endif
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

/* A box held by friction on a slope: with another scale its contacts stay closed and keep their
   springs, no event is told, and it does not slide; with another template of the same shape they
   end, and it slides by as much as the springs stretch. */
static void test_scale_keeps(void **state) {
    (void)state;
    double slid[2];
    for (int again = 0; again < 2; again++) {
        const dem2d_material_desc stone = stone_desc(1e6, 0.5);
        dem2d_world_desc desc = {0};
        dem2d_contact_event events[16];
        dem2d_contact_info before, after;
        int count;
        desc.time_step = 2e-5, desc.gravity = vec(9.81 * 0.3, -9.81), desc.local_damping = 0.5;
        desc.event_capacity = 16;
        const scene s = open_scene(&desc, &stone);
        const dem2d_shape_id box[2] = {give_shape(&s, make_box(0.1, 0.1)),
                                       give_shape(&s, make_box(0.1, 0.1))};
        add_floor(&s);
        const dem2d_particle_desc grain = grain_desc(&s, box[0], 1, vec(0, 0.05));
        const dem2d_particle_id id = add_grain(&s, &grain);
        step(&s, 40000);
        const double mass = grain_of(&s, id).mass, spring = mass * 9.81 * 0.3 / 1e6;
        assert_int_equal(contacts_of(&s, &before, 1), 1);
        assert_near(before.tangential_force, mass * 9.81 * 0.3, 1e-3); /* turned normal: +x */
        assert_ok(dem2d_world_events(s.world, events, 16, &count, NULL));
        const double x = grain_of(&s, id).pose.position.x;
        assert_ok(dem2d_world_set_shape(s.world, id, box[again], 1 + 1e-9));
        assert_int_equal(contacts_of(&s, &after, 1), again == 0);
        if (again == 0) {
            assert_same_bits(after.normal_force, before.normal_force);
            assert_same_bits(after.tangential_force, before.tangential_force);
            step(&s, 1);
            assert_int_equal(contacts_of(&s, &after, 1), 1);
            assert_near(after.tangential_force, before.tangential_force, 1e-3);
        }
        assert_true(inside_holds(s.world));
        step(&s, 20000);
        assert_ok(dem2d_world_events(s.world, events, 16, &count, NULL));
        assert_true((count > 0) == (again == 1));
        slid[again] = (grain_of(&s, id).pose.position.x - x) / spring;
        close_scene(&s);
    }
    assert_within(slid[0], 0, 1e-2);
    assert_true(slid[1] > 0.3);
}

enum { GROWN = 40 };

/* Grains of all kinds grow in a box by a part of their overlaps: every 7th step a few of them. */
static void grow(const scene *s, const dem2d_particle_id *ids, int rounds, double *scale) {
    for (int n = 0; n < rounds; n++) {
        for (int i = n % 5; i < GROWN; i += 5) {
            dem2d_particle_desc desc;
            assert_ok(dem2d_world_get_particle_desc(s->world, ids[i], &desc));
            *scale = desc.scale * (1 + 2e-6 * (n % 11 - 3)); /* some shrink */
            assert_ok(dem2d_world_set_shape(s->world, ids[i], desc.shape, *scale));
        }
        step(s, 7);
        assert_true(inside_holds(s->world));
    }
}

/* No result depends on the skin, or on a snapshot between; contacts that last are not told as
   opened. One that shrinks out of reach is told once. */
static void test_growth(void **state) {
    (void)state;
    static const double skins[] = {0, 0.01, 0.5};
    static dem2d_contact_event events[8000];
    uint64_t hashes[4];
    for (int k = 0; k < 4; k++) {
        const dem2d_material_desc stone = stone_desc(5e6, 0.4);
        const double a[4] = {0.08, 0, 0, 0.002}, b[4] = {0, 0, 0, 0};
        dem2d_world_desc desc = {0};
        dem2d_particle_id ids[GROWN];
        double scale = 1;
        int count;
        desc.time_step = 1e-4, desc.gravity = vec(0, -9.81), desc.local_damping = 0.3;
        desc.skin = skins[k % 3], desc.event_capacity = 8000;
        scene s = open_scene(&desc, &stone);
        const dem2d_shape_id shapes[3] = {give_shape(&s, make_disc(0.05)),
                                          give_shape(&s, make_box(0.09, 0.06)),
                                          give_shape(&s, make_series(a, b, 3))};
        add_floor(&s), add_plane(&s, 0, 0, 1, 0), add_plane(&s, 0.62, 0, -1, 0);
        for (int i = 0; i < GROWN; i++) {
            dem2d_particle_desc grain =
                grain_desc(&s, shapes[i % 3], 1, vec(0.06 + 0.12 * (i % 5), 0.06 + 0.11 * (i / 5)));
            grain.angle = i;
            ids[i] = add_grain(&s, &grain);
        }
        step(&s, 4000);
        assert_ok(dem2d_world_events(s.world, events, 8000, &count, NULL));
        grow(&s, ids, 80, &scale);
        if (k == 3) { /* a world from a file goes on */
            scene_bytes bytes = scene_save(s.world);
            const scene other = scene_load(&s, &bytes);
            close_scene(&s);
            s = other;
            free(bytes.bytes);
        }
        grow(&s, ids, 80, &scale);
        assert_ok(dem2d_world_events(s.world, events, 8000, &count, NULL));
        assert_true(count < 500); /* 1,280 calls, of 4 contacts each */
        const dem2d_particle_info info = grain_of(&s, ids[0]);
        dem2d_contact_info own[16];
        int contacts;
        assert_ok(dem2d_world_particle_contacts(s.world, ids[0], own, 16, &contacts));
        assert_ok(dem2d_world_set_shape(s.world, ids[0], info.shape, 1e-3));
        assert_true(inside_holds(s.world));
        step(&s, 1);
        assert_ok(dem2d_world_events(s.world, events, 8000, &count, NULL));
        int opened = 0;
        for (int i = 0; i < count; i++)
            opened += events[i].kind == DEM2D_CONTACT_OPENED &&
                      (events[i].a.index == ids[0].index || events[i].b.index == ids[0].index);
        assert_int_equal(opened, contacts);
        step(&s, 100);
        hashes[k] = dem2d_world_hash(s.world);
        close_scene(&s);
    }
    for (int k = 1; k < 4; k++) assert_true(hashes[k] == hashes[0]);
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

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_continued), cmocka_unit_test(test_set_again),
        cmocka_unit_test(test_rebuilt),   cmocka_unit_test(test_setters),
        cmocka_unit_test(test_growth),    cmocka_unit_test(test_scale_keeps),
        cmocka_unit_test(test_choose),
    };
#ifdef PROCESSES
    if (argc == 3) return be_elsewhere(argv[1], argv[2]);
    program = argv[0];
#endif
    (void)argc, (void)argv;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
