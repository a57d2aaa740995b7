/* verify [DATA] - what must hold, as a table: impacts, rolling, rocking and gases against closed
   forms, areas and moments against quadrature, packings and the papers' biaxial test against what
   they and the literature say. DATA: a folder with outlines and a file core12.txt that lists twelve
   of them, for the coverage of fits.

   A row: case, expected, got, error, allowed, whether it holds, and where the expected value comes
   from: "formula" (computed here), "integral" (computed here by another method), "paper", or
   "literature". Bands were fixed before the first run. Exit status: 0 if all rows hold, 1 if one
   fails, 2 for bad usage. What takes longer is in verify_long.c. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "row_law.h"
#include "verify.h"

/* --- impacts --------------------------------------------------------------------------------- */

enum { DISC_DISC, DISC_FIXED, DISC_WALL, ELLIPSE_WALL, OVAL_OVAL, HEAD_ONS };

static const char *const head_on_names[HEAD_ONS] = {"disc, disc", "disc, fixed disc", "disc, wall",
                                                    "ellipse, wall", "ellipse, ellipse"};

typedef struct head_on {
    scene s;
    dem2d_particle_id mover, target; /* target: generation 0 for a wall */
    double touch;                    /* height of first touch over the target */
    double mass, frequency, time_step;
} head_on;

static double *pulling; /* ratio of a dashpot that may pull; NULL: the library's law */

static void pulling_law_row(void *user, const row_in *in, row_out *out) {
    const double zeta = *(const double *)user, k = in->pair.normal_stiffness;
    out->normal_force = k * in->depth + 2 * zeta * sqrt(in->mass * k) * in->approach;
}

static void pulling_law(void *user, dem2d_law_batch *batch) {
    for_rows(user, batch, pulling_law_row);
}

/* One body falls on another without gravity, so that the first touch is inside a step. */
static head_on open_head_on(int kind, const dem2d_material_desc *material, double speed,
                            double steps_per_contact) {
    const double radius = 0.05, a = 0.06, b = 0.04;
    const bool is_disc = kind <= DISC_WALL, wall = kind == DISC_WALL || kind == ELLIPSE_WALL;
    const double half = is_disc ? radius : b;
    const double mass = DENSITY * (double)PI * (is_disc ? radius * radius : a * b);
    head_on h;
    memset(&h, 0, sizeof h);
    h.mass = kind == DISC_DISC || kind == OVAL_OVAL ? mass / 2 : mass;
    h.touch = wall ? half : 2 * half;
    h.frequency = sqrt(KN / h.mass);
    h.time_step = (double)PI / h.frequency / steps_per_contact;
    dem2d_world_desc desc = world_desc(h.time_step);
    if (pulling) desc.law = pulling_law, desc.law_user = pulling;
    h.s = open_scene(&desc, material);
    if (wall)
        add_floor(&h.s);
    else
        h.target = add(&h.s, is_disc ? make_disc(radius) : make_ellipse(a, b),
                       kind == DISC_FIXED ? DEM2D_FIXED : DEM2D_FREE, vec(0, 0), vec(0, 0), 0);
    const double above = 5.3 * speed * h.time_step;
    h.mover = add(&h.s, is_disc ? make_disc(radius) : make_ellipse(a, b), DEM2D_FREE,
                  vec(0, h.touch + above), vec(0, -speed), 0);
    return h;
}

static double gap_of(const head_on *h) {
    const double y = grain_of(&h->s, h->mover).pose.position.y;
    return y - h->touch - (h->target.generation ? grain_of(&h->s, h->target).pose.position.y : 0);
}

typedef struct impact {
    double time, depth, force, restitution; /* duration, greatest overlap and force */
} impact;

/* Between contacts the motion is uniform, so that crossings are found by a straight line. */
static impact run_head_on(int kind, const dem2d_material_desc *material, double speed,
                          double steps) {
    head_on h = open_head_on(kind, material, speed, steps);
    impact result = {0, 0, 0, 0};
    double before = gap_of(&h), start = 0;
    for (int i = 0; result.time == 0; i++) {
        dem2d_contact_info c;
        step(&h.s, 1);
        const double now = gap_of(&h);
        if (contacts_of(&h.s, &c, 1)) {
            result.depth = fmax(result.depth, c.depth);
            result.force = fmax(result.force, c.normal_force);
        }
        if (before > 0 && now <= 0) start = i + before / (before - now);
        if (before <= 0 && now > 0)
            result.time = (i + before / (before - now) - start) * h.time_step;
        if (i > 1000 * steps) fail(STATUS_FAILED, "no impact");
        before = now;
    }
    step(&h.s, 10);
    const double target = h.target.generation ? grain_of(&h.s, h.target).velocity.y : 0;
    result.restitution = (grain_of(&h.s, h.mover).velocity.y - target) / speed;
    close_scene(&h.s);
    return result;
}

static double frequency_of(int kind) {
    const dem2d_material_desc material = stone_desc(0, 0);
    const head_on h = open_head_on(kind, &material, 1, 100);
    close_scene(&h.s);
    return h.frequency;
}

static void elastic_impacts(void) {
    const dem2d_material_desc material = stone_desc(KN, 0.5);
    table_group("Elastic impact at t_c/100");
    basis = "formula";
    for (int kind = 0; kind < HEAD_ONS; kind++) {
        const double w = frequency_of(kind), speed = 0.5;
        const impact i = run_head_on(kind, &material, speed, 100);
        const char *name = head_on_names[kind];
        row_near(label("%s: depth v/w0, m", name), speed / w, i.depth, 1e-3);
        row_near(label("%s: force v sqrt(m* k), N/m", name), speed * KN / w, i.force, 1e-3);
        row_near(label("%s: duration pi/w0, s", name), (double)PI / w, i.time, 1e-3);
        row_near(label("%s: restitution", name), 1, i.restitution, 1e-3);
    }
    const double w = frequency_of(DISC_WALL);
    const impact i = run_head_on(DISC_WALL, &material, 1, 200);
    /* leading term; linear crossings are off by (w dt)^3/60 each, 0.6 % of it */
    row_near("leapfrog: contact shorter by (pi dt/t_c)^2/24, dt = t_c/200",
             (double)(PI * PI) / (200.0 * 200 * 24), 1 - i.time * w / (double)PI, 1e-2);
}

/* --- damped impacts -------------------------------------------------------------------------- */

/* -ln e of a spring and dashpot whose force may pull, and of those whose force may not. */
static double loss_pulling(double zeta) {
    return (double)PI * zeta / sqrt(1 - zeta * zeta);
}

static double loss_clipped(double zeta) {
    if (zeta == 1) return 2;
    if (zeta < 1) return 2 * zeta * acos(zeta) / sqrt(1 - zeta * zeta);
    return 2 * zeta * acosh(zeta) / sqrt(zeta * zeta - 1);
}

static double zeta_of_pulling(double e) {
    const double loss = -log(e);
    return loss / hypot((double)PI, loss);
}

static double zeta_of_clipped(double e) {
    double low = 0, high = 100;
    for (int i = 0; i < 200; i++) {
        const double zeta = (low + high) / 2;
        if (loss_clipped(zeta) < -log(e))
            low = zeta;
        else
            high = zeta;
    }
    return high;
}

/* A dashpot starts with a jump, so that the error is of first order in the step. */
static const double damped_steps[][2] = {{100, 0.01}, {1000, 0.001}};

static void pulling_rows(void) {
    static const double zetas[] = {0.05, 0.2, 0.5}, speeds[] = {0.01, 0.5};
    for (int i = 0; i < COUNT_OF(zetas) * COUNT_OF(speeds) * 2; i++) {
        const double *steps = damped_steps[i % 2];
        const double speed = speeds[i / 2 % COUNT_OF(speeds)];
        double zeta = zetas[i / 2 / COUNT_OF(speeds)];
        const dem2d_material_desc material = stone_desc(0, 0);
        const double w = frequency_of(DISC_WALL);
        pulling = &zeta;
        const impact hit = run_head_on(DISC_WALL, &material, speed, steps[0]);
        pulling = NULL;
        const char *name = label("pulling, zeta %g, %g m/s, t_c/%g", zeta, speed, steps[0]);
        row_within(label("%s: e", name), exp(-loss_pulling(zeta)), hit.restitution, steps[1]);
        row_near(label("%s: t_c, s", name), (double)PI / (w * sqrt(1 - zeta * zeta)), hit.time,
                 steps[1]);
    }
}

static void damped_impacts(void) {
    static const double zetas[] = {0.05, 0.2, 0.5, 0.9, 1, 1.25, 2};
    static const double asked[] = {0.1, 0.3, 0.5, 0.7, 0.9};
    static const double unclipped[] = {0.25273, 0.39714, 0.55028, 0.71820, 0.90203};
    table_group("Damped impact");
    basis = "formula";
    pulling_rows();
    for (int i = 0; i < COUNT_OF(zetas) * 2; i++) {
        const double *steps = damped_steps[i % 2], zeta = zetas[i / 2], speed = 0.3;
        const int kind = i / 2 % HEAD_ONS;
        dem2d_material_desc material = stone_desc(0, 0);
        material.damping_ratio = zeta;
        const impact hit = run_head_on(kind, &material, speed, steps[0]);
        const char *name =
            label("clipped, zeta %g, %s, t_c/%g", zeta, head_on_names[kind], steps[0]);
        row_within(label("%s: e", name), exp(-loss_clipped(zeta)), hit.restitution, steps[1]);
        const double s = sqrt(1 - zeta * zeta);
        if (zeta < 1)
            row_near(label("%s: depth, m", name),
                     speed / frequency_of(kind) * exp(-zeta / s * atan(s / zeta)), hit.depth,
                     4 * steps[1]);
    }
    for (int i = 0; i < COUNT_OF(asked); i++) {
        double zeta;
        must(dem2d_damping_ratio(asked[i], &zeta), "damping ratio");
        row_near(label("dem2d_damping_ratio of e = %g", asked[i]), zeta_of_clipped(asked[i]), zeta,
                 1e-12);
        for (int k = 0; k < 2; k++) {
            const double *steps = damped_steps[k];
            dem2d_material_desc material = stone_desc(0, 0);
            material.damping_ratio = zeta;
            row_within(label("e = %g asked for, t_c/%g", asked[i], steps[0]), asked[i],
                       run_head_on(DISC_DISC, &material, 0.3, steps[0]).restitution, steps[1]);
            material.damping_ratio = zeta_of_pulling(asked[i]);
            row_within(label("e = %g by the unclipped ratio, t_c/%g", asked[i], steps[0]),
                       unclipped[i], run_head_on(DISC_DISC, &material, 0.3, steps[0]).restitution,
                       steps[1]);
        }
    }
}

/* --- oblique impact on a wall ---------------------------------------------------------------- */

static dem2d_particle_info bounce(const dem2d_material_desc *material, double vt, double vn,
                                  double steps, double radius) {
    const double contact_time = (double)PI * sqrt(disc_mass(radius) / KN);
    const dem2d_world_desc desc = world_desc(contact_time / steps);
    const scene s = open_scene(&desc, material);
    add_floor(&s);
    const dem2d_particle_id id =
        add(&s, make_disc(radius), DEM2D_FREE, vec(0, radius + 1e-6), vec(vt, -vn), 0);
    for (int i = 0; i < 1000000 && grain_of(&s, id).velocity.y <= 0; i++) step(&s, 1);
    step(&s, (int)(2 * steps)); /* until it has left */
    if (contacts_of(&s, NULL, 0) != 0) fail(STATUS_FAILED, "the disc does not leave the wall");
    const dem2d_particle_info info = grain_of(&s, id);
    close_scene(&s);
    return info;
}

/* v_t' = v_t - mu (1 + e) v_n and w R = 2 mu (1 + e) v_n, from tan(angle) = 3 mu (1 + e) on. */
static void slip_rows(const dem2d_material_desc *damped, double e, double steps) {
    static const double mus[] = {0.05, 0.1, 0.3}, beyond[] = {1, 1.2, 3};
    const double radius = 0.05, vn = 0.1;
    for (int i = 0; i < COUNT_OF(mus) * COUNT_OF(beyond); i++) {
        dem2d_material_desc material = *damped;
        const double mu = mus[i / COUNT_OF(beyond)], by = beyond[i % COUNT_OF(beyond)];
        const double vt = by * 3 * mu * (1 + e) * vn;
        material.friction = mu;
        const dem2d_particle_info p = bounce(&material, vt, vn, steps, radius);
        const char *name = label("gross slip, e = %g, mu = %g, tan = %g x 3 mu (1 + e)", e, mu, by);
        row_near(label("%s: v_t'", name), vt - mu * (1 + e) * vn, p.velocity.x, 1e-2);
        row_near(label("%s: w R", name), 2 * mu * (1 + e) * vn, -p.angular_velocity * radius, 1e-2);
    }
}

static void oblique_impacts(void) {
    static const double ratios[] = {1.0 / 3, 0.5, 1};
    static const double steps[][2] = {{100, 0.03}, {1000, 0.003}};
    const dem2d_material_desc elastic = stone_desc(KN, 0);
    table_group("Oblique impact");
    basis = "formula";
    slip_rows(&elastic, 1, 100);
    /* a dashpot's force starts with a jump, which the tangential spring follows at once only if it
       is stiff: the formula knows no spring */
    dem2d_material_desc damped = stone_desc(100 * KN, 0);
    damped.damping_ratio = zeta_of_clipped(0.5);
    slip_rows(&damped, 0.5, 1000);
    for (int i = 0; i < COUNT_OF(ratios) * 2; i++) {
        const double ratio = ratios[i / 2], radius = 0.05, vt = 0.02;
        const dem2d_material_desc material = stone_desc(ratio * KN, 1e9);
        const dem2d_particle_info p = bounce(&material, vt, 0.02, steps[i % 2][0], radius);
        row_within(
            label("stick, kt/kn = %.3g, t_c/%g: cos(pi sqrt(3 kt/kn))", ratio, steps[i % 2][0]),
            cos((double)PI * sqrt(3 * ratio)), (p.velocity.x + p.angular_velocity * radius) / vt,
            steps[i % 2][1]);
    }
}

/* --- rolling and sliding --------------------------------------------------------------------- */

/* A disc thrown along the floor without spin: the slip ends at v0 / (3 mu g) with v = 2 v0 / 3. */
static void slide_to_roll(double mu) {
    const double radius = 0.05, v0 = 1, dt = 2e-5;
    const dem2d_world_desc desc = world_desc(dt);
    const dem2d_material_desc material = stone_desc(KN, mu);
    const scene s = open_scene(&desc, &material);
    const double rest = disc_mass(radius) * G / KN;
    set_gravity(&s, 0, -G);
    add_floor(&s);
    const dem2d_particle_id id =
        add(&s, make_disc(radius), DEM2D_FREE, vec(0, radius - rest), vec(v0, 0), 0);
    double slip = v0, last = v0, v = v0, v_last = v0;
    int n = 0;
    for (; n < 1000000 && slip > 0; n++) {
        step(&s, 1);
        const dem2d_particle_info info = grain_of(&s, id);
        last = slip, v_last = v;
        v = info.velocity.x, slip = v + info.angular_velocity * (radius - rest / 2);
    }
    const double part = last / (last - slip);
    row_near(label("slide to roll, mu = %g: v = 2/3 v0", mu), 2 * v0 / 3,
             v_last + part * (v - v_last), 1e-3);
    row_near(label("slide to roll, mu = %g: t = v0/(3 mu g), s", mu), v0 / (3 * mu * G),
             (n - 1 + part) * dt, 1e-2);
    close_scene(&s);
}

/* A disc released on a slope (gravity is tilted), after one second. */
static void disc_on_incline(double degrees, double mu) {
    const double radius = 0.05, dt = 5e-5, b = degrees * DEGREE;
    const dem2d_world_desc desc = world_desc(dt);
    const dem2d_material_desc material = stone_desc(KN, mu);
    const scene s = open_scene(&desc, &material);
    const double rest = disc_mass(radius) * G * cos(b) / KN;
    set_gravity(&s, G * sin(b), -G * cos(b));
    add_floor(&s);
    const dem2d_particle_id id =
        add(&s, make_disc(radius), DEM2D_FREE, vec(0, radius - rest), vec(0, 0), 0);
    step(&s, 20000);
    const dem2d_particle_info info = grain_of(&s, id);
    const bool rolls = mu >= tan(b) / 3;
    const double a = rolls ? 2 * G * sin(b) / 3 : G * (sin(b) - mu * cos(b));
    const double spin = rolls ? a / radius : 2 * mu * G * cos(b) / radius;
    const char *name =
        label("disc on %g degrees, mu = %g, %s", degrees, mu, rolls ? "rolls" : "slips");
    row_near(label("%s: a, m/s2", name), a, info.velocity.x, 2e-3);
    if (spin > 0)
        row_near(label("%s: alpha, 1/s2", name), spin, -info.angular_velocity, 2e-3);
    else
        row_small(label("%s: alpha, 1/s2", name), info.angular_velocity, 1e-12);
    close_scene(&s);
}

/* The slope, in degrees, on which a block of this size first moves by a thousandth of its size or
   turns by a degree; raised by a tenth of a degree each 0.25 s. Damping stills it between. */
static double critical_slope(double width, double height, double mu, double from) {
    const dem2d_world_desc desc = world_desc(1e-4);
    const dem2d_material_desc material = stone_desc(KN, mu);
    const scene s = open_scene(&desc, &material);
    double slope = 0;
    add_floor(&s);
    const dem2d_particle_id id =
        add(&s, make_box(width, height), DEM2D_FREE,
            vec(0, height / 2 - DENSITY * width * height * G / (2 * KN)), vec(0, 0), 0);
    set_damping(&s, 0.5);
    for (int i = 1; i <= 40; i++) {
        slope = from * i / 40;
        set_gravity(&s, G * sin(slope * DEGREE), -G * cos(slope * DEGREE));
        step(&s, 250);
    }
    step(&s, 5000);
    const double x = grain_of(&s, id).pose.position.x;
    for (; slope < from + 10; slope += 0.1) {
        set_gravity(&s, G * sin(slope * DEGREE), -G * cos(slope * DEGREE));
        step(&s, 2500);
        const double moved = fabs(grain_of(&s, id).pose.position.x - x);
        if (moved > 1e-3 * height || fabs(angle_of(&s, id)) > DEGREE) break;
    }
    close_scene(&s);
    return slope;
}

static void blocks(void) {
    static const double mus[] = {0.2, 0.5}, ratios[] = {0.25, 0.5};
    for (int i = 0; i < COUNT_OF(mus); i++) {
        const double edge = atan(mus[i]) / DEGREE;
        row_within(label("block on a slope, mu = %g: slides from atan(mu), degrees", mus[i]), edge,
                   critical_slope(1, 0.4, mus[i], edge - 2), 0.5);
    }
    for (int i = 0; i < COUNT_OF(ratios); i++) {
        const double edge = atan(ratios[i]) / DEGREE;
        row_within(label("block, width/height %g: topples from atan(w/h), degrees", ratios[i]),
                   edge, critical_slope(ratios[i], 1, 0.9, edge - 2), 0.5);
    }
}

static void rolling(void) {
    static const double mus[] = {0.1, 0.3, 0.8};
    static const double slopes[][2] = {{10, 0.5}, {30, 0.25}, {30, 0.15}, {45, 0.1}, {20, 0}};
    table_group("Rolling, sliding, toppling");
    basis = "formula";
    for (int i = 0; i < COUNT_OF(mus); i++) slide_to_roll(mus[i]);
    for (int i = 0; i < COUNT_OF(slopes); i++) disc_on_incline(slopes[i][0], slopes[i][1]);
    blocks();
}

/* --- several bodies -------------------------------------------------------------------------- */

/* Opposite spins: the surfaces meet without slip, so friction has nothing to do. */
static void opposite_spins(void) {
    const double radius = 0.05, spin = 10;
    const dem2d_world_desc desc = world_desc((double)PI * sqrt(disc_mass(radius) / 2 / KN) / 100);
    const dem2d_material_desc material = stone_desc(KN, 0.5);
    const scene s = open_scene(&desc, &material);
    const dem2d_particle_id a = add(&s, make_disc(radius), DEM2D_FREE, vec(0, 0), vec(1, 0), spin);
    const dem2d_particle_id b =
        add(&s, make_disc(radius), DEM2D_FREE, vec(0.1001, 0), vec(-1, 0), -spin);
    step(&s, 400);
    const dem2d_particle_info p = grain_of(&s, a), q = grain_of(&s, b);
    row_near("opposite spins: rebound", -1, p.velocity.x, 1e-3);
    row_small("opposite spins: change of spin, 1/s",
              fmax(fabs(p.angular_velocity - spin), fabs(q.angular_velocity + spin)), 1e-12);
    row_small("opposite spins: velocity across, m/s", fmax(fabs(p.velocity.y), fabs(q.velocity.y)),
              1e-12);
    close_scene(&s);
}

/* The same chain of springs that push and don't pull, by small steps in units of m = k = 1. */
static void cradle_by_hand(int n, double *v) {
    long double x[5] = {0}, u[5] = {1}, f[6];
    const long double dt = PI / sqrtl(2) / 20000;
    for (int i = 0; i < 20000 * 3 * n; i++) {
        for (int k = 0; k < n; k++) x[k] += u[k] * dt / 2;
        f[0] = f[n] = 0;
        for (int k = 1; k < n; k++) f[k] = x[k - 1] > x[k] ? x[k - 1] - x[k] : 0;
        for (int k = 0; k < n; k++) u[k] += (f[k] - f[k + 1]) * dt, x[k] += u[k] * dt / 2;
    }
    for (int k = 0; k < n; k++) v[k] = (double)u[k];
}

/* Touching exactly: radius 0.5, centres at 0, 1, 2 ... */
static void cradle(int n) {
    const double radius = 0.5, v0 = 1e-2;
    const dem2d_world_desc desc = world_desc((double)PI * sqrt(disc_mass(radius) / 2 / KN) / 1000);
    const dem2d_material_desc material = stone_desc(0, 0);
    const scene s = open_scene(&desc, &material);
    dem2d_particle_id ids[5];
    double v[5];
    cradle_by_hand(n, v);
    for (int i = 0; i < n; i++)
        ids[i] = add(&s, make_disc(radius), DEM2D_FREE, vec(i, 0), vec(i ? 0 : v0, 0), 0);
    step(&s, 1000 * 3 * n);
    for (int i = 0; i < n; i++)
        row_within(label("cradle of %d: disc %d, v/v0", n, i + 1), v[i],
                   grain_of(&s, ids[i]).velocity.x / v0, 1e-3);
    close_scene(&s);
}

/* Thrown up and falling back with local damping: g (1 + a) up, g (1 - a) down. */
static void local_damping(void) {
    const double a = 0.3, v0 = 1, dt = 1e-3;
    dem2d_world_desc desc = world_desc(dt);
    const dem2d_material_desc material = stone_desc(0, 0);
    desc.gravity.y = -G, desc.local_damping = a;
    const scene s = open_scene(&desc, &material);
    const dem2d_particle_id id = add(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0), vec(0, v0), 0);
    step(&s, 70);
    row_near("local damping 0.3: up, g (1 + a), m/s2", G * (1 + a),
             (v0 - grain_of(&s, id).velocity.y) / (70 * dt), 1e-12);
    step(&s, 30);
    const double v = grain_of(&s, id).velocity.y;
    step(&s, 100);
    row_near("local damping 0.3: down, g (1 - a), m/s2", G * (1 - a),
             (v - grain_of(&s, id).velocity.y) / (100 * dt), 1e-12);
    close_scene(&s);
}

/* --- every pair of shapes -------------------------------------------------------------------- */

/* Sum, and the size of its terms: what rounding is measured by. */
static void add_momentum(const scene *s, dem2d_particle_id id, long double sum[3],
                         long double size[3]) {
    const dem2d_particle_info p = grain_of(s, id);
    const long double m = p.mass, x = p.pose.position.x, y = p.pose.position.y;
    const long double terms[4] = {m * p.velocity.x, m * p.velocity.y,
                                  m * (x * p.velocity.y - y * p.velocity.x),
                                  p.inertia * p.angular_velocity};
    for (int i = 0; i < 4; i++) sum[i < 2 ? i : 2] += terms[i];
    for (int i = 0; i < 4; i++) size[i < 2 ? i : 2] += fabsl(terms[i]);
}

/* Two shapes of about 1 m fly at each other; the loss of momentum and angular momentum from just
   before the first touch to just after the last, in parts of the sums of sizes: the rounding of
   places in free flight does not count. Returns whether they met and parted. */
static bool collide(int a, int b, double *momentum, double *angular) {
    const int models[2] = {a, b};
    const dem2d_world_desc desc = world_desc(2e-4);
    const dem2d_material_desc material = stone_desc(KN, 0.5);
    const scene s = open_scene(&desc, &material);
    long double before[3] = {0}, after[3] = {0}, size[3] = {0}, unused[3] = {0};
    dem2d_particle_id ids[2];
    int met = 0, free_steps = 0;
    for (int k = 0; k < 2; k++) {
        dem2d_shape *shape = random_model(models[k]);
        ids[k] = add_copy(&s, shape, DEM2D_FREE, vec(2.7 * k, uniform(-0.5, 0.5)), uniform(-3, 3),
                          vec(k ? -2 : 2, uniform(-1, 1)), uniform(-2, 2));
        dem2d_shape_destroy(shape);
    }
    for (int i = 0; i < 6000 && free_steps < 10; i++) {
        long double now[3] = {0}, terms[3] = {0};
        for (int k = 0; k < 2; k++) add_momentum(&s, ids[k], now, terms);
        step(&s, 1);
        const int open = contacts_of(&s, NULL, 0);
        if (open && !met) memcpy(before, now, sizeof now), memcpy(size, terms, sizeof terms);
        met += open;
        free_steps = met && !open ? free_steps + 1 : 0;
    }
    for (int k = 0; k < 2; k++) add_momentum(&s, ids[k], after, unused);
    close_scene(&s);
    if (free_steps < 10) return false;
    for (int k = 0; k < 2; k++)
        *momentum = fmax(*momentum, (double)(fabsl(after[k] - before[k]) / size[k]));
    *angular = fmax(*angular, (double)(fabsl(after[2] - before[2]) / size[2]));
    return true;
}

static void every_pair(void) {
    enum { TIMES = 4 };
    double momentum = 0, angular = 0;
    int met = 0;
    random_state = 77;
    for (int i = 0; i < MODELS * MODELS * TIMES; i++)
        met += collide(i % MODELS, i / MODELS % MODELS, &momentum, &angular);
    row_above("all pairs of shapes: share that met and parted", 0.9,
              (double)met / (MODELS * MODELS * TIMES));
    row_small("all pairs of shapes: momentum, worst, relative", momentum, 1e-14);
    row_small("all pairs of shapes: angular momentum, worst, relative", angular, 1e-13);
}

static void several_bodies(void) {
    table_group("Several bodies");
    basis = "formula";
    opposite_spins();
    local_damping();
    every_pair();
    basis = "integral";
    cradle(3), cradle(5);
}

/* --- the critical time step ------------------------------------------------------------------ */

/* A triangular lattice whose rim is fixed, every pair overlapping by 1e-4 of the radius, shaken by
   1e-6 of that. Returns the greatest kinetic energy on the way over that of the shaking. */
static double lattice_growth(double part, double *safe) {
    enum { SIDE = 24, STEPS = 2000 };
    const double radius = 0.05, spacing = 2 * radius * (1 - 0.5e-4);
    const double critical = 2 / sqrt(6 * KN / disc_mass(radius));
    dem2d_world_desc desc = world_desc(part * critical);
    const dem2d_material_desc material = stone_desc(0, 0);
    desc.skip_time_step_check = true;
    const scene s = open_scene(&desc, &material);
    const double speed = 1e-6 * 1e-4 * radius / critical;
    double first = 0, most = 0, limit;
    dem2d_shape *shape = make_disc(radius);
    random_state = 5;
    for (int i = 0; i < SIDE * SIDE; i++) {
        const int row = i / SIDE, column = i % SIDE;
        const bool rim = row == 0 || row == SIDE - 1 || column == 0 || column == SIDE - 1;
        const dem2d_vec at = vec(spacing * (column + 0.5 * (row % 2)), spacing * sqrt(0.75) * row);
        const dem2d_vec v = vec(uniform(-speed, speed), uniform(-speed, speed));
        add_copy(&s, shape, rim ? DEM2D_FIXED : DEM2D_FREE, at, 0, rim ? vec(0, 0) : v, 0);
    }
    dem2d_shape_destroy(shape);
    for (int i = 0; i < STEPS; i++) {
        step(&s, 1);
        const dem2d_energy e = energy_of(&s);
        if (i == 0)
            first = kinetic(&e),
            must(dem2d_world_time_step_bounds(s.world, safe, &limit, NULL), "bounds");
        most = fmax(most, kinetic(&e) / first);
    }
    close_scene(&s);
    return most;
}

static void critical_step(void) {
    const double critical = 2 / sqrt(6 * KN / disc_mass(0.05));
    double safe, same;
    table_group("Critical time step: triangular lattice 24 x 24, dt = 2/sqrt(6 k/m)");
    basis = "formula";
    /* stable: the energy of the shaking stays, up to what the springs take and give back; unstable:
       it grows by 1.49^2 a step until contacts open */
    row_below("kinetic energy over the first, 0.98 of it", 100, lattice_growth(0.98, &safe));
    row_above("kinetic energy over the first, 1.02 of it", 1e6, lattice_growth(1.02, &same));
    row_near("dem2d_world_time_step_bounds: safe, s", critical, safe, 1e-6);
}

/* --- rocking --------------------------------------------------------------------------------- */

enum { ROCK_ELLIPSE, ROCK_FOURIER, ROCK_BEZIER, ROCK_CUSTOM, ROCK_FIT_12, ROCK_FIT_10, ROCK_FIT_8 };

static const char *const rocker_names[] = {"ellipse",
                                           "FS of order 4",
                                           "polybezier",
                                           "custom",
                                           "ellipse as FS of 12",
                                           "ellipse as 10 arcs",
                                           "ellipse as FS of 8"};

/* Ellipse of 25 and 10 mm, grown by 5 mm. */
static dem2d_vec slim_ellipse(void *user, dem2d_vec u, double *rho) {
    (void)user;
    const double a = 0.025, b = 0.01, h = sqrt(a * a * u.x * u.x + b * b * u.y * u.y);
    if (rho) *rho = a * a * b * b / (h * h * h) + 0.005;
    return vec((a * a / h + 0.005) * u.x, (b * b / h + 0.005) * u.y);
}

/* An ellipse of 30 and 15 mm as a series or as arcs. */
static dem2d_shape *fitted_rocker(int kind) {
    enum { POINTS = 2000, ORDER = 12, ARCS = 10 };
    dem2d_vec outline[POINTS], control[3 * ARCS];
    double a[ORDER + 1], b[ORDER + 1];
    dem2d_shape *shape;
    const int order = kind == ROCK_FIT_8 ? 8 : ORDER;
    for (int i = 0; i < POINTS; i++) {
        const double t = (double)(2 * PI) * i / POINTS;
        outline[i] = vec(0.03 * cos(t), 0.015 * sin(t));
    }
    if (kind == ROCK_FIT_10) {
        must(dem2d_bezier_fit(NULL, outline, POINTS, ARCS, control), "fit");
        must(dem2d_shape_create_bezier(NULL, control, ARCS, &shape), "fit");
    } else {
        must(dem2d_fourier_fit(NULL, outline, POINTS, order, 0, a, b), "fit");
        must(dem2d_shape_create_fourier(NULL, a, b, order, &shape), "fit");
    }
    return shape;
}

/* Shapes that lie flat at angle 0, symmetric left and right. */
static dem2d_shape *rocker(int kind) {
    const double a[5] = {0.044, 0, 0.004, 0, 0.0002}, b[5] = {0};
    const dem2d_vec arcs[12] = {{0.03, 0},       {0.03, 0.01},  {0.02, 0.015},  {0, 0.015},
                                {-0.02, 0.015},  {-0.03, 0.01}, {-0.03, 0},     {-0.03, -0.01},
                                {-0.02, -0.015}, {0, -0.015},   {0.02, -0.015}, {0.03, -0.01}};
    dem2d_custom_desc custom = {0};
    dem2d_shape *shape;
    custom.support = slim_ellipse, custom.outline_points = 4000;
    switch (kind) {
    case ROCK_ELLIPSE:
        return make_ellipse(0.03, 0.015);
    case ROCK_FOURIER:
        must(dem2d_shape_create_fourier(NULL, a, b, 4, &shape), "rocker");
        return shape;
    case ROCK_BEZIER:
        must(dem2d_shape_create_bezier(NULL, arcs, 4, &shape), "rocker");
        return shape;
    case ROCK_CUSTOM:
        must(dem2d_shape_create_custom(NULL, &custom, &shape), "rocker");
        return shape;
    default:
        return fitted_rocker(kind);
    }
}

/* Small rocking about angle 0: the mean period, from four zero crossings by straight lines; own is
   that of w^2 = g (rho - h)/(I/m + h^2), without friction g (rho - h) m/I. */
static double rocking_period(int kind, bool friction, double *own) {
    const double dt = 1e-5, start = 1e-3; /* the polybezier has a kink of rho at angle 0 */
    const dem2d_world_desc desc = world_desc(dt);
    const dem2d_material_desc material = stone_desc(friction ? KN : 0, friction ? 1000 : 0);
    const scene s = open_scene(&desc, &material);
    dem2d_shape *shape = rocker(kind);
    dem2d_support low;
    must(dem2d_shape_support(shape, dem2d_pose_make(0, 0, 0, 1), vec(0, -1), &low), "support");
    const double h = low.value, rho = low.rho;
    must(dem2d_shape_support(shape, dem2d_pose_make(0, 0, start, 1), vec(0, -1), &low), "support");
    set_gravity(&s, 0, -G);
    add_floor(&s);
    const dem2d_particle_id id = add(&s, shape, DEM2D_FREE, vec(0, low.value), vec(0, 0), 0);
    const dem2d_particle_info info = grain_of(&s, id);
    const double about = info.inertia / info.mass + (friction ? h * h : 0);
    *own = (double)(2 * PI) / sqrt(G * (rho - h) / about);
    const double rest = info.mass * G / KN;
    must(dem2d_world_move_particle(s.world, id, vec(0, low.value - rest), start), "move");
    double last = start, first = 0, latest = 0;
    int crossings = 0;
    for (int i = 1; i <= 1000000 && crossings < 5; i++) {
        step(&s, 1);
        const double angle = angle_of(&s, id);
        if (last > 0 && angle <= 0) {
            latest = i - angle / (angle - last);
            if (crossings++ == 0) first = latest;
        }
        last = angle;
    }
    close_scene(&s);
    return crossings == 5 ? (latest - first) * dt / 4 : 0;
}

static void rocking_shapes(void) {
    static const int fits[] = {ROCK_ELLIPSE, ROCK_FIT_12, ROCK_FIT_10};
    const double a = 0.03, b = 0.015;
    const double w = sqrt(4 * G * (a * a - b * b) / (b * (a * a + 5 * b * b)));
    double own;
    for (int i = 0; i < COUNT_OF(fits); i++)
        row_near(label("rocking %s, no slip: period, s", rocker_names[fits[i]]),
                 (double)(2 * PI) / w, rocking_period(fits[i], true, &own), 5e-3);
    double period = rocking_period(ROCK_FIT_8, true, &own);
    row_near(label("rocking %s, its own rho, h, I", rocker_names[ROCK_FIT_8]), own, period, 5e-3);
    for (int kind = ROCK_ELLIPSE; kind <= ROCK_CUSTOM; kind++)
        for (int friction = 1; friction >= 0; friction--) {
            period = rocking_period(kind, friction, &own);
            row_near(label("rocking %s, %s: period, s", rocker_names[kind],
                           friction ? "no slip" : "no friction"),
                     own, period, 5e-3);
        }
}

/* Time of a block from release at an angle to standing upright: angle'' = -p^2 sin(al - angle). */
static double upright_by_hand(double p, double slenderness, double angle) {
    const double dt = 1e-6;
    double w = 0, t = 0;
    for (; angle > 0; t += dt) {
        w -= p * p * sin(slenderness - angle) * dt;
        angle += w * dt;
    }
    return t;
}

/* A slender block on its corner, released at a part of the angle at which it would topple. */
static void housner(double part) {
    const double b = 0.05, h = 0.2, dt = 1e-5;
    const double al = atan(b / h), p = sqrt(3 * G / (4 * hypot(b, h))), start = part * al;
    dem2d_world_desc desc = world_desc(dt);
    dem2d_material_desc material = stone_desc(1e9, 1000);
    material.normal_stiffness = 1e9;
    desc.gravity.y = -G;
    const scene s = open_scene(&desc, &material);
    add_floor(&s);
    const double rest = DENSITY * 4 * b * h * G / material.normal_stiffness;
    const dem2d_particle_id id =
        add(&s, make_box(2 * b, 2 * h), DEM2D_FREE, vec(0, 1), vec(0, 0), 0);
    must(dem2d_world_move_particle(s.world, id, vec(0, h * cos(start) + b * sin(start) - rest),
                                   start),
         "move");
    double last = start, angle = start;
    int n = 0;
    for (; n < 1000000 && angle > 0; n++) {
        step(&s, 1);
        last = angle, angle = angle_of(&s, id);
    }
    close_scene(&s);
    const double period = 4 * dt * (n - 1 + last / (last - angle));
    basis = "formula";
    row_near(label("Housner's block, th0/al = %g: (4/p) acosh(1/(1 - th0/al)), s", part),
             4 / p * acosh(1 / (1 - part)), period, 1e-2);
    basis = "integral";
    row_near(label("Housner's block, th0/al = %g: the full equation, s", part),
             4 * upright_by_hand(p, al, start), period, 1e-2);
}

/* --- rest ------------------------------------------------------------------------------------ */

/* Boxes of 1 m on one another, settled with damping; then a second without. */
static void boxes_at_rest(int count) {
    const double dt = 2e-4, weight = DENSITY * G;
    dem2d_world_desc desc = world_desc(dt);
    const dem2d_material_desc material = stone_desc(KN, 0.5);
    dem2d_particle_id ids[10];
    dem2d_vec at[10];
    double y = 0.5, tilt = 0, drift = 0;
    desc.gravity.y = -G, desc.local_damping = 0.5;
    const scene s = open_scene(&desc, &material);
    const dem2d_wall_id floor = add_floor(&s);
    dem2d_shape *shape = make_box(1, 1);
    random_state = 5;
    for (int i = 0; i < count; i++) {
        y -= weight * (count - i) / (2 * KN);
        ids[i] = add_copy(&s, shape, DEM2D_FREE, vec(uniform(-1e-5, 1e-5), y), uniform(-1e-5, 1e-5),
                          vec(0, 0), 0);
        y += 1;
    }
    dem2d_shape_destroy(shape);
    step(&s, 100000);
    set_damping(&s, 0);
    for (int i = 0; i < count; i++) at[i] = grain_of(&s, ids[i]).pose.position;
    step(&s, (int)(1 / dt));
    for (int i = 0; i < count; i++) {
        const dem2d_vec now = grain_of(&s, ids[i]).pose.position;
        drift = fmax(drift, hypot(now.x - at[i].x, now.y - at[i].y));
        tilt = fmax(tilt, fabs(angle_of(&s, ids[i])));
    }
    const char *name = count == 1 ? "box" : label("stack of %d boxes", count);
    row_small(label("%s at rest: tilt, rad", name), tilt, 1e-4);
    row_small(label("%s at rest: drift, sizes/s", name), drift, 1e-6);
    row_near(label("%s at rest: floor force/weight", name), 1,
             -wall_of(&s, floor).force.y / (count * weight), 1e-6);
    close_scene(&s);
}

static void rocking(void) {
    table_group("Rocking, rest");
    basis = "formula";
    rocking_shapes();
    housner(0.2), housner(0.5);
    basis = "formula";
    boxes_at_rest(1), boxes_at_rest(10);
}

/* --- energy ---------------------------------------------------------------------------------- */

enum {
    RELEASES = 16
}; /* from 1 to 4 degrees; from 5 on corners sink deeper than a 64th of the
      box, where its face gives way to a corner */

/* A box of 1 m rocks on a floor for 20 s, undamped and without friction. Change of the total energy
   in parts of that by which it was lifted. At each touch the force sets in somewhere inside a step,
   which gives or takes a part (w dt)^2 of the energy: chance, so that releases are averaged. */
static double rocking_drift(double tilt) {
    dem2d_world_desc desc = world_desc(1e-4);
    const dem2d_material_desc material = stone_desc(0, 0);
    desc.gravity.y = -G;
    const scene s = open_scene(&desc, &material);
    add_floor(&s);
    const double y = (cos(tilt) + sin(tilt)) / 2, lifted = DENSITY * G * (y - 0.5);
    const dem2d_particle_id id = add(&s, make_box(1, 1), DEM2D_FREE, vec(0, 1), vec(0, 0), 0);
    must(dem2d_world_move_particle(s.world, id, vec(0, y), tilt), "move");
    step(&s, 1);
    const dem2d_energy first = energy_of(&s);
    step(&s, 200000);
    const dem2d_energy last = energy_of(&s);
    close_scene(&s);
    return (total(&last) - total(&first)) / lifted;
}

/* The same by two ideal springs under the corners and the same leapfrog. */
static double ideal_drift(double tilt) {
    const double dt = 1e-4, mass = DENSITY, inertia = mass / 6;
    double y = (cos(tilt) + sin(tilt)) / 2, angle = tilt, v = 0, w = 0, first = 0, now = 0;
    const double lifted = mass * G * (y - 0.5);
    for (int i = 0; i <= 200000; i++) {
        double force = -mass * G, torque = 0, energy = mass * G * y;
        for (int k = -1; k <= 1; k += 2) {
            const double x = k * 0.5 * cos(angle) + 0.5 * sin(angle);
            const double depth = 0.5 * cos(angle) - k * 0.5 * sin(angle) - y;
            if (depth <= 0) continue;
            force += KN * depth, torque += KN * depth * x, energy += KN * depth * depth / 2;
        }
        const double next_v = v + force / mass * dt, next_w = w + torque / inertia * dt;
        now =
            energy + mass * (v * v + next_v * next_v) / 4 + inertia * (w * w + next_w * next_w) / 4;
        if (i == 0) first = now;
        v = next_v, w = next_w, y += v * dt, angle += w * dt;
    }
    return (now - first) / lifted;
}

static void energy(void) {
    table_group("Energy: 64 grains, area fraction 0.3; a rocking box");
    basis = "formula";
    for (int model = 0; model < MODELS; model++) gas(model, 4);
    double header = 0, springs = 0;
    for (int i = 0; i < RELEASES; i++) {
        const double tilt = (1 + 3.0 * i / (RELEASES - 1)) * DEGREE;
        header += pow(rocking_drift(tilt), 2) / RELEASES;
        springs += pow(ideal_drift(tilt), 2) / RELEASES;
    }
    row_small("box rocking 20 s, dt = 1e-4: energy drift", sqrt(header), 1e-4);
    basis = "integral";
    row_below("box rocking: drift over that of two ideal springs", 2, sqrt(header / springs));
}

/* --- geometry of shapes ---------------------------------------------------------------------- */

/* A closed curve in pieces: place and derivative at t in [0, 1] of each. */
typedef struct curve {
    void (*at)(const void *data, int piece, long double t, long double place[2],
               long double slope[2]);
    const void *data;
    int pieces;
} curve;

typedef struct moments {
    long double area, x, y, polar, length; /* centroid; polar about it */
} moments;

/* Green's formulas by Gauss-Legendre with five points on each of 64 parts of a piece. */
static moments integrate(const curve *c) {
    static const long double node[3] = {0, 0.538469310105683091036314420700208804967L,
                                        0.906179845938663992797626878299392965126L};
    static const long double weight[3] = {0.568888888888888888888888888888888888889L,
                                          0.478628670499366468041291514835638192912L,
                                          0.236926885056189087514264040719917362644L};
    moments m = {0, 0, 0, 0, 0};
    for (int i = 0; i < 64 * 5 * c->pieces; i++) {
        const int k = i % 5 - 2;
        const long double t = ((i / 5) % 64 + 0.5L + (k < 0 ? -0.5L : 0.5L) * node[abs(k)]) / 64;
        const long double w = weight[abs(k)] / 128;
        long double p[2], d[2];
        c->at(c->data, i / (64 * 5), t, p, d);
        const long double area = p[0] * d[1] - p[1] * d[0];
        m.area += w * area / 2;
        m.x += w * area * p[0] / 3, m.y += w * area * p[1] / 3;
        m.polar += w * area * (p[0] * p[0] + p[1] * p[1]) / 4;
        m.length += w * sqrtl(d[0] * d[0] + d[1] * d[1]);
    }
    m.x /= m.area, m.y /= m.area;
    m.polar -= m.area * (m.x * m.x + m.y * m.y);
    return m;
}

typedef struct outline_data {
    double a[17], b[17]; /* series; half axes in a[0], a[1] */
    int order, count;
    dem2d_vec points[36]; /* corners or control points */
    double rounding;
} outline_data;

static void fourier_at(const void *data, int piece, long double t, long double p[2],
                       long double d[2]) {
    const outline_data *o = data;
    const long double angle = 2 * PI * (piece + t) / 8, c = cosl(angle), s = sinl(angle);
    long double h = o->a[0] / 2.0L, slope = 0, rho = h;
    for (int n = 1; n <= o->order; n++) {
        const long double cn = cosl(n * angle), sn = sinl(n * angle);
        h += o->a[n] * cn + o->b[n] * sn;
        slope += n * (o->b[n] * cn - o->a[n] * sn);
        rho += (1.0L - n * n) * (o->a[n] * cn + o->b[n] * sn);
    }
    p[0] = h * c - slope * s, p[1] = h * s + slope * c;
    d[0] = -rho * s * 2 * PI / 8, d[1] = rho * c * 2 * PI / 8;
}

static void ellipse_at(const void *data, int piece, long double t, long double p[2],
                       long double d[2]) {
    const outline_data *o = data;
    const long double angle = 2 * PI * (piece + t) / 8, c = cosl(angle), s = sinl(angle);
    p[0] = o->a[0] * c, p[1] = o->a[1] * s;
    d[0] = -o->a[0] * s * 2 * PI / 8, d[1] = o->a[1] * c * 2 * PI / 8;
}

static void bezier_at(const void *data, int piece, long double t, long double p[2],
                      long double d[2]) {
    const outline_data *o = data;
    const long double u = 1 - t;
    for (int k = 0; k < 2; k++) {
        long double q[4];
        for (int j = 0; j < 4; j++) {
            const dem2d_vec *v = &o->points[(3 * piece + j) % (3 * o->count)];
            q[j] = k == 0 ? v->x : v->y;
        }
        p[k] = u * u * u * q[0] + 3 * u * u * t * q[1] + 3 * u * t * t * q[2] + t * t * t * q[3];
        d[k] = 3 * (u * u * (q[1] - q[0]) + 2 * u * t * (q[2] - q[1]) + t * t * (q[3] - q[2]));
    }
}

/* Sides in the even pieces, moved out by the rounding; arcs about the corners in the odd ones. */
static void polygon_at(const void *data, int piece, long double t, long double p[2],
                       long double d[2]) {
    const outline_data *o = data;
    long double side[3][2], normal[2][2];
    const dem2d_vec *corner[3];
    for (int k = 0; k < 3; k++) corner[k] = &o->points[(piece / 2 + k) % o->count];
    for (int k = 0; k < 2; k++) {
        side[k][0] = (long double)corner[k + 1]->x - corner[k]->x;
        side[k][1] = (long double)corner[k + 1]->y - corner[k]->y;
        const long double size = sqrtl(side[k][0] * side[k][0] + side[k][1] * side[k][1]);
        normal[k][0] = side[k][1] / size, normal[k][1] = -side[k][0] / size;
    }
    if (piece % 2 == 0) {
        p[0] = corner[0]->x + t * side[0][0] + o->rounding * normal[0][0];
        p[1] = corner[0]->y + t * side[0][1] + o->rounding * normal[0][1];
        d[0] = side[0][0], d[1] = side[0][1];
        return;
    }
    const long double turn = atan2l(normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0],
                                    normal[0][0] * normal[1][0] + normal[0][1] * normal[1][1]);
    const long double c = cosl(t * turn), s = sinl(t * turn);
    const long double n[2] = {normal[0][0] * c - normal[0][1] * s,
                              normal[0][1] * c + normal[0][0] * s};
    p[0] = corner[1]->x + o->rounding * n[0], p[1] = corner[1]->y + o->rounding * n[1];
    d[0] = -o->rounding * turn * n[1], d[1] = o->rounding * turn * n[0];
}

/* Worst relative differences over the shapes looked at. */
typedef struct worst_moments {
    double area, centroid, polar;
} worst_moments;

/* Takes the shape. */
static moments compare_moments(const curve *c, dem2d_shape *shape, worst_moments *worst) {
    dem2d_shape_info info;
    const moments m = integrate(c);
    must(dem2d_shape_get(shape, &info), "shape");
    dem2d_shape_destroy(shape);
    worst->area = fmax(worst->area, (double)fabsl(info.mass.area / m.area - 1));
    worst->polar = fmax(worst->polar, (double)fabsl(info.mass.polar_moment / m.polar - 1));
    worst->centroid =
        fmax(worst->centroid,
             (double)hypotl(info.offset.x - m.x, info.offset.y - m.y) / info.circumscribed);
    return m;
}

static void moment_rows(const char *name, const worst_moments *worst) {
    row_small(label("%s: area, worst relative error", name), worst->area, 1e-13);
    row_small(label("%s: centroid, worst error/radius", name), worst->centroid, 1e-13);
    row_small(label("%s: polar moment, worst relative error", name), worst->polar, 1e-13);
}

/* Random series: area pi a0^2/4 + (pi/2) sum (1 - n^2)(an^2 + bn^2), perimeter pi a0, width
   a0 + 2 sum over even n, and the Cauchy mean of the width, perimeter/pi. */
static void fourier_identities(int times) {
    worst_moments worst = {0, 0, 0};
    double area_error = 0, length_error = 0, width_error = 0, mean_error = 0;
    for (int i = 0; i < times; i++) {
        outline_data o = {{0}, {0}, 16, 0, {{0, 0}}, 0};
        dem2d_virtual_desc desc = {0};
        dem2d_shape *shape;
        const curve c = {fourier_at, &o, 8};
        desc.radius = 1, desc.elongation = 0.12, desc.roundness = 0.05, desc.roughness = 0.02;
        desc.seed = random_bits(&random_state), desc.min_radius = 0.02;
        must(dem2d_fourier_virtual(&desc, 16, o.a, o.b), "virtual grain");
        must(dem2d_shape_create_fourier(NULL, o.a, o.b, 16, &shape), "Fourier series");
        long double area = PI * o.a[0] * o.a[0] / 4, width_sum = 0;
        for (int n = 1; n <= 16; n++)
            area += PI / 2 * (1.0L - n * n) *
                    ((long double)o.a[n] * o.a[n] + (long double)o.b[n] * o.b[n]);
        for (int k = 0; k < 64; k++) {
            const long double t = PI * k / 64;
            long double width = o.a[0];
            dem2d_support there, back;
            const dem2d_vec u = vec((double)cosl(t), (double)sinl(t));
            must(dem2d_shape_support(shape, dem2d_pose_make(0, 0, 0, 1), u, &there), "support");
            must(dem2d_shape_support(shape, dem2d_pose_make(0, 0, 0, 1), vec(-u.x, -u.y), &back),
                 "support");
            for (int n = 2; n <= 16; n += 2)
                width += 2 * (o.a[n] * cosl(n * t) + o.b[n] * sinl(n * t));
            const double got = there.value + back.value;
            width_error = fmax(width_error, (double)fabsl(got / width - 1));
            width_sum += got / 64;
        }
        mean_error = fmax(mean_error, (double)fabsl(width_sum / o.a[0] - 1));
        dem2d_shape_info info;
        must(dem2d_shape_get(shape, &info), "shape");
        area_error = fmax(area_error, (double)fabsl(info.mass.area / area - 1));
        const moments m = compare_moments(&c, shape, &worst);
        length_error = fmax(length_error, (double)fabsl(m.length / (PI * o.a[0]) - 1));
    }
    basis = "formula";
    row_small("FS of order 16: area by its coefficients", area_error, 1e-13);
    row_small("FS of order 16: width a0 + 2 sum of even orders", width_error, 1e-13);
    row_small("FS of order 16: mean width a0", mean_error, 1e-13);
    row_small("FS of order 16: perimeter pi a0 (of this program's curve)", length_error, 1e-13);
    basis = "integral";
    moment_rows("FS of order 16", &worst);
}

static void moments_of_models(int times) {
    worst_moments worst[4] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    static const char *const names[4] = {"ellipses", "polygons", "rounded polygons", "polybeziers"};
    for (int i = 0; i < times; i++) {
        outline_data o = {{uniform(0.2, 3), 1}, {0}, 0, 0, {{0, 0}}, 0};
        const curve round = {ellipse_at, &o, 8};
        compare_moments(&round, make_ellipse(o.a[0], o.a[1]), &worst[0]);
        const dem2d_vec at = vec(uniform(-1, 1), uniform(-1, 1));
        o.count = 3 + random_below(&random_state, 10);
        for (int k = 0; k < o.count; k++) {
            const double t = (double)(2 * PI) * (k + uniform(-0.25, 0.25)) / o.count;
            o.points[k] = vec(at.x + 1.7 * cos(t), at.y + sin(t));
        }
        for (int rounded = 0; rounded < 2; rounded++) {
            const curve sides = {polygon_at, &o, 2 * o.count};
            dem2d_shape *shape;
            o.rounding = rounded * uniform(0.01, 1);
            must(dem2d_shape_create_polygon(NULL, o.points, o.count, o.rounding, &shape),
                 "polygon");
            compare_moments(&sides, shape, &worst[1 + rounded]);
        }
        for (int k = 0; k < 4; k++) { /* the egg of `egg` at a place of its own */
            static const double way[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
            const double *p = way[k], *q = way[(k + 1) % 4], f = uniform(0.3, 0.9);
            o.points[3 * k] = vec(at.x + 1.4 * p[0], at.y + p[1]);
            o.points[3 * k + 1] = vec(at.x + 1.4 * (p[0] + f * q[0]), at.y + p[1] + f * q[1]);
            o.points[3 * k + 2] = vec(at.x + 1.4 * (q[0] + f * p[0]), at.y + q[1] + f * p[1]);
        }
        dem2d_shape *shape;
        const curve arcs = {bezier_at, &o, 4};
        o.count = 4;
        must(dem2d_shape_create_bezier(NULL, o.points, 4, &shape), "polybezier");
        compare_moments(&arcs, shape, &worst[3]);
    }
    for (int i = 0; i < 4; i++) moment_rows(names[i], &worst[i]);
}

/* Unit circle of four arcs with handles of 0.5522847498. */
static void four_arcs(void) {
    static const double way[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    const double kappa = 0.5522847498;
    outline_data o = {{0}, {0}, 0, 4, {{0, 0}}, 0};
    const curve c = {bezier_at, &o, 4};
    dem2d_shape *shape;
    dem2d_mass mass = {0, {0, 0}, 0};
    long double most = 0, got = 0;
    for (int k = 0; k < 4; k++) {
        const double *p = way[k], *q = way[(k + 1) % 4];
        o.points[3 * k] = vec(p[0], p[1]);
        o.points[3 * k + 1] = vec(p[0] + kappa * q[0], p[1] + kappa * q[1]);
        o.points[3 * k + 2] = vec(q[0] + kappa * p[0], q[1] + kappa * p[1]);
    }
    must(dem2d_shape_create_bezier(NULL, o.points, 4, &shape), "polybezier");
    must(dem2d_shape_mass(shape, &mass), "mass");
    for (int i = 0; i <= 100000; i++) {
        long double p[2], d[2];
        dem2d_support s;
        bezier_at(&o, 0, i / 100000.0L, p, d);
        most = fmaxl(most, hypotl(p[0], p[1]));
        const double t = (double)(PI / 2) * i / 100000;
        must(dem2d_shape_support(shape, dem2d_pose_make(0, 0, 0, 1), vec(cos(t), sin(t)), &s),
             "support");
        got = fmaxl(got, hypotl(s.point.x, s.point.y));
    }
    dem2d_shape_destroy(shape);
    basis = "integral";
    row_within("four arcs for a circle: radial error", (double)(most - 1), (double)(got - 1), 1e-9);
    row_within("four arcs for a circle: area error", (double)(integrate(&c).area / PI - 1),
               (double)(mass.area / PI - 1), 1e-13);
    basis = "literature";
    row_within("four arcs for a circle: radial error", 2.725e-4, (double)(got - 1), 0.5e-7);
    row_within("four arcs for a circle: area error", 2.800e-4, (double)(mass.area / PI - 1),
               0.5e-7);
}

/* An outline of the folder by its name. */
static outline read_named(const char *folder, const char *name) {
    char *path = join_text(folder, "/", name);
    size_t count;
    outline o;
    int line;
    char *bytes = read_whole(path, &count);
    const char *wrong = parse_outline(bytes, count, &o, &line);
    if (wrong != NULL) fail(STATUS_BAD_INPUT, "%s, line %d: %s", path, line, wrong);
    free(bytes);
    free(path);
    return o;
}

typedef struct fit_row {
    const char *name;
    dem2d_fit_desc desc;
    double expected, band; /* band 0: at least what is expected, to 0.001 */
} fit_row;

#define FOURIER_FIT(how, order) .count = order, .model = DEM2D_FOURIER, .method = DEM2D_FIT_##how

/* Mean coverage of twelve grains beside what an independent trial of the same fits reached. The
   papers' reductions depend on details that they don't give (samples, factor): 0.005. The fits
   with constraints are at a minimum, and must not be worse. */
static void coverage(const outline *grains, int count) {
    static const fit_row rows[] = {
        {"FS of 4, reduction by eq. 7", {FOURIER_FIT(REDUCTION, 4)}, 0.8943, 0.005},
        {"FS of 8, reduction by eq. 7", {FOURIER_FIT(REDUCTION, 8)}, 0.8953, 0.005},
        {"FS of 16, reduction by eq. 7", {FOURIER_FIT(REDUCTION, 16)}, 0.8953, 0.005},
        {"FS of 4, reduction, exact test", {FOURIER_FIT(REDUCTION_EXACT, 4)}, 0.9001, 0.005},
        {"FS of 8, reduction, exact test", {FOURIER_FIT(REDUCTION_EXACT, 8)}, 0.9052, 0.005},
        {"FS of 16, reduction, exact test", {FOURIER_FIT(REDUCTION_EXACT, 16)}, 0.9062, 0.005},
        {"FS of 4, Fejer", {FOURIER_FIT(FEJER, 4), .scale = DEM2D_SCALE_NONE}, 0.8222, 0},
        {"FS of 8, Fejer", {FOURIER_FIT(FEJER, 8), .scale = DEM2D_SCALE_NONE}, 0.8794, 0},
        {"FS of 16, Fejer", {FOURIER_FIT(FEJER, 16), .scale = DEM2D_SCALE_NONE}, 0.9195, 0},
        {"FS of 4, constrained", {FOURIER_FIT(CONSTRAINED, 4), .corners = true}, 0.9245, 0},
        {"FS of 8, constrained", {FOURIER_FIT(CONSTRAINED, 8), .corners = true}, 0.9540, 0},
        {"FS of 16, constrained", {FOURIER_FIT(CONSTRAINED, 16), .corners = true}, 0.9682, 0},
        {"FS of 8, constrained, rho >= 0.1 R", {FOURIER_FIT(CONSTRAINED, 8)}, 0.9515, 0},
        {"FS of 8, constrained, grain's area",
         {FOURIER_FIT(CONSTRAINED, 8), .corners = true, .scale = DEM2D_SCALE_GRAIN},
         0.9507,
         0},
        {"polybezier of 10 arcs", {.count = 10, .model = DEM2D_BEZIER}, 0.978, 0},
        {"polybezier of 10 arcs, any curvature",
         {.count = 10, .model = DEM2D_BEZIER, .unbounded = true},
         0.9795,
         0},
    };
    basis = "trial";
    for (int i = 0; i < COUNT_OF(rows); i++) {
        double mean = 0;
        for (int k = 0; k < count; k++) {
            dem2d_fit_report report;
            dem2d_shape *shape;
            must(dem2d_outline_fit(NULL, grains[k].points, grains[k].count, &rows[i].desc, &shape,
                                   &report),
                 rows[i].name);
            dem2d_shape_destroy(shape);
            mean += report.coverage / count;
        }
        const char *name = label("coverage: %s", rows[i].name);
        if (rows[i].band > 0)
            row_within(name, rows[i].expected, mean, rows[i].band);
        else
            row_above(name, rows[i].expected - 0.001, mean);
    }
}

/* The exact hull's coverage is 1 - (hull's area - area)/area. */
static void hull_coverage(const outline *grains, int count) {
    double expected = 0, got = 0;
    for (int k = 0; k < count; k++) {
        const outline *o = &grains[k];
        dem2d_vec *hull = get_memory(NULL, (size_t)o->count, sizeof *hull);
        dem2d_mass grain_mass, hull_mass;
        dem2d_difference difference;
        int corners;
        must(dem2d_polygon_hull(NULL, o->points, o->count, hull, &corners), "hull");
        must(dem2d_polygon_mass(o->points, o->count, &grain_mass), "area");
        must(dem2d_polygon_mass(hull, corners, &hull_mass), "area");
        must(dem2d_outline_compare(NULL, o->points, o->count, hull, corners, &difference),
             "difference");
        expected += (2 - hull_mass.area / grain_mass.area) / count;
        got += difference.coverage / count;
        free(hull);
    }
    basis = "formula";
    row_near("coverage: exact hull", expected, got, 1e-12);
    basis = "trial";
    row_within("coverage: exact hull", 0.9799, got, 5e-5);
}

static void geometry(const char *folder) {
    table_group("Geometry of shapes");
    random_state = 11;
    fourier_identities(100);
    moments_of_models(100);
    four_arcs();
    if (folder == NULL) {
        printf("coverage on real outlines: skipped without DATA=DIR\n");
        return;
    }
    char *path = join_text(folder, "/", "core12.txt"), name[256];
    FILE *list = fopen(path, "r");
    if (list == NULL) {
        printf("coverage on real outlines: skipped, no %s\n", path);
    } else {
        outline grains[64];
        int count = 0;
        while (count < 64 && fscanf(list, "%250s", name) == 1) {
            strcat(name, ".csv");
            grains[count++] = read_named(folder, name);
        }
        fclose(list);
        hull_coverage(grains, count);
        coverage(grains, count);
        for (int i = 0; i < count; i++) free(grains[i].points);
    }
    free(path);
}

/* --- balance --------------------------------------------------------------------------------- */

/* Grains of all models under gravity on a floor between two walls; then without weight between
   four, smooth ones, pressed together. */
static void balance(void) {
    static const bool kinds[KINDS] = {true, true, true, true, true};
    dem2d_world_desc desc = world_desc(1e-4);
    const dem2d_material_desc material = stone_desc(KN, 0.4);
    desc.gravity.y = -G, desc.local_damping = 0.5;
    packing p = open_packing(&desc, &material, 0.8, 1.2, TOP);
    random_state = 21;
    fill(&p, 150, kinds, NULL, 0.04, 0.06);
    step(&p.s, 20000);
    settle(&p, 1e-8, 400000);
    int count;
    double weight = 0, lift = 0;
    dem2d_particle_id *ids = all_ids(&p.s, &count);
    for (int i = 0; i < count; i++) weight += grain_of(&p.s, ids[i]).mass * G;
    free(ids);
    basis = "formula";
    for (int i = 0; i < TOP; i++) lift -= wall_of(&p.s, p.walls[i]).force.y;
    row_near("150 grains at rest: force of floor and walls/weight", 1, lift / weight, 1e-6);
    basis = "measured";
    set_gravity(&p.s, 0, 0), p.gravity = vec(0, 0);
    smooth_walls(&p);
    put_lid(&p);
    control_wall(&p, TOP, DEM2D_WALL_SERVO, 1e5, 0.1);
    control_wall(&p, RIGHT, DEM2D_WALL_SERVO, 1e5, 0.1);
    step(&p.s, 10000);
    settle(&p, 1e-8, 400000);
    /* boundary: (1/A) sum of place x force over the walls' contacts, pressure positive */
    dem2d_stress stress, boundary = {0, 0, 0, 0};
    const dem2d_box b = inside(&p);
    const double area = (b.upper.x - b.lower.x) * (b.upper.y - b.lower.y);
    dem2d_contact_info *list = all_contacts(&p.s, &count);
    for (int i = 0; i < count; i++) {
        const dem2d_contact_info *c = &list[i];
        const dem2d_vec f = vec(c->normal.x * c->normal_force - c->normal.y * c->tangential_force,
                                c->normal.y * c->normal_force + c->normal.x * c->tangential_force);
        if (c->b.generation != 0) continue;
        boundary.xx += c->point.x * f.x / area, boundary.xy += c->point.x * f.y / area;
        boundary.yx += c->point.y * f.x / area, boundary.yy += c->point.y * f.y / area;
    }
    free(list);
    must(dem2d_world_stress(p.s.world, area, &stress), "stress");
    const double mean = (boundary.xx + boundary.yy) / 2;
    row_near("150 grains pressed: Love-Weber stress xx, Pa", boundary.xx, stress.xx, 1e-6);
    row_near("150 grains pressed: Love-Weber stress yy, Pa", boundary.yy, stress.yy, 1e-6);
    row_within("150 grains pressed: Love-Weber stress xy/mean", boundary.xy / mean,
               stress.xy / mean, 1e-6);
    row_within("150 grains pressed: Love-Weber stress yx/mean", boundary.yx / mean,
               stress.yx / mean, 1e-6);
    row_near("150 grains pressed: yy beside the lid's traction, Pa", 1e5, stress.yy, 1e-3);
    row_near("150 grains pressed: xx beside the side's traction, Pa", 1e5, stress.xx, 1e-3);
    close_scene(&p.s);
}

/* --- lattices and random packings ------------------------------------------------------------ */

/* Discs in contact fill a region of whole cells. Triangular: cells of 2 R by 2 sqrt(3) R. */
static void lattice(bool triangular) {
    enum { SIDE = 12 };
    const double radius = 0.5, rise = triangular ? sqrt(3) : 2;
    const dem2d_world_desc desc = world_desc(1e-4);
    const dem2d_material_desc material = stone_desc(0, 0);
    const scene s = open_scene(&desc, &material);
    dem2d_shape *shape = make_disc(radius);
    for (int i = 0; i < SIDE * SIDE; i++) {
        const int row = i / SIDE;
        const double x = 2 * radius * (i % SIDE + (triangular ? 0.5 * (row % 2) : 0));
        add_copy(&s, shape, DEM2D_FIXED, vec(x, radius * rise * row), 0, vec(0, 0), 0);
    }
    dem2d_shape_destroy(shape);
    step(&s, 1);
    dem2d_box region;
    double porosity;
    region.lower = vec(4 * radius, 2 * radius * rise);
    region.upper = vec(12 * radius, 6 * radius * rise);
    must(dem2d_world_porosity(s.world, &region, &porosity), "porosity");
    basis = "formula";
    row_near(triangular ? "triangular lattice: solid fraction pi/(2 sqrt 3)"
                        : "square lattice: solid fraction pi/4",
             (double)PI / (triangular ? 2 * sqrt(3) : 4), 1 - porosity, 1e-12);
    row_near("this program's solid fraction of the same", 1 - porosity, disc_fraction(&s, &region),
             1e-4);
    close_scene(&s);
}

/* Discs pressed together by two walls at a small pressure. Without friction as many forces as
   degrees of freedom are left at jamming: 2 contacts a disc, walls counted, 4 ends; with very much
   friction 3/2 contacts, 3 ends. Discs within three diameters of a wall are not counted in the
   fraction. */
static void random_packing(double friction) {
    static const bool kinds[KINDS] = {true, false, false, false, false};
    enum { DISCS = 600 };
    dem2d_world_desc desc = world_desc(1e-4);
    const dem2d_material_desc material = stone_desc(friction > 0 ? KN : 0, friction);
    desc.local_damping = 0.3;
    packing p = open_packing(&desc, &material, 1.6, 1.6, WALLS);
    smooth_walls(&p);
    random_state = 31;
    fill(&p, DISCS, kinds, NULL, 0.04, 0.06);
    const double pressures[3] = {1e-3 * KN, 1e-4 * KN, 1e-5 * KN};
    for (int i = 0; i < 3; i++) {
        control_wall(&p, TOP, DEM2D_WALL_SERVO, pressures[i], 0.1);
        control_wall(&p, RIGHT, DEM2D_WALL_SERVO, pressures[i], 0.1);
        step(&p.s, i == 0 ? 60000 : 20000);
        settle(&p, 1e-5, 300000);
    }
    const backbone b = find_backbone(&p, friction > 0 ? 2 : 3);
    dem2d_box core = inside(&p);
    core.lower.x += 0.15, core.lower.y += 0.15, core.upper.x -= 0.15, core.upper.y -= 0.15;
    basis = "literature";
    if (friction == 0)
        row_between("random close packing, no friction: solid fraction about .84", 0.83, 0.85,
                    disc_fraction(&p.s, &core));
    const double ends = 2.0 * (b.contacts + b.wall_contacts) / b.particles;
    if (friction == 0)
        row_between("random packing, no friction: contacts a disc, no rattlers: 4", 3.95, 4.1,
                    ends);
    else
        row_between(label("random packing, mu = %g: contacts a disc, no rattlers: 3", friction),
                    2.9, 3.3, ends);
    close_scene(&p.s);
}

/* --- the papers' packing and biaxial test ---------------------------------------------------- */

enum { STRAIN_BLOCKS = 16 }; /* of 1 % */

typedef struct paper_run {
    double share[8]; /* of particles with so many contacts after the packing, walls counted */
    double along;    /* sum of cos 2 (angle of the long axis) */
    double axes;     /* how many have one */
    double speed;    /* mean, m/s, at the end of the packing; its greatest on the way */
    double most_speed;
    double ratio;    /* kinetic over contact energy then */
    double start[2]; /* axial and lateral stress after consolidation, Pa */
    double lateral, lateral_worst;
    double ratio_at[STRAIN_BLOCKS]; /* mean q/p by axial strain */
    double strain;
    dem2d_fabric fabric;        /* at the end */
    double foretold, own_ratio; /* q/p by fabric and by the Love-Weber stress, means from 6 % on */
    double inertial;            /* number, at the end */
} paper_run;

/* Principal directions are the papers' axes: loading along y. Angle to it in degrees. */
static double off_vertical(double direction) {
    const double degrees = fabs(direction) / DEGREE;
    return fabs(90 - fmod(degrees, 180));
}

static void measure_packing(const packing *p, paper_run *r) {
    int count, touching;
    dem2d_particle_id *ids = all_ids(&p->s, &count);
    dem2d_contact_info *list = all_contacts(&p->s, &touching);
    int *degree = get_memory(NULL, (size_t)count, sizeof *degree);
    memset(degree, 0, (size_t)count * sizeof *degree);
    for (int i = 0; i < touching; i++) {
        degree[list[i].a.index]++;
        if (list[i].b.generation != 0) degree[list[i].b.index]++;
    }
    for (int i = 0; i < count; i++) {
        double angle, ratio;
        const dem2d_particle_info info = grain_of(&p->s, ids[i]);
        r->share[degree[ids[i].index] < 7 ? degree[ids[i].index] : 7] += 1.0 / count;
        must(dem2d_shape_axis(dem2d_world_shape(p->s.world, info.shape), &angle, &ratio), "axis");
        if (ratio < 1.05) continue;
        r->along += cos(2 * (angle + dem2d_rot_angle(info.pose.rotation)));
        r->axes++;
    }
    free(ids), free(list), free(degree);
}

static dem2d_equilibrium rest_of(const scene *s) {
    dem2d_equilibrium e;
    must(dem2d_world_equilibrium(s->world, &e), "equilibrium");
    return e;
}

/* Adds a sample of q/p to the two sums. */
static void sample_fabric(const packing *p, paper_run *r) {
    dem2d_stress stress;
    dem2d_principal principal;
    const dem2d_box b = inside(p);
    const double area = (b.upper.x - b.lower.x) * (b.upper.y - b.lower.y);
    must(dem2d_world_fabric(p->s.world, &r->fabric), "fabric");
    must(dem2d_world_stress(p->s.world, area, &stress), "stress");
    must(dem2d_stress_principal(&stress, &principal), "stress");
    r->foretold += r->fabric.stress_ratio;
    r->own_ratio += principal.q / principal.p;
}

/* Top wall down at 0.1 m/s for 2 s, sides held. */
static void compress(packing *p, paper_run *r) {
    double height = 0, sums[STRAIN_BLOCKS] = {0};
    int held = 0, samples = 0, counts[STRAIN_BLOCKS] = {0};
    control_wall(p, TOP, DEM2D_WALL_MOVING, 0, 0.1);
    for (int i = 0; i < 20000; i++) {
        step(&p->s, 1);
        const dem2d_wall_info top = wall_of(&p->s, p->walls[TOP]);
        const dem2d_wall_info bottom = wall_of(&p->s, p->walls[BOTTOM]);
        const dem2d_wall_info left = wall_of(&p->s, p->walls[LEFT]);
        const dem2d_wall_info right = wall_of(&p->s, p->walls[RIGHT]);
        const double axial = (top.stress + bottom.stress) / 2;
        const double lateral = (left.stress + right.stress) / 2;
        if (i == 0) height = left.length;
        r->strain = dem2d_strain(left.length, height);
        const int block = (int)(r->strain * 100);
        if (block >= 0 && block < STRAIN_BLOCKS)
            sums[block] += (axial - lateral) / (axial + lateral), counts[block]++;
        if (r->strain < 1e-3) continue;
        r->lateral += lateral, held++;
        r->lateral_worst = fmax(r->lateral_worst, fabs(lateral / 1e5 - 1));
        if (i % 200 == 199 && r->strain > 0.06) sample_fabric(p, r), samples++;
    }
    r->lateral /= held;
    for (int i = 0; i < STRAIN_BLOCKS; i++)
        r->ratio_at[i] = counts[i] > 0 ? sums[i] / counts[i] : 0;
    r->foretold /= samples, r->own_ratio /= samples;
    const double last = wall_of(&p->s, p->walls[LEFT]).length;
    must(dem2d_world_inertial_number(p->s.world, 0.1 / last, r->lateral, &r->inertial),
         "inertial number");
}

/* 500 grains of 40 to 60 mm at random in 1.0 x 3.0 m fall for 5 s; consolidated at 100 kPa for 1 s
   without gravity, all walls smooth; compressed. kn = kt = 1e7, friction 0.2, local damping 0.7. */
static packing pack_papers(const bool kinds[KINDS], uint64_t seed, paper_run *r) {
    dem2d_world_desc desc = world_desc(1e-4);
    const dem2d_material_desc material = stone_desc(KN, 0.2);
    desc.gravity.y = -9.8, desc.local_damping = 0.7, desc.contact_tolerance = 0;
    packing p = open_packing(&desc, &material, 1, 3, TOP);
    random_state = seed;
    fill(&p, 500, kinds, NULL, 0.04, 0.06);
    for (int i = 0; i < 500; i++) {
        step(&p.s, 100);
        r->speed = rest_of(&p.s).mean_speed;
        r->most_speed = fmax(r->most_speed, r->speed);
    }
    r->ratio = rest_of(&p.s).kinetic_ratio;
    measure_packing(&p, r);
    return p;
}

static paper_run run_papers(const bool kinds[KINDS]) {
    paper_run r;
    memset(&r, 0, sizeof r);
    packing p = pack_papers(kinds, 1, &r);
    set_gravity(&p.s, 0, 0);
    smooth_walls(&p);
    put_lid(&p);
    for (int i = 0; i < WALLS; i++)
        if (i != BOTTOM) control_wall(&p, i, DEM2D_WALL_SERVO, 1e5, 0.1);
    control_wall(&p, BOTTOM, DEM2D_WALL_STILL, 0, 0);
    step(&p.s, 10000);
    r.start[0] = wall_of(&p.s, p.walls[TOP]).stress;
    r.start[1] = (wall_of(&p.s, p.walls[LEFT]).stress + wall_of(&p.s, p.walls[RIGHT]).stress) / 2;
    compress(&p, &r);
    close_scene(&p.s);
    return r;
}

/* Mean of q/p over strains from a to b, in percent. */
static double mean_ratio(const paper_run *r, int a, int b) {
    double sum = 0;
    for (int i = a; i < b; i++) sum += r->ratio_at[i] / (b - a);
    return sum;
}

/* "Small": a hundredth of the greatest mean speed, a hundredth of the contact energy. "Plateau":
   from 6 % on the stress ratio stays within a quarter of its mean over 6 to 15 %, and before 1 % it
   was below. */
static void paper_rows(const char *name, const paper_run *r, bool irregular) {
    basis = "paper";
    const double four = r->share[3] + r->share[4] + (irregular ? r->share[5] : 0);
    row_above(label("%s: share with %s contacts", name, irregular ? "3, 4 or 5" : "3 or 4"), 0.5,
              four);
    double other = 0;
    for (int i = 0; i < 8; i++)
        if (i != 3 && i != 4 && !(irregular && i == 5)) other = fmax(other, r->share[i]);
    row_above(label("%s: the rarest of these over any other number", name), 1,
              fmin(fmin(r->share[3], r->share[4]), irregular ? r->share[5] : 1) / other);
    row_below(label("%s: mean speed after packing over its greatest", name), 1e-2,
              r->speed / r->most_speed);
    row_below(label("%s: kinetic/contact energy after packing", name), 1e-2, r->ratio);
    row_near(label("%s: axial stress consolidated, Pa", name), 1e5, r->start[0], 0.02);
    row_near(label("%s: lateral stress held, mean, Pa", name), 1e5, r->lateral, 0.005);
    row_below(label("%s: lateral stress, worst step, relative", name), 0.05, r->lateral_worst);
    const double plateau = mean_ratio(r, 6, 15);
    double least = plateau, most = plateau;
    for (int i = 6; i < 15; i++)
        least = fmin(least, r->ratio_at[i]), most = fmax(most, r->ratio_at[i]);
    row_below(label("%s: q/p in the first 1 %% of strain over the plateau", name), 1,
              r->ratio_at[0] / plateau);
    row_above(label("%s: plateau from 6 %% on: least over mean q/p", name), 0.75, least / plateau);
    row_below(label("%s: plateau from 6 %% on: greatest over mean q/p", name), 1.25,
              most / plateau);
    row_between(label("%s: axial strain at the end (about 15, 16 %%)", name), 0.14, 0.19,
                r->strain);
    row_above(label("%s: anisotropy of contact normals", name), 0.05,
              r->fabric.normals.coefficient);
    row_below(label("%s: normals' direction off the loading, degrees", name), 15,
              off_vertical(r->fabric.normals.direction));
    row_below(label("%s: normal forces' direction off the loading, degrees", name), 15,
              off_vertical(r->fabric.normal_forces.direction));
    row_below(label("%s: inertial number", name), 1e-3, r->inertial);
    basis = "literature";
    row_near(label("%s: q/p by (a_c + a_b + a_n + a_t)/2", name), r->own_ratio, r->foretold, 0.2);
}

static void papers(void) {
    static const bool irregular[KINDS] = {false, true, true, true, false};
    static const bool discs[KINDS] = {true, false, false, false, false};
    static const bool mixed[KINDS] = {true, true, true, true, true};
    const paper_run a = run_papers(irregular), b = run_papers(discs), c = run_papers(mixed);
    paper_rows("irregular", &a, true);
    /* of N directions at random the mean of cos 2 angle has the deviation sqrt(1/2N) */
    paper_run all = a;
    for (uint64_t seed = 2; seed <= 4; seed++) {
        const packing p = pack_papers(irregular, seed, &all);
        close_scene(&p.s);
    }
    basis = "paper";
    row_above("irregular: long axes horizontal, cos 2 angle, 4 packings, 3 sigma",
              3 * sqrt(0.5 / all.axes), all.along / all.axes);
    paper_rows("discs", &b, false);
    basis = "paper";
    row_above("irregular against discs: q/p of the plateau, ratio", 1,
              mean_ratio(&a, 6, 15) / mean_ratio(&b, 6, 15));
    row_above("irregular against discs: anisotropy of contact normals, ratio", 1,
              a.fabric.normals.coefficient / b.fabric.normals.coefficient);
    row_above("irregular against discs: mean number of contacts, ratio", 1,
              (a.share[1] + 2 * a.share[2] + 3 * a.share[3] + 4 * a.share[4] + 5 * a.share[5] +
               6 * a.share[6]) /
                  (b.share[1] + 2 * b.share[2] + 3 * b.share[3] + 4 * b.share[4] + 5 * b.share[5] +
                   6 * b.share[6]));
    row_near("five models: lateral stress held, mean, Pa", 1e5, c.lateral, 0.005);
    row_below("five models: mean speed after packing over its greatest", 1e-2,
              c.speed / c.most_speed);
    row_below("five models: kinetic/contact energy after packing", 1e-2, c.ratio);
}

static void assemblies(void) {
    table_group("Assemblies");
    balance();
    lattice(true), lattice(false);
    random_packing(0), random_packing(10);
    papers();
}

int main(int argc, char **argv) {
    example_name = "verify";
    if (argc > 2) fail(STATUS_BAD_INPUT, "usage: verify [DATA]");
    elastic_impacts();
    damped_impacts();
    oblique_impacts();
    rolling();
    several_bodies();
    critical_step();
    rocking();
    energy();
    geometry(argc == 2 ? argv[1] : NULL);
    assemblies();
    return table_end();
}
