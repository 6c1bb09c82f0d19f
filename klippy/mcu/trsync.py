# SPDX-License-Identifier: GPL-3.0-or-later
"""A trigger on one mcu that stops steppers, and that expires without a host."""

from klippy.mcu import absence

STATE_FORMAT = "trsync_state oid=%c can_trigger=%c trigger_reason=%c clock=%u"
REPORTS_PER_TIMEOUT = 0.3


class MCU_trsync:
    """Trigger synchronisation of one mcu.

    While armed, the mcu reports its clock every 0.3 timeouts; it triggers by
    itself if nobody moves its timeout on.  TriggerDispatch does that.
    """

    REASON_ENDSTOP_HIT = 1
    REASON_HOST_REQUEST = 2
    REASON_PAST_END_TIME = 3
    REASON_COMMS_TIMEOUT = 4

    def __init__(self, mcu, trdispatch=None):
        absence.check_present(mcu, "endstops or probes")
        self._mcu = mcu
        self._trdispatch = trdispatch
        self._reactor = mcu.get_printer().get_reactor()
        self._steppers = []
        self._oid = mcu.create_oid()
        self._cmd_queue = mcu.alloc_command_queue()
        self._start_cmd = self._timeout_cmd = self._trigger_cmd = None
        self._query_cmd = self._stop_cmd = None
        self._member = None
        self._completion = None
        self._home_end_clock = None
        mcu.register_config_callback(self._build_config)
        mcu.get_printer().register_event_handler(
            "klippy:shutdown", self._handle_shutdown)

    def get_mcu(self):
        """The MCU this trigger is on."""
        return self._mcu

    def get_oid(self):
        """Object number on the mcu."""
        return self._oid

    def get_command_queue(self):
        """The command queue that keeps the trigger's commands in order."""
        return self._cmd_queue

    def add_stepper(self, stepper):
        """Stop this stepper (of the same mcu) on the trigger."""
        if stepper not in self._steppers:
            self._steppers.append(stepper)

    def get_steppers(self):
        """The steppers that stop on the trigger."""
        return list(self._steppers)

    def start(self, print_time, report_offset, completion, expire_timeout):
        """Arm from print_time on.

        report_offset: 0..1, phase of the reports among several mcus.
        completion gets the reason when the trigger has fired.
        expire_timeout: s without host contact after which it fires by itself.
        """
        mcu = self._mcu
        self._completion = completion
        self._home_end_clock = None
        clock = mcu.print_time_to_clock(print_time)
        expire_ticks = mcu.seconds_to_clock(expire_timeout)
        report_ticks = mcu.seconds_to_clock(expire_timeout * REPORTS_PER_TIMEOUT)
        if self._member is not None:
            self._member.setup(clock, expire_ticks, min_extend_ticks=report_ticks)
        mcu.register_serial_response(self._handle_state, STATE_FORMAT, self._oid)
        first_report = clock + int(report_ticks * report_offset + 0.5)
        self._start_cmd.send(
            [self._oid, first_report, report_ticks, self.REASON_COMMS_TIMEOUT],
            reqclock=clock)
        for stepper in self._steppers:
            self._stop_cmd.send([stepper.get_oid(), self._oid])
        self._timeout_cmd.send([self._oid, clock + expire_ticks], reqclock=clock)

    def set_home_end_time(self, home_end_time):
        """Fire when this print_time is past without a trigger."""
        self._home_end_clock = self._mcu.print_time_to_clock(home_end_time)

    def trigger(self, reason):
        """Fire now."""
        self._trigger_cmd.send([self._oid, reason])

    def stop(self):
        """Disarm; returns the reason it has fired for."""
        self._mcu.register_serial_response(None, STATE_FORMAT, self._oid)
        self._completion = None
        if self._mcu.is_fileoutput():
            return self.REASON_ENDSTOP_HIT
        params = self._query_cmd.send([self._oid, self.REASON_HOST_REQUEST])
        return params["trigger_reason"]

    def _build_config(self):
        mcu = self._mcu
        queue = self._cmd_queue
        mcu.add_config_cmd("config_trsync oid=%d" % (self._oid,))
        mcu.add_config_cmd("trsync_start oid=%d report_clock=0 report_ticks=0"
                           " expire_reason=0" % (self._oid,), on_restart=True)
        self._start_cmd = mcu.lookup_command(
            "trsync_start oid=%c report_clock=%u report_ticks=%u expire_reason=%c",
            cq=queue)
        self._timeout_cmd = mcu.lookup_command(
            "trsync_set_timeout oid=%c clock=%u", cq=queue)
        self._trigger_cmd = mcu.lookup_command(
            "trsync_trigger oid=%c reason=%c", cq=queue)
        self._query_cmd = mcu.lookup_query_command(
            "trsync_trigger oid=%c reason=%c", STATE_FORMAT, oid=self._oid, cq=queue)
        self._stop_cmd = mcu.lookup_command(
            "stepper_stop_on_trigger oid=%c trsync_oid=%c", cq=queue)
        if self._trdispatch is not None and not mcu.is_fileoutput():
            self._member = self._join_dispatch()

    def _join_dispatch(self):
        state = self._mcu.lookup_response_tag(STATE_FORMAT)
        return self._trdispatch.add(
            self._mcu.get_serial().get_serialqueue(), self._cmd_queue, self._oid,
            self._timeout_cmd.get_command_tag(),
            self._trigger_cmd.get_command_tag(), state)

    def _handle_state(self, params):
        if not params["can_trigger"]:
            self._finish(params["trigger_reason"])
            return
        end_clock = self._home_end_clock
        if end_clock is None:
            return
        clock = self._mcu.clock32_to_clock64(params["clock"])
        if clock >= end_clock:
            self._home_end_clock = None
            self.trigger(self.REASON_PAST_END_TIME)

    def _handle_shutdown(self):
        self._finish(self.REASON_COMMS_TIMEOUT)

    def _finish(self, reason):
        completion, self._completion = self._completion, None
        if completion is not None:
            self._reactor.async_complete(completion, reason)
