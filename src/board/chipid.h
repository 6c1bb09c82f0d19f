/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: the number that no other chip has (CONFIG_HAVE_CHIPID).
 */
#ifndef BOARD_CHIPID_H
#define BOARD_CHIPID_H

#include <stdint.h>
#include "port.h"

/* --- The port provides --- */

/* Task, or irqs off at start: its bytes, in the order in which they lie in the
 * chip, and how many (at most 16).  They stay there. */
const uint8_t *chipid_get(uint8_t *len);

#endif
