/* SPDX-License-Identifier: GPL-3.0-or-later
 * CAN on bxCAN, of F0, F1, F2, F4 and F7 (RM0008, 24; RM0090, 32). */
#include <string.h>

#include "board/can.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"
#include "can_pins.h"
#include "generic/can_timing.h"
#include "stm32/bxcan.h"

#if CONFIG_MACH_STM32F0
#define CAN1_BASE CAN_BASE
#define CAN1_GATE CAN_GATE
#endif
#define OF_CAN(NAME) STM32_JOIN(CAN, CAN_UNIT, NAME)
#define REGS ((struct bxcan_regs *)OF_CAN(_BASE))
/* The first of two controllers has the filters of both */
#define FILTERS ((struct bxcan_regs *)CAN1_BASE)
#define BANK (CAN_UNIT == 2 ? 14u : 0u)

/* What the controller counts: the clock of bus 1 */
#if CONFIG_MACH_STM32F0
#define CAN_HZ CONFIG_CLOCK_FREQ
#elif CONFIG_MACH_STM32F1
#define CAN_HZ (CONFIG_CLOCK_FREQ / 2)
#else
#define CAN_HZ (CONFIG_CLOCK_FREQ / 4)
#endif
_Static_assert(CAN_QUANTA(CAN_HZ) != 0, "no such frequency of the CAN bus");

static uint32_t rx_errors, tx_errors;

static void read_frame(struct can_frame *frame)
{
    const struct bxcan_mailbox *box = &REGS->RX[0];
    uint32_t ir = box->IR, words[2] = { box->DLR, box->DHR };

    frame->id = ir & BXCAN_IR_EXTENDED
        ? ir >> BXCAN_IR_EXTENDED_SHIFT | CAN_EXTENDED
        : ir >> BXCAN_IR_STANDARD_SHIFT;
    if (ir & BXCAN_IR_REMOTE)
        frame->id |= CAN_REMOTE;
    frame->len = box->DTR & 15;
    if (frame->len > 8)
        frame->len = 8;
    memcpy(frame->data, words, sizeof(words));
    REGS->RFR[0] = BXCAN_RFR_RELEASE;
}

/* Codes of the last error: stuff, form, no ack, bit 1, bit 0, crc. */
static void count_error(void)
{
    uint32_t last = BXCAN_ESR_LAST(REGS->ESR);

    if (last >= 3 && last <= 5)
        tx_errors++;
    else if (last && last < 7)
        rx_errors++;
    REGS->ESR = BXCAN_ESR_NO_ERROR;
    REGS->MSR = BXCAN_MSR_ERRI;
}

void bxcan_irq(void)
{
    struct can_frame frame;

    while (REGS->RFR[0] & BXCAN_RFR_COUNT) {
        read_frame(&frame);
        can_note_rx(&frame);
    }
    if (REGS->TSR & BXCAN_TSR_DONE) {
        REGS->TSR = BXCAN_TSR_DONE;
        can_note_tx();
    }
    if (REGS->MSR & BXCAN_MSR_ERRI)
        count_error();
}

static uint32_t encode_id(uint32_t id)
{
    uint32_t ir = id & CAN_REMOTE ? BXCAN_IR_REMOTE : 0;

    if (id & CAN_EXTENDED)
        return ir | BXCAN_IR_EXTENDED
            | (id & 0x1fffffff) << BXCAN_IR_EXTENDED_SHIFT;
    return ir | (id & 0x7ff) << BXCAN_IR_STANDARD_SHIFT;
}

bool can_send(const struct can_frame *frame)
{
    uint32_t tsr = REGS->TSR, words[2], i;

    for (i = 0; i < 3; i++)
        if (tsr & BXCAN_TSR_EMPTY(i))
            break;
    if (i == 3)
        return false;
    memcpy(words, frame->data, sizeof(words));
    REGS->TX[i].DTR = frame->len;
    REGS->TX[i].DLR = words[0];
    REGS->TX[i].DHR = words[1];
    REGS->TX[i].IR = encode_id(frame->id) | BXCAN_IR_SEND;
    return true;
}

/* Four ids in one bank, or a mask that all pass. */
void can_set_filter(uint16_t id)
{
    uint32_t bank = 1u << BANK, ids = (uint32_t)id << 21 | CAN_ID_ADMIN << 5;
    irq_flag_t flag = irq_save();

    FILTERS->FMR |= BXCAN_FMR_INIT;
    FILTERS->FA1R &= ~bank;
    if (CONFIG_USBCANBUS) {
        FILTERS->FM1R &= ~bank;
        FILTERS->FS1R |= bank;
        ids = 0;
    } else {
        FILTERS->FM1R |= bank;
        FILTERS->FS1R &= ~bank;
    }
    FILTERS->FFA1R &= ~bank;
    FILTERS->FR[BANK][0] = FILTERS->FR[BANK][1] = ids;
    FILTERS->FA1R |= bank;
    FILTERS->FMR &= ~BXCAN_FMR_INIT;
    irq_restore(flag);
}

void can_read_status(struct can_status *status)
{
    uint32_t esr = REGS->ESR;

    status->rx_error = rx_errors;
    status->tx_error = status->tx_retries = tx_errors;
    status->state = esr & BXCAN_ESR_OFF ? CAN_STATE_OFF
        : esr & BXCAN_ESR_PASSIVE ? CAN_STATE_PASSIVE
        : esr & BXCAN_ESR_WARNING ? CAN_STATE_WARN : CAN_STATE_ACTIVE;
}

static void connect_irqs(void)
{
#if CONFIG_MACH_STM32F0
    armcm_connect(CEC_CAN_IRQ, bxcan_irq);
#else
    armcm_connect(OF_CAN(_TX_IRQ), bxcan_irq);
    armcm_connect(OF_CAN(_RX0_IRQ), bxcan_irq);
    armcm_connect(OF_CAN(_SCE_IRQ), bxcan_irq);
#endif
}

void bxcan_init(void)
{
    chip_enable(CAN1_GATE);
    chip_enable(OF_CAN(_GATE));
#if CONFIG_MACH_STM32F1
    gpio_remap(AFIO_MAPR_CAN, CAN_REMAP);
#endif
    gpio_alternate(CAN_RX, CAN_FUNCTION(CAN_RX), 1);
    gpio_alternate(CAN_TX, CAN_FUNCTION(CAN_TX), 0);
    REGS->MCR = BXCAN_MCR_INRQ | BXCAN_MCR_TXFP | BXCAN_MCR_ABOM;
    while (!(REGS->MSR & BXCAN_MSR_INAK))
        ;
    REGS->BTR = BXCAN_BTR(CAN_PRESCALER(CAN_HZ), CAN_SEGMENT1(CAN_HZ),
                         CAN_SEGMENT2(CAN_HZ));
    can_set_filter(CAN_ID_ADMIN);
    REGS->ESR = BXCAN_ESR_NO_ERROR;
    REGS->IER = BXCAN_IER_TX | BXCAN_IER_RX0 | BXCAN_IER_LAST_ERROR
        | BXCAN_IER_ERROR;
    connect_irqs();
    /* it takes part once it has seen eleven idle bits */
    REGS->MCR = BXCAN_MCR_TXFP | BXCAN_MCR_ABOM;
}
DECL_INIT(bxcan_init);
