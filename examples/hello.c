// Thirty grains of three shapes fall into a box and come to rest.
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include <stdio.h>
#include <stdlib.h>

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "hello: %s\n", dem2d_result_text(result));
    exit(1);
}

int main(void) {
    dem2d_world_desc scene = {0};
    scene.time_step = 1e-4;  // s
    scene.gravity.y = -9.81; // m/s2
    scene.local_damping = 0.3; // brakes free fall too: to 0.7 g
    dem2d_world *world;
    check(dem2d_world_create(&scene, &world));

    dem2d_material_desc stone = {0};
    stone.density = 2700;         // kg/m2: kg/m3 for each metre of thickness
    stone.normal_stiffness = 1e7; // N/m
    stone.tangential_stiffness = 1e7;
    stone.friction = 0.4;
    dem2d_material_id material;
    check(dem2d_world_add_material(world, &stone, &material));

    const double normals[3][2] = {{0, 1}, {1, 0}, {-1, 0}}; // floor, left and right of 0.6 m
    for (int i = 0; i < 3; i++) {
        dem2d_wall_desc wall = {0};
        wall.material = material;
        wall.normal.x = normals[i][0], wall.normal.y = normals[i][1];
        wall.point.x = i == 2 ? 0.6 : 0;
        dem2d_wall_id id;
        check(dem2d_world_add_wall(world, &wall, &id));
    }
    const dem2d_vec corners[4] = {{0, 0}, {0.05, 0}, {0.06, 0.03}, {0.01, 0.05}};
    const double a[4] = {0.06, 0, 0.002, 0.001}, b[4] = {0, 0, 0, 0.001};
    dem2d_shape *shapes[3]; // an ellipse, a rounded polygon, a Fourier series
    dem2d_shape_id ids[3];
    check(dem2d_shape_create_ellipse(NULL, 0.035, 0.02, &shapes[0]));
    check(dem2d_shape_create_polygon(NULL, corners, 4, 0.004, &shapes[1]));
    check(dem2d_shape_create_fourier(NULL, a, b, 3, &shapes[2]));
    for (int i = 0; i < 3; i++) check(dem2d_world_add_shape(world, shapes[i], &ids[i]));
    for (int i = 0; i < 3; i++) dem2d_shape_destroy(shapes[i]); // the world has its own
    dem2d_particle_desc grains[30] = {{0}};
    for (int i = 0; i < 30; i++) {
        grains[i].scale = 1;
        grains[i].shape = ids[i % 3], grains[i].material = material;
    }
    dem2d_fill_desc fill = {0}; // at random places and angles, without overlaps
    fill.grains = grains, fill.count = 30;
    fill.region.box.upper.x = fill.region.box.upper.y = 0.6;
    dem2d_filling filling;
    check(dem2d_world_fill(world, &fill, NULL, 0, &filling));
    check(dem2d_world_step(world, 20000, NULL));
    check(dem2d_world_write_svg(world, &(dem2d_svg_desc){.force_chains = true}, "hello.svg"));
    dem2d_world_destroy(world);
}
