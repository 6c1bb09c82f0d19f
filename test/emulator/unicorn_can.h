/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * CAN controllers on a bus that a test keeps: it asks for the frame that wants
 * to be sent, tells how that went, and delivers those of others.
 */
#ifndef UNICORN_CAN_H
#define UNICORN_CAN_H

#include "unicorn_stm32.h"

/* Flags of `id` as Linux has them: bit 31 extended, bit 30 remote. */
struct can_frame {
    uint32_t id, len;
    uint8_t data[8];
};

/* How sending went; CAN_BIT_ERROR: the bus did not take the level sent. */
enum can_outcome { CAN_SENT, CAN_LOST, CAN_NO_ACK, CAN_BIT_ERROR };

struct can_controller {
    struct device *dev;
    bool (*is_on)(struct device *d);
    uint32_t (*bit_rate)(struct device *d);
    /* The first frame that waits; false: none. */
    bool (*peek)(struct device *d, struct can_frame *frame);
    void (*end)(struct device *d, enum can_outcome outcome);
    void (*deliver)(struct device *d, const struct can_frame *frame);
    /* So many bit times passed without a frame. */
    void (*idle)(struct device *d, uint32_t bits);
};

/* The program has started this one; checks its pins. */
void can_attach(const struct can_controller *controller);
/* Bits a second; faults if the sample point is not near 7/8. */
uint32_t can_bit_rate(uint32_t hz, uint32_t prescaler, uint32_t seg1,
                      uint32_t seg2);

/* The count of transmit errors after one more.  Without an acknowledge it ends
 * where a node becomes passive: one that is alone does not leave the bus (ISO
 * 11898-1, fault confinement). */
static inline uint32_t
can_count_error(uint32_t count, enum can_outcome outcome)
{
    return outcome == CAN_NO_ACK && count > 127 ? count : count + 8;
}

/* unicorn_bxcan.c */
void bxcan_reset(struct device *d);
uint32_t bxcan_read(struct device *d, uint32_t word);
void bxcan_write(struct device *d, uint32_t word, uint32_t value);

/* unicorn_mcan.c: what chips with an M_CAN do in ways of their own. */
struct mcan_family {
    bool is_divided;            /* the memory, once for all */
    uint32_t memory_size;       /* in bytes */
    /* At an offset in it as the registers count */
    void *(*memory)(const struct device *d, uint32_t offset);
    uint32_t (*clock_hz)(const struct device *d);
    bool (*has_clock)(const struct device *d);
    /* It begins to take part: faults if its pins are others. */
    void (*check)(const struct device *d);
};
void mcan_reset(struct device *d, const struct mcan_family *of);
uint32_t mcan_read(struct device *d, uint32_t word);
void mcan_write(struct device *d, uint32_t word, uint32_t value);

/* unicorn_fdcan.c */
void fdcan_reset(struct device *d);
uint32_t fdcan_memory_read(uint32_t offset);
void fdcan_memory_write(uint32_t offset, uint32_t value);

#endif
