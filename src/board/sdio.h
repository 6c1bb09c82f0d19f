/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: an SD card in its own mode, of blocks.
 *
 * The port declares its buses: DECL_ENUMERATION("sdio_bus", "<name>", n) and
 * DECL_CONSTANT_STR("BUS_PINS_<name>", "clk,cmd,dat0,dat1,dat2,dat3").
 */
#ifndef BOARD_SDIO_H
#define BOARD_SDIO_H

#include <stdint.h>

/* How a command or its data ended. */
enum sdio_error { SDIO_OK = 0, SDIO_NO_ANSWER = 1, SDIO_BAD_CRC = 2,
                  SDIO_DATA_TIMEOUT = 3, SDIO_DATA_CRC = 4, SDIO_TOO_SLOW = 5 };

/* What a command waits for. */
enum sdio_answer { SDIO_NONE = 0, SDIO_SHORT = 1, SDIO_LONG = 3 };
enum { SDIO_ANSWER_MAX = 16 };

/* --- The port provides; all are called by tasks --- */

/* Pins and clock, at a rate at which every card can be asked what it is.
 * shutdown("Invalid sdio bus") if there is no such bus. */
void sdio_setup(uint32_t bus);

/* From now on at most `rate` Hz. */
void sdio_set_rate(uint32_t rate);

/* A command and its answer: 0, 1 or 4 words of 32 bits in the order in which
 * they come, each with its last byte first.  Waits for 64 clocks of the card at
 * most. */
enum sdio_error sdio_command(uint8_t command, uint32_t argument,
                             enum sdio_answer answer, uint8_t *data);

/* A command with a short answer and a block of data, of 2^log2_size bytes;
 * *done tells how many went.  Waits for the card, a tenth of a second at
 * most. */
enum sdio_error sdio_read(uint8_t command, uint32_t argument, uint8_t *data,
                          uint8_t log2_size, uint32_t *done);
enum sdio_error sdio_write(uint8_t command, uint32_t argument,
                           const uint8_t *data, uint8_t log2_size,
                           uint32_t *done);

#endif
