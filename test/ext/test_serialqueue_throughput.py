# SPDX-License-Identifier: GPL-3.0-or-later
"""What damage on the link costs: rows of the fault matrix."""
import pytest
from linkpeers import EchoMcu, build_echo

from klippy_ext.vworld import VirtualWorld

N_MESSAGES = 6000
SIZE = 40
N_BURST = 200           # bytes
BAUD = 250000


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return build_echo(tmp_path_factory.mktemp("echo"))


def measure(library, seed, disturb=lambda echo, n_left: None, link=None, **faults):
    """s for all messages to arrive; each arrives once, in order.

    link: options of a link whose rate the queue does not know.
    """
    world = VirtualWorld(seed=seed)
    echo = EchoMcu(world, library, **(link or {}))
    if link is None:
        echo.queue.set_wire_frequency(BAUD)
    echo.link.set_faults(**faults)
    begin, n_left, n_sent = world.monotonic(), N_MESSAGES, 0
    while n_left:
        while n_sent < N_MESSAGES and n_sent < N_MESSAGES - n_left + 50:
            n_sent += 1
            echo.log(n_sent.to_bytes(4, "big") + b"d" * SIZE, notify_id=n_sent)
        disturb(echo, n_left)
        assert world.monotonic() < begin + 600.
        world.advance(world.monotonic() + 0.005)
        while (entry := echo.queue.pull()) is not None:
            if entry[3]:
                assert entry[3] == N_MESSAGES - n_left + 1
                n_left -= 1
    note_repeated(echo.queue.get_stats())
    return world.monotonic() - begin


repeated = []       # shares of the bytes written that were repeated


def note_repeated(stats):
    repeated.append(stats["bytes_retransmit"] / stats["bytes_write"])


@pytest.mark.parametrize("kind", ["flip", "drop", "insert", "double"])
def test_throughput_of_a_noisy_link(library, kind):
    """At least nine tenths at an error in 10^5 bytes."""
    quiet = measure(library, 1)
    assert quiet < measure(library, 2, **{kind: 1e-3})      # it is seen at all
    assert measure(library, 3, **{kind: 1e-5}) * 0.9 <= quiet


def test_bursts(library):
    """Some 200 bytes are spoilt as a whole, twenty times: nothing is lost."""
    world_time = {"next": 0.2, "end": None, "n": 0}

    def disturb(echo, n_left):
        now, state = echo.world.monotonic(), world_time
        if state["end"] is not None and now >= state["end"]:
            echo.link.set_faults()
            state["end"] = None
        elif state["end"] is None and now >= state["next"] and state["n"] < 20:
            echo.link.set_faults(flip=1.0)
            state.update(end=now + N_BURST * 10 / BAUD, next=now + 0.5,
                         n=state["n"] + 1)

    assert measure(library, 4, disturb) < 1.5 * measure(library, 4) + 20 * 0.2
    assert world_time["n"] > 5


@pytest.mark.parametrize("link", [{}, {"latency": 0.012}, {"baud": 115200}], ids=str)
@pytest.mark.parametrize("kind", ["flip", "drop"])
def test_link_of_unknown_rate_recovers(library, kind, link):
    """All blocks on their way wait behind each other for a round trip's time: what is
    repeated does not cause the next repetition."""
    quiet = measure(library, 1, link=link)
    assert measure(library, 3, link=link, **{kind: 1e-4}) < 1.3 * quiet
    # 26 errors in 12 blocks each
    assert repeated.pop() < 0.15


def test_burst_on_a_full_link_of_unknown_rate(library):
    """For 8 ms nothing passes: one window is repeated, or two."""
    state = {"begin": None}

    def disturb(echo, n_left):
        now = echo.world.monotonic()
        state["begin"] = state["begin"] or now + 0.5
        is_on = state["begin"] <= now < state["begin"] + 0.008
        echo.link.set_faults(**({"flip": 1.0} if is_on else {}))

    link = {"latency": 0.012}
    assert (measure(library, 1, disturb, link=link)
            < measure(library, 1, link=link) + 0.15)
    assert repeated[-2] < 0.01
