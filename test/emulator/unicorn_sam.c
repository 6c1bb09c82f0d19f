/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * SAM3X, SAM4S, SAM4E and SAM E70: memories and peripherals (data sheets,
 * memories and product mapping, peripheral identifiers).
 */
#include "unicorn_sam.h"
#include "unicorn_canhost.h"
#include "unicorn_usbhost.h"

/* A peripheral whose clock can be off */
#define GATED(BASE, KIND, INDEX, ID) { BASE, KIND, INDEX, ID, 0, 1, 0 }
/* One that is always on */
#define ALWAYS(BASE, KIND, INDEX, ID) { BASE, KIND, INDEX, ID, 0, 0, 0 }
#define END { 0, 0, 0, 0, 0, 0, 0 }

static const struct device_info sam3x_devices[] = {
    ALWAYS(0x400e0600, SAM_PMC, 0, 5), ALWAYS(0x400e0400, SAM_MATRIX, 0, 0),
    ALWAYS(0x400e0a00, SAM_EFC, 0, 6), ALWAYS(0x400e0c00, SAM_EFC, 1, 7),
    ALWAYS(0x400e1a50, SAM_WDT, 0, 0), ALWAYS(0x400e0e00, SAM_PIO, 0, 11),
    ALWAYS(0x400e1000, SAM_PIO, 1, 12), ALWAYS(0x400e1200, SAM_PIO, 2, 13),
    ALWAYS(0x400e1400, SAM_PIO, 3, 14), GATED(0x400e0800, SAM_UART, 0, 8),
    GATED(0x40098000, SAM_USART, 0, 17), GATED(0x4009c000, SAM_USART, 1, 18),
    GATED(0x400a0000, SAM_USART, 2, 19), GATED(0x40008000, SAM_SPI, 0, 24),
    GATED(0x4008c000, SAM_TWI, 0, 22), GATED(0x40090000, SAM_TWI, 1, 23),
    GATED(0x40094000, SAM_PWM, 0, 36), GATED(0x400c0000, SAM_ADC, 0, 37),
    GATED(0x400ac000, SAM_USBHS, 0, 40),
    GATED(0x400ac800, SAM_USBHS_CTRL, 0, 40),
    END,
};

static const struct device_info sam4s_devices[] = {
    ALWAYS(0x400e0400, SAM_PMC, 0, 5), ALWAYS(0x400e0200, SAM_MATRIX, 0, 0),
    ALWAYS(0x400e0a00, SAM_EFC, 0, 6), ALWAYS(0x400e1450, SAM_WDT, 0, 0),
    ALWAYS(0x400e0e00, SAM_PIO, 0, 11), ALWAYS(0x400e1000, SAM_PIO, 1, 12),
    ALWAYS(0x400e1200, SAM_PIO, 2, 13), GATED(0x400e0600, SAM_UART, 0, 8),
    GATED(0x400e0800, SAM_UART, 1, 9), GATED(0x40024000, SAM_USART, 0, 14),
    GATED(0x40028000, SAM_USART, 1, 15), GATED(0x40008000, SAM_SPI, 0, 21),
    GATED(0x40018000, SAM_TWI, 0, 19), GATED(0x4001c000, SAM_TWI, 1, 20),
    GATED(0x40020000, SAM_PWM, 0, 31), GATED(0x40038000, SAM_ADC, 0, 29),
    GATED(0x40034000, SAM_UDP, 0, 34),
    END,
};

static const struct device_info sam4e_devices[] = {
    ALWAYS(0x400e0400, SAM_PMC, 0, 5), ALWAYS(0x400e0200, SAM_MATRIX, 0, 0),
    ALWAYS(0x400e0a00, SAM_EFC, 0, 6), ALWAYS(0x400e1850, SAM_WDT, 0, 0),
    ALWAYS(0x400e1900, SAM_RSWDT, 0, 0), ALWAYS(0x400e0e00, SAM_PIO, 0, 9),
    ALWAYS(0x400e1000, SAM_PIO, 1, 10), ALWAYS(0x400e1200, SAM_PIO, 2, 11),
    ALWAYS(0x400e1400, SAM_PIO, 3, 12), ALWAYS(0x400e1600, SAM_PIO, 4, 13),
    GATED(0x400e0600, SAM_UART, 0, 7), GATED(0x40060600, SAM_UART, 1, 45),
    GATED(0x400a0000, SAM_USART, 0, 14), GATED(0x400a4000, SAM_USART, 1, 15),
    GATED(0x40088000, SAM_SPI, 0, 19), GATED(0x400a8000, SAM_TWI, 0, 17),
    GATED(0x400ac000, SAM_TWI, 1, 18), GATED(0x40000000, SAM_PWM, 0, 36),
    GATED(0x400b0000, SAM_AFEC, 0, 30), GATED(0x400b4000, SAM_AFEC, 1, 31),
    GATED(0x40084000, SAM_UDP, 0, 35),
    END,
};

static const struct device_info same70_devices[] = {
    ALWAYS(0x400e0600, SAM_PMC, 0, 5), ALWAYS(0x40088000, SAM_MATRIX, 0, 0),
    ALWAYS(0x400e0c00, SAM_EFC, 0, 6), ALWAYS(0x400e1850, SAM_WDT, 0, 0),
    ALWAYS(0x400e1900, SAM_RSWDT, 0, 0), ALWAYS(0x400e0e00, SAM_PIO, 0, 10),
    ALWAYS(0x400e1000, SAM_PIO, 1, 11), ALWAYS(0x400e1200, SAM_PIO, 2, 12),
    ALWAYS(0x400e1400, SAM_PIO, 3, 16), ALWAYS(0x400e1600, SAM_PIO, 4, 17),
    GATED(0x400e0800, SAM_UART, 0, 7), GATED(0x400e1a00, SAM_UART, 2, 44),
    GATED(0x40024000, SAM_USART, 0, 13), GATED(0x40028000, SAM_USART, 1, 14),
    GATED(0x4002c000, SAM_USART, 2, 15), GATED(0x40008000, SAM_SPI, 0, 21),
    GATED(0x40058000, SAM_SPI, 1, 42), GATED(0x40018000, SAM_TWI, 0, 19),
    GATED(0x4001c000, SAM_TWI, 1, 20), GATED(0x40060000, SAM_TWI, 2, 41),
    GATED(0x40020000, SAM_PWM, 0, 31), GATED(0x4005c000, SAM_PWM, 1, 60),
    GATED(0x4003c000, SAM_AFEC, 0, 29), GATED(0x40064000, SAM_AFEC, 1, 40),
    GATED(0x40038000, SAM_USBHS, 0, 34),
    GATED(0x40038800, SAM_USBHS_CTRL, 0, 34),
    GATED(0x40030000, SAM_CAN, 0, 35), GATED(0x40034000, SAM_CAN, 1, 37),
    END,
};

#define PIN(LETTER, BIT) (((LETTER) - 'A') * 32 + (BIT))

/* Pins of the converters' channels; the temperature has none */
static const int16_t adc_pins[SAME70 + 1][2][16] = {
    [SAM3X] = { {
        PIN('A', 2), PIN('A', 3), PIN('A', 4), PIN('A', 6), PIN('A', 22),
        PIN('A', 23), PIN('A', 24), PIN('A', 16), PIN('B', 12), PIN('B', 13),
        PIN('B', 17), PIN('B', 18), PIN('B', 19), PIN('B', 20), PIN('B', 21),
        -1 } },
    [SAM4S] = { {
        PIN('A', 17), PIN('A', 18), PIN('A', 19), PIN('A', 20), PIN('B', 0),
        PIN('B', 1), PIN('B', 2), PIN('B', 3), PIN('A', 21), PIN('A', 22),
        PIN('C', 13), PIN('C', 15), PIN('C', 12), PIN('C', 29), PIN('C', 30),
        -1 } },
    [SAM4E] = { {
        PIN('A', 17), PIN('A', 18), PIN('A', 19), PIN('A', 20), PIN('B', 0),
        PIN('B', 1), PIN('C', 13), PIN('C', 15), PIN('C', 12), PIN('C', 29),
        PIN('C', 30), PIN('C', 31), PIN('C', 26), PIN('C', 27), PIN('C', 0),
        -1 }, {
        PIN('B', 2), PIN('B', 3), PIN('A', 21), PIN('A', 22), PIN('C', 1),
        PIN('C', 2), PIN('C', 3), PIN('C', 4) } },
    [SAME70] = { {
        PIN('D', 30), PIN('A', 21), PIN('B', 3), PIN('E', 5), PIN('E', 4),
        PIN('B', 2), PIN('A', 17), PIN('A', 18), PIN('A', 19), PIN('A', 20),
        PIN('B', 0), -1 }, {
        PIN('B', 1), PIN('C', 13), PIN('C', 15), PIN('C', 12), PIN('C', 29),
        PIN('C', 30), PIN('C', 31), PIN('C', 26), PIN('C', 27), PIN('C', 0),
        PIN('E', 3), PIN('E', 0) } },
};

static int
find_adc_pin(uint8_t unit, uint8_t channel)
{
    return channel < 16 ? adc_pins[sam_line()][unit][channel] : -1;
}

static const struct device_ops *const kinds[SAM_N_KINDS] = {
    [SAM_PMC] = &sam_pmc_ops, [SAM_EFC] = &sam_efc_ops,
    [SAM_PIO] = &sam_pio_ops, [SAM_MATRIX] = &sam_matrix_ops,
    [SAM_UART] = &sam_uart_ops, [SAM_ADC] = &sam_adc_ops,
    [SAM_AFEC] = &sam_afec_ops, [SAM_PWM] = &sam_pwm_ops,
    [SAM_SPI] = &sam_spi_ops, [SAM_USART] = &sam_usart_ops,
    [SAM_TWI] = &sam_twi_ops, [SAM_WDT] = &sam_wdt_ops,
    [SAM_RSWDT] = &sam_rswdt_ops, [SAM_UDP] = &sam_udp_ops,
    [SAM_USBHS] = &sam_usbhs_ops, [SAM_USBHS_CTRL] = &sam_usbhs_ctrl_ops,
    [SAM_CAN] = &sam_can_ops,
};

static const struct bus bus = {
    .kinds = kinds, .has_clock = sam_has_clock,
    .areas = { { 0x40000000, 0x100000 } },
};

static void
map(uc_engine *uc)
{
    bus_map(uc, &bus);
    if (sam_line() == SAM3X || sam_line() == SAME70)
        sam_usbhs_map(uc, sam_line() == SAM3X ? 0x20180000 : 0xa0100000);
}

static int32_t
find_pin(const char *name)
{
    return chip_find_pin(name, 32);
}

/*
 * What runs with the bus: the USB host, where that is the console
 */

static void
run_events(void)
{
    bus_run_events();
    if (sam_uses_usb())
        usbhost_run_events();
}

static uint64_t
next_event(void)
{
    uint64_t next = bus_next_event(), other = NEVER;

    if (sam_uses_usb())
        other = usbhost_next_event();
    return other < next ? other : next;
}

static uint64_t
rx_free_at(void)
{
    return sam_uses_usb() ? usbhost_free_at() : bus_rx_free_at();
}

static void
rx(uint8_t byte)
{
    if (sam_uses_usb())
        usbhost_rx(byte);
    else if (canhost_is_used())
        canhost_rx(byte);
    else
        sam_rx(byte);
}

#define SAM_FAMILY(FLASH) \
    { .flash_base = FLASH, .map = map, .reset = bus_reset, \
      .run_events = run_events, .next_event = next_event, \
      .rx_free_at = rx_free_at, .rx = rx, .find_pin = find_pin }
static const struct family sam3_family = SAM_FAMILY(0x80000);
static const struct family sam4_family = SAM_FAMILY(0x400000);

#define SAM_MODEL(NAME, FAMILY, CPU, LINE, RAM, SIZE, HZ, DEVICES) \
    { .name = NAME, .family = &FAMILY, .cpu = UC_CPU_ARM_CORTEX_##CPU, \
      .line = (enum line)LINE, .flash_size = 0x80000, .ram_base = RAM, \
      .ram_size = SIZE, .max_hz = HZ, .hsi_hz = 4000000, \
      .devices = DEVICES, .adc_pin = find_adc_pin }

const struct chip_model sam_models[] = {
    SAM_MODEL("sam3x8e", sam3_family, M3, SAM3X, 0x20070000, 0x18000, 84000000,
              sam3x_devices),
    SAM_MODEL("sam3x8c", sam3_family, M3, SAM3X, 0x20070000, 0x18000, 84000000,
              sam3x_devices),
    SAM_MODEL("sam4s8c", sam4_family, M4, SAM4S, 0x20000000, 0x20000,
              120000000, sam4s_devices),
    SAM_MODEL("sam4e8e", sam4_family, M4, SAM4E, 0x20000000, 0x20000,
              120000000, sam4e_devices),
    SAM_MODEL("same70q20b", sam4_family, M7, SAME70, 0x20400000, 0x20000,
              300000000, same70_devices),
    { .name = NULL },
};
