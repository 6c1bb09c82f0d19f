/* SPDX-License-Identifier: GPL-3.0-or-later
 * CAN on Bosch's M_CAN (bosch/mcan.h).  The port's mcan_unit.h tells which one:
 *   MCAN_BASE, MCAN_IRQ     its registers and interrupt
 *   MCAN_HZ                 what it counts
 *   MCAN_MEMORY             its message memory, MCAN_WORDS words of it
 *   MCAN_START              where that begins as the registers count, in bytes,
 *                           if they say how it is divided
 *   mcan_connect()          gives it clock, pins and memory
 */
#include <string.h>

#include "board/can.h"
#include "board/irq.h"
#include "core/sched.h"
#include "generic/can_timing.h"
#include "bosch/mcan.h"
#include "mcan_unit.h"

#define CAN ((struct mcan_regs *)MCAN_BASE)
_Static_assert(CAN_QUANTA(MCAN_HZ) != 0, "no such frequency of the CAN bus");

/* Words of the message memory: filters, then frames.  Where it is divided by
 * itself, an element has room for 64 bytes. */
#if CONFIG_HAVE_MCAN_FIXED_MEMORY
enum { FILTER_WORD = 0, RX_WORD = 0xb0 / 4, TX_WORD = 0x278 / 4,
       TX_COUNT = 3, ELEMENT_WORDS = 18 };
#else
enum { FILTER_WORD = 0, RX_WORD = 4, RX_COUNT = 16, TX_WORD = 80,
       TX_COUNT = 8, ELEMENT_WORDS = 4 };
_Static_assert(TX_WORD + TX_COUNT * ELEMENT_WORDS <= MCAN_WORDS,
               "the message memory is too small");
#endif

#define INTERRUPTS (MCAN_INT_RX0 | MCAN_INT_SENT | MCAN_INT_OFF \
                    | MCAN_INT_PROTOCOL)

static uint32_t rx_errors, tx_errors;

static struct mcan_element *find_element(uint32_t first, uint32_t index)
{
    return (struct mcan_element *)&MCAN_MEMORY[first + ELEMENT_WORDS * index];
}

static void read_frame(struct can_frame *frame)
{
    uint32_t index = MCAN_GET_INDEX(CAN->RXF0S);
    const struct mcan_element *element = find_element(RX_WORD, index);
    uint32_t id = element->id, words[2];

    frame->id = id & MCAN_ELEMENT_EXTENDED
        ? (id & 0x1fffffff) | CAN_EXTENDED : (id >> 18) & 0x7ff;
    if (id & MCAN_ELEMENT_REMOTE)
        frame->id |= CAN_REMOTE;
    frame->len = MCAN_ELEMENT_LENGTH(element->control);
    if (frame->len > 8)
        frame->len = 8;
    words[0] = element->data[0];
    words[1] = element->data[1];
    memcpy(frame->data, words, sizeof(words));
    CAN->RXF0A = index;
}

/* Codes of the last error: stuff, form, no ack, bit 1, bit 0, crc.  Reading
 * forgets it. */
static uint32_t read_state(void)
{
    uint32_t state = CAN->PSR, last = MCAN_PSR_LAST(state);

    if (last >= 3 && last <= 5)
        tx_errors++;
    else if (last && last < 7)
        rx_errors++;
    return state;
}

void mcan_irq(void)
{
    uint32_t events = CAN->IR;
    struct can_frame frame;

    CAN->IR = events;
    while (MCAN_RX_LEVEL(CAN->RXF0S)) {
        read_frame(&frame);
        can_note_rx(&frame);
    }
    if (events & MCAN_INT_SENT)
        can_note_tx();
    if (events & MCAN_INT_PROTOCOL)
        read_state();
    /* bus off has stopped it; it comes back after 128 idle times */
    if (events & MCAN_INT_OFF && CAN->PSR & MCAN_PSR_OFF)
        CAN->CCCR &= ~MCAN_CCCR_INIT;
}

bool can_send(const struct can_frame *frame)
{
    uint32_t status = CAN->TXFQS, words[2], id = frame->id;
    struct mcan_element *element;

    if (status & MCAN_TXFQS_FULL)
        return false;
    element = find_element(TX_WORD, MCAN_PUT_INDEX(status));
    memcpy(words, frame->data, sizeof(words));
    element->id = (id & CAN_EXTENDED
                   ? (id & 0x1fffffff) | MCAN_ELEMENT_EXTENDED
                   : (id & 0x7ff) << 18)
        | (id & CAN_REMOTE ? MCAN_ELEMENT_REMOTE : 0);
    element->control = (uint32_t)frame->len << 16;
    element->data[0] = words[0];
    element->data[1] = words[1];
    CAN->TXBAR = 1u << MCAN_PUT_INDEX(status);
    return true;
}

void can_set_filter(uint16_t id)
{
    MCAN_MEMORY[FILTER_WORD] = MCAN_FILTER_IDS(CAN_ID_ADMIN, id);
}

void can_read_status(struct can_status *status)
{
    irq_flag_t flag = irq_save();
    uint32_t state = read_state();

    irq_restore(flag);
    status->rx_error = rx_errors;
    status->tx_error = status->tx_retries = tx_errors;
    status->state = state & MCAN_PSR_OFF ? CAN_STATE_OFF
        : state & MCAN_PSR_PASSIVE ? CAN_STATE_PASSIVE
        : state & MCAN_PSR_WARNING ? CAN_STATE_WARN : CAN_STATE_ACTIVE;
}

static void divide_memory(void)
{
    uint32_t rule = CONFIG_USBCANBUS ? MCAN_FILTER_ALL : MCAN_FILTER_STRICT;
    uint32_t i;

    for (i = 0; i < MCAN_WORDS; i++)
        MCAN_MEMORY[i] = 0;
#if CONFIG_HAVE_MCAN_FIXED_MEMORY
    CAN->RXGFC = rule | MCAN_RXGFC_STANDARD_FILTERS(1);
#else
    CAN->GFC = rule;
    CAN->SIDFC = MCAN_SIDFC(MCAN_START + 4 * FILTER_WORD, 1);
    CAN->RXF0C = MCAN_RXF0C(MCAN_START + 4 * RX_WORD, RX_COUNT);
    CAN->TXBC = MCAN_TXBC(MCAN_START + 4 * TX_WORD, TX_COUNT);
#endif
    can_set_filter(CAN_ID_ADMIN);
}

void mcan_init(void)
{
    mcan_connect();
    CAN->CCCR |= MCAN_CCCR_INIT;
    while (!(CAN->CCCR & MCAN_CCCR_INIT))
        ;
    CAN->CCCR |= MCAN_CCCR_CCE;
    CAN->NBTP = MCAN_NBTP(CAN_PRESCALER(MCAN_HZ), CAN_SEGMENT1(MCAN_HZ),
                           CAN_SEGMENT2(MCAN_HZ));
    divide_memory();
    CAN->IE = INTERRUPTS;
    CAN->ILE = MCAN_ILE_LINE0;
    CAN->TXBTIE = (1u << TX_COUNT) - 1; /* each buffer tells that it was sent */
    armcm_connect(MCAN_IRQ, mcan_irq);
    CAN->CCCR &= ~(MCAN_CCCR_INIT | MCAN_CCCR_CCE);
}
DECL_INIT(mcan_init);
