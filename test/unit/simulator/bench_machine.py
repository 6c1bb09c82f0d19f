# SPDX-License-Identifier: GPL-3.0-or-later
"""A printer without motion on the simulated machine with real firmware.

Heaters, fans and pins need nothing of the motion but its clock; this bench
has that clock and no more, so that a fault of theirs shows alone.
"""
import types

from klippy import printer as printer_module
from klippy.configtext import ConfigReader
from klippy.printer import Printer
from klippy.reactor import Reactor
from klippy.simulator.machine import SimMachine
from klippy_ext.vworld import VirtualWorld


class Clockwork:
    """Toolhead and motion queue of a machine that never moves."""

    def __init__(self, printer):
        self.printer = printer
        self.reactor = printer.get_reactor()
        self.flush_callbacks = []
        printer.register_event_handler("klippy:ready", self._handle_ready)

    def _handle_ready(self):
        self.reactor.register_timer(self._flush, self.reactor.NOW)

    def _flush(self, eventtime):
        flush_time = self._now() + 0.3
        for callback in self.flush_callbacks:
            callback(flush_time, flush_time)
        return eventtime + 0.1

    def _now(self):
        mcu = self.printer.lookup_object("mcu")
        return mcu.estimated_print_time(self.reactor.monotonic())

    def get_last_move_time(self):
        return self._now() + 0.25

    def register_lookahead_callback(self, callback):
        callback(self.get_last_move_time())

    def register_flush_callback(self, callback):
        self.flush_callbacks.append(callback)

    def note_mcu_movequeue_activity(self, print_time):
        pass


class Bench:
    """One machine and, run after run, printers on it."""

    def __init__(self, tmp_path, monkeypatch, config, seed=1):
        path = tmp_path / "printer.cfg"
        path.write_text(config)
        store = ConfigReader().read(str(path))
        sections = {n: dict(store.items(n)) for n in store.sections()}
        self.world = VirtualWorld(seed=seed)
        self.machine = SimMachine(self.world, sections, seed)
        self.start_args = {
            "config_file": str(path), "start_reason": "startup",
            "software_version": "v0.1.0", "machine": self.machine}
        module = types.SimpleNamespace(add_printer_objects=self._add_clockwork)
        monkeypatch.setattr(printer_module, "LAST_MODULES", (module,))
        self.printer = None
        self.output = []
        self.make = lambda config: None

    def _add_clockwork(self, config):
        printer = config.get_printer()
        clockwork = Clockwork(printer)
        printer.add_object("toolhead", clockwork)
        printer.add_object("motion_queuing", clockwork)
        self.make(config)
        if config.has_section("printer"):
            for option in ("kinematics", "max_velocity", "max_accel"):
                config.getsection("printer").get(option, None)

    def run(self, body):
        """Start a printer, call body(bench) when it is up, end it."""
        reactor = Reactor(self.world)
        self.printer = Printer(reactor, None, self.start_args)
        gcode = self.printer.lookup_object("gcode")
        gcode.register_output_handler(self.output.append)
        errors = []

        def follow(eventtime):
            while self.printer.state == "startup":
                reactor.pause(reactor.monotonic() + 0.1)
            try:
                body(self)
            except BaseException as e:
                errors.append(e)
            self.printer.request_exit("exit")

        reactor.register_callback(follow)
        try:
            self.printer.run()
        finally:
            reactor.finalize()
        if errors:
            raise errors[0]

    def send(self, script):
        """Run G-code."""
        self.printer.lookup_object("gcode").run_script(script)

    def pause(self, seconds):
        """Let virtual time pass."""
        reactor = self.printer.get_reactor()
        reactor.pause(reactor.monotonic() + seconds)

    def get(self, name):
        """Status of a printer object."""
        now = self.printer.get_reactor().monotonic()
        return self.printer.lookup_object(name).get_status(now)
