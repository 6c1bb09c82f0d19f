# SPDX-License-Identifier: GPL-3.0-or-later
"""[adc_scaled name]: analog pins measured against a board's own reference and ground.

A pin `name:pin` is pin of the mcu, as a share of what lies between vssa_pin and
vref_pin.  The mcu knows nothing of these: it sees an open sensor as one at vref, so
that the range is checked here as well.
"""
from klippy import pins

SAMPLE_TIME = 0.001
SAMPLE_COUNT = 8
REPORT_TIME = 0.300
# Reference and ground that are nearer (share of full scale) cannot be right
MIN_SPAN = 0.25
REASON = "ADC out of range"


class Smoothed:
    """The mean of a reference pin over the last smooth_time s."""

    def __init__(self, smooth_time):
        self.smooth_time = smooth_time
        self.last_time, self.value = None, 0.0

    def note_value(self, read_time, value):
        """Take a reading in."""
        if self.last_time is None:
            self.value = value
        else:
            share = min(1.0, (read_time - self.last_time) / self.smooth_time)
            self.value += (value - self.value) * share
        self.last_time = read_time


class RangeCheck:
    """Shuts the printer down after some readings outside minval..maxval in a row."""

    def __init__(self, main, pin):
        self.main, self.pin = main, pin
        self.minval, self.maxval, self.n_allowed = 0.0, 1.0, 0
        self.n_outside = 0

    def check(self, value, span):
        """Judge a scaled reading; span: between reference and ground."""
        if not self.n_allowed:
            return
        if span >= MIN_SPAN and self.minval <= value <= self.maxval:
            self.n_outside = 0
            return
        self.n_outside += 1
        if self.n_outside == self.n_allowed:
            self._shut_down(value, span)

    def _shut_down(self, value, span):
        main = self.main
        if span < MIN_SPAN:
            text = ("vref_pin reads %.3f and vssa_pin %.3f: check their wiring"
                    % (main.vref.value, main.vssa.value))
        else:
            text = "it reads %.3f, outside %.3f..%.3f of its reference" % (
                value, self.minval, self.maxval)
        main.printer.invoke_async_shutdown(
            "%s: pin '%s:%s' of [%s]: %s"
            % (REASON, main.name, self.pin, main.section, text),
            {"event_type": "adc_scaled", "reason": REASON,
             "mcu": main.mcu.get_name()})


class ScaledADC:
    """An analog pin as plug-ins know it, scaled."""

    def __init__(self, main, pin_params):
        self.main = main
        self.range_check = RangeCheck(main, pin_params["pin"])
        self.mcu_adc = main.mcu.setup_pin("adc", pin_params)
        self.part = getattr(self.mcu_adc, "part", None)
        self.callback = None
        self.last_state = (0.0, 0.0)

    def get_mcu(self):
        """The MCU of this pin."""
        return self.mcu_adc.get_mcu()

    def setup_adc_sample(self, report_time, sample_time, sample_count=1, batch_num=1,
                         minval=0.0, maxval=1.0, range_check_count=0):
        """As MCU_adc; the range is checked before and after scaling."""
        self.mcu_adc.setup_adc_sample(report_time, sample_time, sample_count, batch_num,
                                      minval, maxval, range_check_count)
        self._setup_range(minval, maxval, range_check_count)

    def setup_minmax(self, sample_time, sample_count, minval=0.0, maxval=1.0,
                     range_check_count=0):
        """As MCU_adc."""
        self.mcu_adc.setup_minmax(sample_time, sample_count, minval, maxval,
                                  range_check_count)
        self._setup_range(minval, maxval, range_check_count)

    def _setup_range(self, minval, maxval, count):
        check = self.range_check
        check.minval, check.maxval, check.n_allowed = minval, maxval, count

    def setup_adc_callback(self, callback, old_callback=None):
        """As MCU_adc, with scaled values."""
        if old_callback is None:
            self.callback = callback
            self.mcu_adc.setup_adc_callback(self._handle_samples)
        else:
            self.callback = lambda samples: [old_callback(t, v) for t, v in samples]
            self.mcu_adc.setup_adc_callback(
                callback, lambda t, v: self._handle_samples([(t, v)]))

    def get_last_value(self):
        """The last scaled reading as (value, read_time)."""
        return self.last_state

    def _handle_samples(self, samples):
        main = self.main
        if main.vref.last_time is None or main.vssa.last_time is None:
            return              # what they mean is not known yet
        low, span = main.vssa.value, main.vref.value - main.vssa.value
        scaled = []
        for read_time, value in samples:
            value = min(max((value - low) / max(span, 1e-6), 0.0), 1.0)
            self.range_check.check(value, span)
            scaled.append((read_time, value))
        self.last_state = (scaled[-1][1], scaled[-1][0])
        self.callback(scaled)


class PrinterADCScaled:
    """A chip of pins, by the section's name."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.section = config.get_name()
        self.name = self.section.split()[1]
        smooth_time = config.getfloat("smooth_time", 2.0, above=0.0)
        self.vref, self.vssa = Smoothed(smooth_time), Smoothed(smooth_time)
        vref = self._setup(config, "vref", self.vref)
        vssa = self._setup(config, "vssa", self.vssa)
        if vref.get_mcu() is not vssa.get_mcu():
            raise config.error("Section '%s': vref_pin and vssa_pin must be of one mcu"
                               % (self.section,))
        self.mcu = vref.get_mcu()
        pins.get(self.printer).register_chip(self.name, self)

    def _setup(self, config, kind, smoothed):
        adc = pins.get(self.printer).setup_pin("adc", config.get(kind + "_pin"))
        adc.setup_adc_sample(REPORT_TIME, SAMPLE_TIME, SAMPLE_COUNT)
        adc.setup_adc_callback(
            lambda samples: smoothed.note_value(*samples[-1]))
        self.printer.load_object(config, "query_adc").register_adc(
            "%s:%s" % (self.name, kind), adc)
        return adc

    def setup_pin(self, pin_type, pin_params):
        """The object for a pin; only adc."""
        if pin_type != "adc":
            raise pins.error("Pin '%s:%s': [%s] has analog inputs only"
                             % (self.name, pin_params["pin"], self.section))
        return ScaledADC(self, pin_params)


def load_config_prefix(config):
    return PrinterADCScaled(config)
