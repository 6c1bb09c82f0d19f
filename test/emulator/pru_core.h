/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * One Programmable Real-time Unit of an AM335x (SPRUH73, chapter 4; instructions
 * SPRUIJ2): registers, instructions and what they cost.
 *
 * The core knows nothing of what is around it: loads, stores and the event
 * register go to its surroundings, which say what a load costs.
 */
#ifndef PRU_CORE_H
#define PRU_CORE_H

#include <stdbool.h>
#include <stdint.h>

enum { PRU_REGS = 32, PRU_CODE_WORDS = 2048, PRU_MAX_BURST = 124 };

struct pru_core;

struct pru_bus {
    /* Fill in data; returns the cycles that the core waits. */
    uint32_t (*load)(struct pru_core *core, uint32_t addr, uint8_t *data,
                     uint32_t len);
    uint32_t (*store)(struct pru_core *core, uint32_t addr, const uint8_t *data,
                      uint32_t len);
    uint32_t (*read_r31)(struct pru_core *core);
    void (*write_r31)(struct pru_core *core, uint32_t value);
    /* Something that silicon would not do; the core stands still. */
    void (*fault)(struct pru_core *core, const char *what, uint32_t detail);
};

struct pru_core {
    const struct pru_bus *bus;
    uint32_t index;                     /* 0 or 1 */
    uint32_t code[PRU_CODE_WORDS];
    union {
        uint32_t words[PRU_REGS];
        uint8_t bytes[PRU_REGS * 4];
    } regs;
    uint32_t constants[32];
    uint32_t pc;                        /* in words */
    uint64_t cycle, n_instructions;
    uint32_t loop_start, loop_end, loop_left;
    bool carry, is_running;
    uint8_t mac_mode;
    uint64_t mac_sum;
};

/* After power on: nothing runs yet, registers hold garbage. */
void pru_core_reset(struct pru_core *core, const struct pru_bus *bus,
                    uint32_t index);

/* Execute one instruction. */
void pru_core_step(struct pru_core *core);

#endif
