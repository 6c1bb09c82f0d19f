/* SPDX-License-Identifier: GPL-3.0-or-later
 * Second stage of the RP2040's boot: makes the flash chip readable as memory.
 *
 * The boot ROM copies the first 256 bytes of flash to the end of RAM and runs
 * them if their checksum is right (data sheet, 2.8.1).  The chip is set to read
 * with a plain command each time, so it keeps no mode that a reset would have
 * to undo, and none of its own registers is written.  Speed does not matter:
 * the program is copied to RAM and runs there. */
    .syntax unified
    .cpu cortex-m0plus
    .thumb

/* SSI (data sheet, 4.10.13): offsets from its base */
#define SSI_BASE 0x18000000
#define CTRLR0 0x00
#define CTRLR1 0x04
#define SSIENR 0x08
#define SER 0x10
#define BAUDR 0x14
/* more than an immediate offset reaches */
#define RX_SAMPLE_DLY 0xf0
#define SPI_CTRLR0 0xf4

/* Frames of 32 bits, "EEPROM read": send command and address, then receive */
#if CONFIG_RP2040_FLASH_W25Q080
/* Data on two lines, 8 clocks after the address: command 3Bh */
#define FRAME (1 << 21 | 31 << 16 | 3 << 8)
#define COMMAND (0x3b << 24 | 8 << 11 | 2 << 8 | 6 << 2)
#define DIVIDER 2
#else
/* Data on one line at once: command 03h */
#define FRAME (31 << 16 | 3 << 8)
#define COMMAND (0x03 << 24 | 2 << 8 | 6 << 2)
#if CONFIG_RP2040_FLASH_GENERIC_03_CLKDIV8
#define DIVIDER 8
#else
#define DIVIDER 4
#endif
#endif

    .section .boot2, "ax"
    .global boot2
    .thumb_func
boot2:
    ldr r3, =SSI_BASE
    movs r0, #0
    str r0, [r3, #SSIENR]
    movs r0, #DIVIDER
    str r0, [r3, #BAUDR]
    movs r0, #1
    movs r1, #RX_SAMPLE_DLY
    str r0, [r3, r1]
    str r0, [r3, #SER]
    ldr r0, =FRAME
    str r0, [r3, #CTRLR0]
    movs r0, #0
    str r0, [r3, #CTRLR1]
    ldr r0, =COMMAND
    movs r1, #SPI_CTRLR0
    str r0, [r3, r1]
    movs r0, #1
    str r0, [r3, #SSIENR]
    /* the table behind us: where it is, the stack, the program */
    ldr r0, =CONFIG_FLASH_APPLICATION_ADDRESS
    ldr r1, =0xe000ed08         /* VTOR */
    str r0, [r1]
    ldr r1, [r0]
    mov sp, r1
    ldr r1, [r0, #4]
    bx r1
    .ltorg
