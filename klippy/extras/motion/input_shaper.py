# SPDX-License-Identifier: GPL-3.0-or-later
"""[input_shaper]: moves that do not set off the resonances of the machine.

The steppers of the tool head follow the plan averaged over a little time, each
axis in its own way.  See docs/input_shaping.md.
"""

from collections import namedtuple

from klippy.errors import CommandError
from klippy.extras import shaper_defs, shaper_kernels
from klippy.extras.shaper_drives import ShapedDrives
from klippy_ext.shaper import ShapedPath

AXES = "xyz"
DEFAULT_TYPE = "mzv"
DEFAULT_DAMPING = 0.1
NAMES = (*shaper_defs.FAMILIES, *shaper_kernels.DESIGNS)


class AxisSetting(namedtuple("AxisSetting", (
        "shaper_type", "shaper_freq", "damping_ratio"))):
    """One axis: shaper_freq in Hz, 0 for none."""
    __slots__ = ()

    def find_fault(self):
        """What is wrong with the setting, or None."""
        if self.shaper_type not in NAMES:
            return "there is no shaper '%s': it is one of %s" % (
                self.shaper_type, ", ".join(NAMES))
        top = find_max_damping(self.shaper_type)
        if not 0. <= self.damping_ratio <= top:
            return "damping ratio %g: of shaper '%s' it is 0 to %g" % (
                self.damping_ratio, self.shaper_type, top)
        return None

    def apply(self, path, axis):
        """Set up an axis (0..2) of a ShapedPath."""
        args = self.shaper_type, self.shaper_freq, self.damping_ratio
        if self.shaper_freq <= 0.:
            return
        if self.shaper_type in shaper_kernels.DESIGNS:
            kernel = shaper_kernels.make_kernel(*args)
            path.set_kernel(axis, kernel.coeffs, kernel.half)
        else:
            shaper = shaper_defs.make_shaper(*args)
            path.set_impulses(axis, shaper.weights, shaper.delays)

    def get_status(self):
        """The setting by name."""
        return self._asdict()


def find_max_damping(shaper_type):
    """Greatest damping ratio that a shaper is made for."""
    family = shaper_defs.FAMILIES.get(shaper_type)
    return shaper_kernels.MAX_DAMPING if family is None else family.max_damping


def read_setting(config, axis):
    """The AxisSetting of a section.  Raises ConfigError."""
    default = config.get("shaper_type", DEFAULT_TYPE)
    setting = AxisSetting(
        config.get("shaper_type_" + axis, default).lower(),
        config.getfloat("shaper_freq_" + axis, 0., minval=0.),
        config.getfloat("damping_ratio_" + axis, DEFAULT_DAMPING, minval=0.))
    fault = setting.find_fault()
    if fault is not None:
        raise config.error("Section '%s', axis %s: %s"
                           % (config.get_name(), axis, fault))
    return setting


class InputShaper:
    """Object input_shaper."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.settings = {axis: read_setting(config, axis) for axis in AXES}
        self.drives = ShapedDrives(self.printer,
                                   config.getlist("enabled_extruders", ()))
        self.section, self.config_error = config.get_name(), config.error
        self.disabled = frozenset()
        self.toolhead = None
        self.path, self.steppers = None, []
        self.n_disabled = 0
        self.printer.register_event_handler("klippy:connect", self._handle_connect)
        gcode = self.printer.lookup_object("gcode")
        for name in ("SET_INPUT_SHAPER", "ENABLE_INPUT_SHAPER", "DISABLE_INPUT_SHAPER"):
            gcode.register_command(name, getattr(self, "cmd_" + name),
                                   desc=getattr(self, "cmd_%s_help" % (name,)))

    def _handle_connect(self):
        fault = self.drives.find_fault()
        if fault is not None:
            raise self.config_error("Section '%s', option 'enabled_extruders': %s"
                                    % (self.section, fault))
        self.toolhead = self.printer.lookup_object("toolhead")
        self.queuing = self.printer.lookup_object("motion_queuing")
        self.steppers = [stepper for stepper in
                         self.toolhead.get_kinematics().get_steppers()
                         if stepper.kinematics is not None]
        self._switch()

    # Paths

    def _list_effective(self):
        """The AxisSettings by which axes are shaped now."""
        return [setting._replace(shaper_freq=0.)
                if self.n_disabled or axis in self.disabled else setting
                for axis, setting in self.settings.items()]

    def _make_path(self):
        """A ShapedPath, or None where nothing is shaped."""
        settings = self._list_effective()
        if not any(setting.shaper_freq > 0. for setting in settings):
            return None
        path = ShapedPath()
        for axis, setting in enumerate(settings):
            setting.apply(path, axis)
        return path

    def _switch(self, drives=None):
        """Shape by what is set now, from the end of all moves on.

        drives: the ShapedDrives from there on, if others.
        """
        path = self._make_path()
        paths = [self._make_path() for _ in self.steppers]
        reserved = self._reserve(path)
        try:
            self._come_to_rest()
            self.path, self.drives = path, drives or self.drives
            for stepper, own in zip(self.steppers, paths, strict=True):
                stepper.kinematics.set_shaper(own)
            for drive in self.drives.find_drives():
                self.drives.apply(drive, path, self.toolhead.get_trapq())
        finally:
            self.queuing.release_scan_window(reserved)

    def _reserve(self, path):
        """Have the planner keep what steps will depend on."""
        return self.queuing.reserve_scan_window(
            self.drives.get_reach(path) if path is not None else 0.)

    def _come_to_rest(self):
        """Make all steps, so far that the widest window sees only rest."""
        self.toolhead.flush_step_generation()
        self.queuing.note_mcu_movequeue_activity(self.toolhead.print_time)
        self.queuing.flush_all_steps()
        self.queuing.settle()

    def shape_drive(self, drive):
        """An ExtruderStepper follows another extruder, or none, from now on."""
        if self.toolhead is None or not (self.drives.names or drive.drive.head):
            return
        reserved = self._reserve(self.path)
        try:
            self._come_to_rest()
            self.drives.apply(drive, self.path, self.toolhead.get_trapq())
        finally:
            self.queuing.release_scan_window(reserved)

    # Use by others

    def get_settings(self):
        """{axis: AxisSetting} as last set."""
        return dict(self.settings)

    def disable_shaping(self):
        """Follow the plan itself until enable_shaping(), as often as that."""
        self.n_disabled += 1
        if self.n_disabled == 1:
            self._switch()

    def enable_shaping(self):
        """Undo a disable_shaping()."""
        if not self.n_disabled:
            return
        self.n_disabled -= 1
        if not self.n_disabled:
            self._switch()

    def get_status(self, eventtime):
        """{axis: setting}, disabled_axes, enabled_extruders of printer.input_shaper."""
        status = {axis: setting.get_status()
                  for axis, setting in self.settings.items()}
        return {**status, "disabled_axes": sorted(self.disabled),
                "enabled_extruders": list(self.drives.names)}

    # Commands

    cmd_SET_INPUT_SHAPER_help = "Change or show the shapers of the axes"

    def cmd_SET_INPUT_SHAPER(self, gcmd):
        """Change what is named, then tell all settings."""
        settings = {axis: self._read_command(gcmd, axis) for axis in AXES}
        if settings != self.settings:
            self.settings = settings
            if not self.n_disabled:
                self._switch()
        gcmd.respond_info("\n".join(
            "shaper_type_%s:%s shaper_freq_%s:%.3f damping_ratio_%s:%.6f" % (
                axis, setting.shaper_type, axis, setting.shaper_freq,
                axis, setting.damping_ratio)
            for axis, setting in self.settings.items()))

    def _read_command(self, gcmd, axis):
        old, name = self.settings[axis], axis.upper()
        default = gcmd.get("SHAPER_TYPE", old.shaper_type)
        setting = AxisSetting(
            gcmd.get("SHAPER_TYPE_" + name, default).lower(),
            gcmd.get_float("SHAPER_FREQ_" + name, old.shaper_freq, minval=0.),
            gcmd.get_float("DAMPING_RATIO_" + name, old.damping_ratio, minval=0.))
        fault = setting.find_fault()
        if fault is not None:
            raise CommandError("Axis %s: %s" % (name, fault))
        return setting

    cmd_ENABLE_INPUT_SHAPER_help = "Shape axes or extruders again"

    def cmd_ENABLE_INPUT_SHAPER(self, gcmd):
        """Shape AXIS=xy and EXTRUDER=a,b; all axes if neither is named."""
        self._change_use(gcmd, True)

    cmd_DISABLE_INPUT_SHAPER_help = "Leave axes or extruders unshaped"

    def cmd_DISABLE_INPUT_SHAPER(self, gcmd):
        """Do not shape AXIS=xy and EXTRUDER=a,b; no axis if neither is named."""
        self._change_use(gcmd, False)

    def _change_use(self, gcmd, is_enabled):
        names = split_names(gcmd.get("EXTRUDER", ""))
        axes = read_axes(gcmd, "" if names else AXES)
        drives = self.drives.change(names, is_enabled)
        disabled = self.disabled - axes if is_enabled else self.disabled | axes
        is_changed = (disabled, drives.names) != (self.disabled, self.drives.names)
        self.disabled = disabled
        if is_changed and not self.n_disabled:
            self._switch(drives)
        self.drives = drives
        shaped = [axis for axis, setting in zip(
            AXES, self._list_effective(), strict=True) if setting.shaper_freq > 0.]
        gcmd.respond_info("Shaped axes: %s; extruders: %s" % (
            ", ".join(shaped) or "none", ", ".join(self.drives.names) or "none"))


def split_names(text):
    """Names between commas."""
    return [name.strip() for name in text.split(",") if name.strip()]


def read_axes(gcmd, default):
    """Set of the axes of AXIS=, such as xy or x,y.  Raises CommandError."""
    text = gcmd.get("AXIS", default).lower()
    axes = frozenset(text.replace(",", "").replace(" ", ""))
    if not axes <= frozenset(AXES):
        raise CommandError("AXIS=%s of '%s' is not made of x, y and z"
                           % (text, gcmd.get_commandline()))
    return axes


def load_config(config):
    """Section [input_shaper]."""
    return InputShaper(config)
