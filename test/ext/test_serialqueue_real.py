# SPDX-License-Identifier: GPL-3.0-or-later
"""SerialQueue on descriptors: its thread, its file kind, how it ends."""

import errno
import os
import socket
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from linkpeers import SlowPeer, slow_block

from klippy_ext.hostclock import RealClock
from klippy_ext.msgblock import split_blocks
from klippy_ext.serialqueue import CommandQueue, SerialQueue


@pytest.fixture
def pair():
    host, mcu = socket.socketpair()
    queue = SerialQueue.open_fd(RealClock(), host.fileno(), "serial")
    yield queue, SlowPeer(mcu)
    queue.close()
    host.close()
    mcu.close()


def sync(queue, peer):
    """Past the opening question; returns a command queue."""
    cq = queue.alloc_command_queue()
    queue.send(cq, b"\x01")
    while not peer.payloads or peer.payloads[-1] != b"\x01":
        assert peer.serve_block() is not None
    return cq


def test_opens_with_a_question_then_sends(pair):
    queue, peer = pair
    queue.send(queue.alloc_command_queue(), b"\x01\x02")
    seq, payload = peer.read_block()
    assert payload == b"" and seq != peer.expected
    peer.send()
    assert peer.read_block() == (peer.expected, b"\x01\x02")


def test_messages_in_order_and_notified(pair):
    queue, peer = pair
    cq = sync(queue, peer)
    for i in range(200):
        queue.send(cq, bytes([i]) * 3, notify_id=i + 1)
    data = peer.serve_until(1 + 600)
    assert data[-600:] == bytes(i for i in range(200) for _ in range(3))
    now = RealClock().monotonic()
    for i in range(200):
        payload, sent, received, notify_id = queue.pull()
        assert payload == b"" and notify_id == i + 1
        assert 0. < sent <= received <= now + 1.
    queue.check()
    stats = queue.get_stats()
    assert stats["send_seq"] == stats["receive_seq"]
    assert stats["ready_bytes"] == stats["upcoming_bytes"] == 0


def test_at_most_twelve_blocks_on_the_way(pair):
    queue, peer = pair
    cq = sync(queue, peer)
    for _ in range(20):
        queue.send(cq, b"x" * 59)
    blocks = [peer.read_block() for _ in range(12)]
    assert all(len(payload) == 59 for _, payload in blocks)
    assert peer.pending == b""
    stats = queue.get_stats()
    assert stats["send_seq"] - stats["receive_seq"] == 12
    assert stats["ready_bytes"] == 8 * 59


def test_receive_window_limits_bytes(pair):
    queue, peer = pair
    cq = sync(queue, peer)
    queue.set_receive_window(192)
    for _ in range(10):
        queue.send(cq, b"y" * 55)
    got = [peer.read_block() for _ in range(3)]
    assert all(len(payload) == 55 for _, payload in got)
    stats = queue.get_stats()
    assert stats["send_seq"] - stats["receive_seq"] == 3
    peer.expected = (peer.expected + 3) % 16
    peer.send()
    assert [len(peer.read_block()[1]) for _ in range(3)] == [55] * 3


def test_nak_sends_again(pair):
    queue, peer = pair
    cq = sync(queue, peer)
    for i in range(3):
        queue.send(cq, bytes([i]) * 59)
    lost = [peer.read_block() for _ in range(3)]
    peer.send()
    again = [peer.read_block() for _ in range(3)]
    assert again == lost
    stats = queue.get_stats()
    assert stats["bytes_retransmit"] >= 3 * 64


def test_responses_come_once_with_times(pair):
    queue, peer = pair
    cq = sync(queue, peer)
    before = RealClock().monotonic()
    queue.send(cq, b"\x09")
    seq, payload = peer.read_block()
    peer.expected = (peer.expected + 1) % 16
    peer.send(b"\x51\x52")
    peer.send()
    payload, sent, received, notify_id = queue.pull()
    assert payload == b"\x51\x52" and notify_id == 0
    assert before <= sent <= received


def test_garbage_is_counted_not_delivered(pair):
    queue, peer = pair
    sync(queue, peer)
    peer.sock.sendall(b"\x00\xffnonsense\x7e" + slow_block(peer.expected, b"ok"))
    assert queue.pull()[0] == b"ok"
    assert queue.get_stats()["bytes_invalid"] == 11


def test_dump_shows_both_directions(pair):
    queue, peer = pair
    cq = sync(queue, peer)
    for i in range(150):
        queue.send(cq, bytes([i]), notify_id=i + 1)
        assert peer.serve_block() == bytes([i])
        assert queue.pull()[3] == i + 1
    sent, received = queue.dump_debug()
    assert len(sent) >= 100 and len(received) >= 100
    assert split_blocks(sent[-1][0])[0][0][1] == bytes([149])
    times = [time for _, time in sent]
    assert times == sorted(times)


def test_close_wakes_pullers(pair):
    queue, _ = pair
    results = []
    started = threading.Event()

    def pull():
        started.set()
        results.append(queue.pull())

    thread = threading.Thread(target=pull)
    thread.start()
    started.wait()
    queue.close()
    thread.join(60.)
    assert results == [None] and queue.pull() is None
    queue.close()


def test_lost_peer_ends_pull(pair):
    queue, peer = pair
    peer.sock.close()
    assert queue.pull() is None
    assert queue.get_error() in (errno.EPIPE, errno.ECONNRESET)


def test_closed_queue_takes_nothing(pair):
    queue, _ = pair
    cq = queue.alloc_command_queue()
    queue.close()
    queue.send(cq, b"\x01")
    assert queue.get_stats()["upcoming_bytes"] == 0


@pytest.mark.parametrize("data", [b"", b"x" * 60])
def test_bad_size_of_command(pair, data):
    queue, _ = pair
    with pytest.raises(ValueError, match="1 to 59 bytes, not %d" % len(data)):
        queue.send(queue.alloc_command_queue(), data)


def test_unknown_kind_and_descriptor():
    with pytest.raises(ValueError, match="'smoke'"):
        SerialQueue.open_fd(RealClock(), 0, "smoke")
    with pytest.raises(OSError, match="descriptor"):
        SerialQueue.open_fd(RealClock(), 9999, "serial")


def test_command_queue_made_before_the_link(tmp_path, pair):
    cq = CommandQueue()
    path = tmp_path / "out"
    with open(path, "wb") as output:
        queue = SerialQueue.open_fd(RealClock(), output.fileno(), "file")
        queue.send(cq, b"\x01")
        with pytest.raises(ValueError, match="another link"):
            pair[0].send(cq, b"\x02")
        queue.close()
    pair[0].send(cq, b"\x02")
    assert split_blocks(path.read_bytes())[0] == [(1, b"\x01")]


def test_can_frames():
    """Blocks are cut into frames of up to 8 bytes with the node's number."""
    import struct
    host, mcu = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    queue = SerialQueue.open_fd(RealClock(), host.fileno(), "can", 0x106)
    queue.send(queue.alloc_command_queue(), b"z" * 20)

    def frame(can_id, data):
        return struct.pack("=IB3x8s", can_id, len(data), data)

    def read_block():
        data = b""
        while not data or len(data) < data[0]:
            can_id, size, part = struct.unpack("=IB3x8s", mcu.recv(16))
            assert can_id == 0x106 and size <= 8
            data += part[:size]
        return data

    mcu.settimeout(60.)
    assert len(read_block()) == 5
    mcu.send(frame(0x999, slow_block(1)))
    mcu.send(frame(0x107, slow_block(7)))
    assert read_block() == slow_block(7, b"z" * 20)
    queue.close()
    host.close()
    mcu.close()


# Files


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 2), st.binary(min_size=1, max_size=59),
                          st.integers(0, 2**40), st.integers(0, 2**41))))
def test_file_keeps_everything_in_order(messages):
    with open(os.memfd_create("out"), "w+b") as output:
        queue = SerialQueue.open_fd(RealClock(), output.fileno(), "file")
        cqs = [queue.alloc_command_queue() for _ in range(3)]
        for cq, data, minclock, reqclock in messages:
            queue.send(cqs[cq], data, minclock, reqclock)
        queue.close()
        output.seek(0)
        blocks, skipped, rest = split_blocks(output.read())
    assert not skipped and not rest
    assert b"".join(p for _, p in blocks) == b"".join(m[1] for m in messages)
    assert [seq for seq, _ in blocks] == [(i + 1) % 16 for i in range(len(blocks))]
    assert all(len(a) + len(b) > 59 for (_, a), (_, b)
               in zip(blocks, blocks[1:], strict=False))


def test_file_kind_drains_into_a_full_pipe():
    """What does not fit into the pipe is written as the reader goes on."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    queue = SerialQueue.open_fd(RealClock(), writer, "file")
    cq = queue.alloc_command_queue()
    received = []

    def drain():
        while data := os.read(reader, 65536):
            received.append(data)

    thread = threading.Thread(target=drain)
    sent = [bytes([i & 255]) * 50 for i in range(6000)]
    for data in sent[:10]:
        queue.send(cq, data)
    thread.start()
    for data in sent[10:]:
        queue.send(cq, data)
    queue.close()
    os.close(writer)
    thread.join(60.)
    os.close(reader)
    blocks, skipped, rest = split_blocks(b"".join(received))
    assert [p for _, p in blocks] == sent and not skipped and not rest
    assert queue.get_stats()["bytes_write"] == 6000 * 55


def test_full_disk_is_told_at_close():
    with open("/dev/full", "wb", buffering=0) as output:
        queue = SerialQueue.open_fd(RealClock(), output.fileno(), "file")
        queue.send(queue.alloc_command_queue(), b"lost")
        with pytest.raises(OSError, match="No space left") as failure:
            queue.close()
        assert failure.value.errno == errno.ENOSPC


def test_file_completes_notifications(tmp_path):
    with open(tmp_path / "out", "wb") as output:
        queue = SerialQueue.open_fd(RealClock(), output.fileno(), "file")
        queue.send(queue.alloc_command_queue(), b"\x01", notify_id=7)
        payload, sent, received, notify_id = queue.pull()
        assert (payload, notify_id) == (b"", 7) and sent == received
        queue.close()
