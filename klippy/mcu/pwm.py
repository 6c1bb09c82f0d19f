# SPDX-License-Identifier: GPL-3.0-or-later
"""A pulse width output, in hardware or by timed switching of a pin."""

from klippy.mcu import absence

HARD_CONFIG = ("config_pwm_out oid=%d pin=%s cycle_ticks=%d value=%d"
               " default_value=%d max_duration=%d")
SOFT_CONFIG = ("config_digital_out oid=%d pin=%s value=%d default_value=%d"
               " max_duration=%d")
MAX_CYCLE_TICKS = 1 << 31


class MCU_pwm:
    """Drives one pin with a duty of 0..1 (inversion is applied here)."""

    def __init__(self, mcu, pin_params):
        self._mcu = mcu
        self._pin = pin_params["pin"]
        self._invert = pin_params["invert"]
        self._hardware_pwm = False
        self._cycle_time = 0.100
        self._max_duration = 2.
        self._expiry_callback = None
        self._start_value = self._shutdown_value = float(self._invert)
        self._pwm_max = 0.
        self._last_clock = 0
        self._oid = None
        self._set_cmd = None
        self._value = None
        self.part = absence.find_part(mcu)
        self.part.register_config_callback(self._build_config)
        absence.watch(mcu, None, self._handle_return)

    def get_mcu(self):
        """The MCU of this pin."""
        return self._mcu

    def setup_max_duration(self, max_duration):
        """Time after which the mcu shuts down without a new value; 0: never."""
        self._max_duration = max_duration

    def setup_expiry(self, callback):
        """Have the pin rest after max_duration, if the mcu can, without shutdown.

        callback() is called when it does, on the response thread.
        """
        self._expiry_callback = callback

    def setup_cycle_time(self, cycle_time, hardware_pwm=False):
        """Length of one on-off cycle in s, and who makes it."""
        self._cycle_time = cycle_time
        self._hardware_pwm = hardware_pwm

    def setup_start_value(self, start_value, shutdown_value):
        """Duties until the first set_pwm(), and after a shutdown."""
        self._start_value = self._duty(start_value)
        self._shutdown_value = self._duty(shutdown_value)

    def set_pwm(self, print_time, value):
        """Change the duty at print_time."""
        self._value = value
        if absence.is_absent(self.part):
            return
        clock = self._mcu.output_clock(print_time, self._last_clock)
        ticks = int(self._duty(value) * self._pwm_max + 0.5)
        self._set_cmd.send([self._oid, clock, ticks],
                           minclock=self._last_clock, reqclock=clock)
        self._last_clock = clock

    def _handle_return(self):
        """The mcu was away: it has what it starts with."""
        if self._value is not None:
            self.set_pwm(0., self._value)

    def _duty(self, value):
        value = max(0., min(1., value))
        return 1. - value if self._invert else value

    def _build_config(self):
        mcu = self._mcu
        if self._max_duration and self._start_value != self._shutdown_value:
            raise mcu.config_error(
                "Pin '%s' of mcu '%s' with a maximum duration must have the same"
                " value at start and at shutdown" % (self._pin, mcu.get_name()))
        cycle_ticks = mcu.seconds_to_clock(self._cycle_time)
        if not 0 < cycle_ticks < MAX_CYCLE_TICKS:
            raise mcu.config_error(
                "PWM cycle time %.9g s of pin '%s' of mcu '%s' is out of range:"
                " at most %.3f s" % (self._cycle_time, self._pin, mcu.get_name(),
                                     MAX_CYCLE_TICKS / mcu.seconds_to_clock(1.)))
        mcu.request_move_queue_slot()
        self._oid = mcu.create_oid()
        self._last_clock = mcu.print_time_to_clock(
            mcu.estimated_print_time(mcu.get_printer().get_reactor().monotonic())
            + 0.200)
        duration = mcu.check_duration(self._max_duration, self._pin)
        if self._hardware_pwm:
            self._build_hard(cycle_ticks, duration)
        else:
            self._build_soft(cycle_ticks, duration)

    def _build_hard(self, cycle_ticks, duration):
        mcu = self._mcu
        self._pwm_max = mcu.get_constant_float("PWM_MAX")
        start = int(self._start_value * self._pwm_max + 0.5)
        stop = int(self._shutdown_value * self._pwm_max + 0.5)
        mcu.add_config_cmd(HARD_CONFIG % (
            self._oid, self._pin, cycle_ticks, start, stop, duration))
        mcu.add_config_cmd("queue_pwm_out oid=%d clock=%d value=%d"
                           % (self._oid, self._last_clock, start), on_restart=True)
        self._build_expiry("rest_pwm_out")
        self._set_cmd = mcu.lookup_command(
            "queue_pwm_out oid=%c clock=%u value=%hu", cq=mcu.alloc_command_queue())

    def _build_soft(self, cycle_ticks, duration):
        mcu = self._mcu
        if self._shutdown_value not in (0., 1.):
            raise mcu.config_error(
                "Shutdown value of pin '%s' of mcu '%s' must be 0.0 or 1.0 on"
                " software pwm" % (self._pin, mcu.get_name()))
        self._pwm_max = float(cycle_ticks)
        mcu.add_config_cmd(SOFT_CONFIG % (
            self._oid, self._pin, self._start_value >= 1., self._shutdown_value >= .5,
            duration))
        mcu.add_config_cmd("set_digital_out_pwm_cycle oid=%d cycle_ticks=%d"
                           % (self._oid, cycle_ticks))
        mcu.add_config_cmd(
            "queue_digital_out oid=%d clock=%d on_ticks=%d"
            % (self._oid, self._last_clock,
               int(self._start_value * self._pwm_max + 0.5)), is_init=True)
        self._build_expiry("rest_digital_out")
        self._set_cmd = mcu.lookup_command(
            "queue_digital_out oid=%c clock=%u on_ticks=%u",
            cq=mcu.alloc_command_queue())

    def _build_expiry(self, name):
        mcu = self._mcu
        if (self._expiry_callback is None or not self._max_duration
                or mcu.try_lookup_command(name + " oid=%c") is None):
            return
        mcu.add_config_cmd("%s oid=%d" % (name, self._oid))
        mcu.register_response(self._handle_expired, "output_expired", self._oid)

    def _handle_expired(self, params):
        self._expiry_callback()
