/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Clocks of steps, a pair at once, where the stepper goes as a parabola says.
 *
 * clock = (print_time - offset) * freq
 */
#ifndef STEPWAY_H
#define STEPWAY_H

#include "pair.h"

struct stepscale {
    double offset, freq;
};

/* Step i = 0, 1, ... is when speed * t + half_accel * t^2 comes to first + i, t
 * s after a print_time.  It never turns: all but half_accel are 0 or more. */
struct stepway {
    double first, speed, half_accel, start;
};

/* The same in ticks. */
struct stepticks {
    double first, base, twice, speed, speed2, four;
};

/* From step `done` on.  1e-300 is for 0 / 0. */
static inline struct stepticks
stepway_get_ticks(const struct stepway *w, const struct stepscale *s,
                  double done)
{
    struct stepticks t = {
        w->first + done, (w->start - s->offset) * s->freq, 2. * s->freq,
        w->speed + 1e-300, w->speed * w->speed, 4. * w->half_accel,
    };

    if (t.four == 0.) {
        t.twice = s->freq / t.speed;
        t.base += t.first * t.twice;
    }
    return t;
}

/* At a constant speed: clocks, not yet whole, of steps by their numbers. */
static inline pair
stepticks_get_even(const struct stepticks *t, pair number)
{
    return number * t->twice + t->base;
}

/* With any acceleration.  This form of the root does not cancel. */
static inline pair
stepticks_get_bent(const struct stepticks *t, pair number)
{
    pair x = number + t->first;
    pair root = pair_sqrt(pair_max(t->four * x + t->speed2, pair_of(0.)));

    return t->twice * x / (root + t->speed) + t->base;
}

static inline double
stepscale_get_clock(const struct stepscale *s, double print_time)
{
    return pair_round_one((print_time - s->offset) * s->freq);
}

static inline double
stepway_get_clock(const struct stepway *w, const struct stepscale *s,
                  double number)
{
    struct stepticks t = stepway_get_ticks(w, s, number);

    return pair_round_one(t.four == 0. ? stepticks_get_even(&t, pair_of(0.))[0]
                          : stepticks_get_bent(&t, pair_of(0.))[0]);
}

#endif
