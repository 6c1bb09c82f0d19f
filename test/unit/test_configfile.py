# SPDX-License-Identifier: GPL-3.0-or-later
"""Sections as the objects of the printer read them."""

import pytest

from klippy.configfile import PrinterConfig
from klippy.errors import ConfigError, ConfigErrors


class FakePrinter:
    """Only what the config needs of a printer."""

    def __init__(self, path):
        self.args = {"config_file": str(path)}
        self.objects = {}

    def get_start_args(self):
        return self.args

    def lookup_object(self, name, default=None):
        return self.objects.get(name, default)

    def lookup_objects(self):
        return list(self.objects.items())


@pytest.fixture
def load(tmp_path):
    """load(text) gives the section `a` of a config; its PrinterConfig is
    at .pconfig of the function."""
    def load_text(text):
        (tmp_path / "p.cfg").write_text(text)
        printer = FakePrinter(tmp_path / "p.cfg")
        load_text.pconfig = PrinterConfig(printer)
        printer.objects["configfile"] = load_text.pconfig
        return load_text.pconfig.read_main_config().getsection("a")
    return load_text


def test_values_of_all_kinds(load):
    a = load("[a]\ntext: hello\nint: 3\nfloat: -2.5e1\nyes: On\nno: 0\n"
             "list: a, b,c\nints: 1 2\nfloats: 1., 2,\n"
             "nested: 1,2\n  3,4\n")
    assert a.get("text") == "hello" and a.get("TEXT") == "hello"
    assert a.getint("int") == 3 and a.getfloat("float") == -25.
    assert a.getboolean("yes") is True and a.getboolean("no") is False
    assert a.getlist("list") == ("a", "b", "c")
    assert a.getintlist("ints", sep=" ") == (1, 2)
    assert a.getfloatlist("floats", count=2) == (1., 2.)
    assert a.getlists("nested", seps=(",", "\n"), parser=int) == ((1, 2), (3, 4))


def test_defaults_are_not_checked_and_are_noted(load):
    a = load("[a]\n")
    assert a.get("x", "d") == "d" and a.getint("n", None, minval=3) is None
    assert a.getfloat("f", 1.5) == 1.5 and a.getlist("l", ()) == ()
    assert a.access_tracking[("a", "f")] == 1.5
    assert a.getchoice("c", {"one": 1}, default="one") == 1
    assert a.getchoice("c", {"one": 1}, default=None) is None


@pytest.mark.parametrize("method, text, wanted", [
    ("getint", "1.5", "a whole number"), ("getint", "1_0", "a whole number"),
    ("getint", "", "a whole number"), ("getfloat", "nan", "a finite number"),
    ("getfloat", "inf", "a finite number"), ("getfloat", "-1e400", "a finite number"),
    ("getfloat", "1,5", "a finite number"), ("getboolean", "maybe", "True or False"),
    ("getfloatlist", "1, x", "a finite number"),
    ("getfloatlist", "1, nan", "a finite number"),
    ("getintlist", "1,,2", "a whole number")])
def test_bad_value_is_quoted_with_place_and_what_would_be_right(
        load, method, text, wanted):
    a = load("[a]\n\nvalue: %s\n" % (text,))
    with pytest.raises(ConfigError) as info:
        getattr(a, method)("value")
    message = str(info.value)
    assert "p.cfg:3: option 'value' in section [a]" in message and wanted in message


@pytest.mark.parametrize("limits, is_right", [
    ({"minval": 2.}, True), ({"maxval": 2.}, True), ({"above": 2.}, False),
    ({"below": 2.}, False), ({"minval": 2.1}, False), ({"maxval": 1.9}, False),
    ({"above": 1.9, "below": 2.1}, True)])
def test_ranges(load, limits, is_right):
    a = load("[a]\nx: 2\n")
    if is_right:
        assert a.getfloat("x", **limits) == 2.
    else:
        with pytest.raises(ConfigError, match="'2' must be"):
            a.getfloat("x", **limits)


def test_range_of_a_whole_number(load):
    a = load("[a]\nx: 2\n")
    with pytest.raises(ConfigError, match="must be at least 3 and at most 9"):
        a.getint("x", minval=3, maxval=9)


def test_missing_option_and_section(load):
    a = load("[a]\nspeeed: 1\n")
    with pytest.raises(ConfigError, match=r"p.cfg:1: option 'speed' in section \[a\]"
                       r" must be set; is 'speeed' meant"):
        a.getfloat("speed")
    with pytest.raises(ConfigError, match=r"section \[b\] is missing"):
        a.getsection("b").get("x")


def test_choices(load):
    a = load("[a]\nkind: corexi\nn: 2\nbad: 3\n")
    with pytest.raises(ConfigError, match="did you mean 'corexy'"):
        a.getchoice("kind", ["cartesian", "corexy"])
    assert a.getchoice("n", {1: "one", 2: "two"}) == "two"
    with pytest.raises(ConfigError, match="'3' is not one of '1', '2'"):
        a.getchoice("bad", {1: "one", 2: "two"})


def test_list_of_wrong_length(load):
    a = load("[a]\nx: 1, 2, 3\ny:\n")
    with pytest.raises(ConfigError, match="has 3 elements, it must have 2"):
        a.getintlist("x", count=2)
    assert a.getlist("y") == ()


def test_sections_and_prefixes(load):
    a = load("[a]\nvariable_x: 1\nvariable_y: 2\n[fan one]\n[fan two]\n[fan]\n")
    assert [s.get_name() for s in a.get_prefix_sections("fan ")] == [
        "fan one", "fan two"]
    assert a.get_prefix_options("variable_") == ["variable_x", "variable_y"]
    assert a.has_section("fan") and not a.has_section("Fan")


def check_unused(load, config, **more):
    with pytest.raises(ConfigError) as info:
        load.pconfig.check_unused_options(config, **more)
    err = info.value
    return [str(e) for e in (err.errors if isinstance(err, ConfigErrors) else [err])]


def test_unknown_options_and_sections_get_the_nearest_name(load):
    a = load("[a]\nspeed: 1\nsped: 2\n[fann]\npin: x\n")
    a.getfloat("speed")
    a.getfloat("speed_max", 0.)
    errors = check_unused(load, a, known_sections=["fan", "heater_bed"])
    assert len(errors) == 2
    assert "p.cfg:3" in errors[0] and "'sped'" in errors[0]
    assert "p.cfg:4" in errors[1] and "did you mean [fan]" in errors[1]


def test_known_section_that_nothing_uses(load):
    a = load("[stepper_b]\npin: x\n")
    (error,) = check_unused(load, a, known_sections=["stepper_b"])
    assert "[stepper_b] is used by nothing" in error and "did you mean" not in error


def test_unread_option_names_one_that_was_asked_for(load):
    a = load("[a]\nmax_sped: 2\n")
    a.getfloat("max_speed", 0.)
    (error,) = check_unused(load, a)
    assert "did you mean 'max_speed'" in error


def test_note_valid_false_does_not_count_as_read(load):
    a = load("[a]\nx: 2\n")
    assert a.get("x", note_valid=False) == "2"
    assert len(check_unused(load, a)) == 1
    a.get("x")
    load.pconfig.check_unused_options(a)


def test_skipped_sections_are_not_judged(load):
    a = load("[b]\nx: 2\n")
    load.pconfig.check_unused_options(a, skipped={"b"})


SAVED = """[a]
x: 1
#*# <---------------------- SAVE_CONFIG ---------------------->
#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.
#*#
#*# [a]
#*# old = 2
#*#
#*# [gone]
#*# old = 2
"""


def test_saved_options_may_be_unknown(load):
    a = load(SAVED)
    a.get("x")
    load.pconfig.check_unused_options(a)


def test_status_is_typed_and_lower_case(load):
    a = load("[a]\nX: 1\nlist: 1,2\n")
    a.getfloat("x")
    a.getintlist("list")
    a.getboolean("on", False)
    load.pconfig.check_unused_options(a)
    status = load.pconfig.get_status(0.)
    assert status["settings"] == {"a": {"x": 1., "list": (1, 2), "on": False}}
    assert status["config"] == {"a": {"x": "1", "list": "1,2"}}
    assert status["warnings"] == [] and status["save_config_pending"] is False


def test_pending_items_are_new_objects_on_change(load):
    load("[a]\n")
    before = load.pconfig.get_status(0.)
    load.pconfig.set("a", "Y", 3.5)
    status = load.pconfig.get_status(0.)
    assert status["save_config_pending"] is True
    assert status["save_config_pending_items"] == {"a": {"y": "3.5"}}
    assert before["save_config_pending_items"] == {}
    load.pconfig.remove_section("a")
    assert load.pconfig.get_status(0.)["save_config_pending_items"] == {"a": None}


def test_deprecation_warnings(load):
    a = load("[a]\nold: 1\nmode: Slow\n")
    a.deprecate("old")
    a.deprecate("old")
    a.deprecate("mode", "slow")
    a.deprecate("mode", "fast")
    a.deprecate("absent")
    kinds = [w["type"] for w in load.pconfig.get_status(0.)["warnings"]]
    assert kinds == ["deprecated_option", "deprecated_value"]
    assert load.pconfig.warnings[1]["value"] == "slow"


def test_implicit_sections_are_added_where_missing(tmp_path):
    (tmp_path / "p.cfg").write_text("[a]\nx: 1\n")
    printer = FakePrinter(tmp_path / "p.cfg")
    printer.args["implicit_sections"] = {"a": {"x": "9"}, "b": {"path": "/x"}}
    config = PrinterConfig(printer).read_main_config()
    assert config.getsection("a").getint("x") == 1
    assert config.getsection("b").get("path") == "/x"


