/* statistics.h - medians. */
#ifndef DEM2D_EXAMPLES_STATISTICS_H
#define DEM2D_EXAMPLES_STATISTICS_H

#include <math.h>
#include <stdlib.h>

static inline int compare_numbers(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The upper one of two in the middle. Sorts the values; NaN without any. */
static inline double median(double *values, int count) {
    if (count <= 0) return (double)NAN;
    qsort(values, (size_t)count, sizeof *values, compare_numbers);
    return values[count / 2];
}

#endif
