/* drum.c - a rotating drum, half full of Fourier grains: its angle of repose with 60 and with 600
   segments. The centre of all grains lies square to their surface, so that its direction is the
   angle. Fails unless both angles are the same within their scatter. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { GRAINS = 90 };
static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "drum: %s\n", dem2d_result_text(result));
    exit(1);
}

static dem2d_wall_id add_drum(dem2d_world *world, dem2d_material_id material, int segments) {
    dem2d_vec points[600];
    dem2d_wall_desc drum = {0};
    dem2d_wall_id id;
    for (int i = 0; i < segments; i++) {
        dem2d_rot q = dem2d_rot_make(6.283185307179586 * i / segments);
        points[i].x = 0.5 * q.c, points[i].y = 0.5 * q.s;
    }
    drum.material = material, drum.mode = DEM2D_WALL_MOVING;
    drum.points = points, drum.count = segments, drum.closed = true;
    drum.angular_velocity = 2; /* about {0, 0} */
    check(dem2d_world_add_wall(world, &drum, &id));
    return id;
}

/* Mean and standard deviation of the angle (degrees) over the last two of four seconds. */
static void run(int segments, double *mean, double *scatter) {
    static const double a[4] = {0.06, 0, 0.003, 0.0012}, b[4] = {0};
    const dem2d_world_desc desc = {.time_step = 1e-4, .gravity = {0, -9.81}};
    const dem2d_material_desc stone = {2700, 1e6, 5e5, 0.5, .damping_ratio = 0.2};
    dem2d_world *world;
    dem2d_material_id material;
    dem2d_shape *shape;
    dem2d_particle_desc grain = {.scale = 1};
    dem2d_particle_id ids[GRAINS];
    double sum = 0, squares = 0, angle;
    check(dem2d_world_create(&desc, &world));
    check(dem2d_world_add_material(world, &stone, &material));
    check(dem2d_shape_create_fourier(NULL, a, b, 3, &shape));
    check(dem2d_world_add_shape(world, shape, &grain.shape));
    dem2d_shape_destroy(shape);
    dem2d_wall_id drum = add_drum(world, material, segments);
    for (int i = 0; i < GRAINS; i++) {
        grain.position.x = 0.072 * (i % 9 - 4), grain.position.y = 0.072 * (double)(i / 9) - 0.31;
        grain.material = material, grain.angle = i;
        check(dem2d_world_add_particle(world, &grain, &ids[i]));
    }
    for (int frame = 0; frame < 400; frame++) {
        dem2d_vec centre = {0, 0};
        check(dem2d_world_step(world, 100, NULL));
        for (int i = 0; i < GRAINS; i++) {
            dem2d_particle_info info;
            check(dem2d_world_get_particle(world, ids[i], &info));
            centre.x += info.pose.position.x / GRAINS, centre.y += info.pose.position.y / GRAINS;
        }
        angle = 57.29577951308232 * atan2(centre.x, -centre.y);
        if (frame >= 200) sum += angle / 200, squares += angle * angle / 200;
    }
    dem2d_wall_info wall;
    check(dem2d_world_get_wall(world, drum, &wall));
    check(dem2d_world_write_svg(world, NULL, segments == 60 ? "drum_60.svg" : "drum_600.svg"));
    *mean = sum, *scatter = sqrt(squares - sum * sum);
    printf("%3d segments: %.1f degrees, scatter %.1f, torque %.0f N\n", segments, sum, *scatter,
           wall.torque);
    dem2d_world_destroy(world);
}

int main(void) {
    double mean[2], scatter[2];
    run(60, &mean[0], &scatter[0]);
    run(600, &mean[1], &scatter[1]);
    return fabs(mean[1] - mean[0]) > scatter[0] + scatter[1] || mean[0] < 15 || mean[0] > 50;
}
