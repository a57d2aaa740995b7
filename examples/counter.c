/* counter.c - a belt carries light and dark discs over its end; below it a sensor, a segment that
   touches nothing, counts what falls through, each kind by its group. A gate, which only the dark
   ones meet, throws these into a bin of their own. Fails unless both sensors count every disc of
   their kind once. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

enum { DISCS = 20, LIGHT = 1, DARK = 2 }; /* groups: a bit each */

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "counter: %s\n", dem2d_result_text(result));
    exit(1);
}

/* Counts the discs that overlap a sensor and did not when it was asked before. */
static int count_new(dem2d_world *world, dem2d_wall_id sensor, bool inside[DISCS]) {
    dem2d_found found[DISCS];
    bool now[DISCS] = {false};
    int count, fresh = 0;
    check(dem2d_world_wall_overlaps(world, sensor, NULL, found, DISCS, &count));
    for (int i = 0; i < count; i++) {
        dem2d_particle_info disc;
        check(dem2d_world_get_particle(world, found[i].particle, &disc));
        now[disc.user_data] = true; /* our own number */
    }
    for (int i = 0; i < DISCS; i++) fresh += now[i] && !inside[i], inside[i] = now[i];
    return fresh;
}

int main(void) {
    const dem2d_world_desc desc = {.time_step = 1e-4, .gravity = {0, -9.81}};
    const dem2d_material_desc rubber = {1000,
                                        1e6,
                                        5e5,
                                        0.8,
                                        .damping_ratio = 0.3,
                                        .rolling_friction = 0.2}; /* else they roll on it */
    dem2d_wall_desc belt = {.segment = true, .point = {-6, 0}, .end = {0, 0}, .surface_speed = 1.5};
    dem2d_wall_desc gate = {.segment = true, .point = {-0.5, -1.2}, .end = {1.2, -0.5}};
    dem2d_wall_desc sensors[2] = {{.segment = true, .point = {-3, -2}, .end = {3, -2}},
                                  {.segment = true, .point = {-3, -2}, .end = {3, -2}}};
    dem2d_wall_id wall, ids[2];
    dem2d_world *world;
    dem2d_shape *disc;
    dem2d_particle_desc grain = {.scale = 1, .position = {0, 0.05}};
    dem2d_particle_id id;
    bool inside[2][DISCS] = {{false}};
    int counted[2] = {0, 0};
    check(dem2d_world_create(&desc, &world));
    check(dem2d_world_add_material(world, &rubber, &grain.material));
    check(dem2d_shape_create_circle(NULL, 0.05, &disc));
    check(dem2d_world_add_shape(world, disc, &grain.shape));
    dem2d_shape_destroy(disc);
    belt.material = gate.material = grain.material;
    gate.groups.mask = DARK; /* the light ones fall through it */
    check(dem2d_world_add_wall(world, &belt, &wall));
    check(dem2d_world_add_wall(world, &gate, &wall));
    for (int k = 0; k < 2; k++) {
        sensors[k].material = grain.material;
        sensors[k].groups.sensor = true;
        sensors[k].groups.mask = k == 0 ? LIGHT : DARK;
        check(dem2d_world_add_wall(world, &sensors[k], &ids[k]));
    }
    for (int i = 0; i < DISCS; i++) {
        grain.position.x = -5.5 + 0.25 * i;
        grain.groups.category = i % 4 == 3 ? DARK : LIGHT;
        grain.user_data = (uint64_t)i;
        check(dem2d_world_add_particle(world, &grain, &id));
    }
    for (int frame = 0; frame < 800; frame++) { /* a disc takes 16 ms or more through a line */
        check(dem2d_world_step(world, 100, NULL));
        for (int k = 0; k < 2; k++) counted[k] += count_new(world, ids[k], inside[k]);
    }
    printf("light: %d of %d, dark: %d of %d\n", counted[0], DISCS - DISCS / 4, counted[1],
           DISCS / 4);
    check(dem2d_world_write_svg(world, NULL, "counter.svg"));
    dem2d_world_destroy(world);
    return counted[0] != DISCS - DISCS / 4 || counted[1] != DISCS / 4;
}
