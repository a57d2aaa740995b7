/* svg.h - outlines in a picture, and how two of them differ. */
#ifndef DEM2D_EXAMPLES_SVG_H
#define DEM2D_EXAMPLES_SVG_H

#include "program.h"

/* From the input's coordinates to the picture's: y down there. */
typedef struct frame {
    double left, top, scale; // of the picture's upper left corner, px per unit
} frame;

static inline void svg_path(FILE *file, const frame *f, const dem2d_vec *points, int count) {
    for (int i = 0; i < count; i++)
        fprintf(file, "%c%.3f %.3f", i == 0 ? 'M' : 'L', (points[i].x - f->left) * f->scale,
                (f->top - points[i].y) * f->scale);
    fputs("Z", file);
}

/* The style that svg_difference asks for. */
static const char difference_style[] = ".grain { fill: #c8c8c8; stroke: #505050; }\n"
                                       ".difference { fill: #e03020; fill-rule: evenodd; }\n"
                                       ".fit { fill: none; stroke: #1050c0; }\n";

/* Grain grey, fit a blue line; filled by the even-odd rule, both paths together are the difference,
   red. Without a fit (count 0) the grain alone. */
static inline void svg_difference(FILE *file, const frame *f, const dem2d_vec *grain,
                                  int grain_count, const dem2d_vec *fit, int count) {
    fputs("<path class=\"grain\" d=\"", file);
    svg_path(file, f, grain, grain_count);
    fputs("\"/>\n", file);
    if (count == 0) return;
    fputs("<path class=\"difference\" d=\"", file);
    svg_path(file, f, grain, grain_count);
    svg_path(file, f, fit, count);
    fputs("\"/>\n<path class=\"fit\" d=\"", file);
    svg_path(file, f, fit, count);
    fputs("\"/>\n", file);
}

static inline void widen(dem2d_box *box, dem2d_vec p) {
    box->lower.x = fmin(box->lower.x, p.x);
    box->lower.y = fmin(box->lower.y, p.y);
    box->upper.x = fmax(box->upper.x, p.x);
    box->upper.y = fmax(box->upper.y, p.y);
}

static inline dem2d_box empty_box(void) {
    const dem2d_box box = {{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}};
    return box;
}

#endif
