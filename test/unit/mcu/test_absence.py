# SPDX-License-Identifier: GPL-3.0-or-later
"""What others ask of an mcu's absence; its life is in test/faults."""

import types

import pytest

from klippy.errors import CommandError, ConfigError
from klippy.mcu import absence


class Printer:
    def __init__(self):
        self.handlers = {}

    def register_event_handler(self, event, handler):
        self.handlers[event] = handler


def make_mcu(is_non_critical=True, is_gone=False):
    printer = Printer()
    return types.SimpleNamespace(
        printer=printer, get_printer=lambda: printer, get_name=lambda: "aux",
        is_non_critical=is_non_critical, non_critical_disconnected=is_gone,
        get_non_critical_disconnect_event_name=lambda: "gone",
        get_non_critical_reconnect_event_name=lambda: "back")


def test_chip_that_knows_nothing_of_absence():
    chip = object()
    assert not absence.may_be_absent(chip) and not absence.is_absent(chip)
    absence.watch(chip, print, print)
    absence.raise_if_absent(chip)
    absence.check_present(chip, "steppers")


def test_watch_calls_what_is_given():
    mcu = make_mcu()
    absence.watch(mcu, None, print)
    assert mcu.printer.handlers == {"back": print}
    absence.watch(mcu, print, None)
    assert set(mcu.printer.handlers) == {"back", "gone"}
    steady = make_mcu(is_non_critical=False)
    absence.watch(steady, print, print)
    assert steady.printer.handlers == {}


def test_refusals_name_the_mcu():
    absence.raise_if_absent(make_mcu())
    with pytest.raises(CommandError, match="Mcu 'aux' is not connected"):
        absence.raise_if_absent(make_mcu(is_gone=True))
    with pytest.raises(ConfigError, match="Mcu 'aux' may not have steppers"):
        absence.check_present(make_mcu(), "steppers")
