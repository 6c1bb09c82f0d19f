# SPDX-License-Identifier: GPL-3.0-or-later
"""The STM32 firmware on emulated chips, as mcus of the virtual world."""

import pytest
import unicorn_board

from klippy.reactor import Reactor
from klippy.serialhdl import SerialReader
from klippy_ext.vworld import VirtualWorld

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

CHIPS = ["stm32f072", "stm32f070", "stm32f103", "stm32f401", "stm32f407",
         "stm32f446", "stm32g0b1", "stm32g070"]


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.fixture
def talk_to(adapter, monkeypatch):
    """talk_to(folder, chip, func, crystal) runs func(serial, world, mcu)."""
    def run(folder, chip, func, crystal=8000000):
        unicorn_board.choose_chip(monkeypatch, folder, chip, crystal)
        world = VirtualWorld(seed=1)
        mcu = world.add_mcu("mcu", str(adapter))
        reactor = Reactor(world)
        serial = SerialReader(reactor, "mcu")
        results = []

        def talk(eventtime):
            try:
                serial.connect_virtual(world, mcu)
                results.append(func(serial, reactor))
            finally:
                reactor.end()

        reactor.register_callback(talk)
        reactor.run()
        serial.disconnect()
        return results[0]
    return run


@pytest.mark.parametrize("chip", CHIPS)
def test_chip_identifies_itself(chip, talk_to, tmp_path):
    folder = unicorn_board.build_firmware(tmp_path, chip)

    def talk(serial, reactor):
        return (serial.get_msgparser().get_constants(),
                serial.send_with_response("get_uptime", "uptime"),
                serial.send_with_response("get_config", "config"))

    constants, uptime, config = talk_to(folder, chip, talk)
    assert constants["MCU"].startswith(chip)
    assert constants["ADC_MAX"] == 4095
    freq = constants["CLOCK_FREQ"]
    assert uptime["clock"] == pytest.approx(
        freq * uptime["#receive_time"], abs=freq / 200)
    assert config["is_config"] == 0 and config["is_shutdown"] == 0
