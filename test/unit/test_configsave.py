# SPDX-License-Identifier: GPL-3.0-or-later
"""SAVE_CONFIG: what it writes, that it can be read, and that nothing is lost."""

import datetime
import os
import pathlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from klippy import configsave
from klippy.configsave import (
    build_file,
    comment_out,
    find_overridden,
    write_with_backup,
)
from klippy.configtext import ConfigReader

VALUE = r"[0-9a-z][0-9a-z.,\- ]{0,9}[0-9a-z](\n[0-9a-z]+){0,3}"
NOW = datetime.datetime(2026, 11, 23, 16, 5, 9)
MAIN = """# my printer
[extruder]
control: pid   # keep
pid_kp: 1
points:
  1, 2

  3, 4
# a remark
max: 5
[include more.cfg]
[fan]
pid_kp: 2
"""


def read_back(tmp_path, text):
    path = tmp_path / "p.cfg"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    return ConfigReader().read(str(path))


def test_conflicting_options_become_comments():
    lines = comment_out("p.cfg", MAIN.split("\n"),
                        {("extruder", "pid_kp"), ("extruder", "points")})
    changed = [line for line in lines if line not in MAIN.split("\n")]
    assert changed == ["#pid_kp: 1", "#points:", "#  1, 2", "#  3, 4"]
    assert "# a remark" in lines and "pid_kp: 2" in lines


def test_written_values_are_read_back(tmp_path):
    (tmp_path / "more.cfg").write_text("[x]\n")
    saved = {"extruder": {"pid_kp": "22.1"},
             "bed_mesh default": {"points": "\n0.1, 0.2\n0.3, 0.4", "n": "3"}}
    store = read_back(tmp_path, build_file("p.cfg", MAIN, saved))
    assert store.get("extruder", "pid_kp") == "22.1"
    assert store.get("extruder", "control") == "pid"
    assert store.get("bed_mesh default", "points") == "\n0.1, 0.2\n0.3, 0.4"
    assert store.get("fan", "pid_kp") == "2" and store.warnings == []


def test_saving_again_replaces_the_block():
    once = build_file("p.cfg", MAIN, {"fan": {"a": "1"}})
    twice = build_file("p.cfg", once, {"fan": {"a": "2"}})
    assert once.count("SAVE_CONFIG") == twice.count("SAVE_CONFIG") == 1
    assert build_file("p.cfg", twice, {"fan": {"a": "1"}}) == once
    assert build_file("p.cfg", twice, {}) == MAIN


def test_line_ends_and_foreign_bytes_stay():
    text = "[a]\r\nx: 1 # \udcff\r\n"
    result = build_file("p.cfg", text, {"b": {"y": "2"}})
    assert result.startswith(text) and "\n" not in result.replace("\r\n", "")


@given(st.dictionaries(
    st.from_regex(r"[a-z]{1,5}( [a-z0-9]{1,4})?", fullmatch=True),
    st.dictionaries(st.from_regex(r"[a-z_]{1,6}", fullmatch=True),
                    st.from_regex(VALUE, fullmatch=True), min_size=1), max_size=4))
def test_any_values_survive(tmp_path_factory, saved):
    saved.pop("include", None)
    saved = {k: v for k, v in saved.items() if not k.startswith("include")}
    folder = tmp_path_factory.getbasetemp()
    store = read_back(folder, build_file("p.cfg", "[z9]\nx: 1\n", saved))
    found = {name: dict(store.items(name)) for name in store.sections()}
    found.pop("z9")
    assert found == saved


def test_old_file_stays_as_dated_backup(tmp_path):
    path = tmp_path / "printer.cfg"
    path.write_text("old")
    os.chmod(path, 0o640)
    write_with_backup(path, "new", NOW)
    assert path.read_text() == "new"
    assert (tmp_path / "printer-20261123_160509.cfg").read_text() == "old"
    assert path.stat().st_mode & 0o777 == 0o640
    assert len(list(tmp_path.iterdir())) == 2


def test_link_to_the_config_stays_a_link(tmp_path):
    (tmp_path / "real.cfg").write_text("old")
    (tmp_path / "printer.cfg").symlink_to(tmp_path / "real.cfg")
    write_with_backup(tmp_path / "printer.cfg", "new", NOW)
    assert (tmp_path / "printer.cfg").is_symlink()
    assert (tmp_path / "real.cfg").read_text() == "new"


@pytest.mark.parametrize("n_good", range(6))
def test_failure_at_any_step_leaves_old_or_new(tmp_path, monkeypatch, n_good):
    path = tmp_path / "printer.cfg"
    path.write_text("old")
    calls = []

    def failing(func):
        def call(*args, **kwargs):
            calls.append(func)
            if len(calls) > n_good:
                raise OSError(28, "No space left on device")
            return func(*args, **kwargs)
        return call
    for name in ("fsync", "replace", "chmod"):
        monkeypatch.setattr(os, name, failing(getattr(os, name)))
    try:
        write_with_backup(path, "new", NOW)
    except OSError:
        pass
    assert path.read_text() in ("old", "new")
    assert n_good < 5 or path.read_text() == "new"


class PowerCut(BaseException):
    """Nothing of the program runs after it, no cleanup either."""


class CutDisk:
    """A disk whose power goes at the n-th step; what was not synced is half there."""

    STEPS = ("open", "write", "fsync", "chmod", "replace")

    def __init__(self, monkeypatch, n_good):
        self.n_left, self.is_cut, self.loose = n_good, False, {}
        self.monkeypatch = monkeypatch
        monkeypatch.setattr(configsave, "open", self.open_file, raising=False)
        for name in ("fsync", "chmod", "replace"):
            monkeypatch.setattr(os, name, self.wrap(getattr(os, name), name))
        # what a dead program would not do
        unlink = pathlib.Path.unlink
        monkeypatch.setattr(
            pathlib.Path, "unlink", lambda path, **options:
            None if self.is_cut else unlink(path, **options))

    def step(self):
        self.n_left -= 1
        if self.n_left < 0:
            self.is_cut = True
            raise PowerCut

    def wrap(self, func, name):
        def call(target, *args):
            self.step()
            if name == "fsync":
                self.loose = {path: file for path, file in self.loose.items()
                              if file.fileno() != target}
            return func(target, *args)
        return call

    def open_file(self, path, mode):
        self.step()
        file = open(path, mode)
        if "w" in mode:
            self.loose[path] = file
            write = file.write
            file = CutFile(file, lambda data: (self.step(), write(data)))
        return file

    def come_back(self):
        """Power is there again: the files are what reached the disk."""
        for path, file in self.loose.items():
            if not file.closed:
                file.close()
            data = path.read_bytes()
            path.write_bytes(data[:len(data) // 2])
        self.monkeypatch.undo()


class CutFile:
    def __init__(self, file, write):
        self.file, self.write = file, write

    def __enter__(self):
        return self

    def __exit__(self, *args):
        if args[0] is None:
            self.file.close()

    def __getattr__(self, name):
        return getattr(self.file, name)


@pytest.mark.parametrize("n_good", range(10))
def test_power_cut_at_any_step(tmp_path, monkeypatch, n_good):
    path = tmp_path / "printer.cfg"
    path.write_text("[a]\nx: 1\n")
    new = build_file("printer.cfg", "[a]\nx: 1\n", {"a": {"x": "2"}})
    disk = CutDisk(monkeypatch, n_good)
    is_done = False
    try:
        write_with_backup(path, new, NOW)
        is_done = True
    except PowerCut:
        pass
    disk.come_back()
    value = ConfigReader().read(str(path)).get("a", "x")
    assert value in ("1", "2") and (value == "2" or not is_done)
    assert is_done == (n_good >= 9)
    # what the cut left behind is in nobody's way
    write_with_backup(path, new, NOW)
    assert path.read_text() == new


def test_options_of_included_files(tmp_path):
    """The saved value counts, and the included file stays what it was."""
    included = "[extruder]\npid_kp: 1\n[bed_mesh]\nspeed: 5\n"
    (tmp_path / "more.cfg").write_text(included)
    main = "[include more.cfg]\n[extruder]\npid_ki: 2\n"
    (tmp_path / "p.cfg").write_text(main)
    saved = {"extruder": {"pid_kp": "22", "pid_ki": "3"}}
    for _ in range(2):
        text = build_file("p.cfg", (tmp_path / "p.cfg").read_text(), saved)
        store = read_back(tmp_path, text)
        assert [store.get("extruder", name) for name in ("pid_kp", "pid_ki")] == [
            "22", "3"]
        assert store.get("bed_mesh", "speed") == "5"
    assert (tmp_path / "more.cfg").read_text() == included
    (warning,) = store.warnings
    assert "more.cfg" in warning[0] and "overridden" in warning[0]


def test_saved_value_over_an_included_one_warns_once(tmp_path):
    """Only while the included value is another one than when it was saved."""
    (tmp_path / "more.cfg").write_text("[extruder]\npid_kp: 1 2\nrotation: a\n  \"b\n")
    (tmp_path / "p.cfg").write_text("[include more.cfg]\n[fan]\npin: x\n")
    saved = {"extruder": {"pid_kp": "22", "rotation": "7"}, "fan": {"pin": "y"}}
    store = ConfigReader().read(str(tmp_path / "p.cfg"))
    for _ in range(2):      # the second time from the remarks of the first
        overridden = find_overridden(store, saved)
        assert overridden == {("extruder", "pid_kp"): "1 2",
                              ("extruder", "rotation"): 'a\n"b'}
        text = build_file("p.cfg", (tmp_path / "p.cfg").read_text(), saved, overridden)
        store = read_back(tmp_path, text)
        assert store.get("extruder", "pid_kp") == "22" and not store.warnings
        assert store.get("extruder", "rotation") == "7"
    (tmp_path / "more.cfg").write_text("[extruder]\npid_kp: 5\n")
    store = ConfigReader().read(str(tmp_path / "p.cfg"))
    (warning,) = store.warnings
    assert "more.cfg:2" in warning[0] and "pid_kp" in warning[0]


def test_remark_changed_by_hand_is_no_error(tmp_path):
    (tmp_path / "more.cfg").write_text("[fan]\npin: x\n")
    text = build_file("p.cfg", "[include more.cfg]\n", {"fan": {"pin": "y"}},
                      {("fan", "pin"): "x"})
    store = read_back(tmp_path, text.replace('overrides "x"', 'overrides "x\\"'))
    assert store.get("fan", "pin") == "y" and len(store.warnings) == 1
