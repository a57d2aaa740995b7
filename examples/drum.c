/* drum.c - a rotating drum, half full of Fourier grains: its angle of repose with 60 and with 600
   segments, by the direction of the grains' centre. Fails unless both means are the same within
   three standard errors, means over a second being independent. --quick: one run of 6 s, not three
   of 22 s. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GRAINS = 90 };
static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "drum: %s\n", dem2d_result_text(result));
    exit(1);
}

static void add_drum(dem2d_world *world, dem2d_material_id material, int segments) {
    dem2d_vec points[600];
    dem2d_wall_desc drum = {.mode = DEM2D_WALL_MOVING, .angular_velocity = 2}; /* about {0, 0} */
    dem2d_wall_id id;
    for (int i = 0; i < segments; i++) {
        dem2d_rot q = dem2d_rot_make(6.283185307179586 * i / segments);
        points[i].x = 0.5 * q.c, points[i].y = 0.5 * q.s;
    }
    drum.material = material, drum.points = points, drum.count = segments, drum.closed = true;
    check(dem2d_world_add_wall(world, &drum, &id));
}

/* Angle (degrees) in blocks of a second, after two: adds their number, sum and sum of squares. */
static void run(int segments, int seed, int seconds, double sums[3]) {
    static const double a[4] = {0.06, 0, 0.003, 0.0012}, b[4] = {0};
    const dem2d_world_desc desc = {.time_step = 1e-4, .gravity = {0, -9.81}};
    const dem2d_material_desc stone = {2700, 1e6, 5e5, 0.5, .damping_ratio = 0.2};
    dem2d_particle_desc grains[GRAINS] = {{.scale = 1}};
    dem2d_fill_desc fill = {.grains = grains, .count = GRAINS, .seed = (uint64_t)seed};
    dem2d_filling filling;
    dem2d_particle_id ids[GRAINS];
    dem2d_particle_info info;
    dem2d_world *world;
    dem2d_shape *shape;
    check(dem2d_world_create(&desc, &world));
    check(dem2d_world_add_material(world, &stone, &grains[0].material));
    check(dem2d_shape_create_fourier(NULL, a, b, 3, &shape));
    check(dem2d_world_add_shape(world, shape, &grains[0].shape));
    dem2d_shape_destroy(shape);
    add_drum(world, grains[0].material, segments);
    for (int i = 1; i < GRAINS; i++) grains[i] = grains[0];
    fill.region.box = (dem2d_box){{-0.35, -0.35}, {0.35, 0.35}};
    check(dem2d_world_fill(world, &fill, ids, GRAINS, &filling));
    for (int second = 0; second < seconds; second++) {
        double mean = 0;
        for (int frame = 0; frame < 100; frame++) {
            double x = 0, y = 0;
            check(dem2d_world_step(world, 100, NULL));
            for (int i = 0; i < GRAINS; i++, x += info.pose.position.x, y += info.pose.position.y)
                check(dem2d_world_get_particle(world, ids[i], &info));
            mean += 57.29577951308232 / 100 * atan2(x, -y);
        }
        if (second >= 2) sums[0] += 1, sums[1] += mean, sums[2] += mean * mean;
    }
    check(dem2d_world_write_svg(world, NULL, segments == 60 ? "drum_60.svg" : "drum_600.svg"));
    dem2d_world_destroy(world);
}

int main(int count, char **arguments) {
    const bool quick = count > 1 && strcmp(arguments[1], "--quick") == 0;
    double mean[2], error[2];
    for (int k = 0; k < 2; k++) {
        double sums[3] = {0};
        for (int seed = 0; seed < (quick ? 1 : 3); seed++)
            run(k == 0 ? 60 : 600, seed, quick ? 6 : 22, sums);
        mean[k] = sums[1] / sums[0];
        error[k] = sqrt((sums[2] / sums[0] - mean[k] * mean[k]) / (sums[0] - 1));
        printf("%3d segments: %.2f degrees, standard error %.2f, of %g seconds\n",
               k == 0 ? 60 : 600, mean[k], error[k], sums[0]);
    }
    return fabs(mean[1] - mean[0]) > 3 * hypot(error[0], error[1]) || mean[0] < 15 || mean[0] > 50;
}
