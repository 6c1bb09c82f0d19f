/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where everything lies: program in flash behind a bootloader, the table of
 * interrupts first in RAM, the stack last. */
MEMORY
{
    rom (rx) : ORIGIN = CONFIG_FLASH_APPLICATION_ADDRESS,
        LENGTH = CONFIG_FLASH_BASE + CONFIG_FLASH_SIZE
            - CONFIG_FLASH_APPLICATION_ADDRESS
    ram (rwx) : ORIGIN = CONFIG_RAM_START, LENGTH = CONFIG_RAM_SIZE
}

ENTRY(armcm_reset)

SECTIONS
{
    .text : {
        KEEP(*(.vectors))
        *(.text .text.*)
        *(.rodata .rodata.*)
        . = ALIGN(4);
    } > rom
    .ARM.exidx : { *(.ARM.exidx*) } > rom

    .ramvectors (NOLOAD) : {
        KEEP(*(.ramvectors))
    } > ram
    .data : {
        . = ALIGN(4);
        link_data_start = .;
        *(.data .data.*)
        *(.ramfunc)
        . = ALIGN(4);
        link_data_end = .;
    } > ram AT > rom
    link_data_load = LOADADDR(.data);

    .bss (NOLOAD) : {
        . = ALIGN(4);
        link_bss_start = .;
        *(.bss .bss.* COMMON)
        . = ALIGN(8);
        link_bss_end = .;
    } > ram

    link_stack_top = ORIGIN(ram) + LENGTH(ram);
    link_stack_start = link_stack_top - CONFIG_STACK_SIZE;
    ASSERT(link_bss_end <= link_stack_start, "no RAM left for the stack")

#if CONFIG_WANT_MCAN
    ASSERT(link_bss_end - ORIGIN(ram) <= 0x10000,
           "CAN's memory is out of its reach")
#endif

    /DISCARD/ : { *(.init*) *(.fini*) *(.comment) *(.ARM.attributes) }
}
