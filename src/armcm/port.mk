# SPDX-License-Identifier: GPL-3.0-or-later
# What all ports to a Cortex-M share.  The port adds its sources to port-src.

CROSS_PREFIX := arm-none-eabi-
armcm := src/armcm
port-src := $(armcm)/start.c $(armcm)/memory.c $(armcm)/events.c
port-src += $(if $(CONFIG_ARMCM_OWN_TIMER),,$(armcm)/systick.c)
port-src-$(CONFIG_SERIAL) += $(armcm)/serial.c
port-src += $(port-src-y)

ifeq ($(CONFIG_HAVE_LIMITED_CODE_SIZE),y)
OPT := -Os
endif
PORT_CFLAGS := -mcpu=$(CONFIG_ARMCM_CPU) -mthumb -Ilib
PORT_LDFLAGS := -nostartfiles -static -Wl,-T,$(OUT)link.ld --specs=nano.specs \
  -Wl,--no-warn-rwx-segments
PORT_LIBS := -lc -lgcc
PORT_OUTPUTS := $(OUT)klipper.elf $(OUT)klipper.bin
