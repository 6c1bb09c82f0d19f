# SPDX-License-Identifier: GPL-3.0-or-later
"""One trigger that stops steppers on several mcus together."""

import sys

from klippy import dangers
from klippy.errors import ConfigError
from klippy.mcu.trsync import MCU_trsync
from klippy_ext.trdispatch import TrDispatch

# A trigger is reported at the latest so long (s) after the end of the move
REPORT_GRACE = 2.


def current_timeout(printer, n_mcus):
    """Expiry time in s for a trigger on n_mcus.

    That of the config, else what the package now has.
    """
    package, options = sys.modules["klippy.mcu"], dangers.get(printer)
    if n_mcus == 1:
        return options.single_mcu_trsync_timeout or package.TRSYNC_SINGLE_MCU_TIMEOUT
    return options.multi_mcu_trsync_timeout or package.TRSYNC_TIMEOUT


class TriggerDispatch:
    """A trigger on the sensor's mcu and its copies on the steppers' mcus."""

    def __init__(self, mcu):
        self._mcu = mcu
        self._reactor = mcu.get_printer().get_reactor()
        self._trdispatch = TrDispatch(self._reactor.clock)
        self._trsyncs = [MCU_trsync(mcu, self._trdispatch)]
        self._completion = None
        self._is_started = False

    def get_oid(self):
        """Object number of the trigger on the sensor's mcu."""
        return self._trsyncs[0].get_oid()

    def get_command_queue(self):
        """Command queue of the trigger on the sensor's mcu."""
        return self._trsyncs[0].get_command_queue()

    def get_steppers(self):
        """All steppers that stop on the trigger."""
        return [s for trsync in self._trsyncs for s in trsync.get_steppers()]

    def add_stepper(self, stepper):
        """Stop this stepper of any mcu on the trigger."""
        mcu = stepper.get_mcu()
        for trsync in self._trsyncs:
            if trsync.get_mcu() is mcu:
                break
        else:
            trsync = MCU_trsync(mcu, self._trdispatch)
            self._trsyncs.append(trsync)
        trsync.add_stepper(stepper)
        self._check_shared_axis(stepper)

    def _check_shared_axis(self, stepper):
        """Motors of one axis on two mcus would stop apart from each other."""
        axis = stepper.get_name()[:len("stepper_x")]
        if not axis.startswith("stepper_"):
            return
        for other in self.get_steppers():
            if (other.get_mcu() is not stepper.get_mcu()
                    and other.get_name().startswith(axis)):
                raise ConfigError(
                    "Steppers '%s' and '%s' home together but are on different"
                    " mcus ('%s' and '%s'): put both motors of an axis on one mcu"
                    % (other.get_name(), stepper.get_name(),
                       other.get_mcu().get_name(), stepper.get_mcu().get_name()))

    def start(self, print_time):
        """Arm all triggers at print_time; returns a completion."""
        self._completion = self._reactor.completion()
        if self._mcu.is_fileoutput():
            self._completion.complete(True)
        count = len(self._trsyncs)
        timeout = current_timeout(self._mcu.get_printer(), count)
        for i, trsync in enumerate(self._trsyncs):
            trsync.start(print_time, float(i) / count, self._completion, timeout)
        self._trdispatch.start(MCU_trsync.REASON_HOST_REQUEST)
        self._is_started = True
        return self._completion

    def wait_end(self, end_time):
        """Wait for a trigger, or for the end_time (print_time) of the move.

        The mcu tells of a trigger once, and a bad link may lose that; stop() asks.
        """
        self._trsyncs[0].set_home_end_time(end_time)
        if self._mcu.is_fileoutput():
            self._completion.complete(True)
        eventtime = self._reactor.monotonic()
        rest = end_time - self._mcu.estimated_print_time(eventtime)
        self._completion.wait(eventtime + max(rest, 0.) + REPORT_GRACE)

    def stop(self):
        """Disarm; returns the reason that matters most (see MCU_trsync)."""
        if self._is_started:
            self._trdispatch.stop()
            self._is_started = False
        reasons = [trsync.stop() for trsync in self._trsyncs]
        for reason in reasons:
            if reason >= MCU_trsync.REASON_COMMS_TIMEOUT:
                return reason
        return reasons[0]
