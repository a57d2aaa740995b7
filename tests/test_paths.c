/* The passes over circles and the motion have several paths: in plain C99, or by vectors of four
   where the machine has them; force pass and motion one after the other, or in turns; contacts in
   tiles, or one by one. Each path gives the same bits, whatever the scene has. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "world_scene.h"

/* So many that there are several blocks of particles and of contacts, and that no batch is full at
   the end. */
enum { COLUMNS = 19, ROWS = 31, GRAINS = 19 * 31 + 2, ROUNDS = 6, EVERY = 12, SHAPES = 6 };

/* What a scene has. */
typedef struct feature {
    const char *name;
    double friction, normal, tangential, rolling, rolling_dashpot; /* ratios, mu_r */
    bool two_laws, fixed, loads, segment, threads;
    double gravity, local, global;
} feature;

static const feature features[] = {
    {"frictionless", 0, 0, 0, 0, 0, false, false, false, false, false, -10, 0, 0},
    {"frictionless, damped", 0, 0, 0, 0, 0, true, false, false, false, false, 0, 0.3, 0.5},
    {"friction", 0.4, 0, 0, 0, 0, false, false, false, false, false, -10, 0, 0},
    {"friction, two laws", 0.4, 0, 0, 0, 0, true, false, false, true, false, -10, 0.3, 0},
    {"friction, threads", 0.4, 0, 0, 0, 0, false, false, false, false, true, 0, 0, 0},
    {"dashpot", 0.4, 0.2, 0, 0, 0, false, true, false, false, false, -10, 0, 0.5},
    {"dashpot, no friction", 0, 0.2, 0, 0, 0, true, false, false, false, false, -10, 0, 0},
    {"rolling", 0.4, 0, 0, 0.1, 0, false, false, false, false, false, -10, 0.1, 0},
    {"dashpot, rolling, two laws", 0.4, 0.2, 0, 0.1, 0, true, true, false, true, false, 0, 0, 0},
    {"tangential dashpot", 0.4, 0.2, 0.3, 0, 0, false, false, false, false, true, -10, 0, 0},
    {"all dashpots", 0.4, 0.2, 0.3, 0.1, 0.2, true, false, true, true, false, -10, 0.2, 0},
    {"all dashpots, one", 0.4, 0.2, 0.3, 0.1, 0.2, false, false, false, true, true, -10, 0, 0.5},
    {"both dashpots, no friction", 0, 0.2, 0.3, 0, 0, false, false, false, false, false, -10, 0, 0},
    {"rolling dashpot alone", 0.4, 0, 0, 0, 0.2, false, false, false, false, false, -10, 0, 0},
    {"loads", 0.4, 0, 0, 0, 0, false, true, true, false, false, 0, 0, 0},
};

/* Of grains of several shapes. */
static const feature grain_features[] = {
    {"grains", 0.4, 0, 0, 0, 0, false, true, false, false, true, -10, 0.3, 0},
    {"grains, two laws", 0.4, 0, 0, 0, 0, true, false, false, true, false, 0, 0, 0},
    {"grains, all dashpots", 0.4, 0.2, 0.3, 0.1, 0.2, true, false, false, true, true, -10, 0, 0.5},
    {"grains, frictionless", 0, 0, 0, 0, 0, false, false, false, false, false, -10, 0, 0},
};

/* Of discs with a caller's law, which is the built-in one. */
static const feature law_features[] = {
    {"law", 0.4, 0, 0, 0, 0, false, false, false, false, true, -10, 0.3, 0},
    {"law, all terms", 0.4, 0.2, 0.3, 0.1, 0.2, true, true, true, true, false, 0, 0, 0},
};

/* Of polygons whose faces meet, in a box or in a periodic cell. */
static const feature flat_features[] = {
    {"faces", 0.4, 0, 0, 0, 0, false, true, false, false, true, -10, 0.3, 0},
    {"faces, two laws", 0.4, 0, 0, 0, 0, true, false, true, false, false, 0, 0, 0},
    {"faces, all dashpots", 0.4, 0.2, 0.3, 0.1, 0.2, true, true, false, false, true, -10, 0, 0.5},
    {"faces, dashpot", 0.4, 0.2, 0, 0, 0, false, false, false, false, false, -10, 0, 0},
    {"faces, rolling", 0.4, 0, 0, 0.1, 0, true, false, false, false, false, -10, 0, 0},
    {"faces, frictionless", 0, 0, 0, 0, 0, false, false, false, false, false, -10, 0, 0},
};

typedef enum group { ROUND, SHAPED, LAW, FLAT, FLAT_CELL } group;

static bool is_flat(group kind) {
    return kind == FLAT || kind == FLAT_CELL;
}

static void add_material(dem2d_world *world, const feature *f, double stiffness,
                         dem2d_material_id *id) {
    dem2d_material_desc desc =
        material_desc(2700, stiffness, f->friction > 0 ? stiffness : 0, f->friction);
    desc.tangential_stiffness = stiffness;
    desc.damping_ratio = f->normal, desc.tangential_damping_ratio = f->tangential;
    desc.rolling_friction = f->rolling, desc.rolling_damping_ratio = f->rolling_dashpot;
    assert_ok(dem2d_world_add_material(world, &desc, id));
}

/* Still ones; with two laws a belt, and one that moves and turns; with fixed discs a servo wall. */
static void add_walls(dem2d_world *world, const feature *f, dem2d_material_id material) {
    static const double normals[4][2] = {{0, 1}, {1, 0}, {-1, 0}, {0, -1}};
    const double height = 0.095 * (GRAINS / COLUMNS + 1);
    dem2d_wall_id id;
    for (int i = 0; i < 4; i++) {
        dem2d_wall_desc wall;
        memset(&wall, 0, sizeof wall);
        wall.material = material, wall.normal = vec(normals[i][0], normals[i][1]);
        wall.point.x = i == 2 ? 0.1 * COLUMNS : 0, wall.point.y = i == 3 ? height : 0;
        if (i == 0 && f->two_laws) wall.surface_speed = 0.5;
        if (i == 2 && f->two_laws) {
            wall.mode = DEM2D_WALL_MOVING, wall.velocity = vec(-0.3, 0);
            wall.pivot = vec(0.1 * COLUMNS, height / 2), wall.angular_velocity = 0.2;
        }
        if (i == 3 && f->fixed) {
            wall.mode = DEM2D_WALL_SERVO, wall.stress = 1e4, wall.max_speed = 1;
            wall.length = 0.1 * COLUMNS;
        }
        assert_ok(dem2d_world_add_wall(world, &wall, &id));
    }
    if (!f->segment) return;
    dem2d_wall_desc slope;
    memset(&slope, 0, sizeof slope);
    slope.material = material, slope.segment = true;
    slope.point = vec(0.3, 0.7), slope.end = vec(0.9, 0.6);
    assert_ok(dem2d_world_add_wall(world, &slope, &id));
}

/* Boxes, sharp and rounded, and one that lacks a corner. */
static int add_boxes(dem2d_world *world, dem2d_shape_id ids[SHAPES]) {
    const dem2d_vec corners[5] = {
        {-0.05, -0.0475}, {0.05, -0.0475}, {0.05, 0.02}, {0.02, 0.0475}, {-0.05, 0.0475}};
    const dem2d_vec round[4] = {
        {-0.045, -0.0425}, {0.045, -0.0425}, {0.045, 0.0425}, {-0.045, 0.0425}};
    dem2d_shape *shapes[3] = {make_box(0.1, 0.095), make_polygon(round, 4, 0.005),
                              make_polygon(corners, 5, 0)};
    for (int k = 0; k < 3; k++) {
        assert_ok(dem2d_world_add_shape(world, shapes[k], &ids[k]));
        dem2d_shape_destroy(shapes[k]);
    }
    return 3;
}

/* A disc, and what else there is in scenes of grains. */
static int add_shapes(dem2d_world *world, bool grains, dem2d_shape_id ids[SHAPES]) {
    static const double a[] = {0.05, 0, 0.002, 0.001}, b[] = {0, 0, 0.001, 0};
    static const double reach[4] = {0.05, 0.045, 0.053, 0.05};
    const double turn = 2 * (double)TEST_PI / 7;
    dem2d_vec corners[7];
    for (int k = 0; k < 7; k++) corners[k] = vec(0.053 * cos(turn * k), 0.05 * sin(turn * k));
    dem2d_shape *shapes[SHAPES] = {
        make_disc(0.05),      make_ellipse(0.053, 0.045),      make_polygon(corners, 7, 0),
        make_series(a, b, 3), make_polygon(corners, 5, 0.002), make_oval(reach, 0.55)};
    for (int k = 0; k < SHAPES; k++) {
        if (grains || k == 0) assert_ok(dem2d_world_add_shape(world, shapes[k], &ids[k]));
        dem2d_shape_destroy(shapes[k]);
    }
    return grains ? SHAPES : 1;
}

static void same_law(void *user, dem2d_law_batch *batch) {
    (void)user;
    dem2d_law_builtin(batch);
}

/* Boxes in rows that overlap a little, turned a little, in slow motion; some are driven. */
static void add_flat(dem2d_world *world, const feature *f, uint64_t *random,
                     const dem2d_material_id *materials, const dem2d_shape_id *shapes, int count) {
    dem2d_particle_id id;
    for (int i = 0; i < COLUMNS * ROWS; i++) {
        dem2d_particle_desc grain;
        memset(&grain, 0, sizeof grain);
        grain.shape = shapes[i % count], grain.material = materials[f->two_laws && i % 3 == 0];
        grain.scale = random_between(random, 1, 1.004);
        grain.position.x = 0.1 * (i % COLUMNS) + 0.05 + random_between(random, -1e-4, 1e-4);
        grain.position.y = 0.095 * (i / COLUMNS) + 0.0475;
        if (i % 4 != 0) grain.angle = random_between(random, -2e-3, 2e-3);
        grain.velocity = vec(random_between(random, -0.1, 0.1), random_between(random, -0.1, 0.1));
        if (f->friction > 0) grain.angular_velocity = random_between(random, -1, 1);
        if (f->fixed && i % 11 == 0) grain.motion = DEM2D_DRIVEN;
        if (f->fixed && i % 7 == 0) {
            grain.motion = DEM2D_FIXED;
            grain.velocity = vec(0, 0), grain.angular_velocity = 0;
        }
        assert_ok(dem2d_world_add_particle(world, &grain, &id));
        if (f->loads && i % 5 == 0)
            assert_ok(dem2d_world_set_load(world, id, vec(3, random_between(random, -5, 5)), 0.1));
    }
}

/* Discs in rows that overlap a little, some of them where another one is; in random motion. */
static dem2d_world *make_world(const feature *f, group kind, uint64_t *random, int *threads) {
    const bool grains = kind == SHAPED;
    dem2d_world_desc desc;
    dem2d_world *world;
    dem2d_material_id materials[2];
    dem2d_shape_id shapes[SHAPES];
    dem2d_particle_id id;
    memset(&desc, 0, sizeof desc);
    desc.time_step = 1e-4, desc.gravity.y = f->gravity;
    desc.law = kind == LAW ? same_law : NULL;
    desc.local_damping = f->local, desc.global_damping = f->global;
    desc.faces = f->segment ? DEM2D_ONE_POINT : DEM2D_TWO_POINTS;
    desc.parallel_for = f->threads ? run_parts : NULL, desc.parallel_user = threads;
    if (kind == FLAT_CELL) {
        desc.gravity.y = 0;
        desc.cell.a = vec(0.1 * COLUMNS, 0), desc.cell.b = vec(0, 0.095 * ROWS);
    }
    assert_ok(dem2d_world_create(&desc, &world));
    add_material(world, f, 1e6, &materials[0]);
    add_material(world, f, 3e5, &materials[1]);
    const int count = is_flat(kind) ? add_boxes(world, shapes) : add_shapes(world, grains, shapes);
    if (kind != FLAT_CELL) add_walls(world, f, materials[0]);
    if (is_flat(kind)) {
        add_flat(world, f, random, materials, shapes, count);
        return world;
    }
    for (int i = 0; i < GRAINS; i++) {
        dem2d_particle_desc grain;
        memset(&grain, 0, sizeof grain);
        grain.shape = shapes[i % count], grain.material = materials[f->two_laws && i % 3 == 0];
        grain.scale = random_between(random, 0.8, 1.05) * (grains ? 1.07 : 1);
        grain.position.x = 0.1 * (i % COLUMNS) + 0.05 + random_between(random, -0.01, 0.01);
        grain.position.y = 0.095 * (i / COLUMNS) + 0.045;
        if (i == 77) grain.position = vec(0.05, 0.045), grain.scale = 0.1; /* in the first one */
        grain.velocity = vec(random_between(random, -1, 1), random_between(random, -1, 1));
        const double spin = grains ? 80 : 30; /* above 55 they turn by more than a small angle */
        if (f->friction > 0) grain.angular_velocity = random_between(random, -spin, spin);
        if (f->fixed && i % 7 == 0) grain.motion = DEM2D_FIXED, grain.velocity = vec(0, 0);
        if (grain.motion == DEM2D_FIXED) grain.angular_velocity = 0;
        if (i == 0) grain.position = vec(0.05, 0.045);
        assert_ok(dem2d_world_add_particle(world, &grain, &id));
        if (f->loads && i % 5 == 0)
            assert_ok(dem2d_world_set_load(world, id, vec(3, random_between(random, -5, 5)), 0.1));
    }
    return world;
}

/* Other velocities for some, which the springs of the next step do not see yet. */
static void push_some(dem2d_world *world, uint64_t *random) {
    for (uint32_t i = 1; i < 40; i += 3) {
        const dem2d_particle_id id = {i * 13, 1};
        const dem2d_vec v = vec(random_between(random, -1, 1), random_between(random, -1, 1));
        assert_ok(dem2d_world_drive_particle(world, id, DEM2D_FREE, v, 0));
    }
}

/* How the steps are made. */
typedef struct path {
    const char *name;
    bool fours, in_two, singly;
} path;

static const path paths[] = {{"plain", false, false, false},
                             {"fours, two passes", true, true, false},
                             {"fours", true, false, false},
                             {"one by one", false, true, true}};

static void run(const feature *f, group kind, const path *p, uint64_t hashes[ROUNDS]) {
    uint64_t random = 5;
    int threads = 3;
    dem2d_stats stats;
    dem2d_world *world = make_world(f, kind, &random, &threads);
    inside_choose_fours(world, p->fours);
    inside_choose_two_passes(world, p->in_two);
    for (int round = 0; round < ROUNDS; round++) {
        for (int k = 0; k < EVERY && p->singly; k++) {
            inside_take_singly(world);
            assert_ok(dem2d_world_step(world, 1, NULL));
        }
        if (!p->singly) assert_ok(dem2d_world_step(world, EVERY, NULL));
        hashes[round] = dem2d_world_hash(world);
        if (round == 2) push_some(world, &random);
    }
    assert_ok(dem2d_world_stats(world, &stats));
    assert_true(stats.contacts > GRAINS / 2);
    assert_true(stats.wall_contacts > COLUMNS / 2 || kind == FLAT_CELL);
    dem2d_world_destroy(world);
}

/* Returns whether it differs from the path in plain C99 pass by pass. */
static bool differs(const feature *f, group kind, const path *p, const uint64_t expected[ROUNDS]) {
    uint64_t hashes[ROUNDS];
    run(f, kind, p, hashes);
    for (int round = 0; round < ROUNDS; round++) {
        if (hashes[round] == expected[round]) continue;
        print_error("%s, %s: another hash after %d steps\n", f->name, p->name, (round + 1) * EVERY);
        return true;
    }
    return false;
}

/* Returns how many of the paths differ. */
static int compare(const feature *f, group kind) {
    static const path simple = {"plain, two passes", false, true, false};
    uint64_t expected[ROUNDS];
    int differ = 0;
    run(f, kind, &simple, expected);
    for (int i = 0; i < COUNT_OF(paths); i++) differ += differs(f, kind, &paths[i], expected);
    return differ;
}

static void test_same_bits(void **state) {
    int differ = 0;
    (void)state;
    for (int k = 0; k < COUNT_OF(features); k++) differ += compare(&features[k], ROUND);
    for (int k = 0; k < COUNT_OF(grain_features); k++)
        differ += compare(&grain_features[k], SHAPED);
    for (int k = 0; k < COUNT_OF(law_features); k++) differ += compare(&law_features[k], LAW);
    for (int k = 0; k < COUNT_OF(flat_features); k++) {
        differ += compare(&flat_features[k], FLAT);
        differ += compare(&flat_features[k], FLAT_CELL);
    }
    assert_int_equal(differ, 0);
}

/* Nine discs that turn up to eighty times around, where they are. */
static uint64_t spin_discs(bool fours) {
    const dem2d_material_desc stone = stone_desc(1e7, 0.5);
    dem2d_world_desc desc;
    dem2d_shape *disc;
    memset(&desc, 0, sizeof desc);
    desc.time_step = 1e-4;
    const scene s = open_scene(&desc, &stone);
    assert_ok(dem2d_shape_create_circle(NULL, 1, &disc));
    const dem2d_shape_id shape = copy_shape(&s, disc);
    for (int i = 0; i < 9; i++) {
        dem2d_particle_desc grain;
        dem2d_particle_id id;
        memset(&grain, 0, sizeof grain);
        grain.shape = shape, grain.material = s.material, grain.scale = 1;
        grain.position = vec(3 * i, 0), grain.angular_velocity = (i - 4) * 1234.5;
        assert_ok(dem2d_world_add_particle(s.world, &grain, &id));
    }
    inside_choose_fours(s.world, fours);
    assert_ok(dem2d_world_step(s.world, 1000, NULL));
    const uint64_t hash = dem2d_world_hash(s.world);
    close_scene(&s);
    dem2d_shape_destroy(disc);
    return hash;
}

static void test_whole_turns(void **state) {
    (void)state;
    assert_true(spin_discs(true) == spin_discs(false));
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_bits),
                                       cmocka_unit_test(test_whole_turns)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
