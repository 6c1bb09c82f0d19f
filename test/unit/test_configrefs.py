# SPDX-License-Identifier: GPL-3.0-or-later
"""References in values: what they take over, what stays, and what is an error."""

import sys

import pytest

from klippy.configsave import build_file, find_overridden
from klippy.configtext import ConfigReader
from klippy.errors import ConfigError, ConfigErrors


@pytest.fixture
def read(tmp_path):
    """read(text) reads text as main file."""
    def read_text(text):
        (tmp_path / "main.cfg").write_text(text)
        return ConfigReader().read(str(tmp_path / "main.cfg"))
    return read_text


def read_errors(read, text):
    with pytest.raises(ConfigError) as info:
        read(text)
    err = info.value
    return err.errors if isinstance(err, ConfigErrors) else [err]


def test_options_here_and_elsewhere(read):
    store = read("[constants]\ncurrent: 0.8\n[tmc a b]\nrun: ${constants.current}\n"
                 "hold: ${ Run }\n[m]\nx: ${tmc a b.hold}/2 ${constants.CURRENT}\n")
    assert store.items("tmc a b") == [("run", "0.8"), ("hold", "0.8")]
    assert store.get("m", "x") == "0.8/2 0.8"
    assert store.referenced == {("constants", "current"), ("tmc a b", "run"),
                                ("tmc a b", "hold")}


def test_a_reference_ahead_of_its_value_and_over_several_lines(read):
    store = read("[a]\npoints: ${constants.points}\n"
                 "[constants]\npoints:\n  1, 2\n  3, 4\n")
    assert store.get("a", "points") == "\n1, 2\n3, 4"


@pytest.mark.parametrize("text", [
    "M118 ${params.PRICE}", "M118 ${price} $$", "${", "$ {a}", "${printer.x}",
    "{% set a = '${' %}", "${}", "${a{b}}"])
def test_templates_of_configs_without_references_stay(read, text):
    content = ("[printer]\ny: 1\n[gcode_macro m]\ngcode:\n  %s\nvariable_a: 1\n"
               % (text,))
    store = read(content)
    assert store.get("gcode_macro m", "gcode") == "\n" + text
    assert store.referenced == set()


def test_templates_take_over_constants_beside_other_braces(read):
    store = read("[constants]\nx: 5\n[gcode_macro m]\n"
                 "gcode:\n  G1 X${constants.x} Y{y} ${y}\n")
    assert store.get("gcode_macro m", "gcode") == "\nG1 X5 Y{y} ${y}"


def test_unknown_references_are_told_with_their_places(read):
    errors = read_errors(
        read, "[constants]\ncurrent: 1\n[a]\nx: ${constants.curent}\n"
        "y: ${b.z}\nz: ${q}\ngcode: ${constants.n}\n")
    assert [err.place.line for err in errors] == [4, 5, 6, 7]
    assert errors[0].place.column == 4 and errors[0].nearest == "current"
    assert str(errors[0]).endswith(
        "option 'x' in section [a]: '${constants.curent}' refers to nothing: section"
        " [constants] has no option 'curent'; did you mean 'current'?")
    assert "there is no section [b]" in str(errors[1])
    assert errors[2].section == "a" and errors[2].option == "z"


def test_constants_without_their_section(read):
    err, = read_errors(read, "[a]\nx: ${constants.n}\ny: ${other}\n")
    assert "there is no section [constants]" in str(err)


def test_circles(read):
    errors = read_errors(read, "[a]\nx: ${b.y}\n[b]\ny: ${a.x}\nz: ${z}\n")
    assert any("circle: [a] x -> [b] y -> [a] x" in str(err) for err in errors)
    assert any("[b] z -> [b] z" in str(err) for err in errors)


def test_saving_keeps_the_references(read, tmp_path):
    (tmp_path / "more.cfg").write_text("[fan]\nmax: ${constants.n}\n")
    text = "[include more.cfg]\n[constants]\nn: 3\n[a]\nx: ${constants.n}\n"
    store = read(text)
    saved = {"fan": {"max": "4"}}
    new = build_file("p.cfg", text, saved, find_overridden(store, saved))
    assert new.startswith(text)
    assert 'max overrides "${constants.n}"' in new
    again = read(new)
    assert again.get("fan", "max") == "4" and again.get("a", "x") == "3"
    assert again.warnings == []


def test_classic_files_load_nothing_of_it(read, monkeypatch):
    monkeypatch.delitem(sys.modules, "klippy.configrefs", raising=False)
    read("[gcode_macro m]\ngcode: M118 {params.X} $5\n")
    assert "klippy.configrefs" not in sys.modules
