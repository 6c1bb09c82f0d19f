/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Input shaping: the path that a stepper follows is the planned one, averaged
 * over a little time so that a resonance of the machine is not excited.
 *
 * Each axis has impulses, x(t) = sum of weight[i] * planned(t - delay[i]), or a
 * kernel w, x(t) = integral from -1 to 1 of w(u) * planned(t - u * half).
 * Delays may be negative: the average is centred.  Where only impulses are
 * used and the kinematics are linear, the path is a polynomial of degree two
 * between the borders of segments, and step times have a closed form; all
 * else is fitted by polynomials of degree four.
 *
 * Units: mm, s, print_time.  A path belongs to one stepper.
 */
#ifndef SHAPER_H
#define SHAPER_H

#include "itersolve.h"

enum {
    SHAPER_IMPULSES_MAX = 5,
    SHAPER_COEFFS_MAX = 16,
    SHAPER_TAPS_MAX = 3 * SHAPER_IMPULSES_MAX,
};

#define SHAPER_ERROR 1e-8       /* mm (or radians), of fits */

/* Neither impulses nor coefficients: the axis is not shaped. */
struct shaper_axis {
    int n_impulses;
    double weights[SHAPER_IMPULSES_MAX];        /* their sum is 1 */
    double delays[SHAPER_IMPULSES_MAX];         /* s */
    int n_coeffs;
    double coeffs[SHAPER_COEFFS_MAX];   /* of w by power of u; integral 1 */
    double half;                        /* s */
};

/* A place of the plan that the path depends on, with what is planned there
 * until `end`: p + (v + h * t) * t after `begin`, times of the path. */
struct shaper_tap {
    double delay, weight[3];    /* weights are 0 at the ends of a kernel */
    uint64_t cursor;
    double begin, end;
    double p[3], v[3], h[3];
};

struct shaper_path {
    struct shaper_axis axes[3];
    double moments[3][3][SHAPER_COEFFS_MAX + 3];
    int n_taps;
    uint32_t kernel_axes;       /* ITERSOLVE_X ... */
    struct shaper_tap taps[SHAPER_TAPS_MAX];
    double pre, post;           /* s of the plan needed around a time */
    double barrier;             /* what was before this does not count */
};

/* NULL when out of memory. */
struct shaper_path *shaper_path_new(void);
void shaper_path_delete(struct shaper_path *path);
/* Once, before use.  Returns 0, or -EINVAL for values that are not finite,
 * too many of them, or a sum that is not 1. */
int shaper_path_set_axis(struct shaper_path *path, int axis,
                         const struct shaper_axis *shaper);

/* Follow this path from now on (NULL: the plan).  All steps must be made, and
 * the plan must rest as far as the old and the new path look. */
void shaper_attach(struct itersolve *is, struct shaper_path *path);
/* The position is another one from here on: what was before does not count. */
void shaper_forget(struct itersolve *is);
/* As itersolve_generate(), between two times. */
int shaper_emit(struct itersolve *is, double start, double end);
/* Where the path is (mm), for tests.  Returns 0, or -EINVAL without a plan. */
int shaper_get_position(struct shaper_path *path, const struct trapq *tq,
                        double time, double pos[3]);
/* 0, or a negative number that says which invariant does not hold. */
int shaper_path_check(const struct shaper_path *path);

#endif
