# SPDX-License-Identifier: GPL-3.0-or-later
"""Event loop of the host: timers, descriptors, greenlets that can wait.

One greenlet, the hub, waits and picks what is due; all callbacks run in worker
greenlets, which return to the hub whenever they wait.  All methods are for the
reactor's own thread, except register_async_callback() and async_complete().
See docs/internals/reactor.md.
"""

import collections
import gc
import logging
import select
import threading

import greenlet

from klippy.slownote import SLOW_TIME, SlowNote
from klippy.timerheap import Timer, TimerHeap
from klippy.waiter import NEVER as _NEVER
from klippy.waiter import RealWaiter, VirtualWaiter

_NOW = 0.
_MAX_IDLE_WORKERS = 32
_READABLE = select.EPOLLIN | select.EPOLLHUP | select.EPOLLERR
_WRITABLE = select.EPOLLOUT
_BROKEN = select.EPOLLHUP | select.EPOLLERR


class ReactorCompletion:
    """A result that others can wait for."""

    def __init__(self, reactor):
        self._reactor = reactor
        self._result = None
        self._is_done = False
        self._waiting = []

    def test(self):
        """True once there is a result."""
        return self._is_done

    def complete(self, result):
        """Set the result and wake all who wait; a second result replaces it."""
        self._result, self._is_done = result, True
        waiting, self._waiting = self._waiting, []
        for timer in waiting:
            self._reactor.update_timer(timer, _NOW)

    def wait(self, waketime=_NEVER, waketime_result=None):
        """Wait for the result until waketime (s, eventtime).

        Returns the result, or waketime_result if there is none by then.
        """
        if not self._is_done:
            timer = self._reactor.get_wake_timer()
            self._waiting.append(timer)
            self._reactor.pause(waketime)
            if not self._is_done:
                self._waiting.remove(timer)
                return waketime_result
        return self._result


class ReactorMutex:
    """A lock that is handed over in order of arrival."""

    def __init__(self, reactor, is_locked=False):
        self._reactor = reactor
        self._is_locked = bool(is_locked)
        self._waiting = collections.deque()

    def test(self):
        """True while it is locked."""
        return self._is_locked

    def lock(self):
        """Take the lock, waiting for it as long as it takes."""
        if not self._is_locked:
            self._is_locked = True
            return
        timer = self._reactor.get_wake_timer()
        entry = [timer, False]
        self._waiting.append(entry)
        while not entry[1]:
            self._reactor.pause(_NEVER)

    def unlock(self):
        """Hand the lock to who waits longest, if anybody does."""
        if not self._waiting:
            self._is_locked = False
            return
        entry = self._waiting.popleft()
        entry[1] = True
        self._reactor.update_timer(entry[0], _NOW)

    def __enter__(self):
        self.lock()
        return self

    def __exit__(self, kind, value, trace):
        self.unlock()


class FileHandler:
    """A registered descriptor; its callbacks take the eventtime (s)."""

    def __init__(self, fd, read_callback, write_callback):
        self.fd = fd
        self.read_callback, self.write_callback = read_callback, write_callback
        self.events = select.EPOLLIN

    def fileno(self):
        return self.fd


class FileEvent:
    """One call of a descriptor's callback."""

    def __init__(self, callback):
        self.callback = callback


class Worker(greenlet.greenlet):
    """A greenlet that runs callbacks, one after the other."""

    def __init__(self, reactor, hub):
        greenlet.greenlet.__init__(self, reactor.run_worker, hub)
        self.wake_timer = Timer(None, self)
        self.job = self.last_job = None


class Outside:
    """Stands for the code outside the loop that waits in a loop of its own."""

    def __init__(self):
        self.wake_timer = Timer(None, self)


class Reactor:
    """The event loop of one clock (RealClock or VirtualWorld)."""
    NOW = _NOW
    NEVER = _NEVER

    def __init__(self, clock):
        self.clock = clock
        self.is_virtual = hasattr(clock, "advance")
        self._waiter = VirtualWaiter(clock) if self.is_virtual else RealWaiter(clock)
        self.monotonic = clock.monotonic
        self._heap = TimerHeap()
        self._async_calls = collections.deque()
        self._thread = threading.get_ident()
        self._hub = self._current = None
        self._outside = Outside()
        self._idle_workers, self._workers = [], set()
        self._is_running = self._is_finalized = False
        self._error_handler = self._error = None
        self._now = _NOW        # time of the round of timers that runs
        self.n_switches = 0     # to workers: the same means without a break
        self.slow = SlowNote()

    # Time

    def set_pace(self, speed):
        """Let a virtual world pass speed s a real one; 0: as fast as it goes."""
        if self.is_virtual:
            self._waiter.set_pace(speed)

    def get_pace(self):
        """Seconds a virtual world passes in a real one, 0 if that is not set."""
        return self._waiter.speed if self.is_virtual else 1.

    def get_gc_stats(self):
        """Number of collections so far, by generation."""
        return tuple(entry["collections"] for entry in gc.get_stats())

    # Timers

    def register_timer(self, callback, waketime=_NEVER):
        """Have callback(eventtime) called at waketime (s); returns the Timer.

        The callback returns its next waketime.  NOW is at once, NEVER never.
        """
        timer = Timer(callback)
        self.update_timer(timer, waketime)
        return timer

    def update_timer(self, timer, waketime):
        """Change the time of a timer.

        If its callback runs, what that returns counts in the end.
        """
        if not timer.is_registered:
            return
        if waketime >= _NEVER:
            self._heap.remove(timer)
            timer.waketime = waketime
        else:
            self._arm(timer, waketime)

    def _arm(self, timer, waketime):
        # what is overdue queues behind what is due now: nobody starves
        self._heap.set(timer, max(waketime, self._now))
        return 0

    def unregister_timer(self, timer):
        """Never call a timer again, also not if its callback runs now."""
        timer.is_registered = False
        timer.waketime = _NEVER
        self._heap.remove(timer)

    # Callbacks and waiting

    def completion(self):
        """A new ReactorCompletion."""
        return ReactorCompletion(self)

    def mutex(self, is_locked=False):
        """A new ReactorMutex."""
        return ReactorMutex(self, is_locked)

    def register_callback(self, callback, waketime=_NOW):
        """Call callback(eventtime) once; returns a completion of its result."""
        completion = ReactorCompletion(self)
        self._arm(Timer(callback, completion), waketime)
        return completion

    def register_async_callback(self, callback, waketime=_NOW):
        """As register_callback(), without completion.

        Allowed from any thread and from signal handlers.
        """
        self._async_calls.append((callback, waketime))
        is_inside = threading.get_ident() == self._thread and self._current is not None
        if not is_inside and not self._is_finalized:
            self._waiter.files.wake()

    def async_complete(self, completion, result):
        """Complete a completion from any thread."""
        self.register_async_callback(lambda eventtime: completion.complete(result))

    def get_wake_timer(self):
        """The timer that ends the pause() of the code that runs now."""
        current = self._current
        return self._outside.wake_timer if current is None else current.wake_timer

    def pause(self, waketime):
        """Let others run until waketime (s, eventtime); returns the time then.

        Outside the loop (before and after run()) this runs the loop itself.
        """
        worker = self._current
        if worker is None:
            timer = self._outside.wake_timer
            self.update_timer(timer, waketime)
            self._dispatch_until(timer)
        else:
            self.update_timer(worker.wake_timer, waketime)
            self._hub.switch()
        return self.clock.monotonic()

    # Descriptors

    def register_fd(self, fd, read_callback, write_callback=None):
        """Call read_callback(eventtime) while fd is readable; returns a handler.

        Raises OSError if fd cannot be waited for.
        """
        handler = FileHandler(fd, read_callback, write_callback)
        self._waiter.files.add(handler)
        return handler

    def set_fd_wake(self, handler, is_readable=True, is_writeable=False):
        """Choose what a handler is called for."""
        handler.events = ((select.EPOLLIN if is_readable else 0)
                          | (select.EPOLLOUT if is_writeable else 0))
        self._waiter.files.change(handler)

    def unregister_fd(self, handler):
        """Stop calling a handler."""
        handler.events = 0
        self._waiter.files.remove(handler)

    # The loop

    def call_protected(self, callback, *args):
        """Call a callback now; an error is handled as if a timer had raised it.

        Returns True if there was none.
        """
        try:
            callback(*args)
        except Exception as err:
            self._handle_error(err)
            return False
        return True

    def set_error_handler(self, handler):
        """Have handler(exception) called when a callback raises.

        Without one the loop ends and run() raises the exception.
        """
        self._error_handler = handler

    def run(self):
        """Run until end() is called.  What is then still due is dropped."""
        if self._is_finalized:
            raise RuntimeError("the reactor is finalized: make a new one")
        self._thread = threading.get_ident()
        self._is_running = True
        try:
            self._dispatch_until(None)
        finally:
            self._is_running = False
            for timer in self._heap.clear():
                timer.waketime = _NEVER
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def end(self):
        """End run() as soon as the callback that runs now waits or returns."""
        self._is_running = False

    def finalize(self):
        """End all waiting greenlets and close the descriptors."""
        if self._is_finalized:
            return
        self._is_finalized = True
        self._hub = greenlet.getcurrent()
        for worker in list(self._workers):
            self._current = worker
            if worker.parent is not self._hub:
                worker.parent = self._hub
            worker.throw(greenlet.GreenletExit)
        self._current = None
        self._workers.clear()
        self._idle_workers.clear()
        self._heap.clear()
        self._waiter.files.close()

    def _dispatch_until(self, end_timer):
        """Run what is due until end() or, if given, until end_timer is due."""
        self._hub = greenlet.getcurrent()
        heap, clock, waiter = self._heap, self.clock, self._waiter
        while True:
            if self._async_calls:
                self._take_async_calls()
            self._now = now = clock.monotonic()
            for _ in range(len(heap) + 1):
                if end_timer is None and not self._is_running:
                    return
                timer = heap.first()
                if timer is None or timer.waketime > now:
                    break
                heap.remove(timer)
                if timer is end_timer:
                    return
                self._run_timer(timer)
            if self._async_calls or (end_timer is None and not self._is_running):
                continue
            timer = heap.first()
            ready, calls = waiter.wait(_NEVER if timer is None else timer.waketime)
            for handler, events in ready:
                self._run_file_events(handler, events)
            for call in calls:
                self._start(call)

    def _take_async_calls(self):
        calls = self._async_calls
        for _ in range(len(calls)):
            callback, waketime = calls.popleft()
            self._arm(Timer(callback, ReactorCompletion(self)), waketime)

    def _run_timer(self, timer):
        if timer.callback is None:
            self._switch_to(timer.owner)
        else:
            self._start(timer)
        return 0

    def _run_file_events(self, handler, events):
        wanted = handler.events
        if events & _READABLE and wanted & select.EPOLLIN:
            self._start(FileEvent(handler.read_callback))
        elif events & _BROKEN and handler.write_callback is None:
            self._waiter.files.remove(handler)
        if events & (_WRITABLE | _BROKEN) and handler.events & select.EPOLLOUT:
            self._start(FileEvent(handler.write_callback))

    # Workers

    def _start(self, job):
        """Run a job in a worker until it first waits.

        A job is a Timer, a FileEvent or a callable without arguments.
        """
        if self._idle_workers:
            worker = self._idle_workers.pop()
        else:
            worker = Worker(self, self._hub)
            self._workers.add(worker)
        worker.job = worker.last_job = job
        self._switch_to(worker)
        return 0

    def _switch_to(self, worker):
        self._current = worker
        if worker.parent is not self._hub:
            worker.parent = self._hub
        self.n_switches += 1
        start = self.clock.monotonic()
        try:
            worker.switch()
        finally:
            self._current = None
        busy = self.clock.monotonic() - start
        if busy > SLOW_TIME:
            job = getattr(worker, "last_job", None)
            self.slow.note(busy, getattr(job, "callback", None) or job)
        return 0

    def run_worker(self):
        """Body of a worker: runs jobs until there are enough idle workers."""
        worker = self._current
        while True:
            job, worker.job = worker.job, None
            self._run_job(job)
            job = None
            if self._is_finalized or len(self._idle_workers) >= _MAX_IDLE_WORKERS:
                self._workers.discard(worker)
                return
            self._idle_workers.append(worker)
            self._hub.switch()

    def _run_job(self, job):
        """Run a job; the one place where errors of callbacks end up."""
        try:
            if isinstance(job, FileEvent):
                job.callback(self.clock.monotonic())
            elif not isinstance(job, Timer):
                job()
            elif job.owner is not None:
                job.owner.complete(job.callback(self.clock.monotonic()))
            else:
                waketime = job.callback(self.clock.monotonic())
                self.update_timer(job, waketime)
        except Exception as err:
            self._handle_error(err)
        return 0

    def _handle_error(self, err):
        logging.exception("a callback of the reactor failed")
        if self._error_handler is not None:
            self._error_handler(err)
        else:
            self._error = err
            self._is_running = False
