/* verify.h - what verify.c and verify_long.c share: the table, small scenes, packings. Include it
   after dem2d.h. */
#ifndef VERIFY_H
#define VERIFY_H

#include "../examples/grains.h"
#include "../examples/statistics.h"
#include "world_scene.h"

#include <float.h>

#if defined(__GNUC__)
#define LABEL_PRINTF __attribute__((format(printf, 1, 2)))
#else
#define LABEL_PRINTF
#endif

#define PI 3.14159265358979323846264338327950288L
#define G 9.81
#define DENSITY 2700.0
#define KN 1e7
#define DEGREE ((double)(PI / 180))

/* --- the table ------------------------------------------------------------------------------- */

static int table_rows, table_failures;
static double table_started, group_started;
static const char *basis; /* where expectations come from */

/* A text that lives until sixteen more were made. */
PART const char *label(const char *format, ...) LABEL_PRINTF;
PART const char *label(const char *format, ...) {
    static char text[16][96];
    static int next;
    va_list list;
    char *place = text[next++ % 16];
    va_start(list, format);
    vsnprintf(place, sizeof text[0], format, list);
    va_end(list);
    return place;
}

PART void table_group(const char *title) {
    const double now = clock_seconds();
    if (table_rows == 0) table_started = now;
    if (table_rows > 0) printf("%*s%.1f s\n", 118, "", now - group_started);
    group_started = now;
    printf("\n%-60s %15s %15s %10s %10s       %s\n", title, "expected", "got", "error", "allowed",
           "expected from");
    fflush(stdout);
}

PART void table_row(const char *name, const char *expected, double got, double error,
                    const char *allowed, bool good) {
    table_rows++;
    if (!good) table_failures++;
    printf("%-60s %15s %15.9g %10.2g %10s %s %s\n", name, expected, got, error, allowed,
           good ? "ok  " : "FAIL", basis);
    fflush(stdout);
}

/* Relative to the expected value. */
PART void row_near(const char *name, double expected, double got, double relative) {
    const double error = fabs(got - expected) / fabs(expected);
    table_row(name, label("%.9g", expected), got, error, label("%.2g rel", relative),
              error <= relative);
}

PART void row_within(const char *name, double expected, double got, double tolerance) {
    const double error = fabs(got - expected);
    table_row(name, label("%.9g", expected), got, error, label("%.2g", tolerance),
              error <= tolerance);
}

/* What must be small: at most the bound in size. */
PART void row_small(const char *name, double got, double bound) {
    table_row(name, "0", got, fabs(got), label("%.2g", bound), fabs(got) <= bound);
}

/* The error is how far outside the band it is. */
PART void row_between(const char *name, double low, double high, double got) {
    const double error = got < low ? low - got : got > high ? got - high : 0;
    table_row(name, label("%.4g to %.4g", low, high), got, error, "in band",
              got >= low && got <= high);
}

PART void row_above(const char *name, double low, double got) {
    table_row(name, label("> %.4g", low), got, got > low ? 0 : low - got, "-", got > low);
}

PART void row_below(const char *name, double high, double got) {
    table_row(name, label("< %.4g", high), got, got < high ? 0 : got - high, "-", got < high);
}

/* Prints the sum; the exit status. */
PART int table_end(void) {
    const double now = clock_seconds();
    printf("%*s%.1f s\n", 118, "", now - group_started);
    printf("\n%d rows, %d failed, %.0f s\n", table_rows, table_failures, now - table_started);
    return table_failures == 0 ? STATUS_OK : STATUS_FAILED;
}

/* --- small scenes ---------------------------------------------------------------------------- */

PART double length(dem2d_vec v) {
    return sqrt(v.x * v.x + v.y * v.y);
}

PART dem2d_world_desc world_desc(double time_step) {
    dem2d_world_desc desc = {0};
    desc.time_step = time_step, desc.contact_tolerance = 1e-13, desc.env = example_env();
    return desc;
}

/* Takes the shape. */
PART dem2d_particle_id add(const scene *s, dem2d_shape *shape, dem2d_motion motion, dem2d_vec at,
                           dem2d_vec velocity, double spin) {
    return add_shape(s, shape, motion, at, 0, velocity, spin);
}

/* Ids of all; the caller frees them. */
PART dem2d_particle_id *all_ids(const scene *s, int *count) {
    must(dem2d_world_particles(s->world, NULL, 0, count), "particles");
    dem2d_particle_id *ids = get_memory(NULL, (size_t)*count + 1, sizeof *ids);
    must(dem2d_world_particles(s->world, ids, *count, count), "particles");
    return ids;
}

/* All contacts; the caller frees them. */
PART dem2d_contact_info *all_contacts(const scene *s, int *count) {
    *count = contacts_of(s, NULL, 0);
    dem2d_contact_info *list = get_memory(NULL, (size_t)*count + 1, sizeof *list);
    contacts_of(s, list, *count);
    return list;
}

PART double kinetic(const dem2d_energy *e) {
    return e->translational + e->rotational;
}

PART double total(const dem2d_energy *e) {
    return kinetic(e) + e->normal + e->tangential + e->potential;
}

PART void set_gravity(const scene *s, double x, double y) {
    must(dem2d_world_set_gravity(s->world, vec(x, y)), "gravity");
}

PART void set_damping(const scene *s, double local) {
    must(dem2d_world_set_damping(s->world, local, 0), "damping");
}

PART double disc_mass(double radius) {
    return DENSITY * (double)PI * radius * radius;
}

/* Mean resultant on a particle, gravity too, over the mean contact force. */
PART double unbalanced(const scene *s, dem2d_vec gravity) {
    int count, touching;
    double resultant = 0, force = 0;
    dem2d_particle_id *ids = all_ids(s, &count);
    dem2d_contact_info *list = all_contacts(s, &touching);
    for (int i = 0; i < count; i++) {
        const dem2d_particle_info p = grain_of(s, ids[i]);
        resultant += hypot(p.force.x + p.mass * gravity.x, p.force.y + p.mass * gravity.y) / count;
    }
    for (int i = 0; i < touching; i++) force += list[i].normal_force / touching;
    free(ids), free(list);
    return touching > 0 ? resultant / force : HUGE_VAL;
}

/* --- shapes of every model ------------------------------------------------------------------- */

enum { K_CIRCLE, K_ELLIPSE, K_POLYGON, K_ROUNDED, K_BEZIER, K_FOURIER, K_CUSTOM, MODELS };

PART const char *const model_names[MODELS] = {"circles",          "ellipses",    "sharp polygons",
                                              "rounded polygons", "polybeziers", "Fourier series",
                                              "custom shapes"};

/* An ellipse of 0.8 and 0.5, grown by 0.3. */
PART dem2d_vec grown_ellipse(void *user, dem2d_vec u, double *rho) {
    const double grow = *(const double *)user, a = 0.8, b = 0.5;
    const double h = sqrt(a * a * u.x * u.x + b * b * u.y * u.y);
    if (rho) *rho = a * a * b * b / (h * h * h) + grow;
    return vec((a * a / h + grow) * u.x, (b * b / h + grow) * u.y);
}

PART dem2d_shape *polygon(int sides, double rounding) {
    dem2d_vec points[7];
    dem2d_shape *shape;
    for (int k = 0; k < sides; k++) {
        const double t = (double)(2 * PI) * (k + uniform(-0.25, 0.25)) / sides;
        points[k] = vec(cos(t), sin(t));
    }
    must(dem2d_shape_create_polygon(NULL, points, sides, rounding, &shape), "polygon");
    return shape;
}

/* Four arcs of a kind of egg: handles along the axes, so that joints are smooth. */
PART dem2d_shape *egg(void) {
    static const double way[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    double reach[4];
    dem2d_vec points[12];
    dem2d_shape *shape;
    for (int i = 0; i < 4; i++) reach[i] = uniform(0.7, 1.2);
    for (int i = 0; i < 4; i++) {
        const int j = (i + 1) % 4;
        const dem2d_vec p = vec(reach[i] * way[i][0], reach[i] * way[i][1]);
        const dem2d_vec q = vec(reach[j] * way[j][0], reach[j] * way[j][1]);
        const double f = uniform(0.45, 0.65), g = uniform(0.45, 0.65);
        points[3 * i] = p;
        points[3 * i + 1] = vec(p.x + f * q.x, p.y + f * q.y);
        points[3 * i + 2] = vec(q.x + g * p.x, q.y + g * p.y);
    }
    must(dem2d_shape_create_bezier(NULL, points, 4, &shape), "polybezier");
    return shape;
}

/* A shape of about unit radius, another one each time. */
PART dem2d_shape *random_model(int model) {
    enum { ORDER = 8 };
    static double grow = 0.3;
    double a[ORDER + 1], b[ORDER + 1];
    dem2d_virtual_desc desc = {0};
    dem2d_custom_desc custom = {0};
    dem2d_shape *shape;
    switch (model) {
    case K_CIRCLE:
        return make_disc(uniform(0.8, 1.2));
    case K_ELLIPSE:
        return make_ellipse(uniform(1, 1.5), 1);
    case K_POLYGON:
    case K_ROUNDED:
        return polygon(4 + random_below(&random_state, 4), model == K_ROUNDED ? 0.15 : 0);
    case K_BEZIER:
        return egg();
    case K_FOURIER:
        desc.radius = 1, desc.elongation = 0.1, desc.roundness = 0.04, desc.roughness = 0.01;
        desc.seed = random_bits(&random_state);
        must(dem2d_fourier_virtual(&desc, ORDER, a, b), "virtual grain");
        must(dem2d_shape_create_fourier(NULL, a, b, ORDER, &shape), "Fourier series");
        return shape;
    default:
        custom.support = grown_ellipse, custom.user = &grow;
        must(dem2d_shape_create_custom(NULL, &custom, &shape), "custom shape");
        return shape;
    }
}

/* --- a gas ----------------------------------------------------------------------------------- */

enum { GAS = 64, GAS_SIDE = 8, GAS_TEMPLATES = 16, GAS_STEPS = 1000000 };

/* 64 grains of equal area on a lattice that fills a box to 0.3, with velocities of one size: two
   that meet head on overlap by 0.1 % of the radius. */
PART scene open_gas(int model, int run, double steps_per_contact, dem2d_face_rule faces) {
    const double radius = 0.5, area = (double)PI * radius * radius, half_mass = DENSITY * area / 2;
    const double side = sqrt(GAS * area / 0.3), cell = side / GAS_SIDE;
    const double speed = 1e-3 * radius * sqrt(KN / half_mass) / 2;
    dem2d_world_desc desc = world_desc((double)PI * sqrt(half_mass / KN) / steps_per_contact);
    const dem2d_material_desc material = stone_desc(0, 0);
    dem2d_shape_id ids[GAS_TEMPLATES];
    double scale[GAS_TEMPLATES];
    desc.faces = faces, desc.contact_tolerance = 0;
    const scene s = open_scene(&desc, &material);
    random_state = 1 + (uint64_t)run;
    add_plane(&s, 0, 0, 1, 0), add_plane(&s, side, 0, -1, 0);
    add_plane(&s, 0, 0, 0, 1), add_plane(&s, 0, side, 0, -1);
    for (int i = 0; i < GAS_TEMPLATES; i++) {
        dem2d_shape *shape = random_model(model);
        dem2d_shape_info info;
        must(dem2d_shape_get(shape, &info), "shape");
        must(dem2d_world_add_shape(s.world, shape, &ids[i]), "shape");
        dem2d_shape_destroy(shape);
        scale[i] = radius / info.equivalent;
    }
    for (int i = 0; i < GAS; i++) {
        const double way = uniform(0, (double)(2 * PI));
        dem2d_particle_desc grain = {0};
        dem2d_particle_id id;
        grain.shape = ids[i % GAS_TEMPLATES], grain.scale = scale[i % GAS_TEMPLATES];
        grain.material = s.material, grain.angle = uniform(0, (double)(2 * PI));
        grain.position = vec((i % GAS_SIDE + 0.5) * cell, (i / GAS_SIDE + 0.5) * cell);
        grain.velocity = vec(speed * cos(way), speed * sin(way));
        grain.angular_velocity = uniform(-1, 1) * speed / radius;
        must(dem2d_world_add_particle(s.world, &grain, &id), "particle");
    }
    return s;
}

/* Change of the energy after about so many steps of t_c/200, or as long in others; read when no
   contact is open. It is then kinetic, and that of two successive half steps is the same. */
PART double gas_drift(int model, int run, double steps_per_contact, dem2d_face_rule faces,
                      double *overlap) {
    const scene s = open_gas(model, run, steps_per_contact, faces);
    const int64_t steps = (int64_t)(GAS_STEPS * (steps_per_contact / 200));
    double first = 0;
    int64_t done = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (; done < pass * steps; done += 500) {
            dem2d_packing packing;
            step(&s, 500);
            must(dem2d_world_packing(s.world, &packing), "packing");
            *overlap = fmax(*overlap, packing.max_overlap);
        }
        step(&s, 1);
        for (int i = 0; contacts_of(&s, NULL, 0) > 0; i++) {
            step(&s, 1);
            if (i > 1000000) fail(STATUS_FAILED, "a gas that is never without contacts");
        }
        const dem2d_energy e = energy_of(&s);
        if (pass == 0) first = kinetic(&e);
        if (pass == 1) first = kinetic(&e) / first - 1;
    }
    close_scene(&s);
    return first;
}

/* Root of the mean square over runs. */
PART double gas_drifts(int model, int runs, double steps_per_contact, dem2d_face_rule faces,
                       double *overlap) {
    double sum = 0;
    for (int run = 0; run < runs; run++) {
        const double drift = gas_drift(model, run, steps_per_contact, faces, overlap);
        sum += drift * drift / runs;
    }
    return sqrt(sum);
}

/* The order is the slope of log drift over log dt, from a 100th to a 400th of the contact time. */
PART void gas(int model, int runs) {
    static const double steps[3] = {100, 200, 400};
    double drift[3], overlap = 0;
    for (int i = 0; i < 3; i++)
        drift[i] = gas_drifts(model, runs, steps[i], DEM2D_TWO_POINTS, &overlap);
    const char *name = model_names[model];
    row_small(label("%s: energy drift in 1e6 steps of t_c/200", name), drift[1],
              model == K_POLYGON ? 1e-2 : 1e-4);
    if (model == K_POLYGON) { /* of few runs the hardest hit decides */
        double two = gas_drifts(model, 4 * runs, 200, DEM2D_TWO_POINTS, &overlap);
        double one = gas_drifts(model, 4 * runs, 200, DEM2D_ONE_POINT, &overlap);
        row_small(label("%s: no more than by the deepest vertex", name), two, one);
    } else {
        row_above(label("%s: order of the drift in dt", name), 1,
                  log(drift[0] / drift[2]) / log(4));
    }
    row_below(label("%s: greatest overlap/radius", name), 2e-3, overlap);
}

/* --- packings in a box ----------------------------------------------------------------------- */

enum { LEFT, RIGHT, BOTTOM, TOP, WALLS };

typedef struct packing {
    scene s;
    dem2d_material_id wall_material;
    dem2d_wall_id walls[WALLS]; /* generation 0: not there */
    dem2d_vec gravity;
    double width, height; /* of the box when it was made */
} packing;

PART dem2d_wall_desc box_wall(const packing *p, int which) {
    static const double normals[WALLS][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    dem2d_wall_desc desc = {0};
    desc.material = p->wall_material;
    desc.normal = vec(normals[which][0], normals[which][1]);
    desc.point = vec(which == RIGHT ? p->width : 0, which == TOP ? p->height : 0);
    if (p->walls[which].generation) desc.point = wall_of(&p->s, p->walls[which]).point;
    return desc;
}

/* Walls up to this one, in the order of their names. */
PART packing open_packing(const dem2d_world_desc *desc, const dem2d_material_desc *material,
                          double width, double height, int walls) {
    packing p;
    memset(&p, 0, sizeof p);
    p.s = open_scene(desc, material);
    must(dem2d_world_add_material(p.s.world, material, &p.wall_material), "material");
    p.width = width, p.height = height, p.gravity = desc->gravity;
    for (int i = 0; i < walls; i++) {
        const dem2d_wall_desc wall = box_wall(&p, i);
        must(dem2d_world_add_wall(p.s.world, &wall, &p.walls[i]), "wall");
    }
    return p;
}

PART void smooth_walls(const packing *p) {
    dem2d_pair_desc smooth = {0};
    smooth.normal_stiffness = KN;
    must(dem2d_world_set_pair(p->s.world, p->s.material, p->wall_material, &smooth), "friction");
}

/* A wall that is as long as two others are apart, and from now on holds a stress, or moves. */
PART void control_wall(packing *p, int which, dem2d_wall_mode mode, double value, double speed) {
    dem2d_wall_desc desc = box_wall(p, which);
    const int span = which == LEFT || which == RIGHT ? BOTTOM : LEFT;
    desc.mode = mode;
    if (mode == DEM2D_WALL_SERVO) desc.stress = value, desc.max_speed = speed;
    if (mode == DEM2D_WALL_MOVING)
        desc.velocity = vec(speed * desc.normal.x, speed * desc.normal.y);
    desc.spans[0] = p->walls[span], desc.spans[1] = p->walls[span + 1];
    must(dem2d_world_set_wall(p->s.world, p->walls[which], &desc), "wall");
}

/* The fourth wall, on the highest grain. */
PART void put_lid(packing *p) {
    int count;
    p->height = 0;
    dem2d_particle_id *ids = all_ids(&p->s, &count);
    for (int i = 0; i < count; i++) {
        const dem2d_particle_info info = grain_of(&p->s, ids[i]);
        dem2d_box b;
        must(dem2d_shape_aabb(dem2d_world_shape(p->s.world, info.shape), info.pose, &b), "box");
        p->height = fmax(p->height, b.upper.y);
    }
    free(ids);
    const dem2d_wall_desc lid = box_wall(p, TOP);
    must(dem2d_world_add_wall(p->s.world, &lid, &p->walls[TOP]), "wall");
}

PART dem2d_box inside(const packing *p) {
    dem2d_box b;
    b.lower = vec(wall_of(&p->s, p->walls[LEFT]).point.x, wall_of(&p->s, p->walls[BOTTOM]).point.y);
    b.upper = vec(wall_of(&p->s, p->walls[RIGHT]).point.x, wall_of(&p->s, p->walls[TOP]).point.y);
    return b;
}

/* Templates of these kinds at sizes whose circle of equal area has a diameter uniform in the range,
   placed at random without overlap in the box (which may grow). */
PART void fill(packing *p, int count, const bool kinds[KINDS], const char *path, double smallest,
               double largest) {
    const dem2d_image_desc search = default_search();
    template_set set = load_templates(path, &search, 0, false);
    dem2d_particle_desc *grains = draw_grains(p->s.world, p->s.material, count, kinds, smallest,
                                              largest, &set, &random_state);
    place_grains(p->s.world, grains, count, p->width, &p->height, random_state);
    free(grains);
    free_templates(&set);
}

/* Steps until what is unbalanced is below a bound, or this many were made. */
PART void settle(const packing *p, double bound, int most) {
    for (int done = 0; done < most; done += 500) {
        step(&p->s, 500);
        if (unbalanced(&p->s, p->gravity) < bound) return;
    }
}

/* Contacts of each particle, walls too, without those that fewer than `least` contacts hold, of
   what is left when such are taken away: -1 for them. The caller frees the counts. */
typedef struct backbone {
    int particles, contacts, wall_contacts; /* that are left */
} backbone;

PART backbone find_backbone(const packing *p, int least) {
    int count, touching;
    dem2d_particle_id *ids = all_ids(&p->s, &count);
    dem2d_contact_info *list = all_contacts(&p->s, &touching);
    uint32_t most = 0;
    for (int i = 0; i < count; i++) most = ids[i].index > most ? ids[i].index : most;
    int *degree = get_memory(NULL, (size_t)most + 1, sizeof *degree);
    bool *gone = get_memory(NULL, (size_t)most + 1, sizeof *gone);
    backbone b = {0, 0, 0};
    memset(gone, 0, ((size_t)most + 1) * sizeof *gone);
    for (bool changed = true; changed;) {
        changed = false;
        memset(degree, 0, ((size_t)most + 1) * sizeof *degree);
        b.contacts = b.wall_contacts = b.particles = 0;
        for (int i = 0; i < touching; i++) {
            const bool pair = list[i].b.generation != 0;
            if (gone[list[i].a.index] || (pair && gone[list[i].b.index])) continue;
            degree[list[i].a.index]++;
            if (pair) degree[list[i].b.index]++, b.contacts++;
            if (!pair) b.wall_contacts++;
        }
        for (int i = 0; i < count; i++) {
            if (gone[ids[i].index]) continue;
            b.particles++;
            if (degree[ids[i].index] < least) gone[ids[i].index] = changed = true;
        }
    }
    free(ids), free(list), free(degree), free(gone);
    return b;
}

/* Area of a disc on one side of a vertical line, x from its centre: to the left of it. */
PART double disc_left_of(double r, double x) {
    if (x >= r) return (double)PI * r * r;
    if (x <= -r) return 0;
    return r * r * (asin(x / r) + (double)PI / 2) + x * sqrt(r * r - x * x);
}

/* Area of a disc in a box, by strips across: Simpson's rule on the height of the part. */
PART double disc_in_box(dem2d_vec at, double r, const dem2d_box *b) {
    enum { STRIPS = 512 };
    const bool away = at.x + r <= b->lower.x || at.x - r >= b->upper.x || at.y + r <= b->lower.y ||
                      at.y - r >= b->upper.y;
    const bool across = at.x - r < b->lower.x || at.x + r > b->upper.x;
    const bool along = at.y - r < b->lower.y || at.y + r > b->upper.y;
    if (away) return 0;
    if (!along) return disc_left_of(r, b->upper.x - at.x) - disc_left_of(r, b->lower.x - at.x);
    if (!across) return disc_left_of(r, b->upper.y - at.y) - disc_left_of(r, b->lower.y - at.y);
    double sum = 0;
    for (int i = 0; i < STRIPS; i++) { /* in the angle, so that the ends are smooth */
        const double t = -(double)PI / 2 + (double)PI * (i + 0.5) / STRIPS, x = at.x + r * sin(t);
        if (x < b->lower.x || x > b->upper.x) continue;
        const double up = fmin(at.y + r * cos(t), b->upper.y);
        const double down = fmax(at.y - r * cos(t), b->lower.y);
        if (up > down) sum += (up - down) * r * cos(t) * (double)PI / STRIPS;
    }
    return sum;
}

/* Part of a region that discs cover. */
PART double disc_fraction(const scene *s, const dem2d_box *b) {
    int count;
    double sum = 0;
    dem2d_particle_id *ids = all_ids(s, &count);
    for (int i = 0; i < count; i++) {
        const dem2d_particle_info p = grain_of(s, ids[i]);
        sum += disc_in_box(p.pose.position, p.radius, b);
    }
    free(ids);
    return sum / ((b->upper.x - b->lower.x) * (b->upper.y - b->lower.y));
}

#endif
