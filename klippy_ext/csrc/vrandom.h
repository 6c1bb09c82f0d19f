/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Repeatable random numbers of the virtual world: splitmix64 (Steele, Lea and
 * Flood, "Fast splittable pseudorandom number generators", 2014).
 */
#ifndef VRANDOM_H
#define VRANDOM_H

#include <stdint.h>

static inline uint64_t
vrandom_next(uint64_t *state)
{
    uint64_t z = (*state += UINT64_C(0x9e3779b97f4a7c15));

    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

/* Uniform in [0, 1). */
static inline double
vrandom_unit(uint64_t *state)
{
    return (double)(vrandom_next(state) >> 11) * 0x1p-53;
}

#endif
