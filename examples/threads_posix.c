/* threads_posix.c - a world that runs on a pool of POSIX threads: the same bits as on one.

       build/threads_posix [THREADS] [PARTICLES] [STEPS]

   Drops mixed grains into a box, on one thread and on several, and prints both times. Exit status:
   0 if all poses and velocities are the same bits, 1 if not, 2 for bad usage. The pool (from here
   to `main`) needs nothing but dem2d.h; a world takes it by

       scene.parallel_for = run_on_pool;
       scene.parallel_user = &my_pool;
*/
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "falling.h"

#include <pthread.h>
#include <sched.h>

/* Each thread takes the same share of the items in every phase and step: particles that are near in
   memory are near in space, and so each finds in its cache what it left there. The shares are even
   enough. A step has two phases of maybe 50 us: to wake a thread through the kernel each time would
   cost as much, so workers look for the next phase for a while before they sleep. C99 has no
   atomics, hence the __atomic builtins of gcc and clang, where C11 has <stdatomic.h>. */
enum { LOOK = 500 }; // us

typedef struct worker {
    struct pool *pool;
    int share; // its place among the threads; the caller has 0
    pthread_t thread;
} worker;

/* What all look at and what all write are kept in lines of the cache apart from each other. */
typedef struct pool {
    dem2d_task_fn *task;
    void *context;
    int count, threads;
    pthread_mutex_t lock; // for `asleep` and `stop`, and to set `job`
    pthread_cond_t wake;
    int asleep; // workers that wait for it
    bool stop;
    worker workers[255];
    char apart[64];
    unsigned job; // number of the phase; atomic
    char apart_too[64];
    int undone; // workers that have not finished it; atomic
} pool;

static void do_share(const pool *p, int share) {
    const int begin = (int)((int64_t)p->count * share / p->threads);
    const int end = (int)((int64_t)p->count * (share + 1) / p->threads);
    if (begin < end) p->task(p->context, begin, end);
}

static bool is_new(const pool *p, unsigned last) {
    return __atomic_load_n(&p->job, __ATOMIC_ACQUIRE) != last;
}

/* Returns when there is another phase than the last one, or an end of them. */
static void await_job(pool *p, unsigned last) {
    const double start = clock_seconds();
    while (!is_new(p, last) && clock_seconds() - start < 1e-6 * LOOK)
        sched_yield(); // there may be more threads than processors
    if (is_new(p, last)) return;
    pthread_mutex_lock(&p->lock);
    p->asleep++;
    while (!is_new(p, last) && !p->stop) pthread_cond_wait(&p->wake, &p->lock);
    p->asleep--;
    pthread_mutex_unlock(&p->lock);
}

static void *work(void *context) {
    const worker *w = context;
    for (unsigned job = 0;; job++) {
        await_job(w->pool, job);
        if (!is_new(w->pool, job)) return NULL;
        do_share(w->pool, w->share);
        __atomic_sub_fetch(&w->pool->undone, 1, __ATOMIC_RELEASE);
    }
}

/* The dem2d_parallel_fn. The caller works too. */
static void run_on_pool(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                        void *context) {
    pool *p = user;
    (void)phase;
    if (count == 1 || p->threads == 1) {
        task(context, 0, count);
        return;
    }
    p->task = task;
    p->context = context;
    p->count = count;
    __atomic_store_n(&p->undone, p->threads - 1, __ATOMIC_RELAXED);
    pthread_mutex_lock(&p->lock); // so that nobody falls asleep in between
    __atomic_add_fetch(&p->job, 1, __ATOMIC_RELEASE);
    if (p->asleep > 0) pthread_cond_broadcast(&p->wake);
    pthread_mutex_unlock(&p->lock);
    do_share(p, 0);
    while (__atomic_load_n(&p->undone, __ATOMIC_ACQUIRE) > 0) sched_yield();
}

static void pool_start(pool *p, int threads) {
    memset(p, 0, sizeof *p);
    pthread_mutex_init(&p->lock, NULL);
    pthread_cond_init(&p->wake, NULL);
    p->threads = threads;
    for (int i = 1; i < threads; i++) {
        worker *w = &p->workers[i - 1];
        w->pool = p;
        w->share = i;
        if (pthread_create(&w->thread, NULL, work, w) != 0)
            fail(STATUS_FAILED, "cannot start thread %d", i);
    }
}

static void pool_end(pool *p) {
    pthread_mutex_lock(&p->lock);
    p->stop = true;
    pthread_cond_broadcast(&p->wake);
    pthread_mutex_unlock(&p->lock);
    for (int i = 1; i < p->threads; i++) pthread_join(p->workers[i - 1].thread, NULL);
    pthread_cond_destroy(&p->wake);
    pthread_mutex_destroy(&p->lock);
}

int main(int count, char **arguments) {
    static pool threads;
    example_name = "threads_posix";
    const fall f = parse_fall(count, arguments);
    pool_start(&threads, f.threads);
    const int status = compare_falls(&f, run_on_pool, &threads);
    pool_end(&threads);
    return status;
}
