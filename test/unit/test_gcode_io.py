# SPDX-License-Identifier: GPL-3.0-or-later
import os
import select

import pytest
from front_end import Printer, write_file

from klippy import gcode_io


def make_batch(folder, data, **start_args):
    path = write_file(folder, "job.gcode", data)
    printer = Printer(debuginput=str(path), **start_args)
    seen = []
    printer.gcode.register_command("FOO", lambda c: seen.append(c.get_commandline()))
    gcode_io.setup(printer)
    printer.make_ready()
    printer.reactor.run()
    printer.close()
    return printer, seen


@pytest.mark.parametrize("data, count", [
    ("", 0), ("FOO", 1), ("FOO\r\nFOO\r\n\r\n", 2), ("\n\nFOO A=1\n; end", 1),
    ("FOO\n" * 100000, 100000)])
def test_batch_runs_every_line_then_exits(tmp_path, data, count):
    printer, seen = make_batch(tmp_path, data)
    assert len(seen) == count and printer.exit_result == "exit"
    assert ("gcode:debuginput_exit",) in printer.events


def test_batch_ends_at_the_first_error(tmp_path):
    printer, seen = make_batch(tmp_path, "FOO\nUNKNOWN\n=\nFOO\n")
    assert len(seen) == 1 and printer.exit_result == "error_exit"
    assert printer.output[-2] == "!! '=' is no G-code command"


def test_batch_ends_with_error_after_shutdown(tmp_path):
    printer, seen = make_batch(tmp_path, "M112\nFOO\n")
    assert not seen and printer.exit_result == "error_exit"


def test_batch_with_a_line_without_end(tmp_path, monkeypatch):
    monkeypatch.setattr(gcode_io, "MAX_LINE", 300000)
    printer, seen = make_batch(tmp_path, b"FOO\n" + b"x" * 1000000)
    assert len(seen) == 1 and printer.exit_result == "error_exit"
    assert "A G-code line of more than 300000 bytes" in printer.output[-2]


def test_splitter():
    splitter = gcode_io.LineSplitter()
    assert splitter.feed(b"a\nb") == [b"a"]
    assert splitter.feed(b"") == []
    assert splitter.feed(b"c\n\n") == [b"bc", b""]
    assert splitter.feed(b"x" * (gcode_io.MAX_LINE + 1)) == []
    assert splitter.feed(b"more") == [] and splitter.feed(b"end\nd\n") == [None, b"d"]


def test_link_is_removed_while_it_is_ours(tmp_path):
    link = tmp_path / "tty"
    master = gcode_io.create_terminal(str(link))
    target = os.readlink(link)
    gcode_io.remove_terminal(str(link), "/dev/pts/another")
    assert link.is_symlink()
    gcode_io.remove_terminal(str(link), target)
    assert not link.is_symlink()
    gcode_io.remove_terminal(str(link), target)
    os.close(master)


class Tty:
    """The other side of the terminal."""

    def __init__(self, folder):
        self.link = str(folder / "tty")
        self.master = gcode_io.create_terminal(self.link)
        self.fd = os.open(self.link, os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY)
        self.printer = Printer(gcode_fd=self.master, software_version="v1")
        self.terminal = gcode_io.setup(self.printer)
        self.printer.make_ready()
        self.take(1)

    def take(self, count, seconds=0.1):
        """Pass virtual time, then read that many lines (0: what is there)."""
        self.printer.run_for(seconds)
        data = b""
        while select.select([self.fd], [], [], 5. if count else 0.)[0]:
            data += os.read(self.fd, 65536)
            if data.count(b"\n") >= count:
                break
        return data.decode().splitlines()

    def send(self, data, count, seconds=0.1):
        """Send, wait until the kernel has passed it on; see take()."""
        os.write(self.fd, data)
        select.select([self.master], [], [], 5.)
        return self.take(count, seconds)

    def close(self):
        self.printer.close()
        os.close(self.fd)
        os.close(self.master)


@pytest.fixture
def tty(tmp_path):
    made = Tty(tmp_path)
    yield made
    made.close()


def test_terminal_answers(tty):
    assert tty.send(b"N1 M115*39\n", 1) == [
        "ok FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v1"]
    assert tty.send(b"ECHO a\nm1", 2) == ["// ECHO a", "ok"]
    assert tty.send(b"10\r\n\x00\n", 3) == [
        "ok", r"!! '\x00' is no G-code command", "ok"]
    assert tty.terminal.stats(0.)[1].startswith("gcodein=")


def test_terminal_is_busy_and_obeys_m112(tty):
    registry, reactor = tty.printer.gcode, tty.printer.reactor
    registry.register_command("WAIT", lambda gcmd: reactor.pause(
        reactor.monotonic() + 7.))
    assert tty.send(b"WAIT\n", 2, 6.) == ["echo:busy: processing"] * 2
    tty.send(b"N5 M1120\n", 0)
    assert tty.printer.state == "ready"
    tty.send(b"N6 M112*12\n", 0)
    assert tty.printer.state == "shutdown"
    assert "ok" in tty.take(4, 5.)


def test_sender_chooses_how_often_it_is_told(tty):
    registry, reactor = tty.printer.gcode, tty.printer.reactor
    registry.register_command("WAIT", lambda gcmd: reactor.pause(
        reactor.monotonic() + 6.5))
    assert tty.send(b"M113\n", 2) == ["// M113 S2", "ok"]
    tty.send(b"M113 S1\n", 1)
    busy = ["echo:busy: processing"]
    assert tty.send(b"WAIT\n", 7, 7.5) == busy * 6 + ["ok"]
    tty.send(b"M113 S0\n", 1)
    assert tty.send(b"WAIT\n", 1, 7.5) == ["ok"]
    registry.run_script("M113 S1")
    assert tty.take(0, 5.) == []


def test_terminal_stops_reading_from_who_does_not_wait(tty, monkeypatch):
    monkeypatch.setattr(gcode_io, "MAX_PENDING_LINES", 10)
    count, reactor = [0], tty.printer.reactor

    def run(gcmd):
        count[0] += 1
        reactor.pause(reactor.monotonic() + 0.01)
    tty.printer.gcode.register_command("RUN", run)
    sent = 0
    for _ in range(30):
        try:
            sent += os.write(tty.fd, b"RUN\n" * 50)
        except BlockingIOError:
            pass
        tty.take(0, 0.01)
        assert len(tty.terminal.pending) <= 1100
    for _ in range(1000):
        if count[0] == sent // 4:
            break
        select.select([tty.master], [], [], 0.01)
        tty.take(0, 0.5)
    assert tty.terminal.bytes_read == sent


def test_no_source_without_start_argument():
    printer = Printer()
    assert gcode_io.setup(printer) is None
    printer.close()
