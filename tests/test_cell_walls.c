/* Segments, chains, one-sided and turning walls in a periodic cell: they act as copies made by hand
   do, across the border as elsewhere, whatever is listed. The oracle is a world without a cell, in
   which each grain and each wall has copies at all cell vectors nearby; copies of a grain get its
   forces. A floor that goes round is one long chain there. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "world_scene.h"

enum { GRAINS = 36, COPIES = 11 * 11, WALLS = 4, POINTS = 12 };

#define KN 1000.0 /* of discs of diameter 1 and mass 1 */
#define DT (0.02 / 31.622776601683793)

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

static dem2d_material_desc soft_desc(bool damped) {
    dem2d_material_desc desc = material_desc(4 / (double)TEST_PI, KN, KN / 2, 0.4);
    if (damped) desc.damping_ratio = 0.1, desc.rolling_friction = 0.05;
    if (damped) desc.tangential_damping_ratio = 0.1;
    return desc;
}

/* Copies get the sums of their grain, the one in the middle of its ids. */
static void share(void *user, dem2d_sums *sums) {
    const packed *p = user;
    for (int i = 0; i < p->count; i++)
        for (int k = 0; k < p->copies; k++) {
            const int row = i * p->copies + k, own = i * p->copies + p->copies / 2;
            sums->force[row] = sums->force[own], sums->torque[row] = sums->torque[own];
        }
}

static void make_shapes(const scene *s, dem2d_shape_id shapes[4]) {
    static const dem2d_vec box[4] = {{-0.45, -0.4}, {0.45, -0.45}, {0.5, 0.4}, {-0.4, 0.5}};
    static const double a[5] = {0.45, 0, 0.02, 0.01, 0.003}, b[5] = {0, 0, 0, 0.005, 0};
    shapes[0] = give_shape(s, make_disc(0.5));
    shapes[1] = give_shape(s, make_polygon(box, 4, 0.05));
    shapes[2] = give_shape(s, make_ellipse(0.5, 0.4));
    shapes[3] = give_shape(s, make_series(a, b, 4));
}

/* Grains on a lattice, displaced at random, with random speeds. */
static dem2d_particle_desc grain_at(const packed *p, const filling *f,
                                    const dem2d_shape_id shapes[4], int i, uint64_t *random) {
    const int side = (int)ceil(sqrt(f->grains));
    const double s = (i % side + 0.5 + random_between(random, 0, 0.1)) / side;
    const double t = (i / side + 0.5 + random_between(random, 0, 0.1)) / side;
    const dem2d_vec at = vec(s * p->a.x + t * p->b.x, t * p->b.y);
    const double scale = random_between(random, 0.8, 1);
    dem2d_particle_desc grain = grain_desc(&p->s, shapes[i % f->kinds], scale, at);
    grain.angle = random_between(random, 0, 6);
    grain.velocity.x = random_between(random, -f->speed, f->speed);
    grain.velocity.y = random_between(random, -f->speed, f->speed);
    grain.angular_velocity = random_between(random, -f->speed, f->speed);
    return grain;
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
    for (int i = 0; i < f->grains; i++) {
        const dem2d_particle_desc grain = grain_at(p, f, shapes, i, &random);
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
        print_message("case %d: %.2g, pressed %d\n", k, difference(&cell, &copies, f->open),
                      pressed);
        assert_between(difference(&cell, &copies, f->open), 0, 1e-9);
        assert_true(pressed > 3);
        close_scene(&cell.s), close_scene(&copies.s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_copies),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
