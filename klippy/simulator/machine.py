# SPDX-License-Identifier: GPL-3.0-or-later
"""The machine behind the pins of the virtual mcus, made from a printer.cfg.

One firmware instance a [mcu] section, each with its own clock error; step
counters, end switches, heaters, sensors and fans are wired to the pins
that the config names.  Everything moves in the world's virtual time and
depends on nothing but the config and the seed.
"""
import random
import re

from klippy.errors import ConfigError
from klippy.simulator import (
    axes,
    filament,
    firmware,
    palette,
    pinmap,
    settings,
    wiring,
)

THERMAL_PERIOD = 0.1
CONFIG_STEPPER = re.compile(r"config_stepper .*step_pin=(?P<pin>\S+) .*"
                            r"invert_step=(?P<invert>-?\d+)")
# Crystals are this exact (one sigma, parts per million).
CLOCK_SIGMA_PPM = 15.0


def read_seed(sections):
    """Seed of the [simulator] section of {section: {option: text}}."""
    config = settings.MachineConfig(sections)
    return settings.SimOptions.from_config(config).seed


class SimMachine:
    """What `printer.get_start_args()["machine"]` is on a simulated printer."""

    def __init__(self, world, sections, seed=None):
        """sections: {section: {option: text}} of the printer.cfg."""
        self.world = world
        self.config = settings.MachineConfig(sections)
        self.options = settings.SimOptions.from_config(self.config)
        self.seed = self.options.seed if seed is None else seed
        self.library = firmware.find_firmware(self.options.firmware)
        self.mcus = self._add_mcus()
        self.pins = pinmap.PinMap(self.config, self._find_pin)
        self.axes = axes.build_axes(self.config, self.options.start_position)
        self.traces, self.traces_by_pin = {}, {}
        self._watch_steppers()
        self._bind_switches()
        self.thermal = wiring.ThermalWorld(
            self.config, self.options, self.pins, self.mcus)
        self.filament = filament.FilamentWorld(
            self.config, self.options, self.pins, self.mcus, self.traces)
        self.thermal.spools = self.filament.spools
        if self.filament.updates:
            world.add_ticker(filament.PERIOD, self.filament.tick)
        self.palette = self._add_palette()
        self.configured = set()
        self.last_tick = world.monotonic()
        world.add_ticker(THERMAL_PERIOD, self._tick)

    def _add_mcus(self):
        rng = random.Random(self.seed)
        mcus = {}
        for index, name in enumerate(self.config.list_mcus()):
            ppm = self.options.clock_ppm.get(
                name, rng.gauss(0.0, CLOCK_SIGMA_PPM))
            mcus[name] = self.world.add_mcu(
                name, self.library, freq=self.options.clock_freq, ppm=ppm,
                baud=self.options.baud, latency=self.options.latency,
                seed=self.seed + index)
        return mcus

    def _add_palette(self):
        """The SimPalette that [palette2] is about, None without the section."""
        if "palette2" not in self.config.sections:
            return None
        device = palette.SimPalette(self.filament.spools.get("extruder"))
        self.world.add_ticker(palette.PERIOD, device.tick)
        return device

    def _find_pin(self, name):
        """Number of a pin by the firmware's own name for it, or -1."""
        try:
            return self.mcus["mcu"].find_pin(name)
        except KeyError:
            return -1

    def _watch_steppers(self):
        for stepper in self.axes.steppers:
            step = self.pins.lookup(stepper.step_pin)
            direction = self.pins.lookup(stepper.dir_pin)
            if step is None or direction is None or step.mcu != direction.mcu:
                continue
            trace = self.mcus[step.mcu].watch_stepper(
                step.number, direction.number, invert_step=step.invert,
                invert_dir=direction.invert)
            self.traces[stepper.name] = trace
            self.traces_by_pin[step.mcu, step.number] = trace

    def _bind_switches(self):
        for switch in self.axes.switches:
            ref = self.pins.lookup(switch.pin)
            if ref is None:
                continue
            names = [n for n in switch.coefficients if n in self.traces]
            self.mcus[ref.mcu].bind_switch(
                ref.number, [self.traces[n] for n in names],
                [switch.coefficients[n] for n in names], switch.threshold,
                above=switch.is_above, invert=ref.invert)

    def _tick(self, now):
        elapsed, self.last_tick = now - self.last_tick, now
        if elapsed > 0.0:
            self.thermal.tick(elapsed)

    # What the host asks (docs/internals/seams.md, section 6)

    def open_link(self, mcu_name):
        """The VirtualMcu of a [mcu] section; ConfigError if unknown."""
        mcu = self.mcus.get(mcu_name)
        if mcu is None:
            raise ConfigError("The simulated machine has no mcu '%s', only %s"
                              % (mcu_name, ", ".join(self.mcus)))
        return mcu

    def get_pin_map(self, mcu_name):
        """{pin name of the config: pin number of the simulated board}."""
        return self.pins.get_pin_map(mcu_name)

    def note_configured(self, mcu_name, config_cmds):
        """The host has configured this mcu by these commands (texts).

        They tell which drivers step on both edges of their step pin.
        """
        self.configured.add(mcu_name)
        numbers = self.get_pin_map(mcu_name)
        for cmd in config_cmds:
            match = CONFIG_STEPPER.match(cmd)
            if match is None or match["pin"] not in numbers:
                continue
            trace = self.traces_by_pin.get((mcu_name, numbers[match["pin"]]))
            if trace is not None:
                trace.both_edges = int(match["invert"]) in (-1, 255)

    # What tests and reports ask

    def get_step_counts(self):
        """{stepper section: net steps since power-up}."""
        return {name: trace.position for name, trace in self.traces.items()}

    def get_total_steps(self):
        """{stepper section: steps in both directions since power-up}."""
        return {name: trace.total for name, trace in self.traces.items()}

    def calc_position(self):
        """(x, y, z) in mm where the nozzle really stands; None if unknown."""
        return axes.calc_point(self.config, self.axes, self.get_step_counts())

    def get_temperatures(self):
        """{heater section: degC of its block}."""
        return {heater.name: heater.model.temperature
                for heater in self.thermal.heaters}

    def record_steps(self, on=True):
        """Start or stop keeping every step of every stepper."""
        for trace in self.traces.values():
            trace.record(on)

    def take_steps(self):
        """{stepper section: (n, 2) int64 array of clock, +1 or -1}."""
        import numpy as np
        return {name: np.frombuffer(trace.take(), np.int64).reshape(-1, 2)
                for name, trace in self.traces.items()}
