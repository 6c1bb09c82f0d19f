# SPDX-License-Identifier: GPL-3.0-or-later
"""Who kept the main thread busy."""

from klippy.slownote import SlowNote


def test_longest_is_kept_and_the_inner_of_two():
    note = SlowNote()
    note.note(1., "inner")
    note.note(1.1, "outer")
    note.note(0.5, "short")
    assert note.take() == (1., "inner")
    note.note(0.3, len)
    note.note(0.5, "other")
    assert note.take() == (0.5, "other")
    assert note.take() == (0., "")


def test_callbacks_have_names():
    note = SlowNote()
    note.note(1., note.take)
    assert note.take()[1] == "klippy.slownote.SlowNote.take"


def test_reactor_notes_a_callback_without_a_break(reactor):
    world = reactor.clock

    def stall(eventtime):
        world.now += 3.

    def wait(eventtime):
        reactor.pause(eventtime + 10.)
    reactor.register_callback(stall)
    reactor.register_callback(wait)
    reactor.pause(reactor.monotonic() + 20.)
    seconds, what = reactor.slow.take()
    assert seconds == 3. and what.endswith("stall")
    assert reactor.n_switches >= 3
