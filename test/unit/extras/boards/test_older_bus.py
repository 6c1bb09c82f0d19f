# SPDX-License-Identifier: GPL-3.0-or-later
"""Buses on firmware whose commands have the names of before."""
import pytest
import reduced_firmware
from test_bus import Eeprom, make_i2c, run

from klippy.extras import bus, older_bus


def rename(table, kind, old, new):
    """Have a dictionary tell `new` where it has the message `old`."""
    [text] = [text for text in table[kind] if text.split()[0] == old]
    table[kind][new] = table[kind].pop(text)


def get_config(it):
    return it.printer.lookup_object("mcu")._config.config_cmds


def test_software_buses_are_told_a_rate(tmp_path, monkeypatch):
    def change(table):
        rename(table, "commands", "spi_set_sw_bus", older_bus.SPI_SW)
        rename(table, "commands", "i2c_set_sw_bus", older_bus.I2C_SW)
        return table
    reduced_firmware.patch(monkeypatch, change)
    section = ("cs_pin: PA4\nspi_software_miso_pin: PA5\nspi_software_mosi_pin: PA6\n"
               "spi_software_sclk_pin: PA7\ni2c_software_scl_pin: PA0\n"
               "i2c_software_sda_pin: PA1\n")

    def make(section):
        return (bus.MCU_SPI_from_config(section, 3, default_speed=250000),
                make_i2c(section))

    def body(it, devices):
        assert ("spi_set_software_bus oid=0 miso_pin=PA5 mosi_pin=PA6 sclk_pin=PA7"
                " mode=3 rate=250000") in get_config(it)
        assert ("i2c_set_software_bus oid=1 scl_pin=PA0 sda_pin=PA1 rate=400000"
                " address=80") in get_config(it)
    run(tmp_path, monkeypatch, section, make, body)


def test_i2c_reads_by_its_own_command(tmp_path, monkeypatch):
    """The fields of i2c_read are those of the command of today; so is its answer."""
    chip = Eeprom()

    def change(table):
        rename(table, "commands", "i2c_transfer", older_bus.I2C_READ)
        rename(table, "responses", "i2c_response",
               "i2c_read_response oid=%c i2c_bus_status=%c response=%*s")
        table["commands"][older_bus.I2C_WRITE] = max(
            number for kind in ("commands", "responses", "output")
            for number in table[kind].values()) + 1
        return table
    reduced_firmware.patch(monkeypatch, change)

    def prepare(bench):
        bench.machine.mcus["mcu"].add_i2c_device(0, 0x50, chip.exchange)

    def body(it, i2c):
        chip.memory[8:11] = bytes([11, 22, 33])
        assert i2c.i2c_read([8], 3)["response"] == bytes([11, 22, 33])
    run(tmp_path, monkeypatch, "i2c_mcu: mcu\n", make_i2c, body, prepare=prepare)


class Mcu:
    """Notes what is sent."""

    def __init__(self):
        self.sent = []

    def lookup_command(self, text, cq=None):
        return self

    def lookup_query_command(self, text, response, oid=None, cq=None):
        return self

    def send(self, data, **options):
        self.sent.append(("send", list(data)))

    def send_wait_ack(self, data, **options):
        self.sent.append(("wait", list(data)))


def test_i2c_writes_by_its_own_command():
    mcu = Mcu()
    transfer = older_bus.OlderTransfer(mcu, 3, None)
    transfer.send([3, b"\1\2", 0], minclock=1, reqclock=2)
    answer = transfer.query.send([3, b"\5", 0])
    assert answer == {"i2c_bus_status": "SUCCESS", "response": b""}
    assert mcu.sent == [("send", [3, b"\1\2"]), ("wait", [3, b"\5"])]


@pytest.mark.parametrize("missing", ["i2c_transfer", "i2c_set_bus"])
def test_neither_form_is_a_lack(tmp_path, monkeypatch, missing):
    def change(table):
        for text in [text for text in table["commands"] if text.startswith(missing)]:
            del table["commands"][text]
        return table
    reduced_firmware.patch(monkeypatch, change)

    def body(it, i2c):
        assert "lacks the command '%s'; build it with 'I2C" % (missing,) in (
            it.printer.state_message)
    run(tmp_path, monkeypatch, "i2c_mcu: mcu\n", make_i2c, body, is_ready=False)
