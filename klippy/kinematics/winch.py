# SPDX-License-Identifier: GPL-3.0-or-later
"""Machines whose head hangs on cables, each wound up by a winch.

They have no endstops and no limits: G28 declares that the head is at the
origin.
"""

from klippy import stepper
from klippy.errors import CommandError
from klippy.gcode_command import Coord
from klippy.mathutil import matrix_cross, matrix_magsq, matrix_sub, trilateration
from klippy_ext.kin_winch import WinchKinematics

MIN_CABLES = 3
# Anchors that form a triangle flatter than this (mm of height) are in a line
MIN_HEIGHT = 1e-3


def iterate_sections(config):
    """Sections stepper_a, stepper_b, ...: three at least, more if there are."""
    for index in range(26):
        name = "stepper_" + chr(ord("a") + index)
        if index >= MIN_CABLES and not config.has_section(name):
            return
        yield config.getsection(name)


def calc_height(first, second, third):
    """Least height (mm) of the triangle of three points."""
    sides = [matrix_sub(b, a) for a, b in
             ((first, second), (first, third), (second, third))]
    longest2 = max(matrix_magsq(side) for side in sides)
    if not longest2:
        return 0.
    return (matrix_magsq(matrix_cross(sides[0], sides[1])) / longest2) ** .5


class WinchMachine:
    """One stepper a cable; the first three tell where the head is."""

    def __init__(self, toolhead, config):
        self.printer = config.get_printer()
        self.steppers, self.anchors = [], []
        for section in iterate_sections(config):
            motor = stepper.PrinterStepper(section)
            anchor = tuple(section.getfloat("anchor_" + axis) for axis in "xyz")
            motor.set_stepper_kinematics(WinchKinematics(*anchor))
            motor.set_trapq(toolhead.get_trapq())
            self.steppers.append(motor)
            self.anchors.append(anchor)
        if calc_height(*self.anchors[:MIN_CABLES]) < MIN_HEIGHT:
            raise config.error(
                "Options 'anchor_x', 'anchor_y', 'anchor_z': those of stepper_a,"
                " stepper_b and stepper_c are in one line, where they must form a"
                " triangle")
        lows, highs = ([choose(values) for values in zip(*self.anchors, strict=True)]
                       for choose in (min, max))
        self.axes_min, self.axes_max = Coord([*lows, 0.]), Coord([*highs, 0.])
        self.set_position([0., 0., 0.])

    def get_steppers(self):
        """All MCU_steppers."""
        return list(self.steppers)

    def calc_position(self, stepper_positions):
        """[x, y, z] of the head for {stepper name: length of its cable}, mm.

        Three cables leave two points, one on each side of their anchors: it is
        the one that suits the further cables, else the lower one.
        Raises CommandError if the cables do not meet.
        """
        lengths = [stepper_positions[motor.get_name()] for motor in self.steppers]
        radius2 = [length * length for length in lengths[:MIN_CABLES]]
        points = []
        try:
            for i, j, k in ((0, 1, 2), (0, 2, 1)):
                points.append(trilateration(
                    [self.anchors[i], self.anchors[j], self.anchors[k]],
                    [radius2[i], radius2[j], radius2[k]]))
        except ValueError as err:
            raise CommandError("No head is held by cables of %s: %s" % (
                ", ".join("%.3f" % length for length in lengths), err)) from None
        return min(points, key=lambda point: (self._rate(point, lengths), point[2]))

    def _rate(self, point, lengths):
        """How badly a point suits the cables after the third (whole mm)."""
        misfits = [matrix_magsq(matrix_sub(point, anchor)) ** .5 - length
                   for anchor, length in zip(self.anchors, lengths, strict=True)]
        return round(sum(abs(misfit) for misfit in misfits[MIN_CABLES:]))

    def set_position(self, newpos, homing_axes=""):
        """The head is at newpos."""
        for motor in self.steppers:
            motor.set_position(newpos)

    def clear_homing_state(self, clear_axes):
        """Nothing to do: there is no homing."""

    def home(self, homing_state):
        """Declare that the head is at the origin."""
        homing_state.set_axes([0, 1, 2])
        homing_state.set_homed_position([0., 0., 0.])

    def check_move(self, move):
        """Any move will do: no cable is ever faster than the head."""
        return 0

    def accepts_arc(self, arc):
        """True: cables follow every arc."""
        return True

    def check_arc(self, move):
        """As check_move()."""
        return 0

    def get_status(self, eventtime):
        """homed_axes; the box around the anchors as axis_minimum, axis_maximum."""
        return {"homed_axes": "xyz", "axis_minimum": self.axes_min,
                "axis_maximum": self.axes_max}


def load_kinematics(toolhead, config):
    return WinchMachine(toolhead, config)
