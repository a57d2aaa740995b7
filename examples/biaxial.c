/* biaxial.c - 500 grains of five shapes are packed, consolidated and sheared: the biaxial test of
   the papers on polybezier and Fourier-series grains.

       make build && build/biaxial              (about a minute; results in out/)
       build/biaxial --grains PATH              grains modelled on your outlines or photographs
       build/biaxial --help

   1. Settling      Grains are placed at random without overlap in a box 1.0 x 3.0 m (higher in
                    proportion for more than 500) and fall; all friction 0.2.
   2. Consolidation No gravity, walls frictionless (the papers keep friction there, and do not
                    say whether gravity: --wall-friction, --gravity). A top wall is put on the
                    highest grain; top, left and right wall move so that each presses with 100 kPa.
   3. Compression   The top wall goes down at a constant speed; left and right hold 100 kPa.

   The papers are [P] and [F] as the manual in dem2d.h cites them.

   Then the figures go to stdout ("name value unit"), and the exit status tells whether they are
   what physics asks for: 0 yes, 1 no (stderr names the check), 2 bad usage or input. After Ctrl-C
   what there is gets written; exit status 130. history.csv has no clock in it: the same options
   give the same bytes, whatever the compiler. `make figures` draws what is in the files.
*/
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "grains.h"
#include "statistics.h"

#include <float.h>

static const char usage[] =
    "usage: biaxial [options]\n"
    "Packs grains under gravity, consolidates them at 100 kPa and compresses them.\n"
    "  --particles N     number of grains, 10 to 1000000 (500; with --quick 100)\n"
    "  --seed S          of the random numbers, 0 to 2^64 - 1 (1)\n"
    "  --shapes SET      mixed (all five), noncircular (ellipse, polygon, bezier), or a\n"
    "                    comma-separated list of circle, ellipse, polygon, bezier, fs (mixed)\n"
    "  --damping KIND    local (Cundall, 0.7: [P]) or global (viscous, 0.7 1/s: [F]) (local)\n"
    "  --restitution E   of head-on collisions, 0.01 to 1: below 1 contacts have a dashpot (1)\n"
    "  --stiffness K     of contacts, N/m, 1e5 to 1e9; the time step goes with it (1e7)\n"
    "  --wall-friction   keep friction 0.2 at the walls after settling, as the papers do\n"
    "  --gravity         keep gravity after settling: the papers do not say\n"
    "  --solver NAME     of contacts: certified or gjk (GJK and EPA) (certified)\n"
    "  --faces RULE      forces where faces meet: two (points) or one (two)\n"
    "  --papers          the papers' way: GJK and EPA for every pair in every step, circles too,\n"
    "                    one contact point, templates by their fits, friction at the walls\n"
    "  --grains PATH     bezier and fs grains from an image (PBM, PGM), an outline (CSV, first\n"
    "                    line \"x,y\"), or a directory of outlines, without any of images\n"
    "                    (without PATH: a few outlines made here)\n" SEARCH_USAGE
    "  --min-coverage C  leave out grains that convex templates cover less, 0 to 1 (0.7)\n"
    "  --out DIR         for history.csv and a picture (SVG) and histograms (CSV) of the settled,\n"
    "                    packed and final state; made if its parent exists (out)\n"
    "  --pairs           also pairs.csv: support calls of GJK and EPA's residuals for all near\n"
    "                    pairs of the settled state\n"
    "  --ledger          keep the ledger of energies: its columns in history.csv, and a check\n"
    "                    that it closes; --quick keeps it unless --faces are one\n"
    "  --vtk             also particles.pvd and contacts.pvd with 40 frames in vtk/, for ParaView\n"
    "  --quick           a small, hasty run of 8000 steps with wider bands for the checks\n"
    "  --help            this text\n"
    "Exit status: 0 all physical checks hold, 1 one failed, 2 bad usage or input, 130 stopped by\n"
    "Ctrl-C, with what there was written.\n";

static const double STRESS = 1e5; // Pa, on the sides, and on the top while consolidating
static const double STIFFNESS_OF_PAPERS = 1e7; // N/m

/* ---- options ---- */

typedef struct options {
    int particles; // 0: not given
    uint64_t seed;
    bool kinds[KINDS];
    bool global_damping;
    double damping_ratio; // of the contacts' dashpots
    bool quick, pairs, vtk, ledger;
    bool papers, wall_friction, gravity;
    double stiffness;   // N/m
    int solver, faces;  // dem2d_solver, dem2d_face_rule
    const char *grains; // or NULL
    dem2d_image_desc search;
    double min_coverage;
    const char *out;
} options;

enum {
    QUICK,
    PARTICLES,
    SEED,
    SHAPES,
    DAMPING,
    RESTITUTION,
    STIFFNESS,
    WALL_FRICTION,
    GRAVITY,
    SOLVER,
    FACES,
    PAPERS,
    GRAINS,
    SEARCH, // SEARCH_OPTIONS of them
    MIN_COVERAGE = SEARCH + SEARCH_OPTIONS,
    OUT,
    PAIRS,
    LEDGER,
    VTK,
    OPTIONS
};
static const char *const option_names[OPTIONS] = {
    "--quick",        "--particles=", "--seed=",         "--shapes=",  "--damping=",
    "--restitution=", "--stiffness=", "--wall-friction", "--gravity",  "--solver=",
    "--faces=",       "--papers",     "--grains=",       SEARCH_NAMES, "--min-coverage=",
    "--out=",         "--pairs",      "--ledger",        "--vtk"};

static options parse_options(int count, char **arguments) {
    static const char *const dampings[] = {"local", "global"};
    static const char *const solvers[] = {"certified", "gjk"};
    static const char *const rules[] = {"two", "one"};
    options o = {0};
    o.seed = 1;
    o.stiffness = STIFFNESS_OF_PAPERS;
    o.out = "out";
    o.search = default_search();
    o.min_coverage = 0.7;
    parse_shapes("mixed", o.kinds);
    for (int i = 1; i < count; i++) {
        const char *name = arguments[i], *value;
        const int which = parse_option(count, arguments, &i, usage, option_names, OPTIONS, &value);
        if (which == QUICK) o.quick = true;
        if (which == PARTICLES) o.particles = (int)parse_integer(name, value, 10, 1000000);
        if (which == SEED) o.seed = parse_integer(name, value, 0, UINT64_MAX);
        if (which == SHAPES) parse_shapes(value, o.kinds);
        if (which == DAMPING) o.global_damping = parse_name(name, value, dampings, 2) == 1;
        if (which == RESTITUTION)
            must(dem2d_damping_ratio(parse_real(name, value, 0.01, 1), &o.damping_ratio), name);
        if (which == STIFFNESS) o.stiffness = parse_real(name, value, 1e5, 1e9);
        if (which == WALL_FRICTION) o.wall_friction = true;
        if (which == GRAVITY) o.gravity = true;
        if (which == SOLVER) o.solver = parse_name(name, value, solvers, 2);
        if (which == FACES) o.faces = parse_name(name, value, rules, 2);
        if (which == PAPERS) o.papers = true;
        if (which == GRAINS) o.grains = value;
        if (which >= SEARCH && which < MIN_COVERAGE) take_search(which - SEARCH, value, &o.search);
        if (which == MIN_COVERAGE) o.min_coverage = parse_real(name, value, 0, 1);
        if (which == OUT) o.out = value;
        if (which == PAIRS) o.pairs = true;
        if (which == LEDGER) o.ledger = true;
        if (which == VTK) o.vtk = true;
    }
    if (o.papers) {
        o.solver = DEM2D_GJK_EPA;
        o.faces = DEM2D_ONE_POINT;
        o.wall_friction = true;
    }
    if (o.particles == 0) o.particles = o.quick ? 100 : 500;
    return o;
}

/* A hasty run has its energy checked in any case: a ledger takes a third more instructions, too
   much for the whole test. With one point where faces meet energy is not conserved. */
static bool keeps_ledger(const options *o) {
    return o->ledger || (o->quick && o->faces == DEM2D_TWO_POINTS);
}

/* ---- the plan: sizes and times of a run ---- */

typedef struct plan {
    double time_step;                  // s
    double width, height;              // m, of the box
    double gravity;                    // m/s2, while settling
    double servo_speed;                // m/s, at most
    double top_speed;                  // m/s, of the compression
    double local_damping;              // -
    double global_damping;             // 1/s
    int settle, consolidate, compress; // steps
    int frame;                         // steps from one VTK file to the next
    int particles;
} plan;

enum { ROW = 500 }; // steps from one row of the history to the next, but in compression

/* The papers' test. Fewer than 500 grains fill less of the box: the top wall then goes slower in
   proportion, for the same strain. */
static plan full_plan(const options *o) {
    const double more = o->particles > 500 ? o->particles / 500.0 : 1;
    const double fewer = o->particles < 500 ? o->particles / 500.0 : 1;
    plan p = {1e-4, 1.0,   3.0 * more, 9.8,   0.1,  0.1 * fewer, 0.7,
              0,    50000, 10000,      20000, 2000, o->particles};
    return p;
}

/* The same in a tenth of the steps: 100 grains start half packed in a narrow box, fall under five
   times the gravity (at the bottom this weighs half of 100 kPa), and the servo walls may hurry.
   Other numbers of grains scale the box both ways, and speeds and gravity with it. */
static plan quick_plan(const options *o) {
    const double s = sqrt(o->particles / 100.0);
    plan p = {1e-4, 0.45 * s, s,    49 * s, 0.5 * s, 0.1 * s,     0.7,
              0,    3500,     1500, 3000,   500,     o->particles};
    return p;
}

static plan make_plan(const options *o) {
    plan p = o->quick ? quick_plan(o) : full_plan(o);
    if (o->global_damping) {
        p.local_damping = 0;
        p.global_damping = o->quick ? 10 : 0.7; // settling is 14 times shorter
    }
    /* contacts swing faster by the root of their stiffness: as many more steps, of whole rows */
    const double faster = sqrt(o->stiffness / STIFFNESS_OF_PAPERS);
    int *const steps[4] = {&p.settle, &p.consolidate, &p.compress, &p.frame};
    for (int i = 0; i < 4; i++) *steps[i] = ROW * (int)ceil(*steps[i] * faster / ROW);
    p.time_step /= faster;
    return p;
}

/* ---- grains ---- */

/* Grains whose circle of equal area has a diameter uniform in 0.04 to 0.06 m. Gives the world the
   templates that are used. */
static grain *draw_grains(dem2d_world *world, const options *o, template_set *set,
                          uint64_t *random) {
    grain *grains = get_memory(NULL, (size_t)o->particles, sizeof *grains);
    const size_t room = (size_t)set->count + (size_t)o->particles; // an own one for each at most
    dem2d_shape_id *ids = get_memory(NULL, room, sizeof *ids);
    memset(ids, 0, room * sizeof *ids); // generation 0: not yet in the world
    for (int i = 0; i < o->particles; i++) {
        const int t = random_template(set, o->kinds, random);
        const double radius = 0.5 * random_between(random, 0.04, 0.06);
        dem2d_shape_info info;
        must(dem2d_shape_get(set->shapes[t], &info), "template");
        if (ids[t].generation == 0)
            must(dem2d_world_add_shape(world, set->shapes[t], &ids[t]), "template");
        grain g = {0};
        g.shape = set->shapes[t];
        g.id = ids[t];
        g.pose.scale = radius / info.equivalent;
        g.radius = info.circumscribed * g.pose.scale;
        g.serial = i;
        grains[i] = g;
    }
    free(ids);
    return grains;
}

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

/* Height of the highest point of any grain. */
static double highest_point(const job *j) {
    const int particles = j->plan.particles;
    dem2d_particle_id *ids = get_memory(NULL, (size_t)particles, sizeof *ids);
    int count;
    double highest = 0;
    must(dem2d_world_particles(j->world, ids, particles, &count), "particles");
    for (int i = 0; i < count; i++) {
        dem2d_particle_info info;
        dem2d_box box;
        must(dem2d_world_get_particle(j->world, ids[i], &info), "particle");
        must(dem2d_shape_aabb(dem2d_world_shape(j->world, info.shape), info.pose, &box), "box");
        if (box.upper.y > highest) highest = box.upper.y;
    }
    free(ids);
    return highest;
}

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
        const dem2d_pvd_desc desc = {j->frames, j->frame_times, files, NULL, NULL};
        char *folder = join_text(j->options->out, "/", vtk_names[k]);
        char *path = join_text(folder, ".", "pvd");
        need(dem2d_pvd_write(example_env(), &desc, path), STATUS_BAD_INPUT, path);
        free(path);
        free(folder);
    }
}

/* ---- pairs whose bounding circles overlap ---- */

typedef struct near_pair {
    int a, b; // places in the list of grains, a < b
} near_pair;

typedef struct neighbours {
    dem2d_particle_info *grains; // in the order of their ids
    near_pair *pairs;            // in the order of b, then a
    int count;                   // of the pairs
} neighbours;

/* A grain's place and the left end of its bounding circle. */
typedef struct left_end {
    double x;
    int place;
} left_end;

static int compare_ends(const void *a, const void *b) {
    const left_end *p = a, *q = b;
    return p->x != q->x ? (p->x > q->x) - (p->x < q->x) : p->place - q->place;
}

static int compare_pairs(const void *a, const void *b) {
    const near_pair *p = a, *q = b;
    return p->b != q->b ? p->b - q->b : p->a - q->a;
}

static bool circles_overlap(const dem2d_particle_info *a, const dem2d_particle_info *b) {
    const double dx = b->pose.position.x - a->pose.position.x;
    const double dy = b->pose.position.y - a->pose.position.y, reach = a->radius + b->radius;
    return dx * dx + dy * dy < reach * reach;
}

/* A sweep along x: each grain meets those whose left end is before its right end. */
static neighbours find_neighbours(const dem2d_world *world, int particles) {
    neighbours n = {NULL, NULL, 0};
    int count;
    dem2d_particle_id *ids = get_memory(NULL, (size_t)particles, sizeof *ids);
    left_end *ends = get_memory(NULL, (size_t)particles, sizeof *ends);
    n.grains = get_memory(NULL, (size_t)particles, sizeof *n.grains);
    must(dem2d_world_particles(world, ids, particles, &count), "particles");
    for (int i = 0; i < count; i++) {
        must(dem2d_world_get_particle(world, ids[i], &n.grains[i]), "particle");
        ends[i].x = n.grains[i].pose.position.x - n.grains[i].radius;
        ends[i].place = i;
    }
    qsort(ends, (size_t)count, sizeof *ends, compare_ends);
    for (int i = 0; i < count; i++)
        for (int k = i + 1; k < count; k++) {
            const int p = ends[i].place, q = ends[k].place;
            if (ends[k].x > n.grains[p].pose.position.x + n.grains[p].radius) break;
            if (!circles_overlap(&n.grains[p], &n.grains[q])) continue;
            if ((n.count & (n.count - 1)) == 0) // at powers of 2: room for twice as many
                n.pairs = get_memory(n.pairs, 2 * (size_t)n.count + 1, sizeof *n.pairs);
            n.pairs[n.count].a = p < q ? p : q;
            n.pairs[n.count++].b = p < q ? q : p;
        }
    if (n.count > 0) qsort(n.pairs, (size_t)n.count, sizeof *n.pairs, compare_pairs);
    free(ids);
    free(ends);
    return n;
}

static void free_neighbours(neighbours *n) {
    free(n->grains);
    free(n->pairs);
}

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

/* ---- steps, and what is watched meanwhile ---- */

/* Pairs whose bounding circles overlap and that do not touch, every WATCH steps: those a step might
   have to collide in vain. */
enum { WATCH = 500 };

static void watch_near_pairs(job *j) {
    dem2d_stats stats;
    neighbours n = find_neighbours(j->world, j->plan.particles);
    must(dem2d_world_stats(j->world, &stats), "stats");
    j->near_pairs += n.count - stats.contacts;
    j->near_samples++;
    free_neighbours(&n);
}

/* Whether to go on. */
static bool take_steps(job *j, int count) {
    int done = 0;
    const dem2d_result result = dem2d_world_step(j->world, count, &done);
    char what[64];
    snprintf(what, sizeof what, "%s, step %d", stage_names[j->stage], j->steps + done + 1);
    must(result, what);
    j->steps += count;
    if (j->steps % WATCH == 0) watch_near_pairs(j);
    if (j->options->vtk && j->steps % j->plan.frame == 0) write_frame(j);
    progress_show(&j->progress, stage_names[j->stage], j->steps);
    return !stop_asked;
}

/* The greater one; a NaN stays, so that a check can find it. */
static double greatest(double so_far, double now) {
    return isnan(so_far) || now <= so_far ? so_far : now;
}

static void watch_overlap(job *j) {
    dem2d_packing packing;
    must(dem2d_world_packing(j->world, &packing), "packing");
    j->max_overlap = greatest(j->max_overlap, packing.max_overlap);
}

/* ---- 1. settling ---- */

static void build_world(job *j, const options *o) {
    dem2d_world_desc scene = {0};
    scene.time_step = j->plan.time_step;
    scene.gravity.y = -j->plan.gravity;
    scene.local_damping = j->plan.local_damping;
    scene.global_damping = j->plan.global_damping;
    scene.particle_capacity = j->plan.particles;
    scene.solver = (dem2d_solver)o->solver;
    scene.faces = (dem2d_face_rule)o->faces;
    scene.ledger = keeps_ledger(o);
    scene.env = example_env();
    must(dem2d_world_create(&scene, &j->world), "world");
    dem2d_material_desc stone = {0};
    stone.density = 2700; // kg/m2
    stone.normal_stiffness = o->stiffness;
    stone.tangential_stiffness = o->stiffness;
    stone.friction = 0.2;
    stone.damping_ratio = o->damping_ratio;
    must(dem2d_world_add_material(j->world, &stone, &j->grain_material), "material");
    must(dem2d_world_add_material(j->world, &stone, &j->wall_material), "material");
}

static void add_wall(job *j, int which, double x, double y, double nx, double ny) {
    dem2d_wall_desc wall = {0};
    wall.material = j->wall_material;
    wall.point.x = x;
    wall.point.y = y;
    wall.normal.x = nx;
    wall.normal.y = ny;
    if (which == BOTTOM || which == TOP) { // as long as left and right are apart
        wall.spans[0] = j->walls[LEFT];
        wall.spans[1] = j->walls[RIGHT];
    }
    must(dem2d_world_add_wall(j->world, &wall, &j->walls[which]), "wall");
}

static void fill_box(job *j, grain *grains, uint64_t *random) {
    plan *p = &j->plan;
    place_grains(grains, p->particles, p->width, &p->height, random);
    for (int i = 0; i < p->particles; i++) {
        dem2d_particle_desc desc = {0};
        desc.scale = grains[i].pose.scale;
        desc.shape = grains[i].id;
        desc.material = j->grain_material;
        desc.position = grains[i].pose.position;
        desc.angle = grains[i].angle;
        dem2d_particle_id id;
        must(dem2d_world_add_particle(j->world, &desc, &id), "particle");
    }
    add_wall(j, LEFT, 0, 0, 1, 0);
    add_wall(j, RIGHT, p->width, 0, -1, 0);
    add_wall(j, BOTTOM, 0, 0, 0, 1);
}

static bool settle(job *j) {
    bool going = true;
    j->stage = SETTLING;
    for (int done = 0; going && done < j->plan.settle; done += ROW) {
        going = take_steps(j, ROW);
        const reading r = read_walls(j);
        write_row(j, &r);
    }
    must(dem2d_world_packing(j->world, &j->settled), "packing");
    return going;
}

/* ---- 2. consolidation ---- */

/* From now on this wall, as long as two others are apart, holds STRESS; or moves. */
static void control_wall(job *j, int which, dem2d_wall_mode mode, int span_a, int span_b) {
    dem2d_wall_info now;
    must(dem2d_world_get_wall(j->world, j->walls[which], &now), "wall");
    dem2d_wall_desc wall = {0};
    wall.mode = mode;
    wall.material = j->wall_material;
    wall.point = now.point;
    wall.normal = now.normal;
    if (mode == DEM2D_WALL_SERVO) {
        wall.stress = STRESS;
        wall.max_speed = j->plan.servo_speed;
    } else {
        wall.velocity.y = -j->plan.top_speed;
    }
    wall.spans[0] = j->walls[span_a];
    wall.spans[1] = j->walls[span_b];
    must(dem2d_world_set_wall(j->world, j->walls[which], &wall), "wall");
}

static bool consolidate(job *j) {
    enum { SAMPLE = 10 };
    const dem2d_vec no_gravity = {0, 0};
    bool going = true;
    dem2d_pair_desc smooth = {0};
    smooth.normal_stiffness = j->options->stiffness;
    smooth.tangential_stiffness = j->options->stiffness;
    smooth.damping_ratio = j->options->damping_ratio;
    j->stage = CONSOLIDATION;
    if (!j->options->gravity) must(dem2d_world_set_gravity(j->world, no_gravity), "gravity");
    if (!j->options->wall_friction)
        must(dem2d_world_set_pair(j->world, j->grain_material, j->wall_material, &smooth),
             "friction");
    add_wall(j, TOP, 0, highest_point(j), 0, -1);
    control_wall(j, TOP, DEM2D_WALL_SERVO, LEFT, RIGHT);
    control_wall(j, LEFT, DEM2D_WALL_SERVO, BOTTOM, TOP);
    control_wall(j, RIGHT, DEM2D_WALL_SERVO, BOTTOM, TOP);
    for (int done = SAMPLE; going && done <= j->plan.consolidate; done += SAMPLE) {
        going = take_steps(j, SAMPLE);
        watch_overlap(j);
        if (done % ROW != 0) continue;
        const reading r = read_walls(j);
        write_row(j, &r);
    }
    const reading r = read_walls(j);
    must(dem2d_world_packing(j->world, &j->packed), "packing");
    j->porosity = 1 - j->packed.solid_area / (r.width * r.height);
    j->packed_ratio = r.ratio;
    j->width0 = r.width;
    j->height0 = r.height;
    return going;
}

/* ---- 3. compression ---- */

/* Gives the axial strain. */
static bool compress(job *j, double *strain) {
    enum { SAMPLE = 10 };
    reading r = {{0}, 0, 0, 0, 0, 0, 0, 0};
    bool going = true;
    j->stage = COMPRESSION;
    j->blocks = get_memory(NULL, (size_t)(j->plan.compress / BLOCK), sizeof *j->blocks);
    control_wall(j, TOP, DEM2D_WALL_MOVING, LEFT, RIGHT);
    for (int done = 1; going && done <= j->plan.compress; done++) {
        going = take_steps(j, 1);
        r = read_walls(j);
        if (r.strain >= 0.001) {
            j->lateral_sum += r.lateral;
            j->lateral_steps++;
            j->lateral_worst = greatest(j->lateral_worst, fabs(r.lateral - STRESS));
        }
        j->block_sum += r.ratio;
        if (done % SAMPLE == 0) watch_overlap(j);
        if (done % BLOCK != 0) continue;
        j->blocks[j->block_count++] = j->block_sum / BLOCK;
        j->block_sum = 0;
        write_row(j, &r);
    }
    *strain = r.strain;
    return going;
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

/* All three stages, with the files of their ends; false when stopped. */
static bool run(job *j, double *strain) {
    if (!settle(j)) return false;
    draw(j, "settled.svg", false);
    write_histograms(j, "settled.csv");
    if (j->options->pairs) write_pairs(j);
    if (!consolidate(j)) return false;
    draw(j, "packed.svg", true);
    write_histograms(j, "packed.csv");
    return compress(j, strain);
}

int main(int count, char **arguments) {
    example_name = "biaxial";
    const options o = parse_options(count, arguments);
    template_set set = load_templates(o.grains, &o.search, o.min_coverage, o.papers);
    make_directory(o.out); // all input is known to be good; nothing was written before
    if (o.vtk) {
        char *folder = join_text(o.out, "/", "vtk");
        make_directory(folder);
        free(folder);
    }
    job j = {0};
    uint64_t random = o.seed;
    j.options = &o;
    j.plan = make_plan(&o);
    draft_open(&j.history);
    build_world(&j, &o);
    grain *grains = draw_grains(j.world, &o, &set, &random);
    fill_box(&j, grains, &random);
    free(grains); // the world has its own copies of all
    free_templates(&set);

    const int total = j.plan.settle + j.plan.consolidate + j.plan.compress;
    double strain = 0;
    catch_interrupt();
    progress_start(&j.progress, "steps", total);
    const bool finished = run(&j, &strain);
    j.seconds = clock_seconds() - j.progress.started;
    progress_end(&j.progress);
    draw(&j, "final.svg", true);
    write_histograms(&j, "final.csv");
    if (o.vtk) write_series(&j);
    write_out(&j, "history.csv", &j.history);
    if (!finished)
        fprintf(stderr, "biaxial: stopped after %d of %d steps; the state is in %s, unchecked\n",
                j.steps, total, o.out);
    const bool good = finished && report(&j, &o, strain);
    free(j.blocks);
    dem2d_world_destroy(j.world);
    if (fflush(stdout) != 0) fail(STATUS_BAD_INPUT, "cannot write to stdout");
    return finished ? good ? STATUS_OK : STATUS_FAILED : STATUS_STOPPED;
}
