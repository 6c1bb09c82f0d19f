# SPDX-License-Identifier: GPL-3.0-or-later
"""When planned motion becomes steps, and when messages leave for the mcus.

While moves stream in, steps are made behind the planner in chunks; what is at
the end of the plan is made just in time by a timer, so that moves which come
later can go on where the plan ends.  See docs/internals/motion.md.
"""

import math
import os

from klippy import motionhold
from klippy.motionguard import MotionGuard
from klippy_ext.steppersync import StepperSync
from klippy_ext.steppool import StepPool
from klippy_ext.trapq import TrapQ

# Steps are made in chunks of at least so long (s of motion); into a file, where
# nobody waits for them, of
CHUNK_TIME = 0.25
FILE_CHUNK_TIME = 2.
# So many threads at most share the work: more than steppers that move at once
MAX_THREADS = 4
# The timer works so far ahead of the mcu (s), and so often (s): the last steps
# are with the mcu in time if the link is out for 0.3 s just then
BACKGROUND_LEAD = 0.60
# A timer that is late itself lets those who bring moves go first, as long as what
# is sent reaches so far (s)
LATE_TIMER_LEAD = 0.30
BACKGROUND_PERIOD = 0.10
# A timer that has to wait for moves to plan first waits so long (s)
PRIME_TIME = 0.10
# After steps were made to the very end, motion restarts so far ahead (s)
RESTART_LEAD = 0.10
# Homing: steps are made in pieces of so long, so far ahead of the mcu (s)
DRIP_PIECE = 0.050
DRIP_LEAD = 0.100
# What is flushed reaches so far behind the last step that is due (s): more than
# its time is shifted for the mcu's sake
END_MARGIN = 0.000025
# A wait shorter than this is none: so little does not move the clock at all
MIN_WAIT = 0.000001
# Old motion is kept for reports so long (s)
HISTORY_TIME = 30.


def get(printer):
    """The printer's MotionQueue."""
    return printer.lookup_object("motion_queuing")


def count_cores():
    """Processors that this process may run on."""
    return len(os.sched_getaffinity(0))


class McuMotion:
    """The motion of one mcu: its steppers, and other users of its move queue."""

    def __init__(self, mcu, guard):
        self.mcu, self.guard = mcu, guard
        self.gen_time, self.clocks = 0., (0, 0)
        self.steppers = []
        self.emitters = []
        self.sync = None
        mcu.register_movequeue_callback(self._start)

    def _start(self, serialqueue, move_count):
        self.sync = StepperSync(serialqueue, move_count)
        self.guard.add(self.sync)
        for stepper in self.steppers:
            self.sync.add(stepper.stepcompress, stepper.kinematics)
        for emitter in self.emitters:
            self.sync.add(emitter)

    def add_stepper(self, stepper):
        """Make steps for this one too."""
        self.steppers.append(stepper)
        if self.sync is not None:
            self.sync.add(stepper.stepcompress, stepper.kinematics)

    def add_emitter(self, stepcompress):
        """Merge the messages of this StepCompress with those of the steppers."""
        self.emitters.append(stepcompress)
        if self.sync is not None:
            self.sync.add(stepcompress)

    def set_kinematics(self, stepper):
        """The stepper has other kinematics now."""
        if self.sync is not None:
            self.sync.set_kinematics(stepper.stepcompress, stepper.kinematics)

    def prepare(self, eventtime, last_time, ramp):
        """Keep the mcu's clock; make the steps of ramp, which come first.

        ramp: pieces of a motionhold.Ramp.  last_time: print_time.
        """
        if self.sync is None:
            return
        mcu = self.mcu
        offset, freq = mcu.calibrate_clock(last_time, eventtime)
        # Half of it: the window of a step's time ends earlier by all of it
        offset += 0.5 * mcu.get_step_latency()
        for shift, pace, end in ramp:
            self.sync.set_time(shift + (offset + mcu.get_hold()) * pace, freq / pace)
            self.sync.generate(end)
        self.sync.set_time(offset, freq)

    def start(self, pool, flush_time, step_gen_time, clear_time):
        """Ask a StepPool for the steps that are due; times are print_times."""
        if self.sync is None:
            return
        mcu = self.mcu
        # A step at the very end belongs to it, too
        self.clocks = (max(0, mcu.print_time_to_clock(flush_time + END_MARGIN)),
                       max(0, mcu.print_time_to_clock(clear_time)))
        self.gen_time = step_gen_time
        self.sync.start(pool, step_gen_time, self.clocks[0])

    def finish(self):
        """Send what start() has asked for, which is made."""
        if self.sync is not None:
            self.sync.finish(self.gen_time)
            self.sync.flush(*self.clocks)


class MotionQueue:
    """Turns planned motion into messages in time; printer object motion_queuing."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.reactor = self.printer.get_reactor()
        self.mcu = self.printer.lookup_object("mcu")
        self.guard = MotionGuard(self.reactor, self.mcu)
        self.pool = StepPool(min(count_cores(), MAX_THREADS) - 1)
        self.is_file = self.mcu.is_fileoutput()
        self.chunk_time = FILE_CHUNK_TIME if self.is_file else CHUNK_TIME
        self.members = {}                # MCU -> McuMotion
        # (step_gen_time, clear_time) of steps in the making, or None
        self.in_making = None
        self.trapqs = []
        self.flush_callbacks = []        # (callback, can_add_trapq)
        self.kin_flush_delay = 0.
        self.reserved_windows, self.n_reserved = {}, 0
        self.last_flush_time = self.last_step_gen_time = 0.
        # Until when there is something to send, and to make steps of
        self.activity_time = self.step_activity_time = 0.
        self.is_armed = False
        self.due_time = 0.               # of the timer, eventtime
        self.is_halted = False
        # Motion goes on behind what is made into steps
        self.is_moving = False
        self.ramp = None
        self.n_holds = 0
        self.report = motionhold.LateReport(self.printer)
        self.is_dripping = False
        self.timer = self.reactor.register_timer(self._handle_timer)
        register = self.printer.register_event_handler
        register("klippy:shutdown", self._handle_shutdown)
        register("gcode:debuginput_exit", self.flush_all_steps)

    # Set-up

    def allocate_trapq(self):
        """A new TrapQ, which is kept tidy from now on."""
        self.trapqs.append(TrapQ())
        return self.trapqs[-1]

    def _find_member(self, mcu):
        if mcu not in self.members:
            self.members[mcu] = McuMotion(mcu, self.guard)
        return self.members[mcu]

    def add_stepper(self, stepper):
        """Make steps for an MCU_stepper."""
        self._find_member(stepper.get_mcu()).add_stepper(stepper)

    def add_emitter(self, mcu, stepcompress):
        """Send the queued messages of something that is not a stepper."""
        self._find_member(mcu).add_emitter(stepcompress)

    def set_kinematics(self, stepper):
        """An MCU_stepper has other kinematics now."""
        self._find_member(stepper.get_mcu()).set_kinematics(stepper)
        self.check_scan_windows()

    def check_scan_windows(self):
        """Find out how much motion around a time its steps depend on."""
        windows = [max(s.kinematics.scan_window()) for m in self.members.values()
                   for s in m.steppers if s.kinematics is not None]
        self.kin_flush_delay = max([*windows, *self.reserved_windows.values()],
                                   default=0.)

    def reserve_scan_window(self, window):
        """Steps will depend on so many s of motion, once the plan gets there.

        Returns a number for release_scan_window(), to be called when they do.
        """
        self.n_reserved += 1
        self.reserved_windows[self.n_reserved] = window
        self.kin_flush_delay = max(self.kin_flush_delay, window)
        return self.n_reserved

    def release_scan_window(self, number):
        """A reserved window is one of the kinematics now, or not needed."""
        del self.reserved_windows[number]
        self.check_scan_windows()

    # Old name of the same
    check_step_generation_scan_windows = check_scan_windows

    def get_kin_flush_delay(self):
        """s of motion around a time that steps depend on, at most."""
        return self.kin_flush_delay

    def register_flush_callback(self, callback, can_add_trapq=False):
        """Call callback(flush_time, step_gen_time) before messages are sent.

        can_add_trapq: called first, also when the plan may run out; it may plan.
        """
        self.flush_callbacks.append((callback, can_add_trapq))

    def unregister_flush_callback(self, callback):
        """Undo register_flush_callback()."""
        self.flush_callbacks = [
            entry for entry in self.flush_callbacks if entry[0] != callback]

    # Activity

    def note_mcu_movequeue_activity(self, mq_time, is_step_gen=True):
        """Something happens until mq_time (print_time): send it in time."""
        if is_step_gen:
            mq_time += self.kin_flush_delay
            self.step_activity_time = max(self.step_activity_time, mq_time)
        if mq_time > self.activity_time:
            self.activity_time = mq_time
        if not self.is_armed:
            self._arm(self.reactor.NOW)

    def await_moves(self):
        """Moves wait for others: plan them soon, if none comes."""
        if not self.is_armed:
            self._arm(self.reactor.monotonic() + PRIME_TIME)

    def _arm(self, waketime):
        if not self.is_halted and not self.mcu.is_fileoutput():
            self.is_armed = True
            self.due_time = max(waketime, self.reactor.monotonic())
            self.reactor.update_timer(self.timer, waketime)

    def _handle_timer(self, eventtime):
        if self.is_halted:
            return self.reactor.NEVER
        is_late = eventtime - self.due_time > BACKGROUND_PERIOD
        lead = LATE_TIMER_LEAD if is_late else BACKGROUND_LEAD
        horizon = self.mcu.estimated_print_time(eventtime) + lead
        is_waiting = self._let_plan(horizon)
        target = min(horizon, self.activity_time)
        if target > self.last_flush_time:
            self._flush(target, min(target, self.step_activity_time))
        if not self.guard.is_armed:
            self.watch()
        if self.last_flush_time >= self.activity_time and not is_waiting:
            self.is_armed = False
            return self.reactor.NEVER
        self.due_time = eventtime + BACKGROUND_PERIOD
        return self.due_time

    def _let_plan(self, horizon):
        """Have planners finish what is due; True if moves wait nevertheless."""
        is_waiting = False
        for callback, can_add_trapq in self.flush_callbacks:
            if can_add_trapq and callback(horizon, horizon):
                is_waiting = True
        return is_waiting

    # Flushes

    def advance(self, print_time):
        """The plan reaches to print_time, and may go on from there."""
        target = print_time - self.kin_flush_delay
        if target - self.last_step_gen_time < self.chunk_time:
            self.watch()
        elif self.is_file:
            # Planning goes on meanwhile; settle() ends it
            self._start_flush(target, target)
        else:
            self._flush(target, target)

    def flush_all_steps(self):
        """Make and send everything to the end of the plan, where motion rests."""
        for callback, can_add_trapq in self.flush_callbacks:
            if can_add_trapq:
                callback(math.inf, math.inf)
        if self.activity_time > self.last_flush_time:
            self._flush(self.activity_time, self.step_activity_time)
        self.settle()

    def _flush(self, flush_time, step_gen_time):
        self._start_flush(flush_time, step_gen_time)
        self._finish_flush()
        self.watch()

    def _start_flush(self, flush_time, step_gen_time):
        """Have steps made by threads until _finish_flush()."""
        self.settle()
        flush_time = max(flush_time, self.last_flush_time)
        step_gen_time = max(step_gen_time, self.last_step_gen_time)
        self.hold_if_late(self.is_moving)
        for callback, can_add_trapq in list(self.flush_callbacks):
            if not can_add_trapq:
                callback(flush_time, step_gen_time)
        eventtime = self.reactor.monotonic()
        clear_time = self._calc_clear_time(eventtime, flush_time)
        for member in self.members.values():
            for stepper in member.steppers:
                stepper.check_active(step_gen_time)
        ramp = self._list_ramp(step_gen_time)
        for member in self.members.values():
            member.prepare(eventtime, self.last_step_gen_time, ramp)
        for member in self.members.values():
            member.start(self.pool, flush_time, step_gen_time, clear_time)
        self.in_making = (step_gen_time - self.kin_flush_delay, clear_time)
        self.last_flush_time = flush_time
        self.last_step_gen_time = step_gen_time
        self.is_moving = self.step_activity_time > step_gen_time
        self.pool.start()

    def _finish_flush(self):
        """Send the messages of steps in the making, if there are any."""
        if self.in_making is None:
            return
        in_making, self.in_making = self.in_making, None
        self.pool.finish()
        for member in self.members.values():
            member.finish()
        for trapq in self.trapqs:
            trapq.finalize(*in_making)

    # A late host

    def set_planned_stop(self, stop):
        """Bring motion to rest by a motionguard.PlannedStop when nobody plans."""
        self.guard.set_stop(stop)

    def watch(self):
        """Have motion go on to its planned stop if nobody comes back in time.

        To be called after the plan has changed, which begins with settle().
        """
        if (self.is_halted or self.is_dripping or self.ramp is not None
                or self.mcu.is_fileoutput()):
            return
        self.guard.arm(self.last_step_gen_time, self.step_activity_time,
                       self.kin_flush_delay,
                       [s for m in self.members.values() for s in m.steppers])

    def settle(self):
        """Take over from the guard and from threads that make steps.

        What the guard did is part of the plan now.
        """
        self._finish_flush()
        n_stops = self.guard.n_stops
        reached = self.guard.disarm()
        if self.guard.n_stops > n_stops:
            self.report.note("motion came to a planned stop")
        if reached is not None and reached > self.last_step_gen_time:
            self.last_step_gen_time = reached
            self.last_flush_time = max(self.last_flush_time, reached)
            self.is_moving = self.step_activity_time > reached

    def hold_if_late(self, is_moving):
        """Hold print_time if motion that is under way cannot go on in time.

        is_moving: whether there is any behind what is made into steps.
        """
        self.settle()
        if not is_moving or self.is_halted or self.mcu.is_fileoutput():
            return
        now = self.mcu.estimated_print_time(self.reactor.monotonic())
        lead = self.last_step_gen_time - now
        if lead >= motionhold.LATE_LEAD or self.is_dripping:
            return
        hold = self.mcu.get_hold()
        ramp = self.ramp = motionhold.Ramp(
            self.last_step_gen_time, now + hold + motionhold.RESUME_LEAD)
        self.mcu.add_hold(ramp.calc_hold() - hold)
        self.n_holds += 1
        self.report.note("motion stood still for %.1f s" % (
            motionhold.LATE_LEAD - lead,))
        self.printer.send_event("motion_queuing:hold", ramp.calc_hold() - hold)

    def _list_ramp(self, step_gen_time):
        """Pieces of the way back to the plan's pace that are due."""
        ramp = self.ramp
        if ramp is None:
            return ()
        pieces = ramp.list_pieces(step_gen_time)
        if ramp.is_over():
            self.ramp = None
        return pieces

    def _calc_clear_time(self, eventtime, flush_time):
        if self.mcu.is_fileoutput():
            return flush_time - HISTORY_TIME
        return self.mcu.estimated_print_time(eventtime) - HISTORY_TIME

    def calc_step_gen_restart(self, est_print_time):
        """Earliest print_time at which motion may start again after a rest."""
        self.settle()
        start = max(est_print_time + RESTART_LEAD, self.last_step_gen_time)
        return start + self.kin_flush_delay

    # Homing

    def drip_update_time(self, start_time, end_time, completion):
        """Make the steps of a move little by little until completion is set.

        start_time, end_time: print_time of the move, which is in its trapq.
        """
        if self.mcu.is_fileoutput():
            self._flush(end_time + self.kin_flush_delay,
                        end_time + self.kin_flush_delay)
            return
        self.settle()
        self.is_dripping = True
        try:
            self._drip(start_time, end_time + self.kin_flush_delay, completion)
        finally:
            self.is_dripping = False

    def _drip(self, start_time, end_time, completion):
        step_time = max(start_time - self.kin_flush_delay, self.last_step_gen_time)
        while step_time < end_time and not completion.test():
            now = self.reactor.monotonic()
            lead = step_time - self.mcu.estimated_print_time(now) - DRIP_LEAD
            if lead > MIN_WAIT and not self.is_halted:
                completion.wait(now + lead)
                continue
            step_time = min(step_time + DRIP_PIECE, end_time)
            self._flush(step_time, step_time)
            if self.is_halted:
                return

    def wipe_trapq(self, trapq):
        """Drop all motion of a TrapQ that is not made into steps yet."""
        self.settle()
        time = self.last_step_gen_time
        rows = trapq.extract_old(1, 0., time)
        if not rows:
            return
        start, duration, speed, accel, x, y, z, r_x, r_y, r_z = rows[0]
        t = min(max(time - start, 0.), duration)
        way = (speed + 0.5 * accel * t) * t
        trapq.set_position(time, x + r_x * way, y + r_y * way, z + r_z * way)

    def get_status(self, eventtime):
        """How often the host was late: planned stops, and holds without one."""
        return {"planned_stops": self.guard.n_stops, "holds": self.n_holds}

    def _handle_shutdown(self):
        self.settle()
        self.is_halted = True
        self.reactor.update_timer(self.timer, self.reactor.NEVER)
