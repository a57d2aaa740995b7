/* bench_cost settle SCENE SEED FILE              settles a scene and saves it
   bench_cost go-on FILE STEPS [RENEWAL]          takes steps of a saved scene in `measured`; the
   neighbour list is made anew every RENEWAL steps, if that is given
   bench_cost feature FILE FEATURE STATE STEPS    the discs of a saved scene with a feature,
   likewise

   bench_cost.sh has the instructions of `measured` counted. A saved scene goes on as it was when it
   is continued. A feature is tried on the scene "smooth discs": discs in a closed box, squeezed,
   which swing a little about their places, without friction, damping, gravity or spin. STATE tells
   how they have a feature: 0 absent; 1 there, but not used; 2 in use. Prints particles, contacts at
   the end, and how often the list was made anew. Exit status: 0, 2 for a failed call or bad usage.
 */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#define BENCH_NAME "bench_cost"
#include "bench_beds.h"

enum { ABSENT, OFF, ON };
enum {
    COLUMNS = 25, /* of discs in rows */
    CORNERS = 24
}; /* of a polygon: so many that it stays in contact in a disc's place */
enum { FLOOR, LEFT, RIGHT, LID, WALLS };

/* What a saved scene has beside its world. */
typedef struct kept {
    dem2d_wall_id walls[WALLS];
    int renewal; /* steps after which the neighbour list is made anew; 0: when it has to be */
} kept;

/* A world that is measured, and what its features need. */
typedef struct bench {
    dem2d_world *world;
    dem2d_material_id material;
    dem2d_shape_id disc, polygon; /* of radius 1 */
    kept kept;
    int count;
    dem2d_particle_id *ids;
    dem2d_vec *at;
    double *radius;
    double width, height;
    bool ask;         /* for energy and stress, each step */
    bool averages;    /* each step is added */
    dem2d_grid *grid; /* to this */
} bench;

static void add_wall(bench *b, int i, dem2d_wall_mode mode) {
    const double normals[WALLS][2] = {{0, 1}, {1, 0}, {-1, 0}, {0, -1}};
    dem2d_wall_desc desc = {0};
    desc.mode = mode, desc.material = b->material;
    desc.normal.x = normals[i][0], desc.normal.y = normals[i][1];
    desc.point.x = i == RIGHT ? b->width : 0, desc.point.y = i == LID ? b->height : 0;
    desc.length = i == LEFT || i == RIGHT ? b->height : b->width;
    desc.stress = 1e5, desc.max_speed = 0.2;
    expect_ok(dem2d_world_add_wall(b->world, &desc, &b->kept.walls[i]), "wall");
}

static void open_bench(bench *b, const dem2d_world_desc *desc, double friction) {
    dem2d_material_desc stone = material_desc(DENSITY, STIFFNESS, 0, 0);
    stone.friction = friction, stone.tangential_stiffness = friction > 0 ? STIFFNESS : 0;
    expect_ok(dem2d_world_create(desc, &b->world), "world");
    expect_ok(dem2d_world_add_material(b->world, &stone, &b->material), "material");
}

static void get_arrays(bench *b, int count) {
    b->count = count;
    b->ids = get_memory((size_t)count, sizeof *b->ids);
    b->at = get_memory((size_t)count, sizeof *b->at);
    b->radius = get_memory((size_t)count, sizeof *b->radius);
}

static void close_bench(bench *b) {
    dem2d_grid_destroy(b->grid);
    dem2d_world_destroy(b->world);
    free(b->ids), free(b->at), free(b->radius);
}

/* --- scenes ----------------------------------------------------------------------------------- */

/* OPEN: heaped in a box without a lid. SQUEEZED: without weight, under a lid that holds 100 kPa.
   GAS: flying about in a closed box, area fraction 0.6. CHAIN: heaped on 1,000 segments that go up
   and down; the neighbour list is made anew every RENEWAL steps, as if the heap moved. CELL: in a
   periodic cell, shrunk to 100 kPa and then kept. */
typedef enum place { OPEN, SQUEEZED, GAS, CHAIN, CELL } place;

enum { SEGMENTS = 1000, RENEWAL = 50 };
#define SEGMENT_LENGTH 0.01 /* m, along x; they rise and fall by half of that */

typedef struct scene {
    const char *name;
    int grains; /* of bench_beds.h */
    place place;
    int count;
    double friction, damping_ratio, tangential, rolling; /* ratios of dashpots */
    bool law;
    int omits; /* of the law */
} scene;

enum { SHORT = DEM2D_LAW_IDS | DEM2D_LAW_DASHPOTS | DEM2D_LAW_ROLLING | DEM2D_LAW_STATE };

static const scene scenes[] = {
    {"smooth discs", DISCS, SQUEEZED, 600, 0, 0, 0, 0, false, 0},
    {"discs", DISCS, OPEN, 800, FRICTION, 0, 0, 0, false, 0},
    {"discs, dashpot", DISCS, OPEN, 800, FRICTION, 0.2, 0, 0, false, 0},
    {"discs, dashpot, rolling", DISCS, OPEN, 800, FRICTION, 0.2, 0, 0.1, false, 0},
    {"discs, both dashpots", DISCS, OPEN, 800, FRICTION, 0.2, 0.2, 0, false, 0},
    {"discs, both dashpots, rolling", DISCS, OPEN, 800, FRICTION, 0.2, 0.2, 0.1, false, 0},
    {"discs, law", DISCS, OPEN, 800, FRICTION, 0, 0, 0, true, 0},
    {"discs, short law", DISCS, OPEN, 800, FRICTION, 0, 0, 0, true, SHORT},
    {"polygons", POLYGONS, OPEN, 800, FRICTION, 0, 0, 0, false, 0},
    {"ellipses", ELLIPSES, OPEN, 800, FRICTION, 0, 0, 0, false, 0},
    {"polybeziers", BEZIERS, OPEN, 800, FRICTION, 0, 0, 0, false, 0},
    {"Fourier series", FOURIERS, OPEN, 800, FRICTION, 0, 0, 0, false, 0},
    {"mixed", MIXED, OPEN, 800, FRICTION, 0, 0, 0, false, 0},
    {"moving discs", DISCS, GAS, 1000, 0, 0, 0, 0, false, 0},
    {"segments", MIXED, CHAIN, 200, FRICTION, 0, 0, 0, false, 0},
    {"cell", DISCS, CELL, 800, FRICTION, 0, 0, 0, false, 0},
};

static const scene *find_scene(const char *name) {
    for (int i = 0; i < COUNT_OF(scenes); i++)
        if (strcmp(scenes[i].name, name) == 0) return &scenes[i];
    bench_fail("no scene %s", name);
    return NULL;
}

/* Spring and friction, as the world has them: it reads nothing that a SHORT law omits. */
static void spring_law(void *user, dem2d_law_batch *b) {
    (void)user;
    for (int k = 0; k < b->count; k++) {
        const double force = b->stiffness[k] * b->weight[k] * b->depth[k];
        const double limit = b->friction[k] * force, slid = b->sliding[k] * b->time_step;
        double along = b->last_tangential[k] - b->tangential_stiffness[k] * b->weight[k] * slid;
        if (along > limit) along = limit;
        if (along < -limit) along = -limit;
        b->normal_force[k] = force, b->tangential_force[k] = along;
        b->energy[k] = b->stiffness[k] * b->compression[k];
    }
}

/* On a square lattice, in a box or cell that holds them at area fraction 0.6. */
static void lay_gas(bed *b) {
    const int columns = (int)sqrt(b->count);
    double area = 0;
    for (int i = 0; i < b->count; i++) {
        double *radius = &b->grains[i].scale;
        *radius = 0.025 + 0.25 * (*radius - 0.025); /* nearer to each other: all fit in a cell */
        area += PI * *radius * *radius;
    }
    const double pitch = sqrt(area / (0.6 * b->count));
    for (int i = 0; i < b->count; i++) {
        grain *g = &b->grains[i];
        g->x = pitch * (i % columns + 0.5), g->y = pitch * (i / columns + 0.5);
    }
    b->right = columns * pitch, b->top = (b->count + columns - 1) / columns * pitch;
}

static void add_chain(bench *b) {
    for (int i = 0; i < SEGMENTS; i++) {
        dem2d_wall_desc desc = {0};
        dem2d_wall_id id;
        desc.segment = true, desc.material = b->material;
        desc.point.x = SEGMENT_LENGTH * i, desc.end.x = SEGMENT_LENGTH * (i + 1);
        *(i % 2 ? &desc.point.y : &desc.end.y) = -0.5 * SEGMENT_LENGTH;
        expect_ok(dem2d_world_add_wall(b->world, &desc, &id), "segment");
    }
}

static void add_box(bench *b, place place) {
    static const bool there[][WALLS] = {
        {1, 1, 1, 0}, {1, 1, 1, 1}, {1, 1, 1, 1}, {0, 1, 1, 0}, {0, 0, 0, 0}};
    for (int i = 0; i < WALLS; i++) {
        const bool servo = i == LID && place == SQUEEZED;
        if (there[place][i]) add_wall(b, i, servo ? DEM2D_WALL_SERVO : DEM2D_WALL_STILL);
    }
    if (place == CHAIN) add_chain(b), b->kept.renewal = RENEWAL;
}

static void stir(bench *b, double speed) {
    for (int i = 0; i < b->count; i++) {
        const dem2d_vec v = {bed_uniform(-speed, speed), bed_uniform(-speed, speed)};
        expect_ok(dem2d_world_drive_particle(b->world, b->ids[i], DEM2D_FREE, v, 0), "velocity");
    }
}

static bench open_scene(const scene *s, uint64_t seed) {
    static const double widths[] = {3.2, 1.3, 2, SEGMENTS * SEGMENT_LENGTH, 2};
    const bool square = s->place == GAS || s->place == CELL;
    bench b = {0};
    dem2d_world_desc desc = {0};
    desc.time_step = TIME_STEP;
    desc.gravity.y = s->place == OPEN || s->place == CHAIN ? -GRAVITY : 0;
    if (s->law) desc.law = spring_law, desc.law_omits = s->omits;
    bed grains = draw_bed(s->grains, s->count, seed, widths[s->place]);
    if (square) lay_gas(&grains);
    b.width = grains.right;
    b.height = square ? grains.top : grains.grains[s->count - 1].y + 0.06;
    if (s->place == CELL) desc.cell.a.x = b.width, desc.cell.b.y = b.height;
    open_bench(&b, &desc, s->friction);
    dem2d_pair_desc pair = pair_desc(STIFFNESS, s->friction > 0 ? STIFFNESS : 0, s->friction);
    pair.damping_ratio = s->damping_ratio, pair.tangential_damping_ratio = s->tangential;
    pair.rolling_friction = s->rolling;
    expect_ok(dem2d_world_set_pair(b.world, b.material, b.material, &pair), "pair");
    get_arrays(&b, s->count);
    add_bed(b.world, &grains, b.material, b.ids);
    add_box(&b, s->place);
    free(grains.grains);
    return b;
}

static void rest(bench *b, int steps) {
    expect_ok(dem2d_world_set_damping(b->world, 0.7, 0), "damping");
    expect_ok(dem2d_world_step(b->world, steps, NULL), "coming to rest");
}

/* Falls, and rests until the neighbour list of a while ago still holds, which it hardly ever does
   when a few grains still roll. */
static void settle_heap(bench *b, int fall) {
    enum { WHILE = 3000, TRIES = 8 };
    int64_t lists = -1;
    expect_ok(dem2d_world_set_damping(b->world, 0.3, 0), "damping");
    expect_ok(dem2d_world_step(b->world, fall, NULL), "falling");
    for (int i = 0; i < TRIES; i++) {
        dem2d_stats stats;
        expect_ok(dem2d_world_stats(b->world, &stats), "stats");
        if (stats.list_rebuilds == lists) return;
        lists = stats.list_rebuilds;
        rest(b, WHILE);
    }
}

/* Held at a stress, then as large as it is. */
static void settle_cell(bench *b, int steps) {
    dem2d_deformation_desc deform = {0};
    deform.hold_xx = deform.hold_yy = true, deform.stress_xx = deform.stress_yy = 1e5;
    expect_ok(dem2d_world_deform(b->world, &deform), "stress");
    rest(b, steps);
    memset(&deform, 0, sizeof deform);
    expect_ok(dem2d_world_deform(b->world, &deform), "cell");
    rest(b, steps / 2);
}

static void settle(bench *b, const scene *s) {
    enum { MIXING = 2000, SQUEEZING = 25000, HIGH_FALL = 4000, LOW_FALL = 2000 };
    if (s->place == GAS) {
        stir(b, 1);
        expect_ok(dem2d_world_step(b->world, MIXING, NULL), "mixing");
    } else if (s->place == SQUEEZED) {
        stir(b, 0.5);
        rest(b, SQUEEZING);
    } else if (s->place == CELL) {
        stir(b, 0.5);
        settle_cell(b, SQUEEZING);
    } else {
        settle_heap(b, s->place == OPEN ? HIGH_FALL : LOW_FALL);
    }
}

/* --- saved scenes: what is kept beside the world, then its snapshot -------------------------- */

static bool put_bytes(void *user, const char *bytes, size_t count) {
    return fwrite(bytes, 1, count, (FILE *)user) == count;
}

static bool get_bytes(void *user, char *bytes, size_t count) {
    return fread(bytes, 1, count, (FILE *)user) == count;
}

static FILE *open_file(const char *path, const char *mode) {
    FILE *file = fopen(path, mode);
    if (!file) bench_fail("can't open %s", path);
    return file;
}

static void save_scene(const bench *b, const char *path) {
    dem2d_save_desc desc = {0};
    FILE *file = open_file(path, "wb");
    desc.write = put_bytes, desc.user = file;
    const bool written = put_bytes(file, (const char *)&b->kept, sizeof b->kept);
    expect_ok(dem2d_world_save(b->world, &desc, NULL), "saving");
    if (fclose(file) != 0 || !written) bench_fail("can't write %s", path);
}

static bench load_scene(const char *path) {
    bench b = {0};
    dem2d_load_desc desc = {0};
    FILE *file = open_file(path, "rb");
    int count = 0;
    desc.read = get_bytes, desc.user = file, desc.law = spring_law;
    if (!get_bytes(file, (char *)&b.kept, sizeof b.kept)) bench_fail("%s: no saved scene", path);
    expect_ok(dem2d_world_load(&desc, NULL, &b.world), path);
    fclose(file);
    expect_ok(dem2d_world_particles(b.world, NULL, 0, &count), "particles");
    get_arrays(&b, count);
    expect_ok(dem2d_world_particles(b.world, b.ids, count, &count), "particles");
    return b;
}

/* The discs of a saved scene, for a world of its own. */
static bench load_discs(const char *path) {
    bench b = load_scene(path);
    dem2d_wall_info right, lid;
    expect_ok(dem2d_world_get_wall(b.world, b.kept.walls[RIGHT], &right), "right wall");
    expect_ok(dem2d_world_get_wall(b.world, b.kept.walls[LID], &lid), "lid");
    b.width = right.point.x, b.height = lid.point.y;
    for (int i = 0; i < b.count; i++) {
        dem2d_particle_info p;
        expect_ok(dem2d_world_get_particle(b.world, b.ids[i], &p), "disc");
        b.at[i] = p.pose.position, b.radius[i] = p.radius;
    }
    dem2d_world_destroy(b.world);
    b.world = NULL;
    return b;
}

/* --- features ------------------------------------------------------------------------------- */

static void serial(void *user, dem2d_phase phase, int count, dem2d_task_fn *task, void *context) {
    (void)phase;
    if (user == NULL)
        task(context, 0, count);
    else
        for (int i = 0; i < count; i++) task(context, i, i + 1);
}

static void set_friction(bench *b, double friction) {
    const dem2d_pair_desc pair = pair_desc(STIFFNESS, friction > 0 ? STIFFNESS : 0, friction);
    expect_ok(dem2d_world_set_pair(b->world, b->material, b->material, &pair), "pair");
}

static void set_dashpot(bench *b, double damping_ratio) {
    const dem2d_pair_desc pair = {.normal_stiffness = STIFFNESS, .damping_ratio = damping_ratio};
    expect_ok(dem2d_world_set_pair(b->world, b->material, b->material, &pair), "pair");
}

/* A periodic cell in place of the box. */
static bool in_cell(const char *feature, int state) {
    return strcmp(feature, "cell") == 0 && state == ON;
}

/* What is given at creation. */
static void describe(const bench *b, const char *feature, int state, dem2d_world_desc *desc) {
    static int one_by_one;
    if (in_cell(feature, state)) desc->cell.a.x = b->width, desc->cell.b.y = b->height;
    if (strcmp(feature, "parallel_for") == 0 && state != ABSENT)
        desc->parallel_for = serial, desc->parallel_user = state == ON ? &one_by_one : NULL;
    if (strcmp(feature, "empty region") == 0) desc->skin = 1e-3; /* many lists */
    if (strcmp(feature, "ledger") == 0) desc->ledger = state == ON;
}

/* The right half moved away: by 0.5 m, by 1 km, not at all. */
static void shift_half(bench *b, int state) {
    const double by = state == ABSENT ? 0.5 : state == OFF ? 1000 : 0, middle = 0.5 * b->width;
    for (int i = 0; i < b->count; i++)
        if (b->at[i].x > middle) b->at[i].x += by;
    b->width += by;
}

/* In rows: out of each other's reach; near, but apart, for polygons with bounding circles that
   overlap; touching. */
static void space_out(bench *b, int state, bool polygons) {
    const double near = polygons ? 0.998 : 1.02, touching = polygons ? 0.99 : 0.999;
    const double pitch = 0.05 * (state == ABSENT ? 1.4 : state == OFF ? near : touching);
    for (int i = 0; i < b->count; i++) {
        b->at[i].x = pitch * (i % COLUMNS + 1), b->at[i].y = pitch * (i / COLUMNS + 1);
        b->radius[i] = 0.025;
    }
    b->width = pitch * (COLUMNS + 1), b->height = pitch * (b->count / COLUMNS + 1);
}

static dem2d_particle_desc disc_desc(const bench *b, dem2d_vec at, double radius) {
    dem2d_particle_desc desc = {0};
    desc.scale = radius, desc.shape = b->disc, desc.material = b->material, desc.position = at;
    return desc;
}

static void place_discs(bench *b, const char *feature, int state) {
    const bool polygons = strcmp(feature, "gaps of polygons") == 0;
    const bool still = polygons || strcmp(feature, "gaps of discs") == 0;
    if (strcmp(feature, "empty region") == 0) shift_half(b, state);
    if (still) space_out(b, state, polygons);
    for (int i = 0; i < WALLS && !in_cell(feature, state); i++) add_wall(b, i, DEM2D_WALL_STILL);
    for (int i = 0; i < b->count; i++) {
        dem2d_particle_desc d = disc_desc(b, b->at[i], b->radius[i]);
        d.velocity.x = bed_uniform(-0.01, 0.01), d.velocity.y = bed_uniform(-0.01, 0.01);
        if (strcmp(feature, "polygons") == 0 && state == ON && i % 10 == 0) d.shape = b->polygon;
        if (strcmp(feature, "fixed") == 0 && state == ON && i % 10 < 3) d.motion = DEM2D_FIXED;
        if (polygons) d.shape = b->polygon, d.angle = PI / CORNERS;
        if (still || d.motion == DEM2D_FIXED) d.velocity.x = d.velocity.y = 0;
        expect_ok(dem2d_world_add_particle(b->world, &d, &b->ids[i]), "disc");
    }
}

static void add_shape(bench *b, dem2d_shape *shape, dem2d_shape_id *id) {
    expect_ok(dem2d_world_add_shape(b->world, shape, id), "shape");
    dem2d_shape_destroy(shape);
}

static void add_disc(bench *b) {
    dem2d_shape *shape;
    expect_ok(dem2d_shape_create_circle(NULL, 1, &shape), "disc");
    add_shape(b, shape, &b->disc);
}

static void add_polygon(bench *b) {
    dem2d_vec corners[CORNERS];
    dem2d_shape *shape;
    for (int i = 0; i < CORNERS; i++) {
        const dem2d_rot r = dem2d_rot_make(i * 2 * PI / CORNERS);
        corners[i].x = r.c, corners[i].y = r.s;
    }
    expect_ok(dem2d_shape_create_polygon(NULL, corners, CORNERS, 0, &shape), "polygon");
    add_shape(b, shape, &b->polygon);
}

/* Two that touch each other and, behind it, the lid; out of reach of all others. */
static void add_fixed_pair(bench *b) {
    for (int i = 0; i < 2; i++) {
        const dem2d_vec at = {0.5, b->height - 0.5 + 1 + 0.04 * i};
        dem2d_particle_desc d = disc_desc(b, at, 0.025);
        dem2d_particle_id id;
        d.motion = DEM2D_FIXED;
        expect_ok(dem2d_world_add_particle(b->world, &d, &id), "fixed pair");
    }
}

static void add_rough_material(bench *b) {
    const dem2d_material_desc rough = material_desc(DENSITY, STIFFNESS, STIFFNESS, 0.4);
    dem2d_pair_desc pair = pair_desc(STIFFNESS, STIFFNESS, 0.4);
    pair.damping_ratio = pair.rolling_friction = 0.1;
    dem2d_material_id id;
    expect_ok(dem2d_world_add_material(b->world, &rough, &id), "material");
    expect_ok(dem2d_world_set_pair(b->world, id, id, &pair), "pair");
}

/* OFF: far below. ON: where the floor is. */
static void add_other_wall(bench *b, int state, bool segment) {
    dem2d_wall_desc desc = {0};
    dem2d_wall_id id;
    desc.material = b->material, desc.normal.y = 1, desc.point.y = state == OFF ? -1000 : 0;
    desc.segment = segment, desc.end.x = b->width, desc.end.y = desc.point.y;
    expect_ok(dem2d_world_add_wall(b->world, &desc, &id), "wall");
}

/* Cells of a mean diameter, smoothed over two. OFF: it is there, but nothing is added. */
static void add_grid(bench *b, int state) {
    dem2d_grid_desc desc = {0};
    desc.nx = (int)(b->width / 0.05) + 4, desc.ny = (int)(b->height / 0.05) + 4;
    desc.box.lower.x = desc.box.lower.y = -0.1, desc.width_x = desc.width_y = 0.1;
    desc.box.upper.x = 0.05 * desc.nx - 0.1, desc.box.upper.y = 0.05 * desc.ny - 0.1;
    expect_ok(dem2d_grid_create(NULL, &desc, &b->grid), "grid");
    b->averages = state == ON;
}

/* With the discs in place: what is there from now on. */
static void add_feature(bench *b, const char *feature, int state) {
    dem2d_energy e;
    if (strcmp(feature, "friction of no pair") == 0) {
        if (state == OFF) add_rough_material(b);
        if (state == ON) set_friction(b, 0.4);
    }
    if (strcmp(feature, "dashpot of no pair") == 0) {
        if (state == OFF) add_rough_material(b);
        if (state == ON) set_dashpot(b, 0.1);
    }
    if (strcmp(feature, "wall") == 0) add_other_wall(b, state, false);
    if (strcmp(feature, "segment") == 0) add_other_wall(b, state, true);
    if (strcmp(feature, "fixed") == 0 && state == OFF) add_fixed_pair(b);
    if (strcmp(feature, "energy, stress") == 0) {
        b->ask = state == ON;
        expect_ok(dem2d_world_energy(b->world, &e), "energy");
    }
    if (strcmp(feature, "fields") == 0) add_grid(b, state);
}

static void set_spin(bench *b, double spin) {
    for (int i = 0; i < b->count; i++) {
        dem2d_particle_info p;
        expect_ok(dem2d_world_get_particle(b->world, b->ids[i], &p), "disc");
        expect_ok(dem2d_world_drive_particle(b->world, b->ids[i], p.motion, p.velocity, spin),
                  "spin");
    }
}

/* What can be set: to something for a step, and then (OFF) back to 0. */
static void set_feature(bench *b, const char *feature, bool on) {
    const dem2d_vec gravity = {0, on ? -9.81 : 0};
    if (strcmp(feature, "friction") == 0) set_friction(b, on ? 0.4 : 0);
    if (strcmp(feature, "local damping") == 0)
        expect_ok(dem2d_world_set_damping(b->world, on ? 0.7 : 0, 0), "damping");
    if (strcmp(feature, "global damping") == 0)
        expect_ok(dem2d_world_set_damping(b->world, 0, on ? 1 : 0), "damping");
    if (strcmp(feature, "gravity") == 0)
        expect_ok(dem2d_world_set_gravity(b->world, gravity), "gravity");
    if (strcmp(feature, "spin") == 0) set_spin(b, on ? 1 : 0);
    if (strcmp(feature, "friction") == 0 && !on) set_spin(b, 0); /* a step of it made some */
}

/* bench_cost.sh has the instructions counted between the start and the end of this function, which
   is therefore not to be inlined or cloned. */
#if defined(__clang__)
__attribute__((noinline))
#elif defined(__GNUC__)
__attribute__((noinline, noclone))
#endif
void measured(bench *b, int steps);

void measured(bench *b, int steps) {
    dem2d_energy e;
    dem2d_stress s;
    const int stride = b->ask || b->averages ? 1 : b->kept.renewal > 0 ? b->kept.renewal : steps;
    for (int done = 0; done < steps; done += stride) {
        if (b->kept.renewal > 0) b->world->list_stale = true;
        expect_ok(dem2d_world_step(b->world, stride, NULL), "step");
        if (b->ask) expect_ok(dem2d_world_energy(b->world, &e), "energy");
        if (b->ask) expect_ok(dem2d_world_stress(b->world, 1, &s), "stress");
        if (b->averages) expect_ok(dem2d_grid_add(b->grid, b->world, 1), "fields");
    }
}

static void measure(bench *b, int steps) {
    dem2d_stats before, after;
    expect_ok(dem2d_world_stats(b->world, &before), "stats");
    measured(b, steps);
    expect_ok(dem2d_world_stats(b->world, &after), "stats");
    printf("%d %d %d\n", b->count, after.contacts + after.wall_contacts,
           (int)(after.list_rebuilds - before.list_rebuilds));
}

static bench open_feature(const char *path, const char *feature, int state) {
    bench b = load_discs(path);
    dem2d_world_desc desc = {0};
    desc.time_step = TIME_STEP;
    describe(&b, feature, state, &desc);
    open_bench(&b, &desc, 0);
    add_disc(&b);
    if (strcmp(feature, "gaps of polygons") == 0) add_polygon(&b);
    if (strcmp(feature, "polygons") == 0 && state != ABSENT) add_polygon(&b);
    place_discs(&b, feature, state);
    if (state != ABSENT) add_feature(&b, feature, state);
    if (state != ABSENT) set_feature(&b, feature, true);
    expect_ok(dem2d_world_step(b.world, 1, NULL), "step");
    if (state == OFF) set_feature(&b, feature, false);
    expect_ok(dem2d_world_step(b.world, 20, NULL), "step");
    return b;
}

int main(int count, char **arguments) {
    const char *task = count > 1 ? arguments[1] : "";
    bench b;
    bed_state = 1;
    if (count == 5 && strcmp(task, "settle") == 0) {
        const scene *s = find_scene(arguments[2]);
        make_templates();
        b = open_scene(s, strtoull(arguments[3], NULL, 10));
        settle(&b, s);
        save_scene(&b, arguments[4]);
    } else if ((count == 4 || count == 5) && strcmp(task, "go-on") == 0) {
        b = load_scene(arguments[2]);
        if (count == 5) b.kept.renewal = atoi(arguments[4]);
        measure(&b, atoi(arguments[3]));
    } else if (count == 6 && strcmp(task, "feature") == 0) {
        b = open_feature(arguments[2], arguments[3], atoi(arguments[4]));
        measure(&b, atoi(arguments[5]));
    } else {
        fprintf(stderr, "usage: bench_cost settle SCENE SEED FILE | go-on FILE STEPS [RENEWAL] | "
                        "feature FILE FEATURE STATE STEPS\n");
        return 2;
    }
    close_bench(&b);
    for (int i = 0; i < COUNT_OF(templates); i++) dem2d_shape_destroy(templates[i]);
    return 0;
}
