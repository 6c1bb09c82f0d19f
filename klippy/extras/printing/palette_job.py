# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file says about its splices, and how a Palette 2 asks for it.

The O-codes at the head of a file are kept until the device asks for them, a line
at a time, in the order of the file.
"""

HEADER_NUMBERS = range(21, 30)
SPLICE_NUMBER, PING_NUMBER, ALGORITHM_NUMBER = 30, 31, 32
# What O20 asks for
ASK_HEADER, ASK_SPLICE, ASK_PING, ASK_ALGORITHM, ASK_AGAIN = 0, 1, 2, 4, 8
ASK_FIRST_USE = 5
NAMES = {ASK_HEADER: "header lines (O21 to O29)", ASK_SPLICE: "splices (O30)",
         ASK_ALGORITHM: "splice settings (O32)"}


class PaletteJob:
    """The lines of one file, and which the device has got."""

    def __init__(self):
        self.lines = {ASK_HEADER: [], ASK_SPLICE: [], ASK_ALGORITHM: []}
        self.n_sent = dict.fromkeys(self.lines, 0)
        self.ping = None            # text of the O31 that the device may ask for

    def add(self, number, line):
        """Keep a line of the file; False if it is none of these."""
        if number in HEADER_NUMBERS:
            self.lines[ASK_HEADER].append(line)
        elif number == SPLICE_NUMBER:
            self.lines[ASK_SPLICE].append(line)
        elif number == ALGORITHM_NUMBER:
            self.lines[ASK_ALGORITHM].append(line)
        else:
            return False
        return True

    def take(self, kind):
        """The next line of a kind.  Raises ValueError with a text for the user."""
        if kind == ASK_PING:
            if self.ping is None:
                raise ValueError("asks for a ping, which the file has not made yet")
            return self.ping
        if kind not in self.lines:
            raise ValueError("asks for something unknown (%d)" % (kind,))
        index = self.n_sent[kind]
        if index >= len(self.lines[kind]):
            raise ValueError("asks for more %s than the %d of the file" % (
                NAMES[kind], len(self.lines[kind])))
        self.n_sent[kind] += 1
        return self.lines[kind][index]
