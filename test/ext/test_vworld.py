# SPDX-License-Identifier: GPL-3.0-or-later
"""The virtual world: time, mcus, pins, links, and that it repeats itself."""

import gc
import struct

import pytest
from linkpeers import EchoMcu, build_echo, slow_block

from klippy_ext.serialqueue import SerialQueue
from klippy_ext.vworld import VirtualWorld


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return build_echo(tmp_path_factory.mktemp("echo"))


@pytest.fixture
def echo(library):
    return EchoMcu(VirtualWorld(seed=2), library)


def take_steps(trace):
    return list(struct.iter_unpack("=qq", trace.take()))


# Time


def test_tickers_keep_their_time(library):
    world = VirtualWorld()
    world.advance(1.)
    calls = []
    world.add_ticker(0.1, lambda now: calls.append(("a", now)))
    world.add_ticker(0.25, lambda now: calls.append(("b", now)))
    assert world.advance(2.) == 2.
    times = {name: [t for n, t in calls if n == name] for name in "ab"}
    assert times["a"] == pytest.approx([1. + 0.1 * i for i in range(1, 11)])
    assert times["b"] == pytest.approx([1.25, 1.5, 1.75, 2.])
    assert [t for _, t in calls] == sorted(t for _, t in calls)


def test_ticker_sees_its_time_and_its_error_comes_out():
    world = VirtualWorld()
    seen = []

    def tick(now):
        seen.append((now, world.monotonic()))
        if len(seen) == 3:
            raise ZeroDivisionError("model")

    world.add_ticker(0.5, tick)
    with pytest.raises(ZeroDivisionError, match="model"):
        world.advance(10.)
    assert seen == [(0.5, 0.5), (1., 1.), (1.5, 1.5)]
    assert world.advance(2.) == 2. and len(seen) == 4


def test_advance_is_not_reentrant():
    world = VirtualWorld()
    world.add_ticker(1., lambda now: world.advance(5.))
    with pytest.raises(RuntimeError, match="inside advance"):
        world.advance(2.)


@pytest.mark.parametrize("period", [0., -1., float("inf"), float("nan")])
def test_bad_period(period):
    with pytest.raises(ValueError, match="period above 0"):
        VirtualWorld().add_ticker(period, print)


def test_clocks_of_two_crystals(library):
    world = VirtualWorld()
    world.advance(3.)
    slow = world.add_mcu("a", library, ppm=-100.)
    fast = world.add_mcu("b", library, ppm=100.)
    assert slow.freq == fast.freq == 1000000.
    world.advance(103.)
    assert slow.clock_at(103.) == 99990000 and fast.clock_at(103.) == 100010000
    assert fast.time_at(100010000) == pytest.approx(103., abs=1e-9)
    assert fast.get_clock() == 100010000


def test_crystal_that_warms_up(library):
    """The clock does not jump when its rate changes, now and then mid-tick."""
    world = VirtualWorld()
    mcu = world.add_mcu("a", library, ppm=100.)
    world.advance(100.)
    before = mcu.clock_at(100.)
    mcu.set_ppm(-200.)
    assert mcu.clock_at(100.) == before == 100010000
    world.advance(200.00000049)
    mcu.set_ppm(0.)
    assert mcu.clock_at(300.) == before + 99980000 + 100000000
    assert mcu.time_at(before + 99980000) == pytest.approx(200., abs=1e-6)


def test_seed_starts_the_clock_anywhere(library):
    world = VirtualWorld(seed=1)
    clocks = [world.add_mcu("m", library, seed=i).get_clock() for i in range(3)]
    assert clocks[0] == 0 and clocks[1] != clocks[2] and min(clocks[1:]) > 0


def test_arrival_time_is_wire_time_and_latency(echo):
    """5 bytes ask, 5 answer; then 7 bytes: 10 bits each, and the latency."""
    start = echo.world.monotonic()
    echo.log(b"")
    echo.wait(0.1)
    entries = echo.read_log()
    byte, latency = 10 / 250000., 0.0002
    expected = start + (5 + 5 + 7) * byte + 3 * latency
    assert echo.mcu.time_at(entries[0][0]) == pytest.approx(expected, abs=2e-6)


def test_advance_stops_when_the_host_has_input(echo):
    calls = []
    echo.queue.set_ready_callback(lambda: calls.append(1))
    echo.send(9)
    now = echo.world.advance(50.)
    assert 0. < now < 0.01
    ready, = echo.world.take_ready()
    ready()
    assert calls == [1] and echo.queue.pull()[0][:1] == b"\x09"
    assert echo.world.take_ready() == []


def test_events_within_a_slice_stay_causal(library):
    """An answer never reaches an mcu before it could have been given."""
    world = VirtualWorld(seed=4)
    echoes = [EchoMcu(world, library, name=n, ppm=p, latency=0.00005, baud=2e6)
              for n, p in (("a", 30.), ("b", -30.))]
    for echo in echoes:
        echo.send(4, 1, 100000, 7)
    for _ in range(200):
        for echo in echoes:
            sent = world.monotonic()
            (_, _, low, high, _), _ = echo.ask(5, 9)
            assert sent < echo.mcu.time_at(low + (high << 32)) <= world.monotonic()


# Pins


def test_steps_are_counted_and_recorded(echo):
    trace = echo.mcu.watch_stepper(2, 3)
    assert trace.position == 0
    trace.record(True)
    echo.send(3, 3, 1)
    echo.send(4, 2, 20, 500)
    echo.wait(0.1)
    assert trace.position == 10
    echo.send(3, 3, 0)
    echo.send(4, 2, 6, 500)
    echo.wait(0.1)
    assert trace.position == 7
    steps = take_steps(trace)
    assert [d for _, d in steps] == [1] * 10 + [-1] * 3
    clocks = [c for c, _ in steps]
    assert [b - a for a, b in zip(clocks[:9], clocks[1:10], strict=True)] == [1000] * 9
    trace.record(False)
    echo.send(4, 2, 2, 500)
    echo.wait(0.1)
    assert trace.position == 6 and take_steps(trace) == []


def test_steps_inverted_and_on_both_edges(echo):
    falling = echo.mcu.watch_stepper(2, 3, invert_step=True, invert_dir=True)
    both = echo.mcu.watch_stepper(2, 3, both_edges=True, invert_dir=True)
    echo.send(3, 2, 1)      # idle level: no step
    echo.wait(0.01)
    assert falling.position == both.position == 0
    echo.send(4, 2, 7, 500)
    echo.wait(0.1)
    assert falling.position == 4 and both.position == 7


def test_edges_of_several_pins_come_in_order(echo):
    trace = echo.mcu.watch_edges([4, 5])
    echo.send(3, 4, 1)
    echo.send(3, 5, 1)
    echo.send(3, 4, 1)          # no change
    echo.send(3, 6, 1)          # not watched
    echo.send(4, 4, 3, 250)
    echo.wait(0.05)
    echo.send(8, 5, 64, 256)
    echo.wait(0.05)
    edges = trace.take()
    assert [(pin, level) for _, pin, level in edges] == [
        (4, 1.0), (5, 1.0), (4, 0.0), (4, 1.0), (4, 0.0), (5, 0.25)]
    clocks = [clock for clock, _, _ in edges]
    assert clocks == sorted(clocks)
    assert [b - a for a, b in zip(clocks[2:4], clocks[3:5], strict=True)] == [250] * 2
    assert trace.take() == []
    with pytest.raises(ValueError, match="pins 0 to 15"):
        echo.mcu.watch_edges([4, 16])


def test_spi_device_answers_while_it_is_selected(echo):
    def exchange(data):
        seen.append(data)
        return bytes(0xff - byte for byte in data)

    seen = []
    echo.mcu.add_spi_device(1, 3, exchange)
    echo.send(3, 3, 1)
    assert echo.ask(3, 11, 1, 0x12, 0x34)[0] == [11, 0xff, 0xff]
    echo.send(3, 3, 0)
    assert echo.ask(3, 11, 1, 0x12, 0x34)[0] == [11, 0xed, 0xcb]
    assert echo.ask(3, 11, 2, 0x12, 0x34)[0] == [11, 0xff, 0xff]
    assert seen == [b"\x12\x34"]


def test_i2c_device_answers_at_its_address(echo):
    assert echo.ask(4, 12, 0, 0x50, 7)[0] == [12, 1, 0xff, 0xff]
    echo.mcu.add_i2c_device(0, 0x50, lambda written, n: written * n)
    assert echo.ask(4, 12, 0, 0x50, 7)[0] == [12, 0, 7, 7]
    assert echo.ask(4, 12, 0, 0x51, 7)[0] == [12, 1, 0xff, 0xff]
    echo.mcu.add_i2c_device(0, 0x50, lambda written, n: None)
    assert echo.ask(4, 12, 0, 0x50, 7)[0] == [12, 1, 0xff, 0xff]


def test_error_of_a_bus_device_comes_out(echo):
    def fail(written, n):
        raise ZeroDivisionError("model")

    echo.mcu.add_i2c_device(0, 0x50, fail)
    with pytest.raises(ZeroDivisionError, match="model"):
        echo.ask(4, 12, 0, 0x50, 7)
    echo.wait(1.)
    assert echo.world.monotonic() >= 1.


def test_duty_of_gpio_and_pwm(echo):
    plain = echo.mcu.watch_output(4)
    inverted = echo.mcu.watch_output(4, invert=True)
    echo.send(3, 4, 1)
    echo.wait(0.01)
    plain.read_duty()
    inverted.read_duty()
    assert plain.level == 1 and inverted.level == 0
    echo.send(4, 4, 100, 250)       # 25 ms of changes, half of it on
    echo.wait(0.05)
    start = 0.0005                  # s until the command has arrived, about
    assert plain.read_duty() == pytest.approx((0.0125 + 0.025 + start) / 0.05,
                                              abs=0.02)
    assert inverted.read_duty() == pytest.approx(
        1. - (0.0125 + 0.025 + start) / 0.05, abs=0.02)
    echo.send(8, 4, 64, 256)
    echo.wait(0.01)
    plain.read_duty()
    echo.wait(1.)
    assert plain.level == 0.25
    assert plain.read_duty() == pytest.approx(0.25)
    assert inverted.level == 0.75


def test_levels_at_inputs(echo):
    def read(pull):
        return echo.ask(2, 5, 6, pull & 0xFFFFFFFF)[0][1]

    assert read(0) == 0 and read(1) == 1 and read(-1) == 0
    echo.mcu.set_input(6, 1)
    assert read(-1) == 1
    echo.mcu.set_input(6, 0)
    assert read(1) == 0
    echo.mcu.set_input(6, None)
    assert read(1) == 1


@pytest.mark.parametrize("fraction, value", [
    (0., 0), (0.25, 16384), (1., 65535), (7., 65535), (-1., 0)])
def test_analog_inputs(echo, fraction, value):
    echo.mcu.set_adc(7, fraction)
    assert echo.ask(2, 6, 7)[0][1] == value


def test_switch_closes_by_position(echo):
    first = echo.mcu.watch_stepper(2, 3)
    second = echo.mcu.watch_stepper(4, 5)

    def read():
        return echo.ask(2, 5, 8, 0)[0][1]

    def step(pin, count):
        echo.send(4, pin, 2 * count, 10)
        echo.wait(0.1)

    echo.send(3, 3, 1)
    echo.send(3, 5, 1)
    echo.mcu.bind_switch(8, [first, second], [0.5, -0.5], 2.4, above=True)
    assert read() == 0
    step(2, 4)
    assert read() == 0
    step(2, 1)
    assert read() == 1
    step(4, 1)
    assert read() == 0
    echo.mcu.bind_switch(8, [first], [1.], 5.5, invert=True)
    assert read() == 0
    step(2, 1)
    assert read() == 1


def test_switch_on_steps_of_another_mcu(library):
    world = VirtualWorld()
    mover, sensor = (EchoMcu(world, library, name=n) for n in "ab")
    trace = mover.mcu.watch_stepper(2, 3)
    sensor.mcu.bind_switch(8, [trace], [-1.], 100., above=True)
    mover.send(4, 2, 400, 100)
    assert sensor.ask(2, 5, 8, 0)[0][1] == 0
    mover.wait(0.1)
    assert trace.position == -200
    assert sensor.ask(2, 5, 8, 0)[0][1] == 1


def test_bad_pins_and_names(echo):
    for call in (lambda: echo.mcu.set_adc(16, 0.), lambda: echo.mcu.set_input(-1, 0),
                 lambda: echo.mcu.watch_stepper(0, 99),
                 lambda: echo.mcu.watch_output(1000),
                 lambda: echo.mcu.bind_switch(50, [], [], 0.)):
        with pytest.raises(ValueError, match="pins 0 to 15, not"):
            call()
    assert echo.mcu.find_pin("P12") == 12
    with pytest.raises(KeyError, match="Q1"):
        echo.mcu.find_pin("Q1")
    with pytest.raises(ValueError, match="0 traces need as many"):
        echo.mcu.bind_switch(1, [], [1.], 0.)


def test_late_events(echo):
    echo.send(10, 77)
    echo.send(10, 5)
    echo.wait(0.1)
    assert echo.mcu.late_events == 2 and echo.mcu.max_late_ticks == 77


# Power


def test_each_mcu_has_its_own_memory(library):
    world = VirtualWorld()
    echoes = [EchoMcu(world, library, name=n) for n in "abc"]
    for i, echo in enumerate(echoes):
        for _ in range(i):
            echo.log(b"x")
        echo.wait(0.1)
    assert [echo.ask(5, 9)[0][1] for echo in echoes] == [0, 1, 2]


@pytest.mark.parametrize("by_command", [False, True])
def test_reset_starts_afresh(echo, by_command):
    step = echo.mcu.watch_stepper(2, 3)
    output = echo.mcu.watch_output(9)
    echo.log(b"before")
    echo.send(3, 9, 1)
    echo.send(3, 3, 1)
    echo.send(4, 2, 6, 100)
    echo.wait(5.)
    assert output.level == 1 and step.position == 3
    if by_command:
        echo.send(7)
        echo.wait(0.002)
    else:
        echo.mcu.reset()
    assert echo.mcu.reset_count == 1
    assert output.level == 0 and step.position == 3
    echo.queue.close()
    again = EchoMcu.__new__(EchoMcu)
    again.world, again.mcu, again.link = echo.world, echo.mcu, echo.link
    again.queue = SerialQueue.open_virtual(echo.world, echo.link)
    again.question_cq = again.queue.alloc_command_queue()
    (_, count, low, high, boots), _ = again.ask(5, 9)
    assert count == 0 and boots == 1 and high == 0 and low < 10000
    assert 4.9 / 5.1 < output.read_duty() <= 1.


def test_reset_loses_what_is_on_the_wire(echo):
    echo.ask(5, 9)
    for _ in range(10):
        echo.log(b"x" * 50)
    echo.wait(0.001)
    count = echo.link.bytes_to_mcu
    echo.mcu.reset()
    echo.queue.close()
    echo.wait(1.)
    assert echo.link.bytes_to_mcu == count


def test_bad_library(tmp_path, library):
    world = VirtualWorld()
    with pytest.raises(OSError, match="cannot read firmware '/nowhere.so' for mcu 'x'"):
        world.add_mcu("x", "/nowhere.so")
    text = tmp_path / "text.so"
    text.write_text("hello")
    with pytest.raises(OSError, match="cannot load firmware"):
        world.add_mcu("x", text)
    import klippy_ext
    other = next(iter(klippy_ext.__path__)) + "/libklippyc.so"
    with pytest.raises(OSError, match="no vmcu_get_ops"):
        world.add_mcu("x", other)
    assert world.add_mcu("x", library).name == "x"


# Links


def test_cut_link_passes_nothing(echo):
    echo.ask(5, 9)
    echo.link.cut()
    before = echo.link.bytes_to_mcu, echo.link.bytes_from_mcu
    echo.log(b"x")
    echo.wait(1.)
    assert (echo.link.bytes_to_mcu, echo.link.bytes_from_mcu) == before
    echo.link.restore()
    echo.wait(2.)
    assert [d for _, d in echo.read_log()] == [b"x"]


def test_fault_rates(library):
    """Faults hit as many bytes as they should, give or take four sigma."""
    counts = {}
    for fault in ("flip", "drop", "insert", "double"):
        echo = EchoMcu(VirtualWorld(seed=9), library)
        echo.ask(5, 9)
        echo.wait(0.01)
        echo.link.record()
        echo.link.set_faults(**{fault: 0.02})
        for i in range(1000):
            echo.log(bytes([i & 127]) * 40)
        echo.wait(4.)
        sent = echo.queue.get_stats()["bytes_write"] - 11
        got = sum(len(d) for _, way, d in echo.link.take() if way == "to_mcu")
        counts[fault] = (got - sent) / sent
    assert counts["flip"] == 0.
    assert counts["drop"] == pytest.approx(-0.02, abs=0.003)
    assert counts["insert"] == counts["double"] or abs(
        counts["insert"] - counts["double"]) < 0.005
    assert counts["insert"] == pytest.approx(0.02, abs=0.003)
    with pytest.raises(TypeError, match="not flop"):
        echo.link.set_faults(flop=1.)


def test_record_holds_what_was_delivered(echo):
    echo.link.record()
    echo.log(b"abc")
    echo.wait(0.1)
    entries = echo.link.take()
    times = [time for time, _, _ in entries]
    assert times == sorted(times)
    down = b"".join(d for _, way, d in entries if way == "to_mcu")
    up = b"".join(d for _, way, d in entries if way == "from_mcu")
    assert down == slow_block(1) + slow_block(5, b"\x01\x03abc")
    assert up == slow_block(5) + slow_block(6)
    assert echo.link.take() == []
    assert len(down) == echo.link.bytes_to_mcu


def run_story(library, seed):
    """A run with everything in it; all that could be seen of it."""
    world = VirtualWorld(seed=seed)
    echoes = [EchoMcu(world, library, name=n, ppm=p, seed=3)
              for n, p in (("a", 20.), ("b", -20.))]
    traces = [e.mcu.watch_stepper(2, 3) for e in echoes]
    for echo, trace in zip(echoes, traces, strict=True):
        echo.link.record()
        trace.record()
        echo.link.set_faults(flip=0.003, drop=0.003, insert=0.003, double=0.003)
    ticks = []
    world.add_ticker(0.013, lambda now: ticks.append((now, traces[0].position)))
    for i in range(60):
        for echo in echoes:
            echo.log(b"entry %d" % i)
            echo.send(4, 2, 100, 13 + i)
        world.advance(world.monotonic() + 0.011)
    world.advance(world.monotonic() + 10.)
    return (ticks, [t.take() for t in traces], [e.link.take() for e in echoes],
            [e.queue.get_stats() for e in echoes])


def test_same_seed_same_everything(library):
    first = run_story(library, 5)
    assert first == run_story(library, 5)
    assert len(first[2][0]) > 100 and len(first[1][0]) > 1000
    assert first[2] != run_story(library, 6)[2]


def test_nothing_dangles_after_the_owners_are_gone(library):
    """Parts keep the world alive, in whatever order they go."""
    world = VirtualWorld()
    echo = EchoMcu(world, library)
    trace, queue = echo.mcu.watch_stepper(1, 2), echo.queue
    world.add_ticker(1., lambda now, world=world: None)
    queue.set_ready_callback(lambda queue=queue: None)
    del world, echo
    gc.collect()
    assert trace.position == 0
    queue.send(queue.alloc_command_queue(), b"\x09")
    del trace, queue
    gc.collect()


def test_run_length_counts(echo):
    echo.send(4, 2, 1000, 1000)
    echo.wait(2.)
    figures = echo.world.run_length()
    assert figures["time"] == pytest.approx(2.)
    assert figures["mcus"] == 1 and figures["events"] > 4
    assert 0 < figures["slices"] <= figures["mcu_runs"] <= 1000
