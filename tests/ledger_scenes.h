/* ledger_scenes.h - random scenes for the closure of the ledger: shapes of all kinds, dashpots,
   friction, rolling friction, damping, walls that move and that hold a stress, grains that are
   driven, fixed, added and removed. A seed and a class give a scene; the time step only refines it.
   Include it after dem2d.h. */
#ifndef LEDGER_SCENES_H
#define LEDGER_SCENES_H

#include "world_scene.h"

/* Smooth: all corners are rounded, walls are half-planes. Sharp: polygons with corners, and a floor
   that is a chain of segments. */
typedef enum ledger_class { LEDGER_SMOOTH, LEDGER_SHARP, LEDGER_CLASSES } ledger_class;

static const char *const ledger_names[LEDGER_CLASSES] = {"rounded corners", "sharp, segments"};
/* Allowed closure, of the turnover, at 1/32 of a contact; of rounded corners, a quarter of it at
   half the step. */
static const double ledger_most[LEDGER_CLASSES] = {3e-4, 1e-3};

enum { LEDGER_SIDE = 5, LEDGER_KINDS = 6, LEDGER_EDITS = 6 };

typedef struct ledger_scene {
    scene base; /* its material is one of the two */
    dem2d_material_id other;
    dem2d_shape_id shapes[LEDGER_KINDS];
    dem2d_wall_id left, right;
    dem2d_particle_id driven[2];
    dem2d_particle_id victims[LEDGER_EDITS]; /* which are removed by and by */
    double contact_time; /* s, of the two lightest, along the normal: pi sqrt(m/(2 kn)) */
    double radius;       /* m, mean */
    uint64_t random;
} ledger_scene;

static bool ledger_coin(ledger_scene *s) {
    return random_between(&s->random, 0, 1) < 0.5;
}

/* Templates of about unit size: two polygons, a circle, an ellipse, a series, a polybezier. */
static dem2d_shape *ledger_shape(ledger_scene *s, ledger_class kind, int number) {
    static const double reach[4] = {1.2, 0.9, 0.8, 1.1};
    static const double a[4] = {2, 0, 0.12, 0.03}, b[4] = {0, 0, 0.03, 0.02};
    const int sides = number == 0 ? 4 : 5;
    dem2d_vec p[5];
    if (number == 2) return make_disc(1);
    if (number == 3) return make_ellipse(1.3, 0.8);
    if (number == 4) return make_series(a, b, 3);
    if (number == 5) return make_oval(reach, 0.5522847498);
    for (int k = 0; k < sides; k++) { /* sides in pairs, and any */
        const double off = number == 0 ? 0.15 * (k % 2) : random_between(&s->random, -0.2, 0.2);
        const dem2d_rot q = dem2d_rot_make(6.283185307179586 * (k + off) / sides);
        p[k] = vec(q.c, q.s);
    }
    return make_polygon(p, sides, kind == LEDGER_SHARP ? 0 : 0.2);
}

static dem2d_particle_id ledger_grain(ledger_scene *s, double x, double y, double size,
                                      dem2d_motion motion) {
    const double scale = s->radius * random_between(&s->random, 0.75, 1) * size;
    const int kind = (int)random_between(&s->random, 0, 2 * LEDGER_KINDS); /* polygons are most */
    dem2d_particle_desc grain =
        grain_desc(&s->base, s->shapes[kind < LEDGER_KINDS ? kind : kind % 2], scale, vec(x, y));
    if (ledger_coin(s)) grain.material = s->other;
    grain.motion = motion;
    grain.angle = random_between(&s->random, 0, 7);
    if (motion != DEM2D_FIXED) {
        const double speed = motion == DEM2D_DRIVEN ? 0.2 : 1;
        grain.velocity.x = random_between(&s->random, -speed, speed);
        grain.velocity.y = random_between(&s->random, -speed, speed);
        grain.angular_velocity = random_between(&s->random, -10, 10);
    }
    return add_grain(&s->base, &grain);
}

/* A floor: a half-plane, or a chain of segments that go up and down a little. Its ends are behind
   the other walls. */
static void ledger_floor(const scene *s, ledger_class kind, double width) {
    if (kind == LEDGER_SMOOTH) (void)add_floor(s);
    for (int i = 0; i < 4 && kind == LEDGER_SHARP; i++)
        (void)add_segment(s, vec(width * (-0.5 + 0.5 * i), -0.02 * width * (i % 2)),
                          vec(width * 0.5 * i, -0.02 * width * ((i + 1) % 2)));
}

/* The four sides of a box: one moves in, the lid holds a stress. */
static void ledger_box(ledger_scene *s, ledger_class kind, double width) {
    dem2d_wall_desc left = plane_desc(&s->base, vec(0, 0), vec(1, 0));
    dem2d_wall_desc lid = plane_desc(&s->base, vec(0, width), vec(0, -1));
    left.mode = DEM2D_WALL_MOVING, left.velocity.x = random_between(&s->random, 0, 0.1);
    s->left = add_wall(&s->base, &left);
    s->right = add_plane(&s->base, width, 0, -1, 0);
    ledger_floor(&s->base, kind, width);
    lid.mode = DEM2D_WALL_SERVO;
    lid.stress = random_between(&s->random, 1e3, 1e4), lid.max_speed = 0.3;
    lid.spans[0] = s->left, lid.spans[1] = s->right;
    (void)add_wall(&s->base, &lid);
}

static dem2d_material_desc ledger_material(ledger_scene *s) {
    dem2d_material_desc m = stone_desc(0, 0);
    m.normal_stiffness = random_between(&s->random, 0.5e7, 1e7);
    m.tangential_stiffness = m.normal_stiffness * random_between(&s->random, 0.2, 1);
    m.friction = random_between(&s->random, 0.1, 0.8);
    m.damping_ratio = ledger_coin(s) ? random_between(&s->random, 0.02, 0.4) : 0;
    m.rolling_friction = ledger_coin(s) ? random_between(&s->random, 0.02, 0.2) : 0;
    return m;
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
    if (ledger_coin(&s)) desc.gravity = vec(random_between(&s.random, -3, 3), -9.81);
    desc.local_damping = ledger_coin(&s) ? random_between(&s.random, 0, 0.3) : 0;
    desc.global_damping = ledger_coin(&s) ? random_between(&s.random, 0, 5) : 0;
    desc.contact_tolerance = 1e-12;
    const dem2d_material_desc one = ledger_material(&s), other = ledger_material(&s);
    s.base = open_scene(&desc, &one);
    expect_ok(dem2d_world_add_material(s.base.world, &other, &s.other), "material");
    for (int k = 0; k < LEDGER_KINDS; k++)
        s.shapes[k] = give_shape(&s.base, ledger_shape(&s, kind, k));
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
        const dem2d_particle_info g = grain_of(&s->base, s->driven[k]);
        set_velocity(&s->base, s->driven[k], DEM2D_DRIVEN, vec(-g.velocity.x, -g.velocity.y),
                     -g.angular_velocity);
    }
}

/* A grain goes and a smaller one takes its place, or it gets other velocities. */
static void ledger_edit(ledger_scene *s, dem2d_particle_id victim, bool removed) {
    if (victim.generation == 0) return;
    const dem2d_vec at = grain_of(&s->base, victim).pose.position;
    if (removed) {
        expect_ok(dem2d_world_remove_particle(s->base.world, victim), "removal");
        (void)ledger_grain(s, at.x, at.y, 0.7, DEM2D_FREE);
        return;
    }
    const double y = random_between(&s->random, -1, 1), x = random_between(&s->random, -1, 1);
    set_velocity(&s->base, victim, DEM2D_FREE, vec(x, y), 3);
}

/* The ledger after so many contact times, with a few edits in between. */
static dem2d_ledger ledger_scene_run(ledger_class kind, int seed, double steps, double times) {
    ledger_scene s = ledger_scene_make(kind, seed, steps);
    const int part = (int)(times * steps / (LEDGER_EDITS + 1));
    for (int k = 0; k <= LEDGER_EDITS; k++) {
        step(&s.base, part);
        if (k == LEDGER_EDITS) break;
        ledger_reverse(&s);
        ledger_edit(&s, s.victims[k], k % 2 == 0);
    }
    const dem2d_ledger ledger = ledger_of(&s.base);
    close_scene(&s.base);
    return ledger;
}

#endif
