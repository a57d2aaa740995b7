/* figures.c - the figures and tables of two papers on irregular grains, made again, and whether
   what the papers say of them holds here.

       make -C examples figures                     (about a minute; needs gnuplot)
       examples/build/figures --help

   P is the paper on polybezier grains, F the one on Fourier series (FS) of the support function, as
   the manual in dem2d.h cites them. `make figures` runs biaxial six times - five models,
   noncircular grains, circles, each with local damping (as in P) and global damping (as in F) -,
   four times more with friction at the walls, gravity, both, softer contacts, with LONG=1 twice in
   the papers' mode, and then this program. It reads their files, fits templates to twelve outlines,
   writes tables for figures.gp, pictures of shapes and the page figures.html.

   The page has a row for each number and each finding that the papers print: what they say, what
   came out here, the band in which both agree, the verdict. Bands were fixed before the first run
   that was judged by them: 20 % for support calls, 1 in 15 for strains, 2 points for coverage, else
   as the row says. Checks of our own are apart. Exit status: 0 if these hold, and the findings that
   do not depend on the papers' grains; 1 if one fails, 2 for bad usage or input.
*/
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "../examples/grains.h"
#include "../examples/statistics.h"
#include "../examples/svg.h"

static const char usage[] =
    "usage: figures DIR [options]\n"
    "       figures --models FILE\n"
    "Makes the papers' figures from six runs of biaxial in DIR (see make -C examples figures).\n"
    "  --grains PATH     outlines to fit templates to: the first 12 at PATH, as for biaxial\n"
    "                    (without PATH: 12 made here)\n"
    "  --quick           the runs were quick ones: the checks are shown, but a failing one is no\n"
    "                    error\n"
    "  --models FILE     only draw the shape models to an SVG file\n"
    "  --help            this text\n"
    "Exit status: 0 all checks hold, 1 one failed, 2 bad usage or input.\n";

static const double PI = 3.141592653589793;

typedef struct options {
    const char *folder, *grains, *models; // or NULL
    bool quick;
} options;

static options parse_options(int count, char **arguments) {
    static const char *const names[] = {"--grains=", "--quick", "--models="};
    options o = {0};
    for (int i = 1; i < count; i++) {
        const char *value;
        if (arguments[i][0] != '-') {
            if (o.folder != NULL) fail(STATUS_BAD_INPUT, "one DIR only (try --help)");
            o.folder = arguments[i];
            continue;
        }
        const int which = parse_option(count, arguments, &i, usage, names, 3, &value);
        if (which == 0) o.grains = value;
        if (which == 1) o.quick = true;
        if (which == 2) o.models = value;
    }
    if ((o.folder == NULL) == (o.models == NULL))
        fail(STATUS_BAD_INPUT, "expected DIR or --models FILE (try --help)");
    return o;
}

/* ---- the page: figures with what is claimed of them, and the table of all rows ---- */

typedef struct page {
    draft body, rows, failures;
    int checks, failed; // of our own, and findings that must hold
    int judged, differ; // what the papers print
} page;

typedef enum verdict { DIFFERS, AGREES, NOT_JUDGED } verdict;

static const char *const verdict_marks[] = {"no", "yes", "note"};
static const char *const verdict_words[] = {"DIFFERS", "agrees", "not judged"};

/* One line below the figure and one in the table; on stdout, too. `source` is a place in a paper,
   or "own". */
static void put_row(page *p, const char *source, const char *claim, const char *band,
                    const char *got, verdict v) {
    const char *mark = verdict_marks[v], *word = verdict_words[v];
    fprintf(p->body.file, "<li class=\"%s\">%s: %s%s%s: <b>%s</b> &ndash; %s</li>\n", mark, source,
            claim, band[0] != '\0' ? "; band: " : "", band, got, word);
    fprintf(p->rows.file, "<tr class=\"%s\"><td>%s<td>%s<td>%s<td>%s<td>%s\n", mark, source, claim,
            got, band, word);
    printf("%-10s %s: %s: %s%s%s\n", word, source, claim, got, band[0] != '\0' ? "; band " : "",
           band);
    if (v == DIFFERS)
        fprintf(p->failures.file, "<li class=\"no\">%s: %s: <b>%s</b></li>\n", source, claim, got);
}

#if defined(__GNUC__)
#define PAGE_PRINTF(text, first) __attribute__((format(printf, text, first)))
#else
#define PAGE_PRINTF(text, first)
#endif

static void put_words(page *p, const char *source, const char *claim, verdict v, const char *format,
                      va_list arguments) {
    char got[400];
    vsnprintf(got, sizeof got, format, arguments);
    put_row(p, source, claim, "", got, v);
}

/* What must hold beside the papers: the exit status is 1 if it does not. */
PAGE_PRINTF(4, 5)
static void check(page *p, bool holds, const char *claim, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    put_words(p, "own", claim, holds ? AGREES : DIFFERS, format, arguments);
    va_end(arguments);
    p->checks++;
    p->failed += !holds;
}

/* A row that is judged in words. */
static void judge(page *p, const char *source, bool holds, const char *claim, const char *format,
                  va_list arguments) {
    put_words(p, source, claim, holds ? AGREES : DIFFERS, format, arguments);
    p->judged++;
    p->differ += !holds;
}

/* A finding of a paper that any grains show: judged, and the exit status is 1 if it differs. */
PAGE_PRINTF(5, 6)
static void finding(page *p, const char *source, bool holds, const char *claim, const char *format,
                    ...) {
    va_list arguments;
    va_start(arguments, format);
    judge(p, source, holds, claim, format, arguments);
    va_end(arguments);
    p->checks++;
    p->failed += !holds;
}

/* One that depends on the papers' grains or methods: judged, and no more. */
PAGE_PRINTF(5, 6)
static void compare(page *p, const char *source, bool holds, const char *claim, const char *format,
                    ...) {
    va_list arguments;
    va_start(arguments, format);
    judge(p, source, holds, claim, format, arguments);
    va_end(arguments);
}

/* A number that a paper prints, its band, and what came out here: in the default way and, unless
   it is NaN, in the papers' mode, by which it is judged then. */
static void number(page *p, const char *source, const char *claim, double paper, double low,
                   double high, double here, double papers_mode) {
    char text[300], band[60], got[100];
    const bool papers = !isnan(papers_mode);
    const double judged = papers ? papers_mode : here;
    const bool holds = judged >= low && judged <= high; // false for a NaN
    snprintf(text, sizeof text, "%s, %.4g", claim, paper);
    snprintf(band, sizeof band, "%.4g to %.4g", low, high);
    if (papers)
        snprintf(got, sizeof got, "%.4g; in the papers' mode %.4g", here, papers_mode);
    else
        snprintf(got, sizeof got, "%.4g", here);
    put_row(p, source, text, band, got, holds ? AGREES : DIFFERS);
    p->judged++;
    p->differ += !holds;
}

/* A number that no paper prints and nothing is decided by. */
PAGE_PRINTF(3, 4)
static void note(page *p, const char *claim, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    put_words(p, "here", claim, NOT_JUDGED, format, arguments);
    va_end(arguments);
}

/* Files: names with a space between. */
static void open_figure(page *p, const char *title, const char *files) {
    fprintf(p->body.file, "<section><h2>%s</h2>\n<div class=\"row\">\n", title);
    for (const char *name = files; *name != '\0';) {
        const int length = (int)strcspn(name, " ");
        fprintf(p->body.file, "<img src=\"%.*s\" alt=\"%s\">\n", length, name, title);
        name += length + (name[length] == ' ');
    }
    fputs("</div><ul>\n", p->body.file);
}

static void close_figure(page *p) {
    fputs("</ul></section>\n", p->body.file);
}

static const char page_head[] =
    "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
    "<title>dem2d: the papers' figures</title>\n<style>\n"
    "body { font: 16px/1.45 sans-serif; max-width: 70em; margin: auto; padding: 0 1em; }\n"
    "h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin: 2em 0 .5em; }\n"
    ".row { display: flex; flex-wrap: wrap; gap: .5em; align-items: flex-start; }\n"
    ".row img { flex: 1 1 300px; min-width: 0; max-width: 100%; height: auto; }\n"
    "ul { padding-left: 1.2em; } .no { color: #b00020; } .note { color: #555; }\n"
    ".wide { overflow-x: auto; } table { border-collapse: collapse; font-size: .9em; }\n"
    "td, th { border: 1px solid #ccc; padding: .25em .5em; text-align: left; vertical-align: top; "
    "}\n"
    "</style>\n<h1>dem2d: the figures of two papers, made again</h1>\n"
    "<p>P: Z. Lai, L. Huang, A polybezier-based particle model for the DEM modeling of granular "
    "media, Computers and Geotechnics 134 (2021) 104052, doi 10.1016/j.compgeo.2021.104052.<br>\n"
    "F: S. Huang, L. Huang, Z. Lai, An extension of the Fourier series-based particle model to the "
    "GJK-based contact detection and resolution framework for DEM, Computational Particle "
    "Mechanics "
    "9 (2022) 381-391, doi 10.1007/s40571-021-00446-6.<br>\n"
    "The original radial model: Z. Lai, Q. Chen, L. Huang, Computer Methods in Applied Mechanics "
    "and Engineering 362 (2020) 112873.</p>\n"
    "<p>Every line below a figure is written by the program from the numbers of this run: where "
    "the "
    "paper says it, what it says, <b>what came out here</b>, and whether that agrees. Lines that "
    "begin with \"own\" are checks of our own; those with \"here\" are not judged.</p>\n";

static void write_page(page *p, const char *path, bool quick) {
    draft whole;
    draft_close(&p->body);
    draft_close(&p->rows);
    draft_close(&p->failures);
    draft_open(&whole);
    fputs(page_head, whole.file);
    fprintf(
        whole.file,
        "<p><b>Of %d numbers and findings that the papers print %d agree.</b> Of %d checks that "
        "decide this program's exit status, our own among them, %d hold.%s</p>\n<ul>%s</ul>\n",
        p->judged, p->judged - p->differ, p->checks, p->checks - p->failed,
        quick ? " These are quick runs of 100 grains: too few to judge by." : "",
        p->failures.bytes);
    fputs(p->body.bytes, whole.file);
    fprintf(whole.file,
            "<h2>All rows</h2>\n<div class=\"wide\"><table>\n"
            "<tr><th>where<th>what the paper "
            "says<th>here<th>band<th>verdict\n%s</table></div>\n</html>\n",
            p->rows.bytes);
    draft_write(&whole, path);
    free(p->body.bytes);
    free(p->rows.bytes);
    free(p->failures.bytes);
}

/* ---- tables: columns of numbers by name ---- */

typedef struct table {
    int rows, columns;
    char **names;
    double *values; // row by row; NaN where a cell is empty
} table;

static double parse_cell(const char *text, size_t length) {
    double value;
    return parse_decimal(text, length, &value) ? value : (double)NAN;
}

/* Next cell of a line of CSV, which loses it. */
static rest next_cell(rest *line) {
    rest cell = *line;
    const char *comma = memchr(line->at, ',', (size_t)(line->end - line->at));
    cell.end = comma != NULL ? comma : line->end;
    line->at = comma != NULL ? comma + 1 : line->end;
    return cell;
}

static void add_name(table *t, const char *text, size_t length) {
    t->names = get_memory(t->names, (size_t)t->columns + 1, sizeof *t->names);
    char *name = get_memory(NULL, length, 1);
    memcpy(name, text, length);
    name[length] = '\0'; // get_memory gives one byte more
    t->names[t->columns++] = name;
}

/* A CSV file whose first line has the names. */
static table read_table(const char *path) {
    size_t count;
    char *bytes = read_whole(path, &count);
    rest r = rest_make(bytes, count), line = r;
    table t = {0, 0, NULL, NULL};
    if (!next_line(&r, &line)) fail(STATUS_BAD_INPUT, "%s is empty", path);
    while (line.at < line.end) {
        const rest cell = next_cell(&line);
        add_name(&t, cell.at, (size_t)(cell.end - cell.at));
    }
    while (next_line(&r, &line)) {
        const size_t columns = (size_t)t.columns;
        t.values = get_memory(t.values, columns * ((size_t)t.rows + 1), sizeof *t.values);
        for (size_t i = 0; i < columns; i++) {
            const rest cell = next_cell(&line);
            t.values[columns * (size_t)t.rows + i] =
                parse_cell(cell.at, (size_t)(cell.end - cell.at));
        }
        t.rows++;
    }
    free(bytes);
    return t;
}

/* What biaxial printed, lines "name value unit", as a table of one row. */
static table read_results(const char *path) {
    size_t count;
    char *bytes = read_whole(path, &count);
    rest r = rest_make(bytes, count), line = r;
    table t = {1, 0, NULL, NULL};
    while (next_line(&r, &line)) {
        const char *space = memchr(line.at, ' ', (size_t)(line.end - line.at));
        if (space == NULL) continue;
        const char *value = space + 1;
        const char *stop = memchr(value, ' ', (size_t)(line.end - value));
        t.values = get_memory(t.values, (size_t)t.columns + 1, sizeof *t.values);
        t.values[t.columns] = parse_cell(value, (size_t)((stop != NULL ? stop : line.end) - value));
        add_name(&t, line.at, (size_t)(space - line.at));
    }
    free(bytes);
    return t;
}

static int column(const table *t, const char *name) {
    for (int i = 0; i < t->columns; i++)
        if (strcmp(t->names[i], name) == 0) return i;
    fail(STATUS_BAD_INPUT, "no column %s in a file of biaxial", name);
}

static double cell(const table *t, int row, const char *name) {
    return t->values[row * t->columns + column(t, name)];
}

static void free_table(table *t) {
    for (int i = 0; i < t->columns; i++) free(t->names[i]);
    free(t->names);
    free(t->values);
}

/* ---- the runs of biaxial ---- */

enum { IRREGULAR, NONCIRCULAR, CIRCULAR, SETS };
enum { LOCAL, GLOBAL, DAMPINGS };
static const char *const set_names[SETS] = {"irregular", "noncircular", "circular"};
static const char *const damping_names[DAMPINGS] = {"local", "global"};

/* Noncircular grains, local damping, with what the papers may have kept after settling. */
enum { WALLS, GRAVITY, BOTH, SOFT, STAGES };
static const char *const stage_runs[STAGES] = {"noncircular_walls", "noncircular_gravity",
                                               "noncircular_both", "noncircular_soft"};

/* The papers' mode: P's scene with its damping, and F's. */
enum { OF_P, OF_F, PAPERS };
static const char *const paper_runs[PAPERS] = {"papers_p", "papers_f"};

typedef struct run {
    bool there;
    table results, history, settled, final, pairs; // pairs: empty where none were asked for
} run;

typedef struct study {
    const options *options;
    run runs[SETS][DAMPINGS];
    run stages[STAGES];
    run papers[PAPERS];
    table pairs[SETS]; // of both dampings; none of circles
    page page;
} study;

static char *run_path(const study *s, const char *name, const char *file) {
    char *folder = join_text(s->options->folder, "/", name), *path = join_text(folder, "/", file);
    free(folder);
    return path;
}

static table read_run_table(const study *s, const char *name, const char *file) {
    char *path = run_path(s, name, file);
    const table t = strcmp(file, "results.txt") == 0 ? read_results(path) : read_table(path);
    free(path);
    return t;
}

static bool is_there(const study *s, const char *name, const char *file) {
    char *path = run_path(s, name, file);
    FILE *found = fopen(path, "rb");
    free(path);
    if (found != NULL) fclose(found);
    return found != NULL;
}

/* A run of this name; one that is not needed may be missing. */
static run read_run(const study *s, const char *name, bool needed) {
    run r;
    memset(&r, 0, sizeof r);
    if (!needed && !is_there(s, name, "results.txt")) return r;
    r.there = true;
    r.results = read_run_table(s, name, "results.txt");
    r.history = read_run_table(s, name, "history.csv");
    r.settled = read_run_table(s, name, "settled.csv");
    r.final = read_run_table(s, name, "final.csv");
    if (is_there(s, name, "pairs.csv")) r.pairs = read_run_table(s, name, "pairs.csv");
    return r;
}

static void read_runs(study *s) {
    for (int i = 0; i < SETS * DAMPINGS; i++) {
        const int set = i / DAMPINGS, d = i % DAMPINGS;
        char name[60];
        snprintf(name, sizeof name, "%s_%s", set_names[set], damping_names[d]);
        s->runs[set][d] = read_run(s, name, true);
    }
    for (int i = 0; i < STAGES; i++) s->stages[i] = read_run(s, stage_runs[i], false);
    for (int i = 0; i < PAPERS; i++) s->papers[i] = read_run(s, paper_runs[i], false);
}

static void free_run(run *r) {
    table *const tables[] = {&r->results, &r->history, &r->settled, &r->final, &r->pairs};
    for (int k = 0; k < 5; k++) free_table(tables[k]);
}

static void free_runs(study *s) {
    for (int i = 0; i < SETS * DAMPINGS; i++) free_run(&s->runs[i / DAMPINGS][i % DAMPINGS]);
    for (int i = 0; i < STAGES; i++) free_run(&s->stages[i]);
    for (int i = 0; i < PAPERS; i++) free_run(&s->papers[i]);
}

static double result(const study *s, int set, int damping, const char *name) {
    return cell(&s->runs[set][damping].results, 0, name);
}

/* The same of a run in the papers' mode; NaN if there is none. */
static double paper_result(const study *s, int which, const char *name) {
    return s->papers[which].there ? cell(&s->papers[which].results, 0, name) : (double)NAN;
}

/* A draft for DIR/name. */
static void finish(const study *s, draft *d, const char *name) {
    char *path = join_text(s->options->folder, "/", name);
    draft_write(d, path);
    free(path);
}

/* ---- fits of templates to outlines ---- */

enum { TEMPLATES = 12, MOST = 16, FIT_POINTS = 240 }; // most: the greatest order
typedef enum way { AS_BEZIER, AS_POLYGON, AS_RADIAL, AS_REDUCED, AS_CONSTRAINED, WAYS } way;
static const char *const way_texts[WAYS] = {"polybezier", "polygon", "original FS: radius by angle",
                                            "new FS by the paper's reduction",
                                            "new FS by constrained least squares"};
static const char *const way_names[WAYS] = {"bezier", "polygon", "radial", "reduced",
                                            "constrained"};

typedef struct fits {
    outline_list outlines;
    int templates;
    double coverage[WAYS][MOST + 1][TEMPLATES]; // by number of segments or order
    double convex[WAYS][TEMPLATES];             // of the convex hulls, FS of order 8
    double solidity[TEMPLATES];                 // area over area of the hull
    double roundness[TEMPLATES];                // Wadell's
} fits;

/* A polygon of 5 to 9 corners near an ellipse of this aspect, with rounded corners. */
static void list_rounded(outline_list *list, double aspect, double rounding, uint64_t *random,
                         int number) {
    enum { POINTS = 180 };
    const int count = 5 + random_below(random, 5);
    dem2d_vec corners[9], points[POINTS];
    dem2d_shape *shape;
    for (int i = 0; i < count; i++) {
        const double place = i + random_between(random, -0.3, 0.3);
        const dem2d_rot direction = dem2d_rot_make(2 * PI * place / count);
        corners[i].x = direction.c * aspect;
        corners[i].y = direction.s;
    }
    must(dem2d_shape_create_polygon(example_env(), corners, count, rounding, &shape), "outline");
    must(dem2d_shape_outline(shape, dem2d_pose_make(0, 0, 0, 1), POINTS, points), "outline");
    list_outline(list, points, POINTS, "rounded polygon", number);
    dem2d_shape_destroy(shape);
}

/* Twelve grains: the lumpy ones of the other examples, not quite convex, and convex ones of four
   aspects, each angular and round (as in the charts of sphericity and roundness). */
static outline_list make_outlines(void) {
    outline_list list = {NULL, 0};
    uint64_t random = 1;
    for (int i = 0; i < SELF_MADE; i++) list_self_made(&list, i);
    for (int i = SELF_MADE; i < TEMPLATES; i++)
        list_rounded(&list, 1 + 0.3 * (i % 4), i < 8 ? 0.1 : 0.4, &random, i + 1);
    return list;
}

/* Distance from c along a unit direction to the farthest crossing with an outline. */
static double ray_length(const outline *o, dem2d_vec c, dem2d_rot direction) {
    double length = 0;
    for (int i = 0; i < o->count; i++) {
        const dem2d_vec p = o->points[i], q = o->points[(i + 1) % o->count];
        const double px = p.x - c.x, py = p.y - c.y, qx = q.x - c.x, qy = q.y - c.y;
        const double left = direction.c * py - direction.s * px; // of the ray, p and q
        const double right = direction.c * qy - direction.s * qx;
        if ((left > 0) == (right > 0)) continue;
        const double t = left / (left - right);
        const double along =
            direction.c * (px + t * (qx - px)) + direction.s * (py + t * (qy - py));
        length = fmax(length, along);
    }
    return length;
}

/* The radius about the centroid as a Fourier series: the grains of the original FS model. */
static void radial_points(const outline *o, int order, dem2d_vec points[FIT_POINTS]) {
    double a[MOST + 1] = {0}, b[MOST + 1] = {0};
    dem2d_mass mass;
    must(dem2d_polygon_mass(o->points, o->count, &mass), o->name);
    for (int i = 0; i < FIT_POINTS; i++) {
        const double angle = 2 * PI * i / FIT_POINTS;
        const double radius = ray_length(o, mass.centroid, dem2d_rot_make(angle));
        for (int n = 0; n <= order; n++) {
            const dem2d_rot turn = dem2d_rot_make(n * angle);
            a[n] += radius * turn.c * (n == 0 ? 1.0 : 2.0) / FIT_POINTS;
            b[n] += radius * turn.s * 2.0 / FIT_POINTS;
        }
    }
    for (int i = 0; i < FIT_POINTS; i++) {
        const double angle = 2 * PI * i / FIT_POINTS;
        const dem2d_rot direction = dem2d_rot_make(angle);
        double radius = a[0];
        for (int n = 1; n <= order; n++) {
            const dem2d_rot turn = dem2d_rot_make(n * angle);
            radius += a[n] * turn.c + b[n] * turn.s;
        }
        points[i].x = mass.centroid.x + radius * direction.c;
        points[i].y = mass.centroid.y + radius * direction.s;
    }
}

/* Coverage of a fit with `count` segments or of this order, and its outline unless points is NULL.
 */
static double fit(const outline *o, way how, int count, dem2d_vec *points) {
    static const dem2d_shape_type models[WAYS] = {DEM2D_BEZIER, DEM2D_POLYGON, DEM2D_CUSTOM,
                                                  DEM2D_FOURIER, DEM2D_FOURIER};
    if (how == AS_RADIAL) {
        dem2d_difference difference;
        must(dem2d_radial_compare(example_env(), o->points, o->count, count, &difference), o->name);
        if (points != NULL) radial_points(o, count, points);
        return difference.coverage;
    }
    dem2d_fit_desc desc = {0};
    dem2d_fit_report report;
    dem2d_shape *shape;
    desc.model = models[how];
    desc.count = count;
    desc.method = how == AS_REDUCED ? DEM2D_FIT_REDUCTION : DEM2D_FIT_DEFAULT;
    must(dem2d_outline_fit(example_env(), o->points, o->count, &desc, &shape, &report), o->name);
    if (points != NULL) must(dem2d_shape_outline(shape, report.pose, FIT_POINTS, points), o->name);
    dem2d_shape_destroy(shape);
    return report.coverage;
}

/* The papers' ranges: 3 to 10 segments, order 1 to 16. */
static int least_count(way how) {
    return how == AS_BEZIER || how == AS_POLYGON ? 3 : 1;
}

static int greatest_count(way how) {
    return how == AS_BEZIER || how == AS_POLYGON ? 10 : MOST;
}

static outline hull_of(const outline *o) {
    outline hull = {get_memory(NULL, (size_t)o->count, sizeof(dem2d_vec)), 0, o->name};
    must(dem2d_polygon_hull(example_env(), o->points, o->count, hull.points, &hull.count), o->name);
    return hull;
}

static void make_fits(fits *f, const options *o) {
    progress p;
    const dem2d_image_desc search = default_search();
    f->outlines = o->grains != NULL ? load_grains(o->grains, &search) : make_outlines();
    f->templates = f->outlines.count < TEMPLATES ? f->outlines.count : TEMPLATES;
    progress_start(&p, "templates", f->templates);
    for (int i = 0; i < f->templates; i++) {
        const outline *reference = &f->outlines.items[i];
        outline hull = hull_of(reference);
        dem2d_outline_info info;
        must(dem2d_outline_measure(example_env(), reference->points, reference->count, &info),
             reference->name);
        f->solidity[i] = info.solidity;
        f->roundness[i] = info.roundness;
        for (way how = AS_BEZIER; how < WAYS; how++) {
            for (int n = least_count(how); n <= greatest_count(how); n++)
                f->coverage[how][n][i] = fit(reference, how, n, NULL);
            if (how >= AS_RADIAL) f->convex[how][i] = fit(&hull, how, FOURIER_ORDER, NULL);
        }
        free(hull.points);
        progress_show(&p, "fitting", i + 1);
        if (stop_asked) fail(STATUS_STOPPED, "stopped while fitting; nothing is written");
    }
    progress_end(&p);
}

static double mean(const double *values, int count) {
    double sum = 0;
    for (int i = 0; i < count; i++) sum += values[i];
    return sum / count;
}

/* Per cent of coverage by number: a file with the means of some ways in columns, and for each way
   one with the curves of all grains, empty lines between. */
static void write_coverage(const study *s, const fits *f, const char *file, way first, way last) {
    draft d;
    draft_open(&d);
    fputs("count", d.file);
    for (way how = first; how <= last; how++) fprintf(d.file, ",%s", way_names[how]);
    for (int n = least_count(first); n <= greatest_count(first); n++) {
        fprintf(d.file, "\n%d", n);
        for (way how = first; how <= last; how++)
            fprintf(d.file, ",%.6g", 100 * mean(f->coverage[how][n], f->templates));
    }
    fputc('\n', d.file);
    finish(s, &d, file);
    for (way how = first; how <= last; how++) {
        char name[40];
        snprintf(name, sizeof name, "fits_%s.csv", way_names[how]);
        draft_open(&d);
        fputs("count,coverage\n", d.file);
        for (int i = 0; i < f->templates; i++, fputc('\n', d.file))
            for (int n = least_count(how); n <= greatest_count(how); n++)
                fprintf(d.file, "%d,%.6g\n", n, 100 * f->coverage[how][n][i]);
        finish(s, &d, name);
    }
}

/* ---- pictures of shapes ---- */

enum { CELL = 120, LINE = 22, CAPTION = 18 }; // px

static void open_picture(draft *d, double width, double height, const char *title) {
    draft_open(d);
    fprintf(d->file,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
            "viewBox=\"0 0 %.0f %.0f\" font-family=\"sans-serif\" font-size=\"13\">\n"
            "<title>%s</title>\n<style>%s</style>\n"
            "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
            width, height, width, height, title, difference_style);
}

/* A grain with its fit in a square cell whose upper left corner is at (x, y), a caption below. */
static void draw_cell(FILE *file, double x, double y, const outline *reference,
                      const dem2d_vec *points, const char *caption) {
    dem2d_box box = empty_box();
    for (int i = 0; i < reference->count; i++) widen(&box, reference->points[i]);
    for (int i = 0; i < FIT_POINTS; i++) widen(&box, points[i]);
    const double wide = box.upper.x - box.lower.x, high = box.upper.y - box.lower.y;
    frame f = {0, 0, (CELL - 12) / fmax(wide, high)};
    f.left = 0.5 * (box.lower.x + box.upper.x) - (x + 0.5 * CELL) / f.scale;
    f.top = 0.5 * (box.lower.y + box.upper.y) + (y + 0.5 * CELL) / f.scale;
    svg_difference(file, &f, reference->points, reference->count, points, FIT_POINTS);
    fprintf(file, "<text x=\"%.0f\" y=\"%.0f\" text-anchor=\"middle\">%s</text>\n", x + 0.5 * CELL,
            y + CELL + 12, caption);
}

/* Rows of fits with growing numbers: of the least convex grain, A, and the most convex one, B.
 */
static void draw_evolution(const study *s, const fits *f, const char *file, const char *letter,
                           const int numbers[5], way first, way last) {
    const int ways = (int)last - (int)first + 1;
    const double row = LINE + CELL + CAPTION;
    int grains[2] = {0, 0};
    for (int i = 1; i < f->templates; i++) {
        if (f->solidity[i] < f->solidity[grains[0]]) grains[0] = i;
        if (f->solidity[i] > f->solidity[grains[1]]) grains[1] = i;
    }
    draft d;
    open_picture(&d, 5 * CELL, 2 * ways * row + 6, "grains grey, fits blue, difference red");
    for (int k = 0; k < 2 * ways; k++) {
        const outline *reference = &f->outlines.items[grains[k / ways]];
        const way how = (way)((int)first + k % ways);
        fprintf(d.file, "<text x=\"6\" y=\"%.0f\" font-weight=\"bold\">%c: %s</text>\n",
                k * row + 16, "AB"[k / ways], way_texts[how]);
        for (int i = 0; i < 5; i++) {
            dem2d_vec points[FIT_POINTS];
            char caption[64];
            const double coverage = fit(reference, how, numbers[i], points);
            snprintf(caption, sizeof caption, "%s = %d: %.1f %%", letter, numbers[i],
                     100 * coverage);
            draw_cell(d.file, i * CELL, k * row + LINE, reference, points, caption);
        }
    }
    fputs("</svg>\n", d.file);
    finish(s, &d, file);
}

/* All templates with polybeziers of ten arcs. */
static void draw_chart(const study *s, const fits *f) {
    const int rows = (f->templates + 3) / 4;
    draft d;
    open_picture(&d, 4 * CELL, rows * (CELL + CAPTION) + 6, "grains and their polybeziers");
    for (int i = 0; i < f->templates; i++) {
        dem2d_vec points[FIT_POINTS];
        char caption[64];
        const outline *reference = &f->outlines.items[i];
        snprintf(caption, sizeof caption, "%d: %.1f %%", i + 1,
                 100 * fit(reference, AS_BEZIER, BEZIER_ARCS, points));
        draw_cell(d.file, i % 4 * CELL, (double)(i / 4) * (CELL + CAPTION), reference, points,
                  caption);
    }
    fputs("</svg>\n", d.file);
    finish(s, &d, "shapes_chart.svg");
}

/* ---- what is said of shapes ---- */

static double mean_coverage(const fits *f, way how, int count) {
    return 100 * mean(f->coverage[how][count], f->templates);
}

static void report_segments(study *s, const fits *f) {
    page *p = &s->page;
    double least = 100, bezier = 0, polygon = 0, worst = 1;
    for (int i = 0; i < f->templates; i++) worst = fmin(worst, f->coverage[AS_BEZIER][10][i]);
    for (int n = 3; n <= 10; n++) {
        least = fmin(least, mean_coverage(f, AS_BEZIER, n));
        bezier += mean_coverage(f, AS_BEZIER, n) / 8;
        polygon += mean_coverage(f, AS_POLYGON, n) / 8;
    }
    open_figure(p, "Grains as polybeziers of 10 segments (P fig. 7)", "shapes_chart.svg");
    note(p, "accuracy score of 10 segments, mean and least of the grains", "%.1f and %.1f %%",
         mean_coverage(f, AS_BEZIER, 10), 100 * worst);
    close_figure(p);
    open_figure(p, "Accuracy by number of segments (P figs. 8, 9)",
                "p08_accuracy.svg shapes_segments.svg");
    finding(p, "P sec. 5.1", mean_coverage(f, AS_BEZIER, 10) > mean_coverage(f, AS_BEZIER, 3),
            "the accuracy score of polybeziers rises from 3 to 10 segments", "%.1f to %.1f %%",
            mean_coverage(f, AS_BEZIER, 3), mean_coverage(f, AS_BEZIER, 10));
    finding(p, "P sec. 5.1", least >= 90,
            "it is 90 % or higher from 3 to 10 segments; here: the mean of the grains",
            "least mean %.1f %%", least);
    finding(
        p, "P sec. 5.1",
        mean_coverage(f, AS_BEZIER, 10) > mean_coverage(f, AS_POLYGON, 10) && bezier > polygon,
        "polygons need more segments for the same score; here: it is less at 10 segments and in "
        "the mean over 3 to 10",
        "at 10: %.1f against %.1f %%; mean %.1f against %.1f %%", mean_coverage(f, AS_POLYGON, 10),
        mean_coverage(f, AS_BEZIER, 10), polygon, bezier);
    close_figure(p);
}

/* Mean per cent of coverage at an order of the grains that are rounded, or of the others. Rounded:
   Wadell's roundness from 0.49 on, Powers' (1953) limit of that class. NaN if there are none. */
static double class_coverage(const fits *f, way how, int order, bool rounded) {
    double sum = 0, count = 0;
    for (int i = 0; i < f->templates; i++) {
        if ((f->roundness[i] >= 0.49) != rounded) continue;
        sum += 100 * f->coverage[how][order][i];
        count++;
    }
    return sum / count;
}

/* The least order from which on the coverage of a grain is within 0.1 % of that of the highest. */
static int settled_order(const fits *f, int i) {
    int n = MOST;
    while (n > 1 &&
           fabs(f->coverage[AS_REDUCED][n - 1][i] - f->coverage[AS_REDUCED][MOST][i]) < 1e-3)
        n--;
    return n;
}

static void report_orders(study *s, const fits *f) {
    page *p = &s->page;
    const double radial = mean_coverage(f, AS_RADIAL, 8), reduced = mean_coverage(f, AS_REDUCED, 8);
    int early = 0, a = 0, b = 0; // a: the least convex grain, b: the most convex one
    for (int i = 0; i < f->templates; i++) {
        early += settled_order(f, i) <= 8;
        if (f->solidity[i] < f->solidity[a]) a = i;
        if (f->solidity[i] > f->solidity[b]) b = i;
    }
    open_figure(p, "Percent coverage by order of the Fourier series (F figs. 4, 5)",
                "f05_coverage.svg shapes_orders.svg");
    number(p, "F sec. 3.1", "coverage of the new FS at order 8, %; here: of rounded grains", 95.8,
           93.8, 97.8, class_coverage(f, AS_REDUCED, 8, true), (double)NAN);
    note(p, "the same of the grains that are not rounded", "%.1f %%",
         class_coverage(f, AS_REDUCED, 8, false));
    number(p, "F sec. 3.1", "coverage of the original FS at order 8, %", 99.2, 97.2, 100, radial,
           (double)NAN);
    compare(p, "F sec. 3.1", reduced > 95,
            "an average of more than 95 % at order 8; here: all grains", "%.1f %%", reduced);
    finding(p, "F sec. 3.1", radial > reduced,
            "the original FS is slightly above the new one at order 8", "%.1f to %.1f %%", radial,
            reduced);
    finding(p, "F sec. 3.1", reduced > mean_coverage(f, AS_REDUCED, 2),
            "coverage increases with the order", "order 2 to 8: %.1f to %.1f %%",
            mean_coverage(f, AS_REDUCED, 2), reduced);
    finding(p, "F sec. 3.1", early > 0,
            "it stays constant from an order on, for some templates from 8 or less; here: within "
            "0.1 % of that of order 16",
            "%d of %d templates from 8 or less; order 8 to 16: %+.2f %% in the mean", early,
            f->templates, mean_coverage(f, AS_REDUCED, 16) - reduced);
    compare(p, "F sec. 3.1", f->coverage[AS_RADIAL][8][a] > f->coverage[AS_REDUCED][8][a],
            "non-convex template A: the new FS is below the original", "%.1f to %.1f %%",
            100 * f->coverage[AS_REDUCED][8][a], 100 * f->coverage[AS_RADIAL][8][a]);
    compare(
        p, "F sec. 3.1", fabs(f->coverage[AS_RADIAL][8][b] - f->coverage[AS_REDUCED][8][b]) <= 0.02,
        "convex template B: the new FS performs similarly; here: within 2 points at order 8",
        "%.1f to %.1f %%", 100 * f->coverage[AS_REDUCED][8][b], 100 * f->coverage[AS_RADIAL][8][b]);
    note(p,
         "our constrained fit in place of the reduction, order 8: all grains; their convex hulls",
         "%.1f %%; %.2f %%", mean_coverage(f, AS_CONSTRAINED, 8),
         100 * mean(f->convex[AS_CONSTRAINED], f->templates));
    close_figure(p);
}

static void study_shapes(study *s) {
    static const int segments[5] = {3, 4, 6, 8, 10}, orders[5] = {1, 2, 4, 8, 16};
    fits *f = get_memory(NULL, 1, sizeof *f);
    make_fits(f, s->options);
    write_coverage(s, f, "accuracy.csv", AS_BEZIER, AS_POLYGON);
    write_coverage(s, f, "coverage.csv", AS_RADIAL, AS_CONSTRAINED);
    draw_chart(s, f);
    draw_evolution(s, f, "shapes_segments.svg", "N", segments, AS_BEZIER, AS_POLYGON);
    draw_evolution(s, f, "shapes_orders.svg", "N", orders, AS_RADIAL, AS_CONSTRAINED);
    report_segments(s, f);
    report_orders(s, f);
    free_outlines(&f->outlines);
    free(f);
}

/* ---- random packing ---- */

/* The greatest value of a column while a stage lasts, and the last one. */
typedef struct course {
    double greatest, last;
} course;

static course follow(const table *history, const char *name, int stage) {
    course c = {0, (double)NAN};
    for (int i = 0; i < history->rows; i++) {
        if (cell(history, i, "stage") != stage) continue;
        c.last = cell(history, i, name);
        c.greatest = fmax(c.greatest, c.last);
    }
    return c;
}

static const char *with_damping(int damping) {
    return damping == LOCAL ? "local damping" : "global damping";
}

/* A claim with the damping at its end; lives until the next call. */
static const char *claim(const char *text, int damping) {
    static char whole[300];
    snprintf(whole, sizeof whole, "%s (%s)", text, with_damping(damping));
    return whole;
}

static void report_packing(study *s) {
    page *p = &s->page;
    open_figure(p, "Random packing: noncircular, circular, all five models (P fig. 10, F fig. 6a)",
                "noncircular_local/settled.svg circular_local/settled.svg "
                "irregular_local/settled.svg");
    for (int d = 0; d < DAMPINGS; d++)
        note(p,
             d == LOCAL ? "porosity after consolidation, noncircular, circular, all (local damping)"
                        : "the same with global damping",
             "%.3f, %.3f, %.3f", result(s, NONCIRCULAR, d, "porosity_packed"),
             result(s, CIRCULAR, d, "porosity_packed"), result(s, IRREGULAR, d, "porosity_packed"));
    close_figure(p);
    open_figure(p, "Speed and relative kinetic energy while packing (P fig. 11, F fig. 6b)",
                "p11_speed.svg p11_kinetic.svg");
    for (int d = 0; d < DAMPINGS; d++) {
        double speed = 0, ratio = 0;
        for (int set = 0; set < SETS; set++) {
            const table *history = &s->runs[set][d].history;
            const course v = follow(history, "mean_speed", 0);
            speed = fmax(speed, v.last / v.greatest);
            ratio = fmax(ratio, follow(history, "kinetic_ratio", 0).last);
        }
        finding(
            p, d == LOCAL ? "P sec. 5.2.1" : "F sec. 3.2", speed < 0.05 && ratio < 0.01,
            claim("average velocity and relative kinetic energy diminish to small values; here: "
                  "below 5 % of the greatest, and 1 %, in every set",
                  d),
            "%.2g %% and %.2g %%", 100 * speed, 100 * ratio);
    }
    close_figure(p);
}

/* What the ledger of each run is off by, of the energy put in. */
static void report_energy(study *s) {
    page *p = &s->page;
    open_figure(p, "Where the energy went (not in the papers)", "energy.svg");
    for (int set = 0; set < SETS; set++)
        for (int d = 0; d < DAMPINGS; d++) {
            const double closure = result(s, set, d, "ledger_closure");
            char text[100];
            snprintf(text, sizeof text, "the ledger of energies closes to 1e-3, %s",
                     set_names[set]);
            if (d == LOCAL)
                check(p, fabs(closure) <= 1e-3, claim(text, d), "%.2g of the energy put in",
                      closure);
            else /* contacts ring on, each swing in 16 steps: an error of these long steps */
                note(p, claim(text, d), "%.2g of the energy put in", closure);
        }
    close_figure(p);
}

/* A polar diagram for gnuplot: 36 sectors, angle in degrees and one radius for each name, so that
   their outlines are drawn; values[k] belongs to name k. */
enum { BINS = 36 };

static void write_polar(const study *s, const char *file, int count, const char *const *names,
                        double values[][BINS]) {
    draft d;
    draft_open(&d);
    fputs("angle", d.file);
    for (int k = 0; k < count; k++) fprintf(d.file, ",%s", names[k]);
    for (int i = 0; i < BINS; i++) {
        for (int corner = 0; corner < 8; corner++) { // the middle, seven on the arc
            fprintf(d.file, "\n%.9g", 10.0 * i + (corner < 1 ? 0 : (corner - 1) * 10.0 / 6));
            for (int k = 0; k < count; k++)
                fprintf(d.file, ",%.9g", corner == 0 ? 0.0 : values[k][i]);
        }
    }
    fputs("\n360,", d.file);
    for (int k = 0; k < count; k++) fprintf(d.file, "%s0", k > 0 ? "," : "");
    fputc('\n', d.file);
    finish(s, &d, file);
}

/* Column of a table of histograms, as parts of its sum in per cent. */
static void read_parts(const table *t, const char *name, double parts[BINS]) {
    double sum = 0;
    for (int i = 0; i < BINS; i++) sum += cell(t, i, name);
    for (int i = 0; i < BINS; i++) parts[i] = 100 * cell(t, i, name) / sum;
}

/* Of directions in 36 parts of half a turn: coefficient and angle (degrees) of the anisotropy, and
   the part within 45 degrees of the horizontal. */
typedef struct alignment {
    double coefficient, angle, flat;
} alignment;

static alignment read_alignment(const table *t) {
    alignment a = {0, 0, 0};
    double parts[BINS], c = 0, w = 0;
    read_parts(t, "orientation", parts);
    for (int i = 0; i < BINS; i++) {
        const dem2d_rot twice = dem2d_rot_make(2 * PI * (i + 0.5) / BINS);
        c += 2 * parts[i] * twice.c / 100;
        w += 2 * parts[i] * twice.s / 100;
        if (twice.c > 0) a.flat += parts[i];
    }
    const dem2d_rot sum = {c, w};
    a.coefficient = sqrt(c * c + w * w);
    a.angle = 90 / PI * dem2d_rot_angle(sum);
    return a;
}

static void report_alignment(study *s) {
    static const char *const names[] = {"noncircular", "irregular"};
    static const int sets[] = {NONCIRCULAR, IRREGULAR};
    page *p = &s->page;
    double values[2][BINS];
    open_figure(p, "Directions of long axes after packing (P fig. 12)", "p12_alignment.svg");
    for (int k = 0; k < 2; k++) {
        double parts[BINS];
        read_parts(&s->runs[sets[k]][LOCAL].settled, "orientation", parts);
        for (int i = 0; i < BINS / 2; i++) // 10 degrees each, and once more half a turn on
            values[k][i] = values[k][i + BINS / 2] = parts[2 * i] + parts[2 * i + 1];
    }
    write_polar(s, "alignment.csv", 2, names, values);
    for (int d = 0; d < DAMPINGS; d++) {
        const alignment a = read_alignment(&s->runs[NONCIRCULAR][d].settled);
        finding(
            p, "P sec. 5.2.1", fabs(a.angle) <= 22.5 && a.flat > 55,
            claim("alignment: a preference for the horizontal; here: the anisotropy points "
                  "within 22.5 degrees of it, more than 55 % of the long axes within 45 degrees",
                  d),
            "%.1f degrees (coefficient %.2f), %.1f %%", a.angle, a.coefficient, a.flat);
    }
    close_figure(p);
}

/* Per cent of the grains with low to high contacts. */
static double coordination_share(const table *t, int low, int high) {
    double parts[BINS], sum = 0;
    read_parts(t, "coordination", parts);
    for (int i = low; i <= high; i++) sum += parts[i];
    return sum;
}

static void write_coordination(const study *s) {
    draft d;
    double parts[SETS][BINS];
    draft_open(&d);
    fputs("contacts,irregular,noncircular,circular", d.file);
    for (int set = 0; set < SETS; set++)
        read_parts(&s->runs[set][LOCAL].settled, "coordination", parts[set]);
    for (int i = 0; i <= 8; i++)
        fprintf(d.file, "\n%d,%.6g,%.6g,%.6g", i, parts[0][i], parts[1][i], parts[2][i]);
    fputc('\n', d.file);
    finish(s, &d, "coordination.csv");
}

static void report_coordination(study *s) {
    page *p = &s->page;
    write_coordination(s);
    open_figure(p, "Contacts per grain after packing (P fig. 13)", "p13_coordination.svg");
    for (int d = 0; d < DAMPINGS; d++) {
        const double circular = result(s, CIRCULAR, d, "coordination_settled");
        const double noncircular = result(s, NONCIRCULAR, d, "coordination_settled");
        finding(p, "P sec. 5.2.1", noncircular > circular,
                claim("noncircular particles have slightly more contacts than circular ones", d),
                "%.2f to %.2f (all five models: %.2f)", noncircular, circular,
                result(s, IRREGULAR, d, "coordination_settled"));
    }
    const table *noncircular = &s->runs[NONCIRCULAR][LOCAL].settled;
    const table *circular = &s->runs[CIRCULAR][LOCAL].settled;
    const table *both[2] = {noncircular, circular};
    for (int i = 0; i < 2; i++)
        compare(p, "P sec. 5.2.1", coordination_share(both[i], 1, 6) >= 98,
                i == 0
                    ? "the coordination number ranges from 1 to 6, noncircular; here: of 98 % of "
                      "the grains"
                    : "the same, circular",
                "%.1f %%; 0: %.1f %%, 7 and more: %.1f %%", coordination_share(both[i], 1, 6),
                coordination_share(both[i], 0, 0), coordination_share(both[i], 7, BINS - 1));
    finding(p, "P sec. 5.2.1", coordination_share(noncircular, 3, 5) > 50,
            "of noncircular particles it is mostly 3, 4 or 5; here: of more than half", "%.1f %%",
            coordination_share(noncircular, 3, 5));
    finding(p, "P sec. 5.2.1", coordination_share(circular, 3, 4) > 50,
            "of circular ones mostly 3 or 4", "%.1f %%", coordination_share(circular, 3, 4));
    close_figure(p);
}

/* ---- GJK and EPA ---- */

enum { CALLS = 16, RESIDUALS = 30 };

typedef struct tally {
    double pairs, calls;
    double histogram[CALLS]; // pairs with so many calls; the last: or more
} tally;

static double mean_calls(const tally *t) {
    return t->pairs > 0 ? t->calls / t->pairs : (double)NAN;
}

/* Pairs of a set, of the runs with both dampings. */
static table read_pairs(const study *s, int set) {
    const table *one = &s->runs[set][LOCAL].pairs, *other = &s->runs[set][GLOBAL].pairs;
    const size_t columns = (size_t)one->columns, have = columns * (size_t)one->rows;
    const size_t extra = columns * (size_t)other->rows;
    if (columns == 0 || one->columns != other->columns)
        fail(STATUS_BAD_INPUT, "two pairs.csv are missing or do not match");
    table t = {one->rows + other->rows, 0, NULL, NULL};
    for (int i = 0; i < one->columns; i++) add_name(&t, one->names[i], strlen(one->names[i]));
    t.values = get_memory(NULL, have + extra, sizeof *t.values);
    memcpy(t.values, one->values, have * sizeof *t.values);
    memcpy(t.values + have, other->values, extra * sizeof *t.values);
    return t;
}

/* Of pairs of two types in any order (negative: any type), in contact or not (-1: both). */
static tally count_calls(const table *pairs, int type, int other, int contact) {
    tally t = {0};
    for (int i = 0; i < pairs->rows; i++) {
        const int a = (int)cell(pairs, i, "a"), b = (int)cell(pairs, i, "b");
        const int calls = (int)cell(pairs, i, "calls");
        if (type >= 0 && !((a == type && b == other) || (a == other && b == type))) continue;
        if (contact >= 0 && cell(pairs, i, "contact") != contact) continue;
        t.pairs++;
        t.calls += calls;
        t.histogram[calls < CALLS ? calls : CALLS - 1]++;
    }
    return t;
}

static void write_calls(const study *s, const char *file, const table *pairs, int type) {
    const tally none = count_calls(pairs, type, type, 0), touch = count_calls(pairs, type, type, 1);
    draft d;
    draft_open(&d);
    fputs("calls,none,contact", d.file);
    for (int i = 0; i < CALLS; i++)
        fprintf(d.file, "\n%d,%.6g,%.6g", i,
                none.pairs > 0 ? 100 * none.histogram[i] / none.pairs : 0,
                touch.pairs > 0 ? 100 * touch.histogram[i] / touch.pairs : 0);
    fputc('\n', d.file);
    finish(s, &d, file);
}

static double calls_of(const table *pairs, int type, int other, int contact) {
    if (pairs->rows == 0) return (double)NAN;
    const tally t = count_calls(pairs, type, other, contact);
    return mean_calls(&t);
}

/* A number of calls: within 20 % of the paper's. */
static void judge_calls(page *p, const char *source, const char *claim, double paper, double here,
                        double papers_mode) {
    number(p, source, claim, paper, 0.8 * paper, 1.2 * paper, here, papers_mode);
}

/* The entries of a paper's table of mean calls, pairs in contact and others together. */
static void judge_table(page *p, const char *source, const table *here, const table *papers_mode,
                        int count, const int *types, const double *paper) {
    static const char *const names[] = {"circle", "ellipse", "polygon", "polybezier", "FS"};
    for (int i = 0; i < count; i++)
        for (int k = i; k < count; k++) {
            char text[80];
            snprintf(text, sizeof text, "calls, %s and %s", names[types[i]], names[types[k]]);
            judge_calls(p, source, text, paper[i * count + k],
                        calls_of(here, types[i], types[k], -1),
                        calls_of(papers_mode, types[i], types[k], -1));
        }
}

/* Polygons take the fewest calls of the pairs of one type. */
static void compare_polygons(page *p, const char *source, const table *pairs, int count,
                             const int *types) {
    const double polygons = calls_of(pairs, DEM2D_POLYGON, DEM2D_POLYGON, -1);
    double least = HUGE_VAL;
    for (int i = 0; i < count; i++)
        if (types[i] != DEM2D_POLYGON) least = fmin(least, calls_of(pairs, types[i], types[i], -1));
    compare(p, source, polygons < least, "polygons take the fewest calls; here: of like pairs",
            "%.2f, least of the others %.2f", polygons, least);
}

/* Of all near pairs those in contact, per cent. */
static double contact_share(const table *pairs) {
    const tally touch = count_calls(pairs, -1, -1, 1), all = count_calls(pairs, -1, -1, -1);
    return 100 * touch.pairs / all.pairs;
}

static void report_p_calls(study *s) {
    static const int types[] = {DEM2D_ELLIPSE, DEM2D_POLYGON, DEM2D_BEZIER};
    static const double printed[] = {5.33, 4.48, 5.72, 0, 2.64, 3.96, 0, 0, 4.99};
    page *p = &s->page;
    const table *here = &s->runs[NONCIRCULAR][LOCAL].pairs, *papers = &s->papers[OF_P].pairs;
    const tally none = count_calls(here, -1, -1, 0);
    write_calls(s, "calls_noncircular.csv", here, -1);
    open_figure(p, "Support calls of GJK in one step, near pairs of noncircular grains (P fig. 14)",
                "p14_calls.svg");
    finding(p, "P sec. 5.2.2", calls_of(here, -1, -1, 1) > calls_of(here, -1, -1, 0),
            "pairs in contact take more calls than others", "%.2f to %.2f",
            calls_of(here, -1, -1, 1), calls_of(here, -1, -1, 0));
    judge_calls(p, "P sec. 5.2.2", "calls of pairs in contact", 5.77, calls_of(here, -1, -1, 1),
                calls_of(papers, -1, -1, 1));
    judge_calls(p, "P sec. 5.2.2", "calls of pairs that are not", 1.85, calls_of(here, -1, -1, 0),
                calls_of(papers, -1, -1, 0));
    finding(p, "P sec. 5.2.2", none.histogram[1] > 0.5 * none.pairs,
            "most pairs without contact are pruned in one iteration", "%.1f %%",
            100 * none.histogram[1] / none.pairs);
    note(p,
         "pairs in contact of all near pairs; P's averages, if its six entries weigh the same, "
         "need 68 %",
         "%.0f %%", contact_share(here));
    judge_table(p, "P table 1", here, papers, 3, types, printed);
    compare_polygons(p, "P sec. 5.2.2", here, 3, types);
    close_figure(p);
}

static void report_f_calls(study *s) {
    static const int types[] = {DEM2D_FOURIER, DEM2D_CIRCLE, DEM2D_ELLIPSE, DEM2D_POLYGON,
                                DEM2D_BEZIER};
    static const double printed[] = {4.63, 5.51, 5.51, 4.34, 5.46, 0,    3.00, 6.04, 4.52,
                                     5.52, 0,    0,    5.20, 4.35, 5.45, 0,    0,    0,
                                     2.91, 3.92, 0,    0,    0,    0,    5.10};
    page *p = &s->page;
    const table *here = &s->pairs[IRREGULAR], *papers = &s->papers[OF_F].pairs;
    write_calls(s, "calls_fs.csv", here, DEM2D_FOURIER);
    write_calls(s, "calls_polygon.csv", here, DEM2D_POLYGON);
    write_calls(s, "calls_bezier.csv", here, DEM2D_BEZIER);
    open_figure(p, "Support calls of GJK for pairs of one model (F fig. 8, left)",
                "f08_calls_fs.svg f08_calls_polygon.svg f08_calls_bezier.svg");
    finding(p, "F sec. 3.2", calls_of(here, -1, -1, 1) > calls_of(here, -1, -1, 0),
            "pairs in contact take more calls than others", "%.2f to %.2f",
            calls_of(here, -1, -1, 1), calls_of(here, -1, -1, 0));
    judge_calls(p, "F sec. 3.2", "calls, FS and FS in contact", 6.4,
                calls_of(here, DEM2D_FOURIER, DEM2D_FOURIER, 1),
                calls_of(papers, DEM2D_FOURIER, DEM2D_FOURIER, 1));
    judge_calls(p, "F sec. 3.2", "calls, FS and FS without contact", 1.0,
                calls_of(here, DEM2D_FOURIER, DEM2D_FOURIER, 0),
                calls_of(papers, DEM2D_FOURIER, DEM2D_FOURIER, 0));
    judge_table(p, "F table 1", here, papers, 5, types, printed);
    compare_polygons(p, "F sec. 3.2", here, 5, types);
    const double fs = calls_of(here, DEM2D_FOURIER, DEM2D_FOURIER, -1);
    const double bezier = calls_of(here, DEM2D_BEZIER, DEM2D_BEZIER, -1);
    compare(p, "F sec. 3.2", fabs(fs / bezier - 1) <= 0.2,
            "FS take about as many calls as polybeziers; here: like pairs within 20 %",
            "%.2f and %.2f", fs, bezier);
    close_figure(p);
}

/* Residual after k iterations over the pair's size; NaN before EPA has begun. */
static double residual(const table *pairs, int row, int k) {
    return pairs->values[row * pairs->columns + 4 + k] / pairs->values[row * pairs->columns + 4];
}

static bool is_like_contact(const table *pairs, int row, int type) {
    return cell(pairs, row, "contact") == 1 && cell(pairs, row, "a") == type &&
           cell(pairs, row, "b") == type;
}

/* The curves of all pairs of one type in contact, with empty lines between; and their medians. */
static void write_profiles(const study *s, const char *name, const table *pairs, int type) {
    char file[60];
    double *values = get_memory(NULL, (size_t)pairs->rows, sizeof *values);
    draft d;
    draft_open(&d);
    fputs("iteration,residual\n", d.file);
    for (int i = 0; i < pairs->rows; i++) {
        if (!is_like_contact(pairs, i, type)) continue;
        for (int k = 1; k <= RESIDUALS; k++)
            if (residual(pairs, i, k) > 0) fprintf(d.file, "%d,%.6g\n", k, residual(pairs, i, k));
        fputc('\n', d.file);
    }
    snprintf(file, sizeof file, "epa_%s.csv", name);
    finish(s, &d, file);
    draft_open(&d);
    fputs("iteration,median\n", d.file);
    for (int k = 1; k <= RESIDUALS; k++) {
        int count = 0;
        for (int i = 0; i < pairs->rows; i++)
            if (is_like_contact(pairs, i, type) && residual(pairs, i, k) >= 0)
                values[count++] = residual(pairs, i, k);
        if (count == 0) continue;
        const double middle = median(values, count);
        if (middle > 0) fprintf(d.file, "%d,%.6g\n", k, middle);
    }
    snprintf(file, sizeof file, "epa_%s_median.csv", name);
    finish(s, &d, file);
    free(values);
}

/* Geometric mean, over pairs of a type in contact, of the factor by which the residual falls in ten
   iterations, as a power of ten: from the first one of EPA to the tenth after it, or to the last
   that is above rounding, in proportion. */
static double ten_iterations(const table *pairs, int type) {
    double sum = 0;
    int count = 0;
    for (int i = 0; i < pairs->rows; i++) {
        int first = 1;
        if (!is_like_contact(pairs, i, type)) continue;
        while (first < RESIDUALS && !(residual(pairs, i, first) > 0)) first++;
        int last = first;
        while (last < RESIDUALS && last < first + 10 && residual(pairs, i, last + 1) > 1e-14)
            last++;
        if (last < first + 3) continue; // too few to tell a slope
        sum += 10 * log10(residual(pairs, i, first) / residual(pairs, i, last)) / (last - first);
        count++;
    }
    return count > 0 ? sum / count : (double)NAN;
}

/* Curves with a residual above the one before, and above rounding. */
static int count_rises(const table *pairs, int type) {
    int count = 0;
    for (int i = 0; i < pairs->rows; i++) {
        int k = 1;
        if (!is_like_contact(pairs, i, type)) continue;
        while (k < RESIDUALS && !(residual(pairs, i, k + 1) > residual(pairs, i, k) &&
                                  residual(pairs, i, k + 1) > 1e-12))
            k++;
        count += k < RESIDUALS;
    }
    return count;
}

static void report_epa(study *s) {
    page *p = &s->page;
    const table *noncircular = &s->pairs[NONCIRCULAR], *all = &s->pairs[IRREGULAR];
    const table *p_mode = &s->papers[OF_P].pairs, *f_mode = &s->papers[OF_F].pairs;
    const double slope = ten_iterations(noncircular, DEM2D_BEZIER);
    write_profiles(s, "bezier", noncircular, DEM2D_BEZIER);
    write_profiles(s, "fs", all, DEM2D_FOURIER);
    write_profiles(s, "polygon", all, DEM2D_POLYGON);
    open_figure(p,
                "Convergence of EPA: |W| less the least distance of an edge (P fig. 15, F fig. 8)",
                "p15_epa_bezier.svg f08_epa_fs.svg f08_epa_polygon.svg");
    number(p, "P sec. 5.2.2",
           "powers of ten that the residual of polybeziers falls by in 10 iterations", 6, 5, 7,
           slope, p_mode->rows > 0 ? ten_iterations(p_mode, DEM2D_BEZIER) : (double)NAN);
    number(p, "P sec. 5.2.2", "what is left of it after one iteration", 0.25, 0.2, 0.3125,
           pow(10, -slope / 10),
           p_mode->rows > 0 ? pow(10, -ten_iterations(p_mode, DEM2D_BEZIER) / 10) : (double)NAN);
    number(p, "F sec. 3.2", "powers of ten that the residual of FS falls by in 10 iterations", 6, 5,
           7, ten_iterations(all, DEM2D_FOURIER),
           f_mode->rows > 0 ? ten_iterations(f_mode, DEM2D_FOURIER) : (double)NAN);
    finding(p, "P sec. 5.2.2", count_rises(noncircular, DEM2D_BEZIER) > 0,
            "the residual does not decrease monotonically",
            "%d curves of polybeziers rise somewhere", count_rises(noncircular, DEM2D_BEZIER));
    note(
        p,
        "where two polygons meet at an edge, |W| less its distance does not vanish; EPA ends there "
        "all the same, by W.v less the distance",
        "see the right figure");
    close_figure(p);
}

/* ---- biaxial compression ---- */

/* Mean of a column over the rows of the compression with an axial strain from low to high. */
static double mean_between(const table *history, const char *name, double low, double high) {
    double sum = 0, count = 0;
    for (int i = 0; i < history->rows; i++) {
        const double strain = cell(history, i, "axial_strain");
        if (cell(history, i, "stage") != 2 || strain < low || strain > high) continue;
        sum += cell(history, i, name);
        count++;
    }
    return sum / count;
}

static double final_strain(const study *s, int set, int damping) {
    return result(s, set, damping, "axial_strain_final");
}

static void report_chains(study *s) {
    page *p = &s->page;
    open_figure(p, "Force chains after compression: noncircular, circular, all (P fig. 16)",
                "noncircular_local/final.svg circular_local/final.svg irregular_local/final.svg");
    for (int d = 0; d < DAMPINGS; d++) {
        double worst = 0, least = HUGE_VAL;
        for (int set = 0; set < SETS; set++) {
            const double angle = fabs(result(s, set, d, "direction_normal_forces"));
            worst = fmax(worst, fabs(90 - angle));
            least = fmin(least, result(s, set, d, "anisotropy_normal_forces"));
        }
        finding(
            p, "P sec. 5.3", worst <= 15 && least > 0,
            claim("strong force chains in the vertical direction; here: the anisotropy of normal "
                  "forces is positive and within 15 degrees of it, in every set",
                  d),
            "%.1f degrees at most, coefficient %.2f at least", worst, least);
    }
    close_figure(p);
}

/* Mean stress ratio of the second half of a run's strain. */
static double late_ratio(const run *r) {
    const double end = cell(&r->results, 0, "axial_strain_final");
    return mean_between(&r->history, "stress_ratio", end / 2, 2 * end);
}

/* The volumetric strain of a run: at the end, the greatest, and the axial strain there, %. */
typedef struct volume {
    double end, most, strain;
} volume;

static volume volume_of(const run *r) {
    volume v = {0, -HUGE_VAL, 0};
    for (int i = 0; i < r->history.rows; i++) {
        if (cell(&r->history, i, "stage") != 2) continue;
        v.end = 100 * cell(&r->history, i, "volumetric_strain");
        if (v.end <= v.most) continue;
        v.most = v.end;
        v.strain = 100 * cell(&r->history, i, "axial_strain");
    }
    return v;
}

/* Rises until the last twentieth of the strain. */
static bool rises_throughout(const run *r) {
    const volume v = volume_of(r);
    return v.strain >= 95 * cell(&r->results, 0, "axial_strain_final");
}

static void report_plateau(page *p, const study *s, int set, int d) {
    const double six = final_strain(s, set, d) * 6 / 16;
    const double there =
        mean_between(&s->runs[set][d].history, "stress_ratio", 5.0 / 6 * six, 7.0 / 6 * six);
    const double late = late_ratio(&s->runs[set][d]);
    char text[200];
    snprintf(
        text, sizeof text,
        "q/p increases until an axial strain of 6 %% and then almost plateaus; here: there 0.8 "
        "to 1.25 of its mean over the second half, %s",
        set_names[set]);
    finding(p, "F sec. 3.2", there / late >= 0.8 && there / late <= 1.25, claim(text, d),
            "%.2f, at a strain of %.1f %%", there / late, 100 * six);
}

static void report_strength(study *s) {
    page *p = &s->page;
    open_figure(p, "Stress ratio and volumetric strain (P fig. 17, F fig. 7b)",
                s->papers[OF_P].there ? "p17_ratio.svg p17_volume.svg p17_papers.svg f07_papers.svg"
                                      : "p17_ratio.svg p17_volume.svg");
    for (int d = 0; d < DAMPINGS; d++) {
        const double circular = late_ratio(&s->runs[CIRCULAR][d]);
        const double noncircular = late_ratio(&s->runs[NONCIRCULAR][d]);
        finding(
            p, "P sec. 5.3", noncircular > circular,
            claim("noncircular particles have a larger shear strength than circular ones; here: "
                  "q/p over the second half",
                  d),
            "%.3f to %.3f (all five models: %.3f)", noncircular, circular,
            late_ratio(&s->runs[IRREGULAR][d]));
    }
    for (int i = 0; i < SETS * DAMPINGS; i++) report_plateau(p, s, i / DAMPINGS, i % DAMPINGS);
    for (int d = 0; d < DAMPINGS; d++) {
        const int set = d == LOCAL ? NONCIRCULAR : IRREGULAR;
        const double paper = d == LOCAL ? 15 : 16;
        number(p, d == LOCAL ? "P sec. 5.3" : "F sec. 3.2",
               "final axial strain, about, %; here: engineering, 1 - H/H0", paper, paper - 1,
               paper + 1, 100 * result(s, set, d, "axial_strain_final_engineering"),
               100 * paper_result(s, d == LOCAL ? OF_P : OF_F, "axial_strain_final_engineering"));
        note(p, claim("the same as a logarithm, the strain of P's formula", d), "%.1f %%",
             100 * final_strain(s, set, d));
    }
    const run *f_run = s->papers[OF_F].there ? &s->papers[OF_F] : &s->runs[IRREGULAR][GLOBAL];
    const volume v = volume_of(f_run);
    compare(p, "F sec. 3.2", rises_throughout(f_run),
            "the volumetric strain increases gradually during the whole compression",
            "greatest %+.2f %% at an axial strain of %.1f %%, %+.2f %% at the end", v.most,
            v.strain, v.end);
    close_figure(p);
}

/* What the papers leave open of the stages after settling, noncircular grains, local damping. */
static void report_stages(study *s) {
    static const char *const names[STAGES + 1] = {"smooth walls, no gravity (default)",
                                                  "friction 0.2 at the walls", "gravity", "both",
                                                  "contacts ten times softer"};
    page *p = &s->page;
    if (!s->stages[0].there) return;
    open_figure(
        p,
        "What decides the volumetric strain: walls and gravity after settling, which P sec. "
        "5.3 and F sec. 3.2 leave open, and stiffness",
        "");
    for (int i = 0; i <= STAGES; i++) {
        const run *r = i == 0 ? &s->runs[NONCIRCULAR][LOCAL] : &s->stages[i - 1];
        const volume v = volume_of(r);
        note(
            p, names[i],
            "q/p by the walls %.3f over the second half, by the contacts %.3f at the end; porosity "
            "%.4f; strain %.2f %% (engineering), volumetric %+.2f %% at the end, greatest %+.2f %% "
            "at %.1f %%",
            late_ratio(r), cell(&r->results, 0, "final_stress_ratio"),
            cell(&r->results, 0, "porosity_packed"),
            100 * cell(&r->results, 0, "axial_strain_final_engineering"), v.end, v.most, v.strain);
    }
    close_figure(p);
}

static void report_stresses(study *s) {
    page *p = &s->page;
    open_figure(p, "Axial and lateral stress in time (F fig. 7a)", "f07_stress.svg");
    for (int d = 0; d < DAMPINGS; d++) {
        double mean_error = 0, axial_error = 0;
        for (int set = 0; set < SETS; set++) {
            const double lateral = result(s, set, d, "lateral_stress_mean_kpa");
            const double axial = follow(&s->runs[set][d].history, "axial_stress", 1).last / 1000;
            mean_error = fmax(mean_error, fabs(lateral - 100));
            axial_error = fmax(axial_error, fabs(axial - 100));
        }
        finding(p, "F sec. 3.2", mean_error <= 0.5,
                claim("the lateral stress is maintained at 100 kPa; here: its mean within 0.5 % in "
                      "every set",
                      d),
                "error at most %.3f %%", mean_error);
        finding(
            p, "F sec. 3.2", axial_error <= 5,
            claim("the axial stress is 100 kPa in the first second; here: at its end within 5 % "
                  "in every set",
                  d),
            "error at most %.3f %%", axial_error);
        note(p, claim("greatest error of the lateral stress in any one step, all five models", d),
             "%.2f %%", result(s, IRREGULAR, d, "lateral_stress_max_error_percent"));
    }
    close_figure(p);
}

/* ---- anisotropy ---- */

static void write_anisotropy(const study *s) {
    static const char *const files[] = {"polar_normals.csv", "polar_branches.csv",
                                        "polar_forces.csv", "polar_shear.csv"};
    static const char *const columns[] = {"normal", "branch_direction", "normal_force",
                                          "tangential_force"};
    for (int k = 0; k < 4; k++) {
        double values[SETS][BINS];
        for (int set = 0; set < SETS; set++) {
            const table *t = &s->runs[set][LOCAL].final;
            if (k <= 1) read_parts(t, columns[k], values[set]);
            for (int i = 0; k > 1 && i < BINS; i++) // kN/m
                values[set][i] = fabs(cell(t, i, columns[k])) / 1000;
        }
        write_polar(s, files[k], SETS, set_names, values);
    }
}

static void find_order(study *s, const char *text, const char *name, const char *unit) {
    for (int d = 0; d < DAMPINGS; d++) {
        const double noncircular = result(s, NONCIRCULAR, d, name);
        const double circular = result(s, CIRCULAR, d, name);
        finding(&s->page, "P sec. 5.3", noncircular > circular, claim(text, d), "%.4g to %.4g%s",
                noncircular, circular, unit);
    }
}

/* A row for each run. */
static void put_runs(const study *s) {
    static const char *const names[] = {"coordination_settled",     "coordination_number",
                                        "porosity_packed",          "anisotropy_normals",
                                        "anisotropy_normal_forces", "anisotropy_shear_forces",
                                        "anisotropy_branches",      "final_stress_ratio_foretold",
                                        "final_stress_ratio",       "mean_normal_force",
                                        "mean_shear_force",         "axial_strain_final"};
    static const char *const heads[] = {"contacts, settled",
                                        "packed",
                                        "porosity",
                                        "a_c",
                                        "a_n",
                                        "a_t",
                                        "a_b",
                                        "(a_c + a_n + a_t + a_b)/2",
                                        "q/p at the end",
                                        "q/p, branches along normals",
                                        "f_n, N/m",
                                        "f_t, N/m",
                                        "strain"};
    const int count = (int)(sizeof names / sizeof names[0]);
    FILE *file = s->page.body.file;
    fputs("</ul><div class=\"wide\"><table><tr><th>run", file);
    for (int i = 0; i < count; i++) fprintf(file, "<th>%s", heads[i]);
    for (int set = 0; set < SETS; set++) {
        for (int d = 0; d < DAMPINGS; d++) {
            fprintf(file, "\n<tr><th>%s, %s", set_names[set], damping_names[d]);
            for (int i = 0; i < count; i++) fprintf(file, "<td>%.3g", result(s, set, d, names[i]));
        }
    }
    fputs("\n</table></div><ul>\n", file);
}

static void report_anisotropy(study *s) {
    page *p = &s->page;
    write_anisotropy(s);
    open_figure(
        p,
        "Contact normals, contact branch orientation, normal forces and shear forces at the "
        "end (P fig. 18)",
        "p18_normals.svg p18_branches.svg p18_forces.svg p18_shear.svg");
    find_order(s,
               "contact normals are more elongated in the vertical direction for noncircular "
               "particles; here: a_c",
               "anisotropy_normals", "");
    find_order(s, "so are normal forces: a_n", "anisotropy_normal_forces", "");
    find_order(s,
               "noncircular particles have the greater contact shear forces; here: their mean size",
               "mean_shear_force", " N/m");
    for (int set = 0; set < SETS; set++) {
        for (int d = 0; d < DAMPINGS; d++) {
            const double foretold = result(s, set, d, "final_stress_ratio_foretold");
            const double ratio = result(s, set, d, "final_stress_ratio");
            char text[100];
            snprintf(text, sizeof text, "(a_c + a_n + a_t + a_b + a_bt)/2 is q/p within 20 %%, %s",
                     set_names[set]);
            check(p, fabs(foretold / ratio - 1) <= 0.2, claim(text, d), "%.3f to %.3f", foretold,
                  ratio);
        }
    }
    put_runs(s);
    close_figure(p);
}

static void report_runs(study *s) {
    page *p = &s->page;
    open_figure(p, "The runs", "");
    for (int set = 0; set < SETS; set++)
        for (int d = 0; d < DAMPINGS; d++)
            check(p, result(s, set, d, "exit_status") == 0, claim("biaxial's own checks hold", d),
                  "%s: exit status %.0f, %.0f steps", set_names[set],
                  result(s, set, d, "exit_status"), result(s, set, d, "steps"));
    close_figure(p);
}

/* ---- the models ---- */

/* A custom support function: a stadium, a segment with a disc at each end. */
static dem2d_vec stadium(void *user, dem2d_vec direction, double *rho) {
    const dem2d_vec point = {0.5 * direction.x + (direction.x > 0 ? 0.5 : -0.5), 0.5 * direction.y};
    (void)user;
    if (rho != NULL) *rho = 0.5;
    return point;
}

enum { MODELS = 7 };

static void make_models(dem2d_shape *shapes[MODELS]) {
    const dem2d_vec corners[5] = {{-0.9, -0.5}, {0.2, -0.8}, {0.9, -0.1}, {0.5, 0.7}, {-0.6, 0.6}};
    dem2d_vec inner[5];
    outline_list list = {NULL, 0};
    dem2d_custom_desc custom = {0};
    const dem2d_env *env = example_env();
    for (int i = 0; i < 5; i++) {
        inner[i].x = 0.75 * corners[i].x;
        inner[i].y = 0.75 * corners[i].y;
    }
    for (int i = 0; i < SELF_MADE; i++) list_self_made(&list, i);
    custom.support = stadium;
    custom.rho_min = custom.inscribed = 0.5;
    must(dem2d_shape_create_circle(env, 1, &shapes[0]), "circle");
    must(dem2d_shape_create_ellipse(env, 1, 0.6, &shapes[1]), "ellipse");
    must(dem2d_shape_create_polygon(env, corners, 5, 0, &shapes[2]), "polygon");
    must(dem2d_shape_create_polygon(env, inner, 5, 0.25, &shapes[3]), "rounded polygon");
    shapes[4] = fitted_template(&list.items[2], DEM2D_BEZIER, BEZIER_ARCS, DEM2D_FIT_DEFAULT, NULL);
    shapes[5] =
        fitted_template(&list.items[1], DEM2D_FOURIER, FOURIER_ORDER, DEM2D_FIT_DEFAULT, NULL);
    must(dem2d_shape_create_custom(env, &custom, &shapes[6]), "custom shape");
    free_outlines(&list);
}

static void draw_models(const char *path) {
    static const char *const captions[MODELS] = {
        "circle", "ellipse", "polygon", "rounded", "polybezier", "Fourier series", "custom"};
    static const char *const colours[MODELS] = {"#e8c468", "#8fb9d8", "#b9a3d6", "#b9a3d6",
                                                "#94c99b", "#e59a83", "#c9c9c9"};
    dem2d_shape *shapes[MODELS];
    draft d;
    make_models(shapes);
    open_picture(&d, MODELS * CELL, CELL + CAPTION + 6, "the shape models");
    for (int i = 0; i < MODELS; i++) {
        dem2d_vec points[60];
        dem2d_shape_info info;
        must(dem2d_shape_get(shapes[i], &info), "shape");
        const dem2d_pose pose = dem2d_pose_make(0, 0, 0, 0.85 / info.equivalent); // of one area
        must(dem2d_shape_outline(shapes[i], pose, 60, points), "outline");
        const frame f = {-(i + 0.5) * CELL / 50, 0.5 * CELL / 50, 50};
        fprintf(d.file, "<path fill=\"%s\" stroke=\"#333\" d=\"", colours[i]);
        svg_path(d.file, &f, points, 60);
        fprintf(d.file, "\"/>\n<text x=\"%.0f\" y=\"%d\" text-anchor=\"middle\">%s</text>\n",
                (i + 0.5) * CELL, CELL + 12, captions[i]);
        dem2d_shape_destroy(shapes[i]);
    }
    fputs("</svg>\n", d.file);
    draft_write(&d, path);
}

int main(int count, char **arguments) {
    example_name = "figures";
    const options o = parse_options(count, arguments);
    if (o.models != NULL) {
        draw_models(o.models);
        return STATUS_OK;
    }
    study *s = get_memory(NULL, 1, sizeof *s);
    memset(s, 0, sizeof *s);
    s->options = &o;
    catch_interrupt();
    read_runs(s);
    s->pairs[IRREGULAR] = read_pairs(s, IRREGULAR);
    s->pairs[NONCIRCULAR] = read_pairs(s, NONCIRCULAR);
    draft_open(&s->page.body);
    draft_open(&s->page.rows);
    draft_open(&s->page.failures);
    study_shapes(s);
    report_packing(s);
    report_energy(s);
    report_alignment(s);
    report_coordination(s);
    report_p_calls(s);
    report_f_calls(s);
    report_epa(s);
    report_chains(s);
    report_strength(s);
    report_stages(s);
    report_stresses(s);
    report_anisotropy(s);
    report_runs(s);
    char *path = join_text(o.folder, "/", "figures.html");
    write_page(&s->page, path, o.quick);
    const int failed = s->page.failed;
    printf("%d of %d numbers and findings of the papers agree, %d of %d checks hold; see %s\n",
           s->page.judged - s->page.differ, s->page.judged, s->page.checks - failed, s->page.checks,
           path);
    fflush(stdout);
    if (failed > 0)
        fprintf(stderr, "figures: %d of %d checks FAIL%s\n", failed, s->page.checks,
                o.quick ? " (quick runs: not an error)" : "");
    free(path);
    free_runs(s);
    free_table(&s->pairs[IRREGULAR]);
    free_table(&s->pairs[NONCIRCULAR]);
    free(s);
    if (fflush(stdout) != 0) fail(STATUS_BAD_INPUT, "cannot write to stdout");
    return failed == 0 || o.quick ? STATUS_OK : STATUS_FAILED;
}
