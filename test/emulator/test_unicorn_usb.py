# SPDX-License-Identifier: GPL-3.0-or-later
"""STM32 firmware on USB: emulated chips on the bus of an emulated host.

The host (unicorn_usbhost.c) faults when a descriptor, a DATA packet or the end of
a transfer is not as the standard says; clocks and pins are checked by the models.
"""

import ctypes

import firmware_matrix
import pytest
import unicorn_board
from simboard import frame
from unicorn_board import UnicornBoard

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

# What these tests can do without
SMALL = tuple("WANT_%s=n" % name for name in (
    "BUTTONS", "PULSE_COUNTER", "NEOPIXEL", "TMCUART", "SOFTWARE_SPI",
    "SOFTWARE_I2C", "ADXL345", "HX71X", "LDC1612", "THERMOCOUPLE", "HD44780",
    "ST7920", "SPI", "I2C", "HARD_PWM", "ADC"))
USB = ("STM32_USB_PA11_PA12=y", *SMALL)


def some(quick, slow):
    """Cases of which most run only when asked for: each builds a firmware."""
    return [*quick, *(pytest.param(*([case] if isinstance(case, str) else case),
                                   marks=pytest.mark.slow) for case in slow)]


# One chip of each clock, packet memory and core
CHIPS = some(["stm32f042", "stm32f407"], [
    "stm32f070", "stm32f103", "stm32g0b1", "stm32g431", "stm32l412", "stm32f207",
    "stm32f446", "stm32f765", "stm32h723", "stm32h743"])
UNIQUE_ID = "30FFDA054D38353029045701"
# Tokens and answers of the host's packets
SETUP, OUT, IN = range(3)
ACK, NAK, STALL, NOTHING = range(4)


class Packet(ctypes.Structure):
    _fields_ = [("data", ctypes.c_uint8 * 64), ("len", ctypes.c_uint32),
                ("pid", ctypes.c_uint32)]


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.fixture(scope="module")
def build(tmp_path_factory):
    """build(chip, options): folder of a firmware, once for all tests."""
    def make(chip, options=USB):
        if options == USB and "usb_" + chip in firmware_matrix.CONFIGS:
            return firmware_matrix.build("usb_" + chip)
        name = "%s-%x" % (chip, abs(hash(options)))
        folder = tmp_path_factory.getbasetemp() / name
        return firmware_matrix.build(chip, options, folder)
    return make


@pytest.fixture
def make_board(adapter, build, monkeypatch):
    """make_board(chip, options, crystal): a chip whose port is open."""
    def make(chip, options=USB, crystal=8000000):
        unicorn_board.choose_chip(monkeypatch, build(chip, options), chip, crystal)
        board = UnicornBoard(adapter)
        board.run_for(0.1)
        board.identify()
        return board
    return make


def transact(board, token, endpoint, data=b"", pid=0):
    """(answer, data) of one packet that goes by the driver."""
    packet = Packet(len=len(data), pid=pid)
    packet.data[:len(data)] = data
    answer = board.library.unicorn_usb_transact(token, endpoint,
                                                ctypes.byref(packet))
    return answer, bytes(packet.data[:packet.len])


@pytest.mark.parametrize("chip", CHIPS)
def test_enumerates_and_answers(chip, make_board):
    board = make_board(chip)
    mcu = board.dictionary["config"]["MCU"]
    assert mcu.startswith(chip)
    assert [board.usb_text(i) for i in (1, 2, 3)] == ["Klipper", mcu, UNIQUE_ID]
    assert board.dictionary["config"]["RESERVE_PINS_USB"] == "PA11,PA12"
    assert "SERIAL_BAUD" not in board.dictionary["config"]
    # blocks of all lengths, so that packets are full, odd and split
    for size in range(0, 50, 7):
        data = bytes(range(size))
        assert board.query("debug_ping", "pong", data=data)["data"] == data


@pytest.mark.parametrize("chip", ["stm32f042", "stm32f407"])
def test_more_than_there_is_room_for(chip, make_board):
    """Packets wait at the host until the program has room; none is lost."""
    board = make_board(chip)
    n = len(board.messages)
    ping = board.commands["debug_ping"].encode({"data": b"0123456789" * 4})
    board.send_raw(b"".join(frame(board.seq + i, ping) for i in range(16)))
    board.run_for(0.1)
    answers = board.list_messages("pong", n)
    assert [a["data"] for a in answers] == [b"0123456789" * 4] * 16


@pytest.mark.parametrize("chip", some(["stm32f042", "stm32f407"], [
    "stm32f103", "stm32g0b1"]))
def test_reset_of_the_bus(chip, make_board):
    """Another host, or the same after a sleep: everything begins again."""
    board = make_board(chip)
    board.configure()
    board.library.unicorn_usb_replug()
    board.run_for(0.05)
    assert board.query("get_config", "config")["is_config"] == 1
    assert board.usb_text(3) == UNIQUE_ID


@pytest.mark.parametrize("chip", ["stm32f042", "stm32f407"])
def test_odd_packets(chip, make_board):
    """Empty packets, doubled ones, broken transfers: the port goes on."""
    board = make_board(chip)

    def setup(data):
        answer, _ = transact(board, SETUP, 0, bytes(data))
        board.run_for(0.001)
        return answer

    # a transfer that the host gives up, and one in its place
    assert setup([0x80, 6, 0, 1, 0, 0, 18, 0]) == ACK
    assert setup([0x80, 6, 0, 2, 0, 0, 9, 0]) == ACK
    answer, data = transact(board, IN, 0)
    assert answer == ACK and data[:2] == bytes([9, 2])
    board.run_for(0.001)
    assert transact(board, OUT, 0, b"", 1)[0] == ACK
    board.run_for(0.001)
    # a request that nobody knows
    assert setup([0x40, 99, 0, 0, 0, 0, 0, 0]) == ACK
    assert transact(board, IN, 0)[0] == STALL
    # a descriptor whose end is asked for only in part
    assert setup([0x80, 6, 3, 3, 9, 4, 2, 0]) == ACK
    assert transact(board, IN, 0) == (ACK, bytes([50, 3]))
    board.run_for(0.001)
    assert transact(board, OUT, 0, b"", 1)[0] == ACK
    board.run_for(0.001)
    assert board.query("get_config", "config")["is_config"] == 0
    # nobody there
    assert transact(board, IN, 5)[0] == NOTHING


@pytest.mark.parametrize("chip, in_rom", some(
    [("stm32f042", True), ("stm32f407", True)],
    [("stm32f072", True), ("stm32f103", False), ("stm32g0b1", True),
     ("stm32h743", True)]))
def test_touch_starts_the_boot_loader(chip, in_rom, make_board):
    """Closed at 1200 baud: a reset, and the loader in ROM if there is one."""
    board = make_board(chip)
    board.library.unicorn_usb_touch()
    board.run_for(0.1)
    assert board.resets
    board.library.unicorn_restart(200000)
    assert board.library.unicorn_is_in_rom() == in_rom


def test_reset_command_starts_the_program(make_board):
    board = make_board("stm32f407")
    board.send("reset")
    assert board.resets
    board.library.unicorn_restart(200000)
    assert not board.library.unicorn_is_in_rom()


@pytest.mark.parametrize("chip, registers", some(
    [("stm32f103", [0x40006C10, 0x40006C28])], [("stm32f407", [0x40002860])]))
def test_request_by_text_behind_a_hid_loader(chip, registers, make_board):
    """The text on the console that other programs send."""
    offset = "STM32_FLASH_START_%s=y" % ("1000" if chip == "stm32f103" else "4000")
    board = make_board(chip, ("STM32_USB_PA11_PA12=y", offset, *SMALL))
    board.send_raw(b"~ \x1c Request Serial Bootloader ! ~")
    assert not board.resets
    board.send_raw(b"~ \x1c Request Serial Bootloader!! ~")
    board.run_for(0.05)
    assert board.resets
    assert [board.library.unicorn_peek(r) for r in registers] == [0x424C] * len(
        registers)


@pytest.mark.parametrize("chip", some(["stm32f072"], ["stm32g431"]))
def test_request_to_katapult(chip, make_board):
    """It is known by a text in flash, and finds a number on its stack."""
    board = make_board(chip, ("STM32_USB_PA11_PA12=y", "STM32_FLASH_START_2000=y",
                              *SMALL))
    stack, code = 0x20000F00, 0x08000200
    words = [int.from_bytes(b"CanB", "little"), int.from_bytes(b"oot!", "little")]
    for addr, word in ((0x08000000, stack), (0x08000004, code | 1),
                       (code - 8, words[0]), (code - 4, words[1])):
        board.library.unicorn_poke(addr, ctypes.c_uint32(word))
    board.library.unicorn_usb_touch()
    board.run_for(0.1)
    assert board.resets
    number = [board.library.unicorn_peek(stack + i) % 2**32 for i in (0, 4)]
    assert number == [0x6CA1589B, 0x5984E3FA]


@pytest.mark.slow
@pytest.mark.parametrize("chip, crystal", [
    ("stm32f103", 12), ("stm32f072", 0), ("stm32f446", 25), ("stm32f407", 16),
    ("stm32h743", 25), ("stm32g0b1", 0)])
def test_other_crystals(chip, crystal, make_board):
    name = "%dM" % (crystal,) if crystal else "INTERNAL"
    board = make_board(chip, (*USB, "LOW_LEVEL_OPTIONS=y",
                              "STM32_CLOCK_REF_%s=y" % (name,)), crystal * 1000000)
    assert board.query("get_config", "config")["is_config"] == 0


@pytest.mark.slow
def test_on_other_pins(make_board):
    """An F042 of few pins: those of USB are where PA9 and PA10 were."""
    board = make_board("stm32f042", ("STM32_USB_PA11_PA12_REMAP=y", *SMALL))
    assert board.read_word(0x40010000) & 0x10


@pytest.mark.slow
def test_second_otg_core(make_board):
    board = make_board("stm32h743", ("STM32_USB_PB14_PB15=y", *SMALL))
    assert board.dictionary["config"]["RESERVE_PINS_USB1"] == "PB14,PB15"
    assert board.usb_text(3) == UNIQUE_ID


@pytest.mark.slow
def test_serial_number_of_ones_own(make_board):
    board = make_board("stm32f072", (
        *USB, "LOW_LEVEL_OPTIONS=y", "USB_SERIAL_NUMBER_CHIPID=n",
        'USB_SERIAL_NUMBER="bed"'))
    assert board.usb_text(3) == "bed"
