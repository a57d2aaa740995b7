/* snapshot_scenes.h - small scenes for the tests, the fuzzing and the golden hashes of snapshots:
   the same numbers from any compiler, in C and C++. Include it after dem2d.h. */
#ifndef SNAPSHOT_SCENES_H
#define SNAPSHOT_SCENES_H

#include "row_law.h"
#include "world_scene.h"

enum {
    SCENE_CIRCLES,  /* no friction: nothing turns */
    SCENE_RUBBING,  /* circles of two materials with friction, local damping */
    SCENE_POLYGONS, /* sharp and rounded, two points where faces meet */
    SCENE_MIXED, /* all models, a custom one too; servo and moving walls, one driven, one fixed */
    SCENE_GJK,   /* all models by GJK and EPA, one point */
    /* these on a chain of segments, with a ledger: */
    SCENE_DASHED, /* circles with dashpots and rolling friction */
    SCENE_FULL,   /* as mixed, with both and two points where faces meet */
    SCENE_CHAIN,  /* polygons, springs and friction alone */
    SCENE_LAW,    /* all models by a caller's law */
    SCENE_COUNT
};

static const char *const scene_names[SCENE_COUNT] = {
    "circles", "rubbing", "polygons", "mixed", "gjk", "dashed", "full", "chain", "law"};

/* After so many steps of so many grains; see `make golden`. */
enum { GOLDEN_GRAINS = 20, GOLDEN_STEPS = 500 };
static const uint64_t golden_hashes[SCENE_COUNT] = {
    0x978d27efe8d66dccu, 0x1a12945416b0f5c7u, 0x0ff77ca7b0f895dau,
    0xb0f36d1e5fb45b54u, 0x4ada3d65586fb157u, 0x7beaf45e1d1faa01u,
    0x86a9357b0b21e465u, 0x4ddd5738239d1cc7u, 0x42b48a7b1329519du};

enum { SCENE_SHAPES = 8, SCENE_WALLS = 4, SCENE_LINKS = 3, SCENE_TAG = -7, SCENE_LAW_TAG = 12 };

typedef struct snapshot_scene {
    int kind;
    dem2d_world *world;
    dem2d_material_id stone, rubber;
    dem2d_shape_id shapes[SCENE_SHAPES];
    int shape_count;
    dem2d_wall_id walls[SCENE_WALLS], chain[SCENE_LINKS];
    uint64_t random;
} snapshot_scene;

static void scene_check(dem2d_result result) {
    expect_ok(result, "scene");
}

/* In [low, high): steps of 2^-30. Products here and in scene_stadium are exact, so that it does not
   matter whether a compiler fuses them with a sum. */
static double scene_random(snapshot_scene *s, double low, double high) {
    s->random = s->random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(s->random >> 34) / 1073741824.0);
}

/* A circle around a segment: a stadium, whose radius of curvature is that of its ends. */
static dem2d_vec scene_stadium(void *user, dem2d_vec u, double *rho) {
    const double *size = (const double *)user;
    dem2d_vec p;
    p.x = size[0] * u.x + (u.x >= 0 ? size[1] : -size[1]);
    p.y = size[0] * u.y;
    if (rho != NULL) *rho = size[0];
    return p;
}

static dem2d_custom_desc scene_custom_desc(void) {
    static double size[2] = {0.015625, 0.015};
    dem2d_custom_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.support = scene_stadium;
    desc.user = size;
    desc.inscribed = desc.rho_min = size[0];
    desc.outline_points = 200;
    desc.tag = SCENE_TAG;
    return desc;
}

/* A spring with a dashpot that may pull, friction, and a state that counts. Products are stored, so
   that no compiler fuses them with a sum. */
static void scene_law_row(void *user, const row_in *in, row_out *out) {
    volatile double spring = in->pair.normal_stiffness * in->depth;
    volatile double dashpot = 20 * (in->mass * in->approach);
    volatile double limit = in->pair.friction * spring;
    volatile double slid = in->pair.tangential_stiffness * (in->sliding * in->time_step);
    volatile double turn = 0.001 * (spring * in->spin) * in->radius;
    double shear = in->tangential_force - slid;
    (void)user;
    out->normal_force = spring + dashpot;
    out->tangential_force = shear > limit ? limit : shear < -limit ? -limit : shear;
    out->moment = -turn;
    out->energy = spring * in->depth / 2;
    out->state[0] = in->state[0] + 1;
    out->state[1] = shear;
}

static void scene_law(void *user, dem2d_law_batch *batch) {
    for_rows(user, batch, scene_law_row);
}

/* For dem2d_load_desc. */
static const dem2d_custom_desc *scene_custom(void *user, int tag) {
    dem2d_custom_desc *desc = (dem2d_custom_desc *)user;
    if (tag != SCENE_TAG) return NULL;
    *desc = scene_custom_desc();
    return desc;
}

static void scene_add_shape(snapshot_scene *s, dem2d_shape *shape) {
    scene_check(dem2d_world_add_shape(s->world, shape, &s->shapes[s->shape_count++]));
    dem2d_shape_destroy(shape);
}

static void scene_add_polygons(snapshot_scene *s) {
    static const dem2d_vec box[4] = {{0, 0}, {0.05, 0}, {0.05, 0.03}, {0, 0.03}};
    static const dem2d_vec kite[5] = {{0, 0}, {0.03, -0.01}, {0.05, 0.02}, {0.03, 0.04}, {0, 0.03}};
    static const dem2d_vec eight[8] = {{0.02, 0},    {0.03, 0},    {0.05, 0.02}, {0.05, 0.03},
                                       {0.03, 0.05}, {0.02, 0.05}, {0, 0.03},    {0, 0.02}};
    dem2d_shape *shape;
    scene_check(dem2d_shape_create_polygon(NULL, box, 4, 0, &shape));
    scene_add_shape(s, shape);
    scene_check(dem2d_shape_create_polygon(NULL, kite, 5, 0.004, &shape));
    scene_add_shape(s, shape);
    scene_check(dem2d_shape_create_polygon(NULL, eight, 8, 0, &shape));
    scene_add_shape(s, shape);
}

static void scene_add_shapes(snapshot_scene *s) {
    /* a rounded square with straight sides, and an oval */
    static const dem2d_vec square[24] = {
        {0.01, 0},    {0.02, 0},    {0.03, 0},    {0.04, 0},    {0.045, 0},    {0.05, 0.005},
        {0.05, 0.01}, {0.05, 0.02}, {0.05, 0.03}, {0.05, 0.04}, {0.05, 0.045}, {0.045, 0.05},
        {0.04, 0.05}, {0.03, 0.05}, {0.02, 0.05}, {0.01, 0.05}, {0.005, 0.05}, {0, 0.045},
        {0, 0.04},    {0, 0.03},    {0, 0.02},    {0, 0.01},    {0, 0.005},    {0.005, 0}};
    static const double a[5] = {0.06, 0, 0.002, 0.001, 0.0005}, b[5] = {0, 0, 0, 0.001, 0};
    dem2d_shape *shape;
    dem2d_custom_desc custom = scene_custom_desc();
    scene_check(dem2d_shape_create_circle(NULL, 0.025, &shape));
    scene_add_shape(s, shape);
    if (s->kind == SCENE_CIRCLES || s->kind == SCENE_RUBBING || s->kind == SCENE_DASHED) return;
    scene_add_polygons(s);
    if (s->kind == SCENE_POLYGONS || s->kind == SCENE_CHAIN) return;
    scene_check(dem2d_shape_create_ellipse(NULL, 0.035, 0.02, &shape));
    scene_add_shape(s, shape);
    scene_check(dem2d_shape_create_bezier(NULL, square, 8, &shape));
    scene_add_shape(s, shape);
    scene_check(dem2d_shape_create_fourier(NULL, a, b, 4, &shape));
    scene_add_shape(s, shape);
    scene_check(dem2d_shape_create_custom(NULL, &custom, &shape));
    scene_add_shape(s, shape);
}

static bool scene_driven(int kind) { /* walls and particles */
    return kind == SCENE_MIXED || kind == SCENE_FULL;
}

/* A floor with a valley and a crest, some of it from right to left. */
static void scene_add_chain(snapshot_scene *s, double width) {
    const double at[SCENE_LINKS + 1][2] = {
        {-0.125, 0}, {0.25 * width, -0.03125}, {0.625 * width, 0}, {width + 0.25, -0.03125}};
    for (int i = 0; i < SCENE_LINKS; i++) {
        const double *from = at[i == 1 ? i + 1 : i], *to = at[i == 1 ? i : i + 1];
        dem2d_wall_desc wall;
        memset(&wall, 0, sizeof wall);
        wall.material = i == 0 ? s->rubber : s->stone;
        wall.segment = true;
        wall.point.x = from[0], wall.point.y = from[1];
        wall.end.x = to[0], wall.end.y = to[1];
        if (scene_driven(s->kind) && i == 2) { /* away from its neighbour */
            wall.mode = DEM2D_WALL_MOVING;
            wall.velocity.x = 0.03125;
        }
        scene_check(dem2d_world_add_wall(s->world, &wall, &s->chain[i]));
    }
}

static void scene_add_walls(snapshot_scene *s, double width) {
    static const double normals[SCENE_WALLS][2] = {{0, 1}, {1, 0}, {-1, 0.125}, {0, -1}};
    for (int i = 0; i < SCENE_WALLS; i++) {
        dem2d_wall_desc wall;
        memset(&wall, 0, sizeof wall);
        wall.material = i == 0 ? s->rubber : s->stone;
        wall.normal.x = normals[i][0], wall.normal.y = normals[i][1];
        wall.point.x = i == 2 ? width : 0;
        if (i == 0 && s->kind >= SCENE_DASHED) wall.point.y = -0.25;
        if (i == 3) wall.point.y = 3 * width + 0.25;
        if (scene_driven(s->kind) && i == 2) {
            wall.mode = DEM2D_WALL_MOVING;
            wall.velocity.x = -0.05;
        }
        if (scene_driven(s->kind) && i == 3) {
            wall.mode = DEM2D_WALL_SERVO;
            wall.stress = 2000;
            wall.max_speed = 1;
            wall.spans[0] = s->walls[1];
            wall.spans[1] = s->walls[2];
        }
        scene_check(dem2d_world_add_wall(s->world, &wall, &s->walls[i]));
    }
    if (s->kind >= SCENE_DASHED) scene_add_chain(s, width);
}

static dem2d_particle_id scene_add_grain(snapshot_scene *s, int shape, double x, double y) {
    dem2d_particle_desc grain;
    dem2d_particle_id id;
    memset(&grain, 0, sizeof grain);
    grain.scale = scene_random(s, 0.75, 1.25);
    grain.shape = s->shapes[shape % s->shape_count];
    grain.material = shape % 3 == 2 ? s->rubber : s->stone;
    grain.position.x = x, grain.position.y = y;
    grain.angle = scene_random(s, -4, 4);
    grain.velocity.x = scene_random(s, -1, 1), grain.velocity.y = scene_random(s, -2, 0);
    if (s->kind != SCENE_CIRCLES) grain.angular_velocity = scene_random(s, -20, 20);
    scene_check(dem2d_world_add_particle(s->world, &grain, &id));
    return id;
}

PART dem2d_world_desc scene_desc(int kind) {
    dem2d_world_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.time_step = 1e-4;
    desc.gravity.y = -9.81;
    if (kind != SCENE_CIRCLES) desc.local_damping = 0.25;
    if (scene_driven(kind)) desc.global_damping = 0.5;
    desc.ledger = kind >= SCENE_DASHED;
    if (kind == SCENE_LAW) {
        desc.law = scene_law;
        desc.law_tag = SCENE_LAW_TAG;
    }
    if (kind == SCENE_GJK) {
        desc.faces = DEM2D_ONE_POINT;
        desc.solver = DEM2D_GJK_EPA;
    }
    return desc;
}

/* A falling heap of `count` grains; env, skin and threads as in desc. */
PART void scene_make(snapshot_scene *s, int kind, int count, const dem2d_world_desc *desc) {
    dem2d_material_desc stone = material_desc(2700, 1e6, 1e6, 0.5),
                        rubber = material_desc(1000, 2e5, 1e5, 0.8);
    int columns = 3;
    memset(s, 0, sizeof *s);
    s->kind = kind;
    s->random = 1;
    scene_check(dem2d_world_create(desc, &s->world));
    if (kind == SCENE_CIRCLES) stone.friction = rubber.friction = 0;
    if (kind == SCENE_DASHED || kind == SCENE_FULL) {
        stone.damping_ratio = 0.125, rubber.damping_ratio = 0.5;
        stone.rolling_friction = 0.0625, rubber.rolling_friction = 0.25;
    }
    scene_check(dem2d_world_add_material(s->world, &stone, &s->stone));
    scene_check(dem2d_world_add_material(s->world, &rubber, &s->rubber));
    scene_add_shapes(s);
    while (columns * columns < count) columns++;
    scene_add_walls(s, 0.0625 * columns);
    for (int i = 0; i < count; i++)
        (void)scene_add_grain(s, i, 0.03125 + 0.0625 * (i % columns),
                              0.03125 + 0.0625 * (double)(i / columns));
    if (scene_driven(kind) && count > 4) {
        dem2d_particle_id id = {3, 1};
        dem2d_vec none = {0, 0}, up = {0.1, 0.2};
        scene_check(dem2d_world_drive_particle(s->world, id, DEM2D_FIXED, none, 0));
        id.index = 4;
        scene_check(dem2d_world_drive_particle(s->world, id, DEM2D_DRIVEN, up, 3));
    }
}

/* --- snapshots in memory ---------------------------------------------------------------------- */

/* custom gets room for the answer of scene_custom. */
PART dem2d_load_desc scene_load_desc(scene_bytes *bytes, dem2d_custom_desc *custom) {
    dem2d_load_desc desc;
    memset(&desc, 0, sizeof desc);
    bytes->next = 0;
    desc.read = scene_read;
    desc.user = bytes;
    desc.custom = scene_custom;
    desc.custom_user = custom;
    desc.law = scene_law;
    desc.law_tag = SCENE_LAW_TAG;
    return desc;
}

#endif
