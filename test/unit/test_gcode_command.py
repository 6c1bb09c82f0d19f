# SPDX-License-Identifier: GPL-3.0-or-later
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from klippy.errors import CommandError
from klippy.gcode_command import (
    Coord,
    GCodeCommand,
    is_classic,
    parse_classic,
    parse_extended,
)


class Output:
    def respond_info(self, msg, log=True):
        pass

    def respond_raw(self, msg):
        self.last = msg


def make(line, name=None):
    return GCodeCommand(Output(), name or line.split()[0].upper(), line)


def test_coord_is_a_tuple_with_named_axes():
    pos = Coord(1., 2., 3., 4.)
    assert pos == (1., 2., 3., 4.) and (pos.x, pos.y, pos.z, pos.e) == pos
    assert Coord([1., 2., 3., 4., 5.])[4] == 5.
    assert Coord(x=1., e=2.) == (1., None, None, 2.)
    assert pickle.loads(pickle.dumps(pos)) == pos
    with pytest.raises(AttributeError):
        pos.x = 5.
    with pytest.raises(TypeError, match="axis w"):
        Coord(w=1)


@pytest.mark.parametrize("name, expected", [
    ("G1", True), ("m204", True), ("G28.1", True), ("T0", True), ("PAUSE", False),
    ("G", False), ("G1_FAST", False), ("_A1", False)])
def test_is_classic(name, expected):
    assert is_classic(name) is expected


@pytest.mark.parametrize("text, params", [
    ("X10 Y-2.5", {"X": "10", "Y": "-2.5"}),
    ("X10Y20e.5", None),
    ("x1y2", {"X": "1", "Y": "2"}),
    (" X Y ; home", {"X": "", "Y": ""}),
    (" X 10 (to the left) Y 5", {"X": "10", "Y": "5"}),
    ("", {}),
])
def test_parse_classic(text, params):
    if params is None:
        with pytest.raises(CommandError, match="exponent"):
            parse_classic(text, "G1 " + text)
    else:
        assert parse_classic(text, text) == params


def test_parse_classic_tells_what_it_cannot_read():
    with pytest.raises(CommandError, match="'10 X5' is not a letter"):
        parse_classic(" 10 X5", "G1 10 X5")


@pytest.mark.parametrize("text, params", [
    ("ADVANCE=0.04; text", {"ADVANCE": "0.04"}),
    ("NAME='a b' X=1", {"NAME": "a b", "X": "1"}),
    ('MSG="say \\"hi\\"; now"', {"MSG": 'say "hi"; now'}),
    ("VALUE='\"text\"'", {"VALUE": '"text"'}),
    ("value=", {"VALUE": ""}),
    ("COLOR=#ff0000 # red", {"COLOR": "#ff0000"}),
    ("A=1 (note) B=2", {"A": "1", "B": "2"}),
    ("NAME=cube_(1) C=a\\ b", {"NAME": "cube_(1)", "C": "a b"}),
    ("POLYGON=[[1,2],[3,4]]", {"POLYGON": "[[1,2],[3,4]]"}),
    ("EXPR=a=b", {"EXPR": "a=b"}),
])
def test_parse_extended(text, params):
    assert parse_extended(text, text) == params


@pytest.mark.parametrize("text", [
    "S100", "A='b", 'A="b', "=5", "A = 5", "A='b'c d", "A=1 B"])
def test_parse_extended_malformed(text):
    with pytest.raises(CommandError, match="Malformed command"):
        parse_extended(text, text)


@given(st.text(max_size=60))
def test_parsers_raise_nothing_else(text):
    for parse in (parse_classic, parse_extended):
        try:
            params = parse(text, text)
        except CommandError:
            continue
        assert all(isinstance(value, str) for value in params.values())


@given(st.dictionaries(st.from_regex(r"[A-Z_]{1,8}", fullmatch=True),
                       st.text(max_size=20)))
def test_quoted_values_come_back(params):
    line = " ".join('%s="%s"' % (key, value.replace("\\", "\\\\").replace('"', '\\"'))
                    for key, value in params.items())
    assert parse_extended(line, line) == params


def test_numbers_are_checked():
    gcmd = make("SET A=1.5 B=7 C=nan D=1e400 E=1_0 F=x")
    assert gcmd.get_float("A") == 1.5 and gcmd.get_int("B") == 7
    assert gcmd.get("F") == "x" and gcmd.get_float("G", None) is None
    for name in "CDEF":
        with pytest.raises(CommandError, match="%s='.*finite number" % name):
            gcmd.get_float(name)
    with pytest.raises(CommandError, match="A='1.5': a whole number"):
        gcmd.get_int("A")
    with pytest.raises(CommandError, match="G is missing"):
        gcmd.get_float("G")
    assert gcmd.get("A", parser=lambda text: [text]) == ["1.5"]


@pytest.mark.parametrize("limit, ok, bad", [
    ("minval", 7, 7.1), ("maxval", 7, 6.9), ("above", 6.9, 7), ("below", 7.1, 7)])
def test_ranges(limit, ok, bad):
    gcmd = make("SET B=7")
    assert gcmd.get_float("B", **{limit: ok}) == 7.
    with pytest.raises(CommandError, match="B is 7.0, it must be"):
        gcmd.get_float("B", **{limit: bad})


@pytest.mark.parametrize("line, raw", [
    ("M117 Hello (World) ; note", "Hello (World)"),
    ("M117", ""), ("M118 Don't; x", "Don't"),
    ('RUN MSG="a;b" ; c', 'MSG="a;b"')])
def test_raw_parameters(line, raw):
    assert make(line).get_raw_command_parameters() == raw


def test_ack_only_once():
    output = Output()
    gcmd = GCodeCommand(output, "M105", "M105", {}, True)
    assert gcmd.ack("T:0") and output.last == "ok T:0"
    assert not gcmd.ack()
    assert not GCodeCommand(output, "M105", "M105", {}).ack()


def test_escapes_do_not_make_an_error_long():
    command = make("SET_PIN " + "\0" * 180)
    with pytest.raises(CommandError) as caught:
        command.get_command_parameters()
    assert len(str(caught.value)) < 1000 and "\0" not in str(caught.value)
