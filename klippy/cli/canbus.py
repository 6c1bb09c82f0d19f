# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy canbus`: list the boards on a CAN bus that wait for a number."""

import sys

from klippy import canlink


def add_arguments(parser):
    """Options of `klippy canbus`."""
    parser.add_argument("action", choices=["query"],
                        help="query: uuids of boards that no host uses")
    parser.add_argument("interface", nargs="?", default="can0",
                        help="CAN interface (default can0)")


def run(args):
    """Run the command; returns the exit status."""
    try:
        bus = canlink.open_bus(args.interface)
    except canlink.error as err:
        print(err, file=sys.stderr)
        return 1
    try:
        found = canlink.query_unassigned(bus)
    except canlink.error as err:
        print(err, file=sys.stderr)
        return 1
    finally:
        bus.close()
    for uuid, program in sorted(found.items()):
        print("canbus_uuid: %s    (%s)" % (uuid.hex(), program))
    print("%d board%s waiting for a number on %s" % (
        len(found), "" if len(found) == 1 else "s", args.interface))
    if not found:
        print("Boards that a running printer uses do not answer.")
    return 0
