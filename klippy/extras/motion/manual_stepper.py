# SPDX-License-Identifier: GPL-3.0-or-later
"""[manual_stepper <name>]: a motor moved by its own command, or as a G-code axis.

Its moves lie on a queue of its own.  It has what homing needs of a tool head:
the position is x of (x, 0, 0, 0).
"""

import math

from klippy import stepper
from klippy.errors import CommandError
from klippy.extras.force_move import make_segment
from klippy.extras.gcode_axis import GCodeAxis, read_letter
from klippy_ext.kin_linear import LinearKinematics

DEFAULT_LIMIT = 999999.9
# The numbers that STOP_ON_ENDSTOP was once given as
OLD_STOPS = {"1": "home", "2": "try-home", "-1": "inverted-home",
             "-2": "try-inverted-home"}
STOPS = ("probe", "home")


class StopMode:
    """How a move to an endstop ends: text like try-inverted-probe.

    has_to_stop: an error if nothing stops it.  level: that of the endstop which
    ends it.  is_homing: MOVE is the position of the trigger.
    """

    def __init__(self, text):
        words = OLD_STOPS.get(text, text).lower().split("-")
        kind, marks = words[-1], words[:-1]
        if kind not in STOPS or len(set(marks)) != len(marks) or not (
                set(marks) <= {"try", "inverted"}):
            raise CommandError(
                "STOP_ON_ENDSTOP='%s' must be 'probe' or 'home', with 'try-' or"
                " 'inverted-' or both in front" % (text,))
        self.is_homing = kind == "home"
        self.has_to_stop = "try" not in marks
        self.level = "inverted" not in marks


class ManualStepper:
    """The motor, or motors; mm, mm/s, s.

    Status: position at which all moves end, gcode_axis (letter or None).
    """

    def __init__(self, config):
        self.printer = config.get_printer()
        self.name = config.get_name()
        self.motion_queuing = self.printer.load_object(config, "motion_queuing")
        self.can_home = config.get("endstop_pin", None) is not None
        self._make_motors(config)
        self.velocity = config.getfloat("velocity", 5., above=0.)
        self.accel = self.homing_accel = config.getfloat("accel", 0., minval=0.)
        self.pos_min = config.getfloat("position_min", None)
        self.pos_max = config.getfloat("position_max", None)
        self.commanded_pos = self.next_cmd_time = 0.
        self.axis = None
        self.trapq = self.motion_queuing.allocate_trapq()
        for motor in self.steppers:
            motor.set_stepper_kinematics(LinearKinematics(1., 0., 0.))
            motor.set_trapq(self.trapq)
        self.printer.lookup_object("gcode").register_mux_command(
            "MANUAL_STEPPER", "STEPPER", self.name.split(None, 1)[1],
            self.cmd_MANUAL_STEPPER, desc=self.cmd_MANUAL_STEPPER_help)

    def _make_motors(self, config):
        if self.can_home:
            self.rail = stepper.LookupRail(config, need_position_minmax=False,
                                           default_position_endstop=0.)
            self.steppers = self.rail.get_steppers()
        else:
            self.rail = stepper.PrinterStepper(config)
            self.steppers = [self.rail]

    def get_status(self, eventtime):
        return {"position": self._read_position(),
                "gcode_axis": None if self.axis is None else self.axis.letter}

    def _read_position(self):
        """Where all moves end, also those that are not planned yet."""
        if self.axis is None:
            return self.commanded_pos
        toolhead = self.printer.lookup_object("toolhead")
        return toolhead.get_position()[toolhead.get_extra_axes().index(self.axis)]

    # Moves of its own

    def sync_print_time(self):
        """Have this motor and the tool head wait for each other."""
        toolhead = self.printer.lookup_object("toolhead")
        print_time = toolhead.get_last_move_time()
        if self.next_cmd_time > print_time:
            toolhead.dwell(self.next_cmd_time - print_time)
        else:
            self.next_cmd_time = print_time

    def do_enable(self, enable):
        """Switch the motors on or off."""
        self.sync_print_time()
        names = [motor.get_name() for motor in self.steppers]
        self.printer.lookup_object("stepper_enable").set_motors_enable(
            names, bool(enable))
        self.sync_print_time()

    def do_set_position(self, setpos):
        """Declare where the motor is."""
        self.sync_print_time()
        self.flush_step_generation()
        self.trapq.set_position(self.next_cmd_time, setpos, 0., 0.)
        self.commanded_pos = setpos
        for motor in self.steppers:
            motor.set_position([setpos, 0., 0.])

    def _check_range(self, position):
        low = -math.inf if self.pos_min is None else self.pos_min
        high = math.inf if self.pos_max is None else self.pos_max
        if not low <= position <= high:
            raise CommandError("Move out of range: %s cannot go to %.3f, only from"
                               " %.3f to %.3f" % (self.name, position, low, high))

    def _append_move(self, position, speed, accel):
        """Queue a move at next_cmd_time; returns its duration (s)."""
        segment, duration = make_segment(position - self.commanded_pos, speed, accel)
        segment.start_x = self.commanded_pos
        if duration:
            self.trapq.append(self.next_cmd_time, segment)
        self.commanded_pos = position
        return duration

    def do_move(self, movepos, speed, accel, sync=True):
        """Move; without sync the tool head does not wait for it.

        Raises CommandError out of range.
        """
        self._check_range(movepos)
        self.sync_print_time()
        self.next_cmd_time += self._append_move(movepos, speed, accel)
        self.motion_queuing.note_mcu_movequeue_activity(self.next_cmd_time)
        if sync:
            self.sync_print_time()

    def do_homing_move(self, movepos, speed, accel, probe_pos=False, triggered=True,
                       check_trigger=True):
        """Move until the endstop is at a level.

        probe_pos: the position is counted; else movepos is that of the trigger.
        Raises CommandError, also if check_trigger and nothing has stopped it.
        """
        if not self.can_home:
            raise CommandError("No endstop for %s: it needs the option endstop_pin"
                               % (self.name,))
        self._check_range(movepos)
        self.homing_accel = accel
        homing = self.printer.lookup_object("homing")
        homing.manual_home(self, self.rail.get_endstops(), [movepos, 0., 0., 0.],
                           speed, triggered, check_trigger, probe_pos)
        self.sync_print_time()

    # What homing needs of a tool head

    def flush_step_generation(self):
        """Make all steps."""
        self.sync_print_time()
        self.printer.lookup_object("toolhead").flush_step_generation()

    def get_last_move_time(self):
        """print_time at which all moves end."""
        self.sync_print_time()
        return self.next_cmd_time

    def dwell(self, delay):
        """Rest for so many s."""
        self.next_cmd_time += max(0., delay)
        self.motion_queuing.note_mcu_movequeue_activity(self.next_cmd_time)

    def get_position(self):
        """[position, 0, 0, 0]."""
        return [self.commanded_pos, 0., 0., 0.]

    def set_position(self, newpos, homing_axes=""):
        """Declare where the motor is."""
        self.do_set_position(newpos[0])

    def get_kinematics(self):
        """Itself."""
        return self

    def get_steppers(self):
        """The motors."""
        return list(self.steppers)

    def get_trapq(self):
        """The TrapQ of its moves."""
        return self.trapq

    def calc_position(self, stepper_positions):
        """[position, 0, 0] for {stepper: mm}."""
        return [stepper_positions[self.steppers[0].get_name()], 0., 0.]

    def drip_move(self, newpos, speed, drip_completion):
        """Move to newpos[0]; drop the rest when drip_completion is set."""
        self.dwell(self.motion_queuing.get_kin_flush_delay())
        self.flush_step_generation()
        self.sync_print_time()
        start = self.next_cmd_time
        end = start + self._append_move(newpos[0], speed, self.homing_accel)
        self.motion_queuing.drip_update_time(start, end, drip_completion)
        self.motion_queuing.wipe_trapq(self.trapq)
        reached = min(max(self.motion_queuing.last_step_gen_time, start), end)
        self.next_cmd_time = reached
        self.motion_queuing.note_mcu_movequeue_activity(reached)
        self.flush_step_generation()

    # As an axis of G-code

    def _use_as_axis(self, gcmd, letter):
        """Become the axis of a letter; no letter: of none."""
        toolhead = self.printer.lookup_object("toolhead")
        if not letter:
            if self.axis is not None:
                toolhead.remove_extra_axis(self.axis)
                self.axis = None
            return
        axis = self._make_axis(gcmd, read_letter(letter.upper()))
        for other in toolhead.get_extra_axes()[4:]:
            if other is not self.axis and other.get_axis_gcode_id() == axis.letter:
                raise gcmd.error("GCODE_AXIS %s is already that of '%s'"
                                 % (axis.letter, other.get_name()))
        if self.axis is not None:
            toolhead.remove_extra_axis(self.axis)
        self.sync_print_time()
        self.axis = axis
        toolhead.add_extra_axis(axis, self.commanded_pos)

    def _make_axis(self, gcmd, letter):
        axis = GCodeAxis(self.name, letter, self.trapq, self._note_move)
        axis.corner_velocity = gcmd.get_float("INSTANTANEOUS_CORNER_VELOCITY", 1.,
                                              minval=0.)
        axis.max_velocity = gcmd.get_float("LIMIT_VELOCITY", DEFAULT_LIMIT, above=0.)
        axis.max_accel = gcmd.get_float("LIMIT_ACCEL", DEFAULT_LIMIT, above=0.)
        axis.max_accel_alone = self.accel or DEFAULT_LIMIT
        if self.pos_min is not None:
            axis.position_min = self.pos_min
        if self.pos_max is not None:
            axis.position_max = self.pos_max
        return axis

    def _note_move(self, end_time, position):
        self.commanded_pos = position
        self.next_cmd_time = max(self.next_cmd_time, end_time)

    # Command

    cmd_MANUAL_STEPPER_help = "Command a manually configured stepper"

    def cmd_MANUAL_STEPPER(self, gcmd):
        """ENABLE, SET_POSITION, MOVE (with STOP_ON_ENDSTOP, SYNC), GCODE_AXIS."""
        letter = gcmd.get("GCODE_AXIS", None)
        if letter is not None:
            self._use_as_axis(gcmd, letter.strip())
            return
        enable = gcmd.get_int("ENABLE", None)
        if enable is not None:
            self.do_enable(enable)
        setpos = gcmd.get_float("SET_POSITION", None)
        if self.axis is not None and (
                setpos is not None or gcmd.get("MOVE", None) is not None):
            raise gcmd.error(
                "%s is G-code axis %s: free it with GCODE_AXIS= before '%s'"
                % (self.name, self.axis.letter, gcmd.get_commandline()))
        if setpos is not None:
            self.do_set_position(setpos)
        self._run_move(gcmd)

    def _run_move(self, gcmd):
        speed = gcmd.get_float("SPEED", self.velocity, above=0.)
        accel = gcmd.get_float("ACCEL", self.accel, minval=0.)
        stop = gcmd.get("STOP_ON_ENDSTOP", "0")
        if stop != "0":
            mode = StopMode(stop)
            self.do_homing_move(gcmd.get_float("MOVE"), speed, accel,
                                not mode.is_homing, mode.level, mode.has_to_stop)
        elif gcmd.get_float("MOVE", None) is not None:
            self.do_move(gcmd.get_float("MOVE"), speed, accel,
                         bool(gcmd.get_int("SYNC", 1)))
        elif gcmd.get_int("SYNC", 0):
            self.sync_print_time()


def load_config_prefix(config):
    return ManualStepper(config)
