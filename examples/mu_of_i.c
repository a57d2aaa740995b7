/* mu_of_i.c - friction and solid fraction by the inertial number I = rate sqrt(m/P), of discs and
   of real grains: a periodic cell without walls, sheared at a constant normal stress P. First a gas
   is pressed to a packing. Circles of equal area have diameters of 1 +- 0.2 and the mass m on
   average; friction 0.4, damping ratio 0.591, stiffness 1e4 P. Errors are those of the mean of ten
   parts of the time. Writes mu_of_i.csv, and a picture of each packing sheared at I = 0.01;
   mu_of_i.gp draws the curves.
       build/mu_of_i                     100 grains, a strain of 2 at each I
       build/mu_of_i --grains PATH       grains modelled on your outlines or photographs
       build/mu_of_i --help */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "grains.h"

enum { PARTS = 10, SAMPLES = 40 }; // of the time of shear; of a part
enum { RATES = 3, KINDS_OF_GRAINS = 2 };

static const char usage[] =
    "usage: mu_of_i [options]\n"
    "Shears discs and real grains at a constant normal stress, at I = 0.01, 0.03, 0.1.\n"
    "  --particles N     number of grains of each sample, 16 to 100000 (100)\n"
    "  --strain S        shear strain that is measured, 0.1 to 1000 (2), after a third of it\n"
    "  --seed S          of the random numbers (1)\n"
    "  --grains PATH     an image (PBM, PGM), an outline (CSV, first line \"x,y\") or a folder of\n"
    "                    such files; without it grains that are drawn here\n"
    "  --out DIR         folder for the files (out)\n"
    "  --quick           36 grains, a strain of 0.4\n"
    "  --help            this text\n";

typedef struct options {
    int particles;
    double strain;
    uint64_t seed;
    const char *grains, *out;
} options;

static const char *const names[KINDS_OF_GRAINS] = {"discs", "grains"};
static const double numbers[RATES] = {0.01, 0.03, 0.1};
static const double pi = 3.14159265358979324, stiffness = 1e4; // P = 1, m = 1, diameter 1
static const double dt = 0.12 / 100;                           // 0.12 sqrt(m/kn)
static const double settling = 30;                             // time to a packing at rest

static options parse_options(int count, char **arguments) {
    static const char *const all[] = {
        "--particles=", "--strain=", "--seed=", "--grains=", "--out=", "--quick"};
    options o = {0, 0, 1, NULL, "out"};
    bool quick = false;
    for (int i = 1; i < count; i++) {
        const char *name = arguments[i], *value;
        const int which = parse_option(count, arguments, &i, usage, all, 6, &value);
        if (which == 0) o.particles = (int)parse_integer(name, value, 16, 100000);
        if (which == 1) o.strain = parse_real(name, value, 0.1, 1000);
        if (which == 2) o.seed = parse_integer(name, value, 0, UINT64_MAX);
        if (which == 3) o.grains = value;
        if (which == 4) o.out = value;
        if (which == 5) quick = true;
    }
    if (o.particles == 0) o.particles = quick ? 36 : 100;
    if (o.strain == 0) o.strain = quick ? 0.4 : 2;
    return o;
}

/* ---- a gas of grains ---- */

/* Grains at random places fill two fifths of the cell, with slow random velocities. */
static dem2d_world *make_gas(const options *o, template_set *set, const bool kinds[KINDS]) {
    const double side = sqrt(o->particles * (pi / 4 * 1.0133) / 0.4); // mean square of the diameter
    const dem2d_world_desc desc = {
        .time_step = dt, .env = example_env(), .cell = {{side, 0}, {0, side}, {0, 0}}};
    const dem2d_material_desc stone = {.density = 4 / pi,
                                       .normal_stiffness = stiffness,
                                       .tangential_stiffness = stiffness / 2,
                                       .friction = 0.4,
                                       .damping_ratio = 0.591};
    uint64_t random = o->seed;
    dem2d_material_id material;
    dem2d_filling filling;
    dem2d_world *world;
    must(dem2d_world_create(&desc, &world), "world");
    must(dem2d_world_add_material(world, &stone, &material), "material");
    dem2d_particle_desc *grains =
        draw_grains(world, material, o->particles, kinds, 0.8, 1.2, set, &random);
    for (int i = 0; i < o->particles; i++) {
        grains[i].velocity.x = random_between(&random, -0.1, 0.1);
        grains[i].velocity.y = random_between(&random, -0.1, 0.1);
    }
    dem2d_fill_desc fill = {.grains = grains, .count = o->particles, .seed = o->seed};
    fill.method = DEM2D_FILL_RANDOM; // in all of the cell: its region is zero
    must(dem2d_world_fill(world, &fill, NULL, 0, &filling), "filling");
    free(grains);
    return world;
}

/* ---- press, shear ---- */

typedef struct job {
    const options *options;
    progress progress;
    double done;   // time, of all samples
    FILE *results; // a table
} job;

/* false after Ctrl-C */
static bool pass(job *j, dem2d_world *world, const char *stage, double time) {
    must(dem2d_world_step(world, (int)(time / dt + 0.5), NULL), stage);
    j->done += time;
    progress_show(&j->progress, stage, j->done);
    return !stop_asked;
}

/* Mean and its error from the means of the parts. */
typedef struct mean {
    double value, error;
} mean;

static mean mean_of(const double parts[PARTS]) {
    mean m = {0, 0};
    for (int k = 0; k < PARTS; k++) m.value += parts[k] / PARTS;
    for (int k = 0; k < PARTS; k++)
        m.error += (parts[k] - m.value) * (parts[k] - m.value) / (PARTS * (PARTS - 1));
    m.error = sqrt(m.error);
    return m;
}

/* Shears at a rate. mu is the shear stress over P, phi the solid fraction; false after Ctrl-C. */
static bool shear(job *j, dem2d_world *world, double rate, mean *mu, mean *phi) {
    const dem2d_deformation_desc at = {.xy = rate, .hold_yy = true, .stress_yy = 1};
    const double time = j->options->strain / rate;
    double ratio[PARTS] = {0}, solid[PARTS] = {0};
    dem2d_packing packing;
    dem2d_cell_info cell;
    char stage[32];
    snprintf(stage, sizeof stage, "I = %g", rate);
    must(dem2d_world_deform(world, &at), "shear");
    for (int k = 0; k < SAMPLES; k++) // not measured: the packing comes into the flow
        if (!pass(j, world, stage, time / 3 / SAMPLES)) return false;
    must(dem2d_world_packing(world, &packing), "packing");
    for (int k = 0; k < PARTS * SAMPLES; k++) {
        if (!pass(j, world, stage, time / (PARTS * SAMPLES))) return false;
        must(dem2d_world_get_cell(world, &cell), "cell");
        ratio[k / SAMPLES] -= (cell.contact.yx + cell.kinetic.yx) / SAMPLES;
        solid[k / SAMPLES] += packing.solid_area / cell.area / SAMPLES;
    }
    *mu = mean_of(ratio);
    *phi = mean_of(solid);
    return true;
}

static void draw(const job *j, const dem2d_world *world, const char *name) {
    const dem2d_svg_desc with_forces = {.force_chains = true};
    char *path = join_text(j->options->out, "/mu_of_i_", name), *file = join_text(path, "", ".svg");
    must(dem2d_world_write_svg(world, &with_forces, file), file);
    free(path);
    free(file);
}

/* Friction at the three rates in mu; false after Ctrl-C. */
static bool run(job *j, template_set *set, int kind, mean mu[RATES]) {
    const bool kinds[KINDS] = {[CIRCLE] = kind == 0, [BEZIER] = kind == 1};
    const dem2d_deformation_desc press = {
        .hold_xx = true, .hold_yy = true, .stress_xx = 1, .stress_yy = 1};
    dem2d_world *world = make_gas(j->options, set, kinds);
    dem2d_packing packing;
    must(dem2d_world_deform(world, &press), "pressure");
    bool on = true;
    for (int k = 0; k < 100 && on; k++) on = pass(j, world, "pressing a gas", settling / 100);
    must(dem2d_world_packing(world, &packing), "packing");
    progress_end(&j->progress);
    printf("%d %s at rest: coordination number %.2f without rattlers\n", j->options->particles,
           names[kind], packing.coordination_loaded);
    for (int k = 0; k < RATES && on; k++) {
        mean phi;
        on = shear(j, world, numbers[k], &mu[k], &phi);
        progress_end(&j->progress);
        if (!on) break;
        printf("  I = %-5g mu %.4f +- %.4f, solid fraction %.4f +- %.4f\n", numbers[k], mu[k].value,
               mu[k].error, phi.value, phi.error);
        fprintf(j->results, "%s,%g,%.6f,%.6f,%.6f,%.6f\n", names[kind], numbers[k], mu[k].value,
                mu[k].error, phi.value, phi.error);
        if (k == 0) draw(j, world, names[kind]);
    }
    dem2d_world_destroy(world);
    return on;
}

int main(int count, char **arguments) {
    example_name = "mu_of_i";
    const options o = parse_options(count, arguments);
    const dem2d_image_desc search = {0};
    template_set set = load_templates(o.grains, &search, 0.7, false);
    mean mu[KINDS_OF_GRAINS][RATES];
    job j = {0};
    double sheared = 0;
    draft table;
    make_directory(o.out);
    for (int k = 0; k < RATES; k++) sheared += o.strain * 4 / 3 / numbers[k];
    j.options = &o;
    draft_open(&table);
    j.results = table.file;
    fprintf(table.file, "sample,I,mu,mu_error,phi,phi_error\n");
    catch_interrupt();
    progress_start(&j.progress, "units of time", KINDS_OF_GRAINS * (settling + sheared));
    const bool finished = run(&j, &set, 0, mu[0]) && run(&j, &set, 1, mu[1]);
    char *path = join_text(o.out, "/", "mu_of_i.csv");
    draft_write(&table, path);
    free(path);
    free_templates(&set);
    if (!finished) return STATUS_STOPPED;
    bool right = true; // discs: about 0.28 to 0.39; angular grains bear more
    for (int i = 0; i < KINDS_OF_GRAINS; i++)
        for (int k = 0; k < RATES; k++)
            right = right && mu[i][k].value > 0.1 && mu[i][k].value < 0.8;
    if (!right) fprintf(stderr, "mu_of_i: a friction is not as it should be\n");
    return right ? STATUS_OK : STATUS_FAILED;
}
