/* Outlines from pixels and their measures. What they should be comes from flood fills, brute force
   over all pairs, scan lines and closed forms that share no code with the header. */
#include "dem2d.h"

#include "testing.h"
#include "outline_oracle.h"

#define SIDE 24 /* pixels of a random picture */

/* --- pictures --------------------------------------------------------------------------------- */

typedef struct picture {
    uint8_t pixels[SIDE * SIDE];
    dem2d_image_desc desc;
} picture;

/* Ground of one grey value; every grain is found. */
static void picture_init(picture *p, int width, int height, uint8_t grey) {
    memset(p, 0, sizeof *p);
    memset(p->pixels, grey, sizeof p->pixels);
    p->desc.pixels = p->pixels;
    p->desc.width = width, p->desc.height = height;
    p->desc.min_pixels = 1, p->desc.scale = 1;
}

/* Rows of text: '#' is dark. */
static void picture_draw(picture *p, const char *const *rows, int height) {
    picture_init(p, (int)strlen(rows[0]), height, 255);
    for (int r = 0; r < height; r++)
        for (int c = 0; rows[r][c]; c++)
            if (rows[r][c] == '#') p->pixels[r * p->desc.width + c] = 0;
}

static dem2d_outline_set *outlines(const dem2d_image_desc *desc) {
    dem2d_outline_set *set = NULL;
    assert_ok(dem2d_image_outlines(NULL, desc, &set));
    return set;
}

static dem2d_outline outline_of(const dem2d_outline_set *set, int i) {
    dem2d_outline outline;
    assert_ok(dem2d_outline_set_get(set, i, &outline));
    return outline;
}

static void check_outline(const dem2d_outline_set *set, int i, int row, int column, int pixels) {
    const dem2d_outline outline = outline_of(set, i);
    assert_int_equal(outline.row, row);
    assert_int_equal(outline.column, column);
    assert_int_equal(outline.pixels, pixels);
}

static long double area_of(const dem2d_vec *p, int n) {
    long double sum = 0;
    for (int i = 0; i < n; i++) {
        const dem2d_vec a = p[i], b = p[(i + 1) % n];
        sum += ((long double)a.x * b.y - (long double)a.y * b.x) / 2;
    }
    return sum;
}

static long double turn_of(dem2d_vec a, dem2d_vec b, dem2d_vec c) {
    return ((long double)b.x - a.x) * ((long double)c.y - a.y) -
           ((long double)b.y - a.y) * ((long double)c.x - a.x);
}

static bool in_box(dem2d_vec p, dem2d_vec a, dem2d_vec b) {
    return p.x >= fmin(a.x, b.x) && p.x <= fmax(a.x, b.x) && p.y >= fmin(a.y, b.y) &&
           p.y <= fmax(a.y, b.y);
}

/* Do two closed segments share a point? */
static bool segments_meet(dem2d_vec a, dem2d_vec b, dem2d_vec c, dem2d_vec d) {
    const long double p = turn_of(a, b, c), q = turn_of(a, b, d);
    const long double r = turn_of(c, d, a), s = turn_of(c, d, b);
    if (((p < 0 && q > 0) || (p > 0 && q < 0)) && ((r < 0 && s > 0) || (r > 0 && s < 0)))
        return true;
    return (p == 0 && in_box(c, a, b)) || (q == 0 && in_box(d, a, b)) ||
           (r == 0 && in_box(a, c, d)) || (s == 0 && in_box(b, c, d));
}

/* No two sides meet but neighbours, and those in one point only; counter-clockwise. */
static void check_simple(const dem2d_vec *p, int n) {
    assert_true(n >= 4);
    assert_true(area_of(p, n) > 0);
    for (int i = 0; i < n; i++) {
        const dem2d_vec a = p[i], b = p[(i + 1) % n], next = p[(i + 2) % n];
        assert_true(a.x != b.x || a.y != b.y);
        if (turn_of(a, b, next) == 0)
            assert_true((b.x - a.x) * (next.x - b.x) + (b.y - a.y) * (next.y - b.y) > 0);
        for (int k = i + 2; k < n && !(i == 0 && k == n - 1); k++)
            assert_false(segments_meet(a, b, p[k], p[(k + 1) % n]));
    }
}

/* The definition, for every threshold. */
static int otsu(const uint8_t *pixels, int count) {
    long double best = -1;
    int first = 0, last = 0;
    for (int t = 1; t < 256; t++) {
        long long n[2] = {0, 0}, sum[2] = {0, 0};
        for (int i = 0; i < count; i++) n[pixels[i] >= t]++, sum[pixels[i] >= t] += pixels[i];
        if (n[0] == 0 || n[1] == 0) continue;
        const long double gap = (long double)sum[0] / n[0] - (long double)sum[1] / n[1];
        const long double variance = gap * gap * n[0] * n[1];
        if (variance > best * (1 + 1e-15L))
            best = variance, first = last = t;
        else if (fabsl(variance - best) <= 1e-15L * best && last == t - 1)
            last = t;
    }
    return best < 0 ? 0 : (first + last + 1) / 2;
}

static void thresholds(void **state) {
    (void)state;
    uint64_t random = 7;
    picture p;
    int threshold;
    for (int run = 0; run < 60; run++) {
        const int levels = 2 + random_below(&random, 40);
        picture_init(&p, SIDE, SIDE, 0);
        for (int i = 0; i < SIDE * SIDE; i++)
            p.pixels[i] = (uint8_t)(random_below(&random, levels) * 6 + (i % 3 ? 0 : 9));
        assert_ok(dem2d_image_threshold(&p.desc, &threshold));
        assert_int_equal(threshold, otsu(p.pixels, SIDE * SIDE));
    }
    picture_init(&p, 4, 1, 255);
    p.pixels[1] = 0;
    assert_ok(dem2d_image_threshold(&p.desc, &threshold));
    assert_int_equal(threshold, 128);            /* the middle of all that part 0 from 255 */
    for (int grey = 0; grey < 256; grey += 51) { /* one grey value: 0, and no grain */
        picture_init(&p, 6, 5, (uint8_t)grey);
        assert_ok(dem2d_image_threshold(&p.desc, &threshold));
        assert_int_equal(threshold, 0);
        p.desc.keep_border = true;
        for (int bright = 0; bright < 2; bright++) {
            p.desc.bright = bright;
            dem2d_outline_set *set = outlines(&p.desc);
            assert_int_equal(dem2d_outline_set_count(set), 0);
            dem2d_outline_set_destroy(set);
        }
    }
}

static void small_pictures(void **state) {
    (void)state;
    static const char *const dot[] = {"...", ".#.", "..."};
    static const char *const diagonal[] = {"....", ".#..", "..#.", "...."};
    static const char *const nested[] = {".........", ".#######.", ".#.....#.",
                                         ".#.###.#.", ".#.#.#.#.", ".#.###.#.",
                                         ".#.....#.", ".#######.", "........."};
    static const char *const leaky[] = {"......", ".###..", ".#.#..", ".##...", "......"};
    picture p;
    picture_draw(&p, dot, 3);
    dem2d_outline_set *set = outlines(&p.desc);
    assert_int_equal(dem2d_outline_set_count(set), 1);
    const dem2d_outline one = outline_of(set, 0);
    const dem2d_vec diamond[4] = {{1, 1.5}, {1.5, 1}, {2, 1.5}, {1.5, 2}};
    assert_int_equal(one.count, 4);
    assert_memory_equal(one.points, diamond, sizeof diamond); /* binary: halfway, exactly */
    dem2d_outline_set_destroy(set);
    picture_draw(&p, diagonal, 4);
    set = outlines(&p.desc);
    assert_int_equal(dem2d_outline_set_count(set), 2);
    check_outline(set, 0, 1, 1, 1);
    check_outline(set, 1, 2, 2, 1);
    dem2d_outline_set_destroy(set);
    picture_draw(&p, nested, 9); /* a grain in a hole of a grain is filled with the hole */
    set = outlines(&p.desc);
    assert_int_equal(dem2d_outline_set_count(set), 1);
    check_outline(set, 0, 1, 1, 49);
    assert_near(area_of(outline_of(set, 0).points, outline_of(set, 0).count), 49 - 0.5, 1e-15L);
    dem2d_outline_set_destroy(set);
    picture_draw(&p, leaky, 5); /* the hole touches the outside by a corner: it is none */
    set = outlines(&p.desc);
    assert_int_equal(dem2d_outline_set_count(set), 1);
    check_outline(set, 0, 1, 1, 7);
    check_simple(outline_of(set, 0).points, outline_of(set, 0).count);
    dem2d_outline_set_destroy(set);
    picture_init(&p, 5, 3, 9); /* grain from border to border: its sides are the picture's */
    p.desc.threshold = 10;
    set = outlines(&p.desc);
    assert_int_equal(dem2d_outline_set_count(set), 0);
    dem2d_outline_set_destroy(set);
    p.desc.keep_border = true, p.desc.scale = 0.5;
    set = outlines(&p.desc);
    assert_int_equal(dem2d_outline_set_count(set), 1);
    check_outline(set, 0, 0, 0, 15);
    assert_near(area_of(outline_of(set, 0).points, outline_of(set, 0).count), (15 - 0.5) / 4,
                1e-15L);
    dem2d_outline_set_destroy(set);
}

/* Filled grains by relaxation: outside spreads over ground in 8 directions, then labels over the
   rest in 4. label[] gets the index of the first pixel, or -1. */
static void relax(const picture *p, int *label) {
    const int w = p->desc.width, h = p->desc.height;
    static bool outside[SIDE + 2][SIDE + 2];
    memset(outside, 0, sizeof outside);
    for (int r = 0; r < h + 2; r++)
        for (int c = 0; c < w + 2; c++)
            outside[r][c] = r == 0 || c == 0 || r == h + 1 || c == w + 1;
    for (bool moved = true; moved;) {
        moved = false;
        for (int r = 1; r <= h; r++)
            for (int c = 1; c <= w; c++) {
                const bool dark = p->pixels[(r - 1) * w + c - 1] < p->desc.threshold;
                if (outside[r][c] || dark != p->desc.bright) continue;
                for (int k = 0; k < 9; k++)
                    if (outside[r - 1 + k / 3][c - 1 + k % 3]) outside[r][c] = moved = true;
            }
    }
    for (int i = 0; i < w * h; i++) label[i] = outside[i / w + 1][i % w + 1] ? -1 : i;
    for (bool moved = true; moved;) {
        moved = false;
        for (int i = 0; i < w * h; i++) {
            const int next[4] = {i % w > 0 ? i - 1 : i, i % w < w - 1 ? i + 1 : i,
                                 i >= w ? i - w : i, i + w < w * h ? i + w : i};
            for (int k = 0; k < 4 && label[i] >= 0; k++)
                if (label[next[k]] >= 0 && label[next[k]] < label[i])
                    label[i] = label[next[k]], moved = true;
        }
    }
}

/* The dark pixels connected with one become ground; how many they were. */
static int erase(picture *p, int from) {
    const int w = p->desc.width, h = p->desc.height;
    static bool reached[SIDE * SIDE];
    int count = 0;
    memset(reached, 0, sizeof reached);
    reached[from] = true;
    for (bool moved = true; moved;) {
        moved = false;
        for (int i = 0; i < w * h; i++) {
            const bool dark = p->pixels[i] < p->desc.threshold;
            if (reached[i] || dark == p->desc.bright) continue;
            if ((i % w > 0 && reached[i - 1]) || (i % w < w - 1 && reached[i + 1]) ||
                (i >= w && reached[i - w]) || (i + w < w * h && reached[i + w]))
                reached[i] = moved = true;
        }
    }
    for (int i = 0; i < w * h; i++)
        if (reached[i]) p->pixels[i] = p->desc.bright ? 0 : 255, count++;
    return count;
}

/* Whether the filled grain of a label is to be dropped so that others come to light. `rest` is the
   picture without its own pixels, `own` of them. */
static bool is_dropped(const picture *p, const picture *rest, const int *label, int of, int own) {
    const int w = p->desc.width, h = p->desc.height;
    int filled = 0, inside = 0, left = w, right = 0, bottom = 0;
    bool border = false;
    for (int i = 0; i < w * h; i++) {
        if (label[i] != of) continue;
        filled++;
        left = i % w < left ? i % w : left, right = i % w > right ? i % w : right, bottom = i / w;
        border = border || i % w == 0 || i % w == w - 1 || i < w || i >= w * (h - 1);
    }
    const int box = (right - left + 1) * (bottom - of / w + 1);
    for (int i = 0; i < w * h; i++)
        if (i % w >= left && i % w <= right && i / w >= of / w && i / w <= bottom)
            inside += (rest->pixels[i] < p->desc.threshold) != p->desc.bright;
    if (border && !p->desc.keep_border) return true;
    if (p->desc.max_pixels && filled > p->desc.max_pixels) return true;
    const int least = p->desc.min_pixels ? p->desc.min_pixels : 16;
    return 4 * filled > w * h && 10 * filled > 9 * box && 4 * own < filled && inside >= least;
}

/* Erases what is to be dropped, from outside inwards, until nothing is. Where boxes overlap, what
   is inside must not depend on which goes first: only frames look, and they are alone. */
static void relax_dropped(picture *p, int *label) {
    const int n = p->desc.width * p->desc.height;
    for (bool dropped = true; dropped;) {
        dropped = false;
        relax(p, label);
        for (int i = 0; i < n && !dropped; i++) {
            if (label[i] != i) continue;
            picture rest = *p;
            const int own = erase(&rest, i);
            if (!is_dropped(p, &rest, label, i, own)) continue;
            memcpy(p->pixels, rest.pixels, sizeof p->pixels);
            dropped = true;
        }
    }
}

/* The set against labels: who is there, in which order, with how many pixels. */
static void check_against_labels(const picture *original, const dem2d_outline_set *set) {
    picture copy = *original, *p = &copy;
    const int w = p->desc.width, h = p->desc.height;
    int label[SIDE * SIDE], found = 0;
    relax_dropped(p, label);
    for (int i = 0; i < w * h; i++) {
        if (label[i] != i) continue;
        int pixels = 0;
        for (int k = 0; k < w * h; k++) pixels += label[k] == i;
        if (pixels < (p->desc.min_pixels ? p->desc.min_pixels : 16)) continue;
        assert_true(found < dem2d_outline_set_count(set));
        check_outline(set, found, i / w, i % w, pixels);
        const dem2d_outline outline = outline_of(set, found++);
        check_simple(outline.points, outline.count);
    }
    assert_int_equal(found, dem2d_outline_set_count(set));
}

/* Each point is between two pixel centres beside each other, where the grey value interpolated
   between them is threshold - 1/2; or on the picture's border. */
static void check_places(const picture *p, const dem2d_outline *outline) {
    const int w = p->desc.width, h = p->desc.height;
    for (int i = 0; i < outline->count; i++) {
        const double x = outline->points[i].x / p->desc.scale - 0.5;
        const double y = h - outline->points[i].y / p->desc.scale - 0.5;
        const bool level = fabs(y - round(y)) < 1e-9; /* else x is whole */
        const double along = level ? x : y, across = round(level ? y : x);
        const int low = (int)floor(along), size = level ? w : h;
        assert_true(level || fabs(x - round(x)) < 1e-9);
        if (low < 0 || low + 1 >= size) {
            assert_within(along, low < 0 ? -0.5 : size - 0.5, 1e-9);
            continue;
        }
        const int step = level ? 1 : w, at = level ? (int)across * w + low : low * w + (int)across;
        const double a = p->pixels[at], b = p->pixels[at + step];
        assert_within(a + (along - low) * (b - a), p->desc.threshold - 0.5, 1e-7);
    }
}

static void random_pictures(void **state) {
    (void)state;
    uint64_t random = 11;
    for (int run = 0; run < 400; run++) {
        picture p, inverse;
        const int w = 1 + random_below(&random, SIDE), h = 1 + random_below(&random, SIDE);
        const int part = 1 + random_below(&random, 9), greys = run % 3 ? 2 : 256;
        picture_init(&p, w, h, 0);
        p.desc.threshold = 128, p.desc.bright = run % 2, p.desc.keep_border = run % 4 < 2;
        p.desc.min_pixels = run % 5, p.desc.max_pixels = run % 3 ? 0 : 1 + run / 20;
        p.desc.scale = random_between(&random, 0.1, 3);
        for (int i = 0; i < w * h; i++) {
            const int grey = random_below(&random, greys) * (255 / (greys - 1));
            p.pixels[i] = (uint8_t)(random_below(&random, 10) < part ? grey : 255);
        }
        dem2d_outline_set *set = outlines(&p.desc), *turned;
        check_against_labels(&p, set);
        inverse = p; /* the same grains, bright for dark, in rows with a gap */
        uint8_t wide[SIDE * (SIDE + 5)];
        memset(wide, 77, sizeof wide);
        for (int i = 0; i < w * h; i++) wide[i / w * (w + 5) + i % w] = (uint8_t)~p.pixels[i];
        inverse.desc.pixels = wide, inverse.desc.stride = w + 5;
        inverse.desc.threshold = 256 - p.desc.threshold, inverse.desc.bright = !p.desc.bright;
        turned = outlines(&inverse.desc);
        assert_int_equal(dem2d_outline_set_count(turned), dem2d_outline_set_count(set));
        for (int i = 0; i < dem2d_outline_set_count(set); i++) {
            const dem2d_outline a = outline_of(set, i), b = outline_of(turned, i);
            check_places(&p, &a);
            assert_int_equal(a.count, b.count);
            assert_memory_equal(a.points, b.points, (size_t)a.count * sizeof(dem2d_vec));
        }
        dem2d_outline_set_destroy(turned);
        dem2d_outline_set_destroy(set);
    }
}

/* --- frames, regions, depths, labels ---------------------------------------------------------- */

#define WIDE 120
#define HIGH 90

/* A sheet of ground with three grains: discs of radius 8 or so, edges of one pixel's width. */
typedef struct sheet {
    uint8_t pixels[WIDE * HIGH];
    dem2d_image_desc desc;
} sheet;

static void sheet_init(sheet *s, uint8_t ground, uint8_t grain) {
    static const double place[3][3] = {{30.3, 28.1, 8.2}, {77.6, 33.4, 10.1}, {51.2, 63.7, 9.4}};
    memset(s, 0, sizeof *s);
    for (int i = 0; i < WIDE * HIGH; i++) {
        double part = 0; /* of the pixel that a grain covers, nearly */
        for (int k = 0; k < 3; k++) {
            const double x = i % WIDE + 0.5, y = i / WIDE + 0.5;
            part = fmax(part, place[k][2] + 0.5 - hypot(x - place[k][0], y - place[k][1]));
        }
        s->pixels[i] = (uint8_t)lround(ground + fmin(part, 1) * (grain - ground));
    }
    s->desc.pixels = s->pixels, s->desc.scale = 1;
    s->desc.width = WIDE, s->desc.height = HIGH;
}

/* A frame of a thickness, so far from the border; the last `open` of its columns are left open at
   the lower side. */
static void sheet_frame(sheet *s, uint8_t grey, int margin, int thick, int open) {
    for (int r = margin; r < HIGH - margin; r++)
        for (int c = margin; c < WIDE - margin; c++) {
            const bool inside = r >= margin + thick && r < HIGH - margin - thick &&
                                c >= margin + thick && c < WIDE - margin - thick;
            const bool gap = r >= HIGH - margin - thick && c >= WIDE - margin - thick - open &&
                             c < WIDE - margin - thick;
            if (!inside && !gap) s->pixels[r * WIDE + c] = grey;
        }
}

static void sheet_bar(sheet *s, uint8_t grey, int row, int column, int length) {
    for (int r = row; r < row + 3; r++) memset(s->pixels + r * WIDE + column, grey, (size_t)length);
}

/* The outlines of two sets, the same bits. */
static void check_same_outlines(const dem2d_outline_set *set, const dem2d_outline_set *other) {
    assert_int_equal(dem2d_outline_set_count(set), dem2d_outline_set_count(other));
    for (int i = 0; i < dem2d_outline_set_count(set); i++) {
        const dem2d_outline a = outline_of(set, i), b = outline_of(other, i);
        assert_int_equal(a.row, b.row);
        assert_int_equal(a.column, b.column);
        assert_int_equal(a.pixels, b.pixels);
        assert_int_equal(a.count, b.count);
        assert_memory_equal(a.points, b.points, (size_t)a.count * sizeof(dem2d_vec));
    }
}

/* What a picture gives is what another gives, and the log has so many messages, the last one with
   a word. Releases the set. */
static void check_sheet(const dem2d_image_desc *desc, const dem2d_outline_set *expected,
                        int messages, const char *word) {
    test_env env;
    dem2d_outline_set *set;
    test_env_init(&env);
    assert_ok(dem2d_image_outlines(&env.env, desc, &set));
    check_same_outlines(set, expected);
    assert_int_equal(env.log.count, messages);
    if (messages > 0) {
        assert_result(env.log.result, DEM2D_WARNING);
        assert_non_null(strstr(env.log.text, word));
    }
    dem2d_outline_set_destroy(set);
    assert_clean(&env);
}

/* Whatever is drawn around them, the grains are found, as without it. */
static void frames(void **state) {
    (void)state;
    static const struct {
        int margin, thick, open, second,
            warnings; /* second: margin of another frame inside, or 0 */
    } drawn[] = {{0, 1, 0, 0, 1},  {0, 5, 0, 0, 1}, {0, 2, 60, 0, 0},
                 {0, 2, 0, 6, 1},  {0, 1, 0, 2, 1}, {3, 1, 0, 0, 1},
                 {1, 3, 0, 10, 1}, {0, 1, 1, 5, 1}, {0, 3, 110, 0, 0}};
    for (int bright = 0; bright < 2; bright++)
        for (int i = 0; i < COUNT_OF(drawn); i++) {
            const uint8_t ground = bright ? 60 : 200, grain = bright ? 230 : 30;
            sheet s, framed;
            sheet_init(&s, ground, grain);
            s.desc.threshold = 128, s.desc.bright = bright;
            framed = s;
            framed.desc.pixels = framed.pixels;
            sheet_frame(&framed, grain, drawn[i].margin, drawn[i].thick, drawn[i].open);
            if (drawn[i].second) sheet_frame(&framed, grain, drawn[i].second, 1, 0);
            dem2d_outline_set *set = outlines(&s.desc);
            assert_int_equal(dem2d_outline_set_count(set), 3);
            check_sheet(&framed.desc, set, drawn[i].warnings, "frame");
            framed.desc.keep_border = true; /* which keeps grains, not frames */
            if (drawn[i].open == 0) check_sheet(&framed.desc, set, 1, "frame");
            framed.desc.keep_border = false;
            sheet_bar(&framed, grain, drawn[i].margin + 4, drawn[i].margin, 30);
            if (!drawn[i].second) /* a scale bar at the frame */
                check_sheet(&framed.desc, set, drawn[i].warnings, "frame");
            dem2d_outline_set_destroy(set);
        }
    sheet s; /* a hollow box with nothing inside is a grain, as any grain with a hole */
    sheet_init(&s, 200, 200);
    s.desc.threshold = 128;
    sheet_frame(&s, 30, 5, 2, 0);
    dem2d_outline_set *set = outlines(&s.desc);
    assert_int_equal(dem2d_outline_set_count(set), 1);
    check_outline(set, 0, 5, 5, (WIDE - 10) * (HIGH - 10));
    dem2d_outline_set_destroy(set);
    sheet_frame(&s, 30, 0, 90, 0); /* all dark: it touches the border, and the log says so */
    set = outlines(&s.desc);
    check_sheet(&s.desc, set, 1, "1 touch the border");
    dem2d_outline_set_destroy(set);
}

/* A white frame around grey ground: Otsu parts the frame from the rest. */
static void light_frame(void **state) {
    (void)state;
    sheet s, framed;
    sheet_init(&s, 140, 90);
    for (int thick = 4; thick <= 16; thick += 4) {
        int plain = 0, misled = 0, right = 0;
        framed = s;
        framed.desc.pixels = framed.pixels;
        sheet_frame(&framed, 255, 0, thick, 0);
        framed.desc.crop_left = framed.desc.crop_top = thick;
        framed.desc.crop_width = WIDE - 2 * thick, framed.desc.crop_height = HIGH - 2 * thick;
        assert_ok(dem2d_image_threshold(&framed.desc, &plain));
        framed.desc.crop_left = framed.desc.crop_top = 0;
        framed.desc.crop_width = framed.desc.crop_height = 0;
        assert_ok(dem2d_image_threshold(&framed.desc, &misled));
        assert_between(misled, 141, 255);
        test_env env;
        dem2d_outline_set *set;
        test_env_init(&env);
        assert_ok(dem2d_image_outlines(&env.env, &framed.desc, &set));
        assert_int_equal(dem2d_outline_set_count(set), 1); /* the ground */
        assert_logged(&env, DEM2D_WARNING, 0, "ignore_frame");
        dem2d_outline_set_destroy(set);
        framed.desc.ignore_frame = true;
        assert_ok(dem2d_image_threshold(&framed.desc, &right));
        assert_int_equal(right, plain);
        s.desc.threshold = plain;
        set = outlines(&s.desc);
        assert_int_equal(dem2d_outline_set_count(set), 3);
        check_sheet(&framed.desc, set, 0, NULL);
        dem2d_outline_set_destroy(set);
        s.desc.threshold = 0;
    }
    /* without a frame the option does little harm; with nothing but one grey value, none */
    s.desc.ignore_frame = true;
    dem2d_outline_set *set = outlines(&s.desc);
    assert_int_equal(dem2d_outline_set_count(set), 3);
    dem2d_outline_set_destroy(set);
    sheet_init(&s, 77, 77);
    int threshold = 5;
    s.desc.ignore_frame = true;
    assert_ok(dem2d_image_threshold(&s.desc, &threshold));
    assert_int_equal(threshold, 0);
}

/* A region is a picture of its own, in the place it has in the whole. */
static void crops(void **state) {
    (void)state;
    uint64_t random = 5;
    sheet s;
    sheet_init(&s, 200, 30);
    for (int i = 0; i < WIDE * HIGH; i++) s.pixels[i] ^= (uint8_t)random_below(&random, 16);
    for (int run = 0; run < 100; run++) {
        const int left = random_below(&random, WIDE), top = random_below(&random, HIGH);
        const int width = 1 + random_below(&random, WIDE - left);
        const int height = 1 + random_below(&random, HIGH - top);
        dem2d_image_desc crop = s.desc, cut = s.desc;
        crop.min_pixels = cut.min_pixels = 1;
        crop.keep_border = cut.keep_border = run % 2;
        crop.crop_left = left, crop.crop_top = top;
        crop.crop_width = width == WIDE - left ? 0 : width;
        crop.crop_height = height == HIGH - top ? 0 : height;
        cut.pixels += top * WIDE + left, cut.stride = WIDE, cut.width = width, cut.height = height;
        dem2d_outline_set *set = outlines(&crop), *other = outlines(&cut);
        assert_int_equal(dem2d_outline_set_count(set), dem2d_outline_set_count(other));
        for (int i = 0; i < dem2d_outline_set_count(set); i++) {
            const dem2d_outline a = outline_of(set, i), b = outline_of(other, i);
            assert_int_equal(a.row, b.row + top);
            assert_int_equal(a.column, b.column + left);
            assert_int_equal(a.count, b.count);
            for (int k = 0; k < a.count; k++) {
                assert_within(a.points[k].x, b.points[k].x + left, 1e-12);
                assert_within(a.points[k].y, b.points[k].y + HIGH - top - height, 1e-12);
            }
        }
        dem2d_outline_set_destroy(set);
        dem2d_outline_set_destroy(other);
    }
}

/* Values of two bytes: any range of them will do, none is lost. */
static void two_bytes(void **state) {
    (void)state;
    static uint16_t deep[WIDE * HIGH];
    sheet s;
    sheet_init(&s, 200, 30);
    dem2d_outline_set *set = outlines(&s.desc);
    for (int times = 1; times <= 257; times *= times == 16 ? 257 : 2) { /* 16: of 12 bits */
        dem2d_image_desc desc = s.desc;
        int threshold, of_two;
        for (int i = 0; i < WIDE * HIGH; i++)
            deep[i] = (uint16_t)(s.pixels[i] * (times % 257 ? times : 257));
        desc.pixels = NULL, desc.pixels16 = deep;
        assert_ok(dem2d_image_threshold(&s.desc, &threshold));
        assert_ok(dem2d_image_threshold(&desc, &of_two));
        assert_between(of_two, times * (threshold - 1), times * (threshold + 1));
        dem2d_outline_set *other = outlines(&desc);
        assert_int_equal(dem2d_outline_set_count(other), 3);
        for (int i = 0; i < 3; i++) {
            dem2d_outline_info a, b;
            const dem2d_outline one = outline_of(set, i), two = outline_of(other, i);
            assert_int_equal(one.pixels, two.pixels);
            assert_ok(dem2d_outline_measure(NULL, one.points, one.count, &a));
            assert_ok(dem2d_outline_measure(NULL, two.points, two.count, &b));
            assert_near(b.mass.area, a.mass.area, 0.002L); /* half a grey value of 170 */
            assert_near(b.roundness, a.roundness, 0.01L);
        }
        dem2d_outline_set_destroy(other);
    }
    dem2d_outline_set_destroy(set);
    test_env env;
    test_env_init(&env);
    dem2d_image_desc desc = s.desc;
    desc.pixels16 = deep;
    assert_result(dem2d_image_outlines(&env.env, &desc, &set), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "pixels16");
    desc.pixels = NULL, desc.threshold = 65536;
    assert_result(dem2d_image_outlines(&env.env, &desc, &set), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "threshold");
    desc.threshold = 65535;
    assert_ok(dem2d_image_outlines(&env.env, &desc, &set));
    dem2d_outline_set_destroy(set);
    desc.ignore_frame = true;
    assert_result(dem2d_image_outlines(&env.env, &desc, &set), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "ignore_frame");
}

static void label_masks(void **state) {
    (void)state;
    /* 2 and 7 touch; 5 lies in a hole of 2, 9 in two places; 3 touches the border */
    static const char *const rows[] = {"................", ".2222777...9..33", ".2002777...9..33",
                                       ".2052777........", ".2002777...99...", ".2222777...99...",
                                       "................"};
    static const int expected[][3] = {{1, 1, 20}, {1, 5, 15}, {1, 11, 2}, {3, 3, 1}, {4, 11, 4}};
    picture p;
    uint16_t deep[SIDE * SIDE];
    test_env env;
    dem2d_outline_set *set;
    picture_init(&p, 16, 7, 0);
    for (int i = 0; i < 16 * 7; i++) {
        const char label = rows[i / 16][i % 16];
        p.pixels[i] = (uint8_t)(label == '.' ? 0 : label - '0');
        deep[i] = (uint16_t)(p.pixels[i] * 7001);
    }
    p.desc.labels = true;
    for (int bytes = 1; bytes <= 2; bytes++) {
        if (bytes == 2) p.desc.pixels = NULL, p.desc.pixels16 = deep;
        test_env_init(&env);
        assert_ok(dem2d_image_outlines(&env.env, &p.desc, &set));
        assert_int_equal(dem2d_outline_set_count(set), COUNT_OF(expected));
        for (int i = 0; i < COUNT_OF(expected); i++) {
            check_outline(set, i, expected[i][0], expected[i][1], expected[i][2]);
            check_simple(outline_of(set, i).points, outline_of(set, i).count);
        }
        assert_int_equal(env.log.count, 1);
        assert_logged(&env, DEM2D_WARNING, -1, bytes == 1 ? "the first 9" : "the first 63009");
        dem2d_outline_set_destroy(set);
        assert_clean(&env);
    }
    int threshold = 3;
    assert_result(dem2d_image_threshold(&p.desc, &threshold), DEM2D_OUT_OF_RANGE);
    assert_int_equal(threshold, 3);
    for (int i = 0; i < 3; i++) {
        dem2d_image_desc bad = p.desc;
        if (i == 0) bad.threshold = 1;
        if (i == 1) bad.ignore_frame = true;
        if (i == 2) bad.bright = true;
        test_env_init(&env);
        assert_result(dem2d_image_outlines(&env.env, &bad, &set), DEM2D_OUT_OF_RANGE);
        assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "labels");
    }
}

/* Every connected piece of a label has the outline that it has alone in a binary picture. */
static void random_labels(void **state) {
    (void)state;
    uint64_t random = 23;
    for (int run = 0; run < 100; run++) {
        const int w = 1 + random_below(&random, SIDE), h = 1 + random_below(&random, SIDE);
        const int kinds = 1 + random_below(&random, 4);
        picture p, alone;
        int found = 0;
        picture_init(&p, w, h, 0);
        for (int i = 0; i < w * h; i++) p.pixels[i] = (uint8_t)random_below(&random, kinds + 1);
        p.desc.labels = p.desc.keep_border = true;
        dem2d_outline_set *set = outlines(&p.desc);
        picture rest = p;
        rest.desc.labels = false, rest.desc.threshold = 1;
        for (int i = 0; i < w * h; i++) {
            if (rest.pixels[i] == 0) continue;
            picture_init(&alone, w, h, 255);
            for (int k = 0; k < w * h; k++)
                alone.pixels[k] = rest.pixels[k] == rest.pixels[i] ? 1 : 255;
            alone.desc.threshold = 128;
            picture without = alone;
            (void)erase(&without, i);
            for (int k = 0; k < w * h; k++) {
                const bool own = alone.pixels[k] == 1 && without.pixels[k] == 255;
                if (own) rest.pixels[k] = 0;
                alone.pixels[k] = own ? 0 : 255;
            }
            alone.desc.keep_border = true;
            dem2d_outline_set *one = outlines(&alone.desc);
            assert_int_equal(dem2d_outline_set_count(one), 1);
            assert_true(found < dem2d_outline_set_count(set));
            const dem2d_outline a = outline_of(set, found++), b = outline_of(one, 0);
            check_outline(set, found - 1, i / w, i % w, b.pixels);
            assert_int_equal(a.count, b.count);
            assert_memory_equal(a.points, b.points, (size_t)a.count * sizeof(dem2d_vec));
            dem2d_outline_set_destroy(one);
        }
        assert_int_equal(found, dem2d_outline_set_count(set));
        dem2d_outline_set_destroy(set);
    }
}

/* A disc whose edge pixels are grey by the part they are covered: far better than a pixel. */
static void disc_in_grey(void **state) {
    (void)state;
    picture p;
    const double cx = 11.37, cy = 12.81, radius = 8.3;
    picture_init(&p, SIDE, SIDE, 200);
    for (int i = 0; i < SIDE * SIDE; i++) {
        int inside = 0;
        for (int k = 0; k < 400; k++) {
            const double x = i % SIDE + (k % 20 + 0.5) / 20, y = i / SIDE + (k / 20 + 0.5) / 20;
            inside += hypot(x - cx, y - (SIDE - cy)) < radius;
        }
        p.pixels[i] = (uint8_t)(200 - 180 * inside / 400);
    }
    p.desc.threshold = 111; /* halfway from 20 to 200 is 110 */
    dem2d_outline_set *set = outlines(&p.desc);
    assert_int_equal(dem2d_outline_set_count(set), 1);
    const dem2d_outline outline = outline_of(set, 0);
    dem2d_outline_info info;
    assert_ok(dem2d_outline_measure(NULL, outline.points, outline.count, &info));
    assert_near(info.mass.area, TEST_PI * radius * radius, 0.005L);
    assert_within(info.mass.centroid.x, cx, 0.01);
    assert_within(info.mass.centroid.y, cy, 0.01);
    assert_within(info.inscribed, radius, 0.1);
    assert_within(info.circumscribed, radius, 0.1);
    dem2d_outline_set_destroy(set);
}

static void picture_errors(void **state) {
    (void)state;
    static const struct {
        int width, height, stride, threshold, least, most;
        double scale;
        dem2d_result result;
        const char *word;
    } bad[] = {{0, 4, 0, 0, 0, 0, 1, DEM2D_OUT_OF_RANGE, "width"},
               {32769, 4, 0, 0, 0, 0, 1, DEM2D_OUT_OF_RANGE, "width"},
               {4, -1, 0, 0, 0, 0, 1, DEM2D_OUT_OF_RANGE, "height"},
               {4, 32769, 0, 0, 0, 0, 1, DEM2D_OUT_OF_RANGE, "height"},
               {4, 4, 3, 0, 0, 0, 1, DEM2D_OUT_OF_RANGE, "stride"},
               {4, 4, 0, -1, 0, 0, 1, DEM2D_OUT_OF_RANGE, "threshold"},
               {4, 4, 0, 256, 0, 0, 1, DEM2D_OUT_OF_RANGE, "threshold"},
               {4, 4, 0, 0, -1, 0, 1, DEM2D_OUT_OF_RANGE, "min_pixels"},
               {4, 4, 0, 0, 0, -1, 1, DEM2D_OUT_OF_RANGE, "max_pixels"},
               {4, 4, 0, 0, 0, 0, 0, DEM2D_OUT_OF_RANGE, "scale"},
               {4, 4, 0, 0, 0, 0, NAN, DEM2D_NOT_FINITE, "scale"}};
    picture p;
    test_env env;
    dem2d_outline_set *set = NULL;
    dem2d_outline outline;
    int threshold = -3;
    test_env_init(&env);
    for (int i = 0; i < COUNT_OF(bad); i++) {
        picture_init(&p, bad[i].width, bad[i].height, 0);
        p.desc.stride = bad[i].stride, p.desc.threshold = bad[i].threshold;
        p.desc.min_pixels = bad[i].least, p.desc.max_pixels = bad[i].most;
        p.desc.scale = bad[i].scale;
        assert_result(dem2d_image_outlines(&env.env, &p.desc, &set), bad[i].result);
        assert_logged(&env, bad[i].result, -1, bad[i].word);
        assert_null(set);
        if (i < 5) assert_result(dem2d_image_threshold(&p.desc, &threshold), DEM2D_OUT_OF_RANGE);
    }
    picture_init(&p, 4, 4, 0);
    assert_result(dem2d_image_outlines(NULL, NULL, &set), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_image_outlines(NULL, &p.desc, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_image_threshold(&p.desc, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_image_threshold(NULL, &threshold), DEM2D_NULL_ARGUMENT);
    p.desc.pixels = NULL;
    assert_result(dem2d_image_outlines(NULL, &p.desc, &set), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_image_threshold(&p.desc, &threshold), DEM2D_NULL_ARGUMENT);
    assert_int_equal(threshold, -3);
    assert_int_equal(dem2d_outline_set_count(NULL), 0);
    assert_result(dem2d_outline_set_get(NULL, 0, &outline), DEM2D_NULL_ARGUMENT);
    dem2d_outline_set_destroy(NULL);
    p.desc.pixels = p.pixels, p.desc.threshold = 1, p.desc.keep_border = true;
    assert_ok(dem2d_image_outlines(&env.env, &p.desc, &set));
    assert_result(dem2d_outline_set_get(set, 1, &outline), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_outline_set_get(set, -1, &outline), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_outline_set_get(set, 0, NULL), DEM2D_NULL_ARGUMENT);
    dem2d_outline_set_destroy(set);
    assert_clean(&env);
}

/* --- measures --------------------------------------------------------------------------------- */

/* A star-shaped outline, concave as a rule. */
static int star(uint64_t *random, int n, double depth, dem2d_vec centre, dem2d_vec *p) {
    for (int i = 0; i < n; i++) {
        const double r = random_between(random, 1 - depth, 1);
        const dem2d_vec u = direction(6.283185307179586 * (i + random_between(random, 0, 0.8)) / n);
        p[i] = vec(centre.x + 2 * r * u.x, centre.y + r * u.y);
    }
    return n;
}

static void turn_round(dem2d_vec *p, int n) {
    for (int i = 0; i < n / 2; i++) {
        const dem2d_vec q = p[i];
        p[i] = p[n - 1 - i], p[n - 1 - i] = q;
    }
}

static double side_distance(dem2d_vec p, dem2d_vec a, dem2d_vec b) {
    const double ex = b.x - a.x, ey = b.y - a.y, square = ex * ex + ey * ey;
    double t = square > 0 ? ((p.x - a.x) * ex + (p.y - a.y) * ey) / square : 0;
    t = fmin(fmax(t, 0), 1);
    return hypot(p.x - a.x - t * ex, p.y - a.y - t * ey);
}

/* Distance from the boundary, negative outside. */
static double depth_at(dem2d_vec c, const dem2d_vec *p, int n) {
    double least = HUGE_VAL;
    bool inside = false;
    for (int i = 0; i < n; i++) {
        const dem2d_vec a = p[i], b = p[(i + 1) % n];
        least = fmin(least, side_distance(c, a, b));
        if ((a.y <= c.y) != (b.y <= c.y) && c.x < a.x + (c.y - a.y) / (b.y - a.y) * (b.x - a.x))
            inside = !inside;
    }
    return inside ? least : -least;
}

static void measures_of_stars(void **state) {
    (void)state;
    uint64_t random = 13;
    for (int run = 0; run < 120; run++) {
        dem2d_vec p[60];
        dem2d_outline_info info;
        const int n = star(&random, 3 + run % 50, 0.2 + 0.2 * (run % 4), vec(7, -5), p);
        if (fabsl(area_of(p, n)) < 1e-3L) continue;
        double most = 0, length = 0, narrow = HUGE_VAL;
        for (int i = 0; i < n; i++) {
            const dem2d_vec a = p[i];
            length += hypot(p[(i + 1) % n].x - a.x, p[(i + 1) % n].y - a.y);
            for (int k = 0; k < n; k++) {
                const dem2d_vec b = p[k];
                const double span = hypot(b.x - a.x, b.y - a.y);
                most = fmax(most, span);
                double low = HUGE_VAL, high = -HUGE_VAL; /* width across the line a b */
                for (int m = 0; m < n && k != i; m++) {
                    const double off = (double)turn_of(a, b, p[m]) / span;
                    low = fmin(low, off), high = fmax(high, off);
                }
                if (k != i && (low > -1e-12 || high < 1e-12)) narrow = fmin(narrow, high - low);
            }
        }
        const long double area = fabsl(area_of(p, n));
        if (run % 2) turn_round(p, n);
        assert_ok(dem2d_outline_measure(NULL, p, n, &info));
        assert_near(info.mass.area, area, 1e-12L);
        assert_near(info.perimeter, length, 1e-13L);
        assert_near(info.feret_max, most, 1e-13L);
        assert_near(info.feret_min, narrow, 1e-11L);
        assert_near(info.aspect * info.sphericity, 1, 1e-15L);
        assert_near(info.circularity, 4 * TEST_PI * area / (length * length), 1e-12L);
        assert_between(info.solidity, 0, 1 + 1e-12);
        assert_between(info.roundness, 0, 1);
        /* inside: it is, and no point of a fine grid is deeper */
        assert_within(depth_at(info.inscribed_at, p, n), info.inscribed, 1e-12);
        for (int i = 0; i < 60 * 60; i++) {
            const dem2d_vec c = vec(5 + (i % 60 + 0.5) / 15, -6 + (i / 60 + 0.5) / 30);
            assert_true(depth_at(c, p, n) <= info.inscribed + 1e-6 * info.feret_max);
        }
        /* around: all are in it, and those on it do not leave half of it free */
        double gap = 0, last = HUGE_VAL, first = 0;
        for (double t = 0; t < 720; t++) { /* directions of points on the circle */
            const dem2d_vec u = direction(t * 0.00872664625997165);
            for (int i = 0; i < n; i++) {
                const double x = p[i].x - info.circumscribed_at.x;
                const double y = p[i].y - info.circumscribed_at.y;
                assert_true(hypot(x, y) <= info.circumscribed * (1 + 1e-12));
                if (hypot(x, y) < info.circumscribed * (1 - 1e-9)) continue;
                if (x * u.x + y * u.y < info.circumscribed * 0.99996) continue;
                if (last > 720) first = t;
                if (last < 720) gap = fmax(gap, t - last);
                last = t;
            }
        }
        assert_true(fmax(gap, first + 720 - last) <= 364);
    }
}

static void measures_of_known_shapes(void **state) {
    (void)state;
    dem2d_outline_info info;
    const dem2d_vec box[] = {{1, 1}, {5, 1}, {5, 3}, {3, 3}, {1, 3}};
    assert_ok(dem2d_outline_measure(NULL, box, 5, &info));
    assert_near(info.feret_max, sqrtl(20), 1e-15L);
    assert_near(info.feret_min, 2, 1e-15L);
    assert_near(info.circumscribed, sqrtl(5), 1e-15L);
    assert_near(info.circumscribed_at.x, 3, 1e-15L);
    assert_near(info.inscribed, 1, 4e-6L);
    assert_within(info.inscribed_at.y, 2, 4e-6);
    assert_near(info.solidity, 1, 1e-15L);
    assert_near(info.perimeter, 12, 1e-15L);
    assert_between(info.roundness, 0, 0.08);
    /* an L: the circle touches two sides and the inner corner, a = sqrt(2) (1 - a) */
    const dem2d_vec ell[] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
    assert_ok(dem2d_outline_measure(NULL, ell, 6, &info));
    assert_near(info.inscribed, 2 - sqrtl(2), 5e-6L);
    assert_near(info.solidity, 3 / 3.5L, 1e-15L);
    /* squares with round corners: the corners' radius over half the side; a circle at last */
    for (double r = 0.2; r < 1.1; r += 0.2) {
        dem2d_vec p[400];
        for (int i = 0; i < 400; i++) {
            const dem2d_vec u = direction(1.5707963267948966 * (i / 100 + (i % 100) / 99.0));
            const double sx = i < 100 || i >= 300 ? 1 : -1, sy = i < 200 ? 1 : -1;
            p[i] = vec(sx * (1 - r) + r * u.x, sy * (1 - r) + r * u.y);
        }
        assert_ok(dem2d_outline_measure(NULL, p, 400, &info)); /* r = 1: double points */
        assert_within(info.roundness, r, 0.03);
        assert_within(info.inscribed, 1, 1e-4);
    }
}

/* All lengths times 2^k: the same bits. Sizes are what the manual promises. */
static void measures_have_no_length(void **state) {
    (void)state;
    uint64_t random = 17;
    dem2d_vec p[90], q[90], s[90], t[90];
    const int n = star(&random, 90, 0.3, vec(3, 4), p), m = star(&random, 70, 0.3, vec(3, 4), q);
    dem2d_outline_info one, other;
    dem2d_difference d, e;
    assert_ok(dem2d_outline_measure(NULL, p, n, &one));
    assert_ok(dem2d_outline_compare(NULL, p, n, q, m, &d));
    for (int k = -199; k < 200; k += 57) {
        for (int i = 0; i < 90; i++) {
            s[i] = vec(ldexp(p[i].x, k), ldexp(p[i].y, k));
            if (i < m) t[i] = vec(ldexp(q[i].x, k), ldexp(q[i].y, k));
        }
        assert_ok(dem2d_outline_measure(NULL, s, n, &other));
        assert_same_bits(ldexp(other.inscribed, -k), one.inscribed);
        assert_same_bits(ldexp(other.circumscribed, -k), one.circumscribed);
        assert_same_bits(ldexp(other.feret_min, -k), one.feret_min);
        assert_same_bits(other.roundness, one.roundness);
        assert_same_bits(other.circularity, one.circularity);
        assert_ok(dem2d_outline_compare(NULL, s, n, t, m, &e));
        assert_same_bits(e.coverage, d.coverage);
        assert_same_bits(ldexp(e.area, -2 * k), d.area);
        assert_same_bits(ldexp(e.hausdorff, -k), d.hausdorff);
    }
}

/* --- differences ------------------------------------------------------------------------------ */

/* Area of the symmetric difference by scan lines. */
static double difference_by_lines(const dem2d_vec *p, int n, const dem2d_vec *q, int m) {
    return scan_outlines(p, n, q, m, 4000).difference;
}

static double farthest_corner(const dem2d_vec *p, int n, const dem2d_vec *q, int m) {
    double most = 0;
    for (int i = 0; i < n; i++) {
        double least = HUGE_VAL;
        for (int k = 0; k < m; k++) least = fmin(least, side_distance(p[i], q[k], q[(k + 1) % m]));
        most = fmax(most, least);
    }
    return most;
}

static void differences_of_stars(void **state) {
    (void)state;
    uint64_t random = 19;
    for (int run = 0; run < 300; run++) {
        dem2d_vec p[200], q[200];
        dem2d_difference d, back;
        const int n =
            star(&random, 5 + random_below(&random, run % 3 ? 20 : 190), 0.6, vec(1, 1), p);
        const dem2d_vec at = vec(random_between(&random, 0, run % 5), 1);
        int m = star(&random, 5 + random_below(&random, 190), 0.1 * (run % 9), at, q);
        if (run % 4 == 0) { /* many corners on corners, sides on sides */
            memcpy(q, p, sizeof q), m = n;
            for (int i = 0; i < m; i += 3) q[i].x += random_between(&random, -0.1, 0.1);
        }
        if (run % 6 == 0) /* level sides and crossings at corners */
            for (int i = 0; i < 200; i++) {
                p[i] = vec(round(8 * p[i].x) / 8, round(8 * p[i].y) / 8);
                q[i] = vec(round(8 * q[i].x) / 8, round(8 * q[i].y) / 8);
            }
        const long double area = area_of(p, n);
        if (area < 0.01L || area_of(q, m) < 0.01L) continue;
        if (run % 2) turn_round(q, m);
        assert_ok(dem2d_outline_compare(NULL, p, n, q, m, &d));
        assert_within(d.area, difference_by_lines(p, n, q, m), 2e-3);
        assert_near(1 - d.coverage, d.area / area, 1e-9L);
        const double far = fmax(farthest_corner(p, n, q, m), farthest_corner(q, m, p, n));
        assert_within(d.hausdorff, far, 1e-12);
        assert_ok(dem2d_outline_compare(NULL, q, m, p, n, &back));
        assert_within(back.area, d.area, 1e-12);
        assert_within(back.hausdorff, d.hausdorff, 1e-14);
        assert_ok(dem2d_outline_compare(NULL, q, m, q, m, &d));
        assert_true(d.area == 0 && d.coverage == 1 && d.hausdorff < 1e-15);
    }
}

static void differences_of_boxes(void **state) {
    (void)state;
    static const dem2d_vec box[] = {{0, 0}, {2, 0}, {2, 1}, {0, 1}};
    const struct {
        dem2d_vec p[8];
        int n;
        double area, hausdorff;
    } other[] = {
        {{{0, 0}, {1, 0}, {2, 0}, {2, 0.25}, {2, 1}, {0, 1}, {0, 0.5}}, 7, 0, 0}, /* corners on */
        {{{0, 1}, {2, 1}, {2, 0}, {0, 0}}, 4, 0, 0},                              /* clockwise */
        {{{1, 0}, {3, 0}, {3, 1}, {1, 1}}, 4, 2, 1},       /* along two sides */
        {{{2, 0}, {4, 0}, {4, 1}, {2, 1}}, 4, 4, 2},       /* beside */
        {{{2, 1}, {4, 1}, {4, 2}, {2, 2}}, 4, 4, sqrt(5)}, /* by a corner */
        {{{5, 0}, {6, 0}, {6, 1}, {5, 1}}, 4, 3, 5},       /* strangers */
        {{{0.5, 0.25}, {1.5, 0.25}, {1.5, 0.75}, {0.5, 0.75}}, 4, 1.5, sqrt(0.3125)}, /* inside */
        {{{0, 0}, {2, 0}, {0, 1}}, 3, 1, 2 / sqrt(5)},                 /* cut along the diagonal */
        {{{0.5, -1}, {1.5, -1}, {1.5, 2}, {0.5, 2}}, 4, 3, 1},         /* a cross */
        {{{0, 0}, {2, 0}, {2, 1}, {1, 1e-9}, {0, 1}}, 5, 1 - 1e-9, 0}, /* down to a side */
    };
    for (int i = 0; i < COUNT_OF(other); i++) {
        dem2d_difference d;
        assert_ok(dem2d_outline_compare(NULL, box, 4, other[i].p, other[i].n, &d));
        assert_within(d.area, other[i].area, 1e-15);
        assert_within(d.coverage, 1 - other[i].area / 2, 1e-15);
        if (i < COUNT_OF(other) - 1) assert_within(d.hausdorff, other[i].hausdorff, 1e-15);
    }
}

/* --- errors ----------------------------------------------------------------------------------- */

static void outline_errors(void **state) {
    (void)state;
    static const dem2d_vec good[] = {{0, 0}, {2, 0}, {2, 1}, {0, 1}};
    static const struct {
        dem2d_vec p[4];
        int count;
        dem2d_result result;
    } bad[] = {{{{0, 0}, {1, 0}, {NAN, 1}, {0, 1}}, 4, DEM2D_NOT_FINITE},
               {{{0, 0}, {1, 0}}, 2, DEM2D_TOO_FEW_POINTS},
               {{{0, 0}, {1, 2}, {3, 6}, {2, 4}}, 4, DEM2D_ZERO_AREA},
               {{{1, 2}, {1, 2}, {1, 2}, {1, 2}}, 4, DEM2D_ZERO_AREA}};
    dem2d_outline_info info, kept;
    dem2d_difference d, before;
    memset(&info, 0x5a, sizeof info), memset(&d, 0x5a, sizeof d);
    kept = info, before = d;
    for (int i = 0; i < COUNT_OF(bad); i++) {
        test_env env;
        test_env_init(&env);
        const dem2d_vec *p = bad[i].p;
        const int n = bad[i].count;
        assert_result(dem2d_outline_measure(&env.env, p, n, &info), bad[i].result);
        assert_result(env.log.result, bad[i].result);
        assert_result(dem2d_outline_compare(&env.env, p, n, good, 4, &d), bad[i].result);
        assert_result(dem2d_outline_compare(&env.env, good, 4, p, n, &d), bad[i].result);
        assert_int_equal(env.log.count, 3);
        assert_clean(&env);
    }
    assert_result(dem2d_outline_measure(NULL, NULL, 4, &info), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_outline_measure(NULL, good, 4, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_outline_compare(NULL, NULL, 4, good, 4, &d), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_outline_compare(NULL, good, 4, NULL, 4, &d), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_outline_compare(NULL, good, 4, good, 4, NULL), DEM2D_NULL_ARGUMENT);
    assert_memory_equal(&info, &kept, sizeof info);
    assert_memory_equal(&d, &before, sizeof d);
}

static void every_allocation_can_fail(void **state) {
    (void)state;
    static const char *const rows[] = {".......", ".##.##.", ".##.##.", ".......", ".#.#.#."};
    static const dem2d_vec p[] = {{0, 0}, {4, -1}, {6, 2}, {3, 1}, {-1, 3}};
    picture drawn;
    picture_draw(&drawn, rows, 5);
    drawn.desc.keep_border = true;
    for (int which = 0; which < 3; which++)
        for (int k = 1;; k++) {
            test_env env;
            dem2d_outline_set *set = NULL;
            dem2d_outline_info info;
            dem2d_difference d;
            test_env_init(&env);
            test_env_fail(&env, k);
            const dem2d_result result =
                which == 0   ? dem2d_image_outlines(&env.env, &drawn.desc, &set)
                : which == 1 ? dem2d_outline_measure(&env.env, p, 5, &info)
                             : dem2d_outline_compare(&env.env, p, 5, p, 4, &d);
            if (result == DEM2D_OK) {
                assert_true(k > (which == 2 ? 2 : 3) && env.calls == k - 1);
                if (which == 0) assert_int_equal(dem2d_outline_set_count(set), 5);
                dem2d_outline_set_destroy(set);
                assert_clean(&env);
                break;
            }
            assert_result(result, DEM2D_OUT_OF_MEMORY);
            assert_null(set);
            assert_int_equal(env.log.count, 1);
            assert_logged(&env, DEM2D_OUT_OF_MEMORY, -1, NULL);
            assert_clean(&env);
        }
}

/* --- outlines that cross themselves ----------------------------------------------------------- */

typedef struct strand {
    double y;
    int sign;
} strand;

static int by_height(const void *a, const void *b) {
    const strand *p = a, *q = b;
    return (p->y > q->y) - (p->y < q->y);
}

static int by_size(const void *a, const void *b) {
    const double *p = a, *q = b;
    return (*p > *q) - (*p < *q);
}

/* Where two edges cross or touch, along x; none for parallel ones. */
static bool meet_at(dem2d_vec a, dem2d_vec b, dem2d_vec c, dem2d_vec d, double *x) {
    const double ex = b.x - a.x, ey = b.y - a.y, fx = d.x - c.x, fy = d.y - c.y;
    const double det = ex * fy - ey * fx;
    if (det == 0) return false;
    *x = a.x + ((c.x - a.x) * fy - (c.y - a.y) * fx) / det * ex;
    return true;
}

/* Of corners with small whole coordinates: is every point wound around once, in one sense, or not
   at all? Between neighbouring places where anything happens, along a line. */
static bool winds_once(const dem2d_vec *p, int n) {
    double places[400];
    int count = 0, sense = 0;
    for (int i = 0; i < n; i++) {
        places[count++] = p[i].x;
        for (int k = 0; k < i; k++)
            count += meet_at(p[i], p[(i + 1) % n], p[k], p[(k + 1) % n], &places[count]);
    }
    qsort(places, (size_t)count, sizeof *places, by_size);
    for (int i = 1; i < count; i++) {
        const double x = (places[i - 1] + places[i]) / 2;
        strand strands[32];
        int cut = 0, winding = 0;
        if (places[i] - places[i - 1] < 1e-9) continue;
        for (int k = 0; k < n; k++) {
            const dem2d_vec a = p[k], b = p[(k + 1) % n];
            if ((a.x < x) == (b.x < x)) continue;
            strands[cut].y = a.y + (x - a.x) / (b.x - a.x) * (b.y - a.y);
            strands[cut++].sign = a.x < x ? 1 : -1;
        }
        qsort(strands, (size_t)cut, sizeof *strands, by_height);
        for (int k = 0; k < cut; k++) {
            winding += strands[k].sign;
            if (k + 1 < cut && strands[k + 1].y - strands[k].y < 1e-9) continue;
            if (sense == 0) sense = winding;
            if (winding != 0 && (winding != sense || abs(winding) != 1)) return false;
        }
    }
    return true;
}

/* No two edges cross inside both, and no point is wound around twice. */
static bool is_good(const dem2d_vec *p, int n) {
    for (int i = 0; i < n; i++)
        for (int k = 0; k < i; k++) {
            const dem2d_vec a = p[i], b = p[(i + 1) % n], c = p[k], d = p[(k + 1) % n];
            if (turn_of(a, b, c) * turn_of(a, b, d) < 0 && turn_of(c, d, a) * turn_of(c, d, b) < 0)
                return false;
        }
    return winds_once(p, n);
}

/* The log's edges are at the log's point. */
static void check_message(const test_env *env, const dem2d_vec *p, int n) {
    int edge[2];
    dem2d_vec at;
    assert_result(env->log.result, DEM2D_CROSSING);
    assert_int_equal(sscanf(env->log.text, "points: edges %d and %d cross or overlap at (%lf, %lf)",
                            &edge[0], &edge[1], &at.x, &at.y),
                     4);
    assert_int_equal(env->log.index, edge[0]);
    assert_true(edge[0] < edge[1] && edge[1] < n);
    for (int i = 0; i < 2; i++) { /* an edge without a length is named with the next */
        double least = HUGE_VAL;
        int k = edge[i];
        do {
            least = fmin(least, side_distance(at, p[k], p[(k + 1) % n]));
            k = (k + 1) % n;
        } while (p[k].x == p[(k + n - 1) % n].x && p[k].y == p[(k + n - 1) % n].y);
        assert_within(least, 0, 1e-6 * (1 + fabs(at.x) + fabs(at.y)));
    }
}

static bool check_crossing(const dem2d_vec *p, int n, bool good) {
    test_env env;
    dem2d_difference d;
    test_env_init(&env);
    const dem2d_result result = dem2d_radial_compare(&env.env, p, n, 0, &d);
    if (good) {
        if (result != DEM2D_ZERO_AREA) assert_ok(result);
    } else {
        assert_result(result, DEM2D_CROSSING);
        check_message(&env, p, n);
    }
    assert_clean(&env);
    return result == DEM2D_OK;
}

/* Corners on a small lattice touch, repeat and lie on each other all the time; turned and moved
   they do so but for rounding. */
static void crossings_of_lattice_polygons(void **state) {
    (void)state;
    uint64_t random = 41;
    int good = 0, runs = test_long() ? 200000 : 4000;
    for (int run = 0; run < runs; run++) {
        dem2d_vec p[16], q[16];
        const int n = 3 + random_below(&random, 8), side = 2 + random_below(&random, 5);
        for (int i = 0; i < n; i++)
            p[i] = vec(random_below(&random, side), random_below(&random, side));
        const bool once = is_good(p, n);
        good += check_crossing(p, n, once);
        const dem2d_vec u = direction(random_between(&random, 0, 7));
        const double x = random_between(&random, -9, 9), size = exp(random_between(&random, -9, 9));
        for (int i = 0; i < n; i++)
            q[i] = vec(size * (p[i].x * u.x - p[i].y * u.y + x),
                       size * (p[i].x * u.y + p[i].y * u.x - x));
        (void)check_crossing(q, n, once);
    }
    assert_true(good > runs / 10);
}

static void crossings_of_known_outlines(void **state) {
    (void)state;
    enum { N = 400 };
    static dem2d_vec p[2 * N];
    static const dem2d_vec eight[] = {{0, 0}, {2, 2}, {2, 0}, {0, 2}};
    static const dem2d_vec touch[] = {{0, 0}, {2, 2}, {4, 0}, {4, 4}, {2, 2}, {0, 4}};
    static const dem2d_vec side[] = {{0, 0}, {4, 0}, {4, 4}, {2, 0}, {0, 4}};
    static const dem2d_vec spike[] = {{0, 0}, {2, 0}, {5, 0}, {2, 0}, {2, 2}, {0, 2}};
    static const dem2d_vec keyhole[] = {{0, 0}, {6, 0}, {6, 6}, {0, 6}, {0, 0},
                                        {2, 2}, {2, 4}, {4, 4}, {4, 2}, {2, 2}};
    static const dem2d_vec island[] = {{0, 0}, {6, 0}, {6, 6}, {0, 6}, {0, 0},
                                       {2, 2}, {4, 2}, {4, 4}, {2, 4}, {2, 2}};
    static const dem2d_vec repeated[] = {{0, 0}, {0, 0}, {3, 0}, {3, 0}, {3, 0}, {0, 3}, {0, 0}};
    test_env env;
    dem2d_outline_info info;
    dem2d_fit_desc fit = {0};
    dem2d_shape *shape = NULL;
    dem2d_difference d;
    check_crossing(eight, 4, false);
    assert_true(check_crossing(touch, 6, true)); /* two triangles that share a corner */
    assert_true(check_crossing(side, 5, true));  /* a corner on an edge */
    assert_true(check_crossing(spike, 6, true)); /* there and back */
    assert_true(check_crossing(keyhole, 10, true));
    check_crossing(island, 10, false); /* the inner square is wound around twice */
    assert_true(check_crossing(repeated, 7, true));
    for (int kind = 0; kind < 2; kind++) { /* traced twice, shuffled */
        for (int i = 0; i < N; i++) {
            const dem2d_vec u =
                direction(2 * (double)TEST_PI * (kind ? i * 7 % (N / 2) : i) * 2 / N);
            p[i] = vec(2 * u.x, u.y);
        }
        check_crossing(p, N, false);
        test_env_init(&env);
        fit.model = DEM2D_FOURIER, fit.count = 8;
        assert_result(dem2d_outline_measure(&env.env, p, N, &info), DEM2D_CROSSING);
        assert_result(dem2d_outline_fit(&env.env, p, N, &fit, &shape, NULL), DEM2D_CROSSING);
        assert_result(dem2d_radial_compare(&env.env, p, N, 4, &d), DEM2D_CROSSING);
        assert_int_equal(env.log.count, 3);
        assert_null(shape);
        assert_result(dem2d_bezier_fit(&env.env, p, N, 8, p), DEM2D_CROSSING);
        assert_clean(&env);
    }
}

/* The line cuts all teeth of a comb at once; the last of them crosses the one before. */
static void crossing_of_a_comb(void **state) {
    (void)state;
    const int teeth = 50000, n = 2 * teeth + 2;
    dem2d_vec *p = malloc((size_t)n * sizeof *p);
    test_env env;
    dem2d_difference d;
    for (int i = 0; i < teeth; i++) {
        p[2 * i] = vec(100, i);
        p[2 * i + 1] = vec(1 + i * 1e-6, i + 0.5);
    }
    p[n - 2] = vec(100, teeth), p[n - 1] = vec(101, teeth / 2);
    p[n - 4] = vec(90, teeth - 2.8);
    test_env_init(&env);
    assert_result(dem2d_radial_compare(&env.env, p, n, 0, &d), DEM2D_CROSSING);
    check_message(&env, p, n);
    assert_true(env.log.index > n - 8);
    free(p);
}

/* --- real grains ------------------------------------------------------------------------------ */

static int read_outline(const char *folder, const char *name, dem2d_vec *points) {
    char path[1024], line[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "r");
    int count = 0;
    if (!file) return 0;
    if (fgets(line, sizeof line, file))
        while (count < MOST && fscanf(file, "%lf,%lf", &points[count].x, &points[count].y) == 2)
            count++;
    fclose(file);
    return count;
}

/* Roundness against the published values of the same grains. */
static void roundness_of_real_grains(void **state) {
    (void)state;
    const char *folder = getenv("DATA");
    char path[1024], line[1024], name[32];
    snprintf(path, sizeof path, "%s/test1_results.csv", folder ? folder : ".");
    FILE *file = folder && *folder ? fopen(path, "r") : NULL;
    if (!file) {
        print_message("DATA names no folder with test1_results.csv\n");
        skip();
        return;
    }
    double sum[5] = {0, 0, 0, 0, 0}, published;
    int count = 0, number;
    while (fgets(line, sizeof line, file)) {
        static dem2d_vec points[MOST];
        dem2d_outline_info info;
        if (sscanf(line, "%d,%lf", &number, &published) != 2) continue;
        snprintf(name, sizeof name, "test1_%02d.csv", number);
        const int n = read_outline(folder, name, points);
        if (n == 0) continue;
        assert_ok(dem2d_outline_measure(NULL, points, n, &info));
        const double x = info.roundness, y = published;
        sum[0] += x, sum[1] += y, sum[2] += x * x, sum[3] += y * y, sum[4] += x * y, count++;
    }
    fclose(file);
    assert_true(count > 2);
    const double xx = count * sum[2] - sum[0] * sum[0], yy = count * sum[3] - sum[1] * sum[1];
    const double correlation = (count * sum[4] - sum[0] * sum[1]) / sqrt(xx * yy);
    print_message("roundness of %d grains: correlation %.4f, mean difference %+.4f\n", count,
                  correlation, (sum[0] - sum[1]) / count);
    assert_true(correlation > 0.9);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(thresholds),
        cmocka_unit_test(small_pictures),
        cmocka_unit_test(random_pictures),
        cmocka_unit_test(frames),
        cmocka_unit_test(light_frame),
        cmocka_unit_test(crops),
        cmocka_unit_test(two_bytes),
        cmocka_unit_test(label_masks),
        cmocka_unit_test(random_labels),
        cmocka_unit_test(disc_in_grey),
        cmocka_unit_test(picture_errors),
        cmocka_unit_test(measures_of_stars),
        cmocka_unit_test(measures_of_known_shapes),
        cmocka_unit_test(measures_have_no_length),
        cmocka_unit_test(differences_of_stars),
        cmocka_unit_test(differences_of_boxes),
        cmocka_unit_test(outline_errors),
        cmocka_unit_test(every_allocation_can_fail),
        cmocka_unit_test(crossings_of_lattice_polygons),
        cmocka_unit_test(crossings_of_known_outlines),
        cmocka_unit_test(crossing_of_a_comb),
        cmocka_unit_test(roundness_of_real_grains),
    };
    return cmocka_run_group_tests_name("outlines", tests, NULL, NULL);
}
