/* SPDX-License-Identifier: GPL-3.0-or-later
 * CAN in software: a state machine of PIO 0 has the bits (can.pio), the second
 * core the protocol (generic/can_bits.c); this one gets whole frames.
 */
#include "board/can.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"
#include "core1.h"
#include "generic/can_bits.h"
#include "can_program.h"

#define CAN_RX CONFIG_RPXXXX_CANBUS_GPIO_RX
#define CAN_TX CONFIG_RPXXXX_CANBUS_GPIO_TX
#define TEXT_(X) #X
#define TEXT(X) TEXT_(X)
DECL_CONSTANT_STR("RESERVE_PINS_CAN",
                  "gpio" TEXT(CONFIG_RPXXXX_CANBUS_GPIO_RX)
                  ",gpio" TEXT(CONFIG_RPXXXX_CANBUS_GPIO_TX));
_Static_assert(CAN_RX != CAN_TX, "CAN needs two pins");

#define PIO ((struct pio_regs *)PIO0_BASE)
#define SM (&PIO->SM[0])
#define CYCLES_OF_BIT 50u
/* 16 bits, and 8 of a fraction */
#define DIVIDER ((SYS_FREQ / CYCLES_OF_BIT * 256u + CONFIG_CANBUS_FREQUENCY / 2) \
                 / CONFIG_CANBUS_FREQUENCY)
#define MIN_DIVIDER (5 * 256 / 2)
_Static_assert(DIVIDER >= MIN_DIVIDER && DIVIDER < 1u << 24,
               "no such frequency of the CAN bus");

static uint32_t core1_stack[128] __attribute__((aligned(8)));

/*
 * The second core
 */

static void begin_bits(void)
{
    SM->INSTR = PIO_JMP(CAN_BLIND);
    PIO->TXF[0] = CAN_WORD_REST;
    PIO->CTRL = PIO_CTRL_ENABLE(0);
}

static inline bool has_no_sample(void)
{
    return PIO->FSTAT & PIO_FSTAT_RXEMPTY(0);
}

static bool is_dominant(void)
{
    return !(SIO->IN & 1u << CAN_RX);
}

/* The state machine waits for an edge: its next word is replaced, and it sends
 * one; if one has come meanwhile, that begins our frame too.  A change of this
 * bit empties both queues (3.7, FJOIN_RX). */
static void start_frame(uint32_t word)
{
    RP_XOR(SM->SHIFTCTRL) = PIO_SHIFT_JOIN_RX;
    RP_XOR(SM->SHIFTCTRL) = PIO_SHIFT_JOIN_RX;
    PIO->TXF[0] = word;
    if (!is_dominant())
        SM->INSTR = PIO_JMP(CAN_START);
}

/* Between frames: sleep until a sample comes, or a frame to send. */
static void rest(void)
{
    uint32_t word;

    NVIC->ICPR[0] = 1u << PIO0_IRQ | 1u << SIO_FIFO_IRQ_CORE1;
    core1_answer();
    if (!has_no_sample())
        return;
    if (is_dominant() || !can_bits_start(&word))
        __asm__ volatile("wfi");
    else
        start_frame(word);
}

/* A word that comes after its bit has begun keeps the bus' next bit waiting: by
 * some cycles until the next edge; by more, and that is an error on the bus. */
static void run_core1(void)
{
    bool is_idle = false;

    __asm__ volatile("cpsid i");
    NVIC->ISER[0] = 1u << PIO0_IRQ | 1u << SIO_FIFO_IRQ_CORE1;
    begin_bits();
    for (;;) {
        while (has_no_sample())
            if (is_idle)
                rest();
        PIO->TXF[0] = can_bits_take(PIO->RXF[0]);
        is_idle = can_bits_settle();
    }
}

/*
 * The first
 */

void can_bits_tell(void)
{
    core1_ring();
}

void can_irq(void)
{
    struct can_frame frame;

    core1_answer();
    while (can_bits_receive(&frame))
        can_note_rx(&frame);
    can_note_tx();
}

bool can_send(const struct can_frame *frame)
{
    if (!can_bits_send(frame))
        return false;
    core1_ring();
    return true;
}

void can_set_filter(uint16_t id)
{
    can_bits_set_filter(id);
}

void can_read_status(struct can_status *status)
{
    can_bits_read_status(status);
}

static void load_program(void)
{
    uint32_t i;

    for (i = 0; i < sizeof(can_program) / sizeof(can_program[0]); i++)
        PIO->INSTR_MEM[i] = can_program[i];
    SM->CLKDIV = DIVIDER << 8;
    SM->EXECCTRL = PIO_EXEC_WRAP(CAN_WRAP_TARGET, CAN_WRAP)
        | PIO_EXEC_JMP_PIN(CAN_RX);
    SM->SHIFTCTRL = PIO_SHIFT_OUT_RIGHT;
    SM->PINCTRL = PIO_PIN_OUT(CAN_TX, 1) | PIO_PIN_SET(CAN_TX, 1)
        | PIO_PIN_IN(CAN_RX);
    PIO->IRQ0_INTE = PIO_INT_RX(0);
}

void can_init(void)
{
    chip_enable(RESET_PIO0);
    load_program();
    SM->INSTR = PIO_SET_PINS(1);
    SM->INSTR = PIO_SET_DIRECTIONS(1);
    gpio_function(CAN_TX, IO_PIO0, 0);
    gpio_function(CAN_RX, IO_PIO0, 1);
    core1_start(run_core1, &core1_stack[sizeof(core1_stack)
                                        / sizeof(core1_stack[0])]);
    core1_answer();
    armcm_connect(SIO_FIFO_IRQ, can_irq);
}
DECL_INIT(can_init);
