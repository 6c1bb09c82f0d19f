# SPDX-License-Identifier: GPL-3.0-or-later
"""How the reactor waits: in epoll on the real clock, in the world on a virtual one.

Both serve file descriptors and can be woken from other threads.
"""

import os
import select

from klippy_ext.hostclock import RealClock

REAL_CLOCK = RealClock()
NEVER = 9999999999999999.
MAX_WAIT = 60.              # s, of one epoll call
POLL_INTERVAL = 0.001       # real s between polls of an unpaced virtual world
PACE_SLICE = 0.005          # real s a paced world may be late
IDLE_ADVANCE = 1.0          # s a world goes on at once when nothing is due
STALL_LIMIT = 20000         # rounds at one virtual time before it is moved on
STALL_STEP = 0.000001       # s


class FileEvents:
    """The registered descriptors and the wake-up from other threads."""

    def __init__(self):
        self.epoll = select.epoll()
        self.wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self.epoll.register(self.wake_fd, select.EPOLLIN)
        self.handlers = {}

    def add(self, handler):
        """Serve a handler (fd, event mask).  Raises OSError for plain files."""
        self.epoll.register(handler.fd, handler.events)
        self.handlers[handler.fd] = handler

    def change(self, handler):
        """Take over the event mask of a handler."""
        if self.handlers.get(handler.fd) is handler:
            self.epoll.modify(handler.fd, handler.events)

    def remove(self, handler):
        """Stop serving a handler."""
        if self.handlers.get(handler.fd) is not handler:
            return
        del self.handlers[handler.fd]
        try:
            self.epoll.unregister(handler.fd)
        except OSError:
            # closed before it was unregistered: epoll has forgotten it
            return

    def wake(self):
        """End a wait.  Any thread."""
        os.eventfd_write(self.wake_fd, 1)

    def poll(self, timeout):
        """Wait up to timeout s; returns [(handler, event mask)] of those ready."""
        ready = []
        # epoll rounds up to whole ms; a timer may be late by one
        for fd, events in self.epoll.poll(timeout):
            if fd == self.wake_fd:
                os.eventfd_read(fd)
            elif fd in self.handlers:
                ready.append((self.handlers[fd], events))
        return ready

    def close(self):
        self.epoll.close()
        os.close(self.wake_fd)


class RealWaiter:
    """Waits in epoll for the real clock."""

    def __init__(self, clock):
        self.clock = clock
        self.files = FileEvents()

    def wait(self, waketime):
        """Wait until waketime (s, eventtime) or an event.

        Returns (ready descriptors, ready callbacks).
        """
        delay = waketime - self.clock.monotonic()
        return self.files.poll(max(0., min(delay, MAX_WAIT))), ()


class VirtualWaiter:
    """Waits by advancing a virtual world, paced or as fast as it goes."""

    def __init__(self, world):
        self.clock = world
        self.files = FileEvents()
        self.speed = 0.
        self.start_real = self.start_virtual = 0.
        self.last_poll = 0.
        self.stalled_at, self.n_stalled = -1., 0

    def set_pace(self, speed):
        """Let speed virtual seconds pass a real one; 0: as fast as it goes."""
        self.speed = speed
        self.start_real = REAL_CLOCK.monotonic()
        self.start_virtual = self.clock.monotonic()

    def wait(self, waketime):
        """As RealWaiter.wait(); the callbacks are those of the world."""
        real = REAL_CLOCK.monotonic()
        now = self.clock.monotonic()
        limit = min(waketime, now + IDLE_ADVANCE)
        timeout = 0.
        if self.speed:
            allowed = self.start_virtual + (real - self.start_real) * self.speed
            if limit > allowed:
                timeout = min((limit - allowed) / self.speed, PACE_SLICE)
                limit = max(now, allowed)
        ready = ()
        if timeout or real - self.last_poll >= POLL_INTERVAL:
            self.last_poll = real
            ready = self.files.poll(timeout)
        self.clock.advance(max(limit, self._note_progress(now)))
        return ready, self.clock.take_ready()

    def _note_progress(self, now):
        """The time to go to at least: later than now if time seems to stand."""
        if now != self.stalled_at:
            self.stalled_at, self.n_stalled = now, 0
        self.n_stalled += 1
        if self.n_stalled <= STALL_LIMIT:
            return now
        self.n_stalled = 0
        return now + STALL_STEP
