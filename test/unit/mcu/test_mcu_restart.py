# SPDX-License-Identifier: GPL-3.0-or-later
"""Order of restarts where one board is the way to others."""

import types

import pytest

from klippy.errors import McuError
from klippy.mcu.restart import McuRestart, list_behind


def make_mcu(is_bridge=False, is_on_canbus=True):
    return types.SimpleNamespace(is_bridge=lambda: is_bridge,
                                 is_on_canbus=lambda: is_on_canbus)


def test_boards_behind_an_adapter():
    bridge, head, bed = make_mcu(True), make_mcu(), make_mcu(is_on_canbus=False)
    mcus = [bridge, bed, head]
    assert list_behind(bridge, mcus) == [head]
    assert list_behind(head, mcus) == [] and list_behind(bed, mcus) == []


def test_two_adapters_do_not_wait_for_each_other():
    first, second = make_mcu(True), make_mcu(True)
    assert list_behind(first, [first, second]) == []


class Reactor:
    """Time that passes by pauses."""

    def __init__(self):
        self.now, self.passed = 0., lambda: None

    def monotonic(self):
        return self.now

    def pause(self, until):
        self.now = until
        self.passed()


class Chip:
    """An mcu that gives a sign of its restart, or none, `delay` s after it."""

    def __init__(self, sign, delay):
        self.reactor, self.sign, self.delay = Reactor(), sign, delay
        self.starts, self.is_closed = None, False
        self.reactor.passed = self.note_time

    def note_time(self):
        if self.is_due("starting"):
            self.starts({})

    def is_due(self, sign):
        return self.sign == sign and self.reactor.now >= self.delay

    def get_printer(self):
        return types.SimpleNamespace(get_reactor=lambda: self.reactor)

    def get_name(self):
        return "mcu"

    def get_serial(self):
        def register(callback, name):
            assert name == "starting"
            self.starts = callback
        return types.SimpleNamespace(register_response=register)

    def try_lookup_command(self, name):
        return self if name == "reset" else None

    def send_notify(self):
        return types.SimpleNamespace(
            test=lambda: self.is_due("ack") or self.is_due("closed"),
            wait=lambda: None if self.sign == "closed" else (1., 2.))

    def is_link_active(self):
        return True

    def close_link(self):
        self.is_closed = True


def restart(sign, delay):
    """Restart such a chip by its command; returns it."""
    chip = Chip(sign, delay)
    method = McuRestart(chip, "command", types.SimpleNamespace(
        get_machine=lambda: None))
    method.lookup_commands()
    try:
        method.run()
    finally:
        assert chip.is_closed
    return chip


@pytest.mark.parametrize("sign", ["ack", "starting"])
def test_a_restart_waits_for_its_sign(sign):
    assert 0.2 < restart(sign, 0.2).reactor.now < 0.3


@pytest.mark.parametrize("sign, delay", [("ack", 1.), ("none", 0.), ("closed", 0.2)])
def test_a_restart_that_nobody_confirms(sign, delay):
    """As behind a cable that was cut: who restarts must not think it was done."""
    with pytest.raises(McuError, match="did not confirm"):
        restart(sign, delay)
