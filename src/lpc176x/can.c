/* SPDX-License-Identifier: GPL-3.0-or-later
 * CAN (UM10360, 16). */
#include <string.h>

#include "board/can.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"
#include "generic/can_timing.h"

/* Pins, their function, and the controller's number */
#if CONFIG_LPC_CAN_P0_21_P0_22
#define CAN_RX GPIO(0, 21)
#define CAN_TX GPIO(0, 22)
#define CAN_FUNCTION 3
#define CAN_UNIT 1
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "P0.21,P0.22");
#elif CONFIG_LPC_CAN_P0_4_P0_5
#define CAN_RX GPIO(0, 4)
#define CAN_TX GPIO(0, 5)
#define CAN_FUNCTION 2
#define CAN_UNIT 2
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "P0.4,P0.5");
#elif CONFIG_LPC_CAN_P2_7_P2_8
#define CAN_RX GPIO(2, 7)
#define CAN_TX GPIO(2, 8)
#define CAN_FUNCTION 1
#define CAN_UNIT 2
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "P2.7,P2.8");
#else
#define CAN_RX GPIO(0, 0)
#define CAN_TX GPIO(0, 1)
#define CAN_FUNCTION 1
#define CAN_UNIT 1
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "P0.0,P0.1");
#endif

#define OF_CAN(NAME) LPC_JOIN(CAN, CAN_UNIT, NAME)
#define REGS ((struct can_regs *)OF_CAN(_BASE))
#define CAN_HZ CONFIG_CLOCK_FREQ
_Static_assert(CAN_QUANTA(CAN_HZ) != 0, "no such frequency of the CAN bus");

/* Where the standard says "passive" */
#define PASSIVE_ERRORS 128

#define INTERRUPTS (CAN_INT_RX | CAN_INT_SENT | CAN_INT_WARNING \
                    | CAN_INT_ERROR)

static uint32_t rx_errors, tx_errors;
/* Of the frame that was asked for last: those that wait leave in this order */
static uint8_t last_prio;

static void read_frame(struct can_frame *frame)
{
    uint32_t info = REGS->RFS, words[2] = { REGS->RDA, REGS->RDB };

    frame->id = REGS->RID;
    if (info & CAN_INFO_EXTENDED)
        frame->id |= CAN_EXTENDED;
    if (info & CAN_INFO_REMOTE)
        frame->id |= CAN_REMOTE;
    frame->len = CAN_INFO_LENGTH(info);
    if (frame->len > 8)
        frame->len = 8;
    memcpy(frame->data, words, sizeof(words));
    REGS->CMR = CAN_CMR_RELEASE;
}

void can_irq(void)
{
    uint32_t events = REGS->ICR;
    struct can_frame frame;

    while (REGS->GSR & CAN_GSR_RX) {
        read_frame(&frame);
        can_note_rx(&frame);
    }
    if (events & CAN_INT_ERROR) {
        if (events & CAN_ICR_RECEIVING)
            rx_errors++;
        else
            tx_errors++;
    }
    /* bus off is a reset, which forgets what waited; it comes back after 128
     * idle times */
    if (REGS->MOD & CAN_MOD_RESET)
        REGS->MOD = CAN_MOD_PRIO;
    if (events & (CAN_INT_SENT | CAN_INT_WARNING))
        can_note_tx();
}

static void fill(struct can_buffer *buffer, const struct can_frame *frame)
{
    uint32_t words[2];

    memcpy(words, frame->data, sizeof(words));
    buffer->TFI = last_prio | (uint32_t)frame->len << 16
        | (frame->id & CAN_EXTENDED ? CAN_INFO_EXTENDED : 0)
        | (frame->id & CAN_REMOTE ? CAN_INFO_REMOTE : 0);
    buffer->TID = frame->id & (frame->id & CAN_EXTENDED ? 0x1fffffff : 0x7ff);
    buffer->TDA = words[0];
    buffer->TDB = words[1];
}

bool can_send(const struct can_frame *frame)
{
    uint32_t status = REGS->SR, i;

    if ((status & CAN_SR_ALL_FREE) == CAN_SR_ALL_FREE)
        last_prio = 0;
    else if (last_prio == 255)
        return false;
    for (i = 0; i < 3; i++)
        if (status & CAN_SR_FREE(i))
            break;
    if (i == 3)
        return false;
    last_prio++;
    fill(&REGS->TX[i], frame);
    REGS->CMR = CAN_CMR_SEND(i);
    return true;
}

/* Ids in a table must grow; those of nodes are less than that of the admin. */
void can_set_filter(uint16_t id)
{
    const uint32_t unit = CAN_UNIT - 1;

    CANAF->AFMR = CANAF_OFF;
    CANAF_TABLE[0] = id < CAN_ID_ADMIN ? CANAF_IDS(unit, id, CAN_ID_ADMIN)
        : CANAF_IDS(unit, CAN_ID_ADMIN, CANAF_NOBODY);
    CANAF->SFF_SA = 0;
    CANAF->SFF_GRP_SA = CANAF->EFF_SA = CANAF->EFF_GRP_SA = 4;
    CANAF->ENDOFTABLE = 4;
    CANAF->AFMR = CONFIG_USBCANBUS ? CANAF_ALL : 0;
}

void can_read_status(struct can_status *status)
{
    uint32_t gsr = REGS->GSR;

    status->rx_error = rx_errors;
    status->tx_error = status->tx_retries = tx_errors;
    status->state = gsr & CAN_GSR_OFF ? CAN_STATE_OFF
        : CAN_GSR_RX_ERRORS(gsr) >= PASSIVE_ERRORS
        || CAN_GSR_TX_ERRORS(gsr) >= PASSIVE_ERRORS ? CAN_STATE_PASSIVE
        : gsr & CAN_GSR_WARNING ? CAN_STATE_WARN : CAN_STATE_ACTIVE;
}

void can_init(void)
{
    chip_enable(OF_CAN(_POWER));
    gpio_alternate(CAN_RX, CAN_FUNCTION, 1);
    gpio_alternate(CAN_TX, CAN_FUNCTION, 0);
    REGS->MOD = CAN_MOD_RESET | CAN_MOD_PRIO;
    REGS->IER = 0;
    (void)REGS->ICR;
    REGS->GSR = 0;                  /* no errors yet */
    REGS->BTR = CAN_BTR(CAN_PRESCALER(CAN_HZ), CAN_SEGMENT1(CAN_HZ),
                        CAN_SEGMENT2(CAN_HZ));
    can_set_filter(CAN_ID_ADMIN);
    REGS->IER = INTERRUPTS;
    armcm_connect(CAN_IRQ, can_irq);
    REGS->MOD = CAN_MOD_PRIO;
}
DECL_INIT(can_init);
