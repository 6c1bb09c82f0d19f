# SPDX-License-Identifier: GPL-3.0-or-later
"""Timed requests to one slow output (fan, pin), in step with the motion.

A request waits until the motion queue is flushed up to its time.  Only
the newest of the requests that have become due is carried out, so a
burst of them never piles up in the mcu.
"""

# Two updates of one pin are at least this far apart.
PIN_MIN_TIME = 0.100


class GCodeRequestQueue:
    """Calls callback(print_time, value) for each request when it is due.

    The callback returns None when done, or (action, seconds): "discard"
    (nothing was sent), "delay" (sent; call again with the same value that
    much later), "repeat" (call again at once with the same value), or
    "reschedule" (not sent; call again at the given print_time).
    """

    def __init__(self, config, mcu, callback):
        self.printer = config.get_printer()
        self.mcu = mcu
        self.callback = callback
        self.requests = []
        self.next_min_time = 0.0
        self.motion = None
        self.toolhead = None
        self.printer.register_event_handler(
            "klippy:connect", self._handle_connect)
        self.printer.register_event_handler(
            "motion_queuing:hold", self._handle_hold)

    def _handle_connect(self):
        self.toolhead = self.printer.lookup_object("toolhead")
        self.motion = self.printer.lookup_object("motion_queuing")
        self.motion.register_flush_callback(self._flush)

    def _handle_hold(self, duration):
        self.next_min_time -= duration

    def get_mcu(self):
        return self.mcu

    def queue_gcode_request(self, value):
        """Request a value at the end of the moves planned so far."""
        self.toolhead.register_lookahead_callback(
            lambda print_time: self._append(print_time, value))

    def _append(self, print_time, value):
        self.requests.append((print_time, value))
        self.motion.note_mcu_movequeue_activity(print_time)

    def send_async_request(self, value, print_time=None):
        """Request a value as soon as possible, whatever moves do."""
        earliest = self._calc_earliest()
        print_time = max(print_time or 0.0, earliest, self.next_min_time)
        while True:
            wait = self._carry_out(print_time, value)
            if wait is None:
                return
            print_time = max(print_time, wait)

    def _calc_earliest(self):
        reactor = self.printer.get_reactor()
        now = self.mcu.estimated_print_time(reactor.monotonic())
        return now + self.mcu.min_schedule_time()

    def _flush(self, flush_time, step_gen_time):
        while self.requests:
            due = max(self.requests[0][0], self.next_min_time)
            if due > flush_time:
                self.motion.note_mcu_movequeue_activity(due)
                return
            while len(self.requests) > 1 and self.requests[1][0] <= due:
                self.requests.pop(0)
            wait = self._carry_out(due, self.requests[0][1])
            if wait is None:
                self.requests.pop(0)
            else:
                self.requests[0] = (wait, self.requests[0][1])

    def _carry_out(self, print_time, value):
        """Run the callback; returns the time to run it again, or None."""
        answer = self.callback(print_time, value)
        action, amount = answer if answer is not None else ("done", 0.0)
        if action == "discard":
            return None
        if action == "reschedule":
            return amount
        if action == "repeat":
            return print_time
        self.next_min_time = print_time + max(amount, PIN_MIN_TIME)
        return self.next_min_time if action == "delay" else None
