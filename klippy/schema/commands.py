# SPDX-License-Identifier: GPL-3.0-or-later
"""The G-code commands that the sections register, with their parameters."""

import ast
import os
from dataclasses import dataclass, field

from klippy import gcode_io
from klippy.schema import sources
from klippy.schema.explore import load_printer
from klippy.schema.parameters import Reader

SAMPLE_MACRO = "SAMPLE"         # of the rooms


@dataclass
class Command:
    """One command.  module: of its handler.  selector: the parameter that tells apart
    the objects that have it; needs_selector: whether it must be given.
    """
    name: str
    module: str
    help: str
    parameters: dict = field(default_factory=dict)
    selector: str | None = None
    needs_selector: bool = True
    takes_text: bool = False
    takes_any: bool = False


def read_commands(rooms):
    """{name: Command} of all Rooms."""
    found = {}
    ends = os.pipe()
    for number, room in enumerate(rooms):
        printer = load_printer(room.store, room.supply)
        gcode = printer.lookup_object("gcode")
        if number == 0:
            gcode_io.Terminal(printer, gcode, ends[0])
        for name in gcode.ready_gcode_handlers:
            for handler, selector, value in list_handlers(gcode, name):
                note_handler(found, gcode, name, handler, selector, value)
        printer.send_event("klippy:disconnect")
        printer.get_reactor().finalize()
    for end in ends:
        os.close(end)
    return dict(sorted(found.items()))


def list_handlers(gcode, name):
    """(handler, selecting parameter or None, its value) of a command."""
    if name not in gcode.mux_commands:
        return [(gcode.ready_gcode_handlers[name], None, None)]
    key, handlers = gcode.mux_commands[name]
    return [(handler, key, value) for value, handler in handlers.items()]


def note_handler(found, gcode, name, handler, selector, value):
    """Add a handler's parameters to its Command."""
    if name == SAMPLE_MACRO:
        return
    module = get_module(handler)
    command = found.get(name)
    if command is None:
        text = gcode.get_command_help().get(name) or read_docstring(handler)
        command = found[name] = Command(name, module, text, selector=selector)
    if selector is not None and value is None:
        command.needs_selector = False
    reader = Reader().read(handler)
    command.takes_text |= reader.takes_text
    command.takes_any |= reader.takes_any
    for parameter in reader.found.values():
        command.parameters.setdefault(parameter.name, parameter)


def get_module(handler):
    """Short name of the module that has a handler."""
    owner = getattr(handler, "__self__", None)
    module = type(owner).__module__ if owner is not None else handler.__module__
    return module.rpartition(".")[2]


def read_docstring(handler):
    """First paragraph of a handler's docstring."""
    place = sources.find_function(handler)
    text = (ast.get_docstring(place[0]) if place else None) or ""
    return text.split("\n\n")[0].replace("\n", " ")
