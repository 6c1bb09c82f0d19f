# SPDX-License-Identifier: GPL-3.0-or-later
"""What the report tells against what the simulated motors do."""

import logging
import math

import motion_bench
import pytest
from motion_bench import CARTESIAN

from klippy import webhooks
from klippy.extras import motion_report

EXTRUDER = """
[extruder]
step_pin: PA4
dir_pin: PA6
enable_pin: !PA2
microsteps: 16
rotation_distance: 33.5
nozzle_diameter: 0.400
filament_diameter: 1.750
heater_pin: PB4
sensor_type: ATC Semitec 104GT-2
sensor_pin: PK5
control: watermark
min_temp: 0
max_temp: 260
min_extrude_temp: 0
"""


@pytest.fixture
def run(tmp_path, monkeypatch):
    def run(body, config=CARTESIAN + EXTRUDER):
        motion_bench.MotionBench(tmp_path, monkeypatch, config).run_ready(body)
    return run


class Client:
    """An API client that keeps what it gets."""
    name = "test"

    def __init__(self):
        self.messages, self.is_gone = [], False

    def is_closed(self):
        return self.is_gone

    def send(self, message):
        self.messages.append(message)

    def take_data(self):
        return [row for message in self.messages for row in message["params"]["data"]]


def subscribe(it, path, name):
    client = Client()
    reply = webhooks.get(it.printer).answer(client, {
        "id": 7, "method": path,
        "params": {"name": name, "response_template": {"key": name}}})
    return client, reply


def settle(it):
    it.toolhead.wait_moves()
    it.pause(1.2)


# Pieces


def test_pages_are_joined_without_seams():
    rows = [(i // 3, i) for i in range(2000)]

    def extract(limit, start, end):
        return [row for row in reversed(rows) if start <= row[0] <= end][:limit]
    assert motion_report.read_pages(extract, 100, 600, lambda row: row[0]) \
        == [row for row in rows if 100 <= row[0] <= 600]
    assert motion_report.read_pages(extract, 9000, 9001, lambda row: row[0]) == []


def test_runs_are_split_at_marks():
    def run(first, count):
        return (first, first + 10, 0, count, 10, 0)
    runs = [run(0, 5), run(20, -3), run(40, 7), (30, 30, 99, 0, 0, 0), run(50, 1)]
    # the motor had stopped at 30: what was planned for 40 never happened
    assert motion_report.split_at_marks(runs) == [[run(0, 5), run(20, -3)],
                                                  [run(50, 1)]]
    assert motion_report.split_at_marks([]) == []


# Status


def test_known_names(run):
    def body(it):
        status = it.get("motion_report")
        assert status["steppers"] == ["extruder", "stepper_x", "stepper_y", "stepper_z"]
        assert status["trapq"] == ["extruder", "toolhead"]
        assert status["live_position"] == (0., 0., 0., 0.)
        assert status["live_velocity"] == status["live_extruder_velocity"] == 0.
    run(body)


def test_live_values_follow_the_motors(run):
    def body(it):
        it.send("G28\nM83\nG1 X10 Y10 Z5 F6000")
        settle(it)
        it.send("G1 X170 Y130 E8 F3000")
        seen = []
        while it.machine.calc_position()[0] < 169.9:
            it.pause(0.050)
            status = it.get("motion_report")
            seen.append(status["live_velocity"])
            true = it.machine.calc_position()
            # half a step and what the clock is known to
            assert status["live_position"][:3] == pytest.approx(true, abs=0.03)
            assert status["live_extruder_velocity"] == pytest.approx(
                status["live_velocity"] * 8. / 200., abs=1e-6)
            assert status["live_position"].e == pytest.approx(
                (status["live_position"].x - 10.) * 8. / 160., abs=1e-4)
        assert max(seen) == pytest.approx(50.) and len(seen) > 50
        settle(it)
        it.send("G1 E-2 F600")
        while it.get("motion_report")["live_extruder_velocity"] >= 0.:
            it.pause(0.020)
        assert it.get("motion_report")["live_velocity"] == 0.
        settle(it)
        status = it.get("motion_report")
        assert status["live_position"] == pytest.approx((170., 130., 5., 6.))
        assert status["live_velocity"] == status["live_extruder_velocity"] == 0.
    run(body)


# Streams


def test_steps_are_streamed(run):
    def body(it):
        it.send("G28 X")
        settle(it)
        client, reply = subscribe(it, "motion_report/dump_stepper", "stepper_x")
        assert reply == {"id": 7, "result": {"header": ["interval", "count", "add"]}}
        motor = it.printer.lookup_object("force_move").lookup_stepper("stepper_x")
        start = it.machine.get_step_counts()["stepper_x"]
        position = motor.get_commanded_position()
        it.send("G1 X80 F6000\nG1 X30")
        settle(it)
        assert len(client.messages) >= 3
        steps = 0
        for message in client.messages:
            params = message["params"]
            assert message["key"] == "stepper_x" and set(params) == {
                "data", "start_position", "start_mcu_position", "step_distance",
                "first_clock", "first_step_time", "last_clock", "last_step_time"}
            assert params["start_mcu_position"] == start + steps
            assert params["start_position"] == pytest.approx(
                position + steps * params["step_distance"])
            assert params["step_distance"] == 0.0125
            check_clocks(params, it.printer.lookup_object("mcu"))
            steps += sum(row[1] for row in params["data"])
        assert start + steps == it.machine.get_step_counts()["stepper_x"]
        client.is_gone = True
        it.pause(1.)
        count = len(client.messages)
        it.send("G1 X40")
        settle(it)
        assert len(client.messages) == count
    run(body)


def check_clocks(params, mcu):
    """The data must lead from the first clock to the last one."""
    interval, count, add = params["data"][0]
    clock = params["first_clock"] - interval
    for interval, count, add in params["data"]:
        n = abs(count)
        clock += n * interval + add * n * (n - 1) // 2
    assert clock == params["last_clock"]
    for name in ("first", "last"):
        assert mcu.clock_to_print_time(params[name + "_clock"]) == pytest.approx(
            params[name + "_step_time"], abs=1e-4)


def test_moves_are_streamed(run):
    def body(it):
        it.send("G28\nG1 X10 Y10 Z5 F6000")
        settle(it)
        client, reply = subscribe(it, "motion_report/dump_trapq", "toolhead")
        filament, _ = subscribe(it, "motion_report/dump_trapq", "extruder")
        assert reply["result"] == {"header": [
            "time", "duration", "start_velocity", "acceleration", "start_position",
            "direction"]}
        begin = it.toolhead.get_last_move_time()
        it.send("G1 X40 Y50 E2 F3000")
        end = it.toolhead.get_last_move_time()
        settle(it)
        rows = client.take_data()
        assert rows[0][0] >= begin
        assert rows[-1][0] + rows[-1][1] == pytest.approx(end)
        way = 0.
        for (time, duration, velocity, accel, start, direction), following in zip(
                rows, [*rows[1:], None], strict=True):
            assert direction == pytest.approx((0.6, 0.8, 0.))
            assert start == pytest.approx((10. + way * 0.6, 10. + way * 0.8, 5.))
            way += (velocity + 0.5 * accel * duration) * duration
            if following is not None:
                assert time + duration == pytest.approx(following[0])
        assert way == pytest.approx(50.)
        assert [row[0] for row in filament.take_data()] == pytest.approx(
            [row[0] for row in rows])
        assert math.isclose(filament.take_data()[0][3], rows[0][3] * 2. / 50.)
        assert client.messages[0]["key"] == "toolhead"
    run(body)


def test_streams_have_names(run):
    def body(it):
        for path in ("dump_stepper", "dump_trapq"):
            _, reply = subscribe(it, "motion_report/" + path, "nobody")
            assert "error" in reply
    run(body)


# Shutdown


def test_last_words_are_bounded(run, caplog):
    def body(it):
        it.send("G28")
        it.send("\n".join("G1 X%.2f Y%.2f F9000" % (50. + i % 2, 50. + i % 3)
                          for i in range(150)))
        caplog.clear()
        it.printer.invoke_shutdown("a test")
        it.pause(0.5)
        text = "\n".join(record.getMessage() for record in caplog.records)
        assert "motion around the shutdown" in text
        assert "moves of 'toolhead'" in text and "stepper 'stepper_x' of mcu" in text
        lines = text.splitlines()
        begin = next(i for i, line in enumerate(lines) if "stepper 'stepper_x'" in line)
        end = next(i for i, line in enumerate(lines) if "stepper 'stepper_y'" in line)
        assert 1 < end - begin <= motion_report.MAX_LOG_ROWS + 1
    with caplog.at_level(logging.INFO):
        run(body)
