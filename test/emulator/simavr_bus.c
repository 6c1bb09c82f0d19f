/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * SPI of an emulated AVR chip, led into the virtual world as bus 0, a byte at a
 * time.  (I2C is not: libsimavr 1.6 answers addresses with the status codes of
 * data and lets TWINT stand while an action is under way.)
 */
#include <stdlib.h>

#include <simavr/sim_avr.h>
#include <simavr/avr_spi.h>

#include "vmcu_abi.h"

void simavr_bus_connect(avr_t *avr, const struct vmcu_host *host,
                        uint64_t (*clock)(void));

static struct bus {
    struct vmcu_host host;
    uint64_t (*clock)(void);
    avr_irq_t *spi_in;
} bus;

static void
on_spi_out(avr_irq_t *irq, uint32_t value, void *param)
{
    uint8_t byte = (uint8_t)value;

    (void)irq;
    (void)param;
    bus.host.spi(bus.host.ctx, bus.clock(), 0, &byte, 1);
    avr_raise_irq(bus.spi_in, byte);
}

void
simavr_bus_connect(avr_t *avr, const struct vmcu_host *host,
                   uint64_t (*clock)(void))
{
    bus.host = *host;
    bus.clock = clock;
    bus.spi_in = avr_io_getirq(avr, AVR_IOCTL_SPI_GETIRQ(0), SPI_IRQ_INPUT);
    avr_irq_register_notify(
        avr_io_getirq(avr, AVR_IOCTL_SPI_GETIRQ(0), SPI_IRQ_OUTPUT),
        on_spi_out, NULL);
}
