# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy check`: loads a printer.cfg without hardware and prints all errors."""

import json
import logging
import sys

from klippy import plugins
from klippy.errors import ConfigError, ConfigErrors, describe
from klippy.printer import Printer
from klippy.reactor import Reactor
from klippy_ext.vworld import VirtualWorld

HELP = "load a printer.cfg without hardware and print all errors"


def add_arguments(parser):
    """Declare the command line."""
    parser.add_argument("config", help="printer.cfg")
    parser.add_argument("--json", action="store_true",
                        help="print errors and warnings as JSON")
    parser.add_argument("-v", dest="verbose", action="store_true",
                        help="log what the modules say")


def check(path):
    """Load a config.  Returns (list of ConfigErrors, list of warnings)."""
    plugins.install()
    reactor = Reactor(VirtualWorld())
    printer = Printer(reactor, None, {
        "config_file": path, "debugoutput": "/dev/null", "dictionary": {},
        "start_reason": "check"})
    try:
        printer.load()
        errors = []
    except ConfigErrors as err:
        errors = err.errors
    except ConfigError as err:
        errors = [err]
    warnings = printer.lookup_object("configfile").warnings
    printer.send_event("klippy:disconnect")
    reactor.finalize()
    return errors, [warning["message"] for warning in warnings]


def write_error(err):
    """Text of an error, behind file, line and column as editors know it."""
    if err.place is None or not err.place.column:
        return str(err)
    return "%s:%d: %s" % (err.place, err.place.column, Exception.__str__(err))


def run(options):
    """Carry out a parsed command line; returns the exit status."""
    logging.basicConfig(level=logging.INFO if options.verbose else logging.CRITICAL)
    errors, warnings = check(options.config)
    if options.json:
        print(json.dumps({"errors": [describe(err) for err in errors],
                          "warnings": warnings}, indent=1))
        return 1 if errors else 0
    for text in warnings:
        print("warning: %s" % (text,))
    for err in errors:
        print("error: %s" % (write_error(err),), file=sys.stderr)
    if errors:
        print("%s: %d error(s)" % (options.config, len(errors)), file=sys.stderr)
        return 1
    print("%s: no errors" % (options.config,))
    return 0
