# SPDX-License-Identifier: GPL-3.0-or-later
"""The AVR firmware on an emulated chip, as an mcu of the virtual world."""

import pytest
import simavr_chip

from klippy.reactor import Reactor
from klippy.serialhdl import SerialReader
from klippy_ext.vworld import VirtualWorld

pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not simavr_chip.is_installed(), reason="needs libsimavr-dev")]


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return simavr_chip.build_adapter(tmp_path_factory.mktemp("simavr"))


@pytest.mark.parametrize("chip", ["atmega2560", "atmega644p"])
def test_chip_identifies_itself(chip, adapter, tmp_path, monkeypatch):
    simavr_chip.choose_chip(
        monkeypatch, simavr_chip.build_firmware(tmp_path, chip), chip)
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
