# SPDX-License-Identifier: GPL-3.0-or-later
include src/flash.mk

# Speed where interrupts are off, size everywhere else
ifeq ($(CONFIG_HAVE_LIMITED_CODE_SIZE),y)
fast := src/sched.c src/stepper.c $(avr)/timer.c
else
fast := $(filter-out src/sensors/% src/display/% src/bus/% src/io/buttons.c \
  src/io/tmcuart.c src/io/pulse_counter.c $(avr)/spi.c $(avr)/i2c.c,$(sources))
endif
$(filter-out $(fast:%.c=$(OUT)%.o),$(objects)): FILE_CFLAGS := -Os
