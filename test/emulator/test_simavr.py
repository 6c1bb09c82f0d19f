# SPDX-License-Identifier: GPL-3.0-or-later
"""The AVR firmware on an emulated chip, as an mcu of the virtual world."""

import os
import pathlib
import subprocess
import sys

import pytest

from klippy.reactor import Reactor
from klippy.serialhdl import SerialReader
from klippy_ext.vworld import VirtualWorld

ROOT = pathlib.Path(__file__).resolve().parents[2]
pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not os.path.exists("/usr/include/simavr/sim_avr.h"),
                       reason="needs libsimavr-dev")]


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    """Path of the shared object that wraps libsimavr."""
    path = tmp_path_factory.mktemp("simavr") / "simavr_vmcu.so"
    subprocess.run(
        ["cc", "-std=gnu11", "-O2", "-shared", "-fPIC", "-Wall", "-Wextra",
         "-Werror", "-I", str(ROOT / "klippy_ext" / "csrc"),
         "-I", "/usr/include/simavr", str(ROOT / "test/emulator/simavr_vmcu.c"),
         "-o", str(path), "-lsimavr", "-lelf"], check=True)
    return path


def build_firmware(folder, chip):
    subprocess.run(
        ["make", "firmware", "OUT=%s/" % (folder,),
         "KCONFIG_CONFIG=test/configs/%s.config" % (chip,),
         "PYTHON=" + sys.executable], cwd=ROOT, check=True, capture_output=True)
    return folder / "klipper.elf"


@pytest.mark.parametrize("chip, adc_port", [("atmega2560", "F"), ("atmega644p", "A")])
def test_chip_identifies_itself(chip, adc_port, adapter, tmp_path, monkeypatch):
    monkeypatch.setenv("SIMAVR_ELF", str(build_firmware(tmp_path, chip)))
    monkeypatch.setenv("SIMAVR_MCU", chip)
    monkeypatch.setenv("SIMAVR_ADC_PORT", str(ord(adc_port)))
    world = VirtualWorld(seed=1)
    mcu = world.add_mcu("mcu", str(adapter))
    assert mcu.freq == 16e6
    reactor = Reactor(world)
    serial = SerialReader(reactor, "mcu")
    answers = []

    def talk(eventtime):
        try:
            serial.connect_virtual(world, mcu)
            answers.append(serial.get_msgparser().get_constants())
            answers.append(serial.send_with_response("get_uptime", "uptime"))
            answers.append(serial.send_with_response("get_config", "config"))
        finally:
            reactor.end()

    reactor.register_callback(talk)
    reactor.run()
    constants, uptime, config = answers
    assert constants["MCU"] == chip and constants["CLOCK_FREQ"] == 16000000
    assert constants["ADC_MAX"] == 1023
    # it counts its cycles: a message takes a few ms each way
    assert uptime["clock"] == pytest.approx(16e6 * uptime["#receive_time"], abs=80000)
    assert config["is_config"] == 0 and config["is_shutdown"] == 0
    serial.disconnect()
