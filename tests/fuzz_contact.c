/* fuzz_contact.c - contacts of millions of pairs of shapes, all models, most of them degenerate.

       fuzz_contact [COUNT [SEED [FIRST]]]   COUNT pairs (1e7) of the series SEED (1), from number
                                             FIRST (0): the pair of one number is always the same

   Every pair: what an answer promises by itself, the depth where the construction of the pair
   knows it, and that a warm start agrees with a cold one. Some of them, from garbage and by GJK
   and EPA. One in a thousand: a search in long double, contact points on the surfaces, and the
   same bits when swapped, turned or scaled. Ends with status 1 after some failures, each printed
   with its number. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "contact_cases.h"

#ifndef FUZZ_PRINTED
#define FUZZ_PRINTED 2 /* of a kind */
#endif
#ifndef FUZZ_FAILURES
#define FUZZ_FAILURES 10
#endif
#ifndef FULLY
#define FULLY 1000 /* of so many pairs one is checked fully */
#endif
enum { BLOCK = 65536 }; /* pairs from one pool of models */

/* --- what is counted ------------------------------------------------------------------------- */

typedef struct row {
    int64_t pairs, states[4], proofs[DEM2D_PROOF_COUNT];
    int64_t flat[2];             /* unresolved: certified, GJK and EPA */
    int64_t cold, warm, warm_of; /* support calls, of so many */
    double worst;                /* distance to the truth, in eps of the size */
} row;

static row rows[KINDS][KINDS];
static pool all;
static uint64_t series, number;
static int failures;

/* Failures are counted by what is wrong, who was asked and what proves the answer. */
enum { FLAWS = 256 };
static struct {
    const char *text, *asked;
    int proof;
    int64_t count;
} flaws[FLAWS];

static int64_t count_flaw(const char *text, const char *asked, int proof) {
    int i = 0;
    while (i < FLAWS - 1 && flaws[i].text != NULL &&
           (strcmp(flaws[i].text, text) != 0 || strcmp(flaws[i].asked, asked) != 0 ||
            flaws[i].proof != proof))
        i++;
    flaws[i].text = text, flaws[i].asked = asked, flaws[i].proof = proof;
    return ++flaws[i].count;
}

/* Prints the first few of a kind, so that it can be done again. */
static void fail_if(const char *flaw, const scene *s, const char *asked, const dem2d_contact *c) {
    if (flaw == NULL) return;
    failures++;
    if (count_flaw(flaw, asked, (int)c->proof) > FUZZ_PRINTED) return;
    fprintf(stderr, "\nFAIL  %s: %s\n      fuzz_contact 1 %llu %llu\n", asked, flaw,
            (unsigned long long)series, (unsigned long long)number);
    print_scene(s);
    print_answer(asked, c, &s->p);
}
#define FAIL_IF(wrong, s, asked, c) fail_if((wrong) ? #wrong : NULL, (s), (asked), (c))

/* --- asking ---------------------------------------------------------------------------------- */

static dem2d_contact ask(const pair *p, dem2d_solver solver, dem2d_vec start) {
    dem2d_contact_desc desc = {0};
    dem2d_contact c;
    desc.solver = solver, desc.start = start;
    if (dem2d_pair_contact(p->a->shape, p->pose_a, p->b->shape, p->pose_b, &desc, &c) != DEM2D_OK)
        case_broken("a pair was refused");
    return c;
}

/* Support value by the library itself: cheaper than in long double. */
static double quick_value(const pair *p, dem2d_vec u) {
    const dem2d_vec back = {-u.x, -u.y};
    dem2d_support a, b;
    if (dem2d_shape_support(p->a->shape, p->pose_a, u, &a) != DEM2D_OK ||
        dem2d_shape_support(p->b->shape, p->pose_b, back, &b) != DEM2D_OK)
        case_broken("a support was refused");
    const double dx = p->pose_b.position.x - p->pose_a.position.x;
    const double dy = p->pose_b.position.y - p->pose_a.position.y;
    return a.value + b.value - dx * u.x - dy * u.y;
}

/* What costs no search. */
static void check_quickly(const scene *s, const char *asked, dem2d_solver solver,
                          const dem2d_contact *c, dem2d_vec u) {
    const pair *p = &s->p;
    const double slack = depth_slack(p), room = c->error + 2 * slack;
    const char *flaw = answer_flaw(p, c, CASE_TOLERANCE, solver);
    fail_if(flaw, s, asked, c);
    if (flaw != NULL && !(c->normal.x != 0 || c->normal.y != 0)) return; /* no direction */
    fail_if(normal_flaw(p, c, quick_value(p, c->normal), CASE_TOLERANCE, 2 * slack), s, asked, c);
    FAIL_IF(!(quick_value(p, u) >= c->depth - room), s, asked, c);
    if (s->known) fail_if(depth_flaw(c, s->chosen, s->chosen, slack + s->places), s, asked, c);
    if (s->bounded) FAIL_IF(!(c->depth - room - s->places <= s->chosen), s, asked, c);
}

/* Two answers for one pair. */
static void check_agreement(const scene *s, const char *asked, const dem2d_contact *c,
                            const dem2d_contact *other) {
    const double room = c->error + other->error + 2 * depth_slack(&s->p);
    FAIL_IF(!(fabs(c->depth - other->depth) <= room), s, asked, other);
    if (c->state == other->state || c->state == DEM2D_UNRESOLVED ||
        other->state == DEM2D_UNRESOLVED)
        return;
    FAIL_IF(!(fabs(c->depth) <= room + 2 * depth_slack(&s->p)), s, asked, other);
}

/* Unresolved, at a cap of 128 iterations, is an answer only where h is so flat, or has so many
   least directions, that a third of them is needed by one who knows the depth already. */
static void check_flat(const scene *s, const char *asked, const dem2d_contact *c) {
    const truth t = find_truth(&s->p);
    const int halvings = proof_halvings(&s->p, &t, CASE_TOLERANCE * pair_size(&s->p));
    FAIL_IF(halvings < 128 / 3, s, asked, c);
}

/* The same bits for the pair doubled, turned by a quarter, and swapped. */
static void check_bits(const scene *s, const truth *t, const dem2d_contact *c, dem2d_vec start) {
    const dem2d_vec turned = {-start.y, start.x}, back = {-start.x, -start.y};
    if (too_near(&s->p)) return;
    scene q = scene_scaled(s, 1);
    const dem2d_contact twice = ask(&q.p, DEM2D_CERTIFIED, start);
    FAIL_IF(twice.depth != 2 * c->depth || twice.normal.x != c->normal.x ||
                twice.normal.y != c->normal.y || twice.count != c->count,
            &q, "doubled", &twice);
    if (!has_line(&s->p)) return;
    q = *s;
    dem2d_pose *poses[2] = {&q.p.pose_a, &q.p.pose_b};
    for (int i = 0; i < 2; i++) {
        const dem2d_pose old = *poses[i];
        poses[i]->position = (dem2d_vec){-old.position.y, old.position.x};
        poses[i]->rotation = (dem2d_rot){-old.rotation.s, old.rotation.c};
    }
    const dem2d_contact r = ask(&q.p, DEM2D_CERTIFIED, turned);
    FAIL_IF(r.depth != c->depth || r.normal.x != -c->normal.y || r.normal.y != c->normal.x, &q,
            "turned", &r);
    if (!truth_unique(&s->p, t)) return;
    q = *s;
    q.p = (pair){s->p.b, s->p.a, s->p.pose_b, s->p.pose_a};
    const dem2d_contact w = ask(&q.p, DEM2D_CERTIFIED, back);
    fail_if(swap_flaw(&s->p, c, &w), &q, "swapped", &w);
}

/* Against a search in long double. */
static void check_truth(const scene *s, const truth *t, const char *asked, const dem2d_contact *c) {
    const double slack = depth_slack(&s->p);
    const real value = pair_value(&s->p, spot_unit(spot_from(c->normal)));
    fail_if(depth_flaw(c, t->lower, t->depth, slack), s, asked, c);
    fail_if(normal_flaw(&s->p, c, value, CASE_TOLERANCE, slack), s, asked, c);
    fail_if(surface_flaw(&s->p, c, CASE_TOLERANCE), s, asked, c);
}

static void check_fully(const scene *s, const dem2d_contact *c, row *r) {
    const truth t = find_truth(&s->p);
    const double size = pair_size(&s->p);
    const real proof = t.depth - t.lower;
    if (s->known)
        FAIL_IF(!(fabsl(t.depth - s->chosen) <= s->places + 1e-16L * size + proof), s, "oracle", c);
    check_truth(s, &t, "cold", c);
    if (c->state != DEM2D_UNRESOLVED)
        r->worst = fmax(r->worst, (double)fabsl(c->depth - t.depth) / (DBL_EPSILON * size));
    const dem2d_vec start = spot_rounded(spot_turned(t.u, 1e-3L));
    const dem2d_contact warm = ask(&s->p, DEM2D_CERTIFIED, start);
    check_truth(s, &t, "warm", &warm);
    check_bits(s, &t, &warm, start);
}

/* --- one pair -------------------------------------------------------------------------------- */

static scene draw_scene(int *kind_a, int *kind_b, uint64_t *d) {
    *kind_a = (int)(number % KINDS), *kind_b = (int)(number / KINDS % KINDS);
    const model *a = &all.models[*kind_a][random_below(d, VARIANTS)];
    const model *b = &all.models[*kind_b][random_below(d, VARIANTS)];
    scene s = scene_draw(a, b, random_below(d, WAYS), d);
    if (random_below(d, 4) == 0) s = scene_scaled(&s, random_below(d, 401) - 200);
    return s;
}

/* Turned by a rounding, a step or a lot. */
static dem2d_vec stale(dem2d_vec n, uint64_t *d) {
    static const double angles[] = {0, 1e-6, -1e-4, 1e-3, -1e-2};
    const double t = angles[random_below(d, 5)];
    return (dem2d_vec){n.x - t * n.y, n.y + t * n.x};
}

static void try_pair(void) {
    uint64_t d = series * 0x9e3779b97f4a7c15u ^ number * 0xd1342543de82ef95u;
    int kind_a, kind_b;
    const scene s = draw_scene(&kind_a, &kind_b, &d);
    const dem2d_vec none = {0, 0}, u = spot_rounded(random_direction(&d));
    const dem2d_contact cold = ask(&s.p, DEM2D_CERTIFIED, none);
    const dem2d_contact warm = ask(&s.p, DEM2D_CERTIFIED, stale(cold.normal, &d));
    row *r = &rows[kind_a][kind_b];
    r->pairs++, r->states[cold.state & 3]++, r->proofs[cold.proof % DEM2D_PROOF_COUNT]++;
    r->cold += cold.support_calls;
    r->warm += warm.support_calls;
    check_quickly(&s, "cold", DEM2D_CERTIFIED, &cold, u);
    check_quickly(&s, "warm", DEM2D_CERTIFIED, &warm, u);
    check_agreement(&s, "warm", &cold, &warm);
    if (random_below(&d, 8) == 0) {
        const dem2d_contact c =
            ask(&s.p, DEM2D_CERTIFIED, garbage_starts[random_below(&d, GARBAGE)]);
        check_quickly(&s, "garbage start", DEM2D_CERTIFIED, &c, u);
        check_agreement(&s, "garbage start", &cold, &c);
    }
    if (random_below(&d, 8) == 0) {
        const dem2d_contact c = ask(&s.p, DEM2D_GJK_EPA, none);
        check_quickly(&s, "GJK and EPA", DEM2D_GJK_EPA, &c, u);
        check_agreement(&s, "GJK and EPA", &cold, &c);
        if (c.state == DEM2D_UNRESOLVED) r->flat[1]++, check_flat(&s, "GJK and EPA", &c);
    }
    if (cold.state == DEM2D_UNRESOLVED) r->flat[0]++, check_flat(&s, "cold", &cold);
    if (number % FULLY == 0) check_fully(&s, &cold, r);
}

/* --- summary --------------------------------------------------------------------------------- */

static void print_row(const char *a, const char *b, const row *r) {
    const double n = r->pairs > 0 ? (double)r->pairs : 1;
    printf("%-8s%-8s%9lld%9lld%9lld%9lld%6lld%6lld |%9lld%9lld%9lld%9lld |%6.2f%6.2f%10.3g\n", a, b,
           (long long)r->pairs, (long long)r->states[0], (long long)r->states[1],
           (long long)r->states[2], (long long)r->flat[0], (long long)r->flat[1],
           (long long)r->proofs[1], (long long)r->proofs[2], (long long)r->proofs[3],
           (long long)r->proofs[4], (double)r->cold / n, (double)r->warm / n, r->worst);
}

static void print_summary(void) {
    row sum = {0};
    printf("%-8s%-8s%9s%9s%9s%9s%6s%6s |%9s%9s%9s%9s |%6s%6s%10s\n", "A", "B", "pairs", "apart",
           "touch", "overlap", "flat", "EPA's", "form", "radius", "arc", "polytope", "cold", "warm",
           "worst");
    for (int i = 0; i < KINDS * KINDS; i++) {
        const row *r = &rows[i / KINDS][i % KINDS];
        sum.pairs += r->pairs, sum.cold += r->cold, sum.warm += r->warm;
        sum.worst = fmax(sum.worst, r->worst);
        for (int k = 0; k < 4; k++) sum.states[k] += r->states[k];
        for (int k = 0; k < 2; k++) sum.flat[k] += r->flat[k];
        for (int k = 0; k < DEM2D_PROOF_COUNT; k++) sum.proofs[k] += r->proofs[k];
        if (r->pairs > 0) print_row(kind_names[i / KINDS], kind_names[i % KINDS], r);
    }
    print_row("all", "", &sum);
    printf(
        "flat: not resolved, h hardly bends; EPA's are of every eighth pair. cold, warm: support "
        "calls.\nworst: distance to the truth in eps of R_A + R_B + |d|, of every 1000th "
        "pair.\n");
    for (int i = 0; i < FLAWS && flaws[i].text != NULL; i++)
        printf("%9lld  %s, by %s: %s\n", (long long)flaws[i].count, flaws[i].asked,
               proof_names[flaws[i].proof % DEM2D_PROOF_COUNT], flaws[i].text);
}

static uint64_t read_number(const char *text) {
    char *end;
    const double value = strtod(text, &end); /* 1e7 is a number, too */
    if (*text == 0 || *end != 0 || !(value >= 0 && value < 0x1p53)) {
        fprintf(stderr, "fuzz_contact [COUNT [SEED [FIRST]]]: not a number: %s\n", text);
        exit(2);
    }
    return (uint64_t)value;
}

int main(int count, char **arguments) {
    const uint64_t runs = count > 1 ? read_number(arguments[1]) : 10000000;
    const uint64_t first = count > 3 ? read_number(arguments[3]) : 0;
    uint64_t done = 0, block = 0;
    series = count > 2 ? read_number(arguments[2]) : 1;
    for (; done < runs && failures < FUZZ_FAILURES; done++) {
        number = first + done;
        if (done == 0 || number / BLOCK != block) {
            if (done > 0) pool_destroy(&all);
            block = number / BLOCK;
            pool_draw(&all, series * 1000003 + block);
        }
        try_pair();
    }
    if (done > 0) pool_destroy(&all);
    print_summary();
    printf("fuzz_contact: %llu pairs, %d failures\n", (unsigned long long)done, failures);
    return failures > 0;
}
