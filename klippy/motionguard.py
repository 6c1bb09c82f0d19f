# SPDX-License-Identifier: GPL-3.0-or-later
"""A planned stop for motion whose planner is away.

Behind the part of the plan that is certain the way to rest of all known moves is
laid down provisionally.  If the main thread does not come back in time, a guard
without it makes the steps of both; else the way to rest is taken back.
"""

import itertools
import math

from klippy import motionhold
from klippy_ext.hostclock import HostClock
from klippy_ext.stepguard import StepGuard

# The guard goes on when what is sent reaches less far ahead of the mcu (s)
GUARD_LEAD = 0.15
# So much more than the plan is made, that nothing of it is left behind (s)
END_MARGIN = 0.001


class PlannedStop:
    """The way to rest of the moves that wait in a tool head's look-ahead."""

    def __init__(self, toolhead):
        self.toolhead = toolhead
        self.moves, self.trapqs, self.end = [], [], 0.

    def plan(self):
        """(print_time up to which the plan is certain, that of rest).

        The second is the first if it can not be brought to rest from here.
        """
        toolhead = self.toolhead
        certain = toolhead.print_time
        if toolhead.is_drained:
            return math.inf, certain
        moves = list(toolhead.lookahead.queue)
        trapqs = self._find_trapqs(moves)
        if trapqs is None or any(move.timing_callbacks for move in moves):
            return certain, certain
        toolhead.lookahead.plan_stop()
        for trapq in trapqs:
            trapq.mark()
        self.moves, self.trapqs = moves, trapqs
        self.end = toolhead.append_moves(certain, moves)
        return certain, self.end

    def _find_trapqs(self, moves):
        """The queues of motion that moves go to; None if one is not ours."""
        toolhead = self.toolhead
        trapqs = [toolhead.trapq]
        axes = []
        if any(move.axes_d[3] for move in moves):
            axes.append(toolhead.extruder)
        if any(move.extra for move in moves):
            axes += toolhead.extra_axes[1:]
        known = toolhead.motion_queuing.trapqs
        for axis in axes:
            find = getattr(axis, "get_trapq", None)
            trapq = None if find is None else find()
            if not any(trapq is other for other in known):
                return None
            trapqs.append(trapq)
        return trapqs

    def drop(self):
        """Take it back: the plan goes on instead."""
        for trapq in self.trapqs:
            trapq.rewind()
        self.moves, self.trapqs = [], []

    def adopt(self):
        """It was carried out: the moves that wait start from rest behind it."""
        toolhead = self.toolhead
        toolhead.print_time = self.end
        toolhead.is_drained = toolhead.is_stopped = True
        toolhead.print_stall += 1
        waiting = toolhead.lookahead.restart(len(self.moves))
        for prev, move in itertools.pairwise(waiting):
            move.calc_junction(prev, toolhead.find_extra_v2(prev, move))
        self.moves, self.trapqs = [], []
        toolhead.motion_queuing.note_mcu_movequeue_activity(self.end)
        if waiting:
            toolhead.motion_queuing.await_moves()


class MotionGuard:
    """Has motion go on to its planned stop when nobody disarms it in time."""

    def __init__(self, reactor, mcu):
        self.reactor, self.mcu = reactor, mcu
        clock = getattr(reactor, "clock", None)
        self.guard = StepGuard(clock) if isinstance(clock, HostClock) else None
        self.stop = None
        self.is_armed = self.has_stop = False
        self.certain = 0.
        self.n_stops = 0

    def add(self, sync):
        """Guard the steppers of a StepperSync too."""
        if self.guard is not None:
            self.guard.add(sync)

    def set_stop(self, stop):
        """Who knows the way to rest: a PlannedStop."""
        self.stop = stop

    def disarm(self):
        """print_time up to which steps are made meanwhile; None if not armed."""
        if not self.is_armed:
            return None
        self.is_armed = False
        reached = self.guard.disarm()
        if self.has_stop:
            self.has_stop = False
            if reached > self.certain:
                self.n_stops += 1
                self.stop.adopt()
            else:
                self.stop.drop()
        return reached

    def arm(self, reached, activity_end, window, steppers):
        """Go on behind `reached` if nobody comes back; must be disarmed.

        activity_end: print_time up to which there is motion.  window: s of motion
        around a time that its steps depend on.  steppers: all MCU_stepper.
        """
        if self.guard is None:
            return
        certain, rest = math.inf, 0.
        if self.stop is not None:
            certain, rest = self.stop.plan()
            certain -= window
        self.has_stop = rest > certain + window
        end = max(activity_end, rest + window) + END_MARGIN
        if not self.has_stop:
            end = min(end, certain)
        if (end <= reached + END_MARGIN
                or any(wakes_up(stepper, end) for stepper in steppers)):
            self._give_up()
            return
        now = self.reactor.monotonic()
        lead = reached - self.mcu.estimated_print_time(now)
        self.certain, self.is_armed = certain, True
        self.guard.arm(reached, certain, end, now + lead - GUARD_LEAD,
                       GUARD_LEAD - motionhold.LATE_LEAD)

    def _give_up(self):
        if self.has_stop:
            self.has_stop = False
            self.stop.drop()


def wakes_up(stepper, end):
    """True if somebody must be told before the stepper moves until `end`."""
    return bool(stepper.active_callbacks and stepper.kinematics is not None
                and stepper.kinematics.check_active(end))
