# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves right now: status, streams of moves and steps, last words.

Everything is told when it happens on the mcu, not when it is planned.
"""

import logging

from klippy import dangers
from klippy.extras.dump_stream import DumpStream
from klippy.gcode_command import Coord

STEP_HEADER = ("interval", "count", "add")
MOVE_HEADER = ("time", "duration", "start_velocity", "acceleration",
               "start_position", "direction")
# Rows that are taken out of a history at once
PAGE = 256
# Around a shutdown: s before and after it, and rows of each kind at most
SHUTDOWN_BEFORE, SHUTDOWN_AFTER = 0.250, 0.100
MAX_LOG_ROWS = 40


def read_pages(extract, start, end, get_start):
    """All rows of a history that overlap a span, oldest first.

    extract(max, start, end): newest first.  get_start(row): its begin.
    """
    rows = []
    while True:
        page = extract(PAGE, start, end)
        # rows at the seam of two pages come twice
        known = {row for row in rows[-PAGE:] if get_start(row) >= end}
        rows.extend(row for row in page if row not in known)
        if len(page) < PAGE or get_start(page[-1]) >= end:
            return rows[::-1]
        end = get_start(page[-1])


def split_at_marks(runs):
    """Lists of step runs, oldest first, in each of which positions go on.

    A run is as StepCompress.extract_old() has it; one of no steps marks a
    position read back from the mcu.  What lies after the clock of the mark but
    was made before it never happened: the mcu had stopped.
    """
    pieces = [[]]
    for run in runs:
        if run[3]:
            pieces[-1].append(run)
        else:
            pieces[-1] = [old for old in pieces[-1] if old[0] <= run[0]]
            pieces.append([])
    return [piece for piece in pieces if piece]


class StepperDump:
    """Steps of one stepper: endpoint motion_report/dump_stepper."""

    def __init__(self, printer, mcu_stepper):
        self.stepper = mcu_stepper
        self.mcu = mcu_stepper.get_mcu()
        self.reactor = printer.get_reactor()
        self.last_clock = 0
        self.stream = DumpStream(printer, "motion_report/dump_stepper",
                                 mcu_stepper.get_name(), STEP_HEADER,
                                 self._start, self.collect)

    def _read_clock(self, eventtime):
        return self.mcu.print_time_to_clock(self.mcu.estimated_print_time(eventtime))

    def _start(self):
        self.last_clock = self._read_clock(self.reactor.monotonic())

    def read_runs(self, start_clock, end_clock):
        """Runs that begin after start_clock and until end_clock, oldest first."""
        runs = read_pages(self.stepper.stepcompress.extract_old, start_clock,
                          end_clock, lambda run: run[0])
        return [run for run in runs if start_clock < run[0] <= end_clock]

    def collect(self, eventtime):
        """Messages with the runs that began since the last call."""
        clock = self._read_clock(eventtime)
        runs = self.read_runs(self.last_clock, clock)
        self.last_clock = max(clock, self.last_clock)
        return [self._describe(piece) for piece in split_at_marks(runs)]

    def _describe(self, runs):
        first_clock, last_clock = runs[0][0], runs[-1][1]
        position = runs[0][2]
        return {
            "data": [(interval, count, add)
                     for _, _, _, count, interval, add in runs],
            "start_position": self.stepper.mcu_to_commanded_position(position),
            "start_mcu_position": position,
            "step_distance": self.stepper.get_step_dist(),
            "first_clock": first_clock,
            "first_step_time": self.mcu.clock_to_print_time(first_clock),
            "last_clock": last_clock,
            "last_step_time": self.mcu.clock_to_print_time(last_clock)}

    def format_steps(self, print_time):
        """Lines for the log: runs around a time."""
        to_clock = self.mcu.print_time_to_clock
        runs = self.read_runs(to_clock(print_time - SHUTDOWN_BEFORE),
                              to_clock(print_time + SHUTDOWN_AFTER))
        return ["stepper '%s' of mcu '%s', %d runs:"
                % (self.stepper.get_name(), self.mcu.get_name(), len(runs))] + [
            "  clock %d to %d: from position %d, interval %d count %d add %d"
            % (first, last, position, interval, count, add)
            for first, last, position, count, interval, add in runs[-MAX_LOG_ROWS:]]


class TrapqDump:
    """Moves of one trapq: endpoint motion_report/dump_trapq."""

    def __init__(self, printer, name, trapq):
        self.name, self.trapq = name, trapq
        self.mcu = printer.lookup_object("mcu")
        self.reactor = printer.get_reactor()
        self.last_time = 0.
        self.stream = DumpStream(printer, "motion_report/dump_trapq", name,
                                 MOVE_HEADER, self._start, self.collect)

    def _start(self):
        self.last_time = self.mcu.estimated_print_time(self.reactor.monotonic())

    def read_moves(self, start_time, end_time):
        """Moves that begin from start_time and before end_time, oldest first."""
        moves = read_pages(self.trapq.extract_old, start_time, end_time,
                           lambda move: move[0])
        return [move for move in moves
                if move[1] > 0. and start_time <= move[0] < end_time]

    def collect(self, eventtime):
        """Messages with the moves that began since the last call."""
        print_time = self.mcu.estimated_print_time(eventtime)
        moves = self.read_moves(self.last_time, print_time)
        self.last_time = max(print_time, self.last_time)
        if not moves:
            return []
        return [{"data": [(*move[:4], tuple(move[4:7]), tuple(move[7:10]))
                          for move in moves]}]

    def read_state(self, print_time):
        """((x, y, z), velocity along the way, (x, y, z) of the way) at a time.

        None before anything has moved.
        """
        found = self.trapq.extract_old(1, 0., print_time)
        if not found:
            return None
        start, duration, start_v, accel, *rest = found[0]
        position, direction = rest[:3], rest[3:]
        elapsed = min(max(print_time - start, 0.), duration)
        way = (start_v + .5 * accel * elapsed) * elapsed
        velocity = 0. if print_time > start + duration else start_v + accel * elapsed
        return ([p + d * way for p, d in zip(position, direction, strict=True)],
                velocity, direction)

    def format_moves(self, print_time):
        """Lines for the log: moves around a time."""
        moves = self.read_moves(print_time - SHUTDOWN_BEFORE,
                                print_time + SHUTDOWN_AFTER)
        return ["moves of '%s', %d:" % (self.name, len(moves))] + [
            "  %.6f s for %.6f s: velocity %.6f, accel %.3f, from (%.6f, %.6f, %.6f)"
            " along (%.6f, %.6f, %.6f)" % move for move in moves[-MAX_LOG_ROWS:]]


class MotionReport:
    """Object motion_report."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.steppers, self.trapqs = {}, {}
        self.status = {"live_position": Coord(0., 0., 0., 0.), "live_velocity": 0.,
                       "live_extruder_velocity": 0., "steppers": [], "trapq": []}
        register = self.printer.register_event_handler
        register("klippy:connect", self._handle_connect)
        register("klippy:analyze_shutdown", self._handle_analyze)

    def register_stepper(self, config, mcu_stepper):
        """Offer the steps of a stepper."""
        name = mcu_stepper.get_name()
        self.steppers[name] = StepperDump(self.printer, mcu_stepper)

    def register_trapq(self, name, trapq):
        """Offer the moves of a TrapQ."""
        self.trapqs[name] = TrapqDump(self.printer, name, trapq)

    def _handle_connect(self):
        toolhead = self.printer.lookup_object("toolhead")
        self.register_trapq("toolhead", toolhead.get_trapq())
        for name, extruder in self.printer.lookup_objects("extruder"):
            if name.removeprefix("extruder").isdigit() or name == "extruder":
                self.register_trapq(name, extruder.get_trapq())
        self.status = dict(self.status, steppers=sorted(self.steppers),
                           trapq=sorted(self.trapqs))

    def get_status(self, eventtime):
        """live_position, live_velocity, live_extruder_velocity; known names."""
        if "toolhead" not in self.trapqs:
            return self.status
        mcu = self.printer.lookup_object("mcu")
        print_time = mcu.estimated_print_time(eventtime)
        position, velocity = [*self.status["live_position"]], 0.
        state = self.trapqs["toolhead"].read_state(print_time)
        if state is not None:
            position[:3], velocity = state[0], state[1]
        position[3], extruder_velocity = self._read_extruder(print_time, position[3])
        self.status = dict(self.status, live_position=Coord(position),
                           live_velocity=velocity,
                           live_extruder_velocity=extruder_velocity)
        return self.status

    def _read_extruder(self, print_time, position):
        """(position, velocity) of the active extruder's filament."""
        toolhead = self.printer.lookup_object("toolhead")
        dump = self.trapqs.get(toolhead.get_extruder().get_name())
        state = dump and dump.read_state(print_time)
        if not state:
            return position, 0.
        return state[0][0], state[1] * state[2][0]

    def _handle_analyze(self, message, details):
        """Log what moved when the printer stopped."""
        if not dangers.get(self.printer).log_shutdown_info:
            return
        lines = []
        for dump in self.steppers.values():
            clock = dump.mcu.get_shutdown_clock()
            lines += dump.format_steps(self._find_time(dump.mcu, clock))
        mcu = self.printer.lookup_object("mcu")
        print_time = self._find_time(mcu, mcu.get_shutdown_clock())
        for dump in self.trapqs.values():
            lines += dump.format_moves(print_time)
        logging.info("motion around the shutdown at %.6f\n%s", print_time,
                     "\n".join(lines))

    def _find_time(self, mcu, shutdown_clock):
        """print_time of a shutdown; now if the mcu has not reported one."""
        if shutdown_clock:
            return mcu.clock_to_print_time(shutdown_clock)
        return mcu.estimated_print_time(self.printer.get_reactor().monotonic())


def load_config(config):
    return MotionReport(config)
