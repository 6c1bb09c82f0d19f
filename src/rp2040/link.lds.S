/* SPDX-License-Identifier: GPL-3.0-or-later
 * Flash holds the second stage of the boot, a loader, and the image of all that
 * runs and lies in RAM: table of interrupts, program, variables, stack. */
MEMORY
{
    boot (rx) : ORIGIN = CONFIG_FLASH_BASE, LENGTH = 256
    rom (rx) : ORIGIN = CONFIG_FLASH_APPLICATION_ADDRESS,
        LENGTH = CONFIG_FLASH_BASE + CONFIG_FLASH_SIZE
            - CONFIG_FLASH_APPLICATION_ADDRESS
    ram (rwx) : ORIGIN = CONFIG_RAM_START, LENGTH = CONFIG_RAM_SIZE
}

ENTRY(loader)

SECTIONS
{
#if CONFIG_RP2040_BOOT2
    .boot2 : { KEEP(*(.boot2)) } > boot
#endif
    .loader : { KEEP(*(.loader)) . = ALIGN(4); } > rom

    .ramvectors (NOLOAD) : {
        KEEP(*(.ramvectors))
        . = ALIGN(4);
    } > ram
    .text : {
        link_image_start = .;
        *(.text .text.*)
        *(.rodata .rodata.*)
        . = ALIGN(4);
        link_image_end = .;
    } > ram AT > rom
    link_image_load = LOADADDR(.text);

    .data : {
        link_data_start = .;
        *(.data .data.*)
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

    /DISCARD/ : {
        *(.vectors) *(.init*) *(.fini*) *(.comment) *(.ARM.attributes)
        *(.ARM.exidx*)
    }
}
