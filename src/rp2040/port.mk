# SPDX-License-Identifier: GPL-3.0-or-later
# RP2040 and RP2350 with gcc-arm-none-eabi and newlib.

include src/armcm/port.mk

rp2040 := src/rp2040
rp2040-y := chip.c clock.c gpio.c watchdog.c
rp2040-$(CONFIG_MACH_RP2040) += timer.c chipid.c
rp2040-$(CONFIG_MACH_RP2350) += chipid_otp.c
rp2040-$(CONFIG_SERIAL) += serial.c
rp2040-$(CONFIG_WANT_USB_DEVICE) += usb.c
rp2040-$(CONFIG_WANT_CAN) += can.c core1.c
rp2040-$(CONFIG_WANT_ADC) += adc.c
rp2040-$(CONFIG_WANT_HARD_PWM) += pwm.c
rp2040-$(CONFIG_WANT_SPI) += spi.c
rp2040-$(CONFIG_WANT_I2C) += i2c.c
port-src += $(rp2040-y:%=$(rp2040)/%)

flash-objects := loader.o $(if $(CONFIG_RP2040_BOOT2),boot2_sum.o)
LINK_SCRIPT := $(rp2040)/link.lds.S
PORT_LIBS += $(addprefix $(OUT),$(flash-objects))
PORT_OUTPUTS += $(OUT)klipper.uf2
FLASH_HINT := make flash (a new board: hold BOOTSEL while attaching it)
