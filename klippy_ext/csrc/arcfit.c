/* SPDX-License-Identifier: GPL-3.0-or-later
 * Steps along arcs by fits.  See arcfit.h. */
#include "arcfit.h"
#include "shaperfit.h"

/* Of fits, in mm (or radians) and in steps. */
#define ARC_ERROR 1e-10
#define STEP_ERROR 1e-8

struct walk {
    const struct itersolve *is;
    const struct trapseg *seg;
};

static double
find_position(void *data, double time)
{
    const struct walk *w = data;
    double t = time - w->seg->time, pos[3];

    t = fmin(fmax(t, 0.), w->seg->duration);
    trapseg_get_place(w->seg, trapseg_get_distance(w->seg, t), pos);
    return w->is->kind->get_position(w->is, pos);
}

int
arcfit_emit(struct itersolve *is, const struct trapseg *seg, double from,
            double to)
{
    struct walk w = { is, seg };

    if (trapseg_is_rest(seg))
        return 0;
    return shaperfit_emit_within(is, find_position, &w, is->kind->period,
                                 fmin(ARC_ERROR, STEP_ERROR * is->step_dist),
                                 seg->time + from, seg->time + to);
}
