# SPDX-License-Identifier: GPL-3.0-or-later
import motion_machine
import pytest

from klippy.errors import CommandError
from klippy.extras.tuning_tower import Tower

START = "G28\nG90\nM83\nG1 X50 Y50 Z1 F6000\n"


@pytest.fixture
def run(tmp_path, monkeypatch):
    return motion_machine.make_run(tmp_path, monkeypatch)


def make(start=0., factor=0., band=0., step_delta=0., step_height=0., skip=0.):
    return Tower(start, factor, band, step_delta, step_height, skip)


@pytest.mark.parametrize("tower, values", [
    (make(1., .5), {0.: 1., .2: 1.1, 10.: 6.}),
    (make(0., .01, band=4.), {0.: .02, 3.9: .02, 4.: .06, 9.: .10}),
    (make(1500., step_delta=500., step_height=5.), {0.: 1500., 4.9: 1500., 5.: 2000.,
                                                    17.: 3000.}),
    (make(10., -1., skip=3.), {0.: 10., 3.: 10., 5.: 8.}),
    (make(0., 1., band=2., skip=1.), {.5: 1., 2.9: 1., 3.: 3.})])
def test_values(tower, values):
    for z, value in values.items():
        assert tower.calc_value(z) == pytest.approx(value)


def advance(it):
    it.toolhead.wait_moves()
    return it.get("extruder")["pressure_advance"]


def test_follows_the_height_of_what_is_laid_down(run):
    def body(it):
        it.send(START + "TUNING_TOWER COMMAND=SET_PRESSURE_ADVANCE PARAMETER=ADVANCE"
                " START=0.02 FACTOR=0.01")
        assert "// Starting tuning test (start=0.020000 factor=0.010000)" in it.output
        it.send("G1 Z5\nG1 E1\nG1 X60")        # no filament along a way
        assert advance(it) == 0.
        it.send("G1 X70 E0.2")
        assert advance(it) == pytest.approx(0.07)
        it.send("G1 Z3\nG1 X60 E0.2\nG1 X50 E0.2")     # not lower by much
        assert advance(it) == pytest.approx(0.05)
        it.send("SET_GCODE_OFFSET Z=1\nG1 X55 Z3 E0.2")
        assert advance(it) == pytest.approx(0.05)
        assert motion_machine.filament(it) == pytest.approx(1.8, abs=0.006)
        assert max(it.get_error()) < 0.0063
    run(body)


def test_ends_with_the_next_print(run):
    def body(it):
        tower = it.printer.lookup_object("tuning_tower")
        it.send(START + "TUNING_TOWER COMMAND=M204 PARAMETER=S START=1000"
                " STEP_DELTA=100 STEP_HEIGHT=1\nG1 Z4.5\nG1 X60 E0.2")
        assert it.toolhead.max_accel == 1400. and tower.is_active()
        it.send("G1 Z2\nG1 X50 E0.2\nG1 Z6\nG1 X60 E0.2")
        assert it.toolhead.max_accel == 1400. and not tower.is_active()
        assert "// Ending tuning test mode" in it.output
        assert max(it.get_error()) < 0.0063
        target = it.printer.lookup_object("gcode_move").move_with_transform
        assert target == it.toolhead.move
    run(body)


def test_a_new_tower_takes_the_place_of_the_old(run):
    def body(it):
        for factor in ("0.01", "0.02"):
            it.send("TUNING_TOWER COMMAND='SET_PRESSURE_ADVANCE EXTRUDER=extruder'"
                    " PARAMETER=ADVANCE FACTOR=%s BAND=2" % (factor,))
        it.send(START + "G1 Z2.5\nG1 X60 E0.2")
        assert advance(it) == pytest.approx(0.06)
    run(body)


def test_errors_of_the_command_stop_the_move(run):
    def body(it):
        it.send(START + "TUNING_TOWER COMMAND=SET_PRESSURE_ADVANCE PARAMETER=ADVANCE"
                " START=-1\n")
        where = it.toolhead.get_position()
        with pytest.raises(CommandError, match="ADVANCE"):
            it.send("G1 X60 E0.2")
        assert it.toolhead.get_position() == where
    run(body)


@pytest.mark.parametrize("options, message", [
    ("FACTOR=1 STEP_DELTA=1 STEP_HEIGHT=1", "both FACTOR"),
    ("STEP_DELTA=1", "both STEP"), ("STEP_HEIGHT=1", "both STEP"),
    ("BAND=-1", "BAND"), ("SKIP=-1", "SKIP")])
def test_wrong_parameters(run, options, message):
    def body(it):
        with pytest.raises(CommandError, match=message):
            it.send("TUNING_TOWER COMMAND=M204 PARAMETER=S " + options)
        assert not it.printer.lookup_object("tuning_tower").is_active()
    run(body)


class Lift:
    """A transform that takes its place before the tower."""
    def __init__(self, gcode_move):
        self.next = gcode_move.set_move_transform(self, force=True)

    def get_position(self):
        position = list(self.next.get_position())
        position[2] -= 1.
        return position

    def move(self, newpos, speed):
        self.next.move([*newpos[:2], newpos[2] + 1., *newpos[3:]], speed)


def test_transforms_that_came_later_stay(run):
    def body(it):
        start = ("TUNING_TOWER COMMAND=SET_PRESSURE_ADVANCE PARAMETER=ADVANCE"
                 " FACTOR=0.01")
        it.send(START + start)
        Lift(it.printer.lookup_object("gcode_move"))
        it.send("G91\nG90\nG1 Z6\nG1 X60 E0.2")
        assert advance(it) == pytest.approx(0.06)
        it.send("G1 Z2\nG1 X50 E0.2\nG1 Z9\nG1 X60 E0.2")
        assert "// Ending tuning test mode" in it.output
        assert advance(it) == pytest.approx(0.06)
        assert it.toolhead.get_position()[2] == 10.
        it.send(start + "\nG1 X50 E0.2")
        assert advance(it) == pytest.approx(0.09)
    run(body)
