# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat imports give the same modules; user files shadow built-in ones."""

import importlib
import logging
import sys
import types

import pytest

import klippy
from klippy import plugins, pureimport


@pytest.fixture
def alias_finder(monkeypatch):
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    before = set(sys.modules)
    plugins.install()
    plugins.install()
    yield
    for name in set(sys.modules) - before:
        if name.partition(".")[0] in plugins.FLAT_NAMES:
            del sys.modules[name]


def test_flat_names_are_the_same_objects(alias_finder):
    for name in ("reactor", "configfile", "gcode", "mathutil", "extras",
                 "extras.output_pin"):
        flat = importlib.import_module(name)
        packaged = importlib.import_module("klippy." + name)
        assert flat is packaged
        assert packaged.__spec__.name == "klippy." + name


def test_installed_once(alias_finder):
    finders = [f for f in sys.meta_path if isinstance(f, plugins.AliasFinder)]
    assert len(finders) == 1


def test_unknown_flat_names_are_not_found(alias_finder):
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("extras.no_such_extra")
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("no_such_module_at_all")


def test_printer_class_of_the_package():
    from klippy.printer import Printer
    assert klippy.Printer is Printer
    with pytest.raises(AttributeError):
        _ = klippy.Printre


def test_user_file_is_found_first_and_told(tmp_path, caplog):
    (tmp_path / "built").mkdir()
    (tmp_path / "mine").mkdir()
    for folder in ("built", "mine"):
        (tmp_path / folder / "thing_x.py").write_text("where = '%s'" % (folder,))
    package = types.ModuleType("shadow_test")
    package.__path__ = [str(tmp_path / "built")]
    sys.modules["shadow_test"] = package
    plugins.add_folder(package, tmp_path / "mine")
    plugins.add_folder(package, tmp_path / "mine")
    module = importlib.import_module("shadow_test.thing_x")
    assert module.where == "mine" and len(package.__path__) == 2
    with caplog.at_level(logging.WARNING):
        plugins.log_shadowing(module, [str(tmp_path / "built")])
        plugins.log_shadowing(module, [str(tmp_path / "mine")])
    assert len(caplog.records) == 1
    with pytest.raises(FileNotFoundError, match="does not exist"):
        plugins.add_folder(package, tmp_path / "none")
    del sys.modules["shadow_test"], sys.modules["shadow_test.thing_x"]


def test_sources_win_with_the_pure_finder():
    finder = pureimport.PureFinder("klippy")
    spec = finder.find_spec("klippy.reactor", klippy.__path__)
    assert spec.origin.endswith("reactor.py")
    assert finder.find_spec("os.path", klippy.__path__) is None
    assert finder.find_spec("klippy.no_such", klippy.__path__) is None
