/* SPDX-License-Identifier: GPL-3.0-or-later
 * Objects that the host configures and addresses by number.
 */
#ifndef CORE_OID_H
#define CORE_OID_H

#include <stdint.h>
#include "board/mem.h"
#include "core/decl.h"

/* One per type of object; its address tells the types apart. */
struct oid_kind {
    uint16_t size;
};

/* Task: a new zeroed object under this number.  Set its pins up first: an
 * object with a pin that does not exist must not meet the shutdown. */
void *oid_new(uint8_t oid, const ROM struct oid_kind *kind);

/* Task: the object with this number; shutdown if it is of another kind. */
void *oid_lookup(uint8_t oid, const ROM struct oid_kind *kind);

/* Walk all objects of a kind: start with *oid = -1; NULL at the end. */
void *oid_next(int16_t *oid, const ROM struct oid_kind *kind);

#endif
