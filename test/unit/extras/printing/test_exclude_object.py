# SPDX-License-Identifier: GPL-3.0-or-later
import json

import pytest
from front_end import make_printer
from hypothesis import given, settings
from hypothesis import strategies as st

from klippy.errors import CommandError


@pytest.fixture
def printer():
    made = make_printer("exclude_object", motion=True)
    yield made
    made.close()


def status(printer):
    return printer.lookup_object("exclude_object").get_status(0.)


def run(printer, script):
    printer.gcode.run_script(script)


def moves(printer):
    return printer.lookup_object("gcode_move").moves


def test_definitions(printer):
    run(printer, "EXCLUDE_OBJECT_DEFINE NAME='b o' CENTER=1.5,2 POLYGON=[[0,0],[1,2]]"
                 " Extra=x\nEXCLUDE_OBJECT_DEFINE NAME=a\nEXCLUDE_OBJECT_START NAME=c")
    assert status(printer) == {
        "objects": [{"name": "A"},
                    {"name": "B O", "center": [1.5, 2], "polygon": [[0, 0], [1, 2]],
                     "extra": "x"}, {"name": "C"}],
        "excluded_objects": [], "current_object": "C"}
    run(printer, "EXCLUDE_OBJECT_DEFINE\nEXCLUDE_OBJECT_DEFINE JSON=1")
    assert printer.output[0] == "// Known objects: A B O C"
    assert json.loads(printer.output[1].partition(": ")[2]) == status(
        printer)["objects"]
    for wrong in ("CENTER=1,x", "POLYGON=[[1,2]"):
        with pytest.raises(CommandError, match="no list of numbers"):
            run(printer, "EXCLUDE_OBJECT_DEFINE NAME=d " + wrong)
    run(printer, "EXCLUDE_OBJECT_DEFINE RESET=1")
    assert status(printer) == {"objects": [], "excluded_objects": [],
                               "current_object": None}


def test_excluding_and_taking_it_back(printer):
    run(printer, "EXCLUDE_OBJECT NAME=b\nEXCLUDE_OBJECT NAME=a\nEXCLUDE_OBJECT NAME=a")
    assert status(printer)["excluded_objects"] == ["A", "B"]
    run(printer, "EXCLUDE_OBJECT\nEXCLUDE_OBJECT RESET=1 NAME=a")
    assert printer.output[-1] == "// Excluded objects: A B"
    assert status(printer)["excluded_objects"] == ["B"]
    with pytest.raises(CommandError, match="no current object"):
        run(printer, "EXCLUDE_OBJECT CURRENT=1")
    run(printer, "EXCLUDE_OBJECT_START NAME=c\nEXCLUDE_OBJECT CURRENT=1\n"
                 "EXCLUDE_OBJECT_END NAME=x\nEXCLUDE_OBJECT_END")
    assert status(printer)["excluded_objects"] == ["B", "C"]
    assert printer.output[-2:] == [
        "// EXCLUDE_OBJECT_END NAME=X within object C",
        "// EXCLUDE_OBJECT_END without EXCLUDE_OBJECT_START"]
    run(printer, "EXCLUDE_OBJECT RESET=1")
    assert status(printer)["excluded_objects"] == []


def test_moves_of_the_object_are_left_out(printer):
    run(printer, "G1 X1 Y1 E5\nEXCLUDE_OBJECT NAME=a\nEXCLUDE_OBJECT_START NAME=a\n"
                 "G1 X10 E7\nG1 X20 E9\nEXCLUDE_OBJECT_END NAME=a\n"
                 "G1 X30 Z1\nG1 X31 E10")
    assert moves(printer) == [[1., 1., 0., 5.], [30., 1., 1., 5.], [31., 1., 1., 6.]]
    # the G-code's own position goes on
    gcode_move = printer.lookup_object("gcode_move")
    gcode_move.reset_last_position()
    assert gcode_move.position == [31., 1., 1., 10.]


def test_new_file_removes_the_transform(printer):
    gcode_move = printer.lookup_object("gcode_move")
    run(printer, "EXCLUDE_OBJECT NAME=a")
    assert gcode_move.transform is not gcode_move
    printer.send_event("virtual_sdcard:reset_file")
    assert gcode_move.transform is gcode_move


def flow(script):
    """Positions of E of a script with object A excluded from the start."""
    printer = make_printer("exclude_object", motion=True)
    run(printer, "EXCLUDE_OBJECT NAME=a\n" + script)
    position = [move[3] for move in moves(printer)]
    printer.close()
    return position


@pytest.mark.parametrize("inside, outside, expected", [
    # retracted inside: the retraction is made on the way out
    ("G1 E5\nG1 E9\nG1 E8", "G1 X1\nG1 E9\nG1 E10", [-1., 0., 1.]),
    # not retracted at either end
    ("G1 E5\nG1 E4\nG1 E9", "G1 X1\nG1 E10", [0., 1.]),
])
def test_retraction_at_the_ends(inside, outside, expected):
    assert flow("EXCLUDE_OBJECT_START NAME=a\n%s\nEXCLUDE_OBJECT_END\n%s"
                % (inside, outside)) == expected


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.booleans(), st.integers(1, 9), st.booleans(),
                          st.booleans()), max_size=12))
def test_filament_in_the_nozzle_is_what_the_slicer_meant(parts):
    """After each part the retraction is the slicer's, and what was extruded is
    the sum over the parts that are printed, however the parts retract."""
    script, position, peak, wanted = [], 0., 0., []
    total = 0.
    for is_excluded, amount, at_start, at_end in parts:
        script.append("EXCLUDE_OBJECT_START NAME=%s" % ("a" if is_excluded else "b",))
        if at_start:
            script.append("G1 E%.1f" % (position - 1.,))
        peak += amount
        position = peak
        script.append("G1 X1 E%.1f" % (position,))
        if at_end:
            position -= 1.
            script.append("G1 E%.1f" % (position,))
        script.append("EXCLUDE_OBJECT_END\nG1 X5")
        total += 0. if is_excluded else amount
        wanted.append(total - (1. if at_end else 0.))
    printer = make_printer("exclude_object", motion=True)
    run(printer, "\n".join(["EXCLUDE_OBJECT NAME=a"] + script))
    ends = [move[3] for move in moves(printer) if move[0] == 5.]
    # every part ends with a travel to X5; further moves there retract or print
    printer.close()
    assert not wanted or ends[-1] == pytest.approx(wanted[-1])
