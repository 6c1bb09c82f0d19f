# SPDX-License-Identifier: GPL-3.0-or-later
"""When the motion queue makes steps and lets messages go."""

import math

import pytest

from klippy.motionqueue import MotionQueue, get
from klippy_ext.kin_extruder import ExtruderKinematics
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.trapq import TrapMove

LEAD = 0.60


class Mcu:
    """A clock: print_time is the reactor's time less 100 s."""

    def __init__(self, reactor, is_file=False):
        self.reactor, self.is_file = reactor, is_file
        self.movequeue_callbacks = []

    def estimated_print_time(self, eventtime):
        return eventtime - 100.

    def is_fileoutput(self):
        return self.is_file

    def register_movequeue_callback(self, callback):
        self.movequeue_callbacks.append(callback)


class Printer:
    """What the motion queue asks of a printer, and of a config of it."""

    def __init__(self, reactor, is_file=False):
        self.reactor, self.mcu = reactor, Mcu(reactor, is_file)
        self.objects = {"mcu": self.mcu}
        self.handlers = {}

    def get_printer(self):
        return self

    def get_reactor(self):
        return self.reactor

    def lookup_object(self, name):
        return self.objects[name]

    def register_event_handler(self, event, callback):
        self.handlers[event] = callback


class Stepper:
    """A stepper that only knows how it moves."""

    def __init__(self, mcu, kinematics):
        self.mcu, self.kinematics, self.stepcompress = mcu, kinematics, object()
        self.checked = []

    def get_mcu(self):
        return self.mcu

    def check_active(self, print_time):
        self.checked.append(print_time)


class Flushes(list):
    """Notes the times of the flushes of a queue."""

    def __init__(self, queue, is_planner=False):
        self.reactor, self.wants_more = queue.reactor, False
        queue.register_flush_callback(self.note, can_add_trapq=is_planner)

    def note(self, flush_time, step_gen_time):
        self.append((flush_time, step_gen_time))
        return self.wants_more


@pytest.fixture
def queue(reactor):
    printer = Printer(reactor)
    printer.objects["motion_queuing"] = MotionQueue(printer)
    return get(printer)


def run_for(reactor, seconds):
    """Let virtual time pass."""
    reactor.pause(reactor.monotonic() + seconds)


def add_move(trapq, start, duration):
    move = TrapMove()
    move.cruise_t, move.start_v, move.cruise_v = duration, 10., 10.
    move.axes_r_x = 1.
    trapq.append(start, move)


def test_steps_are_made_in_chunks_behind_the_plan(queue):
    flushes = Flushes(queue)
    for i in range(1, 101):
        queue.advance(0.01 * i)
    times = [step_time for _, step_time in flushes]
    assert times == pytest.approx([0.25, 0.5, 0.75, 1.0], abs=0.0101)
    assert all(b - a >= 0.25 for a, b in zip(times, times[1:], strict=False))


def test_chunks_stay_clear_of_motion_that_may_change(queue):
    drive = ExtruderKinematics()
    drive.set_pressure_advance(0., 0.05, 0.2)
    queue.add_stepper(Stepper(queue.mcu, LinearKinematics(1, 0, 0)))
    queue.check_scan_windows()
    assert queue.get_kin_flush_delay() == 0.
    queue.set_kinematics(Stepper(queue.mcu, None))
    queue.add_stepper(Stepper(queue.mcu, drive))
    queue.check_scan_windows()
    assert queue.get_kin_flush_delay() == 0.1
    flushes = Flushes(queue)
    queue.advance(1.)
    assert flushes == [(0.9, 0.9)]
    queue.reserve_scan_window(0.05)
    assert queue.get_kin_flush_delay() == 0.1
    queue.reserve_scan_window(0.15)
    assert queue.get_kin_flush_delay() == 0.15


def test_a_reserved_window_stays_until_it_is_released(queue):
    wide, wider = queue.reserve_scan_window(0.2), queue.reserve_scan_window(0.3)
    queue.check_scan_windows()
    assert queue.get_kin_flush_delay() == 0.3
    queue.release_scan_window(wider)
    assert queue.get_kin_flush_delay() == 0.2
    queue.release_scan_window(wide)
    assert queue.get_kin_flush_delay() == 0.


def test_timer_makes_the_end_of_the_plan_just_in_time(queue, reactor):
    flushes = Flushes(queue)
    queue.note_mcu_movequeue_activity(2.)
    run_for(reactor, 3.)
    assert flushes[-1] == (2., 2.)
    assert [flush for flush, _ in flushes] == pytest.approx(
        [0.1 * i + LEAD for i in range(len(flushes) - 1)] + [2.])
    count = len(flushes)
    run_for(reactor, 2.)
    assert len(flushes) == count and not queue.is_armed


def test_messages_without_steps_do_not_end_motion(queue, reactor):
    flushes = Flushes(queue)
    queue.note_mcu_movequeue_activity(1., is_step_gen=False)
    run_for(reactor, 2.)
    assert flushes[-1] == (1., 0.)
    assert queue.calc_step_gen_restart(0.5) == pytest.approx(0.6)


def test_planner_is_asked_before_its_plan_runs_out(queue, reactor):
    planner, flushes = Flushes(queue, is_planner=True), Flushes(queue)
    planner.wants_more = True
    queue.await_moves()
    assert planner == []
    run_for(reactor, 0.55)
    # first after the time to collect moves, then with every turn of the timer
    assert [time for time, _ in planner] == pytest.approx(
        [0.1 * i + LEAD + 0.1 for i in range(5)])
    assert flushes == []
    planner.wants_more = False
    run_for(reactor, 1.)
    assert len(planner) == 6


def test_flush_all_reaches_the_end_and_restart_is_later(queue):
    planner, flushes = Flushes(queue, is_planner=True), Flushes(queue)
    queue.reserve_scan_window(0.02)
    queue.note_mcu_movequeue_activity(1.5)
    queue.flush_all_steps()
    assert planner == [(math.inf, math.inf)] and flushes == [(1.52, 1.52)]
    assert queue.calc_step_gen_restart(0.) == pytest.approx(1.54)
    assert queue.calc_step_gen_restart(5.) == pytest.approx(5.12)
    queue.flush_all_steps()
    assert len(flushes) == 1


def test_callbacks_can_be_taken_back(queue):
    flushes = Flushes(queue)
    queue.unregister_flush_callback(flushes.note)
    queue.advance(1.)
    assert flushes == []


def test_steppers_hear_of_motion_before_steps(queue):
    stepper = Stepper(queue.mcu, LinearKinematics(1, 0, 0))
    queue.add_stepper(stepper)
    queue.advance(1.)
    queue.advance(1.1)
    queue.advance(1.3)
    assert stepper.checked == [1., 1.3]
    assert len(queue.mcu.movequeue_callbacks) == 1


def test_old_motion_is_kept_for_reports_only_so_long(queue, reactor):
    trapq = queue.allocate_trapq()
    add_move(trapq, 1., 0.5)
    add_move(trapq, 40., 0.5)
    queue.advance(41.)
    assert [m[0] for m in trapq.extract_old(10, 0., 50.)] == [40., 1.]
    run_for(reactor, 45.)
    queue.advance(45.)
    assert [m[0] for m in trapq.extract_old(10, 0., 50.)] == [40.]


def drip(queue, reactor, run_in_reactor, stop_after):
    """Drip a move of 1 s; returns (time, step time) of the flushes."""
    seen = []
    queue.register_flush_callback(
        lambda flush, step: seen.append((reactor.monotonic() - 100., step)))
    completion = reactor.completion()
    if stop_after is not None:
        reactor.register_callback(lambda e: completion.complete(True),
                                  reactor.monotonic() + stop_after)
    run_in_reactor(lambda: queue.drip_update_time(0.25, 1.25, completion))
    return seen


def test_drip_makes_little_ahead(queue, reactor, run_in_reactor):
    seen = drip(queue, reactor, run_in_reactor, None)
    assert seen[-1][1] == pytest.approx(1.25)
    steps = [step for _, step in seen]
    assert all(b - a <= 0.05 + 1e-9 for a, b in zip(steps, steps[1:], strict=False))
    assert all(step - now <= 0.15 + 1e-9 for now, step in seen[1:])


def test_drip_stops_with_its_completion(queue, reactor, run_in_reactor):
    seen = drip(queue, reactor, run_in_reactor, 0.6)
    assert 0.6 <= seen[-1][1] <= 0.75
    assert reactor.monotonic() == pytest.approx(100.6, abs=0.051)


def test_drip_does_not_wait_for_less_than_the_clock_can_tell(
        queue, reactor, run_in_reactor):
    calls = []

    def estimate(eventtime):
        calls.append(eventtime)
        assert len(calls) < 1000, "waits without end for a moment that is now"
        return eventtime - 100. - 5e-15
    queue.mcu.estimated_print_time = estimate
    assert drip(queue, reactor, run_in_reactor, None)[-1][1] == pytest.approx(1.25)


def test_shutdown_ends_it(queue, reactor):
    flushes = Flushes(queue)
    queue.note_mcu_movequeue_activity(5.)
    run_for(reactor, 0.15)
    count = len(flushes)
    queue.printer.handlers["klippy:shutdown"]()
    run_for(reactor, 2.)
    queue.note_mcu_movequeue_activity(9.)
    run_for(reactor, 2.)
    assert len(flushes) == count


def test_file_output_has_no_timer_and_no_drip(reactor, run_in_reactor):
    queue = MotionQueue(Printer(reactor, is_file=True))
    flushes = Flushes(queue)
    queue.note_mcu_movequeue_activity(5.)
    run_for(reactor, 2.)
    assert flushes == []
    run_in_reactor(lambda: queue.drip_update_time(5., 6., reactor.completion()))
    assert flushes == [(6., 6.)]
    queue.note_mcu_movequeue_activity(7.)
    queue.printer.handlers["gcode:debuginput_exit"]()
    assert flushes[-1] == (7., 7.)


def test_file_output_plans_on_while_steps_are_made(reactor):
    queue = MotionQueue(Printer(reactor, is_file=True))
    trapq, flushes = queue.allocate_trapq(), Flushes(queue)
    add_move(trapq, 0., 10.)
    queue.advance(1.9)
    assert flushes == [] and queue.in_making is None
    queue.advance(2.)
    assert flushes == [(2., 2.)] and queue.in_making is not None
    queue.settle()
    assert queue.in_making is None
    queue.advance(4.)
    queue.flush_all_steps()
    assert flushes == [(2., 2.), (4., 4.)] and queue.in_making is None


def test_wiped_motion_ends_where_steps_are_made(queue):
    trapq = queue.allocate_trapq()
    add_move(trapq, 1., 2.)
    queue.advance(1.5)
    assert queue.last_step_gen_time == 1.5
    queue.wipe_trapq(trapq)
    rest, *_ = trapq.extract_old(1, 0., 10.)
    assert rest[4] == pytest.approx(5.)
    motor = LinearKinematics(1, 0, 0)
    motor.set_trapq(trapq)
    motor.set_stepcompress(None, 0.1)
    motor.generate_steps(4.)
    assert motor.get_commanded_pos() == pytest.approx(5., abs=0.06)
