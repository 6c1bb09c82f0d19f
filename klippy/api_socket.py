# SPDX-License-Identifier: GPL-3.0-or-later
"""The API's Unix socket: connections that never make the host wait.

Everything runs in the reactor's thread.  What a client can cost is bounded: the
size of a request, the rate at which its requests start, how many of them wait,
what it leaves unread, and how often it may send what is no JSON.
"""

import collections
import errno
import json
import logging
import os
import stat

from klippy.api_encoding import MESSAGE_END, encode_message

MAX_CLIENTS = 100
MAX_INPUT = 1024 * 1024             # bytes of one request
MAX_OUTPUT = 4 * 1024 * 1024        # bytes a client may leave unread
MAX_PENDING = 100                   # requests read ahead; then reading stops
MAX_RUNNING = 500                   # requests that have begun and wait
MAX_MALFORMED = 10                  # messages that are no JSON
_REMEDIES = {errno.ENOENT: ": make its folder",
             errno.EACCES: ": let this user write in its folder"}
REQUEST_PAUSE = 0.0005              # s between starts of a client's requests
ACCEPT_PAUSE = 1.                   # s without new clients when there are no fds
READ_SIZE = 65536


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
        import socket
        sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        sock.setblocking(False)
        try:
            make_free(path)
            sock.bind(path)
            set_access(path, self.printer.get_start_args())
        except OSError as err:
            sock.close()
            raise self.printer.config_error(describe_error(path, err))
        sock.listen(16)
        return sock

    def _accept(self, eventtime):
        try:
            sock, _ = self.sock.accept()
        except OSError as err:
            if err.errno not in (errno.EAGAIN, errno.EINTR, errno.ECONNABORTED):
                logging.warning("API socket: unable to accept a client: %s", err)
                self._rest()
            return
        if len(self.clients) >= MAX_CLIENTS:
            logging.warning("API socket: a client was turned away: there are %d",
                            len(self.clients))
            sock.close()
            self._rest()
            return
        sock.setblocking(False)
        self.clients.add(ClientConnection(self, sock))

    def _rest(self):
        """Accept nobody for a while: the next attempt would fail too."""
        def accept_again(eventtime):
            if self.sock is not None:
                self.reactor.set_fd_wake(self.handler, True)
        self.reactor.set_fd_wake(self.handler, False)
        self.reactor.register_callback(
            accept_again, self.reactor.monotonic() + ACCEPT_PAUSE)

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


def describe_error(path, err):
    """What an OSError about the socket at path means, as text."""
    reason = "%s%s" % (err.strerror or err, _REMEDIES.get(err.errno, ""))
    if err.errno == errno.EADDRINUSE:
        reason = "another program, maybe klippy, serves it: stop that, or take another"
    elif err.errno == errno.EEXIST:
        reason = "there is a file of that name: remove it, or take another"
    return "Unable to open the API socket '%s': %s" % (path, reason)


def set_access(path, start_args):
    """Give a socket the mode (int), user and group that were asked for.

    Raises OSError.
    """
    mode = start_args.get("apiserver_file_mode")
    owner = [start_args.get("apiserver_" + kind, -1) for kind in ("user", "group")]
    if owner != [-1, -1]:
        os.chown(path, *owner)
    if mode is not None:
        os.chmod(path, mode)


def make_free(path):
    """Remove the socket of a host that is gone.

    Raises OSError if somebody serves it, or if another file is there.
    """
    if not os.path.lexists(path):
        return
    if not os.path.exists(path) or not stat.S_ISSOCK(os.stat(path).st_mode):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
    import socket
    probe = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        probe.connect(path)
    except ConnectionRefusedError:
        os.remove(path)
        return
    finally:
        probe.close()
    raise OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE))


class ClientConnection:
    """One client: splits its input into requests, sends without waiting."""

    def __init__(self, server, sock):
        self.server, self.sock = server, sock
        self.reactor = server.reactor
        self.name = "client %d" % (sock.fileno(),)
        self.input, self.output = bytearray(), bytearray()
        self.recent = []
        self.pending = collections.deque()      # requests that have not begun
        self.is_pumping = False
        self.n_running = self.n_malformed = 0
        self.events = True, False       # readable, writable
        self.handler = self.reactor.register_fd(
            sock.fileno(), self._read, self._write)

    # Input

    def note_client_info(self, client_info):
        """Remember who the client says it is."""
        name = "%.60s (%.60s)" % (client_info.get("program", "unnamed"),
                                  client_info.get("version", "?"))
        if name != self.name:
            self.name = name
            logging.info("API client: %.1000s", json.dumps(client_info))

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
        self.pending.extend(bytes(self.input[:end]).split(MESSAGE_END))
        del self.input[:end + 1]
        if not self.is_pumping:
            self.is_pumping = True
            self.reactor.register_callback(self._pump)
        self._choose_events()

    def _pump(self, eventtime):
        """Begin the pending requests, one a turn: others are served between."""
        while self.pending and self.sock is not None:
            self._start(self.pending.popleft())
            if len(self.pending) == MAX_PENDING:
                self._choose_events()
            if self.pending:
                self.reactor.pause(self.reactor.monotonic() + REQUEST_PAUSE)
        self.is_pumping = False

    def _start(self, text):
        """Parse a request and run it in a greenlet of its own."""
        try:
            message = json.loads(text)
        except (ValueError, RecursionError) as err:
            self._note_malformed(text, err)
            return
        self.recent.append((self.reactor.monotonic(),
                            text[:200].decode("utf-8", "replace")))
        del self.recent[:-20]
        self.reactor.register_callback(lambda eventtime: self._run(message))

    def _note_malformed(self, text, err):
        self.n_malformed += 1
        if self.n_malformed > MAX_MALFORMED:
            self._cut_off("%d requests that are not JSON" % (self.n_malformed,))
            return
        logging.warning("API %s: a request is not JSON (%.200s): %r",
                        self.name, err, text[:200])

    def _run(self, message):
        self.n_running += 1
        try:
            reply = self.server.webhooks.answer(self, message,
                                                self.n_running > MAX_RUNNING)
        finally:
            self.n_running -= 1
        if reply is not None:
            self.send(reply)

    # Output

    def send(self, message):
        """Send a message (dict); at once as far as the client reads."""
        self.send_encoded(encode_message(message))

    def send_encoded(self, data):
        """As send(), of a message that is encoded, with its end mark."""
        if self.sock is None:
            return
        if len(self.output) > MAX_OUTPUT:
            self._cut_off("%d bytes of output left unread" % (len(self.output),))
            return
        self.output += data
        self._write(0.)

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
        self._choose_events()

    def _choose_events(self):
        """Wake for what can be done: a client reads and is read from."""
        if self.sock is not None:
            events = len(self.pending) <= MAX_PENDING, bool(self.output)
            if events != self.events:
                self.events = events
                self.reactor.set_fd_wake(self.handler, *events)

    def _cut_off(self, reason):
        logging.warning("API %s: cut off: %s", self.name, reason)
        self.output.clear()
        self.close()

    def close(self):
        """Close the connection; output that fits the socket is still sent."""
        if self.sock is None:
            return
        self.reactor.unregister_fd(self.handler)
        self.pending.clear()
        sock, self.sock = self.sock, None
        if self.output:
            try:
                sock.send(self.output)
            except OSError as err:
                logging.info("API %s: output lost at close: %s", self.name, err)
        sock.close()
        self.server.note_closed(self)

