/* near_pairs.h - all pairs of grains whose bounding circles overlap. */
#ifndef DEM2D_EXAMPLES_NEAR_PAIRS_H
#define DEM2D_EXAMPLES_NEAR_PAIRS_H

#include "program.h"

typedef struct near_pair {
    int a, b; // places in the list of grains, a < b
} near_pair;

typedef struct neighbours {
    dem2d_particle_info *grains; // in the order of their ids
    near_pair *pairs;            // in the order of b, then a
    int count;                   // of the pairs
} neighbours;

/* A grain's place and the left end of its bounding circle. */
typedef struct left_end {
    double x;
    int place;
} left_end;

static int compare_ends(const void *a, const void *b) {
    const left_end *p = a, *q = b;
    return p->x != q->x ? (p->x > q->x) - (p->x < q->x) : p->place - q->place;
}

static int compare_pairs(const void *a, const void *b) {
    const near_pair *p = a, *q = b;
    return p->b != q->b ? p->b - q->b : p->a - q->a;
}

static bool circles_overlap(const dem2d_particle_info *a, const dem2d_particle_info *b) {
    const double dx = b->pose.position.x - a->pose.position.x;
    const double dy = b->pose.position.y - a->pose.position.y, reach = a->radius + b->radius;
    return dx * dx + dy * dy < reach * reach;
}

/* A sweep along x: each grain meets those whose left end is before its right end. */
static neighbours find_neighbours(const dem2d_world *world, int particles) {
    neighbours n = {NULL, NULL, 0};
    int count;
    dem2d_particle_id *ids = get_memory(NULL, (size_t)particles, sizeof *ids);
    left_end *ends = get_memory(NULL, (size_t)particles, sizeof *ends);
    n.grains = get_memory(NULL, (size_t)particles, sizeof *n.grains);
    must(dem2d_world_particles(world, ids, particles, &count), "particles");
    for (int i = 0; i < count; i++) {
        must(dem2d_world_get_particle(world, ids[i], &n.grains[i]), "particle");
        ends[i].x = n.grains[i].pose.position.x - n.grains[i].radius;
        ends[i].place = i;
    }
    qsort(ends, (size_t)count, sizeof *ends, compare_ends);
    for (int i = 0; i < count; i++)
        for (int k = i + 1; k < count; k++) {
            const int p = ends[i].place, q = ends[k].place;
            if (ends[k].x > n.grains[p].pose.position.x + n.grains[p].radius) break;
            if (!circles_overlap(&n.grains[p], &n.grains[q])) continue;
            if ((n.count & (n.count - 1)) == 0) // at powers of 2: room for twice as many
                n.pairs = get_memory(n.pairs, 2 * (size_t)n.count + 1, sizeof *n.pairs);
            n.pairs[n.count].a = p < q ? p : q;
            n.pairs[n.count++].b = p < q ? q : p;
        }
    if (n.count > 0) qsort(n.pairs, (size_t)n.count, sizeof *n.pairs, compare_pairs);
    free(ids);
    free(ends);
    return n;
}

static void free_neighbours(neighbours *n) {
    free(n->grains);
    free(n->pairs);
}

#endif
