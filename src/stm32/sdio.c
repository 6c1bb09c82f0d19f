/* SPDX-License-Identifier: GPL-3.0-or-later
 * SD cards of the STM32F4 (RM0090, 31), word by word from its fifo. */
#include <string.h>

#include "board/sdio.h"
#include "chip.h"
#include "core/sched.h"
#include "stm32/sdio.h"

DECL_ENUMERATION("sdio_bus", "sdio", 0);
DECL_CONSTANT_STR("BUS_PINS_sdio", "PC12,PD2,PC8,PC9,PC10,PC11");

#define REGS ((struct sdio_regs *)SDIO_BASE)
#define FUNCTION 12

/* What is divided; an F446 has 48 MHz while it uses USB. */
#define SDIO_HZ (CONFIG_MACH_STM32F446 ? 45000000u : 48000000u)
#define FIRST_HZ 400000u
/* Its fifo of 128 bytes lasts 20 us at four bits a clock: interrupts are
 * shorter. */
#define MAX_HZ 12000000u

/* Commands that need to be known here: the next is one of an application; the
 * width of its bus; what it is, which has no checksum */
enum { CMD_APPLICATION = 55, ACMD_WIDTH = 6, ACMD_CONDITIONS = 41,
       CMD_CONDITIONS = 1, WIDTH_4 = 2 };

#define COMMAND_ENDS (SDIO_STA_COMMAND_CRC | SDIO_STA_COMMAND_TIMEOUT \
                      | SDIO_STA_ANSWERED)
#define DATA_FAILS (SDIO_STA_DATA_CRC | SDIO_STA_DATA_TIMEOUT \
                    | SDIO_STA_UNDERRUN | SDIO_STA_OVERRUN \
                    | SDIO_STA_START_BIT)

static uint32_t rate, width;
static bool is_application;

static void set_clock(void)
{
    uint32_t divider = (SDIO_HZ + rate - 1) / rate;

    if (divider < 2)
        divider = 2;
    if (divider > SDIO_CLKCR_DIV_MAX)
        divider = SDIO_CLKCR_DIV_MAX;
    REGS->CLKCR = SDIO_CLKCR_DIV(divider) | SDIO_CLKCR_ENABLE | width;
    REGS->DTIMER = rate / 10;
}

void sdio_setup(uint32_t bus)
{
    uint32_t pin;

    if (bus != 0)
        shutdown("Invalid sdio bus");
    chip_enable(SDIO_GATE);
    for (pin = GPIO('C', 8); pin <= GPIO('C', 11); pin++)
        gpio_alternate(pin, FUNCTION, 1);
    gpio_alternate(GPIO('C', 12), FUNCTION, 0);
    gpio_alternate(GPIO('D', 2), FUNCTION, 1);
    width = 0;
    is_application = false;
    REGS->POWER = SDIO_POWER_ON;
    sdio_set_rate(FIRST_HZ);
}

void sdio_set_rate(uint32_t wanted)
{
    rate = wanted < 1 ? 1 : wanted > MAX_HZ ? MAX_HZ : wanted;
    set_clock();
}

/* The card's bus has the width that it was told. */
static void note_command(uint8_t command, uint32_t argument)
{
    if (is_application && command == ACMD_WIDTH) {
        width = argument == WIDTH_4 ? SDIO_CLKCR_4_BITS : 0;
        set_clock();
    }
    is_application = command == CMD_APPLICATION;
}

static enum sdio_error wait_for_answer(uint8_t command,
                                       enum sdio_answer answer)
{
    uint32_t ends = answer == SDIO_NONE ? SDIO_STA_SENT : COMMAND_ENDS, status;

    while (!((status = REGS->STA) & ends))
        ;
    if (status & SDIO_STA_COMMAND_TIMEOUT)
        return SDIO_NO_ANSWER;
    if (status & SDIO_STA_COMMAND_CRC && command != CMD_CONDITIONS
        && !(is_application && command == ACMD_CONDITIONS))
        return SDIO_BAD_CRC;
    return SDIO_OK;
}

enum sdio_error sdio_command(uint8_t command, uint32_t argument,
                             enum sdio_answer answer, uint8_t *data)
{
    enum sdio_error error;
    uint32_t words[4], i;

    REGS->ICR = SDIO_ICR_ALL;
    REGS->ARG = argument;
    REGS->CMD = (command & 63u) | SDIO_CMD_ANSWER(answer) | SDIO_CMD_START;
    error = wait_for_answer(command, answer);
    if (error) {
        is_application = false;
        return error;
    }
    for (i = 0; i < 4; i++)
        words[i] = REGS->RESP[i];
    if (data && answer != SDIO_NONE)
        memcpy(data, words, answer == SDIO_LONG ? 16 : 4);
    note_command(command, argument);
    return SDIO_OK;
}

static enum sdio_error find_failure(uint32_t status)
{
    if (status & SDIO_STA_DATA_TIMEOUT)
        return SDIO_DATA_TIMEOUT;
    if (status & (SDIO_STA_OVERRUN | SDIO_STA_UNDERRUN))
        return SDIO_TOO_SLOW;
    return status & DATA_FAILS ? SDIO_DATA_CRC : SDIO_OK;
}

static void start_data(uint8_t log2_size, uint32_t direction)
{
    REGS->DLEN = 1u << log2_size;
    REGS->DCTRL = SDIO_DCTRL_SIZE(log2_size) | direction | SDIO_DCTRL_START;
}

enum sdio_error sdio_read(uint8_t command, uint32_t argument, uint8_t *data,
                          uint8_t log2_size, uint32_t *done)
{
    uint32_t size = 1u << log2_size, status, word, n;
    enum sdio_error error;

    REGS->DCTRL = 0;
    start_data(log2_size, SDIO_DCTRL_FROM_CARD);
    error = sdio_command(command, argument, SDIO_SHORT, NULL);
    while (!error) {
        status = REGS->STA;
        if (status & SDIO_STA_RX_HAS_DATA && *done < size) {
            word = REGS->FIFO;
            n = size - *done < 4 ? size - *done : 4;
            memcpy(&data[*done], &word, n);
            *done += n;
        } else if (status & (SDIO_STA_BLOCK_END | DATA_FAILS)) {
            error = find_failure(status);
            break;
        }
    }
    REGS->DCTRL = 0;
    return error;
}

enum sdio_error sdio_write(uint8_t command, uint32_t argument,
                           const uint8_t *data, uint8_t log2_size,
                           uint32_t *done)
{
    enum sdio_error error = sdio_command(command, argument, SDIO_SHORT, NULL);
    uint32_t size = 1u << log2_size, status, word, n;

    if (error)
        return error;
    REGS->DCTRL = 0;
    start_data(log2_size, 0);
    for (;;) {
        status = REGS->STA;
        if (status & (SDIO_STA_BLOCK_END | DATA_FAILS))
            break;
        if (*done < size && !(status & SDIO_STA_TX_FULL)) {
            word = 0;
            n = size - *done < 4 ? size - *done : 4;
            memcpy(&word, &data[*done], n);
            REGS->FIFO = word;
            *done += n;
        }
    }
    REGS->DCTRL = 0;
    return find_failure(status);
}
