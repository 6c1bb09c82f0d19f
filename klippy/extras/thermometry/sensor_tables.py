# SPDX-License-Identifier: GPL-3.0-or-later
"""Temperature curves of platinum sensors and thermocouple amplifiers.

Everything is computed from the published physics: IEC 60751 for
platinum, the NIST ITS-90 reference functions for thermocouples, and the
gain and trim point of each amplifier's data sheet.
"""
import math

# IEC 60751: R = R0 * (1 + A*T + B*T^2 [+ C*(T-100)*T^3 below 0 degC])
PLATINUM_A = 3.9083e-3
PLATINUM_B = -5.775e-7
PLATINUM_C = -4.183e-12

# NIST monograph 175, mV from degC, rising powers; ranges in degC.
TYPE_K_BELOW_0 = (
    0.0, 0.394501280250e-1, 0.236223735980e-4, -0.328589067840e-6,
    -0.499048287770e-8, -0.675090591730e-10, -0.574103274280e-12,
    -0.310888728940e-14, -0.104516093650e-16, -0.198892668780e-19,
    -0.163226974860e-22)
TYPE_K_ABOVE_0 = (
    -0.176004136860e-1, 0.389212049750e-1, 0.185587700320e-4,
    -0.994575928740e-7, 0.318409457190e-9, -0.560728448890e-12,
    0.560750590590e-15, -0.320207200030e-18, 0.971511471520e-22,
    -0.121047212750e-25)
TYPE_K_BUMP = (0.118597600000, -0.118343200000e-3, 126.9686)
TYPE_J_BELOW_760 = (
    0.0, 0.503811878150e-1, 0.304758369300e-4, -0.856810657200e-7,
    0.132281952950e-9, -0.170529583370e-12, 0.209480906970e-15,
    -0.125383953360e-18, 0.156317256970e-22)

# Amplifier: (type, gain, offset in mV at the output, or the degC at
# which the output is trimmed to 5 mV/degC).
AD59X = {"AD595": ("K", 247.3, 0.011), "AD597": ("K", 245.46, 0.028)}
AD849X = {"AD8494": ("J", 96.7, 25.0), "AD8495": ("K", 122.4, 25.0),
          "AD8496": ("J", 90.35, 60.0), "AD8497": ("K", 122.4, 60.0)}

# PT100 board: the sensor under 4.4 kohm at 5 V, amplified tenfold.
PT100_BOARD_SERIES = 4400.0
PT100_BOARD_SUPPLY = 5.0
PT100_BOARD_GAIN = 10.0


def calc_platinum_resistance(temperature, r0):
    """Ohm of a platinum sensor with r0 ohm at 0 degC."""
    ratio = 1.0 + temperature * (PLATINUM_A + PLATINUM_B * temperature)
    if temperature < 0.0:
        ratio += PLATINUM_C * (temperature - 100.0) * temperature ** 3
    return r0 * ratio


def calc_thermocouple_mv(kind, temperature):
    """mV of a type K or J junction against a 0 degC reference."""
    if kind == "J":
        return _polynomial(TYPE_J_BELOW_760, temperature)
    if temperature < 0.0:
        return _polynomial(TYPE_K_BELOW_0, temperature)
    height, width, center = TYPE_K_BUMP
    bump = height * math.exp(width * (temperature - center) ** 2)
    return _polynomial(TYPE_K_ABOVE_0, temperature) + bump


def _polynomial(coefficients, x):
    total = 0.0
    for c in reversed(coefficients):
        total = total * x + c
    return total


def _ad59x_volts(name, temperature):
    kind, gain, offset = AD59X[name]
    return (calc_thermocouple_mv(kind, temperature) + offset) * gain / 1000.0


def _ad849x_volts(name, temperature):
    kind, gain, trimmed = AD849X[name]
    offset = 5.0 * trimmed - gain * calc_thermocouple_mv(kind, trimmed)
    return (gain * calc_thermocouple_mv(kind, temperature) + offset) / 1000.0


def _pt100_volts(temperature):
    resistance = calc_platinum_resistance(temperature, 100.0)
    fraction = resistance / (PT100_BOARD_SERIES + resistance)
    return PT100_BOARD_GAIN * PT100_BOARD_SUPPLY * fraction


def voltage_tables():
    """{sensor type: [(degC, volt), ...]} of the built-in voltage sensors."""
    tables = {name: [(t, _ad59x_volts(name, t)) for t in range(-200, 1351, 10)]
              for name in AD59X}
    for name, (kind, _, _) in AD849X.items():
        top = 760 if kind == "J" else 1300
        tables[name] = [(t, _ad849x_volts(name, t))
                        for t in range(-180, top + 1, 10)]
    tables["PT100 INA826"] = [(t, _pt100_volts(t)) for t in range(0, 851, 10)]
    return tables


def resistance_tables():
    """{sensor type: [(degC, ohm), ...]} of the built-in resistors."""
    return {"PT1000": [(t, calc_platinum_resistance(t, 1000.0))
                       for t in range(-50, 651, 10)]}
