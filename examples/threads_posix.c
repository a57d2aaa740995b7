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
#include "common.h"

#include <pthread.h>
#include <sched.h>

/* A step has three phases of maybe 50 us. To wake a thread through the kernel each time would cost
   as much, so workers look for the next phase for a while before they sleep. C99 has no atomics,
   and a lock in that loop would hold up the one who hands out the work: hence the __atomic builtins
   of gcc and clang, where C11 has <stdatomic.h>. */
enum { LOOK = 200 }; // us

typedef struct pool {
    int left;   // items that nobody has taken; atomic
    int undone; // items that are not finished; atomic
    dem2d_task_fn *task;
    void *context;
    pthread_mutex_t lock; // for what follows, and to set `left`
    pthread_cond_t wake;  // there is work, or stop
    int asleep;           // workers that wait for it
    bool stop;
    int workers;
    pthread_t worker[256];
} pool;

/* Does one item; false if there is none. Who takes a number from `left` may read `task`: it is
   not set anew before that item is done. A late worker takes from the next phase, or nothing. */
static bool do_item(pool *p) {
    if (__atomic_load_n(&p->left, __ATOMIC_RELAXED) <= 0) return false;
    const int item = __atomic_sub_fetch(&p->left, 1, __ATOMIC_ACQUIRE);
    if (item < 0) return false;
    p->task(p->context, item, item + 1);
    __atomic_sub_fetch(&p->undone, 1, __ATOMIC_RELEASE);
    return true;
}

/* Works while there is work; returns when there has been none for LOOK. */
static void work_and_look(pool *p) {
    double worked = clock_seconds();
    do {
        bool found = false;
        while (do_item(p)) found = true;
        if (found) worked = clock_seconds();
        sched_yield(); // there may be more threads than processors
    } while (clock_seconds() - worked < 1e-6 * LOOK);
}

static void *work(void *context) {
    pool *p = context;
    for (bool stop = false; !stop;) {
        work_and_look(p);
        pthread_mutex_lock(&p->lock);
        p->asleep++;
        while (!p->stop && __atomic_load_n(&p->left, __ATOMIC_RELAXED) <= 0)
            pthread_cond_wait(&p->wake, &p->lock);
        p->asleep--;
        stop = p->stop;
        pthread_mutex_unlock(&p->lock);
    }
    return NULL;
}

/* The dem2d_parallel_fn. The caller works too, and waits for nobody who has not taken an item. */
static void run_on_pool(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                        void *context) {
    pool *p = user;
    (void)phase;
    p->task = task;
    p->context = context;
    __atomic_store_n(&p->undone, count, __ATOMIC_RELAXED);
    pthread_mutex_lock(&p->lock); // so that nobody falls asleep in between
    __atomic_store_n(&p->left, count, __ATOMIC_RELEASE);
    if (p->asleep > 0 && count > 1) pthread_cond_broadcast(&p->wake);
    pthread_mutex_unlock(&p->lock);
    while (do_item(p)) continue;
    while (__atomic_load_n(&p->undone, __ATOMIC_ACQUIRE) > 0) sched_yield();
}

static void pool_start(pool *p, int threads) {
    memset(p, 0, sizeof *p);
    pthread_mutex_init(&p->lock, NULL);
    pthread_cond_init(&p->wake, NULL);
    for (; p->workers < threads - 1; p->workers++) // the caller is one more
        if (pthread_create(&p->worker[p->workers], NULL, work, p) != 0)
            fail(STATUS_FAILED, "cannot start thread %d", p->workers + 1);
}

static void pool_end(pool *p) {
    pthread_mutex_lock(&p->lock);
    p->stop = true;
    pthread_cond_broadcast(&p->wake);
    pthread_mutex_unlock(&p->lock);
    while (p->workers > 0) pthread_join(p->worker[--p->workers], NULL);
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
