/* bench_cost settle FILE                 settles discs in a box and writes them
   bench_cost FILE FEATURE STATE STEPS    takes steps in `measured`, for bench_cost.sh to count

   The settled discs swing a little about their places, without friction, damping, gravity or spin.
   STATE tells how they have a feature: 0 absent; 1 there, but not used; 2 in use. Prints discs,
   contacts at the end, and how often the list was made anew. Exit status: 0, 1 for a failed call, 2
   for bad usage. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DISCS = 600, COLUMNS = 25, ABSENT = 0, OFF, ON };
enum { CORNERS = 24 }; /* of a polygon: so many that it stays in contact in a disc's place */

#define PITCH 0.052 /* m, at the start */
#define KN 1e7
#define DENSITY 2700.0

static void check(dem2d_result result, const char *what) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "bench_cost: %s: %s\n", what, dem2d_result_text(result));
    exit(1);
}

static uint64_t random_state = 1;

/* Uniform in [lower, upper): splitmix64. */
static double uniform(double lower, double upper) {
    uint64_t z = (random_state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return lower + (upper - lower) * ((double)((z ^ (z >> 31)) >> 11) * 0x1p-53);
}

/* The world of a run, and what its features need. */
typedef struct bench {
    dem2d_world *world;
    dem2d_material_id material;
    dem2d_shape_id disc, polygon; /* of radius 1 */
    dem2d_wall_id walls[4];       /* floor, left, right, lid */
    dem2d_particle_id ids[DISCS];
    dem2d_vec at[DISCS];
    double radius[DISCS];
    double width, height;
    bool ask; /* for energy, stress and packing, each step */
} bench;

/* --- settling ------------------------------------------------------------------------------- */

static void add_wall(bench *b, int i, dem2d_wall_mode mode) {
    const double normals[4][2] = {{0, 1}, {1, 0}, {-1, 0}, {0, -1}};
    dem2d_wall_desc desc = {0};
    desc.mode = mode, desc.material = b->material;
    desc.normal.x = normals[i][0], desc.normal.y = normals[i][1];
    desc.point.x = i == 2 ? b->width : 0, desc.point.y = i == 3 ? b->height : 0;
    desc.length = i == 1 || i == 2 ? b->height : b->width;
    desc.stress = 1e5, desc.max_speed = 0.2;
    check(dem2d_world_add_wall(b->world, &desc, &b->walls[i]), "wall");
}

static void make_world(bench *b, const dem2d_world_desc *desc) {
    const dem2d_material_desc smooth = {DENSITY, KN, 0, 0, 0, 0};
    dem2d_shape *disc;
    check(dem2d_world_create(desc, &b->world), "world");
    check(dem2d_world_add_material(b->world, &smooth, &b->material), "material");
    check(dem2d_shape_create_circle(NULL, 1, &disc), "disc");
    check(dem2d_world_add_shape(b->world, disc, &b->disc), "disc");
    dem2d_shape_destroy(disc);
}

static dem2d_particle_desc disc_desc(const bench *b, dem2d_vec at, double radius) {
    dem2d_particle_desc desc = {0};
    desc.scale = radius, desc.shape = b->disc, desc.material = b->material, desc.position = at;
    return desc;
}

static void settle(bench *b, const char *path) {
    dem2d_world_desc desc = {0};
    desc.time_step = 1e-4, desc.local_damping = 0.7, desc.gravity.y = -9.81;
    b->width = COLUMNS * PITCH, b->height = DISCS / COLUMNS * PITCH;
    make_world(b, &desc);
    for (int i = 0; i < 4; i++) add_wall(b, i, i == 3 ? DEM2D_WALL_SERVO : DEM2D_WALL_STILL);
    for (int i = 0; i < DISCS; i++) {
        const double radius = uniform(0.02, 0.026);
        const dem2d_vec at = {PITCH * (i % COLUMNS + 0.5), PITCH * (i / COLUMNS + 0.5)};
        dem2d_particle_desc d = disc_desc(b, at, radius);
        d.velocity.x = uniform(-0.5, 0.5);
        check(dem2d_world_add_particle(b->world, &d, &b->ids[i]), "disc");
    }
    check(dem2d_world_step(b->world, 25000, NULL), "settling");
    dem2d_wall_info lid;
    check(dem2d_world_get_wall(b->world, b->walls[3], &lid), "lid");
    FILE *file = fopen(path, "w");
    if (file == NULL) exit(1);
    fprintf(file, "%a %a\n", b->width, lid.point.y);
    for (int i = 0; i < DISCS; i++) {
        dem2d_particle_info p;
        check(dem2d_world_get_particle(b->world, b->ids[i], &p), "disc");
        fprintf(file, "%a %a %a\n", p.pose.position.x, p.pose.position.y, p.pose.scale);
    }
    if (fclose(file) != 0) exit(1);
}

static void read_discs(bench *b, const char *path) {
    FILE *file = fopen(path, "r");
    int got = file ? fscanf(file, "%la %la", &b->width, &b->height) : 0;
    for (int i = 0; i < DISCS && got > 0; i++)
        got = fscanf(file, "%la %la %la", &b->at[i].x, &b->at[i].y, &b->radius[i]);
    if (got != 3) {
        fprintf(stderr, "bench_cost: %s: no settled discs\n", path);
        exit(2);
    }
    fclose(file);
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
    const dem2d_pair_desc pair = {KN, friction > 0 ? KN : 0, friction, 0, 0};
    check(dem2d_world_set_pair(b->world, b->material, b->material, &pair), "pair");
}

static void set_dashpot(bench *b, double damping_ratio) {
    const dem2d_pair_desc pair = {KN, 0, 0, damping_ratio, 0};
    check(dem2d_world_set_pair(b->world, b->material, b->material, &pair), "pair");
}

/* What is given at creation. */
static void describe(const char *feature, int state, dem2d_world_desc *desc) {
    static int one_by_one;
    if (strcmp(feature, "parallel_for") == 0 && state != ABSENT)
        desc->parallel_for = serial, desc->parallel_user = state == ON ? &one_by_one : NULL;
    if (strcmp(feature, "empty region") == 0) desc->skin = 1e-3; /* many lists */
    if (strcmp(feature, "ledger") == 0) desc->ledger = state == ON;
}

/* The right half moved away: by 0.5 m, by 1 km, not at all. */
static void shift_half(bench *b, int state) {
    const double by = state == ABSENT ? 0.5 : state == OFF ? 1000 : 0, middle = 0.5 * b->width;
    for (int i = 0; i < DISCS; i++)
        if (b->at[i].x > middle) b->at[i].x += by;
    b->width += by;
}

/* In rows: out of each other's reach; near, but apart, for polygons with bounding circles that
   overlap; touching. */
static void space_out(bench *b, int state, bool polygons) {
    const double near = polygons ? 0.998 : 1.02, touching = polygons ? 0.99 : 0.999;
    const double pitch = 0.05 * (state == ABSENT ? 1.4 : state == OFF ? near : touching);
    for (int i = 0; i < DISCS; i++) {
        b->at[i].x = pitch * (i % COLUMNS + 1), b->at[i].y = pitch * (i / COLUMNS + 1);
        b->radius[i] = 0.025;
    }
    b->width = pitch * (COLUMNS + 1), b->height = pitch * (DISCS / COLUMNS + 1);
}

static void place(bench *b, const char *feature, int state) {
    const bool polygons = strcmp(feature, "gaps of polygons") == 0;
    const bool still = polygons || strcmp(feature, "gaps of discs") == 0;
    if (strcmp(feature, "empty region") == 0) shift_half(b, state);
    if (still) space_out(b, state, polygons);
    for (int i = 0; i < 4; i++) add_wall(b, i, DEM2D_WALL_STILL);
    for (int i = 0; i < DISCS; i++) {
        dem2d_particle_desc d = disc_desc(b, b->at[i], b->radius[i]);
        d.velocity.x = uniform(-0.01, 0.01), d.velocity.y = uniform(-0.01, 0.01);
        if (strcmp(feature, "polygons") == 0 && state == ON && i % 10 == 0) d.shape = b->polygon;
        if (strcmp(feature, "fixed") == 0 && state == ON && i % 10 < 3) d.motion = DEM2D_FIXED;
        if (polygons) d.shape = b->polygon, d.angle = 3.14159265358979323846 / CORNERS;
        if (still || d.motion == DEM2D_FIXED) d.velocity.x = d.velocity.y = 0;
        check(dem2d_world_add_particle(b->world, &d, &b->ids[i]), "disc");
    }
}

static void add_polygon(bench *b) {
    dem2d_vec corners[CORNERS];
    dem2d_shape *shape;
    for (int i = 0; i < CORNERS; i++) {
        const dem2d_rot r = dem2d_rot_make(i * 6.283185307179586 / CORNERS);
        corners[i].x = r.c, corners[i].y = r.s;
    }
    check(dem2d_shape_create_polygon(NULL, corners, CORNERS, 0, &shape), "polygon");
    check(dem2d_world_add_shape(b->world, shape, &b->polygon), "polygon");
    dem2d_shape_destroy(shape);
}

/* Two that touch each other and, behind it, the lid; out of reach of all others. */
static void add_fixed_pair(bench *b) {
    for (int i = 0; i < 2; i++) {
        const dem2d_vec at = {0.5, b->height - 0.5 + 10 + 0.04 * i};
        dem2d_particle_desc d = disc_desc(b, at, 0.025);
        dem2d_particle_id id;
        d.motion = DEM2D_FIXED;
        check(dem2d_world_add_particle(b->world, &d, &id), "fixed pair");
    }
}

static void add_rough_material(bench *b) {
    const dem2d_material_desc rough = {DENSITY, KN, KN, 0.4, 0, 0};
    const dem2d_pair_desc pair = {KN, KN, 0.4, 0.1, 0.1};
    dem2d_material_id id;
    check(dem2d_world_add_material(b->world, &rough, &id), "material");
    check(dem2d_world_set_pair(b->world, id, id, &pair), "pair");
}

/* OFF: far below. ON: where the floor is. */
static void add_other_wall(bench *b, int state, bool segment) {
    dem2d_wall_desc desc = {0};
    dem2d_wall_id id;
    desc.material = b->material, desc.normal.y = 1, desc.point.y = state == OFF ? -1000 : 0;
    desc.segment = segment, desc.end.x = b->width, desc.end.y = desc.point.y;
    check(dem2d_world_add_wall(b->world, &desc, &id), "wall");
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
        check(dem2d_world_energy(b->world, &e), "energy");
    }
}

static void set_spin(bench *b, double spin) {
    for (int i = 0; i < DISCS; i++) {
        dem2d_particle_info p;
        check(dem2d_world_get_particle(b->world, b->ids[i], &p), "disc");
        check(dem2d_world_drive_particle(b->world, b->ids[i], p.motion, p.velocity, spin), "spin");
    }
}

/* What can be set: to something for a step, and then (OFF) back to 0. */
static void set_feature(bench *b, const char *feature, bool on) {
    const dem2d_vec gravity = {0, on ? -9.81 : 0};
    if (strcmp(feature, "friction") == 0) set_friction(b, on ? 0.4 : 0);
    if (strcmp(feature, "local damping") == 0)
        check(dem2d_world_set_damping(b->world, on ? 0.7 : 0, 0), "damping");
    if (strcmp(feature, "global damping") == 0)
        check(dem2d_world_set_damping(b->world, 0, on ? 1 : 0), "damping");
    if (strcmp(feature, "gravity") == 0)
        check(dem2d_world_set_gravity(b->world, gravity), "gravity");
    if (strcmp(feature, "spin") == 0) set_spin(b, on ? 1 : 0);
    if (strcmp(feature, "friction") == 0 && !on) set_spin(b, 0); /* a step of it made some */
}

/* bench_cost.sh has the instructions counted between the start and the end of this function, which
   is therefore not to be inlined or cloned. */
#if defined(__GNUC__)
__attribute__((noinline, noclone))
#endif
void measured(bench *b, int steps);

void measured(bench *b, int steps) {
    dem2d_energy e;
    dem2d_stress s;
    const int calls = b->ask ? steps : 1;
    for (int i = 0; i < calls; i++) {
        check(dem2d_world_step(b->world, steps / calls, NULL), "step");
        if (b->ask) check(dem2d_world_energy(b->world, &e), "energy");
        if (b->ask) check(dem2d_world_stress(b->world, 1, &s), "stress");
    }
}

int main(int count, char **arguments) {
    static bench b;
    if (count == 3 && strcmp(arguments[1], "settle") == 0) {
        settle(&b, arguments[2]);
        dem2d_world_destroy(b.world);
        return 0;
    }
    if (count != 5) {
        fprintf(stderr, "usage: bench_cost settle FILE | FILE FEATURE STATE STEPS\n");
        return 2;
    }
    const char *feature = arguments[2];
    const int state = atoi(arguments[3]), steps = atoi(arguments[4]);
    dem2d_world_desc desc = {0};
    dem2d_stats before, after;
    desc.time_step = 1e-4;
    describe(feature, state, &desc);
    make_world(&b, &desc);
    read_discs(&b, arguments[1]);
    if (strcmp(feature, "gaps of polygons") == 0) add_polygon(&b);
    if (strcmp(feature, "polygons") == 0 && state != ABSENT) add_polygon(&b);
    place(&b, feature, state);
    if (state != ABSENT) add_feature(&b, feature, state);
    if (state != ABSENT) set_feature(&b, feature, true);
    check(dem2d_world_step(b.world, 1, NULL), "step");
    if (state == OFF) set_feature(&b, feature, false);
    check(dem2d_world_step(b.world, 20, NULL), "step");
    check(dem2d_world_stats(b.world, &before), "stats");
    measured(&b, steps);
    check(dem2d_world_stats(b.world, &after), "stats");
    printf("%d %d %d\n", DISCS, after.contacts + after.wall_contacts,
           (int)(after.list_rebuilds - before.list_rebuilds));
    dem2d_world_destroy(b.world);
    return 0;
}
