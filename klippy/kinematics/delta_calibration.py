# SPDX-License-Identifier: GPL-3.0-or-later
"""What a delta is taken to measure, as numbers that a calibration may change.

A place is kept as the steps of each carriage below its endstop: what the
machine did there, whatever it is taken to measure.
"""

import math
from typing import NamedTuple

from klippy.mathutil import trilateration

TOWERS = "abc"
# Turning all towers together changes nothing, so the last angle stays
FREE = ("radius", "endstop_a", "endstop_b", "endstop_c", "angle_a", "angle_b")
EXTENDED = ("arm_a", "arm_b", "arm_c")


class DeltaCalibration(NamedTuple):
    """radius in mm; of each tower angle in degrees, arm, endstop and step in mm."""

    radius: float
    angles: tuple
    arms: tuple
    endstops: tuple
    step_dists: tuple

    def list_towers(self):
        """[(x, y, arm, height of the carriage at the endstop)], mm."""
        return [(self.radius * math.cos(math.radians(angle)),
                 self.radius * math.sin(math.radians(angle)), arm,
                 endstop + math.sqrt(arm ** 2 - self.radius ** 2))
                for angle, arm, endstop in zip(self.angles, self.arms, self.endstops,
                                               strict=True)]

    def find_steps(self, point):
        """Steps of the carriages below their endstops, for a head at (x, y, z)."""
        steps = []
        for (x, y, arm, top), step_dist in zip(self.list_towers(), self.step_dists,
                                               strict=True):
            height = point[2] + math.sqrt(
                arm ** 2 - (point[0] - x) ** 2 - (point[1] - y) ** 2)
            steps.append((top - height) / step_dist)
        return steps

    def find_point(self, steps):
        """[x, y, z] of the head, by what find_steps() gives.

        Raises ValueError if the arms do not meet.
        """
        spheres, radius2 = [], []
        for (x, y, arm, top), step_dist, count in zip(
                self.list_towers(), self.step_dists, steps, strict=True):
            spheres.append((x, y, top - count * step_dist))
            radius2.append(arm ** 2)
        return trilateration(spheres, radius2)

    def get_parameters(self):
        """All numbers by name: radius, angle_a, arm_a, endstop_a, stepdist_a, ..."""
        parameters = {"radius": self.radius}
        for i, tower in enumerate(TOWERS):
            parameters["angle_" + tower] = self.angles[i]
            parameters["arm_" + tower] = self.arms[i]
            parameters["endstop_" + tower] = self.endstops[i]
            parameters["stepdist_" + tower] = self.step_dists[i]
        return parameters

    def replace_parameters(self, parameters):
        """The DeltaCalibration with the parameters of get_parameters()."""
        columns = (tuple(parameters[name + tower] for tower in TOWERS)
                   for name in ("angle_", "arm_", "endstop_", "stepdist_"))
        return DeltaCalibration(parameters["radius"], *columns)

    def list_options(self):
        """[(section, option, text)] to be saved in the config."""
        options = [("printer", "delta_radius", "%.6f" % self.radius)]
        for i, tower in enumerate(TOWERS):
            section = "stepper_" + tower
            options += [(section, "angle", "%.6f" % self.angles[i]),
                        (section, "arm_length", "%.6f" % self.arms[i]),
                        (section, "position_endstop", "%.6f" % self.endstops[i])]
        return options


def list_free(is_extended):
    """Names of the parameters that a calibration may change."""
    return FREE + EXTENDED if is_extended else FREE
