# SPDX-License-Identifier: GPL-3.0-or-later
"""What all tests share: a reactor in virtual time that must end clean."""

import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent
for folder in (ROOT, ROOT / "test", ROOT / "test" / "unit"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))


@pytest.fixture
def reactor():
    """A Reactor in an empty virtual world; no callback of it may raise."""
    from virtualclock import EmptyWorld

    from klippy.reactor import Reactor
    failures = []
    instance = Reactor(EmptyWorld())
    instance.set_error_handler(failures.append)
    yield instance
    instance.finalize()
    assert not failures


@pytest.fixture
def run_in_reactor(reactor):
    """run_in_reactor(func) calls func() in the loop and returns its result."""
    def run(func):
        def call(eventtime):
            try:
                return func()
            finally:
                reactor.end()
        completion = reactor.register_callback(call)
        reactor.run()
        return completion.wait(reactor.NOW)
    return run
