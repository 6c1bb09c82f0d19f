# SPDX-License-Identifier: GPL-3.0-or-later
"""The protocol in virtual time: order, clocks, loss, timeouts."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from linkpeers import EchoMcu, build_echo, slow_int

from klippy_ext.msgblock import split_blocks
from klippy_ext.vworld import VirtualWorld

FREQ = 1000000


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return build_echo(tmp_path_factory.mktemp("echo"))


@pytest.fixture
def echo(library):
    """The toy mcu, synchronised, with a known clock."""
    return make_echo(library)


def make_echo(library, **options):
    echo = EchoMcu(VirtualWorld(seed=11), library, **options)
    echo.ask(5, 9)
    set_clock(echo)
    return echo


def set_clock(echo):
    now = echo.world.monotonic()
    clock = echo.mcu.clock_at(now)
    echo.queue.set_clock_est(echo.mcu.freq, now, clock, clock)
    return clock


def test_earlier_required_clock_goes_first(echo):
    first, second = (echo.queue.alloc_command_queue() for _ in range(2))
    clock = set_clock(echo)
    for i in range(3):
        echo.log(b"late%d" % i, cq=first, reqclock=clock + 100000 + i)
        echo.log(b"soon%d" % i, cq=second, reqclock=clock + 50000 + i)
    echo.wait(0.1)
    data = [data for _, data in echo.read_log()]
    assert data == [b"soon0", b"soon1", b"soon2", b"late0", b"late1", b"late2"]


def test_urgent_message_pulls_its_queue_along(echo):
    """A queue stays in order; what is urgent does not wait for its head."""
    clock = set_clock(echo)
    echo.log(b"far", reqclock=clock + 60 * FREQ)
    echo.log(b"now", reqclock=clock)
    echo.wait(0.1)
    assert [data for _, data in echo.read_log()] == [b"far", b"now"]


def test_min_clock_holds_back(echo):
    clock = set_clock(echo)
    other = echo.queue.alloc_command_queue()
    for i in range(1, 6):
        echo.log(b"m%d" % i, cq=other, minclock=clock + i * 100000, reqclock=clock)
    assert echo.queue.get_stats()["upcoming_bytes"] == 5 * 4
    echo.wait(1.)
    log = echo.read_log()
    assert [data for _, data in log] == [b"m1", b"m2", b"m3", b"m4", b"m5"]
    for i, (arrival, _) in enumerate(log, 1):
        assert clock + i * 100000 <= arrival < clock + i * 100000 + 3000


def test_small_messages_leave_as_soon_as_the_link_is_idle(echo):
    clock = set_clock(echo)
    blocks = echo.queue.get_stats()["send_seq"]
    for i in range(12):
        echo.log(b"move%d" % i, reqclock=clock + 2 * FREQ)
    echo.wait(0.1)
    # a full block, and the rest as soon as that is acknowledged
    assert echo.queue.get_stats()["send_seq"] - blocks == 2
    log = echo.read_log()
    assert [data for _, data in log] == [b"move%d" % i for i in range(12)]
    assert log[-1][0] < clock + 0.01 * FREQ


def test_full_blocks_leave_at_once(echo):
    clock = set_clock(echo)
    for i in range(20):
        echo.log(bytes([i]) * 20, reqclock=clock + 60 * FREQ)
    echo.wait(0.1)
    assert echo.ask(5, 9)[0][1] >= 18


def test_within_half_the_clock_range(echo):
    """The wire has 32 bit clocks: nothing leaves more than 2^31 ticks ahead."""
    clock = set_clock(echo)
    target = clock + 2**31 + 5 * FREQ
    for _ in range(10):
        echo.log(b"x" * 30, reqclock=target)
    echo.wait(4.)
    assert echo.ask(5, 9)[0][1] == 0
    echo.wait(3.)
    log = echo.read_log()
    assert log and all(target - arrival < 2**31 for arrival, _ in log)


def test_background_only_when_idle(echo):
    background = echo.queue.alloc_command_queue()
    echo.queue.set_wire_frequency(250000)
    for i in range(40):
        echo.log(b"B%02d" % i + b"b" * 40, cq=background,
                 reqclock=0x7FFFFFFF00000000)
    for i in range(40):
        echo.log(b"F%02d" % i + b"f" * 40)
    echo.wait(1.)
    data = [data[:1] for _, data in echo.read_log()]
    assert sorted(data) == [b"B"] * 40 + [b"F"] * 40
    # one block of background may be on its way when the rest is sent
    assert b"".join(data).lstrip(b"B").startswith(b"F" * 40)
    assert b"".join(data).index(b"F") <= 1


def test_wire_frequency_paces_the_link(echo):
    """An urgent message waits for two blocks at most, not for a backlog."""
    clock = set_clock(echo)
    echo.queue.set_wire_frequency(250000)
    for _ in range(60):
        echo.log(b"x" * 50, reqclock=clock + 60 * FREQ)
    echo.wait(0.02)
    now = echo.mcu.clock_at(echo.world.monotonic())
    urgent = echo.queue.alloc_command_queue()
    echo.log(b"urgent", cq=urgent, reqclock=now)
    echo.wait(1.)
    arrival, = [clock for clock, data in echo.read_log() if data == b"urgent"]
    assert arrival - now < 3 * 64 * 40 + 1000


def test_times_of_answers_enclose_the_mcu(echo):
    """The clock in an answer lies between sent and received time."""
    echo.queue.set_wire_frequency(250000)
    for _ in range(10):
        (_, _, low, high, _), (_, sent, received, _) = echo.ask(5, 9)
        at = echo.mcu.time_at(low + (high << 32))
        assert sent <= at + 2e-6 and at <= received + 2e-6
        assert received - sent < 0.001


def test_notification_times(echo):
    before = echo.world.monotonic()
    echo.log(b"x", notify_id=77)
    payload, sent, received, notify_id = echo.pull_until(lambda e: e[3])
    assert notify_id == 77 and payload == b""
    assert before <= sent < received <= echo.world.monotonic()


def test_same_sequence_is_kept_over_sessions(library):
    """A new queue finds the sequence number of an mcu that goes on."""
    world = VirtualWorld(seed=1)
    echo = EchoMcu(world, library)
    for i in range(7):
        echo.log(b"a%d" % i)
        echo.wait(0.01)
    echo.queue.close()
    from klippy_ext.serialqueue import SerialQueue
    echo.queue = SerialQueue.open_virtual(world, echo.link)
    echo.cq = echo.queue.alloc_command_queue()
    echo.log(b"b")
    assert [d for _, d in echo.read_log()] == [b"a%d" % i for i in range(7)] + [b"b"]


def resend_times(echo, start):
    """Times at which blocks were put on the wire again, by byte counts."""
    times, last = [], echo.queue.get_stats()["bytes_write"]
    while echo.world.monotonic() < start + 1.:
        echo.world.advance(echo.world.monotonic() + 0.0005)
        count = echo.queue.get_stats()["bytes_write"]
        if count != last:
            times.append(echo.world.monotonic() - start)
        last = count
    return times


def test_timeout_doubles_up_to_a_tenth_of_a_second(echo):
    """A link that has worked is tried often: soon after it is back, all is there."""
    for _ in range(20):
        echo.ask(5, 9)
    rto = echo.queue.get_stats()["rto"]
    assert rto == 0.025
    echo.link.cut()
    start = echo.world.monotonic()
    echo.log(b"x")
    times = resend_times(echo, start)
    expected, wait = [0.], rto
    while expected[-1] + wait < 1.:
        expected.append(expected[-1] + wait)
        wait = min(2. * wait, 0.1)
    assert times == pytest.approx(expected, abs=0.0015)
    echo.link.restore()
    echo.wait(6.)
    assert [d for _, d in echo.read_log()] == [b"x"]
    echo.queue.check()


def test_round_trip_estimate_follows_rfc6298(library):
    """srtt and rttvar of equal samples, computed by hand."""
    echo = EchoMcu(VirtualWorld(), library, latency=0.020)
    echo.log(b"")
    echo.wait(1.)
    # question, answer; then one block of 7 bytes and its 5 byte answer
    rtt = 2 * 0.020 + (7 + 5) * 10 / 250000.
    stats = echo.queue.get_stats()
    assert stats["srtt"] == pytest.approx(rtt, abs=2e-6)
    assert stats["rttvar"] == pytest.approx(rtt / 2, abs=2e-6)
    assert stats["rto"] == pytest.approx(3 * rtt, abs=1e-5)
    echo.log(b"")
    echo.wait(1.)
    stats = echo.queue.get_stats()
    assert stats["srtt"] == pytest.approx(rtt, abs=2e-6)
    assert stats["rttvar"] == pytest.approx(rtt * 3 / 8, abs=2e-6)


def test_undamaged_link_repeats_nothing(echo):
    for i in range(300):
        echo.log(bytes([i & 255]) * (i % 50))
    echo.wait(2.)
    stats = echo.queue.get_stats()
    assert stats["bytes_retransmit"] == stats["bytes_invalid"] == 0
    assert echo.ask(5, 9)[0][1] == 300


def test_one_lost_block_costs_one_round(echo):
    """The answers to what follows a lost block ask for it, not a timeout."""
    echo.ask(5, 9)
    echo.link.cut()
    echo.log(b"first" * 10)
    echo.wait(0.001)
    echo.link.restore()
    start = echo.world.monotonic()
    for i in range(5):
        echo.log(b"next%d" % i * 10)
    echo.wait(1.)
    log = echo.read_log()
    assert [d[:5] for _, d in log] == [b"first"] + [b"next%d" % i for i in range(5)]
    assert echo.mcu.time_at(log[0][0]) - start < 0.020


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32),
       st.lists(st.tuples(st.integers(0, 2), st.integers(1, 38)),
                min_size=1, max_size=80),
       st.sampled_from([0., 0.002, 0.01]), st.sampled_from([0., 0.002, 0.01]),
       st.sampled_from([0., 0.002, 0.01]), st.sampled_from([0., 0.002]))
def test_damaged_link_loses_and_doubles_nothing(
        shared_library, seed, messages, flip, drop, insert, double):
    world = VirtualWorld(seed=seed)
    echo = EchoMcu(world, shared_library)
    echo.link.set_faults(flip=flip, drop=drop, insert=insert, double=double)
    cqs = [echo.queue.alloc_command_queue() for _ in range(3)]
    sent = [[], [], []]
    for i, (cq, size) in enumerate(messages):
        data = bytes([cq, i]) + b"d" * size
        sent[cq].append(data)
        echo.log(data, cq=cqs[cq], notify_id=i + 1)
        echo.queue.check()
    left = set(range(1, len(messages) + 1))
    limit = world.monotonic() + 300.
    while left and world.monotonic() < limit:
        world.advance(limit)
        echo.queue.check()
        while (entry := echo.queue.pull()) is not None:
            assert entry[3] in left
            left.remove(entry[3])
    assert not left
    echo.link.set_faults()
    log = [data for _, data in echo.read_log()]
    assert [[d for d in log if d[0] == cq] for cq in range(3)] == sent


@pytest.fixture(scope="module")
def shared_library(library):
    return library


def test_dumped_blocks_are_what_was_on_the_wire(echo):
    echo.wait(0.1)
    echo.link.record()
    echo.log(b"seen")
    echo.wait(0.1)
    sent, received = echo.queue.dump_debug()
    wire = {"to_mcu": b"", "from_mcu": b""}
    for _, direction, data in echo.link.take():
        wire[direction] += data
    assert wire["to_mcu"] == sent[-1][0] and wire["from_mcu"] == received[-1][0]
    assert split_blocks(sent[-1][0])[0][0][1] == b"\x01\x04seen"


def test_extend_clock(echo):
    echo.queue.set_clock_est(1e6, 0., 0, 5 * 2**32 + 100)
    assert echo.queue.extend_clock(101) == 5 * 2**32 + 101
    assert echo.queue.extend_clock(99) == 5 * 2**32 + 99
    assert echo.queue.extend_clock(2**32 - 1) == 5 * 2**32 - 1


def test_link_has_one_user(echo):
    from klippy_ext.serialqueue import SerialQueue
    with pytest.raises(RuntimeError, match="in use"):
        SerialQueue.open_virtual(echo.world, echo.link)
    with pytest.raises(ValueError, match="another world"):
        SerialQueue.open_virtual(VirtualWorld(), echo.link)
    echo.queue.close()
    SerialQueue.open_virtual(echo.world, echo.link)


def test_identifies_the_simulator_firmware():
    """The real firmware's dictionary, over a damaged link."""
    import json
    import zlib

    from klippy.simulator import firmware
    echo = EchoMcu(VirtualWorld(seed=5), firmware.find_firmware())
    echo.link.set_faults(flip=0.0005, drop=0.0005)
    data = b""
    for _ in range(1000):
        echo.queue.send(echo.cq, b"\x01" + slow_int(len(data)) + b"\x28")
        head = b"\x00" + slow_int(len(data))
        entry = echo.pull_until(lambda e, h=head: e[0].startswith(h), 0.5)
        if entry is None:
            continue
        chunk = entry[0][len(head) + 1:]
        if not chunk:
            break
        data += chunk
    dictionary = json.loads(zlib.decompress(data))
    assert dictionary["commands"]["identify offset=%u count=%c"] == 1
    assert dictionary["config"]["MCU"] == "simulator"
