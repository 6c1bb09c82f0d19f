# SPDX-License-Identifier: GPL-3.0-or-later
# How the firmware is built: scan every source for declarations, generate the
# tables, compile, link.  Run by src/firmware.mk with OUT= and PYTHON=.
#
# A port's src/<family>/port.mk sets, for what differs:
#   CROSS_PREFIX  port-src (its sources)
#   LTO_FLAGS  PORT_CFLAGS  PORT_LDFLAGS  PORT_LIBS
#   PORT_OUTPUTS (what `all` makes; default klipper.elf)  FLASH_HINT (one line)
# and src/<family>/rules.mk holds its rules (flash:, further outputs), where
# $(objects) may be a prerequisite, and FILE_CFLAGS set for some of them.

include $(OUT)auto.conf

BOARD := $(CONFIG_BOARD_DIRECTORY)
CROSS_PREFIX :=
PORT_OUTPUTS := $(OUT)klipper.elf
PORT_LDFLAGS := -fwhole-program
LTO_FLAGS := -flto=auto
FLASH_HINT := this target has nothing to flash
all: firmware-report

include src/Makefile
include src/$(BOARD)/port.mk

CC := $(CROSS_PREFIX)gcc
OBJCOPY := $(CROSS_PREFIX)objcopy
SIZE := $(CROSS_PREFIX)size
OPT ?= -O2
CPPFLAGS_ALL := -Isrc -Isrc/$(BOARD) -I$(OUT) -include $(OUT)autoconf.h
CFLAGS_ALL := -std=gnu11 $(OPT) -g -Wall -Wextra -Wshadow -Wconversion \
  -Wno-sign-conversion -Werror -Wold-style-definition -Wtype-limits \
  -ffunction-sections -fdata-sections -fno-delete-null-pointer-checks \
  $(LTO_FLAGS) $(PORT_CFLAGS) $(EXTRA_CFLAGS)
LDFLAGS_ALL := $(CFLAGS_ALL) $(PORT_LDFLAGS) -Wl,--gc-sections

sources := $(src-y) $(port-src)
scans := $(sources:%.c=$(OUT)%.decl)
objects := $(sources:%.c=$(OUT)%.o) $(OUT)decl/tables.o
tables := $(OUT)decl/tables.c

$(OUT)%.decl: %.c $(OUT)autoconf.h src/build.mk
	@mkdir -p $(@D)
	@$(CC) $(CPPFLAGS_ALL) $(PORT_CFLAGS) -std=gnu11 $(OPT) -DDECL_SCAN \
	  -E -P -MMD -MT $@ -MF $@.d $< -o $@

$(OUT)decl/stamp: $(scans) scripts/build_commands.py FORCE
	@mkdir -p $(@D)
	@$(PYTHON) scripts/build_commands.py --out $(OUT) \
	  --tools "$(CC);$(CROSS_PREFIX)ld" $(scans)
	@test -e $@ && test -z "$(filter-out FORCE,$?)" || touch $@

$(tables): $(OUT)decl/stamp ;
$(sources:%.c=$(OUT)decl/%.h): $(OUT)decl/stamp ;

$(OUT)%.o: %.c $(OUT)decl/%.h $(OUT)autoconf.h src/build.mk \
  src/$(BOARD)/port.mk src/$(BOARD)/rules.mk
	@echo "  CC      $<"
	@mkdir -p $(@D)
	@$(CC) $(CPPFLAGS_ALL) $(CFLAGS_ALL) $(FILE_CFLAGS) -include $(OUT)decl/$*.h \
	  -MMD -c $< -o $@

$(OUT)decl/tables.o: $(tables) $(OUT)autoconf.h
	@echo "  CC      $<"
	@$(CC) $(CPPFLAGS_ALL) $(CFLAGS_ALL) -MMD -c $< -o $@

$(OUT)klipper.elf: $(objects)
	@echo "  LINK    $@"
	@$(CC) $(LDFLAGS_ALL) $(objects) -o $@ $(PORT_LIBS)

$(OUT)%.elf.hex: $(OUT)%.elf
	@$(OBJCOPY) -j .text -j .data -O ihex $< $@

$(OUT)%.bin: $(OUT)%.elf
	@$(OBJCOPY) -O binary $< $@

.PHONY: firmware-report
firmware-report: $(PORT_OUTPUTS)
	@echo
	@echo "Firmware for $(CONFIG_MCU) at $(CONFIG_CLOCK_FREQ) Hz:" \
	  "$(PORT_OUTPUTS) $(OUT)klipper.dict"
	@$(print-size)
	@echo "To flash: $(FLASH_HINT)"

# Of the flash that firmware may have, of the memory; where a port tells them
print-size = $(SIZE) $(firstword $(PORT_OUTPUTS)) | awk \
  -v flash=$$(($(or $(CONFIG_FLASH_SIZE),0))) \
  -v ram=$$(($(or $(CONFIG_RAM_SIZE),0))) -v stack=$(or $(CONFIG_STACK_SIZE),0) \
  'NR == 2 { printf "Code and constants %d bytes", $$1 + $$2; \
  if (flash) printf " of %d", flash; \
  printf ", memory %d bytes", $$2 + $$3; \
  if (ram) printf " and %d of stack of %d", stack, ram; print "" }'

.PHONY: size
size: $(PORT_OUTPUTS)
	@echo "$(CONFIG_MCU)"; $(print-size)

.PHONY: all flash FORCE
FORCE:
.SECONDARY:

include src/$(BOARD)/rules.mk

-include $(objects:.o=.d) $(scans:=.d)
