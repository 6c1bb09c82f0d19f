# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy dump`: a file of batch mode as text, one command a line."""

import sys

from klippy import msgproto
from klippy_ext import msgblock

HELP = "decode the output of batch mode to text"
READ_SIZE = 1 << 20


def read_blocks(source):
    """Yield (sequence, payload) of a binary file; returns skipped bytes."""
    rest, skipped = b"", 0
    while True:
        data = source.read(READ_SIZE)
        if not data:
            return skipped + len(rest)
        blocks, bad, rest = msgblock.split_blocks(rest + data)
        skipped += bad
        yield from blocks


def dump_file(source, parser, output, show_sequence=False):
    """Write the commands of source as text; returns the count of bad bytes."""
    blocks = read_blocks(source)
    while True:
        try:
            sequence, payload = next(blocks)
        except StopIteration as end:
            return end.value
        for line in parser.dump_payload(payload):
            output.write("seq %x: %s\n" % (sequence, line) if show_sequence
                         else line + "\n")


def read_dictionary(path):
    """A MessageParser for a klipper.dict file."""
    parser = msgproto.MessageParser()
    with open(path, "rb") as source:
        parser.process_identify(source.read(), decompress=False)
    return parser


def add_arguments(parser):
    """Declare the command line."""
    parser.add_argument("file", help="output file of batch mode (-o)")
    parser.add_argument("--dict", required=True, metavar="PATH",
                        help="dictionary of the mcu (klipper.dict)")
    parser.add_argument("--seq", action="store_true",
                        help="show the sequence number of each block")


def run(options):
    """Carry out a parsed command line; returns the exit status."""
    try:
        parser = read_dictionary(options.dict)
        with open(options.file, "rb") as source:
            bad = dump_file(source, parser, sys.stdout, options.seq)
    except (OSError, msgproto.error) as err:
        sys.stderr.write("klippy dump: %s\n" % (err,))
        return 1
    if bad:
        sys.stderr.write("klippy dump: %d bytes are no part of a block\n" % (bad,))
        return 1
    return 0
