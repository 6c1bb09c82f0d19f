# SPDX-License-Identifier: GPL-3.0-or-later
import zlib

import pytest

from klippy import msgproto, pins
from klippy.errors import ConfigError
from klippy.mcu.configphase import ConfigPhase

DICTIONARY = b"""{"commands": {
 "allocate_oids count=%c": 2, "finalize_config crc=%u": 3,
 "config_endstop oid=%c pin=%c pull_up=%c": 4, "start oid=%c": 5, "halt oid=%c": 6},
 "responses": {}, "config": {}, "enumerations": {"pin": {"PA0": [0, 16]}}}"""


@pytest.fixture
def parser():
    result = msgproto.MessageParser()
    result.process_identify(DICTIONARY, decompress=False)
    return result


def make_phase(pin="PA3"):
    phase = ConfigPhase("mcu")
    oid = phase.create_oid()

    def build():
        phase.add("config_endstop oid=%d pin=%s pull_up=1" % (oid, pin))
        phase.add("start oid=%d" % (oid,), is_init=True)
        phase.add("halt oid=%d" % (oid,), on_restart=True)

    phase.add_callback(build)
    return phase


def text_of(parser, phase, is_configured):
    return [line for cmd in phase.encode(parser, is_configured)
            for line in parser.dump_payload(cmd)]


def test_order_of_commands(parser):
    phase = make_phase()
    phase.build(parser, pins.PinResolver("mcu"))
    assert text_of(parser, phase, False) == [
        "allocate_oids count=1", "config_endstop oid=0 pin=PA3 pull_up=1",
        "finalize_config crc=%d" % (phase.crc,), "start oid=0"]
    assert text_of(parser, phase, True) == ["halt oid=0", "start oid=0"]
    assert phase.crc == zlib.crc32(
        b"allocate_oids count=1\nconfig_endstop oid=0 pin=PA3 pull_up=1")


def test_callbacks_may_register_more(parser):
    phase = make_phase()

    def more():
        phase.add_callback(lambda: phase.add("start oid=9", is_init=True))

    phase.add_callback(more)
    phase.build(parser, pins.PinResolver("mcu"))
    assert text_of(parser, phase, True)[-1] == "start oid=9"


def test_aliases_do_not_change_the_checksum(parser):
    direct, aliased = make_phase("PA3"), make_phase("Z_MIN")
    resolver = pins.PinResolver("mcu")
    resolver.alias_pin("Z_MIN", "PA3")
    direct.build(parser, pins.PinResolver("mcu"))
    aliased.build(parser, resolver)
    assert direct.crc == aliased.crc


def test_unknown_pin_is_named_with_near_ones(parser):
    phase = make_phase("PA33")
    phase.build(parser, pins.PinResolver("mcu"))
    with pytest.raises(ConfigError, match="'PA33' is not a valid pin.*'mcu'.*'PA3'"):
        phase.encode(parser, False)


def test_building_again_gives_the_same(parser):
    """For an mcu that was away: what callbacks add is not there twice."""
    phase = make_phase()
    phase.add_callback(lambda: phase.add(
        "config_endstop oid=%d pin=PA4 pull_up=0" % (phase.create_oid(),)))
    phase.build(parser, pins.PinResolver("mcu"))
    first, crc = text_of(parser, phase, False), phase.crc
    phase.build(parser, pins.PinResolver("mcu"))
    assert text_of(parser, phase, False) == first and phase.crc == crc
    assert phase.oid_count == 2
