# SPDX-License-Identifier: GPL-3.0-or-later
"""What lights behind an I2C chip have in common."""
from klippy.extras import bus
from klippy.mcu import absence

DEFAULT_ADDRESS = 0x62


class I2CLight:
    """Sends registers of a chip; a subclass says which, for a color.

    Status: color_data, as LEDHelper.
    """

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.i2c = bus.MCU_I2C_from_config(config, default_addr=DEFAULT_ADDRESS)
        self.sent = {}
        self.helper = printer.load_object(config, "led").setup_helper(
            config, self._update)
        self.get_status = self.helper.get_status
        printer.register_event_handler("klippy:connect", self._handle_connect)
        absence.watch(self.i2c.get_mcu(), None, self._handle_connect)

    def list_setup(self):
        """[(register, value)] to send at the start."""
        return []

    def list_registers(self, color):
        """[(register, value)] that show an (r, g, b, w), in order."""
        raise NotImplementedError

    def _handle_connect(self):
        self.sent = {}
        self._write(self.list_setup(), 0)
        self.helper.transmit_again()

    def _update(self, colors, print_time):
        clock = 0
        if print_time is not None:
            clock = self.i2c.get_mcu().print_time_to_clock(print_time)
        self._write(self.list_registers(colors[0]), clock)

    def _write(self, registers, clock):
        for register, value in registers:
            if self.sent.get(register) != value:
                self.i2c.i2c_write_noack([register, value], minclock=clock)
                self.sent[register] = value
