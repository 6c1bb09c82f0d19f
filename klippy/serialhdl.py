# SPDX-License-Identifier: GPL-3.0-or-later
"""The session with one mcu: connect, identify, send, receive, query.

On a real link a thread of its own runs the response handlers; on a virtual
one the reactor does, and in batch mode there are no responses.
"""

import logging
import threading

from klippy import msgproto, seriallink
from klippy.seriallink import error
from klippy_ext.serialqueue import CommandQueue, SerialQueue

CONNECT_TIMEOUT = 90.
OPEN_INTERVAL = 5.
IDENTIFY_CHUNK = 40
IDENTIFY_TIMEOUT = 5.
QUERY_DELAYS = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6)
ACK_TIMEOUT = 5.
MAX_DICTIONARY = 1 << 20


class Query:
    """One wait for a response; made and finished by the reactor's thread."""

    def __init__(self, serial, name, oid, completion):
        self.serial, self.name, self.oid = serial, name, oid
        self.completion = completion
        self.min_sent_time = 0.

    def note_response(self, params):
        """Handler of the response, in whatever thread."""
        if 0. < params["#sent_time"] < self.min_sent_time:
            return
        self.serial.reactor.async_complete(self.completion, params)


class SerialReader:
    """Link to one mcu and the dispatch of its responses."""

    error = error

    def __init__(self, reactor, mcu_name=""):
        self.reactor = reactor
        self.mcu_name = mcu_name
        self.warn_prefix = "mcu '%s': " % (mcu_name,) if mcu_name else ""
        self.msgparser = msgproto.MessageParser(warn_prefix=self.warn_prefix)
        self.serialqueue = None
        self.link = None
        self.default_cmd_queue = None
        self.is_fileoutput, self.log_warnings = False, True
        self._world = None
        self._thread = None
        self._lock = threading.Lock()
        self._handlers = {}
        self._notify_id = 0
        self._pending = {}
        self._queries = set()
        self._fault_callback = None
        # For how long (s) to try, and what silence ends one try
        self.connect_timeout, self.identify_timeout = CONNECT_TIMEOUT, IDENTIFY_TIMEOUT
        # The dictionary as it came
        self.dictionary_data = b""
        self._default_handler = self._ignore
        self.register_response(self._handle_unknown, "#unknown")
        self.register_response(self._handle_output, "#output")

    # Connecting

    def connect_uart(self, path, baud, rts=True):
        """Connect by a serial port, waiting for it and for the mcu.

        Raises error if there is no answer within 90 s.
        """
        self._connect(lambda: seriallink.open_uart(path, baud, rts), path,
                      lambda link: seriallink.leave_bootloader(link, baud))

    def connect_pipe(self, path):
        """Connect by a pseudo terminal."""
        self._connect(lambda: seriallink.open_pipe(path), path)

    def connect_remote(self, address):
        """Connect by a socket, tcp://host:port or unix://path."""
        self._connect(lambda: seriallink.open_remote(address), address)

    def connect_canbus(self, uuid, nodeid, interface="can0"):
        """Connect to the node of a CAN bus that has this uuid (12 hex digits), by a
        number that no other has.  Raises error, also if another answers."""
        from klippy import canlink
        raw = canlink.parse_uuid(uuid)
        self._connect(lambda: canlink.open_node(interface, raw, nodeid),
                      "%s:%s" % (interface, uuid))
        self._check_node(raw, interface)

    def _check_node(self, uuid, interface):
        try:
            command = self.msgparser.create_command("get_canbus_id")
        except msgproto.error:
            return
        answer = self.query([command], "canbus_id")
        if bytes(answer["canbus_uuid"]) != uuid:
            self.disconnect()
            raise error("%sanother board answers on '%s': canbus_uuid %s instead of %s"
                        % (self.warn_prefix, interface,
                           bytes(answer["canbus_uuid"]).hex(), uuid.hex()))

    def connect_virtual(self, world, virtual_mcu):
        """Connect to an mcu of a VirtualWorld."""
        self._world = world
        self._attach(SerialQueue.open_virtual(world, virtual_mcu.link), None)
        deadline = self.reactor.monotonic() + self.connect_timeout
        while not self._try_identify():
            if self.serialqueue is None or self.reactor.monotonic() > deadline:
                self.disconnect()
                raise error("%sthe mcu does not answer" % (self.warn_prefix,))
        self._apply_dictionary()

    def connect_file(self, output_path, dictionary):
        """Write all commands to a file; dictionary is uncompressed JSON bytes.

        Raises error if the file cannot be written or the dictionary is bad.
        """
        self.is_fileoutput = True
        self.msgparser.process_identify(dictionary, decompress=False)
        try:
            output = open(output_path, "wb")
        except OSError as err:
            raise error("Unable to write the output file '%s': %s"
                        % (output_path, err.strerror))
        queue = SerialQueue.open_fd(self.reactor.clock, output.fileno(), "file")
        self._attach(queue, seriallink.FileLink(output.fileno(), output))

    def _connect(self, open_link, name, prepare=None):
        """Open and identify until it works, or for CONNECT_TIMEOUT."""
        deadline = self.reactor.monotonic() + self.connect_timeout
        reason = None
        while True:
            try:
                link = open_link()
                if prepare is not None:
                    prepare(link)
                self._start_real(link)
                if self._try_identify():
                    break
                self.disconnect()
                reason = "no answer from the mcu on '%s'" % (name,)
            except error as err:
                reason = str(err)
            is_warning = self.log_warnings and self.connect_timeout
            level = logging.WARNING if is_warning else logging.DEBUG
            logging.log(level, "%s%s", self.warn_prefix, reason)
            if self.reactor.monotonic() >= deadline:
                raise error("%sUnable to connect: %s" % (self.warn_prefix, reason))
            self.reactor.pause(self.reactor.monotonic() + OPEN_INTERVAL)
        self._apply_dictionary()

    def _attach(self, queue, link):
        self.serialqueue, self.link = queue, link
        self.default_cmd_queue = queue.alloc_command_queue()
        if self._world is not None:
            queue.set_ready_callback(self._pull_ready)

    def _start_real(self, link):
        clock = self.reactor.clock
        self._attach(SerialQueue.open_fd(clock, link.fileno(), link.kind,
                                         link.client_id), link)
        self._thread = threading.Thread(
            target=self._run_thread, args=(self.serialqueue,),
            name="mcu-%s" % (self.mcu_name or "link",), daemon=True)
        self._thread.start()

    def _apply_dictionary(self):
        parser = self.msgparser
        logging.info("%sloaded %d messages (%s / %s)", self.warn_prefix,
                     len(parser.messages_by_id), parser.version,
                     parser.build_versions)
        baud = (parser.get_constant_float("CANBUS_FREQUENCY", 0.)
                or parser.get_constant_float("SERIAL_BAUD", 0.))
        if baud:
            self.serialqueue.set_wire_frequency(baud)
        window = parser.get_constant_int("RECEIVE_WINDOW", 0)
        if window:
            self.serialqueue.set_receive_window(window)

    # The dictionary

    def _try_identify(self):
        """Fetch the dictionary; False if the mcu does not answer.

        Raises msgproto.error if what came is not a dictionary.
        """
        deadline = self.reactor.monotonic() + self.identify_timeout
        data = b""
        last_offset = -1
        while True:
            params = self._read_identify(len(data))
            now = self.reactor.monotonic()
            if params is not None and params["offset"] == len(data):
                chunk = params["data"]
                if not chunk:
                    break
                data += chunk
                deadline = now + self.identify_timeout
                last_offset = self._note_progress(len(data), last_offset)
            elif now > deadline or self.serialqueue is None:
                return False
            if len(data) > MAX_DICTIONARY:
                raise error("%sthe dictionary does not end after %d bytes"
                            % (self.warn_prefix, len(data)))
        self.msgparser = msgproto.MessageParser(warn_prefix=self.warn_prefix)
        self.msgparser.process_identify(data)
        self.dictionary_data = data
        return True

    def _read_identify(self, offset):
        command = self.msgparser.create_command(
            "identify offset=%d count=%d" % (offset, IDENTIFY_CHUNK))
        try:
            return self.query([command], "identify_response",
                              ack_timeout=min(1., self.identify_timeout))
        except error:
            return None

    def _note_progress(self, size, last_logged):
        if size - last_logged < 4096:
            return last_logged
        logging.debug("%s%d bytes of the dictionary read", self.warn_prefix, size)
        return size

    # Ending

    def disconnect(self):
        """Close the link and end all waits.  Safe to call again."""
        queue, self.serialqueue = self.serialqueue, None
        if queue is not None:
            queue.close()
        thread, self._thread = self._thread, None
        if thread is not None and thread is not threading.current_thread():
            thread.join()
        link, self.link = self.link, None
        if link is not None:
            link.close()
        self.default_cmd_queue = None
        self.abort_waits()

    def abort_waits(self):
        """End all waits for acknowledgements and responses with nothing."""
        with self._lock:
            pending, self._pending = list(self._pending.values()), {}
        for completion in pending + [q.completion for q in self._queries]:
            self.reactor.async_complete(completion, None)

    def set_fault_callback(self, callback):
        """Call callback(text) when a response handler fails."""
        self._fault_callback = callback

    # Receiving

    def register_response(self, callback, name, oid=None):
        """Call callback(params) for each response of that name and oid.

        callback None ends it.  It runs in the response thread.
        """
        with self._lock:
            if callback is None:
                self._handlers.pop((name, oid), None)
            else:
                self._handlers[name, oid] = callback

    def set_default_handler(self, callback):
        """Call callback(params) for each response that nobody registered for."""
        self._default_handler = callback

    def _run_thread(self, queue):
        """Body of the response thread."""
        while True:
            try:
                entry = queue.pull()
                if entry is None:
                    return
                self._handle_entry(entry)
            except Exception as err:
                logging.exception("%sa response handler failed", self.warn_prefix)
                self._note_fault("Internal error on response of an mcu: %s"
                                 % (str(err) or type(err).__name__,))

    def _note_fault(self, text):
        if self._fault_callback is not None:
            self._fault_callback(text)

    def _pull_ready(self):
        """Take in all that a virtual link has received."""
        while self.serialqueue is not None:
            entry = self.serialqueue.pull()
            if entry is None:
                return
            self._handle_entry(entry)

    def _handle_entry(self, entry):
        data, sent_time, receive_time, notify_id = entry
        if notify_id:
            with self._lock:
                completion = self._pending.pop(notify_id, None)
            if completion is not None:
                self.reactor.async_complete(completion, (sent_time, receive_time))
            return
        if not data:
            self._note_fault("Out of memory: messages of an mcu were lost")
            return
        for params in self.msgparser.parse_payload(data):
            params["#sent_time"] = sent_time
            params["#receive_time"] = receive_time
            self._dispatch(params)

    def _dispatch(self, params):
        name = params["#name"]
        with self._lock:
            handler = self._handlers.get((name, params.get("oid")))
        (handler or self._default_handler)(params)

    def _ignore(self, params):
        logging.debug("%signored %s", self.warn_prefix,
                      self.msgparser.format_params(params))

    def _handle_unknown(self, params):
        # before the dictionary is there everything but its parts is unknown
        is_warning = self.log_warnings and self.msgparser.get_version_info()[0]
        level = logging.WARNING if is_warning else logging.DEBUG
        logging.log(level, "%sunknown message %s", self.warn_prefix,
                    params["#msg"].hex())

    def _handle_output(self, params):
        logging.info("%soutput: %s", self.warn_prefix, params["#msg"])

    # Sending

    def get_msgparser(self):
        """The MessageParser of the mcu."""
        return self.msgparser

    def get_serialqueue(self):
        """The SerialQueue of the link."""
        return self.serialqueue

    def get_default_command_queue(self):
        """The command queue for what needs no queue of its own."""
        return self.default_cmd_queue

    def get_reactor(self):
        """The reactor that waits run in."""
        return self.reactor

    def alloc_command_queue(self):
        """A new command queue; its commands stay in order."""
        return CommandQueue()

    def set_clock_est(self, freq, conv_time, conv_clock, last_clock):
        """Tell the queue how the mcu's clock runs."""
        if self.serialqueue is not None:
            self.serialqueue.set_clock_est(freq, conv_time, conv_clock, last_clock)

    def raw_send(self, cmd, minclock=0, reqclock=0, queue=None, notify_id=0):
        """Queue the bytes of a command; without a link it is dropped."""
        if self.serialqueue is None:
            return
        self.serialqueue.send(
            queue if queue is not None else self.default_cmd_queue, cmd,
            minclock, reqclock, notify_id)

    def raw_send_notify(self, cmd, minclock=0, reqclock=0, queue=None):
        """As raw_send(); returns a completion of (sent, acked) times.

        It completes with None if the link is closed.
        """
        completion = self.reactor.completion()
        if self.is_fileoutput:
            self.raw_send(cmd, minclock, reqclock, queue)
            completion.complete((0., 0.))
            return completion
        if self.serialqueue is None:
            completion.complete(None)
            return completion
        with self._lock:
            self._notify_id += 1
            notify_id = self._notify_id
            self._pending[notify_id] = completion
        self.raw_send(cmd, minclock, reqclock, queue, notify_id)
        return completion

    def raw_send_wait_ack(self, cmd, minclock=0, reqclock=0, queue=None):
        """As raw_send(), and wait for the acknowledgement.

        Returns (sent, acked) times.  Raises error if the link closes.
        """
        times = self.raw_send_notify(cmd, minclock, reqclock, queue).wait()
        if times is None:
            raise error("%sthe link closed before a command was acknowledged"
                        % (self.warn_prefix,))
        return times

    def send(self, text, minclock=0, reqclock=0):
        """Queue a command given as text."""
        self.raw_send(self.msgparser.create_command(text), minclock, reqclock)

    def send_with_response(self, text, response):
        """Send a command given as text; returns the response as a dict."""
        return self.query([self.msgparser.create_command(text)], response)

    def query(self, cmds, name, oid=None, minclock=0, reqclock=0, queue=None,
              retry=True, ack_timeout=None):
        """Send commands (bytes) and wait for a response to the last one.

        Raises error if the mcu does not answer.
        """
        query = Query(self, name, oid, self.reactor.completion())
        query.min_sent_time = self.reactor.monotonic()
        previous = self._handlers.get((name, oid))
        self.register_response(query.note_response, name, oid)
        self._queries.add(query)
        try:
            params = self._run_query(query, cmds, minclock, reqclock, queue,
                                     retry, ack_timeout)
        finally:
            self._queries.discard(query)
            self.register_response(previous, name, oid)
        if params is None:
            raise error("Unable to obtain '%s' response%s"
                        % (name, " from " + self.warn_prefix.rstrip(": ")
                           if self.warn_prefix else ""))
        return params

    def _run_query(self, query, cmds, minclock, reqclock, queue, retry, ack_timeout):
        reactor = self.reactor
        for delay in QUERY_DELAYS if retry else QUERY_DELAYS[-1:]:
            for cmd in cmds[:-1]:
                self.raw_send(cmd, minclock, reqclock, queue)
            acked = self.raw_send_notify(cmds[-1], minclock, reqclock, queue)
            never = reactor.NEVER
            limit = never if ack_timeout is None else reactor.monotonic() + ack_timeout
            if acked.wait(limit) is None or self.serialqueue is None:
                return None
            params = query.completion.wait(reactor.monotonic() + delay)
            if params is not None:
                return params
            if query.completion.test():
                return None
        return None

    # Reports

    def stats(self, eventtime=0.):
        """Figures of the link: {name: number}."""
        return self.serialqueue.get_stats() if self.serialqueue is not None else {}

    def dump_debug(self):
        """The last blocks of both directions as lines of text."""
        if self.serialqueue is None:
            return []
        lines = []
        sent, received = self.serialqueue.dump_debug()
        for title, blocks in (("sent", sent), ("received", received)):
            lines.append("%s%d last blocks %s" % (self.warn_prefix, len(blocks), title))
            for i, (data, time) in enumerate(blocks):
                lines.append("%s %d %.6f: %s" % (
                    title, i, time, ", ".join(self.msgparser.dump(data))))
        return lines
