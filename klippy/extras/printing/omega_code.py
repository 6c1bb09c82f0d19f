# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines that a Palette 2 and its host exchange: O-codes ("Omega").

`O20 D0`: O, a number, then words, each a letter (D, U) and its value.  Numbers are
hexadecimal unless said otherwise.  See docs/internals/palette2.md.
"""
from klippy.record import record

HEARTBEAT, HEARTBEAT_ANSWER = "O99", "Connection Okay"
ASK_VERSION = "O50"
CANCEL = "O0"
PING = "O31"
SMART_LOAD_START, SMART_LOAD_STOP = "O102 D0", "O102 D1"
CUT = "O10 D5"
# cut, then run all four inputs and the output back
CLEAR = (CUT, "O10 D0 D0 D0 DFFE1", "O10 D1 D0 D0 DFFE1", "O10 D2 D0 D0 DFFE1",
         "O10 D3 D0 D0 DFFE1", "O10 D4 D0 D0 D0069")
FILE_NAME, NO_MORE_FILES = "O51 D%s", "O52"
WORD_LETTERS = "DU"


@record(frozen=True)
class OmegaCode:
    """A line of the device: its number, and its words as (letter, value) texts."""

    number: int
    words: tuple

    def is_like(self, *words):
        """True if it begins with these words, such as "U0", "D2"."""
        return ["".join(word) for word in self.words[:len(words)]] == list(words)

    def get_text(self, index):
        """Value of a word; raises ValueError without one."""
        if index >= len(self.words):
            raise ValueError("a word is missing")
        return self.words[index][1]

    def get_hex(self, index):
        """Value of a word as a hexadecimal number."""
        return int(self.get_text(index), 16)

    def get_float(self, index):
        """Value of a word as a decimal number."""
        return float(self.get_text(index))


def parse(line):
    """The OmegaCode of a line, None if it is none."""
    head, *words = line.split()
    if head[:1] != "O" or not head[1:].isdigit() or any(
            word[0] not in WORD_LETTERS for word in words):
        return None
    return OmegaCode(int(head[1:]), tuple((word[0], word[1:]) for word in words))
