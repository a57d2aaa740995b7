/* bench.h - what the benchmarks share: errors, memory, the clock, files. Define BENCH_NAME, for
   messages, and _POSIX_C_SOURCE 200809L; include it after dem2d.h. */
#ifndef BENCH_H
#define BENCH_H

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Ends the program: bad usage or input. */
static void bench_fail(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    fprintf(stderr, BENCH_NAME ": ");
    vfprintf(stderr, format, arguments);
    fprintf(stderr, "\n");
    va_end(arguments);
    exit(2);
}

#define PARTS_FAIL(what, why) bench_fail("%s: %s", what, why)
#include "parts.h"

#define PI 3.14159265358979323846

/* Room for count things of a size, all zero. */
PART void *get_memory(size_t count, size_t size) {
    void *memory = calloc(count + 1, size);
    if (!memory) bench_fail("out of memory");
    return memory;
}

PART double read_clock(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* On a clock that never jumps. */
PART double seconds(void) {
    return read_clock(CLOCK_MONOTONIC);
}

PART FILE *create(const char *path) {
    FILE *file = fopen(path, "w");
    if (!file) bench_fail("can't write %s", path);
    return file;
}

/* Makes a folder and those above it, unless they are there, and works in it. */
PART void enter_folder(const char *path) {
    char part[4096];
    if (strlen(path) >= sizeof part) bench_fail("no folder %s", path);
    for (size_t i = 1; i <= strlen(path); i++) {
        if (path[i] != '/' && path[i] != 0) continue;
        memcpy(part, path, i), part[i] = 0;
        mkdir(part, 0777);
    }
    if (chdir(path) != 0) bench_fail("no folder %s", path);
}

#endif
