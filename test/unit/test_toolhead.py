# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool head of a whole printer on a simulated machine."""

import machine_configs
import pytest
from printer_run import PrinterRun

from klippy.errors import PrinterError

EXTRA = machine_configs.BED + "\n[force_move]\nenable_force_move: True\n"
PLACE = "SET_KINEMATIC_POSITION X=100 Y=100 Z=5\nG90\nM83\n"


@pytest.fixture
def run_body(tmp_path):
    """run_body(body, *parts): run parts, then body(toolhead, run); its result."""
    def run(body, *parts):
        result = []

        class Run(PrinterRun):
            def _note_rest(self):
                super()._note_rest()
                if len(self.snapshots) == len(self.parts):
                    toolhead = self.printer.lookup_object("toolhead")
                    result.append(body(toolhead, self))
        Run(machine_configs.make_axes("cartesian", 0.04, EXTRA), tmp_path).run(
            [PLACE, *parts])
        return result[0]
    return run


def test_moves_take_the_time_of_their_trapezoids(run_body):
    def body(toolhead, run):
        start = toolhead.get_last_move_time()
        toolhead.manual_move([140., None], 100.)
        end = toolhead.get_last_move_time()
        assert toolhead.get_position() == [140., 100., 5., 0.]
        return end - start
    # 40 mm at 100 mm/s, with ramps of 4000 mm/s^2
    assert run_body(body) == pytest.approx(0.4 + 100. / 4000.)


def test_dwell_and_timing_callbacks(run_body):
    def body(toolhead, run):
        times = []
        toolhead.register_lookahead_callback(times.append)
        start = toolhead.get_last_move_time()
        assert times == [pytest.approx(start)]
        toolhead.move([110., 100., 5., 0.], 50.)
        toolhead.register_lookahead_callback(times.append)
        assert len(times) == 1
        toolhead.move([120., 100., 5., 0.], 50.)
        end = toolhead.get_last_move_time()
        # the first move does not slow down: half the cruise, one ramp
        assert times[1] - start == pytest.approx(0.2 + 0.5 * 50. / 4000.)
        toolhead.dwell(1.5)
        assert toolhead.get_last_move_time() == pytest.approx(end + 1.5)
        return True
    assert run_body(body)


def test_gcode_waits_while_the_plan_is_far_ahead(run_body):
    leads = []

    def body(toolhead, run):
        reactor = run.printer.get_reactor()
        for i in range(200):
            toolhead.move([100. + i % 2 * 20., 100., 5., 0.], 100.)
            print_time, estimate, _ = toolhead.check_busy(reactor.monotonic())
            leads.append(print_time - estimate)
        return toolhead.get_status(reactor.monotonic())["stalls"]
    assert run_body(body) == 0
    assert 2.4 < max(leads) < 3.6 and min(leads[60:]) > 2.3


def test_lone_move_is_made_without_being_asked_for(run_body):
    def body(toolhead, run):
        reactor, before = run.printer.get_reactor(), run.machine.get_step_counts()
        toolhead.move([102., 100., 5., 0.], 50.)
        assert not toolhead.check_busy(reactor.monotonic())[2]
        reactor.pause(reactor.monotonic() + 1.)
        after = run.machine.get_step_counts()
        assert toolhead.check_busy(reactor.monotonic())[2]
        return after["stepper_x"] - before["stepper_x"]
    assert run_body(body) == 160


def test_set_position_moves_nothing(run_body):
    def body(toolhead, run):
        before = run.machine.get_step_counts()
        toolhead.set_position([10., 20., 3., 7.], "xyz")
        assert toolhead.get_position() == [10., 20., 3., 7.]
        assert toolhead.commanded_pos == [10., 20., 3., 7.]
        toolhead.commanded_pos = [10., 20., 3., 0.]
        toolhead.wait_moves()
        assert run.machine.get_step_counts() == before
        return toolhead.get_status(0.)["homed_axes"]
    assert run_body(body) == "xyz"


def test_refused_move_leaves_the_position(run_body):
    def body(toolhead, run):
        with pytest.raises(PrinterError, match="500.000"):
            toolhead.move([500., 100., 5., 0.], 50.)
        assert toolhead.get_position() == [100., 100., 5., 0.]
        toolhead.move([101., 100., 5., 0.], 50.)
        return toolhead.get_position()[0]
    assert run_body(body) == 101.


class Axis:
    """An axis beyond the extruder."""

    def __init__(self):
        self.checked, self.moves = [], []

    def get_name(self):
        return "axis"

    def get_axis_gcode_id(self):
        return "A"

    def check_move(self, move, axis_index):
        self.checked.append((axis_index, move.axes_d[axis_index]))

    def calc_junction(self, prev_move, move, axis_index):
        return 25.

    def process_move(self, print_time, move, axis_index):
        end_v = move.cruise_v - move.accel * move.decel_t
        self.moves.append((axis_index, move.axes_r[axis_index], end_v))


def test_extra_axis_goes_along(run_body):
    def body(toolhead, run):
        axis = Axis()
        toolhead.add_extra_axis(axis, 1.)
        assert toolhead.get_position() == [100., 100., 5., 0., 1.]
        toolhead.move([120., 100., 5., 0., 11.], 50.)
        toolhead.move([140., 100., 5., 0., 21.], 50.)
        toolhead.wait_moves()
        assert axis.checked == [(4, 10.), (4, 10.)]
        assert [m[:2] for m in axis.moves] == [(4, 0.5), (4, 0.5)]
        assert axis.moves[0][2] == pytest.approx(5.)
        assert toolhead.get_status(0.)["extra_axes"]["axis"] == 4
        toolhead.remove_extra_axis(axis)
        return toolhead.get_position()
    assert run_body(body) == [140., 100., 5., 0.]


def extrude(toolhead):
    for x in (110., 120.):
        toolhead.move([x, 100., 5., x / 1000.], 50.)
    toolhead.get_last_move_time()


def test_an_extruder_of_another_class_is_called_by_name(run_body):
    def body(toolhead, run):
        extruder, asked = toolhead.get_extruder(), []

        class Other:
            def __getattr__(self, name):
                asked.append(name)
                return getattr(extruder, name)
        toolhead.extruder = Other()
        extrude(toolhead)
        toolhead.extruder = extruder
        return asked
    assert {"check_move", "calc_junction", "process_move"} <= set(run_body(body))


def test_a_method_of_the_extruder_may_be_replaced(run_body):
    def body(toolhead, run):
        extruder, asked = toolhead.get_extruder(), []

        def check_move(move, axis_index):
            asked.append(axis_index)
        extruder.check_move = check_move
        extrude(toolhead)
        return asked
    assert run_body(body) == [3, 3]


def test_limits_by_command(run_body):
    def body(toolhead, run):
        status = toolhead.get_status(0.)
        return (toolhead.get_max_velocity(), status["minimum_cruise_ratio"],
                status["square_corner_velocity"])
    assert run_body(body, "SET_VELOCITY_LIMIT VELOCITY=123 MINIMUM_CRUISE_RATIO=0.2\n"
                    "SET_VELOCITY_LIMIT SQUARE_CORNER_VELOCITY=7\n"
                    "M204 P900 T800\n") == ((123., 800.), 0.2, 7.)


def test_bad_limits_are_refused(run_body):
    with pytest.raises(PrinterError, match="MINIMUM_CRUISE_RATIO"):
        run_body(lambda toolhead, run: None, "SET_VELOCITY_LIMIT"
                 " MINIMUM_CRUISE_RATIO=1\n")
