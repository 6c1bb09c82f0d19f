# SPDX-License-Identifier: GPL-3.0-or-later
"""Stepper positions of a machine as plain functions of the nozzle position."""

import configparser
import math

import numpy as np

from truth import curves


def read_config(text):
    """Sections of a printer.cfg as {section: {option: text}}."""
    parser = configparser.RawConfigParser(
        strict=False, inline_comment_prefixes=(";", "#"), delimiters=(":", "="))
    parser.read_string(text)
    return {name: dict(parser[name]) for name in parser.sections()}


def step_distance(section):
    """mm (radians, with gears only) of one microstep."""
    gear = 1.0
    for pair in filter(None, section.get("gear_ratio", "").split(",")):
        a, b = pair.split(":")
        gear *= float(a) / float(b)
    full = float(section.get("full_steps_per_rotation", 200))
    turn = float(section.get("rotation_distance", 2. * math.pi))
    return turn / (full * float(section["microsteps"]) * gear)


def cartesian(config):
    return {"stepper_x": lambda p: p[:, 0], "stepper_y": lambda p: p[:, 1],
            "stepper_z": lambda p: p[:, 2]}


def corexy(config):
    return {"stepper_x": lambda p: p[:, 0] + p[:, 1],
            "stepper_y": lambda p: p[:, 0] - p[:, 1],
            "stepper_z": lambda p: p[:, 2]}


def corexz(config):
    return {"stepper_x": lambda p: p[:, 0] + p[:, 2],
            "stepper_y": lambda p: p[:, 1],
            "stepper_z": lambda p: p[:, 0] - p[:, 2]}


def hybrid_corexy(config):
    return {"stepper_x": lambda p: p[:, 0] - p[:, 1],
            "stepper_y": lambda p: p[:, 1], "stepper_z": lambda p: p[:, 2]}


def hybrid_corexz(config):
    return {"stepper_x": lambda p: p[:, 0] - p[:, 2],
            "stepper_y": lambda p: p[:, 1], "stepper_z": lambda p: p[:, 2]}


def delta(config):
    radius = float(config["printer"]["delta_radius"])
    arm_a = float(config["stepper_a"]["arm_length"])
    functions = {}
    for name, default in (("stepper_a", 210.0), ("stepper_b", 330.0),
                          ("stepper_c", 90.0)):
        section = config[name]
        arm = float(section.get("arm_length", arm_a))
        angle = math.radians(float(section.get("angle", default)))
        tower_x, tower_y = radius * math.cos(angle), radius * math.sin(angle)
        functions[name] = delta_carriage(arm, tower_x, tower_y)
    return functions


def delta_carriage(arm, tower_x, tower_y):
    def height(p):
        dx, dy = tower_x - p[:, 0], tower_y - p[:, 1]
        return p[:, 2] + np.sqrt(arm * arm - dx * dx - dy * dy)
    return height


def deltesian(config):
    left, right = config["stepper_left"], config["stepper_right"]
    functions = {"stepper_y": lambda p: p[:, 1]}
    for name, side, section in (("stepper_left", -1., left),
                                ("stepper_right", 1., {**left, **right})):
        functions[name] = curves.deltesian_carriage(
            float(section["arm_length"]), side * float(section["arm_x_length"]))
    return functions


def rotary_delta(config):
    printer, base = config["printer"], config["stepper_a"]
    functions = {}
    for name, default in (("stepper_a", 30.), ("stepper_b", 150.), ("stepper_c", 270.)):
        section = {**base, "angle": default, **config[name]}
        functions[name] = curves.rotary_arm(
            float(printer["shoulder_radius"]), float(printer["shoulder_height"]),
            math.radians(float(section["angle"])), float(section["upper_arm_length"]),
            float(section["lower_arm_length"]))
    return functions


def winch(config):
    return {name: curves.cable([float(section["anchor_" + axis]) for axis in "xyz"])
            for name, section in config.items() if "anchor_x" in section}


def generic_cartesian(config):
    """That of machine_configs.make_generic(), its u resting at its endstop."""
    rest = float(config["dual_carriage u"]["position_endstop"])
    return {"stepper a": lambda p: p[:, 0] + p[:, 1],
            "stepper b": lambda p: rest - p[:, 1],
            "stepper c": lambda p: 0.5 * p[:, 1] - p[:, 2],
            "stepper d": lambda p: p[:, 1] + 2. * p[:, 2]}


def polar(config):
    """Without the bed, whose turns depend on the whole path."""
    return {"stepper_arm": curves.radius, "stepper_z": lambda p: p[:, 2]}


KINEMATICS = {"cartesian": cartesian, "corexy": corexy, "corexz": corexz,
              "hybrid_corexy": hybrid_corexy, "hybrid_corexz": hybrid_corexz,
              "delta": delta, "deltesian": deltesian, "rotary_delta": rotary_delta,
              "winch": winch, "polar": polar,
              "generic_cartesian": generic_cartesian,
              "limited_cartesian": cartesian, "limited_corexy": corexy}


def steppers(config):
    """{name: (position(xyz (n, 3)) -> (n,), step distance mm)}"""
    functions = KINEMATICS[config["printer"]["kinematics"]](config)
    defaults = config.get("stepper_a", {})
    return {name: (f, step_distance({**{k: defaults[k] for k in
                                        ("rotation_distance", "microsteps")
                                        if k in defaults}, **config[name]}))
            for name, f in functions.items()}
