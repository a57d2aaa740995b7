/* Dashpots beside the tangential and the rolling spring: impacts against an independent integration
   of spring, dashpot and slider, energies, the ledger, the bounds of the time step, extreme ratios.
 */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"

#define KN 1e7
#define RADIUS 0.05

typedef struct impact {
    const char *name;
    double zeta, zeta_t, zeta_r, friction, rolling; /* kt is 0.8 kn */
    double vx, spin;                                /* at 1 m/s downwards */
} impact;

static const double mass = 2700 * (double)TEST_PI * RADIUS * RADIUS;

static dem2d_material_desc material_of(const impact *c) {
    dem2d_material_desc material = stone_desc(0.8 * KN, c->friction);
    material.rolling_friction = c->rolling, material.damping_ratio = c->zeta;
    material.tangential_damping_ratio = c->zeta_t, material.rolling_damping_ratio = c->zeta_r;
    return material;
}

static double contact_time(void) {
    return (double)TEST_PI * sqrt(mass / KN);
}

static scene impact_scene(const impact *c, double time_step, double spare, dem2d_particle_id *id) {
    dem2d_world_desc desc = {0};
    const dem2d_material_desc material = material_of(c);
    desc.time_step = time_step, desc.ledger = true, desc.skip_time_step_check = true;
    scene s = open_scene(&desc, &material);
    add_plane(&s, 0, 0, 0, 1);
    *id = add_shape(&s, make_disc(RADIUS), DEM2D_FREE, vec(0, RADIUS + spare), 0, vec(c->vx, -1),
                    c->spin);
    return s;
}

/* --- the integration: the disc alone, in steps that are short against the world's ------------- */

typedef struct motion {
    double y, vx, vy, w;
    double q, theta; /* stretch of the tangential spring and of that against rolling */
} motion;

/* Rate of a spring with a dashpot in series with a slider, which moves at `rate` as a whole, and
   their force. Without a dashpot the spring yields at once. */
static double yield(double k, double c, double rate, double limit, double *stretch, double *force) {
    *force = -(k * *stretch + c * rate);
    if (fabs(*force) <= limit) return rate;
    *force = *force > 0 ? limit : -limit;
    if (c > 0) return -(*force + k * *stretch) / c;
    *stretch = -*force / k;
    return 0;
}

static motion rates(const impact *c, motion *m) {
    const double kt = 0.8 * KN, inertia = mass * RADIUS * RADIUS / 2;
    const double arm = m->y; /* of the foot point: the radius less the depth */
    const double kr = kt * RADIUS * RADIUS, mt = 1 / (1 / mass + arm * arm / inertia);
    const double spring = KN * (RADIUS - m->y) - 2 * c->zeta * sqrt(mass * KN) * m->vy;
    const double normal = m->y < RADIUS ? fmax(0, spring) : 0;
    double force, moment;
    motion rate = {m->vy, 0, normal / mass, 0, 0, 0};
    rate.q = yield(kt, 2 * c->zeta_t * sqrt(mt * kt), m->vx + m->w * arm, c->friction * normal,
                   &m->q, &force);
    rate.theta = yield(kr, 2 * c->zeta_r * sqrt(inertia * kr), m->w, c->rolling * RADIUS * normal,
                       &m->theta, &moment);
    rate.vx = force / mass, rate.w = (force * arm + moment) / inertia;
    return rate;
}

static motion along(const motion *m, const motion *rate, double h) {
    const motion next = {m->y + h * rate->y, m->vx + h * rate->vx, m->vy + h * rate->vy,
                         m->w + h * rate->w, m->q + h * rate->q,   m->theta + h * rate->theta};
    return next;
}

/* The midpoint rule, from touch to parting. */
static motion integrate(const impact *c) {
    motion m = {RADIUS, c->vx, -1, c->spin, 0, 0};
    const double h = contact_time() / 200000;
    for (int i = 0; m.y <= RADIUS && i < 1000000; i++) {
        const motion rate = rates(c, &m);
        motion middle = along(&m, &rate, h / 2);
        const motion there = rates(c, &middle);
        m = along(&m, &there, h);
    }
    return m;
}

/* Greatest error of the velocities after an impact, m/s, with so many steps in a contact time. The
   moment at which the two touch is anywhere in a step. */
static double impact_error(const impact *c, const motion *m, int steps) {
    double error = 0;
    for (int k = 0; k < 5; k++) {
        const double step = contact_time() / steps;
        dem2d_particle_id id;
        scene s = impact_scene(c, step, (3 + k / 5.0) * step, &id);
        assert_ok(dem2d_world_step(s.world, 3 * steps, NULL));
        const dem2d_particle_info p = grain_of(&s, id);
        const double one = fmax(fabs(p.velocity.y - m->vy), fabs(p.velocity.x - m->vx));
        error = fmax(error, fmax(one, fabs(p.angular_velocity - m->w) * RADIUS));
        close_scene(&s);
    }
    return error;
}

/* Oblique impacts of a disc on a plane. The first step of a contact counts as a whole, and dashpots
   lag by half a step: errors of first order. */
static void test_impacts(void **state) {
    (void)state;
    static const impact cases[] = {
        {"springs", 0, 0, 0, 0.5, 0, 0.5, 0},
        {"normal", 0.1, 0, 0, 0.5, 0, 0.5, 0},
        {"sticks", 0, 0.1, 0, 5, 0, 0.3, 4},
        {"critical", 0, 1, 0, 5, 0, 0.3, 4},
        {"slides", 0, 0.1, 0, 0.1, 0, 3, 0},
        {"slides, sticks", 0, 0.1, 0, 0.3, 0, 0.8, -3},
        {"strong, slides", 0, 2, 0, 0.3, 0, 0.8, 0},
        {"rolls", 0, 0, 0.1, 0.5, 2, 0.5, 10},
        {"rolls, slides", 0, 0.05, 0.05, 0.5, 0.1, 0.5, 30},
        {"all", 0.1, 0.1, 0.1, 0.4, 0.3, 0.7, 10},
    };
    for (int i = 0; i < COUNT_OF(cases); i++) {
        const impact *c = &cases[i];
        const motion m = integrate(c);
        const double error = impact_error(c, &m, 500), fine = impact_error(c, &m, 5000);
        print_message("%-15s t_c/500: %.2g, t_c/5000: %.2g\n", c->name, error, fine);
        assert_true(error < 2e-3);
        assert_true(fine < error / 7 || fine < 1e-6);
    }
}

/* --- energies ----------------------------------------------------------------------------------
 */

static double stored_energy(const dem2d_ledger *l) {
    return l->kinetic + l->normal + l->tangential;
}

/* A disc, or a box that comes down on a corner and then on its face, hits a plane obliquely:
   greatest error of the ledger, of its energy at first. What is stored never grows, and what is
   dissipated never shrinks, but for the error of the step. */
static double closure(const impact *c, bool box, int steps) {
    dem2d_particle_id id;
    scene s = impact_scene(c, contact_time() / steps, 1e-4, &id);
    if (box)
        add_shape(&s, make_box(0.1, 0.06), DEM2D_FREE, vec(1, 0.07), 0.3, vec(c->vx, -1), c->spin);
    double worst = 0, first = 0;
    dem2d_ledger last = {0};
    for (int i = 0; i < 8 * steps; i++) {
        assert_ok(dem2d_world_step(s.world, 1, NULL));
        const dem2d_ledger l = ledger_of(&s);
        if (i == 0) first = l.kinetic;
        worst = fmax(worst, fabs(l.closure) / first);
        const double spare = 20 * first / steps / steps;
        if (i > 0) assert_true(stored_energy(&l) < stored_energy(&last) + spare);
        if (i > 0) assert_true(l.friction + l.dashpot > last.friction + last.dashpot - spare);
        if (i > 0) assert_true(l.dashpot > last.dashpot - spare);
        last = l;
    }
    assert_true((last.dashpot > 1e-4 * first) == (c->zeta > 0 || c->zeta_t > 0 || c->zeta_r > 0));
    close_scene(&s);
    return worst;
}

static void test_energies(void **state) {
    (void)state;
    static const impact cases[] = {
        {"none", 0, 0, 0, 0.5, 0.1, 0.5, 10},       {"normal", 0.3, 0, 0, 0.5, 0.1, 0.5, 10},
        {"tangential", 0, 0.3, 0, 0.5, 0, 0.5, 10}, {"rolling", 0, 0, 0.3, 0.5, 0.3, 0.5, 20},
        {"all", 0.2, 0.3, 0.4, 0.5, 0.3, 0.7, 20},
    };
    for (int i = 0; i < COUNT_OF(cases); i++)
        for (int box = 0; box < 2; box++) {
            const double coarse = closure(&cases[i], box, 100), fine = closure(&cases[i], box, 800);
            print_message("%-10s %d: t_c/100 %.2g, t_c/800 %.2g\n", cases[i].name, box, coarse,
                          fine);
            assert_true(fine < 1e-3 && fine < coarse / 16);
        }
}

/* --- the stable time step -----------------------------------------------------------------------
 */

/* A disc on a plane: l dt (dt + 2 lag) = 4 for l = kt/m_t, or kn/m, and the lag of that dashpot. */
static void test_bounds(void **state) {
    (void)state;
    const double kt = 0.8 * KN, inertia = mass * RADIUS * RADIUS / 2;
    static const double ratios[] = {0, 0.1, 1, 10, 1000};
    for (int i = 0; i < COUNT_OF(ratios); i++)
        for (int k = 0; k < 3; k++) {
            const double z = ratios[i], depth = 1e-5, arm = RADIUS - depth;
            const impact c = {"", k == 0 ? z : 0, k == 1 ? z : 0, k == 2 ? z : 0, 1e3, 1e3, 0, 0};
            dem2d_particle_id id;
            scene s = impact_scene(&c, 1e-9, -depth, &id);
            assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_FREE, vec(0, 0), 0));
            assert_ok(dem2d_world_step(s.world, 1, NULL));
            double safe, limit, expected = HUGE_VAL;
            assert_ok(dem2d_world_time_step_bounds(s.world, &safe, &limit, NULL));
            /* normal; sliding and rolling, which are coupled: only bounded by their sum */
            const double mt = 1 / (1 / mass + arm * arm / inertia), kr = kt * RADIUS * RADIUS;
            const double stiff[3] = {KN / mass, kt / mt, kr / inertia};
            for (int j = 0; j < 3; j++) {
                const double lag = j == k ? 2 * z / sqrt(stiff[j]) : 0;
                expected = fmin(expected, 4 / stiff[j] / (lag + sqrt(lag * lag + 4 / stiff[j])));
            }
            if (k == 0 && z >= 1)
                assert_near(safe, expected, 1e-9); /* normal, alone */
            else
                assert_true(safe <= expected * (1 + 1e-9) && safe > expected / 2);
            close_scene(&s);
        }
}

/* Dashpots that a pair of materials gets late, while no others have them: the bound before the next
   step is that after it. */
static void test_bounds_at_once(void **state) {
    static const impact none = {"", 0, 0, 0, 0.5, 0.5, 0, 0};
    (void)state;
    for (int k = 0; k < 3; k++) {
        dem2d_particle_id id;
        scene s = impact_scene(&none, 1e-9, -1e-5, &id);
        dem2d_pair_desc pair;
        double before, at_once, later, limit;
        assert_ok(dem2d_world_step(s.world, 1, NULL));
        assert_ok(dem2d_world_time_step_bounds(s.world, &before, &limit, NULL));
        assert_ok(dem2d_world_get_pair(s.world, s.material, s.material, &pair));
        *(k == 0   ? &pair.damping_ratio
          : k == 1 ? &pair.tangential_damping_ratio
                   : &pair.rolling_damping_ratio) = 3;
        assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &pair));
        assert_ok(dem2d_world_time_step_bounds(s.world, &at_once, &limit, NULL));
        assert_ok(dem2d_world_step(s.world, 1, NULL));
        assert_ok(dem2d_world_time_step_bounds(s.world, &later, &limit, NULL));
        assert_true(at_once < 0.9 * before);
        assert_near(at_once, later, 1e-6);
        close_scene(&s);
    }
}

/* A strong dashpot at the safe step: the vibration dies down. */
static void test_safe_step(void **state) {
    (void)state;
    static const double ratios[] = {0.1, 2, 1000};
    for (int i = 0; i < COUNT_OF(ratios); i++)
        for (int k = 0; k < 3; k++) {
            const double z = ratios[i];
            const impact c = {
                "", k == 0 ? z : 0.1, k == 1 ? z : 0.1, k == 2 ? z : 0.1, 0.5, 0.2, 0.01, 1};
            dem2d_particle_id id;
            scene s = impact_scene(&c, 1e-9, -1e-5, &id);
            double safe, limit;
            assert_ok(dem2d_world_step(s.world, 1, NULL));
            assert_ok(dem2d_world_time_step_bounds(s.world, &safe, &limit, NULL));
            assert_ok(dem2d_world_set_time_step(s.world, 0.9 * safe));
            assert_ok(dem2d_world_set_gravity(s.world, vec(0, -9.81)));
            assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_FREE, vec(0.01, 0), 1));
            double energy = 0;
            for (int n = 0; n < 40; n++) {
                dem2d_energy e;
                assert_ok(dem2d_world_step(s.world, 500, NULL));
                assert_ok(dem2d_world_energy(s.world, &e));
                const double now = e.translational + e.rotational;
                if (n == 0) energy = now;
                assert_true(now <= energy * 1.5 + 1e-9);
            }
            close_scene(&s);
        }
}

/* Without a tangential spring, or without friction, there is nothing for the dashpots to damp. */
static void test_nothing_to_damp(void **state) {
    (void)state;
    for (int i = 0; i < 2; i++) {
        dem2d_vec at[2];
        for (int k = 0; k < 2; k++) {
            dem2d_world_desc desc = {0};
            dem2d_material_desc material = stone_desc(i == 0 ? 0 : KN, i == 0 ? 0.5 : 0);
            if (k == 1) material.tangential_damping_ratio = material.rolling_damping_ratio = 3;
            desc.time_step = 1e-5;
            scene s = open_scene(&desc, &material);
            add_plane(&s, 0, 0, 0, 1);
            const dem2d_particle_id id =
                add_shape(&s, make_disc(RADIUS), DEM2D_FREE, vec(0, RADIUS), 0, vec(0.3, -1), 20);
            assert_ok(dem2d_world_step(s.world, 1000, NULL));
            at[k] = grain_of(&s, id).pose.position;
            close_scene(&s);
        }
        assert_true(at[0].x == at[1].x && at[0].y == at[1].y);
    }
}

/* --- snapshots ----------------------------------------------------------------------------------
 */

static void builtin(void *user, dem2d_law_batch *batch) {
    (void)user;
    dem2d_law_builtin(batch);
    for (int k = 0; k < batch->count; k++) batch->state[k][batch->point[k]] += 1;
}

/* A box on its face and a disc, saved in the middle of their impacts, go on to the same hash: with
   each dashpot alone, with all, and with a caller's law. */
static void test_snapshots(void **state) {
    (void)state;
    for (int i = 0; i < 6; i++) {
        const impact c = {"",
                          i == 0 || i > 2 ? 0.1 : 0,
                          i == 1 || i > 2 ? 0.2 : 0,
                          i == 2 || i > 2 ? 0.3 : 0,
                          0.5,
                          0.2,
                          0.7,
                          5};
        dem2d_world_desc desc = {0};
        const dem2d_material_desc material = material_of(&c);
        desc.time_step = contact_time() / 100, desc.ledger = i == 4, desc.skin = 0.2;
        if (i == 5) desc.law = builtin, desc.law_tag = 3;
        scene s = open_scene(&desc, &material), t;
        add_plane(&s, 0, 0, 0, 1);
        add_shape(&s, make_disc(RADIUS), DEM2D_FREE, vec(0, RADIUS + 1e-4), 0, vec(0.7, -1), 5);
        add_shape(&s, make_box(0.1, 0.06), DEM2D_FREE, vec(1, 0.03 + 1e-4), 1e-4, vec(0.7, -1), 0);
        assert_ok(dem2d_world_step(s.world, 30, NULL));
        scene_bytes bytes = scene_save(s.world);
        dem2d_load_desc load = {0};
        load.read = scene_read, load.user = &bytes, load.law = builtin, load.law_tag = 3;
        t = s;
        assert_ok(dem2d_world_load(&load, NULL, &t.world));
        assert_true(dem2d_world_hash(s.world) == dem2d_world_hash(t.world));
        for (int k = 0; k < 2; k++) assert_ok(dem2d_world_step((k ? t : s).world, 100, NULL));
        assert_true(dem2d_world_hash(s.world) == dem2d_world_hash(t.world));
        free(bytes.bytes);
        close_scene(&s), close_scene(&t);
    }
}

/* A refused step leaves all as it was: a force that is not finite, by a law that breaks down. */
static void breaking(void *user, dem2d_law_batch *batch) {
    const int *broken = user;
    builtin(NULL, batch);
    for (int k = 0; k < batch->count && *broken; k++) batch->tangential_force[k] = (double)NAN;
}

static void test_refused(void **state) {
    (void)state;
    const impact c = {"", 0.1, 0.2, 0.3, 0.5, 0.2, 0.7, 5};
    dem2d_world_desc desc = {0};
    const dem2d_material_desc material = material_of(&c);
    int broken = 0;
    desc.time_step = contact_time() / 100, desc.law = breaking, desc.law_user = &broken;
    scene s = open_scene(&desc, &material);
    add_plane(&s, 0, 0, 0, 1);
    add_shape(&s, make_disc(RADIUS), DEM2D_FREE, vec(0, RADIUS + 1e-4), 0, vec(0.7, -1), 5);
    add_shape(&s, make_box(0.1, 0.06), DEM2D_FREE, vec(1, 0.03 + 1e-4), 1e-4, vec(0.7, -1), 0);
    assert_ok(dem2d_world_step(s.world, 30, NULL));
    const uint64_t hash = dem2d_world_hash(s.world);
    broken = 1;
    assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_STATE);
    assert_true(dem2d_world_hash(s.world) == hash);
    broken = 0;
    assert_ok(dem2d_world_step(s.world, 1, NULL));
    close_scene(&s);
}

/* The same for a step that is too long. */
static void check_refused(const scene *s) {
    assert_ok(dem2d_world_set_time_step(s->world, 1));
    const uint64_t hash = dem2d_world_hash(s->world);
    assert_int_not_equal(dem2d_world_step(s->world, 1, NULL), DEM2D_OK);
    assert_true(dem2d_world_hash(s->world) == hash);
    assert_ok(dem2d_world_set_time_step(s->world, 1e-5));
}

/* The same after one of two points has gone, and then the dashpots: nothing is left of what they had
   of both. A box on its face turns about a corner, on a floor or on another box. Or it falls flat on
   a floor: dashpots of two points have forces of -0 before they go. */
static void test_refused_with_one_point(void **state) {
    (void)state;
    const impact c = {"", 0.1, 0.2, 0, 0.5, 0, 0, 0};
    for (int which = 0; which < 3; which++) {
        dem2d_world_desc desc = {0};
        const dem2d_material_desc material = material_of(&c);
        const bool pair = which == 1, flat = which == 2;
        dem2d_contact_info contact;
        int last = 0, turned = 0;
        desc.time_step = contact_time() / 100;
        scene s = open_scene(&desc, &material);
        add_plane(&s, 0, pair ? -0.3 : 0, 0, 1);
        if (pair) add_shape(&s, make_box(0.4, 0.1), DEM2D_FIXED, vec(0, -0.05), 0, vec(0, 0), 0);
        add_shape(&s, make_box(0.1, 0.06), DEM2D_FREE, vec(0, 0.03 - 2e-4), 0, vec(0, -0.05),
                  flat ? 0 : 5);
        for (int i = 0; i < 1000 && turned == 0; i++) {
            step(&s, 1);
            if (contacts_of(&s, &contact, 1) == 0) contact.points = 0;
            turned = last == 2 && contact.points == (flat ? 2 : 1);
            last = contact.points;
        }
        assert_true(turned);
        dem2d_pair_desc law;
        assert_ok(dem2d_world_get_pair(s.world, s.material, s.material, &law));
        law.damping_ratio = law.tangential_damping_ratio = 0;
        assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &law));
        step(&s, 1);
        assert_int_equal(contacts_of(&s, &contact, 1), 1);
        check_refused(&s);
        close_scene(&s);
    }
}

/* --- what follows from laws, masses and radii, after they have changed ------------------------- */

/* Two discs, and a disc and a wall, near each other: a list is made, something is edited, and then
   they meet. */
typedef struct near_discs {
    scene s;
    dem2d_shape_id shape;
    dem2d_particle_id id[3];
    double radius, density, zeta, zeta_t, zeta_r; /* of all that are edited */
    bool held;                                    /* the first */
} near_discs;

#define NEAR_STEP 2e-5 /* s */

enum { NO_EDIT, EDIT_PAIR, EDIT_SIZE, EDIT_MATERIAL, EDIT_MOTION, EDIT_LOAD, NEAR_EDITS };

static near_discs make_near(void) {
    const double gap = 5e-6;
    dem2d_world_desc desc = {0};
    near_discs n = {0};
    n.radius = RADIUS, n.density = 2700, n.zeta = 0.3, n.zeta_t = 0.2, n.zeta_r = 0.1;
    dem2d_material_desc stone = stone_desc(0.8 * KN, 1e3);
    stone.damping_ratio = n.zeta, stone.tangential_damping_ratio = n.zeta_t;
    stone.rolling_friction = 1e3, stone.rolling_damping_ratio = n.zeta_r;
    desc.time_step = NEAR_STEP, desc.skin = 0.5;
    n.s = open_scene(&desc, &stone);
    n.shape = give_shape(&n.s, make_disc(1));
    add_plane(&n.s, 5, 0, -1, 0);
    const double x[] = {0, 2 * RADIUS + gap, 5 - RADIUS - gap};
    for (int i = 0; i < 3; i++) {
        const dem2d_particle_desc grain = grain_desc(&n.s, n.shape, RADIUS, vec(x[i], 0));
        n.id[i] = add_grain(&n.s, &grain);
    }
    step(&n.s, 1);
    return n;
}

static void edit_near(near_discs *n, int which) {
    dem2d_world *w = n->s.world;
    dem2d_material_desc light = stone_desc(0.8 * KN, 1e3);
    dem2d_material_id other;
    dem2d_pair_desc pair = pair_desc(KN, 0.8 * KN, 1e3);
    if (which == EDIT_PAIR) {
        n->zeta = 0.7, n->zeta_t = 0.05, n->zeta_r = 0.4;
        pair.damping_ratio = n->zeta, pair.tangential_damping_ratio = n->zeta_t;
        pair.rolling_friction = 1e3, pair.rolling_damping_ratio = n->zeta_r;
        assert_ok(dem2d_world_set_pair(w, n->s.material, n->s.material, &pair));
    } else if (which == EDIT_SIZE) {
        n->radius = RADIUS * (1 - 1e-5);
        assert_ok(dem2d_world_set_shape(w, n->id[0], n->shape, n->radius));
        assert_ok(dem2d_world_set_shape(w, n->id[2], n->shape, n->radius));
    } else if (which == EDIT_MATERIAL) {
        n->density = light.density = 900;
        light.rolling_friction = 1e3;
        assert_ok(dem2d_world_add_material(w, &light, &other));
        assert_ok(dem2d_world_set_material(w, n->id[0], other));
        assert_ok(dem2d_world_set_material(w, n->id[2], other));
    } else if (which == EDIT_LOAD) {
        scene_bytes bytes = scene_save(w);
        dem2d_world_destroy(w);
        n->s = scene_load(&n->s, &bytes);
        free(bytes.bytes);
    }
    n->held = which == EDIT_MOTION;
}

/* Velocities x, y and spin at which they meet. */
static const double meeting[3][3] = {{0.5, 0.2, 1}, {-0.5, -0.1, -3}, {0.5, 0.3, 2}};

/* The forces of a contact that has just closed, in closed form. */
static void check_first_forces(const near_discs *n, const dem2d_contact_info *c, bool wall) {
    static const double still[3] = {0, 0, 0};
    const double *a = meeting[wall ? 2 : 0], *b = wall ? still : meeting[1];
    const double kt = 0.8 * KN, ra = n->radius, rb = RADIUS, vx = b[0] - a[0], vy = b[1] - a[1];
    const double arm_a = ra - (wall ? c->depth : c->depth / 2);
    const double arm_b = wall ? 0 : rb - c->depth / 2, r = wall ? ra : ra * rb / (ra + rb);
    /* 1/m, then 1/I */
    const double la = n->held && !wall ? 0 : 1 / (n->density * (double)TEST_PI * ra * ra);
    const double lb = wall ? 0 : 1 / mass, ia = 2 * la / (ra * ra), ib = 2 * lb / (rb * rb);
    const double sliding = la + lb + arm_a * arm_a * ia + arm_b * arm_b * ib;
    const double approach = -(c->normal.x * vx + c->normal.y * vy), spin = b[2] - a[2];
    const double slip = c->normal.x * vy - c->normal.y * vx - (arm_a * a[2] + arm_b * b[2]);
    const double normal = KN * c->depth + 2 * n->zeta * sqrt(KN / (la + lb)) * approach;
    const double shear = -(kt * NEAR_STEP + 2 * n->zeta_t * sqrt(kt / sliding)) * slip;
    const double moment =
        -(kt * r * r * NEAR_STEP + 2 * n->zeta_r * sqrt(kt * r * r / (ia + ib))) * spin;
    assert_true(c->depth > 1e-6);
    assert_true(fabs(c->normal_force - normal) <= 1e-12 * normal);
    assert_true(fabs(c->tangential_force - shear) <= 1e-12 * fabs(shear));
    assert_true(fabs(c->moment - moment) <= 1e-12 * fabs(moment));
}

static void test_edited(void **state) {
    (void)state;
    for (int which = 0; which < NEAR_EDITS; which++) {
        near_discs n = make_near();
        const int64_t lists = stats_of(&n.s).list_rebuilds;
        dem2d_contact_info found[3];
        edit_near(&n, which);
        for (int i = 0; i < 3; i++)
            set_velocity(&n.s, n.id[i], n.held && i == 0 ? DEM2D_DRIVEN : DEM2D_FREE,
                         vec(meeting[i][0], meeting[i][1]), meeting[i][2]);
        step(&n.s, 1);
        assert_int_equal(contacts_of(&n.s, NULL, 0), 0);
        step(&n.s, 1);
        /* what is apart leaves the list with a new size */
        assert_int_equal(stats_of(&n.s).list_rebuilds - lists, which == EDIT_SIZE);
        assert_int_equal(contacts_of(&n.s, found, 3), 2);
        for (int k = 0; k < 2; k++) check_first_forces(&n, &found[k], found[k].wall.generation > 0);
        close_scene(&n.s);
    }
}

/* --- a law that loses its springs ---------------------------------------------------------------
 */

/* A grain that slides and rolls on a floor, and one on it that goes the other way. One of another
   material may be far away: its dashpots are those of the world. */
static scene rubbed_grains(bool round, bool alone) {
    dem2d_world_desc desc = {0};
    dem2d_material_desc stone = stone_desc(8e6, 0.5);
    dem2d_material_id other;
    dem2d_vec corners[12];
    stone.damping_ratio = stone.tangential_damping_ratio = stone.rolling_damping_ratio = 0.1;
    stone.rolling_friction = 0.1;
    desc.time_step = 1e-5;
    const scene s = open_scene(&desc, &stone);
    assert_ok(dem2d_world_add_material(s.world, &stone, &other));
    (void)add_floor(&s);
    for (int k = 0; k < 12; k++) {
        const double angle = (double)TEST_PI / 6 * (k - 2.5); /* one edge is below */
        corners[k] = vec(RADIUS * cos(angle), RADIUS * sin(angle));
    }
    for (int i = 0; i < 2; i++) {
        dem2d_shape *shape = round ? make_disc(RADIUS) : make_polygon(corners, 12, 0);
        const double height = round ? RADIUS : RADIUS * cos((double)TEST_PI / 12);
        (void)add_shape(&s, shape, DEM2D_FREE, vec(0, (2 * i + 1) * (height - 1e-4)), 0,
                        vec(1 - 2 * i, 0), 5 - 15 * i);
    }
    if (!alone) {
        const dem2d_particle_id far =
            add_shape(&s, make_disc(RADIUS), DEM2D_FREE, vec(1, 1), 0, vec(0, 0), 0);
        assert_ok(dem2d_world_set_material(s.world, far, other));
    }
    step(&s, 3);
    return s;
}

/* What is left of the forces is held to limits of 0 in the next step, and with it what dashpots had
   of them. */
enum { ROLLING_ENDS, SPRINGS_END, FRICTION_ENDS, ROLLING_FRICTION_ENDS, ENDS };

static void test_springs_end(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; kind++)
        for (int which = 0; which < ENDS; which++) {
            const scene s = rubbed_grains(kind % 2, kind / 2);
            dem2d_pair_desc pair;
            dem2d_contact_info list[2];
            assert_int_equal(contacts_of(&s, list, 2), 2);
            for (int k = 0; k < 2; k++)
                assert_true(list[k].tangential_force != 0 && list[k].moment != 0);
            assert_ok(dem2d_world_get_pair(s.world, s.material, s.material, &pair));
            if (which == ROLLING_ENDS) pair.rolling_friction = pair.rolling_damping_ratio = 0;
            if (which == SPRINGS_END) pair.tangential_stiffness = 0;
            if (which == FRICTION_ENDS) pair.friction = 0;
            if (which == ROLLING_FRICTION_ENDS) pair.rolling_friction = 0;
            assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &pair));
            step(&s, 1);
            assert_int_equal(contacts_of(&s, list, 2), 2);
            for (int k = 0; k < 2; k++) {
                const bool slides = which == SPRINGS_END || which == FRICTION_ENDS;
                assert_true((list[k].moment == 0) == (which != FRICTION_ENDS));
                assert_true((list[k].tangential_force == 0) == slides);
            }
            check_refused(&s);
            step(&s, 10);
            close_scene(&s);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_impacts),   cmocka_unit_test(test_energies),
        cmocka_unit_test(test_bounds),    cmocka_unit_test(test_bounds_at_once),
        cmocka_unit_test(test_safe_step), cmocka_unit_test(test_nothing_to_damp),
        cmocka_unit_test(test_snapshots), cmocka_unit_test(test_refused),
        cmocka_unit_test(test_edited),    cmocka_unit_test(test_springs_end),
        cmocka_unit_test(test_refused_with_one_point),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
