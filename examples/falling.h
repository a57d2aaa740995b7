/* falling.h - grains that fall into a box, by one thread and by several: the same bits. */
#ifndef DEM2D_EXAMPLES_FALLING_H
#define DEM2D_EXAMPLES_FALLING_H

#include "grains.h"

typedef struct fall {
    int threads, particles, steps;
} fall;

/* As many threads as processors, at most 8: the scene has no work for more. */
static inline int default_threads(void) {
    long processors = 2;
#ifdef _SC_NPROCESSORS_ONLN // not POSIX, but nearly everywhere
    processors = sysconf(_SC_NPROCESSORS_ONLN);
#endif
    return processors < 1 ? 1 : processors > 8 ? 8 : (int)processors;
}

/* Arguments [THREADS] [PARTICLES] [STEPS]. */
static inline fall parse_fall(int count, char **arguments) {
    fall f = {default_threads(), 3000, 2000};
    if (count > 1 && strcmp(arguments[1], "--help") == 0) {
        printf("usage: %s [THREADS] [PARTICLES] [STEPS]     (%d %d %d)\n", example_name, f.threads,
               f.particles, f.steps);
        exit(STATUS_OK);
    }
    if (count > 4) fail(STATUS_BAD_INPUT, "expected 3 arguments at most (try --help)");
    if (count > 1) f.threads = (int)parse_integer("THREADS", arguments[1], 1, 256);
    if (count > 2) f.particles = (int)parse_integer("PARTICLES", arguments[2], 1, 1000000);
    if (count > 3) f.steps = (int)parse_integer("STEPS", arguments[3], 1, 1000000000);
    return f;
}

/* A box without a lid. */
static inline void add_box(dem2d_world *world, dem2d_material_id material, double width) {
    const double normals[3][2] = {{0, 1}, {1, 0}, {-1, 0}}; // floor, left, right
    for (int i = 0; i < 3; i++) {
        dem2d_wall_desc wall = {0};
        dem2d_wall_id id;
        wall.material = material;
        wall.normal.x = normals[i][0];
        wall.normal.y = normals[i][1];
        wall.point.x = i == 2 ? width : 0;
        must(dem2d_world_add_wall(world, &wall, &id), "wall");
    }
}

/* Grains of 20 templates of all kinds, at random places and angles above the floor, each template
   with a velocity of its own, so that grains collide while they fall. */
static inline void add_falling(dem2d_world *world, dem2d_material_id material, int particles,
                               double width) {
    enum { TEMPLATES = 20 };
    const bool all[KINDS] = {true, true, true, true, true};
    const dem2d_grade sizes[2] = {{0.03, 0}, {0.04, 1}}; // m
    dem2d_grain_kind kinds[TEMPLATES] = {{0}};
    const dem2d_grading_desc grading = {sizes, 2, kinds, TEMPLATES,
                                        .measure = DEM2D_MEASURE_NUMBER};
    dem2d_fill_desc fill = {.grading = &grading, .count = particles, .method = DEM2D_FILL_RANDOM};
    dem2d_filling filling;
    uint64_t random = 1;
    const dem2d_image_desc search = default_search();
    template_set set = load_templates(NULL, &search, 0, false);
    for (int i = 0; i < TEMPLATES; i++) {
        const int t = random_template(&set, all, &random); // may move set.shapes
        kinds[i].share = 1, kinds[i].grain.material = material;
        kinds[i].grain.velocity.x = random_between(&random, -1, 1);
        kinds[i].grain.velocity.y = random_between(&random, -1, 1);
        must(dem2d_world_add_shape(world, set.shapes[t], &kinds[i].grain.shape), "template");
    }
    free_templates(&set); // the world has its own
    fill.region.box.upper.x = width, fill.region.box.upper.y = width / 2 + 0.05;
    must(dem2d_world_fill(world, &fill, NULL, 0, &filling), "filling");
}

/* All steps, a few at a time, and how long they took. */
static inline void take_fall(dem2d_world *world, const fall *f, const char *stage,
                             double *seconds) {
    enum { FEW = 50 };
    progress p;
    progress_start(&p, "steps", f->steps);
    for (int done = 0; done < f->steps; done += FEW) {
        const int left = f->steps - done;
        must(dem2d_world_step(world, left < FEW ? left : FEW, NULL), "step");
        progress_show(&p, stage, done + FEW < f->steps ? done + FEW : f->steps);
        if (!stop_asked) continue;
        progress_end(&p);
        fail(STATUS_STOPPED, "stopped after %d of %d steps", done + FEW, f->steps);
    }
    *seconds = clock_seconds() - p.started;
    progress_end(&p);
}

/* The world after its steps, and how long they took. Threads come in by two fields of the
   description; without them the caller's thread does all the work. */
static inline dem2d_world *run_fall(const fall *f, dem2d_parallel_fn *parallel_for, void *user,
                                    double *seconds) {
    dem2d_world_desc scene = {0};
    dem2d_material_desc stone = {.density = 2700, .friction = 0.4}; // kg/m2
    stone.normal_stiffness = stone.tangential_stiffness = 1e7;      // N/m
    dem2d_material_id material;
    dem2d_world *world;
    const double width = 0.065 * sqrt(f->particles); // m: grains fill 0.45 of the region
    scene.time_step = 1e-4;
    scene.gravity.y = -9.81;
    scene.parallel_for = parallel_for;
    scene.parallel_user = user;
    scene.env = example_env();
    must(dem2d_world_create(&scene, &world), "world");
    must(dem2d_world_add_material(world, &stone, &material), "material");
    add_box(world, material, width);
    add_falling(world, material, f->particles, width);
    take_fall(world, f, parallel_for != NULL ? "several threads" : "one thread", seconds);
    return world;
}

/* Whether all grains of two worlds lie and move alike, to the last bit. */
static inline bool same_motion(const dem2d_world *a, const dem2d_world *b, int particles) {
    dem2d_particle_id *ids = get_memory(NULL, (size_t)particles, sizeof *ids);
    int count;
    must(dem2d_world_particles(a, ids, particles, &count), "particles");
    bool same = count == particles;
    for (int i = 0; i < count && same; i++) {
        dem2d_particle_info p, q;
        must(dem2d_world_get_particle(a, ids[i], &p), "particle");
        must(dem2d_world_get_particle(b, ids[i], &q), "particle");
        same = memcmp(&p.pose, &q.pose, sizeof p.pose) == 0 &&
               memcmp(&p.velocity, &q.velocity, sizeof p.velocity) == 0 &&
               memcmp(&p.angular_velocity, &q.angular_velocity, sizeof p.angular_velocity) == 0;
    }
    free(ids);
    return same;
}

/* Runs the scene without and with threads and prints both times; the exit status. */
static inline int compare_falls(const fall *f, dem2d_parallel_fn *parallel_for, void *user) {
    double one, several;
    catch_interrupt();
    dem2d_world *a = run_fall(f, NULL, NULL, &one);
    dem2d_world *b = run_fall(f, parallel_for, user, &several);
    const bool same = same_motion(a, b, f->particles);
    printf("%d grains, %d steps: 1 thread %.3f s, %d threads %.3f s, ratio %.2f, %s\n",
           f->particles, f->steps, one, f->threads, several, one / several,
           same ? "the same bits" : "DIFFERENT");
    dem2d_world_destroy(a);
    dem2d_world_destroy(b);
    return same ? STATUS_OK : STATUS_FAILED;
}

#endif
