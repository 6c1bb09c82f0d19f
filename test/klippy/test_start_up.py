# SPDX-License-Identifier: GPL-3.0-or-later
"""What it costs to start: the modules that are imported, and instructions.

A printer with heaters, fan, input shaper and pressure advance reads an empty
job in batch mode: all of start-up but the link.
"""
import os
import re
import shutil
import subprocess
import sys

import machine_configs
import pytest
from batch import ROOT
from dictionaries import DICTIONARIES, build_dictionary
from test_batch_is_live import use_own_pins

from klippy import printer

# Needed by some command or feature, by no start of a printer
NEEDLESS = {"asyncio", "bz2", "concurrent", "ctypes", "dataclasses", "difflib",
            "email", "http", "inspect", "jinja2", "lzma", "multiprocessing", "numpy",
            "pathlib", "serial", "shutil", "socket", "sqlite3", "tempfile", "typing",
            "unittest", "urllib.request", "xml", "klippy.canlink", "klippy.flash",
            "klippy.schema", "klippy_ext.kin_delta", "klippy.extras.mpc_calibrate",
            "klippy.extras.temperature_mcu"}
MODULES_LIMIT = 230
# What it takes is 0.29 G; bytecode is there as on a printer
INSTRUCTIONS_LIMIT = 330e6


@pytest.fixture
def command(tmp_path):
    """Command line of the run, which has been run once."""
    (tmp_path / "a.cfg").write_text(use_own_pins(machine_configs.make_axes(
        "corexy", 0.04, machine_configs.BED
        + "[input_shaper]\nshaper_freq_x: 40\nshaper_freq_y: 40\n")))
    (tmp_path / "a.gcode").write_text("M110\n")
    command = ["-m", "klippy", "run", str(tmp_path / "a.cfg"), "-i",
               str(tmp_path / "a.gcode"), "-o", os.devnull, "-d",
               str(build_dictionary(DICTIONARIES / "simulator.dict"))]
    # The second start counts: templates have been checked
    subprocess.run([sys.executable, *command], cwd=ROOT, check=True,
                   capture_output=True)
    return command


def test_start_imports_what_it_needs(command):
    result = subprocess.run([sys.executable, "-X", "importtime", *command],
                            cwd=ROOT, text=True, capture_output=True)
    assert not result.returncode, result.stderr[-3000:]
    names = set(re.findall(r"^import time: [ \d]+\|[ \d]+\| *(\S+)$", result.stderr,
                           re.MULTILINE))
    assert printer.__name__ in names
    assert not {name for name in names for needless in NEEDLESS
                if name == needless or name.startswith(needless + ".")}
    assert len(names) < MODULES_LIMIT


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="needs valgrind")
def test_instructions_of_a_start(command, tmp_path):
    env = dict(os.environ, PYTHONPYCACHEPREFIX=str(tmp_path), PYTHONHASHSEED="0")
    env.pop("PYTHONDONTWRITEBYTECODE", None)
    subprocess.run([sys.executable, *command], cwd=ROOT, env=env, check=True,
                   capture_output=True)
    out = tmp_path / "callgrind.out"
    subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=%s" % (out,),
                    sys.executable, *command],
                   cwd=ROOT, env=env, check=True, capture_output=True)
    total = int(re.search(r"^(?:totals|summary): (\d+)", out.read_text(),
                          re.MULTILINE)[1])
    print("start-up: %.0f M instructions" % (total / 1e6,))
    assert total < INSTRUCTIONS_LIMIT
