# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear machines with a second carriage: the section [dual_carriage]."""

from klippy import stepper
from klippy.kinematics.carriages import Carriage, CarriageMachine
from klippy.kinematics.dual_carriage import DualCarriages, read_distance
from klippy.kinematics.limits import AXES


class DualLinearMachine(CarriageMachine):
    """Rails of x, y, z as on a LinearMachine, and one more on one of them.

    weights: rows of x, y, z as there.  dual_weights: {axis: row} of the second
    carriage's motors, for axes that may have one.
    """

    def __init__(self, toolhead, config, weights, dual_weights):
        section = config.getsection("dual_carriage")
        letters = [AXES[axis] for axis in dual_weights]
        if len(letters) > 1:
            letter = section.getchoice("axis", letters)
        else:
            letter = section.getchoice("axis", letters, letters[0])
        axis = AXES.index(letter)
        rails = [stepper.LookupMultiRail(config.getsection("stepper_" + name))
                 for name in AXES]
        dual = stepper.LookupMultiRail(section)
        carriages = [Carriage(rail.get_name(short=True), rail, i)
                     for i, rail in enumerate(rails)]
        carriages.append(Carriage(
            dual.get_name(), dual, axis, carriages[axis],
            read_distance(section, rails[axis], dual)))
        names = [carriage.name for carriage in carriages[:3]]
        motors = [(motor, dict(zip(names, row, strict=True)))
                  for rail, row in zip(rails, weights, strict=True)
                  for motor in rail.get_steppers()]
        names[axis] = dual.get_name()
        motors += [(motor, dict(zip(names, dual_weights[axis], strict=True)))
                   for motor in dual.get_steppers()]
        super().__init__(toolhead, config, carriages, motors)
        self.dual_carriages = DualCarriages(self)
