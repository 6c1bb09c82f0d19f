# SPDX-License-Identifier: GPL-3.0-or-later
"""Random heaters, printing for hours: what klippy.extras.heat_guard is judged by.

A heater here is a heating element in a block with a sensor on it, three
masses integrated by small steps (a bed has a plate besides, which people take
away and put on), in air that it may warm itself, so that no model of the host
is right about it.  Everything random comes from one seed.  Tests compile this
file together with the watch (heat_world.pxd, compiled_world.py); it runs
uncompiled as well.
"""
import array
import math
import random

PERIOD = 0.3
N_SUBSTEPS = 3
N_NOISE = 8192
PID, WATERMARK, MODEL = 0, 1, 2
# Faults
(HEALTHY, OPEN_HEATER, STUCK_ON, STUCK_SENSOR, STUCK_BELOW, FALLEN_OFF, SLOW_SENSOR,
 JUMPING, SHIFTED_UP, SHIFTED_DOWN, DRIFTING, CREEPING,
 CORRODING) = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12)
# K of a thermistor; its resistance is exp(THERMISTOR / T)
THERMISTOR, ZERO = 4000.0, 273.15
# degC below its target at which power is missed; that near it seems to be there
MISSED, NEAR = 3.0, 5.0
FILAMENT_HEAT = 0.0052          # W/K for a mm/s of 1.75 mm PLA


class Kind:
    """Typical values that a machine's are drawn around by 0.5 to 2.

    W, J/K, W/K, share of fan, s, s, degC ...
    """

    def __init__(self, power, capacity, loss, fan, lag, element_lag, low, high,
                 max_temp, is_hotend):
        self.power, self.capacity, self.loss = power, capacity, loss
        self.fan, self.lag, self.element_lag = fan, lag, element_lag
        self.low, self.high, self.max_temp = low, high, max_temp
        self.is_hotend = is_hotend
        # degC that a block may be off while its print is still good
        self.tolerance = 15.0 if is_hotend else 10.0


HOTEND = Kind(40.0, 10.0, 0.065, 0.8, 1.5, 2.0, 150.0, 270.0, 300.0, True)
BED = Kind(250.0, 700.0, 1.5, 0.1, 3.0, 8.0, 35.0, 110.0, 130.0, False)


class HeaterWorld:
    """One machine in one room, with its control and its day of printing."""

    def __init__(self, kind, seed, guard, control=None):
        """control: PID, WATERMARK or MODEL; any if None."""
        self.rng = rng = random.Random(seed)
        self.kind, self.guard = kind, guard
        self.is_hotend = kind.is_hotend
        self.noise = array.array("d", [rng.gauss(0.0, 1.0) for _ in range(N_NOISE)])
        self.noise_at = 0
        self.now = 0.0
        self.control = rng.choice((PID, PID, WATERMARK, MODEL))
        if control is not None:
            self.control = control
        self._draw_machine(kind)
        self.element = self.block = self.sensor = self.plate = self.ambient
        self.power_factor = self.draft = 1.0
        self.warmth = 0.0
        self.fan = self.flow = 0.0
        self.target = 0.0
        self.duty = self.next_duty = 0.0
        self.integral = self.slope = 0.0
        self.last = self.reading = self.sensor
        self.fault = HEALTHY
        self.fault_time = 0.0
        self.frozen = self.shift = 0.0
        self.creep_time = 1.0
        self.is_script = False
        self.next_fan = self.next_flow = self.next_supply = 0.0
        self.next_target = self.next_phase = self.next_plate = 0.0
        self.next_spike = self._draw_spike()
        self.is_printing = False
        self.hottest = self.block
        # s in which a cut was felt (all, longest), or the block was not what is shown
        self.withheld = self.worst_cut = self.cut_for = self.spoiled = 0.0

    def _draw(self, middle):
        return middle * 2.0 ** self.rng.uniform(-1.0, 1.0)

    def _draw_machine(self, kind):
        """Draw until full power is enough for its lowest target, whatever happens."""
        rng = self.rng
        while True:
            self.power, capacity = self._draw(kind.power), self._draw(kind.capacity)
            self.loss, self.fan_loss = self._draw(kind.loss), rng.uniform(0.0, kind.fan)
            self.base_ambient = self.ambient = rng.uniform(5.0, 40.0)
            self.highest = min(self._reach(), kind.high)
            if self.highest > kind.low + 5.0:
                break
        self.lag = self._draw(kind.lag)
        self.element_capacity = 0.1 * capacity
        self.capacity = 0.9 * capacity
        self.contact = self.element_capacity / self._draw(kind.element_lag)
        # some converters are so quiet that a reading repeats for minutes
        self.noise_level = rng.choice((0.0, 1.0, 1.0, 1.0)) * rng.uniform(0.01, 0.25)
        self.step = rng.uniform(0.02, 0.3)
        self.spike_time = rng.choice((0.0, 0.0, 7200.0, 1800.0))
        self.draft_time = rng.uniform(5.0, 200.0)
        self.max_flow = rng.uniform(0.0, 8.0) if self.is_hotend else 0.0
        # the air of an enclosure: degC that full power warms it by, s
        self.warming = rng.choice((0.0, 0.0, 1.0)) * rng.uniform(5.0, 35.0)
        self.warm_time = rng.uniform(600.0, 3600.0)
        self.has_plate = not self.is_hotend
        self.plate_capacity = rng.uniform(0.05, 0.2) * capacity
        self.plate_contact = self.plate_capacity / rng.uniform(20.0, 120.0)
        self._tune(rng)

    def _reach(self):
        """degC that the weakest supply holds in the worst draft, at 90 %."""
        worst = self.loss * 1.3 * (1.0 + self.fan_loss)
        flow = 8.0 * FILAMENT_HEAT if self.is_hotend else 0.0
        return self.ambient - 10.0 + 0.9 * 0.85 * self.power / (worst + flow)

    def _tune(self, rng):
        """A control of some kind, tuned more or less well."""
        rate = self.power / (self.capacity + self.element_capacity)
        delay = self.lag + self.element_capacity / self.contact + 0.3
        quality = 2.0 ** rng.uniform(-1.0, 0.5)
        self.kp = quality / (2.0 * rate * delay)
        self.ki = self.kp / (8.0 * delay)
        self.kd = self.kp * 0.5 * delay * rng.uniform(0.0, 1.0)
        self.feed = self.loss / self.power * rng.uniform(0.7, 1.3)

    # The day

    def _plan(self):
        """What somebody does with the printer."""
        rng, now = self.rng, self.now
        if self.is_script:
            return 0
        if now >= self.next_phase:
            self.is_printing = not self.is_printing and now > 0.0
            self.next_phase = now + (rng.uniform(600.0, 7200.0) if self.is_printing
                                     else rng.uniform(30.0, 1800.0))
            self.target = self._choose_target() if self.is_printing else 0.0
            self.next_target = now + rng.uniform(300.0, 3600.0)
        if self.is_printing and now >= self.next_target:
            self.next_target = now + rng.uniform(60.0, 3600.0)
            self.target = self._choose_target()
        if now >= self.next_fan:
            self.next_fan = now + rng.uniform(3.0, 300.0)
            self.fan = rng.choice((0.0, 0.3, 0.5, 1.0, rng.random()))
        if now >= self.next_flow:
            self.next_flow = now + rng.uniform(0.5, 30.0)
            hot = self.is_printing and self.block > 150.0
            self.flow = rng.uniform(0.0, self.max_flow) * (rng.random() < 0.7) * hot
        if now >= self.next_supply:
            self.next_supply = now + rng.uniform(20.0, 3000.0)
            self.power_factor = rng.uniform(0.85, 1.0)
        if not self.is_hotend and now >= self.next_plate:
            self.next_plate = now + rng.uniform(600.0, 7200.0)
            self._move_plate()
        return 0

    def _move_plate(self):
        """Take the plate away, or put on a cold or a warm one."""
        self.has_plate = not self.has_plate
        self.plate = self.ambient + self.rng.random() * (self.block - self.ambient)
        return 0

    def _choose_target(self):
        return self.rng.uniform(self.kind.low, self.highest)

    def _get_noise(self):
        self.noise_at = (self.noise_at + 1) % N_NOISE
        if self.noise_at == 0:
            self.noise_at = int(self.rng.random() * N_NOISE)
        return self.noise[self.noise_at]

    def _stir(self):
        """Air and room change."""
        share = PERIOD / self.draft_time
        self.draft += (1.0 - self.draft) * share + 0.2 * math.sqrt(share) \
            * self._get_noise()
        self.draft = min(max(self.draft, 0.7), 1.3)
        self.ambient += (self.base_ambient - self.ambient) * PERIOD / 2000.0 \
            + 0.01 * self._get_noise()
        # a moving average of the power warms the enclosure
        self.warmth += (self.warming * self.duty - self.warmth) \
            * PERIOD / self.warm_time
        return 0

    def _draw_spike(self):
        """Time of the next wrong reading."""
        if not self.spike_time:
            return 1e12
        return self.now + self.rng.expovariate(1.0 / self.spike_time)

    # Physics

    def _heat(self):
        duty = 0.0 if self.fault == OPEN_HEATER else self.duty
        if self.fault == STUCK_ON:
            duty = 1.0
        watts = duty * self.power * self.power_factor
        losses = self.loss * self.draft * (1.0 + self.fan_loss * self.fan) \
            + self.flow * FILAMENT_HEAT
        dt = PERIOD / N_SUBSTEPS
        seen, lag = self.block, self.lag
        air = self.ambient + self.warmth
        down = 0.0
        for _ in range(N_SUBSTEPS):
            across = self.contact * (self.element - self.block)
            self.element += (watts - across) / self.element_capacity * dt
            if self.has_plate:
                down = self.plate_contact * (self.block - self.plate)
                self.plate += down / self.plate_capacity * dt
            self.block += (across - down - losses * (self.block - air)) \
                / self.capacity * dt
            seen = self.block
            if self.fault == FALLEN_OFF:
                seen = self.ambient + 0.2 * (self.block - self.ambient)
                lag = 4.0 * self.lag
            elif self.fault == CREEPING:
                share = max(1.0 - (self.now - self.fault_time) / self.creep_time, 0.0)
                seen = self.ambient + (0.2 + 0.8 * share) * (self.block - self.ambient)
                lag = (4.0 - 3.0 * share) * self.lag
            elif self.fault == SLOW_SENSOR:
                lag = 15.0 * self.lag
            self.sensor += (seen - self.sensor) / lag * dt
        self.hottest = max(self.hottest, self.block)
        return 0

    def _read(self):
        """What the sensor shows, with noise, steps and faults."""
        temp = self.sensor + self.noise_level * self._get_noise()
        fault, since = self.fault, self.now - self.fault_time
        if fault in (STUCK_SENSOR, STUCK_BELOW):
            temp = self.frozen + self.noise_level * self._get_noise()
        elif fault == SHIFTED_UP:
            temp += 35.0
        elif fault == SHIFTED_DOWN:
            temp -= 35.0
        elif fault == DRIFTING:
            temp -= self.shift * since
        elif fault == CORRODING:
            # a contact as large as the thermistor was when it began, many times
            ohms = math.exp(THERMISTOR / (temp + ZERO)) + 10.0 * since \
                / self.creep_time * math.exp(THERMISTOR / (self.frozen + ZERO))
            temp = THERMISTOR / math.log(ohms) - ZERO
        elif fault == JUMPING and self._get_noise() > 0.3:
            temp -= 40.0
        if self.now >= self.next_spike:
            self.next_spike = self._draw_spike()
            temp += self.rng.uniform(-40.0, 40.0)
        self.reading = math.floor(temp / self.step + 0.5) * self.step
        return 0

    def _keep_account(self):
        """Of power that was missed, and of a block that is not as hot as it seems."""
        target = self.target
        if target <= 0.0:
            self.cut_for = 0.0
            return 0
        if self.guard.is_cut and self.reading < target - MISSED:
            self.withheld += PERIOD
            self.cut_for += PERIOD
            self.worst_cut = max(self.worst_cut, self.cut_for)
        elif not self.guard.is_cut:
            self.cut_for = 0.0
        if (abs(self.reading - target) < NEAR
                and abs(self.block - target) > self.kind.tolerance):
            self.spoiled += PERIOD
        return 0

    def set_fault(self, fault):
        """Have something break now."""
        self.fault, self.fault_time = fault, self.now
        self.frozen = self.reading
        if fault == STUCK_BELOW:
            self.frozen = self.target - 4.0
        self.shift = self.rng.uniform(0.1, 0.5)
        self.creep_time = 300.0 * 8.0 ** self.rng.random()
        return 0

    # Control

    def _control(self):
        temp, target = self.reading, self.target
        weight = min(PERIOD, 1.0)
        self.slope += weight * ((temp - self.last) / PERIOD - self.slope)
        self.last = temp
        error = target - temp
        if target <= 0.0:
            self.integral = 0.0
            wanted = 0.0
        elif self.control == WATERMARK:
            wanted = self.duty
            if error > 2.0:
                wanted = 1.0
            elif error < -2.0:
                wanted = 0.0
        else:
            base = 0.0 if self.control == PID else self.feed * (target - 25.0)
            wanted = base + self.kp * error - self.kd * self.slope + self.integral
            if 0.0 < wanted < 1.0:
                self.integral += self.ki * error * PERIOD
        self.duty = self.next_duty
        if self.guard.is_cut:
            wanted = 0.0
        if 0.0 < wanted < 1.0:
            wanted += self.guard.offset
        self.next_duty = min(max(wanted, 0.0), 1.0)
        return 0

    def run(self, seconds):
        """Go on; fault code of the guard, or 0 after so many s."""
        end = self.now + seconds
        guard = self.guard
        while self.now < end:
            self.now += PERIOD
            self._plan()
            self._stir()
            self._heat()
            self._read()
            self._keep_account()
            acted, target = self.duty, self.target
            self._control()
            fan = self.fan if self.is_hotend else 0.0
            code = guard.update(PERIOD, self.reading, target, acted, fan,
                                self.flow * FILAMENT_HEAT / 25.0)
            if code:
                return code
        return 0
