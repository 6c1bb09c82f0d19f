/* SPDX-License-Identifier: GPL-3.0-or-later
 * The clock of chips whose processor counts no cycles: timer 2, or timers 3 and
 * 1 where that has but 16 bits or is missing (RM0091, 17.3.15). */
#include "armcm/cpu.h"
#include "chip.h"

#define REGS(N) ((struct tim_regs *)TIM##N##_BASE)

/* CR2: a trigger at each overflow; SMCR: count those of timer 3 */
#define MASTER_UPDATE (2u << 4)
#define SLAVE_EXTERNAL (7u | 2u << 4)

#if CONFIG_STM32_CLOCK_CHAINED
void armcm_start_counter(void)
{
    chip_enable(TIM1_GATE);
    chip_enable(TIM3_GATE);
    REGS(1)->ARR = REGS(3)->ARR = 0xffff;
    REGS(1)->SMCR = SLAVE_EXTERNAL;
    REGS(3)->CR2 = MASTER_UPDATE;
    REGS(1)->CNT = REGS(3)->CNT = 0;
    REGS(1)->CR1 = TIM_CR1_CEN;
    REGS(3)->CR1 = TIM_CR1_CEN;
}
#else
void armcm_start_counter(void)
{
    chip_enable(TIM2_GATE);
    REGS(2)->ARR = 0xffffffff;
    REGS(2)->CNT = 0;
    REGS(2)->CR1 = TIM_CR1_CEN;
}
#endif
