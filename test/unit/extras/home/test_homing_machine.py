# SPDX-License-Identifier: GPL-3.0-or-later
"""Homing on the simulated machine leaves the head where the printer says."""

import pathlib

import motion_bench
import pytest
from motion_bench import CARTESIAN

from klippy import rail
from klippy.errors import CommandError
from klippy.extras import homing

CONFIG = pathlib.Path(__file__).resolve().parents[4] / "config"
# Half a step, as positions between two steps are rounded; mm at the nozzle
HALF = {"cartesian": (0.00626, 0.00626, 0.00126), "corexy": (0.00626, 0.00626, 0.00126),
        "delta": (0.0125, 0.0125, 0.00626)}


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    def make(config=CARTESIAN, **options):
        return motion_bench.MotionBench(tmp_path, monkeypatch, config, **options)
    return make


def assert_true(it, limits=HALF["cartesian"]):
    errors = it.get_error()
    assert all(a <= b for a, b in zip(errors, limits, strict=True)), errors


def homed(it):
    return it.get("toolhead")["homed_axes"]


@pytest.mark.parametrize("kind", ["cartesian", "corexy", "delta"])
def test_sample_machines_know_where_they_are(make_bench, kind):
    def body(it):
        assert homed(it) == ""
        it.send("G28")
        assert homed(it) == "xyz"
        assert it.get_error() == pytest.approx([0.] * 3, abs=1e-9)
        it.send("G90\nG1 Z60 F1200\nG1 X20 Y31 F12000\nG1 X12.5 Y-2\nG1 Z50" if kind
                == "delta" else "G1 Z20 F600\nG1 X100 Y31 F12000\nG1 X12.5 Y177")
        assert_true(it, HALF[kind])
        # once more, from somewhere else and at other speeds
        it.send("G28")
        assert_true(it, HALF[kind])
    make_bench((CONFIG / ("sample-%s.cfg" % kind)).read_text()).run_ready(body)


def test_single_axes(make_bench):
    def body(it):
        it.send("G28 Y")
        assert homed(it) == "y"
        it.send("G28 X0 Z0")
        assert homed(it) == "xyz"
        assert_true(it)
        position = it.toolhead.get_position()
        assert position[:2] == pytest.approx([0., 200.], abs=0.0126)
    make_bench().run_ready(body)


def test_no_trigger_after_the_full_way(make_bench):
    def body(it):
        with pytest.raises(CommandError, match="No trigger on x after full movement"):
            it.send("G28 X")
        assert homed(it) == ""
        before = it.machine.get_step_counts()["stepper_x"]
        with pytest.raises(CommandError, match="Must home"):
            it.send("G1 X5")
        # the motors are sound: 600 mm nearer, the switch is in reach
        it.send("G28 X")
        assert abs(it.machine.get_step_counts()["stepper_x"] - before) > 1000
        assert homed(it) == "x"
    make_bench(CARTESIAN + "[simulator]\nstart_position: 500, 50, 5\n").run_ready(body)


def test_switch_that_is_stuck(make_bench):
    def body(it):
        with pytest.raises(CommandError, match="x still triggered after retract"):
            it.send("G28 X")
        assert homed(it) == ""
        it.send("QUERY_ENDSTOPS")
        assert "x:TRIGGERED" in it.output[-1]
    # a switch far below the others' zero: pressed wherever the head is
    config = CARTESIAN + "[simulator]\nstart_position: -100, 50, 5\n"
    make_bench(config).run_ready(body)


def test_query_endstops(make_bench):
    def body(it):
        it.send("M119")
        assert it.output[-1] == "x:open y:open z:open"
        it.send("G28 X")
        it.send("G1 X0")
        it.send("QUERY_ENDSTOPS")
        assert it.output[-1] == "x:TRIGGERED y:open z:open"
        assert it.get("query_endstops")["last_query"] == {"x": 1, "y": 0, "z": 0}
        it.send("G1 X20")
        answers = []
        request = type("Request", (), {"send": lambda self, data: answers.append(data)})
        webhooks = it.printer.lookup_object("webhooks")
        webhooks.find_callback("query_endstops/status")(request())
        assert answers == [{"x": "open", "y": "open", "z": "open"}]
    make_bench().run_ready(body)


def test_position_survives_overshoot_of_another_mcu(make_bench):
    """The switch is on one mcu, the motor on another: it stops a little late."""
    config = CARTESIAN.replace("endstop_pin: ^PE5", "endstop_pin: ^head:PE5").replace(
        "homing_speed: 50", "homing_speed: 100\nhoming_retract_dist: 0", 1)

    def body(it):
        halts = []
        it.printer.register_event_handler(
            "homing:homing_move_end", lambda move: halts.append(
                [m.halt_pos - m.trig_pos for m in move.stepper_positions]))
        it.send("G28")
        # it did go further, and that is known
        assert abs(halts[0][0]) > 3
        assert_true(it)
        assert it.toolhead.get_position()[0] < -0.03
    make_bench(config + "[mcu head]\nserial: /dev/none2\n").run_ready(body)


def test_cable_cut_while_homing(make_bench):
    config = CARTESIAN.replace("endstop_pin: ^PE5", "endstop_pin: ^head:PE5").replace(
        "homing_speed: 50", "homing_speed: 5", 1)

    def body(it):
        reactor = it.printer.get_reactor()

        def cut(eventtime):
            it.machine.mcus["head"].link.cut()
        reactor.register_callback(cut, reactor.monotonic() + 2.)
        with pytest.raises(CommandError, match="Communication timeout during homing|"
                                               "failed due to printer shutdown"):
            it.send("G28 X")
        it.pause(0.5)
        before = it.machine.get_step_counts()["stepper_x"]
        it.pause(3.)
        # stopped after 2 s of 5 mm/s, not at the end of the way
        assert it.machine.get_step_counts()["stepper_x"] == before
        assert abs(before) * 0.0125 < 5. * 3.
    make_bench(config + "[mcu head]\nserial: /dev/none2\n").run_ready(body)


def test_probing_on_the_machine(make_bench):
    """A probe is an endstop of its own; here z's switch plays it."""
    def body(it):
        it.send("G28\nG1 Z10 F1200")
        phoming = it.printer.lookup_object("homing")
        endstop = it.printer.lookup_object("query_endstops").endstops[2][0]
        x, y, _, e = it.toolhead.get_position()
        position = phoming.probing_move(endstop, [x, y, 0., e], 5.)
        assert position[2] == pytest.approx(0.5, abs=0.005)
        assert_true(it)
        with pytest.raises(CommandError, match="Probe triggered prior to movement"):
            phoming.probing_move(endstop, [x, y, 0., e], 5.)
        assert_true(it)
        it.send("G1 Z10 F1200")
        with pytest.raises(CommandError, match="No trigger on probe"):
            phoming.probing_move(endstop, [x, y, 5., e], 5.)
        assert_true(it)
        assert it.toolhead.get_position()[2] == pytest.approx(5.)
        with pytest.raises(CommandError, match="Error during homing move: .*range"):
            phoming.probing_move(endstop, [x, y, -500., e], 5.)
        assert_true(it)
        it.send("G1 Z20")
        assert_true(it)
    make_bench().run_ready(body)


SAFE = "[safe_z_home]\nhome_xy_position: 100, 90\nspeed: 150\nz_hop: 8\n"


def note_moves(it):
    """List of the ends of all moves from now on."""
    ends = []
    add = it.toolhead.manual_move

    def move(coord, speed):
        ends.append((tuple(coord), speed))
        add(coord, speed)
    it.toolhead.manual_move = move
    return ends


def test_safe_z_home(make_bench):
    def body(it):
        start = it.machine.calc_position()
        ends = note_moves(it)
        with pytest.raises(CommandError, match="Must home X and Y axes first"):
            it.send("G28 Z")
        # lifted first, and z is as unknown as before
        it.toolhead.wait_moves()
        assert it.machine.calc_position()[2] == pytest.approx(start[2] + 8., abs=0.01)
        assert homed(it) == ""
        it.send("G28")
        assert homed(it) == "xyz"
        assert ends[-2:] == [((100., 90.), 150.), ((None, None, 8.), 15.)]
        assert it.toolhead.get_position()[:3] == pytest.approx([100., 90., 8.])
        assert_true(it)
        it.send("G1 X5 Y5 F9000\nG1 Z30 F1200\nG28 X")
        assert it.toolhead.get_position()[2] == pytest.approx(30.)
        assert it.toolhead.get_position()[1] == pytest.approx(5.)
    make_bench(CARTESIAN + SAFE).run_ready(body)


@pytest.mark.parametrize("is_y_first", [False, True])
def test_order_of_homing(make_bench, is_y_first):
    def body(it):
        order = []
        it.printer.register_event_handler(
            "homing:home_rails_begin",
            lambda state, rails: order.append(rails[0].get_name(short=True)))
        it.send("G28")
        assert "".join(order) == ("yxz" if is_y_first else "xyz")
        assert homed(it) == "xyz"
        order.clear()
        it.send("G28 X")
        assert order == ["x"]
    make_bench(CARTESIAN + SAFE + "home_y_before_x: %s\n" % (is_y_first,)
               ).run_ready(body)


def test_safe_z_home_returns(make_bench):
    def body(it):
        it.send("G28 X Y\nG1 X50 Y60 F9000\nG28 Z")
        assert it.toolhead.get_position()[:2] == pytest.approx([50., 60.])
        assert_true(it)
    make_bench(CARTESIAN + SAFE + "move_to_previous: True\n").run_ready(body)


@pytest.mark.parametrize("extra, words", [
    (SAFE.replace("z_hop: 8", "z_hop: 201"), "position_max"),
    (SAFE.replace("100, 90", "100"), "home_xy_position"),
    (SAFE + "[homing_override]\ngcode: G28\n", "remove one")])
def test_configs_that_cannot_be(make_bench, extra, words):
    def body(it):
        assert it.printer.state == "error"
        assert words in it.printer.state_message
    make_bench(CARTESIAN + extra).run(body)


OVERRIDE = """
[homing_override]
axes: zx
set_position_z: 3
gcode:
  G28 Y
  M118 homing {params.keys() | sort | join("+")}
  G1 Z5 F600
  G28 X Z
"""


def test_homing_override(make_bench):
    def body(it):
        it.send("G28 Y")
        assert homed(it) == "y" and not any("homing" in x for x in it.output)
        before = it.machine.calc_position()[2]
        it.send("G28 X")
        assert "echo: homing X" in it.output
        assert homed(it) == "xyz"
        assert_true(it)
        assert before > 5.
        it.send("G28")
        assert_true(it)
    make_bench(CARTESIAN + "[respond]\n" + OVERRIDE).run_ready(body)


def test_arcs_and_offsets_end_where_they_say(make_bench):
    def body(it):
        it.send("G28\nG1 X100 Y100 Z5 F9000\nG2 X120 Y100 I10 Z7\nG18\n"
                "G3 X100 Z7 I-10 F3000\nSET_GCODE_OFFSET Z=0.2 MOVE=1\n"
                "G91\nG1 X-3\nG90\nG92 Y0\nG1 Y2\nM400\nGET_POSITION")
        assert_true(it)
        position = it.toolhead.get_position()
        assert position[:3] == pytest.approx([97., 102., 7.2])
        text = "\n".join(it.output)
        assert "// toolhead: X:97.000000 Y:102.000000 Z:7.200000 E:0.000000" in text
        assert "// gcode base: X:0.000000 Y:100.000000 Z:0.200000 E:0.000000" in text
        assert "// gcode homing: X:0.000000 Y:0.000000 Z:0.200000" in text
        kinematic = [x for x in text.split("\n") if x.startswith("// kinematic: ")][0]
        assert [float(x.partition(":")[2]) for x in kinematic.split()[2:]] == (
            pytest.approx(position[:3], abs=0.013))
        counts = it.machine.get_step_counts()
        assert len([x for x in text.split("\n") if x.startswith("// mcu: ")]) == 1
        assert set(counts) >= {"stepper_x", "stepper_y", "stepper_z"}
    make_bench(CARTESIAN + "[gcode_arcs]\nresolution: 0.5\n").run_ready(body)


SENSORLESS = CARTESIAN.replace(
    "homing_speed: 50", "homing_speed: 50\nhoming_retract_dist: 3\n"
    "use_sensorless_homing: True\nmin_home_dist: 20\nhoming_accel: 500")


def note_homing(it, monkeypatch):
    """[(x of a homing move's trigger, accel)], appended to."""
    moves, real = [], homing.HomingMove.homing_move

    def homing_move(move, movepos, speed, *args, **options):
        result = real(move, movepos, speed, *args, **options)
        moves.append((move.find_way(), it.get("toolhead")["max_accel"]))
        return result
    monkeypatch.setattr(homing.HomingMove, "homing_move", homing_move)
    return moves


def test_sensorless_homing_needs_a_way(make_bench, monkeypatch):
    def body(it):
        moves = note_homing(it, monkeypatch)
        it.send("G28 X")
        # wherever it began: a short way is made again from min_home_dist
        assert it.get("toolhead")["position"][0] == pytest.approx(3.)
        assert it.get_error()[0] <= HALF["cartesian"][0]
        it.send("G1 X5 F3000")
        moves.clear()
        it.send("G28 X")
        assert [way for way, _ in moves] == pytest.approx([5., 20.], abs=0.1)
        assert {accel for _, accel in moves} == {500}
        assert it.get("toolhead")["max_accel"] == 3000
        it.send("G1 X50 F3000")
        moves.clear()
        it.send("G28 X")
        assert [way for way, _ in moves] == pytest.approx([50.], abs=0.1)
        assert it.get("toolhead")["position"][0] == pytest.approx(3.)
        assert it.get_error()[0] <= HALF["cartesian"][0]
    make_bench(SENSORLESS).run_ready(body)


def test_sensorless_homing_that_ends_too_early_fails(make_bench, monkeypatch):
    def body(it):
        monkeypatch.setattr(homing.HomingMove, "find_way", lambda move: 7.)
        with pytest.raises(CommandError, match="after 7.000 mm, not after"):
            it.send("G28 X")
        assert "x" not in homed(it)
    make_bench(SENSORLESS).run_ready(body)


@pytest.mark.parametrize("pin, is_sensorless", [
    ("^PE5", False), ("tmc2209_stepper_x:virtual_endstop", True)])
def test_default_of_sensorless_homing(make_bench, monkeypatch, pin, is_sensorless):
    monkeypatch.setattr(rail.Rail, "lookup_endstop",
                        lambda self, pin_desc, name: object())
    found = []
    monkeypatch.setattr(rail.Rail, "_check_direction",
                        lambda self, config, choice: found.append(
                            self.use_sensorless_homing))

    def body(it):
        assert found[:1] == [is_sensorless]
    make_bench(CARTESIAN.replace("^PE5", pin)).run(body)
