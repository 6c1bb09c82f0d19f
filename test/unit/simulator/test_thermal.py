# SPDX-License-Identifier: GPL-3.0-or-later
"""The thermal model against plain Euler integration and common sense."""
import pytest

from klippy.simulator import settings, thermal


def euler(traits, ambient, plan, dt=1e-4):
    block = sensor = ambient
    for elapsed, duty, fan in plan:
        loss = traits.loss + traits.fan_loss * fan
        for _ in range(round(elapsed / dt)):
            power = duty * traits.power - (block - ambient) * loss
            sensor += (block - sensor) / traits.sensor_lag * dt
            block += power / traits.capacity * dt
    return block, sensor


def test_model_solves_its_differential_equation():
    plan = [(3.0, 1.0, 0.0), (2.0, 0.0, 1.0), (4.0, 0.4, 0.5)]
    model = thermal.HeaterModel(thermal.HOTEND, 25.0)
    for elapsed, duty, fan in plan:
        model.advance(elapsed, duty, fan)
    block, sensor = euler(thermal.HOTEND, 25.0, plan)
    assert model.temperature == pytest.approx(block, abs=0.01)
    assert model.sensor_temperature == pytest.approx(sensor, abs=0.01)


def test_step_size_does_not_matter():
    coarse = thermal.HeaterModel(thermal.BED, 20.0)
    fine = thermal.HeaterModel(thermal.BED, 20.0)
    coarse.advance(60.0, 0.7)
    for _ in range(600):
        fine.advance(0.1, 0.7)
    assert coarse.temperature == pytest.approx(fine.temperature)
    assert coarse.sensor_temperature == pytest.approx(fine.sensor_temperature)


def time_to(traits, goal):
    model = thermal.HeaterModel(traits, 25.0)
    elapsed = 0
    while model.sensor_temperature < goal:
        model.advance(1.0, 1.0)
        elapsed += 1
    return elapsed


def test_defaults_heat_like_real_printers():
    assert 40 <= time_to(thermal.HOTEND, 210.0) <= 80
    assert 80 <= time_to(thermal.BED, 60.0) <= 200


def make_config(**sections):
    return settings.MachineConfig(sections)


def test_overrides_reach_the_traits():
    config = make_config(simulator={"heater_power": "extruder=60, chamber=9"})
    options = settings.SimOptions.from_config(config)
    assert thermal.choose_traits("extruder", options).power == 60.0
    assert thermal.choose_traits("heater_generic chamber", options).power == 9.0
    assert thermal.choose_traits("heater_bed", options) == thermal.BED


@pytest.mark.parametrize("kind", [
    "ATC Semitec 104GT-2", "Generic 3950", "PT1000", "AD595", "mine"])
def test_converter_is_the_sensors_own_curve(kind):
    config = settings.MachineConfig({
        "extruder": {"sensor_type": kind, "sensor_pin": "PA0"},
        "thermistor mine": {"temperature1": "25", "resistance1": "1e5",
                            "beta": "3950"}})
    converter = thermal.make_converter(config, config.get("extruder"))
    fraction = thermal.calc_fraction(converter, 200.0)
    assert converter.calc_temp(fraction) == pytest.approx(200.0, abs=1e-3)


def test_sensor_off_the_adc_has_no_converter():
    config = make_config(extruder={"sensor_type": "MAX31865"})
    assert thermal.make_converter(config, config.get("extruder")) is None
