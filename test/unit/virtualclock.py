# SPDX-License-Identifier: GPL-3.0-or-later
"""A virtual world without mcus, for tests of what waits."""


class EmptyWorld:
    """A clock that moves in advance(); nothing else happens in it."""

    def __init__(self, now=100.):
        self.now = now
        self.ready = []

    def monotonic(self):
        return self.now

    def advance(self, limit):
        if not self.ready:
            self.now = max(self.now, limit)
        return self.now

    def take_ready(self):
        ready, self.ready = self.ready, []
        return ready
