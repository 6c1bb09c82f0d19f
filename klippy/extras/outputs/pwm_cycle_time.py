# SPDX-License-Identifier: GPL-3.0-or-later
"""[pwm_cycle_time name]: software pwm whose cycle SET_PIN can change."""
from klippy.extras.request_queue import GCodeRequestQueue
from klippy.mcu import absence

# The printer goes on without it
MAY_LACK_FIRMWARE = True

# The mcu takes another cycle only while the pin does not pulse: it is off for
# so long (s) in between
CHANGE_TIME = 0.100
# So long (s) after a value is due the mcu is done with it
SETTLE_TIME = 0.001


class CyclePin:
    """A digital output of an mcu, pulsed by the mcu's own timer."""

    def __init__(self, pin_params, cycle_time, start_value, shutdown_value):
        self.mcu = pin_params["chip"]
        self.pin, self.invert = pin_params["pin"], pin_params["invert"]
        self.cycle_time = cycle_time
        self.start_value, self.shutdown_value = start_value, shutdown_value
        self.is_pulsing = 0.0 < start_value < 1.0
        self.last_clock = self.cycle_ticks = 0
        self.oid = self.cycle_cmd = self.value_cmd = None
        self.part = absence.find_part(self.mcu)
        self.part.register_config_callback(self._build_config)

    def _calc_on_ticks(self, value):
        share = 1.0 - value if self.invert else value
        return int(share * self.cycle_ticks + 0.5)

    def _build_config(self):
        mcu = self.mcu
        mcu.request_move_queue_slot()
        self.oid = mcu.create_oid()
        self.cycle_ticks = mcu.seconds_to_clock(self.cycle_time)
        now = mcu.get_printer().get_reactor().monotonic()
        self.last_clock = mcu.print_time_to_clock(
            mcu.estimated_print_time(now) + 0.200)
        start = int(self.start_value >= 1.0) ^ self.invert
        mcu.add_config_cmd(
            "config_digital_out oid=%d pin=%s value=%d default_value=%d"
            " max_duration=0" % (self.oid, self.pin, start,
                                 int(self.shutdown_value) ^ self.invert))
        mcu.add_config_cmd("set_digital_out_pwm_cycle oid=%d cycle_ticks=%d"
                           % (self.oid, self.cycle_ticks))
        mcu.add_config_cmd(
            "queue_digital_out oid=%d clock=%d on_ticks=%d"
            % (self.oid, self.last_clock, self._calc_on_ticks(self.start_value)),
            is_init=True)
        queue = mcu.alloc_command_queue()
        self.cycle_cmd = mcu.lookup_command(
            "set_digital_out_pwm_cycle oid=%c cycle_ticks=%u", cq=queue)
        self.value_cmd = mcu.lookup_command(
            "queue_digital_out oid=%c clock=%u on_ticks=%u", cq=queue)

    def needs_rest(self, cycle_time):
        """Must the pin be off before it can have this cycle?"""
        is_new = self.mcu.seconds_to_clock(cycle_time) != self.cycle_ticks
        return is_new and self.is_pulsing

    def set_pwm(self, print_time, value, cycle_time):
        """Change the duty (0..1), and the cycle (s) of a pin that rests."""
        mcu = self.mcu
        absence.raise_if_absent(self.part)
        clock = mcu.output_clock(print_time, self.last_clock)
        free_clock = self.last_clock + mcu.seconds_to_clock(SETTLE_TIME)
        cycle_ticks = mcu.seconds_to_clock(cycle_time)
        if cycle_ticks != self.cycle_ticks:
            self.cycle_ticks = cycle_ticks
            self.cycle_cmd.send([self.oid, cycle_ticks], minclock=free_clock,
                                reqclock=clock)
        self.value_cmd.send([self.oid, clock, self._calc_on_ticks(value)],
                            minclock=free_clock, reqclock=clock)
        self.is_pulsing = 0.0 < value < 1.0
        self.last_clock = clock


class PrinterPWMCycle:
    """Status: value, 0..1 of full scale."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.scale = config.getfloat("scale", 1.0, above=0.0)
        self.last_value = self._read_value(config, "value")
        shutdown_value = self._read_value(config, "shutdown_value")
        if shutdown_value not in (0.0, 1.0):
            raise config.error(
                "Option 'shutdown_value' in section '%s' must be 0 or %s: a mcu"
                " that is shut down makes no pulses" % (config.get_name(), self.scale))
        pin = self.printer.lookup_object("pins").lookup_pin(
            config.get("pin"), can_invert=True)
        self.longest = pin["chip"].max_nominal_duration()
        self.cycle_time = self.last_cycle_time = config.getfloat(
            "cycle_time", 0.100, above=0.0, maxval=self.longest)
        self.pin = CyclePin(pin, self.cycle_time, self.last_value, shutdown_value)
        self.requests = GCodeRequestQueue(config, pin["chip"], self._set_pin)
        name = config.get_name().split()[1]
        self.printer.lookup_object("gcode").register_mux_command(
            "SET_PIN", "PIN", name, self.cmd_SET_PIN, desc=self.cmd_SET_PIN_help)

    def _read_value(self, config, option):
        return config.getfloat(
            option, 0.0, minval=0.0, maxval=self.scale) / self.scale

    def _set_pin(self, print_time, request):
        value, cycle_time = request
        if request == (self.last_value, self.last_cycle_time):
            return "discard", 0.0
        if self.pin.needs_rest(cycle_time):
            self.pin.set_pwm(print_time, 0.0, self.last_cycle_time)
            self.last_value = 0.0
            return "delay", CHANGE_TIME
        self.pin.set_pwm(print_time, value, cycle_time)
        self.last_value, self.last_cycle_time = value, cycle_time
        return None

    def get_status(self, eventtime):
        return {"value": self.last_value}

    cmd_SET_PIN_help = "Set the value of an output pin, and its cycle"

    def cmd_SET_PIN(self, gcmd):
        value = gcmd.get_float("VALUE", minval=0.0, maxval=self.scale)
        cycle_time = gcmd.get_float("CYCLE_TIME", self.cycle_time, above=0.0,
                                    maxval=self.longest)
        self.requests.queue_gcode_request((value / self.scale, cycle_time))


def load_config_prefix(config):
    return PrinterPWMCycle(config)
