# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy dump`: a file of batch mode as text, one command a line."""

import sys

from klippy import msgproto
from klippy.cli import forget_stdout
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


def format_payload(parser, payload):
    """(text of each message, count of those that cannot be read)."""
    lines, position, bad = [], 0, 0
    while position < len(payload):
        params = {}
        try:
            end = parser.decode_message(payload, position, params)
        except msgproto.error:
            # the next one's start is not known either
            end = len(payload)
            params = {"#name": "#unknown", "#msg": payload[position:]}
        bad += params["#name"] == "#unknown"
        lines.append(parser.format_params(params))
        position = end
    return lines, bad


class Dump:
    """Writes the commands of a file as text and counts what is wrong with it."""

    def __init__(self, parser, output, show_sequence=False):
        self.parser, self.output = parser, output
        self.show_sequence = show_sequence
        self.bad_bytes = self.bad_messages = 0

    def write_file(self, source):
        """Dump all blocks of a binary file."""
        blocks = read_blocks(source)
        while True:
            try:
                sequence, payload = next(blocks)
            except StopIteration as end:
                self.bad_bytes += end.value
                return
            lines, bad = format_payload(self.parser, payload)
            self.bad_messages += bad
            prefix = "seq %x: " % (sequence,) if self.show_sequence else ""
            for line in lines:
                self.output.write(prefix + line + "\n")

    def list_faults(self):
        """Texts of what was wrong; empty if nothing was."""
        faults = []
        if self.bad_bytes:
            faults.append("%d bytes are no part of a block" % (self.bad_bytes,))
        if self.bad_messages:
            faults.append("%d blocks hold messages that the dictionary does not"
                          " explain: was the file made with another dictionary?"
                          % (self.bad_messages,))
        return faults


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
        dump = Dump(read_dictionary(options.dict), sys.stdout, options.seq)
        with open(options.file, "rb") as source:
            dump.write_file(source)
        sys.stdout.flush()
    except BrokenPipeError:
        forget_stdout()
        return 1
    except (OSError, msgproto.error) as err:
        sys.stderr.write("klippy dump: %s\n" % (err,))
        return 1
    faults = dump.list_faults()
    for fault in faults:
        sys.stderr.write("klippy dump: %s\n" % (fault,))
    return 1 if faults else 0
