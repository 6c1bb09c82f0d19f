# SPDX-License-Identifier: GPL-3.0-or-later
"""What [samd_sercom] tells its mcu."""
import pytest

from klippy.errors import ConfigError
from klippy.extras import samd_sercom


class Chip:
    def __init__(self):
        self.commands = []

    def add_config_cmd(self, command):
        self.commands.append(command)


class Pins:
    """Pins are names with the mcu's in front."""

    def __init__(self):
        self.chips = {"a": Chip(), "b": Chip()}

    def lookup_pin(self, name):
        chip, pin = name.split(":")
        return {"chip": self.chips[chip], "pin": pin}


class Config:
    error = ConfigError

    def __init__(self, **options):
        self.options = options

    def get_printer(self):
        return None

    def get_name(self):
        return "samd_sercom one"

    def get(self, option, default=None):
        return self.options.get(option, default)


def load(monkeypatch, **options):
    ppins = Pins()
    monkeypatch.setattr(samd_sercom.pins, "get", lambda printer: ppins)
    samd_sercom.load_config_prefix(Config(sercom="sercom3", **options))
    return ppins.chips["a"].commands


def test_all_pins(monkeypatch):
    assert load(monkeypatch, tx_pin="a:PA22", rx_pin="a:PA25", clk_pin="a:PA23") == [
        "set_sercom_pin bus=sercom3 sercom_pin_type=tx pin=PA22",
        "set_sercom_pin bus=sercom3 sercom_pin_type=rx pin=PA25",
        "set_sercom_pin bus=sercom3 sercom_pin_type=clk pin=PA23"]


def test_without_rx_pin(monkeypatch):
    assert len(load(monkeypatch, tx_pin="a:PA22", clk_pin="a:PA23")) == 2


def test_pins_of_two_mcus(monkeypatch):
    with pytest.raises(ConfigError, match="of one mcu: 'b:PA23'"):
        load(monkeypatch, tx_pin="a:PA22", clk_pin="b:PA23")
