# SPDX-License-Identifier: GPL-3.0-or-later
"""A cartesian printer with an extruder on the simulated machine."""

import motion_bench

EXTRUDER = """
[%s]
step_pin: PA4
dir_pin: PA6
microsteps: 16
rotation_distance: 32
nozzle_diameter: 0.4
filament_diameter: 1.75
min_extrude_temp: 0
heater_pin: PB4
sensor_type: EPCOS 100K B57560G104F
sensor_pin: PK5
control: watermark
min_temp: 0
max_temp: 300
"""
E_STEP = 32. / 3200.
PRINTER = motion_bench.CARTESIAN + EXTRUDER % "extruder"


def make_run(tmp_path, monkeypatch, config=PRINTER):
    """run(body, more_config) starts a printer and calls body(bench)."""
    def run(body, more=""):
        motion_bench.MotionBench(tmp_path, monkeypatch, config + more).run_ready(body)
    return run


def count(it, name="extruder"):
    """Steps of a motor at its pins, once it rests."""
    it.toolhead.wait_moves()
    it.pause(0.5)
    return it.machine.get_step_counts()[name]


def filament(it, name="extruder"):
    """mm of filament that the motor has moved."""
    return count(it, name) * E_STEP
