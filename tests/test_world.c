/* The world: what it refuses, what its objects do, balances of force, stress and energy, runs that
   repeat bit for bit, and failures in the middle of a step. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "world_scene.h"

#include <float.h>

#define G 9.81

/* --- building blocks ------------------------------------------------------------------------- */

static const dem2d_material_desc stone = {
    .density = 2700, .normal_stiffness = 1e7, .tangential_stiffness = 1e7, .friction = 0.4};

static dem2d_world_desc basic_desc(void) {
    dem2d_world_desc desc = {0};
    desc.time_step = 1e-4;
    return desc;
}

static dem2d_shape_id add_disc(dem2d_world *world, double radius) {
    const scene s = {world, {0, 0}};
    return give_shape(&s, make_disc(radius));
}

/* A grain of size 1. */
static dem2d_particle_desc one_desc(const scene *s, dem2d_shape_id shape, double x, double y) {
    return grain_desc(s, shape, 1, vec(x, y));
}

static dem2d_particle_id add_one(const scene *s, dem2d_shape_id shape, double x, double y) {
    const dem2d_particle_desc desc = one_desc(s, shape, x, y);
    return add_grain(s, &desc);
}

static dem2d_wall_desc wall_desc(const scene *s, double x, double y, double nx, double ny) {
    return plane_desc(s, vec(x, y), vec(nx, ny));
}

static void run(dem2d_world *world, int count) {
    int done = -1;
    assert_true(inside_holds(world));
    assert_ok(dem2d_world_step(world, count, &done));
    assert_int_equal(done, count);
    assert_true(inside_holds(world));
}

static dem2d_particle_info particle(const dem2d_world *world, dem2d_particle_id id) {
    dem2d_particle_info info;
    memset(&info, 0, sizeof info); /* padding too: some are compared as memory */
    assert_ok(dem2d_world_get_particle(world, id, &info));
    return info;
}

static dem2d_wall_info wall(const dem2d_world *world, dem2d_wall_id id) {
    dem2d_wall_info info;
    assert_ok(dem2d_world_get_wall(world, id, &info));
    return info;
}

static dem2d_contact_info only_contact(const dem2d_world *world) {
    dem2d_contact_info info;
    int count;
    assert_ok(dem2d_world_contacts(world, &info, 1, &count));
    assert_int_equal(count, 1);
    assert_true(info.part_a == 0 && info.part_b == 0 && info.shift[0] == 0 && info.shift[1] == 0);
    assert_true(info.feature == 0 && info.sign == 1);
    return info;
}

static dem2d_stats stats(const dem2d_world *world) {
    dem2d_stats s;
    assert_ok(dem2d_world_stats(world, &s));
    return s;
}

static double kinetic(const dem2d_world *world) {
    dem2d_energy energy;
    assert_ok(dem2d_world_energy(world, &energy));
    return energy.translational + energy.rotational;
}

/* --- a state as numbers, to compare runs ----------------------------------------------------- */

enum { STATE_ROOM = 4096, PARTICLE_NUMBERS = 14, WALL_NUMBERS = 11, CONTACT_NUMBERS = 9 };

/* dimension[i]: the power of the unit of length in numbers[i] when time and density are held. */
typedef struct world_state {
    int count;
    double numbers[STATE_ROOM];
    signed char dimension[STATE_ROOM];
} world_state;

static void put(world_state *s, const double *numbers, const signed char *dimension, int count) {
    assert_true(s->count + count <= STATE_ROOM);
    memcpy(s->numbers + s->count, numbers, (size_t)count * sizeof *numbers);
    memcpy(s->dimension + s->count, dimension, (size_t)count);
    s->count += count;
}

static void put_contacts(world_state *s, const dem2d_world *world) {
    static dem2d_contact_info list[400];
    static const signed char dimension[CONTACT_NUMBERS] = {0, 0, 1, 1, 1, 1, 1, 3, 3};
    int count;
    assert_ok(dem2d_world_contacts(world, list, COUNT_OF(list), &count));
    assert_true(count <= COUNT_OF(list));
    for (int i = 0; i < count; i++) {
        const dem2d_contact_info *c = &list[i];
        const double numbers[CONTACT_NUMBERS] = {c->normal.x, c->normal.y,     c->point.x,
                                                 c->point.y,  c->branch.x,     c->branch.y,
                                                 c->depth,    c->normal_force, c->tangential_force};
        put(s, numbers, dimension, CONTACT_NUMBERS);
    }
}

static void keep(world_state *s, const dem2d_world *world, const dem2d_wall_id *walls, int count) {
    static const signed char of_particle[PARTICLE_NUMBERS] = {1, 1, 0, 0, 0, 1, 1,
                                                              0, 3, 3, 4, 2, 4, 1};
    static const signed char of_wall[WALL_NUMBERS] = {1, 1, 0, 0, 1, 1, 3, 3, 1, 2, 2};
    dem2d_particle_id ids[128];
    int particles;
    s->count = 0;
    assert_ok(dem2d_world_particles(world, ids, 128, &particles));
    assert_true(particles <= 128);
    for (int i = 0; i < particles; i++) {
        const dem2d_particle_info p = particle(world, ids[i]);
        const double numbers[PARTICLE_NUMBERS] = {
            p.pose.position.x, p.pose.position.y, p.pose.rotation.c, p.pose.rotation.s,
            p.pose.scale,      p.velocity.x,      p.velocity.y,      p.angular_velocity,
            p.force.x,         p.force.y,         p.torque,          p.mass,
            p.inertia,         p.radius};
        put(s, numbers, of_particle, PARTICLE_NUMBERS);
    }
    for (int i = 0; i < count; i++) {
        const dem2d_wall_info w = wall(world, walls[i]);
        const double numbers[WALL_NUMBERS] = {w.point.x,    w.point.y,    w.normal.x, w.normal.y,
                                              w.velocity.x, w.velocity.y, w.force.x,  w.force.y,
                                              w.length,     w.stress,     w.target};
        put(s, numbers, of_wall, WALL_NUMBERS);
    }
    put_contacts(s, world);
    for (int i = 0; i < s->count; i++) assert_true(isfinite(s->numbers[i]));
}

static void assert_same_state(const world_state *a, const world_state *b, int power) {
    assert_int_equal(a->count, b->count);
    for (int i = 0; i < a->count; i++)
        assert_same_bits(b->numbers[i], ldexp(a->numbers[i], power * a->dimension[i]));
}

/* --- a pile of all kinds between walls; every call may fail for want of memory --------------- */

static dem2d_vec grown_ellipse(void *user, dem2d_vec u, double *rho) {
    const double size = *(const double *)user, a = 0.02 * size, b = 0.012 * size, r = 0.005 * size;
    const double h = sqrt(a * a * u.x * u.x + b * b * u.y * u.y);
    if (rho) *rho = a * a * b * b / (h * h * h) + r;
    return vec((a * a / h + r) * u.x, (b * b / h + r) * u.y);
}

/* Shape of a kind (dem2d_shape_type; 6 is a rounded polygon), about 0.05 across times size. */
static dem2d_result create_kind(const dem2d_env *env, int kind, double *size, dem2d_shape **shape) {
    static const double corners[5][2] = {
        {-0.9, -0.6}, {0.7, -0.8}, {1.1, 0.1}, {0.4, 0.9}, {-0.6, 0.7}};
    static const double arcs[4][2] = {{1.1, 0}, {0, 0.75}, {-0.7, 0}, {0, -0.75}};
    static const double handle = 0.5522847498;
    const double f = 0.025 * *size, a[4] = {1.8 * f, 0, 0.08 * f, 0.03 * f};
    const double b[4] = {0, 0, 0.06 * f, 0.02 * f};
    dem2d_custom_desc custom = {0};
    dem2d_vec points[12];
    custom.support = grown_ellipse, custom.user = size;
    switch (kind) {
    case DEM2D_CIRCLE:
        return dem2d_shape_create_circle(env, f, shape);
    case DEM2D_ELLIPSE:
        return dem2d_shape_create_ellipse(env, 1.2 * f, 0.8 * f, shape);
    case DEM2D_BEZIER:
        for (int i = 0; i < 4; i++) {
            const double *p = arcs[i], *q = arcs[(i + 1) % 4];
            points[3 * i] = vec(f * p[0], f * p[1]);
            points[3 * i + 1] = vec(f * (p[0] + handle * q[0]), f * (p[1] + handle * q[1]));
            points[3 * i + 2] = vec(f * (q[0] + handle * p[0]), f * (q[1] + handle * p[1]));
        }
        return dem2d_shape_create_bezier(env, points, 4, shape);
    case DEM2D_FOURIER:
        return dem2d_shape_create_fourier(env, a, b, 3, shape);
    case DEM2D_CUSTOM:
        return dem2d_shape_create_custom(env, &custom, shape);
    default:
        for (int i = 0; i < 5; i++) points[i] = vec(f * corners[i][0], f * corners[i][1]);
        return dem2d_shape_create_polygon(env, points, 5, kind == DEM2D_POLYGON ? 0 : 0.2 * f,
                                          shape);
    }
}

/* A call that ran out of memory is made again with memory to spare, and must then succeed. */
#define WITH_RETRY(env, call)                                         \
    do {                                                              \
        const dem2d_result retry_result = (call);                     \
        if (retry_result == DEM2D_OUT_OF_MEMORY) {                    \
            assert_int_equal((env)->log.result, DEM2D_OUT_OF_MEMORY); \
            test_env_fail((env), 0);                                  \
            assert_ok(call);                                          \
        } else                                                        \
            assert_ok(retry_result);                                  \
    } while (0)

typedef struct pile {
    scene scene;
    dem2d_wall_id walls[4]; /* floor, left, right, lid; the lid is a servo wall if asked for */
    dem2d_shape_id shapes[DEM2D_SHAPE_TYPE_COUNT + 1];
} pile;

/* Sharp and rounded polygons jitter on their faces, where a contact has one point. */
enum { ALL, DISCS, SMOOTH };

typedef struct pile_desc {
    int particles;  /* at most 128 */
    int power;      /* lengths are those of power 0 times 2^power */
    int kinds;      /* which shapes */
    bool lid;       /* servo wall above */
    double skin;    /* as in dem2d_world_desc */
    double damping; /* local */
    double friction;
} pile_desc;

/* The size of a pile. Its custom shapes ask for it as long as they live, so it has a place. */
static double *pile_size(int power) {
    static double sizes[3]; /* powers 0, above, below */
    double *size = &sizes[power > 0 ? 1 : power < 0 ? 2 : 0];
    *size = ldexp(1, power);
    return size;
}

static void pile_walls(pile *p, test_env *env, const pile_desc *desc, double size) {
    static const double at[4][4] = {{0, 0, 0, 1}, {0, 0, 1, 0}, {0.5, 0, -1, 0}, {0, 0.75, 0, -1}};
    for (int i = 0; i < (desc->lid ? 4 : 3); i++) {
        dem2d_wall_desc w =
            wall_desc(&p->scene, size * at[i][0], size * at[i][1], at[i][2], at[i][3]);
        if (i == 3) {
            w.mode = DEM2D_WALL_SERVO, w.stress = 2e4 * size * size, w.max_speed = 0.5 * size;
            w.spans[0] = p->walls[1], w.spans[1] = p->walls[2];
        }
        WITH_RETRY(env, dem2d_world_add_wall(p->scene.world, &w, &p->walls[i]));
    }
}

/* With time and density held, stiffness (N/m) scales with the square of the length. */
static void make_pile(pile *p, test_env *env, const pile_desc *desc) {
    static const int smooth[] = {DEM2D_CIRCLE, DEM2D_ELLIPSE, DEM2D_BEZIER, DEM2D_FOURIER,
                                 DEM2D_CUSTOM};
    double *const where = pile_size(desc->power), size = *where;
    dem2d_world_desc world = basic_desc();
    dem2d_material_desc material = stone;
    world.gravity.y = -G * size, world.local_damping = desc->damping, world.skin = desc->skin;
    world.env = &env->env;
    material.normal_stiffness *= size * size, material.tangential_stiffness *= size * size;
    material.friction = desc->friction;
    WITH_RETRY(env, dem2d_world_create(&world, &p->scene.world));
    WITH_RETRY(env, dem2d_world_add_material(p->scene.world, &material, &p->scene.material));
    for (int i = 0; i <= DEM2D_SHAPE_TYPE_COUNT; i++) {
        dem2d_shape *shape = NULL;
        WITH_RETRY(env, create_kind(&env->env, i, where, &shape));
        WITH_RETRY(env, dem2d_world_add_shape(p->scene.world, shape, &p->shapes[i]));
        dem2d_shape_destroy(shape);
    }
    pile_walls(p, env, desc, size);
    uint64_t random = 42;
    for (int i = 0; i < desc->particles; i++) {
        const int kind = desc->kinds == DISCS    ? DEM2D_CIRCLE
                         : desc->kinds == SMOOTH ? smooth[i % COUNT_OF(smooth)]
                                                 : i % (DEM2D_SHAPE_TYPE_COUNT + 1);
        dem2d_particle_desc grain = one_desc(&p->scene, p->shapes[kind], 0, 0);
        dem2d_particle_id id;
        grain.position.x = size * (0.05 + 0.08 * (i % 6) + random_between(&random, -0.004, 0.004));
        grain.position.y = size * (0.04 + 0.07 * (i / 6));
        grain.angle = random_between(&random, -3, 3);
        grain.velocity.x = size * random_between(&random, -0.2, 0.2);
        WITH_RETRY(env, dem2d_world_add_particle(p->scene.world, &grain, &id));
    }
}

static void end_pile(pile *p, test_env *env) {
    dem2d_world_destroy(p->scene.world);
    assert_clean(env);
}

/* --- what creation refuses ------------------------------------------------------------------- */

typedef struct bad_field {
    const char *field;
    size_t offset;
    double value;
    bool integer;
    dem2d_result result;
} bad_field;

#define BAD(type, field, value, result) \
    { #field, offsetof(type, field), value, false, DEM2D_##result }
#define BAD_INT(type, field, value) \
    { #field, offsetof(type, field), value, true, DEM2D_OUT_OF_RANGE }

static void set_field(void *desc, const bad_field *bad) {
    const int integer = bad->integer ? (int)bad->value : 0;
    memcpy((char *)desc + bad->offset, bad->integer ? (const void *)&integer : &bad->value,
           bad->integer ? sizeof integer : sizeof bad->value);
}

static void test_create_errors(void **state) {
    (void)state;
    static const bad_field rows[] = {
        BAD(dem2d_world_desc, time_step, 0, OUT_OF_RANGE),
        BAD(dem2d_world_desc, time_step, -1e-4, OUT_OF_RANGE),
        BAD(dem2d_world_desc, time_step, NAN, NOT_FINITE),
        BAD(dem2d_world_desc, time_step, INFINITY, NOT_FINITE),
        BAD(dem2d_world_desc, gravity, NAN, NOT_FINITE),
        BAD(dem2d_world_desc, local_damping, 1, OUT_OF_RANGE),
        BAD(dem2d_world_desc, local_damping, -0.1, OUT_OF_RANGE),
        BAD(dem2d_world_desc, local_damping, NAN, NOT_FINITE),
        BAD(dem2d_world_desc, global_damping, -1, OUT_OF_RANGE),
        BAD(dem2d_world_desc, global_damping, INFINITY, NOT_FINITE),
        BAD(dem2d_world_desc, skin, -0.1, OUT_OF_RANGE),
        BAD(dem2d_world_desc, skin, NAN, NOT_FINITE),
        BAD(dem2d_world_desc, contact_tolerance, -1e-9, OUT_OF_RANGE),
        BAD(dem2d_world_desc, contact_tolerance, NAN, NOT_FINITE),
        BAD_INT(dem2d_world_desc, max_iterations, -1),
        BAD_INT(dem2d_world_desc, particle_capacity, -1),
        BAD_INT(dem2d_world_desc, pair_capacity, -1),
    };
    dem2d_world *const untouched = (dem2d_world *)(void *)&state, *world = untouched;
    for (int i = 0; i < COUNT_OF(rows); i++) {
        test_env env;
        dem2d_world_desc desc = basic_desc();
        test_env_init(&env);
        desc.env = &env.env;
        set_field(&desc, &rows[i]);
        assert_result(dem2d_world_create(&desc, &world), rows[i].result);
        assert_logged(&env, rows[i].result, env.log.index, rows[i].field);
        assert_ptr_equal(world, untouched);
        assert_clean(&env);
    }
    const dem2d_world_desc desc = basic_desc();
    assert_result(dem2d_world_create(NULL, &world), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_create(&desc, NULL), DEM2D_NULL_ARGUMENT);
    dem2d_world_destroy(NULL);
}

static const bad_field bad_materials[] = {
    BAD(dem2d_material_desc, density, 0, OUT_OF_RANGE),
    BAD(dem2d_material_desc, density, NAN, NOT_FINITE),
    BAD(dem2d_material_desc, normal_stiffness, 0, OUT_OF_RANGE),
    BAD(dem2d_material_desc, normal_stiffness, INFINITY, NOT_FINITE),
    BAD(dem2d_material_desc, tangential_stiffness, -1, OUT_OF_RANGE),
    BAD(dem2d_material_desc, friction, -0.1, OUT_OF_RANGE),
    BAD(dem2d_material_desc, friction, NAN, NOT_FINITE),
};
static const bad_field bad_pairs[] = {
    BAD(dem2d_pair_desc, normal_stiffness, 0, OUT_OF_RANGE),
    BAD(dem2d_pair_desc, normal_stiffness, NAN, NOT_FINITE),
    BAD(dem2d_pair_desc, tangential_stiffness, -1, OUT_OF_RANGE),
    BAD(dem2d_pair_desc, friction, -1, OUT_OF_RANGE),
};
static const bad_field bad_particles[] = {
    BAD(dem2d_particle_desc, scale, 0, OUT_OF_RANGE),
    BAD(dem2d_particle_desc, scale, -1, OUT_OF_RANGE),
    BAD(dem2d_particle_desc, scale, NAN, NOT_FINITE),
    BAD(dem2d_particle_desc, position, INFINITY, NOT_FINITE),
    BAD(dem2d_particle_desc, angle, NAN, NOT_FINITE),
    BAD(dem2d_particle_desc, velocity, NAN, NOT_FINITE),
    BAD(dem2d_particle_desc, angular_velocity, NAN, NOT_FINITE),
    BAD_INT(dem2d_particle_desc, motion, 3),
};
static const bad_field bad_walls[] = {
    BAD(dem2d_wall_desc, point, NAN, NOT_FINITE),
    BAD(dem2d_wall_desc, normal, NAN, NOT_FINITE),
    BAD(dem2d_wall_desc, normal.y, 0, OUT_OF_RANGE),
    BAD(dem2d_wall_desc, stress, NAN, NOT_FINITE),
    BAD(dem2d_wall_desc, max_speed, 0, OUT_OF_RANGE),
    BAD(dem2d_wall_desc, max_speed, NAN, NOT_FINITE),
    BAD(dem2d_wall_desc, length, 0, OUT_OF_RANGE),
    BAD(dem2d_wall_desc, length, -1, OUT_OF_RANGE),
    BAD_INT(dem2d_wall_desc, mode, 3),
};

enum { MATERIALS, PAIRS, PARTICLES, WALLS };

static dem2d_result add_bad(int what, const scene *s, dem2d_shape_id shape, const bad_field *bad) {
    dem2d_material_desc material = stone;
    dem2d_pair_desc meeting = pair_desc(1e6, 1e6, 0.5);
    dem2d_particle_desc grain = one_desc(s, shape, 0, 0);
    dem2d_wall_desc plane = wall_desc(s, 0, 0, 0, 1);
    dem2d_material_id material_id;
    dem2d_particle_id particle_id;
    dem2d_wall_id wall_id;
    plane.mode = DEM2D_WALL_SERVO, plane.stress = 1, plane.max_speed = 1, plane.length = 1;
    switch (what) {
    case MATERIALS:
        set_field(&material, bad);
        return dem2d_world_add_material(s->world, &material, &material_id);
    case PAIRS:
        set_field(&meeting, bad);
        return dem2d_world_set_pair(s->world, s->material, s->material, &meeting);
    case PARTICLES:
        set_field(&grain, bad);
        return dem2d_world_add_particle(s->world, &grain, &particle_id);
    default:
        set_field(&plane, bad);
        return dem2d_world_add_wall(s->world, &plane, &wall_id);
    }
}

static void test_add_errors(void **state) {
    (void)state;
    static const struct {
        const bad_field *rows;
        int count;
    } tables[] = {{bad_materials, COUNT_OF(bad_materials)},
                  {bad_pairs, COUNT_OF(bad_pairs)},
                  {bad_particles, COUNT_OF(bad_particles)},
                  {bad_walls, COUNT_OF(bad_walls)}};
    test_env env;
    dem2d_world_desc desc = basic_desc();
    test_env_init(&env);
    desc.env = &env.env;
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id disc = add_disc(s.world, 0.1);
    for (int what = MATERIALS; what <= WALLS; what++) {
        for (int i = 0; i < tables[what].count; i++) {
            const bad_field *bad = &tables[what].rows[i];
            char name[32] = {0}; /* of the field, without the component */
            memcpy(name, bad->field, strcspn(bad->field, "."));
            test_log_clear(&env);
            assert_result(add_bad(what, &s, disc, bad), bad->result);
            assert_logged(&env, bad->result, env.log.index, name);
        }
    }
    assert_int_equal(stats(s.world).particles, 0);
    assert_int_equal(stats(s.world).walls, 0);
    dem2d_particle_desc fixed = one_desc(&s, disc, 0, 0);
    dem2d_particle_id id;
    fixed.motion = DEM2D_FIXED, fixed.velocity.x = 1;
    assert_result(dem2d_world_add_particle(s.world, &fixed, &id), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_set_gravity(s.world, vec(0, NAN)), DEM2D_NOT_FINITE);
    assert_result(dem2d_world_set_damping(s.world, 1, 0), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_set_damping(s.world, 0, -1), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_set_damping(s.world, NAN, 0), DEM2D_NOT_FINITE);
    assert_result(dem2d_world_set_time_step(s.world, 0), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_set_time_step(s.world, INFINITY), DEM2D_NOT_FINITE);
    assert_result(dem2d_world_step(s.world, -1, NULL), DEM2D_OUT_OF_RANGE);
    dem2d_stress stress;
    assert_result(dem2d_world_stress(s.world, 0, &stress), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_stress(s.world, NAN, &stress), DEM2D_NOT_FINITE);
    dem2d_world_destroy(s.world);
    assert_clean(&env);
}

static void check_all_null(const dem2d_result *results, int count) {
    for (int i = 0; i < count; i++) {
        if (results[i] != DEM2D_NULL_ARGUMENT) print_error("call %d of the list\n", i);
        assert_result(results[i], DEM2D_NULL_ARGUMENT);
    }
}

static void test_null_arguments(void **state) {
    (void)state;
    const dem2d_world_desc desc = basic_desc();
    const scene s = open_scene(&desc, &stone);
    dem2d_world *const w = s.world;
    const dem2d_shape_id disc = add_disc(w, 0.1);
    const dem2d_shape *const shape = dem2d_world_shape(w, disc);
    const dem2d_particle_desc grain_d = one_desc(&s, disc, 0, 0);
    const dem2d_wall_desc wall_d = wall_desc(&s, 0, 0, 0, 1);
    const dem2d_particle_id grain = add_one(&s, disc, 0, 0);
    const dem2d_wall_id floor = add_plane(&s, 0, -1, 0, 1);
    dem2d_shape_id shape_id;
    dem2d_material_id material_id;
    dem2d_particle_id grain_id;
    dem2d_wall_id wall_id;
    const dem2d_result results[] = {
        dem2d_world_add_shape(NULL, shape, &shape_id),
        dem2d_world_add_shape(w, NULL, &shape_id),
        dem2d_world_add_shape(w, shape, NULL),
        dem2d_world_remove_shape(NULL, disc),
        dem2d_world_add_material(NULL, &stone, &material_id),
        dem2d_world_add_material(w, NULL, &material_id),
        dem2d_world_add_material(w, &stone, NULL),
        dem2d_world_set_pair(NULL, s.material, s.material, NULL),
        dem2d_world_set_pair(w, s.material, s.material, NULL),
        dem2d_world_add_particle(NULL, &grain_d, &grain_id),
        dem2d_world_add_particle(w, NULL, &grain_id),
        dem2d_world_add_particle(w, &grain_d, NULL),
        dem2d_world_remove_particle(NULL, grain),
        dem2d_world_move_particle(NULL, grain, vec(0, 0), 0),
        dem2d_world_drive_particle(NULL, grain, DEM2D_FREE, vec(0, 0), 0),
        dem2d_world_add_wall(NULL, &wall_d, &wall_id),
        dem2d_world_add_wall(w, NULL, &wall_id),
        dem2d_world_add_wall(w, &wall_d, NULL),
        dem2d_world_set_wall(NULL, floor, &wall_d),
        dem2d_world_set_wall(w, floor, NULL),
        dem2d_world_remove_wall(NULL, floor),
        dem2d_world_set_gravity(NULL, vec(0, 0)),
        dem2d_world_set_damping(NULL, 0, 0),
        dem2d_world_set_time_step(NULL, 1),
        dem2d_world_step(NULL, 1, NULL),
    };
    check_all_null(results, COUNT_OF(results));
    assert_null(dem2d_world_shape(NULL, disc));
    dem2d_world_destroy(w);
}

static void test_null_queries(void **state) {
    (void)state;
    const dem2d_world_desc desc = basic_desc();
    const scene s = open_scene(&desc, &stone);
    dem2d_world *const w = s.world;
    const dem2d_particle_id grain = add_one(&s, add_disc(w, 0.1), 0, 0);
    const dem2d_wall_id floor = add_plane(&s, 0, -1, 0, 1);
    const dem2d_svg_desc svg = {0};
    dem2d_particle_info particle_info;
    dem2d_wall_info wall_info;
    dem2d_stats counters;
    dem2d_energy energy;
    dem2d_stress stress;
    dem2d_packing packing;
    double safe, limit;
    int count;
    const dem2d_result results[] = {
        dem2d_world_get_particle(NULL, grain, &particle_info),
        dem2d_world_get_particle(w, grain, NULL),
        dem2d_world_get_wall(NULL, floor, &wall_info),
        dem2d_world_get_wall(w, floor, NULL),
        dem2d_world_time_step_bounds(NULL, &safe, &limit, NULL),
        dem2d_world_time_step_bounds(w, NULL, &limit, NULL),
        dem2d_world_time_step_bounds(w, &safe, NULL, NULL),
        dem2d_world_stats(NULL, &counters),
        dem2d_world_stats(w, NULL),
        dem2d_world_particles(NULL, NULL, 0, &count),
        dem2d_world_particles(w, NULL, 0, NULL),
        dem2d_world_particles(w, NULL, 1, &count),
        dem2d_world_contacts(NULL, NULL, 0, &count),
        dem2d_world_contacts(w, NULL, 0, NULL),
        dem2d_world_contacts(w, NULL, 1, &count),
        dem2d_world_energy(NULL, &energy),
        dem2d_world_energy(w, NULL),
        dem2d_world_stress(NULL, 1, &stress),
        dem2d_world_stress(w, 1, NULL),
        dem2d_world_packing(NULL, &packing),
        dem2d_world_packing(w, NULL),
        dem2d_world_write_svg(NULL, &svg, "no/such/directory/a.svg"),
        dem2d_world_write_svg(w, NULL, NULL),
    };
    check_all_null(results, COUNT_OF(results));
    dem2d_world_destroy(w);
}

/* --- ids ------------------------------------------------------------------------------------- */

static void check_stale(dem2d_world *w, dem2d_shape_id shape, dem2d_material_id material,
                        dem2d_particle_id grain, dem2d_wall_id plane) {
    dem2d_particle_info particle_info;
    dem2d_wall_info wall_info;
    const dem2d_pair_desc meeting = pair_desc(1, 1, 1);
    dem2d_wall_desc desc = {0};
    const dem2d_result results[] = {
        dem2d_world_remove_shape(w, shape),
        dem2d_world_set_pair(w, material, material, &meeting),
        dem2d_world_remove_particle(w, grain),
        dem2d_world_get_particle(w, grain, &particle_info),
        dem2d_world_move_particle(w, grain, vec(0, 0), 0),
        dem2d_world_drive_particle(w, grain, DEM2D_FREE, vec(0, 0), 0),
        dem2d_world_set_wall(w, plane, &desc),
        dem2d_world_remove_wall(w, plane),
        dem2d_world_get_wall(w, plane, &wall_info),
    };
    for (int i = 0; i < COUNT_OF(results); i++) assert_result(results[i], DEM2D_STALE_ID);
    assert_null(dem2d_world_shape(w, shape));
}

static void test_ids(void **state) {
    (void)state;
    const dem2d_world_desc desc = basic_desc();
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id disc = add_disc(s.world, 0.1), spare = add_disc(s.world, 0.2);
    const dem2d_particle_id grain = add_one(&s, disc, 0, 0);
    const dem2d_wall_id left = add_plane(&s, -1, 0, 1, 0), right = add_plane(&s, 1, 0, -1, 0);
    dem2d_wall_desc lid_desc = wall_desc(&s, 0, 1, 0, -1);
    dem2d_wall_id lid;
    dem2d_material_id other = s.material;
    other.generation++;
    lid_desc.spans[0] = left, lid_desc.spans[1] = right;
    assert_ok(dem2d_world_add_wall(s.world, &lid_desc, &lid));
    check_stale(s.world, (dem2d_shape_id){0, 0}, (dem2d_material_id){0, 0},
                (dem2d_particle_id){0, 0}, (dem2d_wall_id){0, 0});
    check_stale(s.world, (dem2d_shape_id){99, 1}, (dem2d_material_id){99, 1},
                (dem2d_particle_id){99, 1}, (dem2d_wall_id){99, 1});

    assert_result(dem2d_world_remove_shape(s.world, disc), DEM2D_IN_USE);
    assert_result(dem2d_world_remove_wall(s.world, left), DEM2D_IN_USE);
    assert_result(dem2d_world_remove_wall(s.world, right), DEM2D_IN_USE);
    assert_ok(dem2d_world_remove_shape(s.world, spare));
    assert_ok(dem2d_world_remove_wall(s.world, lid));
    assert_ok(dem2d_world_remove_wall(s.world, right));
    assert_ok(dem2d_world_remove_particle(s.world, grain));
    check_stale(s.world, spare, other, grain, right);
    /* new objects may take the slots; the old ids still name nothing */
    const dem2d_shape_id new_disc = add_disc(s.world, 0.3);
    const dem2d_particle_id new_grain = add_one(&s, disc, 0, 0);
    const dem2d_wall_id new_wall = add_plane(&s, 1, 0, -1, 0);
    check_stale(s.world, spare, other, grain, right);
    assert_non_null(dem2d_world_shape(s.world, new_disc));
    assert_near(particle(s.world, new_grain).mass, 2700 * 0.01L * TEST_PI, 1e-14);
    assert_near(wall(s.world, new_wall).point.x, 1, 0);

    dem2d_particle_desc bad = one_desc(&s, spare, 0, 0);
    dem2d_particle_id id;
    assert_result(dem2d_world_add_particle(s.world, &bad, &id), DEM2D_STALE_ID);
    bad = one_desc(&s, disc, 0, 0), bad.material = other;
    assert_result(dem2d_world_add_particle(s.world, &bad, &id), DEM2D_STALE_ID);
    assert_result(dem2d_world_add_wall(s.world, &lid_desc, &lid), DEM2D_STALE_ID); /* span right */
    lid_desc = wall_desc(&s, 0, 1, 0, -1), lid_desc.material = other;
    assert_result(dem2d_world_add_wall(s.world, &lid_desc, &lid), DEM2D_STALE_ID);
    assert_int_equal(stats(s.world).particles, 1);
    assert_int_equal(stats(s.world).walls, 2);
    dem2d_world_destroy(s.world);
}

static void test_results(void **state) {
    (void)state;
    for (int i = 0; i < DEM2D_RESULT_COUNT; i++) {
        const char *text = dem2d_result_text((dem2d_result)i);
        assert_true(text && strlen(text) >= 5);
        for (int k = 0; k < i; k++)
            assert_string_not_equal(text, dem2d_result_text((dem2d_result)k));
    }
    assert_non_null(dem2d_result_text(DEM2D_RESULT_COUNT));
}

/* --- materials ------------------------------------------------------------------------------- */

/* A disc of one material driven along a heavy disc of another: stiffnesses and friction are read
   off the contact. */
static void check_meeting(const dem2d_pair_desc *given, double kn, double kt, double mu) {
    const dem2d_material_desc first = material_desc(2700, 1e6, 4e5, 0.5),
                              second = material_desc(1e9, 3e6, 1.2e6, 0.2);
    dem2d_world_desc desc = basic_desc();
    desc.time_step = 1e-5;
    scene s = open_scene(&desc, &first);
    const dem2d_shape_id disc = add_disc(s.world, 1);
    dem2d_particle_desc slider = one_desc(&s, disc, 0, 1.999);
    dem2d_particle_id id;
    slider.motion = DEM2D_DRIVEN, slider.velocity.x = 1e-2;
    assert_ok(dem2d_world_add_particle(s.world, &slider, &id));
    const dem2d_material_id material = s.material;
    assert_ok(dem2d_world_add_material(s.world, &second, &s.material));
    add_one(&s, disc, 0, 0);
    if (given) assert_ok(dem2d_world_set_pair(s.world, material, s.material, given));
    run(s.world, 100);
    dem2d_contact_info c = only_contact(s.world);
    assert_near(c.normal_force / c.depth, kn, 1e-13);
    const double before = fabs(c.tangential_force);
    run(s.world, 100);
    c = only_contact(s.world);
    assert_between(fabs(c.tangential_force), 0, 0.9 * mu * c.normal_force);
    /* 100 steps of 1e-7 m; the lever arm is short of the radius by half of 1e-3 */
    assert_near(fabs(c.tangential_force) - before, kt * 1e-5, 1e-3);
    run(s.world, 20000);
    c = only_contact(s.world);
    assert_near(fabs(c.tangential_force), mu * c.normal_force, 1e-13);
    dem2d_world_destroy(s.world);
}

static void test_mixing(void **state) {
    (void)state;
    const dem2d_pair_desc given = pair_desc(5e6, 2e5, 0.05);
    check_meeting(NULL, 1.5e6, 6e5, 0.2); /* harmonic means, the smaller friction */
    check_meeting(&given, 5e6, 2e5, 0.05);
}

/* --- particles ------------------------------------------------------------------------------- */

static void test_motion(void **state) {
    (void)state;
    dem2d_world_desc desc = basic_desc();
    desc.gravity.y = -G;
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id disc = add_disc(s.world, 0.1);
    dem2d_particle_desc grain = one_desc(&s, disc, 0, 0);
    dem2d_particle_id fixed, driven;
    grain.motion = DEM2D_FIXED;
    assert_ok(dem2d_world_add_particle(s.world, &grain, &fixed));
    grain.motion = DEM2D_DRIVEN, grain.position.x = 0.15; /* overlaps: forces must not matter */
    grain.velocity = vec(0.02, 0.01), grain.angular_velocity = 0.5;
    assert_ok(dem2d_world_add_particle(s.world, &grain, &driven));
    const dem2d_particle_id loose = add_one(&s, disc, 5, 0);
    run(s.world, 1000);
    assert_same_bits(particle(s.world, fixed).pose.position.x, 0);
    assert_same_bits(particle(s.world, fixed).pose.position.y, 0);
    dem2d_particle_info info = particle(s.world, driven);
    /* 1000 sums of rounded numbers */
    assert_within(info.pose.position.x, 0.152, 1e-13);
    assert_within(info.pose.position.y, 0.001, 1e-13);
    assert_within(dem2d_rot_angle(info.pose.rotation), 0.05,
                  1e-8); /* turns by a rational rotation */
    assert_within(hypot(info.pose.rotation.c, info.pose.rotation.s), 1, 4 * DBL_EPSILON);
    info = particle(s.world, loose);
    assert_near(info.velocity.y, -G * 0.1, 1e-12);
    /* leapfrog: y = -g dt^2 n (n + 1) / 2 */
    assert_near(info.pose.position.y, -G * 1e-8 * 1000 * 1001 / 2, 1e-12);
    assert_near(info.inertia, info.mass * 0.005L, 1e-14);

    assert_ok(dem2d_world_move_particle(s.world, loose, vec(3, 2), 1));
    info = particle(s.world, loose);
    assert_near(info.pose.position.x, 3, 0);
    assert_near(dem2d_rot_angle(info.pose.rotation), 1, 1e-15);
    assert_result(dem2d_world_move_particle(s.world, loose, vec(NAN, 2), 1), DEM2D_NOT_FINITE);
    assert_result(dem2d_world_move_particle(s.world, loose, vec(0, 2), NAN), DEM2D_NOT_FINITE);
    assert_ok(dem2d_world_drive_particle(s.world, loose, DEM2D_DRIVEN, vec(0, 1), 0));
    run(s.world, 10);
    assert_near(particle(s.world, loose).pose.position.y, 2.001, 1e-14);
    assert_ok(dem2d_world_drive_particle(s.world, loose, DEM2D_FIXED, vec(0, 0), 0));
    run(s.world, 10);
    assert_near(particle(s.world, loose).pose.position.y, 2.001, 1e-14);
    assert_result(dem2d_world_drive_particle(s.world, loose, DEM2D_FIXED, vec(1, 0), 0),
                  DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_drive_particle(s.world, loose, DEM2D_FREE, vec(1, NAN), 0),
                  DEM2D_NOT_FINITE);
    assert_ok(dem2d_world_remove_particle(s.world, driven));
    run(s.world, 1);
    assert_int_equal(stats(s.world).particles, 2);
    assert_int_equal(stats(s.world).contacts, 0);
    dem2d_world_destroy(s.world);
}

/* Moving a particle by hand forgets its tangential springs. */
static void test_move_resets_friction(void **state) {
    (void)state;
    const dem2d_world_desc desc = basic_desc();
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id ground = add_disc(s.world, 100); /* heavy: it stays where it is */
    const dem2d_particle_id id = add_one(&s, add_disc(s.world, 0.1), 0, 100.1 - 1e-4);
    add_one(&s, ground, 0, 0);
    assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_DRIVEN, vec(0.01, 0), 0));
    run(s.world, 100);
    const double wound = fabs(only_contact(s.world).tangential_force);
    assert_near(wound, 0.4 * 1e7 * 1e-4, 1e-3); /* slid by 1e-4 m: at the cap */
    const dem2d_vec here = particle(s.world, id).pose.position;
    assert_ok(dem2d_world_move_particle(s.world, id, here, 0));
    run(s.world, 1);
    assert_between(fabs(only_contact(s.world).tangential_force), 0, 0.05 * wound);
    dem2d_world_destroy(s.world);
}

/* --- walls ----------------------------------------------------------------------------------- */

static void test_wall_motion(void **state) {
    (void)state;
    const dem2d_world_desc desc = basic_desc();
    const scene s = open_scene(&desc, &stone);
    const dem2d_wall_id left = add_plane(&s, 0, 0, 3, 0);
    dem2d_wall_desc mover = wall_desc(&s, 2, 0, -1, 0);
    dem2d_wall_id right, lid;
    mover.mode = DEM2D_WALL_MOVING, mover.velocity = vec(-0.5, 0.25);
    assert_ok(dem2d_world_add_wall(s.world, &mover, &right));
    dem2d_wall_desc top = wall_desc(&s, 0, 5, 0, -1);
    top.spans[0] = left, top.spans[1] = right;
    assert_ok(dem2d_world_add_wall(s.world, &top, &lid));
    run(s.world, 1001); /* the last force pass is at step 1000 */
    assert_near(wall(s.world, left).normal.x, 1, 0);
    assert_same_bits(wall(s.world, left).point.x, 0);
    assert_within(wall(s.world, right).point.x, 2 - 0.5L * 0.1001L, 1e-12);
    assert_within(wall(s.world, lid).length, 1.95, 1e-4); /* to one step's travel */
    assert_near(wall(s.world, left).length, 0, 0);
    mover.mode = DEM2D_WALL_STILL, mover.point = vec(1.5, 0), mover.velocity = vec(0, 0);
    assert_ok(dem2d_world_set_wall(s.world, right, &mover));
    run(s.world, 10);
    assert_near(wall(s.world, right).point.x, 1.5, 0);
    assert_near(wall(s.world, lid).length, 1.5, 1e-15);
    dem2d_world_destroy(s.world);
}

/* A servo wall on a column of n grains in a frictionless channel: the stress on the lid and on the
   floor is the target, and the lid's length is the width of the channel. */
static void check_servo(int n, bool boxes, double stress) {
    const dem2d_material_desc smooth = material_desc(2700, 1e7, 0, 0);
    const dem2d_vec square[4] = {{0, 0}, {0.1, 0}, {0.1, 0.1}, {0, 0.1}};
    const double width = 0.1001;
    dem2d_world_desc desc = basic_desc();
    desc.time_step = 2e-5, desc.local_damping = 0.7;
    const scene s = open_scene(&desc, &smooth);
    dem2d_shape *box;
    dem2d_shape_id shape = add_disc(s.world, 0.05);
    assert_ok(dem2d_shape_create_polygon(NULL, square, 4, 0, &box));
    if (boxes) assert_ok(dem2d_world_add_shape(s.world, box, &shape));
    dem2d_shape_destroy(box);
    for (int i = 0; i < n; i++) add_one(&s, shape, width / 2, 0.05 + 0.1001 * i);
    const dem2d_wall_id floor = add_plane(&s, 0, 0, 0, 1);
    dem2d_wall_desc lid = wall_desc(&s, 0, 0.1002 * n, 0, -1);
    dem2d_wall_id id;
    lid.spans[0] = add_plane(&s, 0, 0, 1, 0), lid.spans[1] = add_plane(&s, width, 0, -1, 0);
    lid.mode = DEM2D_WALL_SERVO, lid.stress = stress, lid.max_speed = 0.1;
    assert_ok(dem2d_world_add_wall(s.world, &lid, &id));
    run(s.world, 50000);
    assert_near(wall(s.world, id).length, width, 1e-12);
    assert_near(wall(s.world, id).target, stress, 0);
    /* at rest to a thousandth of the load; boxes rattle in their single contact points */
    const double tolerance = boxes ? 1e-2 : 1e-3;
    assert_near(wall(s.world, id).stress, stress, tolerance);
    assert_near(wall(s.world, id).force.y, stress * width, tolerance);
    assert_near(-wall(s.world, floor).force.y, stress * width, tolerance);
    assert_between(hypot(wall(s.world, id).velocity.x, wall(s.world, id).velocity.y), 0,
                   boxes ? 1e-2 : 1e-3);
    dem2d_world_destroy(s.world);
}

static void test_servo(void **state) {
    (void)state;
    check_servo(1, false, 1e4);
    check_servo(5, false, 2e4);
    check_servo(5, true, 2e4);
}

/* A servo wall presses one grain, a disc or a box, on a floor. Speeds are in units of the target
   over sqrt(kn m), times in contact times. */
static const double pi = (double)TEST_PI;

typedef struct servo_case {
    bool box, segment;
    double damping_ratio, steps, top_speed; /* steps: per contact time */
    dem2d_law_fn *law;
    double weight, local_damping; /* of the target */
} servo_case;

typedef struct servo_press {
    dem2d_world *world;
    dem2d_wall_id lid;
    double target, top_speed;
} servo_press;

static servo_press make_press(const servo_case *c) {
    const double r = 0.05, kn = 1e7, overlap = 1e-3 * r;
    const dem2d_vec square[4] = {{-r, -r}, {r, -r}, {r, r}, {-r, r}};
    const dem2d_material_desc stone = {.density = 2000,
                                       .normal_stiffness = kn,
                                       .tangential_stiffness = 0.8 * kn,
                                       .friction = 0.3,
                                       .damping_ratio = c->law ? 0 : c->damping_ratio};
    const double mass = 2000 * (c->box ? 4 : pi) * r * r, unit = overlap * sqrt(kn / mass);
    dem2d_world_desc desc = {0};
    desc.time_step = pi * sqrt(mass / kn) / c->steps;
    desc.law = c->law, desc.local_damping = c->local_damping;
    desc.gravity.y = -c->weight * kn * overlap / mass;
    const scene s = open_scene(&desc, &stone);
    dem2d_shape *box;
    dem2d_shape_id shape = add_disc(s.world, r);
    assert_ok(dem2d_shape_create_polygon(NULL, square, 4, 0, &box));
    if (c->box) assert_ok(dem2d_world_add_shape(s.world, box, &shape));
    dem2d_shape_destroy(box);
    add_one(&s, shape, 0, r);
    add_plane(&s, 0, 0, 0, 1);
    servo_press p = {s.world, {0, 0}, kn * overlap, c->top_speed * unit};
    dem2d_wall_desc lid = wall_desc(&s, 0.5, 2 * r + overlap, 0, -1);
    lid.mode = DEM2D_WALL_SERVO, lid.stress = p.target, lid.max_speed = p.top_speed, lid.length = 1;
    lid.segment = c->segment, lid.end = (dem2d_vec){-0.5, lid.point.y};
    assert_ok(dem2d_world_add_wall(s.world, &lid, &p.lid));
    return p;
}

/* At rest after 200 contact times and the way there: over another 10 the mean stress is right to
   1e-4, that of each step to 1e-2, and the wall's speed is below 1e-3 of its top speed. */
static void check_press(const servo_case *c) {
    servo_press p = make_press(c);
    const int steps = (int)(10 * c->steps);
    double mean = 0, error = 0, speed = 0;
    run(p.world, (int)((200 + 4 / pi / c->top_speed) * c->steps));
    for (int i = 0; i < steps; i++) {
        run(p.world, 1);
        const dem2d_wall_info lid = wall(p.world, p.lid);
        mean += lid.stress / steps;
        error = fmax(error, fabs(lid.stress / p.target - 1));
        speed = fmax(speed, fabs(lid.velocity.y) / p.top_speed);
    }
    if (!(fabs(mean / p.target - 1) < 1e-4 && error < 1e-2 && speed < 1e-3)) {
        print_error("%s, %s, damping ratio %g, t_c/%g, top speed %g: mean %g, error %g, speed %g\n",
                    c->box ? "box" : "disc", c->segment ? "segment" : "half-plane",
                    c->damping_ratio, c->steps, c->top_speed, mean / p.target - 1, error, speed);
        fail();
    }
    dem2d_world_destroy(p.world);
}

/* Twice as stiff as the materials, with a dashpot that they do not have, without friction. */
static void other_law(void *user, dem2d_law_batch *b) {
    (void)user;
    for (int k = 0; k < b->count; k++) {
        b->stiffness[k] *= 2, b->friction[k] = 0;
        b->dashpot[k] = 2 * 0.4 * sqrt(b->mass[k] * b->stiffness[k]);
    }
    dem2d_law_builtin(b);
}

/* The dashpots of the contacts answer to the wall's own speed: a wall that knows the springs alone
   flips between its two top speeds. Servo walls were tested without dashpots only, and by the last
   step of a run: neither would have shown it. */
static void test_servo_rest(void **state) {
    (void)state;
    static const double ratios[] = {0, 0.02, 0.2, 0.5, 1, 2}, speeds[] = {0.1, 3, 100};
    for (int i = 0; i < COUNT_OF(ratios); i++)
        for (int k = 0; k < COUNT_OF(speeds); k++) {
            servo_case c = {false, k == 1, ratios[i], i < 5 ? 10 : 30, speeds[k], NULL, 0, 0};
            check_press(&c);
            c.box = true, c.steps = 50;
            check_press(&c);
        }
    check_press(&(servo_case){false, false, 0.3, 500, 10, NULL, 0, 0});
    check_press(&(servo_case){false, false, 0, 30, 1, other_law, 0, 0});
    check_press(&(servo_case){false, false, 0.2, 30, 1, NULL, 0, 0.7});
    /* lighter than the grain and fast: thrown off, it may not come back as fast each time */
    check_press(&(servo_case){false, false, 0.2, 10, 1000, NULL, 3, 0});
    check_press(&(servo_case){false, false, 0.5, 30, 1000, NULL, 3, 0});
}

/* A refused step leaves a servo wall as it was. */
static void test_servo_refused(void **state) {
    (void)state;
    const servo_case c = {false, false, 0.2, 30, 10, NULL, 0, 0};
    servo_press p = make_press(&c);
    int done = -1;
    run(p.world, 100);
    assert_ok(dem2d_world_set_time_step(p.world, 1));
    const uint64_t hash = dem2d_world_hash(p.world);
    assert_result(dem2d_world_step(p.world, 1, &done), DEM2D_TIME_STEP);
    assert_int_equal(done, 0);
    assert_true(dem2d_world_hash(p.world) == hash);
    dem2d_world_destroy(p.world);
}

/* What lies between two servo walls with the same target may not slide along for ever: a row of
   discs that is thrown at one of them comes to rest. */
static void test_servo_facing(void **state) {
    (void)state;
    const dem2d_material_desc rubber = {
        .density = 2000, .normal_stiffness = 1e7, .damping_ratio = 0.3};
    const double r = 0.05, target = 1e4, mass = 2000 * pi * r * r, tc = pi * sqrt(mass / 1e7);
    dem2d_world_desc desc = {0};
    desc.time_step = tc / 30;
    const scene s = open_scene(&desc, &rubber);
    const dem2d_shape_id disc = add_disc(s.world, r);
    dem2d_wall_id walls[2];
    for (int i = 0; i < 5; i++) {
        dem2d_particle_desc grain = one_desc(&s, disc, 2.01 * r * i, 0);
        grain.velocity.x = target / sqrt(1e7 * mass);
        dem2d_particle_id id;
        assert_ok(dem2d_world_add_particle(s.world, &grain, &id));
    }
    for (int i = 0; i < 2; i++) {
        dem2d_wall_desc side = wall_desc(&s, i == 0 ? -1.01 * r : 9.05 * r, 0, i == 0 ? 1 : -1, 0);
        side.mode = DEM2D_WALL_SERVO, side.stress = target, side.max_speed = 1, side.length = 1;
        assert_ok(dem2d_world_add_wall(s.world, &side, &walls[i]));
    }
    run(s.world, 600 * 30);
    for (int i = 0; i < 2; i++) {
        assert_near(wall(s.world, walls[i]).stress, target, 1e-4);
        assert_between(fabs(wall(s.world, walls[i]).velocity.x), 0, 1e-3);
    }
    dem2d_world_destroy(s.world);
}

/* Far from its grains a servo wall approaches at its top speed, and no faster. */
static void test_servo_speed(void **state) {
    (void)state;
    const dem2d_world_desc desc = basic_desc();
    const scene s = open_scene(&desc, &stone);
    dem2d_wall_desc lid = wall_desc(&s, 0, 1, 0, -1);
    dem2d_wall_id id;
    lid.mode = DEM2D_WALL_SERVO, lid.stress = 1e5, lid.max_speed = 0.1, lid.length = 1;
    assert_ok(dem2d_world_add_wall(s.world, &lid, &id));
    run(s.world, 1000);
    assert_near(wall(s.world, id).velocity.y, -0.1, 1e-12);
    assert_within(wall(s.world, id).point.y, 1 - 0.01, 2e-5); /* the first step may start at rest */
    dem2d_world_destroy(s.world);
}

/* --- queries --------------------------------------------------------------------------------- */

/* Three discs in a row with known overlaps, the last one smaller. */
static scene make_row(dem2d_particle_id ids[3]) {
    const dem2d_material_desc smooth = material_desc(2700, 1e6, 0, 0);
    const dem2d_world_desc desc = basic_desc();
    const scene s = open_scene(&desc, &smooth);
    const dem2d_shape_id disc = add_disc(s.world, 1);
    ids[0] = add_one(&s, disc, 0, 0);
    ids[1] = add_one(&s, disc, 1.998, 0);
    dem2d_particle_desc small = one_desc(&s, disc, 1.998 + 1.496, 0);
    small.scale = 0.5;
    assert_ok(dem2d_world_add_particle(s.world, &small, &ids[2]));
    return s;
}

static void test_lists(void **state) {
    (void)state;
    dem2d_particle_id ids[3], list[3];
    dem2d_contact_info contacts[2];
    int count = -1;
    const scene s = make_row(ids);
    run(s.world, 1);
    memset(list, 0x77, sizeof list);
    const dem2d_particle_id untouched = list[2];
    assert_ok(dem2d_world_particles(s.world, NULL, 0, &count));
    assert_int_equal(count, 3);
    assert_ok(dem2d_world_particles(s.world, list, 2, &count));
    assert_int_equal(count, 3);
    assert_memory_equal(list, ids, 2 * sizeof *ids);
    assert_memory_equal(&list[2], &untouched, sizeof untouched);

    memset(contacts, 0x77, sizeof contacts);
    const dem2d_contact_info before = contacts[1];
    assert_ok(dem2d_world_contacts(s.world, NULL, 0, &count));
    assert_int_equal(count, 2);
    assert_ok(dem2d_world_contacts(s.world, contacts, 1, &count));
    assert_int_equal(count, 2);
    assert_memory_equal(&contacts[1], &before, sizeof before);
    const dem2d_contact_info *c = contacts;
    assert_memory_equal(&c->a, &ids[0], sizeof c->a);
    assert_memory_equal(&c->b, &ids[1], sizeof c->b);
    assert_int_equal(c->wall.generation, 0);
    assert_near(c->normal.x, 1, 1e-15);
    assert_near(c->branch.x, 1.998, 1e-15);
    assert_within(c->point.x, 0.999, 1e-15);
    assert_within(c->depth, 0.002, 4e-16); /* a difference of numbers near 2 */
    assert_near(c->normal_force, 2000, 1e-12);
    dem2d_world_destroy(s.world);
}

static void test_packing_and_stats(void **state) {
    (void)state;
    dem2d_particle_id ids[3];
    const scene s = make_row(ids);
    dem2d_packing packing;
    run(s.world, 1);
    assert_ok(dem2d_world_packing(s.world, &packing));
    assert_near(packing.coordination, 4.0L / 3, 1e-15);
    assert_near(packing.coordination_loaded, 2, 1e-15); /* only the middle one has two */
    assert_near(packing.mean_overlap, (0.002L / 1 + 0.004L / 0.5L) / 2, 1e-12);
    assert_near(packing.max_overlap, 0.008, 1e-12);
    assert_near(packing.solid_area, TEST_PI * 2.25L, 1e-15);
    const dem2d_stats first = stats(s.world);
    assert_int_equal(first.steps, 1);
    assert_int_equal(first.particles, 3);
    assert_int_equal(first.contacts, 2);
    assert_int_equal(first.wall_contacts, 0);
    assert_true(first.pairs >= 2 && first.list_rebuilds >= 1);
    assert_int_equal(first.not_converged, 0);
    /* a wall under the small one only: the greatest overlap may be with it */
    add_plane(&s, 0, -0.4, 0, 1);
    assert_ok(dem2d_world_move_particle(s.world, ids[0], vec(0, 50), 0));
    assert_ok(dem2d_world_move_particle(s.world, ids[1], vec(50, 50), 0));
    assert_ok(dem2d_world_move_particle(s.world, ids[2], vec(0, 0), 0));
    run(s.world, 1);
    assert_ok(dem2d_world_packing(s.world, &packing));
    assert_near(packing.max_overlap, 0.1 / 0.5, 1e-12);
    assert_int_equal(stats(s.world).wall_contacts, 1);
    assert_int_equal(stats(s.world).contacts, 0);
    const dem2d_contact_info c = only_contact(s.world);
    assert_int_equal(c.b.generation, 0);
    assert_true(c.wall.generation != 0);
    assert_within(c.normal.y, -1, 1e-15);
    assert_within(c.point.y, -0.4, 1e-15); /* on the wall, below the disc's lowest point */
    assert_within(hypot(c.branch.x - c.point.x, c.branch.y - c.point.y), 0, 1e-12);
    dem2d_world_destroy(s.world);
}

static void test_bytes(void **state) {
    (void)state;
    test_env env;
    pile p;
    const pile_desc desc = {60, 0, ALL, true, 0, 0.3, 0.4};
    test_env_init(&env);
    make_pile(&p, &env, &desc);
    run(p.scene.world, 100);
    assert_int_equal(stats(p.scene.world).bytes, env.bytes);
    end_pile(&p, &env);
}

/* Free flight: each energy against its formula, and their sum constant. */
static void test_energy(void **state) {
    (void)state;
    dem2d_world_desc desc = basic_desc();
    desc.gravity = vec(3, -G);
    const scene s = open_scene(&desc, &stone);
    dem2d_particle_desc grain = one_desc(&s, add_disc(s.world, 0.1), 1, 2);
    dem2d_particle_id id;
    dem2d_energy e;
    grain.velocity = vec(1, 5), grain.angular_velocity = 7;
    assert_ok(dem2d_world_add_particle(s.world, &grain, &id));
    const double mass = particle(s.world, id).mass, inertia = particle(s.world, id).inertia;
    long double total = 0;
    for (int i = 0; i < 1000; i++) {
        const dem2d_particle_info before = particle(s.world, id);
        run(s.world, 1);
        const dem2d_particle_info after = particle(s.world, id);
        assert_ok(dem2d_world_energy(s.world, &e));
        const long double v0 = hypotl(before.velocity.x, before.velocity.y);
        const long double v1 = hypotl(after.velocity.x, after.velocity.y);
        assert_near(e.translational, mass * (v0 * v0 + v1 * v1) / 4, 1e-13);
        assert_near(e.rotational, inertia * 49 / 2, 1e-13);
        assert_near(e.potential,
                    mass * (G * (long double)before.pose.position.y - 3 * before.pose.position.x),
                    1e-12);
        assert_within(e.normal + e.tangential, 0, 0);
        const long double now = (long double)e.translational + e.potential;
        if (i == 0) total = now;
        assert_near(now, total, 1e-12);
    }
    dem2d_world_destroy(s.world);
}

/* Springs: k depth^2 / 2 of two discs pressed together, and of a friction spring below its cap. */
static void test_spring_energy(void **state) {
    (void)state;
    dem2d_particle_id ids[3];
    const scene s = make_row(ids);
    const dem2d_pair_desc sticky = pair_desc(1e6, 5e5, 100);
    dem2d_energy e;
    assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &sticky));
    assert_ok(dem2d_world_move_particle(s.world, ids[2], vec(50, 0), 0));
    assert_ok(dem2d_world_drive_particle(s.world, ids[0], DEM2D_DRIVEN, vec(0, 0.01), 0));
    run(s.world, 50);
    const dem2d_contact_info c = only_contact(s.world);
    assert_ok(dem2d_world_energy(s.world, &e));
    assert_near(e.normal, 1e6 * c.depth * c.depth / 2, 1e-13);
    assert_true(fabs(c.tangential_force) > 0);
    assert_near(e.tangential, c.tangential_force * c.tangential_force / (2 * 5e5), 1e-12);
    dem2d_world_destroy(s.world);
}

/* --- balances -------------------------------------------------------------------------------- */

static double weight_of(const dem2d_world *world) {
    dem2d_particle_id ids[128];
    int count;
    double weight = 0;
    assert_ok(dem2d_world_particles(world, ids, 128, &count));
    for (int i = 0; i < count; i++) weight += particle(world, ids[i]).mass * G;
    return weight;
}

static double carried(const pile *p) {
    double up = 0;
    for (int i = 0; i < 3; i++) up -= wall(p->scene.world, p->walls[i]).force.y;
    return up;
}

/* Smooth grains that have come to rest in a box: the walls carry their weight. Some take longer
   than others to stop rolling. */
static void test_weight(void **state) {
    (void)state;
    test_env env;
    pile p;
    const pile_desc desc = {29, 0, SMOOTH, false, 0, 0.7, 0.4};
    test_env_init(&env);
    make_pile(&p, &env, &desc);
    const double weight = weight_of(p.scene.world);
    for (int i = 0; i < 40; i++) {
        run(p.scene.world, 5000);
        if (fabs(carried(&p) - weight) < 1e-7 * weight && kinetic(p.scene.world) < 1e-9) break;
    }
    run(p.scene.world, 1000); /* at rest, not passing by */
    assert_near(carried(&p), weight, 1e-6);
    assert_between(kinetic(p.scene.world), 0, 1e-8);
    end_pile(&p, &env);
}

/* Frictionless discs squeezed without gravity: each pair of walls carries the same force, and the
   stress from the contacts is that pressure. */
static void test_stress(void **state) {
    (void)state;
    test_env env;
    pile p;
    const pile_desc desc = {40, 0, DISCS, true, 0, 0.7, 0};
    dem2d_stress stress;
    test_env_init(&env);
    make_pile(&p, &env, &desc);
    run(p.scene.world, 10000); /* fall first */
    assert_ok(dem2d_world_set_gravity(p.scene.world, vec(0, 0)));
    run(p.scene.world, 20000);
    const dem2d_wall_info floor = wall(p.scene.world, p.walls[0]);
    const dem2d_wall_info left = wall(p.scene.world, p.walls[1]);
    const dem2d_wall_info right = wall(p.scene.world, p.walls[2]);
    const dem2d_wall_info lid = wall(p.scene.world, p.walls[3]);
    const double height = lid.point.y - floor.point.y;
    assert_ok(dem2d_world_stress(p.scene.world, 0.5 * height, &stress));
    assert_near(lid.stress, 2e4, 1e-4);
    assert_near(-floor.force.y, lid.force.y, 1e-4);
    assert_near(-left.force.x, right.force.x, 1e-4);
    /* contact points lie half an overlap of 1e-4 m outside the walls, of a height of 0.2 m */
    assert_near(stress.yy, lid.force.y / 0.5, 3e-3);
    assert_near(stress.xx, right.force.x / height, 3e-3);
    assert_within(stress.xy, stress.yx, 1e-6 * stress.yy); /* moments balance */
    end_pile(&p, &env);
}

/* Damping of a free body: g (1 + a) against the motion, g (1 - a) with it. */
static void test_local_damping(void **state) {
    (void)state;
    dem2d_world_desc desc = basic_desc();
    desc.gravity.y = -G, desc.local_damping = 0.3;
    const scene s = open_scene(&desc, &stone);
    dem2d_particle_desc grain = one_desc(&s, add_disc(s.world, 0.1), 0, 0);
    dem2d_particle_id up, down;
    grain.velocity.y = 2;
    assert_ok(dem2d_world_add_particle(s.world, &grain, &up));
    grain.velocity.y = -2, grain.position.x = 1;
    assert_ok(dem2d_world_add_particle(s.world, &grain, &down));
    run(s.world, 1000); /* 0.1 s: the upward one does not turn round */
    assert_near(2 - particle(s.world, up).velocity.y, G * 0.13L, 1e-12);
    assert_near(particle(s.world, down).velocity.y + 2, -G * 0.07L, 1e-12);
    dem2d_world_destroy(s.world);
}

static void test_global_damping(void **state) {
    (void)state;
    const double xi = 40, dt = 1e-3;
    dem2d_world_desc desc = basic_desc();
    desc.gravity.y = -G, desc.global_damping = xi, desc.time_step = dt;
    const scene s = open_scene(&desc, &stone);
    dem2d_particle_desc grain = one_desc(&s, add_disc(s.world, 0.1), 0, 0);
    dem2d_particle_id id;
    grain.velocity = vec(3, 2), grain.angular_velocity = 5;
    assert_ok(dem2d_world_add_particle(s.world, &grain, &id));
    long double vx = 3, vy = 2, spin = 5;
    const long double keep_part = 1 - xi * dt / 2, whole = 1 + xi * dt / 2;
    for (int i = 0; i < 200; i++) {
        run(s.world, 1);
        vx = keep_part * vx / whole, spin = keep_part * spin / whole;
        vy = (keep_part * vy - dt * G) / whole;
        assert_near(particle(s.world, id).velocity.x, vx, 1e-13);
        assert_within(particle(s.world, id).velocity.y, vy, 1e-13);
        assert_near(particle(s.world, id).angular_velocity, spin, 1e-13);
    }
    dem2d_world_destroy(s.world);
}

static void test_pile_settles(void **state) {
    (void)state;
    test_env env;
    pile p;
    static world_state now;
    const pile_desc desc = {60, 0, ALL, false, 0, 0.7, 0.4};
    double peak = 0;
    test_env_init(&env);
    make_pile(&p, &env, &desc);
    for (int i = 0; i < 30; i++) {
        run(p.scene.world, 100);
        keep(&now, p.scene.world, p.walls, 3); /* checks that every number is finite */
        peak = fmax(peak, kinetic(p.scene.world));
    }
    run(p.scene.world, 27000);
    assert_between(kinetic(p.scene.world), 0, 1e-2 * peak);
    assert_int_equal(stats(p.scene.world).not_converged, 0);
    /* mixed grains jitter on their faces: the mean over a while is the weight */
    double up = 0;
    for (int i = 0; i < 1000; i++) {
        run(p.scene.world, 1);
        up += carried(&p) / 1000;
    }
    assert_near(up, weight_of(p.scene.world), 5e-2);
    /* the list has stopped growing: no more allocations */
    const int calls = env.calls;
    run(p.scene.world, 1000);
    assert_int_equal(env.calls, calls);
    end_pile(&p, &env);
}

/* --- runs that repeat ------------------------------------------------------------------------ */

static void run_pile(const pile_desc *desc, int steps, world_state *result) {
    test_env env;
    pile p;
    test_env_init(&env);
    make_pile(&p, &env, desc);
    run(p.scene.world, steps);
    keep(result, p.scene.world, p.walls, desc->lid ? 4 : 3);
    end_pile(&p, &env);
}

static void test_determinism(void **state) {
    (void)state;
    static world_state first, second;
    const pile_desc desc = {60, 0, ALL, true, 0, 0.3, 0.4};
    run_pile(&desc, 1500, &first);
    run_pile(&desc, 1500, &second);
    assert_same_state(&first, &second, 0);
}

static void test_scaled_runs(void **state) {
    (void)state;
    static const int powers[] = {40, -40, 1};
    static world_state first, scaled;
    pile_desc desc = {30, 0, ALL, true, 0, 0.3, 0.4};
    run_pile(&desc, 1500, &first);
    for (int i = 0; i < COUNT_OF(powers); i++) {
        desc.power = powers[i];
        run_pile(&desc, 1500, &scaled);
        assert_same_state(&first, &scaled, powers[i]);
    }
}

/* How often the list is renewed must not show: friction keeps its history. Discs, because their
   contacts are exact whatever was cached. */
static void test_skin(void **state) {
    (void)state;
    static world_state thin, thick;
    pile_desc desc = {40, 0, DISCS, false, 1e-3, 0.1, 0.5};
    run_pile(&desc, 4000, &thin);
    desc.skin = 2;
    run_pile(&desc, 4000, &thick);
    assert_int_equal(thin.count, thick.count);
    for (int i = 0; i < 40 * PARTICLE_NUMBERS; i++) {
        if (i % PARTICLE_NUMBERS > 3) continue; /* positions and rotations */
        assert_within(thin.numbers[i], thick.numbers[i], 1e-9);
    }
}

/* --- time step ------------------------------------------------------------------------------- */

static void test_time_step_bounds(void **state) {
    (void)state;
    static const double tangential[] = {0, 1e7, 5e7};
    for (int i = 0; i < COUNT_OF(tangential); i++) {
        const dem2d_material_desc material = material_desc(2700, 1e7, tangential[i], 0.5);
        const dem2d_world_desc desc = basic_desc();
        const scene s = open_scene(&desc, &material);
        const dem2d_particle_id id = add_one(&s, add_disc(s.world, 0.1), 0, 0.1 - 1e-7);
        dem2d_particle_id worst = {7, 7};
        double safe, limit;
        assert_ok(dem2d_world_time_step_bounds(s.world, &safe, &limit, &worst));
        assert_true(limit == HUGE_VAL && safe > 0 && safe < 1);
        assert_int_equal(worst.generation, 0);
        add_plane(&s, 0, 0, 0, 1);
        run(s.world, 1);
        assert_ok(dem2d_world_time_step_bounds(s.world, &safe, &limit, &worst));
        /* I = m R^2 / 2: sliding and turning together have 3 kt / m; lever arm to 1e-6 */
        const double mass = particle(s.world, id).mass;
        const double stiffest = fmax(1e7, 3 * tangential[i]);
        assert_near(limit, 2 / sqrt(stiffest / mass), 1e-5);
        /* a wall does not give way; but one contact with a like particle is always counted:
           2 (1 / m + R^2 / I) = 6 / m */
        assert_between(safe, 2 / sqrt(6 * fmax(1e7, tangential[i]) / mass) * (1 - 1e-12), limit);
        assert_memory_equal(&worst, &id, sizeof id);
        dem2d_world_destroy(s.world);
    }
    dem2d_particle_id ids[3];
    const scene row = make_row(ids); /* kt = 0, 2 free ones: 2 sqrt(m / 2k) and 2 sqrt(m / k) */
    double safe, limit;
    assert_ok(dem2d_world_remove_particle(row.world, ids[2]));
    run(row.world, 1);
    assert_ok(dem2d_world_time_step_bounds(row.world, &safe, &limit, NULL));
    const double mass = particle(row.world, ids[0]).mass;
    assert_between(safe, 2 * sqrt(mass / 6e6) * (1 - 1e-12), 2 * sqrt(mass / 2e6) * (1 + 1e-12));
    assert_near(limit, 2 * sqrt(mass / 1e6), 1e-12);
    dem2d_world_destroy(row.world);
}

/* A disc bounces on a wall with a step of 1.5 times the limit: found when the list is renewed. The
   world is that of a twin which took only the steps that were done. */
static void test_time_step_too_long(void **state) {
    (void)state;
    static world_state failed, twin_state;
    const dem2d_material_desc smooth = material_desc(2700, 1e7, 0, 0);
    scene twins[2];
    test_env env;
    test_env_init(&env);
    int done = -1;
    for (int i = 0; i < 2; i++) {
        dem2d_world_desc desc = basic_desc();
        desc.gravity.y = -G, desc.env = i ? NULL : &env.env, desc.skip_time_step_check = i;
        twins[i] = open_scene(&desc, &smooth);
        const dem2d_particle_id id = add_one(&twins[i], add_disc(twins[i].world, 0.1), 0, 0.09);
        add_plane(&twins[i], 0, 0, 0, 1);
        const double mass = particle(twins[i].world, id).mass;
        assert_ok(dem2d_world_set_time_step(twins[i].world, 1.5 * 2 * sqrt(mass / 1e7)));
    }
    assert_result(dem2d_world_step(twins[0].world, 1000, &done), DEM2D_TIME_STEP);
    assert_logged(&env, DEM2D_TIME_STEP, 0, NULL); /* particle 0 */
    assert_between(done, 0, 999);
    assert_int_equal(stats(twins[0].world).steps, done);
    run(twins[1].world, done);
    keep(&failed, twins[0].world, NULL, 0);
    keep(&twin_state, twins[1].world, NULL, 0);
    assert_same_state(&failed, &twin_state, 0);
    run(twins[1].world, 1); /* nobody looks */
    assert_ok(dem2d_world_set_time_step(twins[0].world, 1e-5));
    run(twins[0].world, 10);
    for (int i = 0; i < 2; i++) dem2d_world_destroy(twins[i].world);
    assert_clean(&env);
}

/* Between the bounds a step is allowed, and counted when the list is renewed. */
static void test_slow_time_step(void **state) {
    (void)state;
    dem2d_particle_id ids[3];
    const scene s = make_row(ids);
    const double mass = particle(s.world, ids[0]).mass;
    assert_ok(dem2d_world_move_particle(s.world, ids[2], vec(50, 0), 0));
    run(s.world, 1);
    assert_int_equal(stats(s.world).slow_time_step, 0);
    assert_ok(dem2d_world_set_time_step(s.world, 1.8 * sqrt(mass / 1e6)));
    assert_ok(dem2d_world_move_particle(s.world, ids[2], vec(60, 0), 0)); /* renews it */
    run(s.world, 1);
    assert_true(stats(s.world).slow_time_step >= 1);
    dem2d_world_destroy(s.world);
}

/* --- steps that fail ------------------------------------------------------------------------- */

/* A grain flies off the range of a double at some step; the rest is at rest on the floor. */
static void test_state_error(void **state) {
    (void)state;
    static world_state failed, before;
    test_env env;
    pile p;
    const pile_desc desc = {30, 0, ALL, true, 0, 0.7, 0.4};
    dem2d_particle_id ids[30];
    int count, done = -1;
    test_env_init(&env);
    make_pile(&p, &env, &desc);
    run(p.scene.world, 10000);
    assert_ok(dem2d_world_particles(p.scene.world, ids, 30, &count));
    assert_ok(dem2d_world_drive_particle(p.scene.world, ids[7], DEM2D_FREE, vec(1e308, -1e308), 0));
    assert_ok(dem2d_world_set_time_step(p.scene.world, 10)); /* 10 * 1e308 overflows at once */
    assert_true(stats(p.scene.world).contacts > 10);
    keep(&before, p.scene.world, p.walls, 4);
    const dem2d_result result = dem2d_world_step(p.scene.world, 5, &done);
    assert_true(result == DEM2D_STATE || result == DEM2D_TIME_STEP);
    assert_int_equal(done, 0);
    assert_int_equal(stats(p.scene.world).steps, 10000);
    keep(&failed, p.scene.world, p.walls, 4);
    assert_same_state(&before, &failed, 0);
    assert_ok(dem2d_world_drive_particle(p.scene.world, ids[7], DEM2D_FREE, vec(0, 0), 0));
    assert_ok(dem2d_world_set_time_step(p.scene.world, 1e-4));
    run(p.scene.world, 100);
    keep(&failed, p.scene.world, p.walls, 4);
    end_pile(&p, &env);
}

/* The same without the check of the time step, some steps into the call. */
static void test_state_error_later(void **state) {
    (void)state;
    static world_state failed, twin_state;
    scene twins[2];
    int done = -1;
    for (int i = 0; i < 2; i++) {
        dem2d_world_desc desc = basic_desc();
        desc.time_step = 1, desc.skip_time_step_check = true;
        twins[i] = open_scene(&desc, &stone);
        dem2d_particle_desc grain = one_desc(&twins[i], add_disc(twins[i].world, 1), 0, 0);
        dem2d_particle_id id;
        assert_ok(dem2d_world_add_particle(twins[i].world, &grain, &id));
        grain.position.y = 10, grain.velocity.x = 1.6e308;
        assert_ok(dem2d_world_add_particle(twins[i].world, &grain, &id));
    }
    assert_result(dem2d_world_step(twins[0].world, 5, &done), DEM2D_STATE);
    assert_between(done, 0,
                   1); /* the second step overflows, if the first is not too wild already */
    assert_int_equal(stats(twins[0].world).steps, done);
    run(twins[1].world, done);
    keep(&failed, twins[0].world, NULL, 0);
    keep(&twin_state, twins[1].world, NULL, 0);
    assert_same_state(&failed, &twin_state, 0);
    for (int i = 0; i < 2; i++) dem2d_world_destroy(twins[i].world);
}

/* Every allocation fails once. What failed is asked for again, and the run ends in the same bits.
 */
static void test_out_of_memory(void **state) {
    (void)state;
    static world_state expected, got;
    const pile_desc desc = {30, 0, ALL, true, 0, 0.3, 0.4};
    enum { STEPS = 300 };
    int failures = 0;
    run_pile(&desc, STEPS, &expected);
    for (int k = 1;; k++) {
        test_env env;
        pile p;
        int done = 0, more = 0;
        test_env_init(&env);
        test_env_fail(&env, k);
        make_pile(&p, &env, &desc);
        const dem2d_result result = dem2d_world_step(p.scene.world, STEPS, &done);
        if (result != DEM2D_OK) {
            assert_result(result, DEM2D_OUT_OF_MEMORY);
            assert_int_equal(stats(p.scene.world).steps, done);
            test_env_fail(&env, 0);
            assert_ok(dem2d_world_step(p.scene.world, STEPS - done, &more));
        }
        assert_int_equal(done + more, STEPS);
        keep(&got, p.scene.world, p.walls, 4);
        assert_same_state(&expected, &got, 0);
        const bool never_failed = env.fail_at == k && env.calls < k;
        end_pile(&p, &env);
        if (never_failed) break;
        failures++;
    }
    assert_true(failures >= 10); /* a world, shapes, particles, walls, a list at least */
}

/* --- pictures -------------------------------------------------------------------------------- */

typedef struct sink {
    char *text;
    size_t used, room; /* fails when full */
} sink;

static bool take(void *user, const char *bytes, size_t count) {
    sink *s = user;
    if (count >= s->room - s->used) return false;
    memcpy(s->text + s->used, bytes, count);
    s->used += count, s->text[s->used] = 0;
    return true;
}

static int count_words(const char *text, const char *word) {
    int count = 0;
    for (const char *at = text; (at = strstr(at, word)); at++) count++;
    return count;
}

static int count_shapes(const char *text) {
    return count_words(text, "<circle") + count_words(text, "<ellipse") +
           count_words(text, "<polygon") + count_words(text, "<path");
}

static void test_svg(void **state) {
    (void)state;
    static world_state before, after;
    static char text[2][1 << 20];
    test_env env;
    pile p;
    const pile_desc desc = {42, 0, ALL, false, 0, 0.7, 0.4};
    dem2d_svg_desc svg = {0}, none = {0};
    sink out = {text[0], 0, sizeof text[0]};
    test_env_init(&env);
    make_pile(&p, &env, &desc);
    svg.write = take, svg.user = &out;
    run(p.scene.world, 3000);
    keep(&before, p.scene.world, p.walls, 3);
    assert_ok(dem2d_world_write_svg(p.scene.world, &svg, NULL));
    const int with_all = count_shapes(text[0]);
    assert_non_null(strstr(text[0], "<svg"));
    assert_non_null(strstr(text[0], "</svg>"));
    assert_null(strstr(text[0], "nan"));
    assert_null(strstr(text[0], "inf"));
    /* one shape less for one particle less, whatever else is drawn */
    dem2d_particle_id ids[42];
    int count;
    assert_ok(dem2d_world_particles(p.scene.world, ids, 42, &count));
    assert_true(with_all >= count);
    keep(&after, p.scene.world, p.walls, 3);
    assert_same_state(&before, &after, 0);
    for (int i = 0; i < count; i++) assert_ok(dem2d_world_remove_particle(p.scene.world, ids[i]));
    out = (sink){text[1], 0, sizeof text[1]};
    assert_ok(dem2d_world_write_svg(p.scene.world, &svg, NULL)); /* of an empty box */
    assert_int_equal(count_shapes(text[1]), with_all - count);

    out.used = 0, out.room = 200;
    assert_result(dem2d_world_write_svg(p.scene.world, &svg, NULL), DEM2D_IO);
    assert_result(dem2d_world_write_svg(p.scene.world, &none, "no/such/directory/a.svg"), DEM2D_IO);
    assert_result(dem2d_world_write_svg(p.scene.world, &none, NULL), DEM2D_NULL_ARGUMENT);
    out.used = 0, out.room = sizeof text[1];
    assert_int_not_equal(dem2d_world_write_svg(p.scene.world, &svg, "no/such/directory/a.svg"),
                         DEM2D_OK);
    svg.width = -1;
    assert_result(dem2d_world_write_svg(p.scene.world, &svg, NULL), DEM2D_OUT_OF_RANGE);
    svg.width = NAN;
    assert_int_not_equal(dem2d_world_write_svg(p.scene.world, &svg, NULL), DEM2D_OK);
    svg.width = 0, svg.outline_points = 2;
    assert_result(dem2d_world_write_svg(p.scene.world, &svg, NULL), DEM2D_OUT_OF_RANGE);
    end_pile(&p, &env);
}

/* Writing pictures in between does not change the run. */
static void test_svg_changes_nothing(void **state) {
    (void)state;
    static world_state plain, drawn;
    static char text[1 << 20];
    test_env env;
    pile p;
    const pile_desc desc = {30, 0, ALL, true, 0, 0.3, 0.4};
    run_pile(&desc, 1000, &plain);
    test_env_init(&env);
    make_pile(&p, &env, &desc);
    for (int i = 0; i < 10; i++) {
        sink out = {text, 0, sizeof text};
        dem2d_svg_desc svg = {0};
        svg.write = take, svg.user = &out, svg.force_chains = true;
        assert_ok(dem2d_world_write_svg(p.scene.world, &svg, NULL));
        run(p.scene.world, 100);
    }
    keep(&drawn, p.scene.world, p.walls, 4);
    assert_same_state(&plain, &drawn, 0);
    end_pile(&p, &env);
}

/* A disc in contact with a floor; a change of time step, of the law or of the wall is noticed. */
static void test_changes_are_checked(void **state) {
    (void)state;
    const dem2d_world_desc desc = basic_desc();
    const dem2d_pair_desc hard = pair_desc(1e13, 1e13, 0.4);
    for (int change = 0; change < 2; change++) {
        const scene s = open_scene(&desc, &stone);
        const dem2d_particle_id id = add_one(&s, add_disc(s.world, 0.1), 0, 0.1 - 1e-5);
        add_plane(&s, 0, 0, 0, 1);
        run(s.world, 1);
        double safe, limit;
        assert_ok(dem2d_world_time_step_bounds(s.world, &safe, &limit, NULL));
        if (change == 0) assert_ok(dem2d_world_set_time_step(s.world, 1.5 * limit));
        if (change == 1) assert_ok(dem2d_world_set_pair(s.world, s.material, s.material, &hard));
        int done = -1;
        const dem2d_particle_info before = particle(s.world, id);
        assert_result(dem2d_world_step(s.world, 3, &done), DEM2D_TIME_STEP);
        assert_int_equal(done, 0);
        const dem2d_particle_info after = particle(s.world, id);
        assert_memory_equal(&before, &after, sizeof before);
        assert_int_equal(stats(s.world).wall_contacts, 1); /* of the last good step */
        dem2d_world_destroy(s.world);
    }
}

/* Contacts with a wall live on when it is described anew, and end when it turns. */
static void test_set_wall_and_contacts(void **state) {
    (void)state;
    dem2d_world_desc desc = basic_desc();
    dem2d_material_desc heavy = stone; /* no force turns such a grain from its way */
    desc.gravity = vec(0, 0), heavy.density = 1e25;
    for (int turn = 0; turn < 2; turn++) {
        const scene s = open_scene(&desc, &heavy);
        const dem2d_particle_id id = add_one(&s, add_disc(s.world, 0.1), 0, 0.1 - 1e-4);
        const dem2d_wall_id floor = add_plane(&s, 0, 0, 0, 1);
        assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_FREE, vec(0.01, 0), 0));
        run(s.world, 20);
        const double wound = only_contact(s.world).tangential_force;
        assert_true(fabs(wound) > 0);
        assert_ok(dem2d_world_drive_particle(s.world, id, DEM2D_FREE, vec(0, 0), 0));
        run(s.world, 1); /* winds by the last of the moves */
        const double stopped = only_contact(s.world).tangential_force;
        assert_near(stopped, wound * 20 / 19, 1e-9);
        dem2d_wall_desc again = wall_desc(&s, 0, 0, 0, 1);
        if (turn) again = wall_desc(&s, 0, 0.2 - 2e-4, 0, -1);
        assert_ok(dem2d_world_set_wall(s.world, floor, &again));
        run(s.world, 1);
        assert_within(only_contact(s.world).tangential_force, turn ? 0 : stopped, 1e-9 * 1e3);
        dem2d_world_destroy(s.world);
    }
}

static void test_porosity(void **state) {
    (void)state;
    const dem2d_world_desc desc = basic_desc();
    const scene s = open_scene(&desc, &stone);
    const dem2d_box region = {{-0.1, -0.2}, {0.15, 0.2}}, flat = {{0, 0}, {1, 0}};
    const dem2d_box endless = {{0, 0}, {1, NAN}};
    double porosity = -7;
    add_one(&s, add_disc(s.world, 0.1), 0, 0);
    assert_result(dem2d_world_porosity(s.world, &flat, &porosity), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_porosity(s.world, &endless, &porosity), DEM2D_NOT_FINITE);
    assert_result(dem2d_world_porosity(NULL, &region, &porosity), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_porosity(s.world, NULL, &porosity), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_porosity(s.world, &region, NULL), DEM2D_NULL_ARGUMENT);
    assert_true(porosity == -7);
    assert_ok(dem2d_world_porosity(s.world, &region, &porosity));
    assert_near(porosity, 1 - 0.1 * acosl(-1), 1e-14);
    dem2d_world_destroy(s.world);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create_errors),
        cmocka_unit_test(test_add_errors),
        cmocka_unit_test(test_null_arguments),
        cmocka_unit_test(test_null_queries),
        cmocka_unit_test(test_ids),
        cmocka_unit_test(test_results),
        cmocka_unit_test(test_mixing),
        cmocka_unit_test(test_motion),
        cmocka_unit_test(test_move_resets_friction),
        cmocka_unit_test(test_wall_motion),
        cmocka_unit_test(test_servo),
        cmocka_unit_test(test_servo_rest),
        cmocka_unit_test(test_servo_refused),
        cmocka_unit_test(test_servo_facing),
        cmocka_unit_test(test_servo_speed),
        cmocka_unit_test(test_lists),
        cmocka_unit_test(test_packing_and_stats),
        cmocka_unit_test(test_bytes),
        cmocka_unit_test(test_energy),
        cmocka_unit_test(test_spring_energy),
        cmocka_unit_test(test_weight),
        cmocka_unit_test(test_stress),
        cmocka_unit_test(test_local_damping),
        cmocka_unit_test(test_global_damping),
        cmocka_unit_test(test_pile_settles),
        cmocka_unit_test(test_determinism),
        cmocka_unit_test(test_scaled_runs),
        cmocka_unit_test(test_skin),
        cmocka_unit_test(test_time_step_bounds),
        cmocka_unit_test(test_changes_are_checked),
        cmocka_unit_test(test_set_wall_and_contacts),
        cmocka_unit_test(test_porosity),
        cmocka_unit_test(test_time_step_too_long),
        cmocka_unit_test(test_slow_time_step),
        cmocka_unit_test(test_state_error),
        cmocka_unit_test(test_state_error_later),
        cmocka_unit_test(test_out_of_memory),
        cmocka_unit_test(test_svg),
        cmocka_unit_test(test_svg_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
