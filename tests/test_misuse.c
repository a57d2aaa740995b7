/* Wrong use of the whole public API: every pointer NULL, every number not finite or out of its
   range, every id stale, calls in the wrong order. What arguments may be is in the table of
   api_calls.h, what fields of descs may be in the tables of dem2d.h. Each wrong value is answered
   by the right result and a message that names field and value; outputs, inputs and the world stay
   as they were, to the bit. */
#include "dem2d.h"
#include "fields.h"
#include "testing.h"
#include "fingerprint.h"
#include "api_calls.h"

/* --- the fields of descs --------------------------------------------------------------------- */

static const char *const desc_names[DESCS] = {
    "custom",   "reduction", "image",    "fit",         "virtual", "contact", "world",
    "material", "pair",      "particle", "wall",        "save",    "load",    "svg",
    "vtp",      "pvd",       "csv",      "wall",        "query",   "grid",    "grading",
    "draw",     "fill",      "inlet",    "deformation", "growth"};

#define FIELD(type, field, ...) \
    { .name = #field, .offset = offsetof(dem2d_##type, field), .kind = __VA_ARGS__ }

/* Fields whose range follows from other fields, of the descs that api_calls.h prepares: a mass that
   is given, a picture of 8 by 8, an FS of order 1 at least, a servo wall without spans, no paths.
 */
static const struct special {
    int desc;
    row row;
} specials[] = {
    {CUSTOM, FIELD(custom_desc, mass.polar_moment, POSITIVE)},
    {IMAGE, FIELD(image_desc, pixels, POINTER)},
    {IMAGE, FIELD(image_desc, stride, INTEGER, .low = 8, .high = INT_MAX, .or_0 = true)},
    {IMAGE, FIELD(image_desc, crop_left, INTEGER, .high = 7)},
    {IMAGE, FIELD(image_desc, crop_top, INTEGER, .high = 7)},
    {IMAGE, FIELD(image_desc, crop_width, INTEGER, .high = 8)},
    {IMAGE, FIELD(image_desc, crop_height, INTEGER, .high = 8)},
    {IMAGE, FIELD(image_desc, threshold, INTEGER, .high = 255)},
    {FIT, FIELD(fit_desc, count, INTEGER, .low = 1, .high = 1024)},
    {FIT, FIELD(fit_desc, method, INTEGER, .high = DEM2D_FIT_CONSTRAINED)},
    {PARTICLE, FIELD(particle_desc, shape, SHAPE_ID)},
    {PARTICLE, FIELD(particle_desc, material, MATERIAL_ID)},
    {WALL, FIELD(wall_desc, length, POSITIVE)},
    {WALL, FIELD(wall_desc, material, MATERIAL_ID)},
    {WALL, FIELD(wall_desc, normal, DIRECTION)},
    {WALL, FIELD(wall_desc, max_speed, POSITIVE)},
    {WALL, FIELD(wall_desc, spans[0], SPAN_ID)},
    {WALL, FIELD(wall_desc, spans[1], SPAN_ID)},
    {SEGMENT, FIELD(wall_desc, material, MATERIAL_ID)},
    {SEGMENT, FIELD(wall_desc, end, ELSEWHERE)},
    {SEGMENT, FIELD(wall_desc, max_speed, POSITIVE)},
    {SEGMENT, FIELD(wall_desc, spans[0], SPAN_ID)},
    {SEGMENT, FIELD(wall_desc, spans[1], SPAN_ID)},
    {SAVE, FIELD(save_desc, write, POINTER)},
    {LOAD, FIELD(load_desc, read, POINTER)},
    {LOAD, FIELD(load_desc, custom, POINTER)},
    {LOAD, FIELD(load_desc, law, POINTER)},
    {LOAD, FIELD(load_desc, law_tag, INTEGER, .result = DEM2D_NULL_ARGUMENT, .low = LAW_TAG,
                 .high = LAW_TAG)},
    {GRID, FIELD(grid_desc, box.upper, UPPER)},
    {SVG, FIELD(svg_desc, value_count, INTEGER)},
    {SVG, FIELD(svg_desc, low, NUMBER, .low = -DBL_MAX)},
    {SVG, FIELD(svg_desc, high, NOT_NEGATIVE)},
    {SVG, FIELD(svg_desc, write, POINTER)},
    {VTP, FIELD(vtp_desc, write, POINTER)},
    {PVD, FIELD(pvd_desc, times, POINTER)},
    {PVD, FIELD(pvd_desc, files, POINTER)},
    {PVD, FIELD(pvd_desc, write, POINTER)},
    {CSV, FIELD(csv_desc, names, POINTER)},
    {CSV, FIELD(csv_desc, values, POINTER)},
    {CSV, FIELD(csv_desc, write, POINTER)},
    {GRADING, FIELD(grading_desc, points, POINTER)},
    {GRADING, FIELD(grading_desc, point_count, INTEGER, .low = 1, .high = 256)},
    {FILL, FIELD(fill_desc, grading, POINTER)},
    {FILL, FIELD(fill_desc, region.box.upper, UPPER)},
    {INLET, FIELD(inlet_desc, region.box.upper, UPPER)},
    {GROWTH, FIELD(growth_desc, stress, POSITIVE)},
};

typedef struct desc_rows {
    row rows[32];
    int count;
} desc_rows;

static desc_rows descs[DESCS];
static field_row field_rows[512]; /* they hold the names */

/* What follows of a field's type and range. The callbacks here need their user pointers. */
static row row_of(const field_row *f) {
    const size_t length = strlen(f->name);
    const bool user = length >= 4 && strcmp(f->name + length - 4, "user") == 0;
    row r = {
        .name = f->name, .offset = f->offset, .kind = ANYTHING, .low = f->low, .high = f->high};
    r.above = f->above, r.below = f->below, r.or_0 = f->or_0;
    if (f->type == FIELD_DOUBLE) r.kind = NUMBER;
    if (f->type == FIELD_VEC) r.kind = VECTOR;
    if (f->type == FIELD_ENUM || (f->type == FIELD_INT && f->low > -DBL_MAX)) r.kind = INTEGER;
    if (f->type == FIELD_POINTER && !user) r.kind = f->low > 0 ? POINTER : OPTIONAL;
    return r;
}

static void add_row(int desc, const row *r) {
    desc_rows *d = &descs[desc];
    assert_true(d->count < COUNT_OF(d->rows));
    d->rows[d->count] = *r;
    if (r->kind == INTEGER && r->result == DEM2D_OK) d->rows[d->count].result = DEM2D_OUT_OF_RANGE;
    d->count++;
}

/* Is a field one of the specials, or the array that they are in? */
static bool is_special(int desc, const field_row *f) {
    for (int i = 0; i < COUNT_OF(specials); i++)
        if (specials[i].desc == desc && specials[i].row.offset >= f->offset &&
            specials[i].row.offset < f->offset + f->size)
            return true;
    return false;
}

/* Rows of all descs: from the tables of fields, and the specials. */
static int make_descs(void **state) {
    (void)state;
    for (int i = 0; fields_get(i, &field_rows[i]); i++) {
        const field_row *f = &field_rows[i];
        const row r = row_of(f);
        assert_true(i + 1 < COUNT_OF(field_rows));
        for (int d = 0; d < DESCS; d++) {
            char name[64];
            snprintf(name, sizeof name, "dem2d_%s_desc", desc_names[d]);
            if (strcmp(name, f->of) != 0 || is_special(d, f)) continue;
            assert_int_not_equal(f->type, FIELD_ID); /* of which kind? */
            add_row(d, &r);
        }
    }
    for (int i = 0; i < COUNT_OF(specials); i++) add_row(specials[i].desc, &specials[i].row);
    return 0;
}

/* --- wrong values ---------------------------------------------------------------------------- */

/* What stands in the place of a good value, and what must come of it. */
typedef struct wrong {
    unsigned char bytes[sizeof(dem2d_pose)];
    size_t size;
    dem2d_result result; /* OK: nothing is wrong with it */
    bool logged;         /* the name of the field is in the log, if there is one */
    bool numbered;       /* and so is this number */
    double number;
} wrong;

enum { WRONG_MOST = 32 };

typedef struct wrongs {
    wrong list[WRONG_MOST];
    int count;
} wrongs;

static void add(wrongs *w, const void *value, size_t size, dem2d_result result, bool logged) {
    assert_true(w->count < WRONG_MOST);
    wrong *one = &w->list[w->count++];
    memset(one, 0, sizeof *one);
    memcpy(one->bytes, value, size);
    one->size = size, one->result = result, one->logged = logged;
}

/* The number of the last of the list. */
static void named(wrongs *w, double value) {
    w->list[w->count - 1].number = value;
    w->list[w->count - 1].numbered = true;
}

static void add_number(wrongs *w, double value, dem2d_result result) {
    add(w, &value, sizeof value, result, true);
    named(w, value);
}

static void add_vec(wrongs *w, double x, double y, dem2d_result result) {
    const dem2d_vec value = {x, y};
    add(w, &value, sizeof value, result, true);
    if (!isfinite(x)) named(w, x);
    if (!isfinite(y)) named(w, y);
}

static void add_pose(wrongs *w, double x, double c, double s, double scale, dem2d_result result) {
    dem2d_pose value = {{x, 0.2}, {c, s}, scale};
    add(w, &value, sizeof value, result, false);
}

static void add_int(wrongs *w, int value, dem2d_result result) {
    add(w, &value, sizeof value, result, true);
    named(w, value);
}

static void not_finite(wrongs *w) {
    add_number(w, NAN, DEM2D_NOT_FINITE);
    add_number(w, INFINITY, DEM2D_NOT_FINITE);
    add_number(w, -INFINITY, DEM2D_NOT_FINITE);
}

/* Beside both ends of the range, and far off. */
static void wrong_number(wrongs *w, const row *r) {
    const double below[] = {nextafter(r->low, -INFINITY), r->low - 1, -1e308, r->low};
    const double above[] = {nextafter(r->high, INFINITY), r->high + 1, 1e308, r->high};
    not_finite(w);
    for (int i = 0; i < 4; i++) {
        const bool low = r->low > -DBL_MAX && (i < 3 || r->above) && (below[i] != 0 || !r->or_0);
        const bool high = r->high < DBL_MAX && (i < 3 || r->below) && (above[i] != 0 || !r->or_0);
        if (low) add_number(w, below[i], DEM2D_OUT_OF_RANGE);
        if (high) add_number(w, above[i], DEM2D_OUT_OF_RANGE);
    }
    if (r->low == 0 && r->above && !r->or_0) add_number(w, -0.0, DEM2D_OUT_OF_RANGE);
}

/* Sizes of shapes: 0, and for a0 of a series less, have no area. */
static void wrong_size(wrongs *w, kind kind) {
    const double values[] = {-1, -0x1p-1074, -1e308}, size[] = {1e200, 1e-200};
    not_finite(w);
    for (int i = 0; i < COUNT_OF(values); i++)
        add_number(w, values[i], kind == LEADING ? DEM2D_ZERO_AREA : DEM2D_OUT_OF_RANGE);
    add_number(w, 0, DEM2D_ZERO_AREA);
    for (int i = 0; i < 2 && kind == SIZE; i++)
        add(w, &size[i], sizeof size[i], DEM2D_OUT_OF_RANGE, false);
}

static void wrong_vector(wrongs *w, const fixture *f, kind kind) {
    const double bad[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        add_vec(w, bad[i], 1, DEM2D_NOT_FINITE);
        add_vec(w, 1, bad[i], DEM2D_NOT_FINITE);
    }
    if (kind == DIRECTION) add_vec(w, 0, -0.0, DEM2D_OUT_OF_RANGE);
    if (kind == ELSEWHERE) {
        const dem2d_vec point = good_wall(f).point;
        add_vec(w, point.x, point.y, DEM2D_OUT_OF_RANGE);
    }
    if (kind != UPPER) return;
    const dem2d_vec lower = {0.05, 0.02}, beyond[] = {{1, 0.02}, {0.05, 1}, {1, -1}, {-1, -1}};
    add_vec(w, lower.x, lower.y, DEM2D_OUT_OF_RANGE);
    for (int i = 0; i < COUNT_OF(beyond); i++)
        add_vec(w, beyond[i].x, beyond[i].y, DEM2D_OUT_OF_RANGE);
}

static void wrong_text(wrongs *w, kind kind) {
    static const char *const control[] = {"\001", "a\nb", "a.vtp\037"};
    static const char *const column[] = {"a,b", "\"", "a\n", "\rb"};
    static const char *const fine[] = {"", "a b", "&<>'"};
    const char *none = NULL;
    add(w, &none, sizeof none, DEM2D_NULL_ARGUMENT, true);
    for (int i = 0; i < (kind == COLUMN ? COUNT_OF(column) : COUNT_OF(control)); i++)
        add(w, kind == COLUMN ? &column[i] : &control[i], sizeof *column, DEM2D_OUT_OF_RANGE, true);
    for (int i = 0; i < COUNT_OF(fine); i++) add(w, &fine[i], sizeof *fine, DEM2D_OK, false);
}

static void wrong_pose(wrongs *w) {
    const double bad[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        add_pose(w, bad[i], 1, 0, 1, DEM2D_NOT_FINITE);
        add_pose(w, 1, bad[i], 0, 1, DEM2D_NOT_FINITE);
        add_pose(w, 1, 1, bad[i], 1, DEM2D_NOT_FINITE);
        add_pose(w, 1, 1, 0, bad[i], DEM2D_NOT_FINITE);
    }
    add_pose(w, 1, 0, 0, 1, DEM2D_OUT_OF_RANGE);
    add_pose(w, 1, 1, 0, 0, DEM2D_OUT_OF_RANGE);
    add_pose(w, 1, 1, 0, -1, DEM2D_OUT_OF_RANGE);
}

static void wrong_int(wrongs *w, const row *r) {
    const double values[] = {INT_MIN, -1, 0, r->low - 1, r->high + 1, INT_MAX};
    for (int i = 0; i < COUNT_OF(values); i++) {
        const double v = values[i];
        if (v > INT_MAX || (v >= r->low && v <= r->high) || (v == 0 && r->or_0)) continue;
        add_int(w, (int)v, r->result);
    }
}

static void wrong_id(wrongs *w, const fixture *f, const row *r) {
    const dem2d_wall_id alive = f->walls[0];
    for (int i = r->kind == SPAN_ID ? 1 : 0; i < STALE; i++) {
        if (r->kind == SHAPE_ID)
            add(w, &f->stale_shapes[i], sizeof *f->stale_shapes, DEM2D_STALE_ID, true);
        else if (r->kind == MATERIAL_ID)
            add(w, &f->stale_materials[i], sizeof *f->stale_materials, DEM2D_STALE_ID, true);
        else if (r->kind == PARTICLE_ID)
            add(w, &f->stale_particles[i], sizeof *f->stale_particles, DEM2D_STALE_ID, true);
        else
            add(w, &f->stale_walls[i], sizeof *f->stale_walls, DEM2D_STALE_ID, r->kind == WALL_ID);
    }
    if (r->kind == SPAN_ID)
        add(w, &alive, sizeof alive, DEM2D_OUT_OF_RANGE, false); /* one of two */
}

static void wrong_values(wrongs *w, const fixture *f, const row *r) {
    const void *none = NULL;
    w->count = 0;
    switch (r->kind) {
    case POINTER:
    case OPTIONAL:
        add(w, &none, sizeof none, r->kind == POINTER ? DEM2D_NULL_ARGUMENT : DEM2D_OK, false);
        break;
    case NUMBER:
        wrong_number(w, r);
        break;
    case SIZE:
    case LEADING:
        wrong_size(w, r->kind);
        break;
    case UNREAD:
        add_number(w, NAN, DEM2D_OK);
        break;
    case VECTOR:
    case DIRECTION:
    case UPPER:
    case ELSEWHERE:
        wrong_vector(w, f, r->kind);
        break;
    case POSE:
        wrong_pose(w);
        break;
    case INTEGER:
        wrong_int(w, r);
        break;
    case SHAPE_ID:
    case MATERIAL_ID:
    case PARTICLE_ID:
    case WALL_ID:
    case SPAN_ID:
        wrong_id(w, f, r);
        break;
    case FILE_NAME:
    case COLUMN:
        wrong_text(w, r->kind);
        break;
    case ANYTHING:
        break;
    }
}

/* --- the walk -------------------------------------------------------------------------------- */

/* With good arguments but for the one that `w` replaces, on a world of its own: it must go well. */
static void check_fine(const function *of, const row *r, const wrong *w, bool in_desc) {
    fixture f;
    static args v;
    fixture_make(&f, 10);
    args_make(&v, &f);
    of->prepare(&v, &f);
    if (w) memcpy((char *)(in_desc ? (void *)&v.d : &v) + r->offset, w->bytes, w->size);
    const dem2d_result result = of->call(&v);
    if (result != DEM2D_OK)
        print_error("dem2d_%s, %s: log \"%s\"\n", of->name, r ? r->name : "all good",
                    f.env.log.text);
    assert_result(result, DEM2D_OK);
    if (of->release) of->release(&v);
    fixture_end(&f);
}

/* Whether the log names the field: its last part, without a component. */
static bool log_names(const fixture *f, const char *name) {
    const char *dot = strrchr(name, '.');
    char word[64];
    snprintf(word, sizeof word, "%.*s", (int)strcspn(dot ? dot + 1 : name, "["),
             dot ? dot + 1 : name);
    return f->env.log.count > 0 && strstr(f->env.log.text, word);
}

/* Whether the log tells the number, to five digits. */
static bool log_tells(const fixture *f, double number) {
    const char *at = f->env.log.text;
    for (char *end; *at; at = end > at ? end : at + 1) {
        const double told = strtod(at, &end);
        if (end == at) continue;
        if (isnan(number) ? isnan(told) : told == number) return true;
        if (fabs(told - number) <= 1e-5 * fabs(number) && isfinite(number)) return true;
    }
    return false;
}

/* Only `done` of a step is written whatever comes of it: 0 steps. */
static void check_done(const function *of, args *v, const args *before) {
    if (of->call != call_world_step || !v->third) return;
    assert_int_equal(*(int *)v->third, 0);
    memcpy(v->third, &before->outputs[2], sizeof(int));
}

static bool check_refused(const function *of, const row *r, const wrong *w, bool in_desc,
                          fixture *f, args *v) {
    static args before;
    char *place = (char *)(in_desc ? (void *)&v->d : v) + r->offset, good[sizeof w->bytes];
    memcpy(good, place, w->size);
    memcpy(place, w->bytes, w->size);
    memcpy(&before, v, sizeof before);
    test_log_clear(&f->env);
    const dem2d_result result = of->call(v);
    check_done(of, v, &before);
    bool right = result == w->result;
    if (!right)
        print_error("\"%s\", expected \"%s\"\n", dem2d_result_text(result),
                    dem2d_result_text(w->result));
    if (right && of->logs && w->logged) {
        right = f->env.log.result == w->result && log_names(f, r->name) &&
                (!w->numbered || log_tells(f, w->number));
        if (!right) print_error("%d in the log: \"%s\"\n", f->env.log.count, f->env.log.text);
    }
    if (memcmp(&before, v, sizeof before) != 0) {
        print_error("an argument or output was changed\n");
        right = false;
    }
    memcpy(place, good, w->size);
    return right;
}

/* All that is wrong for one argument or field. */
static void walk_row(const function *of, const row *r, bool in_desc, fixture *f, args *v) {
    static wrongs w;
    wrong_values(&w, f, r);
    for (int i = 0; i < w.count; i++) {
        if (w.list[i].result == DEM2D_OK) {
            check_fine(of, r, &w.list[i], in_desc);
            continue;
        }
        fingerprint before = fixture_print(f);
        bool right = check_refused(of, r, &w.list[i], in_desc, f, v);
        fingerprint after = fixture_print(f);
        right = fingerprint_same(&before, &after) && right;
        fingerprint_free(&before), fingerprint_free(&after);
        if (right) continue;
        print_error("dem2d_%s with the wrong %s, value %d of its list\n", of->name, r->name, i);
        fail();
    }
}

/* After all its refusals the world goes on as one that was never asked. */
static void check_goes_on(fixture *f, fixture *twin) {
    assert_ok(dem2d_world_step(f->world, 40, NULL));
    assert_ok(dem2d_world_step(twin->world, 40, NULL));
    fingerprint one = fixture_print(twin), other = fixture_print(f);
    assert_true(fingerprint_same(&one, &other));
    fingerprint_free(&one), fingerprint_free(&other);
}

static void test_function(void **state) {
    const function *of = *state;
    fixture f, twin;
    static args v;
    check_fine(of, NULL, NULL, false);
    fixture_make(&f, 30);
    fixture_make(&twin, 30);
    args_make(&v, &f);
    of->prepare(&v, &f);
    for (int i = 0; i < of->count; i++) walk_row(of, &of->rows[i], false, &f, &v);
    for (int i = 0; of->desc >= 0 && i < descs[of->desc].count; i++)
        walk_row(of, &descs[of->desc].rows[i], true, &f, &v);
    check_goes_on(&f, &twin);
    fixture_end(&f);
    fixture_end(&twin);
}

/* --- numbers at the ends of their range ------------------------------------------------------ */

/* Where the doubles of an argument or field are; how many. */
static int doubles_of(kind kind) {
    switch (kind) {
    case NUMBER:
    case SIZE:
    case LEADING:
    case UNREAD:
        return 1;
    case VECTOR:
    case DIRECTION:
    case UPPER:
    case ELSEWHERE:
        return 2;
    default:
        return 0;
    }
}

/* A finite number of any size is taken or refused. Refused, nothing changes; taken, the world can
   be stepped, or says why it can't, and asked. */
static void check_extreme(const function *of, const row *r, bool in_desc, int part, double value) {
    fixture f;
    static args v, before;
    fixture_make(&f, 10);
    args_make(&v, &f);
    of->prepare(&v, &f);
    char *place = (char *)(in_desc ? (void *)&v.d : &v) + r->offset;
    memcpy(place + (size_t)part * sizeof value, &value, sizeof value);
    memcpy(&before, &v, sizeof v);
    fingerprint was = fixture_print(&f);
    const dem2d_result result = of->call(&v);
    if (result == DEM2D_OK) {
        if (of->release) of->release(&v);
        const dem2d_result stepped = dem2d_world_step(f.world, 3, NULL);
        assert_true(stepped == DEM2D_OK || stepped == DEM2D_STATE || stepped == DEM2D_TIME_STEP);
        fingerprint now = fixture_print(&f);
        fingerprint_free(&now);
    } else {
        fingerprint now = fixture_print(&f);
        const bool same = fingerprint_same(&was, &now) && memcmp(&before, &v, sizeof v) == 0;
        if (!same || result == DEM2D_OUT_OF_MEMORY || result == DEM2D_NULL_ARGUMENT) {
            print_error("dem2d_%s with %s = %g: \"%s\"\n", of->name, r->name, value,
                        dem2d_result_text(result));
            fail();
        }
        fingerprint_free(&now);
    }
    fingerprint_free(&was);
    fixture_end(&f);
}

static void check_extremes(const function *of, const row *rows, int count, bool in_desc) {
    static const double values[] = {DBL_MAX, 1e160, 1e60, 1e-160, DBL_MIN, 0x1p-1074};
    for (int i = 0; i < count; i++)
        for (int part = 0; part < doubles_of(rows[i].kind); part++)
            for (int k = 0; k < 2 * COUNT_OF(values); k++)
                if (test_long() ||
                    (i + part + k) % 3 == 0) /* large and small ones, of both signs */
                    check_extreme(of, &rows[i], in_desc, part,
                                  k % 2 ? -values[k / 2] : values[k / 2]);
}

static void test_extremes(void **state) {
    (void)state;
    for (int i = 0; i < COUNT_OF(functions); i++) {
        const function *of = &functions[i];
        check_extremes(of, of->rows, of->count, false);
        if (of->desc >= 0) check_extremes(of, descs[of->desc].rows, descs[of->desc].count, true);
    }
}

/* --- the table holds all of the API ---------------------------------------------------------- */

static FILE *open_header(void) {
    FILE *file = fopen("../dem2d.h", "r");
    if (!file) fail_msg("../dem2d.h can't be opened (tests run inside tests/)");
    return file;
}

/* Every declaration of a function that returns a result names one of the table; the others are in
   the list of test_others. */
static void test_all_functions(void **state) {
    static const char start[] = "DEM2D_API ";
    static const char *const others[] = {"version",
                                         "result_text",
                                         "rot_make",
                                         "rot_angle",
                                         "pose_make",
                                         "shape_destroy",
                                         "outline_set_count",
                                         "outline_set_destroy",
                                         "world_destroy",
                                         "world_shape",
                                         "strain",
                                         "world_hash",
                                         "grid_destroy",
                                         "random_uniform",
                                         "random_normal",
                                         "law_builtin"};
    char line[256];
    int found = 0, missing = 0;
    (void)state;
    FILE *file = open_header();
    while (fgets(line, sizeof line, file) && !strstr(line, "#ifdef DEM2D_IMPLEMENTATION")) {
        if (strncmp(line, start, sizeof start - 1) != 0) continue;
        const bool result = strncmp(line + sizeof start - 1, "dem2d_result ", 13) == 0;
        line[strcspn(line, "(")] = 0;
        const char *name = line + sizeof start - 1;
        for (const char *at = name; (at = strstr(at, "dem2d_")) != NULL;) name = at += 6;
        int i = 0, count = result ? COUNT_OF(functions) : COUNT_OF(others);
        while (i < count && strcmp(result ? functions[i].name : others[i], name) != 0) i++;
        if (i == count) {
            print_error("dem2d_%s has no row in api_calls.h\n", name);
            missing++;
        }
        found++;
    }
    fclose(file);
    assert_int_equal(missing, 0);
    assert_true(found > 80);
}

/* Every desc with a table of fields is the desc of some function. */
static void test_all_descs(void **state) {
    (void)state;
    for (int i = 0; field_rows[i].of; i++) {
        bool called = strcmp(field_rows[i].of, "dem2d_env") == 0;
        for (int k = 0; k < COUNT_OF(functions) && !called; k++) {
            char name[64];
            if (functions[k].desc == NO_DESC) continue;
            snprintf(name, sizeof name, "dem2d_%s_desc", desc_names[functions[k].desc]);
            called = strcmp(name, field_rows[i].of) == 0;
        }
        if (!called) fail_msg("no function in api_calls.h takes a %s", field_rows[i].of);
    }
}

/* --- what returns no result ------------------------------------------------------------------ */

static void test_others(void **state) {
    (void)state;
    fixture f;
    static const int results[] = {-1, DEM2D_RESULT_COUNT, INT_MAX, INT_MIN};
    static const double angles[] = {NAN, INFINITY, -INFINITY, 1073741825.0, -1e300};
    fixture_make(&f, 10);
    dem2d_world_destroy(NULL);
    dem2d_shape_destroy(NULL);
    dem2d_outline_set_destroy(NULL);
    dem2d_grid_destroy(NULL);
    assert_int_equal(dem2d_outline_set_count(NULL), 0);
    for (int i = 0; i < COUNT_OF(results); i++)
        assert_string_equal(dem2d_result_text((dem2d_result)results[i]), "unknown result");
    for (int i = 0; i < COUNT_OF(angles); i++) {
        assert_true(isnan(dem2d_rot_make(angles[i]).c) && isnan(dem2d_rot_make(angles[i]).s));
        assert_true(isnan(dem2d_pose_make(0, 0, angles[i], 1).rotation.c));
    }
    static const double lengths[] = {NAN, INFINITY, -INFINITY, 0, -0.0, -1};
    for (int i = 0; i < COUNT_OF(lengths); i++)
        assert_true(isnan(dem2d_strain(lengths[i], 1)) && isnan(dem2d_strain(1, lengths[i])));
    assert_int_equal(dem2d_version(), DEM2D_VERSION);
    assert_true(dem2d_rot_angle(dem2d_rot_make(0)) == 0 && dem2d_world_hash(NULL) == 0);
    assert_null(dem2d_world_shape(NULL, f.shape));
    for (int i = 0; i < STALE; i++) assert_null(dem2d_world_shape(f.world, f.stale_shapes[i]));
    fixture_end(&f);
}

/* --- the wrong order ------------------------------------------------------------------------- */

/* What can be asked of a world without contacts: 0, and the bounds of nothing. */
static void check_quiet(const dem2d_world *world, int particles) {
    dem2d_energy e;
    dem2d_stress s;
    dem2d_packing p;
    dem2d_stats n;
    dem2d_particle_id worst = {7, 7};
    dem2d_svg_desc svg = {0};
    uint64_t hash = 0;
    double safe, limit;
    int count = -1;
    svg.write = fingerprint_hash, svg.user = &hash, svg.force_chains = true;
    assert_ok(dem2d_world_energy(world, &e));
    assert_true(e.normal == 0 && e.tangential == 0);
    assert_ok(dem2d_world_stress(world, 1, &s));
    assert_true(s.xx == 0 && s.xy == 0 && s.yx == 0 && s.yy == 0);
    assert_ok(dem2d_world_packing(world, &p));
    assert_true(p.coordination == 0 && p.mean_overlap == 0 && p.max_overlap == 0);
    assert_ok(dem2d_world_contacts(world, NULL, 0, &count));
    assert_int_equal(count, 0);
    assert_ok(dem2d_world_particles(world, NULL, 0, &count));
    assert_int_equal(count, particles);
    assert_ok(dem2d_world_time_step_bounds(world, &safe, &limit, &worst));
    assert_true(limit == HUGE_VAL && (particles > 0 ? safe > 0 && safe < 1 : safe == HUGE_VAL));
    assert_int_equal(worst.generation, 0);
    assert_ok(dem2d_world_stats(world, &n));
    assert_int_equal(n.particles, particles);
    assert_int_equal(n.contacts + n.wall_contacts, 0);
    assert_ok(dem2d_world_write_svg(world, &svg, NULL));
}

/* A world is stepped and asked at every stage of its making. */
static void test_unfinished_worlds(void **state) {
    (void)state;
    test_env env;
    test_env_init(&env);
    const dem2d_world_desc d = good_world(&env.env);
    fixture f;
    int done = -1, steps = 0;
    fixture_make(&f, 0);
    for (int stage = 0; stage < 5; stage++) { /* nothing, material, wall, shape, particle */
        dem2d_world *world;
        dem2d_material_id material;
        dem2d_wall_id wall;
        dem2d_shape_id shape;
        dem2d_particle_id particle;
        dem2d_wall_desc w = good_wall(&f);
        dem2d_particle_desc p = good_particle(&f);
        assert_ok(dem2d_world_create(&d, &world));
        if (stage >= 1) assert_ok(dem2d_world_add_material(world, &good_material, &material));
        if (stage >= 2) w.material = material, assert_ok(dem2d_world_add_wall(world, &w, &wall));
        if (stage >= 3) assert_ok(dem2d_world_add_shape(world, f.ellipse, &shape));
        if (stage >= 4) {
            p.material = material, p.shape = shape;
            assert_ok(dem2d_world_add_particle(world, &p, &particle));
        }
        check_quiet(world, stage >= 4);
        assert_ok(dem2d_world_step(world, 0, &done));
        assert_int_equal(done, 0);
        for (steps = 0; steps < 3; steps++) {
            assert_ok(dem2d_world_step(world, 1, &done));
            assert_int_equal(done, 1);
            check_quiet(world, stage >= 4);
        }
        dem2d_world_destroy(world);
    }
    fixture_end(&f);
    assert_clean(&env);
}

/* What is used by another can't be removed; with the user gone it can, step or no step between. */
static void test_in_use(void **state) {
    (void)state;
    for (int between = 0; between < 2; between++) {
        fixture f;
        dem2d_particle_info info;
        dem2d_particle_id ids[32], id;
        dem2d_shape_id shape;
        int count;
        fixture_make(&f, 30);
        assert_ok(dem2d_world_get_particle(f.world, f.particle, &info));
        fingerprint before = fixture_print(&f);
        assert_result(dem2d_world_remove_shape(f.world, info.shape), DEM2D_IN_USE);
        assert_logged(&f.env, DEM2D_IN_USE, (int)info.shape.index, "shape");
        for (int i = 1; i < 3; i++) {
            assert_result(dem2d_world_remove_wall(f.world, f.walls[i]), DEM2D_IN_USE);
            assert_logged(&f.env, DEM2D_IN_USE, (int)f.walls[i].index, "wall");
        }
        fingerprint after = fixture_print(&f);
        assert_true(fingerprint_same(&before, &after));
        fingerprint_free(&before), fingerprint_free(&after);

        assert_ok(dem2d_world_particles(f.world, ids, 32, &count));
        for (int i = 0; i < count; i++) {
            dem2d_particle_info one;
            assert_ok(dem2d_world_get_particle(f.world, ids[i], &one));
            if (one.shape.index != info.shape.index) continue;
            assert_ok(dem2d_world_remove_particle(f.world, ids[i]));
            assert_result(dem2d_world_remove_particle(f.world, ids[i]), DEM2D_STALE_ID);
        }
        if (between) assert_ok(dem2d_world_step(f.world, 1, NULL));
        assert_ok(dem2d_world_remove_shape(f.world, info.shape));
        assert_result(dem2d_world_remove_shape(f.world, info.shape), DEM2D_STALE_ID);
        assert_ok(dem2d_world_remove_wall(f.world, f.walls[3]));
        for (int i = 0; i < 3; i++) assert_ok(dem2d_world_remove_wall(f.world, f.walls[i]));
        fingerprint none = fingerprint_take(f.world, NULL, 0); /* every query still answers */
        fingerprint_free(&none);
        if (between) assert_ok(dem2d_world_step(f.world, 1, NULL));
        assert_ok(dem2d_world_add_shape(f.world, f.polygon, &shape)); /* in the free slot */
        assert_int_equal(shape.index < 5, 1);
        dem2d_particle_desc p = good_particle(&f);
        p.shape = shape, p.position = vec(0.2, 0.2);
        assert_ok(dem2d_world_add_particle(f.world, &p, &id));
        assert_ok(dem2d_world_step(f.world, 20, NULL));
        fixture_end(&f);
    }
}

/* Everything is removed from a world with contacts; then it is empty and can be filled again. */
static void test_emptied(void **state) {
    (void)state;
    fixture f;
    dem2d_particle_id ids[32], id;
    int count;
    fixture_make(&f, 30);
    assert_ok(dem2d_world_particles(f.world, ids, 32, &count));
    for (int i = 0; i < count; i++) assert_ok(dem2d_world_remove_particle(f.world, ids[i]));
    check_quiet(f.world, 0);
    assert_ok(dem2d_world_step(f.world, 2, NULL));
    check_quiet(f.world, 0);
    dem2d_particle_desc p = good_particle(&f);
    for (int i = 0; i < count; i++) {
        p.position = vec(0.06 + 0.05 * (i % 6), 0.06 + 0.05 * (i / 6));
        assert_ok(dem2d_world_add_particle(f.world, &p, &id));
    }
    assert_ok(dem2d_world_step(f.world, 20, NULL));
    dem2d_stats n;
    assert_ok(dem2d_world_stats(f.world, &n));
    assert_true(n.particles == count && n.contacts > 0);
    fixture_end(&f);
}

/* Particles whose mass or moment would be no number, and the 257th material. */
static void test_limits(void **state) {
    (void)state;
    static const double scales[] = {1e200, 1e-200, 1e-100, 1e90};
    fixture f, twin;
    dem2d_particle_id id = {77, 77};
    dem2d_material_id material = {77, 77};
    fixture_make(&f, 30);
    fixture_make(&twin, 30);
    for (int i = 0; i < COUNT_OF(scales); i++) {
        dem2d_particle_desc p = good_particle(&f);
        p.scale = scales[i];
        assert_result(dem2d_world_add_particle(f.world, &p, &id), DEM2D_OUT_OF_RANGE);
        assert_logged(&f.env, DEM2D_OUT_OF_RANGE, -1, "scale");
        assert_int_equal(id.index, 77);
    }
    check_goes_on(&f, &twin);
    for (int i = 2; i < 256; i++)
        for (int k = 0; k < 2; k++)
            assert_ok(
                dem2d_world_add_material(k == 0 ? twin.world : f.world, &good_material, &material));
    assert_int_equal(material.index, 255);
    assert_result(dem2d_world_add_material(f.world, &good_material, &material), DEM2D_OUT_OF_RANGE);
    assert_int_equal(material.index, 255);
    check_goes_on(&f, &twin);
    fixture_end(&f);
    fixture_end(&twin);
}

/* --- calls within a step ----------------------------------------------------------------------
   Every function of a world is called by the callback that sets loads, with good arguments. Those
   that change the world are refused; the step and all that follow are as if none had been called. */

static const char *const refused_within[] = {"world_add_shape",
                                             "world_remove_shape",
                                             "world_add_material",
                                             "world_set_pair",
                                             "world_add_particle",
                                             "world_remove_particle",
                                             "world_move_particle",
                                             "world_drive_particle",
                                             "world_set_groups",
                                             "world_set_user_data",
                                             "world_add_wall",
                                             "world_set_wall",
                                             "world_drive_wall",
                                             "world_remove_wall",
                                             "world_set_gravity",
                                             "world_set_damping",
                                             "world_deform",
                                             "world_set_time_step",
                                             "world_set_material",
                                             "world_set_shape",
                                             "world_relax",
                                             "world_step",
                                             "world_write_particles",
                                             "world_fill",
                                             "world_remove_in",
                                             "world_feed",
                                             "world_grow"};
static int refusals;

static bool is_refused_within(const function *of) {
    for (int k = 0; k < COUNT_OF(refused_within); k++)
        if (strcmp(refused_within[k], of->name) == 0) return true;
    return false;
}

static bool is_of_world(const function *of) {
    for (int i = 0; i < of->count; i++)
        if (of->rows[i].offset == offsetof(args, world) && of->rows[i].kind == POINTER) return true;
    return false;
}

static void call_within(fixture *f) {
    static args v;
    for (int i = 0; i < COUNT_OF(functions); i++) {
        const function *of = &functions[i];
        const bool refused = is_refused_within(of);
        if (!is_of_world(of) || strcmp(of->name, "world_set_load") == 0) continue;
        args_make(&v, f);
        of->prepare(&v, f);
        const args before = v;
        const uint64_t hash = dem2d_world_hash(f->world);
        f->env.log.count = 0;
        const dem2d_result result = of->call(&v);
        if (dem2d_world_hash(f->world) != hash) fail_msg("dem2d_%s changes the hash", of->name);
        if (!refused) continue;
        const bool steps = strcmp(of->name, "world_step") == 0; /* none was done */
        if (result != DEM2D_IN_USE || (!steps && memcmp(&before, &v, sizeof v) != 0))
            fail_msg("dem2d_%s in a step: %s", of->name, dem2d_result_text(result));
        assert_logged(&f->env, DEM2D_IN_USE, -1, "callback of a step");
        refusals++;
    }
}

static void test_within_a_step(void **state) {
    fixture f, twin;
    (void)state;
    fixture_make(&f, 30);
    fixture_make(&twin, 30);
    refusals = 0;
    f.within = call_within;
    assert_ok(dem2d_world_step(f.world, 1, NULL));
    f.within = NULL;
    assert_int_equal(refusals, COUNT_OF(refused_within));
    assert_ok(dem2d_world_step(twin.world, 1, NULL));
    check_goes_on(&f, &twin);
    fixture_end(&f);
    fixture_end(&twin);
}

int main(void) {
    static struct CMUnitTest tests[COUNT_OF(functions) + 9];
    const struct CMUnitTest others[] = {
        cmocka_unit_test(test_all_functions), cmocka_unit_test(test_all_descs),
        cmocka_unit_test(test_others),        cmocka_unit_test(test_unfinished_worlds),
        cmocka_unit_test(test_in_use),        cmocka_unit_test(test_emptied),
        cmocka_unit_test(test_limits),        cmocka_unit_test(test_extremes),
        cmocka_unit_test(test_within_a_step),
    };
    size_t count = 0;
    for (int i = 0; i < COUNT_OF(functions); i++) {
        tests[count].name = functions[i].name;
        tests[count].test_func = test_function;
        union {
            const function *in;
            void *out;
        } row = {&functions[i]};
        tests[count++].initial_state = row.out;
    }
    for (int i = 0; i < COUNT_OF(others); i++) tests[count++] = others[i];
    return _cmocka_run_group_tests("misuse", tests, count, make_descs, NULL);
}
