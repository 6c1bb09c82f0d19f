# SPDX-License-Identifier: GPL-3.0-or-later
"""A second opinion on the RP2040: the firmware in an emulator that others made.

rp2040js has clocks, flash interface, timer and UART of its own.  Its timer counts
microseconds, however long the ticks are that it is told to count.  It is used where
it is installed: npm install --prefix ~/.cache/klippy-rp2040js rp2040js@1.4
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import zlib

import firmware_matrix
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "test" / "firmware"))
from simboard import Format, frame  # noqa: E402

FOLDER = os.environ.get("KLIPPY_RP2040JS", "~/.cache/klippy-rp2040js")
PACKAGE = pathlib.Path(FOLDER).expanduser() / "node_modules" / "rp2040js"
STEP, DIR = 11, 10
INTERVAL, COUNT = 2400, 50      # ticks, here us
START = 300000                  # clock from which the first interval counts
PORT_PINS = [STEP, DIR]

pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not shutil.which("node") or not PACKAGE.exists(),
                       reason="needs node and rp2040js (see the head of this file)"),
    pytest.mark.skipif(firmware_matrix.find_prefix("rp2040") is None,
                       reason="needs gcc-arm-none-eabi")]


def make_blocks(out):
    """identify twice, then a stepper and one run of steps, a block each."""
    dictionary = json.loads((out / "klipper.dict").read_text())
    formats = {fmt.split()[0]: Format(fmt, number)
               for fmt, number in dictionary["commands"].items()}
    messages = [
        ("identify", dict(offset=0, count=40)), ("identify", dict(offset=40, count=40)),
        ("allocate_oids", dict(count=1)),
        ("config_stepper", dict(oid=0, step_pin=STEP, dir_pin=DIR, invert_step=-1,
                                step_pulse_ticks=0)),
        ("finalize_config", dict(crc=1)),
        ("reset_step_clock", dict(oid=0, clock=START)),
        ("queue_step", dict(oid=0, interval=INTERVAL, count=COUNT, add=0))]
    return [list(frame(seq & 15, formats[name].encode(values)))
            for seq, (name, values) in enumerate(messages)]


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    out = firmware_matrix.build("rp2040_serial")
    path = tmp_path_factory.mktemp("rp2040js") / "job.json"
    path.write_text(json.dumps({
        "bin": str(out / "klipper.bin"), "blocks": make_blocks(out),
        "pins": PORT_PINS, "end_us": 600000}))
    text = subprocess.run(
        ["node", str(ROOT / "test/emulator/rp2040js_run.js"), str(PACKAGE), str(path)],
        capture_output=True, text=True, check=True, timeout=120).stdout
    return json.loads(text)


def list_payloads(data):
    """Payloads of the blocks in the bytes that came."""
    payloads = []
    while data and len(data) >= data[0]:
        payloads.append(bytes(data[2:data[0] - 3]))
        data = data[data[0]:]
    return payloads


def test_identify(result):
    """The first bytes are a compressed dictionary."""
    answers = [p for p in list_payloads(result["bytes"]) if p[:1] == b"\0"]
    data = answers[0][3:] + answers[1][3:]
    assert len(data) == 80
    assert zlib.decompressobj().decompress(data).startswith(b'{"')


def test_steps_at_their_times(result):
    """The clock runs from a moment of the boot on."""
    times = [ns for ns, pin, _ in result["edges"] if pin == STEP][-COUNT:]
    assert len(times) == COUNT
    off = [t - times[0] - i * INTERVAL * 1000 for i, t in enumerate(times)]
    assert max(abs(ns) for ns in off) < 2000
    assert START * 1000 < times[0] < (START + INTERVAL + 20000) * 1000
