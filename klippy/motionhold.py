# SPDX-License-Identifier: GPL-3.0-or-later
"""What happens when the host was away for too long: motion stands, then goes on.

Steps that ought to be under way are not made yet.  print_time is held for as
long as that takes; from then on the plan is followed slowly at first, up to its
own pace.  Places are exact: only the time at which they are reached changes.
"""

import logging

# Motion that is less ahead of the mcu (s) is late
LATE_LEAD = 0.03
# When it goes on: so far ahead of the mcu (s)
RESUME_LEAD = 0.25
# How long it takes to be back at its own pace (s), in so many pieces
RAMP_TIME = 0.30
RAMP_PIECES = 24
# What kept the host busy is known so long (s) after it is back
TELL_DELAY = 0.1


class Ramp:
    """The conversion of times while motion gathers speed again.

    start, end: the part of the plan (print_time).  Over RAMP_TIME its pace grows
    evenly from 0 to 1, so it covers half as much of the plan.
    """

    def __init__(self, start, resume_time):
        """resume_time: when `start` happens, s on the main mcu's clock."""
        self.start, self.resume_time = start, resume_time
        self.end = start + 0.5 * RAMP_TIME
        self.piece = 0

    def calc_hold(self):
        """s between print_time and the main mcu's clock, once it is over."""
        return self.resume_time + RAMP_TIME - self.end

    def _piece_start(self, piece):
        """(time since the start, part of the plan done by then)."""
        time = RAMP_TIME * piece / RAMP_PIECES
        return time, 0.5 * time * time / RAMP_TIME

    def list_pieces(self, until):
        """[(offset in s, pace, end)] of the pieces up to print_time `until`.

        Second of the main mcu = (print_time - offset) / pace.  The last piece
        may go on in the next call.
        """
        pieces = []
        while self.piece < RAMP_PIECES:
            time, done = self._piece_start(self.piece)
            next_time, next_done = self._piece_start(self.piece + 1)
            if self.start + done >= until:
                break
            pace = (next_done - done) / (next_time - time)
            end = self.start + next_done
            pieces.append((self.start + done - (self.resume_time + time) * pace,
                           pace, min(end, until)))
            if end > until:
                break
            self.piece += 1
        return pieces

    def is_over(self):
        """True if all pieces were listed to their ends."""
        return self.piece >= RAMP_PIECES


class LateReport:
    """Tells once what kept the host from its work, and logs it each time."""

    def __init__(self, printer):
        self.printer = printer
        self.reactor = printer.get_reactor()
        self.told = set()
        self.text = None

    def note(self, text):
        """Motion has suffered: `text` says how.  The reason is known later."""
        if self.text is None:
            self.reactor.register_callback(
                self._tell, self.reactor.monotonic() + TELL_DELAY)
        self.text = text

    def _tell(self, eventtime):
        seconds, what = self.reactor.slow.take()
        if what:
            reason = "%s kept it busy for %.1f s" % (what, seconds)
        else:
            reason = "the system did not let it run"
        text, self.text = "The host was late and %s: %s" % (self.text, reason), None
        logging.warning("%s", text)
        if what not in self.told:
            self.told.add(what)
            self.printer.lookup_object("gcode").respond_info(text, log=False)
