# SPDX-License-Identifier: GPL-3.0-or-later
include src/armcm/rules.mk
include src/flash.mk

# The boot ROM wants the first eight vectors to add up to 0 (UM10360, 32.3.1.1).
$(OUT)klipper.bin: $(OUT)klipper.elf scripts/lpc_checksum.py
	@$(OBJCOPY) -O binary $< $@
	@$(PYTHON) scripts/lpc_checksum.py $@
