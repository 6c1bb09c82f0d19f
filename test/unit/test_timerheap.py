# SPDX-License-Identifier: GPL-3.0-or-later
"""The heap of timers against a sorted list."""

from hypothesis import given
from hypothesis import strategies as st

from klippy.timerheap import Timer, TimerHeap

ACTIONS = st.lists(st.tuples(st.integers(0, 9), st.integers(-1, 5)), max_size=200)


def take_all(heap):
    order = []
    while (timer := heap.first()) is not None:
        heap.remove(timer)
        order.append(timer)
    return order


@given(ACTIONS)
def test_order_is_by_time_then_by_arming(actions):
    heap, timers, model = TimerHeap(), [Timer(i) for i in range(10)], {}
    for n_done, (number, waketime) in enumerate(actions):
        if waketime < 0:
            heap.remove(timers[number])
            model.pop(number, None)
        else:
            heap.set(timers[number], waketime)
            model[number] = (waketime, n_done)
        assert len(heap) == len(model)
        first = heap.first()
        expected = min(model, key=model.get) if model else None
        assert (first.callback if first is not None else None) == expected
    assert [t.callback for t in take_all(heap)] == sorted(model, key=model.get)
    assert all(timer.index == -1 for timer in timers)


def test_removing_twice_and_an_unarmed_one_is_harmless():
    heap, timer = TimerHeap(), Timer()
    heap.remove(timer)
    heap.set(timer, 1.)
    heap.remove(timer)
    heap.remove(timer)
    assert heap.first() is None and len(heap) == 0


def test_clear_disarms_all():
    heap, timers = TimerHeap(), [Timer() for _ in range(5)]
    for timer in timers:
        heap.set(timer, 2.)
    assert set(heap.clear()) == set(timers)
    assert heap.first() is None and timers[0].index == -1
