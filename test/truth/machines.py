# SPDX-License-Identifier: GPL-3.0-or-later
"""Stepper positions of a machine as plain functions of the nozzle position."""

import configparser
import math

import numpy as np


def read_config(text):
    """Sections of a printer.cfg as {section: {option: text}}."""
    parser = configparser.RawConfigParser(
        strict=False, inline_comment_prefixes=(";", "#"), delimiters=(":", "="))
    parser.read_string(text)
    return {name: dict(parser[name]) for name in parser.sections()}


def step_distance(section):
    """mm of one microstep."""
    gear = 1.0
    for pair in filter(None, section.get("gear_ratio", "").split(",")):
        a, b = pair.split(":")
        gear *= float(a) / float(b)
    full = float(section.get("full_steps_per_rotation", 200))
    return float(section["rotation_distance"]) / (
        full * float(section["microsteps"]) * gear)


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


KINEMATICS = {"cartesian": cartesian, "corexy": corexy, "corexz": corexz,
              "hybrid_corexy": hybrid_corexy, "hybrid_corexz": hybrid_corexz,
              "delta": delta}


def steppers(config):
    """{name: (position(xyz (n, 3)) -> (n,), step distance mm)}"""
    functions = KINEMATICS[config["printer"]["kinematics"]](config)
    defaults = config.get("stepper_a", {})
    return {name: (f, step_distance({**{k: defaults[k] for k in
                                        ("rotation_distance", "microsteps")
                                        if k in defaults}, **config[name]}))
            for name, f in functions.items()}
