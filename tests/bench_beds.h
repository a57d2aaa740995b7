/* bench_beds.h - what the benchmarks of the world share: templates of five models, and grains of
   them laid in rows. Circles of equal area have diameters uniform in 0.04 to 0.06 m. Define
   BENCH_NAME, for messages, and include dem2d.h before it. */
#ifndef BENCH_BEDS_H
#define BENCH_BEDS_H

#include "bench.h"

#define TIME_STEP 1e-4 /* s */
#define GRAVITY 9.8    /* m/s2 */
#define DENSITY 2700   /* kg/m2 */
#define STIFFNESS 1e7  /* N/m, both */
#define FRICTION 0.2
#define ARCS 10
#define ORDER 8
#define MOST_CORNERS 7
#define OUTLINE 720  /* points */
#define TEMPLATES 32 /* of each model; one circle */

enum { CIRCLE, ELLIPSE, POLYGON, BEZIER, FS, MODELS };
enum { DISCS, POLYGONS, ELLIPSES, BEZIERS, FOURIERS, MIXED, SCENES };

static uint64_t bed_state;

/* Uniform in [lower, upper): Knuth's congruential generator, high bits. */
static double bed_uniform(double lower, double upper) {
    bed_state = bed_state * 6364136223846793005u + 1442695040888963407u;
    return lower + (upper - lower) * ((double)(bed_state >> 11) * 0x1p-53);
}

/* --- templates -------------------------------------------------------------------------------- */

#define KINDS (MODELS * TEMPLATES)

/* Template i of model m is at k = m * TEMPLATES + i, its mirror image (y to -y) at k + KINDS. */
static dem2d_shape *templates[2 * KINDS];

static void draw_polygon(dem2d_shape **shape) {
    const int count = 4 + (int)bed_uniform(0, MOST_CORNERS - 3);
    const double stretch = sqrt(bed_uniform(1, 1.4)), turn = bed_uniform(0, 2 * PI);
    dem2d_vec points[MOST_CORNERS];
    for (int i = 0; i < count; i++) {
        const double angle = 2 * PI * (i + bed_uniform(-0.25, 0.25)) / count + turn;
        points[i].x = cos(angle) * stretch, points[i].y = sin(angle) / stretch;
    }
    expect_ok(dem2d_shape_create_polygon(NULL, points, count, 0, &shape[0]), "polygon");
    for (int i = 0; i < count; i++) points[i].y = -points[i].y;
    expect_ok(dem2d_shape_create_polygon(NULL, points, count, 0, &shape[KINDS]), "polygon");
}

/* Coefficients of a smooth random grain. */
static void draw_series(int order, double roughness, double *a, double *b) {
    dem2d_virtual_desc desc = {0};
    desc.radius = 1, desc.seed = (uint64_t)bed_uniform(0, 1e9);
    desc.elongation = bed_uniform(0.02, 0.08), desc.roundness = 0.02, desc.roughness = roughness;
    expect_ok(dem2d_fourier_virtual(&desc, order, a, b), "virtual grain");
}

static void draw_fourier(dem2d_shape **shape) {
    double a[ORDER + 1], b[ORDER + 1];
    draw_series(ORDER, 0.002, a, b);
    expect_ok(dem2d_shape_create_fourier(NULL, a, b, ORDER, &shape[0]), "series");
    for (int n = 0; n <= ORDER; n++) b[n] = -b[n];
    expect_ok(dem2d_shape_create_fourier(NULL, a, b, ORDER, &shape[KINDS]), "series");
}

static void make_bezier(dem2d_shape **shape) {
    double a[ORDER + 1], b[ORDER + 1];
    dem2d_vec outline[OUTLINE], control[3 * ARCS];
    dem2d_shape *grain;
    draw_series(ORDER, 0.002, a, b);
    expect_ok(dem2d_shape_create_fourier(NULL, a, b, ORDER, &grain), "series");
    expect_ok(dem2d_shape_outline(grain, dem2d_pose_make(0, 0, 0, 1), OUTLINE, outline), "outline");
    expect_ok(dem2d_bezier_fit(NULL, outline, OUTLINE, ARCS, control), "polybezier");
    expect_ok(dem2d_shape_create_bezier(NULL, control, ARCS, &shape[0]), "polybezier");
    for (int i = 0; i < 3 * ARCS; i++) control[i].y = -control[i].y;
    expect_ok(dem2d_shape_create_bezier(NULL, control, ARCS, &shape[KINDS]), "polybezier");
    dem2d_shape_destroy(grain);
}

static void make_templates(void) {
    for (int i = 0; i < TEMPLATES; i++) {
        const double root = sqrt(bed_uniform(1, 2.5));
        dem2d_shape **t = templates + i;
        for (int mirror = 0; mirror <= KINDS; mirror += KINDS) {
            dem2d_shape **ellipse = t + mirror + ELLIPSE * TEMPLATES;
            expect_ok(dem2d_shape_create_circle(NULL, 1, t + mirror), "circle");
            expect_ok(dem2d_shape_create_ellipse(NULL, root, 1 / root, ellipse), "ellipse");
        }
        draw_polygon(t + POLYGON * TEMPLATES);
        make_bezier(t + BEZIER * TEMPLATES);
        draw_fourier(t + FS * TEMPLATES);
    }
}

static int random_template(int scene) {
    static const int only[MIXED] = {CIRCLE, POLYGON, ELLIPSE, BEZIER, FS};
    const int model = scene == MIXED ? (int)bed_uniform(0, MODELS) : only[scene];
    return model == CIRCLE ? 0 : model * TEMPLATES + (int)bed_uniform(0, TEMPLATES);
}

/* --- beds ------------------------------------------------------------------------------------- */

typedef struct grain {
    int shape; /* of the bed's templates */
    double scale, x, y, angle;
} grain;

/* Grains at rest in a box; open above when top is 0. */
typedef struct bed {
    dem2d_shape *const *shapes;
    int shape_count, count;
    grain *grains;
    double left, right, bottom, top;
} bed;

static bed make_bed(int count) {
    bed b = {templates, COUNT_OF(templates), count, NULL, 0, 0, 0, 0};
    b.grains = get_memory((size_t)count, sizeof *b.grains);
    return b;
}

static double bounding_radius(const bed *b, const grain *g) {
    dem2d_shape_info info;
    expect_ok(dem2d_shape_get(b->shapes[g->shape], &info), "template");
    return info.circumscribed * g->scale;
}

static grain random_grain(const bed *b, int template) {
    dem2d_shape_info info;
    grain g = {template, 0, 0, 0, 0};
    expect_ok(dem2d_shape_get(b->shapes[template], &info), "template");
    g.scale = 0.5 * bed_uniform(0.04, 0.06) / info.equivalent;
    g.angle = bed_uniform(-PI, PI);
    return g;
}

/* Rows from the left wall to the right one, each as high as its largest grain. */
static void lay_rows(bed *b) {
    double x = b->left, row = b->bottom, height = 0;
    for (int i = 0; i < b->count; i++) {
        grain *g = &b->grains[i];
        const double room = bounding_radius(b, g) * bed_uniform(1.01, 1.1);
        if (x + 2 * room > b->right) x = b->left, row += height, height = 0;
        g->x = x + room, g->y = row + room;
        x += 2 * room, height = fmax(height, 2 * room);
    }
}

/* Grains of a scene, drawn by a seed, in rows `width` wide. */
static bed draw_bed(int scene, int count, uint64_t seed, double width) {
    bed b = make_bed(count);
    bed_state = seed;
    b.right = width;
    for (int i = 0; i < count; i++) b.grains[i] = random_grain(&b, random_template(scene));
    lay_rows(&b);
    return b;
}

/* Adds the bed's grains, and the templates they use, to a world. */
static void add_bed(dem2d_world *world, const bed *b, dem2d_material_id material,
                    dem2d_particle_id *ids) {
    dem2d_shape_id *shapes = get_memory((size_t)b->shape_count, sizeof *shapes);
    for (int i = 0; i < b->count; i++) {
        const grain *g = &b->grains[i];
        dem2d_shape_id *shape = &shapes[g->shape];
        dem2d_particle_desc desc = {0};
        if (shape->generation == 0)
            expect_ok(dem2d_world_add_shape(world, b->shapes[g->shape], shape), "shape");
        desc.shape = *shape, desc.material = material, desc.scale = g->scale;
        desc.position.x = g->x, desc.position.y = g->y, desc.angle = g->angle;
        expect_ok(dem2d_world_add_particle(world, &desc, &ids[i]), "particle");
    }
    free(shapes);
}

#endif
