# SPDX-License-Identifier: GPL-3.0-or-later
# AVR chips with gcc-avr and avr-libc.

avr := src/avr
CROSS_PREFIX := avr-
port-src := $(avr)/main.c $(avr)/timer.c $(avr)/gpio.c $(avr)/serial.c
port-src += $(avr)/adc.c $(avr)/pwm.c
PORT_CFLAGS := -mmcu=$(CONFIG_MCU)
LTO_FLAGS := -flto
PORT_OUTPUTS := $(OUT)klipper.elf $(OUT)klipper.elf.hex
FLASH_HINT := make flash FLASH_DEVICE=/dev/ttyACM0
