/* api_calls.h - every public function that returns a result, as a table: how it is called with good
   arguments, and what each argument and each field of its desc may be. Tests walk the table; a new
   function needs a wrapper, a table of its arguments and a row at the end, a new desc or field a
   row in the desc's table. Include it after testing.h and fingerprint.h. */
#ifndef API_CALLS_H
#define API_CALLS_H

#include <limits.h>

/* --- what an argument or field may be -------------------------------------------------------- */

typedef enum kind {
    POINTER,      /* not NULL */
    OPTIONAL,     /* a pointer, or NULL */
    FINITE,       /* a double */
    POSITIVE,     /* a finite double above 0 */
    NOT_NEGATIVE, /* a finite double, at least 0 */
    FRACTION,     /* in [0, 1) */
    PORTION,      /* in (0, 1] */
    INSIDE,       /* 0 or inside (0, 1) */
    ANGLE,        /* at most 2^30 */
    SIZE,         /* above 0 and with a mass; 0 is ZERO_AREA */
    LEADING,      /* a0 of a series: as SIZE, and negative is ZERO_AREA too */
    UNREAD,       /* a double of any value, NaN too */
    VECTOR,       /* finite */
    DIRECTION,    /* finite, not 0 */
    UPPER,        /* finite, above the box's lower corner */
    ELSEWHERE,    /* finite, not the wall's point */
    POSE,         /* finite, rotation not 0, scale above 0 */
    INTEGER,      /* from low to high, else `result` */
    INTEGER_OR_0, /* 0, or from low to high, else `result` */
    ENUM,         /* from 0 to high, else OUT_OF_RANGE */
    SHAPE_ID,     /* of the world */
    MATERIAL_ID,
    PARTICLE_ID,
    WALL_ID,
    SPAN_ID,     /* of a wall; generation 0 in both: none */
    FILE_NAME,   /* not NULL, no control bytes */
    COLUMN,      /* not NULL, no comma, quote or line end */
    ANY_POINTER, /* nothing is wrong with any value of these */
    ANY_INT,
    ANY_BOOL,
    ANY_SEED
} kind;

typedef struct row {
    const char *name; /* as the log says it */
    size_t offset;    /* in the desc, or in args */
    kind kind;
    dem2d_result result; /* of INTEGER, INTEGER_OR_0 */
    int low, high;
} row;

/* A desc: its rows hold all its fields in their order. */
typedef struct desc_table {
    const char *name;
    size_t size;
    const row *rows;
    int count;
} desc_table;

#define FIELD(type, field, kind) \
    { #field, offsetof(dem2d_##type, field), kind, DEM2D_OK, 0, 0 }
#define FIELD_INT(type, field, kind, low, high) \
    { #field, offsetof(dem2d_##type, field), kind, DEM2D_OUT_OF_RANGE, low, high }
#define FIELD_ENUM(type, field, count) FIELD_INT(type, field, ENUM, 0, (int)(count)-1)
#define COUNT_MOST (1 << 30) /* of a count in a desc */
#define LAW_TAG 5            /* of the world that is loaded */

static const row custom_rows[] = {
    FIELD(custom_desc, support, POINTER),
    FIELD(custom_desc, user, ANY_POINTER),
    FIELD(custom_desc, rho_min, NOT_NEGATIVE),
    FIELD(custom_desc, inscribed, NOT_NEGATIVE),
    FIELD(custom_desc, mass.area, NOT_NEGATIVE),
    FIELD(custom_desc, mass.centroid, VECTOR),
    FIELD(custom_desc, mass.polar_moment, POSITIVE),
    FIELD_INT(custom_desc, outline_points, INTEGER_OR_0, 3, INT_MAX),
    FIELD(custom_desc, tag, ANY_INT),
};
static const row reduction_rows[] = {
    FIELD_ENUM(reduction_desc, test, DEM2D_NO_TEST + 1),
    FIELD(reduction_desc, factor, INSIDE),
    FIELD(reduction_desc, tolerance, NOT_NEGATIVE),
};
static const row image_rows[] = {
    FIELD(image_desc, pixels, POINTER),
    FIELD(image_desc, pixels16, ANY_POINTER), /* NULL: pixels are there */
    FIELD_INT(image_desc, width, INTEGER, 1, 1 << 15),
    FIELD_INT(image_desc, height, INTEGER, 1, 1 << 15),
    FIELD_INT(image_desc, stride, INTEGER_OR_0, 8, INT_MAX), /* the picture is 8 by 8 */
    FIELD_INT(image_desc, crop_left, INTEGER, 0, 7),
    FIELD_INT(image_desc, crop_top, INTEGER, 0, 7),
    FIELD_INT(image_desc, crop_width, INTEGER, 0, 8),
    FIELD_INT(image_desc, crop_height, INTEGER, 0, 8),
    FIELD(image_desc, labels, ANY_BOOL),
    FIELD_INT(image_desc, threshold, INTEGER, 0, 255),
    FIELD(image_desc, ignore_frame, ANY_BOOL),
    FIELD(image_desc, bright, ANY_BOOL),
    FIELD_INT(image_desc, min_pixels, INTEGER, 0, INT_MAX),
    FIELD_INT(image_desc, max_pixels, INTEGER, 0, INT_MAX),
    FIELD(image_desc, keep_border, ANY_BOOL),
    FIELD(image_desc, scale, POSITIVE),
};
/* Of an FS: the least order is 1, as coverage is 0; methods up to CONSTRAINED. */
static const row fit_rows[] = {
    FIELD_INT(fit_desc, count, INTEGER, 1, 1024),
    FIELD(fit_desc, coverage, NOT_NEGATIVE),
    FIELD_ENUM(fit_desc, model, DEM2D_CUSTOM),
    FIELD_ENUM(fit_desc, method, DEM2D_FIT_CONSTRAINED + 1),
    FIELD_ENUM(fit_desc, scale, DEM2D_SCALE_NONE + 1),
    FIELD(fit_desc, min_radius, FRACTION),
    FIELD(fit_desc, corners, ANY_BOOL),
    FIELD(fit_desc, max_radius, NOT_NEGATIVE),
    FIELD(fit_desc, unbounded, ANY_BOOL),
    FIELD(fit_desc, seed, ANY_SEED),
    FIELD_INT(fit_desc, birds, INTEGER_OR_0, 2, 256),
    FIELD_INT(fit_desc, moves, INTEGER, 0, 100000),
    FIELD_INT(fit_desc, pixels, INTEGER_OR_0, 8, 4096),
};
static const row virtual_rows[] = {
    FIELD(virtual_desc, radius, POSITIVE),        FIELD(virtual_desc, elongation, NOT_NEGATIVE),
    FIELD(virtual_desc, roundness, NOT_NEGATIVE), FIELD(virtual_desc, roughness, NOT_NEGATIVE),
    FIELD(virtual_desc, spectrum, ANY_POINTER),   FIELD(virtual_desc, min_radius, FRACTION),
    FIELD(virtual_desc, seed, ANY_SEED),
};
static const row contact_rows[] = {
    FIELD(contact_desc, tolerance, NOT_NEGATIVE),
    FIELD_INT(contact_desc, max_iterations, INTEGER, 0, INT_MAX),
    FIELD(contact_desc, start, VECTOR),
    FIELD_ENUM(contact_desc, solver, DEM2D_SOLVER_COUNT),
    FIELD(contact_desc, skip_points, ANY_BOOL),
};
static const row world_rows[] = {
    FIELD(world_desc, time_step, POSITIVE),
    FIELD(world_desc, gravity, VECTOR),
    FIELD(world_desc, local_damping, FRACTION),
    FIELD(world_desc, global_damping, NOT_NEGATIVE),
    FIELD(world_desc, skin, NOT_NEGATIVE),
    FIELD(world_desc, contact_tolerance, NOT_NEGATIVE),
    FIELD_INT(world_desc, max_iterations, INTEGER, 0, COUNT_MOST),
    FIELD_ENUM(world_desc, solver, DEM2D_SOLVER_COUNT),
    FIELD_ENUM(world_desc, faces, DEM2D_FACE_RULE_COUNT),
    FIELD_INT(world_desc, particle_capacity, INTEGER, 0, COUNT_MOST),
    FIELD_INT(world_desc, pair_capacity, INTEGER, 0, COUNT_MOST),
    FIELD(world_desc, skip_time_step_check, ANY_BOOL),
    FIELD(world_desc, ledger, ANY_BOOL),
    FIELD(world_desc, law, ANY_POINTER),
    FIELD(world_desc, law_user, ANY_POINTER),
    FIELD(world_desc, law_tag, ANY_INT),
    FIELD(world_desc, parallel_for, ANY_POINTER),
    FIELD(world_desc, parallel_user, ANY_POINTER),
    FIELD(world_desc, env, OPTIONAL),
};
static const row material_rows[] = {
    FIELD(material_desc, density, POSITIVE),
    FIELD(material_desc, normal_stiffness, POSITIVE),
    FIELD(material_desc, tangential_stiffness, NOT_NEGATIVE),
    FIELD(material_desc, friction, NOT_NEGATIVE),
    FIELD(material_desc, damping_ratio, NOT_NEGATIVE),
    FIELD(material_desc, rolling_friction, NOT_NEGATIVE),
};
static const row pair_rows[] = {
    FIELD(pair_desc, normal_stiffness, POSITIVE),
    FIELD(pair_desc, tangential_stiffness, NOT_NEGATIVE),
    FIELD(pair_desc, friction, NOT_NEGATIVE),
    FIELD(pair_desc, damping_ratio, NOT_NEGATIVE),
    FIELD(pair_desc, rolling_friction, NOT_NEGATIVE),
};
static const row particle_rows[] = {
    FIELD(particle_desc, scale, POSITIVE),
    FIELD(particle_desc, shape, SHAPE_ID),
    FIELD(particle_desc, material, MATERIAL_ID),
    FIELD_ENUM(particle_desc, motion, DEM2D_DRIVEN + 1),
    FIELD(particle_desc, position, VECTOR),
    FIELD(particle_desc, angle, ANGLE),
    FIELD(particle_desc, velocity, VECTOR),
    FIELD(particle_desc, angular_velocity, FINITE),
};
/* Of a servo wall without spans: a half-plane, a segment. */
#define WALL_ROWS(length_kind, normal_kind, end_kind)                                         \
    FIELD(wall_desc, length, length_kind), FIELD_ENUM(wall_desc, mode, DEM2D_WALL_SERVO + 1), \
        FIELD(wall_desc, material, MATERIAL_ID), FIELD(wall_desc, point, VECTOR),             \
        FIELD(wall_desc, normal, normal_kind), FIELD(wall_desc, segment, ANY_BOOL),           \
        FIELD(wall_desc, end, end_kind), FIELD(wall_desc, velocity, VECTOR),                  \
        FIELD(wall_desc, stress, FINITE), FIELD(wall_desc, max_speed, POSITIVE),              \
        FIELD(wall_desc, spans[0], SPAN_ID), FIELD(wall_desc, spans[1], SPAN_ID)
static const row wall_rows[] = {WALL_ROWS(POSITIVE, DIRECTION, VECTOR)};
static const row segment_rows[] = {WALL_ROWS(NOT_NEGATIVE, VECTOR, ELSEWHERE)};
static const row save_rows[] = {
    FIELD(save_desc, write, POINTER), /* there is no path, as below */
    FIELD(save_desc, user, ANY_POINTER),
};
/* Of a world with a custom shape and a law; a law with another tag is none. */
static const row load_rows[] = {
    FIELD(load_desc, read, POINTER),
    FIELD(load_desc, user, ANY_POINTER),
    FIELD(load_desc, parallel_for, ANY_POINTER),
    FIELD(load_desc, parallel_user, ANY_POINTER),
    FIELD(load_desc, custom, POINTER),
    FIELD(load_desc, custom_user, ANY_POINTER),
    FIELD(load_desc, law, POINTER),
    FIELD(load_desc, law_user, ANY_POINTER),
    {"law_tag", offsetof(dem2d_load_desc, law_tag), INTEGER, DEM2D_NULL_ARGUMENT, LAW_TAG, LAW_TAG},
    FIELD(load_desc, env, OPTIONAL),
};
static const row svg_rows[] = {
    FIELD(svg_desc, width, NOT_NEGATIVE),
    FIELD_INT(svg_desc, outline_points, INTEGER_OR_0, 3, INT_MAX),
    FIELD(svg_desc, force_chains, ANY_BOOL),
    FIELD(svg_desc, view.lower, VECTOR),
    FIELD(svg_desc, view.upper, VECTOR),
    FIELD(svg_desc, write, POINTER), /* there is no path */
    FIELD(svg_desc, user, ANY_POINTER),
};

static const row vtp_rows[] = {
    FIELD_INT(vtp_desc, outline_points, INTEGER_OR_0, 3, INT_MAX),
    FIELD_ENUM(vtp_desc, part, DEM2D_VTP_PART_COUNT),
    FIELD(vtp_desc, write, POINTER),
    FIELD(vtp_desc, user, ANY_POINTER),
};
/* Arrays of NAMED; what is in them is among the arguments. */
static const row pvd_rows[] = {
    FIELD_INT(pvd_desc, count, INTEGER, 0, COUNT_MOST),
    FIELD(pvd_desc, times, POINTER),
    FIELD(pvd_desc, files, POINTER),
    FIELD(pvd_desc, write, POINTER),
    FIELD(pvd_desc, user, ANY_POINTER),
};
static const row csv_rows[] = {
    FIELD_INT(csv_desc, count, INTEGER, 0, COUNT_MOST),
    FIELD(csv_desc, names, POINTER),
    FIELD(csv_desc, values, POINTER),
    FIELD(csv_desc, append, ANY_BOOL),
    FIELD(csv_desc, write, POINTER),
    FIELD(csv_desc, user, ANY_POINTER),
};

#define DESC(name) \
    { "dem2d_" #name "_desc", sizeof(dem2d_##name##_desc), name##_rows, COUNT_OF(name##_rows) }

enum {
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
    DESCS
};

static const desc_table descs[DESCS] = {
    DESC(custom),
    DESC(reduction),
    DESC(image),
    DESC(fit),
    DESC(virtual),
    DESC(contact),
    DESC(world),
    DESC(material),
    DESC(pair),
    DESC(particle),
    DESC(wall),
    DESC(save),
    DESC(load),
    DESC(svg),
    DESC(vtp),
    DESC(pvd),
    DESC(csv),
    {"dem2d_wall_desc", sizeof(dem2d_wall_desc), segment_rows, COUNT_OF(segment_rows)},
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
    dem2d_shape_id shape, spare_shape, stale_shapes[STALE];
    dem2d_material_id materials[2], stale_materials[STALE];
    dem2d_particle_id particle, stale_particles[STALE];
    dem2d_wall_id walls[4 + SEGMENTS]; /* floor, left, right, lid; two that are joined */
    dem2d_wall_id free_wall, stale_walls[STALE];
    store snapshot;           /* of another world */
    dem2d_custom_desc custom; /* room for what is found by a tag */
} fixture;

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

static const dem2d_material_desc good_material = {2700, 1e6, 5e5, 0.4, 0, 0};

/* With all that the full law has. */
static const dem2d_material_desc full_material = {2700, 1e6, 5e5, 0.4, 0.1, 0.05};

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

/* A box of grains of three shapes with the full law, a ledger and two segments, after `steps`
   steps. Two of them hold the same to the bit. */
static void fixture_make(fixture *f, int steps) {
    memset(f, 0, sizeof *f);
    test_env_init(&f->env);
    dem2d_world_desc d = good_world(&f->env.env);
    const dem2d_image_desc image = good_image();
    d.ledger = true;
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
    test_log_clear(&f->env);
}

static fingerprint fixture_print(const fixture *f) {
    return fingerprint_take(f->world, f->walls, COUNT_OF(f->walls));
}

static void fixture_end(fixture *f) {
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
    const dem2d_shape *shape, *other;
    const dem2d_outline_set *set;
    const void *desc;
    const dem2d_vec *points, *others;
    const dem2d_box *region;
    store *snapshot; /* that is read */
    double *a, *b;   /* of a series; fourier_reduce writes them */
    void *out, *second, *third;
    dem2d_pose pose, pose_b;
    dem2d_vec vector, direction;
    double x, y;
    int count, number;
    dem2d_motion motion;
    dem2d_shape_id shape_id;
    dem2d_material_id material, material_b;
    dem2d_particle_id particle;
    dem2d_wall_id wall;
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
    } d;
    dem2d_box box;
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
    a->env = &f->env.env, a->world = f->world, a->shape = f->ellipse, a->other = f->polygon;
    a->set = f->set, a->desc = &a->d, a->points = a->p, a->others = a->q;
    a->a = a->series_a, a->b = a->series_b;
    a->out = &a->outputs[0], a->second = &a->outputs[1], a->third = &a->outputs[2];
    a->pose = dem2d_pose_make(0.1, 0.2, 0.3, 1.5);
    a->pose_b = dem2d_pose_make(1.1, 0.9, -0.3, 1);
    a->vector = vec(0.1, 0.2), a->direction = vec(0, 1), a->x = 0.5, a->y = 0.5;
    a->count = 5, a->number = 5;
    a->shape_id = f->spare_shape, a->particle = f->particle, a->wall = f->free_wall;
    a->material = f->materials[0], a->material_b = f->materials[1];
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
static void with_first(args *a, fixture *f) { /* of a set */
    (void)f;
    a->count = 0;
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

static void soft_law(void *user, const dem2d_law_input *in, dem2d_law_output *out) {
    (void)user;
    out->normal_force = in->pair.normal_stiffness * in->depth;
    out->tangential_force = 1e-3 * out->normal_force, out->state[0] += 1;
}

static void with_load(args *a, fixture *f) { /* two round grains in contact, by a law */
    dem2d_world_desc d = good_world(NULL);
    const dem2d_save_desc save = {store_write, &f->snapshot};
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

/* --- calls ----------------------------------------------------------------------------------- */

/* SHAPES, OUTLINES, ...: args in the places of the function. */
#define CALL(name, ...)                        \
    static dem2d_result call_##name(args *v) { \
        return dem2d_##name(__VA_ARGS__);      \
    }

CALL(shape_create_circle, v->env, v->x, v->out)
CALL(shape_create_ellipse, v->env, v->x, v->y, v->out)
CALL(shape_create_polygon, v->env, v->points, v->count, v->x, v->out)
CALL(shape_create_bezier, v->env, v->points, v->count, v->out)
CALL(shape_create_fourier, v->env, v->a, v->b, v->count, v->out)
CALL(shape_create_custom, v->env, v->desc, v->out)
CALL(shape_get, v->shape, v->out)
CALL(shape_support, v->shape, v->pose, v->direction, v->out)
CALL(shape_aabb, v->shape, v->pose, v->out)
CALL(shape_outline, v->shape, v->pose, v->count, v->out)
CALL(polygon_mass, v->points, v->count, v->out)
CALL(shape_mass, v->shape, v->out)
CALL(shape_mass_interpolated, v->shape, v->count, v->out)
CALL(image_threshold, v->desc, v->out)
CALL(image_outlines, v->env, v->desc, v->out)
CALL(outline_set_get, v->set, v->count, v->out)
CALL(outline_measure, v->env, v->points, v->count, v->out)
CALL(outline_compare, v->env, v->points, v->count, v->others, v->number, v->out)
CALL(polygon_hull, v->env, v->points, v->count, v->out, v->second)
CALL(fourier_fit, v->env, v->points, v->count, 4, v->number, v->out, v->second)
CALL(fourier_convexity, v->a, v->b, v->count, v->out)
CALL(fourier_reduce, v->a, v->b, v->count, v->desc, v->out)
CALL(bezier_fit, v->env, v->points, v->count, v->number, v->out)
CALL(outline_fit, v->env, v->points, v->count, v->desc, v->out, v->second)
CALL(radial_compare, v->env, v->points, v->count, v->number, v->out)
CALL(fourier_virtual, v->desc, v->count, v->out, v->second)
CALL(shape_contains, v->shape, v->pose, v->vector, v->out)
CALL(pair_overlap, v->shape, v->pose, v->other, v->pose_b, v->desc, v->out)
CALL(pair_distance, v->shape, v->pose, v->other, v->pose_b, v->desc, v->out)
CALL(pair_contact, v->shape, v->pose, v->other, v->pose_b, v->desc, v->out)
CALL(wall_contact, v->shape, v->pose, v->vector, v->direction, v->out)
CALL(world_create, v->desc, v->out)
CALL(world_add_shape, v->world, v->shape, v->out)
CALL(world_remove_shape, v->world, v->shape_id)
CALL(world_add_material, v->world, v->desc, v->out)
CALL(world_set_pair, v->world, v->material, v->material_b, v->desc)
CALL(world_add_particle, v->world, v->desc, v->out)
CALL(world_remove_particle, v->world, v->particle)
CALL(world_get_particle, v->world, v->particle, v->out)
CALL(world_move_particle, v->world, v->particle, v->vector, v->x)
CALL(world_drive_particle, v->world, v->particle, v->motion, v->vector, v->x)
CALL(world_add_wall, v->world, v->desc, v->out)
CALL(world_set_wall, v->world, v->wall, v->desc)
CALL(world_remove_wall, v->world, v->wall)
CALL(world_get_wall, v->world, v->wall, v->out)
CALL(world_set_gravity, v->world, v->vector)
CALL(world_set_damping, v->world, v->x, v->y)
CALL(world_set_time_step, v->world, v->x)
CALL(world_time_step_bounds, v->world, v->out, v->second, v->third)
CALL(world_step, v->world, v->count, v->third)
CALL(world_stats, v->world, v->out)
CALL(world_particles, v->world, v->out, v->count, v->second)
CALL(world_contacts, v->world, v->out, v->count, v->second)
CALL(world_energy, v->world, v->out)
CALL(world_stress, v->world, v->x, v->out)
CALL(world_packing, v->world, v->out)
CALL(world_porosity, v->world, v->region, v->out)
CALL(world_ledger, v->world, v->out)
CALL(world_particle_stress, v->world, v->particle, v->out)
CALL(stress_principal, v->desc, v->out)
CALL(world_fabric, v->world, v->out)
CALL(world_histogram, v->world, (dem2d_histogram)v->number, v->count, v->out)
CALL(world_equilibrium, v->world, v->out)
CALL(world_inertial_number, v->world, v->x, v->y, v->out)
CALL(world_save, v->world, v->desc, NULL)
CALL(world_write_svg, v->world, v->desc, NULL)
CALL(world_write_vtp, v->world, v->desc, NULL)
CALL(world_write_csv, v->world, v->desc, NULL)
CALL(pvd_write, v->env, v->desc, NULL)
CALL(shape_axis, v->shape, v->out, v->second)
CALL(damping_ratio, v->x, v->out)

static dem2d_result call_world_load(args *v) {
    v->snapshot->next = 0;
    return dem2d_world_load(v->desc, NULL, v->out);
}

static dem2d_result call_fourier_fit_order(args *v) { /* its order is number, samples 0 */
    return dem2d_fourier_fit(v->env, v->points, v->count, v->number, 0, v->out, v->second);
}

static dem2d_result call_world_add_segment(args *v) {
    return dem2d_world_add_wall(v->world, v->desc, v->out);
}
static dem2d_result call_world_set_segment(args *v) {
    return dem2d_world_set_wall(v->world, v->wall, v->desc);
}

/* What a call made, when it went well. */
static void free_shape(args *v) {
    dem2d_shape_destroy(*(dem2d_shape **)v->out);
}
static void free_set(args *v) {
    dem2d_outline_set_destroy(*(dem2d_outline_set **)v->out);
}
static void free_world(args *v) {
    dem2d_world_destroy(*(dem2d_world **)v->out);
}

#define ARG(member, name, kind) \
    { name, offsetof(args, member), kind, DEM2D_OK, 0, 0 }
#define ARG_INT(member, name, kind, low, high, result) \
    { name, offsetof(args, member), kind, DEM2D_##result, low, high }
#define POINTS(member, name) \
    ARG(member[0], name, VECTOR), ARG(member[3], name, VECTOR), ARG(member[4], name, VECTOR)
#define OUT ARG(out, "out", POINTER)
#define SECOND ARG(second, "second output", POINTER)
#define IN_WORLD ARG(world, "world", POINTER)
#define ENV ARG(env, "env", OPTIONAL)
#define THE_DESC ARG(desc, "desc", POINTER)
#define THREE_POINTS                                                                               \
    ARG(points, "points", POINTER), ARG_INT(count, "points", INTEGER, 3, INT_MAX, TOO_FEW_POINTS), \
        POINTS(p, "points[")
#define SERIES                                                                     \
    ARG(a, "a", POINTER), ARG(b, "b", POINTER), ARG(series_a[0], "a[0]", LEADING), \
        ARG(series_a[2], "a[2]", FINITE), ARG(series_b[3], "b[3]", FINITE),        \
        ARG(series_b[0], "b[0]", UNREAD),                                          \
        ARG_INT(count, "order", INTEGER, 0, 1 << 20, OUT_OF_RANGE)
#define PAIR_ARGS                                                                \
    ARG(shape, "a", POINTER), ARG(other, "b", POINTER), ARG(pose, "pose", POSE), \
        ARG(pose_b, "pose", POSE), ARG(desc, "desc", OPTIONAL), OUT

static const row rows_shape_create_circle[] = {ENV, ARG(x, "radius", SIZE), OUT};
static const row rows_shape_create_ellipse[] = {ENV, ARG(x, "a", SIZE), ARG(y, "b", SIZE), OUT};
static const row rows_shape_create_polygon[] = {ENV, THREE_POINTS, ARG(x, "rounding", NOT_NEGATIVE),
                                                OUT};
static const row rows_shape_create_bezier[] = {
    ENV, ARG(points, "control", POINTER),
    ARG_INT(count, "arcs", INTEGER, 2, INT_MAX, TOO_FEW_POINTS), POINTS(p, "control["), OUT};
static const row rows_shape_create_fourier[] = {ENV, SERIES, OUT};
static const row rows_shape_create_custom[] = {ENV, THE_DESC, OUT};
static const row rows_shape_get[] = {ARG(shape, "shape", POINTER), OUT};
static const row rows_shape_support[] = {ARG(shape, "shape", POINTER), ARG(pose, "pose", POSE),
                                         ARG(direction, "direction", DIRECTION), OUT};
static const row rows_shape_aabb[] = {ARG(shape, "shape", POINTER), ARG(pose, "pose", POSE), OUT};
static const row rows_shape_outline[] = {
    ARG(shape, "shape", POINTER), ARG(pose, "pose", POSE),
    ARG_INT(count, "count", INTEGER, 3, INT_MAX, TOO_FEW_POINTS), OUT};
static const row rows_polygon_mass[] = {THREE_POINTS, OUT};
static const row rows_shape_mass[] = {ARG(shape, "shape", POINTER), OUT};
static const row rows_shape_mass_interpolated[] = {
    ARG(shape, "shape", POINTER), ARG_INT(count, "count", INTEGER, 3, INT_MAX, TOO_FEW_POINTS),
    OUT};
static const row rows_image_threshold[] = {
    THE_DESC,
    ARG(d.image.pixels, "pixels", POINTER),
    ARG_INT(d.image.width, "width", INTEGER, 1, 1 << 15, OUT_OF_RANGE),
    ARG_INT(d.image.height, "height", INTEGER, 1, 1 << 15, OUT_OF_RANGE),
    ARG_INT(d.image.stride, "stride", INTEGER_OR_0, 8, INT_MAX, OUT_OF_RANGE),
    ARG_INT(d.image.crop_left, "crop_left", INTEGER, 0, 7, OUT_OF_RANGE),
    ARG_INT(d.image.crop_top, "crop_top", INTEGER, 0, 7, OUT_OF_RANGE),
    ARG_INT(d.image.crop_width, "crop_width", INTEGER, 0, 8, OUT_OF_RANGE),
    ARG_INT(d.image.crop_height, "crop_height", INTEGER, 0, 8, OUT_OF_RANGE),
    ARG(d.image.scale, "scale", UNREAD),
    OUT};
static const row rows_image_outlines[] = {ENV, THE_DESC, OUT};
static const row rows_outline_set_get[] = {
    ARG(set, "set", POINTER), ARG_INT(count, "outline", INTEGER, 0, 0, OUT_OF_RANGE), OUT};
static const row rows_outline_measure[] = {ENV, THREE_POINTS, OUT};
static const row rows_outline_compare[] = {
    ENV,
    ARG(points, "reference", POINTER),
    ARG_INT(count, "reference", INTEGER, 3, INT_MAX, TOO_FEW_POINTS),
    POINTS(p, "reference["),
    ARG(others, "other", POINTER),
    ARG_INT(number, "other", INTEGER, 3, INT_MAX, TOO_FEW_POINTS),
    POINTS(q, "other["),
    OUT};
static const row rows_polygon_hull[] = {ENV, THREE_POINTS, OUT, SECOND};
static const row rows_fourier_fit[] = {
    ENV, THREE_POINTS, ARG_INT(number, "samples", INTEGER_OR_0, 9, INT_MAX, OUT_OF_RANGE), OUT,
    SECOND};
static const row rows_fourier_fit_order[] = {
    ENV, THREE_POINTS, ARG_INT(number, "order", INTEGER, 0, 1 << 20, OUT_OF_RANGE), OUT, SECOND};
static const row rows_fourier_convexity[] = {SERIES, OUT};
static const row rows_fourier_reduce[] = {SERIES, THE_DESC, ARG(out, "reductions", OPTIONAL)};
static const row rows_bezier_fit[] = {
    ENV, THREE_POINTS, ARG_INT(number, "arcs", INTEGER, 3, 1 << 20, OUT_OF_RANGE), OUT};
static const row rows_outline_fit[] = {ENV, THREE_POINTS, THE_DESC, OUT,
                                       ARG(second, "report", OPTIONAL)};
static const row rows_radial_compare[] = {
    ENV, THREE_POINTS, ARG_INT(number, "order", INTEGER, 0, 719, OUT_OF_RANGE), OUT};
static const row rows_fourier_virtual[] = {
    THE_DESC, ARG_INT(count, "order", INTEGER, 0, 1 << 20, OUT_OF_RANGE), OUT, SECOND};
static const row rows_shape_contains[] = {ARG(shape, "shape", POINTER), ARG(pose, "pose", POSE),
                                          ARG(vector, "point", VECTOR), OUT};
static const row rows_pair_overlap[] = {PAIR_ARGS};
static const row rows_pair_distance[] = {PAIR_ARGS};
static const row rows_pair_contact[] = {PAIR_ARGS};
static const row rows_wall_contact[] = {ARG(shape, "shape", POINTER), ARG(pose, "pose", POSE),
                                        ARG(vector, "point", VECTOR),
                                        ARG(direction, "wall_normal", DIRECTION), OUT};
static const row rows_world_create[] = {THE_DESC, OUT};
static const row rows_world_add_shape[] = {IN_WORLD, ARG(shape, "shape", POINTER), OUT};
static const row rows_world_remove_shape[] = {IN_WORLD, ARG(shape_id, "shape", SHAPE_ID)};
static const row rows_world_add_material[] = {IN_WORLD, THE_DESC, OUT};
static const row rows_world_set_pair[] = {IN_WORLD, ARG(material, "material", MATERIAL_ID),
                                          ARG(material_b, "material", MATERIAL_ID), THE_DESC};
static const row rows_world_add_particle[] = {IN_WORLD, THE_DESC, OUT};
static const row rows_world_remove_particle[] = {IN_WORLD, ARG(particle, "particle", PARTICLE_ID)};
static const row rows_world_get_particle[] = {IN_WORLD, ARG(particle, "particle", PARTICLE_ID),
                                              OUT};
static const row rows_world_move_particle[] = {IN_WORLD, ARG(particle, "particle", PARTICLE_ID),
                                               ARG(vector, "position", VECTOR),
                                               ARG(x, "angle", ANGLE)};
static const row rows_world_drive_particle[] = {IN_WORLD, ARG(particle, "particle", PARTICLE_ID),
                                                ARG_INT(motion, "motion", ENUM, 0, 2, OUT_OF_RANGE),
                                                ARG(vector, "velocity", VECTOR),
                                                ARG(x, "angular_velocity", FINITE)};
static const row rows_world_add_wall[] = {IN_WORLD, THE_DESC, OUT};
static const row rows_world_set_wall[] = {IN_WORLD, ARG(wall, "wall", WALL_ID), THE_DESC};
static const row rows_world_remove_wall[] = {IN_WORLD, ARG(wall, "wall", WALL_ID)};
static const row rows_world_get_wall[] = {IN_WORLD, ARG(wall, "wall", WALL_ID), OUT};
static const row rows_world_set_gravity[] = {IN_WORLD, ARG(vector, "gravity", VECTOR)};
static const row rows_world_set_damping[] = {IN_WORLD, ARG(x, "local_damping", FRACTION),
                                             ARG(y, "global_damping", NOT_NEGATIVE)};
static const row rows_world_set_time_step[] = {IN_WORLD, ARG(x, "time_step", POSITIVE)};
static const row rows_world_time_step_bounds[] = {IN_WORLD, OUT, SECOND,
                                                  ARG(third, "limit_particle", OPTIONAL)};
static const row rows_world_step[] = {IN_WORLD,
                                      ARG_INT(count, "count", INTEGER, 0, INT_MAX, OUT_OF_RANGE),
                                      ARG(third, "done", OPTIONAL)};
static const row rows_world_stats[] = {IN_WORLD, OUT};
static const row rows_world_particles[] = {
    IN_WORLD, OUT, ARG_INT(count, "capacity", INTEGER, 0, INT_MAX, OUT_OF_RANGE), SECOND};
static const row rows_world_contacts[] = {
    IN_WORLD, OUT, ARG_INT(count, "capacity", INTEGER, 0, INT_MAX, OUT_OF_RANGE), SECOND};
static const row rows_world_energy[] = {IN_WORLD, OUT};
static const row rows_world_stress[] = {IN_WORLD, ARG(x, "area", POSITIVE), OUT};
static const row rows_world_packing[] = {IN_WORLD, OUT};
static const row rows_world_porosity[] = {IN_WORLD, ARG(region, "region", POINTER),
                                          ARG(box.lower, "region", VECTOR),
                                          ARG(box.upper, "region", UPPER), OUT};
static const row rows_world_ledger[] = {IN_WORLD, OUT};
static const row rows_world_particle_stress[] = {IN_WORLD, ARG(particle, "particle", PARTICLE_ID),
                                                 OUT};
static const row rows_stress_principal[] = {
    ARG(desc, "stress", POINTER),   ARG(d.stress.xx, "xx", FINITE), ARG(d.stress.xy, "xy", FINITE),
    ARG(d.stress.yx, "yx", FINITE), ARG(d.stress.yy, "yy", FINITE), OUT};
static const row rows_world_fabric[] = {IN_WORLD, OUT};
static const row rows_world_histogram[] = {
    IN_WORLD, ARG_INT(number, "kind", ENUM, 0, DEM2D_HISTOGRAM_COUNT - 1, OUT_OF_RANGE),
    ARG_INT(count, "bins", INTEGER, 1, INT_MAX, OUT_OF_RANGE), OUT};
static const row rows_world_equilibrium[] = {IN_WORLD, OUT};
static const row rows_world_inertial_number[] = {IN_WORLD, ARG(x, "strain_rate", FINITE),
                                                 ARG(y, "pressure", POSITIVE), OUT};
static const row rows_world_save[] = {IN_WORLD, THE_DESC};
static const row rows_world_load[] = {THE_DESC, OUT};
static const row rows_world_write_svg[] = {IN_WORLD, THE_DESC};
static const row rows_world_write_vtp[] = {IN_WORLD, THE_DESC};
#define NAMES(kind, text, numbers)                                                                 \
    ARG(names[0], text, kind), ARG(names[NAMED - 1], text, kind), ARG(values[0], numbers, FINITE), \
        ARG(values[NAMED - 1], numbers, FINITE)
static const row rows_world_write_csv[] = {IN_WORLD, THE_DESC, NAMES(COLUMN, "names", "values")};
static const row rows_pvd_write[] = {ENV, THE_DESC, NAMES(FILE_NAME, "files", "times")};
static const row rows_shape_axis[] = {ARG(shape, "shape", POINTER), OUT, SECOND};
static const row rows_damping_ratio[] = {ARG(x, "restitution", PORTION), OUT};
static const row rows_world_add_segment[] = {IN_WORLD, THE_DESC, OUT};
static const row rows_world_set_segment[] = {IN_WORLD, ARG(wall, "wall", WALL_ID), THE_DESC};

/* --- the table ------------------------------------------------------------------------------- */

typedef struct function {
    const char *name; /* without dem2d_ */
    dem2d_result (*call)(args *v);
    const row *rows;
    int count;
    int desc;                             /* its desc, or -1 */
    void (*prepare)(args *v, fixture *f); /* beyond args_make */
    void (*release)(args *v);             /* of what it made, or NULL */
    bool logs;                            /* has an environment and names what is wrong */
} function;

#define ROW(name, desc, prepare, release, logs) \
    { #name, call_##name, rows_##name, COUNT_OF(rows_##name), desc, prepare, release, logs }
#define PLAIN(name) ROW(name, -1, with_nothing, NULL, false)
#define LOGS(name) ROW(name, -1, with_nothing, NULL, true)
#define MAKES(name, desc, prepare, release) ROW(name, desc, prepare, release, true)
#define DESCRIBED(name, desc, prepare) ROW(name, desc, prepare, NULL, true)
#define SILENT(name, desc, prepare) ROW(name, desc, prepare, NULL, false)

static const function functions[] = {
    MAKES(shape_create_circle, -1, with_nothing, free_shape),
    MAKES(shape_create_ellipse, -1, with_nothing, free_shape),
    MAKES(shape_create_polygon, -1, with_nothing, free_shape),
    MAKES(shape_create_bezier, -1, with_control, free_shape),
    MAKES(shape_create_fourier, -1, with_nothing, free_shape),
    MAKES(shape_create_custom, CUSTOM, with_custom, free_shape),
    PLAIN(shape_get),
    PLAIN(shape_support),
    PLAIN(shape_aabb),
    PLAIN(shape_outline),
    PLAIN(polygon_mass),
    PLAIN(shape_mass),
    PLAIN(shape_mass_interpolated),
    SILENT(image_threshold, -1, with_image),
    MAKES(image_outlines, IMAGE, with_image, free_set),
    DESCRIBED(outline_set_get, -1, with_first),
    LOGS(outline_measure),
    LOGS(outline_compare),
    LOGS(polygon_hull),
    DESCRIBED(fourier_fit, -1, with_samples),
    LOGS(fourier_fit_order),
    PLAIN(fourier_convexity),
    SILENT(fourier_reduce, REDUCTION, with_nothing),
    LOGS(bezier_fit),
    MAKES(outline_fit, FIT, with_fit, free_shape),
    LOGS(radial_compare),
    SILENT(fourier_virtual, VIRTUAL, with_virtual),
    PLAIN(shape_contains),
    SILENT(pair_overlap, CONTACT, with_nothing),
    SILENT(pair_distance, CONTACT, with_nothing),
    SILENT(pair_contact, CONTACT, with_nothing),
    PLAIN(wall_contact),
    MAKES(world_create, WORLD, with_world, free_world),
    LOGS(world_add_shape),
    LOGS(world_remove_shape),
    DESCRIBED(world_add_material, MATERIAL, with_material),
    DESCRIBED(world_set_pair, PAIR, with_pair),
    DESCRIBED(world_add_particle, PARTICLE, with_particle),
    LOGS(world_remove_particle),
    LOGS(world_get_particle),
    LOGS(world_move_particle),
    LOGS(world_drive_particle),
    DESCRIBED(world_add_wall, WALL, with_wall),
    DESCRIBED(world_set_wall, WALL, with_wall),
    LOGS(world_remove_wall),
    LOGS(world_get_wall),
    LOGS(world_set_gravity),
    LOGS(world_set_damping),
    LOGS(world_set_time_step),
    LOGS(world_time_step_bounds),
    LOGS(world_step),
    LOGS(world_stats),
    LOGS(world_particles),
    LOGS(world_contacts),
    LOGS(world_energy),
    LOGS(world_stress),
    LOGS(world_packing),
    LOGS(world_porosity),
    LOGS(world_ledger),
    LOGS(world_particle_stress),
    SILENT(stress_principal, -1, with_stress),
    LOGS(world_fabric),
    LOGS(world_histogram),
    LOGS(world_equilibrium),
    LOGS(world_inertial_number),
    DESCRIBED(world_save, SAVE, with_save),
    MAKES(world_load, LOAD, with_load, free_world),
    DESCRIBED(world_write_svg, SVG, with_svg),
    DESCRIBED(world_write_vtp, VTP, with_vtp),
    DESCRIBED(world_write_csv, CSV, with_csv),
    DESCRIBED(pvd_write, PVD, with_pvd),
    PLAIN(shape_axis),
    PLAIN(damping_ratio),
    DESCRIBED(world_add_segment, SEGMENT, with_segment),
    DESCRIBED(world_set_segment, SEGMENT, with_segment),
};

#endif
