# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from klippy import pins
from klippy.errors import ConfigError


class Chip:
    """Records what pins are made of."""

    def __init__(self):
        self.made = []

    def setup_pin(self, pin_type, pin_params):
        self.made.append((pin_type, pin_params["pin"]))
        return len(self.made)


class Config:
    """A printer whose only object is its config."""

    def __init__(self, sections):
        self.sections = sections

    def lookup_object(self, name, default=None):
        return self

    def get_status(self, eventtime):
        return {"config": self.sections}

    def get_place(self, section, option):
        return "%s.cfg:%d" % (section, list(self.sections[section]).index(option) + 1)


def make_pins(sections=None):
    printer_pins = pins.PrinterPins(Config(sections or {}))
    for name in ("mcu", "zboard"):
        printer_pins.register_chip(name, Chip())
    return printer_pins


@pytest.mark.parametrize("text,expected", [
    ("PA1", ("mcu", "PA1", 0, 0)), (" ^ ! zboard : PB2 ", ("zboard", "PB2", 1, 1)),
    ("~P1.22", ("mcu", "P1.22", 0, -1)), ("!gpiochip1/gpio3",
                                          ("mcu", "gpiochip1/gpio3", 1, 0))])
def test_parse(text, expected):
    params = make_pins().parse_pin(text, can_invert=True, can_pullup=True)
    found = tuple(params[k] for k in ("chip_name", "pin", "invert", "pullup"))
    assert found == expected


@pytest.mark.parametrize("text,match", [
    ("PA 1", "Invalid pin description 'PA 1'"), ("", "Invalid"), ("!^PA1", "Invalid"),
    ("a:b:c", "Invalid"), ("^PA1", "cannot have a pull-up"),
    ("!PA1", "cannot be inverted"), ("zbord:PA1", "did you mean 'zboard'")])
def test_bad_descriptions(text, match):
    with pytest.raises(ConfigError, match=match):
        make_pins().parse_pin(text)


def test_double_use_names_both_options():
    printer_pins = make_pins({
        "stepper_x": {"step_pin": "PA1"}, "fan": {"pin": "!mcu:PA1"},
        "stepper_y": {"step_pin": "zboard:PA1"}})
    printer_pins.lookup_pin("PA1")
    printer_pins.lookup_pin("zboard:PA1")
    with pytest.raises(pins.error) as info:
        printer_pins.lookup_pin("mcu:PA1")
    assert ("[stepper_x] step_pin at stepper_x.cfg:1, [fan] pin at fan.cfg:1"
            in str(info.value))
    assert "stepper_y" not in str(info.value)


def test_sharing():
    printer_pins = make_pins()
    first = printer_pins.lookup_pin("PA1", can_invert=True, share_type="enable")
    assert printer_pins.lookup_pin("PA1", share_type="enable") is first
    with pytest.raises(pins.error, match="same polarity"):
        printer_pins.lookup_pin("!PA1", can_invert=True, share_type="enable")
    with pytest.raises(pins.error, match="used more than once"):
        printer_pins.lookup_pin("PA1", share_type="other")
    printer_pins.reset_pin_sharing(first)
    assert printer_pins.lookup_pin("PA1") is not first


def test_multi_use():
    printer_pins = make_pins()
    printer_pins.allow_multi_use_pin("zboard:PA1")
    for _ in range(3):
        printer_pins.lookup_pin("zboard:PA1")


def test_setup_pin_checks_modifiers():
    printer_pins = make_pins()
    assert printer_pins.setup_pin("pwm", "!PA1") == 1
    assert printer_pins.chips["mcu"].made == [("pwm", "PA1")]
    with pytest.raises(pins.error, match="pull-up"):
        printer_pins.setup_pin("digital_out", "^PA2")
    with pytest.raises(pins.error, match="inverted"):
        printer_pins.setup_pin("adc", "!PA2")


def test_chip_names_are_unique():
    with pytest.raises(pins.error, match="Duplicate chip name 'mcu'"):
        make_pins().register_chip("mcu", Chip())
    with pytest.raises(pins.error, match="Unknown chip name 'zbard'.*'zboard'"):
        make_pins().get_pin_resolver("zbard")


def test_aliases_apply_to_all_pin_fields():
    resolver = pins.PinResolver("mcu")
    resolver.alias_pin("EXP1_1", "PE1")
    resolver.alias_pin("BEEP", "EXP1_1")
    cmd = "config_stepper oid=1 step_pin=BEEP dir_pin=PA2 invert_step=0"
    assert resolver.update_command(cmd) == (
        "config_stepper oid=1 step_pin=PE1 dir_pin=PA2 invert_step=0")
    with pytest.raises(pins.error, match="both as 'BEEP' and as 'PE1'"):
        resolver.update_command("config_endstop oid=2 pin=PE1 pull_up=0")


def test_alias_chain_works_in_any_order():
    resolver = pins.PinResolver("mcu")
    resolver.alias_pin("BEEP", "EXP1_1")
    resolver.alias_pin("EXP1_1", "PE1")
    assert resolver.resolve("BEEP") == "PE1"


def test_reserved_pin_is_refused():
    resolver = pins.PinResolver("mcu")
    resolver.reserve_pin("PA13", "SWD")
    resolver.reserve_pin("PA13", "SWD")
    resolver.alias_pin("LED", "PA13")
    with pytest.raises(pins.error, match="'LED' of chip 'mcu' is reserved for SWD"):
        resolver.resolve("LED")
    with pytest.raises(pins.error, match="reserved twice"):
        resolver.reserve_pin("PA13", "USB")


def test_conflicting_aliases():
    resolver = pins.PinResolver("mcu")
    resolver.alias_pin("A", "PA1")
    resolver.alias_pin("A", "PA1")
    with pytest.raises(pins.error, match="cannot mean both 'PA1' and 'PA2'"):
        resolver.alias_pin("A", "PA2")
    with pytest.raises(pins.error, match="plain pin name"):
        resolver.alias_pin("B", "!PA2")
