/* SPDX-License-Identifier: GPL-3.0-or-later
 * The bent part of pressure advance.  See advancebend.h. */
#include <math.h>

#include "advancebend.h"

/* Spans are not cut shorter than this (s). */
#define SPAN_MIN 1e-6

double
advancebend_get(const struct bend *b, double speed)
{
    double x = speed * b->inv_velocity;

    return b->offset * (b->kind == ADVANCE_TANH ? tanh(x)
                                                : x / (1. + fabs(x)));
}

static double
get_quartic(const struct quartic *q, double t)
{
    const double *p = q->p;

    return p[0] + t * (p[1] + t * (p[2] + t * (p[3] + t * p[4])));
}

/* Where a bend is fitted exactly, and where the error is looked at; as parts
 * of the time. */
static const double fit_nodes[5] = {
    0., .14644660940672624, .5, .85355339059327376, 1.,
};
static const double fit_tests[4] = { .05, .31, .69, .95 };

/* Add to fit->p the polynomial in t / span through the bend of a speed, from
 * `from` on.  Returns its error (mm). */
static double
fit_bend(const struct bend *b, const struct quartic *speed, double from,
         double span, double fit[5])
{
    double c[5], error = 0.;

    for (int i = 0; i < 5; i++)
        c[i] = advancebend_get(
            b, get_quartic(speed, from + fit_nodes[i] * span));
    for (int k = 1; k < 5; k++)         /* divided differences */
        for (int i = 4; i >= k; i--)
            c[i] = (c[i] - c[i - 1]) / (fit_nodes[i] - fit_nodes[i - k]);
    for (int i = 0; i < 5; i++)
        fit[i] = 0.;
    for (int k = 4; k >= 0; k--) {      /* Horner's scheme in (t - node) */
        for (int i = 4; i > 0; i--)
            fit[i] = fit[i - 1] - fit_nodes[k] * fit[i];
        fit[0] = c[k] - fit_nodes[k] * fit[0];
    }
    for (int i = 0; i < 4; i++) {
        double x = fit_tests[i];
        double value = fit[0] + x * (fit[1] + x * (
            fit[2] + x * (fit[3] + x * fit[4])));
        error = fmax(error, fabs(value - advancebend_get(
            b, get_quartic(speed, from + x * span))));
    }
    return error;
}

/* q from `from` on, plus scale * fit. */
static struct quartic
join_fit(const struct quartic *q, double from, const double fit[5],
         double scale, double span)
{
    struct quartic sum = *q;

    sum.time += from;
    for (int k = 0; k < 4; k++)         /* Taylor's shift */
        for (int i = 3; i >= k; i--)
            sum.p[i] += from * sum.p[i + 1];
    for (int i = 0; i < 5; i++, scale /= span)
        sum.p[i] += scale * fit[i];
    return sum;
}

int
advancebend_emit(struct itersolve *is, const struct bend *b,
                 const struct quartic *q, const struct quartic *speed,
                 double duration)
{
    double from = 0., span = duration;
    int ret = 0;

    while (from < duration && !ret) {
        double fit[5], to;
        struct quartic sum;
        span = fmin(span, duration - from);
        while (fit_bend(b, speed, from, span, fit)
               > ADVANCEBEND_ERROR && span > SPAN_MIN)
            span *= .5;
        to = from + span < duration - SPAN_MIN ? from + span : duration;
        sum = join_fit(q, from, fit, is->inv_step_dist, span);
        ret = polysolve_emit(is, &sum, to - from);
        from = to;
        span *= 2.;
    }
    return ret;
}
