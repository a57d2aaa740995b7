/* bench_world [--quick] [--only PART,...] [--most N] [--no-lammps] [OUTDIR] - time of a world's
   steps.

   PARTS: the scenes discs, polygons (4 to 7 sides), ellipses (aspect 1 to 2.5), beziers (10 arcs),
   fourier (order 8) and mixed (all five), each settled under gravity and in the biaxial test; laws:
   settled discs beside LAMMPS with the same law (friction, dashpots, rolling friction); time
   against error by dt, order (of Fourier series) and skin; the time of a list of pairs by sizes
   (ratio of radii); and moving discs, where lists are much of the time: in a box, of equal and of
   many sizes, and falling on segments. --most leaves out larger scenes.

   Scenes. Circles of equal area have diameters uniform in 0.04 to 0.06 m; density 2700, kn = kt =
   1e7 N/m, friction 0.2, time step 1e-4 s, 32 templates a model, scaled.
   Settled: a box N / 500 m wide; grains are laid in rows, bounding circle by bounding circle, and
   fall under gravity 9.8, 7,000 steps with local damping 0.3 and 9,000 (--quick: 5,000) with 0.7.
   What is timed goes on with 0.3. Biaxial: a settled bed without weight between smooth walls,
   squeezed by servo walls to 100 kPa; timed while the top comes down at 0.1 m/s, local damping 0.7
   throughout, as in the papers.

   Up to 5,000 grains (--quick: 500) a bed is made so in full. Larger ones are mirrored copies of
   it, side by side, biaxial ones in columns and rows. They are added row by row across all copies:
   neighbours are not together in memory unless the library puts them there. All beds adapt, with
   damping 0.7, before the clock starts: 1,000 steps, 300 above 20,000 grains and with --quick, 100
   above 200,000. Friction starts from nothing then, as it does in LAMMPS. How far from rest a bed
   is at the end says its root mean square speed.

   Figures are medians over batches of steps; batches of one thread, two threads and LAMMPS take
   turns. Those of one thread and of LAMMPS are time on a core, so that what else the machine does
   hardly counts; two threads are compared with one by the clock, on an idle machine. Phases are
   clocked in a run of their own. After the same steps one and two threads must have the same bits.

   LAMMPS, if `lmp` is installed: the same settled beds in gran/hooke/history and, as polygons
   shrunk by a tenth and rounded by as much, in body/rounded/polygon; 2D, one process; the skin is
   the fastest of four. Dashpots stand there for local damping. Its figure is the "Loop time" times
   the "CPU use": without the list that each run starts with. The figures of dem2d have the lists
   that fall into their batches.

   Part laws: equal stiffness, friction, dashpots and rolling friction, no local damping; both go
   from the same positions and velocities, and are compared after 200 steps.

   Writes world.csv, laws.csv, dt.csv, order.csv, skin.csv, sizes.csv, moving.csv and, where gnuplot
   is installed, pictures of world, dt, order and skin to OUTDIR, build/bench_world by default. Exit
   status: 0, 1 if bits differed, 2 if something failed. Speed never fails. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#define BENCH_NAME "bench_world"
#include "bench_beds.h"

#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define STRESS 1e5    /* Pa, biaxial */
#define TOP_SPEED 0.1 /* m/s, biaxial */
#define BATCHES 7
#define SKINS 4 /* that LAMMPS may choose from */

enum { PART_LAWS = SCENES, PART_DT, PART_ORDER, PART_SKIN, PART_SIZES, PART_MOVING, PARTS };
enum { SETTLED, BIAXIAL, TESTS };
enum { LEFT, RIGHT, BOTTOM, TOP, WALLS };

static const char *const model_names[MODELS] = {"circle", "ellipse", "polygon", "bezier", "fs"};
static const char *const part_names[PARTS] = {"discs",   "polygons", "ellipses", "beziers",
                                              "fourier", "mixed",    "laws",     "dt",
                                              "order",   "skin",     "sizes",    "moving"};
static const char *const test_names[TESTS] = {"settled", "biaxial"};

/* On a core, of this thread. */
static double busy_seconds(void) {
    return read_clock(CLOCK_THREAD_CPUTIME_ID);
}

/* --- figures ---------------------------------------------------------------------------------- */

typedef struct figure {
    double median, low, high; /* median NaN: not measured */
} figure;

static const figure no_figure = {NAN, NAN, NAN};

static figure summary(const double *values, int count) {
    double sorted[BATCHES];
    memcpy(sorted, values, (size_t)count * sizeof *values);
    qsort(sorted, (size_t)count, sizeof *sorted, compare_doubles);
    const figure f = {sorted[count / 2], sorted[0], sorted[count - 1]};
    return f;
}

/* --- copies of beds --------------------------------------------------------------------------- */

/* Turned over at the middle of the bed, left and right or up and down. */
static grain mirror(const bed *b, grain g, bool sideways) {
    if (g.shape >= TEMPLATES) g.shape = (g.shape + KINDS) % (2 * KINDS); /* but circles */
    g.angle = sideways ? PI - g.angle : -g.angle;
    if (sideways)
        g.x = b->left + b->right - g.x;
    else
        g.y = b->bottom + b->top - g.y;
    return g;
}

/* Copies of a bed in columns and rows, each the mirror image of its neighbours: what leant on a
   wall leans on its image. In the order of their rows of grains. */
static bed copy_bed(const bed *b, int columns, int rows) {
    const double width = b->right - b->left, height = b->top - b->bottom;
    const int chunk = (int)(width / 0.05) + 1;
    bed all = make_bed(b->count * columns * rows);
    grain *next = all.grains;
    all.shapes = b->shapes, all.shape_count = b->shape_count;
    all.left = b->left, all.right = b->left + columns * width;
    all.bottom = b->bottom, all.top = b->top == 0 ? 0 : b->bottom + rows * height;
    for (int row = 0; row < rows; row++)
        for (int first = 0; first < b->count; first += chunk)
            for (int column = 0; column < columns; column++)
                for (int i = first; i < first + chunk && i < b->count; i++, next++) {
                    *next = b->grains[i];
                    if (column % 2) *next = mirror(b, *next, true);
                    if (row % 2) *next = mirror(b, *next, false);
                    next->x += column * width, next->y += row * height;
                }
    return all;
}

/* --- runs ------------------------------------------------------------------------------------- */

/* Contacts beside springs and friction: damping ratio of the normal and the tangential dashpot,
   rolling friction. */
typedef struct law {
    const char *name;
    double dashpot, rolling;
} law;

typedef struct setup {
    int test;
    const law *law; /* NULL: springs and friction alone */
    double damping, skin, time_step;
    dem2d_parallel_fn *parallel;
    void *user;
} setup;

typedef struct run {
    dem2d_world *world;
    dem2d_material_id grain_material, wall_material;
    dem2d_particle_id *ids;
    dem2d_wall_id walls[WALLS];
    const bed *bed;
} run;

static setup plain_setup(int test, double damping) {
    const setup s = {test, NULL, damping, 0, TIME_STEP, NULL, NULL};
    return s;
}

static void add_materials(run *r, const setup *s) {
    dem2d_material_desc stone = {0};
    dem2d_pair_desc smooth = {0};
    stone.density = DENSITY;
    stone.normal_stiffness = smooth.normal_stiffness = STIFFNESS;
    stone.tangential_stiffness = smooth.tangential_stiffness = STIFFNESS;
    stone.friction = FRICTION;
    if (s->law) {
        stone.damping_ratio = stone.tangential_damping_ratio = s->law->dashpot;
        stone.rolling_friction = s->law->rolling;
    }
    expect_ok(dem2d_world_add_material(r->world, &stone, &r->grain_material), "material");
    expect_ok(dem2d_world_add_material(r->world, &stone, &r->wall_material), "material");
    if (s->test != BIAXIAL) return;
    expect_ok(dem2d_world_set_pair(r->world, r->grain_material, r->wall_material, &smooth), "pair");
}

static void add_grains(run *r) {
    r->ids = get_memory((size_t)r->bed->count, sizeof *r->ids);
    add_bed(r->world, r->bed, r->grain_material, r->ids);
}

static dem2d_wall_desc wall_desc(const run *r, int which, double place) {
    static const double normals[WALLS][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    dem2d_wall_desc wall = {0};
    wall.material = r->wall_material;
    wall.normal.x = normals[which][0], wall.normal.y = normals[which][1];
    *(which <= RIGHT ? &wall.point.x : &wall.point.y) = place;
    return wall;
}

static double wall_place(const run *r, int which) {
    dem2d_wall_info info;
    expect_ok(dem2d_world_get_wall(r->world, r->walls[which], &info), "wall");
    return which <= RIGHT ? info.point.x : info.point.y;
}

static void add_walls(run *r, int test) {
    const double places[WALLS] = {r->bed->left, r->bed->right, r->bed->bottom, r->bed->top};
    for (int w = 0; w <= (test == BIAXIAL ? TOP : BOTTOM); w++) {
        const dem2d_wall_desc wall = wall_desc(r, w, places[w]);
        expect_ok(dem2d_world_add_wall(r->world, &wall, &r->walls[w]), "wall");
    }
}

/* Left, right and top hold the stress. */
static void control_walls(run *r) {
    for (int w = 0; w < WALLS; w++) {
        const bool side = w <= RIGHT;
        dem2d_wall_desc wall = wall_desc(r, w, wall_place(r, w));
        if (w == BOTTOM) continue;
        wall.mode = DEM2D_WALL_SERVO, wall.stress = STRESS;
        wall.max_speed = fmax(0.1, 0.05 * (r->bed->right - r->bed->left));
        wall.spans[0] = r->walls[side ? BOTTOM : LEFT];
        wall.spans[1] = r->walls[side ? TOP : RIGHT];
        expect_ok(dem2d_world_set_wall(r->world, r->walls[w], &wall), "wall");
    }
}

static dem2d_particle_info get_particle(const run *r, int i) {
    dem2d_particle_info info;
    memset(&info, 0, sizeof info);
    expect_ok(dem2d_world_get_particle(r->world, r->ids[i], &info), "particle");
    return info;
}

/* From now on the top comes down, and the grains below it in proportion: else only its neighbours
   would move at first in a large bed. */
static void compress(run *r) {
    dem2d_wall_desc wall = wall_desc(r, TOP, wall_place(r, TOP));
    const double height = wall.point.y - r->bed->bottom;
    wall.mode = DEM2D_WALL_MOVING;
    wall.velocity.y = -TOP_SPEED;
    expect_ok(dem2d_world_set_wall(r->world, r->walls[TOP], &wall), "wall");
    for (int i = 0; i < r->bed->count; i++) {
        const dem2d_particle_info now = get_particle(r, i);
        dem2d_vec v = now.velocity;
        v.y -= TOP_SPEED * (now.pose.position.y - r->bed->bottom) / height;
        expect_ok(
            dem2d_world_drive_particle(r->world, r->ids[i], DEM2D_FREE, v, now.angular_velocity),
            "velocity");
    }
}

static run open_run(const bed *b, const setup *s) {
    dem2d_world_desc desc = {0};
    run r = {0};
    desc.time_step = s->time_step, desc.local_damping = s->damping, desc.skin = s->skin;
    desc.gravity.y = s->test == BIAXIAL ? 0 : -GRAVITY;
    desc.parallel_for = s->parallel, desc.parallel_user = s->user;
    desc.particle_capacity = b->count;
    r.bed = b;
    expect_ok(dem2d_world_create(&desc, &r.world), "world");
    add_materials(&r, s);
    add_grains(&r);
    add_walls(&r, s->test);
    if (s->test == BIAXIAL) control_walls(&r);
    return r;
}

static void close_run(run *r) {
    dem2d_world_destroy(r->world);
    free(r->ids);
}

/* Returns seconds, of this thread on a core. */
static double take_steps(run *r, int count) {
    const double start = busy_seconds();
    expect_ok(dem2d_world_step(r->world, count, NULL), "step");
    return busy_seconds() - start;
}

static void damp(run *r, double local) {
    expect_ok(dem2d_world_set_damping(r->world, local, 0), "damping");
}

/* Where the grains are now; walls too. */
static bed save_bed(const run *r, int test) {
    bed b = make_bed(r->bed->count);
    for (int i = 0; i < b.count; i++) {
        const dem2d_particle_info now = get_particle(r, i);
        grain *g = &b.grains[i];
        *g = r->bed->grains[i];
        g->x = now.pose.position.x, g->y = now.pose.position.y;
        g->angle = dem2d_rot_angle(now.pose.rotation);
    }
    b.shapes = r->bed->shapes, b.shape_count = r->bed->shape_count;
    b.left = wall_place(r, LEFT), b.right = wall_place(r, RIGHT), b.bottom = wall_place(r, BOTTOM);
    if (test == BIAXIAL) b.top = wall_place(r, TOP);
    return b;
}

/* Lists of pairs made so far. */
static double rebuilds(const run *r) {
    dem2d_stats stats;
    expect_ok(dem2d_world_stats(r->world, &stats), "stats");
    return (double)stats.list_rebuilds;
}

/* Root of the mean square speed, mm/s. */
static double rms_speed(const run *r) {
    double sum = 0;
    for (int i = 0; i < r->bed->count; i++) {
        const dem2d_vec v = get_particle(r, i).velocity;
        sum += v.x * v.x + v.y * v.y;
    }
    return 1000 * sqrt(sum / r->bed->count);
}

static bool same_bits(const run *a, const run *b) {
    for (int i = 0; i < a->bed->count; i++) {
        const dem2d_particle_info p = get_particle(a, i), q = get_particle(b, i);
        if (memcmp(&p.pose, &q.pose, sizeof p.pose) != 0 ||
            memcmp(&p.velocity, &q.velocity, sizeof p.velocity) != 0 ||
            memcmp(&p.angular_velocity, &q.angular_velocity, sizeof p.angular_velocity) != 0)
            return false;
    }
    return true;
}

/* --- making beds ------------------------------------------------------------------------------ */

typedef struct options {
    bool quick, lammps, parts[PARTS];
    int most;
    const char *folder;
} options;

static options opt = {false, true, {false}, 1000000, NULL};

/* A bed of this size is settled; larger ones are copies of it. */
static int tile_size(void) {
    return opt.quick ? 500 : 5000;
}

static bed settle(bed b) {
    const int fall = 7000, rest = opt.quick ? 5000 : 9000;
    const setup s = plain_setup(SETTLED, 0.3);
    run r = open_run(&b, &s);
    take_steps(&r, fall);
    damp(&r, 0.7);
    take_steps(&r, rest);
    const bed settled = save_bed(&r, SETTLED);
    close_run(&r);
    free(b.grains);
    return settled;
}

static bed settle_scene(int scene, int count) {
    return settle(draw_bed(scene, count, (uint64_t)(7919 * count + scene), count / 500.0));
}

/* The settled bed between servo walls, without its weight. */
static bed consolidate(const bed *settled) {
    const setup s = plain_setup(BIAXIAL, 0.7);
    bed b = *settled;
    for (int i = 0; i < b.count; i++)
        b.top = fmax(b.top, b.grains[i].y + bounding_radius(&b, &b.grains[i]));
    run r = open_run(&b, &s);
    take_steps(&r, b.count > 500 ? 6000 : 4000);
    const bed packed = save_bed(&r, BIAXIAL);
    close_run(&r);
    return packed;
}

/* Beds made before, those of 500 and of the tile's size. */
static const bed *cached_bed(int scene, int test, int count) {
    static bed cache[SCENES][TESTS][2];
    bed *b = &cache[scene][test][count != 500];
    if (b->count != 0) return b;
    if (test == SETTLED)
        *b = settle_scene(scene, count);
    else
        *b = consolidate(cached_bed(scene, SETTLED, count));
    return b;
}

/* Columns and rows of copies: a row for a settled bed, else about a square. */
static bed get_bed(int scene, int test, int count) {
    const int copies = count <= tile_size() ? 1 : count / tile_size();
    const bed *b = cached_bed(scene, test, count / copies);
    double best = HUGE_VAL;
    int rows = 1;
    for (int n = 1; test == BIAXIAL && n <= copies; n++) {
        const double aspect = (b->top - b->bottom) * n * n / ((b->right - b->left) * copies);
        if (copies % n == 0 && fabs(log(aspect)) < best) best = fabs(log(aspect)), rows = n;
    }
    return copy_bed(b, copies / rows, rows);
}

/* --- two threads ------------------------------------------------------------------------------ */

/* A job goes from OPEN to JOINED, by the helper, or to IDLE, by the caller: a helper that wakes too
   late finds nothing to do, and the caller need not wait for it. */
enum { IDLE, OPEN, JOINED, HELPED };

/* What the threads write has a line of the cache to itself each. */
typedef struct pool {
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t wake;
    dem2d_task_fn *task;
    void *context;
    int count, chunk;
    char apart[64];
    int next[2][16];         /* in [0]: the first item nobody has taken, of both halves */
    int job, asleep, closed; /* atomic */
} pool;

static void relax_core(void) {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#endif
}

/* Each thread takes chunks of its own half, which its cache knows from the last step, then helps
   with the other's. */
static void work(pool *p, int own) {
    for (int k = 0; k < 2; k++) {
        const int half = k == 0 ? own : 1 - own, middle = p->count / 2;
        const int end = half == 0 ? middle : p->count;
        for (;;) {
            const int begin = __atomic_fetch_add(&p->next[half][0], p->chunk, __ATOMIC_RELAXED);
            if (begin >= end) break;
            p->task(p->context, begin, end - begin < p->chunk ? end : begin + p->chunk);
        }
    }
}

static bool change_job(pool *p, int from, int to) {
    return __atomic_compare_exchange_n(&p->job, &from, to, false, __ATOMIC_SEQ_CST,
                                       __ATOMIC_SEQ_CST);
}

static void sleep_until_open(pool *p) {
    pthread_mutex_lock(&p->mutex);
    __atomic_store_n(&p->asleep, 1, __ATOMIC_SEQ_CST);
    while (__atomic_load_n(&p->job, __ATOMIC_SEQ_CST) != OPEN &&
           !__atomic_load_n(&p->closed, __ATOMIC_SEQ_CST))
        pthread_cond_wait(&p->wake, &p->mutex);
    __atomic_store_n(&p->asleep, 0, __ATOMIC_SEQ_CST);
    pthread_mutex_unlock(&p->mutex);
}

static void *help(void *user) {
    enum { SPINS = 20000 }; /* some hundred microseconds */
    pool *p = user;
    for (int spins = 0; !__atomic_load_n(&p->closed, __ATOMIC_RELAXED); spins++) {
        if (__atomic_load_n(&p->job, __ATOMIC_RELAXED) == OPEN && change_job(p, OPEN, JOINED)) {
            work(p, 1);
            __atomic_store_n(&p->job, HELPED, __ATOMIC_RELEASE);
            spins = 0;
        } else if (spins == SPINS) {
            sleep_until_open(p);
            spins = 0;
        } else {
            relax_core();
        }
    }
    return NULL;
}

static void wait_for_helper(pool *p) {
    for (int spins = 0; __atomic_load_n(&p->job, __ATOMIC_ACQUIRE) != HELPED; spins++) {
        relax_core();
        if (spins > 10000) sched_yield(); /* someone else has its core */
    }
    __atomic_store_n(&p->job, IDLE, __ATOMIC_RELAXED);
}

static void run_on_two(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                       void *context) {
    pool *p = user;
    (void)phase;
    if (count < 2) {
        if (count == 1) task(context, 0, 1);
        return;
    }
    p->task = task, p->context = context, p->count = count;
    p->next[0][0] = 0, p->next[1][0] = count / 2;
    p->chunk = 1 + count / 8; /* several for each: the blocks are not all alike */
    __atomic_store_n(&p->job, OPEN, __ATOMIC_SEQ_CST);
    if (__atomic_load_n(&p->asleep, __ATOMIC_SEQ_CST)) {
        pthread_mutex_lock(&p->mutex);
        pthread_cond_signal(&p->wake);
        pthread_mutex_unlock(&p->mutex);
    }
    work(p, 0);
    if (!change_job(p, OPEN, IDLE)) wait_for_helper(p);
}

static void open_pool(pool *p) {
    memset(p, 0, sizeof *p);
    pthread_mutex_init(&p->mutex, NULL);
    pthread_cond_init(&p->wake, NULL);
    if (pthread_create(&p->thread, NULL, help, p) != 0) bench_fail("no second thread");
}

static void close_pool(pool *p) {
    pthread_mutex_lock(&p->mutex);
    __atomic_store_n(&p->closed, 1, __ATOMIC_SEQ_CST);
    pthread_cond_signal(&p->wake);
    pthread_mutex_unlock(&p->mutex);
    pthread_join(p->thread, NULL);
    pthread_cond_destroy(&p->wake);
    pthread_mutex_destroy(&p->mutex);
}

/* --- phases ----------------------------------------------------------------------------------- */

typedef struct phase_clock {
    clockid_t clock;
    double seconds[DEM2D_PHASE_COUNT];
} phase_clock;

static void run_clocked(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                        void *context) {
    phase_clock *c = user;
    const double start = read_clock(c->clock);
    if (count > 0) task(context, 0, count);
    c->seconds[phase] += read_clock(c->clock) - start;
}

/* --- LAMMPS ----------------------------------------------------------------------------------- */

/* A process that takes its commands from a pipe; after each run it writes an empty file. */
typedef struct peer {
    bool on;
    pid_t process;
    FILE *commands;
    int runs;
} peer;

static const double lammps_skins[SKINS] = {0.001, 0.002, 0.004, 0.008}; /* m */

static bool have_lammps(void) {
    return opt.lammps && system("command -v lmp > /dev/null 2>&1") == 0;
}

static void write_head(FILE *file, const bed *b, bool bodies) {
    double top = 0;
    for (int i = 0; i < b->count; i++) top = fmax(top, b->grains[i].y);
    fprintf(file, "a settled bed\n\n%d atoms\n", b->count);
    if (bodies) fprintf(file, "%d bodies\n", b->count);
    fprintf(file, "1 atom types\n\n%.17g %.17g xlo xhi\n%.17g %.17g ylo yhi\n-0.1 0.1 zlo zhi\n\n",
            b->left, b->right, b->bottom, top + 0.5);
    fprintf(file, "Atoms\n\n");
}

static void write_discs(FILE *file, const bed *b) {
    write_head(file, b, false);
    for (int i = 0; i < b->count; i++) {
        const grain *g = &b->grains[i];
        fprintf(file, "%d 1 %.17g %d %.17g %.17g 0\n", i + 1, 2 * bounding_radius(b, g), DENSITY,
                g->x, g->y);
    }
}

/* The first step here goes from rest at a full step of speed, in LAMMPS at half of one more than at
   the start: it begins with the other half. */
static void write_velocities(FILE *file, const run *r) {
    fprintf(file, "\nVelocities\n\n");
    for (int i = 0; i < r->bed->count; i++) {
        const dem2d_particle_info now = get_particle(r, i);
        fprintf(file, "%d %.17g %.17g 0 0 0 %.17g\n", i + 1, now.velocity.x / 2, now.velocity.y / 2,
                now.angular_velocity / 2);
    }
}

/* Corners about the centroid, a tenth nearer to it; rounding gives back at most that. */
static void write_body(FILE *file, const bed *b, int i) {
    const grain *g = &b->grains[i];
    const dem2d_shape *shape = b->shapes[g->shape];
    dem2d_vec points[MOST_CORNERS];
    dem2d_shape_info info;
    expect_ok(dem2d_shape_get(shape, &info), "template");
    expect_ok(
        dem2d_shape_outline(shape, dem2d_pose_make(0, 0, g->angle, g->scale), info.count, points),
        "corners");
    const double inertia = DENSITY * info.mass.polar_moment * pow(g->scale, 4);
    fprintf(file, "%d 1 %d\n%d\n", i + 1, 7 + 3 * info.count, info.count);
    fprintf(file, "%.17g %.17g %.17g 0 0 0\n", inertia / 2, inertia / 2, inertia);
    for (int k = 0; k < info.count; k++)
        fprintf(file, "%.17g %.17g 0\n", 0.9 * points[k].x, 0.9 * points[k].y);
    fprintf(file, "%.17g\n", 0.2 * info.inscribed * g->scale);
}

static void write_polygons(FILE *file, const bed *b) {
    write_head(file, b, true);
    for (int i = 0; i < b->count; i++) {
        const grain *g = &b->grains[i];
        dem2d_shape_info info;
        expect_ok(dem2d_shape_get(b->shapes[g->shape], &info), "template");
        fprintf(file, "%d 1 1 %.17g %.17g %.17g 0\n", i + 1,
                DENSITY * info.mass.area * g->scale * g->scale, g->x, g->y);
    }
    fprintf(file, "\nBodies\n\n");
    for (int i = 0; i < b->count; i++) write_body(file, b, i);
}

/* Commands for a law. LAMMPS divides its dashpots by the reduced mass; those here are equal where
   the discs of a pair have the mean area. A tangential dashpot here is of a mass that is a third of
   the reduced one, because a disc has half of m r^2. NULL: dashpots in place of local damping, two
   thirds of what would be critical. */
static void lammps_law(const law *l, char *pair, char *wall, size_t room) {
    const double mass = DENSITY * PI * 0.025 * 0.025, root = sqrt(STIFFNESS / mass);
    const double zeta = l ? l->dashpot : 0;
    const double of_pair = l ? 2 * zeta * root * sqrt(2) : 2500,
                 of_wall = l ? 2 * zeta * root : 2500;
    const double across = l ? 1 / sqrt(3) : 0.5;
    static const char plain[] = "%s%.9g %.9g %.9g %.9g %g 1%s";
    static const char rolls[] = "%shooke %.9g %.9g tangential linear_history %.9g %.9g %g rolling "
                                "sds %.9g 0 %g damping mass_velocity";
    if (l && l->rolling > 0) {
        snprintf(pair, room, rolls, "pair_style granular\npair_coeff * * ", STIFFNESS, of_pair,
                 STIFFNESS, across, FRICTION, STIFFNESS, l->rolling);
        snprintf(wall, room, rolls, "wall/gran granular ", STIFFNESS, of_wall, STIFFNESS, across,
                 FRICTION, STIFFNESS, l->rolling);
    } else {
        snprintf(pair, room, plain, "pair_style gran/hooke/history ", STIFFNESS, STIFFNESS, of_pair,
                 across * of_pair, FRICTION, "\npair_coeff * *");
        snprintf(wall, room, plain, "wall/gran hooke/history ", STIFFNESS, STIFFNESS, of_wall,
                 across * of_wall, FRICTION, "");
    }
}

static void send_discs(FILE *to, const bed *b, const law *l) {
    char pair[256], wall[256];
    lammps_law(l, pair, wall, sizeof pair);
    fprintf(to, "units si\ndimension 2\nboundary f f p\nnewton off\natom_style sphere\n");
    fprintf(to, "comm_modify vel yes\nread_data lammps.data\n");
    fprintf(to, "set group all density/disc %d\n", DENSITY);
    fprintf(to, "%s\nfix move all nve/sphere disc\n", pair);
    fprintf(to, "fix sides all %s xplane %.17g %.17g\n", wall, b->left, b->right);
    fprintf(to, "fix floor all %s yplane %.17g NULL\n", wall, b->bottom);
}

static void send_polygons(FILE *to, const bed *b) {
    static const char wall[] = "wall/body/polygon 1e7 7000 3500";
    fprintf(to, "units si\ndimension 2\nboundary f f p\natom_style body rounded/polygon 4 %d\n",
            MOST_CORNERS);
    fprintf(to, "atom_modify map array\ncomm_modify vel yes\nread_data lammps.data\n");
    fprintf(to, "pair_style body/rounded/polygon 7000 3500 0.2 0.5 0.0\npair_coeff * * 1e7 0.0\n");
    fprintf(to, "fix move all nve/body\n");
    fprintf(to, "fix sides all %s xplane %.17g %.17g\n", wall, b->left, b->right);
    fprintf(to, "fix floor all %s yplane %.17g 1000\n", wall, b->bottom);
}

static bool lammps_done(const peer *l) {
    char name[64];
    snprintf(name, sizeof name, "lammps.done.%d", l->runs);
    if (access(name, F_OK) != 0) return false;
    remove(name);
    return true;
}

static void stop_lammps(peer *l) {
    if (!l->on) return;
    fclose(l->commands);
    waitpid(l->process, NULL, 0);
    l->on = false;
}

/* false when it has ended before its time. */
static bool run_lammps(peer *l, double skin, int steps) {
    const struct timespec pause = {0, 1000000};
    fprintf(l->commands, "neighbor %g bin\nrun %d\nprint done file lammps.done.%d\n", skin, steps,
            ++l->runs);
    fflush(l->commands);
    while (!lammps_done(l)) {
        if (waitpid(l->process, NULL, WNOHANG) != 0) {
            printf("LAMMPS ended: see lammps.log\n");
            fclose(l->commands);
            return l->on = false;
        }
        nanosleep(&pause, NULL);
    }
    return true;
}

static void be_lammps(int input) {
    const int nowhere = open("/dev/null", O_WRONLY);
    dup2(input, 0);
    dup2(nowhere, 1);
    dup2(nowhere, 2);
    setenv("OMP_NUM_THREADS", "1", 1);
    execlp("lmp", "lmp", "-nocite", "-log", "lammps.log", (char *)NULL);
    _exit(127);
}

/* moving: the bed after its first step, whose velocities LAMMPS begins with; or NULL, at rest. */
static peer start_lammps(const bed *b, int scene, const law *law, const run *moving) {
    peer l = {true, 0, NULL, 0};
    int ends[2];
    FILE *data = create("lammps.data");
    (scene == DISCS ? write_discs : write_polygons)(data, b);
    if (moving) write_velocities(data, moving);
    fclose(data);
    if (pipe(ends) != 0) bench_fail("no pipe");
    fcntl(ends[1], F_SETFD, FD_CLOEXEC);
    l.process = fork();
    if (l.process < 0) bench_fail("no process");
    if (l.process == 0) be_lammps(ends[0]);
    close(ends[0]);
    l.commands = fdopen(ends[1], "w");
    if (!l.commands) bench_fail("no pipe");
    if (scene == DISCS)
        send_discs(l.commands, b, law);
    else
        send_polygons(l.commands, b);
    fprintf(l.commands,
            "neigh_modify delay 0 every 1 check yes\ntimestep %g\n"
            "fix weight all gravity %g vector 0 -1 0\nfix flat all enforce2d\n"
            "thermo_style custom step ke\nthermo_modify lost warn norm no\n"
            "thermo 1000000\n",
            TIME_STEP, GRAVITY);
    return l;
}

/* Loop times of the runs after the first, which let the bed adapt, less what others had of the
   core: "Loop time of 0.5 on 1 procs" is followed by "99.8% CPU use with". */
static int read_loop_times(double *times, int room) {
    char line[512];
    double time = 0, percent;
    int count = -1;
    FILE *log = fopen("lammps.log", "r");
    while (log && fgets(line, sizeof line, log)) {
        sscanf(line, "Loop time of %lf", &time);
        if (sscanf(line, "%lf%% CPU use", &percent) != 1 || !strstr(line, "CPU use")) continue;
        if (count >= 0 && count < room) times[count] = time * percent / 100;
        count++;
    }
    if (log) fclose(log);
    return count;
}

/* --- one scene -------------------------------------------------------------------------------- */

typedef struct timing {
    int scene, test, count, steps; /* steps: of a batch */
    figure one, lammps;            /* ns per particle-step, time on a core */
    figure wall, two;              /* the same by the clock: one thread, two */
    double lammps_skin;            /* m */
    double mean, lists;            /* as one, but the mean; lists made per 1000 steps */
    double share[DEM2D_PHASE_COUNT], rest;
    double contacts, rate, bytes, speed; /* contacts, bytes: per particle; rate: 1/s */
    bool same;
} timing;

static timing rows[SCENES * TESTS * 8];
static int row_count;

/* What a row needs while it is measured. */
typedef struct bench {
    timing *row;
    run one, two;
    pool pool;
    bed adapted; /* after the steps before the clock */
    peer lammps;
    double ns[3][BATCHES];
} bench;

/* Fewer for large beds: they are copies that fit but for their seams. */
static int adapting_steps(int count) {
    if (opt.quick) return 300;
    return count > 200000 ? 100 : count > 20000 ? 300 : 1000;
}

static int batch_steps(double step_seconds) {
    const double wanted = (opt.quick ? 0.02 : 0.12) / step_seconds;
    return wanted < 8 ? 8 : wanted > 5000 ? 5000 : (int)wanted;
}

static void begin_timed(run *r, int test) {
    if (test == BIAXIAL)
        compress(r);
    else
        damp(r, 0.3);
}

static void open_bench(bench *b, const bed *start) {
    timing *row = b->row;
    const int steps = adapting_steps(row->count);
    setup s = plain_setup(row->test, 0.7);
    open_pool(&b->pool);
    b->one = open_run(start, &s);
    s.parallel = run_on_two, s.user = &b->pool;
    b->two = open_run(start, &s);
    row->steps = batch_steps(take_steps(&b->one, steps) / steps);
    take_steps(&b->two, steps);
    b->adapted = save_bed(&b->one, row->test);
    begin_timed(&b->one, row->test);
    begin_timed(&b->two, row->test);
    b->lammps.on = false;
    if ((row->scene != DISCS && row->scene != POLYGONS) || row->test != SETTLED || !have_lammps())
        return;
    if (row->scene == DISCS ? row->count > 100000 : row->count > 5000) return;
    b->lammps = start_lammps(&b->adapted, row->scene, NULL, NULL);
    run_lammps(&b->lammps, lammps_skins[1], opt.quick ? 200 : row->count > 20000 ? 500 : 1000);
}

/* All skins together take some times as long as a batch of dem2d. */
static int lammps_steps(const timing *row) {
    const int steps = row->scene == POLYGONS ? row->steps / 8 : row->steps / 2;
    const int least = opt.quick ? 4 : 10;
    return steps < least ? least : steps;
}

static void read_lammps(timing *row) {
    double times[BATCHES * SKINS], ns[BATCHES];
    if (read_loop_times(times, COUNT_OF(times)) != COUNT_OF(times)) return;
    for (int k = 0; k < SKINS; k++) {
        for (int i = 0; i < BATCHES; i++)
            ns[i] = 1e9 * times[i * SKINS + k] / lammps_steps(row) / row->count;
        const figure f = summary(ns, BATCHES);
        if (!(f.median >= row->lammps.median)) row->lammps = f, row->lammps_skin = lammps_skins[k];
    }
}

static void run_batches(bench *b) {
    timing *row = b->row;
    const double per_batch = (double)row->count * row->steps;
    row->lists = -rebuilds(&b->one);
    for (int i = 0; i < BATCHES; i++) {
        double start = seconds();
        b->ns[0][i] = 1e9 * take_steps(&b->one, row->steps) / per_batch;
        b->ns[1][i] = 1e9 * (seconds() - start) / per_batch;
        start = seconds();
        take_steps(&b->two, row->steps);
        b->ns[2][i] = 1e9 * (seconds() - start) / per_batch;
        for (int k = 0; k < SKINS && b->lammps.on; k++)
            run_lammps(&b->lammps, lammps_skins[k], lammps_steps(row));
    }
    const bool finished = b->lammps.on;
    stop_lammps(&b->lammps);
    for (int i = 0; i < BATCHES; i++) row->mean += b->ns[0][i] / BATCHES;
    row->lists = 1000 * (row->lists + rebuilds(&b->one)) / (BATCHES * row->steps);
    row->one = summary(b->ns[0], BATCHES);
    row->wall = summary(b->ns[1], BATCHES);
    row->two = summary(b->ns[2], BATCHES);
    row->lammps = no_figure;
    if (finished) read_lammps(row);
}

static void clock_phases(bench *b) {
    timing *row = b->row;
    phase_clock c = {CLOCK_THREAD_CPUTIME_ID, {0}};
    setup s = plain_setup(row->test, 0.7);
    if (row->count < 2000)
        c.clock = CLOCK_MONOTONIC; /* is read in less time than such steps take */
    s.parallel = run_clocked, s.user = &c;
    run r = open_run(&b->adapted, &s);
    take_steps(&r, 20);
    begin_timed(&r, row->test);
    memset(c.seconds, 0, sizeof c.seconds);
    const double start = read_clock(c.clock);
    take_steps(&r, BATCHES * row->steps);
    const double total = read_clock(c.clock) - start;
    row->rest = 1;
    for (int i = 0; i < DEM2D_PHASE_COUNT; i++) {
        row->share[i] = c.seconds[i] / total;
        row->rest -= row->share[i];
    }
    close_run(&r);
}

static void count_things(bench *b) {
    timing *row = b->row;
    dem2d_stats stats;
    expect_ok(dem2d_world_stats(b->one.world, &stats), "stats");
    row->contacts = (double)(stats.contacts + stats.wall_contacts) / row->count;
    row->rate = row->contacts / (1e-9 * row->one.median);
    row->bytes = (double)stats.bytes / row->count;
    row->speed = rms_speed(&b->one);
    row->same = same_bits(&b->one, &b->two);
}

static void print_head(FILE *csv) {
    printf("ns per particle-step: median (min-max) of %d batches. One thread and LAMMPS: time on a "
           "core.\nwall: one thread by the clock; two threads and the ratio: by the clock.\n",
           BATCHES);
    printf("%-8s %-7s %8s | %7s %-12s %7s | %9s %-12s %5s %-9s | %s\n", "scene", "test", "N", "ns",
           "(min-max)", "wall", "2 threads", "(min-max)", "times", "bits",
           "LAMMPS (min-max), skin, times");
    fprintf(csv, "scene,test,particles,batch_steps,ns,ns_min,ns_max,wall_ns,wall_min,wall_max,");
    fprintf(csv, "two_threads_ns,two_threads_min,two_threads_max,same_bits,mean_ns,");
    fprintf(csv, "lists_per_1000_steps,");
    fprintf(csv, "share_list,share_contacts,share_motion,share_rest,contacts_per_particle,");
    fprintf(csv, "contacts_per_second,bytes_per_particle,rms_speed_mm_per_s,");
    fprintf(csv, "lammps_ns,lammps_min,lammps_max,lammps_skin_m\n");
}

static const char *range_text(const figure *f, char *text, size_t size) {
    snprintf(text, size, "(%.0f-%.0f)", f->low, f->high);
    return text;
}

static double speedup(const timing *r) {
    return r->wall.median / r->two.median;
}

static void print_row(const timing *r) {
    char one[32], two[32], peer_range[32];
    printf("%-8s %-7s %8d | %7.1f %-12s %7.1f | %9.1f %-12s %5.2f %-9s |", part_names[r->scene],
           test_names[r->test], r->count, r->one.median, range_text(&r->one, one, sizeof one),
           r->wall.median, r->two.median, range_text(&r->two, two, sizeof two), speedup(r),
           r->same ? "same bits" : "DIFFER");
    if (!isnan(r->lammps.median))
        printf(" %.1f %s, %g mm, %.2f", r->lammps.median,
               range_text(&r->lammps, peer_range, sizeof peer_range), 1000 * r->lammps_skin,
               r->lammps.median / r->one.median);
    printf("\n");
    fflush(stdout);
}

static void write_row(FILE *csv, const timing *r) {
    const figure *figures[] = {&r->one, &r->wall, &r->two, &r->lammps};
    fprintf(csv, "%s,%s,%d,%d", part_names[r->scene], test_names[r->test], r->count, r->steps);
    for (int i = 0; i < 3; i++)
        fprintf(csv, ",%.6g,%.6g,%.6g", figures[i]->median, figures[i]->low, figures[i]->high);
    fprintf(csv, ",%d,%.6g,%.4g", r->same, r->mean, r->lists);
    for (int i = 0; i < DEM2D_PHASE_COUNT; i++) fprintf(csv, ",%.4f", r->share[i]);
    fprintf(csv, ",%.4f,%.4f,%.6g,%.6g,%.6g", r->rest, r->contacts, r->rate, r->bytes, r->speed);
    if (isnan(r->lammps.median))
        fprintf(csv, ",,,,\n");
    else
        fprintf(csv, ",%.6g,%.6g,%.6g,%g\n", r->lammps.median, r->lammps.low, r->lammps.high,
                r->lammps_skin);
    fflush(csv);
}

static void print_phases(void) {
    printf("\nShares of a step in %%; mean ns per particle-step and lists of pairs per 1000 steps; "
           "contacts,\nwalls included; bytes; root mean square speed at the end\n");
    printf("%-8s %-7s %8s | %5s %8s %6s %5s | %7s %6s | %10s %9s | %7s | %7s\n", "scene", "test",
           "N", "list", "contacts", "motion", "rest", "mean ns", "lists", "contacts/N", "million/s",
           "bytes/N", "mm/s");
    for (int i = 0; i < row_count; i++) {
        const timing *r = &rows[i];
        printf("%-8s %-7s %8d | ", part_names[r->scene], test_names[r->test], r->count);
        printf("%5.1f %8.1f %6.1f %5.1f | ", 100 * r->share[DEM2D_PHASE_LIST],
               100 * r->share[DEM2D_PHASE_CONTACTS], 100 * r->share[DEM2D_PHASE_MOTION],
               100 * r->rest);
        printf("%7.1f %6.2f | %10.2f %9.2f | %7.0f | %7.2f\n", r->mean, r->lists, r->contacts,
               1e-6 * r->rate, r->bytes, r->speed);
    }
}

static void measure(int scene, int test, int count, FILE *csv) {
    static bench b;
    memset(&b, 0, sizeof b);
    b.row = &rows[row_count++];
    b.row->scene = scene, b.row->test = test, b.row->count = count;
    bed start = get_bed(scene, test, count);
    open_bench(&b, &start);
    run_batches(&b);
    count_things(&b);
    close_run(&b.one);
    close_run(&b.two);
    close_pool(&b.pool);
    clock_phases(&b);
    free(start.grains);
    free(b.adapted.grains);
    print_row(b.row);
    write_row(csv, b.row);
}

/* The sizes asked for, and those LAMMPS is compared at. */
static bool has_size(int scene, int test, int count) {
    const bool discs = scene == DISCS;
    if (count > opt.most) return false;
    if (opt.quick) return count == 500 || count == 5000 || (discs && count == 10000);
    if (count == 10000 || count == 100000) return discs && test == SETTLED;
    return count <= 50000 || discs;
}

static void measure_scenes(void) {
    static const int sizes[] = {500, 5000, 10000, 50000, 100000, 500000, 1000000};
    FILE *csv = create("world.csv");
    print_head(csv);
    for (int scene = 0; scene < SCENES; scene++)
        for (int test = 0; test < TESTS && opt.parts[scene]; test++)
            for (int i = 0; i < COUNT_OF(sizes); i++)
                if (has_size(scene, test, sizes[i])) measure(scene, test, sizes[i], csv);
    fclose(csv);
    print_phases();
}

/* --- LAMMPS with equal laws ------------------------------------------------------------------- */

#define CHECKED 200 /* steps, some ten swings of a contact, after which both are compared */

static const law laws[] = {{"friction", 0, 0}, {"dashpots", 0.3, 0}, {"rolling", 0.3, 0.1}};
static const int law_sizes[] = {500, 10000, 100000};

enum { LAWS = COUNT_OF(laws), LAW_SIZES = COUNT_OF(law_sizes) };

/* path: root mean square of the differences of the grains' displacements over that of the
   displacements; energy: kinetic energy in LAMMPS over that here. */
typedef struct law_row {
    timing time;
    double path, energy;
} law_row;

static law_row law_rows[LAWS][LAW_SIZES];

/* Positions after the checked steps, and velocities: mean of the half steps before and after. */
static void take_checked_steps(run *r, dem2d_vec *places, dem2d_vec *speeds) {
    take_steps(r, CHECKED - 1);
    for (int half = 0; half < 2; half++) {
        for (int i = 0; i < r->bed->count; i++) {
            const dem2d_particle_info now = get_particle(r, i);
            if (half == 0) places[i] = now.pose.position;
            speeds[i].x += now.velocity.x / 2, speeds[i].y += now.velocity.y / 2;
        }
        if (half == 0) take_steps(r, 1);
    }
}

/* Compares with what LAMMPS wrote after as many steps from the same start. */
static void compare_paths(const bed *b, const dem2d_vec *places, const dem2d_vec *speeds,
                          law_row *row) {
    char line[256];
    double off = 0, way = 0, here = 0, there = 0;
    FILE *file = fopen("lammps.dump", "r");
    for (int i = 0; file && i < 9; i++)
        if (!fgets(line, sizeof line, file)) break;
    for (int i = 0, id = 0; i < b->count; i++) {
        dem2d_vec p, v;
        if (!file || fscanf(file, "%d %lf %lf %lf %lf", &id, &p.x, &p.y, &v.x, &v.y) != 5 ||
            id != i + 1)
            bench_fail("lammps.dump: no line for disc %d", i + 1);
        const double mass = b->grains[i].scale * b->grains[i].scale;
        off += pow(p.x - places[i].x, 2) + pow(p.y - places[i].y, 2);
        way += pow(places[i].x - b->grains[i].x, 2) + pow(places[i].y - b->grains[i].y, 2);
        here += mass * (speeds[i].x * speeds[i].x + speeds[i].y * speeds[i].y);
        there += mass * (v.x * v.x + v.y * v.y);
    }
    fclose(file);
    row->path = sqrt(off / way), row->energy = there / here;
}

/* The adapted bed at rest: both go on from it, without local damping and friction history. */
static bed adapt_bed(const bed *start, setup *s, timing *row) {
    const int steps = adapting_steps(row->count);
    run r = open_run(start, s);
    row->steps = batch_steps(take_steps(&r, steps) / steps);
    const bed adapted = save_bed(&r, SETTLED);
    close_run(&r);
    s->damping = 0;
    return adapted;
}

/* Batches in turn, as of scenes. LAMMPS writes what is compared after its first run. */
static void run_law(run *r, const law *l, law_row *row) {
    timing *t = &row->time;
    const int count = t->count;
    peer lammps = {false, 0, NULL, 0};
    dem2d_vec *places = get_memory((size_t)count, sizeof *places);
    dem2d_vec *speeds = get_memory((size_t)count, sizeof *speeds);
    double ns[BATCHES];
    take_steps(r, 1);
    if (have_lammps()) {
        lammps = start_lammps(r->bed, DISCS, l, r);
        run_lammps(&lammps, lammps_skins[1], CHECKED);
    }
    if (lammps.on)
        fprintf(lammps.commands, "write_dump all custom lammps.dump id x y vx vy modify sort id "
                                 "format float %%.17g\n");
    take_checked_steps(r, places, speeds);
    for (int i = 0; i < BATCHES; i++) {
        ns[i] = 1e9 * take_steps(r, t->steps) / ((double)count * t->steps);
        for (int k = 0; k < SKINS && lammps.on; k++)
            run_lammps(&lammps, lammps_skins[k], lammps_steps(t));
    }
    const bool finished = lammps.on;
    stop_lammps(&lammps);
    t->one = summary(ns, BATCHES), t->lammps = no_figure;
    if (finished) read_lammps(t), compare_paths(r->bed, places, speeds, row);
    free(places);
    free(speeds);
}

static void print_law(const law *l, const law_row *row, FILE *csv) {
    const timing *t = &row->time;
    char one[32], peer_range[32];
    printf("%-8s %8d | %7.1f %-12s | %7.1f %-12s %4g mm %5.2f | %9.2g %9.6f\n", l->name, t->count,
           t->one.median, range_text(&t->one, one, sizeof one), t->lammps.median,
           range_text(&t->lammps, peer_range, sizeof peer_range), 1000 * t->lammps_skin,
           t->lammps.median / t->one.median, row->path, row->energy);
    fprintf(csv, "%s,%d,%d,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%g,%.4g,%.6g\n", l->name, t->count,
            t->steps, t->one.median, t->one.low, t->one.high, t->lammps.median, t->lammps.low,
            t->lammps.high, t->lammps_skin, row->path, row->energy);
    fflush(stdout);
}

static void measure_law(int which, int size, FILE *csv) {
    law_row *row = &law_rows[which][size];
    setup s = plain_setup(SETTLED, 0.7);
    s.law = &laws[which];
    row->time.scene = DISCS, row->time.test = SETTLED, row->time.count = law_sizes[size];
    row->path = row->energy = NAN;
    bed start = get_bed(DISCS, SETTLED, law_sizes[size]);
    bed adapted = adapt_bed(&start, &s, &row->time);
    run r = open_run(&adapted, &s);
    run_law(&r, s.law, row);
    print_law(s.law, row, csv);
    close_run(&r);
    free(start.grains);
    free(adapted.grains);
}

static void measure_laws(void) {
    FILE *csv = create("laws.csv");
    printf(
        "\nSettled discs without local damping, by law: the same in both programs. dashpots: "
        "normal "
        "and\ntangential, damping ratio 0.3 (LAMMPS: gran/hooke/history); rolling: these, and "
        "rolling friction 0.1\n(granular, sds). After %d steps from the same start: path, the "
        "difference of displacements; energy,\nkinetic, LAMMPS over dem2d. LAMMPS has other "
        "dashpots for discs that are not of mean size.\n%-8s %8s | %7s %-12s | %7s %-12s %7s %5s "
        "| %9s %9s\n",
        CHECKED, "law", "N", "ns", "(min-max)", "LAMMPS", "(min-max)", "skin", "times", "path",
        "energy");
    fprintf(csv, "law,particles,batch_steps,ns,ns_min,ns_max,lammps_ns,lammps_min,lammps_max,"
                 "lammps_skin_m,path,energy\n");
    for (int which = 0; which < LAWS; which++)
        for (int size = 0; size < LAW_SIZES; size++)
            if (law_sizes[size] <= opt.most && !(opt.quick && law_sizes[size] > 10000))
                measure_law(which, size, csv);
    fclose(csv);
}

/* --- time against error: dt ------------------------------------------------------------------- */

enum { STEPS_SIZES = 6, DT_GRAINS = 3 };

typedef struct dt_row {
    double dt, error,
        cost; /* error: of positions, over R; cost: microseconds per grain and second */
} dt_row;

#define IMPACT 0.08 /* s: both impacts are over, none has come again */

static dt_row dt_rows[MODELS][STEPS_SIZES];

/* One grain falls on the floor, spinning; two others meet in the air. Velocities are those half a
   step before the positions. */
static run open_impacts(const bed *b, double dt) {
    static const dem2d_vec velocity[DT_GRAINS] = {{0.5, -1}, {0.6, 0}, {-0.6, 0}};
    setup s = plain_setup(SETTLED, 0);
    s.time_step = dt;
    run r = open_run(b, &s);
    for (int i = 0; i < DT_GRAINS; i++) {
        dem2d_vec v = velocity[i];
        v.y += 0.5 * dt * GRAVITY;
        expect_ok(dem2d_world_drive_particle(r.world, r.ids[i], DEM2D_FREE, v, i == 0 ? -3 : 0),
                  "velocity");
    }
    return r;
}

static bed impact_bed(int model) {
    static const grain places[DT_GRAINS] = {
        {0, 0.025, 0.2, 0.045, 0.3}, {0, 0.025, 1, 0.5, 1}, {0, 0.025, 1.09, 0.51, 2}};
    bed b = make_bed(DT_GRAINS);
    b.right = 3;
    for (int i = 0; i < DT_GRAINS; i++) {
        dem2d_shape_info info;
        b.grains[i] = places[i];
        b.grains[i].shape = model * TEMPLATES + (model == CIRCLE ? 0 : 1 + i);
        expect_ok(dem2d_shape_get(b.shapes[b.grains[i].shape], &info), "template");
        b.grains[i].scale /= info.equivalent;
    }
    return b;
}

/* Positions at the end; the least time of some runs. */
static double run_impacts(const bed *b, double dt, int repeats, dem2d_vec *places) {
    double least = HUGE_VAL;
    for (int k = 0; k < repeats; k++) {
        run r = open_impacts(b, dt);
        least = fmin(least, take_steps(&r, (int)(IMPACT / dt + 0.5)));
        for (int i = 0; i < DT_GRAINS; i++) places[i] = get_particle(&r, i).pose.position;
        close_run(&r);
    }
    return 1e6 * least / IMPACT / DT_GRAINS;
}

static void measure_dt_of(int model, FILE *csv) {
    const double largest = 4e-4;
    dem2d_vec truth[DT_GRAINS], places[DT_GRAINS];
    bed b = impact_bed(model);
    run_impacts(&b, ldexp(largest, 1 - STEPS_SIZES - 4), 1, truth);
    for (int k = 0; k < STEPS_SIZES; k++) {
        dt_row *r = &dt_rows[model][k];
        r->dt = ldexp(largest, -k), r->error = 0;
        r->cost = run_impacts(&b, r->dt, opt.quick ? 3 : 9, places);
        for (int i = 0; i < DT_GRAINS; i++)
            r->error =
                fmax(r->error, hypot(places[i].x - truth[i].x, places[i].y - truth[i].y) / 0.025);
        printf("%-8s %10.3g %12.3g %12.1f\n", model_names[model], r->dt, r->error, r->cost);
        fprintf(csv, "%s,%g,%.6g,%.6g\n", model_names[model], r->dt, r->error, r->cost);
    }
    free(b.grains);
}

static void measure_dt(void) {
    FILE *csv = create("dt.csv");
    printf(
        "\nTime step: a fall on the floor, two grains that meet; error of positions after 0.08 s "
        "over R,\nagainst a sixteenth of the least step; microseconds per grain and second\n");
    printf("%-8s %10s %12s %12s\n", "model", "dt, s", "error", "cost");
    fprintf(csv, "model,dt_s,error_over_radius,microseconds_per_grain_second\n");
    for (int m = 0; m < MODELS; m++) measure_dt_of(m, csv);
    fclose(csv);
}

/* --- time against error: order of Fourier series ---------------------------------------------- */

enum { ORIGINALS = 8 };

static const int fit_orders[] = {2, 3, 4, 6, 8, 12, 16, 24, 32, 64};

enum { ORDERS = COUNT_OF(fit_orders) };

typedef struct order_row {
    double error, hausdorff; /* 1 - coverage, mean; over the radius, greatest */
    figure ns;
} order_row;

static order_row order_rows[ORDERS];

/* Corners on a circle, rounded by a seventh of it. */
static dem2d_shape *make_original(void) {
    const int count = 4 + (int)bed_uniform(0, MOST_CORNERS - 3);
    dem2d_vec points[MOST_CORNERS];
    dem2d_shape *shape;
    for (int i = 0; i < count; i++) {
        const double angle = 2 * PI * (i + bed_uniform(-0.25, 0.25)) / count;
        points[i].x = 0.9 * cos(angle), points[i].y = 0.9 * sin(angle);
    }
    expect_ok(dem2d_shape_create_polygon(NULL, points, count, 0.15, &shape), "polygon");
    return shape;
}

static dem2d_shape *fit(const dem2d_shape *original, int order, dem2d_fit_report *report) {
    dem2d_vec outline[OUTLINE];
    dem2d_fit_desc desc = {0};
    dem2d_shape *shape;
    desc.model = DEM2D_FOURIER, desc.count = order;
    expect_ok(dem2d_shape_outline(original, dem2d_pose_make(0, 0, 0, 1), OUTLINE, outline),
              "outline");
    expect_ok(dem2d_outline_fit(NULL, outline, OUTLINE, &desc, &shape, report), "fit");
    return shape;
}

static void fit_originals(dem2d_shape *const *originals, int order, dem2d_shape **fits,
                          order_row *r) {
    r->error = 0, r->hausdorff = 0;
    for (int i = 0; i < ORIGINALS; i++) {
        dem2d_fit_report report;
        dem2d_shape_info info;
        expect_ok(dem2d_shape_get(originals[i], &info), "original");
        fits[i] = fit(originals[i], order, &report);
        r->error += (1 - report.coverage) / ORIGINALS;
        r->hausdorff = fmax(r->hausdorff, report.hausdorff / info.equivalent);
    }
}

/* The settled bed of the originals with each replaced by its fit; which settles again. */
static run open_order(bed *b, dem2d_shape *const *fits) {
    const setup s = plain_setup(SETTLED, 0.7);
    b->shapes = fits;
    run r = open_run(b, &s);
    take_steps(&r, 1000);
    damp(&r, 0.3);
    return r;
}

static bed settle_originals(dem2d_shape *const *originals) {
    bed b = make_bed(500);
    b.shapes = originals, b.shape_count = ORIGINALS, b.right = 1;
    for (int i = 0; i < b.count; i++)
        b.grains[i] = random_grain(&b, (int)bed_uniform(0, ORIGINALS));
    lay_rows(&b);
    return settle(b);
}

static void time_orders(run *runs, bed *beds) {
    double ns[ORDERS][BATCHES];
    const int steps = opt.quick ? 200 : 1500;
    for (int i = 0; i < BATCHES; i++)
        for (int k = 0; k < ORDERS; k++)
            ns[k][i] = 1e9 * take_steps(&runs[k], steps) / steps / beds[k].count;
    for (int k = 0; k < ORDERS; k++) order_rows[k].ns = summary(ns[k], BATCHES);
}

static void print_orders(void) {
    FILE *csv = create("order.csv");
    printf("\nFourier series: fits to %d rounded polygons; 500 of them settled\n"
           "%5s %12s %12s %8s %s\n",
           ORIGINALS, "order", "1 - coverage", "Hausdorff/R", "ns", "(min-max)");
    fprintf(csv, "order,one_less_coverage,hausdorff_over_radius,ns,ns_min,ns_max\n");
    for (int k = 0; k < ORDERS; k++) {
        const order_row *r = &order_rows[k];
        printf("%5d %12.3g %12.3g %8.1f (%.0f-%.0f)\n", fit_orders[k], r->error, r->hausdorff,
               r->ns.median, r->ns.low, r->ns.high);
        fprintf(csv, "%d,%.6g,%.6g,%.6g,%.6g,%.6g\n", fit_orders[k], r->error, r->hausdorff,
                r->ns.median, r->ns.low, r->ns.high);
    }
    fclose(csv);
}

static void measure_orders(void) {
    static dem2d_shape *originals[ORIGINALS], *fits[ORDERS][ORIGINALS];
    run runs[ORDERS];
    bed beds[ORDERS];
    bed_state = 64;
    for (int i = 0; i < ORIGINALS; i++) originals[i] = make_original();
    bed settled = settle_originals(originals);
    for (int k = 0; k < ORDERS; k++) {
        fit_originals(originals, fit_orders[k], fits[k], &order_rows[k]);
        beds[k] = settled;
        runs[k] = open_order(&beds[k], fits[k]);
    }
    time_orders(runs, beds);
    print_orders();
    for (int k = 0; k < ORDERS; k++) {
        close_run(&runs[k]);
        for (int i = 0; i < ORIGINALS; i++) dem2d_shape_destroy(fits[k][i]);
    }
    for (int i = 0; i < ORIGINALS; i++) dem2d_shape_destroy(originals[i]);
    free(settled.grains);
}

/* --- time against error: skin ----------------------------------------------------------------- */

static const double skins[] = {0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4}; /* 0: the library's choice */
static const int skin_scenes[] = {DISCS, MIXED};

enum { SKIN_ROWS = COUNT_OF(skins), SKIN_SCENES = COUNT_OF(skin_scenes) };

typedef struct skin_row {
    double rebuilds, error; /* per 1000 steps; positions against skin 0.01, over 0.025 m */
    figure ns;
} skin_row;

static skin_row skin_rows[SKIN_SCENES][SKIN_ROWS];

static double greatest_difference(const run *a, const run *b) {
    double most = 0;
    for (int i = 0; i < a->bed->count; i++) {
        const dem2d_vec p = get_particle(a, i).pose.position, q = get_particle(b, i).pose.position;
        most = fmax(most, hypot(p.x - q.x, p.y - q.y) / 0.025);
    }
    return most;
}

static void time_skins(run *runs, skin_row *out, int steps) {
    double ns[SKIN_ROWS][BATCHES], before[SKIN_ROWS];
    for (int k = 0; k < SKIN_ROWS; k++) before[k] = rebuilds(&runs[k]);
    for (int i = 0; i < BATCHES; i++)
        for (int k = 0; k < SKIN_ROWS; k++)
            ns[k][i] = 1e9 * take_steps(&runs[k], steps) / steps / runs[k].bed->count;
    for (int k = 0; k < SKIN_ROWS; k++) {
        out[k].ns = summary(ns[k], BATCHES);
        out[k].rebuilds = 1000 * (rebuilds(&runs[k]) - before[k]) / (BATCHES * steps);
        out[k].error = greatest_difference(&runs[1], &runs[k]);
    }
}

static void measure_skins_of(int which, FILE *csv) {
    run runs[SKIN_ROWS];
    const int count = tile_size();
    bed b = get_bed(skin_scenes[which], BIAXIAL, count);
    for (int k = 0; k < SKIN_ROWS; k++) {
        setup s = plain_setup(BIAXIAL, 0.7);
        s.skin = skins[k];
        runs[k] = open_run(&b, &s);
        take_steps(&runs[k], 300);
        compress(&runs[k]);
    }
    time_skins(runs, skin_rows[which], opt.quick ? 300 : 150);
    for (int k = 0; k < SKIN_ROWS; k++) {
        const skin_row *r = &skin_rows[which][k];
        printf("%-8s %6g %8.1f (%.0f-%.0f)  %8.2f %10.3g\n", part_names[skin_scenes[which]],
               skins[k], r->ns.median, r->ns.low, r->ns.high, r->rebuilds, r->error);
        fprintf(csv, "%s,%g,%.6g,%.6g,%.6g,%.6g,%.6g\n", part_names[skin_scenes[which]], skins[k],
                r->ns.median, r->ns.low, r->ns.high, r->rebuilds, r->error);
        close_run(&runs[k]);
    }
    free(b.grains);
}

static void measure_skins(void) {
    FILE *csv = create("skin.csv");
    printf("\nSkin (0: the library's choice): %d grains in the biaxial test; lists made per 1000 "
           "steps;\ngreatest difference of positions from those with skin 0.01, over 25 mm\n"
           "%-8s %6s %8s %s %8s %10s\n",
           tile_size(), "scene", "skin", "ns", "(min-max)", "lists", "difference");
    fprintf(csv, "scene,skin,ns,ns_min,ns_max,lists_per_1000_steps,difference\n");
    for (int i = 0; i < SKIN_SCENES; i++) measure_skins_of(i, csv);
    fclose(csv);
}

/* --- aims ------------------------------------------------------------------------------------- */

static const timing *find_row(int scene, int test, int count) {
    for (int i = 0; i < row_count; i++)
        if (rows[i].scene == scene && rows[i].test == test && rows[i].count == count)
            return &rows[i];
    return NULL;
}

static void aim(const char *what, double value, double bound, bool at_most) {
    const bool met = at_most ? value <= bound : value >= bound;
    printf("%s  %-58s aim %s %-6g got ",
           isnan(value) ? "-   "
           : met        ? "PASS"
                        : "MISS",
           what, at_most ? "<=" : ">=", bound);
    printf(isnan(value) ? "nothing\n" : "%.4g\n", value);
}

static void aim_lammps(int scene, int count, double times) {
    char text[96];
    const timing *r = find_row(scene, SETTLED, count);
    snprintf(text, sizeof text, "%d %s settled, LAMMPS / dem2d", count, part_names[scene]);
    aim(text, r ? r->lammps.median / r->one.median : NAN, times, false);
}

static void aim_law(int which, double times) {
    char text[96];
    for (int size = 0; size < LAW_SIZES; size++) {
        const timing *t = &law_rows[which][size].time;
        if (t->count == 0) continue;
        snprintf(text, sizeof text, "%d discs, %s, LAMMPS / dem2d", t->count, laws[which].name);
        aim(text, t->lammps.median / t->one.median, times, false);
    }
}

/* Speeds; and how near both programs are to each other, at worst. Dashpots of a pair whose reduced
   mass is a fifth off the mean differ by a tenth: they account for 1 % of the paths. */
static void aim_laws(void) {
    double path = NAN, energy = NAN;
    for (int i = 0; i < LAWS * LAW_SIZES; i++) {
        const law_row *r = &law_rows[i / LAW_SIZES][i % LAW_SIZES];
        if (r->time.count == 0 || isnan(r->path)) continue;
        if (!(r->path <= path)) path = r->path;
        if (!(fabs(r->energy - 1) <= energy)) energy = fabs(r->energy - 1);
    }
    aim_law(1, 3.3);
    aim_law(2, 5);
    aim("LAMMPS with equal laws: difference of paths", path, 0.02, true);
    aim("LAMMPS with equal laws: difference of kinetic energy", energy, 0.01, true);
}

/* The slowest size: settled alone, or both tests. */
static void aim_ns(int scene, int tests, double ns) {
    char text[96];
    double most = NAN;
    for (int i = 0; i < row_count; i++)
        if (rows[i].scene == scene && rows[i].test < tests && !(rows[i].one.median <= most))
            most = rows[i].one.median;
    snprintf(text, sizeof text, "%s %s, ns per particle-step, slowest size", part_names[scene],
             tests == 1 ? "settled" : "settled and biaxial");
    aim(text, most, ns, true);
}

static void aim_million(void) {
    const timing *large = find_row(DISCS, SETTLED, 1000000),
                 *small = find_row(DISCS, SETTLED, 10000);
    aim("1000000 discs, time per particle-step over that of 10000",
        large && small ? large->one.median / small->one.median : NAN, 2, true);
    aim("1000000 discs, bytes per particle", large ? large->bytes : NAN, 400, true);
    aim("1000000 discs, list phase, %",
        large && large->rest < 1 ? 100 * large->share[DEM2D_PHASE_LIST] : NAN, 10, true);
}

static void aim_threads(void) {
    double least = NAN;
    for (int i = 0; i < row_count; i++) {
        const double ratio = speedup(&rows[i]);
        if (rows[i].count >= 10000 && !(ratio >= least)) least = ratio;
    }
    aim("two threads, speedup, least of all with 10000 or more", least, 1.7, false);
}

/* Returns how many rows differ in bits. */
static int print_aims(void) {
    int differ = 0;
    for (int i = 0; i < row_count; i++) differ += !rows[i].same;
    if (row_count == 0 && !opt.parts[PART_LAWS]) return 0;
    printf("\nAims\n");
    if (opt.parts[PART_LAWS]) aim_laws();
    if (row_count == 0) return 0;
    aim_lammps(DISCS, 500, 2.5);
    aim_lammps(DISCS, 10000, 2.5);
    aim_lammps(DISCS, 100000, 2.5);
    aim_lammps(POLYGONS, 500, 6);
    aim_lammps(POLYGONS, 5000, 6);
    aim_ns(ELLIPSES, 1, 200);
    aim_ns(MIXED, TESTS, 250);
    aim_million();
    aim_threads();
    aim("scenes where two threads gave other bits than one", differ, 0, true);
    return differ;
}

/* --- pictures --------------------------------------------------------------------------------- */

static const char *const colours[] = {"#0072b2", "#d55e00", "#009e73",
                                      "#cc79a7", "#56b4e9", "#000000"};

static FILE *create_plot(const char *name, const char *title, const char *x, const char *y) {
    char path[64];
    snprintf(path, sizeof path, "%s.gp", name);
    FILE *file = create(path);
    fprintf(file,
            "set terminal svg size 1000,700 font 'Helvetica,14' background '#ffffff'\n"
            "set output '%s.svg'\nset grid\nset key outside right center\nset title '%s'\n"
            "set xlabel '%s'\nset ylabel '%s'\n",
            name, title, x, y);
    return file;
}

static void draw(FILE *file, const char *name) {
    char command[96];
    fclose(file);
    snprintf(command, sizeof command, "gnuplot %s.gp", name);
    if (system("command -v gnuplot > /dev/null 2>&1") != 0)
        printf("skipped: %s.svg: gnuplot is not installed (it draws %s.gp)\n", name, name);
    else
        printf("%s/%s.svg%s\n", opt.folder, name, system(command) == 0 ? "" : ": gnuplot failed");
}

static bool has_rows(int scene, int test, bool lammps) {
    for (int i = 0; i < row_count; i++)
        if (rows[i].scene == scene && rows[i].test == test &&
            (!lammps || !isnan(rows[i].lammps.median)))
            return true;
    return false;
}

static void write_times(FILE *file, int scene, int test) {
    fprintf(file, "$s%dt%d << EOD\n", scene, test);
    for (int i = 0; i < row_count; i++) {
        const timing *r = &rows[i];
        if (r->scene != scene || r->test != test) continue;
        fprintf(file, "%d %.6g ", r->count, r->one.median);
        fprintf(file, isnan(r->lammps.median) ? "-\n" : "%.6g\n", r->lammps.median);
    }
    fprintf(file, "EOD\n");
}

static void plot_times(FILE *file, int scene, int test) {
    const char *colour = colours[scene];
    if (has_rows(scene, test, false))
        fprintf(file,
                "    $s%dt%d using 1:2 with linespoints lc '%s' pt %d lw 1.5 %s title "
                "'%s, %s', \\\n",
                scene, test, colour, test == SETTLED ? 7 : 6, test == SETTLED ? "" : "dt 2",
                part_names[scene], test_names[test]);
    if (has_rows(scene, test, true))
        fprintf(file,
                "    $s%dt%d using 1:3 with linespoints lc '%s' pt 9 ps 1.3 dt 3 title "
                "'%s, LAMMPS', \\\n",
                scene, test, colour, part_names[scene]);
}

static void draw_times(void) {
    if (row_count == 0) return;
    FILE *file = create_plot("world", "A step of a world, one thread: median of batches",
                             "particles", "ns per particle-step");
    fprintf(file,
            "set logscale xy\nset format x '10^{%%L}'\nset datafile missing '-'\n"
            "set xrange [300:%g]\nset yrange [10:3000]\n"
            "set ytics (10,20,50,100,200,500,1000,2000)\n",
            opt.most > 100000 && !opt.quick ? 2e6 : 1.2e5);
    for (int k = 0; k < SCENES * TESTS; k++)
        if (has_rows(k / TESTS, k % TESTS, false)) write_times(file, k / TESTS, k % TESTS);
    fprintf(file, "plot \\\n");
    for (int k = 0; k < SCENES * TESTS; k++) plot_times(file, k / TESTS, k % TESTS);
    fprintf(file, "    NaN notitle\n");
    draw(file, "world");
}

static void draw_dt(void) {
    FILE *file = create_plot("dt", "Time step: each point half of the one before it, from 4e-4 s",
                             "microseconds per grain and simulated second",
                             "error of position after 0.08 s / R");
    fprintf(file, "set logscale xy\nset format xy '10^{%%L}'\n");
    for (int m = 0; m < MODELS; m++) {
        fprintf(file, "$m%d << EOD\n", m);
        for (int k = 0; k < STEPS_SIZES; k++)
            fprintf(file, "%.6g %.6g\n", dt_rows[m][k].cost, fmax(dt_rows[m][k].error, 1e-16));
        fprintf(file, "EOD\n");
    }
    fprintf(file, "plot \\\n");
    for (int m = 0; m < MODELS; m++)
        fprintf(file, "    $m%d using 1:2 with linespoints lc '%s' pt 7 lw 1.5 title '%s', \\\n", m,
                colours[m], model_names[m]);
    fprintf(file, "    NaN notitle\n");
    draw(file, "dt");
}

static void draw_orders(void) {
    FILE *file = create_plot("order", "Fourier series fitted to rounded polygons, by order",
                             "ns per particle-step, 500 settled grains", "error");
    fprintf(file, "set logscale y\nset format y '10^{%%L}'\n$o << EOD\n");
    for (int k = 0; k < ORDERS; k++)
        fprintf(file, "%.6g %.6g %.6g %d %.6g %.6g\n", order_rows[k].ns.median, order_rows[k].error,
                order_rows[k].hausdorff, fit_orders[k], order_rows[k].ns.low,
                order_rows[k].ns.high);
    fprintf(file,
            "EOD\nplot \\\n"
            "    $o using 1:2:5:6 with xerrorlines lc '%s' pt 7 title '1 - coverage', \\\n"
            "    $o using 1:3 with linespoints lc '%s' pt 5 title 'Hausdorff / R', \\\n"
            "    $o using 1:2:4 with labels right offset -0.6,-0.6 notitle\n",
            colours[0], colours[1]);
    draw(file, "order");
}

static void draw_skins(void) {
    FILE *file =
        create_plot("skin", "Skin in the biaxial test (lines across: what the library chooses)",
                    "skin / radius", "ns per particle-step");
    fprintf(file, "set logscale x\nset xrange [0.008:0.5]\nset xtics (0.01,0.02,0.05,0.1,0.2,0.4)\n"
                  "set yrange [0:*]\n");
    for (int s = 0; s < SKIN_SCENES; s++) {
        fprintf(file, "$s%d << EOD\n", s);
        for (int k = 1; k < SKIN_ROWS; k++)
            fprintf(file, "%g %.6g %.6g %.6g\n", skins[k], skin_rows[s][k].ns.median,
                    skin_rows[s][k].ns.low, skin_rows[s][k].ns.high);
        fprintf(file, "EOD\n");
    }
    fprintf(file, "plot \\\n");
    for (int s = 0; s < SKIN_SCENES; s++)
        fprintf(file,
                "    $s%d using 1:2:3:4 with yerrorlines lc '%s' pt 7 lw 1.5 title '%s', \\\n"
                "    %.6g with lines lc '%s' dt 2 notitle, \\\n",
                s, colours[s], part_names[skin_scenes[s]], skin_rows[s][0].ns.median, colours[s]);
    fprintf(file, "    NaN notitle\n");
    draw(file, "skin");
}

/* --- running ---------------------------------------------------------------------------------- */

static int usage(void) {
    fprintf(stderr, "usage: bench_world [--quick] [--only PART,...] [--most N] [--no-lammps] "
                    "[OUTDIR]\nparts:");
    for (int i = 0; i < PARTS; i++) fprintf(stderr, " %s", part_names[i]);
    fprintf(stderr, "\n");
    return 2;
}

/* --- lists of discs of several sizes --- */

/* A world of discs at random places, radii drawn so that each power of two between 1 and 1/ratio
   takes the same area, together half of the square; none moves, but all pairs are listed. */
static dem2d_world *open_sizes(int count, double ratio) {
    dem2d_world *world;
    dem2d_material_desc stone = {.density = DENSITY, .normal_stiffness = 1e7};
    dem2d_particle_desc grain = {0};
    dem2d_world_desc scene = {0};
    scene.time_step = TIME_STEP;
    scene.particle_capacity = count;
    scene.skip_time_step_check = true;
    expect_ok(dem2d_world_create(&scene, &world), "world");
    expect_ok(dem2d_world_add_material(world, &stone, &grain.material), "material");
    expect_ok(dem2d_world_add_shape(world, templates[0], &grain.shape), "shape");
    grain.motion = DEM2D_DRIVEN;
    double area = 0, *radii = get_memory((size_t)count, sizeof *radii);
    for (int i = 0; i < count; i++) { /* 1/r^2 uniform: a number for each r that falls as r^-3 */
        radii[i] = 1 / sqrt(bed_uniform(1, ratio * ratio));
        area += PI * radii[i] * radii[i];
    }
    const double side = sqrt(2 * area);
    for (int i = 0; i < count; i++) {
        dem2d_particle_id id;
        grain.scale = radii[i];
        grain.position.x = bed_uniform(0, side);
        grain.position.y = bed_uniform(0, side);
        expect_ok(dem2d_world_add_particle(world, &grain, &id), "particle");
    }
    free(radii);
    return world;
}

/* Seconds on the core to renew the list once. */
static double time_list(dem2d_world *world) {
    enum { TRIES = 5 };
    double times[TRIES];
    for (int k = 0; k < TRIES; k++) {
        world->list_stale = true;
        const double before = busy_seconds();
        expect_ok(dem2d_world_step(world, 1, NULL), "step");
        times[k] = busy_seconds() - before;
        expect_ok(dem2d_world_step(world, 1, NULL), "step"); /* one without, to be taken off */
        times[k] -= busy_seconds() - before - times[k];
    }
    return summary(times, TRIES).median;
}

static void measure_sizes(void) {
    static const double ratios[] = {1, 10, 100};
    static const int counts[] = {10000, 40000, 160000};
    FILE *csv = create("sizes.csv");
    printf("\nRenewing the list: discs at random, half of the area, ratio of greatest to least "
           "radius\n%8s %6s %16s %16s\n",
           "N", "ratio", "ns per particle", "pairs each");
    fprintf(csv, "particles,ratio,ns_per_particle,pairs_per_particle\n");
    for (int i = 0; i < COUNT_OF(counts); i++)
        for (int k = 0; k < COUNT_OF(ratios); k++) {
            dem2d_world *world = open_sizes(opt.quick ? counts[i] / 8 : counts[i], ratios[k]);
            dem2d_stats stats;
            expect_ok(dem2d_world_step(world, 2, NULL), "step");
            const double list = time_list(world);
            expect_ok(dem2d_world_stats(world, &stats), "stats");
            const double ns = 1e9 * list / stats.particles;
            const double pairs = (double)stats.pairs / stats.particles;
            printf("%8d %6g %16.0f %16.2f\n", stats.particles, ratios[k], ns, pairs);
            fprintf(csv, "%d,%g,%.6g,%.6g\n", stats.particles, ratios[k], ns, pairs);
            dem2d_world_destroy(world);
        }
    fclose(csv);
}

/* --- moving discs --- */

/* Discs in cells of a square, a little beside their middles, that fly about, or fall on a floor of
   segments that go up and down by a fifth of the mean diameter. */
typedef struct moving {
    const char *name;
    int count;
    double ratio;    /* of the greatest radius to the least; 1: radii uniform in 0.02 to 0.03 m */
    double fraction; /* of the area */
    double speed;    /* m/s, of each component at most */
    double time_step, gravity;
    int segments; /* in place of the floor */
} moving;

static const moving movings[] = {{"moving", 10000, 1, 0.6, 1, TIME_STEP, 0, 0},
                                 {"moving", 160000, 1, 0.6, 1, TIME_STEP, 0, 0},
                                 {"ratio 10", 10000, 10, 0.5, 0.2, TIME_STEP / 10, 0, 0},
                                 {"ratio 10", 160000, 10, 0.5, 0.2, TIME_STEP / 10, 0, 0},
                                 {"falling", 10000, 1, 0.6, 0.1, TIME_STEP, GRAVITY, 0},
                                 {"on segments", 10000, 1, 0.6, 0.1, TIME_STEP, GRAVITY, 1000}};

static void add_moving_walls(dem2d_world *world, const moving *m, dem2d_material_id stone,
                             double side) {
    static const double normals[WALLS][2] = {{1, 0}, {-1, 0}, {0, -1}, {0, 1}};
    dem2d_wall_id id;
    for (int w = 0; w < WALLS; w++) {
        dem2d_wall_desc wall = {0};
        wall.material = stone;
        wall.normal.x = normals[w][0], wall.normal.y = normals[w][1];
        *(w < 2 ? &wall.point.x : &wall.point.y) = w == 1 || w == 2 ? side : 0;
        if (w == 3 && m->segments > 0) continue; /* the floor */
        expect_ok(dem2d_world_add_wall(world, &wall, &id), "wall");
    }
    for (int i = 0; i < m->segments; i++) {
        dem2d_wall_desc wall = {0};
        wall.material = stone, wall.segment = true;
        wall.point.x = side * i / m->segments, wall.end.x = side * (i + 1) / m->segments;
        *(i % 2 ? &wall.point.y : &wall.end.y) = -0.01;
        expect_ok(dem2d_world_add_wall(world, &wall, &id), "segment");
    }
}

static dem2d_world *open_moving(const moving *m, int count) {
    dem2d_world *world;
    dem2d_relaxation relaxation;
    dem2d_world_desc scene = {0};
    dem2d_material_desc stone = {.density = DENSITY, .normal_stiffness = STIFFNESS};
    dem2d_particle_desc grain = {0};
    stone.tangential_stiffness = STIFFNESS, stone.friction = FRICTION;
    scene.time_step = m->time_step, scene.gravity.y = -m->gravity;
    scene.local_damping = m->gravity > 0 ? 0.3 : 0;
    scene.particle_capacity = count, scene.skip_time_step_check = m->ratio > 1;
    expect_ok(dem2d_world_create(&scene, &world), "world");
    expect_ok(dem2d_world_add_material(world, &stone, &grain.material), "material");
    expect_ok(dem2d_world_add_shape(world, templates[0], &grain.shape), "shape");
    double area = 0, *radii = get_memory((size_t)count, sizeof *radii);
    for (int i = 0; i < count; i++) {
        radii[i] = m->ratio > 1 ? 0.02 / sqrt(bed_uniform(1, m->ratio * m->ratio))
                                : bed_uniform(0.02, 0.03);
        area += PI * radii[i] * radii[i];
    }
    const int columns = (int)ceil(sqrt(count));
    const double side = sqrt(area / m->fraction), cell = side / columns;
    for (int i = 0; i < count; i++) {
        dem2d_particle_id id;
        grain.scale = radii[i];
        grain.position.x = (i % columns + 0.5 + bed_uniform(-0.2, 0.2)) * cell;
        grain.position.y = ((int)(i / columns) + 0.5 + bed_uniform(-0.2, 0.2)) * cell;
        grain.velocity.x = bed_uniform(-m->speed, m->speed);
        grain.velocity.y = bed_uniform(-m->speed, m->speed);
        expect_ok(dem2d_world_add_particle(world, &grain, &id), "particle");
    }
    free(radii);
    add_moving_walls(world, m, grain.material, side);
    expect_ok(dem2d_world_relax(world, 1e-3, 300, &relaxation), "places without overlaps");
    return world;
}

/* Batches of a run as long as the discs take to leave their places by some radii; mean of all. */
static void measure_moving_scene(const moving *m, FILE *csv) {
    const int count = opt.quick ? m->count / 8 : m->count, steps = count > 50000 ? 40 : 150;
    dem2d_world *world = open_moving(m, count);
    dem2d_stats before, stats;
    double ns[BATCHES], mean = 0;
    expect_ok(dem2d_world_step(world, 200, NULL), "step");
    expect_ok(dem2d_world_stats(world, &before), "stats");
    for (int i = 0; i < BATCHES; i++) {
        const double start = busy_seconds();
        expect_ok(dem2d_world_step(world, steps, NULL), "step");
        ns[i] = 1e9 * (busy_seconds() - start) / ((double)steps * count);
        mean += ns[i] / BATCHES;
    }
    expect_ok(dem2d_world_stats(world, &stats), "stats");
    const figure f = summary(ns, BATCHES);
    const double lists =
        1000.0 * (double)(stats.list_rebuilds - before.list_rebuilds) / (BATCHES * steps);
    const double contacts = (double)(stats.contacts + stats.wall_contacts) / count;
    printf("%-12s %8d %6g | %7.1f (%.0f-%.0f) | %7.1f | %8.1f %10.2f\n", m->name, count, m->ratio,
           mean, f.low, f.high, lists, (double)stats.pairs / count, contacts);
    fprintf(csv, "%s,%d,%g,%d,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", m->name, count, m->ratio,
            m->segments, mean, f.low, f.high, lists, (double)stats.pairs / count, contacts);
    dem2d_world_destroy(world);
}

static void measure_moving(void) {
    FILE *csv = create("moving.csv");
    printf("\nMoving discs, ns per particle-step with lists: mean (min-max) of %d batches\n"
           "%-12s %8s %6s | %-15s | %7s | %8s %10s\n",
           BATCHES, "scene", "N", "ratio", "ns", "lists/k", "pairs/N", "contacts/N");
    fprintf(csv, "scene,particles,ratio,segments,ns_mean,ns_min,ns_max,lists_per_1000_steps,"
                 "pairs_per_particle,contacts_per_particle\n");
    for (int i = 0; i < COUNT_OF(movings); i++)
        if (movings[i].count <= opt.most) measure_moving_scene(&movings[i], csv);
    fclose(csv);
}

static bool parse_parts(char *list) {
    for (char *name = strtok(list, ","); name; name = strtok(NULL, ",")) {
        int i = 0;
        while (i < PARTS && strcmp(name, part_names[i]) != 0) i++;
        if (i == PARTS) return false;
        opt.parts[i] = true;
    }
    return true;
}

static bool parse(int argc, char **argv) {
    bool all = true;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--quick") == 0)
            opt.quick = true;
        else if (strcmp(argv[i], "--no-lammps") == 0)
            opt.lammps = false;
        else if (strcmp(argv[i], "--most") == 0 && i + 1 < argc)
            opt.most = atoi(argv[++i]);
        else if (strcmp(argv[i], "--only") == 0 && i + 1 < argc && parse_parts(argv[i + 1]))
            all = false, i++;
        else if (argv[i][0] != '-' && !opt.folder)
            opt.folder = argv[i];
        else
            return false;
    }
    for (int i = 0; i < PARTS; i++) opt.parts[i] = opt.parts[i] || all;
    if (!opt.folder) opt.folder = "build/bench_world";
    return true;
}

int main(int argc, char **argv) {
    const double start = seconds();
    bool scenes = false;
    if (!parse(argc, argv)) return usage();
    enter_folder(opt.folder);
    signal(SIGPIPE, SIG_IGN);
    bed_state = 1;
    make_templates();
    if (!have_lammps()) printf("skipped: LAMMPS: %s\n", opt.lammps ? "no lmp here" : "not wanted");
    for (int i = 0; i < SCENES; i++) scenes = scenes || opt.parts[i];
    if (scenes) measure_scenes();
    if (opt.parts[PART_LAWS]) measure_laws();
    if (opt.parts[PART_DT]) measure_dt();
    if (opt.parts[PART_ORDER]) measure_orders();
    if (opt.parts[PART_SKIN]) measure_skins();
    if (opt.parts[PART_SIZES]) measure_sizes();
    if (opt.parts[PART_MOVING]) measure_moving();
    const int differ = print_aims();
    printf("\n");
    draw_times();
    if (opt.parts[PART_DT]) draw_dt();
    if (opt.parts[PART_ORDER]) draw_orders();
    if (opt.parts[PART_SKIN]) draw_skins();
    printf("%.0f s\n", seconds() - start);
    for (int i = 0; i < COUNT_OF(templates); i++) dem2d_shape_destroy(templates[i]);
    return differ ? 1 : 0;
}
