# SPDX-License-Identifier: GPL-3.0-or-later
"""Timers in order of their time: an indexed binary heap.

Among equal times the one that was armed first comes first.  Each timer knows
its place, so that moving and removing one costs O(log n).
"""


class Timer:
    """A callback and the eventtime (s) it is due at; sealed.

    index is its place in the heap, -1 outside.  owner is used by the reactor
    for what is woken (a worker) or completed.
    """

    def __init__(self, callback=None, owner=None):
        self.callback = callback
        self.owner = owner
        self.waketime = 0.
        self.order = 0
        self.index = -1
        self.is_registered = True


class TimerHeap:
    """The armed timers."""

    def __init__(self):
        self.items = []
        self.n_armed = 0

    def __len__(self):
        return len(self.items)

    def set(self, timer, waketime):
        """Arm a timer for waketime (s), behind the others of that time."""
        self.n_armed += 1
        timer.waketime = waketime
        timer.order = self.n_armed
        index = timer.index
        if index < 0:
            index = len(self.items)
            self.items.append(timer)
            timer.index = index
        else:
            index = self._sift_down(index)
        self._sift_up(index)
        return 0

    def remove(self, timer):
        """Disarm a timer; nothing happens if it is not armed."""
        index = timer.index
        if index < 0:
            return 0
        timer.index = -1
        last = self.items.pop()
        if last is timer:
            return 0
        self.items[index] = last
        last.index = index
        self._sift_up(self._sift_down(index))
        return 0

    def first(self):
        """The timer that is due first, None if there is none."""
        return self.items[0] if self.items else None

    def clear(self):
        """Disarm all timers; returns them."""
        timers, self.items = self.items, []
        for timer in timers:
            timer.index = -1
        return timers

    def _sift_up(self, index):
        items = self.items
        moving = items[index]
        while index > 0:
            parent_index = (index - 1) >> 1
            parent = items[parent_index]
            if not _is_before(moving, parent):
                break
            items[index] = parent
            parent.index = index
            index = parent_index
        items[index] = moving
        moving.index = index
        return index

    def _sift_down(self, index):
        items = self.items
        n_items = len(items)
        moving = items[index]
        while True:
            child_index = 2 * index + 1
            if child_index >= n_items:
                break
            child = items[child_index]
            if child_index + 1 < n_items:
                other = items[child_index + 1]
                if _is_before(other, child):
                    child = other
                    child_index += 1
            if not _is_before(child, moving):
                break
            items[index] = child
            child.index = index
            index = child_index
        items[index] = moving
        moving.index = index
        return index


def _is_before(a, b):
    if a.waketime != b.waketime:
        return a.waketime < b.waketime
    return a.order < b.order
