# SPDX-License-Identifier: GPL-3.0-or-later
"""[homing_heaters] on a machine that homes with a warm heater."""
import pytest
from motion_bench import MotionBench
from motion_machine import PRINTER

SECTION = """
[homing_heaters]
%s
"""


def run(tmp_path, monkeypatch, options, body, is_ready=True):
    bench = MotionBench(tmp_path, monkeypatch, PRINTER + SECTION % (options,))
    (bench.run_ready if is_ready else bench.run)(body)


def watch_heater(it):
    """Records (homing axis or None, duty) while G28 runs."""
    pin = it.machine.pins.lookup("PB4")
    return it.machine.mcus["mcu"].watch_output(pin.number)


@pytest.mark.parametrize("options,off_axes", [
    ("", "XYZ"), ("steppers: stepper_z", "Z"), ("heaters: extruder", "XYZ"),
    ("steppers: stepper_x, stepper_y", "XY")])
def test_targets_while_homing(tmp_path, monkeypatch, options, off_axes):
    def body(it):
        targets = {}
        heater = it.printer.lookup_object("extruder").get_heater()

        def note(homing_move):
            name = homing_move.get_mcu_endstops()[0].get_steppers()[0].get_name()
            targets.setdefault(name[-1].upper(), []).append(heater.target_temp)

        it.printer.register_event_handler("homing:homing_move_begin", note)
        it.send("M104 S100\nG28")
        for axis in "XYZ":
            expected = 0.0 if axis in off_axes else 100.0
            assert set(targets[axis]) == {expected}
        assert it.get("extruder")["target"] == 100.0
    run(tmp_path, monkeypatch, options, body)


def test_heater_is_off_at_the_pin(tmp_path, monkeypatch):
    def body(it):
        it.send("M104 S200")
        it.pause(2.0)
        duty = watch_heater(it)
        shares = []
        it.printer.register_event_handler(
            "homing:homing_move_begin", lambda move: duty.read_duty())
        it.printer.register_event_handler(
            "homing:homing_move_end", lambda move: shares.append(duty.read_duty()))
        it.send("G28 X")
        # a fast approach of more than a second, of which the pwm delay is lost
        assert shares[0] < 0.5
        it.pause(2.0)
        duty.read_duty()
        it.pause(1.0)
        assert duty.read_duty() == pytest.approx(1.0, abs=0.01)
    run(tmp_path, monkeypatch, "", body)


def test_targets_come_back_after_an_error(tmp_path, monkeypatch):
    def body(it):
        it.send("M104 S100")
        pin = it.machine.pins.lookup("^PE5")
        it.machine.mcus["mcu"].bind_switch(pin.number, [], [], -1.0)
        with pytest.raises(it.printer.command_error, match="No trigger"):
            it.send("G28 X")
        assert it.get("extruder")["target"] == 100.0
    run(tmp_path, monkeypatch, "", body)


@pytest.mark.parametrize("options,message", [
    ("heaters: bed", "there is no bed; known are extruder"),
    ("steppers: stepper_q", "there is no stepper_q; known are stepper_x")])
def test_unknown_names(tmp_path, monkeypatch, options, message):
    def body(it):
        assert message in it.printer.state_message
    run(tmp_path, monkeypatch, options, body, False)
