# SPDX-License-Identifier: GPL-3.0-or-later
"""MoveScan against a slow model made of a regular expression and float()."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from klippy_ext.gscan import MoveScan

WORD = re.compile(r"[ \t\r]*([XYZEFxyzef])[ \t\r]*([-+]?(?:\d+\.?\d*|\.\d+))")
HEAD = re.compile(r"[ \t\r]*(?:[Nn]\d+[ \t\r]*)?[Gg]0*[01](?![\d.])")


def model(line):
    """{letter: value} of a plain move, None for anything else."""
    match = HEAD.match(line)
    if match is None:
        return None
    words, pos = {}, match.end()
    while True:
        match = WORD.match(line, pos)
        if match is None:
            break
        letter = match.group(1).upper()
        if letter in words:
            return None
        words[letter], pos = float(match.group(2)), match.end()
        following = line[pos:pos + 1]
        if following in ("e", "E") and (following.islower()
                                        != match.group(1).islower()):
            return None
    rest = line[pos:].lstrip(" \t\r")
    return words if rest[:1] in ("", ";", "\n") else None


def found(scan):
    values = (scan.x, scan.y, scan.z, scan.e, scan.f)
    return {letter: value for bit, letter, value
            in zip((1, 2, 4, 8, 16), "XYZEF", values, strict=True)
            if scan.mask & bit}


def checksum(text):
    total = 0
    for byte in text.encode():
        total ^= byte
    return total


@pytest.mark.parametrize("line, words", [
    ("G1 X10 Y-20.5 E.3 F3000 ; fast", {"X": 10., "Y": -20.5, "E": .3, "F": 3000.}),
    ("g0z5.", {"Z": 5.}),
    ("G1X10Y20E5", {"X": 10., "Y": 20., "E": 5.}),
    ("  N12 G01 X +1\r\n", {"X": 1.}),
    ("G1", {}),
    ("G1 X-0", {"X": -0.}),
    ("g1 x1e5", {"X": 1., "E": 5.}),
])
def test_plain_move(line, words):
    scan = MoveScan()
    assert scan.scan(line)
    assert found(scan) == words == model(line)


@pytest.mark.parametrize("line", [
    "", ";", "G", "G2 X1", "G10", "G1.1 X1", "G28", "M1", "G1 X", "G1 X-", "G1 X.",
    "G1 X1 X2", "G1 X=1", "G1 A1", "G1 Xnan", "G1 Xinf", "G1 X1e400", "G1 X1 (c)",
    "G1 X'1'", "G1 X1\0", "G1 X1 é", "N G1 X1", "G1 X1 Y", "T0", "G1 X--1",
    "G1 X1234567890123456789", "G1 X0." + "0" * 30, "%", "N1", "G1 X1*", "G1 X1*z",
])
def test_anything_else_is_left_alone(line):
    scan = MoveScan()
    assert not scan.scan(line)
    assert scan.mask == 0 and not scan.matched


def test_checksum_is_validated():
    scan, text = MoveScan(), "N7 G1 X1.5 "
    assert scan.scan("%s*%d" % (text, checksum(text)))
    assert scan.scan("%s*%d ; note" % (text, checksum(text)))
    assert found(scan) == {"X": 1.5}
    assert not scan.scan("%s*%d" % (text, checksum(text) ^ 1))
    assert not scan.scan("%s*%d X2" % (text, checksum(text)))


def test_lone_surrogate_and_wrong_type():
    scan = MoveScan()
    assert not scan.scan("G1 X1 \udc80")
    for wrong in (None, b"G1 X1", 5):
        with pytest.raises(TypeError):
            scan.scan(wrong)


@settings(max_examples=2000, deadline=None)
@given(st.text(alphabet="GgNn01 XxYyZzEeFf+-.23459;*\t\r\n(=", max_size=40))
def test_agrees_with_model(line):
    scan = MoveScan()
    if "*" in line:
        scan.scan(line)
        return
    expected = model(line)
    if scan.scan(line):
        assert found(scan) == expected
    else:
        digits = re.findall(r"[\d.]+", line)
        assert expected is None or max(map(len, digits)) > 15


@settings(max_examples=2000, deadline=None)
@given(st.decimals(allow_nan=False, allow_infinity=False,
                   min_value=-10**6, max_value=10**6, places=9))
def test_numbers_are_rounded_correctly(number):
    text, scan = format(number, "f"), MoveScan()
    if scan.scan("G1 X" + text):
        assert scan.x == float(text)
    else:
        assert int(text.replace(".", "").lstrip("-")) >= 2**53


@given(st.lists(st.binary(max_size=30), max_size=8))
def test_next_line_walks_any_block(pieces):
    block, scan, pos, lines = b"\n".join(pieces), MoveScan(), 0, []
    while True:
        end = scan.next_line(block, pos)
        if end < 0:
            break
        lines.append(block[pos:end])
        matched = scan.matched
        assert matched == MoveScan().scan(block[pos:end].decode("latin-1"))
        pos = end
    assert b"".join(lines) + block[pos:] == block
    assert len(lines) == block.count(b"\n")


def test_next_line_refuses_positions_outside():
    scan = MoveScan()
    assert scan.next_line(b"", 0) == -1
    for pos in (-1, 4):
        with pytest.raises(ValueError, match="position %d" % pos):
            scan.next_line(b"G1\n", pos)
