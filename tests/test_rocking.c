/* Flat surfaces under a force: what they add to the bounds of the time step beside closed forms,
   and that grains of nearly flat arcs keep their energy at these bounds. */
#include "dem2d.h"
#include "testing.h"

#define PI 3.14159265358979324
#define DENSITY 2000.0
#define STIFFNESS 4e6
#define GRAVITY 9.81

/* A square of half width 1 with corners of radius 0.3 and sides of a radius of curvature: eight
   arcs with joints at the corners' circles. */
static dem2d_shape *pillow(double rho) {
    dem2d_vec joint[8], q[24];
    double angle[9];
    const double turn = 0.7 / rho, radius = 0.3, centre = 0.7;
    for (int k = 0; k < 8; k++) {
        const int corner = (k / 2 + 3 + k % 2) % 4; /* side k/2 goes from corner k/2 - 1 to k/2 */
        const double x = corner == 0 || corner == 1 ? centre : -centre;
        const double y = corner == 1 || corner == 2 ? centre : -centre;
        angle[k] = (k / 2 - 1) * PI / 2 + (k % 2 ? turn : -turn);
        joint[k].x = x + radius * cos(angle[k]);
        joint[k].y = y + radius * sin(angle[k]);
    }
    angle[8] = angle[0] + 2 * PI;
    for (int k = 0; k < 8; k++) { /* each nearly an arc of a circle */
        const dem2d_vec from = joint[k], to = joint[(k + 1) % 8];
        const double half = cos((angle[k + 1] - angle[k]) / 2);
        const double length = hypot(to.x - from.x, to.y - from.y) * 2 / 3 / (1 + half);
        q[3 * k] = from;
        q[3 * k + 1] = vec(from.x - length * sin(angle[k]), from.y + length * cos(angle[k]));
        q[3 * k + 2] = vec(to.x + length * sin(angle[k + 1]), to.y - length * cos(angle[k + 1]));
    }
    dem2d_shape *shape;
    assert_ok(dem2d_shape_create_bezier(NULL, q, 8, &shape));
    return shape;
}

/* Grains of one shape on top of each other on a floor, each at rest but for a tilt to one side or
   the other; the world takes the shape. Returns the weight of a grain. */
static double stack(dem2d_shape *shape, int count, double tilt, dem2d_world **world) {
    dem2d_world_desc scene = {.time_step = 1e-7, .gravity = {0, -GRAVITY}, .ledger = true};
    const dem2d_material_desc material = {
        .density = DENSITY, .normal_stiffness = STIFFNESS, .tangential_stiffness = STIFFNESS};
    dem2d_wall_desc floor = {.normal = {0, 1}};
    dem2d_particle_desc grain = {.scale = 1};
    dem2d_shape_info info;
    dem2d_shape_id id;
    dem2d_particle_id particle;
    dem2d_wall_id wall;
    assert_ok(dem2d_world_create(&scene, world));
    assert_ok(dem2d_world_add_material(*world, &material, &floor.material));
    assert_ok(dem2d_world_add_shape(*world, shape, &id));
    assert_ok(dem2d_world_add_wall(*world, &floor, &wall));
    assert_ok(dem2d_shape_get(shape, &info));
    const double weight = DENSITY * info.mass.area * GRAVITY;
    double top = 0;
    for (int i = 0; i < count; i++) {
        dem2d_support below, above;
        grain.angle = i % 2 ? -tilt : tilt;
        const dem2d_pose pose = dem2d_pose_make(0, 0, grain.angle, 1);
        assert_ok(dem2d_shape_support(shape, pose, vec(0, -1), &below));
        assert_ok(dem2d_shape_support(shape, pose, vec(0, 1), &above));
        grain.shape = id;
        grain.material = floor.material;
        grain.position.y = top + below.value - weight * (count - i) / STIFFNESS;
        top = grain.position.y + above.value;
        assert_ok(dem2d_world_add_particle(*world, &grain, &particle));
    }
    assert_ok(dem2d_world_step(*world, 1, NULL));
    dem2d_shape_destroy(shape);
    return weight;
}

/* Bounds of the step of a stack that is as it was put. */
static double bound_of(dem2d_shape *shape, int count, double *safe) {
    dem2d_world *world;
    double limit;
    (void)stack(shape, count, 0, &world);
    assert_ok(dem2d_world_time_step_bounds(world, safe, &limit, NULL));
    dem2d_world_destroy(world);
    return limit;
}

/* w^2 of a body on a wall: F (rho - h)/I when it rocks, k/m when it bounces. A circle has none of
   the first, nor has a polygon on a corner. */
static void a_wall_has_a_closed_form(void **state) {
    (void)state;
    static const double flat[] = {3, 30, 1000, 1e4};
    double safe;
    for (int i = 0; i < COUNT_OF(flat); i++) {
        dem2d_shape *shape = pillow(flat[i]);
        dem2d_shape_info info;
        dem2d_support s;
        assert_ok(dem2d_shape_get(shape, &info));
        assert_ok(dem2d_shape_support(shape, dem2d_pose_make(0, 0, 0, 1), vec(0, -1), &s));
        const double mass = DENSITY * info.mass.area, inertia = DENSITY * info.mass.polar_moment;
        const double rock = mass * GRAVITY * (s.rho - s.value) / inertia, bounce = STIFFNESS / mass;
        const double limit = bound_of(shape, 1, &safe);
        assert_within(limit, 2 / sqrt(fmax(rock, bounce)), 1e-6L * limit);
        assert_true(safe <= limit * (1 + 1e-12));
    }
    dem2d_shape *circle, *ellipse;
    assert_ok(dem2d_shape_create_circle(NULL, 1, &circle));
    assert_ok(dem2d_shape_create_ellipse(NULL, 16, 1, &ellipse));
    const double limit = bound_of(circle, 1, &safe);
    assert_within(limit, 2 / sqrt(STIFFNESS / (DENSITY * PI)), 1e-12L);
    assert_true(safe == limit);
    /* the ellipse lies on its flat side: rho = 256, I = m (256 + 1)/4 */
    const double rock = GRAVITY * (256 - 1) / (257 / 4.0), bounce = STIFFNESS / (DENSITY * PI * 16);
    const double step = bound_of(ellipse, 1, &safe);
    assert_within(step, 2 / sqrt(bounce), 1e-12L);
    assert_within(safe, 2 / sqrt(4 * rock), 1e-12L);
}

/* One that lies on another of its kind: both in series, beside the floor's. */
static void a_pair_has_a_closed_form(void **state) {
    (void)state;
    const double rho = 1e4, depth = 0.01; /* about */
    dem2d_shape *shape = pillow(rho);
    dem2d_shape_info info;
    double safe;
    assert_ok(dem2d_shape_get(shape, &info));
    const double weight = DENSITY * info.mass.area * GRAVITY;
    const double inertia = DENSITY * info.mass.polar_moment;
    const double p = rho - 1, e = rho + 1 - depth, limit = bound_of(shape, 2, &safe);
    const double below =
        (2 * weight * p + weight * p * e / (p + e)) / inertia; /* the lower grain */
    assert_within(limit, 2 / sqrt(below), 1e-3L * limit);
    const double most = 4 * (2 * weight * p + 2 * weight * p * e / (p + e)) / inertia;
    assert_within(safe, 2 / sqrt(most), 1e-2L * safe);
}

/* Resting with a tilt that the flat side hardly has, at the safe bound and below: the ledger closes
   to a part of what it would take to lift the grain by its size. */
static void flat_grains_keep_their_energy(void **state) {
    (void)state;
    static const double steps[] = {1, 0.7, 0.4}, tilts[] = {1e-6, 1e-3};
    double worst = 0;
    for (int k = 0; k < 9 * COUNT_OF(steps) * COUNT_OF(tilts); k++) {
        const double rho = pow(10, 1 + k % 9), step = steps[k / 9 % COUNT_OF(steps)];
        dem2d_world *world;
        dem2d_ledger ledger;
        double safe, limit;
        const double weight = stack(pillow(rho), 1, tilts[k / 9 / COUNT_OF(steps)], &world);
        assert_ok(dem2d_world_time_step_bounds(world, &safe, &limit, NULL));
        assert_ok(dem2d_world_set_time_step(world, step * safe));
        assert_ok(dem2d_world_step(world, 2000, NULL));
        assert_ok(dem2d_world_ledger(world, &ledger));
        const double gain = fabs(ledger.closure) / (weight * 2);
        if (gain > worst)
            print_message("rho %g, tilt %g, %g of safe: %.1e\n", rho, tilts[k / 27], step, gain);
        worst = fmax(worst, gain);
        dem2d_world_destroy(world);
    }
    assert_true(worst < 1e-3);
}

/* A disc hits a wall and leaves it. While it touches, the leapfrog keeps k x0 x1/2 + m v^2/2 of the
   places before and after a step; where it opens or closes, one of them has no spring. So of its
   energy it gets back between 1 - q and 1/(1 - q), q = (dt/safe)^2, wherever the steps fall. */
static void opening_contacts_err_by_the_square(void **state) {
    (void)state;
    static const double parts[] = {0.9, 0.5, 0.25, 0.1};
    enum { PHASES = 200 };
    const double frequency = sqrt(STIFFNESS / (DENSITY * PI)), speed = 0.01;
    for (int k = 0; k < COUNT_OF(parts) * PHASES; k++) {
        const double q = parts[k / PHASES] * parts[k / PHASES];
        const dem2d_world_desc scene = {.time_step = 2 * parts[k / PHASES] / frequency};
        const dem2d_material_desc material = {.density = DENSITY, .normal_stiffness = STIFFNESS};
        dem2d_wall_desc floor = {.normal = {0, 1}};
        dem2d_particle_desc grain = {.scale = 1, .velocity = {0, -speed}};
        dem2d_particle_id id;
        dem2d_wall_id wall;
        dem2d_world *world;
        dem2d_shape *disc;
        dem2d_particle_info now;
        assert_ok(dem2d_world_create(&scene, &world));
        assert_ok(dem2d_world_add_material(world, &material, &floor.material));
        assert_ok(dem2d_shape_create_circle(NULL, 1, &disc));
        assert_ok(dem2d_world_add_shape(world, disc, &grain.shape));
        assert_ok(dem2d_world_add_wall(world, &floor, &wall));
        grain.material = floor.material;
        grain.position.y = 1 + (0.5 + k % PHASES) / PHASES * speed * scene.time_step;
        assert_ok(dem2d_world_add_particle(world, &grain, &id));
        do {
            double safe, limit;
            assert_ok(dem2d_world_step(world, 1, NULL));
            assert_ok(dem2d_world_get_particle(world, id, &now));
            assert_ok(dem2d_world_time_step_bounds(world, &safe, &limit, NULL));
            if (now.force.y > 0) /* the pass found them in contact */
                assert_within(scene.time_step, parts[k / PHASES] * safe, 1e-9L * safe);
        } while (!(now.velocity.y > 0 && now.pose.position.y > 1));
        const double back = now.velocity.y / speed * (now.velocity.y / speed);
        assert_true(back > (1 - q) * (1 - 1e-6) && back < (1 + 1e-6) / (1 - q));
        dem2d_world_destroy(world);
        dem2d_shape_destroy(disc);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_wall_has_a_closed_form),
        cmocka_unit_test(a_pair_has_a_closed_form),
        cmocka_unit_test(flat_grains_keep_their_energy),
        cmocka_unit_test(opening_contacts_err_by_the_square),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
