# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the daemon's log: starts of printers, their configs, statistics, shutdowns."""

import dataclasses
import pathlib
import re

CONFIG_START, CONFIG_END = "===== Config =====", "=================="
SHUTDOWN = re.compile(r"the printer shuts down at eventtime (?P<time>[\d.]+):"
                      r" (?P<cause>.*)")
STATS = re.compile(r"Stats (?P<time>[\d.]+): (?P<rest>.*)")
# Text before a pair ends with a colon where it names a group
PAIR = re.compile(r"(?:(?P<group>[^=]*?):\s+)?(?P<key>[\w.]+)=(?P<value>\S+)\s*")
# These belong to the host, wherever they stand in the line
HOST_KEYS = frozenset((
    "gcodein", "print_time", "buffer_time", "print_stall", "sysload", "cputime",
    "memavail", "sd_pos"))
HOST = ""


@dataclasses.dataclass
class Stats:
    """One line of statistics: {group: {key: value}}; group "" is the host."""

    eventtime: float
    groups: dict


@dataclasses.dataclass
class Shutdown:
    """A shutdown: when, why, and all the log has about it."""

    eventtime: float
    cause: str
    lines: list = dataclasses.field(default_factory=list)


@dataclasses.dataclass
class Start:
    """What the log has from one start of a printer to the next."""

    config: str = ""
    stats: list = dataclasses.field(default_factory=list)
    shutdowns: list = dataclasses.field(default_factory=list)

    def get_series(self, group, key):
        """(times, values) of a number in the statistics."""
        found = [(entry.eventtime, entry.groups[group][key]) for entry in self.stats
                 if key in entry.groups.get(group, ())]
        return [time for time, _ in found], [value for _, value in found]

    def list_groups(self, key):
        """Groups whose statistics have a key, in order of appearance."""
        return list(dict.fromkeys(group for entry in self.stats
                                  for group, values in entry.groups.items()
                                  if key in values))


def parse_stats(line):
    """The Stats of a line, None if it is no line of statistics."""
    match = STATS.match(line)
    if match is None:
        return None
    groups, current = {}, HOST
    for pair in PAIR.finditer(match["rest"]):
        if pair["group"] is not None:
            current = pair["group"].strip()
        try:
            value = float(pair["value"])
        except ValueError:
            continue
        group = HOST if pair["key"] in HOST_KEYS else current
        groups.setdefault(group, {})[pair["key"]] = value
    return Stats(float(match["time"]), groups)


class LogReader:
    """Takes the lines of a log, one after the other."""

    def __init__(self):
        self.starts = []
        self.config_lines = None        # inside a config

    def feed(self, line):
        """Take one line, without its newline."""
        if line == CONFIG_START:
            self.config_lines = []
        elif self.config_lines is not None:
            self._feed_config(line)
        else:
            self._feed_event(line)

    def _feed_config(self, line):
        if line != CONFIG_END:
            self.config_lines.append(line)
            return
        config, self.config_lines = "\n".join(self.config_lines), None
        # a rotated log repeats the config of the printer that runs
        last = self.starts[-1] if self.starts else None
        if last is None or last.config != config or last.shutdowns:
            self.starts.append(Start(config))

    def _feed_event(self, line):
        if not self.starts:
            self.starts.append(Start())
        start = self.starts[-1]
        stats = parse_stats(line)
        if stats is not None:
            if start.stats and stats.eventtime < start.stats[-1].eventtime:
                self.starts.append(start := Start(start.config))    # a new process
            start.stats.append(stats)
            return
        match = SHUTDOWN.match(line)
        if match is not None:
            start.shutdowns.append(Shutdown(float(match["time"]), match["cause"]))
        if start.shutdowns:
            start.shutdowns[-1].lines.append(line)


def read_logs(paths):
    """The Starts in log files, in their order.  Raises OSError."""
    reader = LogReader()
    for path in paths:
        text = pathlib.Path(path).read_text(encoding="utf-8", errors="replace")
        for line in text.splitlines():
            reader.feed(line)
    return [start for start in reader.starts
            if start.config or start.stats or start.shutdowns]
