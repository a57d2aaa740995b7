/* incline.c - grains flow down a rough incline: discs on a floor of bumps, a chain that goes round
   the border of a cell that is periodic along x; their surface is free, and gravity is tilted. The
   inertial number I = rate sqrt(m/P) is then the same in all depths, so that the velocity falls by
   k z^1.5 from the surface to the depth z (Bagnold). At each angle the flow comes to a steady state
   and is averaged. At last the angle is below that of repose, and the flow stops. Fails unless the
   fit explains 98 % of the variance of the velocity, the pressure is the weight above to 3 % on
   average, shear stress over pressure the slope to 5 % (the rest accelerates the flow), I grows
   with the angle, and the grains come to rest. Units: the mean diameter, the mean mass, gravity;
   diameters 1 +- 0.2, friction 0.5, damping ratio 0.3, stiffness 1e4. Writes incline.csv and a
   picture of speeds, incline.svg; incline.gp draws the profiles.
       build/incline [--quick] [--out DIR] */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "program.h"

enum { ANGLES = 3, BUMP = 4, MOST = 16, LAYERS = 40 }; // BUMP: points of a bump

static const char usage[] = "usage: incline [options]\n"
                            "  --quick      96 grains for a short time, not 320\n"
                            "  --out DIR    folder for the files (out)\n"
                            "  --help       this text\n";
static const double degrees[ANGLES] = {24, 21, 10}; // in this order; the last is below repose
static const double pi = 3.14159265358979324, dt = 1e-3;

typedef struct incline {
    dem2d_world *world;
    dem2d_grid *grid;
    int columns, grains;
    double time; // of the mean; it takes four times as long to a steady state
    progress progress;
    double done;
    FILE *table;
} incline;

typedef struct layer {
    double z, speed, inertia, solid, weight, pressure, shear; // weight: of what is above
} layer;

/* A bump for each diameter, half as high; the last point is the first one, a cell further. */
static void add_floor(const incline *f, dem2d_material_id material) {
    static const double at[BUMP] = {0, 0.15, 0.5, 0.85}, high[BUMP] = {0, 0.35, 0.5, 0.35};
    dem2d_vec points[BUMP * MOST + 1];
    const dem2d_wall_desc floor = {
        .material = material, .points = points, .count = BUMP * f->columns + 1, .one_sided = true};
    dem2d_wall_id id;
    for (int i = 0; i < floor.count; i++)
        points[i] = (dem2d_vec){i / BUMP + at[i % BUMP], high[i % BUMP]};
    must(dem2d_world_add_wall(f->world, &floor, &id), "floor");
}

static void make(incline *f) {
    const dem2d_world_desc desc = {
        .time_step = dt, .env = example_env(), .cell = {.a = {f->columns, 0}}};
    const dem2d_material_desc stone = {4 / pi / 1.0133, 1e4, 5e3, 0.5,
                                       .damping_ratio = 0.3}; // mean square of the diameter
    const dem2d_grade sizes[2] = {{0.8, 0}, {1.2, 1}};
    const double high = (double)f->grains / f->columns;
    const dem2d_grid_desc layers = {.nx = 1,
                                    .ny = LAYERS,
                                    .box = {{0, 0}, {f->columns, 1.2 * high + 8}}, // some fly
                                    .width_y = 1,
                                    .periodic_x = true};
    dem2d_grain_kind kind = {.share = 1};
    dem2d_shape *disc;
    dem2d_filling filling;
    must(dem2d_world_create(&desc, &f->world), "world");
    must(dem2d_world_add_material(f->world, &stone, &kind.grain.material), "material");
    must(dem2d_shape_create_circle(example_env(), 1, &disc), "disc");
    must(dem2d_world_add_shape(f->world, disc, &kind.grain.shape), "template");
    dem2d_shape_destroy(disc);
    add_floor(f, kind.grain.material);
    const dem2d_grading_desc grading = {sizes, 2, &kind, 1, .measure = DEM2D_MEASURE_NUMBER};
    dem2d_fill_desc discs = {.grading = &grading, .count = f->grains, .seed = 1};
    discs.region.box = (dem2d_box){{0, 0.5}, {0, 0.5 + 1.7 * high}}; // all of the cell along x
    must(dem2d_world_fill(f->world, &discs, NULL, 0, &filling), "filling");
    must(dem2d_grid_create(example_env(), &layers, &f->grid), "layers");
}

/* Steps for a time; with `mean` their states are added to the layers. False after Ctrl-C. */
static bool pass(incline *f, const char *stage, double time, bool mean) {
    const int few = mean ? 20 : 100, steps = (int)(time / dt + 0.5);
    for (int i = 0; i < steps && !stop_asked; i += few) {
        must(dem2d_world_step(f->world, few, NULL), stage);
        if (mean) must(dem2d_grid_add(f->grid, f->world, 1), "layers");
        f->done += few * dt;
        progress_show(&f->progress, stage, f->done);
    }
    return !stop_asked;
}

/* Layers two diameters away from bumps and surface, from below. Depths are those at which a
   material as dense as the middle of the flow would have the weight of the grains above. */
static int read_layers(const incline *f, double cosine, layer layers[LAYERS]) {
    dem2d_average all[LAYERS];
    int count = 0, got;
    must(dem2d_grid_read(f->grid, all, LAYERS, &got), "layers");
    const double thick = all[1].centre.y - all[0].centre.y, rho = all[LAYERS / 4].density;
    for (int i = 1; i < LAYERS - 1; i++) {
        const double p = all[i].contact.yy + all[i].kinetic.yy;
        double above = all[i].density * thick / 2;
        for (int k = i + 1; k < LAYERS; k++) above += all[k].density * thick;
        if (all[i].centre.y < 2.5 || above / rho < 2) continue;
        const double rate = (all[i + 1].velocity.x - all[i - 1].velocity.x) / (2 * thick);
        layers[count++] = (layer){.z = above / rho,
                                  .speed = all[i].velocity.x,
                                  .inertia = rate / sqrt(p),
                                  .solid = all[i].solid_fraction,
                                  .weight = above * cosine,
                                  .pressure = p,
                                  .shear = -(all[i].contact.yx + all[i].kinetic.yx)};
    }
    return count;
}

/* Prints the profile beside speed = c - k z^1.5; the mean inertial number, 0 if a check fails. */
static double report(const incline *f, int angle) {
    const double slope = degrees[angle] * pi / 180;
    layer layers[LAYERS];
    const int count = read_layers(f, cos(slope), layers);
    double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, inertia = 0;
    double weight = 0, pressure = 0, shear = 0;
    for (int i = 0; i < count; i++) {
        const double s = layers[i].z * sqrt(layers[i].z), v = layers[i].speed;
        n += 1, x += s, y += v, xx += s * s, xy += s * v, yy += v * v;
        inertia += layers[i].inertia / count;
        weight += layers[i].weight, pressure += layers[i].pressure, shear += layers[i].shear;
    }
    const double k = -(xy - x * y / n) / (xx - x * x / n), c = (y + k * x) / n;
    const double part = k * k * (xx - x * x / n) / (yy - y * y / n);
    const double borne = pressure / weight, drag = shear / pressure / tan(slope);
    printf("%g degrees: I %.3f, pressure %.3f of the weight, friction %.3f of the slope\n"
           "  speed %.2f - %.4f z^1.5 explains %.2f %% of its variance\n"
           "%10s %9s %9s %9s %9s\n",
           degrees[angle], inertia, borne, drag, c, k, 100 * part, "depth z", "speed", "fit", "I",
           "solid");
    for (int i = count - 1; i >= 0; i--) {
        const layer *l = &layers[i];
        const double fit = c - k * l->z * sqrt(l->z);
        printf("%10.2f %9.3f %9.3f %9.4f %9.3f\n", l->z, l->speed, fit, l->inertia, l->solid);
        fprintf(f->table, "%g,%.6f,%.6f,%.6f,%.6f,%.6f\n", degrees[angle], l->z, l->speed, fit,
                l->inertia, l->solid);
    }
    return part > 0.98 && fabs(borne - 1) < 0.03 && fabs(drag - 1) < 0.05 ? inertia : 0;
}

/* Flows at one angle; false after Ctrl-C. *inertia is 0 if a check fails. */
static bool flow(incline *f, int angle, double *inertia, const char *picture) {
    const dem2d_svg_desc speeds = {.colour = DEM2D_COLOUR_SPEED};
    const double slope = degrees[angle] * pi / 180;
    const bool stops = angle == ANGLES - 1;
    dem2d_energy energy;
    char stage[32];
    snprintf(stage, sizeof stage, "%g degrees", degrees[angle]);
    must(dem2d_world_set_gravity(f->world, (dem2d_vec){sin(slope), -cos(slope)}), "gravity");
    must(dem2d_grid_reset(f->grid), "layers");
    if (!pass(f, stage, (stops ? 2 : 4) * f->time, false)) return false;
    if (!stops && !pass(f, stage, f->time, true)) return false;
    progress_end(&f->progress);
    if (angle == 0) must(dem2d_world_write_svg(f->world, &speeds, picture), picture);
    if (!stops) *inertia = report(f, angle);
    if (!stops) return true;
    must(dem2d_world_energy(f->world, &energy), "energy");
    const double kinetic = (energy.translational + energy.rotational) / f->grains;
    printf("%g degrees: at rest, kinetic energy %.1e of a grain\n", degrees[angle], kinetic);
    *inertia = kinetic < 1e-6 ? 1 : 0;
    return true;
}

int main(int count, char **arguments) {
    static const char *const all[] = {"--out=", "--quick"};
    incline f = {.columns = MOST, .grains = 320, .time = 60};
    const char *out = "out", *value;
    double inertia[ANGLES];
    bool on = true, right = true;
    draft table;
    example_name = "incline";
    for (int i = 1; i < count; i++) {
        const int which = parse_option(count, arguments, &i, usage, all, 2, &value);
        if (which == 0) out = value;
        if (which == 1) f.columns = 8, f.grains = 96, f.time = 40;
    }
    make_directory(out);
    char *picture = join_text(out, "/", "incline.svg"), *path = join_text(out, "/", "incline.csv");
    draft_open(&table);
    f.table = table.file;
    fprintf(f.table, "angle,z,speed,fit,I,solid_fraction\n");
    make(&f);
    catch_interrupt();
    progress_start(&f.progress, "units of time", (5 * ANGLES - 3) * f.time);
    for (int i = 0; i < ANGLES && on; i++) on = flow(&f, i, &inertia[i], picture);
    draft_write(&table, path);
    free(picture), free(path);
    dem2d_grid_destroy(f.grid);
    dem2d_world_destroy(f.world);
    if (!on) return STATUS_STOPPED;
    for (int i = 0; i < ANGLES; i++) right = right && inertia[i] > 0;
    for (int i = 0; i < ANGLES - 2; i++) right = right && inertia[i] > inertia[i + 1];
    if (!right) fprintf(stderr, "incline: a flow is not as it should be\n");
    return right ? STATUS_OK : STATUS_FAILED;
}
