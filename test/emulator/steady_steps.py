# SPDX-License-Identifier: GPL-3.0-or-later
"""Motors that step steadily, and whether each step came, and when.

Run as a program it tells the shortest interval at which 1 and 3 motors hold out:
python test/emulator/steady_steps.py
"""

import argparse
import os
import pathlib
import tempfile

import numpy as np
import simavr_chip
from simavr_board import AvrBoard, find_pin

PINS = [("PB0", "PB1"), ("PD4", "PD5"), ("PC0", "PC1")]
MAX_COUNT = 0xffff
LEAD_S, QUERY_S = 0.1, 0.05
# How late a step may come when little but steps is done: firmware_avr.md
BOUND_US = {1: 50, 3: 100}
LIMITS = {1: (40, 200), 3: (250, 900)}


class SteadyRun:
    """`n_motors` make a step each `interval` ticks for `seconds`, in step, while
    the console is asked for the state.

    late: per motor, ticks after its time at which each step came.
    missing: steps that did not come.  shutdown: reason or None.
    restarts: times the chip started again.  asked, answered: queries.
    """

    def __init__(self, board, n_motors, interval, seconds):
        self.board, self.interval = board, interval
        self.count = round(seconds * board.freq / interval)
        pins = [[find_pin(board, p) for p in pair] for pair in PINS[:n_motors]]
        board.configure(*[
            ("config_stepper", dict(oid=oid, step_pin=step, dir_pin=dir_pin,
                                    invert_step=0, step_pulse_ticks=0))
            for oid, (step, dir_pin) in enumerate(pins)])
        self.asked = self.answered = 0
        self._queue(n_motors)
        self._watch(seconds)
        self._judge([step for step, _ in pins])

    def _queue(self, n_motors):
        board = self.board
        self.start = board.clock + round(LEAD_S * board.freq)
        for oid in range(n_motors):
            board.send("reset_step_clock", oid=oid, clock=self.start % 2**32)
            for done in range(0, self.count, MAX_COUNT):
                board.send("queue_step", oid=oid, interval=self.interval,
                           count=min(MAX_COUNT, self.count - done), add=0)

    def _watch(self, seconds):
        """Ask now and then until all steps are done, and once more."""
        board = self.board
        end = self.start + round((seconds + 2 * QUERY_S) * board.freq)
        while board.clock < end:
            board.send("debug_read", order=0, addr=0x100)
            self.asked += 1
            board.run_for(QUERY_S)

    def _judge(self, step_pins):
        board = self.board
        self.shutdown = board.find_shutdown()
        self.restarts = len(board.list_messages("starting"))
        self.answered = len(board.list_messages("debug_result"))
        due = self.start + self.interval * np.arange(1, self.count + 1)
        self.late, self.missing = [], 0
        for pin in step_pins:
            made = np.array([c for c, p, level in board.edges
                             if p == pin and level], dtype=np.int64)
            self.missing += self.count - len(made)
            self.late.append(made - due[:len(made)])

    def find_failure(self, bound_us):
        """What went wrong, in words, or None: a step later than `bound_us` or
        not made, a shutdown, a restart, silence."""
        bound = bound_us * self.board.freq // 1000000
        latest = max((int(late.max()) for late in self.late if len(late)),
                     default=0)
        earliest = min((int(late.min()) for late in self.late if len(late)),
                       default=0)
        faults = [
            (self.shutdown, "shutdown: %s" % (self.shutdown,)),
            (self.restarts, "%d restarts" % (self.restarts,)),
            (self.missing, "%d steps missing" % (self.missing,)),
            (latest > bound, "a step %d ticks late" % (latest,)),
            (earliest < 0, "a step %d ticks early" % (-earliest,)),
            (self.answered < self.asked,
             "%d of %d questions answered" % (self.answered, self.asked))]
        return "; ".join(text for bad, text in faults if bad) or None


def find_shortest(adapter, n_motors, low, high):
    """The shortest interval, in ticks, at which nothing fails for 2 s."""
    while high - low > 1:
        middle = (low + high) // 2
        run = SteadyRun(AvrBoard(adapter), n_motors, middle, 2.0)
        failure = run.find_failure(BOUND_US[n_motors])
        print("%d motors, %d ticks: %s" % (n_motors, middle, failure or "good"))
        if failure:
            low = middle
        else:
            high = middle
    return high


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--chip", default="atmega2560")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        adapter = simavr_chip.build_adapter(folder)
        elf = simavr_chip.build_firmware(folder, args.chip)
        os.environ.update(simavr_chip.list_settings(elf, args.chip))
        found = [(n, find_shortest(adapter, n, *limits))
                 for n, limits in LIMITS.items()]
    for n, ticks in found:
        print("%d motors: %d ticks" % (n, ticks))


if __name__ == "__main__":
    main()
