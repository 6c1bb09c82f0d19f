# SPDX-License-Identifier: GPL-3.0-or-later
"""MPC_CALIBRATE finds what the simulated machine is made of."""
import heating_machine as machine
import pytest

from klippy.errors import CommandError

BED_MPC = "control: mpc\nheater_power: 250\n"


@pytest.fixture
def bench(tmp_path, monkeypatch):
    def make(config):
        return machine.HeatingBench(tmp_path, monkeypatch, machine.COMMON + config)
    return make


def saved(it, section):
    pending = it.get("configfile")["save_config_pending_items"][section]
    return {name: [float(word) for word in value.split(",")]
            for name, value in pending.items() if name != "control"}


@pytest.mark.parametrize("room,first", [(25, ""), (10, "M104 S150")])
def test_hotend_is_recovered(bench, room, first):
    """Also in a cold room, and when it is warm at the start."""
    def body(it):
        if first:
            it.send("MPC_SET HEATER=extruder BLOCK_HEAT_CAPACITY=20"
                    " SENSOR_RESPONSIVENESS=0.3 AMBIENT_TRANSFER=0.1")
            it.send(first)
            it.pause(60.0)
            assert it.block() > 100.0
        it.send("MPC_CALIBRATE HEATER=extruder TARGET=200 FAN_BREAKPOINTS=3")
        values = saved(it, "extruder")
        assert values["block_heat_capacity"] == pytest.approx(
            [machine.CAPACITY], rel=0.03)
        assert values["sensor_responsiveness"] == pytest.approx(
            [machine.RESPONSIVENESS], rel=0.1)
        assert values["ambient_transfer"] == pytest.approx(
            [machine.TRANSFER], rel=0.03)
        fan = machine.FAN_TRANSFER
        assert values["fan_ambient_transfer"] == pytest.approx(
            [machine.TRANSFER + share for share in (0.0, fan / 2, fan)], abs=0.003)
        check_control(it)
    bench(machine.MPC + "[simulator]\nambient_temp: %d\n" % room).run_ready(body)


def check_control(it):
    """The values are in use without a restart."""
    assert it.heater().target_temp == 0.0
    it.send("M104 S220")
    temps = it.follow(100.0)
    assert max(temps) < 221.0 and abs(temps[-1] - 220.0) < 0.5


def test_other_machine_and_more_breakpoints(bench):
    def body(it):
        it.send("MPC_CALIBRATE HEATER=extruder TARGET=240 FAN_BREAKPOINTS=5")
        values = saved(it, "extruder")
        assert values["block_heat_capacity"] == pytest.approx([22.0], rel=0.03)
        assert values["ambient_transfer"] == pytest.approx([0.12], rel=0.03)
        assert values["fan_ambient_transfer"] == pytest.approx(
            [0.12, 0.1275, 0.135, 0.1425, 0.15], abs=0.005)
    bench(machine.MPC.replace("40", "60") + "[simulator]\nheater_power: extruder=60\n"
          "heat_capacity: extruder=22\nheat_loss: extruder=0.12\n").run_ready(body)


def test_bed_is_recovered(bench):
    def body(it):
        it.send("MPC_CALIBRATE HEATER=heater_bed")
        values = saved(it, "heater_bed")
        assert values["block_heat_capacity"] == pytest.approx([700.0], rel=0.03)
        assert values["ambient_transfer"] == pytest.approx([1.5], rel=0.03)
        assert "fan_ambient_transfer" not in values
        it.send("M190 S60")
        temps = it.follow(120.0, "heater_bed")
        assert max(temps) < 61.0 and abs(temps[-1] - 60.0) < 0.5
    bench(machine.PID + machine.BED + BED_MPC).run_ready(body)


def test_refusals_and_ends(bench):
    def body(it):
        with pytest.raises(CommandError, match="TARGET=295.0 is too high.*290.0"):
            it.send("MPC_CALIBRATE HEATER=extruder TARGET=295")
        with pytest.raises(CommandError, match="FAN_BREAKPOINTS"):
            it.send("MPC_CALIBRATE HEATER=extruder FAN_BREAKPOINTS=1")
        interrupts = it.printer.lookup_object("gcode").interrupts
        reactor = it.printer.get_reactor()
        reactor.register_callback(lambda now: interrupts.note_arrival("M108"),
                                  reactor.monotonic() + 50.0)
        with pytest.raises(CommandError, match="MPC_CALIBRATE was ended"):
            it.send("MPC_CALIBRATE HEATER=extruder")
        assert it.heater().target_temp == 0.0
        assert it.heater().control.explain_unready() is not None
        it.pause(2.0)
        assert it.machine.thermal.heaters[0].duty == 0.0
        assert not it.get("configfile")["save_config_pending"]
    bench(machine.MPC).run_ready(body)
