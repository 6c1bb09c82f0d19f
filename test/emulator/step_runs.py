# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs of steps of an emulated chip: when their edges must come, what ends them."""


def start_steps(board, interval, count, add=0):
    """Queue one run; returns the clock from which it counts."""
    origin = board.clock + board.freq // 20
    board.send("reset_step_clock", oid=0, clock=origin % 2**32)
    board.send("queue_step", oid=0, interval=interval, count=count, add=add)
    return origin


def expect_clocks(origin, interval, count, add=0):
    """Clocks of the steps, by the definition of queue_step."""
    clocks = []
    for _ in range(count):
        origin += interval
        clocks.append(origin)
        interval += add
    return clocks


def assert_prompt(edges, clocks, prompt):
    """Each edge comes at its clock, or as late as its event takes (ticks)."""
    assert len(edges) == len(clocks)
    late = [edge - clock for edge, clock in zip(edges, clocks, strict=True)]
    assert -prompt <= min(late) and max(late) <= prompt, (min(late), max(late))


def assert_switch_stops(board, switch, step):
    """A switch ends a run of steps of stepper 0: endstop 1, trsync 2."""
    origin = start_steps(board, board.freq // 1000, 200)
    hit = origin + board.freq // 10
    board.inputs[board.find_pin(switch)] = lambda clock: clock >= hit
    board.send("trsync_start", oid=2, report_clock=0, report_ticks=0,
               expire_reason=4)
    board.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    board.send("endstop_home", oid=1, clock=(origin + 10) % 2**32,
               sample_ticks=board.freq // 100000, sample_count=4,
               rest_ticks=board.freq // 20000, pin_value=1, trsync_oid=2,
               trigger_reason=1)
    board.run_for(0.3)
    states = board.list_messages("trsync_state")
    assert states and states[-1]["trigger_reason"] == 1
    steps = board.list_edges(board.find_pin(step), origin)
    assert hit - steps[-1][0] < board.freq // 1000
    assert steps[-1][0] < hit + board.freq // 10000
