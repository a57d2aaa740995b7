/* fuzz_readers.c - the readers of the examples, Netpbm images and CSV outlines, against any bytes.

       clang -fsanitize=fuzzer,address,undefined   libFuzzer: fuzz_readers [CORPUS]
       cc -DFUZZ_MAIN -fsanitize=address,undefined fuzz_readers [N [SEED]]: N random changes of the
                                                   samples below (100000, 1), the same each time
*/
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "../examples/readers.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Ends the program when a promise of the readers does not hold. */
static void promise(bool holds) {
    if (!holds) abort();
}

static volatile unsigned sink; // every byte of a result is read, for the sanitizers

static void try_image(const char *bytes, size_t size) {
    image made = {NULL, -1, -1, NULL};
    const char *wrong = parse_image(bytes, size, &made);
    if (wrong != NULL) { // untouched then
        promise(wrong[0] != '\0' && made.pixels == NULL && made.pixels16 == NULL &&
                made.width == -1 && made.height == -1);
        return;
    }
    promise(is_image(bytes, size));
    promise(made.width >= 1 && made.width <= IMAGE_SIDE);
    promise(made.height >= 1 && made.height <= IMAGE_SIDE);
    const size_t count = (size_t)made.width * (size_t)made.height;
    promise(count <= 8 * size);
    unsigned sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += made.pixels != NULL ? made.pixels[i] : made.pixels16[i];
    sink = sum;
    free_image(&made);
}

static void try_outline(const char *bytes, size_t size) {
    outline made = {NULL, -1, NULL};
    int line = -1;
    const char *wrong = parse_outline(bytes, size, &made, &line);
    if (wrong != NULL) {
        promise(wrong[0] != '\0' && line >= 0 && made.points == NULL && made.count == -1);
        return;
    }
    promise(is_outline(bytes, size) && made.count >= 3 && (size_t)made.count <= size / 4);
    for (int i = 0; i < made.count; i++)
        promise(isfinite(made.points[i].x) && isfinite(made.points[i].y));
    free(made.points);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    try_image((const char *)data, size);
    try_outline((const char *)data, size);
    return 0;
}

#if defined(FUZZ_MAIN)

typedef struct sample {
    const char *bytes;
    size_t size;
} sample;

#define SAMPLE(text) \
    { text, sizeof text - 1 }

static const sample samples[] = {
    SAMPLE("P1\n# bits\n4 3\n0 1 1 0\n1111\n0110\n"),
    SAMPLE("P2 3 2 # grey\n15\n0 7 15 15 8 0\n"),
    SAMPLE("\xEF\xBB\xBF\"X\";y; z\n0,5;1;a\n2;\"3\";\n0;0;0\n0,5;1;a\n"),
    SAMPLE("P2\n2 2\n65535\n0 65535\n32768 1\n"),
    SAMPLE("P4\n10 2\n\xff\x40\x01\x80"),
    SAMPLE("P5 3 2 255\n\x00\x10\x20\xff\x80\x7f"),
    SAMPLE("P5\n#c\n2 1 1000\n\x00\x01\x03\xe8"),
    SAMPLE("P5 1 1 255#\n\xff"),
    SAMPLE("x,y\n0,0\n1,0\n0.5,1e-1\n-2.25,+3E0\n"),
    SAMPLE("x,y\r\n0,0\r\n1e308,0\r\n0,-1e308\r\n\r\n"),
};
enum { SAMPLES = sizeof samples / sizeof samples[0], ROOM = 4096 };

/* Numbers and marks that readers stumble over. */
static const char *const words[] = {
    "0",     "-1",         "32768",      "32769", "65535",
    "65536", "2147483647", "4294967296", "1e999", "1e308",
    "0x1p4", "nan",        "inf",        "#",     "\n",
    "\r\n",  ",",          ",,",         "P1",    "P4 8 1\n\n",
    "P5",    "P6",         "x,y\n",      " ",     "00000000000000000001"};
enum { WORDS = sizeof words / sizeof words[0] };

/* Puts `count` bytes in the place of `gone` ones. */
static size_t splice(char *bytes, size_t size, size_t at, size_t gone, const char *in,
                     size_t count) {
    if (gone > size - at) gone = size - at;
    if (size - gone + count > ROOM) return size;
    memmove(bytes + at + count, bytes + at + gone, size - at - gone);
    memcpy(bytes + at, in, count);
    return size - gone + count;
}

/* One random change. */
static size_t change(char *bytes, size_t size, uint64_t *random) {
    const int kind = random_below(random, 6);
    const size_t at = (size_t)random_below(random, (int)size + 1);
    const size_t few = (size_t)random_below(random, 5);
    if (kind == 0 && at < size) // a bit
        bytes[at] = (char)((unsigned char)bytes[at] ^ (1u << random_below(random, 8)));
    if (kind == 1 && at < size) bytes[at] = (char)(unsigned char)random_below(random, 256);
    if (kind == 2) return at; // cut
    if (kind == 3) return splice(bytes, size, at, few, "", 0);
    if (kind == 4) {
        const char *word = words[random_below(random, WORDS)];
        return splice(bytes, size, at, few, word, strlen(word));
    }
    if (kind == 5) { // a part of another sample
        const sample *other = &samples[random_below(random, SAMPLES)];
        const size_t from = (size_t)random_below(random, (int)other->size);
        return splice(bytes, size, at, few, other->bytes + from, other->size - from);
    }
    return size;
}

int main(int count, char **arguments) {
    example_name = "fuzz_readers";
    const uint64_t runs = count > 1 ? parse_integer("N", arguments[1], 0, UINT64_MAX) : 100000;
    uint64_t random = count > 2 ? parse_integer("SEED", arguments[2], 0, UINT64_MAX) : 1;
    static char bytes[ROOM];
    for (uint64_t run = 0; run < runs; run++) {
        const sample *start = &samples[random_below(&random, SAMPLES)];
        size_t size = start->size;
        memcpy(bytes, start->bytes, size);
        for (int n = random_below(&random, 6); n > 0; n--) size = change(bytes, size, &random);
        uint8_t *exact = malloc(size > 0 ? size : 1); // the sanitizers see its end
        if (exact == NULL) fail(STATUS_FAILED, "out of memory");
        memcpy(exact, bytes, size);
        LLVMFuzzerTestOneInput(exact, size);
        free(exact);
    }
    printf("fuzz_readers: %llu inputs, all handled\n", (unsigned long long)runs);
    return 0;
}

#endif
