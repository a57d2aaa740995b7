/* contact_cases.h - pairs of shapes whose contact is hard to get right, and what is true of them,
   for test_pairs.c and fuzz_contact.c. Include it after dem2d.h.

   A model is a shape and the numbers it was made of, so that its support function can be taken
   again in long double by code that shares nothing with the library. A scene is a pair of models
   at poses, drawn in one of many ways. A truth is what a search in long double finds of a pair,
   with a proof. The last part holds what every answer must fulfil. */
#ifndef CONTACT_CASES_H
#define CONTACT_CASES_H

#include "parts.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>

/* What is promised of a support value of A minus B: 16 eps of R_A + R_B + |d|. */
#define CASE_ROUNDING (16 * DBL_EPSILON)
/* The library's default for dem2d_contact_desc.tolerance, of the same size. */
#define CASE_TOLERANCE 1e-10
#define CASE_PI 3.14159265358979323846264338327950288L

typedef long double real;

typedef struct spot {
    real x, y;
} spot;

static spot spot_make(real x, real y) {
    return (spot){x, y};
}

static real spot_dot(spot a, spot b) {
    return a.x * b.x + a.y * b.y;
}

static real spot_cross(spot a, spot b) {
    return a.x * b.y - a.y * b.x;
}

static spot spot_unit(spot a) {
    const real length = sqrtl(a.x * a.x + a.y * a.y); /* squares of doubles are in range */
    return spot_make(a.x / length, a.y / length);
}

PART spot spot_turned(spot a, real angle) {
    const real c = cosl(angle), s = sinl(angle);
    return spot_make(c * a.x - s * a.y, s * a.x + c * a.y);
}

static spot spot_from(dem2d_vec v) {
    return spot_make(v.x, v.y);
}

PART dem2d_vec spot_rounded(spot a) {
    return (dem2d_vec){(double)a.x, (double)a.y};
}

/* Something is wrong with the cases themselves. */
static void case_broken(const char *what) {
    fprintf(stderr, "contact_cases.h: %s\n", what);
    abort();
}

/* --- numbers that repeat --------------------------------------------------------------------- */

/* Every size from lower to upper as likely as any other. */
static double random_scale(uint64_t *d, double lower, double upper) {
    return exp(random_between(d, log(lower), log(upper)));
}

static spot random_direction(uint64_t *d) {
    const real angle = random_between(d, -3.2, 3.2);
    return spot_make(cosl(angle), sinl(angle));
}

/* --- polygons with integer corners, exactly -------------------------------------------------- */

typedef struct lattice {
    int64_t x, y;
} lattice;

static int64_t lattice_turn(lattice o, lattice p, lattice q) {
    return (p.x - o.x) * (q.y - o.y) - (p.y - o.y) * (q.x - o.x);
}

static int lattice_compare(const void *left, const void *right) {
    const lattice *a = left, *b = right;
    if (a->x != b->x) return a->x < b->x ? -1 : 1;
    return a->y < b->y ? -1 : a->y > b->y;
}

/* Strict convex hull, counter-clockwise; 0 if it has no area. hull has room for 2 count. */
static int lattice_hull(lattice *points, int count, lattice *hull) {
    int n = 0;
    qsort(points, (size_t)count, sizeof *points, lattice_compare);
    for (int pass = 0; pass < 2; pass++) {
        const int base = n;
        for (int i = 0; i < count; i++) {
            const lattice p = points[pass ? count - 1 - i : i];
            while (n - base >= 2 && lattice_turn(hull[n - 2], hull[n - 1], p) <= 0) n--;
            hull[n++] = p;
        }
        n--; /* the next pass starts there */
    }
    return n >= 3 ? n : 0;
}

/* A quarter turn, `turns` times. */
static lattice lattice_turned(lattice p, int turns) {
    for (int i = 0; i < turns; i++) p = (lattice){-p.y, p.x};
    return p;
}

/* --- models ---------------------------------------------------------------------------------- */

/* CUSTOM stores its radius of curvature and knows a lower bound of it, BLIND does neither. */
enum { CIRCLE, ELLIPSE, POLYGON, ROUNDED, BEZIER, FOURIER, CUSTOM, BLIND, KINDS };
enum { MODEL_POINTS = 192, MODEL_LATTICE = 14 };

PART const char *const kind_names[KINDS] = {"circle", "ellipse", "polygon", "rounded",
                                            "bezier", "fourier", "custom",  "blind"};

/* Which numbers count: circle r; ellipse a, b; polygon points, r; polybezier points; Fourier
   points (a_n, b_n) up to count - 1; custom: the sum of ellipse, polygon and disc, where given. */
typedef struct model {
    int kind;
    dem2d_shape *shape;
    dem2d_shape_info info;
    double a, b, r;
    int count; /* of points */
    dem2d_vec points[MODEL_POINTS];
    int corners; /* of the integer polygon; 0 if it is none */
    lattice corner[MODEL_LATTICE];
    double rho_min; /* no radius of curvature is below */
    spot beyond;    /* polybeziers: the centroid from the rounded offset; mostly 0 is as good */
} model;

/* The support function of custom shapes, in double. */
static dem2d_vec custom_support(void *user, dem2d_vec u, double *rho) {
    const model *m = user;
    dem2d_vec s = {m->r * u.x, m->r * u.y};
    double radius = m->r;
    if (m->a > 0) {
        const double h = sqrt(m->a * m->a * u.x * u.x + m->b * m->b * u.y * u.y);
        s.x += m->a * (m->a / h) * u.x, s.y += m->b * (m->b / h) * u.y;
        radius += m->a / h * (m->b / h) * (m->a / h) * m->b;
    }
    if (m->count > 0) {
        const dem2d_vec *best = m->points;
        for (int i = 1; i < m->count; i++)
            if (m->points[i].x * u.x + m->points[i].y * u.y > best->x * u.x + best->y * u.y)
                best = &m->points[i];
        s.x += best->x, s.y += best->y;
    }
    if (rho != NULL && m->kind == CUSTOM) *rho = radius;
    return s;
}

/* Convex polygons, about 1 in size: all corners on an ellipse, regular, rectangles to needles, thin
   triangles, cut corners, integers. */
static void draw_corners(model *m, uint64_t *d, int most) {
    const int style = random_below(d, 6), n = 3 + random_below(d, most - 2);
    const double thin = random_below(d, 3) ? random_scale(d, 0.2, 1) : random_scale(d, 1e-4, 1);
    m->count = 0;
    if (style == 0 || style == 1) { /* gaps of at least a fifth of the mean between the corners */
        for (int i = 0; i < n; i++) {
            const double shift = style == 0 ? random_between(d, 0, 0.8) : 0;
            const double t = 2 * (double)CASE_PI * (i + shift) / n;
            m->points[m->count++] = (dem2d_vec){cos(t), (style == 0 ? thin : 1) * sin(t)};
        }
    } else if (style == 2) {
        const dem2d_vec box[4] = {{-1, -thin}, {1, -thin}, {1, thin}, {-1, thin}};
        m->count = 4;
        memcpy(m->points, box, sizeof box);
    } else if (style == 3) {
        const double tip = random_between(d, -0.5, 1.5);
        const dem2d_vec three[3] = {{0, 0}, {1, 0}, {tip, thin}};
        m->count = 3;
        memcpy(m->points, three, sizeof three);
    } else if (style == 4) { /* a box with cut corners, edges down to 1e-6 of the others */
        const double cut = random_scale(d, 1e-6, 0.3);
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 2; k++) {
                dem2d_vec p = {1 - (k ? cut : 0), 1 - (k ? 0 : cut)};
                for (int j = 0; j < i; j++) p = (dem2d_vec){-p.y, p.x};
                m->points[m->count++] = p;
            }
    }
    while (m->count == 0) {
        lattice points[7];
        const int tried = 3 + random_below(d, 5), span = 2 + random_below(d, 5);
        for (int i = 0; i < tried; i++)
            points[i].x = random_below(d, span), points[i].y = random_below(d, span);
        m->count = m->corners = lattice_hull(points, tried, m->corner);
        for (int i = 0; i < m->count; i++)
            m->points[i] = (dem2d_vec){(double)m->corner[i].x, (double)m->corner[i].y};
    }
}

/* Cubic arcs round the corners of a polygon, and flat arcs between some of them: of third parts,
   or with two control points in one. */
static void draw_arcs(model *m, uint64_t *d) {
    model outline = *m;
    dem2d_vec *out = m->points;
    do draw_corners(&outline, d, 5);
    while (outline.count > 8);
    const int n = outline.count;
    double starts[8], stops[8]; /* on edge i the curve leaves the corner, and turns to the next */
    for (int i = 0; i < n; i++) {
        starts[i] = random_between(d, 0.1, 0.5);
        stops[i] = random_below(d, 3) ? starts[i] : random_between(d, 0.6, 0.9);
    }
    for (int i = 0; i < n; i++) {
        const int before = (i + n - 1) % n, after = (i + 1) % n;
        const dem2d_vec *c = outline.points;
        const double f = random_below(d, 4) ? random_between(d, 0.3, 0.9) : 1;
        const double g = random_below(d, 4) ? random_between(d, 0.3, 0.9) : 1;
        const dem2d_vec in = {c[before].x + stops[before] * (c[i].x - c[before].x),
                              c[before].y + stops[before] * (c[i].y - c[before].y)};
        const dem2d_vec end = {c[i].x + starts[i] * (c[after].x - c[i].x),
                               c[i].y + starts[i] * (c[after].y - c[i].y)};
        *out++ = in;
        *out++ = (dem2d_vec){in.x + f * (c[i].x - in.x), in.y + f * (c[i].y - in.y)};
        *out++ = (dem2d_vec){end.x + g * (c[i].x - end.x), end.y + g * (c[i].y - end.y)};
        if (stops[i] == starts[i]) continue;
        const double t = stops[i] - starts[i];
        const dem2d_vec side = {t * (c[after].x - c[i].x), t * (c[after].y - c[i].y)};
        const double first = random_below(d, 3) ? 1 / 3.0 : 0,
                     second = random_below(d, 3) ? 2 / 3.0 : 1;
        *out++ = end;
        *out++ = (dem2d_vec){end.x + first * side.x, end.y + first * side.y};
        *out++ = (dem2d_vec){end.x + second * side.x, end.y + second * side.y};
    }
    m->count = (int)(out - m->points);
}

/* Harmonics that fall as 1/n^2, lowered together until the least radius of curvature is `least`
   of a0/2: samples of rho, less what it can dip between them. */
static void draw_series(model *m, uint64_t *d) {
    enum { SAMPLES = 512 };
    static const int orders[] = {0, 2, 3, 4, 8, 16};
    static const double leasts[] = {0.5, 0.1, 0.01, 1e-6};
    const int order = orders[random_below(d, 6)];
    const double least = leasts[random_below(d, 4)], step = 2 * (double)CASE_PI / SAMPLES;
    double dip = 0, lowest = 0;
    m->count = order + 1;
    m->points[0] = (dem2d_vec){2, 0};
    for (int n = 1; n <= order; n++) {
        const double reach = 0.3 / (n * n);
        m->points[n].x = random_between(d, -reach, reach);
        m->points[n].y = random_between(d, -reach, reach);
        if (n == 1) continue; /* moves the shape only */
        dip += hypot(m->points[n].x, m->points[n].y) * n * n * (n * n - 1) * step * step / 8;
    }
    for (int i = 0; i < SAMPLES; i++) {
        double rho = 0;
        for (int n = 2; n <= order; n++)
            rho += (1 - n * n) *
                   (m->points[n].x * cos(n * i * step) + m->points[n].y * sin(n * i * step));
        lowest = fmin(lowest, rho - dip);
    }
    const double factor = lowest < least - 1 ? (least - 1) / lowest : 1;
    for (int n = 2; n <= order; n++) m->points[n].x *= factor, m->points[n].y *= factor;
    m->rho_min = 1 + factor * lowest;
}

/* Least radius of curvature of arcs that turn gently, from samples; 0.8 for what is between. */
static double arcs_rho(const model *m) {
    double least = HUGE_VAL;
    for (int i = 0; i < m->count; i += 3) {
        const dem2d_vec *q0 = &m->points[i], *q1 = q0 + 1, *q2 = q0 + 2;
        const dem2d_vec *q3 = &m->points[(i + 3) % m->count];
        for (int k = 0; k <= 256; k++) {
            const double t = k / 256.0, s = 1 - t;
            const double x =
                s * s * (q1->x - q0->x) + 2 * s * t * (q2->x - q1->x) + t * t * (q3->x - q2->x);
            const double y =
                s * s * (q1->y - q0->y) + 2 * s * t * (q2->y - q1->y) + t * t * (q3->y - q2->y);
            const double p = s * (q2->x - 2 * q1->x + q0->x) + t * (q3->x - 2 * q2->x + q1->x);
            const double q = s * (q2->y - 2 * q1->y + q0->y) + t * (q3->y - 2 * q2->y + q1->y);
            const double speed = hypot(x, y), turn = x * q - y * p;
            if (speed == 0) return 0;
            if (turn > 1e-12 * speed) least = fmin(least, 1.5 * speed * speed * (speed / turn));
        }
    }
    return 0.8 * least;
}

static dem2d_result model_make(model *m) {
    double a[MODEL_POINTS], b[MODEL_POINTS];
    dem2d_custom_desc custom = {0};
    switch (m->kind) {
    case CIRCLE:
        return dem2d_shape_create_circle(NULL, m->r, &m->shape);
    case ELLIPSE:
        return dem2d_shape_create_ellipse(NULL, m->a, m->b, &m->shape);
    case POLYGON:
    case ROUNDED:
        return dem2d_shape_create_polygon(NULL, m->points, m->count, m->r, &m->shape);
    case BEZIER:
        return dem2d_shape_create_bezier(NULL, m->points, m->count / 3, &m->shape);
    case FOURIER:
        for (int n = 0; n < m->count; n++) a[n] = m->points[n].x, b[n] = m->points[n].y;
        return dem2d_shape_create_fourier(NULL, a, b, m->count - 1, &m->shape);
    default:
        custom.support = custom_support, custom.user = m;
        if (m->kind == CUSTOM) custom.rho_min = m->rho_min;
        return dem2d_shape_create_custom(NULL, &custom, &m->shape);
    }
}

static void draw_numbers(model *m, uint64_t *d) {
    const double thin = random_below(d, 3) ? random_scale(d, 0.3, 1) : random_scale(d, 1e-4, 1);
    const bool ellipse = m->kind == ELLIPSE || (m->kind >= CUSTOM && random_below(d, 3) > 0);
    if (m->kind == CIRCLE || m->kind == ROUNDED || (m->kind >= CUSTOM && random_below(d, 2)))
        m->r = m->kind == ROUNDED ? random_scale(d, 1e-3, 0.5) : random_scale(d, 0.3, 1);
    if (ellipse) {
        m->a = 1, m->b = random_below(d, 8) ? thin : 1;
        if (random_below(d, 2)) m->a = m->b, m->b = 1;
    }
    if (m->kind == POLYGON || m->kind == ROUNDED) draw_corners(m, d, random_below(d, 4) ? 9 : 40);
    if (m->kind >= CUSTOM && (!ellipse || random_below(d, 2)))
        draw_corners(m, d, 6), m->corners = 0;
    m->rho_min = m->r;
    if (ellipse) m->rho_min += fmin(m->a, m->b) * (fmin(m->a, m->b) / fmax(m->a, m->b));
    m->rho_min *= 1 - 1e-12; /* a bound in spite of rounding */
    if (m->kind == FOURIER) draw_series(m, d);
    if (m->kind == BEZIER) draw_arcs(m, d), m->rho_min = arcs_rho(m);
}

/* A shape of a kind. m must stay where it is: custom shapes refer to it. */
PART void model_draw(model *m, int kind, uint64_t *d) {
    for (int i = 0; i < 100; i++) {
        memset(m, 0, sizeof *m);
        m->kind = kind;
        draw_numbers(m, d);
        if (model_make(m) != DEM2D_OK) continue; /* a kink above rounding where arcs are thin */
        if (dem2d_shape_get(m->shape, &m->info) != DEM2D_OK) case_broken("a shape without info");
        /* samples miss the tip of a needle; where the library's bound is lower, it decides */
        if (m->info.rho_min > 0) m->rho_min = fmin(m->rho_min, m->info.rho_min);
        return;
    }
    case_broken(kind_names[kind]);
}

/* --- support points in long double ----------------------------------------------------------- */

static spot corners_support(const dem2d_vec *points, int count, spot u) {
    int best = 0;
    real value = points[0].x * u.x + points[0].y * u.y;
    for (int i = 1; i < count; i++) {
        const real other = points[i].x * u.x + points[i].y * u.y;
        if (other > value) value = other, best = i;
    }
    return spot_from(points[best]);
}

/* Of one arc the place that is farthest along u, given the four control points' places p along u:
   its ends, and the two where it runs along the line across u. Stores how far in *value. */
static real arc_farthest(const real p[4], real *value) {
    real best = 0, ts[4] = {0, 1, -1, -1};
    const real c = p[1] - p[0], b = p[2] - 2 * p[1] + p[0], a = p[3] - 3 * p[2] + 3 * p[1] - p[0];
    if (b * b >= a * c) {
        const real sum = -b - copysignl(sqrtl(b * b - a * c), b);
        ts[2] = sum / a, ts[3] = c / sum;
    }
    *value = -HUGE_VALL;
    for (int i = 0; i < 4; i++) {
        const real t = ts[i], s = 1 - t;
        if (!(t >= 0 && t <= 1)) continue;
        const real h = s * s * (s * p[0] + 3 * t * p[1]) + t * t * (3 * s * p[2] + t * p[3]);
        if (h > *value) *value = h, best = t;
    }
    return best;
}

/* A control point of a polybezier, from the centroid; indices go round. */
static spot control_point(const model *m, int i) {
    const dem2d_vec q = m->points[i % m->count], offset = m->info.offset;
    return spot_make((real)q.x - offset.x - m->beyond.x, (real)q.y - offset.y - m->beyond.y);
}

/* On the arc from control point `first` on. */
static spot arc_point(const model *m, int first, real t) {
    const spot q0 = control_point(m, first), q1 = control_point(m, first + 1);
    const spot q2 = control_point(m, first + 2), q3 = control_point(m, first + 3);
    const real s = 1 - t, w[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
    return spot_make(w[0] * q0.x + w[1] * q1.x + w[2] * q2.x + w[3] * q3.x,
                     w[0] * q0.y + w[1] * q1.y + w[2] * q2.y + w[3] * q3.y);
}

/* Which arc of a polybezier is farthest along u, by its first control point, and where on it: of
   all arcs, whether they join smoothly or not. An arc is inside the hull of its control points:
   most are ruled out by that in double. Rounding of u, of products and of sums is 2.5 eps of the
   coordinates, on both sides of a comparison. */
static int arcs_farthest(const model *m, spot u, real *place) {
    double p[MODEL_POINTS + 1], size = 0, most = -HUGE_VAL;
    const double ux = (double)u.x, uy = (double)u.y;
    real best = -HUGE_VALL, value, q[4];
    int arc = 0;
    for (int i = 0; i < m->count; i++) {
        const double x = m->points[i].x, y = m->points[i].y, reach = fabs(x) + fabs(y);
        p[i] = x * ux + y * uy;
        size = reach > size ? reach : size;
    }
    p[m->count] = p[0];
    for (int i = 0; i < m->count; i += 3) most = p[i] > most ? p[i] : most;
    most -= 8 * DBL_EPSILON * size;
    for (int i = 0; i < m->count; i += 3) {
        if (p[i] < most && p[i + 1] < most && p[i + 2] < most && p[i + 3] < most) continue;
        for (int k = 0; k < 4; k++) q[k] = spot_dot(control_point(m, i + k), u);
        const real t = arc_farthest(q, &value);
        if (value > best) best = value, arc = i, *place = t;
    }
    return arc;
}

static spot arcs_support(const model *m, spot u) {
    real place;
    const int first = arcs_farthest(m, u, &place);
    return arc_point(m, first, place);
}

static spot series_support(const model *m, spot u) {
    real value = m->points[0].x / 2.0L, slope = 0;
    spot z = u; /* of angle n t */
    for (int n = 1; n < m->count; n++) {
        value += m->points[n].x * z.x + m->points[n].y * z.y;
        slope += n * (m->points[n].y * z.x - m->points[n].x * z.y);
        z = spot_make(z.x * u.x - z.y * u.y, z.x * u.y + z.y * u.x);
    }
    return spot_make(value * u.x - slope * u.y, value * u.y + slope * u.x);
}

/* Support point of a template about its centroid. u is a unit vector. */
static spot model_support(const model *m, spot u) {
    spot s = {m->r * u.x, m->r * u.y};
    if (m->kind == BEZIER) return arcs_support(m, u);
    if (m->kind == FOURIER) {
        s = series_support(m, u);
    } else {
        if (m->a > 0) {
            const real a = m->a, b = m->b, h = hypotl(a * u.x, b * u.y);
            s.x += a * (a / h) * u.x, s.y += b * (b / h) * u.y;
        }
        if (m->count > 0) {
            const spot corner = corners_support(m->points, m->count, u);
            s.x += corner.x, s.y += corner.y;
        }
    }
    return spot_make(s.x - m->info.offset.x, s.y - m->info.offset.y);
}

/* Relative to the pose's position. */
static spot posed_support(const model *m, const dem2d_pose *pose, spot u) {
    const real c = pose->rotation.c, s = pose->rotation.s, f = pose->scale;
    const spot p = model_support(m, spot_unit(spot_make(c * u.x + s * u.y, c * u.y - s * u.x)));
    return spot_make(f * (c * p.x - s * p.y), f * (s * p.x + c * p.y));
}

/* A pair at its poses; without b it is A and the point pose_b.position. */
typedef struct pair {
    const model *a, *b;
    dem2d_pose pose_a, pose_b;
} pair;

static spot pair_line(const pair *p) {
    return spot_make((real)p->pose_b.position.x - p->pose_a.position.x,
                     (real)p->pose_b.position.y - p->pose_a.position.y);
}

/* Support point of A minus B, less the line of centres: along u it is h(u), across h'(u). */
static spot pair_support(const pair *p, spot u) {
    const spot a = posed_support(p->a, &p->pose_a, u), d = pair_line(p);
    spot b = {0, 0};
    if (p->b != NULL) b = posed_support(p->b, &p->pose_b, spot_make(-u.x, -u.y));
    return spot_make(a.x - b.x - d.x, a.y - b.y - d.y);
}

PART real pair_value(const pair *p, spot u) {
    return spot_dot(pair_support(p, u), u);
}

/* What the promise of rounding is relative to. */
static double pair_size(const pair *p) {
    const spot d = pair_line(p);
    const double b = p->b != NULL ? p->pose_b.scale * p->b->info.circumscribed : 0;
    return p->pose_a.scale * p->a->info.circumscribed + b + (double)hypotl(d.x, d.y);
}

/* --- search in long double ------------------------------------------------------------------- */

/* The least support value: `depth` is that of the direction u, `lower` is proved. They differ by
   no more than 1e-17 of the size, unless h is so flat that the proof ran out of evaluations. */
typedef struct truth {
    real depth, lower;
    spot u;
} truth;

enum { SCAN_DIRECTIONS = 24, SCAN_EVALUATIONS = 3000 };

typedef struct scan {
    const pair *p;
    truth found;
    real tolerance;
    int left; /* evaluations */
} scan;

static spot scan_look(scan *s, spot u) {
    const spot w = pair_support(s->p, u);
    const real h = spot_dot(w, u);
    s->left--;
    if (h < s->found.depth) s->found.depth = h, s->found.u = u;
    return w;
}

/* The direction in which two support points, of u0 and of u1 after it, are equally far. */
static spot chord_normal(spot u0, spot w0, spot u1, spot w1) {
    const spot e = spot_make(w1.y - w0.y, w0.x - w1.x);
    if (e.x == 0 && e.y == 0) return u0;
    const spot n = spot_unit(e);
    if (!(spot_cross(u0, n) >= 0)) return u0;
    return spot_cross(n, u1) >= 0 ? n : u1;
}

/* Least value of w.u from u to v, less than half a turn apart: at an end, or opposite to w. */
static real arc_least(spot w, spot u, spot v) {
    const spot back = spot_make(-w.x, -w.y);
    if (spot_cross(u, back) >= 0 && spot_cross(back, v) >= 0 && spot_dot(u, back) > 0)
        return -hypotl(w.x, w.y);
    return fminl(spot_dot(w, u), spot_dot(w, v));
}

/* A and B are convex: h is at least the larger of w0.u and w1.u. */
static real arc_bound(spot u0, spot w0, spot u1, spot w1) {
    const spot n = chord_normal(u0, w0, u1, w1);
    return fminl(arc_least(w0, u0, n), arc_least(w1, n, u1));
}

static bool scan_dips(spot u0, spot w0, spot u1, spot w1) {
    return spot_cross(u0, w0) <= 0 && spot_cross(u1, w1) >= 0;
}

/* The lowest place of a dip between u0 and u1, where h' goes from below 0 to above: by turns where
   a line through both slopes is 0, where two support points are equally far, in the middle. */
static void scan_descend(scan *s, spot u0, spot w0, spot u1, spot w1) {
    for (int i = 0; i < 200; i++) {
        const real f0 = -spot_cross(u0, w0), f1 = spot_cross(u1, w1), part = f0 / (f0 + f1);
        spot u = spot_unit(spot_make(u0.x + u1.x, u0.y + u1.y));
        if (arc_bound(u0, w0, u1, w1) >= s->found.depth - s->tolerance) return;
        if (i % 3 == 0 && f0 + f1 > 0)
            u = spot_unit(spot_make(u0.x + part * (u1.x - u0.x), u0.y + part * (u1.y - u0.y)));
        if (i % 3 == 1) u = chord_normal(u0, w0, u1, w1);
        if ((u.x == u0.x && u.y == u0.y) || (u.x == u1.x && u.y == u1.y)) {
            if (i % 3 == 2) return;
            continue;
        }
        const spot w = scan_look(s, u);
        if (spot_cross(u, w) < 0)
            u0 = u, w0 = w;
        else
            u1 = u, w1 = w;
    }
}

static void scan_prove(scan *s, spot u0, spot w0, spot u1, spot w1, int halvings) {
    const real bound = arc_bound(u0, w0, u1, w1);
    if (bound >= s->found.depth - s->tolerance || halvings == 0 || s->left < 0) {
        s->found.lower = fminl(s->found.lower, bound);
        return;
    }
    if (scan_dips(u0, w0, u1, w1)) scan_look(s, chord_normal(u0, w0, u1, w1));
    const spot u = spot_unit(spot_make(u0.x + u1.x, u0.y + u1.y)), w = scan_look(s, u);
    scan_prove(s, u0, w0, u, w, halvings - 1);
    scan_prove(s, u, w, u1, w1, halvings - 1);
}

/* Directions all round, the lowest place of each dip that could be the least, and the proof that
   there is no other. */
PART truth find_truth(const pair *p) {
    scan s = {p, {HUGE_VALL, HUGE_VALL, {1, 0}}, 1e-17L * pair_size(p), SCAN_EVALUATIONS};
    spot u[SCAN_DIRECTIONS + 1], w[SCAN_DIRECTIONS + 1];
    for (int i = 0; i < SCAN_DIRECTIONS; i++) {
        u[i] = spot_turned(spot_make(1, 0), 2 * CASE_PI * i / SCAN_DIRECTIONS);
        w[i] = scan_look(&s, u[i]);
    }
    u[SCAN_DIRECTIONS] = u[0], w[SCAN_DIRECTIONS] = w[0];
    for (int i = 0; i < SCAN_DIRECTIONS; i++)
        if (scan_dips(u[i], w[i], u[i + 1], w[i + 1]))
            scan_descend(&s, u[i], w[i], u[i + 1], w[i + 1]);
    for (int i = 0; i < SCAN_DIRECTIONS; i++) scan_prove(&s, u[i], w[i], u[i + 1], w[i + 1], 60);
    s.found.lower = fminl(s.found.lower, s.found.depth);
    return s.found;
}

/* Halvings of arcs that prove the least value to a tolerance, for one who knows it already: few
   where h bends, many where it hardly does or where many directions are as good. */
PART int proof_halvings(const pair *p, const truth *t, double tolerance) {
    enum { PARTS = 8 };
    scan s = {p, *t, tolerance, SCAN_EVALUATIONS};
    for (int i = 0; i < PARTS; i++) {
        const spot u0 = spot_turned(t->u, 2 * CASE_PI * i / PARTS);
        const spot u1 = spot_turned(t->u, 2 * CASE_PI * (i + 1) / PARTS);
        scan_prove(&s, u0, pair_support(p, u0), u1, pair_support(p, u1), 60);
    }
    return (SCAN_EVALUATIONS - s.left) / 2;
}

/* Is h proved to be above a level all the way from u0 to u1? */
static bool arc_above(scan *s, spot u0, spot w0, spot u1, spot w1, real level, int halvings) {
    if (arc_bound(u0, w0, u1, w1) > level) return true;
    if (halvings == 0 || s->left < 0) return false;
    const spot u = spot_unit(spot_make(u0.x + u1.x, u0.y + u1.y)), w = scan_look(s, u);
    if (spot_dot(u, w) <= level) return false;
    return arc_above(s, u0, w0, u, w, level, halvings - 1) &&
           arc_above(s, u, w, u1, w1, level, halvings - 1);
}

/* Is h above the level in all directions but those within an angle of the least one? */
static bool above_beyond(const pair *p, const truth *t, real angle, real level) {
    enum { PARTS = 16 };
    scan s = {p, *t, 0, 1000};
    spot u[PARTS + 1], w[PARTS + 1];
    for (int i = 0; i <= PARTS; i++) {
        u[i] = spot_turned(t->u, angle + 2 * (CASE_PI - angle) * i / PARTS);
        w[i] = pair_support(p, u[i]);
        if (spot_dot(u[i], w[i]) <= level) return false;
    }
    for (int i = 0; i < PARTS; i++)
        if (!arc_above(&s, u[i], w[i], u[i + 1], w[i + 1], level, 40)) return false;
    return true;
}

/* Where all directions are whose value is within `excess` of the least: an angle on both sides of
   the least one; 4 when they are not close together. */
PART real truth_spread(const pair *p, const truth *t, real excess) {
    const real level = t->depth + excess;
    for (real angle = 1e-9L; angle < 0.04L; angle *= 2) {
        if (pair_value(p, spot_turned(t->u, angle)) <= level ||
            pair_value(p, spot_turned(t->u, -angle)) <= level)
            continue;
        if (above_beyond(p, t, angle, level)) return angle;
    }
    return 4;
}

/* The least direction stands alone: whatever is more than an angle of 0.01 away is higher by 1e-7
   of the size, and h rises on both sides all the way there. */
PART bool truth_unique(const pair *p, const truth *t) {
    for (real angle = 1e-14L; angle < 0.01L; angle *= 1.5L)
        for (int side = -1; side <= 1; side += 2) {
            const spot u = spot_turned(t->u, side * angle);
            if (!(side * spot_cross(u, pair_support(p, u)) > 0)) return false;
        }
    return truth_spread(p, t, 1e-7L * pair_size(p)) < 0.01L;
}

/* --- the least depth of integer polygons, exactly -------------------------------------------- */

/* Corners of A minus B, quarter turns `ta` and `tb`, B moved by `shift`; room for 98. */
static int lattice_difference(const model *a, int ta, const model *b, int tb, lattice shift,
                              lattice *hull) {
    lattice all[MODEL_LATTICE * MODEL_LATTICE / 4]; /* hulls of at most 7 points */
    int n = 0;
    for (int i = 0; i < a->corners; i++)
        for (int k = 0; k < b->corners; k++) {
            const lattice p = lattice_turned(a->corner[i], ta),
                          q = lattice_turned(b->corner[k], tb);
            all[n++] = (lattice){p.x - q.x - shift.x, p.y - q.y - shift.y};
        }
    return lattice_hull(all, n, hull);
}

/* Depth of the origin: exact but for one root or division. Inside, 1 in `least` marks each edge
   at that depth, by integers alone. */
static real lattice_depth(const lattice *hull, int count, bool *least) {
    real outside = HUGE_VALL;
    int best = -1;
    for (int i = 0; i < count; i++) least[i] = false;
    for (int i = 0; i < count; i++) {
        const lattice p = hull[i], q = hull[(i + 1) % count];
        const int64_t ex = q.x - p.x, ey = q.y - p.y, square = ex * ex + ey * ey;
        const int64_t moment = p.x * q.y - p.y * q.x, along = -(p.x * ex + p.y * ey);
        if (moment < 0) { /* the origin is beyond this edge */
            const real x = along <= 0 ? p.x : q.x, y = along <= 0 ? p.y : q.y;
            const bool on = along > 0 && along < square;
            outside = fminl(outside, on ? -moment / sqrtl(square) : hypotl(x, y));
        }
        if (best < 0) best = i;
        const lattice bp = hull[best], bq = hull[(best + 1) % count];
        const int64_t bx = bq.x - bp.x, by = bq.y - bp.y, bm = bp.x * bq.y - bp.y * bq.x;
        const int64_t mine = moment * moment * (bx * bx + by * by), other = bm * bm * square;
        if (mine < other) {
            for (int k = 0; k < i; k++) least[k] = false;
            best = i;
        }
        if (mine <= other) least[i] = true;
    }
    if (outside < HUGE_VALL) return -outside;
    const lattice p = hull[best], q = hull[(best + 1) % count];
    return (p.x * q.y - p.y * q.x) / hypotl(q.x - p.x, q.y - p.y);
}

/* --- scenes ---------------------------------------------------------------------------------- */

/* How a pair is placed. */
enum {
    CHOSEN,     /* by a normal and a depth: gaps, touches and overlaps of any size */
    TOUCHES,    /* the same, 1e-12 to 1 ulp from an exact touch */
    ANYWHERE,   /* anywhere near, any turn */
    ON_LATTICE, /* quarter turns and whole steps: corners on corners, edges in line */
    CONCENTRIC, /* centres in one place, or all but; equal turns often */
    INSIDE,     /* one far inside the other */
    UNEQUAL,    /* by normal and depth, sizes up to 1e6 apart */
    PARALLEL,   /* long edges face to face, turned by 1e-3 to 1e-15 */
    REMOTE,     /* near 1e8, on a grid that a double can move by that much */
    WAYS
};
PART const char *const way_names[WAYS] = {"chosen", "touches", "anywhere", "lattice", "concentric",
                                          "inside", "unequal", "parallel", "remote"};

typedef struct scene {
    pair p;
    int way;
    bool bounded;  /* the depth is not above `chosen`, which is h of the direction u */
    bool known;    /* the depth is `chosen` */
    double places; /* rounding of the positions, m: that much may `chosen` be off */
    real chosen;
    spot u;
    int turns_a, turns_b; /* integer polygons: the quarter turns and the place of B */
    lattice shift;
} scene;

/* Depths below this are decided by a zero slope of h alone. */
PART double pair_rho(const pair *p) {
    return p->pose_a.scale * p->a->rho_min + p->pose_b.scale * p->b->rho_min;
}

/* Puts B where h(u) = delta and h'(u) = 0. With r the least radius of curvature, A minus B eroded
   by r is convex and u its normal towards the origin: below r, delta is the least value. */
PART void scene_place(scene *s, spot u, real delta) {
    pair *p = &s->p;
    const spot a = posed_support(p->a, &p->pose_a, u);
    const spot b = posed_support(p->b, &p->pose_b, spot_make(-u.x, -u.y));
    const dem2d_vec from = p->pose_a.position;
    p->pose_b.position.x = (double)(from.x + (a.x - b.x - delta * u.x));
    p->pose_b.position.y = (double)(from.y + (a.y - b.y - delta * u.y));
    s->u = u, s->chosen = delta;
    s->bounded = true;
    s->known = delta <= 0 || delta < pair_rho(p);
    s->places = DBL_EPSILON * (fabs(p->pose_b.position.x) + fabs(p->pose_b.position.y));
}

static dem2d_rot draw_rotation(uint64_t *d) {
    static const dem2d_rot quarters[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    const int style = random_below(d, 8);
    if (style < 4) return quarters[random_below(d, 4)];
    return dem2d_rot_make(random_between(d, -4, 4));
}

/* A direction that matters: an edge of A faces it, an axis, or any. */
static spot draw_normal(const model *m, const dem2d_pose *pose, uint64_t *d) {
    const int style = random_below(d, 4);
    if (style == 0 && m->count >= 3 && m->kind != FOURIER) {
        const int i = random_below(d, m->count), k = (i + 1) % m->count;
        const real ex = (real)m->points[k].x - m->points[i].x;
        const real ey = (real)m->points[k].y - m->points[i].y;
        const real c = pose->rotation.c, s = pose->rotation.s;
        if (ex != 0 || ey != 0) return spot_unit(spot_make(c * ey + s * ex, s * ey - c * ex));
    }
    if (style == 1) {
        const int quarter = random_below(d, 4);
        return spot_make(quarter == 0   ? 1
                         : quarter == 2 ? -1
                                        : 0,
                         quarter == 1   ? 1
                         : quarter == 3 ? -1
                                        : 0);
    }
    return random_direction(d);
}

/* Gaps and overlaps from 1e-12 of the size up; half of the overlaps are certified. */
static real draw_delta(const pair *p, uint64_t *d) {
    const double size =
        p->pose_a.scale * p->a->info.circumscribed + p->pose_b.scale * p->b->info.circumscribed;
    const int style = random_below(d, 6);
    if (style < 2) return -size * random_scale(d, 1e-12, 3);
    if (style == 2) return pair_rho(p) * random_between(d, 0, 1);
    if (style == 3) return pair_rho(p) * random_scale(d, 1e-9, 1);
    if (style == 4) return pair_rho(p) * (1 - random_scale(d, 1e-15, 1e-2)); /* h hardly bends */
    return size * random_scale(d, 1e-12, 0.5);
}

static void draw_touch(scene *s, uint64_t *d) {
    static const double tiny[] = {0,     1e-16, 2e-16, 1e-15, 3e-15, 4e-15,
                                  1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9};
    const pair *p = &s->p;
    const double size =
        p->pose_a.scale * p->a->info.circumscribed + p->pose_b.scale * p->b->info.circumscribed;
    const double delta = size * tiny[random_below(d, 12)];
    scene_place(s, draw_normal(p->a, &p->pose_a, d), random_below(d, 2) ? delta : -delta);
}

/* Integer polygons stand on their corners, others on their centres. */
static void draw_on_lattice(scene *s, uint64_t *d) {
    static const dem2d_rot quarters[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    const model *models[2] = {s->p.a, s->p.b};
    dem2d_pose *poses[2] = {&s->p.pose_a, &s->p.pose_b};
    const double step = random_below(d, 2) ? 1 : 0.5;
    s->turns_a = random_below(d, 4), s->turns_b = random_below(d, 4);
    s->shift.x = random_below(d, 13) - 6, s->shift.y = random_below(d, 13) - 6;
    for (int i = 0; i < 2; i++) {
        const dem2d_rot q = quarters[i ? s->turns_b : s->turns_a];
        dem2d_vec at = models[i]->corners ? models[i]->info.offset : (dem2d_vec){0, 0};
        at = (dem2d_vec){q.c * at.x - q.s * at.y, q.s * at.x + q.c * at.y};
        if (i == 1) {
            const double by = s->p.a->corners && s->p.b->corners ? 1 : step;
            at.x += by * (double)s->shift.x, at.y += by * (double)s->shift.y;
        }
        poses[i]->position = at, poses[i]->rotation = q, poses[i]->scale = 1;
    }
    if (!s->p.a->corners || !s->p.b->corners || s->p.a->kind != POLYGON || s->p.b->kind != POLYGON)
        return;
    lattice hull[2 * MODEL_LATTICE * MODEL_LATTICE / 4];
    bool least[2 * MODEL_LATTICE * MODEL_LATTICE / 4];
    const int n = lattice_difference(s->p.a, s->turns_a, s->p.b, s->turns_b, s->shift, hull);
    s->chosen = lattice_depth(hull, n, least);
    s->known = true, s->places = 0;
}

static void draw_concentric(scene *s, uint64_t *d) {
    static const double offsets[] = {0, 1e-300, 1e-160, 1e-30, 1e-17, 1e-15, 1e-10, 1e-4};
    const double offset = offsets[random_below(d, 8)];
    const spot u = draw_normal(s->p.a, &s->p.pose_a, d);
    s->p.pose_b.position.x = s->p.pose_a.position.x + offset * (double)u.x;
    s->p.pose_b.position.y = s->p.pose_a.position.y + offset * (double)u.y;
    if (random_below(d, 2)) s->p.pose_b.rotation = s->p.pose_a.rotation;
    if (random_below(d, 2)) s->p.pose_b.scale = s->p.pose_a.scale;
}

/* Turns B until a direction v of it is to a hair from -u, in radians; 0 is as near as doubles. */
PART void turn_against(pair *p, spot u, spot v, real hair) {
    const spot q = spot_turned(spot_make(-spot_dot(u, v), -spot_cross(v, u)), hair);
    const real bc = p->pose_b.rotation.c, bs = p->pose_b.rotation.s;
    const spot r = spot_unit(spot_make(q.x * bc - q.y * bs, q.x * bs + q.y * bc));
    p->pose_b.rotation = (dem2d_rot){(double)r.x, (double)r.y};
}

static void draw_parallel(scene *s, uint64_t *d) {
    pair *p = &s->p;
    const spot u = draw_normal(p->a, &p->pose_a, d), v = draw_normal(p->b, &p->pose_b, d);
    const real hair = random_scale(d, 1e-15, 1e-3) * (random_below(d, 2) ? 1 : -1);
    turn_against(p, u, v, random_below(d, 5) ? hair : 0);
    scene_place(s, u, draw_delta(p, d));
    /* along the faces by any part of a size: u stays a bound where the faces still meet */
    const double slide = random_between(d, -1, 1) * p->pose_a.scale;
    p->pose_b.position.x -= slide * (double)u.y, p->pose_b.position.y += slide * (double)u.x;
    s->bounded = s->known = false;
}

/* Positions are multiples of 2^-24, up to 2^27: doubles of 53 bits hold them. */
static void draw_remote(scene *s, uint64_t *d) {
    dem2d_vec *ends[2] = {&s->p.pose_a.position, &s->p.pose_b.position};
    for (int i = 0; i < 2; i++) {
        ends[i]->x = 0x1p27 + floor(random_between(d, -2, 2) * 0x1p24) * 0x1p-24;
        ends[i]->y = -0x1p26 + floor(random_between(d, -2, 2) * 0x1p24) * 0x1p-24;
    }
}

/* The same scene with all lengths times 2^power: no number but these changes. */
PART scene scene_scaled(const scene *from, int power) {
    scene s = *from;
    dem2d_pose *poses[2] = {&s.p.pose_a, &s.p.pose_b};
    for (int i = 0; i < 2; i++) {
        poses[i]->scale = ldexp(poses[i]->scale, power);
        poses[i]->position.x = ldexp(poses[i]->position.x, power);
        poses[i]->position.y = ldexp(poses[i]->position.y, power);
    }
    s.chosen = ldexpl(s.chosen, power), s.places = ldexp(s.places, power);
    return s;
}

PART scene scene_draw(const model *a, const model *b, int way, uint64_t *d) {
    scene s;
    memset(&s, 0, sizeof s);
    s.p.a = a, s.p.b = b, s.way = way;
    dem2d_pose *poses[2] = {&s.p.pose_a, &s.p.pose_b};
    for (int i = 0; i < 2; i++) {
        poses[i]->rotation = draw_rotation(d);
        poses[i]->scale = random_below(d, 3) ? random_between(d, 0.5, 2) : 1;
        if (i == 1 || random_below(d, 2)) continue;
        poses[i]->position.x = random_between(d, -1, 1),
        poses[i]->position.y = random_between(d, -1, 1);
    }
    if (way == UNEQUAL || way == INSIDE) {
        const double ratio = random_scale(d, way == INSIDE ? 1e-6 : 1e-3, 1e-2);
        if (random_below(d, 2))
            s.p.pose_b.scale *= ratio;
        else
            s.p.pose_a.scale *= ratio;
    }
    if (way == UNEQUAL) s.p.pose_b.scale *= random_scale(d, 1e-3, 1e3);
    if (way == CHOSEN || way == UNEQUAL) {
        const spot u = draw_normal(a, &s.p.pose_a, d);
        scene_place(&s, u, draw_delta(&s.p, d));
    }
    if (way == TOUCHES) draw_touch(&s, d);
    if (way == ANYWHERE || way == INSIDE) {
        const double reach = way == INSIDE ? 0.3 * fmax(s.p.pose_a.scale, s.p.pose_b.scale) : 2;
        s.p.pose_b.position.x = s.p.pose_a.position.x + random_between(d, -reach, reach);
        s.p.pose_b.position.y = s.p.pose_a.position.y + random_between(d, -reach, reach);
    }
    if (way == ON_LATTICE) draw_on_lattice(&s, d);
    if (way == CONCENTRIC) draw_concentric(&s, d);
    if (way == PARALLEL) draw_parallel(&s, d);
    if (way == REMOTE) draw_remote(&s, d);
    return s;
}

/* Models of every kind to draw from. */
enum { VARIANTS = 24 };

typedef struct pool {
    model models[KINDS][VARIANTS];
} pool;

PART void pool_draw(pool *all, uint64_t seed) {
    uint64_t d = seed;
    for (int k = 0; k < KINDS; k++)
        for (int i = 0; i < VARIANTS; i++) model_draw(&all->models[k][i], k, &d);
}

PART void pool_destroy(pool *all) {
    for (int k = 0; k < KINDS; k++)
        for (int i = 0; i < VARIANTS; i++) dem2d_shape_destroy(all->models[k][i].shape);
}

/* --- what every answer must fulfil ----------------------------------------------------------- */

/* The functions below return what is wrong with an answer, or NULL. */

/* A depth, and whatever is measured from the centres. */
PART double depth_slack(const pair *p) {
    return CASE_ROUNDING * pair_size(p);
}

/* A point in the coordinates of the poses: a few roundings more, of the coordinates. */
static double point_slack(const pair *p) {
    const dem2d_vec a = p->pose_a.position, b = p->pose_b.position;
    return 2 * depth_slack(p) + 4 * DBL_EPSILON * (fabs(a.x) + fabs(a.y) + fabs(b.x) + fabs(b.y));
}

static bool vec_finite(dem2d_vec v) {
    return isfinite(v.x) && isfinite(v.y);
}

/* Where two witness points are not on one line along the normal: by so much, across it. */
static real witness_shear(const dem2d_contact *c) {
    return spot_cross(spot_from(c->normal), spot_make((real)c->point_a.x - c->point_b.x,
                                                      (real)c->point_a.y - c->point_b.y));
}

/* The most of that. Closed forms end at the foot of the origin, on an edge or at a corner:
   rounding. Newton's last step, of an angle e with e <= 0.1 sqrt(tolerance), ends where the
   osculating circle has its normal, but for e^2 slope / 2 as series for sine and cosine are cut
   off; e slope is at most 0.01 tolerance size, and the tolerance counts as 1e-6 at most. Where
   there is no such step (custom shapes), slope^2 <= 2 (r - h) error by the certificate, and r - h
   <= size. A polytope leaves two support points, at most an error below h, on both sides of the
   normal, and of GJK's last segment the point nearest to the origin, |w|^2 <= (h + error)^2: 2
   error size. The promise is twice the root of that. */
static real shear_bound(const pair *p, const dem2d_contact *c, double tolerance,
                        dem2d_solver solver) {
    /* no last step towards what may be a face: they stop within 0.01 of the angle */
    const bool custom = p->a->kind >= CUSTOM || p->b->kind >= CUSTOM || p->a->kind == BEZIER ||
                        p->b->kind == BEZIER;
    const bool stepped = c->proof == DEM2D_BY_RADIUS || c->proof == DEM2D_BY_ARC;
    const double angle = 0.1 * sqrt(tolerance); /* of Newton's last step */
    if (c->proof == DEM2D_BY_FORM) return point_slack(p);
    if (stepped && !custom && solver == DEM2D_CERTIFIED)
        return point_slack(p) + angle * angle * pair_size(p);
    /* faces that the bounds can't tell from parallel ones touch anywhere along them */
    const bool faces = custom || p->a->kind == POLYGON || p->a->kind == ROUNDED ||
                       p->b->kind == POLYGON || p->b->kind == ROUNDED;
    if ((c->proof == DEM2D_BY_POLYTOPE && faces) || (c->proof == DEM2D_BY_ARC && custom))
        return pair_size(p);
    const real unsure = fmax(c->error + point_slack(p), tolerance * pair_size(p));
    return sqrtl(8 * unsure * pair_size(p));
}

/* Of the weights of the points: 1 and up to 1, but where faces are short against the depth and the
   energy falls with the common length or the depth (a scan over all of these: 1.71, and 0.859). */
#define WEIGHT_MOST 1.75
#define WEIGHTS_LEAST 0.85

static const char *points_flaw(const pair *p, const dem2d_contact *c) {
    const double slack = c->error + point_slack(p);
    double sum = 0, deepest = -HUGE_VAL;
    if (c->state == DEM2D_SEPARATED) return c->count == 0 ? NULL : "contact points across a gap";
    if (c->count != 1 && c->count != 2) return "neither one nor two contact points";
    for (int i = 0; i < c->count; i++) {
        const dem2d_contact_point *q = &c->points[i];
        if (!vec_finite(q->position) || !isfinite(q->depth)) return "a contact point not finite";
        if (!(fabsl(hypotl(q->normal.x, q->normal.y) - 1) <= 16 * DBL_EPSILON))
            return "a normal of a contact point that is not unit";
        if (!(q->weight >= 0 && q->weight <= WEIGHT_MOST)) return "a weight out of range";
        if (!(q->energy >= 0 && q->energy <= q->depth * q->depth))
            return "a contact point's energy outside [0, its depth squared]";
        sum += q->weight, deepest = fmax(deepest, q->depth);
    }
    if (!(sum >= WEIGHTS_LEAST && sum <= 1 + WEIGHT_MOST)) return "a sum of weights out of range";
    if (deepest > c->depth + slack) return "a contact point deeper than the contact";
    if (deepest < c->depth - slack) return "no contact point as deep as the contact";
    if (c->count == 1) return NULL;
    const dem2d_vec p0 = c->points[0].position, p1 = c->points[1].position;
    const spot across = spot_make((real)p1.x - p0.x, (real)p1.y - p0.y);
    if (!(spot_cross(spot_from(c->normal), across) >= -slack)) return "contact points out of order";
    return NULL;
}

/* What can be seen without the shapes. tolerance: that of the query. */
PART const char *answer_flaw(const pair *p, const dem2d_contact *c, double tolerance,
                             dem2d_solver solver) {
    const double slack = c->error + point_slack(p);
    const dem2d_vec a = c->point_a, b = c->point_b, n = c->normal;
    if (!vec_finite(n) || !vec_finite(a) || !vec_finite(b) || !vec_finite(c->point))
        return "a vector not finite";
    if (!isfinite(c->depth) || !isfinite(c->error)) return "a number not finite";
    if (c->error < 0) return "a negative error";
    if (!(fabsl(hypotl(n.x, n.y) - 1) <= 16 * DBL_EPSILON)) return "a normal that is not unit";
    if (c->state > DEM2D_UNRESOLVED || c->proof >= DEM2D_PROOF_COUNT) return "not a state or proof";
    if ((c->state == DEM2D_UNRESOLVED) != (c->proof == DEM2D_BY_NOTHING))
        return "proof by nothing and unresolved are not the same";
    if (c->state == DEM2D_SEPARATED && !(c->depth < 0))
        return "separated, but the depth is not < 0";
    if (c->state == DEM2D_PENETRATING && !(c->depth > 0)) return "penetrating, but depth <= 0";
    const real apart = ((real)a.x - b.x) * n.x + ((real)a.y - b.y) * n.y;
    if (c->state != DEM2D_UNRESOLVED) {
        if (!(fabsl(apart - c->depth) <= slack)) return "witness points not a depth apart";
        if (!(fabsl(witness_shear(c)) <= shear_bound(p, c, tolerance, solver)))
            return "witness points beside the normal";
        /* what Newton's last step takes away below branch and bound counts twice */
        if (c->error > (4 * tolerance + 2 * CASE_ROUNDING) * pair_size(p))
            return "an error above the tolerance";
    }
    if (!(hypotl(c->point.x - (a.x + (real)b.x) / 2, c->point.y - (a.y + (real)b.y) / 2) <= slack))
        return "the contact point not in the middle of the witness points";
    return points_flaw(p, c);
}

/* Against a depth that is known to lie from lower to upper, both to within a slack. */
PART const char *depth_flaw(const dem2d_contact *c, real lower, real upper, real slack) {
    if (!(c->depth - c->error - slack <= upper)) return "the depth is too large";
    if (!(c->depth + c->error + slack >= lower)) return "the depth is too small";
    if (c->state == DEM2D_SEPARATED && !(lower <= slack)) return "an overlap is said to be a gap";
    if (c->state == DEM2D_PENETRATING && !(upper >= -slack))
        return "a gap is said to be an overlap";
    if (c->state != DEM2D_TOUCHING) return NULL;
    /* told from a touch by 16 eps of the size */
    const real touch = c->error + 2 * slack;
    return lower <= touch && upper >= -touch ? NULL : "neither a touch nor near one";
}

/* What Newton's last step may leave in h(normal): it is not looked at again, and a radius of
   curvature that jumps on the way (polybeziers) counts with the square of the step. */
PART double step_slack(const pair *p, double tolerance) {
    return 4 * tolerance * pair_size(p);
}

/* The support value along the normal, taken to within `slack`, is the depth. It is never below the
   true one, which is within the error. */
PART const char *normal_flaw(const pair *p, const dem2d_contact *c, real value, double tolerance,
                             real slack) {
    if (!(value >= c->depth - c->error - slack)) return "the depth is above all along the normal";
    if (!(value <= c->depth + c->error + step_slack(p, tolerance) + slack))
        return "the normal does not give the depth";
    return NULL;
}

/* Depth of a point in one of the shapes, 0 on its surface. */
static real depth_in(const model *m, const dem2d_pose *pose, real x, real y) {
    const pair p = {m, NULL, *pose, {{(double)x, (double)y}, {1, 0}, 1}};
    return find_truth(&p).depth;
}

/* From the contact's normal to that of the nearest edge: 1 - cos of the angle. */
static real face_tilt(const model *m, const dem2d_pose *pose, spot u) {
    real best = -1;
    for (int i = 0; i < m->count; i++) {
        const dem2d_vec a = m->points[i], b = m->points[(i + 1) % m->count];
        const spot n = spot_unit(spot_make((real)b.y - a.y, (real)a.x - b.x));
        const real c = pose->rotation.c, s = pose->rotation.s;
        best = fmaxl(best, spot_dot(u, spot_make(c * n.x - s * n.y, s * n.x + c * n.y)));
    }
    return 1 - best;
}

/* What a rounding circle is above its straight side along a normal that is not the side's. */
static real round_slack(const model *m, const dem2d_pose *pose, spot u) {
    return m->kind == ROUNDED ? m->r * pose->scale * face_tilt(m, pose, u) : 0;
}

/* Overlaps that deep need no contact points on both surfaces. */
static bool is_deep(const pair *p, const dem2d_contact *c) {
    return c->depth > 0.2 * fmin(p->a->info.inscribed * p->pose_a.scale,
                                 p->b->info.inscribed * p->pose_b.scale);
}

/* Each contact point is in the middle of two points, half its depth from it along the normal, that
   are on the surfaces: a single one as far as the witness points are on one line and settled. Of
   two, they are on the chords of both faces. No shape is farther outside its chord than the depth
   of the contact is above that of the point, and both were made deeper together by no more than the
   depth. */
PART const char *surface_flaw(const pair *p, const dem2d_contact *c, double tolerance) {
    const real slack =
        c->error + point_slack(p) + step_slack(p, tolerance) + fabsl(witness_shear(c));
    const spot u = spot_from(c->normal), down = spot_make(-u.x, -u.y);
    if (is_deep(p, c)) return NULL;
    for (int i = 0; i < c->count; i++) {
        const dem2d_contact_point *q = &c->points[i];
        const real x = q->depth / 2.0L * u.x, y = q->depth / 2.0L * u.y;
        const dem2d_vec at = q->position;
        real a = slack, b = slack;
        if (c->count == 2) {
            const real chord = c->depth - q->depth + fabs(c->depth) / 2;
            a += chord + round_slack(p->a, &p->pose_a, u);
            b += chord + round_slack(p->b, &p->pose_b, down);
        }
        if (!(fabsl(depth_in(p->a, &p->pose_a, at.x + x, at.y + y)) <= a))
            return "a contact point is not on A's surface to half its depth";
        if (!(fabsl(depth_in(p->b, &p->pose_b, at.x - x, at.y - y)) <= b))
            return "a contact point is not on B's surface to half its depth";
    }
    return NULL;
}

/* Scenes whose line of centres gives a direction to start from: (1, 0), taken for lack of one,
   neither turns nor swaps. */
PART bool has_line(const pair *p) {
    const spot d = pair_line(p);
    return d.x != 0 || d.y != 0;
}

/* Centres so near that squares of their distance are lost, or would be when scaled by 2^-200. */
PART bool too_near(const pair *p) {
    const spot d = pair_line(p);
    return has_line(p) && hypotl(d.x, d.y) < 1e-60L;
}

/* Force and moment about a place that contact points of stiffness 1 give. */
PART void sum_points(const dem2d_contact *c, dem2d_vec about, real *force, real *moment) {
    *force = *moment = 0;
    for (int i = 0; i < c->count; i++) {
        const dem2d_contact_point *q = &c->points[i];
        const real f = q->weight * fmaxl(0, q->depth);
        const spot arm = spot_make((real)q->position.x - about.x, (real)q->position.y - about.y);
        *force += f;
        *moment += f * spot_cross(arm, spot_from(q->normal));
    }
}

/* The answer r for the pair swapped, where one direction is the least: the same bits, and of the
   contact points the same force and moment, as there may be two in one place. Closed forms differ
   in the last bits: of two edges in line either may be taken. */
PART const char *swap_flaw(const pair *p, const dem2d_contact *c, const dem2d_contact *r) {
    const double size = pair_size(p), bits = c->proof == DEM2D_BY_FORM ? DBL_EPSILON : 0;
    const double place = 256 * DBL_EPSILON * size + point_slack(p);
    if (!(fabs(r->depth - c->depth) <= 4 * bits * size)) return "another depth when swapped";
    if (!(hypot(r->normal.x + c->normal.x, r->normal.y + c->normal.y) <= 64 * bits))
        return "another normal when swapped";
    if (r->state != c->state &&
        !(bits > 0 && fabs(fabs(c->depth) - depth_slack(p)) <= 4 * bits * size))
        return "another state when swapped";
    if (r->state == DEM2D_SEPARATED || c->state == DEM2D_SEPARATED || is_deep(p, c)) return NULL;
    real force, moment, other, turn;
    sum_points(c, p->pose_a.position, &force, &moment);
    sum_points(r, p->pose_a.position, &other, &turn);
    if (!(fabsl(other - force) <= place)) return "another force when swapped";
    return fabsl(turn + moment) <= place * size ? NULL : "another moment when swapped";
}

/* --- starts of a search ----------------------------------------------------------------------- */

/* Directions that a broken cache could hold. The last is replaced by the opposite of the truth. */
enum { GARBAGE = 9 };
PART const dem2d_vec garbage_starts[GARBAGE] = {{1, 0},           {0, -1},           {-0.6, 0.8},
                                                {1e150, -1e150},  {-3e-300, 1e-300}, {0, -5e-324},
                                                {5e-324, 5e-324}, {1e300, 1e8},      {0, 0}};

/* --- to reproduce ----------------------------------------------------------------------------- */

static void print_model(const char *name, const model *m, const dem2d_pose *pose) {
    fprintf(stderr, "%s: %s a %a b %a r %a, %d points\n", name, kind_names[m->kind], m->a, m->b,
            m->r, m->count);
    for (int i = 0; i < m->count; i++)
        fprintf(stderr, "    {%a, %a},\n", m->points[i].x, m->points[i].y);
    fprintf(stderr, "    pose {{%a, %a}, {%a, %a}, %a}; radii %g, %g, rho_min %g\n",
            pose->position.x, pose->position.y, pose->rotation.c, pose->rotation.s, pose->scale,
            m->info.circumscribed, m->info.inscribed, m->info.rho_min);
}

PART const char *const proof_names[DEM2D_PROOF_COUNT] = {"nothing", "form", "radius", "arc",
                                                         "polytope"};

PART void print_answer(const char *what, const dem2d_contact *c, const pair *p) {
    const double size = pair_size(p);
    const spot n = spot_from(c->normal);
    const spot ab = spot_make((real)c->point_a.x - c->point_b.x, (real)c->point_a.y - c->point_b.y);
    static const char *const states[] = {"separated", "touching", "penetrating", "unresolved"};
    fprintf(stderr, "%s: %s by %s, depth %.17g error %.3g (of the size %.3g), normal {%a, %a}, ",
            what, states[c->state & 3], proof_names[c->proof % DEM2D_PROOF_COUNT], c->depth,
            c->error, c->error / size, c->normal.x, c->normal.y);
    fprintf(stderr, "%d calls, %d iterations\n    a {%.17g, %.17g} b {%.17g, %.17g}\n",
            c->support_calls, c->iterations, c->point_a.x, c->point_a.y, c->point_b.x,
            c->point_b.y);
    fprintf(stderr,
            "    of the size: h(normal) - depth %.3Lg, witness points less the depth %.3Lg, beside "
            "the normal %.3Lg\n",
            (pair_value(p, spot_unit(n)) - c->depth) / size, (spot_dot(ab, n) - c->depth) / size,
            spot_cross(n, ab) / size);
    for (int i = 0; i < c->count && i < 2; i++)
        fprintf(stderr, "    point {%.17g, %.17g} depth %.17g weight %.17g\n",
                c->points[i].position.x, c->points[i].position.y, c->points[i].depth,
                c->points[i].weight);
}

PART void print_scene(const scene *s) {
    const truth t = find_truth(&s->p);
    print_model("A", s->p.a, &s->p.pose_a);
    print_model("B", s->p.b, &s->p.pose_b);
    fprintf(stderr,
            "way %s, size %.17g; true depth %.21Lg (proved above %.21Lg), normal "
            "{%.21Lg, %.21Lg}; chosen %.17Lg%s\n",
            way_names[s->way], pair_size(&s->p), t.depth, t.lower, t.u.x, t.u.y, s->chosen,
            s->known     ? ""
            : s->bounded ? " (not above)"
                         : " (nothing known)");
}

#endif
