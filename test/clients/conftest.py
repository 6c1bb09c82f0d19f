# SPDX-License-Identifier: GPL-3.0-or-later
"""A printer_data folder and our daemon on its simulated machine, in real time."""

import pathlib
import sys

import machine_configs
import pytest

FOLDER = pathlib.Path(__file__).resolve().parent
if str(FOLDER) not in sys.path:
    sys.path.insert(0, str(FOLDER))

import peers  # noqa: E402

SECTIONS = """
[simulator]
start_position: 3, 3, 1

[virtual_sdcard]
path: %s

[pause_resume]
[display_status]
[exclude_object]
[respond]

[gcode_macro HOLD_QUEUE]
description: Hold the queue of jobs
gcode:
    { action_call_remote_method("pause_job_queue") }

[gcode_macro CALL_AGENT]
gcode:
    { action_call_remote_method("agent_beep", tone=params.TONE|int) }
"""


@pytest.fixture(scope="module")
def data_folder(tmp_path_factory):
    """A printer_data folder with the config of a small printer."""
    folder = tmp_path_factory.mktemp("printer_data")
    for name in ("config", "logs", "gcodes", "comms"):
        (folder / name).mkdir()
    config = machine_configs.make_axes("cartesian", 0.02, machine_configs.BED)
    (folder / "config" / "printer.cfg").write_text(
        config + SECTIONS % (folder / "gcodes",))
    return folder


@pytest.fixture(scope="module")
def daemon(data_folder):
    """The daemon, which must end with status 0 and without a traceback."""
    process = peers.Daemon(data_folder, data_folder / "config" / "printer.cfg")
    yield process
    assert process.stop() == 0
    log = process.log_path.read_text()
    assert "Traceback" not in log
    assert not process.socket_path.exists()
