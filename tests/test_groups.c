/* Groups and sensors: who meets whom, edits of it, what sensors detect; user data. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"
#include "inside.h"

#define RADIUS 0.05

static scene make_scene(double skin, bool ledger) {
    const dem2d_material_desc material = stone_desc(5e5, 0.3);
    dem2d_world_desc desc = {0};
    desc.time_step = 1e-4, desc.gravity = vec(0, -9.81), desc.skin = skin, desc.ledger = ledger;
    desc.local_damping = 0.2;
    return open_scene(&desc, &material);
}

static dem2d_groups groups_of(uint32_t category, uint32_t mask, bool sensor) {
    const dem2d_groups groups = {category, mask, sensor};
    return groups;
}

static dem2d_particle_id add_disc(const scene *s, dem2d_shape_id shape, double x, double y,
                                  dem2d_groups groups) {
    dem2d_particle_desc desc = grain_desc(s, shape, 1, vec(x, y));
    desc.groups = groups;
    return add_grain(s, &desc);
}

/* Who meets whom, in all combinations of few bits: 0 is all. */
static bool meets(dem2d_groups a, dem2d_groups b) {
    const uint32_t all = UINT32_MAX;
    const uint32_t ca = a.category ? a.category : all, cb = b.category ? b.category : all;
    const uint32_t ma = a.mask ? a.mask : all, mb = b.mask ? b.mask : all;
    return !a.sensor && !b.sensor && (ca & mb) != 0 && (cb & ma) != 0;
}

/* Discs of two groups that fall on each other pass, and rest on the floor, which is in all. */
static void test_pass(void **state) {
    (void)state;
    scene s = make_scene(0, false);
    const dem2d_shape_id shape = give_shape(&s, make_disc(RADIUS));
    dem2d_particle_id ids[4];
    add_floor(&s);
    for (int i = 0; i < 4; i++) {
        const uint32_t bit = i % 2 ? 1u << 31 : 1;
        ids[i] = add_disc(&s, shape, i / 2 * 0.1, 0.1 + 0.2 * (i % 2), groups_of(bit, bit, false));
    }
    step(&s, 20000);
    const dem2d_particle_info info = grain_of(&s, ids[0]);
    for (int i = 0; i < 4; i++)
        assert_near(grain_of(&s, ids[i]).pose.position.y, RADIUS - info.mass * 9.81 / 1e7, 1e-6);
    assert_int_equal(stats_of(&s).contacts, 0);
    assert_int_equal(stats_of(&s).wall_contacts, 4);
    close_scene(&s);
}

/* Groups in which all meet change no bit. */
static void test_same_bits(void **state) {
    (void)state;
    double place[2][30];
    for (int k = 0; k < 2; k++) {
        scene s = make_scene(0, true);
        const dem2d_shape_id shape = give_shape(&s, make_disc(RADIUS));
        const dem2d_shape_id box = give_shape(&s, make_box(0.08, 0.06));
        dem2d_particle_id ids[30];
        add_floor(&s), add_plane(&s, 0, 0, 1, 0), add_plane(&s, 0.32, 0, -1, 0);
        for (int i = 0; i < 30; i++)
            ids[i] = add_disc(&s, i % 3 ? shape : box, 0.06 + 0.1 * (i % 3) + 0.003 * (i % 5),
                              0.06 + 0.11 * (i / 3),
                              groups_of((uint32_t)k << i % 4, 15u * (uint32_t)k, false));
        step(&s, 3000);
        for (int i = 0; i < 30; i++) place[k][i] = grain_of(&s, ids[i]).pose.position.x;
        close_scene(&s);
    }
    for (int i = 0; i < 30; i++) assert_same_bits(place[0][i], place[1][i]);
}

/* A disc on another and on a floor: they part when their groups do, and meet again. */
static void test_edits(void **state) {
    (void)state;
    scene s = make_scene(0, true);
    const dem2d_shape_id shape = give_shape(&s, make_disc(RADIUS));
    const dem2d_wall_id floor = add_floor(&s);
    const dem2d_particle_id lower = add_disc(&s, shape, 0, RADIUS, groups_of(0, 0, false));
    const dem2d_particle_id upper = add_disc(&s, shape, 0, 3 * RADIUS, groups_of(0, 0, false));
    dem2d_wall_desc desc = plane_desc(&s, vec(0, 0), vec(0, 1));
    step(&s, 5000);
    assert_int_equal(stats_of(&s).contacts, 1);
    const int64_t rebuilds = stats_of(&s).list_rebuilds;
    assert_ok(dem2d_world_set_groups(s.world, upper, groups_of(4, 0, false))); /* meets the same */
    assert_ok(dem2d_world_set_user_data(s.world, upper, 99));
    desc.groups.category = 4;
    assert_ok(dem2d_world_set_wall(s.world, floor, &desc));
    step(&s, 10);
    assert_int_equal(stats_of(&s).list_rebuilds, rebuilds);
    assert_ok(dem2d_world_set_groups(s.world, lower, groups_of(2, 6, false)));
    assert_ok(dem2d_world_set_groups(s.world, upper, groups_of(4, 4, false)));
    assert_int_equal(stats_of(&s).contacts, 0); /* at once */
    step(&s, 1000);
    assert_true(stats_of(&s).list_rebuilds > rebuilds);
    assert_true(grain_of(&s, upper).pose.position.y < 3 * RADIUS - 0.03);
    step(&s, 20000); /* both on the floor, one in the other */
    assert_int_equal(stats_of(&s).wall_contacts, 2);
    assert_int_equal(stats_of(&s).contacts, 0);
    const dem2d_ledger ledger = ledger_of(&s);
    assert_true(fabs(ledger.closure) < 1e-3 * ledger.turnover);
    desc.groups = groups_of(4, 4, false); /* the floor is there for the upper one alone */
    assert_ok(dem2d_world_set_wall(s.world, floor, &desc));
    assert_int_equal(stats_of(&s).wall_contacts, 1);
    step(&s, 2000);
    assert_true(grain_of(&s, lower).pose.position.y < 0);
    assert_near(grain_of(&s, upper).pose.position.y, RADIUS, 1e-3);
    assert_int_equal(grain_of(&s, upper).user_data, 99);
    assert_int_equal(grain_of(&s, lower).groups.mask, 6);
    assert_int_equal(wall_of(&s, floor).groups.category, 4);
    close_scene(&s);
}

/* Grains fall through a sensor line and a sensor disc: each is counted once by both, and falls as
   without them. */
static void test_flow(void **state) {
    (void)state;
    enum { GRAINS = 20 };
    uint64_t bits[2][GRAINS];
    for (int k = 0; k < 2; k++) {
        scene s = make_scene(0, false);
        const dem2d_shape_id shape = give_shape(&s, make_disc(RADIUS));
        dem2d_particle_id ids[GRAINS], gate = {0, 0};
        dem2d_wall_id line = {0, 0};
        int passed = 0, through = 0;
        bool in_line[GRAINS] = {false}, in_gate[GRAINS] = {false};
        for (int i = 0; i < GRAINS; i++)
            ids[i] = add_disc(&s, shape, 0.02 * (i % 3), 0.3 + 0.12 * i, groups_of(1, 0, false));
        if (k == 1) {
            dem2d_wall_desc desc = plane_desc(&s, vec(-0.5, 0), vec(0, 0));
            desc.segment = true, desc.end = vec(0.5, 0), desc.groups.sensor = true;
            line = add_wall(&s, &desc);
            dem2d_particle_desc disc = grain_desc(&s, shape, 2, vec(0, -0.4));
            disc.motion = DEM2D_FIXED, disc.groups = groups_of(0, 1, true);
            gate = add_grain(&s, &disc);
        }
        for (int n = 0; n < 9000; n += 10) {
            dem2d_found found[GRAINS];
            int count;
            step(&s, 10);
            if (k == 0) continue;
            bool now_line[GRAINS] = {false}, now_gate[GRAINS] = {false};
            assert_ok(dem2d_world_wall_overlaps(s.world, line, NULL, found, GRAINS, &count));
            for (int i = 0; i < count; i++) now_line[found[i].particle.index] = true;
            assert_ok(dem2d_world_particle_overlaps(s.world, gate, NULL, found, GRAINS, &count));
            for (int i = 0; i < count; i++) now_gate[found[i].particle.index] = true;
            for (int i = 0; i < GRAINS; i++) {
                const double y = grain_of(&s, ids[i]).pose.position.y;
                assert_true(now_line[i] == (fabs(y) <= RADIUS));
                passed += now_line[i] && !in_line[i], through += now_gate[i] && !in_gate[i];
                in_line[i] = now_line[i], in_gate[i] = now_gate[i];
            }
        }
        if (k == 1) {
            assert_int_equal(passed, GRAINS);
            assert_int_equal(through, GRAINS);
            assert_int_equal(packing_of(&s).rattlers, GRAINS);
            assert_int_equal(stats_of(&s).contacts + stats_of(&s).wall_contacts, 0);
        }
        for (int i = 0; i < GRAINS; i++) {
            const double y = grain_of(&s, ids[i]).pose.position.y;
            memcpy(&bits[k][i], &y, sizeof y);
        }
        close_scene(&s);
    }
    assert_memory_equal(bits[0], bits[1], sizeof bits[0]);
}

/* A heap of discs in groups that change at random: after each step there is a contact exactly
   where two that meet overlapped, whatever the skin; and the run goes on after saving. */
static void test_heap(void **state) {
    (void)state;
    enum { GRAINS = 40 };
    const double skins[] = {0, 0.02, 0.4};
    uint64_t hashes[3];
    for (int k = 0; k < 3; k++) {
        uint64_t random = 7;
        scene s = make_scene(skins[k], false);
        const dem2d_shape_id shape = give_shape(&s, make_disc(RADIUS));
        dem2d_particle_id ids[GRAINS];
        dem2d_groups groups[GRAINS];
        static dem2d_contact_info list[2000];
        add_floor(&s), add_plane(&s, 0, 0, 1, 0), add_plane(&s, 0.6, 0, -1, 0);
        for (int i = 0; i < GRAINS; i++) {
            groups[i] = groups_of(0, 0, false);
            ids[i] = add_disc(&s, shape, 0.06 + 0.11 * (i % 5) + 0.003 * (i % 7),
                              0.06 + 0.11 * (i / 5), groups[i]);
        }
        for (int n = 0; n < 150; n++) {
            dem2d_vec at[GRAINS];
            const int i = random_below(&random, GRAINS);
            /* lone bits of three, all, or a sensor for a while; overlaps that come back are small
             */
            groups[i] = random_below(&random, 2) ? groups_of(0, 0, false)
                                                 : groups_of(1u << random_below(&random, 3),
                                                             1u << random_below(&random, 3),
                                                             random_below(&random, 4) == 0);
            assert_ok(dem2d_world_set_groups(s.world, ids[i], groups[i]));
            step(&s, 7);
            for (int j = 0; j < GRAINS; j++) at[j] = grain_of(&s, ids[j]).pose.position;
            step(&s, 1);
            const int count = contacts_of(&s, list, COUNT_OF(list));
            int pairs = 0, expected = 0;
            for (int c = 0; c < count; c++) {
                if (list[c].b.generation == 0) continue;
                assert_true(meets(groups[list[c].a.index], groups[list[c].b.index]));
                pairs++;
            }
            for (int a = 0; a < GRAINS; a++)
                for (int b = 0; b < a; b++)
                    expected += meets(groups[a], groups[b]) &&
                                hypot(at[a].x - at[b].x, at[a].y - at[b].y) < 2 * RADIUS;
            assert_int_equal(pairs, expected);
            assert_true(inside_holds(s.world));
            if (n == 75) { /* a world from a file goes on */
                scene_bytes bytes = scene_save(s.world);
                const scene other = scene_load(&s, &bytes);
                assert_true(dem2d_world_hash(other.world) == dem2d_world_hash(s.world));
                close_scene(&s);
                s = other;
                free(bytes.bytes);
                assert_int_equal(grain_of(&s, ids[i]).groups.category, groups[i].category);
            }
        }
        hashes[k] = dem2d_world_hash(s.world);
        close_scene(&s);
    }
    assert_true(hashes[0] == hashes[1] && hashes[1] == hashes[2]);
}

/* Queries find by mask, with or without sensors. */
static void test_masks(void **state) {
    (void)state;
    scene s = make_scene(0, false);
    const dem2d_shape_id shape = give_shape(&s, make_disc(RADIUS));
    const dem2d_box all = {{-1, -1}, {1, 1}};
    const uint32_t category[4] = {0, 1, 2, 2};
    for (int i = 0; i < 4; i++) (void)add_disc(&s, shape, 0, 0, groups_of(category[i], 0, i == 3));
    const struct {
        dem2d_query_desc desc;
        int count;
    } cases[] = {{{0}, 4},
                 {{.mask = 1}, 2},
                 {{.mask = 2}, 3},
                 {{.mask = 3}, 4},
                 {{.mask = 4}, 1},
                 {{.skip_sensors = true}, 3},
                 {{.mask = 2, .skip_sensors = true}, 2}};
    for (int i = 0; i < COUNT_OF(cases); i++) {
        int count;
        assert_ok(dem2d_world_query_box(s.world, &all, &cases[i].desc, NULL, 0, &count));
        assert_int_equal(count, cases[i].count);
        assert_ok(dem2d_world_cast_ray_all(s.world, vec(-1, 0), vec(1, 0), 0, &cases[i].desc, NULL,
                                           0, &count));
        assert_int_equal(count, cases[i].count);
    }
    close_scene(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pass), cmocka_unit_test(test_same_bits), cmocka_unit_test(test_edits),
        cmocka_unit_test(test_flow), cmocka_unit_test(test_heap),      cmocka_unit_test(test_masks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
