/* mu_of_i.c - friction and solid fraction of sheared discs by the inertial number
   I = rate sqrt(m/P): a periodic cell without walls, sheared at a constant normal stress P. First a
   gas is pressed to a packing. Discs with diameters of 1 +- 0.2, friction 0.4, damping ratio 0.591,
   stiffness 1e4 P; m is the mass of the mean disc. Errors are those of the mean of ten parts of the
   time. Writes mu_of_i.csv.
       mu_of_i [GRAINS [STRAIN [SEED]]]       100 discs, a strain of 2 at each I, seed 1 */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "random.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { PARTS = 10, SAMPLES = 40 }; /* of the time of shear; of a part */

static const double pi = 3.14159265358979324, stiffness = 1e4; /* P = 1, m = 1, diameter 1 */
static const double dt = 0.12 / 100;                           /* 0.12 sqrt(m/kn) */

static void check(dem2d_result result) {
    if (result == DEM2D_OK) return;
    fprintf(stderr, "mu_of_i: %s\n", dem2d_result_text(result));
    exit(1);
}

/* Discs on a lattice that fill half of the cell, with slow random velocities. */
static dem2d_world *gas(int grains, uint64_t random) {
    const double width = sqrt(grains * pi / 4 / 0.5);
    const int side = (int)ceil(sqrt(grains));
    const dem2d_world_desc desc = {.time_step = dt, .cell = {{width, 0}, {0, width}, {0, 0}}};
    const dem2d_material_desc stone = {.density = 4 / pi,
                                       .normal_stiffness = stiffness,
                                       .tangential_stiffness = stiffness / 2,
                                       .friction = 0.4,
                                       .damping_ratio = 0.591};
    dem2d_world *world;
    dem2d_shape *disc;
    dem2d_particle_desc grain = {0};
    dem2d_particle_id id;
    check(dem2d_world_create(&desc, &world));
    check(dem2d_world_add_material(world, &stone, &grain.material));
    check(dem2d_shape_create_circle(NULL, 0.5, &disc));
    check(dem2d_world_add_shape(world, disc, &grain.shape));
    dem2d_shape_destroy(disc);
    for (int i = 0; i < grains; i++) {
        grain.scale = random_between(&random, 0.8, 1.2);
        grain.position.x = (i % side + 0.5) * width / side;
        grain.position.y = (i / side + 0.5) * width / side;
        grain.velocity.x = random_between(&random, -0.1, 0.1);
        grain.velocity.y = random_between(&random, -0.1, 0.1);
        check(dem2d_world_add_particle(world, &grain, &id));
    }
    return world;
}

static void step(dem2d_world *world, double time) {
    check(dem2d_world_step(world, (int)(time / dt + 0.5), NULL));
}

/* Mean and its error from the means of the parts. */
typedef struct mean {
    double value, error;
} mean;

static mean mean_of(const double parts[PARTS]) {
    mean m = {0, 0};
    for (int k = 0; k < PARTS; k++) m.value += parts[k] / PARTS;
    for (int k = 0; k < PARTS; k++) m.error += pow(parts[k] - m.value, 2);
    m.error = sqrt(m.error / (PARTS * (PARTS - 1)));
    return m;
}

/* Shears at a rate; a third of the strain first without measuring. Returns mu, and the solid
   fraction in phi. */
static mean shear(dem2d_world *world, double rate, double strain, mean *phi) {
    const dem2d_deformation_desc at = {.xy = rate, .hold_yy = true, .stress_yy = 1};
    const double time = strain / rate / (PARTS * SAMPLES);
    double mu[PARTS] = {0}, solid[PARTS] = {0};
    dem2d_packing packing;
    dem2d_cell_info cell;
    check(dem2d_world_deform(world, &at));
    step(world, strain / 3 / rate);
    check(dem2d_world_packing(world, &packing));
    for (int k = 0; k < PARTS * SAMPLES; k++) {
        step(world, time);
        check(dem2d_world_get_cell(world, &cell));
        mu[k / SAMPLES] -= (cell.contact.yx + cell.kinetic.yx) / SAMPLES;
        solid[k / SAMPLES] += packing.solid_area / cell.area / SAMPLES;
        if (k % 4 == 0)
            fprintf(stderr, "\rI = %g: %3d %%", rate, 100 * k / (PARTS * SAMPLES)), fflush(stderr);
    }
    fprintf(stderr, "\r               \r");
    *phi = mean_of(solid);
    return mean_of(mu);
}

int main(int count, char **arguments) {
    static const double numbers[] = {0.01, 0.03, 0.1};
    const int grains = count > 1 ? atoi(arguments[1]) : 100;
    const double strain = count > 2 ? atof(arguments[2]) : 2;
    const uint64_t seed = count > 3 ? (uint64_t)atoi(arguments[3]) : 1;
    const dem2d_deformation_desc press = {
        .hold_xx = true, .hold_yy = true, .stress_xx = 1, .stress_yy = 1};
    if (grains < 4 || !(strain > 0)) {
        fprintf(stderr, "usage: mu_of_i [GRAINS [STRAIN [SEED]]]\n");
        return 2;
    }
    dem2d_world *world = gas(grains, seed);
    dem2d_packing packing;
    FILE *file = fopen("mu_of_i.csv", "w");
    if (file == NULL) return fprintf(stderr, "mu_of_i: can't write mu_of_i.csv\n"), 1;
    check(dem2d_world_deform(world, &press));
    step(world, 30);
    check(dem2d_world_packing(world, &packing));
    printf("%d discs at rest: coordination number %.2f without rattlers\n", grains,
           packing.coordination_loaded);
    printf("%8s %18s %20s\n", "I", "mu", "solid fraction");
    fprintf(file, "I,mu,mu_error,phi,phi_error\n");
    bool right = true;
    double last = 0;
    for (int k = 0; k < 3; k++) {
        mean phi, mu = shear(world, numbers[k], strain, &phi);
        printf("%8g %10.4f +- %.4f %11.4f +- %.4f\n", numbers[k], mu.value, mu.error, phi.value,
               phi.error);
        fprintf(file, "%g,%.6f,%.6f,%.6f,%.6f\n", numbers[k], mu.value, mu.error, phi.value,
                phi.error);
        right = right && mu.value > 0.2 && mu.value < 0.5 && mu.value > last - 3 * mu.error;
        last = mu.value;
    }
    dem2d_world_destroy(world);
    return fclose(file) == 0 && right ? 0 : 1;
}
