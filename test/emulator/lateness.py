# SPDX-License-Identifier: GPL-3.0-or-later
"""How much later than asked for the pins of an emulated mcu make their steps.

The link is recorded; its queue_step commands say when each step is due, the
edges when it came.
"""

import numpy as np

from klippy.msgproto import take_payload

SEQ_MASK = 15
HALF = 1 << 31


def split_blocks(record):
    """Payloads of the blocks to the mcu, in order, each once."""
    data = b"".join(b for _, way, b in record if way == "to_mcu")
    pos, last = 0, None
    while pos < len(data):
        if data[pos] == 0x7e:
            pos += 1
            continue
        block = data[pos:pos + data[pos]]
        pos += len(block)
        if block[1] & SEQ_MASK != last:
            last = block[1] & SEQ_MASK
            yield take_payload(block)


def make_clocks(clock, message):
    """Clocks of the steps of one queue_step that follows a step at `clock`."""
    numbers = np.arange(1, message["count"] + 1, dtype=np.int64)
    return (clock + numbers * message["interval"]
            + numbers * (numbers - 1) // 2 * message["add"])


def read_due_clocks(run):
    """{oid: clocks (n,) at which the host asked for steps, from the start}."""
    parser = run.printer.lookup_object("mcu").get_serial().get_msgparser()
    record = run.machine.mcus["mcu"].link.take()
    clocks, last = {}, {}
    for payload in split_blocks(record):
        for message in parser.parse_payload(payload):
            name, oid = message["#name"], message.get("oid")
            if name == "reset_step_clock":
                before = last.get(oid, 0)
                ahead = (message["clock"] - before + HALF) % (2 * HALF) - HALF
                last[oid] = before + ahead
            elif name == "queue_step":
                done = make_clocks(last.get(oid, 0), message)
                last[oid] = int(done[-1])
                clocks.setdefault(oid, []).append(done)
    return {oid: np.concatenate(parts) for oid, parts in clocks.items()}


def compare(due, made):
    """(due (n,), late (n,)): clocks at which steps were due, in the turn of the 32
    bits of a command that is nearest to when they were made.

    After a rest of more than half a turn no command tells how many have passed.
    """
    late = (made - due + HALF) % (2 * HALF) - HALF
    return made - late, late


def measure(run):
    """{stepper: (due (n,), late (n,)) ticks} of a PrinterRun whose link was
    recorded from the start; only the steps that were recorded at the pins.  Can
    be asked once: it takes the record."""
    due = read_due_clocks(run)
    result = {}
    motion = run.printer.lookup_object("motion_queuing")
    for member in motion.members.values():
        for motor in member.steppers:
            made = run.steps[motor.get_name()][:, 0]
            if len(made):
                asked = due[motor.get_oid()][-len(made):]
                result[motor.get_name()] = compare(asked, made)
    return result
