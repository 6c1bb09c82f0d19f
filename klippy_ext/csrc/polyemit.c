/* SPDX-License-Identifier: GPL-3.0-or-later
 * Steps of polynomials.  See polyemit.h. */
#include <math.h>

#include "polyemit.h"
#include "polysolve.h"
#include "reply.h"
#include "shaperfit.h"

/* What is left out of a polynomial, in steps: less than STEP_SLACK, so that
 * pieces meet. */
#define CUT_ERROR 2e-7

struct poly {
    const double *q;
    int n;
    double time;
};

static double
get_place(void *data, double time)
{
    const struct poly *p = data;

    return poly_get(p->q, p->n, time - p->time);
}

/* How far each power goes in a time, and all of them together at most. */
static double
find_terms(const double *q, int n, double duration, double terms[POLY_SIZE])
{
    double power = 1., way = 0.;

    for (int k = 1; k <= n; k++) {
        power *= duration;
        terms[k] = fabs(q[k]) * power;
        way += terms[k];
    }
    return way;
}

/* The degree without high powers that do not matter. */
static int
cut(const double terms[POLY_SIZE], int n, double bound)
{
    double rest = 0.;

    while (n > 0 && rest + terms[n] <= bound)
        rest += terms[n--];
    return n;
}

/* As polyemit(), of degree two. */
static int
emit_parabola(struct itersolve *is, const double *q, double time,
              double duration)
{
    double scale = is->inv_step_dist;
    struct quadratic p = {
        time, itersolve_to_steps(is, q[0]), q[1] * scale, q[2] * scale,
    };
    double bent = fabs(p.p2) * duration * duration;

    if (fabs(p.p0 - (double)is->n_steps) + fabs(p.p1) * duration + bent < .5)
        return 0;
    if (bent <= CUT_ERROR)
        p.p2 = 0.;
    return itersolve_emit_quadratic(is, &p, 0., duration);
}

int
polyemit(struct itersolve *is, const double *q, int n, double time,
         double duration)
{
    double scale = is->inv_step_dist, terms[POLY_SIZE], at, way;

    if (n <= 2)
        return emit_parabola(is, q, time, duration);
    at = itersolve_to_steps(is, q[0]);
    way = find_terms(q, n, duration, terms);
    if (fabs(at - (double)is->n_steps) + way * scale < .5)
        return 0;
    n = cut(terms, n, CUT_ERROR * is->step_dist);
    if (n <= 2) {
        struct quadratic p = {
            time, at, n > 0 ? q[1] * scale : 0., n > 1 ? q[2] * scale : 0.,
        };
        return itersolve_emit_quadratic(is, &p, 0., duration);
    }
    if (n <= 4) {
        struct quartic p = {
            time, { at, q[1] * scale, q[2] * scale, q[3] * scale,
                    n > 3 ? q[4] * scale : 0. },
        };
        return polysolve_emit(is, &p, duration);
    } else {
        struct poly p = { q, n, time };
        return shaperfit_emit(is, get_place, &p, 0., time, time + duration);
    }
}
