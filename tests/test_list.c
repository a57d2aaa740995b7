/* The list of pairs and the order of particles in memory: nothing is missed, whatever the sizes,
   places and speeds; nothing that can be seen depends on them; a refused step changes nothing. */
#include "dem2d.h"
#include "testing.h"
#include "inside.h"

enum {
    CHECK_STEPS = 160
}; /* every so many steps the world looks for fast motion (manual, LIMITS) */

/* --- building blocks ------------------------------------------------------------------------- */

typedef struct scene {
    dem2d_world *world;
    dem2d_material_id material;
    dem2d_shape_id shapes[3]; /* a circle of radius 1, an ellipse, a triangle */
} scene;

static dem2d_world_desc quiet_desc(void) {
    dem2d_world_desc desc = {0};
    desc.time_step = 1e-4;
    desc.skip_time_step_check = true;
    return desc;
}

static scene open_scene(const dem2d_world_desc *desc, double stiffness, double friction) {
    static const dem2d_vec corners[3] = {{1, 0}, {-0.5, 0.8}, {-0.5, -0.8}};
    const dem2d_material_desc stone = material_desc(1000, stiffness, stiffness, friction);
    dem2d_shape *shapes[3];
    scene s;
    assert_ok(dem2d_world_create(desc, &s.world));
    assert_ok(dem2d_world_add_material(s.world, &stone, &s.material));
    assert_ok(dem2d_shape_create_circle(NULL, 1, &shapes[0]));
    assert_ok(dem2d_shape_create_ellipse(NULL, 1, 0.6, &shapes[1]));
    assert_ok(dem2d_shape_create_polygon(NULL, corners, 3, 0, &shapes[2]));
    for (int i = 0; i < 3; i++) {
        assert_ok(dem2d_world_add_shape(s.world, shapes[i], &s.shapes[i]));
        dem2d_shape_destroy(shapes[i]);
    }
    return s;
}

static dem2d_particle_id add(const scene *s, int shape, double scale, double x, double y,
                             double vx) {
    dem2d_particle_desc desc = {0};
    dem2d_particle_id id;
    desc.scale = scale, desc.shape = s->shapes[shape], desc.material = s->material;
    desc.position.x = x, desc.position.y = y, desc.velocity.x = vx;
    assert_ok(dem2d_world_add_particle(s->world, &desc, &id));
    return id;
}

/* --- nothing is missed ------------------------------------------------------------------------ */

/* Random clouds of sizes from 1 to 1/ratio, which fly about; far is where their middle is. */
static void check_cloud(double ratio, double far, double speed, double skin) {
    dem2d_world_desc desc = quiet_desc();
    desc.skin = skin;
    const scene s = open_scene(&desc, 1e5, 0.3);
    uint64_t random = 7;
    for (int i = 0; i < 150; i++) {
        const double scale = pow(ratio, -random_between(&random, 0, 1));
        add(&s, i % 3, scale, far + random_between(&random, -8, 8), random_between(&random, -8, 8),
            random_between(&random, -speed, speed));
    }
    for (int k = 0; k < 25; k++) {
        assert_ok(dem2d_world_step(s.world, k < 5 ? 1 : 20, NULL));
        assert_int_equal(inside_count_missed(s.world), 0);
    }
    dem2d_world_destroy(s.world);
}

static void test_clouds(void **state) {
    (void)state;
    check_cloud(1, 0, 1, 0);
    check_cloud(10, 0, 10, 0);
    check_cloud(100, 0, 100, 0);
    check_cloud(1000, 0, 10, 0.05);
    check_cloud(100, 1e6, 10, 0);
    check_cloud(100, -1e8, 10, 0);
}

/* Two circles that approach at 1e8 by less than the last bit of a position in a step: each step
   moves them by all of it or not at all. */
static void test_far_crawl(void **state) {
    (void)state;
    dem2d_world_desc desc = quiet_desc();
    const scene s = open_scene(&desc, 1e5, 0);
    const double ulp = 1.4901161193847656e-8, v = 0.5001 * ulp / desc.time_step;
    const dem2d_particle_id a = add(&s, 0, 0.001, 1e8, 0, v);
    const dem2d_particle_id b = add(&s, 0, 0.001, 1e8 + 0.0026, 0, -v);
    const dem2d_vec va = {v, 0}, vb = {-v, 0};
    assert_ok(dem2d_world_drive_particle(s.world, a, DEM2D_DRIVEN, va, 0));
    assert_ok(dem2d_world_drive_particle(s.world, b, DEM2D_DRIVEN, vb, 0));
    for (int k = 0; k < 600; k++) {
        assert_ok(dem2d_world_step(s.world, 50, NULL));
        assert_int_equal(inside_count_missed(s.world), 0);
    }
    assert_ok(dem2d_world_drive_particle(s.world, b, DEM2D_FREE, vb, 0)); /* now it is a contact */
    assert_ok(dem2d_world_step(s.world, 1, NULL));
    dem2d_stats stats;
    assert_ok(dem2d_world_stats(s.world, &stats));
    assert_int_equal(stats.contacts, 1);
    dem2d_world_destroy(s.world);
}

/* All in one place, all in one line, one, none. */
static void test_crowds(void **state) {
    (void)state;
    dem2d_world_desc desc = quiet_desc();
    for (int kind = 0; kind < 4; kind++) {
        const scene s = open_scene(&desc, 1, 0.1);
        const int count = kind == 3 ? 0 : kind == 2 ? 1 : 200;
        for (int i = 0; i < count; i++) add(&s, 0, 1, kind == 1 ? 1.9 * i : 0, 0, 0);
        assert_ok(dem2d_world_step(s.world, 1, NULL));
        dem2d_stats stats;
        assert_ok(dem2d_world_stats(s.world, &stats));
        assert_int_equal(stats.contacts, kind == 0 ? 200 * 199 / 2 : kind == 1 ? 199 : 0);
        dem2d_world_destroy(s.world);
    }
}

/* A skin below all rounding is taken as the least that means something. */
static void test_least_skin(void **state) {
    (void)state;
    dem2d_world_desc desc = quiet_desc();
    desc.skin = 1e-300;
    const scene s = open_scene(&desc, 1e5, 0);
    add(&s, 0, 1, 0, 0, 1);
    add(&s, 0, 1, 2.01, 0, 0);
    assert_ok(dem2d_world_step(s.world, 300, NULL));
    assert_int_equal(inside_count_missed(s.world), 0);
    dem2d_stats stats;
    assert_ok(dem2d_world_stats(s.world, &stats));
    assert_int_equal(stats.contacts, 1);
    dem2d_world_destroy(s.world);
}

/* --- nothing depends on memory or on lists -----------------------------------------------------
 */

/* A lattice whose pairs are just at the reach of the first list, and small circles between. */
static uint64_t run_lattice(double radius, bool sorted, bool renewed, double skin) {
    dem2d_world_desc desc = quiet_desc();
    desc.skin = skin;
    const scene s = open_scene(&desc, 1e5, 0.5);
    for (int k = 0; k < 400; k++) {
        const int i = (k * 37 + 211) % 400; /* neighbours are not neighbours in memory */
        const double x = 0.7 + 2.2 * radius * (i % 20), y = 0.3 + 1.9 * radius * (i / 20);
        add(&s, 0, radius, x, y, 0);
        add(&s, 0, 0.1 * radius, x + 0.8 * radius, y + 0.68 * radius, 0);
        add(&s, 0, 0.1 * radius, x - 0.8 * radius, y + 0.66 * radius, 0);
    }
    if (!sorted) inside_scatter(s.world, false);
    for (int k = 0; k < 20; k++) {
        if (sorted && k % 3 == 0) inside_scatter(s.world, true);
        if (renewed) inside_renew_list(s.world);
        assert_ok(dem2d_world_step(s.world, 10, NULL));
    }
    const uint64_t hash = dem2d_world_hash(s.world);
    dem2d_world_destroy(s.world);
    return hash;
}

static void test_same_bits(void **state) {
    (void)state;
    for (int i = 0; i < (test_long() ? 12 : 5); i++) {
        const double radius = 0.01 + 0.001 * i;
        const uint64_t hash = run_lattice(radius, false, false, 0);
        assert_true(run_lattice(radius, true, false, 0) == hash);
        assert_true(run_lattice(radius, true, true, 0) == hash);
        assert_true(run_lattice(radius, false, true, 0.01) == hash);
        assert_true(run_lattice(radius, false, false, 0.5) == hash);
    }
}

/* --- refused steps -----------------------------------------------------------------------------
 */

typedef struct view {
    dem2d_particle_info grains[2];
    dem2d_contact_info contacts[4];
    dem2d_energy energy;
    dem2d_stress stress;
    int count;
} view;

static view look(const dem2d_world *world, const dem2d_particle_id ids[2]) {
    view v;
    memset(&v, 0, sizeof v);
    for (int i = 0; i < 2; i++) assert_ok(dem2d_world_get_particle(world, ids[i], &v.grains[i]));
    assert_ok(dem2d_world_contacts(world, v.contacts, 4, &v.count));
    assert_ok(dem2d_world_energy(world, &v.energy));
    assert_ok(dem2d_world_stress(world, 1, &v.stress));
    return v;
}

/* Two circles that rub; friction is taken away and the stiffness made too great: refused. Then all
   is as it was, and with the old law goes on as if nothing had been. */
static void test_refused_law(void **state) {
    (void)state;
    dem2d_world_desc desc = quiet_desc();
    desc.skip_time_step_check = false;
    view last[2];
    for (int refused = 0; refused < 2; refused++) {
        const scene s = open_scene(&desc, 1e5, 0.5);
        const dem2d_pair_desc stiff = pair_desc(1e15, 0, 0), old = pair_desc(1e5, 1e5, 0.5);
        dem2d_particle_id ids[2];
        ids[0] = add(&s, 0, 1, 0, 0, 0);
        ids[1] = add(&s, 0, 1, 1.5, 1.3, -0.3);
        assert_ok(dem2d_world_step(s.world, 50, NULL));
        if (refused) {
            assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &stiff));
            const view before = look(s.world, ids); /* energies go by the new law, forces stay */
            assert_int_equal(before.count, 1);
            assert_true(before.contacts[0].tangential_force != 0);
            for (int tries = 0; tries < 3; tries++) {
                assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_TIME_STEP);
                const view after = look(s.world, ids);
                assert_memory_equal(&after, &before, sizeof after);
            }
        }
        assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &old));
        assert_ok(dem2d_world_step(s.world, 50, NULL));
        last[refused] = look(s.world, ids);
        for (int i = 0; i < 2; i++) last[refused].grains[i].shape.generation = 0;
        dem2d_world_destroy(s.world);
    }
    assert_memory_equal(&last[0], &last[1], sizeof last[0]);
}

/* A law that keeps its friction but loses the tangential spring leaves no force of the spring that
   was, by the circles' kernel or the others', nor after a step that is refused. */
static void test_lost_spring(void **state) {
    (void)state;
    dem2d_world_desc desc = quiet_desc();
    desc.skip_time_step_check = false;
    for (int kernel = 0; kernel < 2; kernel++) {
        desc.solver = kernel == 0 ? DEM2D_CERTIFIED : DEM2D_GJK_EPA;
        const scene s = open_scene(&desc, 1e5, 0.5);
        const dem2d_pair_desc bare = {
            .normal_stiffness = 1e5, .friction = 0.5, .rolling_friction = 0.1};
        dem2d_particle_id ids[2];
        ids[0] = add(&s, 0, 1, 0, 0, 0);
        ids[1] = add(&s, 0, 1, 1.5, 1.3, -0.3);
        assert_ok(dem2d_world_step(s.world, 50, NULL));
        view v = look(s.world, ids);
        assert_int_equal(v.count, 1);
        assert_true(v.contacts[0].tangential_force != 0);
        assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &bare));
        for (int k = 0; k < 4; k++) {
            assert_ok(dem2d_world_step(s.world, 1, NULL));
            v = look(s.world, ids);
            assert_int_equal(v.count, 1);
            assert_true(v.contacts[0].tangential_force == 0);
            assert_ok(dem2d_world_set_time_step(s.world, 1e3));
            const uint64_t hash = dem2d_world_hash(s.world);
            assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_TIME_STEP);
            assert_int_equal(dem2d_world_hash(s.world), hash);
            assert_ok(dem2d_world_set_time_step(s.world, desc.time_step));
        }
        dem2d_world_destroy(s.world);
    }
}

/* A step that would not end finite fails after it has renewed the list: the next one still knows
   the laws of its contacts. */
static void test_refused_state(void **state) {
    (void)state;
    dem2d_world_desc desc = quiet_desc();
    const scene s = open_scene(&desc, 1e5, 0.5);
    const dem2d_vec wild = {0, -1.5e308}, up = {0, 1};
    dem2d_particle_id ids[2];
    ids[0] = add(&s, 0, 1, 0, 0, 0);
    ids[1] = add(&s, 0, 1, 1.5, 1.3, 0);
    for (int i = 0; i < 2; i++)
        assert_ok(dem2d_world_drive_particle(s.world, ids[i], DEM2D_FREE, up, 0));
    assert_ok(dem2d_world_set_gravity(s.world, wild));
    assert_ok(dem2d_world_set_damping(s.world, 0.9, 0)); /* against the way: 1.9 times as much */
    assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_STATE);
    assert_ok(dem2d_world_set_damping(s.world, 0, 0));
    assert_ok(dem2d_world_step(s.world, 1, NULL));
    const view v = look(s.world, ids);
    assert_int_equal(v.count, 1);
    assert_near(v.contacts[0].normal_force, 1e5 * v.contacts[0].depth, 1e-14);
    dem2d_world_destroy(s.world);
}

/* Rotations are those the particles were given, whether the world keeps angles or not, and the last
   ellipse that leaves takes no bit of them along. */
static void test_rotations(void **state) {
    (void)state;
    dem2d_world_desc desc = quiet_desc();
    const scene s = open_scene(&desc, 1e5, 0.5);
    dem2d_particle_id ids[2];
    ids[0] = add(&s, 0, 1, 0, 0, 0);
    ids[1] = add(&s, 1, 1, 5, 0, 0);
    const dem2d_vec v = {0, 0};
    assert_ok(dem2d_world_drive_particle(s.world, ids[0], DEM2D_FREE, v, 3));
    assert_ok(dem2d_world_move_particle(s.world, ids[0], v, 0.7));
    dem2d_particle_info info;
    assert_ok(dem2d_world_get_particle(s.world, ids[0], &info));
    const dem2d_rot q = dem2d_rot_make(0.7);
    assert_memory_equal(&info.pose.rotation, &q, sizeof q);
    assert_ok(dem2d_world_step(s.world, 1000, NULL));
    assert_ok(dem2d_world_get_particle(s.world, ids[0], &info));
    assert_within(dem2d_rot_angle(info.pose.rotation), 0.7 + 0.3, 1e-12);
    const dem2d_rot turned = info.pose.rotation;
    assert_ok(dem2d_world_remove_particle(s.world, ids[1]));
    assert_ok(dem2d_world_get_particle(s.world, ids[0], &info));
    assert_memory_equal(&info.pose.rotation, &turned, sizeof turned);
    assert_ok(dem2d_world_step(s.world, 1000, NULL));
    assert_ok(dem2d_world_get_particle(s.world, ids[0], &info));
    assert_within(dem2d_rot_angle(info.pose.rotation), 0.7 + 0.6, 1e-12);
    dem2d_world_destroy(s.world);
}

/* A world of circles alone keeps angles: many turns, and what a query says. */
static void test_angles(void **state) {
    (void)state;
    dem2d_world_desc desc = quiet_desc();
    const scene s = open_scene(&desc, 1e5, 0.5);
    const dem2d_particle_id id = add(&s, 0, 1, 0, 0, 0);
    const dem2d_vec v = {0, 0};
    assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_DRIVEN, v, -1e4));
    assert_ok(dem2d_world_step(s.world, 100000, NULL));
    dem2d_particle_info info;
    assert_ok(dem2d_world_get_particle(s.world, id, &info));
    const long double angle = remainderl(-1e5L, 2 * TEST_PI);
    assert_within(dem2d_rot_angle(info.pose.rotation), angle, 1e-10);
    dem2d_world_destroy(s.world);
}

/* --- the check of the time step ----------------------------------------------------------------
 */

/* Deep in a large circle the contact point is far outside of the small one, whose lever is long. */
static void test_deep_lever(void **state) {
    (void)state;
    dem2d_world_desc desc = quiet_desc();
    desc.skip_time_step_check = false;
    for (int shape = 0; shape < 2; shape++) {
        const scene s = open_scene(&desc, 1e6, 0.5);
        const dem2d_particle_id large = add(&s, shape, 100, 0, 0, 0);
        const dem2d_vec v = {0, 0};
        double safe, limit;
        assert_ok(dem2d_world_drive_particle(s.world, large, DEM2D_FIXED, v, 0));
        add(&s, shape, 0.5, 50, 0, 0);
        assert_ok(dem2d_world_step(s.world, 1, NULL));
        assert_ok(dem2d_world_time_step_bounds(s.world, &safe, &limit, NULL));
        assert_ok(dem2d_world_set_time_step(s.world, 1.05 * limit));
        assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_TIME_STEP);
        assert_ok(dem2d_world_set_time_step(s.world, 0.9 * limit));
        assert_ok(dem2d_world_step(s.world, 1, NULL));
        dem2d_world_destroy(s.world);
    }
}

/* --- particles that outrun the steps ------------------------------------------------------------
 */

static dem2d_stats stats_of(const dem2d_world *world) {
    dem2d_stats stats;
    assert_ok(dem2d_world_stats(world, &stats));
    return stats;
}

/* A particle that moves or spins by `part` of its inscribed radius in a step, among two at rest. */
static void check_fast(int shape, bool spins, double part, bool found) {
    test_env env;
    test_env_init(&env);
    dem2d_world_desc desc = quiet_desc();
    desc.env = &env.env;
    const scene s = open_scene(&desc, 1e5, 0);
    dem2d_shape_info info;
    assert_ok(dem2d_shape_get(dem2d_world_shape(s.world, s.shapes[shape]), &info));
    add(&s, 0, 1, -100, 0, 0);
    const dem2d_particle_id id = add(&s, shape, 3, 0, 0, 0);
    add(&s, 1, 1, 100, 0, 0);
    const double path = part * 3 * info.inscribed / desc.time_step;
    const dem2d_vec v = {0, spins ? 0 : -path};
    const double w = spins ? path / (3 * info.circumscribed) : 0;
    assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_FREE, v, w));
    assert_int_equal(stats_of(s.world).fast_motion, 0);
    assert_ok(dem2d_world_step(s.world, 1, NULL)); /* before it has moved */
    assert_int_equal(stats_of(s.world).fast_motion, found);
    assert_ok(dem2d_world_step(s.world, CHECK_STEPS - 1, NULL));
    assert_int_equal(stats_of(s.world).fast_motion, found);
    assert_ok(dem2d_world_step(s.world, CHECK_STEPS, NULL));
    assert_int_equal(stats_of(s.world).fast_motion, 2 * found);
    assert_int_equal(env.log.count, found);
    if (found) assert_logged(&env, DEM2D_WARNING, (int)id.index, "inscribed");
    dem2d_world_destroy(s.world);
    assert_clean(&env);
}

static void test_fast(void **state) {
    (void)state;
    for (int shape = 0; shape < 3; shape++) {
        check_fast(shape, false, 0.99, false);
        check_fast(shape, false, 1.01, true);
        if (shape > 0) check_fast(shape, true, 0.99, false);
        check_fast(shape, true, 1.01, shape > 0); /* the spin of a circle is no motion */
    }
}

/* One that falls faster and faster is found by the next check, whatever the skin. */
static void test_falls_fast(void **state) {
    (void)state;
    for (int k = 0; k < 3; k++) {
        dem2d_world_desc desc = quiet_desc();
        desc.gravity.y = -1e7, desc.skin = k;
        const scene s = open_scene(&desc, 1e-3, 0);
        add(&s, 0, 1, 0, 0, 0);
        for (int steps = 0; steps <= 2 * CHECK_STEPS; steps++) {
            const int checks = steps > 0 ? (steps - 1) / CHECK_STEPS : 0;
            assert_int_equal(stats_of(s.world).fast_motion, checks); /* the first: at rest */
            assert_ok(dem2d_world_step(s.world, 1, NULL));
        }
        dem2d_world_destroy(s.world);
    }
}

/* An edit that can matter is followed by a check in the next step. Each check counts a particle
   that is too fast. */
static void test_checks(void **state) {
    (void)state;
    const dem2d_world_desc desc = quiet_desc();
    const scene s = open_scene(&desc, 1e6, 0);
    const dem2d_pair_desc stiff = pair_desc(1.1e6, 0, 0);
    const dem2d_vec v = {0, 0}, slow = {1, 0}, fast = {2e4, 0}, far = {50, 0};
    const dem2d_particle_id runner = add(&s, 0, 1, 0, 1000, 0), id = add(&s, 0, 1, 0, 0, 0);
    assert_ok(dem2d_world_drive_particle(s.world, runner, DEM2D_DRIVEN, fast, 0));
    dem2d_wall_desc wall = {.material = s.material, .normal = {0, 1}, .point = {0, -5}};
    dem2d_wall_id wall_id;
    for (int edit = 0; edit < 10; edit++) {
        switch (edit) {
        case 0:
            break; /* the first step */
        case 1:
            assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &stiff));
            break;
        case 2:
            add(&s, 0, 1, 20, 0, 0);
            break;
        case 3:
            assert_ok(dem2d_world_move_particle(s.world, id, far, 0));
            break;
        case 4:
            assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_DRIVEN, v, 0));
            break;
        case 5:
            assert_ok(dem2d_world_add_wall(s.world, &wall, &wall_id));
            break;
        case 6:
            assert_ok(dem2d_world_set_time_step(s.world, 1.1e-4));
            break;
        case 7:
            assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_DRIVEN, fast, 1));
            break;
        case 8: /* no check: a smaller time step, gravity, damping, a speed that is not too high */
            assert_ok(dem2d_world_set_time_step(s.world, 1e-4));
            assert_ok(dem2d_world_set_gravity(s.world, slow));
            assert_ok(dem2d_world_set_damping(s.world, 0.1, 0.1));
            assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_DRIVEN, slow, 1));
            break;
        default:
            break; /* no edit */
        }
        const int64_t before = stats_of(s.world).fast_motion;
        assert_ok(dem2d_world_step(s.world, 2, NULL));
        assert_int_equal(stats_of(s.world).fast_motion - before, edit < 8);
    }
    dem2d_world_destroy(s.world);
}

static dem2d_vec unknown_inside(void *user, dem2d_vec u, double *rho) {
    (void)user;
    if (rho) *rho = 1;
    return u;
}

/* Of a custom shape that does not say what is inside, the bounding circle counts. */
static void test_fast_custom(void **state) {
    (void)state;
    for (int found = 0; found < 2; found++) {
        const dem2d_world_desc desc = quiet_desc();
        const scene s = open_scene(&desc, 1e5, 0);
        dem2d_particle_desc grain = {0};
        dem2d_particle_id id;
        dem2d_shape_info info;
        dem2d_shape *shape;
        dem2d_custom_desc custom = {0};
        custom.support = unknown_inside;
        assert_ok(dem2d_shape_create_custom(NULL, &custom, &shape));
        assert_ok(dem2d_shape_get(shape, &info));
        assert_ok(dem2d_world_add_shape(s.world, shape, &grain.shape));
        dem2d_shape_destroy(shape);
        grain.scale = 1, grain.material = s.material;
        grain.velocity.x = (found ? 1.01 : 0.99) * info.circumscribed / desc.time_step;
        assert_ok(dem2d_world_add_particle(s.world, &grain, &id));
        assert_ok(dem2d_world_step(s.world, 1, NULL));
        assert_int_equal(stats_of(s.world).fast_motion, found);
        dem2d_world_destroy(s.world);
    }
}

/* --- segments -----------------------------------------------------------------------------------
 */

static double segment_distance(dem2d_vec a, dem2d_vec b, dem2d_vec x) {
    const double ux = b.x - a.x, uy = b.y - a.y;
    const double t = ((x.x - a.x) * ux + (x.y - a.y) * uy) / (ux * ux + uy * uy);
    const double place = t < 0 ? 0 : t > 1 ? 1 : t;
    return hypot(x.x - a.x - place * ux, x.y - a.y - place * uy);
}

/* Each particle against each segment where the list was built. Pairs that are within both skins are
   listed once; returns how many. */
static int check_segments_listed(const dem2d_world *world, int grains, const dem2d_vec (*ends)[2],
                                 int count) {
    int near = 0, between = 0;
    for (int i = 0; i < grains; i++)
        for (int j = 0; j < count; j++) {
            const double reach = inside_reach(world, i, j);
            const double distance =
                segment_distance(ends[j][0], ends[j][1], inside_position(world, i));
            if (fabs(distance - reach) < 1e-6 * reach) { /* either will do */
                between++;
                continue;
            }
            assert_int_equal(inside_count_listed(world, i, j), distance < reach);
            near += distance < reach;
        }
    assert_in_range(inside_wall_contacts(world), near, near + between);
    return near;
}

/* 300 particles with sizes from 1 to 1/ratio in a square, and one that is far away from them; 60
   segments: short ones, long ones, along the axes and far beyond the square. */
static void check_segments(double side, double ratio, double away, int least) {
    enum { GRAINS = 300, SEGMENTS = 60 };
    dem2d_world_desc desc = quiet_desc();
    const scene s = open_scene(&desc, 1e5, 0.3);
    dem2d_vec ends[SEGMENTS][2];
    uint64_t random = 11;
    for (int i = 0; i < GRAINS; i++)
        add(&s, i % 3, pow(ratio, -random_between(&random, 0, 1)),
            i == 7 ? away : random_between(&random, 0, side), random_between(&random, 0, side), 0);
    for (int j = 0; j < SEGMENTS; j++) {
        dem2d_wall_desc wall = {0};
        dem2d_wall_id id;
        const double length = side * pow(10, random_between(&random, -3, j % 7 == 0 ? 4 : 0));
        const double angle = random_between(&random, 0, 2 * (double)TEST_PI);
        wall.segment = true, wall.material = s.material;
        wall.point.x = random_between(&random, -side / 8, 9 * side / 8);
        wall.point.y = random_between(&random, -side / 8, 9 * side / 8);
        wall.end = wall.point;
        if (j % 3 != 1) wall.end.x += length * cos(angle);
        if (j % 3 != 2) wall.end.y += length * sin(angle);
        assert_ok(dem2d_world_add_wall(s.world, &wall, &id));
        ends[j][0] = wall.point, ends[j][1] = wall.end;
    }
    assert_true(inside_build_list(s.world));
    assert_true(check_segments_listed(s.world, GRAINS, (const dem2d_vec(*)[2])ends, SEGMENTS) >=
                least);
    dem2d_world_destroy(s.world);
}

static void test_segments_listed(void **state) {
    (void)state;
    check_segments(30, 1, 10, 100);      /* all cells of the box */
    check_segments(30, 30, 10, 50);      /* of five levels */
    check_segments(30, 1, 1e7, 100);     /* a hash table */
    check_segments(30, 30, -1e7, 50);    /* of five levels */
    check_segments(3e3, 1, 10, 1);       /* of a sparse scene */
    check_segments(30, 1000, 1e300, 20); /* where all cells of a row are one */
}

/* --- walls that steps pass over -----------------------------------------------------------------
   A wall that stands still without a contact is passed over until a contact or the caller ends its
   rest. The same scene with all walls looked at in every step has the same bits. */

enum { FLOOR_PIECES = 12, WALL_STEPS = 900 };

typedef struct floor_scene {
    scene s;
    dem2d_wall_id walls[FLOOR_PIECES];
} floor_scene;

static dem2d_wall_desc floor_piece(const floor_scene *f, int i) {
    dem2d_wall_desc wall = {0};
    wall.segment = true, wall.material = f->s.material;
    wall.point.x = 1.5 * i, wall.end.x = 1.5 * (i + 1);
    wall.point.y = i % 2 * 0.3, wall.end.y = (i + 1) % 2 * 0.3;
    return wall;
}

static floor_scene open_floor(void) {
    dem2d_world_desc desc = quiet_desc();
    floor_scene f;
    desc.time_step = 1e-3, desc.gravity.y = -9.8, desc.ledger = true;
    f.s = open_scene(&desc, 1e6, 0.4);
    for (int i = 0; i < FLOOR_PIECES; i++) {
        const dem2d_wall_desc wall = floor_piece(&f, i);
        assert_ok(dem2d_world_add_wall(f.s.world, &wall, &f.walls[i]));
    }
    for (int i = 0; i < 42; i++)
        add(&f.s, i % 2, 0.4, 2 + i % 14, 0.9 + 0.9 * (int)(i / 14), i % 3 - 1);
    return f;
}

/* Shifts, drives, stops a piece, or makes it a belt or a wall under stress. */
static void edit_piece(const floor_scene *f, int i, int kind, double amount) {
    const dem2d_wall_id id = f->walls[i];
    dem2d_wall_desc wall = floor_piece(f, i);
    if (kind == 0) wall.point.y -= 0.05 * amount, wall.end.y -= 0.05 * amount;
    if (kind == 1) wall.surface_speed = amount;
    if (kind == 2) wall.mode = DEM2D_WALL_SERVO, wall.stress = 100 * amount, wall.max_speed = 0.1;
    assert_ok(dem2d_world_set_wall(f->s.world, id, &wall));
    if (kind > 3)
        assert_ok(dem2d_world_drive_wall(f->s.world, id, vec(0, -0.1 * amount),
                                         kind == 5 ? 0.2 * amount : 0));
}

static void test_quiet_walls(void **state) {
    const floor_scene f = open_floor(), other = open_floor();
    uint64_t random = 5;
    int quiet = 0, woken = 0;
    (void)state;
    for (int k = 0; k < WALL_STEPS; k++) {
        if (k % 45 == 44) {
            const int piece = (int)random_between(&random, 0, FLOOR_PIECES);
            const int kind = (int)random_between(&random, 0, 6);
            const double amount = random_between(&random, 0.5, 1);
            edit_piece(&f, piece, kind, amount);
            edit_piece(&other, piece, kind, amount);
        }
        for (int j = 0; j < FLOOR_PIECES; j++) inside_wake_wall(other.s.world, j);
        bool was[FLOOR_PIECES];
        for (int j = 0; j < FLOOR_PIECES; j++) was[j] = inside_wall_is_quiet(f.s.world, j);
        assert_ok(dem2d_world_step(f.s.world, 1, NULL));
        assert_ok(dem2d_world_step(other.s.world, 1, NULL));
        assert_true(dem2d_world_hash(f.s.world) == dem2d_world_hash(other.s.world));
        for (int j = 0; j < FLOOR_PIECES; j++) {
            quiet += was[j];
            woken += was[j] && !inside_wall_is_quiet(f.s.world, j);
        }
    }
    assert_true(quiet > WALL_STEPS && woken > 20);
    dem2d_world_destroy(f.s.world);
    dem2d_world_destroy(other.s.world);
}

/* Discs that overlap are found, however far away another one is: cells are counted from there. */
static void test_far_away(void **state) {
    (void)state;
    static const double far[] = {1e3, 1e12, 1e14, 1e16, 1e17, 1e18, 1e20, 1e25};
    const dem2d_world_desc desc = quiet_desc();
    for (int k = 0; k < 8; k++) {
        scene s = open_scene(&desc, 1e4, 0);
        for (int i = 0; i <= 256; i++) {
            dem2d_particle_desc grain = {0};
            dem2d_particle_id id;
            grain.scale = 1, grain.shape = s.shapes[0], grain.material = s.material;
            grain.position = vec(0.7 + 1.9 * (i % 16), 0.7 + 1.9 * (i / 16));
            if (i == 256) grain.position = vec(-far[k], -2.7 * far[k]);
            assert_ok(dem2d_world_add_particle(s.world, &grain, &id));
        }
        assert_ok(dem2d_world_step(s.world, 1, NULL));
        dem2d_stats stats;
        assert_ok(dem2d_world_stats(s.world, &stats));
        assert_int_equal(stats.contacts, 2 * 15 * 16);
        dem2d_world_destroy(s.world);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_clouds),      cmocka_unit_test(test_far_crawl),
        cmocka_unit_test(test_crowds),      cmocka_unit_test(test_least_skin),
        cmocka_unit_test(test_same_bits),   cmocka_unit_test(test_refused_law),
        cmocka_unit_test(test_lost_spring), cmocka_unit_test(test_refused_state),
        cmocka_unit_test(test_rotations),   cmocka_unit_test(test_angles),
        cmocka_unit_test(test_deep_lever),  cmocka_unit_test(test_fast),
        cmocka_unit_test(test_falls_fast),  cmocka_unit_test(test_checks),
        cmocka_unit_test(test_fast_custom), cmocka_unit_test(test_segments_listed),
        cmocka_unit_test(test_quiet_walls), cmocka_unit_test(test_far_away),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
