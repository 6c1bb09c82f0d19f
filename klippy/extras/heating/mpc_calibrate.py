# SPDX-License-Identifier: GPL-3.0-or-later
"""MPC_CALIBRATE: one run that measures a heater for `control: mpc`.

The heater rests, climbs with full power to the target, and is held there,
once for each speed of the fan.  Rest, climb and first hold are a record in
which the parameters are found (mpc_fit); each hold gives the transfer at its
fan speed by the balance of its energy.
"""

import logging

from klippy.extras import mpc_fit
from klippy.extras.mpc_options import MpcParameters, calc_fan_share
from klippy.record import record

BED_TARGET, OTHER_TARGET, MIN_TARGET = 90.0, 200.0, 60.0
# The target stays so far below max_temp (degC)
HEADROOM = 10.0
MAX_FAN_STEPS = 20
# A rest is over when a sample differs from the last by less (degC)
REST_CHANGE = 0.2
# A hold settles and is measured for this share of the heater's time constant
HOLD_SHARE, MIN_HOLD, MAX_HOLD = 0.3, 30.0, 300.0
# A record that the model misses by more than this share of its climb is none
MAX_ERROR = 0.03


@record(frozen=True)
class Plan:
    """Parameters of one run: degC, s."""

    target: float
    threshold: float
    rest_time: float
    sample_time: float
    fan_steps: int

    @classmethod
    def from_command(cls, gcmd, heater):
        is_bed = heater.short_name == "heater_bed"
        target = gcmd.get_float("TARGET", BED_TARGET if is_bed else OTHER_TARGET,
                                minval=MIN_TARGET)
        highest = heater.max_temp - HEADROOM
        if target > highest:
            raise gcmd.error(
                "TARGET=%.1f is too high: it must be %.0f degrees below the max_temp"
                " of heater '%s', at most %.1f"
                % (target, HEADROOM, heater.short_name, highest))
        rest_time = gcmd.get_float("AMBIENT_MAX_MEASURE_TIME", 20.0, above=0.0)
        return cls(
            target,
            gcmd.get_float("THRESHOLD", max(50.0, min(100.0, target - 100.0))),
            rest_time,
            gcmd.get_float("AMBIENT_MEASURE_SAMPLE_TIME", min(5.0, 0.5 * rest_time),
                           above=0.0, below=rest_time),
            gcmd.get_int("FAN_BREAKPOINTS", 3, minval=2, maxval=MAX_FAN_STEPS))


class RecordingControl:
    """Control that notes what it does; full_power or inner decides.

    record: (s since the reading before, duty meanwhile, degC).
    """

    def __init__(self, heater):
        self.heater = heater
        self.record = []
        self.full_power = False
        self.inner = None
        self.last_time = None
        self.acting = []                 # (print_time, duty)
        self.is_broken = False

    def note_hold(self, duration):
        """print_time stood still: what was recorded is of no use."""
        self.is_broken = True

    def temperature_update(self, read_time, temp, target_temp):
        """Take a reading (degC), set the power of the phase."""
        if self.last_time is not None:
            self._note(read_time, temp)
        self.last_time = read_time
        if self.inner is not None:
            self.inner.temperature_update(read_time, temp, target_temp)
        else:
            power = self.heater.get_max_power() if self.full_power else 0.0
            self.heater.set_pwm(read_time, power)
        self.acting.append((read_time + self.heater.get_pwm_delay(),
                            self.heater.last_pwm_value))

    def _note(self, read_time, temp):
        """Mean duty between two readings, from the changes that fell there."""
        elapsed = read_time - self.last_time
        heat, start, duty = 0.0, self.last_time, 0.0
        while self.acting and self.acting[0][0] <= start:
            duty = self.acting.pop(0)[1]
        current = duty
        for time, value in self.acting:
            if time >= read_time:
                break
            heat += (time - start) * current
            start, current = time, value
        heat += (read_time - start) * current
        # what acts now must be found by the next reading again
        self.acting.insert(0, (self.last_time, duty))
        self.record.append((elapsed, heat / elapsed, temp))

    def check_busy(self, eventtime, smoothed_temp, target_temp):
        """Never: the run waits for its own conditions."""
        return False


class MpcCalibrate:
    """The command of one heater."""

    def __init__(self, config, heater, control):
        self.printer = config.get_printer()
        self.heater, self.control = heater, control
        self.printer.lookup_object("gcode").register_mux_command(
            "MPC_CALIBRATE", "HEATER", heater.short_name, self.cmd_MPC_CALIBRATE,
            desc=self.cmd_MPC_CALIBRATE_help)

    cmd_MPC_CALIBRATE_help = "Measure a heater for control by its model"

    def cmd_MPC_CALIBRATE(self, gcmd):
        plan = Plan.from_command(gcmd, self.heater)
        self.printer.lookup_object("toolhead").get_last_move_time()
        recorder = RecordingControl(self.heater)
        parameters = self.control.parameters
        before = self.heater.set_control(recorder)
        fan = self._get_fan()
        fan_speed = 0.0 if fan is None else fan.last_speed
        try:
            fit, transfers = self._measure(gcmd, plan, recorder, fan)
            parameters = MpcParameters(
                fit.capacity, fit.responsiveness, transfers[0],
                calc_fan_share(transfers) if fan is not None else ())
        finally:
            self.heater.set_control(before)
            with self.heater.lock:
                self.control.apply_parameters(parameters)
            if fan is not None:
                fan.set_speed(fan_speed)
        self._report(gcmd, parameters, fit)

    def _get_fan(self):
        owner = self.control.surroundings.fan
        return None if owner is None else owner.fan

    # The phases of a run

    def _measure(self, gcmd, plan, recorder, fan):
        """(Fit, W/K for each fan speed)."""
        if fan is not None:
            fan.set_speed(0.0)
        self._rest(gcmd, plan, recorder)
        fit = self._climb(gcmd, plan, recorder)
        speeds = [0.0]
        if fan is not None:
            speeds = [i / (plan.fan_steps - 1) for i in range(plan.fan_steps)]
        holds = []
        for speed in speeds:
            if fan is not None:
                fan.set_speed(speed)
            holds.append(self._hold(gcmd, recorder, fit))
            if not speed:
                fit = self._fit(gcmd, recorder, fit)
                gcmd.respond_info("Measured at %.1f degrees" % (plan.target,))
            else:
                gcmd.respond_info("Measured with the fan at %.0f %%" % (100 * speed,))
        self._set_temp(0.0)
        return fit, [self._calc_transfer(fit, hold) for hold in holds]

    def _rest(self, gcmd, plan, recorder):
        """Let the heater cool below the threshold, then watch it rest."""
        reactor = self.printer.get_reactor()
        gcmd.respond_info("Waiting for heater '%s' to be below %.0f degrees"
                          % (self.heater.short_name, plan.threshold))
        self._wait(gcmd, recorder, lambda now: (
            not recorder.record or recorder.record[-1][2] > plan.threshold))
        del recorder.record[:]
        end = reactor.monotonic() + plan.rest_time
        samples = []

        def is_restless(now):
            if now >= end or not recorder.record:
                return now < end
            if not samples or now - samples[-1][0] >= plan.sample_time:
                samples.append((now, recorder.record[-1][2]))
                if len(samples) > 2:
                    return abs(samples[-1][1] - samples[-2][1]) > REST_CHANGE
            return True
        self._wait(gcmd, recorder, is_restless)

    def _climb(self, gcmd, plan, recorder):
        """Heat with full power; Fit of what was seen."""
        gcmd.respond_info("Heating to %.1f degrees with full power" % (plan.target,))
        recorder.full_power = True
        self._set_temp(plan.target)
        self._wait(gcmd, recorder, lambda now: recorder.record[-1][2] < plan.target)
        try:
            guess = mpc_fit.guess_heater(self.control.tuning.power, recorder.record)
        except ValueError as e:
            raise gcmd.error("MPC_CALIBRATE failed: %s" % (e,)) from e
        return self._fit(gcmd, recorder, mpc_fit.Fit(*guess, 0.0))

    def _fit(self, gcmd, recorder, start):
        record = list(recorder.record)
        try:
            fit = mpc_fit.fit_heater(
                self.control.tuning.power, record,
                (start.capacity, start.responsiveness, start.transfer, start.ambient),
                self.control.surroundings.room)
        except (ValueError, ZeroDivisionError, OverflowError) as e:
            raise gcmd.error("MPC_CALIBRATE failed: no model fits (%s)" % (e,)) from e
        temps = [temp for _, _, temp in record]
        logging.info("MPC_CALIBRATE %s: %s", self.heater.short_name, fit)
        if fit.error > MAX_ERROR * (max(temps) - min(temps)):
            raise gcmd.error(
                "MPC_CALIBRATE failed: the model misses the measured temperatures by"
                " %.1f degrees. Is the sensor of heater '%s' tight in its block?"
                % (fit.error, self.heater.short_name))
        return fit

    def _hold(self, gcmd, recorder, fit):
        """Hold the target by the Fit; the part of the record that counts."""
        span = HOLD_SHARE * fit.capacity / max(fit.transfer, 1e-6)
        span = min(max(span, MIN_HOLD), MAX_HOLD)
        if recorder.inner is None:
            with self.heater.lock:
                self.control.apply_parameters(MpcParameters(
                    fit.capacity, fit.responsiveness, fit.transfer))
                recorder.inner = self.control
        reactor = self.printer.get_reactor()
        settled = reactor.monotonic() + span
        self._wait(gcmd, recorder, lambda now: now < settled)
        first = len(recorder.record)
        end = settled + span
        self._wait(gcmd, recorder, lambda now: now < end)
        return recorder.record[first:]

    def _calc_transfer(self, fit, hold):
        """W/K to the air while a part of the record was made."""
        seconds = sum(elapsed for elapsed, _, _ in hold)
        heat = sum(elapsed * duty for elapsed, duty, _ in hold)
        mean = sum(elapsed * temp for elapsed, _, temp in hold) / seconds
        edge = max(len(hold) // 8, 1)
        gain = (sum(temp for _, _, temp in hold[-edge:])
                - sum(temp for _, _, temp in hold[:edge])) / edge
        # from the middle of the first part to that of the last one
        gain *= len(hold) / max(len(hold) - edge, 1)
        heat = heat * self.control.tuning.power - fit.capacity * gain
        return max(heat / seconds / (mean - fit.ambient), 0.0)

    # Helpers

    def _set_temp(self, degrees):
        self.printer.lookup_object("toolhead").get_last_move_time()
        with self.heater.lock:
            self.heater.alter_target(degrees)

    def _wait(self, gcmd, recorder, is_busy):
        heaters = self.printer.lookup_object("heaters")
        ended = not heaters.wait_while(is_busy)
        if ended or self.printer.is_shutdown() or not recorder.record:
            raise gcmd.error("MPC_CALIBRATE was ended")
        if recorder.is_broken:
            raise gcmd.error("MPC_CALIBRATE failed: the host was away meanwhile")

    def _report(self, gcmd, parameters, fit):
        options = parameters.list_options()
        gcmd.respond_info(
            "Measured values of heater '%s', in use now (room: %.1f degrees):\n%s\n"
            "The SAVE_CONFIG command will put them into the printer config file\n"
            "and restart the printer." % (
                self.heater.short_name, fit.ambient,
                "\n".join("%s: %s" % item for item in options)))
        configfile = self.printer.lookup_object("configfile")
        configfile.set(self.heater.name, "control", "mpc")
        for option, value in options:
            configfile.set(self.heater.name, option, value)
        self.heater.profiles.note_measured(self.heater, parameters)
