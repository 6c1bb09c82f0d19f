/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where a core begins.  remoteproc has filled in data and zeros. */
    .section .start, "ax"
    .global start
start:
    ldi r2, stack_top
    jmp %label(main)
