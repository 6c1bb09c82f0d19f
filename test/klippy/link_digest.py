# SPDX-License-Identifier: GPL-3.0-or-later
"""Run a job and print, for each mcu, a digest of all that crossed its link.

Usage: link_digest.py SEED.  Times of the bytes are part of the digest.
"""

import hashlib
import pathlib
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "test")]

import machine_configs  # noqa: E402
from printer_run import PrinterRun  # noqa: E402

JOB = """
M106 S128
G92 X0 Y0
M109 S60
G1 X20 Y7 F6000
G1 X30 E0.6 F2400
G1 Y20 E0.6
G1 E-0.8 F2400
G1 X0 Y0 F9000
G4 P200
G1 E0.8
G1 X15 Y15 E0.7
M104 S0
M107
M400
"""


def digest_links(seed):
    """{mcu: (bytes both ways, sha256 of times, directions and bytes)}."""
    with tempfile.TemporaryDirectory() as folder:
        run = PrinterRun(machine_configs.make_two_mcus(), folder, seed)
        for mcu in run.machine.mcus.values():
            mcu.link.record(True)
        run.run(["G28\nG90\nM83\nG1 X100 Y100 Z3 F6000\n" + JOB])
    result = {}
    for name, mcu in run.machine.mcus.items():
        digest, size = hashlib.sha256(), 0
        for time, direction, data in mcu.link.take():
            digest.update((b"%a %a %d " % (time, direction, len(data))) + data)
            size += len(data)
        result[name] = (size, digest.hexdigest())
    return result


if __name__ == "__main__":
    for mcu_name, (total, text) in digest_links(int(sys.argv[1])).items():
        print(mcu_name, total, text)
