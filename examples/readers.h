/* readers.h - outlines of grains: from files of points (CSV), from images (Netpbm), from folders of
   these, or made here; and the options that say what to look for in an image. */
#ifndef DEM2D_EXAMPLES_READERS_H
#define DEM2D_EXAMPLES_READERS_H

#include "program.h"
#include "random.h"

/* ---- reading: whole files, CSV outlines, Netpbm images ---- */

typedef struct outline {
    dem2d_vec *points;
    int count;
    char *name; // for messages
} outline;

/* Grey levels, row 0 on top: of one byte, from 0 to 255, or of two, as they are in the file. */
typedef struct image {
    uint8_t *pixels; // NULL with the other
    int width, height;
    uint16_t *pixels16;
} image;

static inline void free_image(image *picture) {
    free(picture->pixels);
    free(picture->pixels16);
}

/* All bytes of a file; the caller frees them. The limit is that of the largest raw image. */
static inline char *read_whole(const char *path, size_t *count) {
    const size_t most = ((size_t)1 << 31) + ((size_t)1 << 20);
    FILE *file = fopen(path, "rb");
    if (file == NULL) fail(STATUS_BAD_INPUT, "cannot open %s: %s", path, strerror(errno));
    char *bytes = NULL;
    size_t room = 0, got = 0;
    errno = 0;
    while (!feof(file) && !ferror(file) && got <= most) {
        if (got == room) {
            room = 2 * room + 65536;
            bytes = get_memory(bytes, room, 1);
        }
        got += fread(bytes + got, 1, room - got, file);
    }
    const int reason = errno;
    const bool bad = ferror(file) != 0;
    fclose(file);
    if (bad || got > most) free(bytes);
    if (bad) fail(STATUS_BAD_INPUT, "cannot read %s: %s", path, strerror(reason));
    if (got > most) fail(STATUS_BAD_INPUT, "%s: more than 2 GiB", path);
    *count = got;
    return bytes;
}

/* What is left of a buffer. The parsers below see nothing but it and answer with what is wrong, or
   NULL; they write their result only when nothing is. */
typedef struct rest {
    const char *at, *end;
} rest;

static inline rest rest_make(const char *bytes, size_t count) {
    const rest r = {bytes, bytes + count};
    return r;
}

/* Next line without its end (LF or CRLF); false when nothing is left. */
static inline bool next_line(rest *r, rest *line) {
    if (r->at == r->end) return false;
    const char *stop = memchr(r->at, '\n', (size_t)(r->end - r->at));
    line->at = r->at;
    line->end = stop != NULL ? stop : r->end;
    r->at = stop != NULL ? stop + 1 : r->end;
    if (line->end > line->at && line->end[-1] == '\r') line->end--;
    return true;
}

/* One finite decimal number of this many characters. Hex, inf, nan and blanks are not taken. */
static inline bool parse_decimal(const char *text, size_t length, double *value) {
    static const char allowed[] = "0123456789+-.eE";
    char copy[400], *end; // with an end for strtod; 1e308 in full has 309 digits
    if (length == 0 || length >= sizeof copy) return false;
    memcpy(copy, text, length);
    copy[length] = '\0';
    *value = strtod(copy, &end);
    return strspn(copy, allowed) == length && end == copy + length && isfinite(*value);
}

static inline bool is_blank(char c) {
    return c == ' ' || c == '\t';
}

/* Next field of a line, without blanks and quotes around it; false when nothing is left, which is
   where `at` is NULL. */
static inline bool next_field(rest *line, char separator, rest *field) {
    if (line->at == NULL) return false;
    const char *stop = memchr(line->at, separator, (size_t)(line->end - line->at));
    field->at = line->at;
    field->end = stop != NULL ? stop : line->end;
    line->at = stop != NULL ? stop + 1 : NULL;
    while (field->at < field->end && is_blank(field->at[0])) field->at++;
    while (field->at < field->end && is_blank(field->end[-1])) field->end--;
    if (field->end - field->at >= 2 && field->at[0] == '"' && field->end[-1] == '"') {
        field->at++;
        field->end--;
    }
    return true;
}

/* What the first line of an outline's file says. */
typedef struct outline_columns {
    int x, y, count; // x and y: which of them
    char separator;
} outline_columns;

/* A line that names the columns x and y, once each, in any order and among others, separated by
   commas, semicolons or tabs: the first of semicolon, tab, comma that the line has. */
static inline bool parse_columns(rest line, outline_columns *result) {
    outline_columns c = {-1, -1, 0, ','};
    rest field;
    const size_t length = (size_t)(line.end - line.at);
    if (length > 0 && memchr(line.at, '\t', length) != NULL) c.separator = '\t';
    if (length > 0 && memchr(line.at, ';', length) != NULL) c.separator = ';';
    for (; next_field(&line, c.separator, &field); c.count++) {
        if (field.end - field.at != 1) continue;
        const char name = field.at[0] | 0x20; // ASCII: the small letter
        if ((name == 'x' && c.x >= 0) || (name == 'y' && c.y >= 0)) return false;
        if (name == 'x') c.x = c.count;
        if (name == 'y') c.y = c.count;
    }
    *result = c;
    return c.x >= 0 && c.y >= 0;
}

/* Past a byte-order mark. */
static inline rest outline_rest(const char *bytes, size_t count) {
    const bool mark = count >= 3 && memcmp(bytes, "\xEF\xBB\xBF", 3) == 0;
    return rest_make(bytes + (mark ? 3 : 0), count - (mark ? 3 : 0));
}

static inline bool is_outline(const char *bytes, size_t count) {
    rest r = outline_rest(bytes, count), line = r;
    outline_columns unused;
    return next_line(&r, &line) && parse_columns(line, &unused);
}

/* A number; where no comma separates it may have one for its point. */
static inline bool parse_coordinate(rest field, char separator, double *value) {
    char copy[400];
    const size_t length = (size_t)(field.end - field.at);
    if (length == 0 || length >= sizeof copy) return false;
    memcpy(copy, field.at, length);
    char *comma = separator != ',' ? memchr(copy, ',', length) : NULL;
    if (comma != NULL) *comma = '.';
    return parse_decimal(copy, length, value);
}

/* As many fields as columns, x and y of them. */
static inline bool parse_point(rest line, const outline_columns *c, dem2d_vec *p) {
    rest field;
    int count = 0;
    bool good = true;
    for (; next_field(&line, c->separator, &field); count++) {
        if (count == c->x) good = good && parse_coordinate(field, c->separator, &p->x);
        if (count == c->y) good = good && parse_coordinate(field, c->separator, &p->y);
    }
    return good && count == c->count;
}

/* A line that names x and y, then a point on each; blank lines at the end only. A last point that
   is the first again is left out. *number is the offending line, 0 for the file as a whole. */
static inline const char *parse_outline(const char *bytes, size_t count, outline *result,
                                        int *number) {
    rest r = outline_rest(bytes, count), line = r;
    outline made = {NULL, 0, NULL};
    outline_columns c;
    const char *wrong = NULL;
    bool blank = false;
    *number = 1;
    if (!next_line(&r, &line) || !parse_columns(line, &c)) return "expected \"x,y\"";
    while (wrong == NULL && next_line(&r, &line)) {
        (*number)++;
        if (line.at == line.end) {
            blank = true;
            continue;
        }
        dem2d_vec p;
        if (blank || !parse_point(line, &c, &p)) {
            wrong = "expected two finite numbers";
        } else if (made.count == 10000000) {
            wrong = "too many points";
        } else {
            if ((made.count & (made.count - 1)) == 0) // at powers of 2: room for twice as many
                made.points = get_memory(made.points, 2 * (size_t)made.count + 1, sizeof p);
            made.points[made.count++] = p;
        }
    }
    if (wrong == NULL) *number = 0;
    if (made.count > 1 && made.points[0].x == made.points[made.count - 1].x &&
        made.points[0].y == made.points[made.count - 1].y)
        made.count--;
    if (wrong == NULL && made.count < 3) wrong = "an outline needs 3 points or more";
    if (wrong != NULL)
        free(made.points);
    else
        *result = made;
    return wrong;
}

static inline bool is_space(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/* Past white space and comments, which go from # to the end of the line. */
static inline void skip_space(rest *r) {
    for (bool comment = false; r->at < r->end; r->at++) {
        if (*r->at == '#') comment = true;
        if (*r->at == '\n' || *r->at == '\r') comment = false;
        if (!comment && !is_space(*r->at)) return;
    }
}

/* Next natural number; -1 when there is none, most + 1 when it is above `most`. */
static inline int next_natural(rest *r, int most) {
    int value = -1;
    skip_space(r);
    for (; r->at < r->end && *r->at >= '0' && *r->at <= '9'; r->at++) {
        if (value < 0) value = 0;
        if (value <= most) value = 10 * value + (*r->at - '0');
        if (value > most) value = most + 1;
    }
    return value;
}

enum { IMAGE_SIDE = 32768 }; // px; ten times this still fits an int

static inline bool is_image(const char *bytes, size_t count) {
    return count >= 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '7' &&
           (count == 2 || is_space(bytes[2]) || bytes[2] == '#');
}

/* Up to the last number; `most` is the greatest sample, 1 for bits. */
static inline const char *parse_image_header(rest *r, int *format, image *made, int *most) {
    if (!is_image(r->at, (size_t)(r->end - r->at))) return "not a Netpbm image";
    *format = r->at[1] - '0';
    if (*format == 3 || *format > 5) return "a colour image or PAM; PBM and PGM can be read";
    r->at += 2;
    made->width = next_natural(r, IMAGE_SIDE);
    made->height = next_natural(r, IMAGE_SIDE);
    if (made->width < 0 || made->height < 0) return "no width and height in the header";
    if (made->width < 1 || made->width > IMAGE_SIDE || made->height < 1 ||
        made->height > IMAGE_SIDE)
        return "width and height must be from 1 to 32768";
    *most = *format == 1 || *format == 4 ? 1 : next_natural(r, 65535);
    if (*most < 0) return "no greatest value in the header";
    if (*most < 1 || *most > 65535) return "the greatest value must be from 1 to 65535";
    return NULL;
}

/* Puts a sample: of one byte scaled to 255, of two as it is. */
static inline void put_sample(image *made, size_t i, unsigned value, unsigned most) {
    if (made->pixels16 != NULL)
        made->pixels16[i] = (uint16_t)value;
    else
        made->pixels[i] = (uint8_t)((value * 255 + most / 2) / most);
}

/* Samples written as decimal numbers, bits also without white space between them. */
static inline const char *parse_plain_samples(rest *r, int most, bool bits, image *made) {
    const size_t samples = (size_t)made->width * (size_t)made->height;
    for (size_t i = 0; i < samples; i++) {
        int value;
        skip_space(r);
        if (r->at == r->end) return "truncated: less data than the header says";
        if (bits)
            value = *r->at == '0' || *r->at == '1' ? *r->at++ - '0' : -1;
        else
            value = next_natural(r, most);
        if (value < 0) return "a sample is not a number";
        if (value > most) return "a sample is above the greatest value";
        put_sample(made, i, bits ? 1 - (unsigned)value : (unsigned)value,
                   (unsigned)most); // 1: black
    }
    return NULL;
}

/* Samples of one or two bytes, high byte first, or bits, high bit first, in whole bytes a row. */
static inline const char *parse_raw_samples(rest *r, int most, bool bits, image *made) {
    const unsigned top = (unsigned)most;
    const uint8_t *in = (const uint8_t *)r->at;
    size_t i = 0;
    for (int row = 0; row < made->height; row++) {
        for (int column = 0; column < made->width; column++) {
            unsigned value;
            if (bits) {
                value = (unsigned)in[column / 8] >> (7 - column % 8) & 1;
                put_sample(made, i++, 1 - value, 1); // 1 is black
                continue;
            }
            value = *in++;
            if (most > 255) value = value << 8 | *in++;
            if (value > top) return "a sample is above the greatest value";
            put_sample(made, i++, value, top);
        }
        if (bits) in += (made->width + 7) / 8;
    }
    r->at = (const char *)in;
    return NULL;
}

/* Netpbm P1, P2, P4, P5: to 8 bits, black bits 0, white ones 255; or, if the header has a greatest
   value above 255, two bytes as they are: many files have values of 12 bits and say 65535. Memory
   is asked for only when the buffer is long enough for the pixels. */
static inline const char *parse_image(const char *bytes, size_t count, image *result) {
    rest r = rest_make(bytes, count);
    image made = {NULL, 0, 0, NULL};
    int format, most;
    const char *wrong = parse_image_header(&r, &format, &made, &most);
    if (wrong != NULL) return wrong;
    const size_t columns = (size_t)made.width, rows = (size_t)made.height;
    const bool bits = format == 1 || format == 4, raw = format >= 4;
    size_t least = bits ? columns * rows : 2 * columns * rows - 1; // plain
    if (raw) least = bits ? (columns + 7) / 8 * rows : columns * rows * (most > 255 ? 2 : 1);
    if (raw && r.at < r.end) { // one white space ends the header, or a comment
        if (*r.at == '#')
            while (r.at < r.end && *r.at != '\n' && *r.at != '\r') r.at++;
        else if (!is_space(*r.at))
            return "no white space after the header";
        r.at += r.at < r.end;
    }
    if ((size_t)(r.end - r.at) < least) return "truncated: less data than the header says";
    if (most > 255)
        made.pixels16 = get_memory(NULL, columns * rows, sizeof *made.pixels16);
    else
        made.pixels = get_memory(NULL, columns, rows);
    wrong =
        raw ? parse_raw_samples(&r, most, bits, &made) : parse_plain_samples(&r, most, bits, &made);
    skip_space(&r);
    if (wrong == NULL && r.at < r.end) wrong = "more data than the header says";
    if (wrong != NULL)
        free_image(&made);
    else
        *result = made;
    return wrong;
}

/* ---- grains: from images, outlines, directories, or made here ---- */

typedef struct outline_list {
    outline *items;
    int count;
} outline_list;

/* Puts a copy of an outline at the end; number 0 for the only one of a file. */
static inline void list_outline(outline_list *list, const dem2d_vec *points, int count,
                                const char *path, int number) {
    char text[32];
    list->items = get_memory(list->items, (size_t)list->count + 1, sizeof *list->items);
    outline *o = &list->items[list->count++];
    o->points = get_memory(NULL, (size_t)count, sizeof *points);
    o->count = count;
    memcpy(o->points, points, (size_t)count * sizeof *points);
    snprintf(text, sizeof text, ", grain %d", number);
    o->name = join_text(path, "", number > 0 ? text : "");
}

static inline void free_outlines(outline_list *list) {
    for (int i = 0; i < list->count; i++) {
        free(list->items[i].points);
        free(list->items[i].name);
    }
    free(list->items);
}

/* Options for what is looked for in images: names, as parse_option takes them, and their text for
   --help. */
enum { SEARCH_CROP, SEARCH_LABELS, SEARCH_IGNORE_FRAME, SEARCH_OPTIONS };
#define SEARCH_NAMES "--crop=", "--labels", "--ignore-frame"
#define SEARCH_USAGE                                                                              \
    "  --crop X,Y,W,H     image: look at W by H pixels only, X from the left, Y from the top; 0 " \
    "for\n"                                                                                       \
    "                     W or H: all the rest (0,0,0,0)\n"                                       \
    "  --labels           image: a label mask, each grain of a grey value of its own on 0\n"      \
    "  --ignore-frame     image: a frame has no say in the threshold\n"

/* All but the pixels: one metre per pixel. */
static inline dem2d_image_desc default_search(void) {
    dem2d_image_desc search = {0};
    search.scale = 1;
    return search;
}

static inline void parse_crop(const char *text, dem2d_image_desc *search) {
    int *const fields[4] = {&search->crop_left, &search->crop_top, &search->crop_width,
                            &search->crop_height};
    rest line = rest_make(text, strlen(text)), field;
    for (int i = 0; i < 4 || line.at != NULL; i++) {
        const bool there = i < 4 && next_field(&line, ',', &field);
        if (there) *fields[i] = next_natural(&field, IMAGE_SIDE);
        if (!there || *fields[i] < 0 || *fields[i] > IMAGE_SIDE || field.at != field.end)
            fail(STATUS_BAD_INPUT, "--crop %s: expected X,Y,W,H of whole pixels up to %d", text,
                 IMAGE_SIDE);
    }
}

/* One of these options. */
static inline void take_search(int which, const char *value, dem2d_image_desc *search) {
    if (which == SEARCH_CROP) parse_crop(value, search);
    if (which == SEARCH_LABELS) search->labels = true;
    if (which == SEARCH_IGNORE_FRAME) search->ignore_frame = true;
}

/* The outlines of an image's grains; `search` has all but the pixels. */
static inline void list_image(outline_list *list, const image *picture,
                              const dem2d_image_desc *search, const char *path) {
    dem2d_image_desc desc = *search;
    dem2d_outline_set *found;
    desc.pixels = picture->pixels;
    desc.pixels16 = picture->pixels16;
    desc.width = picture->width;
    desc.height = picture->height;
    need(dem2d_image_outlines(example_env(), &desc, &found), STATUS_BAD_INPUT, path);
    for (int i = 0; i < dem2d_outline_set_count(found); i++) {
        dem2d_outline o;
        must(dem2d_outline_set_get(found, i, &o), path);
        list_outline(list, o.points, o.count, path, i + 1);
    }
    dem2d_outline_set_destroy(found);
}

static inline bool ends_with(const char *name, const char *ending) {
    const size_t length = strlen(name), tail = strlen(ending);
    return length >= tail && strcmp(name + length - tail, ending) == 0;
}

static inline bool is_csv_name(const char *name) {
    return ends_with(name, ".csv");
}

static inline bool is_image_name(const char *name) {
    return ends_with(name, ".pbm") || ends_with(name, ".pgm") || ends_with(name, ".pnm");
}

/* What a file turned out to be. */
typedef enum file_kind { FILE_OTHER, FILE_OUTLINE, FILE_IMAGE } file_kind;

/* Adds the outlines of a file: of all grains of an image, or the one of a CSV file. OTHER, and
   nothing added, for a file that starts like neither. One that starts well and goes on otherwise
   ends the program. */
static inline file_kind read_grains(const char *path, const dem2d_image_desc *search,
                                    outline_list *list) {
    size_t count;
    char *bytes = read_whole(path, &count);
    const char *wrong = NULL;
    outline o = {NULL, 0, NULL};
    image picture = {NULL, 0, 0, NULL};
    int line = 0;
    file_kind kind = is_outline(bytes, count) ? FILE_OUTLINE : FILE_OTHER;
    if (is_image_name(path) || is_image(bytes, count)) kind = FILE_IMAGE;
    if (kind == FILE_OUTLINE) wrong = parse_outline(bytes, count, &o, &line);
    if (kind == FILE_IMAGE) wrong = parse_image(bytes, count, &picture);
    free(bytes);
    if (wrong != NULL && line > 0) fail(STATUS_BAD_INPUT, "%s, line %d: %s", path, line, wrong);
    if (wrong != NULL) fail(STATUS_BAD_INPUT, "%s: %s", path, wrong);
    if (kind == FILE_OUTLINE) {
        list_outline(list, o.points, o.count, path, 0);
        free(o.points);
    }
    if (kind == FILE_IMAGE) {
        list_image(list, &picture, search, path);
        free_image(&picture);
    }
    return kind;
}

/* A lumpy grain: r(t) = 1 + sum over n = 2..5 of size[n - 2] cos(n t + phase[n - 2]). */
static inline void list_lumpy(outline_list *list, const double size[4], const double phase[4],
                              const char *name, int number) {
    enum { POINTS = 120 };
    dem2d_vec points[POINTS];
    for (int i = 0; i < POINTS; i++) {
        const double angle = 6.283185307179586 * i / POINTS;
        double radius = 1;
        for (int n = 2; n <= 5; n++)
            radius += size[n - 2] * dem2d_rot_make(n * angle + phase[n - 2]).c;
        const dem2d_rot direction = dem2d_rot_make(angle);
        points[i].x = radius * direction.c;
        points[i].y = radius * direction.s;
    }
    list_outline(list, points, POINTS, name, number);
}

/* A few grains for those who have none. */
enum { SELF_MADE = 4 };

static inline void list_self_made(outline_list *list, int which) {
    static const double size[SELF_MADE][4] = {{0.16, 0.05, 0.02, 0.010},
                                              {0.08, 0.08, 0.03, 0.015},
                                              {0.22, 0.03, 0.03, 0.005},
                                              {0.04, 0.04, 0.05, 0.020}};
    static const double phase[SELF_MADE][4] = {
        {0.0, 0.7, 1.9, 0.3}, {1.1, 2.6, 0.4, 5.0}, {2.0, 4.4, 3.1, 1.2}, {0.6, 5.7, 2.2, 3.9}};
    list_lumpy(list, size[which], phase[which], "self-made outline", which + 1);
}

/* The outlines of all CSV files in a directory; when none of them is an outline, those of the
   grains in its images. */
static inline void list_grains(const char *directory, const dem2d_image_desc *search,
                               outline_list *list) {
    int skipped = 0;
    for (int pass = 0; pass < 2 && list->count == 0; pass++) {
        int count;
        char **names = list_directory(directory, pass == 0 ? is_csv_name : is_image_name, &count);
        for (int i = 0; i < count; i++) {
            char *path = join_text(directory, "/", names[i]);
            if (read_grains(path, search, list) == FILE_OTHER) skipped++;
            free(path);
            free(names[i]);
        }
        free(names);
    }
    if (skipped > 0 && list->count > 0)
        fprintf(stderr, "%s: skipped %d CSV file%s in %s: first line does not name x and y\n",
                example_name, skipped, skipped == 1 ? "" : "s", directory);
}

/* The grains of an image or outline, of a directory, or (NULL) self-made ones. */
static inline outline_list load_grains(const char *path, const dem2d_image_desc *search) {
    outline_list list = {NULL, 0};
    struct stat status;
    for (int i = 0; path == NULL && i < SELF_MADE; i++) list_self_made(&list, i);
    if (path == NULL) return list;
    if (stat(path, &status) == 0 && S_ISDIR(status.st_mode))
        list_grains(path, search, &list);
    else
        read_grains(path, search, &list);
    if (list.count == 0)
        fail(STATUS_BAD_INPUT,
             "no outline (CSV, first line \"x,y\") and no grain of an image in %s", path);
    return list;
}

#endif
