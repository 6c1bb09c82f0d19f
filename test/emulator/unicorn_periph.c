/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The bus of an STM32, and on it GPIO, USART and watchdog.
 */
#include <string.h>

#include "unicorn_can.h"
#include "unicorn_canhost.h"
#include "unicorn_usbhost.h"

#define PERIPH_BASE 0x40000000u
#define PERIPH_SIZE 0x20000000u
#define LSI_HZ 32000

/* Words of the registers */
enum { V2_MODER = 0, V2_PUPDR = 3, V2_IDR = 4, V2_ODR = 5, V2_BSRR = 6,
       V2_BRR = 10, V1_IDR = 2, V1_ODR = 3, V1_BSRR = 4, V1_BRR = 5 };
enum { SR_ORE = 1 << 3, SR_RXNE = 1 << 5, SR_TC = 1 << 6, SR_TXE = 1 << 7,
       CR1_RXNEIE = 1 << 5, CR1_TXEIE = 1 << 7 };

/*
 * GPIO
 */

/* What a pin is set to: 0 input, 1 output, 2 alternate, 3 analog; and the
 * pull of an input. */
uint32_t
gpio_mode_of(const struct device *d, uint32_t bit, int8_t *pull)
{
    uint32_t nibble, pupd;

    if (chip.model->gpio_v2) {
        pupd = (d->regs[V2_PUPDR] >> (2 * bit)) & 3;
        *pull = pupd == 1 ? 1 : pupd == 2 ? -1 : 0;
        return (d->regs[V2_MODER] >> (2 * bit)) & 3;
    }
    nibble = (d->regs[bit / 8] >> (4 * (bit % 8))) & 15;
    *pull = nibble != 8 ? 0 : d->regs[V1_ODR] & (1u << bit) ? 1 : -1;
    if (nibble & 3)
        return nibble & 8 ? 2 : 1;
    return nibble ? 0 : 3;
}

/* Tell the world what outputs have changed. */
static void
update_outputs(struct device *d)
{
    uint32_t odr = d->regs[chip.model->gpio_v2 ? V2_ODR : V1_ODR], bit;
    uint32_t changed = (d->out ^ odr) & d->driven;

    d->out = (d->out & ~d->driven) | (odr & d->driven);
    while (changed) {
        bit = (uint32_t)__builtin_ctz(changed);
        changed &= changed - 1;
        chip.host.pin_out(chip.host.ctx, chip_now(), d->info->index * 16 + bit,
                          (odr >> bit) & 1);
    }
}

/* Modes have changed: what is an output now shows its level. */
static void
update_modes(struct device *d)
{
    uint32_t odr = d->regs[chip.model->gpio_v2 ? V2_ODR : V1_ODR], bit;
    uint32_t was = d->driven;
    int8_t pull;

    d->driven = 0;
    for (bit = 0; bit < 16; bit++)
        if (gpio_mode_of(d, bit, &pull) == 1)
            d->driven |= 1u << bit;
    /* a pin that begins to be driven had no level before */
    d->out = (d->out & was) | (~odr & d->driven & ~was);
    update_outputs(d);
    timer_update_pwm();
}

static uint32_t
read_inputs(struct device *d)
{
    uint32_t bit, idr = 0;

    for (bit = 0; bit < 16; bit++) {
        int8_t pull;
        uint32_t mode = gpio_mode_of(d, bit, &pull);

        if (mode == 1)
            idr |= d->out & (1u << bit);
        else if (mode == 0 && chip.host.pin_in(
                     chip.host.ctx, chip_now(), d->info->index * 16 + bit,
                     pull))
            idr |= 1u << bit;
    }
    return idr;
}

static uint32_t
gpio_read(struct device *d, uint32_t word)
{
    if (word == (chip.model->gpio_v2 ? V2_IDR : V1_IDR))
        return read_inputs(d);
    return d->regs[word];
}

static void
gpio_write(struct device *d, uint32_t word, uint32_t value)
{
    uint32_t *odr = &d->regs[chip.model->gpio_v2 ? V2_ODR : V1_ODR];

    if (word == (chip.model->gpio_v2 ? V2_BSRR : V1_BSRR)) {
        *odr = ((*odr & ~(value >> 16)) | value) & 0xffff;
    } else if (word == (chip.model->gpio_v2 ? V2_BRR : V1_BRR)) {
        *odr &= ~value;
    } else if (odr == &d->regs[word]) {
        *odr = value & 0xffff;
    } else {
        d->regs[word] = value;
        update_modes(d);
        return;
    }
    update_outputs(d);
}

/*
 * USART.  regs[] holds: 0 status, 1 control, 2 divider.
 */

/* Word of the chip's register: its purpose */
enum usart_word { USART_STATUS, USART_CR1, USART_BRR, USART_RDR, USART_TDR,
                  USART_ICR, USART_OTHER };

static enum usart_word
usart_word(uint32_t word)
{
    static const uint8_t v1[] = { USART_STATUS, USART_RDR, USART_BRR, USART_CR1,
                                  USART_OTHER, USART_OTHER, USART_OTHER };
    static const uint8_t v2[] = { USART_CR1, USART_OTHER, USART_OTHER,
                                  USART_BRR, USART_OTHER, USART_OTHER, USART_OTHER,
                                  USART_STATUS, USART_ICR, USART_RDR,
                                  USART_TDR };

    if (chip.model->usart_v2)
        return word < sizeof(v2) ? v2[word] : USART_OTHER;
    return word < sizeof(v1) ? v1[word] : USART_OTHER;
}

static void
update_usart_irq(struct device *d)
{
    bool rx = d->regs[0] & (SR_RXNE | SR_ORE) && d->regs[1] & CR1_RXNEIE;
    bool tx = d->regs[0] & SR_TXE && d->regs[1] & CR1_TXEIE;

    core_set_pending(16u + d->info->irq, rx || tx);
}

/* Cycles of the core that a byte takes; 0 if the baud rate is wrong. */
static uint64_t
usart_byte_cycles(const struct device *d)
{
    uint32_t enable = chip.model->usart_v2 ? 1u : 1u << 13;
    uint32_t bus = chip.bus_hz[d->info->bus], brr = d->regs[2];
    double baud;

    if (!brr || !(d->regs[1] & enable))
        return 0;
    baud = (double)bus / brr;
    if (baud < chip.baud * .97 || baud > chip.baud * 1.03) {
        chip_fault("usart at %.0f baud instead of %u", baud, chip.baud);
        return 0;
    }
    return (uint64_t)(10. * chip.core_hz / baud);
}

static void
start_tx(struct device *d)
{
    if (!d->has_tdr || d->due != NEVER)
        return;
    d->shift = d->regs[3];
    d->has_tdr = false;
    d->regs[0] |= SR_TXE;
    d->due = chip.cycle + usart_byte_cycles(d);
    chip_wake_at(d->due);
}

static void
usart_event(struct device *d)
{
    uint8_t byte = (uint8_t)d->shift;

    if (chip.cycle < d->due)
        return;
    d->due = NEVER;
    chip.host.tx(chip.host.ctx, chip_now(), &byte, 1);
    start_tx(d);
    update_usart_irq(d);
}

static void
usart_write(struct device *d, uint32_t word, uint32_t value)
{
    switch (usart_word(word)) {
    case USART_CR1:
        d->regs[1] = value;
        chip.console = d;
        break;
    case USART_BRR:
        d->regs[2] = value;
        break;
    case USART_RDR:             /* DR of the first version */
    case USART_TDR:
        d->regs[3] = value;
        d->regs[0] &= ~(uint32_t)SR_TXE;
        d->has_tdr = true;
        start_tx(d);
        break;
    case USART_ICR:
        d->regs[0] &= ~(value & SR_ORE);
        break;
    default:
        break;
    }
    update_usart_irq(d);
}

static uint32_t
usart_read(struct device *d, uint32_t word)
{
    switch (usart_word(word)) {
    case USART_STATUS:
        return d->regs[0];
    case USART_CR1:
        return d->regs[1];
    case USART_BRR:
        return d->regs[2];
    case USART_RDR:
        d->regs[0] &= ~(uint32_t)SR_RXNE;
        if (!chip.model->usart_v2)
            d->regs[0] &= ~(uint32_t)SR_ORE;
        update_usart_irq(d);
        return d->rx_data;
    default:
        return 0;
    }
}

static uint64_t
periph_rx_free_at(void)
{
    if (chip.console)
        return chip.console->next_rx;
    return canhost_is_used() ? canhost_free_at() : usbhost_free_at();
}

static void
periph_rx(uint8_t byte)
{
    struct device *d = chip.console;
    uint64_t cycles = d ? usart_byte_cycles(d) : 0;

    if (!d && canhost_is_used())
        canhost_rx(byte);
    else if (!d)
        usbhost_rx(byte);
    if (!cycles)
        return;
    d->next_rx = chip.cycle + cycles;
    if (d->regs[0] & SR_RXNE) {
        d->regs[0] |= SR_ORE;
    } else {
        d->rx_data = byte;
        d->regs[0] |= SR_RXNE;
    }
    update_usart_irq(d);
}

/*
 * The watchdog
 */

static void
iwdg_write(struct device *d, uint32_t word, uint32_t value)
{
    bool is_on = d->due != NEVER;

    if (word != 0) {
        d->regs[word] = value;
        return;
    }
    if (value == 0xcccc)
        is_on = true;
    else if (value != 0xaaaa)
        return;
    if (is_on)
        d->due = chip.cycle + (uint64_t)chip.core_hz
            * ((d->regs[2] ? d->regs[2] : 4095) << (d->regs[1] + 2)) / LSI_HZ;
    chip_wake_at(d->due);
}

static void
iwdg_event(struct device *d)
{
    if (chip.cycle < d->due)
        return;
    d->due = NEVER;
    chip.wants_reset = true;
}

/*
 * Memory that outlives a reset: it can be written when PWR allows that
 */

static void
write_backup(struct device *d, uint32_t word, uint32_t value)
{
    if (chip.pwr && chip.pwr->regs[0] & (1u << 8))
        d->regs[word] = value;
}

/*
 * The bus
 */

/* Bytes that a device covers, where the next one does not end it. */
static uint32_t
span_of(const struct device *d)
{
    if (d->info->kind == DEV_OTG)
        return 0x40000;
    if (d->info->kind == DEV_USB_MEMORY)
        return 0x800;
    return d->info->kind == DEV_FDCAN_RAM ? 0x2800 : MAX_REGS * 4;
}

/* Of these other widths than words may be accessed. */
static bool
is_narrow(const struct device *d)
{
    return d->info->kind == DEV_SPI || d->info->kind == DEV_USB_MEMORY;
}

static struct device *
find_device(uint32_t addr)
{
    struct device *found = NULL;
    uint32_t i, nearest = UINT32_MAX;

    for (i = 0; i < chip.n_devices; i++) {
        struct device *d = &chip.devices[i];

        if (addr - d->info->base < nearest
            && addr - d->info->base < span_of(d)) {
            nearest = addr - d->info->base;
            found = d;
        }
    }
    if (!found)
        chip_fault("nothing is modelled at 0x%08x", addr);
    else if (!rcc_has_clock(found))
        chip_fault("0x%08x has no clock", addr);
    return chip.is_broken ? NULL : found;
}

static uint64_t
bus_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    uint32_t addr = PERIPH_BASE + (uint32_t)offset, word;
    struct device *d = find_device(addr);

    (void)uc;
    (void)param;
    if (!d || (size != 4 && !is_narrow(d)))
        return 0;
    word = (addr - d->info->base) / 4;
    switch ((enum device_kind)d->info->kind) {
    case DEV_GPIO:
        return gpio_read(d, word);
    case DEV_USART:
        return usart_read(d, word);
    case DEV_ADC:
        return adc_read(d, word);
    case DEV_SPI:
        return spi_read(d, word);
    case DEV_I2C:
        return i2c_read(d, word);
    case DEV_TIM:
        return timer_read(d, word);
    case DEV_RCC:
        return rcc_read(d, word * 4);
    case DEV_PWR:
        /* what was asked for is so at once: the flags are where the bits are */
        if (chip.model->line == LINE_H7)
            return d->regs[word] | (word == 1 || word == 6 ? 1u << 13 : 0)
                | (word == 3 && d->regs[3] & (1u << 24) ? 1u << 26 : 0);
        return word == 1 && chip.model->line == LINE_F2F4F7
            ? d->regs[0] & (3u << 16) : d->regs[word];
    case DEV_USB_MEMORY:
        return usbfs_memory_read(addr - d->info->base, size);
    case DEV_OTG:
        return otg_read(addr - d->info->base);
    case DEV_CAN:
        return bxcan_read(d, word);
    case DEV_FDCAN:
        return mcan_read(d, word);
    case DEV_FDCAN_RAM:
        return fdcan_memory_read(addr - d->info->base);
    case DEV_SDIO:
        return sdio_read(d, word);
    default:
        return d->regs[word];
    }
}

static void
bus_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    uint32_t addr = PERIPH_BASE + (uint32_t)offset, word;
    struct device *d = find_device(addr);

    (void)uc;
    (void)param;
    if (!d)
        return;
    if (size != 4 && !is_narrow(d)) {
        chip_fault("%u bytes written to 0x%08x", size, addr);
        return;
    }
    word = (addr - d->info->base) / 4;
    switch ((enum device_kind)d->info->kind) {
    case DEV_GPIO:
        gpio_write(d, word, (uint32_t)value);
        return;
    case DEV_USART:
        usart_write(d, word, (uint32_t)value);
        return;
    case DEV_ADC:
        adc_write(d, word, (uint32_t)value);
        return;
    case DEV_SPI:
        spi_write(d, word, (uint32_t)value);
        return;
    case DEV_I2C:
        i2c_write(d, word, (uint32_t)value);
        return;
    case DEV_TIM:
        timer_write(d, word, (uint32_t)value);
        return;
    case DEV_RCC:
        rcc_write(d, word * 4, (uint32_t)value);
        return;
    case DEV_IWDG:
        iwdg_write(d, word, (uint32_t)value);
        return;
    case DEV_USBFS:
        usbfs_write(d, word, (uint32_t)value);
        return;
    case DEV_USB_MEMORY:
        usbfs_memory_write(addr - d->info->base, size, (uint32_t)value);
        return;
    case DEV_OTG:
        otg_write(d, addr - d->info->base, (uint32_t)value);
        return;
    case DEV_CAN:
        bxcan_write(d, word, (uint32_t)value);
        return;
    case DEV_FDCAN:
        mcan_write(d, word, (uint32_t)value);
        return;
    case DEV_FDCAN_RAM:
        fdcan_memory_write(addr - d->info->base, (uint32_t)value);
        return;
    case DEV_SDIO:
        sdio_write(d, word, (uint32_t)value);
        return;
    case DEV_BACKUP:
        write_backup(d, word, (uint32_t)value);
        return;
    default:
        d->regs[word] = (uint32_t)value;
    }
}

static void
periph_run_events(void)
{
    uint32_t i;

    usbhost_run_events();
    canhost_run_events();
    for (i = 0; i < chip.n_devices; i++) {
        struct device *d = &chip.devices[i];

        if (chip.cycle < d->due)
            continue;
        if (d->info->kind == DEV_USART)
            usart_event(d);
        else if (d->info->kind == DEV_ADC)
            adc_run_event(d);
        else if (d->info->kind == DEV_SPI)
            spi_run_event(d);
        else if (d->info->kind == DEV_IWDG)
            iwdg_event(d);
    }
}

static uint64_t
periph_next_event(void)
{
    uint64_t next = usbhost_next_event(), other = canhost_next_event();
    uint32_t i;

    if (other < next)
        next = other;

    for (i = 0; i < chip.n_devices; i++)
        if (chip.devices[i].info->kind != DEV_RCC
            && chip.devices[i].due < next)
            next = chip.devices[i].due;
    return next;
}

static void
periph_map(uc_engine *uc)
{
    if (uc_mmio_map(uc, PERIPH_BASE, PERIPH_SIZE, bus_read, NULL, bus_write,
                    NULL))
        chip_fault("no peripherals");
    rom_map(uc);
}

static void
reset_device(struct device *d)
{
    d->due = NEVER;
    switch ((enum device_kind)d->info->kind) {
    case DEV_USART:
        d->regs[0] = SR_TXE | SR_TC;
        return;
    case DEV_RCC:
        chip.rcc = d;
        rcc_reset(d);
        return;
    case DEV_FLASH:
        chip.flash_ctrl = d;
        return;
    case DEV_PWR:
        chip.pwr = d;
        d->regs[0x20] = 1u << 8;    /* CR5 of a G4: no boost */
        return;
    case DEV_SYSCFG:
        chip.syscfg = d;
        return;
    case DEV_USBFS:
        usbfs_reset(d);
        return;
    case DEV_OTG:
        otg_reset(d);
        return;
    case DEV_CAN:
        bxcan_reset(d);
        return;
    case DEV_FDCAN:
        fdcan_reset(d);
        return;
    case DEV_SDIO:
        sdio_reset(d);
        return;
    case DEV_GPIO:
        if (!chip.model->gpio_v2)
            d->regs[0] = d->regs[1] = 0x44444444;
        return;
    default:
        return;
    }
}

struct device *
stm32_find(enum device_kind kind, uint8_t index)
{
    uint32_t i;

    for (i = 0; i < chip.n_devices; i++)
        if (chip.devices[i].info->kind == kind
            && chip.devices[i].info->index == index)
            return &chip.devices[i];
    return NULL;
}

void
stm32_check_pin(uint32_t pin, uint32_t function)
{
    const struct device *port = stm32_find(DEV_GPIO, (uint8_t)(pin / 16));
    uint32_t bit = pin % 16, is = 0;
    int8_t pull;

    if (chip.model->gpio_v2)
        is = port->regs[8 + bit / 8] >> (4 * (bit % 8)) & 15;
    if (gpio_mode_of(port, bit, &pull) != 2
        || (chip.model->gpio_v2 && is != function))
        chip_fault("pin P%c%u is not of function %u", 'A' + pin / 16, bit,
                   function);
}

void
stm32_check_usb_pins(const struct device *d)
{
    bool is_pb = d->info->base == 0x40040000
        && strcmp(chip.model->name, "stm32h723");

    stm32_check_pin(is_pb ? 30 : 11, is_pb ? 12 : 10);
    stm32_check_pin(is_pb ? 31 : 12, is_pb ? 12 : 10);
}

static void
periph_reset(void)
{
    const struct device_info *info = chip.model->devices;

    for (; info->base; info++) {
        struct device *d = &chip.devices[chip.n_devices++];

        if (info->kind == DEV_BACKUP && d->info)
            continue;           /* a reset does not reach it */
        memset(d, 0, sizeof(*d));
        d->info = info;
        reset_device(d);
    }
    canhost_reset();
    chip.core_hz = chip.bus_hz[0] = chip.bus_hz[1] = chip.bus_hz[2]
        = chip.model->hsi_hz;
}

static int32_t
periph_find_pin(const char *name)
{
    return chip_find_pin(name, 16);
}

const struct family stm32_family = {
    .flash_base = 0x08000000, .map = periph_map, .reset = periph_reset,
    .run_events = periph_run_events, .next_event = periph_next_event,
    .rx_free_at = periph_rx_free_at, .rx = periph_rx,
    .find_pin = periph_find_pin,
};
