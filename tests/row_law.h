/* row_law.h - a caller's law written for one contact point, and run for all rows of a batch. C99
   and C++11. Include it after dem2d.h. */
#ifndef ROW_LAW_H
#define ROW_LAW_H

#include "parts.h"

/* One row: what such a law reads, as in dem2d_law_batch. The stiffnesses of the pair are those of
   this point, by its weight. */
typedef struct row_in {
    dem2d_pair_desc pair;
    dem2d_particle_id a, b;
    dem2d_wall_id wall;
    int point;
    double time_step, depth, approach, sliding, spin, mass, radius;
    double tangential_force, moment; /* in the step before */
    double state[2];
} row_in;

/* And what it writes: all 0 at first, but for the state. */
typedef struct row_out {
    double normal_force, tangential_force, moment, energy;
    double state[2];
} row_out;

typedef void row_law(void *user, const row_in *in, row_out *out);

PART void for_rows(void *user, dem2d_law_batch *b, row_law *law) {
    for (int k = 0; k < b->count; k++) {
        row_in in;
        row_out out;
        memset(&in, 0, sizeof in);
        memset(&out, 0, sizeof out);
        in.pair = *b->pair[k];
        in.pair.normal_stiffness *= b->weight[k];
        in.pair.tangential_stiffness *= b->weight[k];
        in.a = b->a[k], in.b = b->b[k], in.wall = b->wall[k];
        in.point = b->point[k];
        in.time_step = b->time_step;
        in.depth = b->depth[k];
        in.approach = b->approach[k], in.sliding = b->sliding[k], in.spin = b->spin[k];
        in.mass = b->mass[k], in.radius = b->radius[k];
        in.tangential_force = b->last_tangential[k], in.moment = b->last_moment[k];
        memcpy(in.state, b->state[k], sizeof in.state);
        memcpy(out.state, b->state[k], sizeof out.state);
        law(user, &in, &out);
        b->normal_force[k] = out.normal_force;
        b->tangential_force[k] = out.tangential_force;
        b->moment[k] = out.moment;
        b->energy[k] = out.energy;
        memcpy(b->state[k], out.state, sizeof out.state);
    }
}

#endif
