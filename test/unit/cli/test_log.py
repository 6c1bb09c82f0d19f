# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy log` and `klippy graph` on the log of a daemon that was shut down."""

import csv
import logging
import math

import pytest
from daemon_run import Host
from machine_configs import BED, make_axes

from klippy import cli
from klippy.cli import graph, log_reader

CONFIG = make_axes("cartesian", extra=BED) + "[simulator]\nstart_position: 3, 3, 1\n"
LINE = ("Stats 12.5: gcodein=7 mcu: mcu_awake=0.25 srtt=0.001 freq=20000388 "
        "temperature_sensor my box: temp=31.5 print_time=161.0 buffer_time=1.500 "
        "sysload=0.96 odd=text extruder: target=200 temp=199.5 pwm=0.400")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Path of a log: a move, an emergency stop, another start."""
    folder = tmp_path_factory.mktemp("log")
    path, level = folder / "klippy.log", logging.getLogger().level

    def stop(host):
        host.script("G28\nM104 S150\nG1 X60 F3000")
        host.pause(20.)
        host.client.ask("emergency_stop")
        host.pause(2.)

    def go_on(host):
        host.pause(5.)
    try:
        Host(folder, CONFIG, ["-l", str(path)]).run_boots(
            stop, go_on, restart="gcode/firmware_restart")
    finally:
        logging.getLogger().setLevel(level)
    return path


def test_stats_of_all_kinds():
    stats = log_reader.parse_stats(LINE)
    assert stats.eventtime == 12.5
    assert stats.groups == {
        "": {"gcodein": 7., "print_time": 161., "buffer_time": 1.5, "sysload": .96},
        "mcu": {"mcu_awake": .25, "srtt": .001, "freq": 20000388.},
        "temperature_sensor my box": {"temp": 31.5},
        "extruder": {"target": 200., "temp": 199.5, "pwm": .4}}
    assert log_reader.parse_stats("Statistics: a=1") is None


def test_reads_starts_and_shutdowns(log):
    starts = log_reader.read_logs([log])
    assert len(starts) == 2
    first, second = starts
    assert first.config == second.config and "[stepper_x]" in first.config
    shutdown, = first.shutdowns
    assert "webhooks" in shutdown.cause and not second.shutdowns
    assert any(line.startswith("sent 0 ") for line in shutdown.lines)
    assert not any(line.startswith("Stats") for line in shutdown.lines)
    times, temperatures = first.get_series("extruder", "temp")
    assert len(times) > 20 and temperatures[-1] > 40.


def test_sums_up_and_extracts(log, tmp_path, capsys):
    assert cli.main(["log", str(log), "--out", str(tmp_path / "out")]) == 0
    text = capsys.readouterr().out
    assert "shutdown at" in text and "Start 2:" in text
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"config-1.cfg", "shutdown-1.log", "stats-1.csv", "stats-2.csv"}
    with (tmp_path / "out" / "stats-1.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[-1]["extruder.temp"]) > 40. and float(rows[-1]["print_time"]) > 0
    # the config of a log is a config
    assert cli.main(["check", str(tmp_path / "out" / "config-1.cfg")]) == 0


def test_rotated_logs_go_on(log, tmp_path):
    lines = log.read_text().splitlines()
    cut = next(n for n, line in enumerate(lines) if line.startswith("Stats")) + 5
    config = lines[lines.index(log_reader.CONFIG_START):
                   lines.index(log_reader.CONFIG_END) + 1]
    (tmp_path / "a").write_text("\n".join(lines[:cut]) + "\n")
    (tmp_path / "b").write_text("\n".join(config + lines[cut:]) + "\n")
    parts = log_reader.read_logs([tmp_path / "a", tmp_path / "b"])
    whole = log_reader.read_logs([log])
    assert [start.stats for start in parts] == [start.stats for start in whole]


def test_draws_every_plot(log, tmp_path):
    pytest.importorskip("matplotlib")
    image = tmp_path / "all.svg"
    assert cli.main(["graph", str(log), "-o", str(image)]) == 0
    text = image.read_text()
    for label in ("host", "extruder", "planned ahead", "to mcu", "degC", "stalls"):
        assert "<!-- %s -->" % (label,) in text
    image = tmp_path / "one.png"
    assert cli.main(["graph", str(log), "-o", str(image), "--plots", "load",
                     "--start", "2"]) == 0
    assert image.read_bytes().startswith(b"\x89PNG")


def test_timeline_of_clocks_that_begin_anew():
    starts = [log_reader.Start(stats=[
        log_reader.Stats(time, {"": {"cputime": time / 2}}) for time in times])
        for times in ((100., 101., 102.), (5., 6., 7.))]
    times, rates = graph.Timeline(starts).get_series("", "cputime", True)
    assert times == [101., 102., 103., 103., 104.]
    assert math.isnan(rates[2]) and rates[:2] == rates[3:] == [.5, .5]


@pytest.mark.parametrize("arguments, text", [
    (["log", "none.log"], "none.log"), (["graph", "none.log"], "none.log"),
    (["log", "/dev/null"], "no printer"), (["graph", "/dev/null"], "no statistics"),
    (["graph", "/dev/null", "--plots", "lod"], "no plot 'lod'"),
    (["graph", "/dev/null", "--plots", ","], "name a plot"),
    (["graph", "/dev/null", "--start", "3"], "0 starts")])
def test_what_cannot_be_is_told(capsys, arguments, text):
    assert cli.main(arguments) == 1
    assert text in capsys.readouterr().err
