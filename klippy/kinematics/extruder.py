# SPDX-License-Identifier: GPL-3.0-or-later
"""Extruders: the filament's axis with its limits, heater and drive.

Filament is in mm, speeds in mm/s.  The drive (ExtruderStepper) leads the
filament by pressure advance; see docs/internals/motion.md.
"""

import math

from klippy import dangers, motionqueue, stepper
from klippy.errors import CommandError
from klippy.kinematics.pressure_advance import PressureAdvance
from klippy.movetaker import MoveTaker
from klippy.record import replace
from klippy.toolhead import NoExtruder
from klippy_ext.kin_extruder import ExtruderKinematics
from klippy_ext.trapq import TrapMove

__all__ = ["DummyExtruder", "ExtruderStepper", "PrinterExtruder",
           "add_printer_objects"]

DummyExtruder = NoExtruder
MAX_EXTRUDERS = 100
HOT_HINT = "See the 'min_extrude_temp' config option for details"


class ExtruderStepper:
    """One motor that follows the filament of an extruder, or of none."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.name = config.get_name().rpartition(" ")[2]
        self.motion_queuing = self.printer.load_object(config, "motion_queuing")
        self.settings = PressureAdvance(0., 0.)
        self.config_settings = PressureAdvance.from_config(config)
        self.stepper = stepper.PrinterStepper(config)
        self.drive = ExtruderKinematics()
        self.stepper.set_stepper_kinematics(self.drive)
        self.motion_queue = None
        self.printer.register_event_handler("klippy:connect", self._handle_connect)
        self._register_commands()

    def _register_commands(self):
        gcode = self.printer.lookup_object("gcode")
        if self.name == "extruder":
            gcode.register_mux_command(
                "SET_PRESSURE_ADVANCE", "EXTRUDER", None,
                self.cmd_default_SET_PRESSURE_ADVANCE,
                desc=self.cmd_SET_PRESSURE_ADVANCE_help)
        for name in ("SET_PRESSURE_ADVANCE", "SET_EXTRUDER_ROTATION_DISTANCE",
                     "SYNC_EXTRUDER_MOTION"):
            gcode.register_mux_command(
                name, "EXTRUDER", self.name, getattr(self, "cmd_" + name),
                desc=getattr(self, "cmd_%s_help" % (name,)))

    def _handle_connect(self):
        self._use(self.config_settings)

    @property
    def pressure_advance(self):
        """The part that is proportional to the speed, s."""
        return self.settings.advance

    @property
    def pressure_advance_smooth_time(self):
        """s over which the lead is averaged."""
        return self.settings.smooth_time

    def get_status(self, eventtime):
        """Status of the drive."""
        return {**self.settings.get_status(), "motion_queue": self.motion_queue}

    def find_past_position(self, print_time):
        """Filament position at a time not long ago."""
        position = self.stepper.get_past_mcu_position(print_time)
        return self.stepper.mcu_to_commanded_position(position)

    def sync_to_extruder(self, extruder_name):
        """Follow an extruder from now on; None or "": none.

        Raises CommandError if there is no such extruder.
        """
        extruder = None
        if extruder_name:
            extruder = self.printer.lookup_object(extruder_name, None)
            if not isinstance(extruder, PrinterExtruder):
                raise CommandError("'%s' is not a valid extruder" % (extruder_name,))
        self.printer.lookup_object("toolhead").flush_step_generation()
        self.stepper.set_trapq(None)
        self.motion_queue = extruder_name or None
        self._shape()
        if extruder is not None:
            self.stepper.set_position([extruder.last_position, 0., 0.])
            self.stepper.set_trapq(extruder.get_trapq())

    def _shape(self):
        """Be shaped, or not, as what this follows is."""
        shaper = self.printer.lookup_object("input_shaper", None)
        if shaper is not None:
            shaper.shape_drive(self)

    def set_pressure_advance(self, pressure_advance, smooth_time):
        """Lead the moves to come by pressure_advance s, averaged over smooth_time."""
        self._use(replace(self.settings, advance=pressure_advance,
                                      smooth_time=smooth_time))

    def _use(self, settings):
        """Lead the moves to come as a PressureAdvance says."""
        window = self.motion_queuing.reserve_scan_window(
            settings.get_reach() + max(self.drive.get_shaper_window()))
        toolhead = self.printer.lookup_object("toolhead")
        toolhead.register_lookahead_callback(
            lambda print_time: self._apply(print_time, settings, window))
        self.settings = settings

    def _apply(self, print_time, settings, window):
        settings.apply(self.drive, print_time)
        self.motion_queuing.release_scan_window(window)

    cmd_SET_PRESSURE_ADVANCE_help = "Set pressure advance parameters"

    def cmd_default_SET_PRESSURE_ADVANCE(self, gcmd):
        """Set it for the active extruder."""
        extruder = self.printer.lookup_object("toolhead").get_extruder()
        drive = getattr(extruder, "extruder_stepper", None)
        if drive is None:
            raise gcmd.error("Active extruder does not have a stepper")
        if drive.motion_queue is None:
            raise gcmd.error("The stepper of the active extruder follows no extruder")
        drive.cmd_SET_PRESSURE_ADVANCE(gcmd)

    def cmd_SET_PRESSURE_ADVANCE(self, gcmd):
        """Set ADVANCE, SMOOTH_TIME, MODEL, OFFSET, VELOCITY, TIME_OFFSET."""
        options = dangers.get(self.printer)
        self._use(self.settings.change(
            gcmd, options.override_pressure_advance_smooth_time_max))
        text = self.settings.describe()
        self.printer.set_rollover_info(self.name, "%s: %s" % (self.name, text),
                                       log=options.log_pressure_advance_changes)
        gcmd.respond_info(text, log=False)

    cmd_SET_EXTRUDER_ROTATION_DISTANCE_help = "Set extruder rotation distance"

    def cmd_SET_EXTRUDER_ROTATION_DISTANCE(self, gcmd):
        """Set DISTANCE (mm a rotation; negative turns the other way), or show it."""
        distance = gcmd.get_float("DISTANCE", None)
        if distance is not None:
            if not distance:
                raise gcmd.error("Rotation distance can not be zero")
            self._set_rotation_distance(distance)
        else:
            distance = self.stepper.get_rotation_distance()[0]
            invert, original = self.stepper.get_dir_inverted()
            if invert != original:
                distance = -distance
        gcmd.respond_info("Extruder '%s' rotation distance set to %0.6f"
                          % (self.name, distance))

    def _set_rotation_distance(self, distance):
        self.printer.lookup_object("toolhead").flush_step_generation()
        _, original = self.stepper.get_dir_inverted()
        self.stepper.set_dir_inverted(original ^ (distance < 0.))
        self.stepper.set_rotation_distance(abs(distance))

    cmd_SYNC_EXTRUDER_MOTION_help = "Set extruder stepper motion queue"

    def cmd_SYNC_EXTRUDER_MOTION(self, gcmd):
        """Follow extruder MOTION_QUEUE; none if that is empty."""
        name = gcmd.get("MOTION_QUEUE")
        self.sync_to_extruder(name)
        gcmd.respond_info("Extruder '%s' now syncing with '%s'" % (self.name, name))


class PrinterExtruder(MoveTaker):
    """An extruder: its limits, its queue of filament moves, heater and drive."""

    def __init__(self, config, extruder_num):
        self.printer = config.get_printer()
        self.name = config.get_name()
        self.heater, self.owns_heater = make_heater(config, extruder_num)
        self._read_limits(config)
        self.last_position = 0.
        self.segment = TrapMove()
        self.trapq = motionqueue.get(self.printer).allocate_trapq()
        self.extruder_stepper = None
        if has_drive(config):
            self.extruder_stepper = ExtruderStepper(config)
            self.extruder_stepper.stepper.set_trapq(self.trapq)
            self.extruder_stepper.motion_queue = self.name
        self._register_commands()

    def _read_limits(self, config):
        self.nozzle_diameter = config.getfloat("nozzle_diameter", above=0.)
        filament_diameter = config.getfloat("filament_diameter",
                                            minval=self.nozzle_diameter)
        self.filament_area = math.pi * (filament_diameter * .5) ** 2
        usual_section = 4. * self.nozzle_diameter ** 2
        usual_ratio = usual_section / self.filament_area
        section = config.getfloat("max_extrude_cross_section", usual_section, above=0.)
        self.max_extrude_ratio = section / self.filament_area
        velocity, accel = self.printer.lookup_object("toolhead").get_max_velocity()
        self.max_e_velocity = config.getfloat(
            "max_extrude_only_velocity", velocity * usual_ratio, above=0.)
        self.max_e_accel = config.getfloat(
            "max_extrude_only_accel", accel * usual_ratio, above=0.)
        self.max_e_dist = config.getfloat("max_extrude_only_distance", 50., minval=0.)
        self.instant_corner_v = config.getfloat(
            "instantaneous_corner_velocity", 1., minval=0.)

    def _register_commands(self):
        gcode = self.printer.lookup_object("gcode")
        if self.name == "extruder":
            self.printer.lookup_object("toolhead").set_extruder(self, 0.)
            gcode.register_command("M104", self.cmd_M104)
            gcode.register_command("M109", self.cmd_M109)
        gcode.register_mux_command(
            "ACTIVATE_EXTRUDER", "EXTRUDER", self.name, self.cmd_ACTIVATE_EXTRUDER,
            desc=self.cmd_ACTIVATE_EXTRUDER_help)

    # The axis

    def check_move(self, move, axis_index):
        """Raises CommandError if filament must not move so; may slow the move."""
        if not self.heater.can_extrude:
            raise CommandError("Extrude below minimum temp\n" + HOT_HINT)
        way, ratio = move.d_e, move.axes_r_e
        is_still = move.d_x == 0. and move.d_y == 0. and move.arc is None
        if is_still or ratio < 0.:
            if abs(way) > self.max_e_dist:
                raise CommandError(
                    "Extrude only move too long (%.3fmm vs %.3fmm)\nSee the"
                    " 'max_extrude_only_distance' config option for details"
                    % (way, self.max_e_dist))
            move.limit_speed(self.max_e_velocity / abs(ratio),
                             self.max_e_accel / abs(ratio))
        elif (ratio > self.max_extrude_ratio
              and way > self.nozzle_diameter * self.max_extrude_ratio):
            raise CommandError(
                "Move exceeds maximum extrusion (%.3fmm^2 vs %.3fmm^2)\nSee the"
                " 'max_extrude_cross_section' config option for details"
                % (ratio * self.filament_area,
                   self.max_extrude_ratio * self.filament_area))
        return 0

    def calc_junction(self, prev_move, move, axis_index):
        """Square of the speed at which filament may change pace."""
        change = abs(move.axes_r_e - prev_move.axes_r_e)
        if change == 0.:
            return move.max_cruise_v2
        limit = self.instant_corner_v / change
        return limit * limit

    def process_move(self, print_time, move, axis_index):
        """Put the filament's part of a planned move on the queue."""
        ratio = move.axes_r_e
        pace = abs(ratio)
        segment = self.segment
        segment.accel_t, segment.cruise_t = move.accel_t, move.cruise_t
        segment.decel_t = move.decel_t
        segment.start_x = move.start_e
        segment.axes_r_x = 1. if ratio > 0. else -1.
        # Pressure advance is for filament that is laid down along a way
        is_led = ratio > 0. and (move.d_x != 0. or move.d_y != 0.
                                 or move.arc is not None)
        segment.axes_r_y = 1. if is_led else 0.
        segment.start_v, segment.cruise_v = move.start_v * pace, move.cruise_v * pace
        segment.accel = move.accel * pace
        if move.arc is not None and self.is_shaped():
            # Shares of the axes change from segment to segment of the head
            self.trapq.append_like(print_time, segment, move)
        else:
            self.trapq.append(print_time, segment)
        self.last_position = move.end_e
        return 0

    def find_past_position(self, print_time):
        """Filament position at a time not long ago."""
        if self.extruder_stepper is None:
            return 0.
        return self.extruder_stepper.find_past_position(print_time)

    def update_move_time(self, flush_time, clear_history_time):
        """Nothing to do: the motion queue keeps the trapq tidy."""

    # Others

    def get_name(self):
        """Name of the section."""
        return self.name

    def is_shaped(self):
        """True if motors that follow it are shaped as the head, when that is."""
        shaper = self.printer.lookup_object("input_shaper", None)
        return shaper is not None and self.name in shaper.drives.names

    def get_axis_gcode_id(self):
        """Letter of the axis."""
        return "E"

    def get_heater(self):
        """The heater."""
        return self.heater

    def get_trapq(self):
        """The TrapQ of the filament."""
        return self.trapq

    def get_status(self, eventtime):
        """Status of heater and drive."""
        status = dict(self.heater.get_status(eventtime),
                      can_extrude=self.heater.can_extrude)
        if self.extruder_stepper is not None:
            status.update(self.extruder_stepper.get_status(eventtime))
        return status

    def stats(self, eventtime):
        """(is active, line for the log)."""
        if not self.owns_heater:
            return False, ""
        return self.heater.stats(eventtime)

    # Commands

    def cmd_M104(self, gcmd, wait=False):
        """Set the temperature S of extruder T (the active one without T)."""
        target = gcmd.get_float("S", 0.)
        index = gcmd.get_int("T", None, minval=0)
        if index is None:
            extruder = self.printer.lookup_object("toolhead").get_extruder()
        else:
            section = "extruder%d" % (index,) if index else "extruder"
            extruder = self.printer.lookup_object(section, None)
            if extruder is None:
                if target <= 0.:
                    return
                raise gcmd.error("Extruder not configured")
        heaters = self.printer.lookup_object("heaters")
        heaters.set_temperature(extruder.get_heater(), target, wait)

    def cmd_M109(self, gcmd):
        """Set the temperature and wait for it."""
        self.cmd_M104(gcmd, wait=True)

    cmd_ACTIVATE_EXTRUDER_help = "Change the active extruder"

    def cmd_ACTIVATE_EXTRUDER(self, gcmd):
        """Make this the active extruder."""
        toolhead = self.printer.lookup_object("toolhead")
        if toolhead.get_extruder() is self:
            gcmd.respond_info("Extruder %s already active" % (self.name,))
            return
        gcmd.respond_info("Activating extruder %s" % (self.name,))
        toolhead.flush_step_generation()
        toolhead.set_extruder(self, self.last_position)
        self.printer.send_event("extruder:activate_extruder")


def make_heater(config, extruder_num):
    """(heater of the section of an extruder, if it is its own).

    Raises ConfigError if it shares one that is not there.
    """
    heaters = config.get_printer().load_object(config, "heaters")
    shared = config.get("shared_heater", None)
    if shared is None:
        return heaters.setup_heater(config, "T%d" % (extruder_num,)), True
    return heaters.lookup_heater(shared), False


def has_drive(config):
    """True if the section of an extruder describes a motor too."""
    return any(config.get(option, None) is not None
               for option in ("step_pin", "dir_pin", "rotation_distance"))


def add_printer_objects(config):
    """Make extruder, extruder1, ... as far as there are sections."""
    printer = config.get_printer()
    for number in range(MAX_EXTRUDERS):
        section = "extruder%d" % (number,) if number else "extruder"
        if not config.has_section(section):
            break
        printer.add_object(section,
                           PrinterExtruder(config.getsection(section), number))
