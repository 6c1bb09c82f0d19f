# SPDX-License-Identifier: GPL-3.0-or-later
import pytest
from coordinates import ExtraAxis, ListToolhead, NotingToolhead, make_printer
from hypothesis import given, settings
from hypothesis import strategies as st

from klippy.errors import CommandError, ConfigError


@pytest.fixture(params=[NotingToolhead, ListToolhead], ids=["plain", "list"])
def printer(request):
    made = make_printer(toolhead=request.param())
    yield made
    made.close()


def run(printer, script):
    """Run a script; returns the moves it made."""
    before = len(printer.toolhead.moves)
    printer.gcode.run_script(script)
    return printer.toolhead.moves[before:]


def ends(printer, script):
    """Where the moves of a script end."""
    return [move[:4] for move in run(printer, script)]


def status(printer):
    return printer.gcode_move.get_status(0.)


def test_plain_lines_take_the_short_way_and_others_the_general():
    printer = make_printer()
    run(printer, "G1 X1 Y2 Z3 E4 F600\nG0 X2 E5\nG1 X3 (a comment)")
    assert printer.toolhead.moves == [
        (1., 2., 3., 4., 10.), (2., 2., 3., 5., 10.), (3., 2., 3., 5., 10.)]
    assert printer.toolhead.ways == ["plain"] * 3
    printer.close()
    printer = make_printer(toolhead=ListToolhead())
    run(printer, "G1 X1 Y2 Z3 E4 F600")
    assert printer.toolhead.ways == ["list"]
    printer.close()


def test_short_way_only_while_nothing_is_in_between():
    printer = make_printer()
    head, gcode_move = printer.toolhead, printer.gcode_move
    seen = []
    plain_move = gcode_move.move_with_transform
    gcode_move.move_with_transform = lambda pos, speed: seen.append(pos)
    run(printer, "G1 X1")
    assert seen == [[1., 0., 0., 0.]] and not head.moves
    gcode_move.move_with_transform = plain_move
    run(printer, "G1 X2")
    assert head.ways == ["plain"]
    head.move = lambda pos, speed: seen.append(pos)
    gcode_move.move_with_transform = head.move
    run(printer, "G1 X3")
    assert seen[-1] == [3., 0., 0., 0.] and head.ways == ["plain"]
    printer.close()


def test_absolute_and_relative(printer):
    assert ends(printer, "G1 X10 E1\nG91\nG1 X5 E1\nG90\nM83\nG1 X1 E1\n"
                         "M82\nG1 E1") == [
        (10., 0., 0., 1.), (15., 0., 0., 2.), (1., 0., 0., 3.), (1., 0., 0., 1.)]
    # G91 makes e relative whatever M82 says
    assert ends(printer, "M82\nG91\nG1 E2\nG1 E2") == [(1., 0., 0., 3.),
                                                       (1., 0., 0., 5.)]
    assert status(printer)["absolute_extrude"]
    assert not status(printer)["absolute_coordinates"]


def test_g92_and_both_ways_of_positions(printer):
    run(printer, "G1 X10 Y20 Z5 E3\nG92 X0 E1")
    assert status(printer)["gcode_position"] == (0., 20., 5., 1.)
    assert status(printer)["position"] == (10., 20., 5., 3.)
    assert ends(printer, "G1 X1 E2") == [(11., 20., 5., 4.)]
    run(printer, "G92")
    assert status(printer)["gcode_position"] == (0., 0., 0., 0.)
    assert ends(printer, "G1 X1 Y1 Z1 E1") == [(12., 21., 6., 5.)]


def test_factors(printer):
    run(printer, "G1 X1 F6000\nM220 S50")
    assert status(printer)["speed_factor"] == 0.5
    assert status(printer)["speed"] == pytest.approx(6000.)
    assert run(printer, "G1 X2\nG1 X3 F1200") == [
        (2., 0., 0., 0., pytest.approx(50.)), (3., 0., 0., 0., pytest.approx(10.))]
    run(printer, "M220")
    assert printer.gcode_move.speed == pytest.approx(20.)
    # e of the G-code goes on from where it is
    run(printer, "G1 E10\nM221 S50")
    assert status(printer)["gcode_position"].e == 10.
    assert ends(printer, "G1 E12\nM83\nG1 E2")[-1] == (3., 0., 0., 12.)
    for script in ("M220 S0", "M221 S-1", "M220 Snan", "M221 S", "M220 S1e400"):
        with pytest.raises(CommandError):
            run(printer, script)
    assert status(printer)["extrude_factor"] == 0.5


def test_g92_of_e_counts_with_the_factor(printer):
    run(printer, "G1 E10\nM221 S200\nG92 E3")
    assert status(printer)["gcode_position"].e == 3.
    assert ends(printer, "G1 E4") == [(0., 0., 0., 12.)]


@pytest.mark.parametrize("line, words", [
    ("G1 X1 Yabc", "Y="), ("G1 Xnan", "X="), ("G1 X1 Yinf", "Y="),
    ("G1 X1e400", "exponent"), ("G1 X" + "9" * 400, "X="), ("G1 X1 Y", "Y="),
    ("G1 X1 F0", "Invalid speed"), ("G1 X1 F-5", "F is -5"), ("G1 X1 F", "F="),
    ("G1 X1 F0 (text)", "Invalid speed"), ("G1 X--1", "X=")])
def test_bad_words_make_no_move_and_change_nothing(printer, line, words):
    run(printer, "G1 X2 E1 F600")
    before = status(printer)
    with pytest.raises(CommandError) as caught:
        run(printer, line)
    assert words in str(caught.value)
    assert line[:10] in str(caught.value)
    assert status(printer) == before
    assert len(printer.toolhead.moves) == 1


def test_refused_move_leaves_the_position_where_it_is(printer):
    run(printer, "G1 X2 E1")
    for line in ("G1 X1001 E5", "G1 X1001 E5 (general)"):
        with pytest.raises(CommandError):
            printer.gcode.run_script_from_command(line)
        assert status(printer)["position"] == (2., 0., 0., 1.)


def test_line_with_only_a_speed_moves_nothing(printer):
    assert run(printer, "G1 F1200\nG1\nG0 F1200 (text)") == []
    assert printer.gcode_move.speed == pytest.approx(20.)


def test_inches_are_refused(printer):
    run(printer, "G21")
    with pytest.raises(CommandError, match="G20"):
        run(printer, "G20")


def test_offsets(printer):
    assert ends(printer, "G1 X5\nSET_GCODE_OFFSET X=1 Z=0.5\nG1 X5") == [
        (5., 0., 0., 0.), (6., 0., 0., 0.)]
    assert ends(printer, "SET_GCODE_OFFSET Z_ADJUST=0.1 MOVE=1 MOVE_SPEED=3") == [
        (6., 0., pytest.approx(0.1), 0.)]
    assert printer.toolhead.moves[-1][4] == 3.
    assert status(printer)["homing_origin"] == (1., 0., pytest.approx(0.6), 0.)
    assert ends(printer, "G1 Z1") == [(6., 0., pytest.approx(1.6), 0.)]
    # the offset itself is taken, not what rounding makes of sums
    run(printer, "SET_GCODE_OFFSET X=0.3 Y=0 Z=0 E=2")
    assert status(printer)["homing_origin"] == (0.3, 0., 0., 2.)
    with pytest.raises(CommandError):
        run(printer, "SET_GCODE_OFFSET X=1 MOVE=1 MOVE_SPEED=0")
    assert status(printer)["homing_origin"].x == 0.3


def test_homing_brings_the_offset_back_to_the_coordinates(printer):
    run(printer, "SET_GCODE_OFFSET Z=2\nG1 X5 Z5\nG92 X0 Z0")
    state = type("State", (), {"get_axes": lambda self: [2]})()
    printer.toolhead.position[2] = 0.
    printer.send_event("homing:home_rails_end", state, [])
    assert ends(printer, "G1 Z1") == [(5., 0., 3., 0.)]
    assert status(printer)["gcode_position"].x == 0.


def test_saved_states(printer):
    run(printer, "G1 X5 Y5 E10 F600\nSAVE_GCODE_STATE NAME=a\n"
                 "G91\nM83\nM220 S50\nM221 S80\nG1 X3 E5 F1200\nG92 X0\n"
                 "SET_GCODE_OFFSET Z=1")
    assert ends(printer, "RESTORE_GCODE_STATE NAME=a MOVE=1 MOVE_SPEED=7") == [
        (5., 5., 0., 14.)]
    assert printer.toolhead.moves[-1][4] == 7.
    now = status(printer)
    assert now["absolute_coordinates"] and now["absolute_extrude"]
    assert (now["speed_factor"], now["extrude_factor"]) == (1., 1.)
    assert now["homing_origin"] == (0., 0., 0., 0.)
    # e of the G-code is what it was, whatever was extruded since
    assert now["gcode_position"] == (5., 5., 0., 10.)
    assert printer.gcode_move.speed == 10.
    with pytest.raises(CommandError, match="'b'.*known: a"):
        run(printer, "RESTORE_GCODE_STATE NAME=b")
    run(printer, "SAVE_GCODE_STATE\nRESTORE_GCODE_STATE MOVE=1")
    assert set(printer.gcode_move.saved_states) == {"a", "default"}


def test_saved_state_is_a_copy(printer):
    run(printer, "SAVE_GCODE_STATE\nG1 X7\nSET_GCODE_OFFSET X=1")
    state = printer.gcode_move.saved_states["default"]
    assert state["last_position"] == state["base_position"] == [0.] * 4


class Shift:
    """A transform that puts z by 10 higher."""

    def __init__(self):
        self.next = None

    def get_position(self):
        x, y, z, e = self.next.get_position()
        return [x, y, z - 10., e]

    def move(self, newpos, speed):
        x, y, z, e = newpos
        self.next.move([x, y, z + 10., e], speed)


def test_transforms():
    printer = make_printer(toolhead=ListToolhead())
    gcode_move, shift = printer.gcode_move, Shift()
    shift.next = gcode_move.set_move_transform(shift)
    assert shift.next is printer.toolhead
    with pytest.raises(ConfigError):
        gcode_move.set_move_transform(Shift())
    second = Shift()
    second.next = gcode_move.set_move_transform(second, force=True)
    assert second.next is shift
    gcode_move.reset_last_position()
    assert status(printer)["position"].z == -20.
    assert ends(printer, "G1 X1 Z0") == [(1., 0., 20., 0.)]
    # a transform gets a list of its own
    kept = []
    second.move = lambda newpos, speed: kept.append(newpos)
    gcode_move.set_move_transform(second, force=True)
    run(printer, "G1 X2\nG1 X3")
    assert [pos[0] for pos in kept] == [2., 3.]
    assert gcode_move.set_move_transform(printer.toolhead, force=True) is second
    printer.close()


def test_transform_taken_away_opens_the_short_way_again():
    printer = make_printer()
    shift, gcode_move = Shift(), printer.gcode_move
    head = gcode_move.set_move_transform(shift, force=True)
    gcode_move.set_move_transform(head, force=True)
    run(printer, "G1 X1")
    assert printer.toolhead.ways == ["plain"]
    printer.close()


def test_position_is_read_again_after_events(printer):
    for event in ("toolhead:set_position", "toolhead:manual_move",
                  "gcode:command_error"):
        printer.toolhead.position[0] += 1.
        printer.send_event(event)
        assert status(printer)["position"].x == printer.toolhead.position[0]
    run(printer, "M221 S50\nG1 E10")
    printer.toolhead.position[3] = 77.
    printer.send_event("extruder:activate_extruder")
    assert status(printer)["extrude_factor"] == 1.
    assert status(printer)["gcode_position"].e == 0.
    assert status(printer)["position"].e == 77.


def test_further_axes():
    printer = make_printer(toolhead=ListToolhead())
    head = printer.toolhead
    head.axes = [ExtraAxis("A"), ExtraAxis("E"), ExtraAxis("F"), ExtraAxis(None)]
    head.position += [1., 2., 3., 4.]
    printer.send_event("toolhead:update_extra_axes")
    assert status(printer)["axis_map"] == {"X": 0, "Y": 1, "Z": 2, "E": 3, "A": 4}
    run(printer, "G1 A5 X1\nG1 Y3\nG92 A0\nG1 A1")
    assert head.moves[-1][:8] == (1., 3., 0., 0., 6., 2., 3., 4.)
    assert status(printer)["gcode_position"][4] == 1.
    with pytest.raises(CommandError, match="A="):
        run(printer, "G1 Anan")
    run(printer, "SAVE_GCODE_STATE")
    head.axes, head.position = [], head.position[:4]
    printer.send_event("toolhead:update_extra_axes")
    assert "A" not in status(printer)["axis_map"]
    assert len(status(printer)["position"]) == 4
    run(printer, "RESTORE_GCODE_STATE MOVE=1\nG1 X9 A100")
    assert head.moves[-1][:4] == (9., 3., 0., 0.)
    printer.close()


def test_plain_lines_name_no_further_axes_but_keep_them():
    printer = make_printer()
    head, seen = printer.toolhead, []
    head.axes, head.position = [ExtraAxis("A")], [0.] * 4 + [7.]
    printer.send_event("toolhead:update_extra_axes")
    printer.gcode_move.move_with_transform = lambda pos, speed: seen.append(pos)
    run(printer, "G1 X1")
    assert seen == [[1., 0., 0., 0., 7.]]
    printer.close()


def test_m114_and_fields_of_plug_ins(printer):
    gcode_move = printer.gcode_move
    run(printer, "G1 X1.5 E2\nM114")
    assert printer.output == ["X:1.500 Y:0.000 Z:0.000 E:2.000"]
    gcode_move.base_position[0] += 3.
    gcode_move.last_position[1] = 4.
    gcode_move.homing_position = [1., 2., 3., 0.]
    gcode_move.speed, gcode_move.speed_factor = 5., 1. / 120.
    gcode_move.absolute_coord = False
    assert run(printer, "G1 X1") == [(2.5, 4., 0., 2., 5.)]
    assert status(printer)["speed_factor"] == 0.5
    assert gcode_move.position_with_transform() == [2.5, 4., 0., 2.]
    gcode_move.any_attribute = 1


def test_too_short_a_list_is_an_error_and_no_crash(printer):
    printer.gcode_move.base_position = [0.]
    with pytest.raises(CommandError, match="IndexError"):
        run(printer, "G1 Y1")


def test_commands_made_by_plug_ins_may_hold_numbers(printer):
    gcmd = printer.gcode.create_gcode_command("G1", "G1", {"X": 1.5, "E": 2, "F": 600})
    printer.gcode_move.cmd_G1(gcmd)
    assert printer.toolhead.moves == [(1.5, 0., 0., 2., 10.)]
    gcmd = printer.gcode.create_gcode_command("G1", "G1", {"X": float("nan")})
    with pytest.raises(CommandError):
        printer.gcode_move.cmd_G1(gcmd)


def test_not_ready():
    printer = make_printer()
    printer.invoke_shutdown("test")
    run(printer, "M114")
    printer.gcode_move.reset_last_position()
    assert printer.output[-1].startswith("X:0.000")
    printer.close()


numbers = st.decimals(-900, 900, places=3).map(str)
words = st.lists(st.tuples(st.sampled_from("XYZE"), numbers), min_size=1,
                 max_size=4, unique_by=lambda pair: pair[0])
lines = st.one_of(
    words.map(lambda found: "G1 " + " ".join(a + b for a, b in found)),
    st.sampled_from(["G90", "G91", "M82", "M83", "G92 E0", "G92 X5", "M221 S90",
                     "M220 S200", "G1 F300", "SET_GCODE_OFFSET Z_ADJUST=0.1"]))


@settings(max_examples=100, deadline=None)
@given(st.lists(lines, max_size=20))
def test_both_ways_give_the_same_moves(script):
    results = []
    for comment in ("", " (general)"):
        printer = make_printer()
        printer.toolhead.note = lambda pos, speed, head=printer.toolhead: (
            head.moves.append((*pos, speed)))
        for line in script:
            suffix = comment if line.startswith("G1") else ""
            printer.gcode.run_script(line + suffix)
        results.append(printer.toolhead.moves)
        printer.close()
    assert results[0] == results[1]
