# SPDX-License-Identifier: GPL-3.0-or-later
"""[garbage_collection]: Python's collector works between prints, not in them.

While something prints it does not run by itself; should many new objects pile up
nevertheless, only these are looked at, which takes milliseconds.  Everything is looked
at when the print is over.  Without this section the collector runs when it likes.
"""
import gc
import time

CHECK_PERIOD = 1.0          # s
# New objects that are worth a look in a print
MANY_OBJECTS = 20000


class GarbageCollection:
    """Turns the collector on and off; tells the log what it cost."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        printer.load_object(config, "idle_timeout")
        self.is_holding = False
        self.n_collections, self.longest = 0, 0.0
        self.timer = self.reactor.register_timer(self._check)
        register = printer.register_event_handler
        register("idle_timeout:printing", self._handle_printing)
        for event in ("ready", "idle"):
            register("idle_timeout:" + event, self._handle_rest)
        for event in ("shutdown", "disconnect"):
            register("klippy:" + event, self._release)

    def _handle_printing(self, print_time):
        self.is_holding = True
        gc.disable()
        self.reactor.update_timer(self.timer, self.reactor.NOW)

    def _handle_rest(self, print_time):
        if self.is_holding:
            self._release()
            self._collect(2)

    def _release(self):
        self.is_holding = False
        gc.enable()

    def _check(self, eventtime):
        if not self.is_holding:
            return self.reactor.NEVER
        if gc.get_count()[0] > MANY_OBJECTS:
            self._collect(0)
        return eventtime + CHECK_PERIOD

    def _collect(self, generation):
        start = time.perf_counter()
        gc.collect(generation)
        self.n_collections += 1
        self.longest = max(self.longest, time.perf_counter() - start)

    def stats(self, eventtime):
        """Collections so far and the longest, for the log."""
        text = "gc: collections=%d longest=%.4f" % (self.n_collections, self.longest)
        self.longest = 0.0
        return False, text


def load_config(config):
    return GarbageCollection(config)
