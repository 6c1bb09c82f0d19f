# SPDX-License-Identifier: GPL-3.0-or-later
"""Files to print in a soak: small sliced ones, and random ones of some minutes."""
import math
import pathlib
import re
from dataclasses import dataclass, field

TESTS = pathlib.Path(__file__).resolve().parents[1]
SLICED = sorted((TESTS / "klippy" / "slicers").glob("*.gcode"))
SLICED_SHARE = 0.2
WORD = re.compile(r"([XYZ])(-?\d*\.?\d+)")
MOVES = ("G0", "G1", "G2", "G3")
MOVE_TIME = 0.25        # s of a random move, about
FILAMENT_RATIO = 0.03   # mm of filament a mm


@dataclass
class Job:
    """A file to print.

    end: {axis: mm} where the machine must stand afterwards.
    """

    name: str
    lines: list
    end: dict = field(default_factory=dict)

    def write(self, folder):
        (folder / self.name).write_text("\n".join(self.lines) + "\n")


def find_end(lines):
    """{axis: mm} where the moves of a file end."""
    end, is_relative = {}, False
    for line in lines:
        text = line.split(";")[0].strip()
        command = text.split(" ")[0]
        if command in ("G90", "G91"):
            is_relative = command == "G91"
        elif command in MOVES:
            for axis, value in WORD.findall(text):
                end[axis] = float(value) + (end[axis] if is_relative else 0.)
    return end


def make_sliced(draw):
    path = draw.choice(SLICED)
    lines = path.read_text().splitlines()
    return Job(path.name, lines, find_end(lines))


def make_random(draw, name, seconds):
    """Moves of random lengths and speeds, layer on layer, for some time (s)."""
    bed, nozzle = draw.randrange(40, 70), draw.randrange(180, 230)
    lines = ["M140 S%d" % bed, "M104 S%d" % nozzle, "G28", "M190 S%d" % bed,
             "M109 S%d" % nozzle, "G90", "M83", "G92 E0"]
    height, last = 0.2, (95., 95.)
    for index in range(round(seconds / MOVE_TIME)):
        if index % 40 == 0:
            lines += ["G1 Z%.2f F600" % height, "M106 S%d" % draw.randrange(256)]
            height += 0.2
        place = draw.uniform(80., 110.), draw.uniform(80., 110.)
        filament = math.dist(last, place) * FILAMENT_RATIO
        last = place
        lines.append("G1 X%.3f Y%.3f E%.4f F%d" % (
            *place, filament, draw.randrange(1800, 9000)))
    end = {"X": round(draw.uniform(5., 200.), 3), "Y": round(draw.uniform(5., 200.), 3),
           "Z": round(height + draw.uniform(1., 20.), 3)}
    lines += ["G1 Z%.3f F600" % end["Z"], "G1 X%.3f Y%.3f F9000" % (end["X"], end["Y"]),
              "M104 S0", "M140 S0", "M107"]
    return Job(name, lines, end)


def make_job(draw, number, seconds):
    """The job of one number."""
    if draw.random() < SLICED_SHARE:
        return make_sliced(draw)
    return make_random(draw, "job%d.gcode" % (number % 5), seconds)
