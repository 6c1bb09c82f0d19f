# SPDX-License-Identifier: GPL-3.0-or-later
"""[pca9632 name]: a strip behind a PCA9632 (NXP data sheet, section 7.3).

The outputs drive transistors (N type), as they do on boards for strips.
"""
from klippy.extras import i2c_light

# The printer goes on without it
MAY_LACK_FIRMWARE = True

MODE1, MODE2, PWM0, LEDOUT = 0, 1, 2, 8
AWAKE = 0
# inverted, driven both ways
FOR_TRANSISTORS = 0x14
# of an output in LEDOUT: off, or by its own dimmer
OFF, DIMMED = 0, 2
CHANNELS = {"R": 0, "G": 1, "B": 2, "W": 3}


class PrinterPCA9632(i2c_light.I2CLight):
    """The chip of a section."""

    def __init__(self, config):
        order = config.get("color_order", "RGBW").upper()
        if sorted(order) != sorted("RGBW"):
            raise config.error(
                "Option 'color_order' in section '%s': '%s' should hold R, G, B and W,"
                " each once" % (config.get_name(), order))
        # channel of each output
        self.channels = [CHANNELS[letter] for letter in order]
        super().__init__(config)

    def list_setup(self):
        return [(MODE1, AWAKE), (MODE2, FOR_TRANSISTORS)]

    def list_registers(self, color):
        levels = [int(color[channel] * 255.0 + 0.5) for channel in self.channels]
        registers = [(PWM0 + output, level) for output, level in enumerate(levels)]
        select = 0
        for output, level in enumerate(levels):
            select |= (DIMMED if level else OFF) << (2 * output)
        return [*registers, (LEDOUT, select)]


def load_config_prefix(config):
    return PrinterPCA9632(config)
