/* Collisions, rolling, sliding and rocking against closed forms: linear springs, Coulomb friction,
   incremental tangential springs. Each row of a table is one case; tolerances are those stated for
   steps of a hundredth of the contact time, unless a row takes a finer step. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"

#include <float.h>

#define G 9.81
#define KN 1e7

static scene make_scene(double kt, double friction, double time_step) {
    const dem2d_material_desc material = stone_desc(kt, friction);
    dem2d_world_desc desc = {0};
    desc.time_step = time_step;
    desc.contact_tolerance = 1e-13;
    return open_scene(&desc, &material);
}

/* Takes the shape. */
static dem2d_particle_id add_one(const scene *s, dem2d_shape *shape, dem2d_motion motion,
                                 dem2d_vec at, dem2d_vec velocity, double spin) {
    return add_shape(s, shape, motion, at, 0, velocity, spin);
}

/* Mass and inertia of a disc of the material. */
static double disc_mass(double radius) {
    return 2700 * (double)TEST_PI * radius * radius;
}

/* --- head-on impact -------------------------------------------------------------------------- */

enum { DISC_DISC, DISC_FIXED, DISC_WALL, ELLIPSE_WALL, OVAL_OVAL };

typedef struct head_on {
    scene s;
    dem2d_particle_id mover, target; /* target: none for a wall */
    double mass, touch;              /* reduced mass; height of first touch over the target */
} head_on;

static head_on make_head_on(int kind, double steps_per_contact) {
    const double radius = 0.05, a = 0.06, b = 0.04;
    const bool is_disc = kind <= DISC_WALL, wall = kind == DISC_WALL || kind == ELLIPSE_WALL;
    const double half = is_disc ? radius : b;
    const double mass = 2700 * (double)TEST_PI * (is_disc ? radius * radius : a * b);
    head_on h;
    h.mass = kind == DISC_DISC || kind == OVAL_OVAL ? mass / 2 : mass;
    h.touch = wall ? half : 2 * half;
    const double contact_time = (double)TEST_PI * sqrt(h.mass / KN);
    h.s = make_scene(KN, 0.5, contact_time / steps_per_contact);
    h.target = (dem2d_particle_id){0, 0};
    if (wall)
        add_floor(&h.s);
    else
        h.target = add_one(&h.s, is_disc ? make_disc(radius) : make_ellipse(a, b),
                           kind == DISC_FIXED ? DEM2D_FIXED : DEM2D_FREE, vec(0, 0), vec(0, 0), 0);
    h.mover = add_one(&h.s, is_disc ? make_disc(radius) : make_ellipse(a, b), DEM2D_FREE,
                      vec(0, h.touch + 1.003e-4), vec(0, -1), 0);
    return h;
}

/* Gap between the two, from positions alone. */
static double gap_of(const head_on *h) {
    const double y = grain_of(&h->s, h->mover).pose.position.y;
    return y - h->touch - (h->target.generation ? grain_of(&h->s, h->target).pose.position.y : 0);
}

/* Between contacts the motion is uniform, so that crossings are found by a straight line. */
static double measure_impact(const head_on *h, double dt, double *depth, double *force) {
    double before = gap_of(h), start = 0;
    *depth = *force = 0;
    for (int i = 0; i < 100000; i++) {
        dem2d_contact_info c;
        step(&h->s, 1);
        const double now = gap_of(h);
        if (contacts_of(&h->s, &c, 1)) {
            *depth = fmax(*depth, c.depth);
            *force = fmax(*force, c.normal_force);
        }
        if (before > 0 && now <= 0) start = i + before / (before - now);
        if (before <= 0 && now > 0) return (i + before / (before - now) - start) * dt;
        before = now;
    }
    fail_msg("no impact");
    return 0;
}

static void test_elastic_impact(void **state) {
    (void)state;
    for (int kind = DISC_DISC; kind <= OVAL_OVAL; kind++) {
        head_on h = make_head_on(kind, 100);
        double depth, force;
        const double w = sqrt(KN / h.mass), contact_time = (double)TEST_PI / w;
        const double time = measure_impact(&h, contact_time / 100, &depth, &force);
        assert_near(depth, 1 / w, 1e-3);
        assert_near(force, sqrt(h.mass * KN), 1e-3);
        assert_near(time, contact_time, 1e-3);
        const double target = h.target.generation ? grain_of(&h.s, h.target).velocity.y : 0;
        assert_near(grain_of(&h.s, h.mover).velocity.y - target, 1, 1e-3);
        dem2d_world_destroy(h.s.world);
    }
}

/* The contact is shorter than pi / w by the factor (w dt)^2 / 24. Linear interpolation is off by
   less than (w dt)^3 / 60 at each end, 0.6 % of it at t_c / 200. */
static void test_contact_time_error(void **state) {
    (void)state;
    head_on h = make_head_on(DISC_WALL, 200);
    double depth, force;
    const double contact_time = (double)TEST_PI * sqrt(h.mass / KN);
    const double time = measure_impact(&h, contact_time / 200, &depth, &force);
    const double expected = (double)TEST_PI * (double)TEST_PI / (200.0 * 200 * 24);
    assert_near(1 - time / contact_time, expected, 1e-2);
    dem2d_world_destroy(h.s.world);
}

/* --- oblique impact on a wall ---------------------------------------------------------------- */

static dem2d_particle_info bounce(double kt, double mu, double vt, double vn, double steps,
                                  double radius) {
    const double contact_time = (double)TEST_PI * sqrt(disc_mass(radius) / KN);
    const scene s = make_scene(kt, mu, contact_time / steps);
    add_floor(&s);
    const dem2d_particle_id id =
        add_one(&s, make_disc(radius), DEM2D_FREE, vec(0, radius + 1e-6), vec(vt, -vn), 0);
    dem2d_particle_info info = grain_of(&s, id);
    for (int i = 0; i < 1000000 && info.velocity.y <= 0; i++) step(&s, 1), info = grain_of(&s, id);
    step(&s, (int)(2 * steps)); /* until it has left */
    dem2d_contact_info c;
    assert_int_equal(contacts_of(&s, &c, 1), 0);
    info = grain_of(&s, id);
    dem2d_world_destroy(s.world);
    return info;
}

/* Gross slip: v_t' = v_t - 2 mu v_n, w R = 4 mu v_n (backwards as seen from the disc's top). */
static void test_gross_slip(void **state) {
    (void)state;
    static const struct {
        double mu, vt, vn;
    } rows[] = {
        {0.1, 0.1, 0.1}, {0.1, 0.3, 0.1}, {0.3, 0.4, 0.1}, {0.05, -0.2, 0.1}, {0, 0.2, 0.1}};
    for (int i = 0; i < COUNT_OF(rows); i++) {
        const double mu = rows[i].mu, vt = rows[i].vt, vn = rows[i].vn, way = vt > 0 ? 1 : -1;
        const dem2d_particle_info info = bounce(KN, mu, vt, vn, 100, 0.05);
        assert_near(info.velocity.x, vt - way * 2 * mu * vn, 1e-2);
        assert_near(info.angular_velocity * 0.05, -way * 4 * mu * vn, 1e-2);
        assert_near(info.velocity.y, vn, 1e-3);
    }
}

/* Full stick: the slip at the end is cos(pi sqrt(3 kt / kn)) of that at the start. */
static void test_stick_impact(void **state) {
    (void)state;
    static const double ratios[] = {1.0 / 3, 0.5, 1};
    static const double steps[][2] = {{100, 0.03}, {1000, 0.003}};
    for (int i = 0; i < COUNT_OF(ratios) * 2; i++) {
        const double ratio = ratios[i / 2], radius = 0.05, vt = 0.02;
        const dem2d_particle_info info = bounce(ratio * KN, 1e9, vt, 0.02, steps[i % 2][0], radius);
        const double slip = info.velocity.x + info.angular_velocity * radius;
        assert_within(slip / vt, cosl(TEST_PI * sqrtl(3 * ratio)), steps[i % 2][1]);
        /* the impulse acts at the wall: m v_t R - I w is kept, R short by half an overlap */
        assert_near(info.velocity.x - info.angular_velocity * radius / 2, vt, 3e-3);
    }
}

/* --- rolling and sliding --------------------------------------------------------------------- */

/* A disc thrown along the floor without spin: the slip ends at v0 / (3 mu g) with v = 2 v0 / 3. */
static void test_slide_to_roll(void **state) {
    (void)state;
    static const double mus[] = {0.1, 0.3, 0.8};
    const double radius = 0.05, v0 = 1, dt = 2e-5;
    for (int i = 0; i < COUNT_OF(mus); i++) {
        const scene s = make_scene(KN, mus[i], dt);
        const double rest = disc_mass(radius) * G / KN;
        assert_ok(dem2d_world_set_gravity(s.world, vec(0, -G)));
        add_floor(&s);
        const dem2d_particle_id id =
            add_one(&s, make_disc(radius), DEM2D_FREE, vec(0, radius - rest), vec(v0, 0), 0);
        double slip = v0, last = v0, v = v0, v_last = v0;
        int n = 0;
        for (; n < 1000000 && slip > 0; n++) {
            step(&s, 1);
            const dem2d_particle_info info = grain_of(&s, id);
            last = slip, v_last = v;
            v = info.velocity.x, slip = v + info.angular_velocity * (radius - rest / 2);
        }
        const double part = last / (last - slip);
        assert_near((n - 1 + part) * dt, v0 / (3 * mus[i] * G), 1e-2);
        assert_near(v_last + part * (v - v_last), 2 * v0 / 3, 1e-3);
        dem2d_world_destroy(s.world);
    }
}

/* A disc released on a slope of angle b (gravity is tilted), after one second. */
static void test_disc_on_incline(void **state) {
    (void)state;
    static const struct {
        double degrees, mu;
    } rows[] = {{10, 0.5}, {30, 0.25}, {30, 0.15}, {45, 0.1}, {20, 0}};
    const double radius = 0.05, dt = 5e-5;
    for (int i = 0; i < COUNT_OF(rows); i++) {
        const double b = rows[i].degrees * (double)TEST_PI / 180, mu = rows[i].mu;
        const scene s = make_scene(KN, mu, dt);
        assert_ok(dem2d_world_set_gravity(s.world, vec(G * sin(b), -G * cos(b))));
        add_floor(&s);
        const double rest = disc_mass(radius) * G * cos(b) / KN;
        const dem2d_particle_id id =
            add_one(&s, make_disc(radius), DEM2D_FREE, vec(0, radius - rest), vec(0, 0), 0);
        step(&s, 20000);
        const dem2d_particle_info info = grain_of(&s, id);
        const bool rolls = mu >= tan(b) / 3;
        const double a = rolls ? 2 * G * sin(b) / 3 : G * (sin(b) - mu * cos(b));
        const double spin = rolls ? -a / radius : -2 * mu * G * cos(b) / radius;
        assert_near(info.velocity.x, a, 2e-3);
        assert_near(info.angular_velocity, spin, 2e-3);
        dem2d_world_destroy(s.world);
    }
}

/* A flat box on a slope half a degree on either side of the angle of friction. With one contact
   point it rests on its two corners in turn, so a little local damping is needed; that damping
   slows the slide to 0.7 of its acceleration. */
static void test_block_on_incline(void **state) {
    (void)state;
    static const double mus[] = {0.2, 0.5};
    const double width = 0.2, height = 0.05, dt = 4e-5, time = 0.5;
    for (int i = 0; i < 2 * COUNT_OF(mus); i++) {
        const double mu = mus[i / 2], off = i % 2 ? 0.5 : -0.5;
        const double b = atan(mu) + off * (double)TEST_PI / 180;
        const scene s = make_scene(KN, mu, dt);
        assert_ok(dem2d_world_set_gravity(s.world, vec(G * sin(b), -G * cos(b))));
        assert_ok(dem2d_world_set_damping(s.world, 0.3, 0));
        add_floor(&s);
        const double rest = 2700 * width * height * G * cos(b) / KN;
        const dem2d_particle_id id = add_one(&s, make_box(width, height), DEM2D_FREE,
                                             vec(0, height / 2 - rest), vec(0, 0), 0);
        step(&s, (int)(time / dt));
        const double x = grain_of(&s, id).pose.position.x;
        const double slide = 0.5 * G * (sin(b) - mu * cos(b)) * time * time;
        if (off < 0)
            assert_between(x, -1e-4, 1e-3);
        else
            assert_between(x, 0.5 * slide, slide);
        dem2d_world_destroy(s.world);
    }
}

/* --- several bodies -------------------------------------------------------------------------- */

/* Opposite spins: the surfaces meet without slip, so friction has nothing to do. */
static void test_opposite_spin(void **state) {
    (void)state;
    const double radius = 0.05, spin = 10;
    const double dt = (double)TEST_PI * sqrt(disc_mass(radius) / 2 / KN) / 100;
    const scene s = make_scene(KN, 0.5, dt);
    const dem2d_particle_id a =
        add_one(&s, make_disc(radius), DEM2D_FREE, vec(0, 0), vec(1, 0), spin);
    const dem2d_particle_id b =
        add_one(&s, make_disc(radius), DEM2D_FREE, vec(0.1001, 0), vec(-1, 0), -spin);
    step(&s, 400);
    const dem2d_particle_info ia = grain_of(&s, a), ib = grain_of(&s, b);
    assert_near(ia.velocity.x, -1, 1e-3); /* they did meet */
    assert_near(ia.angular_velocity, spin, 1e-12);
    assert_near(ib.angular_velocity, -spin, 1e-12);
    assert_within(ia.velocity.y, 0, 1e-12);
    assert_within(ib.velocity.y, 0, 1e-12);
    dem2d_world_destroy(s.world);
}

static void test_cradle(void **state) {
    (void)state;
    static const double expected[2][5] = {{-0.1303, 0.1502, 0.9800},
                                          {-0.1323, -0.0753, -0.0310, 0.2962, 0.9424}};
    for (int row = 0; row < 2; row++) {
        const int n = row ? 5 : 3;
        const double radius = 0.5, v0 = 1e-2; /* centres at 0, 1, 2 ...: touching exactly */
        const double contact_time = (double)TEST_PI * sqrt(disc_mass(radius) / 2 / KN);
        const scene s = make_scene(0, 0, contact_time / 1000);
        dem2d_particle_id ids[5];
        for (int i = 0; i < n; i++)
            ids[i] = add_one(&s, make_disc(radius), DEM2D_FREE, vec(i, 0), vec(i ? 0 : v0, 0), 0);
        step(&s, 1000 * 3 * n);
        for (int i = 0; i < n; i++)
            assert_within(grain_of(&s, ids[i]).velocity.x / v0, expected[row][i], 1e-3);
        dem2d_contact_info c;
        assert_int_equal(contacts_of(&s, &c, 1), 0);
        dem2d_world_destroy(s.world);
    }
}

static dem2d_shape *random_shape(uint64_t *random) {
    const double a[4] = {0.1, 0, 0.004, 0.001}, b[4] = {0, 0, -0.003, 0.001};
    const dem2d_vec corners[5] = {{0, 0}, {0.06, -0.01}, {0.09, 0.03}, {0.05, 0.07}, {-0.01, 0.04}};
    dem2d_shape *shape;
    double length;
    switch (random_below(random, 4)) {
    case 0:
        return make_disc(random_between(random, 0.03, 0.06));
    case 1:
        length = random_between(random, 0.03, 0.06);
        return make_ellipse(length, random_between(random, 0.02, 0.06));
    case 2:
        assert_ok(dem2d_shape_create_fourier(NULL, a, b, 3, &shape));
        return shape;
    default:
        assert_ok(
            dem2d_shape_create_polygon(NULL, corners, 5, random_below(random, 2) * 0.005, &shape));
        return shape;
    }
}

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

/* Whatever two shapes do to each other, momentum and angular momentum stay. The velocity is half a
   step before the position: x cross v is that of free flight, before and after. */
static void test_conservation(void **state) {
    (void)state;
    uint64_t random = 77;
    int met = 0;
    for (int i = 0; i < 200; i++) {
        const scene s = make_scene(KN, 0.5, 2e-5);
        dem2d_particle_id ids[2];
        for (int k = 0; k < 2; k++) {
            const dem2d_vec at = vec(0.16 * k, random_between(&random, -0.03, 0.03));
            const dem2d_vec v = vec(k ? -1 : 1, random_between(&random, -0.5, 0.5));
            dem2d_shape *shape = random_shape(&random);
            ids[k] = add_one(&s, shape, DEM2D_FREE, at, v, random_between(&random, -20, 20));
            assert_ok(
                dem2d_world_move_particle(s.world, ids[k], at, random_between(&random, -3, 3)));
        }
        long double before[3] = {0}, after[3] = {0}, size[3] = {0};
        for (int k = 0; k < 2; k++) add_momentum(&s, ids[k], before, size);
        const double spin = grain_of(&s, ids[0]).angular_velocity;
        step(&s, 6000);
        for (int k = 0; k < 2; k++) add_momentum(&s, ids[k], after, size);
        met += grain_of(&s, ids[0]).angular_velocity != spin;
        for (int k = 0; k < 2; k++) assert_within(after[k], before[k], 1e-14 * size[k] * 10);
        assert_within(after[2], before[2], 1e-13 * size[2] * 10);
        dem2d_world_destroy(s.world);
    }
    assert_true(met > 150); /* most did collide */
}

/* --- rocking --------------------------------------------------------------------------------- */

enum { ROCK_ELLIPSE, ROCK_FOURIER, ROCK_BEZIER, ROCK_CUSTOM, ROCK_FIT_FOURIER, ROCK_FIT_BEZIER };

/* Ellipse of 25 and 10 mm, grown by 5 mm. */
static dem2d_vec grown_ellipse(void *user, dem2d_vec u, double *rho) {
    (void)user;
    const double a = 0.025, b = 0.01, h = sqrt(a * a * u.x * u.x + b * b * u.y * u.y);
    if (rho) *rho = a * a * b * b / (h * h * h) + 0.005;
    return vec((a * a / h + 0.005) * u.x, (b * b / h + 0.005) * u.y);
}

/* Shapes that lie flat at angle 0, symmetric left and right. */
static dem2d_shape *rocker(int kind) {
    const double a[5] = {0.044, 0, 0.004, 0, 0.0002}, b[5] = {0};
    const dem2d_vec arcs[12] = {{0.03, 0},       {0.03, 0.01},  {0.02, 0.015},  {0, 0.015},
                                {-0.02, 0.015},  {-0.03, 0.01}, {-0.03, 0},     {-0.03, -0.01},
                                {-0.02, -0.015}, {0, -0.015},   {0.02, -0.015}, {0.03, -0.01}};
    dem2d_vec outline[2000], control[30];
    double fit_a[13], fit_b[13];
    dem2d_custom_desc custom = {0};
    dem2d_shape *shape;
    custom.support = grown_ellipse, custom.outline_points = 4000;
    for (int i = 0; i < COUNT_OF(outline); i++) {
        const double t = (double)(2 * TEST_PI) * i / COUNT_OF(outline);
        outline[i] = vec(0.03 * cos(t), 0.015 * sin(t));
    }
    switch (kind) {
    case ROCK_ELLIPSE:
        return make_ellipse(0.03, 0.015);
    case ROCK_FOURIER:
        assert_ok(dem2d_shape_create_fourier(NULL, a, b, 4, &shape));
        break;
    case ROCK_BEZIER:
        assert_ok(dem2d_shape_create_bezier(NULL, arcs, 4, &shape));
        break;
    case ROCK_CUSTOM:
        assert_ok(dem2d_shape_create_custom(NULL, &custom, &shape));
        break;
    case ROCK_FIT_FOURIER:
        assert_ok(dem2d_fourier_fit(NULL, outline, COUNT_OF(outline), 12, 0, fit_a, fit_b));
        assert_ok(dem2d_shape_create_fourier(NULL, fit_a, fit_b, 12, &shape));
        break;
    default:
        assert_ok(dem2d_bezier_fit(NULL, outline, COUNT_OF(outline), 10, control));
        assert_ok(dem2d_shape_create_bezier(NULL, control, 10, &shape));
    }
    return shape;
}

/* Small rocking about angle 0 for some periods; the period from zero crossings by straight lines.
 */
static double rocking_period(int kind, double kt, double mu, double *expected) {
    const double dt = 1e-5, start = 1e-3; /* the polybezier has a kink of rho at angle 0 */
    const scene s = make_scene(kt, mu, dt);
    dem2d_shape *shape = rocker(kind);
    dem2d_support low;
    dem2d_pose tilted = dem2d_pose_make(0, 0, start, 1);
    assert_ok(dem2d_shape_support(shape, still(), vec(0, -1), &low));
    const double h = low.value, rho = low.rho;
    assert_ok(dem2d_shape_support(shape, tilted, vec(0, -1), &low));
    assert_ok(dem2d_world_set_gravity(s.world, vec(0, -G)));
    add_floor(&s);
    const dem2d_particle_id id = add_one(&s, shape, DEM2D_FREE, vec(0, low.value), vec(0, 0), 0);
    const dem2d_particle_info info = grain_of(&s, id);
    const double about = info.inertia / info.mass + (mu > 0 ? h * h : 0);
    *expected = (double)(2 * TEST_PI) / sqrt(G * (rho - h) / about);
    const double rest = info.mass * G / KN;
    assert_ok(dem2d_world_move_particle(s.world, id, vec(0, low.value - rest), start));
    double last = start, first = 0, latest = 0;
    int crossings = 0;
    for (int i = 1; i <= 1000000 && crossings < 5; i++) {
        step(&s, 1);
        const double angle = dem2d_rot_angle(grain_of(&s, id).pose.rotation);
        if (last > 0 && angle <= 0) {
            latest = i - angle / (angle - last);
            if (crossings++ == 0) first = latest;
        }
        last = angle;
    }
    dem2d_world_destroy(s.world);
    assert_int_equal(crossings, 5);
    return (latest - first) * dt / 4;
}

static void test_rocking(void **state) {
    (void)state;
    for (int kind = ROCK_ELLIPSE; kind <= ROCK_CUSTOM; kind++) {
        double expected, period = rocking_period(kind, KN, 1000, &expected);
        assert_near(period, expected, 5e-3);
        period = rocking_period(kind, 0, 0, &expected);
        assert_near(period, expected, 5e-3);
    }
}

/* Half axes 30 and 15 mm: w^2 = 4 g (a^2 - b^2) / (b (a^2 + 5 b^2)), T = 0.21278 s; its fits too.
 */
static void test_rocking_ellipse(void **state) {
    (void)state;
    static const int kinds[] = {ROCK_ELLIPSE, ROCK_FIT_FOURIER, ROCK_FIT_BEZIER};
    const double a = 0.03, b = 0.015;
    const double w = sqrt(4 * G * (a * a - b * b) / (b * (a * a + 5 * b * b)));
    assert_near(2 * TEST_PI / w, 0.21278, 1e-4);
    for (int i = 0; i < COUNT_OF(kinds); i++) {
        double own;
        assert_near(rocking_period(kinds[i], KN, 1000, &own), 2 * TEST_PI / w, 5e-3);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_elastic_impact),   cmocka_unit_test(test_contact_time_error),
        cmocka_unit_test(test_gross_slip),       cmocka_unit_test(test_stick_impact),
        cmocka_unit_test(test_slide_to_roll),    cmocka_unit_test(test_disc_on_incline),
        cmocka_unit_test(test_block_on_incline), cmocka_unit_test(test_opposite_spin),
        cmocka_unit_test(test_cradle),           cmocka_unit_test(test_conservation),
        cmocka_unit_test(test_rocking),          cmocka_unit_test(test_rocking_ellipse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
