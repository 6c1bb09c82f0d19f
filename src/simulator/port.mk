# SPDX-License-Identifier: GPL-3.0-or-later
# The simulated mcu: a shared object for a virtual world, and a process.

port-src := src/simulator/clock.c src/simulator/coroutine.c \
  src/simulator/memory.c src/simulator/console.c src/simulator/gpio.c \
  src/simulator/bus.c src/simulator/mcu.c
PORT_CFLAGS := -fPIC -fvisibility=hidden -Iklippy_ext/csrc -U_FORTIFY_SOURCE \
  -fno-stack-protector
PORT_OUTPUTS := $(OUT)klipper.so $(OUT)klipper.elf
PORT_LDFLAGS := -Wl,-z,norelro -Wl,-T,src/simulator/firmware.ld
FLASH_HINT := nothing to do: run $(OUT)klipper.elf -I /tmp/klipper_simulator, \
  or let klippy simulate load $(OUT)klipper.so
PORT_LIBS = $(OUT)src/simulator/process.o -lutil
