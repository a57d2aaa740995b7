/* drag.c - loads that a callback sets in each step. Three discs of different size sink in oil, with
   a drag F = -c v; then a magnet above them pulls the steel ones up to its pole, with a force that
   falls with the square of the distance, and holds them. Fails unless the speeds are those of the
   closed form, v = g m/c (1 - exp(-c t/m)), to 1e-3, and the pole bears magnet less weight. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { DISCS = 3 };
static const double gravity = 9.81, drag = 400; /* m/s2; N s/m */

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "drag: %s\n", dem2d_result_text(result));
    exit(1);
}

typedef struct forces {
    dem2d_particle_id discs[DISCS];
    double magnet; /* N m: force times the square of the distance; 0: off */
    dem2d_vec pole;
    double lift[DISCS]; /* N/m, of the magnet, as set last */
} forces;

/* Called at the start of each step, with the world as it is. */
static void set_loads(void *user, dem2d_world *world) {
    forces *f = user;
    for (int i = 0; i < DISCS; i++) {
        dem2d_particle_info disc;
        check(dem2d_world_get_particle(world, f->discs[i], &disc));
        dem2d_vec load = {-drag * disc.velocity.x, -drag * disc.velocity.y};
        f->lift[i] = 0;
        if (disc.user_data == 1) { /* steel */
            const double up = f->pole.y - disc.pose.position.y;
            f->lift[i] = f->magnet / (up * up);
            load.y += f->lift[i];
        }
        check(dem2d_world_set_load(world, f->discs[i], load, 0));
    }
}

int main(void) {
    static const double radius[DISCS] = {0.05, 0.1, 0.15};
    forces f = {.pole = {0, 3}};
    const dem2d_world_desc desc = {.time_step = 1e-5, /* c dt/m below 1e-3 of the lightest */
                                   .gravity = {0, -gravity},
                                   .loads = set_loads,
                                   .loads_user = &f,
                                   .ledger = true};
    const dem2d_material_desc steel = {7800, 1e7, 5e6, 0.3, .damping_ratio = 0.2};
    dem2d_world *world;
    dem2d_shape *disc;
    dem2d_particle_desc grain = {.motion = DEM2D_FREE};
    dem2d_wall_desc ceiling = {.point = {0, 0.9}, .normal = {0, -1}}; /* below the pole */
    dem2d_wall_id wall;
    dem2d_ledger ledger;
    int failed = 0;
    check(dem2d_world_create(&desc, &world));
    check(dem2d_world_add_material(world, &steel, &grain.material));
    check(dem2d_shape_create_circle(NULL, 1, &disc));
    check(dem2d_world_add_shape(world, disc, &grain.shape));
    dem2d_shape_destroy(disc);
    ceiling.material = grain.material;
    check(dem2d_world_add_wall(world, &ceiling, &wall));
    for (int i = 0; i < DISCS; i++) {
        grain.scale = radius[i], grain.position.x = 0.5 * i, grain.user_data = i != 1;
        check(dem2d_world_add_particle(world, &grain, &f.discs[i]));
    }
    for (double time = 0.1; time < 0.45; time += 0.1) {
        check(dem2d_world_step(world, 10000, NULL));
        printf("%.1f s:", time);
        for (int i = 0; i < DISCS; i++) {
            dem2d_particle_info info; /* the velocity is of half a step before */
            check(dem2d_world_get_particle(world, f.discs[i], &info));
            const double rate = drag / info.mass, at = time - desc.time_step / 2;
            const double expected = -gravity / rate * (1 - exp(-rate * at));
            printf("  %.4f m/s (%.4f)", info.velocity.y, expected);
            failed += fabs(info.velocity.y / expected - 1) > 1e-3;
        }
        printf("\n");
    }
    check(dem2d_world_ledger(world, &ledger)); /* drag takes energy out, and all is accounted for */
    failed += ledger.loads >= 0 || fabs(ledger.closure) > 1e-9 * ledger.turnover;
    f.magnet = 2e5;
    check(dem2d_world_step(world, 400000, NULL));
    for (int i = 0; i < DISCS; i++) {
        dem2d_particle_info info;
        check(dem2d_world_get_particle(world, f.discs[i], &info));
        const double rest = f.lift[i] - info.mass * gravity;
        printf("disc %d: at %.3f m, the ceiling pushes with %.1f N/m (%.1f)\n", i,
               info.pose.position.y, -info.force.y, i == 1 ? 0 : rest);
        failed += i == 1 ? info.force.y != 0 : fabs(-info.force.y / rest - 1) > 1e-3;
    }
    dem2d_world_destroy(world);
    return failed > 0;
}
