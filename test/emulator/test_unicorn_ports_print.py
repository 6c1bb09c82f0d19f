# SPDX-License-Identifier: GPL-3.0-or-later
"""A real file printed by emulated LPC176x and SAM chips."""

import re

import firmware_matrix
import machine_configs
import pytest
import unicorn_board
from judge import Judge
from port_chips import CHIPS
from printer_run import PrinterRun
from test_exact_steps import cut_sample

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

# Pins of the machine -> of the chip: step, dir, enable, switch of each motor,
# then heaters, sensors, fan
LPC_PINS = {
    "PA0": "P2.2", "PA1": "P2.6", "PA2": "P2.1", "PA3": "P1.29",
    "PB0": "P0.19", "PB1": "P0.20", "PB2": "P2.8", "PB3": "P1.28",
    "PC0": "P0.22", "PC1": "P2.11", "PC2": "P0.21", "PC3": "P1.27",
    "PE0": "P2.13", "PE1": "P0.11", "PE2": "P2.12", "PE4": "P2.7",
    "PE5": "P0.24", "PF4": "P2.5", "PF5": "P0.25", "PF6": "P2.3"}
SAM_PINS = {"PE0": "PD0", "PE1": "PD1", "PE4": "PD4", "PE5": "PA17", "PF4": "PD5",
            "PF5": "PA18", "PF6": "PD6"}
SAM3_PINS = {**SAM_PINS, "PE5": "PA16", "PF5": "PA24"}
SAM4S_PINS = {**SAM_PINS, "PB3": "PB5", "PE0": "PC8", "PE1": "PC9", "PE4": "PC10",
              "PF4": "PC11", "PF6": "PC16"}
# Moves of a few layers; one chip of each family prints more in the slow tests
SHORT, LONG = 100, 1200


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


def make_config(adapter, pins):
    config = machine_configs.make_axes("cartesian", 0.04, machine_configs.BED)
    config = re.sub(r"\bP[A-F]\d\b", lambda m: pins.get(m[0], m[0]), config)
    return config + "\n[simulator]\nfirmware: %s\n" % (adapter,)


def print_and_judge(folder, adapter, pins, n_lines):
    config = make_config(adapter, pins)
    before, job = cut_sample("cube20.gcode", "cartesian", n_lines)
    path = folder / "job.gcode"
    path.write_text(job)
    # With seed 0 the clock of the world starts at 0, as that of a chip does
    run = PrinterRun(config, folder, seed=0).run([before, path], 1)
    judge = Judge(run, config, job, run.snapshots[0],
                  extra_limit=machine_configs.find_limits("cartesian", config))
    return judge.check()


PINS = {"lpc1768": LPC_PINS, "sam3x8e": SAM3_PINS, "sam4s8c": SAM4S_PINS,
        "sam4e8e": SAM_PINS, "same70q20b": SAM_PINS}


@pytest.mark.parametrize("name, n_lines", [
    *[pytest.param(name, SHORT, marks=[pytest.mark.slow] * name.startswith("sam4"))
      for name in PINS],
    pytest.param("lpc1768", LONG, marks=pytest.mark.slow),
    pytest.param("sam3x8e", LONG, marks=pytest.mark.slow)])
def test_moves_of_a_file(name, n_lines, tmp_path, adapter, monkeypatch):
    firmware = firmware_matrix.build(name)
    unicorn_board.choose_chip(monkeypatch, firmware, name, CHIPS[name].crystal)
    counts = print_and_judge(tmp_path, adapter, PINS[name], n_lines)
    assert counts["stepper_x"] > 40 * n_lines
