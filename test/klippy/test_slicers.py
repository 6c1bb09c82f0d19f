# SPDX-License-Identifier: GPL-3.0-or-later
"""Files in the habits of each slicer print to the end, without a complaint."""

import collections
import pathlib

import machine_configs
import pytest
from printer_run import PrinterRun

FOLDER = pathlib.Path(__file__).resolve().parent / "slicers"
SECTIONS = """
[exclude_object]
[display_status]
[firmware_retraction]
[gcode_arcs]
"""
# What each file says that has no meaning here, and is told of once
TOLD = {
    "prusaslicer": ["M201", "M203", "M205"],
    "superslicer": ["M141", "M201", "M203", "M205", "M900"],
    "orcaslicer": ["M141", "M191"],
    "cura": ["M201", "M203", "M205"],
}
OBJECTS = {
    "prusaslicer": ["PART_A", "PART_B"],
    "superslicer": ["PART_A_ID_0_COPY_0", "PART_B_ID_1_COPY_0"],
    "orcaslicer": ["PART_A.STL_ID_0_COPY_0", "PART_B.STL_ID_1_COPY_0"],
    "cura": [],
}
ADVANCE = {"prusaslicer": 0.04, "superslicer": 0.035, "orcaslicer": 0.04, "cura": 0.02}
ACCEL = {"prusaslicer": 1250., "superslicer": 1250., "orcaslicer": 3000., "cura": 1000.}


@pytest.fixture(params=sorted(TOLD))
def print_of(request, tmp_path):
    """(slicer, run after its file was printed)."""
    config = machine_configs.make_axes("cartesian", 0.02,
                                       machine_configs.BED + SECTIONS)
    run = PrinterRun(config, tmp_path)
    return request.param, run.run([FOLDER / (request.param + ".gcode")])


def test_prints_without_a_complaint(print_of):
    slicer, run = print_of
    assert not [text for text in run.responses if text.startswith("!!")]
    assert not [text for text in run.responses if "Unknown command" in text]
    told = collections.Counter(text.split()[1] for text in run.responses
                               if "is ignored" in text)
    assert told == {name: 1 for name in TOLD[slicer]}
    assert run.snapshots[-1].position[:2] == [10., 180.]
    assert run.count_late_events() == 0


def test_takes_over_what_it_says(print_of):
    slicer, run = print_of
    lookup, now = run.printer.lookup_object, run.world.monotonic()
    objects = lookup("exclude_object").get_status(now)["objects"]
    assert [entry["name"] for entry in objects] == OBJECTS[slicer]
    assert lookup("extruder").get_status(now)["pressure_advance"] == ADVANCE[slicer]
    assert lookup("toolhead").get_status(now)["max_accel"] == ACCEL[slicer]
    stats = lookup("print_stats").get_status(now)
    assert stats["state"] == "complete"
    if slicer == "orcaslicer":
        assert stats["info"] == {"current_layer": 3, "total_layer": 3}
