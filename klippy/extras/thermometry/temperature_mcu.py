# SPDX-License-Identifier: GPL-3.0-or-later
"""sensor_type temperature_mcu: the temperature of the chip of an mcu.

Each family's sensor gives a voltage that is a straight line over the temperature;
those of the SAM D51 are two (twin_sensor.py).
Where the maker has measured the chip, the firmware reads the values from its memory.
"""

from klippy import mcu as mcu_module
from klippy.extras import adc_temperature, twin_sensor
from klippy.mcu import absence
from klippy.record import record

PIN = "ADC_TEMPERATURE"
READ_16 = 1
READ_32 = 2
GIVE_POINTS = ("give sensor_temperature1, sensor_adc1, sensor_temperature2 and"
               " sensor_adc2")


@record(frozen=True)
class Typical:
    """Volts at a temperature in degC, and V/K, from the data sheet's table."""

    temperature: float
    volts: float
    slope: float


@record(frozen=True)
class Measured:
    """Addresses of two readings that the maker took, and at what: degC, V.

    full_scale: of a reading.
    """

    low_address: int
    high_address: int
    high_temperature: float
    reference: float = 3.3
    low_temperature: float = 30.0
    full_scale: float = 4095.0


# By the beginning of the firmware's constant MCU, the longest one first.  Data sheets:
# "Temperature sensor characteristics" and "... calibration values".
FAMILIES = {
    "rp2": Typical(27.0, 0.706, -0.001721),
    "sam3": Typical(27.0, 0.8, 0.00265),
    "sam4": Typical(27.0, 1.44, 0.0047),
    "same70": Typical(25.0, 0.72, 0.00233),
    "stm32f1": Typical(25.0, 1.43, -0.0043),
    "stm32f2": Typical(25.0, 0.76, 0.0025),
    "stm32f0": Measured(0x1ffff7b8, 0x1ffff7c2, 110.0),
    "stm32f070": Typical(30.0, 1.43, -0.0043),
    "stm32f4": Measured(0x1fff7a2c, 0x1fff7a2e, 110.0),
    "stm32f7": Measured(0x1ff0f44c, 0x1ff0f44e, 110.0),
    "stm32g0": Measured(0x1fff75a8, 0x1fff75ca, 130.0, 3.0),
    "stm32g4": Measured(0x1fff75a8, 0x1fff75ca, 130.0, 3.0),
    "stm32l4": Measured(0x1fff75a8, 0x1fff75ca, 130.0, 3.0),
    "stm32h7": Measured(0x1ff1e820, 0x1ff1e840, 110.0, full_scale=65535.0),
    "stm32h723": Measured(0x1ff1e820, 0x1ff1e840, 130.0, full_scale=65535.0),
    # the simulated board's own
    "simulator": Typical(25.0, 1.65, 0.0066),
}
# SAMD21: the temperature log row of the NVM
SAMD21_LOG = (0x00806030, 0x00806034)


class Line:
    """degC as a straight line over the ADC fraction."""

    def __init__(self):
        self.base = self.slope = 0.0

    def set_points(self, temp1, adc1, temp2, adc2):
        """Through two points."""
        self.slope = (temp2 - temp1) / (adc2 - adc1)
        self.base = temp1 - adc1 * self.slope

    def set_point(self, temp, adc):
        """Through one point, the slope as it is."""
        self.base = temp - adc * self.slope

    def set_typical(self, typical, reference):
        """By a data sheet; reference: V at full scale of the ADC."""
        self.slope = reference / typical.slope
        self.set_point(typical.temperature, typical.volts / reference)

    def calc_temp(self, adc):
        """degC at an ADC fraction."""
        return self.base + adc * self.slope

    def calc_adc(self, temp):
        """ADC fraction at degC."""
        return (temp - self.base) / self.slope if self.slope else 0.0


class PrinterTemperatureMCU(adc_temperature.PrinterADCtoTemperature):
    """A sensor; calibrated when the mcu is known, before it is configured."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.section = config.get_name()
        self.mcu_name = config.get("sensor_mcu", "mcu")
        self.reference = config.getfloat("reference_voltage", 3.3, above=0.0)
        self.points = self._read_points(config)
        self.twin = self.watch = None       # of chips with two sensors
        super().__init__(config, Line(), "%s:%s" % (self.mcu_name, PIN))
        self.printer.register_event_handler("klippy:mcu_identify",
                                            self._handle_identify)

    @staticmethod
    def _read_points(config):
        """The user's own (degC, fraction): up to two."""
        points = []
        for number in (1, 2):
            temp = config.getfloat("sensor_temperature%d" % (number,), None)
            if temp is None:
                break
            points.append((temp, config.getfloat(
                "sensor_adc%d" % (number,), minval=0.0, maxval=1.0)))
        if len(points) == 2 and points[0][1] == points[1][1]:
            raise config.error("Section '%s': sensor_adc1 and sensor_adc2 must differ"
                               % (config.get_name(),))
        return points

    def setup_minmax(self, min_temp, max_temp):
        self.range = (min_temp, max_temp)

    def _handle_identify(self):
        line, points = self.adc_convert, self.points
        mcu = mcu_module.get_printer_mcu(self.printer, self.mcu_name)
        if absence.is_absent(mcu):
            # Its calibration is in the chip: no readings until a restart
            self.mcu_adc.setup_adc_callback(None)
            return
        chip = str(mcu.get_constants().get("MCU", ""))
        if len(points) == 2:
            line.set_points(*points[0], *points[1])
        elif chip.startswith(twin_sensor.FAMILIES):
            self._add_twin(mcu)
        else:
            self._calibrate(line, mcu, chip)
            if points:
                line.set_point(*points[0])
        if self.range is not None:
            self.apply_range()

    def _add_twin(self, mcu):
        """Read the second sensor of the chip, and go by both."""
        if self.points:
            raise self._make_error("its chip has two sensors, which one point cannot"
                                   " shift; give two, or none")
        names = mcu.get_enumerations().get("pin", {})
        if PIN not in names:
            return              # no analog inputs at all: others tell of that
        if twin_sensor.FALLING_PIN not in names:
            raise self._make_error(
                "the firmware of mcu '%s' does not show the second sensor of its"
                " chip; flash a newer one, or %s" % (self.mcu_name, GIVE_POINTS))
        words = [self._read_memory(mcu, READ_32, twin_sensor.LOG_ROW + 4 * i)
                 for i in range(twin_sensor.N_LOG_WORDS)]
        try:
            curve = twin_sensor.TwinCurve(*twin_sensor.decode_log(words))
        except ValueError:
            if not mcu.is_fileoutput():
                raise self._make_uncalibrated() from None
            return
        self.twin = self.adc_convert = twin_sensor.TwinSensor(curve)
        pin = self.printer.lookup_object("pins").setup_pin(
            "adc", "%s:%s" % (self.mcu_name, twin_sensor.FALLING_PIN))
        pin.setup_adc_callback(self.twin.note_falling)
        pin.setup_adc_sample(adc_temperature.REPORT_TIME, adc_temperature.SAMPLE_TIME,
                             adc_temperature.SAMPLE_COUNT)

    def apply_range(self):
        if self.twin is None:
            super().apply_range()
        else:
            self.watch = twin_sensor.RangeWatch(
                *self.range, adc_temperature.RANGE_CHECK_COUNT)

    def _handle_samples(self, samples):
        if self.twin is not None and not self.twin.is_ready:
            return
        super()._handle_samples(samples)
        if self.watch is None:
            return
        temperature = self.adc_convert.calc_temp(samples[-1][1])
        if self.watch.note(temperature):
            self.printer.invoke_async_shutdown(
                "Sensor of '%s' (mcu '%s') reads %.1f degC, outside its range"
                " %.1f..%.1f" % (self.section, self.mcu_name, temperature, *self.range))

    def _make_error(self, text):
        return self.printer.config_error("Section '%s': %s" % (self.section, text))

    def _make_uncalibrated(self):
        return self._make_error("mcu '%s' has no calibration of its temperature sensor;"
                                " %s" % (self.mcu_name, GIVE_POINTS))

    def _calibrate(self, line, mcu, chip):
        """By what is known of the chip."""
        if chip.startswith("samd21"):
            self._set_samd21(line, mcu)
            return
        family = max((name for name in FAMILIES if chip.startswith(name)),
                     key=len, default=None)
        if family is None:
            raise self._make_error(
                "nothing is known about a temperature sensor in the '%s' of mcu '%s'."
                " If it has one, %s" % (chip, self.mcu_name, GIVE_POINTS))
        facts = FAMILIES[family]
        if isinstance(facts, Typical):
            line.set_typical(facts, self.reference)
            return
        self._set_measured(line, mcu, facts)

    def _set_measured(self, line, mcu, facts):
        scale = facts.reference / self.reference / facts.full_scale
        low, high = (self._read_memory(mcu, READ_16, address) * scale
                     for address in (facts.low_address, facts.high_address))
        if low == high:
            if not mcu.is_fileoutput():
                raise self._make_uncalibrated()
            high = low + 1.0
        line.set_points(facts.low_temperature, low, facts.high_temperature, high)

    def _set_samd21(self, line, mcu):
        """Fields of the row: degC with tenths, the 1 V reference, readings by it."""
        low, high = (self._read_memory(mcu, READ_32, address)
                     for address in SAMD21_LOG)
        room = (low & 0xff) + 0.1 * (low >> 8 & 0xf)
        hot = (low >> 12 & 0xff) + 0.1 * (low >> 20 & 0xf)
        volts = [(1.0 - to_signed(raw) / 1000.0) * reading / 4095.0
                 for raw, reading in ((low >> 24, high >> 8 & 0xfff),
                                      (high & 0xff, high >> 20 & 0xfff))]
        if volts[0] == volts[1]:
            volts[1] += 1.0
        line.set_points(room, volts[0] / self.reference,
                        hot, volts[1] / self.reference)

    @staticmethod
    def _read_memory(mcu, order, address):
        if mcu.is_fileoutput():
            return 0
        query = mcu.lookup_query_command("debug_read order=%c addr=%u",
                                         "debug_result val=%u")
        return query.send([order, address])["val"]


def to_signed(byte):
    """The number that a byte of two's complement stands for."""
    return byte - 256 if byte & 0x80 else byte


def load_config(config):
    config.get_printer().load_object(config, "heaters").add_sensor_factory(
        "temperature_mcu", PrinterTemperatureMCU)
