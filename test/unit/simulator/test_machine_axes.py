# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps and switches of the simulated machine, driven by bare mcu commands."""
import bench_machine
import pytest

CONFIG = """
[mcu]
serial: /dev/none
%(extra)s
[printer]
kinematics: %(kinematics)s
max_velocity: 100
max_accel: 1000
[stepper_x]
step_pin: PF0
dir_pin: %(dir_invert)sPF1
microsteps: 16
rotation_distance: 40
endstop_pin: ^%(chip)s%(end_invert)sPE5
position_endstop: 0
position_max: 200
[stepper_y]
step_pin: !PF6
dir_pin: PF7
microsteps: 16
rotation_distance: 40
endstop_pin: ^PJ1
position_endstop: 0
position_max: 200
[stepper_z]
step_pin: PL3
dir_pin: PL1
microsteps: 16
rotation_distance: 8
endstop_pin: PD3
position_endstop: 0.5
position_max: 200
[simulator]
start_position: 5, 10, 3
%(sim)s
"""
PINS = {"stepper_x": ("PF0", "PF1", 0), "stepper_y": ("PF6", "PF7", 1),
        "stepper_z": ("PL3", "PL1", -1)}
# Options of the sections that only the motion core reads.
MOTION_SECTIONS = ("printer", "stepper_x", "stepper_y", "stepper_z")


class Axis:
    """A stepper and an end switch at the level of mcu commands."""

    def __init__(self, config, name, end_pin, end_mcu):
        printer = config.get_printer()
        self.mcu = printer.lookup_object("mcu")
        self.end_mcu = printer.lookup_object(end_mcu)
        self.name, self.end_pin = name, end_pin
        self.mcu.register_config_callback(self._build)
        self.end_mcu.register_config_callback(self._build_endstop)

    def _build(self):
        step, direction, invert = PINS[self.name]
        self.oid = self.mcu.create_oid()
        self.mcu.add_config_cmd(
            "config_stepper oid=%d step_pin=%s dir_pin=%s invert_step=%d"
            " step_pulse_ticks=%d" % (self.oid, step, direction, invert,
                                      2 if invert < 0 else 40))
        self.commands = [self.mcu.lookup_command(text) for text in (
            "reset_step_clock oid=%c clock=%u",
            "set_next_step_dir oid=%c dir=%c",
            "queue_step oid=%c interval=%u count=%hu add=%hi")]

    def _build_endstop(self):
        self.end_oid = self.end_mcu.create_oid()
        self.end_mcu.add_config_cmd("config_endstop oid=%d pin=%s pull_up=1"
                                    % (self.end_oid, self.end_pin))
        self.query = self.end_mcu.lookup_query_command(
            "endstop_query_state oid=%c",
            "endstop_state oid=%c homing=%c next_clock=%u pin_value=%c",
            oid=self.end_oid)

    def move(self, bench, level, count):
        """`count` steps at 5 kHz with the dir pin at a level."""
        reset, set_dir, queue = self.commands
        now = self.mcu.get_printer().get_reactor().monotonic()
        clock = self.mcu.print_time_to_clock(
            self.mcu.estimated_print_time(now) + 0.1)
        interval = self.mcu.seconds_to_clock(0.0002)
        reset.send([self.oid, clock])
        set_dir.send([self.oid, level])
        queue.send([self.oid, interval, count, 0])
        bench.pause(0.2 + count * 0.0002)

    def read_switch(self):
        return self.query.send([self.end_oid])["pin_value"]


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    def make(kinematics="cartesian", dir_invert="", end_invert="", chip="",
             extra="", sim=""):
        text = CONFIG % {"kinematics": kinematics, "dir_invert": dir_invert,
                         "end_invert": end_invert, "chip": chip,
                         "extra": extra, "sim": sim}
        bench = bench_machine.Bench(tmp_path, monkeypatch, text)
        bench.axes = {}
        ends = {"stepper_x": "PE5", "stepper_y": "PJ1", "stepper_z": "PD3"}

        def build(config):
            for section in MOTION_SECTIONS:
                part = config.getsection(section)
                for option in part.get_prefix_options(""):
                    part.get(option)
            for name, pin in ends.items():
                mcu = "mcu"
                if name == "stepper_x" and chip:
                    mcu = "mcu " + chip.rstrip(":")
                bench.axes[name] = Axis(config, name, pin, mcu)
        bench.make = build
        return bench
    return make


@pytest.mark.parametrize("dir_invert,down", [("", 0), ("!", 1)])
def test_switch_closes_at_the_exact_step(make_bench, dir_invert, down):
    def body(it):
        assert it.printer.state == "ready", it.printer.state_message
        axis = it.axes["stepper_x"]
        assert it.machine.calc_position() == pytest.approx((5.0, 10.0, 3.0))
        axis.move(it, down, 399)
        assert it.machine.calc_position()[0] == pytest.approx(0.0125)
        assert axis.read_switch() == 0
        axis.move(it, down, 1)
        assert it.machine.calc_position()[0] == pytest.approx(0.0)
        assert axis.read_switch() == 1
        axis.move(it, 1 - down, 2)
        assert it.machine.calc_position()[0] == pytest.approx(0.025)
        assert axis.read_switch() == 0
        assert it.machine.get_step_counts()["stepper_x"] == -398
    make_bench(dir_invert=dir_invert).run(body)


def test_inverted_step_pin_counts_the_same(make_bench):
    def body(it):
        it.machine.record_steps()
        it.axes["stepper_y"].move(it, 1, 100)
        it.axes["stepper_y"].move(it, 0, 30)
        assert it.machine.calc_position()[1] == pytest.approx(10.0 + 70 / 80)
        steps = it.machine.take_steps()
        assert steps["stepper_y"].shape == (130, 2)
        assert steps["stepper_y"][:, 1].sum() == 70
        assert (steps["stepper_y"][1:100, 0] -
                steps["stepper_y"][:99, 0] == 4000).all()
        assert len(steps["stepper_x"]) == 0
    make_bench().run(body)


def test_both_edge_stepping_is_seen_in_the_configuration(make_bench):
    def body(it):
        it.axes["stepper_z"].move(it, 1, 50)
        assert it.machine.traces["stepper_z"].both_edges
        assert not it.machine.traces["stepper_x"].both_edges
        assert it.machine.get_step_counts()["stepper_z"] == 50
        it.axes["stepper_z"].move(it, 0, 20)
        assert it.machine.get_step_counts()["stepper_z"] == 30
        assert it.machine.get_total_steps()["stepper_z"] == 70
    make_bench().run(body)


def test_inverted_switch_reads_inverted(make_bench):
    def body(it):
        axis = it.axes["stepper_x"]
        assert axis.read_switch() == 1
        axis.move(it, 0, 400)
        assert axis.read_switch() == 0
    make_bench(end_invert="!").run(body)


def test_corexy_carriage_moves_by_both_motors(make_bench):
    def body(it):
        it.axes["stepper_x"].move(it, 0, 400)
        assert it.machine.calc_position() == pytest.approx((2.5, 7.5, 3.0))
        assert it.axes["stepper_x"].read_switch() == 0
        it.axes["stepper_y"].move(it, 0, 400)
        assert it.machine.calc_position() == pytest.approx((0.0, 10.0, 3.0))
        assert it.axes["stepper_x"].read_switch() == 1
        assert it.axes["stepper_y"].read_switch() == 0
    make_bench("corexy").run(body)


def test_switch_on_another_mcu(make_bench):
    def body(it):
        assert it.printer.state == "ready", it.printer.state_message
        axis = it.axes["stepper_x"]
        assert axis.read_switch() == 0
        axis.move(it, 0, 400)
        assert axis.read_switch() == 1
    make_bench(chip="head:",
               extra="[mcu head]\nserial: /dev/none2\n").run(body)


def test_mcus_drift_apart_but_stay_known(make_bench):
    def body(it):
        main, head = it.machine.mcus["mcu"], it.machine.mcus["head"]
        start = [m.clock_at(it.world.monotonic()) for m in (main, head)]
        it.pause(100.0)
        end = [m.clock_at(it.world.monotonic()) for m in (main, head)]
        ticks = [e - s for s, e in zip(start, end, strict=True)]
        ppm = (ticks[1] / ticks[0] - 1.0) * 1e6
        assert ppm == pytest.approx(-80.0, abs=0.1)
    make_bench(chip="head:", extra="[mcu head]\nserial: /dev/none2\n",
               sim="clock_ppm: mcu=50, head=-30").run(body)
