# SPDX-License-Identifier: GPL-3.0-or-later
"""A lumped model of a heater: what its block, sensor and losses do.

    C dT/dt = P u - h (T - Ta) - f (T - Tf)        block
      dS/dt = k (T - S)                            sensor

with P the heater's power, u its duty, C the heat capacity, h the transfer to
the air (more of it with a fan), f the heat that filament carries away, and k
the responsiveness of the sensor.  A step is exact for constant inputs, so
that steps may be of any length.
"""
import math

# Rates closer than this (relative) are told apart to keep the solution finite
RATE_GAP = 1e-6


def calc_filament_transfer(speed, diameter, density, heat_capacity):
    """W/K that filament of so many mm/s carries away per degree it is heated.

    diameter: mm.  density: g/cm^3.  heat_capacity: J/g/K.
    """
    area = 0.25 * math.pi * diameter * diameter
    return max(speed, 0.0) * area * density * 1e-3 * heat_capacity


def interpolate_transfer(table, speed):
    """W/K of a table for evenly spaced fan speeds from 0 to 1, at one speed."""
    if not table:
        return 0.0
    place = min(max(speed, 0.0), 1.0) * (len(table) - 1)
    index = min(int(place), max(len(table) - 2, 0))
    upper = table[min(index + 1, len(table) - 1)]
    return table[index] + (upper - table[index]) * (place - index)


class ThermalModel:
    """States and parameters of one heater.

    power: W.  capacity: J/K.  responsiveness: 1/s.  transfer: W/K to the air.
    block, sensor, ambient: degC.
    """

    def __init__(self, power, capacity, responsiveness, transfer):
        self.set_parameters(power, capacity, responsiveness, transfer)
        self.extra_transfer = self.filament_transfer = 0.0
        self.filament_temp = 0.0
        self.reset(0.0, 0.0)

    def set_parameters(self, power, capacity, responsiveness, transfer):
        """Exchange all parameters; ValueError if they make no heater."""
        if not (power > 0.0 and capacity > 0.0 and responsiveness > 0.0
                and transfer >= 0.0):
            raise ValueError(
                "a heater has power, heat capacity and responsiveness above 0 and"
                " transfer not below, not %s, %s, %s, %s"
                % (power, capacity, responsiveness, transfer))
        self.power, self.capacity = power, capacity
        self.responsiveness, self.transfer = responsiveness, transfer

    def reset(self, temp, ambient):
        """Block and sensor are at temp."""
        self.block = self.sensor = temp
        self.ambient = ambient

    def set_losses(self, extra_transfer, filament_transfer, filament_temp):
        """More transfer to the air, and to filament (W/K, degC), from now on."""
        self.extra_transfer = extra_transfer
        self.filament_transfer = filament_transfer
        self.filament_temp = filament_temp

    def calc_loss(self, temp):
        """W that a block at temp loses to the air."""
        return (self.transfer + self.extra_transfer) * (temp - self.ambient)

    def calc_filament_loss(self, temp):
        """W that a block at temp loses to filament."""
        return self.filament_transfer * (temp - self.filament_temp)

    def predict(self, elapsed, duty):
        """Go `elapsed` s ahead with the heater at duty (0..1)."""
        loss = self.transfer + self.extra_transfer + self.filament_transfer
        # K/s that act on the block whatever its temperature
        drive = (duty * self.power
                 + (self.transfer + self.extra_transfer) * self.ambient
                 + self.filament_transfer * self.filament_temp) / self.capacity
        rate = loss / self.capacity
        if rate < RATE_GAP * self.responsiveness:
            # no losses to speak of: a straight line
            return self._follow_line(elapsed, drive - rate * self.block)
        return self._follow_decay(elapsed, drive / rate, rate)

    def _follow_decay(self, elapsed, final, rate):
        lag_rate = self.responsiveness
        if abs(lag_rate - rate) < RATE_GAP * rate:
            lag_rate = rate * (1.0 + RATE_GAP)
        offset = self.block - final
        decay = math.exp(-rate * elapsed)
        share = offset * lag_rate / (lag_rate - rate)
        own = self.sensor - final - share
        self.block = final + offset * decay
        self.sensor = final + share * decay + own * math.exp(-lag_rate * elapsed)
        return 0

    def _follow_line(self, elapsed, slope):
        lag = 1.0 / self.responsiveness
        own = self.sensor - self.block + slope * lag
        self.block += slope * elapsed
        self.sensor = self.block - slope * lag + own * math.exp(-elapsed / lag)
        return 0

    def correct(self, sensor_change, block_change, ambient_change):
        """Shift the states by so many degrees (of an observer)."""
        self.sensor += sensor_change
        self.block += block_change
        self.ambient += ambient_change
