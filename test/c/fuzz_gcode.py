# SPDX-License-Identifier: GPL-3.0-or-later
"""Fuzz target: any line is a command with parameters, or a CommandError."""

import sys

import atheris

with atheris.instrument_imports(include=["klippy.gcode_command"]):
    from klippy.gcode_command import GCodeCommand
from klippy.errors import CommandError


class Terminal:
    """Where a command would answer."""

    def respond_info(self, text):
        """Nobody reads it."""

    respond_raw = respond_info


ASK = (GCodeCommand.get_command_parameters,
       GCodeCommand.get_raw_command_parameters,
       lambda command: command.get_float("X", 0.),
       lambda command: command.get_int("S", 0, minval=0))


def run_one(data):
    text = data.decode("utf-8", "replace").replace("\n", " ")
    for name in ("G1", "SET_PIN"):
        command = GCodeCommand(Terminal(), name, name + " " + text)
        for ask in ASK:
            try:
                ask(command)
            except CommandError as err:
                assert len(str(err)) < 1000


if __name__ == "__main__":
    atheris.Setup(sys.argv, run_one)
    atheris.Fuzz()
