/* Measures of a world: stresses, strain, regions, fabric, histograms, distance from rest; the axis
   of a shape. Expected values are closed forms, or sums by other means in long double. */
#include "dem2d.h"
#include "testing.h"

#include <float.h>

/* --- building blocks ------------------------------------------------------------------------- */

static dem2d_world *new_world(const dem2d_env *env) {
    dem2d_world_desc desc = {0};
    dem2d_world *world;
    desc.time_step = 1e-4, desc.skip_time_step_check = true, desc.env = env;
    assert_ok(dem2d_world_create(&desc, &world));
    return world;
}

static dem2d_material_id new_material(dem2d_world *world, double friction) {
    dem2d_material_desc desc = {0};
    dem2d_material_id id;
    desc.density = 2700, desc.normal_stiffness = 1e7, desc.tangential_stiffness = 5e6;
    desc.friction = friction;
    assert_ok(dem2d_world_add_material(world, &desc, &id));
    return id;
}

/* The world's copy of a shape that is given away. */
static dem2d_shape_id take_shape(dem2d_world *world, dem2d_shape *shape) {
    dem2d_shape_id id;
    assert_ok(dem2d_world_add_shape(world, shape, &id));
    dem2d_shape_destroy(shape);
    return id;
}

static dem2d_shape_id new_disc(dem2d_world *world) {
    dem2d_shape *shape;
    assert_ok(dem2d_shape_create_circle(NULL, 1, &shape));
    return take_shape(world, shape);
}

static dem2d_particle_id add(dem2d_world *world, dem2d_shape_id shape, dem2d_material_id material,
                             dem2d_vec position, double scale, double angle, dem2d_motion motion) {
    dem2d_particle_desc desc = {0};
    dem2d_particle_id id;
    desc.shape = shape, desc.material = material, desc.position = position, desc.scale = scale;
    desc.angle = angle, desc.motion = motion;
    assert_ok(dem2d_world_add_particle(world, &desc, &id));
    return id;
}

static dem2d_wall_id add_wall(dem2d_world *world, dem2d_material_id material, dem2d_vec point,
                              dem2d_vec normal, dem2d_vec velocity) {
    dem2d_wall_desc desc = {0};
    dem2d_wall_id id;
    desc.material = material, desc.point = point, desc.normal = normal, desc.velocity = velocity;
    desc.mode = velocity.x != 0 || velocity.y != 0 ? DEM2D_WALL_MOVING : DEM2D_WALL_STILL;
    assert_ok(dem2d_world_add_wall(world, &desc, &id));
    return id;
}

static void step(dem2d_world *world, int count) {
    assert_ok(dem2d_world_step(world, count, NULL));
}

enum { CONTACT_ROOM = 2000 };

static dem2d_contact_info contacts[CONTACT_ROOM];

static int read_contacts(const dem2d_world *world) {
    int count;
    assert_ok(dem2d_world_contacts(world, contacts, CONTACT_ROOM, &count));
    assert_true(count <= CONTACT_ROOM);
    return count;
}

/* Discs of several sizes in a box whose lid goes down and stops: friction, walls, rattlers. */
enum { COLUMNS = 14, ROWS = 20, DISCS = COLUMNS * ROWS, LID_STEPS = 1800 };

typedef struct heap {
    dem2d_world *world;
    dem2d_material_id material;
    dem2d_wall_id walls[4]; /* left, right, floor, lid */
    dem2d_particle_id ids[DISCS];
} heap;

static void make_heap(heap *h, const dem2d_env *env) {
    const dem2d_vec rest = {0, 0};
    const double cell = 0.022, width = cell * (COLUMNS + 0.5), height = cell * ROWS;
    uint64_t random = 7;
    h->world = new_world(env);
    h->material = new_material(h->world, 0.4);
    const dem2d_shape_id disc = new_disc(h->world);
    assert_ok(dem2d_world_set_damping(h->world, 0.7, 0));
    for (int i = 0; i < DISCS; i++) {
        const int row = i / COLUMNS;
        const dem2d_vec at =
            vec(cell * (i % COLUMNS + (row % 2 == 0 ? 0.5 : 1)), cell * (row + 0.5));
        const double radius = random_between(&random, 0.35, 0.5) * cell;
        h->ids[i] = add(h->world, disc, h->material, at, radius, 0, DEM2D_FREE);
    }
    h->walls[0] = add_wall(h->world, h->material, vec(0, 0), vec(1, 0), rest);
    h->walls[1] = add_wall(h->world, h->material, vec(width, 0), vec(-1, 0), rest);
    h->walls[2] = add_wall(h->world, h->material, vec(0, 0), vec(0, 1), rest);
    h->walls[3] = add_wall(h->world, h->material, vec(0, height), vec(0, -1), vec(0, -1));
}

/* The lid goes down until it presses, then all comes to rest. */
static void press(heap *h) {
    dem2d_wall_desc lid = {0};
    dem2d_wall_info info;
    step(h->world, LID_STEPS);
    assert_ok(dem2d_world_get_wall(h->world, h->walls[3], &info));
    lid.material = h->material, lid.point = info.point, lid.normal = info.normal;
    assert_ok(dem2d_world_set_wall(h->world, h->walls[3], &lid));
    step(h->world, 1000);
}

/* --- strain ---------------------------------------------------------------------------------- */

/* ln of a ratio in long double; near 1 by the difference, which is exact. */
static long double true_strain(double now, double before) {
    const long double rest = ((long double)now - before) / before;
    return fabsl(rest) < 0.5L ? -log1pl(rest) : -logl((long double)now) + logl(before);
}

static void check_strain(double now, double before) {
    const double strain = dem2d_strain(now, before);
    const long double expected = true_strain(now, before);
    assert_within(strain, expected, 2 * DBL_EPSILON * fabsl(expected));
    assert_same_bits(dem2d_strain(before, now), now == before ? strain : -strain);
}

static void test_strain(void **state) {
    (void)state;
    uint64_t random = 1;
    if (LDBL_MANT_DIG <= DBL_MANT_DIG) skip(); /* no better logarithm to compare with */
    for (int i = 0; i < 20000; i++) {
        const double before =
            ldexp(random_between(&random, 1, 2), random_below(&random, 1000) - 500);
        check_strain(before * random_between(&random, 0.5, 2), before);
        check_strain(before *
                         (1 + ldexp(random_between(&random, -1, 1), -random_below(&random, 52))),
                     before);
        check_strain(ldexp(random_between(&random, 1, 2), random_below(&random, 1000) - 500),
                     before);
    }
    const double odd[] = {
        DBL_MAX,     DBL_MAX / 1.4,       DBL_MIN,           4.9e-324, 3e-310, 1, 1 - 0x1p-53,
        1 + 0x1p-52, 0.70710678118654752, 1.4142135623730951};
    for (int i = 0; i < COUNT_OF(odd); i++)
        for (int k = 0; k < COUNT_OF(odd); k++) check_strain(odd[i], odd[k]);
    assert_near(dem2d_strain(1 - 1e-12, 1), 1e-12 + 0.5e-24, 1e-4); /* of 1 - 1e-12 itself */
    assert_same_bits(dem2d_strain(0.3, 0.3), 0.0);
}

static void test_strain_errors(void **state) {
    (void)state;
    const double bad[] = {0, -0.0, -1, NAN, INFINITY, -INFINITY};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        assert_true(isnan(dem2d_strain(bad[i], 1)));
        assert_true(isnan(dem2d_strain(1, bad[i])));
        assert_true(isnan(dem2d_strain(bad[i], bad[i])));
    }
}

/* --- stress ---------------------------------------------------------------------------------- */

/* Principal values and their direction, turned into a tensor, come back. */
static void test_principal(void **state) {
    (void)state;
    uint64_t random = 3;
    for (int i = 0; i < 5000; i++) {
        const double size = ldexp(1, random_below(&random, 1800) - 900);
        const double p = size * random_between(&random, -1, 1),
                     q = size * random_between(&random, 0, 1);
        const double angle = random_between(&random, -1.57, 1.57), odd = size * (i % 3);
        const dem2d_stress stress = {p + q * cos(2 * angle), q * sin(2 * angle) + odd,
                                     q * sin(2 * angle) - odd, p - q * cos(2 * angle)};
        dem2d_principal got;
        assert_ok(dem2d_stress_principal(&stress, &got));
        assert_within(got.p, p, 4 * DBL_EPSILON * size);
        assert_within(got.q, q, 8 * DBL_EPSILON * size);
        if (q > 0.01 * size) assert_within(sin(got.angle - angle), 0, 1e-13);
    }
}

static void test_principal_special(void **state) {
    (void)state;
    const dem2d_stress even = {3, 0, 0, 3}, upright = {1, 0, 0, 5}, shear = {0, -2, -2, 0};
    const dem2d_stress great = {DBL_MAX, 0, 0, DBL_MAX / 2}, wrong = {1, 2, NAN, 4};
    dem2d_principal got = {7, 7, 7};
    assert_result(dem2d_stress_principal(&wrong, &got), DEM2D_NOT_FINITE);
    assert_result(dem2d_stress_principal(NULL, &got), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_stress_principal(&even, NULL), DEM2D_NULL_ARGUMENT);
    assert_true(got.p == 7 && got.q == 7 && got.angle == 7);
    assert_ok(dem2d_stress_principal(&even, &got));
    assert_true(got.p == 3 && got.q == 0 && got.angle == 0);
    assert_ok(dem2d_stress_principal(&upright, &got));
    assert_true(got.p == 3 && got.q == 2);
    assert_near(got.angle, TEST_PI / 2, DBL_EPSILON);
    assert_ok(dem2d_stress_principal(&shear, &got));
    assert_true(got.p == 0 && got.q == 2);
    assert_near(got.angle, -TEST_PI / 4, DBL_EPSILON);
    assert_ok(dem2d_stress_principal(&great, &got));
    assert_near(got.p, (long double)DBL_MAX * 0.75L, 4 * DBL_EPSILON);
    assert_near(got.q, (long double)DBL_MAX * 0.25L, 4 * DBL_EPSILON);
}

/* A disc of radius 1 between walls at +-(1 - depth): two forces kn depth at arms of 1 - depth. */
static void test_squeezed_disc(void **state) {
    (void)state;
    const double depth = 0.01, walls = 1e7; /* of two equal springs in series, doubled */
    dem2d_world *world = new_world(NULL);
    const dem2d_material_id material = new_material(world, 0);
    const dem2d_particle_id id =
        add(world, new_disc(world), material, vec(0, 0), 1, 0, DEM2D_FREE);
    for (int i = 0; i < 2; i++)
        add_wall(world, material, vec(i ? 1 - depth : depth - 1, 0), vec(i ? -1 : 1, 0), vec(0, 0));
    step(world, 1);
    dem2d_stress stress = {1, 1, 1, 1};
    assert_ok(dem2d_world_particle_stress(world, id, &stress));
    assert_near(stress.xx, 2 * walls * depth * (1 - depth) / TEST_PI, 1e-13);
    assert_true(stress.xy == 0 && stress.yx == 0 && stress.yy == 0);
    assert_ok(dem2d_world_remove_particle(world, id));
    assert_result(dem2d_world_particle_stress(world, id, &stress), DEM2D_STALE_ID);
    assert_result(dem2d_world_particle_stress(NULL, id, &stress), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_particle_stress(world, id, NULL), DEM2D_NULL_ARGUMENT);
    dem2d_world_destroy(world);
}

/* Weighted by their areas, the stresses of all particles are the stress of the world. */
static void test_sum_of_stresses(void **state) {
    (void)state;
    heap h;
    make_heap(&h, NULL);
    press(&h);
    dem2d_stress all, one;
    long double sum[4] = {0}, size = 0;
    assert_ok(dem2d_world_stress(h.world, 1, &all));
    for (int i = 0; i < DISCS; i++) {
        dem2d_particle_info info;
        assert_ok(dem2d_world_get_particle(h.world, h.ids[i], &info));
        assert_ok(dem2d_world_particle_stress(h.world, h.ids[i], &one));
        const long double area = TEST_PI * (long double)info.radius * info.radius;
        sum[0] += area * one.xx, sum[1] += area * one.xy;
        sum[2] += area * one.yx, sum[3] += area * one.yy;
        size += area * fabsl((long double)one.xx + one.yy);
    }
    assert_true(size > 0 && all.xy != 0);
    assert_within(all.xx, sum[0], 1e-13 * size);
    assert_within(all.xy, sum[1], 1e-13 * size);
    assert_within(all.yx, sum[2], 1e-13 * size);
    assert_within(all.yy, sum[3], 1e-13 * size);
    dem2d_world_destroy(h.world);
}

/* --- axes of shapes -------------------------------------------------------------------------- */

static dem2d_shape *make_rectangle(double a, double b, double turn) {
    const dem2d_vec u = direction(turn);
    const double sign[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
    dem2d_vec points[4];
    for (int i = 0; i < 4; i++)
        points[i] = vec(sign[i][0] * a * u.x - sign[i][1] * b * u.y,
                        sign[i][0] * a * u.y + sign[i][1] * b * u.x);
    return make_polygon(points, 4, 0);
}

static dem2d_shape *make_regular(int count, double rounding) {
    dem2d_vec points[16];
    for (int i = 0; i < count; i++) points[i] = direction(0.3 + 2 * (double)TEST_PI * i / count);
    return make_polygon(points, count, rounding);
}

static void check_axis(dem2d_shape *shape, long double angle, long double ratio,
                       long double tolerance) {
    double got_angle = 9, got_ratio = 9;
    assert_ok(dem2d_shape_axis(shape, &got_angle, &got_ratio));
    assert_near(got_ratio, ratio, tolerance);
    assert_within(sinl(got_angle - angle), 0, tolerance);
    assert_true(got_angle > -TEST_PI / 2 && got_angle <= (double)(TEST_PI / 2));
    if (ratio == 1) assert_true(got_ratio == 1 && got_angle == 0);
    dem2d_shape_destroy(shape);
}

static void test_axis(void **state) {
    (void)state;
    dem2d_shape *shape;
    double angle = 5, ratio = 5;
    for (int i = 0; i < 24; i++) {
        const double turn = -3 + 0.25 * i;
        check_axis(make_rectangle(3, 2, turn), turn, 1.5L, 1e-14);
        check_axis(make_rectangle(0.1, 0.0999, turn), turn, 0.1L / 0.0999L, 1e-11);
    }
    check_axis(make_rectangle(1, 1e-6, 0), 0, 1e6L, 1e-13);
    check_axis(make_rectangle(1, 1e-4, 0.7), 0.7L, 1e4L, 1e-10);
    /* of a triangle (0,0), (4,0), (0,1) about the centroid: xx = 16/18, yy = 1/18, xy = -2/18 / 1
     */
    const dem2d_vec corners[3] = {{0, 0}, {4, 0}, {0, 1}};
    const long double mean = 17.0L / 2, half = sqrtl(7.5L * 7.5L + 4);
    check_axis(make_polygon(corners, 3, 0), atan2l(-2, 7.5L) / 2,
               sqrtl((mean + half) / (mean - half)), 1e-14);
    assert_ok(dem2d_shape_create_ellipse(NULL, 1, 3, &shape));
    check_axis(shape, TEST_PI / 2, 3, 1e-15);
    for (double aspect = 1 + 1e-6; aspect <= 1e8; aspect *= 10) {
        assert_ok(dem2d_shape_create_ellipse(NULL, aspect, 1, &shape));
        check_axis(shape, 0, aspect, 1e-14);
        assert_ok(dem2d_shape_create_ellipse(NULL, 1, aspect, &shape));
        check_axis(shape, TEST_PI / 2, aspect, 1e-14);
    }
    assert_ok(dem2d_shape_create_circle(NULL, 2, &shape));
    assert_result(dem2d_shape_axis(NULL, &angle, &ratio), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_axis(shape, NULL, &ratio), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_shape_axis(shape, &angle, NULL), DEM2D_NULL_ARGUMENT);
    assert_true(angle == 5 && ratio == 5);
    check_axis(shape, 0, 1, 0);
}

/* Second moments of what a closed curve encloses, in long double, by Simpson's rule on 1/2 int xx
   (x dy - y dx) and its kind: six sums, then about the centroid. */
typedef struct curve_moments {
    long double area, x, y, xx, xy, yy;
} curve_moments;

typedef struct curve_point {
    long double x, y, dx, dy;
} curve_point;

typedef curve_point curve_fn(const void *user, int piece, long double t);

static void curve_add(curve_moments *m, long double weight, curve_point p) {
    const long double sweep = weight * (p.x * p.dy - p.y * p.dx);
    m->area += sweep / 2, m->x += sweep * p.x / 3, m->y += sweep * p.y / 3;
    m->xx += sweep * p.x * p.x / 4, m->xy += sweep * p.x * p.y / 4, m->yy += sweep * p.y * p.y / 4;
}

/* Along axes turned by an angle. */
static curve_moments curve_sum(curve_fn *curve, const void *user, int pieces, long double angle) {
    enum { PARTS = 2000 };
    const long double c = cosl(angle), s = sinl(angle);
    curve_moments m = {0};
    for (int k = 0; k < pieces; k++)
        for (int i = 0; i <= 2 * PARTS; i++) {
            const int factor = i == 0 || i == 2 * PARTS ? 1 : i % 2 ? 4 : 2;
            const curve_point p = curve(user, k, i / (2.0L * PARTS));
            const curve_point q = {c * p.x + s * p.y, c * p.y - s * p.x, c * p.dx + s * p.dy,
                                   c * p.dy - s * p.dx};
            curve_add(&m, factor / (6.0L * PARTS), q);
        }
    m.x /= m.area, m.y /= m.area;
    m.xx -= m.area * m.x * m.x, m.xy -= m.area * m.x * m.y, m.yy -= m.area * m.y * m.y;
    return m;
}

static void check_curve_axis(dem2d_shape *shape, curve_fn *curve, const void *user, int pieces,
                             bool level) {
    long double angle = 0;
    curve_moments m;
    for (int pass = 0; pass < 3; pass++) { /* a needle's width does not survive askew */
        m = curve_sum(curve, user, pieces, angle);
        angle += atan2l(2 * m.xy, m.xx - m.yy) / 2;
    }
    const long double ratio = sqrtl(m.xx / m.yy);
    double got_angle, got_ratio;
    assert_ok(dem2d_shape_axis(shape, &got_angle, &got_ratio));
    /* askew, the width has the rounding of the length's coordinates: a few times 2^-53 */
    assert_near(got_ratio, ratio, 1e-10L + (level ? 0 : 8 * 0x1p-53L * ratio));
    if (ratio > 1 + 1e-6L) assert_within(sinl(got_angle - angle), 0, 1e-10L);
    dem2d_shape_destroy(shape);
}

/* A series of the support function: s = p u + p' n, ds/dt = (p + p'') n. */
typedef struct series {
    double a[9], b[9];
    int order;
} series;

static curve_point series_point(const void *user, int piece, long double part) {
    const series *f = user;
    const long double t = 2 * TEST_PI * part, c = cosl(t), s = sinl(t);
    long double p = f->a[0] / 2, d = 0, rho = p;
    (void)piece;
    for (int n = 1; n <= f->order; n++) {
        const long double value = f->a[n] * cosl(n * t) + f->b[n] * sinl(n * t);
        p += value, rho += (1 - n * n) * value;
        d += n * (f->b[n] * cosl(n * t) - f->a[n] * sinl(n * t));
    }
    rho *= 2 * TEST_PI;
    return (curve_point){p * c - d * s, p * s + d * c, -rho * s, rho * c};
}

/* Cubic arcs, the first control point of each in `points`. */
static curve_point arc_point(const void *user, int piece, long double t) {
    const dem2d_vec *q = (const dem2d_vec *)user + 3 * piece;
    const long double u = 1 - t, w[4] = {u * u * u, 3 * u * u * t, 3 * u * t * t, t * t * t};
    const long double v[3] = {3 * u * u, 6 * u * t, 3 * t * t};
    curve_point p = {0, 0, 0, 0};
    for (int i = 0; i < 4; i++) p.x += w[i] * q[i].x, p.y += w[i] * q[i].y;
    for (int i = 0; i < 3; i++)
        p.dx += v[i] * ((long double)q[i + 1].x - q[i].x),
            p.dy += v[i] * ((long double)q[i + 1].y - q[i].y);
    return p;
}

/* Corners and a rounding: pieces are an edge, then the arc at its end. */
typedef struct rounded {
    dem2d_vec corners[5];
    double radius;
} rounded;

static curve_point rounded_point(const void *user, int piece, long double t) {
    const rounded *shape = user;
    const int n = COUNT_OF(shape->corners), k = piece / 2;
    long double angle[2];
    for (int i = 0; i < 2; i++) {
        const dem2d_vec a = shape->corners[(k + i) % n], b = shape->corners[(k + i + 1) % n];
        angle[i] = atan2l((long double)a.x - b.x, (long double)b.y - a.y);
    }
    const long double turn = angle[1] - angle[0] + (angle[1] < angle[0] ? 2 * TEST_PI : 0);
    const long double at = angle[0] + (piece % 2 ? t * turn : 0), r = shape->radius;
    const dem2d_vec a = shape->corners[k], b = shape->corners[(k + 1) % n];
    const long double ex = (long double)b.x - a.x, ey = (long double)b.y - a.y;
    if (piece % 2 == 0)
        return (curve_point){a.x + t * ex + r * cosl(at), a.y + t * ey + r * sinl(at), ex, ey};
    return (curve_point){b.x + r * cosl(at), b.y + r * sinl(at), -r * turn * sinl(at),
                         r * turn * cosl(at)};
}

/* Squeezed in y, then turned, as the template gets it. */
static dem2d_vec squeeze(dem2d_vec p, double flat, double turn) {
    const double y = p.y * flat;
    if (turn == 0) return vec(p.x, y);
    return vec(cos(turn) * p.x - sin(turn) * y, sin(turn) * p.x + cos(turn) * y);
}

static void test_axis_of_every_model(void **state) {
    (void)state;
    const dem2d_vec control[9] = {{1, 0},      {1, 0.7},   {0.5, 1.1},   {-0.2, 1.1}, {-1, 1.1},
                                  {-1.3, 0.3}, {-1, -0.2}, {-0.1, -1.7}, {1, -1}};
    const dem2d_vec corners[5] = {{1, -0.3}, {0.8, 0.6}, {-0.2, 0.9}, {-1, 0.2}, {-0.4, -0.7}};
    dem2d_shape *shape;
    for (int i = 0; i <= 8; i++)
        for (int k = 0; k < 3; k++) {
            const double flat = pow(10, -i), turn = 0.7 * k;
            dem2d_vec points[10];
            for (int j = 0; j < 10; j++) points[j] = squeeze(control[j % 9], flat, turn);
            assert_ok(dem2d_shape_create_bezier(NULL, points, 3, &shape));
            check_curve_axis(shape, arc_point, points, 3, k == 0);
            for (int round = 0; round < 2; round++) {
                rounded r;
                for (int j = 0; j < 5; j++) r.corners[j] = squeeze(corners[j], flat, turn);
                r.radius = round ? 0.2 * flat : 0;
                assert_ok(dem2d_shape_create_polygon(NULL, r.corners, 5, r.radius, &shape));
                check_curve_axis(shape, rounded_point, &r, 10, k == 0);
            }
        }
    uint64_t random = 17;
    for (int run = 0; run < 20; run++) {
        series f = {{2}, {0}, 2 + random_below(&random, 7)};
        for (int n = 2; n <= f.order; n++) {
            const double most = 0.6 / ((f.order - 1) * (n * n - 1));
            f.a[n] = random_between(&random, -most, most),
            f.b[n] = random_between(&random, -most, most);
        }
        assert_ok(dem2d_shape_create_fourier(NULL, f.a, f.b, f.order, &shape));
        check_curve_axis(shape, series_point, &f, 1, true);
    }
    for (double small = 1e-6; small < 0.3; small *= 10) { /* nearly round: the ratio 1 + 2 small */
        const series f = {{2, 0, small / 2}, {0, 0, small}, 2};
        assert_ok(dem2d_shape_create_fourier(NULL, f.a, f.b, 2, &shape));
        check_curve_axis(shape, series_point, &f, 1, true);
    }
}

/* Shapes with a symmetry of three or more have no axis, whatever their outline's points. */
static void test_no_axis(void **state) {
    (void)state;
    dem2d_shape *shape;
    const double a[6] = {2, 0, 0, 0.1, 0, 0.01}, b[6] = {0};
    for (int n = 3; n <= 16; n++) {
        check_axis(make_regular(n, 0), 0, 1, 0);
        check_axis(make_regular(n, 0.2), 0, 1, 0);
    }
    assert_ok(dem2d_shape_create_fourier(NULL, a, b, 3, &shape));
    check_axis(shape, 0, 1, 0);
}

/* --- porosity of a region -------------------------------------------------------------------- */

static dem2d_vec grown_ellipse(void *user, dem2d_vec u, double *rho) {
    const double a = 1.3, b = 0.5, r = 0.2, h = sqrt(a * a * u.x * u.x + b * b * u.y * u.y);
    (void)user;
    if (rho) *rho = a * a * b * b / (h * h * h) + r;
    return vec((a * a / h + r) * u.x, (b * b / h + r) * u.y);
}

enum { KINDS = 9 };

static dem2d_shape *make_kind(int kind) {
    static const dem2d_vec corners[5] = {
        {-0.9, -0.6}, {0.7, -0.8}, {1.1, 0.1}, {0.4, 0.9}, {-0.6, 0.7}};
    static const dem2d_vec arcs[6] = {{1, 0}, {1, 1.2}, {-1, 1.2}, {-1, 0}, {-1, -0.9}, {1, -0.9}};
    const double a[4] = {1.8, 0, 0.08, 0.03}, b[4] = {0, 0, 0.06, 0.02};
    dem2d_custom_desc custom = {0};
    dem2d_shape *shape = NULL;
    custom.support = grown_ellipse, custom.outline_points = 20000;
    if (kind == 0) assert_ok(dem2d_shape_create_circle(NULL, 0.8, &shape));
    if (kind == 1) assert_ok(dem2d_shape_create_ellipse(NULL, 1, 0.6, &shape));
    if (kind == 2) assert_ok(dem2d_shape_create_ellipse(NULL, 2, 0.05, &shape));
    if (kind == 3) shape = make_polygon(corners, 5, 0);
    if (kind == 4) shape = make_polygon(corners, 5, 0.15);
    if (kind == 5) assert_ok(dem2d_shape_create_bezier(NULL, arcs, 2, &shape));
    if (kind == 6) assert_ok(dem2d_shape_create_fourier(NULL, a, b, 3, &shape));
    if (kind == 7) assert_ok(dem2d_shape_create_custom(NULL, &custom, &shape));
    if (kind == 8) shape = make_rectangle(1, 0.01, 0.3);
    return shape;
}

/* Length of a polygon's part of the line y = const inside [left, right]: crossings by edges. */
static long double chord(const dem2d_vec *points, int count, long double y, const dem2d_box *box) {
    long double low = 1e9L, high = -1e9L;
    for (int i = 0; i < count; i++) {
        const dem2d_vec p = points[i], q = points[(i + 1) % count];
        if ((p.y > y) == (q.y > y)) continue;
        const long double x = p.x + (y - p.y) * ((long double)q.x - p.x) / ((long double)q.y - p.y);
        low = fminl(low, x), high = fmaxl(high, x);
    }
    low = fmaxl(low, box->lower.x), high = fminl(high, box->upper.x);
    return fmaxl(0, high - low);
}

/* Area inside a box by scan lines over the outline of many points: of a needle of an ellipse by
   its parameter, which spreads them better than directions do. */
static long double scanned_area(const dem2d_shape *shape, dem2d_pose pose, const dem2d_box *box) {
    enum { POINTS = 3000, LINES = 2000 };
    static dem2d_vec points[POINTS];
    dem2d_shape_info info;
    dem2d_box own;
    assert_ok(dem2d_shape_outline(shape, pose, POINTS, points));
    assert_ok(dem2d_shape_get(shape, &info));
    for (int i = 0; i < POINTS && info.type == DEM2D_ELLIPSE; i++) {
        const dem2d_vec u = direction(2 * (double)TEST_PI * i / POINTS);
        const double x = pose.scale * info.circumscribed * u.x;
        const double y = pose.scale * info.inscribed * u.y;
        points[i].x = pose.position.x + pose.rotation.c * x - pose.rotation.s * y;
        points[i].y = pose.position.y + pose.rotation.s * x + pose.rotation.c * y;
    }
    assert_ok(dem2d_shape_aabb(shape, pose, &own));
    const double low = fmax(own.lower.y, box->lower.y), high = fmin(own.upper.y, box->upper.y);
    if (!(low < high)) return 0;
    long double sum = 0;
    for (int i = 0; i < LINES; i++)
        sum += chord(points, POINTS, low + ((long double)high - low) * (i + 0.5L) / LINES, box);
    return sum * ((long double)high - low) / LINES;
}

/* Boxes that cut each kind of shape in many ways, at a place where coordinates are exact. */
static void check_region(int kind, double x, double angle, double scale, const dem2d_box *box) {
    dem2d_world *world = new_world(NULL);
    dem2d_shape *shape = make_kind(kind);
    dem2d_pose pose = dem2d_pose_make(0, 0, angle, scale);
    dem2d_box moved = *box;
    dem2d_mass mass;
    double porosity;
    const long double expected = scanned_area(shape, pose, box);
    moved.lower.x += x, moved.upper.x += x;
    assert_ok(dem2d_shape_mass(shape, &mass));
    add(world, take_shape(world, shape), new_material(world, 0), vec(x, 0), scale, angle,
        DEM2D_FIXED);
    assert_ok(dem2d_world_porosity(world, &moved, &porosity));
    const long double area =
        ((long double)box->upper.x - box->lower.x) * ((long double)box->upper.y - box->lower.y);
    assert_within((1 - (long double)porosity) * area, expected,
                  1e-5L * mass.area * scale * scale + 4 * DBL_EPSILON * area);
    dem2d_world_destroy(world);
}

static void test_porosity(void **state) {
    (void)state;
    uint64_t random = 11;
    for (int i = 0; i < 12 * KINDS; i++) {
        dem2d_box box;
        box.lower.x = ldexp(floor(random_between(&random, -1024, 512)), -10);
        box.lower.y = ldexp(floor(random_between(&random, -1024, 512)), -10);
        box.upper.x = box.lower.x + ldexp(floor(random_between(&random, 10, 2048)), -10);
        box.upper.y = box.lower.y + ldexp(floor(random_between(&random, 10, 2048)), -10);
        check_region(i % KINDS, i % 2 == 0 ? 0 : 4096, random_between(&random, -3, 3),
                     i % 3 == 0 ? 1 : 0.7, &box);
    }
}

/* Closed forms: a circle's segment and quadrant, a square's corner, needles, nothing. */
static void test_porosity_exact(void **state) {
    (void)state;
    dem2d_world *world = new_world(NULL);
    const dem2d_material_id material = new_material(world, 0);
    double porosity;
    add(world, new_disc(world), material, vec(0, 0), 2, 0.3, DEM2D_FREE);
    for (int i = -9; i <= 9; i++) {
        const dem2d_box right = {{0.2 * i, -3}, {4, 3}};
        const long double h = 0.2 * i / 2.0L;
        const long double expected = 4 * (acosl(h) - h * sqrtl(1 - h * h));
        assert_ok(dem2d_world_porosity(world, &right, &porosity));
        assert_within((1 - (long double)porosity) * 6 * (4 - (long double)right.lower.x), expected,
                      1e-5L * 4 * TEST_PI);
    }
    const dem2d_box quadrant = {{0, 0}, {5, 5}}, away = {{2, 2}, {3, 3}};
    assert_ok(dem2d_world_porosity(world, &quadrant, &porosity));
    assert_near(1 - (long double)porosity, TEST_PI / 25, 1e-12);
    assert_ok(dem2d_world_porosity(world, &away, &porosity));
    assert_true(porosity == 1);
    add(world, take_shape(world, make_rectangle(1, 0.5, 0)), material, vec(10, 10), 1, 0,
        DEM2D_FREE);
    const dem2d_box corner = {{10.25, 10.125}, {1e4, 1e4}}, inside = {{10, 10}, {10.5, 10.25}};
    const dem2d_box all = {{-5, -5}, {15, 15}};
    assert_ok(dem2d_world_porosity(world, &corner, &porosity));
    assert_within(1 - (long double)porosity, 0.75L * 0.375L / ((1e4L - 10.25L) * (1e4L - 10.125L)),
                  2 * DBL_EPSILON);
    assert_ok(dem2d_world_porosity(world, &inside, &porosity));
    assert_within(porosity, 0, 1e-15);
    assert_ok(dem2d_world_porosity(world, &all, &porosity));
    assert_near(1 - (long double)porosity, (4 * TEST_PI + 2) / 400, 1e-14);
    dem2d_world_destroy(world);
}

/* --- fabric ---------------------------------------------------------------------------------- */

typedef struct second_order {
    double coefficient, direction;
} second_order;

/* 1 + a cos 2 (t - t0) */
static double around(second_order a, double t) {
    return 1 + a.coefficient * cos(2 * (t - a.direction));
}

/* Direction k of count whose density is that of a: t + a/2 sin 2 (t - t0) rises evenly. */
static double spread(second_order a, int k, int count) {
    const double pi = (double)TEST_PI, target = pi * (k + 0.5) / count;
    double low = target - 1, high = target + 1;
    for (int i = 0; i < 60; i++) {
        const double t = (low + high) / 2;
        if (t + a.coefficient / 2 * sin(2 * (t - a.direction)) < target)
            low = t;
        else
            high = t;
    }
    return (low + high) / 2;
}

/* Pairs of driven discs, far from each other, with prescribed normals, depths, branches, and slips
   that wind up the tangential springs in one step. */
static void make_pairs(dem2d_world *world, int count, const second_order a[4]) {
    enum { CONTACTS, BRANCHES, NORMAL, TANGENTIAL };
    const dem2d_material_id material = new_material(world, 1e3);
    const dem2d_shape_id disc = new_disc(world);
    const double depth = 0.01, kn = 1e7, kt = 5e6, time_step = 1e-4;
    for (int k = 0; k < count; k++) {
        const double t = spread(a[CONTACTS], k, count);
        const double d = depth * around(a[NORMAL], t), length = around(a[BRANCHES], t);
        const double shear =
            -kn * depth * a[TANGENTIAL].coefficient * sin(2 * (t - a[TANGENTIAL].direction));
        const double slip = -shear / kt / time_step; /* of new contacts: at the step's end */
        const double other = k % 2 == 0 ? 1 : -1;
        const dem2d_vec n = direction(t), at = vec(4 * (k % 20), 4 * (k / 20));
        const dem2d_vec next = vec(at.x + other * length * n.x, at.y + other * length * n.y);
        add(world, disc, material, at, (length + d) * 0.4, 0, DEM2D_FREE);
        dem2d_particle_desc moves = {0}; /* as it was half a step before */
        dem2d_particle_id id;
        moves.shape = disc, moves.material = material, moves.motion = DEM2D_FREE;
        moves.scale = (length + d) * 0.6, moves.position = next;
        moves.velocity = vec(-n.y * slip * other, n.x * slip * other);
        assert_ok(dem2d_world_add_particle(world, &moves, &id));
    }
    step(world, 1);
}

static void check_anisotropy(dem2d_anisotropy got, second_order expected) {
    assert_within(got.coefficient, expected.coefficient, 1e-9);
    assert_within(sin(got.direction - expected.direction), 0, 1e-8);
    assert_true(got.direction > -TEST_PI / 2 && got.direction <= (double)(TEST_PI / 2));
}

/* The anisotropies that a set of contacts was made with come back. */
static void test_fabric(void **state) {
    (void)state;
    static const second_order sets[3][4] = {
        {{0.3, 1.5}, {0.05, 0.4}, {0.4, -1.2}, {0.2, 1.3}},
        {{0.85, 0.1}, {0.1, -1.5}, {0.6, 0.2}, {0.3, -0.1}},
        {{0.1, -0.7}, {0.02, 1.1}, {0.1, 0.9}, {0.05, 0.3}},
    };
    for (int i = 0; i < 3; i++) {
        const second_order *a = sets[i];
        dem2d_world *world = new_world(NULL);
        dem2d_fabric fabric;
        enum { PAIRS = 600 };
        make_pairs(world, PAIRS, a);
        assert_ok(dem2d_world_fabric(world, &fabric));
        assert_int_equal(fabric.contacts, PAIRS);
        check_anisotropy(fabric.normals, a[0]);
        check_anisotropy(fabric.branches, a[1]);
        check_anisotropy(fabric.normal_forces, a[2]);
        check_anisotropy(fabric.tangential_forces, a[3]);
        assert_within(fabric.deviator, a[0].coefficient / 2, 1e-9);
        assert_within(fabric.xx, 0.5 + a[0].coefficient / 4 * cos(2 * a[0].direction), 1e-9);
        assert_within(fabric.yy, 0.5 - a[0].coefficient / 4 * cos(2 * a[0].direction), 1e-9);
        assert_within(fabric.xy, a[0].coefficient / 4 * sin(2 * a[0].direction), 1e-9);
        /* the mean over 1 + a cos 2 (t - t0) of 1 + b cos 2 (t - t1) */
        const double branch = 1 + a[0].coefficient * a[1].coefficient / 2 *
                                      cos(2 * (a[0].direction - a[1].direction));
        const double force = 1 + a[0].coefficient * a[2].coefficient / 2 *
                                     cos(2 * (a[0].direction - a[2].direction));
        assert_near(fabric.mean_branch, branch, 1e-9);
        assert_near(fabric.mean_force, 1e5 * force, 1e-9);
        double ratio = 0;
        for (int k = 0; k < 4; k++)
            ratio += a[k].coefficient / 2 * cos(2 * (a[k].direction - a[0].direction));
        assert_within(fabric.stress_ratio, ratio, 1e-9);
        dem2d_world_destroy(world);
    }
}

/* Coefficient and direction from sums of f (cos 2t, sin 2t). */
static void check_sums(dem2d_anisotropy got, long double c, long double s, long double all) {
    assert_within(got.coefficient * cos(2 * got.direction), 2 * c / all, 1e-12);
    assert_within(got.coefficient * sin(2 * got.direction), 2 * s / all, 1e-12);
}

/* The same by angles instead of tensors, over the list of contacts. */
static void check_fabric_sums(const dem2d_world *world) {
    dem2d_fabric fabric;
    long double c[4] = {0}, s[4] = {0}, all[4] = {0};
    int count = 0, open = read_contacts(world);
    assert_ok(dem2d_world_fabric(world, &fabric));
    for (int i = 0; i < open; i++)
        if (contacts[i].b.generation != 0) {
            const long double t = atan2l(contacts[i].normal.y, contacts[i].normal.x);
            c[0] += cosl(2 * t), s[0] += sinl(2 * t), all[0]++, count++;
        }
    const long double a = 2 * sqrtl(c[0] * c[0] + s[0] * s[0]) / all[0], t0 = atan2l(s[0], c[0]);
    for (int i = 0; i < open; i++) {
        const dem2d_contact_info *contact = &contacts[i];
        if (contact->b.generation == 0) continue;
        const long double t = atan2l(contact->normal.y, contact->normal.x);
        const long double w = fmaxl(1 + a * cosl(2 * t - t0), 0.1L);
        const long double length = (long double)contact->branch.x * contact->normal.x +
                                   (long double)contact->branch.y * contact->normal.y;
        const long double f[3] = {length, contact->normal_force, contact->tangential_force};
        for (int k = 0; k < 3; k++) {
            const bool across = k == 2;
            c[k + 1] += f[k] / w * (across ? -sinl(2 * t) : cosl(2 * t));
            s[k + 1] += f[k] / w * (across ? cosl(2 * t) : sinl(2 * t));
            all[k + 1] += f[k] / w;
        }
    }
    assert_int_equal(fabric.contacts, count);
    check_sums(fabric.normals, c[0], s[0], all[0]);
    check_sums(fabric.branches, c[1], s[1], all[1]);
    check_sums(fabric.normal_forces, c[2], s[2], all[2]);
    check_sums(fabric.tangential_forces, c[3], s[3], all[2]);
}

/* q/p of the stress against what the fabric foretells, in a box pressed from above. */
static void test_stress_ratio(void **state) {
    (void)state;
    heap h;
    make_heap(&h, NULL);
    press(&h);
    dem2d_stress stress;
    dem2d_principal principal;
    dem2d_fabric fabric;
    assert_ok(dem2d_world_stress(h.world, 1, &stress));
    assert_ok(dem2d_stress_principal(&stress, &principal));
    assert_ok(dem2d_world_fabric(h.world, &fabric));
    check_fabric_sums(h.world);
    assert_true(principal.q / principal.p > 0.1);
    assert_near(fabric.stress_ratio, principal.q / principal.p, 0.15);
    assert_within(sin(fabric.normal_forces.direction - principal.angle), 0, 0.15);
    dem2d_world_destroy(h.world);
}

/* Three upright contacts and one across: the density of second order is 0 there. */
static void test_fabric_few(void **state) {
    (void)state;
    dem2d_fabric fabric, zero;
    memset(&zero, 0, sizeof zero);
    for (int count = 0; count <= 5; count++) {
        dem2d_world *world = new_world(NULL);
        const dem2d_material_id material = new_material(world, 0);
        const dem2d_shape_id disc = new_disc(world);
        for (int i = 0; i < count; i++) {
            const dem2d_vec n = i == 3 ? vec(1, 0) : vec(0, 1);
            add(world, disc, material, vec(5 * i, 0), 1, 0, DEM2D_FREE);
            add(world, disc, material, vec(5 * i + 1.99 * n.x, 1.99 * n.y), 1, 0, DEM2D_FREE);
        }
        step(world, 1);
        memset(&fabric, 7, sizeof fabric);
        assert_ok(dem2d_world_fabric(world, &fabric));
        if (count == 0)
            assert_memory_equal(&fabric, &zero, sizeof zero);
        else
            check_fabric_sums(world);
        dem2d_world_destroy(world);
    }
    assert_result(dem2d_world_fabric(NULL, &fabric), DEM2D_NULL_ARGUMENT);
}

/* --- histograms ------------------------------------------------------------------------------ */

enum { BINS = 13 };

/* Bins of a direction and of the opposite one. */
static int bin_of(long double x, long double y) {
    long double t = atan2l(y, x);
    if (t < 0) t += 2 * TEST_PI;
    const int bin = (int)floorl(t / (2 * TEST_PI) * BINS);
    return bin < BINS ? bin : BINS - 1;
}

static void test_contact_histograms(void **state) {
    (void)state;
    heap h;
    make_heap(&h, NULL);
    press(&h);
    long double sums[4][BINS] = {{0}};
    const int open = read_contacts(h.world);
    for (int i = 0; i < open; i++) {
        const dem2d_contact_info *c = &contacts[i];
        if (c->b.generation == 0) continue;
        const long double length = c->branch.x * c->normal.x + c->branch.y * c->normal.y;
        const long double add_to[4] = {1, length, c->normal_force, c->tangential_force};
        for (int k = 0; k < 4; k++) {
            sums[k][bin_of(c->normal.x, c->normal.y)] += add_to[k];
            sums[k][bin_of(-c->normal.x, -c->normal.y)] += add_to[k];
        }
    }
    static const dem2d_histogram kinds[4] = {DEM2D_HISTOGRAM_NORMAL, DEM2D_HISTOGRAM_BRANCH,
                                             DEM2D_HISTOGRAM_NORMAL_FORCE,
                                             DEM2D_HISTOGRAM_TANGENTIAL_FORCE};
    for (int k = 0; k < 4; k++) {
        double values[BINS];
        assert_ok(dem2d_world_histogram(h.world, kinds[k], BINS, values));
        for (int i = 0; i < BINS; i++) {
            assert_true(sums[0][i] > 0);
            const long double expected = k == 0 ? sums[0][i] : sums[k][i] / sums[0][i];
            assert_within(values[i], expected, k == 3 ? 1e-8 : 1e-13L * fabsl(expected));
        }
    }
    dem2d_world_destroy(h.world);
}

static void test_coordination_histogram(void **state) {
    (void)state;
    heap h;
    make_heap(&h, NULL);
    press(&h);
    int of[DISCS] = {0}, expected[9] = {0}, rattlers = 0;
    const int open = read_contacts(h.world);
    for (int i = 0; i < open; i++)
        if (contacts[i].b.generation != 0) of[contacts[i].a.index]++, of[contacts[i].b.index]++;
    for (int i = 0; i < DISCS; i++) expected[of[i] < 8 ? of[i] : 8]++, rattlers += of[i] < 2;
    for (int bins = 1; bins <= 9; bins += 4) {
        double values[9];
        assert_ok(dem2d_world_histogram(h.world, DEM2D_HISTOGRAM_COORDINATION, bins, values));
        int rest = DISCS;
        for (int i = 0; i < bins - 1; i++) {
            assert_true(values[i] == expected[i]);
            rest -= expected[i];
        }
        assert_true(values[bins - 1] == rest);
    }
    dem2d_packing packing;
    assert_ok(dem2d_world_packing(h.world, &packing));
    assert_true(rattlers > 0);
    assert_int_equal(packing.rattlers, rattlers);
    dem2d_world_destroy(h.world);
}

/* Grains with an axis at known angles among discs and squares, which have none. */
static void test_orientation_histogram(void **state) {
    (void)state;
    dem2d_world *world = new_world(NULL);
    const dem2d_material_id material = new_material(world, 0);
    dem2d_shape *shape;
    assert_ok(dem2d_shape_create_ellipse(NULL, 0.2, 0.5, &shape)); /* its axis is upright */
    const dem2d_shape_id shapes[4] = {take_shape(world, shape), new_disc(world),
                                      take_shape(world, make_rectangle(1, 1, 0.4)),
                                      take_shape(world, make_rectangle(0.8, 0.3, 0.4))};
    double expected[BINS] = {0}, values[BINS];
    for (int i = 0; i < 200; i++) {
        const double angle = -7 + 0.0613 * i;
        add(world, shapes[i % 4], material, vec(3 * i, 0), 1, angle, DEM2D_FREE);
        if (i % 4 == 1 || i % 4 == 2) continue;
        const double along = angle + (i % 4 == 0 ? (double)TEST_PI / 2 : 0.4);
        const double part = along / (double)TEST_PI - floor(along / (double)TEST_PI);
        expected[(int)(part * BINS)]++;
    }
    assert_ok(dem2d_world_histogram(world, DEM2D_HISTOGRAM_ORIENTATION, BINS, values));
    for (int i = 0; i < BINS; i++) assert_true(values[i] == expected[i]);
    assert_ok(dem2d_world_histogram(world, DEM2D_HISTOGRAM_BRANCH, BINS, values));
    for (int i = 0; i < BINS; i++) assert_true(values[i] == 0); /* no contacts */
    dem2d_world_destroy(world);
}

static void test_histogram_errors(void **state) {
    (void)state;
    test_env env;
    heap h;
    double values[BINS];
    test_env_init(&env);
    make_heap(&h, &env.env);
    for (int kind = 0; kind < DEM2D_HISTOGRAM_COUNT; kind++)
        for (int k = 1; k <= 2; k++) {
            for (int i = 0; i < BINS; i++) values[i] = -3;
            test_env_fail(&env, k);
            assert_result(dem2d_world_histogram(h.world, (dem2d_histogram)kind, BINS, values),
                          DEM2D_OUT_OF_MEMORY);
            test_env_fail(&env, 0);
            for (int i = 0; i < BINS; i++) assert_true(values[i] == -3);
        }
    assert_result(dem2d_world_histogram(h.world, DEM2D_HISTOGRAM_COUNT, BINS, values),
                  DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "kind");
    assert_result(dem2d_world_histogram(h.world, (dem2d_histogram)-1, BINS, values),
                  DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_histogram(h.world, DEM2D_HISTOGRAM_NORMAL, 0, values),
                  DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "bins");
    assert_result(dem2d_world_histogram(h.world, DEM2D_HISTOGRAM_NORMAL, BINS, NULL),
                  DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_histogram(NULL, DEM2D_HISTOGRAM_NORMAL, BINS, values),
                  DEM2D_NULL_ARGUMENT);
    for (int i = 0; i < BINS; i++) assert_true(values[i] == -3);
    dem2d_world_destroy(h.world);
    assert_clean(&env);
}

/* --- distance from rest ---------------------------------------------------------------------- */

static void check_equilibrium(const dem2d_world *world, double mean, double most, double ratio,
                              double unbalanced) {
    dem2d_equilibrium e;
    assert_ok(dem2d_world_equilibrium(world, &e));
    assert_near(e.mean_speed, mean, 1e-12);
    assert_near(e.max_speed, most, 1e-12);
    if (isinf(ratio))
        assert_true(e.kinetic_ratio == HUGE_VAL);
    else
        assert_near(e.kinetic_ratio, ratio, 1e-12);
    assert_near(e.unbalanced, unbalanced, 1e-12);
}

static void test_equilibrium(void **state) {
    (void)state;
    const double dt = 1e-4, depth = 0.01, force = 1e7 * depth, mass = 2700 * (double)TEST_PI;
    dem2d_equilibrium e;
    dem2d_world *world = new_world(NULL);
    const dem2d_material_id material = new_material(world, 0);
    const dem2d_shape_id disc = new_disc(world);
    check_equilibrium(world, 0, 0, 0, 0); /* nothing is there */
    assert_ok(dem2d_world_set_gravity(world, vec(0, -9.81)));
    add(world, disc, material, vec(0, 0), 1, 0, DEM2D_FREE);
    add(world, disc, material, vec(9, 0), 1, 0, DEM2D_FIXED);
    check_equilibrium(world, 0, 0, 0, 0); /* before the first step */
    step(world, 1);
    check_equilibrium(world, 9.81 * dt / 2, 9.81 * dt / 2, INFINITY, 0); /* 0 to g dt */
    dem2d_world_destroy(world);

    /* two overlapping ones, one of them driven; one that is held against a wall has no contact */
    world = new_world(NULL);
    const dem2d_material_id same = new_material(world, 0);
    const dem2d_shape_id other = new_disc(world);
    add(world, other, same, vec(0, 0), 1, 0, DEM2D_FREE);
    const dem2d_particle_id driven = add(world, other, same, vec(2 - depth, 0), 1, 0, DEM2D_DRIVEN);
    add(world, other, same, vec(9, 0), 1, 0, DEM2D_DRIVEN);
    add_wall(world, same, vec(10 - 3 * depth, 0), vec(-1, 0), vec(0, 0));
    assert_ok(dem2d_world_drive_particle(world, driven, DEM2D_DRIVEN, vec(0, 2), 0));
    step(world, 1);
    const double speed = force / mass * dt; /* after the step; the mean of the half steps is half */
    const double kinetic = mass * (2 * 2 / 2.0 + speed * speed / 4);
    const double springs = 1e7 * depth * depth / 2;
    check_equilibrium(world, (2 + speed / 2) / 3, 2, kinetic / springs, 1);
    assert_result(dem2d_world_equilibrium(NULL, &e), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_equilibrium(world, NULL), DEM2D_NULL_ARGUMENT);
    dem2d_world_destroy(world);
}

/* A grain that its weight presses into the floor is at rest. */
static void test_rest(void **state) {
    (void)state;
    const double weight = 2700 * (double)TEST_PI * 9.81;
    dem2d_world *world = new_world(NULL);
    const dem2d_material_id material = new_material(world, 0);
    dem2d_equilibrium e;
    assert_ok(dem2d_world_set_gravity(world, vec(0, -9.81)));
    add(world, new_disc(world), material, vec(0, 1 - weight / 1e7), 1, 0, DEM2D_FREE);
    add_wall(world, material, vec(0, 0), vec(0, 1), vec(0, 0));
    step(world, 10);
    assert_ok(dem2d_world_equilibrium(world, &e));
    assert_between(e.unbalanced, 0, 1e-12);
    assert_between(e.kinetic_ratio, 0, 1e-12);
    dem2d_world_destroy(world);
}

static void test_inertial_number(void **state) {
    (void)state;
    test_env env;
    test_env_init(&env);
    dem2d_world *world = new_world(&env.env);
    dem2d_material_desc light = {0};
    dem2d_material_id materials[2] = {new_material(world, 0), {0, 0}};
    double number = -1;
    light.density = 900, light.normal_stiffness = 1;
    assert_ok(dem2d_world_add_material(world, &light, &materials[1]));
    assert_ok(dem2d_world_inertial_number(world, 1, 1, &number));
    assert_true(number == 0);
    add(world, take_shape(world, make_rectangle(1, 0.5, 0)), materials[0], vec(0, 0), 1, 0,
        DEM2D_FREE);
    add(world, new_disc(world), materials[1], vec(5, 0), 1, 0, DEM2D_FREE);
    const long double diameter = (2 * sqrtl(2 / TEST_PI) + 2) / 2;
    const long double density = (2 * 2700 + 900 * TEST_PI) / (2 + TEST_PI);
    const long double expected = 0.01L * diameter * sqrtl(density / 1e5L);
    assert_ok(dem2d_world_inertial_number(world, 0.01, 1e5, &number));
    assert_near(number, expected, 1e-14);
    assert_ok(dem2d_world_inertial_number(world, -0.01, 1e5, &number)); /* extension */
    assert_near(number, expected, 1e-14);
    number = -1;
    assert_result(dem2d_world_inertial_number(world, NAN, 1e5, &number), DEM2D_NOT_FINITE);
    assert_logged(&env, DEM2D_NOT_FINITE, -1, "strain_rate");
    assert_result(dem2d_world_inertial_number(world, 1, 0, &number), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "pressure");
    assert_result(dem2d_world_inertial_number(world, 1, INFINITY, &number), DEM2D_NOT_FINITE);
    assert_result(dem2d_world_inertial_number(NULL, 1, 1, &number), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_inertial_number(world, 1, 1, NULL), DEM2D_NULL_ARGUMENT);
    assert_true(number == -1);
    dem2d_world_destroy(world);
    assert_clean(&env);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_strain),
        cmocka_unit_test(test_strain_errors),
        cmocka_unit_test(test_principal),
        cmocka_unit_test(test_principal_special),
        cmocka_unit_test(test_squeezed_disc),
        cmocka_unit_test(test_sum_of_stresses),
        cmocka_unit_test(test_axis),
        cmocka_unit_test(test_axis_of_every_model),
        cmocka_unit_test(test_no_axis),
        cmocka_unit_test(test_porosity),
        cmocka_unit_test(test_porosity_exact),
        cmocka_unit_test(test_fabric),
        cmocka_unit_test(test_stress_ratio),
        cmocka_unit_test(test_fabric_few),
        cmocka_unit_test(test_contact_histograms),
        cmocka_unit_test(test_coordination_histogram),
        cmocka_unit_test(test_orientation_histogram),
        cmocka_unit_test(test_histogram_errors),
        cmocka_unit_test(test_equilibrium),
        cmocka_unit_test(test_rest),
        cmocka_unit_test(test_inertial_number),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
