# SPDX-License-Identifier: GPL-3.0-or-later
# Both PRUs of an AM335x with pru-elf-gcc: PRU0 has the link to the host, PRU1
# all the rest.  scripts/build_pru_tools.sh builds the compiler.

# Names of the compiler: ours, that of BeagleBoard's images, ours elsewhere
PRU_TOOLS := $(or $(KLIPPY_PRU_TOOLS),$(HOME)/.cache/klippy-pru)/bin/
find-prefix = $(if $(shell command -v $(1)gcc),$(1))
CROSS_PREFIX := $(or $(call find-prefix,pru-elf-),$(call find-prefix,pru-),\
  $(PRU_TOOLS)pru-elf-)
pru := src/pru
# Of the first core; those that both have are compiled for each
only0-src := src/command.c src/core/message.c src/core/debugcmds.c
only0-src += $(pru)/link.c $(pru)/rpmsg.c $(pru)/analog.c
only0-src += $(pru)/sched0.c src/core/load.c
pru0-src := $(only0-src) src/core/basecmd.c $(pru)/string.c $(pru)/memory.c
src-y := $(filter-out $(only0-src) src/core/dispatch.c,$(src-y))
port-src := $(only0-src) $(pru)/string.c $(pru)/exec.c $(pru)/clock.c
port-src += $(pru)/gpio.c $(pru)/memory.c
port-src += $(if $(CONFIG_WANT_ADC),$(pru)/adc.c)
OPT := -Os
PORT_CFLAGS := -I. -I$(pru)/include -ffreestanding -DPRU_CORE=1
# Nothing lies at address 0; the rest saves some bytes of code
PORT_CFLAGS += -fdelete-null-pointer-checks -fno-move-loop-invariants
PORT_CFLAGS += -fno-caller-saves -fno-tree-loop-im -fno-inline-small-functions
PORT_CFLAGS += -fno-tree-fre
PORT_OUTPUTS := $(OUT)pru0.elf $(OUT)pru1.elf
FLASH_HINT := sudo make flash, on the BeagleBone itself
