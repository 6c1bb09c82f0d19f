# SPDX-License-Identifier: GPL-3.0-or-later
"""The host's CAN link on a kernel's own bus, with the linux firmware behind it."""

import machine
import pytest
from linux_board import build_linux

pytestmark = [pytest.mark.slow,
              pytest.mark.skipif(bool(machine.why_not()), reason=machine.why_not())]


def test_host_on_vcan(tmp_path):
    """Boards are listed, other ids filtered, firmware flashed, moves printed."""
    output = machine.run(tmp_path, ("vcan", "can_raw"), "can_host.py",
                         build_linux())
    done = [line[3:] for line in output.splitlines() if line.startswith("ok ")]
    assert done == ["absent", "filtered", "flashed", "listed", "ready", "printed",
                    "stopped"]
