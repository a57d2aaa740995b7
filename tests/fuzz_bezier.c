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

#ifndef FUZZ_PRINTED
#define FUZZ_PRINTED 1 /* of a flaw and a kind of curve */
#endif
enum { BLOCK = 8192, GRAINS = 12, PARTNERS = 12 }; /* pairs from one pool; of each kind in it */

/* Partners: the models of contact_cases.h up to Fourier series; BEZIER is a grain. */
enum { PARTNER_KINDS = FOURIER + 1 };

/* --- what is counted ------------------------------------------------------------------------- */

enum { CREATION, MEASURES, BOUND, STATE, NORMAL, OUTLINE, PLACE, UNRESOLVED, BOX, WALL, CHECKS };
static const char *const check_names[CHECKS] = {"made",    "mass",  "bound",  "state", "normal",
                                                "outline", "place", "gaveup", "box",   "wall"};

typedef struct row {
    int64_t drawn, refused, pairs, states[4], unproved, flaws[CHECKS];
} row;

static row rows[CURVES][WRITTEN];
static grain grains[CURVES][GRAINS];
static model partners[PARTNER_KINDS][PARTNERS];
static uint64_t series, number;
static int64_t failures;

enum { FLAWS = 512 };
static struct {
    const char *text;
    int curve, written, partner;
    int64_t count;
    uint64_t number;
} flaws[FLAWS];

/* Counts a flaw; true for the first few of a kind, which are printed. */
static bool count_flaw(const grain *g, int check, int partner, const char *text) {
    int i = 0;
    failures++;
    rows[g->curve][g->written].flaws[check]++;
    while (i < FLAWS - 1 && flaws[i].text != NULL &&
           (strcmp(flaws[i].text, text) != 0 || flaws[i].curve != g->curve ||
            flaws[i].written != g->written || flaws[i].partner != partner))
        i++;
    if (flaws[i].text == NULL) flaws[i].number = number;
    flaws[i].text = text, flaws[i].curve = g->curve, flaws[i].written = g->written;
    flaws[i].partner = partner;
    return ++flaws[i].count <= FUZZ_PRINTED;
}

static void print_message(void *user, dem2d_result result, int index, const char *text) {
    (void)user;
    fprintf(stderr, "      %s (%d): %s\n", dem2d_result_text(result), index, text);
}

static void print_grain(const grain *g, const char *text) {
    const dem2d_pose none = {{0, 0}, {1, 0}, 1};
    const dem2d_env env = {NULL, NULL, NULL, print_message};
    dem2d_shape *shape;
    fprintf(stderr, "\nFAIL  %s: %s, written as %s: %s (%s; kink %.3Lg)\n",
            g->m.shape == NULL ? "creation" : "measures", curve_names[g->curve],
            written_names[g->written], text, dem2d_result_text(g->result), g->kink);
    fprintf(stderr, "      fuzz_bezier 1 %llu %llu\n", (unsigned long long)series,
            (unsigned long long)number);
    print_model("grain", &g->m, &none);
    if (dem2d_shape_create_bezier(&env, g->m.points, g->m.count / 3, &shape) == DEM2D_OK)
        dem2d_shape_destroy(shape);
}

/* --- grains and partners --------------------------------------------------------------------- */

/* Draws until one is accepted. */
static void pool_grain(grain *g, int kind, uint64_t seed) {
    for (int i = 0; i < 20; i++) {
        grain_draw(g, kind, seed + (uint64_t)i * 0x632be59bd9b4e019u);
        row *r = &rows[g->curve][g->written];
        r->drawn++, r->refused += g->m.shape == NULL;
        const char *flaw = creation_flaw(g);
        if (flaw != NULL && count_flaw(g, CREATION, KINDS, flaw)) print_grain(g, flaw);
        if (g->m.shape == NULL) continue;
        flaw = measures_flaw(g);
        if (flaw != NULL && count_flaw(g, MEASURES, KINDS, flaw)) print_grain(g, flaw);
        return;
    }
}

static void pool_fill(uint64_t block) {
    dice d = {series * 0x9e3779b97f4a7c15u ^ block * 0xbf58476d1ce4e5b9u};
    for (int k = 0; k < CURVES; k++)
        for (int i = 0; i < GRAINS; i++) pool_grain(&grains[k][i], k, dice_next(&d));
    for (int k = 0; k < PARTNER_KINDS; k++)
        for (int i = 0; i < PARTNERS && k != BEZIER; i++) model_draw(&partners[k][i], k, &d);
}

static void pool_empty(void) {
    for (int k = 0; k < CURVES; k++)
        for (int i = 0; i < GRAINS; i++) dem2d_shape_destroy(grains[k][i].m.shape);
    for (int k = 0; k < PARTNER_KINDS; k++)
        for (int i = 0; i < PARTNERS && k != BEZIER; i++) dem2d_shape_destroy(partners[k][i].shape);
}

/* --- one pair -------------------------------------------------------------------------------- */

static void report(const grain *g, int check, const pair *p, const dem2d_contact *c,
                   const char *flaw) {
    if (flaw == NULL) return;
    if (!count_flaw(g, check, p->b == NULL ? KINDS : p->b == &g->m ? p->a->kind : p->b->kind, flaw))
        return;
    fprintf(stderr, "\nFAIL  %s: %s, written as %s: %s\n", check_names[check],
            curve_names[g->curve], written_names[g->written], flaw);
    fprintf(stderr, "      fuzz_bezier 1 %llu %llu\n", (unsigned long long)series,
            (unsigned long long)number);
    print_model("A", p->a, &p->pose_a);
    if (p->b != NULL) print_model("B", p->b, &p->pose_b);
    const truth t = find_truth(p);
    fprintf(stderr,
            "size %.17g; true depth %.21Lg (proved above %.21Lg), normal {%.21Lg, %.21Lg}\n",
            pair_size(p), t.depth, t.lower, t.u.x, t.u.y);
    if (c == NULL) return;
    print_answer("answer", c, p);
    fprintf(stderr, "    of the size: point_a below A's outline by %.3Lg",
            depth_in(p->a, &p->pose_a, c->point_a.x, c->point_a.y) / pair_size(p));
    if (p->b != NULL)
        fprintf(stderr, ", point_b below B's by %.3Lg",
                depth_in(p->b, &p->pose_b, c->point_b.x, c->point_b.y) / pair_size(p));
    fprintf(stderr, "\n");
}

/* How the pair is asked for: tolerance and first direction. */
static dem2d_contact_desc draw_desc(dice *d) {
    static const double tolerances[] = {0, 0, 0, 1e-8, 1e-12, 1e-14};
    dem2d_contact_desc desc = {0};
    desc.tolerance = tolerances[dice_below(d, 6)];
    if (dice_below(d, 4) == 0) desc.start = spot_rounded(dice_direction(d));
    return desc;
}

static void check_contact(const grain *g, const pair *p, real kink,
                          const dem2d_contact_desc *desc) {
    dem2d_contact c;
    if (dem2d_pair_contact(p->a->shape, p->pose_a, p->b->shape, p->pose_b, desc, &c) != DEM2D_OK)
        case_broken("a pair was refused");
    const double tolerance = desc->tolerance > 0 ? desc->tolerance : CASE_TOLERANCE;
    const truth t = find_truth(p);
    row *r = &rows[g->curve][g->written];
    r->pairs++, r->states[c.state & 3]++;
    r->unproved += !(t.depth - t.lower <= 1e-16L * pair_size(p));
    report(g, BOUND, p, &c, bound_flaw(p, &c, &t, tolerance, kink));
    report(g, STATE, p, &c, state_flaw(p, &c, &t));
    report(g, UNRESOLVED, p, &c, unresolved_flaw(p, &c, &t, tolerance));
    report(g, OUTLINE, p, &c, outline_flaw(p, &c));
    if (c.state == DEM2D_UNRESOLVED) return;
    const real value = pair_value(p, spot_unit(spot_from(c.normal)));
    report(g, NORMAL, p, &c, normal_flaw(p, &c, value, tolerance, depth_slack(p)));
    report(g, PLACE, p, &c, place_flaw(p, &c, tolerance));
}

static void check_wall(const grain *g, const pair *p, dice *d) {
    const wall w = wall_draw(p, d);
    const pair half = {p->a, NULL, p->pose_a, {w.point, {1, 0}, 1}};
    dem2d_contact c;
    report(g, BOX, &half, NULL, box_flaw(p));
    if (dem2d_wall_contact(p->a->shape, p->pose_a, w.point, w.normal, &c) != DEM2D_OK)
        case_broken("a wall was refused");
    report(g, WALL, &half, &c, wall_flaw(p, &w, &c));
}

static void try_pair(void) {
    dice d = {series * 0x9e3779b97f4a7c15u ^ number * 0xd1342543de82ef95u};
    const int kind_a = (int)(number % CURVES), kind = (int)(number / CURVES % PARTNER_KINDS);
    const grain *g = &grains[kind_a][dice_below(&d, GRAINS)];
    const grain *other = &grains[dice_below(&d, CURVES)][dice_below(&d, GRAINS)];
    const model *b = kind == BEZIER ? &other->m : &partners[kind][dice_below(&d, PARTNERS)];
    const double size_b = kind == BEZIER ? other->size : 1;
    const dem2d_contact_desc desc = draw_desc(&d);
    if (g->m.shape == NULL || b->shape == NULL) return;
    pair p = pair_draw(&g->m, g->size, b, size_b, &d);
    check_wall(g, &p, &d);
    if (dice_below(&d, 2)) p = (pair){p.b, p.a, p.pose_b, p.pose_a};
    check_contact(g, &p, fmaxl(g->kink, kind == BEZIER ? other->kink : 0), &desc);
}

/* --- summary --------------------------------------------------------------------------------- */

static void print_row(const char *kind, const char *how, const row *r) {
    printf("%-16s%-9s%8lld%8lld%9lld%8lld%8lld%8lld%6lld%6lld |", kind, how, (long long)r->drawn,
           (long long)r->refused, (long long)r->pairs, (long long)r->states[DEM2D_SEPARATED],
           (long long)r->states[DEM2D_TOUCHING], (long long)r->states[DEM2D_PENETRATING],
           (long long)r->states[DEM2D_UNRESOLVED], (long long)r->unproved);
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
    row all = {0}, ways[WRITTEN] = {{0}};
    printf("%-16s%-9s%8s%8s%9s%8s%8s%8s%6s%6s |", "kind", "written", "drawn", "refused", "pairs",
           "apart", "touch", "overlap", "unres", "open");
    for (int k = 0; k < CHECKS; k++) printf("%8s", check_names[k]);
    printf("\n");
    for (int k = 0; k < CURVES; k++) {
        row sum = {0};
        for (int i = 0; i < WRITTEN; i++) {
            add_row(&sum, &rows[k][i]), add_row(&ways[i], &rows[k][i]);
            if (rows[k][i].drawn > 0) print_row(curve_names[k], written_names[i], &rows[k][i]);
        }
        add_row(&all, &sum);
    }
    for (int i = 0; i < WRITTEN; i++) print_row("all", written_names[i], &ways[i]);
    print_row("all", "", &all);
    printf("refused: at creation. unres: unresolved. open: the oracle's own proof ends above 1e-16 "
           "of the size. Right of the bar: failures.\n");
    for (int i = 0; i < FLAWS && flaws[i].text != NULL; i++)
        printf("%9lld  %s, %s, with %s: %s (fuzz_bezier 1 %llu %llu)\n", (long long)flaws[i].count,
               curve_names[flaws[i].curve], written_names[flaws[i].written],
               flaws[i].partner < KINDS ? kind_names[flaws[i].partner] : "no other", flaws[i].text,
               (unsigned long long)series, (unsigned long long)flaws[i].number);
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
    uint64_t done = 0, block = 0;
    series = count > 2 ? read_number(arguments[2]) : 1;
    for (int i = 4; i < count; i++)
        if (!outline_read(arguments[i])) printf("no outline: %s\n", arguments[i]);
    for (; done < runs; done++) {
        number = first + done;
        if (done == 0 || number / BLOCK != block) {
            if (done > 0) pool_empty();
            block = number / BLOCK;
            pool_fill(block);
        }
        try_pair();
    }
    if (done > 0) pool_empty();
    print_summary();
    outlines_free();
    printf("fuzz_bezier: %llu pairs, %lld failures\n", (unsigned long long)done,
           (long long)failures);
    return failures > 0;
}
