/* test_readers.c - the files that the examples read: Netpbm images and CSV outlines, good and bad.
 */
#define _POSIX_C_SOURCE 200809L
#include "dem2d.h"
#include "../examples/grains.h" /* first: its fail() is a function, cmocka's a macro */
#include "testing.h"

#include <float.h>

#include <sys/wait.h>

/* A text with zeros in it and its size. */
#define BYTES(text) text, sizeof text - 1

/* A copy without an end, so that the sanitizers see any byte read behind it. */
static char *exact_copy(const char *bytes, size_t size) {
    char *copy = malloc(size > 0 ? size : 1);
    assert_non_null(copy);
    if (size > 0) memcpy(copy, bytes, size);
    return copy;
}

/* --- images ---------------------------------------------------------------------------------- */

typedef struct image_case {
    const char *bytes;
    size_t size;
    int width, height;
    uint16_t values[12]; /* of one byte, or of two where the header says more than 255 */
} image_case;

static const image_case good_images[] = {
    {BYTES("P1\n3 2\n0 1 0\n1 1 0\n"), 3, 2, {255, 0, 255, 0, 0, 255}},
    {BYTES("P1 3 2 010110"), 3, 2, {255, 0, 255, 0, 0, 255}},
    {BYTES("P1#a\r\n#b # c\n\t3#\n\v\f2#\n0#1\n10\r\n110 # end"), 3, 2, {255, 0, 255, 0, 0, 255}},
    {BYTES("P2 3 1 255 0 128 255"), 3, 1, {0, 128, 255}},
    {BYTES("P2\n1\n3\n# grey\n15\n0\n7\n15\n"), 1, 3, {0, 119, 255}},
    {BYTES("P2 3 1 1 0 1 01"), 3, 1, {0, 255, 255}},
    {BYTES("P2 4 1 65535 0 65535 32768 128"), 4, 1, {0, 65535, 32768, 128}},
    {BYTES("P4\n10 1\n\x40\x80"), 10, 1, {255, 0, 255, 255, 255, 255, 255, 255, 0, 255}},
    {BYTES("P4 1 3\n\x80\x7f\xff"), 1, 3, {0, 255, 0}},
    {BYTES("P5\n2 2\n255\n\x00\x01\x80\xff"), 2, 2, {0, 1, 128, 255}},
    {BYTES("P5 2 1 255#comment\n\n\n"), 2, 1, {10, 10}}, /* the comment ends the header */
    {BYTES("P5 3 1 255\n#\n "), 3, 1, {35, 10, 32}},     /* pixels, not a comment */
    {BYTES("P5 2 1 255\n\x07\x08\r\n"), 2, 1, {7, 8}},   /* a line end behind them */
    {BYTES("P5 3 1 100\n\x00\x32\x64"), 3, 1, {0, 128, 255}},
    {BYTES("P5 2 2 65535\n\x00\x00\xff\xff\x80\x80\x01\x01"), 2, 2, {0, 65535, 0x8080, 0x0101}},
    {BYTES("P5 2 1 256\n\x01\x00\x00\x80"), 2, 1, {256, 128}},
    {BYTES("P5 2 1 65535\n\x0f\xff\x00\x01"), 2, 1, {4095, 1}}, /* of 12 bits */
};

static void test_good_images(void **state) {
    (void)state;
    for (int i = 0; i < COUNT_OF(good_images); i++) {
        const image_case *c = &good_images[i];
        char *bytes = exact_copy(c->bytes, c->size);
        image made;
        const char *wrong = parse_image(bytes, c->size, &made);
        if (wrong != NULL) print_error("image %d: %s\n", i, wrong);
        assert_null(wrong);
        assert_int_equal(made.width, c->width);
        assert_int_equal(made.height, c->height);
        for (int k = 0; k < c->width * c->height; k++)
            assert_int_equal(made.pixels != NULL ? made.pixels[k] : made.pixels16[k], c->values[k]);
        assert_true((made.pixels == NULL) != (made.pixels16 == NULL));
        assert_true(is_image(bytes, c->size));
        free_image(&made);
        free(bytes);
    }
}

typedef struct bad_case {
    const char *bytes;
    size_t size;
    const char *wrong; /* the start of the message */
} bad_case;

static const bad_case bad_images[] = {
    {BYTES(""), "not a Netpbm"},
    {BYTES("P"), "not a Netpbm"},
    {BYTES("P0 1 1 0"), "not a Netpbm"},
    {BYTES("P11 1 0"), "not a Netpbm"},
    {BYTES("\x89PNG\r\n"), "not a Netpbm"},
    {BYTES("P3 1 1 255 0 0 0"), "a colour image"},
    {BYTES("P6 1 1 255 abc"), "a colour image"},
    {BYTES("P7\nWIDTH 1"), "a colour image"},
    {BYTES("P5"), "no width and height"},
    {BYTES("P5 10"), "no width and height"},
    {BYTES("P5 -1 1 255 "), "no width and height"},
    {BYTES("P5 # 1 1 255"), "no width and height"},
    {BYTES("P5 0 1 255\n"), "width and height must"},
    {BYTES("P5 1 32769 255\n"), "width and height must"},
    {BYTES("P5 4294967297 1 255\n1"), "width and height must"},
    {BYTES("P5 99999999999999999999 1 255\n1"), "width and height must"},
    {BYTES("P5 1 1"), "no greatest value"},
    {BYTES("P5 1 1 x"), "no greatest value"},
    {BYTES("P5 1 1 0\n1"), "the greatest value"},
    {BYTES("P5 1 1 65536\n12"), "the greatest value"},
    {BYTES("P5 1 1 255"), "truncated"},
    {BYTES("P5 1 1 255x1"), "no white space"},
    {BYTES("P4 1 1x"), "no white space"},
    {BYTES("P5 2 2 255\n123"), "truncated"},
    {BYTES("P5 2 2 256\n1234567"), "truncated"},
    {BYTES("P5 32768 32768 65535\n"), "truncated"},
    {BYTES("P4 9 2\n123"), "truncated"},
    {BYTES("P4 32768 32768 "), "truncated"},
    {BYTES("P1 2 2 011"), "truncated"},
    {BYTES("P1 2 2 0 1 1    "), "truncated"},
    {BYTES("P1 32768 32768 0 1"), "truncated"},
    {BYTES("P2 2 1 9 1"), "truncated"},
    {BYTES("P2 2 1 9 1 # 2"), "truncated"},
    {BYTES("P5 2 1 9\n\x01\x0a"), "a sample is above"},
    {BYTES("P5 1 1 256\n\x01\x01"), "a sample is above"},
    {BYTES("P2 2 1 9 1 10"), "a sample is above"},
    {BYTES("P2 2 1 9 1 99999999999999999999"), "a sample is above"},
    {BYTES("P2 2 1 9 1 -1"), "a sample is not"},
    {BYTES("P2 2 1 9 1.5 1"), "a sample is not"},
    {BYTES("P1 2 1 02"), "a sample is not"},
    {BYTES("P1 2 1 011"), "more data"},
    {BYTES("P2 1 1 9 1 1"), "more data"},
    {BYTES("P5 1 1 255\n12"), "more data"},
    {BYTES("P4 8 1\n12"), "more data"},
};

static void test_bad_images(void **state) {
    (void)state;
    for (int i = 0; i < COUNT_OF(bad_images); i++) {
        const bad_case *c = &bad_images[i];
        char *bytes = exact_copy(c->bytes, c->size);
        image made = {NULL, 7, 7, NULL};
        const char *wrong = parse_image(bytes, c->size, &made);
        if (wrong == NULL || strncmp(wrong, c->wrong, strlen(c->wrong)) != 0)
            print_error("image %d: %s, expected %s\n", i, wrong != NULL ? wrong : "(good)",
                        c->wrong);
        assert_non_null(wrong);
        assert_memory_equal(wrong, c->wrong, strlen(c->wrong));
        assert_true(made.pixels == NULL && made.width == 7 && made.height == 7);
        free(bytes);
    }
}

/* Any shorter part of a good image is bad, but for the white space at its end. */
static void test_cut_images(void **state) {
    (void)state;
    static const bad_case whole[] = {{BYTES("P1 3 2 010110"), NULL},
                                     {BYTES("P2 3 1 9 0 8 9"), NULL},
                                     {BYTES("P4 10 2\n1234"), NULL},
                                     {BYTES("P5 2 2 255 1234"), NULL},
                                     {BYTES("P5 2 1 999 \x01\x02\x03\x04"), NULL}};
    for (int i = 0; i < COUNT_OF(whole); i++)
        for (size_t size = 0; size <= whole[i].size; size++) {
            char *bytes = exact_copy(whole[i].bytes, size);
            image made = {NULL, 0, 0, NULL};
            const char *wrong = parse_image(bytes, size, &made);
            assert_int_equal(wrong == NULL, size == whole[i].size);
            free_image(&made);
            free(bytes);
        }
}

/* No grey of 16 bits is changed, and none of 8. */
static void test_grey_levels(void **state) {
    (void)state;
    enum { SIDE = 256 };
    static char bytes[2 * SIDE * SIDE + 32];
    image made;
    int head = sprintf(bytes, "P5 %d %d 65535\n", SIDE, SIDE);
    for (int v = 0; v < SIDE * SIDE; v++) {
        bytes[head + 2 * v] = (char)(uint8_t)(v / 256);
        bytes[head + 2 * v + 1] = (char)(uint8_t)(v % 256);
    }
    assert_null(parse_image(bytes, (size_t)head + 2 * SIDE * SIDE, &made));
    for (int v = 0; v < SIDE * SIDE; v++) assert_int_equal(made.pixels16[v], v);
    free_image(&made);
    head = sprintf(bytes, "P5 %d 1 255\n", SIDE);
    for (int v = 0; v < SIDE; v++) bytes[head + v] = (char)(uint8_t)v;
    assert_null(parse_image(bytes, (size_t)(head + SIDE), &made));
    for (int v = 0; v < SIDE; v++) assert_int_equal(made.pixels[v], v);
    free_image(&made);
}

/* --- outlines -------------------------------------------------------------------------------- */

static void test_good_outlines(void **state) {
    (void)state;
    static const bad_case good[] = {{BYTES("x,y\n0,0\n1,0\n0.5,-2e1\n"), NULL},
                                    {BYTES("x,y\n0,0\n1,0\n0.5,-2e1"), NULL},
                                    {BYTES("x,y\r\n0,0\r\n1,0\r\n+.5,-20.\r\n\r\n\r\n"), NULL},
                                    {BYTES("x,y\n-0,0E0\n1e0,0\n5e-1,-20\n\n"), NULL},
                                    /* what spreadsheets and other programs make of it */
                                    {BYTES("\xEF\xBB\xBFx,y\n0,0\n1,0\n.5,-20\n"), NULL},
                                    {BYTES("X,Y\n0,0\n1,0\n.5,-20\n"), NULL},
                                    {BYTES(" x , y\n0, 0\n 1 ,0\n.5,\t-20\n"), NULL},
                                    {BYTES("\"x\",\"y\"\n\"0\",0\n1,0\n.5,\"-20\"\n"), NULL},
                                    {BYTES("x;y\n0;0\n1,0;0\n0,5;-20\n"), NULL},
                                    {BYTES("x\ty\n0\t0\n1\t0\n0,5\t-20\n"), NULL},
                                    {BYTES("x,y,z\n0,0,7\n1,0,a\n.5,-20,\n"), NULL},
                                    {BYTES("id;y;x\n1;0;0\n2;0;1\n3;-20;0.5\n"), NULL},
                                    {BYTES("x,y\n0,0\n1,0\n0.5,-20\n0,0\n"), NULL}};
    for (int i = 0; i < COUNT_OF(good); i++) {
        char *bytes = exact_copy(good[i].bytes, good[i].size);
        outline made;
        int line = -1;
        assert_true(is_outline(bytes, good[i].size));
        assert_null(parse_outline(bytes, good[i].size, &made, &line));
        assert_int_equal(line, 0);
        assert_int_equal(made.count, 3);
        assert_true(made.points[0].x == 0 && made.points[0].y == 0);
        assert_true(made.points[1].x == 1 && made.points[1].y == 0);
        assert_true(made.points[2].x == 0.5 && made.points[2].y == -20);
        free(made.points);
        free(bytes);
    }
}

typedef struct bad_outline {
    const char *bytes;
    size_t size;
    int line;
    const char *wrong;
} bad_outline;

#define NUMBERS "expected two finite numbers"

static const bad_outline bad_outlines[] = {
    {BYTES(""), 1, "expected \"x,y\""},
    {BYTES("x,y,X\n0,0,0\n"), 1, "expected \"x,y\""},
    {BYTES("x,z\n0,0\n"), 1, "expected \"x,y\""},
    {BYTES("x,y,z\n0,0\n"), 2, NUMBERS},
    {BYTES("x;y\n0,0;1,000,5\n"), 2, NUMBERS},
    {BYTES("x;y\n1.000,5;0\n"), 2, NUMBERS},
    {BYTES("x,y\n\"0,0\",1\n"), 2, NUMBERS},
    {BYTES("x,y\n0,0\n1,0\n0,0\n"), 0, "an outline needs 3"},
    {BYTES("0,0\n1,0\n0,1\n"), 1, "expected \"x,y\""},
    {BYTES("x,y"), 0, "an outline needs 3"},
    {BYTES("x,y\n"), 0, "an outline needs 3"},
    {BYTES("x,y\n0,0\n1,0\n\n"), 0, "an outline needs 3"},
    {BYTES("x,y\n0,0\n\n1,0\n0,1\n"), 4, NUMBERS},
    {BYTES("x,y\n0,0\n1\n0,1\n"), 3, NUMBERS},
    {BYTES("x,y\n0,0\n1,\n"), 3, NUMBERS},
    {BYTES("x,y\n,0\n"), 2, NUMBERS},
    {BYTES("x,y\n0,0,0\n"), 2, NUMBERS},
    {BYTES("x,y\n0;0\n"), 2, NUMBERS},
    {BYTES("x,y\n0x1,0\n"), 2, NUMBERS},
    {BYTES("x,y\nnan,0\n"), 2, NUMBERS},
    {BYTES("x,y\n0,inf\n"), 2, NUMBERS},
    {BYTES("x,y\n0,1e999\n"), 2, NUMBERS},
    {BYTES("x,y\n0,1e\n"), 2, NUMBERS},
    {BYTES("x,y\n0,1-1\n"), 2, NUMBERS},
    {BYTES("x,y\n0,0\n1,0\n0,1\0\n"), 4, NUMBERS},
    {BYTES("x,y\n0,0\n1,0\n0,1\n0"), 5, NUMBERS},
};

static void test_bad_outlines(void **state) {
    (void)state;
    for (int i = 0; i < COUNT_OF(bad_outlines); i++) {
        const bad_outline *c = &bad_outlines[i];
        char *bytes = exact_copy(c->bytes, c->size);
        outline made = {NULL, 7, NULL};
        int line = -1;
        const char *wrong = parse_outline(bytes, c->size, &made, &line);
        if (wrong == NULL || line != c->line)
            print_error("outline %d: %s, line %d\n", i, wrong != NULL ? wrong : "(good)", line);
        assert_non_null(wrong);
        assert_memory_equal(wrong, c->wrong, strlen(c->wrong));
        assert_int_equal(line, c->line);
        assert_true(made.points == NULL && made.count == 7);
        free(bytes);
    }
}

/* Numbers as long as a double can be in full, and longer than any. */
static void test_long_numbers(void **state) {
    (void)state;
    char digits[600];
    double value = 0;
    const int length = sprintf(digits, "%.20f", -DBL_MAX);
    assert_true(parse_decimal(digits, (size_t)length, &value));
    assert_same_bits(value, -DBL_MAX);
    memset(digits, '0', sizeof digits);
    assert_true(parse_decimal(digits, 399, &value));
    assert_false(parse_decimal(digits, 400, &value));
    assert_false(parse_decimal(digits, 0, &value));
}

/* --- files: one line on stderr that names the file, exit status 2 ----------------------------- */

/* Reads a file of these bytes in a process of its own, whose stderr is then in `said`. */
static int read_in_child(const char *path, const char *bytes, size_t size, char *said,
                         size_t room) {
    const char *const log = "build/test_readers.stderr";
    if (bytes != NULL) {
        FILE *file = fopen(path, "wb");
        assert_non_null(file);
        assert_int_equal(fwrite(bytes, 1, size, file), size);
        assert_int_equal(fclose(file), 0);
    }
    fflush(NULL);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        outline_list list = {NULL, 0};
        const dem2d_image_desc search = {0};
        if (freopen(log, "wb", stderr) == NULL) _exit(99);
        const file_kind kind = read_grains(path, &search, &list);
        free_outlines(&list);
        fflush(stderr);
        _exit(kind == FILE_OTHER ? 98 : 0);
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    FILE *file = fopen(log, "rb");
    assert_non_null(file);
    said[fread(said, 1, room - 1, file)] = '\0';
    fclose(file);
    remove(log);
    if (bytes != NULL) remove(path);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static void test_files(void **state) {
    (void)state;
    static const struct {
        const char *path, *bytes;
        size_t size;
        int status;
        const char *said;
    } cases[] = {
        {"build/test_readers.pgm", BYTES("P5 9 9 255\n123"), 2, "test_readers.pgm: truncated"},
        {"build/test_readers.dat", BYTES("P4 9 9\n123"), 2, "test_readers.dat: truncated"},
        {"build/test_readers.pbm", BYTES("x,y\n1,2\n"), 2, "test_readers.pbm: not a Netpbm"},
        {"build/test_readers.csv", BYTES("x,y\n1,2\nz\n"), 2, "test_readers.csv, line 3: expected"},
        {"build/test_readers.csv", BYTES("id,area\n1,2\n"), 98, ""},
        {"build/test_readers.csv", BYTES(""), 98, ""},
        {"build/test_readers.csv", BYTES("x,y\n0,0\n1,0\n0,1\n"), 0, ""},
        {"build/none/such.pgm", NULL, 0, 2, "build/none/such.pgm: "},
        {"build", NULL, 0, 2, "build: "},
    };
    for (int i = 0; i < COUNT_OF(cases); i++) {
        char said[400];
        const int status =
            read_in_child(cases[i].path, cases[i].bytes, cases[i].size, said, sizeof said);
        if (status != cases[i].status) print_error("file %d: status %d, %s\n", i, status, said);
        assert_int_equal(status, cases[i].status);
        assert_non_null(strstr(said, cases[i].said));
        const char *end = strchr(said, '\n');
        if (status == 2) assert_true(end != NULL && end[1] == '\0'); /* one line */
        if (status != 2) assert_int_equal(said[0], '\0');
    }
}

/* --- options ---------------------------------------------------------------------------------- */

static void test_crop(void **state) {
    (void)state;
    dem2d_image_desc search = default_search();
    parse_crop("1, 20,300,0", &search);
    assert_int_equal(search.crop_left, 1);
    assert_int_equal(search.crop_top, 20);
    assert_int_equal(search.crop_width, 300);
    assert_int_equal(search.crop_height, 0);
    assert_true(search.scale == 1 && search.threshold == 0 && !search.labels);
}

/* A star with deep notches is left out, unless a low coverage will do. */
static void test_min_coverage(void **state) {
    (void)state;
    dem2d_vec points[10];
    outline star = {points, 10, NULL};
    template_set set = {NULL, 0, 0};
    char name[] = "star";
    star.name = name;
    for (int i = 0; i < 10; i++) {
        const dem2d_vec u = direction(0.6283185307179586 * i);
        const double r = i % 2 ? 0.3 : 1;
        points[i] = vec(r * u.x, r * u.y);
    }
    assert_false(add_fitted(&set, &star, 0.7, false));
    assert_int_equal(set.count, 0);
    assert_int_equal(set.outlines, 0);
    assert_true(add_fitted(&set, &star, -10, false)); /* a coverage may be negative */
    assert_int_equal(set.count, 2);
    assert_int_equal(set.outlines, 1);
    free_templates(&set);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_good_images),   cmocka_unit_test(test_bad_images),
        cmocka_unit_test(test_cut_images),    cmocka_unit_test(test_grey_levels),
        cmocka_unit_test(test_good_outlines), cmocka_unit_test(test_bad_outlines),
        cmocka_unit_test(test_long_numbers),  cmocka_unit_test(test_files),
        cmocka_unit_test(test_crop),          cmocka_unit_test(test_min_coverage),
    };
    return cmocka_run_group_tests_name("readers", tests, NULL, NULL);
}
