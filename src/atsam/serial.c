/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on a UART (11057, 34.5). */
#include "armcm/serial.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"

#if CONFIG_ATSAM_SERIAL_UART0 || (CONFIG_ATSAM_SERIAL && CONFIG_MACH_SAM4E)
#define CONSOLE_BASE UART0_BASE
#define CONSOLE_ID UART0_ID
#define SERIAL_RX GPIO('A', 9)
#define SERIAL_TX GPIO('A', 10)
#define SERIAL_PERIPHERAL 'A'
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PA9,PA10");
#elif CONFIG_ATSAM_SERIAL_UART1
#define CONSOLE_BASE UART1_BASE
#define CONSOLE_ID UART1_ID
#define SERIAL_RX GPIO('A', 5)
#define SERIAL_TX GPIO('A', 6)
#define SERIAL_PERIPHERAL 'C'
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PA5,PA6");
#elif CONFIG_MACH_SAM3X
#define CONSOLE_BASE UART_BASE
#define CONSOLE_ID UART_ID
#define SERIAL_RX GPIO('A', 8)
#define SERIAL_TX GPIO('A', 9)
#define SERIAL_PERIPHERAL 'A'
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PA8,PA9");
#elif CONFIG_MACH_SAM4S
#define CONSOLE_BASE UART1_BASE
#define CONSOLE_ID UART1_ID
#define SERIAL_RX GPIO('B', 2)
#define SERIAL_TX GPIO('B', 3)
#define SERIAL_PERIPHERAL 'A'
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PB2,PB3");
#elif CONFIG_MACH_SAME70
#define CONSOLE_BASE UART2_BASE
#define CONSOLE_ID UART2_ID
#define SERIAL_RX GPIO('D', 25)
#define SERIAL_TX GPIO('D', 26)
#define SERIAL_PERIPHERAL 'C'
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PD25,PD26");
#endif

#define REGS ((struct uart_regs *)CONSOLE_BASE)

#define BAUD_16 (16 * CONFIG_SERIAL_BAUD)
#define DIVIDER ((MCK_FREQ + BAUD_16 / 2) / BAUD_16)
_Static_assert(MCK_FREQ / DIVIDER < BAUD_16 / 50 * 51
               && MCK_FREQ / DIVIDER > BAUD_16 / 50 * 49,
               "the baud rate is off by more than 2 %");

void uart_irq(void)
{
    uint32_t status = REGS->SR;
    uint8_t data;

    if (status & UART_SR_RXRDY)
        serial_note_byte((uint8_t)REGS->RHR);
    if (!(status & UART_SR_TXRDY) || !(REGS->IMR & UART_SR_TXRDY))
        return;
    if (serial_next_byte(&data))
        REGS->THR = data;
    else
        REGS->IDR = UART_SR_TXRDY;
}

void serial_start_tx(void)
{
    REGS->IER = UART_SR_TXRDY;
}

void uart_init(void)
{
    chip_enable(CONSOLE_ID);
    gpio_alternate(SERIAL_RX, SERIAL_PERIPHERAL, 1);
    gpio_alternate(SERIAL_TX, SERIAL_PERIPHERAL, 0);
    REGS->CR = UART_CR_RESET;
    REGS->MR = UART_MR_NO_PARITY;
    REGS->BRGR = DIVIDER;
    armcm_connect(CONSOLE_ID, uart_irq);
    REGS->IER = UART_SR_RXRDY;
    REGS->CR = UART_CR_ENABLE;
}
DECL_INIT(uart_init);
