/* ledger_scenes.h - random scenes for the closure of the ledger: shapes of all kinds, dashpots,
   friction, rolling friction, damping, walls that move and that hold a stress, grains that are
   driven, fixed, added and removed. A seed and a class give a scene; the time step only refines it.
   Include it after dem2d.h. */
#ifndef LEDGER_SCENES_H
#define LEDGER_SCENES_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Smooth: all corners are rounded, walls are half-planes. Sharp: polygons with corners, and a floor
   that is a chain of segments. */
typedef enum ledger_class { LEDGER_SMOOTH, LEDGER_SHARP, LEDGER_CLASSES } ledger_class;

static const char *const ledger_names[LEDGER_CLASSES] = {"rounded corners", "sharp, segments"};
/* Allowed closure, of the turnover, at 1/32 of a contact; of rounded corners, a quarter of it at
   half the step. */
static const double ledger_most[LEDGER_CLASSES] = {3e-4, 1e-3};

enum { LEDGER_SIDE = 5, LEDGER_KINDS = 6, LEDGER_EDITS = 6 };

typedef struct ledger_scene {
    dem2d_world *world;
    dem2d_material_id materials[2];
    dem2d_shape_id shapes[LEDGER_KINDS];
    dem2d_wall_id left, right;
    dem2d_particle_id driven[2];
    dem2d_particle_id victims[LEDGER_EDITS]; /* which are removed by and by */
    double contact_time; /* s, of the two lightest, along the normal: pi sqrt(m/(2 kn)) */
    double radius;       /* m, mean */
    uint64_t random;
} ledger_scene;

static void ledger_must(dem2d_result result, const char *what) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "ledger: %s: %s\n", what, dem2d_result_text(result));
    exit(1);
}

/* Uniform in [lower, upper): splitmix64. */
static double ledger_uniform(ledger_scene *s, double lower, double upper) {
    uint64_t z = (s->random += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return lower + (upper - lower) * ((double)((z ^ (z >> 31)) >> 11) * (1 / 9007199254740992.0));
}

static bool ledger_coin(ledger_scene *s) {
    return ledger_uniform(s, 0, 1) < 0.5;
}

static dem2d_vec ledger_vec(double x, double y) {
    dem2d_vec v;
    v.x = x, v.y = y;
    return v;
}

/* Templates of about unit size: two polygons, a circle, an ellipse, a series, a polybezier. */
static dem2d_shape *ledger_shape(ledger_scene *s, ledger_class kind, int number) {
    dem2d_shape *shape = NULL;
    dem2d_vec p[12];
    const double rounding = kind == LEDGER_SHARP ? 0 : 0.2;
    if (number < 2) { /* sides in pairs, and any */
        const int sides = number == 0 ? 4 : 5;
        for (int k = 0; k < sides; k++) {
            const double off = number == 0 ? 0.15 * (k % 2) : ledger_uniform(s, -0.2, 0.2);
            const dem2d_rot q = dem2d_rot_make(6.283185307179586 * (k + off) / sides);
            p[k] = ledger_vec(q.c, q.s);
        }
        ledger_must(dem2d_shape_create_polygon(NULL, p, sides, rounding, &shape), "polygon");
    } else if (number == 2) {
        ledger_must(dem2d_shape_create_circle(NULL, 1, &shape), "circle");
    } else if (number == 3) {
        ledger_must(dem2d_shape_create_ellipse(NULL, 1.3, 0.8, &shape), "ellipse");
    } else if (number == 4) {
        const double a[4] = {2, 0, 0.12, 0.03}, b[4] = {0, 0, 0.03, 0.02};
        ledger_must(dem2d_shape_create_fourier(NULL, a, b, 3, &shape), "series");
    } else {
        const double reach[4] = {1.2, 0.9, 0.8, 1.1}, handle = 0.5522847498;
        static const int axis[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
        for (int i = 0; i < 4; i++) {
            const int j = (i + 1) % 4;
            const dem2d_vec u = ledger_vec(reach[i] * axis[i][0], reach[i] * axis[i][1]);
            const dem2d_vec v = ledger_vec(reach[j] * axis[j][0], reach[j] * axis[j][1]);
            p[3 * i] = u;
            p[3 * i + 1] = ledger_vec(u.x + handle * v.x, u.y + handle * v.y);
            p[3 * i + 2] = ledger_vec(v.x + handle * u.x, v.y + handle * u.y);
        }
        ledger_must(dem2d_shape_create_bezier(NULL, p, 4, &shape), "polybezier");
    }
    return shape;
}

static dem2d_particle_id ledger_grain(ledger_scene *s, double x, double y, double size,
                                      dem2d_motion motion) {
    dem2d_particle_desc grain;
    dem2d_particle_id id;
    memset(&grain, 0, sizeof grain);
    grain.scale = s->radius * ledger_uniform(s, 0.75, 1) * size;
    const int kind = (int)ledger_uniform(s, 0, 2 * LEDGER_KINDS); /* polygons are most */
    grain.shape = s->shapes[kind < LEDGER_KINDS ? kind : kind % 2];
    grain.material = s->materials[ledger_coin(s)];
    grain.motion = motion;
    grain.position = ledger_vec(x, y);
    grain.angle = ledger_uniform(s, 0, 7);
    if (motion != DEM2D_FIXED) {
        const double speed = motion == DEM2D_DRIVEN ? 0.2 : 1;
        grain.velocity.x = ledger_uniform(s, -speed, speed);
        grain.velocity.y = ledger_uniform(s, -speed, speed);
        grain.angular_velocity = ledger_uniform(s, -10, 10);
    }
    ledger_must(dem2d_world_add_particle(s->world, &grain, &id), "grain");
    return id;
}

static dem2d_wall_id ledger_wall(ledger_scene *s, dem2d_vec point, dem2d_vec normal, double speed) {
    dem2d_wall_desc wall;
    dem2d_wall_id id;
    memset(&wall, 0, sizeof wall);
    wall.material = s->materials[0];
    wall.point = point, wall.normal = normal;
    if (speed != 0) wall.mode = DEM2D_WALL_MOVING;
    wall.velocity = ledger_vec(speed * normal.x, speed * normal.y);
    ledger_must(dem2d_world_add_wall(s->world, &wall, &id), "wall");
    return id;
}

/* A floor: a half-plane, or a chain of segments that go up and down a little. Its ends are behind
   the other walls. */
static void ledger_floor(ledger_scene *s, ledger_class kind, double width) {
    if (kind == LEDGER_SMOOTH) {
        (void)ledger_wall(s, ledger_vec(0, 0), ledger_vec(0, 1), 0);
        return;
    }
    for (int i = 0; i < 4; i++) {
        dem2d_wall_desc wall;
        dem2d_wall_id id;
        memset(&wall, 0, sizeof wall);
        wall.material = s->materials[0], wall.segment = true;
        wall.point = ledger_vec(width * (-0.5 + 0.5 * i), -0.02 * width * (i % 2));
        wall.end = ledger_vec(width * 0.5 * i, -0.02 * width * ((i + 1) % 2));
        ledger_must(dem2d_world_add_wall(s->world, &wall, &id), "segment");
    }
}

/* The four sides of a box: one moves in, the lid holds a stress. */
static void ledger_box(ledger_scene *s, ledger_class kind, double width) {
    dem2d_wall_desc lid;
    dem2d_wall_id id;
    s->left = ledger_wall(s, ledger_vec(0, 0), ledger_vec(1, 0), ledger_uniform(s, 0, 0.1));
    s->right = ledger_wall(s, ledger_vec(width, 0), ledger_vec(-1, 0), 0);
    ledger_floor(s, kind, width);
    memset(&lid, 0, sizeof lid);
    lid.material = s->materials[0], lid.mode = DEM2D_WALL_SERVO;
    lid.point = ledger_vec(0, width), lid.normal = ledger_vec(0, -1);
    lid.stress = ledger_uniform(s, 1e3, 1e4), lid.max_speed = 0.3;
    lid.spans[0] = s->left, lid.spans[1] = s->right;
    ledger_must(dem2d_world_add_wall(s->world, &lid, &id), "lid");
}

static void ledger_materials(ledger_scene *s) {
    for (int k = 0; k < 2; k++) {
        dem2d_material_desc m;
        memset(&m, 0, sizeof m);
        m.density = 2700, m.normal_stiffness = ledger_uniform(s, 0.5e7, 1e7);
        m.tangential_stiffness = m.normal_stiffness * ledger_uniform(s, 0.2, 1);
        m.friction = ledger_uniform(s, 0.1, 0.8);
        m.damping_ratio = ledger_coin(s) ? ledger_uniform(s, 0.02, 0.4) : 0;
        m.rolling_friction = ledger_coin(s) ? ledger_uniform(s, 0.02, 0.2) : 0;
        ledger_must(dem2d_world_add_material(s->world, &m, &s->materials[k]), "material");
    }
}

/* 25 grains, of which one is fixed and two are driven, with 1/steps of a contact as the time step.
 */
static ledger_scene ledger_scene_make(ledger_class kind, int seed, double steps) {
    ledger_scene s;
    dem2d_world_desc desc;
    memset(&s, 0, sizeof s);
    memset(&desc, 0, sizeof desc);
    s.random = 0x51ed2701u * (uint64_t)(seed + 1), s.radius = 0.04;
    const double pitch = 2.6 * s.radius, width = LEDGER_SIDE * pitch;
    const double least = 0.75 * 0.7 * s.radius, lightest = 2700 * 1.9 * least * least;
    s.contact_time = 3.141592653589793 * sqrt(lightest / 2 / 1e7);
    desc.time_step = s.contact_time / steps, desc.ledger = true;
    if (ledger_coin(&s)) desc.gravity = ledger_vec(ledger_uniform(&s, -3, 3), -9.81);
    desc.local_damping = ledger_coin(&s) ? ledger_uniform(&s, 0, 0.3) : 0;
    desc.global_damping = ledger_coin(&s) ? ledger_uniform(&s, 0, 5) : 0;
    desc.contact_tolerance = 1e-12;
    ledger_must(dem2d_world_create(&desc, &s.world), "world");
    ledger_materials(&s);
    for (int k = 0; k < LEDGER_KINDS; k++) {
        dem2d_shape *shape = ledger_shape(&s, kind, k);
        ledger_must(dem2d_world_add_shape(s.world, shape, &s.shapes[k]), "shape");
        dem2d_shape_destroy(shape);
    }
    ledger_box(&s, kind, width);
    for (int i = 0; i < LEDGER_SIDE * LEDGER_SIDE; i++) {
        const double x = pitch * (i % LEDGER_SIDE + 0.5), y = pitch * (i / LEDGER_SIDE + 0.5);
        const dem2d_motion motion = i == 6               ? DEM2D_FIXED
                                    : i == 12 || i == 18 ? DEM2D_DRIVEN
                                                         : DEM2D_FREE;
        const dem2d_particle_id id = ledger_grain(&s, x, y, 1, motion);
        if (motion == DEM2D_DRIVEN) s.driven[i / 18] = id;
        if (i % 4 == 0 && i / 4 < LEDGER_EDITS && motion == DEM2D_FREE) s.victims[i / 4] = id;
    }
    return s;
}

/* Driven grains go back and forth. */
static void ledger_reverse(const ledger_scene *s) {
    for (int k = 0; k < 2; k++) {
        dem2d_particle_info g;
        ledger_must(dem2d_world_get_particle(s->world, s->driven[k], &g), "driven");
        const dem2d_vec back = ledger_vec(-g.velocity.x, -g.velocity.y);
        ledger_must(dem2d_world_drive_particle(s->world, s->driven[k], DEM2D_DRIVEN, back,
                                               -g.angular_velocity),
                    "reversal");
    }
}

/* A grain goes and a smaller one takes its place, or it gets other velocities. */
static void ledger_edit(ledger_scene *s, dem2d_particle_id victim, bool removed) {
    dem2d_particle_info g;
    if (victim.generation == 0) return;
    ledger_must(dem2d_world_get_particle(s->world, victim, &g), "grain");
    if (removed) {
        ledger_must(dem2d_world_remove_particle(s->world, victim), "removal");
        (void)ledger_grain(s, g.pose.position.x, g.pose.position.y, 0.7, DEM2D_FREE);
        return;
    }
    const dem2d_vec v = ledger_vec(ledger_uniform(s, -1, 1), ledger_uniform(s, -1, 1));
    ledger_must(dem2d_world_drive_particle(s->world, victim, DEM2D_FREE, v, 3), "velocities");
}

/* The ledger after so many contact times, with a few edits in between. */
static dem2d_ledger ledger_scene_run(ledger_class kind, int seed, double steps, double times) {
    ledger_scene s = ledger_scene_make(kind, seed, steps);
    dem2d_ledger ledger;
    const int part = (int)(times * steps / (LEDGER_EDITS + 1));
    for (int k = 0; k <= LEDGER_EDITS; k++) {
        ledger_must(dem2d_world_step(s.world, part, NULL), "step");
        if (k == LEDGER_EDITS) break;
        ledger_reverse(&s);
        ledger_edit(&s, s.victims[k], k % 2 == 0);
    }
    ledger_must(dem2d_world_ledger(s.world, &ledger), "ledger");
    dem2d_world_destroy(s.world);
    return ledger;
}

static int ledger_order(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Sorts them. */
static double ledger_median(double *values, int count) {
    qsort(values, (size_t)count, sizeof *values, ledger_order);
    return (values[(count - 1) / 2] + values[count / 2]) / 2;
}

#endif
