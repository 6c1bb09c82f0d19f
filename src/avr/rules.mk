# SPDX-License-Identifier: GPL-3.0-or-later
include src/flash.mk

# Speed where steps and commands come by, size everywhere else: other events give
# way to steps
fast := src/sched.c src/stepper.c $(avr)/timer.c
ifneq ($(CONFIG_HAVE_LIMITED_CODE_SIZE),y)
fast += src/command.c src/core/oid.c src/core/arena.c $(avr)/serial.c
endif
$(filter-out $(fast:%.c=$(OUT)%.o),$(objects)): FILE_CFLAGS := -Os
