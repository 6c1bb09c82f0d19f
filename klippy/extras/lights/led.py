# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of all kinds of lights: SET_LED, SET_LED_TEMPLATE, and [led name]."""
from functools import partial

# The printer goes on without it
MAY_LACK_FIRMWARE = True

CHANNELS = ("red", "green", "blue", "white")
MIN_UPDATE_TIME = 0.010         # s


class LEDHelper:
    """Keeps the colours of one section and tells its driver when they change.

    Status: color_data, a list of [red, green, blue, white], 0..1.
    """

    def __init__(self, config, update_func, led_count=1):
        """update_func(colors, print_time): show a list of (r, g, b, w).

        print_time None: at once.  It may wait, and is not called again meanwhile.
        """
        self.printer = printer = config.get_printer()
        self.update_func, self.led_count = update_func, led_count
        self.mutex = printer.get_reactor().mutex()
        self.evaluator = printer.load_object(config, "template_evaluator")
        color = tuple(config.getfloat("initial_" + channel, 0.0, minval=0.0,
                                      maxval=1.0) for channel in CHANNELS)
        self.colors = [color] * led_count
        self.sent_colors = None
        self.name = config.get_name().split()[-1]
        gcode = printer.lookup_object("gcode")
        for command, handler, text in (
                ("SET_LED", self.cmd_SET_LED, self.cmd_SET_LED_help),
                ("SET_LED_TEMPLATE", self.cmd_SET_LED_TEMPLATE,
                 self.cmd_SET_LED_TEMPLATE_help)):
            gcode.register_mux_command(command, "LED", self.name, handler, desc=text)

    def get_led_count(self):
        return self.led_count

    def set_color(self, index, color):
        """Change one (index from 1) or all (None); nothing is shown yet."""
        color = tuple(color)
        if index is None:
            self.colors = [color] * self.led_count
        elif self.colors[index - 1] != color:
            self.colors = [*self.colors[:index - 1], color, *self.colors[index:]]

    def check_transmit(self, print_time=None):
        """Show the colours if they have changed."""
        colors = self.colors
        if colors != self.sent_colors:
            self.sent_colors = colors
            self.printer.get_reactor().register_callback(
                lambda eventtime: self._transmit(colors, print_time))

    def transmit_again(self):
        """Show the colours, whatever is shown."""
        self.sent_colors = None
        self.check_transmit()

    def _transmit(self, colors, print_time):
        with self.mutex:
            self.update_func(colors, print_time)

    def _read_index(self, gcmd):
        return gcmd.get_int("INDEX", None, minval=1, maxval=self.led_count)

    cmd_SET_LED_help = "Set the color of an LED"

    def cmd_SET_LED(self, gcmd):
        color = tuple(gcmd.get_float(channel.upper(), 0.0, minval=0.0, maxval=1.0)
                      for channel in CHANNELS)
        index = self._read_index(gcmd)
        is_shown = gcmd.get_int("TRANSMIT", 1)

        def apply(print_time):
            self.set_color(index, color)
            if is_shown:
                self.check_transmit(print_time)

        if gcmd.get_int("SYNC", 1):
            self.printer.lookup_object("toolhead").register_lookahead_callback(apply)
        else:
            apply(None)

    cmd_SET_LED_TEMPLATE_help = "Assign a display_template to an LED"

    def cmd_SET_LED_TEMPLATE(self, gcmd):
        index = self._read_index(gcmd)
        indices = range(1, self.led_count + 1) if index is None else [index]
        for number in indices:
            self.evaluator.set_template(
                gcmd, (self, number), partial(self._show_text, number),
                self.check_transmit)

    def _show_text(self, index, text):
        self.set_color(index, read_color(text))

    def get_status(self, eventtime=None):
        return {"color_data": [list(color) for color in self.colors]}


def read_color(text):
    """(r, g, b, w) of a template's text like '1, 0.5'.  Raises ValueError."""
    parts = [part.strip() for part in text.split(",")]
    try:
        values = [float(part) if part else 0.0 for part in parts]
    except ValueError:
        values = []
    if not 1 <= len(values) <= 4 or any(value != value for value in values):
        raise ValueError(
            "it gives '%s'; a color is up to four numbers from 0 to 1 with commas"
            " between them: red, green, blue, white" % (text,))
    values += [0.0] * (4 - len(values))
    return tuple(min(max(value, 0.0), 1.0) for value in values)


class PrinterLED:
    """Object `led`: makes helpers for the drivers of lights."""

    def setup_helper(self, config, update_func, led_count=1):
        """As LEDHelper()."""
        return LEDHelper(config, update_func, led_count)


class PrinterPWMLED:
    """Up to four pwm pins of a section [led name]."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        cycle_time = config.getfloat("cycle_time", 0.010, above=0.0, maxval=3.0)
        is_hard = config.getboolean("hardware_pwm", False)
        ppins = printer.lookup_object("pins")
        self.pins = []                   # (channel index, pin)
        for index, channel in enumerate(CHANNELS):
            name = config.get(channel + "_pin", None)
            if name is not None:
                pin = ppins.setup_pin("pwm", name)
                pin.setup_max_duration(0.0)
                pin.setup_cycle_time(cycle_time, is_hard)
                self.pins.append((index, pin))
        if not self.pins:
            raise config.error(
                "Section '%s' needs a pin: red_pin, green_pin, blue_pin or white_pin"
                % (config.get_name(),))
        self.last_print_time = 0.0
        led = printer.load_object(config, "led")
        self.helper = led.setup_helper(config, self._update)
        self.last_color = self.helper.colors[0]
        self.helper.sent_colors = self.helper.colors
        for index, pin in self.pins:
            pin.setup_start_value(self.last_color[index], 0.0)
        self.get_status = self.helper.get_status

    def _update(self, colors, print_time):
        mcu = self.pins[0][1].get_mcu()
        if print_time is None:
            eventtime = self.printer.get_reactor().monotonic()
            print_time = mcu.estimated_print_time(eventtime) + mcu.min_schedule_time()
        print_time = max(print_time, self.last_print_time + MIN_UPDATE_TIME)
        color = colors[0]
        for index, pin in self.pins:
            if color[index] != self.last_color[index]:
                pin.set_pwm(print_time, color[index])
                self.last_print_time = print_time
        self.last_color = color


def load_config(config):
    return PrinterLED()


def load_config_prefix(config):
    return PrinterPWMLED(config)
