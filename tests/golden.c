/* golden.c - hashes of small scenes, which must be the same from every build on every machine; C
   and C++. `make golden` builds and compares. Prints for each scene the hash that test_snapshot.c
   holds it to, and that of a larger one with the checksum of its snapshot. Each is made on one
   thread and on several, with memory whose addresses fall, and going on from a snapshot half-way.
 */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "snapshot_scenes.h"

#if !defined(__wasi__)
#include <pthread.h>
#endif

enum { LARGE_GRAINS = 300, LARGE_STEPS = 30, THREADS = 3 };

/* --- threads -------------------------------------------------------------------------------------
 */

typedef struct share {
    dem2d_task_fn *task;
    void *context;
    int begin, end;
} share;

#if defined(__wasi__) /* without threads: the last share first */
static void run_shared(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                       void *context) {
    (void)user, (void)phase;
    for (int i = THREADS - 1; i >= 0; i--) {
        const int begin = count * i / THREADS, end = count * (i + 1) / THREADS;
        if (begin < end) task(context, begin, end);
    }
}
#else
static void *do_share(void *context) {
    const share *own = (const share *)context;
    if (own->begin < own->end) own->task(own->context, own->begin, own->end);
    return NULL;
}

static void run_shared(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                       void *context) {
    pthread_t threads[THREADS];
    share shares[THREADS];
    (void)user, (void)phase;
    for (int i = 0; i < THREADS; i++) {
        share *own = &shares[i];
        own->task = task, own->context = context;
        own->begin = count * i / THREADS, own->end = count * (i + 1) / THREADS;
        if (pthread_create(&threads[i], NULL, do_share, own) != 0) abort();
    }
    for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
}
#endif

/* --- memory from the top down, never given back --------------------------------------------------
 */

typedef struct arena {
    char *start;
    size_t left;
} arena;

static void *take(void *user, size_t size) {
    arena *a = (arena *)user;
    const size_t whole = (size + 63) / 64 * 64;
    if (whole > a->left) return NULL;
    a->left -= whole;
    memset(a->start + a->left, 0x5A, whole);
    return a->start + a->left;
}

static void leave(void *user, void *memory, size_t size) {
    (void)user, (void)memory, (void)size;
}

/* --- runs ----------------------------------------------------------------------------------------
 */

typedef enum way { PLAIN, SHARED, FALLING, RESUMED, WAYS } way;

static const char *const way_names[WAYS] = {"plain", "threads", "falling addresses", "resumed"};

typedef struct outcome {
    uint64_t hash, checksum;
} outcome;

static dem2d_world *resume(dem2d_world *world) {
    scene_bytes bytes = scene_save(world);
    dem2d_custom_desc custom;
    dem2d_load_desc load = scene_load_desc(&bytes, &custom);
    dem2d_world_destroy(world);
    scene_check(dem2d_world_load(&load, NULL, &world));
    free(bytes.bytes);
    return world;
}

static outcome run(int kind, int grains, int steps, way by) {
    snapshot_scene s;
    outcome made;
    arena memory = {NULL, (size_t)96 << 20};
    dem2d_env env;
    dem2d_world_desc desc = scene_desc(kind);
    memset(&env, 0, sizeof env);
    if (by == FALLING) {
        memory.start = (char *)malloc(memory.left);
        if (memory.start == NULL) abort();
        env.user = &memory, env.allocate = take, env.release = leave;
        desc.env = &env;
    }
    if (by == SHARED) desc.parallel_for = run_shared;
    scene_make(&s, kind, grains, &desc);
    scene_check(dem2d_world_step(s.world, steps / 2, NULL));
    if (by == RESUMED) s.world = resume(s.world);
    scene_check(dem2d_world_step(s.world, steps - steps / 2, NULL));
    made.hash = dem2d_world_hash(s.world);
    scene_bytes bytes = scene_save(s.world);
    made.checksum = 0;
    for (size_t k = 0; k < 8; k++)
        made.checksum |= (uint64_t)(unsigned char)bytes.bytes[bytes.size - 8 + k] << 8 * k;
    free(bytes.bytes);
    dem2d_world_destroy(s.world);
    free(memory.start);
    return made;
}

/* The plain run; the others are counted in `differ` when they come out otherwise. A small scene is
   a single block of work, for one thread. */
static outcome compare(int kind, int grains, int steps, int *differ) {
    outcome plain = run(kind, grains, steps, PLAIN);
    for (int by = grains == LARGE_GRAINS ? SHARED : FALLING; by < WAYS; by++) {
        outcome other = run(kind, grains, steps, (way)by);
        if (other.hash == plain.hash && other.checksum == plain.checksum) continue;
        fprintf(stderr, "golden: %s, %d grains: %s differs\n", scene_names[kind], grains,
                way_names[by]);
        ++*differ;
    }
    return plain;
}

int main(void) {
    int differ = 0;
    for (int kind = 0; kind < SCENE_COUNT; kind++) {
        const outcome small = compare(kind, GOLDEN_GRAINS, GOLDEN_STEPS, &differ);
        const outcome large = compare(kind, LARGE_GRAINS, LARGE_STEPS, &differ);
        printf("%-8s 0x%016llx  0x%016llx 0x%016llx\n", scene_names[kind],
               (unsigned long long)small.hash, (unsigned long long)large.hash,
               (unsigned long long)large.checksum);
        if (small.hash == golden_hashes[kind]) continue;
        fprintf(stderr, "golden: %s is not 0x%016llx\n", scene_names[kind],
                (unsigned long long)golden_hashes[kind]);
        differ++;
    }
    return differ > 0;
}
