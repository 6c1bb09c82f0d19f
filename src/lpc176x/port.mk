# SPDX-License-Identifier: GPL-3.0-or-later
# LPC176x with gcc-arm-none-eabi and newlib.

include src/armcm/port.mk

lpc176x := src/lpc176x
port-src += $(lpc176x)/clock.c $(lpc176x)/gpio.c $(lpc176x)/watchdog.c
port-src += $(lpc176x)/chipid.c
lpc176x-$(CONFIG_WANT_USB_DEVICE) += usb.c
lpc176x-$(CONFIG_WANT_CAN) += can.c
lpc176x-$(CONFIG_SERIAL) += serial.c
lpc176x-$(CONFIG_WANT_ADC) += adc.c
lpc176x-$(CONFIG_WANT_HARD_PWM) += pwm.c
lpc176x-$(CONFIG_WANT_SPI) += spi.c
lpc176x-$(CONFIG_WANT_I2C) += i2c.c
port-src += $(lpc176x-y:%=$(lpc176x)/%)
FLASH_HINT := make flash FLASH_BOARD=btt-skr-v1.4 FLASH_DEVICE=<folder of \
  the board's SD card>, or make flash with the boot loader on USB (DFU)
