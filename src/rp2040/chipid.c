/* SPDX-License-Identifier: GPL-3.0-or-later
 * The unique number: that of the flash chip, 8 bytes after command 4Bh and four
 * more (data sheets of W25Q chips).
 *
 * While it is read, flash is no memory: the program runs from RAM anyway, and
 * a chip that came to us with another interface set up gets that back.
 */
#include "board/chipid.h"
#include "chip.h"
#include "core/sched.h"

#define SSI ((struct ssi_regs *)SSI_BASE)
#define SELECT (&((struct io_regs *)IO_QSPI_BASE)->GPIO[IO_QSPI_SELECT].CTRL)

enum { CHIPID_SIZE = 8 };
enum { READ_ID = 0x4b, N_DUMMY = 4, N_ALL = 1 + N_DUMMY + CHIPID_SIZE };
/* 125 MHz / 16: any chip can do that */
#define DIVIDER 16

static uint8_t id[CHIPID_SIZE];

/* Sixteen bytes fit into its queues: send all, then fetch all. */
static void exchange(void)
{
    uint32_t i;

    for (i = 0; i < N_ALL; i++)
        SSI->DR0 = i ? 0 : READ_ID;
    for (i = 0; i < N_ALL; i++) {
        while (!(SSI->SR & SSI_SR_RFNE))
            ;
        /* the last ones are the number; earlier ones are overwritten */
        id[i % CHIPID_SIZE] = (uint8_t)SSI->DR0;
    }
}

static void use_settings(uint32_t frame, uint32_t divider)
{
    SSI->SSIENR = 0;
    SSI->CTRLR0 = frame;
    SSI->BAUDR = divider;
    SSI->SER = 1;
    SSI->SSIENR = 1;
}

void chipid_init(void)
{
    uint32_t frame = SSI->CTRLR0, divider = SSI->BAUDR, i;
    uint8_t moved[CHIPID_SIZE];

    use_settings(SSI_CTRLR0_FRAME(8), DIVIDER);
    *SELECT = (*SELECT & ~IO_CTRL_OUTOVER) | IO_CTRL_OUTOVER_LOW;
    exchange();
    *SELECT &= ~IO_CTRL_OUTOVER;
    use_settings(frame, divider);
    for (i = 0; i < CHIPID_SIZE; i++)
        moved[i] = id[(i + 1 + N_DUMMY) % CHIPID_SIZE];
    for (i = 0; i < CHIPID_SIZE; i++)
        id[i] = moved[i];
}
DECL_INIT(chipid_init);

const uint8_t *chipid_get(uint8_t *len)
{
    *len = CHIPID_SIZE;
    return id;
}
