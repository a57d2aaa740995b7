/* belt.c - a conveyor belt sorts grains by friction: boxes of three materials fall on it, slide
   with v = mu g t until they have its speed, and ride. Fails unless the speeds are these to 2 % and
   the boxes end in the order of their friction. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "belt: %s\n", dem2d_result_text(result));
    exit(1);
}

int main(void) {
    static const double friction[3] = {0.1, 0.2, 0.4}, speed = 1.5;
    static const dem2d_vec corners[4] = {{-0.1, -0.05}, {0.1, -0.05}, {0.1, 0.05}, {-0.1, 0.05}};
    const dem2d_world_desc desc = {.time_step = 2e-5, .gravity = {0, -9.81}};
    dem2d_world *world;
    dem2d_shape *box;
    dem2d_shape_id shape;
    dem2d_particle_id ids[3];
    dem2d_wall_id belt;
    dem2d_wall_desc wall = {.normal = {0, 1}, .surface_speed = speed}; /* it stands still */
    dem2d_particle_info info, before = {0};
    int failed = 0;
    check(dem2d_world_create(&desc, &world));
    check(dem2d_shape_create_polygon(NULL, corners, 4, 0, &box));
    check(dem2d_world_add_shape(world, box, &shape));
    dem2d_shape_destroy(box);
    for (int i = 0; i < 3; i++) {
        const dem2d_material_desc material = {2700, 1e7, 5e6, friction[i], .damping_ratio = 0.5};
        dem2d_particle_desc grain = {.scale = 1, .shape = shape, .position = {-2.0 * i, 0.05}};
        check(dem2d_world_add_material(world, &material, &grain.material));
        check(dem2d_world_add_particle(world, &grain, &ids[i]));
        wall.material =
            grain.material; /* the last one, which is rough: the least friction counts */
    }
    check(dem2d_world_add_wall(world, &wall, &belt));
    for (double time = 0.2; time < 2.1; time += 0.2) {
        check(dem2d_world_step(world, 10000, NULL));
        printf("%.1f s:", time);
        for (int i = 0; i < 3; i++) {
            const double slides = friction[i] * 9.81 * time;
            check(dem2d_world_get_particle(world, ids[i], &info));
            printf("  %.3f m/s at %.2f m", info.velocity.x, info.pose.position.x + 2 * i);
            failed += fabs(info.velocity.x - fmin(slides, speed)) > 0.02 * speed;
        }
        printf("\n");
    }
    for (int i = 0; i < 3; i++) { /* the way since its start, by friction */
        check(dem2d_world_get_particle(world, ids[i], &info));
        info.pose.position.x += 2 * i;
        failed += i > 0 && info.pose.position.x < before.pose.position.x + 0.2;
        before = info;
    }
    check(dem2d_world_write_svg(world, NULL, "belt.svg"));
    dem2d_world_destroy(world);
    return failed > 0;
}
