# SPDX-License-Identifier: GPL-3.0-or-later
"""Pin names of a config on the simulated board."""
import pytest

from klippy.errors import ConfigError
from klippy.simulator.pinmap import PinMap
from klippy.simulator.settings import MachineConfig

SECTIONS = {
    "mcu": {"serial": "/dev/ttyACM0"},
    "mcu head": {"serial": "/dev/ttyACM1"},
    "stepper_x": {"step_pin": "PF0", "dir_pin": "!PF1",
                  "endstop_pin": "^!head:gpio5"},
    "extruder": {"heater_pin": "head:PB4", "sensor_pin": "AIN"},
    "board_pins": {"aliases": "AIN=PK5, GND=<GND>"},
    "static_digital_output all": {"pins": "!PC1, PC2\nhead:PB9"},
    "probe": {"pin": "^PD3"},
    "stepper_z": {"endstop_pin": "probe:z_virtual_endstop"},
}


def test_every_pin_gets_its_own_number():
    pins = PinMap(MachineConfig(SECTIONS))
    main = pins.get_pin_map("mcu")
    assert sorted(main) == ["PC1", "PC2", "PD3", "PF0", "PF1", "PK5"]
    assert sorted(pins.get_pin_map("head")) == ["PB4", "PB9", "gpio5"]
    assert sorted(main.values()) == list(range(6))


def test_allocation_is_the_same_each_time():
    first = PinMap(MachineConfig(SECTIONS)).get_pin_map("mcu")
    second = PinMap(MachineConfig(SECTIONS)).get_pin_map("mcu")
    assert list(first.items()) == list(second.items())


def test_lookup_sees_chip_inversion_and_alias():
    pins = PinMap(MachineConfig(SECTIONS))
    ref = pins.lookup("^!head:gpio5")
    assert (ref.mcu, ref.name, ref.invert) == ("head", "gpio5", True)
    assert pins.lookup("AIN").name == "PK5"
    assert pins.lookup("probe:z_virtual_endstop") is None
    assert pins.lookup(None) is None


def test_names_the_firmware_knows_keep_their_number():
    known = {"PF0": 1, "PK5": 0}
    pins = PinMap(MachineConfig(SECTIONS), lambda n: known.get(n, -1))
    main = pins.get_pin_map("mcu")
    assert main["PF0"] == 1 and main["PK5"] == 0
    assert sorted(main.values()) == list(range(6))


def test_too_many_pins_are_refused():
    with pytest.raises(ConfigError, match="only 4"):
        PinMap(MachineConfig(SECTIONS), n_pins=4)
