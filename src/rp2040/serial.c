/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on a UART with queues of 32 bytes (data sheet, 4.2). */
#include "armcm/serial.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"

#if CONFIG_RPXXXX_SERIAL_UART0_PINS_12_13
#define SERIAL_TX 12
DECL_CONSTANT_STR("RESERVE_PINS_serial", "gpio13,gpio12");
#elif CONFIG_RPXXXX_SERIAL_UART0_PINS_16_17
#define SERIAL_TX 16
DECL_CONSTANT_STR("RESERVE_PINS_serial", "gpio17,gpio16");
#elif CONFIG_RPXXXX_SERIAL_UART0_PINS_28_29
#define SERIAL_TX 28
DECL_CONSTANT_STR("RESERVE_PINS_serial", "gpio29,gpio28");
#elif CONFIG_RPXXXX_SERIAL_UART1_PINS_4_5
#define SERIAL_TX 4
DECL_CONSTANT_STR("RESERVE_PINS_serial", "gpio5,gpio4");
#elif CONFIG_RPXXXX_SERIAL_UART1_PINS_8_9
#define SERIAL_TX 8
DECL_CONSTANT_STR("RESERVE_PINS_serial", "gpio9,gpio8");
#elif CONFIG_RPXXXX_SERIAL_UART1_PINS_20_21
#define SERIAL_TX 20
DECL_CONSTANT_STR("RESERVE_PINS_serial", "gpio21,gpio20");
#elif CONFIG_RPXXXX_SERIAL_UART1_PINS_24_25
#define SERIAL_TX 24
DECL_CONSTANT_STR("RESERVE_PINS_serial", "gpio25,gpio24");
#else
#define SERIAL_TX 0
DECL_CONSTANT_STR("RESERVE_PINS_serial", "gpio1,gpio0");
#endif

/* Pins of the two take turns, by fours, after the first */
#define IS_UART1 (((SERIAL_TX + 4) / 8) % 2)
#define REGS ((struct uart_regs *)(IS_UART1 ? UART1_BASE : UART0_BASE))

/* The rate in 64ths of a 16th of the clock */
#define DIVISOR ((SYS_FREQ * 4 + CONFIG_SERIAL_BAUD / 2) / CONFIG_SERIAL_BAUD)

#define RX_INTERRUPTS (UART_INT_RX | UART_INT_RT)

/* From the buffer to the queue: true if some are left for later. */
static bool fill_queue(void)
{
    uint8_t data;

    while (!(REGS->FR & UART_FR_TXFF)) {
        if (!serial_next_byte(&data))
            return false;
        REGS->DR = data;
    }
    return true;
}

void uart_irq(void)
{
    while (!(REGS->FR & UART_FR_RXFE))
        serial_note_byte((uint8_t)REGS->DR);
    if (REGS->IMSC & UART_INT_TX && !fill_queue())
        REGS->IMSC = RX_INTERRUPTS;
}

/* The interrupt comes when the queue has become short, not while it is. */
void serial_start_tx(void)
{
    if (fill_queue())
        REGS->IMSC = RX_INTERRUPTS | UART_INT_TX;
}

void uart_init(void)
{
    chip_enable(IS_UART1 ? RESET_UART1 : RESET_UART0);
    REGS->IBRD = DIVISOR / 64;
    REGS->FBRD = DIVISOR % 64;
    REGS->LCR_H = UART_LCR_8_BITS | UART_LCR_FIFO;
    REGS->IFLS = 0; /* an eighth: 4 bytes */
    REGS->CR = UART_CR_UARTEN | UART_CR_TXE | UART_CR_RXE;
    REGS->IMSC = RX_INTERRUPTS;
    gpio_function(SERIAL_TX, IO_UART, 0);
    gpio_function(SERIAL_TX + 1, IO_UART, 1);
    armcm_connect(IS_UART1 ? UART1_IRQ : UART0_IRQ, uart_irq);
}
DECL_INIT(uart_init);
