/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins of the USB port, reserved by name.  Included once, by its driver. */
#if CONFIG_STM32_USB_PB14_PB15
DECL_CONSTANT_STR("RESERVE_PINS_USB1", "PB14,PB15");
#define USB_PIN_DM GPIO('B', 14)
#define USB_PIN_DP GPIO('B', 15)
#define USB_PIN_FUNCTION 12
#else
DECL_CONSTANT_STR("RESERVE_PINS_USB", "PA11,PA12");
#define USB_PIN_DM GPIO('A', 11)
#define USB_PIN_DP GPIO('A', 12)
#define USB_PIN_FUNCTION 10
#endif
