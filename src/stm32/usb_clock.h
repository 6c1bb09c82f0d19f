/* SPDX-License-Identifier: GPL-3.0-or-later
 * The clock of the USB peripheral. */
#ifndef STM32_USB_CLOCK_H
#define STM32_USB_CLOCK_H

/* An H743 has two OTG cores: the second is on PA11 and PA12. */
#define USB_IS_SECOND (CONFIG_MACH_STM32H7 && !CONFIG_MACH_STM32H723 \
                       && !CONFIG_STM32_USB_PB14_PB15)

/* At start: 48 MHz run. */
void usb_clock_start(void);

#endif
