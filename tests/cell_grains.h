/* Soft grains of a periodic cell, and of the same state with copies made by hand: for the tests of
   cells. */
#ifndef CELL_GRAINS_H
#define CELL_GRAINS_H

#include "testing.h"
#include "world_scene.h"

#define KN 1000.0 /* of discs of diameter 1 and mass 1 */
#define DT (0.02 / 31.622776601683793)

static dem2d_material_desc soft_desc(bool damped) {
    dem2d_material_desc desc = material_desc(4 / (double)TEST_PI, KN, KN / 2, 0.4);
    if (damped) desc.damping_ratio = 0.1, desc.rolling_friction = 0.05;
    if (damped) desc.tangential_damping_ratio = 0.1;
    return desc;
}

static void make_shapes(const scene *s, dem2d_shape_id shapes[4]) {
    static const dem2d_vec box[4] = {{-0.45, -0.4}, {0.45, -0.45}, {0.5, 0.4}, {-0.4, 0.5}};
    static const double a[5] = {0.45, 0, 0.02, 0.01, 0.003}, b[5] = {0, 0, 0, 0.005, 0};
    shapes[0] = give_shape(s, make_disc(0.5));
    shapes[1] = give_shape(s, make_polygon(box, 4, 0.05));
    shapes[2] = give_shape(s, make_ellipse(0.5, 0.4));
    shapes[3] = give_shape(s, make_series(a, b, 4));
}

/* Grains in a cell of the vectors a and b. */
typedef struct lattice {
    int grains, kinds; /* 1: discs, 4: and other shapes */
    double speed;      /* greatest, in each direction */
    dem2d_vec a, b;
} lattice;

/* Grains on a lattice, displaced at random, with random speeds. */
static dem2d_particle_desc grain_at(const scene *s, const lattice *f,
                                    const dem2d_shape_id shapes[4], int i, uint64_t *random) {
    const int side = (int)ceil(sqrt(f->grains));
    const double u = (i % side + 0.5 + random_between(random, 0, 0.1)) / side;
    const double t = (i / side + 0.5 + random_between(random, 0, 0.1)) / side;
    const dem2d_vec at = vec(u * f->a.x + t * f->b.x, t * f->b.y);
    const double scale = random_between(random, 0.8, 1);
    dem2d_particle_desc grain = grain_desc(s, shapes[i % f->kinds], scale, at);
    grain.angle = random_between(random, 0, 6);
    grain.velocity.x = random_between(random, -f->speed, f->speed);
    grain.velocity.y = random_between(random, -f->speed, f->speed);
    grain.angular_velocity = random_between(random, -f->speed, f->speed);
    return grain;
}

#endif
