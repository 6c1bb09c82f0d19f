# SPDX-License-Identifier: GPL-3.0-or-later
"""A hand-cranked world around one simulator firmware, for tests.

Speaks the wire protocol by itself (nothing shared with klippy_ext), records
every edge, and moves time only when told to.
"""

import _ctypes
import ctypes
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
SYNC = 0x7E
C = ctypes
CALLBACKS = [
    ("tx", None, [C.c_uint64, C.POINTER(C.c_uint8), C.c_uint32]),
    ("pin_out", None, [C.c_uint64, C.c_uint32, C.c_uint8]),
    ("pin_in", C.c_uint8, [C.c_uint64, C.c_uint32, C.c_int8]),
    ("adc_in", C.c_uint16, [C.c_uint64, C.c_uint32]),
    ("pwm_out", None, [C.c_uint64] + [C.c_uint32] * 4),
    ("spi", None, [C.c_uint64, C.c_uint32, C.POINTER(C.c_uint8), C.c_uint32]),
    ("i2c", C.c_int32, [C.c_uint64, C.c_uint32, C.c_uint8,
                        C.POINTER(C.c_uint8), C.c_uint32,
                        C.POINTER(C.c_uint8), C.c_uint32]),
    ("reset", None, [C.c_uint64]),
    ("late", None, [C.c_uint64, C.c_uint64]),
]
TYPES = {name: C.CFUNCTYPE(res, C.c_void_p, *args)
         for name, res, args in CALLBACKS}


class Host(C.Structure):
    _fields_ = ([("ctx", C.c_void_p)]
                + [(name, TYPES[name]) for name, _, _ in CALLBACKS])


class Ops(C.Structure):
    _fields_ = [
        ("abi_version", C.c_uint32), ("clock_freq", C.c_uint32),
        ("n_pins", C.c_uint32), ("name", C.c_char_p),
        ("power_on", C.CFUNCTYPE(C.c_int32, C.POINTER(Host), C.c_uint64)),
        ("rx", C.CFUNCTYPE(C.c_int32, C.c_uint64, C.c_char_p, C.c_uint32)),
        ("run", C.CFUNCTYPE(C.c_uint64, C.c_uint64)),
        ("find_pin", C.CFUNCTYPE(C.c_int32, C.c_char_p)),
        ("power_off", C.CFUNCTYPE(None)),
    ]


def build_simulator(out="out/test-simulator/", extra="",
                    config="test/configs/simulator.config"):
    """Bring the simulator firmware up to date; returns its .so.

    The environment's SIMULATOR_SO names another build to test instead.
    """
    if "SIMULATOR_SO" in os.environ:
        return pathlib.Path(os.environ["SIMULATOR_SO"])
    subprocess.run(
        ["make", "-s", "firmware", "OUT=" + out, "PYTHON=" + sys.executable,
         "KCONFIG_CONFIG=" + config, "EXTRA_CFLAGS=" + extra],
        cwd=ROOT, check=True, capture_output=True, text=True)
    return ROOT / out / "klipper.so"


def crc16(data):
    """CRC16-CCITT, bit by bit."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x8408 if crc & 1 else 0)
    return bytes([crc >> 8, crc & 0xFF])


def encode_int(value):
    """Variable length quantity of a 32 bit number."""
    value = (value + (1 << 31)) % (1 << 32) - (1 << 31)
    size = 1
    while not -(1 << (7 * size - 2)) <= value < 3 << (7 * size - 2):
        size += 1
    return bytes((value >> 7 * i) & 0x7F | (0x80 if i else 0)
                 for i in reversed(range(size)))


def decode_int(data, pos):
    value = data[pos] & 0x7F
    value -= 0x80 if value >= 0x60 else 0
    while data[pos] & 0x80:
        pos += 1
        value = value << 7 | data[pos] & 0x7F
    return value & 0xFFFFFFFF, pos + 1


def frame(seq, payload):
    """A whole block around a payload."""
    block = bytes([len(payload) + 5, 0x10 | seq & 15]) + payload
    return block + crc16(block) + bytes([SYNC])


class Format:
    """One message format of the dictionary."""

    def __init__(self, fmt, msg_id):
        self.name, *params = fmt.split()
        self.msg_id = msg_id
        self.params = [param.split("=") for param in params]

    def encode(self, values):
        out = encode_int(self.msg_id)
        for name, kind in self.params:
            if kind.endswith("s"):
                out += bytes([len(values[name])]) + bytes(values[name])
            else:
                out += encode_int(values[name])
        return out

    def decode(self, data, pos):
        fields = {"#name": self.name}
        for name, kind in self.params:
            if kind.endswith("s"):
                size = data[pos]
                fields[name] = bytes(data[pos + 1:pos + 1 + size])
                pos += 1 + size
                continue
            value, pos = decode_int(data, pos)
            if kind in ("%i", "%hi") and value >= 1 << 31:
                value -= 1 << 32
            fields[name] = value
        return fields, pos


BOOT_FORMATS = {"identify_response offset=%u data=%.*s": 0,
                "identify offset=%u count=%c": 1}


# Boards that were made and not closed
open_boards = []


def close_boards():
    """Close all boards; fixtures of tests do that."""
    for board in list(open_boards):
        board.close()


class SimBoard:
    """One mcu, powered on at `clock`; time stands still between calls.

    close() gives its memory back: 10 MB and more of an emulated chip.
    """

    def __init__(self, library, clock=0):
        self.folder = tempfile.TemporaryDirectory()
        copy = shutil.copy(library, self.folder.name + "/mcu.so")
        self.library = C.CDLL(copy)
        get_ops = self.library.vmcu_get_ops
        get_ops.restype = C.POINTER(Ops)
        self.ops = get_ops().contents
        self.failures = []
        self.host = Host(None, *[
            TYPES[name](self._guard(getattr(self, "_" + name)))
            for name, _, _ in CALLBACKS])
        self.freq = self.ops.clock_freq
        self.inputs, self.analog = {}, {}
        self.watchers = {}  # pin: called with (clock, level) at each edge
        self.spi_devices = {}  # bus: data sent -> data received
        self.i2c_devices = {}  # (bus, addr): (data, n_read) -> data or None
        self.pwm, self.resets, self.late = [], [], []
        self.commands, self.responses = {}, {}
        self.use_formats(BOOT_FORMATS)
        open_boards.append(self)
        self.power_on(clock)

    def close(self):
        """Power off and let go of the program.  Safe to call again."""
        if self not in open_boards:
            return
        open_boards.remove(self)
        self.ops.power_off()
        handle = self.library._handle
        self.ops = self.library = self.host = None
        _ctypes.dlclose(handle)
        self.folder.cleanup()

    def _guard(self, callback):
        """An exception cannot pass through C: keep it for run() to raise."""
        def call(*args):
            try:
                return callback(*args)
            except Exception as e:
                self.failures.append(e)
                return 0
        return call

    def power_on(self, clock):
        self.clock = clock
        self.edges, self.messages, self.blocks = [], [], []
        self.received = b""
        self.seq = 0
        self.next_event = 0
        assert self.ops.power_on(C.byref(self.host), clock) == 0
        self.run(clock)

    def use_formats(self, ids):
        for fmt, msg_id in ids.items():
            form = Format(fmt, msg_id)
            self.commands[form.name] = self.responses[msg_id] = form

    def _tx(self, ctx, clock, buf, size):
        self.received += bytes(buf[:size])
        while self.received:
            size = self.received[0]
            block, self.received = self.received[:size], self.received[size:]
            assert block == frame(block[1], block[2:-3])
            self.blocks.append((clock, block))
            self._decode(clock, block[2:-3])

    def _decode(self, clock, payload):
        pos = 0
        while pos < len(payload):
            msg_id, pos = decode_int(payload, pos)
            if msg_id not in self.responses:
                self.messages.append({"#name": "#unknown", "#clock": clock})
                return
            fields, pos = self.responses[msg_id].decode(payload, pos)
            fields["#clock"] = clock
            self.messages.append(fields)

    def _pin_out(self, ctx, clock, pin, level):
        self.edges.append((clock, pin, level))
        if pin in self.watchers:
            self.watchers[pin](clock, level)

    def _pin_in(self, ctx, clock, pin, pull):
        source = self.inputs.get(pin, pull > 0)
        return source(clock) if callable(source) else source

    def _adc_in(self, ctx, clock, pin):
        source = self.analog.get(pin, 0)
        return source(clock) if callable(source) else source

    def _pwm_out(self, ctx, clock, pin, cycle, value, top):
        self.pwm.append((clock, pin, cycle, value, top))

    def _spi(self, ctx, clock, bus, buf, size):
        if bus in self.spi_devices:
            C.memmove(buf, self.spi_devices[bus](bytes(buf[:size])), size)

    def _i2c(self, ctx, clock, bus, addr, wr, wr_len, rd, rd_len):
        device = self.i2c_devices.get((bus, addr))
        answer = device and device(bytes(wr[:wr_len]), rd_len)
        if answer is None:
            return -1
        C.memmove(rd, answer, rd_len)
        return 0

    def _reset(self, ctx, clock):
        self.resets.append(clock)

    def _late(self, ctx, clock, late):
        self.late.append((clock, late))

    def run(self, clock):
        """Let time pass up to and including this clock."""
        self.clock = max(clock, self.clock)
        self.next_event = self.ops.run(self.clock)
        if self.failures:
            raise self.failures[0]
        assert self.next_event > self.clock

    def run_for(self, seconds):
        self.run(self.clock + round(seconds * self.freq))

    def send_raw(self, data):
        """Bytes to the console, as the mcu can take them."""
        assert self.ops.rx(self.clock, data, len(data))
        self.run(self.clock)

    def send_block(self, payload):
        self.send_raw(frame(self.seq, payload))
        self.seq += 1

    def send(self, name, **values):
        """One command in a block of its own."""
        self.send_block(self.commands[name].encode(values))

    def query(self, name, response, **values):
        """Send a command; its answer (the last of that name)."""
        n = len(self.messages)
        self.send(name, **values)
        found = self.list_messages(response, n)
        assert found, "no %s after %s: %s" % (response, name, self.messages[n:])
        return found[-1]

    def list_messages(self, name, start=0):
        return [m for m in self.messages[start:] if m["#name"] == name]

    def identify(self):
        """Fetch the dictionary and use its formats; returns it."""
        data = b""
        while True:
            answer = self.query("identify", "identify_response",
                                offset=len(data), count=40)
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

    def configure(self, *commands, oids=20, crc=1234):
        """allocate_oids, the (name, values) given, finalize_config."""
        self.send("allocate_oids", count=oids)
        for name, values in commands:
            self.send(name, **values)
        self.send("finalize_config", crc=crc)

    def configure_shutdown_at(self, oid, pin):
        """Configure an output for shutdown_at()."""
        return ("config_digital_out", dict(
            oid=oid, pin=pin, value=0, default_value=0, max_duration=100))

    def shutdown_at(self, oid, clock):
        """Shut down by a timer, in the middle of whatever a task does."""
        self.send("queue_digital_out", oid=oid, clock=clock - 100, on_ticks=1)

    def find_shutdown(self):
        """Reason of the shutdown, None if there was none."""
        found = self.list_messages("shutdown")
        return self.strings[found[0]["static_string_id"]] if found else None

    def list_edges(self, pin, start=0):
        """(clock, level) of one pin."""
        return [(c, lv) for c, p, lv in self.edges if p == pin and c >= start]


def list_words(text):
    """Names in a format string, for tests of the dictionary."""
    return re.findall(r"(\w+)=", text)
