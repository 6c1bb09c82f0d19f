# SPDX-License-Identifier: GPL-3.0-or-later
"""The page on peripherals tells what the firmware has."""

import re

from simboard import ROOT

PAGE = ROOT / "docs" / "internals" / "firmware_peripherals.md"
CORE_PAGE = ROOT / "docs" / "internals" / "firmware.md"


def list_documented():
    """Formats of commands and responses in the page's last code block."""
    block = PAGE.read_text().split("## 6. Commands")[1].split("```")[1]
    return [line.strip() for line in block.splitlines() if line.strip()]


def test_formats_are_those_of_the_dictionary(board):
    known = {**board.dictionary["commands"], **board.dictionary["responses"]}
    documented = list_documented()
    assert len(documented) == len(set(documented)) > 80
    assert [fmt for fmt in documented if fmt not in known] == []


def test_every_command_is_documented(board):
    """What is not on this page belongs to the core: src/core and motion."""
    core = set()
    paths = [path for folder in ("src", "src/core", "src/motion")
             for path in (ROOT / folder).glob("*.c")]
    paths += [ROOT / "src/io" / name for name in (
        "analog_in.c", "digital_out.c", "pwm_out.c")]
    for path in paths:
        core |= set(re.findall(r'"(\w+)[ "]', path.read_text()))
    names = {fmt.split()[0] for fmt in list_documented()}
    missing = {fmt.split()[0] for fmt in board.dictionary["commands"]} \
        - names - core
    assert missing == set()


def test_every_shutdown_reason_is_documented(board):
    text = PAGE.read_text() + CORE_PAGE.read_text()
    missing = [reason for reason in board.strings.values()
               if reason not in text
               and not reason.startswith(("Missed scheduling",
                                          "Scheduled "))]
    assert all(len(reason) <= 60 for reason in board.strings.values())
    peripheral = [reason for reason in missing
                  if re.search(r"spi|i2c|angle|filter|section|neopixel|button"
                               r"|tmcuart|trigger|HX71x|ads|model|bus_type"
                               r"|[Tt]hermo", reason)]
    assert peripheral == []
