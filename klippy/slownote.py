# SPDX-License-Identifier: GPL-3.0-or-later
"""What kept the main thread busy for so long that others had to wait."""

# Less than this (s) without a break is not worth a note
SLOW_TIME = 0.2
# What is around the culprit takes a little longer: keep the inner one
INNER_SHARE = 1.25


class SlowNote:
    """The longest stretch without a break since the last take()."""

    def __init__(self):
        self.seconds, self.what = 0., ""

    def note(self, seconds, what):
        """`what` (a callback, or words) was busy for so many s."""
        if seconds > self.seconds * INNER_SHARE:
            self.seconds, self.what = seconds, describe(what)

    def take(self):
        """(s, words) of the longest stretch, (0., "") without any; forget it."""
        result = self.seconds, self.what
        self.seconds, self.what = 0., ""
        return result


def describe(what):
    """Words for a callback."""
    if isinstance(what, str):
        return what
    name = getattr(what, "__qualname__", None)
    if name is None:
        return repr(what)
    return "%s.%s" % (getattr(what, "__module__", None) or "", name)
