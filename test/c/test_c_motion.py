# SPDX-License-Identifier: GPL-3.0-or-later
"""The motion half of the host's C core alone, under sanitizers."""

import re

from test_c_io import MEMORY, compile_test, run

MOTION = ["msgblock", "qmsg", "trapq", "itersolve", "polysolve", "kin_linear",
          "kin_delta", "kin_deltesian", "kin_extruder", "advancebend", "advancelist",
          "kin_polar", "kin_rotary_delta", "kin_winch", "runfit", "runline",
          "shaper", "shaperfit", "stephist", "stepcompress", "steppersync"]
WRAP = ["-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc"]


def test_a_print_and_every_allocation_that_fails_in_it(tmp_path):
    """Nothing leaks, nothing is used after an error: the sanitizer tells."""
    program = compile_test(tmp_path, "motion_story.c", MOTION, [*MEMORY, *WRAP])
    output = run(program, "97")
    messages, allocations, failed = map(int, re.findall(r"\d+", output))
    assert messages > 1000 and allocations > messages and failed > 200
