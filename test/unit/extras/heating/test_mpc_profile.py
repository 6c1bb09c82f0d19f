# SPDX-License-Identifier: GPL-3.0-or-later
"""Profiles of a heater's model, on the simulated hotend."""
import heating_machine as machine
import pytest
from test_mpc_calibrate import saved

from klippy.errors import CommandError

# This hotend with a sock and a heavy nozzle, as it would be measured
SOCK = """
[pid_profile extruder sock]
control: mpc
heater_power: 40
cooling_fan: fan
block_heat_capacity: 12
sensor_responsiveness: 0.6667
ambient_transfer: 0.05
fan_ambient_transfer: 0, 0.01, 0.02
filament_density: 1.3
filament_temperature_source: 30
target_reach_time: 3
maximum_retract: 4
"""
GAINS = """
[pid_profile extruder gains]
pid_kp: 21.657
pid_ki: 2.888
pid_kd: 40.608
"""
EMPTY = "\n[pid_profile extruder empty]\ncontrol: mpc\nheater_power: 40\n"


@pytest.fixture
def bench(tmp_path, monkeypatch):
    def make(config):
        return machine.HeatingBench(tmp_path, monkeypatch, machine.COMMON + config)
    return make


def load(it, name, more="KEEP_TARGET=1"):
    it.send("PID_PROFILE HEATER=extruder LOAD=%s %s" % (name, more))


def is_held(it, target, by=0.5):
    temps = it.follow(60.0)
    return all(abs(temp - target) < by for temp in temps)


def test_values_of_a_profile_are_used(bench):
    def body(it):
        control = it.heater().control
        load(it, "sock")
        model = control.model
        assert (model.capacity, model.transfer) == (12.0, 0.05)
        assert control.parameters.fan_transfers == (0.0, 0.01, 0.02)
        assert (control.filament.density, control.get_filament_temp()) == (1.3, 30.0)
        assert control.tuning.target_reach_time == 3.0
        assert control.surroundings.flow.max_retract == 4.0
        assert it.get("extruder")["pid_profile"] == "sock"
        load(it, "default")
        assert (control.model.capacity, control.model.transfer) == (10.0, 0.065)
        assert control.filament.density == 1.2
        assert control.tuning.target_reach_time == 2.0
    bench(machine.CALIBRATED + SOCK).run_ready(body)


def test_changes_while_holding(bench):
    """To a model that is a bit off, to pid, and back: never seen in the block."""
    def body(it):
        it.send("SET_IDLE_TIMEOUT TIMEOUT=7200")
        it.send("M104 S210")
        it.pause(150.0)
        for name in ("sock", "default", "gains", "sock", "gains", "default"):
            load(it, name)
            assert it.get("extruder")["target"] == 210.0
            # pid begins without its integral
            assert is_held(it, 210.0, 4.0 if name == "gains" else 1.5), name
            assert abs(it.block() - 210.0) < 1.0, name
        load(it, "sock", "KEEP_TARGET=1 LOAD_CLEAN=1")
        assert is_held(it, 210.0, 1.5) and abs(it.block() - 210.0) < 1.0
        load(it, "default", "")
        assert it.get("extruder")["target"] == 0.0
    bench(machine.CALIBRATED + SOCK + GAINS).run_ready(body)


@pytest.mark.parametrize("seconds", [6.0, 60.0])
def test_model_begins_where_the_pid_left(bench, seconds):
    def body(it):
        it.send("M104 S100")
        it.pause(90.0)
        load(it, "gains")
        it.send("M104 S250")
        it.pause(seconds)
        load(it, "default")
        heater = it.heater()
        assert heater.last_temp > 108.0
        assert heater.control.model.sensor == pytest.approx(heater.last_temp, abs=3.0)
        for _ in range(20):
            it.pause(0.1)
            assert heater.last_pwm_value > 0.0
        it.pause(90.0)
        assert it.block() == pytest.approx(250.0, abs=1.0)
    bench(machine.CALIBRATED + GAINS).run_ready(body)


def test_what_works_is_saved(bench):
    def body(it):
        it.send("MPC_SET HEATER=extruder FILAMENT_DENSITY=1.04 AMBIENT_TRANSFER=0.07")
        it.send("PID_PROFILE HEATER=extruder SAVE=abs")
        pending = it.get("configfile")["save_config_pending_items"]
        assert pending["pid_profile extruder abs"] == {
            "pid_version": "1", "control": "mpc", "heater_power": "40",
            "block_heat_capacity": "10", "sensor_responsiveness": "0.6667",
            "ambient_transfer": "0.07", "fan_ambient_transfer": "0.07, 0.085, 0.1",
            "filament_diameter": "1.75", "filament_density": "1.04",
            "filament_heat_capacity": "1.8", "filament_temperature_source": "ambient",
            "target_reach_time": "2", "smoothing": "0.83", "min_ambient_change": "1",
            "steady_state_rate": "0.5", "maximum_retract": "2", "cooling_fan": "fan"}
        it.send("PID_PROFILE HEATER=extruder GET_VALUES=1")
        assert "profile 'abs':\n// control: mpc\n" in it.output[-1]
        # the heater's own section only gets what is not in it
        load(it, "default")
        it.send("MPC_SET HEATER=extruder FILAMENT_HEAT_CAPACITY=2")
        it.send("PID_PROFILE HEATER=extruder SAVE=default")
        pending = it.get("configfile")["save_config_pending_items"]
        assert pending["extruder"] == {
            "control": "mpc", "filament_heat_capacity": "2"}
        load(it, "abs")
        control = it.heater().control
        assert control.filament.density == 1.04 and control.model.transfer == 0.07
        load(it, "default")
        assert control.filament.density == 1.2 and control.model.transfer == 0.065
        assert control.filament.heat_capacity == 2.0
    bench(machine.CALIBRATED).run_ready(body)


def test_saved_section_is_read(bench):
    written = {}

    def write(it):
        load(it, "sock")
        it.send("PID_PROFILE HEATER=extruder SAVE=again")
        pending = it.get("configfile")["save_config_pending_items"]
        written.update(pending["pid_profile extruder again"])
    bench(machine.CALIBRATED + SOCK).run_ready(write)

    def check(it):
        load(it, "sock")
        it.send("PID_PROFILE HEATER=extruder GET_VALUES=1")
        values = it.output[-1].split("':\n")[1]
        load(it, "again")
        it.send("PID_PROFILE HEATER=extruder GET_VALUES=1")
        assert it.output[-1].split("':\n")[1] == values
    lines = "".join("%s: %s\n" % item for item in written.items())
    bench(machine.CALIBRATED + SOCK + "[pid_profile extruder again]\n" + lines
          ).run_ready(check)


def test_calibration_is_of_the_heaters_own_section(bench):
    def body(it):
        with pytest.raises(CommandError, match="'empty' of heater 'extruder' has no"
                           " block_heat_capacity and"):
            load(it, "empty")
        with pytest.raises(CommandError, match="'default' of heater"):
            load(it, "default")
        load(it, "empty", "")
        with pytest.raises(CommandError, match="run MPC_CALIBRATE"):
            it.send("M104 S200")
        it.send("MPC_CALIBRATE HEATER=extruder FAN_BREAKPOINTS=2")
        assert saved(it, "extruder")["block_heat_capacity"] == pytest.approx(
            [machine.CAPACITY], rel=0.03)
        load(it, "default")
        it.send("M104 S200")
        it.pause(90.0)
        assert is_held(it, 200.0)
    bench(machine.MPC + EMPTY).run_ready(body)


def test_calibration_after_the_section_became_a_pid(bench):
    def body(it):
        load(it, "gains", "")
        it.send("PID_PROFILE HEATER=extruder SAVE=default")
        it.send("MPC_CALIBRATE HEATER=extruder FAN_BREAKPOINTS=2 TARGET=100")
        assert it.get("configfile")["save_config_pending_items"]["extruder"][
            "control"] == "mpc"
        load(it, "default", "")
        capacity = it.heater().control.model.capacity
        assert capacity == pytest.approx(machine.CAPACITY, rel=0.05)
    bench(machine.MPC + GAINS).run_ready(body)


@pytest.mark.parametrize("config,error", [
    (SOCK.replace("cooling_fan: fan", "cooling_fan: fan_generic x"),
     "option 'cooling_fan' must be that of section 'extruder', 'fan'"),
    (SOCK + "ambient_temp_sensor: temperature_sensor room\n", "'none'"),
    (SOCK.replace("source: 30", "source: sensor"), "needs an ambient_temp_sensor"),
    (SOCK.replace("heater_power: 40", ""), "heater_power"),
    (SOCK + "pid_kp: 3\n", "pid_kp")])
def test_bad_sections_are_explained(bench, config, error):
    def body(it):
        assert it.printer.state == "error"
        assert error in it.printer.state_message
    bench(machine.CALIBRATED + config).run(body)
