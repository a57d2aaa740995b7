/* mixer.c - a blade, an open chain of five points, turns in a drum and mixes discs of two kinds
   that lie side by side. Fails unless their centres come to within a fifth of their first distance,
   no disc leaves, and the motor does work: minus the torque on the blade times its speed. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { GRAINS = 160 };

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "mixer: %s\n", dem2d_result_text(result));
    exit(1);
}

/* From the centre of one kind to that of the other; how many discs are outside. */
static double apart(const dem2d_world *world, const dem2d_particle_id *ids, int *outside) {
    dem2d_vec d = {0, 0};
    *outside = 0;
    for (int i = 0; i < GRAINS; i++) {
        dem2d_particle_info info;
        check(dem2d_world_get_particle(world, ids[i], &info));
        const dem2d_vec x = info.pose.position;
        const double sign = i < GRAINS / 2 ? -2.0 / GRAINS : 2.0 / GRAINS;
        d.x += sign * x.x, d.y += sign * x.y;
        *outside += hypot(x.x, x.y) > 0.5;
    }
    return hypot(d.x, d.y);
}

int main(void) {
    static const dem2d_vec blade[5] = {{-0.4, 0.1}, {-0.35, 0}, {0, 0}, {0.35, 0}, {0.4, -0.1}};
    static const dem2d_box sides[2] = {{{-0.35, -0.35}, {0, 0.35}}, {{0, -0.35}, {0.35, 0.35}}};
    const dem2d_world_desc desc = {.time_step = 1e-4, .gravity = {0, -9.81}};
    const dem2d_material_desc stone = {2700, 1e6, 5e5, 0.3, .damping_ratio = 0.3};
    dem2d_wall_desc drum = {.count = 60, .closed = true};
    dem2d_vec ring[60];
    dem2d_world *world;
    dem2d_shape *disc;
    dem2d_particle_desc grains[GRAINS / 2] = {{.scale = 1}};
    dem2d_fill_desc fill = {.grains = grains, .count = GRAINS / 2, .method = DEM2D_FILL_RANDOM};
    dem2d_filling filling;
    dem2d_particle_id ids[GRAINS];
    dem2d_wall_id id, motor;
    double first = 0, last = 0, torque = 0;
    int outside = 0, count = 0;
    for (int i = 0; i < 60; i++) {
        const dem2d_rot q = dem2d_rot_make(6.283185307179586 * i / 60);
        ring[i].x = 0.5 * q.c, ring[i].y = 0.5 * q.s;
    }
    check(dem2d_world_create(&desc, &world));
    check(dem2d_world_add_material(world, &stone, &drum.material));
    drum.points = ring;
    check(dem2d_world_add_wall(world, &drum, &id));
    drum.points = blade, drum.count = 5, drum.closed = false;
    check(dem2d_world_add_wall(world, &drum, &motor));
    check(dem2d_shape_create_circle(NULL, 0.018, &disc));
    check(dem2d_world_add_shape(world, disc, &grains[0].shape));
    dem2d_shape_destroy(disc);
    grains[0].material = drum.material;
    for (int i = 1; i < GRAINS / 2; i++) grains[i] = grains[0];
    for (int k = 0; k < 2; k++) {
        fill.region.box = sides[k];
        check(dem2d_world_fill(world, &fill, ids + k * (GRAINS / 2), GRAINS / 2, &filling));
    }
    first = apart(world, ids, &outside);
    check(dem2d_world_drive_wall(world, motor, (dem2d_vec){0, 0}, 4)); /* about {0, 0} */
    for (int frame = 0; frame < 1000; frame++) {
        dem2d_wall_info info;
        check(dem2d_world_step(world, 100, NULL));
        check(dem2d_world_get_wall(world, motor, &info));
        torque += info.torque / 1000;
        if (frame >= 800) last += apart(world, ids, &outside) / 200, count += outside;
    }
    check(dem2d_world_write_svg(world, NULL, "mixer.svg"));
    printf("apart %.3f m, then %.3f m; %d outside; power %.0f W/m\n", first, last, count,
           -4 * torque);
    dem2d_world_destroy(world);
    return last > 0.2 * first || count > 0 || torque >= 0;
}
