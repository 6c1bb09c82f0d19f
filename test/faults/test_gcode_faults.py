# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad lines in a printed file: told clearly, and the printer goes on."""

import re

import pytest
from daemon_run import ApiError
from machine_configs import BED, make_axes

MACROS = r"""
[virtual_sdcard]
path: {path}
{options}
[pause_resume]

[gcode_arcs]

[gcode_macro REFUSE]
gcode:
    {{ action_raise_error("no filament is loaded") }}

[gcode_macro DIVIDE]
gcode:
    G1 X{{ 1 / 0 }}
"""
START = b"G28\nG1 X10 F6000\nM140 S60\n"
FINISH = b"G1 X20\n"
# what fails: the line's bytes, and what the error must say
BAD = {
    "binary": (b"\x00\xff\xfe\x01\x80\x1b[2J garbage", r"is no G-code command"),
    "nul": (b"\0\0\0\0", r"'\\x00\\x00\\x00\\x00' is no G-code command"),
    "nul_inside": (b"G1 X1\x0011", r"X='1\\x0011': a finite number expected"),
    "huge_number": (b"G1 X" + b"1" * 1000000, r"X='1+ \.\.\. .*finite number"),
    "large_line": (b"G1 X1 " + b"y" * (1 << 20), r"G1 X1 y+ \.\.\. \(1048582 char"),
    "huge_line": (b"G1 X1 " + b"y" * (1 << 21), r"has more than 1048576 bytes"),
    "bad_name": (b"G1\xff X5", r"Malformed command 'G1\ufffd X5'"),
    "utf8": (b"G1 X\xff\xfe5", r"unable to parse X="),
    "nan": (b"G1 Xnan", r"'G1 Xnan'"),
    "overflow": (b"G1 X1e400", r"exponent: write it in digits"),
    "dots": (b"G1 X1.2.3", r"X='1\.2\.3': a finite number expected"),
    "missing": (b"SET_HEATER_TEMPERATURE TARGET=60", r"HEATER is missing"),
    "ill_typed": (b"SET_HEATER_TEMPERATURE HEATER=extruder TARGET=hot",
                  r"TARGET='hot': a finite number expected"),
    "syntax": (b"SET_HEATER_TEMPERATURE HEATER", r"expected KEY=VALUE at 'HEATER'"),
    "range": (b"G1 X500", r"Move out of range: 500\.000 .* \(in 'G1 X500'\)"),
    "spiral": (b"G3 X20 Y0 I3 J0", r"the end is 1?7\.000 mm from the centre, the start"
               r" 3\.000 mm, .* by 1?4\.000 mm \(at most 0\.500\)\. Is the centre"
               r" \(I, J\) given .*'spiral_tolerance' in \[gcode_arcs\]"),
    "arc_range": (b"G2 I-20 J0", r"out of range: .*\(the arc goes to [XY]"
                  r" -\d+\.\d+, which is not within -5\.000 to 220\.000\)"),
    "macro": (b"REFUSE", r"no filament is loaded"),
    "template": (b"DIVIDE", r"division by zero"),
}
HARMLESS = {
    "crlf": (START + FINISH).replace(b"\n", b"\r\n"),
    "no_last_newline": START + FINISH.rstrip(),
    "utf8_comment": START + b"; \xff\xfe \xe4\n(\x80)\n" + FINISH,
    "bom": b"\xef\xbb\xbf" + START + FINISH,
    "long_comment": START + b"; " + b"x" * (1 << 19) + b"\n" + FINISH,
}


def make_config(folder, options=""):
    return make_axes("cartesian", extra=BED) + MACROS.format(
        path=folder, options=options)


def make_file(folder, name, data):
    (folder / (name + ".gcode")).write_bytes(data)


def print_file(host, name):
    """Print to the end or a pause; returns print_stats."""
    host.script("SDCARD_PRINT_FILE FILENAME=%s.gcode" % (name,))
    return wait(host)


def wait(host):
    while True:
        host.pause(1.)
        stats = host.status("print_stats")
        if stats["state"] != "printing":
            return stats


def check_readable(host):
    """No terminal gets bytes that steer it."""
    text = "".join(host.output)
    assert all(char.isprintable() or char == "\n" for char in text)
    assert max(map(len, host.output)) < 2000


def check_prints(host):
    """The printer is ready, prints a good file and ends where it must."""
    assert host.info()["state"] == "ready"
    assert print_file(host, "good")["state"] == "complete"
    host.script("M400")
    assert host.machine.calc_position() == pytest.approx((20., 0., 0.), abs=0.02)


@pytest.mark.parametrize("name", HARMLESS)
def test_odd_files_print(make_host, tmp_path, name):
    make_file(tmp_path, "good", HARMLESS[name])
    make_host(make_config(tmp_path)).run_boots(check_prints)


@pytest.mark.parametrize("name", BAD)
def test_bad_line_pauses_the_print(make_host, tmp_path, name):
    line, message = BAD[name]
    make_file(tmp_path, "bad", START + line + b"\n" + FINISH)
    make_file(tmp_path, "good", START + FINISH)

    def body(host):
        stats = print_file(host, "bad")
        assert stats["state"] == "paused"
        assert re.match(r"bad\.gcode:4: ", stats["message"])
        assert re.search(message, stats["message"].replace("\n", " "))
        assert "!! " + stats["message"].split("\n")[0] in host.output
        assert host.info()["state"] == "ready"
        assert host.status("heater_bed")["target"] == 60.
        assert host.status("pause_resume")["is_paused"]
        host.script("RESUME")
        assert wait(host)["state"] == "complete"
        assert not host.status("pause_resume")["is_paused"]
        host.script("M400")
        assert host.machine.calc_position()[0] == pytest.approx(20., abs=0.02)
        check_readable(host)
        check_prints(host)
    make_host(make_config(tmp_path)).run_boots(body, check_prints)


def test_restart_from_the_pause(make_host, tmp_path):
    make_file(tmp_path, "bad", START + b"G1 X500\n" + FINISH)
    make_file(tmp_path, "good", START + FINISH)

    def body(host):
        assert print_file(host, "bad")["state"] == "paused"
    make_host(make_config(tmp_path)).run_boots(body, check_prints)


def test_new_job_and_cancel_from_the_pause(make_host, tmp_path):
    make_file(tmp_path, "bad", START + b"G1 X500\n" + FINISH)
    make_file(tmp_path, "good", START + FINISH)

    def body(host):
        assert print_file(host, "bad")["state"] == "paused"
        check_prints(host)
        assert print_file(host, "bad")["state"] == "paused"
        host.script("CANCEL_PRINT")
        assert host.status("print_stats")["state"] == "cancelled"
        check_prints(host)
    make_host(make_config(tmp_path)).run_boots(body)


def test_unknown_command_is_told_and_passed_over(make_host, tmp_path):
    make_file(tmp_path, "good", START + b"FROBNICATE A=1\nM9999\n" + FINISH)

    def body(host):
        check_prints(host)
        for name in ("FROBNICATE", "M9999"):
            assert '// Unknown command:"%s"' % name in host.output
        check_readable(host)
    make_host(make_config(tmp_path)).run_boots(body)


def test_bad_lines_are_skipped(make_host, tmp_path):
    lines = b"".join(line + b"\n" + b"M117 next\n" for line, _ in BAD.values())
    make_file(tmp_path, "good", START + lines + FINISH)

    def body(host):
        check_prints(host)
        assert host.status("virtual_sdcard")["skipped_lines"] == len(BAD)
        told = [text for text in host.output if text.startswith("!! good.gcode:")]
        numbers = [int(text.split(":")[1]) for text in told]
        assert numbers == list(range(4, 4 + 2 * len(BAD), 2))
    make_host(make_config(tmp_path, "on_command_error: skip")).run_boots(
        body, check_prints)


def test_print_stops_where_the_config_has_gcode_for_errors(make_host, tmp_path):
    make_file(tmp_path, "bad", START + b"G1 X500\n" + FINISH)
    make_file(tmp_path, "good", START + FINISH)
    options = "on_error_gcode:\n    TURN_OFF_HEATERS\n    G1 X30 F6000"

    def body(host):
        stats = print_file(host, "bad")
        assert stats["state"] == "error" and "bad.gcode:4" in stats["message"]
        assert host.status("heater_bed")["target"] == 0.
        assert not host.status("pause_resume")["is_paused"]
        host.script("M400")
        assert host.machine.calc_position()[0] == pytest.approx(30., abs=0.02)
        check_prints(host)
    make_host(make_config(tmp_path, options)).run_boots(body, check_prints)


def test_garbage_of_a_megabyte(make_host, tmp_path):
    """A file that is no G-code at all: pauses instead of telling every line."""
    garbage = bytes((n * 73 + n // 251) % 256 for n in range(1 << 20))
    make_file(tmp_path, "bad", garbage)
    make_file(tmp_path, "good", START + FINISH)

    def body(host):
        assert print_file(host, "bad")["state"] == "paused"
        assert host.info()["state"] == "ready"
        check_readable(host)
        host.script("CANCEL_PRINT")
        check_prints(host)
    make_host(make_config(tmp_path)).run_boots(body)


@pytest.mark.parametrize("name", sorted(set(BAD) - {"huge_line", "binary", "utf8",
                                                "bad_name"}))
def test_bad_line_of_a_client_is_an_answer(make_host, tmp_path, name):
    line, message = BAD[name]
    make_file(tmp_path, "good", START + FINISH)

    def body(host):
        host.script("G28")
        with pytest.raises(ApiError) as info:
            host.script(line.decode())
        assert re.search(message.split(r" \(in")[0], str(info.value).replace("\n", " "))
        check_readable(host)
        check_prints(host)
    make_host(make_config(tmp_path)).run_boots(body)
