/* threads_openmp.c - a world that runs on the threads of OpenMP: the same bits as on one.

       build/threads_openmp [THREADS] [PARTICLES] [STEPS]

   Drops mixed grains into a box, on one thread and on several, and prints both times. Exit status:
   0 if all poses and velocities are the same bits, 1 if not, 2 for bad usage. Built without
   -fopenmp, the loop below is an ordinary one.

   At the end of a loop OpenMP's threads wait for each other without giving their processors away.
   Steps are short, so this is the fastest way where each thread has a processor for itself: leave
   OMP_WAIT_POLICY alone there. Where other programs need the processors, waiting threads hold up
   those that they wait for, and steps take many times as long. There take fewer threads, or set
   OMP_WAIT_POLICY=passive: threads then sleep while they wait, and each wake-up costs time.
*/
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "falling.h"

/* The dem2d_parallel_fn; `user` is the number of threads. Static: each thread then finds in its
   cache what it left there in the last step. */
static void run_by_openmp(void *user, dem2d_phase phase, int count, dem2d_task_fn *task,
                          void *context) {
    const int threads = *(const int *)user;
    (void)phase, (void)threads;
#ifdef _OPENMP
#pragma omp parallel for schedule(static) num_threads(threads)
#endif
    for (int i = 0; i < count; i++) task(context, i, i + 1);
}

int main(int count, char **arguments) {
    example_name = "threads_openmp";
    fall f = parse_fall(count, arguments);
#ifndef _OPENMP
    f.threads = 1;
#endif
    return compare_falls(&f, run_by_openmp, &f.threads);
}
