# SPDX-License-Identifier: GPL-3.0-or-later
AVRDUDE ?= avrdude

flash: all
	@test -n "$(FLASH_DEVICE)" || { echo "Say where the board is:" \
	  "make flash FLASH_DEVICE=/dev/ttyACM0"; exit 1; }
	@command -v $(AVRDUDE) >/dev/null || { echo "avrdude is missing:" \
	  "sudo apt-get install avrdude"; exit 1; }
	@$(AVRDUDE) -p $(CONFIG_MCU) -c $(CONFIG_AVRDUDE_PROTOCOL) \
	  -P $(FLASH_DEVICE) -D -U flash:w:$(OUT)klipper.elf.hex:i
