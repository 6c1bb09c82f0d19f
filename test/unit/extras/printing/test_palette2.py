# SPDX-License-Identifier: GPL-3.0-or-later
"""[palette2] with a modelled device on the simulated machine, and its parts alone."""
import os
import struct
import tty

import pytest
from machine_configs import make_axes
from printer_run import PrinterRun

from klippy import seriallink
from klippy.errors import CommandError
from klippy.extras import omega_code, palette_job, palette_load, palette_port

LONG_MOVES = "max_extrude_only_distance: 300\n"
SECTIONS = """
[virtual_sdcard]
path: %s
[palette2]
serial: /dev/ttyUSB7
auto_load_speed: 20
"""


def encode(value):
    return "D%08x" % struct.unpack(">I", struct.pack(">f", value))


MOVES = ["G1 E%d F600" % (at,) for at in range(10, 250, 10)]


def make_file(lengths=(100.0, 200.0), pings=(), moves=MOVES):
    """A file as slicers write it for a Palette 2."""
    lines = ["O21 D0014", "O22 D0a0b0c0d0e0f", "O23 D0001", "O24 D0000",
             "O25 D1ff0000RedPLA D100ff00GreenPLA D0 D0",
             "O26 D%04x" % len(lengths), "O27 D%04x" % len(pings), "O28 D0002",
             "O29 D0000"]
    lines += ["O30 D%d %s" % (i % 2, encode(length))
              for i, length in enumerate(lengths)]
    lines += ["O32 D11 D0000 D0000 D0000", "O32 D12 D0000 D0000 D0000",
              "O1 DTwo_Colors D%08x" % round(lengths[-1]), "M0", "T0",
              "G92 E0", "M82", *moves]
    return "\n".join(lines) + "\n"


class Life:
    """A printer with the device; file: text that print() prints."""

    def __init__(self, tmp_path, file="", sections=""):
        self.folder = tmp_path
        (tmp_path / "job.mcf.gcode").write_text(file)
        config = make_axes("cartesian", extra=LONG_MOVES) + SECTIONS % tmp_path
        self.run = PrinterRun(config + sections, tmp_path)
        self.device = self.run.machine.palette
        self.states = []

    def live(self, body):
        """Call body(self) with the printer up and homed."""
        self.run.run([self._begin, lambda printer: body(self)])
        return self

    def _begin(self, printer):
        self.printer, self.reactor = printer, printer.get_reactor()
        self.gcode = printer.lookup_object("gcode")
        self.send("G28")

    def send(self, script):
        self.gcode.run_script(script)

    def status(self, name="palette2"):
        return self.printer.lookup_object(name).get_status(self.reactor.monotonic())

    def wait(self, seconds):
        self.reactor.pause(self.reactor.monotonic() + seconds)

    def wait_until(self, is_so, seconds=120.0):
        limit = self.reactor.monotonic() + seconds
        while not is_so():
            assert self.reactor.monotonic() < limit, "\n".join(
                self.device.log[-20:] + self.run.responses[-10:])
            self.wait(0.2)

    def start(self):
        self.send("SDCARD_PRINT_FILE FILENAME=job.mcf.gcode")
        self.wait_until(lambda: self.status()["remaining_load_length"] is not None)

    def finish(self):
        self.wait_until(lambda: self.status("print_stats")["state"] in (
            "complete", "cancelled", "error"))
        return self.status("print_stats")["state"]

    def has_told(self, text):
        return any(text in line for line in self.run.responses)

    def list_sent(self, head):
        return [line[2:] for line in self.device.log
                if line.startswith("< " + head)]


def test_a_print_from_the_first_line_to_the_last(tmp_path):
    file = make_file(pings=(60.0, 120.0), moves=(
        "G1 E60 F600", "O31 " + encode(60.0), "G1 E120", "O31 " + encode(120.0),
        *MOVES[12:]))
    speeds = []

    def body(life):
        life.start()
        assert life.status("print_stats")["state"] == "paused"
        assert life.status()["remaining_load_length"] == 120
        life.send("PALETTE_SMART_LOAD")
        life.wait_until(lambda: life.status()["remaining_load_length"] == 0)
        assert life.status("gcode_move")["gcode_position"].e == 0.0
        life.wait_until(lambda: life.status("print_stats")["state"] == "printing")
        while life.status("print_stats")["state"] == "printing":
            speeds.append((life.status()["is_splicing"],
                           round(life.status("gcode_move")["speed_factor"], 2)))
            life.wait(0.5)

    life = Life(tmp_path, file).live(body)
    lines = file.split("\n")
    assert life.status("print_stats")["state"] == "complete"
    sent = [line[2:] for line in life.device.log if line.startswith("< O")]
    assert [line for line in sent if line[:3] in ("O21", "O25", "O30", "O32")] == [
        line for line in lines if line[:3] in ("O21", "O25", "O30", "O32")]
    assert life.device.splices == [100.0, 200.0]
    # the encoder's word for each ping, at the moment when the extruder was there
    assert [told for told, _ in life.device.pings] == [60.0, 120.0]
    assert [moved for _, moved in life.device.pings] == pytest.approx(
        [60.0, 120.0], abs=4.0)
    assert life.status()["ping"] is None or life.has_told("ping 2:")
    assert {(True, 0.8), (False, 1.0)} <= set(speeds), set(speeds)
    assert life.has_told("all splices are made")


def test_nothing_is_asked_before_it_is_connected(tmp_path):
    def body(life):
        for name in ("CUT", "CLEAR", "SMART_LOAD"):
            with pytest.raises(CommandError, match="PALETTE_CONNECT"):
                life.send("PALETTE_" + name)
        life.send("PALETTE_CONNECT")
        life.send("PALETTE_CUT\nPALETTE_CLEAR")
        with pytest.raises(CommandError, match="no filament to load"):
            life.send("PALETTE_SMART_LOAD")
        life.wait(1.0)
        assert life.has_told("firmware 9.0.9")
        assert life.status() == {"ping": None, "remaining_load_length": None,
                                 "is_splicing": False}
        life.send("PALETTE_DISCONNECT")
        assert life.device.port is None

    life = Life(tmp_path)
    life.live(body)
    assert life.list_sent("O10") == [omega_code.CUT, *omega_code.CLEAR]


def test_a_device_that_is_off(tmp_path):
    def body(life):
        life.device.is_mute = True
        with pytest.raises(CommandError, match="no answer on '/dev/ttyUSB7' at 115200"):
            life.send("PALETTE_CONNECT")
        life.send("SDCARD_PRINT_FILE FILENAME=job.mcf.gcode")
        life.wait_until(lambda: life.status("print_stats")["state"] == "paused")
        assert "no answer on" in life.status("print_stats")["message"]
        assert life.device.port is None

    Life(tmp_path, make_file()).live(body)


def test_a_device_that_falls_silent_at_rest(tmp_path):
    def body(life):
        life.send("PALETTE_CONNECT")
        life.wait(20.0)
        assert life.device.port is not None
        life.device.is_mute = True
        life.wait(5.0)
        assert life.device.port is None and life.has_told("connection lost")
        life.device.is_mute = False
        life.send("PALETTE_CONNECT")

    Life(tmp_path).live(body)


def test_filament_that_does_not_come(tmp_path):
    def body(life):
        life.start()
        life.device.is_stuck = True
        life.device.load_start = 0.0
        life.send("PALETTE_SMART_LOAD")
        with pytest.raises(CommandError, match="is being loaded already"):
            life.send("PALETTE_SMART_LOAD")
        life.wait_until(lambda: life.has_told("did not move"))
        assert life.list_sent("O102") == ["O102 D0", "O102 D1"]
        life.device.is_stuck = False
        life.send("PALETTE_SMART_LOAD")
        assert life.finish() == "complete"

    Life(tmp_path, make_file()).live(body)


def test_pings_that_differ_too_much_end_the_print(tmp_path):
    pings = [30.0 * i for i in range(1, 6)]
    moves = [line for at in pings for line in ("G1 E%.1f F600" % at,
                                               "O31 " + encode(at))]

    def body(life):
        life.start()
        life.send("PALETTE_SMART_LOAD")
        life.wait_until(lambda: len(life.device.pings) == 2)
        life.device.slip = 0.7
        assert life.finish() == "cancelled"
        assert life.has_told("more than auto_cancel_variation")
        life.wait(3.0)
        assert life.list_sent("O0") == ["O0"]

    Life(tmp_path, make_file(pings=pings, moves=moves),
                "auto_cancel_variation: 0.1").live(body)


@pytest.mark.parametrize("by_user", [True, False])
def test_cancelled_by_either_side(tmp_path, by_user):
    def body(life):
        life.start()
        if by_user:
            life.send("CANCEL_PRINT")
        else:
            life.device.say("O97 U0 D2")
        assert life.finish() == "cancelled"
        life.wait(4.0)
        assert life.list_sent("O0") == (["O0"] if by_user else [])

    Life(tmp_path, make_file()).live(body)


@pytest.mark.parametrize("word", ["O100", "O88 D0f"])
def test_a_device_that_stops_the_print(tmp_path, word):
    def body(life):
        life.start()
        life.send("PALETTE_SMART_LOAD")
        life.wait_until(lambda: life.status("print_stats")["state"] == "printing")
        life.device.say(word)
        life.wait_until(lambda: life.status("pause_resume")["is_paused"])
        assert life.has_told("error 15") == (word != "O100")
        life.device.say("O40")
        assert life.finish() == "complete"

    Life(tmp_path, make_file()).live(body)


def test_a_cable_that_is_pulled(tmp_path):
    def body(life):
        life.start()
        life.send("PALETTE_SMART_LOAD")
        life.wait_until(lambda: life.status("print_stats")["state"] == "printing")
        life.printer.lookup_object("palette2").link.lose("Input/output error")
        life.wait_until(lambda: life.status("pause_resume")["is_paused"])
        assert life.has_told("connection lost (Input/output error)")

    Life(tmp_path, make_file()).live(body)


@pytest.mark.parametrize("words,told", [
    (["O20 D1"], "asks for more splices (O30) than the 2 of the file"),
    (["O20 D2"], "asks for a ping"), (["O20 D5"], "used for the first time"),
    (["O34 D0"], "a ping was missed"), (["O97 U39 D7"], "7 mm too much"),
    (["O20 D7", "O20", "O34 D1 Dx", "O97", "Oops", "O50 Dx.y", "?"],
     "asks for something unknown (7)")])
def test_words_that_nobody_expects(tmp_path, words, told):
    def body(life):
        life.start()
        for word in words:
            life.device.say(word)
            life.wait(0.5)
        assert life.has_told(told)
        assert not life.printer.is_shutdown()

    Life(tmp_path, make_file()).live(body)


def test_last_line_again(tmp_path):
    def body(life):
        life.send("PALETTE_CONNECT\nPALETTE_CUT")
        life.device.say("O20 D8")
        life.wait(1.0)

    life = Life(tmp_path).live(body)
    assert life.list_sent("O10") == [omega_code.CUT] * 2


def test_files_that_the_device_offers(tmp_path):
    def body(life):
        (tmp_path / "other.mcf.gcode").write_text("M117 other\n")
        life.send("PALETTE_CONNECT")
        life.device.say("O50")
        life.wait(1.0)
        assert life.list_sent("O5") == ["O50", "O51 Djob", "O51 Dother", "O52"]
        life.device.say("O53 D1 D0000")
        life.wait(2.0)
        assert life.status("print_stats")["filename"] == "other.mcf.gcode"

    Life(tmp_path).live(body)


# Parts

@pytest.mark.parametrize("line,code", [
    ("O20 D0", (20, (("D", "0"),))), ("O97 U25 D0 D000a", (
        97, (("U", "25"), ("D", "0"), ("D", "000a")))), ("O40", (40, ()))])
def test_lines_of_the_device(line, code):
    found = omega_code.parse(line)
    assert (found.number, found.words) == code


@pytest.mark.parametrize("line", ["Connection Okay", "Ox", "O20 X1", "spmm 290", "O"])
def test_lines_that_are_no_code(line):
    assert omega_code.parse(line) is None


def test_words_by_their_kind():
    code = omega_code.parse("O34 D1 D98.7 D001f")
    assert code.is_like("D1") and not code.is_like("D1", "D2")
    assert (code.get_float(1), code.get_hex(2)) == (98.7, 31)
    with pytest.raises(ValueError, match="missing"):
        code.get_hex(3)


def test_lines_of_a_file_come_in_their_order():
    job = palette_job.PaletteJob()
    for number, line in ((21, "a"), (22, "b"), (30, "c"), (32, "d"), (30, "e")):
        assert job.add(number, line)
    assert not job.add(31, "f") and not job.add(1, "g")
    assert [job.take(kind) for kind in (0, 0, 1, 1, 4)] == list("abced")
    with pytest.raises(ValueError, match="more splice settings"):
        job.take(4)


@pytest.mark.parametrize("left,part", [(200, 50), (60, 30), (8, 4), (5, 5), (1, 1)])
def test_parts_of_a_load(left, part):
    assert palette_load.choose_part(left) == part


def test_lines_in_pieces():
    splitter = palette_port.LineSplitter()
    assert splitter.split(b"O2") == [] and splitter.split(b"0 D0\r\n\nO4") == ["O20 D0"]
    assert splitter.split(b"0\n") == ["O40"]


def test_a_port_on_a_pty(run_in_reactor, reactor):
    """Bytes both ways, more than the port takes at once, and its end."""
    def body():
        master, slave = os.openpty()
        os.set_blocking(master, False)
        tty.setraw(slave)
        got, failures = [], []
        port = palette_port.PalettePort(
            reactor, seriallink.FileLink(slave), got.append, failures.append)
        sent = b"x" * 60 + b"\n"
        for _ in range(1000):
            port.send(sent)
        os.write(master, b"O20 D0\n")
        read = b""
        for _ in range(10000):
            reactor.pause(reactor.monotonic() + 0.01)
            try:
                read += os.read(master, 65536)
            except BlockingIOError:
                continue
            if len(read) == 61000:
                break
        assert read == sent * 1000
        assert b"".join(got) == b"O20 D0\n"
        os.close(master)
        for _ in range(10000):
            reactor.pause(reactor.monotonic() + 0.01)
            if failures:
                break
        assert failures
        port.close()
        port.close()
    run_in_reactor(body)
