# SPDX-License-Identifier: GPL-3.0-or-later
"""The firmware's parser, dictionary, configuration and shutdown."""

import json

import pytest
from simboard import encode_int, frame


def test_identify_serves_the_dictionary(board, simulator_so):
    config = board.dictionary["config"]
    assert config["CLOCK_FREQ"] == board.freq == 20000000
    assert config["MCU"] == "simulator"
    assert config["STATS_SUMSQ_BASE"] == 256
    assert board.dictionary["enumerations"]["pin"]["gpio0"] == [0, 256]
    text = simulator_so.with_name("klipper.dict").read_text()
    assert json.loads(text) == board.dictionary


def test_identify_beyond_the_end_is_empty(board):
    answer = board.query("identify", "identify_response", offset=1 << 30,
                         count=40)
    assert answer["data"] == b"" and answer["offset"] == 1 << 30


def test_pin_names(board):
    find = board.ops.find_pin
    assert [find(n) for n in (b"gpio0", b"gpio255", b"ADC_TEMPERATURE")] == [
        0, 255, 254]
    assert [find(n) for n in (b"gpio256", b"gpio", b"PA1", b"gpio1x")] == [
        -1] * 4


def test_start_says_starting(board):
    board.power_on(board.clock)
    assert [m["#name"] for m in board.messages] == ["starting"]


def test_each_block_is_acknowledged_in_sequence(board):
    start = len(board.blocks)
    for _ in range(20):
        board.send("debug_nop")
    seqs = [block[1] & 15 for _, block in board.blocks[start:]]
    assert seqs == [(board.seq - 19 + i) % 16 for i in range(20)]


def test_ping_returns_any_bytes(board):
    data = bytes(range(0, 250, 5))[:48]
    assert board.query("debug_ping", "pong", data=data)["data"] == data


@pytest.mark.parametrize("value", [
    0, 95, 96, -32 % 2**32, -33 % 2**32, 0x2fff, 0x3000, 1 << 20, 1 << 31,
    2**32 - 1, 0xffffffe0, 0x5fffffff])
def test_integers_survive(board, value):
    board.send("debug_write", order=2, addr=4, val=value)
    assert board.query("debug_read", "debug_result", order=2,
                       addr=4)["val"] == value


@pytest.mark.parametrize("spoil", [
    lambda b: b[:3] + bytes([b[3] ^ 1]) + b[4:],
    lambda b: bytes([80]) + b[1:],
    lambda b: b[:1] + bytes([b[1] | 0x80]) + b[2:],
    lambda b: b[:-1] + b"\x00\x7e",
    lambda b: b"\0" + b[2:],
    lambda b: b"garbage" + b,
])
def test_broken_block_is_asked_for_again(board, spoil):
    block = frame(board.seq, board.commands["get_clock"].encode({}))
    n_messages, n_blocks = len(board.messages), len(board.blocks)
    board.send_raw(spoil(block))
    new = board.blocks[n_blocks:]
    assert new and all(len(b) == 5 for _, b in new[:1])
    assert new[0][1][1] & 15 == board.seq & 15
    if len(new) == 1:
        assert board.messages[n_messages:] == []
        board.send("get_clock")
    assert board.list_messages("clock", n_messages)


def test_block_out_of_sequence_is_not_run(board):
    n = len(board.messages)
    board.send_raw(frame(board.seq + 3,
                         board.commands["get_clock"].encode({})))
    assert board.messages[n:] == []
    assert board.blocks[-1][1][1] & 15 == board.seq & 15


def test_block_in_pieces_and_two_at_once(board):
    payload = board.commands["get_clock"].encode({})
    n = len(board.messages)
    block = frame(board.seq, payload)
    for byte in block:
        board.send_raw(bytes([byte]))
    board.send_raw(frame(board.seq + 1, payload)
                   + frame(board.seq + 2, payload + payload))
    board.seq += 3
    assert len(board.list_messages("clock", n)) == 4


def test_lone_sync_bytes_are_silent(board):
    n = len(board.blocks)
    board.send_raw(b"\x7e\x7e\x7e")
    assert len(board.blocks) == n


@pytest.mark.parametrize("payload, reason", [
    (encode_int(3000), "Invalid command"),
    (encode_int(-5), "Invalid command"),
    (encode_int(0), "Invalid command"),
    (b"\x81\x80\x80\x80\x80\x80\x01", "Command parser error"),
    (encode_int(1) + b"\x05", "Command parser error"),
])
def test_unusable_command_shuts_down(board, payload, reason):
    board.send_block(payload)
    assert board.find_shutdown() == reason
    board.send("get_clock")
    assert board.messages[-1]["#name"] == "clock"


def test_an_answer_is_no_command(board):
    board.send_block(encode_int(board.identify()["responses"]["is_shutdown"
                                                             " static_string_id=%hu"]))
    assert board.find_shutdown() == "Invalid command"


def test_truncated_byte_string_shuts_down(board):
    ping = board.commands["debug_ping"].msg_id
    board.send_block(encode_int(ping) + bytes([20]) + b"short")
    assert board.find_shutdown() == "Command parser error"


def test_shutdown_blocks_commands_until_cleared(board):
    board.send("emergency_stop")
    assert board.find_shutdown() == "Command request"
    board.send("allocate_oids", count=3)
    assert board.messages[-1]["#name"] == "is_shutdown"
    assert board.query("get_config", "config")["is_shutdown"] == 1
    board.send("clear_shutdown")
    board.send("allocate_oids", count=3)
    assert board.query("get_config", "config")["is_shutdown"] == 0


def test_rest_of_a_block_after_a_shutdown_is_dropped(board):
    stop = board.commands["emergency_stop"].encode({})
    n = len(board.messages)
    board.send_block(stop + board.commands["get_clock"].encode({}))
    assert [m["#name"] for m in board.messages[n:]] == ["shutdown"]


def test_clear_without_shutdown(board):
    board.send("clear_shutdown")
    assert board.find_shutdown() == "Shutdown cleared when not shutdown"


def test_configuration_is_remembered(board):
    assert board.query("get_config", "config")["is_config"] == 0
    board.configure(("config_endstop", dict(oid=3, pin=7, pull_up=1)),
                    crc=0xdeadbeef)
    answer = board.query("get_config", "config")
    assert answer["is_config"] == 1 and answer["crc"] == 0xdeadbeef
    assert answer["move_count"] > 1000


@pytest.mark.parametrize("name, values, reason", [
    ("allocate_oids", dict(count=4), "oids already allocated"),
    ("config_trsync", dict(oid=3), "Can't assign oid"),
    ("config_trsync", dict(oid=20), "Can't assign oid"),
    ("trsync_trigger", dict(oid=1, reason=1), "Invalid oid type"),
    ("trsync_trigger", dict(oid=77, reason=1), "Invalid oid type"),
])
def test_wrong_use_of_oids(board, name, values, reason):
    board.send("allocate_oids", count=20)
    board.send("config_trsync", oid=3)
    board.send(name, **values)
    assert board.find_shutdown() == reason


def test_config_after_finalize(board):
    board.configure()
    board.send("config_trsync", oid=3)
    assert board.find_shutdown() == "Already finalized"


def test_uptime_counts_wraps(make_board):
    board = make_board((3 << 32) - 1000)
    board.run_for(300.)
    high = board.query("get_uptime", "uptime")["high"]
    board.run_for(300.)
    assert board.query("get_uptime", "uptime")["high"] == high + 1


def test_stats_every_five_seconds(board):
    board.run_for(26.)
    clocks = [m["#clock"] for m in board.list_messages("stats")]
    assert clocks == [board.freq * 5 * i + clocks[0]
                      for i in range(5)]


def test_reset_asks_the_world(board):
    board.send("reset")
    assert board.resets == [board.clock]
    board.configure()
    board.power_on(board.clock)
    assert board.query("get_config", "config")["is_config"] == 0


def test_instances_are_independent(make_board):
    first, second = make_board(), make_board(12345)
    first.send("emergency_stop")
    assert second.query("get_config", "config")["is_shutdown"] == 0
    assert second.query("get_clock", "clock")["clock"] == 12345
