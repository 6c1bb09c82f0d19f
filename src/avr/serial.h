/* SPDX-License-Identifier: GPL-3.0-or-later
 * The usart of the console, and what long interrupts do for it. */
#ifndef AVR_SERIAL_H
#define AVR_SERIAL_H

#include <avr/io.h>

#define JOIN_(A, B, C) A##B##C
#define JOIN(A, B, C) JOIN_(A, B, C)
#define REG(A, B) JOIN(A, CONFIG_SERIAL_PORT, B)
#define SERIAL_STATUS REG(UCSR, A)

/* Irqs off: take the bytes that have come, at least each 100 us. */
#if CONFIG_SERIAL
void serial_poll(void);
#else
static inline void serial_poll(void)
{
}
#endif

#endif
