# SPDX-License-Identifier: GPL-3.0-or-later
"""[dotstar name]: a chain of APA102 or SK9822, sent over two pins.

Data sheet: 32 zero bits, then for each led 111, five bits of brightness, blue,
green, red; then at least half a bit more a led, to push the last ones through.
"""
from klippy.extras import bus
from klippy.mcu import absence

# The printer goes on without it
MAY_LACK_FIRMWARE = True

SPEED = 500000              # Hz
MODE = 0
FULL_BRIGHTNESS = 0xff
CHUNK = 48


class PrinterDotstar:
    """Status: color_data, as LEDHelper."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        ppins = printer.lookup_object("pins")
        data, clock = (ppins.lookup_pin(config.get(option))
                       for option in ("data_pin", "clock_pin"))
        mcu = data["chip"]
        if clock["chip"] is not mcu:
            raise config.error(
                "Section '%s': data_pin and clock_pin must be of one mcu, not of '%s'"
                " and '%s'" % (config.get_name(), data["chip_name"],
                               clock["chip_name"]))
        # nothing is read: the data pin stands in for the input, too
        self.spi = bus.MCU_SPI(mcu, None, None, MODE, SPEED,
                               (data["pin"], data["pin"], clock["pin"]))
        self.count = config.getint("chain_count", 1, minval=1)
        self.helper = printer.load_object(config, "led").setup_helper(
            config, self._update, self.count)
        self.get_status = self.helper.get_status
        printer.register_event_handler("klippy:connect", self._handle_connect)
        absence.watch(mcu, None, self._handle_connect)

    def _handle_connect(self):
        self.helper.transmit_again()

    def _pack(self, colors):
        data = bytearray(4)
        for red, green, blue, _ in colors:
            data += bytes([FULL_BRIGHTNESS, *(int(value * 255.0 + 0.5)
                                              for value in (blue, green, red))])
        return bytes(data) + bytes(4 + (self.count + 15) // 16)

    def _update(self, colors, print_time):
        clock = 0
        if print_time is not None:
            clock = self.spi.get_mcu().print_time_to_clock(print_time)
        data = self._pack(colors)
        for pos in range(0, len(data), CHUNK):
            self.spi.spi_send(data[pos:pos + CHUNK], minclock=clock)


def load_config_prefix(config):
    return PrinterDotstar(config)
