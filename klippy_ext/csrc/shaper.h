/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Input shaping: the path that a stepper follows is the planned one, averaged
 * over a little time so that a resonance of the machine is not excited.
 *
 * Each axis has impulses, x(t) = sum of weight[i] * planned(t - delay[i]), or a
 * kernel w, x(t) = integral from -1 to 1 of w(u) * planned(t - u * half).
 * Delays may be negative: the average is centred.  What comes out are
 * polynomials (kinkpath.h): of degree two where impulses are used, so that step
 * times of linear kinematics have a closed form; all else is fitted by
 * polynomials of degree four.
 *
 * Units: mm, s, print_time.  A path belongs to one stepper.
 */
#ifndef SHAPER_H
#define SHAPER_H

#include "itersolve.h"
#include "kinkpath.h"

#define SHAPER_ERROR 1e-8       /* mm (or radians), of fits */

struct shaper_path {
    struct shaper_axis axes[3];
    struct reply replies[3];
    double pre, post;           /* s of the plan needed around a time */
    double barrier;             /* what was before this does not count */
    double weights[3][3];       /* of the axes, by channel of `kinks` */
    struct kink_source source;
    struct kinkpath kinks;
    int degrees[3];             /* of the polynomials of axes, as it matters */
};

/* NULL when out of memory. */
struct shaper_path *shaper_path_new(void);
void shaper_path_delete(struct shaper_path *path);
/* Once, before use.  Returns 0, or -EINVAL for values that are not finite,
 * too many of them, or a sum that is not 1. */
int shaper_path_set_axis(struct shaper_path *path, int axis,
                         const struct shaper_axis *shaper);
/* Are axes averaged alike? */
int shaper_path_is_same(const struct shaper_path *path, int a, int b);

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
