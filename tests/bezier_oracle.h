/* bezier_oracle.h - polybeziers of every kind that a user would type or a program would make, and
   what must be true of them and of their contacts, for test_bezier.c and fuzz_bezier.c. Include it
   after dem2d.h.

   A curve is the control points, drawn in long double. A grain is a curve as the caller hands it
   in: turned, scaled, moved, written with so many digits. What is true of it is taken from these
   control points, by nothing of the library: support points of the hull of all arcs
   (contact_cases.h), areas and moments by exact quadrature, contacts by the search of
   contact_cases.h, with its proof. */
#ifndef BEZIER_ORACLE_H
#define BEZIER_ORACLE_H

#include "contact_cases.h"

/* --- control points -------------------------------------------------------------------------- */

/* Arc i uses q[3i] to q[3i + 3], cyclic; counter-clockwise, about 1 in size. */
typedef struct curve {
    int count; /* of points */
    spot q[MODEL_POINTS];
} curve;

static spot spot_sum(spot a, real t, spot b) {
    return spot_make(a.x + t * b.x, a.y + t * b.y);
}

static spot spot_less(spot a, spot b) {
    return spot_make(a.x - b.x, a.y - b.y);
}

/* Start of an arc and its two handles; it ends where the next one starts. */
static void curve_arc(curve *c, spot start, spot leave, spot arrive) {
    if (c->count + 3 > MODEL_POINTS) case_broken("too many arcs");
    c->q[c->count++] = start;
    c->q[c->count++] = leave;
    c->q[c->count++] = arrive;
}

/* A straight arc: third parts, or handles anywhere on it, or in its ends. */
static void curve_straight(curve *c, spot from, spot to, uint64_t *d) {
    static const real firsts[] = {1 / 3.0L, 1 / 3.0L, 0, 0, 0.5L, 0.1L};
    static const real seconds[] = {2 / 3.0L, 2 / 3.0L, 1, 2 / 3.0L, 0.5L, 0.2L};
    const int style = random_below(d, 6);
    const spot side = spot_less(to, from);
    curve_arc(c, from, spot_sum(from, firsts[style], side), spot_sum(from, seconds[style], side));
}

/* n arcs of a circle about the origin, from one angle to another; n = 1 may turn by pi. */
static void curve_circle(curve *c, spot centre, real radius, real from, real to, int n) {
    const real step = (to - from) / n, handle = radius * 4 / 3 * tanl(step / 4);
    for (int i = 0; i < n; i++) {
        const spot u = spot_turned(spot_make(1, 0), from + i * step);
        const spot v = spot_turned(spot_make(1, 0), from + (i + 1) * step);
        const spot end = spot_sum(centre, radius, v), start = spot_sum(centre, radius, u);
        curve_arc(c, start, spot_sum(start, handle, spot_make(-u.y, u.x)),
                  spot_sum(end, -handle, spot_make(-v.y, v.x)));
    }
}

static void curve_stretch(curve *c, real fx, real fy) {
    for (int i = 0; i < c->count; i++) c->q[i].x *= fx, c->q[i].y *= fy;
}

/* --- kinds of curves ------------------------------------------------------------------------- */

/* 2 to 8 equal arcs of a circle, often stretched. */
static void draw_round(curve *c, uint64_t *d) {
    curve_circle(c, spot_make(0, 0), 1, 0, 2 * CASE_PI, 2 + random_below(d, 7));
    if (random_below(d, 3)) curve_stretch(c, 1, random_scale(d, 0.1, 1));
}

/* Two arcs, each turning by exactly pi: circles, eggs, lenses, eyes, slanted or not. */
static void draw_two_arcs(curve *c, uint64_t *d) {
    const bool equal = random_below(d, 2);
    const real width = random_scale(d, 0.2, 2),
               slant = random_below(d, 2) ? random_between(d, -1, 1) : 0;
    const spot p = spot_make(-width / 2, -slant / 2), q = spot_make(width / 2, slant / 2);
    real handles[4];
    for (int i = 0; i < 4; i++)
        handles[i] = equal && i > 0 ? handles[0] : (real)random_scale(d, 0.02, 2);
    curve_arc(c, p, spot_make(p.x, p.y - handles[0]), spot_make(q.x, q.y - handles[1]));
    curve_arc(c, q, spot_make(q.x, q.y + handles[2]), spot_make(p.x, p.y + handles[3]));
}

/* Two straight sides and two caps, of one arc or more each. */
static void draw_stadium(curve *c, uint64_t *d) {
    const real half = random_scale(d, 0.01, 3),
               radius = random_below(d, 3) ? 1 : random_scale(d, 0.05, 1);
    const int parts = random_below(d, 3) ? 1 : 2;
    const spot low = spot_make(0, -radius), high = spot_make(0, radius), out = spot_make(half, 0);
    curve_straight(c, spot_sum(low, -1, out), spot_sum(low, 1, out), d);
    curve_circle(c, out, radius, -CASE_PI / 2, CASE_PI / 2, parts);
    curve_straight(c, spot_sum(high, 1, out), spot_sum(high, -1, out), d);
    curve_circle(c, spot_make(-half, 0), radius, CASE_PI / 2, 3 * CASE_PI / 2, parts);
}

/* A flat side, a cap that turns by pi, or in two parts, and two small corners. */
static void draw_d_shape(curve *c, uint64_t *d) {
    const real corner = random_scale(d, 1e-3, 0.5), reach = random_between(d, 0, 1);
    const spot below = spot_make(corner + reach, -1), above = spot_make(corner + reach, 1);
    curve_circle(c, spot_make(corner, -1 + corner), corner, CASE_PI, 3 * CASE_PI / 2, 1);
    curve_straight(c, spot_make(corner, -1), below, d);
    if (random_below(d, 2)) {
        curve_circle(c, spot_make(below.x, 0), 1, -CASE_PI / 2, CASE_PI / 2,
                     1 + random_below(d, 2));
    } else {
        const real handle = random_scale(d, 0.1, 2);
        curve_arc(c, below, spot_make(below.x + handle, -1), spot_make(above.x + handle, 1));
    }
    curve_straight(c, above, spot_make(corner, 1), d);
    curve_circle(c, spot_make(corner, 1 - corner), corner, CASE_PI / 2, CASE_PI, 1);
    curve_straight(c, spot_make(0, 1 - corner), spot_make(0, -1 + corner), d);
}

/* A convex polygon whose corners are cut off by arcs and whose sides may bend. */
typedef struct cut_polygon {
    int count;
    spot at[8];
    real before[8], after[8]; /* arc i starts and ends there, in parts of the two sides */
    real first[8], second[8]; /* handles of arc i, in parts of the way to where they meet */
    real bend[8];             /* of side i, from corner i on: the angle at both of its ends */
} cut_polygon;

/* Corners on a stretched circle, or of a rectangle. */
static void draw_cut_polygon(cut_polygon *p, uint64_t *d) {
    const bool box = random_below(d, 3) == 0;
    const real thin = random_between(d, 0.3, 1);
    p->count = box ? 4 : 3 + random_below(d, 4);
    for (int i = 0; i < p->count; i++) {
        const real shift = box ? 0.5L : (real)random_between(d, 0, 0.6);
        const spot u = spot_turned(spot_make(1, 0), 2 * CASE_PI * (i + shift) / p->count);
        p->at[i] = spot_make(u.x, thin * u.y);
        p->before[i] = p->after[i] = random_between(d, 0.1, 0.5);
        p->first[i] = p->second[i] = random_below(d, 4) ? 0.5522847498L : 1;
        p->bend[i] = 0;
    }
}

static spot cut_side(const cut_polygon *p, int i) {
    return spot_less(p->at[(i + 1) % p->count], p->at[i]);
}

static void curve_cut(curve *c, const cut_polygon *p, uint64_t *d) {
    for (int i = 0; i < p->count; i++) {
        const int before = (i + p->count - 1) % p->count, next = (i + 1) % p->count;
        const spot in = spot_sum(p->at[i], -p->before[i], cut_side(p, before));
        const spot end = spot_sum(p->at[i], p->after[i], cut_side(p, i));
        const spot t0 = spot_unit(spot_turned(cut_side(p, before), p->bend[before]));
        const spot t1 = spot_unit(spot_turned(cut_side(p, i), -p->bend[i]));
        const spot way = spot_less(end, in);
        const real sine = spot_cross(t0, t1), a = spot_cross(way, t1) / sine;
        const real b = spot_cross(t0, way) / sine;
        curve_arc(c, in, spot_sum(in, p->first[i] * a, t0), spot_sum(end, -p->second[i] * b, t1));
        const spot far = spot_sum(p->at[next], -p->before[next], cut_side(p, i));
        const spot side = spot_less(far, end);
        const real length = hypotl(side.x, side.y);
        if (!(length > 1e-6L)) continue; /* the next arc starts where this one ends */
        if (p->bend[i] == 0) {
            curve_straight(c, end, far, d);
            continue;
        }
        const spot leave = spot_turned(side, -p->bend[i]), arrive = spot_turned(side, p->bend[i]);
        curve_arc(c, end, spot_sum(end, 1 / 3.0L, leave), spot_sum(far, -1 / 3.0L, arrive));
    }
}

/* Straight sides, rounded corners; where two cuts meet in the middle there is no side. */
static void draw_cut(curve *c, uint64_t *d) {
    cut_polygon p;
    draw_cut_polygon(&p, d);
    for (int i = 0; i < p.count; i++) {
        if (random_below(d, 3)) continue;
        p.after[i] = random_between(d, 0.1, 0.9);
        p.before[(i + 1) % p.count] = 1 - p.after[i];
    }
    curve_cut(c, &p, d);
}

/* Sides that bend by 1e-15 to 1e-3. */
static void draw_nearly_straight(curve *c, uint64_t *d) {
    cut_polygon p;
    draw_cut_polygon(&p, d);
    const real bend = random_scale(d, 1e-15, 1e-3);
    for (int i = 0; i < p.count; i++) {
        p.bend[i] = random_below(d, 2) ? bend : (real)random_scale(d, 1e-15, 1e-3);
        p.before[i] = p.after[i] = random_between(d, 0.1, 0.45);
    }
    curve_cut(c, &p, d);
}

/* Corners of 1e-14 to 1e-3 of the sides. */
static void draw_tiny(curve *c, uint64_t *d) {
    cut_polygon p;
    draw_cut_polygon(&p, d);
    const real size = random_scale(d, 1e-14, 1e-3);
    for (int i = 0; i < p.count; i++)
        if (random_below(d, 3))
            p.before[i] = p.after[i] =
                random_below(d, 2) ? size : (real)random_scale(d, 1e-14, 1e-3);
    curve_cut(c, &p, d);
}

/* Knots on an ellipse-like chain with tangents between those of the chords. */
static void draw_smooth(curve *c, uint64_t *d) {
    const int n = 3 + random_below(d, 8);
    spot knot[12], tangent[12];
    const real thin = random_between(d, 0.3, 1);
    for (int i = 0; i < n; i++) {
        const spot u =
            spot_turned(spot_make(1, 0), 2 * CASE_PI * (i + random_between(d, 0, 0.7)) / n);
        knot[i] = spot_make(u.x, thin * u.y);
    }
    for (int i = 0; i < n; i++) {
        const spot in = spot_unit(spot_less(knot[i], knot[(i + n - 1) % n]));
        const spot out = spot_unit(spot_less(knot[(i + 1) % n], knot[i]));
        const real w = random_between(d, 0.1, 0.9);
        tangent[i] = spot_unit(spot_make((1 - w) * in.x + w * out.x, (1 - w) * in.y + w * out.y));
    }
    for (int i = 0; i < n; i++) {
        const int k = (i + 1) % n;
        const spot way = spot_less(knot[k], knot[i]), s = tangent[i], t = tangent[k];
        const real sine = spot_cross(s, t); /* arcs that turn by more than pi/2 may lack one */
        real a = hypotl(way.x, way.y), b = a;
        if (sine > 0.01L) a = spot_cross(way, t) / sine, b = spot_cross(s, way) / sine;
        a *= random_between(d, 0.2, 0.95), b *= random_between(d, 0.2, 0.95);
        curve_arc(c, knot[i], spot_sum(knot[i], a, s), spot_sum(knot[k], -b, t));
    }
}

/* Each arc of a curve cut in two, or not, by de Casteljau: nearly in the middle or at an end. */
static void curve_split(curve *c, uint64_t *d) {
    const curve old = *c;
    c->count = 0;
    for (int i = 0; i < old.count; i += 3) {
        const spot *q = &old.q[i], end = old.q[(i + 3) % old.count];
        if (random_below(d, 3) == 0 || c->count + 6 + old.count - i > MODEL_POINTS) {
            curve_arc(c, q[0], q[1], q[2]);
            continue;
        }
        const real t =
            random_below(d, 3) ? random_between(d, 0.05, 0.95) : random_scale(d, 1e-10, 0.1);
        const spot a = spot_sum(q[0], t, spot_less(q[1], q[0]));
        const spot m = spot_sum(q[1], t, spot_less(q[2], q[1]));
        const spot b = spot_sum(q[2], t, spot_less(end, q[2]));
        const spot am = spot_sum(a, t, spot_less(m, a)), mb = spot_sum(m, t, spot_less(b, m));
        curve_arc(c, q[0], a, am);
        curve_arc(c, spot_sum(am, t, spot_less(mb, am)), mb, b);
    }
}

/* Control points of straight and bent arcs drawn into the ends, or to where the handles meet. */
static void draw_doubled(curve *c, uint64_t *d) {
    cut_polygon p;
    draw_cut_polygon(&p, d);
    for (int i = 0; i < p.count; i++) {
        const int style = random_below(d, 4);
        p.first[i] = style == 0 ? 0 : style == 1 ? 1 : (real)0.5522847498L;
        p.second[i] = style == 2 ? 0 : style == 1 ? 1 : (real)0.5522847498L;
        if (style == 0) p.second[i] = 1; /* the arc leaves along the line to that handle */
        if (style == 2) p.first[i] = 1;
    }
    curve_cut(c, &p, d);
}

static void draw_simple(curve *c, uint64_t *d) {
    static void (*const draws[])(curve *, uint64_t *) = {draw_round,   draw_two_arcs, draw_stadium,
                                                         draw_d_shape, draw_cut,      draw_smooth};
    draws[random_below(d, 6)](c, d);
}

static void draw_split(curve *c, uint64_t *d) {
    draw_simple(c, d);
    for (int i = random_below(d, 3); i >= 0; i--) curve_split(c, d);
}

static void draw_needle(curve *c, uint64_t *d) {
    draw_simple(c, d);
    curve_stretch(c, 1, random_scale(d, 1e-6, 0.1));
}

/* --- fits to outlines ------------------------------------------------------------------------ */

typedef struct outline {
    dem2d_vec *points;
    int count;
} outline;

/* Outlines of real grains, where the program has read some. */
enum { OUTLINES = 512 };
static outline outlines[OUTLINES];
static int outline_count;

/* A file of lines x,y after a line that says so; false if it is none. */
PART bool outline_read(const char *path) {
    char line[256];
    outline o = {NULL, 0};
    int room = 0;
    FILE *file = fopen(path, "r");
    if (file == NULL) return false;
    const bool named = fgets(line, sizeof line, file) != NULL && strncmp(line, "x,y", 3) == 0;
    while (named && outline_count < OUTLINES && fgets(line, sizeof line, file) != NULL) {
        dem2d_vec p;
        if (sscanf(line, "%lf,%lf", &p.x, &p.y) != 2) continue;
        if (o.count == room) {
            room = room ? 2 * room : 256;
            dem2d_vec *more = realloc(o.points, (size_t)room * sizeof *more);
            if (more == NULL) case_broken("out of memory");
            o.points = more;
        }
        o.points[o.count++] = p;
    }
    fclose(file);
    if (o.count < 3) {
        free(o.points);
        return false;
    }
    outlines[outline_count++] = o;
    return true;
}

PART void outlines_free(void) {
    while (outline_count > 0) free(outlines[--outline_count].points);
}

/* A grain of random harmonics, seen in pixels of 1/40 of its size, or finely. */
static int draw_outline(dem2d_vec *points, int count, uint64_t *d) {
    double a[17], b[17];
    dem2d_virtual_desc desc = {0};
    desc.radius = 1, desc.seed = random_bits(d), desc.elongation = random_between(d, 0, 0.2);
    desc.roundness = random_between(d, 0, 0.1), desc.roughness = random_between(d, 0, 0.02);
    if (dem2d_fourier_virtual(&desc, 16, a, b) != DEM2D_OK) case_broken("no virtual grain");
    const double pixel = random_below(d, 2) ? 1 / 40.0 : 1e-6;
    for (int i = 0; i < count; i++) {
        const double t = 2 * (double)CASE_PI * i / count;
        double p = a[0] / 2, q = 0;
        for (int n = 1; n <= 16; n++) {
            p += a[n] * cos(n * t) + b[n] * sin(n * t);
            q += n * (b[n] * cos(n * t) - a[n] * sin(n * t));
        }
        points[i].x = floor((p * cos(t) - q * sin(t)) / pixel + 0.5) * pixel;
        points[i].y = floor((p * sin(t) + q * cos(t)) / pixel + 0.5) * pixel;
    }
    return count;
}

static void draw_fitted(curve *c, uint64_t *d) {
    enum { DRAWN = 120, ARCS = 24 };
    dem2d_vec drawn[DRAWN], control[3 * ARCS];
    outline o = {drawn, 0};
    if (outline_count > 0 && random_below(d, 4))
        o = outlines[random_below(d, outline_count)];
    else
        o.count = draw_outline(drawn, DRAWN, d);
    const int arcs = random_below(d, 2) ? 10 : 4 + random_below(d, ARCS - 3);
    if (dem2d_bezier_fit(NULL, o.points, o.count, arcs, control) != DEM2D_OK) return;
    double size = 0;
    for (int i = 1; i < 3 * arcs; i++)
        size = fmax(size, hypot(control[i].x - control[0].x, control[i].y - control[0].y));
    for (int i = 0; i < 3 * arcs; i++)
        c->q[i] = spot_make(control[i].x * 2 / (real)size, control[i].y * 2 / (real)size);
    c->count = 3 * arcs;
}

/* --- grains: curves as callers hand them in --------------------------------------------------- */

enum {
    ROUND,
    TWO_ARCS,
    STADIUM,
    D_SHAPE,
    CUT,
    NEARLY_STRAIGHT,
    TINY,
    SMOOTH,
    SPLIT,
    DOUBLED,
    NEEDLE,
    FITTED,
    CURVES
};
PART const char *const curve_names[CURVES] = {
    "round", "two arcs", "stadium", "D shape", "cut polygon", "nearly straight",
    "tiny",  "smooth",   "split",   "doubled", "needle",      "fitted"};

/* How the control points are written down. */
enum { AS_DOUBLE, AS_FLOAT, NINE_DIGITS, SEVEN_DIGITS, FIVE_DIGITS, WRITTEN };
PART const char *const written_names[WRITTEN] = {"double", "float", "9 digits", "7 digits",
                                                 "5 digits"};

typedef struct grain {
    model m; /* m.shape is NULL if it was refused */
    int curve, written;
    dem2d_result result;
    bool allowed; /* by what dem2d_shape_create_bezier says it takes */
    real kink;    /* rad, most that neighbouring legs turn at a knot, or to the right */
    double size;  /* of the template; poses are scaled by 1 / size */
    uint64_t seed;
} grain;

static void curve_draw(curve *c, int kind, uint64_t *d) {
    static void (*const draws[CURVES])(curve *, uint64_t *) = {
        draw_round, draw_two_arcs, draw_stadium, draw_d_shape, draw_cut,    draw_nearly_straight,
        draw_tiny,  draw_smooth,   draw_split,   draw_doubled, draw_needle, draw_fitted};
    c->count = 0;
    draws[kind](c, d);
}

static double written(real value, int how) {
    static const int digits[WRITTEN] = {17, 17, 9, 7, 5};
    char text[40];
    if (how == AS_DOUBLE) return (double)value;
    if (how == AS_FLOAT) return (double)(float)value;
    snprintf(text, sizeof text, "%.*Lg", digits[how], value);
    return strtod(text, NULL);
}

/* Turned by quarters or anyhow, moved, mirrored (clockwise), begun at another arc. Sizes other
   than 1 only where every digit is kept: floats end at 1e38. */
static void grain_write(grain *g, const curve *c, uint64_t *d) {
    static const double moves[] = {0, 0, 0, 1, 1000};
    model *m = &g->m;
    const int quarters = random_below(d, 4), first = 3 * random_below(d, c->count / 3);
    const real angle = random_below(d, 2) ? quarters * CASE_PI / 2 : (real)random_between(d, -4, 4);
    const double move = g->curve == NEEDLE ? 0 : moves[random_below(d, 5)];
    const bool mirrored = random_below(d, 4) == 0;
    g->size = 1;
    if (g->written == AS_DOUBLE && random_below(d, 3) == 0) g->size = random_scale(d, 1e-60, 1e60);
    const real f = g->size;
    const spot turn = random_below(d, 2) ? spot_turned(spot_make(1, 0), angle)
                                         : (spot[4]){{1, 0}, {0, 1}, {-1, 0}, {0, -1}}[quarters];
    const spot shift = spot_make(move * random_between(d, -1, 1), move * random_between(d, -1, 1));
    m->count = c->count;
    for (int i = 0; i < m->count; i++) {
        const spot q = c->q[(i + first) % m->count];
        const real x = shift.x + turn.x * q.x - turn.y * q.y, y = turn.x * q.y + turn.y * q.x;
        m->points[i].x = written(f * (mirrored ? -x : x), g->written);
        m->points[i].y = written(f * (shift.y + y), g->written);
    }
}

/* --- what is true of a grain ----------------------------------------------------------------- */

static real grain_coordinates(const model *m) {
    real most = 0;
    for (int i = 0; i < m->count; i++)
        most = fmaxl(most, fmaxl(fabsl(m->points[i].x), fabsl(m->points[i].y)));
    return most;
}

/* Area, centroid and polar moment about it, in long double; the area is below 0 if clockwise. */
typedef struct moments {
    real area, polar;
    spot centroid;
} moments;

/* Green: integrals of x dy and the like, polynomials of degree 11 at most in the parameter of an
   arc: exact with six nodes of Gauss and Legendre, about the first point. */
static moments grain_moments(const model *m) {
    static const real nodes[3] = {0.2386191860831969086305017216807119354L,
                                  0.6612093864662645136613995950199053471L,
                                  0.9324695142031520278123015544939946091L};
    static const real weights[3] = {0.4679139345726910473898703439895509948L,
                                    0.3607615730481386075698335138377161117L,
                                    0.1713244923791703450402961421727328935L};
    moments sum = {0, 0, {0, 0}};
    const spot from = control_point(m, 0);
    for (int i = 0; i < m->count; i += 3)
        for (int k = 0; k < 6; k++) {
            const real t = (1 + (k < 3 ? nodes[k] : -nodes[k - 3])) / 2, s = 1 - t;
            const spot q0 = control_point(m, i), q1 = control_point(m, i + 1);
            const spot q2 = control_point(m, i + 2), q3 = control_point(m, i + 3);
            const spot p = spot_less(arc_point(m, i, t), from);
            const spot v = spot_make(
                3 * (s * s * (q1.x - q0.x) + 2 * s * t * (q2.x - q1.x) + t * t * (q3.x - q2.x)),
                3 * (s * s * (q1.y - q0.y) + 2 * s * t * (q2.y - q1.y) + t * t * (q3.y - q2.y)));
            const real w = weights[k % 3] / 2;
            sum.area += w * (p.x * v.y - p.y * v.x) / 2;
            sum.centroid.x += w * p.x * p.x * v.y / 2;
            sum.centroid.y -= w * p.y * p.y * v.x / 2;
            sum.polar += w * (p.x * p.x * p.x * v.y - p.y * p.y * p.y * v.x) / 3;
        }
    const spot c = spot_make(sum.centroid.x / sum.area, sum.centroid.y / sum.area);
    sum.polar = sum.polar - sum.area * spot_dot(c, c);
    sum.centroid = spot_sum(spot_from(m->points[0]), 1, c);
    return sum;
}

/* What dem2d_shape_create_bezier says it takes: tangents of neighbours that agree and legs of the
   control polygon that turn to the left, both to 1e-6 (a tenth of that is left to either side) or
   to the rounding of coordinates; no arc turning by more than pi, one turn in all. Legs of no
   length have no direction. */
static bool grain_allowed(const model *m, real *kink) {
    const real sign = grain_moments(m).area < 0 ? -1 : 1, rounding = 2 * DBL_EPSILON;
    const real coordinates = grain_coordinates(m);
    spot legs[MODEL_POINTS];
    real lengths[MODEL_POINTS], turned = 0, arc = 0;
    for (int i = 0; i < m->count; i++) {
        const spot p = spot_from(m->points[i]);
        legs[i] = spot_less(spot_from(m->points[(i + 1) % m->count]), p);
        lengths[i] = hypotl(legs[i].x, legs[i].y);
    }
    int last = m->count - 1;
    while (last > 0 && lengths[last] <= 4 * rounding * coordinates) last--;
    for (int i = 0, arcs = 0; i < m->count; i++) {
        if (i / 3 != arcs) arc = 0, arcs = i / 3;
        if (lengths[i] <= 4 * rounding * coordinates) {
            if (i % 3 == 2 && last / 3 != i / 3) return false; /* an arc that is a point */
            continue;
        }
        const real sine = sign * spot_cross(legs[last], legs[i]) / (lengths[last] * lengths[i]);
        const real angle = atan2l(sine * lengths[last] * lengths[i], spot_dot(legs[last], legs[i]));
        const real slack = 0.9e-6L + rounding * coordinates * (1 / lengths[last] + 1 / lengths[i]);
        const bool knot = last / 3 != i / 3 || last >= i;
        *kink = fmaxl(*kink, knot ? fabsl(angle) : -angle);
        if (angle < -slack || (knot && angle > slack)) return false;
        if (!knot) arc += angle;
        if (arc > CASE_PI + slack) return false;
        turned += angle, last = i;
    }
    return fabsl(turned - 2 * CASE_PI) < 1e-3L;
}

/* Greatest distance of the curve from its centroid: samples, a little below the truth. */
static real grain_reach(const model *m) {
    real most = 0;
    for (int i = 0; i < m->count; i += 3)
        for (int k = 0; k < 64; k++) {
            const spot p = arc_point(m, i, k / 64.0L);
            most = fmaxl(most, hypotl(p.x, p.y));
        }
    return most;
}

/* The grain of a seed; deterministic, whatever the library does but for fits. */
PART void grain_draw(grain *g, int kind, uint64_t seed) {
    uint64_t d = seed;
    curve c;
    memset(g, 0, sizeof *g);
    g->curve = kind, g->seed = seed, g->m.kind = BEZIER, g->result = DEM2D_NOT_REACHED;
    g->written = random_below(&d, 2) ? AS_DOUBLE : random_below(&d, WRITTEN);
    curve_draw(&c, kind, &d);
    if (c.count == 0) return;
    grain_write(g, &c, &d);
    g->allowed = grain_allowed(&g->m, &g->kink);
    g->result = model_make(&g->m);
    if (g->result != DEM2D_OK) {
        g->m.shape = NULL;
        return;
    }
    if (dem2d_shape_get(g->m.shape, &g->m.info) != DEM2D_OK) case_broken("a shape without info");
    g->m.rho_min = g->m.info.rho_min;
    /* where coordinates are far greater than the size, the offset is rounded, the template is not
     */
    if (grain_coordinates(&g->m) > 8 * g->size)
        g->m.beyond = spot_less(grain_moments(&g->m).centroid, spot_from(g->m.info.offset));
}

/* --- pairs of grains ------------------------------------------------------------------------- */

/* Gaps, touches and overlaps of 1e-15 of the size to half of it. */
static real draw_depth(const pair *p, uint64_t *d) {
    const double size =
        p->pose_a.scale * p->a->info.circumscribed + p->pose_b.scale * p->b->info.circumscribed;
    const int style = random_below(d, 8);
    if (style == 0) return 0;
    if (style < 3) return -size * random_scale(d, 1e-15, 1);
    return size * (style < 5 ? random_scale(d, 1e-15, 0.1) : random_between(d, 0, 0.5));
}

/* Two shapes placed by a normal and a depth, or face to face, anywhere, concentric, one in another;
   sizes are those of the templates. */
PART pair pair_draw(const model *a, double size_a, const model *b, double size_b, uint64_t *d) {
    scene s;
    memset(&s, 0, sizeof s);
    pair *p = &s.p;
    const int way = random_below(d, 8);
    p->a = a, p->b = b;
    p->pose_a.rotation = draw_rotation(d), p->pose_b.rotation = draw_rotation(d);
    p->pose_a.scale = (random_below(d, 3) ? random_between(d, 0.5, 2) : 1) / size_a;
    p->pose_b.scale = (random_below(d, 3) ? random_between(d, 0.5, 2) : 1) / size_b;
    if (way == 7) p->pose_b.scale *= random_scale(d, 1e-6, 0.1);
    if (random_below(d, 2)) p->pose_a.position = (dem2d_vec){random_between(d, -1, 1), 0.5};
    p->pose_b.position = p->pose_a.position;
    const spot u = draw_normal(a, &p->pose_a, d), v = draw_normal(b, &p->pose_b, d);
    if (way < 3 || way == 7) scene_place(&s, u, draw_depth(p, d));
    if (way == 3) scene_place(&s, spot_make(-v.x, -v.y), draw_depth(p, d));
    if (way == 4) {
        turn_against(p, u, v, random_below(d, 2) ? random_scale(d, 1e-15, 1e-3) : 0);
        scene_place(&s, u, draw_depth(p, d));
        const double slide = random_between(d, -1, 1) * (random_below(d, 4) ? 1 : 1e-6);
        p->pose_b.position.x -= slide * (double)u.y, p->pose_b.position.y += slide * (double)u.x;
    }
    if (way == 5) {
        p->pose_b.position.x += random_between(d, -2, 2);
        p->pose_b.position.y += random_between(d, -2, 2);
    }
    if (way == 6) {
        const double off = random_below(d, 2) ? random_scale(d, 1e-16, 0.3) : 0;
        p->pose_b.position.x += off * (double)u.x, p->pose_b.position.y += off * (double)u.y;
        if (random_below(d, 3) == 0) p->pose_b.rotation = p->pose_a.rotation;
    }
    return s.p;
}

/* --- what must be true ----------------------------------------------------------------------- */

/* The functions below return what is wrong, or NULL. */

/* Of the size, by which a witness point may miss the outline, or a box the shape. */
#define OUTLINE_TOLERANCE 1e-10L

static real vec_greatest(dem2d_vec v) {
    return fmaxl(fabsl(v.x), fabsl(v.y));
}

/* Rounding of a point in the coordinates of the poses: its own, and that of the sizes. */
static real place_rounding(const pair *p, dem2d_vec point) {
    return depth_slack(p) +
           4 * DBL_EPSILON * (vec_greatest(point) + vec_greatest(p->pose_a.position));
}

/* A grain that was refused or accepted, as what it says it takes has it. */
PART const char *creation_flaw(const grain *g) {
    if (g->m.count == 0 || g->m.shape != NULL) return NULL;
    return g->allowed ? "refused, though convex and smooth" : NULL;
}

/* Numbers of dem2d_shape_get: mass by quadrature, circles by samples and by a search. */
PART const char *measures_flaw(const grain *g) {
    const model *m = &g->m;
    const dem2d_shape_info *info = &m->info;
    const moments t = grain_moments(m);
    const real reach = grain_reach(m), area = fabsl(t.area), part = 1e-14L * reach;
    const real off = hypotl(info->offset.x - t.centroid.x, info->offset.y - t.centroid.y);
    const pair middle = {m, NULL, {{0, 0}, {1, 0}, 1}, {{0, 0}, {1, 0}, 1}};
    const real inner = find_truth(&middle).depth;
    if (!(fabsl(info->mass.area - area) <= part * reach)) return "another area";
    if (!(off <= part * reach * reach / area + 2 * DBL_EPSILON * grain_coordinates(m)))
        return "another centroid";
    if (!(fabsl(info->mass.polar_moment - fabsl(t.polar)) <= part * reach * reach * reach))
        return "another polar moment";
    if (!(info->circumscribed >= reach - part && info->circumscribed <= 1.001L * reach))
        return "a bounding circle too small, or too large";
    const real kinks = g->kink * reach; /* nothing of the grain is known better */
    if (!(info->inscribed <= inner + part + kinks &&
          info->inscribed >= inner - 1e-8L * reach - kinks))
        return "an inscribed circle too large, or too small";
    return NULL;
}

/* Radius of curvature of a template where it is farthest along u; 0 at corners, and on arcs that
   are straight to rounding: there the normal is that of the face, and no radius counts. */
static real model_rho(const model *m, spot u) {
    if (m->kind == FOURIER) {
        const real e = 1e-4L;
        const spot p = series_support(m, spot_turned(u, -e)),
                   q = series_support(m, spot_turned(u, e));
        return hypotl(q.x - p.x, q.y - p.y) / (2 * e);
    }
    if (m->kind != BEZIER) {
        const real a = m->a, b = m->b, h = hypotl(a * u.x, b * u.y);
        return m->r + (a > 0 ? a * (a / h) * (b / h) * (b / h) : 0);
    }
    real t;
    const int first = arcs_farthest(m, u, &t);
    const spot q0 = control_point(m, first), q1 = control_point(m, first + 1);
    const spot q2 = control_point(m, first + 2), q3 = control_point(m, first + 3);
    const spot chord = spot_less(q3, q0);
    const real bulge = fmaxl(fabsl(spot_cross(chord, spot_less(q1, q0))),
                             fabsl(spot_cross(chord, spot_less(q2, q0))));
    const real length = hypotl(chord.x, chord.y);
    if (bulge <= 64 * DBL_EPSILON * grain_coordinates(m) * length) return 0;
    const real s = 1 - t;
    const spot d0 = spot_less(q1, q0), d1 = spot_less(q2, q1), d2 = spot_less(q3, q2);
    const spot v = spot_make(s * s * d0.x + 2 * s * t * d1.x + t * t * d2.x,
                             s * s * d0.y + 2 * s * t * d1.y + t * t * d2.y);
    const spot w =
        spot_make(s * (d1.x - d0.x) + t * (d2.x - d1.x), s * (d1.y - d0.y) + t * (d2.y - d1.y));
    const real speed = hypotl(v.x, v.y), turn = fabsl(spot_cross(v, w));
    return speed > 0 ? 1.5L * speed * (speed / turn) * speed : 0;
}

/* The greatest radius of curvature near a direction of a posed shape. */
static real posed_rho(const model *m, const dem2d_pose *pose, spot u) {
    const real c = pose->rotation.c, s = pose->rotation.s;
    const spot v = spot_unit(spot_make(c * u.x + s * u.y, c * u.y - s * u.x));
    real most = 0;
    for (int i = -1; i <= 1; i++) most = fmaxl(most, model_rho(m, spot_turned(v, i * 1e-7L)));
    return most * pose->scale;
}

static real distance_to_segment(spot p, spot a, spot b) {
    const spot e = spot_less(b, a), r = spot_less(p, a);
    const real square = spot_dot(e, e), along = square > 0 ? spot_dot(r, e) / square : 0;
    const spot q = spot_sum(a, fminl(1, fmaxl(0, along)), e);
    return hypotl(p.x - q.x, p.y - q.y);
}

/* A point on the outline of a shape: no deeper in it than a tolerance, and no farther from it. u:
   where to look first; chords of the outline are in the shape. The search decides the rest. */
static bool on_outline(const model *m, const dem2d_pose *pose, dem2d_vec point, spot u,
                       real tolerance) {
    const pair p = {m, NULL, *pose, {point, {1, 0}, 1}};
    const spot at = pair_line(&p);
    if (spot_dot(pair_support(&p, u), u) <= tolerance)
        for (real angle = 1e-3L; angle > 1e-10L; angle *= 0.01L) {
            const spot a = posed_support(m, pose, spot_turned(u, -angle));
            const spot b = posed_support(m, pose, spot_turned(u, angle));
            if (distance_to_segment(at, a, b) <= tolerance) return true;
        }
    const truth t = find_truth(&p);
    return t.depth <= tolerance && t.lower >= -tolerance;
}

/* How far a witness point may be off the outline. */
static real outline_room(const pair *p, dem2d_vec point) {
    return OUTLINE_TOLERANCE * pair_size(p) + place_rounding(p, point);
}

/* The witness points lie on the outlines. */
PART const char *outline_flaw(const pair *p, const dem2d_contact *c) {
    const spot u = spot_unit(spot_from(c->normal)), v = spot_make(-u.x, -u.y);
    if (!on_outline(p->a, &p->pose_a, c->point_a, u, outline_room(p, c->point_a)))
        return "a witness point is not on A's outline";
    if (p->b != NULL && !on_outline(p->b, &p->pose_b, c->point_b, v, outline_room(p, c->point_b)))
        return "a witness point is not on B's outline";
    return NULL;
}

/* They are a depth apart along the normal, to 1e-6 of the size and what the tolerance lets the
   normal turn: by e, where rho e^2 / 2 is the tolerance, so rho e = sqrt(2 rho tolerance). */
PART const char *place_flaw(const pair *p, const dem2d_contact *c, real tolerance) {
    const spot u = spot_unit(spot_from(c->normal));
    const real size = pair_size(p);
    const real x = (real)c->point_a.x - c->point_b.x - c->depth * u.x;
    const real y = (real)c->point_a.y - c->point_b.y - c->depth * u.y;
    real rho = posed_rho(p->a, &p->pose_a, u);
    if (p->b != NULL) rho += posed_rho(p->b, &p->pose_b, spot_make(-u.x, -u.y));
    const real room = size * (1e-6L + sqrtl(2 * rho / size * tolerance));
    return hypotl(x, y) <= room + place_rounding(p, c->point_a)
               ? NULL
               : "the witness points are not a depth apart along the normal";
}

/* The depth of the truth is within the error. kink: of the grains, rad; the error may be so much of
   the size above what was asked for. */
PART const char *bound_flaw(const pair *p, const dem2d_contact *c, const truth *t, real tolerance,
                            real kink) {
    const real size = pair_size(p), rounding = 16 * LDBL_EPSILON * size;
    if (!(c->error >= 0 && isfinite(c->depth))) return "a negative error, or a depth not finite";
    if (!(c->depth - c->error <= t->depth + rounding)) return "the depth is too large";
    if (!(c->depth + c->error >= t->lower - rounding)) return "the depth is too small";
    if (c->state != DEM2D_UNRESOLVED &&
        !(c->error <= size * (4 * tolerance + 2 * CASE_ROUNDING + kink)))
        return "an error above the tolerance";
    return NULL;
}

PART const char *state_flaw(const pair *p, const dem2d_contact *c, const truth *t) {
    const real slack = depth_slack(p);
    if (c->state == DEM2D_SEPARATED && !(t->lower <= slack))
        return "an overlap is said to be a gap";
    if (c->state == DEM2D_PENETRATING && !(t->depth >= -slack))
        return "a gap is said to be an overlap";
    if (c->state == DEM2D_TOUCHING &&
        !(t->lower <= c->error + slack && t->depth >= -c->error - slack))
        return "neither a touch nor near one";
    return NULL;
}

/* A search may give up, at its cap of 128 iterations, only where one who knows the depth already
   needs a third of them to prove it. */
PART const char *unresolved_flaw(const pair *p, const dem2d_contact *c, const truth *t,
                                 double tolerance) {
    if (c->state != DEM2D_UNRESOLVED) return NULL;
    return proof_halvings(p, t, tolerance * pair_size(p)) < 128 / 3 ? "given up too early" : NULL;
}

/* --- boxes and walls ------------------------------------------------------------------------- */

/* A box holds the shape, to rounding and what the contact with a wall says that the shape may be
   off by, and touches it on all sides. */
PART const char *box_flaw(const pair *p) {
    const model *m = p->a;
    dem2d_box box;
    dem2d_contact c;
    const dem2d_vec at = p->pose_a.position;
    if (dem2d_shape_aabb(m->shape, p->pose_a, &box) != DEM2D_OK ||
        dem2d_wall_contact(m->shape, p->pose_a, at, (dem2d_vec){0, 1}, &c) != DEM2D_OK)
        case_broken("a box was refused");
    const double sides[4] = {box.upper.x, box.upper.y, -box.lower.x, -box.lower.y};
    const double places[4] = {at.x, at.y, -at.x, -at.y};
    for (int i = 0; i < 4; i++) {
        const spot u = (spot[4]){{1, 0}, {0, 1}, {-1, 0}, {0, -1}}[i];
        const real far = spot_dot(posed_support(m, &p->pose_a, u), u);
        const real rounding = 4 * DBL_EPSILON * fabsl(places[i]);
        const real over = (real)sides[i] - places[i] - far;
        if (!(over >= -c.error - rounding)) return "a box does not hold the shape";
        if (!(over <= OUTLINE_TOLERANCE * m->info.circumscribed * p->pose_a.scale + rounding))
            return "a box is too large";
    }
    return NULL;
}

/* A wall: a point on it and its normal, towards the shape A of a pair. */
typedef struct wall {
    dem2d_vec point, normal;
} wall;

/* Along an axis, a face or anything; at any depth, the point anywhere along it. */
PART wall wall_draw(const pair *p, uint64_t *d) {
    const spot u = draw_normal(p->a, &p->pose_a, d);
    const spot far = posed_support(p->a, &p->pose_a, u);
    const double size = p->a->info.circumscribed * p->pose_a.scale;
    const real depth =
        size * (random_below(d, 2) ? 1 : -1) * (random_below(d, 3) ? random_scale(d, 1e-15, 1) : 0);
    const real slide = size * random_between(d, -2, 2);
    wall w;
    w.point.x = (double)(p->pose_a.position.x + far.x - depth * u.x - slide * u.y);
    w.point.y = (double)(p->pose_a.position.y + far.y - depth * u.y + slide * u.x);
    w.normal = spot_rounded(spot_make(-u.x, -u.y));
    return w;
}

/* The contact of a shape and a wall: depth by the support point, that point in its place. */
PART const char *wall_flaw(const pair *p, const wall *w, const dem2d_contact *c) {
    const pair half = {p->a, NULL, p->pose_a, {w->point, {1, 0}, 1}};
    const spot u = spot_unit(spot_make(-(real)w->normal.x, -(real)w->normal.y));
    const real depth = pair_value(&half, u), rounding = place_rounding(&half, w->point);
    const truth t = {depth, depth, u};
    const char *flaw = bound_flaw(&half, c, &t, CASE_TOLERANCE, 1e-6L);
    if (flaw == NULL) flaw = state_flaw(&half, c, &t);
    if (flaw == NULL) flaw = outline_flaw(&half, c);
    if (flaw != NULL) return flaw;
    const spot a = spot_less(spot_from(c->point_a), spot_from(w->point));
    const spot b = spot_less(spot_from(c->point_b), spot_from(w->point));
    const real own = outline_room(&half, c->point_a);
    if (!(hypotl(c->normal.x - u.x, c->normal.y - u.y) <= 16 * DBL_EPSILON))
        return "the normal is not the wall's";
    if (!(fabsl(spot_dot(a, u) - depth) <= own)) return "the witness point is not the deepest";
    if (!(fabsl(spot_dot(b, u)) <= rounding)) return "the point on the wall is not on it";
    if (!(fabsl(spot_cross(spot_less(a, b), u)) <= rounding))
        return "the witness points are not across the wall";
    return NULL;
}

/* --- in a world ------------------------------------------------------------------------------ */

/* The world's default for its contact_tolerance: of R_A + R_B + |d|. */
#define WORLD_TOLERANCE 1e-8

static dem2d_world *world_make(const pair *p, dem2d_vec start, dem2d_vec end, pair *placed) {
    dem2d_world_desc desc = {0};
    dem2d_material_desc material = {0};
    dem2d_wall_desc segment = {0};
    dem2d_world *world;
    dem2d_wall_id wall_id;
    desc.time_step = 1, desc.skip_time_step_check = true;
    material.density = 1, material.normal_stiffness = 1e-6;
    bool good = dem2d_world_create(&desc, &world) == DEM2D_OK &&
                dem2d_world_add_material(world, &material, &segment.material) == DEM2D_OK;
    segment.segment = true, segment.point = start, segment.end = end;
    good = good && dem2d_world_add_wall(world, &segment, &wall_id) == DEM2D_OK;
    *placed = *p;
    for (int i = 0; good && i < 2; i++) {
        const dem2d_pose *pose = i ? &p->pose_b : &p->pose_a;
        dem2d_particle_desc particle = {0};
        dem2d_particle_info info;
        dem2d_particle_id id;
        particle.material = segment.material, particle.position = pose->position;
        particle.angle = dem2d_rot_angle(pose->rotation), particle.scale = pose->scale;
        good = dem2d_world_add_shape(world, i ? p->b->shape : p->a->shape, &particle.shape) ==
                   DEM2D_OK &&
               dem2d_world_add_particle(world, &particle, &id) == DEM2D_OK &&
               dem2d_world_get_particle(world, id, &info) == DEM2D_OK;
        if (good) *(i ? &placed->pose_b : &placed->pose_a) = info.pose;
    }
    if (!good) case_broken("no world");
    return world;
}

/* One contact, or none, where the truth has an overlap, or a gap. Of two points the normal is that
   of their force. */
static const char *listed_flaw(const pair *p, const dem2d_contact_info *c, real kink) {
    const truth t = find_truth(p);
    const real room = (2 * WORLD_TOLERANCE + kink) * pair_size(p);
    if (c == NULL) return t.lower > room ? "no contact in the world" : NULL;
    if (!(fabsl(c->depth - t.depth) <= room + t.depth - t.lower))
        return "another depth in the world";
    if (c->points == 1 && !(pair_value(p, spot_unit(spot_from(c->normal))) <= t.depth + 2 * room))
        return "the normal in the world does not give the depth";
    return NULL;
}

/* A segment that touches one of two shapes somewhere, and they one another, in a world. */
PART const char *world_flaw(const pair *p, const wall *w, double length, real kink) {
    const model line = {
        .kind = POLYGON, .count = 2, .points = {{0, 0}, {1, 0}}, .info = {.circumscribed = 1}};
    const dem2d_vec n = w->normal, start = w->point;
    const dem2d_vec end = {start.x + length * n.y, start.y - length * n.x};
    dem2d_contact_info found[3];
    int count;
    pair placed;
    const char *flaw = NULL;
    dem2d_world *world = world_make(p, start, end, &placed);
    if (dem2d_world_step(world, 1, NULL) != DEM2D_OK ||
        dem2d_world_contacts(world, found, 3, &count) != DEM2D_OK)
        case_broken("a world without a step");
    const dem2d_pose along = {
        start, {(end.x - start.x) / length, (end.y - start.y) / length}, length};
    const pair pairs[3] = {
        placed, {placed.a, &line, placed.pose_a, along}, {placed.b, &line, placed.pose_b, along}};
    for (int i = 0; i < 3 && flaw == NULL; i++) {
        const dem2d_contact_info *contact = NULL;
        for (int k = 0; k < count; k++) {
            const bool with_wall = found[k].wall.generation != 0;
            if (with_wall == (i > 0) && (!with_wall || (int)found[k].a.index == i - 1))
                contact = &found[k];
        }
        flaw = listed_flaw(&pairs[i], contact, kink);
    }
    dem2d_world_destroy(world);
    return flaw;
}

/* --- what is counted ------------------------------------------------------------------------- */

enum {
    CREATION,
    MEASURES,
    BOUND,
    STATE,
    NORMAL,
    OUTLINE,
    PLACE,
    UNRESOLVED,
    BOX,
    WALL,
    WORLD,
    CHECKS
};
static const char *const check_names[CHECKS] = {"made",   "mass",    "bound", "state",
                                                "normal", "outline", "place", "gaveup",
                                                "box",    "wall",    "world"};

typedef struct row {
    int64_t drawn, refused, pairs, states[4], unproved, flaws[CHECKS];
} row;

/* What is wrong, with what, how often, and the first pair. */
typedef struct flaw_count {
    const char *text;
    int curve, written, partner; /* partner: KINDS if none */
    int64_t count;
    uint64_t number;
} flaw_count;

/* One of so many pairs in a world; pairs from one pool; grains and other shapes of each kind in it;
   flaws that are told apart. Partners: the models of contact_cases.h up to Fourier series; for
   BEZIER a grain. */
enum {
    WORLDS = 8,
    BLOCK = 8192,
    GRAINS = 12,
    PARTNERS = 12,
    FLAWS = 512,
    PARTNER_KINDS = FOURIER + 1
};

typedef struct campaign {
    uint64_t series, number; /* the seed; the pair that is tried */
    int printed;             /* so many of a flaw are printed */
    int64_t failures;
    row rows[CURVES][WRITTEN];
    flaw_count flaws[FLAWS];
    grain grains[CURVES][GRAINS];
    model partners[PARTNER_KINDS][PARTNERS];
} campaign;

/* Counts a flaw; true for the first few of a kind, which are printed. */
static bool count_flaw(campaign *all, const grain *g, int check, int partner, const char *text) {
    flaw_count *f = all->flaws;
    all->failures++;
    all->rows[g->curve][g->written].flaws[check]++;
    while (f < &all->flaws[FLAWS - 1] && f->text != NULL &&
           (strcmp(f->text, text) != 0 || f->curve != g->curve || f->written != g->written ||
            f->partner != partner))
        f++;
    if (f->text == NULL) f->number = all->number;
    f->text = text, f->curve = g->curve, f->written = g->written, f->partner = partner;
    return ++f->count <= all->printed;
}

static void print_log(void *user, dem2d_result result, int index, const char *text) {
    (void)user;
    fprintf(stderr, "      %s (%d): %s\n", dem2d_result_text(result), index, text);
}

static void print_grain(const campaign *all, const grain *g, const char *text) {
    const dem2d_pose none = {{0, 0}, {1, 0}, 1};
    const dem2d_env env = {NULL, NULL, NULL, print_log};
    dem2d_shape *shape;
    fprintf(stderr, "\nFAIL  %s: %s, written as %s: %s (%s; kink %.3Lg)\n",
            g->m.shape == NULL ? "creation" : "measures", curve_names[g->curve],
            written_names[g->written], text, dem2d_result_text(g->result), g->kink);
    fprintf(stderr, "      fuzz_bezier 1 %llu %llu\n", (unsigned long long)all->series,
            (unsigned long long)all->number);
    print_model("grain", &g->m, &none);
    if (dem2d_shape_create_bezier(&env, g->m.points, g->m.count / 3, &shape) == DEM2D_OK)
        dem2d_shape_destroy(shape);
}

/* --- grains and partners --------------------------------------------------------------------- */

/* Draws until one is accepted. */
static void pool_grain(campaign *all, grain *g, int kind, uint64_t seed) {
    for (int i = 0; i < 20; i++) {
        grain_draw(g, kind, seed + (uint64_t)i * 0x632be59bd9b4e019u);
        row *r = &all->rows[g->curve][g->written];
        r->drawn++, r->refused += g->m.shape == NULL;
        const char *flaw = creation_flaw(g);
        if (flaw != NULL && count_flaw(all, g, CREATION, KINDS, flaw)) print_grain(all, g, flaw);
        if (g->m.shape == NULL) continue;
        flaw = measures_flaw(g);
        if (flaw != NULL && count_flaw(all, g, MEASURES, KINDS, flaw)) print_grain(all, g, flaw);
        return;
    }
}

static void pool_fill(campaign *all, uint64_t block) {
    uint64_t d = all->series * 0x9e3779b97f4a7c15u ^ block * 0xbf58476d1ce4e5b9u;
    for (int k = 0; k < CURVES; k++)
        for (int i = 0; i < GRAINS; i++) pool_grain(all, &all->grains[k][i], k, random_bits(&d));
    for (int k = 0; k < PARTNER_KINDS; k++)
        for (int i = 0; i < PARTNERS && k != BEZIER; i++) model_draw(&all->partners[k][i], k, &d);
}

static void pool_empty(campaign *all) {
    for (int k = 0; k < CURVES; k++)
        for (int i = 0; i < GRAINS; i++) dem2d_shape_destroy(all->grains[k][i].m.shape);
    for (int k = 0; k < PARTNER_KINDS; k++)
        for (int i = 0; i < PARTNERS && k != BEZIER; i++)
            dem2d_shape_destroy(all->partners[k][i].shape);
}

/* --- one pair -------------------------------------------------------------------------------- */

static void report(campaign *all, const grain *g, int check, const pair *p, const dem2d_contact *c,
                   const char *flaw) {
    if (flaw == NULL) return;
    if (!count_flaw(all, g, check,
                    p->b == NULL    ? KINDS
                    : p->b == &g->m ? p->a->kind
                                    : p->b->kind,
                    flaw))
        return;
    fprintf(stderr, "\nFAIL  %s: %s, written as %s: %s\n", check_names[check],
            curve_names[g->curve], written_names[g->written], flaw);
    fprintf(stderr, "      fuzz_bezier 1 %llu %llu\n", (unsigned long long)all->series,
            (unsigned long long)all->number);
    print_model("A", p->a, &p->pose_a);
    if (p->b != NULL) print_model("B", p->b, &p->pose_b);
    const truth t = find_truth(p);
    fprintf(stderr,
            "size %.17g; true depth %.21Lg (proved above %.21Lg), normal {%.21Lg, %.21Lg}\n",
            pair_size(p), t.depth, t.lower, t.u.x, t.u.y);
    if (c == NULL) return;
    print_answer("answer", c, p);
    fprintf(stderr, "    of the size: point_a below A's outline by %.3Lg",
            depth_in(p->a, &p->pose_a, c->point_a.x, c->point_a.y) / pair_size(p));
    if (p->b != NULL)
        fprintf(stderr, ", point_b below B's by %.3Lg",
                depth_in(p->b, &p->pose_b, c->point_b.x, c->point_b.y) / pair_size(p));
    fprintf(stderr, "\n");
}

/* How the pair is asked for: tolerance and first direction. */
static dem2d_contact_desc draw_desc(uint64_t *d) {
    static const double tolerances[] = {0, 0, 0, 1e-8, 1e-12, 1e-14};
    dem2d_contact_desc desc = {0};
    desc.tolerance = tolerances[random_below(d, 6)];
    if (random_below(d, 4) == 0) desc.start = spot_rounded(random_direction(d));
    return desc;
}

static void check_contact(campaign *all, const grain *g, const pair *p, real kink,
                          const dem2d_contact_desc *desc) {
    dem2d_contact c;
    if (dem2d_pair_contact(p->a->shape, p->pose_a, p->b->shape, p->pose_b, desc, &c) != DEM2D_OK)
        case_broken("a pair was refused");
    const double tolerance = desc->tolerance > 0 ? desc->tolerance : CASE_TOLERANCE;
    const truth t = find_truth(p);
    row *r = &all->rows[g->curve][g->written];
    r->pairs++, r->states[c.state & 3]++;
    r->unproved += !(t.depth - t.lower <= 1e-16L * pair_size(p));
    report(all, g, BOUND, p, &c, bound_flaw(p, &c, &t, tolerance, kink));
    report(all, g, STATE, p, &c, state_flaw(p, &c, &t));
    report(all, g, UNRESOLVED, p, &c, unresolved_flaw(p, &c, &t, tolerance));
    if (c.state == DEM2D_UNRESOLVED) return; /* bounds, and nothing else, are promised */
    report(all, g, OUTLINE, p, &c, outline_flaw(p, &c));
    const real value = pair_value(p, spot_unit(spot_from(c.normal)));
    report(all, g, NORMAL, p, &c, normal_flaw(p, &c, value, tolerance, depth_slack(p)));
    report(all, g, PLACE, p, &c, place_flaw(p, &c, tolerance));
}

static void check_wall(campaign *all, const grain *g, const pair *p, real kink, uint64_t *d) {
    const wall w = wall_draw(p, d);
    const pair half = {p->a, NULL, p->pose_a, {w.point, {1, 0}, 1}};
    dem2d_contact c;
    report(all, g, BOX, &half, NULL, box_flaw(p));
    if (dem2d_wall_contact(p->a->shape, p->pose_a, w.point, w.normal, &c) != DEM2D_OK)
        case_broken("a wall was refused");
    report(all, g, WALL, &half, &c, wall_flaw(p, &w, &c));
    if (random_below(d, WORLDS) == 0)
        report(all, g, WORLD, p, NULL, world_flaw(p, &w, random_scale(d, 0.1, 10), kink));
}

static void try_pair(campaign *all) {
    uint64_t d = all->series * 0x9e3779b97f4a7c15u ^ all->number * 0xd1342543de82ef95u;
    const int kind_a = (int)(all->number % CURVES),
              kind = (int)(all->number / CURVES % PARTNER_KINDS);
    const grain *g = &all->grains[kind_a][random_below(&d, GRAINS)];
    const grain *other = &all->grains[random_below(&d, CURVES)][random_below(&d, GRAINS)];
    const model *b = kind == BEZIER ? &other->m : &all->partners[kind][random_below(&d, PARTNERS)];
    const double size_b = kind == BEZIER ? other->size : 1;
    const dem2d_contact_desc desc = draw_desc(&d);
    if (g->m.shape == NULL || b->shape == NULL) return;
    pair p = pair_draw(&g->m, g->size, b, size_b, &d);
    const real kink = fmaxl(g->kink, kind == BEZIER ? other->kink : 0);
    check_wall(all, g, &p, kink, &d);
    if (random_below(&d, 2)) p = (pair){p.b, p.a, p.pose_b, p.pose_a};
    check_contact(all, g, &p, kink, &desc);
}

/* Tries `count` pairs from number `first` on. */
PART void campaign_run(campaign *all, uint64_t first, uint64_t count) {
    uint64_t block = 0;
    for (uint64_t i = 0; i < count; i++) {
        all->number = first + i;
        if (i == 0 || all->number / BLOCK != block) {
            if (i > 0) pool_empty(all);
            block = all->number / BLOCK;
            pool_fill(all, block);
        }
        try_pair(all);
    }
    if (count > 0) pool_empty(all);
}

#endif
