# SPDX-License-Identifier: GPL-3.0-or-later
"""The motion half of the host's C core alone, under sanitizers."""

import re

import pytest
from test_c_io import MEMORY, WRAP, compile_test, run

MOTION = ["arcfit", "msgblock", "qmsg", "trapq", "itersolve", "polysolve", "kin_linear",
          "kin_delta", "kin_deltesian", "kin_extruder", "advancebend", "advancelist",
          "driveplan",
          "kin_polar", "kin_rotary_delta", "kin_winch", "kinkpath", "polyemit",
          "reply", "runcurve", "runfit", "runline", "runtrack", "shaper",
          "shapercore", "shaperfit", "stepbatch", "stephist", "stepcompress",
          "steppersync", "steppool"]


@pytest.mark.parametrize("slab, step", [(1, 197), (32, 7)])
def test_a_print_and_every_allocation_that_fails_in_it(tmp_path, slab, step):
    """Nothing leaks, nothing is used after an error: the sanitizer tells."""
    program = compile_test(tmp_path, "motion_story.c", MOTION,
                           [*MEMORY, *WRAP, "-DQMSG_SLAB=%d" % (slab,)])
    output = run(program, str(step))
    messages, allocations, failed = map(int, re.findall(r"\d+", output))
    assert messages > 1000 and allocations > messages / slab and failed > 200


@pytest.mark.parametrize("flags", [MEMORY, ["-fsanitize=thread"]],
                         ids=["memory", "thread"])
def test_guard_and_planner_share_the_steps(tmp_path, flags):
    program = compile_test(tmp_path, "guard_threads.c",
                           [*MOTION, "stepguard", "hostclock", "realtime"], flags)
    assert "1000 rounds" in run(program, "1000")


def test_threads_make_the_same_steps(tmp_path):
    """No two of them meet, and messages do not depend on how many there are."""
    program = compile_test(tmp_path, "motion_story.c", MOTION,
                           ["-fsanitize=thread", *WRAP])
    assert "0 made to fail" in run(program)
