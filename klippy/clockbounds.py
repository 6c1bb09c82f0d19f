# SPDX-License-Identifier: GPL-3.0-or-later
"""The window of clock samples, and of each stretch of it the quickest ones.

An mcu reads its clock after the question was sent and before the answer came:
clock - sent time is an upper and clock - receive time a lower bound of how far
the clock is ahead, too wide by the delay of that way.  Delays have a least
value, so the tightest bounds carry all that is known.
"""

# A stretch is at most these parts of the window, and of the time since its start
PART_OF_WINDOW, PART_OF_TIME = 1. / 48., 1. / 16.


class Stretch:
    """The tightest bounds of neighbouring samples; s, and s ahead."""

    def __init__(self, start, sent, upper, received, lower):
        self.start, self.count = start, 1
        self.sent, self.upper = sent, upper
        self.received, self.lower = received, lower

    def note(self, sent, upper, received, lower, freq):
        """Take in another sample."""
        self.count += 1
        if upper - self.upper < freq * (sent - self.sent):
            self.sent, self.upper = sent, upper
        if lower - self.lower > freq * (received - self.received):
            self.received, self.lower = received, lower


class ClockBounds:
    """Samples of the last `length` s, as stretches."""

    def __init__(self):
        self.stretches = []
        self.count = 0

    def add(self, sent, received, ahead, freq, length):
        """Take in a sample; old ones leave.

        sent, received: s.  ahead: s by which the clock, at its nominal frequency,
        is ahead of time 0.  freq: how fast it gains on time (s a s), about.
        """
        upper, lower = ahead - sent, ahead - received
        self.count += 1
        stretches = self.stretches
        last = stretches[-1] if stretches else None
        if last is None or sent - last.start > min(
                length * PART_OF_WINDOW, (sent - self.get_start()) * PART_OF_TIME):
            last = Stretch(sent, sent, upper, received, lower)
            stretches.append(last)
            self.forget(sent - length)
        else:
            last.note(sent, upper, received, lower, freq)

    def get_start(self):
        """Time of the oldest sample."""
        return self.stretches[0].start

    def forget(self, time):
        """Drop what is older than a time, but for the newest stretch."""
        stretches = self.stretches
        while len(stretches) > 1 and stretches[0].start < time:
            self.count -= stretches[0].count
            del stretches[0]
