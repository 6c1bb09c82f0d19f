# SPDX-License-Identifier: GPL-3.0-or-later
import motion_machine
import pytest
from motion_machine import filament

from klippy.errors import CommandError

CONFIG = """
[firmware_retraction]
retract_length: 2
retract_speed: 40
unretract_extra_length: 0.1
unretract_speed: 20
"""
START = "G28\nG90\nM83\nG1 X50 Y50 Z5 F6000\n"


@pytest.fixture
def run(tmp_path, monkeypatch):
    return motion_machine.make_run(tmp_path, monkeypatch)


def test_back_and_forth_once_each(run):
    def body(it):
        it.send(START)
        where = it.toolhead.get_position()[:3]
        it.send("G11")
        assert filament(it) == 0.
        it.send("G10\nG10")
        assert filament(it) == pytest.approx(-2., abs=0.006)
        it.send("G11\nG11")
        assert filament(it) == pytest.approx(0.1, abs=0.006)
        assert it.toolhead.get_position()[:3] == where
    run(body, CONFIG)


def test_hidden_from_the_coordinates(run):
    def body(it):
        it.send(START + "M82\nG92 E7\nG10\nG1 X60")
        assert it.get("gcode_move")["gcode_position"].e == pytest.approx(7.)
        it.send("G11\nG1 X50 E8")
        assert filament(it) == pytest.approx(1.1, abs=0.006)
        assert it.get("gcode_move")["gcode_position"].e == pytest.approx(8.)
    run(body, CONFIG)


def test_speeds(run):
    def body(it):
        it.send(START)
        for line, way, speed in (("G10", 2., 40.), ("G11", 2.1, 20.),
                                 ("M220 S50\nG10", 2., 20.)):
            begin = it.toolhead.get_last_move_time()
            it.send(line)
            spent = it.toolhead.get_last_move_time() - begin
            accel = it.printer.lookup_object("extruder").max_e_accel
            assert spent == pytest.approx(way / speed + speed / accel, rel=1e-3)
    run(body, CONFIG)


def test_what_was_taken_is_given_back(run):
    def body(it):
        it.send(START + "G10\nSET_RETRACTION RETRACT_LENGTH=5"
                " UNRETRACT_EXTRA_LENGTH=0\nM221 S50\nG11")
        assert filament(it) == pytest.approx(0., abs=0.006)
        it.send("G10")
        assert filament(it) == pytest.approx(-5., abs=0.006)
    run(body, CONFIG)


def test_settings(run):
    def body(it):
        usual = {"retract_length": 0., "retract_speed": 20.,
                 "unretract_extra_length": 0., "unretract_speed": 10.}
        assert it.get("firmware_retraction") == usual
        it.send("SET_RETRACTION RETRACT_LENGTH=1.5 UNRETRACT_SPEED=30")
        new = dict(usual, retract_length=1.5, unretract_speed=30.)
        assert it.get("firmware_retraction") == new
        it.send("GET_RETRACTION")
        assert ("// RETRACT_LENGTH=1.50000 RETRACT_SPEED=20.00000"
                " UNRETRACT_EXTRA_LENGTH=0.00000 UNRETRACT_SPEED=30.00000"
                in it.output)
        for wrong in ("RETRACT_LENGTH=-1", "RETRACT_SPEED=0.5", "UNRETRACT_SPEED=x"):
            with pytest.raises(CommandError):
                it.send("SET_RETRACTION " + wrong)
        assert it.get("firmware_retraction") == new
    run(body, "[firmware_retraction]\n")


def test_a_refused_move_changes_nothing(run):
    def body(it):
        it.send(START + "SET_RETRACTION RETRACT_LENGTH=60")
        with pytest.raises(CommandError, match="too long"):
            it.send("G10")
        before = it.get("gcode_move")
        it.send("G11\nSET_RETRACTION RETRACT_LENGTH=1\nG10")
        assert filament(it) == pytest.approx(-1., abs=0.006)
        assert it.get("gcode_move")["gcode_position"] == before["gcode_position"]
    run(body, CONFIG)
