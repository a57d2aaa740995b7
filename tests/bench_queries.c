/* bench_queries [GRAINS] - time of queries of space and of reading in bulk, by kind of grain: rays
   into a dense bed, and into the same grains four times as far apart; boxes by what they find; all
   particles into arrays, with ids in the order of space and shuffled. Each figure is the least of
   some rounds; the first query, which makes the search tree, is a column of its own. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#define BENCH_NAME "bench_queries"
#include "bench_beds.h"

enum { RAYS = 1000, BOXES = 1000, ROUNDS = 15 };

static const char *const scene_names[SCENES] = {"discs",       "polygons",       "ellipses",
                                                "polybeziers", "Fourier series", "mixed"};

static dem2d_world *make_world(const bed *b) {
    const dem2d_material_desc stone = material_desc(DENSITY, STIFFNESS, STIFFNESS, FRICTION);
    dem2d_world_desc desc = {0};
    dem2d_material_id material;
    dem2d_world *world;
    dem2d_particle_id *ids = get_memory((size_t)b->count, sizeof *ids);
    desc.time_step = TIME_STEP, desc.particle_capacity = b->count;
    expect_ok(dem2d_world_create(&desc, &world), "world");
    expect_ok(dem2d_world_add_material(world, &stone, &material), "material");
    add_bed(world, b, material, ids);
    free(ids);
    return world;
}

/* --- rays --------------------------------------------------------------------------------------
 */

typedef struct rays {
    dem2d_vec from[RAYS], along[RAYS];
    int hits;
} rays;

/* From a circle around a square of a width to points in the square. */
static void draw_rays(rays *r, double width) {
    for (int i = 0; i < RAYS; i++) {
        const double angle = bed_uniform(-PI, PI);
        const dem2d_vec to = vec(bed_uniform(0, width), bed_uniform(0, width));
        r->from[i] = vec(width / 2 + width * cos(angle), width / 2 + width * sin(angle));
        r->along[i] = vec(to.x - r->from[i].x, to.y - r->from[i].y);
    }
}

/* Milliseconds. */
static double cast_rays(dem2d_world *world, rays *r) {
    double least = HUGE_VAL;
    dem2d_hit hit;
    for (int k = 0; k < ROUNDS; k++) {
        const double start = seconds();
        r->hits = 0;
        for (int i = 0; i < RAYS; i++) {
            expect_ok(dem2d_world_cast_ray(world, r->from[i], r->along[i], 0, NULL, &hit), "ray");
            r->hits += hit.found.particle.generation != 0;
        }
        least = fmin(least, seconds() - start);
    }
    return 1e3 * least;
}

static void time_rays(int scene, int count) {
    static rays r;
    bed b = draw_bed(scene, count, 1, 0.055 * sqrt(count));
    for (int loose = 0; loose < 2; loose++) {
        for (int i = 0; i < count && loose; i++) b.grains[i].x *= 4, b.grains[i].y *= 4;
        dem2d_world *world = make_world(&b);
        dem2d_hit hit;
        expect_ok(dem2d_world_step(world, 1, NULL), "step");
        const double start = seconds();
        expect_ok(dem2d_world_cast_ray(world, vec(-1, 0), vec(-1, 0), 0, NULL, &hit), "ray");
        const double tree = 1e3 * (seconds() - start);
        draw_rays(&r, (loose ? 4 : 1) * b.right);
        const double time = cast_rays(world, &r);
        printf("%-15s %-6s %8.3f %8.3f %6d\n", scene_names[scene], loose ? "loose" : "dense", time,
               tree, r.hits);
        dem2d_world_destroy(world);
    }
    free(b.grains);
}

/* --- boxes -------------------------------------------------------------------------------------
 */

static void time_boxes(int count) {
    bed b = draw_bed(MIXED, count, 1, 0.055 * sqrt(count));
    dem2d_world *world = make_world(&b);
    dem2d_found *found = get_memory((size_t)count, sizeof *found);
    for (double width = 0.05; width < b.right; width *= 3) {
        double least = HUGE_VAL;
        int64_t sum = 0;
        for (int k = 0; k < ROUNDS; k++) {
            const double start = seconds();
            sum = 0;
            for (int i = 0; i < BOXES; i++) {
                const double x = bed_uniform(0, b.right - width),
                             y = bed_uniform(0, b.right - width);
                const dem2d_box box = {{x, y}, {x + width, y + width}};
                int n;
                expect_ok(dem2d_world_query_box(world, &box, NULL, found, count, &n), "box");
                sum += n;
            }
            least = fmin(least, seconds() - start);
        }
        printf("%10.3f %10.1f %10.0f %10.1f\n", width, (double)sum / BOXES, 1e9 * least / BOXES,
               1e9 * least / (double)sum);
    }
    free(found), free(b.grains), dem2d_world_destroy(world);
}

/* --- bulk --------------------------------------------------------------------------------------
 */

/* Nanoseconds for each grain: pose, velocities, force and torque. */
static double time_reads(int scene, int count, bool shuffled) {
    bed b = draw_bed(scene, count, 1, 0.055 * sqrt(count));
    for (int i = count - 1; i > 0 && shuffled; i--) {
        const int k = (int)bed_uniform(0, i + 1);
        const grain other = b.grains[k];
        b.grains[k] = b.grains[i], b.grains[i] = other;
    }
    dem2d_world *world = make_world(&b);
    dem2d_vec *vectors = get_memory(3 * (size_t)count, sizeof *vectors);
    dem2d_rot *rotations = get_memory((size_t)count, sizeof *rotations);
    double *numbers = get_memory(3 * (size_t)count, sizeof *numbers), least = HUGE_VAL;
    dem2d_particle_arrays arrays = {0};
    arrays.positions = vectors, arrays.velocities = vectors + count;
    arrays.forces = vectors + 2 * count, arrays.torques = numbers;
    arrays.angular_velocities = numbers + count;
    if (scene == DISCS)
        arrays.angles = numbers + 2 * count;
    else
        arrays.rotations = rotations;
    int read;
    expect_ok(dem2d_world_step(world, 1, NULL), "step"); /* puts them in the order of space */
    expect_ok(dem2d_world_read_particles(world, &arrays, count, &read), "read");
    expect_ok(dem2d_world_step(world, 1, NULL), "step"); /* keeps the sums of forces */
    for (int k = 0; k < ROUNDS; k++) {
        const double start = seconds();
        expect_ok(dem2d_world_read_particles(world, &arrays, count, &read), "read");
        least = fmin(least, seconds() - start);
    }
    free(vectors), free(rotations), free(numbers), free(b.grains), dem2d_world_destroy(world);
    return 1e9 * least / count;
}

int main(int argc, char **argv) {
    const int count = argc > 1 ? atoi(argv[1]) : 10000;
    if (argc > 2 || count < 100) bench_fail("usage: bench_queries [GRAINS]");
    make_templates();
    printf("%d rays into %d grains\n%-15s %-6s %8s %8s %6s\n", RAYS, count, "grains", "bed", "ms",
           "tree, ms", "hits");
    for (int scene = 0; scene < SCENES; scene++) time_rays(scene, count);
    printf("\nboxes in %d mixed grains\n%10s %10s %10s %10s\n", count, "width, m", "found", "ns",
           "ns each");
    time_boxes(count);
    printf("\n%d grains into arrays: pose, velocities, force and torque\n%-15s %12s %14s\n",
           10 * count, "grains", "sorted, ns", "shuffled, ns");
    for (int scene = 0; scene < SCENES; scene += MIXED)
        printf("%-15s %12.1f %14.1f\n", scene_names[scene], time_reads(scene, 10 * count, false),
               time_reads(scene, 10 * count, true));
    return 0;
}
