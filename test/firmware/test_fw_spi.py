# SPDX-License-Identifier: GPL-3.0-or-later
"""SPI devices: on a bus of the chip, and in software on any pins."""

import pytest

CS, MISO, MOSI, SCLK = 70, 71, 72, 73
PULSE = 10


class Device:
    """Answers with `answer`; takes and gives bits at the edges of its mode."""

    def __init__(self, board, mode, answer=b"", active=0):
        self.board, self.active = board, active
        self.idle, self.phase = mode >> 1, mode & 1
        self.answer = [byte >> i & 1 for byte in answer
                       for i in reversed(range(8))]
        self.bits, self.transfers = [], []
        self.selected = False
        self.mosi = self.sclk = None
        board.watchers.update({CS: self.note_select, MOSI: self.note_data,
                               SCLK: self.note_clock})
        board.inputs[MISO] = lambda clock: self.shown

    shown = 1

    def note_select(self, clock, level):
        self.selected = level == self.active
        if self.selected:
            assert self.sclk == self.idle
            self.bits, self.n_given = [], 0
            if not self.phase:
                self.give()
        elif self.bits and len(self.bits) % 8 == 0:
            self.transfers.append(bytes(
                int("".join(map(str, self.bits[i:i + 8])), 2)
                for i in range(0, len(self.bits), 8)))

    def give(self):
        if self.n_given < len(self.answer):
            self.shown = self.answer[self.n_given]
        self.n_given += 1

    def note_data(self, clock, level):
        self.mosi, self.changed = level, clock

    def note_clock(self, clock, level):
        self.sclk = level
        if not self.selected:
            return
        is_leading = level != self.idle
        if is_leading == bool(self.phase):
            self.give()
        else:
            assert clock - self.changed >= PULSE, "data is not steady"
            self.bits.append(self.mosi)


def configure_software(board, mode, active=0):
    board.configure(
        ("config_spi", dict(oid=0, pin=CS, cs_active_high=active)),
        ("spi_set_sw_bus", dict(oid=0, miso_pin=MISO, mosi_pin=MOSI,
                                sclk_pin=SCLK, mode=mode,
                                pulse_ticks=PULSE)),
        board.configure_shutdown_at(1, 200))


@pytest.mark.parametrize("mode", range(4))
@pytest.mark.parametrize("active", [0, 1])
def test_software_modes(board, mode, active):
    device = Device(board, mode, b"\x81\x5a\x00\xff", active)
    configure_software(board, mode, active)
    board.send("spi_transfer", oid=0, data=b"\xa5\x00\xff\x3c")
    board.run_for(.01)
    answer = board.list_messages("spi_transfer_response")
    assert [m["response"] for m in answer] == [b"\x81\x5a\x00\xff"]
    assert device.transfers == [b"\xa5\x00\xff\x3c"]
    assert not device.selected
    board.send("spi_send", oid=0, data=b"\x77")
    board.run_for(.01)
    assert device.transfers[1:] == [b"\x77"]
    assert len(board.list_messages("spi_transfer_response")) == 1
    assert board.list_edges(SCLK)[-1][1] == mode >> 1


@pytest.mark.parametrize("mode", range(4))
def test_software_clock(board, mode):
    Device(board, mode)
    configure_software(board, mode)
    board.run(1000)
    board.send("spi_send", oid=0, data=b"\x5a\xff")
    board.run_for(.01)
    clocks = [clock for clock, _ in board.list_edges(SCLK, 1)]
    assert len(clocks) == 2 * 16
    gaps = [b - a for a, b in zip(clocks, clocks[1:], strict=False)]
    assert set(gaps) == {PULSE}
    select = board.list_edges(CS, 1)
    assert [level for _, level in select] == [0, 1]
    assert select[0][0] <= clocks[0] and select[1][0] >= clocks[-1]


def test_two_modes_on_the_same_pins(board):
    device = Device(board, 3, b"\x12")
    board.configure(
        ("config_spi", dict(oid=0, pin=CS, cs_active_high=0)),
        ("config_spi", dict(oid=1, pin=CS + 9, cs_active_high=0)),
        *[("spi_set_sw_bus", dict(oid=oid, miso_pin=MISO, mosi_pin=MOSI,
                                  sclk_pin=SCLK, mode=mode,
                                  pulse_ticks=PULSE))
          for oid, mode in [(0, 3), (1, 0)]])
    board.send("spi_send", oid=1, data=b"\x55")
    board.send("spi_transfer", oid=0, data=b"\x34")
    board.run_for(.01)
    assert device.transfers == [b"\x34"]
    assert board.list_messages("spi_transfer_response")[0]["response"] == \
        b"\x12"


def test_hardware_bus(board):
    seen = []

    def device(data):
        level = board.list_edges(CS)[-1][1]
        seen.append((data, level))
        return bytes(byte ^ 0xff for byte in data)

    board.spi_devices[3] = device
    board.configure(
        ("config_spi", dict(oid=0, pin=CS, cs_active_high=1)),
        ("spi_set_bus", dict(oid=0, spi_bus=3, mode=1, rate=1000000)))
    assert board.query("spi_transfer", "spi_transfer_response", oid=0,
                       data=b"\x00\x0f\xaa")["response"] == b"\xff\xf0\x55"
    board.send("spi_send", oid=0, data=b"\x42")
    assert seen == [(b"\x00\x0f\xaa", 1), (b"\x42", 1)]
    assert board.list_edges(CS)[-1][1] == 0


def test_device_without_select(board):
    board.spi_devices[1] = lambda data: data[::-1]
    board.configure(
        ("config_spi_without_cs", dict(oid=4)),
        ("spi_set_bus", dict(oid=4, spi_bus=1, mode=0, rate=1)))
    assert board.query("spi_transfer", "spi_transfer_response", oid=4,
                       data=b"abc")["response"] == b"cba"
    assert board.edges == []


def test_words_of_farewell(board):
    """At a shutdown all devices are deselected, then told."""
    sent = []
    board.spi_devices[2] = lambda data: sent.append(
        (data, board.list_edges(CS)[-1][1],
         board.list_edges(CS + 1)[-1][1])) or data
    board.configure(
        ("config_spi", dict(oid=0, pin=CS, cs_active_high=0)),
        ("config_spi", dict(oid=1, pin=CS + 1, cs_active_high=0)),
        ("config_spi", dict(oid=2, pin=CS + 2, cs_active_high=0)),
        *[("spi_set_bus", dict(oid=oid, spi_bus=2, mode=0, rate=1))
          for oid in (0, 1)],
        ("config_spi_shutdown", dict(oid=3, spi_oid=0, shutdown_msg=b"one")),
        ("config_spi_shutdown", dict(oid=4, spi_oid=1, shutdown_msg=b"two")),
        ("config_spi_shutdown", dict(oid=5, spi_oid=2, shutdown_msg=b"no")),
        ("config_spi_shutdown", dict(oid=6, spi_oid=0, shutdown_msg=b"")))
    board.send("emergency_stop")
    assert sent[:2] == [(b"one", 0, 1), (b"two", 1, 0)]
    assert board.find_shutdown() == "Command request"
    assert [board.list_edges(pin)[-1][1] for pin in (CS, CS + 1)] == [1, 1]


def test_a_transfer_that_a_shutdown_breaks_off(board):
    device = Device(board, 0)
    configure_software(board, 0)
    board.shutdown_at(1, 1005)
    board.send("spi_send", oid=0, data=bytes(40))
    board.run_for(.01)
    assert board.find_shutdown() is not None
    assert 0 < len(device.bits) < 100
    assert not device.selected


@pytest.mark.parametrize("name, values, reason", [
    ("config_spi", dict(oid=0, pin=1, cs_active_high=0), "Can't assign oid"),
    ("config_spi", dict(oid=3, pin=256, cs_active_high=0),
     "Not an output pin"),
    ("spi_set_bus", dict(oid=1, spi_bus=8, mode=0, rate=1),
     "Invalid spi bus"),
    ("spi_set_bus", dict(oid=1, spi_bus=1, mode=4, rate=1),
     "Invalid spi config"),
    ("spi_set_bus", dict(oid=0, spi_bus=1, mode=0, rate=1),
     "Invalid spi config"),
    ("spi_set_sw_bus", dict(oid=0, miso_pin=1, mosi_pin=2, sclk_pin=3,
                            mode=0, pulse_ticks=9), "Invalid spi config"),
    ("spi_set_sw_bus", dict(oid=1, miso_pin=1, mosi_pin=2, sclk_pin=300,
                            mode=0, pulse_ticks=9), "Not an output pin"),
    ("spi_set_sw_bus", dict(oid=1, miso_pin=300, mosi_pin=2, sclk_pin=3,
                            mode=0, pulse_ticks=9), "Not a valid input pin"),
    ("spi_send", dict(oid=1, data=b"1"), "Invalid spi config"),
    ("spi_transfer", dict(oid=2, data=b"1"), "Invalid oid type"),
    ("config_spi_shutdown", dict(oid=3, spi_oid=2, shutdown_msg=b""),
     "Invalid oid type"),
])
def test_what_cannot_be(board, name, values, reason):
    board.send("allocate_oids", count=4)
    board.send("config_spi", oid=0, pin=CS, cs_active_high=0)
    board.send("spi_set_bus", oid=0, spi_bus=0, mode=0, rate=1)
    board.send("config_spi_without_cs", oid=1)
    board.send("config_trsync", oid=2)
    board.send(name, **values)
    assert board.find_shutdown() == reason
