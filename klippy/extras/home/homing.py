# SPDX-License-Identifier: GPL-3.0-or-later
"""Homing: finding where the head is by moving axes to their endstops."""

import contextlib
import math

from klippy import dangers
from klippy.errors import CommandError
from klippy.extras.homing_move import (
    ENDSTOP_SAMPLE_COUNT,
    ENDSTOP_SAMPLE_TIME,
    HOMING_START_DELAY,
    HomingMove,
    StepperPosition,
)

__all__ = ["ENDSTOP_SAMPLE_COUNT", "ENDSTOP_SAMPLE_TIME", "HOMING_START_DELAY",
           "Homing", "HomingMove", "PrinterHoming", "StepperPosition"]


def calc_way_back(start, end, distance):
    """(distance before the end of a way, twice as far), but not before its start.

    A way that begins at the second but is taken from the first leads past the end.
    """
    way = [b - a for a, b in zip(start[:3], end[:3], strict=True)]
    share = min(1., distance / math.hypot(*way))
    return [[a - d * share * times for a, d in zip(end[:3], way, strict=True)]
            + end[3:] for times in (1., 2.)]


class Homing:
    """The state of one G28, which the kinematics carries out."""

    def __init__(self, printer):
        self.printer = printer
        self.toolhead = printer.lookup_object("toolhead")
        self.changed_axes = []
        self.trigger_mcu_pos = {}
        self.adjust_pos = {}

    def set_axes(self, axes):
        """The axes to home: indexes of x, y, z."""
        self.changed_axes = axes

    def get_axes(self):
        """The axes to home."""
        return self.changed_axes

    def get_trigger_position(self, stepper_name):
        """Steps of a stepper at the trigger of the last rail, as its mcu counts."""
        return self.trigger_mcu_pos[stepper_name]

    def set_stepper_adjustment(self, stepper_name, adjustment):
        """Have a stepper so many mm further than its endstop tells.

        For handlers of homing:home_rails_end.
        """
        self.adjust_pos[stepper_name] = adjustment

    def _complete(self, coord):
        """coord with the toolhead's own position for what is None."""
        position = list(self.toolhead.get_position())
        for axis, value in enumerate(coord):
            if value is not None:
                position[axis] = value
        return position

    def set_homed_position(self, pos):
        """Declare the position; None leaves an axis as it is."""
        self.toolhead.set_position(self._complete(pos))

    def home_rails(self, rails, forcepos, movepos):
        """Home rails that share a move from forcepos to movepos.

        forcepos is where the head is taken to be, movepos where it is at the
        trigger (None: not this axis).  Raises CommandError.
        """
        self.printer.send_event("homing:home_rails_begin", self, rails)
        axes = [axis for axis in range(3) if forcepos[axis] is not None]
        start, end = self._complete(forcepos), self._complete(movepos)
        self.toolhead.set_position(
            start, homing_axes="".join("xyz"[axis] for axis in axes))
        endstops = [pair for rail in rails for pair in rail.get_endstops()]
        info = rails[0].get_homing_info()
        # rails of plug-ins may know less
        is_sensorless = getattr(info, "use_sensorless_homing", False)
        with self._accelerating(getattr(info, "accel", None)):
            move = HomingMove(self.printer, endstops)
            move.homing_move(end, info.speed)
            # motors that share axes may have stopped a step apart
            start, end = self._complete(forcepos), self._complete(movepos)
            if is_sensorless:
                move = self._check_way(endstops, info, start, end, move)
            elif info.retract_dist:
                move = self._home_again(endstops, info, start, end)
            self._end_rails(rails, axes, move)
            if is_sensorless and info.retract_dist:
                back = calc_way_back(start, end, info.retract_dist)[0]
                self._go(axes, back, info.retract_speed)

    @contextlib.contextmanager
    def _accelerating(self, accel):
        """Make moves with another acceleration meanwhile (None: as they are)."""
        if accel is None:
            yield
            return
        before = self.toolhead.get_max_velocity()[1]
        self.toolhead.set_max_velocities(max_accel=accel)
        try:
            yield
        finally:
            self.toolhead.set_max_velocities(max_accel=before)

    def _go(self, axes, target, speed):
        """Move axes to where target has them, and the others not at all."""
        position = list(self.toolhead.get_position())
        for axis in axes:
            position[axis] = target[axis]
        self.toolhead.move(position, speed)

    def _check_way(self, endstops, info, start, end, move):
        """Home again from min_home_dist if the way to the end was shorter.

        A motor that is blocked must have turned before.  Returns the HomingMove.
        """
        least = info.min_home_dist
        if move.find_way() >= least:
            return move
        back, far = calc_way_back(start, end, least)
        self.toolhead.move(back, info.retract_speed)
        self.toolhead.set_position(far)
        move = HomingMove(self.printer, endstops)
        move.homing_move(end, info.speed)
        way = move.find_way()
        tolerance = dangers.get(self.printer).homing_elapsed_distance_tolerance
        if abs(way - least) > tolerance:
            raise CommandError(
                "Homing of %s: the end was found after %.3f mm, not after"
                " min_home_dist, %.3f mm: check the current and the sensitivity of its"
                " driver" % (endstops[0][1], way, least))
        return move

    def _home_again(self, endstops, info, start, end):
        """Go back and approach once more, slower; returns the HomingMove."""
        back, far = calc_way_back(start, end, info.retract_dist)
        self.toolhead.move(back, info.retract_speed)
        self.toolhead.set_position(far)
        move = HomingMove(self.printer, endstops)
        move.homing_move(end, info.second_homing_speed)
        name = move.check_no_movement()
        if name is not None:
            raise CommandError("Endstop %s still triggered after retract" % (name,))
        return move

    def _end_rails(self, rails, axes, move):
        """Tell that the rails are homed, and apply the adjustments made then."""
        self.toolhead.flush_step_generation()
        self.trigger_mcu_pos = {moved.stepper_name: moved.trig_pos
                                for moved in move.stepper_positions}
        self.adjust_pos = {}
        self.printer.send_event("homing:home_rails_end", self, rails)
        if not any(self.adjust_pos.values()):
            return
        kinematics = self.toolhead.get_kinematics()
        adjusted = kinematics.calc_position({
            s.get_name(): (s.get_commanded_position()
                           + self.adjust_pos.get(s.get_name(), 0.))
            for s in kinematics.get_steppers()})
        position = list(self.toolhead.get_position())
        for axis in axes:
            if adjusted[axis] is None:
                raise CommandError("Cannot determine position of toolhead on axis %s"
                                   " after homing" % ("xyz"[axis],))
            position[axis] = adjusted[axis]
        self.toolhead.set_position(position)


class PrinterHoming:
    """Object `homing`: G28, and homing moves for others."""

    def __init__(self, config):
        self.printer = config.get_printer()
        gcode = self.printer.lookup_object("gcode")
        gcode.register_command("G28", self.cmd_G28)

    def manual_home(self, toolhead, endstops, pos, speed, triggered=True,
                    check_triggered=True, probe_pos=False):
        """Move toolhead to pos until the endstops trigger; see HomingMove."""
        move = HomingMove(self.printer, endstops, toolhead)
        return self._run("Homing", move, pos, speed, probe_pos=probe_pos,
                         triggered=triggered, check_triggered=check_triggered)

    def probing_move(self, mcu_probe, pos, speed):
        """Move to pos until mcu_probe triggers; returns where that was.

        Raises CommandError, also if it had triggered before the move.
        """
        move = HomingMove(self.printer, [(mcu_probe, "probe")])
        position = self._run("Probing", move, pos, speed, probe_pos=True)
        if move.check_no_movement() is not None:
            raise CommandError("Probe triggered prior to movement")
        return position

    def _run(self, purpose, move, pos, speed, **options):
        try:
            return move.homing_move(pos, speed, **options)
        except CommandError:
            self._check_shutdown(purpose)
            raise

    def _check_shutdown(self, purpose):
        if self.printer.is_shutdown():
            raise CommandError("%s failed due to printer shutdown" % (purpose,))

    def cmd_G28(self, gcmd):
        """Home the axes X Y Z that are named, or all."""
        axes = [axis for axis, letter in enumerate("XYZ")
                if gcmd.get(letter, None) is not None]
        state = Homing(self.printer)
        state.set_axes(axes or [0, 1, 2])
        kinematics = self.printer.lookup_object("toolhead").get_kinematics()
        try:
            kinematics.home(state)
        except CommandError:
            self._check_shutdown("Homing")
            self.printer.lookup_object("stepper_enable").motor_off()
            raise


def load_config(config):
    return PrinterHoming(config)
