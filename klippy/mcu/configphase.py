# SPDX-License-Identifier: GPL-3.0-or-later
"""What an mcu is told before printing: objects, their set-up, a checksum.

config commands create objects (once after a reset), init commands start them,
restart commands put them at rest when the mcu still has our configuration.
"""

import re
import zlib

from klippy import pins
from klippy.errors import ConfigError
from klippy.msgproto import MissingError, UnknownNameError

UNKNOWN_VALUE = re.compile(r"Field '(?P<field>\w*pin)' .* not '(?P<pin>.*)'")


def is_there(part):
    """False for a part that the firmware lacks."""
    return part is None or part.lack is None


class ConfigPhase:
    """Collects the configuration of one mcu until it is closed.

    What is collected belongs to a Part, or to None; that of a part which the firmware
    lacks is left out.
    """

    def __init__(self, mcu_name, printer=None):
        self.mcu_name, self.printer = mcu_name, printer
        self.oid_count = self.move_slots = 0
        self.config_cmds, self.init_cmds, self.restart_cmds = [], [], []
        self.crc = None
        # (callback, part)
        self._callbacks = []
        # (text, part): of config, init and restart commands
        self._added = ([], [], [])
        self._slots = []                # the part of each
        self._part = None               # whose callback runs
        self._parser = None             # while callbacks run
        # What there was before the callbacks added to it
        self._start = None

    def create_oid(self):
        """Number for a new object of the mcu."""
        self.oid_count += 1
        return self.oid_count - 1

    def reserve_move_slot(self, part=None):
        """Keep one entry of the mcu's move queue free."""
        self._slots.append(self._part or part)

    def add_callback(self, callback, part=None):
        """Have build() call callback(), which may add more."""
        self._callbacks.append((callback, self._part or part))

    def add(self, cmd, is_init=False, on_restart=False, part=None):
        """Add a command given as text.

        Raises MissingError, once the firmware is known, if that does not have it.
        """
        if self._parser is not None:
            self._parser.check_text(cmd)
        commands = self._added[1 if is_init else 2 if on_restart else 0]
        commands.append((cmd, self._part or part))

    def build(self, parser, resolver):
        """Run all callbacks and put the commands in their final form.

        parser: MessageParser, resolver: PinResolver of the mcu.  Sets crc, and
        move_slots.  May be done again, for an mcu that was away.
        """
        self._restore()
        for commands in self._added:
            for cmd, part in commands:
                self._run(part, parser.check_text, cmd)
        self._parser = parser
        index = 0
        while index < len(self._callbacks):
            callback, part = self._callbacks[index]
            self._run(part, callback)
            index += 1
        self._parser = None
        self.config_cmds, self.init_cmds, self.restart_cmds = (
            [resolver.update_command(cmd) for cmd, part in commands if is_there(part)]
            for commands in self._added)
        self.move_slots = sum(1 for part in self._slots if is_there(part))
        self.config_cmds.insert(0, "allocate_oids count=%d" % (self.oid_count,))
        self.crc = zlib.crc32("\n".join(self.config_cmds).encode())
        self.config_cmds.append("finalize_config crc=%d" % (self.crc,))

    def _restore(self):
        """Have what there was before the first build."""
        now = (self._callbacks, *self._added, self._slots)
        if self._start is None:
            self._start = (self.oid_count, [list(entries) for entries in now])
        self.oid_count, lists = self._start
        for entries, before in zip(now, lists, strict=True):
            entries[:] = before

    def _run(self, part, func, *args):
        """Call func(), which is of a part; that is left out if something lacks."""
        if not is_there(part):
            return
        self._part = part
        try:
            func(*args)
        except MissingError as err:
            if part is None:
                raise
            part.note_lack(err)
        except UnknownNameError as err:
            names = part.describe() if part is not None else ""
            raise ConfigError("%s, on mcu '%s'%s" % (
                err, self.mcu_name, " (%s)" % (names,) if names else ""))
        finally:
            self._part = None

    def encode(self, parser, is_configured):
        """Bytes of all commands to send, in order.

        Raises ConfigError for a pin the mcu does not have.
        """
        first = self.restart_cmds if is_configured else self.config_cmds
        return [self._encode_one(parser, cmd) for cmd in first + self.init_cmds]

    def _encode_one(self, parser, cmd):
        try:
            return parser.create_command(cmd)
        except parser.error as err:
            match = UNKNOWN_VALUE.match(str(err))
            if match is None:
                raise
            pin = match["pin"]
            known = parser.get_enumeration("pin")
            users = pins.find_users(self.printer, "%s:%s" % (self.mcu_name, pin))
            raise ConfigError("Pin '%s' is not a valid pin name on mcu '%s'%s%s" % (
                pin, self.mcu_name, " (%s)" % (", ".join(users),) if users else "",
                pins.offer(pins.near_names(pin, known))
                or ": see the pins of the board"))
