/* random.h - random numbers that repeat: one generator for the examples and the tests. */
#ifndef DEM2D_EXAMPLES_RANDOM_H
#define DEM2D_EXAMPLES_RANDOM_H

#include <stdint.h>

/* 64 random bits (splitmix64): a counter stepped by 2^64 / golden ratio, then mixed. Any state is a
   good start. */
static inline uint64_t random_bits(uint64_t *state) {
    uint64_t z = (*state += UINT64_C(0x9E3779B97F4A7C15));
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

/* Uniform in [low, high): 53 random bits. Two draws never stand in one expression, because C
   leaves open which comes first. */
static inline double random_between(uint64_t *state, double low, double high) {
    return low + (high - low) * ((double)(random_bits(state) >> 11) * (1 / 9007199254740992.0));
}

/* Uniform in 0 .. count - 1. */
static inline int random_below(uint64_t *state, int count) {
    return (int)(random_bits(state) % (uint64_t)count);
}

#endif
