# SPDX-License-Identifier: GPL-3.0-or-later
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample_dictionary import dictionary_json, dictionary_zlib

from klippy import msgproto
from klippy.errors import McuError
from klippy.msgformat import get_int, put_int
from klippy_ext import msgblock


def make_parser():
    parser = msgproto.MessageParser(warn_prefix="mcu 'toy': ")
    parser.process_identify(dictionary_zlib())
    return parser


@given(st.integers(-2**31, 2**31 - 1))
def test_integers_agree_with_the_c_core(value):
    out = bytearray()
    put_int(out, value)
    assert get_int(bytes(out), 0) == (value, len(out))
    assert msgblock.decode_int(bytes(out)) == (value & 0xffffffff, len(out))
    assert get_int(msgblock.encode_int(value), 0)[0] == value
    assert len(out) == len(msgblock.encode_int(value))


@given(st.binary(max_size=59))
def test_any_payload_is_survived(data):
    make_parser().parse_payload(data)


def test_constants_and_versions():
    parser = make_parser()
    assert parser.get_version_info() == ("v1.2.3", "gcc 12")
    assert parser.get_constant_float("ADC_MAX") == 4095.
    assert parser.get_constant_int("CLOCK_FREQ") == 16000000
    assert parser.get_constant("NONE", "x") == "x"
    with pytest.raises(McuError, match="'NONE' of mcu 'toy': firmware 'v1.2.3'"):
        parser.get_constant("NONE")
    with pytest.raises(msgproto.error, match="unusable value 'toy'"):
        parser.get_constant_float("MCU")


def test_enumeration_ranges_are_expanded():
    pins = make_parser().get_enumerations()["pin"]
    assert pins["PA0"] == 0 and pins["PA7"] == 7 and pins["ADC_TEMPERATURE"] == 254
    assert "PA8" not in pins


def test_command_text_round_trip():
    parser = make_parser()
    text = ("config_stepper oid=3 step_pin=PA3 dir_pin=7 invert_step=1"
            " step_pulse_ticks=99")
    data = parser.create_command(text)
    assert data == bytes((7, 3, 3, 7, 1)) + msgblock.encode_int(99)
    assert parser.dump_payload(data) == [text.replace("dir_pin=7", "dir_pin=PA7")]


def test_clock_of_64_bits_in_a_text_is_sent_modulo_32():
    parser = make_parser()
    text = "queue_step oid=1 interval=%d count=1 add=0"
    for clock in ((1 << 32) + 5, (7 << 40) + 5):
        assert parser.create_command(text % clock) == parser.create_command(text % 5)


def test_bytes_field_round_trip():
    parser = make_parser()
    data = parser.create_command("spi_send oid=1 data=00ff7e")
    message = parser.lookup_command("spi_send oid=%c data=%*s")
    assert data == message.encode([1, b"\x00\xff\x7e"])
    assert data == message.encode_by_name(oid=1, data=[0, 255, 126])
    assert parser.parse_payload(data)[0]["data"] == b"\x00\xff\x7e"


def test_signed_and_unsigned_fields():
    parser = make_parser()
    step = parser.lookup_command("queue_step oid=%c interval=%u count=%hu add=%hi")
    params = parser.parse_payload(step.encode([1, 0xfffffff0, 65535, -32768]))[0]
    assert params == {"#name": "queue_step", "oid": 1, "interval": 0xfffffff0,
                      "count": 65535, "add": -32768}
    position = parser.lookup_command("stepper_position oid=%c pos=%i")
    assert parser.parse_payload(position.encode([1, -5]))[0]["pos"] == -5


def test_several_messages_in_a_block_and_enumerated_reason():
    parser = make_parser()
    data = bytes((20, 5, 21, 6, 2, 21, 6, 3))
    assert parser.parse_payload(data) == [
        {"#name": "clock", "clock": 5},
        {"#name": "shutdown", "clock": 6, "static_string_id": "Timer too close"},
        {"#name": "shutdown", "clock": 6, "static_string_id": "?3"}]
    block = parser.encode_msgblock(3, data[:2])
    assert parser.parse(block) == {"#name": "clock", "clock": 5}
    assert parser.check_packet(block) == len(block)
    assert parser.dump(block) == ["seq: 13", "clock clock=5"]


def test_output_and_unknown_messages():
    parser = make_parser()
    params = parser.parse_payload(bytes((30, 5, 2, 0xab, 0xcd)))[0]
    assert params == {"#name": "#output", "#msg": "value 5 of abcd is 100%, 5%"}
    assert parser.dump_payload(bytes((77, 1))) == ["#unknown 4d01"]


def test_truncated_message_is_dropped_but_not_what_precedes():
    assert make_parser().parse_payload(bytes((20, 5, 20))) == [
        {"#name": "clock", "clock": 5}]
    assert make_parser().parse_payload(bytes((23, 1, 5, 20, 1))) == []


@pytest.mark.parametrize("text,match", [
    ("config_endstop oid=1 pin=PB1 pull_up=0", "'pin' of command 'config_endstop'"),
    ("config_endstop oid=256 pin=PA1 pull_up=0", "from -128 to 255, not 256"),
    ("config_endstop oid=1 pin=PA1", "does not have the fields"),
    ("config_endstop oid=1 pin=PA1 pull_up=0 pull_up=0", "does not have the fields"),
    ("config_endstp", "did you mean 'config_endstop'"),
    ("spi_send oid=1 data=xyz", "hexadecimal"), ("", "no command")])
def test_bad_command_text(text, match):
    with pytest.raises(msgproto.error, match=match):
        make_parser().create_command(text)


def test_lookup_tells_missing_from_different():
    parser = make_parser()
    assert parser.lookup_msgtag("get_clock") == 2
    with pytest.raises(msgproto.error, match="Unknown command: 'reset'"):
        parser.lookup_command("reset")
    with pytest.raises(msgproto.error, match="mismatch.*where the host needs"):
        parser.lookup_command("config_endstop oid=%c pin=%u")
    with pytest.raises(msgproto.error, match="takes 3 values"):
        parser.lookup_command("config_endstop oid=%c pin=%c pull_up=%c").encode([1])


@pytest.mark.parametrize("data,decompress,match", [
    (dictionary_zlib()[:-30], True, "cannot be decompressed"),
    (b"nonsense", True, "cannot be decompressed"),
    (dictionary_json()[:-3], False, "not valid JSON"),
    (b"\xff\xfe", False, "not valid JSON"),
    (b"[1]", False, "must be a JSON object, not list"),
    (dictionary_json(commands=None), False, "lacks its table commands"),
    (dictionary_json(responses={"x y=%q": 5}), False, "unknown type '%q'"),
    (dictionary_json(commands={"x": "5"}), False, "has the id '5'")])
def test_bad_dictionary(data, decompress, match):
    with pytest.raises(msgproto.error, match=match):
        msgproto.MessageParser().process_identify(data, decompress)


def test_added_pin_names():
    parser = make_parser()
    parser.fill_enumerations({"pin": {"P1.4": 9}})
    data = parser.create_command("config_endstop oid=1 pin=P1.4 pull_up=0")
    assert data[2] == 9
    assert parser.create_command("config_endstop oid=1 pin=PA2 pull_up=0")[2] == 2
