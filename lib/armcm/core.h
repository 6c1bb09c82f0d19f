/* SPDX-License-Identifier: GPL-3.0-or-later
 * Registers that every Cortex-M has.
 *
 * ARM DDI 0403E (ARMv7-M) and DDI 0419E (ARMv6-M), chapters B3 and C1.
 */
#ifndef ARMCM_CORE_H
#define ARMCM_CORE_H

#include <stdint.h>

/* B3.3 SysTick, a counter of 24 bits */
struct systick_regs {
    volatile uint32_t CSR, RVR, CVR, CALIB;
};
#define SYSTICK ((struct systick_regs *)0xe000e010)
#define SYSTICK_ENABLE 1u
#define SYSTICK_TICKINT 2u
#define SYSTICK_CLKSOURCE 4u        /* the processor's clock */
#define SYSTICK_MAX 0xffffffu

/* B3.4 NVIC */
struct nvic_regs {
    volatile uint32_t ISER[32], ICER[32], ISPR[32], ICPR[32];
};
#define NVIC ((struct nvic_regs *)0xe000e100)

/* B3.2 system control block */
struct scb_regs {
    volatile uint32_t CPUID, ICSR, VTOR, AIRCR, SCR, CCR;
};
#define SCB ((struct scb_regs *)0xe000ed00)
#define SCB_ICSR_PENDSTSET (1u << 26)
#define SCB_ICSR_PENDSTCLR (1u << 25)
#define SCB_AIRCR_RESET 0x05fa0004u /* VECTKEY, SYSRESETREQ */
#define SCB_SCR_SLEEPDEEP (1u << 2)
#define SCB_CCR_DC (1u << 16)
#define SCB_CCR_IC (1u << 17)

/* B3.2.27, B4.5: caches of a Cortex-M7 */
#define SCB_CCSIDR (*(volatile uint32_t *)0xe000ed80)
#define SCB_CSSELR (*(volatile uint32_t *)0xe000ed84)
#define SCB_ICIALLU (*(volatile uint32_t *)0xe000ef50)
#define SCB_DCIMVAC (*(volatile uint32_t *)0xe000ef5c)
#define SCB_DCISW (*(volatile uint32_t *)0xe000ef60)

/* B3.5 memory protection unit */
struct mpu_regs {
    volatile uint32_t TYPE, CTRL, RNR, RBAR, RASR;
};
#define MPU ((struct mpu_regs *)0xe000ed90)
#define MPU_CTRL_ENABLE 1u
#define MPU_CTRL_DEFAULT_MAP 4u     /* of what is in no region */
#define MPU_RASR_ENABLE 1u
#define MPU_RASR_SIZE(LOG2) (((LOG2) - 1u) << 1)
#define MPU_RASR_UNCACHED (1u << 19 | 1u << 18) /* normal memory, shared */
#define MPU_RASR_FULL_ACCESS (3u << 24)
#define MPU_RASR_NO_CODE (1u << 28)

/* C1.6.5 debug exception and monitor control */
#define DEMCR (*(volatile uint32_t *)0xe000edfc)
#define DEMCR_TRCENA (1u << 24)

/* C1.8 data watchpoint and trace: counts the processor's cycles */
struct dwt_regs {
    volatile uint32_t CTRL, CYCCNT;
};
#define DWT ((struct dwt_regs *)0xe0001000)
#define DWT_CYCCNTENA 1u
/* Of a Cortex-M7 only: DDI 0489F, 12.3 */
#define DWT_LAR (*(volatile uint32_t *)0xe0001fb0)
#define CORESIGHT_UNLOCK 0xc5acce55u

#endif
