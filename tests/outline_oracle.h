/* outline_oracle.h - what two outlines have apart, by scan lines; outlines that must be refused.
   For the tests of outlines and fits; include it after testing.h. */
#ifndef OUTLINE_ORACLE_H
#define OUTLINE_ORACLE_H

#define MOST 4096 /* points of an outline */

/* The folder of real outlines that DATA names; NULL without one, and the test is skipped. */
PART const char *data_folder(void) {
    const char *folder = getenv("DATA");
    if (folder && *folder) return folder;
    print_message("DATA names no folder of outlines\n");
    skip();
    return NULL;
}

typedef struct crossing {
    double x;
    int of; /* outline 0 or 1 */
} crossing;

PART int by_x(const void *a, const void *b) {
    const double p = ((const crossing *)a)->x, q = ((const crossing *)b)->x;
    return (p > q) - (p < q);
}

PART int cross_line(const dem2d_vec *p, int n, int of, double y, crossing *out) {
    int count = 0;
    for (int i = 0; i < n; i++) {
        const dem2d_vec a = p[i], b = p[(i + 1) % n];
        if ((a.y <= y) == (b.y <= y)) continue;
        out[count++] = (crossing){a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x), of};
    }
    return count;
}

/* Area of the symmetric difference, and of the first outline: exact along each of so many lines. Of
   1000 the error of the midpoint rule is far below 1e-4. */
typedef struct scan_areas {
    double difference, first;
} scan_areas;

PART scan_areas scan_outlines(const dem2d_vec *p, int n, const dem2d_vec *q, int m, int lines) {
    static crossing line[2 * MOST];
    double low = HUGE_VAL, high = -HUGE_VAL;
    scan_areas sum = {0, 0};
    for (int i = 0; i < n + m; i++) {
        const double y = i < n ? p[i].y : q[i - n].y;
        low = fmin(low, y), high = fmax(high, y);
    }
    for (int i = 0; i < lines; i++) {
        const double y = low + (high - low) * (i + 0.5) / lines;
        int count = cross_line(p, n, 0, y, line);
        count += cross_line(q, m, 1, y, line + count);
        qsort(line, (size_t)count, sizeof line[0], by_x);
        bool in[2] = {false, false};
        for (int k = 0; k < count; k++) {
            const double length = k > 0 ? line[k].x - line[k - 1].x : 0;
            if (in[0] != in[1]) sum.difference += length;
            if (in[0]) sum.first += length;
            in[line[k].of] = !in[line[k].of];
        }
    }
    sum.difference *= (high - low) / lines, sum.first *= (high - low) / lines;
    return sum;
}

/* Points that no function takes. */
typedef struct bad_outline {
    dem2d_vec p[4];
    int count;
    dem2d_result result;
} bad_outline;

enum { BAD_OUTLINES = 6 };
static const bad_outline bad_outlines[BAD_OUTLINES] = {
    {{{0, 0}, {1, 0}, {NAN, 1}, {0, 1}}, 4, DEM2D_NOT_FINITE},
    {{{0, 0}, {1, 0}, {1, 1}, {0, -HUGE_VAL}}, 4, DEM2D_NOT_FINITE},
    {{{0, 0}, {1, 0}}, 2, DEM2D_TOO_FEW_POINTS},
    {{{0, 0}}, -1, DEM2D_TOO_FEW_POINTS},
    {{{0, 0}, {1, 2}, {3, 6}, {2, 4}}, 4, DEM2D_ZERO_AREA},
    {{{1, 2}, {1, 2}, {1, 2}, {1, 2}}, 4, DEM2D_ZERO_AREA},
};

#endif
