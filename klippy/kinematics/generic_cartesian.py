# SPDX-License-Identifier: GPL-3.0-or-later
"""Machines that say for each motor which carriages it moves, and how."""

import re

from klippy import stepper
from klippy.errors import CommandError
from klippy.kinematics.carriages import Carriage, CarriageMachine
from klippy.kinematics.dual_carriage import DualCarriages, read_distance
from klippy.kinematics.limits import AXES

TERM = re.compile(r"\s*([+-])?\s*(?:(\d*\.?\d+)\s*\*\s*)?([A-Za-z_]\w*)\s*")


def parse_carriages(text, names):
    """{name: weight} of a sum like "x+y" or "y-0.5*z".  Raises CommandError."""
    weights, place = {}, 0
    while place < len(text):
        match = TERM.match(text, place)
        if match is None or (place and match[1] is None):
            raise CommandError("'%s' should be a sum of carriages like x+y or"
                               " y-0.5*z" % (text,))
        sign, factor, name = match.groups()
        if name not in names:
            raise CommandError("'%s': there is no carriage '%s', only %s" % (
                text, name, ", ".join(names)))
        weight = float(factor or 1.) * (-1. if sign == "-" else 1.)
        weights[name] = weights.get(name, 0.) + weight
        place = match.end()
    if not any(weights.values()):
        raise CommandError("'%s' moves no carriage, which must be one of %s" % (
            text, ", ".join(names)))
    return weights


class GenericCartesianMachine(CarriageMachine):
    """Sections [carriage], [dual_carriage], [extra_carriage] and [stepper]."""

    def __init__(self, toolhead, config):
        carriages = self._read_carriages(config)
        self.names = {c.name: c.name for c in carriages}
        # (endstop, name of the carriage at which it is)
        self.endstops = [(endstop, c.name) for c in carriages
                         for endstop, _ in c.rail.get_endstops()]
        self._read_extras(config, {c.name: c for c in carriages})
        self.named_weights = [self._read_motor(section)
                              for section in config.get_prefix_sections("stepper ")]
        super().__init__(toolhead, config, carriages, [
            (motor, self._merge(weights)) for motor, weights in self.named_weights])
        if any(carriage.primary is not None for carriage in carriages):
            self.dual_carriages = DualCarriages(self)
        self.printer.lookup_object("gcode").register_command(
            "SET_STEPPER_CARRIAGES", self.cmd_SET_STEPPER_CARRIAGES,
            desc=self.cmd_SET_STEPPER_CARRIAGES_help)

    def _read_carriages(self, config):
        carriages, by_axis = [], {}
        for section in config.get_prefix_sections("carriage "):
            name = section.get_name().split(None, 1)[1]
            if name in AXES:
                letter = section.getchoice("axis", list(AXES), name)
            else:
                letter = section.getchoice("axis", list(AXES))
            if letter in by_axis:
                raise section.error(
                    "Option 'axis' in section '%s': '%s' has the carriage '%s' already;"
                    " a second one is a [dual_carriage]"
                    % (section.get_name(), letter, by_axis[letter].name))
            carriages.append(Carriage(name, stepper.GenericPrinterRail(section),
                                      AXES.index(letter)))
            by_axis[letter] = carriages[-1]
        missing = [letter for letter in AXES if letter not in by_axis]
        if missing:
            raise config.error("kinematics generic_cartesian need a section [carriage]"
                               " for each axis: %s is missing" % (", ".join(missing),))
        return carriages + self._read_duals(config, carriages)

    def _read_duals(self, config, carriages):
        by_name, duals = {c.name: c for c in carriages}, []
        for section in config.get_prefix_sections("dual_carriage "):
            name = section.get_name().split(None, 1)[1]
            rail = stepper.GenericPrinterRail(section)
            wanted = section.get("primary_carriage", None)
            if wanted is None:
                letter = section.getchoice("axis", list(AXES))
                primary = next(c for c in carriages if AXES[c.axis] == letter)
            else:
                primary = by_name[section.getchoice("primary_carriage", list(by_name))]
                section.getchoice("axis", [AXES[primary.axis]], AXES[primary.axis])
            if name in by_name or any(d.primary is primary for d in duals):
                raise section.error("Section '%s': the carriage '%s' is there already"
                                    % (section.get_name(), name))
            duals.append(Carriage(name, rail, primary.axis, primary,
                                  read_distance(section, primary.rail, rail)))
        return duals

    def _read_extras(self, config, by_name):
        """Further endstops of a carriage, that stop motors of their own."""
        for section in config.get_prefix_sections("extra_carriage "):
            name = section.get_name().split(None, 1)[1]
            main = by_name[section.getchoice("primary_carriage", list(by_name))]
            if name in self.names:
                raise section.error("Section '%s': the carriage '%s' is there already"
                                    % (section.get_name(), name))
            self.names[name] = main.name
            endstop = main.rail.lookup_endstop(section.get("endstop_pin"), name)
            self.endstops.append((endstop, name))

    def _share_endstops(self):
        """Let each endstop stop the motors of its own carriage."""
        for endstop, name in self.endstops:
            for motor, weights in self.named_weights:
                if weights.get(name):
                    endstop.add_stepper(motor)

    def _read_motor(self, section):
        try:
            weights = parse_carriages(section.get("carriages"), list(self.names))
        except CommandError as err:
            raise section.error("Option 'carriages' in section '%s': %s" % (
                section.get_name(), err)) from None
        return stepper.PrinterStepper(section), weights

    def _merge(self, weights):
        """Weights with those of extra carriages counted for the main ones."""
        merged = {}
        for name, weight in weights.items():
            main = self.names[name]
            merged[main] = merged.get(main, 0.) + weight
        return merged

    cmd_SET_STEPPER_CARRIAGES_help = "Change which carriages a stepper moves"

    def cmd_SET_STEPPER_CARRIAGES(self, gcmd):
        """Let STEPPER move CARRIAGES; DISABLE_CHECKS=1 allows what cannot work."""
        name = gcmd.get("STEPPER")
        motor = next((m for m in self.motors if name in (
            m.stepper.get_name(), m.stepper.get_name().split(None, 1)[-1])), None)
        if motor is None:
            raise gcmd.error("STEPPER '%s' is none of this machine's" % (name,))
        weights = self._merge(parse_carriages(gcmd.get("CARRIAGES"), list(self.names)))
        self.toolhead.flush_step_generation()
        before, motor.weights = motor.weights, weights
        try:
            self.invert()
        except CommandError:
            if not gcmd.get_int("DISABLE_CHECKS", 0):
                motor.weights = before
                raise
        self.connect()
        motor.stepper.set_position(self.toolhead.get_position())
        self.printer.send_event("dual_carriage:update_kinematics")


def load_kinematics(toolhead, config):
    return GenericCartesianMachine(toolhead, config)
