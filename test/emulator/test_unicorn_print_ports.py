# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves of a real file, printed by one emulated chip of each further family."""

import re

import firmware_matrix
import machine_configs
import pytest
import unicorn_board
from judge import Judge
from printer_run import PrinterRun
from test_exact_steps import cut_sample

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

# Steppers, endstops, heaters with sensors, fan: pins of the config, ours
RP2040 = {"PA0": "gpio11", "PA1": "gpio10", "PA3": "gpio4", "PB0": "gpio6",
          "PB1": "gpio5", "PB3": "gpio3", "PC0": "gpio19", "PC1": "gpio28",
          "PC3": "gpio25", "PE0": "gpio14", "PE1": "gpio13", "PE4": "gpio23",
          "PE5": "gpio27", "PF4": "gpio21", "PF5": "gpio26", "PF6": "gpio17"}
SAMD = {"PA0": "PA12", "PA1": "PA13", "PA3": "PA14", "PB0": "PB12", "PB1": "PB13",
        "PB3": "PB14", "PC0": "PA16", "PC1": "PA17", "PC3": "PA18", "PE0": "PA19",
        "PE1": "PA20", "PE4": "PA21", "PE5": "PA2", "PF4": "PA22", "PF5": "PB8",
        "PF6": "PA23"}

# configuration, chip, crystal, pins, lines: the console is on USB
CASES = [
    ("rp2040", "rp2040", 12000000, RP2040, 150),
    ("samd21g18", "samd21g18", 32768, SAMD, 100),
    pytest.param("rp2350", "rp2350", 12000000, RP2040, 400,
                 marks=pytest.mark.slow),
    pytest.param("same51j19", "same51j19", 32768, SAMD, 400,
                 marks=pytest.mark.slow),
]


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


def make_config(adapter, pins):
    config = machine_configs.make_axes("cartesian", 0.04, machine_configs.BED)
    config = re.sub(r"\bP[A-F]\d\b", lambda match: pins[match[0]], config)
    return config + "\n[simulator]\nfirmware: %s\n" % (adapter,)


@pytest.mark.parametrize("name, chip, crystal, pins, n_lines", CASES)
def test_moves_of_a_file(name, chip, crystal, pins, n_lines, tmp_path, adapter,
                         monkeypatch):
    unicorn_board.choose_chip(monkeypatch, firmware_matrix.build(name), chip,
                              crystal)
    config = make_config(adapter, pins)
    before, job = cut_sample("cube20.gcode", "cartesian", n_lines)
    path = tmp_path / "job.gcode"
    path.write_text(job)
    run = PrinterRun(config, tmp_path, seed=0).run([before, path], 1)
    judge = Judge(run, config, job, run.snapshots[0],
                  extra_limit=machine_configs.find_limits("cartesian", config))
    assert judge.check()["stepper_x"] > 40 * n_lines
