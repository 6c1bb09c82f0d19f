# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs on the simulated machine: what is at the pins of its mcu."""
import bench_machine

MCU = """
[mcu]
serial: /dev/none
[printer]
kinematics: none
max_velocity: 100
max_accel: 1000
"""


class OutputsBench(bench_machine.Bench):
    """The bench with an eye on output pins."""

    def __init__(self, tmp_path, monkeypatch, config):
        super().__init__(tmp_path, monkeypatch, MCU + config)

    def watch(self, description):
        """The OutputTrace of a pin, by its name in the config."""
        pin = self.machine.pins.lookup(description)
        return self.machine.mcus[pin.mcu].watch_output(pin.number, invert=pin.invert)

    def press(self, description, is_pressed):
        """Put a level on an input pin."""
        pin = self.machine.pins.lookup(description)
        self.machine.mcus[pin.mcu].set_input(pin.number, is_pressed != pin.invert)

    def read_duty(self, trace, seconds):
        """Mean on-share of an output over the next so many s."""
        trace.read_duty()
        self.pause(seconds)
        return trace.read_duty()

    def run_ready(self, body):
        """run(), with a check that the printer has started."""
        def check(it):
            assert it.printer.state == "ready", it.printer.state_message
            body(it)
            assert not it.printer.is_shutdown(), it.printer.state_message
        self.run(check)
