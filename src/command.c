/* SPDX-License-Identifier: GPL-3.0-or-later
 * The wire protocol: blocks in, blocks out. */
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "board/console.h"
#include "core/boot_request.h"
#include "core/command.h"
#include "core/sched.h"

enum { HEADER = 2, TRAILER = 3 };

static struct task_wake rx_wake;
static uint8_t next_seq = COMMAND_DEST;
static uint8_t block_in_work; /* bytes; its handlers may shut down */
static bool is_lost;          /* looking for the end of a broken block */


/* ---- Checksum ---- */

static uint16_t crc16_ccitt(const uint8_t *buf, uint8_t len)
{
    uint8_t low = 0xff, high = 0xff;

    while (len--) {
        uint8_t x = (uint8_t)(*buf++ ^ low);
        x ^= (uint8_t)(x << 4);
        low = (uint8_t)(high ^ (x >> 4) ^ (x << 3));
        high = (uint8_t)(x ^ (x >> 5));
    }
    return (uint16_t)((uint16_t)high << 8 | low);
}


/* ---- Output ---- */

uint8_t *command_begin(uint8_t size)
{
    uint8_t *block;

    if (size > COMMAND_PAYLOAD_MAX)
        shutdown("Message encode error");
    block = console_reserve((uint8_t)(size + COMMAND_BLOCK_MIN));
    return block ? block + HEADER : NULL;
}

void command_end(uint8_t *start, uint8_t *end)
{
    uint8_t *block = start - HEADER;
    uint8_t len = (uint8_t)(end - block + TRAILER);
    uint16_t crc;

    block[0] = len;
    block[1] = next_seq;
    crc = crc16_ccitt(block, (uint8_t)(len - TRAILER));
    end[0] = (uint8_t)(crc >> 8);
    end[1] = (uint8_t)crc;
    end[2] = COMMAND_SYNC;
    console_commit(len);
}

/* An empty block tells which sequence number is expected next. */
static void send_ack(void)
{
    uint8_t *start = command_begin(0);

    if (start)
        command_end(start, start);
}


/* ---- Input ---- */

void console_note_rx(void)
{
    sched_wake(&rx_wake);
}

/* Bytes of the block at buf; 0: incomplete; -1: this is no block. */
static int check_block(const uint8_t *buf, uint8_t have)
{
    uint8_t len = buf[0];
    uint16_t crc;

    if (len < COMMAND_BLOCK_MIN || len > COMMAND_BLOCK_MAX)
        return -1;
    if (have >= HEADER && (buf[1] & ~COMMAND_SEQ_MASK) != COMMAND_DEST)
        return -1;
    if (have < len)
        return 0;
    if (buf[len - 1] != COMMAND_SYNC)
        return -1;
    crc = crc16_ccitt(buf, (uint8_t)(len - TRAILER));
    if (buf[len - 3] != (uint8_t)(crc >> 8) || buf[len - 2] != (uint8_t)crc) {
#if CONFIG_HAVE_BOOTLOADER_REQUEST
        boot_request_check(buf, len);
#endif
        return -1;
    }
    return len;
}

static void finish_block(void)
{
    console_consume(block_in_work);
    block_in_work = 0;
    send_ack();
}

static void run_block(const uint8_t *block, uint8_t len)
{
    const uint8_t *p = block + HEADER, *end = block + len - TRAILER;

    block_in_work = len;
    if (block[1] == next_seq) {
        next_seq = (uint8_t)(((next_seq + 1) & COMMAND_SEQ_MASK)
                             | COMMAND_DEST);
        while (p < end)
            p = command_run(p, end);
    }
    finish_block();
}

/* Skip to the end of the broken block, then ask for it again. */
static void find_sync(const uint8_t *buf, uint8_t have)
{
    const uint8_t *sync = memchr(buf, COMMAND_SYNC, have);

    is_lost = !sync;
    console_consume(sync ? (uint8_t)(sync - buf + 1) : have);
    if (sync)
        send_ack();
}

/* Handle what lies at the start of the input; false: nothing to do yet. */
static bool take_input(void)
{
    const uint8_t *buf;
    uint8_t have = console_peek(&buf);
    int len;

    if (!have)
        return false;
    if (!is_lost && buf[0] == COMMAND_SYNC) {
        console_consume(1);
        return true;
    }
    len = is_lost ? -1 : check_block(buf, have);
    if (len > 0)
        run_block(buf, (uint8_t)len);
    else if (len < 0)
        find_sync(buf, have);
    return len != 0;
}

/* One block a pass, so that other tasks get their turn. */
void command_task(void)
{
    if (sched_take(&rx_wake) && take_input())
        sched_wake(&rx_wake);
}
DECL_TASK(command_task);

/* The block that caused the shutdown must not be run again. */
void command_shutdown(void)
{
    if (block_in_work)
        finish_block();
    sched_wake(&rx_wake);
}
DECL_SHUTDOWN(command_shutdown);
