# SPDX-License-Identifier: GPL-3.0-or-later
"""Every example of the accessories' pages starts a printer, and its commands run."""
import pathlib
import re

import pytest
from motion_bench import MotionBench
from motion_machine import PRINTER

DOCS = pathlib.Path(__file__).resolve().parents[4] / "docs"
PAGES = ("outputs", "lights", "filament", "temperatures", "fans")
# Lines that pages show for their examples
COMMANDS = {
    "outputs": ["SET_PIN PIN=laser VALUE=100"],
    "lights": ["SET_LED LED=caselight RED=1 INDEX=3",
               "SET_LED_TEMPLATE LED=caselight TEMPLATE=heat INDEX=3 PARAM_FULL=300"],
    "filament": ["QUERY_FILAMENT_SENSOR SENSOR=runout",
                 "SET_FILAMENT_SENSOR SENSOR=runout RUNOUT_DISTANCE=200 SMART=0"],
    "temperatures": ["QUERY_ADC NAME=room PULLUP=1000"],
    "fans": ["SET_TEMPERATURE_FAN_TARGET TEMPERATURE_FAN=electronics TARGET=60"],
}


def read_examples(page):
    """The blocks of a page that hold sections."""
    blocks = re.findall(r"^```\n(.*?)^```", (DOCS / (page + ".md")).read_text(),
                        re.DOTALL | re.MULTILINE)
    return [block for block in blocks if block.startswith("[")]


@pytest.mark.parametrize("page", PAGES)
def test_examples_start(tmp_path, monkeypatch, page):
    examples = read_examples(page)
    assert examples

    def body(it):
        it.pause(2.0)
        for line in COMMANDS[page]:
            it.send(line)
        it.pause(2.0)
        assert not it.printer.is_shutdown()
        assert not [line for line in it.output if line.startswith("!!")]
    MotionBench(tmp_path, monkeypatch,
                PRINTER + "\n[display_status]\n" + "\n".join(examples)).run_ready(body)
