# SPDX-License-Identifier: GPL-3.0-or-later
# Firmware targets of the top-level Makefile.  Rules are in src/build.mk.
#   KCONFIG_CONFIG=<file>  the configuration (default .config)
#   OUT=<folder>/          where it is built (default out/)

PYTHON ?= $(shell test -x .venv/bin/python && echo .venv/bin/python || echo python3)
KCONFIG_CONFIG ?= .config
OUT ?= out/
KCONFIG = KCONFIG_CONFIG=$(KCONFIG_CONFIG) $(PYTHON) scripts/kconfig.py
FIRMWARE_MAKE = $(MAKE) --no-print-directory -f src/build.mk \
  OUT=$(patsubst %/,%,$(OUT))/ PYTHON=$(PYTHON) KCONFIG_CONFIG=$(KCONFIG_CONFIG)

##@ Firmware
.PHONY: menuconfig
menuconfig: ## Choose the micro-controller and features of the firmware
	@$(KCONFIG) menuconfig

.PHONY: olddefconfig
olddefconfig: ## Complete the firmware configuration with defaults
	@$(KCONFIG) olddefconfig

.PHONY: defconfig
defconfig: ## Take a ready configuration: make defconfig TARGET=atmega2560
	@test -n "$(TARGET)" || { echo "TARGET= is one of:" \
	  $(basename $(notdir $(wildcard test/configs/*.config))); exit 1; }
	@$(KCONFIG) defconfig test/configs/$(TARGET).config

.PHONY: firmware
firmware: ## Build the firmware into OUT (default out/)
	@# one build at a time in a folder: others wait, and find it done
	+@mkdir -p $(OUT) && exec 9> $(OUT)/.build.lock \
	  && { ! command -v flock >/dev/null || flock 9; } \
	  && $(KCONFIG) header $(OUT) && $(FIRMWARE_MAKE) all

.PHONY: flash
flash: ## Build, then program the board (FLASH_DEVICE=/dev/ttyUSB0 if there are more)
	@$(KCONFIG) header $(OUT)
	+@$(FIRMWARE_MAKE) flash FLASH_DEVICE="$(FLASH_DEVICE)" \
	  FLASH_BOARD="$(FLASH_BOARD)"

.PHONY: size
size: ## Build, then tell how much flash, memory and stack the firmware takes
	@$(KCONFIG) header $(OUT)
	+@$(FIRMWARE_MAKE) size
