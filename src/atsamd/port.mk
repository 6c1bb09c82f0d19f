# SPDX-License-Identifier: GPL-3.0-or-later
# SAM C21, D21, D51 and E5x with gcc-arm-none-eabi and newlib.

include src/armcm/port.mk

atsamd := src/atsamd
atsamd-y := chip.c chipid.c gpio.c watchdog.c sercom.c
atsamd-$(CONFIG_MACH_SAMD21) += clock_d21.c timer.c
atsamd-$(CONFIG_MACH_SAMC21) += clock_c21.c timer.c
atsamd-$(CONFIG_MACH_SAMX5) += clock_d51.c
atsamd-$(CONFIG_SERIAL) += serial.c
atsamd-$(CONFIG_WANT_USB_DEVICE) += usb.c
atsamd-$(CONFIG_WANT_ADC) += adc.c
atsamd-$(CONFIG_WANT_HARD_PWM) += pwm.c
atsamd-$(CONFIG_WANT_SPI) += spi.c
atsamd-$(CONFIG_WANT_I2C) += i2c.c
port-src += $(atsamd-y:%=$(atsamd)/%)
FLASH_HINT := make flash FLASH_DEVICE=/dev/ttyACM0 (bossac), or double reset
