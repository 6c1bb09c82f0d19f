# SPDX-License-Identifier: GPL-3.0-or-later
"""A printer's life in fast motion: `make soak`, or python test/soak/soak.py.

The daemon, with its log file, its API socket and the firmware of two boards, lives
on a simulated machine for hours of virtual time.  It prints job after job; users,
clients, links, boards, sensors and disks do what they do (soak_faults.py).  In the
end memory, descriptors and threads must be what they were after the warm-up, every
line of error in the log explained by what was done, and every job that nobody ended
complete, with the machine exactly where the file says.
"""
import argparse
import collections
import itertools
import logging
import os
import pathlib
import random
import signal
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
for folder in (ROOT, ROOT / "test", ROOT / "test" / "faults"):
    sys.path.insert(0, str(folder))

import greenlet  # noqa: E402
import soak_faults  # noqa: E402
import soak_report  # noqa: E402
from daemon_run import ApiError, Client, Host  # noqa: E402
from machine_configs import BED, make_axes  # noqa: E402
from soak_gauges import Gauges  # noqa: E402
from soak_jobs import make_job  # noqa: E402
from soak_log import LogJudge  # noqa: E402

from klippy import waiter  # noqa: E402

SECTIONS = """
[virtual_sdcard]
path: %(folder)s/gcodes
[save_variables]
filename: %(folder)s/variables/variables.cfg
[pause_resume]
[display_status]
[exclude_object]
[firmware_retraction]
[gcode_arcs]
[respond]
[print_recovery]
[idle_timeout]
timeout: 7200
[temperature_fan box]
pin: PG0
sensor_type: EPCOS 100K B57560G104F
sensor_pin: PG1
min_temp: 0
max_temp: 90
control: curve
min_speed: 0
target_temp: 60
points: 30, 0.1
[heater_fan nozzle]
pin: tool:PE7
[gcode_macro NOTE]
gcode:
    RESPOND MSG="{ params.N }"
[gcode_macro REFUSE]
gcode:
    { action_raise_error("no filament is loaded") }
[mcu tool]
serial: /dev/null
"""
# What a job of each length may take on top: heating, pauses, waits (s)
EXTRA_TIME = 3000.
SETTLED = 1.0               # s
LOG_BYTES = 4 << 20         # of a log file, so that it is rotated often
POSITION_TOLERANCE = 0.02   # mm: less than two steps
GROWTH_MB = 2.0             # from the second quarter to the last
# At any time: told once by slicers' files, and what a restart says
ALWAYS = ("M201|M203|M205|M141|M191|M900", "overridden by the value",
          "interrupted print|RESUME_INTERRUPTED", "log lines were lost")


def make_config(folder):
    """Text of the printer.cfg; the folders it names are made."""
    for name in ("gcodes", "variables"):
        (folder / name).mkdir()
    main, _, rest = make_axes("cartesian", 0.04, BED).partition("[extruder]")
    extruder, mark, bed = rest.partition("[heater_bed]")
    extruder = extruder.replace(": PE", ": tool:PE").replace(
        "control: watermark", "control: pid\npid_kp: 22.2\npid_ki: 1.08\npid_kd: 114")
    return (main + "[extruder]" + extruder + mark + bed
            + SECTIONS % {"folder": folder})


class Soak(Host):
    """The daemon, its machine, and all that befalls them."""

    def __init__(self, folder, hours, n_jobs, seed, progress=print):
        folder = pathlib.Path(folder)
        super().__init__(folder, make_config(folder),
                         ["-l", str(folder / "klippy.log")])
        self.draw = random.Random(seed)
        self.slot = hours * 3600. / n_jobs
        self.n_jobs, self.number = n_jobs, 0
        self.progress = progress
        self.gauges, self.judge = Gauges(), LogJudge(ALWAYS)
        self.n_told = 0
        self.outcomes = collections.Counter()
        self.deeds = collections.Counter()
        self.faults = []            # what must not be
        self.n_refused = 0
        self.expected_state = "ready"
        self.wall_start = time.monotonic()
        self.story = self._tell()
        self.terminal_seen = 0

    # The loop

    def _open_log(self):
        super()._open_log()
        self.bglogger.output.max_bytes = LOG_BYTES
        logging.getLogger().addHandler(self.judge)

    def live(self):
        """Run to the end; returns the list of faults."""
        status = self.run()
        logging.getLogger().removeHandler(self.judge)
        self.client.close()
        if status:
            self.faults.append("the daemon ended with status %d" % status)
        if self.number < self.n_jobs:
            self.faults.append("only %d of %d jobs were begun"
                               % (self.number, self.n_jobs))
        self.faults += ["unexplained in %s: %s" % pair
                        for pair in self.judge.unexplained]
        self.faults += self.gauges.find_growth(GROWTH_MB)
        return self.faults

    def _run_printer(self, reactor):
        if self.client is not None:
            self.client.close()
        # nothing of the soak's own may hold what was before
        self.reactor, self.client = reactor, None
        self.gauges.note_boot()
        return super()._run_printer(reactor)

    def _follow(self, eventtime):
        if self.client is not None:
            self.client.close()
        self.client, self.terminal_seen = Client(self.socket_path, self.reactor), 0
        try:
            while self.info()["state"] == "startup":
                self.pause(0.1)
            if self.info()["state"] != self.expected_state:
                self.fail("the printer is not %s: %s" % (
                    self.expected_state, self.info()["state_message"]))
            request = next(self.story, None)
            if request is not None:
                self._restart(request)
                return
        except greenlet.GreenletExit:
            return
        except BaseException as err:
            self.fail("%s: %r" % (type(err).__name__, err))
            logging.exception("the soak ends")
        os.kill(os.getpid(), signal.SIGTERM)

    def _restart(self, request):
        if request == "SAVE_CONFIG":
            self.client.send("gcode/script", script=request)
        else:
            self.client.send(request)

    def _tell(self):
        """Do job after job; yields requests that restart the printer."""
        start = self.reactor.monotonic()
        deeds = self._choose_deeds()
        for number in range(1, self.n_jobs + 1):
            self.number = number
            job = make_job(self.draw, self.number, self.draw.uniform(0.2, 0.6) * 400.)
            deed = next(deeds)
            self.judge.begin("job %d, %s" % (self.number, deed.name), deed.patterns)
            yield from self._do(deed, job)
            self.judge.end()
            self.progress("%s %s" % (self.describe(), deed.name))
            wait = start + self.number * self.slot - self.reactor.monotonic()
            if wait > 0.:
                self.pause(wait)

    def _choose_deeds(self):
        """All of them in turns, in random order, each as often as its weight."""
        while True:
            pack = list(itertools.chain.from_iterable(
                [deed] * int(deed.weight) for deed in soak_faults.DEEDS))
            self.draw.shuffle(pack)
            yield from pack

    def _do(self, deed, job):
        self.deeds[deed.name] += 1
        job.write(self.folder / "gcodes")
        self.script("SDCARD_PRINT_FILE FILENAME=" + job.name)
        try:
            outcome = yield from deed.run(self, job)
        except (AssertionError, ApiError) as err:
            self.fail(str(err))
            outcome = "failed"
            yield from self._recover()
        self.outcomes[outcome] += 1
        self._read_terminal()
        self.pause(SETTLED)
        self.gauges.note_job(self.number, self.reactor.monotonic())

    def _recover(self):
        self.expected_state = "ready"
        yield soak_faults.FIRMWARE_RESTART

    def fail(self, text):
        """Note what must not be."""
        fault = "%s: %s" % (self.judge.step, text)
        self.faults.append(fault)
        self.progress("FAULT " + fault)

    def _tell_unexplained(self):
        for step, text in self.judge.unexplained[self.n_told:]:
            self.progress("UNEXPLAINED %s: %s" % (step, text))
        self.n_told = len(self.judge.unexplained)

    def describe(self):
        """One line of progress."""
        self._tell_unexplained()
        reading = self.gauges.at_jobs[-1]
        return "%4d/%d  %5.2f h  %4.0f s  rss %5.1f MB  fds %d  faults %d " % (
            self.number, self.n_jobs, reading[1] / 3600.,
            time.monotonic() - self.wall_start, reading[2] / 1024., reading[3],
            len(self.faults) + len(self.judge.unexplained))

    # What deeds use

    def job_state(self):
        return self.status("print_stats")["state"]

    def wait_for_job(self):
        """Until the job is complete.  AssertionError if it ends otherwise."""
        deadline = self.reactor.monotonic() + EXTRA_TIME
        while self.reactor.monotonic() < deadline:
            status = self.status("print_stats")
            if status["state"] != "printing":
                break
            self.pause(0.5)
        self._read_terminal()
        assert status["state"] == "complete", "not complete: %s" % (status,)

    def wait_for_state(self, state, limit):
        """Until the printer is in a state.  AssertionError after a limit (s)."""
        deadline = self.reactor.monotonic() + limit
        while self.info()["state"] != state:
            assert self.reactor.monotonic() < deadline, "it does not come to '%s'" % (
                state,)
            self.pause(0.1)

    def check_end(self, job):
        """The machine itself must stand where the file ends."""
        self.script("M400")
        self.pause(SETTLED)
        place = self.machine.calc_position()
        for axis, wanted in job.end.items():
            real = place["XYZ".index(axis)]
            assert abs(real - wanted) < POSITION_TOLERANCE, (
                "%s stands at %.4f, not %.4f" % (axis, real, wanted))

    def find_heater(self, name):
        return next(h for h in self.machine.thermal.heaters if h.name == name)

    def flush_log(self):
        """Wait for the thread that writes the log."""
        while not self.bglogger.lines.empty():
            time.sleep(0.001)

    def _read_terminal(self):
        """Errors on the terminal need an explanation too."""
        texts = self.output[self.terminal_seen:]
        self.terminal_seen = len(self.output)
        for text in texts:
            if text.startswith("!!"):
                self.judge.judge(text)


def run(folder, hours, n_jobs, seed, report=None, progress=print):
    """A whole soak; returns its faults.  report: file of plots, or None."""
    # the socket is looked at in every round, whatever the clock of the wall says
    waiter.POLL_INTERVAL = 0.
    soak = Soak(folder, hours, n_jobs, seed, progress)
    faults = soak.live()
    progress(soak_report.make_summary(soak))
    if report:
        soak_report.plot(soak.gauges, report)
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--hours", type=float, default=24.)
    parser.add_argument("--jobs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--report", help="file of plots (PNG or SVG)")
    parser.add_argument("--folder", help="an empty folder, kept (a temporary one)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="klippy-soak-") as temporary:
        faults = run(options.folder or temporary, options.hours, options.jobs,
                     options.seed, options.report,
                     lambda text: print(text, flush=True))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
