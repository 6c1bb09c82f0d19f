# SPDX-License-Identifier: GPL-3.0-or-later
"""Printing files: virtual_sdcard, print_stats, pause_resume, sdcard_loop."""

import re

import pytest
from front_end import GCodeMove, Printer, Toolhead, write_file
from hypothesis import given, settings
from hypothesis import strategies as st

from klippy import webhooks
from klippy.errors import CommandError
from klippy.extras import sd_stream


class Job:
    """A printer with files, and the commands that ran."""

    def __init__(self, folder, options=None, has_pause=True, **files):
        """options: further ones of [virtual_sdcard]."""
        self.folder = folder
        for name, data in files.items():
            write_file(folder, name + ".gcode", data)
        self.printer = printer = Printer()
        webhooks.setup(printer)
        printer.add_object("gcode_move", GCodeMove(printer))
        printer.add_object("toolhead", Toolhead())
        printer.add_object("heaters", printer.gcode)
        self.ran = []
        printer.gcode.register_command("RUN", self.run)
        printer.gcode.register_command("FAIL", self.fail)
        printer.gcode.register_command("TURN_OFF_HEATERS", self.run)
        self.sdcard = printer.load("virtual_sdcard", path=str(folder),
                                   **(options or {}))
        self.stats = printer.lookup_object("print_stats")
        if has_pause:
            self.pause_resume = printer.load("pause_resume")
        printer.load("sdcard_loop")
        printer.make_ready()

    def run(self, gcmd):
        self.ran.append(gcmd.get_commandline())
        if "T=" in gcmd.get_commandline():
            seconds = gcmd.get_float("T")
            self.printer.reactor.pause(self.printer.reactor.monotonic() + seconds)

    def fail(self, gcmd):
        raise gcmd.error("it failed")

    def script(self, text):
        self.printer.gcode.run_script(text)

    def start(self, name, seconds=1.):
        self.script("SDCARD_PRINT_FILE FILENAME=%s.gcode" % (name,))
        self.printer.run_for(seconds)

    def message(self):
        return self.stats.get_status(self.printer.clock.now)["message"]

    def state(self):
        return self.stats.get_status(self.printer.clock.now)["state"]

    def status(self):
        return self.sdcard.get_status(self.printer.clock.now)


@pytest.fixture
def make_job(tmp_path):
    jobs = []

    def make(options=None, has_pause=True, **files):
        jobs.append(Job(tmp_path, options, has_pause, **files))
        return jobs[-1]
    yield make
    for job in jobs:
        job.printer.close()


@pytest.mark.parametrize("data, ran", [
    ("", []), ("RUN 1", ["RUN 1"]), ("RUN 1\r\nRUN 2\r\n", ["RUN 1", "RUN 2"]),
    ("\n\n; c\n  RUN ; x\n%\n", ["RUN ; x"]),
    (b"\xef\xbb\xbfRUN\n; \xff\xfe\nRUN\n", ["RUN", "RUN"]),
    ("RUN\n" * 100000, ["RUN"] * 100000),
    ("; " + "x" * 500000 + "\nRUN\n", ["RUN"]),
])
def test_whole_file_runs(make_job, data, ran):
    job = make_job(a=data)
    job.start("a")
    assert job.ran == ran and job.state() == "complete"
    size = len(data)
    assert job.status() == {
        "file_path": None, "is_active": False, "file_position": size,
        "file_size": size, "progress": 1. if size else 0., "skipped_lines": 0}
    with pytest.raises(CommandError, match="No file is selected"):
        job.script("M24")


BAD_LINES = pytest.mark.parametrize("data, message", [
    (b"RUN\n\0\0\nRUN 2\n", r"^a.gcode:2: '\\x00\\x00' is no G-code command$"),
    (b"RUN\n" + b"x" * (2 << 20) + b"\nRUN 2\n",
     r"^a.gcode:2: The line at byte 4 of .* more than"),
    (b"RUN\nFAIL\nRUN 2\n", r"^a.gcode:2: it failed \(in 'FAIL'\)$"),
])


@BAD_LINES
@pytest.mark.parametrize("command", ["RESUME", "M24"])
def test_bad_line_pauses_and_the_next_one_follows(make_job, data, message, command):
    job = make_job(a=data)
    job.start("a")
    assert job.ran == ["RUN"] and job.state() == "paused"
    assert re.search(message, job.message())
    assert "!! " + job.message() in job.printer.output
    assert job.printer.state == "ready" and not job.status()["is_active"]
    assert job.pause_resume.is_paused and job.pause_resume.sd_paused
    job.script(command)
    job.printer.run_for(1.)
    assert job.ran == ["RUN", "RUN 2"] and job.state() == "complete"
    assert job.message() == "" and not job.pause_resume.is_paused


@BAD_LINES
def test_bad_line_is_skipped_and_counted(make_job, data, message):
    job = make_job({"on_command_error": "skip"}, a=data * 3)
    job.start("a")
    assert job.ran == ["RUN", "RUN 2"] * 3 and job.state() == "complete"
    assert job.status()["skipped_lines"] == 3
    told = [text[3:] for text in job.printer.output if text.startswith("!! ")]
    assert re.search(message, told[0])
    assert [text.split(":")[1] for text in told] == ["2", "5", "8"]
    job.script("SDCARD_RESET_FILE")
    assert job.status()["skipped_lines"] == 0


@BAD_LINES
@pytest.mark.parametrize("options", [
    {"on_command_error": "stop"}, {"on_error_gcode": "RUN error"}])
def test_bad_line_stops_the_print_if_that_is_asked_for(make_job, data, message,
                                                       options):
    job = make_job(options, a=data)
    job.start("a")
    answer = "RUN error" if "on_error_gcode" in options else "TURN_OFF_HEATERS"
    assert job.ran == ["RUN", answer] and job.state() == "error"
    assert re.search(message, job.message())
    assert job.printer.state == "ready" and not job.status()["is_active"]
    # the failed line runs again: what it needs may be there now
    job.printer.gcode.register_command("FAIL", None)
    if b"FAIL" in data:
        job.script("M24")
        job.printer.run_for(1.)
        assert job.ran[2:] == ["RUN 2"] and job.state() == "complete"


def test_on_error_gcode_may_go_with_pause(make_job):
    job = make_job({"on_command_error": "pause", "on_error_gcode": "RUN error"},
                   a="FAIL\nRUN\n")
    job.start("a")
    assert job.ran == [] and job.state() == "paused"


def test_pause_for_an_error_runs_the_users_macro(make_job):
    job = make_job(a="FAIL\nRUN\nFAIL\nRUN\n")
    gcode = job.printer.gcode
    base = gcode.register_command("PAUSE", None)

    def park(gcmd):
        gcode.run_script_from_command("RUN park")
        base(gcmd)
        if len(job.ran) > 2:
            raise gcmd.error("no way to park")
    gcode.register_command("PAUSE", park)
    job.start("a")
    assert job.ran == ["RUN park"] and job.state() == "paused"
    job.script("RESUME")
    job.printer.run_for(1.)
    assert job.ran == ["RUN park", "RUN", "RUN park"] and job.state() == "paused"
    assert "!! no way to park" in job.printer.output
    assert job.message().startswith("a.gcode:3: it failed")
    job.script("RESUME")
    job.printer.run_for(1.)
    assert job.ran[3:] == ["RUN"] and job.state() == "complete"


@pytest.mark.parametrize("answer", ["nothing", "error"])
def test_pause_for_an_error_needs_no_macro_that_works(make_job, answer):
    job = make_job(a="FAIL\nRUN\n")
    job.printer.gcode.register_command("PAUSE", None)
    job.printer.gcode.register_command(
        "PAUSE", job.fail if answer == "error" else lambda gcmd: None)
    job.start("a")
    assert job.state() == "paused" and job.pause_resume.is_paused
    job.script("RESUME")
    job.printer.run_for(1.)
    assert job.ran == ["RUN"] and job.state() == "complete"


def test_pause_for_an_error_needs_no_pause_resume(make_job):
    job = make_job(has_pause=False, a="FAIL\nRUN\n")
    job.start("a")
    assert job.state() == "paused" and job.ran == []
    job.script("M24")
    job.printer.run_for(1.)
    assert job.ran == ["RUN"] and job.state() == "complete"


def test_pause_for_an_error_can_be_cancelled(make_job):
    job = make_job(a="FAIL\nRUN\n", b="RUN b\n")
    job.start("a")
    job.script("CANCEL_PRINT")
    assert job.state() == "cancelled" and job.message() == ""
    assert not job.pause_resume.is_paused and job.ran == []
    job.start("b")
    assert job.ran == ["RUN b"] and job.state() == "complete"


def test_many_bad_lines_in_a_row_are_not_skipped(make_job):
    job = make_job({"on_command_error": "skip"},
                   a="FAIL\n" * 30 + "RUN 1\n" + "FAIL\nRUN\n" * 30)
    job.start("a")
    assert job.state() == "paused" and job.status()["skipped_lines"] == 20
    assert job.message().startswith("a.gcode:21: it failed")
    assert "// 21 lines in a row failed: the print pauses" in job.printer.output
    job.script("RESUME")
    job.printer.run_for(1.)
    assert job.state() == "complete" and len(job.ran) == 31
    assert job.status()["skipped_lines"] == 59


def test_line_numbers_survive_jumps(make_job):
    job = make_job(
        a="RUN 1\nSDCARD_LOOP_BEGIN COUNT=3\n\nRUN 2\nFAIL\nSDCARD_LOOP_END\n"
          "RUN 3\nFAIL\n", b="; \xe4\n" * 100000 + "FAIL\nFAIL\n")
    job.sdcard.error_policy.action = "skip"

    def list_lines():
        lines = [text.split(":")[1] for text in job.printer.output if "!!" in text]
        job.printer.output.clear()
        return lines
    job.start("a")
    assert list_lines() == ["5", "5", "5", "8"] and job.state() == "complete"
    job.script("M23 b.gcode\nM26 S350000\nM24")
    job.printer.run_for(1.)
    assert list_lines() == ["100001", "100002"] and job.state() == "complete"


def test_shutdown_within_a_line_is_no_pause(make_job):
    job = make_job(a="DIE\nRUN\n")

    def die(gcmd):
        job.printer.invoke_shutdown("the mcu is gone")
        raise gcmd.error("no answer")
    job.printer.gcode.register_command("DIE", die)
    job.start("a")
    assert job.state() == "error" and "no answer" in job.message()
    assert job.ran == [] and not job.pause_resume.is_paused


def test_pause_and_resume_of_a_file(make_job):
    job = make_job(a="".join("RUN T=1 N=%d\n" % n for n in range(20)))
    job.start("a", 5.)
    n_before = len(job.ran)
    job.script("PAUSE")
    assert job.state() == "paused" and job.pause_resume.get_status(0.)["is_paused"]
    n_paused = len(job.ran)
    assert n_before <= n_paused <= n_before + 1
    job.printer.run_for(10.)
    assert len(job.ran) == n_paused
    job.script("PAUSE\nRESUME VELOCITY=20")
    job.printer.run_for(30.)
    assert [line[-2:].strip("=") for line in job.ran] == [str(n) for n in range(20)]
    assert job.state() == "complete"
    move = job.printer.lookup_object("gcode_move")
    assert move.states == [
        "SAVE_GCODE_STATE NAME=PAUSE_STATE",
        "RESTORE_GCODE_STATE NAME=PAUSE_STATE MOVE=1 MOVE_SPEED=20.0000"]


def test_pause_inside_the_file(make_job):
    job = make_job(a="RUN 1\nPAUSE\nRUN 2\n")
    job.start("a")
    assert job.ran == ["RUN 1"] and job.state() == "paused"
    job.script("RESUME")
    job.printer.run_for(1.)
    assert job.ran == ["RUN 1", "RUN 2"] and job.state() == "complete"


def test_pause_and_resume_before_the_work_wakes(make_job):
    job = make_job(a="RUN 1\nRUN 2\nRUN 3\n")
    job.script("SDCARD_PRINT_FILE FILENAME=a.gcode\nPAUSE\nRESUME\nM25\nM24")
    job.printer.run_for(1.)
    assert job.ran == ["RUN 1", "RUN 2", "RUN 3"] and job.state() == "complete"


def test_cancel_then_another_file(make_job):
    job = make_job(a="RUN T=1\n" * 50, b="RUN b\n")
    job.start("a", 5.)
    job.script("CANCEL_PRINT")
    assert job.state() == "cancelled" and job.status()["file_size"] == 0
    job.script("SDCARD_PRINT_FILE FILENAME=b.gcode")
    job.printer.run_for(5.)
    assert job.ran[-1] == "RUN b" and job.state() == "complete"
    assert ("virtual_sdcard:reset_file",) in job.printer.events


def test_console_gets_its_turn_between_lines(make_job):
    job = make_job(a="RUN T=1\n" * 20)
    job.start("a", 2.)
    job.script("RUN console")
    n_lines = job.ran.index("RUN console")
    assert n_lines <= 5
    job.printer.run_for(60.)
    assert len(job.ran) == 21 and job.state() == "complete"


def test_shutdown_ends_the_print(make_job):
    job = make_job(a="RUN\nM112\nRUN\n")
    job.start("a")
    assert job.ran == ["RUN"] and job.state() == "error"
    assert "M112" in job.stats.get_status(0.)["message"]


def test_file_that_vanishes_goes_on_one_that_is_cut_does_not(make_job):
    lines = "RUN N=%06d\n"
    data = "".join(lines % n for n in range(40000))
    job = make_job(a="RUN T=5\n" + data, b="RUN T=5\n" + data)
    job.start("a", 2.)
    (job.folder / "a.gcode").unlink()
    job.printer.run_for(10.)
    assert len(job.ran) == 40001 and job.state() == "complete"
    job.start("b", 2.)
    with open(job.folder / "b.gcode", "r+b") as file:
        file.truncate(200000)
    job.printer.run_for(10.)
    assert job.state() == "paused"
    assert "it had 520008 bytes" in job.message()
    # no line of it failed: it is read again, and is not passed over
    n_ran = len(job.ran)
    job.script("RESUME")
    job.printer.run_for(1.)
    assert job.state() == "paused" and len(job.ran) == n_ran
    with open(job.folder / "b.gcode", "r+b") as file:
        file.write(("RUN T=5\n" + data).encode())
    job.script("RESUME")
    job.printer.run_for(10.)
    assert job.state() == "complete" and len(job.ran) == 2 * 40001


def test_commands(make_job, tmp_path):
    job = make_job(a="RUN 1\nRUN 2\n", B="RUN\n")
    write_file(tmp_path, "sub/deep.gcode", "RUN deep\n")
    write_file(tmp_path, ".hidden.gcode", "")
    (tmp_path / "sub" / "loop").symlink_to(tmp_path)
    job.script("M20\nM21\nM27\nM23 /A.GCODE\nM26 S6\nM27\nM24")
    assert job.printer.output == [
        "Begin file list", "a.gcode 12", "B.gcode 4", "End file list", "SD card ok",
        "Not SD printing.", "File opened:a.gcode Size:12", "File selected",
        "SD printing byte 0/12"]
    job.printer.run_for(1.)
    assert job.ran == ["RUN 2"]
    job.script("SDCARD_PRINT_FILE FILENAME=sub/deep.gcode")
    job.printer.run_for(1.)
    assert job.ran[-1] == "RUN deep"
    for text, message in (
            ("M23 none.gcode", "no file 'none.gcode'"), ("M28 x", "not supported"),
            ("SDCARD_PRINT_FILE FILENAME=../x", "no file '../x'"),
            ("M26 S-1", "at least 0"), ("SDCARD_PRINT_FILE", "FILENAME is missing"),
            ("SDCARD_LOOP_BEGIN COUNT=1", "only possible in a file")):
        with pytest.raises(CommandError, match=message):
            job.script(text)


def test_missing_folder_is_an_error(make_job, tmp_path):
    job = make_job()
    job.sdcard.sdcard_dirname = str(tmp_path / "none")
    with pytest.raises(CommandError, match="Unable to list"):
        job.script("M20")


def test_busy(make_job):
    job = make_job(a="RUN T=1\n" * 10)
    job.start("a")
    with pytest.raises(CommandError, match="SD busy"):
        job.sdcard.do_resume()
    for text in ("M24", "M23 a.gcode", "SDCARD_PRINT_FILE FILENAME=a.gcode", "M26 S0"):
        with pytest.raises(CommandError, match="SD busy"):
            job.script(text)
    job.printer.run_for(60.)
    assert len(job.ran) == 10


def test_reset_from_the_file_itself_is_refused(make_job):
    job = make_job(a="SDCARD_RESET_FILE\n")
    job.start("a")
    assert "from the file itself" in job.stats.get_status(0.)["message"]


def test_loops(make_job):
    job = make_job(
        a="SDCARD_LOOP_BEGIN COUNT=2\nRUN a\nSDCARD_LOOP_BEGIN COUNT=3\nRUN b\n"
          "SDCARD_LOOP_END\nSDCARD_LOOP_END\nRUN c\n",
        b="SDCARD_LOOP_BEGIN COUNT=0\nRUN T=1\nSDCARD_LOOP_END\nRUN end\n",
        c="SDCARD_LOOP_END\n")
    job.start("a")
    assert "".join(line[-1] for line in job.ran) == "abbbabbbc"
    job.ran.clear()
    job.start("b", 20.)
    assert len(job.ran) > 10 and "RUN end" not in job.ran
    job.script("SDCARD_LOOP_DESIST")
    job.printer.run_for(5.)
    assert job.ran[-1] == "RUN end"
    job.start("c")
    assert "without SDCARD_LOOP_BEGIN" in job.stats.get_status(0.)["message"]


def test_print_stats(make_job):
    job = make_job(a="RUN T=10\nG1 X1 E5\nRUN T=20\nPAUSE\nRUN T=5\n")
    job.start("a", 50.)
    status = job.stats.get_status(job.printer.clock.now)
    assert status["state"] == "paused" and status["filename"] == "a.gcode"
    assert status["filament_used"] == 5.
    job.script("RESUME")
    job.printer.run_for(50.)
    status = job.stats.get_status(job.printer.clock.now)
    assert status["state"] == "complete"
    assert status["total_duration"] > status["print_duration"] >= 25.
    job.script("SET_PRINT_STATS_INFO TOTAL_LAYER=10\n"
               "SET_PRINT_STATS_INFO CURRENT_LAYER=12")
    info = job.stats.get_status(0.)["info"]
    assert info == {"total_layer": 10, "current_layer": 10}
    job.script("SET_PRINT_STATS_INFO TOTAL_LAYER=0")
    assert job.stats.get_status(0.)["info"] == {"total_layer": None,
                                               "current_layer": None}
    job.script("SDCARD_RESET_FILE")
    assert job.stats.get_status(0.)["state"] == "standby"


def test_pause_without_file(make_job):
    job = make_job()
    job.script("PAUSE\nPAUSE\nRESUME\nRESUME\nCANCEL_PRINT\nPAUSE\nCLEAR_PAUSE")
    assert job.printer.output == [
        "// action:paused", "// Print already paused", "// action:resumed",
        "// Print is not paused, resume aborted", "// action:cancel",
        "// action:paused"]
    assert not job.pause_resume.is_paused


@settings(max_examples=100, deadline=None)
@given(data=st.lists(st.binary(max_size=20).map(lambda b: b.replace(b"\n", b"")),
                     max_size=12),
       size=st.integers(1, 40))
def test_stream_gives_every_line_for_any_block_size(tmp_path_factory, data, size):
    printer = Printer()
    seen = []
    printer.gcode.core_commands.run_unknown = seen.append
    path = write_file(tmp_path_factory.mktemp("s"), "x.gcode", b"\n".join(
        b"L%d;" % n + line for n, line in enumerate(data)))
    old, sd_stream.BLOCK_SIZE = sd_stream.BLOCK_SIZE, size
    try:
        stream = sd_stream.SdStream(sd_stream.BlockReader(str(path)), printer.gcode)
        while not stream.run_lines():
            assert stream.position <= stream.next_position
    finally:
        sd_stream.BLOCK_SIZE = old
    assert [c.get_command() for c in seen] == ["L%d" % n for n in range(len(data))]
    stream.close()
    printer.close()
