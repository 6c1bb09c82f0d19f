/* SPDX-License-Identifier: GPL-3.0-or-later
 * Replies of averages.  See reply.h. */
#include <errno.h>
#include <math.h>
#include <string.h>

#include "reply.h"

#define SUM_ERROR 1e-9

int
shaper_axis_check(const struct shaper_axis *shaper)
{
    double sum = 0.;

    if (shaper->n_impulses < 0 || shaper->n_impulses > SHAPER_IMPULSES_MAX
        || shaper->n_coeffs < 0 || shaper->n_coeffs > SHAPER_COEFFS_MAX)
        return -EINVAL;
    if (!shaper->n_impulses && !shaper->n_coeffs)
        return 0;
    if (shaper->n_impulses && shaper->n_coeffs)
        return -EINVAL;
    for (int i = 0; i < shaper->n_impulses; i++) {
        sum += shaper->weights[i];
        if (!isfinite(shaper->delays[i]))
            return -EINVAL;
    }
    for (int i = 0; i < shaper->n_coeffs; i += 2)
        sum += 2. * shaper->coeffs[i] / (i + 1);
    if (shaper->n_coeffs && !(shaper->half > 0. && isfinite(shaper->half)))
        return -EINVAL;
    return fabs(sum - 1.) < SUM_ERROR ? 0 : -EINVAL;
}

/* ---- Without the mean on top ---- */

static void
add_impulse(struct reply *r, double weight, double delay)
{
    struct reply_event *e = &r->events[r->n_events++];

    e->delay = delay;
    e->c[0] = weight;
    for (int i = 0; i < KINK_SIZE; i++, weight *= delay)
        r->means[i] += weight;
}

/* The density of the kernel sets in at u = edge (-1), or stops there (1): its
 * integral from there on, by power of the time since. */
static void
add_edge(struct reply *r, const struct shaper_axis *s, double edge)
{
    struct reply_event *e = &r->events[r->n_events++];
    double b[SHAPER_COEFFS_MAX], scale = -edge;

    e->delay = edge * s->half;
    memcpy(b, s->coeffs, sizeof(b));
    poly_shift(b, s->n_coeffs - 1, edge);
    for (int k = 0; k < s->n_coeffs; k++) {
        scale /= s->half;
        e->c[k + 1] = scale * b[k] / (k + 1);
    }
    e->low = 1;
    e->high = s->n_coeffs;
}

static void
add_kernel(struct reply *r, const struct shaper_axis *s)
{
    add_edge(r, s, -1.);
    add_edge(r, s, 1.);
    for (int k = 0; k < KINK_SIZE; k++)
        for (int i = k & 1; i < s->n_coeffs; i += 2)
            r->means[k] += 2. * s->coeffs[i] / (i + k + 1)
                * pow(s->half, k);
}

/* ---- The mean on top ---- */

/* It is the second difference of the second integral.  The mean of the square
 * of its own delays is half^2 / 6, of the fourth power half^4 / 15. */
static void
smooth(struct reply *r, double half)
{
    static const double gains[3] = { 1., -2., 1. };
    struct reply plain = *r;

    r->n_events = 0;
    for (int i = 0; i < plain.n_events; i++)
        for (int k = 0; k < 3; k++) {
            struct reply_event *e = &r->events[r->n_events++];
            const struct reply_event *p = &plain.events[i];
            memset(e, 0, sizeof(*e));
            e->delay = p->delay + (k - 1) * half;
            e->low = p->low + 2;
            e->high = p->high + 2;
            for (int n = p->low; n <= p->high; n++)
                e->c[n + 2] = gains[k] * p->c[n]
                    / (half * half * (n + 1) * (n + 2));
        }
    r->means[4] += plain.means[2] * half * half
        + half * half * half * half / 15.;
    r->means[3] += plain.means[1] * .5 * half * half;
    r->means[2] += half * half / 6.;
}

void
reply_make(struct reply *r, const struct shaper_axis *shaper, double half)
{
    memset(r, 0, sizeof(*r));
    if (shaper->n_coeffs)
        add_kernel(r, shaper);
    else if (!shaper->n_impulses)
        add_impulse(r, 1., 0.);
    for (int i = 0; i < shaper->n_impulses; i++)
        add_impulse(r, shaper->weights[i], shaper->delays[i]);
    if (half > 0.)
        smooth(r, half);
    for (int i = 0; i < r->n_events; i++)
        if (r->degree < r->events[i].high + 2)
            r->degree = r->events[i].high + 2;
}

double
reply_get_pre(const struct reply *r)
{
    double pre = 0.;

    for (int i = 0; i < r->n_events; i++)
        pre = fmax(pre, r->events[i].delay);
    return pre;
}

double
reply_get_post(const struct reply *r)
{
    double post = 0.;

    for (int i = 0; i < r->n_events; i++)
        post = fmax(post, -r->events[i].delay);
    return post;
}

/* Of integrals of powers: 1 / (k + 1). */
static const double inverse[REPLY_SIZE + KINK_SIZE - 2] = {
    1., 1. / 2., 1. / 3., 1. / 4., 1. / 5., 1. / 6., 1. / 7., 1. / 8.,
    1. / 9., 1. / 10., 1. / 11., 1. / 12., 1. / 13., 1. / 14., 1. / 15.,
    1. / 16., 1. / 17., 1. / 18.,
};

/* The two highest powers of an arc. */
static void
add_high(const struct reply_event *e, const double jump[KINK_SIZE],
         double q[POLY_SIZE])
{
    for (int k = e->low; k <= e->high; k++) {
        double high = 6. * e->c[k] * inverse[k] * inverse[k + 1]
            * inverse[k + 2];
        q[k + 3] += jump[3] * high;
        q[k + 4] += 4. * jump[4] * high * inverse[k + 3];
    }
}

void
reply_add_spline(const struct reply_event *e, const double jump[KINK_SIZE],
                 int n, double q[POLY_SIZE])
{
    double place = jump[0], speed = jump[1], twice = 2. * jump[2];

    for (int k = e->low; k <= e->high; k++) {
        double once = e->c[k] * inverse[k];
        q[k] += place * e->c[k];
        q[k + 1] += speed * once;
        q[k + 2] += twice * once * inverse[k + 1];
    }
    if (n > 3)
        add_high(e, jump, q);
}

/* Once all events are over, the reply to a step is the step. */
int
reply_check(const struct reply *r)
{
    double q[POLY_SIZE] = { 0. };
    double end = reply_get_pre(r), size = 0.;

    if (r->n_events < 1 || r->n_events > REPLY_EVENTS_MAX
        || r->degree >= POLY_SIZE)
        return -50;
    for (int i = 0; i < r->n_events; i++) {
        const struct reply_event *e = &r->events[i];
        if (e->low < 0 || e->high >= REPLY_SIZE || e->low > e->high)
            return -51;
        q[0] += poly_get(e->c, e->high, end - e->delay);
        size += fabs(e->c[e->high]) * pow(end - e->delay, e->high);
    }
    return fabs(q[0] - 1.) < 1e-8 + 1e-12 * size ? 0 : -52;
}
