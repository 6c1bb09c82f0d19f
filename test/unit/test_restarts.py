# SPDX-License-Identifier: GPL-3.0-or-later
"""Weeks of uptime with RESTARTs: a printer that has ended leaves nothing behind."""

import collections
import gc
import itertools

import pytest
from machine_configs import BED, make_axes

from klippy import plugins
from klippy.printer import Printer
from klippy.reactor import Reactor
from klippy.simulator import session
from klippy.simulator.machine import SimMachine
from klippy_ext.vworld import VirtualWorld

CONFIG = (make_axes("corexy") + BED + """
[force_move]
enable_force_move: True
[pause_resume]
[exclude_object]
[gcode_arcs]
[respond]
[input_shaper]
shaper_type: mzv
shaper_freq_x: 50
shaper_freq_y: 50
[virtual_sdcard]
path: %s
[gcode_macro NOTE]
gcode: RESPOND MSG="{ printer.toolhead.position.x }"
""")
SCRIPT = """SET_KINEMATIC_POSITION X=50 Y=50 Z=5
G1 X60 Y55 E0.4 F6000
G1 X50 Y50 E0.8
G2 X52 Y52 I1 J1
NOTE"""
WARM_UP = 4                 # what is imported or cached once is in then
GROWTH_KB = 1024


class Restarts:
    """One machine, and printers on it, one after the other."""

    def __init__(self, folder):
        plugins.install()
        self.path = folder / "printer.cfg"
        self.path.write_text(CONFIG % (folder,))
        self.world = VirtualWorld(seed=1)
        self.machine = SimMachine(
            self.world, session.load_sections(str(self.path)), 1)

    def live_once(self):
        """Start, print a little, RESTART."""
        reactor = Reactor(self.world)
        printer = Printer(reactor, None, {
            "config_file": str(self.path), "start_reason": "startup",
            "machine": self.machine, "log_file": None})
        errors = []

        def follow(eventtime):
            try:
                while printer.get_state_message()[1] == "startup":
                    reactor.pause(reactor.monotonic() + 0.1)
                printer.lookup_object("gcode").run_script(SCRIPT)
                printer.lookup_object("toolhead").wait_moves()
                printer.lookup_object("gcode").run_script("RESTART")
            except Exception as e:
                errors.append(e)
                printer.request_exit("error_exit")

        reactor.register_callback(follow)
        result = printer.run()
        reactor.finalize()
        gc.collect()                # as the daemon does
        assert (result, errors) == ("exit" if errors else "restart", errors)

    def live(self, count):
        """Objects by type, and KB of memory, after so many printers."""
        for _ in range(count):
            self.live_once()
        return (collections.Counter(type(one).__name__ for one in gc.get_objects()),
                read_memory())


def read_memory():
    """KB that this process has in memory."""
    with open("/proc/self/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file
                    if line.startswith("VmRSS"))


def assert_flat(restarts, count):
    """No type may grow by one or more a restart, twice as many times."""
    stages = [restarts.live(n) for n in (WARM_UP, count, count)]
    first, second = ({name: n for name, n in (after[0] - before[0]).items()
                      if n >= count} for before, after in itertools.pairwise(stages))
    assert not first.keys() & second.keys(), (first, second)
    assert stages[2][1] - stages[1][1] < GROWTH_KB


def test_a_few_restarts(tmp_path):
    assert_flat(Restarts(tmp_path), 3)


@pytest.mark.slow
def test_fifty_restarts(tmp_path):
    assert_flat(Restarts(tmp_path), 25)
