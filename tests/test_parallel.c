/* A step's work on other threads: whatever runs the callback's items, in whatever order and ranges,
   a world must come out the same to the last bit as on one thread; and so it must in whatever order
   its particles are in memory. */
#define _POSIX_C_SOURCE 200809L
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "row_law.h"

#include <pthread.h>

enum { GRAINS = 640, COLUMNS = 32, MOST_THREADS = 7 }; /* some blocks of a few hundred */
enum { WALLS = 4, LINKS = 12 };                        /* half-planes, segments of a chain */

#define RADIUS 0.025
#define PITCH (1.85 * RADIUS)

/* --- ways to run the items ------------------------------------------------------------------- */

typedef enum way { ALL_AT_ONCE, BACKWARDS, AT_RANDOM, ON_THREADS } way;

typedef struct runner {
    const char *name;
    way way;
    int threads;
} runner;

static const runner runners[] = {
    {"in one call", ALL_AT_ONCE, 1},
    {"one by one, the last first", BACKWARDS, 1},
    {"ranges in random order", AT_RANDOM, 1},
    {"2 threads", ON_THREADS, 2},
    {"3 threads", ON_THREADS, 3},
    {"7 threads", ON_THREADS, 7},
};

/* What a scene's calls of all runners were. */
typedef struct calls {
    int64_t count[DEM2D_PHASE_COUNT];
    int most[DEM2D_PHASE_COUNT]; /* items of one call */
} calls;

typedef struct crew {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    int threads; /* with the caller's */
    int started; /* numbers that are given */
    int round;   /* of work */
    int busy;    /* threads that have not finished it */
    bool stop;
    int count;
    dem2d_task_fn *task;
    void *context;
    pthread_t thread[MOST_THREADS];
} crew;

/* The user pointer of the callbacks of one world. */
typedef struct host {
    const runner *runner;
    calls *calls;
    crew crew;
    uint64_t random;
    pthread_t caller; /* of dem2d_world_step: the only thread that runs callbacks of the library */
    bool elsewhere;   /* one was run by another */
    bool inside;      /* a call of the callback is going on */
    test_env env;
} host;

static void host_here(host *h) {
    if (!pthread_equal(h->caller, pthread_self())) h->elsewhere = true;
}

static void *host_allocate(void *user, size_t size) {
    host_here(user);
    return test_allocate(&((host *)user)->env, size);
}

static void host_release(void *user, void *memory, size_t size) {
    host_here(user);
    test_release(&((host *)user)->env, memory, size);
}

static void host_log(void *user, dem2d_result result, int index, const char *text) {
    host_here(user);
    test_keep_log(&((host *)user)->env, result, index, text);
}

/* Cuts 0 .. count - 1 into ranges of random lengths and does them in random order. */
static void run_at_random(uint64_t *random, int count, dem2d_task_fn *task, void *context) {
    int *ends = malloc((size_t)count * 2 * sizeof *ends), *order = ends + count, ranges = 0;
    assert_non_null(ends);
    for (int end = 0; end < count; ranges++) {
        end += 1 + random_below(random, 1 + (count - end) / 2);
        ends[ranges] = end;
    }
    for (int i = 0; i < ranges; i++) { /* a shuffle that grows */
        const int k = random_below(random, i + 1);
        order[i] = order[k], order[k] = i;
    }
    for (int i = 0; i < ranges; i++)
        task(context, order[i] > 0 ? ends[order[i] - 1] : 0, ends[order[i]]);
    free(ends);
}

/* Threads that sleep between calls; each does every n'th item from its own number on, so all have
   work, whoever wakes first. */
static void do_share(crew *c, int number) {
    for (int i = number; i < c->count; i += c->threads) c->task(c->context, i, i + 1);
}

static void *crew_work(void *context) {
    crew *c = context;
    pthread_mutex_lock(&c->lock);
    const int number = c->started++;
    for (int round = 0; !c->stop;) {
        if (round == c->round) {
            pthread_cond_wait(&c->changed, &c->lock);
            continue;
        }
        round = c->round;
        pthread_mutex_unlock(&c->lock);
        do_share(c, number);
        pthread_mutex_lock(&c->lock);
        if (--c->busy == 0) pthread_cond_broadcast(&c->changed);
    }
    pthread_mutex_unlock(&c->lock);
    return NULL;
}

static void crew_start(crew *c, int threads) {
    memset(c, 0, sizeof *c);
    pthread_mutex_init(&c->lock, NULL);
    pthread_cond_init(&c->changed, NULL);
    c->threads = threads, c->started = 1; /* the caller is number 0 */
    for (int i = 1; i < threads; i++)
        assert_int_equal(pthread_create(&c->thread[i], NULL, crew_work, c), 0);
}

static void crew_run(crew *c, int count, dem2d_task_fn *task, void *context) {
    pthread_mutex_lock(&c->lock);
    c->count = count, c->task = task, c->context = context;
    c->busy = c->threads - 1, c->round++;
    pthread_cond_broadcast(&c->changed);
    pthread_mutex_unlock(&c->lock);
    do_share(c, 0);
    pthread_mutex_lock(&c->lock);
    while (c->busy > 0) pthread_cond_wait(&c->changed, &c->lock);
    pthread_mutex_unlock(&c->lock);
}

static void crew_end(crew *c) {
    pthread_mutex_lock(&c->lock);
    c->stop = true;
    pthread_cond_broadcast(&c->changed);
    pthread_mutex_unlock(&c->lock);
    for (int i = 1; i < c->threads; i++) pthread_join(c->thread[i], NULL);
    pthread_cond_destroy(&c->changed);
    pthread_mutex_destroy(&c->lock);
}

static void run_items(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                      void *context) {
    host *h = user;
    host_here(h);
    assert_in_range(phase, 0, DEM2D_PHASE_COUNT - 1);
    assert_true(count > 0);
    assert_false(h->inside);
    h->inside = true;
    h->calls->count[phase]++;
    if (count > h->calls->most[phase]) h->calls->most[phase] = count;
    if (h->runner->way == ALL_AT_ONCE) task(context, 0, count);
    if (h->runner->way == BACKWARDS)
        for (int i = count; i-- > 0;) task(context, i, i + 1);
    if (h->runner->way == AT_RANDOM) run_at_random(&h->random, count, task, context);
    if (h->runner->way == ON_THREADS) crew_run(&h->crew, count, task, context);
    h->inside = false;
}

/* --- scenes ---------------------------------------------------------------------------------- */

typedef struct scene_row {
    const char *name;
    bool discs; /* else five shapes */
    double friction;
    bool lid;    /* a servo wall on top */
    bool change; /* grains come and go between rounds of steps */
    bool drive;  /* some are fixed, some driven */
    dem2d_solver solver;
    dem2d_face_rule faces;
    bool full;  /* dashpots, rolling friction */
    bool law;   /* a caller's */
    bool chain; /* the floor is one of segments */
    bool book;  /* a ledger */
    int rounds; /* the state is compared after each */
    bool cell;  /* periodic, instead of walls and gravity */
    int steps;  /* of a round; 0 for 40 */
    calls calls;
} scene_row;

static scene_row scenes[] = {
    {.name = "discs with friction", .discs = true, .friction = 0.4, .rounds = 3},
    {.name = "discs without friction", .discs = true, .rounds = 3},
    {.name = "five shapes fall between walls", .friction = 0.4, .rounds = 3},
    {.name = "five shapes without friction", .rounds = 3},
    {.name = "five shapes below a servo wall", .friction = 0.4, .lid = true, .rounds = 3},
    {.name = "grains come and go", .friction = 0.4, .change = true, .rounds = 3},
    {.name = "fixed and driven grains", .friction = 0.4, .drive = true, .rounds = 3},
    {.name = "GJK and EPA", .friction = 0.4, .solver = DEM2D_GJK_EPA, .rounds = 2, .steps = 8},
    {.name = "one point", .friction = 0.4, .faces = DEM2D_ONE_POINT, .rounds = 2},
    {.name = "discs by the full law",
     .discs = true,
     .friction = 0.4,
     .full = true,
     .book = true,
     .rounds = 2},
    {.name = "five shapes on a chain",
     .friction = 0.4,
     .chain = true,
     .change = true,
     .book = true,
     .rounds = 2},
    {.name = "the full law on a chain, below a servo wall",
     .friction = 0.4,
     .full = true,
     .chain = true,
     .lid = true,
     .drive = true,
     .book = true,
     .rounds = 2},
    {.name = "a caller's law",
     .friction = 0.4,
     .law = true,
     .chain = true,
     .change = true,
     .book = true,
     .rounds = 2},
    {.name = "a cell that is sheared and takes another vector b",
     .friction = 0.4,
     .full = true,
     .cell = true,
     .book = true,
     .rounds = 2},
};

typedef struct run {
    dem2d_world *world;
    dem2d_shape_id shapes[5];
    dem2d_material_id material;
    dem2d_wall_id walls[WALLS + LINKS];
    int wall_count;
    uint64_t random;
    dem2d_env env;
    host host;
} run;

static dem2d_shape *make_shape(int kind) {
    static const double corners[5][2] = {
        {-0.9, -0.4}, {0.6, -0.7}, {0.9, 0.1}, {0.3, 0.8}, {-0.6, 0.6}};
    const double f = RADIUS, reach[4] = {f, 0.75 * f, 0.7 * f, 0.75 * f};
    const double a[4] = {1.8 * f, 0, 0.08 * f, 0.03 * f}, b[4] = {0, 0, 0.06 * f, 0.02 * f};
    dem2d_vec points[5];
    if (kind == 0) return make_disc(f);
    if (kind == 1) return make_ellipse(f, 0.7 * f);
    if (kind == 3) return make_oval(reach, 0.5522847498);
    if (kind == 4) return make_series(a, b, 3);
    for (int i = 0; i < 5; i++) points[i] = vec(f * corners[i][0], f * corners[i][1]);
    return make_polygon(points, 5, 0);
}

static dem2d_particle_id add_grain(run *r, const scene_row *s, int place) {
    dem2d_particle_desc desc = {0};
    dem2d_particle_id id;
    r->random = (uint64_t)place + 7; /* whenever it comes */
    desc.shape = r->shapes[s->discs ? 0 : place % 5], desc.material = r->material;
    desc.scale = random_between(&r->random, 0.9, 1) * (s->discs ? 1 : 1.2); /* most touch */
    desc.position.x = PITCH * (0.5 + place % COLUMNS);
    desc.position.y = PITCH * (0.5 + (double)(place / COLUMNS));
    desc.angle = random_between(&r->random, -3, 3);
    if (s->drive && place % 7 == 0) desc.motion = DEM2D_FIXED;
    if (s->drive && place % 7 == 3) desc.motion = DEM2D_DRIVEN;
    if (desc.motion != DEM2D_FIXED) {
        desc.velocity.x = random_between(&r->random, -1, 1);
        desc.velocity.y = random_between(&r->random, -1, 1);
        desc.angular_velocity = random_between(&r->random, -20, 20);
    }
    assert_ok(dem2d_world_add_particle(r->world, &desc, &id));
    return id;
}

/* Grains with the same ids in an order of memory of their own: those that were there before have
   left their ids in that order. */
static void add_in_order(run *r, const scene_row *s, uint64_t seed) {
    dem2d_particle_id ids[GRAINS];
    int order[GRAINS];
    uint64_t random = seed;
    for (int i = 0; i < GRAINS; i++) {
        const int k = seed > 0 ? random_below(&random, i + 1) : i;
        ids[i] = add_grain(r, s, i);
        order[i] = order[k], order[k] = i;
    }
    for (int i = GRAINS; i-- > 0;) assert_ok(dem2d_world_remove_particle(r->world, ids[order[i]]));
    for (int i = 0; i < GRAINS; i++)
        assert_int_equal(add_grain(r, s, order[i]).index, ids[order[i]].index);
    for (int i = 1; i < GRAINS; i++)
        assert_true(inside_slot(r->world, order[i - 1]) < inside_slot(r->world, order[i]));
}

/* Flat in its middle, by turns from the left and from the right; the ends are beyond the walls. */
static void add_chain(run *r) {
    const double piece = PITCH * COLUMNS / (LINKS - 2);
    for (int i = 0; i < LINKS; i++) {
        dem2d_wall_desc desc = {0};
        dem2d_vec at[2];
        for (int k = 0; k < 2; k++) {
            const int joint = i + k;
            const bool flat = joint >= 5 && joint <= 7;
            at[k] = vec(piece * (joint - 1), -0.2 * RADIUS * (flat ? 0.5 : joint % 2));
        }
        desc.material = r->material, desc.segment = true;
        desc.point = at[i % 3 == 0], desc.end = at[i % 3 != 0];
        if (i == 3) desc.mode = DEM2D_WALL_MOVING, desc.velocity = vec(0, -0.01);
        assert_ok(dem2d_world_add_wall(r->world, &desc, &r->walls[r->wall_count++]));
    }
}

/* A spring and a dashpot, friction, a moment against turning, a state that grows. */
static void own_law_row(void *user, const row_in *in, row_out *out) {
    const double spring = in->pair.normal_stiffness * in->depth, limit = 0.3 * spring;
    const double shear =
        in->tangential_force - in->pair.tangential_stiffness * in->sliding * in->time_step;
    (void)user;
    out->normal_force = spring + 30 * in->mass * in->approach;
    out->tangential_force = shear > limit ? limit : shear < -limit ? -limit : shear;
    out->moment = -1e-3 * in->radius * in->radius * in->spin * in->mass + 1e-6 * in->state[0];
    out->energy = spring * in->depth / 2;
    out->state[0] = in->state[0] + in->depth, out->state[1] = in->moment;
}

static void own_law(void *user, dem2d_law_batch *batch) {
    for_rows(user, batch, own_law_row);
}

static void add_walls(run *r, const scene_row *s) {
    const double width = PITCH * COLUMNS, height = PITCH * GRAINS / COLUMNS;
    const double at[WALLS][4] = {{0, 0, 0, 1}, {0, 0, 1, 0}, {width, 0, -1, 0}, {0, height, 0, -1}};
    r->wall_count = s->lid ? 4 : 3;
    for (int i = 0; i < r->wall_count; i++) {
        dem2d_wall_desc desc = {0};
        desc.material = r->material;
        desc.point = vec(at[i][0], at[i][1]), desc.normal = vec(at[i][2], at[i][3]);
        if (i == 0 && s->chain) desc.point.y = -5 * RADIUS;
        if (i == 3) {
            desc.mode = DEM2D_WALL_SERVO, desc.stress = 2e4, desc.max_speed = 0.5;
            desc.spans[0] = r->walls[1], desc.spans[1] = r->walls[2];
        }
        assert_ok(dem2d_world_add_wall(r->world, &desc, &r->walls[i]));
    }
    if (s->chain) add_chain(r);
}

/* By so much in a round that the cell leans by more than half of a. */
static void shear(dem2d_world *world) {
    dem2d_deformation_desc flow = {0};
    flow.xy = 10;
    flow.hold_yy = true, flow.stress_yy = 2e4;
    assert_ok(dem2d_world_deform(world, &flow));
}

/* Without a runner the library does its work itself. */
static void make_empty(run *r, const scene_row *s, const runner *runner, calls *calls) {
    dem2d_material_desc stone = material_desc(2700, 1e6, s->friction > 0 ? 1e6 : 0, s->friction);
    dem2d_world_desc desc = {0};
    memset(r, 0, sizeof *r);
    r->host.runner = runner, r->host.calls = calls, r->host.caller = pthread_self();
    if (runner && runner->way == ON_THREADS) crew_start(&r->host.crew, runner->threads);
    test_env_init(&r->host.env);
    r->env = (dem2d_env){&r->host, host_allocate, host_release, host_log};
    desc.time_step = 1e-4, desc.gravity.y = s->cell ? 0 : -9.81, desc.local_damping = 0.3;
    desc.solver = s->solver, desc.faces = s->faces, desc.env = &r->env;
    desc.parallel_for = runner ? run_items : NULL, desc.parallel_user = &r->host;
    desc.ledger = s->book, desc.law = s->law ? own_law : NULL;
    if (s->full) stone.damping_ratio = 0.15, stone.rolling_friction = 0.1;
    if (s->cell) {
        desc.cell.a.x = PITCH * COLUMNS;
        desc.cell.b = vec(0.49 * desc.cell.a.x, PITCH * GRAINS / COLUMNS);
    }
    assert_ok(dem2d_world_create(&desc, &r->world));
    if (s->cell) shear(r->world);
    assert_ok(dem2d_world_add_material(r->world, &stone, &r->material));
    for (int i = 0; i < COUNT_OF(r->shapes); i++) {
        dem2d_shape *shape = make_shape(i);
        assert_ok(dem2d_world_add_shape(r->world, shape, &r->shapes[i]));
        dem2d_shape_destroy(shape);
    }
    if (!s->cell) add_walls(r, s);
}

static void make_run(run *r, const scene_row *s, const runner *runner, calls *calls) {
    make_empty(r, s, runner, calls);
    for (int i = 0; i < GRAINS; i++) add_grain(r, s, i);
}

static void end_run(run *r) {
    if (r->host.crew.threads > 0) crew_end(&r->host.crew);
    dem2d_world_destroy(r->world);
    assert_clean(&r->host.env);
    assert_false(r->host.elsewhere);
}

/* Every seventh grain leaves, and new ones come above. */
static void change(run *r, const scene_row *s, int round) {
    dem2d_particle_id ids[2 * GRAINS];
    int count;
    assert_ok(dem2d_world_particles(r->world, ids, COUNT_OF(ids), &count));
    for (int i = round % 7; i < count; i += 7)
        assert_ok(dem2d_world_remove_particle(r->world, ids[i]));
    for (int i = 0; i < 2 * COLUMNS; i++) add_grain(r, s, GRAINS + 2 * COLUMNS * round + i);
}

static void take_round(run *r, const scene_row *s, int round) {
    if (s->change && round > 0) change(r, s, round);
    assert_ok(dem2d_world_step(r->world, s->steps ? s->steps : 40, NULL));
}

/* --- all that a world can be asked, as numbers -------------------------------------------------
 */

typedef struct numbers {
    double *at;
    int count, room;
} numbers;

static void put(numbers *n, const double *more, int count) {
    if (n->count + count > n->room) {
        n->room = 2 * (n->count + count);
        n->at = realloc(n->at, (size_t)n->room * sizeof *n->at);
        assert_non_null(n->at);
    }
    memcpy(n->at + n->count, more, (size_t)count * sizeof *more);
    n->count += count;
}

/* Integers below 2^53 are doubles, too. */
#define PUT(n, ...)                               \
    do {                                          \
        const double put_these[] = {__VA_ARGS__}; \
        put((n), put_these, COUNT_OF(put_these)); \
    } while (0)

static void put_particles(numbers *n, const dem2d_world *world) {
    dem2d_particle_id ids[2 * GRAINS];
    int count;
    assert_ok(dem2d_world_particles(world, ids, COUNT_OF(ids), &count));
    for (int i = 0; i < count; i++) {
        dem2d_particle_info p;
        assert_ok(dem2d_world_get_particle(world, ids[i], &p));
        PUT(n, ids[i].index, ids[i].generation, p.shape.index, p.motion, p.pose.position.x,
            p.pose.position.y, p.pose.rotation.c, p.pose.rotation.s, p.pose.scale, p.velocity.x,
            p.velocity.y, p.angular_velocity, p.force.x, p.force.y, p.torque, p.mass, p.inertia,
            p.radius);
    }
}

static void put_contacts(numbers *n, const dem2d_world *world) {
    static dem2d_contact_info list[8 * GRAINS];
    int count;
    assert_ok(dem2d_world_contacts(world, list, COUNT_OF(list), &count));
    assert_true(count <= COUNT_OF(list));
    for (int i = 0; i < count; i++) {
        const dem2d_contact_info *c = &list[i];
        PUT(n, c->a.index, c->b.index, c->b.generation, c->wall.index, c->wall.generation,
            c->normal.x, c->normal.y, c->point.x, c->point.y, c->branch.x, c->branch.y, c->points,
            c->depth, c->normal_force, c->tangential_force, c->moment);
    }
}

static void put_walls(numbers *n, const run *r) {
    for (int i = 0; i < r->wall_count; i++) {
        dem2d_wall_info w;
        assert_ok(dem2d_world_get_wall(r->world, r->walls[i], &w));
        PUT(n, w.point.x, w.point.y, w.velocity.x, w.velocity.y, w.force.x, w.force.y, w.length,
            w.stress, w.end.x, w.end.y);
    }
}

static void put_measures(numbers *n, const dem2d_world *world) {
    dem2d_energy e;
    dem2d_stress s;
    dem2d_packing p;
    dem2d_particle_id limit_at;
    double safe, limit;
    assert_ok(dem2d_world_energy(world, &e));
    assert_ok(dem2d_world_stress(world, 1, &s));
    assert_ok(dem2d_world_packing(world, &p));
    assert_ok(dem2d_world_time_step_bounds(world, &safe, &limit, &limit_at));
    PUT(n, e.translational, e.rotational, e.normal, e.tangential, e.rolling, e.potential, s.xx,
        s.xy, s.yx, s.yy, p.coordination, p.coordination_loaded, p.mean_overlap, p.max_overlap,
        p.solid_area, safe, limit, limit_at.index, limit_at.generation);
}

/* Of a world that keeps one. */
static void put_ledger(numbers *n, const dem2d_world *world) {
    dem2d_ledger l;
    if (dem2d_world_ledger(world, &l) != DEM2D_OK) return;
    PUT(n, l.kinetic, l.normal, l.tangential, l.gravity, l.walls, l.driven, l.friction, l.dashpot,
        l.damping, l.given, l.closure);
}

/* All counters; the bytes in use may differ by scratch memory of the blocks. */
static void put_stats(numbers *n, const dem2d_world *world) {
    dem2d_stats s;
    assert_ok(dem2d_world_stats(world, &s));
    for (int i = 0; i < DEM2D_PROOF_COUNT; i++) PUT(n, (double)s.proofs[i]);
    PUT(n, (double)s.steps, (double)s.list_rebuilds, (double)s.support_calls, (double)s.collisions,
        (double)s.separations, (double)s.not_converged, (double)s.slow_time_step,
        (double)s.fast_motion, s.particles, s.walls, s.pairs, s.contacts, s.wall_contacts);
}

static void put_state(numbers *n, const run *r) {
    put_particles(n, r->world);
    put_contacts(n, r->world);
    put_walls(n, r);
    put_measures(n, r->world);
    put_stats(n, r->world);
    put_ledger(n, r->world);
    const uint64_t hash = dem2d_world_hash(r->world);
    PUT(n, (double)(hash >> 32), (double)(hash & 0xffffffffu));
}

/* --- tests ----------------------------------------------------------------------------------- */

/* What the scene has is there: else little was tested. */
static void check_books(const dem2d_world *world, const scene_row *s) {
    dem2d_ledger l;
    dem2d_energy e;
    assert_ok(dem2d_world_ledger(world, &l));
    assert_ok(dem2d_world_energy(world, &e));
    assert_true(l.kinetic > 0 && l.normal > 0 && l.friction != 0 && l.closure != 0);
    assert_true((l.dashpot != 0) == s->full);
    assert_true((e.rolling > 0) == s->full);
    if (s->lid) assert_true(l.walls != 0);
    if (s->drive) assert_true(l.driven != 0);
    if (!s->cell) return;
    dem2d_cell_info info;
    assert_ok(dem2d_world_get_cell(world, &info));
    assert_true(l.cell != 0 && info.cell.b.x < 0); /* it has another vector b */
}

/* order: of the particles in memory, see add_in_order; -1 as they come. */
static numbers run_scene(scene_row *s, const runner *runner, int order) {
    static run r;
    numbers n = {NULL, 0, 0};
    if (order < 0)
        make_run(&r, s, runner, &s->calls);
    else
        make_empty(&r, s, runner, &s->calls), add_in_order(&r, s, (uint64_t)order);
    for (int i = 0; i < s->rounds; i++) {
        /* sorted by place, or left as they are */
        if (order >= 0) inside_scatter(r.world, order == 2);
        take_round(&r, s, i);
        put_state(&n, &r);
    }
    if (s->book) check_books(r.world, s);
    dem2d_stats stats;
    assert_ok(dem2d_world_stats(r.world, &stats));
    assert_true(stats.contacts > GRAINS / 4); /* else little was tested */
    end_run(&r);
    return n;
}

static void assert_same(const numbers *one, const numbers *other, const char *name) {
    int first = 0;
    if (one->count == other->count &&
        memcmp(one->at, other->at, (size_t)one->count * sizeof *one->at) == 0)
        return;
    while (first < one->count && first < other->count &&
           memcmp(&one->at[first], &other->at[first], sizeof *one->at) == 0)
        first++;
    print_error("%s: %d numbers instead of %d; number %d differs\n", name, other->count, one->count,
                first);
    fail();
}

static void test_scene(void **state) {
    scene_row *s = *state;
    numbers one = run_scene(s, NULL, -1);
    for (int i = 0; i < COUNT_OF(runners); i++) {
        numbers other = run_scene(s, &runners[i], -1);
        assert_same(&one, &other, runners[i].name);
        free(other.at);
    }
    free(one.at);
}

/* In memory as their ids, at random, and sorted by their place in space. */
static void test_storage(void **state) {
    static const char *const names[] = {"by ids", "at random", "at random, then by place"};
    (void)state;
    for (int i = 0; i < COUNT_OF(scenes); i++) {
        scene_row *s = &scenes[i];
        if (s->solver == DEM2D_GJK_EPA) continue; /* slow */
        numbers one = run_scene(s, NULL, 0);
        for (int order = 1; order < COUNT_OF(names); order++) {
            numbers other = run_scene(s, &runners[order], order);
            assert_same(&one, &other, names[order]);
            free(other.at);
        }
        free(one.at);
    }
}

/* A step that fails: two grains in different blocks fly off the numbers, or the time step is too
   long. The same error about the same grain, and the world as it was before. */
static numbers run_failure(scene_row *s, const runner *runner, bool flies) {
    static run r;
    dem2d_particle_id ids[GRAINS];
    numbers n = {NULL, 0, 0};
    int count, done = -1;
    make_run(&r, s, runner, &s->calls);
    take_round(&r, s, 0);
    assert_ok(dem2d_world_particles(r.world, ids, GRAINS, &count));
    for (int i = 1; i < GRAINS && flies; i += GRAINS - 2)
        assert_ok(dem2d_world_drive_particle(r.world, ids[i], DEM2D_FREE, vec(1e308, -1e308), 0));
    assert_ok(dem2d_world_set_time_step(r.world, 10));
    numbers before = {NULL, 0, 0};
    put_particles(&before, r.world);
    test_log_clear(&r.host.env);
    const dem2d_result result = dem2d_world_step(r.world, 3, &done);
    assert_int_not_equal(result, DEM2D_OK);
    assert_int_equal(done, 0);
    put_particles(&n, r.world);
    assert_same(&before, &n, "after a step that failed");
    free(before.at);
    PUT(&n, result, r.host.env.log.result, r.host.env.log.index, r.host.env.log.count);
    for (int i = 1; i < GRAINS && flies; i += GRAINS - 2)
        assert_ok(dem2d_world_drive_particle(r.world, ids[i], DEM2D_FREE, vec(0, 0), 0));
    assert_ok(dem2d_world_set_time_step(r.world, 1e-4));
    take_round(&r, s, 1);
    put_state(&n, &r);
    end_run(&r);
    return n;
}

static void test_failure(void **state) {
    (void)state;
    static scene_row s = {.name = "a step that fails", .friction = 0.4};
    for (int flies = 0; flies < 2; flies++) {
        numbers one = run_failure(&s, NULL, flies);
        for (int i = 0; i < COUNT_OF(runners); i++) {
            numbers other = run_failure(&s, &runners[i], flies);
            assert_same(&one, &other, runners[i].name);
            free(other.at);
        }
        free(one.at);
    }
}

/* The scenes above did hand out work in every phase, and it was cut into several items. */
static void test_calls(void **state) {
    static const char *const names[DEM2D_PHASE_COUNT] = {"list", "contacts", "motion"};
    bool ok = true;
    (void)state;
    for (int i = 0; i < COUNT_OF(scenes); i++) {
        for (int p = 0; p < DEM2D_PHASE_COUNT; p++) {
            const calls *c = &scenes[i].calls;
            if (c->count[p] > 0 && c->most[p] > 1) continue;
            print_error("%s, %s: %lld calls, at most %d items\n", scenes[i].name, names[p],
                        (long long)c->count[p], c->most[p]);
            ok = false;
        }
    }
    assert_true(ok);
}

int main(void) {
    struct CMUnitTest tests[COUNT_OF(scenes) + 3] = {{0}};
    int count = 0;
    for (int i = 0; i < COUNT_OF(scenes); i++) {
        tests[count].name = scenes[i].name;
        tests[count].test_func = test_scene;
        tests[count++].initial_state = &scenes[i];
    }
    tests[count].name = "any order in memory";
    tests[count++].test_func = test_storage;
    tests[count].name = "a step that fails";
    tests[count++].test_func = test_failure;
    tests[count].name = "all phases are handed out in pieces";
    tests[count++].test_func = test_calls;
    return cmocka_run_group_tests_name("parallel_for", tests, NULL, NULL);
}
