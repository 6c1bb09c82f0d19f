/* SPDX-License-Identifier: GPL-3.0-or-later
 * PRU0: analog inputs (SPRUH73, chapter 12).  All eight are read in turn, for
 * as long as this core runs; Linux's own driver must not have the converter. */
#include <stdbool.h>

#include "analog.h"
#include "lib/pru/am335x.h"

/* 3 of 24 MHz; a step takes 16 conversions of 15 clocks */
enum { DIVIDER = 7, N_INPUTS = MAILBOX_ANALOG, ALL_STEPS = 0xff << 1 };

static void start_converter(void)
{
    uint32_t i;

    CM_ADC = (CM_ADC & ~CM_MODULE_MASK) | CM_MODULE_ENABLE;
    while (CM_ADC & CM_IDLE_MASK)
        ;
    ADC_CTRL = ADC_CTRL_UNLOCK | ADC_CTRL_STEP_ID;
    ADC_CLKDIV = DIVIDER;
    for (i = 0; i < N_INPUTS; i++) {
        ADC_STEPCONFIG(i) = ADC_STEP_AVERAGE16 | ADC_STEP_INPUT(i);
        ADC_STEPDELAY(i) = 0;
    }
    while (ADC_FIFO0COUNT)
        (void)ADC_FIFO0DATA;
    ADC_CTRL |= ADC_CTRL_ENABLE;
    ADC_STEPENABLE = ALL_STEPS;
}

void analog_poll(struct mailbox *box)
{
    static bool is_started;
    uint32_t data, step;

    if (!box->analog_wanted)
        return;
    if (!is_started) {
        start_converter();
        is_started = true;
    }
    if (!ADC_FIFO0COUNT)
        return;
    data = ADC_FIFO0DATA;
    step = ADC_FIFO_STEP(data);
    box->analog[step % N_INPUTS] = ADC_FIFO_VALUE(data);
    if (step == N_INPUTS - 1)
        ADC_STEPENABLE = ALL_STEPS;
}
