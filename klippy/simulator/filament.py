# SPDX-License-Identifier: GPL-3.0-or-later
"""Filament of the simulated extruders, and the sensors that it runs past.

The steps of an extruder pull filament from a spool until that is empty or stuck.
Switches, encoders and width sensors are wired to the pins that the config names; they
sit at the entry of the path.
"""
import math

from klippy.simulator import axis_parts

SWITCH = "filament_switch_sensor"
ENCODER = "filament_motion_sensor"
HALL = "hall_filament_width_sensor"
TSL = "tsl1401cl_filament_width_sensor"
# Encoders change so fast (s)
PERIOD = 0.01
DIAMETER = 1.75             # mm
HEAT = 1.2e-3 * 1.8         # J/K of a mm^3, density times heat capacity of PLA
HALL_SCALE = 10000
TSL_REFERENCE = 5.0


class Spool:
    """Filament of one extruder; mm from power-up on."""

    def __init__(self, name, trace, step_dist, options):
        """options: SimOptions; diameter may become a function of mm pushed."""
        self.trace, self.step_dist = trace, step_dist
        self.length = options.filament_length.get(name, math.inf)
        self.jam_at = options.filament_jam.get(name, math.inf)
        self.diameter = options.filament_diameter.get(name, DIAMETER)
        self.loaded_at = self.heated = 0.0

    @property
    def pushed(self):
        """mm that the extruder's gear has turned."""
        return self.trace.position * self.step_dist

    @property
    def moved(self):
        """mm that filament at the entry has moved with it."""
        return min(self.pushed, self.loaded_at + min(self.length, self.jam_at))

    @property
    def is_present(self):
        """Whether filament is at the entry."""
        return self.pushed < self.loaded_at + self.length

    def load(self, length=math.inf, jam_at=math.inf):
        """Put in new filament of so many mm, which gets stuck after jam_at mm."""
        self.loaded_at, self.length, self.jam_at = self.pushed, length, jam_at

    def take_heat(self):
        """J/K of filament that has come in for the first time since last asked."""
        fresh = max(self.moved - self.heated, 0.0)
        self.heated += fresh
        return fresh * 0.25 * math.pi * self.read_diameter() ** 2 * HEAT

    def read_diameter(self):
        """mm at the entry; 0 without filament."""
        if not self.is_present:
            return 0.0
        if callable(self.diameter):
            return self.diameter(self.pushed)
        return self.diameter


class FilamentWorld:
    """All spools and the sensors on them."""

    def __init__(self, config, options, pins, mcus, traces):
        self.spools, self.updates = {}, []
        self.pins, self.mcus = pins, mcus
        self.edge_length = options.encoder_edge
        for name, trace in traces.items():
            if name.startswith("extruder") and " " not in name:
                step_dist = axis_parts.calc_step_dist(config.get(name))
                self.spools[name] = Spool(name, trace, step_dist, options)
        if self.spools:
            for section in config.sections.values():
                self._wire(section)
        self.tick(0.0)

    def _wire(self, section):
        kind = section.name.split()[0]
        spool = self.spools.get(section.get("extruder") or "extruder")
        if spool is None or kind not in (SWITCH, ENCODER, HALL, TSL):
            return
        if kind == HALL:
            self._wire_hall(section, spool)
        elif kind == TSL:
            self._wire_analog(section.get("pin"),
                              lambda: spool.read_diameter() / TSL_REFERENCE)
        elif kind == SWITCH:
            self._wire_digital(section, lambda: spool.is_present)
        else:
            edge = self.edge_length
            self._wire_digital(section,
                               lambda: math.floor(spool.moved / edge) & 1)

    def _wire_digital(self, section, read):
        ref = self.pins.lookup(section.get("switch_pin"))
        if ref is not None:
            mcu = self.mcus[ref.mcu]
            self.updates.append(
                lambda: mcu.set_input(ref.number, bool(read()) != ref.invert))

    def _wire_analog(self, description, read):
        ref = self.pins.lookup(description)
        if ref is not None:
            mcu = self.mcus[ref.mcu]
            self.updates.append(lambda: mcu.set_adc(ref.number, read()))

    def _wire_hall(self, section, spool):
        dias = [section.getfloat("cal_dia1", 1.5), section.getfloat("cal_dia2", 2.0)]
        raws = [section.getfloat("raw_dia1", 9500), section.getfloat("raw_dia2", 10500)]
        slope = (raws[1] - raws[0]) / (dias[1] - dias[0])

        def read():
            raw = raws[0] + (spool.read_diameter() - dias[0]) * slope
            return 0.5 * raw / HALL_SCALE

        for option in ("adc1", "adc2"):
            self._wire_analog(section.get(option), read)

    def tick(self, now):
        """Show the sensors what is there now."""
        for update in self.updates:
            update()
