/* hopper.c - discs run out of a hopper whose sides are chains of three points, and what has left comes
   in again at the top. Fails unless the hopper keeps its mass within a grain, no disc passes through
   a wall, and the rate is steady and 0.4 to 1.5 times Beverloo's law in the plane,
   C rho sqrt(g) (D - k d)^1.5 with C = 0.82 and k = 1.4. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "hopper: %s\n", dem2d_result_text(result));
    exit(1);
}

int main(void) {
    static const dem2d_vec left[3] = {{-0.4, 1.6}, {-0.4, 0.4}, {-0.1, 0}};
    static const dem2d_vec right[3] = {{0.1, 0}, {0.4, 0.4}, {0.4, 1.6}};
    static const dem2d_grade sizes[2] = {{0.03, 0}, {0.036, 1}}; /* m, and the part of the mass */
    static const dem2d_region below = {.box = {{-0.4, -9}, {0.4, -0.2}}};
    static const dem2d_region astray[2] = {{.box = {{-9, -9}, {-0.4, 9}}},
                                           {.box = {{0.4, -9}, {9, 9}}}};
    const dem2d_world_desc desc = {.time_step = 1e-4, .gravity = {0, -9.81}};
    const dem2d_material_desc stone = {2700, 1e6, 5e5, 0.3, .damping_ratio = 0.3};
    dem2d_grain_kind kind = {.share = 1};
    dem2d_world *world;
    dem2d_shape *disc;
    dem2d_wall_id wall;
    dem2d_filling filling;
    dem2d_flow out = {0}, lost = {0};
    dem2d_inlet inlet = {0};
    double passed[3]; /* kg/m: after 1, 2 and 3 s */
    check(dem2d_world_create(&desc, &world));
    check(dem2d_world_add_material(world, &stone, &kind.grain.material));
    check(dem2d_shape_create_circle(NULL, 1, &disc));
    check(dem2d_world_add_shape(world, disc, &kind.grain.shape));
    dem2d_shape_destroy(disc);
    for (int side = 0; side < 2; side++) {
        const dem2d_wall_desc chain = {
            .material = kind.grain.material, .points = side ? right : left, .count = 3};
        check(dem2d_world_add_wall(world, &chain, &wall));
    }
    const dem2d_grading_desc grading = {
        .points = sizes, .point_count = 2, .kinds = &kind, .kind_count = 1};
    dem2d_fill_desc fill = {.grading = &grading, .count = 400, .method = DEM2D_FILL_RANDOM};
    fill.region.box.lower = (dem2d_vec){-0.4, 0.4}, fill.region.box.upper = (dem2d_vec){0.4, 1.6};
    dem2d_inlet_desc refill = {.grading = &grading, .velocity = {0, -1}, .replaced = &out};
    refill.region.box.lower = (dem2d_vec){-0.4, 1.2},
    refill.region.box.upper = (dem2d_vec){0.4, 1.6};
    check(dem2d_world_fill(world, &fill, NULL, 0, &filling));
    for (int k = 0; k < 300; k++) {
        check(dem2d_world_step(world, 100, NULL)); /* 0.01 s */
        check(dem2d_world_remove_in(world, &below, &out));
        check(dem2d_world_feed(world, &refill, 0, &inlet));
        if (k % 100 == 99) passed[k / 100] = out.mass;
    }
    for (int side = 0; side < 2; side++) check(dem2d_world_remove_in(world, &astray[side], &lost));
    check(dem2d_world_write_svg(world, NULL, "hopper.svg"));
    dem2d_world_destroy(world);
    const double size = 0.033;                                              /* m, mean diameter */
    const double rates[2] = {passed[1] - passed[0], passed[2] - passed[1]}; /* kg/(m s) */
    const double beverloo = 0.82 * 2700 * sqrt(9.81) * pow(0.2 - 1.4 * size, 1.5);
    const double ratio = (rates[0] + rates[1]) / 2 / beverloo;
    printf("%d out, %d in, %.2f kg due, %d astray, rate / law %.2f and %.2f\n", (int)out.count,
           (int)inlet.count, inlet.due, (int)lost.count, rates[0] / beverloo, rates[1] / beverloo);
    return lost.count > 0 || inlet.due > 2.75 || fabs(rates[0] / rates[1] - 1) > 0.15 ||
           ratio < 0.4 || ratio > 1.5;
}
