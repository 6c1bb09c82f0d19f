# SPDX-License-Identifier: GPL-3.0-or-later
"""A printer that has only mcus, on the real simulator firmware, in virtual time."""

import types

from klippy import printer as printer_module
from klippy.printer import Printer
from klippy.reactor import Reactor
from klippy.simulator import firmware
from klippy_ext.vworld import VirtualWorld

MAIN_CONFIG = "[mcu]\nserial: /dev/none\n"


class Machine:
    """Virtual mcus by name, as start_args["machine"] offers them."""

    def __init__(self, ppm=None, seed=1, **options):
        self.world = VirtualWorld(seed=seed)
        self.library = firmware.find_firmware()
        self.mcus = {}
        self.configured = []
        for name, error in (ppm or {"mcu": 0.}).items():
            self.mcus[name] = self.world.add_mcu(
                name, self.library, ppm=error, seed=seed + len(self.mcus), **options)

    def open_link(self, name):
        return self.mcus[name]

    def get_pin_map(self, name):
        return {"PX%d" % (i,): i for i in range(16)}

    def note_configured(self, name, config_cmds):
        self.configured.append(name)


class Bench:
    """Runs printers one after the other on one machine."""

    def __init__(self, tmp_path, monkeypatch, config=MAIN_CONFIG, machine=None,
                 **start_args):
        path = tmp_path / "printer.cfg"
        path.write_text(config)
        self.machine = machine if machine is not None else Machine()
        self.start_args = dict({
            "config_file": str(path), "start_reason": "startup",
            "software_version": "v0.1.0", "machine": self.machine}, **start_args)
        self.printer = None
        self.objects = types.SimpleNamespace()
        module = types.SimpleNamespace(add_printer_objects=self._make_objects)
        monkeypatch.setattr(printer_module, "LAST_MODULES", (module,))
        self.make = None
        self.error = None

    def _make_objects(self, config):
        if self.make is not None:
            self.make(config, self.objects)

    def run(self, body, make=None):
        """Run a printer; body(bench) gets called once it is past its start.

        make(config, objects) creates what the body uses.  Returns how the
        printer ended; what the body raised is raised.
        """
        self.make, self.error = make, None
        reactor = Reactor(self.machine.world)
        self.printer = Printer(reactor, None, self.start_args)

        def follow(eventtime):
            while self.printer.state == "startup":
                reactor.pause(reactor.monotonic() + 0.1)
            try:
                body(self)
            except BaseException as err:
                self.error = err
            self.printer.request_exit("exit")

        reactor.register_callback(follow)
        try:
            result = self.printer.run()
        finally:
            reactor.finalize()
        if self.error is not None:
            raise self.error
        self.start_args["start_reason"] = result
        return result

    @property
    def mcu(self):
        return self.printer.lookup_object("mcu")

    @property
    def state(self):
        return self.printer.state

    @property
    def message(self):
        return self.printer.state_message

    def pause(self, seconds):
        """Let virtual time pass."""
        reactor = self.printer.get_reactor()
        return reactor.pause(reactor.monotonic() + seconds)

    def print_time(self, ahead=0.):
        """print_time of now, or of ahead s from now."""
        now = self.printer.get_reactor().monotonic()
        return self.mcu.estimated_print_time(now) + ahead
