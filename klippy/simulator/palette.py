# SPDX-License-Identifier: GPL-3.0-or-later
"""A Palette 2 on the simulated machine, at the serial port of [palette2].

It asks for the lines of a file, loads its drives and the tube, waits until the
extruder has pulled the filament in, and lets the print start; then it splices ahead
of what the extruder takes, and judges pings by that.  Time and filament are those
of the machine.  Source of its words: docs/internals/palette2.md.
"""
import struct

PERIOD = 0.05               # s
VERSION = "9.0.9"
ANSWER_TIME = 0.1           # s from a line to its answer
DRIVE_TIME = 2.0            # s to load one input
PRESS_TIME = 2.0            # s until its user presses "start"
LOAD_LENGTH = 120.0         # mm from the tube's end to the nozzle
SPLICE_LEAD = 150.0         # mm it works ahead of the extruder
SPLICE_TIME = 4.0           # s


class SimPalette:
    """The device; slip: the share of the extruder's filament that it really moves."""

    def __init__(self, spool):
        """spool: filament.Spool of the extruder, or None."""
        self.spool = spool
        self.port = None
        self.received, self.log = b"", []
        self.due = []               # (time, line) to send
        self.now = 0.0
        self.slip = 1.0
        self.is_mute = self.is_stuck = False
        self.begin_job()

    def begin_job(self):
        """Forget the file before."""
        self.wanted = []            # what O20 still has to ask for
        self.header, self.splices, self.pings = [], [], []
        self.stage = "idle"
        self.load_start = self.print_start = 0.0
        self.told_left = None
        self.n_spliced, self.splice_end = 0, None

    # The plug

    def plug_in(self, reactor, receive):
        """The host's port: an object with send() and close()."""
        self.port = SimPort(self, reactor, receive)
        return self.port

    def say(self, line, delay=ANSWER_TIME):
        """Send a line after so many s."""
        self.due.append((self.now + delay, line))

    # Time

    def tick(self, now):
        """Let time pass (world's s)."""
        self.now = now
        ready = [line for time, line in self.due if time <= now]
        self.due = [item for item in self.due if item[0] > now]
        for line in ready:
            if self.port is not None and not self.is_mute:
                self.log.append("> " + line)
                self.port.deliver(line.encode() + b"\r\n")
        if self.stage == "loading":
            self._tick_loading()
        elif self.stage == "printing":
            self._tick_splices()

    def _get_moved(self):
        """mm of filament that the extruder has taken so far."""
        if self.spool is None or self.is_stuck:
            return 0.0
        return self.spool.moved * self.slip

    def _tick_loading(self):
        left = round(LOAD_LENGTH - (self._get_moved() - self.load_start))
        if left == self.told_left:
            return
        self.told_left = left
        self.say("O97 U39 D%d" % (-left,), 0.0)
        if left == 0:
            self.stage = "loaded"
            self._start_after(PRESS_TIME)

    def _start_after(self, delay):
        self.say("O40", delay)
        self.stage, self.print_start = "printing", self._get_moved()

    def _tick_splices(self):
        if self.splice_end is not None:
            if self.now >= self.splice_end:
                self.splice_end = None
                self.say("O97 U25 D1 D%04x" % (self.n_spliced,), 0.0)
                if self.n_spliced == len(self.splices):
                    self.say("O97 U0 D0", 0.0)
            return
        if self.n_spliced == len(self.splices):
            return
        length = self.splices[self.n_spliced]
        if self._get_moved() - self.print_start + SPLICE_LEAD >= length:
            self.n_spliced += 1
            self.splice_end = self.now + SPLICE_TIME
            self.say("O97 U25 D0 D%04x" % (self.n_spliced,), 0.0)

    # Lines of the host

    def take(self, data):
        """Bytes from the host."""
        *lines, self.received = (self.received + data).split(b"\n")
        for line in lines:
            text = line.decode().strip()
            if text:
                self.log.append("< " + text)
                self._take_line(text)

    def _take_line(self, line):
        head, *words = line.split()
        if head == "O99":
            self.say("Connection Okay")
        elif head == "O50":
            self.say("O50 D" + VERSION)
        elif head == "O0":
            self.say("O97 U0 D2")
            self.say("O97 U0 D3", 1.0)
            self.begin_job()
        elif head == "O1":
            self.begin_job()
            self.wanted = [0] * 9
            self._ask()
        elif self.wanted and head != "O31":
            self._note_line(head, words)
            self.wanted.pop(0)
            self._ask()
        elif head == "O31":
            self._note_ping(words)

    def _note_line(self, head, words):
        if head == "O30":
            self.splices.append(decode_float(words[1][1:]))
            return
        if head != "O32":
            self.header.append((head, words))
        if head == "O29":
            counts = {name: int(rest[0][1:], 16) for name, rest in self.header
                      if name in ("O26", "O28")}
            self.wanted += [1] * counts["O26"] + [4] * counts["O28"]

    def _ask(self):
        """The next request, or the filament if all is known."""
        if self.wanted:
            self.say("O20 D%d" % (self.wanted[0],))
            return
        drives = next(rest for name, rest in self.header if name == "O25")
        delay = 0.0
        for number, drive in enumerate(drives):
            if drive != "D0":
                for part in ("D0", "D1"):
                    self.say("O97 U6%d %s" % (number, part), delay)
                    delay += DRIVE_TIME
        self.say("O97 U39", delay)
        self.stage, self.load_start = "loading", self._get_moved()

    def _note_ping(self, words):
        if not words:
            self.say("O20 D2")
            return
        expected = decode_float(words[0][1:])
        moved = self._get_moved() - self.print_start
        self.pings.append((expected, moved))
        self.say("O34 D1 D%.1f D%04x" % (100.0 * moved / expected, len(self.pings)))


class SimPort:
    """The host's end of the cable."""

    def __init__(self, device, reactor, receive):
        self.device, self.reactor, self.receive = device, reactor, receive

    def send(self, data):
        """Bytes to the device."""
        self.device.take(data)

    def deliver(self, data):
        """Bytes from the device, in the host's loop."""
        self.reactor.register_async_callback(lambda eventtime: self._receive(data))

    def _receive(self, data):
        if self.device.port is self:
            self.receive(data)

    def close(self):
        """Pull the plug."""
        if self.device.port is self:
            self.device.port = None


def decode_float(text):
    """The 32-bit float of eight (or fewer) hexadecimal digits."""
    return struct.unpack(">f", int(text, 16).to_bytes(4, "big"))[0]
