# SPDX-License-Identifier: GPL-3.0-or-later
import motion_machine
import pytest
from motion_bench import CARTESIAN

from klippy.errors import CommandError
from klippy.extras import endstop_phase

PHASES = 64
X_STEP = 40. / 3200.


@pytest.fixture
def run(tmp_path, monkeypatch):
    return motion_machine.make_run(tmp_path, monkeypatch, CARTESIAN)


@pytest.mark.parametrize("seen, arc", [
    ([3], (3, 1)), ([3, 5], (3, 3)), ([62, 1, 0], (62, 4)), ([0, 16, 32], (0, 33)),
    ([], None)])
def test_arc_of_phases(seen, arc):
    history = [3 * (phase in seen) for phase in range(PHASES)]
    assert endstop_phase.find_arc(history) == arc


def find_phase(run, stepper="stepper_x"):
    """The phase of the trigger on the simulated machine; the same in every run."""
    found = []

    def body(it):
        it.send("G28")
        found.append(it.get("endstop_phase")["last_home"][stepper]["phase"])
    run(body, "[endstop_phase]\n")
    return found[0]


def make_section(phase, *options, stepper="stepper_x"):
    return "\n".join(["[endstop_phase %s]" % (stepper,),
                      "trigger_phase: %d/%d" % (phase % PHASES, PHASES), *options, ""])


@pytest.mark.parametrize("early", [0, 3, -5])
def test_trigger_off_its_place(run, early):
    phase = find_phase(run)

    def body(it):
        it.send("G28\nG1 X50 F6000")
        # the head is taken to be further by what the switch was late
        it.toolhead.wait_moves()
        it.pause(0.5)
        assert 50. - it.machine.calc_position()[0] == pytest.approx(
            early * X_STEP, abs=0.51 * X_STEP)
        exact = it.toolhead.get_kinematics().get_steppers()[0]
        steps = it.machine.get_step_counts()["stepper_x"]
        start = it.machine.axes.start["x"]
        assert exact.mcu_to_commanded_position(steps) == pytest.approx(
            start + steps * X_STEP + early * X_STEP, abs=1e-6)
    run(body, make_section(phase - early))


def test_trigger_too_far_off(run):
    phase = find_phase(run)

    def body(it):
        with pytest.raises(CommandError, match=r"incorrect phase \(got %d vs %d\)" % (
                phase, (phase - 5) % PHASES)):
            it.send("G28 X")
    # half of 0.1 mm is four steps
    run(body, make_section(phase - 5, "endstop_accuracy: 0.1"))
    run(lambda it: it.send("G28 X"), make_section(phase - 4, "endstop_accuracy: 0.1"))


def test_full_step_at_zero(run):
    phase = find_phase(run)

    def body(it):
        it.send("G28\nG1 X50 F6000")
        motor = it.toolhead.get_kinematics().get_steppers()[0]
        it.toolhead.wait_moves()
        # the steps at position 0 are those of a full step
        zero = round(motor.get_mcu_position(0.))
        assert motor.mcu_to_commanded_position(zero) == pytest.approx(0., abs=1e-6)
        assert zero % 16 == 0
        # the trigger stays near 0, where the switch is
        assert abs(50. - it.machine.calc_position()[0]) <= 8.5 * X_STEP
    run(body, make_section(phase, "endstop_align_zero: True"))


def test_first_homing_sets_the_phase(run):
    def body(it):
        it.send("G28 X")
        phase = it.get("endstop_phase")["last_home"]["stepper_x"]["phase"]
        assert "// Setting stepper_x endstop phase to %d" % (phase,) in it.output
        said = len(it.output)
        it.send("G28 X")
        assert len(it.output) == said
        it.send("G1 X50 F6000")
        assert max(it.get_error()[:1]) < 0.0063
    run(body, "[endstop_phase stepper_x]\n")


def test_calibration(run):
    def body(it):
        it.send("ENDSTOP_PHASE_CALIBRATE")
        assert "No steppers found" in it.output[-1]
        with pytest.raises(CommandError, match="Stats not available for stepper x"):
            it.send("ENDSTOP_PHASE_CALIBRATE STEPPER=x")
        it.send("G28\nG28 X\nENDSTOP_PHASE_CALIBRATE")
        last = it.get("endstop_phase")["last_home"]
        assert sorted(last) == ["stepper_x", "stepper_y", "stepper_z"]
        assert last["stepper_y"]["phases"] == PHASES
        for name, home in last.items():
            assert home["mcu_position"] % PHASES == home["phase"]
            assert any(line.startswith("// %s: trigger_phase=%d/64 (range %d to %d)" % (
                name, home["phase"], home["phase"], home["phase"]))
                for line in it.output)
        it.send("ENDSTOP_PHASE_CALIBRATE STEPPER=stepper_z")
        pending = it.get("configfile")["save_config_pending_items"]
        assert pending == {"endstop_phase stepper_z": {
            "trigger_phase": "%d/64" % (last["stepper_z"]["phase"],)}}
    run(body, "[endstop_phase]\n")


def test_table_of_a_driver(run):
    class Driver:
        offset = 5

        def get_phase_offset(self):
            return self.offset, PHASES

    driver = Driver()

    def body(it):
        counter = it.printer.lookup_object("endstop_phase").counters["stepper_x"]
        it.printer.add_object("tmc2209 stepper_x", driver)
        counter.find_driver()
        it.send("G28 X")
        assert counter.last_phase == (counter.last_mcu_position + 5) % PHASES
        driver.offset = None
        with pytest.raises(CommandError, match="stepper_x phase unknown"):
            it.send("G28 X")
    run(body, "[endstop_phase stepper_x]\n")


@pytest.mark.parametrize("option, message", [
    ("trigger_phase: 64/64", "'64/64' must be a phase"), ("trigger_phase: 5", "/"),
    ("endstop_accuracy: 0.5", "too coarse")])
def test_wrong_options(tmp_path, monkeypatch, option, message):
    import motion_bench

    def body(it):
        assert message in it.printer.state_message
    motion_bench.MotionBench(
        tmp_path, monkeypatch,
        CARTESIAN + "[endstop_phase stepper_x]\n" + option + "\n").run(body)
