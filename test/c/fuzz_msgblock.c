/* SPDX-License-Identifier: GPL-3.0-or-later
 * libFuzzer target: the parsers of the wire protocol read inside their buffer
 * and agree with what they build.  See test_c_io.py for how it is compiled. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sqcore.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void
fail(const char *why)
{
    fprintf(stderr, "msgblock: %s\n", why);
    abort();
}

static void
check_block(const uint8_t *block, size_t len)
{
    uint8_t again[MSGBLOCK_MAX];

    msgblock_build(again, block[1], block + MSGBLOCK_HEADER,
                   len - MSGBLOCK_MIN);
    if (memcmp(again, block, len))
        fail("an accepted block is not what would be built");
}

static void
split(const uint8_t *data, size_t size)
{
    size_t pos = 0;

    while (pos < size) {
        int found = msgblock_check(data + pos, size - pos);
        if (!found) {
            if (size - pos >= MSGBLOCK_MAX)
                fail("a full buffer is not enough");
            break;
        }
        if (found > 0)
            check_block(data + pos, (size_t)found);
        pos += (size_t)abs(found);
    }
    if (pos > size)
        fail("more taken than given");
}

static void
read_ints(const uint8_t *data, size_t size)
{
    const uint8_t *p = data, *end = data + size;
    uint32_t value, again;

    while (!msgblock_get_int(&p, end, &value)) {
        uint8_t buf[MSGBLOCK_VLQ_MAX];
        const uint8_t *q = buf;
        uint8_t *buf_end = msgblock_put_int(buf, value);
        if (msgblock_get_int(&q, buf_end, &again) || q != buf_end
            || again != value)
            fail("an integer changes when it is written again");
    }
}

/* The whole receiver: any bytes, in any pieces, while blocks are out. */
static void
receive(const uint8_t *data, size_t size)
{
    static struct sqcore core;
    struct cmdqueue *cq;
    struct qfifo batch = { NULL, NULL };

    if (sqcore_init(&core))
        abort();
    cq = cmdsched_add_queue(&core.sched);
    for (int i = 0; i < 20; i++) {
        struct qmsg *m = qmsg_new();
        m->len = 59;
        m->notify_id = 1;
        qfifo_push(&batch, m);
    }
    cmdsched_push(&core.sched, cq, &batch);
    for (size_t pos = 0, piece; pos < size; pos += piece) {
        piece = 1 + data[pos] % 80;
        if (piece > size - pos)
            piece = size - pos;
        sqcore_run(&core, (double)pos);
        core.out_len = 0;
        sqcore_input(&core, (double)pos, data + pos, piece);
        if (sqcore_check(&core))
            fail("the receiver is inconsistent");
    }
    sqcore_free(&core);
}

int
LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    uint8_t *exact = malloc(size ? size : 1);

    if (!exact)
        abort();
    memcpy(exact, data, size);
    split(exact, size);
    read_ints(exact, size);
    receive(exact, size);
    free(exact);
    return 0;
}
