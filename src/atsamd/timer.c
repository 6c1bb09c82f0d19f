/* SPDX-License-Identifier: GPL-3.0-or-later
 * The clock of chips whose processor counts no cycles: two timers as one of 32
 * bits (DS40001882, 30; DS60001479, 35). */
#include "armcm/cpu.h"
#include "chip.h"

static void sync(void)
{
#if CONFIG_MACH_SAMD21
    while (TC_STATUS & TC_STATUS_SYNCBUSY)
        ;
#else
    while (TC_SYNCBUSY)
        ;
#endif
}

/* A boot loader may have used them. */
void armcm_start_counter(void)
{
    static const uint32_t gates[] = CLOCK_TC_GATES;

    chip_enable(gates[0]);
    chip_enable(gates[1]);
    chip_feed(CHANNEL_CLOCK_TC, GEN_PERIPHERALS);
    TC_CTRLA = TC_CTRLA_SWRST;
    sync();
    TC_CTRLA = TC_CTRLA_32BIT;
    TC_CTRLA = TC_CTRLA_32BIT | TC_CTRLA_ENABLE;
    sync();
#if CONFIG_MACH_SAMD21
    TC_READREQ = TC_READREQ_COUNT;
    sync();
#endif
}
