# SPDX-License-Identifier: GPL-3.0-or-later
"""The step bench on the two PRUs of an AM335x, cycle by cycle."""

import firmware_matrix
import pru_board
from step_bench import NOPS, TRIES, Bench, Environment, Line

MOTORS = (("gpio0_30", "gpio1_28"), ("gpio0_26", "gpio1_29"), ("gpio1_17", "gpio2_1"))
LINE = Line("pru", "PRU, both", 0, MOTORS, field=(231, 847))
why_not = pru_board.why_not
build_adapter = pru_board.build_adapter


class PruBench(Bench):
    """The link is memory: what it takes is the processors' own time."""

    longest = 256

    def power_on(self):
        pru_board.choose_chip(Environment(), firmware_matrix.build(self.line.config))
        board = pru_board.PruBoard(self.adapter)
        board.identify()
        return board, board.find_pin

    def measure_nop(self):
        """Cycles of a debug_nop, from the block's coming to its acknowledgement."""
        board = self.board
        nop = board.commands["debug_nop"].encode({})
        n_nops, spent = NOPS // len(nop), 0
        for _ in range(TRIES):
            begin = board.clock
            board.send_block(nop * n_nops)
            spent += board.blocks[-1][0] - begin
        return spent / (TRIES * n_nops)
