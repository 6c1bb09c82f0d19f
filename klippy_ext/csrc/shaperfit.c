/* SPDX-License-Identifier: GPL-3.0-or-later
 * Steps of fitted positions.  See shaperfit.h. */
#include <math.h>

#include "polysolve.h"
#include "shaper.h"
#include "shaperfit.h"

/* Spans are not cut shorter than this (s). */
#define SPAN_MIN 1e-6
/* Of fits, in steps: angles have small ones. */
#define STEP_ERROR 2e-6
enum { NODES = 9 };

/* A function over [from, from + span], at 9 places: those with even numbers
 * make the polynomial, the others tell its error. */
struct sample {
    double from, span;
    double values[NODES];
};

/* Parts of the span. */
static const double places[NODES] = {
    0., .05, .14644660940672624, .31, .5, .69, .85355339059327376, .95, 1.,
};

static void
take_sample(struct sample *s, shaperfit_get get, void *data, double period,
            double near)
{
    for (int i = 0; i < NODES; i++) {
        double value = get(data, s->from + places[i] * s->span);
        if (period != 0.)
            value += period * floor((near - value) / period + .5);
        s->values[i] = near = value;
    }
}

/* Newton's form through the even places, to powers of the part. */
static void
fit_sample(const struct sample *s, double fit[5])
{
    double c[5];

    for (int i = 0; i < 5; i++) {
        c[i] = s->values[2 * i];
        fit[i] = 0.;
    }
    for (int k = 1; k < 5; k++)
        for (int i = 4; i >= k; i--)
            c[i] = (c[i] - c[i - 1])
                / (places[2 * i] - places[2 * (i - k)]);
    for (int k = 4; k >= 0; k--) {
        for (int i = 4; i > 0; i--)
            fit[i] = fit[i - 1] - places[2 * k] * fit[i];
        fit[0] = c[k] - places[2 * k] * fit[0];
    }
}

static double
get_error(const struct sample *s, const double fit[5])
{
    double error = 0.;

    for (int i = 1; i < NODES; i += 2) {
        double x = places[i];
        double value = fit[0] + x * (fit[1] + x * (
            fit[2] + x * (fit[3] + x * fit[4])));
        error = fmax(error, fabs(value - s->values[i]));
    }
    return error;
}

static int
emit_fit(struct itersolve *is, const struct sample *s, const double fit[5])
{
    struct quartic q = { .time = s->from };
    double scale = is->inv_step_dist;

    for (int i = 0; i < 5; i++, scale /= s->span)
        q.p[i] = (fit[i] - (i ? 0. : is->origin)) * scale;
    return polysolve_emit(is, &q, s->span);
}

int
shaperfit_emit_within(struct itersolve *is, shaperfit_get get, void *data,
                      double period, double error, double from, double to)
{
    struct sample s = { .from = from };
    double span = to - from;
    int ret = 0;

    while (s.from < to && !ret) {
        double fit[5], near = itersolve_get_commanded_pos(is);
        s.span = span < to - s.from - SPAN_MIN ? span : to - s.from;
        for (;;) {
            take_sample(&s, get, data, period, near);
            fit_sample(&s, fit);
            if (get_error(&s, fit) <= error || s.span <= SPAN_MIN)
                break;
            s.span *= .5;
        }
        ret = emit_fit(is, &s, fit);
        span = 2. * s.span;
        s.from = s.span < to - s.from ? s.from + s.span : to;
    }
    return ret;
}

int
shaperfit_emit(struct itersolve *is, shaperfit_get get, void *data,
               double period, double from, double to)
{
    return shaperfit_emit_within(
        is, get, data, period,
        fmin(SHAPER_ERROR, STEP_ERROR * is->step_dist), from, to);
}
