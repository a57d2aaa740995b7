/* Generators: random numbers, gradings, samples drawn from them, and regions filled with grains.
   The oracles are closed forms of the laws, and the geometry of pairs one by one. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"

/* A world with a stone, a heavy material of three times the density, and four shapes: a disc of
   radius 1, an ellipse, a polygon, a rounded one; no walls. */
enum { SHAPES = 4 };

typedef struct bed {
    scene s;
    dem2d_material_id heavy;
    dem2d_shape_id shapes[SHAPES];
} bed;

static const dem2d_vec five[5] = {{-0.9, -0.6}, {0.7, -0.8}, {1.1, 0.1}, {0.4, 0.9}, {-0.6, 0.7}};

static bed open_bed_in(const dem2d_env *env, dem2d_vec cell_a, dem2d_vec cell_b) {
    bed b;
    dem2d_world_desc desc;
    dem2d_material_desc stone = stone_desc(1e7, 0.5);
    dem2d_shape *shape;
    memset(&b, 0, sizeof b);
    memset(&desc, 0, sizeof desc);
    desc.time_step = 1e-5, desc.env = env, desc.cell.a = cell_a, desc.cell.b = cell_b;
    b.s = open_scene(&desc, &stone);
    stone.density *= 3;
    assert_ok(dem2d_world_add_material(b.s.world, &stone, &b.heavy));
    assert_ok(dem2d_shape_create_circle(NULL, 1, &shape));
    b.shapes[0] = give_shape(&b.s, shape);
    assert_ok(dem2d_shape_create_ellipse(NULL, 2, 0.7, &shape));
    b.shapes[1] = give_shape(&b.s, shape);
    assert_ok(dem2d_shape_create_polygon(NULL, five, 5, 0, &shape));
    b.shapes[2] = give_shape(&b.s, shape);
    assert_ok(dem2d_shape_create_polygon(NULL, five, 5, 0.2, &shape));
    b.shapes[3] = give_shape(&b.s, shape);
    return b;
}

static bed open_bed(const dem2d_env *env) {
    return open_bed_in(env, vec(0, 0), vec(0, 0));
}

static dem2d_grain_kind kind_of(const bed *b, int shape, double share) {
    dem2d_grain_kind kind;
    memset(&kind, 0, sizeof kind);
    kind.share = share;
    kind.grain.shape = b->shapes[shape], kind.grain.material = b->s.material;
    return kind;
}

/* Diameter of the circle of equal area, by the exact areas of the templates. */
static double size_of(const bed *b, const dem2d_particle_desc *grain) {
    dem2d_mass mass;
    assert_ok(dem2d_shape_mass(dem2d_world_shape(b->s.world, grain->shape), &mass));
    return 2 * grain->scale * sqrt(mass.area / (double)TEST_PI);
}

/* --- random numbers --------------------------------------------------------------------------- */

/* The first numbers of splitmix64 from the seed 0, as published with its source code. */
static void test_uniform(void **state) {
    static const uint64_t words[3] = {0xE220A8397B1DCDAFu, 0x6E789E6AA1B965F4u,
                                      0x06C45D188009454Fu};
    uint64_t random = 0;
    double sum = 0;
    (void)state;
    for (int i = 0; i < 3; i++)
        assert_same_bits(dem2d_random_uniform(&random), (double)(words[i] >> 11) * 0x1p-53);
    for (int i = 0; i < 100000; i++) {
        const double u = dem2d_random_uniform(&random);
        assert_true(u >= 0 && u < 1);
        sum += u;
    }
    assert_within(sum / 100000, 0.5, 4 * sqrt(1.0 / 12 / 100000));
    assert_true(dem2d_random_uniform(NULL) == 0 && dem2d_random_normal(NULL) == 0);
}

/* Moments and tails against the normal distribution, within four standard errors; the first of a
   seed against the formula in long double. */
static void test_normal(void **state) {
    enum { COUNT = 200000 };
    double sum = 0, squares = 0, fourth = 0;
    int beyond = 0;
    uint64_t random = 7, uniform = 7;
    (void)state;
    const long double u = 1 - (long double)dem2d_random_uniform(&uniform);
    const long double v = (long double)dem2d_random_uniform(&uniform);
    assert_within(dem2d_random_normal(&random), sqrtl(-2 * logl(u)) * cosl(2 * TEST_PI * v), 1e-14);
    for (int i = 0; i < COUNT; i++) {
        const double z = dem2d_random_normal(&random);
        sum += z, squares += z * z, fourth += z * z * z * z;
        beyond += fabs(z) > 1.959963985;
    }
    assert_within(sum / COUNT, 0, 4 / sqrt(COUNT));
    assert_within(squares / COUNT, 1, 4 * sqrt(2.0 / COUNT));
    assert_within(fourth / COUNT, 3, 4 * sqrt(96.0 / COUNT));
    assert_within((double)beyond / COUNT, 0.05, 4 * sqrt(0.05 * 0.95 / COUNT));
}

/* --- gradings ----------------------------------------------------------------------------------
 */

/* What part of a sample has at most this size, by the measure. */
static double part_below(const bed *b, const dem2d_particle_desc *grains, int count,
                         dem2d_measure measure, double size) {
    double part = 0, all = 0;
    for (int i = 0; i < count; i++) {
        const double own = size_of(b, &grains[i]);
        const double dense = grains[i].material.index == b->heavy.index ? 3 : 1;
        const double weight = measure == DEM2D_MEASURE_NUMBER ? 1
                              : measure == DEM2D_MEASURE_AREA ? own * own
                                                              : own * own * dense;
        part += own <= size * (1 + 1e-9) ? weight : 0;
        all += weight;
    }
    return part / all;
}

/* Each point of the curve is met to 1 % of the sample: 1,000 grains and more, three measures, three
   kinds, one of them three times as dense; classes from 1:1 to 1:4, over a decade of size. */
static void test_classes(void **state) {
    static const dem2d_grade curve[] = {{0.01, 0},  {0.013, 9},  {0.02, 22}, {0.02, 35},
                                        {0.03, 50}, {0.045, 50}, {0.05, 80}, {0.1, 100}};
    static dem2d_particle_desc grains[5000];
    bed b = open_bed(NULL);
    (void)state;
    for (int measure = 0; measure < DEM2D_MEASURE_COUNT; measure++)
        for (int count = 1000; count <= 5000; count += 2000) {
            dem2d_grain_kind kinds[3] = {kind_of(&b, 0, 5), kind_of(&b, 1, 3), kind_of(&b, 2, 2)};
            dem2d_grading_desc grading = {0};
            dem2d_draw_desc draw = {0};
            double share[3] = {0}, all = 0;
            int drawn;
            kinds[2].grain.material = b.heavy;
            grading.points = curve, grading.point_count = COUNT_OF(curve);
            grading.kinds = kinds, grading.kind_count = 3;
            grading.measure = (dem2d_measure)measure;
            draw.grading = &grading, draw.count = count, draw.seed = (uint64_t)count;
            assert_ok(dem2d_world_draw(b.s.world, &draw, grains, COUNT_OF(grains), &drawn));
            assert_int_equal(drawn, count);
            for (int i = 0; i < COUNT_OF(curve); i++) {
                if (i + 1 < COUNT_OF(curve) && curve[i].size == curve[i + 1].size) continue;
                assert_within(part_below(&b, grains, drawn, grading.measure, curve[i].size),
                              curve[i].passing / 100, 0.01);
            }
            for (int i = 0; i < drawn; i++) {
                const double size = size_of(&b, &grains[i]);
                const int k = (int)grains[i].shape.index;
                const double weight = measure == DEM2D_MEASURE_NUMBER ? 1
                                      : measure == DEM2D_MEASURE_MASS
                                          ? (k == 2 ? 3 : 1) * size * size
                                          : size * size;
                share[k] += weight, all += weight;
                assert_true(size >= 0.01 * (1 - 1e-12) && size <= 0.1 * (1 + 1e-12));
                assert_true(grains[i].position.x == 0 && grains[i].position.y == 0);
            }
            assert_within(share[0] / all, 0.5, 0.01);
            assert_within(share[1] / all, 0.3, 0.01);
            assert_within(share[2] / all, 0.2, 0.01);
        }
    close_scene(&b.s);
}

/* Passing of the log-normal law by erf, cut off at both ends; of Fuller's by its power. */
static long double law_passing(const dem2d_grading_desc *g, double size) {
    long double at[3];
    const double sizes[3] = {g->least, size, g->greatest};
    for (int i = 0; i < 3; i++)
        at[i] = g->curve == DEM2D_CURVE_FULLER
                    ? powl((long double)sizes[i] / g->greatest, g->exponent)
                    : erfl(logl((long double)sizes[i] / g->median) / g->deviation / sqrtl(2)) / 2;
    return (at[1] - at[0]) / (at[2] - at[0]);
}

/* Within 0.3 % of the sample where the largest of 3,000 grains is itself below 1 % of it. */
static void test_laws(void **state) {
    static dem2d_particle_desc grains[3000];
    bed b = open_bed(NULL);
    (void)state;
    const dem2d_grain_kind kind = kind_of(&b, 1, 1);
    for (int which = 0; which < 6; which++) {
        dem2d_grading_desc g = {0};
        dem2d_draw_desc draw = {0};
        int drawn;
        g.kinds = &kind, g.kind_count = 1, g.least = 1e-3, g.greatest = 8e-3;
        g.measure = (dem2d_measure)(which % 3);
        g.curve = which < 3 ? DEM2D_CURVE_LOGNORMAL : DEM2D_CURVE_FULLER;
        g.median = 3e-3, g.deviation = 0.4, g.exponent = 0.5;
        draw.grading = &g, draw.count = COUNT_OF(grains);
        assert_ok(dem2d_world_draw(b.s.world, &draw, grains, COUNT_OF(grains), &drawn));
        for (double size = 1.1e-3; size < 8e-3; size *= 1.2)
            assert_within(part_below(&b, grains, drawn, g.measure, size), law_passing(&g, size),
                          0.003);
    }
    close_scene(&b.s);
}

/* Of the same size, kind and user's data: structs have gaps that nobody copies. */
static bool same_grain(const dem2d_particle_desc *a, const dem2d_particle_desc *b) {
    return a->scale == b->scale && a->shape.index == b->shape.index &&
           a->material.index == b->material.index && a->angle == b->angle;
}

/* By area, by count, by both; one grain; the same seed, another seed; less room than grains. */
static void test_totals(void **state) {
    static const dem2d_grade curve[] = {{0.01, 0}, {0.03, 1}};
    static dem2d_particle_desc grains[4000], again[4000];
    bed b = open_bed(NULL);
    (void)state;
    const dem2d_grain_kind kind = kind_of(&b, 0, 1);
    dem2d_grading_desc g = {0};
    dem2d_draw_desc draw = {0};
    double area = 0;
    int drawn, other;
    g.points = curve, g.point_count = 2, g.kinds = &kind, g.kind_count = 1;
    draw.grading = &g, draw.area = 0.5;
    assert_ok(dem2d_world_draw(b.s.world, &draw, grains, 4000, &drawn));
    for (int i = 0; i < drawn; i++) area += pow(size_of(&b, &grains[i]), 2) * (double)TEST_PI / 4;
    assert_within(area, 0.5, (double)TEST_PI / 4 * 1e-4); /* a grain of the least size */
    draw.count = 500;
    assert_ok(dem2d_world_draw(b.s.world, &draw, grains, 4000, &drawn));
    assert_int_equal(drawn, 500);
    area = 0;
    for (int i = 0; i < drawn; i++) area += pow(size_of(&b, &grains[i]), 2) * (double)TEST_PI / 4;
    assert_near(area, 0.5, 1e-12);
    assert_ok(dem2d_world_draw(b.s.world, &draw, again, 4000, &other));
    for (int i = 0; i < 500; i++) assert_true(same_grain(&grains[i], &again[i]));
    draw.seed = 1;
    assert_ok(dem2d_world_draw(b.s.world, &draw, again, 20, &other));
    assert_int_equal(other, 500);
    int same = 0;
    for (int i = 0; i < 20; i++) same += same_grain(&grains[i], &again[i]);
    assert_true(same < 3); /* in another order */
    draw.area = 0, draw.count = 1;
    assert_ok(dem2d_world_draw(b.s.world, &draw, again, 1, &other));
    assert_between(size_of(&b, again), 0.01, 0.03);
    draw.area = 1e-9, draw.count = 0; /* less than a grain */
    assert_result(dem2d_world_draw(b.s.world, &draw, again, 1, &other), DEM2D_OUT_OF_RANGE);
    close_scene(&b.s);
}

/* What is wrong between fields, and within the arrays: each names its row. */
static void test_wrong_gradings(void **state) {
    static const struct {
        dem2d_grade points[3];
        dem2d_result result;
        const char *word;
    } bad[] = {
        {{{0.01, 0}, {0.02, NAN}, {0.03, 1}}, DEM2D_NOT_FINITE, "points[1]"},
        {{{0.01, 0}, {0.02, 0.5}, {0.015, 1}}, DEM2D_OUT_OF_RANGE, "points[2]"},
        {{{0.01, 0}, {0.02, 0.5}, {0.03, 0.4}}, DEM2D_OUT_OF_RANGE, "points[2]"},
        {{{0, 0}, {0.02, 0.5}, {0.03, 1}}, DEM2D_OUT_OF_RANGE, "points[0]"},
        {{{0.01, -1}, {0.02, 0.5}, {0.03, 1}}, DEM2D_OUT_OF_RANGE, "points[0]"},
        {{{0.01, 0}, {0.02, 0}, {0.03, 0}}, DEM2D_OUT_OF_RANGE, "points[2]"},
    };
    test_env env;
    (void)state;
    test_env_init(&env);
    bed b = open_bed(&env.env);
    dem2d_grain_kind kind = kind_of(&b, 0, 1);
    dem2d_grading_desc g = {0};
    dem2d_draw_desc draw = {0};
    int drawn = 77;
    g.point_count = 3, g.kinds = &kind, g.kind_count = 1;
    draw.grading = &g, draw.count = 10;
    for (int i = 0; i < COUNT_OF(bad); i++) {
        g.points = bad[i].points;
        assert_result(dem2d_world_draw(b.s.world, &draw, NULL, 0, &drawn), bad[i].result);
        assert_non_null(strstr(env.log.text, bad[i].word));
    }
    g.curve = DEM2D_CURVE_LOGNORMAL, g.least = 1, g.greatest = 2, g.median = 1e9, g.deviation = 0.1;
    assert_result(dem2d_world_draw(b.s.world, &draw, NULL, 0, &drawn), DEM2D_OUT_OF_RANGE);
    assert_non_null(strstr(env.log.text, "nothing between"));
    g.greatest = 1;
    assert_result(dem2d_world_draw(b.s.world, &draw, NULL, 0, &drawn), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "greatest");
    g.curve = DEM2D_CURVE_FULLER, g.greatest = 2;
    assert_result(dem2d_world_draw(b.s.world, &draw, NULL, 0, &drawn), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "exponent");
    g.exponent = 1, kind.share = 0;
    assert_result(dem2d_world_draw(b.s.world, &draw, NULL, 0, &drawn), DEM2D_OUT_OF_RANGE);
    assert_non_null(strstr(env.log.text, "share"));
    kind.share = 1, kind.grain.shape.generation = 9;
    assert_result(dem2d_world_draw(b.s.world, &draw, NULL, 0, &drawn), DEM2D_STALE_ID);
    assert_int_equal(drawn, 77);
    close_scene(&b.s);
    assert_clean(&env);
}

/* --- filling ----------------------------------------------------------------------------------- */

/* Greatest overlap of a grain with the others, walls left out, pair by pair; -gap of the nearest. */
static double nearest(const bed *b, int i, const dem2d_particle_info *grains, int count) {
    double most = -HUGE_VAL;
    for (int k = 0; k < count; k++) {
        dem2d_contact contact;
        if (k == i) continue;
        assert_ok(dem2d_pair_contact(dem2d_world_shape(b->s.world, grains[i].shape), grains[i].pose,
                                     dem2d_world_shape(b->s.world, grains[k].shape), grains[k].pose,
                                     NULL, &contact));
        if (contact.depth > most) most = contact.depth;
    }
    return most;
}

/* A grain is inside an outline, with a gap: 64 points of its boundary are, by winding angles, and no
   nearer to its sides. */
static void check_inside(const bed *b, const dem2d_particle_info *grain, const dem2d_vec *outline,
                         int count, double gap) {
    dem2d_vec rim[64];
    assert_ok(
        dem2d_shape_outline(dem2d_world_shape(b->s.world, grain->shape), grain->pose, 64, rim));
    for (int i = 0; i < 64; i++) {
        double winding = 0, nearest_side = HUGE_VAL;
        for (int k = 0; k < count; k++) {
            const dem2d_vec p = outline[k], q = outline[(k + 1) % count];
            const double px = p.x - rim[i].x, py = p.y - rim[i].y;
            const double qx = q.x - rim[i].x, qy = q.y - rim[i].y;
            winding += atan2(px * qy - py * qx, px * qx + py * qy);
            const double ex = q.x - p.x, ey = q.y - p.y;
            double t = -(px * ex + py * ey) / (ex * ex + ey * ey);
            t = t < 0 ? 0 : t > 1 ? 1 : t;
            nearest_side = fmin(nearest_side, hypot(px + t * ex, py + t * ey));
        }
        assert_within(fabs(winding), 2 * TEST_PI, 1e-6);
        assert_true(nearest_side >= gap - 1e-6 * grain->radius);
    }
}

/* Both methods, boxes and outlines, mixed kinds; obstacles that are there: a fixed grain and a
   segment. Nothing is nearer than the gap; the same again from the same seed. */
static void test_fill(void **state) {
    static const dem2d_vec star[8] = {{0, 0}, {1, 0.3}, {2, 0}, {1.7, 1},
                                      {2, 2}, {1, 1.7}, {0, 2}, {0.3, 1}};
    static const dem2d_vec square[4] = {{0, 0}, {2, 0}, {2, 2}, {0, 2}};
    static const dem2d_grade curve[] = {{0.05, 0}, {0.1, 0.5}, {0.15, 1}};
    static dem2d_particle_info grains[400];
    static dem2d_particle_id ids[400];
    (void)state;
    for (int which = 0; which < 8; which++) {
        const bool random = which & 1, outline = which & 2, obstacles = which & 4;
        const double gap = obstacles ? 0.004 : 0;
        uint64_t hashes[2];
        for (int twice = 0; twice < 2; twice++) {
            bed b = open_bed(NULL);
            const dem2d_grain_kind kinds[3] = {kind_of(&b, 0, 1), kind_of(&b, 1, 1),
                                               kind_of(&b, 3, 1)};
            dem2d_grading_desc g = {0};
            dem2d_fill_desc fill = {0};
            dem2d_filling done;
            int already = 0;
            if (obstacles) {
                add_segment(&b.s, vec(0.4, 0.8), vec(1.6, 1));
                dem2d_particle_desc block = grain_desc(&b.s, b.shapes[1], 0.1, vec(1, 1.3));
                block.motion = DEM2D_FIXED;
                add_grain(&b.s, &block);
                already = 1;
            }
            g.points = curve, g.point_count = 3, g.kinds = kinds, g.kind_count = 3;
            fill.grading = &g, fill.solid_fraction = random ? 0.25 : 0.07, fill.gap = gap;
            fill.region.box.upper = vec(2, 2), fill.seed = 5;
            fill.method = random ? DEM2D_FILL_RANDOM : DEM2D_FILL_LATTICE;
            if (outline) fill.region.points = star, fill.region.count = COUNT_OF(star);
            assert_ok(dem2d_world_fill(b.s.world, &fill, ids, COUNT_OF(ids), &done));
            assert_within(done.solid_fraction, fill.solid_fraction, 0.003);
            assert_true(done.count > 10 && done.count < COUNT_OF(ids) - 1);
            hashes[twice] = dem2d_world_hash(b.s.world);
            for (int i = 0; i < done.count; i++) grains[i] = grain_of(&b.s, ids[i]);
            int all;
            dem2d_particle_id every[400];
            assert_ok(dem2d_world_particles(b.s.world, every, 400, &all));
            assert_int_equal(all, done.count + already);
            if (already > 0) grains[done.count] = grain_of(&b.s, every[0]);
            for (int i = 0; i < done.count; i++) {
                assert_true(nearest(&b, i, grains, all) <= -gap + 1e-8);
                check_inside(&b, &grains[i], outline ? star : square, outline ? 8 : 4, gap);
                if (!obstacles) continue;
                dem2d_hit hit;
                const dem2d_query_desc walls = {.skip_particles = true};
                assert_ok(dem2d_world_nearest(b.s.world, grains[i].pose.position, 0, &walls, &hit));
                if (grains[i].shape.index == 0)
                    assert_true(hit.distance - grains[i].radius >= gap - 1e-8);
                int found;
                dem2d_found walls_found[4];
                assert_ok(
                    dem2d_world_particle_overlaps(b.s.world, ids[i], NULL, walls_found, 4, &found));
                assert_int_equal(found, 0);
            }
            close_scene(&b.s);
        }
        assert_true(hashes[0] == hashes[1]);
    }
}

/* Too much: nothing is added, and the log says how far it came; with partial, as many as fit. */
static void test_full(void **state) {
    test_env env;
    (void)state;
    test_env_init(&env);
    bed b = open_bed(&env.env);
    dem2d_particle_desc grains[40];
    dem2d_particle_id ids[40];
    dem2d_filling done = {0};
    for (int i = 0; i < 40; i++) {
        grains[i] = grain_desc(&b.s, b.shapes[0], i == 7 ? 0.6 : 0.1, vec(NAN, 0));
        grains[i].user_data = (uint64_t)i;
    }
    for (int method = 0; method < DEM2D_FILL_METHOD_COUNT; method++) {
        dem2d_fill_desc fill = {0};
        memset(&done, 0, sizeof done);
        fill.grains = grains, fill.count = 40, fill.region.box.upper = vec(1, 1);
        fill.method = (dem2d_fill_method)method, fill.tries = 50;
        const uint64_t before = dem2d_world_hash(b.s.world);
        assert_result(dem2d_world_fill(b.s.world, &fill, ids, 40, &done), DEM2D_NOT_REACHED);
        assert_non_null(strstr(env.log.text, "of 40 grains have found room"));
        assert_int_equal(done.count, 0);
        assert_true(dem2d_world_hash(b.s.world) == before);
        grains[7].scale = 0.1;
        fill.partial = true;
        assert_ok(dem2d_world_fill(b.s.world, &fill, ids, 40, &done));
        assert_between(done.count, 10, 39);
        assert_near(done.solid_fraction, done.count * 0.01 * (double)TEST_PI, 1e-12);
        int placed = 0;
        for (int i = 0; i < 40; i++) {
            if (ids[i].generation == 0) continue;
            assert_true(grain_of(&b.s, ids[i]).user_data == (uint64_t)i); /* in the given order */
            assert_ok(dem2d_world_remove_particle(b.s.world, ids[i]));
            placed++;
        }
        assert_int_equal(placed, done.count);
        grains[7].scale = 0.6;
    }
    close_scene(&b.s);
    assert_clean(&env);
}

/* A lattice that just fits: 10 x 10 discs of diameter 0.1 in a box of side 1, without and with a
   gap that takes the rest. Nothing to place is no error; both, none of grading and grains is one. */
static void test_exact(void **state) {
    bed b = open_bed(NULL);
    (void)state;
    dem2d_particle_desc grains[100];
    dem2d_fill_desc fill = {0};
    dem2d_filling done;
    for (int i = 0; i < 100; i++) grains[i] = grain_desc(&b.s, b.shapes[0], 0.05, vec(0, 0));
    fill.grains = grains, fill.count = 0, fill.region.box.upper = vec(1, 1);
    assert_ok(dem2d_world_fill(b.s.world, &fill, NULL, 0, &done));
    assert_int_equal(done.count, 0);
    fill.count = 100;
    assert_ok(dem2d_world_fill(b.s.world, &fill, NULL, 0, &done));
    assert_int_equal(done.count, 100);
    step(&b.s, 1);
    assert_within(packing_of(&b.s).max_overlap, 0, 1e-12);
    fill.grains = NULL;
    assert_result(dem2d_world_fill(b.s.world, &fill, NULL, 0, &done), DEM2D_NULL_ARGUMENT);
    close_scene(&b.s);
    b = open_bed(NULL);
    for (int i = 0; i < 100; i++) grains[i].scale = 0.045;
    fill.grains = grains, fill.gap = 0.0099 / 1.1;
    assert_ok(dem2d_world_fill(b.s.world, &fill, NULL, 0, &done));
    assert_int_equal(done.count, 100);
    close_scene(&b.s);
}

/* The grading of a world is that of what was filled in; sensors do not count. */
static void test_measured(void **state) {
    static const dem2d_grade curve[] = {{0.02, 0.25}, {0.04, 0.25}, {0.04, 1}};
    static const double sizes[4] = {0.0199, 0.02, 0.0399, 0.04};
    double passing[4] = {7, 7, 7, 7};
    (void)state;
    bed b = open_bed(NULL);
    const dem2d_grain_kind kinds[2] = {kind_of(&b, 0, 1), kind_of(&b, 2, 1)};
    dem2d_grading_desc g = {0};
    dem2d_fill_desc fill = {0};
    dem2d_filling done;
    assert_ok(dem2d_world_grading(b.s.world, DEM2D_MEASURE_MASS, sizes, 4, passing));
    assert_true(passing[0] == 0 && passing[3] == 0);
    g.points = curve, g.point_count = 3, g.kinds = kinds, g.kind_count = 2;
    fill.grading = &g, fill.count = 1000, fill.solid_fraction = 0; /* sizes as given */
    fill.region.box.upper = vec(3, 3), fill.seed = 3;
    assert_ok(dem2d_world_fill(b.s.world, &fill, NULL, 0, &done));
    dem2d_particle_desc sensor = grain_desc(&b.s, b.shapes[0], 10, vec(0, 0));
    sensor.groups.sensor = true;
    add_grain(&b.s, &sensor);
    assert_ok(dem2d_world_grading(b.s.world, DEM2D_MEASURE_MASS, sizes, 4, passing));
    assert_true(passing[0] == 0 && passing[3] == 1 && passing[1] == passing[2]);
    assert_within(passing[1], 0.25, 0.003);
    assert_ok(dem2d_world_grading(b.s.world, DEM2D_MEASURE_NUMBER, sizes, 4, passing));
    assert_within(passing[1], 0.25 / (0.25 + 0.75 / 4), 0.003); /* a fourth of the area each */
    close_scene(&b.s);
}

/* Random sequential addition of discs up to a coverage of 0.2: the chance of a try is 1 - 4 x +
   6 sqrt(3)/pi x^2 + (40 sqrt(3)/(3 pi) - 176/(3 pi^2)) x^3 at a coverage x (Schaaf, Talbot 1989,
   J. Chem. Phys. 91, 4401), so the number of tries follows from an integral. At the walls, within a
   diameter, a disc excludes less. */
static void test_random_addition(void **state) {
    const double radius = 0.004, own = (double)TEST_PI * radius * radius;
    bed b = open_bed(NULL);
    (void)state;
    const dem2d_grain_kind kind = kind_of(&b, 0, 1);
    const dem2d_grade one = {2 * radius, 1};
    dem2d_grading_desc g = {0};
    dem2d_fill_desc fill = {0};
    dem2d_filling done;
    const double pi = (double)TEST_PI, root3 = sqrt(3);
    double tries = 0;
    g.points = &one, g.point_count = 1, g.kinds = &kind, g.kind_count = 1;
    fill.grading = &g, fill.count = (int)(0.2 / own), fill.method = DEM2D_FILL_RANDOM;
    fill.region.box.upper = vec(1, 1), fill.seed = 1;
    assert_ok(dem2d_world_fill(b.s.world, &fill, NULL, 0, &done));
    assert_int_equal(done.count, fill.count);
    for (int i = 0; i < done.count; i++) {
        const double x = i * own / pow(1 - 2 * radius, 2); /* of the places for centres */
        tries += 1 / (1 - 4 * x + 6 * root3 / pi * x * x +
                      (40 * root3 / (3 * pi) - 176 / (3 * pi * pi)) * x * x * x);
    }
    assert_near((double)done.tries, tries, 0.03);
    close_scene(&b.s);
}

/* --- inlets and outlets ------------------------------------------------------------------------
 */

/* A shaft of 0.5 m by 1 m, open below, with an inlet at its top; grains fall through. Gravity only
   once it is asked for. */
static bed open_shaft(void) {
    bed b = open_bed(NULL);
    add_plane(&b.s, 0, 0, 1, 0);
    add_plane(&b.s, 0.5, 0, -1, 0);
    return b;
}

static dem2d_inlet_desc top_inlet(const dem2d_grading_desc *grading) {
    dem2d_inlet_desc d = {0};
    d.grading = grading;
    d.region.box.lower = vec(0, 0.8), d.region.box.upper = vec(0.5, 1);
    return d;
}

/* By mass and by number, in calls of any length: what has come in is rate times time to within one
   grain, the grading is met to 1.5 % by a thousand grains, nothing overlaps. The curve of all
   grains that ever came in is measured from the world, which keeps them: they move up and out of
   the way. */
static void test_inlet(void **state) {
    static const dem2d_grade curve[] = {{0.004, 0}, {0.006, 0.2}, {0.01, 0.7}, {0.02, 1}};
    (void)state;
    for (int by_number = 0; by_number < 2; by_number++) {
        bed b = open_bed(NULL);
        dem2d_grain_kind kinds[2] = {kind_of(&b, 0, 3), kind_of(&b, 1, 1)};
        dem2d_grading_desc g = {0};
        dem2d_inlet inlet = {0};
        double seconds = 0, mass = 0, passing[2], heavy = 0;
        kinds[1].grain.material = b.heavy;
        g.points = curve, g.point_count = 4, g.kinds = kinds, g.kind_count = 2;
        dem2d_inlet_desc d = top_inlet(&g);
        if (by_number)
            d.number_rate = 2000;
        else
            d.mass_rate = 400;
        d.velocity = vec(0.3, 8), d.gap = 1e-4, inlet.seed = 11;
        assert_ok(dem2d_world_set_time_step(b.s.world, 5e-4));
        for (int call = 0; call < 250; call++) {
            const double part = 0.002 + 0.001 * (call % 5);
            assert_ok(dem2d_world_feed(b.s.world, &d, part, &inlet));
            seconds += part;
            assert_true(inlet.missed == 0);
            step(&b.s, 8); /* 4 ms: 3 cm */
        }
        dem2d_particle_id ids[4000];
        int count;
        assert_ok(dem2d_world_particles(b.s.world, ids, COUNT_OF(ids), &count));
        assert_int_equal(count, inlet.count);
        for (int i = 0; i < count; i++) {
            const dem2d_particle_info info = grain_of(&b.s, ids[i]);
            mass += info.mass, heavy += info.material.index == b.heavy.index ? info.mass : 0;
        }
        assert_near(inlet.mass, mass, 1e-12);
        if (by_number)
            assert_within(count, 2000 * seconds, 1 + 1e-9);
        else
            assert_within(mass, 400 * seconds, 3 * 2700 * 4e-4);
        assert_near(mass + (by_number ? 0 : inlet.due), by_number ? mass : 400 * seconds, 1e-9);
        assert_true(count > 900);
        const double sizes[2] = {0.006, 0.01};
        assert_ok(dem2d_world_grading(b.s.world, DEM2D_MEASURE_MASS, sizes, 2, passing));
        assert_within(passing[0], 0.2, 0.015);
        assert_within(passing[1], 0.7, 0.015);
        assert_within(heavy / mass, 0.25, 0.015);
        assert_true(packing_of(&b.s).max_overlap < 1e-3);
        close_scene(&b.s);
    }
}

/* Mean and spread of the velocities, before any grain has met another. */
static void test_inlet_velocities(void **state) {
    static const dem2d_grade one = {0.004, 1};
    bed b = open_bed(NULL);
    (void)state;
    const dem2d_grain_kind kind = kind_of(&b, 0, 1);
    dem2d_grading_desc g = {0};
    dem2d_inlet inlet = {0};
    dem2d_particle_id ids[2000];
    double mean[2] = {0}, squares[2] = {0};
    int count;
    g.points = &one, g.point_count = 1, g.kinds = &kind, g.kind_count = 1;
    dem2d_inlet_desc d = top_inlet(&g);
    d.number_rate = 2000, d.velocity = vec(0.3, -8), d.spread = 0.2;
    assert_ok(dem2d_world_feed(b.s.world, &d, 1, &inlet));
    assert_ok(dem2d_world_particles(b.s.world, ids, COUNT_OF(ids), &count));
    assert_int_equal(count, 2000);
    for (int i = 0; i < count; i++) {
        const dem2d_vec v = grain_of(&b.s, ids[i]).velocity;
        mean[0] += v.x, squares[0] += pow(v.x - 0.3, 2);
        mean[1] += v.y, squares[1] += pow(v.y + 8, 2);
    }
    for (int k = 0; k < 2; k++) {
        assert_within(mean[k] / count, k == 0 ? 0.3 : -8, 4 * 0.2 / sqrt(count));
        assert_within(squares[k] / count, 0.04, 4 * 0.04 * sqrt(2.0 / count));
    }
    close_scene(&b.s);
}

/* The region gets full: what finds no room is missed, the rest goes on, and nothing is made up for.
   A state that was saved goes on with the same bits. */
static void test_inlet_behind(void **state) {
    static const dem2d_grade curve[] = {{0.05, 0}, {0.08, 1}};
    uint64_t hashes[2];
    dem2d_inlet last[2];
    (void)state;
    for (int twice = 0; twice < 2; twice++) {
        bed b = open_shaft();
        const dem2d_grain_kind kind = kind_of(&b, 2, 1);
        dem2d_grading_desc g = {0};
        dem2d_inlet inlet = {0};
        g.points = curve, g.point_count = 2, g.kinds = &kind, g.kind_count = 1;
        dem2d_inlet_desc d = top_inlet(&g);
        d.number_rate = 100;
        assert_ok(dem2d_world_feed(b.s.world, &d, 0, &inlet));
        assert_int_equal(inlet.count, 0);
        assert_ok(dem2d_world_feed(b.s.world, &d, 0.0501, &inlet));
        assert_int_equal(inlet.count, 5);
        assert_within(inlet.due, 0.01, 1e-12);
        assert_ok(dem2d_world_feed(b.s.world, &d, 1, &inlet)); /* 100 more: too many */
        assert_between((double)inlet.count, 8, 30);
        assert_within((double)inlet.count + inlet.missed, 105.01, 1e-9);
        assert_true(inlet.due == 0);
        if (twice == 1) { /* into another world */
            scene_bytes bytes = scene_save(b.s.world);
            const scene other = scene_load(&b.s, &bytes);
            free(bytes.bytes);
            close_scene(&b.s);
            b.s = other;
            dem2d_inlet copy;
            memcpy(&copy, &inlet, sizeof copy);
            inlet = copy;
        }
        dem2d_flow flow = {0};
        const dem2d_region all = {.box = d.region.box};
        assert_ok(dem2d_world_remove_in(b.s.world, &all, &flow));
        assert_int_equal(flow.count, inlet.count);
        assert_near(flow.mass, inlet.mass, 1e-12);
        assert_near(flow.area, inlet.area, 1e-12);
        assert_ok(dem2d_world_feed(b.s.world, &d, 0.03, &inlet));
        assert_int_equal(stats_of(&b.s).particles, 3);
        hashes[twice] = dem2d_world_hash(b.s.world), last[twice] = inlet;
        d.mass_rate = 1;
        assert_result(dem2d_world_feed(b.s.world, &d, 0.03, &inlet), DEM2D_OUT_OF_RANGE);
        d.mass_rate = 0;
        assert_result(dem2d_world_feed(b.s.world, &d, 1e9, &inlet), DEM2D_OUT_OF_RANGE);
        close_scene(&b.s);
    }
    assert_true(hashes[0] == hashes[1]);
    assert_true(last[0].random == last[1].random && last[0].missed == last[1].missed);
}

static double all_mass(const bed *b) {
    dem2d_particle_id ids[400];
    double mass = 0;
    int count;
    assert_ok(dem2d_world_particles(b->s.world, ids, COUNT_OF(ids), &count));
    assert_true(count <= COUNT_OF(ids));
    for (int i = 0; i < count; i++) mass += grain_of(&b->s, ids[i]).mass;
    return mass;
}

/* An inlet that replaces what has left: the mass in the world stays the same within a grain; what
   finds no room stays due until there is. */
static void test_replaced(void **state) {
    static const dem2d_grade curve[] = {{0.02, 0}, {0.04, 1}};
    (void)state;
    test_env env;
    test_env_init(&env);
    bed b = open_bed(&env.env);
    const dem2d_grain_kind kind = kind_of(&b, 1, 1);
    dem2d_grading_desc g = {0};
    dem2d_inlet inlet = {0};
    dem2d_flow out = {0};
    double heaviest = 2700 * 0.04 * 0.04 * (double)TEST_PI / 4;
    add_plane(&b.s, 0, 0, 1, 0), add_plane(&b.s, 0.5, 0, -1, 0);
    g.points = curve, g.point_count = 2, g.kinds = &kind, g.kind_count = 1;
    dem2d_inlet_desc d = top_inlet(&g);
    d.replaced = &out;
    assert_ok(dem2d_world_feed(b.s.world, &d, 100, &inlet));
    assert_int_equal(inlet.count, 0);
    out.mass = 60; /* at first: what is to be in the shaft */
    assert_ok(dem2d_world_feed(b.s.world, &d, 0, &inlet));
    assert_within(inlet.mass + inlet.due, 60, 1e-9);
    assert_true(inlet.due >= 0 && inlet.due <= heaviest && inlet.missed == 0);
    for (int k = 0; k < 6; k++) {
        const dem2d_region half = {.box = {{k % 2 ? 0.25 : 0, 0}, {k % 2 ? 0.5 : 0.25, 1}}};
        assert_ok(dem2d_world_remove_in(b.s.world, &half, &out));
        assert_ok(dem2d_world_feed(b.s.world, &d, 0, &inlet));
        assert_within(all_mass(&b) + inlet.due, 60, 1e-9);
        assert_true(inlet.due <= heaviest);
    }
    out.mass += 1000; /* more than there is room for: 0.1 m2 hold at most 270 kg */
    assert_ok(dem2d_world_feed(b.s.world, &d, 0, &inlet));
    assert_true(inlet.due > 800 && inlet.missed == 0);
    assert_within(inlet.mass + inlet.due, out.mass, 1e-9);
    d.mass_rate = 1;
    assert_result(dem2d_world_feed(b.s.world, &d, 0, &inlet), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "replaced");
    d.mass_rate = 0, out.mass = (double)NAN;
    assert_result(dem2d_world_feed(b.s.world, &d, 0, &inlet), DEM2D_NOT_FINITE);
    assert_logged(&env, DEM2D_NOT_FINITE, -1, "replaced");
    close_scene(&b.s);
    assert_clean(&env);
}

/* Grains that fly across a line: each is counted once, with its sign, not beside the line; what a
   caller moves across is not. The outlet takes free grains alone, in a box or in an outline. */
static void test_flow(void **state) {
    static const dem2d_vec notch[5] = {{0, 0}, {2, 0}, {2, 2}, {1, 1}, {0, 2}};
    (void)state;
    bed b = open_bed(NULL);
    dem2d_flow right = {0}, down = {0};
    dem2d_particle_id ids[40];
    for (int i = 0; i < 40; i++) {
        dem2d_particle_desc grain = grain_desc(&b.s, b.shapes[i % 4], 0.01, vec(i % 2, 0.1 * i));
        grain.velocity = vec(i % 2 ? -5 : 5, 0); /* over x = 0.5 after 0.1 s */
        ids[i] = add_grain(&b.s, &grain);
    }
    assert_ok(dem2d_world_set_time_step(b.s.world, 1e-4));
    for (int k = 0; k < 1500; k++) {
        step(&b.s, 1);
        assert_ok(dem2d_world_flow(b.s.world, vec(0.5, 0.05), vec(0.5, 10), &right));
        assert_ok(dem2d_world_flow(b.s.world, vec(0.3, 10), vec(0.3, 1.95), &down));
    }
    assert_int_equal(right.count, 1); /* left 20 that start at 1; right 19: one passes below */
    assert_int_equal(down.count, 0);  /* 10 each way above 1.95 */
    dem2d_particle_info info = grain_of(&b.s, ids[1]);
    double mass = 0;
    for (int i = 0; i < 40; i++) {
        info = grain_of(&b.s, ids[i]);
        if (i > 0) mass += i % 2 ? info.mass : -info.mass;
    }
    assert_within(right.mass, mass, 1e-12 * info.mass * 40);
    assert_ok(dem2d_world_move_particle(b.s.world, ids[0], vec(0, 5), 0));
    assert_ok(dem2d_world_flow(b.s.world, vec(0.5, 0.05), vec(0.5, 10), &right));
    assert_int_equal(right.count, 1);
    assert_result(dem2d_world_flow(b.s.world, vec(1, 1), vec(1, 1), &right), DEM2D_OUT_OF_RANGE);
    close_scene(&b.s);

    b = open_bed(NULL);
    for (int i = 0; i < 5; i++) { /* in, in the notch, in, outside, in but fixed */
        const dem2d_vec at[5] = {{0.3, 1.5}, {1, 1.2}, {1.9, 1.8}, {2.1, 1}, {1, 0.5}};
        dem2d_particle_desc grain = grain_desc(&b.s, b.shapes[0], 0.05, at[i]);
        if (i == 4) grain.motion = DEM2D_FIXED;
        ids[i] = add_grain(&b.s, &grain);
    }
    const dem2d_region region = {.points = notch, .count = 5};
    dem2d_flow out = {0};
    assert_ok(dem2d_world_remove_in(b.s.world, &region, &out));
    assert_int_equal(out.count, 2);
    assert_near(out.mass, 2 * 2700 * (double)TEST_PI * 0.0025, 1e-12);
    assert_ok(dem2d_world_remove_in(b.s.world, &region, NULL));
    assert_int_equal(stats_of(&b.s).particles, 3);
    assert_result(dem2d_world_get_particle(b.s.world, ids[0], &info), DEM2D_STALE_ID);
    assert_ok(dem2d_world_get_particle(b.s.world, ids[1], &info));
    close_scene(&b.s);
}

/* Greatest overlap of a grain with the images of all, and with its own but the one of no shift. */
static double nearest_image(const bed *b, int i, const dem2d_particle_info *grains, int count,
                            const dem2d_cell *cell) {
    double most = -HUGE_VAL;
    for (int k = 0; k < count; k++)
        for (int n = -2; n <= 2; n++)
            for (int m = -2; m <= 2; m++) {
                dem2d_particle_info image = grains[k];
                image.pose.position.x += m * cell->a.x + n * cell->b.x;
                image.pose.position.y += n * cell->b.y;
                const dem2d_particle_info pair[2] = {grains[i], image};
                const dem2d_vec x = grains[i].pose.position, y = image.pose.position;
                if ((k == i && n == 0 && m == 0) || hypot(x.x - y.x, x.y - y.y) > 0.5) continue;
                most = fmax(most, nearest(b, 0, pair, 2));
            }
    return most;
}

/* Filling of cells: upright and oblique, of all of the cell or along one vector, by both methods,
   with a gap, beside a grain across the border that is there already and, where the cell is
   periodic along x alone, between walls. No grain or image is nearer than the gap, grains stand on
   the border, and the area is what was asked for; then the same by an inlet. */
static void test_fill_in_cell(void **state) {
    static const dem2d_grade curve[] = {{0.05, 0}, {0.1, 0.5}, {0.15, 1}};
    static dem2d_particle_info grains[400];
    (void)state;
    for (int which = 0; which < 12; which++) {
        const bool random = which & 1;
        const int kind_of_cell = which / 2 % 3, gap = which / 6; /* upright, oblique, along a */
        bed b = open_bed_in(NULL, vec(2, 0),
                            vec(kind_of_cell == 1 ? 0.8 : 0, kind_of_cell < 2 ? 2 : 0));
        const dem2d_grain_kind kinds[3] = {kind_of(&b, 0, 1), kind_of(&b, 1, 1), kind_of(&b, 3, 1)};
        dem2d_grading_desc g = {0};
        dem2d_fill_desc fill = {0};
        dem2d_inlet_desc inlet = {0};
        dem2d_inlet through = {0};
        dem2d_particle_id ids[400];
        dem2d_filling done;
        dem2d_cell cell = {{2, 0}, {kind_of_cell == 1 ? 0.8 : 0, 2}, {0, 0}};
        int count, across = 0;
        dem2d_particle_desc block = grain_desc(&b.s, b.shapes[1], 0.1, vec(0.05, 1));
        block.motion = DEM2D_FIXED;
        add_grain(&b.s, &block);
        if (kind_of_cell == 2) add_plane(&b.s, 0, 0.3, 0, 1), add_plane(&b.s, 0, 1.7, 0, -1);
        g.points = curve, g.point_count = 3, g.kinds = kinds, g.kind_count = 3;
        fill.grading = &g, fill.solid_fraction = random ? 0.25 : 0.07, fill.gap = 0.01 * gap;
        fill.seed = 5, fill.method = random ? DEM2D_FILL_RANDOM : DEM2D_FILL_LATTICE;
        if (kind_of_cell == 2) fill.region.box.lower.y = 0.2, fill.region.box.upper.y = 1.8;
        assert_ok(dem2d_world_fill(b.s.world, &fill, ids, COUNT_OF(ids), &done));
        const double room = kind_of_cell == 2 ? 2 * 1.6 : 4;
        assert_within(done.area, fill.solid_fraction * room, 0.02);
        inlet.grading = &g, inlet.number_rate = 1, inlet.tries = 10000, inlet.region = fill.region,
        inlet.gap = fill.gap;
        assert_ok(dem2d_world_feed(b.s.world, &inlet, 5, &through));
        assert_int_equal(through.count, 5);
        assert_ok(dem2d_world_particles(b.s.world, ids, COUNT_OF(ids), &count));
        assert_int_equal(count, done.count + 6);
        for (int i = 0; i < count; i++) grains[i] = grain_of(&b.s, ids[i]);
        for (int i = 0; i < count; i++) {
            const dem2d_vec x = grains[i].pose.position;
            assert_true(nearest_image(&b, i, grains, count, &cell) <= -fill.gap + 1e-8);
            const double left = x.x - x.y * cell.b.x / 2;
            across += left < 0.1 || left > 1.9;
            if (kind_of_cell == 2) assert_between(x.y, 0.31, 1.69);
        }
        assert_true(across > 1);
        step(&b.s, 1);
        assert_true(packing_of(&b.s).max_overlap < 1e-8);
        close_scene(&b.s);
    }
}

/* What a cell refuses, and a box of one period: all of each grain is inside. A grain that would
   overlap its own image finds no room, nor one with a gap as wide as the cell. */
static void test_fill_refused(void **state) {
    test_env env;
    (void)state;
    test_env_init(&env);
    bed b = open_bed_in(&env.env, vec(2, 0), vec(0.5, 1));
    dem2d_particle_desc grains[20];
    dem2d_particle_id ids[20];
    dem2d_fill_desc fill = {0};
    dem2d_filling done;
    for (int i = 0; i < 20; i++) grains[i] = grain_desc(&b.s, b.shapes[1], 0.1, vec(NAN, 0));
    fill.grains = grains, fill.count = 20, fill.method = DEM2D_FILL_RANDOM;
    fill.region.box.upper = vec(2.1, 1);
    assert_result(dem2d_world_fill(b.s.world, &fill, NULL, 0, &done), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "greater than the cell");
    fill.region.box.upper = vec(2, 0); /* along b alone, which leans */
    assert_result(dem2d_world_fill(b.s.world, &fill, NULL, 0, &done), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "leans");
    fill.region.box.lower = vec(1, 3), fill.region.box.upper = vec(3, 4); /* once around */
    assert_ok(dem2d_world_fill(b.s.world, &fill, ids, 20, &done));
    assert_int_equal(done.count, 20);
    for (int i = 0; i < 20; i++) {
        double left = grain_of(&b.s, ids[i]).pose.position.x;
        left -= 3 * 0.5;                   /* the box is three cells up */
        left -= 2 * floor((left + 1) / 2); /* from -1 */
        assert_true(left > -1 + 0.07 || left < 1 - 0.07);
    }
    grains[0].scale = 0.26; /* 1.04 long, in a cell 1 high */
    grains[0].angle = (double)TEST_PI / 2;
    fill.count = 1, fill.keep_angles = true, fill.region.box.lower = fill.region.box.upper;
    assert_result(dem2d_world_fill(b.s.world, &fill, NULL, 0, &done), DEM2D_NOT_REACHED);
    fill.gap = 1e6, grains[0].scale = 0.1; /* of a million cells */
    assert_result(dem2d_world_fill(b.s.world, &fill, NULL, 0, &done), DEM2D_NOT_REACHED);
    close_scene(&b.s);
    assert_clean(&env);
}

/* Whole numbers passed on the way from one place to another. */
static int64_t passed(double from, double to) {
    return (int64_t)(floor(to) - floor(from));
}

/* A gas in a cell: across a line from border to border each disc counts as often as its path in
   units of the cell, without wraps, has passed a whole number. The cell stands still (0), is
   sheared until its second vector is replaced (1), is extended and compressed (2). Parts of the
   line add up to all of it; a line of three cells counts three times. */
static void test_flow_in_cell(void **state) {
    enum { DISCS = 30, STEPS = 1500 };
    (void)state;
    for (int k = 0; k < 3; k++) {
        const dem2d_material_desc stone = material_desc(2700, 1e4, 0, 0);
        const dem2d_deformation_desc deform = {
            .xy = k == 1 ? 1.1 : 0, .xx = k == 2 ? 0.2 : 0, .yy = k == 2 ? -0.2 : 0};
        dem2d_world_desc desc = {0};
        dem2d_particle_id ids[DISCS];
        dem2d_vec place[DISCS];
        dem2d_cell_info info;
        dem2d_flow up = {0}, parts = {0}, three = {0}, left = {0};
        int64_t ups = 0, lefts = 0, all = 0;
        uint64_t random = 3;
        desc.time_step = 1e-3, desc.cell.a = vec(1, 0), desc.cell.b = vec(0, 0.7);
        desc.cell.origin = vec(0.3, -0.2);
        scene s = open_scene(&desc, &stone);
        const dem2d_shape_id disc = give_shape(&s, make_disc(0.004));
        for (int i = 0; i < DISCS; i++) {
            dem2d_particle_desc g = grain_desc(&s, disc, 1, vec(0, 0));
            g.position.x = dem2d_random_uniform(&random),
            g.position.y = dem2d_random_uniform(&random);
            g.velocity.x = 1 + 3 * dem2d_random_normal(&random);
            g.velocity.y = 1 + 3 * dem2d_random_normal(&random);
            ids[i] = add_grain(&s, &g);
            place[i] = grain_of(&s, ids[i]).pose.position;
        }
        assert_ok(dem2d_world_deform(s.world, &deform));
        assert_ok(dem2d_world_get_cell(s.world, &info));
        for (int n = 0; n < STEPS; n++) {
            const dem2d_cell old = info.cell;
            const double high = 0.1, far = 0.77;
            step(&s, 1);
            assert_ok(dem2d_world_get_cell(s.world, &info));
            const dem2d_vec a = info.cell.a, b = info.cell.b, o = old.origin;
            const dem2d_vec start = vec(0.3, high), end = vec(0.3 + a.x, high);
            const dem2d_vec middle = vec(0.3 + 0.4 * a.x, high);
            assert_ok(dem2d_world_flow(s.world, start, end, &up));
            assert_ok(dem2d_world_flow(s.world, start, middle, &parts));
            assert_ok(dem2d_world_flow(s.world, middle, end, &parts));
            assert_ok(dem2d_world_flow(s.world, vec(-8, high), vec(-8 + 3 * a.x, high), &three));
            assert_ok(dem2d_world_flow(s.world, vec(far, 5), vec(far, 5 + b.y), &left));
            for (int i = 0; i < DISCS; i++) {
                const dem2d_vec now = grain_of(&s, ids[i]).pose.position;
                const double t0 = (place[i].y - o.y) / old.b.y, s0 = (place[i].x - o.x) / old.a.x;
                double t = (now.y - o.y) / b.y, along = (now.x - o.x) / a.x;
                t -= rint(t - t0), along -= rint(along - s0);
                const int64_t over = passed(t0 - (high - o.y) / old.b.y, t - (high - o.y) / b.y);
                ups += over, all += llabs(over);
                lefts -= passed(s0 - (far - o.x) / old.a.x, along - (far - o.x) / a.x);
                place[i] = now;
            }
        }
        assert_true(k != 1 || info.cell.b.x < 0.4);
        assert_true(all > 100 && ups != 0);
        assert_int_equal(up.count, ups);
        assert_near(up.mass, (double)ups * 2700 * (double)TEST_PI * 1.6e-5, 1e-12);
        assert_int_equal(parts.count, ups);
        assert_int_equal(three.count, 3 * ups);
        if (k != 1) assert_int_equal(left.count, lefts); /* b leans */
        assert_result(dem2d_world_flow(s.world, vec(0, 0), vec(0, 1e4), &up), DEM2D_OUT_OF_RANGE);
        assert_ok(dem2d_world_move_particle(s.world, ids[0], vec(0.5, 50), 0));
        up.count = 0;
        assert_ok(dem2d_world_flow(s.world, vec(0.3, 10), vec(0.31, 10), &up));
        assert_true(up.count <= 1);
        close_scene(&s);
    }
}

/* In a cell with one period, along x or y: a line along it is crossed by free discs once for each
   period of its length, a line across it by all that come round, however far they have gone. */
static void test_flow_one_period(void **state) {
    enum { DISCS = 30, STEPS = 1500 };
    (void)state;
    for (int k = 0; k < 2; k++) {
        const double period = k == 0 ? 1 : 0.7, high = 0.1, far = 0.37;
        const dem2d_material_desc stone = material_desc(2700, 1e4, 0, 0);
        dem2d_world_desc desc = {0};
        dem2d_particle_id ids[DISCS];
        dem2d_vec place[DISCS];
        dem2d_flow over = {0}, three = {0}, round = {0}, none = {0};
        int64_t overs = 0, rounds = 0, all = 0;
        uint64_t random = 5;
        desc.time_step = 1e-3, desc.cell.origin = vec(0.3, -0.2);
        desc.cell.a.x = k == 0 ? period : 0, desc.cell.b.y = k == 0 ? 0 : period;
        const scene s = open_scene(&desc, &stone);
        const dem2d_shape_id disc = give_shape(&s, make_disc(0.004));
        for (int i = 0; i < DISCS; i++) {
            dem2d_particle_desc g = grain_desc(&s, disc, 1, vec(0, 0));
            g.position.x = dem2d_random_uniform(&random);
            g.position.y = dem2d_random_uniform(&random);
            g.velocity.x = 1 + 3 * dem2d_random_normal(&random);
            g.velocity.y = 1 + 3 * dem2d_random_normal(&random);
            ids[i] = add_grain(&s, &g);
            place[i] = grain_of(&s, ids[i]).pose.position;
        }
        for (int n = 0; n < STEPS; n++) {
            step(&s, 1);
            /* from right to left of a line along x is up, along y is to the left */
            const dem2d_vec from = k == 0 ? vec(-8, high) : vec(high, -8);
            const dem2d_vec one = k == 0 ? vec(-8 + period, high) : vec(high, -8 + period);
            const dem2d_vec more = k == 0 ? vec(-8 + 3 * period, high) : vec(high, -8 + 3 * period);
            const dem2d_vec low = k == 0 ? vec(far, -90) : vec(-90, far);
            const dem2d_vec top = k == 0 ? vec(far, 90) : vec(90, far);
            assert_ok(dem2d_world_flow(s.world, from, one, &over));
            assert_ok(dem2d_world_flow(s.world, from, more, &three));
            assert_ok(dem2d_world_flow(s.world, low, top, &round));
            assert_ok(dem2d_world_flow(s.world, top, k == 0 ? vec(far, 99) : vec(99, far), &none));
            for (int i = 0; i < DISCS; i++) {
                const dem2d_vec now = grain_of(&s, ids[i]).pose.position, old = place[i];
                const double across = k == 0 ? now.y : now.x, before = k == 0 ? old.y : old.x;
                const double t0 = ((k == 0 ? old.x : old.y) - far) / period;
                double t = ((k == 0 ? now.x : now.y) - far) / period;
                t -= rint(t - t0);
                const int sign = k == 0 ? 1 : -1;
                overs += sign * ((across >= high) - (before >= high));
                rounds -= sign * passed(t0, t), all += llabs(passed(t0, t));
                place[i] = now;
            }
        }
        assert_true(all > 100 && overs != 0 && rounds != 0);
        assert_int_equal(over.count, overs);
        assert_int_equal(three.count, 3 * overs);
        assert_int_equal(round.count, rounds);
        assert_int_equal(none.count, 0);
        close_scene(&s);
    }
}

/* An outlet in a cell sees images: a box across the border, all of the cell along one vector, or
   along both. */
static void test_outlet_in_cell(void **state) {
    static const dem2d_vec at[4] = {{0.05, 0.5}, {0.95, 0.5}, {0.5, 0.1}, {0.5, 0.9}};
    static const struct {
        dem2d_box box;
        int count;
    } cases[] = {{{{0.9, 0.4}, {1.1, 0.6}}, 2},  {{{-0.1, 2.4}, {0, 2.6}}, 1},
                 {{{0, 0.4}, {0, 0.6}}, 2},      {{{0.4, 0}, {0.6, 0}}, 2},
                 {{{0, 0}, {0, 0}}, 4},          {{{-3, -3}, {9, 9}}, 4},
                 {{{0.1, 0.15}, {0.9, 0.85}}, 0}};
    (void)state;
    for (int k = 0; k < COUNT_OF(cases); k++) {
        const dem2d_material_desc stone = stone_desc(1e6, 0);
        const dem2d_region region = {.box = cases[k].box};
        dem2d_world_desc desc = {0};
        dem2d_flow out = {0};
        desc.time_step = 1e-3, desc.cell.a = vec(1, 0), desc.cell.b = vec(0, 1);
        scene s = open_scene(&desc, &stone);
        const dem2d_shape_id disc = give_shape(&s, make_disc(0.004));
        for (int i = 0; i < 4; i++) {
            const dem2d_particle_desc g = grain_desc(&s, disc, 1, at[i]);
            add_grain(&s, &g);
        }
        assert_ok(dem2d_world_remove_in(s.world, &region, &out));
        assert_int_equal(out.count, cases[k].count);
        close_scene(&s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_uniform),
        cmocka_unit_test(test_normal),
        cmocka_unit_test(test_classes),
        cmocka_unit_test(test_laws),
        cmocka_unit_test(test_totals),
        cmocka_unit_test(test_wrong_gradings),
        cmocka_unit_test(test_fill),
        cmocka_unit_test(test_full),
        cmocka_unit_test(test_exact),
        cmocka_unit_test(test_measured),
        cmocka_unit_test(test_random_addition),
        cmocka_unit_test(test_inlet),
        cmocka_unit_test(test_inlet_behind),
        cmocka_unit_test(test_flow),
        cmocka_unit_test(test_replaced),
        cmocka_unit_test(test_flow_in_cell),
        cmocka_unit_test(test_flow_one_period),
        cmocka_unit_test(test_outlet_in_cell),
        cmocka_unit_test(test_fill_in_cell),
        cmocka_unit_test(test_fill_refused),
        cmocka_unit_test(test_inlet_velocities),
    };
    return cmocka_run_group_tests_name("generators", tests, NULL, NULL);
}
