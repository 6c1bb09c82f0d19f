# SPDX-License-Identifier: GPL-3.0-or-later
AVRDUDE ?= avrdude

# Speed where interrupts are off, size everywhere else
ifeq ($(CONFIG_HAVE_LIMITED_CODE_SIZE),y)
fast := src/sched.c src/stepper.c $(avr)/timer.c
else
fast := $(filter-out src/sensors/% src/display/% src/bus/% src/io/buttons.c \
  src/io/tmcuart.c src/io/pulse_counter.c $(avr)/spi.c $(avr)/i2c.c,$(sources))
endif
$(filter-out $(fast:%.c=$(OUT)%.o),$(objects)): FILE_CFLAGS := -Os

flash: all
	@test -n "$(FLASH_DEVICE)" || { echo "Say where the board is:" \
	  "make flash FLASH_DEVICE=/dev/ttyACM0"; exit 1; }
	@command -v $(AVRDUDE) >/dev/null || { echo "avrdude is missing:" \
	  "sudo apt-get install avrdude"; exit 1; }
	@$(AVRDUDE) -p $(CONFIG_MCU) -c $(CONFIG_AVRDUDE_PROTOCOL) \
	  -P $(FLASH_DEVICE) -D -U flash:w:$(OUT)klipper.elf.hex:i
