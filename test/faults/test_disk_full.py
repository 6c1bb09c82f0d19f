# SPDX-License-Identifier: GPL-3.0-or-later
"""A disk without room: the print goes on, what was saved before stays, and the
user is told."""

import errno
import logging
import os

import pytest
from daemon_run import ApiError
from machine_configs import BED, make_axes

from klippy import configsave
from klippy.extras import save_variables

CONFIG = (make_axes("cartesian", extra=BED)
          + "\n[virtual_sdcard]\npath: %(folder)s\n"
          + "[save_variables]\nfilename: %(folder)s/variables.cfg\n")
JOB = "G28\nG90\nG1 X50 Y40 Z3 F6000\nM400\n"
CALIBRATE = "PID_CALIBRATE HEATER=extruder TARGET=170"
CALLS = ("open", "write", "fsync", "replace")


def make_config(folder):
    return CONFIG % {"folder": folder}


class FullDisk:
    """Lets the n-th call of the given kind fail, as a full disk does."""

    def __init__(self, kind, number, code=errno.ENOSPC):
        self.kind, self.left, self.code = kind, number, code
        self.is_hit = False

    def _count(self, kind):
        if kind != self.kind:
            return
        self.left -= 1
        if not self.left:
            self.is_hit = True
            raise OSError(self.code, os.strerror(self.code))

    def install(self, monkeypatch, module):
        """Stand between a module and the disk."""
        disk = self

        class File:
            def __init__(self, file):
                self.file = file

            def __enter__(self):
                return self

            def __exit__(self, *args):
                self.file.close()

            def __getattr__(self, name):
                return getattr(self.file, name)

            def write(self, data):
                disk._count("write")
                return self.file.write(data)

        class System:
            def __getattr__(self, name):
                return getattr(os, name)

            def fsync(self, number):
                disk._count("fsync")
                os.fsync(number)

            def replace(self, old, new):
                disk._count("replace")
                os.replace(old, new)

        def open_file(path, mode="r", **options):
            if "w" not in mode:
                return open(path, mode, **options)
            disk._count("open")
            return File(open(path, mode, **options))

        monkeypatch.setattr(module, "open", open_file, raising=False)
        monkeypatch.setattr(module, "os", System())


def list_files(folder):
    """Names of the plain files of a folder."""
    return sorted(path.name for path in folder.iterdir() if path.is_file())


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
def test_log(make_host, tmp_path):
    """All of the log is lost, nothing else."""
    log = tmp_path / "klippy.log"
    log.symlink_to("/dev/full")
    (tmp_path / "job.gcode").write_text(JOB)
    level = logging.getLogger().level
    host = make_host(make_config(tmp_path), ["-l", str(log)])

    def look(host):
        host.script("SDCARD_PRINT_FILE FILENAME=job.gcode")
        host.pause(60.)
        assert host.status("print_stats")["state"] == "complete"
        assert host.status("toolhead")["position"][:3] == [50., 40., 3.]

    try:
        host.run_boots(look, look)
    finally:
        logging.getLogger().setLevel(level)


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("kind", CALLS)
def test_save_config(make_host, tmp_path, monkeypatch, kind, number):
    host = make_host(make_config(tmp_path))
    disk = FullDisk(kind, number)
    disk.install(monkeypatch, configsave)
    before = host.config_path.read_bytes()

    def calibrate_and_save(host):
        host.script(CALIBRATE)
        names = list_files(tmp_path)
        try:
            host.script("SAVE_CONFIG")
        except ApiError as err:
            assert disk.is_hit and "No space left" in str(err)
            assert "printer.cfg" in str(err)
        else:
            return
        assert host.info()["state"] == "ready"
        assert host.config_path.read_bytes() == before
        assert list_files(tmp_path) == names
        # there is room again
        host.script("SAVE_CONFIG")

    def find_it_saved(host):
        assert host.info()["state"] == "ready"
        assert "pid_kp" in host.config_path.read_text()

    # SAVE_CONFIG restarts the host by itself
    host.run_boots(lambda host: (calibrate_and_save(host), host.pause(5.)),
                   find_it_saved)


@pytest.mark.parametrize("code", [errno.EROFS, errno.EACCES])
def test_save_config_where_nothing_can_be_written(
        make_host, tmp_path, monkeypatch, code):
    """A read-only disk or folder: told, the value waits, nothing is lost."""
    host = make_host(make_config(tmp_path))
    before = host.config_path.read_bytes()

    def save(host):
        host.script(CALIBRATE)
        names = list_files(tmp_path)
        FullDisk("open", 1, code).install(monkeypatch, configsave)
        with pytest.raises(ApiError, match=os.strerror(code)):
            host.script("SAVE_CONFIG RESTART=0")
        assert host.status("configfile")["save_config_pending"]
        assert (host.config_path.read_bytes(), list_files(tmp_path)) == (before, names)
        host.script("SAVE_CONFIG RESTART=0")
        assert not host.status("configfile")["save_config_pending"]

    host.run_boots(save)
    assert "pid_kp" in host.config_path.read_text()


@pytest.mark.parametrize("kind", CALLS)
def test_save_variables(make_host, tmp_path, monkeypatch, kind):
    host = make_host(make_config(tmp_path))
    variables = tmp_path / "variables.cfg"

    def save(host):
        host.script("SAVE_VARIABLE VARIABLE=first VALUE=1")
        before, names = variables.read_bytes(), list_files(tmp_path)
        disk = FullDisk(kind, 1)
        disk.install(monkeypatch, save_variables)
        with pytest.raises(ApiError, match="No space left"):
            host.script("SAVE_VARIABLE VARIABLE=second VALUE=2")
        assert disk.is_hit and variables.read_bytes() == before
        assert host.status("save_variables")["variables"] == {"first": 1}
        host.script("SAVE_VARIABLE VARIABLE=second VALUE=2")
        assert host.status("save_variables")["variables"] == {
            "first": 1, "second": 2}
        assert list_files(tmp_path) == names

    host.run_boots(save)
