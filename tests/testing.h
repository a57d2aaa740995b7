/* testing.h - what the tests share: comparisons that print, an allocator that counts and fails on
   demand, a log that is kept; and parts.h. Include it after dem2d.h. */
#ifndef TESTING_H
#define TESTING_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define PARTS_FAIL(what, why) fail_msg("%s: %s", what, why)
#include "parts.h"

#define TEST_PI 3.14159265358979323846264338327950288L

/* --- comparisons ---------------------------------------------------------------------------- */

/* |actual - expected| <= tolerance; a NaN anywhere fails. */
PART void test_within(long double actual, long double expected, long double tolerance,
                      const char *what, const char *file, int line) {
    const long double error = fabsl(actual - expected);
    if (error <= tolerance || actual == expected) return;
    print_error("%s: %.21Lg, expected %.21Lg, off by %.3Lg, allowed %.3Lg\n", what, actual,
                expected, error, tolerance);
    _fail(file, line);
}

/* lower <= actual <= upper. */
PART void test_between(long double actual, long double lower, long double upper, const char *what,
                       const char *file, int line) {
    if (actual >= lower && actual <= upper) return;
    print_error("%s: %.21Lg, expected from %.21Lg to %.21Lg\n", what, actual, lower, upper);
    _fail(file, line);
}

PART void test_result(dem2d_result actual, dem2d_result expected, const char *what,
                      const char *file, int line) {
    if (actual == expected) return;
    print_error("%s: \"%s\", expected \"%s\"\n", what, dem2d_result_text(actual),
                dem2d_result_text(expected));
    _fail(file, line);
}

/* Tolerance relative to the expected value: for numbers that can't be near zero. */
#define assert_near(actual, expected, relative)                                           \
    test_within((actual), (expected), (relative)*fabsl((long double)(expected)), #actual, \
                __FILE__, __LINE__)
/* Tolerance relative to a size that the caller names. */
#define assert_within(actual, expected, tolerance) \
    test_within((actual), (expected), (tolerance), #actual, __FILE__, __LINE__)
#define assert_between(actual, lower, upper) \
    test_between((actual), (lower), (upper), #actual, __FILE__, __LINE__)
#define assert_result(call, expected) test_result((call), (expected), #call, __FILE__, __LINE__)
#define assert_ok(call) assert_result(call, DEM2D_OK)

/* The same bits: also tells 0 from -0. */
#define assert_same_bits(actual, expected)                                 \
    do {                                                                   \
        const double test_a = (actual), test_b = (expected);               \
        if (memcmp(&test_a, &test_b, sizeof test_a) != 0) {                \
            print_error("%s: %a, expected %a\n", #actual, test_a, test_b); \
            fail();                                                        \
        }                                                                  \
    } while (0)

/* --- how much ----------------------------------------------------------------------------------
 */

/* LONG=1 in the environment: all of the sweeps that are known to take long, else a part of them. */
PART bool test_long(void) {
    const char *value = getenv("LONG");
    return value != NULL && value[0] != 0;
}

/* --- vectors and poses ----------------------------------------------------------------------- */

PART dem2d_vec direction(double angle) {
    return (dem2d_vec){cos(angle), sin(angle)};
}

/* No move, no turn, size 1. */
PART dem2d_pose still(void) {
    return (dem2d_pose){{0, 0}, {1, 0}, 1};
}

/* --- log ------------------------------------------------------------------------------------- */

typedef struct test_log {
    dem2d_result result; /* of the last message */
    int index;           /* of the last message; -2 when there was none */
    int count;           /* of messages */
    char text[512];      /* of the last message */
} test_log;

/* --- allocator ------------------------------------------------------------------------------- */

typedef struct test_env {
    dem2d_env env; /* hand &env to the library; do not move the struct after test_env_init */
    test_log log;  /* what the log callback got */
    size_t bytes;  /* in use */
    size_t peak;   /* most that was in use */
    int blocks;    /* in use */
    int calls;     /* of allocate since test_env_init or test_env_fail */
    int fail_at;   /* this call of allocate fails, counted from 1; 0: none */
    int bad_frees; /* releases with a wrong size, or of something else */
} test_env;

/* In front of each block, padded so that the block is aligned as malloc would. */
typedef union test_block {
    struct {
        size_t size;
        uint64_t mark;
    } info;
    long double align;
    char pad[32];
} test_block;

#define TEST_MARK 0x6d656d2d64323464u

PART void *test_allocate(void *user, size_t size) {
    test_env *env = user;
    if (++env->calls == env->fail_at) return NULL;
    test_block *block = malloc(sizeof *block + size);
    if (!block) abort();
    block->info.size = size, block->info.mark = TEST_MARK;
    memset(block + 1, 0xa5, size); /* memory is not zero: whoever relies on it is found */
    env->bytes += size, env->blocks++;
    if (env->bytes > env->peak) env->peak = env->bytes;
    return block + 1;
}

PART void test_release(void *user, void *memory, size_t size) {
    test_env *env = user;
    if (!memory) return;
    test_block *block = (test_block *)memory - 1;
    if (block->info.mark != TEST_MARK || block->info.size != size) {
        env->bad_frees++;
        if (block->info.mark != TEST_MARK) return;
    }
    env->bytes -= block->info.size, env->blocks--;
    block->info.mark = 0;
    free(block);
}

PART void test_keep_log(void *user, dem2d_result result, int index, const char *text) {
    test_log *log = &((test_env *)user)->log;
    log->result = result, log->index = index, log->count++;
    snprintf(log->text, sizeof log->text, "%s", text ? text : "(NULL)");
}

PART void test_log_clear(test_env *env) {
    memset(&env->log, 0, sizeof env->log);
    env->log.index = -2;
}

PART void test_env_init(test_env *env) {
    memset(env, 0, sizeof *env);
    env->env.user = env;
    env->env.allocate = test_allocate;
    env->env.release = test_release;
    env->env.log = test_keep_log;
    test_log_clear(env);
}

/* From now on the call'th allocation fails (1 is the next one; 0: none). */
PART void test_env_fail(test_env *env, int call) {
    env->calls = 0, env->fail_at = call;
}

/* Nothing is left, and every release named the size that was asked for. */
PART void test_env_clean(const test_env *env, const char *file, int line) {
    if (env->bytes == 0 && env->blocks == 0 && env->bad_frees == 0) return;
    print_error("memory: %zu bytes in %d blocks left, %d bad releases\n", env->bytes, env->blocks,
                env->bad_frees);
    _fail(file, line);
}
#define assert_clean(env) test_env_clean((env), __FILE__, __LINE__)

/* Steps of a world whose allocations fail now and then, each again until it is done. One that fails
   changes nothing. Returns how many failed. */
PART int test_steps_fail(dem2d_world *world, int steps) {
    int failed = 0;
    while (steps > 0) {
        int done;
        const uint64_t before = dem2d_world_hash(world);
        const dem2d_result result = dem2d_world_step(world, 1, &done);
        steps -= done;
        if (result == DEM2D_OK) continue;
        assert_result(result, DEM2D_OUT_OF_MEMORY);
        assert_true(dem2d_world_hash(world) == before);
        failed++;
    }
    return failed;
}

/* Whether a text holds a word as a whole: "radius" is not found in "radii", nor "a" in "area". */
PART bool test_has_word(const char *text, const char *word) {
    const char *const letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
    const size_t length = strlen(word);
    for (const char *at = strstr(text, word); at; at = strstr(at + 1, word)) {
        const bool starts = at == text || !strchr(letters, at[-1]);
        if (starts && (at[length] == 0 || !strchr(letters, at[length]))) return true;
    }
    return false;
}

/* The last message is about this result and index, and its text holds a word as a whole (or word
   is NULL). */
PART void test_logged(const test_env *env, dem2d_result result, int index, const char *word,
                      const char *file, int line) {
    const test_log *log = &env->log;
    if (log->count > 0 && log->result == result && log->index == index &&
        (!word || test_has_word(log->text, word)))
        return;
    print_error("log: %d messages, last \"%s\" (index %d): \"%s\"; expected \"%s\" (index %d) "
                "with the word \"%s\"\n",
                log->count, dem2d_result_text(log->result), log->index, log->text,
                dem2d_result_text(result), index, word ? word : "");
    _fail(file, line);
}
#define assert_logged(env, result, index, word) \
    test_logged((env), (result), (index), (word), __FILE__, __LINE__)

/* --- parallel work ------------------------------------------------------------------------------
 */

/* A dem2d_parallel_fn for as many threads as the user's int says, without threads: all their parts
   of the work, the last one first. */
PART void run_parts(void *user, dem2d_phase phase, int count, dem2d_task_fn *task, void *context) {
    const int threads = *(const int *)user;
    (void)phase;
    for (int k = threads - 1; k >= 0; k--) {
        const int begin = count * k / threads, end = count * (k + 1) / threads;
        if (begin < end) task(context, begin, end);
    }
}

#endif
