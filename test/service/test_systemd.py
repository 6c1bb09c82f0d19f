# SPDX-License-Identifier: GPL-3.0-or-later
"""The service under a real systemd: a copy of this machine, booted in a container.

The copy is an overlay over this machine's files, in memory, without a network.
inside.py does what a user does there; `make test-systemd` runs this.
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON = pathlib.Path("/usr/bin/python%d.%d" % sys.version_info[:2])
PARTS = ("klippy", "klippy_ext", "out-simulator", "config", "VERSION")
MODULES = ("greenlet", "jinja2", "markupsafe", "serial")
PROBE = """\
[Service]
Type=oneshot
TimeoutStartSec=infinity
ExecStart={python} /opt/klippy/inside.py /opt/klippy/result.json
"""
pytestmark = [pytest.mark.slow, pytest.mark.realtime]


def find_reason():
    """Why no machine can be booted here, "" if one can."""
    if os.geteuid() != 0:
        return "only root can boot a container"
    if not shutil.which("systemd-nspawn"):
        return "systemd-nspawn is not installed (systemd-container)"
    if not PYTHON.exists():
        return "another user has no %s" % (PYTHON,)
    if "overlay" not in pathlib.Path("/proc/filesystems").read_text():
        return "the kernel has no overlay files"
    return ""


def fill(folder):
    """Put what runs there into the machine's /opt/klippy."""
    target = folder / "opt" / "klippy"
    target.mkdir(parents=True)
    for name in PARTS:
        source = ROOT / name
        (shutil.copytree if source.is_dir() else shutil.copy)(source, target / name)
    for name in MODULES:
        module = __import__(name)
        shutil.copytree(pathlib.Path(module.__file__).parent, target / name)
    shutil.copy(ROOT / "test/service/inside.py", target)
    subprocess.check_call(["chmod", "-R", "go+rX", str(target)])
    (folder / "etc" / "machine-id").write_text("uninitialized\n")
    (folder / "etc/systemd/system/probe.service").write_text(
        PROBE.format(python=PYTHON))
    return target / "result.json"


def boot(folder):
    """Boot the machine; returns when it is off again."""
    return subprocess.run(
        ["systemd-nspawn", "--register=no", "--keep-unit", "--quiet",
         "--directory", str(folder), "--boot", "--private-network",
         "--console=pipe", "--link-journal=no", "--", "systemd.unit=probe.service"],
        stdin=subprocess.DEVNULL, text=True, capture_output=True, timeout=500)


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """What inside.py noted."""
    reason = find_reason()
    if reason:
        pytest.skip("no real systemd here: " + reason)
    base = tmp_path_factory.mktemp("machine")
    mounts = []

    def mount(*words):
        subprocess.run(["mount", *words], check=True)
        mounts.append(words[-1])

    try:
        mount("-t", "tmpfs", "tmpfs", str(base))
        for name in ("upper", "work", "root"):
            (base / name).mkdir()
        mount("-t", "overlay", "overlay", "-o", "lowerdir=/,upperdir=%s,workdir=%s"
              % (base / "upper", base / "work"), str(base / "root"))
        result = fill(base / "root")
        output = boot(base / "root")
        if not result.exists():
            pytest.skip("no real systemd here: systemd-nspawn says: "
                        + (output.stderr + output.stdout)[-500:])
        results = json.loads(result.read_text())
    finally:
        for path in reversed(mounts):
            subprocess.run(["umount", path], check=True)
    assert "error" not in results, results["error"] + results["journal"]
    return results


def test_is_installed(machine):
    text, status = machine["install"]
    assert status == 0, text
    assert "wrote /etc/systemd/system/klipper.service" in text


def test_reaches_active_and_ready(machine):
    assert machine["start"] == ["", 0]
    assert machine["started"]["ActiveState"] == "active"
    ready = machine["ready"]
    assert (ready["SubState"], ready["User"]) == ("running", "printer")
    assert ready["StatusText"].startswith("ready"), ready


def test_remembers_checked_macros(machine):
    """So that the next start need not check them again."""
    assert any(name.startswith("macros-") for name in machine["cache"])


def test_is_restarted_after_a_crash(machine):
    assert machine["killed"]["NRestarts"] == "1"
    assert machine["killed"]["MainPID"] != machine["ready"]["MainPID"]
    assert 2. <= machine["kill_s"] < 30.


def test_watchdog_restarts_what_hangs(machine):
    """After 30 s without a sign of life, and the time to end by itself."""
    assert machine["hung"]["NRestarts"] == "2"
    assert 20. < machine["hang_s"] < 90.
    assert "Watchdog timeout" in machine["journal"]


def test_stops_cleanly(machine):
    assert machine["stop"] == ["", 0]
    stopped = machine["stopped"]
    assert (stopped["ActiveState"], stopped["Result"], stopped["ExecMainStatus"]) == (
        "inactive", "success", "0")
    assert machine["stop_s"] < 10. and machine["left"] == []


def test_two_printers(machine):
    text, status = machine["template"]
    assert status == 0, text
    assert [unit["ActiveState"] for unit in machine["printers"]] == ["active"] * 2
    assert len({unit["MainPID"] for unit in machine["printers"]}) == 2
    assert [unit["Result"] for unit in machine["stopped_printers"]] == ["success"] * 2


def test_journal(machine):
    assert re.search(r"Started .*klippy", machine["journal"])
    assert "Traceback" not in machine["journal"]


def test_udev_reads_the_rules(machine):
    assert "60-klippy.rules" in machine["udev"]
    assert not re.search(r"60-klippy\.rules:\d+", machine["udev"])


def test_has_few_rights(machine):
    figure = re.search(r"Overall exposure level for klipper\.service: ([\d.]+)",
                       machine["security"])
    assert float(figure[1]) <= 2.5
