/* fuzz_bezier.c - contacts of polybeziers of every kind with shapes of all models and with walls.

       fuzz_bezier [COUNT [SEED [FIRST [FILE...]]]]

   COUNT pairs (1e6) of the series SEED (1), from number FIRST (0): the pair of one number is always
   the same. Each FILE is an outline (CSV, first line x,y) that some of the grains are fitted to.

   Every pair is asked for its contact, one of its shapes for its box and for the contact with a
   wall, and every grain that is made for its measures; all is judged against an oracle in long
   double (bezier_oracle.h). Prints the first failures of a kind with their number, and a table.
   Ends with status 1 if there was one. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "bezier_oracle.h"

static campaign all;

/* --- summary --------------------------------------------------------------------------------- */

static void print_row(const char *kind, const char *how, const row *r) {
    printf("%-16s%-9s%8lld%8lld%9lld%8lld%8lld%8lld%6lld%6lld |", kind, how,
           (long long)r->drawn, (long long)r->refused, (long long)r->pairs,
           (long long)r->states[DEM2D_SEPARATED], (long long)r->states[DEM2D_TOUCHING],
           (long long)r->states[DEM2D_PENETRATING], (long long)r->states[DEM2D_UNRESOLVED],
           (long long)r->unproved);
    for (int k = 0; k < CHECKS; k++) printf("%8lld", (long long)r->flaws[k]);
    printf("\n");
}

static void add_row(row *sum, const row *r) {
    sum->drawn += r->drawn, sum->refused += r->refused, sum->pairs += r->pairs;
    sum->unproved += r->unproved;
    for (int k = 0; k < 4; k++) sum->states[k] += r->states[k];
    for (int k = 0; k < CHECKS; k++) sum->flaws[k] += r->flaws[k];
}

static void print_summary(void) {
    row total = {0}, ways[WRITTEN] = {{0}};
    printf("%-16s%-9s%8s%8s%9s%8s%8s%8s%6s%6s |", "kind", "written", "drawn", "refused", "pairs",
           "apart", "touch", "overlap", "unres", "open");
    for (int k = 0; k < CHECKS; k++) printf("%8s", check_names[k]);
    printf("\n");
    for (int k = 0; k < CURVES; k++) {
        row sum = {0};
        for (int i = 0; i < WRITTEN; i++) {
            add_row(&sum, &all.rows[k][i]), add_row(&ways[i], &all.rows[k][i]);
            if (all.rows[k][i].drawn > 0)
                print_row(curve_names[k], written_names[i], &all.rows[k][i]);
        }
        add_row(&total, &sum);
    }
    for (int i = 0; i < WRITTEN; i++) print_row("all", written_names[i], &ways[i]);
    print_row("all", "", &total);
    printf("refused: at creation. unres: unresolved. open: the oracle's own proof ends above 1e-16 "
           "of the size. Right of the bar: failures.\n");
    for (const flaw_count *f = all.flaws; f < &all.flaws[FLAWS] && f->text != NULL; f++)
        printf("%9lld  %s, %s, with %s: %s (fuzz_bezier 1 %llu %llu)\n", (long long)f->count,
               curve_names[f->curve], written_names[f->written],
               f->partner < KINDS ? kind_names[f->partner] : "no other", f->text,
               (unsigned long long)all.series, (unsigned long long)f->number);
}

static uint64_t read_number(const char *text) {
    char *end;
    const double value = strtod(text, &end); /* 1e6 is a number, too */
    if (*text == 0 || *end != 0 || !(value >= 0 && value < 0x1p53)) {
        fprintf(stderr, "fuzz_bezier [COUNT [SEED [FIRST [FILE...]]]]: not a number: %s\n", text);
        exit(2);
    }
    return (uint64_t)value;
}

int main(int count, char **arguments) {
    const uint64_t runs = count > 1 ? read_number(arguments[1]) : 1000000;
    const uint64_t first = count > 3 ? read_number(arguments[3]) : 0;
    all.series = count > 2 ? read_number(arguments[2]) : 1;
    all.printed = 1;
    for (int i = 4; i < count; i++)
        if (!outline_read(arguments[i])) printf("no outline: %s\n", arguments[i]);
    campaign_run(&all, first, runs);
    print_summary();
    outlines_free();
    printf("fuzz_bezier: %llu pairs, %lld failures\n", (unsigned long long)runs,
           (long long)all.failures);
    return all.failures > 0;
}
