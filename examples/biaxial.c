/* biaxial.c - 500 grains of five shapes are packed, consolidated and sheared: the biaxial test of
   the papers on polybezier and Fourier-series grains.

       make build && build/biaxial              (about a minute; results in out/)
       build/biaxial --grains PATH              grains modelled on your outlines or photographs
       build/biaxial --help

   1. Settling      Grains are placed at random without overlap in a box 1.0 x 3.0 m (higher in
                    proportion for more than 500) and fall; all friction 0.2.
   2. Consolidation No gravity, walls frictionless. A top wall is put on the highest grain; top,
                    left and right wall are moved so that each presses with 100 kPa.
   3. Compression   The top wall goes down at a constant speed; left and right hold 100 kPa.

   Then the figures go to stdout ("name value unit"), and the exit status tells whether they are
   what physics asks for: 0 yes, 1 no (stderr names the check), 2 bad usage or input. history.csv
   has no clock in it: the same options give the same bytes, whatever the compiler.
*/
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "common.h"

static const char usage[] =
    "usage: biaxial [options]\n"
    "Packs grains under gravity, consolidates them at 100 kPa and compresses them.\n"
    "  --particles N     number of grains, 10 to 1000000 (500; with --quick 100)\n"
    "  --seed S          of the random numbers, 0 to 2^64 - 1 (1)\n"
    "  --shapes SET      mixed (all five), noncircular (ellipse, polygon, bezier), or a\n"
    "                    comma-separated list of circle, ellipse, polygon, bezier, fs (mixed)\n"
    "  --damping KIND    local (Cundall, 0.7) or global (viscous, 0.7 1/s) (local)\n"
    "  --solver NAME     of contacts: certified or gjk (GJK and EPA) (certified)\n"
    "  --faces RULE      forces where faces meet: two (points), one, or area (two)\n"
    "  --grains PATH     bezier and fs grains from an image (PBM, PGM), an outline (CSV, first\n"
    "                    line \"x,y\"), or a directory of outlines, without any of images\n"
    "                    (without PATH: a few outlines made here)\n"
    "  --out DIR         for history.csv, packed.svg, final.svg; made if its parent exists (out)\n"
    "  --quick           a small, hasty run of 8000 steps with wider bands for the checks\n"
    "  --help            this text\n"
    "Exit status: 0 all physical checks hold, 1 one failed, 2 bad usage or input.\n";

static const double STRESS = 1e5;     // Pa, on the sides, and on the top while consolidating
static const double TIME_STEP = 1e-4; // s

/* ---- options ---- */

typedef struct options {
    int particles; // 0: not given
    uint64_t seed;
    bool kinds[KINDS];
    bool global_damping;
    bool quick;
    int solver, faces;  // dem2d_solver, dem2d_face_rule
    const char *grains; // or NULL
    const char *out;
} options;

static options parse_options(int count, char **arguments) {
    options o = {0};
    o.seed = 1;
    o.out = "out";
    parse_shapes("mixed", o.kinds);
    static const char *const names[] = {
        "--quick",   "--particles=", "--seed=",   "--shapes=", "--damping=",
        "--grains=", "--out=",       "--solver=", "--faces="};
    static const char *const dampings[] = {"local", "global"};
    static const char *const solvers[] = {"certified", "gjk"};
    static const char *const rules[] = {"two", "one", "area"};
    for (int i = 1; i < count; i++) {
        const char *name = arguments[i], *value;
        const int which = parse_option(count, arguments, &i, usage, names, 9, &value);
        if (which == 0) o.quick = true;
        if (which == 1) o.particles = (int)parse_integer(name, value, 10, 1000000);
        if (which == 2) o.seed = parse_integer(name, value, 0, UINT64_MAX);
        if (which == 3) parse_shapes(value, o.kinds);
        if (which == 4) o.global_damping = parse_name(name, value, dampings, 2) == 1;
        if (which == 5) o.grains = value;
        if (which == 6) o.out = value;
        if (which == 7) o.solver = parse_name(name, value, solvers, 2);
        if (which == 8) o.faces = parse_name(name, value, rules, 3);
    }
    if (o.particles == 0) o.particles = o.quick ? 100 : 500;
    return o;
}

/* ---- the plan: sizes and times of a run ---- */

typedef struct plan {
    double width, height;              // m, of the box
    double gravity;                    // m/s2, while settling
    double servo_speed;                // m/s, at most
    double top_speed;                  // m/s, of the compression
    double local_damping;              // -
    double global_damping;             // 1/s
    int settle, consolidate, compress; // steps
    int particles;
} plan;

/* The papers' test. Fewer than 500 grains fill less of the box: the top wall then goes slower in
   proportion, for the same strain. */
static plan full_plan(const options *o) {
    const double more = o->particles > 500 ? o->particles / 500.0 : 1;
    const double fewer = o->particles < 500 ? o->particles / 500.0 : 1;
    plan p = {1.0, 3.0 * more, 9.8, 0.1, 0.1 * fewer, 0.7, 0, 50000, 10000, 20000, o->particles};
    return p;
}

/* The same in a tenth of the steps: 100 grains start half packed in a narrow box, fall under five
   times the gravity (at the bottom this weighs half of 100 kPa), and the servo walls may hurry.
   Other numbers of grains scale the box both ways, and speeds and gravity with it. */
static plan quick_plan(const options *o) {
    const double s = sqrt(o->particles / 100.0);
    plan p = {0.45 * s, s, 49 * s, 0.5 * s, 0.1 * s, 0.7, 0, 3500, 1500, 3000, o->particles};
    return p;
}

static plan make_plan(const options *o) {
    plan p = o->quick ? quick_plan(o) : full_plan(o);
    if (o->global_damping) {
        p.local_damping = 0;
        p.global_damping = o->quick ? 10 : 0.7; // settling is 14 times shorter
    }
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

typedef struct job {
    plan plan;
    dem2d_world *world;
    dem2d_material_id grain_material, wall_material;
    dem2d_wall_id walls[WALLS]; // TOP: generation 0 before consolidation
    FILE *history;
    const char *stage;
    double started, shown, seconds; // on the clock: start, last progress line, whole run
    int steps;                      // done
    int bad_rows;                   // of the history, with a number that is not finite
    double width0, height0;         // m, at the end of consolidation; 0 before
    double packed_ratio;            // stress ratio then
    dem2d_packing packed;           // and packing
    double porosity;
    double max_overlap; // over consolidation and compression
    double near_pairs, near_samples;
    double lateral_sum;   // Pa, over the steps after 0.1 % of strain
    double lateral_worst; // Pa, greatest error at any of them
    int lateral_steps;
    double block_sum; // stress ratio, summed over the present block of steps
    double *blocks;   // its mean over each block
    int block_count;
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

/* Mean speed of the grains, and the height of the highest point of any. */
static void scan_grains(const job *j, double *speed, double *highest) {
    const int particles = j->plan.particles;
    dem2d_particle_id *ids = get_memory(NULL, (size_t)particles, sizeof *ids);
    int count;
    must(dem2d_world_particles(j->world, ids, particles, &count), "particles");
    *speed = *highest = 0;
    for (int i = 0; i < count; i++) {
        dem2d_particle_info info;
        dem2d_box box;
        must(dem2d_world_get_particle(j->world, ids[i], &info), "particle");
        const dem2d_shape *shape = dem2d_world_shape(j->world, info.shape);
        must(dem2d_shape_aabb(shape, info.pose, &box), "particle");
        const dem2d_vec v = info.velocity;
        *speed += sqrt(v.x * v.x + v.y * v.y) / count;
        if (box.upper.y > *highest) *highest = box.upper.y;
    }
    free(ids);
}

/* Strains are 0 before the compression; stresses of walls without a length (the sides while
   settling) are 0. */
static void write_row(job *j, const reading *r) {
    dem2d_energy e;
    double speed, highest;
    scan_grains(j, &speed, &highest);
    must(dem2d_world_energy(j->world, &e), "energy");
    const double row[] = {
        j->steps * TIME_STEP, r->axial,         r->lateral,   r->stress[TOP],   r->stress[BOTTOM],
        r->stress[LEFT],      r->stress[RIGHT], r->strain,    r->volume_strain, e.translational,
        e.rotational,         e.normal,         e.tangential, e.potential,      speed};
    const int columns = (int)(sizeof row / sizeof row[0]);
    bool finite = true;
    for (int i = 0; i < columns; i++) {
        finite = finite && isfinite(row[i]);
        fprintf(j->history, "%.17g%c", row[i], i + 1 < columns ? ',' : '\n');
    }
    if (!finite) j->bad_rows++;
}

static void show_progress(job *j) {
    const plan *p = &j->plan;
    const int total = p->settle + p->consolidate + p->compress;
    const double now = clock_seconds();
    if (now - j->shown < 5) return;
    j->shown = now;
    const double left = (now - j->started) * (total - j->steps) / j->steps;
    fprintf(stderr, "biaxial: %s, step %d of %d, %.0f s left\n", j->stage, j->steps, total, left);
}

/* Pairs whose bounding circles overlap and that do not touch: those a step might have to look at
   in vain. Every WATCH steps and in small scenes, as it takes the square of their number. */
enum { WATCH = 500, WATCHED = 2000 };

static void watch_near_pairs(job *j) {
    dem2d_stats stats;
    int count;
    must(dem2d_world_stats(j->world, &stats), "stats");
    dem2d_particle_id *ids = get_memory(NULL, (size_t)stats.particles, sizeof *ids);
    dem2d_particle_info *grains = get_memory(NULL, (size_t)stats.particles, sizeof *grains);
    must(dem2d_world_particles(j->world, ids, stats.particles, &count), "particles");
    for (int i = 0; i < count; i++) {
        must(dem2d_world_get_particle(j->world, ids[i], &grains[i]), "particle");
        for (int k = 0; k < i; k++) {
            const double dx = grains[i].pose.position.x - grains[k].pose.position.x;
            const double dy = grains[i].pose.position.y - grains[k].pose.position.y;
            const double reach = grains[i].radius + grains[k].radius;
            j->near_pairs += dx * dx + dy * dy < reach * reach;
        }
    }
    j->near_pairs -= stats.contacts;
    j->near_samples++;
    free(ids);
    free(grains);
}

static void take_steps(job *j, int count) {
    int done = 0;
    const dem2d_result result = dem2d_world_step(j->world, count, &done);
    char what[64];
    snprintf(what, sizeof what, "%s, step %d", j->stage, j->steps + done + 1);
    must(result, what);
    j->steps += count;
    if (j->steps % WATCH == 0 && j->plan.particles <= WATCHED) watch_near_pairs(j);
    show_progress(j);
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
    scene.time_step = TIME_STEP;
    scene.gravity.y = -j->plan.gravity;
    scene.local_damping = j->plan.local_damping;
    scene.global_damping = j->plan.global_damping;
    scene.particle_capacity = j->plan.particles;
    scene.solver = (dem2d_solver)o->solver;
    scene.faces = (dem2d_face_rule)o->faces;
    scene.env = example_env();
    must(dem2d_world_create(&scene, &j->world), "world");
    dem2d_material_desc stone = {0};
    stone.density = 2700;         // kg/m2
    stone.normal_stiffness = 1e7; // N/m
    stone.tangential_stiffness = 1e7;
    stone.friction = 0.2;
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

static void settle(job *j) {
    enum { ROW = 500 };
    j->stage = "settling";
    for (int done = 0; done < j->plan.settle; done += ROW) {
        take_steps(j, ROW);
        const reading r = read_walls(j);
        write_row(j, &r);
    }
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

static void consolidate(job *j) {
    enum { SAMPLE = 10, ROW = 500 };
    const dem2d_vec no_gravity = {0, 0};
    double speed, highest;
    dem2d_pair_desc smooth = {0};
    smooth.normal_stiffness = 1e7;
    smooth.tangential_stiffness = 1e7;
    j->stage = "consolidation";
    must(dem2d_world_set_gravity(j->world, no_gravity), "gravity");
    must(dem2d_world_set_pair(j->world, j->grain_material, j->wall_material, &smooth), "friction");
    scan_grains(j, &speed, &highest);
    add_wall(j, TOP, 0, highest, 0, -1);
    control_wall(j, TOP, DEM2D_WALL_SERVO, LEFT, RIGHT);
    control_wall(j, LEFT, DEM2D_WALL_SERVO, BOTTOM, TOP);
    control_wall(j, RIGHT, DEM2D_WALL_SERVO, BOTTOM, TOP);
    for (int done = SAMPLE; done <= j->plan.consolidate; done += SAMPLE) {
        take_steps(j, SAMPLE);
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
}

/* ---- 3. compression ---- */

static double compress(job *j) {
    enum { SAMPLE = 10 };
    reading r = {{0}, 0, 0, 0, 0, 0, 0, 0};
    j->stage = "compression";
    j->blocks = get_memory(NULL, (size_t)(j->plan.compress / BLOCK), sizeof *j->blocks);
    control_wall(j, TOP, DEM2D_WALL_MOVING, LEFT, RIGHT);
    for (int done = 1; done <= j->plan.compress; done++) {
        take_steps(j, 1);
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
    return r.strain;
}

/* ---- results ---- */

static void draw(const job *j, const char *out, const char *name) {
    dem2d_svg_desc picture = {0};
    picture.force_chains = true;
    char *path = join_text(out, "/", name), *aside = aside_name(path);
    const dem2d_result result = dem2d_world_write_svg(j->world, &picture, aside);
    if (result != DEM2D_IO) must(result, name);
    aside_finish(aside, result == DEM2D_OK);
    free(path);
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
    const double found = (double)(stats->looks - stats->gaps);
    return found > 0 ? 100 * (double)stats->proofs[proof] / found : 0;
}

/* Prints the figures and returns whether each lies in its band. The plateau: the mean stress ratio
   of the last fifth of the compression over the peak; a ratio that falls back or never stops
   jumping is below the band. It rises because it is about 0 at the end of consolidation. */
static bool report(const job *j, const options *o, double strain) {
    const double steps = j->steps, particles = j->plan.particles;
    const double lateral = j->lateral_sum / j->lateral_steps; // NaN without steps
    const int tail = j->block_count - j->block_count / 5;
    /* weak global damping lets spikes of single steps ring on, when a contact slips or opens */
    const double worst = o->global_damping ? 15 : 5;
    double peak = 0, plateau = 0;
    for (int i = 0; i < j->block_count; i++) peak = fmax(peak, j->blocks[i]);
    for (int i = tail; i < j->block_count; i++) plateau += j->blocks[i];
    plateau /= j->block_count - tail;
    dem2d_stats stats;
    must(dem2d_world_stats(j->world, &stats), "stats");
    const double looks = stats.looks > 0 ? (double)stats.looks : 1;
    const figure figures[] = {
        {"particles", particles, "-", FINITE, FINITE},
        {"steps", steps, "-", FINITE, FINITE},
        {"elapsed_seconds", j->seconds, "s", FINITE, FINITE},
        {"ns_per_particle_step", 1e9 * j->seconds / steps / particles, "ns", FINITE, FINITE},
        {"memory_per_particle", (double)stats.bytes / particles, "B", FINITE, FINITE},
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
        {"plateau_over_peak", plateau / peak, "-", {0.7, 1.01}, {0.6, 1.01}},
        {"axial_strain_final", strain, "-", {0.001, 2}, {0.001, 2}},
        {"looks_per_step", (double)stats.looks / steps, "-", FINITE, FINITE},
        {"support_calls_per_look", (double)stats.support_calls / looks, "-", FINITE, FINITE},
        {"near_pairs_skipped_percent",
         j->near_pairs > 0
             ? 100 - 100 * (double)stats.gaps / steps * j->near_samples / j->near_pairs
             : 0,
         "%", FINITE, FINITE},
        {"proved_by_form_percent", share(&stats, DEM2D_BY_FORM), "%", FINITE, FINITE},
        {"proved_by_radius_percent", share(&stats, DEM2D_BY_RADIUS), "%", FINITE, FINITE},
        {"proved_by_arc_percent", share(&stats, DEM2D_BY_ARC), "%", FINITE, FINITE},
        {"proved_by_polytope_percent", share(&stats, DEM2D_BY_POLYTOPE), "%", FINITE, FINITE},
        {"contacts_not_converged", (double)stats.not_converged, "-", {0, 0}, {0, 0}},
        {"rows_not_finite", j->bad_rows, "-", {0, 0}, {0, 0}},
    };
    bool good = true;
    for (size_t i = 0; i < sizeof figures / sizeof figures[0]; i++) {
        const figure *f = &figures[i];
        const double *band = o->quick ? f->quick : f->full;
        printf("%s %.9g %s\n", f->name, f->value, f->unit);
        if (f->value >= band[0] && f->value <= band[1]) continue; // false for a NaN
        fprintf(stderr, "biaxial: check failed: %s is %.6g, not in %g to %g\n", f->name, f->value,
                band[0], band[1]);
        good = false;
    }
    return good;
}

static const char header[] =
    "time_s,axial_stress_pa,lateral_stress_pa,top_stress_pa,bottom_stress_pa,left_stress_pa,"
    "right_stress_pa,axial_strain,volumetric_strain,kinetic_translational_j_per_m,"
    "kinetic_rotational_j_per_m,normal_energy_j_per_m,tangential_energy_j_per_m,"
    "potential_energy_j_per_m,mean_speed_m_per_s\n";

int main(int count, char **arguments) {
    example_name = "biaxial";
    const options o = parse_options(count, arguments);
    template_set set = load_templates(o.grains);
    make_directory(o.out); // all input is known to be good; nothing was written before

    job j = {0};
    char *history = NULL;
    size_t history_size = 0;
    uint64_t random = o.seed;
    j.plan = make_plan(&o);
    j.history = open_memstream(&history, &history_size);
    if (j.history == NULL) fail(STATUS_FAILED, "out of memory");
    fputs(header, j.history);
    build_world(&j, &o);
    grain *grains = draw_grains(j.world, &o, &set, &random);
    fill_box(&j, grains, &random);
    free(grains); // the world has its own copies of all
    free_templates(&set);

    j.started = j.shown = clock_seconds();
    settle(&j);
    consolidate(&j);
    draw(&j, o.out, "packed.svg");
    const double strain = compress(&j);
    j.seconds = clock_seconds() - j.started;
    draw(&j, o.out, "final.svg");
    if (fclose(j.history) != 0) fail(STATUS_FAILED, "out of memory");
    char *path = join_text(o.out, "/", "history.csv");
    write_file(path, history, history_size);

    const bool good = report(&j, &o, strain);
    free(path);
    free(history);
    free(j.blocks);
    dem2d_world_destroy(j.world);
    if (fflush(stdout) != 0) fail(STATUS_BAD_INPUT, "cannot write to stdout");
    return good ? STATUS_OK : STATUS_FAILED;
}
