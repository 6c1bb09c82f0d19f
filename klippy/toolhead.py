# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool head: takes moves, plans them in print_time, keeps the plan ahead.

Positions are mm (x, y, z, e, then further axes), speeds mm/s, times s.
See docs/internals/motion.md.
"""

import importlib
import math

import cython

from klippy import dangers
from klippy.errors import CommandError, ConfigError
from klippy.gcode_command import Coord
from klippy.lookahead import PLAN_TIME, LookAheadQueue, MotionLimits, Move
from klippy.motionguard import PlannedStop
from klippy.movetaker import MoveTaker

if cython.compiled:
    from cython.cimports.klippy.lookahead import make_arc_move, make_move
else:
    from klippy.lookahead import make_arc_move, make_move

__all__ = ["Coord", "Move", "NoExtruder", "ToolHead", "add_printer_objects", "get"]

# Commands wait while the plan is so far ahead of the mcu, until it is so far
BUFFER_HIGH = 3.0
BUFFER_RESUME = 2.5
# After a rest motion starts so far ahead of the mcu: moves that somebody waits
# for, and moves that stream in.  What goes out then must get there in time
# even if the link is out meanwhile.
BUFFER_START = 0.250
BUFFER_START_STREAM = 0.500
# The plan is ended at rest when it reaches less far beyond what is sent
BUFFER_LOW = 0.150
# A rest shorter than this, with more moves right after it, was a stall
STALL_TIME = 0.5
# The plan is made again after so many s of moves when nobody waits for them
FILE_PLAN_TIME = 2.
UNLIMITED = math.inf
# Features that every printer has; those not there yet are left out
DEFAULT_MODULES = ("gcode_move", "homing", "idle_timeout", "statistics",
                   "manual_probe", "tuning_tower", "garbage_collection",
                   "velocity_reset")


class NoExtruder:
    """What get_extruder() gives without one."""

    def __init__(self, printer):
        self.printer = printer

    def update_move_time(self, flush_time, clear_history_time):
        """Nothing to do."""

    def check_move(self, move, axis_index):
        """Raises CommandError: nothing can be extruded."""
        raise move.move_error("Extrude when no extruder present")

    def find_past_position(self, print_time):
        """0."""
        return 0.

    def calc_junction(self, prev_move, move, axis_index):
        """No limit."""
        return UNLIMITED

    def get_name(self):
        """No name."""
        return ""

    def get_axis_gcode_id(self):
        """No letter."""
        return None

    def get_heater(self):
        """Raises CommandError: there is none."""
        raise CommandError("Extruder not configured")

    def get_trapq(self):
        """Raises CommandError: there is none."""
        raise CommandError("Extruder not configured")


def get(printer):
    """The printer's ToolHead."""
    return printer.lookup_object("toolhead")


class ToolHead:
    """Planner of the printer's axes."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.reactor = self.printer.get_reactor()
        self.mcu = self.printer.lookup_object("mcu")
        self.motion_queuing = self.printer.load_object(config, "motion_queuing")
        self.trapq = self.motion_queuing.allocate_trapq()
        self.lookahead = LookAheadQueue(
            FILE_PLAN_TIME if self.mcu.is_fileoutput() else PLAN_TIME)
        self.limits = read_limits(config)
        self.extruder, self.taker = NoExtruder(self.printer), None
        self.extra_axes = [self.extruder]
        self.x = self.y = self.z = self.e = 0.
        self.extra_pos = []
        self.print_time = self.pause_time = 0.
        self.is_drained = True
        self.can_pause = not self.mcu.is_fileoutput()
        self.print_stall = 0
        # Motion came to its planned stop, which is counted already
        self.is_stopped = False
        self.motion_queuing.set_planned_stop(PlannedStop(self))
        self.motion_queuing.register_flush_callback(self._finish_plan,
                                                    can_add_trapq=True)
        self.printer.register_event_handler("klippy:shutdown",
                                            self._handle_shutdown)
        self._register_commands()
        self.kin = load_kinematics(self, config)

    def _register_commands(self):
        gcode = self.printer.lookup_object("gcode")
        gcode.register_command("G4", self.cmd_G4)
        gcode.register_command("M400", self.cmd_M400)
        gcode.register_command("M204", self.cmd_M204)
        gcode.register_command("SET_VELOCITY_LIMIT", self.cmd_SET_VELOCITY_LIMIT,
                               desc=self.cmd_SET_VELOCITY_LIMIT_help)

    # Moves

    def move_xyze(self, x, y, z, e, speed):
        """Move to a position at a speed.  May wait.

        Raises CommandError if that is not possible; then nothing has moved.
        """
        move = make_move(self.limits, self.x, self.y, self.z, self.e, x, y, z, e,
                         self._stay_extra(), speed)
        self.add_move(move)
        return 0

    def _stay_extra(self):
        """Ways of the axes beyond e in a move that does not name them."""
        if not self.extra_pos:
            return None
        return [(pos, pos, 0.) for pos in self.extra_pos]

    def move(self, newpos, speed):
        """Move to newpos (x, y, z, e and further axes).  See move_xyze()."""
        self.add_move(Move(self.limits, self.get_position(),
                           self._complete(newpos), speed))

    def can_follow(self, arc):
        """True if the kinematics can follow an ArcPath as it is.

        Motors that follow what plug-ins made do not.
        """
        kin = self.kin
        if self.extra_pos or not (hasattr(kin, "accepts_arc")
                                  and is_arc_check_current(kin)):
            return False
        for motor in kin.get_steppers():
            follows = motor.kinematics
            if follows is None or (follows.shaper is None
                                   and follows.scan_window() != (0., 0.)):
                return False
        return kin.accepts_arc(arc)

    def move_arc(self, arc, e, speed):
        """Follow an ArcPath from where all moves so far end.  See move_xyze().

        Only if can_follow() says so.
        """
        self.add_move(make_arc_move(self.limits, arc, self.e, e, speed))

    def _complete(self, newpos):
        """newpos with the axes that it leaves out."""
        position = self.get_position()
        return [*newpos, *position[len(newpos):]][:len(position)]

    def add_move(self, move):
        """Queue a move that starts where the newest ends."""
        if not move.move_d:
            return 0
        if move.arc is not None:
            self.kin.check_arc(move)
        elif move.is_kinematic_move and self.kin.check_move(move):
            return self._add_parts(move)
        if move.d_e != 0.:
            if self.has_taker():
                self.taker.check_move(move, 3)
            else:
                self.extruder.check_move(move, 3)
        if move.extra is not None:
            self._check_extra(move)
        self.x, self.y, self.z = move.end_x, move.end_y, move.end_z
        self.e = move.end_e
        prev = self.lookahead.get_last()
        if prev is None:
            self.motion_queuing.await_moves()
        else:
            extra_v2 = UNLIMITED
            if move.axes_r_e != prev.axes_r_e or move.extra is not None:
                extra_v2 = self.find_extra_v2(prev, move)
            move.calc_junction(prev, extra_v2)
        if self.lookahead.add_move(move):
            self.commit(False)
        if self.print_time > self.pause_time:
            self._keep_pace()
        return 0

    def _add_parts(self, move):
        """Queue a move in the parts for which the kinematics ask."""
        speed = math.sqrt(move.max_cruise_v2)
        start, ways = move.start_pos, move.axes_d
        for share in self.kin.list_cuts(move):
            self.move([a + d * share for a, d in zip(start, ways, strict=True)], speed)
        self.move(move.end_pos, speed)
        return 0

    def _check_extra(self, move):
        for i, way in enumerate(move.axes_d[4:]):
            if way:
                self.extra_axes[i + 1].check_move(move, i + 4)
        self.extra_pos = [axis[1] for axis in move.extra]

    def has_taker(self):
        """Is self.extruder, which anybody may set, self.taker?"""
        return self.taker is not None and self.taker is self.extruder

    def find_extra_v2(self, prev, move):
        """What the axes beyond z allow at the junction of two moves."""
        if self.has_taker():
            limit = self.taker.calc_junction(prev, move, 3)
        else:
            limit = self.extruder.calc_junction(prev, move, 3)
        if move.extra is not None:
            for i in range(1, len(self.extra_axes)):
                limit = min(limit, self.extra_axes[i].calc_junction(
                    prev, move, i + 3))
        return limit

    def manual_move(self, coord, speed):
        """Move the axes whose coordinate is not None."""
        position = self.get_position()
        for i, value in enumerate(coord):
            if value is not None:
                position[i] = value
        self.move(position, speed)
        self.printer.send_event("toolhead:manual_move")

    # The plan

    def commit(self, is_final):
        """Put the moves whose speeds are certain on the queues of motion."""
        self.motion_queuing.settle()
        moves = self.lookahead.take(is_final)
        if moves:
            self._sync_print_time(BUFFER_START if is_final else BUFFER_START_STREAM)
            time = self.append_moves(self.print_time, moves)
            self.is_drained = is_final
            self.print_time = time
            self.motion_queuing.note_mcu_movequeue_activity(time)
            self.motion_queuing.advance(time)
            return 0
        if is_final:
            self.is_drained = True
        self.motion_queuing.watch()
        return 0

    def append_moves(self, time, moves):
        """Put planned moves on the queues of motion; returns when they end."""
        for move in moves:
            if move.is_kinematic_move:
                self.trapq.append(time, move)
            if move.d_e != 0. or move.extra is not None:
                self.append_extra(time, move)
            time += move.accel_t + move.cruise_t + move.decel_t
            if move.timing_callbacks is not None:
                for callback in move.timing_callbacks:
                    callback(time)
        return time

    def append_extra(self, print_time, move):
        """Put the ways of extruder and further axes on their queues."""
        if move.d_e != 0.:
            if self.has_taker():
                self.taker.process_move(print_time, move, 3)
            else:
                self.extruder.process_move(print_time, move, 3)
        if move.extra is not None:
            for i, way in enumerate(move.axes_d[4:]):
                if way:
                    self.extra_axes[i + 1].process_move(print_time, move, i + 4)
        return 0

    def _sync_print_time(self, lead=BUFFER_START):
        """Move print_time ahead if the mcu is about to reach it, or has.

        lead: s by which motion from rest starts ahead of the mcu.
        """
        if not self.is_drained:
            self.motion_queuing.hold_if_late(True)
        eventtime = self.reactor.monotonic()
        est_print_time = self.mcu.estimated_print_time(eventtime)
        if self.is_drained:
            restart = self.motion_queuing.calc_step_gen_restart(est_print_time)
            earliest = max(est_print_time + BUFFER_START, restart)
            start = max(est_print_time + lead, restart)
        else:
            start = earliest = est_print_time + BUFFER_LOW
        if self.print_time >= earliest:
            return
        if not self.is_stopped and (
                not self.is_drained
                or 0. < est_print_time - self.print_time < STALL_TIME):
            self.print_stall += 1
        self.is_stopped = False
        self.print_time = start
        self.printer.send_event("toolhead:sync_print_time", eventtime,
                                est_print_time, start)

    def _finish_plan(self, flush_time, step_gen_time):
        """End the plan at rest if it is about to run out; True if moves wait."""
        if self.lookahead.is_empty():
            return False
        reserve = BUFFER_LOW + self.motion_queuing.get_kin_flush_delay()
        if self.print_time - reserve > step_gen_time:
            return True
        self.commit(True)
        return False

    def _keep_pace(self):
        """Wait while the plan is far ahead of the mcu."""
        if not self.can_pause:
            self.pause_time = UNLIMITED
            return
        eventtime = self.reactor.monotonic()
        lead = self.print_time - self.mcu.estimated_print_time(eventtime)
        if lead > BUFFER_HIGH:
            while lead > BUFFER_RESUME and self.can_pause:
                eventtime = self.reactor.pause(
                    eventtime + max(0.005, lead - BUFFER_RESUME))
                lead = self.print_time - self.mcu.estimated_print_time(eventtime)
        self.pause_time = self.print_time + BUFFER_HIGH - lead

    def get_last_move_time(self):
        """print_time at which all moves end; they come to a rest there."""
        self.commit(True)
        self._sync_print_time()
        return self.print_time

    def flush_step_generation(self):
        """Plan all moves and make all their steps."""
        self.commit(True)
        self.motion_queuing.flush_all_steps()

    def dwell(self, delay):
        """Rest for so many s after all moves."""
        self.print_time = self.get_last_move_time() + max(0., delay)
        self.motion_queuing.note_mcu_movequeue_activity(self.print_time)
        self._keep_pace()

    def wait_moves(self):
        """Wait until all moves are carried out."""
        self.commit(True)
        eventtime = self.reactor.monotonic()
        while self.can_pause:
            rest = self.print_time - self.mcu.estimated_print_time(eventtime)
            if rest <= 0. and self.lookahead.is_empty():
                return
            # Nothing can follow before: the mcus may have all of it
            self.flush_step_generation()
            eventtime = self.reactor.pause(eventtime + max(0.005, rest))

    def register_lookahead_callback(self, callback):
        """Call callback(print_time) with the time at which the last move ends."""
        # The guard would go past the callback
        self.motion_queuing.settle()
        last = self.lookahead.get_last()
        if last is None:
            callback(self.get_last_move_time())
        else:
            last.add_callback(callback)
            self.motion_queuing.watch()

    # Homing

    def drip_move(self, newpos, speed, drip_completion):
        """Move to newpos; drop the rest when drip_completion is set."""
        self.dwell(self.motion_queuing.get_kin_flush_delay())
        self.flush_step_generation()
        self._sync_print_time()
        move = Move(self.limits, self.get_position(), self._complete(newpos), speed)
        if not move.move_d:
            return
        self.kin.check_move(move)
        self.x, self.y, self.z = move.end_x, move.end_y, move.end_z
        self.lookahead.add_move(move)
        self._drip(self.lookahead.take(True)[0], drip_completion)

    def _drip(self, move, completion):
        start = self.print_time
        end = start + move.accel_t + move.cruise_t + move.decel_t
        self.trapq.append(start, move)
        self.motion_queuing.drip_update_time(start, end, completion)
        # Steps are made of what is planned so far
        reached = (self.motion_queuing.last_step_gen_time
                   + self.motion_queuing.get_kin_flush_delay())
        reached = min(max(reached, start), end)
        if reached < end:
            x, y, z, _ = move.calc_position(reached - start)
            self.trapq.set_position(reached, x, y, z)
        self.print_time = reached
        self.motion_queuing.note_mcu_movequeue_activity(reached)
        self.flush_step_generation()

    # Position

    def get_position(self):
        """[x, y, z, e, ...] at which all moves so far end."""
        return [self.x, self.y, self.z, self.e, *self.extra_pos]

    @property
    def commanded_pos(self):
        """As get_position(); may be set, which moves nothing."""
        return self.get_position()

    @commanded_pos.setter
    def commanded_pos(self, newpos):
        self._set_coords(newpos)

    def _set_coords(self, newpos):
        self.x, self.y, self.z = newpos[0], newpos[1], newpos[2]
        if len(newpos) > 3:
            self.e = newpos[3]
        if len(newpos) > 4:
            self.extra_pos = [float(v) for v in newpos[4:]]

    def set_position(self, newpos, homing_axes=""):
        """Declare where the head is; homing_axes ("xyz") become homed."""
        self.flush_step_generation()
        self.trapq.set_position(self.print_time, newpos[0], newpos[1], newpos[2])
        self._set_coords(newpos)
        self.kin.set_position(newpos, homing_axes)
        self.printer.send_event("toolhead:set_position")

    # Extruders and further axes

    def set_extruder(self, extruder, extrude_pos):
        """Make this the active extruder, whose axis is at extrude_pos."""
        if self.get_trapq() is not None:
            self.commit(True)
        self.extruder = extruder
        self.taker = extruder if isinstance(extruder, MoveTaker) else None
        self.extra_axes[0] = extruder
        self.e = extrude_pos

    def get_extruder(self):
        """The active extruder."""
        return self.extruder

    def add_extra_axis(self, ea, axis_pos):
        """Add an axis after e; its moves go to ea.process_move()."""
        self.commit(True)
        self.extra_axes.append(ea)
        self.extra_pos = [*self.extra_pos, float(axis_pos)]
        self.printer.send_event("toolhead:update_extra_axes")

    def remove_extra_axis(self, ea):
        """Take an axis away."""
        self.commit(True)
        if ea not in self.extra_axes:
            return
        index = self.extra_axes.index(ea)
        if index == 0:
            self.set_extruder(NoExtruder(self.printer), 0.)
        else:
            self.extra_axes.pop(index)
            self.extra_pos = [v for i, v in enumerate(self.extra_pos)
                              if i != index - 1]
        self.printer.send_event("toolhead:update_extra_axes")

    def get_extra_axes(self):
        """[None, None, None, extruder, ...]: the axes by their index."""
        return [None, None, None, *self.extra_axes]

    # Others

    def get_kinematics(self):
        """The kinematics of x, y and z."""
        return self.kin

    def get_trapq(self):
        """The TrapQ of x, y and z."""
        return self.trapq

    def get_max_velocity(self):
        """(greatest speed, greatest accel)."""
        return self.limits.max_velocity, self.limits.max_accel

    @property
    def max_velocity(self):
        """Greatest speed."""
        return self.limits.max_velocity

    @property
    def max_accel(self):
        """Greatest accel."""
        return self.limits.max_accel

    def set_max_velocities(self, max_velocity=None, max_accel=None,
                           square_corner_velocity=None, min_cruise_ratio=None):
        """Change limits for the moves to come; returns all four now valid."""
        old = self.limits
        self.limits = MotionLimits(
            _prefer(max_velocity, old.max_velocity),
            _prefer(max_accel, old.max_accel),
            _prefer(min_cruise_ratio, old.min_cruise_ratio),
            _prefer(square_corner_velocity, old.corner_velocity))
        return (self.limits.max_velocity, self.limits.max_accel,
                self.limits.corner_velocity, self.limits.min_cruise_ratio)

    def register_step_generator(self, handler):
        """Old way of being called when steps are made: handler(time)."""
        self.motion_queuing.register_flush_callback(
            lambda flush_time, step_gen_time: handler(step_gen_time))

    def note_mcu_movequeue_activity(self, mq_time, set_step_gen_time=False):
        """Old name of what motion_queuing does."""
        self.motion_queuing.note_mcu_movequeue_activity(mq_time, set_step_gen_time)

    def check_busy(self, eventtime):
        """(print_time, estimated print_time now, True if no move waits)."""
        return (self.print_time, self.mcu.estimated_print_time(eventtime),
                self.lookahead.is_empty())

    def stats(self, eventtime):
        """(is active, line for the log)."""
        est_print_time = self.mcu.estimated_print_time(eventtime)
        lead = self.print_time - est_print_time
        is_active = lead > -60. or not self.is_drained
        return is_active, "print_time=%.3f buffer_time=%.3f print_stall=%d" % (
            self.print_time, max(lead, 0.), self.print_stall)

    def get_status(self, eventtime):
        """Status of printer.toolhead."""
        status = dict(self.kin.get_status(eventtime))
        status.update(
            print_time=self.print_time, stalls=self.print_stall,
            estimated_print_time=self.mcu.estimated_print_time(eventtime),
            extruder=self.extruder.get_name(),
            position=Coord(self.get_position()),
            max_velocity=self.limits.max_velocity, max_accel=self.limits.max_accel,
            minimum_cruise_ratio=self.limits.min_cruise_ratio,
            square_corner_velocity=self.limits.corner_velocity,
            extra_axes={axis.get_name(): i + 3
                        for i, axis in enumerate(self.extra_axes)})
        return status

    def _handle_shutdown(self):
        self.can_pause = False
        self.lookahead.reset()

    # Commands

    def cmd_G4(self, gcmd):
        """Dwell P milliseconds."""
        self.dwell(gcmd.get_float("P", 0., minval=0.) / 1000.)

    def cmd_M400(self, gcmd):
        """Wait until all moves are done."""
        self.wait_moves()

    cmd_SET_VELOCITY_LIMIT_help = "Set printer velocity limits"

    def cmd_SET_VELOCITY_LIMIT(self, gcmd):
        """Change the limits of speed and accel, or show them."""
        values = (gcmd.get_float("VELOCITY", None, above=0.),
                  gcmd.get_float("ACCEL", None, above=0.),
                  gcmd.get_float("SQUARE_CORNER_VELOCITY", None, minval=0.),
                  gcmd.get_float("MINIMUM_CRUISE_RATIO", None, minval=0., below=1.))
        has_axes = (hasattr(self.kin, "change_axis_limits")
                    and self.kin.change_axis_limits(gcmd))
        self.set_max_velocities(*values)
        is_change = has_axes or values != (None,) * 4
        text = self.note_limits(is_change)
        if not is_change:
            gcmd.respond_info(text, log=False)

    def note_limits(self, is_change=True):
        """Have the log tell the limits, if they are new; returns their text."""
        text = ("max_velocity: %.6f\nmax_accel: %.6f\nminimum_cruise_ratio: %.6f\n"
                "square_corner_velocity: %.6f" % (
                    self.limits.max_velocity, self.limits.max_accel,
                    self.limits.min_cruise_ratio, self.limits.corner_velocity))
        is_logged = dangers.get(self.printer).log_velocity_limit_changes
        self.printer.set_rollover_info("toolhead", "toolhead: " + text,
                                       log=is_logged and is_change)
        return text

    def cmd_M204(self, gcmd):
        """Set the accel: S, or the lower one of P and T."""
        accel = gcmd.get_float("S", None, above=0.)
        if accel is None:
            printing = gcmd.get_float("P", None, above=0.)
            travel = gcmd.get_float("T", None, above=0.)
            if printing is None or travel is None:
                gcmd.respond_info('"%s" is ignored: M204 takes S, or both P and T'
                                  % (gcmd.get_commandline(),))
                return
            accel = min(printing, travel)
        self.set_max_velocities(max_accel=accel)


def is_arc_check_current(kin):
    """False if check_move() of kinematics was replaced and check_arc() was not."""
    if "check_move" in getattr(kin, "__dict__", ()):
        return False
    for kind in type(kin).__mro__:
        if "check_move" in vars(kind) or "check_arc" in vars(kind):
            return "check_arc" in vars(kind)
    return False


def _prefer(value, default):
    return default if value is None else value


def read_limits(config):
    """The MotionLimits of section [printer]."""
    return MotionLimits(
        config.getfloat("max_velocity", above=0.),
        config.getfloat("max_accel", above=0.),
        config.getfloat("minimum_cruise_ratio", 0.5, minval=0., below=1.),
        config.getfloat("square_corner_velocity", 5., minval=0.))


def load_kinematics(toolhead, config):
    """The object of the kinematics that section [printer] names."""
    name = config.get("kinematics")
    module_name = "klippy.kinematics." + name
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as err:
        if err.name != module_name:
            raise
        raise ConfigError("Option 'kinematics' in section 'printer': there are no"
                          " kinematics '%s'" % (name,)) from None
    if not hasattr(module, "load_kinematics"):
        raise ConfigError("Option 'kinematics' in section 'printer': '%s' is not"
                          " a kind of kinematics" % (name,))
    return module.load_kinematics(toolhead, config)


def add_printer_objects(config):
    """Make the tool head and what every printer has.  Raises ConfigError."""
    printer = config.get_printer()
    section = config.getsection("printer")
    printer.add_object("toolhead", ToolHead(section))
    for name in DEFAULT_MODULES:
        printer.load_object(config, name, None)
