/* packing.c - from a grading to a sheared sample: fill a box, grow the grains to 100 kPa, compress
   at constant lateral stress, write pictures and packing.csv. Fails unless the sample is packed, and
   bears a stress ratio as dense frictional grains do. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <stdio.h>
#include <stdlib.h>

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "packing: %s\n", dem2d_result_text(result));
    exit(1);
}

int main(void) {
    const dem2d_world_desc desc = {.time_step = 1e-6, .local_damping = 0.2};
    const dem2d_material_desc stone = {2700, 1e8, 1e8, 0.5, .damping_ratio = 0.2};
    const dem2d_material_desc smooth = {.density = 2700, .normal_stiffness = 1e8};
    static const dem2d_vec in[4] = {{0, 1}, {1, 0}, {-1, 0}, {0, -1}}; // normals
    static const dem2d_grade curve[3] = {{1, 0}, {1.5, 0.4}, {2, 1}};  // relative sizes
    dem2d_wall_desc wall[4];                                           // floor, left, right, top
    dem2d_wall_id walls[4];
    dem2d_grain_kind kinds[2] = {{.share = 0.7}, {.share = 0.3}}; // of the mass
    dem2d_material_id plate;
    dem2d_world *world;
    dem2d_shape *shapes[2];
    check(dem2d_world_create(&desc, &world));
    check(dem2d_world_add_material(world, &stone, &kinds[0].grain.material));
    check(dem2d_world_add_material(world, &smooth, &plate)); // no tangential spring: no friction
    for (int i = 0; i < 4; i++) {
        wall[i] = (dem2d_wall_desc){.material = plate, .normal = in[i], .point = {i == 2, i == 3}};
        check(dem2d_world_add_wall(world, &wall[i], &walls[i]));
    }
    check(dem2d_shape_create_circle(NULL, 1, &shapes[0]));
    check(dem2d_shape_create_ellipse(NULL, 1.4, 0.8, &shapes[1]));
    for (int i = 0; i < 2; i++) {
        kinds[i].grain.material = kinds[0].grain.material;
        check(dem2d_world_add_shape(world, shapes[i], &kinds[i].grain.shape));
        dem2d_shape_destroy(shapes[i]);
    }
    const dem2d_grading_desc grading = {curve, 3, kinds, 2, .measure = DEM2D_MEASURE_MASS};
    dem2d_fill_desc fill = {.grading = &grading, .count = 500, .solid_fraction = 0.45};
    fill.region.box.upper = (dem2d_vec){1, 1}, fill.method = DEM2D_FILL_RANDOM;
    const dem2d_growth_desc grow = {1, 1e5, .friction = 0.1, .local_damping = 0.2}; // m2, Pa
    dem2d_filling filling;
    dem2d_growth packed;
    double dt, solid = 1, ratio = 0, peak = 0;
    check(dem2d_world_fill(world, &fill, NULL, 0, &filling));
    check(dem2d_world_choose_time_step(world, 0.8, &dt));
    check(dem2d_world_set_time_step(world, dt));
    check(dem2d_world_grow(world, &grow, 200000, &packed));
    printf("%d grains, solid fraction %.4f at %.1f kPa after %d steps\n", filling.count,
           packed.solid_fraction, packed.stress / 1e3, packed.steps);
    check(dem2d_world_write_svg(world, &(dem2d_svg_desc){.force_chains = true}, "packing.svg"));
    wall[2].mode = DEM2D_WALL_SERVO, wall[2].stress = 1e5, wall[2].max_speed = 1;
    wall[2].spans[0] = walls[0], wall[2].spans[1] = walls[3];
    wall[3].mode = DEM2D_WALL_MOVING, wall[3].velocity.y = -0.2; // an inertial number of 3e-4
    for (int i = 2; i < 4; i++) check(dem2d_world_set_wall(world, walls[i], &wall[i]));
    for (double height = 1; height > 0.92;) {
        dem2d_wall_info side, top;
        const bool append = height < 1;
        check(dem2d_world_step(world, 500, NULL));
        check(dem2d_world_get_wall(world, walls[2], &side));
        check(dem2d_world_get_wall(world, walls[3], &top));
        height = top.point.y, solid = packed.solid_fraction / (height * side.point.x);
        const double axial = top.force.y / side.point.x, lateral = side.stress;
        ratio = (axial - lateral) / (axial + lateral); // sine of the mobilised angle of friction
        peak = ratio > peak ? ratio : peak;
        const char *const names[3] = {"strain", "ratio", "solid_fraction"};
        const double values[3] = {dem2d_strain(height, 1), ratio, solid};
        const dem2d_csv_desc csv = {.count = 3, .names = names, .values = values, .append = append};
        check(dem2d_world_write_csv(world, &csv, "packing.csv"));
    }
    check(dem2d_world_write_svg(world, &(dem2d_svg_desc){.force_chains = true}, "sheared.svg"));
    printf("stress ratio up to %.3f, at the end %.3f; solid fraction %.4f\n", peak, ratio, solid);
    dem2d_world_destroy(world);
    return !packed.reached || !(peak > 0.3 && peak < 0.75 && solid < packed.solid_fraction);
}
