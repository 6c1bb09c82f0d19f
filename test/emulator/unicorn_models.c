/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The chips: memories, peripherals, limits (data sheets; memory maps of the
 * reference manuals).
 */
#include <string.h>

#include "unicorn_chip.h"

#define GPIO_AT(BASE, N, OFFSET, BIT) \
    { (BASE) + 0x400 * (N), DEV_GPIO, N, 0, 0, OFFSET, BIT }

#define PB(BIT) (16 + (BIT))

static const struct pwm_info tim4_pwm[] = {
    { PB(6), 4, 0, 2 }, { PB(7), 4, 1, 2 }, { PB(8), 4, 2, 2 },
    { PB(9), 4, 3, 2 }, { 0, 0, 0, 0 },
};
static const struct pwm_info tim16_pwm[] = {
    { PB(8), 16, 0, 2 }, { PB(9), 17, 0, 2 }, { 0, 0, 0, 0 },
};
static const struct pwm_info l4_pwm[] = {
    { PB(8), 16, 0, 14 }, { 0, 0, 0, 0 },
};

static const struct device_info f1_devices[] = {
    GPIO_AT(0x40010800, 0, 0x18, 2), GPIO_AT(0x40010800, 1, 0x18, 3),
    GPIO_AT(0x40010800, 2, 0x18, 4), GPIO_AT(0x40010800, 3, 0x18, 5),
    GPIO_AT(0x40010800, 4, 0x18, 6),
    { 0x40013800, DEV_USART, 1, 37, 2, 0x18, 14 },
    { 0x40004400, DEV_USART, 2, 38, 1, 0x1c, 17 },
    { 0x40004800, DEV_USART, 3, 39, 1, 0x1c, 18 },
    { 0x40013000, DEV_SPI, 1, 0, 2, 0x18, 12 },
    { 0x40003800, DEV_SPI, 2, 0, 1, 0x1c, 14 },
    { 0x40005400, DEV_I2C, 1, 0, 1, 0x1c, 21 },
    { 0x40005800, DEV_I2C, 2, 0, 1, 0x1c, 22 },
    { 0x40003c00, DEV_SPI, 3, 0, 1, 0x1c, 15 },
    { 0x40012400, DEV_ADC, 0, 18, 2, 0x18, 9 },
    { 0x40012c00, DEV_TIM, 1, 0, 2, 0x18, 11 },
    { 0x40000000, DEV_TIM, 2, 0, 1, 0x1c, 0 },
    { 0x40000400, DEV_TIM, 3, 0, 1, 0x1c, 1 },
    { 0x40000800, DEV_TIM, 4, 0, 1, 0x1c, 2 },
    { 0x40021000, DEV_RCC, 0, 0, 0, 0, 0 },
    { 0x40022000, DEV_FLASH, 0, 0, 0, 0, 0 },
    { 0x40003000, DEV_IWDG, 0, 0, 0, 0, 0 },
    { 0x40010000, DEV_AFIO, 0, 0, 2, 0x18, 0 },
    { 0x40005c00, DEV_USBFS, 0, 20, 1, 0x1c, 23 },
    { 0x40006000, DEV_USB_MEMORY, 0, 0, 1, 0x1c, 23 },
    { 0x40006400, DEV_CAN, 1, 19, 1, 0x1c, 25 },
    { 0x40006c00, DEV_BACKUP, 0, 0, 1, 0x1c, 27 },
    { 0x40007000, DEV_PWR, 0, 0, 1, 0x1c, 28 },
    { 0, 0, 0, 0, 0, 0, 0 },
};

static const struct device_info f4_devices[] = {
    GPIO_AT(0x40020000, 0, 0x30, 0), GPIO_AT(0x40020000, 1, 0x30, 1),
    GPIO_AT(0x40020000, 2, 0x30, 2), GPIO_AT(0x40020000, 3, 0x30, 3),
    GPIO_AT(0x40020000, 4, 0x30, 4), GPIO_AT(0x40020000, 5, 0x30, 5),
    GPIO_AT(0x40020000, 6, 0x30, 6), GPIO_AT(0x40020000, 7, 0x30, 7),
    GPIO_AT(0x40020000, 8, 0x30, 8), GPIO_AT(0x40020000, 9, 0x30, 9),
    GPIO_AT(0x40020000, 10, 0x30, 10),
    { 0x40011000, DEV_USART, 1, 37, 2, 0x44, 4 },
    { 0x40012c00, DEV_SDIO, 0, 0, 2, 0x44, 11 },
    { 0x40004400, DEV_USART, 2, 38, 1, 0x40, 17 },
    { 0x40004800, DEV_USART, 3, 39, 1, 0x40, 18 },
    { 0x40004c00, DEV_USART, 4, 52, 1, 0x40, 19 },
    { 0x40005000, DEV_USART, 5, 53, 1, 0x40, 20 },
    { 0x40011400, DEV_USART, 6, 71, 2, 0x44, 5 },
    { 0x40013000, DEV_SPI, 1, 0, 2, 0x44, 12 },
    { 0x40003800, DEV_SPI, 2, 0, 1, 0x40, 14 },
    { 0x40005400, DEV_I2C, 1, 0, 1, 0x40, 21 },
    { 0x40005800, DEV_I2C, 2, 0, 1, 0x40, 22 },
    { 0x40003c00, DEV_SPI, 3, 0, 1, 0x40, 15 },
    { 0x40013400, DEV_SPI, 4, 0, 2, 0x44, 13 },
    { 0x40015000, DEV_SPI, 5, 0, 2, 0x44, 20 },
    { 0x40015400, DEV_SPI, 6, 0, 2, 0x44, 21 },
    { 0x40012000, DEV_ADC, 0, 18, 2, 0x44, 8 },
    { 0x40012200, DEV_ADC, 1, 18, 2, 0x44, 10 },
    { 0x40012300, DEV_ADC_COMMON, 0, 0, 2, 0x44, 8 },
    { 0x40010000, DEV_TIM, 1, 0, 2, 0x44, 0 },
    { 0x40000000, DEV_TIM, 2, 0, 1, 0x40, 0 },
    { 0x40000400, DEV_TIM, 3, 0, 1, 0x40, 1 },
    { 0x40000800, DEV_TIM, 4, 0, 1, 0x40, 2 },
    { 0x40000c00, DEV_TIM, 5, 0, 1, 0x40, 3 },
    { 0x40014000, DEV_TIM, 9, 0, 2, 0x44, 16 },
    { 0x40014400, DEV_TIM, 10, 0, 2, 0x44, 17 },
    { 0x40014800, DEV_TIM, 11, 0, 2, 0x44, 18 },
    { 0x40001800, DEV_TIM, 12, 0, 1, 0x40, 6 },
    { 0x40001c00, DEV_TIM, 13, 0, 1, 0x40, 7 },
    { 0x40002000, DEV_TIM, 14, 0, 1, 0x40, 8 },
    { 0x40023800, DEV_RCC, 0, 0, 0, 0, 0 },
    { 0x40023c00, DEV_FLASH, 0, 0, 0, 0, 0 },
    { 0x40007000, DEV_PWR, 0, 0, 1, 0x40, 28 },
    { 0x50000000, DEV_OTG, 0, 67, 0, 0x34, 7 },
    { 0x40006400, DEV_CAN, 1, 19, 1, 0x40, 25 },
    { 0x40006800, DEV_CAN, 2, 63, 1, 0x40, 26 },
    { 0x40002800, DEV_BACKUP, 0, 0, 0, 0, 0 },
    { 0x40003000, DEV_IWDG, 0, 0, 0, 0, 0 },
    { 0, 0, 0, 0, 0, 0, 0 },
};

static const struct device_info f0_devices[] = {
    GPIO_AT(0x48000000, 0, 0x14, 17), GPIO_AT(0x48000000, 1, 0x14, 18),
    GPIO_AT(0x48000000, 2, 0x14, 19), GPIO_AT(0x48000000, 3, 0x14, 20),
    GPIO_AT(0x48000000, 4, 0x14, 21), GPIO_AT(0x48000000, 5, 0x14, 22),
    { 0x40013800, DEV_USART, 1, 27, 1, 0x18, 14 },
    { 0x40004400, DEV_USART, 2, 28, 1, 0x1c, 17 },
    { 0x40013000, DEV_SPI, 1, 0, 1, 0x18, 12 },
    { 0x40003800, DEV_SPI, 2, 0, 1, 0x1c, 14 },
    { 0x40005400, DEV_I2C, 1, 0, 1, 0x1c, 21 },
    { 0x40005800, DEV_I2C, 2, 0, 1, 0x1c, 22 },
    { 0x40012400, DEV_ADC, 0, 12, 1, 0x18, 9 },
    { 0x40012700, DEV_ADC_COMMON, 0, 12, 1, 0x18, 9 },
    { 0x40012c00, DEV_TIM, 1, 0, 1, 0x18, 11 },
    { 0x40000000, DEV_TIM, 2, 0, 1, 0x1c, 0 },
    { 0x40000400, DEV_TIM, 3, 0, 1, 0x1c, 1 },
    { 0x40002000, DEV_TIM, 14, 0, 1, 0x1c, 8 },
    { 0x40014000, DEV_TIM, 15, 0, 1, 0x18, 16 },
    { 0x40014400, DEV_TIM, 16, 0, 1, 0x18, 17 },
    { 0x40014800, DEV_TIM, 17, 0, 1, 0x18, 18 },
    { 0x40021000, DEV_RCC, 0, 0, 0, 0, 0 },
    { 0x40022000, DEV_FLASH, 0, 0, 0, 0, 0 },
    { 0x40003000, DEV_IWDG, 0, 0, 0, 0, 0 },
    { 0x40010000, DEV_SYSCFG, 0, 0, 1, 0x18, 0 },
    { 0x40005c00, DEV_USBFS, 0, 31, 1, 0x1c, 23 },
    { 0x40006000, DEV_USB_MEMORY, 0, 0, 1, 0x1c, 23 },
    { 0x40006400, DEV_CAN, 1, 30, 1, 0x1c, 25 },
    { 0x40006c00, DEV_CRS, 0, 0, 1, 0x1c, 27 },
    { 0, 0, 0, 0, 0, 0, 0 },
};

static const struct device_info g0_devices[] = {
    GPIO_AT(0x50000000, 0, 0x34, 0), GPIO_AT(0x50000000, 1, 0x34, 1),
    GPIO_AT(0x50000000, 2, 0x34, 2), GPIO_AT(0x50000000, 3, 0x34, 3),
    GPIO_AT(0x50000000, 4, 0x34, 4), GPIO_AT(0x50000000, 5, 0x34, 5),
    { 0x40013800, DEV_USART, 1, 27, 1, 0x40, 14 },
    { 0x40004400, DEV_USART, 2, 28, 1, 0x3c, 17 },
    { 0x40004800, DEV_USART, 3, 29, 1, 0x3c, 18 },
    { 0x40005000, DEV_USART, 5, 29, 1, 0x3c, 8 },
    { 0x40013000, DEV_SPI, 1, 0, 1, 0x40, 12 },
    { 0x40003800, DEV_SPI, 2, 0, 1, 0x3c, 14 },
    { 0x40005400, DEV_I2C, 1, 0, 1, 0x3c, 21 },
    { 0x40005800, DEV_I2C, 2, 0, 1, 0x3c, 22 },
    { 0x40012400, DEV_ADC, 0, 12, 1, 0x40, 20 },
    { 0x40012700, DEV_ADC_COMMON, 0, 12, 1, 0x40, 20 },
    { 0x40012c00, DEV_TIM, 1, 0, 1, 0x40, 11 },
    { 0x40000000, DEV_TIM, 2, 0, 1, 0x3c, 0 },
    { 0x40000400, DEV_TIM, 3, 0, 1, 0x3c, 1 },
    { 0x40002000, DEV_TIM, 14, 0, 1, 0x40, 15 },
    { 0x40014000, DEV_TIM, 15, 0, 1, 0x40, 16 },
    { 0x40014400, DEV_TIM, 16, 0, 1, 0x40, 17 },
    { 0x40014800, DEV_TIM, 17, 0, 1, 0x40, 18 },
    { 0x40021000, DEV_RCC, 0, 0, 0, 0, 0 },
    { 0x40022000, DEV_FLASH, 0, 0, 0, 0, 0 },
    { 0x40003000, DEV_IWDG, 0, 0, 0, 0, 0 },
    { 0x40010000, DEV_SYSCFG, 0, 0, 1, 0x40, 0 },
    { 0x40005c00, DEV_USBFS, 0, 8, 1, 0x3c, 13 },
    { 0x40009800, DEV_USB_MEMORY, 0, 0, 1, 0x3c, 13 },
    { 0x40006c00, DEV_CRS, 0, 0, 1, 0x3c, 16 },
    { 0x40007000, DEV_PWR, 0, 0, 1, 0x3c, 28 },
    { 0x40006400, DEV_FDCAN, 1, 21, 1, 0x3c, 12 },
    { 0x40006800, DEV_FDCAN, 2, 21, 1, 0x3c, 12 },
    { 0x4000b400, DEV_FDCAN_RAM, 0, 0, 1, 0x3c, 12 },
    { 0, 0, 0, 0, 0, 0, 0 },
};

static int
g0_channels(uint8_t unit, uint8_t channel)
{
    static const uint8_t rest[] = { 27, 28, 36, 37 };

    (void)unit;
    if (channel >= 15 && channel < 19)
        return rest[channel - 15];
    if (channel < 11)
        return channel < 8 ? channel : 16 + channel - 8;
    return channel == 11 ? 26 : -1;
}

#define G4L4_DEVICES(ADC) \
    GPIO_AT(0x48000000, 0, 0x4c, 0), GPIO_AT(0x48000000, 1, 0x4c, 1), \
    GPIO_AT(0x48000000, 2, 0x4c, 2), GPIO_AT(0x48000000, 3, 0x4c, 3), \
    GPIO_AT(0x48000000, 4, 0x4c, 4), GPIO_AT(0x48000000, 5, 0x4c, 5), \
    GPIO_AT(0x48000000, 6, 0x4c, 6), GPIO_AT(0x48000000, 7, 0x4c, 7), \
    { 0x40013800, DEV_USART, 1, 37, 2, 0x60, 14 }, \
    { 0x40004400, DEV_USART, 2, 38, 1, 0x58, 17 }, \
    { 0x40004800, DEV_USART, 3, 39, 1, 0x58, 18 }, \
    { 0x40013000, DEV_SPI, 1, 0, 2, 0x60, 12 }, \
    { 0x40003800, DEV_SPI, 2, 0, 1, 0x58, 14 }, \
    { 0x40005400, DEV_I2C, 1, 0, 1, 0x58, 21 }, \
    { 0x40005800, DEV_I2C, 2, 0, 1, 0x58, 22 }, \
    { 0x40003c00, DEV_SPI, 3, 0, 1, 0x58, 15 }, \
    { ADC, DEV_ADC, 0, 18, 0, 0x4c, 13 }, \
    { (ADC) + 0x100, DEV_ADC, 1, 18, 0, 0x4c, 13 }, \
    { (ADC) + 0x300, DEV_ADC_COMMON, 0, 18, 0, 0x4c, 13 }, \
    { 0x40012c00, DEV_TIM, 1, 0, 2, 0x60, 11 }, \
    { 0x40000000, DEV_TIM, 2, 0, 1, 0x58, 0 }, \
    { 0x40000400, DEV_TIM, 3, 0, 1, 0x58, 1 }, \
    { 0x40000800, DEV_TIM, 4, 0, 1, 0x58, 2 }, \
    { 0x40014000, DEV_TIM, 15, 0, 2, 0x60, 16 }, \
    { 0x40014400, DEV_TIM, 16, 0, 2, 0x60, 17 }, \
    { 0x40021000, DEV_RCC, 0, 0, 0, 0, 0 }, \
    { 0x40022000, DEV_FLASH, 0, 0, 0, 0, 0 }, \
    { 0x40007000, DEV_PWR, 0, 0, 1, 0x58, 28 }, \
    { 0x40003000, DEV_IWDG, 0, 0, 0, 0, 0 }

static const struct device_info g4_devices[] = {
    G4L4_DEVICES(0x50000000),
    { 0x40005c00, DEV_USBFS, 0, 20, 1, 0x58, 23 },
    { 0x40006000, DEV_USB_MEMORY, 0, 0, 1, 0x58, 23 },
    { 0x40002000, DEV_CRS, 0, 0, 1, 0x58, 8 },
    { 0x40006400, DEV_FDCAN, 1, 21, 1, 0x58, 25 },
    { 0x40006800, DEV_FDCAN, 2, 86, 1, 0x58, 25 },
    { 0x4000a400, DEV_FDCAN_RAM, 0, 0, 1, 0x58, 25 },
    { 0, 0, 0, 0, 0, 0, 0 },
};
static const struct device_info l4_devices[] = {
    G4L4_DEVICES(0x50040000),
    { 0x40006800, DEV_USBFS, 0, 67, 1, 0x58, 26 },
    { 0x40006c00, DEV_USB_MEMORY, 0, 0, 1, 0x58, 26 },
    { 0x40006000, DEV_CRS, 0, 0, 1, 0x58, 24 },
    { 0, 0, 0, 0, 0, 0, 0 },
};

#define H7_DEVICES \
    GPIO_AT(0x58020000, 0, 0xe0, 0), GPIO_AT(0x58020000, 1, 0xe0, 1), \
    GPIO_AT(0x58020000, 2, 0xe0, 2), GPIO_AT(0x58020000, 3, 0xe0, 3), \
    GPIO_AT(0x58020000, 4, 0xe0, 4), GPIO_AT(0x58020000, 5, 0xe0, 5), \
    GPIO_AT(0x58020000, 6, 0xe0, 6), GPIO_AT(0x58020000, 7, 0xe0, 7), \
    GPIO_AT(0x58020000, 8, 0xe0, 8), GPIO_AT(0x58020000, 9, 0xe0, 9), \
    GPIO_AT(0x58020000, 10, 0xe0, 10), \
    { 0x40011000, DEV_USART, 1, 37, 2, 0xf0, 4 }, \
    { 0x40004400, DEV_USART, 2, 38, 1, 0xe8, 17 }, \
    { 0x40004800, DEV_USART, 3, 39, 1, 0xe8, 18 }, \
    { 0x40004c00, DEV_USART, 4, 52, 1, 0xe8, 19 }, \
    { 0x40005000, DEV_USART, 5, 53, 1, 0xe8, 20 }, \
    { 0x40011400, DEV_USART, 6, 71, 2, 0xf0, 5 }, \
    { 0x40013000, DEV_SPI, 1, 0, 2, 0xf0, 12 }, \
    { 0x40003800, DEV_SPI, 2, 0, 1, 0xe8, 14 }, \
    { 0x40005400, DEV_I2C, 1, 0, 1, 0xe8, 21 }, \
    { 0x40005800, DEV_I2C, 2, 0, 1, 0xe8, 22 }, \
    { 0x40003c00, DEV_SPI, 3, 0, 1, 0xe8, 15 }, \
    { 0x40013400, DEV_SPI, 4, 0, 2, 0xf0, 13 }, \
    { 0x40015000, DEV_SPI, 5, 0, 2, 0xf0, 20 }, \
    { 0x58001400, DEV_SPI, 6, 0, 2, 0xf4, 5 }, \
    { 0x40022000, DEV_ADC, 0, 18, 0, 0xd8, 5 }, \
    { 0x40022300, DEV_ADC_COMMON, 0, 18, 0, 0xd8, 5 }, \
    { 0x58026000, DEV_ADC, 1, 127, 0, 0xe0, 24 }, \
    { 0x58026300, DEV_ADC_COMMON, 1, 127, 0, 0xe0, 24 }, \
    { 0x40010000, DEV_TIM, 1, 0, 2, 0xf0, 0 }, \
    { 0x40000000, DEV_TIM, 2, 0, 1, 0xe8, 0 }, \
    { 0x40000400, DEV_TIM, 3, 0, 1, 0xe8, 1 }, \
    { 0x40000800, DEV_TIM, 4, 0, 1, 0xe8, 2 }, \
    { 0x40000c00, DEV_TIM, 5, 0, 1, 0xe8, 3 }, \
    { 0x40001800, DEV_TIM, 12, 0, 1, 0xe8, 6 }, \
    { 0x40001c00, DEV_TIM, 13, 0, 1, 0xe8, 7 }, \
    { 0x40002000, DEV_TIM, 14, 0, 1, 0xe8, 8 }, \
    { 0x40014000, DEV_TIM, 15, 0, 2, 0xf0, 16 }, \
    { 0x40014400, DEV_TIM, 16, 0, 2, 0xf0, 17 }, \
    { 0x40014800, DEV_TIM, 17, 0, 2, 0xf0, 18 }, \
    { 0x58024400, DEV_RCC, 0, 0, 0, 0, 0 }, \
    { 0x52002000, DEV_FLASH, 0, 0, 0, 0, 0 }, \
    { 0x58024800, DEV_PWR, 0, 0, 0, 0, 0 }, \
    { 0x58004800, DEV_IWDG, 0, 0, 0, 0, 0 }

#define H7_CAN \
    { 0x4000a000, DEV_FDCAN, 1, 19, 1, 0xec, 8 }, \
    { 0x4000a400, DEV_FDCAN, 2, 20, 1, 0xec, 8 }, \
    { 0x4000ac00, DEV_FDCAN_RAM, 0, 0, 1, 0xec, 8 }, \
    { 0x40008400, DEV_CRS, 0, 0, 1, 0xec, 1 }

static const struct device_info h7_devices[] = {
    H7_DEVICES, H7_CAN,
    { 0x40040000, DEV_OTG, 1, 77, 0, 0xd8, 25 },
    { 0x40080000, DEV_OTG, 0, 101, 0, 0xd8, 27 },
    { 0, 0, 0, 0, 0, 0, 0 },
};
static const struct device_info h723_devices[] = {
    H7_DEVICES, H7_CAN,
    { 0x40040000, DEV_OTG, 0, 77, 0, 0xd8, 25 },
    { 0, 0, 0, 0, 0, 0, 0 },
};

#define PIN(LETTER, BIT) (((LETTER) - 'A') * 16 + (BIT))

static int
g4_channels(uint8_t unit, uint8_t channel)
{
    static const int16_t pins[2][18] = {
        { -1, PIN('A', 0), PIN('A', 1), PIN('A', 2), PIN('A', 3), PIN('B', 14),
          PIN('C', 0), PIN('C', 1), PIN('C', 2), PIN('C', 3), PIN('F', 0),
          PIN('B', 12), PIN('B', 1), -1, -1, PIN('B', 0), -1, -1 },
        { -1, PIN('A', 0), PIN('A', 1), PIN('A', 6), PIN('A', 7), PIN('C', 4),
          PIN('C', 0), PIN('C', 1), PIN('C', 2), PIN('C', 3), PIN('F', 1),
          PIN('C', 5), PIN('B', 2), PIN('A', 5), PIN('B', 11), PIN('B', 15),
          -1, PIN('A', 4) },
    };

    return channel < 18 ? pins[unit][channel] : -1;
}

static int
l4_channels(uint8_t unit, uint8_t channel)
{
    if (unit || channel < 1 || channel > 16)
        return -1;
    if (channel <= 4)
        return PIN('C', channel - 1);
    if (channel <= 12)
        return PIN('A', channel - 5);
    return channel <= 14 ? PIN('C', channel - 9) : PIN('B', channel - 15);
}

static int
h7_channels(uint8_t unit, uint8_t channel)
{
    static const int16_t first[] = {
        -1, -1, PIN('F', 11), PIN('A', 6), PIN('C', 4), PIN('B', 1),
        PIN('F', 12), PIN('A', 7), PIN('C', 5), PIN('B', 0), PIN('C', 0),
        PIN('C', 1), PIN('C', 2), PIN('C', 3), PIN('A', 2), PIN('A', 3),
        PIN('A', 0), PIN('A', 1), PIN('A', 4), PIN('A', 5),
    };
    static const int16_t third[] = {
        -1, -1, PIN('F', 9), PIN('F', 7), PIN('F', 5), PIN('F', 3),
        PIN('F', 10), PIN('F', 8), PIN('F', 6), PIN('F', 4),
    };

    if (unit)
        return channel < 10 ? third[channel] : -1;
    return channel < 20 ? first[channel] : -1;
}

/* Channels of the F1, F2, F4 and F7; unit 1 is ADC3, with port F. */
static int
sixteen_channels(uint8_t unit, uint8_t channel)
{
    static const uint8_t second[] = { 6, 7, 8, 9, 10, 3 };

    if (unit == 1 && channel >= 4 && channel < 10)
        return 5 * 16 + second[channel - 4];
    if (unit == 1 && channel >= 14 && channel < 16)
        return 5 * 16 + channel - 10;
    if (channel < 8)
        return channel;
    if (channel < 10)
        return 16 + channel - 8;
    return channel < 16 ? 32 + channel - 10 : -1;
}

#define F4_MODEL(NAME, FLASH, RAM, HZ) \
    { NAME, &stm32_family, \
      UC_CPU_ARM_CORTEX_M4, LINE_F2F4F7, FLASH, 0x20000000, RAM, HZ, \
      16000000, true, false, 1, 0, f4_devices, sixteen_channels, tim4_pwm }

#define F0_MODEL(NAME, FLASH, RAM, TIMER) \
    { NAME, &stm32_family, \
      UC_CPU_ARM_CORTEX_M0, LINE_F0, FLASH, 0x20000000, RAM, 48000000, \
      8000000, true, true, 2, TIMER, f0_devices, sixteen_channels, tim16_pwm }
#define G0_MODEL(NAME, RAM, TIMER) \
    { NAME, &stm32_family, \
      UC_CPU_ARM_CORTEX_M0, LINE_G0, 0x20000, 0x20000000, RAM, \
      64000000, 16000000, true, true, 2, TIMER, g0_devices, g0_channels, \
      tim16_pwm }

static const struct chip_model models[] = {
    F0_MODEL("stm32f031", 0x8000, 0x1000, 2),
    F0_MODEL("stm32f042", 0x8000, 0x1800, 2),
    F0_MODEL("stm32f030", 0x10000, 0x2000, 3),
    F0_MODEL("stm32f070", 0x20000, 0x4000, 3),
    F0_MODEL("stm32f072", 0x20000, 0x4000, 2),
    G0_MODEL("stm32g070", 0x9000, 3),
    G0_MODEL("stm32g071", 0x9000, 2),
    G0_MODEL("stm32g0b1", 0x24000, 2),
    { "stm32f103", &stm32_family,
      UC_CPU_ARM_CORTEX_M3, LINE_F1, 0x10000, 0x20000000, 0x5000,
      72000000, 8000000, false, false, 1, 0, f1_devices, sixteen_channels,
      tim4_pwm },
    F4_MODEL("stm32f401", 0x40000, 0x10000, 84000000),
    F4_MODEL("stm32f405", 0x100000, 0x20000, 168000000),
    F4_MODEL("stm32f407", 0x80000, 0x20000, 168000000),
    F4_MODEL("stm32f429", 0x200000, 0x30000, 180000000),
    F4_MODEL("stm32f446", 0x80000, 0x20000, 180000000),
    { "stm32f207", &stm32_family,
      UC_CPU_ARM_CORTEX_M3, LINE_F2F4F7, 0x100000, 0x20000000,
      0x20000, 120000000, 16000000, true, false, 1, 0, f4_devices,
      sixteen_channels, tim4_pwm },
    { "stm32f765", &stm32_family,
      UC_CPU_ARM_CORTEX_M7, LINE_F2F4F7, 0x200000, 0x20000000,
      0x20000, 216000000, 16000000, true, true, 1, 0, f4_devices,
      sixteen_channels, tim4_pwm },
    { "stm32g431", &stm32_family,
      UC_CPU_ARM_CORTEX_M4, LINE_G4, 0x20000, 0x20000000, 0x8000,
      170000000, 16000000, true, true, 3, 0, g4_devices, g4_channels,
      tim4_pwm },
    { "stm32g474", &stm32_family,
      UC_CPU_ARM_CORTEX_M4, LINE_G4, 0x80000, 0x20000000,
      0x20000, 170000000, 16000000, true, true, 3, 0, g4_devices, g4_channels,
      tim4_pwm },
    { "stm32l412", &stm32_family,
      UC_CPU_ARM_CORTEX_M4, LINE_L4, 0x20000, 0x20000000, 0xa000,
      80000000, 16000000, true, true, 3, 0, l4_devices, l4_channels,
      l4_pwm },
    { "stm32h743", &stm32_family,
      UC_CPU_ARM_CORTEX_M7, LINE_H7, 0x200000, 0x20000000,
      0x20000, 400000000, 64000000, true, true, 3, 0, h7_devices, h7_channels,
      tim4_pwm },
    { "stm32h750", &stm32_family,
      UC_CPU_ARM_CORTEX_M7, LINE_H7, 0x20000, 0x20000000,
      0x20000, 400000000, 64000000, true, true, 3, 0, h7_devices, h7_channels,
      tim4_pwm },
    { "stm32h723", &stm32_family,
      UC_CPU_ARM_CORTEX_M7, LINE_H7, 0x100000, 0x20000000,
      0x20000, 520000000, 64000000, true, true, 3, 0, h723_devices, h7_channels,
      tim4_pwm },
    { .name = NULL },
};

/* Tables of families; each ends with a model that has no name. */
static const struct chip_model *const tables[] = {
    models, lpc176x_models, rp2040_models, sam_models, samd_models,
};

const struct chip_model *
unicorn_find_model(const char *name)
{
    const struct chip_model *model;
    uint32_t i;

    for (i = 0; i < sizeof(tables) / sizeof(tables[0]); i++)
        for (model = tables[i]; model->name; model++)
            if (name && !strcmp(model->name, name))
                return model;
    return NULL;
}
