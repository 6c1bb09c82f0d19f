/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on a UART (UM10360, chapters 14 and 15). */
#include "armcm/serial.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"

/* Receive and transmit pin, and their function */
#if CONFIG_LPC_SERIAL_UART0_P03_P02
#define SERIAL_RX GPIO(0, 3)
#define SERIAL_TX GPIO(0, 2)
#define SERIAL_FUNCTION 1
DECL_CONSTANT_STR("RESERVE_PINS_serial", "P0.3,P0.2");
#elif CONFIG_LPC_SERIAL_UART1_P016_P015
#define SERIAL_RX GPIO(0, 16)
#define SERIAL_TX GPIO(0, 15)
#define SERIAL_FUNCTION 1
DECL_CONSTANT_STR("RESERVE_PINS_serial", "P0.16,P0.15");
#elif CONFIG_LPC_SERIAL_UART2_P011_P010
#define SERIAL_RX GPIO(0, 11)
#define SERIAL_TX GPIO(0, 10)
#define SERIAL_FUNCTION 1
DECL_CONSTANT_STR("RESERVE_PINS_serial", "P0.11,P0.10");
#elif CONFIG_LPC_SERIAL_UART3_P429_P428
#define SERIAL_RX GPIO(4, 29)
#define SERIAL_TX GPIO(4, 28)
#define SERIAL_FUNCTION 3
DECL_CONSTANT_STR("RESERVE_PINS_serial", "P4.29,P4.28");
#endif

#define OF_UART(NAME) LPC_JOIN(UART, CONFIG_LPC_UART, NAME)
#define REGS ((struct uart_regs *)OF_UART(_BASE))

#define BAUD_16 (16 * CONFIG_SERIAL_BAUD)
#define DIVIDER ((CONFIG_CLOCK_FREQ + BAUD_16 / 2) / BAUD_16)
_Static_assert(CONFIG_CLOCK_FREQ / DIVIDER < BAUD_16 / 50 * 51
               && CONFIG_CLOCK_FREQ / DIVIDER > BAUD_16 / 50 * 49,
               "the baud rate is off by more than 2 %");

/* Irqs off: fill the fifo when it is empty.  Its interrupt comes when it is so
 * again, and not before something was in it. */
static void fill_fifo(void)
{
    uint32_t room = UART_FIFO_SIZE;
    uint8_t data;

    if (!(REGS->LSR & UART_LSR_THRE))
        return;
    while (room-- && serial_next_byte(&data))
        REGS->THR = data;
}

void uart_irq(void)
{
    (void)REGS->IIR; /* of an empty fifo: no longer pending */
    while (REGS->LSR & UART_LSR_RDR)
        serial_note_byte((uint8_t)REGS->RBR);
    fill_fifo();
}

void serial_start_tx(void)
{
    fill_fifo();
}

void uart_init(void)
{
    chip_enable(OF_UART(_POWER));
    gpio_alternate(SERIAL_RX, SERIAL_FUNCTION, 1);
    gpio_alternate(SERIAL_TX, SERIAL_FUNCTION, 0);
    REGS->LCR = UART_LCR_8_BITS | UART_LCR_DLAB;
    REGS->DLL = DIVIDER & 0xff;
    REGS->DLM = DIVIDER >> 8;
    REGS->LCR = UART_LCR_8_BITS;
    REGS->FCR = UART_FCR_ENABLE | UART_FCR_RESET;
    armcm_connect(OF_UART(_IRQ), uart_irq);
    REGS->IER = UART_IER_RBR | UART_IER_THRE;
}
DECL_INIT(uart_init);
