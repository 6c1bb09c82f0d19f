# SPDX-License-Identifier: GPL-3.0-or-later
"""Print what steps, commands and interrupts cost, a line a family of chips.

  step       instructions of an interrupt that makes one step: least, mean
  one three  shortest interval, in ticks of the chip's clock, at which so many
             motors make 60,000 steps each, every edge within 25 us of its clock
  aim        15 % less than what the field is known for
  nop/s      debug_nop commands that the processor could carry out
  off, irq   longest time that interrupts wait: while they are off; for another
             (cycles, and us)

A Cortex-M takes one cycle an instruction here, twelve to enter an interrupt;
memory does not wait.  AVR chips and PRUs count every cycle.  Of the linux
process it is this computer's processor time that counts.
"""

import argparse
import pathlib
import platform
import sys
import tempfile

TEST = pathlib.Path(__file__).resolve().parents[1]
sys.path += [str(TEST), str(TEST / "firmware")]
import linux_bench  # noqa: E402
import pru_bench  # noqa: E402
import step_bench  # noqa: E402
import unicorn_board  # noqa: E402

HEAD = ("chip", "core", "MHz", "step", "one", "three", "aim", "nop/s", "off", "irq")
FORM = "%-16s %-15s %5s %10s %5s %5s %9s %9s %12s %12s"


def format_aim(field):
    """Ticks of one and three motors that are 15 % less."""
    return "%d/%d" % tuple(0.85 * ticks for ticks in field) if field else "-"


def format_wait(cycles, mhz):
    return "%d %.1fus" % (cycles, cycles / mhz)


def measure_arm(line, adapter):
    """One row of the table."""
    bench = step_bench.Bench(line, adapter)
    off, irq = (format_wait(c, bench.mhz) for c in bench.measure_delays())
    step = "%d %.1f" % bench.measure_step()
    nop = "%.2fM" % (bench.mhz / bench.measure_nop(),)
    return (line.config, line.core, "%.0f" % bench.mhz, step,
            bench.find_shortest(1), bench.find_shortest(3),
            format_aim(line.field), nop, off, irq)


def measure_avr(line, adapter):
    bench = step_bench.AvrBench(line, adapter)
    off, irq = (format_wait(c, bench.mhz) for c in bench.measure_delays())
    return (line.config, line.core, "%.0f" % bench.mhz, "-",
            bench.find_shortest(1), bench.find_shortest(3),
            format_aim(line.field), "%.3fM" % (bench.mhz / bench.measure_nop(),),
            off, irq)


def measure_pru(line, adapter):
    bench = pru_bench.PruBench(line, adapter)
    return (line.config, line.core, "%.0f" % bench.mhz, "-",
            bench.find_shortest(1), bench.find_shortest(3),
            format_aim(line.field), "%.2fM" % (bench.mhz / bench.measure_nop(),),
            "-", "-")


def measure_linux(line, adapter):
    del adapter
    nop = "%.0fM" % (1e-6 / linux_bench.measure_nop(),)
    return (line.config, line.core, "-", "-", "-", "-", "-", nop, "-", "-")


LINUX = step_bench.Line("linux", platform.machine(), 0, ())
# (lines, how to measure one, what makes the adapter that it needs)
KINDS = ((step_bench.LINES, measure_arm, unicorn_board.build_adapter),
         (step_bench.AVR_LINES, measure_avr, step_bench.build_avr_adapter),
         ((pru_bench.LINE,), measure_pru, pru_bench.build_adapter),
         ((LINUX,), measure_linux, lambda folder: None))


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("configs", nargs="*", help="of test/configs; default all")
    chosen = parser.parse_args().configs
    print(FORM % HEAD, flush=True)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for lines, measure, build in KINDS:
            lines = [n for n in lines if not chosen or n.config in chosen]
            if lines and lines[0] is pru_bench.LINE and pru_bench.why_not():
                print("pru: " + pru_bench.why_not())
            elif lines:
                adapter = build(folder)
                for line in lines:
                    print(FORM % measure(line, adapter), flush=True)


if __name__ == "__main__":
    main()
