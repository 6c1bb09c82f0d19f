# SPDX-License-Identifier: GPL-3.0-or-later
"""[endstop_phase]: homes to one full step of the motor, not to one switching.

A switch need not be exact: the phase of the motor at its trigger, counted in
microsteps of the driver's table, tells by how much it was early or late.
"""

import math

from klippy import stepperconfig
from klippy.errors import CommandError

# The drivers that tell the phase of a stepper by an object "<chip> <stepper>"
PHASE_DRIVERS = ("tmc2130", "tmc2208", "tmc2209", "tmc2240", "tmc2660", "tmc5160")


class PhaseCounter:
    """Phases of one stepper; they follow its steps, or the table of its driver."""

    def __init__(self, printer, name, phases):
        """phases: microsteps of four full steps."""
        self.printer, self.name, self.phases = printer, name, phases
        self.driver = None
        # Of the last homing
        self.last_phase = self.last_mcu_position = None
        self.history = [0] * phases
        printer.register_event_handler("klippy:connect", self.find_driver)

    def find_driver(self):
        """Look for the driver that tells the phase of the stepper."""
        for chip in PHASE_DRIVERS:
            driver = self.printer.lookup_object("%s %s" % (chip, self.name), None)
            if driver is not None:
                self.driver = driver

    def _get_offset(self):
        """Phase of the driver at step 0.  Raises CommandError if unknown."""
        if self.driver is None:
            return 0
        offset, _ = self.driver.get_phase_offset()
        if offset is None:
            if self.printer.get_start_args().get("debugoutput") is not None:
                return 0
            raise CommandError("Stepper %s phase unknown" % (self.name,))
        return offset

    def note_home(self, mcu_position):
        """The trigger was at so many steps; returns its phase."""
        phase = (mcu_position + self._get_offset()) % self.phases
        self.last_phase, self.last_mcu_position = phase, mcu_position
        self.history[phase] += 1
        return phase

    def get_status(self):
        """What status reports of the last homing."""
        return {"phase": self.last_phase, "phases": self.phases,
                "mcu_position": self.last_mcu_position}


def find_arc(history):
    """(first, number) of the phases that hold all triggers, in a circle.

    history: how often each phase was seen.  None if there was no trigger.
    """
    phases = len(history)
    seen = [phase for phase, count in enumerate(history) if count]
    if not seen:
        return None
    gaps = [((after - before - 1) % phases + 1, after)
            for before, after in zip([seen[-1], *seen[:-1]], seen, strict=True)]
    gap, first = max(gaps)
    return first, phases - gap + 1


class EndstopPhase:
    """[endstop_phase <stepper>]: what to do about one stepper."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.name = config.get_name().split(None, 1)[1]
        self.section = config.get_name()
        section = config.getsection(self.name)
        distance, steps = stepperconfig.parse_step_distance(section)
        self.step_dist = distance / steps
        microsteps = section.getint("microsteps", minval=1, note_valid=False)
        self.microsteps = microsteps
        base = self.printer.load_object(config, "endstop_phase")
        self.counter = base.add_counter(self.name, microsteps * 4)
        self.trigger_phase = self._read_phase(config)
        self.is_aligned = config.getboolean("endstop_align_zero", False)
        self.accuracy_steps = self._read_accuracy(config)
        self.printer.register_event_handler("homing:home_rails_end",
                                            self._handle_home_rails_end)

    def _read_phase(self, config):
        """Phase to expect at the trigger, None if there is no such option."""
        if config.get("trigger_phase", None) is None:
            return None
        phase, phases = config.getintlist("trigger_phase", sep="/", count=2)
        if not 0 <= phase < phases:
            raise config.error(
                "Option 'trigger_phase' in section '%s': '%d/%d' must be a phase from"
                " 0 on, below the number of phases" % (self.section, phase, phases))
        count = self.counter.phases
        return math.floor(phase * count / phases + .5) % count

    def _read_accuracy(self, config):
        """How many steps the trigger may be off, either way."""
        accuracy = config.getfloat("endstop_accuracy", None, above=0.)
        limit = self.counter.phases // 2
        if accuracy is None:
            return limit - 1
        # the first homing may be at one end of the range and set the phase
        share = 1. if self.trigger_phase is None else .5
        steps = math.ceil(share * accuracy / self.step_dist)
        if steps >= limit:
            raise config.error(
                "Option 'endstop_accuracy' in section '%s': %.3f mm is too coarse for"
                " phases, it must be below %.3f mm"
                % (self.section, accuracy, limit * self.step_dist / share))
        return steps

    def _handle_home_rails_end(self, homing_state, rails):
        for rail in rails:
            if rail.get_steppers()[0].get_name() == self.name:
                phase = self.counter.note_home(
                    homing_state.get_trigger_position(self.name))
                shift = self._calc_shift(phase)
                homing_state.set_stepper_adjustment(
                    self.name, shift + self._calc_align(rail))

    def _calc_shift(self, phase):
        """mm that the trigger was beyond its place.  Raises CommandError."""
        if self.trigger_phase is None:
            self.printer.lookup_object("gcode").respond_info(
                "Setting %s endstop phase to %d" % (self.name, phase))
            self.trigger_phase = phase
            return 0.
        phases = self.counter.phases
        off = (phase - self.trigger_phase) % phases
        if off > phases // 2:
            off -= phases
        if abs(off) > self.accuracy_steps:
            raise CommandError("Endstop %s incorrect phase (got %d vs %d)"
                               % (self.name, phase, self.trigger_phase))
        return off * self.step_dist

    def _calc_align(self, rail):
        """mm to add so that a full step of the motor lies at position 0."""
        if not self.is_aligned:
            return 0.
        # steps from the nearest full step to the trigger
        half = self.microsteps // 2
        beyond = (self.trigger_phase + half) % self.microsteps - half
        full_step = self.microsteps * self.step_dist
        endstop = rail.get_homing_info().position_endstop
        nearest = math.floor(endstop / full_step + .5) * full_step
        return nearest - endstop + beyond * self.step_dist


class EndstopPhases:
    """Object endstop_phase: the phases of all steppers at their homing."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.config = config
        self.counters = {}          # those with a section of their own
        self.tracked = {}           # stepper name -> PhaseCounter or None
        self.printer.register_event_handler("homing:home_rails_end",
                                            self._handle_home_rails_end)
        self.printer.lookup_object("gcode").register_command(
            "ENDSTOP_PHASE_CALIBRATE", self.cmd_ENDSTOP_PHASE_CALIBRATE,
            desc=self.cmd_ENDSTOP_PHASE_CALIBRATE_help)

    def add_counter(self, name, phases):
        """The PhaseCounter of a stepper whose owner notes its homings."""
        self.counters[name] = PhaseCounter(self.printer, name, phases)
        return self.counters[name]

    def _list_counters(self):
        known = {**self.tracked, **self.counters}
        return {name: counter for name, counter in sorted(known.items())
                if counter is not None and any(counter.history)}

    def _handle_home_rails_end(self, homing_state, rails):
        for rail in rails:
            stepper = rail.get_steppers()[0]
            name = stepper.get_name()
            if name in self.counters:
                continue
            if name not in self.tracked:
                self.tracked[name] = self._make_counter(name)
            self.tracked[name].note_home(homing_state.get_trigger_position(name))

    def _make_counter(self, name):
        section = self.config.getsection(name)
        microsteps = section.getint("microsteps", note_valid=False)
        counter = PhaseCounter(self.printer, name, microsteps * 4)
        counter.find_driver()
        return counter

    def get_status(self, eventtime):
        """last_home: {stepper: phase, phases, mcu_position}."""
        return {"last_home": {name: counter.get_status()
                              for name, counter in self._list_counters().items()}}

    cmd_ENDSTOP_PHASE_CALIBRATE_help = "Tell and set the phase at an endstop"

    def cmd_ENDSTOP_PHASE_CALIBRATE(self, gcmd):
        """Have the phases of STEPPER saved; without it, tell those of all."""
        name = gcmd.get("STEPPER", None)
        known = self._list_counters()
        if name is None:
            if not known:
                gcmd.respond_info("No steppers found. (Be sure to home at least once.)")
            for stepper, counter in known.items():
                self._report(gcmd, stepper, counter)
            return
        if name not in known:
            raise gcmd.error("Stats not available for stepper %s, only for: %s"
                             % (name, ", ".join(known) or "none, home first"))
        phase, phases = self._report(gcmd, name, known[name])
        self.printer.lookup_object("configfile").set(
            "endstop_phase %s" % (name,), "trigger_phase", "%d/%d" % (phase, phases))
        gcmd.respond_info(
            "The SAVE_CONFIG command will update the printer config\nfile with these"
            " parameters and restart the printer.")

    def _report(self, gcmd, name, counter):
        """Tell the phases of a stepper; returns (the middle one, their number)."""
        first, number = find_arc(counter.history)
        phases = counter.phases
        middle = (first + number // 2) % phases
        gcmd.respond_info("%s: trigger_phase=%d/%d (range %d to %d)" % (
            name, middle, phases, first, (first + number - 1) % phases))
        return middle, phases


def load_config(config):
    return EndstopPhases(config)


def load_config_prefix(config):
    return EndstopPhase(config)
