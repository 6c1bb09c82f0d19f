# SPDX-License-Identifier: GPL-3.0-or-later
"""Controls and relay tuning in closed loop with the thermal model."""
import pytest

from klippy.extras import control_pid, control_watermark, pid_calibrate
from klippy.simulator import settings, thermal

PERIOD = 0.3


class Plant:
    """The heater's side of a control: takes power, has a thermal model."""

    def __init__(self, traits=thermal.HOTEND, max_power=1.0):
        self.model = thermal.HeaterModel(traits, 25.0)
        self.max_power = max_power
        self.power = 0.0
        self.target = 0.0
        self.now = 10.0
        self.powers = []

    def get_max_power(self):
        return self.max_power

    def get_smooth_time(self):
        return 1.0

    def get_pwm_delay(self):
        return PERIOD

    def set_pwm(self, read_time, value):
        self.power = value if self.target > 0.0 else 0.0

    def alter_target(self, target):
        self.target = target

    def run(self, control, seconds):
        """Yield the sensor's temperature every report."""
        for _ in range(round(seconds / PERIOD)):
            temp = self.model.sensor_temperature
            power = self.power
            control.temperature_update(self.now, temp, self.target)
            self.model.advance(PERIOD, power)
            self.now += PERIOD
            self.powers.append(self.power)
            yield temp


def make_section(**options):
    return settings.Section("extruder", options)


def make_pid(plant, kp=22.2, ki=1.08, kd=114.0):
    return control_pid.ControlPID(plant, make_section(
        pid_kp=str(kp), pid_ki=str(ki), pid_kd=str(kd)))


def test_watermark_keeps_its_band():
    plant = Plant(thermal.BED)
    control = control_watermark.ControlBangBang(
        plant, make_section(max_delta="2"))
    plant.target = 60.0
    temps = list(plant.run(control, 1200.0))[-2000:]
    assert 56.0 < min(temps) < 58.5
    assert 61.5 < max(temps) < 64.0
    assert not control.check_busy(plant.now, 59.0, 60.0)
    assert control.check_busy(plant.now, 57.0, 60.0)


def test_pid_settles_on_the_target_without_windup():
    plant = Plant()
    control = make_pid(plant)
    plant.target = 210.0
    temps = list(plant.run(control, 300.0))
    assert max(temps) < 218.0
    assert all(abs(t - 210.0) < 0.5 for t in temps[-200:])
    assert not control.check_busy(plant.now, temps[-1], 210.0)
    assert 0.0 <= min(plant.powers) and max(plant.powers) <= 1.0


def test_pid_respects_max_power():
    plant = Plant(max_power=0.6)
    plant.target = 150.0
    list(plant.run(make_pid(plant), 60.0))
    assert max(plant.powers) == pytest.approx(0.6)


def test_pid_without_target_gives_no_power():
    plant = Plant()
    control = make_pid(plant)
    list(plant.run(control, 5.0))
    assert set(plant.powers) == {0.0}
    assert control.integral == 0.0


@pytest.mark.parametrize("traits,target", [
    (thermal.HOTEND, 200.0), (thermal.BED, 60.0)])
def test_relay_tuning_gives_gains_that_control_well(traits, target):
    plant = Plant(traits)
    relay = pid_calibrate.RelayControl(plant, target)
    plant.target = target
    for _ in plant.run(relay, 7200.0):
        if not relay.check_busy(plant.now, 0.0, 0.0):
            break
    assert not relay.check_busy(plant.now, 0.0, 0.0)
    kp, ki, kd = relay.calc_final_pid()
    assert min(kp, ki, kd) > 0.0
    tuned = Plant(traits)
    tuned.target = target
    temps = list(tuned.run(make_pid(tuned, kp, ki, kd), 1500.0))
    assert all(abs(t - target) < 0.5 for t in temps[-500:])
    assert max(temps) < target + 0.12 * (target - 25.0)
