/* No length, area or force is built in: a scene whose lengths are multiplied by a power of two,
   with all else in the same units, gives the same bits times a power of two. With the full law, a
   caller's law, chains of segments and the ledger; test_world.c has plain scenes. */
#include "dem2d.h"
#include "testing.h"
#include "row_law.h"

enum { GRAINS = 36, KINDS = 6, LINKS = 20, WALLS = 4 + LINKS, ROOM = 12000 };

typedef struct scene_row {
    const char *name;
    bool discs, full, law, chain;
    dem2d_face_rule faces;
} scene_row;

static scene_row scenes[] = {
    {.name = "discs by the full law", .discs = true, .full = true},
    {.name = "all shapes by the full law", .full = true},
    {.name = "one point", .full = true, .chain = true, .faces = DEM2D_ONE_POINT},
    {.name = "springs and friction on a chain", .chain = true},
    {.name = "the full law on a chain", .full = true, .chain = true},
    {.name = "a caller's law on a chain", .law = true, .chain = true},
};

/* dimension: the power of the unit of length when time and density are held. */
typedef struct numbers {
    int count, power;
    double value[ROOM];
    int dimension[ROOM];
    const char *what[ROOM];
} numbers;

static void put(numbers *n, const char *what, int dimension, const double *values, int count) {
    assert_true(n->count + count <= ROOM);
    for (int i = 0; i < count; i++, n->count++) {
        assert_false(isnan(values[i])); /* a ratio may be infinite before the first contact */
        n->value[n->count] = values[i], n->dimension[n->count] = dimension;
        n->what[n->count] = what;
    }
}

#define PUT(n, what, dimension, ...)                           \
    do {                                                       \
        const double these[] = {__VA_ARGS__};                  \
        put((n), (what), (dimension), these, COUNT_OF(these)); \
    } while (0)

/* --- scenes ---------------------------------------------------------------------------------- */

static dem2d_shape *make_shape(int kind, double f) {
    static const double corners[5][2] = {
        {-0.9, -0.6}, {0.7, -0.8}, {1.1, 0.1}, {0.4, 0.9}, {-0.6, 0.7}};
    const double reach[4] = {1.1 * f, 0.75 * f, 0.7 * f, 0.75 * f};
    const double a[4] = {1.8 * f, 0, 0.08 * f, 0.03 * f}, b[4] = {0, 0, 0.06 * f, 0.02 * f};
    dem2d_vec points[5];
    if (kind == 0) return make_disc(f);
    if (kind == 1) return make_ellipse(1.2 * f, 0.8 * f);
    if (kind == 2) return make_series(a, b, 3);
    if (kind == 5) return make_oval(reach, 0.5522847498);
    for (int i = 0; i < 5; i++) points[i] = vec(f * corners[i][0], f * corners[i][1]);
    return make_polygon(points, 5, kind == 3 ? 0 : 0.2 * f);
}

/* Its state is a length. */
static void own_law_row(void *user, const row_in *in, row_out *out) {
    const double spring = in->pair.normal_stiffness * in->depth, limit = 0.3 * spring;
    const double shear =
        in->tangential_force - in->pair.tangential_stiffness * in->sliding * in->time_step;
    (void)user;
    out->normal_force = spring + 300 * in->mass * in->approach;
    out->tangential_force = shear > limit ? limit : shear < -limit ? -limit : shear;
    out->moment = -in->radius * in->radius * in->spin * in->mass;
    out->energy = (spring + in->pair.normal_stiffness * in->state[0] / 128) * in->depth / 2;
    out->state[0] = in->state[0] + in->depth;
}

static void own_law(void *user, dem2d_law_batch *batch) {
    for_rows(user, batch, own_law_row);
}

static void add_walls(dem2d_world *world, const scene_row *s, dem2d_material_id material,
                      double size, dem2d_wall_id walls[WALLS]) {
    static const double at[4][4] = {{0, 0, 0, 1}, {0, 0, 1, 0}, {0.5, 0, -1, 0}, {0, 0.6, 0, -1}};
    static const double height[LINKS + 1] = {4, 3, 2, 3, 3, 3, 1, 0, 2, 2, 2,
                                             2, 0, 3, 0, 2, 2, 2, 0, 1, 3};
    for (int i = 0; i < (s->chain ? WALLS : 4); i++) {
        const double *plane = at[i < 4 ? i : 0];
        dem2d_wall_desc desc = {0};
        desc.material = material;
        desc.point = vec(size * plane[0], size * plane[1]), desc.normal = vec(plane[2], plane[3]);
        if (i == 0 && s->chain) desc.point.y = -size;
        if (i == 3) {
            desc.mode = DEM2D_WALL_SERVO, desc.stress = 2e4 * size * size;
            desc.max_speed = 0.5 * size, desc.spans[0] = walls[1], desc.spans[1] = walls[2];
        }
        if (i >= 4) {
            const double x = 0.035 * (i - 4) - 0.1;
            desc.segment = true, desc.normal = vec(0, 0);
            desc.point = vec(size * x, 0.006 * size * height[i - 4]);
            desc.end = vec(size * (x + 0.035), 0.006 * size * height[i - 3]);
        }
        if (i == 14) desc.mode = DEM2D_WALL_MOVING, desc.velocity = vec(0.1 * size, 0);
        assert_ok(dem2d_world_add_wall(world, &desc, &walls[i]));
    }
}

static dem2d_world *make_world(const scene_row *s, double size, dem2d_wall_id walls[WALLS]) {
    dem2d_material_desc stone = material_desc(2700, 1e7 * size * size, 5e6 * size * size, 0.4);
    dem2d_world_desc desc = {0};
    dem2d_particle_desc grain = {0};
    dem2d_shape_id shapes[KINDS];
    dem2d_world *world;
    uint64_t random = 42;
    desc.time_step = 1e-4, desc.gravity.y = -9.81 * size, desc.local_damping = 0.5;
    desc.faces = s->faces, desc.ledger = true, desc.law = s->law ? own_law : NULL;
    if (s->full) stone.damping_ratio = 0.2, stone.rolling_friction = 0.1;
    assert_ok(dem2d_world_create(&desc, &world));
    assert_ok(dem2d_world_add_material(world, &stone, &grain.material));
    add_walls(world, s, grain.material, size, walls);
    for (int i = 0; i < KINDS; i++) {
        dem2d_shape *shape = make_shape(i, 0.03 * size);
        assert_ok(dem2d_world_add_shape(world, shape, &shapes[i]));
        dem2d_shape_destroy(shape);
    }
    for (int i = 0; i < GRAINS; i++) {
        dem2d_particle_id id;
        grain.scale = random_between(&random, 0.8, 1.1),
        grain.shape = shapes[s->discs ? 0 : i % KINDS];
        grain.position.x = size * (0.05 + 0.075 * (i % 6) + random_between(&random, -0.004, 0.004));
        grain.position.y = size * (0.05 + 0.065 * (i / 6));
        grain.angle = random_between(&random, -3, 3);
        grain.velocity = vec(size * random_between(&random, -0.5, 0.5), -2 * size);
        assert_ok(dem2d_world_add_particle(world, &grain, &id));
    }
    return world;
}

/* --- what is compared ------------------------------------------------------------------------ */

static void put_particles(numbers *n, const dem2d_world *world) {
    dem2d_particle_id ids[GRAINS];
    int count;
    assert_ok(dem2d_world_particles(world, ids, GRAINS, &count));
    assert_int_equal(count, GRAINS);
    for (int i = 0; i < count; i++) {
        dem2d_particle_info p;
        dem2d_stress s;
        assert_ok(dem2d_world_get_particle(world, ids[i], &p));
        assert_ok(dem2d_world_particle_stress(world, ids[i], &s));
        PUT(n, "place", 1, p.pose.position.x, p.pose.position.y, p.velocity.x, p.velocity.y);
        PUT(n, "turn", 0, p.pose.rotation.c, p.pose.rotation.s, p.angular_velocity);
        PUT(n, "force", 3, p.force.x, p.force.y);
        PUT(n, "torque", 4, p.torque, p.inertia);
        PUT(n, "stress", 2, p.mass, s.xx, s.xy, s.yx, s.yy);
    }
}

static int put_contacts(numbers *n, const dem2d_world *world) {
    static dem2d_contact_info list[6 * GRAINS];
    int count;
    assert_ok(dem2d_world_contacts(world, list, COUNT_OF(list), &count));
    assert_in_range(count, 0, COUNT_OF(list));
    for (int i = 0; i < count; i++) {
        const dem2d_contact_info *c = &list[i];
        PUT(n, "contact", 0, c->a.index, c->b.index, c->wall.index, c->points, c->normal.x,
            c->normal.y);
        PUT(n, "point", 1, c->point.x, c->point.y, c->branch.x, c->branch.y, c->depth);
        PUT(n, "contact force", 3, c->normal_force, c->tangential_force);
        PUT(n, "moment", 4, c->moment);
    }
    return count;
}

static void put_measures(numbers *n, const dem2d_world *world, double size) {
    const dem2d_box box = {{0.05 * size, 0.03 * size}, {0.41 * size, 0.3 * size}};
    dem2d_energy e;
    dem2d_ledger l;
    dem2d_fabric f;
    dem2d_equilibrium q;
    double porosity, inertial, safe, limit;
    assert_ok(dem2d_world_energy(world, &e));
    assert_ok(dem2d_world_ledger(world, &l));
    assert_ok(dem2d_world_fabric(world, &f));
    assert_ok(dem2d_world_equilibrium(world, &q));
    assert_ok(dem2d_world_porosity(world, &box, &porosity));
    assert_ok(dem2d_world_inertial_number(world, 3, 100 * size * size, &inertial));
    assert_ok(dem2d_world_time_step_bounds(world, &safe, &limit, NULL));
    PUT(n, "energy", 4, e.translational, e.rotational, e.normal, e.tangential, e.rolling,
        e.potential);
    PUT(n, "ledger", 4, l.kinetic, l.normal, l.tangential, l.gravity, l.walls, l.driven, l.friction,
        l.dashpot, l.damping, l.given, l.closure);
    PUT(n, "fabric", 0, f.xx, f.xy, f.yy, f.deviator, f.normals.coefficient, f.branches.coefficient,
        f.normal_forces.coefficient, f.tangential_forces.coefficient, f.normals.direction,
        f.stress_ratio);
    PUT(n, "mean branch", 1, f.mean_branch, q.mean_speed, q.max_speed);
    PUT(n, "mean force", 3, f.mean_force);
    PUT(n, "measures", 0, q.kinetic_ratio, q.unbalanced, porosity, inertial, safe, limit);
}

static void put_walls(numbers *n, const dem2d_world *world, const dem2d_wall_id *walls, int count) {
    for (int i = 0; i < count; i++) {
        dem2d_wall_info w;
        assert_ok(dem2d_world_get_wall(world, walls[i], &w));
        PUT(n, "wall", 1, w.point.x, w.point.y, w.end.x, w.end.y, w.velocity.x, w.velocity.y,
            w.length);
        PUT(n, "wall's force", 3, w.force.x, w.force.y);
        PUT(n, "wall's stress", 2, w.stress);
        PUT(n, "wall's normal", 0, w.normal.x, w.normal.y);
    }
}

static void run(const scene_row *s, int power, numbers *n) {
    const double size = ldexp(1, power);
    dem2d_wall_id walls[WALLS];
    dem2d_stats stats;
    dem2d_world *world = make_world(s, size, walls);
    int contacts = 0;
    n->count = 0, n->power = power;
    for (int i = 0; i < 3; i++) {
        assert_ok(dem2d_world_step(world, 800, NULL));
        put_measures(n, world, size);
        put_particles(n, world);
        contacts += put_contacts(n, world);
        put_walls(n, world, walls, s->chain ? WALLS : 4);
    }
    assert_ok(dem2d_world_stats(world, &stats));
    PUT(n, "counters", 0, (double)stats.collisions, (double)stats.separations,
        (double)stats.support_calls, (double)stats.list_rebuilds, stats.pairs, stats.contacts,
        stats.wall_contacts);
    assert_true(contacts > 30 && stats.wall_contacts > 3 && stats.list_rebuilds > 1);
    dem2d_world_destroy(world);
}

static void test_scaled(void **state) {
    static const int powers[] = {40, -40, 1};
    static numbers first, scaled;
    const scene_row *s = *state;
    run(s, 0, &first);
    for (int k = 0; k < COUNT_OF(powers); k++) {
        run(s, powers[k], &scaled);
        assert_int_equal(scaled.count, first.count);
        for (int i = 0; i < first.count; i++) {
            const double expected = ldexp(first.value[i], powers[k] * first.dimension[i]);
            if (memcmp(&expected, &scaled.value[i], sizeof expected) == 0) continue;
            fail_msg("2^%d, number %d, %s: %a instead of %a", powers[k], i, first.what[i],
                     scaled.value[i], expected);
        }
    }
}

int main(void) {
    struct CMUnitTest tests[COUNT_OF(scenes)] = {{0}};
    for (int i = 0; i < COUNT_OF(scenes); i++) {
        tests[i].name = scenes[i].name;
        tests[i].test_func = test_scaled;
        tests[i].initial_state = &scenes[i];
    }
    return cmocka_run_group_tests_name("scaling", tests, NULL, NULL);
}
