# SPDX-License-Identifier: GPL-3.0-or-later
"""Temperature control by a model of the heater (`control: mpc`).

An observer follows block and sensor through the model, corrected by each
reading; what the model does not know of (a weak supply, a draft) shows as a
steady difference and is put into the ambient temperature, so that there is
no lasting error.  The power is what brings the block to the target within
target_reach_time and pays for the losses to air, fan and filament, as they
will be when that power acts.
"""
import math

from klippy.extras.heater_surroundings import HeaterSurroundings
from klippy.extras.mpc_options import FilamentTraits, MpcParameters, MpcTuning
from klippy.extras.thermal_model import (
    ThermalModel,
    calc_filament_transfer,
    interpolate_transfer,
)

SETTLED_DELTA = 1.0
# A room that is warmer (degC) is a heater that has not cooled down
MAX_ROOM, USUAL_ROOM = 45.0, 25.0
# The ambient temperature stays within this of the room (degC)
AMBIENT_RANGE = 400.0
# It is learned in this time (s), or so many lags of the sensor
LEARN_TIME, LEARN_LAGS = 6.0, 6.0
# Differences (degC) below this are noise
NOISE = 0.05
# A gap (s) between readings after which the model starts anew
MAX_GAP = 10.0


class ControlMPC:
    """Predictive control of one heater; see docs/heater_model.md."""

    def __init__(self, heater, config):
        self.heater = heater
        self.max_power = heater.get_max_power()
        self.tuning = MpcTuning.from_config(config)
        self.parameters = MpcParameters.from_config(config)
        self.filament = FilamentTraits.from_config(config)
        self.fan_name = config.get("cooling_fan", None)
        self.surroundings = HeaterSurroundings(
            config, self.fan_name, config.get("ambient_temp_sensor", None),
            self.tuning.max_retract)
        self.surroundings.lead_time = heater.get_pwm_delay()
        if self.filament.temp_source == "sensor" and not config.get(
                "ambient_temp_sensor", None):
            raise config.error(
                "filament_temperature_source: sensor in section '%s' needs an"
                " ambient_temp_sensor" % (config.get_name(),))
        self.model = None
        self.room = USUAL_ROOM
        self.has_room = False
        self.last_time = self.slope = self.last_temp = 0.0
        self.last_target = 0.0
        self.duty = self.last_power = 0.0
        self.pending = []                # (print_time, duty) to come
        self.apply_parameters(self.parameters)
        from klippy.extras import mpc_calibrate, mpc_set
        mpc_calibrate.MpcCalibrate(config, heater, self)
        mpc_set.MpcSet(config, heater, self)

    # What is known of the heater

    def apply_parameters(self, parameters):
        """Control by other MpcParameters from the next reading on."""
        self.parameters = parameters
        if parameters.list_missing():
            self.model = None
            return
        model = ThermalModel(self.tuning.power, parameters.capacity,
                             parameters.responsiveness, parameters.transfer)
        if self.model is None:
            model.reset(self.last_temp, self.room)
        else:
            model.block, model.sensor = self.model.block, self.model.sensor
            model.ambient = self.room
        self.model = model

    def explain_unready(self):
        """Why no target can be set; None when one can."""
        missing = self.parameters.list_missing()
        if not missing:
            return None
        return ("%s of heater '%s' is not known: run MPC_CALIBRATE HEATER=%s"
                % (" and ".join(missing), self.heater.short_name,
                   self.heater.short_name))

    def begin(self, read_time, temp):
        """Another control led to this reading (print_time, degC)."""
        self.last_time, self.last_temp = read_time, temp
        self.slope, self.pending = 0.0, []
        self.duty = self.heater.last_pwm_value
        if self.model is not None:
            self.model.reset(temp, self.room)

    def note_hold(self, duration):
        """print_time stood still for so many s."""
        self.last_time -= duration
        self.pending = [(time - duration, duty) for time, duty in self.pending]

    # Readings

    def temperature_update(self, read_time, temp, target_temp):
        """Answer a reading (degC) with a power for the heater."""
        elapsed = read_time - self.last_time
        self._note_room(temp, target_temp)
        if self.model is None:
            self.heater.set_pwm(read_time, 0.0)
        elif not 0.0 < elapsed < MAX_GAP:
            self.model.reset(temp, self.room)
            self.slope = 0.0
            self.heater.set_pwm(read_time, 0.0)
        else:
            self._observe(read_time, elapsed, temp, target_temp)
            duty = self._calc_duty(read_time, target_temp)
            self.heater.set_pwm(read_time, duty)
            self._note_duty(read_time)
        self.last_time, self.last_temp = read_time, temp

    def _note_room(self, temp, target_temp):
        """The room is where the heater was coldest, unless a sensor knows."""
        if self.surroundings.room is not None:
            self.room = self.surroundings.room
            return
        if target_temp or temp >= (self.room if self.has_room else MAX_ROOM):
            return
        self.room, self.has_room = temp, True

    def _observe(self, read_time, elapsed, temp, target_temp):
        model = self.model
        self._set_losses()
        self._predict(model, self.last_time, read_time)
        share = 1.0 - (1.0 - self.tuning.smoothing) ** elapsed
        error = temp - model.sensor
        weight = min(elapsed, 1.0)
        self.slope += weight * ((temp - self.last_temp) / elapsed - self.slope)
        if target_temp and not self.last_target:
            model.ambient = self.room
        self.last_target = target_temp
        shift = self._calc_ambient_shift(error, share, elapsed, target_temp)
        model.correct(share * error, share * error, shift)

    def _calc_ambient_shift(self, error, share, elapsed, target_temp):
        """Degrees by which the ambient temperature is to change."""
        is_steady = abs(self.slope) < self.tuning.steady_state_rate
        is_free = 0.0 < self.duty < self.max_power
        model = self.model
        transfer = model.transfer + model.extra_transfer
        if not (target_temp and is_steady and is_free and transfer):
            return 0.0
        learn_time = max(LEARN_TIME, LEARN_LAGS / model.responsiveness)
        shift = error * share * model.capacity / (transfer * learn_time)
        least = self.tuning.min_ambient_change * elapsed
        if abs(error) > NOISE and abs(shift) < least:
            shift = math.copysign(least, error)
        low, high = self.room - AMBIENT_RANGE, self.room + AMBIENT_RANGE
        return min(max(model.ambient + shift, low), high) - model.ambient

    def _set_losses(self):
        around, traits = self.surroundings, self.filament
        fan = interpolate_transfer(self.parameters.fan_transfers, around.fan_speed)
        flow = calc_filament_transfer(around.filament_speed, traits.diameter,
                                      traits.density, traits.heat_capacity)
        self.model.set_losses(fan, flow, self.get_filament_temp())

    def get_filament_temp(self):
        """degC of filament that comes in."""
        if isinstance(self.filament.temp_source, float):
            return self.filament.temp_source
        return self.room

    # Power

    def _predict(self, model, start, end):
        """Go from one print_time to a later one with the powers that act then."""
        while self.pending and self.pending[0][0] < end:
            time, duty = self.pending[0]
            if time > start:
                model.predict(time - start, self.duty)
                start = time
            self.duty = duty
            self.pending.pop(0)
        if end > start:
            model.predict(end - start, self.duty)

    def _calc_duty(self, read_time, target_temp):
        if not target_temp:
            self.last_power = 0.0
            return 0.0
        model = self.model
        block = self._look_ahead(read_time)
        self.last_power = (
            model.capacity * (target_temp - block) / self.tuning.target_reach_time
            + model.calc_loss(block) + model.calc_filament_loss(block))
        return min(max(self.last_power / model.power, 0.0), self.max_power)

    def _look_ahead(self, read_time):
        """Block temperature when a power that is set now begins to act."""
        model = self.model
        states = model.block, model.sensor, self.duty, list(self.pending)
        self._predict(model, read_time, read_time + self.heater.get_pwm_delay())
        block = model.block
        model.block, model.sensor, self.duty, self.pending = states
        return block

    def _note_duty(self, read_time):
        """Remember what the heater made of the power asked for."""
        duty = self.heater.last_pwm_value
        planned = self.pending[-1][1] if self.pending else self.duty
        if duty != planned:
            self.pending.append((read_time + self.heater.get_pwm_delay(), duty))

    # What others ask

    def check_busy(self, eventtime, smoothed_temp, target_temp):
        """True until the temperature is at the target and steady."""
        if abs(target_temp - smoothed_temp) > SETTLED_DELTA:
            return True
        return (self.model is not None
                and abs(self.model.block - target_temp) > SETTLED_DELTA)

    def get_stats(self):
        """Status field control_stats: degC and W."""
        model = self.model
        if model is None:
            return None
        source = self.filament.temp_source
        return {
            "temp_block": round(model.block, 2),
            "temp_sensor": round(model.sensor, 2),
            "temp_ambient": round(model.ambient, 2),
            "power": round(self.duty * model.power, 3),
            "loss_ambient": round(model.calc_loss(model.block), 3),
            "loss_filament": round(model.calc_filament_loss(model.block), 3),
            "filament_temp": [source if isinstance(source, str) else "value",
                              round(self.get_filament_temp(), 2)],
            "filament_heat_capacity": self.filament.heat_capacity,
            "filament_density": self.filament.density}
