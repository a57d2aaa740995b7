/* The full law against closed forms: dashpots by restitution, rolling friction, a caller's law; and
   the ledger of energies, which has to close. */
#include "dem2d.h"
#include "testing.h"
#include "row_law.h"
#include "snapshot_scenes.h"
#include "world_scene.h"

#include <float.h>

#define KN 1e7

static scene make_scene(dem2d_world_desc desc, dem2d_material_desc material) {
    if (!(desc.contact_tolerance > 0)) desc.contact_tolerance = 1e-13;
    return open_scene(&desc, &material);
}

/* Takes the shape. */
static dem2d_particle_id add_free(const scene *s, dem2d_shape *shape, dem2d_vec at, double angle,
                                  dem2d_vec velocity, double spin) {
    return add_shape(s, shape, DEM2D_FREE, at, angle, velocity, spin);
}

/* --- dashpot --------------------------------------------------------------------------------- */

/* The motion of a mass with a clipped spring and dashpot, integrated in steps of 1e-5 of its time
   by Runge and Kutta's method: what comes out over what goes in. */
static double restitution_by_integration(double zeta) {
    double x = 0, v = 1, h = 1e-4;
    for (;;) {
        double k1v = -x - 2 * zeta * v, xm = x + h / 2 * v, vm = v + h / 2 * k1v;
        double k2v = -xm - 2 * zeta * vm, xn = x + h / 2 * vm, vn = v + h / 2 * k2v;
        double k3v = -xn - 2 * zeta * vn, xe = x + h * vn, ve = v + h * k3v;
        double k4v = -xe - 2 * zeta * ve;
        if (x + 2 * zeta * v <= 0) return -v; /* no more force: it leaves */
        x += h / 6 * (v + 2 * vm + 2 * vn + ve);
        v += h / 6 * (k1v + 2 * k2v + 2 * k3v + k4v);
    }
}

static void test_damping_ratio(void **state) {
    (void)state;
    const double values[] = {0.02, 0.1, 0.1353352832366127, 0.3, 0.5, 0.7, 0.9, 0.999};
    for (int i = 0; i < COUNT_OF(values); i++) {
        double zeta;
        assert_ok(dem2d_damping_ratio(values[i], &zeta));
        assert_within(restitution_by_integration(zeta), values[i], 2e-4);
    }
    double zeta = -1;
    assert_ok(dem2d_damping_ratio(1, &zeta));
    assert_true(zeta == 0);
    assert_ok(dem2d_damping_ratio(exp(-2), &zeta));
    assert_near(zeta, 1, 1e-7); /* e^-2 is the limit of both branches */
    zeta = 7;
    assert_result(dem2d_damping_ratio(0, &zeta), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_damping_ratio(1.5, &zeta), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_damping_ratio((double)NAN, &zeta), DEM2D_NOT_FINITE);
    assert_result(dem2d_damping_ratio(0.5, NULL), DEM2D_NULL_ARGUMENT);
    assert_true(zeta == 7);
}

enum { DISCS, DISC_WALL, BOX_WALL, OVALS, IMPACTS };

/* Head on, at 1 m/s; the speed of parting over that of meeting. */
static double bounce(int kind, double restitution, double steps) {
    dem2d_world_desc desc = {0};
    dem2d_material_desc material = stone_desc(KN, 0.3);
    const double half = 0.05;
    const bool wall = kind == DISC_WALL || kind == BOX_WALL;
    const double area = kind == BOX_WALL ? 4 * half * half : (double)TEST_PI * half * half;
    const double mass = 2700 * area / (wall ? 1 : 2);
    const double stiffness = kind == BOX_WALL ? 2 * KN : KN; /* at both corners */
    assert_ok(dem2d_damping_ratio(restitution, &material.damping_ratio));
    desc.time_step = (double)TEST_PI * sqrt(mass / stiffness) / steps;
    /* each corner's dashpot is that of the whole mass on one spring: sqrt 2 times too strong */
    if (kind == BOX_WALL) material.damping_ratio /= sqrt(2);
    scene s = make_scene(desc, material);
    dem2d_particle_id b = {0, 0}, a;
    if (wall)
        add_plane(&s, 0, 0, 0, 1);
    else
        b = add_free(&s, kind == DISCS ? make_disc(half) : make_ellipse(0.08, half), vec(0, -half),
                     0, vec(0, 0), 0);
    if (kind == OVALS)
        a = add_free(&s, make_ellipse(0.08, half), vec(0, half + 1e-4), 0, vec(0, -1), 0);
    else
        a = add_free(&s, kind == BOX_WALL ? make_box(2 * half, 2 * half) : make_disc(half),
                     vec(0, half + 1e-4), 0, vec(0, -1), 0);
    assert_ok(dem2d_world_step(s.world, (int)(4 * steps), NULL));
    double parting = grain_of(&s, a).velocity.y;
    if (!wall) parting -= grain_of(&s, b).velocity.y;
    if (kind == OVALS) assert_within(grain_of(&s, a).angular_velocity, 0, 1e-9);
    dem2d_world_destroy(s.world);
    return parting;
}

static void test_restitution(void **state) {
    (void)state;
    const double values[] = {0.1, 0.3, 0.5, 0.7, 0.9};
    for (int kind = 0; kind < IMPACTS; kind++)
        for (int i = 0; i < COUNT_OF(values); i++) {
            assert_within(bounce(kind, values[i], 100), values[i], 0.012);
            assert_within(bounce(kind, values[i], 1000), values[i], 0.0012);
        }
}

/* --- rolling --------------------------------------------------------------------------------- */

/* A disc on an incline b (by gravity): it stays for tan b < mu_r, else it rolls down with the
   moment of the limit: a = 2/3 g (sin b - mu_r cos b). */
static void test_rolling(void **state) {
    (void)state;
    const double radius = 0.05, mu_r = 0.1, slopes[] = {0.05, 0.3};
    for (int i = 0; i < 2; i++) {
        dem2d_world_desc desc = {0};
        dem2d_material_desc material = stone_desc(KN, 0.8);
        material.rolling_friction = mu_r;
        desc.time_step = 2e-5;
        desc.gravity = vec(9.81 * sin(slopes[i]), -9.81 * cos(slopes[i]));
        desc.ledger = true;
        scene s = make_scene(desc, material);
        const double mass = 2700 * (double)TEST_PI * radius * radius;
        add_plane(&s, 0, 0, 0, 1);
        dem2d_particle_id id =
            add_free(&s, make_disc(radius), vec(0, radius - mass * 9.81 * cos(slopes[i]) / KN), 0,
                     vec(0, 0), 0);
        const double time = 1.5; /* long against the swing of the tangential spring */
        assert_ok(dem2d_world_step(s.world, (int)(time / desc.time_step), NULL));
        const double way = grain_of(&s, id).pose.position.x;
        if (i == 0)
            assert_within(way, 0, 1e-4 * radius);
        else
            assert_near(way, 9.81 * (sin(slopes[1]) - mu_r * cos(slopes[1])) / 3 * time * time,
                        2e-3);
        dem2d_contact_info c;
        int count;
        assert_ok(dem2d_world_contacts(s.world, &c, 1, &count));
        assert_int_equal(count, 1);
        if (i == 1) assert_near(fabs(c.moment), mu_r * radius * c.normal_force, 1e-9);
        dem2d_energy e;
        dem2d_equilibrium rest;
        assert_ok(dem2d_world_energy(s.world, &e));
        assert_ok(dem2d_world_equilibrium(s.world, &rest));
        assert_true(e.rolling > 1e-3 * e.normal);
        assert_near(rest.kinetic_ratio,
                    (e.translational + e.rotational) / (e.normal + e.tangential + e.rolling),
                    1e-14);
        dem2d_ledger ledger = ledger_of(&s);
        assert_within(ledger.closure, 0, 1e-3 * fmax(ledger.gravity, ledger.tangential));
        if (i == 1) assert_true(ledger.friction > 0.2 * ledger.gravity);
        dem2d_world_destroy(s.world);
    }
}

/* --- a caller's law -------------------------------------------------------------------------- */

typedef struct law_calls {
    int calls;
    double greatest;
    double dashpot; /* over the mass, 1/s: may pull */
    double bad;
} law_calls;

/* The built-in law once more; with a dashpot that is not clipped. */
static void same_law_row(void *user, const row_in *in, row_out *out) {
    law_calls *seen = user;
    const double limit = in->pair.friction * in->pair.normal_stiffness * in->depth;
    seen->calls++;
    seen->greatest = fmax(seen->greatest, in->depth);
    if (!(in->depth > 0) || in->state[0] != out->state[0]) seen->bad = 1;
    out->normal_force =
        in->pair.normal_stiffness * in->depth + seen->dashpot * in->mass * in->approach;
    out->tangential_force =
        in->tangential_force - in->pair.tangential_stiffness * in->sliding * in->time_step;
    out->tangential_force = fmax(-limit, fmin(limit, out->tangential_force));
    out->energy = in->pair.normal_stiffness * in->depth * in->depth / 2;
    if (in->pair.tangential_stiffness > 0)
        out->energy +=
            out->tangential_force * out->tangential_force / (2 * in->pair.tangential_stiffness);
    out->state[0] = in->state[0] + 1;
}

static void same_law(void *user, dem2d_law_batch *batch) {
    for_rows(user, batch, same_law_row);
}

/* Grains of three kinds in a box; the last of them are the last added. */
static void fill(const scene *s, int count, double speed) {
    uint64_t random = 11;
    for (int i = 0; i < count; i++) {
        const dem2d_vec at = vec(0.06 + 0.12 * (i % 4), 0.06 + 0.12 * (i / 4));
        const dem2d_vec v =
            vec(random_between(&random, -speed, speed), random_between(&random, -speed, speed));
        dem2d_shape *shape = i % 3 == 0   ? make_disc(0.04)
                             : i % 3 == 1 ? make_ellipse(0.055, 0.03)
                                          : NULL;
        if (shape == NULL) {
            const double a[4] = {0.09, 0, 0, 0.003}, b[4] = {0, 0, 0, 0};
            assert_ok(dem2d_shape_create_fourier(NULL, a, b, 3, &shape));
        }
        add_free(s, shape, at, i, v, random_between(&random, -speed, speed) / 0.05);
    }
    add_plane(s, 0, 0, 0, 1), add_plane(s, 0, 0, 1, 0);
    add_plane(s, 0.48, 0, -1, 0), add_plane(s, 0, 0.48, 0, -1);
}

/* Writes one number that is not finite, into the array of this number; -1: none. */
static void unsound_law(void *user, dem2d_law_batch *b) {
    double *arrays[6];
    dem2d_law_builtin(b);
    arrays[0] = b->normal_force, arrays[1] = b->tangential_force, arrays[2] = b->moment;
    arrays[3] = b->viscous_normal, arrays[4] = b->viscous_tangential;
    arrays[5] = b->viscous_moment;
    if (*(const int *)user >= 0) arrays[*(const int *)user][0] = NAN;
}

/* The step is refused at once, and the next is as if nothing had been: with one point and two, and
   of circles. */
static void test_unsound_law(void **state) {
    (void)state;
    for (int kind = 0; kind < 3; kind++) {
        int which = -1;
        dem2d_world_desc desc = {0};
        desc.time_step = 2e-5, desc.gravity.y = -9.81;
        desc.faces = kind == 0 ? DEM2D_ONE_POINT : DEM2D_TWO_POINTS;
        desc.law = unsound_law, desc.law_user = &which;
        scene s = make_scene(desc, stone_desc(KN / 2, 0.3));
        add_floor(&s);
        if (kind < 2) {
            add_free(&s, make_box(0.2, 0.1), vec(0.5, 0.0499), 0, vec(0, 0), 0);
        } else {
            add_free(&s, make_disc(0.1), vec(0.5, 0.5), 0, vec(0, 0), 0);
            add_free(&s, make_disc(0.1), vec(0.6999, 0.5), 0, vec(0, 0), 0);
        }
        assert_ok(dem2d_world_step(s.world, 2, NULL));
        for (int k = 0; k < 6; k++) {
            const uint64_t hash = dem2d_world_hash(s.world);
            which = k;
            assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_STATE);
            assert_true(dem2d_world_hash(s.world) == hash);
            which = -1;
            assert_ok(dem2d_world_step(s.world, 1, NULL));
        }
        dem2d_world_destroy(s.world);
    }
}

/* The same grains by the built-in law and by the caller's copy of it. */
static void test_callers_law(void **state) {
    (void)state;
    scene s[2];
    law_calls seen = {0};
    for (int k = 0; k < 2; k++) {
        dem2d_world_desc desc = {0};
        desc.time_step = 2e-5, desc.gravity.y = -9.81, desc.ledger = true;
        desc.faces = DEM2D_ONE_POINT;
        if (k == 1) desc.law = same_law, desc.law_user = &seen;
        s[k] = make_scene(desc, stone_desc(KN / 2, 0.3));
        fill(&s[k], 16, 1);
        assert_ok(dem2d_world_step(s[k].world, 2000, NULL));
    }
    assert_true(seen.calls > 1000 && seen.greatest > 0 && seen.bad == 0);
    dem2d_particle_id ids[16];
    int count;
    assert_ok(dem2d_world_particles(s[0].world, ids, 16, &count));
    for (int i = 0; i < count; i++) {
        const dem2d_particle_info a = grain_of(&s[0], ids[i]), b = grain_of(&s[1], ids[i]);
        assert_within(a.pose.position.x, b.pose.position.x, 1e-9);
        assert_within(a.pose.position.y, b.pose.position.y, 1e-9);
    }
    const dem2d_ledger a = ledger_of(&s[0]), b = ledger_of(&s[1]);
    assert_near(b.friction, a.friction, 1e-6);
    assert_within(b.closure, 0, 1e-3 * b.given);
    for (int k = 0; k < 2; k++) dem2d_world_destroy(s[k].world);
}

/* --- the built-in law as a caller's ---------------------------------------------------------- */

typedef struct law_count {
    int rows, contacts, points; /* of them second points */
    double bad;
} law_count;

/* Forgets nothing, and counts. */
static void builtin_law(void *user, dem2d_law_batch *b) {
    law_count *seen = user;
    for (int k = 0; k < b->count; k++) {
        const bool second = b->point[k] > 0;
        seen->rows++, seen->points += second, seen->contacts += !second;
        if (b->normal_force[k] != 0 || b->tangential_force[k] != 0 || b->moment[k] != 0)
            seen->bad = 1;
        if (second && (k == 0 || b->a[k].index != b->a[k - 1].index)) seen->bad = 2;
        if (!(b->weight[k] >= 0 && fabs(b->sign[k]) == 1 && b->stiffness[k] > 0)) seen->bad = 3;
        if ((b->b[k].generation > 0) == (b->wall[k].generation > 0)) seen->bad = 4;
    }
    dem2d_law_builtin(b);
}

/* The same by own arithmetic, without tangential dashpots. */
static void own_builtin_law(void *user, dem2d_law_batch *b) {
    (void)user;
    for (int k = 0; k < b->count; k++) {
        const dem2d_pair_desc *pair = b->pair[k];
        const double kn = pair->normal_stiffness * b->weight[k];
        const double kt = pair->tangential_stiffness * b->weight[k], spring = kn * b->depth[k];
        const double dashpot =
            b->mass[k] > 0 ? 2 * pair->damping_ratio * sqrt(b->mass[k] * pair->normal_stiffness)
                           : 0;
        const double force = spring + b->weight[k] * dashpot * b->approach[k];
        b->normal_force[k] = force > 0 ? force : 0;
        const double limit = pair->friction * b->normal_force[k];
        const double shear = b->last_tangential[k] - kt * b->sliding[k] * b->time_step;
        b->tangential_force[k] = fmax(-limit, fmin(limit, shear));
    }
    for (int k = 0; k < b->count; k++) {
        const dem2d_pair_desc *pair = b->pair[k];
        const bool two = k + 1 < b->count && b->point[k + 1] == 1;
        const double force = two ? b->normal_force[k] + b->normal_force[k + 1] : b->normal_force[k];
        const double kr = pair->tangential_stiffness * b->radius[k] * b->radius[k];
        const double limit = pair->rolling_friction * b->radius[k] * force;
        const double moment = b->last_moment[k] - kr * b->spin[k] * b->time_step;
        b->moment[k] = fmax(-limit, fmin(limit, moment));
        k += two;
    }
}

/* Dashpots by their ratios, of which the normal one has `normal` times some; rolling friction. */
static void set_terms(const snapshot_scene *s, double normal, double tangential, double rolling,
                      double rolling_friction) {
    const dem2d_material_id ids[2] = {s->stone, s->rubber};
    for (int i = 0; i < 2; i++)
        for (int j = i; j < 2; j++) {
            dem2d_pair_desc pair = {.normal_stiffness = 1e6 / (1 + i + j),
                                    .tangential_stiffness = 7e5 / (1 + i + j),
                                    .friction = 0.5,
                                    .damping_ratio = normal * (0.1 + 0.2 * i + 0.1 * j),
                                    .rolling_friction = rolling_friction,
                                    .tangential_damping_ratio = tangential * (1 + j),
                                    .rolling_damping_ratio = rolling * (1 + i)};
            assert_ok(dem2d_world_set_pair(s->world, ids[i], ids[j], &pair));
        }
}

static bool same_world(const snapshot_scene *a, const snapshot_scene *b, int count) {
    for (int i = 0; i < count; i++) {
        dem2d_particle_info p, q;
        const dem2d_particle_id id = {(uint32_t)i, 1};
        assert_ok(dem2d_world_get_particle(a->world, id, &p));
        assert_ok(dem2d_world_get_particle(b->world, id, &q));
        if (!(p.pose.position.x == q.pose.position.x && p.pose.position.y == q.pose.position.y &&
              p.velocity.x == q.velocity.x && p.velocity.y == q.velocity.y &&
              p.angular_velocity == q.angular_velocity && p.torque == q.torque))
            return false;
    }
    for (int i = 0; i < SCENE_WALLS; i++) {
        dem2d_wall_info p, q;
        assert_ok(dem2d_world_get_wall(a->world, a->walls[i], &p));
        assert_ok(dem2d_world_get_wall(b->world, b->walls[i], &q));
        if (!(p.force.x == q.force.x && p.force.y == q.force.y && p.point.y == q.point.y))
            return false;
    }
    return true;
}

/* The same bits for circles, other shapes, two points, walls, servo walls and joints; and each
   contact is in one call of a step. */
static void test_builtin_law(void **state) {
    (void)state;
    enum { GRAINS = 40 };
    static const int kinds[] = {SCENE_CIRCLES, SCENE_RUBBING, SCENE_MIXED, SCENE_GJK,
                                SCENE_DASHED,  SCENE_FULL,    SCENE_CHAIN};
    for (int i = 0; i < COUNT_OF(kinds); i++)
        for (int way = 0; way < 3; way++) { /* springs; all dashpots; own arithmetic */
            snapshot_scene s[2];
            law_count seen = {0};
            int points = 0;
            for (int k = 0; k < 2; k++) {
                dem2d_world_desc desc = scene_desc(kinds[i]);
                if (k == 1) desc.law = way == 2 ? own_builtin_law : builtin_law;
                if (k == 1) desc.law_user = &seen;
                scene_make(&s[k], kinds[i], GRAINS, &desc);
                if (way > 0) set_terms(&s[k], 1, way == 1 ? 0.2 : 0, way == 1 ? 0.1 : 0, 0.0625);
            }
            for (int step = 0; step < 400; step++) {
                dem2d_stats stats;
                memset(&seen, 0, sizeof seen);
                for (int k = 0; k < 2; k++) assert_ok(dem2d_world_step(s[k].world, 1, NULL));
                assert_ok(dem2d_world_stats(s[1].world, &stats));
                assert_true(seen.bad == 0);
                if (way < 2) assert_int_equal(seen.contacts, stats.contacts + stats.wall_contacts);
                assert_true(same_world(&s[0], &s[1], GRAINS));
                points += seen.points;
            }
            const bool flat =
                kinds[i] == SCENE_MIXED || kinds[i] == SCENE_FULL || kinds[i] == SCENE_CHAIN;
            assert_true(way == 2 || (points > 0) == flat);
            for (int k = 0; k < 2; k++) dem2d_world_destroy(s[k].world);
        }
}

/* --- a law that does without parts of its batch ---------------------------------------------- */

typedef struct law_parts {
    int omits;
    double bad, states; /* states: greatest */
} law_parts;

/* The built-in law of what is there. Where there is a state it counts the steps of each contact. */
static void partial_law(void *user, dem2d_law_batch *b) {
    law_parts *seen = user;
    const bool ids = !(seen->omits & DEM2D_LAW_IDS), state = !(seen->omits & DEM2D_LAW_STATE);
    const bool dashpots = !(seen->omits & DEM2D_LAW_DASHPOTS);
    const bool rolling = !(seen->omits & DEM2D_LAW_ROLLING);
    if ((b->a != NULL) != ids || (b->b != NULL) != ids || (b->wall != NULL) != ids) seen->bad = 1;
    if ((b->mass != NULL) != dashpots || (b->dashpot != NULL) != dashpots ||
        (b->tangential_dashpot != NULL) != dashpots || (b->viscous_normal != NULL) != dashpots ||
        (b->viscous_tangential != NULL) != dashpots)
        seen->bad = 2;
    if ((b->spin != NULL) != rolling || (b->last_moment != NULL) != rolling ||
        (b->rolling_stiffness != NULL) != rolling || (b->rolling_friction != NULL) != rolling ||
        (b->moment != NULL) != rolling)
        seen->bad = 3;
    if ((b->rolling_dashpot != NULL) != (rolling && dashpots) ||
        (b->viscous_moment != NULL) != (rolling && dashpots))
        seen->bad = 4;
    if ((b->state != NULL) != state) seen->bad = 5;
    for (int k = 0; k < b->count; k++) {
        if (ids && (b->b[k].generation > 0) == (b->wall[k].generation > 0)) seen->bad = 6;
        if (!(b->radius[k] > 0)) seen->bad = 7;
        if (state) seen->states = fmax(seen->states, b->state[k][0] += 1);
    }
    dem2d_law_builtin(b);
}

static bool same_contacts(const dem2d_world *a, const dem2d_world *b) {
    enum { MOST = 400 };
    static dem2d_contact_info one[MOST], other[MOST];
    int count, others;
    assert_ok(dem2d_world_contacts(a, one, MOST, &count));
    assert_ok(dem2d_world_contacts(b, other, MOST, &others));
    if (count != others || count > MOST) return false;
    for (int i = 0; i < count; i++)
        if (one[i].normal_force != other[i].normal_force || one[i].moment != other[i].moment ||
            one[i].tangential_force != other[i].tangential_force ||
            one[i].point.x != other[i].point.x || one[i].point.y != other[i].point.y)
            return false;
    return true;
}

/* Goes on in a copy from a snapshot: to the same hash. */
static void check_copy(snapshot_scene *s, law_parts *seen) {
    scene_bytes bytes = scene_save(s->world);
    dem2d_custom_desc custom;
    dem2d_load_desc load = scene_load_desc(&bytes, &custom);
    dem2d_world *copy;
    dem2d_world_desc desc;
    load.law = partial_law, load.law_user = seen, load.law_tag = SCENE_LAW_TAG;
    assert_ok(dem2d_world_load(&load, NULL, &copy));
    assert_ok(dem2d_world_get_desc(copy, &desc));
    assert_int_equal(desc.law_omits, seen->omits);
    for (int k = 0; k < 2; k++) assert_ok(dem2d_world_step(k == 0 ? s->world : copy, 20, NULL));
    assert_true(dem2d_world_hash(copy) == dem2d_world_hash(s->world));
    dem2d_world_destroy(copy);
    free(bytes.bytes);
}

/* A law that omits parts is the built-in law without them, whatever the materials have: the same
   bits for circles, other shapes, two points, walls, servo walls and joints. */
static void test_omitted_parts(void **state) {
    (void)state;
    enum { GRAINS = 40, STEPS = 150 };
    static const int kinds[] = {SCENE_CIRCLES, SCENE_MIXED, SCENE_GJK, SCENE_FULL, SCENE_CHAIN};
    static const int omitted[] = {1, 2, 4, 8, 6, 9, 14, 15};
    for (int i = 0; i < COUNT_OF(kinds); i++)
        for (int j = 0; j < COUNT_OF(omitted); j++) {
            snapshot_scene s[2];
            law_parts seen = {omitted[j], 0, 0};
            for (int k = 0; k < 2; k++) {
                dem2d_world_desc desc = scene_desc(kinds[i]);
                const bool dashpots = k == 1 || !(omitted[j] & DEM2D_LAW_DASHPOTS);
                const bool rolling = k == 1 || !(omitted[j] & DEM2D_LAW_ROLLING);
                if (k == 1) {
                    desc.law = partial_law, desc.law_user = &seen;
                    desc.law_tag = SCENE_LAW_TAG, desc.law_omits = omitted[j];
                }
                scene_make(&s[k], kinds[i], GRAINS, &desc);
                set_terms(&s[k], dashpots, dashpots ? 0.2 : 0, dashpots && rolling ? 0.1 : 0,
                          rolling ? 0.0625 : 0);
            }
            for (int step = 0; step < STEPS; step++) {
                for (int k = 0; k < 2; k++) assert_ok(dem2d_world_step(s[k].world, 1, NULL));
                assert_true(same_world(&s[0], &s[1], GRAINS));
            }
            assert_true(same_contacts(s[0].world, s[1].world));
            check_copy(&s[1], &seen);
            assert_true(seen.bad == 0);
            assert_true((seen.states > 10) == !(omitted[j] & DEM2D_LAW_STATE));
            for (int k = 0; k < 2; k++) dem2d_world_destroy(s[k].world);
        }
}

/* Parts that there are not, and parts of no law. */
static void test_omitted_wrongly(void **state) {
    (void)state;
    test_env env;
    test_env_init(&env);
    const int wrong[] = {-1, 16, 1};
    for (int i = 0; i < COUNT_OF(wrong); i++) {
        dem2d_world_desc desc = {0};
        dem2d_world *world = NULL;
        law_parts seen = {0, 0, 0};
        desc.time_step = 1e-5, desc.env = &env.env, desc.law_omits = wrong[i];
        if (i < 2) desc.law = partial_law, desc.law_user = &seen;
        assert_result(dem2d_world_create(&desc, &world), DEM2D_OUT_OF_RANGE);
        assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "law_omits");
        assert_true(world == NULL);
    }
}

/* A dashpot that may pull: e = exp(-pi zeta/s) at any speed. */
static void test_tension(void **state) {
    (void)state;
    const double zeta = 0.2, half = 0.05;
    const double mass = 2700 * (double)TEST_PI * half * half, w0 = sqrt(KN / mass);
    law_calls seen = {0};
    seen.dashpot = 2 * zeta * w0;
    dem2d_world_desc desc = {0};
    desc.time_step = (double)TEST_PI / w0 / 1000, desc.law = same_law, desc.law_user = &seen;
    scene s = make_scene(desc, stone_desc(0, 0));
    add_plane(&s, 0, 0, 0, 1);
    dem2d_particle_id id = add_free(&s, make_disc(half), vec(0, half + 1e-4), 0, vec(0, -1), 0);
    assert_ok(dem2d_world_step(s.world, 3000, NULL));
    const double expected = exp(-(double)TEST_PI * zeta / sqrt(1 - zeta * zeta));
    assert_within(grain_of(&s, id).velocity.y, expected, 1e-3);
    dem2d_world_destroy(s.world);
}

/* --- ledger ---------------------------------------------------------------------------------- */

/* Greatest error of the ledger of a gas without friction, of the energy put in. */
static double gas_error(double steps) {
    dem2d_world_desc desc = {0};
    const double mass = 2700 * (double)TEST_PI * 0.04 * 0.04 / 2;
    desc.time_step = (double)TEST_PI * sqrt(mass / KN) / steps, desc.ledger = true;
    scene s = make_scene(desc, stone_desc(0, 0));
    fill(&s, 16, 1);
    double worst = 0;
    for (int i = 0; i < 200; i++) {
        assert_ok(dem2d_world_step(s.world, (int)steps / 2, NULL));
        const dem2d_ledger ledger = ledger_of(&s);
        worst = fmax(worst, fabs(ledger.closure) / ledger.given);
        assert_true(ledger.friction == 0 && ledger.dashpot == 0);
        assert_within(ledger.damping, 0, 1e-10 * ledger.given); /* rounding of forces */
    }
    dem2d_world_destroy(s.world);
    return worst;
}

/* Nothing is dissipated: the ledger is the energy of the grains, and its error that of the time
   step, of second order. */
static void test_ledger_order(void **state) {
    (void)state;
    const double coarse = gas_error(100), fine = gas_error(1000);
    print_message("t_c/100: %.2g, t_c/1000: %.2g\n", coarse, fine);
    assert_true(coarse < 1e-3);
    assert_true(fine < 1e-6 && fine < coarse / 50);
}

typedef struct account {
    const char *name;
    double friction, local, global, ratio, rolling;
} account;

/* All accounts by turns, with walls that push, until the grains are nearly at rest. */
static void test_ledger_closes(void **state) {
    (void)state;
    static const account accounts[] = {
        {"springs", 0, 0, 0, 0, 0},     {"friction", 0.4, 0, 0, 0, 0},
        {"local", 0.4, 0.5, 0, 0, 0},   {"global", 0.4, 0, 5, 0, 0},
        {"dashpot", 0.4, 0, 0, 0.3, 0}, {"rolling", 0.4, 0, 0, 0.1, 0.2},
    };
    for (int i = 0; i < COUNT_OF(accounts); i++) {
        const account *a = &accounts[i];
        dem2d_world_desc desc = {0};
        dem2d_material_desc material = stone_desc(KN / 2, a->friction);
        material.damping_ratio = a->ratio, material.rolling_friction = a->rolling;
        desc.time_step = 5e-6, desc.ledger = true;
        desc.gravity.y = -9.81;
        desc.local_damping = a->local, desc.global_damping = a->global;
        scene s = make_scene(desc, material);
        fill(&s, 16, 1);
        dem2d_wall_desc moving = {0};
        moving.material = s.material, moving.mode = DEM2D_WALL_MOVING;
        moving.normal = vec(0, -1), moving.velocity = vec(0, -0.3), moving.point = vec(0, 0.48);
        const dem2d_wall_id top = {3, 1};
        assert_ok(dem2d_world_set_wall(s.world, top, &moving));
        assert_ok(dem2d_world_step(s.world, (int)(0.2 / desc.time_step), NULL));
        const dem2d_ledger l = ledger_of(&s);
        const double put = fabs(l.given) + fabs(l.gravity) + fabs(l.walls);
        print_message("%-9s closure %.2g of %.3g; friction %.3g dashpot %.3g damping %.3g "
                      "walls %.3g\n",
                      a->name, l.closure / put, put, l.friction, l.dashpot, l.damping, l.walls);
        assert_within(l.closure, 0, 1e-3 * put);
        assert_true((l.friction > 1e-3 * put) == (a->friction > 0));
        assert_true((l.dashpot > 1e-3 * put) == (a->ratio > 0));
        assert_true((l.damping > 1e-3 * put) == (a->local > 0 || a->global > 0));
        assert_true(l.walls > 0 && l.gravity != 0);
        dem2d_world_destroy(s.world);
    }
}

/* Speeds, particles and laws changed by hand are booked as given, to the first order of a step. */
static void test_ledger_edits(void **state) {
    (void)state;
    dem2d_world_desc desc = {0};
    desc.time_step = 1e-5, desc.ledger = true;
    scene s = make_scene(desc, stone_desc(0, 0));
    dem2d_particle_id id = add_free(&s, make_disc(0.05), vec(0, 0), 0, vec(1, 0), 0);
    assert_ok(dem2d_world_step(s.world, 10, NULL));
    const double mass = grain_of(&s, id).mass;
    assert_near(ledger_of(&s).given, mass / 2, 1e-12);
    assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_FREE, vec(3, 0), 0));
    assert_ok(dem2d_world_step(s.world, 2, NULL));
    assert_near(ledger_of(&s).given, 9 * mass / 2, 1e-12);
    assert_within(ledger_of(&s).closure, 0, 1e-12 * mass);
    dem2d_particle_id other = add_free(&s, make_disc(0.05), vec(5, 5), 0, vec(2, 0), 0);
    assert_ok(dem2d_world_step(s.world, 2, NULL));
    assert_near(ledger_of(&s).given, (9 + 4) * mass / 2, 1e-12);
    assert_ok(dem2d_world_remove_particle(s.world, other));
    assert_ok(dem2d_world_step(s.world, 2, NULL));
    assert_near(ledger_of(&s).given, 9 * mass / 2, 1e-12);
    /* a driven disc pushes another: what it does is work */
    assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_DRIVEN, vec(1, 0), 0));
    const double x = grain_of(&s, id).pose.position.x;
    add_free(&s, make_disc(0.05), vec(x + 0.1001, 0), 0, vec(0, 0), 0);
    assert_ok(dem2d_world_step(s.world, 2000, NULL));
    dem2d_ledger l = ledger_of(&s);
    assert_near(l.kinetic, 4 * mass / 2, 1e-3); /* thrown off at twice the speed */
    assert_near(l.driven, 4 * mass / 2, 1e-3);
    assert_within(l.closure, 0, 1e-3 * l.driven);
    assert_result(dem2d_world_ledger(s.world, NULL), DEM2D_NULL_ARGUMENT);
    dem2d_world_destroy(s.world);
    desc.ledger = false;
    s = make_scene(desc, stone_desc(0, 0));
    l.closure = 7;
    assert_result(dem2d_world_ledger(s.world, &l), DEM2D_OUT_OF_RANGE);
    assert_true(l.closure == 7);
    dem2d_world_destroy(s.world);
}

/* The full law on and off while contacts are closed: springs stay. */
static void test_law_changes(void **state) {
    (void)state;
    dem2d_world_desc desc = {0};
    desc.time_step = 2e-5, desc.gravity = vec(1, -9.81), desc.local_damping = 0.5;
    scene s = make_scene(desc, stone_desc(KN / 2, 0.6));
    add_plane(&s, 0, 0, 0, 1);
    dem2d_particle_id low = add_free(&s, make_disc(0.05), vec(0, 0.05), 0, vec(0, 0), 0);
    add_free(&s, make_disc(0.05), vec(0.1, 0.05), 0, vec(0, 0), 0);
    add_free(&s, make_disc(0.05), vec(0.05, 0.05 + 0.0866), 0, vec(0, 0), 0);
    dem2d_wall_desc side = {0};
    side.material = s.material, side.point = vec(0.15, 0), side.normal = vec(-1, 0);
    dem2d_wall_id id;
    assert_ok(dem2d_world_add_wall(s.world, &side, &id));
    assert_ok(dem2d_world_step(s.world, 40000, NULL));
    dem2d_pair_desc law = {0};
    law.normal_stiffness = KN, law.tangential_stiffness = KN / 2, law.friction = 0.6;
    const dem2d_particle_info rest = grain_of(&s, low);
    assert_true(fabs(rest.torque) < 1e-6 && fabs(rest.velocity.x) < 1e-9);
    for (int k = 0; k < 4; k++) {
        law.damping_ratio = k % 2 == 0 ? 0.1 : 0;
        assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &law));
        assert_ok(dem2d_world_step(s.world, 2000, NULL));
        assert_within(grain_of(&s, low).pose.position.x, rest.pose.position.x, 1e-9 * 0.05);
        assert_within(grain_of(&s, low).force.y, rest.force.y, 1e-6 * rest.mass);
    }
    dem2d_world_destroy(s.world);
}

/* A dashpot asks for shorter steps: at the safe bound a stiff one still comes to rest. */
static void test_damped_time_step(void **state) {
    (void)state;
    dem2d_world_desc desc = {0};
    dem2d_material_desc material = stone_desc(0, 0);
    material.damping_ratio = 2;
    desc.time_step = 1e-6, desc.gravity.y = -9.81;
    for (int k = 0; k < 2; k++) {
        double safe, limit;
        scene s = make_scene(desc, material);
        add_plane(&s, 0, 0, 0, 1);
        dem2d_particle_id id = add_free(&s, make_disc(0.05), vec(0, 0.05 - 1e-6), 0, vec(0, 0), 0);
        assert_ok(dem2d_world_step(s.world, 1, NULL));
        assert_ok(dem2d_world_time_step_bounds(s.world, &safe, &limit, NULL));
        const double w0 = sqrt(KN / grain_of(&s, id).mass);
        assert_near(limit, 2 / w0, 1e-12);
        assert_near(safe, 2 / w0 * (sqrt(1 + 4) - 2), 1e-12);
        assert_ok(dem2d_world_set_time_step(s.world, (k == 0 ? 0.98 : 1.05) * safe));
        dem2d_stats stats;
        double fastest = 0;
        for (int i = 0; i < 4000; i++) {
            assert_ok(dem2d_world_step(s.world, 1, NULL));
            if (i > 3000) fastest = fmax(fastest, fabs(grain_of(&s, id).velocity.y));
        }
        assert_ok(dem2d_world_stats(s.world, &stats));
        assert_true((stats.slow_time_step > 0) == (k == 1));
        assert_true((fastest < 1e-9) == (k == 0));
        dem2d_world_destroy(s.world);
    }
}

/* --- circles in batches and one by one
 * ------------------------------------------------------------
 */

enum { PILE = 60 };

/* Circles of two sizes and two materials rub and roll in a box; some lie on each other at the
   start. Far away a circle is held that touches nothing, whose material may have a dashpot. With
   a caller's law circles go through the law by rows instead of the kernel for circles. */
static scene pile_make(dem2d_law_fn *law, double far_dashpot, dem2d_particle_id ids[PILE]) {
    dem2d_world_desc desc = {0};
    desc.law = law;
    desc.time_step = 1e-5, desc.gravity = vec(0.5, -9.81), desc.local_damping = 0.05;
    scene s = make_scene(desc, stone_desc(0.8 * KN, 0.4));
    dem2d_material_desc other = stone_desc(0.5 * KN, 0.9), far = stone_desc(0, 0);
    dem2d_material_id materials[2];
    dem2d_particle_desc grain = {0};
    dem2d_particle_id id;
    dem2d_shape *disc = make_disc(0.05);
    other.normal_stiffness = KN / 3, far.damping_ratio = far_dashpot;
    materials[0] = s.material;
    assert_ok(dem2d_world_add_material(s.world, &other, &materials[1]));
    assert_ok(dem2d_world_add_shape(s.world, disc, &grain.shape));
    dem2d_shape_destroy(disc);
    add_plane(&s, 0, 0, 0.1, 1), add_plane(&s, 0, 0, 1, 0), add_plane(&s, 1, 0, -1, 0);
    uint64_t random = 7;
    for (int i = 0; i < PILE; i++) {
        grain.scale = i % 2 == 0 ? 1 : 0.7, grain.material = materials[i % 3 == 0];
        grain.position = vec(0.06 + 0.097 * (i % 10), 0.2 + 0.097 * (double)(i / 10));
        grain.velocity = vec(random_between(&random, -1, 1), random_between(&random, -1, 1));
        grain.angular_velocity = random_between(&random, -30, 30);
        assert_ok(dem2d_world_add_particle(s.world, &grain, &ids[i]));
    }
    grain.position = vec(0, 50), grain.velocity = vec(0, 0), grain.angular_velocity = 0;
    grain.motion = DEM2D_FIXED;
    assert_ok(dem2d_world_add_material(s.world, &far, &grain.material));
    assert_ok(dem2d_world_add_particle(s.world, &grain, &id));
    return s;
}

static bool same_vec(dem2d_vec a, dem2d_vec b) {
    return a.x == b.x && a.y == b.y;
}

static bool same_particle(const scene *a, const scene *b, dem2d_particle_id id) {
    const dem2d_particle_info one = grain_of(a, id), other = grain_of(b, id);
    return same_vec(one.pose.position, other.pose.position) &&
           same_vec(one.velocity, other.velocity) && same_vec(one.force, other.force) &&
           one.angular_velocity == other.angular_velocity && one.torque == other.torque;
}

static int count_different_contacts(const scene *a, const scene *b) {
    dem2d_contact_info one[8 * PILE], other[8 * PILE];
    int count, others, different = 0;
    assert_ok(dem2d_world_contacts(a->world, one, COUNT_OF(one), &count));
    assert_ok(dem2d_world_contacts(b->world, other, COUNT_OF(other), &others));
    assert_int_equal(count, others);
    assert_true(count <= COUNT_OF(one));
    for (int i = 0; i < count; i++)
        different +=
            !(same_vec(one[i].normal, other[i].normal) && same_vec(one[i].point, other[i].point) &&
              same_vec(one[i].branch, other[i].branch) && one[i].depth == other[i].depth &&
              one[i].normal_force == other[i].normal_force &&
              one[i].tangential_force == other[i].tangential_force);
    return different;
}

static void plain_law(void *user, dem2d_law_batch *batch) {
    (void)user;
    dem2d_law_builtin(batch);
}

/* The kernel for circles leaves out arms along the tangent: it must not change a bit. */
static void test_circles_two_ways(void **state) {
    (void)state;
    enum { WAYS = 3 };
    dem2d_particle_id ids[PILE];
    const scene s[WAYS] = {pile_make(NULL, 0, ids), pile_make(NULL, 0.3, ids),
                           pile_make(plain_law, 0, ids)};
    for (int i = 0; i < 300; i++) {
        for (int k = 0; k < WAYS; k++) {
            if (i == 100) /* another velocity than that of the step that was made */
                assert_ok(
                    dem2d_world_drive_particle(s[k].world, ids[11], DEM2D_FREE, vec(2, 3), 50));
            assert_ok(dem2d_world_step(s[k].world, i < 10 ? 1 : 20, NULL));
        }
        for (int k = 1; k < WAYS; k++) {
            for (int j = 0; j < PILE; j++) assert_true(same_particle(&s[0], &s[k], ids[j]));
            assert_int_equal(count_different_contacts(&s[0], &s[k]), 0);
        }
    }
    for (int k = 0; k < WAYS; k++) dem2d_world_destroy(s[k].world);
}

/* Two circles with a spring so stiff that the step would throw them to infinity: it is refused. */
static void test_infinite_circles(void **state) {
    (void)state;
    for (int i = 0; i < 2; i++) {
        dem2d_world_desc desc = {0};
        dem2d_material_desc material = stone_desc(0, 0);
        material.normal_stiffness = 1e304, material.density = 1e-5, material.damping_ratio = i;
        desc.time_step = 1, desc.skip_time_step_check = true;
        scene s = make_scene(desc, material);
        add_free(&s, make_disc(1), vec(0, 0), 0, vec(0, 0), 0);
        const dem2d_particle_id id = add_free(&s, make_disc(1), vec(1, 0), 0, vec(0, 0), 0);
        assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_STATE);
        assert_true(grain_of(&s, id).pose.position.x == 1 && grain_of(&s, id).velocity.x == 0);
        dem2d_world_destroy(s.world);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_damping_ratio),    cmocka_unit_test(test_restitution),
        cmocka_unit_test(test_rolling),          cmocka_unit_test(test_callers_law),
        cmocka_unit_test(test_unsound_law),      cmocka_unit_test(test_builtin_law),
        cmocka_unit_test(test_omitted_parts),    cmocka_unit_test(test_omitted_wrongly),
        cmocka_unit_test(test_tension),          cmocka_unit_test(test_ledger_order),
        cmocka_unit_test(test_ledger_closes),    cmocka_unit_test(test_ledger_edits),
        cmocka_unit_test(test_law_changes),      cmocka_unit_test(test_damped_time_step),
        cmocka_unit_test(test_circles_two_ways), cmocka_unit_test(test_infinite_circles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
