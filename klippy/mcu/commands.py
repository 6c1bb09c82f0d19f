# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands to one mcu, looked up once and sent often.

Clocks are 64 bit ticks of that mcu; 0 means "no bound".
"""


class CommandWrapper:
    """Sends one kind of command on one command queue."""

    def __init__(self, mcu, command, queue):
        self._serial = mcu.get_serial()
        self._command = command
        self._queue = queue

    def send(self, data=(), minclock=0, reqclock=0):
        """Queue the command with the argument values in data.

        It arrives after minclock and should arrive by reqclock.
        """
        self._serial.raw_send(
            self._command.encode(data), minclock, reqclock, self._queue)

    def send_notify(self, data=()):
        """Like send(); returns a completion of the acknowledgement's times, of None
        if the link closes before."""
        return self._serial.raw_send_notify(
            self._command.encode(data), queue=self._queue)

    def send_wait_ack(self, data=(), minclock=0, reqclock=0):
        """Like send(), and wait until the mcu has acknowledged it."""
        self._serial.raw_send_wait_ack(
            self._command.encode(data), minclock, reqclock, self._queue)

    def get_command_tag(self):
        """Number of the command in this mcu's dictionary."""
        return self._command.msgid


class AsyncCommandWrapper(CommandWrapper):
    """A command that any thread may send."""


class CommandQueryWrapper:
    """Sends a query and waits for the response to it."""

    def __init__(self, mcu, command, response_name, oid, queue):
        self._mcu = mcu
        self._serial = mcu.get_serial()
        self._command = command
        self._response_name = response_name
        self._oid = oid
        self._queue = queue

    def send(self, data=(), minclock=0, reqclock=0, retry=True):
        """Send the query; returns the fields of the response as a dict.

        Asks again when no answer comes in time, unless retry is false.
        Raises McuError if there is none at all.
        """
        return self._query([self._command.encode(data)], minclock, reqclock, retry)

    def send_with_preface(self, preface, preface_data=(), data=(),
                          minclock=0, reqclock=0, retry=True):
        """Like send(), with another command directly ahead of the query."""
        cmds = [preface._command.encode(preface_data), self._command.encode(data)]
        return self._query(cmds, minclock, reqclock, retry)

    def _query(self, cmds, minclock, reqclock, retry):
        return self._serial.query(
            cmds, self._response_name, self._oid, minclock=minclock,
            reqclock=reqclock, queue=self._queue, retry=retry)
