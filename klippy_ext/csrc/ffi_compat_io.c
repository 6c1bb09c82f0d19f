/* SPDX-License-Identifier: GPL-3.0-or-later
 * The part of the plug-ins' C surface that belongs to the links: names and
 * signatures that plug-ins call through chelper.get_ffi(). */
#include "trdispatch.h"

struct trdispatch *trdispatch_alloc(void);
void trdispatch_start(struct trdispatch *td, uint32_t dispatch_reason);
void trdispatch_stop(struct trdispatch *td);

/* The plug-in ends it by free(). */
struct trdispatch *
trdispatch_alloc(void)
{
    return trdispatch_new();
}

void
trdispatch_start(struct trdispatch *td, uint32_t dispatch_reason)
{
    trdispatch_arm(td, dispatch_reason);
}

void
trdispatch_stop(struct trdispatch *td)
{
    trdispatch_disarm(td);
}
