# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress of a simulated print on the terminal.

On a terminal one line is rewritten; into a file or pipe a line goes out
every now and then.  Wall time is read for the display only.
"""
import bisect
import re
import time
from dataclasses import dataclass, field

TTY_INTERVAL = 0.2
LINE_INTERVAL = 5.0
TITLE_WIDTH = 24
LAYER_MARK = re.compile(rb"^;\s*(LAYER_CHANGE|LAYER:\s*-?\d+|AFTER_LAYER_CHANGE"
                        rb"|layer \d+)", re.MULTILINE)
BLOCK = 1 << 20


class LayerIndex:
    """Byte positions of a file's layer changes, as slicers mark them."""

    def __init__(self, path):
        self.starts = []
        with open(path, "rb") as f:
            self._scan(f)

    def _scan(self, f):
        marks = {}
        base, rest = 0, b""
        while True:
            block = f.read(BLOCK)
            data = rest + block
            end = data.rfind(b"\n") + 1 if block else len(data)
            for match in LAYER_MARK.finditer(data[:end]):
                kind = match[1].split()[0].split(b":")[0]
                marks.setdefault(kind, []).append(base + match.start())
            if not block:
                break
            rest, base = data[end:], base + end
        if marks:
            self.starts = max(marks.values(), key=len)

    def __len__(self):
        return len(self.starts)

    def lookup(self, position):
        """Number of the layer (from 1) at a byte position, 0 before it."""
        return bisect.bisect_right(self.starts, position)


@dataclass
class Snapshot:
    """What a progress line shows; times in s, temperatures in degC."""

    filename: str
    state: str
    fraction: float
    layer: int
    n_layers: int
    position: tuple
    elapsed: float
    heaters: dict = field(default_factory=dict)
    extra: str = ""

    def calc_remaining(self):
        """Seconds left by the share of the file done; None early on."""
        if self.fraction < 0.01:
            return None
        return self.elapsed * (1.0 - self.fraction) / self.fraction


def format_duration(seconds):
    """1h02m03s, 2m03s or 3s."""
    seconds = round(seconds)
    hours, minutes = seconds // 3600, seconds // 60 % 60
    if hours:
        return "%dh%02dm%02ds" % (hours, minutes, seconds % 60)
    if minutes:
        return "%dm%02ds" % (minutes, seconds % 60)
    return "%ds" % seconds


def format_line(snapshot, factor):
    """One line for a Snapshot and the present speed-up."""
    parts = ["%-.*s" % (TITLE_WIDTH, snapshot.filename),
             "%3.0f%%" % (100.0 * snapshot.fraction)]
    if snapshot.n_layers:
        parts.append("layer %d/%d" % (snapshot.layer, snapshot.n_layers))
    for name, (temp, target) in snapshot.heaters.items():
        goal = "/%.0f" % target if target else ""
        parts.append("%s %.0f%s" % (name, temp, goal))
    if snapshot.position is not None:
        parts.append("X%.1f Y%.1f Z%.2f" % tuple(snapshot.position[:3]))
    parts.append("%.0fx" % factor if factor >= 9.95 else "%.1fx" % factor)
    parts.append(format_duration(snapshot.elapsed))
    remaining = snapshot.calc_remaining()
    if remaining is not None:
        parts.append("%s left" % format_duration(remaining))
    return "  ".join(parts)


class ProgressDisplay:
    """Writes Snapshots to a stream, as often as is pleasant to read."""

    def __init__(self, stream, wall_clock=time.monotonic):
        self.stream = stream
        self.is_tty = bool(getattr(stream, "isatty", lambda: False)())
        self.interval = TTY_INTERVAL if self.is_tty else LINE_INTERVAL
        self.wall_clock = wall_clock
        self.last = None
        self.width = 0

    def is_due(self):
        """Whether update() would write something now (cheap)."""
        return (self.last is None
                or self.wall_clock() - self.last[0] >= self.interval)

    def update(self, eventtime, snapshot):
        """Show a Snapshot of virtual time `eventtime` if it is time to."""
        wall = self.wall_clock()
        if self.last is None:
            factor = 1.0
        else:
            factor = (eventtime - self.last[1]) / max(wall - self.last[0], 1e-6)
        self.last = (wall, eventtime)
        self.write_line(format_line(snapshot, factor))

    def write_line(self, line):
        """Write one progress line."""
        if not self.is_tty:
            self.stream.write(line + "\n")
        else:
            self.stream.write("\r" + line.ljust(self.width))
            self.width = len(line)
        self.stream.flush()

    def write_message(self, text):
        """Write a line that stays."""
        if self.is_tty and self.width:
            self.stream.write("\r" + " " * self.width + "\r")
            self.width = 0
        self.stream.write(text + "\n")
        self.stream.flush()
