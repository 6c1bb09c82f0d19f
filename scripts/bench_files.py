#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Time batch runs of whole G-code files: CPU, memory, bytes on the wire."""

import argparse
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
# name: (moves, mm a move); all at 200 mm/s
PATTERNS = {"dense": (150000, 0.3), "mixed": (64000, 2.), "infill": (3000, 160.)}


def make_circles(n_moves, length):
    """G-code lines along a ring whose radius sways."""
    angle, lines = 0., []
    for _ in range(n_moves):
        angle += length / 60.
        radius = 60. + 2. * math.sin(7. * angle)
        lines.append("G1 X%.3f Y%.3f E%.5f" % (
            100. + radius * math.cos(angle), 100. + radius * math.sin(angle),
            length * 0.033))
    return lines


def make_lines(n_moves, length):
    """G-code lines to and fro."""
    return ["G1 X%.3f Y%.3f E%.5f" % (
        100. + length * (0.5 if i % 2 else -0.5), 20. + 0.5 * (i % 320),
        length * 0.033) for i in range(n_moves)]


def make_pattern(name, folder):
    """Path of a made-up file."""
    n_moves, length = PATTERNS[name]
    make = make_lines if name == "infill" else make_circles
    path = folder / (name + ".gcode")
    path.write_text("\n".join([
        "G28", "G90", "M83", "G1 X100 Y100 Z1 F6000", "G1 F12000",
        *make(n_moves, length)]) + "\n")
    return path


def make_command(config, job, dictionary, folder):
    """Command line of a batch run; its output is out.serial in the folder."""
    return [sys.executable, str(ROOT / "klippy" / "klippy.py"), str(config),
            "-i", str(job), "-o", str(folder / "out.serial"), "-d", str(dictionary),
            "-l", str(folder / "log")]


def run(config, job, dictionary, folder):
    """(user s, system s, peak memory in MB, bytes, wall s) of a batch run."""
    log, start = folder / "log", time.monotonic()
    process = subprocess.Popen(make_command(config, job, dictionary, folder),
                               stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    elapsed = time.monotonic() - start
    if status:
        sys.exit("%s with %s failed:\n%s" % (
            job, config, log.read_text()[-2000:] if log.exists() else ""))
    return (usage.ru_utime, usage.ru_stime, usage.ru_maxrss / 1024.,
            (folder / "out.serial").stat().st_size, elapsed)


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__,
        epilog="The pins of the config must be those of the dictionary's chip. The "
        "patterns need min_extrude_temp: 0, max_extrude_cross_section: 100 and a "
        "bed of 200 mm.")
    parser.add_argument("config", type=pathlib.Path, help="printer.cfg")
    parser.add_argument("dictionary", type=pathlib.Path,
                        help="klipper.dict of the firmware")
    parser.add_argument("jobs", nargs="+",
                        help="G-code files, or %s" % (", ".join(PATTERNS),))
    parser.add_argument("--runs", type=int, default=3, help="the best is told")
    return parser.parse_args()


def main():
    """Print a line for each job."""
    options = parse_arguments()
    print("%-20s %8s %8s %8s %10s %8s" % (
        "job", "user s", "system s", "MB", "bytes", "wall s"))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for job in options.jobs:
            path = make_pattern(job, folder) if job in PATTERNS else job
            best = min(run(options.config, path, options.dictionary, folder)
                       for _ in range(options.runs))
            print("%-20s %8.2f %8.2f %8.0f %10d %8.2f" % (
                pathlib.Path(path).stem, *best), flush=True)


if __name__ == "__main__":
    main()
