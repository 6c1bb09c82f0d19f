#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Time batch runs of the sample files on four machines: the table of
docs/performance.md, beside the figures of the field."""

import argparse
import collections
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import bench_files

sys.path.insert(0, str(bench_files.ROOT))

from klippy.cli import dump  # noqa: E402

ROOT = bench_files.ROOT
MACHINES = ROOT / "test" / "bench" / "machines"
SAMPLES = ROOT / "config" / "samples"
CHIPS = {"avr": "atmega2560", "stm": "stm32f446"}
# name: (machine, chip, job, (wall s, cpu s, MB, M steps, K queue_steps, MB sent)
# of the field, as it was measured on two quiet cores; or None)
ROWS = {
    "cube, cartesian avr": ("cartesian_avr", "avr", "cube20",
                            (1.17, 1.22, 36, 4.45, 205, 1.64)),
    "cube, corexy 64": ("corexy_stm_64", "stm", "cube20",
                        (1.58, 1.92, 39, 27.9, 311, 2.60)),
    "cube, corexy 64 PA MZV": ("corexy_stm_is_pa64", "stm", "cube20",
                               (1.85, 2.46, 40, 27.7, 329, 2.74)),
    "vase, cartesian avr": ("cartesian_avr", "avr", "vase_s",
                            (1.76, 1.82, 41, 5.09, 464, 3.74)),
    "vase, delta": ("delta_stm", "stm", "vase_s at 0",
                    (1.92, 2.12, 47, 4.66, 703, 6.04)),
    "vase, corexy 64 PA MZV": ("corexy_stm_is_pa64", "stm", "vase_s",
                               (3.26, 4.09, 46, 25.5, 663, 5.55)),
    "dense, corexy 64 PA MZV": ("patterns", "stm", "dense", None),
    "mixed, corexy 64 PA MZV": ("patterns", "stm", "mixed", None),
    "infill, corexy 64 PA MZV": ("patterns", "stm", "infill", None),
    "start, corexy 64 PA MZV": ("corexy_stm_is_pa64", "stm", "nothing", None),
    "start, 150 macros": ("many_macros", "stm", "nothing", None),
}
CORE = "libklippyc"
HEAD = "%-26s %7s %7s %5s %8s %8s %8s %8s %8s %8s" % (
    "", "wall s", "CPU s", "MB", "M steps", "K msgs", "MB sent", "G instr",
    "K a line", "a step")
AIMS = ("Aims: 8 K instructions a line outside of the C core, in it 60 a step (150 with"
        " shaper and pressure advance); 0.5 G a start.")
MACRO = """
[gcode_macro MACRO_%(i)d]
description: Thing number %(i)d
variable_count: 0
gcode:
  {%% set s = params.S|default(%(i)d)|float %%}
  {%% set who = params.WHO|default("nobody") %%}
  {%% if printer.toolhead.position.x > s + 10 %%}
    G1 X{s + 2} Y{params.Y|default(10)|float} F3000
    M117 {who}: {"%%.2f" %% s}
  {%% else %%}
    SET_GCODE_VARIABLE MACRO=MACRO_%(i)d VARIABLE=count VALUE={s|int + 1}
  {%% endif %%}
  {%% for k in range(3) %%}
    G1 X{s + k} F6000
    G1 X{s - k} F6000
  {%% endfor %%}
  M117 done
"""


def build_dictionary(chip):
    """Path of the dictionary of a chip's firmware, which is built."""
    name = CHIPS[chip]
    out = "out/bench-%s/" % (name,)
    subprocess.run(["make", "-s", "firmware", "OUT=" + out, "PYTHON=" + sys.executable,
                    "KCONFIG_CONFIG=test/configs/%s.config" % (name,)],
                   cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return ROOT / out / "klipper.dict"


def make_config(name, folder):
    """Path of a machine's config; `patterns` and `many_macros` are made up."""
    path = MACHINES / (name + ".cfg")
    if path.exists():
        return path
    text = (MACHINES / "corexy_stm_is_pa64.cfg").read_text()
    if name == "patterns":
        text = re.sub(r"(shaper_freq_[xy]): \d+", r"\1: 40", text).replace(
            "[extruder]", "[extruder]\nmin_extrude_temp: 0\n"
            "max_extrude_cross_section: 100")
    else:
        text += "".join(MACRO % {"i": i} for i in range(150))
    path = folder / (name + ".cfg")
    path.write_text(text)
    return path


def make_job(name, folder):
    """Path of a G-code file: a sample, moved to 0 for a delta, or a pattern."""
    if name in bench_files.PATTERNS:
        return bench_files.make_pattern(name, folder)
    if (SAMPLES / (name + ".gcode")).exists():
        return SAMPLES / (name + ".gcode")
    path = folder / (name.replace(" ", "_") + ".gcode")
    if name == "nothing":
        path.write_text("M115\n")
        return path
    text = (SAMPLES / (name.partition(" ")[0] + ".gcode")).read_text()
    path.write_text("".join(
        re.sub(r"([XY])(-?[\d.]+)", move_to_centre, line)
        if line.startswith(("G0", "G1")) else line
        for line in text.splitlines(keepends=True)))
    return path


def move_to_centre(match):
    """A coordinate of a bed of 200 mm as one of a round bed."""
    return "%s%.3f" % (match[1], float(match[2]) - 100.)


def count_steps(output, dictionary):
    """(steps, queue_step messages) in an output file."""
    parser = dump.read_dictionary(str(dictionary))
    steps = messages = 0
    with open(output, "rb") as source:
        for _, payload in dump.read_blocks(source):
            position = 0
            while position < len(payload):
                params = {}
                position = parser.decode_message(payload, position, params)
                if params["#name"] == "queue_step":
                    steps += params["count"]
                    messages += 1
    return steps, messages


def count_instructions(command, folder):
    """(of the C core, of all else) instructions of a run by callgrind."""
    out = folder / "callgrind.out"
    done = subprocess.run(
        ["valgrind", "--tool=callgrind", "--callgrind-out-file=%s" % (out,), *command],
        capture_output=True, text=True)
    if done.returncode:
        sys.exit("%s failed by callgrind:\n%s" % (" ".join(command),
                                                 done.stderr[-2000:]))
    with open(out) as lines:
        counts = sum_objects(lines)
    core = sum(count for name, count in counts.items() if CORE in name)
    return core, sum(counts.values()) - core


def sum_objects(lines):
    """Instructions by the object file that they are in, of callgrind's output.

    Costs are the second number of a line; the line after `calls=` is what the
    function called took, which is told there.
    """
    names, counts, name, is_call = {}, collections.Counter(), "", False
    for line in lines:
        found = re.match(r"ob=(\(\d+\))(?: (.*))?", line)
        if found:
            names.setdefault(found[1], found[2] or "")
            name = found[1]
        elif re.match(r"[\d+*-]", line):
            counts[name] += 0 if is_call else int(line.split()[1])
        else:
            found = re.match(r"cob=(\(\d+\)) (.*)", line)
            if found:
                names.setdefault(found[1], found[2])
        is_call = line.startswith("calls=")
    return {names.get(number, number): count for number, count in counts.items()}


def count_lines(job):
    """Lines of a G-code file that say something."""
    with open(job) as lines:
        return sum(1 for line in lines if line.partition(";")[0].strip())


def split_instructions(args, size, n_steps, folder):
    """(G in all, K a line without the C core, in the C core a step), the start
    left out of both.  size: bytes that the same run has sent before."""
    config, job, dictionary, _ = args
    start = count_instructions(bench_files.make_command(
        config, make_job("nothing", folder), dictionary, folder), folder)
    found = count_instructions(bench_files.make_command(*args), folder)
    counted = (folder / "out.serial").stat().st_size
    if counted != size:
        sys.exit("%s with %s: %d bytes when timed, but %d when counted" % (
            job, config, size, counted))
    core, other = (count - of_start
                   for count, of_start in zip(found, start, strict=True))
    return sum(found) / 1e9, other / count_lines(job) / 1e3, core / max(n_steps, 1)


def measure(row, dictionaries, options, folder):
    """(wall s, cpu s, MB, M steps, K queue_steps, MB sent), and, if wanted,
    what split_instructions() tells."""
    machine, chip, name, _ = row
    config, job = make_config(machine, folder), make_job(name, folder)
    args = config, job, dictionaries[chip], folder
    bench_files.run(*args)      # whatever is kept for the next start is there now
    best = min(bench_files.run(*args) for _ in range(options.runs))
    user, system, memory, size, wall = best
    counts = count_steps(folder / "out.serial", dictionaries[chip])
    found = (wall, user + system, memory, counts[0] / 1e6, counts[1] / 1e3, size / 1e6)
    if not options.instructions:
        return found
    if name == "nothing":
        return (*found, sum(count_instructions(
            bench_files.make_command(*args), folder)) / 1e9)
    return found + split_instructions(args, size, counts[0], folder)


def main():
    """Print a line for each row, and one of the field's where it is known."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rows", nargs="*", default=list(ROWS), metavar="row",
                        help="parts of the names of rows; all")
    parser.add_argument("--runs", type=int, default=3, help="the best is told")
    parser.add_argument("--instructions", action="store_true",
                        default=shutil.which("valgrind") is not None,
                        help="count instructions by callgrind (if it is there)")
    parser.add_argument("--no-instructions", dest="instructions", action="store_false")
    options = parser.parse_args()
    dictionaries = {chip: build_dictionary(chip) for chip in CHIPS}
    print(HEAD)
    for name, row in ROWS.items():
        if not any(part in name for part in options.rows):
            continue
        with tempfile.TemporaryDirectory() as folder:
            found = measure(row, dictionaries, options, pathlib.Path(folder))
        print_row(name, found)
        if row[3] is not None:
            print_row("   the field", row[3])
    if options.instructions:
        print(AIMS)


def print_row(name, numbers):
    """A line of the table; `numbers` may end before its last columns."""
    forms = ("%7.2f", "%7.2f", "%5.0f", "%8.2f", "%8.0f", "%8.2f", "%8.2f", "%8.1f",
             "%8.0f")
    print("%-26s " % (name,) + " ".join(
        form % (number,) for form, number in zip(forms, numbers, strict=False)),
        flush=True)


if __name__ == "__main__":
    main()
