/* hopper.c - discs run out of a hopper whose sides are chains of three points. Fails unless they run
   out, none through the walls, at a steady rate that is 0.4 to 1.5 times Beverloo's law in the
   plane, C rho sqrt(g) (D - k d)^1.5 with C = 0.82 and k = 1.4. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { GRAINS = 400 };

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "hopper: %s\n", dem2d_result_text(result));
    exit(1);
}

int main(void) {
    static const dem2d_vec left[3] = {{-0.4, 1.6}, {-0.4, 0.4}, {-0.1, 0}};
    static const dem2d_vec right[3] = {{0.1, 0}, {0.4, 0.4}, {0.4, 1.6}};
    const dem2d_world_desc desc = {.time_step = 1e-4, .gravity = {0, -9.81}};
    const dem2d_material_desc stone = {2700, 1e6, 5e5, 0.3, .damping_ratio = 0.3};
    dem2d_world *world;
    dem2d_material_id material;
    dem2d_shape *disc;
    dem2d_shape_id shape;
    dem2d_particle_id ids[GRAINS];
    dem2d_wall_id wall;
    int out = 0, early = 0, late = 0, astray = 0;
    double began = 0, time = 0;
    check(dem2d_world_create(&desc, &world));
    check(dem2d_world_add_material(world, &stone, &material));
    check(dem2d_shape_create_circle(NULL, 0.015, &disc));
    check(dem2d_world_add_shape(world, disc, &shape));
    dem2d_shape_destroy(disc);
    for (int side = 0; side < 2; side++) {
        const dem2d_wall_desc chain = {
            .material = material, .points = side ? right : left, .count = 3};
        check(dem2d_world_add_wall(world, &chain, &wall));
    }
    for (int i = 0; i < GRAINS; i++) {
        dem2d_particle_desc grain = {
            .scale = 1 + 0.1 * (i % 3), .shape = shape, .material = material};
        grain.position.x = 0.037 * (i % 20 - 9.5), grain.position.y = 0.42 + 0.037 * (i / 20);
        check(dem2d_world_add_particle(world, &grain, &ids[i]));
    }
    for (; out < GRAINS && time < 8; time += 0.01) {
        check(dem2d_world_step(world, 100, NULL));
        for (int i = out = astray = 0; i < GRAINS; i++) {
            dem2d_particle_info info;
            check(dem2d_world_get_particle(world, ids[i], &info));
            out += info.pose.position.y < 0;
            astray += info.pose.position.y > 0 && fabs(info.pose.position.x) > 0.4;
        }
        if (out < GRAINS / 4) began = time, early = out;
        if (out < 3 * GRAINS / 4) late = out;
        if (out == GRAINS / 2) check(dem2d_world_write_svg(world, NULL, "hopper.svg"));
        if (out >= 3 * GRAINS / 4) break;
    }
    const double area = 3.141592653589793 * 0.0165 * 0.0165, size = 0.033;
    const double rate = (late - early) * area / (time - began); /* m2/s */
    const double law = 0.82 * sqrt(9.81) * pow(0.2 - 1.4 * size, 1.5);
    printf("%d of %d out in %.2f s, %d astray, rate / law %.2f\n", out, GRAINS, time, astray, rate / law);
    dem2d_world_destroy(world);
    return astray > 0 || out < 3 * GRAINS / 4 || rate / law < 0.4 || rate / law > 1.5;
}
