/* bench_outlines.h - outlines of real grains for benchmarks: all *.csv files below a folder whose
   first line is `x,y`. Define BENCH_NAME, for messages, and include dem2d.h before it. */
#ifndef BENCH_OUTLINES_H
#define BENCH_OUTLINES_H

#include "bench.h"

#include <dirent.h>

#define PATH_ROOM 4096

typedef struct outline {
    char *name; /* of its file, without folder and ".csv" */
    dem2d_vec *points;
    int count;
    bool core; /* named in core12.txt: for the caller to set */
} outline;

typedef struct outlines {
    outline *list;
    int count, room;
    int skipped;          /* other .csv files */
    char core[PATH_ROOM]; /* path of core12.txt, if any */
} outlines;

PART void *need(void *memory) {
    if (!memory) bench_fail("out of memory");
    return memory;
}

/* Takes the points. */
PART void list_outline(outlines *all, const char *name, size_t length, dem2d_vec *points,
                       int count) {
    if (all->count == all->room) {
        all->room = 2 * all->room + 16;
        all->list = need(realloc(all->list, (size_t)all->room * sizeof *all->list));
    }
    outline *o = &all->list[all->count++];
    o->name = need(malloc(length + 1)), o->points = points, o->count = count, o->core = false;
    memcpy(o->name, name, length), o->name[length] = 0;
}

/* Adds the outline in a file, or counts the file as another one. */
PART void read_outline(outlines *all, const char *path, const char *name) {
    char line[256];
    int count = 0, room = 0;
    dem2d_vec *points = NULL, p;
    FILE *file = fopen(path, "r");
    if (file && fgets(line, sizeof line, file) && strcspn(line, "\r\n") == 3 &&
        strncmp(line, "x,y", 3) == 0) {
        while (fgets(line, sizeof line, file) && sscanf(line, "%lf,%lf", &p.x, &p.y) == 2) {
            if (count == room) {
                room = 2 * room + 256;
                points = need(realloc(points, (size_t)room * sizeof *points));
            }
            points[count++] = p;
        }
    }
    if (file) fclose(file);
    if (count >= 3) {
        list_outline(all, name, strlen(name) - 4, points, count);
        return;
    }
    free(points);
    all->skipped++;
}

/* All outlines below a folder, in no order; false when it can't be opened. */
PART bool read_folder(outlines *all, const char *folder) {
    DIR *dir = opendir(folder);
    if (!dir) return false;
    for (struct dirent *entry; (entry = readdir(dir));) {
        const char *name = entry->d_name;
        const size_t length = strlen(name);
        char path[PATH_ROOM];
        struct stat info;
        if (name[0] == '.') continue;
        const int written = snprintf(path, sizeof path, "%s/%s", folder, name);
        if (written < 0 || (size_t)written >= sizeof path || lstat(path, &info)) continue;
        if (S_ISDIR(info.st_mode)) /* a link to one could lead in circles */
            read_folder(all, path);
        else if (strcmp(name, "core12.txt") == 0)
            memcpy(all->core, path, (size_t)written + 1);
        else if (length > 4 && strcmp(name + length - 4, ".csv") == 0)
            read_outline(all, path, name);
    }
    closedir(dir);
    return true;
}

PART int compare_outlines(const void *a, const void *b) {
    return strcmp(((const outline *)a)->name, ((const outline *)b)->name);
}

/* All outlines below a folder, by their names. Ends the program when there are none. */
PART void read_outlines(outlines *all, const char *folder) {
    if (!read_folder(all, folder) || all->count == 0) bench_fail("no outline below %s", folder);
    qsort(all->list, (size_t)all->count, sizeof *all->list, compare_outlines);
}

PART void free_outlines(outlines *all) {
    for (int i = 0; i < all->count; i++) free(all->list[i].name), free(all->list[i].points);
    free(all->list);
}

#endif
