/* stress.h - what the cases of stress.c share: the table, templates of six kinds, scenes of many
   grains and what can be seen of them. Include it after dem2d.h. */
#ifndef STRESS_H
#define STRESS_H

#include "world_scene.h"

#include <float.h>
#include <stdarg.h>

#define PI 3.14159265358979323846

/* --- the table -------------------------------------------------------------------------------- */

static bool quick;
static int rows, failures;

PART void row(bool pass, const char *name, const char *criterion, const char *format, ...) {
    char got[160];
    va_list list;
    va_start(list, format);
    vsnprintf(got, sizeof got, format, list);
    va_end(list);
    printf("%-36s %-52s %-44s %s\n", name, criterion, got, pass ? "pass" : "FAIL");
    fflush(stdout);
    rows++, failures += !pass;
}

/* --- the log of a world ----------------------------------------------------------------------- */

typedef struct message {
    dem2d_result result;
    int index, count;
    char text[256];
} message;

static void keep_message(void *user, dem2d_result result, int index, const char *text) {
    message *m = user;
    m->result = result, m->index = index, m->count++;
    snprintf(m->text, sizeof m->text, "%s", text);
}

static message log_of_world;
static dem2d_env env = {&log_of_world, NULL, NULL, keep_message};

/* --- templates: six kinds, four variants of each ---------------------------------------------- */

enum { DISC, ELLIPSE, BEZIER, SERIES, ROUNDED, SHARP, KINDS };
static const char *const kind_names[KINDS] = {"discs",          "ellipses",         "polybeziers",
                                              "Fourier series", "rounded polygons", "polygons"};

enum { MOST_GRAINS = 1024, MOST_WALLS = 4, VARIANTS = 4 };

static dem2d_shape *make_kind(int kind, int variant) {
    const double long_axis = 1.1 + 0.2 * variant, reach[4] = {long_axis, 0.9, 0.8, 1.1};
    const double a[6] = {2, 0, 0.1, 0.03, 0.005, 0}, b[6] = {0, 0, 0.02 * variant, 0.02, 0, 0.002};
    const int sides = 4 + variant; /* corners on a circle at uneven angles */
    dem2d_vec p[3 + VARIANTS];
    if (kind == DISC) return make_disc(1);
    if (kind == ELLIPSE) return make_ellipse(long_axis, 1);
    if (kind == SERIES) return make_series(a, b, 5);
    if (kind == BEZIER) return make_oval(reach, 0.5522847498);
    random_state = (uint64_t)(100 + variant);
    for (int k = 0; k < sides; k++) {
        const dem2d_rot q = dem2d_rot_make(2 * PI * (k + uniform(-0.25, 0.25)) / sides);
        p[k] = vec(q.c, q.s);
    }
    return make_polygon(p, sides, kind == ROUNDED ? 0.15 : 0);
}

/* --- scenes of many grains -------------------------------------------------------------------- */

typedef struct stress_scene {
    scene base;
    dem2d_shape_id shapes[KINDS][VARIANTS];
    double scale[KINDS][VARIANTS]; /* to area pi */
    dem2d_particle_id grains[MOST_GRAINS];
    dem2d_wall_id walls[MOST_WALLS];
    int grain_count, wall_count;
} stress_scene;

static stress_scene make_scene(const dem2d_world_desc *desc, const dem2d_material_desc *material) {
    stress_scene s;
    dem2d_world_desc with_log = *desc;
    with_log.env = &env;
    memset(&s, 0, sizeof s);
    memset(&log_of_world, 0, sizeof log_of_world);
    s.base = open_scene(&with_log, material);
    for (int kind = 0; kind < KINDS; kind++)
        for (int variant = 0; variant < VARIANTS; variant++) {
            dem2d_shape *shape = make_kind(kind, variant);
            dem2d_shape_info info;
            expect_ok(dem2d_shape_get(shape, &info), "shape");
            s.scale[kind][variant] = 1 / info.equivalent;
            s.shapes[kind][variant] = give_shape(&s.base, shape);
        }
    random_state = 1;
    return s;
}

static void end_scene(stress_scene *s) {
    close_scene(&s->base);
}

/* A grain of radius (that of equal area) at rest. */
static dem2d_particle_desc kind_desc(const stress_scene *s, int kind, int variant, double radius,
                                     double x, double y) {
    return grain_desc(&s->base, s->shapes[kind][variant], radius * s->scale[kind][variant],
                      vec(x, y));
}

static dem2d_particle_id add_desc(stress_scene *s, const dem2d_particle_desc *d) {
    const dem2d_particle_id id = add_grain(&s->base, d);
    if (s->grain_count < MOST_GRAINS) s->grains[s->grain_count++] = id;
    return id;
}

static dem2d_particle_id add(stress_scene *s, int kind, double radius, double x, double y,
                             double vx) {
    dem2d_particle_desc d = kind_desc(s, kind, 0, radius, x, y);
    d.velocity.x = vx;
    return add_desc(s, &d);
}

static dem2d_wall_desc wall_desc(const stress_scene *s, double x, double y, double nx, double ny) {
    return plane_desc(&s->base, vec(x, y), vec(nx, ny));
}

static void put_wall(stress_scene *s, const dem2d_wall_desc *d) {
    s->walls[s->wall_count++] = add_wall(&s->base, d);
}

static void put_plane(stress_scene *s, double x, double y, double nx, double ny) {
    const dem2d_wall_desc d = wall_desc(s, x, y, nx, ny);
    put_wall(s, &d);
}

/* Floor, left, right, lid of a box with its lower left corner at (x, y). */
static void put_box(stress_scene *s, double x, double y, double width, double height) {
    put_plane(s, x, y, 0, 1), put_plane(s, x, y, 1, 0);
    put_plane(s, x + width, y, -1, 0), put_plane(s, x, y + height, 0, -1);
}

static dem2d_wall_info wall_at(const stress_scene *s, int i) {
    return wall_of(&s->base, s->walls[i]);
}

/* --- what can be seen of a scene -------------------------------------------------------------- */

/* FNV-1a over numbers. */
static void hash_numbers(uint64_t *hash, const double *numbers, int count) {
    for (int i = 0; i < count; i++) {
        unsigned char byte[sizeof(double)];
        memcpy(byte, &numbers[i], sizeof byte);
        for (size_t k = 0; k < sizeof byte; k++) *hash = (*hash ^ byte[k]) * 0x100000001b3u;
    }
}

enum { GRAIN_NUMBERS = 11 };

/* With the powers of length, time and mass in each. */
static const signed char grain_units[GRAIN_NUMBERS][3] = {
    {1, 0, 0},  {1, 0, 0},  {0, 0, 0},  {0, 0, 0},  {1, -1, 0}, {1, -1, 0},
    {0, -1, 0}, {1, -2, 1}, {1, -2, 1}, {2, -2, 1}, {0, 0, 1}};

static void grain_numbers(const stress_scene *s, dem2d_particle_id id, double n[GRAIN_NUMBERS]) {
    const dem2d_particle_info p = grain_of(&s->base, id);
    const double all[GRAIN_NUMBERS] = {p.pose.position.x,
                                       p.pose.position.y,
                                       p.pose.rotation.c,
                                       p.pose.rotation.s,
                                       p.velocity.x,
                                       p.velocity.y,
                                       p.angular_velocity,
                                       p.force.x,
                                       p.force.y,
                                       p.torque,
                                       p.mass};
    memcpy(n, all, sizeof all);
}

/* What can be seen of the grains, contacts, walls and energies. */
static uint64_t state_of(const stress_scene *s) {
    static dem2d_contact_info contacts[8 * MOST_GRAINS];
    uint64_t hash = 0xcbf29ce484222325u;
    const dem2d_energy e = energy_of(&s->base);
    int count;
    for (int i = 0; i < s->grain_count; i++) {
        double n[GRAIN_NUMBERS];
        grain_numbers(s, s->grains[i], n);
        hash_numbers(&hash, n, GRAIN_NUMBERS);
    }
    expect_ok(dem2d_world_contacts(s->base.world, contacts, COUNT_OF(contacts), &count),
              "contacts");
    for (int i = 0; i < count && i < COUNT_OF(contacts); i++) {
        const dem2d_contact_info *c = &contacts[i];
        const double n[] = {c->a.index, c->b.index,      c->normal.x,        c->normal.y,
                            c->depth,   c->normal_force, c->tangential_force};
        hash_numbers(&hash, n, COUNT_OF(n));
    }
    for (int i = 0; i < s->wall_count; i++) {
        const dem2d_wall_info w = wall_at(s, i);
        const double n[] = {w.point.x, w.point.y, w.velocity.x, w.velocity.y, w.force.x, w.force.y};
        hash_numbers(&hash, n, COUNT_OF(n));
    }
    const double n[] = {e.translational, e.rotational, e.normal, e.tangential, e.potential};
    hash_numbers(&hash, n, COUNT_OF(n));
    return hash;
}

static bool all_finite(const stress_scene *s) {
    for (int i = 0; i < s->grain_count; i++) {
        double n[GRAIN_NUMBERS];
        grain_numbers(s, s->grains[i], n);
        for (int k = 0; k < GRAIN_NUMBERS; k++)
            if (!isfinite(n[k])) return false;
    }
    return true;
}

/* Upward force on the grains from the floor (wall 0), over their weight; mean of some steps. */
static double floor_share(stress_scene *s, double gravity, int steps) {
    double up = 0, mass = 0;
    for (int i = 0; i < s->grain_count; i++) mass += grain_of(&s->base, s->grains[i]).mass;
    for (int i = 0; i < steps; i++) {
        step(&s->base, 1);
        for (int w = 0; w < s->wall_count; w++) up -= wall_at(s, w).force.y;
    }
    return up / steps / (mass * gravity);
}

/* Contact time of two like grains, or of a grain and a wall (like = false). */
static double contact_time(double mass, double stiffness, bool like) {
    return PI * sqrt((like ? mass / 2 : mass) / stiffness);
}

static const dem2d_material_desc stone = {
    .density = 2700, .normal_stiffness = 1e7, .tangential_stiffness = 5e6, .friction = 0.4};
static const dem2d_material_desc glass = {.density = 2700,
                                          .normal_stiffness = 1e7}; /* elastic, without friction */

/* A pile of all kinds in a box `width` grains wide, dropped from a lattice. */
static stress_scene make_pile(const dem2d_world_desc *desc, const dem2d_material_desc *material,
                              int count, int width, double x, double y) {
    stress_scene s = make_scene(desc, material);
    const double r = 0.025, cell = 2.7 * r;
    for (int i = 0; i < count; i++) {
        dem2d_particle_desc d = kind_desc(&s, i % KINDS, i / KINDS % VARIANTS, r * uniform(0.7, 1),
                                          x + cell * (i % width + 0.5 + uniform(-0.1, 0.1)),
                                          y + cell * (i / width + 0.55));
        d.angle = uniform(-3, 3);
        add_desc(&s, &d);
    }
    put_box(&s, x, y, cell * width, cell * (count / width + 3));
    return s;
}

static dem2d_world_desc pile_desc(void) {
    dem2d_world_desc d = {0};
    d.time_step = 1e-4, d.gravity.y = -9.81, d.local_damping = 0.7;
    return d;
}

/* 64 grains of a kind, or of all (-1), fill 0.3 of a box. Two that meet head on overlap by this
   part of the radius; time steps are a part of the contact time. */
static stress_scene make_gas(int kind, double overlap, double step_part, double tolerance,
                             uint64_t seed) {
    enum { SIDE = 8, GRAINS = SIDE * SIDE };
    dem2d_world_desc d = {0};
    const double r = 0.5, area = PI * r * r, mass = glass.density * area;
    const double side = sqrt(GRAINS * area / 0.3), cell = side / SIDE;
    const double speed = overlap * r * sqrt(glass.normal_stiffness / (mass / 2)) / sqrt(2);
    d.time_step = contact_time(mass, glass.normal_stiffness, true) * step_part;
    d.contact_tolerance = tolerance;
    stress_scene s = make_scene(&d, &glass);
    random_state = seed;
    for (int i = 0; i < GRAINS; i++) {
        const dem2d_rot way = dem2d_rot_make(uniform(0, 2 * PI));
        const int variant = (kind >= 0 ? i : i / KINDS) % VARIANTS;
        dem2d_particle_desc g = kind_desc(&s, kind >= 0 ? kind : i % KINDS, variant, r,
                                          (i % SIDE + 0.5) * cell, (i / SIDE + 0.5) * cell);
        g.angle = uniform(0, 2 * PI), g.velocity = vec(speed * way.c, speed * way.s);
        g.angular_velocity = uniform(-1, 1) * speed / r;
        add_desc(&s, &g);
    }
    put_box(&s, 0, 0, side, side);
    return s;
}

#endif
