/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * LPC1768 and LPC1769: memories and peripherals (UM10360, chapters 2 and 6).
 */
#include <stdlib.h>
#include <string.h>

#include "unicorn_lpc.h"
#include "unicorn_canhost.h"
#include "unicorn_usbhost.h"

/* base, kind, index, interrupt, field of PCLKSEL, 1 if it has a bit of PCONP,
 * that bit */
static const struct device_info devices[] = {
    { 0x400fc000, LPC_SYSCON, 0, 0, 0, 0, 0 },
    { 0x4002c000, LPC_PINS, 0, 0, 0, 0, 0 },
    { 0x2009c000, LPC_GPIO, 0, 0, 0, 1, 15 },
    { 0x2009c020, LPC_GPIO, 1, 0, 0, 1, 15 },
    { 0x2009c040, LPC_GPIO, 2, 0, 0, 1, 15 },
    { 0x2009c060, LPC_GPIO, 3, 0, 0, 1, 15 },
    { 0x2009c080, LPC_GPIO, 4, 0, 0, 1, 15 },
    { 0x4000c000, LPC_UART, 0, 5, 3, 1, 3 },
    { 0x40010000, LPC_UART, 1, 6, 4, 1, 4 },
    { 0x40098000, LPC_UART, 2, 7, 24, 1, 24 },
    { 0x4009c000, LPC_UART, 3, 8, 25, 1, 25 },
    { 0x40034000, LPC_ADC, 0, 22, 12, 1, 12 },
    { 0x40018000, LPC_PWM, 1, 9, 6, 1, 6 },
    { 0x40088000, LPC_SSP, 0, 14, 21, 1, 21 },
    { 0x40030000, LPC_SSP, 1, 15, 10, 1, 10 },
    { 0x4001c000, LPC_I2C, 0, 10, 7, 1, 7 },
    { 0x4005c000, LPC_I2C, 1, 11, 19, 1, 19 },
    { 0x400a0000, LPC_I2C, 2, 12, 26, 1, 26 },
    { 0x40044000, LPC_CAN, 1, 25, 13, 1, 13 },
    { 0x40048000, LPC_CAN, 2, 25, 14, 1, 14 },
    { 0x4003c000, LPC_CANAF, 0, 0, 0, 0, 0 },
    { 0x40038000, LPC_CAN_TABLE, 0, 0, 0, 0, 0 },
    { 0x40000000, LPC_WDT, 0, 0, 0, 0, 0 },
    { 0x5000c200, LPC_USB, 0, 24, 0, 1, 31 },
    { 0x5000cff0, LPC_USB_CLOCK, 0, 0, 0, 1, 31 },
    { 0, 0, 0, 0, 0, 0, 0 },
};

static const struct device_ops *const kinds[LPC_N_KINDS] = {
    [LPC_SYSCON] = &lpc_syscon_ops, [LPC_PINS] = &lpc_pins_ops,
    [LPC_GPIO] = &lpc_gpio_ops, [LPC_UART] = &lpc_uart_ops,
    [LPC_ADC] = &lpc_adc_ops, [LPC_PWM] = &lpc_pwm_ops,
    [LPC_SSP] = &lpc_ssp_ops,
    [LPC_I2C] = &lpc_i2c_ops, [LPC_WDT] = &lpc_wdt_ops,
    [LPC_USB] = &lpc_usb_ops, [LPC_USB_CLOCK] = &lpc_usb_clock_ops,
    [LPC_CAN] = &lpc_can_ops, [LPC_CANAF] = &lpc_canaf_ops,
    [LPC_CAN_TABLE] = &lpc_can_table_ops,
};

static const struct bus bus = {
    .kinds = kinds, .has_clock = lpc_has_clock,
    .areas = { { 0x40000000, 0x100000 }, { 0x2009c000, 0x1000 },
               { 0x5000c000, 0x1000 } },
};

/*
 * The boot ROM: one function, which uses the last 32 bytes of memory
 */

#define ROM_PAGE 0x1fff1000u
#define ROM_ENTRY 0x1fff1ff0u
enum { OPCODE_BX_LR = 0x4770, READ_SERIAL = 58 };

static void
on_rom(uc_engine *uc, uint64_t addr, uint32_t size, void *param)
{
    static const uint32_t answer[5] = { 0, 0x06050403, 0x0a090807, 0x0e0d0c0b,
                                        0x1211100f };
    uint32_t command, result, code = 0;

    (void)addr;
    (void)size;
    (void)param;
    uc_reg_read(uc, UC_ARM_REG_R0, &command);
    uc_reg_read(uc, UC_ARM_REG_R1, &result);
    uc_mem_read(uc, command, &code, sizeof(code));
    memset(chip.ram + chip.model->ram_size - 32, 0xee, 32);
    if (code != READ_SERIAL)
        chip_fault("function %u of the boot ROM", code);
    uc_mem_write(uc, result, answer, sizeof(answer));
}

static void
map(uc_engine *uc)
{
    const uint16_t opcode = OPCODE_BX_LR;
    uc_hook hook;

    bus_map(uc, &bus);
    if (uc_mem_map(uc, ROM_PAGE, 0x1000, UC_PROT_READ | UC_PROT_EXEC)
        || uc_mem_write(uc, ROM_ENTRY, &opcode, sizeof(opcode))
        || uc_hook_add(uc, &hook, UC_HOOK_CODE, (void *)on_rom, NULL,
                       ROM_ENTRY, ROM_ENTRY))
        chip_fault("no boot ROM");
}

/*
 * What runs with the bus: the USB host, where that is the console
 */

static void
run_events(void)
{
    bus_run_events();
    usbhost_run_events();
}

static uint64_t
next_event(void)
{
    uint64_t next = bus_next_event(), other = usbhost_next_event();

    return other < next ? other : next;
}

static uint64_t
rx_free_at(void)
{
    return lpc_uses_usb() ? usbhost_free_at() : bus_rx_free_at();
}

static void
rx(uint8_t byte)
{
    if (lpc_uses_usb())
        usbhost_rx(byte);
    else if (canhost_is_used())
        canhost_rx(byte);
    else
        lpc_rx(byte);
}

/* P0.0 to P4.31 */
static int32_t
find_pin(const char *name)
{
    char *end;
    long port, bit;

    if (name[0] != 'P')
        return -1;
    port = strtol(name + 1, &end, 10);
    if (*end != '.')
        return -1;
    bit = strtol(end + 1, &end, 10);
    return *end || port < 0 || port > 4 || bit < 0 || bit > 31 ? -1
        : (int32_t)(port * 32 + bit);
}

static const struct family family = {
    .flash_base = 0, .map = map, .reset = bus_reset,
    .run_events = run_events, .next_event = next_event,
    .rx_free_at = rx_free_at, .rx = rx, .find_pin = find_pin,
};

#define LPC_MODEL(NAME, HZ) \
    { .name = NAME, .family = &family, .cpu = UC_CPU_ARM_CORTEX_M3, \
      .flash_size = 0x80000, .ram_base = 0x10000000, .ram_size = 0x8000, \
      .max_hz = HZ, .hsi_hz = 4000000, .devices = devices }

const struct chip_model lpc176x_models[] = {
    LPC_MODEL("lpc1768", 100000000),
    LPC_MODEL("lpc1769", 120000000),
    { .name = NULL },
};
