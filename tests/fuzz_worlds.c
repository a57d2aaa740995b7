/* fuzz_worlds [COUNT [SEED [WORLD]]] - random worlds with random subsets of the library's features
   against what must hold of each: see random_worlds.h. COUNT worlds (1e5) of a SEED (1), or one
   WORLD of them again. Tells each world that fails, how many did by oracle, and how often each pair
   of features was used together; a pair that never was is a failure. Exit status: 0, 1 if a world
   or a pair failed, 2 for bad usage. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "inside.h"
#include "random_worlds.h"

enum { TOLD = 20 }; /* worlds that fail are told so many times for each oracle */

static int64_t met[WITH_COUNT][WITH_COUNT];

/* Two that can't be used together. */
static bool exclusive(int a, int b) {
    static const int never[][2] = {{WITH_LAW, WITH_TWO_POINTS}, {WITH_TWO_POINTS, WITH_ONE_POINT}};
    static const int no_cell[] = {WITH_SEGMENT, WITH_CHAIN}; /* all of them are chains there */
    static const int no_flow[] = {WITH_SERVO, WITH_TURNED, WITH_REFUSED};
    static const int not_held[] = {WITH_MOVING, WITH_WALLS,     WITH_BELT,
                                   WITH_POINTS, WITH_ONE_SIDED, WITH_TURNING};
    for (size_t k = 0; k < sizeof never / sizeof *never; k++)
        if (never[k][0] == a && never[k][1] == b) return true;
    if (b < WITH_CELL || b > WITH_HELD) return false;
    for (size_t k = 0; k < sizeof no_cell / sizeof *no_cell; k++)
        if (no_cell[k] == a) return true;
    for (size_t k = 0; k < sizeof no_flow / sizeof *no_flow; k++)
        if (no_flow[k] == a) return b != WITH_CELL;
    for (size_t k = 0; k < sizeof not_held / sizeof *not_held; k++)
        if (not_held[k] == a) return b == WITH_HELD;
    return false;
}

static void count_pairs(uint64_t features) {
    for (int a = 0; a < WITH_COUNT; a++)
        for (int b = a; b < WITH_COUNT; b++)
            met[a][b] += (features >> a & 1) != 0 && (features >> b & 1) != 0;
}

/* A triangle: worlds with both. Returns the number of pairs that were never met. */
static int print_pairs(void) {
    int missing = 0;
    printf("\nworlds with both of two features (columns in the order of the rows):\n");
    for (int a = 0; a < WITH_COUNT; a++) {
        printf("%-12s", world_features[a]);
        for (int b = 0; b <= a; b++) {
            if (exclusive(b, a))
                printf("     -");
            else
                printf(" %5lld", (long long)met[b][a]);
            missing += met[b][a] == 0 && !exclusive(b, a);
        }
        printf("\n");
    }
    return missing;
}

/* The script of a world, in short. */
static void tell(uint64_t seed, int64_t index) {
    static const char *const events[EVENT_KINDS] = {
        "add",         "remove", "move",     "load",    "drive",     "add wall",   "set wall",
        "remove wall", "pair",   "gravity",  "damping", "time step", "refused",    "groups",
        "scale",       "shape",  "material", "rows",    "relax",     "drive wall", "deform"};
    static world_script s;
    world_make_script(seed, index, &s);
    printf("time step %g, %d steps, gravity %g, damping %g %g, skin %g, solver %d, faces %d%s\n",
           s.desc.time_step, s.steps, s.desc.gravity.y, s.desc.local_damping, s.desc.global_damping,
           s.desc.skin, (int)s.desc.solver, (int)s.desc.faces, s.law ? ", caller's law" : "");
    for (int i = 0; i < s.material_count; i++)
        printf("material %d: kn %g kt %g friction %g damping %g rolling %g\n", i,
               s.materials[i].normal_stiffness, s.materials[i].tangential_stiffness,
               s.materials[i].friction, s.materials[i].damping_ratio,
               s.materials[i].rolling_friction);
    for (int i = 0; i < s.shape_count; i++)
        printf("shape %d: %s of %d, size %g %g, rounding %g\n", i,
               world_features[WITH_KINDS + s.shapes[i].type], s.shapes[i].count,
               s.shapes[i].size[0], s.shapes[i].size[1], s.shapes[i].rounding);
    for (int i = 0; i < s.grain_count; i++) {
        const dem2d_particle_desc *g = &s.grains[i];
        printf("grain %d%s: shape %u material %u motion %d at %g %g angle %g scale %g, moves %g %g "
               "%g\n",
               i, i < s.grains_at_first ? "" : " (later)", g->shape.index, g->material.index,
               (int)g->motion, g->position.x, g->position.y, g->angle, g->scale, g->velocity.x,
               g->velocity.y, g->angular_velocity);
    }
    for (int j = 0; j < s.wall_count; j++) {
        const dem2d_wall_desc *w = &s.walls[j];
        printf("wall %d%s: %s mode %d material %u at %g %g, %g %g\n", j,
               j < s.walls_at_first ? "" : " (later)", w->segment ? "segment" : "half-plane",
               (int)w->mode, w->material.index, w->point.x, w->point.y,
               w->segment ? w->end.x : w->normal.x, w->segment ? w->end.y : w->normal.y);
        if (w->count > 0)
            printf("    chain of %d%s%s, turns by %g\n", w->count, w->closed ? ", closed" : "",
                   w->one_sided ? ", one-sided" : "", w->angular_velocity);
        if (w->surface_speed != 0) printf("    belt, %g\n", w->surface_speed);
    }
    printf("cell %g %g, %g, from %g\n", s.desc.cell.a.x, s.desc.cell.b.x, s.desc.cell.b.y,
           s.desc.cell.origin.x);
    for (int k = 0; k < s.event_count; k++)
        printf("step %d: %s %d (%d)\n", s.events[k].step, events[s.events[k].kind],
               s.events[k].which, s.events[k].other);
}

int main(int argc, char **argv) {
    const int64_t count = argc > 1 ? (int64_t)atof(argv[1]) : 100000;
    const uint64_t seed = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
    const int64_t only = argc > 3 ? strtoll(argv[3], NULL, 10) : -1;
    int64_t failed = 0, by_view[WORLD_VIEWS + 2] = {0};
    if (argc > 4 || count < 1) {
        fprintf(stderr, "usage: fuzz_worlds [COUNT [SEED [WORLD]]]\n");
        return 2;
    }
    if (only >= 0) tell(seed, only);
    for (int64_t i = only < 0 ? 0 : only; i < (only < 0 ? count : only + 1); i++) {
        char fault[FAULT_ROOM];
        uint64_t features;
        int view = 0;
        if (!world_check(seed, i, &features, fault)) {
            const size_t length = strcspn(fault, ":");
            while (view < WORLD_VIEWS && (strlen(world_views[view].name) != length ||
                                          strncmp(world_views[view].name, fault, length) != 0))
                view++; /* plain and pushed come last */
            failed++;
            if (++by_view[view] <= TOLD || only >= 0)
                printf("seed %llu world %lld: %s\n", (unsigned long long)seed, (long long)i, fault);
            fflush(stdout);
        }
        count_pairs(features);
    }
    for (int v = 0; v <= WORLD_VIEWS; v++)
        printf("%-10s %lld\n", v < WORLD_VIEWS ? world_views[v].name : "itself",
               (long long)by_view[v]);
    const int missing = only < 0 ? print_pairs() : 0;
    printf("fuzz-worlds: %lld of %lld worlds fail, %d pairs of features are missing\n",
           (long long)failed, (long long)(only < 0 ? count : 1), missing);
    return failed > 0 || missing > 0;
}
