# SPDX-License-Identifier: GPL-3.0-or-later
# AVR chips with gcc-avr and avr-libc.

avr := src/avr
CROSS_PREFIX := avr-
port-src := $(avr)/main.c $(avr)/timer.c $(avr)/gpio.c $(avr)/serial.c
port-src += $(avr)/adc.c $(avr)/pwm.c
port-src += $(if $(CONFIG_WANT_SPI),$(avr)/spi.c)
port-src += $(if $(CONFIG_WANT_I2C),$(avr)/i2c.c)
PORT_CFLAGS := -mmcu=$(CONFIG_MCU)
LTO_FLAGS := -flto
PORT_OUTPUTS := $(OUT)klipper.elf $(OUT)klipper.elf.hex
FLASH_HINT := make flash FLASH_DEVICE=/dev/ttyACM0
