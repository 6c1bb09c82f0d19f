# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear machines of any carriages: what moves along an axis, and by which motors.

A motor's position is a weighted sum of those of carriages; a carriage follows
its axis, follows it mirrored, or rests.  See docs/internals/kinematics.md.
"""

from klippy.errors import CommandError
from klippy.kinematics.box import BoxMachine
from klippy.kinematics.limits import list_axes
from klippy.kinematics.linear import home_axis
from klippy_ext.kin_linear import LinearKinematics

PRIMARY, INACTIVE, COPY, MIRROR = "PRIMARY", "INACTIVE", "COPY", "MIRROR"
# How a carriage follows its axis
SCALES = {PRIMARY: 1., INACTIVE: 0., COPY: 1., MIRROR: -1.}
SINGULAR = 1e-9


class Carriage:
    """A rail on an axis (0, 1, 2).  It is at scale * axis + offset.

    primary: the carriage with which it shares the axis, or None.
    safe_distance: mm that these two keep; 0 for none.
    """

    def __init__(self, name, rail, axis, primary=None, safe_distance=0.):
        self.name, self.rail, self.axis = name, rail, axis
        self.primary, self.safe_distance = primary, safe_distance
        self.offset, self.mode = 0., PRIMARY
        if primary is not None:
            self.mode = INACTIVE
            self.offset = rail.get_homing_info().position_endstop

    @property
    def scale(self):
        """Way of the carriage for a way of the axis."""
        return SCALES[self.mode]

    def calc_position(self, axis_position):
        """Where it is while its axis is there."""
        return self.scale * axis_position + self.offset

    def set_mode(self, mode, axis_position, position):
        """Follow the axis in another way, from where both are now."""
        self.mode = mode
        self.offset = position - self.scale * axis_position

    def calc_range(self):
        """(least, greatest) position of the axis for which it is in its range."""
        low, high = self.rail.get_range()
        if not self.scale:
            return -1e9, 1e9
        ends = (low - self.offset) * self.scale, (high - self.offset) * self.scale
        return min(ends), max(ends)


def find_default_distance(first, second):
    """mm that two rails leave each other at the ends of their ranges."""
    (low, high), (other_low, other_high) = first.get_range(), second.get_range()
    return min(abs(low - other_low), abs(high - other_high))


def invert_rows(rows, names, where):
    """Rows that give each column's value for values of the rows, by least squares.

    Raises CommandError, naming what the rows leave open.
    """
    size = len(names)
    table = [[sum(row[i] * row[j] for row in rows) for j in range(size)]
             + [row[i] for row in rows] for i in range(size)]
    for i in range(size):
        best = max(range(i, size), key=lambda k, i=i: abs(table[k][i]))
        if abs(table[best][i]) < SINGULAR:
            raise CommandError("%s do not tell where carriage '%s' is" % (
                where, names[i]))
        table[i], table[best] = table[best], table[i]
        table[i] = [value / table[i][i] for value in table[i]]
        for k in range(size):
            if k != i and table[k][i]:
                share = table[k][i]
                table[k] = [a - share * b
                            for a, b in zip(table[k], table[i], strict=True)]
    return [row[size:] for row in table]


class Motor:
    """A stepper and {carriage name: weight}."""

    def __init__(self, stepper, weights):
        self.stepper, self.weights = stepper, weights
        self.kinematics = LinearKinematics(0., 0., 0.)
        stepper.set_stepper_kinematics(self.kinematics)

    def connect(self, carriages):
        """Move as the carriages do now."""
        row, offset = [0.] * 3, 0.
        for carriage in carriages:
            weight = self.weights.get(carriage.name, 0.)
            row[carriage.axis] += weight * carriage.scale
            offset += weight * carriage.offset
        self.kinematics.set_weights(*row, offset)
        self.is_resting = not any(row)


class CarriageMachine(BoxMachine):
    """Carriages, each axis with one that is primary, and the motors that move them.

    carriages: list of Carriage, that first of an axis being primary.
    weights: [(MCU_stepper, {carriage name: weight})].
    """

    def __init__(self, toolhead, config, carriages, weights):
        super().__init__(config, [carriage.rail for carriage in carriages])
        self.toolhead, self.carriages = toolhead, carriages
        self.motors = [Motor(stepper, row) for stepper, row in weights]
        self.is_switching = False
        try:
            self.invert()
        except CommandError as err:
            raise config.error(str(err)) from None
        for motor in self.motors:
            motor.stepper.set_trapq(toolhead.get_trapq())
        self._share_endstops()
        self.open_box(toolhead, config, [
            self.find_primary(axis).rail.get_range() for axis in range(3)])
        self.connect()
        self._check_room(config)
        for motor in self.motors:
            motor.stepper.set_position([0., 0., 0.])

    def invert(self):
        """Work out where carriages are by motors.

        Raises CommandError if the motors do not tell.
        """
        names = [carriage.name for carriage in self.carriages]
        self.inverse = invert_rows(
            [[motor.weights.get(name, 0.) for name in names] for motor in self.motors],
            names, "The motors")

    def _share_endstops(self):
        """Let a carriage's endstops stop the motors of others that it is moved by."""
        for carriage in self.carriages:
            own = carriage.rail.get_steppers()
            for endstop, _ in carriage.rail.get_endstops():
                for motor in self.motors:
                    if motor.weights.get(carriage.name) and motor.stepper not in own:
                        endstop.add_stepper(motor.stepper)

    def _check_room(self, config):
        for axis in range(3):
            low, high = self.find_range(axis)
            if low > high:
                raise config.error(
                    "Option 'safe_distance': beside '%s' at its endstop there is no"
                    " room for '%s', which could go from %.3f to %.3f" % (
                        self.list_carriages(axis)[1].name,
                        self.find_primary(axis).name, low, high))

    # Carriages

    def find_primary(self, axis):
        """The carriage that an axis shows."""
        return next(c for c in self.carriages if c.axis == axis and c.mode == PRIMARY)

    def list_carriages(self, axis):
        """All carriages of an axis."""
        return [c for c in self.carriages if c.axis == axis]

    def connect(self):
        """Let motors and limits follow the modes of the carriages."""
        for motor in self.motors:
            motor.connect(self.carriages)
        for axis in range(3):
            self.limits.set_range(axis, *self.find_range(axis))

    def find_range(self, axis):
        """(least, greatest) position of an axis; nothing if they cross."""
        lows, highs = zip(*(c.calc_range() for c in self.list_carriages(axis)),
                          strict=True)
        low, high = max(lows), min(highs)
        primary = self.find_primary(axis)
        for other in self.list_carriages(axis):
            gap = other.safe_distance or primary.safe_distance
            if other is primary or not gap or other.mode == COPY:
                continue
            # the other one's position as a line over the axis: q = s * x + o
            bend = 1. - other.scale
            if is_left(primary, other):
                high = min(high, (other.offset - gap) / bend)
            else:
                low = max(low, (other.offset + gap) / bend)
        return low, high

    def switch(self, axis, modes):
        """Give the carriages of an axis other modes {carriage: mode}.

        Nothing moves; the axis then shows the new primary carriage.
        """
        self.toolhead.flush_step_generation()
        position = list(self.toolhead.get_position())
        places = {c: c.calc_position(position[axis]) for c in modes}
        primary = next(c for c, mode in modes.items() if mode == PRIMARY)
        position[axis] = places[primary]
        for carriage, mode in modes.items():
            carriage.set_mode(mode, position[axis], places[carriage])
        self.connect()
        self.is_switching = True
        try:
            self.toolhead.set_position(position)
        finally:
            self.is_switching = False
        self.printer.send_event("dual_carriage:update_kinematics")

    # Positions

    def get_steppers(self):
        """All MCU_steppers."""
        return [motor.stepper for motor in self.motors]

    def calc_position(self, stepper_positions):
        """[x, y, z] of the head for {stepper name: position}, mm."""
        values = [stepper_positions[motor.stepper.get_name()] for motor in self.motors]
        places = {carriage.name: sum(a * b for a, b in zip(row, values, strict=True))
                  for carriage, row in zip(self.carriages, self.inverse, strict=True)}
        return [places[self.find_primary(axis).name] for axis in range(3)]

    def set_position(self, newpos, homing_axes=""):
        """The head is at newpos; the homing_axes ("xyz") become homed by that."""
        if not self.is_switching:
            # motors at rest know better where they are
            for motor in self.motors:
                if not motor.is_resting:
                    motor.stepper.set_position(newpos)
        self.set_homed(list_axes(homing_axes))

    # Homing

    def home(self, homing_state):
        """Home the axes of a Homing, one after the other.

        Raises CommandError.
        """
        for axis in homing_state.get_axes():
            carriages = self.list_carriages(axis)
            if len(carriages) > 1:
                self._home_several(homing_state, axis, carriages)
            else:
                home_axis(homing_state, axis, carriages[0].rail)

    def _home_several(self, homing_state, axis, carriages):
        """Home carriages one by one, then go on with the one that was primary.

        Of those that home to one side the outer comes first.
        """
        last = self.find_primary(axis)
        if any(c.mode in (COPY, MIRROR) for c in carriages):
            last = carriages[0]
        for carriage in sorted(carriages, key=rank_for_homing):
            self.switch(axis, make_modes(carriages, carriage))
            self.limits.set_range(axis, *carriage.rail.get_range())
            home_axis(homing_state, axis, carriage.rail)
        self.switch(axis, make_modes(carriages, last))


def is_left(first, second):
    """True if the first carriage is the one towards the smaller positions."""
    return sum(first.rail.get_range()) < sum(second.rail.get_range())


def rank_for_homing(carriage):
    info = carriage.rail.get_homing_info()
    if info.positive_dir:
        return 1, -info.position_endstop
    return 0, info.position_endstop


def make_modes(carriages, primary):
    """{carriage: mode} with one that is primary and the others at rest."""
    return {c: PRIMARY if c is primary else INACTIVE for c in carriages}
