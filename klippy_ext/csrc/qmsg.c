/* SPDX-License-Identifier: GPL-3.0-or-later
 * Memory of encoded commands.  See qmsg.h. */
#include <stdlib.h>

#include "qmsg.h"

struct qmsg *
qmsg_new(void)
{
    return calloc(1, sizeof(struct qmsg));
}

void
qmsg_free(struct qmsg *m)
{
    free(m);
}

void
qfifo_clear(struct qfifo *f)
{
    struct qmsg *m;

    while ((m = qfifo_pop(f)) != NULL)
        qmsg_free(m);
}

int
qfifo_check(const struct qfifo *f)
{
    const struct qmsg *last = NULL;

    for (const struct qmsg *m = f->head; m; m = m->next) {
        if (m->len > sizeof(m->data))
            return -72;
        last = m;
    }
    return last == f->tail ? 0 : -73;
}
