# SPDX-License-Identifier: GPL-3.0-or-later
# STM32 chips with gcc-arm-none-eabi and newlib.

include src/armcm/port.mk

stm32 := src/stm32
port-src += $(stm32)/chip.c $(stm32)/gpio.c $(stm32)/chipid.c $(stm32)/boot.c
port-src += $(stm32)/watchdog.c $(stm32)/adc_pins.c
stm32-$(CONFIG_SERIAL) += serial.c
stm32-$(CONFIG_STM32_USBFS) += usbfs.c usb_memory.c usb_clock.c
stm32-$(CONFIG_STM32_OTG) += otg.c usb_clock.c
stm32-can-$(CONFIG_STM32_HAS_BXCAN) := bxcan.c
stm32-$(CONFIG_WANT_CAN) += $(stm32-can-y)
stm32-$(CONFIG_MACH_STM32F1) += clock_f1.c gpio_v1.c
stm32-$(CONFIG_STM32_F2F4F7) += clock_f2f4f7.c
stm32-$(CONFIG_MACH_STM32F0) += clock_f0.c
stm32-$(CONFIG_MACH_STM32G0) += clock_g0.c
stm32-$(CONFIG_MACH_STM32G4) += clock_g4l4.c
stm32-$(CONFIG_MACH_STM32L4) += clock_g4l4.c
stm32-$(CONFIG_MACH_STM32H7) += clock_h7.c
stm32-$(CONFIG_STM32_CLOCK_TIM2) += timer.c
stm32-$(CONFIG_STM32_CLOCK_CHAINED) += timer.c
stm32-$(CONFIG_STM32_GPIO_V2) += gpio_v2.c
stm32-$(CONFIG_STM32_ADC_V1) += adc_v1.c
stm32-$(CONFIG_STM32_ADC_V2) += adc_v2.c
stm32-$(CONFIG_STM32_ADC_V3) += adc_v3.c
stm32-$(CONFIG_WANT_SPI) += spi.c
stm32-$(CONFIG_WANT_SDIO) += sdio.c
stm32-i2c-y := i2c_pins.c
stm32-i2c-$(CONFIG_STM32_I2C_V1) += i2c_v1.c
stm32-i2c-$(CONFIG_STM32_I2C_V2) += i2c_v2.c
stm32-$(CONFIG_WANT_I2C) += $(stm32-i2c-y)
stm32-$(CONFIG_WANT_HARD_PWM) += pwm.c
port-src += $(stm32-y:%=$(stm32)/%)
FLASH_HINT := make flash FLASH_DEVICE=/dev/ttyUSB0 (boot loader of the chip)
