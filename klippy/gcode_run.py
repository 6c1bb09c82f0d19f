# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that run, and those that end or hold them from outside.

Whoever holds or awaits the G-code mutex has a Run.  A command registered with
Interrupts acts on the runs when it arrives, before it gets the mutex itself.  A
run notices between the lines of a script and within a Wait.  Main thread only.
"""

import contextlib
import re

import greenlet

from klippy.errors import CommandInterrupted

__all__ = ["Interrupts", "Run", "Wait"]

_COMMAND = re.compile(r"\s*(?:[Nn]\d+\s*)?([A-Za-z_]+\d*(?![.0-9])\w*)")
MAX_LABEL = 200                 # characters looked at


def find_label(script):
    """Name of the only command of a script, in upper case, else ""."""
    script = script.strip()
    if "\n" in script:
        return ""
    match = _COMMAND.match(script[:MAX_LABEL])
    return match.group(1).upper() if match else ""


class Run:
    """Commands that hold the G-code mutex, or wait for it.

    label: the command, if it is one from outside.  owner: may define
    give_way(run), called where the run was asked to let others come first.
    """

    def __init__(self, label="", owner=None):
        self.label, self.owner = label, owner
        self.greenlet = greenlet.getcurrent()
        self.is_holding = False
        self.asked = False              # check() has something to do
        self.must_give_way = False
        self.interruption = None        # CommandInterrupted to raise
        self.is_impatient = False       # waits raise it, too, lines do not
        self.waits = []

    def is_own(self):
        """True in the greenlet that runs the commands."""
        return self.greenlet is greenlet.getcurrent()

    def interrupt(self, reason):
        """End the run at its next line or wait.

        One that has not begun will run, but wait for nothing.
        """
        self.interruption = CommandInterrupted(reason)
        self.asked, self.is_impatient = self.is_holding, True
        self._wake()

    def ask_way(self):
        """Have the run let others come first, at its next line or wait."""
        if self.is_holding and hasattr(self.owner, "give_way"):
            self.asked = self.must_give_way = True
            self._wake()

    def _wake(self):
        for wait in self.waits:
            wait.wake()

    def check(self):
        """A place where the run can end or give way.

        Raises CommandInterrupted.  May wait.
        """
        if self.interruption is not None:
            raise self.interruption
        if self.must_give_way:
            self.asked = self.must_give_way = False
            self.owner.give_way(self)

    def check_wait(self):
        """As check(), within a wait."""
        if self.is_impatient:
            raise self.interruption
        self.check()


class Wait:
    """A wait inside a command that can be ended from outside."""

    def __init__(self, reactor, run):
        self.reactor, self.run = reactor, run
        self.is_ended = False
        self.completion = reactor.completion()

    def end(self):
        """End the wait; the commands go on as if it had been fulfilled."""
        self.is_ended = True
        self.wake()

    def wake(self):
        """Have pause() return early."""
        self.completion.complete(True)

    def pause(self, waketime):
        """Wait until waketime (s, eventtime) or an interruption; returns the
        eventtime.  Raises CommandInterrupted."""
        if self.run is not None:
            self.run.check_wait()
        if not self.is_ended:
            self.completion.wait(waketime)
            self.completion = self.reactor.completion()
        if self.run is not None:
            self.run.check_wait()
        return self.reactor.monotonic()


class Interrupts:
    """What commands do at once when they arrive while others run."""

    def __init__(self, reactor, mutex):
        self.reactor, self.mutex = reactor, mutex
        self.actions = {}
        self.waits = []

    def register(self, cmd, action):
        """Have action() called when cmd arrives from outside, at once.

        The command itself runs in its turn as ever.
        """
        self.actions[cmd] = action

    def note_arrival(self, script):
        """Somebody outside wants a script to run, and will wait for the mutex."""
        if self.actions and (self.mutex.test() or self.waits):
            action = self.actions.get(find_label(script))
            if action is not None:
                action()

    def get_runs(self):
        """The runs there are, the one that holds the mutex first."""
        return list(self.mutex.runs)

    def interrupt_others(self, label):
        """End what runs, for the command label, which may run more than once."""
        for run in self.get_runs():
            if run.label != label:
                run.interrupt("Interrupted by %s" % (label,))

    def end_waits(self):
        """End all waits of commands; returns their number."""
        for wait in list(self.waits):
            wait.end()
        return len(self.waits)

    @contextlib.contextmanager
    def waiting(self):
        """The Wait of the command that runs in this greenlet."""
        run = self.mutex.find_own_run()
        wait = Wait(self.reactor, run)
        places = [self.waits] if run is None else [self.waits, run.waits]
        for place in places:
            place.append(wait)
        try:
            yield wait
        finally:
            for place in places:
                place.remove(wait)
