/* biaxial_results.h - a run of biaxial as far as it has come, and what it tells: readings of the
   walls, the history, files of a state, the figures and whether they are what physics asks for. */
#ifndef DEM2D_EXAMPLES_BIAXIAL_RESULTS_H
#define DEM2D_EXAMPLES_BIAXIAL_RESULTS_H

#include "biaxial_options.h"
#include "near_pairs.h"
#include "statistics.h"

#include <float.h>

/* ---- the run ---- */

enum { TOP, BOTTOM, LEFT, RIGHT, WALLS };
enum { SETTLING, CONSOLIDATION, COMPRESSION };
static const char *const stage_names[] = {"settling", "consolidation", "compression"};
enum { FRAMES = 50 };

typedef struct job {
    plan plan;
    const options *options;
    dem2d_world *world;
    dem2d_material_id grain_material, wall_material;
    dem2d_wall_id walls[WALLS]; // TOP: generation 0 before consolidation
    draft history;
    int stage; // SETTLING, CONSOLIDATION, COMPRESSION
    progress progress;
    double seconds;         // of the whole run
    int steps;              // done
    int rows, bad_rows;     // of the history; bad: with a number that is not finite
    double width0, height0; // m, at the end of consolidation; 0 before
    double packed_ratio;    // stress ratio then
    dem2d_packing settled, packed;
    double porosity;
    double max_overlap; // over consolidation and compression
    double near_pairs, near_samples;
    double lateral_sum;   // Pa, over the steps after 0.1 % of strain
    double lateral_worst; // Pa, greatest error at any of them
    int lateral_steps;
    double block_sum; // stress ratio, summed over the present block of steps
    double *blocks;   // its mean over each block
    int block_count;
    double frame_times[FRAMES]; // s
    int frames;                 // of VTK
} job;

enum { BLOCK = 100 }; // steps of the compression averaged in one stress ratio

/* The walls at the last force pass. */
typedef struct reading {
    double stress[WALLS]; // Pa
    double axial, lateral, ratio;
    double width, height; // m; 0 while there is no top wall
    double strain;        // axial, compression positive
    double volume_strain;
} reading;

static reading read_walls(const job *j) {
    reading r = {{0}, 0, 0, 0, 0, 0, 0, 0};
    for (int w = 0; w < WALLS; w++) {
        if (j->walls[w].generation == 0) continue;
        dem2d_wall_info info;
        must(dem2d_world_get_wall(j->world, j->walls[w], &info), "wall");
        r.stress[w] = info.stress;
        if (w == BOTTOM) r.width = info.length;
        if (w == LEFT) r.height = info.length;
    }
    const bool closed = j->walls[TOP].generation != 0;
    r.axial = closed ? 0.5 * (r.stress[TOP] + r.stress[BOTTOM]) : r.stress[BOTTOM];
    r.lateral = 0.5 * (r.stress[LEFT] + r.stress[RIGHT]);
    if (r.axial + r.lateral > 0) r.ratio = (r.axial - r.lateral) / (r.axial + r.lateral);
    if (j->height0 > 0) {
        r.strain = dem2d_strain(r.height, j->height0);
        r.volume_strain = r.strain + dem2d_strain(r.width, j->width0);
    }
    return r;
}

/* ---- the history ---- */

static bool write_draft(void *user, const char *bytes, size_t count) {
    const draft *d = user;
    return fwrite(bytes, 1, count, d->file) == count;
}

/* The world's own columns, then those of the walls. Strains are 0 before the compression; stresses
   of walls without a length (the sides while settling) are 0. */
static void write_row(job *j, const reading *r) {
    static const char *const names[] = {
        "stage",         "axial_stress", "lateral_stress",    "top_stress",
        "bottom_stress", "left_stress",  "right_stress",      "width",
        "height",        "axial_strain", "volumetric_strain", "stress_ratio"};
    const double values[] = {j->stage,          r->axial,        r->lateral,       r->stress[TOP],
                             r->stress[BOTTOM], r->stress[LEFT], r->stress[RIGHT], r->width,
                             r->height,         r->strain,       r->volume_strain, r->ratio};
    dem2d_csv_desc row = {0};
    row.count = (int)(sizeof values / sizeof values[0]);
    row.names = names;
    row.values = values;
    row.append = j->rows > 0;
    row.write = write_draft;
    row.user = &j->history;
    const dem2d_result result = dem2d_world_write_csv(j->world, &row, NULL);
    if (result == DEM2D_NOT_FINITE)
        j->bad_rows++;
    else
        must(result, "history");
    j->rows++;
}

/* ---- files of a state ---- */

/* DIR/name.svg with the force chains, or without. */
static void draw(const job *j, const char *name, bool chains) {
    dem2d_svg_desc picture = {0};
    picture.force_chains = chains;
    char *path = join_text(j->options->out, "/", name), *aside = aside_name(path);
    const dem2d_result result = dem2d_world_write_svg(j->world, &picture, aside);
    if (result != DEM2D_IO) must(result, name);
    aside_finish(aside, result == DEM2D_OK);
    free(path);
}

static void write_out(const job *j, const char *name, draft *d) {
    char *path = join_text(j->options->out, "/", name);
    draft_write(d, path);
    free(path);
}

/* All histograms side by side: row i has the grains with i contacts, and those and the contacts
   whose direction is in part i of 36. */
static void write_histograms(const job *j, const char *name) {
    enum { BINS = 36 };
    static const char *const names[DEM2D_HISTOGRAM_COUNT] = {
        "coordination", "orientation",  "normal",          "branch_direction",
        "branch",       "normal_force", "tangential_force"};
    double values[DEM2D_HISTOGRAM_COUNT][BINS];
    draft d;
    draft_open(&d);
    fputs("bin", d.file);
    for (int k = 0; k < DEM2D_HISTOGRAM_COUNT; k++) {
        must(dem2d_world_histogram(j->world, (dem2d_histogram)k, BINS, values[k]), names[k]);
        fprintf(d.file, ",%s", names[k]);
    }
    for (int i = 0; i < BINS; i++) {
        fprintf(d.file, "\n%d", i);
        for (int k = 0; k < DEM2D_HISTOGRAM_COUNT; k++) fprintf(d.file, ",%.9g", values[k][i]);
    }
    fputc('\n', d.file);
    write_out(j, name, &d);
}

/* A file of each part for ParaView, numbered; the series are written at the end. */
static const dem2d_vtp_part vtk_parts[2] = {DEM2D_VTP_PARTICLES, DEM2D_VTP_CONTACTS};
static const char *const vtk_names[2] = {"particles", "contacts"};

static void write_frame(job *j) {
    if (j->frames == FRAMES) return;
    for (int k = 0; k < 2; k++) {
        char name[40];
        dem2d_vtp_desc desc = {0};
        desc.part = vtk_parts[k];
        snprintf(name, sizeof name, "vtk/%s_%02d.vtp", vtk_names[k], j->frames);
        char *path = join_text(j->options->out, "/", name);
        need(dem2d_world_write_vtp(j->world, &desc, path), STATUS_BAD_INPUT, path);
        free(path);
    }
    j->frame_times[j->frames++] = j->steps * j->plan.time_step;
}

static void write_series(const job *j) {
    char names[FRAMES][40];
    const char *files[FRAMES];
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < j->frames; i++) {
            snprintf(names[i], sizeof names[i], "vtk/%s_%02d.vtp", vtk_names[k], i);
            files[i] = names[i];
        }
        const dem2d_pvd_desc desc = {.count = j->frames, .times = j->frame_times, .files = files};
        char *folder = join_text(j->options->out, "/", vtk_names[k]);
        char *path = join_text(folder, ".", "pvd");
        need(dem2d_pvd_write(example_env(), &desc, path), STATUS_BAD_INPUT, path);
        free(path);
        free(folder);
    }
}

/* ---- what GJK and EPA do with the near pairs of a state ---- */

enum { RESIDUALS = 30 };

/* What GJK and EPA do with a pair whose bounding circles overlap, in a row: kinds, whether it is in
   contact, support calls of GJK from the line of centres; then the size that tolerances are
   relative to (m) and, of two in contact, the residual of EPA (m, as the papers define it) after 1,
   2, .. iterations. Cells are empty until GJK has found its simplex in as many iterations, and once
   EPA has ended. */
static void write_pair(FILE *file, const dem2d_world *world, const dem2d_particle_info *a,
                       const dem2d_particle_info *b) {
    const dem2d_shape *one = dem2d_world_shape(world, a->shape);
    const dem2d_shape *other = dem2d_world_shape(world, b->shape);
    const double dx = b->pose.position.x - a->pose.position.x;
    const double dy = b->pose.position.y - a->pose.position.y, reach = a->radius + b->radius;
    dem2d_shape_info info[2];
    dem2d_contact gjk, epa;
    must(dem2d_shape_get(one, &info[0]), "shape");
    must(dem2d_shape_get(other, &info[1]), "shape");
    must(dem2d_pair_overlap(one, a->pose, other, b->pose, NULL, &gjk), "overlap");
    const bool touch = gjk.state != DEM2D_SEPARATED;
    fprintf(file, "%d,%d,%d,%d,%.9g", (int)info[0].type, (int)info[1].type, touch,
            gjk.support_calls, reach + sqrt(dx * dx + dy * dy));
    bool done = !touch;
    for (int k = 1; k <= RESIDUALS; k++) {
        dem2d_contact_desc desc = {0};
        desc.solver = DEM2D_GJK_EPA;
        desc.tolerance = 1e-15;
        desc.max_iterations = k;
        fputc(',', file);
        if (done || k <= gjk.iterations) continue;
        must(dem2d_pair_contact(one, a->pose, other, b->pose, &desc, &epa), "contact");
        fprintf(file, "%.9g", epa.residual);
        done = epa.state != DEM2D_UNRESOLVED;
    }
    fputc('\n', file);
}

static void write_pairs(const job *j) {
    neighbours n = find_neighbours(j->world, j->plan.particles);
    draft d;
    draft_open(&d);
    fputs("a,b,contact,calls,size", d.file);
    for (int k = 1; k <= RESIDUALS; k++) fprintf(d.file, ",residual_%d", k);
    fputc('\n', d.file);
    for (int i = 0; i < n.count; i++)
        write_pair(d.file, j->world, &n.grains[n.pairs[i].a], &n.grains[n.pairs[i].b]);
    write_out(j, "pairs.csv", &d);
    free_neighbours(&n);
}

/* ---- results ---- */

/* How the grains carry the load at the end. */
typedef struct loading {
    dem2d_fabric fabric;
    double ratio; // q/p of the mean stress
    double shear; // N/m, mean size of shear forces
} loading;

static double stress_ratio(const dem2d_stress *stress) {
    dem2d_principal principal;
    must(dem2d_stress_principal(stress, &principal), "stress");
    return principal.p > 0 ? principal.q / principal.p : 0;
}

static loading measure_loading(const job *j) {
    loading l = {0};
    dem2d_stress stress;
    dem2d_stats stats;
    int count;
    const reading r = read_walls(j);
    must(dem2d_world_fabric(j->world, &l.fabric), "fabric");
    must(dem2d_world_stress(j->world, r.width * r.height, &stress), "stress");
    must(dem2d_world_stats(j->world, &stats), "stats");
    dem2d_contact_info *contacts = get_memory(NULL, (size_t)stats.contacts, sizeof *contacts);
    must(dem2d_world_contacts(j->world, contacts, stats.contacts, &count), "contacts");
    for (int i = 0; i < stats.contacts; i++)
        l.shear += fabs(contacts[i].tangential_force) / stats.contacts;
    l.ratio = stress_ratio(&stress);
    free(contacts);
    return l;
}

/* A figure for stdout; a check fails when it is outside its band. */
typedef struct figure {
    const char *name;
    double value;
    const char *unit;
    double full[2], quick[2];
} figure;

#define FINITE \
    { -DBL_MAX, DBL_MAX }

/* Of the pairs found in contact, those proved in a way. */
static double share(const dem2d_stats *stats, dem2d_proof proof) {
    const double found = (double)(stats->collisions - stats->separations);
    return found > 0 ? 100 * (double)stats->proofs[proof] / found : 0;
}

/* Prints figures and tells whether each lies in its band. */
static bool print_figures(const figure *figures, int count, bool quick) {
    bool good = true;
    for (int i = 0; i < count; i++) {
        const figure *f = &figures[i];
        const double *band = quick ? f->quick : f->full;
        printf("%s %.9g %s\n", f->name, f->value, f->unit);
        if (f->value >= band[0] && f->value <= band[1]) continue; // false for a NaN
        fprintf(stderr, "biaxial: check failed: %s is %.6g, not in %g to %g\n", f->name, f->value,
                band[0], band[1]);
        good = false;
    }
    return good;
}

/* Error of the ledger over the energy that gravity, walls and the start put in; 0 without one. */
static double ledger_closure(const job *j) {
    dem2d_ledger l;
    if (!keeps_ledger(j->options)) return 0;
    must(dem2d_world_ledger(j->world, &l), "ledger");
    return l.closure / (fabs(l.gravity) + fabs(l.walls) + fabs(l.given));
}

/* The plateau: the median stress ratio of the second half of the compression over the peak; a ratio
   that falls back is below the band. A mean, or a shorter part, would let one rearrangement of a
   small packing decide. Of 100 circles the peak itself is one such: of twenty seeds in each of four
   sets and both dampings the least of --quick is 0.27, of circles, else 0.72. It rises because it
   is about 0 at the end of consolidation. */
static double plateau_ratio(const job *j) {
    double peak = 0;
    for (int i = 0; i < j->block_count; i++) peak = fmax(peak, j->blocks[i]);
    double *late = j->blocks + j->block_count / 2;
    return median(late, j->block_count - j->block_count / 2) / peak;
}

/* Prints the figures and returns whether each lies in its band. */
static bool report(const job *j, const options *o, double strain) {
    const double steps = j->steps, particles = j->plan.particles;
    const double lateral = j->lateral_sum / j->lateral_steps; // NaN without steps
    /* weak global damping lets spikes of single steps ring on, when a contact slips or opens */
    const double worst = o->global_damping ? 15 : 5;
    /* and adds up the errors of contacts that swing in 16 steps */
    const double closes = o->global_damping ? DBL_MAX : 1e-3;
    double peak = 0;
    for (int i = 0; i < j->block_count; i++) peak = fmax(peak, j->blocks[i]);
    dem2d_stats stats;
    must(dem2d_world_stats(j->world, &stats), "stats");
    const double collisions = stats.collisions > 0 ? (double)stats.collisions : 1;
    const loading end = measure_loading(j);
    const dem2d_fabric *f = &end.fabric;
    const double degree = 3.141592653589793 / 180;
    const figure figures[] = {
        {"particles", particles, "-", FINITE, FINITE},
        {"steps", steps, "-", FINITE, FINITE},
        {"elapsed_seconds", j->seconds, "s", FINITE, FINITE},
        {"ns_per_particle_step", 1e9 * j->seconds / steps / particles, "ns", FINITE, FINITE},
        {"memory_per_particle", (double)stats.bytes / particles, "B", FINITE, FINITE},
        {"coordination_settled", j->settled.coordination, "-", FINITE, FINITE},
        {"coordination_number", j->packed.coordination, "-", {3, 5}, {2.5, 5.5}},
        {"porosity_packed", j->porosity, "-", FINITE, FINITE},
        {"mean_overlap_over_radius", j->packed.mean_overlap, "-", {0.01, 0.04}, {0.005, 0.06}},
        {"max_overlap_over_radius", j->max_overlap, "-", {0, 0.35}, {0, 0.45}},
        {"packed_stress_ratio", j->packed_ratio, "-", {-0.05, 0.05}, {-0.1, 0.1}},
        {"lateral_stress_mean_kpa", lateral / 1000, "kPa", {99.5, 100.5}, {97, 103}},
        {"lateral_stress_max_error_percent",
         100 * j->lateral_worst / STRESS,
         "%",
         {0, worst},
         {0, 15}},
        {"peak_stress_ratio", peak, "-", {0.1, 0.7}, {0.1, 0.7}},
        {"plateau_over_peak", plateau_ratio(j), "-", {0.6, 1.01}, {0.25, 1.01}},
        {"axial_strain_final", strain, "-", {0.001, 2}, {0.001, 2}},
        {"axial_strain_final_engineering", 1 - read_walls(j).height / j->height0, "-", FINITE,
         FINITE},
        {"final_stress_ratio", end.ratio, "-", FINITE, FINITE},
        {"final_stress_ratio_foretold", f->stress_ratio, "-", FINITE, FINITE},
        {"anisotropy_normals", f->normals.coefficient, "-", FINITE, FINITE},
        {"direction_normals", f->normals.direction / degree, "degrees", FINITE, FINITE},
        {"anisotropy_branches", f->branches.coefficient, "-", FINITE, FINITE},
        {"anisotropy_normal_forces", f->normal_forces.coefficient, "-", FINITE, FINITE},
        {"direction_normal_forces", f->normal_forces.direction / degree, "degrees", FINITE, FINITE},
        {"anisotropy_shear_forces", f->tangential_forces.coefficient, "-", FINITE, FINITE},
        {"mean_normal_force", f->mean_force, "N/m", FINITE, FINITE},
        {"mean_shear_force", end.shear, "N/m", FINITE, FINITE},
        {"collisions_per_step", (double)stats.collisions / steps, "-", FINITE, FINITE},
        {"support_calls_per_collision", (double)stats.support_calls / collisions, "-", FINITE,
         FINITE},
        {"near_pairs_skipped_percent",
         j->near_pairs > 0
             ? 100 - 100 * (double)stats.separations / steps * j->near_samples / j->near_pairs
             : 0,
         "%", FINITE, FINITE},
        {"proved_by_form_percent", share(&stats, DEM2D_BY_FORM), "%", FINITE, FINITE},
        {"proved_by_radius_percent", share(&stats, DEM2D_BY_RADIUS), "%", FINITE, FINITE},
        {"proved_by_arc_percent", share(&stats, DEM2D_BY_ARC), "%", FINITE, FINITE},
        {"proved_by_polytope_percent", share(&stats, DEM2D_BY_POLYTOPE), "%", FINITE, FINITE},
        {"contacts_not_converged", (double)stats.not_converged, "-", {0, 0}, {0, 0}},
        {"rows_not_finite", j->bad_rows, "-", {0, 0}, {0, 0}},
        {"ledger_closure", ledger_closure(j), "-", {-closes, closes}, {-closes, closes}},
    };
    return print_figures(figures, (int)(sizeof figures / sizeof figures[0]), o->quick);
}

#endif
