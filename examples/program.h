/* program.h - what every example is made of: errors, memory, options, the clock, Ctrl-C and
   progress, files that are complete or not there.

   Include it after dem2d.h in a source file that defines _POSIX_C_SOURCE 200809L at its top and
   sets example_name at the start of main. Nothing in these headers calls a trigonometric function
   of libm: these differ between systems, and the examples promise the same numbers everywhere.
*/
#ifndef DEM2D_EXAMPLES_PROGRAM_H
#define DEM2D_EXAMPLES_PROGRAM_H

#include "dem2d.h"

#include <dirent.h>
#include <errno.h>
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

#endif
