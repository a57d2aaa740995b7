/* game.c - the loop of a game: 60 frames a second of 200 grains in a box. A ray from above picks the
   top grain, a spring pulls it to the mouse, hits become sounds. Fails unless the picked grain ends
   at the mouse, below it by its weight over the spring's stiffness, and hits were heard while the
   grains fell, the loudest as hard as their fall. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { GRAINS = 200, STEPS = 100, EVENTS = 4096 }; /* STEPS of a frame */

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "game: %s\n", dem2d_result_text(result));
    exit(1);
}

static struct player {
    dem2d_particle_id held; /* generation 0: nothing */
    dem2d_vec mouse;
} player = {{0, 0}, {1, 0}};

/* Called in each step: a spring and a dashpot between the held grain and the mouse. */
static void pull(void *user, dem2d_world *world) {
    const struct player *p = user;
    dem2d_particle_info grain;
    if (p->held.generation == 0) return;
    check(dem2d_world_get_particle(world, p->held, &grain));
    const double k = 200 * grain.mass, c = 20 * grain.mass; /* N/m, N s/m */
    const dem2d_vec x = grain.pose.position, v = grain.velocity;
    const dem2d_vec force = {k * (p->mouse.x - x.x) - c * v.x, k * (p->mouse.y - x.y) - c * v.y};
    check(dem2d_world_set_load(world, p->held, force, 0));
}

/* Contacts that have closed in this frame: as loud as they were fast. Returns the fastest. */
static double play_sounds(dem2d_world *world, int *played) {
    static dem2d_contact_event events[EVENTS];
    double fastest = 0;
    int count;
    check(dem2d_world_events(world, events, EVENTS, &count, NULL));
    for (int i = 0; i < count; i++) {
        if (events[i].kind != DEM2D_CONTACT_CLOSED || events[i].speed < 0.2) continue;
        fastest = fmax(fastest, events[i].speed); /* a game would play events[i] here */
        ++*played;
    }
    return fastest;
}

int main(void) {
    static const dem2d_vec above = {1, 9}, down = {0, -1};
    static const dem2d_vec corners[4] = {{0, 0}, {0.1, 0}, {0.1, 0.06}, {0, 0.06}};
    const dem2d_material_desc stone = {2700, 1e6, 5e5, 0.5, .damping_ratio = 0.2};
    const dem2d_query_desc grains = {.skip_walls = true};
    dem2d_world_desc desc = {.time_step = 1.0 / 60 / STEPS, .gravity = {0, -9.81}};
    dem2d_world *world;
    dem2d_shape *shapes[2];
    dem2d_shape_id ids[2];
    dem2d_particle_desc pile[GRAINS];
    const dem2d_fill_desc fill = {.grains = pile, .count = GRAINS, .region.box.upper = {2, 2}};
    dem2d_filling filling;
    dem2d_wall_desc walls[3] = {
        {.normal = {0, 1}}, {.normal = {1, 0}}, {.normal = {-1, 0}, .point = {2, 0}}};
    dem2d_wall_id wall;
    dem2d_particle_info grain;
    dem2d_hit hit = {0};
    double loudest = 0;
    int played = 0;
    desc.loads = pull, desc.loads_user = &player, desc.event_capacity = EVENTS;
    check(dem2d_world_create(&desc, &world));
    check(dem2d_world_add_material(world, &stone, &walls[0].material));
    check(dem2d_shape_create_circle(NULL, 0.05, &shapes[0]));
    check(dem2d_shape_create_polygon(NULL, corners, 4, 0.005, &shapes[1]));
    for (int k = 0; k < 2; k++) check(dem2d_world_add_shape(world, shapes[k], &ids[k]));
    for (int k = 0; k < 2; k++) dem2d_shape_destroy(shapes[k]); /* the world has its own */
    for (int k = 0; k < 3; k++) {
        walls[k].material = walls[0].material;
        check(dem2d_world_add_wall(world, &walls[k], &wall));
    }
    for (int i = 0; i < GRAINS; i++) /* two discs, two blocks, two discs ... */
        pile[i] = (dem2d_particle_desc){1, ids[i / 2 % 2], .material = walls[0].material};
    check(dem2d_world_fill(world, &fill, NULL, 0, &filling));
    for (int frame = 0; frame < 240; frame++) {
        if (frame == 120) { /* the button goes down: what is under the mouse? */
            check(dem2d_world_cast_ray(world, above, down, 0, &grains, &hit));
            player.held = hit.found.particle;
        }
        if (frame >= 120) player.mouse.y = fmin(hit.point.y + (frame - 120) / 60.0 * 2, 3);
        check(dem2d_world_step(world, STEPS, NULL));
        loudest = fmax(loudest, play_sounds(world, &played)); /* here a game would draw */
    }
    check(dem2d_world_get_particle(world, player.held, &grain));
    check(dem2d_world_write_svg(world, NULL, "game.svg"));
    printf("%d sounds, the loudest at %.2f m/s; the grain hangs %.4f m below the mouse\n", played,
           loudest, player.mouse.y - grain.pose.position.y);
    dem2d_world_destroy(world);
    return fabs(player.mouse.y - grain.pose.position.y - 9.81 / 200) > 1e-3 ||
           fabs(grain.pose.position.x - 1) > 1e-3 || played < GRAINS || loudest < 1 || loudest > 6;
}
