/* bench_rigid [--quick] [--only SWEEP,...] [--seeds N] [--data DIR] [--report] [OUTDIR] - the error
   that soft contacts and fast loading make in a biaxial test, beside the time of the run.

   The test. 160 grains between four smooth walls, without gravity. They begin in rows, in random
   motion, and servo walls press them together at P, without friction, until they are at rest. Then
   friction is 0.5: the top moves at a constant rate of logarithmic strain, to 10 %, while the side
   walls hold P. q/p comes from the Love-Weber stress, at 200 equal strains. `peak`: its greatest
   mean over 1 % of strain. `end`: the mean from 5 to 10 %. Porosity, coordination number (without
   rattlers), overlap and unbalanced force are means from 5 to 10 %, too.

   Grains: discs; and Fourier series of order 8, fitted to the outlines below DIR, or, without DIR,
   polygons and Fourier series drawn here. Circles of equal area have diameters uniform in 0.04 to
   0.06 m.

   Sweeps, each from the base case (k_n/P 1000, inertial number 1e-3, half the safe time step,
   tolerance 1e-8, damping ratio 0.3, no local damping) with one number changed:
       stiffness   k_n/P; k_n = k_t; the packing of 1000 comes to rest with the new one first
       rate        inertial number, as dem2d_world_inertial_number defines it (with the mass m of a
                   disc, rate sqrt(m/P) is 0.89 of it); with dashpots
       rate-local  the same with local damping 0.7, without dashpots
       step        time step over `safe` of dem2d_world_time_step_bounds, in the packed sample with
                   friction and dashpots
       tolerance   dem2d_world_desc.contact_tolerance; not for discs, which need none
       dashpot     damping ratio of the normal and the tangential dashpot
       local       local damping, without dashpots
   Damping is that while the sample is sheared; all are packed with the same.

   Each case is run with several seeds (N: at most so many), expensive ones with fewer. Errors are
   standard errors of a mean against other cases of the sweep: what the samples of a seed have in
   common is taken off first. The error that is common to all cases of a sweep is printed below it.
   Where the error should be proportional to a small number (P/k_n, the inertial number), a line is
   fitted, and its end is the rigid or quasi-static limit.

   Time is time on a core, of the compression from 0 to 10 %, without the packing.

   Each finished run is a line of OUTDIR/runs.txt. A run that is there is not made again: the same
   command goes on after a stop. --report makes no runs. Writes rigid.csv, limits.csv and, where
   gnuplot is installed, rigid.svg to OUTDIR, build/bench_rigid by default. --quick: 64 grains,
   two seeds, cheap cases, inertial number 3e-3 in the base case. Exit status: 0, 2 if something
   failed. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#define BENCH_NAME "bench_rigid"
#include "bench_beds.h"
#include "bench_outlines.h"

#define PRESSURE 1e5       /* Pa */
#define SHEAR_FRICTION 0.5 /* between grains, while sheared */
#define STRAIN 0.1         /* axial, logarithmic, at the end */
#define SAMPLES 200        /* of the stress, at equal strains */
#define PEAK_SAMPLES 20    /* 1 % of strain */
#define END_SAMPLES 100    /* 5 % of strain */
#define MOST_SEEDS 64
#define LINE_ROOM 4352 /* and a path */
#define KEY_ROOM 96

enum { DISC_GRAINS, REAL_GRAINS, KINDS_OF_GRAINS };
enum { STIFFNESS_RATIO, INERTIAL, FRACTION, TOLERANCE, DASHPOT, LOCAL, VARIABLES };
enum { PEAK, END, POROSITY, COORDINATION, OVERLAP, UNBALANCED, PACKED, STEPS, TIME, QUANTITIES };
enum { LEFT, RIGHT, BOTTOM, TOP, WALLS };

static const char *const kind_names[KINDS_OF_GRAINS] = {"discs", "grains"};
static const char *const quantity_names[QUANTITIES] = {
    "peak_q_over_p", "end_q_over_p",    "porosity", "coordination", "overlap_over_radius",
    "unbalanced",    "packed_porosity", "steps",    "seconds"};

/* A case: the kind of grains, and what the sweeps change. */
typedef struct setting {
    int kind;
    double of[VARIABLES];
} setting;

static const double base[VARIABLES] = {1000, 1e-3, 0.5, 1e-8, 0.3, 0};

typedef struct sweep {
    const char *name, *label;
    int variable;
    double local;     /* local damping; above 0: no dashpots */
    double values[8]; /* ends with -1 */
} sweep;

enum { SWEEP_STIFFNESS, SWEEP_RATE, SWEEP_RATE_LOCAL, SWEEP_STEP, SWEEP_TOLERANCE };

static const sweep sweeps[] = {
    {"stiffness", "k_n/P", STIFFNESS_RATIO, 0, {100, 300, 1000, 3000, 1e4, 3e4, 1e5, -1}},
    {"rate", "inertial number", INERTIAL, 0, {1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5, -1}},
    {"rate-local", "inertial number", INERTIAL, 0.7, {1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5, -1}},
    {"step", "step / safe", FRACTION, 0, {0.8, 0.5, 0.2, 0.1, -1}},
    {"tolerance", "tolerance", TOLERANCE, 0, {1e-3, 1e-4, 1e-6, 1e-8, 1e-12, -1}},
    {"dashpot", "damping ratio", DASHPOT, 0, {0.03, 0.1, 0.3, 1, -1}},
    {"local", "local damping", LOCAL, 0.7, {0, 0.1, 0.3, 0.7, -1}},
};

#define SWEEPS COUNT_OF(sweeps)
#define MOST_CASES 8

typedef struct options {
    bool quick, report, only[SWEEPS];
    int seeds;
    const char *folder, *data;
} options;

static options opt = {false, false, {false}, 0, NULL, NULL};

static int grain_count(void) {
    return opt.quick ? 64 : 160;
}

/* --- cases ------------------------------------------------------------------------------------ */

static setting case_of(const sweep *s, int kind, double value) {
    setting c = {kind, {0}};
    memcpy(c.of, base, sizeof base);
    if (opt.quick) c.of[INERTIAL] = 3e-3;
    if (s->local > 0) c.of[DASHPOT] = 0, c.of[LOCAL] = s->local;
    c.of[s->variable] = value;
    return c;
}

/* Steps of the compression over those of the base case: strain / (rate dt), with a rate of
   I sqrt(P/rho)/d and a time step of fraction sqrt(m/k_n). */
static double relative_cost(const setting *c) {
    return sqrt(c->of[STIFFNESS_RATIO] / base[STIFFNESS_RATIO]) * base[INERTIAL] / c->of[INERTIAL] *
           base[FRACTION] / c->of[FRACTION];
}

/* How many seeds a case gets; 0: it is left out. Cases of a sweep and a kind of grains take about
   as long in all: of stiffness and rate some 40 s of discs and 40 s of the others, which take four
   times as long for a strain; of the other sweeps a quarter. */
static int seeds_of(const sweep *s, const setting *c) {
    const bool discs = c->kind == DISC_GRAINS, local = c->of[LOCAL] > 0;
    const bool main = s - sweeps <= SWEEP_RATE_LOCAL;
    const double cost = relative_cost(c), share = (discs ? 64 : 16) * (main ? 1 : 0.25);
    const int all = opt.seeds ? opt.seeds : discs ? MOST_SEEDS : 24;
    if (discs && s - sweeps == SWEEP_TOLERANCE) return 0;
    if (opt.quick) return cost > 2 ? 0 : 2;
    if (cost > (discs && !local ? 110 : 12)) return 0;
    return (int)fmin(all, fmax(2, share / cost));
}

/* What a case is called in runs.txt: the kind of grains, then the numbers in their order. */
static void write_name(const setting *c, char name[KEY_ROOM]) {
    int length = snprintf(name, KEY_ROOM, "%s", kind_names[c->kind]);
    for (int v = 0; v < VARIABLES; v++)
        length += snprintf(name + length, (size_t)(KEY_ROOM - length), ",%g", c->of[v]);
}

/* --- grains ----------------------------------------------------------------------------------- */

static dem2d_shape **real_shapes;
static int real_count;

/* Series of order 8 of outlines that it covers by 0.7 and more, as in examples/biaxial.c. */
static void fit_outlines(const char *folder) {
    static outlines all;
    read_outlines(&all, folder);
    real_shapes = get_memory((size_t)all.count, sizeof(dem2d_shape *));
    for (int i = 0; i < all.count; i++) {
        dem2d_fit_desc desc = {0};
        dem2d_fit_report report;
        dem2d_shape *shape;
        desc.model = DEM2D_FOURIER, desc.count = ORDER;
        expect_ok(
            dem2d_outline_fit(NULL, all.list[i].points, all.list[i].count, &desc, &shape, &report),
            all.list[i].name);
        if (report.coverage >= 0.7)
            real_shapes[real_count++] = shape;
        else
            dem2d_shape_destroy(shape);
    }
    if (real_count == 0) bench_fail("no outline below %s that a series covers by 0.7", folder);
    free_outlines(&all);
}

/* Without outlines: the polygons and series of the other benchmarks. */
static void take_templates(void) {
    real_shapes = get_memory(2 * TEMPLATES, sizeof(dem2d_shape *));
    for (int i = 0; i < TEMPLATES; i++) {
        real_shapes[real_count++] = templates[POLYGON * TEMPLATES + i];
        real_shapes[real_count++] = templates[FS * TEMPLATES + i];
    }
}

/* Rows of grains in a box that is about 1.5 times as high as it is wide: a disc of mean radius r
   takes (2 x 1.055 r)^2 in them, with bed_uniform(1.01, 1.1) in lay_rows. */
static bed draw_sample(int kind, int seed) {
    const int count = grain_count();
    const double width = 0.05 * 1.055 * sqrt(count / 1.5);
    bed b = draw_bed(DISCS, count, 7919 * (uint64_t)seed + 1, width);
    if (kind == REAL_GRAINS) {
        b.shapes = real_shapes, b.shape_count = real_count;
        for (int i = 0; i < count; i++)
            b.grains[i] = random_grain(&b, (int)bed_uniform(0, real_count));
        lay_rows(&b);
    }
    for (int i = 0; i < count; i++)
        b.top = fmax(b.top, b.grains[i].y + bounding_radius(&b, &b.grains[i]));
    return b;
}

/* --- the sample ------------------------------------------------------------------------------- */

typedef struct sample {
    dem2d_world *world;
    dem2d_material_id grain, wall;
    dem2d_particle_id *ids;
    dem2d_wall_id walls[WALLS];
    int count;
    double stiffness;  /* N/m */
    double rate_of_1;  /* 1/s, strain rate with the inertial number 1 */
    double time_step;  /* s */
    double wave_speed; /* m/s, sqrt(P/rho): at this speed a grain has the pressure P */
} sample;

static double wall_place(const sample *s, int which) {
    dem2d_wall_info info;
    expect_ok(dem2d_world_get_wall(s->world, s->walls[which], &info), "wall");
    return which <= RIGHT ? info.point.x : info.point.y;
}

static double width_of(const sample *s) {
    return wall_place(s, RIGHT) - wall_place(s, LEFT);
}

static double height_of(const sample *s) {
    return wall_place(s, TOP) - wall_place(s, BOTTOM);
}

static dem2d_wall_desc wall_desc(const sample *s, int which, double place) {
    static const double normals[WALLS][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    dem2d_wall_desc wall = {0};
    wall.material = s->wall;
    wall.normal.x = normals[which][0], wall.normal.y = normals[which][1];
    *(which <= RIGHT ? &wall.point.x : &wall.point.y) = place;
    return wall;
}

/* All but the bottom hold P from now on. Fast enough for any strain rate here: a sample of 20
   grains across that yields at I = 0.01 does so at 0.2 sqrt(P/rho). */
static void hold_pressure(const sample *s) {
    for (int w = 0; w < WALLS; w++) {
        const bool side = w <= RIGHT;
        dem2d_wall_desc wall = wall_desc(s, w, wall_place(s, w));
        if (w == BOTTOM) continue;
        wall.mode = DEM2D_WALL_SERVO, wall.stress = PRESSURE;
        wall.max_speed = 0.3 * s->wave_speed;
        wall.spans[0] = s->walls[side ? BOTTOM : LEFT];
        wall.spans[1] = s->walls[side ? TOP : RIGHT];
        expect_ok(dem2d_world_set_wall(s->world, s->walls[w], &wall), "wall");
    }
}

/* Contacts of grains with each other, and with the walls, which have no friction. */
static void set_contacts(const sample *s, double friction, double dashpot) {
    dem2d_pair_desc pair = {0};
    pair.normal_stiffness = s->stiffness;
    pair.damping_ratio = dashpot;
    expect_ok(dem2d_world_set_pair(s->world, s->grain, s->wall, &pair), "pair");
    pair.friction = friction;
    if (friction > 0)
        pair.tangential_stiffness = s->stiffness, pair.tangential_damping_ratio = dashpot;
    expect_ok(dem2d_world_set_pair(s->world, s->grain, s->grain, &pair), "pair");
}

static sample open_sample(const setting *c, const bed *b) {
    sample s = {0};
    dem2d_world_desc scene = {0};
    dem2d_material_desc stone = {0};
    scene.time_step = 1e-9; /* until the grains are there */
    scene.contact_tolerance = c->of[TOLERANCE];
    scene.particle_capacity = b->count;
    s.count = b->count, s.wave_speed = sqrt(PRESSURE / DENSITY);
    s.stiffness = PRESSURE * c->of[STIFFNESS_RATIO];
    s.ids = get_memory((size_t)b->count, sizeof *s.ids);
    stone.density = DENSITY;
    stone.normal_stiffness = stone.tangential_stiffness = s.stiffness;
    expect_ok(dem2d_world_create(&scene, &s.world), "world");
    expect_ok(dem2d_world_add_material(s.world, &stone, &s.grain), "material");
    expect_ok(dem2d_world_add_material(s.world, &stone, &s.wall), "material");
    add_bed(s.world, b, s.grain, s.ids);
    const double places[WALLS] = {b->left, b->right, b->bottom, b->top};
    for (int w = 0; w < WALLS; w++) {
        const dem2d_wall_desc wall = wall_desc(&s, w, places[w]);
        expect_ok(dem2d_world_add_wall(s.world, &wall, &s.walls[w]), "wall");
    }
    expect_ok(dem2d_world_inertial_number(s.world, 1, PRESSURE, &s.rate_of_1), "inertial number");
    s.rate_of_1 = 1 / s.rate_of_1;
    return s;
}

static void close_sample(sample *s) {
    dem2d_world_destroy(s->world);
    free(s->ids);
}

/* --- packing ---------------------------------------------------------------------------------- */

/* Speeds of half sqrt(P/rho) in random directions mix the rows. */
static void stir(const sample *s) {
    for (int i = 0; i < s->count; i++) {
        const double angle = bed_uniform(0, 2 * PI), speed = 0.5 * s->wave_speed;
        expect_ok(dem2d_world_drive_particle(s->world, s->ids[i], DEM2D_FREE,
                                             vec(speed * cos(angle), speed * sin(angle)), 0),
                  "velocity");
    }
}

static dem2d_stress stress_of(const sample *s) {
    dem2d_stress stress;
    expect_ok(dem2d_world_stress(s->world, width_of(s) * height_of(s), &stress), "stress");
    return stress;
}

/* Both stresses within a thousandth of P, forces in balance to a thousandth of their mean. */
static bool at_rest(const sample *s) {
    const dem2d_stress now = stress_of(s);
    dem2d_equilibrium e;
    expect_ok(dem2d_world_equilibrium(s->world, &e), "equilibrium");
    return fabs(now.xx / PRESSURE - 1) < 1e-3 && fabs(now.yy / PRESSURE - 1) < 1e-3 &&
           e.unbalanced < 1e-3;
}

/* Presses the grains together, without friction, until all is at rest. */
static void pack(sample *s) {
    const int batch = 200;
    int batches = 0;
    set_contacts(s, 0, base[DASHPOT]);
    expect_ok(dem2d_world_choose_time_step(s->world, 1, &s->time_step), "time step");
    expect_ok(dem2d_world_set_time_step(s->world, s->time_step), "time step");
    expect_ok(dem2d_world_set_damping(s->world, 0.3, 0), "damping");
    hold_pressure(s);
    /* at I = 0.01 a strain of 1 takes 100 / rate_of_1: time enough for a strain of 100 */
    const double most = 1e4 / s->rate_of_1 / s->time_step / batch;
    do {
        expect_ok(dem2d_world_step(s->world, batch, NULL), "step");
        if (++batches > most) bench_fail("a packing does not come to rest");
    } while (!at_rest(s));
}

/* Where grains and walls are now. */
static bed save_sample(const sample *s, const bed *from) {
    bed b = make_bed(from->count);
    b.shapes = from->shapes, b.shape_count = from->shape_count;
    for (int i = 0; i < b.count; i++) {
        dem2d_particle_info info;
        expect_ok(dem2d_world_get_particle(s->world, s->ids[i], &info), "particle");
        b.grains[i] = from->grains[i];
        b.grains[i].x = info.pose.position.x, b.grains[i].y = info.pose.position.y;
        b.grains[i].angle = dem2d_rot_angle(info.pose.rotation);
    }
    b.left = wall_place(s, LEFT), b.right = wall_place(s, RIGHT);
    b.bottom = wall_place(s, BOTTOM), b.top = wall_place(s, TOP);
    return b;
}

/* Rows, stirred and packed at the base case's stiffness. */
static bed pack_rows(int kind, int seed) {
    setting usual = {kind, {0}};
    memcpy(usual.of, base, sizeof base);
    bed rows = draw_sample(kind, seed);
    sample s = open_sample(&usual, &rows);
    stir(&s);
    pack(&s);
    const bed packed = save_sample(&s, &rows);
    close_sample(&s);
    free(rows.grains);
    return packed;
}

/* The same packing with another stiffness, changed by factors of 3.2 at most, each until it is at
   rest: so the samples of a seed differ as little as they can. */
static bed change_stiffness(const bed *packed, int kind, double to) {
    const double from = base[STIFFNESS_RATIO];
    const int stages = (int)ceil(fabs(log(to / from)) / log(3.2));
    setting usual = {kind, {0}};
    memcpy(usual.of, base, sizeof base);
    bed b = *packed;
    b.grains = get_memory((size_t)b.count, sizeof *b.grains);
    memcpy(b.grains, packed->grains, (size_t)b.count * sizeof *b.grains);
    for (int k = 1; k <= stages; k++) {
        usual.of[STIFFNESS_RATIO] = k == stages ? to : from * pow(to / from, (double)k / stages);
        sample s = open_sample(&usual, &b);
        pack(&s);
        const bed next = save_sample(&s, &b);
        close_sample(&s);
        free(b.grains);
        b = next;
    }
    return b;
}

/* The packing of a case: of its grains, seed and stiffness, with what else the base case has. The
   last ones are kept, because most cases begin with them. */
static const bed *packed_bed(const setting *c, int seed) {
    static bed packed, changed;
    static int last_kind, last_seed;
    static double last_stiffness;
    const double stiffness = c->of[STIFFNESS_RATIO];
    if (c->kind != last_kind || seed != last_seed) {
        free(packed.grains);
        packed = pack_rows(c->kind, seed);
        last_kind = c->kind, last_seed = seed, last_stiffness = 0;
    }
    if (stiffness == base[STIFFNESS_RATIO]) return &packed;
    if (stiffness != last_stiffness) {
        free(changed.grains);
        changed = change_stiffness(&packed, c->kind, stiffness);
        last_stiffness = stiffness;
    }
    return &changed;
}

/* --- shear ------------------------------------------------------------------------------------ */

static double porosity_of(const sample *s, const dem2d_packing *p) {
    return 1 - p->solid_area / (width_of(s) * height_of(s));
}

/* Top and grains move at the strain rate, the grains also sideways: as if the area stayed. */
static void begin_shear(const sample *s, double rate) {
    const double bottom = wall_place(s, BOTTOM);
    const double middle = (wall_place(s, LEFT) + wall_place(s, RIGHT)) / 2;
    dem2d_wall_desc top = wall_desc(s, TOP, wall_place(s, TOP));
    top.mode = DEM2D_WALL_MOVING;
    expect_ok(dem2d_world_set_wall(s->world, s->walls[TOP], &top), "wall");
    for (int i = 0; i < s->count; i++) {
        dem2d_particle_info info;
        expect_ok(dem2d_world_get_particle(s->world, s->ids[i], &info), "particle");
        const dem2d_vec at = info.pose.position;
        expect_ok(dem2d_world_drive_particle(s->world, s->ids[i], DEM2D_FREE,
                                             vec(rate * (at.x - middle), -rate * (at.y - bottom)),
                                             0),
                  "velocity");
    }
}

/* Takes the steps to a height, of which the first begins at another; returns seconds on the core.
 */
static double step_to(const sample *s, double height, int steps) {
    const double start = read_clock(CLOCK_THREAD_CPUTIME_ID);
    const dem2d_vec v = vec(0, (height - height_of(s)) / (steps * s->time_step));
    expect_ok(dem2d_world_drive_wall(s->world, s->walls[TOP], v, 0), "top");
    expect_ok(dem2d_world_step(s->world, steps, NULL), "step");
    return read_clock(CLOCK_THREAD_CPUTIME_ID) - start;
}

/* Adds the state to the means over the end of the test. */
static void add_state(const sample *s, double *out) {
    dem2d_packing packing;
    dem2d_equilibrium e;
    expect_ok(dem2d_world_packing(s->world, &packing), "packing");
    expect_ok(dem2d_world_equilibrium(s->world, &e), "equilibrium");
    out[POROSITY] += porosity_of(s, &packing) / END_SAMPLES;
    out[COORDINATION] += packing.coordination_loaded / END_SAMPLES;
    out[OVERLAP] += packing.mean_overlap / END_SAMPLES;
    out[UNBALANCED] += e.unbalanced / END_SAMPLES;
}

/* Peak and end of q/p. */
static void read_curve(const double *ratio, double *out) {
    double sum = 0;
    for (int k = 0; k < SAMPLES; k++) {
        sum += ratio[k] - (k >= PEAK_SAMPLES ? ratio[k - PEAK_SAMPLES] : 0);
        if (k + 1 >= PEAK_SAMPLES) out[PEAK] = fmax(out[PEAK], sum / PEAK_SAMPLES);
        if (k >= SAMPLES - END_SAMPLES) out[END] += ratio[k] / END_SAMPLES;
    }
}

static void shear(sample *s, const setting *c, double *out) {
    const double rate = c->of[INERTIAL] * s->rate_of_1, height = height_of(s);
    double ratio[SAMPLES];
    int64_t done = 0;
    expect_ok(dem2d_world_set_damping(s->world, c->of[LOCAL], 0), "damping");
    const double total = STRAIN / (rate * s->time_step);
    if (total < SAMPLES) bench_fail("fewer steps than samples");
    begin_shear(s, rate);
    for (int k = 0; k < SAMPLES; k++) {
        const int64_t next = (int64_t)(total * (k + 1) / SAMPLES);
        dem2d_principal principal;
        out[TIME] += step_to(s, height * exp(-STRAIN * (k + 1) / SAMPLES), (int)(next - done));
        done = next;
        const dem2d_stress stress = stress_of(s);
        expect_ok(dem2d_stress_principal(&stress, &principal), "stress");
        ratio[k] = principal.q / principal.p;
        if (k >= SAMPLES - END_SAMPLES) add_state(s, out);
    }
    out[STEPS] = (double)done;
    read_curve(ratio, out);
}

/* A fraction of the safe step of the packing's contacts, which the first step finds: that one takes
   so short a time that nothing moves. */
static void set_time_step(sample *s, double fraction) {
    double safe, limit;
    expect_ok(dem2d_world_step(s->world, 1, NULL), "step");
    expect_ok(dem2d_world_time_step_bounds(s->world, &safe, &limit, NULL), "time step");
    s->time_step = fraction * safe;
    expect_ok(dem2d_world_set_time_step(s->world, s->time_step), "time step");
}

static void run_case(const setting *c, int seed, double *out) {
    sample s = open_sample(c, packed_bed(c, seed));
    dem2d_packing packing;
    memset(out, 0, QUANTITIES * sizeof *out);
    set_contacts(&s, SHEAR_FRICTION, c->of[DASHPOT]);
    hold_pressure(&s);
    set_time_step(&s, c->of[FRACTION]);
    expect_ok(dem2d_world_packing(s.world, &packing), "packing");
    out[PACKED] = porosity_of(&s, &packing);
    shear(&s, c, out);
    close_sample(&s);
}

/* --- runs that are made ----------------------------------------------------------------------- */

/* A line of runs.txt: the case in words, the seed, the quantities. */
typedef struct record {
    char name[KEY_ROOM];
    int seed;
    double of[QUANTITIES];
} record;

static record *records;
static int record_count, record_room;

static void add_record(const record *r) {
    if (record_count == record_room) {
        record_room = 2 * record_room + 256;
        records = need(realloc(records, (size_t)record_room * sizeof *records));
    }
    records[record_count++] = *r;
}

static const record *find_record(const char *name, int seed) {
    for (int i = 0; i < record_count; i++)
        if (records[i].seed == seed && strcmp(records[i].name, name) == 0) return &records[i];
    return NULL;
}

static void write_record(const record *r, FILE *file) {
    fprintf(file, "%s %d", r->name, r->seed);
    for (int q = 0; q < QUANTITIES; q++) fprintf(file, " %.8g", r->of[q]);
    fprintf(file, "\n");
    fflush(file);
}

static bool read_record(const char *line, record *r) {
    int length = 0;
    if (!strchr(line, '\n') || sscanf(line, "%95s %d%n", r->name, &r->seed, &length) != 2)
        return false;
    for (int q = 0; q < QUANTITIES; q++) {
        char *end;
        r->of[q] = strtod(line + length, &end);
        if (end == line + length) return false;
        length = (int)(end - line);
    }
    return true;
}

/* First line: what all runs have in common. A file with another one is begun anew. */
static void write_title(char *title, size_t room) {
    snprintf(title, room, "# N = %d, grains: %d templates of %s\n", grain_count(), real_count,
             opt.data ? opt.data : "bench_beds.h");
}

/* Runs of an earlier command; a last line that a stop has cut does not count. */
static void read_runs(const char *title) {
    char line[LINE_ROOM];
    record r;
    FILE *file = fopen("runs.txt", "r");
    if (file && fgets(line, sizeof line, file) && strcmp(line, title) == 0)
        while (fgets(line, sizeof line, file))
            if (read_record(line, &r)) add_record(&r);
    if (file) fclose(file);
    if (record_count > 0) printf("%d runs of %s/runs.txt are used\n", record_count, opt.folder);
}

/* The file of all runs, with those that are there, to be continued. */
static FILE *write_runs(const char *title) {
    FILE *file = create("runs.txt");
    fputs(title, file);
    for (int i = 0; i < record_count; i++) write_record(&records[i], file);
    return file;
}

static void make_run(const setting *c, int seed, FILE *file) {
    record r;
    write_name(c, r.name);
    r.seed = seed;
    if (find_record(r.name, seed)) return;
    run_case(c, seed, r.of);
    add_record(&r);
    write_record(&r, file);
}

/* In rounds of about the same time: after a stop all cases have an equal part of their seeds. */
static void make_runs(const char *title) {
    FILE *file = write_runs(title);
    for (int round = 1; round <= MOST_SEEDS; round++)
        for (int kind = 0; kind < KINDS_OF_GRAINS; kind++)
            for (int k = 0; k < SWEEPS; k++)
                for (int i = 0; opt.only[k] && sweeps[k].values[i] >= 0; i++) {
                    const setting c = case_of(&sweeps[k], kind, sweeps[k].values[i]);
                    const double part = (double)round / MOST_SEEDS;
                    const int seeds = (int)(seeds_of(&sweeps[k], &c) * part + 0.5);
                    for (int seed = 1; seed <= seeds; seed++) make_run(&c, seed, file);
                }
    fclose(file);
}

/* --- statistics ------------------------------------------------------------------------------- */

/* Samples of one seed have much in common: a run is its case, plus its seed, plus chance:
       y = mean(case) + effect(seed) + rest
   Means and effects are found by least squares. A mean is that of all seeds, also where a case has
   few. The error of a mean is that by the rest; what it lacks is common to all cases of the sweep.
 */
typedef struct point {
    double value; /* of the sweep's variable */
    int seeds;    /* 0: no run */
    char name[KEY_ROOM];
    double mean[QUANTITIES];
} point;

typedef struct family {
    point points[MOST_CASES];
    double effects[QUANTITIES][MOST_SEEDS + 1];
    double rest[QUANTITIES];   /* standard deviation */
    double common[QUANTITIES]; /* standard error of the mean effect */
} family;

static family families[KINDS_OF_GRAINS][SWEEPS];

static int case_count(int k) {
    int n = 0;
    while (sweeps[k].values[n] >= 0) n++;
    return n;
}

/* The case of a record among those of a sweep, or -1. */
static int case_at(const family *f, const record *r) {
    for (int i = 0; i < MOST_CASES; i++)
        if (strcmp(f->points[i].name, r->name) == 0) return i;
    return -1;
}

static void renew_means(family *f, int q, const int *cases) {
    double sums[MOST_CASES] = {0};
    for (int i = 0; i < record_count; i++)
        if (cases[i] >= 0) sums[cases[i]] += records[i].of[q] - f->effects[q][records[i].seed];
    for (int i = 0; i < MOST_CASES; i++)
        f->points[i].mean[q] = f->points[i].seeds > 0 ? sums[i] / f->points[i].seeds : NAN;
}

/* Effects of the seeds by the means of the cases; their mean is 0. Returns the number of seeds. */
static int renew_effects(family *f, int q, const int *cases) {
    double sums[MOST_SEEDS + 1] = {0}, mean = 0;
    int counts[MOST_SEEDS + 1] = {0}, seeds = 0;
    for (int i = 0; i < record_count; i++) {
        const int seed = records[i].seed;
        if (cases[i] < 0) continue;
        sums[seed] += records[i].of[q] - f->points[cases[i]].mean[q], counts[seed]++;
    }
    for (int s = 1; s <= MOST_SEEDS; s++)
        if (counts[s] > 0) sums[s] /= counts[s], mean += sums[s], seeds++;
    for (int s = 1; s <= MOST_SEEDS; s++)
        f->effects[q][s] = counts[s] > 0 ? sums[s] - mean / seeds : 0;
    return seeds;
}

/* Least squares by turns, of the means and of the effects. */
static void fit_effects(family *f, int q, const int *cases) {
    enum { TURNS = 500 };
    double squares = 0, spread = 0;
    int seeds = 0, freedom = 1;
    for (int turn = 0; turn < TURNS; turn++) {
        renew_means(f, q, cases);
        seeds = renew_effects(f, q, cases);
    }
    for (int i = 0; i < record_count; i++) {
        if (cases[i] < 0) continue;
        const double mean = f->points[cases[i]].mean[q];
        squares += pow(records[i].of[q] - mean - f->effects[q][records[i].seed], 2);
        freedom++;
    }
    for (int i = 0; i < MOST_CASES; i++) freedom -= f->points[i].seeds > 0;
    freedom -= seeds;
    for (int s = 1; s <= MOST_SEEDS; s++) spread += pow(f->effects[q][s], 2);
    f->rest[q] = freedom > 0 ? sqrt(squares / freedom) : NAN;
    f->common[q] = seeds > 1 ? sqrt(spread / (seeds - 1) / seeds) : NAN;
}

static void read_family(int kind, int k) {
    family *f = &families[kind][k];
    int *cases = get_memory((size_t)record_count, sizeof *cases);
    for (int i = 0; i < case_count(k); i++) {
        const setting c = case_of(&sweeps[k], kind, sweeps[k].values[i]);
        f->points[i].value = sweeps[k].values[i];
        write_name(&c, f->points[i].name);
    }
    for (int i = 0; i < record_count; i++) {
        cases[i] = case_at(f, &records[i]);
        if (cases[i] >= 0) f->points[cases[i]].seeds++;
    }
    for (int q = 0; q < OVERLAP; q++) fit_effects(f, q, cases);
    for (int q = OVERLAP; q < QUANTITIES; q++) renew_means(f, q, cases); /* plain means */
    free(cases);
}

static const point *point_at(int kind, int k, int i) {
    return &families[kind][k].points[i];
}

/* Standard error of a mean against those of other cases of the sweep. */
static double error_of(int kind, int k, int i, int q) {
    return families[kind][k].rest[q] / sqrt(point_at(kind, k, i)->seeds);
}

/* y = limit (1 + slope x) by least squares, weights by the number of seeds; standard errors from
   the rest; misfit: chi square per degree of freedom. */
typedef struct limit {
    double value, error, slope, slope_error, misfit;
    int count; /* of cases; below 3 there is no fit */
} limit;

static double small_number(int k, const point *p) {
    return sweeps[k].variable == STIFFNESS_RATIO ? 1 / p->value : p->value;
}

/* Cases near the limit, where the error is proportional to the small number. */
static bool is_fitted(int k, const point *p) {
    return p->seeds > 0 && small_number(k, p) <= (k == SWEEP_STIFFNESS ? 1.01e-3 : 3.1e-3);
}

static limit fit_limit(int kind, int k, int q) {
    limit l = {NAN, NAN, NAN, NAN, NAN, 0};
    const double s = families[kind][k].rest[q];
    double w = 0, x = 0, y = 0, xx = 0, xy = 0, chi = 0;
    for (int i = 0; i < case_count(k); i++) {
        const point *p = point_at(kind, k, i);
        const double u = small_number(k, p), n = p->seeds;
        if (!is_fitted(k, p)) continue;
        l.count++, w += n, x += n * u, y += n * p->mean[q];
        xx += n * u * u, xy += n * u * p->mean[q];
    }
    const double d = w * xx - x * x;
    if (l.count < 3) return l;
    l.value = (xx * y - x * xy) / d, l.slope = (w * xy - x * y) / d / l.value;
    l.error = s * sqrt(xx / d), l.slope_error = fabs(s * sqrt(w / d) / l.value);
    for (int i = 0; i < case_count(k); i++) {
        const point *p = point_at(kind, k, i);
        if (!is_fitted(k, p)) continue;
        chi += p->seeds * pow(p->mean[q] - l.value * (1 + l.slope * small_number(k, p)), 2);
    }
    l.misfit = chi / (s * s) / (l.count - 2);
    return l;
}

/* What a case is compared with: the limit of its sweep or, in the others, the base case. */
static double reference(int kind, int k, int q) {
    const limit l = fit_limit(kind, k, q);
    const int variable = sweeps[k].variable;
    const double usual = variable == LOCAL ? sweeps[k].local : base[variable];
    if (k <= SWEEP_RATE_LOCAL) return l.count < 3 ? NAN : l.value;
    for (int i = 0; i < case_count(k); i++) {
        const point *p = point_at(kind, k, i);
        if (p->value == usual && p->seeds > 0) return p->mean[q];
    }
    return NAN;
}

/* --- tables ----------------------------------------------------------------------------------- */

static void print_sweep(int kind, int k) {
    printf("\n%s, %s\n%15s %5s | %-15s %7s | %-15s %7s | %-14s | %-12s | %7s %8s | %9s %8s %5s\n",
           kind_names[kind], sweeps[k].name, sweeps[k].label, "seeds", "q/p peak", "off %",
           "q/p end", "off %", "porosity", "coordination", "overlap", "unbal.", "steps", "s", "ns");
    for (int i = 0; i < case_count(k); i++) {
        const point *p = point_at(kind, k, i);
        const double *m = p->mean;
        if (p->seeds == 0) continue;
        printf("%15g %5d |", p->value, p->seeds);
        for (int q = PEAK; q <= END; q++)
            printf(" %.4f +- %.4f %+7.2f |", m[q], error_of(kind, k, i, q),
                   100 * (m[q] / reference(kind, k, q) - 1));
        printf(" %.4f +-%.4f | %.3f +-%.3f | %6.3f%% %8.1e | %9.0f %8.2f %5.0f\n", m[POROSITY],
               error_of(kind, k, i, POROSITY), m[COORDINATION], error_of(kind, k, i, COORDINATION),
               100 * m[OVERLAP], m[UNBALANCED], m[STEPS], m[TIME],
               1e9 * m[TIME] / m[STEPS] / grain_count());
    }
    const double *common = families[kind][k].common;
    printf("%21s | %8s %.4f %16s %.4f %10s %.4f  | %6s %.3f\n", "common error", "", common[PEAK],
           "", common[END], "", common[POROSITY], "", common[COORDINATION]);
}

static bool has_points(int kind, int k) {
    int n = 0;
    for (int i = 0; i < case_count(k); i++) n += point_at(kind, k, i)->seeds > 0;
    return n > 0;
}

static bool has_any(int k) {
    return has_points(DISC_GRAINS, k) || has_points(REAL_GRAINS, k);
}

static void write_points(void) {
    FILE *csv = create("rigid.csv");
    fprintf(csv, "grains,sweep,value,seeds");
    for (int q = 0; q < QUANTITIES; q++) {
        fprintf(csv, ",%s", quantity_names[q]);
        if (q < OVERLAP) fprintf(csv, ",%s_error", quantity_names[q]);
    }
    fprintf(csv, "\n");
    for (int kind = 0; kind < KINDS_OF_GRAINS; kind++)
        for (int k = 0; k < SWEEPS; k++)
            for (int i = 0; i < case_count(k); i++) {
                const point *p = point_at(kind, k, i);
                if (p->seeds == 0) continue;
                fprintf(csv, "%s,%s,%g,%d", kind_names[kind], sweeps[k].name, p->value, p->seeds);
                for (int q = 0; q < QUANTITIES; q++) {
                    fprintf(csv, ",%.6g", p->mean[q]);
                    if (q < OVERLAP) fprintf(csv, ",%.3g", error_of(kind, k, i, q));
                }
                fprintf(csv, "\n");
            }
    fclose(csv);
}

/* Where the error is 1 %: at a slope of the fit, or of the fit and twice its standard error. */
static double one_percent(int k, double slope) {
    return k == SWEEP_STIFFNESS ? fabs(slope) / 0.01 : 0.01 / fabs(slope);
}

static void print_limits(void) {
    FILE *csv = create("limits.csv");
    printf("\nLimits: y = limit (1 + slope x), x = P/k_n up to 1e-3, or the inertial number up to "
           "3e-3.\n1 %%: k_n/P or inertial number where the slope makes an error of 1 %%, and with "
           "the slope and twice its error.\n%-7s %-10s %-13s %19s %19s %7s | %9s %9s\n",
           "grains", "sweep", "of", "limit", "slope", "misfit", "1 %", "at worst");
    fprintf(csv, "grains,sweep,quantity,limit,limit_error,slope,slope_error,misfit,one_percent,"
                 "one_percent_worst\n");
    for (int n = 0; n < KINDS_OF_GRAINS * (SWEEP_RATE_LOCAL + 1); n++)
        for (int q = PEAK; q <= COORDINATION; q++) {
            const int kind = n / (SWEEP_RATE_LOCAL + 1), k = n % (SWEEP_RATE_LOCAL + 1);
            const limit l = fit_limit(kind, k, q);
            if (l.count < 3) continue;
            const double here = one_percent(k, l.slope);
            const double worst = one_percent(k, fabs(l.slope) + 2 * l.slope_error);
            printf("%-7s %-10s %-13s %9.4f +-%7.4f %10.3g +-%6.2g %7.2f | %9.2g %9.2g\n",
                   kind_names[kind], sweeps[k].name, quantity_names[q], l.value, l.error, l.slope,
                   l.slope_error, l.misfit, here, worst);
            fprintf(csv, "%s,%s,%s,%.6g,%.3g,%.4g,%.3g,%.3g,%.4g,%.4g\n", kind_names[kind],
                    sweeps[k].name, quantity_names[q], l.value, l.error, l.slope, l.slope_error,
                    l.misfit, here, worst);
        }
    fclose(csv);
}

/* --- picture ---------------------------------------------------------------------------------- */

static const char *const colours[KINDS_OF_GRAINS] = {"#0072b2", "#d55e00"};

/* Blocks of data: value; peak, end and coordination, each with its error; seconds; |off| of the end
   in %, with its error. */
static void write_block(FILE *file, int kind, int k) {
    fprintf(file, "$d%d%d << EOD\n", kind, k);
    for (int i = 0; i < case_count(k); i++) {
        const point *p = point_at(kind, k, i);
        const double whole = reference(kind, k, END);
        if (p->seeds == 0) continue;
        fprintf(file, "%g %.6g %.3g %.6g %.3g %.6g %.3g %.4g %.4g %.3g\n", p->value, p->mean[PEAK],
                error_of(kind, k, i, PEAK), p->mean[END], error_of(kind, k, i, END),
                p->mean[COORDINATION], error_of(kind, k, i, COORDINATION), p->mean[TIME],
                100 * fabs(p->mean[END] / whole - 1), 100 * error_of(kind, k, i, END) / whole);
    }
    fprintf(file, "EOD\n");
}

/* Peak and end of both kinds of grains against the variable of a sweep. */
static void plot_ratios(FILE *file, int k, int other) {
    if (!has_any(k) && (other < 0 || !has_any(other))) return;
    fprintf(file, "plot \\\n");
    for (int kind = 0; kind < KINDS_OF_GRAINS; kind++) {
        const char *c = colours[kind], *name = kind_names[kind];
        const limit l = fit_limit(kind, k, END);
        if (has_points(kind, k))
            fprintf(file,
                    "    $d%d%d using 1:4:5 with yerrorlines lc '%s' pt 7 lw 1.5 title '%s, end', "
                    "\\\n    $d%d%d using 1:2:3 with yerrorlines lc '%s' pt 6 dt 2 title '%s, "
                    "peak', \\\n",
                    kind, k, c, name, kind, k, c, name);
        if (l.count >= 3)
            fprintf(file, "    %.6g with lines lc '%s' dt 3 notitle, \\\n", l.value, c);
        if (other >= 0 && has_points(kind, other))
            fprintf(file,
                    "    $d%d%d using 1:4:5 with yerrorlines lc '%s' pt 9 dt 4 title '%s, end, "
                    "local damping', \\\n",
                    kind, other, c, name);
    }
    fprintf(file, "    NaN notitle\n");
}

static void plot_coordination(FILE *file) {
    if (!has_any(SWEEP_STIFFNESS)) return;
    fprintf(file, "plot \\\n");
    for (int kind = 0; kind < KINDS_OF_GRAINS; kind++)
        if (has_points(kind, SWEEP_STIFFNESS))
            fprintf(file,
                    "    $d%d%d using 1:6:7 with yerrorlines lc '%s' pt 7 lw 1.5 title '%s', \\\n",
                    kind, SWEEP_STIFFNESS, colours[kind], kind_names[kind]);
    fprintf(file, "    NaN notitle\n");
}

static void plot_cost(FILE *file) {
    static const int shown[] = {SWEEP_STIFFNESS, SWEEP_RATE, SWEEP_RATE_LOCAL};
    if (!has_any(SWEEP_STIFFNESS) && !has_any(SWEEP_RATE) && !has_any(SWEEP_RATE_LOCAL)) return;
    fprintf(file, "plot 1 with lines lc '#888888' dt 2 notitle, \\\n");
    for (int kind = 0; kind < KINDS_OF_GRAINS; kind++)
        for (int k = 0; k < COUNT_OF(shown); k++)
            if (has_points(kind, shown[k]))
                fprintf(file,
                        "    $d%d%d using 8:($9 > 0.02 ? $9 : 0.02):($9 > $10 + 0.02 ? $9 - $10 : "
                        "0.02):($9 + $10) with yerrorlines lc '%s' pt %d dt %d title '%s, %s', "
                        "\\\n",
                        kind, shown[k], colours[kind], 7 - k, k + 1, kind_names[kind],
                        sweeps[shown[k]].name);
    fprintf(file, "    NaN notitle\n");
}

static void draw(void) {
    FILE *file = create("rigid.gp");
    for (int kind = 0; kind < KINDS_OF_GRAINS; kind++)
        for (int k = 0; k < SWEEPS; k++)
            if (has_points(kind, k)) write_block(file, kind, k);
    fprintf(file, "if (!exists('picture')) picture = 'svg'\n"
                  "if (picture eq 'svg') {\n"
                  "    set terminal svg size 1300,1100 font 'Helvetica,13' background '#ffffff'\n"
                  "} else {\n    set terminal pngcairo size 1300,1100 font 'Helvetica,11'\n}\n"
                  "set output 'rigid.'.picture\nset grid\nset logscale x\n"
                  "set format x '10^{%%L}'\nset key below font ',10'\nset multiplot layout 2,2 "
                  "title 'Biaxial test: errors by softness and loading rate'\n"
                  "set xlabel 'k_n / P'\nset ylabel 'q/p'\n");
    plot_ratios(file, SWEEP_STIFFNESS, -1);
    fprintf(file, "set xlabel 'inertial number'\n");
    plot_ratios(file, SWEEP_RATE, SWEEP_RATE_LOCAL);
    fprintf(file, "set xlabel 'k_n / P'\nset ylabel 'coordination number, end'\n");
    plot_coordination(file);
    fprintf(file, "set xlabel 'time of a run on a core, s'\nset ylabel '|error| of q/p at the end, "
                  "%%, against the limit'\nset logscale y\nset yrange [0.02:*]\n");
    plot_cost(file);
    fprintf(file, "unset multiplot\n");
    fclose(file);
    if (system("command -v gnuplot > /dev/null 2>&1") != 0)
        printf("skipped: rigid.svg: gnuplot is not installed (it draws rigid.gp)\n");
    else
        printf("%s/rigid.svg%s\n", opt.folder,
               system("gnuplot rigid.gp") == 0 ? "" : ": gnuplot failed");
}

/* --- running ---------------------------------------------------------------------------------- */

static int usage(void) {
    fprintf(stderr, "usage: bench_rigid [--quick] [--only SWEEP,...] [--seeds N] [--data DIR] "
                    "[--report] [OUTDIR]\nsweeps:");
    for (int i = 0; i < SWEEPS; i++) fprintf(stderr, " %s", sweeps[i].name);
    fprintf(stderr, "\n");
    return 2;
}

static bool parse_sweeps(char *list) {
    for (char *name = strtok(list, ","); name; name = strtok(NULL, ",")) {
        int i = 0;
        while (i < SWEEPS && strcmp(name, sweeps[i].name) != 0) i++;
        if (i == SWEEPS) return false;
        opt.only[i] = true;
    }
    return true;
}

static bool parse(int argc, char **argv) {
    bool all = true;
    for (int i = 1; i < argc; i++) {
        const bool more = i + 1 < argc;
        if (strcmp(argv[i], "--quick") == 0)
            opt.quick = true;
        else if (strcmp(argv[i], "--report") == 0)
            opt.report = true;
        else if (strcmp(argv[i], "--seeds") == 0 && more)
            opt.seeds = atoi(argv[++i]);
        else if (strcmp(argv[i], "--data") == 0 && more)
            opt.data = argv[++i];
        else if (strcmp(argv[i], "--only") == 0 && more && parse_sweeps(argv[i + 1]))
            all = false, i++;
        else if (argv[i][0] != '-' && !opt.folder)
            opt.folder = argv[i];
        else
            return false;
    }
    for (int i = 0; i < SWEEPS; i++) opt.only[i] = opt.only[i] || all;
    if (!opt.folder) opt.folder = "build/bench_rigid";
    return opt.seeds >= 0 && opt.seeds <= MOST_SEEDS;
}

int main(int argc, char **argv) {
    const double start = seconds();
    if (!parse(argc, argv)) return usage();
    bed_state = 1;
    make_templates();
    if (opt.data)
        fit_outlines(opt.data);
    else
        take_templates();
    enter_folder(opt.folder);
    char title[LINE_ROOM];
    write_title(title, sizeof title);
    read_runs(title);
    if (!opt.report) make_runs(title);
    for (int kind = 0; kind < KINDS_OF_GRAINS; kind++)
        for (int k = 0; k < SWEEPS; k++)
            if (opt.only[k]) read_family(kind, k);
    printf("%d grains a sample; grains: %d templates of %s; P = %g Pa\n", grain_count(), real_count,
           opt.data ? opt.data : "bench_beds.h", PRESSURE);
    for (int kind = 0; kind < KINDS_OF_GRAINS; kind++)
        for (int k = 0; k < SWEEPS; k++)
            if (has_points(kind, k)) print_sweep(kind, k);
    write_points();
    print_limits();
    printf("\n");
    draw();
    printf("%.0f s\n", seconds() - start);
    for (int i = 0; opt.data && i < real_count; i++) dem2d_shape_destroy(real_shapes[i]);
    for (int i = 0; i < COUNT_OF(templates); i++) dem2d_shape_destroy(templates[i]);
    free(real_shapes);
    free(records);
    return 0;
}
