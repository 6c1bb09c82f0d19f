# SPDX-License-Identifier: GPL-3.0-or-later
# `make flash` for families whose boards klippy/flash knows; their rules.mk
# includes this.  FLASH_DEVICE= is found if there is one board only.

flash: all
	@$(PYTHON) -m klippy firmware flash --out $(OUT) \
	  $(if $(FLASH_DEVICE),--device "$(FLASH_DEVICE)") \
	  $(if $(FLASH_BOARD),--board "$(FLASH_BOARD)")
