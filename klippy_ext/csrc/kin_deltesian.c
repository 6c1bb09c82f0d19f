/* SPDX-License-Identifier: GPL-3.0-or-later
 * Carriages of a deltesian.  See kin_deltesian.h. */
#include <stddef.h>

#include "kin_deltesian.h"

struct kin_delta *
kin_deltesian_new(double arm2, double tower_x)
{
    struct kin_delta *k = kin_delta_new(arm2, tower_x, 0.);

    if (!k)
        return NULL;
    k->y_share = 0.;
    k->is.active_axes = ITERSOLVE_X | ITERSOLVE_Z;
    return k;
}
