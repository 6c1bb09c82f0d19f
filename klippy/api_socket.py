# SPDX-License-Identifier: GPL-3.0-or-later
"""The API's Unix socket: connections that never make the host wait.

Everything runs in the reactor's thread.  A client that does not read is cut
off when its output exceeds a bound.
"""

import errno
import json
import logging
import math
import os
import socket
import stat

MESSAGE_END = b"\x03"
MAX_INPUT = 8 * 1024 * 1024         # bytes of one request
MAX_OUTPUT = 32 * 1024 * 1024       # bytes a client may leave unread
READ_SIZE = 65536


def encode_message(message):
    """JSON of a message as bytes, with its end mark; never fails on values."""
    try:
        text = json.dumps(message, separators=(",", ":"), allow_nan=False,
                          default=_encode_other)
    except ValueError:
        text = json.dumps(_drop_nonfinite(message), separators=(",", ":"),
                          default=_encode_other)
    return text.encode("utf-8", "replace") + MESSAGE_END


def _encode_other(value):
    if isinstance(value, (set, frozenset)):
        return sorted(value, key=str)
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value)


def _drop_nonfinite(value):
    """The value with null where JSON has no number."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {str(key): _drop_nonfinite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_drop_nonfinite(item) for item in value]
    return value


class ApiServer:
    """The listening socket and its connections."""

    def __init__(self, printer, webhooks):
        self.printer, self.webhooks = printer, webhooks
        self.reactor = printer.get_reactor()
        self.clients = set()
        self.sock = self.handler = None
        self.path = printer.get_start_args().get("apiserver")
        if not self.path:
            return
        self.sock = self._open(self.path)
        self.handler = self.reactor.register_fd(self.sock.fileno(), self._accept)
        printer.register_event_handler("klippy:disconnect", self.close)
        printer.register_event_handler("klippy:shutdown", self._note_shutdown)

    def _open(self, path):
        """Listen at path; a socket left there by somebody gone is removed."""
        sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        sock.setblocking(False)
        try:
            _remove_stale(path)
            sock.bind(path)
        except OSError as err:
            sock.close()
            raise self.printer.config_error(
                "Unable to open the API socket '%s': %s" % (path, err))
        sock.listen(16)
        return sock

    def _accept(self, eventtime):
        try:
            sock, _ = self.sock.accept()
        except OSError as err:
            if err.errno not in (errno.EAGAIN, errno.EINTR, errno.ECONNABORTED):
                logging.warning("API socket: unable to accept a client: %s", err)
            return
        sock.setblocking(False)
        self.clients.add(ClientConnection(self, sock))

    def note_closed(self, client):
        """Forget a connection."""
        self.clients.discard(client)

    def _note_shutdown(self):
        for client in self.clients:
            client.log_recent()

    def close(self):
        """Send what can be sent at once, then close everything."""
        if self.sock is None:
            return
        for client in list(self.clients):
            client.close()
        self.reactor.unregister_fd(self.handler)
        self.sock.close()
        self.sock = None
        try:
            os.remove(self.path)
        except OSError as err:
            logging.warning("API socket: unable to remove '%s': %s", self.path, err)


def _remove_stale(path):
    """Remove the socket of a host that is gone; bind() complains about others."""
    if not os.path.exists(path) or not stat.S_ISSOCK(os.stat(path).st_mode):
        return
    probe = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        probe.connect(path)
    except ConnectionRefusedError:
        os.remove(path)
    finally:
        probe.close()


class ClientConnection:
    """One client: splits its input into requests, sends without waiting."""

    def __init__(self, server, sock):
        self.server, self.sock = server, sock
        self.reactor = server.reactor
        self.name = "client %d" % (sock.fileno(),)
        self.input, self.output = bytearray(), bytearray()
        self.recent = []
        self.handler = self.reactor.register_fd(
            sock.fileno(), self._read, self._write)

    # Input

    def note_client_info(self, client_info):
        """Remember who the client says it is."""
        self.name = "%s (%s)" % (client_info.get("program", "unnamed"),
                                 client_info.get("version", "?"))
        logging.info("API client: %s", json.dumps(client_info))

    def log_recent(self):
        """Log the last requests, for the analysis of a shutdown."""
        for eventtime, text in self.recent:
            logging.info("API %s at %.6f: %s", self.name, eventtime, text)

    def is_closed(self):
        return self.sock is None

    def _read(self, eventtime):
        if self.sock is None:
            return
        try:
            data = self.sock.recv(READ_SIZE)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if not data:
            self.close()
            return
        start = len(self.input)
        self.input += data
        if MESSAGE_END[0] not in data:
            if len(self.input) > MAX_INPUT:
                self._cut_off("a request of more than %d bytes" % (MAX_INPUT,))
            return
        self._split(self.input.rfind(MESSAGE_END, start))

    def _split(self, end):
        messages = bytes(self.input[:end]).split(MESSAGE_END)
        del self.input[:end + 1]
        for text in messages:
            self._start(text)

    def _start(self, text):
        """Parse a request and run it in a greenlet of its own."""
        try:
            message = json.loads(text)
        except (ValueError, RecursionError) as err:
            logging.warning("API %s: a request is not JSON (%s): %r",
                            self.name, err, text[:200])
            return
        self.recent.append((self.reactor.monotonic(),
                            text[:200].decode("utf-8", "replace")))
        del self.recent[:-20]
        self.reactor.register_callback(lambda eventtime: self._run(message))

    def _run(self, message):
        reply = self.server.webhooks.answer(self, message)
        if reply is not None:
            self.send(reply)

    # Output

    def send(self, message):
        """Send a message (dict); at once as far as the client reads."""
        if self.sock is None:
            return
        self.output += encode_message(message)
        self._write(0.)
        if len(self.output) > MAX_OUTPUT:
            self._cut_off("%d bytes of output left unread" % (len(self.output),))

    def _write(self, eventtime):
        if self.sock is None or not self.output:
            return
        try:
            sent = self.sock.send(self.output)
        except (BlockingIOError, InterruptedError):
            sent = 0
        except OSError:
            self.output.clear()
            self.close()
            return
        del self.output[:sent]
        self.reactor.set_fd_wake(self.handler, True, bool(self.output))

    def _cut_off(self, reason):
        logging.warning("API %s: cut off: %s", self.name, reason)
        self.output.clear()
        self.close()

    def close(self):
        """Close the connection; output that fits the socket is still sent."""
        if self.sock is None:
            return
        self.reactor.unregister_fd(self.handler)
        sock, self.sock = self.sock, None
        if self.output:
            try:
                sock.send(self.output)
            except OSError as err:
                logging.info("API %s: output lost at close: %s", self.name, err)
        sock.close()
        self.server.note_closed(self)

