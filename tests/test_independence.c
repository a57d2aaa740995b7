/* Results do not depend on the neighbour list, on its skin, on the order of particles in memory, on
   how work is shared, or on which contacts are computed together: the same state hash after some
   thousand steps. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "snapshot_scenes.h"

enum { GRAINS = 24, EVERY = 60 /* steps between two edits, after which hashes are compared */ };

/* How a run differs from the one it is compared with. */
typedef struct variant {
    const char *name;
    double skin;  /* of the desc */
    int rebuild;  /* 1: the list in every step; n: on the mean in every n-th; 0: by itself */
    bool scatter; /* particles are sorted in space with each of these */
    int threads;  /* parts of all work, last first; 0: no parallel_for */
    bool singly;  /* contacts one by one, none in tiles */
} variant;

static const variant plain = {"plain", 0, 0, false, 0, false};
static const variant variants[] = {
    {"skin 0.02", 0.02, 0, false, 0, false},    {"skin 0.1", 0.1, 0, false, 0, false},
    {"skin 0.5", 0.5, 0, false, 0, false},      {"skin 2", 2, 0, false, 0, false},
    {"every step", 0.1, 1, false, 0, false},    {"random steps", 0, 7, false, 0, false},
    {"rare steps", 0, 60, false, 0, false},     {"sorted in memory", 0, 20, true, 0, false},
    {"sorted always", 0.02, 1, true, 0, false}, {"1 thread", 0, 0, false, 1, false},
    {"2 threads", 0.05, 0, false, 2, false},    {"3 threads", 0, 30, true, 3, false},
    {"8 threads", 0.3, 0, false, 8, false},     {"one by one", 0, 0, false, 0, true},
};

/* --- edits on the way --------------------------------------------------------------------------
 */

static dem2d_particle_id any_grain(snapshot_scene *s) {
    dem2d_particle_id ids[2 * GRAINS];
    int count;
    assert_ok(dem2d_world_particles(s->world, ids, COUNT_OF(ids), &count));
    return ids[(int)(scene_random(s, 0, 1) * count)];
}

/* A wall of any mode, near to where it is now, and maybe a little turned. */
static void edit_wall(snapshot_scene *s, dem2d_wall_id id, double way, double turn) {
    dem2d_wall_info now;
    dem2d_wall_desc wall;
    memset(&wall, 0, sizeof wall);
    assert_ok(dem2d_world_get_wall(s->world, id, &now));
    wall.material = now.material, wall.segment = now.segment;
    wall.mode = (dem2d_wall_mode)(int)scene_random(s, 0, 3);
    wall.point = now.point, wall.normal = now.normal, wall.end = now.end;
    wall.velocity = vec(scene_random(s, -0.1, 0.1), scene_random(s, -0.1, 0.1));
    wall.stress = 1000, wall.max_speed = 0.5, wall.length = 0.25;
    const dem2d_vec move = vec(scene_random(s, -way, way), scene_random(s, -way, way));
    wall.point.x += move.x, wall.point.y += move.y;
    wall.end.x += move.x + scene_random(s, -turn, turn);
    wall.end.y += move.y + scene_random(s, -turn, turn);
    wall.normal.x += scene_random(s, -turn, turn), wall.normal.y += scene_random(s, -turn, turn);
    assert_ok(dem2d_world_set_wall(s->world, id, &wall));
}

static void edit_law(snapshot_scene *s, bool full) {
    dem2d_pair_desc pair;
    memset(&pair, 0, sizeof pair);
    pair.normal_stiffness = scene_random(s, 3e5, 1e6);
    pair.tangential_stiffness = scene_random(s, 1e5, 1e6);
    if (s->kind != SCENE_CIRCLES) pair.friction = scene_random(s, 0, 1) < 0.3 ? 0 : 0.4;
    if (full) pair.damping_ratio = scene_random(s, 0, 1) < 0.5 ? 0 : 0.1;
    assert_ok(dem2d_world_set_pair(s->world, s->stone, s->rubber, &pair));
    assert_ok(dem2d_world_set_pair(s->world, s->stone, s->stone, &pair));
}

static void edit(snapshot_scene *s, int round) {
    const dem2d_particle_id grain = any_grain(s);
    const double x = scene_random(s, 0.05, 0.25), y = scene_random(s, 0.05, 0.4);
    const double vx = scene_random(s, -1, 1), w = s->kind == SCENE_CIRCLES ? 0 : 10 * vx;
    const dem2d_motion driven = scene_random(s, 0, 1) < 0.5 ? DEM2D_DRIVEN : DEM2D_FREE;
    const bool chain = s->kind >= SCENE_DASHED;
    dem2d_particle_info at;
    switch (round % 15) {
    case 1:
        (void)scene_add_grain(s, round, x, y);
        break;
    case 2:
        assert_ok(dem2d_world_remove_particle(s->world, grain));
        break;
    case 3:
        assert_ok(dem2d_world_move_particle(s->world, grain, vec(x, y), vx));
        break;
    case 4:
        assert_ok(dem2d_world_drive_particle(s->world, grain, driven, vec(vx, 0.1), w));
        break;
    case 5:
        assert_ok(dem2d_world_drive_particle(s->world, grain, DEM2D_FIXED, vec(0, 0), 0));
        break;
    case 6:
        edit_wall(s, s->walls[round % SCENE_WALLS], 1e-4, 0);
        break;
    case 7:
        edit_wall(s, s->walls[round % SCENE_WALLS], 5e-3, 1e-3);
        break;
    case 8:
        edit_wall(s, chain ? s->chain[round % SCENE_LINKS] : s->walls[1], 1e-4, 1e-4);
        break;
    case 9:
        edit_wall(s, chain ? s->chain[round % SCENE_LINKS] : s->walls[0], 3e-3, 0);
        break;
    case 10:
        edit_law(s, s->kind == SCENE_FULL || s->kind == SCENE_DASHED);
        break;
    case 11:
        assert_ok(dem2d_world_set_gravity(s->world, vec(vx, -9)));
        break;
    case 12:
        assert_ok(dem2d_world_set_time_step(s->world, 1e-4 * (1 + vx / 4)));
        break;
    case 14: /* some, within their skins */
        for (int i = 0; i < 6; i++) {
            const dem2d_particle_id one = any_grain(s);
            assert_ok(dem2d_world_get_particle(s->world, one, &at));
            at.pose.position.x += 1e-5 * vx;
            assert_ok(dem2d_world_move_particle(s->world, one, at.pose.position, vx));
        }
        break;
    case 13:
        assert_ok(dem2d_world_set_damping(s->world, 0.2 + vx / 10, 0.5));
        break;
    default:
        assert_ok(dem2d_world_drive_particle(s->world, grain, DEM2D_FREE, vec(vx, 1), w));
    }
}

/* --- runs --------------------------------------------------------------------------------------
 */

static int rounds(void) {
    return test_long() ? 90 : 31;
}

/* Steps of a round; steps where the list is rebuilt come from a sequence of their own. */
static void step_round(dem2d_world *world, const variant *v, uint64_t *random) {
    for (int k = 0; k < EVERY && v->singly; k++) {
        inside_take_singly(world);
        assert_ok(dem2d_world_step(world, 1, NULL));
    }
    if (v->singly) return;
    if (v->rebuild == 0) {
        assert_ok(dem2d_world_step(world, EVERY, NULL));
        return;
    }
    for (int k = 0; k < EVERY; k++) {
        if (random_between(random, 0, 1) < 1.0 / v->rebuild) {
            inside_renew_list(world);
            inside_scatter(world, v->scatter);
        }
        assert_ok(dem2d_world_step(world, 1, NULL));
    }
}

/* Hashes after every round. Returns the number of contacts seen, between particles and with walls.
 */
static int run_scene(int kind, const variant *v, uint64_t *hashes) {
    snapshot_scene s;
    dem2d_world_desc desc = scene_desc(kind);
    uint64_t random = 7;
    int contacts = 0, threads = v->threads;
    desc.skin = v->skin;
    desc.parallel_for = threads > 0 ? run_parts : NULL, desc.parallel_user = &threads;
    scene_make(&s, kind, GRAINS, &desc);
    for (int round = 0; round < rounds(); round++) {
        dem2d_stats stats;
        if (round > 0) edit(&s, round);
        step_round(s.world, v, &random);
        hashes[round] = dem2d_world_hash(s.world);
        assert_ok(dem2d_world_stats(s.world, &stats));
        if (getenv("DBG"))
            printf("%s %d: %d %d p%d\n", scene_names[kind], round, stats.contacts,
                   stats.wall_contacts, stats.particles);
        contacts += stats.contacts + stats.wall_contacts;
    }
    dem2d_world_destroy(s.world);
    return contacts;
}

/* Returns how many variants differ. */
static int check_kind(int kind) {
    uint64_t expected[90], hashes[90];
    int differ = 0;
    assert_true(run_scene(kind, &plain, expected) > 5 * rounds());
    for (int i = 0; i < COUNT_OF(variants); i++) {
        (void)run_scene(kind, &variants[i], hashes);
        for (int round = 0; round < rounds(); round++) {
            if (hashes[round] == expected[round]) continue;
            print_error("%s, %s: another hash after %d steps\n", scene_names[kind],
                        variants[i].name, (round + 1) * EVERY);
            differ++;
            break;
        }
    }
    return differ;
}

static void test_kinds(void **state) {
    int differ = 0;
    (void)state;
    for (int kind = 0; kind < SCENE_COUNT; kind++) differ += check_kind(kind);
    assert_int_equal(differ, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_kinds)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
