# SPDX-License-Identifier: GPL-3.0-or-later
"""A host that does nothing for a while, at random moments of a print."""

import math
import random
import re

import machine_configs
import numpy as np
import pytest
from judge import Judge
from printer_run import PrinterRun
from test_exact_steps import cut_sample, make_config

KIND = "cartesian"
N_LINES = 1500
SHAPERS = {
    "impulses": "shaper_type: mzv\nshaper_freq_x: 46\nshaper_freq_y: 38\n",
    "kernels": "shaper_type: smooth_mzv\nshaper_freq_x: 46\nshaper_freq_y: 38\n",
    "filament": "shaper_type_x: mzv\nshaper_type_y: smooth_ei\nshaper_freq_x: 46\n"
                "shaper_freq_y: 38\nenabled_extruders: extruder\n",
}
# The speed before a rest is measured over so long (s), and is then below (mm/s)
SPAN = 0.004
SLOW = 25.


class StallingRun(PrinterRun):
    """Stands still for so many s, again and again, while a file is printed.

    stall: s, or None for 0.01 to 5 s by chance.  is_whole: no other thread of the
    process runs meanwhile either; None for either by chance.
    """

    def __init__(self, config, folder, stall, seed=1, is_whole=False):
        super().__init__(config, folder, seed)
        self.stall, self.draw, self.n_stalls = stall, random.Random(seed), 0
        self.is_whole = is_whole

    @property
    def motors(self):
        """All MCU_stepper."""
        motion = self.printer.lookup_object("motion_queuing")
        return [m for member in motion.members.values() for m in member.steppers]

    def _print_file(self, gcode, path):
        reactor = self.printer.get_reactor()
        timer = reactor.register_timer(self._stand_still, reactor.monotonic() + 1.)
        super()._print_file(gcode, path)
        reactor.unregister_timer(timer)

    def _stand_still(self, eventtime):
        """The world goes on, and the host does not look."""
        is_whole, stall = self.is_whole, self.stall
        if is_whole is None:
            is_whole = self.draw.random() < 0.5
        if stall is None:
            stall = 10. ** self.draw.uniform(-2., math.log10(5.))
        if is_whole:
            self.printer.lookup_object("motion_queuing").settle()
        while self.world.monotonic() < eventtime + stall:
            self.world.advance(eventtime + stall)
        self.n_stalls += 1
        return self.world.monotonic() + self.draw.uniform(0.3, 4.)


@pytest.mark.parametrize("stall", [0.01, 0.1, 0.5, 2.])
def test_short_stalls_leave_no_trace(tmp_path, stall):
    """Every step lies where it would have been, and nothing was late."""
    config = make_config(KIND)
    before, job = cut_sample("cube20.gcode", KIND, N_LINES)
    path = tmp_path / "job.gcode"
    path.write_text(job)
    run = StallingRun(config, tmp_path, stall).run([before, path], 1)
    assert run.n_stalls > 30
    assert run.printer.lookup_object("toolhead").print_stall == 0
    assert min(Judge(run, config, job, run.snapshots[0],
                     extra_limit=machine_configs.find_limits(KIND, config)
                     ).check().values()) > 1000


@pytest.mark.parametrize("shaper, stall", [
    ("impulses", 0.5), ("filament", 0.1),
    pytest.param("kernels", 0.5, marks=pytest.mark.slow),
    pytest.param("filament", 0.5, marks=pytest.mark.slow)])
def test_short_stalls_leave_no_trace_when_shaped(tmp_path, shaper, stall):
    """Every step of the shaped motors lies where it would have been."""
    config = make_config(KIND) + "\n[input_shaper]\n" + SHAPERS[shaper]
    n_lines = 120 if shaper == "filament" else 1000
    before, job = cut_sample("cube20.gcode", KIND, n_lines)
    path = tmp_path / "job.gcode"
    path.write_text(job)
    run = StallingRun(config, tmp_path, stall).run([before, path], 1)
    assert run.n_stalls > 3
    assert run.printer.lookup_object("toolhead").print_stall == 0
    assert min(Judge(run, config, job, run.snapshots[0]).check().values()) > 500


def measure_stops(run, limit=0.3):
    """Speeds (mm/s) at which x and y last moved before all rests of `limit` s."""
    tables = []
    for name in ("stepper_x", "stepper_y"):
        stepper = next(m for m in run.motors if m.get_name() == name)
        times, dirs = run.get_steps(name)
        tables.append(np.stack([times, dirs * stepper.get_step_dist()], 1))
    both = np.concatenate(tables)
    times = np.sort(both[:, 0])
    rests = times[:-1][np.diff(times) > limit]
    speeds = []
    for end in rests:
        ways = [table[(table[:, 0] > end - SPAN) & (table[:, 0] <= end), 1].sum()
                for table in tables]
        speeds.append(np.hypot(*ways) / SPAN)
    return np.array(speeds)


def run_stalls(tmp_path, kind, stall, **options):
    """A print with stalls and one without; both end alike."""
    machine = "cartesian" if kind in ("two_mcus", "no_advance", *SHAPERS) else kind
    if kind == "two_mcus":
        config = machine_configs.make_two_mcus()
    else:
        config = make_config(machine, 0. if kind == "no_advance" else 0.04)
    if kind in SHAPERS:
        config += "\n[input_shaper]\n" + SHAPERS[kind]
    before, job = cut_sample("cube20.gcode", machine, N_LINES)
    path = tmp_path / "job.gcode"
    path.write_text(job)
    run = StallingRun(config, tmp_path, stall, **options).run([before, path], 1)
    plain = PrinterRun(config, tmp_path).run([before, path], 1)
    assert run.n_stalls > 8
    assert run.count_late_events() == 0
    assert run.snapshots[-1].position == plain.snapshots[-1].position
    assert run.snapshots[-1].counts == plain.snapshots[-1].counts
    for name, table in run.steps.items():
        assert len(table) >= len(plain.steps[name])
    return run


@pytest.mark.parametrize("kind, stall", [
    ("cartesian", 4.), ("corexy", 3.), ("delta", 3.5), ("two_mcus", 5.),
    ("no_advance", 4.), ("filament", 4.)])
def test_long_stalls_end_in_a_planned_stop(tmp_path, kind, stall):
    """Motion slows down on its way, rests, and goes on when the host is back."""
    run = run_stalls(tmp_path, kind, stall)
    motion, toolhead = map(run.printer.lookup_object,
                           ("motion_queuing", "toolhead"))
    assert motion.guard.n_stops > 5 and motion.n_holds == 0
    assert toolhead.print_stall == motion.guard.n_stops
    told = [text for text in run.responses if "planned stop" in text]
    assert told == ["// The host was late and motion came to a planned stop: test_late"
                    "_host.StallingRun._stand_still kept it busy for %.1f s" % stall]
    if kind not in ("corexy", "delta"):
        speeds = measure_stops(run)
        assert len(speeds) > 5 and speeds.max() < SLOW


@pytest.mark.parametrize("kind, stall", [
    ("cartesian", 2.8), ("corexy", 3.), ("delta", 3.5), ("two_mcus", 3.),
    ("cartesian", 4.), ("filament", 3.)])
def test_a_stopped_process_holds_the_print(tmp_path, kind, stall):
    """Motion stands where what was sent ends, and goes on from there."""
    run = run_stalls(tmp_path, kind, stall, is_whole=True)
    assert run.printer.lookup_object("motion_queuing").n_holds > 5


@pytest.mark.parametrize("points, shaper", [
    (60, None), (20, "filament"), pytest.param(1000, None, marks=pytest.mark.slow),
    *[pytest.param(300, name, marks=pytest.mark.slow) for name in SHAPERS]])
def test_stalls_at_random_points(tmp_path, points, shaper):
    """10 ms to 5 s, of the main thread or of the process: all ends alike."""
    config = make_config(KIND)
    if shaper:
        config += "\n[input_shaper]\n" + SHAPERS[shaper]
    before, job = cut_sample("cube20.gcode", KIND, N_LINES)
    path = tmp_path / "job.gcode"
    path.write_text(job)
    plain = PrinterRun(config, tmp_path).run([before, path], 1).snapshots[-1]
    done = seed = 0
    while done < points:
        seed += 1
        run = StallingRun(config, tmp_path, None, seed, None).run([before, path], 1)
        end = run.snapshots[-1]
        assert (end.position, end.counts) == (plain.position, plain.counts)
        assert run.count_late_events() == 0 and run.n_stalls > 10
        done += run.n_stalls


@pytest.mark.parametrize("kind, stall, is_whole", [
    ("cartesian", 20., True), ("two_mcus", 8., False)])
def test_heaters_rest_without_a_host(tmp_path, kind, stall, is_whole):
    """The mcu turns them off in time; the print goes on when they are warm."""
    run = run_stalls(tmp_path, kind, stall, is_whole=is_whole)
    told = [text for text in run.responses if "was turned off meanwhile" in text]
    assert len(told) > 5
    assert run.printer.lookup_object("extruder").heater.n_expired > 5


def test_late_output_comes_at_once(tmp_path):
    """A fan that should have changed while the host stood still."""
    config = make_config(KIND)

    class Late(PrinterRun):
        def _run_part(self, gcode, part):
            mcu = self.printer.lookup_object("mcu")
            fan = self.printer.lookup_object("fan").fan.mcu_fan
            now = self.printer.get_reactor().monotonic()
            fan.set_pwm(mcu.estimated_print_time(now) - 2., 1.)
            self.printer.get_reactor().pause(now + 0.3)
            assert mcu.late_outputs == 1 and not self.printer.is_shutdown()
            trace = self.machine.mcus["mcu"].watch_output(
                self.machine.get_pin_map("mcu")[re.search(
                    r"\[fan\]\npin: (\w+)", config)[1]])
            assert trace.level == 1

    Late(config, tmp_path).run(["late"])
