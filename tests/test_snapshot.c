/* The hash of a world's state, and snapshots: a world that was loaded goes on as if it had never
   stopped, and no damaged snapshot is taken for a good one. */
#define _POSIX_C_SOURCE 200809L
#include "dem2d.h"
#include "testing.h"
#include "inside.h"
#include "snapshot_scenes.h"

#include <sys/stat.h>
#include <unistd.h>

/* --- snapshots as words -------------------------------------------------------------------------
 */

static void put_word(char *bytes, uint64_t word) {
    for (int k = 0; k < 8; k++) bytes[k] = (char)(word >> 8 * k & 255);
}

static uint64_t get_word(const char *bytes) {
    uint64_t word = 0;
    for (int k = 0; k < 8; k++) word |= (uint64_t)(unsigned char)bytes[k] << 8 * k;
    return word;
}

/* A record of a snapshot: name, rows and fields; name and numbers of each field, with 256 added for
   doubles; then the numbers. */
typedef struct record {
    size_t at, rows_at, end;
    uint64_t rows, fields, width;
} record;

enum { RECORD_HEAD = 40, FIELD_HEAD = 32, SNAPSHOT_VERSION = 4 };

static record record_at(const scene_bytes *bytes, size_t at) {
    record r = {at, at + RECORD_HEAD, 0, 0, 0, 0};
    r.rows = get_word(bytes->bytes + at + 24), r.fields = get_word(bytes->bytes + at + 32);
    for (uint64_t f = 0; f < r.fields; f++, r.rows_at += FIELD_HEAD) {
        const uint64_t numbers = get_word(bytes->bytes + r.rows_at + 24);
        assert_in_range(numbers & 255, 1, 8);
        assert_true((numbers & ~(uint64_t)511) == 0);
        r.width += numbers & 255;
    }
    r.end = r.rows_at + 8 * r.width * r.rows;
    assert_true(r.end <= bytes->size - 8);
    return r;
}

static record record_named(const scene_bytes *bytes, const char *name) {
    record r = record_at(bytes, 24);
    while (strncmp(bytes->bytes + r.at, name, 24) != 0) r = record_at(bytes, r.end);
    return r;
}

/* --- two worlds, the same -----------------------------------------------------------------------
 */

static void assert_same_bytes(const dem2d_world *a, const dem2d_world *b) {
    scene_bytes x = scene_save(a), y = scene_save(b);
    for (size_t at = 24; at < x.size - 8; at = record_at(&x, at).end) {
        const record r = record_at(&x, at), other = record_at(&y, at);
        if (r.end != other.end || memcmp(x.bytes + at, y.bytes + at, r.end - at) != 0)
            fail_msg("column %s differs", x.bytes + at);
    }
    assert_int_equal(x.size, y.size);
    assert_memory_equal(x.bytes, y.bytes, x.size);
    free(x.bytes), free(y.bytes);
}

static void assert_same_stats(const dem2d_world *a, const dem2d_world *b) {
    dem2d_stats x, y;
    memset(&x, 0, sizeof x), memset(&y, 0, sizeof y);
    assert_ok(dem2d_world_stats(a, &x));
    assert_ok(dem2d_world_stats(b, &y));
    x.bytes = y.bytes = 0; /* capacities are not kept */
    assert_memory_equal(&x, &y, sizeof x);
}

static void assert_same_numbers(const double *a, const double *b, int count) {
    for (int i = 0; i < count; i++) assert_same_bits(a[i], b[i]);
}

/* Of a world that keeps one. */
static int ledger_numbers(const dem2d_world *world, double *to) {
    dem2d_ledger l;
    if (dem2d_world_ledger(world, &l) != DEM2D_OK) return 0;
    const double got[] = {l.kinetic,  l.normal,  l.tangential, l.gravity, l.walls,  l.driven,
                          l.friction, l.dashpot, l.damping,    l.given,   l.closure};
    memcpy(to, got, sizeof got);
    return COUNT_OF(got);
}

/* What queries say, in a row of numbers. */
static int numbers_of(const dem2d_world *world, double *to, int room) {
    static dem2d_particle_id ids[200];
    static dem2d_contact_info contacts[1000];
    dem2d_wall_id wall_ids[20];
    int count, walls, used = 0;
    dem2d_energy energy;
    assert_ok(dem2d_world_walls(world, wall_ids, COUNT_OF(wall_ids), &walls));
    assert_in_range(walls, 0, COUNT_OF(wall_ids));
    assert_ok(dem2d_world_energy(world, &energy));
    to[used++] = energy.translational, to[used++] = energy.rotational;
    to[used++] = energy.normal, to[used++] = energy.tangential, to[used++] = energy.potential;
    to[used++] = energy.rolling;
    used += ledger_numbers(world, to + used);
    for (int j = 0; j < walls; j++) {
        dem2d_wall_info w;
        assert_ok(dem2d_world_get_wall(world, wall_ids[j], &w));
        const double got[] = {wall_ids[j].index, w.segment, w.point.x,    w.point.y,
                              w.end.x,           w.end.y,   w.velocity.x, w.normal.x,
                              w.force.x,         w.force.y, w.length,     w.stress};
        memcpy(to + used, got, sizeof got);
        used += COUNT_OF(got);
    }
    assert_ok(dem2d_world_particles(world, ids, COUNT_OF(ids), &count));
    assert_in_range(count, 0, COUNT_OF(ids));
    for (int i = 0; i < count; i++) {
        dem2d_particle_info p;
        assert_ok(dem2d_world_get_particle(world, ids[i], &p));
        const double got[] = {
            ids[i].index,       ids[i].generation, p.shape.index,   p.material.index,
            p.pose.position.x,  p.pose.position.y, p.pose.scale,    p.pose.rotation.c,
            p.pose.rotation.s,  p.velocity.x,      p.velocity.y,    p.force.x,
            p.angular_velocity, p.force.y,         p.torque,        p.mass,
            p.inertia,          p.radius,          (double)p.motion};
        assert_true(used + COUNT_OF(got) <= room);
        memcpy(to + used, got, sizeof got);
        used += COUNT_OF(got);
    }
    assert_ok(dem2d_world_contacts(world, contacts, COUNT_OF(contacts), &count));
    assert_in_range(count, 0, COUNT_OF(contacts));
    for (int i = 0; i < count; i++) {
        const dem2d_contact_info *c = &contacts[i];
        const double got[] = {c->a.index,  c->b.index,          c->b.generation,    c->wall.index,
                              c->normal.x, c->normal.y,         c->point.x,         c->point.y,
                              c->depth,    c->branch.x,         c->branch.y,        c->normal_force,
                              c->points,   c->tangential_force, c->wall.generation, c->moment};
        assert_true(used + COUNT_OF(got) <= room);
        memcpy(to + used, got, sizeof got);
        used += COUNT_OF(got);
    }
    for (int j = 0; j < walls; j++) {
        dem2d_wall_info w;
        assert_ok(dem2d_world_get_wall(world, wall_ids[j], &w));
        const double got[] = {w.point.x,    w.point.y,    w.normal.x, w.normal.y,
                              w.velocity.x, w.velocity.y, w.force.x,  w.force.y,
                              w.length,     w.stress,     w.target,   (double)w.mode};
        assert_true(used + COUNT_OF(got) <= room);
        memcpy(to + used, got, sizeof got);
        used += COUNT_OF(got);
    }
    return used;
}

static void assert_same_world(const dem2d_world *a, const dem2d_world *b) {
    static double x[20000], y[20000];
    const int count = numbers_of(a, x, COUNT_OF(x));
    assert_int_equal(count, numbers_of(b, y, COUNT_OF(y)));
    assert_same_numbers(x, y, count);
    assert_same_stats(a, b);
    assert_int_equal(dem2d_world_hash(a), dem2d_world_hash(b));
    assert_same_bytes(a, b);
}

/* Items one by one, the last first. */
static void run_backwards(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                          void *context) {
    (void)user, (void)phase;
    for (int i = count - 1; i >= 0; i--) task(context, i, i + 1);
}

static dem2d_world *load_with(scene_bytes *bytes, const dem2d_env *env, bool shared) {
    dem2d_custom_desc custom;
    dem2d_load_desc desc = scene_load_desc(bytes, &custom);
    dem2d_world *world = NULL;
    desc.env = env;
    desc.parallel_for = shared ? run_backwards : NULL;
    assert_ok(dem2d_world_load(&desc, NULL, &world));
    assert_non_null(world);
    return world;
}

/* Saves and loads a world, and takes both further; the first goes on. */
static void check_resume(dem2d_world *world, bool shared, int steps) {
    test_env env;
    test_env_init(&env);
    scene_bytes bytes = scene_save(world);
    dem2d_world *copy = load_with(&bytes, &env.env, shared);
    assert_same_world(world, copy);
    for (int i = 0; i < steps; i++) {
        int done[2];
        const dem2d_result result = dem2d_world_step(world, 1, &done[0]);
        assert_result(dem2d_world_step(copy, 1, &done[1]), result);
        assert_int_equal(done[0], done[1]);
        assert_int_equal(dem2d_world_hash(world), dem2d_world_hash(copy));
        double books[2][11];
        const int count = ledger_numbers(world, books[0]);
        assert_int_equal(count, ledger_numbers(copy, books[1]));
        assert_same_numbers(books[0], books[1], count);
    }
    assert_same_world(world, copy);
    dem2d_world_destroy(copy);
    assert_clean(&env);
    free(bytes.bytes);
}

/* --- going on ------------------------------------------------------------------------------------
 */

/* Between any two steps: while a list lasts, when it is worn out, contacts made and lost. */
static void test_resume(void **state) {
    (void)state;
    for (int kind = 0; kind < SCENE_COUNT; kind++) {
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(kind);
        int worn = 0, lasting = 0, contacts = 0;
        scene_make(&s, kind, 20, &desc);
        for (int i = 0; i < 24; i++) {
            dem2d_stats stats;
            int steps = i < 8 ? 1 : 41;
            check_resume(s.world, i % 2 == 1, 5);
            for (; steps > 0 || (i % 4 == 3 && !inside_list_used_up(s.world)); steps--) {
                assert_true(steps > -5000);
                assert_ok(dem2d_world_step(s.world, 1, NULL));
            }
            assert_ok(dem2d_world_stats(s.world, &stats));
            worn += inside_list_used_up(s.world), lasting += !inside_list_stale(s.world);
            contacts += stats.contacts + stats.wall_contacts;
        }
        check_resume(s.world, false, 500);
        assert_true(worn > 4 && lasting > 4 && contacts > 100);
        dem2d_world_destroy(s.world);
    }
}

/* Enough for several blocks, and for sorting in memory: threads or not must not matter. */
static void test_resume_blocks(void **state) {
    (void)state;
    static const int kinds[] = {SCENE_RUBBING, SCENE_MIXED, SCENE_DASHED, SCENE_FULL, SCENE_LAW};
    for (int i = 0; i < COUNT_OF(kinds); i++) {
        const int kind = kinds[i];
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(kind);
        desc.parallel_for = run_backwards;
        scene_make(&s, kind, 180, &desc);
        assert_ok(dem2d_world_step(s.world, 60, NULL));
        check_resume(s.world, false, 60);
        check_resume(s.world, true, 60);
        dem2d_world_destroy(s.world);
    }
}

/* Never stepped, empty, emptied. */
static void test_resume_empty(void **state) {
    (void)state;
    for (int kind = 0; kind < SCENE_COUNT; kind++) {
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(kind);
        desc.skin = kind == SCENE_GJK ? 0.25 : 0;
        assert_ok(dem2d_world_create(&desc, &s.world));
        check_resume(s.world, false, 3);
        dem2d_world_destroy(s.world);
        scene_make(&s, kind, 0, &desc);
        check_resume(s.world, true, 3);
        const dem2d_particle_id id = scene_add_grain(&s, 1, 0.03, 0.03);
        check_resume(s.world, true, 30);
        assert_ok(dem2d_world_remove_particle(s.world, id));
        check_resume(s.world, false, 0);
        check_resume(s.world, false, 3);
        dem2d_world_destroy(s.world);
    }
}

/* One change to a scene. Returns false when there are no more. */
static bool change_scene(snapshot_scene *s, int which) {
    dem2d_world *w = s->world;
    const dem2d_particle_id some = {5, 1}, other = {6, 1};
    const dem2d_pair_desc slippery = pair_desc(5e5, 0, 0), rough = pair_desc(5e5, 5e5, 1);
    const dem2d_pair_desc dashed = {.normal_stiffness = 5e5,
                                    .tangential_stiffness = 5e5,
                                    .friction = 0.5,
                                    .damping_ratio = 0.25},
                          rolling = {.normal_stiffness = 5e5,
                                     .tangential_stiffness = 5e5,
                                     .friction = 0.5,
                                     .rolling_friction = 0.125};
    const dem2d_material_desc lead = material_desc(11000, 2e6, 0, 0.25);
    dem2d_wall_desc wall = {0};
    dem2d_material_id id;
    switch (which) {
    case 0:
        (void)scene_add_grain(s, 2, 0.1, 0.25);
        return true;
    case 1:
        assert_ok(dem2d_world_remove_particle(w, some));
        return true;
    case 2: /* takes the id that became free, in another slot */
        assert_int_equal(scene_add_grain(s, 1, 0.2, 0.25).index, some.index);
        return true;
    case 3:
        assert_ok(dem2d_world_move_particle(w, other, vec(0.03, 0.3), 1));
        return true;
    case 4:
        assert_ok(dem2d_world_drive_particle(w, other, DEM2D_FIXED, vec(0, 0), 0));
        return true;
    case 5:
        assert_ok(dem2d_world_drive_particle(w, other, DEM2D_FREE, vec(0.1, 0.1), 2));
        return true;
    case 6:
        assert_ok(dem2d_world_set_pair(w, s->stone, s->rubber, &slippery));
        return true;
    case 7:
        for (int i = 0; i < 3; i++)
            assert_ok(dem2d_world_set_pair(w, i < 2 ? s->stone : s->rubber,
                                           i < 1 ? s->stone : s->rubber, &slippery));
        return true;
    case 8:
        assert_ok(dem2d_world_set_pair(w, s->stone, s->rubber, &rough));
        return true;
    case 9: /* five materials: a wider table of laws */
        for (int i = 0; i < 3; i++) assert_ok(dem2d_world_add_material(w, &lead, &id));
        return true;
    case 10:
        wall.material = s->rubber, wall.point = vec(0.001, 0), wall.normal = vec(1, 0);
        assert_ok(dem2d_world_set_wall(w, s->walls[1], &wall));
        return true;
    case 11:
        wall.material = s->stone, wall.point = vec(0.002, 0), wall.normal = vec(1, 0.05);
        assert_ok(dem2d_world_set_wall(w, s->walls[1], &wall));
        return true;
    case 12:
        assert_ok(dem2d_world_remove_wall(w, s->walls[0]));
        return true;
    case 13:
        wall.material = s->stone, wall.point = vec(0, -0.001), wall.normal = vec(0, 1);
        assert_ok(dem2d_world_add_wall(w, &wall, &s->walls[0]));
        return true;
    case 14:
        assert_ok(dem2d_world_set_gravity(w, vec(1, -5)));
        return true;
    case 15:
        assert_ok(dem2d_world_set_damping(w, 0.5, 1));
        return true;
    case 16:
        assert_ok(dem2d_world_set_time_step(w, 5e-5));
        return true;
    case 17: /* the full law on, in another way, and off */
    case 18:
    case 19:
        for (int i = 0; i < 3; i++)
            assert_ok(dem2d_world_set_pair(w, i < 2 ? s->stone : s->rubber,
                                           i < 1 ? s->stone : s->rubber,
                                           which == 17   ? &dashed
                                           : which == 18 ? &rolling
                                                         : &rough));
        return true;
    case 20: /* segments come, move and go */
    case 21:
    case 22:
        wall.material = s->stone, wall.segment = true;
        wall.point = vec(0.02, 0.2), wall.end = vec(0.15, 0.001 * which);
        if (which == 20) assert_ok(dem2d_world_add_wall(w, &wall, &s->chain[0]));
        wall.mode = DEM2D_WALL_MOVING, wall.velocity = vec(0.1, 0.2);
        if (which == 21) assert_ok(dem2d_world_set_wall(w, s->chain[0], &wall));
        if (which == 22) assert_ok(dem2d_world_remove_wall(w, s->chain[0]));
        return true;
    default:
        return false;
    }
}

/* Right after each change, and one step and some later. */
static void test_resume_changed(void **state) {
    (void)state;
    for (int kind = 0; kind < SCENE_COUNT; kind++) {
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(kind);
        scene_make(&s, kind, 16, &desc);
        assert_ok(dem2d_world_step(s.world, 300, NULL));
        for (int which = 0; change_scene(&s, which); which++) {
            check_resume(s.world, false, 0);
            check_resume(s.world, which % 2 == 0, 1);
            check_resume(s.world, which % 2 == 1, 2);
            check_resume(s.world, false, 40);
        }
        dem2d_world_destroy(s.world);
    }
}

/* Half of the grains become fixed, and free again: contacts that they had with each other and with
   walls are gone. */
static void fix_half(snapshot_scene *s, bool free_again) {
    for (int k = 0; k <= free_again; k++)
        for (uint32_t i = 0; i < 8; i++) {
            const dem2d_particle_id id = {i, 1};
            assert_ok(dem2d_world_drive_particle(s->world, id, k > 0 ? DEM2D_FREE : DEM2D_FIXED,
                                                 vec(0, 0), 0));
        }
}

/* Changes that a caller may make, one of them; false: none are left. */
static bool edit_world(snapshot_scene *s, int which) {
    const dem2d_pair_desc smooth = pair_desc(1e6, 0, 0), rough = {.normal_stiffness = 1e6,
                                                                  .tangential_stiffness = 1e6,
                                                                  .friction = 0.5,
                                                                  .damping_ratio = 0.25,
                                                                  .rolling_friction = 0.125};
    const dem2d_particle_id grain = {2, 1}, another = {1, 1};
    dem2d_wall_desc wall = {0};
    dem2d_wall_id id;
    dem2d_particle_info at;
    assert_ok(dem2d_world_get_particle(s->world, another, &at));
    wall.material = s->rubber, wall.point = vec(0, -0.5), wall.normal = vec(0, 1);
    switch (which) {
    case 0:
        assert_ok(dem2d_world_set_gravity(s->world, vec(1, -2)));
        break;
    case 1:
        assert_ok(dem2d_world_set_damping(s->world, 0.5, 1));
        break;
    case 2: /* the last of friction, rolling and dashpots goes */
    case 3:
        for (int k = 0; k < 3; k++)
            assert_ok(dem2d_world_set_pair(s->world, k < 2 ? s->stone : s->rubber,
                                           k < 1 ? s->stone : s->rubber,
                                           which == 2 ? &smooth : &rough));
        break;
    case 4:
    case 5:
        assert_ok(dem2d_world_drive_particle(s->world, grain,
                                             which == 4 ? DEM2D_DRIVEN : DEM2D_FREE, vec(1, 0), 2));
        break;
    case 6:
        assert_ok(dem2d_world_move_particle(s->world, grain, vec(0.1, -3), 1));
        break;
    case 7:
        assert_ok(dem2d_world_remove_particle(s->world, grain));
        break;
    case 8:
        (void)scene_add_grain(s, 0, 0.0625, -3);
        break;
    case 9:
        assert_ok(dem2d_world_set_wall(s->world, s->walls[0], &wall));
        break;
    case 10:
        assert_ok(dem2d_world_add_wall(s->world, &wall, &id));
        break;
    case 11:
        assert_ok(dem2d_world_remove_wall(s->world, s->walls[0]));
        break;
    case 12: /* where it overlaps another */
        at.pose.position.x += 0.01;
        assert_ok(dem2d_world_move_particle(s->world, grain, at.pose.position, 1));
        break;
    case 13:
        (void)scene_add_grain(s, 0, at.pose.position.x, at.pose.position.y + 0.01);
        break;
    case 14:
    case 15:
        fix_half(s, which == 15);
        break;
    default:
        return false;
    }
    return true;
}

/* A step that is refused leaves the world as it was, whatever was changed before it; saved and
   loaded, it still is. */
static void test_refused(void **state) {
    (void)state;
    for (int kind = 0; kind < SCENE_COUNT; kind++) {
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(kind);
        dem2d_custom_desc custom;
        scene_make(&s, kind, 16, &desc);
        assert_ok(dem2d_world_step(s.world, 1100, NULL));
        scene_bytes bytes = scene_save(s.world);
        dem2d_world_destroy(s.world);
        for (int which = 0, edited = true; edited; which++) {
            const dem2d_load_desc load = scene_load_desc(&bytes, &custom);
            assert_ok(dem2d_world_load(&load, NULL, &s.world));
            edited = edit_world(&s, which);
            assert_ok(dem2d_world_set_time_step(s.world, 1));
            const uint64_t hash = dem2d_world_hash(s.world);
            for (int k = 0; k < 2; k++) {
                assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_TIME_STEP);
                if (dem2d_world_hash(s.world) != hash) {
                    print_error("%s, change %d\n", scene_names[kind], which);
                    fail();
                }
            }
            check_resume(s.world, false, 0);
            dem2d_world_destroy(s.world);
        }
        free(bytes.bytes);
    }
}

/* A step that is refused may have renewed the list; circles get rotations when the first shape that
   needs them comes. */
static void test_resume_refused(void **state) {
    (void)state;
    for (int kind = 0; kind < SCENE_COUNT; kind++) {
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(kind);
        static const dem2d_vec corners[3] = {{0, 0}, {0.05, 0}, {0, 0.05}};
        dem2d_shape *triangle;
        scene_make(&s, kind, 16, &desc);
        assert_ok(dem2d_world_step(s.world, 700, NULL));
        assert_ok(dem2d_shape_create_polygon(NULL, corners, 3, 0, &triangle));
        s.shape_count = 0;
        scene_add_shape(&s, triangle);
        (void)scene_add_grain(&s, 0, 0.3, 0.6);
        assert_ok(dem2d_world_set_time_step(s.world, 1));
        const uint64_t hash = dem2d_world_hash(s.world);
        assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_TIME_STEP);
        assert_int_equal(dem2d_world_hash(s.world), hash);
        check_resume(s.world, false, 2);
        assert_ok(dem2d_world_set_time_step(s.world, 1e-4));
        check_resume(s.world, false, 0);
        check_resume(s.world, false, 50);
        dem2d_world_destroy(s.world);
    }
}

/* Settings that are not the defaults; a step that is too long is taken when it is not checked. */
static void test_settings(void **state) {
    (void)state;
    for (int k = 0; k < 2; k++) {
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(SCENE_MIXED);
        desc.contact_tolerance = 1e-5;
        desc.max_iterations = 3;
        desc.skin = 0.0625;
        desc.skip_time_step_check = k == 1;
        scene_make(&s, SCENE_MIXED, 16, &desc);
        assert_ok(dem2d_world_step(s.world, 700, NULL));
        check_resume(s.world, false, 100);
        scene_bytes bytes = scene_save(s.world);
        dem2d_world *copy = load_with(&bytes, NULL, false);
        assert_ok(dem2d_world_set_time_step(copy, 0.5));
        assert_result(dem2d_world_step(copy, 1, NULL), k == 1 ? DEM2D_OK : DEM2D_TIME_STEP);
        dem2d_world_destroy(copy);
        dem2d_world_destroy(s.world);
        free(bytes.bytes);
    }
}

/* All particles of one material, which is not the first: steps go by its law alone. And counters
   that are 0 in other tests. */
static void test_one_material(void **state) {
    (void)state;
    snapshot_scene s;
    dem2d_world_desc desc = scene_desc(SCENE_RUBBING);
    scene_make(&s, SCENE_RUBBING, 40, &desc);
    for (uint32_t i = 0; i < 40; i++)
        if (i % 3 != 2) assert_ok(dem2d_world_remove_particle(s.world, (dem2d_particle_id){i, 1}));
    assert_ok(dem2d_world_step(s.world, 1500, NULL));
    while (inside_list_stale(s.world)) assert_ok(dem2d_world_step(s.world, 1, NULL));
    assert_int_equal(inside_one_law(s.world), 1);
    inside_count_failures(s.world, 3, 2);
    check_resume(s.world, false, 300);
    dem2d_world_destroy(s.world);
}

/* A servo wall that holds its stress has a drift; one of a given length. */
static void test_servo(void **state) {
    (void)state;
    snapshot_scene s;
    dem2d_world_desc desc = scene_desc(SCENE_MIXED);
    dem2d_wall_desc wall = {0};
    scene_make(&s, SCENE_MIXED, 16, &desc);
    wall.mode = DEM2D_WALL_SERVO;
    wall.material = s.stone;
    wall.point.y = 0.3, wall.normal.y = -1;
    wall.stress = 3000, wall.max_speed = 4, wall.length = 0.25;
    assert_ok(dem2d_world_set_wall(s.world, s.walls[3], &wall));
    assert_ok(dem2d_world_step(s.world, 2000, NULL));
    assert_true(inside_wall_drift(s.world, 3) != 0);
    check_resume(s.world, true, 200);
    dem2d_world_destroy(s.world);
}

/* A disc slides and rolls over joints, back and forth: stopped before and after any step, its
   spring goes on from one segment to the next. */
static void test_resume_joints(void **state) {
    (void)state;
    for (int full = 0; full < 2; full++) {
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(SCENE_DASHED);
        const dem2d_material_desc plain = material_desc(2700, 1e6, 1e6, 0.5);
        dem2d_particle_desc grain = {0};
        dem2d_particle_id id;
        dem2d_contact_info before = {0};
        int handed = 0, sheared = 0;
        scene_make(&s, SCENE_DASHED, 0, &desc);
        assert_ok(dem2d_world_add_material(s.world, &plain, &grain.material));
        if (full) grain.material = s.rubber;
        for (int i = 0; i < SCENE_WALLS; i++)
            assert_ok(dem2d_world_remove_wall(s.world, s.walls[i]));
        for (int i = 0; i < 4; i++) {
            dem2d_wall_desc wall = {0};
            dem2d_wall_id wall_id;
            wall.material = grain.material, wall.segment = true;
            wall.point = vec(0.5 + 0.05 * i, 1), wall.end = vec(0.55 + 0.05 * i, 1);
            assert_ok(dem2d_world_add_wall(s.world, &wall, &wall_id));
        }
        assert_ok(dem2d_world_set_gravity(s.world, vec(-30, -50)));
        grain.scale = 1, grain.shape = s.shapes[0], grain.position = vec(0.53, 1.0249);
        grain.velocity = vec(2, 0);
        assert_ok(dem2d_world_add_particle(s.world, &grain, &id));
        for (int i = 0; i < 900; i++) {
            dem2d_contact_info now = {0};
            int count;
            assert_ok(dem2d_world_step(s.world, 1, NULL));
            assert_ok(dem2d_world_contacts(s.world, &now, 1, &count));
            if (count == 1 && before.depth > 0 && now.wall.index != before.wall.index) {
                /* it goes on, but for the slip of one step */
                const double shear = now.tangential_force - before.tangential_force;
                assert_true(fabs(shear) < 0.05 * now.normal_force);
                assert_true(!full || fabs(now.moment - before.moment) < 0.1 * fabs(before.moment));
                sheared += fabs(before.tangential_force) > 0.2 * before.normal_force;
                handed++;
            }
            before = now;
            if (i % 7 == 0 || handed % 2 == 1) check_resume(s.world, i % 2, 1);
            const double place = (inside_position(s.world, 0).x - 0.5) / 0.05;
            if (fabs(place - round(place)) < 0.15) check_resume(s.world, i % 2, 2);
        }
        assert_true(handed >= 2 && sheared >= 1);
        dem2d_world_destroy(s.world);
    }
}

/* Two segments under a disc part, or meet, while the list lasts: every snapshot is read, and a new
   list in every step makes no difference. */
static void check_joint_moves(double start, double speed) {
    snapshot_scene s[2];
    int contacts = 0;
    for (int k = 0; k < 2; k++) {
        dem2d_world_desc desc = scene_desc(SCENE_RUBBING);
        dem2d_particle_desc grain = {.scale = 1};
        dem2d_particle_id id;
        scene_make(&s[k], SCENE_RUBBING, 0, &desc);
        for (int i = 0; i < 2; i++) {
            dem2d_wall_desc wall = {.material = s[k].stone, .segment = true};
            dem2d_wall_id wall_id;
            wall.point = vec(i == 0 ? 0.5 + start : 1, 1);
            wall.end = vec(i == 0 ? 1 + start : 1.5, i == 0 ? 1 : 1.0625);
            if (i == 0) wall.mode = DEM2D_WALL_MOVING, wall.velocity.x = speed;
            assert_ok(dem2d_world_add_wall(s[k].world, &wall, &wall_id));
        }
        grain.shape = s[k].shapes[0], grain.material = s[k].stone;
        grain.position = vec(1, 1.0249);
        assert_ok(dem2d_world_add_particle(s[k].world, &grain, &id));
    }
    for (int i = 0; i < 200; i++) {
        inside_renew_list(s[1].world);
        for (int k = 0; k < 2; k++) assert_ok(dem2d_world_step(s[k].world, 1, NULL));
        assert_int_equal(dem2d_world_hash(s[0].world), dem2d_world_hash(s[1].world));
        dem2d_stats stats;
        assert_ok(dem2d_world_stats(s[0].world, &stats));
        contacts += stats.wall_contacts;
        if (i < 20 || i % 10 == 0) check_resume(s[0].world, i % 2 == 1, 0);
    }
    assert_true(contacts > 100);
    for (int k = 0; k < 2; k++) dem2d_world_destroy(s[k].world);
}

static void test_joint_moves(void **state) {
    (void)state;
    check_joint_moves(0, -0.1);
    check_joint_moves(-1e-5, 0.005);
}

/* Ids hold in the loaded world, stale ones stay stale, and the next one is the same. */
static void test_ids(void **state) {
    (void)state;
    snapshot_scene s;
    dem2d_world_desc desc = scene_desc(SCENE_MIXED);
    scene_make(&s, SCENE_MIXED, 10, &desc);
    dem2d_particle_id removed[3] = {{2, 1}, {7, 1}, {5, 1}}, next[2];
    for (int i = 0; i < 3; i++) assert_ok(dem2d_world_remove_particle(s.world, removed[i]));
    assert_ok(dem2d_world_remove_shape(s.world, s.shapes[2]));
    scene_bytes bytes = scene_save(s.world);
    snapshot_scene copy = s;
    copy.world = load_with(&bytes, NULL, false);
    assert_null(dem2d_world_shape(copy.world, s.shapes[2]));
    assert_non_null(dem2d_world_shape(copy.world, s.shapes[3]));
    for (int i = 0; i < 3; i++) {
        dem2d_particle_info info;
        assert_result(dem2d_world_get_particle(copy.world, removed[i], &info), DEM2D_STALE_ID);
    }
    for (int i = 0; i < 4; i++) {
        next[0] = scene_add_grain(&s, 3, 0.1, 0.4 + i);
        next[1] = scene_add_grain(&copy, 3, 0.1, 0.4 + i);
        assert_int_equal(next[0].index, next[1].index);
        assert_int_equal(next[0].generation, next[1].generation);
        assert_int_equal(next[0].generation, i < 3 ? 2 : 1);
    }
    assert_same_world(s.world, copy.world);
    const dem2d_material_desc lead =
        material_desc(11000, 2e6, 3e5, 0.75); /* meets all that are there */
    dem2d_material_id more[2];
    assert_ok(dem2d_world_add_material(s.world, &lead, &more[0]));
    assert_ok(dem2d_world_add_material(copy.world, &lead, &more[1]));
    assert_int_equal(more[0].index, more[1].index);
    assert_same_world(s.world, copy.world);
    assert_result(dem2d_world_remove_wall(copy.world, s.walls[1]), DEM2D_IN_USE); /* in a span */
    assert_result(dem2d_world_remove_shape(copy.world, s.shapes[3]), DEM2D_IN_USE);
    free(bytes.bytes);
    dem2d_world_destroy(s.world);
    dem2d_world_destroy(copy.world);
}

/* --- the hash ------------------------------------------------------------------------------------
 */

/* Everything that is asked for or set must show. */
static void test_hash_changes(void **state) {
    (void)state;
    uint64_t seen[64];
    int count = 0;
    snapshot_scene s;
    dem2d_world_desc desc = scene_desc(SCENE_MIXED);
    scene_make(&s, SCENE_MIXED, 16, &desc);
    seen[count++] = dem2d_world_hash(s.world);
    assert_ok(dem2d_world_step(s.world, 300, NULL));
    seen[count++] = dem2d_world_hash(s.world);
    for (int which = 0; change_scene(&s, which); which++) {
        seen[count++] = dem2d_world_hash(s.world);
        assert_true(count < COUNT_OF(seen) - 1);
        assert_ok(dem2d_world_step(s.world, 1, NULL));
        seen[count++] = dem2d_world_hash(s.world);
    }
    for (int i = 0; i < count; i++)
        for (int k = 0; k < i; k++) assert_int_not_equal(seen[i], seen[k]);
    dem2d_world_destroy(s.world);
    assert_int_equal(dem2d_world_hash(NULL), 0);
}

/* What nobody can see does not: queries, a snapshot, the order in memory, room, threads. */
static void test_hash_stays(void **state) {
    (void)state;
    snapshot_scene s, t;
    dem2d_world_desc desc = scene_desc(SCENE_MIXED), roomy = desc;
    roomy.particle_capacity = 1000, roomy.pair_capacity = 1000;
    roomy.parallel_for = run_backwards;
    scene_make(&s, SCENE_MIXED, 16, &desc);
    scene_make(&t, SCENE_MIXED, 16, &roomy);
    for (int i = 0; i < 10; i++) {
        assert_ok(dem2d_world_step(s.world, 50, NULL));
        assert_ok(dem2d_world_step(t.world, 50, NULL));
        const uint64_t hash = dem2d_world_hash(s.world);
        assert_int_equal(dem2d_world_hash(t.world), hash);
        assert_true(inside_arrange(s.world));
        assert_int_equal(dem2d_world_hash(s.world), hash);
        scene_bytes bytes = scene_save(s.world);
        free(bytes.bytes);
        assert_int_equal(dem2d_world_hash(s.world), hash);
    }
    dem2d_world_destroy(s.world);
    dem2d_world_destroy(t.world);
}

/* Circles do not depend on the list at all. */
static void test_hash_skins(void **state) {
    (void)state;
    static const double skins[] = {0, 0.01, 0.1, 0.5};
    for (int kind = SCENE_CIRCLES; kind <= SCENE_RUBBING; kind++) {
        uint64_t hash = 0;
        for (int i = 0; i < COUNT_OF(skins); i++) {
            snapshot_scene s;
            dem2d_world_desc desc = scene_desc(kind);
            desc.skin = skins[i];
            scene_make(&s, kind, 40, &desc);
            assert_ok(dem2d_world_step(s.world, 1000, NULL));
            if (i == 0) hash = dem2d_world_hash(s.world);
            assert_int_equal(dem2d_world_hash(s.world), hash);
            dem2d_world_destroy(s.world);
        }
    }
}

/* The same scene by other ids is another. */
static void test_hash_ids(void **state) {
    (void)state;
    uint64_t hash[4];
    for (int k = 0; k < 4; k++) {
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(SCENE_CIRCLES);
        dem2d_wall_desc wall = {0};
        scene_make(&s, SCENE_CIRCLES, 0, &desc);
        if (k == 3) {
            dem2d_shape *shape;
            assert_ok(dem2d_shape_create_circle(NULL, 0.025, &shape));
            assert_ok(dem2d_world_remove_shape(s.world, s.shapes[0]));
            s.shape_count = 0;
            scene_add_shape(&s, shape);
            assert_int_equal(s.shapes[0].index, 0);
        }
        const uint64_t random = s.random;
        const dem2d_particle_id id = scene_add_grain(&s, 0, 0.03, 0.03);
        if (k == 1) {
            assert_ok(dem2d_world_remove_particle(s.world, id));
            s.random = random;
            assert_int_equal(scene_add_grain(&s, 0, 0.03, 0.03).index, id.index);
        }
        if (k == 2) {
            wall.material = s.rubber, wall.normal.y = 1;
            assert_ok(dem2d_world_remove_wall(s.world, s.walls[0]));
            assert_ok(dem2d_world_add_wall(s.world, &wall, &s.walls[0]));
            assert_int_equal(s.walls[0].index, 0);
        }
        hash[k] = dem2d_world_hash(s.world);
        dem2d_world_destroy(s.world);
    }
    for (int k = 1; k < 4; k++) assert_int_not_equal(hash[0], hash[k]);
}

/* Doubles count by their bits. */
static void test_hash_zeros(void **state) {
    (void)state;
    dem2d_world_desc desc = scene_desc(SCENE_CIRCLES);
    dem2d_world *world;
    assert_ok(dem2d_world_create(&desc, &world));
    assert_ok(dem2d_world_set_gravity(world, vec(0, 0)));
    const uint64_t hash = dem2d_world_hash(world);
    assert_ok(dem2d_world_set_gravity(world, vec(-0.0, 0)));
    assert_int_not_equal(dem2d_world_hash(world), hash);
    dem2d_world_destroy(world);
}

/* The same on every machine and by every compiler; `make golden` compares builds. A change of these
   numbers is a change of results, or of what is hashed. */
static void test_golden(void **state) {
    (void)state;
    bool same = true;
    for (int kind = 0; kind < SCENE_COUNT; kind++) {
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(kind);
        scene_make(&s, kind, GOLDEN_GRAINS, &desc);
        assert_ok(dem2d_world_step(s.world, GOLDEN_STEPS, NULL));
        const uint64_t hash = dem2d_world_hash(s.world);
        if (hash != golden_hashes[kind])
            print_error("%s: 0x%016llx\n", scene_names[kind], (unsigned long long)hash);
        same = same && hash == golden_hashes[kind];
        dem2d_world_destroy(s.world);
    }
    assert_true(same);
}

/* --- damage --------------------------------------------------------------------------------------
 */

/* A small world with contacts, by its bytes. */
static scene_bytes small_snapshot(int kind) {
    snapshot_scene s;
    dem2d_world_desc desc = scene_desc(kind);
    scene_make(&s, kind, 4, &desc);
    assert_ok(dem2d_world_step(s.world, 200, NULL));
    (void)scene_add_grain(&s, 1, 0.05, 0.05);
    assert_ok(dem2d_world_step(s.world, 20, NULL));
    assert_ok(dem2d_world_remove_particle(s.world, (dem2d_particle_id){1, 1}));
    scene_bytes bytes = scene_save(s.world);
    dem2d_world_destroy(s.world);
    return bytes;
}

static dem2d_world *const untouched = (dem2d_world *)(void *)&untouched;

/* The result of a load, which must leave nothing behind when it fails. */
static dem2d_result try_load(scene_bytes *bytes, test_env *env) {
    dem2d_custom_desc custom;
    dem2d_load_desc desc = scene_load_desc(bytes, &custom);
    dem2d_world *world = untouched;
    desc.env = &env->env;
    test_log_clear(env);
    const dem2d_result result = dem2d_world_load(&desc, NULL, &world);
    if (result == DEM2D_OK) {
        dem2d_world_destroy(world);
    } else {
        assert_ptr_equal(world, untouched);
        assert_int_equal(env->log.count, 1);
        assert_int_equal(env->log.result, result);
    }
    assert_clean(env);
    return result;
}

static void check_flipped(int kind) {
    scene_bytes bytes = small_snapshot(kind);
    test_env env;
    test_env_init(&env);
    assert_ok(try_load(&bytes, &env));
    for (size_t i = 0; i < bytes.size; i++)
        for (int bit = 0; bit < 8; bit++) {
            if (!test_long() && i >= 32 && bit != (int)(i / 8 % 8)) continue; /* of the head: all */
            bytes.bytes[i] = (char)(bytes.bytes[i] ^ 1 << bit);
            env.peak = 0;
            const dem2d_result result = try_load(&bytes, &env);
            const bool version = i >= 8 && i < 16, size = i >= 16 && i < 24;
            if (size) /* a longer one can't be read */
                assert_true(result == DEM2D_FORMAT || result == DEM2D_IO);
            else
                assert_result(result, version ? DEM2D_FORMAT_VERSION : DEM2D_FORMAT);
            assert_true(env.peak <= 2 * bytes.size + 8192); /* whatever size it says it has */
            bytes.bytes[i] = (char)(bytes.bytes[i] ^ 1 << bit);
        }
    assert_ok(try_load(&bytes, &env));
    free(bytes.bytes);
}

static void test_flipped(void **state) {
    (void)state;
    check_flipped(SCENE_RUBBING);
    check_flipped(SCENE_DASHED);
}

/* By a callback, which can't tell damage from a failure, and by a file. */
static void check_cut(int kind) {
    const char *path = "build/test_snapshot.cut";
    scene_bytes bytes = small_snapshot(kind);
    const size_t size = bytes.size;
    dem2d_load_desc desc = {0};
    test_env env;
    test_env_init(&env);
    desc.env = &env.env;
    for (bytes.size = 0; bytes.size < size; bytes.size++) {
        dem2d_world *world = untouched;
        assert_result(try_load(&bytes, &env), DEM2D_IO);
        if (bytes.size > 64 && bytes.size % 16 != 0) continue; /* files take time */
        FILE *file = fopen(path, "wb");
        assert_non_null(file);
        assert_int_equal(fwrite(bytes.bytes, 1, bytes.size, file), bytes.size);
        fclose(file);
        assert_result(dem2d_world_load(&desc, path, &world), DEM2D_FORMAT);
        assert_clean(&env);
    }
    remove(path);
    free(bytes.bytes);
}

static void test_cut(void **state) {
    (void)state;
    check_cut(SCENE_RUBBING);
    check_cut(SCENE_DASHED);
}

static void test_appended(void **state) {
    (void)state;
    static const size_t more[] = {1, 2, 8, 100, 5000};
    test_env env;
    test_env_init(&env);
    for (int i = 0; i < COUNT_OF(more); i++) {
        scene_bytes bytes = small_snapshot(SCENE_CIRCLES);
        bytes.bytes = realloc(bytes.bytes, bytes.size + more[i]);
        assert_non_null(bytes.bytes);
        memset(bytes.bytes + bytes.size, i, more[i]);
        bytes.size += more[i];
        assert_result(try_load(&bytes, &env), DEM2D_FORMAT);
        free(bytes.bytes);
    }
}

/* The checksum by its definition. */
static uint64_t checksum_of(const scene_bytes *bytes) {
    uint64_t hash = 0x243F6A8885A308D3u;
    for (size_t i = 0; i < bytes->size - 8; i += 8) {
        hash = (hash ^ get_word(bytes->bytes + i)) * 0x9E3779B97F4A7C15u;
        hash ^= hash >> 32;
    }
    return hash;
}

/* Size and checksum as they should be. */
static void make_right(scene_bytes *bytes) {
    put_word(bytes->bytes + 16, bytes->size);
    put_word(bytes->bytes + bytes->size - 8, checksum_of(bytes));
}

/* Where a record has the first number of a field; its rows are `width` words apart. */
static char *field_of(const scene_bytes *bytes, const record *r, const char *name) {
    char *at = bytes->bytes + r->rows_at;
    const char *field = bytes->bytes + r->at + RECORD_HEAD;
    for (; strncmp(field, name, 24) != 0; field += FIELD_HEAD)
        at += 8 * (get_word(field + 24) & 255);
    return at;
}

static void take_record_away(scene_bytes *bytes, const char *name) {
    size_t at = 24;
    while (at < bytes->size - 8 && strcmp(bytes->bytes + record_at(bytes, at).at, name) != 0)
        at = record_at(bytes, at).end;
    if (at >= bytes->size - 8) return; /* all of it is 0 */
    const record gone = record_at(bytes, at);
    memmove(bytes->bytes + gone.at, bytes->bytes + gone.end, bytes->size - gone.end);
    bytes->size -= gone.end - gone.at;
}

/* As version 0.6 wrote it: walls without parts, and contacts with the wall. */
static void take_parts_away(scene_bytes *bytes) {
    const record pairs = record_named(bytes, "pairs"), parts = record_named(bytes, "wall_parts");
    const record progress = record_named(bytes, "progress");
    const uint64_t first = get_word(field_of(bytes, &progress, "pairs"));
    char *part = field_of(bytes, &pairs, "b");
    for (uint64_t i = 0; i < pairs.rows; i++, part += 8 * pairs.width)
        if (i >= first)
            put_word(part,
                     get_word(field_of(bytes, &parts, "wall") + 8 * parts.width * get_word(part)));
    put_word(field_of(bytes, &progress, "wall_parts"), 0);
    take_record_away(bytes, "wall_parts");
    take_record_away(bytes, "joints");
    make_right(bytes);
}

/* Each wall of an older snapshot gets its one part; some walls have been removed. Of the chain one
   segment is left: contacts with vertices are of version 0.7. */
static void test_without_parts(void **state) {
    (void)state;
    for (int kind = 0; kind < SCENE_COUNT; kind++) {
        snapshot_scene s;
        dem2d_world_desc desc = scene_desc(kind);
        scene_make(&s, kind, 9, &desc);
        const dem2d_wall_id gone = kind < SCENE_DASHED ? s.walls[3] : s.chain[0];
        dem2d_wall_desc wall = {.material = s.stone, .point = {0, 9}, .normal = {0, -1}};
        dem2d_wall_id last;
        assert_ok(dem2d_world_add_wall(s.world, &wall, &last));
        assert_ok(dem2d_world_remove_wall(s.world, gone));
        if (kind >= SCENE_DASHED) assert_ok(dem2d_world_remove_wall(s.world, s.chain[1]));
        assert_ok(dem2d_world_step(s.world, 200, NULL));
        scene_bytes bytes = scene_save(s.world);
        take_parts_away(&bytes);
        dem2d_world *copy = load_with(&bytes, NULL, false);
        assert_int_equal(dem2d_world_hash(copy), dem2d_world_hash(s.world));
        assert_ok(dem2d_world_step(s.world, 50, NULL));
        assert_ok(dem2d_world_step(copy, 50, NULL));
        assert_same_world(copy, s.world);
        dem2d_world_destroy(copy);
        dem2d_world_destroy(s.world);
        free(bytes.bytes);
    }
}

/* The layout, word by word. */
static void test_layout(void **state) {
    (void)state;
    static const unsigned char mark[8] = {0x8D, 'd', 'e', 'm', '2', 'd', '\r', '\n'};
    scene_bytes bytes = small_snapshot(SCENE_MIXED);
    const size_t end = bytes.size - 8;
    const double step = 1e-4, falling = -9.81;
    uint64_t word;
    int records = 0;
    assert_memory_equal(bytes.bytes, mark, 8);
    assert_int_equal(get_word(bytes.bytes + 8), SNAPSHOT_VERSION);
    assert_int_equal(get_word(bytes.bytes + 16), bytes.size);
    assert_int_equal(get_word(bytes.bytes + end), checksum_of(&bytes));
    for (size_t at = 24; at < end; at = record_at(&bytes, at).end) records++;
    assert_true(records > 20);
    const record world = record_at(&bytes, 24);
    const char *third = bytes.bytes + world.at + RECORD_HEAD + 2 * FIELD_HEAD;
    assert_string_equal(bytes.bytes + world.at, "world");
    assert_int_equal(world.rows, 1);
    assert_string_equal(third, "gravity");
    assert_int_equal(get_word(third + 24), 256 + 2);
    memcpy(&word, &step, 8); /* doubles by their bits */
    assert_int_equal(get_word(bytes.bytes + world.rows_at), word);
    memcpy(&word, &falling, 8);
    assert_int_equal(get_word(bytes.bytes + world.rows_at + 24), word);
    free(bytes.bytes);
}

static void test_tables(void **state) {
    (void)state;
    assert_true(inside_tables_hold());
}

/* --- other versions -----------------------------------------------------------------------------
 */

static void cut_bytes(scene_bytes *bytes, size_t at, size_t count) {
    bytes->size -= count;
    memmove(bytes->bytes + at, bytes->bytes + at + count, bytes->size - at);
}

/* What a header without this column would have written. */
static void cut_column(scene_bytes *bytes, const char *name) {
    const record r = record_named(bytes, name);
    cut_bytes(bytes, r.at, r.end - r.at);
    make_right(bytes);
}

/* What a header would have written whose field has fewer numbers, or 0: is not there. */
static void cut_field(scene_bytes *bytes, const char *column, const char *field, uint64_t left) {
    const record r = record_named(bytes, column);
    size_t at = r.at + RECORD_HEAD, before = 0;
    while (strcmp(bytes->bytes + at, field) != 0) {
        before += 8 * (get_word(bytes->bytes + at + 24) & 255);
        at += FIELD_HEAD;
    }
    const uint64_t numbers = get_word(bytes->bytes + at + 24);
    const size_t cut = 8 * ((numbers & 255) - left);
    for (uint64_t i = r.rows; i > 0; i--)
        cut_bytes(bytes, r.rows_at + 8 * r.width * (i - 1) + before + 8 * left, cut);
    put_word(bytes->bytes + at + 24, (numbers & 256) + left);
    put_word(bytes->bytes + r.at + 32, r.fields - (left == 0));
    if (left == 0) cut_bytes(bytes, at, FIELD_HEAD);
    make_right(bytes);
}

/* Columns and fields that a snapshot does not have are 0, all else is as it was. */
static void test_earlier(void **state) {
    (void)state;
    scene_bytes bytes = small_snapshot(SCENE_FULL);
    dem2d_world *whole = load_with(&bytes, NULL, false);
    cut_column(&bytes, "inverse_skins_squared");
    cut_field(&bytes, "world", "global_damping", 0);
    cut_field(&bytes, "progress", "proofs", DEM2D_PROOF_COUNT - 1);
    dem2d_world *part = load_with(&bytes, NULL, false);
    assert_true(inside_give_back(whole, part));
    assert_same_world(whole, part);
    assert_ok(dem2d_world_step(part, 50, NULL));
    dem2d_world_destroy(whole), dem2d_world_destroy(part);
    free(bytes.bytes);
}

static void check_refused(scene_bytes *bytes, dem2d_result result, const char *text) {
    test_env env;
    test_env_init(&env);
    make_right(bytes);
    assert_result(try_load(bytes, &env), result);
    assert_logged(&env, result, -1, text);
    free(bytes->bytes);
}

/* What can't be 0 must be there. */
static void test_needed(void **state) {
    (void)state;
    static const char *const columns[] = {"ids",   "particles", "wall_ids",
                                          "pairs", "laws",      "corners"};
    for (int i = 0; i < COUNT_OF(columns); i++) {
        scene_bytes bytes = small_snapshot(SCENE_FULL);
        cut_column(&bytes, columns[i]);
        check_refused(&bytes, DEM2D_FORMAT, columns[i]);
    }
    scene_bytes bytes = small_snapshot(SCENE_FULL);
    cut_field(&bytes, "particles", "scale", 0);
    check_refused(&bytes, DEM2D_FORMAT, "scale");
}

/* What a later version has added is refused by its name, as is what makes no sense. */
static void test_later(void **state) {
    (void)state;
    scene_bytes bytes = small_snapshot(SCENE_FULL);
    memcpy(bytes.bytes + record_named(&bytes, "inverse_skins_squared").at, "charge", 7);
    check_refused(&bytes, DEM2D_FORMAT_VERSION, "charge");
    bytes = small_snapshot(SCENE_FULL);
    memcpy(bytes.bytes + record_named(&bytes, "states").at + RECORD_HEAD, "momentum", 9);
    check_refused(&bytes, DEM2D_FORMAT_VERSION, "momentum");
    bytes = small_snapshot(SCENE_FULL);
    memcpy(bytes.bytes + record_named(&bytes, "states").at, "last_states", 12);
    check_refused(&bytes, DEM2D_FORMAT, "last_states");
    bytes = small_snapshot(SCENE_FULL);
    put_word(bytes.bytes + record_named(&bytes, "states").at + RECORD_HEAD + 24,
             2); /* no doubles */
    check_refused(&bytes, DEM2D_FORMAT, "position");
    bytes = small_snapshot(SCENE_FULL);
    put_word(bytes.bytes + record_named(&bytes, "states").at + 24, (uint64_t)1 << 40);
    check_refused(&bytes, DEM2D_FORMAT, "rows");
    for (uint64_t version = 0; version < 6; version++) {
        if (version == SNAPSHOT_VERSION) continue;
        bytes = small_snapshot(SCENE_CIRCLES);
        put_word(bytes.bytes + 8, version);
        check_refused(&bytes, DEM2D_FORMAT_VERSION, "version");
    }
}

/* How many rows there are is told before they come: columns that come without rows first, and are
   then said to have some, would have no memory. */
static void test_order(void **state) {
    (void)state;
    scene_bytes bytes = small_snapshot(SCENE_FULL), moved = small_snapshot(SCENE_FULL);
    size_t to = 24;
    for (int last = 0; last < 2; last++)
        for (size_t at = 24; at < bytes.size - 8; at = record_at(&bytes, at).end) {
            const record r = record_at(&bytes, at);
            const bool setting = inside_is_setting(bytes.bytes + at);
            if (setting != (last == 1) || inside_is_of_shapes(bytes.bytes + at)) continue;
            const size_t count = (setting ? r.end : r.rows_at) - at;
            memcpy(moved.bytes + to, bytes.bytes + at, count);
            if (!setting) put_word(moved.bytes + to + 24, 0);
            to += count;
        }
    moved.size = to + 8;
    free(bytes.bytes);
    check_refused(&moved, DEM2D_FORMAT, "rows");
}

/* A disc on a box on a floor: only the box and the floor may have two contact points. */
static void test_two_points(void **state) {
    (void)state;
    const dem2d_material_desc stone = stone_desc(1e6, 0.5);
    dem2d_world_desc desc = {0};
    desc.time_step = 1e-5;
    const scene s = open_scene(&desc, &stone);
    add_plane(&s, 0, 0, 0, 1);
    add_shape(&s, make_box(0.1, 0.1), DEM2D_FREE, vec(0, 0.0499), 0, vec(0, 0), 0);
    add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0.1497), 0, vec(0, 0), 0);
    step(&s, 1);
    scene_bytes bytes = scene_save(s.world);
    const record r = record_named(&bytes, "two_points");
    const double whole = 1;
    char *weights = field_of(&bytes, &r, "weights");
    assert_true(r.rows >= 2);
    for (uint64_t k = 0; k < r.rows; k++) memcpy(weights + 8 * r.width * k, &whole, sizeof whole);
    close_scene(&s);
    check_refused(&bytes, DEM2D_FORMAT, "two contact points");
}

/* Any byte changed and the checksum made right: refused, or a world that can be stepped. */
static void test_crafted(void **state) {
    (void)state;
    static const unsigned char values[] = {0, 1, 0x7F, 0x80, 0xFF};
    static const int kinds[] = {SCENE_RUBBING, SCENE_MIXED, SCENE_GJK,
                                SCENE_DASHED,  SCENE_FULL,  SCENE_LAW};
    int refused = 0, taken = 0;
    for (int n = 0; n < COUNT_OF(kinds); n++) {
        const int kind = kinds[n], often = test_long() ? 3 : 7, rare = test_long() ? 7 : 37;
        const int stride = kind == SCENE_RUBBING ? often : rare; /* odd: all bytes of numbers */
        scene_bytes bytes = small_snapshot(kind);
        const size_t body = bytes.size - 8;
        for (size_t i = 24; i < body; i += (size_t)stride)
            for (int k = 0; k < COUNT_OF(values); k++) {
                const char was = bytes.bytes[i];
                dem2d_custom_desc custom;
                dem2d_load_desc desc = scene_load_desc(&bytes, &custom);
                dem2d_world *world = NULL;
                test_env env;
                test_env_init(&env);
                desc.env = &env.env;
                bytes.bytes[i] = (char)values[k];
                make_right(&bytes);
                const dem2d_result result = dem2d_world_load(&desc, NULL, &world);
                if (result == DEM2D_OK) {
                    (void)dem2d_world_hash(world);
                    (void)dem2d_world_step(world, 2, NULL);
                    (void)dem2d_world_hash(world);
                    taken++;
                } else {
                    assert_true(result == DEM2D_FORMAT || result == DEM2D_FORMAT_VERSION ||
                                result == DEM2D_NULL_ARGUMENT);
                    assert_null(world);
                    refused++;
                }
                dem2d_world_destroy(world);
                assert_clean(&env);
                bytes.bytes[i] = was;
            }
        free(bytes.bytes);
    }
    assert_true(refused > 100 && taken > 100);
}

/* --- failures ------------------------------------------------------------------------------------
 */

static void check_writes_fail(int kind) {
    snapshot_scene s;
    dem2d_world_desc desc = scene_desc(kind);
    test_env env;
    test_env_init(&env);
    desc.env = &env.env;
    scene_make(&s, kind, 40, &desc);
    assert_ok(dem2d_world_step(s.world, 50, NULL));
    scene_bytes whole = scene_save(s.world), part = {0};
    assert_true(whole.size > 2 * inside_chunk());
    const dem2d_save_desc save = {.write = scene_write, .user = &part};
    const size_t stride = test_long() ? 1 : 7;
    for (part.limit = 1 + (whole.size - 1) % stride; part.limit <= whole.size;
         part.limit += stride) {
        part.size = 0;
        test_log_clear(&env);
        assert_result(dem2d_world_save(s.world, &save, NULL), DEM2D_IO);
        assert_logged(&env, DEM2D_IO, -1, "callback");
        assert_memory_equal(part.bytes, whole.bytes, part.size);
    }
    part.limit = whole.size + 1, part.size = 0;
    assert_ok(dem2d_world_save(s.world, &save, NULL));
    assert_int_equal(part.size, whole.size);
    for (whole.limit = 1 + (whole.size - 1) % stride; whole.limit <= whole.size;
         whole.limit += stride) {
        test_env other;
        test_env_init(&other);
        assert_result(try_load(&whole, &other), DEM2D_IO);
    }
    free(whole.bytes), free(part.bytes);
    dem2d_world_destroy(s.world);
    assert_clean(&env);
}

static void test_writes_fail(void **state) {
    (void)state;
    check_writes_fail(SCENE_RUBBING);
    check_writes_fail(SCENE_DASHED);
}

static void test_memory_fails(void **state) {
    (void)state;
    for (int kind = SCENE_RUBBING; kind < SCENE_COUNT; kind++) {
        scene_bytes bytes = small_snapshot(kind);
        test_env env;
        int call = 0;
        dem2d_result result;
        test_env_init(&env);
        do {
            test_env_fail(&env, ++call);
            result = try_load(&bytes, &env);
            if (result != DEM2D_OK) assert_result(result, DEM2D_OUT_OF_MEMORY);
            assert_true(call < 1000);
        } while (result != DEM2D_OK);
        assert_true(call > 10);
        free(bytes.bytes);
    }
}

static bool exists(const char *path) {
    FILE *file = fopen(path, "rb");
    if (file) fclose(file);
    return file != NULL;
}

static void test_files(void **state) {
    (void)state;
    const char *path = "build/test_snapshot.world", *aside = "build/test_snapshot.world.part";
    const char *folder = "build/test_snapshot.folder";
    snapshot_scene s;
    dem2d_world_desc desc = scene_desc(SCENE_RUBBING);
    dem2d_save_desc save = {0};
    dem2d_load_desc load = {0};
    dem2d_world *world = untouched;
    test_env env;
    test_env_init(&env);
    desc.env = load.env = &env.env;
    remove(path), remove(aside), rmdir(folder);
    scene_make(&s, SCENE_RUBBING, 12, &desc);
    const size_t bytes = env.bytes;
    assert_result(dem2d_world_load(&load, path, &world), DEM2D_IO);
    test_env_fail(&env, 1);
    assert_result(dem2d_world_save(s.world, &save, path), DEM2D_OUT_OF_MEMORY);
    assert_false(exists(path) || exists(aside));
    test_env_fail(&env, 0);
    assert_ok(dem2d_world_save(s.world, &save, path));
    assert_false(exists(aside));
    assert_int_equal(env.bytes, bytes);
    assert_ok(dem2d_world_load(&load, path, &world));
    assert_same_world(s.world, world);
    dem2d_world_destroy(world);

    /* the old one stays when the new one can't be written */
    const uint64_t hash = dem2d_world_hash(s.world);
    assert_ok(dem2d_world_step(s.world, 10, NULL));
    if (exists("/dev/full") && symlink("/dev/full", aside) == 0) {
        assert_result(dem2d_world_save(s.world, &save, path), DEM2D_IO);
        assert_false(exists(aside));
    }
    assert_result(dem2d_world_save(s.world, &save, "no/such/folder/world"), DEM2D_IO);
    assert_ok(dem2d_world_load(&load, path, &world));
    assert_int_equal(dem2d_world_hash(world), hash);
    dem2d_world_destroy(world);
    assert_int_equal(mkdir(folder, 0777), 0);
    assert_result(dem2d_world_save(s.world, &save, folder), DEM2D_IO);
    assert_false(exists("build/test_snapshot.folder.part"));
    assert_int_equal(rmdir(folder), 0);

    /* replaced */
    assert_ok(dem2d_world_save(s.world, &save, path));
    assert_ok(dem2d_world_load(&load, path, &world));
    assert_same_world(s.world, world);
    dem2d_world_destroy(world);
    FILE *file = fopen(path, "ab");
    assert_non_null(file);
    fputc('\n', file);
    fclose(file);
    world = untouched;
    assert_result(dem2d_world_load(&load, path, &world), DEM2D_FORMAT);
    assert_ptr_equal(world, untouched);
    remove(path);
    dem2d_world_destroy(s.world);
    assert_clean(&env);
}

/* A custom shape's function is found by its tag. */
static void test_custom(void **state) {
    (void)state;
    scene_bytes bytes = small_snapshot(SCENE_MIXED);
    dem2d_custom_desc custom;
    dem2d_load_desc desc = scene_load_desc(&bytes, &custom);
    dem2d_world *world = untouched;
    test_env env;
    test_env_init(&env);
    desc.env = &env.env;
    desc.custom = NULL;
    assert_result(dem2d_world_load(&desc, NULL, &world), DEM2D_NULL_ARGUMENT);
    assert_logged(&env, DEM2D_NULL_ARGUMENT, -1, "custom");
    assert_non_null(strstr(env.log.text, "tag -7"));
    assert_clean(&env);
    free(bytes.bytes);
}

/* A caller's law is given once more, with its tag; to a world without one it does nothing. */
static void test_law(void **state) {
    (void)state;
    scene_bytes bytes = small_snapshot(SCENE_LAW), plain = small_snapshot(SCENE_RUBBING);
    static const int tags[] = {0, 11, 13, -12};
    dem2d_custom_desc custom;
    dem2d_load_desc desc = scene_load_desc(&bytes, &custom);
    dem2d_world *world = untouched, *other;
    test_env env;
    test_env_init(&env);
    desc.env = &env.env;
    desc.law = NULL;
    assert_result(dem2d_world_load(&desc, NULL, &world), DEM2D_NULL_ARGUMENT);
    assert_logged(&env, DEM2D_NULL_ARGUMENT, -1, "law");
    desc.law = scene_law;
    for (int i = 0; i < COUNT_OF(tags); i++) {
        bytes.next = 0, desc.law_tag = tags[i];
        test_log_clear(&env);
        assert_result(dem2d_world_load(&desc, NULL, &world), DEM2D_NULL_ARGUMENT);
        assert_logged(&env, DEM2D_NULL_ARGUMENT, -1, "law_tag");
        assert_non_null(strstr(env.log.text, "12"));
        assert_clean(&env);
    }
    assert_ptr_equal(world, untouched);
    desc = scene_load_desc(&plain, &custom);
    assert_ok(dem2d_world_load(&desc, NULL, &world));
    plain.next = 0, desc.law = NULL;
    assert_ok(dem2d_world_load(&desc, NULL, &other));
    assert_ok(dem2d_world_step(world, 50, NULL));
    assert_ok(dem2d_world_step(other, 50, NULL));
    assert_same_world(world, other);
    dem2d_world_destroy(world), dem2d_world_destroy(other);
    free(bytes.bytes), free(plain.bytes);
}

/* The energy that a law tells is the caller's business, as its state is. */
static void strange_law_row(void *user, const row_in *in, row_out *out) {
    scene_law_row(user, in, out);
    out->energy = NAN;
    out->state[0] = HUGE_VAL;
}

static void strange_law(void *user, dem2d_law_batch *batch) {
    for_rows(user, batch, strange_law_row);
}

static void test_strange_law(void **state) {
    (void)state;
    snapshot_scene s;
    dem2d_world_desc desc = scene_desc(SCENE_LAW);
    desc.law = strange_law;
    scene_make(&s, SCENE_LAW, 20, &desc);
    assert_ok(dem2d_world_step(s.world, 300, NULL));
    dem2d_stats stats;
    assert_ok(dem2d_world_stats(s.world, &stats));
    assert_true(stats.contacts + stats.wall_contacts > 0);
    scene_bytes bytes = scene_save(s.world);
    test_env env;
    test_env_init(&env);
    dem2d_world *copy = load_with(&bytes, &env.env, false);
    assert_int_equal(dem2d_world_hash(copy), dem2d_world_hash(s.world));
    dem2d_world_destroy(copy);
    assert_clean(&env);
    dem2d_world_destroy(s.world);
    free(bytes.bytes);
}

/* An arc that is flat at a point has an infinite radius of curvature there. */
static void test_flat_arc(void **state) {
    (void)state;
    const double k = 0.5522847498; /* arcs of a circle, but for the first */
    const dem2d_vec control[12] = {{1, 0},  {1, 0.5}, {1, 1},   {0, 1},  {-k, 1}, {-1, k},
                                   {-1, 0}, {-1, -k}, {-k, -1}, {0, -1}, {k, -1}, {1, -k}};
    dem2d_shape *shape;
    dem2d_shape_info info;
    dem2d_shape_id id;
    dem2d_world_desc desc = {0};
    dem2d_world *world;
    test_env env;
    test_env_init(&env);
    desc.time_step = 1e-4, desc.env = &env.env;
    assert_ok(dem2d_shape_create_bezier(&env.env, control, 4, &shape));
    assert_ok(dem2d_shape_get(shape, &info));
    assert_true(info.rho_max == HUGE_VAL);
    assert_ok(dem2d_world_create(&desc, &world));
    assert_ok(dem2d_world_add_shape(world, shape, &id));
    dem2d_shape_destroy(shape);
    check_resume(world, false, 1);
    dem2d_world_destroy(world);
    assert_clean(&env);
}

static void test_arguments(void **state) {
    (void)state;
    scene_bytes bytes = small_snapshot(SCENE_CIRCLES);
    dem2d_load_desc load = {0};
    dem2d_save_desc save = {0};
    dem2d_world *world = untouched;
    test_env env;
    test_env_init(&env);
    load.env = &env.env;
    assert_result(dem2d_world_load(NULL, "build/no such file", &world), DEM2D_IO);
    assert_result(dem2d_world_load(NULL, NULL, &world), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_load(&load, "x", NULL), DEM2D_NULL_ARGUMENT);
    assert_logged(&env, DEM2D_NULL_ARGUMENT, -1, "world");
    assert_result(dem2d_world_load(&load, NULL, &world), DEM2D_NULL_ARGUMENT);
    assert_logged(&env, DEM2D_NULL_ARGUMENT, -1, "read");
    load.read = scene_read, load.user = &bytes;
    assert_result(dem2d_world_load(&load, "x", &world), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "read");
    assert_ptr_equal(world, untouched);
    assert_ok(dem2d_world_load(&load, NULL, &world));
    assert_result(dem2d_world_save(NULL, &save, "x"), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_save(world, NULL, NULL), DEM2D_NULL_ARGUMENT);
    assert_ok(dem2d_world_save(world, NULL, "build/plain.snapshot"));
    assert_int_equal(remove("build/plain.snapshot"), 0);
    assert_result(dem2d_world_save(world, &save, NULL), DEM2D_NULL_ARGUMENT);
    assert_logged(&env, DEM2D_NULL_ARGUMENT, -1, "write");
    save.write = scene_write;
    assert_result(dem2d_world_save(world, &save, "x"), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "write");
    dem2d_world_destroy(world);
    assert_clean(&env);
    free(bytes.bytes);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_resume),
        cmocka_unit_test(test_resume_blocks),
        cmocka_unit_test(test_resume_empty),
        cmocka_unit_test(test_resume_changed),
        cmocka_unit_test(test_resume_refused),
        cmocka_unit_test(test_settings),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_servo),
        cmocka_unit_test(test_one_material),
        cmocka_unit_test(test_resume_joints),
        cmocka_unit_test(test_ids),
        cmocka_unit_test(test_hash_changes),
        cmocka_unit_test(test_hash_stays),
        cmocka_unit_test(test_hash_skins),
        cmocka_unit_test(test_hash_zeros),
        cmocka_unit_test(test_hash_ids),
        cmocka_unit_test(test_golden),
        cmocka_unit_test(test_flipped),
        cmocka_unit_test(test_two_points),
        cmocka_unit_test(test_cut),
        cmocka_unit_test(test_appended),
        cmocka_unit_test(test_layout),
        cmocka_unit_test(test_without_parts),
        cmocka_unit_test(test_tables),
        cmocka_unit_test(test_order),
        cmocka_unit_test(test_earlier),
        cmocka_unit_test(test_needed),
        cmocka_unit_test(test_later),
        cmocka_unit_test(test_crafted),
        cmocka_unit_test(test_writes_fail),
        cmocka_unit_test(test_memory_fails),
        cmocka_unit_test(test_files),
        cmocka_unit_test(test_custom),
        cmocka_unit_test(test_law),
        cmocka_unit_test(test_joint_moves),
        cmocka_unit_test(test_strange_law),
        cmocka_unit_test(test_arguments),
        cmocka_unit_test(test_flat_arc),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
