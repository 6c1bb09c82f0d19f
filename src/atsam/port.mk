# SPDX-License-Identifier: GPL-3.0-or-later
# SAM3X, SAM4S, SAM4E and SAM E70 with gcc-arm-none-eabi and newlib.

include src/armcm/port.mk

atsam := src/atsam
port-src += $(atsam)/clock.c $(atsam)/gpio.c $(atsam)/watchdog.c
port-src += $(atsam)/flash.c
atsam-usb-$(CONFIG_ATSAM_UDP) := udp.c
atsam-usb-$(CONFIG_ATSAM_USBHS) := usbhs.c
atsam-$(CONFIG_WANT_USB_DEVICE) += $(atsam-usb-y)
atsam-$(CONFIG_SERIAL) += serial.c
atsam-$(CONFIG_WANT_ADC) += adc.c
atsam-$(CONFIG_WANT_HARD_PWM) += pwm.c
atsam-$(CONFIG_WANT_SPI) += spi.c
atsam-$(CONFIG_WANT_I2C) += i2c.c
port-src += $(if $(CONFIG_WANT_MCAN),src/armcm/uncached.c)
port-src += $(atsam-y:%=$(atsam)/%)
FLASH_HINT := make flash FLASH_DEVICE=/dev/ttyACM0 (bossac)
