/* External loads: what they do to grains, to the ledger, to bounds of the motion; those that a
   callback sets in each step, against closed forms. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "world_scene.h"

static dem2d_world_desc plain_desc(double time_step) {
    dem2d_world_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.time_step = time_step, desc.ledger = true;
    return desc;
}

static void set_load(const scene *s, dem2d_particle_id id, dem2d_vec force, double torque) {
    assert_ok(dem2d_world_set_load(s->world, id, force, torque));
}

/* --- drag: F = -c v --------------------------------------------------------------------------- */

typedef struct drag {
    dem2d_particle_id id;
    double c;
    int calls;
} drag;

static void brake(void *user, dem2d_world *world) {
    drag *d = user;
    dem2d_particle_info info;
    assert_ok(dem2d_world_get_particle(world, d->id, &info));
    const dem2d_vec force = vec(-d->c * info.velocity.x, -d->c * info.velocity.y);
    assert_ok(dem2d_world_set_load(world, d->id, force, -d->c * info.angular_velocity));
    d->calls++;
}

/* Velocity after a time, of a disc that falls from rest. */
static double fall(double time, double time_step, double c_over_m, double *terminal, double *way) {
    drag d = {{0, 0}, 0, 0};
    dem2d_world_desc desc = plain_desc(time_step);
    const dem2d_material_desc stone = stone_desc(0, 0);
    desc.gravity = vec(0, -9.81), desc.loads = brake, desc.loads_user = &d;
    const scene s = open_scene(&desc, &stone);
    d.id = add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0), 0, vec(0, 0), 0);
    d.c = c_over_m * grain_of(&s, d.id).mass;
    const int steps = (int)(time / time_step + 0.5);
    step(&s, steps);
    const dem2d_particle_info info = grain_of(&s, d.id);
    assert_int_equal(d.calls, steps);
    *terminal = 9.81 / c_over_m, *way = -info.pose.position.y;
    const dem2d_ledger l = ledger_of(&s);
    assert_true(l.loads < 0); /* drag takes energy */
    assert_within(l.closure, 0, 1e-12 * l.turnover);
    close_scene(&s);
    return -info.velocity.y;
}

/* v = vt (1 - exp(-c t/m)), with an error of first order; vt itself to rounding. */
static void test_drag(void **state) {
    (void)state;
    const double rate = 4, time = 0.5;
    double error[2], vt, way;
    for (int k = 0; k < 2; k++) {
        const double v = fall(time, k == 0 ? 1e-3 : 5e-4, rate, &vt, &way);
        error[k] = fabs(v / (vt * (1 - exp(-rate * time))) - 1);
    }
    assert_between(error[0], 1e-6, 2 * rate * 1e-3);
    assert_near(error[0] / error[1], 2, 0.02);
    const double v = fall(10, 1e-3, rate, &vt, &way);
    assert_near(v, vt, 1e-12);
    assert_near(way, vt * (10 - 1 / rate), 1e-3);
    const double coarse = fall(1, 0.2, 4.9, &vt, &way); /* c dt/m = 0.98: no overshoot */
    assert_near(coarse, vt, 1e-6);
    assert_true(fabs(fall(20, 0.42, 4.9, &vt, &way)) > 5 * vt); /* c dt/m = 2.06: unstable */
}

/* --- magnets: two discs that attract each other by G/r^2 ---------------------------------------
 */

#define PULL 3e-3

typedef struct magnets {
    dem2d_particle_id id[2];
} magnets;

static void attract(void *user, dem2d_world *world) {
    const magnets *m = user;
    dem2d_particle_info a, b;
    assert_ok(dem2d_world_get_particle(world, m->id[0], &a));
    assert_ok(dem2d_world_get_particle(world, m->id[1], &b));
    const double x = b.pose.position.x - a.pose.position.x;
    const double y = b.pose.position.y - a.pose.position.y, r = hypot(x, y);
    const dem2d_vec force = vec(PULL * x / (r * r * r), PULL * y / (r * r * r));
    assert_ok(dem2d_world_set_load(world, m->id[0], force, 0));
    assert_ok(dem2d_world_set_load(world, m->id[1], vec(-force.x, -force.y), 0));
}

/* Kepler: after T = 2 pi (a^3 mu/G)^(1/2) both are where they started; the energy -G/(2 a) and the
   areal velocity stay; the ledger's work is what the potential loses. */
static void test_orbit(void **state) {
    (void)state;
    magnets m;
    const dem2d_material_desc stone = material_desc(1000, 1e6, 0, 0);
    const double a = 0.2, e = 0.4;
    dem2d_world_desc desc = plain_desc(1); /* set below, when the masses are known */
    desc.loads = attract, desc.loads_user = &m;
    const scene s = open_scene(&desc, &stone);
    m.id[0] = add_shape(&s, make_disc(0.01), DEM2D_FREE, vec(0, 0), 0, vec(0, 0), 0);
    m.id[1] = add_shape(&s, make_disc(0.02), DEM2D_FREE, vec(a * (1 + e), 0), 0, vec(0, 0), 0);
    const double ma = grain_of(&s, m.id[0]).mass, mb = grain_of(&s, m.id[1]).mass;
    const double mu = ma * mb / (ma + mb), rate = sqrt(PULL / (mu * a * a * a));
    const double period = 2 * (double)TEST_PI / rate, r0 = a * (1 + e);
    const double v = sqrt(PULL / mu * (2 / r0 - 1 / a)); /* at the far end */
    const int steps = 20000;
    assert_ok(dem2d_world_set_time_step(s.world, period / steps));
    /* velocities are half a step before: dv = -F/m dt/2 along the line of centres */
    const double back = -PULL / (r0 * r0) * period / steps / 2;
    set_velocity(&s, m.id[0], DEM2D_FREE, vec(back / ma, -v * mb / (ma + mb)), 0);
    set_velocity(&s, m.id[1], DEM2D_FREE, vec(-back / mb, v * ma / (ma + mb)), 0);
    step(&s, steps / 2); /* the near end */
    dem2d_vec p = grain_of(&s, m.id[0]).pose.position, q = grain_of(&s, m.id[1]).pose.position;
    assert_near(hypot(q.x - p.x, q.y - p.y), a * (1 - e), 1e-6);
    step(&s, 1); /* energies are those of the force pass */
    const double speed = sqrt(PULL / mu * (2 / (a * (1 - e)) - 1 / a));
    assert_near(kinetic_of(&s), mu * speed * speed / 2, 1e-5);
    assert_near(ledger_of(&s).loads, PULL / (a * (1 - e)) - PULL / r0, 1e-5);
    step(&s, steps / 2 - 1);
    p = grain_of(&s, m.id[0]).pose.position, q = grain_of(&s, m.id[1]).pose.position;
    assert_within(q.x - p.x, r0, 1e-6 * a);
    assert_within(q.y - p.y, 0, 1e-4 * a);
    step(&s, 9 * steps + 1);
    const dem2d_ledger l = ledger_of(&s);
    assert_within(l.loads, 0, 1e-5 * PULL / r0); /* ten orbits, the same place */
    assert_within(l.closure, 0, 1e-9 * l.turnover);
    close_scene(&s);
}

/* --- loads that stay ----------------------------------------------------------------------------
 */

/* A frictionless disc turns and flies as under a constant force; a driven and a fixed one do not
   answer. */
static void test_constant(void **state) {
    (void)state;
    const dem2d_world_desc desc = plain_desc(1e-3);
    const dem2d_material_desc stone = stone_desc(0, 0);
    const scene s = open_scene(&desc, &stone);
    dem2d_particle_id id[3];
    const dem2d_motion motions[3] = {DEM2D_FREE, DEM2D_FIXED, DEM2D_DRIVEN};
    for (int i = 0; i < 3; i++) {
        id[i] = add_shape(&s, make_disc(0.05), motions[i], vec(i, 0), 0, vec(0, 0), 0);
        set_load(&s, id[i], vec(3, -2), 0.5);
    }
    step(&s, 200);
    const dem2d_particle_info info = grain_of(&s, id[0]);
    const double t = 0.2 * 0.201 / 2;
    assert_near(info.pose.position.x, 3 / info.mass * t, 1e-12);
    assert_near(angle_of(&s, id[0]), 0.5 / info.inertia * t, 1e-12);
    assert_true(info.load.x == 3 && info.load.y == -2 && info.load_torque == 0.5);
    assert_true(info.force.x == 0 && info.torque == 0); /* contacts alone */
    for (int i = 1; i < 3; i++) assert_true(grain_of(&s, id[i]).pose.position.x == i);
    set_load(&s, id[0], vec(0, 0), 0);
    const double v = grain_of(&s, id[0]).velocity.x;
    step(&s, 10);
    assert_same_bits(grain_of(&s, id[0]).velocity.x, v);
    set_velocity(&s, id[2], DEM2D_FREE, vec(0, 0), 0); /* now it answers */
    step(&s, 1);
    assert_near(grain_of(&s, id[2]).velocity.x, 1e-3 * 3 / info.mass, 1e-12);
    close_scene(&s);
}

/* A disc at rest on a floor: the overlap carries weight and load, nothing is unbalanced. */
static void test_at_rest(void **state) {
    (void)state;
    dem2d_world_desc desc = plain_desc(1e-5);
    const dem2d_material_desc stone = stone_desc(1e6, 0.3);
    desc.gravity = vec(0, -9.81), desc.local_damping = 0.7;
    const scene s = open_scene(&desc, &stone);
    (void)add_floor(&s);
    const dem2d_particle_id id =
        add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0.05), 0, vec(0, 0), 0);
    set_load(&s, id, vec(100, -5000), 0);
    step(&s, 60000);
    dem2d_contact_info contact;
    dem2d_equilibrium rest;
    assert_int_equal(contacts_of(&s, &contact, 1), 1);
    const double weight = grain_of(&s, id).mass * 9.81;
    assert_near(contact.normal_force, weight + 5000, 1e-3);
    assert_ok(dem2d_world_equilibrium(s.world, &rest));
    const double left = rest.unbalanced;
    set_load(&s, id, vec(0, 0), 0);
    assert_ok(dem2d_world_equilibrium(s.world, &rest));
    assert_true(left < 0.03 && rest.unbalanced > 0.9);
    close_scene(&s);
}

/* --- piles --------------------------------------------------------------------------------------
 */

enum { PILE = 30 };

typedef struct pile {
    scene s;
    dem2d_particle_id ids[PILE];
} pile;

/* Grains of several kinds in a box with a servo lid; loads on every other one. */
static pile make_pile(const dem2d_env *env, bool circles, bool loaded) {
    static const dem2d_vec box[4] = {{0, 0}, {0.09, 0}, {0.09, 0.06}, {0, 0.06}};
    dem2d_material_desc stone = stone_desc(5e6, circles ? 0 : 0.4);
    dem2d_world_desc desc = plain_desc(1e-4);
    pile p;
    desc.gravity = vec(0, -10), desc.env = env;
    p.s = open_scene(&desc, &stone);
    const dem2d_shape_id shapes[3] = {give_shape(&p.s, make_disc(0.05)),
                                      give_shape(&p.s, make_polygon(box, 4, 0)),
                                      give_shape(&p.s, make_ellipse(0.05, 0.03))};
    (void)add_floor(&p.s), (void)add_plane(&p.s, -0.06, 0, 1, 0);
    (void)add_plane(&p.s, 0.47, 0, -1, 0);
    dem2d_wall_desc lid = plane_desc(&p.s, vec(0, 0.75), vec(0, -1));
    lid.mode = DEM2D_WALL_SERVO, lid.stress = 1000, lid.max_speed = 1, lid.length = 0.53;
    (void)add_wall(&p.s, &lid);
    for (int i = 0; i < PILE; i++) {
        const dem2d_particle_desc grain =
            grain_desc(&p.s, shapes[circles ? 0 : i % 3], i % 4 == 0 ? 0.8 : 1,
                       vec(0.102 * (i % 5) + 0.01 * (i / 5 % 2), 0.06 + 0.11 * (i / 5)));
        p.ids[i] = add_grain(&p.s, &grain);
        if (loaded && i % 2) set_load(&p.s, p.ids[i], vec(30 - i, 3 * i - 20), 0.1 * i - 1);
    }
    return p;
}

/* The balance of energies closes as without loads. */
static void test_ledger(void **state) {
    (void)state;
    for (int circles = 0; circles < 2; circles++) {
        const pile p = make_pile(NULL, circles == 1, true);
        step(&p.s, 5000);
        const dem2d_ledger l = ledger_of(&p.s);
        assert_true(fabs(l.loads) > 1e-4 * l.turnover);
        assert_within(l.closure, 0, 3e-3 * l.turnover);
        close_scene(&p.s);
    }
}

/* Saved, hashed, moved with the particles in memory, and the same for any list. */
static void test_state(void **state) {
    (void)state;
    pile p = make_pile(NULL, false, true), q = make_pile(NULL, false, true);
    for (int k = 0; k < 20; k++) {
        inside_renew_list(p.s.world), inside_scatter(p.s.world, true);
        if (k == 10) {
            assert_ok(dem2d_world_remove_particle(p.s.world, p.ids[3]));
            assert_ok(dem2d_world_remove_particle(q.s.world, q.ids[3]));
            scene_bytes bytes = scene_save(q.s.world);
            close_scene(&q.s);
            q.s = scene_load(&p.s, &bytes);
            free(bytes.bytes);
        }
        step(&p.s, 100), step(&q.s, 100);
        assert_true(dem2d_world_hash(p.s.world) == dem2d_world_hash(q.s.world));
        assert_true(inside_holds(p.s.world) && inside_holds(q.s.world));
    }
    assert_true(ledger_of(&p.s).loads == ledger_of(&q.s).loads);
    const dem2d_particle_info info = grain_of(&q.s, q.ids[7]);
    assert_true(info.load.x == 23 && info.load.y == 1 && info.load_torque == 0.1 * 7 - 1);
    const uint64_t hash = dem2d_world_hash(p.s.world);
    set_load(&p.s, p.ids[7], vec(23, 1.5), info.load_torque);
    assert_true(dem2d_world_hash(p.s.world) != hash);
    set_load(&p.s, p.ids[7], vec(23, 1), info.load_torque);
    assert_true(dem2d_world_hash(p.s.world) == hash);
    close_scene(&p.s), close_scene(&q.s);
}

/* Loads of 0 change no bit of the motion. */
static void test_zero(void **state) {
    (void)state;
    for (int circles = 0; circles < 2; circles++) {
        pile p = make_pile(NULL, circles == 1, false), q = make_pile(NULL, circles == 1, false);
        step(&p.s, 500), step(&q.s, 500);
        set_load(&q.s, q.ids[0], vec(0, 0), 0);
        step(&p.s, 3000), step(&q.s, 3000);
        for (int i = 0; i < PILE; i++) {
            const dem2d_particle_info a = grain_of(&p.s, p.ids[i]), b = grain_of(&q.s, q.ids[i]);
            assert_memory_equal(&a.pose, &b.pose, sizeof a.pose);
            assert_memory_equal(&a.velocity, &b.velocity, sizeof a.velocity);
        }
        close_scene(&p.s), close_scene(&q.s);
    }
}

/* What would give a state that is not finite is refused. */
static void test_huge(void **state) {
    (void)state;
    const double sizes[] = {1e308, -1e308, 1e308};
    for (int k = 0; k < COUNT_OF(sizes); k++) {
        test_env env;
        test_env_init(&env);
        pile p = make_pile(&env.env, k == 1, k == 2);
        step(&p.s, 300);
        const dem2d_ledger ledger = ledger_of(&p.s);
        set_load(&p.s, p.ids[4], vec(0, 0),
                 sizes[k]); /* over the inertia it is infinite: at once */
        const uint64_t before = dem2d_world_hash(p.s.world);
        assert_result(dem2d_world_step(p.s.world, 1, NULL), DEM2D_STATE);
        const dem2d_ledger after = ledger_of(&p.s);
        assert_true(dem2d_world_hash(p.s.world) == before);
        assert_memory_equal(&ledger, &after, sizeof ledger);
        set_load(&p.s, p.ids[4], vec(0, 0), 0);
        step(&p.s, 100);
        assert_result(dem2d_world_set_load(p.s.world, p.ids[4], vec(NAN, 0), 0), DEM2D_NOT_FINITE);
        assert_result(dem2d_world_set_load(p.s.world, p.ids[4], vec(0, 0), INFINITY),
                      DEM2D_NOT_FINITE);
        assert_logged(&env, DEM2D_NOT_FINITE, -1, "torque");
        close_scene(&p.s);
        assert_clean(&env);
    }
}

/* No memory for the first load: nothing has changed. */
static void test_no_memory(void **state) {
    (void)state;
    test_env env;
    test_env_init(&env);
    pile p = make_pile(&env.env, true, false);
    step(&p.s, 100);
    const uint64_t before = dem2d_world_hash(p.s.world);
    test_env_fail(&env, 1);
    assert_result(dem2d_world_set_load(p.s.world, p.ids[0], vec(1, 1), 1), DEM2D_OUT_OF_MEMORY);
    assert_true(dem2d_world_hash(p.s.world) == before);
    set_load(&p.s, p.ids[0], vec(1, 1), 1);
    step(&p.s, 100);
    assert_true(grain_of(&p.s, p.ids[0]).angular_velocity > 0);
    close_scene(&p.s);
    assert_clean(&env);
}

/* --- the callback and the step ------------------------------------------------------------------
 */

static void step_within(void *user, dem2d_world *world) {
    int *refused = user;
    *refused += dem2d_world_step(world, 1, NULL) == DEM2D_IN_USE;
}

static void test_step_within(void **state) {
    (void)state;
    int refused = 0;
    dem2d_world_desc desc = plain_desc(1e-4);
    const dem2d_material_desc stone = stone_desc(0, 0);
    desc.loads = step_within, desc.loads_user = &refused;
    const scene s = open_scene(&desc, &stone);
    step(&s, 3);
    assert_int_equal(refused, 3);
    assert_int_equal(stats_of(&s).steps, 3);
    close_scene(&s);
}

/* A loaded world has the callback of dem2d_load_desc; a frictionless disc may turn from then on. */
static void test_loaded(void **state) {
    (void)state;
    drag d = {{0, 1}, 0.5, 0};
    const dem2d_world_desc plain = plain_desc(1e-4);
    const dem2d_material_desc stone = stone_desc(0, 0);
    const scene s = open_scene(&plain, &stone);
    d.id = add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0), 0, vec(1, 0), 0);
    step(&s, 10);
    scene_bytes bytes = scene_save(s.world);
    dem2d_load_desc desc;
    scene t = s;
    memset(&desc, 0, sizeof desc);
    desc.read = scene_read, desc.user = &bytes, desc.loads = brake, desc.loads_user = &d;
    assert_ok(dem2d_world_load(&desc, NULL, &t.world));
    free(bytes.bytes);
    set_velocity(&t, d.id, DEM2D_FREE, vec(1, 0), 2);
    step(&t, 10);
    assert_int_equal(d.calls, 10);
    const dem2d_particle_info info = grain_of(&t, d.id);
    assert_between(info.velocity.x, 0.9, 1 - 1e-6);
    assert_between(info.angular_velocity, 0, 2 - 1e-6);
    close_scene(&s), close_scene(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_drag),      cmocka_unit_test(test_orbit),
        cmocka_unit_test(test_constant),  cmocka_unit_test(test_at_rest),
        cmocka_unit_test(test_ledger),    cmocka_unit_test(test_state),
        cmocka_unit_test(test_zero),      cmocka_unit_test(test_huge),
        cmocka_unit_test(test_no_memory), cmocka_unit_test(test_step_within),
        cmocka_unit_test(test_loaded)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
