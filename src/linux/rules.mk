# SPDX-License-Identifier: GPL-3.0-or-later
PREFIX ?= /usr/local

# A running process keeps its image: the file is replaced, not overwritten.
flash: all
	@echo "  INSTALL $(PREFIX)/bin/klipper_mcu"
	@install -m 755 $(OUT)klipper.elf $(PREFIX)/bin/klipper_mcu
	@echo "Restart the service to use it: systemctl restart klipper-mcu"
