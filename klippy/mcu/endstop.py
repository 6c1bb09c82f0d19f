# SPDX-License-Identifier: GPL-3.0-or-later
"""A switch that stops steppers while homing."""

from klippy.errors import CommandError
from klippy.mcu.trigger_dispatch import TriggerDispatch
from klippy.mcu.trsync import MCU_trsync

HOME_FORMAT = (
    "endstop_home oid=%c clock=%u sample_ticks=%u sample_count=%c rest_ticks=%u"
    " pin_value=%c trsync_oid=%c trigger_reason=%c")
STATE_FORMAT = "endstop_state oid=%c homing=%c next_clock=%u pin_value=%c"


class MCU_endstop:
    """Polls one pin and fires a trigger when it has the wanted level."""

    def __init__(self, mcu, pin_params):
        self._mcu = mcu
        self._pin = pin_params["pin"]
        self._pullup = pin_params["pullup"]
        self._invert = pin_params["invert"]
        self._oid = mcu.create_oid()
        self._home_cmd = self._query_cmd = None
        self._rest_ticks = 0
        self._dispatch = TriggerDispatch(mcu)
        mcu.register_config_callback(self._build_config)

    def get_mcu(self):
        """The MCU of the switch."""
        return self._mcu

    def add_stepper(self, stepper):
        """Stop this stepper when the switch closes."""
        self._dispatch.add_stepper(stepper)

    def get_steppers(self):
        """The steppers that stop when the switch closes."""
        return self._dispatch.get_steppers()

    def home_start(self, print_time, sample_time, sample_count, rest_time,
                   triggered=True):
        """Watch the switch from print_time on; returns a completion.

        sample_count samples, sample_time s apart, must agree; polls are
        rest_time s apart.  triggered: the level to wait for.
        """
        mcu = self._mcu
        clock = mcu.print_time_to_clock(print_time)
        rest_clock = mcu.print_time_to_clock(print_time + rest_time)
        self._rest_ticks = rest_clock - clock
        completion = self._dispatch.start(print_time)
        self._home_cmd.send(
            [self._oid, clock, mcu.seconds_to_clock(sample_time), sample_count,
             self._rest_ticks, int(bool(triggered)) ^ self._invert,
             self._dispatch.get_oid(), MCU_trsync.REASON_ENDSTOP_HIT],
            reqclock=clock)
        return completion

    def home_wait(self, home_end_time):
        """Wait for the switch or the end of the move.

        Returns the print_time of the trigger, 0. if there was none.
        Raises CommandError if the mcus lost contact.
        """
        mcu = self._mcu
        self._dispatch.wait_end(home_end_time)
        self._home_cmd.send([self._oid, 0, 0, 0, 0, 0, 0, 0])
        reason = self._dispatch.stop()
        if reason >= MCU_trsync.REASON_COMMS_TIMEOUT:
            raise CommandError("Communication timeout during homing (pin '%s' of"
                               " mcu '%s')" % (self._pin, mcu.get_name()))
        if reason != MCU_trsync.REASON_ENDSTOP_HIT:
            return 0.
        if mcu.is_fileoutput():
            return home_end_time
        params = self._query_cmd.send([self._oid])
        next_clock = mcu.clock32_to_clock64(params["next_clock"])
        return mcu.clock_to_print_time(next_clock - self._rest_ticks)

    def query_endstop(self, print_time):
        """Whether the switch is closed, asked at print_time: 0 or 1."""
        if self._mcu.is_fileoutput():
            return 0
        clock = self._mcu.print_time_to_clock(print_time)
        params = self._query_cmd.send([self._oid], minclock=clock)
        return params["pin_value"] ^ self._invert

    def _build_config(self):
        mcu = self._mcu
        mcu.add_config_cmd("config_endstop oid=%d pin=%s pull_up=%d"
                           % (self._oid, self._pin, self._pullup))
        mcu.add_config_cmd(
            "endstop_home oid=%d clock=0 sample_ticks=0 sample_count=0 rest_ticks=0"
            " pin_value=0 trsync_oid=0 trigger_reason=0" % (self._oid,),
            on_restart=True)
        queue = self._dispatch.get_command_queue()
        self._home_cmd = mcu.lookup_command(HOME_FORMAT, cq=queue)
        self._query_cmd = mcu.lookup_query_command(
            "endstop_query_state oid=%c", STATE_FORMAT, oid=self._oid, cq=queue)
