# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole printers on the simulated machine: real firmware, steps and switches."""

import bench_machine

from klippy import printer as printer_module

LAST_MODULES = printer_module.LAST_MODULES

CARTESIAN = """
[mcu]
serial: /dev/none
[printer]
kinematics: cartesian
max_velocity: 300
max_accel: 3000
max_z_velocity: 25
max_z_accel: 100
[stepper_x]
step_pin: PF0
dir_pin: PF1
enable_pin: !PD7
microsteps: 16
rotation_distance: 40
endstop_pin: ^PE5
position_endstop: 0
position_max: 200
homing_speed: 50
[stepper_y]
step_pin: PF6
dir_pin: !PF7
enable_pin: !PF2
microsteps: 16
rotation_distance: 40
endstop_pin: ^PJ1
position_endstop: 200
position_max: 200
homing_speed: 80
[stepper_z]
step_pin: PL3
dir_pin: PL1
enable_pin: !PK0
microsteps: 16
rotation_distance: 8
endstop_pin: ^PD3
position_endstop: 0.5
position_max: 200
homing_speed: 10
"""


class MotionBench(bench_machine.Bench):
    """The bench with the real toolhead."""

    def __init__(self, tmp_path, monkeypatch, config=CARTESIAN, **options):
        super().__init__(tmp_path, monkeypatch, config, **options)
        monkeypatch.setattr(printer_module, "LAST_MODULES", LAST_MODULES)

    @property
    def toolhead(self):
        return self.printer.lookup_object("toolhead")

    def get_error(self):
        """How far (mm) each axis is from where the printer takes it to be."""
        self.toolhead.wait_moves()
        self.pause(0.1)
        believed = self.toolhead.get_position()
        return [abs(a - b) for a, b in zip(self.machine.calc_position(), believed[:3],
                                           strict=True)]

    def run_ready(self, body):
        """run(), with a check that the printer has started."""
        def check(it):
            assert it.printer.state == "ready", it.printer.state_message
            body(it)
        self.run(check)
