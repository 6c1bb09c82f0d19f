# SPDX-License-Identifier: GPL-3.0-or-later
"""An SD card at an emulated STM32F4: made ready, written and read by blocks."""

import struct

import firmware_matrix
import pytest
import unicorn_board
from unicorn_board import UnicornBoard

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

CHIPS = ["stm32f446", pytest.param("stm32f407", marks=pytest.mark.slow),
         pytest.param("stm32f401", marks=pytest.mark.slow)]
NONE, SHORT, LONG = 0, 1, 3
BLOCK, RCA = 512, 0x1234


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.fixture
def make_board(adapter, monkeypatch):
    def make(chip, blocksize=BLOCK):
        unicorn_board.choose_chip(monkeypatch, firmware_matrix.build(chip), chip)
        board = UnicornBoard(adapter)
        board.identify()
        board.configure(("config_sdio", dict(oid=0, blocksize=blocksize)))
        return board
    return make


def command(board, number, argument=0, wait=SHORT):
    """(name of the error, words of the answer)"""
    begin = len(board.messages)
    board.send("sdio_send_command", oid=0, cmd=number, argument=argument, wait=wait)
    board.run_for(.002)
    answer, = board.list_messages("sdio_send_command_response", begin)
    names = {v: k for k, v in board.dictionary["enumerations"]["sdio_error"].items()}
    data = answer["response"]
    return names[answer["error"]], struct.unpack("<%dI" % (len(data) // 4,), data)


def start_card(board):
    """From power to transfer, as the specification of SD cards has it."""
    board.send("sdio_set_bus", oid=0, sdio_bus=0)
    board.send("sdio_set_speed", oid=0, speed=400000)
    assert command(board, 0, 0, NONE) == ("none", ())
    assert command(board, 8, 0x1AA) == ("none", (0x1AA,))
    for _ in range(9):
        assert command(board, 55)[0] == "none"
        error, (ocr,) = command(board, 41, 0x40100000)
        assert error == "none"      # its answer has no checksum
        if ocr >> 31:
            break
    error, cid = command(board, 2, 0, LONG)
    assert error == "none" and cid[0] >> 8 & 0xFFFF == 0x5344 and len(cid) == 4
    error, (rca,) = command(board, 3)
    assert rca >> 16 == RCA
    assert command(board, 7, RCA << 16)[0] == "none"
    board.send("sdio_set_speed", oid=0, speed=25000000)


def widen(board):
    """Four bits a clock."""
    assert command(board, 55, RCA << 16)[0] == "none"
    assert command(board, 6, 2)[0] == "none"


def read_block(board, number):
    begin = len(board.messages)
    board.send("sdio_read_data", oid=0, cmd=17, argument=number)
    board.run_for(.01)
    answer, = board.list_messages("sdio_read_data_response", begin)
    if answer["error"]:
        return answer["error"]
    assert answer["read"] == BLOCK
    data = b""
    for offset in range(0, BLOCK, 32):
        part = board.query("sdio_read_data_buffer", "sdio_read_data_buffer_response",
                           oid=0, offset=offset, len=32)
        data += part["data"]
    return data


def write_block(board, number, data):
    for offset in range(0, BLOCK, 32):
        board.send("sdio_write_data_buffer", oid=0, offset=offset,
                   data=data[offset:offset + 32])
    begin = len(board.messages)
    board.send("sdio_write_data", oid=0, cmd=24, argument=number)
    board.run_for(.01)
    answer, = board.list_messages("sdio_write_data_response", begin)
    return answer["error"], answer["write"]


@pytest.mark.parametrize("chip", CHIPS)
@pytest.mark.parametrize("is_wide", [False, True])
def test_blocks_come_and_go(chip, is_wide, make_board):
    board = make_board(chip)
    constants = board.dictionary["config"]
    assert constants["BUS_PINS_sdio"] == "PC12,PD2,PC8,PC9,PC10,PC11"
    assert board.dictionary["enumerations"]["sdio_bus"] == {"sdio": 0}
    start_card(board)
    if is_wide:
        widen(board)
    first = bytes((5 * 31 + j * 7) & 0xFF for j in range(BLOCK))
    assert read_block(board, 5) == first
    data = bytes((i * i + 3) & 0xFF for i in range(BLOCK))
    assert write_block(board, 6, data) == (0, BLOCK)
    assert read_block(board, 6) == data and read_block(board, 5) == first
    assert board.find_shutdown() is None


def test_what_goes_wrong_is_told(make_board):
    """A command that no card knows, blocks that are not there, no card's width."""
    board = make_board("stm32f446")
    errors = board.dictionary["enumerations"]["sdio_error"]
    start_card(board)
    assert command(board, 5)[0] == "no_answer"
    assert command(board, 13, RCA << 16, LONG)[0] == "bad_crc"
    begin = len(board.messages)
    board.send("sdio_read_data", oid=0, cmd=17, argument=64)
    board.run_for(.15)
    answer, = board.list_messages("sdio_read_data_response", begin)
    assert answer["error"] == errors["data_timeout"] and answer["read"] == 0
    # and the card goes on
    assert isinstance(read_block(board, 1), bytes)


@pytest.mark.parametrize("name, values, reason", [
    ("sdio_set_bus", dict(sdio_bus=1), "Invalid sdio bus"),
    ("sdio_read_data", dict(cmd=17, argument=0), "Invalid sdio bus"),
    ("sdio_read_data_buffer", dict(offset=500, len=13),
     "Invalid sdio buffer offset"),
    ("sdio_read_data_buffer", dict(offset=0, len=49), "Invalid sdio buffer offset"),
    ("sdio_write_data_buffer", dict(offset=0xFFFFFFFF, data=b"x"),
     "Invalid sdio buffer offset")])
def test_refused(name, values, reason, make_board):
    board = make_board("stm32f446")
    if reason != "Invalid sdio bus":
        board.send("sdio_set_bus", oid=0, sdio_bus=0)
    board.send(name, oid=0, **values)
    assert board.find_shutdown() == reason


@pytest.mark.parametrize("size", [0, 500, 4096])
def test_odd_block_sizes(size, make_board):
    assert make_board("stm32f446", size).find_shutdown() == "Invalid sdio block size"
