# SPDX-License-Identifier: GPL-3.0-or-later
"""StallWatch against a heater of one mass, integrated here."""
import pytest

from klippy.extras import heat_stall

ROOM = 25.0


class Heater:
    """degC/s at full power, share of it lost a degree; what shows of it."""

    def __init__(self, rate=4.0, loss=0.0016):
        self.rate, self.loss = rate, loss
        self.temp = self.seen = ROOM
        self.is_stuck = False
        self.hold = 0.0
        self.watch = heat_stall.StallWatch(heat_stall.EXTRUDER)

    def run(self, seconds, duty, fan=0, supply=1.0, losses=1.0):
        """Seconds until a fault, and the fault; or the time asked for, and NONE."""
        for i in range(int(seconds / 0.3)):
            above = self.temp - ROOM
            self.temp += 0.3 * self.rate * (
                supply * duty - losses * self.loss * above)
            before = self.seen
            if not self.is_stuck:
                self.seen = self.temp
            code = self.watch.update(0.3, self.seen, self.seen - before, duty,
                                     self.seen - ROOM, fan, 0.0, self.hold)
            if code:
                return 0.3 * i, code
        return seconds, heat_stall.NONE


def test_sensor_that_sticks_in_the_first_climb():
    heater = Heater()
    assert heater.run(25.0, 1.0)[1] == heat_stall.NONE
    heater.is_stuck = True
    seconds, code = heater.run(60.0, 1.0)
    assert code == heat_stall.TOO_COLD and seconds < 12.0


def test_climb_to_the_end_is_no_fault():
    heater = Heater()
    assert heater.run(1000.0, 1.0)[1] == heat_stall.NONE
    assert heater.temp > 600.0


@pytest.mark.parametrize("supply,losses,fan", [(0.85, 1.0, 0), (1.0, 1.8, 1)])
def test_weaker_supply_or_fan_in_a_climb_is_no_fault(supply, losses, fan):
    heater = Heater()
    heater.run(30.0, 1.0)
    assert heater.run(300.0, 1.0, fan, supply, losses)[1] == heat_stall.NONE


def test_full_power_without_an_answer_after_hours():
    """An on-off control whose sensor sticks below its target."""
    heater = Heater()
    heater.run(42.0, 1.0)
    for _ in range(60):
        assert heater.run(20.0, 0.2)[1] == heat_stall.NONE
    heater.is_stuck = True
    seconds, code = heater.run(100.0, 1.0)
    assert code == heat_stall.TOO_COLD and seconds < 40.0


def test_heat_that_stays_without_power():
    heater = Heater()
    heater.run(40.0, 1.0)
    heater.is_stuck = True
    seconds, code = heater.run(400.0, 0.0)
    assert code == heat_stall.TOO_WARM and seconds < 300.0


def test_cooling_is_no_fault():
    heater = Heater()
    heater.run(40.0, 1.0)
    assert heater.run(2000.0, 0.0)[1] == heat_stall.NONE


def stay_warm(is_stuck):
    """Held at 45 degC for an hour and off for another: the fault."""
    watch = heat_stall.StallWatch(heat_stall.BED)
    temp = 45.0
    for i in range(24000):
        duty = 0.1 if i < 12000 else 0.0
        before = temp
        if not duty and not is_stuck:
            temp -= 0.3 * (temp - ROOM) / 2000.0
        code = watch.update(0.3, temp, temp - before, duty, temp - ROOM, 0, 0.0, 0.004)
        if code:
            return code
    return heat_stall.NONE


def test_warmth_that_stays_long_after_its_power():
    """Not far enough above the room to be asked for a slope."""
    assert stay_warm(is_stuck=True) == heat_stall.TOO_WARM
    assert stay_warm(is_stuck=False) == heat_stall.NONE
