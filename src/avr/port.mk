# SPDX-License-Identifier: GPL-3.0-or-later
# AVR chips with gcc-avr and avr-libc.

avr := src/avr
CROSS_PREFIX := avr-
port-src := $(avr)/main.c $(avr)/timer.c $(avr)/gpio.c
port-src += $(if $(CONFIG_SERIAL),$(avr)/serial.c)
port-src += $(if $(CONFIG_USBSERIAL),$(avr)/usb.c)
port-src += $(if $(CONFIG_WANT_ADC),$(avr)/adc.c)
port-src += $(if $(CONFIG_WANT_HARD_PWM),$(avr)/pwm.c)
port-src += $(if $(CONFIG_WANT_SPI),$(avr)/spi.c)
port-src += $(if $(CONFIG_WANT_I2C),$(avr)/i2c.c)
# rcall and rjmp where they reach
PORT_CFLAGS := -mmcu=$(CONFIG_MCU) -mrelax
ifeq ($(CONFIG_AVR_FAST_STEPS),y)
# gcc 5 -O2 forgets that a pointer is to flash when it makes one to step through
# an array
PORT_CFLAGS += -fno-ivopts
else
OPT := -Os
PORT_CFLAGS += -mcall-prologues -mstrict-X -fno-move-loop-invariants
PORT_CFLAGS += -fno-inline-small-functions -fno-gcse -fno-tree-pre
endif
ifeq ($(CONFIG_HAVE_LIMITED_CODE_SIZE),y)
PORT_CFLAGS += -fno-split-wide-types -fno-tree-scev-cprop
endif
LTO_FLAGS := -flto
PORT_OUTPUTS := $(OUT)klipper.elf $(OUT)klipper.elf.hex
FLASH_HINT := make flash (avrdude, FLASH_DEVICE=/dev/ttyACM0)
