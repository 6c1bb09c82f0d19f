/* SPDX-License-Identifier: GPL-3.0-or-later
 * What stays in flash: copies the program to RAM and starts it there. */
    .syntax unified
    .thumb

#if CONFIG_MACH_RP2350
/* RP2350 data sheet, 5.9.5: a block that says "program for a secure ARM", and
 * that there is no other block */
    .macro image_definition
    .word 0xffffded3, 0x10210142, 0x000001ff, 0x00000000, 0xab123579
    .endm
#endif

/* A fault before the program has a table of its own starts anew. */
    .section .loader, "ax"
    .global loader_vectors
loader_vectors:
    .word link_stack_top
    .rept 15
    .word loader
    .endr
#if CONFIG_MACH_RP2350
    image_definition
#endif

    .thumb_func
    .global loader
loader:
    cpsid i
    ldr r0, =link_image_load
    ldr r1, =link_image_start
    ldr r2, =link_image_end
1:  ldmia r0!, {r3}
    stmia r1!, {r3}
    cmp r1, r2
    blo 1b
    ldr r0, =armcm_reset
    bx r0
    .ltorg
