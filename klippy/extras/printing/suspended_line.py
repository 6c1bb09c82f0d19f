# SPDX-License-Identifier: GPL-3.0-or-later
"""A line of a print that stands still within while other commands run."""

from klippy.errors import CommandInterrupted

UNWIND_TIME = 1.0               # s that the end of a line is waited for


class SuspendedLine:
    """Hands the G-code mutex to others, for as long as the print is paused."""

    def __init__(self, reactor, mutex, run):
        self.reactor, self.mutex, self.run = reactor, mutex, run
        self.is_ended = False
        self.go_on = reactor.completion()
        self.unwound = reactor.completion()

    def wait_while(self, is_paused):
        """Let others run, and wait while is_paused(); True if it was.

        The mutex is held again at the return.  Raises CommandInterrupted after
        end(), with or without the mutex (run.is_holding).
        """
        was_paused = False
        try:
            self.mutex.unlock()
            while True:
                self._check()
                self.mutex.lock_run(self.run)
                self._check()
                if not is_paused():
                    return was_paused
                was_paused = True
                self.mutex.unlock()
                self.go_on.wait()
                self.go_on = self.reactor.completion()
        finally:
            self.reactor.register_callback(
                lambda eventtime: self.unwound.complete(True))

    def _check(self):
        if self.is_ended:
            raise CommandInterrupted("The print was ended")

    def resume(self):
        """The print is not paused any more."""
        self.go_on.complete(True)

    def end(self):
        """End the line, and what it was part of, as soon as others wait."""
        self.is_ended = True
        self.run.interrupt("The print was ended")
        self.go_on.complete(True)

    def end_now(self):
        """As end(), and wait until it has ended."""
        self.end()
        self.unwound.wait(self.reactor.monotonic() + UNWIND_TIME)
