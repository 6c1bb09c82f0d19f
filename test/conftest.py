# SPDX-License-Identifier: GPL-3.0-or-later
"""What all tests share: a reactor in virtual time that must end clean."""

import atexit
import os
import pathlib
import shutil
import sys
import tempfile

import hypothesis
import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent
for folder in (ROOT, ROOT / "test", ROOT / "test" / "unit"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

# What programs keep for their next start is no test's business
os.environ["KLIPPY_CACHE"] = CACHE = tempfile.mkdtemp(prefix="klippy-cache-")
atexit.register(shutil.rmtree, CACHE, ignore_errors=True)


# The default run judges a change, and so repeats itself; the nightly run explores
hypothesis.settings.register_profile("same", derandomize=True)
hypothesis.settings.register_profile("explore", print_blob=True)
hypothesis.settings.load_profile(os.environ.get("KLIPPY_HYPOTHESIS", "same"))

# Folders and files whose tests talk to other processes in real time
REALTIME = ("clients", "firmware/test_fw_linux", "firmware/test_console",
            "ext/test_realtime", "ext/test_serialqueue_real", "faults/test_web_page",
            "faults/test_late_host", "build/test_bench_files")


def pytest_collection_modifyitems(items):
    """Mark the tests that have to run alone."""
    for item in items:
        path = item.path.relative_to(ROOT / "test").as_posix()
        if path.startswith(REALTIME):
            item.add_marker(pytest.mark.realtime)


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
