# SPDX-License-Identifier: GPL-3.0-or-later
"""The linux firmware as a process, and a minimal host on its terminal."""

import json
import os
import pathlib
import select
import signal
import subprocess
import sys
import termios
import time
import tty
import zlib

from linux_fakeio import FakeIo
from simboard import BOOT_FORMATS, ROOT, Format, decode_int, frame

TIMEOUT = 120.  # s: only a firmware that hangs gets there
END_TIMEOUT = 60. # s
RESEND = .5     # s without an acknowledgement
IDENTIFY_CHUNK = 40
FREQ = 50000000


def build_linux(out="out/test-linux/", target="firmware"):
    """Bring the linux firmware up to date; returns its program.

    The environment's LINUX_ELF names another build to test instead.
    """
    if "LINUX_ELF" in os.environ:
        return pathlib.Path(os.environ["LINUX_ELF"])
    subprocess.run(
        ["make", "-s", target, "OUT=" + out, "PYTHON=" + sys.executable,
         "KCONFIG_CONFIG=test/configs/linux.config"],
        cwd=ROOT, check=True, capture_output=True, text=True)
    return ROOT / out / "klipper.elf"


class LinuxProcess:
    """One running firmware with its folder, link and messages on stderr."""

    def __init__(self, program, folder, *options, fake=True):
        self.folder = pathlib.Path(folder)
        self.link = str(self.folder / "console")
        self.errors = open(self.folder / "stderr", "w+")
        args = [str(program), "-I", self.link, *options]
        if fake:
            args += ["--fake", str(self.folder)]
        self.process = subprocess.Popen(args, stderr=self.errors)
        wait_for(lambda: os.path.islink(self.link)
                 or self.process.poll() is not None)

    def read_errors(self):
        self.errors.seek(0)
        return self.errors.read()

    def stop(self):
        """End it as a service manager does; returns the exit status."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.terminate()
        try:
            status = self.process.wait(END_TIMEOUT)
        except subprocess.TimeoutExpired:
            self.process.kill()
            status = self.process.wait()
        self.errors.close()
        return status


def wait_for(condition):
    """Poll a condition that comes true soon."""
    end = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(.005)


class LinuxHost:
    """Sends blocks, resends what is not acknowledged, collects messages."""

    def __init__(self, link):
        self.fd = os.open(link, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.fd)
        termios.tcflush(self.fd, termios.TCIFLUSH)
        self.received = b""
        self.messages = []
        self.commands, self.responses = {}, {}
        self.seq, self.acked = 0, None
        self.use_formats(BOOT_FORMATS)

    def close(self):
        os.close(self.fd)

    def use_formats(self, ids):
        for fmt, msg_id in ids.items():
            form = Format(fmt, msg_id)
            self.commands[form.name] = self.responses[msg_id] = form

    def pump(self, timeout=.02):
        """Take in what comes within the timeout."""
        if select.select([self.fd], [], [], timeout)[0]:
            self.received += os.read(self.fd, 4096)
        while self.received and len(self.received) >= self.received[0]:
            size = self.received[0]
            block, self.received = self.received[:size], self.received[size:]
            assert block == frame(block[1], block[2:-3])
            self.acked = block[1] & 15
            self._decode(block[2:-3])

    def _decode(self, payload):
        pos = 0
        while pos < len(payload):
            msg_id, pos = decode_int(payload, pos)
            if msg_id not in self.responses:
                self.messages.append({"#name": "#unknown"})
                return
            fields, pos = self.responses[msg_id].decode(payload, pos)
            self.messages.append(fields)

    def wait(self, condition):
        """Pump until the condition holds."""
        end = time.monotonic() + TIMEOUT
        while not condition():
            assert time.monotonic() < end, self.messages[-5:]
            self.pump()

    def wait_message(self, name, start=0):
        """The first message of that name since `start`."""
        self.wait(lambda: self.list_messages(name, start))
        return self.list_messages(name, start)[0]

    def send(self, name, **values):
        """One command in a block of its own; returns once it was run."""
        block = frame(self.seq, self.commands[name].encode(values))
        self.seq = (self.seq + 1) & 15
        end = time.monotonic() + TIMEOUT
        while time.monotonic() < end:
            self.acked = None
            os.write(self.fd, block)
            again = time.monotonic() + RESEND
            while time.monotonic() < again:
                self.pump()
                if self.acked == self.seq:
                    return
        raise AssertionError("no acknowledgement of %s" % name)

    def send_only(self, name, **values):
        """One command that may not be acknowledged any more."""
        os.write(self.fd, frame(self.seq, self.commands[name].encode(values)))
        self.seq = (self.seq + 1) & 15

    def query(self, name, response, **values):
        n = len(self.messages)
        self.send(name, **values)
        return self.wait_message(response, n)

    def list_messages(self, name, start=0):
        return [m for m in self.messages[start:] if m["#name"] == name]

    def identify(self):
        data = b""
        while True:
            answer = self.query("identify", "identify_response",
                                offset=len(data), count=IDENTIFY_CHUNK)
            if not answer["data"]:
                break
            data += answer["data"]
        self.dictionary = json.loads(zlib.decompress(data))
        for kind in ("commands", "responses", "output"):
            self.use_formats(self.dictionary[kind])
        self.strings = {number: text for text, number in
                        self.dictionary["enumerations"]
                        ["static_string_id"].items()}
        return self.dictionary

    def find_pin(self, name):
        """Number of a pin by the dictionary's ranges."""
        for first, (number, count) in self.dictionary["enumerations"]["pin"].items():
            stem = first.rstrip("0123456789")
            if name.startswith(stem) and name[len(stem):].isdigit():
                line = int(name[len(stem):])
                assert line < count
                return number + line
        raise ValueError(name)

    def configure(self, *commands, oids=20, crc=1234):
        self.send("allocate_oids", count=oids)
        for name, values in commands:
            self.send(name, **values)
        self.send("finalize_config", crc=crc)

    def get_clock(self):
        return self.query("get_clock", "clock")["clock"]

    def wait_shutdown(self, start=0):
        """Reason of the next shutdown."""
        message = self.wait_message("shutdown", start)
        return self.strings[message["static_string_id"]]


class LinuxBoard:
    """Process, host and fake pins together."""

    def __init__(self, program, folder, *options, rules=""):
        (pathlib.Path(folder) / "rules").write_text(rules)
        self.run = LinuxProcess(program, folder, *options)
        assert self.run.process.poll() is None, self.run.read_errors()
        self.io = FakeIo(folder)
        self.host = LinuxHost(self.run.link)
        self.host.identify()

    def close(self):
        self.host.close()
        self.io.close()
        return self.run.stop()
