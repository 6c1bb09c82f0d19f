# SPDX-License-Identifier: GPL-3.0-or-later
$(OUT)klipper.elf: $(OUT)link.ld

$(OUT)link.ld: $(or $(LINK_SCRIPT),src/armcm/link.lds.S) $(OUT)autoconf.h
	@$(CC) -E -P -x assembler-with-cpp -include $(OUT)autoconf.h $< -o $@
