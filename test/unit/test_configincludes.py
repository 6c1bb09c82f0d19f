# SPDX-License-Identifier: GPL-3.0-or-later
"""Included files after SAVE_CONFIG: what is saved is no option there any more."""

import datetime

from klippy import configincludes
from klippy.configsave import build_file, find_overridden
from klippy.configtext import ConfigReader

NOW = datetime.datetime(2026, 11, 23, 16, 5, 9)


def test_saved_options_become_comments(tmp_path):
    main, folder = tmp_path / "printer.cfg", tmp_path / "parts"
    folder.mkdir()
    main.write_text("[include parts/*.cfg]\n[a]\nx: 1\n")
    fan, other = folder / "fan.cfg", folder / "other.cfg"
    fan.write_bytes(b"[fan]\r\nmax: 1\r\n  2\r\nmin: 3 # keep\r\n")
    other.write_text("[other]\nmax: 5\n")
    saved = {"fan": {"max": "4"}, "a": {"x": "2"}, "new": {"y": "1"}}
    store = ConfigReader().read(str(main))
    configincludes.clean(store, saved, NOW)
    assert fan.read_bytes() == b"[fan]\r\n#max: 1\r\n#  2\r\nmin: 3 # keep\r\n"
    assert other.read_text() == "[other]\nmax: 5\n"
    backups = tmp_path / "config_backups"
    assert [path.name for path in backups.iterdir()] == [
        "parts_fan-20261123_160509.cfg"]
    assert (backups / "parts_fan-20261123_160509.cfg").read_bytes().startswith(
        b"[fan]\r\nmax: 1")
    # nothing is left that the include line would take for a part
    assert sorted(path.name for path in folder.iterdir()) == ["fan.cfg", "other.cfg"]
    assert ConfigReader().read(str(main)).options("fan") == ["min"]


def test_options_that_were_overridden_before(tmp_path):
    main, more = tmp_path / "printer.cfg", tmp_path / "more.cfg"
    more.write_text("[fan]\nmax: 1\n")
    text = "[include more.cfg]\n"
    main.write_text(build_file("printer.cfg", text, {"fan": {"max": "2"}}))
    store, saved = ConfigReader().read(str(main)), {"fan": {"max": "3"}}
    assert find_overridden(store, saved) == {("fan", "max"): "1"}
    configincludes.clean(store, saved, NOW)
    assert more.read_text() == "[fan]\n#max: 1\n"
    assert ConfigReader().read(str(main)).get("fan", "max") == "2"
