# SPDX-License-Identifier: GPL-3.0-or-later
"""The clocks of the mcus: estimates from samples, conversions, agreement.

print_time is s on the main mcu's clock at its nominal frequency, less those for
which it was held.  A secondary mcu steers its conversion from the main mcu's
seconds so that it meets them.  The more a link jitters the more often the mcu is
asked for its clock, which costs up to 4 % of a line of 250 kbaud.
Handlers run in the response thread: an estimate is replaced as a whole.
"""

import logging

from klippy.clockfit import ClockFit

# A question is counted as pending, a secondary clock steered, so often (s)
COUNT_INTERVAL = 0.9839
START_SAMPLES = 8
START_INTERVAL = 0.050
MAX_PENDING = 4
SYNC_TIME = 4.
MIN_CATCH_UP = 2.
# So long (s) behind the motion that steered last no step is left on its line
IDLE_TIME = 5.
MASK32 = 0xffffffff


class ClockSync:
    """Clock of the main mcu."""

    def __init__(self, reactor):
        self.reactor = reactor
        self.serial = None
        self.mcu_freq = 1.
        self.last_clock = 0
        self.fit = None
        # (time in s, clock in ticks, ticks a s): the line now in use
        self.clock_est = (0., 0., 1.)
        # s for which print_time stood still
        self.hold = 0.
        self.pending_count = 0
        self._query_cmd = b""
        self._queue = None
        self._sample_timer = None
        self._count_time = 0.
        self._lost_callback = None
        self._is_file = False

    def set_lost_callback(self, callback):
        """Call callback() when the mcu answers no longer."""
        self._lost_callback = callback

    # Connecting

    def connect(self, serial):
        """Take first samples of the identified mcu, then keep sampling."""
        self.serial = serial
        self.pending_count = 0
        self.mcu_freq = serial.msgparser.get_constant_float("CLOCK_FREQ")
        params = serial.send_with_response("get_uptime", "uptime")
        self.last_clock = (params["high"] << 32) | params["clock"]
        time = params["#sent_time"] or params["#receive_time"]
        self.fit = ClockFit(self.mcu_freq, time, self.last_clock)
        self.clock_est = (time, float(self.last_clock), self.mcu_freq)
        self._query_cmd = serial.msgparser.create_command("get_clock")
        self._queue = serial.alloc_command_queue()
        for _ in range(START_SAMPLES):
            self.reactor.pause(self.reactor.monotonic() + START_INTERVAL)
            self._note_clock(serial.send_with_response("get_clock", "clock"))
        serial.register_response(self._handle_clock, "clock")
        self._sample_timer = self.reactor.register_timer(
            self._take_sample, self.reactor.NOW)

    def connect_file(self, serial, pace=False):
        """Let the clock follow the reactor's time exactly."""
        self.serial = serial
        self._is_file = True
        self.mcu_freq = serial.msgparser.get_constant_float("CLOCK_FREQ")
        self.clock_est = (self.reactor.monotonic(), 0., self.mcu_freq)
        serial.set_clock_est(self.mcu_freq, self.clock_est[0], 0, 0)

    def disconnect(self):
        """Stop sampling."""
        if self._sample_timer is not None:
            self.reactor.unregister_timer(self._sample_timer)
            self._sample_timer = None

    # Samples

    def _take_sample(self, eventtime):
        if eventtime >= self._count_time:
            self._count_time = eventtime + COUNT_INTERVAL
            self._count_sample(eventtime)
        self.serial.raw_send(self._query_cmd, 0, 0, self._queue)
        return min(eventtime + self.fit.get_interval(), self._count_time)

    def _count_sample(self, eventtime):
        """What is to be done about once a second."""
        if self.pending_count >= MAX_PENDING and self._lost_callback is not None:
            self._lost_callback()
        self.pending_count += 1

    def _handle_clock(self, params):
        self.pending_count = 0
        self._note_clock(params)

    def _note_clock(self, params):
        """Take in a clock sample and pass the new line on."""
        self.last_clock = clock = self.clock32_to_clock64(params["clock"])
        sent_time = params["#sent_time"]
        if not sent_time:
            return
        time = params["#receive_time"]
        self.fit.add(sent_time, time, float(clock))
        now_clock, freq = self.fit.line_at(time)
        self.clock_est = (time, now_clock, freq)
        self.serial.set_clock_est(freq, time, int(now_clock), clock)

    # Conversions

    def print_time_to_clock(self, print_time):
        """Clock (int ticks) of a print_time (s)."""
        return int((print_time + self.hold) * self.mcu_freq)

    def clock_to_print_time(self, clock):
        """print_time (s) of a clock."""
        return clock / self.mcu_freq - self.hold

    def get_hold(self):
        """s for which print_time stood still so far."""
        return self.hold

    def add_hold(self, duration):
        """Have print_time stand still for so many s, for all mcus."""
        self.hold += duration

    def get_clock(self, eventtime):
        """Estimated clock (int ticks) at an eventtime."""
        time, clock, freq = self.clock_est
        return int(clock + (eventtime - time) * freq)

    def estimate_clock_systime(self, clock):
        """Estimated eventtime at which the mcu reaches a clock."""
        time, conv_clock, freq = self.clock_est
        return time + (clock - conv_clock) / freq

    def estimated_print_time(self, eventtime):
        """Estimated print_time at an eventtime."""
        return self.clock_to_print_time(self.get_clock(eventtime))

    def clock32_to_clock64(self, clock32):
        """The 64 bit clock within 2^31 ticks of the newest known clock."""
        last = self.last_clock
        diff = (clock32 - last) & MASK32
        return last + diff - ((diff & 0x80000000) << 1)

    def is_active(self):
        """False if the mcu has not answered for about 4 s."""
        return self._is_file or self.pending_count <= MAX_PENDING

    def calibrate_clock(self, print_time, eventtime):
        """(offset in s, ticks a s) with clock = (print_time - offset) * freq."""
        return -self.hold, self.mcu_freq

    # Reports

    def stats(self, eventtime):
        """Figures of the clock: {name: number}."""
        return {"freq": round(self.clock_est[2])}

    def dump_debug(self):
        """The state of the estimate as a line of text."""
        time, clock, freq = self.clock_est
        text = ("clock: mcu_freq=%.0f last_clock=%d clock_est=(%.3f %.0f %.3f)"
                " pending=%d" % (self.mcu_freq, self.last_clock, time, clock, freq,
                                 self.pending_count))
        if self.fit is not None:
            fit = self.fit
            text += (" min_rtt=%.6f error=%.9f jitter_to=%.6f jitter_from=%.6f"
                     " samples=%d drift_ppm_a_minute=%.3f" % (
                         fit.min_rtt, fit.error ** .5, fit.jitter_to, fit.jitter_from,
                         fit.bounds.count, fit.drift * 60e6))
        return text


class SecondarySync(ClockSync):
    """Clock of another mcu, which follows the main one's print_time."""

    def __init__(self, reactor, main_sync):
        super().__init__(reactor)
        self._main_sync = main_sync
        # (offset in s, ticks a s) of the conversion from the main mcu's seconds
        self.clock_adj = (0., 1.)
        self.last_sync_time = 0.
        # From when on motion has steered last, s of the main mcu
        self.motion_time = 0.
        # The mcu is away: times are those of the main one
        self.is_absent = False

    def connect(self, serial):
        """As ClockSync.connect(), and start in step with the main mcu."""
        super().connect(serial)
        self._align(self.reactor.monotonic())

    def connect_file(self, serial, pace=False):
        """As ClockSync.connect_file()."""
        super().connect_file(serial, pace)
        self.clock_adj = (0., self.mcu_freq)

    def _align(self, eventtime):
        """Set the conversion without regard to what was sent before."""
        main = self._main_sync
        freq = self.clock_est[2] * main.mcu_freq / main.clock_est[2]
        time, clock, main_freq = main.clock_est
        print_time = (clock + (eventtime - time) * main_freq) / main.mcu_freq
        self.clock_adj = (print_time - self.get_clock(eventtime) / freq, freq)

    def print_time_to_clock(self, print_time):
        """Clock (int ticks) of a print_time (s)."""
        offset, freq = self.clock_adj
        return int((print_time + self._main_sync.hold - offset) * freq)

    def estimated_print_time(self, eventtime):
        """Estimated print_time at an eventtime."""
        if self.is_absent:
            return self._main_sync.estimated_print_time(eventtime)
        return super().estimated_print_time(eventtime)

    def clock_to_print_time(self, clock):
        """print_time (s) of a clock."""
        offset, freq = self.clock_adj
        return clock / freq + offset - self._main_sync.hold

    def get_hold(self):
        """s for which print_time stood still so far."""
        return self._main_sync.get_hold()

    def add_hold(self, duration):
        """Have print_time stand still for so many s, for all mcus."""
        self._main_sync.add_hold(duration)

    def calibrate_clock(self, print_time, eventtime):
        """Steer the conversion from print_time on, without a jump there.

        It meets the main mcu's clock SYNC_TIME ahead.
        Returns (offset in s, ticks a s).
        """
        if self._is_file:
            return self.clock_adj
        main = self._main_sync
        self.motion_time = print_time + main.hold
        self._steer(self.motion_time, eventtime)
        offset, freq = self.clock_adj
        return offset - main.hold, freq

    def _count_sample(self, eventtime):
        # Without motion nobody else steers
        main = self._main_sync
        now = main.get_clock(eventtime) / main.mcu_freq
        if now > self.motion_time + IDLE_TIME:
            self._steer(now, eventtime)
        super()._count_sample(eventtime)

    def _steer(self, start_time, eventtime):
        """calibrate_clock() from a second of the main mcu on."""
        main = self._main_sync
        meet_time = max(eventtime + SYNC_TIME, main.estimate_clock_systime(
            (start_time + MIN_CATCH_UP) * main.mcu_freq))
        main_time, main_clock, main_freq = main.clock_est
        meet_main_time = ((main_clock + (meet_time - main_time) * main_freq)
                          / main.mcu_freq)
        time, clock, freq = self.clock_est
        meet_clock = clock + (meet_time - time) * freq
        offset, old_freq = self.clock_adj
        start_clock = (start_time - offset) * old_freq
        new_freq = (meet_clock - start_clock) / (meet_main_time - start_time)
        if not 0.5 < new_freq / self.mcu_freq < 2.:
            logging.warning("clock of a secondary mcu jumped: realigned")
            self._align(eventtime)
            return
        self.clock_adj = (start_time - start_clock / new_freq, new_freq)
        self.last_sync_time = meet_main_time

    def stats(self, eventtime):
        """Figures of the clock: {name: number}."""
        return dict(super().stats(eventtime), adj=round(self.clock_adj[1]))

    def dump_debug(self):
        """The state of the estimate as a line of text."""
        return "%s clock_adj=(%.6f %.3f)" % ((super().dump_debug(),) + self.clock_adj)
