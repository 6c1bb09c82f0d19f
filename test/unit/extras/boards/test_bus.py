# SPDX-License-Identifier: GPL-3.0-or-later
"""SPI and I2C devices of a section, from the host through the firmware to a model."""
import pytest
from outputs_bench import OutputsBench

from klippy.errors import CommandError
from klippy.extras import bus


class ShiftChip:
    """An SPI device that answers with what it was sent the last time, inverted."""

    def __init__(self):
        self.log, self.last = [], b""

    def exchange(self, data):
        answer = bytes(0xff - byte for byte in self.last).ljust(len(data), b"\0")
        self.log.append(data)
        self.last = data
        return answer[:len(data)]


class Eeprom:
    """An I2C device with 256 bytes and an address that counts on."""

    def __init__(self):
        self.memory, self.address = bytearray(256), 0

    def exchange(self, written, read_len):
        if written:
            self.address = written[0]
            for value in written[1:]:
                self.memory[self.address] = value
                self.address += 1
        data = self.memory[self.address:self.address + read_len]
        self.address += read_len
        return bytes(data)


def run(tmp_path, monkeypatch, section, make, body, is_ready=True, prepare=None):
    bench = OutputsBench(tmp_path, monkeypatch, "[chip]\n" + section)
    found = []
    bench.make = lambda config: found.append(make(config.getsection("chip")))
    if prepare is not None:
        prepare(bench)
    (bench.run_ready if is_ready else bench.run)(lambda it: body(it, *found))


def make_spi(section):
    return bus.MCU_SPI_from_config(section, 3, default_speed=1000000)


def test_spi(tmp_path, monkeypatch):
    chip = ShiftChip()

    def prepare(bench):
        cs_pin = bench.machine.pins.lookup("PA4").number
        bench.machine.mcus["mcu"].add_spi_device(1, cs_pin, chip.exchange)

    def body(it, spi):
        it.pause(0.1)
        assert chip.log == [b"\x99"]     # from before the start
        spi.spi_send([1, 2, 3])
        assert spi.spi_transfer([4, 5, 6])["response"] == b"\xfe\xfd\xfc"
        assert spi.spi_transfer_with_preface([7], [0, 0])["response"] == b"\xf8\0"
        assert chip.log[1:] == [b"\1\2\3", b"\4\5\6", b"\7", b"\0\0"]

    def make(section):
        spi = make_spi(section)
        spi.spi_send([0x99])
        return spi

    run(tmp_path, monkeypatch, "cs_pin: PA4\nspi_bus: spi1\n", make, body,
        prepare=prepare)


def test_spi_says_good_bye(tmp_path, monkeypatch):
    chip = ShiftChip()

    def prepare(bench):
        cs_pin = bench.machine.pins.lookup("PA4").number
        bench.machine.mcus["mcu"].add_spi_device(0, cs_pin, chip.exchange)

    def make(section):
        spi = make_spi(section)
        spi.setup_shutdown_msg([0xde, 0xad])
        return spi

    def body(it, spi):
        assert it.printer.state == "ready"
        it.send("M112")
        it.pause(0.5)
        assert chip.log[-1] == b"\xde\xad"
    run(tmp_path, monkeypatch, "cs_pin: PA4\n", make, body, False, prepare)


def test_software_spi(tmp_path, monkeypatch):
    """Mode 3: the clock rests high, data count as it rises."""
    def body(it, spi):
        pins = [it.machine.pins.lookup(name).number for name in ("PA6", "PA7")]
        mcu = it.machine.mcus["mcu"]
        mcu.set_input(it.machine.pins.lookup("PA5").number, True)
        edges = mcu.watch_edges(pins)
        assert spi.spi_transfer([0xa5, 0x3c])["response"] == b"\xff\xff"
        level, bits, clocks = 0, "", []
        for clock, pin, value in edges.take():
            if pin == pins[0]:
                level = int(value)
            elif value:
                bits += str(level)
                clocks.append(clock)
        assert bits[-16:] == "{:08b}{:08b}".format(0xa5, 0x3c)
        # 100 kHz at least 10 us a bit
        steps = [b - a for a, b in zip(clocks[-16:], clocks[-15:], strict=False)]
        assert min(steps) >= mcu.freq * 10e-6 - 1

    run(tmp_path, monkeypatch, "cs_pin: PA4\nspi_speed: 100000\n"
        "spi_software_miso_pin: PA5\nspi_software_mosi_pin: PA6\n"
        "spi_software_sclk_pin: PA7\n", make_spi, body)


@pytest.mark.parametrize("section,message", [
    ("cs_pin: PA4\nspi_bus: spi44", "Unknown spi_bus 'spi44' of mcu 'mcu': it has spi"),
    ("cs_pin: PA4\nspi_speed: 99999", "spi_speed"),
    ("cs_pin: PA4\nspi_software_sclk_pin: PA7", "spi_software_miso_pin"),
    ("cs_pin: PA4\nspi_software_sclk_pin: tool:PA7\nspi_software_miso_pin: PA5\n"
     "spi_software_mosi_pin: PA6\n[mcu tool]\nserial: /dev/none",
     "Option 'spi_software_sclk_pin' in section 'chip': the pin must be of mcu 'mcu'")])
def test_bad_spi(tmp_path, monkeypatch, section, message):
    def body(it, *spi):
        assert message in it.printer.state_message
    run(tmp_path, monkeypatch, section + "\n", make_spi, body, False)


def make_i2c(section):
    return bus.MCU_I2C_from_config(section, default_addr=0x50, default_speed=400000)


@pytest.mark.parametrize("section,number,address", [
    ("i2c_bus: i2c2", 2, 0x50), ("i2c_address: 17", 0, 17)])
def test_i2c(tmp_path, monkeypatch, section, number, address):
    chip = Eeprom()

    def prepare(bench):
        bench.machine.mcus["mcu"].add_i2c_device(number, address, chip.exchange)

    def body(it, i2c):
        assert i2c.get_i2c_address() == address
        i2c.i2c_write([8, 11, 22, 33])
        assert i2c.i2c_read([8], 3)["response"] == bytes([11, 22, 33])
        assert i2c.i2c_read([], 1)["response"] == b"\0"
        i2c.i2c_write_noack([0, 5])
        it.pause(0.1)
        assert chip.memory[0] == 5
    run(tmp_path, monkeypatch, section + "\n", make_i2c, body, prepare=prepare)


def test_i2c_without_a_device(tmp_path, monkeypatch):
    def body(it, i2c):
        with pytest.raises(CommandError, match="I2C device 0x50 of mcu 'mcu' does not"):
            i2c.i2c_read([8], 3)
        with pytest.raises(CommandError, match="check its wiring and address"):
            i2c.i2c_write([8])
    run(tmp_path, monkeypatch, "i2c_mcu: mcu\n", make_i2c, body)
