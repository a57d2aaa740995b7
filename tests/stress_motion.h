/* stress_motion.h - cases of stress.c against what mechanics asks of every motion: it can be
   reversed, it does not depend on the frame, elastic load cycles leave nothing behind, and small
   vibrations have the frequencies of the stiffness matrix. Include it after stress.h. */
#ifndef STRESS_MOTION_H
#define STRESS_MOTION_H

#include "stress.h"

/* --- reversal --------------------------------------------------------------------------------- */

/* Gives all grains minus the velocities of the half step to come. A step of a leapfrog goes from
   (x_n, v_n-1/2) to (x_n+1, v_n+1/2), so that the way back from x_n begins with -v_n+1/2: a copy of
   the world takes one more step to tell it. */
static void turn_back(const stress_scene *s) {
    scene_bytes bytes = scene_save(s->base.world);
    const scene ahead = scene_load(&s->base, &bytes);
    step(&ahead, 1);
    for (int i = 0; i < s->grain_count; i++) {
        const dem2d_particle_info p = grain_of(&ahead, s->grains[i]);
        set_velocity(&s->base, s->grains[i], DEM2D_FREE, vec(-p.velocity.x, -p.velocity.y),
                     -p.angular_velocity);
    }
    close_scene(&ahead);
    free(bytes.bytes);
}

/* Greatest distance of a grain from where it was, in its radius. */
static double distance_from(const stress_scene *s, const scene *now, const dem2d_pose *poses) {
    double most = 0;
    for (int i = 0; i < s->grain_count; i++) {
        const dem2d_particle_info p = grain_of(now, s->grains[i]);
        const double x = p.pose.position.x - poses[i].position.x;
        const double y = p.pose.position.y - poses[i].position.y;
        const double c = p.pose.rotation.c - poses[i].rotation.c;
        const double d = p.pose.rotation.s - poses[i].rotation.s;
        most = fmax(most, fmax(hypot(x, y) / p.equivalent, hypot(c, d)));
    }
    return most;
}

static void poses_of(const stress_scene *s, const scene *now, dem2d_pose *poses) {
    for (int i = 0; i < s->grain_count; i++) poses[i] = grain_of(now, s->grains[i]).pose;
}

/* Moves every grain by this much, each in a direction of its own. */
static void push_grains(const stress_scene *s, const scene *now, double by) {
    for (int i = 0; i < s->grain_count; i++) {
        const dem2d_pose pose = grain_of(now, s->grains[i]).pose;
        const dem2d_rot way = dem2d_rot_make(uniform(0, 2 * PI));
        const dem2d_vec at = vec(pose.position.x + by * way.c, pose.position.y + by * way.s);
        expect_ok(
            dem2d_world_move_particle(now->world, s->grains[i], at, dem2d_rot_angle(pose.rotation)),
            "push");
    }
}

/* There and back. What is not exact on the way grows as a push at the turn does, which a twin
   tells. Each step rounds a place by half an ulp of the box at most, in both ways alike or not;
   searches stop at the rounding of a support value, which is less than a place's. Returns what
   comes back in parts of that. */
static double there_and_back(int kind, uint64_t seed, int steps, double *growth) {
    static dem2d_pose first[MOST_GRAINS], back[MOST_GRAINS];
    const double push = 1e-12, tolerance = 4e-15, half_ulp = 0x1p-50; /* of 8 to 16 m */
    stress_scene s = make_gas(kind, 1e-2, 1.0 / 50, tolerance, seed);
    const double r = grain_of(&s.base, s.grains[0]).equivalent;
    poses_of(&s, &s.base, first);
    step(&s.base, steps);
    turn_back(&s);
    scene_bytes bytes = scene_save(s.base.world);
    const scene twin = scene_load(&s.base, &bytes);
    push_grains(&s, &twin, push * r);
    step(&s.base, steps), step(&twin, steps);
    poses_of(&s, &s.base, back);
    const double off = distance_from(&s, &s.base, first);
    *growth = distance_from(&s, &twin, back) / push;
    close_scene(&twin), end_scene(&s), free(bytes.bytes);
    return off / (2 * steps * half_ulp / r * *growth);
}

static void case_reversal(void) {
    for (int kind = -1; kind < KINDS; kind++) {
        double worst = 0, most = 0, growth;
        char name[64];
        for (int seed = 1; seed <= (quick ? 2 : 40); seed++) {
            worst = fmax(worst, there_and_back(kind, (uint64_t)seed, 10000, &growth));
            most = fmax(most, growth);
        }
        snprintf(name, sizeof name, "reversal: gas of %s",
                 kind < 0 ? "all kinds" : kind_names[kind]);
        row(worst < 1, name, "back within 2 n half ulps x growth of a push",
            "%.2g of it, growth %.0e", worst, most);
    }
}

/* --- objectivity ------------------------------------------------------------------------------ */

/* Seven grains of radius 1 in a ring of twelve driven discs, all on a hexagonal lattice. It is
   contracted while the grains spin, so that friction loads the tangential springs; then it turns
   and takes all along. */
enum { RING = 12, INNER = 7, DRUM_CONTACTS = 64 };

typedef struct drum {
    stress_scene s; /* its grains: the inner ones, then the ring */
    bool discs;
    double time_step, spacing, angle; /* of the lattice */
    dem2d_vec ring[RING];             /* places for spacing 1, angle 0 */
} drum;

/* A step in which the ring gets another spacing and turns: each of its discs along a chord. */
static void drum_step(drum *d, double spacing, double angle, double turn) {
    const dem2d_rot q = dem2d_rot_make(angle);
    for (int i = 0; i < RING; i++) {
        const dem2d_particle_id id = d->s.grains[INNER + i];
        const dem2d_vec now = grain_of(&d->s.base, id).pose.position, p = d->ring[i];
        const double x = spacing * (q.c * p.x - q.s * p.y), y = spacing * (q.s * p.x + q.c * p.y);
        set_velocity(&d->s.base, id, DEM2D_DRIVEN,
                     vec((x - now.x) / d->time_step, (y - now.y) / d->time_step),
                     (d->discs ? sin(turn) : turn) / d->time_step);
    }
    step(&d->s.base, 1);
    d->angle = angle, d->spacing = spacing;
}

static drum make_drum(bool discs, double steps_per_contact) {
    const dem2d_material_desc damped = {.density = 2700,
                                        .normal_stiffness = 1e7,
                                        .tangential_stiffness = 5e6,
                                        .friction = 0.5,
                                        .damping_ratio = 0.3};
    dem2d_world_desc desc = {0};
    drum d = {.discs = discs, .spacing = discs ? 2.02 : 2.6};
    d.time_step = contact_time(2700 * PI, 1e7, true) / steps_per_contact;
    desc.time_step = d.time_step, desc.contact_tolerance = 1e-13;
    d.s = make_scene(&desc, &damped);
    for (int shell = 1; shell <= 2; shell++)
        for (int k = 0, n = 0; k < 25; k++) {
            const int a = k % 5 - 2, b = k / 5 - 2, c = -a - b;
            const int far = abs(a) > abs(b) ? abs(a) : abs(b), at = abs(c) > far ? abs(c) : far;
            if (shell == 1 ? at > 1 : at != 2) continue;
            const dem2d_vec p = vec(a + 0.5 * b, sqrt(0.75) * b);
            const int kind = discs || shell == 2 ? DISC : n % KINDS;
            dem2d_particle_desc g = kind_desc(&d.s, kind, 0, 1, d.spacing * p.x, d.spacing * p.y);
            if (shell == 2) d.ring[n] = p, g.motion = DEM2D_DRIVEN;
            if (shell == 1) g.scale *= uniform(0.997, 1.003), g.angle = uniform(-3, 3);
            if (shell == 1) g.angular_velocity = uniform(-0.02, 0.02) / d.time_step;
            add_desc(&d.s, &g), n++;
        }
    return d;
}

/* Contracts, comes to rest, and turns faster and faster, up to `turn` in a step: so gently that
   nothing swings. */
static void start_drum(drum *d, double steps_per_contact, double turn) {
    const int few = (int)(400 * steps_per_contact), many = (int)(3000 * steps_per_contact);
    const double first = d->spacing, last = 1.94;
    for (int i = 1; i <= few; i++) drum_step(d, first + (last - first) * i / few, 0, 0);
    expect_ok(dem2d_world_set_damping(d->s.base.world, 0.5, 0), "damping");
    for (int i = 0; i < few; i++) drum_step(d, last, 0, 0);
    expect_ok(dem2d_world_set_damping(d->s.base.world, 0, 0), "damping");
    for (int i = 1; i <= many; i++) {
        const double now = turn * pow(sin(PI / 2 * i / many), 2);
        drum_step(d, last, remainder(d->angle + now, 2 * PI), now);
    }
}

/* Whole turns of so many steps: its angles do not add up rounding. */
static void turn_drum(drum *d, int steps, int turns) {
    const double first = d->angle, turn = 2 * PI / steps;
    for (int k = 0; k < turns; k++)
        for (int i = 1; i <= steps; i++) drum_step(d, d->spacing, first + i * turn, turn);
    d->angle = first;
}

typedef struct drum_forces {
    dem2d_contact_info list[DRUM_CONTACTS];
    int count;
    double normal, shear; /* greatest */
} drum_forces;

static void read_forces(const drum *d, drum_forces *f) {
    f->count = contacts_of(&d->s.base, f->list, DRUM_CONTACTS);
    f->normal = f->shear = 0;
    for (int i = 0; i < f->count; i++) {
        f->normal = fmax(f->normal, f->list[i].normal_force);
        f->shear = fmax(f->shear, fabs(f->list[i].tangential_force));
    }
}

/* Greatest change of a contact's forces, of the greatest; HUGE_VAL if there are other contacts. */
static double greatest_change(const drum_forces *a, const drum_forces *b) {
    double change = 0;
    if (a->count != b->count) return HUGE_VAL;
    for (int i = 0; i < a->count; i++) {
        const dem2d_contact_info *x = &a->list[i], *y = &b->list[i];
        if (x->a.index != y->a.index || x->b.index != y->b.index) return HUGE_VAL;
        change = fmax(change, fabs(x->normal_force - y->normal_force));
        change = fmax(change, fabs(x->tangential_force - y->tangential_force));
    }
    return change / a->normal;
}

/* The change in a turn over what one would be by a slip of d a^3/6 in each step, by root mean
   squares: energies of the springs. */
static double change_of_slip(const drum_forces *a, const drum_forces *b, int steps) {
    const double kn = 1e7, kt = 5e6, slip = pow(2 * PI, 3) / (6.0 * steps * steps);
    double got = 0, most = 0;
    for (int i = 0; i < a->count; i++) {
        const dem2d_contact_info *x = &a->list[i], *y = &b->list[i];
        const double d = x->branch.x * x->normal.x + x->branch.y * x->normal.y;
        got += pow(x->normal_force - y->normal_force, 2) / (kn * x->points);
        got += pow(x->tangential_force - y->tangential_force, 2) / (kt * x->points);
        most += kt * x->points * pow(slip * d, 2);
    }
    return sqrt(got / most);
}

/* A step of a rigid turn by a takes branches d along chords. At both ends of it grains with the
   spin of the turn slide on each other by d (sin a - a)/dt, where it should be 0: the springs go by
   d a^3/6 in each step. What the grains can give way to only lessens the energy of that. Discs in a
   ring that spins by sin a/dt do not slide at all. */
static void case_objectivity(void) {
    static drum_forces before, after;
    drum d = make_drum(true, 12);
    start_drum(&d, 12, 2 * PI / 628);
    turn_drum(&d, 628, 20);
    read_forces(&d, &before);
    turn_drum(&d, 628, quick ? 200 : 10000);
    read_forces(&d, &after);
    end_scene(&d.s);
    const double change = greatest_change(&before, &after);
    row(change < 1e-9 && before.shear > 0.01 * before.normal, "objectivity: discs",
        quick ? "200 turns: forces keep to 1e-9" : "10000 turns: forces keep to 1e-9",
        "%.1e; shear %.2f of normal", change, before.shear / before.normal);
    for (int fine = 1; fine <= 4; fine *= 2) {
        char name[64];
        d = make_drum(false, 12 * fine);
        start_drum(&d, 12 * fine, 2 * PI / 628 / fine);
        turn_drum(&d, 628 * fine, 20);
        read_forces(&d, &before);
        turn_drum(&d, 628 * fine, 1);
        read_forces(&d, &after);
        end_scene(&d.s);
        const double part = change_of_slip(&before, &after, 628 * fine);
        snprintf(name, sizeof name, "objectivity: all kinds, %d steps", 628 * fine);
        row(part < 1 && greatest_change(&before, &after) < 1, name,
            "a turn changes less than a slip of d a^3/6 a step", "%.3f of it", part);
    }
}

/* --- ratcheting ------------------------------------------------------------------------------- */

/* A grain lies on the floor under its weight and a load along it that swings, at most half of what
   friction can hold. The disc does not roll off: it has rolling friction. Places are near 0, so
   that a half ulp is one of the swing. */
typedef struct swing {
    scene s;
    dem2d_particle_id id;
    double gravity, load; /* m/s2 */
} swing;

static swing make_swing(bool box) {
    const dem2d_material_desc rough = {.density = 2700,
                                       .normal_stiffness = 1e7,
                                       .tangential_stiffness = 5e6,
                                       .friction = 0.5,
                                       .damping_ratio = 0.2,
                                       .rolling_friction = 0.5};
    const double mass = 2700 * (box ? 2 : PI), high = box ? 0.5 : 1;
    dem2d_world_desc desc = {0};
    swing w = {.gravity = 9.81, .load = 0.5 * 0.5 * 9.81};
    desc.time_step = contact_time(mass, 1e7, false) / 30, desc.global_damping = 5;
    desc.gravity = vec(0, -w.gravity);
    w.s = open_scene(&desc, &rough);
    add_floor(&w.s);
    w.id = add_shape(&w.s, box ? make_box(2, 1) : make_disc(1), DEM2D_FREE,
                     vec(0, high - mass * w.gravity / (box ? 2e7 : 1e7)), 0, vec(0, 0), 0);
    return w;
}

/* Of a cycle: mean place, greatest place, greatest part of what friction can hold. */
typedef struct cycle {
    double mean, most, held;
} cycle;

static cycle swing_once(const swing *w, int steps) {
    cycle c = {0, 0, 0};
    for (int i = 0; i < steps; i++) {
        const double load = w->load * cos(2 * PI * i / steps);
        expect_ok(dem2d_world_set_gravity(w->s.world, vec(load, -w->gravity)), "load");
        step(&w->s, 1);
        const dem2d_particle_info p = grain_of(&w->s, w->id);
        c.mean += p.pose.position.x / steps;
        c.most = fmax(c.most, fabs(p.pose.position.x));
        c.held = fmax(c.held, fabs(p.force.x) / (0.5 * p.force.y));
    }
    return c;
}

/* Springs and places each round by half an ulp in a step: four half ulps of the swing are more than
   all that can add up. */
static void ratchet(bool box, int cycles) {
    enum { STEPS = 500, FIRST = 100 };
    const double allowed = 4 * 0x1p-53 * STEPS * (double)cycles;
    swing w = make_swing(box);
    cycle first = {0, 0, 0}, last = {0, 0, 0};
    dem2d_contact_info contact;
    char criterion[64];
    for (int k = 0; k < FIRST; k++) first = swing_once(&w, STEPS);
    for (int k = 0; k < cycles; k++) last = swing_once(&w, STEPS);
    const double drift = fabs(last.mean - first.mean) / last.most;
    const bool lies = contacts_of(&w.s, &contact, 1) == 1 && contact.points == (box ? 2 : 1);
    snprintf(criterion, sizeof criterion, "%d cycles: drift below %.0e of the swing", cycles,
             allowed);
    row(drift < allowed && lies && last.held > 0.4 && last.held < 0.9,
        box ? "ratcheting: box, two points" : "ratcheting: disc", criterion,
        "%.1e; loaded to %.2f of friction", drift, last.held);
    close_scene(&w.s);
}

static void case_ratcheting(void) {
    ratchet(false, quick ? 1000 : 100000);
    ratchet(true, quick ? 1000 : 100000);
}

/* --- spectrum --------------------------------------------------------------------------------- */

/* Grains of all kinds with friction, squeezed by four walls until they have jammed, at rest. What
   the spring of a contact has then is kept, and no contact slides any more. */
#define AMPLITUDE 2e-5 /* of a radius; overlaps are about 1e-2 */
enum { SPECTRUM_SIDE = 5, SPECTRUM = SPECTRUM_SIDE * SPECTRUM_SIDE, MODES = 3 * SPECTRUM };

static const dem2d_material_desc firm = {
    .density = 2700, .normal_stiffness = 1e7, .tangential_stiffness = 5e6, .friction = 0.3};

static void stop_walls(stress_scene *s, double speed) {
    for (int i = 0; i < 4; i++) {
        const dem2d_wall_info now = wall_at(s, i);
        dem2d_wall_desc w = wall_desc(s, now.point.x, now.point.y, now.normal.x, now.normal.y);
        w.mode = speed > 0 ? DEM2D_WALL_MOVING : DEM2D_WALL_STILL;
        w.velocity = vec(speed * w.normal.x, speed * w.normal.y);
        expect_ok(dem2d_world_set_wall(s->base.world, s->walls[i], &w), "wall");
    }
}

static stress_scene make_jammed(uint64_t seed, double *time_step) {
    const double cell = 2.7, unit = sqrt(firm.density * PI / firm.normal_stiffness);
    const dem2d_pair_desc sticky = pair_desc(1e7, 5e6, 1e3);
    dem2d_world_desc desc = {0};
    desc.time_step = *time_step = 0.1 * unit;
    desc.contact_tolerance = 4e-15, desc.local_damping = 0.3;
    stress_scene s = make_scene(&desc, &firm);
    random_state = seed;
    for (int i = 0; i < SPECTRUM; i++) {
        dem2d_particle_desc g =
            kind_desc(&s, i % KINDS, i / KINDS % VARIANTS, uniform(0.8, 1),
                      cell * (i % SPECTRUM_SIDE + 0.5), cell * (i / SPECTRUM_SIDE + 0.5));
        g.angle = uniform(-3, 3);
        add_desc(&s, &g);
    }
    put_box(&s, 0, 0, cell * SPECTRUM_SIDE, cell * SPECTRUM_SIDE);
    stop_walls(&s, 2e-4 / unit);
    dem2d_packing packing = {0};
    while (packing.coordination < 2.8 || packing.mean_overlap < 2e-3)
        step(&s.base, 20), packing = packing_of(&s.base);
    stop_walls(&s, 0);
    expect_ok(dem2d_world_set_damping(s.base.world, 0.7, 0), "damping");
    step(&s.base, 40000);
    expect_ok(dem2d_world_set_damping(s.base.world, 0, 0), "damping");
    expect_ok(dem2d_world_set_pair(s.base.world, s.base.material, s.base.material, &sticky),
              "pair");
    return s;
}

/* A packing at rest and its vibrations. Coordinates are x, y and angle of each grain in turn. */
typedef struct spectrum {
    stress_scene s;
    scene_bytes rest;
    double time_step, mass[MODES];
    dem2d_pose rests[SPECTRUM];
    double matrix[MODES][MODES]; /* stiffness, by roots of the masses; then its eigenvalues */
    double mode[MODES][MODES];   /* eigenvectors, in columns */
} spectrum;

/* Forces after a copy has been moved from its rest by `by` along a coordinate: in one step, so that
   tangential springs follow. The force pass of the next step tells them. */
static void forces_beside(spectrum *p, int coordinate, double by, double force[MODES]) {
    const scene copy = scene_load(&p->s.base, &p->rest);
    const double v = by / p->time_step;
    const int axis = coordinate % 3;
    set_velocity(&copy, p->s.grains[coordinate / 3], DEM2D_FREE,
                 vec(axis == 0 ? v : 0, axis == 1 ? v : 0), axis == 2 ? v : 0);
    step(&copy, 2);
    for (int i = 0; i < SPECTRUM; i++) {
        const dem2d_particle_info g = grain_of(&copy, p->s.grains[i]);
        force[3 * i] = g.force.x, force[3 * i + 1] = g.force.y, force[3 * i + 2] = g.torque;
    }
    close_scene(&copy);
}

/* By central differences. skew is how far the matrix is from symmetric: tangential forces turn with
   their contacts, which no energy does. kink is how far forward and backward differences are apart:
   contacts that open or close, or corners that come to bear. Both of the greatest element. */
static void assemble(spectrum *p, double *skew, double *kink) {
    static double rest[MODES], plus[MODES], minus[MODES];
    double greatest = 0;
    *skew = *kink = 0;
    forces_beside(p, 0, 0, rest);
    for (int j = 0; j < MODES; j++) {
        forces_beside(p, j, AMPLITUDE, plus), forces_beside(p, j, -AMPLITUDE, minus);
        for (int i = 0; i < MODES; i++) {
            const double unit = 1 / (2 * AMPLITUDE) / sqrt(p->mass[i] * p->mass[j]);
            p->matrix[i][j] = (minus[i] - plus[i]) * unit;
            *kink = fmax(*kink, fabs(minus[i] - 2 * rest[i] + plus[i]) * unit);
        }
    }
    for (int i = 0; i < MODES; i++)
        for (int j = 0; j <= i; j++) {
            const double a = p->matrix[i][j], b = p->matrix[j][i];
            greatest = fmax(greatest, fmax(fabs(a), fabs(b))), *skew = fmax(*skew, fabs(a - b));
            p->matrix[i][j] = p->matrix[j][i] = (a + b) / 2;
        }
    *skew /= greatest, *kink /= greatest;
}

/* Jacobi's rotations: the matrix becomes diagonal. */
static void diagonalise(spectrum *p) {
    for (int i = 0; i < MODES; i++)
        for (int j = 0; j < MODES; j++) p->mode[i][j] = i == j;
    for (int sweep = 0; sweep < 12; sweep++)
        for (int i = 0; i < MODES; i++)
            for (int j = 0; j < i; j++) {
                double(*m)[MODES] = p->matrix;
                if (m[i][j] == 0) continue;
                const double half = (m[j][j] - m[i][i]) / (2 * m[i][j]);
                const double t = (half < 0 ? -1 : 1) / (fabs(half) + sqrt(half * half + 1));
                const double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < MODES; k++) {
                    const double x = m[k][i], y = m[k][j];
                    m[k][i] = c * x - s * y, m[k][j] = s * x + c * y;
                }
                for (int k = 0; k < MODES; k++) {
                    const double x = m[i][k], y = m[j][k];
                    m[i][k] = c * x - s * y, m[j][k] = s * x + c * y;
                }
                for (int k = 0; k < MODES; k++) {
                    const double x = p->mode[k][i], y = p->mode[k][j];
                    p->mode[k][i] = c * x - s * y, p->mode[k][j] = s * x + c * y;
                }
            }
}

/* How far a copy is along a mode. */
static double along_mode(const spectrum *p, const scene *copy, int mode) {
    double sum = 0;
    for (int i = 0; i < SPECTRUM; i++) {
        const dem2d_pose now = grain_of(copy, p->s.grains[i]).pose;
        const dem2d_pose *at = &p->rests[i];
        const double way[3] = {now.position.x - at->position.x, now.position.y - at->position.y,
                               at->rotation.c * now.rotation.s - at->rotation.s * now.rotation.c};
        for (int k = 0; k < 3; k++)
            sum += p->mode[3 * i + k][mode] * sqrt(p->mass[3 * i + k]) * way[k];
    }
    return sum;
}

/* Frequency of a mode that is struck, 1/s, from q(n + m) + q(n - m) = 2 cos(w m dt) q(n) with m a
   quarter of the period, by least squares over six periods. */
static double measure_mode(const spectrum *p, int mode, double expected) {
    enum { ROOM = 20000 };
    static double q[ROOM];
    const double quarter = PI / 2 / (expected * p->time_step);
    const int m = quarter < 1 ? 1 : (int)quarter, count = (int)(24 * quarter) + 2 * m + 2;
    double greatest = 0, up = 0, down = 0;
    if (count > ROOM) return 0;
    const scene copy = scene_load(&p->s.base, (scene_bytes *)&p->rest);
    double v[MODES];
    for (int i = 0; i < MODES; i++) {
        v[i] = p->mode[i][mode] / sqrt(p->mass[i]);
        greatest = fmax(greatest, fabs(v[i]));
    }
    for (int i = 0; i < MODES; i++) v[i] *= AMPLITUDE * expected / greatest;
    for (int i = 0; i < SPECTRUM; i++)
        set_velocity(&copy, p->s.grains[i], DEM2D_FREE, vec(v[3 * i], v[3 * i + 1]), v[3 * i + 2]);
    for (int n = 0; n < count; n++) q[n] = along_mode(p, &copy, mode), step(&copy, 1);
    for (int n = m; n + m < count; n++) up += q[n] * (q[n + m] + q[n - m]), down += 2 * q[n] * q[n];
    close_scene(&copy);
    return acos(up / down) / (m * p->time_step);
}

/* The next packing that answers alike to both sides: no contact opens or closes as it vibrates. */
static void take_packing(spectrum *p, uint64_t *seed, double *skew) {
    for (double kink = 1;;) {
        p->s = make_jammed((*seed)++, &p->time_step);
        p->rest = scene_save(p->s.base.world);
        for (int i = 0; i < SPECTRUM; i++) {
            const dem2d_particle_info g = grain_of(&p->s.base, p->s.grains[i]);
            p->mass[3 * i] = p->mass[3 * i + 1] = g.mass, p->mass[3 * i + 2] = g.inertia;
            p->rests[i] = g.pose;
        }
        assemble(p, skew, &kink);
        if (kink < 1e-3) return;
        end_scene(&p->s), free(p->rest.bytes);
    }
}

/* A mode of frequency w swings with (2/dt) asin(w dt/2) = w (1 + (w dt)^2/24 + ...) by a leapfrog.
   The error of w^2 that is left is of the square of the skew part, about 5e-3 of the greatest, over
   what modes are apart; overlaps of some percent of the radius make it. Grains that are loose have
   no frequency. */
static void case_spectrum(void) {
    static spectrum p;
    double worst = 0, correction = 0, most = 0, skew;
    uint64_t seed = 1;
    int looked = 0;
    for (int n = 0; n < (quick ? 1 : 20); n++) {
        double top = 0;
        take_packing(&p, &seed, &skew);
        most = fmax(most, skew);
        diagonalise(&p);
        for (int k = 0; k < MODES; k++) top = fmax(top, p.matrix[k][k]);
        for (int k = 0; k < MODES; k++) {
            if (p.matrix[k][k] < 1e-4 * top) continue;
            const double half = sqrt(p.matrix[k][k]) * p.time_step / 2;
            const double expected = 2 * asin(half) / p.time_step;
            const double got = measure_mode(&p, k, expected) / expected;
            worst = fmax(worst, fabs(got * got - 1) * p.matrix[k][k] / top), looked++;
            correction = fmax(correction, asin(half) / half - 1);
        }
        end_scene(&p.s);
        free(p.rest.bytes);
    }
    row(worst < 1e-4 && looked > 50, "spectrum: 25 grains of all kinds",
        "w^2 of (2/dt) asin(w dt/2) to 1e-4 of the greatest",
        "%.0e of %d modes; skew %.0e, asin %.0e", worst, looked, most, correction);
}

#endif
