/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on a SERCOM usart (data sheets, SERCOM USART). */
#include "armcm/serial.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"
#include "sercom.h"

/* A D51 can send by pad 0 only. */
#define UNIT 0
#if CONFIG_ATSAMD_SERIAL_PA5_PA4
#define RX_PIN GPIO('A', 5)
#define TX_PIN GPIO('A', 4)
#define PADS (SERCOM_CTRLA_RXPO(1) | SERCOM_CTRLA_TXPO(0))
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PA5,PA4");
#else
#define RX_PIN GPIO('A', 11)
#define TX_PIN GPIO('A', 10)
#define PADS (SERCOM_CTRLA_RXPO(3) | SERCOM_CTRLA_TXPO(1))
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PA11,PA10");
#endif

/* 65536 * (1 - 16 * rate / clock) */
#define BAUD (65536 - (uint32_t)((65536ull * 16 * CONFIG_SERIAL_BAUD \
                                  + PERIPHERAL_HZ / 2) / PERIPHERAL_HZ))

static struct sercom_regs *regs;

void usart_irq(void)
{
    uint8_t flags = regs->INTFLAG, data;

    if (flags & SERCOM_INT_RXC) {
        regs->STATUS = SERCOM_STATUS_BUFOVF;
        serial_note_byte((uint8_t)regs->DATA16);
    }
    if (!(flags & SERCOM_INT_DRE) || !(regs->INTENSET & SERCOM_INT_DRE))
        return;
    if (serial_next_byte(&data))
        regs->DATA16 = data;
    else
        regs->INTENCLR = SERCOM_INT_DRE;
}

void serial_start_tx(void)
{
    regs->INTENSET = SERCOM_INT_DRE;
}

void usart_init(void)
{
    uint32_t irq = sercom_irq(UNIT);

    regs = sercom_open(UNIT);
    regs->CTRLA = SERCOM_CTRLA_MODE(SERCOM_MODE_USART) | SERCOM_CTRLA_DORD
        | PADS;
    regs->BAUD16 = BAUD;
    regs->CTRLB = SERCOM_CTRLB_RXEN | SERCOM_CTRLB_TXEN;
    while (regs->SYNCBUSY)
        ;
    sercom_connect(UNIT, RX_PIN, 1);
    sercom_connect(UNIT, TX_PIN, 0);
    armcm_connect(irq, usart_irq);
    /* data register empty; then, the third of four, received */
    if (CONFIG_MACH_SAMX5)
        armcm_connect(irq + 2, usart_irq);
    regs->INTENSET = SERCOM_INT_RXC;
    regs->CTRLA |= SERCOM_CTRLA_ENABLE;
    while (regs->SYNCBUSY)
        ;
}
DECL_INIT(usart_init);
