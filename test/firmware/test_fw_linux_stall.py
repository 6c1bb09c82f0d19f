# SPDX-License-Identifier: GPL-3.0-or-later
"""The real host is stopped (SIGSTOP) or busy in real time while it prints.

The linux firmware goes on meanwhile.  STALL_COUNT sets how often it is stopped.
"""

import os
import random
import signal
import threading
import time

import pytest
from linux_board import build_linux
from linux_machine import Machine
from test_fw_linux_session import check_at, home

STALLS = int(os.environ.get("STALL_COUNT", "3"))
# Of every four moves the last leads back; each takes about 0.3 s
LAP = "G1 X40 Y10 F6000\nG1 X40 Y40\nG1 X10 Y40\nG1 X10 Y10\n"
# The main thread is busy for some seconds, with the GIL
BUSY = """
[gcode_macro BUSY]
gcode:
    {% for i in range(params.N|int) %}{% for j in range(100000) %}{% endfor %}
    {% endfor %}
"""


class Print(threading.Thread):
    """A client that sends G-code and waits for its end."""

    def __init__(self, printer, script):
        super().__init__(daemon=True)
        self.printer, self.script, self.failure = printer, script, None

    def run(self):
        try:
            self.printer.gcode(self.script)
        except (RuntimeError, ConnectionError) as err:
            self.failure = err


@pytest.fixture
def machine(tmp_path):
    machine = Machine(build_linux(), tmp_path, "--max-late", "10000", config=BUSY)
    yield machine
    assert machine.stop() == 0


def heat(printer):
    """The hotend is to be kept warm all the while."""
    printer.gcode("SET_HEATER_TEMPERATURE HEATER=hotend TARGET=60")
    printer.gcode("TEMPERATURE_WAIT SENSOR='heater_generic hotend' MINIMUM=58")


def print_laps(machine, laps, disturb, more=""):
    """Print laps and call disturb(thread) meanwhile; then all is well."""
    work = Print(machine.printer, LAP * laps + more + "M400")
    work.start()
    disturb(work)
    work.join(120.)
    assert not work.is_alive() and work.failure is None, work.failure
    assert machine.printer.call("info")["state"] == "ready"


def stop_process(machine, seconds):
    machine.printer.process.send_signal(signal.SIGSTOP)
    time.sleep(seconds)
    machine.printer.process.send_signal(signal.SIGCONT)


@pytest.mark.slow
def test_a_stopped_process_prints_on(machine):
    printer = machine.printer
    printer.wait_state("ready")
    origin = home(machine)
    heat(printer)
    draw = random.Random(1)

    def disturb(work):
        for _ in range(STALLS):
            time.sleep(draw.uniform(0.3, 1.))
            assert work.is_alive()
            stop_process(machine, 10 ** draw.uniform(-2., 0.))
    print_laps(machine, 2 + 2 * STALLS, disturb)
    check_at(machine, origin, 10., 10., 2.)
    assert printer.status("motion_queuing") == {"planned_stops": 0, "holds": 0}

    def stop_long(work):
        time.sleep(0.5)
        stop_process(machine, 4.)
        assert work.is_alive()
    print_laps(machine, 3, stop_long)
    check_at(machine, origin, 10., 10., 2.)
    assert printer.status("motion_queuing")["holds"] == 1
    # heaters rest when it takes longer than they may go unwatched
    stop_process(machine, 6.5)
    printer.gcode("G1 X20 Y30 F6000\nM400")
    check_at(machine, origin, 20., 30., 2.)
    assert printer.status("heater_generic hotend")["target"] == 60.


@pytest.mark.slow
def test_a_busy_main_thread_comes_to_a_planned_stop(machine):
    printer = machine.printer
    printer.wait_state("ready")
    origin = home(machine)
    start = time.monotonic()
    printer.gcode("BUSY N=50")
    n = max(1, int(50 * 4.5 / (time.monotonic() - start)))
    print_laps(machine, 4, lambda work: None, "BUSY N=%d\n" % n + LAP)
    check_at(machine, origin, 10., 10., 2.)
    assert printer.status("motion_queuing")["planned_stops"] == 1
    assert "came to a planned stop: G-code command BUSY" in printer.log.read_text()
