# SPDX-License-Identifier: GPL-3.0-or-later
"""The connection to a Palette 2: lines both ways, and whether it is alive."""
import logging

from klippy.errors import CommandError, McuError
from klippy.extras import omega_code, palette_port

HANDSHAKE_TIME = 3.0                # s an answer may take
HEARTBEAT_VERSION = (9, 0, 9)       # firmware that answers at any time


class PaletteLink:
    """One device; take_line(text) gets what it says, lost(text) why it is gone."""

    def __init__(self, config, take_line, lost):
        self.printer = config.get_printer()
        self.reactor = self.printer.get_reactor()
        self.path = config.get("serial")
        self.baud = config.getint("baud", 115200)
        self.take_line, self.lost = take_line, lost
        self.port = self.splitter = self.answer = None
        self.version, self.is_late, self.last_line = (), False, ""

    @property
    def is_open(self):
        """Whether there is a device to talk to."""
        return self.port is not None

    def connect(self):
        """Open the port and see that a device answers.  Raises CommandError."""
        self.splitter = palette_port.LineSplitter()
        try:
            self.port = palette_port.open_port(
                self.printer, self.path, self.baud, self._handle_data, self.lose)
        except McuError as err:
            raise CommandError("Palette 2: %s" % (err,)) from err
        if not self.ask_alive(HANDSHAKE_TIME):
            self.close()
            raise CommandError(
                "Palette 2: no answer on '%s' at %d baud within %.0f s: is it on, and"
                " are serial and baud right?" % (self.path, self.baud, HANDSHAKE_TIME))
        self.send(omega_code.ASK_VERSION)

    def ask_alive(self, seconds):
        """True if the device answers a heartbeat in time."""
        self.answer = answer = self.reactor.completion()
        self.send("")
        self.send(omega_code.HEARTBEAT)
        return answer.wait(self.reactor.monotonic() + seconds) is not None

    def note_alive(self):
        """The device has answered a heartbeat."""
        self.is_late = False
        if self.answer is not None:
            self.answer.complete(True)
            self.answer = None

    def beat(self):
        """Send the next heartbeat at rest; the last one must have been answered."""
        if self.version < HEARTBEAT_VERSION:
            return
        if self.is_late:
            self.lose("it does not answer")
            return
        self.is_late = True
        self.send(omega_code.HEARTBEAT)

    def send(self, line):
        """Send a line; without a port it is lost."""
        if self.port is None:
            return
        if line not in ("", omega_code.HEARTBEAT):
            logging.info("palette2: sent %s", line)
            self.last_line = line
        self.port.send(line.encode() + b"\n")

    def lose(self, reason):
        """The link has failed."""
        self.close()
        self.lost(reason)

    def close(self):
        """End the connection.  Safe to call again."""
        if self.port is not None:
            self.port.close()
        self.port, self.version, self.is_late = None, (), False

    def _handle_data(self, data):
        for line in self.splitter.split(data):
            try:
                self.take_line(line)
            except ValueError as err:
                logging.warning("palette2: '%s' means nothing: %s", line, err)
