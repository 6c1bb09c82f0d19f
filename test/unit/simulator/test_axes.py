# SPDX-License-Identifier: GPL-3.0-or-later
"""Axes of each kinematics: step lengths, switches and start positions."""
import pytest

from klippy.errors import ConfigError
from klippy.simulator import axes, curved
from klippy.simulator.settings import MachineConfig, Section

STEPPER = {"step_pin": "PA0", "dir_pin": "PA1", "microsteps": "16",
           "rotation_distance": "40", "endstop_pin": "^PB0",
           "position_endstop": "0", "position_max": "200"}


def machine(kinematics, **overrides):
    sections = {"printer": {"kinematics": kinematics}}
    for letter in "xyz":
        name = "stepper_" + letter
        sections[name] = {**STEPPER, **overrides.get(name, {})}
    return MachineConfig(sections)


def count_to_close(switch, direction, motors):
    """Steps until a switch closes when motors move in step by `direction`."""
    for n in range(100000):
        total = sum(f * n * direction * motors.get(name, 0)
                    for name, f in switch.coefficients.items())
        is_closed = (total > switch.threshold if switch.is_above
                     else total < switch.threshold)
        if is_closed:
            return n
    raise AssertionError("never closed")


def test_step_dist_counts_gears():
    section = Section("extruder", {
        "rotation_distance": "22.5", "microsteps": "32",
        "full_steps_per_rotation": "400", "gear_ratio": "50:10, 3:2"})
    assert axes.calc_step_dist(section) == pytest.approx(
        22.5 / (400 * 32 * 5 * 1.5))


@pytest.mark.parametrize("option, value, wanted", [
    ("gear_ratio", "five", "like 80:20"), ("gear_ratio", "0:1", "above 0"),
    ("gear_ratio", "3:1, 1:0", "above 0"), ("gear_ratio", "-2:1", "above 0"),
    ("gear_ratio", "e:1", "like 80:20"), ("gear_ratio", "1e999:1", "finite"),
    ("microsteps", "0", "above 0"), ("full_steps_per_rotation", "0", "above 0"),
    ("rotation_distance", "0", "above 0"), ("rotation_distance", "nan", "above 0"),
])
def test_bad_step_option_names_section_value_and_remedy(option, value, wanted):
    section = Section("extruder", {"rotation_distance": "1", "microsteps": "1",
                                   option: value})
    with pytest.raises(ConfigError) as info:
        axes.calc_step_dist(section)
    text = str(info.value)
    assert "extruder" in text and option in text and wanted in text
    assert value.split(",")[-1].strip() in text


@pytest.mark.parametrize("endstop,direction", [("0", -1), ("200", 1)])
def test_cartesian_switch_closes_exactly_at_the_endstop(endstop, direction):
    config = machine("cartesian", stepper_x={"position_endstop": endstop})
    built = axes.build_axes(config)
    start = built.start["x"]
    assert 0.0 < start < 200.0
    steps = count_to_close(built.switches[0], direction, {"stepper_x": 1})
    position = start + direction * steps * 0.0125
    assert position == pytest.approx(float(endstop), abs=1e-9)


def test_corexy_switch_follows_both_motors():
    built = axes.build_axes(machine("corexy"))
    x_switch, y_switch = built.switches[:2]
    assert built.mixes["x"] == {"stepper_x": 0.00625, "stepper_y": 0.00625}
    n = count_to_close(x_switch, -1, {"stepper_x": 1, "stepper_y": 1})
    assert built.start["x"] - n * 0.0125 == pytest.approx(0.0, abs=1e-9)
    n = count_to_close(y_switch, -1, {"stepper_x": 1, "stepper_y": -1})
    assert built.start["y"] - n * 0.0125 == pytest.approx(0.0, abs=1e-9)


def test_second_z_motor_closes_its_own_switch():
    config = machine("cartesian")
    config.sections["stepper_z1"] = Section("stepper_z1", {
        "step_pin": "PC0", "dir_pin": "PC1", "endstop_pin": "PC2"})
    built = axes.build_axes(config)
    assert built.switches[-1].pin == "PC2"
    assert list(built.switches[-1].coefficients) == ["stepper_z1"]


def test_start_position_can_be_given():
    built = axes.build_axes(machine("cartesian"), (10.0, 20.0, 30.0))
    assert built.start == pytest.approx({"x": 10.0, "y": 20.0, "z": 30.0})
    counts = {"stepper_x": 80, "stepper_y": -80, "stepper_z": 0}
    assert built.calc_carriages(counts) == pytest.approx(
        {"x": 11.0, "y": 19.0, "z": 30.0})


def delta():
    tower = {"step_pin": "PA0", "dir_pin": "PA1", "endstop_pin": "PB0",
             "microsteps": "16", "rotation_distance": "40"}
    return MachineConfig({
        "printer": {"kinematics": "delta", "delta_radius": "174.75"},
        "stepper_a": {**tower, "position_endstop": "297.05",
                      "arm_length": "333"},
        "stepper_b": {"step_pin": "PA2"}, "stepper_c": {"step_pin": "PA3"}})


def test_delta_starts_in_the_middle_and_homes_upwards():
    config = delta()
    config.sections["stepper_b"].options["endstop_pin"] = "PB1"
    config.sections["stepper_c"].options["endstop_pin"] = "PB2"
    built = axes.build_axes(config)
    x, y, z = curved.calc_delta_point(config, built.start)
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert z == pytest.approx(built.start["a"])
    assert 0.0 < z < 297.05
    for switch, name in zip(built.switches, "abc", strict=True):
        n = count_to_close(switch, 1, {"stepper_" + name: 1})
        assert built.start[name] + n * 0.0125 == pytest.approx(297.05)


def test_delta_point_inverts_the_tower_equation():
    config = delta()
    for name in "bc":
        config.sections["stepper_" + name].options["endstop_pin"] = "PB1"
    import math
    point = (31.0, -22.0, 14.0)
    heights = {}
    for name, angle in zip("abc", (210, 330, 90), strict=True):
        tx = 174.75 * math.cos(math.radians(angle))
        ty = 174.75 * math.sin(math.radians(angle))
        carriage = point[2] + math.sqrt(
            333.0 ** 2 - (tx - point[0]) ** 2 - (ty - point[1]) ** 2)
        heights[name] = carriage - math.sqrt(333.0 ** 2 - 174.75 ** 2)
    assert curved.calc_delta_point(config, heights) == pytest.approx(point)
