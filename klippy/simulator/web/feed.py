# SPDX-License-Identifier: GPL-3.0-or-later
"""What the web page shows of a printer, collected on the printer's reactor.

Path and console grow; a page asks for what has come since the number it knows.
"""

import bisect
import collections
import os

MAX_PATH = 60000                # segments that are kept
MAX_CONSOLE = 500               # lines that are kept
MAX_HEAT = 1200                 # seconds of temperatures that are kept
COLLECT_PERIOD = 0.25           # s
HEAT_PERIOD = 1.
HISTORY_S = 25.                 # s of motion that the host still knows


class Log:
    """Numbered items, the oldest of which are dropped."""

    def __init__(self, size):
        self.items = collections.deque(maxlen=size)
        self.count = 0

    def append(self, item):
        self.items.append(item)
        self.count += 1

    def since(self, number, limit=4000):
        """(items from number on, number to ask for next)."""
        first = self.count - len(self.items)
        start = max(number, first) if number <= self.count else first
        found = list(self.items)[start - first:start - first + limit]
        return found, start + len(found)


class Feed:
    """State of one printer and its simulated machine."""

    def __init__(self):
        self.path, self.console = Log(MAX_PATH), Log(MAX_CONSOLE)
        self.heat = Log(MAX_HEAT)
        self.printer = self.reactor = self.motion = None
        self.last_time = 0.             # print_time up to which moves are taken

    def attach(self, printer):
        """Show this printer from now on; it is about to start."""
        self.printer, self.reactor = printer, printer.get_reactor()
        self.motion, self.last_time = None, 0.
        printer.register_event_handler("klippy:ready", self._handle_ready)
        printer.lookup_object("gcode").register_output_handler(self._note_output)

    def _note_output(self, text):
        for line in text.split("\n"):
            self.console.append(line)

    def _handle_ready(self):
        self.motion = self.printer.lookup_object("motion_report", None)
        self.reactor.register_timer(self._collect, self.reactor.NOW)
        self.reactor.register_timer(self._collect_heat, self.reactor.NOW)

    def _collect_heat(self, eventtime):
        self.heat.append({"time": eventtime, "heaters": self._read_heaters(eventtime)})
        return eventtime + HEAT_PERIOD

    # The path

    def _collect(self, eventtime):
        print_time = self.printer.lookup_object("mcu").estimated_print_time(eventtime)
        start = max(self.last_time, print_time - HISTORY_S)
        toolhead = self.motion.trapqs.get("toolhead")
        if toolhead is not None:
            moves = toolhead.read_moves(start, print_time)
            if moves:
                self._note_moves(moves, self._list_extrusion(start, print_time))
        self.last_time = max(print_time, self.last_time)
        return eventtime + COLLECT_PERIOD

    def _list_extrusion(self, start, end):
        """print_times at which segments that push filament begin, in order."""
        name = self.printer.lookup_object("toolhead").get_extruder().get_name()
        dump = self.motion.trapqs.get(name)
        if dump is None:
            return []
        # the filament's own direction is above 0 when it is pushed
        return [move[0] for move in dump.read_moves(start, end) if move[7] > 0.]

    def _note_moves(self, moves, times):
        """Append the end of each segment: [x, y, z, is_extruding], mm.

        times: print_times at which segments with filament begin, in order.
        """
        for move in moves:
            print_time, duration, velocity, accel, *rest = move
            way = (velocity + .5 * accel * duration) * duration
            end = [round(p + d * way, 4)
                   for p, d in zip(rest[:3], rest[3:], strict=True)]
            index = bisect.bisect_left(times, print_time - 1e-9)
            is_extruding = (index < len(times)
                            and abs(times[index] - print_time) < 1e-6)
            self.path.append([*end, int(is_extruding)])

    # The rest

    def read(self, path_from, console_from, heat_from):
        """All that the page shows, as plain types."""
        now = self.reactor.monotonic()
        message, state = self.printer.get_state_message()
        path, next_path = self.path.since(path_from)
        console, next_console = self.console.since(console_from)
        heat, next_heat = self.heat.since(heat_from)
        shown = {"state": state, "message": message, "time": now,
                 "path": path, "path_next": next_path,
                 "console": console, "console_next": next_console,
                 "heat": heat, "heat_next": next_heat,
                 "speed": self.reactor.get_pace(),
                 "heaters": self._read_heaters(now), "files": self._list_files()}
        for name in ("print_stats", "virtual_sdcard", "display_status", "fan",
                     "gcode_move", "toolhead", "motion_report"):
            obj = self.printer.lookup_object(name, None)
            if obj is not None and state == "ready":
                shown[name] = _make_plain(obj.get_status(now))
        return shown

    def _read_heaters(self, now):
        heaters = self.printer.lookup_object("heaters", None)
        if heaters is None:
            return {}
        return {name: heater.get_status(now)
                for name, heater in heaters.heaters.items()}

    def _list_files(self):
        sdcard = self.printer.lookup_object("virtual_sdcard", None)
        if sdcard is None or not os.path.isdir(sdcard.sdcard_dirname):
            return []
        return [name for name, _ in sdcard.get_file_list(check_subdirs=True)]


def _make_plain(value):
    if isinstance(value, dict):
        return {key: _make_plain(item) for key, item in value.items()}
    return list(value) if isinstance(value, tuple) else value
