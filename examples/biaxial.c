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

   This file has the three stages; options and plan are in biaxial_options.h, what is written and
   checked in biaxial_results.h.
*/
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "biaxial_options.h"
#include "biaxial_results.h"

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

static void fill_box(job *j, const dem2d_particle_desc *grains, uint64_t seed) {
    plan *p = &j->plan;
    place_grains(j->world, grains, p->particles, p->width, &p->height, seed);
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
    dem2d_particle_desc *grains =
        draw_grains(j.world, j.grain_material, o.particles, o.kinds, 0.04, 0.06, &set, &random);
    fill_box(&j, grains, random);
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
