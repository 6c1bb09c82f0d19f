# SPDX-License-Identifier: GPL-3.0-or-later
"""A digital output whose changes are queued on the mcu."""

from klippy.mcu import absence

CONFIG = ("config_digital_out oid=%d pin=%s value=%d default_value=%d"
          " max_duration=%d")


class MCU_digital_out:
    """Drives one pin; values are logical (inversion is applied here)."""

    def __init__(self, mcu, pin_params):
        self._mcu = mcu
        self._pin = pin_params["pin"]
        self._invert = pin_params["invert"]
        self._start_value = self._shutdown_value = self._invert
        self._max_duration = 2.
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

    def setup_start_value(self, start_value, shutdown_value):
        """Values until the first set_digital(), and after a shutdown."""
        self._start_value = int(bool(start_value)) ^ self._invert
        self._shutdown_value = int(bool(shutdown_value)) ^ self._invert

    def set_digital(self, print_time, value):
        """Change the output at print_time."""
        self._value = value
        if absence.is_absent(self.part):
            return
        clock = self._mcu.output_clock(print_time, self._last_clock)
        self._set_cmd.send([self._oid, clock, int(bool(value)) ^ self._invert],
                           minclock=self._last_clock, reqclock=clock)
        self._last_clock = clock

    def _handle_return(self):
        """The mcu was away: it has what it starts with."""
        if self._value is not None:
            self.set_digital(0., self._value)

    def _build_config(self):
        mcu = self._mcu
        self._last_clock = 0
        if self._max_duration and self._start_value != self._shutdown_value:
            raise mcu.config_error(
                "Pin '%s' of mcu '%s' with a maximum duration must have the same"
                " value at start and at shutdown" % (self._pin, mcu.get_name()))
        mcu.request_move_queue_slot()
        self._oid = mcu.create_oid()
        mcu.add_config_cmd(CONFIG % (
            self._oid, self._pin, self._start_value, self._shutdown_value,
            mcu.check_duration(self._max_duration, self._pin)))
        mcu.add_config_cmd("update_digital_out oid=%d value=%d"
                           % (self._oid, self._start_value), on_restart=True)
        self._set_cmd = mcu.lookup_command(
            "queue_digital_out oid=%c clock=%u on_ticks=%u",
            cq=mcu.alloc_command_queue())
