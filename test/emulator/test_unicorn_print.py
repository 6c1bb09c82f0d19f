# SPDX-License-Identifier: GPL-3.0-or-later
"""A real file printed by emulated STM32 chips."""

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

# Pins that the chips have for these purposes
PINS = {"PE0": "PC8", "PE1": "PC9", "PE4": "PC10", "PE5": "PA4", "PF4": "PC11",
        "PF5": "PA5", "PF6": "PC12"}


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


def make_config(adapter, pins):
    config = machine_configs.make_axes("cartesian", 0.04, machine_configs.BED)
    for name, pin in pins.items():
        config = config.replace(name, pin)
    return config + "\n[simulator]\nfirmware: %s\n" % (adapter,)


def print_and_judge(folder, adapter, n_lines, pins=PINS):
    """Steps of each stepper, all of which were in time."""
    config = make_config(adapter, pins)
    before, job = cut_sample("cube20.gcode", "cartesian", n_lines)
    path = folder / "job.gcode"
    path.write_text(job)
    # With seed 0 the clock of the world starts at 0, as that of a chip does
    run = PrinterRun(config, folder, seed=0).run([before, path], 1)
    judge = Judge(run, config, job, run.snapshots[0],
                  extra_limit=machine_configs.find_limits("cartesian", config))
    return judge.check()


# One chip prints much, one of each other line a few layers' worth of moves
LONG, SHORT = 2300, 150


@pytest.mark.parametrize("chip, n_lines", [
    ("stm32f103", LONG), ("stm32f407", LONG), ("stm32f070", SHORT),
    ("stm32g0b1", SHORT), ("stm32g431", SHORT), ("stm32f765", SHORT),
    ("stm32h743", SHORT), ("stm32l412", SHORT), ("stm32f207", SHORT)])
def test_moves_of_a_file(chip, n_lines, tmp_path, adapter, monkeypatch):
    firmware = firmware_matrix.build(chip)
    unicorn_board.choose_chip(monkeypatch, firmware, chip)
    counts = print_and_judge(tmp_path, adapter, n_lines)
    assert counts["stepper_x"] > 40 * n_lines
