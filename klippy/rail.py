# SPDX-License-Identifier: GPL-3.0-or-later
"""A rail: what slides along it is moved by steppers and homed by endstops.

Positions are mm, or radians on an axis that turns.  See
docs/internals/stepper.md.
"""

from collections import namedtuple

from klippy import pins

HOMING_SPEED = 5.
RETRACT_DIST = 5.
# In the names of pins by which a motor driver tells that the motor is blocked
VIRTUAL = "virtual_endstop"
# An endstop within this share of the range from an end is at that end
END_SHARE = 0.25


class HomingInfo(namedtuple("HomingInfo", (
        "speed", "position_endstop", "retract_speed", "retract_dist",
        "positive_dir", "second_homing_speed", "use_sensorless_homing",
        "min_home_dist", "accel"), defaults=(False, 0., None))):
    """How a rail homes; speeds in mm/s, positions in mm.

    accel: mm/s^2 while homing, None for that of the printer.
    """
    __slots__ = ()


def short_name(section):
    """Name in messages: 'x' of 'stepper_x' and of 'carriage x'."""
    return section.split(None, 1)[-1].removeprefix("stepper_")


class Rail:
    """Steppers that move together, and the endstops that stop them.

    A subclass says how a stepper is made: make_stepper(config, in_radians).
    """

    make_stepper = None

    def __init__(self, config, need_position_minmax=True,
                 default_position_endstop=None, units_in_radians=False):
        self.printer = config.get_printer()
        self.name = config.get_name()
        self.units_in_radians = units_in_radians
        self.steppers, self.endstops = [], []
        self.endstops_by_pin = {}
        self.endstop_pin = config.get("endstop_pin")
        self.printer.load_object(config, "query_endstops")
        main_endstop = self.lookup_endstop(self.endstop_pin, self.name)
        self.position_endstop = self._read_position_endstop(
            config, main_endstop, default_position_endstop)
        self._read_range(config, need_position_minmax)
        self._read_homing(config)

    # Options

    def _read_position_endstop(self, config, endstop, default):
        own = getattr(endstop, "get_position_endstop", None)
        if own is not None:
            return own()
        if default is None:
            return config.getfloat("position_endstop")
        return config.getfloat("position_endstop", default)

    def _read_range(self, config, need_position_minmax):
        self.has_range = need_position_minmax
        if not need_position_minmax:
            self.position_min, self.position_max = 0., self.position_endstop
            return
        self.position_min = config.getfloat("position_min", 0.)
        self.position_max = config.getfloat("position_max", above=self.position_min)
        if not self.position_min <= self.position_endstop <= self.position_max:
            raise config.error(
                "Option 'position_endstop' in section '%s': %.3f must be between"
                " position_min and position_max, %.3f to %.3f"
                % (self.name, self.position_endstop, self.position_min,
                   self.position_max))

    def _read_homing(self, config):
        self.homing_speed = config.getfloat("homing_speed", HOMING_SPEED, above=0.)
        self.second_homing_speed = config.getfloat(
            "second_homing_speed", self.homing_speed / 2., above=0.)
        self.homing_retract_speed = config.getfloat(
            "homing_retract_speed", self.homing_speed, above=0.)
        self.homing_retract_dist = config.getfloat(
            "homing_retract_dist", RETRACT_DIST, minval=0.)
        self.use_sensorless_homing = config.getboolean(
            "use_sensorless_homing", VIRTUAL in self.endstop_pin)
        self.min_home_dist = config.getfloat(
            "min_home_dist", self.homing_retract_dist, minval=0.)
        self.homing_accel = config.getfloat("homing_accel", None, above=0.)
        choice = config.getboolean("homing_positive_dir", None)
        if choice is None:
            choice = config.getboolean("homing_positive_dir",
                                       self._find_direction(config))
        self._check_direction(config, choice)
        self.homing_positive_dir = choice

    def _find_direction(self, config):
        """True if the endstop is at the upper end, False at the lower one."""
        if not self.has_range:
            return True
        length = self.position_max - self.position_min
        if self.position_endstop - self.position_min <= END_SHARE * length:
            return False
        if self.position_max - self.position_endstop <= END_SHARE * length:
            return True
        raise config.error(
            "Option 'homing_positive_dir' in section '%s' is needed: the endstop at"
            " %.3f is near no end of the range %.3f to %.3f"
            % (self.name, self.position_endstop, self.position_min,
               self.position_max))

    def _check_direction(self, config, is_positive):
        if self.position_min == self.position_max:
            return
        wrong = self.position_min if is_positive else self.position_max
        if self.position_endstop == wrong:
            raise config.error(
                "Option 'homing_positive_dir' in section '%s': '%s' leads away from"
                " the endstop, which is at the %s end (%.3f) of the range"
                % (self.name, is_positive, "lower" if is_positive else "upper",
                   wrong))

    # Facts

    def get_name(self, short=False):
        """Name of the section; short: as in messages."""
        return short_name(self.name) if short else self.name

    def get_range(self):
        """(least, greatest) position."""
        return self.position_min, self.position_max

    def get_homing_info(self):
        """The HomingInfo of the rail."""
        return HomingInfo(
            self.homing_speed, self.position_endstop, self.homing_retract_speed,
            self.homing_retract_dist, self.homing_positive_dir,
            self.second_homing_speed, self.use_sensorless_homing,
            self.min_home_dist, self.homing_accel)

    def get_steppers(self):
        """The MCU_steppers, the one of the rail's own section first."""
        return list(self.steppers)

    def get_endstops(self):
        """[(endstop, name)], the one of the rail's own section first."""
        return list(self.endstops)

    # Members

    def lookup_endstop(self, pin_desc, stepper_name):
        """The rail's endstop on a pin; made, and shown, the first time.

        Raises pins.error if the pin is described differently than before.
        """
        ppins = pins.get(self.printer)
        params = ppins.parse_pin(pin_desc, can_invert=True, can_pullup=True)
        place = params["chip_name"], params["pin"]
        modifiers = params["invert"], params["pullup"]
        known = self.endstops_by_pin.get(place)
        if known is not None:
            endstop, known_modifiers = known
            if modifiers != known_modifiers:
                raise pins.error(
                    "Section '%s': endstop_pin '%s' is shared by steppers of '%s'"
                    " and must be written the same way for all of them"
                    % (stepper_name, pin_desc, self.name))
            return endstop
        endstop = ppins.setup_pin("endstop", pin_desc)
        self.endstops_by_pin[place] = endstop, modifiers
        name = short_name(stepper_name)
        self.endstops.append((endstop, name))
        self.printer.lookup_object("query_endstops").register_endstop(endstop, name)
        return endstop

    def add_stepper(self, stepper, endstop_pin=None, endstop_name=None):
        """Add a stepper, stopped by an endstop of its own or the rail's."""
        if endstop_pin is None:
            endstop_pin = self.endstop_pin
        endstop = self.lookup_endstop(endstop_pin, endstop_name or stepper.get_name())
        endstop.add_stepper(stepper)
        self.steppers.append(stepper)

    def add_extra_stepper(self, config):
        """Make and add the stepper of a section, with its endstop if it has one."""
        endstop_pin = config.get("endstop_pin", None)
        stepper = self.make_stepper(config, self.units_in_radians)
        self.add_stepper(stepper, endstop_pin, config.get_name())

    add_stepper_from_config = add_extra_stepper

    # All steppers together

    def setup_itersolve(self, alloc_func, *params):
        """See MCU_stepper.setup_itersolve()."""
        for stepper in self.steppers:
            stepper.setup_itersolve(alloc_func, *params)

    def set_trapq(self, trapq):
        """Have all steppers follow a TrapQ."""
        for stepper in self.steppers:
            stepper.set_trapq(trapq)

    def set_position(self, coord):
        """The head is at coord; nothing moves."""
        for stepper in self.steppers:
            stepper.set_position(coord)

    def calc_position_from_coord(self, coord):
        """Position of the rail for a head that rests at coord."""
        return self.steppers[0].calc_position_from_coord(coord)

    def get_commanded_position(self):
        """Where the rail is, as far as steps are made."""
        return self.steppers[0].get_commanded_position()


def iterate_family(config):
    """The sections numbered after one: stepper_x1, stepper_x2, ..."""
    number = 1
    while config.has_section("%s%d" % (config.get_name(), number)):
        yield config.getsection("%s%d" % (config.get_name(), number))
        number += 1
