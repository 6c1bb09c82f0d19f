# SPDX-License-Identifier: GPL-3.0-or-later
"""HeatWatch by itself: what is no fault, and what it learns."""
import heat_world
import pytest
import watch_faults

from klippy.extras import heat_watch


def test_gap_between_readings_is_no_fault():
    watch = heat_watch.HeatWatch(heat_watch.EXTRUDER)
    for _ in range(200):
        assert not watch.update(0.3, 25.0, 0.0, 0.0, 0.0, 0.0)
    assert not watch.update(60.0, 180.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(300):
        assert not watch.update(0.3, 180.0 - 0.2 * i, 0.0, 0.0, 0.0, 0.0)


def test_single_wrong_readings_are_no_fault():
    watch = heat_watch.HeatWatch(heat_watch.EXTRUDER)
    for i in range(3000):
        temp = 90.0 if i % 300 == 150 else 25.0
        assert not watch.update(0.3, temp, 0.0, 0.0, 0.0, 0.0), i


def test_known_values_are_taken():
    watch = heat_watch.HeatWatch(heat_watch.BED)
    watch.set_known(0.36, [0.006, 0.006, 0.007, 0.007])
    assert watch.rate == 0.36 and watch.get_holds() == [0.006, 0.006, 0.007, 0.007]


def test_first_climb_is_learned_from_the_room():
    """A machine that heats at once, before it was seen to rest."""
    world = watch_faults.make_world(watch_faults.MODULES, "heater_bed", 20334, "pid")
    world.is_script = True
    world.run(3.0)
    world.target = 80.0
    world.run(900.0)
    true_rate = world.power / (world.capacity + world.element_capacity)
    assert world.guard.watch.rate == pytest.approx(true_rate, rel=0.4)


def test_swings_of_an_on_off_control_are_learned_from():
    world = watch_faults.make_world(watch_faults.MODULES, "extruder", 4, "watermark")
    world.is_script = True
    world.run(60.0)
    world.target = 200.0
    world.run(600.0)
    assert world.control == heat_world.WATERMARK
    true_rate = world.power / (world.capacity + world.element_capacity)
    assert world.guard.watch.rate == pytest.approx(true_rate, rel=0.5)
    true_hold = world.loss / world.power
    assert world.guard.watch.get_holds()[0] == pytest.approx(true_hold, rel=0.5)
