# SPDX-License-Identifier: GPL-3.0-or-later
"""What may be absent: an mcu, or the part of its firmware that a section needs.

An mcu may be absent at the start, or go and come back while the printer runs.

Its loss is told, not a reason to shut down.  It is looked for at once and then
every reconnect_interval, and configured anew when it is there: that runs all
config callbacks again.  A firmware that reports a shutdown while connected still
shuts the printer down.
"""

import logging

from klippy import msgproto
from klippy.errors import CommandError, ConfigError, McuError
from klippy.mcu.part import LackError

RECONNECT_INTERVAL = 0.5
# Silence (s) that ends one try to reach it
IDENTIFY_TIMEOUT = 0.25
# So long (s) after a reset it is not looked for
REBOOT_TIME = 0.1
# An attempt that takes longer (s) has lost it
ATTEMPT_LIMIT = 10.


# What others ask, of an mcu or a Part of one; a chip of a plug-in may know nothing of
# absence


def may_be_absent(mcu):
    """True if the mcu may come and go."""
    return getattr(mcu, "is_non_critical", False)


def is_absent(mcu):
    """True while the mcu is gone, and for what its firmware lacks."""
    return getattr(mcu, "non_critical_disconnected", False)


def find_part(mcu):
    """The Part of an mcu for the section that is loaded, which asks for hardware there;
    the mcu itself if that knows nothing of parts."""
    get_part = getattr(mcu, "get_part", None)
    return mcu if get_part is None else get_part()


def make_part(mcu, what=None, may_lack=False):
    """As find_part(), for less than all that the section has (`what` says for what), or
    for something that serves more sections (see add_user)."""
    make = getattr(mcu, "make_part", None)
    return mcu if make is None else make(what, may_lack)


def add_user(part):
    """The section that is loaded uses a part that another made."""
    add = getattr(part, "add_user", None)
    if add is not None:
        add()


def find_mcu(sensor):
    """The mcu that reads a sensor's analog pin; None for another kind of sensor."""
    pin = getattr(sensor, "mcu_adc", None)
    return None if pin is None else pin.get_mcu()


def find_sensor_part(sensor):
    """As find_mcu(): the part of it that reads the pin."""
    pin = getattr(sensor, "mcu_adc", None)
    return None if pin is None else getattr(pin, "part", pin.get_mcu())


def raise_if_absent(mcu):
    """Raise CommandError while the mcu is gone, and for what its firmware lacks."""
    raise_if_lacking(mcu)
    if is_absent(mcu):
        raise CommandError("Mcu '%s' is not connected" % (mcu.get_name(),))


def raise_if_lacking(part):
    """Raise CommandError for what the firmware lacks, which will not come back."""
    lack = getattr(part, "lack", None)
    if lack is not None:
        raise CommandError(lack)


def check_present(mcu, what):
    """Raise ConfigError if the mcu may be absent: `what` may not be there."""
    if may_be_absent(mcu):
        raise ConfigError(
            "Mcu '%s' may not have %s: it is_non_critical, and can be gone at any time"
            % (mcu.get_name(), what))


def watch(mcu, note_gone, note_back):
    """Call note_gone() and note_back(), of which either may be None, as the mcu goes
    and comes; never if it may not."""
    if not may_be_absent(mcu):
        return
    register = mcu.get_printer().register_event_handler
    if note_gone is not None:
        register(mcu.get_non_critical_disconnect_event_name(), note_gone)
    if note_back is not None:
        register(mcu.get_non_critical_reconnect_event_name(), note_back)


class WrongFirmwareError(McuError):
    """The mcu came back with another dictionary than the printer started with."""


class Absence:
    """Notices that one mcu goes and comes."""

    def __init__(self, mcu, config):
        self._mcu = mcu
        self._printer = mcu.get_printer()
        self._reactor = self._printer.get_reactor()
        self._interval = config.getfloat(
            "reconnect_interval", RECONNECT_INTERVAL, minval=0.1)
        if mcu.get_name() == "mcu":
            raise ConfigError("Option 'is_non_critical' in section 'mcu': the main mcu"
                              " keeps the time of the printer, it cannot be absent")
        self._dictionary = None
        self._is_ended = False
        self._has_told = self._is_open = False
        self._attempt = 0
        self._printer.register_event_handler("klippy:ready", self._handle_ready)

    # At the start of the printer

    def start(self):
        """Try to connect, once."""
        serial = self._mcu.get_serial()
        serial.connect_timeout, serial.identify_timeout = 0., IDENTIFY_TIMEOUT
        self._mcu.set_absent(True)
        if self._try(self._identify):
            self._mcu.set_absent(False)

    def configure(self):
        """Configure it if it is there."""
        mcu = self._mcu
        if mcu.non_critical_disconnected:
            return
        mcu.set_absent(True)
        if self._try(mcu.configure):
            mcu.set_absent(False)

    def _handle_ready(self):
        if self._mcu.non_critical_disconnected:
            self._tell("is not connected")
            self._look(0.)

    # While it runs

    def note_gone(self, reason):
        """It answers no longer, or was reset."""
        mcu = self._mcu
        if self._is_ended or self._printer.is_shutdown():
            return
        if mcu.non_critical_disconnected:
            self._note_lost_again()
            return
        mcu.set_absent(True)
        mcu.close_link()
        self._tell("is gone: %s" % (reason,))
        self._printer.send_event(mcu.get_non_critical_disconnect_event_name())
        self._look(0.)

    def _note_lost_again(self):
        """It went while it was being connected: nothing will be answered.

        What it says of a start before its dictionary was read is history.
        """
        if self._is_open:
            self._is_open = False
            self._mcu.close_link()

    def note_open(self):
        """The link is there and the dictionary read."""
        self._is_open = True

    def restart(self, method, reason):
        """Reset it, by a McuRestart; raises McuError, as it is gone then."""
        name = self._mcu.get_name()
        if method.uses_usb_power:
            raise McuError("MCU '%s' must be switched off and on: %s" % (name, reason))
        logging.info("mcu '%s': restarted alone: %s", name, reason)
        method.run()
        self._reactor.pause(self._reactor.monotonic() + REBOOT_TIME)
        raise McuError("MCU '%s' was restarted: %s" % (name, reason))

    def end(self):
        """The printer ends: look for it no longer."""
        self._is_ended = True

    # Looking for it

    def _look(self, delay):
        self._reactor.register_callback(
            self._reconnect, self._reactor.monotonic() + delay)

    def _reconnect(self, eventtime):
        mcu = self._mcu
        if self._is_ended or self._printer.is_shutdown():
            return
        try:
            is_back = self._try(self._connect)
        except (ConfigError, WrongFirmwareError, LackError, msgproto.error) as err:
            self._give_up(err)
            return
        if not is_back:
            self._look(self._interval)
            return
        mcu.set_absent(False)
        self._has_told = False
        self._tell("is back")
        self._printer.send_event(mcu.get_non_critical_reconnect_event_name())

    def _connect(self):
        self._identify()
        self._mcu.configure()

    def _identify(self):
        mcu = self._mcu
        self._is_open = False
        try:
            mcu.identify()
        except msgproto.error as err:
            raise McuError(str(err))
        data = mcu.get_serial().dictionary_data
        if self._dictionary not in (None, data):
            raise WrongFirmwareError("its firmware is another one than before; RESTART"
                " the printer")
        self._dictionary = data

    def _try(self, step):
        """Do a step of connecting; False, and the link is closed, if the mcu fails.

        Raises ConfigError, msgproto.error, LackError or WrongFirmwareError if it never
        can work.
        """
        mcu = self._mcu
        self._attempt += 1
        attempt = self._attempt
        self._reactor.register_callback(
            lambda eventtime: self._check_attempt(attempt),
            self._reactor.monotonic() + ATTEMPT_LIMIT)
        try:
            step()
        except (WrongFirmwareError, LackError, msgproto.error):
            raise
        except McuError as err:
            logging.debug("mcu '%s': %s", mcu.get_name(), err)
        else:
            if not self._is_ended and self._is_open:
                return True
        finally:
            self._attempt += 1
        mcu.close_link()
        return False

    def _check_attempt(self, attempt):
        if attempt == self._attempt:
            self._note_lost_again()

    def _give_up(self, err):
        """It is there and does not fit: until a restart it is not looked for."""
        self._mcu.close_link()
        self._has_told = False
        self._tell("cannot be used: %s" % (err,))

    def _tell(self, text):
        """Say it to the user, once until it is back."""
        if self._has_told and text != "is back":
            return
        self._has_told = text != "is back"
        message = "Mcu '%s' %s" % (self._mcu.get_name(), text)
        logging.info("%s", message)
        self._printer.lookup_object("gcode").respond_info(message, log=False)
