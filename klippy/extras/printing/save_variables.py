# SPDX-License-Identifier: GPL-3.0-or-later
"""[save_variables]: variables that outlive a restart, kept in a file.

The file is replaced as a whole: after a power cut it holds either the old
values or the new ones.
"""

import configparser
import io
import os
import pathlib

from klippy.extras.gcode_macro import parse_literal

SECTION = "Variables"


class SaveVariables:
    """The file, its values and SAVE_VARIABLE."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.filename = os.path.expanduser(config.get("filename"))
        self.variables = {}
        try:
            if os.path.exists(self.filename):
                self.variables = read_variables(self.filename)
            else:
                write_variables(self.filename, {})
        except (OSError, ValueError) as err:
            raise config.error("[save_variables] filename '%s': %s"
                               % (self.filename, err))
        gcode = self.printer.lookup_object("gcode")
        gcode.register_command("SAVE_VARIABLE", self.cmd_SAVE_VARIABLE,
                               desc=self.cmd_SAVE_VARIABLE_help)

    cmd_SAVE_VARIABLE_help = "Save a variable to the file of [save_variables]"

    def cmd_SAVE_VARIABLE(self, gcmd):
        name, text = gcmd.get("VARIABLE"), gcmd.get("VALUE")
        if name != name.lower() or not name or set(name) & set("=:#;[]\n"):
            raise gcmd.error(
                "'%s' is no name for a variable: use small letters, digits and _"
                % (name,))
        try:
            variables = {**self.variables, name: parse_literal(text)}
            write_variables(self.filename, variables)
        except (OSError, ValueError) as err:
            raise gcmd.error("Unable to save variable '%s': %s" % (name, err))
        self.variables = variables

    def get_status(self, eventtime):
        return {"variables": self.variables}


def read_variables(filename):
    """{name: value} of a file.  Raises OSError, ValueError."""
    parser = configparser.RawConfigParser(strict=False)
    try:
        with open(filename, encoding="utf-8") as file:
            parser.read_file(file)
    except configparser.Error as err:
        raise ValueError(str(err)) from None
    if not parser.has_section(SECTION):
        return {}
    return {name: parse_literal(text) for name, text in parser.items(SECTION)}


def write_variables(filename, variables):
    """Replace the file.  Raises OSError; the old file then remains."""
    parser = configparser.RawConfigParser()
    parser.add_section(SECTION)
    for name in sorted(variables):
        parser.set(SECTION, name, repr(variables[name]))
    text = io.StringIO()
    parser.write(text)
    temporary = filename + ".new"
    try:
        with open(temporary, "w", encoding="utf-8") as file:
            file.write(text.getvalue())
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, filename)
    except OSError:
        pathlib.Path(temporary).unlink(missing_ok=True)
        raise


def load_config(config):
    return SaveVariables(config)
