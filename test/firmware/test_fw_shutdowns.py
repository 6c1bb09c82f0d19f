# SPDX-License-Identifier: GPL-3.0-or-later
"""Every reason for a shutdown that src/ has: how it comes, and what follows.

The table is shutdown_cases.py.  A text that src/ has and the table lacks fails
here, as does one of the table that is gone.
"""

import json
import pathlib
import re

import pytest
from shutdown_cases import CASES, ELSEWHERE, NO_CASE
from simboard import ROOT, SimBoard, encode_int, frame

USE = re.compile(r'\b(?:shutdown|DECL_STRING_ID)\(\s*((?:"[^"]*"\s*)+)\)'
                 r'|\btry_shutdown\(\s*("[^"]*")\)')
KNOWN = json.loads((ROOT / "test/data/shutdown_texts.json").read_text())
LED, PULL_DOWN = 200, 201  # outputs that show what a shutdown does


def list_uses():
    """(file, text) of every shutdown in the sources."""
    uses = []
    for path in sorted((ROOT / "src").rglob("*.[ch]")):
        for match in USE.finditer(path.read_text()):
            text = "".join(re.findall(r'"([^"]*)"', match.group()))
            uses.append((str(path.relative_to(ROOT)), text))
    return uses


def parse_value(text, clock):
    if text.startswith("hex:"):
        return bytes.fromhex(text[4:])
    if text.startswith("@"):
        return (clock + int(text[1:])) % 2**32
    return int(text)


def run_step(board, line):
    name, *words = line.split()
    values = dict(word.split("=", 1) for word in words if "=" in word)
    if name == "wait":
        board.run_for(float(words[0]))
    elif name == "raw":
        board.send_block(bytes.fromhex(words[0][4:]))
    elif name == "after":
        board.send_block(encode_int(board.commands[words[0]].msg_id)
                         + bytes.fromhex(words[1][4:]))
    elif name == "fill_arena":
        fill_arena(board)
    else:
        form = board.commands[name]
        values = {key: parse_value(value, board.clock)
                  for key, value in values.items()}
        empty = {key: b"" if kind.endswith("s") else 0
                 for key, kind in form.params}
        assert set(values) <= set(empty), line
        board.send(name, **{**empty, **values})


def allocate(board, *sizes):
    """An object of a known size and so many bytes more, for each."""
    run_step(board, "allocate_oids count=20")
    for oid, size in enumerate(sizes):
        run_step(board, "config_neopixel oid=%d data_size=%d" % (oid, size))


def count_free(board, *sizes):
    """Bytes that are left; the board starts anew."""
    allocate(board, *sizes)
    run_step(board, "finalize_config crc=1")
    count = board.query("get_config", "config")["move_count"]
    board.power_on(board.clock)
    return count * 8


def fill_arena(board):
    """Leave nothing of the memory."""
    head = count_free(board) - count_free(board, 8) - 8
    left = count_free(board, 32000, 32000, 32000)
    assert left < 2 * 32000
    allocate(board, 32000, 32000, 32000, 8000, left - 8000 - 2 * head)


@pytest.fixture
def new_board(simulator_so):
    """As `board`, but timers may be late."""
    board = SimBoard(simulator_so)
    board.identify()
    return board


@pytest.mark.parametrize("text, script", [
    pytest.param(text, script, id="%s-%d" % (text, i))
    for text, scripts in CASES.items() for i, script in enumerate(scripts)])
def test_what_shuts_down(new_board, text, script):
    board = new_board
    *steps, last = script.strip().split("\n")
    for step in steps:
        run_step(board, step)
        if text != "Move queue overflow":
            assert board.find_shutdown() is None, step
    run_step(board, last)
    assert board.find_shutdown() == text
    assert len(board.list_messages("shutdown")) == 1
    check_what_follows(board)


def check_what_follows(board):
    """Only what is safe is still done, until the host clears it."""
    reason = board.list_messages("shutdown")[0]["static_string_id"]
    n_edges, n = len(board.edges), len(board.messages)
    board.send("set_digital_out", pin=LED, value=1)
    assert [(m["#name"], m["static_string_id"]) for m in board.messages[n:]] == [
        ("is_shutdown", reason)]
    board.run_for(.5)
    assert board.edges[n_edges:] == []
    assert board.query("get_config", "config")["is_shutdown"] == 1
    board.send("clear_shutdown")
    board.send("set_digital_out", pin=LED, value=1)
    assert board.list_edges(LED)[-1:] == [(board.clock, 1)]


def test_every_text_has_a_case_or_a_reason():
    texts = {text for _, text in list_uses()}
    table = [*CASES, *ELSEWHERE, *NO_CASE]
    assert len(texts) > 70 and len(table) == len(set(table))
    assert sorted(texts - set(table)) == [], "shutdowns without a case"
    assert sorted(set(table) - texts) == [], "cases of no shutdown"


@pytest.mark.parametrize("text, place", ELSEWHERE.items())
def test_cases_elsewhere_are_there(text, place):
    path, _, name = place.partition("::")
    assert (name or text) in (ROOT / path).read_text()


def test_ports_shut_down_as_their_contract_says():
    """A port has no texts of its own beside those of src/board and the table. One
    that takes commands apart itself says what src/command.c and src/core say."""
    contract = {text for path, text in list_uses()
                if path.startswith(("src/board/", "src/core/", "src/command.c"))}
    own = {*ELSEWHERE, *NO_CASE}
    core = {"src", "src/core", "src/motion", "src/io", "src/bus", "src/sensors",
            "src/display", "src/board", "src/generic"}
    stray = [(path, text) for path, text in list_uses()
             if str(pathlib.PurePath(path).parent) not in core
             and text not in contract | own]
    assert stray == []


def test_texts_are_those_that_hosts_know():
    """A text that is not in the list needs a remedy in our documentation."""
    docs = "".join(path.read_text() for path in (ROOT / "docs").rglob("*.md"))
    texts = {text for _, text in list_uses()}
    assert len(KNOWN) > 100
    assert sorted(text for text in texts - set(KNOWN) if text not in docs) == []


@pytest.mark.parametrize("name, spoil", [
    ("checksum", lambda b: b[:-3] + bytes([b[-3] ^ 1]) + b[-2:]),
    ("low byte of the checksum", lambda b: b[:-2] + bytes([b[-2] ^ 1]) + b[-1:]),
    ("content", lambda b: b[:2] + bytes([b[2] ^ 0x40]) + b[3:]),
    ("sequence ahead", lambda b: reframe(b, 1)),
    ("sequence far ahead", lambda b: reframe(b, 8)),
    ("sequence repeated", lambda b: reframe(b, -1)),
    ("destination", lambda b: b[:1] + bytes([b[1] ^ 0x20]) + b[2:]),
    ("high bit of the sequence", lambda b: b[:1] + bytes([b[1] | 0x80]) + b[2:]),
    ("length below the least", lambda b: b"\x04" + b[1:]),
    ("length above the most", lambda b: b"\x41" + b[1:]),
    ("longest length", lambda b: b"\xff" + b[1:]),
    ("length of zero", lambda b: b"\0" + b[1:]),
    ("no end", lambda b: b[:-1] + b"\0" + b"\x7e"),
    ("one byte less", lambda b: b[:3] + b[4:] + b"\x7e"),
    ("one byte more", lambda b: b[:3] + b"\0" + b[3:]),
    ("oversize", lambda b: bytes([80]) + b[1:2] + bytes(75) + b"\0\0\x7e"),
])
def test_what_is_refused(board, name, spoil):
    """The answer is the number of the block that is expected: nothing runs."""
    command = board.commands["set_digital_out"].encode(dict(pin=LED, value=1))
    good = make_block(board, command)
    n_blocks, n_messages = len(board.blocks), len(board.messages)
    board.send_raw(spoil(good))
    answers = [block for _, block in board.blocks[n_blocks:]]
    assert answers and all(len(block) == 5 for block in answers)
    assert {block[1] & 15 for block in answers} == {board.seq & 15}
    assert board.messages[n_messages:] == [] and board.list_edges(LED) == []
    board.send_raw(good)
    board.seq += 1
    assert board.list_edges(LED) == [(board.clock, 1)]
    assert board.blocks[-1][1][1] & 15 == board.seq & 15
    assert board.find_shutdown() is None


def make_block(board, payload):
    return frame(board.seq, payload)


def reframe(block, ahead):
    return frame(block[1] + ahead, block[2:-3])
