# SPDX-License-Identifier: GPL-3.0-or-later
include src/armcm/rules.mk
include src/flash.mk

$(OUT)klipper.elf: $(addprefix $(OUT),$(flash-objects))

$(OUT)%.o: src/rp2040/%.S $(OUT)autoconf.h
	@echo "  AS      $<"
	@$(CC) -c $(PORT_CFLAGS) -include $(OUT)autoconf.h $< -o $@

$(OUT)boot2.bin: $(OUT)boot2.o
	@$(OBJCOPY) -O binary -j .boot2 $< $@

$(OUT)boot2_sum.S: $(OUT)boot2.bin scripts/rp2040_boot2.py
	@$(PYTHON) scripts/rp2040_boot2.py $< $@

$(OUT)boot2_sum.o: $(OUT)boot2_sum.S
	@$(CC) -c $(PORT_CFLAGS) $< -o $@

$(OUT)klipper.uf2: $(OUT)klipper.bin scripts/make_uf2.py
	@$(PYTHON) scripts/make_uf2.py $(OUT) $@
