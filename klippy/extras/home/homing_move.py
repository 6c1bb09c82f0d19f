# SPDX-License-Identifier: GPL-3.0-or-later
"""One move towards endstops, and where it has ended.

A stepper's way is counted in its steps: at the start, at the time of the
trigger and at rest.  See docs/internals/homing.md.
"""

import math

from klippy import dangers
from klippy.errors import CommandError, PrinterError
from klippy.mcu import MCU_trsync

# A switch counts as closed after so many samples so far apart (s)
ENDSTOP_SAMPLE_TIME = .000015
ENDSTOP_SAMPLE_COUNT = 4
# From arming the endstops to the start of the move
HOMING_START_DELAY = .001


class StepperPosition:
    """Steps of one stepper of a homing move; endstop_name stops it."""

    def __init__(self, stepper, endstop_name):
        self.stepper = stepper
        self.endstop_name = endstop_name
        self.stepper_name = stepper.get_name()
        self.start_pos = stepper.get_mcu_position()
        self.start_cmd_pos = stepper.get_commanded_position()
        self.halt_pos = self.trig_pos = None

    def note_home_end(self, trigger_time):
        """Read the position at rest and that at a print_time."""
        self.halt_pos = self.stepper.get_mcu_position()
        self.trig_pos = self.stepper.get_past_mcu_position(trigger_time)


class HomingMove:
    """endstops: list of (endstop object, name).

    toolhead: what moves; the printer's one by default.
    """

    def __init__(self, printer, endstops, toolhead=None):
        self.printer = printer
        self.endstops = [pair for pair in endstops if pair[0].get_steppers()]
        self.toolhead = toolhead or printer.lookup_object("toolhead")
        self.stepper_positions = []
        self.error = None

    def get_mcu_endstops(self):
        """The endstop objects that take part."""
        return [endstop for endstop, _ in self.endstops]

    def homing_move(self, movepos, speed, probe_pos=False, triggered=True,
                    check_triggered=True):
        """Move to movepos until the endstops trigger; returns where that was.

        probe_pos: the position of the trigger is found from the steps made;
        else movepos is that position, and all the head went on is added.
        triggered: the level to wait for.  check_triggered: to get to the end
        without a trigger is an error.  Raises CommandError; the toolhead's
        position is then that at rest.
        """
        self.error = None
        self.printer.send_event("homing:homing_move_begin", self)
        self.toolhead.flush_step_generation()
        kin_spos = {s.get_name(): s.get_commanded_position()
                    for s in self.toolhead.get_kinematics().get_steppers()}
        self.stepper_positions = [
            StepperPosition(stepper, name) for endstop, name in self.endstops
            for stepper in endstop.get_steppers()]
        finished = self._arm_all(movepos, speed, triggered)
        self._drive(movepos, speed, finished)
        trigger_times = self._await_triggers(check_triggered)
        if self.printer.is_shutdown():
            self._note_error(CommandError("the printer is shut down"))
            self.printer.send_event("homing:homing_move_end", self)
            raise self.error
        trigpos = self._find_positions(movepos, kin_spos, trigger_times, probe_pos)
        self._end()
        return trigpos

    # The move

    def _arm_all(self, movepos, speed, triggered):
        """Watch the endstops; returns a completion for all of them."""
        print_time = self.toolhead.get_last_move_time()
        completions, options = [], dangers.get(self.printer)
        try:
            for endstop, _ in self.endstops:
                rest_time = self._calc_rest_time(endstop, movepos, speed)
                completions.append(endstop.home_start(
                    print_time, options.endstop_sample_time or ENDSTOP_SAMPLE_TIME,
                    options.endstop_sample_count or ENDSTOP_SAMPLE_COUNT,
                    rest_time, triggered=triggered))
        except PrinterError:
            for endstop, _ in self.endstops[:len(completions)]:
                endstop.home_wait(print_time)
            raise
        delay = options.homing_start_delay
        self.toolhead.dwell(HOMING_START_DELAY if delay is None else delay)
        return await_all(self.printer.get_reactor(), completions)

    def _calc_rest_time(self, endstop, movepos, speed):
        """Time of one step of the endstop's fastest stepper."""
        startpos = self.toolhead.get_position()
        length = math.dist(startpos[:3], movepos[:3])
        steps = max(
            abs(s.calc_position_from_coord(startpos) - s.calc_position_from_coord(
                movepos)) / s.get_step_dist() for s in endstop.get_steppers())
        return length / speed / steps if length > 0. and steps >= 1. else .001

    def _drive(self, movepos, speed, finished):
        try:
            self.toolhead.drip_move(movepos, speed, finished)
        except PrinterError as err:
            self._note_error(CommandError("Error during homing move: %s" % (err,)))

    def _await_triggers(self, check_triggered):
        """Disarm all endstops; returns {name: print_time of the trigger}."""
        end_time = self.toolhead.get_last_move_time()
        times = {}
        for endstop, name in self.endstops:
            try:
                trigger_time = endstop.home_wait(end_time)
            except PrinterError as err:
                self._note_error(CommandError("Homing of %s failed: %s" % (name, err)))
                continue
            if trigger_time > 0.:
                times[name] = trigger_time
            elif trigger_time < 0.:
                self._note_error(CommandError(
                    "Communication timeout during homing %s" % (name,)))
            elif check_triggered:
                self._note_error(CommandError(
                    "No trigger on %s after full movement" % (name,)))
        return times

    def _note_error(self, error):
        if self.error is None:
            self.error = error

    def _end(self):
        """Tell all, and raise the first error there was."""
        try:
            self.printer.send_event("homing:homing_move_end", self)
        except CommandError as err:
            self._note_error(err)
        if self.error is not None:
            raise self.error

    def find_way(self):
        """How far (mm) the stepper that went furthest was moved to the trigger."""
        return max(abs(moved.trig_pos - moved.start_pos) * moved.stepper.get_step_dist()
                   for moved in self.stepper_positions)

    # Where it has ended

    def _find_positions(self, movepos, kin_spos, trigger_times, probe_pos):
        """Set the toolhead's position to that at rest; returns the trigger's."""
        self.toolhead.flush_step_generation()
        end_time = self.toolhead.get_last_move_time()
        for stepper in {moved.stepper_name: moved.stepper
                        for moved in self.stepper_positions}.values():
            stepper.note_homing_end()
        for moved in self.stepper_positions:
            moved.note_home_end(trigger_times.get(moved.endstop_name, end_time))
        if probe_pos or self.error is not None:
            trigpos = self.calc_toolhead_pos(kin_spos, self._count_steps(
                lambda moved: moved.trig_pos - moved.start_pos))
            haltpos = self.calc_toolhead_pos(kin_spos, self._count_steps(
                lambda moved: moved.halt_pos - moved.start_pos))
        else:
            trigpos = haltpos = list(movepos)
            overshoot = self._count_steps(
                lambda moved: moved.halt_pos - moved.trig_pos)
            if any(overshoot.values()):
                at_trigger = {
                    s.get_name(): s.calc_position_from_coord(movepos)
                    for s in self.toolhead.get_kinematics().get_steppers()}
                haltpos = self.calc_toolhead_pos(at_trigger, overshoot)
        self.toolhead.set_position(haltpos)
        return trigpos

    def _count_steps(self, count):
        return {moved.stepper_name: count(moved) for moved in self.stepper_positions}

    def calc_toolhead_pos(self, kin_spos, offsets):
        """Position for steppers at kin_spos (mm by name) plus offsets (steps)."""
        kinematics = self.toolhead.get_kinematics()
        positions = dict(kin_spos)
        for stepper in kinematics.get_steppers():
            name = stepper.get_name()
            positions[name] += offsets.get(name, 0) * stepper.get_step_dist()
        position = list(self.toolhead.get_position())
        for axis, value in enumerate(kinematics.calc_position(positions)):
            if value is not None:
                position[axis] = value
        return position

    def check_no_movement(self):
        """Name of an endstop that triggered before any step, else None."""
        if self.printer.get_start_args().get("debuginput") is not None:
            return None
        for moved in self.stepper_positions:
            if moved.start_pos == moved.trig_pos:
                return moved.endstop_name
        return None


def await_all(reactor, completions):
    """A completion that is set when all are, or one of them tells of a failure.

    A failure is an MCU_trsync reason from REASON_COMMS_TIMEOUT on.
    """
    if len(completions) == 1:
        return completions[0]

    def wait(eventtime):
        for completion in completions:
            if is_failure(completion.wait()):
                break

    return reactor.register_callback(wait)


def is_failure(result):
    """Whether the result of an endstop's completion is a failure's reason."""
    return not isinstance(result, bool) and (
        isinstance(result, int) and result >= MCU_trsync.REASON_COMMS_TIMEOUT)
