# SPDX-License-Identifier: GPL-3.0-or-later
"""Waiting in a virtual world: limits, ready sources, pace, stalls."""

import os

import pytest
from virtualclock import EmptyWorld

from klippy import waiter
from klippy.waiter import RealWaiter, VirtualWaiter


@pytest.fixture
def real_time(monkeypatch):
    """The real clock of the module, moved by hand."""
    class Clock:
        now = 1000.

        def monotonic(self):
            return self.now
    clock = Clock()
    monkeypatch.setattr(waiter, "REAL_CLOCK", clock)
    monkeypatch.setattr(waiter, "POLL_INTERVAL", 0.001)
    return clock


@pytest.fixture
def virtual(real_time):
    instance = VirtualWaiter(EmptyWorld())
    yield instance
    instance.files.close()


def test_time_goes_to_the_limit(virtual):
    assert virtual.wait(100.3) == ([], [])
    assert virtual.clock.now == 100.3


def test_idle_world_goes_on_in_steps(virtual):
    virtual.wait(waiter.NEVER)
    assert virtual.clock.now == 100. + waiter.IDLE_ADVANCE


def test_time_never_goes_back(virtual):
    virtual.wait(0.)
    assert virtual.clock.now == 100.


def test_ready_sources_are_handed_out(virtual):
    virtual.clock.ready = ["call"]
    assert virtual.wait(105.)[1] == ["call"]
    assert virtual.clock.now == 100.


def test_paced_world_does_not_run_ahead_of_real_time(virtual, real_time):
    virtual.set_pace(10.)
    real_time.now += 0.01
    virtual.wait(105.)
    assert virtual.clock.now == pytest.approx(100.1)
    real_time.now += 0.5
    virtual.wait(105.)
    assert virtual.clock.now == pytest.approx(101.1)
    virtual.set_pace(0.)
    virtual.wait(101.5)
    assert virtual.clock.now == 101.5


def test_standing_time_is_moved(virtual):
    for _ in range(waiter.STALL_LIMIT + 1):
        virtual.wait(0.)
    assert virtual.clock.now == 100. + waiter.STALL_STEP


def test_descriptors_are_served(virtual, real_time):
    read_fd, write_fd = os.pipe()

    class Handler:
        fd, events = read_fd, 1
    handler = Handler()
    virtual.files.add(handler)
    os.write(write_fd, b"x")
    ready, _ = virtual.wait(100.1)
    assert [h for h, _ in ready] == [handler]
    assert virtual.wait(100.2)[0] == ()
    real_time.now += 2. * waiter.POLL_INTERVAL
    assert len(virtual.wait(100.3)[0]) == 1
    virtual.files.remove(handler)
    os.close(read_fd)
    os.close(write_fd)


class StandingClock:
    """A real clock of which only the reading counts."""

    def monotonic(self):
        return 50.


def test_real_waiter_serves_descriptors_and_wakes():
    real = RealWaiter(StandingClock())
    assert real.wait(50.) == ([], ())
    assert real.wait(0.) == ([], ())
    real.files.wake()
    assert real.wait(waiter.NEVER) == ([], ())
    read_fd, write_fd = os.pipe()

    class Handler:
        fd, events = read_fd, 1
    real.files.add(Handler)
    os.write(write_fd, b"x")
    (ready,), _ = real.wait(waiter.NEVER)
    assert ready[0] is Handler
    real.files.remove(Handler)
    real.files.remove(Handler)
    real.files.close()
    os.close(read_fd)
    os.close(write_fd)
