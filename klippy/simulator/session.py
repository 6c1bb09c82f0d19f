# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole simulated run: world, machine, printer, job, summary and report."""
import os
import time
from dataclasses import dataclass

from klippy import sysinfo
from klippy.errors import PrinterError
from klippy.reactor import Reactor
from klippy.simulator import job as job_module
from klippy.simulator import machine as machine_module
from klippy.simulator import progress, recorder, report, summary

# Sections that a job needs, added when the config lacks them.
IMPLICIT_SECTIONS = ("virtual_sdcard", "pause_resume", "display_status",
                     "exclude_object")
EXIT_RESULTS = ("exit", "error_exit")


@dataclass
class SessionOptions:
    """What the command line asks for."""

    config: str
    job: str
    speed: float = 0.0
    seed: int | None = None
    report: str | None = None
    api_server: str | None = None
    log_file: str | None = None
    web_port: int | None = None

    @property
    def is_served(self):
        """True if people may use the printer, and go on after the print."""
        return self.api_server is not None or self.web_port is not None


class SimSession:
    """Runs one job; run() returns the process's exit status."""

    def __init__(self, options, stream, printer_class):
        self.options = options
        self.printer_class = printer_class
        self.stream = stream
        self.display = progress.ProgressDisplay(stream)
        self.result = None
        self.printer = self.machine = self.reactor = self.recorder = None
        self.web = None
        self.wall_start = time.monotonic()
        self.is_report_lost = False

    def run(self):
        """Print the job and show what came of it; 0, or 1 on any failure."""
        self._check_files()
        if self.options.report:
            report.load_plotting()
        self._build_machine(load_sections(self.options.config))
        try:
            self._serve_page()
            self._run_printer()
        finally:
            if self.web is not None:
                self.web.close()
        is_ok = self.result is not None and self.result.is_ok
        return 0 if is_ok and not self.is_report_lost else 1

    def _check_files(self):
        for path in (self.options.config, self.options.job):
            if not os.path.isfile(path):
                raise PrinterError("There is no file '%s'%s" % (
                    path, ": it is a folder" if os.path.isdir(path) else ""))
        try:
            if self.options.report:
                os.makedirs(self.options.report, exist_ok=True)
        except OSError as err:
            raise PrinterError("Unable to make the folder '%s' for the report: %s"
                               % (self.options.report, err.strerror))

    def _build_machine(self, sections):
        from klippy_ext.vworld import VirtualWorld

        seed = self.options.seed
        if seed is None:
            seed = machine_module.read_seed(sections)
        self.world = VirtualWorld(seed=seed)
        self.machine = machine_module.SimMachine(self.world, sections, seed)
        self.reactor = Reactor(self.world)
        if self.options.report:
            heaters = [h.name for h in self.machine.thermal.heaters]
            self.recorder = recorder.Recorder(self.machine, heaters)

    def _serve_page(self):
        if self.options.web_port is None:
            return
        from klippy.simulator.web.feed import Feed
        from klippy.simulator.web.server import WebServer
        try:
            self.web = WebServer(Feed(), self.options.web_port)
        except OSError as err:
            raise PrinterError("Unable to serve port %d: %s. Use --web with another one"
                               % (self.options.web_port, err.strerror))
        self.options.speed = self.options.speed or 1.
        self.display.write_message("The printer is shown at %s" % (self.web.url,))

    def _run_printer(self):
        """Run printers until one exits; RESTART starts the next."""
        reason = "startup"
        while True:
            if self.options.speed:
                self.reactor.set_pace(self.options.speed)
            self.printer = self.printer_class(
                self.reactor, None, self._make_start_args(reason))
            if self.web is not None:
                self.web.attach(self.printer)
            if self.result is None:
                job_module.SimJob(self.printer, self.machine, self.options.job,
                                  self.display, self.recorder, self._finish,
                                  self.options.is_served)
            reason = self.printer.run()
            if reason in EXIT_RESULTS:
                break
            if self.web is not None:
                self.web.detach()
            self.reactor.finalize()
            self.reactor = Reactor(self.world)

    def _make_start_args(self, reason):
        folder = os.path.dirname(os.path.abspath(self.options.job))
        implicit = {name: {} for name in IMPLICIT_SECTIONS}
        implicit["virtual_sdcard"] = {"path": folder}
        args = {"config_file": os.path.abspath(self.options.config),
                "start_reason": reason, "implicit_sections": implicit,
                "machine": self.machine, "log_file": self.options.log_file,
                "software_version": sysinfo.get_version(),
                "cpu_info": sysinfo.get_cpu_info()}
        if self.options.api_server:
            args["apiserver"] = self.options.api_server
        return args

    def _finish(self, result):
        self.result = result
        wall = time.monotonic() - self.wall_start
        rows = summary.collect(self.machine, self.printer, result, wall)
        self.display.write_message(summary.format_rows(result, rows))
        if self.recorder is not None:
            self._write_report(rows)
        if self.options.is_served and (result.is_ok or self.web is not None):
            served = ([self.web.url] if self.web is not None else []) + (
                ["the API socket " + self.options.api_server]
                if self.options.api_server else [])
            self.display.write_message("Serving %s; press Ctrl-C to end"
                                       % (" and ".join(served),))
            return
        self.printer.request_exit("exit" if result.is_ok else "error_exit")

    def _write_report(self, rows):
        try:
            writer = report.ReportWriter(self.options.report, self.recorder)
            page = writer.write(os.path.basename(self.options.job), rows)
        except OSError as err:
            self.is_report_lost = True
            self.display.write_message("The report in '%s' is not complete: %s" % (
                self.options.report, err.strerror))
            return
        self.display.write_message("Report: %s" % (page,))


def load_sections(path):
    """{section: {option: text}} of a printer.cfg with all it includes."""
    from klippy.configtext import ConfigReader
    store = ConfigReader().read(path)
    return {name: dict(store.items(name)) for name in store.sections()}
