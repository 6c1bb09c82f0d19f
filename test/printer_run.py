# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole printer on a simulated machine, run part by part in virtual time."""

import dataclasses
import pathlib

import numpy as np

from klippy import plugins
from klippy.errors import PrinterError
from klippy.printer import Printer
from klippy.reactor import Reactor
from klippy.simulator import session
from klippy.simulator.machine import SimMachine
from klippy_ext.vworld import VirtualWorld

START_TIMEOUT = 60.


@dataclasses.dataclass
class Snapshot:
    """The machine at rest; mm, s, steps."""
    print_time: float
    position: list              # x, y, z, e of the tool head
    origins: dict               # stepper -> mm at which its mcu counts 0
    counts: dict                # stepper -> steps at its pins


class PrinterRun:
    """Boots a printer, runs parts of G-code, notes what the pins did.

    A part is G-code text, a Path to a file for the virtual SD card, or a
    function of the Printer.
    """

    def __init__(self, config, folder, seed=1):
        """config: text of a printer.cfg.  folder: where files may be put."""
        plugins.install()
        self.folder = pathlib.Path(folder)
        self.config_path = self.folder / "printer.cfg"
        self.config_path.write_text(config)
        self.world = VirtualWorld(seed=seed)
        sections = session.load_sections(str(self.config_path))
        self.machine = SimMachine(self.world, sections, seed)
        self.failure = None
        self.snapshots, self.sync_times, self.events = [], [], []
        self.steps, self.owners = {}, {}    # stepper -> steps, name of its mcu
        self.responses = []

    def run(self, parts, record_from=0):
        """Run all parts; steps are recorded from the given part on.

        Raises PrinterError if the printer does not get ready or a part fails.
        """
        self.parts, self.record_from = parts, record_from
        reactor = Reactor(self.world)
        self.printer = Printer(reactor, None, {
            "config_file": str(self.config_path), "start_reason": "startup",
            "machine": self.machine, "log_file": None,
            "implicit_sections": {"virtual_sdcard": {"path": str(self.folder)}}})
        register = self.printer.register_event_handler
        register("klippy:ready", lambda: reactor.register_callback(self._run_parts))
        register("toolhead:sync_print_time",
                 lambda now, estimate, time: self.sync_times.append(time))
        self.watchdog = reactor.register_timer(
            self._check_start, reactor.monotonic() + START_TIMEOUT)
        self.printer.run()
        reactor.finalize()
        if self.failure is not None:
            raise self.failure
        return self

    def _check_start(self, eventtime):
        message, state = self.printer.get_state_message()
        if state != "ready":
            self._end(PrinterError("The printer is not ready: " + message))
        return self.printer.get_reactor().NEVER

    def _run_parts(self, eventtime):
        try:
            gcode = self.printer.lookup_object("gcode")
            gcode.register_output_handler(self.responses.append)
            for number, part in enumerate(self.parts):
                if number == self.record_from:
                    self.machine.record_steps(True)
                self._run_part(gcode, part)
                self._note_rest()
            self.steps = self.machine.take_steps()
            self._end(None)
        except Exception as e:
            # also what a part asserts: run() raises it
            self._end(e)

    def _run_part(self, gcode, part):
        if isinstance(part, pathlib.Path):
            self._print_file(gcode, part)
        elif callable(part):
            part(self.printer)
        else:
            gcode.run_script(part)
        self.printer.lookup_object("toolhead").wait_moves()
        reactor = self.printer.get_reactor()
        reactor.pause(reactor.monotonic() + 1.)
        if self.printer.is_shutdown():
            raise PrinterError(self.printer.get_state_message()[0])

    def _print_file(self, gcode, path):
        target = self.folder / path.name
        if target != path:
            target.write_bytes(path.read_bytes())
        gcode.run_script('SDCARD_PRINT_FILE FILENAME="%s"' % (path.name,))
        reactor = self.printer.get_reactor()
        stats = self.printer.lookup_object("print_stats")
        while True:
            status = stats.get_status(reactor.monotonic())
            if status["state"] not in ("printing", "standby"):
                break
            reactor.pause(reactor.monotonic() + 0.5)
        if status["state"] != "complete":
            raise PrinterError("print %s: %s" % (status["state"], status["message"]))

    def _note_rest(self):
        toolhead = self.printer.lookup_object("toolhead")
        motion = self.printer.lookup_object("motion_queuing")
        motors = [m for member in motion.members.values() for m in member.steppers]
        self.owners = {m.get_name(): m.get_mcu().get_name() for m in motors}
        self.snapshots.append(Snapshot(
            toolhead.print_time, list(toolhead.get_position()),
            {m.get_name(): m.mcu_to_commanded_position(0) for m in motors},
            self.machine.get_step_counts()))

    def _end(self, failure):
        self.failure = failure
        self.printer.request_exit("exit" if failure is None else "error_exit")

    # What came of it

    def get_steps(self, stepper):
        """(print_time (n,) s, directions (n,)) at the pins.

        Clocks of other mcus become that of the main one by what the world knows.
        """
        table = self.steps[stepper]
        clocks, owner = table[:, 0], self.owners.get(stepper, "mcu")
        if owner != "mcu" and len(clocks):
            clocks = self._convert(clocks, self.machine.mcus[owner])
        return clocks / self.freq, table[:, 1]

    def _convert(self, clocks, mcu):
        """Clocks of an mcu, whose pace is even, as (broken) ones of the main mcu."""
        ends = np.array([clocks[0], clocks[0] + 1000 * int(mcu.freq)])
        times = np.array([mcu.time_at(int(clock)) for clock in ends])
        moments = times[0] + (clocks - ends[0]) * (np.diff(times) / np.diff(ends))
        main = self.machine.mcus["mcu"]
        first = main.clock_at(times[0])
        ends = np.array([first, first + 1000 * int(main.freq)])
        times = np.array([main.time_at(int(clock)) for clock in ends])
        return ends[0] + (moments - times[0]) * (np.diff(ends) / np.diff(times))

    @property
    def freq(self):
        """Clock ticks a second of the main mcu."""
        return self.machine.mcus["mcu"].freq

    def count_late_events(self):
        """Timers that ran late, on all mcus."""
        return sum(m.late_events for m in self.machine.mcus.values())

