/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI: one bus.  ATmega640/1280/2560 data sheet, "SPI"; the registers are those
 * of all ATmega.
 */
#include "board/gpio.h"
#include "board/spi.h"
#include "core/sched.h"

DECL_ENUMERATION("spi_bus", "spi", 0);
#if CONFIG_AVR_MEGA || CONFIG_AVR_HAS_USB
DECL_CONSTANT_STR("BUS_PINS_spi", "PB3,PB2,PB1");
enum { PIN_MISO = 8 + 3, PIN_MOSI = 8 + 2, PIN_SCK = 8 + 1, PIN_SS = 8 + 0 };
#elif CONFIG_AVR_X8
DECL_CONSTANT_STR("BUS_PINS_spi", "PB4,PB3,PB5");
enum { PIN_MISO = 8 + 4, PIN_MOSI = 8 + 3, PIN_SCK = 8 + 5, PIN_SS = 8 + 2 };
#else
DECL_CONSTANT_STR("BUS_PINS_spi", "PB6,PB5,PB7");
enum { PIN_MISO = 8 + 6, PIN_MOSI = 8 + 5, PIN_SCK = 8 + 7, PIN_SS = 8 + 4 };
#endif

enum { DIVISOR_LOG2_MAX = 7 };

/* With SS as an input that goes low the chip would become a slave. */
static void take_pins(void)
{
    if (!(DDRB & (1 << (PIN_SS % 8))))
        gpio_setup_output(PIN_SS, 1);
    gpio_setup_output(PIN_SCK, 0);
    gpio_setup_output(PIN_MOSI, 0);
    gpio_setup_input(PIN_MISO, 1);
}

/* The clock is divided by 2, 4 .. 128: SPI2X halves what SPR1 and SPR0 say. */
static struct spi_config make_config(uint8_t mode, uint8_t divisor_log2)
{
    uint8_t spr = (uint8_t)((divisor_log2 - 1) / 2);
    uint8_t is_double = divisor_log2 & 1;

    if (divisor_log2 == DIVISOR_LOG2_MAX) {
        spr = 3;
        is_double = 0;
    }
    return (struct spi_config){
        .spcr = (uint8_t)(1 << SPE | 1 << MSTR | mode << CPHA | spr << SPR0),
        .spsr = (uint8_t)(is_double << SPI2X),
    };
}

struct spi_config spi_setup(uint32_t bus, uint8_t mode, uint32_t rate)
{
    uint8_t divisor_log2 = 1;

    if (bus || mode > 3)
        shutdown("Invalid spi bus");
    while (divisor_log2 < DIVISOR_LOG2_MAX
           && (uint32_t)CONFIG_CLOCK_FREQ >> divisor_log2 > rate)
        divisor_log2++;
    take_pins();
    return make_config(mode, divisor_log2);
}

/* The clock takes its idle level now, before the chip select. */
void spi_prepare(struct spi_config config)
{
    SPCR = config.spcr;
    SPSR = config.spsr;
}

void spi_transfer(struct spi_config config, uint8_t receive_data, uint8_t len,
                  uint8_t *data)
{
    (void)config;
    for (; len; len--, data++) {
        uint8_t in;
        SPDR = *data;
        while (!(SPSR & (1 << SPIF)))
            ;
        in = SPDR;
        if (receive_data)
            *data = in;
    }
}
