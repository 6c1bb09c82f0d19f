# SPDX-License-Identifier: GPL-3.0-or-later
"""[pwm_tool name]: a laser or spindle whose power changes with the moves.

Every value is kept, however fast they follow each other: they go through the
mcu's move queue like steps do, and become clocks when steps do.

The mcu turns the tool off when it hears nothing for maximum_mcu_duration; when the
host is back, the tool goes on as motion does.
"""
from collections import deque

from klippy import motionhold
from klippy.errors import ConfigError
from klippy_ext.stepcompress import StepCompress

HARD_QUEUE = "queue_pwm_out oid=%c clock=%u value=%hu"
SOFT_QUEUE = "queue_digital_out oid=%c clock=%u on_ticks=%u"
# maximum_mcu_duration where the config has none and the mcu need not shut down
DEFAULT_DURATION = 1.0
# The mcu is told again after this part of it
RENEW_FRACTION = 0.4


class ToolPin:
    """Hardware or software pwm of an mcu, fed by its move queue."""

    def __init__(self, pin_params, cycle_time, is_hard, duration, start, shutdown):
        """duration: s, 0 for no limit, None for one if the mcu need not shut down."""
        self.mcu = pin_params["chip"]
        self.pin, self.invert = pin_params["pin"], pin_params["invert"]
        self.cycle_time, self.is_hard, self.duration = cycle_time, is_hard, duration
        self.start, self.shutdown = start, shutdown
        self.oid = self.mcu.create_oid()
        self.emitter = StepCompress(self.oid)
        self.full_scale = 0.0
        self.last_clock = 0
        self.message = None
        self.expiry_callback = None
        self.mcu.register_config_callback(self._build_config)

    def _calc_ticks(self, value):
        share = 1.0 - value if self.invert else value
        return int(share * self.full_scale + 0.5)

    def _build_config(self):
        mcu = self.mcu
        self.message = mcu.get_serial().get_msgparser().lookup_command(
            HARD_QUEUE if self.is_hard else SOFT_QUEUE)
        mcu.request_move_queue_slot()
        now = mcu.get_printer().get_reactor().monotonic()
        self.last_clock = mcu.print_time_to_clock(
            mcu.estimated_print_time(now) + 0.200)
        cycle_ticks = mcu.seconds_to_clock(self.cycle_time)
        rest = "rest_pwm_out" if self.is_hard else "rest_digital_out"
        can_rest = mcu.try_lookup_command(rest + " oid=%c") is not None
        if self.duration is None:
            self.duration = DEFAULT_DURATION if can_rest else 0.0
        duration = mcu.check_duration(self.duration, self.pin)
        self.full_scale = (mcu.get_constant_float("PWM_MAX") if self.is_hard
                           else float(cycle_ticks))
        start, shutdown = self._calc_ticks(self.start), self._calc_ticks(self.shutdown)
        if self.is_hard:
            mcu.add_config_cmd(
                "config_pwm_out oid=%d pin=%s cycle_ticks=%d value=%d"
                " default_value=%d max_duration=%d"
                % (self.oid, self.pin, cycle_ticks, start, shutdown, duration))
        else:
            mcu.add_config_cmd(
                "config_digital_out oid=%d pin=%s value=%d default_value=%d"
                " max_duration=%d" % (self.oid, self.pin, start >= cycle_ticks,
                                      shutdown >= cycle_ticks, duration))
            mcu.add_config_cmd("set_digital_out_pwm_cycle oid=%d cycle_ticks=%d"
                               % (self.oid, cycle_ticks))
        if self.duration and can_rest:
            mcu.add_config_cmd("%s oid=%d" % (rest, self.oid))
            mcu.register_response(self._handle_expired, "output_expired", self.oid)
        text = ("queue_pwm_out oid=%d clock=%d value=%d" if self.is_hard
                else "queue_digital_out oid=%d clock=%d on_ticks=%d")
        mcu.add_config_cmd(text % (self.oid, self.last_clock & 0xffffffff, start),
                           is_init=True)

    def _handle_expired(self, params):
        self.expiry_callback()

    def send(self, print_time, value):
        """Queue a value behind all before it."""
        clock = self.mcu.output_clock(print_time, 0)
        clock = self.last_clock = max(clock, self.last_clock + 1)
        data = self.message.encode(
            [self.oid, clock & 0xffffffff, self._calc_ticks(value)])
        self.emitter.queue_message(bytes(data), clock)


class PrinterPwmTool:
    """Status: value, 0..1 of full scale."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.scale = config.getfloat("scale", 1.0, above=0.0)
        self.last_value = self.sent_value = self._read_value(config, "value")
        self.shutdown_value = self._read_value(config, "shutdown_value")
        self.name = config.get_name().split()[1]
        self.pin = self._setup_pin(config)
        self.pin.expiry_callback = self._note_expiry
        self.is_expired = False
        self.waiting = deque()           # (print_time, value), not sent yet
        self.sent_time = 0.0
        self.toolhead = None
        self.motion = self.printer.load_object(config, "motion_queuing")
        self.motion.add_emitter(self.pin.mcu, self.pin.emitter)
        self.motion.register_flush_callback(self._flush)
        self.printer.register_event_handler("klippy:connect", self._handle_connect)
        self.printer.lookup_object("gcode").register_mux_command(
            "SET_PIN", "PIN", self.name, self.cmd_SET_PIN, desc=self.cmd_SET_PIN_help)

    def _read_value(self, config, option):
        return config.getfloat(
            option, 0.0, minval=0.0, maxval=self.scale) / self.scale

    def _setup_pin(self, config):
        params = self.printer.lookup_object("pins").lookup_pin(
            config.get("pin"), can_invert=True)
        longest = params["chip"].max_nominal_duration()
        cycle_time = config.getfloat("cycle_time", 0.100, above=0.0, maxval=longest)
        is_hard = config.getboolean("hardware_pwm", False)
        is_off_first = self.last_value == self.shutdown_value
        duration = config.getfloat(
            "maximum_mcu_duration", None if is_off_first else 0.0, minval=0.5,
            maxval=longest)
        if duration and self.last_value != self.shutdown_value:
            raise ConfigError(
                "Section '%s' with a maximum_mcu_duration must have the same value"
                " and shutdown_value" % (config.get_name(),))
        if not is_hard and self.shutdown_value not in (0.0, 1.0):
            raise ConfigError(
                "Option 'shutdown_value' in section '%s' must be 0 or %s on software"
                " pwm" % (config.get_name(), self.scale))
        return ToolPin(params, cycle_time, is_hard, duration, self.last_value,
                       self.shutdown_value)

    def _handle_connect(self):
        self.toolhead = self.printer.lookup_object("toolhead")

    def _append(self, print_time, value):
        if value == self.last_value:
            return
        self.last_value = value
        if self.waiting and self.waiting[-1][0] >= print_time:
            self.waiting.pop()
        self.waiting.append((print_time, value))
        self.motion.note_mcu_movequeue_activity(print_time)

    def _note_expiry(self):
        """The mcu has turned the tool off.  Runs on the response thread."""
        self.is_expired = True
        self.printer.get_reactor().register_async_callback(self._tell_expiry)

    def _tell_expiry(self, eventtime):
        self.printer.lookup_object("gcode").respond_info(
            "The host was away for more than %.1f s: pwm_tool '%s' was off meanwhile"
            % (self.pin.duration, self.name))

    def _go_on(self):
        """Have the power of before again when motion goes on."""
        self.is_expired = False
        ramp = self.motion.ramp
        if ramp is None:
            self._send(self.sent_time, self.sent_value)
        else:
            self._send(ramp.end - motionhold.RAMP_TIME, self.sent_value)

    def _flush(self, flush_time, step_gen_time):
        if self.is_expired:
            self._go_on()
        while self.waiting and self.waiting[0][0] <= flush_time:
            print_time, value = self.waiting.popleft()
            self._refresh(print_time)
            self._send(print_time, value)
        self._refresh(flush_time)

    def _send(self, print_time, value):
        self.pin.send(print_time, value)
        self.sent_time, self.sent_value = print_time, value
        if self.pin.duration and value != self.shutdown_value:
            self.motion.note_mcu_movequeue_activity(
                print_time + RENEW_FRACTION * self.pin.duration, is_step_gen=False)

    def _refresh(self, end_time):
        """Tell the mcu in time that the power shall stay on."""
        if not self.pin.duration:
            return
        period = RENEW_FRACTION * self.pin.duration
        while (self.sent_value != self.shutdown_value
               and self.sent_time + period <= end_time):
            self._send(self.sent_time + period, self.sent_value)

    def get_status(self, eventtime):
        return {"value": self.last_value}

    cmd_SET_PIN_help = "Set the power of a tool, in step with the moves"

    def cmd_SET_PIN(self, gcmd):
        value = gcmd.get_float("VALUE", minval=0.0, maxval=self.scale) / self.scale
        self.toolhead.register_lookahead_callback(
            lambda print_time: self._append(print_time, value))


def load_config_prefix(config):
    return PrinterPwmTool(config)
