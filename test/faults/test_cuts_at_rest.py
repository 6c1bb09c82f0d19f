# SPDX-License-Identifier: GPL-3.0-or-later
"""The cable is out for 0.3 s just when motion starts from rest, or ends in it.

Amid moves seconds of them wait in the board.  Here the host decides how many.
"""
import numpy as np
import pytest
from machine_configs import BED, make_axes
from printer_run import PrinterRun

HOME = "G28\nG90\nM83\nM104 S0\nG1 X10 Y10 Z5 F6000\nM400"
CUT = 0.3               # s
BLIP = 0.15             # s: what a single move withstands while it starts
PERIOD = 10.            # s from one part to the next
TRAVELS = "\n".join("G1 X%d F3000\nG1 Y%d" % (10 + i % 2 * 20, 10 + i % 2 * 20)
                    for i in range(1, 7))
DENSE = "\n".join("G1 X%.2f Y%.2f F3000" % (10 + i % 20, 10 + (i % 7))
                  for i in range(1, 120))
JOG = "G1 X30 F3000\nG1 X10"
SHORT = "G1 X12 F3000\nG1 X10"
STARTS = np.arange(-0.32, 0.6, 0.04)


def count_steps(tmp_path, text, phases, seconds):
    """Total steps of each motor after each part: text with a cut in it.

    phases: s from the moment that the text is given to the host to the cut.
    """
    run = PrinterRun(make_axes("cartesian", extra=BED), tmp_path)
    counts = []

    def make_part(phase):
        def part(printer):
            reactor, link = printer.get_reactor(), run.machine.mcus["mcu"].link
            begin = reactor.monotonic() + 1.

            def cut(eventtime):
                link.cut()
                reactor.pause(eventtime + seconds)
                link.restore()
                return reactor.NEVER

            timer = reactor.register_timer(cut, begin + phase)
            reactor.pause(begin)
            printer.lookup_object("gcode").run_script(text)
            reactor.pause(begin + PERIOD)
            reactor.unregister_timer(timer)
            counts.append(run.machine.get_total_steps())
        return part

    run.run([HOME, make_part(-1.), *map(make_part, phases)])
    return counts


def check(counts):
    """Each part made the same steps."""
    totals = np.array([[count[name] for name in sorted(count)] for count in counts])
    ways = np.diff(totals, axis=0)
    assert ways.any() and (ways == ways[0]).all()


@pytest.mark.parametrize("text", [TRAVELS, DENSE], ids=["travels", "dense"])
def test_moves_that_stream_in(tmp_path, text):
    check(count_steps(tmp_path, text, STARTS, CUT))


@pytest.mark.parametrize("end", ["M400", "G4 P1"])
def test_end_of_motion(tmp_path, end):
    check(count_steps(tmp_path, TRAVELS + "\n" + end, np.arange(4.4, 6.2, 0.06), CUT))


def test_end_of_motion_that_nobody_waits_for(tmp_path):
    check(count_steps(tmp_path, TRAVELS, np.arange(4.4, 6.2, 0.06), CUT))


@pytest.mark.parametrize("text", [JOG, SHORT + "\nM400"], ids=["jog", "short"])
def test_single_moves(tmp_path, text):
    """They start sooner, for somebody waits for them."""
    check(count_steps(tmp_path, text, STARTS, BLIP))
