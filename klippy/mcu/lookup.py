# SPDX-License-Identifier: GPL-3.0-or-later
"""What of an mcu's firmware others look up: commands, constants, names."""

from klippy import msgproto
from klippy.mcu import features
from klippy.mcu.commands import CommandQueryWrapper, CommandWrapper


class FirmwareLookup:
    """The part of an MCU that answers from the dictionary of its firmware.

    What is missing raises msgproto.MissingError, whose text says what helps.
    """

    def _lookup(self, msgformat):
        return self._explain(self._serial.get_msgparser().lookup_command, msgformat)

    def _explain(self, func, *args):
        try:
            return func(*args)
        except msgproto.MissingError as err:
            features.explain(self._name, err)
            raise

    def lookup_command(self, msgformat, cq=None):
        """A CommandWrapper."""
        return CommandWrapper(self, self._lookup(msgformat), cq)

    def lookup_query_command(self, msgformat, respformat, oid=None, cq=None,
                             is_async=False):
        """A CommandQueryWrapper."""
        command, response = self._lookup(msgformat), self._lookup(respformat)
        return CommandQueryWrapper(self, command, response.name, oid, cq)

    def try_lookup_command(self, msgformat):
        """A CommandWrapper, or None if the firmware lacks the command."""
        try:
            message = self._serial.get_msgparser().lookup_command(msgformat)
        except msgproto.error:
            return None
        return CommandWrapper(self, message, None)

    def lookup_response_tag(self, msgformat):
        """Number of a response in the dictionary."""
        return self._lookup(msgformat).msgid

    def get_enumerations(self):
        """{enumeration: {name: value}} of the firmware."""
        return self._serial.get_msgparser().get_enumerations()

    def get_constants(self):
        """{name: value} of the firmware."""
        return self._serial.get_msgparser().get_constants()

    def get_constant_float(self, name):
        """A constant of the firmware."""
        return self._explain(self._serial.get_msgparser().get_constant_float, name)
