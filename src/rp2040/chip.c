/* SPDX-License-Identifier: GPL-3.0-or-later
 * Resets of peripherals and of the chip, and its boot loader. */
#include "board/irq.h"
#include "board/reset.h"
#include "chip.h"

void chip_enable(uint32_t reset_bit)
{
    uint32_t bit = 1u << reset_bit;

    RP_CLR(RESETS->RESET) = bit;
    while (!(RESETS->RESET_DONE & bit))
        ;
}

/* The reset that a core can ask for is its own only; that of the watchdog is
 * for all but the oscillators (data sheet, 2.13). */
void reset_mcu(void)
{
    irq_disable();
    PSM->WDSEL = PSM_WDSEL_ALL;
    RP_SET(WATCHDOG->CTRL) = WATCHDOG_CTRL_TRIGGER;
    for (;;)
        ;
}

/* The boot ROM shows the flash chip as a drive (data sheets, 2.8.3 and 5.4).
 * Addresses come through registers: to the compiler, nothing lies at low
 * ones. */
#if CONFIG_MACH_RP2350
void reset_to_bootloader(void)
{
    typedef void *(*lookup_t)(uint32_t code, uint32_t mask);
    typedef int (*reboot_t)(uint32_t flags, uint32_t ms, uint32_t activity_pins,
                            uint32_t disabled);
    const volatile uint16_t *lookup;
    reboot_t reboot;

    irq_disable();
    __asm__("" : "=r"(lookup) : "0"(ROM_LOOKUP));
    reboot = (reboot_t)((lookup_t)(uintptr_t)*lookup)(ROM_CODE('R', 'B'),
                                                      ROM_FOR_SECURE_ARM);
    reboot(ROM_REBOOT_TO_BOOTSEL, 1, 0, 0);
    reset_mcu();
}
#else
void reset_to_bootloader(void)
{
    typedef void *(*lookup_t)(const uint16_t *table, uint32_t code);
    typedef void (*usb_boot_t)(uint32_t activity_pins, uint32_t disabled);
    const volatile uint16_t *table, *lookup;
    usb_boot_t usb_boot;

    irq_disable();
    __asm__("" : "=r"(table) : "0"(ROM_TABLE));
    __asm__("" : "=r"(lookup) : "0"(ROM_LOOKUP));
    usb_boot = (usb_boot_t)((lookup_t)(uintptr_t)*lookup)(
        (const uint16_t *)(uintptr_t)*table, ROM_CODE('U', 'B'));
    usb_boot(0, 0);
    reset_mcu();
}
#endif
