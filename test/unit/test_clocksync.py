# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversions and steering, on a link of perfect latency in virtual time."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample_dictionary import dictionary_zlib

from klippy import msgproto
from klippy.clocksync import ClockSync, SecondarySync

LATENCY = 0.0003


class Host:
    """A reactor and a link to a clock that runs at its own rate."""

    NOW = 0.

    def __init__(self):
        self.now = 50.

    def monotonic(self):
        return self.now

    def pause(self, waketime):
        self.now = waketime

    def register_timer(self, callback, waketime):
        return callback

    def unregister_timer(self, timer):
        return


class Link:
    """Answers clock queries; `rate` ticks a second since time `boot`."""

    def __init__(self, host, rate, boot):
        self.host, self.rate, self.boot = host, rate, boot
        self.msgparser = msgproto.MessageParser()
        self.msgparser.process_identify(dictionary_zlib())
        self.estimates, self.sent, self.handler = [], 0, None
        self.calc_latency = lambda: LATENCY

    def true_clock(self, time):
        return (time - self.boot) * self.rate

    def answer(self):
        sent = self.host.now
        self.host.now += self.calc_latency()
        clock = int(self.true_clock(self.host.now))
        self.host.now += self.calc_latency()
        return {"clock": clock & 0xffffffff, "high": clock >> 32,
                "#sent_time": sent, "#receive_time": self.host.now}

    def send_with_response(self, text, response):
        return self.answer()

    def alloc_command_queue(self):
        return None

    def register_response(self, callback, name, oid=None):
        self.handler = callback

    def set_clock_est(self, *estimate):
        self.estimates.append(estimate)

    def raw_send(self, *args):
        self.sent += 1


def connect(host, sync, rate=16e6, boot=20.):
    link = Link(host, rate, boot)
    sync.connect(link)
    return link


def run(host, links, seconds):
    """Answer the samples of all links for a time."""
    end = host.now + seconds
    while host.now < end:
        host.now += 0.9839
        for link in links:
            link.handler(link.answer())


def test_main_clock_estimates():
    host = Host()
    sync = ClockSync(host)
    link = connect(host, sync, rate=16e6 * 1.0002)
    run(host, [link], 60.)
    assert sync.estimated_print_time(host.now) == pytest.approx(
        link.true_clock(host.now) / 16e6, abs=5e-6)
    assert sync.print_time_to_clock(2.) == 32000000
    assert sync.clock_to_print_time(32000000) == 2.
    assert sync.estimate_clock_systime(sync.get_clock(80.)) == pytest.approx(80.)
    assert sync.calibrate_clock(5., host.now) == (0., 16e6)
    assert link.estimates[-1][0] == pytest.approx(16e6 * 1.0002, rel=1e-6)
    assert link.estimates[-1][3] == sync.last_clock


@given(st.integers(0, 1 << 40), st.integers(-(1 << 31), (1 << 31) - 1))
def test_clock32_round_trip(last, offset):
    sync = ClockSync(Host())
    sync.last_clock = last + (1 << 32)
    clock = sync.last_clock + offset
    assert sync.clock32_to_clock64(clock & 0xffffffff) == clock


def test_silence_is_noticed_after_some_samples():
    host = Host()
    sync = ClockSync(host)
    link = connect(host, sync)
    lost = []
    sync.set_lost_callback(lambda: lost.append(sync.pending_count))
    start = host.now
    while not lost:
        assert sync.is_active()
        host.now = sync._take_sample(host.now)
    assert not sync.is_active() and lost == [4]
    assert 3.9 < host.now - start < 5.
    link.handler(link.answer())
    assert sync.is_active()


def test_jittery_link_is_asked_more_often():
    host = Host()
    sync = ClockSync(host)
    link = connect(host, sync)
    rng = random.Random(5)
    link.calc_latency = lambda: LATENCY + rng.uniform(0., 0.004)
    link.sent, start = 0, host.now
    while host.now < start + 60.:
        waketime = sync._take_sample(host.now)
        link.handler(link.answer())
        host.now = max(host.now, waketime)
    assert 1500 < link.sent < 4800
    assert sync.estimated_print_time(host.now) == pytest.approx(
        link.true_clock(host.now) / 16e6, abs=50e-6)
    assert "jitter_to=0.002" in sync.dump_debug()


@pytest.mark.parametrize("main_ppm,other_ppm", [(0., 0.), (200., -200.), (-150., 90.)])
def test_secondary_clock_meets_the_main_one(main_ppm, other_ppm):
    host = Host()
    main = ClockSync(host)
    main_link = connect(host, main, 16e6 * (1. + main_ppm * 1e-6), boot=20.)
    other = SecondarySync(host, main)
    link = connect(host, other, 16e6 * (1. + other_ppm * 1e-6), boot=33.)
    worst = 0.
    for second in range(120):
        run(host, [main_link, link], 1.)
        print_time = main.estimated_print_time(host.now) + 1.
        before = other.print_time_to_clock(print_time)
        offset, freq = other.calibrate_clock(print_time, host.now)
        assert abs(other.print_time_to_clock(print_time) - before) <= 1
        clock = other.print_time_to_clock(print_time)
        assert int((print_time - offset) * freq) == clock
        real_time = main_link.boot + print_time * 16e6 / main_link.rate
        error = other.print_time_to_clock(print_time) - link.true_clock(real_time)
        if second > 30:
            worst = max(worst, abs(error) / 16e6)
    assert worst < 20e-6


def test_file_clock_follows_the_reactor():
    host = Host()
    sync = ClockSync(host)
    sync.connect_file(Link(host, 16e6, 0.))
    host.now += 10.
    assert sync.estimated_print_time(host.now) == pytest.approx(10.)
    assert sync.is_active()
