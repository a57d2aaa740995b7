/* stress_joints.h - cases of stress.c of long slides over chains of segments: as over one segment
   and a half-plane, whatever joint is under the grain. Include it after stress.h. */
#ifndef STRESS_JOINTS_H
#define STRESS_JOINTS_H

#include "stress.h"

/* The boxes of these cases, beside the kinds. */
enum { BOX = KINDS, ROUNDED_BOX, JOINT_SHAPES };
static const char *const joint_names[JOINT_SHAPES] = {
    "discs",    "ellipses", "polybeziers",  "Fourier series", "rounded polygons",
    "polygons", "boxes",    "rounded boxes"};

static dem2d_shape *make_joint_shape(int kind) {
    const dem2d_vec p[4] = {{-1, -0.5}, {1, -0.5}, {1, 0.5}, {-1, 0.5}};
    const dem2d_vec core[4] = {{-0.8, -0.3}, {0.8, -0.3}, {0.8, 0.3}, {-0.8, 0.3}};
    if (kind < KINDS) return make_kind(kind, 0);
    return kind == BOX ? make_polygon(p, 4, 0) : make_polygon(core, 4, 0.2);
}

/* From x = -4 to 36 along a direction: so many segments, or (0) a half-plane. */
static void put_slope(const scene *s, int count, double angle) {
    const dem2d_rot t = dem2d_rot_make(angle);
    if (count == 0) (void)add_plane(s, 0, 0, -t.s, t.c);
    for (int i = 0; i < count; i++) {
        const double a = 40.0 * i / count - 4, b = 40.0 * (i + 1) / count - 4;
        const dem2d_vec from = vec(a * t.c, a * t.s), to = vec(b * t.c, b * t.s);
        (void)(i % 2 ? add_segment(s, to, from) : add_segment(s, from, to));
    }
}

typedef struct slid {
    double energy, speed, angle, swing; /* swing: energy that is not of the slide */
    int points;                         /* most that carried it */
} slid;

/* A grain that moves at 3 m/s for steps of 1e-5 s without friction: from rest on its face, others
   from an angle, from which they rock. */
static slid slide_along(int kind, int count, int steps) {
    const dem2d_material_desc smooth = glass;
    dem2d_world_desc d = {0};
    dem2d_shape_info info;
    dem2d_support low;
    dem2d_contact_info list[8];
    d.time_step = 1e-5, d.gravity.y = -9.81;
    const scene s = open_scene(&d, &smooth);
    dem2d_shape *shape = make_joint_shape(kind);
    const double angle = kind < KINDS ? 0.3 : 0;
    expect_ok(dem2d_shape_get(shape, &info), "shape");
    expect_ok(dem2d_shape_support(shape, dem2d_pose_make(0, 0, angle, 1), vec(0, -1), &low),
              "support");
    const double sag = smooth.density * info.mass.area * 9.81 / smooth.normal_stiffness;
    put_slope(&s, count, 0);
    const dem2d_particle_id id =
        add_shape(&s, shape, DEM2D_FREE, vec(0, low.value - (kind < KINDS ? sag : sag / 2)), angle,
                  vec(3, 0), 0);
    slid r = {0, 0, 0, 0, 0};
    for (int i = 0; i < steps; i += 100) {
        int points = 0;
        step(&s, 100);
        for (int c = contacts_of(&s, list, 8) - 1; c >= 0; c--) points += list[c].points;
        r.points = points > r.points ? points : r.points;
    }
    const dem2d_energy e = energy_of(&s);
    r.energy = e.translational + e.rotational + e.normal + e.potential;
    const dem2d_particle_info g = grain_of(&s, id);
    r.speed = g.velocity.x;
    r.angle = angle_of(&s, id);
    r.swing = e.rotational + g.mass * g.velocity.y * g.velocity.y / 2;
    close_scene(&s);
    return r;
}

/* How far a box creeps on a slope at 0.99 of the friction angle, over its length. */
static double creep_along(int kind, int count, int steps) {
    dem2d_material_desc rough = stone;
    dem2d_world_desc d = {0};
    dem2d_support low;
    const double angle = atan(0.99 * rough.friction);
    d.time_step = 1e-4, d.gravity.y = -9.81;
    rough.damping_ratio = 0.3;
    const scene s = open_scene(&d, &rough);
    dem2d_shape *shape = make_joint_shape(kind);
    expect_ok(dem2d_shape_support(shape, dem2d_pose_make(0, 0, 0, 1), vec(0, -1), &low), "support");
    const double y = low.value - 0.003, x = 0.1;
    put_slope(&s, count, angle);
    const dem2d_particle_id id = add_shape(
        &s, shape, DEM2D_FREE,
        vec(x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle)), angle, vec(0, 0), 0);
    expect_ok(dem2d_world_set_damping(s.world, 0.5, 0), "damping");
    step(&s, 40000);
    const dem2d_vec at = grain_of(&s, id).pose.position;
    expect_ok(dem2d_world_set_damping(s.world, 0, 0), "damping");
    step(&s, steps);
    const dem2d_vec to = grain_of(&s, id).pose.position;
    close_scene(&s);
    return hypot(to.x - at.x, to.y - at.y) / 2;
}

static void case_joints(void) {
    static const int counts[] = {1, 7, 60};
    static const int kinds[] = {SERIES, BEZIER, SHARP, BOX, ROUNDED_BOX};
    const int steps = quick ? 50000 : 1000000;
    char name[64];
    for (int k = 0; k < COUNT_OF(kinds); k++) {
        const slid plane = slide_along(kinds[k], 0, steps);
        for (int c = 0; c < COUNT_OF(counts); c++) {
            const slid r = slide_along(kinds[k], counts[c], steps);
            const double energy = fabs(r.energy / plane.energy - 1);
            const double speed = fabs(r.speed / plane.speed - 1);
            const double angle = fabs(r.angle - plane.angle);
            snprintf(name, sizeof name, "joints: %s over %d", joint_names[kinds[k]], counts[c]);
            row(energy < 1e-9 && speed < 1e-9 && angle < 1e-5 && r.points == plane.points, name,
                "energy, speed 1e-9, angle 1e-5 as on a half-plane", "%.1e, %.1e, %.1e; %d points",
                energy, speed, angle, r.points);
        }
    }
    for (int kind = BOX; kind <= ROUNDED_BOX; kind++)
        for (int c = -1; c < COUNT_OF(counts); c++) {
            const double creep = creep_along(kind, c < 0 ? 0 : counts[c], steps);
            snprintf(name, sizeof name, "joints: %s rest on %d", joint_names[kind],
                     c < 0 ? 0 : counts[c]);
            row(creep < 1e-12, name, "no creep at 0.99 of the friction angle", "%.1e", creep);
        }
}

#endif
