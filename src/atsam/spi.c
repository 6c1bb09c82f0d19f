/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI masters, and USARTs as such (11057, 32.7 and 35.7.8). */
#include "board/spi.h"
#include "chip.h"
#include "core/sched.h"

struct spi_bus {
    uint32_t base;
    uint8_t id, miso, mosi, sclk;
    const char *peripherals;    /* of miso, mosi and sclk: 'A' to 'D' */
    bool is_usart;
};

#if CONFIG_MACH_SAM3X
DECL_ENUMERATION("spi_bus", "spi0", 0);
DECL_CONSTANT_STR("BUS_PINS_spi0", "PA25,PA26,PA27");
DECL_ENUMERATION("spi_bus", "usart0", 1);
DECL_CONSTANT_STR("BUS_PINS_usart0", "PA10,PA11,PA17");
DECL_ENUMERATION("spi_bus", "usart1", 2);
DECL_CONSTANT_STR("BUS_PINS_usart1", "PA12,PA13,PA16");
DECL_ENUMERATION("spi_bus", "usart2", 3);
DECL_CONSTANT_STR("BUS_PINS_usart2", "PB21,PB20,PB24");
static const struct spi_bus buses[] = {
    { SPI0_BASE, SPI0_ID, GPIO('A', 25), GPIO('A', 26), GPIO('A', 27),
      "AAA", false },
    { USART0_BASE, USART0_ID, GPIO('A', 10), GPIO('A', 11), GPIO('A', 17),
      "AAB", true },
    { USART1_BASE, USART1_ID, GPIO('A', 12), GPIO('A', 13), GPIO('A', 16),
      "AAA", true },
    { USART2_BASE, USART2_ID, GPIO('B', 21), GPIO('B', 20), GPIO('B', 24),
      "AAA", true },
};
#elif CONFIG_MACH_SAM4S || CONFIG_MACH_SAM4E
DECL_ENUMERATION("spi_bus", "spi", 0);
DECL_CONSTANT_STR("BUS_PINS_spi", "PA12,PA13,PA14");
DECL_ENUMERATION("spi_bus", "usart0", 1);
DECL_ENUMERATION("spi_bus", "usart1", 2);
DECL_CONSTANT_STR("BUS_PINS_usart1", "PA21,PA22,PA23");
#if CONFIG_MACH_SAM4S
DECL_CONSTANT_STR("BUS_PINS_usart0", "PA5,PA6,PA2");
#define USART0_PINS GPIO('A', 5), GPIO('A', 6), GPIO('A', 2), "AAB"
#else
DECL_CONSTANT_STR("BUS_PINS_usart0", "PB0,PB1,PB13");
#define USART0_PINS GPIO('B', 0), GPIO('B', 1), GPIO('B', 13), "CCC"
#endif
static const struct spi_bus buses[] = {
    { SPI_BASE, SPI_ID, GPIO('A', 12), GPIO('A', 13), GPIO('A', 14),
      "AAA", false },
    { USART0_BASE, USART0_ID, USART0_PINS, true },
    { USART1_BASE, USART1_ID, GPIO('A', 21), GPIO('A', 22), GPIO('A', 23),
      "AAA", true },
};
#elif CONFIG_MACH_SAME70
DECL_ENUMERATION("spi_bus", "spi0", 0);
DECL_CONSTANT_STR("BUS_PINS_spi0", "PD20,PD21,PD22");
DECL_ENUMERATION("spi_bus", "spi1", 1);
DECL_CONSTANT_STR("BUS_PINS_spi1", "PC26,PC27,PC24");
DECL_ENUMERATION("spi_bus", "usart0", 2);
DECL_CONSTANT_STR("BUS_PINS_usart0", "PB0,PB1,PB13");
DECL_ENUMERATION("spi_bus", "usart1", 3);
DECL_CONSTANT_STR("BUS_PINS_usart1", "PA21,PB4,PA23");
DECL_ENUMERATION("spi_bus", "usart2", 4);
DECL_CONSTANT_STR("BUS_PINS_usart2", "PD15,PD16,PD17");
static const struct spi_bus buses[] = {
    { SPI0_BASE, SPI0_ID, GPIO('D', 20), GPIO('D', 21), GPIO('D', 22),
      "BBB", false },
    { SPI1_BASE, SPI1_ID, GPIO('C', 26), GPIO('C', 27), GPIO('C', 24),
      "CCC", false },
    { USART0_BASE, USART0_ID, GPIO('B', 0), GPIO('B', 1), GPIO('B', 13),
      "CCC", true },
    { USART1_BASE, USART1_ID, GPIO('A', 21), GPIO('B', 4), GPIO('A', 23),
      "ADA", true },
    { USART2_BASE, USART2_ID, GPIO('D', 15), GPIO('D', 16), GPIO('D', 17),
      "BBB", true },
};
#endif
#define N_BUSES (sizeof(buses) / sizeof(buses[0]))

static void connect(const struct spi_bus *bus)
{
    gpio_alternate(bus->miso, bus->peripherals[0], 1);
    gpio_alternate(bus->mosi, bus->peripherals[1], 0);
    gpio_alternate(bus->sclk, bus->peripherals[2], 0);
}

/* Both kinds count the phase the other way round than modes do. */
struct spi_config spi_setup(uint32_t bus, uint8_t mode, uint32_t rate)
{
    const struct spi_bus *b = &buses[bus];
    uint32_t divider, settings;

    if (bus >= N_BUSES)
        shutdown("Invalid spi bus");
    if (!rate)
        rate = 1;
    divider = (MCK_FREQ + rate - 1) / rate;
    if (b->is_usart) {
        settings = USART_MR_SPI_MASTER | (mode & 2 ? USART_MR_CPOL : 0)
            | (mode & 1 ? 0 : USART_MR_NCPHA);
        divider = divider < 6 ? 6 : divider > 0xffff ? 0xffff : divider;
    } else {
        divider = divider > 255 ? 255 : divider;
        settings = SPI_CSR_SCBR(divider) | (mode & 2 ? SPI_CSR_CPOL : 0)
            | (mode & 1 ? 0 : SPI_CSR_NCPHA);
    }
    chip_enable(b->id);
    connect(b);
    return (struct spi_config) { (void *)b->base, settings, divider,
                                 b->is_usart };
}

static void prepare_usart(struct spi_config config)
{
    struct usart_regs *regs = config.regs;

    if (regs->MR == config.mode && regs->BRGR == config.divider)
        return;
    regs->CR = USART_CR_RESET;
    regs->MR = config.mode;
    regs->BRGR = config.divider;
    regs->CR = USART_CR_ENABLE;
}

void spi_prepare(struct spi_config config)
{
    struct spi_regs *regs = config.regs;

    if (config.is_usart) {
        prepare_usart(config);
        return;
    }
    if (regs->CSR[0] == config.mode)
        return;
    regs->CR = SPI_CR_SWRST;
    regs->MR = SPI_MR_MASTER;
    regs->CSR[0] = config.mode;
    regs->CR = SPI_CR_SPIEN;
}

/* Where bytes go to and come from, and the status of either kind */
struct wires {
    volatile uint32_t *out, *in, *status;
};

static struct wires find_wires(struct spi_config config)
{
    struct usart_regs *usart = config.regs;
    struct spi_regs *spi = config.regs;

    if (config.is_usart)
        return (struct wires) { &usart->THR, &usart->RHR, &usart->CSR };
    return (struct wires) { &spi->TDR, &spi->RDR, &spi->SR };
}

_Static_assert(SPI_SR_RDRF == USART_CSR_RXRDY
               && SPI_SR_TXEMPTY == USART_CSR_TXEMPTY, "same bits");

void spi_transfer(struct spi_config config, uint8_t receive_data,
                  uint8_t len, uint8_t *data)
{
    struct wires wires = find_wires(config);

    while (len--) {
        uint8_t byte;

        *wires.out = *data;
        while (!(*wires.status & SPI_SR_RDRF))
            ;
        byte = (uint8_t)*wires.in;
        if (receive_data)
            *data = byte;
        data++;
    }
    while (!(*wires.status & SPI_SR_TXEMPTY))
        ;
}
