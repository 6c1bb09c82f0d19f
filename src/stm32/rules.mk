# SPDX-License-Identifier: GPL-3.0-or-later
include src/armcm/rules.mk

STM32FLASH ?= stm32flash

flash: all
	@test -n "$(FLASH_DEVICE)" || { echo "Say where the board is:" \
	  "make flash FLASH_DEVICE=/dev/ttyUSB0"; exit 1; }
	@command -v $(STM32FLASH) >/dev/null || { echo "stm32flash is missing:" \
	  "sudo apt-get install stm32flash"; exit 1; }
	@$(STM32FLASH) -w $(OUT)klipper.bin -v \
	  -S $(CONFIG_FLASH_APPLICATION_ADDRESS) \
	  -g $(CONFIG_FLASH_APPLICATION_ADDRESS) $(FLASH_DEVICE)
