# SPDX-License-Identifier: GPL-3.0-or-later
"""Opening the ways to an mcu: serial ports, pseudo terminals, sockets."""

import errno
import logging
import os
import stat

from klippy.errors import McuError

# Serial protocol of the stk500v2 boot loader: "leave programming mode"
STK500V2_BAUD = 115200
STK500V2_LEAVE = bytes((0x1b, 1, 0, 1, 0x0e, 0x11, 0x04))
SOCKET_SCHEMES = ("tcp://", "unix://")
FILE_PREFIXES = ("/tmp/", "/dev/rpmsg_", "/dev/pts/")
REMOTE_TIMEOUT = 5.
NO_PORT = (errno.ENOTTY, errno.EINVAL, errno.EISDIR)


class error(McuError):
    """A link to an mcu cannot be opened or has failed."""


class FileLink:
    """A descriptor that carries the bytes; closed by close()."""

    kind, client_id = "serial", 0

    def __init__(self, fd, owner=None):
        self._fd, self._owner = fd, owner

    def fileno(self):
        """The descriptor."""
        return self._fd

    def close(self):
        """Close the descriptor.  Safe to call again."""
        owner, self._owner = self._owner, None
        fd, self._fd = self._fd, -1
        if owner is not None:
            owner.close()
        elif fd >= 0:
            os.close(fd)


def is_socket(path):
    """True for the address of a socket."""
    return path.startswith(SOCKET_SCHEMES)


def is_terminal(path):
    """True for a pseudo terminal or channel, which has no speed to set."""
    return path.startswith(FILE_PREFIXES)


def open_uart(path, baud, rts=True):
    """Open a serial port.  Raises error naming the port and the reason."""
    import serial
    try:
        port = serial.Serial(baudrate=baud, timeout=0, exclusive=True)
        port.port = path
        port.rts = rts
        port.open()
    except (OSError, ValueError, OverflowError, serial.SerialException) as err:
        raise error("Unable to open serial port '%s' at %d baud: %s"
                    % (path, baud, explain(err)))
    return FileLink(port.fileno(), port)


def leave_bootloader(link, baud):
    """Have an stk500v2 boot loader start the firmware at once."""
    port = link._owner
    port.baudrate = STK500V2_BAUD
    port.write(STK500V2_LEAVE)
    port.flush()
    port.reset_input_buffer()
    port.baudrate = baud


def open_pipe(path):
    """Open a pseudo terminal or another file that has no speed."""
    try:
        fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as err:
        raise error("Unable to open '%s': %s" % (path, explain(err)))
    if stat.S_ISREG(os.fstat(fd).st_mode):
        os.close(fd)
        raise error("Unable to open '%s': it is no serial port, but a file" % (path,))
    return FileLink(fd)


def open_remote(address):
    """Connect to tcp://host:port or unix://path."""
    import socket
    try:
        if address.startswith("unix://"):
            sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            sock.settimeout(REMOTE_TIMEOUT)
            sock.connect(address[len("unix://"):])
        else:
            host, _, port = address[len("tcp://"):].rpartition(":")
            sock = socket.create_connection((host, int(port)), REMOTE_TIMEOUT)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except ValueError:
        raise error("'%s' is no address: the format is tcp://host:port" % (address,))
    except OSError as err:
        raise error("Unable to connect to '%s': %s" % (address, explain(err)))
    sock.setblocking(False)
    return FileLink(sock.fileno(), sock)


def explain(err):
    """Text of an OSError with what can be done about it."""
    number = getattr(err, "errno", None)
    if number is None:              # pyserial keeps it in the text only
        number = (getattr(err.__context__, "args", None) or (None,))[0]
    if number in NO_PORT:
        return "it is no serial port"
    if number == errno.ENOENT:
        return "it does not exist; is the board connected and powered?"
    if number in (errno.EACCES, errno.EPERM):
        return "no permission; the user must be in the port's group (dialout)"
    if number in (errno.EBUSY, errno.EAGAIN):
        return "another program uses it"
    logging.debug("opening a link failed: %r", err)
    return str(err)
