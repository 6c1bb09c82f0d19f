# SPDX-License-Identifier: GPL-3.0-or-later
"""The script that collects declarations: good ones, and clear errors."""

import sys

import pytest
from simboard import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
from build_commands import Collector, DeclError, Message, eval_number  # noqa: E402

IDENTIFY = ('@@DECL command @| f @| 1 @| "identify offset=%u count=%c" @@END'
            '@@DECL response @| 0 @| "identify_response offset=%u'
            ' data=%.*s" @@END')


def collect(text):
    collector = Collector()
    collector.read_source("a.c", IDENTIFY + text)
    collector.assign_ids()
    return collector


@pytest.mark.parametrize("text, value", [
    ("16000000", 16000000), ("(1<<12)-1", 4095), ("0x10UL * 2", 32),
    ("((50000000 + 7999999) / 8000000)", 7), ("('C'-'A')*32 + 3", 67)])
def test_numbers(text, value):
    assert eval_number(text) == value


def test_number_that_is_no_literal():
    with pytest.raises(DeclError, match="sizeof"):
        eval_number("sizeof(x)")


def test_reserved_numbers():
    ids = collect("").ids
    assert ids["identify offset=%u count=%c"] == 1
    assert ids["identify_response offset=%u data=%.*s"] == 0


def test_numbers_of_one_byte_are_for_what_comes_often():
    setup = ["config_part%d oid=%%c" % (i,) for i in range(100)]
    often = ["queue_step oid=%c interval=%u count=%hu add=%hi",
             "set_next_step_dir oid=%c dir=%c"]
    ids = collect("".join('@@DECL command @| f%d @| 0 @| "%s" @@END' % (i, fmt)
                          for i, fmt in enumerate(setup + often))
                  + '@@DECL response @| 0 @| "stats count=%u" @@END').ids
    assert [ids[fmt] for fmt in (*often, "stats count=%u")] == [2, 3, 4]
    assert sorted(ids.values()) == list(range(105))


@pytest.mark.parametrize("text, error", [
    ('@@DECL command @| g @| 0 @| "identify x=%u" @@END', "declared twice"),
    ('@@DECL command @| g @| 0 @| "go far=%d" @@END', "bad parameter"),
    ('@@DECL constant @| "A" @| 1 @@END@@DECL constant @| "A" @| 2 @@END',
     "both 1 and 2"),
    ('@@DECL string @| 0 @| name @@END', "not a string literal"),
])
def test_bad_declarations(text, error):
    with pytest.raises(DeclError, match=error):
        collect(text)


def test_message_that_is_too_long():
    with pytest.raises(DeclError, match="may exceed"):
        Message("m " + " ".join("p%d=%%u" % i for i in range(12))).max_size()


def test_initial_pins():
    collector = collect('@@DECL enumeration @| "pin" @| "PB0" @| 8 @| 8 @@END'
                        '@@DECL enumeration @| "pin" @| "X" @| 99 @| 1 @@END'
                        '@@DECL initial_pins @| "PB3, !X" @@END')
    lines = collector.write_tables("{}")
    assert "    { 11, 1 }," in lines and "    { 99, 0 }," in lines
    with pytest.raises(DeclError, match="PB8"):
        collector.find_pin("PB8")


def test_static_strings_are_numbered_once():
    text = '@@DECL string @| %d @| "No " "good" @@END'
    collector = collect(text % 0 + text % 1)
    assert collector.string_ids == {"No good": 2}
    header = collector.write_source_header(collector.uses[0][1])
    assert "enum { decl_string_1 = 2 };" in header
