# SPDX-License-Identifier: GPL-3.0-or-later
$(OUT)klipper.so: $(objects) src/simulator/firmware.ld
	@echo "  LINK    $@"
	@$(CC) $(LDFLAGS_ALL) -shared $(objects) -o $@.tmp
	@mv $@.tmp $@

process := $(OUT)src/simulator/process.o
$(process): src/simulator/process.c klippy_ext/csrc/vmcu_abi.h
	@echo "  CC      $<"
	@$(CC) $(CPPFLAGS_ALL) $(CFLAGS_ALL) -c $< -o $@

$(OUT)klipper.elf: $(process)

flash:
	@echo "$(FLASH_HINT)"
