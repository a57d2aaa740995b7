/* silo.c - fields of grains in a silo. The floor sinks slowly, so that friction at the walls
   carries the grains: the vertical stress saturates as Janssen's formula says,
       s = rho g l (1 - exp(-z/l)),  l = W / (2 mu K),
   with density, friction mu at the wall and pressure ratio K measured in the same fields. Then the
   floor opens and the grains flow out: the fields obey the balance of momentum,
       dp/dt + div(rho V V + kinetic + contact) = rho g + boundary,
   the better the wider they are smoothed. Fails unless both hold. Writes silo.csv, silo.vti and,
   of the flow with colours by speed, silo.svg. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DISCS = 980, LAYERS = 40, SIDE = 40, CELLS = SIDE * SIDE, WIDTHS = 3, SILOS = 4 };

static const double width = 0.35, size = 0.02, gravity = 9.81, dt = 1e-4; /* size: of a grain */

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "silo: %s\n", dem2d_result_text(result));
    exit(1);
}

typedef struct silo {
    dem2d_world *world;
    dem2d_material_id material;
    dem2d_wall_id floor;
} silo;

static dem2d_wall_id add_wall(const silo *s, dem2d_wall_desc desc) {
    dem2d_wall_id id;
    desc.material = s->material;
    check(dem2d_world_add_wall(s->world, &desc, &id));
    return id;
}

static void step(const silo *s, double seconds) {
    check(dem2d_world_step(s->world, (int)(seconds / dt + 0.5), NULL));
}

/* Discs of 16 to 24 mm that have come to rest between two walls. */
static silo fill(uint64_t seed) {
    const dem2d_world_desc desc = {.time_step = dt, .gravity = {0, -gravity}, .local_damping = 0.5};
    const dem2d_material_desc stone = {
        2700, 1e6, 5e5, 0.5, .damping_ratio = 0.3, .rolling_friction = 0.3};
    const dem2d_grade sizes[2] = {{0.8 * size, 0}, {1.2 * size, 1}};
    dem2d_grain_kind kind = {.share = 1};
    dem2d_filling filling;
    silo s;
    dem2d_shape *disc;
    check(dem2d_world_create(&desc, &s.world));
    check(dem2d_world_add_material(s.world, &stone, &s.material));
    check(dem2d_shape_create_circle(NULL, 1, &disc));
    check(dem2d_world_add_shape(s.world, disc, &kind.grain.shape));
    dem2d_shape_destroy(disc);
    (void)add_wall(&s, (dem2d_wall_desc){.normal = {1, 0}});
    (void)add_wall(&s, (dem2d_wall_desc){.normal = {-1, 0}, .point = {width, 0}});
    s.floor = add_wall(&s, (dem2d_wall_desc){.normal = {0, 1}});
    kind.grain.material = s.material;
    const dem2d_grading_desc grading = {sizes, 2, &kind, 1, .measure = DEM2D_MEASURE_NUMBER};
    dem2d_fill_desc discs = {.grading = &grading, .count = DISCS, .seed = seed};
    discs.region.box.upper = (dem2d_vec){width, 1.8};
    check(dem2d_world_fill(s.world, &discs, NULL, 0, &filling));
    step(&s, 1.5);
    check(dem2d_world_set_damping(s.world, 0, 0)); /* a force that no field has */
    return s;
}

static dem2d_grid *new_grid(dem2d_grid_desc desc) {
    dem2d_grid *grid;
    check(dem2d_grid_create(NULL, &desc, &grid));
    return grid;
}

/* A profile: layers of two cells, one at each wall, sharp along x, so that nothing is lost at the
   walls, and smoothed along y. */
static dem2d_grid *new_profile(void) {
    return new_grid((dem2d_grid_desc){
        .nx = 2, .ny = LAYERS, .box = {{-0.01, 0}, {width + 0.01, 1.2}}, .width_y = 2 * size});
}

/* Adds the states while the floor sinks to the profile. */
static void sink(const silo *s, dem2d_grid *profile) {
    check(dem2d_world_drive_wall(s->world, s->floor, (dem2d_vec){0, -0.05}, 0));
    step(s, 1);
    for (int i = 0; i < 100; i++) {
        step(s, 0.01);
        check(dem2d_grid_add(profile, s->world, 1));
    }
}

/* Measures K and mu where the grains are deep, and compares stress and formula there. */
static bool compare_janssen(const dem2d_average layers[2 * LAYERS]) {
    const double cells = width + 0.02, high = 1.2 / LAYERS;
    double lift = 0, push = 0, stress = 0, mass = 0, rho = 0, worst = 0;
    int deep = 0;
    for (int j = LAYERS / 6; j < LAYERS / 2; j++, deep++) {
        const dem2d_average *left = &layers[2 * j], *right = left + 1;
        lift += left->boundary.y + right->boundary.y, push += left->boundary.x - right->boundary.x;
        stress += (left->contact.yy + right->contact.yy) / 2 * cells / width;
        rho += (left->density + right->density) / 2 * cells / width;
    }
    const double mu = lift / push, k = push / 2 * (cells / 2) / stress;
    const double length = width / (2 * mu * k);
    rho /= deep, stress /= deep;
    printf("floor sinks: mu %.2f (of the material 0.50), K %.2f, decay length %.2f widths\n", mu, k,
           length / width);
    printf("%8s %12s %12s %12s\n", "depth", "vertical", "Janssen", "hydrostatic");
    for (int j = LAYERS - 1; j >= LAYERS / 6; j--) {
        const dem2d_average *left = &layers[2 * j], *right = left + 1;
        const double here = (left->contact.yy + right->contact.yy) / 2 * cells / width;
        const double here_mass = (left->density + right->density) / 2 * cells * high;
        const double z = (mass + here_mass / 2) / (rho * width);
        mass += here_mass;
        const double law = rho * gravity * length * (1 - exp(-z / length));
        if (z > width) worst = fmax(worst, fabs(here / law - 1));
        if (j % 4 == 0 && z > size)
            printf("%6.2f m %9.0f Pa %9.0f Pa %9.0f Pa\n", z, here, law, rho * gravity * z);
    }
    printf("below a depth of one width within %.1f %% of the formula\n\n", 100 * worst);
    return worst < 0.1 && mu > 0.3 && mu < 0.51;
}

/* --- flow -------------------------------------------------------------------------------------
 */

/* Forces per area that a cell's neighbours bring to it: central differences, along x and y. */
static dem2d_vec divergence(const dem2d_average *cell, double side) {
    const dem2d_average *around[4] = {cell + 1, cell - 1, cell + SIDE, cell - SIDE};
    dem2d_vec sum = {0, 0};
    for (int k = 0; k < 4; k++) {
        const dem2d_average *c = around[k];
        const double sign = (k % 2 ? -1 : 1) / (2 * side);
        const double through = c->density * (k < 2 ? c->velocity.x : c->velocity.y);
        const dem2d_stress *m = &c->kinetic, *f = &c->contact;
        sum.x += sign * (through * c->velocity.x + (k < 2 ? m->xx + f->xx : m->yx + f->yx));
        sum.y += sign * (through * c->velocity.y + (k < 2 ? m->xy + f->xy : m->yy + f->yy));
    }
    return sum;
}

/* What the balance leaves, over the weight: root mean squares over the inner cells. */
static double imbalance(const dem2d_average *mean, const dem2d_average *first,
                        const dem2d_average *last, double seconds, double side) {
    double rest = 0, weight = 0;
    for (int i = SIDE; i < CELLS - SIDE; i++) {
        if (i % SIDE == 0 || i % SIDE == SIDE - 1) continue;
        const dem2d_vec flux = divergence(&mean[i], side);
        const double w = mean[i].density * gravity;
        const double x =
            (last[i].momentum.x - first[i].momentum.x) / seconds + flux.x - mean[i].boundary.x;
        const double y =
            (last[i].momentum.y - first[i].momentum.y) / seconds + flux.y + w - mean[i].boundary.y;
        rest += x * x + y * y, weight += w * w;
    }
    return sqrt(rest / weight);
}

static void read_now(const silo *s, dem2d_grid *grid, dem2d_average *cells) {
    int count;
    check(dem2d_grid_reset(grid));
    check(dem2d_grid_add(grid, s->world, 1));
    check(dem2d_grid_read(grid, cells, CELLS, &count));
}

/* Opens the floor and averages the flow around the opening, with smoothing over 3, 6 and 12 cells
   of half a grain. */
static bool flow(const silo *s) {
    enum { STEPS = 1000, EVERY = 4 };
    static dem2d_average first[WIDTHS][CELLS], last[CELLS], mean[CELLS];
    dem2d_grid *sums[WIDTHS], *now[WIDTHS];
    dem2d_wall_info floor;
    double rest[WIDTHS];
    const double side = size / 2;
    int count;
    check(dem2d_world_get_wall(s->world, s->floor, &floor));
    const double y = floor.point.y;
    check(dem2d_world_remove_wall(s->world, s->floor));
    for (int i = 0; i < 2; i++) {
        const double from = i ? width : 0, to = width / 2 + (i ? 0.08 : -0.08);
        (void)add_wall(s, (dem2d_wall_desc){.segment = true, .point = {from, y}, .end = {to, y}});
    }
    step(s, 0.5);
    for (int k = 0; k < WIDTHS; k++) {
        dem2d_grid_desc desc = {.nx = SIDE, .ny = SIDE};
        desc.box.lower.x = width / 2 - side * SIDE / 2, desc.box.lower.y = y - 0.1;
        desc.box.upper.x = width / 2 + side * SIDE / 2, desc.box.upper.y = y - 0.1 + side * SIDE;
        desc.width_x = desc.width_y = 3 * side * (1 << k);
        sums[k] = new_grid(desc), now[k] = new_grid(desc);
        read_now(s, now[k], first[k]);
    }
    for (int i = 0; i <= STEPS; i += EVERY) { /* the trapezoidal rule */
        for (int k = 0; k < WIDTHS; k++)
            check(dem2d_grid_add(sums[k], s->world, i == 0 || i == STEPS ? 0.5 : 1));
        if (i < STEPS) check(dem2d_world_step(s->world, EVERY, NULL));
    }
    printf("floor open: what is left of the balance of momentum, over the weight\n");
    for (int k = 0; k < WIDTHS; k++) {
        read_now(s, now[k], last);
        check(dem2d_grid_read(sums[k], mean, CELLS, &count));
        rest[k] = imbalance(mean, first[k], last, STEPS * dt, side);
        printf("smoothed over %2d cells  %.4f\n", 3 << k, rest[k]);
        if (k == 1) check(dem2d_grid_write_vti(sums[k], NULL, "silo.vti"));
        dem2d_grid_destroy(sums[k]), dem2d_grid_destroy(now[k]);
    }
    dem2d_svg_desc picture = {.colour = DEM2D_COLOUR_SPEED, .high = 2, .force_chains = true};
    picture.view.lower = (dem2d_vec){-0.1, y - 0.4};
    picture.view.upper = (dem2d_vec){width + 0.1, y + 0.7};
    check(dem2d_world_write_svg(s->world, &picture, "silo.svg"));
    return rest[2] < 0.05 && rest[1] < 0.5 * rest[0] && rest[2] < 0.5 * rest[1];
}

int main(void) {
    static dem2d_average layers[2 * LAYERS];
    dem2d_grid *profile = new_profile();
    int count;
    silo s = {0};
    for (int i = 0; i < SILOS; i++) { /* of all, the mean */
        dem2d_world_destroy(s.world);
        s = fill((uint64_t)i);
        sink(&s, profile);
    }
    check(dem2d_grid_read(profile, layers, 2 * LAYERS, &count));
    check(dem2d_grid_write_csv(profile, NULL, "silo.csv"));
    dem2d_grid_destroy(profile);
    const bool janssen = compare_janssen(layers), balance = flow(&s);
    dem2d_world_destroy(s.world);
    return janssen && balance ? 0 : 1;
}
