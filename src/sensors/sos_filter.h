/* SPDX-License-Identifier: GPL-3.0-or-later
 * Digital filter of second order sections, in integers.
 *
 * A section is y = b0 x + s0, then s0 = b1 x - a1 y + s1 and
 * s1 = b2 x - a2 y (direct form II transposed, a0 = 1); its coefficients are
 * fixed point numbers.
 */
#ifndef SENSORS_SOS_FILTER_H
#define SENSORS_SOS_FILTER_H

#include <stdbool.h>
#include <stdint.h>

struct sos_filter;

/* Task: the object of config_sos_filter. */
struct sos_filter *sos_filter_lookup(uint8_t oid);

/* Task: filter a reading in place: offset, scale, then all active sections.
 * False if a number did not fit into 32 bits. */
bool sos_filter_apply(struct sos_filter *filter, int32_t *value);

#endif
