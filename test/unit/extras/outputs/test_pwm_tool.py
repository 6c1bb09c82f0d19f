# SPDX-License-Identifier: GPL-3.0-or-later
"""[pwm_tool]: power in step with the moves of a simulated machine."""
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "home"))
import motion_bench  # noqa: E402

CONFIG = motion_bench.CARTESIAN + """
[pwm_tool laser]
pin: !PH6
hardware_pwm: %s
cycle_time: 0.001
scale: 100
"""
STEP_DIST = 40. / 3200.


class LaserBench(motion_bench.MotionBench):
    """A cartesian machine with a laser; watches its pin."""

    def __init__(self, tmp_path, monkeypatch, hard="true",
                 more="maximum_mcu_duration: 1"):
        super().__init__(tmp_path, monkeypatch, CONFIG % (hard,) + more)
        pin = self.machine.pins.lookup("!PH6")
        self.mcu = self.machine.mcus["mcu"]
        self.trace = self.mcu.watch_output(pin.number, invert=True)
        self.edges = self.mcu.watch_edges([pin.number])

    def run_homed(self, body):
        def check(it):
            it.send("G28\nG1 X100.5 F3000")
            it.toolhead.wait_moves()
            it.pause(1.0)
            it.trace.read_duty()
            it.edges.take()
            body(it)
            assert not it.printer.is_shutdown()
        self.run_ready(check)

    def engrave(self):
        """200 lines of 0.5 mm at 50 mm/s, with 200 powers."""
        for index in range(200):
            self.send("SET_PIN PIN=laser VALUE=%d\nG1 X%.1f F3000"
                      % (20 if index % 2 else 80, 100 - 0.5 * index))
        self.send("SET_PIN PIN=laser VALUE=0")
        self.toolhead.wait_moves()
        self.pause(0.5)


def place_edges(edges, steps):
    """[(X in mm, on-share)]: where the head is at each edge, by its steps."""
    places, x, index = [], 100.5, 0
    for clock, _, level in edges:
        while index < len(steps) and steps[index][0] <= clock:
            x += steps[index][1] * STEP_DIST
            index += 1
        places.append((x, 1.0 - level))
    return places


def test_power_changes_where_the_lines_do(tmp_path, monkeypatch):
    def body(it):
        it.machine.record_steps()
        it.engrave()
        places = place_edges(it.edges.take(), it.machine.take_steps()["stepper_x"])
        assert len(places) == 201
        for index, (x, power) in enumerate(places):
            line_start = 100.5 - 0.5 * index
            assert x == pytest.approx(line_start, abs=1.01 * STEP_DIST), index
            expected = 0.0 if index == 200 else 0.2 if index % 2 else 0.8
            assert power == pytest.approx(expected, abs=1e-4)
    LaserBench(tmp_path, monkeypatch).run_homed(body)


@pytest.mark.parametrize("hard", ["true", "false"])
def test_energy(tmp_path, monkeypatch, hard):
    def body(it):
        begin = it.world.monotonic()
        it.engrave()
        spent = it.world.monotonic() - begin
        # half of 2 s at 80 % and half at 20 %; the slow start and end add to it
        energy = it.trace.read_duty() * spent
        assert energy == pytest.approx(1.0 + 0.02, abs=0.02)
        assert it.get("pwm_tool laser") == {"value": 0.0}
        it.pause(0.5)
        assert it.trace.read_duty() == 0.0
    LaserBench(tmp_path, monkeypatch, hard).run_homed(body)


def test_power_stays_on_past_the_maximum_duration(tmp_path, monkeypatch):
    def body(it):
        it.send("SET_PIN PIN=laser VALUE=30")
        it.pause(1.0)
        it.trace.read_duty()
        it.pause(5.0)
        assert it.trace.read_duty() == pytest.approx(0.3, abs=0.01)
        it.send("G28\nG1 X200 F300")     # 40 s, without a new value
        it.toolhead.wait_moves()
        assert it.trace.read_duty() == pytest.approx(0.3, abs=0.01)
        assert not it.printer.is_shutdown()
        it.mcu.link.cut()
        it.pause(3.0)
        it.trace.read_duty()
        it.pause(1.0)
        assert it.trace.read_duty() == 0.0
    LaserBench(tmp_path, monkeypatch).run_ready(body)


def watch_stall(it, seconds, is_whole):
    """The host does nothing for a while, amid moves; [(duty, steps)] each 0.25 s."""
    reactor, seen = it.printer.get_reactor(), []

    def stand_still(eventtime):
        if is_whole:
            it.printer.lookup_object("motion_queuing").settle()
        it.trace.read_duty()
        for index in range(round(seconds / 0.25)):
            before = it.machine.get_total_steps()["stepper_x"]
            end = eventtime + 0.25 * (index + 1)
            while it.world.monotonic() < end:
                it.world.advance(end)
            seen.append((it.trace.read_duty(),
                         it.machine.get_total_steps()["stepper_x"] - before))
        return reactor.NEVER

    reactor.register_timer(stand_still, reactor.monotonic() + 1.5)
    return seen


@pytest.mark.parametrize("is_whole", [False, True])
@pytest.mark.parametrize("hard,more", [
    ("true", ""), ("true", "maximum_mcu_duration: 0.5"), ("false", "")])
def test_power_rests_while_the_host_stalls(tmp_path, monkeypatch, hard, more, is_whole):
    """Off soon after motion ends, no shutdown, and on again when motion goes on."""
    duration = 0.5 if more else 1.0

    def body(it):
        it.send("SET_PIN PIN=laser VALUE=50")
        seen = watch_stall(it, 6.0, is_whole)
        for index in range(30):
            it.send("G1 X%.1f F3000" % (50 if index % 2 else 100,))
        it.pause(0.8)
        it.trace.read_duty()
        it.pause(2.0)
        assert it.trace.read_duty() == pytest.approx(0.5, abs=0.01)
        it.toolhead.wait_moves()
        assert it.machine.calc_position()[0] == pytest.approx(50.0, abs=STEP_DIST)
        rest = next(i for i, (_, steps) in enumerate(seen) if not steps)
        assert 4 < rest < 20
        # the way to rest of a planned stop is not known to the tool: it may end before
        assert all(duty == pytest.approx(0.5, abs=0.01) for duty, _ in seen[:rest - 4])
        last = rest + round(duration / 0.25) + 1
        assert all(duty == 0.0 for duty, _ in seen[last:]) and last < len(seen)
        assert "pwm_tool 'laser' was off meanwhile" in "\n".join(it.output)
    LaserBench(tmp_path, monkeypatch, hard, more).run_homed(body)


def test_short_stall_leaves_the_power_alone(tmp_path, monkeypatch):
    def body(it):
        it.send("SET_PIN PIN=laser VALUE=50")
        seen = watch_stall(it, 2.0, False)
        for index in range(30):
            it.send("G1 X%.1f F3000" % (50 if index % 2 else 100,))
        it.toolhead.wait_moves()
        assert len(seen) == 8
        assert all(duty == pytest.approx(0.5, abs=0.01) for duty, _ in seen)
        assert "meanwhile" not in "\n".join(it.output)
    LaserBench(tmp_path, monkeypatch, more="").run_homed(body)


@pytest.mark.parametrize("hard,value,share", [
    ("true", 25, 0.25), ("false", 100, 1.0), ("false", 0, 0.0)])
def test_shutdown_value(tmp_path, monkeypatch, hard, value, share):
    def body(it):
        assert it.get("pwm_tool laser") == {"value": 0.4}
        it.pause(0.5)
        it.trace.read_duty()
        it.pause(1.0)
        assert it.trace.read_duty() == pytest.approx(0.4, abs=0.01)
        it.send("M112")
        it.pause(0.2)
        it.trace.read_duty()
        it.pause(1.0)
        assert it.trace.read_duty() == pytest.approx(share, abs=0.001)
    LaserBench(tmp_path, monkeypatch, hard,
               "value: 40\nshutdown_value: %d" % value).run_ready(body)


@pytest.mark.parametrize("more,message", [
    ("maximum_mcu_duration: 1\nvalue: 5", "shutdown_value"),
    ("shutdown_value: 101", "shutdown_value"),
    ("maximum_mcu_duration: 0.1", "maximum_mcu_duration"),
    ("maximum_mcu_duration: 3.1", "maximum_mcu_duration"),
    ("value: 101", "value"), ("cycle_time: 4", "cycle_time"), ("scale: 0", "scale")])
def test_bad_options(tmp_path, monkeypatch, more, message):
    def body(it):
        assert it.printer.state == "error" and message in it.printer.state_message
    LaserBench(tmp_path, monkeypatch, more=more).run(body)


def test_software_pwm_has_no_share_after_a_shutdown(tmp_path, monkeypatch):
    def body(it):
        assert "must be 0 or 100.0 on software pwm" in it.printer.state_message
    LaserBench(tmp_path, monkeypatch, "false", "shutdown_value: 50").run(body)


@pytest.mark.parametrize("command", [
    "SET_PIN PIN=laser", "SET_PIN PIN=laser VALUE=101", "SET_PIN PIN=laser VALUE=-1"])
def test_bad_commands(tmp_path, monkeypatch, command):
    def body(it):
        with pytest.raises(it.printer.command_error, match="VALUE"):
            it.send(command)
        assert it.get("pwm_tool laser") == {"value": 0.0}
    LaserBench(tmp_path, monkeypatch).run_ready(body)
