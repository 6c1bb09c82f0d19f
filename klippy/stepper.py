# SPDX-License-Identifier: GPL-3.0-or-later
"""Steppers of the printer: one motor on one mcu, and rails with endstops.

Positions of a stepper are mm (radians with units_in_radians) along its own
way; mcu positions are whole steps, as its micro-controller counts them.
See docs/internals/stepper.md.
"""

import collections
import math

from klippy import pins
from klippy.errors import ConfigError
from klippy_ext.kin_delta import DeltaKinematics
from klippy_ext.kin_extruder import ExtruderKinematics
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.stepcompress import StepCompress

# A step pulse is so long (s) unless the config or a driver says otherwise
DEFAULT_PULSE = 0.000002
# Up to so long (s) a step on both edges of the pin does
MAX_BOTH_EDGE_PULSE = 0.000000500

KINDS = {
    "cartesian_stepper_alloc": lambda axis: LinearKinematics(
        *{b"x": (1, 0, 0), b"y": (0, 1, 0), b"z": (0, 0, 1)}[_to_bytes(axis)]),
    "corexy_stepper_alloc": lambda kind: LinearKinematics(
        *{b"+": (1, 1, 0), b"-": (1, -1, 0)}[_to_bytes(kind)]),
    "corexz_stepper_alloc": lambda kind: LinearKinematics(
        *{b"+": (1, 0, 1), b"-": (1, 0, -1)}[_to_bytes(kind)]),
    "delta_stepper_alloc": DeltaKinematics,
    "extruder_stepper_alloc": ExtruderKinematics,
}


def _to_bytes(text):
    return text if isinstance(text, bytes) else text.encode()


class MCU_stepper:
    """One stepper motor on one micro-controller."""

    def __init__(self, name, mcu, step_pin_params, dir_pin_params, rotation_dist,
                 steps_per_rotation, step_pulse_duration=None,
                 units_in_radians=False):
        self._name, self.mcu = name, mcu
        self._rotation_dist, self._steps_per_rotation = (rotation_dist,
                                                         steps_per_rotation)
        self._pulse_duration, self._is_radians = (step_pulse_duration,
                                                  units_in_radians)
        self._want_both_edges = False
        self._step_pin, self._dir_pin = step_pin_params["pin"], dir_pin_params["pin"]
        self._invert_step = step_pin_params["invert"]
        self._invert_dir = self._orig_invert_dir = dir_pin_params["invert"]
        if dir_pin_params["chip"] is not mcu:
            raise ConfigError("Stepper '%s': dir_pin must be on the same mcu as"
                              " step_pin" % (name,))
        self._oid = mcu.create_oid()
        self.stepcompress = StepCompress(self._oid)
        self.kinematics = None
        self._trapq = None
        # mm at which the mcu counts 0, from the commanded position's origin
        self._mcu_offset = 0.
        self._active_callbacks = []
        self._get_position_cmd = self._reset_cmd = None
        mcu.register_config_callback(self._build_config)
        self._printer = mcu.get_printer()
        self._motion_queuing = None

    # Facts

    def get_mcu(self):
        """The MCU."""
        return self.mcu

    def get_name(self, short=False):
        """Name of the section; short: without 'stepper_'."""
        return self._name.removeprefix("stepper_") if short else self._name

    def get_oid(self):
        """Number of the stepper on its mcu."""
        return self._oid

    def units_in_radians(self):
        """True if positions are angles."""
        return self._is_radians

    def get_step_dist(self):
        """mm a step."""
        return self._rotation_dist / self._steps_per_rotation

    def get_rotation_distance(self):
        """(mm a rotation, steps a rotation)."""
        return self._rotation_dist, self._steps_per_rotation

    def set_rotation_distance(self, rotation_dist):
        """Change the way of a rotation; the mcu's count stays as it is."""
        mcu_pos = self.get_mcu_position()
        self._rotation_dist = rotation_dist
        self._set_mcu_position(mcu_pos)
        self._connect_kinematics()

    def get_dir_inverted(self):
        """(direction pin inverted now, as in the config)."""
        return self._invert_dir, self._orig_invert_dir

    def set_dir_inverted(self, invert_dir):
        """Turn the other way from now on; steps must have been flushed."""
        invert_dir = int(bool(invert_dir))
        if invert_dir == self._invert_dir:
            return
        self._invert_dir = invert_dir
        self._configure_compress()
        self._printer.send_event("stepper:set_dir_inverted", self)

    # Pulses

    def setup_default_pulse_duration(self, pulse_duration, step_both_edge):
        """What a driver wants if the config does not say: s, both edges."""
        if self._pulse_duration is None:
            self._pulse_duration = pulse_duration
        self._want_both_edges = step_both_edge

    def get_pulse_duration(self):
        """(length of a step pulse in s or None, both edges wanted)."""
        return self._pulse_duration, self._want_both_edges

    def _choose_pulse(self):
        """(invert_step, step_pulse_ticks) for the mcu."""
        if self._pulse_duration is None:
            self._pulse_duration = DEFAULT_PULSE
        invert_step = self._invert_step
        constants = self.mcu.get_constants()
        if (self._want_both_edges and self._pulse_duration <= MAX_BOTH_EDGE_PULSE
                and "STEPPER_STEP_BOTH_EDGE" in constants):
            invert_step = 255
        return invert_step, self.mcu.seconds_to_clock(self._pulse_duration)

    def _build_config(self):
        mcu = self.mcu
        invert_step, pulse_ticks = self._choose_pulse()
        mcu.add_config_cmd(
            "config_stepper oid=%d step_pin=%s dir_pin=%s invert_step=%d"
            " step_pulse_ticks=%u" % (self._oid, self._step_pin, self._dir_pin,
                                      invert_step, pulse_ticks))
        mcu.add_config_cmd("reset_step_clock oid=%d clock=0" % (self._oid,),
                           on_restart=True)
        self._queue_tag = mcu.lookup_command(
            "queue_step oid=%c interval=%u count=%hu add=%hi").get_command_tag()
        self._dir_tag = mcu.lookup_command(
            "set_next_step_dir oid=%c dir=%c").get_command_tag()
        self._reset_cmd = mcu.lookup_command("reset_step_clock oid=%c clock=%u")
        self._get_position_cmd = mcu.lookup_query_command(
            "stepper_get_position oid=%c", "stepper_position oid=%c pos=%i",
            oid=self._oid)
        self._configure_compress()

    def _configure_compress(self):
        if self._reset_cmd is None:
            return
        max_error = self.mcu.seconds_to_clock(self.mcu.get_max_stepper_error())
        self.stepcompress.configure(max_error, self._queue_tag, self._dir_tag,
                                    invert_dir=bool(self._invert_dir))

    # Kinematics

    def setup_itersolve(self, alloc_func, *params):
        """Move by a kind of kinematics, by its historical name."""
        self.set_stepper_kinematics(KINDS[alloc_func](*params))

    def get_stepper_kinematics(self):
        """The StepperKinematics, or None."""
        return self.kinematics

    def set_stepper_kinematics(self, kinematics):
        """Move by these from now on; returns the old ones."""
        old = self.kinematics
        mcu_pos = self.get_mcu_position() if old is not None else 0
        if old is not None:
            old.set_stepcompress(None, self.get_step_dist())
        self.kinematics = kinematics
        self._connect_kinematics()
        if old is not None:
            self._set_mcu_position(mcu_pos)
        return old

    def _connect_kinematics(self):
        if self.kinematics is not None:
            self.kinematics.set_stepcompress(self.stepcompress, self.get_step_dist())
            self.kinematics.set_trapq(self._trapq)
        if self._motion_queuing is not None:
            self._motion_queuing.set_kinematics(self)

    def register_motion(self, motion_queuing):
        """Have steps made by the printer's motion queue."""
        self._motion_queuing = motion_queuing
        motion_queuing.add_stepper(self)

    def get_trapq(self):
        """The TrapQ that is followed, or None."""
        return self._trapq

    def set_trapq(self, trapq):
        """Follow a TrapQ (None: stand still); returns the old one."""
        old, self._trapq = self._trapq, trapq
        if self.kinematics is not None:
            self.kinematics.set_trapq(trapq)
        return old

    def is_active_axis(self, axis):
        """Can the axis 'x', 'y' or 'z' move this stepper?"""
        return self.kinematics is not None and self.kinematics.is_active_axis(axis)

    def calc_position_from_coord(self, coord):
        """Position of the stepper for a head that rests at coord."""
        return self.kinematics.calc_position_from_coord(*coord[:3])

    # Position

    def set_position(self, coord):
        """The head is at coord; nothing moves."""
        mcu_pos = self.get_mcu_position()
        self.kinematics.set_position(*coord[:3])
        self._set_mcu_position(mcu_pos)

    def get_commanded_position(self):
        """Where the stepper is, as far as steps are made."""
        return self.kinematics.get_commanded_pos()

    def get_mcu_position(self, cmd_pos=None):
        """Steps the mcu counts (at a commanded position)."""
        if cmd_pos is None:
            cmd_pos = self.get_commanded_position()
        return round_half((cmd_pos + self._mcu_offset) / self.get_step_dist())

    def _set_mcu_position(self, mcu_pos):
        self._mcu_offset = (mcu_pos * self.get_step_dist()
                            - self.get_commanded_position())

    def get_past_mcu_position(self, print_time):
        """Steps the mcu counted at a time not long ago."""
        clock = self.mcu.print_time_to_clock(print_time)
        return self.stepcompress.find_past_position(clock)

    def mcu_to_commanded_position(self, mcu_pos):
        """Position in mm of a count of the mcu."""
        return mcu_pos * self.get_step_dist() - self._mcu_offset

    def dump_steps(self, count, start_clock, end_clock):
        """(runs as of StepCompress.extract_old(), their number)."""
        runs = self.stepcompress.extract_old(count, start_clock, end_clock)
        return runs, len(runs)

    def note_homing_end(self):
        """A trigger may have stopped the mcu: take its count over."""
        self.stepcompress.reset(0)
        if self.mcu.is_fileoutput():
            return
        self._reset_cmd.send([self._oid, 0])
        params = self._get_position_cmd.send([self._oid])
        position = params["pos"]
        if self._invert_dir:
            position = -position
        receive_time = params["#receive_time"]
        clock = self.mcu.print_time_to_clock(
            self.mcu.estimated_print_time(receive_time))
        self.stepcompress.set_last_position(clock, position)
        self._set_mcu_position(position)
        self._printer.send_event("stepper:sync_mcu_position", self)

    # Activity

    def add_active_callback(self, callback):
        """Call callback(print_time) when the stepper is about to move, once."""
        self._active_callbacks.append(callback)

    def check_active(self, print_time):
        """Call the active callbacks if motion up to print_time moves the stepper."""
        if not self._active_callbacks or self.kinematics is None:
            return
        start = self.kinematics.check_active(print_time)
        if start:
            callbacks, self._active_callbacks = self._active_callbacks, []
            for callback in callbacks:
                callback(start)

    def generate_steps(self, flush_time):
        """Old way of making steps: done by motion_queuing now."""
        self.check_active(flush_time)
        self.kinematics.generate_steps(flush_time)


def round_half(value):
    """The nearest integer; halves go up."""
    return math.floor(value + 0.5)


# Options of the config


def parse_gear_ratio(config, note_valid):
    """Rotations of the motor for one of the output."""
    gears = config.getlists("gear_ratio", (), seps=(":", ","), count=2,
                            parser=float, note_valid=note_valid)
    result = 1.
    for driven, driving in gears:
        if driving <= 0. or driven <= 0.:
            raise config.error("Option 'gear_ratio' in section '%s' must have"
                               " numbers above 0" % (config.get_name(),))
        result *= driven / driving
    return result


def parse_step_distance(config, units_in_radians=None, note_valid=False):
    """(mm or radians a rotation of the motor, steps a rotation)."""
    if units_in_radians is None:
        units_in_radians = (config.get("rotation_distance", None,
                                       note_valid=False) is None
                            and config.get("gear_ratio", None,
                                           note_valid=False) is not None)
    if units_in_radians:
        rotation_dist = 2. * math.pi
        config.get("gear_ratio", note_valid=note_valid)
    else:
        rotation_dist = config.getfloat("rotation_distance", above=0.,
                                        note_valid=note_valid)
    microsteps = config.getint("microsteps", minval=1, note_valid=note_valid)
    full_steps = config.getint("full_steps_per_rotation", 200, minval=1,
                               note_valid=note_valid)
    if full_steps % 4:
        raise config.error(
            "Option 'full_steps_per_rotation' in section '%s' must be a multiple"
            " of 4, not %d" % (config.get_name(), full_steps))
    gearing = parse_gear_ratio(config, note_valid)
    return rotation_dist, full_steps * microsteps * gearing


def PrinterStepper(config, units_in_radians=False):
    """The MCU_stepper of a config section, known to all who care."""
    printer = config.get_printer()
    name = config.get_name()
    ppins = pins.get(printer)
    step_pin = ppins.lookup_pin(config.get("step_pin"), can_invert=True)
    dir_pin = ppins.lookup_pin(config.get("dir_pin"), can_invert=True)
    rotation_dist, steps_per_rotation = parse_step_distance(
        config, units_in_radians, True)
    pulse = config.getfloat("step_pulse_duration", None, minval=0., maxval=.001)
    stepper = MCU_stepper(name, step_pin["chip"], step_pin, dir_pin, rotation_dist,
                          steps_per_rotation, pulse, units_in_radians)
    stepper.register_motion(printer.load_object(config, "motion_queuing"))
    for module in ("stepper_enable", "force_move", "motion_report"):
        obj = printer.load_object(config, module, None)
        if hasattr(obj, "register_stepper"):
            obj.register_stepper(config, stepper)
    return stepper


HomingInfo = collections.namedtuple("homing_info", [
    "speed", "position_endstop", "retract_speed", "retract_dist", "positive_dir",
    "second_homing_speed"])


class GenericPrinterRail:
    """An axis that homes: its range, how it homes, its steppers and endstops."""

    def __init__(self, config, need_position_minmax=True,
                 default_position_endstop=None, units_in_radians=False):
        self.printer = config.get_printer()
        self.stepper_units_in_radians = units_in_radians
        self.name = config.get_name()
        self.steppers = []
        self.endstops = []
        self.endstop_map = {}
        self.endstop_pin = config.get("endstop_pin")
        endstop = self.lookup_endstop(self.endstop_pin, self.name)
        self.position_endstop = self._read_position_endstop(
            config, endstop, default_position_endstop)
        if need_position_minmax:
            self.position_min = config.getfloat("position_min", 0.)
            self.position_max = config.getfloat("position_max",
                                                above=self.position_min)
        else:
            self.position_min = 0.
            self.position_max = self.position_endstop
        if not self.position_min <= self.position_endstop <= self.position_max:
            raise config.error(
                "position_endstop in section '%s' must be between position_min and"
                " position_max: %.3f is not in %.3f to %.3f"
                % (self.name, self.position_endstop, self.position_min,
                   self.position_max))
        self._read_homing(config)

    def _read_position_endstop(self, config, endstop, default):
        if hasattr(endstop, "get_position_endstop"):
            return endstop.get_position_endstop()
        if default is None:
            return config.getfloat("position_endstop")
        return config.getfloat("position_endstop", default)

    def _read_homing(self, config):
        self.homing_speed = config.getfloat("homing_speed", 5., above=0.)
        self.second_homing_speed = config.getfloat(
            "second_homing_speed", self.homing_speed / 2., above=0.)
        self.homing_retract_speed = config.getfloat(
            "homing_retract_speed", self.homing_speed, above=0.)
        self.homing_retract_dist = config.getfloat(
            "homing_retract_dist", 5., minval=0.)
        positive = config.getboolean("homing_positive_dir", None)
        if positive is None:
            positive = self._guess_direction(config)
        elif ((positive and self.position_endstop == self.position_min)
              or (not positive and self.position_endstop == self.position_max)):
            raise config.error("Invalid homing_positive_dir / position_endstop in"
                               " section '%s'" % (self.name,))
        self.homing_positive_dir = positive

    def _guess_direction(self, config):
        """Towards the nearer end of the range."""
        quarter = (self.position_max - self.position_min) / 4.
        if self.position_endstop <= self.position_min + quarter:
            return config.getboolean("homing_positive_dir", False)
        if self.position_endstop >= self.position_max - quarter:
            return config.getboolean("homing_positive_dir", True)
        raise config.error(
            "Unable to infer homing_positive_dir in section '%s': position_endstop"
            " %.3f is near no end of %.3f to %.3f; set homing_positive_dir"
            % (self.name, self.position_endstop, self.position_min,
               self.position_max))

    def get_name(self, short=False):
        """Name of the section; short: without 'stepper_'."""
        return self.name.removeprefix("stepper_") if short else self.name

    def get_range(self):
        """(least, greatest) position."""
        return self.position_min, self.position_max

    def get_homing_info(self):
        """How the rail homes."""
        return HomingInfo(
            self.homing_speed, self.position_endstop, self.homing_retract_speed,
            self.homing_retract_dist, self.homing_positive_dir,
            self.second_homing_speed)

    def get_steppers(self):
        """The MCU_steppers."""
        return list(self.steppers)

    def get_endstops(self):
        """[(endstop, name)]."""
        return list(self.endstops)

    # Endstops

    def lookup_endstop(self, endstop_pin, name):
        """The endstop on a pin, which several steppers may share."""
        ppins = pins.get(self.printer)
        pin_params = ppins.parse_pin(endstop_pin, True, True)
        key = (pin_params["chip_name"], pin_params["pin"])
        known = self.endstop_map.get(key)
        if known is None:
            return self._add_endstop(ppins, endstop_pin, key, pin_params, name)
        if (pin_params["invert"] != known["invert"]
                or pin_params["pullup"] != known["pullup"]):
            raise pins.error("Rail '%s': endstop pin '%s' is shared with different"
                             " settings; write it alike everywhere"
                             % (self.name, endstop_pin))
        return known["endstop"]

    def _add_endstop(self, ppins, endstop_pin, key, pin_params, name):
        endstop = ppins.setup_pin("endstop", endstop_pin)
        self.endstop_map[key] = {"endstop": endstop, "invert": pin_params["invert"],
                                 "pullup": pin_params["pullup"]}
        short = name.removeprefix("stepper_")
        self.endstops.append((endstop, short))
        query = self.printer.lookup_object("query_endstops", None)
        if query is not None:
            query.register_endstop(endstop, short)
        return endstop

    def add_stepper(self, stepper, endstop_pin=None, endstop_name=None):
        """Add a stepper, which stops on its own endstop or the rail's."""
        pin = endstop_pin if endstop_pin is not None else self.endstop_pin
        endstop = self.lookup_endstop(pin, endstop_name or stepper.get_name())
        endstop.add_stepper(stepper)
        self.steppers.append(stepper)

    def add_stepper_from_config(self, config):
        """Add the stepper of a section."""
        stepper = PrinterStepper(config, self.stepper_units_in_radians)
        self.add_stepper(stepper, config.get("endstop_pin", None))

    add_extra_stepper = add_stepper_from_config

    # All steppers at once

    def setup_itersolve(self, alloc_func, *params):
        """See MCU_stepper.setup_itersolve()."""
        for stepper in self.steppers:
            stepper.setup_itersolve(alloc_func, *params)

    def set_trapq(self, trapq):
        """Have all steppers follow a TrapQ."""
        for stepper in self.steppers:
            stepper.set_trapq(trapq)

    def set_position(self, coord):
        """The head is at coord."""
        for stepper in self.steppers:
            stepper.set_position(coord)

    def calc_position_from_coord(self, coord):
        """Position of the first stepper for a head at coord."""
        return self.steppers[0].calc_position_from_coord(coord)

    def get_commanded_position(self):
        """Position of the first stepper."""
        return self.steppers[0].get_commanded_position()


def LookupRail(config, need_position_minmax=True, default_position_endstop=None,
               units_in_radians=False):
    """A rail with the one stepper of its section."""
    config.get_printer().load_object(config, "query_endstops")
    rail = GenericPrinterRail(config, need_position_minmax,
                              default_position_endstop, units_in_radians)
    rail.add_stepper_from_config(config)
    return rail


PrinterRail = LookupRail


def LookupMultiRail(config, need_position_minmax=True,
                    default_position_endstop=None, units_in_radians=False):
    """A rail with the steppers of its section and of those numbered after it."""
    rail = LookupRail(config, need_position_minmax, default_position_endstop,
                      units_in_radians)
    number = 1
    while config.has_section("%s%d" % (config.get_name(), number)):
        rail.add_stepper_from_config(
            config.getsection("%s%d" % (config.get_name(), number)))
        number += 1
    return rail
