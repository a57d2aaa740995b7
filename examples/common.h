/* common.h - what the examples share: errors, progress, random numbers, files, pictures, outlines,
   templates, placement and the scene that is run with threads.

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
#include <signal.h>
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

#include "random.h"

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
    if (result == DEM2D_WARNING) fprintf(stderr, "%s: warning: %s\n", example_name, text);
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

/* Which of the names the argument *i is. A name that ends in "=" is written without it and takes
   the next argument as its value. --help prints the usage and ends the program. */
static inline int parse_option(int count, char **arguments, int *i, const char *usage,
                               const char *const *names, int name_count, const char **value) {
    const char *text = arguments[*i];
    if (strcmp(text, "--help") == 0) {
        fputs(usage, stdout);
        exit(STATUS_OK);
    }
    for (int k = 0; k < name_count; k++) {
        const size_t length = strcspn(names[k], "=");
        if (strlen(text) != length || strncmp(text, names[k], length) != 0) continue;
        *value = "";
        if (names[k][length] == '\0') return k;
        if (++*i == count) fail(STATUS_BAD_INPUT, "%s needs a value (try --help)", text);
        *value = arguments[*i];
        return k;
    }
    fail(STATUS_BAD_INPUT, "unknown option %s (try --help)", text);
}

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

/* A finite decimal number in [low, high]. */
static inline double parse_real(const char *option, const char *text, double low, double high) {
    char *end;
    const double value = strtod(text, &end);
    const bool plain = text[strspn(text, "0123456789+-.eE")] == '\0'; // no hex, nan, blank
    if (!plain || end == text || *end != '\0' || !(value >= low && value <= high))
        fail(STATUS_BAD_INPUT, "%s %s: expected a number from %g to %g", option, text, low, high);
    return value;
}

/* Index of a name among several. */
static inline int parse_name(const char *option, const char *text, const char *const *names,
                             int count) {
    char all[200] = "";
    for (int i = 0; i < count; i++) {
        if (strcmp(text, names[i]) == 0) return i;
        const size_t used = strlen(all);
        snprintf(all + used, sizeof all - used, "%s%s", i == 0 ? "" : ", ", names[i]);
    }
    fail(STATUS_BAD_INPUT, "%s %s: expected one of %s", option, text, all);
}

/* ---- clock ---- */

/* Seconds on a clock that never jumps; for progress and speed only. */
static inline double clock_seconds(void) {
    struct timespec now;
    if (clock_gettime(CLOCK_MONOTONIC, &now) != 0) return 0;
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* ---- Ctrl-C, and progress on stderr ---- */

enum { STATUS_STOPPED = 130 }; // what a shell says of a program that Ctrl-C has ended

static volatile sig_atomic_t stop_asked;

static inline void ask_stop(int number) {
    (void)number;
    stop_asked = 1;
}

/* The next Ctrl-C asks the program to write what it has and to end; one more ends it at once. */
static inline void catch_interrupt(void) {
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = ask_stop;
    action.sa_flags = (int)(SA_RESTART | SA_RESETHAND);
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
}

/* A line that is renewed five times a second on a terminal; elsewhere a line every five seconds. */
typedef struct progress {
    const char *unit;      // of the work: steps
    double total;          // of it
    double started, shown; // s, on the clock: start, last line
    double done;           // then
    bool terminal, dirty;  // dirty: the line is not ended
} progress;

static inline void progress_start(progress *p, const char *unit, double total) {
    p->unit = unit;
    p->total = total;
    p->started = p->shown = clock_seconds();
    p->done = 0;
    p->terminal = isatty(STDERR_FILENO) == 1;
    p->dirty = false;
}

static inline void progress_show(progress *p, const char *stage, double done) {
    const double now = clock_seconds();
    if (now - p->shown < (p->terminal ? 0.2 : 5) || done <= p->done) return;
    const double speed = (done - p->done) / (now - p->shown);
    fprintf(stderr, "%s%s: %s, %.0f %%, %.*f %s/s, %.0f s left%s", p->terminal ? "\r\033[K" : "",
            example_name, stage, 100 * done / p->total, speed < 10, speed, p->unit,
            (now - p->started) * (p->total - done) / done, p->terminal ? "" : "\n");
    p->shown = now;
    p->done = done;
    p->dirty = p->terminal;
}

/* Wipes the line. */
static inline void progress_end(progress *p) {
    if (p->dirty) fputs("\r\033[K", stderr);
    p->dirty = false;
}

/* ---- medians ---- */

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

/* Names in a directory that are wanted (as in a shell: none that starts with a dot), in byte order.
   Free each name and the array. */
static inline char **list_directory(const char *path, bool (*wanted)(const char *name),
                                    int *count) {
    DIR *directory = opendir(path);
    if (directory == NULL)
        fail(STATUS_BAD_INPUT, "cannot open directory %s: %s", path, strerror(errno));
    char **names = NULL;
    int found = 0;
    const struct dirent *entry;
    errno = 0;
    while ((entry = readdir(directory)) != NULL) {
        if (entry->d_name[0] == '.' || !wanted(entry->d_name)) continue;
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
static inline char *aside_name(const char *path) {
    return join_text(path, "", ".tmp");
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

static inline void write_file(const char *path, const char *bytes, size_t count) {
    char *aside = aside_name(path);
    FILE *file = fopen(aside, "wb");
    bool ok = file != NULL && fwrite(bytes, 1, count, file) == count;
    if (file != NULL && fclose(file) != 0) ok = false;
    aside_finish(aside, ok);
}

/* A file that is made in memory first. */
typedef struct draft {
    FILE *file;
    char *bytes;
    size_t count;
} draft;

static inline void draft_open(draft *d) {
    d->file = open_memstream(&d->bytes, &d->count);
    if (d->file == NULL) fail(STATUS_FAILED, "out of memory");
}

/* Ends the writing; the bytes are there until freed. */
static inline void draft_close(draft *d) {
    if (fclose(d->file) != 0) fail(STATUS_FAILED, "out of memory");
    d->file = NULL;
}

static inline void draft_write(draft *d, const char *path) {
    draft_close(d);
    write_file(path, d->bytes, d->count);
    free(d->bytes);
}

/* ---- pictures ---- */

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

/* ---- reading: whole files, CSV outlines, Netpbm images ---- */

typedef struct outline {
    dem2d_vec *points;
    int count;
    char *name; // for messages
} outline;

/* Grey levels, row 0 on top: of one byte, from 0 to 255, or of two, as they are in the file. */
typedef struct image {
    uint8_t *pixels; // NULL with the other
    int width, height;
    uint16_t *pixels16;
} image;

static inline void free_image(image *picture) {
    free(picture->pixels);
    free(picture->pixels16);
}

/* All bytes of a file; the caller frees them. The limit is that of the largest raw image. */
static inline char *read_whole(const char *path, size_t *count) {
    const size_t most = ((size_t)1 << 31) + ((size_t)1 << 20);
    FILE *file = fopen(path, "rb");
    if (file == NULL) fail(STATUS_BAD_INPUT, "cannot open %s: %s", path, strerror(errno));
    char *bytes = NULL;
    size_t room = 0, got = 0;
    errno = 0;
    while (!feof(file) && !ferror(file) && got <= most) {
        if (got == room) {
            room = 2 * room + 65536;
            bytes = get_memory(bytes, room, 1);
        }
        got += fread(bytes + got, 1, room - got, file);
    }
    const int reason = errno;
    const bool bad = ferror(file) != 0;
    fclose(file);
    if (bad || got > most) free(bytes);
    if (bad) fail(STATUS_BAD_INPUT, "cannot read %s: %s", path, strerror(reason));
    if (got > most) fail(STATUS_BAD_INPUT, "%s: more than 2 GiB", path);
    *count = got;
    return bytes;
}

/* What is left of a buffer. The parsers below see nothing but it and answer with what is wrong, or
   NULL; they write their result only when nothing is. */
typedef struct rest {
    const char *at, *end;
} rest;

static inline rest rest_make(const char *bytes, size_t count) {
    const rest r = {bytes, bytes + count};
    return r;
}

/* Next line without its end (LF or CRLF); false when nothing is left. */
static inline bool next_line(rest *r, rest *line) {
    if (r->at == r->end) return false;
    const char *stop = memchr(r->at, '\n', (size_t)(r->end - r->at));
    line->at = r->at;
    line->end = stop != NULL ? stop : r->end;
    r->at = stop != NULL ? stop + 1 : r->end;
    if (line->end > line->at && line->end[-1] == '\r') line->end--;
    return true;
}

/* One finite decimal number of this many characters. Hex, inf, nan and blanks are not taken. */
static inline bool parse_decimal(const char *text, size_t length, double *value) {
    static const char allowed[] = "0123456789+-.eE";
    char copy[400], *end; // with an end for strtod; 1e308 in full has 309 digits
    if (length == 0 || length >= sizeof copy) return false;
    memcpy(copy, text, length);
    copy[length] = '\0';
    *value = strtod(copy, &end);
    return strspn(copy, allowed) == length && end == copy + length && isfinite(*value);
}

static inline bool is_blank(char c) {
    return c == ' ' || c == '\t';
}

/* Next field of a line, without blanks and quotes around it; false when nothing is left, which is
   where `at` is NULL. */
static inline bool next_field(rest *line, char separator, rest *field) {
    if (line->at == NULL) return false;
    const char *stop = memchr(line->at, separator, (size_t)(line->end - line->at));
    field->at = line->at;
    field->end = stop != NULL ? stop : line->end;
    line->at = stop != NULL ? stop + 1 : NULL;
    while (field->at < field->end && is_blank(field->at[0])) field->at++;
    while (field->at < field->end && is_blank(field->end[-1])) field->end--;
    if (field->end - field->at >= 2 && field->at[0] == '"' && field->end[-1] == '"') {
        field->at++;
        field->end--;
    }
    return true;
}

/* What the first line of an outline's file says. */
typedef struct outline_columns {
    int x, y, count; // x and y: which of them
    char separator;
} outline_columns;

/* A line that names the columns x and y, once each, in any order and among others, separated by
   commas, semicolons or tabs: the first of semicolon, tab, comma that the line has. */
static inline bool parse_columns(rest line, outline_columns *result) {
    outline_columns c = {-1, -1, 0, ','};
    rest field;
    const size_t length = (size_t)(line.end - line.at);
    if (length > 0 && memchr(line.at, '\t', length) != NULL) c.separator = '\t';
    if (length > 0 && memchr(line.at, ';', length) != NULL) c.separator = ';';
    for (; next_field(&line, c.separator, &field); c.count++) {
        if (field.end - field.at != 1) continue;
        const char name = field.at[0] | 0x20; // ASCII: the small letter
        if ((name == 'x' && c.x >= 0) || (name == 'y' && c.y >= 0)) return false;
        if (name == 'x') c.x = c.count;
        if (name == 'y') c.y = c.count;
    }
    *result = c;
    return c.x >= 0 && c.y >= 0;
}

/* Past a byte-order mark. */
static inline rest outline_rest(const char *bytes, size_t count) {
    const bool mark = count >= 3 && memcmp(bytes, "\xEF\xBB\xBF", 3) == 0;
    return rest_make(bytes + (mark ? 3 : 0), count - (mark ? 3 : 0));
}

static inline bool is_outline(const char *bytes, size_t count) {
    rest r = outline_rest(bytes, count), line = r;
    outline_columns unused;
    return next_line(&r, &line) && parse_columns(line, &unused);
}

/* A number; where no comma separates it may have one for its point. */
static inline bool parse_coordinate(rest field, char separator, double *value) {
    char copy[400];
    const size_t length = (size_t)(field.end - field.at);
    if (length == 0 || length >= sizeof copy) return false;
    memcpy(copy, field.at, length);
    char *comma = separator != ',' ? memchr(copy, ',', length) : NULL;
    if (comma != NULL) *comma = '.';
    return parse_decimal(copy, length, value);
}

/* As many fields as columns, x and y of them. */
static inline bool parse_point(rest line, const outline_columns *c, dem2d_vec *p) {
    rest field;
    int count = 0;
    bool good = true;
    for (; next_field(&line, c->separator, &field); count++) {
        if (count == c->x) good = good && parse_coordinate(field, c->separator, &p->x);
        if (count == c->y) good = good && parse_coordinate(field, c->separator, &p->y);
    }
    return good && count == c->count;
}

/* A line that names x and y, then a point on each; blank lines at the end only. A last point that
   is the first again is left out. *number is the offending line, 0 for the file as a whole. */
static inline const char *parse_outline(const char *bytes, size_t count, outline *result,
                                        int *number) {
    rest r = outline_rest(bytes, count), line = r;
    outline made = {NULL, 0, NULL};
    outline_columns c;
    const char *wrong = NULL;
    bool blank = false;
    *number = 1;
    if (!next_line(&r, &line) || !parse_columns(line, &c)) return "expected \"x,y\"";
    while (wrong == NULL && next_line(&r, &line)) {
        (*number)++;
        if (line.at == line.end) {
            blank = true;
            continue;
        }
        dem2d_vec p;
        if (blank || !parse_point(line, &c, &p)) {
            wrong = "expected two finite numbers";
        } else if (made.count == 10000000) {
            wrong = "too many points";
        } else {
            if ((made.count & (made.count - 1)) == 0) // at powers of 2: room for twice as many
                made.points = get_memory(made.points, 2 * (size_t)made.count + 1, sizeof p);
            made.points[made.count++] = p;
        }
    }
    if (wrong == NULL) *number = 0;
    if (made.count > 1 && made.points[0].x == made.points[made.count - 1].x &&
        made.points[0].y == made.points[made.count - 1].y)
        made.count--;
    if (wrong == NULL && made.count < 3) wrong = "an outline needs 3 points or more";
    if (wrong != NULL)
        free(made.points);
    else
        *result = made;
    return wrong;
}

static inline bool is_space(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/* Past white space and comments, which go from # to the end of the line. */
static inline void skip_space(rest *r) {
    for (bool comment = false; r->at < r->end; r->at++) {
        if (*r->at == '#') comment = true;
        if (*r->at == '\n' || *r->at == '\r') comment = false;
        if (!comment && !is_space(*r->at)) return;
    }
}

/* Next natural number; -1 when there is none, most + 1 when it is above `most`. */
static inline int next_natural(rest *r, int most) {
    int value = -1;
    skip_space(r);
    for (; r->at < r->end && *r->at >= '0' && *r->at <= '9'; r->at++) {
        if (value < 0) value = 0;
        if (value <= most) value = 10 * value + (*r->at - '0');
        if (value > most) value = most + 1;
    }
    return value;
}

enum { IMAGE_SIDE = 32768 }; // px; ten times this still fits an int

static inline bool is_image(const char *bytes, size_t count) {
    return count >= 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '7' &&
           (count == 2 || is_space(bytes[2]) || bytes[2] == '#');
}

/* Up to the last number; `most` is the greatest sample, 1 for bits. */
static inline const char *parse_image_header(rest *r, int *format, image *made, int *most) {
    if (!is_image(r->at, (size_t)(r->end - r->at))) return "not a Netpbm image";
    *format = r->at[1] - '0';
    if (*format == 3 || *format > 5) return "a colour image or PAM; PBM and PGM can be read";
    r->at += 2;
    made->width = next_natural(r, IMAGE_SIDE);
    made->height = next_natural(r, IMAGE_SIDE);
    if (made->width < 0 || made->height < 0) return "no width and height in the header";
    if (made->width < 1 || made->width > IMAGE_SIDE || made->height < 1 ||
        made->height > IMAGE_SIDE)
        return "width and height must be from 1 to 32768";
    *most = *format == 1 || *format == 4 ? 1 : next_natural(r, 65535);
    if (*most < 0) return "no greatest value in the header";
    if (*most < 1 || *most > 65535) return "the greatest value must be from 1 to 65535";
    return NULL;
}

/* Puts a sample: of one byte scaled to 255, of two as it is. */
static inline void put_sample(image *made, size_t i, unsigned value, unsigned most) {
    if (made->pixels16 != NULL)
        made->pixels16[i] = (uint16_t)value;
    else
        made->pixels[i] = (uint8_t)((value * 255 + most / 2) / most);
}

/* Samples written as decimal numbers, bits also without white space between them. */
static inline const char *parse_plain_samples(rest *r, int most, bool bits, image *made) {
    const size_t samples = (size_t)made->width * (size_t)made->height;
    for (size_t i = 0; i < samples; i++) {
        int value;
        skip_space(r);
        if (r->at == r->end) return "truncated: less data than the header says";
        if (bits)
            value = *r->at == '0' || *r->at == '1' ? *r->at++ - '0' : -1;
        else
            value = next_natural(r, most);
        if (value < 0) return "a sample is not a number";
        if (value > most) return "a sample is above the greatest value";
        put_sample(made, i, bits ? 1 - (unsigned)value : (unsigned)value,
                   (unsigned)most); // 1: black
    }
    return NULL;
}

/* Samples of one or two bytes, high byte first, or bits, high bit first, in whole bytes a row. */
static inline const char *parse_raw_samples(rest *r, int most, bool bits, image *made) {
    const unsigned top = (unsigned)most;
    const uint8_t *in = (const uint8_t *)r->at;
    size_t i = 0;
    for (int row = 0; row < made->height; row++) {
        for (int column = 0; column < made->width; column++) {
            unsigned value;
            if (bits) {
                value = (unsigned)in[column / 8] >> (7 - column % 8) & 1;
                put_sample(made, i++, 1 - value, 1); // 1 is black
                continue;
            }
            value = *in++;
            if (most > 255) value = value << 8 | *in++;
            if (value > top) return "a sample is above the greatest value";
            put_sample(made, i++, value, top);
        }
        if (bits) in += (made->width + 7) / 8;
    }
    r->at = (const char *)in;
    return NULL;
}

/* Netpbm P1, P2, P4, P5: to 8 bits, black bits 0, white ones 255; or, if the header has a greatest
   value above 255, two bytes as they are: many files have values of 12 bits and say 65535. Memory
   is asked for only when the buffer is long enough for the pixels. */
static inline const char *parse_image(const char *bytes, size_t count, image *result) {
    rest r = rest_make(bytes, count);
    image made = {NULL, 0, 0, NULL};
    int format, most;
    const char *wrong = parse_image_header(&r, &format, &made, &most);
    if (wrong != NULL) return wrong;
    const size_t columns = (size_t)made.width, rows = (size_t)made.height;
    const bool bits = format == 1 || format == 4, raw = format >= 4;
    size_t least = bits ? columns * rows : 2 * columns * rows - 1; // plain
    if (raw) least = bits ? (columns + 7) / 8 * rows : columns * rows * (most > 255 ? 2 : 1);
    if (raw && r.at < r.end) { // one white space ends the header, or a comment
        if (*r.at == '#')
            while (r.at < r.end && *r.at != '\n' && *r.at != '\r') r.at++;
        else if (!is_space(*r.at))
            return "no white space after the header";
        r.at += r.at < r.end;
    }
    if ((size_t)(r.end - r.at) < least) return "truncated: less data than the header says";
    if (most > 255)
        made.pixels16 = get_memory(NULL, columns * rows, sizeof *made.pixels16);
    else
        made.pixels = get_memory(NULL, columns, rows);
    wrong =
        raw ? parse_raw_samples(&r, most, bits, &made) : parse_plain_samples(&r, most, bits, &made);
    skip_space(&r);
    if (wrong == NULL && r.at < r.end) wrong = "more data than the header says";
    if (wrong != NULL)
        free_image(&made);
    else
        *result = made;
    return wrong;
}

/* ---- grains: from images, outlines, directories, or made here ---- */

typedef struct outline_list {
    outline *items;
    int count;
} outline_list;

/* Puts a copy of an outline at the end; number 0 for the only one of a file. */
static inline void list_outline(outline_list *list, const dem2d_vec *points, int count,
                                const char *path, int number) {
    char text[32];
    list->items = get_memory(list->items, (size_t)list->count + 1, sizeof *list->items);
    outline *o = &list->items[list->count++];
    o->points = get_memory(NULL, (size_t)count, sizeof *points);
    o->count = count;
    memcpy(o->points, points, (size_t)count * sizeof *points);
    snprintf(text, sizeof text, ", grain %d", number);
    o->name = join_text(path, "", number > 0 ? text : "");
}

static inline void free_outlines(outline_list *list) {
    for (int i = 0; i < list->count; i++) {
        free(list->items[i].points);
        free(list->items[i].name);
    }
    free(list->items);
}

/* Options for what is looked for in images, and their text for --help. */
#define SEARCH_USAGE                                                                              \
    "  --crop X,Y,W,H     image: look at W by H pixels only, X from the left, Y from the top; 0 " \
    "for\n"                                                                                       \
    "                     W or H: all the rest (0,0,0,0)\n"                                       \
    "  --labels           image: a label mask, each grain of a grey value of its own on 0\n"      \
    "  --ignore-frame     image: a frame has no say in the threshold\n"

/* All but the pixels: one metre per pixel. */
static inline dem2d_image_desc default_search(void) {
    dem2d_image_desc search = {0};
    search.scale = 1;
    return search;
}

static inline void parse_crop(const char *text, dem2d_image_desc *search) {
    int *const fields[4] = {&search->crop_left, &search->crop_top, &search->crop_width,
                            &search->crop_height};
    rest line = rest_make(text, strlen(text)), field;
    for (int i = 0; i < 4 || line.at != NULL; i++) {
        const bool there = i < 4 && next_field(&line, ',', &field);
        if (there) *fields[i] = next_natural(&field, IMAGE_SIDE);
        if (!there || *fields[i] < 0 || *fields[i] > IMAGE_SIDE || field.at != field.end)
            fail(STATUS_BAD_INPUT, "--crop %s: expected X,Y,W,H of whole pixels up to %d", text,
                 IMAGE_SIDE);
    }
}

/* The outlines of an image's grains; `search` has all but the pixels. */
static inline void list_image(outline_list *list, const image *picture,
                              const dem2d_image_desc *search, const char *path) {
    dem2d_image_desc desc = *search;
    dem2d_outline_set *found;
    desc.pixels = picture->pixels;
    desc.pixels16 = picture->pixels16;
    desc.width = picture->width;
    desc.height = picture->height;
    need(dem2d_image_outlines(example_env(), &desc, &found), STATUS_BAD_INPUT, path);
    for (int i = 0; i < dem2d_outline_set_count(found); i++) {
        dem2d_outline o;
        must(dem2d_outline_set_get(found, i, &o), path);
        list_outline(list, o.points, o.count, path, i + 1);
    }
    dem2d_outline_set_destroy(found);
}

static inline bool ends_with(const char *name, const char *ending) {
    const size_t length = strlen(name), tail = strlen(ending);
    return length >= tail && strcmp(name + length - tail, ending) == 0;
}

static inline bool is_csv_name(const char *name) {
    return ends_with(name, ".csv");
}

static inline bool is_image_name(const char *name) {
    return ends_with(name, ".pbm") || ends_with(name, ".pgm") || ends_with(name, ".pnm");
}

/* What a file turned out to be. */
typedef enum file_kind { FILE_OTHER, FILE_OUTLINE, FILE_IMAGE } file_kind;

/* Adds the outlines of a file: of all grains of an image, or the one of a CSV file. OTHER, and
   nothing added, for a file that starts like neither. One that starts well and goes on otherwise
   ends the program. */
static inline file_kind read_grains(const char *path, const dem2d_image_desc *search,
                                    outline_list *list) {
    size_t count;
    char *bytes = read_whole(path, &count);
    const char *wrong = NULL;
    outline o = {NULL, 0, NULL};
    image picture = {NULL, 0, 0, NULL};
    int line = 0;
    file_kind kind = is_outline(bytes, count) ? FILE_OUTLINE : FILE_OTHER;
    if (is_image_name(path) || is_image(bytes, count)) kind = FILE_IMAGE;
    if (kind == FILE_OUTLINE) wrong = parse_outline(bytes, count, &o, &line);
    if (kind == FILE_IMAGE) wrong = parse_image(bytes, count, &picture);
    free(bytes);
    if (wrong != NULL && line > 0) fail(STATUS_BAD_INPUT, "%s, line %d: %s", path, line, wrong);
    if (wrong != NULL) fail(STATUS_BAD_INPUT, "%s: %s", path, wrong);
    if (kind == FILE_OUTLINE) {
        list_outline(list, o.points, o.count, path, 0);
        free(o.points);
    }
    if (kind == FILE_IMAGE) {
        list_image(list, &picture, search, path);
        free_image(&picture);
    }
    return kind;
}

/* A lumpy grain: r(t) = 1 + sum over n = 2..5 of size[n - 2] cos(n t + phase[n - 2]). */
static inline void list_lumpy(outline_list *list, const double size[4], const double phase[4],
                              const char *name, int number) {
    enum { POINTS = 120 };
    dem2d_vec points[POINTS];
    for (int i = 0; i < POINTS; i++) {
        const double angle = 6.283185307179586 * i / POINTS;
        double radius = 1;
        for (int n = 2; n <= 5; n++)
            radius += size[n - 2] * dem2d_rot_make(n * angle + phase[n - 2]).c;
        const dem2d_rot direction = dem2d_rot_make(angle);
        points[i].x = radius * direction.c;
        points[i].y = radius * direction.s;
    }
    list_outline(list, points, POINTS, name, number);
}

/* A few grains for those who have none. */
enum { SELF_MADE = 4 };

static inline void list_self_made(outline_list *list, int which) {
    static const double size[SELF_MADE][4] = {{0.16, 0.05, 0.02, 0.010},
                                              {0.08, 0.08, 0.03, 0.015},
                                              {0.22, 0.03, 0.03, 0.005},
                                              {0.04, 0.04, 0.05, 0.020}};
    static const double phase[SELF_MADE][4] = {
        {0.0, 0.7, 1.9, 0.3}, {1.1, 2.6, 0.4, 5.0}, {2.0, 4.4, 3.1, 1.2}, {0.6, 5.7, 2.2, 3.9}};
    list_lumpy(list, size[which], phase[which], "self-made outline", which + 1);
}

/* The outlines of all CSV files in a directory; when none of them is an outline, those of the
   grains in its images. */
static inline void list_grains(const char *directory, const dem2d_image_desc *search,
                               outline_list *list) {
    int skipped = 0;
    for (int pass = 0; pass < 2 && list->count == 0; pass++) {
        int count;
        char **names = list_directory(directory, pass == 0 ? is_csv_name : is_image_name, &count);
        for (int i = 0; i < count; i++) {
            char *path = join_text(directory, "/", names[i]);
            if (read_grains(path, search, list) == FILE_OTHER) skipped++;
            free(path);
            free(names[i]);
        }
        free(names);
    }
    if (skipped > 0 && list->count > 0)
        fprintf(stderr, "%s: skipped %d CSV file%s in %s: first line does not name x and y\n",
                example_name, skipped, skipped == 1 ? "" : "s", directory);
}

/* The grains of an image or outline, of a directory, or (NULL) self-made ones. */
static inline outline_list load_grains(const char *path, const dem2d_image_desc *search) {
    outline_list list = {NULL, 0};
    struct stat status;
    for (int i = 0; path == NULL && i < SELF_MADE; i++) list_self_made(&list, i);
    if (path == NULL) return list;
    if (stat(path, &status) == 0 && S_ISDIR(status.st_mode))
        list_grains(path, search, &list);
    else
        read_grains(path, search, &list);
    if (list.count == 0)
        fail(STATUS_BAD_INPUT,
             "no outline (CSV, first line \"x,y\") and no grain of an image in %s", path);
    return list;
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

/* coverage, if asked for, is lowered to that of this fit. */
static inline dem2d_shape *fitted_template(const outline *o, dem2d_shape_type model, int count,
                                           dem2d_fit_method method, double *coverage) {
    dem2d_fit_desc fit = {0};
    dem2d_fit_report report;
    fit.model = model;
    fit.count = count;
    fit.method = method;
    fit.unbounded = method == DEM2D_FIT_SWARM; // as in the papers
    dem2d_shape *shape;
    need(dem2d_outline_fit(example_env(), o->points, o->count, &fit, &shape, &report),
         STATUS_BAD_INPUT, o->name);
    if (coverage != NULL && report.coverage < *coverage) *coverage = report.coverage;
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

/* Both templates of an outline, by the papers' fits or the default ones; false, and a line on
 * stderr, when one of them covers too little. */
static inline bool add_fitted(template_set *set, const outline *o, double min_coverage,
                              bool papers) {
    double coverage = 1;
    dem2d_shape *fs = fitted_template(o, DEM2D_FOURIER, FOURIER_ORDER,
                                      papers ? DEM2D_FIT_REDUCTION : DEM2D_FIT_DEFAULT, &coverage);
    dem2d_shape *bezier = fitted_template(o, DEM2D_BEZIER, BEZIER_ARCS,
                                          papers ? DEM2D_FIT_SWARM : DEM2D_FIT_DEFAULT, &coverage);
    const bool good = coverage >= min_coverage;
    if (!good || coverage < 0.5)
        fprintf(stderr, "%s: %s: convex templates cover %.3f of it%s\n", example_name, o->name,
                coverage, good ? "" : ": left out");
    if (good) {
        add_template(set, fs);
        add_template(set, bezier);
        set->outlines++;
    } else {
        dem2d_shape_destroy(fs);
        dem2d_shape_destroy(bezier);
    }
    return good;
}

/* Templates of the grains at a path (see load_grains), without those that cover too little. */
static inline template_set load_templates(const char *path, const dem2d_image_desc *search,
                                          double min_coverage, bool papers) {
    template_set set = {NULL, 0, 0};
    dem2d_shape *circle;
    outline_list grains = load_grains(path, search);
    must(dem2d_shape_create_circle(example_env(), 1, &circle), "circle");
    add_template(&set, circle);
    for (int i = 0; i < grains.count; i++)
        (void)add_fitted(&set, &grains.items[i], min_coverage, papers);
    if (set.outlines < grains.count)
        fprintf(stderr, "%s: %d of %d grains left out: a coverage below %g\n", example_name,
                grains.count - set.outlines, grains.count, min_coverage);
    if (set.outlines == 0) fail(STATUS_BAD_INPUT, "no grain is left (--min-coverage)");
    free_outlines(&grains);
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

/* ---- grains that fall into a box, by one thread and by several: the same bits ---- */

typedef struct fall {
    int threads, particles, steps;
} fall;

/* As many threads as processors, at most 8: the scene has no work for more. */
static inline int default_threads(void) {
    long processors = 2;
#ifdef _SC_NPROCESSORS_ONLN // not POSIX, but nearly everywhere
    processors = sysconf(_SC_NPROCESSORS_ONLN);
#endif
    return processors < 1 ? 1 : processors > 8 ? 8 : (int)processors;
}

/* Arguments [THREADS] [PARTICLES] [STEPS]. */
static inline fall parse_fall(int count, char **arguments) {
    fall f = {default_threads(), 3000, 2000};
    if (count > 1 && strcmp(arguments[1], "--help") == 0) {
        printf("usage: %s [THREADS] [PARTICLES] [STEPS]     (%d %d %d)\n", example_name, f.threads,
               f.particles, f.steps);
        exit(STATUS_OK);
    }
    if (count > 4) fail(STATUS_BAD_INPUT, "expected 3 arguments at most (try --help)");
    if (count > 1) f.threads = (int)parse_integer("THREADS", arguments[1], 1, 256);
    if (count > 2) f.particles = (int)parse_integer("PARTICLES", arguments[2], 1, 1000000);
    if (count > 3) f.steps = (int)parse_integer("STEPS", arguments[3], 1, 1000000000);
    return f;
}

/* A box without a lid, about half as high as wide when it is filled in rows. */
static inline void add_box(dem2d_world *world, dem2d_material_id material, double width) {
    const double normals[3][2] = {{0, 1}, {1, 0}, {-1, 0}}; // floor, left, right
    for (int i = 0; i < 3; i++) {
        dem2d_wall_desc wall = {0};
        dem2d_wall_id id;
        wall.material = material;
        wall.normal.x = normals[i][0];
        wall.normal.y = normals[i][1];
        wall.point.x = i == 2 ? width : 0;
        must(dem2d_world_add_wall(world, &wall, &id), "wall");
    }
}

/* Grains of 20 templates of all kinds, in rows above the floor, each with a velocity of its own. */
static inline void add_falling(dem2d_world *world, dem2d_material_id material, int particles,
                               int columns, double pitch) {
    enum { TEMPLATES = 20 };
    const bool all[KINDS] = {true, true, true, true, true};
    dem2d_shape_id ids[TEMPLATES];
    dem2d_shape_info info[TEMPLATES];
    uint64_t random = 1;
    const dem2d_image_desc search = default_search();
    template_set set = load_templates(NULL, &search, 0, false);
    for (int i = 0; i < TEMPLATES; i++) {
        const int t = random_template(&set, all, &random); // may move set.shapes
        const dem2d_shape *shape = set.shapes[t];
        must(dem2d_shape_get(shape, &info[i]), "template");
        must(dem2d_world_add_shape(world, shape, &ids[i]), "template");
    }
    free_templates(&set); // the world has its own
    for (int i = 0; i < particles; i++) {
        dem2d_particle_desc g = {0};
        dem2d_particle_id id;
        g.shape = ids[i % TEMPLATES];
        g.material = material;
        g.scale = random_between(&random, 0.4, 0.49) * pitch / info[i % TEMPLATES].circumscribed;
        g.position.x = (i % columns + 0.5) * pitch;
        g.position.y = (double)(i / columns + 1) * pitch;
        g.angle = random_between(&random, 0, 6.283185307179586);
        g.velocity.x = random_between(&random, -0.5, 0.5);
        g.velocity.y = random_between(&random, -0.5, 0.5);
        must(dem2d_world_add_particle(world, &g, &id), "grain");
    }
}

/* All steps, a few at a time, and how long they took. */
static inline void take_fall(dem2d_world *world, const fall *f, const char *stage,
                             double *seconds) {
    enum { FEW = 50 };
    progress p;
    progress_start(&p, "steps", f->steps);
    for (int done = 0; done < f->steps; done += FEW) {
        const int left = f->steps - done;
        must(dem2d_world_step(world, left < FEW ? left : FEW, NULL), "step");
        progress_show(&p, stage, done + FEW < f->steps ? done + FEW : f->steps);
        if (!stop_asked) continue;
        progress_end(&p);
        fail(STATUS_STOPPED, "stopped after %d of %d steps", done + FEW, f->steps);
    }
    *seconds = clock_seconds() - p.started;
    progress_end(&p);
}

/* The world after its steps, and how long they took. Threads come in by two fields of the
   description; without them the caller's thread does all the work. */
static inline dem2d_world *run_fall(const fall *f, dem2d_parallel_fn *parallel_for, void *user,
                                    double *seconds) {
    dem2d_world_desc scene = {0};
    dem2d_material_desc stone = {2700, 1e7, 1e7, 0.4, 0, 0}; // kg/m2, N/m, N/m, friction
    dem2d_material_id material;
    dem2d_world *world;
    const double pitch = 0.05; // m
    int columns = 1;
    while (columns * columns < 2 * f->particles) columns++;
    scene.time_step = 1e-4;
    scene.gravity.y = -9.81;
    scene.parallel_for = parallel_for;
    scene.parallel_user = user;
    scene.env = example_env();
    must(dem2d_world_create(&scene, &world), "world");
    must(dem2d_world_add_material(world, &stone, &material), "material");
    add_box(world, material, columns * pitch);
    add_falling(world, material, f->particles, columns, pitch);
    take_fall(world, f, parallel_for != NULL ? "several threads" : "one thread", seconds);
    return world;
}

/* Whether all grains of two worlds lie and move alike, to the last bit. */
static inline bool same_motion(const dem2d_world *a, const dem2d_world *b, int particles) {
    dem2d_particle_id *ids = get_memory(NULL, (size_t)particles, sizeof *ids);
    int count;
    must(dem2d_world_particles(a, ids, particles, &count), "particles");
    bool same = count == particles;
    for (int i = 0; i < count && same; i++) {
        dem2d_particle_info p, q;
        must(dem2d_world_get_particle(a, ids[i], &p), "particle");
        must(dem2d_world_get_particle(b, ids[i], &q), "particle");
        same = memcmp(&p.pose, &q.pose, sizeof p.pose) == 0 &&
               memcmp(&p.velocity, &q.velocity, sizeof p.velocity) == 0 &&
               memcmp(&p.angular_velocity, &q.angular_velocity, sizeof p.angular_velocity) == 0;
    }
    free(ids);
    return same;
}

/* Runs the scene without and with threads and prints both times; the exit status. */
static inline int compare_falls(const fall *f, dem2d_parallel_fn *parallel_for, void *user) {
    double one, several;
    catch_interrupt();
    dem2d_world *a = run_fall(f, NULL, NULL, &one);
    dem2d_world *b = run_fall(f, parallel_for, user, &several);
    const bool same = same_motion(a, b, f->particles);
    printf("%d grains, %d steps: 1 thread %.3f s, %d threads %.3f s, ratio %.2f, %s\n",
           f->particles, f->steps, one, f->threads, several, one / several,
           same ? "the same bits" : "DIFFERENT");
    dem2d_world_destroy(a);
    dem2d_world_destroy(b);
    return same ? STATUS_OK : STATUS_FAILED;
}

#endif /* DEM2D_EXAMPLES_COMMON_H */
