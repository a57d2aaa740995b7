/* Overlaps of new particles: how deep one would be, and moving them apart without speed. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"
#include "inside.h"

#define RADIUS 0.05
#define KN 1e7 /* of stone_desc */

static scene make_scene(dem2d_vec gravity) {
    const dem2d_material_desc material = stone_desc(5e5, 0.3);
    dem2d_world_desc desc = {0};
    desc.time_step = 1e-4, desc.gravity = gravity, desc.ledger = true;
    return open_scene(&desc, &material);
}

static dem2d_shape *make_kind(int kind) {
    const double a[4] = {0.09, 0, 0, 0.003}, b[4] = {0, 0, 0, 0};
    const double reach[4] = {0.05, 0.03, 0.04, 0.06};
    if (kind == 0) return make_disc(RADIUS);
    if (kind == 1) return make_ellipse(0.06, 0.03);
    if (kind == 2) return make_box(0.09, 0.06);
    if (kind == 3) return make_series(a, b, 3);
    return make_oval(reach, 0.5522847498);
}

static dem2d_relaxation relax(const scene *s, double tolerance, int sweeps) {
    dem2d_relaxation done;
    assert_ok(dem2d_world_relax(s->world, tolerance, sweeps, &done));
    assert_true(inside_holds(s->world));
    return done;
}

static double fastest(const scene *s) {
    dem2d_equilibrium equilibrium;
    assert_ok(dem2d_world_equilibrium(s->world, &equilibrium));
    return equilibrium.max_speed;
}

static void test_overlap_at(void **state) {
    (void)state;
    scene s = make_scene(vec(0, 0));
    const dem2d_shape_id disc = give_shape(&s, make_disc(RADIUS));
    dem2d_particle_desc desc = grain_desc(&s, disc, 1, vec(0, 0));
    double overlap = -1;
    assert_ok(dem2d_world_overlap_at(s.world, &desc, &overlap)); /* an empty world */
    assert_true(overlap == 0);
    desc.groups.category = 2;
    add_grain(&s, &desc);
    add_plane(&s, 0, -1, 0, 1);
    add_segment(&s, vec(1, -1), vec(1, 1));
    desc.groups.category = 0;
    const struct {
        dem2d_vec at;
        double scale, overlap;
    } cases[] = {{{0, 0.02}, 1, 0.08},     {{0.3, 0}, 1, 0}, {{0.3, -0.98}, 1, 0.03},
                 {{0.99, 0.5}, 1, 0.04},   {{0, 0}, 1, 0.1}, {{0.3, -3}, 1, 2.05},
                 {{0.9, -0.95}, 2.4, 0.07}};
    for (int i = 0; i < COUNT_OF(cases); i++) {
        desc.position = cases[i].at, desc.scale = cases[i].scale;
        assert_ok(dem2d_world_overlap_at(s.world, &desc, &overlap));
        assert_within(overlap, cases[i].overlap, 1e-12);
    }
    desc.position = vec(0, 0.02), desc.scale = 1, desc.groups.mask = 1; /* does not meet it */
    assert_ok(dem2d_world_overlap_at(s.world, &desc, &overlap));
    assert_true(overlap == 0);
    desc.groups.mask = 0, desc.groups.sensor = true;
    assert_ok(dem2d_world_overlap_at(s.world, &desc, &overlap));
    assert_true(overlap == 0);
    close_scene(&s);
}

/* One disc 80 % in another leaves at 12 m/s; relaxed, both stay. */
static void test_two(void **state) {
    (void)state;
    double speed[2];
    for (int k = 0; k < 2; k++) {
        scene s = make_scene(vec(0, 0));
        const dem2d_shape_id disc = give_shape(&s, make_disc(RADIUS));
        dem2d_particle_desc desc = grain_desc(&s, disc, 1, vec(0, 0));
        const dem2d_particle_id one = add_grain(&s, &desc);
        desc.position = vec(0.02, 0), desc.angle = 1;
        const dem2d_particle_id two = add_grain(&s, &desc);
        if (k == 1) {
            const dem2d_relaxation done = relax(&s, 1e-3, 100);
            assert_int_equal(done.overlaps, 0);
            assert_int_equal(done.moved, 2);
            assert_int_equal(done.sweeps, 1);
            const double gap =
                grain_of(&s, two).pose.position.x - grain_of(&s, one).pose.position.x;
            assert_between(gap, 2 * RADIUS * (1 - 1e-3), 2 * RADIUS);
            assert_near(angle_of(&s, two), 1, 1e-14);
        }
        step(&s, 1000);
        speed[k] = grain_of(&s, two).velocity.x;
        /* the one contact opens between two steps: the ledger misses its spring's energy at the
           last of them, at most that of the way of one step, at the speed at which they part */
        const dem2d_ledger ledger = ledger_of(&s);
        const double way = (speed[k] - grain_of(&s, one).velocity.x) * 1e-4;
        assert_within(ledger.closure, 0, KN * way * way / 2 + 1e-12 * ledger.turnover);
        assert_near(ledger.given, k == 0 ? KN * 0.08 * 0.08 / 2 : KN * 2.5e-5 * 2.5e-5 / 2, 1e-6);
        close_scene(&s);
    }
    assert_true(speed[0] > 10);
    assert_between(speed[1], 0, 0.02 * speed[0]);
}

/* A spring that is pressed already: what a relaxation takes out of it is given back to the caller,
   to rounding, as no contact opens in a step. */
static void test_ledger(void **state) {
    (void)state;
    scene s = make_scene(vec(0, 0));
    const dem2d_shape_id disc = give_shape(&s, make_disc(RADIUS));
    dem2d_particle_desc desc = grain_desc(&s, disc, 1, vec(0, 0));
    add_grain(&s, &desc);
    desc.position.x = 0.08;
    add_grain(&s, &desc);
    step(&s, 3);
    const double stored = energy_of(&s).normal, closure = ledger_of(&s).closure;
    const double given = ledger_of(&s).given, turnover = ledger_of(&s).turnover;
    assert_near(stored, KN * 0.02 * 0.02 / 2, 0.1);
    const dem2d_relaxation done = relax(&s, 0.05, 50);
    assert_int_equal(done.moved, 2);
    step(&s, 1);
    const double change = energy_of(&s).normal - stored;
    assert_between(change / stored, -1, -0.99);
    assert_near(ledger_of(&s).given - given, change, 5e-2); /* but for the work of a step, 3 % */
    assert_within(ledger_of(&s).closure, closure, 1e-12 * turnover);
    close_scene(&s);
}

/* A one-sided wall pushes to its left alone: what is nearer to its right neither overlaps nor is
   moved, what is nearer to its left is both. A wall of two sides has both. */
static void test_one_sided(void **state) {
    (void)state;
    for (int one_sided = 0; one_sided < 2; one_sided++) {
        scene s = make_scene(vec(0, 0));
        const dem2d_vec points[3] = {{-1, 0}, {0, 0}, {1, 0.001}};
        const dem2d_shape_id shapes[2] = {give_shape(&s, make_disc(RADIUS)),
                                          give_shape(&s, make_box(0.1, 0.1))};
        dem2d_wall_desc wall = plane_desc(&s, vec(0, 0), vec(0, 0));
        wall.points = points, wall.count = 3, wall.one_sided = one_sided == 1;
        add_wall(&s, &wall);
        for (int k = 0; k < 4; k++) {
            const double y = k % 2 ? -0.02 : 0.02;
            dem2d_particle_desc desc = grain_desc(&s, shapes[k / 2], 1, vec(-0.3 * (k + 1), y));
            double overlap;
            desc.position.x = -0.2 * (k + 1);
            assert_ok(dem2d_world_overlap_at(s.world, &desc, &overlap));
            assert_within(overlap, k % 2 && one_sided ? 0 : 0.03, 1e-9);
            add_grain(&s, &desc);
        }
        const dem2d_relaxation done = relax(&s, 1e-3, 100);
        assert_int_equal(done.overlaps, 0);
        assert_int_equal(done.moved, one_sided ? 2 : 4);
        step(&s, 100);
        /* the step agrees about who touches the wall: by half of the tolerance, 2.5e-5 (kn/m)^(1/2)
           = 0.02 m/s at most, with two points 0.03; 20 m/s if it did not */
        assert_true(fastest(&s) < 0.05);
        close_scene(&s);
    }
}

/* A hundred grains of each kind at random places in a box that has room for them. */
static void test_hundred(void **state) {
    (void)state;
    for (int kind = 0; kind < 6; kind++) {
        scene s = make_scene(vec(0, 0));
        uint64_t random = 11;
        dem2d_shape_id shapes[5];
        for (int k = 0; k < 5; k++) shapes[k] = give_shape(&s, make_kind(k));
        add_plane(&s, 0, 0, 0, 1), add_plane(&s, 0, 0, 1, 0), add_plane(&s, 1.3, 0, -1, 0);
        add_plane(&s, 0, 1.3, 0, -1);
        for (int i = 0; i < 100; i++) {
            const double x = random_between(&random, 0.4, 0.9);
            dem2d_particle_desc desc = grain_desc(&s, shapes[kind < 5 ? kind : i % 5], 1,
                                                  vec(x, random_between(&random, 0.1, 0.6)));
            desc.angle = i;
            add_grain(&s, &desc);
        }
        const dem2d_relaxation done = relax(&s, 1e-3, 4000);
        assert_int_equal(done.overlaps, 0);
        assert_true(done.overlap <= 1e-3 * 0.0671);
        step(&s, 200);
        assert_true(fastest(&s) < 0.1);
        assert_true(packing_of(&s).max_overlap < 0.02);
        close_scene(&s);
    }
}

/* New grains in a settled bed under a servo wall: what did not move keeps its springs. */
static void test_bed(void **state) {
    (void)state;
    scene s = make_scene(vec(0, -9.81));
    const dem2d_shape_id disc = give_shape(&s, make_disc(RADIUS));
    add_floor(&s);
    const dem2d_wall_id left = add_plane(&s, 0, 0, 1, 0), right = add_plane(&s, 0.52, 0, -1, 0);
    dem2d_wall_desc lid = plane_desc(&s, vec(0, 0.6), vec(0, -1));
    lid.mode = DEM2D_WALL_SERVO, lid.stress = 1000, lid.max_speed = 0.5;
    lid.spans[0] = left, lid.spans[1] = right;
    const dem2d_wall_id top = add_wall(&s, &lid);
    assert_ok(dem2d_world_set_damping(s.world, 0.5, 0));
    dem2d_particle_desc desc = grain_desc(&s, disc, 1, vec(0, 0));
    for (int i = 0; i < 20; i++) {
        desc.position = vec(0.06 + 0.1 * (i % 5) + 0.004 * (i / 5 % 2), 0.05 + 0.1 * (i / 5));
        add_grain(&s, &desc);
    }
    step(&s, 15000);
    const dem2d_relaxation none = relax(&s, 0.01, 100); /* nothing to do */
    assert_int_equal(none.moved + none.sweeps + none.overlaps, 0);
    const int before = stats_of(&s).contacts;
    desc.position = vec(0.25, wall_of(&s, top).point.y - 0.02), desc.scale = 0.4;
    const dem2d_particle_id added = add_grain(&s, &desc);
    double overlap;
    assert_ok(dem2d_world_overlap_at(s.world, &desc, &overlap));
    assert_true(overlap > 0.005);
    const dem2d_relaxation done = relax(&s, 0.01, 5000);
    assert_int_equal(done.overlaps, 0);
    assert_true(done.moved < 21 || stats_of(&s).contacts < before);
    assert_true(grain_of(&s, added).pose.position.y < wall_of(&s, top).point.y);
    step(&s, 20000);
    assert_true(packing_of(&s).max_overlap < 0.01);
    assert_near(wall_of(&s, top).stress, 1000, 0.02);
    close_scene(&s);
}

/* No room: what remains is told, and no speed comes of it; fixed ones do not move. */
static void test_jammed(void **state) {
    (void)state;
    scene s = make_scene(vec(0, 0));
    const dem2d_shape_id disc = give_shape(&s, make_disc(RADIUS));
    add_plane(&s, 0, 0, 0, 1), add_plane(&s, 0, 0, 1, 0), add_plane(&s, 0.15, 0, -1, 0);
    add_plane(&s, 0, 0.15, 0, -1);
    dem2d_particle_desc desc = grain_desc(&s, disc, 1, vec(0.075, 0.075));
    for (int i = 0; i < 5; i++) add_grain(&s, &desc); /* at the same place */
    dem2d_relaxation done = relax(&s, 0.01, 300);
    assert_int_equal(done.sweeps, 300);
    assert_true(done.overlaps > 0 && done.overlap > 0.01);
    for (uint32_t i = 0; i < 5; i++) {
        const dem2d_particle_id id = {i, 1};
        const dem2d_vec at = grain_of(&s, id).pose.position;
        assert_between(at.x, 0, 0.15);
        assert_between(at.y, 0, 0.15);
        assert_true(grain_of(&s, id).velocity.x == 0 && grain_of(&s, id).velocity.y == 0);
    }
    done = relax(&s, 0.01, 0); /* asks only */
    assert_true(done.sweeps == 0 && done.moved == 0 && done.overlaps > 0);
    close_scene(&s);

    s = make_scene(vec(0, 0));
    const dem2d_shape_id other = give_shape(&s, make_disc(RADIUS));
    const dem2d_particle_id fixed =
        add_copy(&s, dem2d_world_shape(s.world, other), DEM2D_FIXED, vec(0, 0), 0, vec(0, 0), 0);
    const dem2d_particle_id free_one =
        add_copy(&s, dem2d_world_shape(s.world, other), DEM2D_FREE, vec(0, 0.03), 0, vec(0, 0), 0);
    done = relax(&s, 1e-3, 10);
    assert_int_equal(done.overlaps, 0);
    assert_true(grain_of(&s, fixed).pose.position.y == 0);
    assert_near(grain_of(&s, free_one).pose.position.y, 2 * RADIUS, 1e-3);
    close_scene(&s);
}

/* --- in a periodic cell ------------------------------------------------------------------------
 */

enum { CROWD = 40 };

typedef struct crowd {
    scene s;
    dem2d_particle_id ids[CROWD];
} crowd;

/* At random places; with `discs` all of radius RADIUS, else of five kinds. The cell begins at
   origin, and the particles are given from there on. */
static crowd make_crowd(dem2d_vec a, dem2d_vec b, dem2d_vec origin, bool discs) {
    const dem2d_material_desc material = stone_desc(5e5, 0.3);
    dem2d_world_desc desc = {0};
    dem2d_shape_id shapes[5];
    crowd c;
    uint64_t random = 11;
    desc.time_step = 1e-5, desc.cell.a = a, desc.cell.b = b, desc.cell.origin = origin;
    c.s = open_scene(&desc, &material);
    for (int kind = 0; kind < 5; kind++) shapes[kind] = give_shape(&c.s, make_kind(kind));
    for (int i = 0; i < CROWD; i++) {
        const double x = random_between(&random, 0, 0.75), y = random_between(&random, 0, 0.75);
        dem2d_particle_desc grain = grain_desc(&c.s, shapes[discs ? 0 : i % 5], 1, vec(x, y));
        grain.angle = random_between(&random, 0, 6);
        c.ids[i] = add_grain(&c.s, &grain);
    }
    return c;
}

/* Least distance of discs, of all images from -2 to 2 cells away. */
static double least_distance(const crowd *c, dem2d_vec a, dem2d_vec b) {
    double least = 1e9;
    for (int i = 0; i < CROWD; i++)
        for (int j = i; j < CROWD; j++)
            for (int k = 0; k < 25; k++) {
                const dem2d_vec p = grain_of(&c->s, c->ids[i]).pose.position;
                const dem2d_vec q = grain_of(&c->s, c->ids[j]).pose.position;
                const int m = k % 5 - 2, n = k / 5 - 2;
                if ((i == j && m == 0 && n == 0) || (n != 0 && !(b.y > 0))) continue;
                least = fmin(least, hypot(q.x - p.x + m * a.x + n * b.x, q.y - p.y + n * b.y));
            }
    return least;
}

/* Discs come apart from all images; so do grains of all kinds, which then stay at rest; the same
   wherever the border is, and between walls. */
static void test_cell(void **state) {
    (void)state;
    static const dem2d_vec cells[3][2] = {{{1, 0}, {0, 1}}, {{1, 0}, {1.75, 1}}, {{1, 0}, {0, 0}}};
    for (int k = 0; k < 3; k++) {
        const dem2d_vec a = cells[k][0], b = cells[k][1];
        crowd c = make_crowd(a, b, vec(0, 0), true), moved = make_crowd(a, b, vec(0.5, 0.25), true);
        for (int wall = 0; wall < (k == 2 ? 2 : 0); wall++) {
            add_plane(&c.s, 0, wall, 0, 1 - 2 * wall);
            add_plane(&moved.s, 0, wall, 0, 1 - 2 * wall);
        }
        assert_true(least_distance(&c, a, b) < RADIUS); /* half of the discs overlap */
        const dem2d_relaxation done = relax(&c.s, 1e-2, 300), other = relax(&moved.s, 1e-2, 300);
        assert_int_equal(done.overlaps, 0);
        assert_int_equal(other.sweeps, done.sweeps);
        assert_int_equal(other.moved, done.moved);
        assert_between(least_distance(&c, a, b), 2 * RADIUS - 1e-2 * RADIUS, 2 * RADIUS);
        for (int i = 0; i < CROWD; i++) { /* up to cell vectors */
            const dem2d_vec p = grain_of(&c.s, c.ids[i]).pose.position;
            const dem2d_vec q = grain_of(&moved.s, moved.ids[i]).pose.position;
            const double n = k == 2 ? 0 : floor(q.y - p.y + 0.5);
            const double m = floor(q.x - p.x - n * b.x + 0.5);
            assert_within(q.y - p.y - n, 0, 1e-9);
            assert_within(q.x - p.x - n * b.x - m, 0, 1e-9);
            assert_between(p.y, 0, 1);
        }
        step(&c.s, 50);
        assert_true(fastest(&c.s) < 1);
        close_scene(&c.s), close_scene(&moved.s);
        c = make_crowd(a, b, vec(0, 0), false);
        assert_int_equal(relax(&c.s, 1e-2, 300).overlaps, 0);
        step(&c.s, 50);
        assert_true(fastest(&c.s) < 1);
        close_scene(&c.s);
    }
}

/* A grain in a cell below its size can't leave its own images: no move, and they are told, each
   pair once. Without memory for all of them nothing changes. */
static void test_own_images(void **state) {
    (void)state;
    const dem2d_material_desc material = stone_desc(5e5, 0.3);
    dem2d_world_desc desc = {0};
    dem2d_relaxation done = {0};
    test_env env;
    test_env_init(&env);
    desc.time_step = 1e-5, desc.env = &env.env;
    desc.cell.a = vec(0.5 * RADIUS, 0), desc.cell.b = vec(0, 0.5 * RADIUS);
    const scene s = open_scene(&desc, &material);
    add_shape(&s, make_disc(RADIUS), DEM2D_FREE, vec(0, 0), 0, vec(0, 0), 0);
    add_shape(&s, make_disc(RADIUS), DEM2D_FREE, vec(0.12 * RADIUS, 0), 0, vec(0, 0), 0);
    const uint64_t before = dem2d_world_hash(s.world);
    int fails = 0;
    dem2d_result result = DEM2D_OUT_OF_MEMORY;
    for (; result != DEM2D_OK; fails++) {
        test_env_fail(&env, fails + 1);
        result = dem2d_world_relax(s.world, 0.1, 0, &done);
        assert_true(result == DEM2D_OK || result == DEM2D_OUT_OF_MEMORY);
        assert_true(dem2d_world_hash(s.world) == before);
        assert_true(inside_holds(s.world));
    }
    test_env_fail(&env, 0);
    assert_true(fails > 5);
    /* each of the two with half of its images, and the one with all of the other */
    int pairs = 0;
    for (int i = -5; i <= 5; i++)
        for (int j = -5; j <= 5; j++)
            for (int k = 0; k < 2; k++) {
                const double d = hypot(0.5 * i + 0.12 * k, 0.5 * j);
                if (2 - d > 0.1 && (k == 1 || i != 0 || j != 0)) pairs++;
            }
    assert_int_equal(done.overlaps, pairs);
    assert_int_equal(done.moved, 0);
    close_scene(&s);
    assert_clean(&env);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_overlap_at), cmocka_unit_test(test_two),
        cmocka_unit_test(test_hundred),    cmocka_unit_test(test_bed),
        cmocka_unit_test(test_jammed),     cmocka_unit_test(test_ledger),
        cmocka_unit_test(test_one_sided),  cmocka_unit_test(test_cell),
        cmocka_unit_test(test_own_images),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
