# SPDX-License-Identifier: GPL-3.0-or-later
"""A stepper motor on a micro-controller, and the ways the config makes one.

Two counts go in lockstep: the steps that were made (as the mcu counts them)
and the commanded position, in mm (radians where an axis turns).  So one is
found from the other without an offset of its own.  See
docs/internals/stepper.md.
"""

import importlib
import math

from klippy import pins
from klippy.chelper import get_ffi
from klippy.errors import ConfigError
from klippy.rail import HomingInfo, Rail, iterate_family
from klippy.stepperconfig import parse_gear_ratio, parse_step_distance
from klippy_ext.itersolve import StepperKinematics
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.stepcompress import StepCompress
from klippy_ext.trapq import TrapQ

__all__ = ["GenericPrinterRail", "HomingInfo", "LookupMultiRail", "LookupRail",
           "MCU_stepper", "PrinterRail", "PrinterStepper", "parse_gear_ratio",
           "parse_step_distance"]

# s; a pulse that no option and no driver says anything about
DEFAULT_PULSE = 0.000002
# s; drivers that need longer pulses are stepped by whole pulses
MAX_BOTH_EDGE_PULSE = 0.000000500
# config_stepper: every edge of the step pin is a step
BOTH_EDGES = -1
BOTH_EDGE_CONSTANTS = ("STEPPER_STEP_BOTH_EDGE", "STEPPER_BOTH_EDGE")

# Weights of x, y, z, or a class by its module, which is loaded when it is needed,
# by what the historical functions are called with
VARIANTS = {
    "cartesian_stepper_alloc": {
        "x": (1., 0., 0.), "y": (0., 1., 0.), "z": (0., 0., 1.)},
    "corexy_stepper_alloc": {"+": (1., 1., 0.), "-": (1., -1., 0.)},
    "corexz_stepper_alloc": {"+": (1., 0., 1.), "-": (1., 0., -1.)},
    "polar_stepper_alloc": {"a": "kin_polar.PolarBedKinematics",
                            "r": "kin_winch.RadiusKinematics"},
}
OTHER_KINDS = {"delta_stepper_alloc": "kin_delta.DeltaKinematics",
               "deltesian_stepper_alloc": "kin_deltesian.DeltesianKinematics",
               "extruder_stepper_alloc": "kin_extruder.ExtruderKinematics",
               "rotary_delta_stepper_alloc":
                   "kin_rotary_delta.RotaryDeltaKinematics",
               "winch_stepper_alloc": "kin_winch.WinchKinematics"}
# Printer objects that every stepper of the config is shown to
REGISTRIES = ("stepper_enable", "force_move", "motion_report")


def make_kinematics(kind, *params):
    """StepperKinematics by the historical name of their allocator.

    Raises ConfigError for a name or a parameter that is not known.
    """
    if kind in OTHER_KINDS:
        return load_kinematics(OTHER_KINDS[kind])(*params)
    variants = VARIANTS.get(kind)
    if variants is None:
        raise ConfigError("There are no kinematics '%s', only %s" % (
            kind, ", ".join(sorted([*VARIANTS, *OTHER_KINDS]))))
    variant = params[0].decode() if isinstance(params[0], bytes) else params[0]
    if variant not in variants:
        raise ConfigError("Kinematics '%s' have no '%s', only %s" % (
            kind, variant, ", ".join(sorted(variants))))
    chosen = variants[variant]
    if isinstance(chosen, tuple):
        return LinearKinematics(*chosen)
    return load_kinematics(chosen)()


def load_kinematics(name):
    """A class of klippy_ext by its module and name."""
    module, _, name = name.partition(".")
    return getattr(importlib.import_module("klippy_ext." + module), name)


def wrap_pointer(value, wrapper):
    """value as a wrapper object; a plug-in may have a pointer of chelper."""
    if value is None or isinstance(value, wrapper):
        return value
    ffi, _ = get_ffi()
    return wrapper.from_pointer(int(ffi.cast("uintptr_t", value)), value)


def unwrap_pointer(value):
    """What wrap_pointer() was given."""
    if value is None or value.origin is None:
        return value
    return value.origin


def round_half_up(value):
    """The nearest integer."""
    return math.floor(value + .5)


class MCU_stepper:
    """One stepper motor; pin parameters are those of pins.lookup_pin().

    rotation_dist: mm (radians) for steps_per_rotation steps.
    step_pulse_duration: s.  Raises ConfigError.
    """

    def __init__(self, name, mcu, step_pin_params, dir_pin_params, rotation_dist,
                 steps_per_rotation, step_pulse_duration=None,
                 units_in_radians=False):
        if dir_pin_params["chip"] is not mcu:
            raise ConfigError(
                "Stepper '%s': dir_pin '%s' is on mcu '%s', it must be on that of"
                " step_pin, '%s'" % (name, dir_pin_params["pin"],
                                     dir_pin_params["chip_name"], mcu.get_name()))
        self.name, self.mcu = name, mcu
        self.rotation_dist = rotation_dist
        self.steps_per_rotation = steps_per_rotation
        self.is_angular = units_in_radians
        self.step_pin, self.invert_step = (step_pin_params["pin"],
                                           step_pin_params["invert"])
        self.dir_pin = dir_pin_params["pin"]
        self.invert_dir = self.config_invert_dir = dir_pin_params["invert"]
        self.pulse_duration, self.wants_both_edges = step_pulse_duration, False
        self.oid = mcu.create_oid()
        self.stepcompress = StepCompress(self.oid)
        self.kinematics = self.trapq = None
        self.queue_step_tag = self.set_dir_tag = None
        self.reset_message = self.position_query = None
        self.active_callbacks = []
        self.printer = mcu.get_printer()
        self.motion_queuing = None
        self._join_motion()
        mcu.register_config_callback(self._build_config)
        register = self.printer.register_event_handler
        register("klippy:mcu_identify", self._join_motion)
        register("klippy:connect", self._handle_connect)

    def _join_motion(self):
        """Have steps made, as soon as the printer can."""
        if self.motion_queuing is None:
            self.motion_queuing = self.printer.lookup_object("motion_queuing", None)
            if self.motion_queuing is not None:
                self.motion_queuing.add_stepper(self)

    # Who it is

    def get_mcu(self):
        """The MCU."""
        return self.mcu

    def get_name(self, short=False):
        """Name of the section; short: without 'stepper_'."""
        return self.name.removeprefix("stepper_") if short else self.name

    def get_oid(self):
        """Number of the object on the mcu."""
        return self.oid

    def units_in_radians(self):
        """True if positions are angles."""
        return self.is_angular

    def get_step_dist(self):
        """mm (radians) a step."""
        return self.rotation_dist / self.steps_per_rotation

    def get_rotation_distance(self):
        """(mm or radians a turn, steps a turn)."""
        return self.rotation_dist, self.steps_per_rotation

    def set_rotation_distance(self, rotation_dist):
        """Another way a turn (mm) from now on; all steps must be flushed."""
        self.rotation_dist = rotation_dist
        self._use_kinematics()

    def get_dir_inverted(self):
        """(is the direction pin inverted, was it in the config), 0 or 1."""
        return self.invert_dir, self.config_invert_dir

    def set_dir_inverted(self, invert_dir):
        """Turn the other way from now on; all steps must be flushed."""
        invert_dir = int(bool(invert_dir))
        if invert_dir != self.invert_dir:
            self.invert_dir = invert_dir
            self._configure_steps()
            self.printer.send_event("stepper:set_dir_inverted", self)

    # Pulses and configuration

    def setup_default_pulse_duration(self, pulse_duration, step_both_edge):
        """What a driver is content with: s, and whether it can use both edges.

        Comes before the mcus are configured; an option of the user wins.
        """
        self.wants_both_edges = bool(step_both_edge)
        if self.pulse_duration is None:
            self.pulse_duration = pulse_duration

    def get_pulse_duration(self):
        """(s or None, both edges are wanted)."""
        return self.pulse_duration, self.wants_both_edges

    def _choose_invert(self):
        """The invert_step of config_stepper."""
        constants = self.mcu.get_constants()
        if (self.wants_both_edges and self.pulse_duration <= MAX_BOTH_EDGE_PULSE
                and any(int(constants.get(c, 0)) for c in BOTH_EDGE_CONSTANTS)):
            return BOTH_EDGES
        return self.invert_step

    def _build_config(self):
        if self.pulse_duration is None:
            self.pulse_duration = DEFAULT_PULSE
        mcu = self.mcu
        mcu.add_config_cmd(
            "config_stepper oid=%d step_pin=%s dir_pin=%s invert_step=%d"
            " step_pulse_ticks=%d"
            % (self.oid, self.step_pin, self.dir_pin, self._choose_invert(),
               mcu.seconds_to_clock(self.pulse_duration)))
        mcu.add_config_cmd("reset_step_clock oid=%d clock=0" % (self.oid,),
                           on_restart=True)
        self.queue_step_tag = mcu.lookup_command(
            "queue_step oid=%c interval=%u count=%hu add=%hi").get_command_tag()
        self.set_dir_tag = mcu.lookup_command(
            "set_next_step_dir oid=%c dir=%c").get_command_tag()
        self.reset_message = mcu.get_serial().get_msgparser().create_command(
            "reset_step_clock oid=%d clock=0" % (self.oid,))
        self.position_query = mcu.lookup_query_command(
            "stepper_get_position oid=%c", "stepper_position oid=%c pos=%i",
            oid=self.oid)
        self._configure_steps()

    def _configure_steps(self):
        """Tell the StepCompress how to write messages, once that is known."""
        if self.queue_step_tag is not None:
            mcu = self.mcu
            self.stepcompress.configure(
                mcu.seconds_to_clock(
                    mcu.get_max_stepper_error() - 0.5 * mcu.get_step_latency()),
                self.queue_step_tag, self.set_dir_tag, bool(self.invert_dir))

    # Kinematics

    def setup_itersolve(self, alloc_func, *params):
        """Move by kinematics with a historical name; see make_kinematics()."""
        self.set_stepper_kinematics(make_kinematics(alloc_func, *params))

    def get_stepper_kinematics(self):
        """What set_stepper_kinematics() was given, or None."""
        return unwrap_pointer(self.kinematics)

    def set_stepper_kinematics(self, sk):
        """Move by other kinematics from now on; returns the old ones.

        All steps must be flushed.  sk: StepperKinematics, or a pointer of
        chelper.
        """
        old, self.kinematics = self.kinematics, wrap_pointer(sk, StepperKinematics)
        if old is not None:
            old.set_stepcompress(None, self.get_step_dist())
        self._use_kinematics()
        return unwrap_pointer(old)

    def _use_kinematics(self):
        kinematics, queuing = self.kinematics, self.motion_queuing
        if kinematics is not None:
            kinematics.set_stepcompress(self.stepcompress, self.get_step_dist())
            if queuing is not None:
                # what the trapq remembers was made into steps by others
                kinematics.set_trapq(None)
                kinematics.generate_steps(queuing.last_step_gen_time)
            kinematics.set_trapq(self.trapq)
        if queuing is not None:
            queuing.set_kinematics(self)

    def get_trapq(self):
        """What set_trapq() was given, or None."""
        return unwrap_pointer(self.trapq)

    def set_trapq(self, tq):
        """Follow a TrapQ (None: stand still); returns the old one."""
        old, self.trapq = self.trapq, wrap_pointer(tq, TrapQ)
        if self.kinematics is not None:
            self.kinematics.set_trapq(self.trapq)
        return unwrap_pointer(old)

    def is_active_axis(self, axis):
        """Can a move of 'x', 'y' or 'z' move this stepper?"""
        return self.kinematics is not None and self.kinematics.is_active_axis(axis)

    def calc_position_from_coord(self, coord):
        """Position for a head that rests at coord (x, y, z, ...)."""
        return self.kinematics.calc_position_from_coord(coord[0], coord[1], coord[2])

    # Position

    def set_position(self, coord):
        """The head is at coord: nothing moves, no step is forgotten."""
        self.kinematics.set_position(coord[0], coord[1], coord[2])

    def get_commanded_position(self):
        """Position after all steps so far."""
        return self.kinematics.get_commanded_pos()

    def get_mcu_position(self, cmd_pos=None):
        """Steps, as the mcu counts, at a commanded position (None: now)."""
        steps = self.stepcompress.get_last_position()
        if cmd_pos is None:
            return steps
        way = cmd_pos - self.get_commanded_position()
        return steps + round_half_up(way / self.get_step_dist())

    def mcu_to_commanded_position(self, mcu_pos):
        """Commanded position at so many steps of the mcu."""
        way = mcu_pos - self.stepcompress.get_last_position()
        return self.get_commanded_position() + way * self.get_step_dist()

    def get_past_mcu_position(self, print_time):
        """Steps, as the mcu counted at a time not long ago."""
        return self.stepcompress.find_past_position(
            self.mcu.print_time_to_clock(print_time))

    def dump_steps(self, count, start_clock, end_clock):
        """(newest first: at most count runs that overlap the span, how many).

        A run is as StepCompress.extract_old() has it.
        """
        runs = self.stepcompress.extract_old(count, start_clock, end_clock)
        return runs, len(runs)

    def _handle_connect(self):
        # an mcu that was not reset has counted steps before
        if self.position_query is not None and not self.mcu.is_fileoutput():
            self._read_position()

    def note_homing_end(self):
        """The mcu may have stopped the motor by itself: find out where.

        All steps must be flushed.  Waits for the answer of the mcu.
        """
        self.stepcompress.reset(0)
        self.stepcompress.queue_message(self.reset_message)
        if not self.mcu.is_fileoutput():
            self._read_position()

    def _read_position(self):
        params = self.position_query.send([self.oid])
        position = -params["pos"] if self.invert_dir else params["pos"]
        mcu = self.mcu
        print_time = mcu.estimated_print_time(params["#receive_time"])
        self.stepcompress.set_last_position(
            mcu.print_time_to_clock(print_time), position)
        self.printer.send_event("stepper:sync_mcu_position", self)

    # Activity

    def add_active_callback(self, callback):
        """Call callback(print_time) when the motor is about to move, once."""
        self.active_callbacks.append(callback)

    def check_active(self, print_time):
        """Call the callbacks if steps up to print_time will be made."""
        if not self.active_callbacks or self.kinematics is None:
            return
        ahead = self.kinematics.scan_window()[1]
        start = self.kinematics.check_active(print_time + ahead)
        if not start:
            return
        callbacks, self.active_callbacks = self.active_callbacks, []
        for callback in callbacks:
            callback(start - ahead)

    def generate_steps(self, flush_time):
        """Make the steps up to flush_time; motion_queuing does that anyway."""
        self.check_active(flush_time)
        if self.kinematics is not None:
            self.kinematics.generate_steps(flush_time)


def PrinterStepper(config, units_in_radians=False):
    """The MCU_stepper of a section, shown to all who keep track of steppers."""
    printer = config.get_printer()
    printer.load_object(config, "motion_queuing")
    ppins = pins.get(printer)
    step_pin = ppins.lookup_pin(config.get("step_pin"), can_invert=True)
    dir_pin = ppins.lookup_pin(config.get("dir_pin"), can_invert=True)
    rotation_dist, steps = parse_step_distance(config, units_in_radians, True)
    pulse = config.getfloat("step_pulse_duration", None, minval=0., maxval=.001)
    stepper = MCU_stepper(config.get_name(), step_pin["chip"], step_pin, dir_pin,
                          rotation_dist, steps, pulse, units_in_radians)
    for name in REGISTRIES:
        printer.load_object(config, name).register_stepper(config, stepper)
    return stepper


class GenericPrinterRail(Rail):
    """A rail whose steppers are those of the config."""

    make_stepper = staticmethod(PrinterStepper)


class PrinterRail(GenericPrinterRail):
    """A rail with the stepper of its own section."""

    def __init__(self, config, need_position_minmax=True,
                 default_position_endstop=None, units_in_radians=False):
        super().__init__(config, need_position_minmax, default_position_endstop,
                         units_in_radians)
        self.add_stepper(self.make_stepper(config, units_in_radians))


def LookupRail(config, need_position_minmax=True, default_position_endstop=None,
               units_in_radians=False):
    """The rail of a section, with one stepper."""
    return PrinterRail(config, need_position_minmax, default_position_endstop,
                       units_in_radians)


def LookupMultiRail(config, need_position_minmax=True,
                    default_position_endstop=None, units_in_radians=False):
    """The rail of a section and of those numbered after it."""
    rail = PrinterRail(config, need_position_minmax, default_position_endstop,
                       units_in_radians)
    for section in iterate_family(config):
        rail.add_extra_stepper(section)
    return rail
