# SPDX-License-Identifier: GPL-3.0-or-later
"""The two sensors of a SAM D51 or E5x: one voltage rises with heat, one falls.

Their maker has read both at two temperatures.  Only the ratio of the two
readings counts, so that neither the supply's voltage nor that of the
maker's reference has to be known.  As a reading alone tells nothing, it is
the host that keeps watch over the range.
Source: data sheet DS60001507, 45.6.3.1 and the temperature log row (9.6).
"""
from klippy.record import record

FALLING_PIN = "ADC_TEMPERATURE_CTAT"
FAMILIES = ("samd51", "same51", "same53", "same54")
LOG_ROW = 0x00800100
N_LOG_WORDS = 3


@record(frozen=True)
class Reading:
    """Readings of both sensors at a temperature in degC."""

    temperature: float
    rising: int
    falling: int


def decode_log(words):
    """The Readings at room temperature and in the heat, low one first.

    words: the 32-bit words of the log row.
    """
    room = (words[0] & 0xff) + 0.1 * (words[0] >> 8 & 0xf)
    hot = (words[0] >> 12 & 0xff) + 0.1 * (words[0] >> 20 & 0xf)
    return (Reading(room, words[1] >> 8 & 0xfff, words[2] & 0xfff),
            Reading(hot, words[1] >> 20 & 0xfff, words[2] >> 12 & 0xfff))


class TwinCurve:
    """degC over the ratio of the two readings."""

    def __init__(self, low, high):
        """low, high: Reading.  Raises ValueError if they tell nothing."""
        self.low = low
        self.span = high.temperature - low.temperature
        self.rise = high.rising - low.rising
        self.fall = high.falling - low.falling
        # how fast the ratio changes: both sensors as the data sheet says
        if self.span <= 0.0 or self.rise * low.falling <= self.fall * low.rising:
            raise ValueError("no calibration")

    def calc_temp(self, rising, falling):
        """degC of two readings, by the straight lines through the maker's."""
        ratio = self.rise * falling - self.fall * rising
        if ratio <= 0.0:
            return self.low.temperature
        share = (self.low.falling * rising - self.low.rising * falling) / ratio
        return self.low.temperature + share * self.span


class TwinSensor:
    """Converter of an ADC sensor that keeps the other one's reading."""

    def __init__(self, curve):
        self.curve = curve
        self.falling = None

    def note_falling(self, samples):
        """Take reports of the sensor whose voltage falls."""
        self.falling = samples[-1][1]

    @property
    def is_ready(self):
        """Whether both sensors have been read."""
        return self.falling is not None

    def calc_temp(self, adc):
        """degC by the other sensor's reading."""
        if not self.falling:
            return self.curve.low.temperature
        return self.curve.calc_temp(adc, self.falling)


class RangeWatch:
    """Tells when readings have been outside a range so many times in a row."""

    def __init__(self, low, high, n_allowed):
        """low, high: degC."""
        self.low, self.high, self.n_allowed = low, high, n_allowed
        self.n_outside = 0

    def note(self, temperature):
        """True for the reading that makes the number full."""
        if self.low <= temperature <= self.high:
            self.n_outside = 0
            return False
        self.n_outside += 1
        return self.n_outside == self.n_allowed
