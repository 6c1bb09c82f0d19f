# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy schema`: the JSON Schema of printer.cfg, from what the modules declare."""

import json
import logging
import pathlib
import sys

from klippy.configtext import ConfigReader
from klippy.errors import ConfigError
from klippy.schema import jsonform, markdown
from klippy.schema.catalog import read_catalog
from klippy.schema.commands import read_commands
from klippy.schema.sensors import read_sensor_types
from klippy.schema.texts import read_command_texts, read_texts

HELP = "print the JSON Schema of printer.cfg, from what the modules declare"


def add_arguments(parser):
    """Declare the command line."""
    parser.add_argument("--plugins", metavar="FOLDER", action="append", default=[],
                        help="take in the modules of this folder too")
    parser.add_argument("--convert", metavar="CONFIG",
                        help="print a printer.cfg in the form that the schema is about")
    parser.add_argument("--markdown", metavar="FOLDER",
                        help="write config_reference.md and gcode_reference.md there")


def write_references(catalog, options):
    """{file name: text} of the references."""
    return {
        "config_reference.md": markdown.write_config(
            catalog.sections, read_texts(options.plugins)),
        "gcode_reference.md": markdown.write_commands(
            read_commands(catalog.rooms), read_command_texts(options.plugins))}


def run(options):
    """Carry out a parsed command line; returns the exit status."""
    logging.disable(logging.CRITICAL)
    try:
        catalog = read_catalog(options.plugins)
        if options.markdown:
            for name, text in write_references(catalog, options).items():
                pathlib.Path(options.markdown, name).write_text(text)
            return 0
        found = jsonform.make_schema(catalog.sections, read_texts(options.plugins),
                                     read_sensor_types(catalog.rooms))
        if options.convert:
            store = ConfigReader().read(options.convert)
            found = jsonform.convert(store, found)
    except (ConfigError, OSError) as err:
        print("error: %s" % (err,), file=sys.stderr)
        return 1
    print(json.dumps(found, indent=1, ensure_ascii=False))
    return 0
