/* Calls that fail half way: every allocation of every function, of worlds that are made, filled,
   changed and stepped, and every write. The result says so, the log what for; nothing
   leaks, inputs, outputs and world are as before the call, and what follows is what would have
   followed without the failure, to the bit. */
#include "dem2d.h"
#include "testing.h"
#include "fingerprint.h"
#include "api_calls.h"

/* --- one call -------------------------------------------------------------------------------- */

static void check_oom_log(const test_env *env, const char *what) {
    const test_log *log = &env->log;
    if (log->count > 0 && log->result == DEM2D_OUT_OF_MEMORY && strlen(log->text) >= 5) return;
    print_error("%s: %d messages, last \"%s\"\n", what, log->count, log->text);
    fail();
}

/* One call of a function whose k-th allocation fails; false when it has fewer. */
static bool fail_call(const function *of, int k) {
    fixture f, twin;
    static args v, before, twin_v;
    fixture_make(&f, 30);
    args_make(&v, &f);
    of->prepare(&v, &f);
    memcpy(&before, &v, sizeof v);
    fingerprint was = fixture_print(&f);
    const int blocks = f.env.blocks;
    test_env_fail(&f.env, k);
    const dem2d_result failed = of->call(&v);
    const bool did_fail = f.env.calls >= k;
    test_env_fail(&f.env, 0);
    if (did_fail) {
        assert_result(failed, DEM2D_OUT_OF_MEMORY);
        check_oom_log(&f.env, of->name);
        assert_int_equal(f.env.blocks, blocks);
        if (memcmp(&v, &before, sizeof v) != 0)
            fail_msg("dem2d_%s has changed an argument or output", of->name);
        fingerprint now = fixture_print(&f);
        assert_true(fingerprint_same(&was, &now));
        fingerprint_free(&now);
        assert_ok(of->call(&v)); /* there is memory again */

        fixture_make(&twin, 30);
        args_make(&twin_v, &twin);
        of->prepare(&twin_v, &twin);
        assert_ok(of->call(&twin_v));
        if (of->release) of->release(&twin_v);
        assert_ok(dem2d_world_step(f.world, 20, NULL));
        assert_ok(dem2d_world_step(twin.world, 20, NULL));
        fingerprint one = fixture_print(&twin), other = fixture_print(&f);
        assert_true(fingerprint_same(&one, &other));
        fingerprint_free(&one), fingerprint_free(&other);
        fixture_end(&twin);
    } else {
        assert_ok(failed);
    }
    if (of->release) of->release(&v);
    fingerprint_free(&was);
    fixture_end(&f);
    return did_fail;
}

/* The fits of one model make hundreds of allocations, test_fits.c fails them: here the first ones.
 */
static void test_calls(void **state) {
    enum { MOST = 40 };
    int allocating = 0;
    (void)state;
    for (int i = 0; i < COUNT_OF(functions); i++) {
        int k = 1;
        if (functions[i].call == call_world_step) continue; /* of five steps some are done: below */
        while (k <= MOST && fail_call(&functions[i], k)) k++;
        allocating += k > 1;
    }
    assert_true(allocating >= 15); /* shapes, outlines and fits, worlds */
}

/* --- the life of a world --------------------------------------------------------------------- */

enum { PLANES = 4, WALLS = 7, SHAPES = 5, LIFE_MATERIALS = 9, GRAINS = 40 };

typedef struct life_desc {
    const char *name;
    dem2d_face_rule faces;
    int only;    /* of this shape, until the end: then a grain of another comes; -1: of all */
    bool smooth; /* no friction until the middle */
    bool blocks; /* with a parallel_for */
    int capacity;
    double skin;
    bool rush;     /* grains begin apart and run together: lists wear out and grow */
    bool segments; /* two that are joined, and one more late */
    bool cell;     /* periodic, and it shears: walls are a floor that goes round, and segments */
    bool ledger;
    int full;   /* EARLY: dashpots and rolling friction; LATE: from the middle on; BY_CALLER */
    int number; /* of this life */
} life_desc;

enum { EARLY = 1, LATE, BY_CALLER };

/* What happens to a world, one call after the other; one allocation in all of them fails. */
typedef struct life {
    const life_desc *desc;
    test_env env;
    dem2d_world *world;
    dem2d_shape *templates[SHAPES];
    dem2d_shape_id shapes[SHAPES];
    dem2d_material_id materials[LIFE_MATERIALS];
    dem2d_wall_id walls[WALLS];
    dem2d_particle_id grains[GRAINS];
    int wall_count;
} life;

/* Blocks from last to first, each by itself. */
static void backwards(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                      void *context) {
    (void)user;
    (void)phase;
    for (int i = count - 1; i >= 0; i--) task(context, i, i + 1);
}

static dem2d_result life_create(life *l, int i) {
    dem2d_world_desc d = good_world(&l->env.env);
    (void)i;
    d.faces = l->desc->faces, d.skin = l->desc->skin;
    d.particle_capacity = l->desc->capacity, d.pair_capacity = 2 * l->desc->capacity;
    d.parallel_for = l->desc->blocks ? backwards : NULL;
    d.ledger = l->desc->ledger, d.law_tag = LAW_TAG;
    if (l->desc->full == BY_CALLER) d.law = soft_law;
    if (l->desc->cell) d.cell.a = vec(0.8, 0), d.cell.b = vec(0.1, 0.8);
    return dem2d_world_create(&d, &l->world);
}

static dem2d_result life_material(life *l, int i) {
    dem2d_material_desc d = l->desc->full == EARLY ? full_material : good_material;
    if (l->desc->smooth) d.friction = 0;
    return dem2d_world_add_material(l->world, &d, &l->materials[i]);
}

static dem2d_result life_shape(life *l, int i) {
    return dem2d_world_add_shape(l->world, l->templates[i], &l->shapes[i]);
}

static dem2d_result life_wall(life *l, int i) {
    static const double at[WALLS][4] = {
        {0, 0, 0, 1},         {0, 0, 1, 0},         {0.8, 0, -1, 0},     {0, 0.8, 0, -1},
        {0.2, 0.2, 0.4, 0.3}, {0.4, 0.3, 0.6, 0.2}, {0.6, 0.2, 0.7, 0.3}};
    static const double in_cell[PLANES][4] = {
        {0, 0, 0.8, 0}, {0, 0.3, 0.1, 0.6}, {0.7, 0.5, 0.9, 0.6}, {0.4, 0.7, 0.5, 0.9}};
    const double *place = l->desc->cell && i < PLANES ? in_cell[i] : at[i];
    dem2d_wall_desc d = {0};
    if (i >= PLANES && !l->desc->segments) return DEM2D_OK;
    d.material = l->materials[i], d.point = vec(place[0], place[1]);
    d.normal = d.end = vec(place[2], place[3]), d.segment = i >= PLANES || l->desc->cell;
    const dem2d_result result = dem2d_world_add_wall(l->world, &d, &l->walls[i]);
    if (result == DEM2D_OK) l->wall_count = i + 1;
    return result;
}

static dem2d_result life_grain(life *l, int i) {
    dem2d_particle_desc d = {0};
    d.scale = 0.055 + 0.002 * (i % 5), d.angle = i;
    d.shape = l->shapes[l->desc->only >= 0 ? l->desc->only : i % SHAPES];
    d.material = l->materials[i % LIFE_MATERIALS];
    d.position = vec(0.06 + 0.1 * (i % 8), 0.06 + 0.1 * (i / 8));
    d.velocity = vec(3.0 * (i % 3) - 3, 2.0 * (i % 2));
    if (i >= 10) d.name = (uint64_t)(GRAINS - i);
    if (l->desc->rush) {
        d.scale /= 2;
        d.velocity = vec(50 * (0.4 - d.position.x), 50 * (0.3 - d.position.y));
    }
    return dem2d_world_add_particle(l->world, &d, &l->grains[i]);
}

static dem2d_result life_step(life *l, int i) {
    int done = 7;
    (void)i;
    const dem2d_result result = dem2d_world_step(l->world, 1, &done);
    assert_int_equal(done, result == DEM2D_OK);
    return result;
}

static dem2d_result life_remove(life *l, int i) {
    return dem2d_world_remove_particle(l->world, l->grains[i]);
}

static dem2d_result life_move(life *l, int i) {
    return dem2d_world_move_particle(l->world, l->grains[i], vec(0.3, 0.75), 1);
}

static dem2d_result life_load(life *l, int i) {
    return dem2d_world_set_load(l->world, l->grains[i], vec(i, -1), 0.01);
}

/* All forces; then velocities and loads of three grains. */
static dem2d_result life_arrays(life *l, int i) {
    static dem2d_vec forces[GRAINS], velocities[3] = {{1, 0}, {0, 1}, {0, 0}};
    dem2d_particle_arrays a;
    int count;
    memset(&a, 0, sizeof a);
    a.forces = forces;
    const dem2d_result result = dem2d_world_read_particles(l->world, &a, GRAINS, &count);
    if (result != DEM2D_OK) return result;
    a.forces = NULL, a.ids = &l->grains[i], a.velocities = a.loads = velocities;
    return dem2d_world_write_particles(l->world, &a, 3);
}

/* A grain of other groups, then a sensor, with a number of the caller's. */
static dem2d_result life_groups(life *l, int i) {
    const dem2d_groups groups = {2, 0, i == 22};
    const dem2d_result result = dem2d_world_set_groups(l->world, l->grains[i], groups);
    if (result != DEM2D_OK) return result;
    return dem2d_world_set_user_data(l->world, l->grains[i], (uint64_t)i);
}

/* A grain grows, and another gets the material of the first. */
static dem2d_result life_change(life *l, int i) {
    dem2d_particle_desc d;
    assert_ok(dem2d_world_get_particle_desc(l->world, l->grains[i], &d));
    const dem2d_result result =
        dem2d_world_set_shape(l->world, l->grains[i], d.shape, 1.001 * d.scale);
    if (result != DEM2D_OK) return result;
    return dem2d_world_set_material(l->world, l->grains[i + 1], l->materials[0]);
}

/* A search tree, then moves with it. */
static dem2d_result life_relax(life *l, int i) {
    dem2d_relaxation done;
    dem2d_hit hit;
    (void)i;
    const dem2d_result result =
        dem2d_world_cast_ray(l->world, vec(-1, 0.3), vec(1, 0), 3, NULL, &hit);
    if (result != DEM2D_OK) return result;
    return dem2d_world_relax(l->world, 0.01, 2, &done);
}

/* A chain with one side, which nothing has been near. */
static dem2d_result life_chain(life *l, int i) {
    static const dem2d_vec points[3] = {{0.1, 0.7}, {0.2, 0.65}, {0.3, 0.7}};
    dem2d_wall_desc d = {0};
    dem2d_wall_id id;
    (void)i;
    d.material = l->materials[0], d.points = points, d.count = 3, d.one_sided = true;
    return dem2d_world_add_wall(l->world, &d, &id);
}

/* A cell shears; a wall in it turns. */
static dem2d_result life_shear(life *l, int i) {
    dem2d_deformation_desc flow = {0};
    (void)i;
    if (!l->desc->cell) return DEM2D_OK;
    flow.xy = 1;
    const dem2d_result result = dem2d_world_deform(l->world, &flow);
    if (result != DEM2D_OK) return result;
    return dem2d_world_drive_wall(l->world, l->walls[3], vec(0.1, 0), 1);
}

static dem2d_result life_rub(life *l, int i) {
    dem2d_pair_desc d = pair_desc(1e6, 5e5, 0.4);
    if (l->desc->full == LATE) d.damping_ratio = 0.2, d.rolling_friction = 0.1;
    return dem2d_world_set_pair(l->world, l->materials[i], l->materials[i], &d);
}

/* A grain of another shape, in the place of a removed one. */
static dem2d_result life_guest(life *l, int i) {
    dem2d_particle_desc d = {0};
    d.scale = 0.05, d.shape = l->shapes[l->desc->only == 0 ? SHAPES - 1 : 0],
    d.material = l->materials[0];
    d.position = vec(0.4, 0.7);
    return dem2d_world_add_particle(l->world, &d, &l->grains[i]);
}

/* The world is saved, and goes on from there. */
static dem2d_result life_reload(life *l, int i) {
    store bytes = {NULL, 0, 0};
    const dem2d_save_desc save = {.write = store_write, .user = &bytes};
    dem2d_load_desc load = {0};
    dem2d_world *world = l->world;
    (void)i;
    load.read = store_read, load.user = &bytes, load.env = &l->env.env;
    load.parallel_for = l->desc->blocks ? backwards : NULL;
    load.law = soft_law, load.law_tag = LAW_TAG;
    assert_ok(dem2d_world_save(l->world, &save, NULL));
    const dem2d_result result = dem2d_world_load(&load, NULL, &world);
    assert_true((world == l->world) == (result != DEM2D_OK));
    free(bytes.bytes);
    if (result != DEM2D_OK) return result;
    dem2d_world_destroy(l->world);
    l->world = world;
    return DEM2D_OK;
}

typedef struct life_event {
    const char *name;
    dem2d_result (*call)(life *l, int i);
    int first, last; /* i from here to there */
} life_event;

static const life_event events[] = {
    {"create", life_create, 0, 0},
    {"add material", life_material, 0, LIFE_MATERIALS - 1},
    {"add shape", life_shape, 0, SHAPES - 1},
    {"add wall", life_wall, 0, WALLS - 2},
    {"first step, without a grain", life_step, 0, 0},
    {"add grain", life_grain, 0, 9},
    {"step", life_step, 0, 20},
    {"add grain", life_grain, 10, GRAINS - 1},
    {"step", life_step, 0, 30},
    {"remove grain", life_remove, 3, 6},
    {"set pair", life_rub, 0, LIFE_MATERIALS - 1},
    {"move grain", life_move, 12, 12},
    {"load", life_load, 12, 14},
    {"step", life_step, 0, 3},
    {"arrays", life_arrays, 20, 20},
    {"groups", life_groups, 22, 23},
    {"change", life_change, 24, 24},
    {"ray and relax", life_relax, 0, 0},
    {"add chain", life_chain, 0, 0},
    {"shear", life_shear, 0, 0},
    {"step", life_step, 0, 30},
    {"save and load", life_reload, 0, 0},
    {"add wall", life_wall, WALLS - 1, WALLS - 1},
    {"add another", life_guest, 3, 3},
    {"step", life_step, 0, 30},
};

static void life_start(life *l, const life_desc *desc) {
    static const double arcs[4] = {2, 0, 0.1, 0}, none[4] = {0, 0, 0, 0.05};
    memset(l, 0, sizeof *l);
    l->desc = desc;
    assert_ok(dem2d_shape_create_circle(NULL, 1, &l->templates[0]));
    assert_ok(dem2d_shape_create_ellipse(NULL, 1.1, 0.8, &l->templates[1]));
    assert_ok(dem2d_shape_create_fourier(NULL, arcs, none, 3, &l->templates[2]));
    assert_ok(dem2d_shape_create_polygon(NULL, five_corners, 5, 0.1, &l->templates[3]));
    assert_ok(dem2d_shape_create_polygon(NULL, five_corners, 5, 0, &l->templates[4]));
    test_env_init(&l->env);
}

static void life_end(life *l) {
    dem2d_world_destroy(l->world);
    for (int i = 0; i < SHAPES; i++) dem2d_shape_destroy(l->templates[i]);
    assert_clean(&l->env);
}

static fingerprint life_print(const life *l) {
    fingerprint none = {NULL, 0, 0};
    return l->world ? fingerprint_take(l->world, l->walls, l->wall_count) : none;
}

/* A call whose k-th allocation fails: nothing is changed, again when it fails once more, and then
   it goes well. */
static void life_call(life *l, const life_event *event, int i, int k) {
    const int blocks = l->env.blocks;
    fingerprint was = life_print(l);
    test_env_fail(&l->env, k);
    dem2d_result result = event->call(l, i);
    assert_result(result, DEM2D_OUT_OF_MEMORY);
    for (int more = 0; more < 2 && result != DEM2D_OK; more++) {
        assert_result(result, DEM2D_OUT_OF_MEMORY);
        check_oom_log(&l->env, event->name);
        if (!l->world) assert_int_equal(l->env.blocks, blocks);
        fingerprint now = life_print(l);
        if (!fingerprint_same(&was, &now)) fail_msg("%s %d has changed the world", event->name, i);
        fingerprint_free(&now);
        test_env_fail(&l->env, more == 0 ? 1 : 0); /* what it got so far, it may have kept */
        test_log_clear(&l->env);
        result = event->call(l, i);
    }
    test_env_fail(&l->env, 0);
    assert_ok(result);
    fingerprint_free(&was);
}

enum { CALLS = 300 };

/* All calls, the k-th allocation of the at-th of them fails, or none (at < 0). Their number, and
   how many allocations each makes. */
static int live(const life_desc *desc, int at, int k, int allocations[CALLS], fingerprint *last) {
    static life l;
    int calls = 0;
    life_start(&l, desc);
    for (int e = 0; e < COUNT_OF(events); e++)
        for (int i = events[e].first; i <= events[e].last; i++, calls++) {
            assert_true(calls < CALLS);
            l.env.calls = 0;
            if (calls == at)
                life_call(&l, &events[e], i, k);
            else
                assert_ok(events[e].call(&l, i));
            if (at < 0) allocations[calls] = l.env.calls;
        }
    *last = life_print(&l);
    dem2d_stats n;
    assert_ok(dem2d_world_stats(l.world, &n)); /* else little is tested: */
    assert_true(n.contacts > 15 && n.list_rebuilds >= (desc->skin > 0 ? 20 : 5));
    life_end(&l);
    return calls;
}

static const life_desc lives[] = {
    {.name = "all shapes", .only = -1},
    {.name = "circles, friction and a polygon late", .smooth = true},
    {.name = "one point, in blocks",
     .faces = DEM2D_ONE_POINT,
     .only = -1,
     .smooth = true,
     .blocks = true},
    {.name = "capacities given, a thin skin", .only = -1, .capacity = 16, .skin = 0.01},
    {.name = "the full law, segments, a ledger",
     .only = -1,
     .segments = true,
     .ledger = true,
     .full = EARLY},
    {.name = "circles, the full law late, in blocks",
     .blocks = true,
     .segments = true,
     .ledger = true,
     .full = LATE},
    {.name = "a caller's law", .only = -1, .segments = true, .ledger = true, .full = BY_CALLER},
    {.name = "running together", .only = -1, .rush = true},
    {.name = "a cell that shears, with walls",
     .only = -1,
     .segments = true,
     .cell = true,
     .ledger = true,
     .full = LATE},
};

static void test_life(void **state) {
    const life_desc *desc = *state;
    int allocations[CALLS], all = 0;
    fingerprint expected, got;
    const int calls = live(desc, -1, 0, allocations, &expected);
    for (int at = 0; at < calls; at++) {
        all += allocations[at];
        for (int k = 1; k <= allocations[at]; k++) {
            if (!test_long() && (at + k + desc->number) % 3 > 0) continue; /* another life does */
            (void)live(desc, at, k, NULL, &got);
            if (!fingerprint_same(&expected, &got)) fail_msg("allocation %d of call %d", k, at);
            fingerprint_free(&got);
        }
    }
    assert_true(all >= 40);
    fingerprint_free(&expected);
}

/* --- without a log, without any memory ------------------------------------------------------- */

static void *no_memory(void *user, size_t size) {
    (void)user;
    (void)size;
    return NULL;
}

static void no_release(void *user, void *memory, size_t size) {
    (void)user;
    (void)size;
    assert_null(memory);
}

static void test_no_memory(void **state) {
    (void)state;
    dem2d_env env = {NULL, no_memory, no_release, NULL};
    const dem2d_world_desc d = good_world(&env);
    const dem2d_image_desc image = good_image();
    dem2d_world *world = NULL;
    dem2d_shape *shape = NULL;
    dem2d_outline_set *set = NULL;
    dem2d_outline_info info;
    assert_result(dem2d_world_create(&d, &world), DEM2D_OUT_OF_MEMORY);
    assert_result(dem2d_shape_create_circle(&env, 1, &shape), DEM2D_OUT_OF_MEMORY);
    assert_result(dem2d_image_outlines(&env, &image, &set), DEM2D_OUT_OF_MEMORY);
    assert_result(dem2d_outline_measure(&env, five_corners, 5, &info), DEM2D_OUT_OF_MEMORY);
    assert_true(!world && !shape && !set);
}

/* --- writes that fail ------------------------------------------------------------------------ */

typedef struct sink {
    int calls, fail_at;
} sink;

static bool take(void *user, const char *bytes, size_t count) {
    sink *s = user;
    assert_true(bytes && count > 0);
    assert_true(s->calls < s->fail_at); /* none after the one that failed */
    return ++s->calls < s->fail_at;
}

/* What is written, to a callback or a file. */
enum { SVG_FILE, SNAPSHOT, VTP_GRAINS, VTP_CONTACTS, VTP_LINES, CSV_FILE, PVD_FILE, WRITERS };

static dem2d_result write_to(const fixture *f, int which, dem2d_write_fn *write, void *user,
                             const char *path) {
    static const char *const names[] = {"a", "b & c"};
    static const double values[] = {1, -0.1};
    dem2d_svg_desc svg = {0};
    dem2d_vtp_desc vtp = {0};
    const dem2d_save_desc save = {.write = write, .user = user};
    const dem2d_csv_desc csv = {
        .count = 2, .names = names, .values = values, .write = write, .user = user};
    const dem2d_pvd_desc pvd = {
        .count = 2, .times = values, .files = names, .write = write, .user = user};
    svg.write = write, svg.user = user, svg.force_chains = true, svg.outline_points = 5;
    vtp.write = write, vtp.user = user, vtp.outline_points = 5;
    vtp.part = which == VTP_GRAINS     ? DEM2D_VTP_PARTICLES
               : which == VTP_CONTACTS ? DEM2D_VTP_CONTACTS
                                       : DEM2D_VTP_WALLS;
    if (which == SVG_FILE) return dem2d_world_write_svg(f->world, &svg, path);
    if (which == SNAPSHOT) return dem2d_world_save(f->world, &save, path);
    if (which == CSV_FILE) return dem2d_world_write_csv(f->world, &csv, path);
    if (which == PVD_FILE) return dem2d_pvd_write(&f->env.env, &pvd, path);
    return dem2d_world_write_vtp(f->world, &vtp, path);
}

static void test_writes(void **state) {
    (void)state;
    fixture f;
    sink s = {0, INT_MAX};
    fixture_make(&f, 30);
    fingerprint was = fixture_print(&f);
    for (int which = 0; which < WRITERS; which++) {
        s.calls = 0, s.fail_at = INT_MAX;
        assert_ok(write_to(&f, which, take, &s, NULL));
        const int writes = s.calls;
        assert_true(writes > (which == SNAPSHOT ? 2 : which >= CSV_FILE ? 8 : 50));
        for (int k = 1; k <= writes; k++) {
            s.calls = 0, s.fail_at = k;
            test_log_clear(&f.env);
            assert_result(write_to(&f, which, take, &s, NULL), DEM2D_IO);
            assert_int_equal(s.calls, k);
            assert_logged(&f.env, DEM2D_IO, -1, "callback");
            assert_int_equal(f.env.log.count, 1);
        }
        FILE *full = fopen("/dev/full", "w"); /* takes all, and has no room when it is closed */
        if (full && which != SNAPSHOT) {      /* which goes to another file first */
            assert_result(write_to(&f, which, NULL, NULL, "/dev/full"), DEM2D_IO);
            assert_logged(&f.env, DEM2D_IO, -1, "/dev/full");
        }
        if (full) fclose(full);
        assert_result(write_to(&f, which, NULL, NULL, "no/such/folder/file"), DEM2D_IO);
        assert_non_null(strstr(f.env.log.text, "no/such/folder/file"));
    }
    fingerprint now = fixture_print(&f);
    assert_true(fingerprint_same(&was, &now));
    fingerprint_free(&was), fingerprint_free(&now);
    fixture_end(&f);
}

int main(void) {
    static life_desc places[COUNT_OF(lives)];
    struct CMUnitTest tests[COUNT_OF(lives) + 3] = {
        cmocka_unit_test(test_calls),
        cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_writes),
    };
    for (int i = 0; i < COUNT_OF(lives); i++) {
        places[i] = lives[i], places[i].number = i;
        tests[3 + i].name = lives[i].name;
        tests[3 + i].test_func = test_life;
        tests[3 + i].initial_state = &places[i];
    }
    return cmocka_run_group_tests_name("faults", tests, NULL, NULL);
}
