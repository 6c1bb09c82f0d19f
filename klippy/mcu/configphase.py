# SPDX-License-Identifier: GPL-3.0-or-later
"""What an mcu is told before printing: objects, their set-up, a checksum.

config commands create objects (once after a reset), init commands start them,
restart commands put them at rest when the mcu still has our configuration.
"""

import re
import zlib

from klippy import pins
from klippy.errors import ConfigError

UNKNOWN_VALUE = re.compile(r"Field '(?P<field>\w*pin)' .* not '(?P<pin>.*)'")


class ConfigPhase:
    """Collects the configuration of one mcu until it is closed."""

    def __init__(self, mcu_name, printer=None):
        self.mcu_name, self.printer = mcu_name, printer
        self.oid_count = 0
        self.callbacks = []
        self.config_cmds, self.init_cmds, self.restart_cmds = [], [], []
        self.crc = None
        # What there was before the callbacks added to it
        self._start = None

    def create_oid(self):
        """Number for a new object of the mcu."""
        self.oid_count += 1
        return self.oid_count - 1

    def add(self, cmd, is_init=False, on_restart=False):
        """Add a command given as text."""
        if is_init:
            self.init_cmds.append(cmd)
        elif on_restart:
            self.restart_cmds.append(cmd)
        else:
            self.config_cmds.append(cmd)

    def build(self, resolver):
        """Run all callbacks and put the commands in their final form.

        resolver: the PinResolver of the mcu.  Sets crc.  May be done again, for an
        mcu that was away.
        """
        if self._start is None:
            self._start = (self.oid_count, list(self.callbacks), list(self.config_cmds),
                           list(self.init_cmds), list(self.restart_cmds))
        self.oid_count, *lists = self._start
        self.callbacks, self.config_cmds, self.init_cmds, self.restart_cmds = (
            list(commands) for commands in lists)
        index = 0
        while index < len(self.callbacks):
            self.callbacks[index]()
            index += 1
        self.config_cmds.insert(0, "allocate_oids count=%d" % (self.oid_count,))
        for cmds in (self.config_cmds, self.restart_cmds, self.init_cmds):
            cmds[:] = [resolver.update_command(cmd) for cmd in cmds]
        self.crc = zlib.crc32("\n".join(self.config_cmds).encode())
        self.config_cmds.append("finalize_config crc=%d" % (self.crc,))

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
