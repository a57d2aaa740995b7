/* Joints of segments: the energy of a grain that is led over flat, convex and concave chains, free
   ends, T junctions and crossings is continuous, and the force is its slope; discs against the sum
   over critical points of the distance; slides over chains as over one segment and a half-plane. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"

#define KN 1e7

enum { DISC, ELLIPSE, SERIES, BEZIER, BOX, ROUNDED, SHAPES };
static const char *const names[SHAPES] = {"disc",       "ellipse", "series",
                                          "polybezier", "box",     "rounded box"};

static dem2d_shape *make_kind(int kind) {
    const dem2d_vec corners[4] = {{0, 0}, {0.08, 0}, {0.08, 0.04}, {0, 0.04}};
    const double a[4] = {0.09, 0, 0, 0.003}, b[4] = {0, 0, 0, 0};
    const double reach[4] = {0.06, 0.04, 0.045, 0.03};
    if (kind == DISC) return make_disc(0.05);
    if (kind == ELLIPSE) return make_ellipse(0.06, 0.03);
    if (kind == SERIES) return make_series(a, b, 3);
    if (kind == BEZIER) return make_oval(reach, 0.5522847498);
    if (kind == BOX) return make_box(0.1, 0.06);
    return make_polygon(corners, 4, 0.01);
}

/* Height of a shape's centre at an angle above the level that it touches from above. */
static double height_of(const dem2d_shape *shape, double angle) {
    dem2d_support low;
    assert_ok(dem2d_shape_support(shape, dem2d_pose_make(0, 0, angle, 1), vec(0, -1), &low));
    return low.value;
}

/* --- scenes -----------------------------------------------------------------------------------
   Grains so heavy that no contact changes their motion: they are led. */

static scene led_scene(double friction, double time_step) {
    const dem2d_material_desc material = material_desc(1e30, KN, KN / 2, friction);
    dem2d_world_desc desc = {0};
    desc.time_step = time_step;
    return open_scene(&desc, &material);
}

static scene free_scene(double friction, double damping, bool ledger) {
    dem2d_material_desc material = stone_desc(KN / 2, friction);
    dem2d_world_desc desc = {0};
    material.damping_ratio = damping;
    desc.time_step = 1e-5, desc.gravity = vec(0, -9.81), desc.ledger = ledger;
    return open_scene(&desc, &material);
}

enum { MOST_POINTS = 601 };

typedef struct lines {
    dem2d_vec from[MOST_POINTS], to[MOST_POINTS];
    int count;
} lines;

static void add_line(lines *l, dem2d_vec from, dem2d_vec to) {
    l->from[l->count] = from, l->to[l->count++] = to;
}

/* Two half-lines from the origin, the second one turned by an angle, upwards when above 0. */
static lines kink(double angle) {
    lines l = {.count = 0};
    add_line(&l, vec(-1, 0), vec(0, 0));
    add_line(&l, vec(0, 0), vec(cos(angle), sin(angle)));
    return l;
}

/* Short sides, each turned by the same angle against the one before. */
static lines arc(double angle, double side, int count) {
    lines l = {.count = 0};
    dem2d_vec at = vec(-side * count / 2, 0);
    double way = -angle * (count - 1) / 2;
    for (int i = 0; i < count; i++, way += angle) {
        const dem2d_vec to = vec(at.x + side * cos(way), at.y + side * sin(way));
        add_line(&l, at, to);
        at = to;
    }
    return l;
}

static void add_lines(const scene *s, const lines *l) {
    for (int i = 0; i < l->count; i++)
        if (i % 2)
            add_segment(s, l->to[i], l->from[i]);
        else
            add_segment(s, l->from[i], l->to[i]);
}

/* --- energy along a path ---------------------------------------------------------------------- */

static int failed;

typedef struct path {
    dem2d_vec at, way; /* where it begins; velocity, with time steps of 1 */
    double angle, spin;
    int steps;
} path;

typedef struct swing {
    double most;  /* greatest energy */
    double jump;  /* greatest change of energy that the forces do not explain */
    int contacts; /* greatest number */
    int added;    /* greatest sum of the signs */
} swing;

/* Energy of a grain put somewhere, and the power of its forces on the way. */
static double energy_at(const scene *s, dem2d_particle_id id, const path *p, double when,
                        double *power) {
    const double angle = p->angle + when * p->spin;
    const dem2d_pose pose =
        dem2d_pose_make(p->at.x + when * p->way.x, p->at.y + when * p->way.y, angle, 1);
    expect_ok(dem2d_world_move_particle(s->world, id, pose.position, angle), "place");
    step(s, 1);
    const dem2d_particle_info g = grain_of(s, id);
    *power = g.force.x * p->way.x + g.force.y * p->way.y + g.torque * p->spin;
    return energy_of(s).normal;
}

/* What is left of a change of energy between two places that the forces do not explain, where it is
   most: the interval is halved until it is as good as nothing. */
static double jump_between(const scene *s, dem2d_particle_id id, const path *p, double from,
                           double to, double small) {
    double power[3], energy[3], left[2];
    energy[0] = energy_at(s, id, p, from, &power[0]);
    energy[2] = energy_at(s, id, p, to, &power[2]);
    for (double width = to - from; width > 1e-7; width /= 2) {
        const double middle = from + width / 2;
        energy[1] = energy_at(s, id, p, middle, &power[1]);
        for (int k = 0; k < 2; k++)
            left[k] = fabs(energy[k + 1] - energy[k] + (power[k] + power[k + 1]) / 2 * width / 2);
        if (fmax(left[0], left[1]) < small) return 0;
        if (left[0] > left[1])
            energy[2] = energy[1], power[2] = power[1];
        else
            energy[0] = energy[1], power[0] = power[1], from = middle;
    }
    return fabs(energy[2] - energy[0]);
}

/* Energy and power of the forces at each step. The forces may jump, as where a corner takes over:
   an energy without a jump then differs from their mean, which a closer look resolves. */
static swing lead(const lines *l, int kind, const path *p) {
    scene s = led_scene(0, 1), other = led_scene(0, 1);
    dem2d_contact_info list[64];
    add_lines(&s, l), add_lines(&other, l);
    const dem2d_particle_id id =
        add_shape(&s, make_kind(kind), DEM2D_FREE, p->at, p->angle, p->way, p->spin);
    const dem2d_particle_id put =
        add_shape(&other, make_kind(kind), DEM2D_FREE, p->at, p->angle, vec(0, 0), 0);
    swing w = {0, 0, 0, 0};
    double *left = (double *)calloc((size_t)p->steps, sizeof *left);
    double last = 0, last_power = 0;
    assert_non_null(left);
    for (int i = 0; i < p->steps; i++) {
        step(&s, 1);
        const dem2d_particle_info g = grain_of(&s, id);
        const double energy = energy_of(&s).normal;
        const double power = g.force.x * p->way.x + g.force.y * p->way.y + g.torque * p->spin;
        const int count = contacts_of(&s, list, COUNT_OF(list));
        int added = 0;
        for (int c = 0; c < count && c < COUNT_OF(list); c++) added += list[c].sign;
        if (count > w.contacts) w.contacts = count;
        if (added > w.added) w.added = added;
        if (i > 0) left[i] = fabs(energy - last + (power + last_power) / 2);
        w.most = fmax(w.most, energy);
        last = energy, last_power = power;
    }
    for (int i = 1; i < p->steps; i++)
        if (left[i] > 1e-7 * w.most)
            w.jump = fmax(w.jump, jump_between(&other, put, p, i - 1, i, 1e-8 * w.most));
    free(left);
    close_scene(&s), close_scene(&other);
    return w;
}

/* Does a grain on the way touch anything, with its path moved up? */
static bool touches(const scene *s, dem2d_particle_id id, const path *p, double up) {
    path moved = *p;
    double power;
    moved.at.y += up;
    for (int i = 0; i <= 40; i++)
        if (energy_at(s, id, &moved, i * (p->steps - 1) / 40.0, &power) > 0) return true;
    return false;
}

/* A grain led along x across the origin, at the height where it overlaps by a part of its size at
   most. Energies of smooth grains are continuous. At a sharp corner that passes the end of a face
   the weight of the second contact point is not: the energy of the same box on a polygon with a
   kink of 0.01 jumps by 0.1 at an overlap of 0.05. */
static void check_lead(const lines *l, int kind, double tilt, double overlap, double turned,
                       const char *what) {
    const double sharp = overlap > 0.01 ? 3e-4 : 2e-6;
    const double allowed = kind == BOX ? sharp : kind == ROUNDED ? 1e-6 : 1e-7;
    const int steps = test_long() ? 2000 : 500;
    path p = {.at = vec(-0.07, 0),
              .way = vec(0.14 / steps, 0),
              .angle = tilt - turned / 2,
              .spin = turned / steps,
              .steps = steps};
    scene s = led_scene(0, 1);
    add_lines(&s, l);
    const dem2d_particle_id id =
        add_shape(&s, make_kind(kind), DEM2D_FREE, vec(0, 0), 0, vec(0, 0), 0);
    double low = 0, high = 0.3;
    for (int i = 0; i < 30; i++)
        *(touches(&s, id, &p, (low + high) / 2) ? &low : &high) = (low + high) / 2;
    close_scene(&s);
    p.at.y = low - overlap * 0.05;
    const swing w = lead(l, kind, &p);
    if (w.most > 0 && w.jump <= allowed * w.most) return;
    print_error("%s: %s, tilt %g, overlap %g, turned %g: jump %.3g of %.3g\n", what, names[kind],
                tilt, overlap, turned, w.jump / w.most, w.most);
    failed++;
}

/* Kinks of all sizes, seen from above: convex for angles below 0. */
static void test_kinks(void **state) {
    static const double angles[] = {0, 0.01, 0.02, 0.1, 0.5, -0.01, -0.02, -0.1, -0.5};
    static const double overlaps[] = {1e-4, 3e-3, 0.05};
    (void)state;
    for (int a = 0; a < COUNT_OF(angles); a++) {
        const lines l = kink(angles[a]);
        for (int kind = 0; kind < SHAPES; kind++)
            for (int o = 0; o < COUNT_OF(overlaps); o++)
                for (int tilt = -1; tilt <= 1; tilt++) {
                    const double turn = tilt * 0.004;
                    check_lead(&l, kind, turn, overlaps[o], 0, "kink");
                    check_lead(&l, kind, angles[a] / 2, overlaps[o], turn, "kink, turned");
                }
    }
    assert_int_equal(failed, 0);
}

/* Many short sides under one grain. */
static void test_arcs(void **state) {
    static const double angles[] = {0, 0.01, 0.1, -0.01, -0.1};
    (void)state;
    for (int a = 0; a < COUNT_OF(angles); a++)
        for (int count = 7; count <= 60; count += 53) {
            const lines l = arc(angles[a] / (count == 60 ? 8 : 1), 0.35 / count, count);
            for (int kind = 0; kind < SHAPES; kind++)
                for (int o = 0; o < 2; o++)
                    check_lead(&l, kind, 0.003, o == 0 ? 1e-3 : 0.02, 0.01, "arc");
        }
    assert_int_equal(failed, 0);
}

/* A free end, a T from below, a third side at a joint, a crossing, a spike. */
static void test_junctions(void **state) {
    enum { FREE, TEE, TEE_AT_JOINT, CROSSING, SPIKE, FORK, JUNCTIONS };
    static const char *const what[] = {"free end", "T",     "T at a joint",
                                       "crossing", "spike", "fork"};
    (void)state;
    for (int j = 0; j < JUNCTIONS; j++) {
        lines l = {.count = 0};
        if (j == FREE) add_line(&l, vec(-1, 0), vec(0, 0));
        if (j == TEE || j == CROSSING) add_line(&l, vec(-1, 0), vec(1, 0));
        if (j == TEE) add_line(&l, vec(0.01, 0), vec(0.1, -1));
        if (j == CROSSING) add_line(&l, vec(0.2, 0.2), vec(-0.2, -0.2));
        if (j == TEE_AT_JOINT || j == FORK) {
            add_line(&l, vec(-1, j == FORK ? -0.05 : 0), vec(0, 0));
            add_line(&l, vec(0, 0), vec(1, j == FORK ? -0.2 : 0));
            add_line(&l, vec(0, 0), vec(0.1, -1));
        }
        if (j == SPIKE) {
            add_line(&l, vec(-0.05, -1), vec(0, 0));
            add_line(&l, vec(0, 0), vec(0.05, -1));
        }
        for (int kind = 0; kind < SHAPES; kind++)
            for (int o = 0; o < 2; o++)
                check_lead(&l, kind, 0.02, o == 0 ? 1e-3 : 0.02, 0.01, what[j]);
    }
    assert_int_equal(failed, 0);
}

/* --- discs against the sum over critical points ----------------------------------------------- */

/* Energy over kn of a disc: half the squares of the overlaps at the feet on the faces, and at each
   vertex 1 less the faces along which the distance falls from there. */
static double critical_sum(const lines *l, dem2d_vec centre, double radius) {
    double sum = 0;
    for (int i = 0; i < l->count; i++) {
        const double x = l->to[i].x - l->from[i].x, y = l->to[i].y - l->from[i].y;
        const double dx = centre.x - l->from[i].x, dy = centre.y - l->from[i].y;
        const double place = (dx * x + dy * y) / (x * x + y * y);
        const double overlap = radius - fabs(dx * y - dy * x) / hypot(x, y);
        if (place > 0 && place < 1 && overlap > 0) sum += overlap * overlap / 2;
        for (int end = 0; end < 2; end++) {
            const dem2d_vec at = end ? l->to[i] : l->from[i];
            const double left = radius - hypot(centre.x - at.x, centre.y - at.y);
            double falls = 0, here = 0;
            for (int k = 0; k < l->count; k++)
                for (int e = 0; e < 2; e++) {
                    const dem2d_vec p = e ? l->to[k] : l->from[k], q = e ? l->from[k] : l->to[k];
                    if (hypot(p.x - at.x, p.y - at.y) > 1e-9) continue;
                    here++;
                    falls += (centre.x - p.x) * (q.x - p.x) + (centre.y - p.y) * (q.y - p.y) > 0;
                }
            if (left > 0) sum += (1 - falls) * left * left / 2 / here;
        }
    }
    return sum;
}

static double disc_energy(const lines *l, dem2d_vec centre, double radius, dem2d_vec *force,
                          dem2d_contact_info *list, int *count) {
    scene s = led_scene(0, 1);
    add_lines(&s, l);
    const dem2d_particle_id id =
        add_shape(&s, make_disc(radius), DEM2D_FREE, centre, 0, vec(0, 0), 0);
    step(&s, 1);
    *force = grain_of(&s, id).force;
    *count = contacts_of(&s, list, 64);
    const double energy = energy_of(&s).normal / KN;
    close_scene(&s);
    return energy;
}

static void test_discs(void **state) {
    uint64_t random = 3;
    dem2d_contact_info list[64];
    dem2d_vec force;
    int count, taken = 0;
    (void)state;
    for (int i = 0; i < 3000; i++) {
        const double angle = random_between(&random, -0.7, 0.7) * (i % 3 ? 1 : 0.02);
        lines l = i % 2 ? arc(angle / 3, 0.02, 5) : kink(angle);
        if (i % 10 == 0) add_line(&l, vec(0, 0), vec(0.3, -0.8));
        const dem2d_vec at =
            vec(random_between(&random, -0.02, 0.02),
                random_between(&random, 0.9, 1) * (i % 10 == 0 || i % 7 ? 0.05 : -0.05));
        const double energy = disc_energy(&l, at, 0.05, &force, list, &count);
        /* in line within 1e-6 is one face, whose vertex is off it by 5e-7 of the length */
        assert_within(energy, critical_sum(&l, at, 0.05), 1e-13 + 1e-9 * energy);
        for (int c = 0; c < count; c++) taken += list[c].sign < 0;
    }
    assert_true(taken > 100);
}

/* Deep over a shallow kink a disc has the stiffness of one contact; contact_info tells the third
   contact, of sign -1. */
static void test_shallow_kink(void **state) {
    dem2d_contact_info list[64];
    dem2d_vec force;
    int count;
    (void)state;
    const lines l = kink(0.01);
    const double y = 0.05 - 1e-3, half = 0.005;
    const dem2d_vec at = vec(-y * sin(half), y * cos(half)); /* in the middle */
    (void)disc_energy(&l, at, 0.05, &force, list, &count);
    assert_int_equal(count, 3);
    assert_near(hypot(force.x, force.y), KN * 1e-3, 3e-3);
    assert_int_equal(list[0].sign + list[1].sign + list[2].sign, 1);
    assert_int_equal(list[2].sign, -1);
    assert_true(list[2].feature == 1 || list[2].feature == 2);
    assert_true(list[2].normal_force > 0 && list[2].tangential_force == 0);
    assert_int_equal(list[0].feature, 0);
    /* the forces of all, by their signs */
    double x = 0, sum = 0;
    for (int c = 0; c < 3; c++) {
        x -= list[c].sign * list[c].normal_force * list[c].normal.x;
        sum -= list[c].sign * list[c].normal_force * list[c].normal.y;
    }
    assert_within(x, force.x, 1e-9 * KN * 1e-3);
    assert_within(sum, force.y, 1e-9 * KN * 1e-3);
}

/* A disc in a regular drum: its energy is between those in the inner and the outer circle. */
static void test_drum(void **state) {
    static lines l;
    uint64_t random = 9;
    dem2d_contact_info list[64];
    dem2d_vec force;
    (void)state;
    for (int n = 60; n <= 600; n += 540) {
        l.count = 0;
        for (int i = 0; i < n; i++)
            add_line(&l, direction(2 * TEST_PI * i / n), direction(2 * TEST_PI * (i + 1) / n));
        for (int i = 0; i < (n == 60 ? 60 : 10); i++) {
            const double way = random_between(&random, 0, 6.28),
                         r = random_between(&random, 0.05, 0.4);
            const double deep = random_between(&random, 0.001, 0.05) * r, d = 1 - r + deep;
            const dem2d_vec at = vec(d * cos(way), d * sin(way));
            int count;
            const double energy = disc_energy(&l, at, r, &force, list, &count);
            const double more = deep + 1 - cos(TEST_PI / n);
            assert_between(energy, deep * deep / 2 * (1 - 1e-9), more * more / 2 * (1 + 1e-9));
            assert_within(energy, critical_sum(&l, at, r), 1e-12);
            const double towards = (force.x * at.x + force.y * at.y) / d;
            assert_between(-towards, KN * deep * (1 - 3.0 / n), KN * more * (1 + 1e-9));
        }
    }
}

/* --- free slides ------------------------------------------------------------------------------ */

typedef struct slide {
    double energy, momentum, x, angle;
    int points;
} slide;

/* A floor of so many segments, none: a half-plane; from x = -1 to 2, along a direction. */
static void add_slope(const scene *s, int count, double angle) {
    const dem2d_vec t = direction(angle);
    if (count == 0) (void)add_plane(s, 0, 0, -t.y, t.x);
    for (int i = 0; i < count; i++) {
        const double a = 3.0 * i / count - 1, b = 3.0 * (i + 1) / count - 1;
        if (i % 2)
            add_segment(s, vec(b * t.x, b * t.y), vec(a * t.x, a * t.y));
        else
            add_segment(s, vec(a * t.x, a * t.y), vec(b * t.x, b * t.y));
    }
}

static slide slide_over(int kind, int count, double damping, int steps) {
    scene s = free_scene(0, damping, false);
    dem2d_shape *shape = make_kind(kind);
    const bool flat = kind == BOX || kind == ROUNDED; /* these would tumble: they start at rest */
    const double angle = flat ? 0 : 0.3;
    dem2d_shape_info info;
    assert_ok(dem2d_shape_get(shape, &info));
    const double weight = 2700 * info.mass.area * 9.81;
    const double y = height_of(shape, angle) - (flat ? weight / (2 * KN) : 2e-5);
    slide r = {0, 0, 0, 0, 0};
    add_slope(&s, count, 0);
    const dem2d_particle_id id =
        add_shape(&s, shape, DEM2D_FREE, vec(-0.5, y), angle, vec(1.5, 0), 0);
    for (int i = 0; i < steps; i += 50) {
        dem2d_contact_info list[8];
        step(&s, 50);
        int points = 0;
        for (int c = contacts_of(&s, list, 8) - 1; c >= 0; c--) points += list[c].points;
        r.points = points > r.points ? points : r.points;
    }
    const dem2d_energy e = energy_of(&s);
    const dem2d_particle_info g = grain_of(&s, id);
    r.energy = e.translational + e.rotational + e.normal + e.potential;
    r.momentum = g.velocity.x, r.x = g.pose.position.x;
    r.angle = angle_of(&s, id);
    close_scene(&s);
    return r;
}

static void test_slides(void **state) {
    const int steps = test_long() ? 60000 : 20000;
    (void)state;
    for (int kind = 0; kind < SHAPES; kind++)
        for (int damped = 0; damped < 2; damped++) {
            const slide plane = slide_over(kind, 0, damped * 0.3, steps);
            assert_within(plane.momentum, 1.5, 1e-11);
            for (int k = 0; k < 3; k++) {
                static const int counts[3] = {1, 7, 60};
                const slide r = slide_over(kind, counts[k], damped * 0.3, steps);
                assert_near(r.energy, plane.energy, 1e-9);
                assert_near(r.momentum, plane.momentum, 1e-11);
                assert_within(r.angle, plane.angle, 1e-7);
                assert_true(r.points <= (kind == BOX || kind == ROUNDED ? 2 : 1));
            }
        }
}

/* A box on a slope at 0.99 of the friction angle rests, whatever is under it. */
static void test_rest(void **state) {
    (void)state;
    for (int kind = BOX; kind <= ROUNDED; kind++)
        for (int k = 0; k < 4; k++) {
            static const int counts[4] = {0, 1, 7, 60};
            const double friction = 0.3, angle = atan(0.99 * friction);
            scene s = free_scene(friction, 0.5, false);
            assert_ok(dem2d_world_set_damping(s.world, 0.5, 0));
            dem2d_shape *shape = make_kind(kind);
            const double y = height_of(shape, 0) - 5e-6;
            add_slope(&s, counts[k], angle);
            const dem2d_particle_id id = add_shape(
                &s, shape, DEM2D_FREE,
                vec(0.01 * cos(angle) - y * sin(angle), y * cos(angle) + 0.01 * sin(angle)), angle,
                vec(0, 0), 0);
            step(&s, 20000);
            const dem2d_particle_info one = grain_of(&s, id);
            step(&s, test_long() ? 200000 : 20000);
            const dem2d_particle_info two = grain_of(&s, id);
            const double crept = hypot(two.pose.position.x - one.pose.position.x,
                                       two.pose.position.y - one.pose.position.y);
            if (crept > 1e-12) print_error("%s over %d segments\n", names[kind], counts[k]);
            assert_within(crept, 0, 1e-12);
            assert_within(hypot(two.velocity.x, two.velocity.y), 0, 1e-10);
            close_scene(&s);
        }
}

/* A grain in a right corner of segments has the contacts of two half-planes. */
static void test_corner(void **state) {
    (void)state;
    for (int kind = 0; kind < SHAPES; kind++)
        for (int turned = -2; turned <= 2; turned++) {
            double energy[2];
            dem2d_particle_info g[2];
            for (int planes = 0; planes < 2; planes++) {
                scene s = led_scene(0, 1);
                dem2d_shape *shape = make_kind(kind);
                dem2d_support left, low;
                const dem2d_pose pose = dem2d_pose_make(0, 0, turned * 1e-3, 1);
                assert_ok(dem2d_shape_support(shape, pose, vec(-1, 0), &left));
                assert_ok(dem2d_shape_support(shape, pose, vec(0, -1), &low));
                if (planes) {
                    (void)add_plane(&s, 0, 0, 0, 1), (void)add_plane(&s, 0, 0, 1, 0);
                } else {
                    add_segment(&s, vec(0, 0), vec(1, 0)), add_segment(&s, vec(0, 1), vec(0, 0));
                }
                const dem2d_particle_id id =
                    add_shape(&s, shape, DEM2D_FREE, vec(left.value - 2e-4, low.value - 1e-4),
                              turned * 1e-3, vec(0, 0), 0);
                step(&s, 1);
                energy[planes] = energy_of(&s).normal, g[planes] = grain_of(&s, id);
                close_scene(&s);
            }
            /* a corner of a box beyond the end of a segment touches it at the end, as part of
               its turn less deep */
            const double part = kind == BOX ? 0.03 : 1e-9, most = KN * 2e-4;
            assert_near(energy[0], energy[1], part);
            assert_within(g[0].force.x, g[1].force.x, part * most);
            assert_within(g[0].force.y, g[1].force.y, part * most);
        }
}

/* --- walls that move, lists, friction -----------------------------------------------------------
 */

static dem2d_wall_id add_moving(const scene *s, dem2d_vec from, dem2d_vec to, dem2d_vec velocity) {
    dem2d_wall_desc desc = plane_desc(s, from, vec(0, 0));
    desc.segment = true, desc.end = to;
    desc.mode = DEM2D_WALL_MOVING, desc.velocity = velocity;
    return add_wall(s, &desc);
}

/* Two segments under a disc that stands still, or follows: at rest relative to each other they are
   one face; while one of them moves away by itself both push, and where it comes back and stands
   still they are one face again. */
static void test_moving(void **state) {
    dem2d_contact_info list[8];
    (void)state;
    for (int together = 0; together < 2; together++) {
        const dem2d_vec way = vec(1e-3, 0);
        scene s = led_scene(0, 1e-3);
        const dem2d_wall_id left = add_moving(&s, vec(-1, 0), vec(0, 0), way);
        (void)add_moving(&s, vec(0, 0), vec(1, 0), together ? way : vec(2e-3, 0));
        const dem2d_particle_id id =
            add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(-0.001, 0.0499), 0, way, 0);
        for (int i = 0; i < 50; i++) {
            step(&s, 1);
            assert_int_equal(contacts_of(&s, list, 8), together ? 1 : 2);
            if (together) assert_near(grain_of(&s, id).force.y, KN * 1e-4, 1e-9);
        }
        assert_int_equal(list[0].wall.index, left.index);
        close_scene(&s);
    }
}

/* A piece of a floor is taken out, moved and put back under a box: joints follow each edit, with
   the contacts of the box. */
static void test_edits_of_joints(void **state) {
    dem2d_contact_info list[16];
    (void)state;
    scene s = led_scene(0, 1);
    dem2d_wall_id ids[5];
    for (int i = 0; i < 5; i++)
        ids[i] = add_segment(&s, vec(0.02 * i - 0.05, 0), vec(0.02 * i - 0.03, 0));
    add_shape(&s, make_box(0.06, 0.04), DEM2D_FREE, vec(0, 0.0199), 0, vec(0, 0), 0);
    step(&s, 1);
    const dem2d_energy whole = energy_of(&s);
    assert_int_equal(contacts_of(&s, list, 16), 1);
    assert_int_equal(list[0].points, 2);
    assert_near(whole.normal, 2 * KN * 1e-4 * 1e-4 / 2, 1e-9);
    /* the middle one is lowered: two faces, each with its own common part */
    dem2d_wall_desc desc = plane_desc(&s, vec(-0.01, -0.1), vec(0, 0));
    desc.segment = true, desc.end = vec(0.01, -0.1);
    assert_ok(dem2d_world_set_wall(s.world, ids[2], &desc));
    step(&s, 1);
    assert_int_equal(contacts_of(&s, list, 16), 2);
    assert_true(list[0].points == 2 && list[1].points == 2);
    desc.point.y = desc.end.y = 0; /* and is back */
    assert_ok(dem2d_world_set_wall(s.world, ids[2], &desc));
    step(&s, 1);
    assert_int_equal(contacts_of(&s, list, 16), 1);
    assert_near(energy_of(&s).normal, whole.normal, 1e-12);
    assert_ok(dem2d_world_remove_wall(s.world, ids[2]));
    step(&s, 1);
    assert_int_equal(contacts_of(&s, list, 16), 2);
    close_scene(&s);
}

/* Joints are found from either side: segments given twice, of no length in float, in any order. */
static void test_strange_chains(void **state) {
    dem2d_contact_info list[16];
    (void)state;
    scene s = led_scene(0, 1); /* kinks of a millionth, as of points with seven digits */
    for (int i = 0; i < 10; i++) {
        const double y = i % 3 * 3e-9, next = (i + 1) % 3 * 3e-9;
        add_segment(&s, vec(0.02 * i - 0.1, y), vec(0.02 * (i + 1) - 0.1, next));
    }
    add_shape(&s, make_box(0.1, 0.04), DEM2D_FREE, vec(0, 0.0199), 0, vec(0, 0), 0);
    step(&s, 1);
    assert_int_equal(contacts_of(&s, list, 16), 1);
    assert_near(energy_of(&s).normal, KN * 1e-8, 1e-3);
    close_scene(&s);
    s = led_scene(0, 1); /* a closed square, clockwise, as parts in a mixed order */
    const dem2d_vec p[4] = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
    add_segment(&s, p[2], p[3]), add_segment(&s, p[0], p[1]);
    add_segment(&s, p[0], p[3]), add_segment(&s, p[2], p[1]);
    add_shape(&s, make_disc(0.1), DEM2D_FREE, vec(0.0999, 0.0998), 0, vec(0, 0), 0);
    add_shape(&s, make_disc(0.1), DEM2D_FREE, vec(-0.0705, -0.0705), 0, vec(0, 0), 0);
    step(&s, 1);
    const int count = contacts_of(&s, list, 16);
    assert_int_equal(count, 3); /* two sides inside, one corner outside */
    close_scene(&s);
}

/* Grains run over a chain of kinks with friction and dashpots: the same for any skin, and for a
   world that was saved and loaded on the way; the ledger closes. */
static void test_runs(void **state) {
    (void)state;
    for (int kind = 0; kind < SHAPES; kind++)
        for (int damped = 0; damped < 2; damped++) {
            uint64_t hash[3] = {0, 0, 0};
            for (int run = 0; run < 3; run++) {
                dem2d_material_desc material = stone_desc(KN / 2, 0.4);
                dem2d_world_desc desc = {0};
                material.damping_ratio = damped * 0.2, material.rolling_friction = damped * 0.05;
                desc.time_step = 2e-5, desc.gravity = vec(0, -9.81), desc.ledger = true;
                desc.skin = run == 1 ? 0.3 : 0;
                scene s = open_scene(&desc, &material);
                const lines l = arc(0.04, 0.03, 12);
                add_lines(&s, &l);
                const dem2d_particle_id id =
                    add_shape(&s, make_kind(kind), DEM2D_FREE, vec(-0.1, 0.12), 0.2, vec(1, 0), 3);
                for (int i = 0; i < 8; i++) {
                    step(&s, 1000);
                    if (run < 2) continue;
                    scene_bytes bytes = scene_save(s.world);
                    const scene next = scene_load(&s, &bytes);
                    free(bytes.bytes);
                    close_scene(&s);
                    s = next;
                }
                const dem2d_ledger ledger = ledger_of(&s);
                assert_within(ledger.closure, 0, 2e-3 * ledger.given);
                const dem2d_particle_info g = grain_of(&s, id);
                assert_true(fabs(g.pose.position.x) < 0.3 && g.pose.position.y > 0);
                hash[run] = dem2d_world_hash(s.world);
                close_scene(&s);
            }
            assert_true(hash[1] == hash[0]);
            assert_true(hash[2] == hash[0]);
        }
}

/* A disc that is dragged over a shallow reflex vertex hands its spring on: the sum of the shear
   forces is that on one plane. */
static void test_springs(void **state) {
    (void)state;
    for (int bend = -1; bend <= 1; bend++) {
        scene s = led_scene(5, 1);
        dem2d_contact_info list[8];
        const lines l = kink(0.002 * bend);
        add_lines(&s, &l);
        const double way = 1e-7;
        add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(-2e-4, 0.0499), 0, vec(way, 0), 0);
        for (int i = 1; i < 4000; i++) {
            step(&s, 1);
            const int count = contacts_of(&s, list, 8);
            double shear = 0;
            for (int c = 0; c < count; c++) shear += list[c].tangential_force;
            if (i == 1) continue; /* half a step */
            assert_near(fabs(shear), KN / 2 * way * i, 2e-3);
        }
        close_scene(&s);
    }
}

/* A step that is refused after an edit leaves the state as the edit left it: a disc in a valley of
   two segments, whose vertex takes a part of both forces. Joints come or go elsewhere, one of the
   two is named anew and gets another place among the walls, or goes; or both go, while a third
   contact remains; one of the two is moved a little, or sets out: they are no longer joined; or a
   third segment comes between them, at the same vertex. */
enum {
    JOINTS_COME,
    JOINTS_GO,
    VALLEY_NAMED,
    VALLEY_ENDS,
    ONE_FACE,
    VALLEY_PARTS,
    VALLEY_SETS_OUT,
    VALLEY_FILLED,
    VALLEY_EDITS
};

static void test_refused_after_edits(void **state) {
    (void)state;
    for (int edit = 0; edit < VALLEY_EDITS; edit++) {
        dem2d_contact_info list[8];
        scene s = free_scene(0.5, 0, false);
        const dem2d_wall_id far = add_segment(&s, vec(5, 0), vec(6, 0));
        const dem2d_wall_id next = add_segment(&s, vec(6, 0), vec(7, 0.1));
        add_segment(&s, vec(-1, 0.2), vec(0, 0));
        const dem2d_wall_id right = add_segment(&s, vec(0, 0), vec(1, 0.2));
        if (edit == ONE_FACE) assert_ok(dem2d_world_remove_wall(s.world, next));
        add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0.0495), 0, vec(0, 0), 0);
        add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(5.5, 0.0499), 0, vec(0, 0), 0);
        step(&s, 2);
        assert_int_equal(contacts_of(&s, list, 8), 4);
        assert_true(list[0].sign + list[1].sign + list[2].sign + list[3].sign == 2);
        if (edit == JOINTS_COME) add_segment(&s, vec(7, 0.1), vec(8, 0));
        if (edit == JOINTS_GO) assert_ok(dem2d_world_remove_wall(s.world, far));
        if (edit == VALLEY_FILLED) add_segment(&s, vec(0, 0), vec(1, -0.1));
        if (edit == VALLEY_NAMED || edit == VALLEY_PARTS || edit == VALLEY_SETS_OUT) {
            dem2d_wall_desc desc;
            assert_ok(dem2d_world_get_wall_desc(s.world, right, &desc));
            if (edit == VALLEY_NAMED) desc.name = 7;
            if (edit == VALLEY_PARTS) desc.point.x += 1e-5, desc.end.x += 1e-5;
            if (edit == VALLEY_SETS_OUT) desc.mode = DEM2D_WALL_MOVING, desc.velocity.x = 1e-3;
            assert_ok(dem2d_world_set_wall(s.world, right, &desc));
        }
        if (edit == VALLEY_ENDS || edit == ONE_FACE)
            assert_ok(dem2d_world_remove_wall(s.world, right));
        const int left = contacts_of(&s, list, 8);
        const int expected[VALLEY_EDITS] = {4, 3, 4, 2, 2, 4, 4, 4};
        assert_int_equal(left, expected[edit]);
        assert_ok(dem2d_world_set_time_step(s.world, 1));
        const uint64_t hash = dem2d_world_hash(s.world);
        const dem2d_energy energy = energy_of(&s);
        for (int k = 0; k < 2; k++) {
            assert_int_not_equal(dem2d_world_step(s.world, 1, NULL), DEM2D_OK);
            assert_true(dem2d_world_hash(s.world) == hash);
            assert_true(energy_of(&s).normal == energy.normal);
        }
        assert_ok(dem2d_world_set_time_step(s.world, 1e-5));
        step(&s, 3);
        const bool apart = edit == VALLEY_PARTS || edit == VALLEY_SETS_OUT;
        assert_int_equal(contacts_of(&s, list, 8), expected[edit] - apart);
        close_scene(&s);
    }
}

/* A grain that slides over joints of a floor stays in one contact, as events tell: it closes once.
   At a reflex vertex it closes with the second face, and the contact of sign -1 is told by none. */
static void test_events(void **state) {
    dem2d_contact_event events[16];
    (void)state;
    for (int kind = 0; kind < SHAPES; kind++)
        for (int bend = 0; bend < 2; bend++) {
            const dem2d_material_desc material = material_desc(1e30, KN, 0, 0);
            dem2d_world_desc desc = {0};
            int count;
            desc.time_step = 1, desc.event_capacity = 100;
            scene s = open_scene(&desc, &material);
            const lines l = bend ? kink(0.01) : arc(0, 0.02, 20);
            add_lines(&s, &l);
            dem2d_shape *shape = make_kind(kind);
            const double y = height_of(shape, 0) - 1e-4;
            add_shape(&s, shape, DEM2D_FREE, vec(-0.1, y), 0, vec(2e-4, 0), 0);
            step(&s, 900);
            assert_ok(dem2d_world_events(s.world, events, 16, &count, NULL));
            assert_int_equal(count, bend ? 3 : 1);
            assert_int_equal(events[0].kind, DEM2D_CONTACT_CLOSED);
            if (bend) assert_int_equal(events[1].kind, DEM2D_CONTACT_CLOSED);
            if (bend) assert_int_equal(events[2].kind, DEM2D_CONTACT_OPENED);
            close_scene(&s);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kinks),
        cmocka_unit_test(test_arcs),
        cmocka_unit_test(test_junctions),
        cmocka_unit_test(test_discs),
        cmocka_unit_test(test_shallow_kink),
        cmocka_unit_test(test_drum),
        cmocka_unit_test(test_slides),
        cmocka_unit_test(test_rest),
        cmocka_unit_test(test_corner),
        cmocka_unit_test(test_moving),
        cmocka_unit_test(test_edits_of_joints),
        cmocka_unit_test(test_refused_after_edits),
        cmocka_unit_test(test_strange_chains),
        cmocka_unit_test(test_runs),
        cmocka_unit_test(test_springs),
        cmocka_unit_test(test_events),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
