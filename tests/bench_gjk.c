/* bench_gjk [DIR] - support calls of the overlap test, by pair of shape types, beside the figures
   of two papers on the same algorithm.

   500 grains of five types (circle; ellipse of aspect 1 to 2; polygon of 4 to 7 sides; polybezier
   of 10 arcs; Fourier series of order 8) are squeezed by four walls at 100 kPa until nearly at
   rest. Then dem2d_pair_overlap is asked cold, from the line of centres, for every pair whose
   bounding circles overlap. DIR holds outlines of real grains (*.csv, first line `x,y`); without
   it the last two types are fitted to outlines that are made here. Exit status: 0, 1 if a pair
   was left unresolved, 2 for bad usage or input. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#define BENCH_NAME "bench_gjk"
#include "bench.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define GRAINS 500
#define TEMPLATES 12 /* of each type that has templates */
#define ORDER 8
#define ARCS 10
#define OUTLINE_ROOM 20000

enum { FS, CIRCLE, ELLIPSE, POLYGON, BEZIER, TYPES };

static const char *const type_names[TYPES] = {"FS", "circle", "ellipse", "polygon", "bezier"};
/* Mean calls by the papers' tables 1, upper triangle; 0: not given. */
static const double paper_p[TYPES][TYPES] = {{0, 0, 0, 0, 0},
                                             {0, 0, 0, 0, 0},
                                             {0, 0, 5.33, 4.48, 5.72},
                                             {0, 0, 0, 2.64, 3.96},
                                             {0, 0, 0, 0, 4.99}};
static const double paper_f[TYPES][TYPES] = {{4.63, 5.51, 5.51, 4.34, 5.46},
                                             {0, 3.00, 6.04, 4.52, 5.52},
                                             {0, 0, 5.20, 4.35, 5.45},
                                             {0, 0, 0, 2.91, 3.92},
                                             {0, 0, 0, 0, 5.10}};

/* --- outlines ------------------------------------------------------------------------------- */

/* Number of points, or 0 when the file is not an outline. */
static int read_outline(const char *path, dem2d_vec *points) {
    char line[256];
    int count = 0;
    FILE *file = fopen(path, "r");
    if (!file) return 0;
    if (fgets(line, sizeof line, file) && strncmp(line, "x,y", 3) == 0)
        while (count < OUTLINE_ROOM && fgets(line, sizeof line, file) &&
               sscanf(line, "%lf,%lf", &points[count].x, &points[count].y) == 2)
            count++;
    fclose(file);
    return count;
}

/* A lumpy closed curve that differs with each index. */
static int make_outline(int index, dem2d_vec *points) {
    const int count = 400;
    double size[6], phase[6];
    for (int n = 2; n < 6; n++) size[n] = uniform(0, 0.25 / n), phase[n] = uniform(0, 2 * PI);
    for (int i = 0; i < count; i++) {
        const double t = 2 * PI * i / count;
        double r = 1 + 0.01 * index;
        for (int n = 2; n < 6; n++) r += size[n] * cos(n * t - phase[n]);
        points[i].x = r * cos(t), points[i].y = r * sin(t);
    }
    return count;
}

static int by_name(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* The first TEMPLATES outlines of a folder in byte order of their names. Returns how many. */
static int list_outlines(const char *folder, char *names[], int room) {
    DIR *dir = opendir(folder);
    int count = 0, kept = 0;
    if (!dir) return 0;
    for (struct dirent *entry; count < room && (entry = readdir(dir));) {
        const size_t length = strlen(entry->d_name), whole = strlen(folder) + length + 2;
        if (length < 5 || strcmp(entry->d_name + length - 4, ".csv") != 0) continue;
        if (!(names[count] = malloc(whole))) exit(2);
        snprintf(names[count++], whole, "%s/%s", folder, entry->d_name);
    }
    closedir(dir);
    qsort(names, (size_t)count, sizeof *names, by_name);
    static dem2d_vec points[OUTLINE_ROOM];
    for (int i = 0; i < count; i++) {
        char *name = names[i];
        if (kept < TEMPLATES && read_outline(name, points) >= 3)
            names[kept++] = name;
        else
            free(name);
    }
    return kept;
}

/* --- templates ------------------------------------------------------------------------------ */

typedef struct library {
    dem2d_shape *shapes[TYPES][TEMPLATES];
    int count[TYPES];
} library;

static void fit(library *lib, int slot, const dem2d_vec *points, int count) {
    double a[ORDER + 1], b[ORDER + 1];
    dem2d_reduction_desc exact = {0};
    dem2d_vec control[3 * ARCS];
    exact.test = DEM2D_EXACT;
    expect_ok(dem2d_fourier_fit(NULL, points, count, ORDER, 0, a, b), "Fourier fit");
    expect_ok(dem2d_fourier_reduce(a, b, ORDER, &exact, NULL), "Fourier reduction");
    expect_ok(dem2d_shape_create_fourier(NULL, a, b, ORDER, &lib->shapes[FS][slot]),
              "Fourier series");
    expect_ok(dem2d_bezier_fit(NULL, points, count, ARCS, control), "Bezier fit");
    expect_ok(dem2d_shape_create_bezier(NULL, control, ARCS, &lib->shapes[BEZIER][slot]),
              "polybezier");
    lib->count[FS] = lib->count[BEZIER] = slot + 1;
}

static void make_library(library *lib, const char *folder) {
    static dem2d_vec points[OUTLINE_ROOM];
    char *names[1000];
    const int files = folder ? list_outlines(folder, names, 1000) : 0;
    if (folder && files == 0) bench_fail("no outline in %s", folder);
    for (int i = 0; i < (folder ? files : TEMPLATES); i++) {
        const int count = folder ? read_outline(names[i], points) : make_outline(i, points);
        fit(lib, i, points, count);
        if (folder) free(names[i]);
    }
    expect_ok(dem2d_shape_create_circle(NULL, 1, &lib->shapes[CIRCLE][0]), "circle");
    lib->count[CIRCLE] = 1;
    lib->count[ELLIPSE] = lib->count[POLYGON] = TEMPLATES;
    for (int i = 0; i < TEMPLATES; i++) {
        const double aspect = 1 + (i + 0.5) / TEMPLATES;
        const int sides = 4 + i % 4;
        expect_ok(dem2d_shape_create_ellipse(NULL, aspect, 1, &lib->shapes[ELLIPSE][i]), "ellipse");
        for (int k = 0; k < sides; k++) { /* on a circle: convex whatever the angles */
            const double t = 2 * PI * (k + uniform(-0.3, 0.3)) / sides;
            points[k].x = cos(t), points[k].y = sin(t);
        }
        expect_ok(dem2d_shape_create_polygon(NULL, points, sides, 0, &lib->shapes[POLYGON][i]),
                  "polygon");
    }
}

/* --- packing -------------------------------------------------------------------------------- */

typedef struct packing {
    dem2d_world *world;
    dem2d_particle_id ids[GRAINS];
    int types[GRAINS];
} packing;

static void add_grains(packing *p, const library *lib, dem2d_material_id material) {
    const int columns = 23; /* and 22 rows of cells that hold any grain at any angle */
    const double cell = 0.1;
    dem2d_shape_id ids[TYPES][TEMPLATES];
    for (int t = 0; t < TYPES; t++)
        for (int i = 0; i < lib->count[t]; i++)
            expect_ok(dem2d_world_add_shape(p->world, lib->shapes[t][i], &ids[t][i]), "shape");
    for (int i = 0; i < GRAINS; i++) {
        const int type = (int)uniform(0, TYPES), slot = (int)uniform(0, lib->count[type]);
        dem2d_particle_desc grain = {0};
        dem2d_shape_info info;
        expect_ok(dem2d_shape_get(lib->shapes[type][slot], &info), "shape");
        grain.scale = uniform(0.02, 0.03) / info.equivalent; /* equivalent diameter 0.04 - 0.06 */
        grain.shape = ids[type][slot], grain.material = material;
        grain.position.x = (i % columns - (columns - 1) / 2.0) * cell;
        grain.position.y = (i / columns - (columns - 1) / 2.0) * cell;
        grain.angle = uniform(0, 2 * PI);
        p->types[i] = type;
        expect_ok(dem2d_world_add_particle(p->world, &grain, &p->ids[i]), "particle");
    }
}

/* Left, right, bottom, top: servo walls that meet at 100 kPa. */
static dem2d_wall_desc side_desc(dem2d_material_id material, int which) {
    const double side = which % 2 ? 1 : -1;
    dem2d_wall_desc wall = {0};
    wall.material = material;
    wall.normal = which < 2 ? vec(-side, 0) : vec(0, -side);
    wall.point = which < 2 ? vec(1.2 * side, 0) : vec(0, 1.2 * side);
    wall.mode = DEM2D_WALL_SERVO, wall.stress = 1e5, wall.max_speed = 0.5;
    return wall;
}

static void add_walls(packing *p, dem2d_material_id material) {
    dem2d_wall_id ids[4];
    for (int i = 0; i < 4; i++) {
        dem2d_wall_desc wall = side_desc(material, i);
        wall.length = 1;
        expect_ok(dem2d_world_add_wall(p->world, &wall, &ids[i]), "wall");
    }
    for (int i = 0; i < 4; i++) { /* all four are known now: the length is the other two's gap */
        dem2d_wall_desc wall = side_desc(material, i);
        wall.spans[0] = ids[i < 2 ? 2 : 0], wall.spans[1] = ids[i < 2 ? 3 : 1];
        expect_ok(dem2d_world_set_wall(p->world, ids[i], &wall), "wall");
    }
}

/* Squeezes until the kinetic energy is a thousandth of that in the springs, or 4 s have
   passed: faces, with one contact point each, never come wholly to rest. */
static void make_packing(packing *p, const library *lib) {
    dem2d_world_desc scene = {0};
    dem2d_material_desc stone = {
        .density = 2700, .normal_stiffness = 1e7, .tangential_stiffness = 1e7, .friction = 0.2};
    dem2d_material_id material;
    dem2d_energy energy;
    int steps = 0;
    scene.time_step = 1e-4, scene.local_damping = 0.7;
    expect_ok(dem2d_world_create(&scene, &p->world), "world");
    expect_ok(dem2d_world_add_material(p->world, &stone, &material), "material");
    add_grains(p, lib, material);
    add_walls(p, material);
    do {
        expect_ok(dem2d_world_step(p->world, 1000, NULL), "step");
        expect_ok(dem2d_world_energy(p->world, &energy), "energy");
        steps += 1000;
    } while (steps < 40000 && !(energy.translational + energy.rotational < 1e-3 * energy.normal));
    dem2d_packing info;
    expect_ok(dem2d_world_packing(p->world, &info), "packing");
    printf("%d grains after %d steps: coordination %.2f, mean overlap / radius %.2f %%, kinetic / "
           "spring energy %.1e\n\n",
           GRAINS, steps, info.coordination, 100 * info.mean_overlap,
           (energy.translational + energy.rotational) / energy.normal);
}

/* --- counting ------------------------------------------------------------------------------- */

typedef struct tally {
    int64_t pairs, calls;
} tally;

typedef struct counts {
    tally by_type[TYPES][TYPES]; /* upper triangle */
    tally fs[2], all[2];         /* 1: in contact */
    int64_t unresolved;
    double seconds;
} counts;

static void add(tally *t, int calls) {
    t->pairs++, t->calls += calls;
}

static double mean(tally t) {
    return t.pairs ? (double)t.calls / (double)t.pairs : 0;
}

static void count_pair(counts *c, int type_a, int type_b, const dem2d_contact *contact) {
    const int low = type_a < type_b ? type_a : type_b, high = type_a + type_b - low;
    const int touching = contact->state != DEM2D_SEPARATED;
    add(&c->by_type[low][high], contact->support_calls);
    add(&c->all[touching], contact->support_calls);
    if (low == FS && high == FS) add(&c->fs[touching], contact->support_calls);
    c->unresolved += contact->state == DEM2D_UNRESOLVED;
}

static void count_pairs(const packing *p, counts *c) {
    static dem2d_particle_info info[GRAINS];
    const clock_t start = clock();
    for (int i = 0; i < GRAINS; i++)
        expect_ok(dem2d_world_get_particle(p->world, p->ids[i], &info[i]), "particle");
    for (int i = 0; i < GRAINS; i++) {
        for (int k = i + 1; k < GRAINS; k++) {
            dem2d_contact contact;
            const double dx = info[k].pose.position.x - info[i].pose.position.x;
            const double dy = info[k].pose.position.y - info[i].pose.position.y;
            const double reach = info[i].radius + info[k].radius;
            if (dx * dx + dy * dy >= reach * reach) continue;
            expect_ok(dem2d_pair_overlap(dem2d_world_shape(p->world, info[i].shape), info[i].pose,
                                         dem2d_world_shape(p->world, info[k].shape), info[k].pose,
                                         NULL, &contact),
                      "overlap");
            count_pair(c, p->types[i], p->types[k], &contact);
        }
    }
    c->seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
}

/* "here", the papers' figure or a dash, and a mark where it is exceeded by more than 0.5. */
static void print_figures(const char *name, tally t, double p, double f) {
    printf("%-18s %7lld %8.2f", name, (long long)t.pairs, mean(t));
    if (p > 0)
        printf(" %8.2f", p);
    else
        printf(" %8s", "-");
    if (f > 0)
        printf(" %8.2f", f);
    else
        printf(" %8s", "-");
    printf("%s\n", (p > 0 && mean(t) > p + 0.5) || (f > 0 && mean(t) > f + 0.5) ? "  above" : "");
}

static void print_counts(const counts *c) {
    tally both = c->all[0];
    both.pairs += c->all[1].pairs, both.calls += c->all[1].calls;
    printf("%-18s %7s %8s %8s %8s\n", "pair", "count", "here", "paper P", "paper F");
    for (int a = 0; a < TYPES; a++) {
        for (int b = a; b < TYPES; b++) {
            char name[32];
            snprintf(name, sizeof name, "%s-%s", type_names[a], type_names[b]);
            print_figures(name, c->by_type[a][b], paper_p[a][b], paper_f[a][b]);
        }
    }
    print_figures("FS-FS, contact", c->fs[1], 0, 6.4);
    print_figures("FS-FS, none", c->fs[0], 0, 1.0);
    print_figures("all, contact", c->all[1], 5.77, 0);
    print_figures("all, none", c->all[0], 1.85, 0);
    print_figures("all", both, 0, 0);
    printf("\nunresolved %lld; %.0f ns per pair\n", (long long)c->unresolved,
           1e9 * c->seconds / (double)both.pairs);
}

int main(int argc, char **argv) {
    static library lib;
    static packing p;
    static counts c;
    if (argc > 2) {
        fprintf(stderr, "usage: bench_gjk [DIR]\n");
        return 2;
    }
    make_library(&lib, argc > 1 ? argv[1] : NULL);
    make_packing(&p, &lib);
    count_pairs(&p, &c);
    print_counts(&c);
    for (int t = 0; t < TYPES; t++)
        for (int i = 0; i < lib.count[t]; i++) dem2d_shape_destroy(lib.shapes[t][i]);
    dem2d_world_destroy(p.world);
    return c.unresolved ? 1 : 0;
}
