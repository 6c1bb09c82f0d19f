# SPDX-License-Identifier: GPL-3.0-or-later
"""Templates that were checked once are trusted, as long as nothing changes."""

import json
import sys

import pytest

from klippy.extras import template_check
from klippy.extras.template_check import CheckedTexts

CONFIG = "/home/pi/printer.cfg"


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.delenv("KLIPPY_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "klippy"


def remember(*texts, config=CONFIG):
    checked = CheckedTexts(config)
    for text in texts:
        checked.note(text)
    checked.save()
    return checked


def test_texts_are_known_at_the_next_start(cache):
    remember("{a}", "{b}")
    again = CheckedTexts(CONFIG)
    assert again.is_known("{a}") and again.is_known("{b}")
    assert not again.is_known("{a} ") and not again.is_known("{c}")
    path, = cache.iterdir()
    assert path.name == "macros-home%pi%printer.cfg.json"


def test_printers_have_files_of_their_own():
    remember("{a}")
    remember("{b}", config="/home/pi/other.cfg")
    assert CheckedTexts(CONFIG).is_known("{a}")
    assert not CheckedTexts(CONFIG).is_known("{b}")


def test_what_is_not_used_any_more_is_forgotten(cache):
    remember("{a}", "{b}")
    remember("{b}")
    assert not CheckedTexts(CONFIG).is_known("{a}")
    path, = cache.iterdir()
    written = path.stat().st_mtime_ns
    remember("{b}")
    assert path.stat().st_mtime_ns == written


def test_another_python_or_jinja_checks_again(monkeypatch):
    remember("{a}")
    monkeypatch.setattr(template_check.sys, "version", sys.version + "x")
    assert not CheckedTexts(CONFIG).is_known("{a}")


@pytest.mark.parametrize("damage", ["", "{", "[]", "7", '{"texts": 3}'])
def test_a_damaged_file_is_as_none(cache, damage):
    remember("{a}")
    path, = cache.iterdir()
    path.write_text(damage)
    assert not CheckedTexts(CONFIG).is_known("{a}")
    remember("{a}")
    assert json.loads(path.read_text())["texts"] == ["{a}"]


def test_a_folder_of_its_own(monkeypatch, tmp_path):
    monkeypatch.setenv("KLIPPY_CACHE", str(tmp_path / "own"))
    remember("{a}")
    assert len(list((tmp_path / "own").iterdir())) == 1


def test_a_folder_that_cannot_be_written_is_no_error(tmp_path, caplog):
    (tmp_path / "klippy").write_text("a file")
    caplog.set_level("INFO")
    remember("{a}")
    assert "checked again at the next start" in caplog.text
