# SPDX-License-Identifier: GPL-3.0-or-later
"""Order of restarts where one board is the way to others."""

import types

from klippy.mcu.restart import list_behind


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
