/* bench_cell [--quick] [--only PART,...] [--seeds N] [OUTDIR] - what a periodic cell measures of
   discs: friction and solid fraction of shear flow, the point of jamming, how well stresses are
   held. Units: the greatest normal stress P is 1, a disc of diameter 1 has the mass 1.

   Samples. Discs are put one by one at random places of a square cell, the greatest first, so that
   they fill half of it, with slow random velocities; then both normal stresses are held at P.

   Parts:
       flow         1,000 discs, diameters uniform in 0.8 to 1.2, friction 0.4, k_n = 2 k_t = 1e4 P,
                    damping ratio 0.591 (spring and dashpot never pull: e = 0.253), step 0.12
                    sqrt(m/k_n). Sheared at the rate I (sqrt(m/P) is 1), yy held at P: mu = -yx/yy
                    with the stress of contacts and fluctuations, solid fraction phi, contacts per
                    disc z. Errors are those of the mean of 20 blocks of each run, all seeds
                    together; and of the mean of the seeds.
       restitution  the same with the damping ratio of a coefficient of restitution of 0.1
       jamming      400 frictionless discs, half of diameter 1, half of 1.4; both normal stresses
                    are held at k_n/P = 1e4, 1e5, 1e6 in turn; global damping 0.3. z and the excess
                    N_c - 2 N' are without rattlers: discs with less than three contacts are taken
                    off until none is left. phi_J is the limit of phi for P to 0 by the last two.
                    The excess is also that at the time when the unbalanced force of
                    dem2d_equilibrium came below 1e-3, 1e-5, 1e-7 and 1e-9, where it ends
       sizes        jamming of 2,000 and 8,000 discs
       held         100 discs from the gas to a packing at rest, compression along y at a rate of
                    0.01 with xx held, shear at I = 0.01 with yy held, by k_n/P and damping ratio:
                    errors of the stresses
       lammps       shear at constant volume here and in LAMMPS, if `lmp` is installed: the same
                    discs from the same state, the same law, rate 0.1: mean stresses

   Each finished run is a line of OUTDIR/runs.txt. A run that is there is not made again: the same
   command goes on after a stop. Writes flow.csv, jamming.csv, held.csv, lammps.csv and, where
   gnuplot is installed, cell.svg to OUTDIR, build/bench_cell.out by default. --seeds N: 3 by
   default, for jamming twice as many. --quick: a tenth of the discs and of the strains,
   without LAMMPS: means of so short a run scatter too much to tell a fault. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#define BENCH_NAME "bench_cell"
#include "bench.h"

#define STIFFNESS 1e4
#define FRICTION 0.4
#define DAMPING 0.591
#define BLOCKS 20
#define MOST_VALUES 20

enum { FLOW, RESTITUTION, JAMMING, SIZES, HELD, LAMMPS, PARTS };

static const char *const part_names[PARTS] = {"flow",  "restitution", "jamming",
                                              "sizes", "held",        "lammps"};

typedef struct options {
    bool quick, only[PARTS];
    int seeds;
    const char *folder;
} options;

static options opt = {false, {false}, 3, "build/bench_cell.out"};

/* --- finished runs ---------------------------------------------------------------------------- */

typedef struct record {
    char key[64];
    double of[MOST_VALUES];
} record;

static record *records;
static int record_count;

/* Of keys: hasty runs are others. */
static const char *haste(void) {
    return opt.quick ? "quick " : "";
}

static const record *find(const char *key) {
    for (int i = 0; i < record_count; i++)
        if (strcmp(records[i].key, key) == 0) return &records[i];
    return NULL;
}

static const record *remember(const char *key, const double *values) {
    records = (record *)realloc(records, (size_t)(record_count + 1) * sizeof *records);
    if (!records) bench_fail("out of memory");
    record *made = &records[record_count++];
    memcpy(made->key, key, strlen(key) + 1);
    memcpy(made->of, values, sizeof made->of);
    return made;
}

static void keep(const char *key, const double *values) {
    FILE *file = fopen("runs.txt", "a");
    if (!file) bench_fail("can't write runs.txt");
    fprintf(file, "%s:", key);
    for (int i = 0; i < MOST_VALUES; i++) fprintf(file, " %.9g", values[i]);
    fprintf(file, "\n");
    if (fclose(file) != 0) bench_fail("can't write runs.txt");
    remember(key, values);
}

static void read_runs(void) {
    FILE *file = fopen("runs.txt", "r");
    char line[1024];
    while (file && fgets(line, sizeof line, file)) {
        double values[MOST_VALUES] = {0};
        char *at = strchr(line, ':');
        if (!at || at - line >= 64) continue;
        *at++ = 0;
        int count = 0;
        for (char *end = at; count < MOST_VALUES; at = end) {
            values[count] = strtod(at, &end);
            if (end == at) break;
            count++;
        }
        if (count == MOST_VALUES) remember(line, values);
    }
    if (file) fclose(file);
}

/* --- samples ---------------------------------------------------------------------------------- */

/* What a sample is made of. */
typedef struct kind {
    int count;
    double stiffness, friction, damping, global;
    bool two_sizes; /* 1 and 1.4, half of each; else 0.8 to 1.2 */
    double step;    /* of sqrt(m/k_n) */
} kind;

typedef struct sample {
    kind of;
    double dt;
    dem2d_world *world;
} sample;

static int descending(const void *a, const void *b) {
    return compare_doubles(b, a);
}

/* Is a disc at x free of those before it? */
static bool is_free(const dem2d_vec *places, const double *scales, int i, dem2d_vec x,
                    double width) {
    for (int k = 0; k < i; k++) {
        double dx = x.x - places[k].x, dy = x.y - places[k].y;
        const double reach = (scales[i] + scales[k]) / 2;
        dx -= width * floor(dx / width + 0.5), dy -= width * floor(dy / width + 0.5);
        if (dx * dx + dy * dy < reach * reach) return false;
    }
    return true;
}

static void put_discs(sample *s, double width, dem2d_particle_desc *grain, const double *scales) {
    dem2d_vec *places = (dem2d_vec *)get_memory((size_t)s->of.count, sizeof *places);
    dem2d_particle_id id;
    for (int i = 0; i < s->of.count; i++) {
        do places[i] = vec(uniform(0, width), uniform(0, width));
        while (!is_free(places, scales, i, places[i], width));
        grain->scale = scales[i], grain->position = places[i];
        grain->velocity = vec(uniform(-0.05, 0.05), uniform(-0.05, 0.05));
        expect_ok(dem2d_world_add_particle(s->world, grain, &id), "disc");
    }
    free(places);
}

static sample gas(const kind *of, int seed) {
    sample s = {*of, of->step / sqrt(of->stiffness), NULL};
    dem2d_world_desc desc;
    dem2d_particle_desc grain;
    dem2d_material_desc stone = material_desc(
        4 / PI, of->stiffness, of->friction > 0 ? of->stiffness / 2 : 0, of->friction);
    double *scales = (double *)get_memory((size_t)of->count, sizeof *scales), area = 0;
    random_state = (uint64_t)seed;
    for (int i = 0; i < of->count; i++) {
        scales[i] = of->two_sizes ? (i % 2 ? 1 : 1.4) : uniform(0.8, 1.2);
        area += PI * scales[i] * scales[i] / 4;
    }
    qsort(scales, (size_t)of->count, sizeof *scales, descending);
    const double width = sqrt(area / 0.5);
    memset(&desc, 0, sizeof desc), memset(&grain, 0, sizeof grain);
    desc.time_step = s.dt, desc.global_damping = of->global;
    desc.cell.a = vec(width, 0), desc.cell.b = vec(0, width);
    stone.damping_ratio = of->damping;
    expect_ok(dem2d_world_create(&desc, &s.world), "world");
    expect_ok(dem2d_world_add_material(s.world, &stone, &grain.material), "material");
    dem2d_shape *disc = make_disc(0.5);
    expect_ok(dem2d_world_add_shape(s.world, disc, &grain.shape), "template");
    dem2d_shape_destroy(disc);
    put_discs(&s, width, &grain, scales);
    free(scales);
    return s;
}

static void run(const sample *s, double time) {
    expect_ok(dem2d_world_step(s->world, (int)(time / s->dt + 0.5), NULL), "step");
}

static void deform(const sample *s, const dem2d_deformation_desc *by) {
    expect_ok(dem2d_world_deform(s->world, by), "deformation");
}

static dem2d_deformation_desc pressed(double stress) {
    dem2d_deformation_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.hold_xx = desc.hold_yy = true, desc.stress_xx = desc.stress_yy = stress;
    return desc;
}

static dem2d_deformation_desc sheared(double rate, bool held) {
    dem2d_deformation_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.xy = rate, desc.hold_yy = held, desc.stress_yy = held ? 1 : 0;
    return desc;
}

/* The stress of contacts and fluctuations. */
static dem2d_stress stress_of(const sample *s, dem2d_cell_info *cell) {
    expect_ok(dem2d_world_get_cell(s->world, cell), "cell");
    dem2d_stress sum = cell->contact;
    sum.xx += cell->kinetic.xx, sum.yx += cell->kinetic.yx;
    sum.xy += cell->kinetic.xy, sum.yy += cell->kinetic.yy;
    return sum;
}

static dem2d_packing packing_of(const sample *s) {
    dem2d_packing packing;
    expect_ok(dem2d_world_packing(s->world, &packing), "packing");
    return packing;
}

/* Mean of blocks, and its error; the blocks are independent. */
typedef struct mean {
    double value, error;
} mean;

static mean mean_of(const double *values, int count) {
    mean m = {0, 0};
    for (int i = 0; i < count; i++) m.value += values[i] / count;
    for (int i = 0; i < count; i++) m.error += pow(values[i] - m.value, 2);
    m.error = count > 1 ? sqrt(m.error / (count * (count - 1.0))) : 0;
    return m;
}

/* --- flow ------------------------------------------------------------------------------------- */

typedef struct rate {
    double number, before, strain; /* I; strain until the measurement, and of it */
} rate;

static const rate rates[] = {{1e-2, 0.5, 3}, {3e-2, 0.7, 6}, {1e-1, 1, 10}, {1e-3, 0.25, 1}};

enum { MU, MU_ERROR, PHI, PHI_ERROR, Z, BIAS, RMS, LIMITED, NORMAL_DIFFERENCE, SECONDS };

static kind flowing(double damping) {
    const kind k = {opt.quick ? 100 : 1000, STIFFNESS, FRICTION, damping, 0, false, 0.12};
    return k;
}

static sample flow_sample(double damping, int seed) {
    const kind k = flowing(damping);
    const dem2d_deformation_desc press = pressed(1);
    const sample s = gas(&k, seed);
    deform(&s, &press);
    run(&s, 30);
    return s;
}

/* Samples of a block, each 20 steps. */
static void flow_block(const sample *s, int samples, double *mu, double *phi, double *values) {
    dem2d_cell_info cell;
    double yx = 0, yy = 0, area = 0;
    const dem2d_packing packing = packing_of(s);
    for (int i = 0; i < samples; i++) {
        expect_ok(dem2d_world_step(s->world, 20, NULL), "step");
        const dem2d_stress stress = stress_of(s, &cell);
        const double part = 1.0 / samples / BLOCKS;
        yx += stress.yx, yy += stress.yy, area += 1 / cell.area;
        values[BIAS] += (stress.yy - 1) * part;
        values[RMS] += (stress.yy - 1) * (stress.yy - 1) * part;
        values[LIMITED] += cell.limited * part;
        values[NORMAL_DIFFERENCE] += (stress.xx - stress.yy) * part;
        if (i % 10 == 0) values[Z] += packing_of(s).coordination / ((samples + 9) / 10) / BLOCKS;
    }
    *mu = -yx / yy;
    *phi = packing.solid_area * area / samples;
}

static void make_flow(const char *key, double damping, const rate *r, int seed) {
    const double start = read_clock(CLOCK_PROCESS_CPUTIME_ID), less = opt.quick ? 0.1 : 1;
    const sample s = flow_sample(damping, seed);
    const dem2d_deformation_desc shear = sheared(r->number, true);
    double values[MOST_VALUES] = {0}, mu[BLOCKS], phi[BLOCKS];
    const int samples = (int)ceil(less * r->strain / r->number / s.dt / BLOCKS / 20);
    deform(&s, &shear);
    run(&s, less * r->before / r->number);
    for (int k = 0; k < BLOCKS; k++) flow_block(&s, samples, &mu[k], &phi[k], values);
    const mean friction = mean_of(mu, BLOCKS), solid = mean_of(phi, BLOCKS);
    values[MU] = friction.value, values[MU_ERROR] = friction.error;
    values[PHI] = solid.value, values[PHI_ERROR] = solid.error;
    values[RMS] = sqrt(values[RMS]);
    values[SECONDS] = read_clock(CLOCK_PROCESS_CPUTIME_ID) - start;
    printf("%s: mu %.4f(%.4f) phi %.4f(%.4f) z %.3f, yy - 1: %.1e rms %.1e, limited %.1e, %.0f s\n",
           key, values[MU], values[MU_ERROR], values[PHI], values[PHI_ERROR], values[Z],
           values[BIAS], values[RMS], values[LIMITED], values[SECONDS]);
    keep(key, values);
    dem2d_world_destroy(s.world);
}

static void flow_key(char key[64], int part, double number, int seed) {
    snprintf(key, 64, "%s%s %g %d", haste(), part_names[part], number, seed);
}

static void make_flows(int part) {
    double damping = DAMPING;
    char key[64];
    if (part == RESTITUTION) expect_ok(dem2d_damping_ratio(0.1, &damping), "damping ratio");
    for (int k = 0; k < COUNT_OF(rates); k++)
        for (int seed = 1; seed <= opt.seeds; seed++) {
            flow_key(key, part, rates[k].number, seed);
            if (!find(key)) make_flow(key, damping, &rates[k], seed);
        }
}

/* Mean over the seeds of quantity q, whose error by blocks is at q + 1; the greater of the errors
   by blocks and by seeds. */
static mean seeds_mean(int part, double number, int q, int *count, double errors[2]) {
    double values[64], square = 0;
    char key[64];
    *count = 0;
    for (int seed = 1; seed <= 64; seed++) {
        flow_key(key, part, number, seed);
        const record *r = find(key);
        if (!r) continue;
        values[(*count)++] = r->of[q];
        square += r->of[q + 1] * r->of[q + 1];
    }
    mean m = mean_of(values, *count);
    errors[0] = *count > 0 ? sqrt(square) / *count : 0, errors[1] = m.error;
    m.error = fmax(errors[0], errors[1]);
    return m;
}

static bool write_flow(void) {
    bool some = false;
    FILE *csv = create("flow.csv");
    fprintf(csv, "part,I,seeds,mu,mu_error,mu_by_blocks,mu_by_seeds,phi,phi_error,phi_by_blocks,"
                 "phi_by_seeds\n");
    for (int part = FLOW; part <= RESTITUTION; part++)
        for (int k = 0; k < COUNT_OF(rates); k++) {
            int count;
            double errors[4];
            const mean mu = seeds_mean(part, rates[k].number, MU, &count, errors);
            const mean phi = seeds_mean(part, rates[k].number, PHI, &count, errors + 2);
            if (count == 0) continue;
            some = true;
            printf("%-11s I = %-6g %d seeds: mu %.4f +- %.4f, phi %.5f +- %.5f\n", part_names[part],
                   rates[k].number, count, mu.value, mu.error, phi.value, phi.error);
            fprintf(csv, "%s,%g,%d,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f\n", part_names[part],
                    rates[k].number, count, mu.value, mu.error, errors[0], errors[1], phi.value,
                    phi.error, errors[2], errors[3]);
        }
    if (fclose(csv) != 0) bench_fail("can't write flow.csv");
    return some;
}

/* --- jamming ---------------------------------------------------------------------------------- */

#define THRESHOLDS 4

static const double thresholds[THRESHOLDS] = {1e-3, 1e-5, 1e-7, 1e-9};
static const double pressures[3] = {1, 0.1, 0.01}; /* k_n is 1e4 */

enum { SOLID, COORDINATION, EXCESS, RATTLERS, STRESS_ERROR, UNBALANCED, TIME, COST, QUIET };
/* from QUIET on: time and excess for each threshold */

typedef struct rigid {
    int discs, contacts; /* without rattlers */
} rigid;

static rigid rigid_of(const sample *s) {
    int count, change = 1;
    rigid r = {s->of.count, 0};
    expect_ok(dem2d_world_contacts(s->world, NULL, 0, &count), "contacts");
    dem2d_contact_info *all = (dem2d_contact_info *)get_memory((size_t)count, sizeof *all);
    int *degree = (int *)get_memory((size_t)s->of.count, sizeof *degree);
    bool *gone = (bool *)get_memory((size_t)s->of.count, sizeof *gone);
    expect_ok(dem2d_world_contacts(s->world, all, count, &count), "contacts");
    while (change) {
        memset(degree, 0, (size_t)s->of.count * sizeof *degree);
        change = r.contacts = 0;
        for (int i = 0; i < count; i++) {
            if (gone[all[i].a.index] || gone[all[i].b.index]) continue;
            degree[all[i].a.index]++, degree[all[i].b.index]++, r.contacts++;
        }
        for (int i = 0; i < s->of.count; i++)
            if (!gone[i] && degree[i] < 3) gone[i] = true, change = 1, r.discs--;
    }
    free(all), free(degree), free(gone);
    return r;
}

static double unbalanced(const sample *s) {
    dem2d_equilibrium rest;
    expect_ok(dem2d_world_equilibrium(s->world, &rest), "equilibrium");
    return rest.unbalanced;
}

/* Holds the stress until the discs are at rest. */
static void jam(const sample *s, double stress, double values[MOST_VALUES]) {
    const dem2d_deformation_desc press = pressed(stress);
    const double start = read_clock(CLOCK_PROCESS_CPUTIME_ID), length = 1;
    dem2d_cell_info cell;
    double time = 0;
    memset(values, 0, MOST_VALUES * sizeof *values);
    deform(s, &press);
    for (int k = 0; k < THRESHOLDS && time < 10000;) {
        run(s, length), time += length;
        values[UNBALANCED] = unbalanced(s);
        if (time < 20) continue; /* the gas has no forces */
        for (; k < THRESHOLDS && values[UNBALANCED] < thresholds[k]; k++) {
            const rigid r = rigid_of(s);
            values[QUIET + 2 * k] = time, values[QUIET + 2 * k + 1] = r.contacts - 2 * r.discs;
        }
    }
    const dem2d_stress stress_now = stress_of(s, &cell);
    const rigid r = rigid_of(s);
    values[SOLID] = packing_of(s).solid_area / cell.area;
    values[COORDINATION] = 2.0 * r.contacts / r.discs;
    values[EXCESS] = r.contacts - 2 * r.discs;
    values[RATTLERS] = 1 - (double)r.discs / s->of.count;
    values[STRESS_ERROR] = fmax(fabs(stress_now.xx / stress - 1), fabs(stress_now.yy / stress - 1));
    values[TIME] = time, values[COST] = read_clock(CLOCK_PROCESS_CPUTIME_ID) - start;
}

static void jamming_key(char key[64], int count, int stage, int seed) {
    snprintf(key, 64, "%sjamming %d %g %d", haste(), count, pressures[stage] / STIFFNESS, seed);
}

static void make_jamming(int count, int seeds) {
    const kind k = {opt.quick ? count / 10 : count, STIFFNESS, 0, 0.4, 0.3, true, 0.2};
    double values[MOST_VALUES];
    char key[64];
    for (int seed = 1; seed <= seeds; seed++) {
        jamming_key(key, k.count, 2, seed);
        if (find(key)) continue;
        const sample s = gas(&k, seed);
        for (int stage = 0; stage < 3; stage++) {
            jamming_key(key, k.count, stage, seed);
            jam(&s, pressures[stage], values);
            printf("%s: phi %.5f z %.4f excess %g rattlers %.3f stress %.1e unbalanced %.1e, time "
                   "%.0f, %.0f s; excess",
                   key, values[SOLID], values[COORDINATION], values[EXCESS], values[RATTLERS],
                   values[STRESS_ERROR], values[UNBALANCED], values[TIME], values[COST]);
            for (int i = 0; i < THRESHOLDS; i++) printf(" %g", values[QUIET + 2 * i + 1]);
            printf("\n"), fflush(stdout);
            keep(key, values);
        }
        dem2d_world_destroy(s.world);
    }
}

static bool write_jamming(void) {
    bool some = false;
    static const int sizes[6] = {40, 400, 200, 2000, 800, 8000};
    FILE *csv = create("jamming.csv");
    fprintf(csv, "discs,P_over_kn,seed,phi,z,excess,rattlers,stress_error,unbalanced,time");
    for (int i = 0; i < THRESHOLDS; i++)
        fprintf(csv, ",time_%g,excess_%g", thresholds[i], thresholds[i]);
    fprintf(csv, "\n");
    for (int size = 0; size < 6; size++) {
        double phi[64], z[3][64];
        int count = 0;
        for (int seed = 1; seed <= 64; seed++) {
            char key[64];
            const record *r[3];
            for (int stage = 0; stage < 3; stage++) {
                jamming_key(key, sizes[size], stage, seed);
                r[stage] = find(key);
            }
            if (!r[0] || !r[1] || !r[2]) continue;
            for (int stage = 0; stage < 3; stage++) {
                fprintf(csv, "%d,%g,%d", sizes[size], pressures[stage] / STIFFNESS, seed);
                for (int q = 0; q < MOST_VALUES; q++)
                    if (q != COST && q < QUIET + 2 * THRESHOLDS)
                        fprintf(csv, ",%.9g", r[stage]->of[q]);
                fprintf(csv, "\n");
                z[stage][count] = r[stage]->of[COORDINATION] - 4;
            }
            const double slope =
                (r[1]->of[SOLID] - r[2]->of[SOLID]) / (pressures[1] - pressures[2]);
            phi[count++] = r[2]->of[SOLID] - slope * pressures[2];
        }
        if (count == 0) continue;
        some = some || sizes[size] % 400 == 0; /* not --quick */
        const mean m = mean_of(phi, count);
        printf("jamming of %d discs, %d seeds: phi_J %.5f +- %.5f; (z - 4)/sqrt(P/kn):",
               sizes[size], count, m.value, m.error);
        for (int stage = 0; stage < 3; stage++) {
            const mean over = mean_of(z[stage], count);
            const double root = sqrt(pressures[stage] / STIFFNESS);
            printf(" %.2f +- %.2f", over.value / root, over.error / root);
        }
        printf("\n");
    }
    if (fclose(csv) != 0) bench_fail("can't write jamming.csv");
    return some;
}

/* --- held stresses ---------------------------------------------------------------------------- */

enum { SETTLED, PEAK, REST, REST_MEAN, BIAXIAL, SHEAR_BIAS, SHEAR_RMS };

/* Steps for a time. Returns the greatest error of a held stress in a step; mean and root of the
   mean square go into error, the time after which errors stay below 1 % and the greatest stress
   into past (may be NULL). */
static double follow(const sample *s, double time, bool xx, bool yy, mean *error, double *past) {
    const int steps = (int)(time / s->dt);
    double most = 0;
    error->value = error->error = 0;
    for (int i = 0; i < steps; i++) {
        dem2d_cell_info cell;
        expect_ok(dem2d_world_step(s->world, 1, NULL), "step");
        const dem2d_stress stress = stress_of(s, &cell);
        const double x = xx ? stress.xx - 1 : 0, y = yy ? stress.yy - 1 : 0;
        const double worst = fmax(fabs(x), fabs(y)), one = xx && yy ? (x + y) / 2 : x + y;
        most = fmax(most, worst);
        error->value += one / steps, error->error += one * one / steps;
        if (past && worst > 0.01) past[0] = (i + 1) * s->dt;
        if (past) past[1] = fmax(past[1], fmax(stress.xx, stress.yy));
    }
    error->error = sqrt(error->error);
    return most;
}

static void make_held(double stiffness, double damping) {
    const kind k = {100, stiffness, FRICTION, damping, 0, false, 0.12};
    double values[MOST_VALUES] = {0};
    char key[64];
    mean error;
    snprintf(key, sizeof key, "%sheld %g %g", haste(), stiffness, damping);
    if (find(key)) return;
    const sample s = gas(&k, 1);
    dem2d_deformation_desc by = pressed(1);
    deform(&s, &by);
    follow(&s, 60, true, true, &error, &values[SETTLED]);
    values[REST] = follow(&s, 5, true, true, &error, NULL);
    values[REST_MEAN] = error.value;
    by.hold_yy = false, by.stress_yy = 0, by.yy = -0.01;
    deform(&s, &by);
    run(&s, 5);
    follow(&s, 10, true, false, &error, NULL);
    values[BIAXIAL] = error.value;
    by = sheared(0.01, true);
    deform(&s, &by);
    run(&s, 20);
    follow(&s, 40, false, true, &error, NULL);
    values[SHEAR_BIAS] = error.value, values[SHEAR_RMS] = error.error;
    printf(
        "%s: peak %.2f, 1 %% after %.1f, rest %.1e mean %.1e, biaxial %.1e, shear %.1e rms %.1e\n",
        key, values[PEAK], values[SETTLED], values[REST], values[REST_MEAN], values[BIAXIAL],
        values[SHEAR_BIAS], values[SHEAR_RMS]);
    keep(key, values);
    dem2d_world_destroy(s.world);
}

static const double held_stiffness[] = {1e2, 1e3, 1e4, 1e5, 1e6};
static const double held_damping[] = {0, 0.1, 0.591, 1};

static void make_all_held(void) {
    for (int i = 0; i < COUNT_OF(held_stiffness) - (opt.quick ? 2 : 0); i++)
        for (int k = 0; k < COUNT_OF(held_damping); k++)
            make_held(held_stiffness[i], held_damping[k]), fflush(stdout);
}

static void write_held(void) {
    FILE *csv = create("held.csv");
    fprintf(csv, "kn_over_P,damping_ratio,time_to_1_percent,peak,rest,rest_mean,biaxial_bias,"
                 "shear_bias,shear_rms\n");
    for (int i = 0; i < COUNT_OF(held_stiffness); i++)
        for (int k = 0; k < COUNT_OF(held_damping); k++) {
            char key[64];
            snprintf(key, sizeof key, "%sheld %g %g", haste(), held_stiffness[i], held_damping[k]);
            const record *r = find(key);
            if (!r) continue;
            fprintf(csv, "%g,%g", held_stiffness[i], held_damping[k]);
            for (int q = SETTLED; q <= SHEAR_RMS; q++) fprintf(csv, ",%.6g", r->of[q]);
            fprintf(csv, "\n");
        }
    if (fclose(csv) != 0) bench_fail("can't write held.csv");
}

/* --- LAMMPS ----------------------------------------------------------------------------------- */

enum { STRESS_XX, STRESS_YY, RATIO, COMPARED, PEER_SOLID = 4 * COMPARED }; /* ratio: -xy/yy */
/* of each quantity mean and error, first here, then of LAMMPS */

static void peer_values(double blocks[COMPARED][BLOCKS], double *values) {
    for (int q = 0; q < COMPARED; q++) {
        const mean m = mean_of(blocks[q], BLOCKS);
        values[2 * q] = m.value, values[2 * q + 1] = m.error;
    }
}

/* The state with velocities of particles: fluctuations and flow. */
static void write_state(const sample *s, double shear_rate, const char *path) {
    dem2d_cell_info cell;
    int count;
    dem2d_particle_id *ids = (dem2d_particle_id *)get_memory((size_t)s->of.count, sizeof *ids);
    dem2d_particle_info *all = (dem2d_particle_info *)get_memory((size_t)s->of.count, sizeof *all);
    FILE *file = create(path);
    expect_ok(dem2d_world_get_cell(s->world, &cell), "cell");
    expect_ok(dem2d_world_particles(s->world, ids, s->of.count, &count), "particles");
    fprintf(file, "discs\n\n%d atoms\n1 atom types\n\n0 %.17g xlo xhi\n0 %.17g ylo yhi\n", count,
            cell.cell.a.x, cell.cell.b.y);
    fprintf(file, "-0.5 0.5 zlo zhi\n%.17g 0 0 xy xz yz\n\nAtoms\n\n", cell.cell.b.x);
    for (int i = 0; i < count; i++) {
        expect_ok(dem2d_world_get_particle(s->world, ids[i], &all[i]), "particle");
        fprintf(file, "%d 1 %.17g 1 %.17g %.17g 0\n", i + 1, 2 * all[i].radius,
                all[i].pose.position.x, all[i].pose.position.y);
    }
    fprintf(file, "\nVelocities\n\n");
    for (int i = 0; i < count; i++)
        fprintf(file, "%d %.17g %.17g 0 0 0 %.17g\n", i + 1,
                all[i].velocity.x + shear_rate * all[i].pose.position.y, all[i].velocity.y,
                all[i].angular_velocity);
    if (fclose(file) != 0) bench_fail("can't write %s", path);
    free(ids), free(all);
}

/* The dashpot of LAMMPS named tsuji is a(e) sqrt(m k_n): the e of a = 2 zeta, by bisection. */
static double tsuji_of(double damping) {
    double low = 0, high = 1;
    for (int i = 0; i < 60; i++) {
        const double e = (low + high) / 2;
        const double a =
            1.2728 + e * (-4.2783 +
                          e * (11.087 + e * (-22.348 + e * (27.467 + e * (-18.022 + e * 4.8218)))));
        if (a > 2 * damping)
            low = e;
        else
            high = e;
    }
    return low;
}

static void write_commands(const sample *s, double shear_rate, int before, int block) {
    FILE *file = create("lammps.in");
    fprintf(file, "units lj\ndimension 2\nboundary p p p\nnewton off\natom_style sphere\n"
                  "comm_modify vel yes\nread_data lammps.data\n");
    fprintf(file, "set group all density/disc %.17g\n", 4 / PI);
    fprintf(file,
            "pair_style granular\n"
            "pair_coeff * * hooke %.17g %.17g tangential linear_history %.17g 0 %g damping "
            "tsuji limit_damping\n",
            s->of.stiffness, tsuji_of(s->of.damping), s->of.stiffness / 2, s->of.friction);
    fprintf(file, "neighbor 0.3 bin\nneigh_modify every 1 delay 0 check yes\ntimestep %.17g\n",
            s->dt);
    fprintf(file,
            "fix move all nve/sphere disc\nfix plane all enforce2d\n"
            "fix shear all deform 1 xy erate %.17g remap v\n",
            shear_rate);
    fprintf(file,
            "compute heat all temp/deform\ncompute stress all pressure heat\n"
            "thermo_style custom step c_stress[2]\nthermo %d\nrun %d\n",
            block, before);
    fprintf(file,
            "fix mean all ave/time 20 %d %d c_stress[1] c_stress[2] c_stress[4] file "
            "lammps.mean\nrun %d\n",
            block / 20, block, (BLOCKS + 1) * block);
    if (fclose(file) != 0) bench_fail("can't write lammps.in");
}

/* What LAMMPS has found. */
static bool read_means(double *values) {
    FILE *file = fopen("lammps.mean", "r");
    double blocks[COMPARED][BLOCKS], step, xx, yy, xy;
    char line[256];
    int count = 0;
    while (file && fgets(line, sizeof line, file) && count < BLOCKS) {
        if (sscanf(line, "%lf %lf %lf %lf", &step, &xx, &yy, &xy) != 4) continue;
        blocks[STRESS_XX][count] = xx, blocks[STRESS_YY][count] = yy;
        blocks[RATIO][count++] = -xy / yy;
    }
    if (file) fclose(file);
    if (count == BLOCKS) peer_values(blocks, values);
    return count == BLOCKS;
}

/* The same here. */
static void measure_stresses(const sample *s, int samples, double *values) {
    double blocks[COMPARED][BLOCKS];
    dem2d_cell_info cell;
    for (int k = 0; k < BLOCKS; k++) {
        double xx = 0, yy = 0, xy = 0;
        for (int i = 0; i < samples; i++) {
            expect_ok(dem2d_world_step(s->world, 20, NULL), "step");
            const dem2d_stress stress = stress_of(s, &cell);
            xx += stress.xx / samples, yy += stress.yy / samples, xy += stress.xy / samples;
        }
        blocks[STRESS_XX][k] = xx, blocks[STRESS_YY][k] = yy, blocks[RATIO][k] = -xy / yy;
    }
    peer_values(blocks, values);
    values[PEER_SOLID] = packing_of(s).solid_area / cell.area;
}

static void make_peer(int seed) {
    const rate r = {0.1, 1, opt.quick ? 1 : 10};
    double values[MOST_VALUES] = {0};
    char key[64];
    snprintf(key, sizeof key, "%slammps %d", haste(), seed);
    if (find(key)) return;
    const sample s = flow_sample(DAMPING, seed);
    dem2d_deformation_desc shear = sheared(r.number, true);
    deform(&s, &shear);
    run(&s, r.before / r.number);
    shear = sheared(r.number, false);
    deform(&s, &shear);
    write_state(&s, r.number, "lammps.data");
    const int samples = (int)ceil(r.strain / r.number / s.dt / BLOCKS / 20);
    const int before = (int)(r.before / r.number / s.dt);
    write_commands(&s, r.number, before, 20 * samples);
    expect_ok(dem2d_world_step(s.world, before, NULL), "step");
    measure_stresses(&s, samples, values);
    dem2d_world_destroy(s.world);
    remove("lammps.mean");
    const int status =
        system("OMP_NUM_THREADS=1 lmp -nocite -log lammps.log -in lammps.in > /dev/null 2>&1");
    if (status != 0 || !read_means(values + 2 * COMPARED)) {
        printf("%s: LAMMPS failed, see lammps.log\n", key);
        return;
    }
    printf("%s: phi %.4f, yy %.4f(%.4f), LAMMPS %.4f(%.4f)\n", key, values[PEER_SOLID], values[2],
           values[3], values[8], values[9]);
    keep(key, values);
}

static void write_peer(void) {
    static const char *const names[COMPARED] = {"xx", "yy", "mu"};
    FILE *csv = create("lammps.csv");
    fprintf(csv,
            "quantity,seeds,here,here_error,lammps,lammps_error,difference,difference_error\n");
    for (int q = 0; q < COMPARED; q++) {
        double of[3][64], square[3] = {0, 0, 0}; /* here, LAMMPS, their difference */
        int count = 0;
        mean m[3];
        for (int seed = 1; seed <= 64; seed++) {
            char key[64];
            snprintf(key, sizeof key, "%slammps %d", haste(), seed);
            const record *r = find(key);
            if (!r) continue;
            for (int k = 0; k < 2; k++) {
                const double *v = r->of + 2 * COMPARED * k + 2 * q;
                of[k][count] = v[0], square[k] += v[1] * v[1];
                square[2] += v[1] * v[1];
            }
            of[2][count] = of[0][count] - of[1][count];
            count++;
        }
        if (count == 0) break;
        for (int k = 0; k < 3; k++) {
            m[k] = mean_of(of[k], count);
            m[k].error = fmax(m[k].error, sqrt(square[k]) / count);
        }
        printf("constant volume, %s, %d seeds: here %.4f, LAMMPS %.4f, difference %.4f +- %.4f\n",
               names[q], count, m[0].value, m[1].value, m[2].value, m[2].error);
        fprintf(csv, "%s,%d,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f\n", names[q], count, m[0].value,
                m[0].error, m[1].value, m[1].error, m[2].value, m[2].error);
    }
    if (fclose(csv) != 0) bench_fail("can't write lammps.csv");
}

/* --- picture, command line -------------------------------------------------------------------- */

static const char flow_panels[] =
    "set grid linecolor '#d8d8d8'\nset key top left Left reverse samplen 1\n"
    "set xlabel 'inertial number I'\n"
    "set logscale x\nset xrange [5e-4:2e-1]\nset format x '10^{%L}'\n"
    "set ylabel 'friction mu'\n"
    "plot for [i=1:2] 'flow.csv' using (strcol(1) eq names[i] ? $2 : NaN):4:5 with yerrorbars "
    "pointtype 5 + i linecolor rgb colours[i] title titles[i]\n"
    "set ylabel 'solid fraction'\nset key bottom left\n"
    "plot for [i=1:2] 'flow.csv' using (strcol(1) eq names[i] ? $2 : NaN):8:9 with yerrorbars "
    "pointtype 5 + i linecolor rgb colours[i] title titles[i]\n";

static const char jamming_panels[] =
    "set xlabel 'P/k_n'\nset xrange [5e-7:2e-4]\nset key top left\n"
    "set logscale y\nset yrange [1e-3:0.2]\nset format y '10^{%L}'\n"
    "set ylabel 'z - 4 without rattlers'\n"
    "plot for [n in '400 2000 8000'] 'jamming.csv' using ($1 == n ? $2 : NaN):($5 - 4) with points "
    "pointtype 6 title n.' discs', 3.7 * sqrt(x) with lines linecolor '#444444' title "
    "'3.7 (P/k_n)^{1/2}'\n"
    "unset logscale y\nset yrange [*:*]\nset format y '%g'\nset ylabel 'solid fraction'\n"
    "set key outside top center horizontal\n"
    "plot for [n in '400 2000 8000'] 'jamming.csv' using ($1 == n ? $2 : NaN):4 with points "
    "pointtype 6 title n.' discs'\n";

static void draw(bool flow, bool jamming) {
    FILE *file = create("cell.gp");
    fputs("set datafile separator comma\nset terminal svg size 900,760 font 'sans-serif,14' "
          "background 'white'\nset output 'cell.svg'\nset multiplot layout 2,2\n"
          "array names[2] = ['flow', 'restitution']\narray colours[2] = ['#1f5fbf', '#c8382c']\n"
          "array titles[2] = ['damping ratio 0.591', 'restitution 0.1']\n",
          file);
    fputs(flow ? flow_panels : "set multiplot next\nset multiplot next\n", file);
    fputs(jamming ? jamming_panels : "", file);
    fputs("unset multiplot\n", file);
    if (fclose(file) != 0) bench_fail("can't write cell.gp");
    if (system("command -v gnuplot > /dev/null 2>&1") != 0)
        printf("no gnuplot: no picture\n");
    else if ((flow || jamming) && system("gnuplot cell.gp 2> gnuplot.log") != 0)
        printf("gnuplot failed: see gnuplot.log\n");
}

static bool choose(const char *list) {
    for (const char *at = list; *at;) {
        const size_t length = strcspn(at, ",");
        int k = 0;
        while (k < PARTS &&
               (strlen(part_names[k]) != length || strncmp(part_names[k], at, length) != 0))
            k++;
        if (k == PARTS) return false;
        opt.only[k] = true;
        at += length + (at[length] == ',');
    }
    return true;
}

static bool parse(int argc, char **argv) {
    bool all = true;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--quick") == 0) {
            opt.quick = true;
        } else if (strcmp(argv[i], "--only") == 0 && i + 1 < argc) {
            all = false;
            if (!choose(argv[++i])) return false;
        } else if (strcmp(argv[i], "--seeds") == 0 && i + 1 < argc) {
            opt.seeds = atoi(argv[++i]);
            if (opt.seeds < 1 || opt.seeds > 32) return false;
        } else if (argv[i][0] != '-') {
            opt.folder = argv[i];
        } else {
            return false;
        }
    }
    for (int k = 0; k < PARTS && all; k++) opt.only[k] = true;
    return true;
}

int main(int argc, char **argv) {
    if (!parse(argc, argv)) {
        fprintf(stderr, "usage: bench_cell [--quick] [--only PART,...] [--seeds N] [OUTDIR]\n");
        return 2;
    }
    enter_folder(opt.folder);
    setvbuf(stdout, NULL, _IOLBF, 0);
    read_runs();
    if (opt.only[HELD]) make_all_held();
    if (opt.only[FLOW]) make_flows(FLOW);
    if (opt.only[JAMMING]) make_jamming(400, 2 * opt.seeds);
    if (opt.only[LAMMPS] && !opt.quick && system("command -v lmp > /dev/null 2>&1") == 0)
        for (int seed = 1; seed <= opt.seeds; seed++) make_peer(seed);
    if (opt.only[RESTITUTION]) make_flows(RESTITUTION);
    if (opt.only[SIZES]) make_jamming(2000, 2 * opt.seeds), make_jamming(8000, opt.seeds);
    const bool flow = write_flow(), jamming = write_jamming();
    write_held(), write_peer();
    draw(flow, jamming);
    free(records);
    return 0;
}
