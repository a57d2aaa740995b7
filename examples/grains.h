/* grains.h - templates of five kinds, and grains of them. */
#ifndef DEM2D_EXAMPLES_GRAINS_H
#define DEM2D_EXAMPLES_GRAINS_H

#include "readers.h"

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

/* ---- grains ---- */

/* Grains whose circle of equal area has a diameter uniform in a range, m. Gives the world the
   templates that are used. */
static inline dem2d_particle_desc *draw_grains(dem2d_world *world, dem2d_material_id material,
                                               int count, const bool kinds[KINDS], double smallest,
                                               double largest, template_set *set,
                                               uint64_t *random) {
    dem2d_particle_desc *grains = get_memory(NULL, (size_t)count, sizeof *grains);
    const size_t room = (size_t)set->count + (size_t)count; // an own one for each at most
    dem2d_shape_id *ids = get_memory(NULL, room, sizeof *ids);
    memset(grains, 0, (size_t)count * sizeof *grains);
    memset(ids, 0, room * sizeof *ids); // generation 0: not yet in the world
    for (int i = 0; i < count; i++) {
        const int t = random_template(set, kinds, random);
        const double radius = 0.5 * random_between(random, smallest, largest);
        dem2d_shape_info info;
        must(dem2d_shape_get(set->shapes[t], &info), "template");
        if (ids[t].generation == 0)
            must(dem2d_world_add_shape(world, set->shapes[t], &ids[t]), "template");
        grains[i].shape = ids[t];
        grains[i].material = material;
        grains[i].scale = radius / info.equivalent;
    }
    free(ids);
    return grains;
}

/* Places them at random without overlap, largest first, in the box from (0, 0) to (width, height).
   A box that turns out too small is made a tenth higher, and stderr says so. */
static inline void place_grains(dem2d_world *world, const dem2d_particle_desc *grains, int count,
                                double width, double *height, uint64_t seed) {
    dem2d_fill_desc fill = {0};
    dem2d_filling filling;
    dem2d_result result = DEM2D_NOT_REACHED;
    fill.grains = grains, fill.count = count, fill.tries = 2000, fill.seed = seed;
    fill.method = DEM2D_FILL_RANDOM, fill.region.box.upper.x = width;
    for (int growths = 0; growths < 50 && result == DEM2D_NOT_REACHED; growths++) {
        if (growths > 0) {
            *height *= 1.1;
            fprintf(stderr, "%s: no place for all grains; the box is now %.3g m high\n",
                    example_name, *height);
        }
        fill.region.box.upper.y = *height;
        result = dem2d_world_fill(world, &fill, NULL, 0, &filling);
    }
    must(result, "filling");
}

#endif
