#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

int main(void) { // a hundred discs fall on a floor; each call returns a dem2d_result, DEM2D_OK is 0
    dem2d_world *world;
    dem2d_material_id stone;
    dem2d_shape_id shape;
    dem2d_particle_id grain;
    dem2d_wall_id ground;
    dem2d_shape *disc;
    dem2d_material_desc material = {.density = 2700, .normal_stiffness = 1e7, .friction = 0.5,
                                    .tangential_stiffness = 5e6, .damping_ratio = 0.2};
    dem2d_world_create(&(dem2d_world_desc){.time_step = 1e-4, .gravity = {0, -9.81}}, &world);
    dem2d_world_add_material(world, &material, &stone);
    dem2d_world_add_wall(world, &(dem2d_wall_desc){.material = stone, .normal = {0, 1}}, &ground);
    dem2d_shape_create_circle(NULL, 0.05, &disc); // m
    dem2d_world_add_shape(world, disc, &shape);
    for (int i = 0; i < 100; i++) {
        dem2d_particle_desc d = {.scale = 1, .shape = shape, .material = stone};
        d.position = (dem2d_vec){0.11 * (i % 10) + 0.01 * (i / 10 % 2), 0.1 + 0.11 * (i / 10)};
        dem2d_world_add_particle(world, &d, &grain);
    }
    dem2d_world_step(world, 10000, NULL); // 1 s
    dem2d_world_write_svg(world, NULL, "world.svg");
    dem2d_shape_destroy(disc), dem2d_world_destroy(world);
}
