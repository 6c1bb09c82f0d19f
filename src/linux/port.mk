# SPDX-License-Identifier: GPL-3.0-or-later
# A linux process with this computer's pins.

linux := src/linux
port-src := $(linux)/main.c $(linux)/options.c $(linux)/realtime.c \
  $(linux)/watchdog.c $(linux)/clock.c $(linux)/console.c $(linux)/memory.c \
  $(linux)/devices.c $(linux)/gpio.c $(linux)/gpio_chardev.c \
  $(linux)/fake.c $(linux)/fake_rules.c
port-src += $(linux)/spi.c $(linux)/spi_dev.c $(linux)/i2c.c $(linux)/i2c_dev.c
port-src += $(linux)/analog.c $(linux)/adc_iio.c $(linux)/worker.c
port-src += $(linux)/ds18b20.c $(linux)/pca9685.c
port-src += $(linux)/pwm.c $(linux)/pwm_sysfs.c
PORT_CFLAGS := -pthread -D_GNU_SOURCE
PORT_LIBS := -lutil
FLASH_HINT := run $(OUT)klipper.elf -r -I /tmp/klipper_host_mcu \
  (make flash installs it as /usr/local/bin/klipper_mcu)
