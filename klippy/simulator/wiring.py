# SPDX-License-Identifier: GPL-3.0-or-later
"""Heaters and fans of the simulated machine, wired to the pins of its mcus."""
from dataclasses import dataclass

from klippy.simulator import thermal

FAN_SECTIONS = ("fan", "heater_fan", "controller_fan", "fan_generic",
                "temperature_fan")
CHIP_SENSOR = "ADC_TEMPERATURE"
# What the reference and the ground of an [adc_scaled] board read on the mcu
SCALED_VREF, SCALED_VSSA = 0.97, 0.01


@dataclass
class AnalogInput:
    """An analog pin that shows a temperature through a sensor's curve."""

    mcu: object
    pin: int
    converter: object
    heater: thermal.HeaterModel | None
    ambient: float
    is_scaled: bool = False

    def update(self):
        """Put the sensor's present reading on the pin."""
        temp = (self.ambient if self.heater is None
                else self.heater.sensor_temperature)
        fraction = thermal.calc_fraction(self.converter, temp)
        if self.is_scaled:
            fraction = SCALED_VSSA + fraction * (SCALED_VREF - SCALED_VSSA)
        self.mcu.set_adc(self.pin, fraction)


@dataclass
class PoweredHeater:
    """A heater model and the output that drives it."""

    name: str
    model: thermal.HeaterModel
    output: object
    is_hotend: bool
    duty: float = 0.0


class ThermalWorld:
    """All heaters, sensors and fans; tick() moves them on together."""

    def __init__(self, config, options, pins, mcus):
        self.config = config
        self.options = options
        self.pins = pins
        self.mcus = mcus
        self.heaters = []
        self.inputs = []
        self.fans = {}
        self.fan_duties = {}
        self.spools = {}        # heater section -> filament.Spool
        for section in config.sections.values():
            self._wire_fan(section)
            self._wire_section(section)
            self._wire_references(section)
        for analog in self.inputs:
            analog.update()

    def _watch(self, description):
        ref = self.pins.lookup(description)
        if ref is None:
            return None
        return self.mcus[ref.mcu].watch_output(ref.number, invert=ref.invert)

    def _wire_fan(self, section):
        if section.name.split()[0] in FAN_SECTIONS:
            output = self._watch(section.get("pin"))
            if output is not None:
                self.fans[section.name] = output
                self.fan_duties[section.name] = 0.0

    def _wire_section(self, section):
        heater = self._wire_heater(section)
        converter = thermal.make_converter(self.config, section)
        ref = self._find_sensor(section)
        if converter is None or ref is None:
            return
        mcu, number, is_scaled = ref
        self.inputs.append(AnalogInput(
            mcu, number, converter, heater, self.options.ambient_temp, is_scaled))

    def _find_sensor(self, section):
        """(mcu, number, is_scaled) of the analog pin of a sensor."""
        if section.get("sensor_type") == "temperature_mcu":
            mcu = self.mcus.get(section.get("sensor_mcu", "mcu"))
            return None if mcu is None else (mcu, mcu.find_pin(CHIP_SENSOR), False)
        ref = self.pins.lookup(section.get("sensor_pin"))
        if ref is None:
            return None
        return self.mcus[ref.mcu], ref.number, bool(ref.chip)

    def _wire_references(self, section):
        if not section.name.startswith("adc_scaled "):
            return
        for option, fraction in (("vref_pin", SCALED_VREF), ("vssa_pin", SCALED_VSSA)):
            ref = self.pins.lookup(section.get(option))
            if ref is not None:
                self.mcus[ref.mcu].set_adc(ref.number, fraction)

    def _wire_heater(self, section):
        output = self._watch(section.get("heater_pin"))
        if output is None:
            return None
        traits = thermal.choose_traits(section.name, self.options)
        model = thermal.HeaterModel(traits, self.options.ambient_temp)
        self.heaters.append(PoweredHeater(
            section.name, model, output, section.name.startswith("extruder")))
        return model

    def tick(self, elapsed):
        """Move all temperatures on by `elapsed` s."""
        for name, output in self.fans.items():
            self.fan_duties[name] = output.read_duty()
        part_fan = self.fan_duties.get("fan", 0.0)
        for heater in self.heaters:
            heater.duty = heater.output.read_duty()
            spool = self.spools.get(heater.name)
            heater.model.advance(
                elapsed, heater.duty, part_fan if heater.is_hotend else 0.0,
                0.0 if spool is None else spool.take_heat() / elapsed)
        for analog in self.inputs:
            analog.update()
