# SPDX-License-Identifier: GPL-3.0-or-later
"""Homing moves on steppers that go further than their triggers tell."""

import front_end
import pytest

from klippy.errors import CommandError, McuError
from klippy.extras.homing import Homing, HomingMove, PrinterHoming

STEP = 0.01


class Stepper:
    """Steps along one axis, counted from `offset`; goes where it is sent."""

    def __init__(self, name, axis):
        self.name, self.axis = name, axis
        self.position, self.steps, self.past = 0., 1000, 1000
        self.synced = 0

    def get_name(self):
        return self.name

    def get_step_dist(self):
        return STEP

    def get_commanded_position(self):
        return self.position

    def get_mcu_position(self):
        return self.steps

    def get_past_mcu_position(self, print_time):
        return self.past

    def calc_position_from_coord(self, coord):
        return coord[self.axis]

    def note_homing_end(self):
        self.synced += 1

    def run(self, way, way_at_trigger):
        """Move so many mm, with the trigger after so many."""
        self.past = self.steps + round(way_at_trigger / STEP)
        self.steps += round(way / STEP)


class Endstop:
    """Triggers after `at` mm; the stepper stops after `stops` mm."""

    def __init__(self, printer, steppers, at=5., stops=5.02, result=3.):
        self.reactor = printer.get_reactor()
        self.steppers, self.at, self.stops, self.result = steppers, at, stops, result
        self.starts, self.waits = [], []
        self.error = None

    def get_steppers(self):
        return self.steppers

    def home_start(self, print_time, sample_time, sample_count, rest_time,
                   triggered=True):
        self.starts.append((print_time, rest_time, triggered))
        if isinstance(self.error, CommandError):
            raise self.error
        completion = self.reactor.completion()
        completion.complete(1)
        return completion

    def home_wait(self, home_end_time):
        self.waits.append(home_end_time)
        if self.error is not None:
            raise self.error
        return self.result


class Head:
    """Toolhead and kinematics in one: x and y, each with a stepper."""

    def __init__(self, printer):
        self.printer = printer
        self.steppers = [Stepper("stepper_x", 0), Stepper("stepper_y", 1)]
        self.position, self.homed, self.moves = [0., 0., 0., 0.], [], []
        self.time, self.drip_error, self.endstops = 1., None, []

    def get_kinematics(self):
        return self

    def get_steppers(self):
        return self.steppers

    def calc_position(self, positions):
        return [positions["stepper_x"], positions["stepper_y"], None]

    def get_position(self):
        return list(self.position)

    def set_position(self, newpos, homing_axes=""):
        self.position = list(newpos)
        self.homed.append(homing_axes)
        for stepper in self.steppers:
            stepper.position = newpos[stepper.axis]

    def get_last_move_time(self):
        return self.time

    def flush_step_generation(self):
        pass

    def dwell(self, delay):
        self.time += delay

    def move(self, newpos, speed):
        self.moves.append((list(newpos), speed))
        self.position = list(newpos)
        for stepper in self.steppers:
            stepper.position = newpos[stepper.axis]

    def drip_move(self, newpos, speed, completion):
        if self.drip_error:
            raise self.drip_error
        self.moves.append((list(newpos), speed))
        sign = 1. if sum(newpos) > sum(self.position) else -1.
        for endstop in self.endstops:
            for stepper in endstop.steppers:
                stepper.run(sign * endstop.stops, sign * endstop.at)
        self.time += 10.
        self.position = list(newpos)


class Info:
    speed, retract_dist, retract_speed, second_homing_speed = 20., 5., 30., 4.


class Rail:
    def __init__(self, *endstops):
        self.endstops = list(endstops)

    def get_endstops(self):
        return self.endstops

    def get_homing_info(self):
        return Info()


@pytest.fixture
def printer():
    made = front_end.Printer()
    made.head = Head(made)
    made.add_object("toolhead", made.head)
    x, y = ([stepper] for stepper in made.head.steppers)
    made.head.endstops = [Endstop(made, x), Endstop(made, y, 4., 4.)]
    made.x, made.y = ((e, e.steppers[0].name) for e in made.head.endstops)
    made.make_ready()
    yield made
    made.close()


def homing_move(printer, endstops, pos, **options):
    move = HomingMove(printer, endstops)
    return move, move.homing_move(list(pos), 20., **options)


def test_the_way_past_the_trigger_is_added(printer):
    move, position = homing_move(printer, [printer.x], [-100., 0., 0., 0.])
    assert position == [-100., 0., 0., 0.]
    assert printer.head.position == [pytest.approx(-100.02), 0., 0., 0.]
    assert [name for name, *_ in printer.events[-2:]] == [
        "homing:homing_move_begin", "homing:homing_move_end"]
    moved = move.stepper_positions[0]
    assert (moved.start_pos, moved.trig_pos, moved.halt_pos) == (1000, 500, 498)
    assert moved.stepper.synced == 1
    endstop = printer.x[0]
    # one sample a step: 0.01 mm at 20 mm/s
    assert endstop.starts == [(1., pytest.approx(0.0005), True)]
    assert endstop.waits == [pytest.approx(11.001)]
    assert move.get_mcu_endstops() == [endstop]


def test_each_stepper_has_its_own_trigger(printer):
    homing_move(printer, [printer.x, printer.y], [-100., -100., 0., 0.])
    assert printer.head.position == [pytest.approx(-100.02), -100., 0., 0.]


def test_probing_counts_from_the_start(printer):
    printer.head.set_position([50., 50., 3., 0.])
    _, position = homing_move(printer, [printer.x], [-100., 50., 3., 0.],
                              probe_pos=True, triggered=False)
    assert position == [pytest.approx(45.), 50., 3., 0.]
    assert printer.head.position == [pytest.approx(44.98), 50., 3., 0.]
    assert printer.x[0].starts[0][2] is False


@pytest.mark.parametrize("result, words", [
    (0., "No trigger on stepper_x after full movement"),
    (-1., "Communication timeout during homing stepper_x")])
def test_without_a_trigger(printer, result, words):
    printer.x[0].result = result
    printer.x[0].at = printer.x[0].stops = 12.
    with pytest.raises(CommandError, match=words):
        homing_move(printer, [printer.x, printer.y], [-100., -100., 0., 0.])
    # the other endstop is disarmed, and the position is that of the motors
    assert len(printer.y[0].waits) == 1
    assert printer.head.position == [pytest.approx(-12.), -4., 0., 0.]
    assert printer.events[-1][0] == "homing:homing_move_end"


def test_no_trigger_may_be_allowed(printer):
    printer.x[0].result = 0.
    homing_move(printer, [printer.x], [-100., 0., 0., 0.], check_triggered=False)


def test_error_of_an_endstop_names_it(printer):
    printer.x[0].error = McuError("link is cut")
    with pytest.raises(CommandError, match="stepper_x failed: link is cut"):
        homing_move(printer, [printer.x, printer.y], [-100., -100., 0., 0.])
    assert len(printer.y[0].waits) == 1


def test_endstops_armed_already_are_disarmed(printer):
    printer.y[0].error = CommandError("not now")
    with pytest.raises(CommandError, match="not now"):
        homing_move(printer, [printer.x, printer.y], [-100., -100., 0., 0.])
    assert len(printer.x[0].waits) == 1 and not printer.head.moves


def test_refused_move(printer):
    printer.head.drip_error = CommandError("out of range")
    printer.x[0].result = 0.
    with pytest.raises(CommandError, match="Error during homing move: out of range"):
        homing_move(printer, [printer.x], [-100., 0., 0., 0.])
    assert printer.head.position == [0.] * 4
    assert len(printer.x[0].waits) == 1


def test_error_of_a_handler_is_told_after_all_is_done(printer):
    def fail(move):
        raise CommandError("probe is not stowed")
    printer.register_event_handler("homing:homing_move_end", fail)
    with pytest.raises(CommandError, match="not stowed"):
        homing_move(printer, [printer.x], [-100., 0., 0., 0.])
    assert printer.head.position[0] == pytest.approx(-100.02)


def test_rail_is_homed_twice(printer):
    homing = Homing(printer)
    homing.set_axes([0])
    homing.home_rails([Rail(printer.x)], [150., None, None, None],
                      [0., None, None, None])
    head = printer.head
    assert head.homed[0] == "x" and set(head.homed[1:]) == {""}
    assert head.moves == [([0., 0., 0., 0.], 20.), ([5., 0., 0., 0.], 30.),
                          ([0., 0., 0., 0.], 4.)]
    # the second way was taken to begin where there is room for twice the retract
    assert head.position[0] == pytest.approx(-0.02)
    assert homing.get_trigger_position("stepper_x") == printer.x[0].steppers[0].past
    assert homing.get_axes() == [0]
    names = [event[0] for event in printer.events if "rails" in event[0]]
    assert names == ["homing:home_rails_begin", "homing:home_rails_end"]


def test_without_retract_it_is_homed_once(printer, monkeypatch):
    monkeypatch.setattr(Info, "retract_dist", 0.)
    Homing(printer).home_rails([Rail(printer.x)], [150., None, None], [0., None, None])
    assert len(printer.head.moves) == 1


def test_still_triggered_after_retract(printer):
    endstop = printer.x[0]

    def forget(move):
        endstop.at = endstop.stops = 0.
    printer.register_event_handler("homing:homing_move_end", forget)
    with pytest.raises(CommandError, match="stepper_x still triggered after retract"):
        Homing(printer).home_rails([Rail(printer.x)], [150., None, None],
                                   [0., None, None])


def test_handlers_may_adjust_the_position(printer):
    homing = Homing(printer)
    printer.register_event_handler(
        "homing:home_rails_end",
        lambda state, rails: state.set_stepper_adjustment("stepper_x", 0.5))
    homing.home_rails([Rail(printer.x)], [150., None, None], [0., None, None])
    assert printer.head.position[0] == pytest.approx(0.48)


def test_set_homed_position_keeps_what_is_none(printer):
    printer.head.position = [1., 2., 3., 4.]
    Homing(printer).set_homed_position([None, 7., None, None])
    assert printer.head.position == [1., 7., 3., 4.]


def test_probing_move(printer):
    phoming = printer.load("homing")
    assert isinstance(phoming, PrinterHoming)
    assert phoming.probing_move(printer.x[0], [-50., 0., 0., 0.], 5.) == [
        pytest.approx(-5.), 0., 0., 0.]
    printer.x[0].at = 0.
    with pytest.raises(CommandError, match="Probe triggered prior to movement"):
        phoming.probing_move(printer.x[0], [-50., 0., 0., 0.], 5.)


def test_manual_home(printer):
    phoming = printer.load("homing")
    other = Head(printer)
    other.endstops = [Endstop(printer, [other.steppers[1]])]
    phoming.manual_home(other, [(other.endstops[0], "end")], [0., 9., 0., 0.], 5.,
                        True, True)
    assert other.position[1] == pytest.approx(9.02)
    assert printer.head.position == [0.] * 4


def test_shutdown_is_told_as_such(printer):
    phoming = printer.load("homing")
    printer.register_event_handler(
        "homing:homing_move_begin", lambda move: printer.invoke_shutdown("test"))
    with pytest.raises(CommandError, match="Probing failed due to printer shutdown"):
        phoming.probing_move(printer.x[0], [-50., 0., 0., 0.], 5.)


def test_g28_names_axes_and_stops_motors_on_errors(printer):
    printer.load("homing")
    seen, off = [], []
    printer.head.home = lambda state: seen.append(state.get_axes())
    printer.add_object("stepper_enable", type(
        "Enable", (), {"motor_off": lambda self: off.append(True)})())
    printer.gcode.run_script("G28\nG28 X Z0\nG28 Y")
    assert seen == [[0, 1, 2], [0, 2], [1]] and not off

    def fail(state):
        raise CommandError("No trigger")
    printer.head.home = fail
    with pytest.raises(CommandError, match="No trigger"):
        printer.gcode.run_script("G28 X")
    assert off
