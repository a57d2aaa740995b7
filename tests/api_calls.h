/* api_calls.h - every public function that returns a result, as a table: how it is called with good
   arguments, and what each argument may be. Tests walk the table; a new function needs a row at the
   end. Include it after testing.h and fingerprint.h. */
#ifndef API_CALLS_H
#define API_CALLS_H

#include "row_law.h"

#include <float.h>
#include <limits.h>

/* --- what an argument or field may be -------------------------------------------------------- */

typedef enum kind {
    POINTER,   /* not NULL */
    OPTIONAL,  /* a pointer, or NULL */
    NUMBER,    /* a finite double from low to high */
    SIZE,      /* above 0 and with a mass; 0 is ZERO_AREA */
    LEADING,   /* a0 of a series: as SIZE, and negative is ZERO_AREA too */
    UNREAD,    /* a double of any value, NaN too */
    VECTOR,    /* finite */
    DIRECTION, /* finite, not 0 */
    UPPER,     /* finite, above the box's lower corner */
    ELSEWHERE, /* finite, not the wall's point */
    POSE,      /* finite, rotation not 0, scale above 0 */
    INTEGER,   /* an int or an enum from low to high, else `result` */
    SHAPE_ID,  /* of the world */
    MATERIAL_ID,
    PARTICLE_ID,
    WALL_ID,
    SPAN_ID,   /* of a wall; generation 0 in both: none */
    FILE_NAME, /* not NULL, no control bytes */
    COLUMN,    /* not NULL, no comma, quote or line end */
    ANYTHING   /* nothing is wrong with any value */
} kind;

typedef struct row {
    const char *name; /* as the log says it */
    size_t offset;    /* in the desc, or in args */
    kind kind;
    dem2d_result result; /* of INTEGER */
    double low, high;
    bool above, below, or_0; /* low and high are wrong; 0 is right */
} row;

/* Kinds of numbers. */
#define FINITE NUMBER, .low = -DBL_MAX, .high = DBL_MAX
#define POSITIVE NUMBER, .high = DBL_MAX, .above = true
#define NOT_NEGATIVE NUMBER, .high = DBL_MAX
#define FRACTION NUMBER, .high = 1, .below = true
#define PORTION NUMBER, .high = 1, .above = true
#define ANGLE NUMBER, .low = -0x1p30, .high = 0x1p30

enum { LAW_TAG = 5 }; /* of the world that is loaded */

/* Descs: their fields are in the tables of dem2d.h. */
enum {
    NO_DESC = -1,
    CUSTOM,
    REDUCTION,
    IMAGE,
    FIT,
    VIRTUAL,
    CONTACT,
    WORLD,
    MATERIAL,
    PAIR,
    PARTICLE,
    WALL,
    SAVE,
    LOAD,
    SVG,
    VTP,
    PVD,
    CSV,
    SEGMENT, /* dem2d_wall_desc once more */
    QUERY,
    GRID,
    GRADING,
    DRAW,
    FILL,
    INLET,
    DEFORMATION,
    GROWTH,
    DESCS
};

/* --- a world to call them on ----------------------------------------------------------------- */

/* Ids that name nothing in the world: 0, of what was removed, of a slot that was taken again, of a
   slot that never was, of another world. */
enum { STALE = 5 };

enum { SEGMENTS = 2 };

/* A snapshot in memory. */
typedef struct store {
    char *bytes;
    size_t size, next;
} store;

typedef struct fixture {
    test_env env; /* of the world and of what is called; the fixture must not be moved */
    dem2d_world *world;
    dem2d_shape *ellipse, *polygon;
    dem2d_outline_set *set;
    dem2d_grid *grid;
    dem2d_shape_id shape, spare_shape, stale_shapes[STALE];
    dem2d_material_id materials[2], stale_materials[STALE];
    dem2d_particle_id particle, stale_particles[STALE];
    dem2d_wall_id walls[4 + SEGMENTS]; /* floor, left, right, lid; two that are joined */
    dem2d_wall_id free_wall, stale_walls[STALE];
    store snapshot;           /* of another world */
    dem2d_custom_desc custom; /* room for what is found by a tag */
    void (*within)(struct fixture *f); /* called at the start of each step, or NULL */
} fixture;

static void fixture_loads(void *user, dem2d_world *world) {
    fixture *f = user;
    (void)world;
    if (f->within != NULL) f->within(f);
}

static const uint8_t pixels[8 * 8] = {/* one grain of 4 x 5 */
                                      255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 9,
                                      9,   9,   9,   255, 255, 255, 255, 9,   9,   9,   9,
                                      255, 255, 255, 255, 9,   9,   9,   9,   255, 255, 255,
                                      255, 9,   9,   9,   9,   255, 255, 255, 255, 9,   9,
                                      9,   9,   255, 255, 255, 255, 255, 255, 255, 255, 255,
                                      255, 255, 255, 255, 255, 255, 255, 255, 255};

static const dem2d_vec five_corners[5] = {
    {-0.9, -0.6}, {0.7, -0.8}, {1.1, 0.1}, {0.4, 0.9}, {-0.6, 0.7}};

static dem2d_image_desc good_image(void) {
    dem2d_image_desc d = {0};
    d.pixels = pixels, d.width = d.height = 8, d.scale = 1;
    return d;
}

static dem2d_world_desc good_world(const dem2d_env *env) {
    dem2d_world_desc d = {0};
    d.time_step = 1e-4, d.gravity = vec(0, -9.81), d.local_damping = 0.1, d.env = env;
    d.event_capacity = 50;
    return d;
}

static dem2d_particle_desc good_particle(const fixture *f) {
    dem2d_particle_desc d = {0};
    d.scale = 0.04, d.shape = f->shape, d.material = f->materials[0], d.angle = 0.3;
    d.position = vec(0.05, 0.05);
    return d;
}

static dem2d_wall_desc good_wall(const fixture *f) {
    dem2d_wall_desc d = {0};
    d.length = 1, d.mode = DEM2D_WALL_SERVO, d.material = f->materials[1];
    d.point = vec(0, 5), d.normal = vec(0, -1), d.stress = 100, d.max_speed = 0.1;
    return d;
}

static const dem2d_material_desc good_material = {
    .density = 2700, .normal_stiffness = 1e6, .tangential_stiffness = 5e5, .friction = 0.4};

/* With all that the full law has. */
static const dem2d_material_desc full_material = {.density = 2700,
                                                  .normal_stiffness = 1e6,
                                                  .tangential_stiffness = 5e5,
                                                  .friction = 0.4,
                                                  .damping_ratio = 0.1,
                                                  .rolling_friction = 0.05};

static void fixture_shapes(fixture *f) {
    dem2d_shape *circle;
    dem2d_shape_id id;
    assert_ok(dem2d_shape_create_circle(&f->env.env, 1, &circle));
    assert_ok(dem2d_world_add_shape(f->world, circle, &f->shape));
    assert_ok(dem2d_world_add_shape(f->world, f->ellipse, &id));
    assert_ok(dem2d_world_add_shape(f->world, f->polygon, &id));
    assert_ok(dem2d_world_add_shape(f->world, circle, &f->stale_shapes[1]));
    assert_ok(dem2d_world_add_shape(f->world, circle, &f->stale_shapes[2]));
    assert_ok(dem2d_world_remove_shape(f->world, f->stale_shapes[2]));
    assert_ok(dem2d_world_add_shape(f->world, circle, &f->spare_shape)); /* in its slot */
    assert_ok(dem2d_world_remove_shape(f->world, f->stale_shapes[1]));
    dem2d_shape_destroy(circle);
}

static void fixture_walls(fixture *f) {
    static const double at[4][4] = {{0, 0, 0, 1}, {0, 0, 1, 0}, {0.4, 0, -1, 0}, {0, 0.4, 0, -1}};
    for (int i = 0; i < 4; i++) {
        dem2d_wall_desc d = good_wall(f);
        d.mode = DEM2D_WALL_STILL;
        d.point = vec(at[i][0], at[i][1]), d.normal = vec(at[i][2], at[i][3]);
        if (i == 3) {
            d.mode = DEM2D_WALL_SERVO;
            d.spans[0] = f->walls[1], d.spans[1] = f->walls[2];
        }
        assert_ok(dem2d_world_add_wall(f->world, &d, &f->walls[i]));
    }
    static const dem2d_vec roof[SEGMENTS + 1] = {{0.13, 0.1}, {0.2, 0.16}, {0.27, 0.1}};
    for (int i = 0; i < SEGMENTS; i++) {
        dem2d_wall_desc d = {0};
        d.material = f->materials[i], d.segment = true, d.point = roof[i], d.end = roof[i + 1];
        assert_ok(dem2d_world_add_wall(f->world, &d, &f->walls[4 + i]));
    }
    dem2d_wall_desc d = good_wall(f);
    assert_ok(dem2d_world_add_wall(f->world, &d, &f->stale_walls[1]));
    assert_ok(dem2d_world_add_wall(f->world, &d, &f->stale_walls[2]));
    assert_ok(dem2d_world_remove_wall(f->world, f->stale_walls[2]));
    assert_ok(dem2d_world_add_wall(f->world, &d, &f->free_wall));
    assert_ok(dem2d_world_remove_wall(f->world, f->stale_walls[1]));
}

static void fixture_particles(fixture *f) {
    dem2d_particle_id id;
    for (int i = 0; i < 16; i++) {
        dem2d_particle_desc d = good_particle(f);
        d.shape.index = (uint32_t)(i % 3); /* circle, ellipse, polygon, all of generation 1 */
        d.position = vec(0.05 + 0.07 * (i % 4), 0.04 + 0.07 * (i / 4));
        d.angle = i, d.velocity = vec(0.1 * (i % 3) - 0.1, 0.05 * (i % 2));
        d.material = f->materials[i % 2];
        assert_ok(dem2d_world_add_particle(f->world, &d, &id));
        if (i == 5) f->particle = id;
        if (i == 7) f->stale_particles[1] = id;
        if (i == 9) f->stale_particles[2] = id;
    }
    dem2d_particle_desc d = good_particle(f);
    assert_ok(dem2d_world_remove_particle(f->world, f->stale_particles[2]));
    d.position = vec(0.12, 0.36);
    assert_ok(dem2d_world_add_particle(f->world, &d, &id)); /* in its slot */
    assert_ok(dem2d_world_remove_particle(f->world, f->stale_particles[1]));
}

/* Ids of another world whose slots have been used more often. */
static void fixture_strangers(fixture *f, int last) {
    const dem2d_world_desc d = good_world(NULL);
    const dem2d_wall_desc wall = good_wall(f);
    dem2d_particle_desc grain = good_particle(f);
    dem2d_world *other;
    assert_ok(dem2d_world_create(&d, &other));
    for (int i = 0; i < 4; i++)
        assert_ok(dem2d_world_add_material(other, &good_material, &f->stale_materials[last]));
    for (int i = 0; i < 9; i++) {
        assert_ok(dem2d_world_add_shape(other, f->ellipse, &f->stale_shapes[last]));
        grain.shape = f->stale_shapes[last];
        assert_ok(dem2d_world_add_particle(other, &grain, &f->stale_particles[last]));
        assert_ok(dem2d_world_add_wall(other, &wall, &f->stale_walls[last]));
        assert_ok(dem2d_world_remove_particle(other, f->stale_particles[last]));
        assert_ok(dem2d_world_remove_shape(other, f->stale_shapes[last]));
        assert_ok(dem2d_world_remove_wall(other, f->stale_walls[last]));
    }
    dem2d_world_destroy(other);
}

static void fixture_stale(fixture *f) {
    const dem2d_shape_id no_shape = {UINT32_MAX, 1};
    const dem2d_particle_id no_particle = {UINT32_MAX, 1};
    const dem2d_wall_id no_wall = {UINT32_MAX, 1};
    f->stale_materials[1] = (dem2d_material_id){0, 2};
    f->stale_materials[2] = (dem2d_material_id){1, UINT32_MAX};
    f->stale_materials[3] = (dem2d_material_id){UINT32_MAX, 1};
    f->stale_shapes[3] = no_shape, f->stale_particles[3] = no_particle;
    f->stale_walls[3] = no_wall;
    fixture_strangers(f, 4);
}

static dem2d_grid_desc good_grid(void) {
    dem2d_grid_desc d = {0};
    d.nx = 3, d.ny = 2, d.box.lower = vec(0.05, 0.02), d.box.upper = vec(0.4, 0.3);
    d.width_x = 0.1, d.width_y = 0.05;
    return d;
}

/* A box of grains of three shapes with the full law, a ledger, two segments and a grid, after `steps`
   steps. Two of them hold the same to the bit. */
static void fixture_make(fixture *f, int steps) {
    memset(f, 0, sizeof *f);
    test_env_init(&f->env);
    dem2d_world_desc d = good_world(&f->env.env);
    const dem2d_image_desc image = good_image();
    d.ledger = true;
    d.loads = fixture_loads, d.loads_user = f;
    assert_ok(dem2d_shape_create_ellipse(&f->env.env, 1.2, 0.8, &f->ellipse));
    assert_ok(dem2d_shape_create_polygon(&f->env.env, five_corners, 5, 0, &f->polygon));
    assert_ok(dem2d_image_outlines(&f->env.env, &image, &f->set));
    assert_ok(dem2d_world_create(&d, &f->world));
    for (int i = 0; i < 2; i++)
        assert_ok(dem2d_world_add_material(f->world, i == 0 ? &good_material : &full_material,
                                           &f->materials[i]));
    fixture_shapes(f);
    fixture_walls(f);
    fixture_particles(f);
    fixture_stale(f);
    assert_ok(dem2d_world_step(f->world, steps, NULL));
    const dem2d_grid_desc grid = good_grid();
    assert_ok(dem2d_grid_create(&f->env.env, &grid, &f->grid));
    assert_ok(dem2d_grid_add(f->grid, f->world, 1));
    test_log_clear(&f->env);
}

static fingerprint fixture_print(const fixture *f) {
    return fingerprint_take(f->world, f->walls, COUNT_OF(f->walls));
}

static void fixture_end(fixture *f) {
    dem2d_grid_destroy(f->grid);
    dem2d_world_destroy(f->world);
    dem2d_shape_destroy(f->ellipse);
    dem2d_shape_destroy(f->polygon);
    dem2d_outline_set_destroy(f->set);
    free(f->snapshot.bytes);
    assert_clean(&f->env);
}

/* --- arguments ------------------------------------------------------------------------------- */

/* Room for any output, or for arrays of them; aligned. */
typedef union output {
    double align;
    unsigned char bytes[4096];
} output;

enum { NAMED = 2 }; /* columns of a history, files of a series */

typedef struct args {
    const dem2d_env *env;
    dem2d_world *world;
    dem2d_grid *grid;
    const dem2d_shape *shape, *other;
    const dem2d_outline_set *set;
    const void *desc;
    const dem2d_vec *points, *others;
    const dem2d_box *region;
    store *snapshot; /* that is read */
    double *a, *b;   /* of a series; fourier_reduce writes them */
    void *out, *second, *third;
    const dem2d_body *bodies;
    const dem2d_body_pair *pairs;
    dem2d_body two[2];
    dem2d_body_pair one;
    dem2d_pose pose, pose_b;
    dem2d_vec vector, direction;
    double x, y;
    int count, number;
    dem2d_motion motion;
    dem2d_shape_id shape_id;
    dem2d_material_id material, material_b;
    dem2d_particle_id particle;
    dem2d_wall_id wall;
    dem2d_groups groups;
    /* what some of the pointers point to */
    union {
        dem2d_custom_desc custom;
        dem2d_reduction_desc reduction;
        dem2d_image_desc image;
        dem2d_fit_desc fit;
        dem2d_virtual_desc virtual_grain;
        dem2d_contact_desc contact;
        dem2d_world_desc world;
        dem2d_material_desc material;
        dem2d_pair_desc pair;
        dem2d_particle_desc particle;
        dem2d_wall_desc wall;
        dem2d_save_desc save;
        dem2d_load_desc load;
        dem2d_svg_desc svg;
        dem2d_vtp_desc vtp;
        dem2d_pvd_desc pvd;
        dem2d_csv_desc csv;
        dem2d_stress stress;
        dem2d_query_desc query;
        dem2d_grid_desc grid;
        dem2d_grading_desc grading;
        dem2d_draw_desc draw;
        dem2d_fill_desc fill;
        dem2d_inlet_desc inlet;
        dem2d_deformation_desc deformation;
        dem2d_growth_desc growth;
        dem2d_particle_arrays particles;
        dem2d_contact_arrays contacts;
    } d;
    dem2d_box box;
    dem2d_grading_desc grading; /* of a sample */
    dem2d_grain_kind kind;
    dem2d_grade curve[2];
    const dem2d_region *where;
    dem2d_region area;
    dem2d_inlet *state, inlet;
    const char *names[NAMED];
    double values[NAMED];
    dem2d_vec p[12], q[5];
    double series_a[8], series_b[8];
    uint64_t hash;
    output outputs[3];
} args;

/* Outputs hold a number that any arithmetic on it would change. */
static void args_fill(args *a) {
    for (int i = 0; i < 3; i++)
        for (size_t k = 0; k < sizeof a->outputs[i] / sizeof(double); k++)
            ((double *)(void *)&a->outputs[i])[k] = 0.7;
}

static void args_make(args *a, fixture *f) {
    memset(a, 0, sizeof *a);
    a->env = &f->env.env, a->world = f->world, a->grid = f->grid, a->shape = f->ellipse,
    a->other = f->polygon;
    a->set = f->set, a->desc = &a->d, a->points = a->p, a->others = a->q;
    a->a = a->series_a, a->b = a->series_b;
    a->out = &a->outputs[0], a->second = &a->outputs[1], a->third = &a->outputs[2];
    a->pose = dem2d_pose_make(0.1, 0.2, 0.3, 1.5);
    a->pose_b = dem2d_pose_make(1.1, 0.9, -0.3, 1);
    a->vector = vec(0.1, 0.2), a->direction = vec(0, 1), a->x = 0.5, a->y = 0.5;
    a->count = 5, a->number = 5;
    a->shape_id = f->spare_shape, a->particle = f->particle, a->wall = f->free_wall;
    a->material = f->materials[0], a->material_b = f->materials[1];
    a->groups.category = 2, a->hash = 7;
    memcpy(a->p, five_corners, sizeof five_corners);
    for (int i = 0; i < 5; i++) a->q[i] = vec(1.1 * a->p[i].x + 0.1, 0.9 * a->p[i].y);
    a->series_a[0] = 2, a->series_a[2] = 0.1, a->series_b[3] = 0.05; /* order 3 or more */
    a->region = &a->box, a->box.lower = vec(0.05, 0.02), a->box.upper = vec(0.3, 0.31);
    for (int i = 0; i < NAMED; i++) a->names[i] = i == 0 ? "one" : "two", a->values[i] = i;
    args_fill(a);
}

static dem2d_vec round_support(void *user, dem2d_vec u, double *rho) {
    (void)user;
    if (rho) *rho = 1;
    return u;
}

static void with_control(args *a, fixture *f) { /* a circle of four arcs */
    static const int axis[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    const double handle = 0.5522847498;
    (void)f;
    for (int i = 0; i < 4; i++) {
        const int *p = axis[i], *q = axis[(i + 1) % 4];
        a->p[3 * i] = vec(p[0], p[1]);
        a->p[3 * i + 1] = vec(p[0] + handle * q[0], p[1] + handle * q[1]);
        a->p[3 * i + 2] = vec(q[0] + handle * p[0], q[1] + handle * p[1]);
    }
    a->count = 4;
}
static void with_custom(args *a, fixture *f) {
    (void)f;
    a->d.custom.support = round_support, a->d.custom.mass.area = (double)TEST_PI;
    a->d.custom.mass.polar_moment = (double)TEST_PI / 2;
}
static void with_first(args *a, fixture *f) { /* of a set, of a wall's parts */
    (void)f;
    a->count = 0;
}
static void with_floor(args *a, fixture *f) { /* no servo wall */
    a->wall = f->walls[0];
}
static void with_samples(args *a, fixture *f) {
    (void)f;
    a->number = 12;
}
static void with_image(args *a, fixture *f) {
    (void)f;
    a->d.image = good_image();
}
static void with_fit(args *a, fixture *f) {
    (void)f;
    a->d.fit.model = DEM2D_FOURIER, a->d.fit.count = 4, a->d.fit.method = DEM2D_FIT_REDUCTION;
}
static void with_virtual(args *a, fixture *f) {
    (void)f;
    a->d.virtual_grain.radius = 1, a->d.virtual_grain.elongation = 0.1;
}
static void with_nothing(args *a, fixture *f) { /* contact, reduction: all 0 */
    (void)a;
    (void)f;
}
static void with_bodies(args *a, fixture *f) {
    (void)f;
    a->bodies = a->two, a->pairs = &a->one, a->count = 2, a->number = 1;
    a->two[0].shape = a->shape, a->two[0].pose = a->pose;
    a->two[1].shape = a->other, a->two[1].pose = a->pose_b;
    a->one.b = 1;
}
static void with_world(args *a, fixture *f) {
    a->d.world = good_world(&f->env.env);
}
static void with_material(args *a, fixture *f) {
    (void)f;
    a->d.material = good_material;
}
static void with_pair(args *a, fixture *f) {
    (void)f;
    a->d.pair.normal_stiffness = 1e6, a->d.pair.friction = 0.2;
}
static void with_particle(args *a, fixture *f) {
    a->d.particle = good_particle(f);
}
static void with_wall(args *a, fixture *f) {
    a->d.wall = good_wall(f);
}
static void with_segment(args *a, fixture *f) {
    a->d.wall = good_wall(f), a->d.wall.segment = true, a->d.wall.end = vec(0.4, 5.1);
}
static void with_svg(args *a, fixture *f) {
    (void)f;
    a->d.svg.write = fingerprint_hash, a->d.svg.user = &a->hash;
}
static void with_vtp(args *a, fixture *f) {
    (void)f;
    a->d.vtp.write = fingerprint_hash, a->d.vtp.user = &a->hash;
}
static void with_pvd(args *a, fixture *f) {
    (void)f;
    a->d.pvd.count = NAMED, a->d.pvd.files = a->names, a->d.pvd.times = a->values;
    a->d.pvd.write = fingerprint_hash, a->d.pvd.user = &a->hash;
}
static void with_csv(args *a, fixture *f) {
    (void)f;
    a->d.csv.count = NAMED, a->d.csv.names = a->names, a->d.csv.values = a->values;
    a->d.csv.write = fingerprint_hash, a->d.csv.user = &a->hash;
}
static void with_stress(args *a, fixture *f) {
    const dem2d_stress stress = {3, 1, 2, -1};
    (void)f;
    a->d.stress = stress;
}
static void with_particles(args *a, fixture *f) { /* read */
    (void)f;
    a->d.particles.positions = (dem2d_vec *)a->out;
    a->d.particles.forces = (dem2d_vec *)a->second;
}
static void with_rows(args *a, fixture *f) { /* written */
    (void)f;
    a->d.particles.ids = &a->particle, a->count = 1;
    a->d.particles.positions = a->p, a->d.particles.loads = a->q;
}
static void with_contacts(args *a, fixture *f) {
    (void)f;
    a->d.contacts.points = (dem2d_vec *)a->out;
    a->d.contacts.depths = (double *)a->second;
}
static void with_grid(args *a, fixture *f) {
    (void)f;
    a->d.grid = good_grid();
}
static void with_grading(args *a, fixture *f) { /* small grains of one kind */
    a->kind.share = 1, a->kind.grain = good_particle(f);
    a->curve[0].size = 0.003, a->curve[1].size = 0.006, a->curve[1].passing = 1;
    a->d.grading.points = a->curve, a->d.grading.point_count = 2;
    a->d.grading.kinds = &a->kind, a->d.grading.kind_count = 1;
}
static void with_draw(args *a, fixture *f) {
    with_grading(a, f);
    a->grading = a->d.grading;
    memset(&a->d, 0, sizeof a->d);
    a->d.draw.grading = &a->grading, a->d.draw.count = 5;
}
static void with_fill(args *a, fixture *f) { /* between the grains that are there */
    with_draw(a, f);
    memset(&a->d, 0, sizeof a->d);
    a->d.fill.grading = &a->grading, a->d.fill.count = 5, a->d.fill.method = DEM2D_FILL_RANDOM;
    a->d.fill.region.box = a->box;
}
static void with_inlet(args *a, fixture *f) {
    with_draw(a, f);
    memset(&a->d, 0, sizeof a->d);
    a->d.inlet.grading = &a->grading, a->d.inlet.number_rate = 10;
    a->d.inlet.region.box = a->box, a->state = &a->inlet;
}
static void with_growth(args *a, fixture *f) { /* of 0 steps: others fail half way */
    (void)f;
    a->d.growth.area = 1, a->d.growth.stress = 100, a->count = 0;
}
static void with_where(args *a, fixture *f) {
    (void)f;
    a->where = &a->area, a->area.box = a->box;
}
static void with_measure(args *a, fixture *f) {
    (void)f;
    a->number = DEM2D_MEASURE_AREA;
}
static dem2d_result draw_of(const dem2d_world *world, const void *grading, args *a) {
    dem2d_draw_desc draw = {0};
    draw.grading = grading, draw.count = 5;
    return dem2d_world_draw(world, &draw, (dem2d_particle_desc *)a->out, 5, (int *)a->second);
}
static void with_deformation(args *a, fixture *f) { /* none: the world has no cell */
    (void)f;
    memset(&a->d.deformation, 0, sizeof a->d.deformation);
}
static void with_save(args *a, fixture *f) {
    (void)f;
    a->d.save.write = fingerprint_hash, a->d.save.user = &a->hash;
}

/* --- a snapshot to load ---------------------------------------------------------------------- */

static bool store_write(void *user, const char *bytes, size_t count) {
    store *to = user;
    to->bytes = realloc(to->bytes, to->size + count);
    if (!to->bytes) abort();
    memcpy(to->bytes + to->size, bytes, count);
    to->size += count;
    return true;
}

static bool store_read(void *user, char *bytes, size_t count) {
    store *from = user;
    if (count > from->size - from->next) return false;
    memcpy(bytes, from->bytes + from->next, count);
    from->next += count;
    return true;
}

static const dem2d_custom_desc *find_custom(void *user, int tag) {
    dem2d_custom_desc *desc = user;
    if (tag != LAW_TAG) return NULL;
    desc->support = round_support;
    return desc;
}

static void soft_law_row(void *user, const row_in *in, row_out *out) {
    (void)user;
    out->normal_force = in->pair.normal_stiffness * in->depth;
    out->tangential_force = 1e-3 * out->normal_force, out->state[0] += 1;
}

static void soft_law(void *user, dem2d_law_batch *batch) {
    for_rows(user, batch, soft_law_row);
}

static void with_load(args *a, fixture *f) { /* two round grains in contact, by a law */
    dem2d_world_desc d = good_world(NULL);
    const dem2d_save_desc save = {.write = store_write, .user = &f->snapshot};
    dem2d_custom_desc custom = {0};
    dem2d_particle_desc grain = good_particle(f);
    dem2d_particle_id id;
    dem2d_world *world;
    dem2d_shape *shape;
    d.law = soft_law, d.law_tag = custom.tag = LAW_TAG, d.ledger = true;
    custom.support = round_support;
    assert_ok(dem2d_world_create(&d, &world));
    assert_ok(dem2d_world_add_material(world, &full_material, &grain.material));
    assert_ok(dem2d_shape_create_custom(NULL, &custom, &shape));
    assert_ok(dem2d_world_add_shape(world, shape, &grain.shape));
    dem2d_shape_destroy(shape);
    for (int i = 0; i < 2; i++) {
        grain.position = vec(0.0799 * i, 0);
        assert_ok(dem2d_world_add_particle(world, &grain, &id));
    }
    assert_ok(dem2d_world_step(world, 3, NULL));
    assert_ok(dem2d_world_save(world, &save, NULL));
    dem2d_world_destroy(world);
    a->snapshot = &f->snapshot;
    a->d.load.read = store_read, a->d.load.user = &f->snapshot;
    a->d.load.custom = find_custom, a->d.load.custom_user = &f->custom;
    a->d.load.law = soft_law, a->d.load.law_tag = LAW_TAG, a->d.load.env = &f->env.env;
}

/* What a call made, when it went well. */
static void free_shape(args *v) {
    dem2d_shape_destroy(*(dem2d_shape **)v->out);
}
static void free_set(args *v) {
    dem2d_outline_set_destroy(*(dem2d_outline_set **)v->out);
}
static void free_grid(args *v) {
    dem2d_grid_destroy(*(dem2d_grid **)v->out);
}
static void free_world(args *v) {
    dem2d_world_destroy(*(dem2d_world **)v->out);
}

/* --- the functions --------------------------------------------------------------------------- */

#define ARG(member, text, ...) \
    { .name = text, .offset = offsetof(args, member), .kind = __VA_ARGS__ }
#define ARG_INT(member, text, least, most, ...) \
    ARG(member, text, INTEGER, .low = least, .high = most, .result = DEM2D_##__VA_ARGS__)
#define POINTS(member, name) \
    ARG(member[0], name, VECTOR), ARG(member[3], name, VECTOR), ARG(member[4], name, VECTOR)
#define OUT ARG(out, "out", POINTER)
#define SECOND ARG(second, "second output", POINTER)
#define IN_WORLD ARG(world, "world", POINTER)
#define IN_GRID ARG(grid, "grid", POINTER)
#define ENV ARG(env, "env", OPTIONAL)
#define THE_DESC ARG(desc, "desc", POINTER)
#define THREE_POINTS                                                                      \
    ARG(points, "points", POINTER), ARG_INT(count, "points", 3, INT_MAX, TOO_FEW_POINTS), \
        POINTS(p, "points[")
#define SERIES                                                                     \
    ARG(a, "a", POINTER), ARG(b, "b", POINTER), ARG(series_a[0], "a[0]", LEADING), \
        ARG(series_a[2], "a[2]", FINITE), ARG(series_b[3], "b[3]", FINITE),        \
        ARG(series_b[0], "b[0]", UNREAD), ARG_INT(count, "order", 0, 1 << 20, OUT_OF_RANGE)
#define PAIR_ARGS                                                                \
    ARG(shape, "a", POINTER), ARG(other, "b", POINTER), ARG(pose, "pose", POSE), \
        ARG(pose_b, "pose", POSE), ARG(desc, "desc", OPTIONAL), OUT

#define CAPACITY ARG_INT(count, "capacity", 0, INT_MAX, OUT_OF_RANGE)
#define FOUND ARG(desc, "desc", OPTIONAL), OUT, CAPACITY, SECOND
#define RAY                                                                \
    ARG(vector, "origin", VECTOR), ARG(direction, "direction", DIRECTION), \
        ARG(x, "length", NOT_NEGATIVE)

#define NAMES(kind, text, numbers)                                                                 \
    ARG(names[0], text, kind), ARG(names[NAMED - 1], text, kind), ARG(values[0], numbers, FINITE), \
        ARG(values[NAMED - 1], numbers, FINITE)

typedef struct function {
    const char *name; /* without dem2d_ */
    dem2d_result (*call)(args *v);
    int desc;                             /* its desc, or NO_DESC */
    void (*prepare)(args *v, fixture *f); /* beyond args_make */
    void (*release)(args *v);             /* of what it made, or NULL */
    bool logs;                            /* has an environment and names what is wrong */
    const row *rows;                      /* its arguments */
    int count;
} function;

/* desc, prepare, release, logs */
#define PLAIN NO_DESC, with_nothing, NULL, false
#define LOGS NO_DESC, with_nothing, NULL, true
#define MAKES(desc, prepare, release) desc, prepare, release, true
#define DESCRIBED(desc, prepare) desc, prepare, NULL, true
#define SILENT(desc, prepare) desc, prepare, NULL, false

/* One row for each: F(name, call, one of those above, arguments...). */
/* clang-format off */
#define FUNCTIONS(F) \
    F(shape_create_circle, dem2d_shape_create_circle(v->env, v->x, v->out),                       \
      MAKES(NO_DESC, with_nothing, free_shape), ENV, ARG(x, "radius", SIZE), OUT)                 \
    F(shape_create_ellipse, dem2d_shape_create_ellipse(v->env, v->x, v->y, v->out),               \
      MAKES(NO_DESC, with_nothing, free_shape), ENV, ARG(x, "a", SIZE), ARG(y, "b", SIZE), OUT)   \
    F(shape_create_polygon,                                                                       \
      dem2d_shape_create_polygon(v->env, v->points, v->count, v->x, v->out),                      \
      MAKES(NO_DESC, with_nothing, free_shape), ENV, THREE_POINTS,                                \
      ARG(x, "rounding", NOT_NEGATIVE), OUT)                                                      \
    F(shape_create_bezier, dem2d_shape_create_bezier(v->env, v->points, v->count, v->out),        \
      MAKES(NO_DESC, with_control, free_shape), ENV, ARG(points, "control", POINTER),             \
      ARG_INT(count, "arcs", 2, INT_MAX, TOO_FEW_POINTS), POINTS(p, "control["), OUT)             \
    F(shape_create_fourier, dem2d_shape_create_fourier(v->env, v->a, v->b, v->count, v->out),     \
      MAKES(NO_DESC, with_nothing, free_shape), ENV, SERIES, OUT)                                 \
    F(shape_create_custom, dem2d_shape_create_custom(v->env, v->desc, v->out),                    \
      MAKES(CUSTOM, with_custom, free_shape), ENV, THE_DESC, OUT)                                 \
    F(shape_get, dem2d_shape_get(v->shape, v->out), PLAIN, ARG(shape, "shape", POINTER), OUT)     \
    F(shape_support, dem2d_shape_support(v->shape, v->pose, v->direction, v->out),                \
      PLAIN, ARG(shape, "shape", POINTER), ARG(pose, "pose", POSE),                               \
      ARG(direction, "direction", DIRECTION), OUT)                                                \
    F(shape_aabb, dem2d_shape_aabb(v->shape, v->pose, v->out),                                    \
      PLAIN, ARG(shape, "shape", POINTER), ARG(pose, "pose", POSE), OUT)                          \
    F(shape_outline, dem2d_shape_outline(v->shape, v->pose, v->count, v->out),                    \
      PLAIN, ARG(shape, "shape", POINTER), ARG(pose, "pose", POSE),                               \
      ARG_INT(count, "count", 3, INT_MAX, TOO_FEW_POINTS), OUT)                                   \
    F(polygon_mass, dem2d_polygon_mass(v->points, v->count, v->out), PLAIN, THREE_POINTS, OUT)    \
    F(shape_mass, dem2d_shape_mass(v->shape, v->out), PLAIN, ARG(shape, "shape", POINTER), OUT)   \
    F(shape_mass_interpolated, dem2d_shape_mass_interpolated(v->shape, v->count, v->out),         \
      PLAIN, ARG(shape, "shape", POINTER), ARG_INT(count, "count", 3, INT_MAX, TOO_FEW_POINTS),   \
      OUT)                                                                                        \
    F(image_threshold, dem2d_image_threshold(v->desc, v->out),                                    \
      SILENT(NO_DESC, with_image), THE_DESC, ARG(d.image.pixels, "pixels", POINTER),              \
      ARG_INT(d.image.width, "width", 1, 1 << 15, OUT_OF_RANGE),                                  \
      ARG_INT(d.image.height, "height", 1, 1 << 15, OUT_OF_RANGE),                                \
      ARG_INT(d.image.stride, "stride", 8, INT_MAX, OUT_OF_RANGE, .or_0 = true),                  \
      ARG_INT(d.image.crop_left, "crop_left", 0, 7, OUT_OF_RANGE),                                \
      ARG_INT(d.image.crop_top, "crop_top", 0, 7, OUT_OF_RANGE),                                  \
      ARG_INT(d.image.crop_width, "crop_width", 0, 8, OUT_OF_RANGE),                              \
      ARG_INT(d.image.crop_height, "crop_height", 0, 8, OUT_OF_RANGE),                            \
      ARG(d.image.scale, "scale", UNREAD), OUT)                                                   \
    F(image_outlines, dem2d_image_outlines(v->env, v->desc, v->out),                              \
      MAKES(IMAGE, with_image, free_set), ENV, THE_DESC, OUT)                                     \
    F(outline_set_get, dem2d_outline_set_get(v->set, v->count, v->out),                           \
      DESCRIBED(NO_DESC, with_first), ARG(set, "set", POINTER),                                   \
      ARG_INT(count, "outline", 0, 0, OUT_OF_RANGE), OUT)                                         \
    F(outline_measure, dem2d_outline_measure(v->env, v->points, v->count, v->out),                \
      LOGS, ENV, THREE_POINTS, OUT)                                                               \
    F(outline_compare,                                                                            \
      dem2d_outline_compare(v->env, v->points, v->count, v->others, v->number, v->out),           \
      LOGS, ENV, ARG(points, "reference", POINTER),                                               \
      ARG_INT(count, "reference", 3, INT_MAX, TOO_FEW_POINTS), POINTS(p, "reference["),           \
      ARG(others, "other", POINTER), ARG_INT(number, "other", 3, INT_MAX, TOO_FEW_POINTS),        \
      POINTS(q, "other["), OUT)                                                                   \
    F(polygon_hull, dem2d_polygon_hull(v->env, v->points, v->count, v->out, v->second),           \
      LOGS, ENV, THREE_POINTS, OUT, SECOND)                                                       \
    F(fourier_fit,                                                                                \
      dem2d_fourier_fit(v->env, v->points, v->count, 4, v->number, v->out, v->second),            \
      DESCRIBED(NO_DESC, with_samples), ENV, THREE_POINTS,                                        \
      ARG_INT(number, "samples", 9, INT_MAX, OUT_OF_RANGE, .or_0 = true), OUT, SECOND)            \
    F(fourier_fit_order,                                                                          \
      dem2d_fourier_fit(v->env, v->points, v->count, v->number, 0, v->out, v->second),            \
      LOGS, ENV, THREE_POINTS, ARG_INT(number, "order", 0, 1 << 20, OUT_OF_RANGE), OUT, SECOND)   \
    F(fourier_convexity, dem2d_fourier_convexity(v->a, v->b, v->count, v->out),                   \
      PLAIN, SERIES, OUT)                                                                         \
    F(fourier_reduce, dem2d_fourier_reduce(v->a, v->b, v->count, v->desc, v->out),                \
      SILENT(REDUCTION, with_nothing), SERIES, THE_DESC, ARG(out, "reductions", OPTIONAL))        \
    F(bezier_fit, dem2d_bezier_fit(v->env, v->points, v->count, v->number, v->out),               \
      LOGS, ENV, THREE_POINTS, ARG_INT(number, "arcs", 3, 1 << 20, OUT_OF_RANGE), OUT)            \
    F(outline_fit, dem2d_outline_fit(v->env, v->points, v->count, v->desc, v->out, v->second),    \
      MAKES(FIT, with_fit, free_shape), ENV, THREE_POINTS, THE_DESC, OUT,                         \
      ARG(second, "report", OPTIONAL))                                                            \
    F(radial_compare, dem2d_radial_compare(v->env, v->points, v->count, v->number, v->out),       \
      LOGS, ENV, THREE_POINTS, ARG_INT(number, "order", 0, 719, OUT_OF_RANGE), OUT)               \
    F(fourier_virtual, dem2d_fourier_virtual(v->desc, v->count, v->out, v->second),               \
      SILENT(VIRTUAL, with_virtual), THE_DESC, ARG_INT(count, "order", 0, 1 << 20, OUT_OF_RANGE), \
      OUT, SECOND)                                                                                \
    F(shape_contains, dem2d_shape_contains(v->shape, v->pose, v->vector, v->out),                 \
      PLAIN, ARG(shape, "shape", POINTER), ARG(pose, "pose", POSE), ARG(vector, "point", VECTOR), \
      OUT)                                                                                        \
    F(pair_overlap, dem2d_pair_overlap(v->shape, v->pose, v->other, v->pose_b, v->desc, v->out),  \
      SILENT(CONTACT, with_nothing), PAIR_ARGS)                                                   \
    F(pair_distance,                                                                              \
      dem2d_pair_distance(v->shape, v->pose, v->other, v->pose_b, v->desc, v->out),               \
      SILENT(CONTACT, with_nothing), PAIR_ARGS)                                                   \
    F(pair_contact, dem2d_pair_contact(v->shape, v->pose, v->other, v->pose_b, v->desc, v->out),  \
      SILENT(CONTACT, with_nothing), PAIR_ARGS)                                                   \
    F(pairs_contact,                                                                              \
      dem2d_pairs_contact(v->env, v->bodies, v->count, v->pairs, v->number, v->desc, NULL,        \
                          v->out, NULL),                                                          \
      DESCRIBED(CONTACT, with_bodies), ENV, ARG(bodies, "bodies", POINTER),                       \
      ARG_INT(count, "bodies", 2, INT_MAX, OUT_OF_RANGE), ARG(pairs, "pairs", POINTER),       \
      ARG_INT(number, "pairs", 0, INT_MAX, OUT_OF_RANGE),                                    \
      ARG(two[1].shape, "bodies[1].shape", POINTER), ARG(two[1].pose, "bodies[1].pose", POSE),    \
      ARG_INT(one.a, "pairs[0]", 0, 0, OUT_OF_RANGE),                                             \
      ARG_INT(one.b, "pairs[0]", 1, 1, OUT_OF_RANGE), ARG(desc, "desc", OPTIONAL), OUT)           \
    F(wall_contact, dem2d_wall_contact(v->shape, v->pose, v->vector, v->direction, v->out),       \
      PLAIN, ARG(shape, "shape", POINTER), ARG(pose, "pose", POSE), ARG(vector, "point", VECTOR), \
      ARG(direction, "wall_normal", DIRECTION), OUT)                                              \
    F(world_create, dem2d_world_create(v->desc, v->out),                                          \
      MAKES(WORLD, with_world, free_world), THE_DESC, OUT)                                        \
    F(world_add_shape, dem2d_world_add_shape(v->world, v->shape, v->out),                         \
      LOGS, IN_WORLD, ARG(shape, "shape", POINTER), OUT)                                          \
    F(world_remove_shape, dem2d_world_remove_shape(v->world, v->shape_id),                        \
      LOGS, IN_WORLD, ARG(shape_id, "shape", SHAPE_ID))                                           \
    F(world_add_material, dem2d_world_add_material(v->world, v->desc, v->out),                    \
      DESCRIBED(MATERIAL, with_material), IN_WORLD, THE_DESC, OUT)                                \
    F(world_set_pair, dem2d_world_set_pair(v->world, v->material, v->material_b, v->desc),        \
      DESCRIBED(PAIR, with_pair), IN_WORLD, ARG(material, "material", MATERIAL_ID),               \
      ARG(material_b, "material", MATERIAL_ID), THE_DESC)                                         \
    F(world_add_particle, dem2d_world_add_particle(v->world, v->desc, v->out),                    \
      DESCRIBED(PARTICLE, with_particle), IN_WORLD, THE_DESC, OUT)                                \
    F(world_remove_particle, dem2d_world_remove_particle(v->world, v->particle),                  \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID))                                     \
    F(world_get_particle, dem2d_world_get_particle(v->world, v->particle, v->out),                \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID), OUT)                                \
    F(world_move_particle, dem2d_world_move_particle(v->world, v->particle, v->vector, v->x),     \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID), ARG(vector, "position", VECTOR),    \
      ARG(x, "angle", ANGLE))                                                                     \
    F(world_drive_particle,                                                                       \
      dem2d_world_drive_particle(v->world, v->particle, v->motion, v->vector, v->x),              \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID),                                     \
      ARG_INT(motion, "motion", 0, 2, OUT_OF_RANGE), ARG(vector, "velocity", VECTOR),             \
      ARG(x, "angular_velocity", FINITE))                                                         \
    F(world_add_wall, dem2d_world_add_wall(v->world, v->desc, v->out),                            \
      DESCRIBED(WALL, with_wall), IN_WORLD, THE_DESC, OUT)                                        \
    F(world_set_wall, dem2d_world_set_wall(v->world, v->wall, v->desc),                           \
      DESCRIBED(WALL, with_wall), IN_WORLD, ARG(wall, "wall", WALL_ID), THE_DESC)                 \
    F(world_remove_wall, dem2d_world_remove_wall(v->world, v->wall),                              \
      LOGS, IN_WORLD, ARG(wall, "wall", WALL_ID))                                                 \
    F(world_get_wall, dem2d_world_get_wall(v->world, v->wall, v->out),                            \
      LOGS, IN_WORLD, ARG(wall, "wall", WALL_ID), OUT)                                            \
    F(world_get_wall_part, dem2d_world_get_wall_part(v->world, v->wall, v->count, v->out),        \
      DESCRIBED(NO_DESC, with_first), IN_WORLD, ARG(wall, "wall", WALL_ID),                       \
      ARG_INT(count, "part", 0, 0, OUT_OF_RANGE), OUT)                                            \
    F(world_drive_wall, dem2d_world_drive_wall(v->world, v->wall, v->vector, v->x),               \
      DESCRIBED(NO_DESC, with_floor), IN_WORLD, ARG(wall, "wall", WALL_ID),                       \
      ARG(vector, "velocity", VECTOR), ARG(x, "angular_velocity", FINITE))                        \
    F(world_set_gravity, dem2d_world_set_gravity(v->world, v->vector),                            \
      LOGS, IN_WORLD, ARG(vector, "gravity", VECTOR))                                             \
    F(world_set_damping, dem2d_world_set_damping(v->world, v->x, v->y),                           \
      LOGS, IN_WORLD, ARG(x, "local_damping", FRACTION), ARG(y, "global_damping", NOT_NEGATIVE))  \
    F(world_set_time_step, dem2d_world_set_time_step(v->world, v->x),                             \
      LOGS, IN_WORLD, ARG(x, "time_step", POSITIVE))                                              \
    F(world_time_step_bounds,                                                                     \
      dem2d_world_time_step_bounds(v->world, v->out, v->second, v->third),                        \
      LOGS, IN_WORLD, OUT, SECOND, ARG(third, "limit_particle", OPTIONAL))                        \
    F(world_step, dem2d_world_step(v->world, v->count, v->third),                                 \
      LOGS, IN_WORLD, ARG_INT(count, "count", 0, INT_MAX, OUT_OF_RANGE),                          \
      ARG(third, "done", OPTIONAL))                                                               \
    F(world_stats, dem2d_world_stats(v->world, v->out), LOGS, IN_WORLD, OUT)                      \
    F(world_particles, dem2d_world_particles(v->world, v->out, v->count, v->second),              \
      LOGS, IN_WORLD, OUT, CAPACITY, SECOND)          \
    F(world_contacts, dem2d_world_contacts(v->world, v->out, v->count, v->second),                \
      LOGS, IN_WORLD, OUT, CAPACITY, SECOND)          \
    F(world_energy, dem2d_world_energy(v->world, v->out), LOGS, IN_WORLD, OUT)                    \
    F(world_stress, dem2d_world_stress(v->world, v->x, v->out),                                   \
      LOGS, IN_WORLD, ARG(x, "area", POSITIVE), OUT)                                              \
    F(world_packing, dem2d_world_packing(v->world, v->out), LOGS, IN_WORLD, OUT)                  \
    F(world_porosity, dem2d_world_porosity(v->world, v->region, v->out),                          \
      LOGS, IN_WORLD, ARG(region, "region", POINTER), ARG(box.lower, "region", VECTOR),           \
      ARG(box.upper, "region", UPPER), OUT)                                                       \
    F(world_ledger, dem2d_world_ledger(v->world, v->out), LOGS, IN_WORLD, OUT)                    \
    F(world_particle_stress, dem2d_world_particle_stress(v->world, v->particle, v->out),          \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID), OUT)                                \
    F(stress_principal, dem2d_stress_principal(v->desc, v->out),                                  \
      SILENT(NO_DESC, with_stress), ARG(desc, "stress", POINTER), ARG(d.stress.xx, "xx", FINITE), \
      ARG(d.stress.xy, "xy", FINITE), ARG(d.stress.yx, "yx", FINITE),                             \
      ARG(d.stress.yy, "yy", FINITE), OUT)                                                        \
    F(world_fabric, dem2d_world_fabric(v->world, v->out), LOGS, IN_WORLD, OUT)                    \
    F(world_histogram,                                                                            \
      dem2d_world_histogram(v->world, (dem2d_histogram)v->number, v->count, v->out),              \
      LOGS, IN_WORLD, ARG_INT(number, "kind", 0, DEM2D_HISTOGRAM_COUNT - 1, OUT_OF_RANGE),        \
      ARG_INT(count, "bins", 1, INT_MAX, OUT_OF_RANGE), OUT)                                      \
    F(world_equilibrium, dem2d_world_equilibrium(v->world, v->out), LOGS, IN_WORLD, OUT)          \
    F(world_inertial_number, dem2d_world_inertial_number(v->world, v->x, v->y, v->out),           \
      LOGS, IN_WORLD, ARG(x, "strain_rate", FINITE), ARG(y, "pressure", POSITIVE), OUT)           \
    F(world_save, dem2d_world_save(v->world, v->desc, NULL),                                      \
      DESCRIBED(SAVE, with_save), IN_WORLD, THE_DESC)                                             \
    F(world_load, (v->snapshot->next = 0, dem2d_world_load(v->desc, NULL, v->out)),               \
      MAKES(LOAD, with_load, free_world), THE_DESC, OUT)                                          \
    F(world_write_svg, dem2d_world_write_svg(v->world, v->desc, NULL),                            \
      DESCRIBED(SVG, with_svg), IN_WORLD, THE_DESC)                                               \
    F(world_write_vtp, dem2d_world_write_vtp(v->world, v->desc, NULL),                            \
      DESCRIBED(VTP, with_vtp), IN_WORLD, THE_DESC)                                               \
    F(world_write_csv, dem2d_world_write_csv(v->world, v->desc, NULL),                            \
      DESCRIBED(CSV, with_csv), IN_WORLD, THE_DESC, NAMES(COLUMN, "names", "values"))             \
    F(pvd_write, dem2d_pvd_write(v->env, v->desc, NULL),                                          \
      DESCRIBED(PVD, with_pvd), ENV, THE_DESC, NAMES(FILE_NAME, "files", "times"))                \
    F(shape_axis, dem2d_shape_axis(v->shape, v->out, v->second),                                  \
      PLAIN, ARG(shape, "shape", POINTER), OUT, SECOND)                                           \
    F(damping_ratio, dem2d_damping_ratio(v->x, v->out),                                           \
      PLAIN, ARG(x, "restitution", PORTION), OUT)                                                 \
    F(world_add_segment, dem2d_world_add_wall(v->world, v->desc, v->out),                         \
      DESCRIBED(SEGMENT, with_segment), IN_WORLD, THE_DESC, OUT)                                  \
    F(world_set_load, dem2d_world_set_load(v->world, v->particle, v->vector, v->x),               \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID), ARG(vector, "force", VECTOR),       \
      ARG(x, "torque", FINITE))                                                                   \
    F(world_read_particles,                                                                       \
      dem2d_world_read_particles(v->world, v->desc, v->count, v->third),                          \
      DESCRIBED(NO_DESC, with_particles), IN_WORLD, THE_DESC,                                     \
      ARG_INT(count, "capacity", 0, INT_MAX, OUT_OF_RANGE), ARG(third, "count", POINTER),         \
      ARG_INT(d.particles.stride, "stride", 16, 1 << 20, OUT_OF_RANGE, .or_0 = true))             \
    F(world_write_particles, dem2d_world_write_particles(v->world, v->desc, v->count),            \
      DESCRIBED(NO_DESC, with_rows), IN_WORLD, THE_DESC,                                          \
      ARG_INT(count, "count", 0, INT_MAX, OUT_OF_RANGE),                                          \
      ARG_INT(d.particles.stride, "stride", 16, 1 << 20, OUT_OF_RANGE, .or_0 = true),             \
      ARG(particle, "particle", PARTICLE_ID), ARG(p[0], "positions[", VECTOR),                    \
      ARG(q[0], "loads[", VECTOR))                                                                \
    F(world_read_contacts,                                                                        \
      dem2d_world_read_contacts(v->world, v->desc, v->count, v->third),                           \
      DESCRIBED(NO_DESC, with_contacts), IN_WORLD, THE_DESC,                                      \
      ARG_INT(count, "capacity", 0, INT_MAX, OUT_OF_RANGE), ARG(third, "count", POINTER),         \
      ARG_INT(d.contacts.stride, "stride", 16, 1 << 20, OUT_OF_RANGE, .or_0 = true))              \
    F(world_events, dem2d_world_events(v->world, v->out, v->count, v->second, v->third),          \
      LOGS, IN_WORLD, OUT, ARG_INT(count, "capacity", 0, INT_MAX, OUT_OF_RANGE), SECOND,          \
      ARG(third, "lost", OPTIONAL))                                                               \
    F(world_set_segment, dem2d_world_set_wall(v->world, v->wall, v->desc),                        \
      DESCRIBED(SEGMENT, with_segment), IN_WORLD, ARG(wall, "wall", WALL_ID), THE_DESC)           \
    F(world_query_box,                                                                            \
      dem2d_world_query_box(v->world, v->region, v->desc, v->out, v->count, v->second),           \
      DESCRIBED(QUERY, with_nothing), IN_WORLD, ARG(region, "box", POINTER),                      \
      ARG(box.lower, "box", VECTOR), ARG(box.upper, "box", VECTOR), FOUND)                        \
    F(world_query_point,                                                                          \
      dem2d_world_query_point(v->world, v->vector, v->desc, v->out, v->count, v->second),         \
      DESCRIBED(QUERY, with_nothing), IN_WORLD, ARG(vector, "point", VECTOR), FOUND)              \
    F(world_query_shape,                                                                          \
      dem2d_world_query_shape(v->world, v->shape, v->pose, v->desc, v->out, v->count, v->second), \
      DESCRIBED(QUERY, with_nothing), IN_WORLD, ARG(shape, "shape", POINTER),                     \
      ARG(pose, "pose", POSE), FOUND)                                                             \
    F(world_cast_ray,                                                                             \
      dem2d_world_cast_ray(v->world, v->vector, v->direction, v->x, v->desc, v->out),             \
      DESCRIBED(QUERY, with_nothing), IN_WORLD, RAY, ARG(desc, "desc", OPTIONAL), OUT)            \
    F(world_cast_ray_all,                                                                         \
      dem2d_world_cast_ray_all(v->world, v->vector, v->direction, v->x, v->desc, v->out, v->count,\
                               v->second),                                                        \
      DESCRIBED(QUERY, with_nothing), IN_WORLD, RAY, FOUND)                                       \
    F(world_nearest, dem2d_world_nearest(v->world, v->vector, v->x, v->desc, v->out),             \
      DESCRIBED(QUERY, with_nothing), IN_WORLD, ARG(vector, "point", VECTOR),                     \
      ARG(x, "range", NOT_NEGATIVE), ARG(desc, "desc", OPTIONAL), OUT)                            \
    F(world_particle_overlaps,                                                                    \
      dem2d_world_particle_overlaps(v->world, v->particle, v->desc, v->out, v->count, v->second), \
      DESCRIBED(QUERY, with_nothing), IN_WORLD, ARG(particle, "particle", PARTICLE_ID), FOUND)    \
    F(world_wall_overlaps,                                                                        \
      dem2d_world_wall_overlaps(v->world, v->wall, v->desc, v->out, v->count, v->second),         \
      DESCRIBED(QUERY, with_nothing), IN_WORLD, ARG(wall, "wall", WALL_ID), FOUND)                \
    F(world_set_groups, dem2d_world_set_groups(v->world, v->particle, v->groups),                 \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID))                                     \
    F(world_set_user_data, dem2d_world_set_user_data(v->world, v->particle, v->hash),             \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID))                                     \
    F(world_walls, dem2d_world_walls(v->world, v->out, v->count, v->second),                      \
      LOGS, IN_WORLD, OUT, CAPACITY, SECOND)                                                      \
    F(world_shapes, dem2d_world_shapes(v->world, v->out, v->count, v->second),                    \
      LOGS, IN_WORLD, OUT, CAPACITY, SECOND)                                                      \
    F(world_materials, dem2d_world_materials(v->world, v->out, v->count, v->second),              \
      LOGS, IN_WORLD, OUT, CAPACITY, SECOND)                                                      \
    F(world_get_desc, dem2d_world_get_desc(v->world, v->out), LOGS, IN_WORLD, OUT)                \
    F(world_get_material_desc, dem2d_world_get_material_desc(v->world, v->material, v->out),      \
      LOGS, IN_WORLD, ARG(material, "material", MATERIAL_ID), OUT)                                \
    F(world_get_pair, dem2d_world_get_pair(v->world, v->material, v->material_b, v->out),         \
      LOGS, IN_WORLD, ARG(material, "material", MATERIAL_ID),                                     \
      ARG(material_b, "material", MATERIAL_ID), OUT)                                              \
    F(world_get_particle_desc, dem2d_world_get_particle_desc(v->world, v->particle, v->out),      \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID), OUT)                                \
    F(world_get_wall_desc, dem2d_world_get_wall_desc(v->world, v->wall, v->out),                  \
      LOGS, IN_WORLD, ARG(wall, "wall", WALL_ID), OUT)                                            \
    F(world_set_material, dem2d_world_set_material(v->world, v->particle, v->material),           \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID),                                     \
      ARG(material, "material", MATERIAL_ID))                                                     \
    F(world_set_shape, dem2d_world_set_shape(v->world, v->particle, v->shape_id, v->x),           \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID), ARG(shape_id, "shape", SHAPE_ID),   \
      ARG(x, "scale", POSITIVE))                                                                  \
    F(world_overlap_at, dem2d_world_overlap_at(v->world, v->desc, v->out),                        \
      DESCRIBED(PARTICLE, with_particle), IN_WORLD, THE_DESC, OUT)                                \
    F(world_relax, dem2d_world_relax(v->world, v->x, v->count, v->out),                           \
      LOGS, IN_WORLD,                                                                             \
      ARG(x, "tolerance", NUMBER, .high = 1, .above = true, .below = true),                       \
      ARG_INT(count, "sweeps", 0, INT_MAX, OUT_OF_RANGE), OUT)                                    \
    F(world_choose_time_step, dem2d_world_choose_time_step(v->world, v->x, v->out),               \
      LOGS, IN_WORLD, ARG(x, "fraction", PORTION), OUT)                                           \
    F(world_particle_contacts,                                                                    \
      dem2d_world_particle_contacts(v->world, v->particle, v->out, v->count, v->second),          \
      LOGS, IN_WORLD, ARG(particle, "particle", PARTICLE_ID), OUT, CAPACITY, SECOND)              \
    F(grid_create, dem2d_grid_create(v->env, v->desc, v->out),                                    \
      MAKES(GRID, with_grid, free_grid), ENV, THE_DESC, OUT)                                      \
    F(grid_add, dem2d_grid_add(v->grid, v->world, v->x),                                          \
      LOGS, IN_GRID, IN_WORLD, ARG(x, "weight", POSITIVE))                                        \
    F(grid_read, dem2d_grid_read(v->grid, v->out, v->count, v->second),                           \
      LOGS, IN_GRID, OUT, CAPACITY, SECOND)                                                       \
    F(grid_reset, dem2d_grid_reset(v->grid), LOGS, IN_GRID)                                       \
    F(world_average_box, dem2d_world_average_box(v->world, v->region, v->out),                    \
      LOGS, IN_WORLD, ARG(region, "box", POINTER), ARG(box.lower, "box", VECTOR),                 \
      ARG(box.upper, "box", UPPER), OUT)                                                          \
    F(world_average_circle, dem2d_world_average_circle(v->world, v->vector, v->x, v->out),        \
      LOGS, IN_WORLD, ARG(vector, "centre", VECTOR), ARG(x, "radius", POSITIVE), OUT)             \
    F(grid_write_csv, dem2d_grid_write_csv(v->grid, v->desc, NULL),                               \
      DESCRIBED(SAVE, with_save), IN_GRID, ARG(desc, "path and write", POINTER))                  \
    F(grid_write_vti, dem2d_grid_write_vti(v->grid, v->desc, NULL),                               \
      DESCRIBED(SAVE, with_save), IN_GRID, ARG(desc, "path and write", POINTER))               \
    F(world_draw, dem2d_world_draw(v->world, v->desc, v->out, v->count, v->second),               \
      DESCRIBED(DRAW, with_draw), IN_WORLD, THE_DESC, OUT, CAPACITY, SECOND)                      \
    F(world_draw_grading, draw_of(v->world, v->desc, v),                                          \
      DESCRIBED(GRADING, with_grading), IN_WORLD, THE_DESC, OUT, SECOND,                          \
      ARG(curve[0].size, "points[0]", FINITE), ARG(curve[1].passing, "points[1]", FINITE),        \
      ARG(kind.share, "share", FINITE),                                                           \
      ARG(kind.grain.shape, "shape", SHAPE_ID), ARG(kind.grain.material, "material", MATERIAL_ID),\
      ARG(kind.grain.velocity, "velocity", VECTOR))                                               \
    F(world_grading,                                                                              \
      dem2d_world_grading(v->world, (dem2d_measure)v->number, v->a, v->count, v->out),            \
      DESCRIBED(NO_DESC, with_measure), IN_WORLD,                                                 \
      ARG_INT(number, "measure", 0, DEM2D_MEASURE_COUNT - 1, OUT_OF_RANGE),                       \
      ARG(a, "sizes", POINTER), ARG_INT(count, "count", 0, INT_MAX, OUT_OF_RANGE),                \
      ARG(series_a[0], "sizes[", FINITE), OUT)                                                    \
    F(world_fill, dem2d_world_fill(v->world, v->desc, v->out, v->count, v->second),               \
      DESCRIBED(FILL, with_fill), IN_WORLD, THE_DESC, OUT, CAPACITY, SECOND)                      \
    F(world_remove_in, dem2d_world_remove_in(v->world, v->where, v->out),                         \
      DESCRIBED(NO_DESC, with_where), IN_WORLD, ARG(where, "region", POINTER),                    \
      ARG(area.box.lower, "region.box.lower", VECTOR),                                            \
      ARG(area.box.upper, "region.box.upper", UPPER), ARG(out, "flow", OPTIONAL))                 \
    F(world_flow, dem2d_world_flow(v->world, v->vector, v->direction, v->out),                    \
      LOGS, IN_WORLD, ARG(vector, "from", VECTOR), ARG(direction, "to", VECTOR), OUT)             \
    F(world_feed, dem2d_world_feed(v->world, v->desc, v->x, v->state),                            \
      DESCRIBED(INLET, with_inlet), IN_WORLD, THE_DESC, ARG(x, "seconds", NOT_NEGATIVE),          \
      ARG(state, "inlet", POINTER), ARG(inlet.due, "inlet.due", NOT_NEGATIVE))                    \
    F(world_grow, dem2d_world_grow(v->world, v->desc, v->count, v->out),                          \
      DESCRIBED(GROWTH, with_growth), IN_WORLD, THE_DESC,                                         \
      ARG_INT(count, "steps", 0, INT_MAX, OUT_OF_RANGE), OUT)                                     \
    F(world_deform, dem2d_world_deform(v->world, v->desc),                                        \
      DESCRIBED(DEFORMATION, with_deformation), IN_WORLD, THE_DESC)                               \
    F(world_get_cell, dem2d_world_get_cell(v->world, v->out), LOGS, IN_WORLD, OUT)
/* clang-format on */

#define FUNCTION_CALL(name, expression, ...)   \
    static dem2d_result call_##name(args *v) { \
        return expression;                     \
    }
FUNCTIONS(FUNCTION_CALL)

#define FUNCTION_ROWS(name, expression, how, ...) static const row rows_##name[] = {__VA_ARGS__};
FUNCTIONS(FUNCTION_ROWS)

#define FUNCTION_ROW(name, expression, how, ...) \
    {#name, call_##name, how, rows_##name, COUNT_OF(rows_##name)},
static const function functions[] = {FUNCTIONS(FUNCTION_ROW)};

#endif
