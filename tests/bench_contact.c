/* bench_contact [--quick] [OUTDIR] - run time against error of dem2d_pair_contact, by pair of shape
   types, and of dem2d_pairs_contact, beside GJK with EPA and, when compiled with WITH_CCD, beside
   libccd.

   Poses are made backwards: direction and depth first, then the place of the second shape. What
   is true of each pose is found here, in long double, from the data the shapes were made of; of
   the header only the centroid it subtracts is used. Overlaps and gaps are 1e-5 to 1e-1 of the
   smaller radius ("apart": 1e-1 to 1), sizes up to 10 : 1, aspects up to 10 where the model has
   them; all ellipses of type ellipse2 have aspect 2.

   Writes contact.csv, contact.gp and, where gnuplot is installed, contact.svg (error against time)
   to OUTDIR, build/bench_contact by default. Exit status: 0, 1 if an answer was wrong (outside its
   own error bound, on the wrong side, not a number), 2 for bad usage. Speed never fails. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#define BENCH_NAME "bench_contact"
#include "bench.h"

#ifdef WITH_CCD
#include <ccd/ccd.h>
#include <ccd/quat.h>
#endif
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define EPS 2.220446049250313e-16
#define TEMPLATES 24 /* of each type */
#define ORDER 8
#define ARCS 10
#define CORNERS 8
#define MOST_CORNERS 1024
#define MOST_ORDER 32
#define MOST_POSES 1000
#define MOST_REPEATS 9
#define ROUNDING (16 * EPS) /* what the header promises, of R_A + R_B + |d| */

enum { CIRCLE, ELLIPSE, POLYGON, ROUNDED, BEZIER, FS, TYPES, ELLIPSE_2 = TYPES, SETS };
enum { OVERLAP, GAP, APART, CLASSES };

static const char *const set_names[SETS] = {"circle", "ellipse", "polygon", "rounded",
                                            "bezier", "FS",      "ellipse2"};
static const char *const class_names[CLASSES] = {"overlap", "gap", "apart"};
static const double class_range[CLASSES][2] = {{1e-5, 1e-1}, {1e-5, 1e-1}, {1e-1, 1}}; /* of R */

static double log_uniform(double lower, double upper) {
    return exp(uniform(log(lower), log(upper)));
}

/* --- templates ------------------------------------------------------------------------------ */

typedef struct arc {
    dem2d_vec start, d0, d1, d2; /* and the three differences of control points */
    dem2d_vec end;               /* the last of them that is not 0: tangent at the end */
} arc;

/* A shape, and the data it was made of: what the header keeps of them is not looked at, except
   for the centroid it subtracts. */
typedef struct model {
    int type, count;          /* count: corners, arcs, order */
    double half[2], rounding; /* circle, ellipse: half axes */
    dem2d_vec points[MOST_CORNERS];
    double a[MOST_ORDER + 1], b[MOST_ORDER + 1];
    dem2d_vec local[MOST_CORNERS]; /* points less the centroid, rounded */
    arc arcs[ARCS];                /* the same */
    dem2d_shape *shape;
    dem2d_shape_info info;
} model;

/* The parts that plain double code reads. */
static void finish(model *m) {
    const int points = m->type == BEZIER ? 3 * m->count : m->type == FS ? 0 : m->count;
    expect_ok(dem2d_shape_get(m->shape, &m->info), "shape");
    for (int i = 0; i < points; i++) {
        m->local[i].x = m->points[i].x - m->info.offset.x;
        m->local[i].y = m->points[i].y - m->info.offset.y;
    }
    for (int k = 0; m->type == BEZIER && k < m->count; k++) {
        const dem2d_vec *p = &m->local[3 * k], last = m->local[3 * (k + 1) % points];
        m->arcs[k].start = p[0];
        m->arcs[k].d0.x = p[1].x - p[0].x, m->arcs[k].d0.y = p[1].y - p[0].y;
        m->arcs[k].d1.x = p[2].x - p[1].x, m->arcs[k].d1.y = p[2].y - p[1].y;
        m->arcs[k].d2.x = last.x - p[2].x, m->arcs[k].d2.y = last.y - p[2].y;
        m->arcs[k].end = m->arcs[k].d2;
        if (last.x == p[2].x && last.y == p[2].y) m->arcs[k].end = m->arcs[k].d1;
    }
}

static void model_ellipse(model *m, int type, double aspect) {
    m->type = type, m->half[0] = 1, m->half[1] = 1 / aspect;
    expect_ok(type == CIRCLE ? dem2d_shape_create_circle(NULL, 1, &m->shape)
                             : dem2d_shape_create_ellipse(NULL, 1, m->half[1], &m->shape),
              "ellipse");
}

/* Corners on an ellipse, convex whatever their angles; rounding is a part of the inner radius. */
static void model_polygon(model *m, int count, double aspect, double rounding) {
    m->type = rounding > 0 ? ROUNDED : POLYGON, m->count = count;
    for (int k = 0; k < count; k++) {
        const double t = 2 * PI * (k + uniform(-0.3, 0.3)) / count;
        m->points[k].x = cos(t), m->points[k].y = sin(t) / aspect;
    }
    m->rounding = rounding / aspect;
    expect_ok(dem2d_shape_create_polygon(NULL, m->points, count, m->rounding, &m->shape),
              "polygon");
}

static void virtual_grain(int order, double *a, double *b) {
    dem2d_virtual_desc desc = {0};
    desc.radius = 1, desc.seed = random_bits(&random_state);
    desc.elongation = uniform(0, 0.4);
    desc.roundness = uniform(0, 0.1), desc.roughness = uniform(0, 0.02);
    expect_ok(dem2d_fourier_virtual(&desc, order, a, b), "virtual grain");
}

static void ellipse_outline(dem2d_vec *points, int count, double aspect) {
    for (int i = 0; i < count; i++) {
        const double t = 2 * PI * i / count;
        points[i].x = cos(t), points[i].y = sin(t) / aspect;
    }
}

/* Every other one fitted to an ellipse: Fejer's weights keep any such series convex. */
static void make_fourier(model *m, int order, int index) {
    dem2d_vec outline[400];
    m->type = FS, m->count = order;
    if (index % 2 == 0) {
        virtual_grain(order, m->a, m->b);
    } else {
        ellipse_outline(outline, COUNT_OF(outline), log_uniform(1, 10));
        expect_ok(dem2d_fourier_fit(NULL, outline, COUNT_OF(outline), order, 0, m->a, m->b), "fit");
        for (int n = 1; n <= order; n++) {
            m->a[n] *= 1 - n / (order + 1.0);
            m->b[n] *= 1 - n / (order + 1.0);
        }
    }
    expect_ok(dem2d_shape_create_fourier(NULL, m->a, m->b, order, &m->shape), "Fourier series");
}

static void make_bezier(model *m, int index) {
    dem2d_vec outline[400];
    m->type = BEZIER, m->count = ARCS;
    if (index % 2 == 0) {
        double a[ORDER + 1], b[ORDER + 1];
        dem2d_shape *grain;
        virtual_grain(ORDER, a, b);
        expect_ok(dem2d_shape_create_fourier(NULL, a, b, ORDER, &grain), "Fourier series");
        expect_ok(
            dem2d_shape_outline(grain, dem2d_pose_make(0, 0, 0, 1), COUNT_OF(outline), outline),
            "outline");
        dem2d_shape_destroy(grain);
    } else {
        ellipse_outline(outline, COUNT_OF(outline), log_uniform(1, 10));
    }
    expect_ok(dem2d_bezier_fit(NULL, outline, COUNT_OF(outline), ARCS, m->points), "Bezier fit");
    expect_ok(dem2d_shape_create_bezier(NULL, m->points, ARCS, &m->shape), "polybezier");
}

static void make_model(model *m, int set, int index) {
    const double drawn = log_uniform(1, 10);
    const double aspect = set == CIRCLE ? 1 : set == ELLIPSE_2 ? 2 : drawn;
    if (set == POLYGON || set == ROUNDED)
        model_polygon(m, CORNERS, aspect, set == ROUNDED ? uniform(0.05, 0.3) : 0);
    else if (set == BEZIER)
        make_bezier(m, index);
    else if (set == FS)
        make_fourier(m, ORDER, index);
    else
        model_ellipse(m, set == CIRCLE ? CIRCLE : ELLIPSE, aspect);
    finish(m);
}

/* --- support, in double ----------------------------------------------------------------------- */

static dem2d_vec plain_polygon(const model *m, dem2d_vec w) {
    dem2d_vec best = m->local[0];
    double most = best.x * w.x + best.y * w.y;
    for (int k = 1; k < m->count; k++) {
        const double value = m->local[k].x * w.x + m->local[k].y * w.y;
        if (value > most) most = value, best = m->local[k];
    }
    if (m->rounding > 0) {
        const double f = m->rounding / sqrt(w.x * w.x + w.y * w.y);
        best.x += f * w.x, best.y += f * w.y;
    }
    return best;
}

static dem2d_vec plain_bezier(const model *m, dem2d_vec w) {
    const arc *c = &m->arcs[m->count - 1];
    bool rises = c->end.x * w.x + c->end.y * w.y > 0;
    for (int k = 0; k < m->count; k++) { /* the one that rises, then falls */
        const dem2d_vec end = m->arcs[k].end;
        const bool rose = rises;
        c = &m->arcs[k], rises = end.x * w.x + end.y * w.y > 0;
        if (rose && !rises) break;
    }
    const double q0 = c->d0.x * w.x + c->d0.y * w.y, q1 = c->d1.x * w.x + c->d1.y * w.y;
    const double q2 = c->d2.x * w.x + c->d2.y * w.y;
    double t = 0;
    const double root = sqrt(fmax(q1 * q1 - q0 * q2, 0));
    const double top = q1 > 0 ? q1 + root : q0, bottom = q1 > 0 ? top - q2 : q0 + root - q1;
    if (bottom > 0) t = top / bottom;
    const double w0 = t * (3 - t * (3 - t)), w1 = t * t * (3 - 2 * t), w2 = t * t * t;
    return (dem2d_vec){c->start.x + w0 * c->d0.x + w1 * c->d1.x + w2 * c->d2.x,
                       c->start.y + w0 * c->d0.y + w1 * c->d1.y + w2 * c->d2.y};
}

static dem2d_vec plain_fourier(const model *m, dem2d_vec w) {
    const double length = sqrt(w.x * w.x + w.y * w.y), x = w.x / length, y = w.y / length;
    double c = 1, s = 0, p = m->a[0] / 2, slope = 0;
    for (int n = 1; n <= m->count; n++) {
        const double turned = c * x - s * y;
        s = c * y + s * x, c = turned;
        p += m->a[n] * c + m->b[n] * s;
        slope += n * (m->b[n] * c - m->a[n] * s);
    }
    return (dem2d_vec){p * x - slope * y - m->info.offset.x, p * y + slope * x - m->info.offset.y};
}

/* Farthest point of a template along w, of any length. */
static dem2d_vec plain_support(const model *m, dem2d_vec w) {
    if (m->type == POLYGON || m->type == ROUNDED) return plain_polygon(m, w);
    if (m->type == BEZIER) return plain_bezier(m, w);
    if (m->type == FS) return plain_fourier(m, w);
    const double a = m->half[0] * m->half[0], b = m->half[1] * m->half[1];
    const double h = sqrt(a * w.x * w.x + b * w.y * w.y);
    return (dem2d_vec){a * w.x / h, b * w.y / h};
}

/* The same of a shape at a pose, relative to its position. */
static dem2d_vec plain_posed(const model *m, const dem2d_pose *pose, dem2d_vec u) {
    const double c = pose->rotation.c, s = pose->rotation.s;
    const dem2d_vec w = {c * u.x + s * u.y, c * u.y - s * u.x}, p = plain_support(m, w);
    return (dem2d_vec){pose->scale * (c * p.x - s * p.y), pose->scale * (s * p.x + c * p.y)};
}

/* --- support, in long double ------------------------------------------------------------------ */

typedef struct point {
    long double x, y;
} point;

static long double dot(point a, point b) {
    return a.x * b.x + a.y * b.y;
}

static long double cross(point a, point b) {
    return a.x * b.y - a.y * b.x;
}

static point unit(point a) {
    const long double length = sqrtl(dot(a, a));
    return (point){a.x / length, a.y / length};
}

static point wide(dem2d_vec v) {
    return (point){v.x, v.y};
}

static dem2d_vec narrow(point p) {
    return (dem2d_vec){(double)p.x, (double)p.y};
}

static point exact_polygon(const model *m, point w) {
    point best = wide(m->points[0]);
    for (int k = 1; k < m->count; k++)
        if (dot(wide(m->points[k]), w) > dot(best, w)) best = wide(m->points[k]);
    return (point){best.x + m->rounding * w.x, best.y + m->rounding * w.y};
}

/* Point of the arc p, control points p0 to p3, at t (de Casteljau). */
static point arc_point(const point p[4], long double t) {
    point q[4] = {p[0], p[1], p[2], p[3]};
    for (int level = 3; level > 0; level--)
        for (int i = 0; i < level; i++) {
            q[i].x += t * (q[i + 1].x - q[i].x);
            q[i].y += t * (q[i + 1].y - q[i].y);
        }
    return q[0];
}

/* Of all joints and all places where an arc is level, the farthest. With t = r / (1 + r) the
   slope of the arc along w is q0 + 2 q1 r + q2 r^2 but for a positive factor. */
static point exact_bezier(const model *m, point w) {
    point best = wide(m->points[0]);
    for (int k = 0; k < m->count; k++) {
        point p[4];
        long double q[3];
        for (int i = 0; i < 4; i++) p[i] = wide(m->points[(3 * k + i) % (3 * m->count)]);
        for (int i = 0; i < 3; i++) q[i] = dot(p[i + 1], w) - dot(p[i], w);
        if (dot(p[0], w) > dot(best, w)) best = p[0];
        if (q[0] < 0 || q[2] > 0) continue;
        const long double root = sqrtl(q[1] * q[1] - q[0] * q[2]);
        const long double top = q[1] > 0 ? q[1] + root : q[0];
        const long double bottom = q[1] > 0 ? q[1] + root - q[2] : q[0] + root - q[1];
        if (!(bottom > 0)) continue;
        const point level = arc_point(p, top / bottom);
        if (dot(level, w) > dot(best, w)) best = level;
    }
    return best;
}

static point exact_fourier(const model *m, point w) {
    long double c = 1, s = 0, p = m->a[0] / 2.0L, slope = 0;
    for (int n = 1; n <= m->count; n++) {
        const long double turned = c * w.x - s * w.y;
        s = c * w.y + s * w.x, c = turned;
        p += m->a[n] * c + m->b[n] * s;
        slope += n * (m->b[n] * c - m->a[n] * s);
    }
    return (point){p * w.x - slope * w.y, p * w.y + slope * w.x};
}

static point exact_ellipse(const model *m, point w) {
    const long double x = m->half[0] * w.x, y = m->half[1] * w.y, h = sqrtl(x * x + y * y);
    return (point){m->half[0] * x / h, m->half[1] * y / h};
}

/* Farthest point of a shape at a pose along u, relative to its position. The pose's rotation is
   taken as it is, a unit pair only to rounding: the shape is then the image by that matrix. */
static point exact_posed(const model *m, const dem2d_pose *pose, point u) {
    const long double c = pose->rotation.c, s = pose->rotation.s;
    const point w = unit((point){c * u.x + s * u.y, c * u.y - s * u.x});
    point p;
    if (m->type == POLYGON || m->type == ROUNDED)
        p = exact_polygon(m, w);
    else if (m->type == BEZIER)
        p = exact_bezier(m, w);
    else
        p = m->type == FS ? exact_fourier(m, w) : exact_ellipse(m, w);
    p.x -= m->info.offset.x, p.y -= m->info.offset.y;
    return (point){pose->scale * (c * p.x - s * p.y), pose->scale * (s * p.x + c * p.y)};
}

/* --- truth ------------------------------------------------------------------------------------ */

typedef struct query {
    const model *a, *b;
    dem2d_pose pose_a, pose_b;
    double size;   /* R_A + R_B + |d| */
    double radius; /* the smaller of R_A and R_B */
    double rho;    /* sum of the least radii of curvature */
    long double depth;
    point normal;
    bool unique;     /* no other direction has nearly this depth */
    dem2d_vec start; /* nearly the normal */
} query;

#define SCAN 720
static point scan[SCAN];

typedef struct minimum {
    point u;
    long double h;
} minimum;

typedef struct minima {
    minimum list[128];
    int count;
} minima;

/* Overlap along u, and its derivative by the angle of u. */
static long double exact_value(const query *q, point u, long double *slope) {
    const point a = exact_posed(q->a, &q->pose_a, u);
    const point b = exact_posed(q->b, &q->pose_b, (point){-u.x, -u.y});
    const point pa = wide(q->pose_a.position), pb = wide(q->pose_b.position);
    const point v = {a.x - b.x - (pb.x - pa.x), a.y - b.y - (pb.y - pa.y)};
    *slope = cross(u, v);
    return dot(u, v);
}

static double plain_value(const query *q, dem2d_vec u) {
    const dem2d_vec a = plain_posed(q->a, &q->pose_a, u);
    const dem2d_vec b = plain_posed(q->b, &q->pose_b, (dem2d_vec){-u.x, -u.y});
    return (a.x - b.x - (q->pose_b.position.x - q->pose_a.position.x)) * u.x +
           (a.y - b.y - (q->pose_b.position.y - q->pose_a.position.y)) * u.y;
}

static void keep(minima *found, minimum m) {
    for (int i = 0; i < found->count; i++) {
        minimum *other = &found->list[i];
        if (fabsl(cross(other->u, m.u)) < 1e-9L && dot(other->u, m.u) > 0) {
            if (m.h < other->h) *other = m;
            return;
        }
    }
    if (found->count < COUNT_OF(found->list)) found->list[found->count++] = m;
}

/* The local minimum between two directions where the value falls and rises: by the slope, which
   is sharp where the value is flat, and works at kinks too. */
static void bisect(const query *q, point lower, point upper, minima *found) {
    minimum m = {upper, 0};
    for (int i = 0; i < 80; i++) {
        long double slope;
        m.u = unit((point){lower.x + upper.x, lower.y + upper.y});
        m.h = exact_value(q, m.u, &slope);
        if (slope == 0) break;
        if (slope < 0)
            lower = m.u;
        else
            upper = m.u;
    }
    keep(found, m);
}

/* All local minima between two directions, as far as so many parts tell them apart. */
static void search(const query *q, point from, point to, int parts, minima *found) {
    long double before, after;
    point lower = from;
    (void)exact_value(q, from, &before);
    for (int i = 1; i <= parts; i++) {
        const long double f = (long double)i / parts;
        const point between = {from.x + f * (to.x - from.x), from.y + f * (to.y - from.y)};
        const point upper =
            i < parts ? unit(between) : to; /* where the next cell begins, exactly */
        (void)exact_value(q, upper, &after);
        if (before < 0 && after >= 0) bisect(q, lower, upper, found);
        lower = upper, before = after;
    }
}

/* Outward normal of edge k at the pose. */
static point edge_normal(const model *m, const dem2d_pose *pose, int k) {
    const point p = wide(m->points[k]), next = wide(m->points[(k + 1) % m->count]);
    const long double c = pose->rotation.c, s = pose->rotation.s;
    const point n = {next.y - p.y, p.x - next.x};
    return unit((point){c * n.x - s * n.y, s * n.x + c * n.y});
}

/* A kink of the value: edges of a polygon are where its minima are. */
static void search_edges(const query *q, const model *m, const dem2d_pose *pose, int side,
                         double *least, minima *found) {
    if (m->type != POLYGON && m->type != ROUNDED) return;
    for (int k = 0; k < m->count; k++) {
        const long double turn = 1e-9L;
        point u = edge_normal(m, pose, k);
        u.x *= side, u.y *= side;
        const double h = plain_value(q, narrow(u));
        if (h > *least + 1e-8 * q->size) continue;
        if (h < *least) *least = h;
        search(q, unit((point){u.x + turn * u.y, u.y - turn * u.x}),
               unit((point){u.x - turn * u.y, u.y + turn * u.x}), 1, found);
    }
}

/* A scan in double, then every local minimum that can be the least one in long double: in the
   cells of the scan that are nearly the lowest, and beside its local minima, as the value can fall
   by 0.01 of the size between two directions. */
static void find_truth(query *q) {
    double h[SCAN], least = HUGE_VAL;
    minima found;
    found.count = 0;
    for (int i = 0; i < SCAN; i++) {
        h[i] = plain_value(q, narrow(scan[i]));
        if (h[i] < least) least = h[i];
    }
    const double sure = least + 1e-4 * q->size, bound = least + 0.02 * q->size;
    for (int i = 0; i < SCAN; i++) {
        const int before = (i + SCAN - 1) % SCAN, next = (i + 1) % SCAN, after = (i + 2) % SCAN;
        const bool low = (h[i] <= h[before] && h[i] <= h[next] && h[i] <= bound) ||
                         (h[next] <= h[i] && h[next] <= h[after] && h[next] <= bound);
        if (low || h[i] <= sure || h[next] <= sure) search(q, scan[i], scan[next], 8, &found);
    }
    search_edges(q, q->a, &q->pose_a, 1, &least, &found);
    search_edges(q, q->b, &q->pose_b, -1, &least, &found);
    if (found.count == 0) { /* all the same to the last bit */
        long double slope;
        found.list[found.count++] = (minimum){scan[0], exact_value(q, scan[0], &slope)};
    }
    int best = 0;
    for (int i = 1; i < found.count; i++)
        if (found.list[i].h < found.list[best].h) best = i;
    q->depth = found.list[best].h, q->normal = found.list[best].u, q->unique = true;
    for (int i = 0; i < found.count; i++)
        if (i != best && found.list[i].h < q->depth + 1e-9L * q->size) q->unique = false;
}

/* --- poses ------------------------------------------------------------------------------------ */

static point farthest(const query *q, int shape, point u) {
    const model *m = shape ? q->b : q->a;
    return exact_posed(m, shape ? &q->pose_b : &q->pose_a, u);
}

/* A random place on a random edge of the first or the second shape: u from A to B there. */
static point on_edge(const query *q, int shape, point *u) {
    const model *m = shape ? q->b : q->a;
    const dem2d_pose *pose = shape ? &q->pose_b : &q->pose_a;
    const int k = (int)uniform(0, m->count);
    const dem2d_vec from = m->local[k], to = m->local[(k + 1) % m->count];
    const double t = uniform(0.02, 0.98), side = shape ? -1 : 1, c = pose->rotation.c;
    const double x = from.x + t * (to.x - from.x), y = from.y + t * (to.y - from.y);
    const double s = pose->rotation.s, r = m->rounding;
    const point n = edge_normal(m, pose, k);
    u->x = side * n.x, u->y = side * n.y;
    return (point){pose->scale * (c * x - s * y + r * n.x),
                   pose->scale * (s * x + c * y + r * n.y)};
}

/* Which shape's edge the contact is on; -1 for none. Two sharp polygons always meet at an edge,
   other pairs with edges every other time. */
static int pick_edge(const query *q) {
    const bool edges[2] = {q->a->type == POLYGON || q->a->type == ROUNDED,
                           q->b->type == POLYGON || q->b->type == ROUNDED};
    const bool sharp = q->a->type == POLYGON && q->b->type == POLYGON;
    if ((!edges[0] && !edges[1]) || (!sharp && uniform(0, 1) < 0.5)) return -1;
    if (edges[0] && edges[1]) return uniform(0, 1) < 0.5;
    return edges[1];
}

static void place(query *q, double depth) {
    const double angle = uniform(0, 2 * PI);
    const int edge = pick_edge(q);
    point u = {cos(angle), sin(angle)}, a, b;
    u = unit(u);
    if (edge == 0) a = on_edge(q, 0, &u);
    if (edge == 1) b = on_edge(q, 1, &u);
    if (edge != 0) a = farthest(q, 0, u);
    if (edge != 1) b = farthest(q, 1, (point){-u.x, -u.y});
    const point d = {a.x - b.x - depth * u.x, a.y - b.y - depth * u.y};
    q->pose_b.position.x = q->pose_a.position.x + (double)d.x;
    q->pose_b.position.y = q->pose_a.position.y + (double)d.y;
    const double dx = q->pose_b.position.x - q->pose_a.position.x;
    const double dy = q->pose_b.position.y - q->pose_a.position.y;
    q->size = q->a->info.circumscribed * q->pose_a.scale +
              q->b->info.circumscribed * q->pose_b.scale + sqrt(dx * dx + dy * dy);
}

/* Poses of two templates, as yet one on the other. */
static void draw_poses(query *q, const model *a, const model *b) {
    const double greater = uniform(0.5, 2), less = greater / log_uniform(1, 10);
    const bool swap = uniform(0, 1) < 0.5;
    const double ra = swap ? less : greater, rb = swap ? greater : less;
    const double x = uniform(-1, 1), y = uniform(-1, 1);
    const double angle_a = uniform(0, 2 * PI), angle_b = uniform(0, 2 * PI);
    q->a = a, q->b = b;
    q->pose_a = dem2d_pose_make(x, y, angle_a, ra / a->info.circumscribed);
    q->pose_b = dem2d_pose_make(x, y, angle_b, rb / b->info.circumscribed);
    q->radius = less;
    q->rho = a->info.rho_min * q->pose_a.scale + b->info.rho_min * q->pose_b.scale;
}

/* One query, its depth or gap in this range, of the smaller radius. The oracle may find a lesser
   depth than the one a pose was made for (beyond the radius of curvature, or across a thin shape):
   its word counts, and poses that leave their class by it are drawn again. */
static void make_query(query *q, const model *a, const model *b, int group, const double range[2]) {
    for (;;) {
        const double side = group == OVERLAP ? 1 : -1;
        draw_poses(q, a, b);
        place(q, side * q->radius * log_uniform(range[0], range[1]));
        find_truth(q);
        const double found = side * (double)q->depth / q->radius;
        if (found > 0.5 * range[0] && found < 1.01 * range[1]) break;
    }
    const double turn = uniform(-1e-3, 1e-3);
    q->start.x = (double)(q->normal.x * cosl(turn) - q->normal.y * sinl(turn));
    q->start.y = (double)(q->normal.x * sinl(turn) + q->normal.y * cosl(turn));
}

/* --- methods ---------------------------------------------------------------------------------- */

/* ARRAY: all pairs in one call, with the memory of a query in which B was turned: by a thousandth
   of a radian, or, with the tolerance of a world, by as little as in a step. */
enum { WARM, COLD, YES_NO, ARRAY, GJK_EPA, LIBCCD };

typedef struct method {
    const char *name;
    int kind;
    double tolerance; /* 0: default */
} method;

static const method methods[] = {
    {"warm", WARM, 0},           {"cold", COLD, 0},          {"pair_overlap", YES_NO, 0},
    {"array", ARRAY, 0},         {"array", ARRAY, 1e-8},     {"GJK+EPA", GJK_EPA, 1e-4},
    {"GJK+EPA", GJK_EPA, 1e-6},  {"GJK+EPA", GJK_EPA, 1e-8}, {"GJK+EPA", GJK_EPA, 1e-10},
    {"GJK+EPA", GJK_EPA, 1e-12},
#ifdef WITH_CCD
    {"libccd", LIBCCD, 1e-4},    {"libccd", LIBCCD, 1e-6},   {"libccd", LIBCCD, 1e-8},
    {"libccd", LIBCCD, 1e-10},
#endif
};
#define METHODS COUNT_OF(methods)
/* places in the list */
enum { M_WARM, M_COLD, M_YES_NO, M_ARRAY, M_STEP, M_GJK_8 = 7, M_CCD = 10 };

typedef struct row {
    int count, repeats;  /* 0: not measured */
    double ns, calls;    /* of a query, mean */
    double middle, most; /* depth error of the size: median and greatest */
    double normal;       /* greatest error, rad */
    int normals;         /* of how many poses that is */
    int ambiguous;       /* poses with two directions of the same depth: not among them */
    int proofs[8], shallow, shallow_certified;
    int wrong, failed; /* failed: libccd's own word, or unresolved */
} row;

static dem2d_contact_desc method_desc(const method *m) {
    dem2d_contact_desc desc = {0};
    desc.skip_points = true; /* depth and normal, as libccd gives them */
    desc.tolerance = m->tolerance;
    desc.solver = m->kind == GJK_EPA ? DEM2D_GJK_EPA : DEM2D_CERTIFIED;
    return desc;
}

/* The queries as one call takes them. */
static dem2d_body bodies[2 * MOST_POSES];
static dem2d_body_pair body_pairs[MOST_POSES];
static dem2d_contact_memory warm[2][MOST_POSES], memory[MOST_POSES]; /* warm: of both methods */
static dem2d_overlap overlaps[MOST_POSES];
static dem2d_contact contacts[MOST_POSES];

static void set_array(const query *q, int count, const method *m) {
    const dem2d_contact_desc desc = method_desc(m);
    const double turn = m->tolerance > 0 ? 1e-5 : 1e-3;
    dem2d_contact_memory *own = warm[m->tolerance > 0];
    memset(own, 0, sizeof warm[0]);
    for (int turned = 1; turned >= 0; turned--) {
        for (int i = 0; i < count; i++) {
            const double angle = turned * uniform(-turn, turn);
            const dem2d_pose at = q[i].pose_b;
            const dem2d_pose pose = dem2d_pose_make(at.position.x, at.position.y,
                                                    dem2d_rot_angle(at.rotation) + angle, at.scale);
            bodies[2 * i] = (dem2d_body){q[i].a->shape, q[i].pose_a};
            bodies[2 * i + 1] = (dem2d_body){q[i].b->shape, turned ? pose : at};
            body_pairs[i] = (dem2d_body_pair){2 * i, 2 * i + 1};
        }
        if (turned)
            expect_ok(dem2d_pairs_contact(NULL, bodies, 2 * count, body_pairs, count, &desc, own,
                                          overlaps, NULL),
                      "contacts");
    }
}

static double ask_array(int count, const method *m) {
    const dem2d_contact_desc desc = method_desc(m);
    double sum = 0;
    memcpy(memory, warm[m->tolerance > 0], (size_t)count * sizeof *memory);
    dem2d_pairs_contact(NULL, bodies, 2 * count, body_pairs, count, &desc, memory, overlaps, NULL);
    for (int i = 0; i < count; i++) sum += overlaps[i].depth;
    return sum;
}

/* All queries once. What comes back keeps the compiler from leaving them out. */
static double ask_all(const query *q, int count, const method *m) {
    dem2d_contact_desc desc = method_desc(m);
    dem2d_contact contact;
    double sum = 0;
    if (m->kind == ARRAY) return ask_array(count, m);
    for (int i = 0; i < count; i++) {
        if (m->kind == WARM) desc.start = q[i].start;
        if (m->kind == YES_NO)
            dem2d_pair_overlap(q[i].a->shape, q[i].pose_a, q[i].b->shape, q[i].pose_b, &desc,
                               &contact);
        else
            dem2d_pair_contact(q[i].a->shape, q[i].pose_a, q[i].b->shape, q[i].pose_b, &desc,
                               &contact);
        sum += contact.depth;
    }
    return sum;
}

static bool is_wrong(const query *q, const dem2d_contact *c, bool yes_no) {
    const double off = (double)fabsl((long double)c->depth - q->depth);
    const dem2d_contact_state other = q->depth > 0 ? DEM2D_SEPARATED : DEM2D_PENETRATING;
    const double length = c->normal.x * c->normal.x + c->normal.y * c->normal.y;
    if (c->state == other || c->state == DEM2D_TOUCHING) return true; /* none is that near */
    if (yes_no) return false;
    return !(off <= c->error + ROUNDING * q->size) || !(fabs(length - 1) < 1e-12);
}

static void judge(const query *q, const method *m, const dem2d_contact *c, row *r, double *error) {
    const bool yes_no = m->kind == YES_NO;
    const point n = wide(c->normal);
    const bool sharp = q->a->type == POLYGON && q->b->type == POLYGON;
    r->calls += c->support_calls;
    r->proofs[c->proof & 7]++;
    r->wrong += is_wrong(q, c, yes_no);
    r->failed += c->state == DEM2D_UNRESOLVED;
    *error = yes_no ? 0 : (double)(fabsl((long double)c->depth - q->depth) / q->size);
    if (fabsl(q->depth) <= 0.01L * q->radius) {
        r->shallow++;
        r->shallow_certified += c->proof != DEM2D_BY_NOTHING;
    }
    r->ambiguous += !q->unique;
    if (yes_no || !q->unique || !((double)q->depth < q->rho / 2 || sharp)) return;
    r->normals++;
    r->normal = fmax(r->normal, (double)fabsl(atan2l(cross(q->normal, n), dot(q->normal, n))));
}

static volatile double sink;

/* What the answers are worth. */
static void judge_all(const query *q, int count, int repeats, const method *m, row *r) {
    static double errors[MOST_POSES];
    dem2d_contact_desc desc = method_desc(m);
    *r = (row){0};
    r->count = count, r->repeats = repeats;
    if (m->kind == ARRAY) {
        set_array(q, count, m);
        memcpy(memory, warm[m->tolerance > 0], sizeof memory);
        expect_ok(dem2d_pairs_contact(NULL, bodies, 2 * count, body_pairs, count, &desc, memory,
                                      overlaps, contacts),
                  "contacts");
    }
    for (int i = 0; i < count; i++) {
        dem2d_contact contact = contacts[i];
        if (m->kind == WARM) desc.start = q[i].start;
        if (m->kind != ARRAY)
            expect_ok((m->kind == YES_NO ? dem2d_pair_overlap : dem2d_pair_contact)(
                          q[i].a->shape, q[i].pose_a, q[i].b->shape, q[i].pose_b, &desc, &contact),
                      "contact");
        judge(&q[i], m, &contact, r, &errors[i]);
    }
    r->calls /= count;
    r->middle = middle_of(errors, count), r->most = errors[count - 1];
}

/* --- libccd ----------------------------------------------------------------------------------- */

#ifdef WITH_CCD
/* A prism on the shape, so high that its ends never are the way out. */
typedef struct prism {
    const model *m;
    const dem2d_pose *pose;
    double z, half;
} prism;

/* EPA there has no cap and can go on for ever: after so many calls both shapes shrink to nothing,
   which ends it, and the query has failed. */
#define CCD_MOST_CALLS 1000
static int ccd_calls;

static void prism_support(const void *object, const ccd_vec3_t *dir, ccd_vec3_t *vec) {
    const prism *p = object;
    if (ccd_calls++ >= CCD_MOST_CALLS) {
        ccdVec3Set(vec, 0, 0, 0);
        return;
    }
    const dem2d_vec u = {ccdVec3X(dir), ccdVec3Y(dir)}, along_x = {1, 0};
    const dem2d_vec v = plain_posed(p->m, p->pose, u.x == 0 && u.y == 0 ? along_x : u);
    ccdVec3Set(vec, p->pose->position.x + v.x, p->pose->position.y + v.y,
               p->z + (ccdVec3Z(dir) < 0 ? -p->half : p->half));
}

/* 0: they overlap, as libccd says; depth is written then. Below 0: not, or it failed. */
static int ask_ccd(const query *q, const ccd_t *ccd, int group, double *depth) {
    const double ra = q->a->info.circumscribed * q->pose_a.scale;
    const double rb = q->b->info.circumscribed * q->pose_b.scale, half = 10 * fmax(ra, rb);
    const prism a = {q->a, &q->pose_a, 0, half};
    const prism b = {q->b, &q->pose_b, 0.2 * half, half}; /* aside: no ties along z */
    ccd_vec3_t dir, place;
    *depth = 0;
    ccd_calls = 0;
    if (group == GAP) return ccdGJKIntersect(&a, &b, ccd) ? 0 : -1;
    const int result = ccdGJKPenetration(&a, &b, ccd, depth, &dir, &place);
    return ccd_calls > CCD_MOST_CALLS ? -2 : result;
}

static ccd_t ccd_settings(const method *m) {
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.support1 = ccd.support2 = prism_support;
    ccd.max_iterations = 1000, ccd.epa_tolerance = m->tolerance;
    return ccd;
}

static void judge_ccd(const query *q, int count, int repeats, const method *m, int group, row *r) {
    static double errors[MOST_POSES];
    const ccd_t ccd = ccd_settings(m);
    int answered = 0;
    *r = (row){0};
    r->count = count, r->repeats = repeats;
    for (int i = 0; i < count; i++) {
        double depth;
        const bool overlap = ask_ccd(&q[i], &ccd, group, &depth) == 0;
        r->failed += overlap != (group == OVERLAP);
        if (overlap && group == OVERLAP)
            errors[answered++] = (double)fabsl(depth - q[i].depth) / q[i].size;
    }
    if (answered > 0) r->middle = middle_of(errors, answered), r->most = errors[answered - 1];
}

static double ask_all_ccd(const query *q, int count, const method *m, int group) {
    const ccd_t ccd = ccd_settings(m);
    double sum = 0, depth;
    for (int i = 0; i < count; i++) sum += ask_ccd(&q[i], &ccd, group, &depth) + depth;
    return sum;
}
#endif

/* --- timing ----------------------------------------------------------------------------------- */

static volatile double sink;

static double time_all(const query *q, int count, const method *m, int group) {
    const double begin = seconds();
#ifdef WITH_CCD
    if (m->kind == LIBCCD)
        sink = ask_all_ccd(q, count, m, group);
    else
#endif
        sink = ask_all(q, count, m);
    (void)group;
    return 1e9 * (seconds() - begin) / count;
}

/* Times of all methods that have a row, in turn: what else the machine does hits all of them. */
static void time_rows(const query *q, int group, row rows[]) {
    double times[COUNT_OF(methods)][MOST_REPEATS];
    for (int k = 0; k < MOST_REPEATS; k++)
        for (int m = 0; m < METHODS; m++)
            if (k < rows[m].repeats) times[m][k] = time_all(q, rows[m].count, &methods[m], group);
    for (int m = 0; m < METHODS; m++)
        if (rows[m].repeats > 0) rows[m].ns = middle_of(times[m], rows[m].repeats);
}

/* --- output ----------------------------------------------------------------------------------- */

#define PAIRS (TYPES * (TYPES + 1) / 2 + 1) /* and ellipses of aspect 2 with each other */
static const int fs_orders[] = {4, 8, 16, 32};
static const int polygon_sizes[] = {8, 16, 32, 64, 128, 256, 512, 1024};

static row table[PAIRS][CLASSES][METHODS];

static int pair_index(int a, int b) {
    int index = 0;
    if (a == ELLIPSE_2) return PAIRS - 1;
    for (int i = 0; i < a; i++) index += TYPES - i;
    return index + b - a;
}

static void pair_sets(int pair, int *a, int *b) {
    for (*a = 0; *a < TYPES; (*a)++)
        for (*b = *a; *b < TYPES; (*b)++)
            if (pair_index(*a, *b) == pair) return;
    *a = *b = ELLIPSE_2;
}

static const char *pair_name(int pair) {
    static char name[32];
    int a, b;
    pair_sets(pair, &a, &b);
    snprintf(name, sizeof name, "%s-%s", set_names[a], set_names[b]);
    return name;
}

static void print_head(FILE *csv) {
    printf("Errors of the depth in units of eps (R_A + R_B + |d|), of the normal in rad where the "
           "depth is below\nhalf the least radii of curvature; proofs in %% of the answers, "
           "`none` is UNRESOLVED or libccd's failures.\n\n");
    printf("%-17s %-7s %-12s %5s %9s %6s %9s %9s %8s | %5s %6s %5s %5s %5s | %5s\n", "pair",
           "class", "method", "tol", "ns", "calls", "median", "max", "normal", "none", "form",
           "radius", "arc", "poly", "wrong");
    fprintf(csv,
            "pair,class,method,tolerance,poses,repeats,ns,support_calls,median_error,max_error,"
            "max_error_eps,normal_error,normal_poses,ambiguous,by_nothing,by_form,by_radius,by_arc,"
            "by_polytope,shallow,shallow_certified,failed,wrong\n");
}

static void print_row(FILE *csv, const char *pair, int group, const method *m, const row *r) {
    char tolerance[16] = "";
    const double part = 100.0 / r->count;
    const bool ccd = m->kind == LIBCCD;
    if (m->tolerance > 0) snprintf(tolerance, sizeof tolerance, "%.0e", m->tolerance);
    printf("%-17s %-7s %-12s %5s %9.1f", pair, class_names[group], m->name, tolerance, r->ns);
    if (ccd)
        printf(" %6s %9.3g %9.3g %8s | %5.1f %6s %5s %5s %5s |\n", "", r->middle / EPS,
               r->most / EPS, "", part * r->failed, "", "", "", "");
    else
        printf(" %6.2f %9.3g %9.3g %8.1e | %5.1f %6.1f %5.1f %5.1f %5.1f | %5d%s\n", r->calls,
               r->middle / EPS, r->most / EPS, r->normal, part * r->proofs[DEM2D_BY_NOTHING],
               part * r->proofs[DEM2D_BY_FORM], part * r->proofs[DEM2D_BY_RADIUS],
               part * r->proofs[DEM2D_BY_ARC], part * r->proofs[DEM2D_BY_POLYTOPE], r->wrong,
               r->wrong ? "  WRONG" : "");
    fprintf(csv, "%s,%s,%s,%.0e,%d,%d,%.2f,%.4f,%.3e,%.3e,%.4g,%.3e,%d,%d", pair,
            class_names[group], m->name, m->tolerance, r->count, r->repeats, r->ns, r->calls,
            r->middle, r->most, r->most / EPS, r->normal, r->normals, r->ambiguous);
    for (int i = 0; i < DEM2D_PROOF_COUNT; i++) fprintf(csv, ",%d", r->proofs[i]);
    fprintf(csv, ",%d,%d,%d,%d\n", r->shallow, r->shallow_certified, r->failed, r->wrong);
}

/* --- aims ------------------------------------------------------------------------------------- */

static void aim(const char *what, double value, double bound, bool at_most) {
    const bool met = at_most ? value <= bound : value >= bound; /* NaN misses */
    printf("%s  %-62s %10.4g   (%s %g)\n", met ? "PASS" : "MISS", what, value,
           at_most ? "<=" : ">=", bound);
}

static double depth_error(const row *r) {
    return r->most / EPS;
}

static double normal_error(const row *r) {
    return r->normal;
}

/* The greatest of a figure over all pairs and classes. */
static void aim_worst(const char *what, double (*figure)(const row *r), int m, double bound) {
    char text[128];
    double worst = -1;
    int pair = 0, group = 0;
    for (int p = 0; p < PAIRS; p++)
        for (int c = 0; c < CLASSES; c++)
            if (table[p][c][m].count > 0 && !(figure(&table[p][c][m]) <= worst))
                worst = figure(&table[p][c][m]), pair = p, group = c;
    snprintf(text, sizeof text, "%s, %s (worst: %s %s)", what, methods[m].name, pair_name(pair),
             class_names[group]);
    aim(text, worst, bound, true);
}

/* Pairs without sharp corners, overlaps up to a hundredth of the smaller radius. */
static void aim_certified(int m) {
    char text[128];
    double least = 200;
    int shallow = 0, certified = 0, pair = 0;
    for (int p = 0; p < PAIRS; p++) {
        const row *r = &table[p][OVERLAP][m];
        int a, b;
        pair_sets(p, &a, &b);
        if (a == POLYGON || b == POLYGON || r->shallow == 0) continue;
        const double share = 100.0 * r->shallow_certified / r->shallow;
        shallow += r->shallow, certified += r->shallow_certified;
        if (share < least) least = share, pair = p;
    }
    snprintf(text, sizeof text, "certified %%, smooth, depth <= R/100, %s (worst: %s %.1f)",
             methods[m].name, pair_name(pair), least);
    aim(text, 100.0 * certified / shallow, 99.9, false);
}

static void aim_calls(int set) {
    char text[64];
    const int pair = pair_index(set, set);
    snprintf(text, sizeof text, "calls warm, %s", pair_name(pair));
    aim(text, table[pair][OVERLAP][M_WARM].calls, 2.2, true);
    snprintf(text, sizeof text, "calls cold, %s", pair_name(pair));
    aim(text, table[pair][OVERLAP][M_COLD].calls, 4.5, true);
    snprintf(text, sizeof text, "calls of pair_overlap, apart, %s (about 1)", pair_name(pair));
    aim(text, table[pair][APART][M_YES_NO].calls, 1.5, true);
}

/* Of all pairs in one call, with the memory of a step before: to be below `ns`, and once `best`. */
static void aim_time(int set, double ns, double best, double ratio) {
    char text[96];
    const row *r = table[pair_index(set, set)][OVERLAP];
    snprintf(text, sizeof text, "ns in an array, 1e-8, %s (alone %.0f, aim %g)",
             pair_name(pair_index(set, set)), r[M_WARM].ns, best);
    aim(text, r[M_STEP].ns, ns, true);
    if (ratio == 0) return;
    snprintf(text, sizeof text, "times faster than GJK+EPA 1e-8, warm, %s",
             pair_name(pair_index(set, set)));
    aim(text, r[M_GJK_8].ns / r[M_WARM].ns, ratio, false);
}

/* Against the fastest of its tolerances with no less an error than here (rounding is none). */
static void aim_ccd(int m) {
    char text[96];
    double least = HUGE_VAL;
    int pair = 0;
    if (METHODS <= M_CCD) return;
    for (int p = 0; p < PAIRS; p++) {
        const row *r = table[p][OVERLAP];
        double fastest = HUGE_VAL;
        for (int i = M_CCD; i < METHODS; i++) {
            if (r[i].most >= r[m].most || r[m].most <= ROUNDING) fastest = fmin(fastest, r[i].ns);
        }
        if (fastest / r[m].ns < least) least = fastest / r[m].ns, pair = p;
    }
    snprintf(text, sizeof text, "times faster than libccd, %s (worst: %s)", methods[m].name,
             pair_name(pair));
    aim(text, least, 10, false);
}

static void print_aims(int wrong) {
    printf("\nAims\n");
    for (int m = M_WARM; m <= M_COLD; m++) {
        aim_worst("depth error, eps", depth_error, m, 16);
        aim_worst("normal error", normal_error, m, 1e-9);
        aim_certified(m);
    }
    aim("wrong answers, all methods", wrong, 0, true);
    aim_calls(FS);
    aim_calls(ELLIPSE_2);
    aim_time(CIRCLE, 7, 5, 0);
    aim_time(POLYGON, 40, 35, 4);
    aim_time(ELLIPSE, 50, 35, 8);
    aim_time(BEZIER, 100, 70, 8);
    aim_time(FS, 67, 50, 10);
    aim_ccd(M_WARM);
    aim_ccd(M_COLD);
    if (METHODS <= M_CCD) printf("skipped: libccd: not compiled in (WITH_CCD)\n");
}

/* How many times faster than GJK and EPA to 1e-8, on the same poses in the same run. */
static void print_ratios(void) {
    printf("\nTime of GJK+EPA 1e-8 over time of\n%-17s %12s %12s %12s %12s", "", "warm overlap",
           "cold overlap", "warm gap", "cold gap");
    for (int m = M_CCD; m < METHODS; m++) printf("  libccd %.0e", methods[m].tolerance);
    printf("\n");
    for (int p = 0; p < PAIRS; p++) {
        printf("%-17s", pair_name(p));
        for (int c = OVERLAP; c <= GAP; c++)
            for (int m = M_WARM; m <= M_COLD; m++)
                printf(" %12.2f", table[p][c][M_GJK_8].ns / table[p][c][m].ns);
        for (int m = M_CCD; m < METHODS; m++)
            printf(" %13.4f", table[p][OVERLAP][M_GJK_8].ns / table[p][OVERLAP][m].ns);
        printf("\n");
    }
}

/* --- picture ---------------------------------------------------------------------------------- */

/* Errors that are nothing are drawn at 1e-17: logarithms want no zero. */
static double drawn_error(const row *r) {
    return fmax(r->most, 1e-17);
}

/* The names of pairs of one type, warm, from left to right: one below the other. */
static void write_names(FILE *file) {
    bool done[SETS] = {false};
    fprintf(file, "$names << EOD\n");
    for (int k = 0; k < SETS; k++) {
        int next = -1;
        for (int set = 0; set < SETS; set++) {
            const double ns = table[pair_index(set, set)][OVERLAP][M_WARM].ns;
            if (done[set]) continue;
            if (next < 0 || ns < table[pair_index(next, next)][OVERLAP][M_WARM].ns) next = set;
        }
        const row *r = &table[pair_index(next, next)][OVERLAP][M_WARM];
        fprintf(file, "%.6g %.6g %.6g \"%s\"\n", r->ns, drawn_error(r), 1e-17 * pow(10, -0.6 * k),
                set_names[next]);
        done[next] = true;
    }
    fprintf(file, "EOD\n");
}

static void write_blocks(FILE *file) {
    for (int m = 0; m < METHODS; m++) {
        if (m == M_YES_NO) continue;
        fprintf(file, "$m%d << EOD\n", m);
        for (int p = 0; p < PAIRS; p++)
            fprintf(file, "%.6g %.6g\n", table[p][OVERLAP][m].ns,
                    drawn_error(&table[p][OVERLAP][m]));
        fprintf(file, "EOD\n");
    }
    write_names(file);
}

static void write_plot(FILE *file) {
    static const char *const colours[] = {"#0072b2", "#56b4e9", "#cc79a7", "#d55e00", "#009e73"};
    const char *last = "";
    int series = -1;
    fprintf(file, "plot %.6g with lines lc '#888888' dt 2 title '16 eps', \\\n", ROUNDING);
    for (int m = 0; m < METHODS; m++) {
        static const int symbols[] = {7, 4, 6, 8, 2};
        if (m == M_YES_NO) continue;
        if (strcmp(last, methods[m].name) != 0) series++;
        fprintf(file, "    $m%d using 1:2 with points pt %d ps 0.9 lw 1.5 lc '%s'", m,
                symbols[series], colours[series]);
        if (strcmp(last, methods[m].name) != 0)
            fprintf(file, " title '%s%s'", m <= M_STEP ? "certified, " : "", methods[m].name);
        else
            fprintf(file, " notitle");
        fprintf(file, ", \\\n");
        last = methods[m].name;
    }
    fprintf(file, "    $names using 1:2:(0):($3-$2) with vectors nohead lc '#888888' notitle, \\\n"
                  "    $names using 1:3:4 with labels left offset 0.2,0 font ',11' notitle\n");
}

static void write_picture(const char *folder) {
    FILE *file = create("contact.gp");
    write_blocks(file);
    fprintf(file, "set terminal svg size 1000,700 font 'Helvetica,14' background '#ffffff'\n"
                  "set output 'contact.svg'\nset logscale xy\nset grid\n"
                  "set format y '10^{%%L}'\nset key outside top center horizontal\n"
                  "set title 'Depth of overlapping pairs: a point for each pair of shape types "
                  "and each tolerance'\n"
                  "set xlabel 'time per query, ns'\n"
                  "set ylabel 'greatest error / (R_A + R_B + |d|)'\nset yrange [3e-22:1]\n");
    write_plot(file);
    fclose(file);
    if (system("command -v gnuplot > /dev/null 2>&1") != 0)
        printf("skipped: contact.svg: gnuplot is not installed (it draws contact.gp)\n");
    else if (system("gnuplot contact.gp") == 0)
        printf("%s/contact.svg: error against time\n", folder);
    else
        printf("skipped: contact.svg: gnuplot failed on contact.gp\n");
}

/* --- running ---------------------------------------------------------------------------------- */

typedef struct plan {
    int poses, repeats, ccd_poses, ccd_repeats, size_poses;
} plan;

static model models[SETS][TEMPLATES];
static query queries[MOST_POSES];

static void make_models(void) {
    printf("%d templates a type, circumscribed / inscribed radius:", TEMPLATES);
    for (int set = 0; set < SETS; set++) {
        double low = HUGE_VAL, high = 0;
        for (int i = 0; i < TEMPLATES; i++) {
            make_model(&models[set][i], set, i);
            const dem2d_shape_info *info = &models[set][i].info;
            low = fmin(low, info->circumscribed / info->inscribed);
            high = fmax(high, info->circumscribed / info->inscribed);
        }
        printf("%s %s %.1f - %.1f", set ? "," : "", set_names[set], low, high);
    }
    printf("\n\n");
}

/* Queries between two lists of templates. */
static void make_queries(const model *a, const model *b, int templates, int count, int group,
                         const double range[2]) {
    for (int i = 0; i < count; i++) {
        const model *first = &a[(int)uniform(0, templates)];
        const model *second = &b[(int)uniform(0, templates)];
        const bool swap = uniform(0, 1) < 0.5; /* types in both orders */
        make_query(&queries[i], swap ? second : first, swap ? first : second, group, range);
    }
}

/* What is far apart is only asked as one asks neighbours that may have met; and the test of two
   prisms by libccd has no tolerance. */
static bool is_asked(int group, int m) {
    if (group == APART) return m == M_COLD || m == M_YES_NO;
    return group == OVERLAP || m <= M_CCD;
}

/* Returns the number of wrong answers. */
static int run_pair(int pair, const plan *p, FILE *csv) {
    int a, b, wrong = 0;
    pair_sets(pair, &a, &b);
    for (int group = 0; group < CLASSES; group++) {
        make_queries(models[a], models[b], TEMPLATES, p->poses, group, class_range[group]);
        row *rows = table[pair][group];
        for (int m = 0; m < METHODS; m++) {
            if (!is_asked(group, m)) continue;
            if (methods[m].kind != LIBCCD)
                judge_all(queries, p->poses, p->repeats, &methods[m], &rows[m]);
#ifdef WITH_CCD
            if (methods[m].kind == LIBCCD)
                judge_ccd(queries, p->ccd_poses, p->ccd_repeats, &methods[m], group, &rows[m]);
#endif
        }
        time_rows(queries, group, rows);
        for (int m = 0; m < METHODS; m++) {
            if (rows[m].count == 0) continue;
            print_row(csv, pair_name(pair), group, &methods[m], &rows[m]);
            wrong += rows[m].wrong;
        }
        fflush(stdout);
    }
    return wrong;
}

/* Slope of log y against log x by least squares. */
static double log_slope(const int *x, const double *y, int count) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int i = 0; i < count; i++) {
        const double u = log(x[i]), v = log(y[i]);
        sx += u, sy += v, sxx += u * u, sxy += u * v;
    }
    return (count * sxy - sx * sy) / (count * sxx - sx * sx);
}

/* Time against the order of a series or the corners of a polygon. */
static int run_sizes(int type, const int *sizes, int count, const plan *p, FILE *csv) {
    enum { SOME = 6 };
    static model list[SOME];
    const double shallow[2] = {1e-5, 1e-2};
    double ns[2][8];
    int wrong = 0;
    for (int k = 0; k < count; k++) {
        char name[32];
        snprintf(name, sizeof name, "%s, %d", set_names[type], sizes[k]);
        for (int i = 0; i < SOME; i++) {
            if (type == FS)
                make_fourier(&list[i], sizes[k], i);
            else
                model_polygon(&list[i], sizes[k], 1, 0);
            finish(&list[i]);
        }
        make_queries(list, list, SOME, p->size_poses, OVERLAP, shallow);
        row rows[METHODS] = {{0}};
        for (int m = M_WARM; m <= M_COLD; m++)
            judge_all(queries, p->size_poses, p->repeats, &methods[m], &rows[m]);
        time_rows(queries, OVERLAP, rows);
        for (int m = M_WARM; m <= M_COLD; m++) {
            print_row(csv, name, OVERLAP, &methods[m], &rows[m]);
            ns[m][k] = rows[m].ns, wrong += rows[m].wrong;
        }
        for (int i = 0; i < SOME; i++) dem2d_shape_destroy(list[i].shape);
    }
    printf("slope of log time against log size: warm %.2f, cold %.2f\n\n",
           log_slope(sizes, ns[0], count), log_slope(sizes, ns[1], count));
    return wrong;
}

int main(int argc, char **argv) {
    plan p = {MOST_POSES, MOST_REPEATS, 200, 3, 200};
    const char *folder = NULL;
    bool usage = false;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--quick") == 0)
            p = (plan){100, 3, 20, 1, 50};
        else if (argv[i][0] != '-' && !folder)
            folder = argv[i];
        else
            usage = true;
    }
    if (usage) {
        fprintf(stderr, "usage: bench_contact [--quick] [OUTDIR]\n");
        return 2;
    }
    if (!folder) folder = "build/bench_contact";
    enter_folder(folder);
    for (int i = 0; i < SCAN; i++)
        scan[i] =
            (point){cosl(2 * (long double)PI * i / SCAN), sinl(2 * (long double)PI * i / SCAN)};
    make_models();
    FILE *csv = create("contact.csv");
    int wrong = 0;
    print_head(csv);
    for (int pair = 0; pair < PAIRS; pair++) wrong += run_pair(pair, &p, csv);
    printf("\n");
    wrong += run_sizes(FS, fs_orders, COUNT_OF(fs_orders), &p, csv);
    wrong += run_sizes(POLYGON, polygon_sizes, COUNT_OF(polygon_sizes), &p, csv);
    fclose(csv);
    print_ratios();
    print_aims(wrong);
    printf("\n%s/contact.csv: the same figures\n", folder);
    write_picture(folder);
    for (int set = 0; set < SETS; set++)
        for (int i = 0; i < TEMPLATES; i++) dem2d_shape_destroy(models[set][i].shape);
    return wrong ? 1 : 0;
}
