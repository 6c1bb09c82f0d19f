# SPDX-License-Identifier: GPL-3.0-or-later
"""Clocks of two boards 400 ppm apart: how far the second is beside the first.

The world knows when each clock shows what, so this is the error of the clocks
alone, without that of compressed steps.
"""
import numpy as np
import pytest
from machine_configs import make_two_mcus
from printer_run import PrinterRun

LIMIT = 20e-6           # s, of 99.9 %
LEADS = (0.1, 0.6, 2.5)  # s ahead of now for which times are converted
SETTLE = 20             # s after the start that are not judged
WARM_UP = 120           # the same on links that jitter
DRIFT = 1. / 60.        # ppm a s: a board that warms up, another that cools down


class Crystals:
    """Two boards' crystals, 400 ppm apart, whose temperature changes."""

    def __init__(self, machine, drift):
        self.boards = [machine.mcus[name] for name in ("mcu", "tool")]
        self.drift, self.start = drift, None

    def note_time(self, now):
        """The temperature is what it is now."""
        self.start = now if self.start is None else self.start
        change = self.drift * (now - self.start)
        for board, sign in zip(self.boards, (1., -1.), strict=True):
            board.set_ppm(sign * (200. + change))


def measure(tmp_path, ppm, seconds, watch=lambda eventtime, printer: None,
            jitter=(0., 0.), settle=SETTLE, drift=0.):
    """Errors (s) of the second board's conversion, ten times a second.

    jitter: s by which bytes are late at random to, from each board.
    drift: ppm a s by which one crystal gains and the other loses.
    """
    run = PrinterRun(make_two_mcus() + "[simulator]\nclock_ppm: %s\n" % ppm, tmp_path)
    crystals = Crystals(run.machine, drift)
    errors = []

    def part(printer):
        reactor = printer.get_reactor()
        main, tool = (printer.lookup_object(name) for name in ("mcu", "mcu tool"))
        boards = crystals.boards
        for board in boards:
            board.link.set_faults(jitter_to=jitter[0], jitter_from=jitter[1])
        start = reactor.monotonic()
        for _ in range(10 * (settle + seconds)):
            now = reactor.pause(reactor.monotonic() + 0.1)
            if drift:
                crystals.note_time(now)
            if now < start + settle:
                continue
            watch(now, printer)
            for lead in LEADS:
                time = main.estimated_print_time(now) + lead
                moment = boards[0].time_at(main.print_time_to_clock(time))
                wrong = tool.print_time_to_clock(time) - boards[1].clock_at(moment)
                errors.append(wrong / boards[1].freq)

    run.run([part])
    return np.abs(errors)


@pytest.mark.parametrize("ppm", ["mcu=200, tool=-200", "mcu=-200, tool=200"])
def test_printer_that_waits(tmp_path, ppm):
    """For ten minutes nothing moves."""
    assert np.percentile(measure(tmp_path, ppm, 600), 99.9) < LIMIT


def make_jitter_cases():
    """Jitter to and from the boards of 1, 3, 10 ms; most of them are slow tests."""
    quick = ((0.001, 0.001), (0., 0.003), (0.01, 0.01))
    for size in (0.001, 0.003, 0.01):
        for case in ((size, size), (size, 0.), (0., size)):
            marks = () if case in quick else pytest.mark.slow
            yield pytest.param(case, marks=marks, id="%g,%g" % case)


@pytest.mark.parametrize("jitter", list(make_jitter_cases()))
def test_links_that_jitter(tmp_path, jitter):
    """Bytes are late at random, temperatures change, the printer moves."""
    errors = measure_moving(tmp_path, jitter, WARM_UP, DRIFT)
    assert np.percentile(errors, 99.9) < LIMIT


@pytest.mark.slow
@pytest.mark.parametrize("jitter", list(make_jitter_cases()))
def test_links_that_jitter_while_nothing_moves(tmp_path, jitter):
    errors = measure(tmp_path, "mcu=200, tool=-200", 300, jitter=jitter,
                     settle=WARM_UP, drift=DRIFT)
    assert np.percentile(errors, 99.9) < LIMIT


def test_printer_that_moves(tmp_path):
    """Moves come and go, and have the clock steered themselves."""
    assert np.percentile(measure_moving(tmp_path), 99.9) < LIMIT


def measure_moving(tmp_path, jitter=(0., 0.), settle=SETTLE, drift=0.):
    """measure() while moves come and go."""
    moved = []

    def move(eventtime, printer):
        if not moved or eventtime > moved[-1] + 8.:
            moved.append(eventtime)
            printer.lookup_object("gcode").run_script("G91\nG1 E20 F600\nG1 E-20")

    errors = measure(tmp_path, "mcu=200, tool=-200", 120, move, jitter, settle, drift)
    assert len(moved) > 10
    return errors
