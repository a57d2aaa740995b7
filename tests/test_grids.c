/* Coarse-grained fields: totals, values by brute force in long double from the definitions, the
   balance of momentum, boundaries, groups, means over time, boxes and circles, what is refused. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "world_scene.h"

#include <float.h>

enum { GRAINS = 70, CONTACTS = 400, CELLS = 40000 };

static dem2d_average cells[CELLS], others[CELLS];

/* --- scenes ---------------------------------------------------------------------------------- */

/* Grains of three shapes that fall into a box of 1 by 1 at (0, 0), or of circles alone; with
   `strange`, one grain is fixed, one driven, one a sensor, and every third in group 2. */
static scene make_heap(bool circles, bool strange, double skin, int steps) {
    static const dem2d_vec box[4] = {{0, 0}, {0.09, 0}, {0.09, 0.06}, {0, 0.06}};
    dem2d_material_desc stone = stone_desc(5e6, 0.4);
    dem2d_world_desc desc;
    memset(&desc, 0, sizeof desc);
    stone.damping_ratio = 0.3;
    desc.time_step = 1e-4, desc.gravity = vec(1, -9.81), desc.skin = skin;
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id shapes[3] = {give_shape(&s, make_disc(0.05)),
                                      give_shape(&s, make_polygon(box, 4, 0)),
                                      give_shape(&s, make_ellipse(0.05, 0.03))};
    (void)add_floor(&s), (void)add_plane(&s, 0, 0, 1, 0), (void)add_plane(&s, 1, 0, -1, 0);
    for (int i = 0; i < GRAINS; i++) {
        dem2d_particle_desc grain =
            grain_desc(&s, shapes[circles ? 0 : i % 3], i % 4 == 0 ? 0.8 : 1,
                       vec(0.055 + 0.1 * (i % 9) + 0.01 * (i / 9 % 2), 0.06 + 0.105 * (i / 9)));
        grain.angular_velocity = 4 * (i % 5 - 2);
        if (strange && i % 3 == 0) grain.groups.category = 2;
        if (strange && i % 3 != 0) grain.groups.category = 1;
        if (strange && i == 40) grain.groups.sensor = true;
        if (strange && i == 4) grain.motion = DEM2D_FIXED, grain.angular_velocity = 0;
        if (strange && i == 22) grain.motion = DEM2D_DRIVEN, grain.velocity = vec(0.1, -0.05);
        (void)add_grain(&s, &grain);
    }
    step(&s, steps);
    return s;
}

/* A box of 30 by 24 cells around the heap with a margin. */
static dem2d_grid_desc wide_desc(double width) {
    dem2d_grid_desc desc = {0};
    desc.nx = 30, desc.ny = 24;
    desc.box.lower = vec(-0.5, -0.5), desc.box.upper = vec(1.5, 1.7);
    desc.width_x = desc.width_y = width;
    return desc;
}

static dem2d_grid *new_grid(const dem2d_grid_desc *desc) {
    dem2d_grid *grid;
    assert_ok(dem2d_grid_create(NULL, desc, &grid));
    return grid;
}

static void add(dem2d_grid *grid, const scene *s, double weight) {
    assert_ok(dem2d_grid_add(grid, s->world, weight));
}

/* Reads all cells; returns their number. */
static int read_grid(const dem2d_grid *grid, dem2d_average *into) {
    int count;
    assert_ok(dem2d_grid_read(grid, into, CELLS, &count));
    assert_true(count <= CELLS);
    return count;
}

/* The fields of one state. */
static int fields_of(const scene *s, const dem2d_grid_desc *desc, dem2d_average *into) {
    dem2d_grid *grid = new_grid(desc);
    add(grid, s, 1);
    const int count = read_grid(grid, into);
    dem2d_grid_destroy(grid);
    return count;
}

/* --- the definitions, by brute force --------------------------------------------------------- */

typedef struct grain {
    dem2d_vec x, v, force; /* force: of the contacts */
    double mass, area;
    dem2d_particle_id id;
    bool counts;
} grain;

static grain grains[GRAINS];
static int grain_count;

/* All particles at the last force pass; those of the mask that are free count. */
static void find_grains(const scene *s, uint32_t mask) {
    static dem2d_vec x[GRAINS], v[GRAINS], f[GRAINS];
    static double masses[GRAINS], radii[GRAINS];
    static dem2d_particle_id ids[GRAINS];
    dem2d_particle_arrays a = {0};
    a.at_forces = true, a.positions = x, a.velocities = v, a.forces = f, a.masses = masses;
    a.equivalents = radii, a.ids = NULL;
    assert_ok(dem2d_world_read_particles(s->world, &a, GRAINS, &grain_count));
    assert_ok(dem2d_world_particles(s->world, ids, GRAINS, &grain_count));
    for (int i = 0; i < grain_count; i++) {
        const dem2d_particle_info info = grain_of(s, ids[i]);
        const uint32_t category = info.groups.category;
        grain *g = &grains[i];
        g->x = x[i], g->v = v[i], g->force = f[i], g->mass = masses[i], g->id = ids[i];
        g->area = (double)TEST_PI * radii[i] * radii[i];
        g->counts = info.motion == DEM2D_FREE && !info.groups.sensor &&
                    (mask == 0 || category == 0 || (mask & category));
    }
}

static const grain *grain_by(dem2d_particle_id id) {
    for (int i = 0; i < grain_count; i++)
        if (grains[i].id.index == id.index) return &grains[i];
    fail_msg("no grain");
    return NULL;
}

/* The smoothing function of one axis. */
static long double bump(long double t, long double width) {
    const long double u = t / width;
    return fabsl(u) < 1 ? 15 * (1 - u * u) * (1 - u * u) / (16 * width) : 0;
}

/* Its integral over [a, b]: Boole's rule, exact to degree 5, on the part where it is not 0. With
   width 0 a half-open step. */
static long double bump_over(long double a, long double b, long double width) {
    if (width == 0) return a <= 0 && 0 < b ? 1 : 0;
    const long double from = fmaxl(a, -width), to = fminl(b, width), h = (to - from) / 4;
    if (!(to > from)) return 0;
    return 2 * h / 45 *
           (7 * bump(from, width) + 32 * bump(from + h, width) + 12 * bump(from + 2 * h, width) +
            32 * bump(from + 3 * h, width) + 7 * bump(to, width));
}

/* Part of a point in a cell of a grid that is not turned. */
static long double share(const dem2d_grid_desc *d, int column, int row, long double x,
                         long double y) {
    const long double w = ((long double)d->box.upper.x - d->box.lower.x) / d->nx;
    const long double h = ((long double)d->box.upper.y - d->box.lower.y) / d->ny;
    const long double left = d->box.lower.x + column * w - x, low = d->box.lower.y + row * h - y;
    return bump_over(left, left + w, d->width_x) * bump_over(low, low + h, d->width_y);
}

/* Part of a line: Simpson's rule of many steps. */
static long double line_share(const dem2d_grid_desc *d, int column, int row, dem2d_vec from,
                              dem2d_vec along) {
    enum { STEPS = 2000 };
    long double sum = 0;
    for (int i = 0; i <= STEPS; i++) {
        const long double s = (long double)i / STEPS;
        const long double x = from.x + s * along.x, y = from.y + s * along.y;
        sum += (i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2) * share(d, column, row, x, y);
    }
    return sum / (3 * STEPS);
}

/* What a cell must hold, times its area. */
typedef struct expected {
    long double number, mass, area, px, py, kxx, kxy, kyy, xx, xy, yx, yy, bx, by, contacts;
    long double fxx, fxy, fyy;
} expected;

static void expect_line(expected *e, const dem2d_grid_desc *d, int column, int row, dem2d_vec from,
                        dem2d_vec along, dem2d_vec f, const dem2d_vec *n) {
    const long double w = line_share(d, column, row, from, along);
    e->xx += w * along.x * f.x, e->xy += w * along.x * f.y;
    e->yx += w * along.y * f.x, e->yy += w * along.y * f.y;
    if (n) {
        e->contacts += w, e->fxx += w * n->x * n->x, e->fxy += w * n->x * n->y;
        e->fyy += w * n->y * n->y;
    } else {
        const long double p =
            share(d, column, row, (long double)from.x + along.x, (long double)from.y + along.y);
        e->bx -= p * f.x, e->by -= p * f.y;
    }
}

static expected expect_cell(const scene *s, const dem2d_grid_desc *d, int column, int row) {
    static dem2d_contact_info list[CONTACTS];
    expected e = {0};
    const int count = contacts_of(s, list, CONTACTS);
    assert_true(count > 0 && count <= CONTACTS);
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < grain_count; i++) {
            const grain *g = &grains[i];
            const long double w = g->counts ? share(d, column, row, g->x.x, g->x.y) : 0;
            if (pass == 0) {
                e.number += w, e.mass += w * g->mass, e.area += w * g->area;
                e.px += w * g->mass * g->v.x, e.py += w * g->mass * g->v.y;
            } else if (e.mass > 0) {
                const long double x = g->v.x - e.px / e.mass, y = g->v.y - e.py / e.mass;
                e.kxx += w * g->mass * x * x, e.kxy += w * g->mass * x * y;
                e.kyy += w * g->mass * y * y;
            }
        }
    for (int i = 0; i < count; i++) {
        const dem2d_contact_info *c = &list[i];
        const dem2d_vec t = vec(-c->normal.y, c->normal.x);
        const double fn = c->normal_force * 1.0, ft = c->tangential_force;
        const dem2d_vec f = vec(fn * c->normal.x + ft * t.x, fn * c->normal.y + ft * t.y);
        const grain *a = grain_by(c->a);
        const grain *b = c->b.generation ? grain_by(c->b) : NULL;
        const dem2d_vec to_point = vec(c->point.x - a->x.x, c->point.y - a->x.y);
        if (a->counts && b && b->counts) {
            expect_line(&e, d, column, row, a->x, c->branch, f, &c->normal);
        } else if (a->counts) {
            expect_line(&e, d, column, row, a->x, to_point, f, NULL);
        } else if (b && b->counts) {
            expect_line(&e, d, column, row, b->x, vec(c->point.x - b->x.x, c->point.y - b->x.y),
                        vec(-f.x, -f.y), NULL);
        }
    }
    return e;
}

/* Compares cells spread over a grid; stresses to 1e-6 of the greatest, as Simpson's rule needs
   it. */
static void check_cells(const scene *s, const dem2d_grid_desc *d, uint32_t mask) {
    const int count = fields_of(s, d, cells);
    const long double area = ((long double)d->box.upper.x - d->box.lower.x) / d->nx *
                             ((long double)d->box.upper.y - d->box.lower.y) / d->ny;
    long double dense = 0, stress = 0, push = 0, moment = 0, kinetic = 0;
    int filled = 0;
    find_grains(s, mask);
    for (int i = 0; i < count; i++) {
        dense = fmaxl(dense, cells[i].density), stress = fmaxl(stress, fabs(cells[i].contact.yy));
        push = fmaxl(push, fabs(cells[i].boundary.y));
        moment = fmaxl(moment, fabs(cells[i].momentum.y));
        kinetic = fmaxl(kinetic, cells[i].kinetic.yy);
    }
    assert_true(dense > 0 && stress > 0 && push > 0 && moment > 0);
    const long double coarse = d->width_x == 0 ? 2e-3L : 1e-6L; /* Simpson's at a step */
    for (int i = 0; i < count; i += 17) {
        const dem2d_average *c = &cells[i];
        const expected e = expect_cell(s, d, i % d->nx, i / d->nx);
        assert_within(c->number * area, e.number, 1e-12L * (1 + e.number));
        assert_within(c->density * area, e.mass, 1e-12L * dense * area);
        assert_within(c->solid_fraction * area, e.area, 1e-12L);
        assert_within(c->momentum.x * area, e.px, 1e-11L * moment * area);
        assert_within(c->momentum.y * area, e.py, 1e-11L * moment * area);
        assert_within(c->kinetic.xx * area, e.kxx, 1e-10L * kinetic * area);
        assert_within(c->kinetic.xy * area, e.kxy, 1e-10L * kinetic * area);
        assert_true(c->kinetic.yx == c->kinetic.xy);
        assert_within(c->kinetic.yy * area, e.kyy, 1e-10L * kinetic * area);
        assert_within(c->contact.xx * area, e.xx, coarse * stress * area);
        assert_within(c->contact.xy * area, e.xy, coarse * stress * area);
        assert_within(c->contact.yx * area, e.yx, coarse * stress * area);
        assert_within(c->contact.yy * area, e.yy, coarse * stress * area);
        assert_within(c->boundary.x * area, e.bx, 1e-11L * push * area);
        assert_within(c->boundary.y * area, e.by, 1e-11L * push * area);
        assert_within(c->contacts * area, e.contacts, coarse * (1 + e.contacts));
        if (e.contacts > 0.01L) {
            assert_within(c->fabric_xx, e.fxx / e.contacts, 100 * coarse);
            assert_within(c->fabric_xy, e.fxy / e.contacts, 100 * coarse);
            assert_near(c->fabric_xx + c->fabric_yy, 1, 1e-12L);
        }
        filled += e.yy != 0;
    }
    assert_true(filled >= 3);
}

static void test_definitions(void **state) {
    (void)state;
    for (int strange = 0; strange < 2; strange++) {
        const scene s = make_heap(strange, strange, 0, 3000);
        dem2d_grid_desc desc = wide_desc(0.15);
        check_cells(&s, &desc, 0);
        desc.width_x = 0.03, desc.width_y = 0.4;
        if (strange) desc.mask = 2;
        check_cells(&s, &desc, desc.mask);
        desc.nx = 7, desc.ny = 90, desc.width_y = 0; /* cells longer than lines */
        desc.width_x = 0;
        check_cells(&s, &desc, desc.mask);
        close_scene(&s);
    }
}

/* --- totals ---------------------------------------------------------------------------------- */

static dem2d_average total_of(int count, double area) {
    dem2d_average t = {0};
    for (int i = 0; i < count; i++) {
        const dem2d_average *c = &cells[i];
        t.number += c->number * area, t.density += c->density * area;
        t.solid_fraction += c->solid_fraction * area;
        t.momentum.x += c->momentum.x * area, t.momentum.y += c->momentum.y * area;
        t.contact.xx += c->contact.xx * area, t.contact.xy += c->contact.xy * area;
        t.contact.yx += c->contact.yx * area, t.contact.yy += c->contact.yy * area;
        t.boundary.x += c->boundary.x * area, t.boundary.y += c->boundary.y * area;
        t.contacts += c->contacts * area;
    }
    return t;
}

/* What the other queries of the world say. */
static void check_totals(const scene *s, const dem2d_average *t) {
    static dem2d_contact_info list[CONTACTS];
    dem2d_stress whole;
    long double mass = 0, area = 0, px = 0, py = 0;
    int pairs = 0, walls, count = contacts_of(s, list, CONTACTS);
    dem2d_wall_id ids[8];
    dem2d_vec push = vec(0, 0);
    assert_ok(dem2d_world_stress(s->world, 1, &whole));
    for (int i = 0; i < grain_count; i++) {
        mass += grains[i].mass, area += grains[i].area;
        px += grains[i].mass * grains[i].v.x, py += grains[i].mass * grains[i].v.y;
    }
    for (int i = 0; i < count; i++) pairs += list[i].b.generation != 0;
    assert_ok(dem2d_world_walls(s->world, ids, 8, &walls));
    for (int i = 0; i < walls; i++) {
        const dem2d_wall_info wall = wall_of(s, ids[i]);
        push.x -= wall.force.x, push.y -= wall.force.y;
    }
    const long double size = fabs(whole.xx) + fabs(whole.yy), force = fabs(push.y);
    const long double speed = fabsl(px) + fabsl(py);
    assert_near(t->number, grain_count, 1e-12L);
    assert_near(t->density, mass, 1e-12L);
    assert_near(t->solid_fraction, area, 1e-12L);
    assert_within(t->momentum.x, px, 1e-12L * speed);
    assert_within(t->momentum.y, py, 1e-12L * speed);
    assert_within(t->boundary.x, push.x, 1e-12L * force);
    assert_within(t->boundary.y, push.y, 1e-12L * force);
    assert_near(t->contacts, pairs, 1e-12L);
    assert_within(t->contact.xx, whole.xx, 1e-12L * size);
    assert_within(t->contact.xy, whole.xy, 1e-12L * size);
    assert_within(t->contact.yx, whole.yx, 1e-12L * size);
    assert_within(t->contact.yy, whole.yy, 1e-12L * size);
}

static void test_totals(void **state) {
    static const double widths[][2] = {{0, 0},      {0.05, 0.05}, {0.2, 0.2},
                                       {0.5, 0.01}, {0, 0.3},     {1e-9, 0.1}};
    static const int sizes[][2] = {{1, 1}, {30, 24}, {3, 150}, {90, 60}, {1, 40}};
    (void)state;
    const scene s = make_heap(false, false, 0, 4000);
    find_grains(&s, 0);
    for (int i = 0; i < COUNT_OF(widths); i++)
        for (int k = 0; k < COUNT_OF(sizes); k++)
            for (int turned = 0; turned < 2; turned++) {
                dem2d_grid_desc desc = wide_desc(0);
                desc.nx = sizes[k][0], desc.ny = sizes[k][1];
                desc.width_x = widths[i][0], desc.width_y = widths[i][1];
                if (turned) { /* holds the heap at any angle */
                    desc.angle = 0.3 + i + 10 * k;
                    desc.box.lower = vec(-2.5, -2.6), desc.box.upper = vec(2.7, 2.4);
                }
                const int count = fields_of(&s, &desc, cells);
                const double area = (desc.box.upper.x - desc.box.lower.x) *
                                    (desc.box.upper.y - desc.box.lower.y) / count;
                const dem2d_average total = total_of(count, area);
                check_totals(&s, &total);
            }
    close_scene(&s);
}

/* Boxes on a chain of segments: contacts at vertices count with their signs. */
static void test_joints(void **state) {
    (void)state;
    static const dem2d_vec corners[4] = {{0, 0}, {0.2, 0}, {0.2, 0.1}, {0, 0.1}};
    static const dem2d_vec points[5] = {{0, 0.8}, {0, 0.1}, {0.4, 0.104}, {0.9, 0.1}, {0.9, 0.8}};
    static dem2d_contact_info list[CONTACTS];
    dem2d_material_desc stone = stone_desc(5e6, 0.3);
    dem2d_world_desc desc;
    memset(&desc, 0, sizeof desc);
    stone.damping_ratio = 0.2, desc.time_step = 1e-4, desc.gravity = vec(0, -300);
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id box = give_shape(&s, make_polygon(corners, 4, 0.01));
    dem2d_wall_desc chain = plane_desc(&s, vec(0, 0), vec(0, 0));
    chain.points = points, chain.count = 5;
    (void)add_wall(&s, &chain);
    for (int i = 0; i < 9; i++) {
        dem2d_particle_desc g =
            grain_desc(&s, box, 1, vec(0.17 + 0.22 * (i % 3), 0.3 + 0.16 * (i / 3)));
        g.angle = i % 2 ? 0 : -0.02;
        (void)add_grain(&s, &g);
    }
    int vertices = 0;
    for (int i = 0; i < 4000 && vertices == 0; i++) {
        step(&s, 1);
        const int count = contacts_of(&s, list, CONTACTS);
        for (int k = 0; k < count; k++) vertices += list[k].feature > 0;
    }
    assert_true(vertices > 0);
    find_grains(&s, 0);
    const dem2d_grid_desc wide = wide_desc(0.1);
    const int count = fields_of(&s, &wide, cells);
    const dem2d_average total = total_of(count, 2 * 2.2 / count);
    check_totals(&s, &total);
    close_scene(&s);
}

/* Periodic: nothing is lost without a margin, and a box that begins elsewhere has the same cells in
   another order. */
static void test_periodic(void **state) {
    (void)state;
    const scene s = make_heap(true, false, 0, 3000);
    find_grains(&s, 0);
    for (int wide = 0; wide < 2; wide++) {
        dem2d_grid_desc desc = {0};
        desc.nx = 20, desc.ny = 10, desc.periodic_x = desc.periodic_y = true;
        desc.box.lower = vec(0.3, 0.2), desc.box.upper = vec(0.9, 0.7);
        desc.width_x = wide ? 0.6 : 0.1, desc.width_y = wide ? 0.5 : 0.07;
        const int count = fields_of(&s, &desc, cells);
        const dem2d_average total = total_of(count, 0.6 * 0.5 / count);
        check_totals(&s, &total);
        desc.box.lower.x -= 0.09, desc.box.upper.x -= 0.09; /* by three cells */
        desc.box.lower.y += 1, desc.box.upper.y += 1;       /* by two periods */
        assert_int_equal(fields_of(&s, &desc, others), count);
        for (int i = 0; i < count; i++) {
            const int k = i / 20 * 20 + (i % 20 + 17) % 20;
            assert_near(others[i].density, cells[k].density, 1e-9L);
            assert_within(others[i].contact.yy, cells[k].contact.yy,
                          1e-9L * fabs(total.contact.yy) / 0.3);
        }
    }
    close_scene(&s);
}

/* A grid that is turned by a right angle has the cells of one that is not, and those of a part of a
   turn are where they say they are. */
static void test_turned(void **state) {
    (void)state;
    const scene s = make_heap(false, false, 0, 3000);
    dem2d_grid_desc desc = {0};
    desc.nx = 20, desc.ny = 30, desc.width_x = 0.2, desc.width_y = 0.1;
    desc.box.lower = vec(0.1, 0.05), desc.box.upper = vec(0.9, 0.8);
    const int count = fields_of(&s, &desc, cells);
    dem2d_grid_desc turned = desc; /* x is along y, y against x */
    turned.angle = (double)TEST_PI / 2, turned.nx = 30, turned.ny = 20;
    turned.width_x = 0.1, turned.width_y = 0.2;
    turned.box.lower = vec(0.05, -0.9), turned.box.upper = vec(0.8, -0.1);
    assert_int_equal(fields_of(&s, &turned, others), count);
    for (int i = 0; i < count; i++) {
        const dem2d_average *c = &cells[i], *o = &others[(19 - i % 20) * 30 + i / 20];
        const double stress = fabs(c->contact.xx) + fabs(c->contact.yy);
        assert_within(o->centre.x, c->centre.x, 1e-14L);
        assert_within(o->centre.y, c->centre.y, 1e-14L);
        assert_near(o->density, c->density, 1e-9L);
        assert_near(o->velocity.x, c->velocity.x, 1e-9L);
        assert_within(o->contact.xy, c->contact.xy, 1e-9L * stress);
        assert_within(o->contact.yy, c->contact.yy, 1e-9L * stress);
    }
    desc.angle = 0.7, desc.width_x = desc.width_y = 0; /* sharp: the cell of each centre */
    find_grains(&s, 0);
    assert_int_equal(fields_of(&s, &desc, cells), count);
    for (int i = 0; i < count; i++) {
        int inside = 0;
        for (int k = 0; k < grain_count; k++) {
            const double x = grains[k].x.x - cells[i].centre.x;
            const double y = grains[k].x.y - cells[i].centre.y;
            inside += fabs(x * cos(0.7) + y * sin(0.7)) < 0.02 &&
                      fabs(y * cos(0.7) - x * sin(0.7)) < 0.0125;
        }
        assert_within(cells[i].number * 0.04 * 0.025, inside, 1e-12L);
    }
    close_scene(&s);
}

/* --- the balance of momentum ----------------------------------------------------------------- */

/* Root mean square over inner cells of div contact - boundary + the smoothed forces on grains, over
   that of these forces without the stress: 0 in the limit of small cells at any instant. */
static double imbalance(const scene *s, double width, int per_width) {
    dem2d_grid_desc d = {0};
    d.width_x = d.width_y = width;
    d.nx = d.ny = (int)(1.8 / width * per_width + 0.5);
    d.box.lower = vec(-0.4, -0.4), d.box.upper = vec(-0.4 + 1.8, -0.4 + 1.8);
    const double h = 1.8 / d.nx, area = h * h;
    long double left = 0, size = 0;
    assert_true(fields_of(s, &d, cells) <= CELLS);
    for (int j = 1; j < d.ny - 1; j += 2)
        for (int i = 1; i < d.nx - 1; i += 2) {
            const dem2d_average *c = &cells[j * d.nx + i];
            const dem2d_stress e = c[1].contact, w = c[-1].contact, n = c[d.nx].contact,
                               u = c[-d.nx].contact;
            long double x = (e.xx - w.xx + n.yx - u.yx) / (2 * h) - c->boundary.x;
            long double y = (e.xy - w.xy + n.yy - u.yy) / (2 * h) - c->boundary.y;
            size += x * x + y * y;
            for (int k = 0; k < grain_count; k++) {
                const grain *g = &grains[k];
                if (fabs(g->x.x - c->centre.x) > width + h ||
                    fabs(g->x.y - c->centre.y) > width + h)
                    continue;
                const long double part = share(&d, i, j, g->x.x, g->x.y) / area;
                x += part * g->force.x, y += part * g->force.y;
            }
            left += x * x + y * y;
        }
    return (double)sqrtl(left / size);
}

/* In an instant of a fall, and at rest, where the forces of the contacts are the weights: the rest
   falls as the square of the cells. */
static void test_instant_balance(void **state) {
    (void)state;
    const scene s = make_heap(false, false, 0, 1500);
    for (int rest = 0; rest < 2; rest++) {
        find_grains(&s, 0);
        const double coarse = imbalance(&s, 0.2, 8), fine = imbalance(&s, 0.2, 16);
        assert_between(fine, 0, 0.01);
        assert_between(coarse / fine, 3, 5);
        step(&s, 15000);
    }
    close_scene(&s);
}

/* Root mean square over inner cells of the balance of means over a time, over that of the change of
   momentum alone: the momentum at the end less that at the start is what the fluxes bring. */
static double flow_imbalance(const dem2d_grid_desc *d, const dem2d_average *mean,
                             const dem2d_average *first, const dem2d_average *last, double time) {
    const double h = (d->box.upper.x - d->box.lower.x) / d->nx, g[2] = {1, -9.81};
    long double left = 0, size = 0, advected = 0;
    for (int j = 1; j < d->ny - 1; j++)
        for (int i = 1; i < d->nx - 1; i++) {
            const int at = j * d->nx + i;
            const int near[4] = {at + 1, at - 1, at + d->nx, at - d->nx};
            long double flux[2] = {0, 0}, contact[2] = {0, 0};
            for (int k = 0; k < 4; k++) {
                const dem2d_average *c = &mean[near[k]];
                const long double sign = k % 2 ? -1 : 1;
                const long double v[2] = {c->velocity.x, c->velocity.y};
                const dem2d_stress *kin = &c->kinetic, *con = &c->contact;
                const long double through = c->density * v[k / 2] * sign;
                flux[0] += through * v[0] + sign * (k < 2 ? kin->xx : kin->yx);
                flux[1] += through * v[1] + sign * (k < 2 ? kin->xy : kin->yy);
                contact[0] += sign * (k < 2 ? con->xx : con->yx);
                contact[1] += sign * (k < 2 ? con->xy : con->yy);
            }
            const dem2d_average *c = &mean[at];
            const double push[2] = {c->boundary.x, c->boundary.y};
            const double gain[2] = {last[at].momentum.x - first[at].momentum.x,
                                    last[at].momentum.y - first[at].momentum.y};
            for (int k = 0; k < 2; k++) {
                const long double rate = gain[k] / time, brought = flux[k] / (2 * h);
                const long double r =
                    rate + brought + contact[k] / (2 * h) - c->density * g[k] - push[k];
                left += r * r, size += rate * rate, advected += brought * brought;
            }
        }
    assert_true(advected > 4 * left); /* the balance needs the flux */
    return (double)sqrtl(left / size);
}

/* Means over the time of a collapse. */
static void test_flow_balance(void **state) {
    enum { STEPS = 200 };
    (void)state;
    static dem2d_average first[2][CELLS], last[2][CELLS];
    const scene s = make_heap(false, false, 0, 800);
    dem2d_grid_desc d[2] = {{0}};
    dem2d_grid *grid[2];
    for (int k = 0; k < 2; k++) {
        d[k].nx = d[k].ny = k ? 48 : 24, d[k].width_x = d[k].width_y = 0.3;
        d[k].box.lower = vec(-0.4, -0.4), d[k].box.upper = vec(1.4, 1.4);
        grid[k] = new_grid(&d[k]);
    }
    for (int i = 0; i <= STEPS; i++) { /* the trapezoidal rule */
        step(&s, 1);
        for (int k = 0; k < 2; k++) {
            if (i == 0) (void)fields_of(&s, &d[k], first[k]);
            if (i == STEPS) (void)fields_of(&s, &d[k], last[k]);
            add(grid[k], &s, i == 0 || i == STEPS ? 0.5e-4 : 1e-4);
        }
    }
    double rest[2];
    for (int k = 0; k < 2; k++) {
        (void)read_grid(grid[k], cells);
        rest[k] = flow_imbalance(&d[k], cells, first[k], last[k], 1e-4 * STEPS);
        dem2d_grid_destroy(grid[k]);
    }
    assert_between(rest[1], 0, 0.06);
    assert_between(rest[0] / rest[1], 3, 5);
    close_scene(&s);
}

/* The profile of an oblique cell: its sums, and the same for another second vector, as
   the images are the same. */
static void test_oblique(void **state) {
    (void)state;
    const dem2d_material_desc stone = stone_desc(0, 0);
    for (int k = 0; k < 3; k++) {
        dem2d_world_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.time_step = 1e-4, desc.skip_time_step_check = true;
        desc.cell.a = vec(0.6, 0), desc.cell.b = vec(k == 1 ? 0.27 : k == 2 ? -0.33 : 0, 0.7);
        const scene s = open_scene(&desc, &stone);
        const dem2d_shape_id disc = give_shape(&s, make_disc(0.1));
        for (int i = 0; i < 12; i++) {
            const dem2d_particle_desc g =
                grain_desc(&s, disc, 1, vec(0.19 * (i % 3) + 0.05 * (i / 3), 0.173 * (i / 3)));
            (void)add_grain(&s, &g);
        }
        step(&s, 1);
        dem2d_grid_desc d = {0};
        d.nx = 1, d.ny = 10, d.periodic_x = d.periodic_y = true, d.width_y = 0.2;
        d.box.lower = vec(100.1, -3), d.box.upper = vec(100.7, -2.3);
        dem2d_stress whole;
        assert_ok(dem2d_world_stress(s.world, 0.6 * 0.7, &whole));
        const int count = fields_of(&s, &d, k == 1 ? others : cells);
        const dem2d_average *c = k == 1 ? others : cells;
        long double xx = 0, yy = 0, mass = 0;
        for (int i = 0; i < count; i++)
            xx += c[i].contact.xx / 10, yy += c[i].contact.yy / 10, mass += c[i].density * 0.042L;
        assert_true(whole.xx > 0 && whole.yy > 0);
        assert_near(xx, whole.xx, 1e-12L);
        assert_near(yy, whole.yy, 1e-12L);
        assert_near(mass, 12 * 2700 * 0.01L * TEST_PI, 1e-12L);
        for (int i = 0; k == 2 && i < count; i++) {
            assert_near(cells[i].density, others[i].density, 1e-9L);
            assert_near(cells[i].contact.xx, others[i].contact.xx, 1e-9L);
        }
        dem2d_grid *grid;
        d.nx = 2;
        assert_ok(dem2d_grid_create(NULL, &d, &grid));
        assert_result(dem2d_grid_add(grid, s.world, 1), k == 0 ? DEM2D_OK : DEM2D_OUT_OF_RANGE);
        dem2d_grid_destroy(grid);
        close_scene(&s);
    }
}

/* In a cell that is sheared: sums of the profile are the stresses of the cell, with velocities less
   the flow. */
static void test_sheared(void **state) {
    (void)state;
    const dem2d_material_desc stone = stone_desc(5e6, 0.4);
    const dem2d_deformation_desc shear = {.xy = 3};
    dem2d_cell_info info;
    dem2d_world_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.time_step = 1e-4, desc.cell.a = vec(0.8, 0), desc.cell.b = vec(0, 0.7);
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id disc = give_shape(&s, make_disc(0.052));
    for (int i = 0; i < 56; i++) {
        dem2d_particle_desc g =
            grain_desc(&s, disc, i % 3 ? 0.9 : 1, vec(0.1 * (i % 8), 0.1 * (i / 8)));
        g.velocity = vec(uniform(-1, 1), uniform(-1, 1));
        (void)add_grain(&s, &g);
    }
    assert_ok(dem2d_world_deform(s.world, &shear));
    step(&s, 700);
    assert_ok(dem2d_world_get_cell(s.world, &info));
    assert_true(fabs(info.cell.b.x) > 0.01);
    dem2d_grid_desc d = {0};
    d.nx = 1, d.ny = 9, d.periodic_x = d.periodic_y = true, d.width_y = 0.1;
    d.box.upper = vec(0.8, 0.7);
    const int count = fields_of(&s, &d, cells);
    long double contact = 0, kinetic = 0;
    for (int i = 0; i < count; i++) {
        contact += cells[i].contact.xy / count;
        kinetic += cells[i].kinetic.yy / count;
        kinetic += cells[i].momentum.y * cells[i].velocity.y / count;
    }
    assert_near(contact, info.contact.xy, 1e-11L);
    assert_near(kinetic, info.kinetic.yy, 1e-11L);
    close_scene(&s);
}

/* --- boundary, groups ------------------------------------------------------------------------ */

/* The fields of two groups: sums of numbers are those of both together, and what one pushes at the
   other comes back. */
static void test_groups(void **state) {
    (void)state;
    const scene s = make_heap(false, true, 0, 4000);
    dem2d_grid_desc desc = wide_desc(0.1);
    desc.nx = desc.ny = 1;
    desc.mask = 3;
    dem2d_average both, one, two;
    (void)fields_of(&s, &desc, &both);
    desc.mask = 1;
    (void)fields_of(&s, &desc, &one);
    desc.mask = 2;
    (void)fields_of(&s, &desc, &two);
    const double area = 2 * 2.2;
    assert_near(both.number * area, GRAINS - 3, 1e-12L); /* one fixed, one driven, one sensor */
    assert_near(one.number + two.number, both.number, 1e-12L);
    assert_near(one.density + two.density, both.density, 1e-12L);
    assert_within(one.boundary.y + two.boundary.y, both.boundary.y, 1e-11L * fabs(both.boundary.y));
    assert_true(one.contacts + two.contacts < both.contacts);
    close_scene(&s);
}

/* --- means ----------------------------------------------------------------------------------- */

/* Two states of a grain in one cell, with weights 1 and 3, far faster than they differ. */
static void test_time_mean(void **state) {
    (void)state;
    dem2d_world_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.time_step = 1e-9;
    const dem2d_material_desc stone = stone_desc(0, 0);
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id disc = give_shape(&s, make_disc(0.1));
    dem2d_particle_desc g = grain_desc(&s, disc, 1, vec(0.5, 0.5));
    g.velocity = vec(1e6, -3);
    const dem2d_particle_id id = add_grain(&s, &g);
    dem2d_grid_desc d = {0};
    d.nx = 1, d.ny = 1, d.box.upper = vec(2, 2);
    dem2d_grid *grid = new_grid(&d);
    add(grid, &s, 1);
    set_velocity(&s, id, DEM2D_FREE, vec(1e6 + 4, 5), 0);
    step(&s, 1), step(&s, 1);
    add(grid, &s, 3);
    const double mass = 2700 * (double)TEST_PI * 0.01, rho = mass / 4;
    dem2d_average a;
    assert_int_equal(read_grid(grid, &a), 1);
    assert_near(a.number, 0.25, 1e-14L);
    assert_near(a.density, rho, 1e-12L);
    assert_near(a.velocity.x, 1e6 + 3, 1e-15L);
    assert_near(a.velocity.y, 3, 1e-12L);
    assert_near(a.kinetic.xx, rho * 3, 1e-9L); /* 1/4 3^2 + 3/4 1^2 */
    assert_near(a.kinetic.yy, rho * 12, 1e-12L);
    assert_near(a.kinetic.xy, rho * 6, 1e-9L);
    assert_ok(dem2d_grid_reset(grid));
    (void)read_grid(grid, &a);
    assert_true(a.density == 0 && a.velocity.x == 0 && a.kinetic.xx == 0 && a.centre.x == 1);
    add(grid, &s, 1e-3);
    (void)read_grid(grid, &a);
    assert_near(a.density, rho, 1e-12L);
    assert_true(a.kinetic.xx == 0 && a.kinetic.yy == 0);
    dem2d_grid_destroy(grid);
    close_scene(&s);
}

/* --- boxes and circles ----------------------------------------------------------------------- */

static void test_regions(void **state) {
    (void)state;
    const scene s = make_heap(false, false, 0, 4000);
    static dem2d_contact_info list[CONTACTS];
    const int count = contacts_of(&s, list, CONTACTS);
    const dem2d_vec centre = vec(0.45, 0.3);
    const double radius = 0.23;
    find_grains(&s, 0);
    for (int circle = 0; circle < 2; circle++) {
        dem2d_average a;
        const dem2d_box box = {{0.2, 0.1}, {0.7, 0.47}};
        const long double area = circle ? TEST_PI * radius * radius : 0.5L * 0.37L;
        if (circle)
            assert_ok(dem2d_world_average_circle(s.world, centre, radius, &a));
        else
            assert_ok(dem2d_world_average_box(s.world, &box, &a));
        long double mass = 0, yy = 0, xy = 0, contacts = 0;
        enum { STEPS = 20000 };
        for (int i = 0; i < grain_count; i++) {
            const dem2d_vec x = grains[i].x;
            if (circle ? hypot(x.x - centre.x, x.y - centre.y) < radius
                       : x.x >= 0.2 && x.x < 0.7 && x.y >= 0.1 && x.y < 0.47)
                mass += grains[i].mass;
        }
        for (int i = 0; i < count; i++) {
            const dem2d_contact_info *c = &list[i];
            const dem2d_vec x = grain_by(c->a)->x;
            int in = 0;
            for (int k = 0; k < STEPS; k++) {
                const double t = (k + 0.5) / STEPS;
                const double px = x.x + t * c->branch.x, py = x.y + t * c->branch.y;
                in += circle ? hypot(px - centre.x, py - centre.y) < radius
                             : px >= 0.2 && px < 0.7 && py >= 0.1 && py < 0.47;
            }
            const long double fy =
                c->normal_force * c->normal.y + c->tangential_force * c->normal.x;
            yy += (long double)in / STEPS * c->branch.y * fy;
            xy += (long double)in / STEPS * c->branch.x * fy;
            if (c->b.generation) contacts += (long double)in / STEPS;
        }
        assert_near(a.density * area, mass, 1e-12L);
        assert_near(a.contact.yy * area, yy, 1e-3L);
        assert_within(a.contact.xy * area, xy, 1e-3L * fabsl(yy));
        assert_near(a.contacts * area, contacts, 1e-3L);
        assert_within(a.centre.x, 0.45, 1e-15L);
    }
    close_scene(&s);
}

/* All of a world in a box and in a circle: the same sums. */
static void test_whole(void **state) {
    (void)state;
    const scene s = make_heap(true, false, 0, 3000);
    const dem2d_box box = {{-1, -1}, {2, 3}};
    dem2d_average a, b;
    dem2d_stress whole;
    assert_ok(dem2d_world_average_box(s.world, &box, &a));
    assert_ok(dem2d_world_average_circle(s.world, vec(0.5, 0.5), 9, &b));
    const long double ratio = 12 / (TEST_PI * 81);
    assert_near(b.density, a.density * ratio, 1e-13L);
    assert_near(b.contact.yy, a.contact.yy * ratio, 1e-13L);
    assert_near(b.boundary.y, a.boundary.y * ratio, 1e-13L);
    assert_ok(dem2d_world_stress(s.world, 12, &whole));
    assert_near(a.contact.yy, whole.yy, 1e-13L);
    close_scene(&s);
}

/* --- images in a periodic cell --------------------------------------------------------------- */

/* Nine grains in an oblique cell, one of them fixed, or with copies by hand in the cells around. */
static scene make_images(bool cell) {
    const dem2d_vec a = vec(0.6, 0), b = vec(0.2, 0.5);
    const dem2d_material_desc stone = stone_desc(5e6, 0.4);
    const int around = cell ? 0 : 5;
    dem2d_world_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.time_step = 1e-4, desc.skip_time_step_check = true;
    if (cell) desc.cell.a = a, desc.cell.b = b;
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id shapes[2] = {give_shape(&s, make_disc(0.11)),
                                      give_shape(&s, make_ellipse(0.13, 0.09))};
    for (int i = 0; i < 9; i++)
        for (int n = -around; n <= around; n++)
            for (int m = -around; m <= around; m++) {
                dem2d_particle_desc g = grain_desc(&s, shapes[i % 2], 1, vec(0, 0));
                g.position.x = 0.21 * (i % 3) + 0.07 * (i / 3) + m * a.x + n * b.x;
                g.position.y = 0.17 * (i / 3) + 0.01 * (i % 2) + n * b.y;
                g.motion = i == 4 ? DEM2D_FIXED : DEM2D_FREE;
                if (i != 4) g.velocity = vec(0.3 * (i - 2), 0.2 - 0.1 * i);
                (void)add_grain(&s, &g);
            }
    step(&s, 1);
    return s;
}

/* To 1e-9: the search finds depths of ellipses to about 1e-11 of their size, and they overlap by
   some hundredths of it. */
static void check_same(const dem2d_average *a, const dem2d_average *b, int count) {
    double most[sizeof *a / sizeof(double)] = {0};
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < count; i++)
            for (size_t k = 0; k < COUNT_OF(most); k++) {
                double one, other;
                memcpy(&one, (const char *)&a[i] + k * sizeof one, sizeof one);
                memcpy(&other, (const char *)&b[i] + k * sizeof other, sizeof other);
                if (pass == 0) most[k] = fmax(most[k], fabs(other));
                if (pass == 1) assert_within(one, other, 1e-9L * most[k]);
            }
    assert_true(most[COUNT_OF(most) - 1] > 0); /* contacts */
}

/* In a cell a box, a circle and a grid, also one that is greater than the cell or turned, or has
   the period of the cell along x alone, get what they get from copies by hand. */
static void test_images(void **state) {
    (void)state;
    const scene cell = make_images(true), copies = make_images(false);
    static const dem2d_box boxes[3] = {
        {{-0.75, -0.3}, {0.8, 0.6}}, {{0.5, 0.4}, {0.75, 0.65}}, {{0.1, 0.1}, {0.4, 0.35}}};
    dem2d_average a, b;
    for (int i = 0; i < 3; i++) {
        assert_ok(dem2d_world_average_box(cell.world, &boxes[i], &a));
        assert_ok(dem2d_world_average_box(copies.world, &boxes[i], &b));
        check_same(&a, &b, 1);
        const dem2d_vec centre = boxes[i].upper;
        assert_ok(dem2d_world_average_circle(cell.world, centre, 0.25 * (i + 1), &a));
        assert_ok(dem2d_world_average_circle(copies.world, centre, 0.25 * (i + 1), &b));
        check_same(&a, &b, 1);
        dem2d_grid_desc d = {0};
        d.nx = 3, d.ny = 4, d.box = boxes[i], d.angle = 0.3 * i;
        d.width_x = 0.05 * i, d.width_y = i == 2 ? 0.7 : 0.03;
        const int count = fields_of(&cell, &d, cells);
        (void)fields_of(&copies, &d, others);
        check_same(cells, others, count);
    }
    dem2d_grid_desc d = {0};
    d.nx = 3, d.ny = 4, d.box.lower = vec(0.1, -0.2), d.box.upper = vec(0.7, 0.9), d.width_y = 0.2;
    (void)fields_of(&copies, &d, others);
    d.periodic_x = true;
    check_same(cells, others, fields_of(&cell, &d, cells));
    const dem2d_box long_box = {{0, 0}, {700, 1}}, far_box = {{0, 3e8}, {1, 3e8 + 1}};
    assert_result(dem2d_world_average_box(cell.world, &long_box, &a), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_average_box(cell.world, &far_box, &a), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_average_circle(cell.world, vec(0, 0), 400, &a), DEM2D_OUT_OF_RANGE);
    close_scene(&cell), close_scene(&copies);
}

/* --- what changes nothing -------------------------------------------------------------------- */

/* Adding a world changes neither it nor what comes of it; the bits of the fields do not depend on
   the skin and the order in memory. */
static void test_bits(void **state) {
    (void)state;
    const scene a = make_heap(false, false, 0.05, 2000), b = make_heap(false, false, 0.3, 2000);
    const dem2d_grid_desc desc = wide_desc(0.12);
    const uint64_t hash = dem2d_world_hash(a.world);
    const int count = fields_of(&a, &desc, cells);
    assert_true(dem2d_world_hash(a.world) == hash);
    inside_scatter(b.world, true);
    step(&a, 1), step(&b, 1);
    (void)fields_of(&a, &desc, cells);
    (void)fields_of(&b, &desc, others);
    assert_memory_equal(cells, others, (size_t)count * sizeof *cells);
    close_scene(&a), close_scene(&b);
}

/* --- files ----------------------------------------------------------------------------------- */

/* Both files hold the bits of dem2d_grid_read. */
static void test_files(void **state) {
    (void)state;
    const scene s = make_heap(false, false, 0, 2000);
    dem2d_grid_desc desc = wide_desc(0.1);
    desc.nx = 4, desc.ny = 3, desc.angle = 0.4;
    dem2d_grid *grid = new_grid(&desc);
    add(grid, &s, 1);
    const int count = read_grid(grid, cells);
    scene_bytes file;
    dem2d_save_desc to = {0};
    memset(&file, 0, sizeof file);
    to.write = scene_write, to.user = &file;
    assert_ok(dem2d_grid_write_csv(grid, &to, NULL));
    assert_true(scene_write(&file, "", 1));
    const char *at = file.bytes;
    const char header[] =
        "centre_x,centre_y,number,density,solid_fraction,momentum_x,momentum_y,velocity_x,"
        "velocity_y,contact_xx,contact_xy,contact_yx,contact_yy,kinetic_xx,kinetic_xy,kinetic_yx,"
        "kinetic_yy,boundary_x,boundary_y,contacts,fabric_xx,fabric_xy,fabric_yy\n";
    assert_memory_equal(at, header, sizeof header - 1);
    at += sizeof header - 1;
    for (int i = 0; i < count; i++)
        for (size_t k = 0; k < sizeof *cells / sizeof(double); k++) {
            double value;
            char *end;
            memcpy(&value, (char *)&cells[i] + k * sizeof value, sizeof value);
            assert_same_bits(strtod(at, &end), value);
            assert_true(*end == (k + 1 < sizeof *cells / sizeof(double) ? ',' : '\n'));
            at = end + 1;
        }
    assert_true(*at == 0);
    file.size = 0;
    assert_ok(dem2d_grid_write_vti(grid, &to, NULL));
    assert_true(scene_write(&file, "", 1));
    assert_true(strstr(file.bytes, "WholeExtent=\"0 4 0 3 0 0\"") != NULL);
    at = strstr(file.bytes, "Name=\"contact\" NumberOfComponents=\"9\"");
    assert_non_null(at);
    at = strchr(at, '\n');
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 9; k++) {
            const double t[9] = {cells[i].contact.xx,
                                 cells[i].contact.xy,
                                 0,
                                 cells[i].contact.yx,
                                 cells[i].contact.yy,
                                 0,
                                 0,
                                 0,
                                 0};
            char *end;
            assert_same_bits(strtod(at, &end), t[k]);
            at = end;
        }
    assert_true(strncmp(at, "\n</DataArray>", 13) == 0);
    const size_t whole = file.size - 1;
    for (file.limit = 1; file.limit < whole; file.limit += 97) { /* a full disc */
        file.size = 0;
        assert_result(dem2d_grid_write_vti(grid, &to, NULL), DEM2D_IO);
    }
    assert_result(dem2d_grid_write_csv(grid, &to, "x.csv"), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_grid_write_csv(grid, NULL, "build/no such/x.csv"), DEM2D_IO);
    free(file.bytes);
    dem2d_grid_destroy(grid);
    close_scene(&s);
}

/* --- what is refused ------------------------------------------------------------------------- */

static void test_refused(void **state) {
    (void)state;
    test_env env;
    test_env_init(&env);
    const scene s = make_heap(true, false, 0, 1);
    dem2d_grid_desc desc = wide_desc(0.1), bad = desc;
    dem2d_grid *grid = NULL;
    bad.box.upper.x = bad.box.lower.x;
    assert_result(dem2d_grid_create(&env.env, &bad, &grid), DEM2D_OUT_OF_RANGE);
    assert_true(strstr(env.log.text, "box") != NULL);
    bad = desc, bad.periodic_y = true, bad.width_y = 36;
    assert_result(dem2d_grid_create(&env.env, &bad, &grid), DEM2D_OUT_OF_RANGE);
    assert_true(strstr(env.log.text, "width_y = 36") != NULL);
    bad.periodic_y = false; /* wider than the box: allowed */
    assert_ok(dem2d_grid_create(&env.env, &bad, &grid));
    dem2d_grid_destroy(grid);
    desc.periodic_x = true, desc.box.upper.x = desc.box.lower.x + 0.09, desc.width_x = 0.01;
    assert_ok(dem2d_grid_create(&env.env, &desc, &grid));
    assert_result(dem2d_grid_add(grid, s.world, 1), DEM2D_OUT_OF_RANGE);
    assert_true(strstr(env.log.text, "period") != NULL);
    assert_result(dem2d_grid_add(grid, s.world, 0), DEM2D_OUT_OF_RANGE);
    const int count = read_grid(grid, cells);
    for (int i = 0; i < count; i++) assert_true(cells[i].number == 0);
    dem2d_grid_destroy(grid);
    dem2d_grid_destroy(NULL);
    close_scene(&s);
    assert_clean(&env);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_definitions),  cmocka_unit_test(test_totals),
        cmocka_unit_test(test_periodic),     cmocka_unit_test(test_instant_balance),
        cmocka_unit_test(test_flow_balance), cmocka_unit_test(test_groups),
        cmocka_unit_test(test_time_mean),    cmocka_unit_test(test_regions),
        cmocka_unit_test(test_whole),        cmocka_unit_test(test_bits),
        cmocka_unit_test(test_turned),       cmocka_unit_test(test_oblique),
        cmocka_unit_test(test_sheared),      cmocka_unit_test(test_joints),
        cmocka_unit_test(test_files),        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_images),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
