# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to restart an mcu: by command or by the control lines of its port."""

import logging
import os

from klippy.errors import McuError

METHODS = {"arduino": "arduino", "cheetah": "cheetah", "command": "command",
           "rpi_usb": "rpi_usb"}
RESET_BAUD = 2400
USB_POWER = "/sys/devices/platform/soc/*.usb/buspower"
SETTLE_TIME = 0.015
# So long (s) a sign of a restart is waited for; a link that was cut may take longer to
# bring the command there, and then the next start sees to it
ANSWER_LIMIT = 0.5
REBOOT_TIME = 2.


def list_behind(mcu, others):
    """Of `others` those that are reached through this one's CAN adapter: they must
    restart before it does, as the way to them is gone then."""
    if not mcu.is_bridge():
        return []
    return [other for other in others if other is not mcu and other.is_on_canbus()
            and not other.is_bridge()]


class McuRestart:
    """Restarts one mcu the way its config asks for."""

    def __init__(self, mcu, method, connection):
        self._mcu = mcu
        self.method = method
        self._connection = connection
        self._reactor = mcu.get_printer().get_reactor()
        self._commands = ()

    @property
    def uses_usb_power(self):
        """True if the restart switches the power of all USB devices."""
        return self.method == "rpi_usb"

    def lookup_commands(self):
        """Find the reset commands of the identified firmware."""
        self._commands = [
            (name, self._mcu.try_lookup_command(name))
            for name in ("reset", "config_reset")]

    def has_command(self):
        """True if the firmware can restart itself."""
        return any(cmd is not None for _, cmd in self._commands)

    def run(self):
        """Restart the mcu and close the link to it.

        Raises McuError if the way is not open.
        """
        method = self.method
        if method is None:
            method = "command" if self.has_command() else "arduino"
        if method != "command" and self._connection.get_machine() is not None:
            method = "power"
        logging.info("mcu '%s': restart by %s", self._mcu.get_name(), method)
        getattr(self, "_run_" + method)()

    def _run_command(self):
        commands = dict(self._commands)
        name = "reset" if commands.get("reset") is not None else "config_reset"
        command = commands.get(name)
        if command is None or not self._mcu.is_link_active():
            raise McuError("Unable to issue a restart command to mcu '%s': %s" % (
                self._mcu.get_name(), "the link is down" if command is not None
                else "its firmware has neither reset nor config_reset"))
        if name == "config_reset":
            # works only while shut down
            self._mcu.send_emergency_stop()
            self._pause(SETTLE_TIME)
        is_done = self._send_and_follow(command)
        self._pause(SETTLE_TIME)
        self._mcu.close_link()
        if not is_done:
            raise McuError("Mcu '%s' did not confirm its restart"
                           % (self._mcu.get_name(),))

    def _send_and_follow(self, command):
        """Send a reset and wait for a sign of it.  Returns False if there was none.

        Firmware acknowledges before its reset, or says that it starts.  A chip whose
        port vanishes may do neither, and a link may be dead: the next start will see.
        """
        starts = []
        self._mcu.get_serial().register_response(starts.append, "starting")
        answer = command.send_notify()
        limit = self._reactor.monotonic() + ANSWER_LIMIT
        while not (starts or answer.test()) and self._reactor.monotonic() < limit:
            self._pause(SETTLE_TIME)
        return bool(starts) or answer.test() and answer.wait() is not None

    def _run_power(self):
        """Switch a simulated mcu off and on."""
        self._mcu.close_link()
        self._connection.get_machine().open_link(self._mcu.get_name()).reset()

    def _run_arduino(self):
        """Pulse DTR, which resets an Arduino."""
        self._mcu.close_link()
        port = self._open_port(RESET_BAUD)
        port.read(1)
        self._pause(0.100)
        port.dtr = True
        self._pause(0.100)
        port.dtr = False
        self._pause(0.100)
        port.close()

    def _run_cheetah(self):
        """Pulse DTR with RTS low, which resets a Fysetc Cheetah."""
        self._mcu.close_link()
        port = self._open_port(RESET_BAUD)
        port.rts = False
        port.dtr = True
        self._pause(0.100)
        port.dtr = False
        self._pause(0.100)
        port.close()

    def _run_rpi_usb(self):
        """Switch the power of a Raspberry Pi's USB ports off and on."""
        import glob
        self._mcu.close_link()
        for value in (b"0", b"1"):
            for path in glob.glob(USB_POWER):
                fd = os.open(path, os.O_WRONLY)
                os.write(fd, value)
                os.close(fd)
            self._pause(REBOOT_TIME)

    def _open_port(self, baud):
        import serial
        try:
            port = serial.Serial(baudrate=baud, timeout=0, exclusive=True)
            port.port = self._connection.path
            port.open()
        except (OSError, serial.SerialException) as err:
            raise McuError("Unable to restart mcu '%s' by its port '%s': %s"
                           % (self._mcu.get_name(), self._connection.path, err))
        return port

    def _pause(self, seconds):
        self._reactor.pause(self._reactor.monotonic() + seconds)
