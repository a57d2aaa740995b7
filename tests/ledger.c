/* ledger [GROUPS] - closure of the ledger of energies in random scenes (ledger_scenes.h), by class
   of scene and by time step, as a table. A row is of GROUPS (10) groups of ten seeds: the median of
   each group's closures, of the turnover, has to be within the criterion, which falls with the
   square of the time step. Beside it the greatest of all, which has no criterion: grains may get
   squeezed or pass a joint. Exit status: 0, 1 if a row failed, 2 for bad usage. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"

#include "ledger_scenes.h"

enum { SEEDS = 10 };

/* The second argument: so many steps for a contact. Returns whether the row passes. */
static bool row(ledger_class kind, int steps, int groups) {
    const double scale = 32.0 / steps, most = ledger_most[kind] * scale * scale;
    double worst = 0, greatest = 0, sum = 0;
    for (int group = 0; group < groups; group++) {
        double closures[SEEDS];
        for (int k = 0; k < SEEDS; k++) {
            const dem2d_ledger l = ledger_scene_run(kind, SEEDS * group + k, steps, 200);
            closures[k] = fabs(l.closure) / l.turnover;
            greatest = fmax(greatest, closures[k]);
        }
        const double median = middle_of(closures, SEEDS);
        worst = fmax(worst, median);
        sum += median;
    }
    const bool pass = worst <= most;
    printf("%-16s t_c/%-5d %9.2e %12.2e %12.2e %12.2e   %s\n", ledger_names[kind], steps, most,
           worst, sum / groups, greatest, pass ? "pass" : "FAIL");
    fflush(stdout);
    return pass;
}

int main(int argc, char **argv) {
    const int groups = argc > 1 ? atoi(argv[1]) : 10;
    bool pass = true;
    if (argc > 2 || groups < 1) {
        fprintf(stderr, "usage: ledger [GROUPS]\n");
        return 2;
    }
    printf("|closure| of the turnover; medians of ten seeds, %d groups\n", groups);
    printf("%-16s %-9s %9s %12s %12s %12s\n", "scenes", "step", "allowed", "worst median", "mean",
           "greatest");
    for (int kind = 0; kind < LEDGER_CLASSES; kind++)
        for (int steps = 32; steps <= 128; steps *= 2)
            pass = row((ledger_class)kind, steps, groups) && pass;
    return !pass;
}
