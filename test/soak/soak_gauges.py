# SPDX-License-Identifier: GPL-3.0-or-later
"""What a process holds: memory, descriptors, threads, objects."""
import gc
import os
import statistics
import threading
import weakref

import greenlet

from klippy.cli import run
from klippy.reactor import Reactor

PAGE_KB = os.sysconf("SC_PAGE_SIZE") // 1024
# Kinds of objects that are counted when no printer is there
COUNTED = {"greenlets": greenlet.greenlet, "reactors": Reactor}


def read_rss_kb():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * PAGE_KB


def count_descriptors():
    return len(os.listdir("/proc/self/fd"))


class Gauges:
    """Readings of the process, by number of the job or boot."""

    def __init__(self):
        self.printers = weakref.WeakSet()
        self.at_jobs = []           # (job, virtual s, RSS in KB, fds, threads)
        self.at_boots = []          # {what: count}, with no printer there
        self._watch_printers()

    def _watch_printers(self):
        make = run.Printer

        def make_watched(*args):
            printer = make(*args)
            self.printers.add(printer)
            return printer

        run.Printer = make_watched

    def note_job(self, number, now):
        """A printer is ready and does nothing."""
        self.at_jobs.append((number, now, read_rss_kb(), count_descriptors(),
                             threading.active_count()))

    def note_boot(self):
        """Between two printers."""
        gc.unfreeze()
        gc.collect()
        objects = gc.get_objects()
        counts = {name: sum(isinstance(o, kind) for o in objects)
                  for name, kind in COUNTED.items()}
        counts["printers"] = len(self.printers)
        counts["objects"] = len(objects)
        counts["descriptors"] = count_descriptors()
        counts["threads"] = threading.active_count()
        self.at_boots.append(counts)

    # Judgement

    def list_rss_quarters(self):
        """MB: median of each quarter of the jobs."""
        values = [reading[2] / 1024. for reading in self.at_jobs]
        size = max(len(values) // 4, 1)
        return [statistics.median(values[i * size:(i + 1) * size] or values)
                for i in range(4)]

    def find_growth(self, mb_allowed):
        """[text] of all that grew; empty if nothing did."""
        faults = []
        quarters = self.list_rss_quarters()
        if quarters[3] - quarters[1] > mb_allowed:
            faults.append("memory grows: %s MB in the quarters"
                          % ", ".join("%.1f" % value for value in quarters))
        for index, name in ((3, "descriptors"), (4, "threads")):
            values = [reading[index] for reading in self.at_jobs]
            if values and max(values[len(values) // 2:]) > max(
                    values[:len(values) // 2 + 1]):
                faults.append("%s grow: %d at first, %d later" % (
                    name, max(values[:len(values) // 2 + 1]), max(values)))
        return faults + self._compare_boots()

    def _compare_boots(self):
        # the first boots fill caches
        boots = self.at_boots[2:]
        if len(boots) < 2:
            return []
        faults = []
        half = len(boots) // 2
        for name in boots[0]:
            first = max(boot[name] for boot in boots[:half])
            last = min(boot[name] for boot in boots[half:])
            allowed = 200 if name == "objects" else 0
            if last > first + allowed:
                faults.append("between printers there are more %s: %d at first,"
                              " %d later" % (name, first, last))
        return faults
