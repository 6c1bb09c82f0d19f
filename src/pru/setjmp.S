/* SPDX-License-Identifier: GPL-3.0-or-later
 * Leaving a function for an outer one: stack, return address and the registers
 * that functions keep, r2 to r13. */
    .section .text.setjmp, "ax"
    .global setjmp
setjmp:
    sbbo &r2, r14, 0, 48
    ldi r14, 0
    ret

    .section .text.longjmp, "ax"
    .global longjmp
longjmp:
    lbbo &r2, r14, 0, 48
    mov r14, r15
    ret
