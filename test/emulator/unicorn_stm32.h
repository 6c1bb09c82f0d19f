/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What the models of an STM32's communication know of the rest of it.
 */
#ifndef UNICORN_STM32_H
#define UNICORN_STM32_H

#include "unicorn_chip.h"

/* unicorn_periph.c */
struct device *stm32_find(enum device_kind kind, uint8_t index);
/* Faults if a pin is not what `function` names. */
void stm32_check_pin(uint32_t pin, uint32_t function);

/* unicorn_sdio.c: with a card of 64 blocks. */
void sdio_reset(struct device *d);
uint32_t sdio_read(struct device *d, uint32_t word);
void sdio_write(struct device *d, uint32_t word, uint32_t value);

/* unicorn_rom.c */
void rom_map(uc_engine *uc);

/* unicorn_rcc.c: faults if USB does not run at 48 MHz. */
void stm32_check_usb_clock(void);

/* unicorn_usbfs.c */
void usbfs_reset(struct device *d);
void usbfs_write(struct device *d, uint32_t word, uint32_t value);
uint32_t usbfs_memory_read(uint32_t offset, unsigned size);
void usbfs_memory_write(uint32_t offset, unsigned size, uint32_t value);

/* unicorn_otg.c */
void otg_reset(struct device *d);
uint32_t otg_read(uint32_t offset);
void otg_write(struct device *d, uint32_t offset, uint32_t value);
void stm32_check_usb_pins(const struct device *d);

#endif
