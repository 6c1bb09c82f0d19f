# SPDX-License-Identifier: GPL-3.0-or-later
"""PID_CALIBRATE: find PID gains by a relay experiment.

The heater is switched so that the temperature swings around the target
(Astrom and Hagglund's relay).  Amplitude and period of the swing give the
ultimate gain and period, and Ziegler and Nichols' table the PID gains.
"""
import logging
import math

from klippy.extras import pid_profiles
from klippy.extras.control_pid import PARAMETER_BASE
from klippy.extras.pid_profile import Profile

SWING = 5.0
MIN_CYCLES = 12
STABLE_CYCLES = 4
PWM_TOLERANCE = 0.05


class PIDCalibrate:
    """The PID_CALIBRATE command."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.printer.lookup_object("gcode").register_command(
            "PID_CALIBRATE", self.cmd_PID_CALIBRATE,
            desc=self.cmd_PID_CALIBRATE_help)

    cmd_PID_CALIBRATE_help = "Run PID calibration test"

    def cmd_PID_CALIBRATE(self, gcmd):
        name = gcmd.get("HEATER")
        target = gcmd.get_float("TARGET")
        write_file = gcmd.get_int("WRITE_FILE", 0)
        tolerance = gcmd.get_float("TOLERANCE", PWM_TOLERANCE, above=0.0)
        profile = gcmd.get("PROFILE", pid_profiles.DEFAULT)
        heaters = self.printer.lookup_object("heaters")
        try:
            heater = heaters.lookup_heater(name)
        except self.printer.config_error as e:
            raise gcmd.error(str(e)) from e
        self.printer.lookup_object("toolhead").get_last_move_time()
        relay = self._run_relay(heaters, heater, target, tolerance)
        if write_file:
            relay.write_file("/tmp/heattest.txt")
        if relay.check_busy(0.0, 0.0, 0.0):
            raise gcmd.error("pid_calibrate interrupted")
        self._report(gcmd, heater, profile,
                     Profile("pid", relay.calc_final_pid(), target=target,
                             tolerance=tolerance))

    def _run_relay(self, heaters, heater, target, tolerance):
        relay = RelayControl(heater, target, tolerance)
        before = heater.set_control(relay)
        try:
            heaters.set_temperature(heater, target, True)
        finally:
            heater.set_control(before)
        return relay

    def _report(self, gcmd, heater, name, profile):
        logging.info("Autotune: final: Kp=%f Ki=%f Kd=%f", *profile.gains)
        gcmd.respond_info(
            "PID parameters: %s\n"
            "The SAVE_CONFIG command will update the printer config file\n"
            "with these parameters and restart the printer.\n"
            "PID_PROFILE LOAD=%s HEATER=%s has the heater work by them at once."
            % (pid_profiles.describe_gains(profile.gains), name, heater.short_name))
        heater.profiles.store(heater, name, profile)


class RelayControl:
    """Control that swings the temperature and records its peaks.

    The high power is adjusted from cycle to cycle so that heating and
    cooling take equally long: only then is the swing symmetric and the
    relay formula right.
    """

    def __init__(self, heater, target, tolerance=PWM_TOLERANCE):
        """tolerance: by how much (share of full power) the last cycles may differ."""
        self.heater, self.tolerance = heater, tolerance
        self.target = target
        self.max_power = self.high_power = heater.get_max_power()
        self.is_heating = False
        self.extreme = None
        self.peaks = []
        self.powers = []
        self.samples = []
        self.pwm_changes = []

    def note_hold(self, duration):
        """print_time stood still: the periods measured so far are wrong."""
        self.peaks = []

    def temperature_update(self, read_time, temp, target_temp):
        """Switch at target +-SWING/2 degC and note the peaks."""
        self.samples.append((read_time, temp))
        if self.is_heating and temp >= target_temp:
            self._turn(read_time, temp, False)
        elif not self.is_heating and temp <= target_temp:
            self._turn(read_time, temp, True)
        self._note_extreme(read_time, temp)
        self._set_power(read_time)

    def _turn(self, read_time, temp, is_heating):
        if self.extreme is not None:
            self.peaks.append(self.extreme)
        self.is_heating = is_heating
        self.extreme = (temp, read_time)
        self.heater.alter_target(
            self.target if is_heating else self.target - SWING)
        if is_heating and len(self.peaks) >= 4:
            self._balance_power()
        if is_heating:
            self.powers.append(self.high_power)

    def _note_extreme(self, read_time, temp):
        if self.extreme is None:
            return
        is_beyond = (temp < self.extreme[0] if self.is_heating
                     else temp > self.extreme[0])
        if is_beyond:
            self.extreme = (temp, read_time)

    def _set_power(self, read_time):
        power = self.high_power if self.is_heating else 0.0
        if not self.pwm_changes or self.pwm_changes[-1][1] != power:
            self.pwm_changes.append(
                (read_time + self.heater.get_pwm_delay(), power))
        self.heater.set_pwm(read_time, power)

    def _balance_power(self):
        """Set the high power to twice the mean of the last full cycle."""
        before, top, after = self.peaks[-3:]
        share = (top[1] - before[1]) / (after[1] - before[1])
        wanted = 2.0 * self.high_power * share
        self.high_power = min(max(wanted, 0.05), self.max_power)

    def check_busy(self, eventtime, smoothed_temp, target_temp):
        """True until enough equal cycles were seen."""
        if self.is_heating or len(self.peaks) < MIN_CYCLES:
            return True
        last = self.powers[-STABLE_CYCLES:]
        return max(last) - min(last) > self.tolerance * self.max_power \
            and len(self.peaks) < 3 * MIN_CYCLES

    def calc_final_pid(self):
        """(kp, ki, kd) in printer.cfg units; median of the last cycles."""
        first = len(self.peaks) - 2 * STABLE_CYCLES
        results = sorted(
            (self.peaks[i][1] - self.peaks[i - 2][1], i)
            for i in range(max(first, 2), len(self.peaks)))
        return self._calc_pid(results[len(results) // 2][1])

    def _calc_pid(self, index):
        (t0, time0), (t1, _), (t2, time2) = self.peaks[index - 2:index + 1]
        amplitude = 0.5 * abs(t1 - 0.5 * (t0 + t2))
        ultimate_gain = 4.0 * (0.5 * self.powers[-1]) / (math.pi * amplitude)
        period = time2 - time0
        kp = 0.6 * ultimate_gain * PARAMETER_BASE
        logging.info("Autotune: amplitude=%.3f degC Ku=%f Tu=%.3f s",
                     amplitude, ultimate_gain, period)
        return kp, kp / (0.5 * period), kp * 0.125 * period

    def write_file(self, filename):
        """Write all powers and samples for a look at the curve."""
        lines = ["pwm: %.3f %.3f" % change for change in self.pwm_changes]
        lines += ["%.3f %.3f" % sample for sample in self.samples]
        with open(filename, "w", encoding="utf-8") as f:
            f.write("\n".join(lines) + "\n")


def load_config(config):
    return PIDCalibrate(config)
