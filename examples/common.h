/* common.h - what the examples share: errors, random numbers, files, outlines, templates and
   placement.

   Include it after dem2d.h in a source file that defines _POSIX_C_SOURCE 200809L at its top and
   sets example_name at the start of main. Nothing here calls a trigonometric function of libm:
   these differ between systems, and the examples promise the same numbers everywhere.
*/
#ifndef DEM2D_EXAMPLES_COMMON_H
#define DEM2D_EXAMPLES_COMMON_H

#include "dem2d.h"

#include <dirent.h>
#include <errno.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <time.h>
#include <unistd.h>

/* The same bits from every compiler at every level: as in the header, no fused multiply-add. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off", "no-tree-slp-vectorize")
#endif

#if defined(__GNUC__)
#define EXAMPLE_FAILS __attribute__((noreturn, format(printf, 2, 3)))
#else
#define EXAMPLE_FAILS
#endif

/* ---- errors: one line on stderr, then the exit status ---- */

enum { STATUS_OK = 0, STATUS_FAILED = 1, STATUS_BAD_INPUT = 2 };

static const char *example_name = "example";

static inline void fail(int status, const char *format, ...) EXAMPLE_FAILS;
static inline void fail(int status, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    fprintf(stderr, "%s: ", example_name);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    exit(status);
}

/* The library's last message and the result it belongs to. */
typedef struct library_message {
    dem2d_result result;
    char text[240];
} library_message;

static library_message last_message;

static inline void keep_message(void *user, dem2d_result result, int index, const char *text) {
    library_message *message = user;
    (void)index; // the text has it
    message->result = result;
    snprintf(message->text, sizeof message->text, "%s", text);
}

/* Memory by malloc, messages kept for the error line. */
static inline const dem2d_env *example_env(void) {
    static const dem2d_env env = {&last_message, NULL, NULL, keep_message};
    return &env;
}

/* Ends the program with this status when a call to the library did not succeed. */
static inline void need(dem2d_result result, int status, const char *what) {
    if (result == DEM2D_OK) return;
    if (last_message.result == result)
        fail(status, "%s: %s (%s)", what, dem2d_result_text(result), last_message.text);
    fail(status, "%s: %s", what, dem2d_result_text(result));
}

/* The same for calls that have no reason to fail. */
static inline void must(dem2d_result result, const char *what) {
    need(result, STATUS_FAILED, what);
}

/* Room for count things of a size; grows `memory` unless it is NULL. */
static inline void *get_memory(void *memory, size_t count, size_t size) {
    if (size != 0 && count > SIZE_MAX / size) fail(STATUS_FAILED, "out of memory");
    void *room = realloc(memory, count * size + 1);
    if (room == NULL) fail(STATUS_FAILED, "out of memory");
    return room;
}

/* ---- options ---- */

/* A whole decimal number in [low, high]. */
static inline uint64_t parse_integer(const char *option, const char *text, uint64_t low,
                                     uint64_t high) {
    char *end;
    errno = 0;
    const unsigned long long value = strtoull(text, &end, 10);
    const bool digits = text[0] >= '0' && text[0] <= '9' && *end == '\0'; // no sign, no blank
    if (!digits || errno != 0 || value < low || value > high)
        fail(STATUS_BAD_INPUT, "%s %s: expected an integer from %llu to %llu", option, text,
             (unsigned long long)low, (unsigned long long)high);
    return value;
}

/* ---- clock, random numbers, logarithm ---- */

/* Seconds on a clock that never jumps; for progress and speed only. */
static inline double clock_seconds(void) {
    struct timespec now;
    if (clock_gettime(CLOCK_MONOTONIC, &now) != 0) return 0;
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* 64 random bits (splitmix64): a counter stepped by 2^64 / golden ratio, then mixed. */
static inline uint64_t random_bits(uint64_t *state) {
    uint64_t z = (*state += UINT64_C(0x9E3779B97F4A7C15));
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

/* Uniform in [low, high): 53 random bits. Two draws never stand in one expression, because C
   leaves open which comes first. */
static inline double random_between(uint64_t *state, double low, double high) {
    return low + (high - low) * ((double)(random_bits(state) >> 11) * 0x1p-53);
}

/* Uniform in 0 .. count - 1. */
static inline int random_below(uint64_t *state, int count) {
    return (int)(random_bits(state) % (uint64_t)count);
}

/* Natural logarithm of x > 0 near 1: ln x = 2 (z + z^3/3 + z^5/5 + ...), z = (x - 1)/(x + 1).
   Not libm's, whose last bit depends on the system. */
static inline double log_near_one(double x) {
    const double z = (x - 1) / (x + 1);
    double power = z, sum = z;
    for (int n = 3; n < 400 && fabs(power) > 1e-18 * fabs(sum); n += 2) {
        power *= z * z;
        sum += power / n;
    }
    return 2 * sum;
}

/* ---- files: names, directories, writing aside ---- */

/* "a" and "b" joined with something between; the caller frees it. */
static inline char *join_text(const char *a, const char *between, const char *b) {
    const size_t size = strlen(a) + strlen(between) + strlen(b) + 1;
    char *text = get_memory(NULL, size, 1);
    snprintf(text, size, "%s%s%s", a, between, b);
    return text;
}

static inline int compare_names(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* Names in a directory that match *ending (as in a shell: none that starts with a dot), in byte
   order. Free each name and the array. */
static inline char **list_directory(const char *path, const char *ending, int *count) {
    DIR *directory = opendir(path);
    if (directory == NULL)
        fail(STATUS_BAD_INPUT, "cannot open directory %s: %s", path, strerror(errno));
    char **names = NULL;
    int found = 0;
    const struct dirent *entry;
    errno = 0;
    while ((entry = readdir(directory)) != NULL) {
        const size_t length = strlen(entry->d_name), tail = strlen(ending);
        if (entry->d_name[0] == '.' || length < tail) continue;
        if (strcmp(entry->d_name + length - tail, ending) != 0) continue;
        if (found == INT_MAX - 1) fail(STATUS_BAD_INPUT, "too many files in %s", path);
        names = get_memory(names, (size_t)found + 1, sizeof *names);
        names[found++] = join_text(entry->d_name, "", "");
        errno = 0;
    }
    if (errno != 0) fail(STATUS_BAD_INPUT, "cannot read directory %s: %s", path, strerror(errno));
    closedir(directory);
    if (found > 0) qsort(names, (size_t)found, sizeof *names, compare_names);
    *count = found;
    return names;
}

/* Makes a directory whose parent exists, or accepts one that can be written to. */
static inline void make_directory(const char *path) {
    struct stat status;
    if (mkdir(path, 0777) == 0) return;
    if (errno != EEXIST)
        fail(STATUS_BAD_INPUT, "cannot make directory %s: %s", path, strerror(errno));
    if (stat(path, &status) != 0 || !S_ISDIR(status.st_mode))
        fail(STATUS_BAD_INPUT, "%s is not a directory", path);
    if (access(path, W_OK | X_OK) != 0)
        fail(STATUS_BAD_INPUT, "cannot write in directory %s: %s", path, strerror(errno));
}

/* Files are written under the name with ".tmp" and renamed when complete, so that a reader never
   finds half of one. `ok` tells whether writing to `aside` has succeeded; frees `aside`. */
static inline char *aside_name(const char *directory, const char *name) {
    char *path = join_text(directory, "/", name);
    char *aside = join_text(path, "", ".tmp");
    free(path);
    return aside;
}

static inline void aside_finish(char *aside, bool ok) {
    char *path = join_text(aside, "", "");
    path[strlen(path) - strlen(".tmp")] = '\0';
    if (!ok || rename(aside, path) != 0) {
        const int reason = errno;
        remove(aside);
        fail(STATUS_BAD_INPUT, "cannot write %s: %s", path, strerror(reason));
    }
    free(path);
    free(aside);
}

static inline void write_file(const char *directory, const char *name, const char *bytes,
                              size_t count) {
    char *aside = aside_name(directory, name);
    FILE *file = fopen(aside, "wb");
    bool ok = file != NULL && fwrite(bytes, 1, count, file) == count;
    if (file != NULL && fclose(file) != 0) ok = false;
    aside_finish(aside, ok);
}

/* ---- outlines ---- */

typedef struct outline {
    dem2d_vec *points;
    int count;
} outline;

/* Next line without its end (LF or CRLF); false at the end of the file. A byte 0 is an error. */
static inline bool next_line(FILE *file, const char *path, char **line, size_t *size) {
    errno = 0;
    const ssize_t length = getline(line, size, file);
    if (length < 0) {
        if (ferror(file)) fail(STATUS_BAD_INPUT, "cannot read %s: %s", path, strerror(errno));
        return false;
    }
    size_t end = (size_t)length;
    if (end > 0 && (*line)[end - 1] == '\n') (*line)[--end] = '\0';
    if (end > 0 && (*line)[end - 1] == '\r') (*line)[--end] = '\0';
    if (strlen(*line) != end) (*line)[0] = '\1'; // no line of ours: neither header nor numbers
    return true;
}

/* One finite decimal number that ends at `stop`. */
static inline bool read_number(const char **text, char stop, double *value) {
    const size_t length = strspn(*text, "0123456789+-.eE"); // keeps out hex, inf, nan, blanks
    char *end;
    *value = strtod(*text, &end);
    if (length == 0 || end != *text + length || *end != stop || !isfinite(*value)) return false;
    *text = end + (stop != '\0');
    return true;
}

/* Reads an outline. False when the first line is not "x,y": some other table. A file that starts
   like an outline and goes on otherwise ends the program. */
static inline bool read_outline(const char *path, outline *result) {
    FILE *file = fopen(path, "rb");
    if (file == NULL) fail(STATUS_BAD_INPUT, "cannot open %s: %s", path, strerror(errno));
    char *line = NULL;
    size_t size = 0;
    outline made = {NULL, 0};
    bool blank = false;
    const bool ours = next_line(file, path, &line, &size) && strcmp(line, "x,y") == 0;
    for (int number = 2; ours && next_line(file, path, &line, &size); number++) {
        const char *rest = line;
        dem2d_vec point;
        if (*line == '\0') { // allowed at the end only
            blank = true;
            continue;
        }
        if (blank || !read_number(&rest, ',', &point.x) || !read_number(&rest, '\0', &point.y))
            fail(STATUS_BAD_INPUT, "%s, line %d: expected two finite numbers", path, number);
        if (made.count == 10000000) fail(STATUS_BAD_INPUT, "%s: too many points", path);
        if ((made.count & (made.count - 1)) == 0) // at powers of 2: room for twice as many
            made.points = get_memory(made.points, 2 * (size_t)made.count + 1, sizeof point);
        made.points[made.count++] = point;
    }
    free(line);
    fclose(file);
    if (ours && made.count < 3)
        fail(STATUS_BAD_INPUT, "%s: an outline needs 3 points or more, here %d", path, made.count);
    if (ours) *result = made;
    return ours;
}

/* A few grains for those who have none: r(t) = 1 + sum over n = 2..5 of c_n cos(n t + phase_n). */
enum { SELF_MADE = 4 };

static inline outline self_made_outline(int which) {
    static const double size[SELF_MADE][4] = {{0.16, 0.05, 0.02, 0.010},
                                              {0.08, 0.08, 0.03, 0.015},
                                              {0.22, 0.03, 0.03, 0.005},
                                              {0.04, 0.04, 0.05, 0.020}};
    static const double phase[SELF_MADE][4] = {
        {0.0, 0.7, 1.9, 0.3}, {1.1, 2.6, 0.4, 5.0}, {2.0, 4.4, 3.1, 1.2}, {0.6, 5.7, 2.2, 3.9}};
    outline made = {get_memory(NULL, 120, sizeof(dem2d_vec)), 120};
    for (int i = 0; i < made.count; i++) {
        const double angle = 6.283185307179586 * i / made.count;
        double radius = 1;
        for (int n = 2; n <= 5; n++)
            radius += size[which][n - 2] * dem2d_rot_make(n * angle + phase[which][n - 2]).c;
        const dem2d_rot direction = dem2d_rot_make(angle);
        made.points[i].x = radius * direction.c;
        made.points[i].y = radius * direction.s;
    }
    return made;
}

/* ---- templates ---- */

enum { CIRCLE, ELLIPSE, POLYGON, BEZIER, FS, KINDS };
static const char *const kind_names[KINDS] = {"circle", "ellipse", "polygon", "bezier", "fs"};

/* Reads a set of kinds: "mixed", "noncircular" or a list. */
static inline void parse_shapes(const char *text, bool kinds[KINDS]) {
    const bool mixed = strcmp(text, "mixed") == 0, noncircular = strcmp(text, "noncircular") == 0;
    for (int k = 0; k < KINDS; k++)
        kinds[k] = mixed || (noncircular && (k == ELLIPSE || k == POLYGON || k == BEZIER));
    if (mixed || noncircular) return;
    for (const char *name = text;; name += strcspn(name, ",") + 1) {
        const size_t length = strcspn(name, ",");
        int k = 0;
        while (k < KINDS &&
               (strlen(kind_names[k]) != length || strncmp(name, kind_names[k], length) != 0))
            k++;
        if (k == KINDS)
            fail(STATUS_BAD_INPUT,
                 "--shapes %s: expected mixed, noncircular or a list of circle, "
                 "ellipse, polygon, bezier, fs",
                 text);
        kinds[k] = true;
        if (name[length] == '\0') return;
    }
}

enum { FOURIER_ORDER = 8, BEZIER_ARCS = 10 };

static inline dem2d_shape *fourier_template(const outline *o, const char *name) {
    double a[FOURIER_ORDER + 1], b[FOURIER_ORDER + 1];
    dem2d_reduction_desc reduction = {0};
    reduction.test = DEM2D_EXACT;
    dem2d_shape *shape = NULL;
    const dem2d_env *env = example_env();
    dem2d_result result = dem2d_fourier_fit(env, o->points, o->count, FOURIER_ORDER, 0, a, b);
    if (result == DEM2D_OK) result = dem2d_fourier_reduce(a, b, FOURIER_ORDER, &reduction, NULL);
    if (result == DEM2D_OK) result = dem2d_shape_create_fourier(env, a, b, FOURIER_ORDER, &shape);
    need(result, STATUS_BAD_INPUT, name);
    return shape;
}

static inline dem2d_shape *bezier_template(const outline *o, const char *name) {
    dem2d_vec control[3 * BEZIER_ARCS];
    dem2d_shape *shape = NULL;
    const dem2d_env *env = example_env();
    dem2d_result result = dem2d_bezier_fit(env, o->points, o->count, BEZIER_ARCS, control);
    if (result == DEM2D_OK) result = dem2d_shape_create_bezier(env, control, BEZIER_ARCS, &shape);
    need(result, STATUS_BAD_INPUT, name);
    return shape;
}

/* Half axes of aspect 1 to 2 and area pi. */
static inline dem2d_shape *random_ellipse(uint64_t *random) {
    const double root = sqrt(random_between(random, 1, 2));
    dem2d_shape *shape;
    must(dem2d_shape_create_ellipse(example_env(), root, 1 / root, &shape), "ellipse");
    return shape;
}

/* 4 to 7 vertices on a circle, each at most 0.3 of the spacing from its regular place: no side is
   shorter than 0.4 of the spacing or passes the centre. */
static inline dem2d_shape *random_polygon(uint64_t *random) {
    const int count = 4 + random_below(random, 4);
    dem2d_vec points[7];
    for (int i = 0; i < count; i++) {
        const double place = i + random_between(random, -0.3, 0.3);
        const dem2d_rot direction = dem2d_rot_make(6.283185307179586 * place / count);
        points[i].x = direction.c;
        points[i].y = direction.s;
    }
    dem2d_shape *shape;
    must(dem2d_shape_create_polygon(example_env(), points, count, 0, &shape), "polygon");
    return shape;
}

/* The templates of a run: [0] the circle; for each outline its Fourier series and its polybezier;
   then ellipses and polygons, which are each grain's own. */
typedef struct template_set {
    dem2d_shape **shapes;
    int count, outlines;
} template_set;

static inline void add_template(template_set *set, dem2d_shape *shape) {
    set->shapes = get_memory(set->shapes, (size_t)set->count + 1, sizeof *set->shapes);
    set->shapes[set->count++] = shape;
}

static inline void add_outline(template_set *set, outline *o, const char *name) {
    add_template(set, fourier_template(o, name));
    add_template(set, bezier_template(o, name));
    set->outlines++;
    free(o->points);
}

/* Templates of every outline in a directory, in byte order of the names; without a directory (NULL)
   those of the self-made outlines. */
static inline template_set load_templates(const char *directory) {
    template_set set = {NULL, 0, 0};
    dem2d_shape *circle;
    outline o;
    must(dem2d_shape_create_circle(example_env(), 1, &circle), "circle");
    add_template(&set, circle);
    for (int i = 0; directory == NULL && i < SELF_MADE; i++) {
        o = self_made_outline(i);
        add_outline(&set, &o, "self-made outline");
    }
    if (directory == NULL) return set;
    int count, skipped = 0;
    char **names = list_directory(directory, ".csv", &count);
    for (int i = 0; i < count; i++) {
        char *path = join_text(directory, "/", names[i]);
        if (read_outline(path, &o))
            add_outline(&set, &o, path);
        else
            skipped++;
        free(path);
        free(names[i]);
    }
    free(names);
    if (set.outlines == 0)
        fail(STATUS_BAD_INPUT, "no outline in %s (a *.csv whose first line is \"x,y\")", directory);
    if (skipped > 0)
        fprintf(stderr, "%s: skipped %d CSV file%s in %s: first line is not \"x,y\"\n",
                example_name, skipped, skipped == 1 ? "" : "s", directory);
    return set;
}

static inline void free_templates(template_set *set) {
    for (int i = 0; i < set->count; i++) dem2d_shape_destroy(set->shapes[i]);
    free(set->shapes);
}

/* Index of a template of one of these kinds; an ellipse or a polygon is made on the spot. */
static inline int random_template(template_set *set, const bool kinds[KINDS], uint64_t *random) {
    int kind;
    do kind = random_below(random, KINDS);
    while (!kinds[kind]);
    if (kind == CIRCLE) return 0;
    if (kind == FS) return 1 + 2 * random_below(random, set->outlines);
    if (kind == BEZIER) return 2 + 2 * random_below(random, set->outlines);
    add_template(set, kind == ELLIPSE ? random_ellipse(random) : random_polygon(random));
    return set->count - 1;
}

/* ---- placement at random without overlap ---- */

typedef struct grain {
    const dem2d_shape *shape;
    dem2d_shape_id id; // the same template in a world, for the caller
    double radius;     // of the bounding circle, m
    double angle;
    dem2d_pose pose; // its scale is given, the rest comes from place_grains
    int serial;      // settles the order of equal radii
} grain;

static inline int compare_grains(const void *a, const void *b) {
    const grain *p = a, *q = b;
    if (p->radius != q->radius) return p->radius > q->radius ? -1 : 1;
    return p->serial - q->serial;
}

/* Whether a grain is free of the first `count` others: bounding circles, then exactly. */
static inline bool grain_is_free(const grain *g, const grain *others, int count) {
    for (int i = 0; i < count; i++) {
        const double dx = others[i].pose.position.x - g->pose.position.x;
        const double dy = others[i].pose.position.y - g->pose.position.y;
        const double reach = others[i].radius + g->radius;
        if (dx * dx + dy * dy > reach * reach) continue;
        dem2d_contact contact;
        must(dem2d_pair_overlap(g->shape, g->pose, others[i].shape, others[i].pose, NULL, &contact),
             "placement");
        if (contact.state != DEM2D_SEPARATED) return false; // unresolved counts as an overlap
    }
    return true;
}

/* Tries places for grains[index] in the box from (0, 0) to (width, height). */
static inline bool place_one(grain *grains, int index, double width, double height,
                             uint64_t *random) {
    enum { TRIES = 20000 };
    grain *g = &grains[index];
    for (int i = 0; i < TRIES; i++) {
        dem2d_box box;
        g->angle = random_between(random, 0, 6.283185307179586);
        g->pose = dem2d_pose_make(0, 0, g->angle, g->pose.scale);
        must(dem2d_shape_aabb(g->shape, g->pose, &box), "placement");
        if (box.upper.x - box.lower.x >= width || box.upper.y - box.lower.y >= height) continue;
        g->pose.position.x = random_between(random, -box.lower.x, width - box.upper.x);
        g->pose.position.y = random_between(random, -box.lower.y, height - box.upper.y);
        if (grain_is_free(g, grains, index)) return true;
    }
    return false;
}

/* Places all grains, largest first (sorts them). A box that turns out too small is made a tenth
   higher, and stderr says so. */
static inline void place_grains(grain *grains, int count, double width, double *height,
                                uint64_t *random) {
    qsort(grains, (size_t)count, sizeof *grains, compare_grains);
    for (int i = 0, growths = 0; i < count; i++) {
        if (place_one(grains, i, width, *height, random)) continue;
        if (++growths > 50) fail(STATUS_FAILED, "the grains find no place in the box");
        *height *= 1.1;
        fprintf(stderr, "%s: no place for grain %d of %d; the box is now %.3g m high\n",
                example_name, i + 1, count, *height);
        i = -1; // all over again
    }
}

#endif /* DEM2D_EXAMPLES_COMMON_H */
