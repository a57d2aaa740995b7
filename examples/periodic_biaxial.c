/* periodic_biaxial.c - the biaxial test of biaxial.c without walls, of the same grains:
   1. Filling        at random places in a square periodic cell, to a solid fraction of 0.45
   2. Consolidation  the cell holds 100 kPa along x and y until the grains are at rest
   3. Compression    the cell gets lower at a constant rate and holds 100 kPa along x
   `make periodic` draws the curves of both. Exit status: 0 if the stress is held and the grains
   bear what such grains do, 1 if not, 2 bad usage or input, 130 after Ctrl-C. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "grains.h"

static const char usage[] =
    "usage: periodic_biaxial [OPTION]...   options mean what they do for biaxial\n"
    "  --particles N   number of grains, 10 to 1000000 (500; 100 with --quick)\n"
    "  --seed S        same seed and options, same results; the grains of biaxial (1)\n"
    "  --shapes LIST   mixed, noncircular, or some of circle,ellipse,polygon,bezier,fs (mixed)\n"
    "  --grains PATH   bezier and fs grains from an outline, an image or a directory of them\n"
    "  --out DIR       for periodic.csv, periodic_packed.svg, periodic_final.svg (out)\n"
    "  --quick         less strain, faster\n";

static const double PRESSURE = 1e5; // Pa
enum { QUICK, PARTICLES, SEED, SHAPES, GRAINS, OUT, OPTIONS };
static const char *const option_names[OPTIONS] = {
    "--quick", "--particles=", "--seed=", "--shapes=", "--grains=", "--out="};

typedef struct test {
    int particles, steps, rows;
    uint64_t seed;
    bool quick, kinds[KINDS];
    const char *grains, *out;
    dem2d_world *world;
    dem2d_cell start; // at the end of consolidation; a.x = 0 before
    double strain, ratio, lateral;
    char *history; // path
    progress progress;
} test;

static test parse_options(int count, char **arguments) {
    test t = {.seed = 1, .out = "out"};
    parse_shapes("mixed", t.kinds);
    for (int i = 1; i < count; i++) {
        const char *name = arguments[i], *value;
        const int which = parse_option(count, arguments, &i, usage, option_names, OPTIONS, &value);
        if (which == QUICK) t.quick = true;
        if (which == PARTICLES) t.particles = (int)parse_integer(name, value, 10, 1000000);
        if (which == SEED) t.seed = parse_integer(name, value, 0, UINT64_MAX);
        if (which == SHAPES) parse_shapes(value, t.kinds);
        if (which == GRAINS) t.grains = value;
        if (which == OUT) t.out = value;
    }
    if (t.particles == 0) t.particles = t.quick ? 100 : 500;
    return t;
}

/* The materials and damping of biaxial.c. */
static void fill_cell(test *t, template_set *set) {
    const double side = sqrt(t->particles * 0.00198 / 0.45); // m; mean area of a grain
    const dem2d_world_desc scene = {.time_step = 1e-4,
                                    .local_damping = 0.7,
                                    .env = example_env(),
                                    .cell = {{side, 0}, {0, side}, {0, 0}}};
    const dem2d_material_desc stone = {2700, 1e7, 1e7, 0.2, .damping_ratio = 0};
    dem2d_material_id material;
    dem2d_filling filling;
    must(dem2d_world_create(&scene, &t->world), "world");
    must(dem2d_world_add_material(t->world, &stone, &material), "material");
    dem2d_particle_desc *grains =
        draw_grains(t->world, material, t->particles, t->kinds, 0.04, 0.06, set, &t->seed);
    dem2d_fill_desc fill = {.grains = grains, .count = t->particles, .seed = t->seed};
    fill.method = DEM2D_FILL_RANDOM; // in all of the cell: its region is zero
    must(dem2d_world_fill(t->world, &fill, NULL, 0, &filling), "filling");
    free(grains);
}

/* Steps, then reads the cell and writes a row with the columns of biaxial's history.csv; stages have
   their numbers there. */
static void take_steps(test *t, int count, int stage) {
    static const char *const names[] = {
        "stage",          "axial_stress", "lateral_stress",    "width",       "height",
        "solid_fraction", "axial_strain", "volumetric_strain", "stress_ratio"};
    dem2d_cell_info cell;
    dem2d_packing packing;
    must(dem2d_world_step(t->world, count, NULL), "step");
    must(dem2d_world_get_cell(t->world, &cell), "cell");
    must(dem2d_world_packing(t->world, &packing), "packing");
    double axial = cell.contact.yy + cell.kinetic.yy, width = cell.cell.a.x, volume = 0;
    t->lateral = cell.contact.xx + cell.kinetic.xx;
    t->ratio = (axial - t->lateral) / (axial + t->lateral);
    if (t->start.a.x > 0) {
        t->strain = dem2d_strain(cell.cell.b.y, t->start.b.y);
        volume = t->strain + dem2d_strain(width, t->start.a.x);
    }
    const double values[] = {stage,     axial,         t->lateral,
                             width,     cell.cell.b.y, packing.solid_area / cell.area,
                             t->strain, volume,        t->ratio};
    const dem2d_csv_desc row = {9, names, values, t->rows++ > 0, NULL, NULL};
    must(dem2d_world_write_csv(t->world, &row, t->history), "history");
    progress_show(&t->progress, stage == 1 ? "consolidation" : "compression", t->steps += count);
}

static void draw(const test *t, const char *name) {
    char *path = join_text(t->out, "/", name);
    must(dem2d_world_write_svg(t->world, &(dem2d_svg_desc){.force_chains = true}, path), name);
    free(path);
}

int main(int count, char **arguments) {
    enum { ROW = 100, LONGEST = 30000 };
    example_name = "periodic_biaxial";
    test t = parse_options(count, arguments);
    const dem2d_image_desc search = default_search();
    template_set set = load_templates(t.grains, &search, 0.7, false);
    const double last = t.quick ? 0.05 : 0.2, rate = 0.1; // strain; 1/s
    dem2d_deformation_desc deform = {
        .hold_xx = true, .stress_xx = PRESSURE, .hold_yy = true, .stress_yy = PRESSURE};
    dem2d_equilibrium now = {.unbalanced = 1};
    dem2d_cell_info cell;
    double peak = 0, worst = 0; // of q/p; of the lateral stress, its error
    make_directory(t.out);
    t.history = join_text(t.out, "/", "periodic.csv");
    fill_cell(&t, &set);
    free_templates(&set);
    catch_interrupt();
    progress_start(&t.progress, "steps", 5000 + last / (rate * 1e-4));
    must(dem2d_world_deform(t.world, &deform), "consolidation");
    while (!stop_asked && t.steps < LONGEST && now.unbalanced > 1e-3) {
        take_steps(&t, ROW, 1);
        must(dem2d_world_equilibrium(t.world, &now), "rest");
    }
    must(dem2d_world_get_cell(t.world, &cell), "cell");
    printf("consolidation_steps %d -\nconsolidated_ratio %.4f -\n", t.steps, t.ratio);
    draw(&t, "periodic_packed.svg");
    const bool packed = fabs(t.ratio) < 0.005 && fabs(t.lateral / PRESSURE - 1) < 0.005;
    t.start = cell.cell, deform.hold_yy = false, deform.stress_yy = 0, deform.yy = -rate;
    must(dem2d_world_deform(t.world, &deform), "compression");
    while (!stop_asked && t.strain < last) {
        take_steps(&t, ROW, 2);
        peak = fmax(peak, t.ratio);
        if (t.strain > 0.002) worst = fmax(worst, fabs(t.lateral / PRESSURE - 1));
    }
    progress_end(&t.progress);
    draw(&t, "periodic_final.svg");
    free(t.history);
    printf("peak_ratio %.4f -\nlast_ratio %.4f -\nlateral_error %.4f -\n", peak, t.ratio, worst);
    dem2d_world_destroy(t.world);
    if (stop_asked) return STATUS_STOPPED;
    const bool bears = peak > (t.quick ? 0.1 : 0.2) && peak < 0.6; // few grains, little strain
    return packed && worst < 0.1 && bears ? STATUS_OK : STATUS_FAILED;
}
