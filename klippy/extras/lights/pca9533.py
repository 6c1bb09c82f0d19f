# SPDX-License-Identifier: GPL-3.0-or-later
"""[pca9533 name]: four lights behind a PCA9533 (NXP data sheet, section 6).

Outputs 0 to 3 are red, green, blue and white.  The chip has two dimmers: if a color
has more than two levels between off and full, the nearest one is used.
"""
from klippy.extras import i2c_light

# The printer goes on without it
MAY_LACK_FIRMWARE = True

PWM = (2, 4)
PRESCALER = (1, 3)
SELECT = 5
OFF, ON, DIMMED = 0, 1, (2, 3)


class PrinterPCA9533(i2c_light.I2CLight):
    """The chip of a section."""

    def list_setup(self):
        # the fastest cycle: 152 Hz
        return [(register, 0) for register in PRESCALER]

    def list_registers(self, color):
        levels = [int(value * 256.0 + 0.5) for value in color]
        dimmed = choose_levels([level for level in levels if 0 < level < 256])
        registers = [(PWM[i], level) for i, level in enumerate(dimmed)]
        select = 0
        for output, level in enumerate(levels):
            select |= self._choose(level, dimmed) << (2 * output)
        return [*registers, (SELECT, select)]

    @staticmethod
    def _choose(level, dimmed):
        if level <= 0:
            return OFF
        if level >= 256:
            return ON
        nearest = min(dimmed, key=lambda other: abs(other - level))
        return DIMMED[dimmed.index(nearest)]


def choose_levels(levels):
    """At most two levels that stand for all."""
    found = sorted(set(levels))
    return [found[0], found[-1]] if len(found) > 2 else found


def load_config_prefix(config):
    return PrinterPCA9533(config)
