# SPDX-License-Identifier: GPL-3.0-or-later
"""`control: mpc` on the simulated machine, whose physics it does not share."""
import heating_machine as machine
import pytest

from klippy.errors import CommandError


@pytest.fixture
def run(tmp_path, monkeypatch):
    """run(control options, body, more) on a printer with that hotend."""
    def run(control, body, more=""):
        bench = machine.HeatingBench(
            tmp_path, monkeypatch, machine.COMMON + control + more)
        bench.run_ready(body)
        return bench
    return run


def rms(temps, target):
    return (sum((t - target) ** 2 for t in temps) / len(temps)) ** 0.5


@pytest.mark.parametrize("target", [60.0, 210.0, 280.0])
def test_step_response_has_no_overshoot(run, target):
    def body(it):
        it.send("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=%f" % target)
        temps = it.follow(150.0)
        assert max(temps) < target + 1.0
        assert all(abs(t - target) < 0.5 for t in temps[-60:])
        assert it.get("extruder")["temperature"] == pytest.approx(target, abs=0.5)
    run(machine.CALIBRATED, body)


def test_wait_ends_soon_and_at_the_target(run):
    def body(it):
        start = it.world.monotonic()
        it.send("M109 S210")
        assert it.world.monotonic() - start < 75.0
        assert abs(it.block() - 210.0) < 2.0
        assert all(abs(t - 210.0) < 1.0 for t in it.follow(20.0)[4:])
    run(machine.CALIBRATED, body)


@pytest.mark.parametrize("room", [5, 40])
def test_any_room(run, room):
    def body(it):
        it.send("M104 S210")
        temps = it.follow(120.0)
        assert max(temps) < 211.0 and abs(temps[-1] - 210.0) < 0.5
        assert it.get("extruder")["control_stats"]["temp_ambient"] == pytest.approx(
            room, abs=6.0)
    run(machine.CALIBRATED, body, "[simulator]\nambient_temp: %d\n" % room)


@pytest.mark.parametrize("factor", [0.85, 1.15])
def test_another_power_than_the_one_believed(run, factor):
    """A weak or strong supply costs time, not accuracy."""
    def body(it):
        it.send("M104 S210")
        temps = it.follow(200.0)
        assert max(temps) < 213.0
        assert all(abs(t - 210.0) < 0.5 for t in temps[-100:])
    run(machine.CALIBRATED, body,
        "[simulator]\nheater_power: extruder=%f\n" % (40.0 * factor))


def disturb_by_fan(it):
    it.send("M104 S210")
    it.pause(180.0)
    it.send("M106 S255")
    temps = it.follow(60.0)
    it.send("M107")
    return temps + it.follow(60.0)


def disturb_by_filament(it):
    it.send("M104 S240")
    it.pause(180.0)
    # 12 mm/s of 1.75 mm filament: 29 mm^3/s
    it.send("M83\nG1 E480 F720")
    return it.follow(80.0)


@pytest.mark.parametrize("disturb,target,least", [
    (disturb_by_fan, 210.0, 3.0), (disturb_by_filament, 240.0, 3.0)])
def test_disturbances_are_felt_less_than_with_pid(run, disturb, target, least):
    found = {}
    for control in (machine.CALIBRATED, machine.PID):
        def body(it, control=control):
            found[control] = disturb(it)
        run(control, body)
    mpc, pid = found[machine.CALIBRATED], found[machine.PID]
    assert rms(mpc, target) * least < rms(pid, target)
    assert max(abs(t - target) for t in mpc) < 1.5


def test_an_unknown_fan_is_made_up_for(run):
    """A fan that the model was not told of."""
    def body(it):
        temps = disturb_by_fan(it)
        assert all(abs(t - 210.0) < 6.0 for t in temps)
        assert abs(temps[119] - 210.0) < 0.5 and abs(temps[-1] - 210.0) < 0.5
    run(machine.CALIBRATED.replace("cooling_fan: fan", ""), body)


def test_room_sensor(run):
    def body(it):
        it.pause(2.0)
        control = it.heater().control
        assert control.room == pytest.approx(25.0, abs=0.5)
        it.send("MPC_SET HEATER=extruder FILAMENT_TEMP=sensor")
        assert it.get("extruder")["control_stats"]["filament_temp"] == [
            "sensor", pytest.approx(25.0, abs=0.5)]
    run(machine.CALIBRATED + "ambient_temp_sensor: temperature_sensor room\n", body)


def test_status(run):
    def body(it):
        it.send("M104 S200\nM106 S128")
        it.pause(150.0)
        it.send("M83\nG1 E100 F300")
        it.pause(15.0)
        stats = it.get("extruder")["control_stats"]
        assert stats["temp_block"] == pytest.approx(it.block(), abs=1.0)
        assert stats["temp_sensor"] == pytest.approx(200.0, abs=1.0)
        assert stats["loss_ambient"] == pytest.approx(0.08 * 175.0, abs=0.6)
        # 5 mm/s: 0.026 W/K
        assert stats["loss_filament"] == pytest.approx(0.026 * 175.0, abs=0.6)
        assert stats["power"] == pytest.approx(
            stats["loss_ambient"] + stats["loss_filament"], abs=3.0)
        assert stats["filament_temp"][0] == "ambient"
        assert stats["filament_heat_capacity"] == 1.8
        assert stats["filament_density"] == 1.2
    run(machine.CALIBRATED, body)


def test_values_can_be_set(run):
    def body(it):
        it.send("MPC_SET HEATER=extruder FILAMENT_DIAMETER=2.85 FILAMENT_DENSITY=1.1"
                " FILAMENT_HEAT_CAPACITY=2 FILAMENT_TEMP=30 BLOCK_HEAT_CAPACITY=11"
                " SENSOR_RESPONSIVENESS=0.5 AMBIENT_TRANSFER=0.07"
                " FAN_AMBIENT_TRANSFER=0,0.05")
        control = it.heater().control
        assert (control.model.capacity, control.model.responsiveness,
                control.model.transfer) == (11.0, 0.5, 0.07)
        assert control.parameters.fan_transfers == (0.0, 0.05)
        assert (control.filament.diameter, control.filament.density) == (2.85, 1.1)
        assert control.get_filament_temp() == 30.0
        for bad, why in (("FILAMENT_TEMP=warm", "SENSOR, AMBIENT or degrees"),
                         ("FILAMENT_TEMP=sensor", "needs an ambient_temp_sensor"),
                         ("FAN_AMBIENT_TRANSFER=a", "numbers from 0 on"),
                         ("BLOCK_HEAT_CAPACITY=0", "BLOCK_HEAT_CAPACITY")):
            with pytest.raises(CommandError, match=why):
                it.send("MPC_SET HEATER=extruder " + bad)
    run(machine.CALIBRATED, body)


def test_heating_needs_a_calibration(run):
    def body(it):
        it.pause(1.0)
        assert it.get("extruder")["control_stats"] is None
        with pytest.raises(CommandError, match="block_heat_capacity and"
                           " sensor_responsiveness and ambient_transfer of heater"
                           " 'extruder' is not known: run MPC_CALIBRATE"):
            it.send("M104 S200")
        it.send("M104 S0")
    run(machine.MPC, body)


@pytest.mark.parametrize("options,error", [
    ("control: mpc\n", "heater_power"),
    (machine.CALIBRATED + "smoothing: 1.5\n", "smoothing"),
    (machine.CALIBRATED + "target_reach_time: 0\n", "target_reach_time"),
    (machine.MPC + "fan_ambient_transfer: 0, -1\n", "below 0"),
    (machine.MPC + "filament_temperature_source: warm\n",
     "must be ambient, sensor or degrees, not 'warm'"),
    (machine.MPC + "filament_temperature_source: sensor\n", "ambient_temp_sensor"),
    (machine.MPC.replace("fan: fan", "fan: fan_generic x"),
     r"'cooling_fan' in section 'extruder': there is no section \[fan_generic x\]"),
    (machine.MPC + "ambient_temp_sensor: room\n", r"no section \[room\]"),
])
def test_bad_options_are_explained(tmp_path, monkeypatch, options, error):
    import re
    bench = machine.HeatingBench(tmp_path, monkeypatch, machine.COMMON + options)

    def body(it):
        assert it.printer.state == "error"
        assert re.search(error, it.printer.state_message), it.printer.state_message
    bench.run(body)
