/* fit_grain.c - templates for the grains of a photograph, and how far off each of them is.

       make build && build/fit_grain sheet.pgm --svg fits.svg
       build/fit_grain outline.csv --model bezier --segments 12 --outline fit.csv
       build/fit_grain --help

   Grains are found in the image (or the file is one outline), each gets a template of the model
   asked for, and stdout has a line for each. Exit status: 0 all is well, 1 a coverage asked for is
   out of reach, 2 bad usage or input.
*/
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "grains.h"
#include "svg.h"

static const char usage[] =
    "usage: fit_grain FILE [options]\n"
    "Fits a template to each grain of an image (PBM, PGM) or to one outline (CSV, its first line\n"
    "names x and y).\n"
    "  --model M          fs, bezier, polygon, ellipse or circle (fs)\n"
    "  --order N          of fs, 1 to 64 (8)\n"
    "  --segments N       arcs of bezier, 3 to 64 (10)\n"
    "  --vertices N       of polygon, 3 to 64 (6)\n"
    "  --coverage C       instead of these: the least N with this coverage, between 0 and 1\n"
    "  --method M         fs: reduction, reduction-exact, fejer, constrained (constrained)\n"
    "                     bezier: area, pso (area)\n"
    "  --min-radius F     constrained: least radius of curvature over the mean, 0 to 0.999; 0\n"
    "                     allows corners (0.1)\n"
    "  --max-radius F     bezier: greatest radius of curvature over that of the circle with the\n"
    "                     hull's area, 1 to 1e9; 0 has no bound (20)\n"
    "  --scale S          constrained and fejer, area as of: hull, grain, or none (hull)\n"
    /* of images: */
    SEARCH_USAGE
    "  --threshold N      image: grains are darker than this, 1 to 255; where the file has values\n"
    "                     above 255, 1 to 65535 of these (Otsu's)\n"
    "  --bright           image: grains are not darker than the threshold\n"
    "  --min-pixels N     image: smaller grains are left out (16)\n"
    "  --scale-length L   image: metres per pixel (1)\n"
    "  --outline OUT.csv  720 points of the fit; of several grains in OUT_01.csv, OUT_02.csv ...\n"
    "  --svg OUT.svg      picture of the grains, the fits and the difference\n"
    "  --help             this text\n"
    "Columns: index, area, aspect and roundness (Wadell) of the grain, order (arcs, vertices) and\n"
    "coverage of the fit, and how long it took.\n";

enum { FIT_POINTS = 720 }; // of a fit that is written or drawn

/* ---- options ---- */

enum {
    MODEL,
    ORDER,
    SEGMENTS,
    VERTICES,
    COVERAGE,
    METHOD,
    MIN_RADIUS,
    MAX_RADIUS,
    SCALE,
    SEARCH, // SEARCH_OPTIONS of them; these and the rest up to SCALE_LENGTH are for images
    LABELS = SEARCH + SEARCH_LABELS,
    IGNORE_FRAME = SEARCH + SEARCH_IGNORE_FRAME,
    THRESHOLD = SEARCH + SEARCH_OPTIONS,
    BRIGHT,
    MIN_PIXELS,
    SCALE_LENGTH,
    OUTLINE,
    SVG,
    OPTIONS
};
static const char *const option_names[OPTIONS] = {
    "--model=",      "--order=",        "--segments=", "--vertices=", "--coverage=",  "--method=",
    "--min-radius=", "--max-radius=",   "--scale=",    SEARCH_NAMES,  "--threshold=", "--bright",
    "--min-pixels=", "--scale-length=", "--outline=",  "--svg="};

typedef struct options {
    const char *file;
    const char *given[OPTIONS]; // NULL: not given
    dem2d_fit_desc fit;
    dem2d_image_desc search; // all but the pixels
} options;

/* An option that does not go with the rest. */
static void refuse(const options *o, int option, bool refused, const char *why) {
    if (o->given[option] == NULL || !refused) return;
    fail(STATUS_BAD_INPUT, "%.*s %s", (int)strcspn(option_names[option], "="), option_names[option],
         why);
}

/* The count of a model, if it is this one. */
static void take_count(options *o, int option, dem2d_shape_type model, int least, int usual) {
    const char *text = o->given[option];
    char name[16], why[64];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(option_names[option], "="),
             option_names[option]);
    snprintf(why, sizeof why, "is for the model %s", kind_names[model]);
    refuse(o, option, o->fit.model != model, why);
    refuse(o, option, o->given[COVERAGE] != NULL, "and --coverage exclude each other");
    if (o->fit.model != model || o->given[COVERAGE] != NULL) return;
    o->fit.count = text == NULL ? usual : (int)parse_integer(name, text, (uint64_t)least, 64);
}

static void take_fit(options *o) {
    static const char *const methods[] = {
        "reduction", "reduction-exact", "fejer", "constrained", "area", "pso"};
    static const char *const scales[] = {"hull", "grain", "none"};
    const char *const *given = o->given;
    dem2d_fit_desc *fit = &o->fit;
    fit->model = DEM2D_FOURIER; // kinds and methods are in the library's order
    if (given[MODEL] != NULL)
        fit->model = (dem2d_shape_type)parse_name("--model", given[MODEL], kind_names, KINDS);
    take_count(o, ORDER, DEM2D_FOURIER, 1, 8);
    take_count(o, SEGMENTS, DEM2D_BEZIER, 3, 10);
    take_count(o, VERTICES, DEM2D_POLYGON, 3, 6);
    refuse(o, COVERAGE, fit->model == DEM2D_CIRCLE || fit->model == DEM2D_ELLIPSE,
           "needs a model that has an order, segments or vertices");
    if (given[COVERAGE] != NULL)
        fit->coverage = parse_real("--coverage", given[COVERAGE], 1e-6, 0.999999);
    if (given[METHOD] != NULL) {
        const int method = parse_name("--method", given[METHOD], methods, 6);
        fit->method = (dem2d_fit_method)(DEM2D_FIT_REDUCTION + method);
        const bool series = fit->method <= DEM2D_FIT_CONSTRAINED;
        if (fit->model != (series ? DEM2D_FOURIER : DEM2D_BEZIER))
            fail(STATUS_BAD_INPUT, "--method %s is for the model %s, not %s", given[METHOD],
                 series ? "fs" : "bezier", kind_names[fit->model]);
    }
    const bool series = fit->model == DEM2D_FOURIER, fejer = fit->method == DEM2D_FIT_FEJER;
    const bool constrained =
        series && (fit->method == DEM2D_FIT_DEFAULT || fit->method == DEM2D_FIT_CONSTRAINED);
    refuse(o, MIN_RADIUS, !constrained, "is for the model fs by the method constrained");
    refuse(o, SCALE, !constrained && !fejer, "is for the model fs by constrained or fejer");
    if (given[MIN_RADIUS] != NULL)
        fit->min_radius = parse_real("--min-radius", given[MIN_RADIUS], 0, 0.999);
    refuse(o, MAX_RADIUS, fit->model != DEM2D_BEZIER, "is for the model bezier");
    if (given[MAX_RADIUS] != NULL) {
        fit->max_radius = parse_real("--max-radius", given[MAX_RADIUS], 0, 1e9);
        if (fit->max_radius > 0 && fit->max_radius < 1)
            fail(STATUS_BAD_INPUT, "--max-radius is 0, or 1 or more");
        fit->unbounded = fit->max_radius == 0;
    }
    fit->corners = given[MIN_RADIUS] != NULL && fit->min_radius == 0;
    if (given[SCALE] != NULL)
        fit->scale = (dem2d_fit_scale)parse_name("--scale", given[SCALE], scales, 3);
}

static void take_image(options *o) {
    const char *const *given = o->given;
    dem2d_image_desc *search = &o->search;
    *search = default_search();
    search->bright = given[BRIGHT] != NULL;
    for (int i = 0; i < SEARCH_OPTIONS; i++)
        if (given[SEARCH + i] != NULL) take_search(i, given[SEARCH + i], search);
    refuse(o, THRESHOLD, search->labels || search->ignore_frame,
           "and --labels or --ignore-frame exclude each other");
    refuse(o, IGNORE_FRAME, search->labels, "and --labels exclude each other");
    refuse(o, BRIGHT, search->labels, "and --labels exclude each other");
    if (given[THRESHOLD] != NULL)
        search->threshold = (int)parse_integer("--threshold", given[THRESHOLD], 1, 65535);
    if (given[MIN_PIXELS] != NULL)
        search->min_pixels = (int)parse_integer("--min-pixels", given[MIN_PIXELS], 1, INT_MAX);
    if (given[SCALE_LENGTH] != NULL)
        search->scale = parse_real("--scale-length", given[SCALE_LENGTH], 1e-30, 1e30);
}

static options parse_options(int count, char **arguments) {
    options o = {0};
    for (int i = 1; i < count; i++) {
        if (strncmp(arguments[i], "--", 2) == 0) {
            const char *value;
            const int which =
                parse_option(count, arguments, &i, usage, option_names, OPTIONS, &value);
            o.given[which] = value;
        } else {
            if (o.file != NULL) fail(STATUS_BAD_INPUT, "one FILE only (try --help)");
            o.file = arguments[i];
        }
    }
    if (o.file == NULL) fail(STATUS_BAD_INPUT, "no FILE (try --help)");
    take_fit(&o);
    take_image(&o);
    return o;
}

static outline_list load(const options *o) {
    outline_list list = {NULL, 0};
    const file_kind kind = read_grains(o->file, &o->search, &list);
    if (kind == FILE_OTHER)
        fail(STATUS_BAD_INPUT, "%s: neither PBM, PGM nor CSV whose first line names x and y",
             o->file);
    for (int option = SEARCH; option <= SCALE_LENGTH; option++)
        refuse(o, option, kind != FILE_IMAGE, "is for images");
    if (list.count == 0) fail(STATUS_BAD_INPUT, "%s: no grain found", o->file);
    return list;
}

/* ---- fits ---- */

typedef struct fitted {
    dem2d_shape *shape; // NULL: the coverage is out of reach
    dem2d_pose pose;
} fitted;

/* Fits a grain and prints its line. */
static fitted fit_grain(const options *o, const outline *reference, int index) {
    fitted made = {NULL, {{0, 0}, {1, 0}, 1}};
    dem2d_outline_info info;
    dem2d_fit_report report;
    need(dem2d_outline_measure(example_env(), reference->points, reference->count, &info),
         STATUS_BAD_INPUT, reference->name);
    const double start = clock_seconds();
    const dem2d_result result = dem2d_outline_fit(example_env(), reference->points,
                                                  reference->count, &o->fit, &made.shape, &report);
    const double seconds = clock_seconds() - start;
    if (result == DEM2D_NOT_REACHED) {
        fprintf(stderr, "fit_grain: %s: no fit reaches a coverage of %s\n", reference->name,
                o->given[COVERAGE]);
        return made;
    }
    need(result, STATUS_BAD_INPUT, reference->name);
    made.pose = report.pose;
    printf("%d %.9g %.6g %.6g %d %.6f %.3f\n", index + 1, info.mass.area, info.aspect,
           info.roundness, report.count, report.coverage, 1000 * seconds);
    return made;
}

static void outline_points(const fitted *fit, dem2d_vec points[FIT_POINTS]) {
    must(dem2d_shape_outline(fit->shape, fit->pose, FIT_POINTS, points), "outline");
}

/* ---- files ---- */

/* OUT.csv, or for grain 7 of several OUT_07.csv; with more digits where there are more grains. */
static char *numbered_path(const char *path, int index, int count) {
    int digits = 2;
    char number[16];
    if (count == 1) return join_text(path, "", "");
    for (int n = count; n >= 100; n /= 10) digits++;
    char *stem = join_text(path, "", ""), *ending = stem + strlen(stem);
    if (is_csv_name(stem)) ending -= strlen(".csv");
    snprintf(number, sizeof number, "%010d", index + 1);
    const char *tail = path + (ending - stem);
    *ending = '\0';
    char *front = join_text(stem, "_", number + 10 - digits), *whole = join_text(front, "", tail);
    free(front);
    free(stem);
    return whole;
}

static void write_outline(const char *path, const fitted *fit) {
    draft d;
    dem2d_vec points[FIT_POINTS];
    outline_points(fit, points);
    draft_open(&d);
    fputs("x,y\n", d.file);
    for (int i = 0; i < FIT_POINTS; i++) fprintf(d.file, "%.17g,%.17g\n", points[i].x, points[i].y);
    draft_write(&d, path);
}

/* ---- the picture ---- */

/* All grains and fits. */
static dem2d_box find_box(const outline_list *list, const fitted *fits) {
    dem2d_box box = empty_box();
    for (int i = 0; i < list->count; i++) {
        const outline *reference = &list->items[i];
        dem2d_box own;
        for (int k = 0; k < reference->count; k++) widen(&box, reference->points[k]);
        if (fits[i].shape == NULL) continue;
        must(dem2d_shape_aabb(fits[i].shape, fits[i].pose, &own), "box");
        widen(&box, own.lower);
        widen(&box, own.upper);
    }
    return box;
}

static void draw_grain(FILE *file, const frame *f, const outline *reference, const fitted *fit) {
    dem2d_vec points[FIT_POINTS];
    if (fit->shape != NULL) outline_points(fit, points);
    svg_difference(file, f, reference->points, reference->count, points,
                   fit->shape != NULL ? FIT_POINTS : 0);
}

static void write_picture(const char *path, const outline_list *list, const fitted *fits) {
    const double side = 1000, margin = 10; // px
    const dem2d_box box = find_box(list, fits);
    const double width = box.upper.x - box.lower.x, height = box.upper.y - box.lower.y;
    frame f = {0, 0, (side - 2 * margin) / fmax(width, height)};
    f.left = box.lower.x - margin / f.scale;
    f.top = box.upper.y + margin / f.scale;
    draft d;
    draft_open(&d);
    const double across = width * f.scale + 2 * margin, down = height * f.scale + 2 * margin;
    fprintf(d.file,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
            "viewBox=\"0 0 %.3f %.3f\">\n"
            "<title>grains grey, fits blue, difference red</title>\n"
            "<style>%s</style>\n"
            "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
            across, down, across, down, difference_style);
    for (int i = 0; i < list->count; i++) draw_grain(d.file, &f, &list->items[i], &fits[i]);
    fputs("</svg>\n", d.file);
    draft_write(&d, path);
}

int main(int count, char **arguments) {
    example_name = "fit_grain";
    const options o = parse_options(count, arguments);
    outline_list list = load(&o);
    fitted *fits = get_memory(NULL, (size_t)list.count, sizeof *fits);
    bool reached = true;
    puts("# index area aspect roundness order coverage milliseconds");
    for (int i = 0; i < list.count; i++) {
        fits[i] = fit_grain(&o, &list.items[i], i);
        if (fits[i].shape == NULL) reached = false;
    }
    for (int i = 0; o.given[OUTLINE] != NULL && i < list.count; i++) {
        if (fits[i].shape == NULL) continue;
        char *path = numbered_path(o.given[OUTLINE], i, list.count);
        write_outline(path, &fits[i]);
        free(path);
    }
    if (o.given[SVG] != NULL) write_picture(o.given[SVG], &list, fits);
    for (int i = 0; i < list.count; i++) dem2d_shape_destroy(fits[i].shape);
    free(fits);
    free_outlines(&list);
    if (fflush(stdout) != 0) fail(STATUS_BAD_INPUT, "cannot write to stdout");
    return reached ? STATUS_OK : STATUS_FAILED;
}
