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


class SimSession:
    """Runs one job; run() returns the process's exit status."""

    def __init__(self, options, stream, printer_class):
        self.options = options
        self.printer_class = printer_class
        self.stream = stream
        self.display = progress.ProgressDisplay(stream)
        self.result = None
        self.printer = self.machine = self.reactor = self.recorder = None
        self.wall_start = time.monotonic()

    def run(self):
        """Print the job and show what came of it; 0, or 1 on any failure."""
        self._check_files()
        if self.options.report:
            report.load_plotting()
        self._build_machine(load_sections(self.options.config))
        self._run_printer()
        return 0 if self.result is not None and self.result.is_ok else 1

    def _check_files(self):
        for path in (self.options.config, self.options.job):
            if not os.path.isfile(path):
                raise PrinterError("There is no file '%s'" % (path,))

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

    def _run_printer(self):
        """Run printers until one exits; RESTART starts the next."""
        reason = "startup"
        while True:
            if self.options.speed:
                self.reactor.set_pace(self.options.speed)
            self.printer = self.printer_class(
                self.reactor, None, self._make_start_args(reason))
            if self.result is None:
                job_module.SimJob(self.printer, self.machine, self.options.job,
                                  self.display, self.recorder, self._finish)
            reason = self.printer.run()
            if reason in EXIT_RESULTS:
                break
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
            writer = report.ReportWriter(self.options.report, self.recorder)
            page = writer.write(os.path.basename(self.options.job), rows)
            self.display.write_message("Report: %s" % (page,))
        if self.options.api_server and result.is_ok:
            self.display.write_message(
                "Serving the API socket %s; press Ctrl-C to end"
                % (self.options.api_server,))
            return
        self.printer.request_exit("exit" if result.is_ok else "error_exit")


def load_sections(path):
    """{section: {option: text}} of a printer.cfg with all it includes."""
    from klippy.configtext import ConfigReader
    store = ConfigReader().read(path)
    return {name: dict(store.items(name)) for name in store.sections()}
