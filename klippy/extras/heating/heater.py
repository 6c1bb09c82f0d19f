# SPDX-License-Identifier: GPL-3.0-or-later
"""One heater: a sensor, a pwm pin and the control between them.

Readings arrive on the mcu response thread; targets are set and read on
the main thread.  Both hold `lock` while they touch shared fields.
"""

import threading

from klippy.extras import control_mpc, control_pid, control_watermark
from klippy.mcu import absence
from klippy.record import record, replace

ABSOLUTE_ZERO = -273.15
# The mcu turns a heater off by itself this long after the last update.
MAX_HEAT_TIME = 5.0
# The output is renewed at this fraction of MAX_HEAT_TIME.
RENEW_FRACTION = 0.1
SMALL_POWER_CHANGE = 0.05
# A reading older than this is not shown as a temperature.
STALE_READING = 7.0
# After the mcu turned a heater off printing waits for a temperature so far
# (degC) below the target.
REHEAT_DROP = 4.0
# Without a sign of the main thread for this long heating stops.
MAIN_THREAD_TIMEOUT = 5.0

CONTROLS = {"watermark": control_watermark.ControlBangBang,
            "pid": control_pid.ControlPID,
            "mpc": control_mpc.ControlMPC}


@record(frozen=True)
class HeaterLimits:
    """Options of a heater (degC, fraction, s)."""

    min_temp: float
    max_temp: float
    min_extrude_temp: float
    max_power: float
    smooth_time: float
    pwm_cycle_time: float

    @classmethod
    def from_config(cls, config, report_time):
        low = config.getfloat("min_temp", minval=ABSOLUTE_ZERO)
        high = config.getfloat("max_temp", above=low)
        # MAX_HEAT_TIME bounds the time without updates, whatever their number
        config.getint("lost_update_tolerance", 2, minval=0)
        return cls(
            low, high,
            config.getfloat("min_extrude_temp", min(max(170.0, low), high),
                            minval=low, maxval=high),
            config.getfloat("max_power", 1.0, above=0.0, maxval=1.0),
            config.getfloat("smooth_time", 1.0, above=0.0),
            config.getfloat("pwm_cycle_time", 0.100, above=0.0,
                            maxval=report_time))


class Heater:
    """Heater of any kind; status: temperature, target, power, pid_profile."""

    def __init__(self, config, sensor):
        self.printer = config.get_printer()
        self.name = config.get_name()
        self.short_name = self.name.split()[-1]
        self.sensor = sensor
        self.lock = threading.Lock()
        report_time = sensor.get_report_time_delta()
        self.limits = HeaterLimits.from_config(config, report_time)
        self.min_temp = self.limits.min_temp
        self.max_temp = self.limits.max_temp
        self.pwm_delay = report_time
        sensor.setup_minmax(self.min_temp, self.max_temp)
        sensor.setup_callback(self.temperature_callback)
        start_args = self.printer.get_start_args()
        is_batch = start_args.get("debugoutput") is not None
        self.last_temp = self.smoothed_temp = self.target_temp = 0.0
        self.is_batch, self.is_cold_allowed = is_batch, False
        self.can_extrude = self._may_extrude()
        self.last_temp_time = 0.0
        self.next_pwm_time = self.last_pwm_value = 0.0
        self.main_thread_until = -999.0
        self.is_shutdown = False
        self.n_expired = 0
        self.reading_callbacks = []
        # of heater_watchdog's probe: added to a power between off and full
        self.duty_offset = 0.0
        # by heater_watchdog, until the reading shows that it follows
        self.is_cut = False
        self.n_cuts = 0
        kind = config.getchoice("control", {name: name for name in CONTROLS})
        self.control = CONTROLS[kind](self, config)
        self.mcu_pwm = self._setup_pin(config)
        self.mcus = self._watch_mcus()
        self._register(config)

    def _setup_pin(self, config):
        ppins = self.printer.lookup_object("pins")
        pin = ppins.setup_pin("pwm", config.get("heater_pin"))
        pin.setup_cycle_time(self.limits.pwm_cycle_time)
        pin.setup_max_duration(MAX_HEAT_TIME)
        if hasattr(pin, "setup_expiry"):
            pin.setup_expiry(self._note_expiry)
        return pin

    def _watch_mcus(self):
        """The mcus of heater and sensor, each of which may be absent."""
        pins = (self.mcu_pwm, getattr(self.sensor, "mcu_adc", self.mcu_pwm))
        mcus = list({id(pin.get_mcu()): pin.get_mcu() for pin in pins}.values())
        for mcu in mcus:
            absence.watch(mcu, self._handle_loss, None)
        return mcus

    def _handle_loss(self):
        """An mcu is gone: off, and it stays off when that is back."""
        with self.lock:
            had_target, self.target_temp = self.target_temp, 0.0
            self.smoothed_temp = self.last_temp = self.last_temp_time = 0.0
            self.can_extrude = self._may_extrude()
            # those who judge readings begin anew
            self.n_expired += 1
            if self.last_pwm_value:
                self.last_pwm_value = 0.0
                self.mcu_pwm.set_pwm(0.0, 0.0)
        if had_target:
            self.printer.lookup_object("gcode").respond_info(
                "Heater '%s' is off, and stays off" % (self.short_name,))

    def _register(self, config):
        gcode = self.printer.lookup_object("gcode")
        gcode.register_mux_command(
            "SET_HEATER_TEMPERATURE", "HEATER", self.short_name,
            self.cmd_SET_HEATER_TEMPERATURE,
            desc=self.cmd_SET_HEATER_TEMPERATURE_help)
        self.printer.register_event_handler(
            "klippy:shutdown", self._handle_shutdown)
        self.printer.register_event_handler(
            "motion_queuing:hold", self._handle_hold)
        self.printer.load_object(config, "verify_heater " + self.short_name)
        self.printer.load_object(config, "pid_calibrate")
        self.profiles = self.printer.load_object(config, "pid_profiles")
        self.profiles.add_heater(self)
        self.printer.load_object(config, "heater_tuning").add_heater(self)

    # Readings and output

    def add_reading_callback(self, callback):
        """Call callback(print_time, degC, target, duty until now) with each reading.

        On the response thread, under `lock`.
        """
        self.reading_callbacks.append(callback)

    def temperature_callback(self, read_time, temp):
        """Take a reading (print_time, degC) and let the control answer."""
        with self.lock:
            for callback in self.reading_callbacks:
                callback(read_time, temp, self.target_temp, self.last_pwm_value)
            elapsed = read_time - self.last_temp_time
            self.last_temp = temp
            self.last_temp_time = read_time
            self.control.temperature_update(read_time, temp, self.target_temp)
            weight = min(elapsed / self.limits.smooth_time, 1.0)
            self.smoothed_temp += (temp - self.smoothed_temp) * weight
            self.can_extrude = self._may_extrude()

    def _may_extrude(self):
        least = self.limits.min_extrude_temp
        return (self.is_batch or self.is_cold_allowed or least <= 0.0
                or self.smoothed_temp >= least)

    def set_pwm(self, read_time, value):
        """Ask for a power (0..1) as answer to the reading of read_time."""
        if (self.target_temp <= 0.0 or self.is_shutdown
                or read_time > self.main_thread_until or self.is_cut):
            value = 0.0
        if 0.0 < value < self.limits.max_power:
            value = min(max(value + self.duty_offset, 0.0), self.limits.max_power)
        is_due = read_time >= self.next_pwm_time and self.last_pwm_value
        change = abs(value - self.last_pwm_value)
        is_switch_off = not value and self.last_pwm_value
        if not is_due and not is_switch_off and change < SMALL_POWER_CHANGE:
            return
        pwm_time = read_time + self.pwm_delay
        self.next_pwm_time = pwm_time + RENEW_FRACTION * MAX_HEAT_TIME
        self.last_pwm_value = value
        self.mcu_pwm.set_pwm(pwm_time, value)

    def _handle_shutdown(self):
        self.is_shutdown = True

    def _note_expiry(self):
        """The mcu turned the heater off: nobody had renewed it in time."""
        with self.lock:
            self.n_expired += 1
            self.next_pwm_time = 0.0
        self.printer.get_reactor().register_async_callback(self._reheat)

    def _reheat(self, eventtime):
        """Hold G-code until the heater is warm again."""
        temp, target = self.get_temp(eventtime)
        gcode = self.printer.lookup_object("gcode")
        gcode.respond_info(
            "The host was away for more than %.0f s: heater '%s' was turned off"
            " meanwhile. It is on again, at %.1f of %.1f degrees"
            % (MAX_HEAT_TIME, self.short_name, temp, target))
        if temp < target - REHEAT_DROP:
            gcode.run_script('TEMPERATURE_WAIT SENSOR="%s" MINIMUM=%.1f'
                             % (self.name, target - REHEAT_DROP))

    def _handle_hold(self, duration):
        """print_time stood still, but heat did not."""
        with self.lock:
            self.last_temp_time -= duration
            self.next_pwm_time -= duration
            self.main_thread_until -= duration
            self.control.note_hold(duration)

    # What others ask and set

    def get_name(self):
        return self.name

    def get_pwm_delay(self):
        """Seconds from a reading to the change of power it causes."""
        return self.pwm_delay

    def get_max_power(self):
        return self.limits.max_power

    def get_smooth_time(self):
        return self.limits.smooth_time

    def set_temp(self, degrees):
        """Set the target in degC, 0 for off; CommandError out of range."""
        if degrees and not self.min_temp <= degrees <= self.max_temp:
            raise self.printer.command_error(
                "Requested temperature (%.1f) of heater '%s' out of range"
                " (%.1f:%.1f)" % (degrees, self.name, self.min_temp,
                                  self.max_temp))
        if degrees:
            for mcu in self.mcus:
                absence.raise_if_absent(mcu)
        explain = getattr(self.control, "explain_unready", None)
        reason = explain() if degrees and explain is not None else None
        if reason is not None:
            raise self.printer.command_error(reason)
        with self.lock:
            self.target_temp = degrees

    def alter_target(self, target_temp):
        """Move the target within the limits (used while calibrating)."""
        if target_temp:
            target_temp = min(max(target_temp, self.min_temp), self.max_temp)
        self.target_temp = target_temp

    def set_extrusion_limit(self, min_temp=None, is_cold_allowed=None):
        """Set what is not None: least degC for extrusion, or that none is needed."""
        with self.lock:
            if min_temp is not None:
                self.limits = replace(self.limits, min_extrude_temp=min_temp)
            if is_cold_allowed is not None:
                self.is_cold_allowed = bool(is_cold_allowed)
            self.can_extrude = self._may_extrude()

    def set_smooth_time(self, smooth_time):
        """Average readings over so many s from now on."""
        with self.lock:
            self.limits = replace(self.limits, smooth_time=smooth_time)

    def get_temp(self, eventtime):
        """(smoothed temperature, target) in degC; 0 when readings stop.

        To be called on the main thread: it is its sign of life as well.
        """
        print_time = self._estimate_print_time(eventtime)
        with self.lock:
            self.main_thread_until = print_time + MAIN_THREAD_TIMEOUT
            if self.last_temp_time < print_time - STALE_READING:
                return 0.0, self.target_temp
            return self.smoothed_temp, self.target_temp

    def _estimate_print_time(self, eventtime):
        return self.mcu_pwm.get_mcu().estimated_print_time(eventtime)

    def check_busy(self, eventtime):
        """True while the control has not reached its target.

        False while an mcu is absent: the heater is off.
        """
        if any(absence.is_absent(mcu) for mcu in self.mcus):
            return False
        with self.lock:
            return self.control.check_busy(
                eventtime, self.smoothed_temp, self.target_temp)

    def set_control(self, control, keep_target=False):
        """Exchange the control; returns the one before.

        The heater is off then, unless keep_target.
        """
        with self.lock:
            before, self.control = self.control, control
            if not keep_target:
                self.target_temp = 0.0
        return before

    def stats(self, eventtime):
        """(is worth logging, log line)."""
        with self.lock:
            target, temp = self.target_temp, self.last_temp
            power = self.last_pwm_value
        is_active = bool(target or temp > 50.0)
        return is_active, "%s: target=%.0f temp=%.1f pwm=%.3f" % (
            self.short_name, target, temp, power)

    def get_status(self, eventtime):
        with self.lock:
            status = {"temperature": round(self.smoothed_temp, 2),
                      "target": self.target_temp,
                      "power": self.last_pwm_value,
                      "pid_profile": self.profiles.get_loaded(self.short_name)}
            get_stats = getattr(self.control, "get_stats", None)
            if get_stats is not None:
                status["control_stats"] = get_stats()
            return status

    cmd_SET_HEATER_TEMPERATURE_help = "Sets a heater temperature"

    def cmd_SET_HEATER_TEMPERATURE(self, gcmd):
        target = gcmd.get_float("TARGET", 0.0)
        self.printer.lookup_object("heaters").set_temperature(self, target)
