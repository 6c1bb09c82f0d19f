# SPDX-License-Identifier: GPL-3.0-or-later
$(OUT)klipper.elf: $(OUT)link.ld

$(OUT)link.ld: src/armcm/link.lds.S $(OUT)autoconf.h
	@$(CC) -E -P -x assembler-with-cpp -include $(OUT)autoconf.h $< -o $@
