/* bench_packing [--quick] [OUTDIR] - how densely samples fill space, beside published numbers.

   Random sequential addition (dem2d_world_fill) in a square periodic cell, of time tau = tries x
   area of a grain / area of the cell:
   - equal discs: the solid fraction approaches saturation as tau^-1/2 (J. Feder, J. Theor. Biol. 87
     (1980) 237): phi = 2 phi(4 tau) - phi(tau), and the exponent from three times. Saturation is
     at 0.547 (E. L. Hinrichsen, J. Feder, T. Jossang, J. Stat. Phys. 44 (1986) 793).
   - ellipses, which turn as well, by tau^-1/3 (P. Viot, G. Tarjus, S. M. Ricci, J. Talbot, J. Chem.
     Phys. 97 (1992) 5212): the maximum over the aspect ratio, published as 0.583 near 2.

   Growth (dem2d_world_grow) of discs of two sizes, 1 : 1.4, half of the number each, to 100 kPa in
   the same cell, by friction and by k_n/P. Without friction such discs jam at 0.842 (C. S. O'Hern,
   L. E. Silbert, A. J. Liu, S. R. Nagel, Phys. Rev. E 68 (2003) 011306) with 4 contacts each but
   for rattlers; with friction 0.5 they jam looser, with 3 to 4 contacts (S. Papanikolaou, C. S.
   O'Hern, M. D. Shattuck, Phys. Rev. Lett. 110 (2013) 198002). Grains overlap under the stress, so
   that phi falls to that of jamming as k_n/P rises. And of 5,000 mixed grains in a box: their time.
   A second run has the same hash.

   Writes packing.csv, packing.gp and, where gnuplot is installed, packing.svg to OUTDIR,
   build/bench_packing.out by default. --quick: smaller samples, one seed, wider bounds. Exit
   status: 0, 1 if a number is outside its bounds, 2 for bad usage. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#define BENCH_NAME "bench_packing"
#include "bench.h"

#define PRESSURE 1e5

static bool quick;
static int failures;
static FILE *table;

static void judge(const char *what, double got, double low, double high) {
    const bool good = got >= low && got <= high;
    printf("%-4s  %-52s %8.4f  in [%.4g, %.4g]\n", good ? "ok" : "FAIL", what, got, low, high);
    failures += !good;
}

/* A world with one material, in a periodic cell of side 1 or without one. */
static dem2d_world *open_world(bool periodic, double stiffness, double friction,
                               dem2d_material_id *material) {
    dem2d_material_desc stone = material_desc(2700, stiffness, stiffness, friction);
    dem2d_world_desc desc = {0};
    dem2d_world *world;
    stone.damping_ratio = 0.2;
    desc.time_step = 1e-6;
    if (periodic) desc.cell.a = vec(1, 0), desc.cell.b = vec(0, 1);
    expect_ok(dem2d_world_create(&desc, &world), "world");
    expect_ok(dem2d_world_add_material(world, &stone, material), "material");
    return world;
}

/* --- random sequential addition --------------------------------------------------------------- */

/* Solid fraction after a time, of grains of 1/room of the area each. The numbers of a seed are the
   same for all times: a longer time goes on with the packing of a shorter one. */
static double add_randomly(double aspect, int room, double time, uint64_t seed) {
    const double area = 1.0 / room; /* of a grain */
    const int count = (int)(0.65 * room);
    dem2d_particle_desc *grains = get_memory((size_t)count, sizeof *grains);
    dem2d_fill_desc fill = {0};
    dem2d_filling filling;
    dem2d_shape *shape;
    dem2d_particle_desc grain = {0};
    dem2d_world *world = open_world(true, 1e8, 0, &grain.material);
    const double minor = sqrt(area / (PI * aspect));
    if (aspect > 1)
        expect_ok(dem2d_shape_create_ellipse(NULL, aspect * minor, minor, &shape), "ellipse");
    else
        expect_ok(dem2d_shape_create_circle(NULL, minor, &shape), "disc");
    expect_ok(dem2d_world_add_shape(world, shape, &grain.shape), "shape");
    dem2d_shape_destroy(shape);
    grain.scale = 1;
    for (int i = 0; i < count; i++) grains[i] = grain;
    fill.grains = grains, fill.count = count, fill.method = DEM2D_FILL_RANDOM, fill.seed = seed;
    fill.tries = (int)(time * room / count), fill.partial = true;
    expect_ok(dem2d_world_fill(world, &fill, NULL, 0, &filling), "fill");
    dem2d_world_destroy(world);
    free(grains);
    return filling.solid_fraction;
}

typedef struct saturation {
    double aspect, fraction, error, exponent;
} saturation;

/* At saturation, by an approach as time^-power, with its standard error; and the exponent seen over
   the last three times, a factor of four apart. */
static saturation saturate(double aspect, int room, int seeds, double time, double power) {
    saturation s = {aspect, 0, 0, 0};
    double sum = 0, squares = 0, phi[3], steps[2] = {0, 0};
    for (int seed = 0; seed < seeds; seed++) {
        for (int k = 0; k < 3; k++)
            phi[k] = add_randomly(aspect, room, time * pow(4, k - 2), (uint64_t)seed + 1);
        const double end = phi[2] + (phi[2] - phi[1]) / (pow(4, power) - 1);
        for (int k = 0; k < 2; k++) steps[k] += phi[k + 1] - phi[k];
        sum += end, squares += end * end;
        fprintf(table, "rsa,%g,%d,%g,%.6f,%.6f,%.6f,%.6f\n", aspect, seed + 1, time, phi[0], phi[1],
                phi[2], end);
    }
    s.fraction = sum / seeds;
    if (seeds > 1) s.error = sqrt(fmax(0, squares / seeds - s.fraction * s.fraction) / (seeds - 1));
    s.exponent = log(steps[0] / steps[1]) / log(4);
    printf("aspect %4.2f: phi %.4f +- %.4f at saturation, approach tau^-%.2f\n", aspect, s.fraction,
           s.error, s.exponent);
    return s;
}

/* Place and height of the maximum: of the parabola through the greatest value and its neighbours.
 */
static dem2d_vec greatest_of(const saturation *s, int count) {
    int k = 1;
    for (int i = 1; i < count - 1; i++)
        if (s[i].fraction > s[k].fraction) k = i;
    const double x = s[k].aspect, left = s[k - 1].aspect - x, right = s[k + 1].aspect - x;
    const double dl = (s[k - 1].fraction - s[k].fraction) / left;
    const double dr = (s[k + 1].fraction - s[k].fraction) / right;
    const double bend = (dr - dl) / (right - left), slope = dl - bend * left;
    if (!(bend < 0)) return vec(x, s[k].fraction);
    return vec(x - slope / (2 * bend), s[k].fraction - slope * slope / (4 * bend));
}

static int run_additions(saturation *s) {
    static const double aspects[] = {1, 1.25, 1.5, 1.75, 2, 2.5, 3, 4};
    printf("random sequential addition in a periodic cell\n");
    s[0] = saturate(1, quick ? 4000 : 16000, quick ? 1 : 4, quick ? 256 : 1024, 0.5);
    for (int i = 1; i < COUNT_OF(aspects); i++)
        s[i] = saturate(aspects[i], quick ? 1000 : 8000, quick ? 1 : 4, quick ? 64 : 256, 1.0 / 3);
    const dem2d_vec most = greatest_of(s, COUNT_OF(aspects));
    const double wide = quick ? 4 : 1;
    judge("discs: phi at saturation", s[0].fraction, 0.547 - 0.002 * wide, 0.547 + 0.002 * wide);
    judge("discs: exponent of the approach", s[0].exponent, 0.5 - 0.1 * wide, 0.5 + 0.1 * wide);
    judge("ellipses: aspect ratio of the greatest phi", most.x, quick ? 1.2 : 1.5, quick ? 3 : 2.2);
    judge("ellipses: greatest phi", most.y, 0.583 - 0.005 * wide, 0.583 + 0.005 * wide);
    return COUNT_OF(aspects);
}

/* --- growth ----------------------------------------------------------------------------------- */

typedef struct grown {
    double fraction, coordination, rattlers, seconds;
    int steps;
    uint64_t hash;
} grown;

/* Fills a world, all of its cell or the unit box, with grains of a grading to a solid fraction of
   0.45, lets them grow to the pressure, and closes it. */
static grown grow(dem2d_world *world, bool periodic, const dem2d_grading_desc *grading, int count,
                  double friction, uint64_t seed) {
    const double start = read_clock(CLOCK_PROCESS_CPUTIME_ID);
    dem2d_fill_desc fill = {0};
    dem2d_growth_desc desc = {0};
    dem2d_filling filling;
    dem2d_growth done;
    dem2d_packing packing;
    grown g;
    fill.grading = grading, fill.count = count, fill.solid_fraction = 0.45, fill.seed = seed;
    fill.method = DEM2D_FILL_RANDOM;
    if (!periodic) fill.region.box.upper = vec(1, 1);
    expect_ok(dem2d_world_fill(world, &fill, NULL, 0, &filling), "fill");
    desc.area = 1, desc.stress = PRESSURE, desc.friction = friction, desc.local_damping = 0.2;
    expect_ok(dem2d_world_grow(world, &desc, 2000000, &done), "grow");
    if (!done.reached) bench_fail("friction %g: the stress is not reached", friction);
    expect_ok(dem2d_world_packing(world, &packing), "packing");
    g.fraction = done.solid_fraction, g.steps = done.steps;
    g.coordination = packing.coordination_loaded;
    g.rattlers = (double)packing.rattlers / count;
    g.hash = dem2d_world_hash(world);
    g.seconds = read_clock(CLOCK_PROCESS_CPUTIME_ID) - start;
    dem2d_world_destroy(world);
    return g;
}

static void add_kind(dem2d_world *world, dem2d_shape *shape, dem2d_grain_kind *kind) {
    kind->share = 1;
    expect_ok(dem2d_world_add_shape(world, shape, &kind->grain.shape), "shape");
    dem2d_shape_destroy(shape);
}

static grown grow_discs(int count, double friction, double stiffness, uint64_t seed) {
    static const dem2d_grade sizes[3] = {{1, 0.5}, {1.4, 0.5}, {1.4, 1}};
    dem2d_grain_kind kind = {0};
    dem2d_grading_desc grading = {0};
    dem2d_shape *disc;
    dem2d_world *world = open_world(true, stiffness * PRESSURE, friction, &kind.grain.material);
    expect_ok(dem2d_shape_create_circle(NULL, 1, &disc), "disc");
    add_kind(world, disc, &kind);
    grading.points = sizes, grading.point_count = 3, grading.measure = DEM2D_MEASURE_NUMBER;
    grading.kinds = &kind, grading.kind_count = 1;
    return grow(world, true, &grading, count, friction, seed);
}

/* Discs, ellipses and rounded polygons of a grading in a box of four walls, k_n/P 1e3. */
static grown grow_mixed(int count, double friction) {
    static const double planes[4][4] = {{0, 0, 0, 1}, {0, 0, 1, 0}, {1, 1, -1, 0}, {1, 1, 0, -1}};
    static const dem2d_vec corners[4] = {{-1, -0.7}, {1, -0.8}, {0.9, 0.6}, {-0.7, 0.9}};
    static const dem2d_grade curve[3] = {{1, 0}, {1.5, 0.4}, {2, 1}};
    dem2d_grain_kind kinds[3] = {{0}};
    dem2d_grading_desc grading = {0};
    dem2d_shape *shapes[3];
    dem2d_world *world = open_world(false, 1e3 * PRESSURE, friction, &kinds[0].grain.material);
    for (int i = 0; i < 4; i++) {
        dem2d_wall_desc wall = {0};
        dem2d_wall_id id;
        wall.material = kinds[0].grain.material;
        wall.point = vec(planes[i][0], planes[i][1]), wall.normal = vec(planes[i][2], planes[i][3]);
        expect_ok(dem2d_world_add_wall(world, &wall, &id), "wall");
    }
    expect_ok(dem2d_shape_create_circle(NULL, 1, &shapes[0]), "disc");
    expect_ok(dem2d_shape_create_ellipse(NULL, 1.3, 0.9, &shapes[1]), "ellipse");
    expect_ok(dem2d_shape_create_polygon(NULL, corners, 4, 0.2, &shapes[2]), "polygon");
    for (int i = 0; i < 3; i++) {
        kinds[i].grain.material = kinds[0].grain.material;
        add_kind(world, shapes[i], &kinds[i]);
    }
    grading.points = curve, grading.point_count = 3, grading.kinds = kinds, grading.kind_count = 3;
    return grow(world, false, &grading, count, friction, 1);
}

static void run_mixed(void) {
    const int count = quick ? 500 : 5000;
    printf("\n%d discs, ellipses and rounded polygons of a grading, to %g kPa in a box\n", count,
           PRESSURE / 1e3);
    for (int k = 0; k < 3; k++) {
        static const double friction[3] = {0.5, 0.1, 0};
        const grown g = grow_mixed(count, friction[k]);
        printf("friction %.1f: phi %.6f, %.3f contacts, %d steps, CPU %.1f s\n", friction[k],
               g.fraction, g.coordination, g.steps, g.seconds);
        fprintf(table, "mixed,%g,1,%g,%.6f,%.4f,%.4f,%d\n", friction[k], 1e3, g.fraction,
                g.coordination, g.rattlers, g.steps);
        if (k == 0)
            judge("the same bits in a second run", grow_mixed(count, friction[k]).hash == g.hash, 1,
                  1);
    }
}

enum { STIFFNESSES = 3, FRICTIONS = 2 };

static const double stiffnesses[STIFFNESSES] = {1e3, 1e4, 1e5}, frictions[FRICTIONS] = {0, 0.5};

static void run_growths(double (*phi)[STIFFNESSES]) {
    const int count = quick ? 300 : 1000;
    double contacts[FRICTIONS] = {0, 0};
    bool same = true;
    printf("\ngrowth of %d discs, 1 : 1.4, to %g kPa\nfriction   k_n/P     phi   contacts  "
           "rattlers   steps   CPU s\n",
           count, PRESSURE / 1e3);
    for (int f = 0; f < FRICTIONS; f++)
        for (int k = 0; k < (quick ? 2 : STIFFNESSES); k++) {
            const int seeds = quick || stiffnesses[k] > 1e4 ? 1 : 3; /* the stiffest take long */
            grown mean = {0, 0, 0, 0, 0, 0};
            for (int seed = 1; seed <= seeds; seed++) {
                const grown g = grow_discs(count, frictions[f], stiffnesses[k], (uint64_t)seed);
                mean.fraction += g.fraction / seeds, mean.coordination += g.coordination / seeds;
                mean.rattlers += g.rattlers / seeds, mean.seconds += g.seconds / seeds;
                mean.steps += g.steps / seeds;
                fprintf(table, "growth,%g,%d,%g,%.6f,%.4f,%.4f,%d\n", frictions[f], seed,
                        stiffnesses[k], g.fraction, g.coordination, g.rattlers, g.steps);
                if (k == 0 && seed == 1)
                    same =
                        same && grow_discs(count, frictions[f], stiffnesses[k], 1).hash == g.hash;
            }
            printf("%8.1f %7.0e  %.4f   %.3f      %.3f   %7d  %6.1f\n", frictions[f],
                   stiffnesses[k], mean.fraction, mean.coordination, mean.rattlers, mean.steps,
                   mean.seconds);
            phi[f][k] = mean.fraction;
            if (k == 1) contacts[f] = mean.coordination;
        }
    const double more = quick ? 0.01 : 0;
    judge("same hash in a second run", same, 1, 1);
    judge("friction 0, k_n/P 1e4: phi", phi[0][1], 0.832 - more, 0.848 + more);
    judge("friction 0, k_n/P 1e4: contacts", contacts[0], 3.9, 4.3);
    judge("friction 0.5, k_n/P 1e4: contacts", contacts[1], 3, 3.6);
    judge("phi at friction 0 less that at 0.5, k_n/P 1e4", phi[0][1] - phi[1][1], 0.02, 0.08);
}

/* --- output ----------------------------------------------------------------------------------- */

static void draw(const saturation *s, int count, double (*phi)[STIFFNESSES]) {
    FILE *file = create("packing.gp");
    fprintf(file, "set terminal svg size 1000,420\nset output 'packing.svg'\nset multiplot layout "
                  "1,2\nset grid\n$rsa << EOD\n");
    for (int i = 0; i < count; i++)
        fprintf(file, "%g %.5f %.5f\n", s[i].aspect, s[i].fraction, s[i].error);
    fprintf(file, "EOD\n$growth << EOD\n");
    for (int k = 0; k < (quick ? 2 : STIFFNESSES); k++)
        fprintf(file, "%g %.5f %.5f\n", stiffnesses[k], phi[0][k], phi[1][k]);
    fprintf(file,
            "EOD\nset title 'random sequential addition at saturation'\nset xlabel 'aspect ratio'\n"
            "set ylabel 'solid fraction'\nplot $rsa using 1:2:3 with yerrorlines pt 7 notitle, "
            "0.547 dt 2 title '0.547 (discs)', 0.583 dt 3 title '0.583 (ellipses, greatest)'\n"
            "set title 'growth of discs, 1 : 1.4, to 100 kPa'\nset xlabel 'k_n/P'\n"
            "set logscale x\nplot $growth using 1:2 with linespoints pt 7 title 'friction 0', "
            "$growth using 1:3 with linespoints pt 7 title 'friction 0.5', "
            "0.842 dt 2 title '0.842 (frictionless jamming)'\n");
    fclose(file);
    if (system("command -v gnuplot > /dev/null 2>&1") != 0)
        printf("skipped: packing.svg: gnuplot is not installed (it draws packing.gp)\n");
    else if (system("gnuplot packing.gp") != 0)
        printf("skipped: packing.svg: gnuplot failed on packing.gp\n");
}

int main(int argc, char **argv) {
    const char *folder = "build/bench_packing.out";
    saturation s[16];
    double phi[FRICTIONS][STIFFNESSES] = {{0}};
    int given = 0;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--quick") == 0)
            quick = true;
        else if (argv[i][0] == '-' || given++ > 0)
            bench_fail("usage: bench_packing [--quick] [OUTDIR]");
        else
            folder = argv[i];
    }
    setvbuf(stdout, NULL, _IOLBF, BUFSIZ);
    enter_folder(folder);
    table = create("packing.csv");
    fprintf(table, "what,aspect_or_friction,seed,time_or_stiffness,phi,phi_4_or_contacts,"
                   "phi_16_or_rattlers,phi_end_or_steps\n");
    const int count = run_additions(s);
    run_growths(phi);
    run_mixed();
    fclose(table);
    draw(s, count, phi);
    printf("%d outside of their bounds\n", failures);
    return failures > 0;
}
