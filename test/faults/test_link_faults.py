# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of the fault matrix about links and boards: short cuts, resets at any point,
clocks that run apart, and how soon pins are safe after a shutdown."""
import pathlib
import sys

import numpy as np
import pytest
from machine_configs import make_two_mcus
from printer_run import PrinterRun
from test_connection_faults import (  # noqa: F401
    job,
    make_config,
    print_and_count,
    print_to_the_end,
    quiet_print,
    start_print,
    wait_for_state,
)

UNIT = pathlib.Path(__file__).resolve().parents[1] / "unit"
sys.path.append(str(UNIT / "simulator"))
import bench_machine  # noqa: E402

SYNC_LIMIT = 20e-6      # s
STEP_TOLERANCE = 25e-6  # s, of step compression
SAFE_LIMIT = 0.001      # s from a shutdown to the last pin at its default


@pytest.mark.parametrize("seconds", [
    0.001, 0.02, pytest.param(0.3, marks=pytest.mark.slow)])
def test_short_cuts_leave_no_trace(make_host, tmp_path, job, quiet_print, seconds):  # noqa: F811
    """The cable is out for a moment, again and again: not a step more or less."""
    host = make_host(make_config(tmp_path))
    link = host.machine.mcus["mcu"].link
    counts = {"cuts": 0}

    def print_with_cuts(host):
        def cut(eventtime):
            link.cut()
            counts["cuts"] += 1
            host.reactor.pause(host.reactor.monotonic() + seconds)
            link.restore()
            return host.reactor.monotonic() + 3.0

        # not while it homes: there a silent link of 0.25 s ends the move
        timer = host.reactor.register_timer(cut, host.reactor.monotonic() + 50.0)
        assert print_and_count(host, job) == quiet_print
        host.reactor.unregister_timer(timer)
        assert host.info()["state"] == "ready" and counts["cuts"] > 5

    host.run_boots(print_with_cuts)


@pytest.mark.parametrize("seconds", [0.5, 8.0, 14.0, 45.0, 70.0])
def test_board_resets_at_any_point(make_host, tmp_path, job, seconds):  # noqa: F811
    """While homing, heating and printing: one cause, and all is well afterwards."""
    host = make_host(make_config(tmp_path))
    mcu = host.machine.mcus["mcu"]

    def fail(host):
        start_print(host, job)
        host.pause(seconds)
        assert host.status("print_stats")["state"] == "printing"
        mcu.reset()
        assert "'mcu'" in wait_for_state(host, "shutdown", 30.)
        host.pause(5.0)
        assert all(h.duty == 0. for h in host.machine.thermal.heaters)

    host.run_boots(fail, lambda host: print_to_the_end(host, job),
                   restart="gcode/firmware_restart")


@pytest.mark.parametrize("ppm", ["mcu=200, tool=-200", "mcu=-200, tool=200"])
def test_boards_whose_clocks_run_apart(tmp_path, ppm):
    """Motors of two boards, one move: each step of one against the line of the other.

    Each step may lie 25 us beside its time, whatever the clocks do.
    """
    config = (make_two_mcus().replace("pressure_advance: 0.04", "")
              + "[simulator]\nclock_ppm: %s\n" % ppm)
    run = PrinterRun(config, tmp_path).run(
        ["G28\nG90\nM83\nG1 X0 Y10 Z5 F6000\nM400", "G1 X200 E40 F600\nM400"], 1)
    x_times, e_times = [
        np.array([run.machine.mcus[mcu].time_at(int(clock))
                  for clock in run.steps[name][:, 0]])
        for name, mcu in (("stepper_x", "mcu"), ("extruder", "tool"))]
    # which part of the way is done at each step
    x_parts = (np.arange(len(x_times)) + 0.5) * (40. / 3200) / 200.
    e_parts = (np.arange(len(e_times)) + 0.5) * (22. / 3200) / 40.
    inner = (e_parts > 0.05) & (e_parts < 0.95)
    apart = e_times[inner] - np.interp(e_parts[inner], x_parts, x_times)
    assert len(apart) > 5000
    assert abs(np.mean(apart)) < SYNC_LIMIT + STEP_TOLERANCE
    assert np.percentile(np.abs(apart), 99.9) < SYNC_LIMIT + 2 * STEP_TOLERANCE


HEATERS = """
[mcu]
serial: /dev/none
[printer]
kinematics: none
max_velocity: 100
max_accel: 1000
""" + "".join("""
[heater_generic %s]
heater_pin: P%s4
sensor_type: EPCOS 100K B57560G104F
sensor_pin: P%s5
control: watermark
min_temp: 0
max_temp: 300
""" % (name, port, port) for name, port in (("one", "E"), ("two", "F")))


def test_pins_are_safe_within_a_millisecond(tmp_path, monkeypatch):
    bench = bench_machine.Bench(tmp_path, monkeypatch, HEATERS)
    mcu = bench.machine.mcus["mcu"]
    numbers = [bench.machine.pins.lookup(name).number for name in ("PE4", "PF4")]

    def body(it):
        gcode = it.printer.lookup_object("gcode")
        gcode.run_script("SET_HEATER_TEMPERATURE HEATER=one TARGET=200\n"
                         "SET_HEATER_TEMPERATURE HEATER=two TARGET=200")
        it.pause(5.0)
        traces = [mcu.watch_output(number) for number in numbers]
        it.pause(1.0)
        assert all(trace.read_duty() > 0.9 for trace in traces)
        edges = mcu.watch_edges(numbers)
        begin = it.world.monotonic()
        it.printer.invoke_shutdown("a test")
        it.pause(5.0)
        falls = [mcu.time_at(clock) for clock, _, level in edges.take() if not level]
        assert len(falls) == len(numbers)
        # all within what the message takes on the link, and the limit
        way = 2 * 0.0002 + 64 * 10 / 250000.
        assert max(falls) - begin < way + SAFE_LIMIT
        assert max(falls) - min(falls) < SAFE_LIMIT
        assert all(trace.level == 0 for trace in traces)

    bench.run(body)
