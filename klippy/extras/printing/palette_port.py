# SPDX-License-Identifier: GPL-3.0-or-later
"""The serial port to a Palette 2, read and written by the reactor.

Nothing here waits: what the port does not take at once is kept and sent later.
"""
import os

from klippy import seriallink

READ_SIZE = 4096
MAX_LINE = 4096


class PalettePort:
    """An open port; receive(bytes) gets what comes, fail(text) its end."""

    def __init__(self, reactor, link, receive, fail):
        """link: FileLink, closed by close()."""
        self.reactor, self.link = reactor, link
        self.receive, self.fail = receive, fail
        self.unsent = b""
        os.set_blocking(link.fileno(), False)
        self.handler = reactor.register_fd(
            link.fileno(), self._handle_input, self._handle_space)

    def send(self, data):
        """Send bytes, at once or as soon as the port takes them."""
        self.unsent += data
        self._write()

    def close(self):
        """Close the port.  Safe to call again."""
        if self.handler is not None:
            self.reactor.unregister_fd(self.handler)
            self.link.close()
        self.handler = None

    def _handle_input(self, eventtime):
        try:
            data = os.read(self.link.fileno(), READ_SIZE)
        except BlockingIOError:
            return
        except OSError as err:
            self.fail(str(err))
            return
        if data:
            self.receive(data)
        else:
            self.fail("the port was closed")

    def _handle_space(self, eventtime):
        self._write()

    def _write(self):
        if self.handler is None:
            return
        try:
            n_sent = os.write(self.link.fileno(), self.unsent)
        except BlockingIOError:
            n_sent = 0
        except OSError as err:
            self.fail(str(err))
            return
        self.unsent = self.unsent[n_sent:]
        self.reactor.set_fd_wake(self.handler, True, bool(self.unsent))


def open_port(printer, path, baud, receive, fail):
    """The port of a path, or the model's of a simulated machine.

    Raises seriallink.error.
    """
    reactor = printer.get_reactor()
    machine = printer.get_start_args().get("machine")
    if machine is not None and machine.palette is not None:
        return machine.palette.plug_in(reactor, receive)
    link = (seriallink.open_pipe(path) if seriallink.is_terminal(path)
            else seriallink.open_uart(path, baud))
    return PalettePort(reactor, link, receive, fail)


class LineSplitter:
    """Cuts received bytes into lines of text."""

    def __init__(self):
        self.rest = b""

    def split(self, data):
        """The lines that are complete now; empty ones are left out."""
        *lines, rest = (self.rest + data).split(b"\n")
        self.rest = rest[-MAX_LINE:]
        texts = (line.decode("utf-8", "replace").strip() for line in lines)
        return [text for text in texts if text]
