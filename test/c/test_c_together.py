# SPDX-License-Identifier: GPL-3.0-or-later
"""Both halves of the host's C core in one program, with all their threads."""

import re

import pytest
from test_c_io import CORE, MEMORY, THREADED, compile_test, run
from test_c_motion import MOTION

LONG = pytest.mark.slow


@pytest.mark.parametrize("flags, rounds", [
    (["-fsanitize=thread"], 200),
    pytest.param(["-fsanitize=thread"], 5000, marks=LONG),
    pytest.param(MEMORY, 5000, marks=LONG),
], ids=["thread", "thread-long", "memory-long"])
def test_steps_reach_the_boards(tmp_path, flags, rounds):
    """Planner, step threads, guard, two links: no race, no step more or less."""
    modules = dict.fromkeys([*MOTION, *CORE, *THREADED, "stepguard"])
    program = compile_test(tmp_path, "motion_link_threads.c", modules, flags)
    output = run(program, str(rounds))
    guarded = int(re.search(r"guarded (\d+) times", output)[1])
    assert output.startswith("%d rounds" % (rounds,)) and guarded > 0
