# SPDX-License-Identifier: GPL-3.0-or-later
"""[buttons]: tells others when switches, analog keys and encoders change.

Callbacks get (eventtime, state) and run in the reactor.  Nothing is called
for a button that is released when the printer starts.
"""
import math

from klippy.mcu import absence

# Pins are looked at so often (s); a report that nobody acknowledges is sent
# again after so many looks
POLL_TIME = 0.002
# So long (s) after its return an mcu has told which buttons are pressed
RETURN_TIME = 2.0
RESEND_POLLS = 50
MAX_PINS = 8
ADC_REPORT_TIME = 0.015
ADC_SAMPLE_TIME = 0.001
ADC_SAMPLE_COUNT = 6
# An analog key counts when the reading stays with it so long (s)
ADC_STEADY_TIME = 0.025
# An encoder that has not moved for so long (s) lies in a detent
DETENT_TIME = 0.25


class McuButtons:
    """Up to 8 pins of one mcu that report together."""

    def __init__(self, printer, mcu):
        self.reactor = printer.get_reactor()
        self.mcu = mcu
        self.pins = []
        self.watchers = []               # (mask, shift, callback)
        self.state = self.n_seen = 0     # n_seen as the mcu counts: 8 bits
        self.oid = self.ack_cmd = None
        self.part = absence.make_part(mcu)
        self.part.register_config_callback(self._build_config)
        absence.watch(mcu, None, self._handle_return)

    def has_room(self, count):
        return len(self.pins) + count <= MAX_PINS

    def add(self, pins, callback):
        """Call callback(eventtime, bits) when any of these pins changes."""
        shift = len(self.pins)
        self.pins += pins
        self.watchers.append((((1 << len(pins)) - 1) << shift, shift, callback))
        absence.add_user(self.part)

    def _build_config(self):
        mcu = self.mcu
        self.n_seen = 0
        self.oid = mcu.create_oid()
        mcu.add_config_cmd("config_buttons oid=%d button_count=%d"
                           % (self.oid, len(self.pins)))
        invert = 0
        for pos, pin in enumerate(self.pins):
            invert |= bool(pin["invert"]) << pos
            mcu.add_config_cmd("buttons_add oid=%d pos=%d pin=%s pull_up=%d"
                               % (self.oid, pos, pin["pin"], pin["pullup"]))
        mcu.add_config_cmd(
            "buttons_query oid=%d clock=%d rest_ticks=%d retransmit_count=%d"
            " invert=%d" % (self.oid, mcu.get_query_slot(self.oid),
                            mcu.seconds_to_clock(POLL_TIME), RESEND_POLLS, invert),
            is_init=True)
        self.ack_cmd = mcu.lookup_command("buttons_ack oid=%c count=%c",
                                          cq=mcu.alloc_command_queue())
        mcu.register_serial_response(
            self._handle_state, "buttons_state oid=%c ack_count=%c state=%*s",
            self.oid)

    def _handle_state(self, params):
        acked, states = params["ack_count"], bytes(params["state"])
        self.reactor.register_async_callback(
            lambda eventtime: self._note_states(eventtime, acked, states))

    def _note_states(self, eventtime, acked, states):
        """states: all since `acked` of them, some of which came before."""
        new = states[(self.n_seen - acked) & 0xff:]
        if not new:
            return
        self.n_seen = (self.n_seen + len(new)) & 0xff
        self.ack_cmd.send([self.oid, len(new)])
        for state in new:
            self._note_state(eventtime, state)

    def _note_state(self, eventtime, state):
        changed, self.state = self.state ^ state, state
        for mask, shift, callback in self.watchers:
            if changed & mask:
                callback(eventtime, (state & mask) >> shift)

    def _handle_return(self):
        """The mcu was away; it tells what is pressed, and nothing if nothing is."""
        self.reactor.register_callback(
            self._check_return, self.reactor.monotonic() + RETURN_TIME)

    def _check_return(self, eventtime):
        if not self.n_seen and not absence.is_absent(self.part):
            self._note_state(eventtime, 0)


class AdcButtons:
    """Keys on one analog pin, each with a range of resistance (ohm)."""

    def __init__(self, printer, pin, pullup):
        self.reactor = printer.get_reactor()
        self.pullup = pullup
        self.keys = []                   # (min, max, callback)
        self.pressed = self.candidate = None
        self.candidate_since = 0.0
        adc = printer.lookup_object("pins").setup_pin("adc", pin)
        adc.setup_adc_sample(ADC_REPORT_TIME, ADC_SAMPLE_TIME, ADC_SAMPLE_COUNT)
        adc.setup_adc_callback(self._handle_samples)
        self.part = getattr(adc, "part", adc)

    def add(self, min_ohm, max_ohm, callback):
        self.keys.append((min_ohm, max_ohm, callback))
        absence.add_user(self.part)

    def _find_key(self, fraction):
        if fraction >= 1.0:
            ohm = math.inf
        else:
            ohm = self.pullup * fraction / (1.0 - fraction)
        for index, (low, high, _) in enumerate(self.keys):
            if low <= ohm <= high:
                return index
        return None

    def _handle_samples(self, samples):
        for read_time, fraction in samples:
            key = self._find_key(fraction)
            if key != self.candidate:
                self.candidate, self.candidate_since = key, read_time
            is_steady = read_time - self.candidate_since >= ADC_STEADY_TIME
            if is_steady and key != self.pressed:
                self._report(self.pressed, False)
                self._report(key, True)
                self.pressed = key

    def _report(self, key, state):
        if key is not None:
            callback = self.keys[key][2]
            self.reactor.register_async_callback(
                lambda eventtime: callback(eventtime, state))


class Debouncer:
    """Passes a state on once it has lasted for a while (s)."""

    def __init__(self, printer, delay, callback):
        self.reactor = printer.get_reactor()
        self.delay, self.callback = delay, callback
        self.state = self.reported = False
        self.timer = self.reactor.register_timer(self._handle_timer)

    def note_state(self, eventtime, state):
        """What the button says."""
        self.state = bool(state)
        is_new = self.state != self.reported
        self.reactor.update_timer(
            self.timer, eventtime + self.delay if is_new else self.reactor.NEVER)

    def _handle_timer(self, eventtime):
        if self.state != self.reported:
            self.reported = self.state
            self.callback(eventtime, self.state)
        return self.reactor.NEVER


class RotaryEncoder:
    """Counts the quarter turns of two pins into detents."""

    # Place of the levels (bit 0: pin 1, bit 1: pin 2) in the Gray code
    PLACES = (0, 1, 3, 2)

    def __init__(self, steps_per_detent, cw_callback, ccw_callback):
        self.steps_per_detent = steps_per_detent
        self.callbacks = {1: cw_callback, -1: ccw_callback}
        self.place = self.travel = 0
        self.last_time = 0.0

    def note_levels(self, eventtime, levels):
        """Both pins' levels have changed to these bits."""
        if eventtime - self.last_time > DETENT_TIME:
            self.travel = 0
        self.last_time = eventtime
        place = self.PLACES[levels]
        way, self.place = (place - self.place) % 4, place
        # Two steps at once have no direction
        self.travel += {1: 1, 3: -1}.get(way, 0)
        if abs(self.travel) >= self.steps_per_detent:
            direction = 1 if self.travel > 0 else -1
            self.travel -= direction * self.steps_per_detent
            self.callbacks[direction](eventtime)


class PrinterButtons:
    """Object `buttons`: where buttons are registered."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.groups = []
        self.adc_pins = {}

    def register_buttons(self, pins, callback):
        """Call callback(eventtime, state): bit n of state is pins[n], pressed.

        Returns the part of the mcu that looks at them (see klippy/mcu/absence.py).
        """
        ppins = self.printer.lookup_object("pins")
        found = [ppins.lookup_pin(pin, can_invert=True, can_pullup=True)
                 for pin in pins]
        mcu = found[0]["chip"]
        if any(pin["chip"] is not mcu for pin in found):
            raise self.printer.config_error(
                "Buttons that belong together must be on one mcu, unlike pins %s"
                % (", ".join("'%s'" % (pin,) for pin in pins),))
        if len(found) > MAX_PINS or not hasattr(mcu, "register_config_callback"):
            raise self.printer.config_error(
                "Pins %s cannot be buttons: up to %d pins of an mcu can be"
                % (", ".join("'%s'" % (pin,) for pin in pins), MAX_PINS))
        group = self._find_group(mcu, len(found))
        group.add(found, callback)
        return group.part

    def _find_group(self, mcu, count):
        for group in self.groups:
            if group.mcu is mcu and group.has_room(count):
                return group
        self.groups.append(McuButtons(self.printer, mcu))
        return self.groups[-1]

    def register_button_push(self, pin, callback):
        """Call callback(eventtime) when the button is pressed."""
        self.register_buttons([pin], _call_when_pressed(callback))

    def register_adc_button(self, pin, min_val, max_val, pullup, callback):
        """Call callback(eventtime, state) for a key of min_val..max_val ohm."""
        if pin not in self.adc_pins:
            self.adc_pins[pin] = AdcButtons(self.printer, pin, pullup)
        keys = self.adc_pins[pin]
        if keys.pullup != pullup:
            raise self.printer.config_error(
                "Keys on pin '%s' must have one pull-up resistor, not both %s and"
                " %s ohm" % (pin, keys.pullup, pullup))
        keys.add(min_val, max_val, callback)

    def register_adc_button_push(self, pin, min_val, max_val, pullup, callback):
        """Call callback(eventtime) when the key is pressed."""
        self.register_adc_button(pin, min_val, max_val, pullup,
                                 _call_when_pressed(callback))

    def register_debounce_button(self, pin, callback, config):
        """As register_buttons() of one pin, after the debounce_delay of config."""
        return self.register_buttons([pin], self._debounce(config, callback))

    def register_debounce_adc_button(self, pin, min_val, max_val, pullup,
                                     callback, config):
        """As register_adc_button(), after the debounce_delay of config."""
        self.register_adc_button(pin, min_val, max_val, pullup,
                                 self._debounce(config, callback))

    def _debounce(self, config, callback):
        delay = config.getfloat("debounce_delay", 0.0, minval=0.0)
        if not delay:
            return callback
        return Debouncer(self.printer, delay, callback).note_state

    def register_rotary_encoder(self, pin1, pin2, cw_callback, ccw_callback,
                                steps_per_detent):
        """Call one of both with (eventtime) for each detent (2 or 4 steps)."""
        if steps_per_detent not in (2, 4):
            raise self.printer.config_error(
                "An encoder has 2 or 4 steps a detent, not %s" % (steps_per_detent,))
        encoder = RotaryEncoder(steps_per_detent, cw_callback, ccw_callback)
        self.register_buttons([pin1, pin2], encoder.note_levels)


def _call_when_pressed(callback):
    def handle(eventtime, state):
        if state:
            callback(eventtime)
    return handle


def load_config(config):
    return PrinterButtons(config)
