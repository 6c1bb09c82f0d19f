/* SPDX-License-Identifier: GPL-3.0-or-later
 * Memory that the caches of a Cortex-M7 leave alone (ARM DDI 0403E, B3.5). */
#include "armcm/core.h"
#include "armcm/cpu.h"

void armcm_uncache(volatile void *begin, uint32_t log2_size)
{
    MPU->RNR = 0;
    MPU->RBAR = (uint32_t)begin;
    MPU->RASR = MPU_RASR_NO_CODE | MPU_RASR_FULL_ACCESS | MPU_RASR_UNCACHED
        | MPU_RASR_SIZE(log2_size) | MPU_RASR_ENABLE;
    MPU->CTRL = MPU_CTRL_ENABLE | MPU_CTRL_DEFAULT_MAP;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
}
