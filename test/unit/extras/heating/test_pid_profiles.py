# SPDX-License-Identifier: GPL-3.0-or-later
"""Gains and profiles changed while a heater holds its temperature."""
import pytest
from daemon_run import ApiError, Host
from machine_configs import make_axes
from test_heater_control import Plant, make_pid

from klippy.extras import control_pid

SOFT, HARD = (12.0, 0.6, 60.0), (44.0, 2.4, 200.0)
CONFIG = make_axes("cartesian").replace(
    "control: watermark", "control: pid\npid_kp: 22.2\npid_ki: 1.08\npid_kd: 114")
PROFILE = "[pid_profile extruder soft]\npid_kp: 12\npid_ki: 0.6\npid_kd: 60\n"
BANG = "[pid_profile extruder bang]\ncontrol: watermark\nmax_delta: 3\n"


@pytest.mark.parametrize("gains", [SOFT, HARD, (22.2, 1.08, 0.0), (5.0, 3.0, 9.0)])
def test_change_while_holding_is_not_seen(gains):
    plant = Plant()
    plant.target = 210.0
    control = make_pid(plant)
    list(plant.run(control, 300.0))
    before = plant.power
    control.set_gains(gains)
    temps = list(plant.run(control, 60.0))
    assert plant.powers[-round(60 / 0.3)] == pytest.approx(before, abs=0.01)
    assert max(abs(temp - 210.0) for temp in temps) < 0.3
    assert control.get_gains() == pytest.approx(gains)


def test_change_without_transfer_would_be_seen():
    """The measure of the test above can fail."""
    plant = Plant()
    plant.target = 210.0
    list(plant.run(make_pid(plant), 300.0))
    temps = list(plant.run(control_pid.ControlPID.from_gains(plant, SOFT), 60.0))
    assert max(abs(temp - 210.0) for temp in temps) > 3.0


def test_change_on_the_way_up_does_not_wind_up():
    plant = Plant()
    plant.target = 210.0
    control = make_pid(plant)
    list(plant.run(control, 20.0))
    assert plant.power == 1.0
    control.set_gains(HARD)
    assert max(plant.run(control, 200.0)) < 216.0


def test_new_control_takes_the_time_it_begins():
    """Its first reading does not count as one after hours."""
    plant = Plant()
    plant.target, plant.now = 210.0, 5000.0
    list(plant.run(make_pid(plant), 300.0))
    control = control_pid.ControlPID.from_gains(plant, (22.2, 1.08, 114.0))
    control.begin(plant.now - 0.3, plant.model.sensor_temperature)
    control.temperature_update(plant.now, 209.9, 210.0)
    assert control.integral == pytest.approx(0.03)


def test_gains_without_integral():
    plant = Plant()
    plant.target = 210.0
    control = make_pid(plant)
    list(plant.run(control, 100.0))
    control.set_gains((22.2, 0.0, 114.0))
    list(plant.run(control, 10.0))
    control.set_gains((22.2, 1.08, 114.0))
    assert 0.0 <= control.integral <= control.max_integral
    assert list(plant.run(control, 200.0))[-1] == pytest.approx(210.0, abs=0.3)


def heat_up(host):
    host.script("M104 S200")
    host.pause(120.0)
    assert host.status("extruder")["temperature"] == pytest.approx(200.0, abs=1.0)


def test_profiles_of_a_printer(tmp_path):
    host = Host(tmp_path, CONFIG + PROFILE)

    def change(host):
        assert host.status("extruder")["pid_profile"] == "default"
        heat_up(host)
        host.script("PID_PROFILE LOAD=soft HEATER=extruder KEEP_TARGET=1")
        for _ in range(30):
            host.pause(1.0)
            status = host.status("extruder")
            assert status["temperature"] == pytest.approx(200.0, abs=1.0)
        assert (status["pid_profile"], status["target"]) == ("soft", 200.0)
        host.script("SET_HEATER_PID HEATER=extruder KP=13.5")
        host.script("PID_PROFILE SAVE=mine HEATER=extruder")
        host.script("PID_PROFILE GET_VALUES=1 HEATER=extruder")
        assert "pid_kp: 13.500\n// pid_ki: 0.600\n// pid_kd: 60.000" in host.output[-1]
        host.pause(60.0)
        assert host.status("extruder")["temperature"] == pytest.approx(200.0, abs=1.0)
        host.script("PID_PROFILE SET_VALUES=other HEATER=extruder KP=30 TARGET=200"
                    " TOLERANCE=0.02 KEEP_TARGET=1")
        host.script("PID_PROFILE SAVE=other HEATER=extruder")
        host.script("SET_HEATER_PID HEATER=extruder KP=25")
        host.script("PID_PROFILE SAVE=default HEATER=extruder")
        host.script("SAVE_CONFIG RESTART=0")
        assert not host.status("configfile")["save_config_pending"]
        assert host.status("extruder")["target"] == 200.0

    def find(host):
        known = host.status("pid_profiles")["profiles"]
        assert set(known["extruder"]) == {"default", "soft", "mine", "other"}
        host.script("PID_PROFILE GET_VALUES=1 HEATER=extruder")
        assert "pid_kp: 25.000" in host.output[-1]
        host.script("PID_PROFILE LOAD=other HEATER=extruder VERBOSE=high")
        assert "pid_kp: 30.000" in host.output[-1]
        assert "pid_target: 200.000\n// pid_tolerance: 0.020" in host.output[-1]
        host.script("PID_PROFILE REMOVE=mine HEATER=extruder")
        host.script("SAVE_CONFIG RESTART=0")

    def miss(host):
        assert set(host.status("pid_profiles")["profiles"]["extruder"]) == {
            "default", "soft", "other"}

    host.run_boots(change, find, miss)
    text = host.config_path.read_text()
    assert "mine" not in text and "#*# [pid_profile extruder other]" in text


def test_load_ends_heating_unless_told(tmp_path):
    def load(host):
        heat_up(host)
        host.script("PID_PROFILE LOAD=absent DEFAULT=soft HEATER=extruder")
        status = host.status("extruder")
        assert (status["pid_profile"], status["target"]) == ("soft", 0.0)
        host.pause(1.0)
        assert host.status("extruder")["power"] == 0.0

    Host(tmp_path, CONFIG + PROFILE).run_boots(load)


def test_to_watermark_and_back(tmp_path):
    def load(host):
        heat_up(host)
        host.script("SET_IDLE_TIMEOUT TIMEOUT=3600")
        for name, clean in (("bang", 0), ("default", 0), ("default", 1)):
            host.script("PID_PROFILE LOAD=%s HEATER=extruder KEEP_TARGET=1"
                        " LOAD_CLEAN=%d" % (name, clean))
            host.pause(120.0)
            assert host.status("extruder")["temperature"] == pytest.approx(
                200.0, abs=12.0 if name == "bang" else 1.0)
            if name == "bang":
                with pytest.raises(ApiError, match="control: pid"):
                    host.script("SET_HEATER_PID HEATER=extruder KP=1")

    Host(tmp_path, CONFIG + BANG).run_boots(load)


@pytest.mark.parametrize("command,error", [
    ("PID_PROFILE HEATER=extruder", "one of LOAD=, SAVE="),
    ("PID_PROFILE HEATER=extruder LOAD=a SAVE=b", "LOAD and SAVE"),
    ("PID_PROFILE HEATER=extruder LOAD=none", "has no profile 'none'.*'default'"),
    ("PID_PROFILE HEATER=extruder LOAD=soft VERBOSE=loud", "none, low, high"),
    ("PID_PROFILE HEATER=extruder SAVE='two words'", "one word"),
    ("PID_PROFILE HEATER=extruder REMOVE=default", "own section"),
    ("PID_PROFILE HEATER=extruder SET_VALUES=x CONTROL=mpc", "CONTROL=mpc"),
    ("PID_PROFILE HEATER=extruder SET_VALUES=x KP=-1", "at least 0"),
    ("SET_HEATER_PID HEATER=extruder KP=nan", "finite"),
    ("SET_HEATER_PID HEATER=bed KP=1", "bed")])
def test_what_cannot_be_is_told(tmp_path, command, error):
    def ask(host):
        with pytest.raises(ApiError, match=error):
            host.script(command)
        assert host.status("extruder")["pid_profile"] == "default"

    Host(tmp_path, CONFIG + PROFILE).run_boots(ask)


@pytest.mark.parametrize("section,error", [
    ("[pid_profile bed a]\npid_kp: 1\npid_ki: 1\npid_kd: 1\n", "heater 'bed'"),
    ("[pid_profile extruder]\npid_kp: 1\npid_ki: 1\npid_kd: 1\n", "must be named"),
    ("[pid_profile extruder default]\npid_kp: 1\npid_ki: 1\npid_kd: 1\n", "another"),
    ("[pid_profile extruder a]\npid_kp: 1\npid_ki: 1\n", "pid_kd"),
    ("[pid_profile extruder a]\ncontrol: on\n", "watermark"),
    ("[pid_profile extruder a]\ncontrol: mpc\n", "heater_power"),
    ("[pid_profile extruder a]\ncontrol: mpc\nheater_power: 40\n",
     "needs 'control: mpc' in section 'extruder'")])
def test_bad_sections(tmp_path, section, error):
    def look(host):
        info = host.info()
        assert info["state"] == "error" and error in info["state_message"]

    Host(tmp_path, CONFIG + section).run_boots(look)
