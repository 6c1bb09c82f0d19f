/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on a usart (RM0008, 27.3; RM0410, 34.5). */
#include "armcm/serial.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"
#include "serial_pins.h"

DECL_CONSTANT_STR("RESERVE_PINS_serial", SERIAL_PINS);

#define OF_USART(NAME) STM32_JOIN(USART, CONFIG_STM32_USART, NAME)

#if CONFIG_STM32_USART_V2
#define REGS ((struct usart_v2_regs *)OF_USART(_BASE))
#define STATUS ISR
#define RX_DATA RDR
#define TX_DATA TDR
#define CR1_ENABLE USART_V2_CR1_UE
#else
#define REGS ((struct usart_v1_regs *)OF_USART(_BASE))
#define STATUS SR
#define RX_DATA DR
#define TX_DATA DR
#define CR1_ENABLE USART_V1_CR1_UE
#endif

#define CR1_RUN (CR1_ENABLE | USART_CR1_RE | USART_CR1_TE | USART_CR1_RXNEIE)

void usart_irq(void)
{
    uint32_t status = REGS->STATUS;
    uint8_t data;

    if (status & (USART_RXNE | USART_ORE)) {
        data = (uint8_t)REGS->RX_DATA;
#if CONFIG_STM32_USART_V2
        REGS->ICR = USART_ORE;
#endif
        if (status & USART_RXNE)
            serial_note_byte(data);
    }
    if (!(status & USART_TXE) || !(REGS->CR1 & USART_CR1_TXEIE))
        return;
    if (serial_next_byte(&data))
        REGS->TX_DATA = data;
    else
        REGS->CR1 = CR1_RUN;
}

void serial_start_tx(void)
{
    REGS->CR1 = CR1_RUN | USART_CR1_TXEIE;
}

void usart_init(void)
{
    chip_enable(OF_USART(_GATE));
#if CONFIG_MACH_STM32F1
    if (SERIAL_REMAP)
        gpio_remap(SERIAL_REMAP, SERIAL_REMAP);
#endif
    gpio_alternate(SERIAL_RX, SERIAL_FUNCTION, 1);
    gpio_alternate(SERIAL_TX, SERIAL_FUNCTION, 0);
    REGS->BRR = (SERIAL_HZ + CONFIG_SERIAL_BAUD / 2) / CONFIG_SERIAL_BAUD;
    armcm_connect(OF_USART(_IRQ), usart_irq);
    REGS->CR1 = CR1_RUN;
}
DECL_INIT(usart_init);
