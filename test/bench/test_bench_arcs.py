# SPDX-License-Identifier: GPL-3.0-or-later
"""Arcs as one move each, against the same cut into straight moves.

Run: pytest test/bench/test_bench_arcs.py -s
"""

import os
import pathlib
import re
import resource
import subprocess
import sys

import pytest
from machine_configs import BED, make_axes, make_delta

from klippy.cli import dump

ROOT = pathlib.Path(__file__).resolve().parents[2]
DICTIONARY = ROOT / "out-simulator" / "klipper.dict"
N_ARCS = 2000
SHAPERS = {"mzv": "\n[input_shaper]\nshaper_type: mzv\nshaper_freq_x: 40\n"
           "shaper_freq_y: 40\n",
           "mzv and ei": "\n[input_shaper]\nshaper_type_x: mzv\nshaper_freq_x: 52\n"
           "shaper_type_y: ei\nshaper_freq_y: 41\n",
           "filament": "enabled_extruders: extruder\n"}
WAYS = {"native": "native: True\n", "1 mm": "native: False\nresolution: 1\n",
        "0.1 mm": "native: False\nresolution: 0.1\n"}


def make_config(kind, way):
    kind, *options = kind.split(", ")
    extra = BED + "\n[gcode_arcs]\n" + WAYS[way] + "".join(
        SHAPERS[option] for option in options)
    text = make_delta(0.04, extra) if kind == "delta" else make_axes(kind, 0.04, extra)
    pins = {}
    text = re.sub(r"\bP[A-L]\d\b",
                  lambda m: pins.setdefault(m[0], "gpio%d" % (len(pins),)), text)
    return text.replace("microsteps: 16", "microsteps: 64")


def make_job(kind, count):
    """Half rounds of 2 to 40 mm at 150 mm/s, with lines between them."""
    x, y = (0., 0.) if kind.startswith("delta") else (100., 100.)
    lines = ["G28", "G90", "M83", "G1 X%g Y%g Z20 F6000" % (x, y), "G92 X0 Y0"]
    for i in range(count // 2):
        radius = 2. + i * 7 % 39
        lines += ["G1 X%.3f Y0 F9000" % radius,
                  "G3 X0 Y%.3f I%.3f J0 E%.4f" % (radius, -radius, 0.02 * radius),
                  "G2 X0 Y%.3f I0 J%.3f E%.4f" % (-radius, -radius, 0.04 * radius)]
    return "\n".join(lines) + "\n"


def run(folder, kind, way, count):
    """(user CPU s, bytes, queue_steps) of a batch run."""
    config, job, out = (folder / name for name in ("a.cfg", "a.gcode", "a.serial"))
    config.write_text(make_config(kind, way))
    job.write_text(make_job(kind, count))
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([sys.executable, "-m", "klippy", "run", str(config), "-i", str(job),
                    "-o", str(out), "-d", str(DICTIONARY)], cwd=ROOT, check=True,
                   stdout=subprocess.DEVNULL,
                   env={**os.environ, "PYTHONPATH": str(ROOT)})
    used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    with open(folder / "a.txt", "w+") as text:
        dumper = dump.Dump(dump.read_dictionary(str(DICTIONARY)), text)
        dumper.write_file(out.open("rb"))
        text.seek(0)
        n_runs = sum(1 for line in text if line.startswith("queue_step "))
    return used, out.stat().st_size, n_runs


@pytest.mark.parametrize("kind", [
    "corexy", "delta", "corexy, mzv", "delta, mzv", "corexy, mzv, filament",
    "corexy, mzv and ei, filament"])
def test_arcs_against_segments(tmp_path, kind):
    found = {}
    for way in WAYS:
        cpu, size, runs = run(tmp_path, kind, way, N_ARCS)
        empty = run(tmp_path, kind, way, 0)
        found[way] = (cpu - empty[0], size - empty[1], runs - empty[2])
        print("%s, %s: %.3f s, %d bytes, %d queue_steps" % (kind, way, *found[way]))
    assert found["native"][1] < found["1 mm"][1]
