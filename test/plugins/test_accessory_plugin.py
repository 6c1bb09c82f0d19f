# SPDX-License-Identifier: GPL-3.0-or-later
"""A plug-in with lights, chips and a filament sensor, by names third parties use."""

import machine_configs
import pytest
from printer_run import PrinterRun

from klippy import extras, plugins

PLUGIN = '''
import logging
from . import bus, led, filament_switch_sensor, output_pin


class Gadget:
    def __init__(self, config):
        self.printer = config.get_printer()
        self.spi = bus.MCU_SPI_from_config(config, 0, default_speed=500000)
        self.i2c = bus.MCU_I2C_from_config(config, default_addr=0x20)
        self.colors, self.seen = [], []
        pled = self.printer.load_object(config, "led")
        self.helper = pled.setup_helper(config, self.update_leds, 3)
        self.direct = led.LEDHelper(
            config.getsection("gadget_ring"), self.update_leds, 2)
        self.runout = filament_switch_sensor.RunoutHelper(config)
        self.real = self.runout.note_filament_present
        self.runout.note_filament_present = self.note
        self.queue = output_pin.GCodeRequestQueue(
            config, self.spi.get_mcu(), self.apply)
        self.applied = []

    def apply(self, print_time, value):
        self.applied.append(value)

    def note(self, eventtime, is_present):
        self.seen.append(is_present)
        self.real(is_present)

    def update_leds(self, led_state, print_time):
        self.colors.append((led_state, print_time))

    def get_status(self, eventtime):
        return self.helper.get_status(eventtime)


def load_config(config):
    return Gadget(config)
'''
SECTIONS = """
[gadget]
cs_pin: gpio90
initial_red: 1.0
runout_gcode: M400
[gadget_ring]
initial_blue: 0.5
"""


def test_a_plug_in_with_accessories(tmp_path, monkeypatch):
    folder = tmp_path / "plugins"
    folder.mkdir()
    (folder / "gadget.py").write_text(PLUGIN)
    (folder / "gadget_ring.py").write_text(
        "def load_config(config):\n    return object()\n")
    monkeypatch.setattr(extras, "__path__", list(extras.__path__))
    plugins.add_folder(extras, folder)
    config = machine_configs.make_axes(
        "cartesian", 0.04, machine_configs.BED
        + "\n[force_move]\nenable_force_move: True\n" + SECTIONS)
    run = PrinterRun(config, tmp_path)

    def body(printer):
        gadget = printer.lookup_object("gadget")
        eventtime = printer.get_reactor().monotonic()
        gadget.runout.note_filament_present(eventtime, True)
        assert gadget.runout.filament_present and gadget.seen == [True]
        assert gadget.runout.sensor_enabled
        gadget.runout.sensor_enabled = False
        assert gadget.runout.get_status(eventtime)["enabled"] is False
        gadget.helper.set_color(2, (0.0, 1.0, 0.0, 0.0))
        gadget.helper.check_transmit(None)
        gadget.queue.send_async_request(0.7)
        printer.get_reactor().pause(eventtime + 0.5)

    run.run(["SET_LED LED=gadget RED=0.5 INDEX=1\nSET_LED LED=gadget_ring GREEN=1\n",
             body])
    gadget = run.printer.lookup_object("gadget")
    red, green = (0.5, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)
    shown = [state for state, _ in gadget.colors]
    assert [red, (1.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)] in shown
    assert [green, green] in shown
    assert shown[-1] == [red, green, (1.0, 0.0, 0.0, 0.0)]
    assert gadget.colors[-1][1] is None and gadget.applied == [0.7]
    assert gadget.get_status(0.0)["color_data"][1] == list(green)
    assert pytest.approx(0.5) == gadget.colors[0][0][0][0]
