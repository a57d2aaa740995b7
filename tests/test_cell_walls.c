/* Segments, chains, one-sided and turning walls in a periodic cell: they act as copies made by hand
   do, across the border as elsewhere, whatever is listed. The oracle is a world without a cell, in
   which each grain and each wall has copies at all cell vectors nearby; copies of a grain get its
   forces. A floor that goes round is one long chain there. */
#include "dem2d.h"
#include "cell_grains.h"
#include "inside.h"

enum { GRAINS = 36, COPIES = 11 * 11, WALLS = 4, POINTS = 12 };

/* A wall in the cell, by points in sides of the cell along x and y. */
typedef struct wall_kind {
    dem2d_vec points[POINTS];
    int count;
    bool closed, one_sided;
    bool floor; /* a chain whose end is its start one cell vector a further */
    dem2d_vec velocity;
    double spin, belt;
} wall_kind;

/* What fills a cell. */
typedef struct filling {
    int grains, kinds; /* 1: discs, 4: and other shapes */
    double solid;      /* area of the circles of diameter 1 over that of the cell */
    double speed, gravity;
    bool damped, open; /* open: not periodic along b */
    double lean;       /* of b, in sides */
    int around;        /* copies by hand: from -around to around cells */
    int steps;
    wall_kind walls[WALLS];
} filling;

typedef struct packed {
    scene s;
    int count, copies;
    dem2d_vec a, b;
    dem2d_particle_id ids[GRAINS];
    dem2d_wall_id walls[WALLS]; /* those in the middle */
} packed;

/* Copies get the sums of their grain, the one in the middle of its ids. */
static void share(void *user, dem2d_sums *sums) {
    const packed *p = user;
    for (int i = 0; i < p->count; i++)
        for (int k = 0; k < p->copies; k++) {
            const int row = i * p->copies + k, own = i * p->copies + p->copies / 2;
            sums->force[row] = sums->force[own], sums->torque[row] = sums->torque[own];
        }
}

/* A wall at cell vectors; a floor by hand goes over all copies. */
static dem2d_wall_id add_copy_of(const packed *p, const wall_kind *kind, int m, int n, int around) {
    dem2d_vec points[(2 * COPIES + 1) * POINTS];
    dem2d_wall_desc desc = plane_desc(&p->s, vec(0, 0), vec(0, 0));
    int count = 0;
    for (int c = -around; c <= around; c++)
        for (int k = 0; k < kind->count - (around > 0 && c < around); k++) {
            points[count].x = kind->points[k].x * p->a.x + (m + c) * p->a.x + n * p->b.x;
            points[count++].y = kind->points[k].y * p->b.y + n * p->b.y;
        }
    desc.closed = kind->closed, desc.one_sided = kind->one_sided, desc.surface_speed = kind->belt;
    if (kind->spin != 0 || kind->velocity.x != 0 || kind->velocity.y != 0) {
        desc.mode = DEM2D_WALL_MOVING, desc.velocity = kind->velocity;
        desc.angular_velocity = kind->spin;
        for (int k = 0; k < count; k++)
            desc.pivot.x += points[k].x / count, desc.pivot.y += points[k].y / count;
    }
    if (count == 2)
        desc.point = points[0], desc.end = points[1], desc.segment = true;
    else
        desc.points = points, desc.count = count;
    return add_wall(&p->s, &desc);
}

static void add_walls(packed *p, const filling *f, bool cell) {
    const int up = f->open ? 0 : f->around;
    for (int w = 0; w < WALLS && f->walls[w].count > 0; w++) {
        const wall_kind *kind = &f->walls[w];
        const int across = cell || kind->floor ? 0 : f->around;
        for (int n = cell ? 0 : -up; n <= (cell ? 0 : up); n++)
            for (int m = -across; m <= across; m++) {
                const int long_floor = kind->floor && !cell ? f->around : 0;
                const dem2d_wall_id id = add_copy_of(p, kind, m, n, long_floor);
                if (n == 0 && m == 0) p->walls[w] = id;
            }
    }
}

/* In a cell, or with copies by hand; desc has what both worlds shall have. */
static void fill(packed *p, const filling *f, const dem2d_world_desc *desc, bool cell) {
    const double area = f->grains * (double)TEST_PI / 4 / f->solid, side = sqrt(area);
    const int up = f->open ? 0 : f->around;
    dem2d_world_desc made = *desc;
    dem2d_shape_id shapes[4];
    const dem2d_material_desc soft = soft_desc(f->damped);
    uint64_t random = 7;
    memset(p, 0, sizeof *p);
    p->a = vec(side, 0), p->b = f->open ? vec(0, side) : vec(f->lean * side, side);
    p->count = f->grains, p->copies = cell ? 1 : (2 * f->around + 1) * (2 * up + 1);
    assert_true(f->grains <= GRAINS && p->copies <= COPIES);
    made.time_step = DT, made.gravity = vec(0.3 * f->gravity, -f->gravity);
    if (cell) made.cell.a = p->a, made.cell.b = f->open ? vec(0, 0) : p->b;
    if (!cell) made.gather = share, made.exchange_user = p;
    p->s = open_scene(&made, &soft);
    make_shapes(&p->s, shapes);
    add_walls(p, f, cell);
    const lattice at = {f->grains, f->kinds, f->speed, p->a, p->b};
    for (int i = 0; i < f->grains; i++) {
        const dem2d_particle_desc grain = grain_at(&p->s, &at, shapes, i, &random);
        for (int n = cell ? 0 : -up; n <= (cell ? 0 : up); n++)
            for (int m = cell ? 0 : -f->around; m <= (cell ? 0 : f->around); m++) {
                dem2d_particle_desc copy = grain;
                copy.position.x += m * p->a.x + n * p->b.x, copy.position.y += n * p->b.y;
                const dem2d_particle_id id = add_grain(&p->s, &copy);
                if (n == 0 && m == 0) p->ids[i] = id;
            }
    }
}

/* From one position to another, less whole cell vectors. */
static dem2d_vec apart(const packed *p, dem2d_vec from, dem2d_vec to, bool open) {
    dem2d_vec d = vec(to.x - from.x, to.y - from.y);
    const double n = open ? 0 : rint(d.y / p->b.y);
    d.x -= n * p->b.x, d.y -= n * p->b.y;
    d.x -= rint(d.x / p->a.x) * p->a.x;
    return d;
}

/* The greatest distance of the same grains of two worlds; speeds and turns are as near. */
static double difference(const packed *p, const packed *q, bool open) {
    double most = 0;
    for (int i = 0; i < p->count; i++) {
        const dem2d_particle_info a = grain_of(&p->s, p->ids[i]), b = grain_of(&q->s, q->ids[i]);
        const dem2d_vec d = apart(p, a.pose.position, b.pose.position, open);
        most = fmax(most, hypot(d.x, d.y));
        most = fmax(most, fabs(a.pose.rotation.s - b.pose.rotation.s) / 2);
        most = fmax(most, hypot(a.velocity.x - b.velocity.x, a.velocity.y - b.velocity.y) / 32);
    }
    return most;
}

/* --- copies by hand --------------------------------------------------------------------------- */

#define BUMPS                                                 \
    {                                                         \
        {{0.1, 0.1},   {0.2, 0.16}, {0.3, 0.1},  {0.45, 0.1}, \
         {0.55, 0.18}, {0.7, 0.05}, {0.9, 0.05}, {1.1, 0.1}}, \
            8, .floor = true                                  \
    }
#define BOX \
    { {{0.4, 0.4}, {0.6, 0.42}, {0.62, 0.6}, {0.38, 0.58}}, 4, .closed = true }
#define CORNER \
    { {{-0.1, -0.1}, {0.1, -0.08}, {0.12, 0.1}, {-0.12, 0.08}}, 4, .closed = true }
#define PADDLE \
    { {{0.9, 0.5}, {1.1, 0.5}}, 2, .spin = 3, .closed = false }
#define LEVEL \
    { {{0.3, 0.1}, {1.3, 0.1}}, 2, .floor = true }
/* These push outwards. */
#define GUARD \
    { {{0.38, 0.58}, {0.62, 0.6}, {0.6, 0.42}, {0.4, 0.4}}, 4, .closed = true, .one_sided = true }
#define CARRIED \
    { {{0.4, 0.4}, {0.5, 0.45}, {0.6, 0.4}}, 3, .velocity = {18, 3}, .spin = 4, .belt = 1 }
#define LIFTED                                                                            \
    {                                                                                     \
        {{-0.2, 0.05}, {0.35, 0.1}, {0.8, 0.05}}, 3, .floor = true, .velocity = { 12, 2 } \
    }
#define GUARDED \
    { {{0.1, 0.1}, {0.4, 0.18}, {0.9, 0.05}, {1.1, 0.1}}, 4, .floor = true, .one_sided = true }
/* Two segments in line across the border, and one that ends at the side of another. */
#define HALVES                                               \
    {{{0.8, 0.1}, {0.95, 0.1}}, 2, .closed = false},         \
        {{{-0.05, 0.1}, {0.25, 0.1}}, 2, .closed = false}, { \
        {{1.1, 0.1}, {1.1, 0.3}}, 2, .closed = false         \
    }

static const filling fillings[] = {
    {25, 1, 0.6, 8, 50, false, true, 0, 2, 500, {BUMPS}},
    {25, 4, 0.6, 3, 20, true, true, 0, 2, 900, {BUMPS}},
    {25, 4, 0.6, 3, 20, true, true, 0, 2, 900, {LEVEL}},
    {25, 4, 0.6, 3, 20, true, true, 0, 2, 900, {HALVES}},
    {25, 1, 0.6, 8, 50, true, true, 0, 2, 500, {HALVES, BOX}},
    {25, 1, 0.6, 8, 50, true, true, 0, 2, 500, {GUARDED}},
    {25, 4, 0.6, 3, 20, true, true, 0, 2, 900, {GUARDED, PADDLE}},
    {25, 4, 0.6, 3, 20, true, true, 0, 2, 900, {LIFTED}},
    {16, 1, 0.4, 8, 0, false, false, 0.25, 2, 500, {BOX}},
    {16, 4, 0.4, 3, 0, true, false, 0.25, 2, 900, {BOX, PADDLE}},
    {16, 4, 0.4, 3, 0, true, false, -0.4, 2, 900, {CORNER}},
    {16, 4, 0.4, 3, 0, true, false, 0.3, 2, 900, {GUARD}},
    {16, 4, 0.4, 3, 0, true, false, -0.2, 2, 900, {CARRIED}},
    {16, 4, 0.4, 3, 20, true, false, 0, 2, 900, {LEVEL}},
    {16, 1, 0.4, 8, 50, true, false, 0, 2, 500, {BUMPS, PADDLE}},
    {3, 1, 0.5, 8, 0, true, false, 0.25, 4, 500, {CORNER}},
    {2, 4, 0.5, 3, 0, true, false, 0.1, 4, 900, {LEVEL}},
    {1, 1, 0.4, 8, 0, true, false, 0.1, 4, 500, {PADDLE}},
    {1, 4, 0.4, 8, 30, true, true, 0, 5, 500, {BUMPS}},
};

static void test_copies(void **state) {
    (void)state;
    const dem2d_world_desc plain = {0};
    for (int k = 0; k < COUNT_OF(fillings); k++) {
        static packed cell, copies;
        const filling *f = &fillings[k];
        fill(&cell, f, &plain, true), fill(&copies, f, &plain, false);
        int pressed = 0;
        for (int i = 0; i < f->steps; i += 20) {
            step(&cell.s, 20), step(&copies.s, 20);
            assert_true(inside_holds(cell.s.world));
            for (int w = 0; w < WALLS && f->walls[w].count > 0; w++) {
                const dem2d_wall_info one = wall_of(&cell.s, cell.walls[w]);
                pressed += hypot(one.force.x, one.force.y) > 0;
                if (f->walls[w].floor) continue; /* a long one there */
                const dem2d_wall_info other = wall_of(&copies.s, copies.walls[w]);
                assert_within(one.force.x, other.force.x, 1e-6 * KN);
                assert_within(one.force.y, other.force.y, 1e-6 * KN);
                assert_within(one.torque, other.torque, 1e-6 * KN);
            }
        }
        assert_between(difference(&cell, &copies, f->open), 0, 1e-9);
        assert_true(pressed > 3);
        close_scene(&cell.s), close_scene(&copies.s);
    }
}

/* --- what must not matter --------------------------------------------------------------------- */

/* Grains that cross the border over a floor and round a paddle, and go through one side. */
static const filling busy[2] = {
    {25, 4, 0.6, 5, 30, true, true, 0, 0, 0, {GUARDED, PADDLE}},
    {16, 4, 0.4, 5, 0, true, false, 0.3, 0, 0, {CARRIED, CORNER}},
};

/* Not the skin, not when the list is made, not the order in memory, not threads. */
static void test_independent(void **state) {
    (void)state;
    static const double skins[] = {0, 0.004, 0.1, 0.4};
    for (int f = 0; f < 2; f++) {
        uint64_t hash[2];
        int64_t rebuilds[2];
        for (int k = 0; k < 6; k++) {
            static packed p;
            dem2d_world_desc desc = {0};
            int threads = 3;
            desc.skin = skins[k % 4], desc.ledger = true;
            if (k == 5) desc.parallel_for = run_parts, desc.parallel_user = &threads;
            fill(&p, &busy[f], &desc, true);
            for (int i = 0; i < 600; i++) {
                if (k == 4) inside_scatter(p.s.world, i % 3 == 0);
                if (k == 4 && i % 5 == 0) inside_renew_list(p.s.world);
                step(&p.s, 1);
                if (i % 20 == 0) assert_true(inside_holds(p.s.world));
            }
            hash[k > 0] = dem2d_world_hash(p.s.world);
            if (k == 1 || k == 3) rebuilds[k / 2] = stats_of(&p.s).list_rebuilds;
            assert_true(hash[k > 0] == hash[0]);
            close_scene(&p.s);
        }
        assert_true(rebuilds[0] > 3 * rebuilds[1]);
    }
}

/* A run that stops and goes on at any step: the same bytes. */
static void test_snapshots(void **state) {
    (void)state;
    for (int f = 0; f < 2; f++) {
        static packed p;
        const dem2d_world_desc plain = {0};
        fill(&p, &busy[f], &plain, true);
        for (int i = 0; i < 25; i++) {
            step(&p.s, i);
            scene_bytes bytes = scene_save(p.s.world);
            const scene other = scene_load(&p.s, &bytes);
            scene_bytes again = scene_save(other.world);
            assert_true(bytes.size == again.size);
            assert_memory_equal(bytes.bytes, again.bytes, bytes.size);
            assert_true(inside_holds(other.world));
            step(&p.s, 10), step(&other, 10);
            assert_true(dem2d_world_hash(p.s.world) == dem2d_world_hash(other.world));
            assert_true(stats_of(&p.s).list_rebuilds == stats_of(&other).list_rebuilds);
            close_scene(&other), free(bytes.bytes), free(again.bytes);
        }
        close_scene(&p.s);
    }
}

/* Steps that find no memory change nothing, and are the same when they are tried again. */
static void test_memory(void **state) {
    (void)state;
    static packed p[2];
    test_env env;
    test_env_init(&env);
    dem2d_world_desc desc = {0};
    fill(&p[0], &busy[1], &desc, true);
    desc.env = &env.env;
    fill(&p[1], &busy[1], &desc, true);
    int failed = 0, done = 0;
    for (; done == 0; failed++) { /* each allocation of the first step in turn */
        const uint64_t before = dem2d_world_hash(p[1].s.world);
        test_env_fail(&env, 1 + failed);
        const dem2d_result result = dem2d_world_step(p[1].s.world, 1, &done);
        assert_true(result == (done ? DEM2D_OK : DEM2D_OUT_OF_MEMORY));
        assert_true(done || dem2d_world_hash(p[1].s.world) == before);
    }
    step(&p[0].s, 1);
    for (int i = 0; i < 400; i++) {
        test_env_fail(&env, 1);
        failed += test_steps_fail(p[1].s.world, 1);
        test_env_fail(&env, 0);
        step(&p[0].s, 1);
        if (i % 20 == 0) assert_true(inside_holds(p[1].s.world));
        assert_true(dem2d_world_hash(p[0].s.world) == dem2d_world_hash(p[1].s.world));
    }
    assert_true(failed > 10);
    close_scene(&p[0].s), close_scene(&p[1].s);
    assert_clean(&env);
}

/* --- closed forms ----------------------------------------------------------------------------- */

/* A grain that slides without friction along a joined floor, over joints and the border: there is
   no bump. The floor is a chain that goes round, one segment that does, a chain along b + 2 a. */
static void test_slide(void **state) {
    (void)state;
    static const dem2d_vec box[4] = {{-0.5, -0.4}, {0.5, -0.4}, {0.5, 0.4}, {-0.5, 0.4}};
    for (int k = 0; k < 6; k++) {
        const double g = 9.81;
        const bool tilted = k % 3 == 2;
        const dem2d_vec a = vec(3.3, 0), b = vec(0.7, 4.1);
        const dem2d_vec round = tilted ? vec(b.x + 2 * a.x, b.y) : a;
        const double length = hypot(round.x, round.y);
        const dem2d_vec along = vec(round.x / length, round.y / length);
        const dem2d_material_desc smooth = material_desc(1, KN, 0, 0);
        dem2d_world_desc desc = {0};
        desc.time_step = DT, desc.cell.a = a, desc.cell.origin = vec(-1.1, -0.3);
        if (tilted) desc.cell.b = b;
        desc.gravity = vec(g * along.y, -g * along.x);
        const scene s = open_scene(&desc, &smooth);
        dem2d_vec points[6];
        for (int i = 0; i < 6; i++) {
            const double at = (i + 0.17 * (i % 2)) / 5 * length + 0.05;
            points[i] = vec(at * along.x, at * along.y);
        }
        points[5] = vec(points[0].x + round.x, points[0].y + round.y);
        dem2d_wall_desc wall = plane_desc(&s, points[0], vec(0, 0));
        if (k % 3 == 1)
            wall.segment = true, wall.end = points[5];
        else
            wall.points = points, wall.count = 6;
        (void)add_wall(&s, &wall);
        dem2d_shape *shape = k < 3 ? make_disc(0.5) : make_polygon(box, 4, 0);
        dem2d_mass mass;
        assert_ok(dem2d_shape_mass(shape, &mass));
        const double weight = g * mass.area;
        const double height = k < 3 ? 0.5 - weight / KN : 0.4 - weight / 2 / KN; /* two points */
        dem2d_particle_desc grain =
            grain_desc(&s, give_shape(&s, shape), 1, vec(-along.y * height, along.x * height));
        grain.angle = atan2(along.y, along.x);
        grain.velocity = vec(7 * along.x, 7 * along.y);
        const dem2d_particle_id id = add_grain(&s, &grain);
        double least = 1e9, most = 0;
        for (int i = 0; i < 4000; i++) {
            step(&s, 1);
            const dem2d_particle_info now = grain_of(&s, id);
            const double across = now.velocity.y * along.x - now.velocity.x * along.y;
            assert_within(across, 0, 2e-11);
            assert_within(now.angular_velocity, 0, 1e-9);
            const double energy = kinetic_of(&s) + energy_of(&s).normal;
            least = fmin(least, energy), most = fmax(most, energy);
        }
        assert_within(most, least, 1e-11 * least);
        close_scene(&s);
    }
}

/* The momentum that the grains lose the walls have got: steps of force times time. */
static void test_momentum(void **state) {
    (void)state;
    static packed p;
    const filling f = {16, 4, 0.4, 5, 0, true, false, 0.3, 0, 0, {BOX, CORNER}};
    const dem2d_world_desc plain = {0};
    fill(&p, &f, &plain, true);
    dem2d_vec impulse = vec(0, 0), last = impulse;
    double passed = 0;
    for (int i = 0; i <= 600; i++) {
        dem2d_vec momentum = vec(0, 0);
        for (int k = 0; k < p.count; k++) {
            const dem2d_particle_info now = grain_of(&p.s, p.ids[k]);
            momentum.x += now.mass * now.velocity.x, momentum.y += now.mass * now.velocity.y;
        }
        if (i > 0) {
            assert_within(momentum.x - last.x, -impulse.x, 1e-13 * 50);
            assert_within(momentum.y - last.y, -impulse.y, 1e-13 * 50);
        }
        last = momentum;
        step(&p.s, 1);
        impulse = vec(0, 0);
        for (int w = 0; w < 2; w++) {
            const dem2d_vec force = wall_of(&p.s, p.walls[w]).force;
            impulse.x += DT * force.x, impulse.y += DT * force.y;
        }
        passed += hypot(impulse.x, impulse.y);
    }
    assert_true(passed > 1);
    close_scene(&p.s);
}

/* Contacts tell which copy of a wall was touched; queries of space find it there. */
static void test_seen(void **state) {
    (void)state;
    const dem2d_material_desc soft = soft_desc(false);
    dem2d_world_desc desc = {0};
    desc.time_step = DT, desc.cell.a = vec(4, 0), desc.cell.b = vec(1, 4);
    const scene s = open_scene(&desc, &soft);
    const dem2d_wall_id wall = add_segment(&s, vec(8.2, 3), vec(9.2, 3)); /* y 3: cell vector 2 a */
    const dem2d_particle_desc grain =
        grain_desc(&s, give_shape(&s, make_disc(0.5)), 1, vec(0.7 + 4, 2.6));
    (void)add_grain(&s, &grain);
    step(&s, 1);
    dem2d_contact_info contacts[2];
    assert_int_equal(contacts_of(&s, contacts, 2), 1);
    assert_int_equal(contacts[0].shift[0], -2), assert_int_equal(contacts[0].shift[1], 0);
    assert_near(contacts[0].point.x, 0.7, 1e-9), assert_near(contacts[0].point.y, 3, 1e-9);
    assert_near(wall_of(&s, wall).torque, 8.7 * contacts[0].normal_force, 1e-9); /* where it is */
    dem2d_query_desc walls = {0};
    dem2d_hit hit;
    dem2d_found found[8];
    int count;
    walls.skip_particles = true;
    assert_ok(dem2d_world_cast_ray(s.world, vec(-3.5, 0), vec(0, 1), 9, &walls, &hit));
    assert_near(hit.distance, 3, 1e-12);
    assert_int_equal(hit.found.shift[0], -3), assert_int_equal(hit.found.shift[1], 0);
    assert_ok(dem2d_world_nearest(s.world, vec(1.5, 7.1), 0, &walls, &hit)); /* copy at -2 a + b */
    assert_near(hit.distance, 0.1, 1e-9);
    assert_int_equal(hit.found.shift[0], -2), assert_int_equal(hit.found.shift[1], 1);
    const dem2d_box box = {{0, 2.9}, {8, 3.1}};
    assert_ok(dem2d_world_query_box(s.world, &box, &walls, found, 8, &count));
    assert_int_equal(count, 2);
    assert_ok(dem2d_world_wall_overlaps(s.world, wall, NULL, found, 8, &count));
    assert_int_equal(count, 1);
    assert_int_equal(found[0].shift[0], 2), assert_int_equal(found[0].shift[1], 0);
    dem2d_particle_desc here = grain;
    double overlap;
    here.position = vec(-0.75, -0.6); /* on the copy at -2 a - b */
    assert_ok(dem2d_world_overlap_at(s.world, &here, &overlap));
    assert_near(overlap, 0.1, 1e-9);
    close_scene(&s);
}

static int count_of(const char *text, const char *word) {
    int count = 0;
    for (; (text = strstr(text, word)) != NULL; text++) count++;
    return count;
}

/* Files have the copies that reach into the cell; a wall far away is seen where its copies are. */
static void test_written(void **state) {
    (void)state;
    for (int k = 0; k < 2; k++) {
        const dem2d_material_desc soft = soft_desc(false);
        const double far = k * 4 * 5;
        dem2d_world_desc desc = {0};
        desc.time_step = DT, desc.cell.a = vec(4, 0);
        const scene s = open_scene(&desc, &soft);
        (void)add_segment(&s, vec(3.5 + far, 0.25), vec(4.5 + far, 0.25));
        (void)add_floor(&s);
        const dem2d_particle_desc grain =
            grain_desc(&s, give_shape(&s, make_disc(0.5)), 1, vec(2, 1));
        (void)add_grain(&s, &grain);
        step(&s, 1);
        scene_bytes bytes = {0};
        dem2d_vtp_desc vtp = {0};
        vtp.write = scene_write, vtp.user = &bytes, vtp.part = DEM2D_VTP_WALLS;
        assert_ok(dem2d_world_write_vtp(s.world, &vtp, NULL));
        assert_true(scene_write(&bytes, "", 1));
        assert_non_null(strstr(bytes.bytes, "NumberOfLines=\"3\""));
        assert_non_null(strstr(bytes.bytes, "\n-0.5 0.25 0\n0.5 0.25 0\n"));
        assert_non_null(strstr(bytes.bytes, "\n3.5 0.25 0\n4.5 0.25 0\n"));
        assert_non_null(strstr(bytes.bytes, k == 0 ? "format=\"ascii\">\n-1\n0\n0\n</DataArray>"
                                                   : "format=\"ascii\">\n-6\n-5\n0\n</DataArray>"));
        bytes.size = 0;
        dem2d_svg_desc svg = {0};
        svg.write = scene_write, svg.user = &bytes;
        assert_ok(dem2d_world_write_svg(s.world, &svg, NULL));
        assert_true(scene_write(&bytes, "", 1));
        char *walls = strstr(bytes.bytes, "<g stroke=\"#444\">");
        assert_non_null(walls);
        *strstr(walls, "</g>") = 0;
        assert_int_equal(count_of(walls, "<line"), 3);
        free(bytes.bytes);
        close_scene(&s);
    }
}

/* While the cell deforms, a copy of a wall has the velocity of the wall and of the flow between. */
static void test_written_flow(void **state) {
    (void)state;
    const dem2d_material_desc soft = soft_desc(false);
    dem2d_world_desc desc = {0};
    dem2d_deformation_desc shear = {0};
    desc.time_step = DT, desc.cell.a = vec(4, 0), desc.cell.b = vec(0.5, 4);
    const scene s = open_scene(&desc, &soft);
    dem2d_wall_desc wall = plane_desc(&s, vec(1, 3.5), vec(0, 0));
    wall.segment = true, wall.end = vec(1, 4.5);
    wall.mode = DEM2D_WALL_MOVING, wall.velocity = vec(0.25, 0);
    (void)add_wall(&s, &wall);
    const dem2d_particle_desc grain = grain_desc(&s, give_shape(&s, make_disc(0.5)), 1, vec(2, 1));
    (void)add_grain(&s, &grain);
    shear.xy = 0.5;
    assert_ok(dem2d_world_deform(s.world, &shear));
    step(&s, 3);
    scene_bytes bytes = {0};
    dem2d_vtp_desc vtp = {0};
    vtp.write = scene_write, vtp.user = &bytes, vtp.part = DEM2D_VTP_WALLS;
    assert_ok(dem2d_world_write_vtp(s.world, &vtp, NULL));
    assert_true(scene_write(&bytes, "", 1));
    /* two copies below, at -b and a - b, and itself */
    assert_non_null(strstr(bytes.bytes, ">\n-1.75 0 0\n-1.75 0 0\n0.25 0 0\n<"));
    free(bytes.bytes);
    close_scene(&s);
}

/* A servo segment across the border presses a grain against its copies of a floor: it is carried
   round, and each step after the first contacts has the force that is asked for. */
static void test_servo(void **state) {
    (void)state;
    const dem2d_material_desc soft = soft_desc(true);
    dem2d_world_desc desc = {0};
    desc.time_step = DT, desc.cell.a = vec(4, 0), desc.ledger = true;
    const scene s = open_scene(&desc, &soft);
    const dem2d_shape_id disc = give_shape(&s, make_disc(0.5));
    (void)add_segment(&s, vec(1, 0), vec(5, 0));
    for (int i = 0; i < 4; i++) {
        dem2d_particle_desc grain = grain_desc(&s, disc, 1, vec(i, 0.5));
        grain.velocity = vec(2, 0);
        (void)add_grain(&s, &grain);
    }
    dem2d_wall_desc lid = plane_desc(&s, vec(6.5, 1.2), vec(0, 0)); /* over 2.5 to 6.5: round */
    lid.segment = true, lid.end = vec(2.5, 1.2), lid.mode = DEM2D_WALL_SERVO;
    lid.stress = 5, lid.max_speed = 2;
    const dem2d_wall_id id = add_wall(&s, &lid);
    step(&s, 3000);
    for (int i = 0; i < 500; i++) {
        step(&s, 1);
        const dem2d_wall_info now = wall_of(&s, id);
        assert_within(now.force.y, 4 * 5, 1e-3 * 4 * 5);
        assert_within(now.stress, 5, 1e-3 * 5);
        assert_near(now.point.y, now.end.y, 1e-12);
        assert_between(now.point.y, 0.97, 1);
    }
    assert_true(inside_holds(s.world));
    close_scene(&s);
}

/* --- a cell that deforms ---------------------------------------------------------------------- */

/* A box in simple shear, without friction, from a state in which the cell has sheared for a while:
   in the cell, and by hand with walls and grains that move against each other by rate times b.
   Returns the greatest distance after a time. */
static double shear_error(void) {
    static packed cell;
    const filling f = {16, 1, 0.4, 2, 0, false, false, 0.25, 0, 0, {BOX}};
    dem2d_world_desc desc = {0};
    dem2d_cell_info now;
    dem2d_deformation_desc shear = {0};
    dem2d_pair_desc smooth;
    fill(&cell, &f, &desc, true);
    assert_ok(dem2d_world_get_pair(cell.s.world, cell.s.material, cell.s.material, &smooth));
    smooth.friction = smooth.tangential_stiffness = 0;
    assert_ok(dem2d_world_set_pair(cell.s.world, cell.s.material, cell.s.material, &smooth));
    shear.xy = 0.7;
    assert_ok(dem2d_world_deform(cell.s.world, &shear));
    step(&cell.s, 200);
    assert_ok(dem2d_world_get_cell(cell.s.world, &now));
    const dem2d_vec a = now.cell.a, b = now.cell.b;
    packed copies = cell;
    copies.copies = 25;
    desc.time_step = DT, desc.gather = share, desc.exchange_user = &copies;
    const dem2d_material_desc soft = soft_desc(false);
    dem2d_shape_id shapes[4];
    copies.s = open_scene(&desc, &soft);
    assert_ok(dem2d_world_set_pair(copies.s.world, copies.s.material, copies.s.material, &smooth));
    make_shapes(&copies.s, shapes);
    wall_kind box = f.walls[0];
    for (int n = -2; n <= 2; n++)
        for (int m = -2; m <= 2; m++) {
            packed place = copies;
            place.a = cell.a; /* the shape of the box is given by the cell at first, */
            wall_kind moved = box;
            for (int k = 0; k < box.count; k++) { /* its place by that of now */
                moved.points[k].x += (m * a.x + n * b.x) / cell.a.x;
                moved.points[k].y += n * b.y / cell.b.y;
            }
            moved.velocity.x = shear.xy * n * b.y;
            const dem2d_wall_id id = add_copy_of(&place, &moved, 0, 0, 0);
            if (n == 0 && m == 0) copies.walls[0] = id;
        }
    for (int i = 0; i < cell.count; i++) {
        const dem2d_particle_info grain = grain_of(&cell.s, cell.ids[i]);
        const dem2d_vec x = grain.pose.position;
        for (int n = -2; n <= 2; n++)
            for (int m = -2; m <= 2; m++) {
                dem2d_particle_desc copy = grain_desc(&copies.s, shapes[0], grain.pose.scale, x);
                copy.position.x += m * a.x + n * b.x, copy.position.y += n * b.y;
                copy.velocity = grain.velocity; /* less L c dt/2: half a step ago */
                copy.velocity.x += shear.xy * (x.y + n * b.y - grain.velocity.y * DT / 2);
                copy.angular_velocity = grain.angular_velocity;
                const dem2d_particle_id id = add_grain(&copies.s, &copy);
                if (n == 0 && m == 0) copies.ids[i] = id;
            }
    }
    step(&cell.s, 300), step(&copies.s, 300);
    assert_true(inside_holds(cell.s.world));
    assert_ok(dem2d_world_get_cell(cell.s.world, &now));
    double most = 0;
    for (int i = 0; i < cell.count; i++) {
        const dem2d_vec from = grain_of(&cell.s, cell.ids[i]).pose.position;
        const dem2d_vec to = grain_of(&copies.s, copies.ids[i]).pose.position;
        const double n = rint((to.y - from.y) / now.cell.b.y);
        dem2d_vec d = vec(to.x - from.x - n * now.cell.b.x, to.y - from.y - n * now.cell.b.y);
        d.x -= rint(d.x / now.cell.a.x) * now.cell.a.x;
        most = fmax(most, hypot(d.x, d.y));
    }
    const dem2d_vec one = wall_of(&cell.s, cell.walls[0]).force;
    const dem2d_vec other = wall_of(&copies.s, copies.walls[0]).force;
    assert_within(one.x, other.x, 100 * KN * most + 1e-9);
    assert_within(one.y, other.y, 100 * KN * most + 1e-9);
    close_scene(&cell.s), close_scene(&copies.s);
    return most;
}

static void test_sheared(void **state) {
    (void)state;
    assert_between(shear_error(), 0, 1e-9);
}

/* The ledger of a cell that deforms closes with walls in it. */
static void test_ledger(void **state) {
    (void)state;
    for (int k = 0; k < 3; k++) {
        for (int half = 0; half < 2; half++) {
            static packed p;
            const filling f = {25, 1, 0.7, 1, 0, false, false, 0.25, 0, 0, {BOX, PADDLE}};
            dem2d_world_desc desc = {0};
            dem2d_deformation_desc rates = {0};
            desc.ledger = true;
            fill(&p, &f, &desc, true);
            assert_ok(dem2d_world_set_time_step(p.s.world, DT / (1 + half)));
            if (k == 0) rates.xy = 0.5;
            if (k == 1) rates.xx = -0.3, rates.yy = -0.1;
            if (k == 2) rates.xx = 0.4, rates.yy = -0.4, rates.xy = -0.3;
            assert_ok(dem2d_world_deform(p.s.world, &rates));
            step(&p.s, 600 * (1 + half));
            const dem2d_ledger ledger = ledger_of(&p.s);
            assert_within(ledger.closure, 0, 1e-3 * fabs(ledger.cell));
            assert_true(fabs(ledger.cell) > 0.02 * ledger.turnover && ledger.walls != 0);
            close_scene(&p.s);
        }
    }
}

/* What has no sense is refused, and changes nothing. */
static void test_refused(void **state) {
    (void)state;
    const dem2d_material_desc soft = soft_desc(false);
    dem2d_world_desc desc = {0};
    test_env env;
    test_env_init(&env);
    desc.time_step = DT, desc.env = &env.env, desc.cell.a = vec(4, 0), desc.cell.b = vec(0, 4);
    const scene s = open_scene(&desc, &soft);
    dem2d_wall_id id;
    dem2d_wall_desc wall = plane_desc(&s, vec(0.5, 0.5), vec(0, 0));
    static const struct {
        dem2d_vec end;
        const char *word;
    } segments[] = {{{4.7, 0.5}, "copy"},
                    {{-4, 0.5}, "copy"},
                    {{8.6, 8.6}, "copy"},
                    {{1e10, 0}, "2^26"},
                    {{1e5, 3e4}, "1024 cells"}};
    wall.segment = true;
    for (int k = 0; k < COUNT_OF(segments); k++) {
        wall.end = segments[k].end;
        assert_result(dem2d_world_add_wall(s.world, &wall, &id), DEM2D_OUT_OF_RANGE);
        assert_logged(&env, DEM2D_OUT_OF_RANGE, env.log.index, segments[k].word);
    }
    const dem2d_vec cross[3] = {{0.5, 0.5}, {4.2, 1}, {0.4, 0.7}}; /* not yet */
    dem2d_wall_desc chain = plane_desc(&s, vec(0, 0), vec(0, 0));
    chain.points = cross, chain.count = 3;
    assert_ok(dem2d_world_add_wall(s.world, &chain, &id));
    assert_ok(dem2d_world_remove_wall(s.world, id));
    const dem2d_vec crossed[3] = {{0.5, 0.5}, {4.7, 0.7}, {4.6, 0}};
    chain.points = crossed;
    assert_result(dem2d_world_add_wall(s.world, &chain, &id), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, env.log.index, "copy");
    /* stresses and servo walls */
    wall.end = vec(1.5, 0.5);
    const dem2d_wall_id bar = add_wall(&s, &wall);
    dem2d_deformation_desc flow = {0};
    flow.hold_xx = true, flow.stress_xx = 1;
    assert_result(dem2d_world_deform(s.world, &flow), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "held");
    wall.mode = DEM2D_WALL_SERVO, wall.stress = 1, wall.max_speed = 1;
    assert_ok(dem2d_world_set_wall(s.world, bar, &wall));
    flow.hold_xx = false, flow.stress_xx = 0, flow.xx = -0.1;
    assert_result(dem2d_world_deform(s.world, &flow), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "servo");
    wall.mode = DEM2D_WALL_STILL, wall.stress = 0;
    assert_ok(dem2d_world_set_wall(s.world, bar, &wall));
    assert_ok(dem2d_world_deform(s.world, &flow));
    step(&s, 2);
    wall.mode = DEM2D_WALL_SERVO;
    assert_result(dem2d_world_set_wall(s.world, bar, &wall), DEM2D_OUT_OF_RANGE);
    /* a floor that goes round: the cell may shear, but not stretch */
    flow.xx = 0, flow.xy = 0.3;
    assert_ok(dem2d_world_deform(s.world, &flow));
    step(&s, 2);
    dem2d_cell_info now;
    assert_ok(dem2d_world_get_cell(s.world, &now));
    wall.mode = DEM2D_WALL_STILL, wall.point = vec(0, 2.5), wall.end = vec(now.cell.a.x, 2.5);
    (void)add_wall(&s, &wall);
    step(&s, 2);
    flow.xx = 0.1;
    assert_ok(dem2d_world_deform(s.world, &flow));
    const uint64_t before = dem2d_world_hash(s.world);
    assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, env.log.index, "border");
    assert_true(dem2d_world_hash(s.world) == before && inside_holds(s.world));
    flow.xx = 0;
    assert_ok(dem2d_world_deform(s.world, &flow));
    step(&s, 2);
    close_scene(&s);
    assert_clean(&env);
}

/* Twice the area of the triangle from p by a and b. */
static double side_of(dem2d_vec p, dem2d_vec a, dem2d_vec b) {
    return (a.x - p.x) * (b.y - p.y) - (a.y - p.y) * (b.x - p.x);
}

/* Does a star cross its copy that is moved by a vector? Each side against each, in doubles: points
   are random, none is on a side. */
static bool copy_crosses(const dem2d_vec *points, int count, dem2d_vec way) {
    for (int i = 0; i < count; i++)
        for (int j = 0; j < count; j++) {
            const dem2d_vec a = points[i], b = points[(i + 1) % count];
            dem2d_vec p = points[j], q = points[(j + 1) % count];
            p.x += way.x, p.y += way.y, q.x += way.x, q.y += way.y;
            if ((side_of(a, b, p) > 0) != (side_of(a, b, q) > 0) &&
                (side_of(p, q, a) > 0) != (side_of(p, q, b) > 0))
                return true;
        }
    return false;
}

/* Chains that reach beyond the cell are refused if, and only if, they cross a copy: stars of random
   radii in cells that lean. */
static void test_chains_and_copies(void **state) {
    (void)state;
    const dem2d_material_desc soft = soft_desc(false);
    uint64_t seed = 11;
    int refused = 0;
    for (int n = 0; n < 400; n++) {
        dem2d_vec points[40];
        const int count = 3 + n % 38;
        const dem2d_vec centre = vec(random_between(&seed, -3, 3), random_between(&seed, -3, 3));
        for (int k = 0; k < count; k++) {
            const double angle = 2 * TEST_PI * k / count, r = random_between(&seed, 0.3, 0.9);
            points[k] = vec(centre.x + r * cos(angle), centre.y + r * sin(angle));
        }
        dem2d_world_desc desc = {0};
        desc.time_step = DT;
        if (n % 3 != 1) desc.cell.a = vec(random_between(&seed, 0.8, 1.7), 0);
        if (n % 3 != 2) desc.cell.b = vec(n % 3 == 0 ? random_between(&seed, -0.4, 0.4) : 0, 1.2);
        const scene s = open_scene(&desc, &soft);
        dem2d_wall_desc chain = plane_desc(&s, vec(0, 0), vec(0, 0));
        dem2d_wall_id id;
        chain.points = points, chain.count = count, chain.closed = true;
        bool crosses = false;
        for (int i = -3; i <= 3; i++)
            for (int j = -3; j <= 3; j++) {
                const dem2d_vec way = vec(i * desc.cell.a.x + j * desc.cell.b.x, j * desc.cell.b.y);
                if (way.x != 0 || way.y != 0) crosses = crosses || copy_crosses(points, count, way);
            }
        assert_result(dem2d_world_add_wall(s.world, &chain, &id),
                      crosses ? DEM2D_OUT_OF_RANGE : DEM2D_OK);
        refused += crosses;
        close_scene(&s);
    }
    assert_in_range(refused, 50, 350); /* both happen */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_copies),       cmocka_unit_test(test_chains_and_copies),
        cmocka_unit_test(test_independent),  cmocka_unit_test(test_snapshots),
        cmocka_unit_test(test_memory),       cmocka_unit_test(test_slide),
        cmocka_unit_test(test_momentum),     cmocka_unit_test(test_seen),
        cmocka_unit_test(test_sheared),      cmocka_unit_test(test_ledger),
        cmocka_unit_test(test_refused),      cmocka_unit_test(test_written),
        cmocka_unit_test(test_written_flow), cmocka_unit_test(test_servo),
    };
    return cmocka_run_group_tests_name("walls in a periodic cell", tests, NULL, NULL);
}
