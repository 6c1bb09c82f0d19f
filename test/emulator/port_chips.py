# SPDX-License-Identifier: GPL-3.0-or-later
"""Emulated chips of LPC176x and SAM, and what their tests need of them."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Chip:
    """Pins for the purposes of a test, and buses: name and the world's number."""

    name: str
    crystal: int
    step: str
    dir: str
    switch: str
    out: str
    sensor: str
    pwm: str                    # "" without hardware pwm
    spi: tuple                  # ((name, number), ...)
    select: str
    i2c: tuple
    debug_ram: int              # an address in the unused part of the stack


def make_lpc(name):
    return Chip(name, 12000000, "P2.6", "P0.5", "P1.29", "P2.7", "P0.24", "P2.5",
                (("ssp0", 0), ("ssp1", 1)), "P0.6",
                (("i2c0", 0), ("i2c1", 1), ("i2c1a", 1), ("i2c2", 2)), 0x10007D10)


def make_sam(name, pwm, spi, i2c, stack, **pins):
    return Chip(name, 12000000, pins.get("step", "PA7"), pins.get("dir", "PA10"),
                pins.get("switch", "PA14"), pins.get("out", "PA15"),
                pins["sensor"], pwm, spi, pins.get("select", "PB14"), i2c, stack)


TWI = (("twi0", 0), ("twi1", 1))
SPI4 = (("spi", 0), ("usart0", 4), ("usart1", 5))
SPI3 = (("spi0", 0), ("usart0", 4), ("usart1", 5), ("usart2", 6))
SPI7 = (("spi0", 0), ("spi1", 1), *SPI3[1:])
TWIHS = tuple(("twihs%d" % (i,), i) for i in range(3))
CHIPS = {chip.name: chip for chip in (
    make_lpc("lpc1768"), make_lpc("lpc1769"),
    make_sam("sam3x8e", "PC23", SPI3, TWI, 0x20087D30, sensor="PA16"),
    make_sam("sam3x8c", "PB17", SPI3, TWI, 0x20087D30, sensor="PA16"),
    make_sam("sam4s8c", "PC22", SPI4, TWI, 0x2001FD30, sensor="PC13"),
    make_sam("sam4e8e", "PC20", SPI4, TWI, 0x2001FD30, sensor="PB3",
             dir="PA24"),
    make_sam("same70q20b", "PD0", SPI7, TWIHS, 0x2041FD30, sensor="PC31",
             select="PC5", dir="PA24"))}
NAMES = sorted(CHIPS)
