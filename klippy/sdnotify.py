# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells the service manager how the daemon is: ready, status, alive, stopping.

Speaks the datagram protocol of sd_notify(3).  Where no manager listens
(no NOTIFY_SOCKET) every call does nothing.
"""

import logging
import os

STATUS_PERIOD = 1.          # s between looks at the printer's state


class Notifier:
    """Sends to the socket that the environment names; never waits."""

    def __init__(self, environ=os.environ):
        self.address = environ.get("NOTIFY_SOCKET") or None
        self.watchdog_period = _read_watchdog(environ)
        self.sock = None
        if self.address is None:
            return
        if self.address.startswith("@"):        # abstract name space
            self.address = "\0" + self.address[1:]
        import socket
        self.sock = socket.socket(socket.AF_UNIX,
                                  socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self.sock.setblocking(False)

    def send(self, **fields):
        """Send fields, such as READY=1; a manager that is gone is logged once."""
        if self.sock is None:
            return
        text = "\n".join("%s=%s" % (name, str(value).replace("\n", " "))
                         for name, value in fields.items())
        try:
            self.sock.sendto(text.encode("utf-8", "replace"), self.address)
        except BlockingIOError:
            return          # the next sign of life may fit again
        except OSError as err:
            logging.warning("the service manager does not listen at '%s': %s",
                            self.address.replace("\0", "@"), err)
            self.close()

    def watch(self, printer):
        """Tell about a printer from now on, until its reactor ends.

        The daemon counts as ready once it serves: a printer with a faulty
        config is up too, with its message as status.
        """
        reactor = printer.get_reactor()
        if self.sock is None:
            return
        told, next_sign = None, 0.

        def tell(eventtime):
            nonlocal told, next_sign
            message, state = printer.get_state_message()
            status = "%s: %s" % (state, message.partition("\n")[0])
            is_due = bool(self.watchdog_period) and eventtime >= next_sign
            if status != told or is_due:
                self.send(READY=1, STATUS=status,
                          **({"WATCHDOG": 1} if self.watchdog_period else {}))
                told, next_sign = status, eventtime + self.watchdog_period
            return eventtime + min(STATUS_PERIOD, self.watchdog_period or STATUS_PERIOD)
        reactor.register_timer(tell, reactor.NOW)

    def close(self):
        """Stop telling."""
        if self.sock is not None:
            self.sock.close()
            self.sock = None


def _read_watchdog(environ):
    """Seconds between signs of life (a third of what is allowed), 0 if none."""
    if environ.get("WATCHDOG_PID", str(os.getpid())) != str(os.getpid()):
        return 0.
    text = environ.get("WATCHDOG_USEC", "")
    return int(text) / 3e6 if text.isdecimal() else 0.
