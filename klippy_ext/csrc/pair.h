/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Two numbers at once: loops over windows of steps run on pairs, as compilers
 * find few of them by themselves.  Any other processor than one with vectors
 * of two doubles does one after the other, with the same results.
 */
#ifndef PAIR_H
#define PAIR_H

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

typedef double pair __attribute__((vector_size(16)));
typedef int64_t pair_mask __attribute__((vector_size(16)));

static inline pair
pair_load(const double *p)
{
    pair x;

    memcpy(&x, p, sizeof(x));
    return x;
}

static inline void
pair_store(double *p, pair x)
{
    memcpy(p, &x, sizeof(x));
}

static inline pair
pair_of(double x)
{
    return (pair) { x, x };
}

static inline pair
pair_choose(pair_mask mask, pair yes, pair no)
{
    return (pair)(((pair_mask)yes & mask) | ((pair_mask)no & ~mask));
}

static inline pair
pair_max(pair a, pair b)
{
#ifdef __SSE2__
    return (pair)_mm_max_pd((__m128d)a, (__m128d)b);
#else
    return pair_choose(a > b, a, b);
#endif
}

static inline pair
pair_min(pair a, pair b)
{
#ifdef __SSE2__
    return (pair)_mm_min_pd((__m128d)a, (__m128d)b);
#else
    return pair_choose(a < b, a, b);
#endif
}

static inline pair
pair_sqrt(pair x)
{
#ifdef __SSE2__
    return (pair)_mm_sqrt_pd((__m128d)x);
#else
    return (pair) { sqrt(x[0]), sqrt(x[1]) };
#endif
}

static inline pair
pair_swap(pair x)
{
    return (pair) { x[1], x[0] };
}

/* The second of a and the first of b. */
static inline pair
pair_join(pair a, pair b)
{
#ifdef __SSE2__
    return (pair)_mm_shuffle_pd((__m128d)a, (__m128d)b, 1);
#else
    return (pair) { a[1], b[0] };
#endif
}

static inline pair
pair_abs(pair x)
{
    return (pair)((pair_mask)x & INT64_MAX);
}

/* The sign of a - b (below 0 where b is more), to be gathered by `|`. */
static inline pair_mask
pair_compare(pair a, pair b)
{
    return (pair_mask)(a - b);
}

/* Was any a less than b? */
static inline int
pair_is_less(pair_mask signs)
{
#ifdef __SSE2__
    return _mm_movemask_pd((__m128d)signs) != 0;
#else
    return (signs[0] | signs[1]) < 0;
#endif
}

/* The closest whole numbers of less than 2^51: there is no room for a fraction
 * beside such a sum. */
#define PAIR_WHOLE 6755399441055744.

static inline double
pair_round_one(double x)
{
    return FLT_EVAL_METHOD == 0 ? (x + PAIR_WHOLE) - PAIR_WHOLE
                                : nearbyint(x);
}

static inline pair
pair_round(pair x)
{
    if (FLT_EVAL_METHOD == 0)
        return (x + PAIR_WHOLE) - PAIR_WHOLE;
    return (pair) { nearbyint(x[0]), nearbyint(x[1]) };
}

#endif
