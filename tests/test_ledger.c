/* The ledger of energies: its closure in random scenes, at contacts of two points with dashpots, at
   contacts that open; and what springs go by: the mean of the step that was made, whatever has been
   changed since. */
#include "dem2d.h"
#include "testing.h"

#include "ledger_scenes.h"

#define KN 1e7

/* --- random scenes -----------------------------------------------------------------------------
 */

enum { SEEDS = 10 };

/* Median over the seeds of the closure, of the turnover. */
static double median_closure(ledger_class kind, double steps, double contact_times) {
    double closures[SEEDS];
    for (int seed = 0; seed < SEEDS; seed++) {
        const dem2d_ledger l = ledger_scene_run(kind, seed, steps, contact_times);
        assert_true(l.turnover > 0 && l.friction > 0);
        closures[seed] = fabs(l.closure) / l.turnover;
    }
    return middle_of(closures, SEEDS);
}

/* The short form of `make ledger`. */
static void test_random_scenes(void **state) {
    (void)state;
    const double times = test_long() ? 200 : 70;
    for (int kind = 0; kind < LEDGER_CLASSES; kind++) {
        const double most = ledger_most[kind];
        const double coarse = median_closure((ledger_class)kind, 32, times);
        const double fine = median_closure((ledger_class)kind, 64, times);
        print_message("%s: t_c/32 %.2g, t_c/64 %.2g\n", ledger_names[kind], coarse, fine);
        assert_true(coarse <= most);
        if (kind == LEDGER_SMOOTH) assert_true(fine <= most / 4);
    }
}

/* --- scenes of a few ---------------------------------------------------------------------------
 */

static scene make_scene(double time_step, const dem2d_material_desc *material) {
    dem2d_world_desc desc = {0};
    desc.time_step = time_step, desc.ledger = true, desc.contact_tolerance = 1e-13;
    desc.skip_time_step_check = true;
    return open_scene(&desc, material);
}

static dem2d_wall_desc floor_of(const scene *s, dem2d_vec velocity) {
    dem2d_wall_desc desc = {0};
    desc.material = s->material, desc.normal = vec(0, 1);
    desc.mode = DEM2D_WALL_MOVING, desc.velocity = velocity;
    return desc;
}

/* A square that is not quite level falls on a floor: its two corners are damped, each by its own
   speed. Closure of the energy given. */
static double square_closure(double time_step, double damping_ratio) {
    dem2d_material_desc stone = {0};
    stone.density = 2700, stone.normal_stiffness = KN, stone.damping_ratio = damping_ratio;
    const scene s = make_scene(time_step, &stone);
    const dem2d_wall_desc ground = floor_of(&s, vec(0, 0));
    const dem2d_vec corners[4] = {{0, 0}, {0.1, 0}, {0.1, 0.1}, {0, 0.1}};
    dem2d_wall_id id;
    dem2d_shape *square;
    assert_ok(dem2d_world_add_wall(s.world, &ground, &id));
    assert_ok(dem2d_shape_create_polygon(NULL, corners, 4, 0, &square));
    add_shape(&s, square, DEM2D_FREE, vec(0, 0.0501), 0.001, vec(0, -0.5), 0.5);
    assert_ok(dem2d_world_step(s.world, (int)(0.012 / time_step + 0.5), NULL));
    const dem2d_ledger l = ledger_of(&s);
    assert_true(damping_ratio > 0 ? l.dashpot > 0.5 * l.given : l.dashpot == 0);
    dem2d_world_destroy(s.world);
    return fabs(l.closure) / l.given;
}

static void test_two_damped_points(void **state) {
    (void)state;
    for (int k = 0; k < 3; k++) {
        const double coarse = square_closure(4e-5, 0.15 * k), fine = square_closure(5e-6, 0.15 * k);
        print_message("damping ratio %.2g: %.2g, an eighth of the step %.2g\n", 0.15 * k, coarse,
                      fine);
        assert_true(coarse < 3e-4 && fine < 3e-4 / 64);
    }
}

typedef struct outcome {
    double closure; /* mean of its absolute value, of the energy given */
    double spin;    /* of the last one, rad/s */
} outcome;

/* Eight pairs of discs that spin meet and part. Friction, and a dashpot that does nothing but bring
   them to the path of other shapes; rolling friction does something. */
static outcome meet(double time_step, double friction, double rolling, bool full) {
    uint64_t random = 77;
    outcome mean = {0, 0};
    for (int k = 0; k < 8; k++) {
        dem2d_material_desc stone = {0};
        stone.density = 2700, stone.normal_stiffness = KN, stone.tangential_stiffness = 0.7 * KN;
        stone.friction = friction, stone.rolling_friction = rolling;
        if (full) stone.damping_ratio = 1e-300;
        const scene s = make_scene(time_step, &stone);
        dem2d_particle_id id = {0};
        for (int i = 0; i < 2; i++) {
            const double way = i == 0 ? 1 : -1;
            const dem2d_vec at = vec(0.0502 * i + 1e-4 * random_between(&random, 0, 1), 0);
            const dem2d_vec v = vec(way, -way * random_between(&random, 0.5, 1.5));
            id = add_shape(&s, make_disc(0.025), DEM2D_FREE, at, 0, v,
                           random_between(&random, -20, 20));
        }
        assert_ok(dem2d_world_step(s.world, (int)(6e-3 / time_step), NULL));
        const dem2d_ledger l = ledger_of(&s);
        assert_true(l.normal == 0 && l.tangential == 0 && l.friction > 0);
        mean.closure += fabs(l.closure) / l.given / 8;
        mean.spin = grain_of(&s, id).angular_velocity;
        dem2d_world_destroy(s.world);
    }
    return mean;
}

/* The last half step of friction and of rolling friction is booked when a contact opens: of second
   order. Circles under the plain law slide as under the full one. */
static void test_opening(void **state) {
    (void)state;
    static const double frictions[] = {0.05, 0.4, 1e9};
    for (int k = 0; k < COUNT_OF(frictions); k++) {
        const outcome plain = meet(2.5e-5, frictions[k], 0, false);
        const outcome full = meet(2.5e-5, frictions[k], 0, true);
        const outcome rolling = meet(2.5e-5, frictions[k], 0.3, true);
        const double fine = meet(2.5e-5 / 8, frictions[k], 0, false).closure;
        const double fine_rolling = meet(2.5e-5 / 8, frictions[k], 0.3, true).closure;
        print_message("friction %g: %.2g, rolling %.2g; an eighth of the step %.2g, %.2g\n",
                      frictions[k], plain.closure, rolling.closure, fine, fine_rolling);
        assert_true(plain.closure < 2e-4 && rolling.closure < 2e-4);
        assert_true(fine < 2e-4 / 64 && fine_rolling < 2e-4 / 64);
        assert_near(plain.closure, full.closure, 1e-9);
        assert_near(plain.spin, full.spin, 1e-9);
    }
}

/* --- what was done -----------------------------------------------------------------------------
 */

typedef struct buffer {
    char *bytes;
    size_t size, at;
} buffer;

static bool put(void *user, const char *bytes, size_t count) {
    buffer *b = (buffer *)user;
    b->bytes = (char *)realloc(b->bytes, b->size + count);
    memcpy(b->bytes + b->size, bytes, count);
    b->size += count;
    return true;
}

static bool get(void *user, char *bytes, size_t count) {
    buffer *b = (buffer *)user;
    if (b->size - b->at < count) return false;
    memcpy(bytes, b->bytes + b->at, count);
    b->at += count;
    return true;
}

/* The world from its snapshot. */
static void reload(scene *s) {
    buffer b = {NULL, 0, 0};
    dem2d_save_desc save = {0};
    dem2d_load_desc load = {0};
    save.write = put, save.user = &b;
    load.read = get, load.user = &b;
    const uint64_t hash = dem2d_world_hash(s->world);
    assert_ok(dem2d_world_save(s->world, &save, NULL));
    dem2d_world_destroy(s->world);
    assert_ok(dem2d_world_load(&load, NULL, &s->world));
    assert_true(dem2d_world_hash(s->world) == hash);
    free(b.bytes);
}

/* A driven disc on a fixed one or on a wall that moves, of the same kind of contact for the plain
   law and the full one. */
typedef struct driven {
    scene s;
    dem2d_particle_id disc;
    dem2d_wall_id wall; /* generation 0 without */
} driven;

static const double radius = 1, below = 0.7, overlap = 0.1;

/* The disc is so heavy that no force turns it from its way. */
static driven make_driven(bool wall, bool full) {
    driven d;
    dem2d_material_desc stone = {0};
    stone.density = 1e25, stone.normal_stiffness = 1e4, stone.tangential_stiffness = 1e4;
    stone.friction = 1e9, stone.rolling_friction = full ? 1e9 : 0;
    memset(&d, 0, sizeof d);
    d.s = make_scene(1e-3, &stone);
    if (wall) {
        const dem2d_wall_desc belt = floor_of(&d.s, vec(0.1, 0));
        assert_ok(dem2d_world_add_wall(d.s.world, &belt, &d.wall));
    } else {
        add_shape(&d.s, make_disc(below), DEM2D_FIXED, vec(0, -below), 0, vec(0, 0), 0);
    }
    d.disc = add_shape(&d.s, make_disc(radius), DEM2D_FREE, vec(0, radius - overlap), 0,
                       vec(0.2, 0), 1);
    return d;
}

/* Where the disc is against what is below it: from its centre to the other's or to the wall, its
   angle, and where the wall is. */
typedef struct place {
    long double x, y, angle, wall;
} place;

static place place_of(const driven *d) {
    const dem2d_particle_info g = grain_of(&d->s, d->disc);
    place p = {g.pose.position.x, g.pose.position.y, dem2d_rot_angle(g.pose.rotation), 0};
    if (d->wall.generation != 0) {
        dem2d_wall_info w;
        assert_ok(dem2d_world_get_wall(d->s.world, d->wall, &w));
        p.wall = w.point.x;
    }
    return p;
}

/* How far the disc has slid between two places over a fixed disc or a wall, along the normal of the
   contact turned by +90 degrees: mean of both ends. Of A against B it is as of B against A. */
static long double slide_between(const driven *d, place from, place to) {
    const place ends[2] = {from, to};
    long double slide = 0;
    for (int k = 0; k < 2; k++) {
        const place p = ends[k];
        long double nx = 0, ny = 1, arm = p.y; /* out of what is below; centre to contact point */
        if (d->wall.generation == 0) {
            const long double dy = p.y + below, distance = sqrtl(p.x * p.x + dy * dy);
            nx = p.x / distance, ny = dy / distance;
            arm = radius - (radius + below - distance) / 2;
        }
        const long double dx = (to.x - from.x) - (to.wall - from.wall), dy = to.y - from.y;
        slide += (nx * dy - ny * dx - arm * (to.angle - from.angle)) / 2;
    }
    return slide;
}

static void change(driven *d, uint64_t *random) {
    const dem2d_vec v = vec(random_between(random, -0.3, 0.3), random_between(random, -0.05, 0.05));
    const int what = (int)random_between(random, 0, 8);
    if (what == 0)
        assert_ok(dem2d_world_set_time_step(d->s.world, random_between(random, 1e-4, 2e-3)));
    if (what == 1 || what == 2) /* twice: what was done is still the same */
        for (int k = 0; k < what; k++)
            assert_ok(dem2d_world_drive_particle(d->s.world, d->disc, DEM2D_FREE, v,
                                                 random_between(random, -2, 2)));
    if (what == 3 && d->wall.generation != 0) {
        dem2d_wall_info w;
        assert_ok(dem2d_world_get_wall(d->s.world, d->wall, &w));
        dem2d_wall_desc belt = floor_of(&d->s, vec(v.x, 0));
        belt.point = w.point;
        assert_ok(dem2d_world_set_wall(d->s.world, d->wall, &belt));
        assert_ok(dem2d_world_get_wall(d->s.world, d->wall, &w));
        assert_true(w.velocity.x == v.x);
    }
    if (what == 4) reload(&d->s);
}

/* Springs move as the bodies did, whatever has been changed since: sliding as the mean of the step,
   rolling by the turn. */
static void test_step_that_was_made(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        uint64_t random = (uint64_t)kind;
        driven d = make_driven(kind % 2 == 1, kind >= 2);
        place last = place_of(&d);
        dem2d_contact_info before, now;
        int count;
        assert_ok(dem2d_world_step(d.s.world, 1, NULL));
        assert_ok(dem2d_world_contacts(d.s.world, &before, 1, &count));
        for (int i = 0; i < 400; i++) {
            const place at = place_of(&d);
            change(&d, &random);
            if (random_between(&random, 0, 1) < 0.5) change(&d, &random);
            assert_ok(dem2d_world_step(d.s.world, 1, NULL));
            assert_ok(dem2d_world_contacts(d.s.world, &now, 1, &count));
            assert_int_equal(count, 1);
            const long double slide = slide_between(&d, last, at);
            const long double turn = at.angle - last.angle, sum = 1e4L * radius;
            assert_within(now.tangential_force - before.tangential_force, -1e4L * slide,
                          1e-12L * sum);
            if (kind >= 2) {
                const double reduced =
                    d.wall.generation != 0 ? radius : radius * below / (radius + below);
                const double sign = d.wall.generation != 0 ? -1 : 1; /* of B against A */
                assert_within(now.moment - before.moment, -1e4 * reduced * reduced * sign * turn,
                              1e-12L * sum);
            }
            before = now;
            last = at;
        }
        dem2d_world_destroy(d.s.world);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_scenes),
        cmocka_unit_test(test_two_damped_points),
        cmocka_unit_test(test_opening),
        cmocka_unit_test(test_step_that_was_made),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
