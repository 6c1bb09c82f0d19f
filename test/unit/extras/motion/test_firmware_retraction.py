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
                 "unretract_extra_length": 0., "unretract_speed": 10.,
                 "z_hop_height": 0., "unretract_length": 0., "retract_state": False,
                 "zhop_state": False}
        assert it.get("firmware_retraction") == usual
        it.send("SET_RETRACTION RETRACT_LENGTH=1.5 UNRETRACT_SPEED=30")
        new = dict(usual, retract_length=1.5, unretract_speed=30.,
                   unretract_length=1.5)
        assert it.get("firmware_retraction") == new
        it.send("GET_RETRACTION")
        assert ("// RETRACT_LENGTH=1.50000 RETRACT_SPEED=20.00000"
                " UNRETRACT_EXTRA_LENGTH=0.00000 UNRETRACT_SPEED=30.00000"
                in it.output)
        for wrong in ("RETRACT_LENGTH=-1", "RETRACT_SPEED=0.5", "UNRETRACT_SPEED=x"):
            with pytest.raises(CommandError):
                it.send("SET_RETRACTION " + wrong)
        assert it.get("firmware_retraction") == new
        it.send("RESET_RETRACTION")
        assert it.get("firmware_retraction") == usual
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


def height(it):
    assert max(it.get_error()) < 0.0063
    return pytest.approx(it.machine.calc_position()[2], abs=0.003)


def z_of_gcode(it):
    return it.get("gcode_move")["gcode_position"].z


def test_lift(run):
    def body(it):
        it.send(START + "G10\nG10")
        assert height(it) == 5.6 and z_of_gcode(it) == pytest.approx(5.)
        assert it.get("firmware_retraction")["zhop_state"]
        it.send("G1 X60\nG91\nG1 Z1\nG90")
        assert height(it) == 6.6 and z_of_gcode(it) == pytest.approx(6.)
        it.send("SET_RETRACTION Z_HOP_HEIGHT=2\nG11\nG11")
        assert height(it) == 6. and not it.get("firmware_retraction")["zhop_state"]
        it.send("G10")
        assert height(it) == 8.
        it.send("CLEAR_RETRACTION\nG11")
        assert height(it) == 8. and z_of_gcode(it) == pytest.approx(8.)
        assert filament(it) == pytest.approx(0.1 - 2., abs=0.006)
        it.send("G10\nG1 X50 Y60\nG11")
        assert height(it) == 8. and z_of_gcode(it) == pytest.approx(8.)
    run(body, CONFIG + "z_hop_height: 0.6\n")


def test_lift_ends_with_a_z_move(run):
    def body(it):
        it.send(START + "G10\nG1 X60 Y60")
        assert height(it) == 5.6
        it.send("G1 X70 Z4")
        assert height(it) == 4.
        it.send("G11")
        assert height(it) == 4. and filament(it) == pytest.approx(0.1, abs=0.006)
    run(body, CONFIG + "z_hop_height: 0.6\nclear_zhop_on_z_moves: True\n")


def test_lift_and_homing(run):
    def body(it):
        it.send("G10\nG11\n" + START + "G10\nG28 Z\nG1 Z5")
        assert height(it) == 5. and z_of_gcode(it) == pytest.approx(5.)
        it.send("G11\nG10\nM84\nG11\nG28\nG1 Z3")
        assert height(it) == 3.
        it.send("G1 Z199.9")
        with pytest.raises(CommandError, match="out of range"):
            it.send("G10")
        assert height(it) == 199.9
        it.send("G1 Z10\nG11")
        assert height(it) == 10.
    run(body, CONFIG + "z_hop_height: 0.6\n")
