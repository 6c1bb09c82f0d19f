#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Count what input shapers and pressure advance add to batch runs of made-up
files, by callgrind: a table of docs/performance.md.  The start is left out."""

import argparse
import pathlib
import re
import tempfile

import bench_files
import bench_table

# Moves that are counted: enough to tell, and short runs
MOVES = {"dense": 10000, "mixed": 6000, "infill": 200}
# name: (input shaper, pressure advance)
VARIANTS = {"neither": (False, 0.), "MZV": (True, 0.), "PA": (False, 0.04),
            "PA, MZV": (True, 0.04)}


def make_variant(name, folder):
    """Path of the patterns' config with or without shaper and advance."""
    is_shaped, advance = VARIANTS[name]
    text = bench_table.make_config("patterns", folder).read_text()
    if not is_shaped:
        text = text.partition("[input_shaper]")[0]
    path = folder / "variant.cfg"
    path.write_text(re.sub(r"pressure_advance: .*", "pressure_advance: %g" % (advance,),
                           text))
    return path


def make_start(name, folder):
    """Path of the first lines of a pattern."""
    lines = bench_files.make_pattern(name, folder).read_text().splitlines()
    path = folder / "start.gcode"
    path.write_text("\n".join(lines[:MOVES[name] + 5]) + "\n")
    return path


def count(config, job, dictionary, folder):
    """(G of the C core, G in all) of a run."""
    command = bench_files.make_command(config, job, dictionary, folder)
    core, other = bench_table.count_instructions(command, folder)
    return core / 1e9, (core + other) / 1e9


def count_starts(dictionary, folder):
    """count() of no job, by variant."""
    job, starts = bench_table.make_job("nothing", folder), {}
    for name in VARIANTS:
        config = make_variant(name, folder)
        bench_files.run(config, job, dictionary, folder)    # all is kept now
        starts[name] = count(config, job, dictionary, folder)
    return starts


def measure(job, starts, dictionary, folder):
    """Print a line for each variant."""
    plain = None
    for name, start in starts.items():
        found = count(make_variant(name, folder), make_start(job, folder), dictionary,
                      folder)
        core, whole = (b - a for a, b in zip(start, found, strict=True))
        steps, messages = bench_table.count_steps(folder / "out.serial", dictionary)
        plain = plain or whole
        print("%-8s %-10s %8.3f %8.3f %8.1f %8.1f %+8.1f" % (
            job, name, whole, core, core * 1e9 / steps, messages / 1e3,
            100. * (whole / plain - 1.)), flush=True)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("jobs", nargs="*", default=list(MOVES),
                        help="some of %s; all" % (", ".join(MOVES),))
    options = parser.parse_args()
    dictionary = bench_table.build_dictionary("stm")
    print("%-8s %-10s %8s %8s %8s %8s %8s" % (
        "", "", "G in all", "G core", "a step", "K msgs", "% more"))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        starts = count_starts(dictionary, folder)
        for job in options.jobs:
            measure(job, starts, dictionary, folder)


if __name__ == "__main__":
    main()
