# SPDX-License-Identifier: GPL-3.0-or-later
"""[skew_correction]: moves on an axis that is not square to the others.

A factor is the way along the first axis of a plane a mm of the second, as the
machine makes it; the transform takes it back.  See docs/motion_features.md.
"""

import math
from collections import namedtuple

from klippy.errors import CommandError

PLANES = ("XY", "XZ", "YZ")


class Skew(namedtuple("Skew", ("xy", "xz", "yz"), defaults=(0., 0., 0.))):
    """Factors of the planes; no unit."""
    __slots__ = ()

    def correct(self, position):
        """Where to send the head so that it gets to a position."""
        x, y, z = position[:3]
        y -= z * self.yz
        return [x - y * self.xy - z * self.xz, y, z, *position[3:]]

    def uncorrect(self, position):
        """Undo correct()."""
        x, y, z = position[:3]
        return [x + y * self.xy + z * self.xz, y + z * self.yz, z, *position[3:]]


def calc_factor(ac, bd, ad):
    """Factor of a plane from three lengths (mm) of a printed square A B C D.

    A is at the origin, B along the second axis, so that AD runs along the
    first.  ValueError if no parallelogram has these lengths.
    """
    # of a parallelogram: ac^2 + bd^2 = 2 ad^2 + 2 ab^2
    ab2 = 0.5 * (ac * ac + bd * bd) - ad * ad
    if ab2 <= 0.:
        raise ValueError("no square: the diagonals are too short for the side")
    cosine = 0.25 * (ac * ac - bd * bd) / (math.sqrt(ab2) * ad)
    if not abs(cosine) < 1.:
        raise ValueError("no square: the diagonals are too different")
    return cosine / math.sqrt(1. - cosine * cosine)


class SkewCorrection:
    """Object skew_correction."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.name = config.get_name()
        self.skew = Skew()
        self.current_profile_name = ""
        self.profiles = self._read_profiles(config)
        self.gcode_move = self.printer.load_object(config, "gcode_move")
        self.next_transform = None
        self.printer.register_event_handler("klippy:connect", self._handle_connect)
        gcode = self.printer.lookup_object("gcode")
        for name in ("GET_CURRENT_SKEW", "CALC_MEASURED_SKEW", "SET_SKEW",
                     "SKEW_PROFILE"):
            gcode.register_command(name, getattr(self, "cmd_" + name),
                                   desc=getattr(self, "cmd_%s_help" % (name,)))

    def _read_profiles(self, config):
        return {section.get_name().split(None, 1)[1]: Skew(*(
                    section.getfloat(plane.lower() + "_skew") for plane in PLANES))
                for section in config.get_prefix_sections(self.name + " ")}

    def _handle_connect(self):
        self.next_transform = self.gcode_move.set_move_transform(self, force=True)

    def get_status(self, eventtime):
        """current_profile_name: "" if none is in use."""
        return {"current_profile_name": self.current_profile_name}

    # The transform

    def get_position(self):
        """Position in the coordinates of a square machine."""
        return self.skew.uncorrect(self.next_transform.get_position())

    def move(self, newpos, speed):
        """Go to a position in the coordinates of a square machine."""
        self.next_transform.move(self.skew.correct(newpos), speed)

    def passes_unchanged(self):
        """True while moves go on as they come."""
        return self.skew == Skew()

    def _use(self, skew, profile_name=""):
        self.skew, self.current_profile_name = skew, profile_name
        self.gcode_move.reset_last_position()

    # Commands

    cmd_GET_CURRENT_SKEW_help = "Tell the skew that is corrected"

    def cmd_GET_CURRENT_SKEW(self, gcmd):
        """Tell the angle of each plane."""
        lines = ["Current Printer Skew:"]
        for plane, factor in zip(PLANES, self.skew, strict=True):
            lines.append("%s Skew: %s" % (plane, describe(factor)))
        gcmd.respond_info("\n".join(lines))

    cmd_CALC_MEASURED_SKEW_help = "Calculate the skew from a measured print"

    def cmd_CALC_MEASURED_SKEW(self, gcmd):
        """Tell the skew of lengths AC, BD and AD."""
        lengths = [gcmd.get_float(name, above=0.) for name in ("AC", "BD", "AD")]
        gcmd.respond_info("Calculated Skew: "
                          + describe(read_factor(gcmd, "AC, BD, AD", lengths)))

    cmd_SET_SKEW_help = "Set the skew from lengths of a measured print"

    def cmd_SET_SKEW(self, gcmd):
        """Correct the planes for which lengths AC,BD,AD are given; CLEAR=1: none."""
        if gcmd.get_int("CLEAR", 0):
            self._use(Skew())
            return
        factors = {}
        for plane in PLANES:
            text = gcmd.get(plane, None)
            if text is not None:
                factors[plane.lower()] = read_factor(gcmd, plane,
                                                     read_lengths(gcmd, plane, text))
        if factors:
            self._use(self.skew._replace(**factors))

    cmd_SKEW_PROFILE_help = "Use, save or remove a profile of skew_correction"

    def cmd_SKEW_PROFILE(self, gcmd):
        """LOAD, SAVE or REMOVE the profile of a name."""
        actions = {"LOAD": self._load, "SAVE": self._save, "REMOVE": self._remove}
        chosen = [key for key in actions if gcmd.get(key, None) is not None]
        if len(chosen) != 1:
            raise gcmd.error("'%s' needs one of LOAD=, SAVE= and REMOVE="
                             % (gcmd.get_commandline(),))
        name = gcmd.get(chosen[0]).strip()
        if not name:
            raise gcmd.error("%s of '%s' is empty: it must name a profile"
                             % (chosen[0], gcmd.get_commandline()))
        actions[chosen[0]](gcmd, name)

    def _check_known(self, gcmd, name):
        if name not in self.profiles:
            raise gcmd.error(
                "There is no skew profile '%s', only %s"
                % (name, ", ".join(sorted(self.profiles)) or "none"))

    def _load(self, gcmd, name):
        self._check_known(gcmd, name)
        self._use(self.profiles[name], name)

    def _save(self, gcmd, name):
        configfile = self.printer.lookup_object("configfile")
        section = "%s %s" % (self.name, name)
        for plane, factor in zip(PLANES, self.skew, strict=True):
            configfile.set(section, plane.lower() + "_skew", "%.9f" % (factor,))
        self.profiles = {**self.profiles, name: self.skew}
        gcmd.respond_info(
            "Skew Correction state has been saved to profile [%s]\nfor the current"
            " session.  The SAVE_CONFIG command will update the printer config\n"
            "file and restart the printer." % (name,))

    def _remove(self, gcmd, name):
        self._check_known(gcmd, name)
        self.printer.lookup_object("configfile").remove_section(
            "%s %s" % (self.name, name))
        self.profiles = {key: skew for key, skew in self.profiles.items()
                         if key != name}
        gcmd.respond_info(
            "Profile [%s] is removed for this session.  The SAVE_CONFIG command\n"
            "will update the printer config file and restart the printer." % (name,))


def describe(factor):
    """Angle of a factor in both units."""
    angle = math.atan(factor)
    return "%.6f radians, %.2f degrees" % (angle, math.degrees(angle))


def read_lengths(gcmd, plane, text):
    """[AC, BD, AD] of a text like 141.2,141.6,100."""
    try:
        lengths = [float(word) for word in text.split(",")]
    except ValueError:
        lengths = []
    if len(lengths) != 3 or not all(0. < v < math.inf for v in lengths):
        raise gcmd.error("%s='%s' must be the lengths AC,BD,AD: three numbers above 0"
                         % (plane, text))
    return lengths


def read_factor(gcmd, name, lengths):
    """calc_factor() of lengths; raises CommandError if there is none."""
    try:
        return calc_factor(*lengths)
    except ValueError as err:
        raise CommandError("%s=%s of '%s': %s" % (
            name, ",".join("%g" % v for v in lengths), gcmd.get_commandline(), err)
            ) from None


def load_config(config):
    return SkewCorrection(config)
