# SPDX-License-Identifier: GPL-3.0-or-later
"""A real file printed by an AVR chip that is emulated cycle by cycle."""

import machine_configs
import pytest
import simavr_chip
from judge import Judge
from printer_run import PrinterRun
from test_exact_steps import cut_sample

pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not simavr_chip.is_installed(), reason="needs libsimavr-dev")]


STEP_ERROR = 25e-6
# One step in a million is later: firmware_avr.md, "Lateness"
RARE_DELAY = 5e-6


@pytest.fixture(scope="module")
def chip(tmp_path_factory):
    """(adapter, elf) of an atmega2560."""
    folder = tmp_path_factory.mktemp("simavr")
    return (simavr_chip.build_adapter(folder),
            simavr_chip.build_firmware(folder, "atmega2560"))


def make_config(adapter):
    """A cartesian machine on pins that the chip has for their purpose."""
    config = machine_configs.make_axes("cartesian", 0.04, machine_configs.BED)
    return (config.replace("PE5", "PK5").replace("PE", "PL")
            + "\n[simulator]\nfirmware: %s\n" % (adapter,))


def print_and_judge(tmp_path, chip, monkeypatch, n_lines):
    adapter, elf = chip
    simavr_chip.choose_chip(monkeypatch, elf, "atmega2560")
    config = make_config(adapter)
    before, job = cut_sample("cube20.gcode", "cartesian", n_lines)
    path = tmp_path / "job.gcode"
    path.write_text(job)
    # With seed 0 the clock of the world starts at 0, as that of a chip does
    run = PrinterRun(config, tmp_path, seed=0).run([before, path], 1)
    judge = Judge(run, config, job, run.snapshots[0],
                  extra_limit=machine_configs.find_limits("cartesian", config),
                  tolerance=STEP_ERROR + RARE_DELAY)
    return judge, judge.check()


def test_2000_moves_of_a_file(tmp_path, chip, monkeypatch):
    _, counts = print_and_judge(tmp_path, chip, monkeypatch, 2300)
    assert counts["stepper_x"] > 100000
