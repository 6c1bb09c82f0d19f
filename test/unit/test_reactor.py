# SPDX-License-Identifier: GPL-3.0-or-later
"""The event loop, in virtual time; descriptors and threads on pipes."""

import os
import signal
import threading

import greenlet
import pytest
from virtualclock import EmptyWorld

from klippy.reactor import Reactor


class RaisedOnPurpose(Exception):
    pass


def test_timer_runs_at_its_times(reactor):
    times = []

    def tick(eventtime):
        times.append(eventtime)
        if len(times) == 3:
            reactor.end()
            return reactor.NEVER
        return eventtime + 0.25
    reactor.register_timer(tick, 100.5)
    reactor.run()
    assert times == [100.5, 100.75, 101.]


def test_timers_of_one_time_run_in_order_of_arming(reactor):
    order = []
    for number in range(20):
        reactor.register_callback(lambda e, n=number: order.append(n), 101.)
    reactor.register_callback(lambda e: reactor.end(), 101.)
    reactor.run()
    assert order == list(range(20))


def test_a_timer_that_is_always_due_starves_nobody(reactor):
    count = [0]

    def busy(eventtime):
        count[0] += 1
        return reactor.NOW
    reactor.register_timer(busy, reactor.NOW)
    reactor.register_callback(lambda e: reactor.end(), 100.)
    reactor.run()
    assert 1 <= count[0] < 5


def test_virtual_time_moves_on_under_a_timer_that_is_always_due(reactor):
    reactor.register_timer(lambda e: reactor.NOW, reactor.NOW)
    reactor.register_callback(lambda e: reactor.end(), 100.00001)
    reactor.run()
    assert reactor.monotonic() == pytest.approx(100.00001, abs=1e-6)


def test_unregistered_timer_never_runs_again(reactor):
    runs = []

    def tick(eventtime):
        runs.append(eventtime)
        reactor.unregister_timer(timer)
        return eventtime + 1.
    timer = reactor.register_timer(tick, 101.)
    reactor.register_callback(lambda e: reactor.end(), 110.)
    reactor.run()
    assert runs == [101.]
    reactor.update_timer(timer, 0.)
    assert timer.index == -1


def test_update_timer_to_never_disarms(reactor):
    runs = []
    timer = reactor.register_timer(runs.append, 101.)
    reactor.update_timer(timer, reactor.NEVER)
    reactor.register_callback(lambda e: reactor.end(), 105.)
    reactor.run()
    assert runs == []


def test_pause_lets_others_run(reactor):
    log = []

    def slow(eventtime):
        log.append(("start", eventtime))
        assert reactor.pause(eventtime + 2.) == 102.
        log.append(("end", reactor.monotonic()))
        reactor.end()
    reactor.register_callback(slow)
    reactor.register_callback(lambda e: log.append(("other", e)), 101.)
    reactor.run()
    assert log == [("start", 100.), ("other", 101.), ("end", 102.)]


def test_pause_outside_the_loop_runs_the_loop(reactor):
    seen = []
    reactor.register_callback(seen.append, 101.)
    assert reactor.pause(102.) == 102.
    assert seen == [101.]


def test_run_drops_what_is_due_later(reactor):
    late = []
    reactor.register_callback(late.append, 103.)
    reactor.register_callback(lambda e: reactor.end(), 102.)
    reactor.run()
    reactor.pause(110.)
    assert late == []


def test_callback_result_is_the_completion_result(reactor, run_in_reactor):
    def func():
        completion = reactor.register_callback(lambda e: e * 2, 101.)
        assert not completion.test()
        return completion.wait()
    assert run_in_reactor(func) == 202.


def test_wait_ends_at_its_time(reactor, run_in_reactor):
    completion = reactor.completion()
    assert run_in_reactor(lambda: completion.wait(101., "late")) == "late"
    completion.complete("done")
    assert completion.wait(101.) == "done"


def test_completion_wakes_all_waiters(reactor):
    completion, results = reactor.completion(), []
    for _ in range(3):
        reactor.register_callback(
            lambda e: results.append((completion.wait(), reactor.monotonic())))
    reactor.register_callback(lambda e: completion.complete(7), 101.)
    reactor.register_callback(lambda e: reactor.end(), 102.)
    reactor.run()
    assert results == [(7, 101.)] * 3


def test_completion_and_timeout_at_one_time_wake_once(reactor, run_in_reactor):
    completion = reactor.completion()
    reactor.register_callback(lambda e: completion.complete("done"), 101.)

    def func():
        first = completion.wait(101., "late")
        return first, reactor.pause(103.)
    first, time = run_in_reactor(func)
    assert first in ("done", "late") and time == 103.


def test_mutex_is_fair_and_handed_over(reactor):
    mutex, order = reactor.mutex(), []

    def user(number):
        with mutex:
            assert mutex.test()
            order.append(number)
            reactor.pause(reactor.monotonic() + 1.)
    for number in range(4):
        reactor.register_callback(lambda e, n=number: user(n))
    reactor.register_callback(lambda e: reactor.end(), 110.)
    reactor.run()
    assert order == [0, 1, 2, 3] and not mutex.test()


def test_mutex_is_released_by_an_error(reactor):
    mutex = reactor.mutex()
    with pytest.raises(RaisedOnPurpose), mutex:
        raise RaisedOnPurpose()
    assert not mutex.test()
    assert reactor.mutex(is_locked=True).test()


def test_waiter_of_a_mutex_survives_other_wakes(reactor):
    mutex, log = reactor.mutex(is_locked=True), []

    def user(eventtime):
        timers.append(reactor.get_wake_timer())
        mutex.lock()
        log.append(reactor.monotonic())
    timers = []
    reactor.register_callback(user)
    reactor.register_callback(lambda e: reactor.update_timer(timers[0], 0.), 101.)
    reactor.register_callback(lambda e: mutex.unlock(), 102.)
    reactor.register_callback(lambda e: reactor.end(), 103.)
    reactor.run()
    assert log == [102.]


def test_error_without_handler_ends_run():
    reactor = Reactor(EmptyWorld())

    def fail(eventtime):
        raise RaisedOnPurpose("x")
    reactor.register_callback(fail)
    with pytest.raises(RaisedOnPurpose):
        reactor.run()
    reactor.finalize()


def test_error_goes_to_the_handler_once_and_the_timer_ends(caplog):
    reactor, errors = Reactor(EmptyWorld()), []
    reactor.set_error_handler(errors.append)

    def fail(eventtime):
        raise RaisedOnPurpose("x")
    reactor.register_timer(fail, 101.)
    assert not reactor.call_protected(fail, 0.)
    assert reactor.call_protected(len, "abc")
    reactor.register_callback(lambda e: reactor.end(), 105.)
    reactor.run()
    reactor.finalize()
    assert len(errors) == 2
    assert len([r for r in caplog.records if r.levelname == "ERROR"]) == 2


def test_finalize_ends_waiting_greenlets():
    reactor, log = Reactor(EmptyWorld()), []

    def wait_forever(eventtime):
        try:
            reactor.completion().wait()
        finally:
            log.append("ended")
    reactor.register_callback(wait_forever)
    reactor.register_callback(lambda e: reactor.end(), 101.)
    reactor.run()
    assert log == []
    reactor.finalize()
    reactor.finalize()
    assert log == ["ended"]
    with pytest.raises(RuntimeError):
        reactor.run()


def test_greenlets_are_used_again(reactor):
    used = set()
    for number in range(100):
        reactor.register_callback(
            lambda e: used.add(greenlet.getcurrent()), 100. + number)
    reactor.register_callback(lambda e: reactor.end(), 300.)
    reactor.run()
    assert len(used) == 1


def test_async_callback_from_a_thread_wakes_the_loop(reactor):
    completion = reactor.completion()
    thread = threading.Thread(
        target=lambda: reactor.async_complete(completion, "from thread"))

    def main(eventtime):
        thread.start()
        result.append(completion.wait())
        reactor.end()
    result = []
    reactor.register_callback(main)
    reactor.run()
    thread.join()
    assert result == ["from thread"]


def test_async_callback_from_a_signal_handler_ends_an_endless_wait():
    class StandingClock:
        def monotonic(self):
            return 50.
    reactor = Reactor(StandingClock())

    def handle(number, frame):
        reactor.register_async_callback(lambda e: reactor.end())
    old = signal.signal(signal.SIGALRM, handle)
    signal.setitimer(signal.ITIMER_REAL, 0.001)
    reactor.run()
    signal.signal(signal.SIGALRM, old)
    reactor.finalize()


def test_async_callbacks_keep_their_order(reactor):
    order = []
    for number in range(5):
        reactor.register_async_callback(lambda e, n=number: order.append(n))
    reactor.register_callback(lambda e: reactor.end(), 101.)
    reactor.run()
    assert order == list(range(5))


def test_ready_callbacks_of_the_world_run(reactor):
    calls = []
    reactor.clock.ready = [lambda: calls.append(reactor.pause(101.))]
    reactor.register_callback(lambda e: reactor.end(), 102.)
    reactor.run()
    assert calls == [101.]


def test_descriptor_callbacks(reactor):
    read_fd, write_fd = os.pipe()
    log = []

    def read(eventtime):
        log.append(os.read(read_fd, 10))
        reactor.unregister_fd(reader)
        reactor.end()

    def write(eventtime):
        os.write(write_fd, b"hello")
        reactor.set_fd_wake(writer, False, False)
    reader = reactor.register_fd(read_fd, read)
    writer = reactor.register_fd(write_fd, None, write)
    reactor.set_fd_wake(writer, False, True)
    reactor.run()
    assert log == [b"hello"]
    reactor.unregister_fd(writer)
    reactor.unregister_fd(writer)
    os.close(read_fd)
    os.close(write_fd)


def test_plain_file_is_no_descriptor_to_wait_for(reactor, tmp_path):
    with open(tmp_path / "file", "wb") as file, pytest.raises(OSError):
        reactor.register_fd(file.fileno(), lambda e: None)


def test_descriptor_closed_before_unregistering(reactor):
    read_fd, write_fd = os.pipe()
    handler = reactor.register_fd(read_fd, lambda e: None)
    os.close(read_fd)
    reactor.unregister_fd(handler)
    os.close(write_fd)


def test_many_timers_are_kept_in_order(reactor):
    times = []
    for number in range(5000):
        reactor.register_callback(times.append, 100. + (number * 7919 % 5000) / 1000.)
    reactor.register_callback(lambda e: reactor.end(), 106.)
    reactor.run()
    assert times == sorted(times) and len(times) == 5000


def test_open_class_takes_attributes_and_subclasses():
    class Special(Reactor):
        def monotonic_plus(self):
            return self.monotonic() + 1.
    reactor = Special(EmptyWorld(5.))
    reactor.note = "mine"
    assert reactor.monotonic_plus() == 6. and reactor.note == "mine"
    reactor.finalize()


def test_system_exit_leaves_run():
    reactor = Reactor(EmptyWorld())

    def leave(eventtime):
        raise SystemExit(3)
    reactor.register_callback(leave)
    reactor.register_callback(lambda e: reactor.completion().wait())
    with pytest.raises(SystemExit):
        reactor.run()
    assert reactor.pause(105.) == 105.
    reactor.finalize()


def test_error_while_outside_the_loop_is_not_lost():
    reactor, errors = Reactor(EmptyWorld()), []
    reactor.set_error_handler(errors.append)

    def fail(eventtime):
        raise RaisedOnPurpose("x")
    reactor.register_callback(fail, 101.)
    reactor.pause(102.)
    assert len(errors) == 1
    reactor.finalize()


def test_pause_to_the_past_is_a_turn_for_others(reactor, run_in_reactor):
    order = []

    def func():
        reactor.register_callback(lambda e: order.append("other"))
        reactor.pause(0.)
        order.append("me")
    run_in_reactor(func)
    assert order == ["other", "me"]
