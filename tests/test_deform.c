/* A periodic cell that deforms: energy and momentum, the same bits whatever is listed, closed
   forms of the flow, what is refused. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "world_scene.h"

enum { GRAINS = 64 };

#define KN 1000.0 /* of discs of diameter 1 and mass 1 */
#define DT (0.02 / 31.622776601683793)

typedef struct cell {
    scene s;
    int count;
    dem2d_particle_id ids[GRAINS];
} cell;

static dem2d_deformation_desc flow(double xx, double xy, double yy) {
    return (dem2d_deformation_desc){.xx = xx, .xy = xy, .yy = yy};
}

static void deform(const cell *p, dem2d_deformation_desc by) {
    assert_ok(dem2d_world_deform(p->s.world, &by));
}

static dem2d_cell_info cell_of(const cell *p) {
    dem2d_cell_info info;
    assert_ok(dem2d_world_get_cell(p->s.world, &info));
    return info;
}

/* Grains about a lattice in a square cell: discs, or four kinds of shapes. */
static void fill(cell *p, const dem2d_world_desc *desc, const dem2d_material_desc *material,
                 int grains, int kinds, double solid, double speed) {
    static const dem2d_vec box[4] = {{-0.45, -0.4}, {0.45, -0.45}, {0.5, 0.4}, {-0.4, 0.5}};
    static const double a[5] = {0.9, 0, 0.02, 0.01, 0.003}, b[5] = {0, 0, 0, 0.005, 0};
    const double width = sqrt(grains * (double)TEST_PI / 4 / solid);
    const int side = (int)ceil(sqrt(grains));
    dem2d_world_desc made = *desc;
    uint64_t random = 5;
    memset(p, 0, sizeof *p);
    p->count = grains;
    if (!(made.time_step > 0)) made.time_step = DT;
    made.cell.a = vec(width, 0), made.cell.b.y = width, made.cell.origin = vec(0.5, -3);
    p->s = open_scene(&made, material);
    const dem2d_shape_id shapes[4] = {
        give_shape(&p->s, make_disc(0.5)), give_shape(&p->s, make_polygon(box, 4, 0.05)),
        give_shape(&p->s, make_ellipse(0.5, 0.4)), give_shape(&p->s, make_series(a, b, 4))};
    for (int i = 0; i < grains; i++) {
        const double x = (i % side + 0.5 + random_between(&random, 0, 0.1)) / side * width;
        const double y = (i / side + 0.5 + random_between(&random, 0, 0.1)) / side * width;
        dem2d_particle_desc grain = grain_desc(&p->s, shapes[i % kinds], 1, vec(x + 0.5, y - 3));
        grain.scale = random_between(&random, 0.85, 1), grain.angle = random_between(&random, 0, 6);
        grain.velocity.x = random_between(&random, -speed, speed);
        grain.velocity.y = random_between(&random, -speed, speed);
        p->ids[i] = add_grain(&p->s, &grain);
    }
}

static dem2d_material_desc soft_desc(double friction, bool damped) {
    dem2d_material_desc desc = material_desc(4 / (double)TEST_PI, KN, KN / 2, friction);
    if (damped) desc.damping_ratio = desc.tangential_damping_ratio = 0.1;
    if (damped) desc.rolling_friction = 0.05;
    return desc;
}

static dem2d_vec momentum_of(const cell *p, double *size) {
    dem2d_vec sum = vec(0, 0);
    *size = 0;
    for (int i = 0; i < p->count; i++) {
        const dem2d_particle_info info = grain_of(&p->s, p->ids[i]);
        sum.x += info.mass * info.velocity.x, sum.y += info.mass * info.velocity.y;
        *size += info.mass * hypot(info.velocity.x, info.velocity.y);
    }
    return sum;
}

/* --- energy, momentum --------------------------------------------------------------------------- */

/* The work of the cell closes the ledger: the error falls by four when the time step is halved. */
static void test_ledger(void **state) {
    (void)state;
    static const double flows[5][3] = {
        {0, 2, 0}, {-1, 0, 1}, {-1, 0, -1}, {0.5, -1, -1.5}, {0, 2, 0}};
    for (int k = 0; k < 10; k++) {
        double error[3], turnover = 0;
        for (int half = 0; half < 3; half++) {
            static cell p;
            const dem2d_material_desc soft = soft_desc(k < 5 ? 0 : 100, k == 9);
            dem2d_world_desc desc = {0};
            desc.ledger = true, desc.time_step = DT / (1 << half);
            fill(&p, &desc, &soft, 36, 1, 1.15, 0);
            const double *rate_of = flows[k % 5];
            deform(&p, flow(rate_of[0], rate_of[1], rate_of[2]));
            for (int i = 0; i < 40 << half; i++) { /* k = 4: of rates that change */
                const double rate = 2 * cos(i * 0.1 / (1 << half));
                if (k == 4) deform(&p, flow(-rate / 2, rate, rate / 3));
                step(&p.s, 1);
            }
            const dem2d_ledger ledger = ledger_of(&p.s);
            error[half] = ledger.closure, turnover = ledger.turnover;
            assert_true(fabs(ledger.cell) > 1e-2 * turnover);
            close_scene(&p.s);
        }
        print_message("%d: %.3g %.3g %.3g of %g\n", k, error[0], error[1], error[2], turnover);
        assert_between(fabs(error[0]), 0, 1e-3 * turnover);
        assert_between(error[1] / error[2], 3.5, 4.5);
    }
}

/* The momentum of the fluctuations starts at zero and stays there. */
static void test_momentum(void **state) {
    (void)state;
    static cell p;
    const dem2d_material_desc soft = soft_desc(0.4, true);
    const dem2d_world_desc desc = {0};
    fill(&p, &desc, &soft, 64, 4, 0.8, 2);
    double size;
    assert_true(fabs(momentum_of(&p, &size).x) > 1e-3 * size);
    deform(&p, flow(-0.1, 2, 0.1));
    for (int i = 0; i < 20; i++) {
        const dem2d_vec sum = momentum_of(&p, &size);
        assert_within(sum.x, 0, 1e-13 * size);
        assert_within(sum.y, 0, 1e-13 * size);
        step(&p.s, 50);
    }
    close_scene(&p.s);
}

/* --- closed forms ----------------------------------------------------------------------------- */

/* A lattice of one disc that is compressed: p = sqrt(3) f/d, and the volume follows the rule. */
static void test_lattice(void **state) {
    (void)state;
    const double rate = 0.05, h = rate * DT / 2;
    const dem2d_material_desc soft = soft_desc(0, false);
    dem2d_world_desc desc = {0};
    cell p;
    memset(&p, 0, sizeof p);
    desc.time_step = DT, desc.cell.a = vec(0.99, 0), desc.cell.b = vec(0.495, 0.99 * sqrt(0.75));
    p.s = open_scene(&desc, &soft);
    const dem2d_particle_desc grain =
        grain_desc(&p.s, give_shape(&p.s, make_disc(0.5)), 1, vec(0, 0));
    (void)add_grain(&p.s, &grain);
    deform(&p, flow(-rate, 0, -rate));
    for (int i = 1; i <= 1000; i++) {
        const double d = 0.99 * pow((1 - h) / (1 + h), i - 1);
        step(&p.s, 1);
        const dem2d_cell_info info = cell_of(&p);
        assert_near(info.area, d * d * sqrt(0.75), 1e-12);
        assert_near(info.contact.xx, sqrt(3.0) * KN * (1 - d) / d, 1e-10);
        assert_near(info.contact.yy, info.contact.xx, 1e-10);
        assert_within(info.contact.yx, 0, 1e-10 * info.contact.xx);
        assert_near(info.cell.a.x, d * (1 - h) / (1 + h), 1e-12);
    }
    close_scene(&p.s);
}

/* A shear that is taken back: grains without contacts, fluctuations too, are where they were. */
static void test_there_and_back(void **state) {
    (void)state;
    static cell p, q;
    const dem2d_material_desc soft = soft_desc(0, false);
    const dem2d_world_desc desc = {0};
    fill(&p, &desc, &soft, 36, 1, 0.3, 0), fill(&q, &desc, &soft, 36, 1, 0.3, 0);
    deform(&p, flow(0, 10, 0));
    step(&p.s, 30);
    assert_near(cell_of(&p).cell.b.x, 300 * DT * cell_of(&q).cell.b.y, 1e-12);
    deform(&p, flow(0, -10, 0));
    step(&p.s, 30);
    for (int i = 0; i < p.count; i++) {
        const dem2d_particle_info a = grain_of(&p.s, p.ids[i]), b = grain_of(&q.s, q.ids[i]);
        assert_within(a.pose.position.x, b.pose.position.x, 1e-13);
        assert_within(a.pose.position.y, b.pose.position.y, 1e-13);
        assert_true(a.velocity.x == 0 && a.velocity.y == 0);
    }
    close_scene(&p.s), close_scene(&q.s);
}

/* Free flight: c follows dc/dt = -L c, and the position c + L x. */
static void test_free_flight(void **state) {
    (void)state;
    const double xx = 0.7, xy = -1.1, yy = -0.4, time = 1000 * DT;
    const dem2d_material_desc soft = soft_desc(0, false);
    dem2d_world_desc desc = {0};
    cell p;
    memset(&p, 0, sizeof p);
    desc.time_step = DT, desc.cell.a = vec(1000, 0), desc.cell.b = vec(0, 1000);
    const scene s = p.s = open_scene(&desc, &soft);
    const dem2d_shape_id disc = give_shape(&s, make_disc(0.5));
    dem2d_particle_desc grain = grain_desc(&s, disc, 1, vec(500, 200));
    grain.velocity = vec(1, 2);
    const dem2d_particle_id id = add_grain(&s, &grain);
    grain.position = vec(300, 400), grain.velocity = vec(-1, -2);
    (void)add_grain(&s, &grain); /* takes the momentum */
    deform(&p, flow(xx, xy, yy));
    step(&s, 1000);
    const dem2d_particle_info is = grain_of(&s, id);
    const double cy = 2 * exp(-yy * (time - DT / 2)); /* half a step before */
    assert_near(is.velocity.y, cy, 1e-5);
    assert_near(is.pose.position.y, 200 * exp(yy * time) + 2 * sinh(yy * time) / yy, 1e-5);
    const double k = 200 + 1 / yy; /* y = k exp(yy t) - exp(-yy t)/yy */
    const double px = xy * k / (yy - xx), qx = -xy / yy / (-yy - xx);
    /* x'= c_x + xx x + xy y, c_x' = -xx c_x - xy c_y, c_y = 2 exp(-yy t) */
    const double r = -2 * xy / (xx - yy); /* c_x = (1 - r) exp(-xx t) + r exp(-yy t) */
    double x = px * exp(yy * time) + qx * exp(-yy * time);
    x += (1 - r) * exp(-xx * time) / (-2 * xx) + r * exp(-yy * time) / (-yy - xx);
    const double start = px + qx + (1 - r) / (-2 * xx) + r / (-yy - xx);
    x += (500 - start) * exp(xx * time);
    assert_near(is.pose.position.x, x, 1e-5);
    close_scene(&s);
}

/* --- what must not matter --------------------------------------------------------------------- */

static const dem2d_deformation_desc mixed = {.xx = -0.3, .xy = 3, .yy = 0.2};

/* Not the skin, not when the list is made, not threads; b leans over more than once. */
static void test_independent(void **state) {
    (void)state;
    static const double skins[] = {0, 0.01, 0.1, 0.4};
    static cell p[5];
    int threads = 3;
    for (int k = 0; k < COUNT_OF(p); k++) {
        const dem2d_material_desc soft = soft_desc(0.4, true);
        dem2d_world_desc desc = {0};
        int leaned = 0;
        desc.skin = skins[k % 4], desc.event_capacity = 10, desc.ledger = true;
        if (k == 4) desc.parallel_for = run_parts, desc.parallel_user = &threads;
        fill(&p[k], &desc, &soft, 49, 4, 0.8, 1);
        deform(&p[k], mixed);
        for (int i = 0; i < 800; i++) {
            const double lean = cell_of(&p[k]).cell.b.x;
            if (k == 4 && i % 7 == 0) inside_renew_list(p[k].s.world);
            step(&p[k].s, 1);
            leaned += cell_of(&p[k]).cell.b.x < lean;
            if (i % 20 == 0) assert_true(inside_holds(p[k].s.world));
        }
        assert_int_equal(leaned, 2);
        assert_true(dem2d_world_hash(p[k].s.world) == dem2d_world_hash(p[0].s.world));
    }
    assert_true(stats_of(&p[1].s).list_rebuilds > 3 * stats_of(&p[3].s).list_rebuilds);
    for (int k = 0; k < COUNT_OF(p); k++) close_scene(&p[k].s);
}

static void test_snapshots(void **state) {
    (void)state;
    static cell p;
    const dem2d_material_desc soft = soft_desc(0.4, true);
    dem2d_world_desc desc = {0};
    desc.ledger = true;
    fill(&p, &desc, &soft, 49, 4, 0.8, 1);
    deform(&p, mixed);
    for (int i = 0; i < 30; i++) {
        step(&p.s, i);
        if (i % 4 == 0) deform(&p, i % 8 == 0 ? flow(0, 0, 0) : mixed);
        scene_bytes bytes = scene_save(p.s.world);
        const scene other = scene_load(&p.s, &bytes);
        assert_true(inside_holds(other.world));
        assert_true(dem2d_world_hash(p.s.world) == dem2d_world_hash(other.world));
        step(&p.s, 10), step(&other, 10);
        assert_true(dem2d_world_hash(p.s.world) == dem2d_world_hash(other.world));
        assert_true(ledger_of(&p.s).cell == ledger_of(&other).cell);
        close_scene(&other), free(bytes.bytes);
    }
    close_scene(&p.s);
}

/* Another cell of the same lattice moves in the same way. */
static void test_other_cell(void **state) {
    (void)state;
    static cell p[2];
    double most = 0;
    for (int k = 0; k < 2; k++) {
        const dem2d_material_desc soft = soft_desc(0.4, true);
        const dem2d_world_desc plain = {0};
        dem2d_world_desc desc;
        static cell like;
        fill(&like, &plain, &soft, 49, 1, 0.9, 0.5);
        assert_ok(dem2d_world_get_desc(like.s.world, &desc));
        if (k == 1) desc.cell.b.x -= 3 * desc.cell.a.x;
        p[k] = like;
        p[k].s = open_scene(&desc, &soft);
        (void)give_shape(&p[k].s, make_disc(0.5));
        for (int i = 0; i < like.count; i++) {
            dem2d_particle_desc grain;
            assert_ok(dem2d_world_get_particle_desc(like.s.world, like.ids[i], &grain));
            p[k].ids[i] = add_grain(&p[k].s, &grain);
        }
        close_scene(&like.s);
        deform(&p[k], flow(-0.1, 0.3, 0.05));
        step(&p[k].s, 300);
    }
    const dem2d_cell box = cell_of(&p[0]).cell;
    assert_true(stats_of(&p[0].s).contacts > 20);
    for (int i = 0; i < p[0].count; i++) {
        const dem2d_vec a = grain_of(&p[0].s, p[0].ids[i]).pose.position;
        dem2d_vec b = grain_of(&p[1].s, p[1].ids[i]).pose.position;
        const double n = rint((b.y - a.y) / box.b.y);
        b.x -= n * box.b.x, b.y -= n * box.b.y, b.x -= rint((b.x - a.x) / box.a.x) * box.a.x;
        most = fmax(most, hypot(b.x - a.x, b.y - a.y));
    }
    assert_between(most, 0, 1e-12);
    for (int k = 0; k < 2; k++) close_scene(&p[k].s);
}

/* --- what is refused, or fails ------------------------------------------------------------------ */

static void test_memory(void **state) {
    (void)state;
    uint64_t hash = 0;
    int failed = 0;
    for (int call = 0; call < 60; call++) {
        static cell p;
        test_env env;
        test_env_init(&env);
        const dem2d_material_desc soft = soft_desc(0.4, true);
        dem2d_world_desc desc = {0};
        desc.env = &env.env, desc.ledger = true;
        fill(&p, &desc, &soft, 25, 4, 0.8, 1);
        test_env_fail(&env, call);
        const dem2d_result result = dem2d_world_deform(p.s.world, &mixed);
        if (result != DEM2D_OK) assert_ok(dem2d_world_deform(p.s.world, &mixed));
        failed += result != DEM2D_OK;
        failed += test_steps_fail(p.s.world, 300);
        if (call == 0) hash = dem2d_world_hash(p.s.world);
        assert_true(dem2d_world_hash(p.s.world) == hash);
        close_scene(&p.s);
        assert_clean(&env);
    }
    assert_true(failed > 10);
}

static void test_refused(void **state) {
    (void)state;
    static cell p;
    const dem2d_material_desc soft = soft_desc(0.4, false);
    dem2d_world_desc desc = {0};
    test_env env;
    test_env_init(&env);
    desc.env = &env.env;
    fill(&p, &desc, &soft, 4, 1, 0.5, 1);
    const uint64_t hash = dem2d_world_hash(p.s.world);
    const dem2d_deformation_desc fast[4] = {flow(0.11 / DT, 0, 0), flow(0, -0.11 / DT, 0),
                                            flow(0, 0, 0.11 / DT), flow(0, (double)NAN, 0)};
    static const char *const names[4] = {"xx", "xy", "yy", "xy"};
    for (int k = 0; k < 4; k++) {
        const dem2d_result wrong = k == 3 ? DEM2D_NOT_FINITE : DEM2D_OUT_OF_RANGE;
        assert_result(dem2d_world_deform(p.s.world, &fast[k]), wrong);
        assert_logged(&env, wrong, -1, names[k]);
    }
    assert_result(dem2d_world_deform(NULL, &fast[0]), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_deform(p.s.world, NULL), DEM2D_NULL_ARGUMENT);
    assert_true(dem2d_world_hash(p.s.world) == hash);
    deform(&p, flow(0, 0.09 / DT, 0));
    assert_result(dem2d_world_set_time_step(p.s.world, 2 * DT), DEM2D_OUT_OF_RANGE);
    assert_ok(dem2d_world_set_time_step(p.s.world, DT / 2));
    close_scene(&p.s);
    for (int k = 0; k < 3; k++) { /* no cell, along a, along b */
        desc.time_step = DT;
        desc.cell.a = vec(k == 1 ? 5 : 0, 0), desc.cell.b = vec(0, k == 2 ? 5 : 0);
        p.s = open_scene(&desc, &soft);
        assert_result(dem2d_world_deform(p.s.world, &mixed), DEM2D_OUT_OF_RANGE);
        assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "periodic");
        assert_true(cell_of(&p).area == 0);
        close_scene(&p.s);
    }
    assert_clean(&env);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ledger),      cmocka_unit_test(test_momentum),
        cmocka_unit_test(test_lattice),     cmocka_unit_test(test_there_and_back),
        cmocka_unit_test(test_free_flight), cmocka_unit_test(test_independent),
        cmocka_unit_test(test_snapshots),   cmocka_unit_test(test_other_cell),
        cmocka_unit_test(test_memory),      cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests_name("deformation of a periodic cell", tests, NULL, NULL);
}
