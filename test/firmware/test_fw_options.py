# SPDX-License-Identifier: GPL-3.0-or-later
"""Which features a chip offers: what does not fit cannot be chosen."""

import pathlib

import kconfiglib
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
# On a PRU, in place of analog inputs
EXTRAS = ("SOFTWARE_SPI", "BUTTONS", "NEOPIXEL", "PULSE_COUNTER")


@pytest.fixture
def load(monkeypatch, tmp_path):
    """load(options): the configuration of a chip, as a file may hold it."""
    monkeypatch.setenv("srctree", str(ROOT))

    def make(*options):
        tree = kconfiglib.Kconfig("Kconfig", warn_to_stderr=False)
        path = tmp_path / "config"
        path.write_text("".join("CONFIG_%s\n" % (o,) for o in options))
        tree.load_config(str(path))
        return tree
    return make


def list_features(tree):
    return {name for name, sym in tree.syms.items()
            if name.startswith("WANT_") and sym.str_value == "y"}


def list_prompts(tree):
    """Features of which somebody is asked."""
    return {name for name, sym in tree.syms.items()
            if name.startswith("WANT_") and sym.visibility}


def test_pru_has_analog_inputs(load):
    tree = load("MACH_PRU=y")
    assert list_features(tree) == {"WANT_ADC"}
    assert list_prompts(tree) == {"WANT_ADC"}


def test_pru_takes_no_features_that_do_not_fit(load):
    everything = [name + "=y" for name in load().syms if name.startswith("WANT_")]
    assert len(everything) > 20
    tree = load("MACH_PRU=y", *everything)
    assert list_features(tree) == {"WANT_ADC"}
    tree = load("MACH_PRU=y", *everything, "WANT_ADC=n")
    assert list_features(tree) == set()


@pytest.mark.parametrize("name", EXTRAS)
def test_pru_takes_one_in_place_of_analog_inputs(name, load):
    assert list_features(load("MACH_PRU=y", "PRU_%s=y" % (name,))) == {"WANT_ADC"}
    tree = load("MACH_PRU=y", "WANT_ADC=n", "PRU_%s=y" % (name,))
    assert list_features(tree) == {"WANT_" + name}
    assert not [w for w in tree.warnings if "PRU" in w], tree.warnings


def test_others_choose_freely(load):
    tree = load("MACH_AVR=y", "MACH_ATMEGA168=y")
    wanted = {"WANT_" + name for name in EXTRAS} | {"WANT_SOFTWARE_I2C", "WANT_TMCUART"}
    assert wanted <= list_prompts(tree)
    tree = load("MACH_AVR=y", "MACH_ATMEGA2560=y")
    assert wanted <= list_features(tree)
