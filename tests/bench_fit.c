/* bench_fit [DIR] - error and time of every model and method of dem2d_outline_fit.

   Outlines are all *.csv files below DIR whose first line is `x,y`; without DIR some are made
   here. Where a file core12.txt below DIR lists names of some of them, they get a table of their
   own. For each fit: mean and least coverage, and the time per grain (the median of up to three
   runs of each). Writes build/fit.csv, build/fit.gp and, where gnuplot is installed, build/fit.png:
   error against time. Exit status: 0, 1 if a fit failed, 2 for bad usage or input. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#define BENCH_NAME "bench_fit"
#include "bench_outlines.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#define MADE 12 /* outlines, when none are given */

/* --- fits ----------------------------------------------------------------------------------- */

typedef struct method {
    const char *name;
    dem2d_fit_desc desc; /* without the count */
    bool radial;         /* dem2d_radial_compare instead */
    int counts[5];       /* orders, arcs, vertices; ends with -1 */
} method;

#define ORDERS \
    { 4, 8, 16, -1 }
#define FS(how) .model = DEM2D_FOURIER, .method = DEM2D_FIT_##how

static const method methods[] = {
    {"circle", {.model = DEM2D_CIRCLE}, false, {0, -1}},
    {"ellipse", {.model = DEM2D_ELLIPSE}, false, {0, -1}},
    {"polygon", {.model = DEM2D_POLYGON}, false, {4, 6, 8, 12, -1}},
    {"bezier area", {.model = DEM2D_BEZIER, .method = DEM2D_FIT_AREA}, false, {10, -1}},
    {"bezier swarm", {.model = DEM2D_BEZIER, .method = DEM2D_FIT_SWARM}, false, {10, -1}},
    {"fs reduction", {FS(REDUCTION)}, false, ORDERS},
    {"fs reduction-exact", {FS(REDUCTION_EXACT)}, false, ORDERS},
    {"fs fejer", {FS(FEJER)}, false, ORDERS},
    {"fs constrained hull", {FS(CONSTRAINED)}, false, ORDERS},
    {"fs constrained grain", {FS(CONSTRAINED), .scale = DEM2D_SCALE_GRAIN}, false, ORDERS},
    {"fs constrained none", {FS(CONSTRAINED), .scale = DEM2D_SCALE_NONE}, false, ORDERS},
    {"fs constrained corners", {FS(CONSTRAINED), .corners = true}, false, ORDERS},
    {"radial series", {0}, true, ORDERS},
};

/* --- outlines ------------------------------------------------------------------------------- */

/* How many of the grains are named in core12.txt. */
static int mark_core(outlines *all) {
    char name[256];
    int marked = 0;
    FILE *file = all->core[0] ? fopen(all->core, "r") : NULL;
    if (!file) return 0;
    while (fscanf(file, "%255s", name) == 1) {
        const size_t length = strlen(name);
        if (length > 4 && strcmp(name + length - 4, ".csv") == 0) name[length - 4] = 0;
        for (int i = 0; i < all->count; i++) {
            if (all->list[i].core || strcmp(all->list[i].name, name)) continue;
            all->list[i].core = true, marked++;
        }
    }
    fclose(file);
    return marked;
}

/* Angular grains with worn corners and a rough face: about one polygon's distance, waves on it. */
static void make_grains(outlines *all) {
    for (int i = 0; i < MADE; i++) {
        const int count = 600, sides = 4 + i % 4;
        dem2d_vec *points = need(malloc((size_t)count * sizeof *points));
        double normal[8], reach[8], size[24], phase[24];
        char name[32];
        for (int k = 0; k < sides; k++)
            normal[k] = 6.28319 * (k + uniform(-0.3, 0.3)) / sides, reach[k] = uniform(0.7, 1.1);
        for (int n = 8; n < 24; n++) size[n] = uniform(0, 0.05 / n), phase[n] = uniform(0, 6.3);
        for (int j = 0; j < count; j++) {
            const double t = 6.283185307179586 * j / count;
            double power = 0; /* a smooth minimum of the distances of the sides */
            for (int k = 0; k < sides; k++)
                power += pow(fmax(cos(t - normal[k]), 0) / reach[k], 12);
            double r = pow(power, -1.0 / 12);
            for (int n = 8; n < 24; n++) r += size[n] * cos(n * t - phase[n]);
            points[j].x = 1.3 * r * cos(t), points[j].y = r * sin(t);
        }
        snprintf(name, sizeof name, "made_%02d", i);
        list_outline(all, name, strlen(name), points, count);
    }
}

/* --- measuring ------------------------------------------------------------------------------ */

/* One fit; its time, and its coverage. */
static dem2d_result run_once(const outline *g, const method *m, int count, double *coverage,
                             double *spent) {
    dem2d_fit_desc desc = m->desc;
    dem2d_fit_report report = {0};
    dem2d_difference difference = {0};
    dem2d_shape *shape = NULL;
    desc.count = count, desc.seed = 1;
    const double start = seconds();
    const dem2d_result result =
        m->radial ? dem2d_radial_compare(NULL, g->points, g->count, count, &difference)
                  : dem2d_outline_fit(NULL, g->points, g->count, &desc, &shape, &report);
    *spent = seconds() - start;
    *coverage = m->radial ? difference.coverage : report.coverage;
    dem2d_shape_destroy(shape);
    return result;
}

typedef struct figures {
    int grains, failed;
    double sum, least, seconds;
} figures;

static void add_figures(figures *f, double coverage, double seconds) {
    f->least = f->grains ? fmin(f->least, coverage) : coverage;
    f->grains++, f->sum += coverage, f->seconds += seconds;
}

/* A fit to every grain: figures of all, and of those in the core. */
static void measure(const outlines *all, const method *m, int count, figures of[2]) {
    of[0] = of[1] = (figures){0};
    for (int i = 0; i < all->count; i++) {
        const outline *g = &all->list[i];
        double coverage = 0, t[3], spent = 0;
        int runs = 0;
        dem2d_result result = DEM2D_OK;
        while (!result && runs < 3 && spent < 0.05) /* what is slow needs no second run */
            result = run_once(g, m, count, &coverage, &t[runs]), spent += t[runs++];
        if (result) {
            printf("FAILED: %s %d on %s: %s\n", m->name, count, g->name, dem2d_result_text(result));
            of[0].failed++;
            continue;
        }
        const double median =
            runs < 3 ? spent / runs : fmax(fmin(t[0], t[1]), fmin(fmax(t[0], t[1]), t[2]));
        add_figures(&of[0], coverage, median);
        if (g->core) add_figures(&of[1], coverage, median);
    }
}

/* --- output --------------------------------------------------------------------------------- */

static figures table[COUNT_OF(methods)][5][2];

static void print_table(int which, const char *title, FILE *csv) {
    printf("\n%s\n%-24s %5s %9s %9s %11s\n", title, "fit", "count", "mean", "least", "ms / grain");
    for (int m = 0; m < COUNT_OF(methods); m++) {
        for (int k = 0; methods[m].counts[k] >= 0; k++) {
            const figures f = table[m][k][which];
            const int count = methods[m].counts[k];
            if (f.grains == 0) continue;
            const double mean = f.sum / f.grains, ms = 1e3 * f.seconds / f.grains;
            printf("%-24s %5d %9.4f %9.4f %11.4f\n", methods[m].name, count, mean, f.least, ms);
            fprintf(csv, "%s,%s,%d,%d,%.9g,%.9g,%.6g\n", which ? "core12" : "all", methods[m].name,
                    count, f.grains, mean, f.least, ms);
        }
    }
}

/* One line per method, each of its points labelled with the count. */
static void write_picture(int which, const char *title) {
    FILE *file = create("build/fit.gp");
    fprintf(file, "if (strstrt(GPVAL_TERMINALS, 'pngcairo')) {\n"
                  "    set terminal pngcairo size 1200,800\n} else {\n"
                  "    set terminal png size 1200,800\n}\n");
    for (int m = 0; m < COUNT_OF(methods); m++) {
        fprintf(file, "$fit%d << EOD\n", m);
        for (int k = 0; methods[m].counts[k] >= 0; k++) {
            const figures f = table[m][k][which];
            if (f.grains == 0) continue;
            fprintf(file, "%.6g %.6g", 1e3 * f.seconds / f.grains,
                    fmax(1 - f.sum / f.grains, 1e-6)); /* logarithms want no zero */
            if (methods[m].counts[k] > 0)
                fprintf(file, " %d\n", methods[m].counts[k]);
            else
                fprintf(file, " %s\n", methods[m].name);
        }
        fprintf(file, "EOD\n");
    }
    fprintf(file,
            "set output 'build/fit.png'\nset logscale xy\nset grid\nset key outside right\n"
            "set title '%s: error against time; orders, arcs or vertices at the points'\n"
            "set xlabel 'time per grain, ms'\nset ylabel '1 - coverage, mean'\nplot \\\n",
            title);
    for (int m = 0; m < COUNT_OF(methods); m++)
        fprintf(file,
                "    $fit%d using 1:2 with linespoints lc %d pt %d title '%s', \\\n"
                "    $fit%d using 1:2:3 with labels offset 1,0.6 notitle%s\n",
                m, m + 1, m + 1, methods[m].name, m, m + 1 < COUNT_OF(methods) ? ", \\" : "");
    fclose(file);
    if (system("command -v gnuplot > /dev/null 2>&1") != 0)
        printf("skipped: build/fit.png: gnuplot is not installed (it draws build/fit.gp)\n");
    else if (system("gnuplot build/fit.gp") == 0)
        printf("build/fit.png: error against time\n");
    else
        printf("skipped: build/fit.png: gnuplot failed on build/fit.gp\n");
}

/* The grains to fit, in the order of their names. */
static void get_grains(outlines *all, const char *folder) {
    if (!folder) {
        make_grains(all);
        printf("%d outlines made here (a folder of real ones can be given)\n", all->count);
        return;
    }
    read_outlines(all, folder);
    printf("%d outlines below %s\n", all->count, folder);
    if (all->skipped)
        printf("skipped: %d .csv files that are no outlines (first line not x,y)\n", all->skipped);
}

int main(int argc, char **argv) {
    static outlines all;
    if (argc > 2 || (argc > 1 && argv[1][0] == '-')) {
        fprintf(stderr, "usage: bench_fit [DIR]\n");
        return 2;
    }
    get_grains(&all, argc > 1 ? argv[1] : NULL);
    const int core = mark_core(&all);
    int failed = 0;
    for (int m = 0; m < COUNT_OF(methods); m++) {
        for (int k = 0; methods[m].counts[k] >= 0; k++) {
            measure(&all, &methods[m], methods[m].counts[k], table[m][k]);
            failed += table[m][k][0].failed;
        }
    }
    mkdir("build", 0777); /* there already, usually */
    FILE *csv = create("build/fit.csv");
    fprintf(csv, "set,fit,count,grains,coverage_mean,coverage_least,milliseconds\n");
    print_table(0, "all outlines", csv);
    if (core) print_table(1, "the grains named in core12.txt", csv);
    fclose(csv);
    printf("\nbuild/fit.csv: the same figures\n");
    write_picture(core ? 1 : 0, core ? "grains of core12.txt" : "all outlines");
    free_outlines(&all);
    if (failed) printf("%d fits FAILED\n", failed);
    return failed ? 1 : 0;
}
