/* biaxial_options.h - the options of biaxial, and the plan that they make: sizes and times of a
 * run. */
#ifndef DEM2D_EXAMPLES_BIAXIAL_OPTIONS_H
#define DEM2D_EXAMPLES_BIAXIAL_OPTIONS_H

#include "grains.h"

static const char usage[] =
    "usage: biaxial [options]\n"
    "Packs grains under gravity, consolidates them at 100 kPa and compresses them.\n"
    "  --particles N     number of grains, 10 to 1000000 (500; with --quick 100)\n"
    "  --seed S          of the random numbers, 0 to 2^64 - 1 (1)\n"
    "  --shapes SET      mixed (all five), noncircular (ellipse, polygon, bezier), or a\n"
    "                    comma-separated list of circle, ellipse, polygon, bezier, fs (mixed)\n"
    "  --damping KIND    local (Cundall, 0.7: [P]) or global (viscous, 0.7 1/s: [F]) (local)\n"
    "  --restitution E   of head-on collisions, 0.01 to 1: below 1 contacts have a dashpot (1)\n"
    "  --stiffness K     of contacts, N/m, 1e5 to 1e9; the time step goes with it (1e7)\n"
    "  --wall-friction   keep friction 0.2 at the walls after settling, as the papers do\n"
    "  --gravity         keep gravity after settling: the papers do not say\n"
    "  --solver NAME     of contacts: certified or gjk (GJK and EPA) (certified)\n"
    "  --faces RULE      forces where faces meet: two (points) or one (two)\n"
    "  --papers          the papers' way: GJK and EPA for every pair in every step, circles too,\n"
    "                    one contact point, templates by their fits, friction at the walls\n"
    "  --grains PATH     bezier and fs grains from an image (PBM, PGM), an outline (CSV, first\n"
    "                    line \"x,y\"), or a directory of outlines, without any of images\n"
    "                    (without PATH: a few outlines made here)\n" SEARCH_USAGE
    "  --min-coverage C  leave out grains that convex templates cover less, 0 to 1 (0.7)\n"
    "  --out DIR         for history.csv and a picture (SVG) and histograms (CSV) of the settled,\n"
    "                    packed and final state; made if its parent exists (out)\n"
    "  --pairs           also pairs.csv: support calls of GJK and EPA's residuals for all near\n"
    "                    pairs of the settled state\n"
    "  --ledger          keep the ledger of energies: its columns in history.csv, and a check\n"
    "                    that it closes; --quick keeps it unless --faces are one\n"
    "  --vtk             also particles.pvd and contacts.pvd with 40 frames in vtk/, for ParaView\n"
    "  --quick           a small, hasty run of 8000 steps with wider bands for the checks\n"
    "  --help            this text\n"
    "Exit status: 0 all physical checks hold, 1 one failed, 2 bad usage or input, 130 stopped by\n"
    "Ctrl-C, with what there was written.\n";

static const double STRESS = 1e5; // Pa, on the sides, and on the top while consolidating
static const double STIFFNESS_OF_PAPERS = 1e7; // N/m

/* ---- options ---- */

typedef struct options {
    int particles; // 0: not given
    uint64_t seed;
    bool kinds[KINDS];
    bool global_damping;
    double damping_ratio; // of the contacts' dashpots
    bool quick, pairs, vtk, ledger;
    bool papers, wall_friction, gravity;
    double stiffness;   // N/m
    int solver, faces;  // dem2d_solver, dem2d_face_rule
    const char *grains; // or NULL
    dem2d_image_desc search;
    double min_coverage;
    const char *out;
} options;

enum {
    QUICK,
    PARTICLES,
    SEED,
    SHAPES,
    DAMPING,
    RESTITUTION,
    STIFFNESS,
    WALL_FRICTION,
    GRAVITY,
    SOLVER,
    FACES,
    PAPERS,
    GRAINS,
    SEARCH, // SEARCH_OPTIONS of them
    MIN_COVERAGE = SEARCH + SEARCH_OPTIONS,
    OUT,
    PAIRS,
    LEDGER,
    VTK,
    OPTIONS
};
static const char *const option_names[OPTIONS] = {
    "--quick",        "--particles=", "--seed=",         "--shapes=",  "--damping=",
    "--restitution=", "--stiffness=", "--wall-friction", "--gravity",  "--solver=",
    "--faces=",       "--papers",     "--grains=",       SEARCH_NAMES, "--min-coverage=",
    "--out=",         "--pairs",      "--ledger",        "--vtk"};

static options parse_options(int count, char **arguments) {
    static const char *const dampings[] = {"local", "global"};
    static const char *const solvers[] = {"certified", "gjk"};
    static const char *const rules[] = {"two", "one"};
    options o = {0};
    o.seed = 1;
    o.stiffness = STIFFNESS_OF_PAPERS;
    o.out = "out";
    o.search = default_search();
    o.min_coverage = 0.7;
    parse_shapes("mixed", o.kinds);
    for (int i = 1; i < count; i++) {
        const char *name = arguments[i], *value;
        const int which = parse_option(count, arguments, &i, usage, option_names, OPTIONS, &value);
        if (which == QUICK) o.quick = true;
        if (which == PARTICLES) o.particles = (int)parse_integer(name, value, 10, 1000000);
        if (which == SEED) o.seed = parse_integer(name, value, 0, UINT64_MAX);
        if (which == SHAPES) parse_shapes(value, o.kinds);
        if (which == DAMPING) o.global_damping = parse_name(name, value, dampings, 2) == 1;
        if (which == RESTITUTION)
            must(dem2d_damping_ratio(parse_real(name, value, 0.01, 1), &o.damping_ratio), name);
        if (which == STIFFNESS) o.stiffness = parse_real(name, value, 1e5, 1e9);
        if (which == WALL_FRICTION) o.wall_friction = true;
        if (which == GRAVITY) o.gravity = true;
        if (which == SOLVER) o.solver = parse_name(name, value, solvers, 2);
        if (which == FACES) o.faces = parse_name(name, value, rules, 2);
        if (which == PAPERS) o.papers = true;
        if (which == GRAINS) o.grains = value;
        if (which >= SEARCH && which < MIN_COVERAGE) take_search(which - SEARCH, value, &o.search);
        if (which == MIN_COVERAGE) o.min_coverage = parse_real(name, value, 0, 1);
        if (which == OUT) o.out = value;
        if (which == PAIRS) o.pairs = true;
        if (which == LEDGER) o.ledger = true;
        if (which == VTK) o.vtk = true;
    }
    if (o.papers) {
        o.solver = DEM2D_GJK_EPA;
        o.faces = DEM2D_ONE_POINT;
        o.wall_friction = true;
    }
    if (o.particles == 0) o.particles = o.quick ? 100 : 500;
    return o;
}

/* A hasty run has its energy checked in any case: a ledger takes a third more instructions, too
   much for the whole test. With one point where faces meet energy is not conserved. */
static bool keeps_ledger(const options *o) {
    return o->ledger || (o->quick && o->faces == DEM2D_TWO_POINTS);
}

/* ---- the plan: sizes and times of a run ---- */

typedef struct plan {
    double time_step;                  // s
    double width, height;              // m, of the box
    double gravity;                    // m/s2, while settling
    double servo_speed;                // m/s, at most
    double top_speed;                  // m/s, of the compression
    double local_damping;              // -
    double global_damping;             // 1/s
    int settle, consolidate, compress; // steps
    int frame;                         // steps from one VTK file to the next
    int particles;
} plan;

enum { ROW = 500 }; // steps from one row of the history to the next, but in compression

/* The papers' test. Fewer than 500 grains fill less of the box: the top wall then goes slower in
   proportion, for the same strain. */
static plan full_plan(const options *o) {
    const double more = o->particles > 500 ? o->particles / 500.0 : 1;
    const double fewer = o->particles < 500 ? o->particles / 500.0 : 1;
    plan p = {1e-4, 1.0,   3.0 * more, 9.8,   0.1,  0.1 * fewer, 0.7,
              0,    50000, 10000,      20000, 2000, o->particles};
    return p;
}

/* The same in a tenth of the steps: 100 grains start half packed in a narrow box, fall under five
   times the gravity (at the bottom this weighs half of 100 kPa), and the servo walls may hurry.
   Other numbers of grains scale the box both ways, and speeds and gravity with it. */
static plan quick_plan(const options *o) {
    const double s = sqrt(o->particles / 100.0);
    plan p = {1e-4, 0.45 * s, s,    49 * s, 0.5 * s, 0.1 * s,     0.7,
              0,    3500,     1500, 3000,   500,     o->particles};
    return p;
}

static plan make_plan(const options *o) {
    plan p = o->quick ? quick_plan(o) : full_plan(o);
    if (o->global_damping) {
        p.local_damping = 0;
        p.global_damping = o->quick ? 10 : 0.7; // settling is 14 times shorter
    }
    /* contacts swing faster by the root of their stiffness: as many more steps, of whole rows */
    const double faster = sqrt(o->stiffness / STIFFNESS_OF_PAPERS);
    int *const steps[4] = {&p.settle, &p.consolidate, &p.compress, &p.frame};
    for (int i = 0; i < 4; i++) *steps[i] = ROW * (int)ceil(*steps[i] * faster / ROW);
    p.time_step /= faster;
    return p;
}

#endif
