# SPDX-License-Identifier: GPL-3.0-or-later
"""Power is cut in the middle of a print: the next start goes on with it."""

import pytest
from machine_configs import BED, make_axes, make_delta
from printer_run import PrinterRun

from klippy.errors import CommandError, PrinterError

FEATURES = """
[pause_resume]

[exclude_object]

[force_move]
enable_force_move: True

[print_recovery]
interval: 0.5

[simulator]
start_position: {position}
"""
HEAD = """
EXCLUDE_OBJECT_DEFINE NAME=left CENTER=20,20
EXCLUDE_OBJECT_DEFINE NAME=right CENTER=60,20
M140 S45
G28
G92 E0
SET_GCODE_OFFSET Z=0.05
SET_VELOCITY_LIMIT ACCEL=1500
M106 S127
M220 S90
M221 S95
G1 Z0.2 F600
"""


def make_job():
    """Squares of 40 mm, 0.2 mm apart; E counts up."""
    lines, e = [HEAD], 0.
    for layer in range(1, 11):
        lines.append("G1 Z%.2f F600" % (.2 * layer,))
        for x, y in ((20, 20), (60, 20), (60, 60), (20, 60)):
            e += 1.3
            lines.append("G1 X%d Y%d E%.4f F3000" % (x, y, e))
    lines.append("G1 X30 Y31 E%.4f" % (e + 1.,))
    return "\n".join(lines) + "\n", e + 1.


class Session:
    """One start of the printer on a machine that stands at a place."""

    def __init__(self, folder, position, make=make_axes, kind="cartesian"):
        features = FEATURES.format(position=", ".join("%.5f" % c for c in position))
        args = (kind,) if make is make_axes else ()
        self.run = PrinterRun(make(*args, extra=BED + features), folder)
        self.position = list(position)

    def play(self, story):
        """Run story(self); returns the responses."""
        def part(printer):
            self.printer = printer
            self.reactor = printer.get_reactor()
            self.script = printer.lookup_object("gcode").run_script
            story(self)
            self.position = list(self.run.machine.calc_position())
        try:
            self.run.run([part])
        except PrinterError as err:
            if "power cut" not in str(err):
                raise
        return self.run.responses

    def pause(self, seconds):
        self.reactor.pause(self.reactor.monotonic() + seconds)

    def status(self, name):
        return self.printer.lookup_object(name).get_status(self.reactor.monotonic())

    def wait_while_printing(self):
        self.pause(.1)
        while self.status("print_stats")["state"] == "printing":
            self.pause(.5)

    def cut_power(self):
        """Nothing that the host would do at its end reaches the disk."""
        self.position = list(self.run.machine.calc_position())
        recovery = self.printer.lookup_object("print_recovery")
        recovery._write = lambda state: None
        raise PrinterError("power cut")


def start_and_cut(session, seconds):
    session.script("SDCARD_PRINT_FILE FILENAME=job.gcode")
    wait_for_filament(session, 8.)
    session.pause(seconds)
    session.cut_power()


def wait_for_filament(session, length):
    """Until the file has used so many mm."""
    while session.status("print_stats")["filament_used"] < length:
        session.pause(.1)


@pytest.mark.parametrize("make, kind", [
    (make_axes, "cartesian"), (make_axes, "corexy"), (make_delta, "delta")])
@pytest.mark.parametrize("seconds", [2., 11.3])
def test_print_goes_on_after_a_power_cut(tmp_path, make, kind, seconds):
    text, e_end = make_job()
    (tmp_path / "job.gcode").write_text(text)
    first = Session(tmp_path, (3., 3., 1.), make, kind)
    first.play(lambda session: start_and_cut(session, seconds))
    assert 0.2 < first.position[2] < 2.2

    def go_on(session):
        available = session.status("print_recovery")
        assert available["is_available"] and .05 < available["progress"] < .95
        # the first seconds of motion are planned at once
        assert -.01 < first.position[2] - available["z"] < .5
        session.script("RESUME_INTERRUPTED")
        assert session.status("heater_bed")["temperature"] > 43.
        session.pause(.1)
        assert session.status("print_stats")["state"] == "printing"
        session.wait_while_printing()
        assert session.status("print_stats")["state"] == "complete"
        session.script("M400")

    second = Session(tmp_path, first.position, make, kind)
    responses = second.play(go_on)
    assert any("was interrupted at" in text for text in responses)
    # the machine itself stands where the file ends, one step of the motors off
    assert second.position == pytest.approx([30., 31., 2.05], abs=.03)
    printer = second.printer
    move = printer.lookup_object("gcode_move").get_status()
    assert move["gcode_position"][:4] == pytest.approx((30., 31., 2., e_end))
    assert move["homing_origin"][2] == .05 and move["speed_factor"] == (
        pytest.approx(.9))
    assert move["extrude_factor"] == .95
    assert printer.lookup_object("toolhead").get_max_velocity()[1] == 1500.
    assert printer.lookup_object("fan").get_status(0.)["speed"] == pytest.approx(
        127. / 255., abs=1e-3)
    names = [item["name"] for item in
             printer.lookup_object("exclude_object").get_status(0.)["objects"]]
    assert names == ["LEFT", "RIGHT"]
    third = Session(tmp_path, second.position, make, kind)
    third.play(lambda session: None)
    assert not any("was interrupted" in text for text in third.run.responses)


def test_nozzle_is_lifted_before_anything_moves(tmp_path):
    """The way back: up, then home x and y, then over the part, then down."""
    (tmp_path / "job.gcode").write_text(make_job()[0])
    first = Session(tmp_path, (3., 3., 1.))
    first.play(lambda session: start_and_cut(session, 6.))
    heights = []

    def go_on(session):
        toolhead = session.printer.lookup_object("toolhead")
        home = session.printer.lookup_object("gcode").gcode_handlers["G28"]

        def note(gcmd):
            heights.append((toolhead.get_position()[2], gcmd.get_commandline(),
                            session.run.machine.calc_position()[2]))
            home(gcmd)
        session.printer.lookup_object("gcode").gcode_handlers["G28"] = note
        session.script("RESUME_INTERRUPTED")
        session.wait_while_printing()
    second = Session(tmp_path, first.position)
    second.play(go_on)
    (planned, command, real), = heights
    assert command == "G28 X Y" and planned > first.position[2] + 4.7
    assert real == pytest.approx(planned, abs=.3)


def test_second_cut_just_after_the_first(tmp_path):
    (tmp_path / "job.gcode").write_text(make_job()[0])
    session = Session(tmp_path, (3., 3., 1.))
    session.play(lambda s: start_and_cut(s, 4.))

    def cut_again(session):
        session.script("RESUME_INTERRUPTED")
        session.pause(.05)
        session.cut_power()
    for _ in range(2):
        session = Session(tmp_path, session.position)
        session.play(cut_again)

    def go_on(session):
        session.script("RESUME_INTERRUPTED")
        session.wait_while_printing()
        session.script("M400")
    session = Session(tmp_path, session.position)
    session.play(go_on)
    assert session.position == pytest.approx([30., 31., 2.05], abs=.03)


def test_changed_file_is_refused_and_can_be_forgotten(tmp_path):
    (tmp_path / "job.gcode").write_text(make_job()[0])
    first = Session(tmp_path, (3., 3., 1.))
    first.play(lambda session: start_and_cut(session, 4.))
    (tmp_path / "job.gcode").write_text(make_job()[0] + "\n")

    def look(session):
        with pytest.raises(CommandError, match="was changed since it was printed"):
            session.script("RESUME_INTERRUPTED")
        assert session.status("toolhead")["homed_axes"] == ""
        session.script("DISCARD_INTERRUPTED")
        for name in ("RESUME_INTERRUPTED", "DISCARD_INTERRUPTED"):
            with pytest.raises(CommandError, match="No print was interrupted"):
                session.script(name)
    Session(tmp_path, first.position).play(look)
    last = Session(tmp_path, first.position)
    last.play(lambda session: None)
    assert not any("was interrupted" in text for text in last.run.responses)


def test_cancelled_print_is_not_offered(tmp_path):
    (tmp_path / "job.gcode").write_text(make_job()[0])

    def cancel(session):
        session.script("SDCARD_PRINT_FILE FILENAME=job.gcode")
        session.pause(40.)
        session.script("CANCEL_PRINT")
        session.pause(2.)
    first = Session(tmp_path, (3., 3., 1.))
    first.play(cancel)
    last = Session(tmp_path, first.position)
    last.play(lambda session: None)
    assert not any("was interrupted" in text for text in last.run.responses)


def test_paused_print_goes_on_where_it_paused(tmp_path):
    (tmp_path / "job.gcode").write_text(make_job()[0])

    def pause_and_cut(session):
        session.script("SDCARD_PRINT_FILE FILENAME=job.gcode")
        wait_for_filament(session, 20.)
        session.script("PAUSE\nG91\nG1 Z20 F900\nG90\nG1 X100 Y100 F6000\nM400")
        session.pause(5.)
        session.cut_power()

    def go_on(session):
        session.script("RESUME_INTERRUPTED")
        session.wait_while_printing()
        session.script("M400")
    first = Session(tmp_path, (3., 3., 1.))
    first.play(pause_and_cut)
    assert first.position[2] > 20.
    second = Session(tmp_path, first.position)
    second.play(go_on)
    assert second.position == pytest.approx([30., 31., 2.05], abs=.03)


def test_cut_while_the_nozzle_is_lifted_needs_a_homed_z(tmp_path):
    (tmp_path / "job.gcode").write_text(make_job()[0])
    first = Session(tmp_path, (3., 3., 1.))
    first.play(lambda session: start_and_cut(session, 4.))

    def cut_in_the_lift(session):
        session.reactor.register_callback(
            lambda eventtime: session.script("RESUME_INTERRUPTED"))
        while session.run.machine.calc_position()[2] < first.position[2] + 2.:
            session.pause(.05)
        session.cut_power()

    def go_on(session):
        with pytest.raises(CommandError, match="its height is not known"):
            session.script("RESUME_INTERRUPTED")
        session.script("SET_KINEMATIC_POSITION Z=%.4f" % (second.position[2],))
        session.script("RESUME_INTERRUPTED")
        session.wait_while_printing()
        session.script("M400")
    second = Session(tmp_path, first.position)
    second.play(cut_in_the_lift)
    third = Session(tmp_path, second.position)
    third.play(go_on)
    assert third.position == pytest.approx([30., 31., 2.05], abs=.03)
