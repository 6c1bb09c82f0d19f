# SPDX-License-Identifier: GPL-3.0-or-later
"""A real file printed by an AVR chip that is emulated cycle by cycle."""

import lateness
import machine_configs
import pytest
import simavr_chip
from judge import Judge
from printer_run import PrinterRun
from test_exact_steps import cut_sample

pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not simavr_chip.is_installed(), reason="needs libsimavr-dev")]


def make_config(adapter):
    """A cartesian machine on pins that the chip has for their purpose."""
    config = machine_configs.make_axes("cartesian", 0.04, machine_configs.BED)
    return (config.replace("PE5", "PK5").replace("PE", "PL")
            + "\n[simulator]\nfirmware: %s\n" % (adapter,))


def print_and_judge(tmp_path, atmega2560, monkeypatch, n_lines):
    adapter, elf = atmega2560
    simavr_chip.choose_chip(monkeypatch, elf, "atmega2560")
    config = make_config(adapter)
    before, job = cut_sample("cube20.gcode", "cartesian", n_lines)
    path = tmp_path / "job.gcode"
    path.write_text(job)
    # With seed 0 the clock of the world starts at 0, as that of a chip does
    run = PrinterRun(config, tmp_path, seed=0)
    run.machine.mcus["mcu"].link.record()
    run.run([before, path], 1)
    judge = Judge(run, config, job, run.snapshots[0],
                  extra_limit=machine_configs.find_limits("cartesian", config))
    return judge, judge.check()


def check_lateness(run):
    """No step comes later than the firmware says, nor before its time."""
    mcu = run.printer.lookup_object("mcu")
    bound = int(mcu.get_constants()["STEP_LATENCY_TICKS"])
    for name, (_, late) in lateness.measure(run).items():
        print("%s: %d to %d ticks late" % (name, late.min(), late.max()))
        assert late.min() >= 0 and late.max() <= bound, name


def test_2000_moves_of_a_file(tmp_path, atmega2560, monkeypatch):
    judge, counts = print_and_judge(tmp_path, atmega2560, monkeypatch, 2300)
    check_lateness(judge.run)
    assert counts["stepper_x"] > 100000
