/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What two PRUs of an AM335x see around them (SPRUH73): their memories, the
 * event controller and the counter of the subsystem, pins, analog inputs and
 * clocks of the chip, memory of the ARM.  Cycles are of 5 ns.
 */
#ifndef PRU_SOC_H
#define PRU_SOC_H

#include "pru_core.h"
#include "vmcu_abi.h"

enum { PRU_HZ = 200000000, PRU_DATA_SIZE = 8192, PRU_SHARED_SIZE = 12288,
       N_BANKS = 4, N_PINS = N_BANKS * 32, N_ANALOG = 8, N_EVENTS = 64,
       DDR_BASE = 0x9c000000, DDR_SIZE = 65536,
       EVENT_TO_ARM = 16, EVENT_FROM_ARM = 17 };

struct gpio_bank {
    uint32_t is_input, out, driven;     /* driven: what the world was told */
    uint32_t clock_control;
};

struct soc {
    struct pru_core cores[2];
    uint8_t data[2][PRU_DATA_SIZE], shared[PRU_SHARED_SIZE], ddr[DDR_SIZE];
    struct vmcu_host host;
    uint64_t base;                      /* the world's clock at cycle 0 */
    bool is_broken;
    bool has_master;                    /* may the PRUs use the chip's bus? */
    /* counter */
    bool is_counting;
    uint32_t counter_step;
    uint64_t counter_zero;              /* cycle at which it was 0 */
    /* events */
    uint64_t events_raised, events_enabled;
    uint8_t channel_of[N_EVENTS], host_of[10];
    uint32_t hosts_enabled;
    bool are_events_on, arm_kicked;
    /* chip */
    struct gpio_bank banks[N_BANKS];
    uint32_t adc_clock_control, adc_control, adc_divider, adc_steps[16];
    uint32_t adc_enabled, adc_fifo[8], adc_count;
    uint64_t adc_done;
};
extern struct soc soc;

/* All off, memories full of garbage. */
void soc_reset(void);

/* The world's clock at a core's cycle. */
uint64_t soc_clock(uint64_t cycle);

/* An event of the subsystem, as the ARM raises it. */
void soc_raise(uint32_t event);

void soc_fault(const struct pru_core *core, const char *what, uint32_t detail);

/* Bytes of the ARM's memory at an address; a fault if there are none. */
uint8_t *soc_ddr(uint32_t addr, uint32_t len);

extern const struct pru_bus soc_bus;

/* --- The ARM's Linux, pru_arm.c --- */

/* Load a program as remoteproc does, which also finds its resource table and
 * its map of events.  Returns 0 or a negative error. */
int32_t arm_load(const char *path, uint32_t core);

/* Both programs run now. */
void arm_start(void);

/* Bytes that the host's software writes to the port; false: no room. */
bool arm_write(const uint8_t *buf, uint32_t len);

/* After the PRU has kicked it, and whenever it may have to write. */
void arm_run(uint64_t cycle);

#endif
