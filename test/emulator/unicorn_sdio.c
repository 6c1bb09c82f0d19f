/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * SDIO of an STM32F4 (RM0090, 31), and an SD card of 64 blocks at its pins (SD
 * physical layer, simplified specification, 4 and 5).
 */
#include <string.h>

#include "unicorn_stm32.h"

enum { POWER, CLKCR, ARG, CMD, RESPCMD, RESP1, DTIMER = 9, DLEN, DCTRL, DCOUNT,
       STA, ICR, FIFO = 0x80 / 4 };
enum { CCRCFAIL = 1, DCRCFAIL = 2, CTIMEOUT = 4, DTIMEOUT = 8, TXUNDERR = 0x10,
       RXOVERR = 0x20, CMDREND = 0x40, CMDSENT = 0x80, DATAEND = 0x100,
       DBCKEND = 0x400, TXFIFOF = 1 << 16, RXDAVL = 1 << 21 };
enum { N_BLOCKS = 64, BLOCK = 512, FIFO_WORDS = 32, RCA = 0x1234,
       ACCESS_CLOCKS = 200 };
enum { IDLE, READY, IDENT, STANDBY, TRANSFER };

static struct {
    uint8_t blocks[N_BLOCKS][BLOCK];
    uint32_t state, n_asked;
    bool is_application, is_wide;
    int block;                  /* to read or to write; -1 none */
} card;
/* The controller: flags to come, and when; the words of a block */
static uint32_t flags, coming, n_moved, n_due;
static uint64_t answered_at, data_from;
static bool is_active, has_data;
static uint32_t words[BLOCK / 4];

static uint32_t
clock_hz(const struct device *d)
{
    uint32_t pll = chip.rcc->regs[1];
    uint32_t in = pll & 1 << 22 ? chip.hse_hz : chip.model->hsi_hz;
    uint32_t hz = in / (pll & 63) * (pll >> 6 & 511) / (pll >> 24 & 15);

    if (hz > 48000000 || d->regs[POWER] != 3 || !(d->regs[CLKCR] & 0x100)) {
        chip_fault("SDIO is off, or of %u Hz", hz);
        return 1000000;
    }
    return hz / ((d->regs[CLKCR] & 255) + 2);
}

static uint64_t
cycles_of(const struct device *d, uint32_t clocks)
{
    return (uint64_t)clocks * chip.core_hz / clock_hz(d);
}

static uint32_t
width_of(const struct device *d)
{
    return d->regs[CLKCR] & 1 << 11 ? 4 : 1;
}

/*
 * The card: what it answers to, 0 if it does not
 */

static uint32_t
answer_application(uint32_t command, uint32_t arg, uint32_t *answer)
{
    if (command == 41 && card.state <= READY) {
        card.state = ++card.n_asked > 2 ? READY : IDLE;
        answer[0] = 0x40ff8000 | (card.state == READY ? 1u << 31 : 0);
        return CCRCFAIL;        /* has no checksum */
    }
    if (command == 6 && card.state == TRANSFER) {
        card.is_wide = arg == 2;
        answer[0] = TRANSFER << 9 | 1 << 5;
        return CMDREND;
    }
    return 0;
}

static uint32_t
answer_identification(uint32_t command, uint32_t arg, uint32_t *answer)
{
    if (command == 8 && card.state == IDLE) {
        answer[0] = arg & 0xfff;
        return CMDREND;
    }
    if (command == 2 && card.state == READY) {
        card.state = IDENT;
        memcpy(answer, (uint32_t[]) { 0x03534453, 0x44303847, 0x80112233,
                                      0x44014500 }, 16);
        return CMDREND;
    }
    if (command == 3 && card.state == IDENT) {
        card.state = STANDBY;
        answer[0] = (uint32_t)RCA << 16 | 0x500;
        return CMDREND;
    }
    if (command == 7 && card.state == STANDBY && arg >> 16 == RCA) {
        card.state = TRANSFER;
        answer[0] = 0x700;
        return CMDREND;
    }
    return 0;
}

static uint32_t
answer_command(uint32_t command, uint32_t arg, uint32_t *answer)
{
    bool is_application = card.is_application;

    card.is_application = false;
    if (is_application)
        return answer_application(command, arg, answer);
    answer[0] = card.state << 9 | 1u << 8;
    if (command == 55) {
        card.is_application = true;
        answer[0] |= 1 << 5;
        return CMDREND;
    }
    if ((command == 17 || command == 24) && card.state == TRANSFER) {
        card.block = arg < N_BLOCKS ? (int)arg : -1;
        if (card.block < 0)
            answer[0] |= 1u << 31;
        return CMDREND;
    }
    if (command == 16 && card.state == TRANSFER && arg == BLOCK)
        return CMDREND;
    if (command == 13 && arg >> 16 == RCA)
        return CMDREND;
    return answer_identification(command, arg, answer);
}

static void
send_command(struct device *d, uint32_t value)
{
    uint32_t command = value & 63, kind = value >> 6 & 3, answer[4] = { 0 };
    uint32_t pin;

    for (pin = 40; pin <= 44; pin++)
        stm32_check_pin(pin, 12);
    stm32_check_pin(50, 12);
    if (card.state < STANDBY && clock_hz(d) > 400000)
        chip_fault("the card is identified at %u Hz", clock_hz(d));
    answered_at = chip.cycle + cycles_of(d, kind & 1 ? kind & 2 ? 200 : 112
                                         : 56);
    if (command == 0) {
        card.state = IDLE;
        card.n_asked = 0;
        card.is_application = card.is_wide = false;
        coming = CMDSENT;
        return;
    }
    coming = answer_command(command, d->regs[ARG], answer);
    if (!coming)
        coming = CTIMEOUT;
    else if ((command == 2) != (kind == 3))
        coming = CCRCFAIL;      /* an answer of another length */
    memcpy(&d->regs[RESP1], answer, sizeof(answer));
    if (command == 17)
        data_from = answered_at + cycles_of(d, ACCESS_CLOCKS);
}

/*
 * Data: word by word
 */

static bool
is_read(const struct device *d)
{
    return d->regs[DCTRL] & 2;
}

static void
start_data(struct device *d, uint32_t value)
{
    is_active = value & 1;
    has_data = false;
    n_moved = n_due = 0;
    if (!is_active)
        return;
    if (d->regs[DLEN] != BLOCK || (value >> 4 & 15) != 9)
        chip_fault("SDIO moves %u bytes", d->regs[DLEN]);
    data_from = chip.cycle + cycles_of(d, d->regs[DTIMER]);
    card.block = is_read(d) ? -1 : card.block;
}

static void
end_data(struct device *d)
{
    bool fits = width_of(d) == (card.is_wide ? 4u : 1u);

    is_active = false;
    flags |= fits ? DBCKEND | DATAEND : DCRCFAIL;
    if (fits && !is_read(d))
        memcpy(card.blocks[card.block], words, BLOCK);
    card.block = -1;
}

/* How many words have been on the wires by now. */
static void
run_data(struct device *d)
{
    uint64_t word = cycles_of(d, 32 / width_of(d));
    uint32_t n;

    if (!is_active || chip.cycle < data_from)
        return;
    if (card.block < 0) {
        flags |= DTIMEOUT;
        is_active = false;
        return;
    }
    if (!is_read(d) && !n_moved)
        return;                 /* it begins with the first word */
    n = (uint32_t)((chip.cycle - data_from) / word);
    n_due = n < BLOCK / 4 ? n : BLOCK / 4;
    if (is_read(d) && n_due > n_moved + FIFO_WORDS)
        flags |= RXOVERR;
    if (!is_read(d) && n_due > n_moved)
        flags |= TXUNDERR;
    if (n >= BLOCK / 4 + 1 && (n_moved == BLOCK / 4 || is_read(d))
        && !(flags & (RXOVERR | TXUNDERR)) && n_moved == BLOCK / 4)
        end_data(d);
}

static uint32_t
status(struct device *d)
{
    uint32_t now = 0;

    if (coming && chip.cycle >= answered_at) {
        flags |= coming;
        coming = 0;
    }
    run_data(d);
    if (is_active && is_read(d) && n_due > n_moved)
        now |= RXDAVL;
    if (is_active && !is_read(d) && n_moved - n_due >= FIFO_WORDS)
        now |= TXFIFOF;
    return flags | now;
}

static uint32_t
read_fifo(struct device *d)
{
    uint32_t word;

    run_data(d);
    if (!is_active || n_due <= n_moved) {
        chip_fault("SDIO's fifo is empty");
        return 0;
    }
    memcpy(&word, &card.blocks[card.block][4 * n_moved++], 4);
    return word;
}

static void
write_fifo(struct device *d, uint32_t value)
{
    run_data(d);
    if (!is_active || n_moved == BLOCK / 4
        || n_moved - n_due >= FIFO_WORDS) {
        chip_fault("SDIO's fifo is full");
        return;
    }
    if (!n_moved)
        data_from = chip.cycle + cycles_of(d, 8);
    words[n_moved++] = value;
}

uint32_t
sdio_read(struct device *d, uint32_t word)
{
    if (word == STA)
        return status(d);
    return word == FIFO ? read_fifo(d) : d->regs[word];
}

void
sdio_write(struct device *d, uint32_t word, uint32_t value)
{
    d->regs[word] = value;
    if (word == CMD && value & 1 << 10)
        send_command(d, value);
    else if (word == DCTRL)
        start_data(d, value);
    else if (word == ICR)
        flags &= ~value;
    else if (word == FIFO)
        write_fifo(d, value);
}

void
sdio_reset(struct device *d)
{
    uint32_t i, j;

    (void)d;
    memset(&card, 0, sizeof(card));
    card.block = -1;
    for (i = 0; i < N_BLOCKS; i++)
        for (j = 0; j < BLOCK; j++)
            card.blocks[i][j] = (uint8_t)(i * 31 + j * 7);
    flags = coming = 0;
    is_active = false;
}
