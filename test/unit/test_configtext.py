# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading config files: the text format, includes, and everything malformed."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from klippy.configtext import ConfigReader, strip_comment
from klippy.errors import ConfigError, ConfigErrors


@pytest.fixture
def read(tmp_path):
    """read(text, other.cfg=text...) reads text as main file."""
    def read_text(main, **others):
        for name, content in {"main": main, **others}.items():
            data = content if isinstance(content, bytes) else content.encode()
            (tmp_path / (name + ".cfg")).write_bytes(data)
        return ConfigReader().read(str(tmp_path / "main.cfg"))
    return read_text


def read_errors(read, *args, **others):
    with pytest.raises(ConfigError) as info:
        read(*args, **others)
    err = info.value
    return err.errors if isinstance(err, ConfigErrors) else [err]


def test_options_of_both_forms(read):
    store = read("[Fan Part]\nPIN: a:b=c\nspeed = 5\nempty:\n")
    assert store.sections() == ["Fan Part"]
    assert store.items("Fan Part") == [("pin", "a:b=c"), ("speed", "5"),
                                       ("empty", "")]
    assert store.get_place("Fan Part", "speed").line == 3
    assert store.get_place("Fan Part").line == 1


@pytest.mark.parametrize("line, left", [
    ("pin: PA1#x", "pin: PA1"), ("pin: PA1 # x", "pin: PA1"), ("# all", ""),
    ("; all", ""), ("pin: a;b", "pin: a;b"), ("pin: a ;b", "pin: a"),
    ("  ; x", ""), ("plain", "plain"), ("", "")])
def test_comments(line, left):
    assert strip_comment(line) == left


def test_multi_line_value_keeps_inner_empty_lines(read):
    store = read("[m]\ngcode:\n  G28\n\n  # a comment\n    G1 X1\n\nnext: 1\n")
    assert store.get("m", "gcode") == "\nG28\n\n\nG1 X1"
    assert store.get("m", "next") == "1"


def test_crlf_bom_and_no_final_newline(read):
    store = read(b"\xef\xbb\xbf[a]\r\nx: 1\r\ny:\r\n  2\r\n  3")
    assert store.get("a", "x") == "1" and store.get("a", "y") == "\n2\n3"


def test_empty_file(read):
    assert read("").sections() == []


def test_duplicate_sections_merge_with_a_warning(read):
    store = read("[a]\nx: 1\ny: 1\n[b]\n[a]\nx: 2\n")
    assert dict(store.items("a")) == {"x": "2", "y": "1"}
    texts = [text for text, _, _ in store.warnings]
    assert any("section [a]" in text for text in texts)
    assert any("'x'" in text and "line 2" in text for text in texts)


def test_an_including_file_overrides_without_warning(read):
    store = read("[include other.cfg]\n[a]\nx: 2\n", other="[a]\nx: 1\ny: 3\n")
    assert dict(store.items("a")) == {"x": "2", "y": "3"}
    assert store.warnings == []


def test_glob_include_in_order_of_name(read):
    store = read("[include part*.cfg]\n[include none*.cfg]\n",
                 part2="[a]\nx: 2", part1="[a]\nx: 1\n")
    assert store.get("a", "x") == "2"
    assert str(store.get_place("a", "x")).endswith("part2.cfg:2")


def test_missing_include_names_file_and_line(read):
    (err,) = read_errors(read, "[a]\n[include gone.cfg]\n")
    assert "main.cfg:2" in str(err) and "gone.cfg" in str(err)


def test_include_cycle_is_told_with_its_files(read):
    (err,) = read_errors(read, "[include b.cfg]\n", b="[include c.cfg]\n",
                         c="[include main.cfg]\n")
    text = str(err)
    assert "circle" in text and "c.cfg:1" in text
    assert text.count("main.cfg") == 2


def test_same_file_included_twice_is_no_cycle(read):
    store = read("[include b.cfg]\n[include c.cfg]\n", b="[include d.cfg]\n",
                 c="[include d.cfg]\n", d="[x]\n")
    assert store.sections() == ["x"]


def test_option_after_include_needs_a_section(read):
    (err,) = read_errors(read, "[a]\n[include b.cfg]\nx: 1\n", b="[c]\n")
    assert "main.cfg:3" in str(err) and "'x'" in str(err)


def test_all_errors_of_all_files_are_told(read):
    errors = read_errors(read, "x: 1\n[a\ny: 1\n[]\n[b]\nnonsense\n: 4\n"
                         "[include b.cfg]\n", b="[c]\nmore nonsense\n")
    places = [(err.place.path.rpartition("/")[2], err.place.line) for err in errors]
    assert places == [("main.cfg", 1), ("main.cfg", 2), ("main.cfg", 4),
                      ("main.cfg", 6), ("main.cfg", 7), ("b.cfg", 2)]


def test_nul_byte_and_bad_utf8_name_the_line(read):
    errors = read_errors(read, b"[a]\nx: \0\ny: \xff\xfe\nz: 1 # \xff in a comment\n")
    assert [err.place.line for err in errors] == [2, 3]
    assert "NUL" in str(errors[0]) and "UTF-8" in str(errors[1])


def test_unreadable_file(tmp_path):
    with pytest.raises(ConfigError, match="No such file"):
        ConfigReader().read(str(tmp_path / "none.cfg"))
    with pytest.raises(ConfigError, match="unable to read"):
        ConfigReader().read(str(tmp_path))


def test_line_of_a_megabyte(read):
    store = read("[a]\nx: " + "y" * 1000000 + "\n")
    assert len(store.get("a", "x")) == 1000000
    (err,) = read_errors(read, "[a]\n" + "y" * 1000000)
    assert len(str(err)) < 400


def test_saved_block_overrides(read):
    store = read("[a]\nx: 1\n\n#*# <---------------------- SAVE_CONFIG "
                 "---------------------->\n#*# DO NOT EDIT THIS BLOCK OR BELOW. The"
                 " contents are auto-generated.\n#*#\n#*# [a]\n#*# x = 2\n"
                 "#*# points =\n#*# \t  0.1, 0.2\n#*# \t  0.3\n")
    assert store.get("a", "x") == "2" and store.is_saved("a", "x")
    assert store.get("a", "points") == "\n0.1, 0.2\n0.3"
    assert store.get_place("a", "x").line == 8
    assert len(store.warnings) == 1 and "overridden" in store.warnings[0][0]


def test_text_below_the_saved_block_is_an_error(read):
    (err,) = read_errors(read, "[a]\n#*# <---------------------- SAVE_CONFIG "
                         "---------------------->\n[b]\nx: 1\n"[:-5])
    assert err.place.line == 3 and "move it above" in str(err)


@given(st.binary(max_size=300))
@settings(max_examples=300)
def test_any_bytes_give_a_config_or_an_error(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "fuzz.cfg"
    path.write_bytes(data.replace(b"include", b"exclude"))
    try:
        store = ConfigReader().read(str(path))
    except ConfigError as err:
        assert "fuzz.cfg" in str(err)
    else:
        assert all(isinstance(name, str) for name in store.sections())


def test_utf_16_is_one_error(tmp_path):
    (tmp_path / "p.cfg").write_bytes("[a]\nx: 1\n".encode("utf-16"))
    with pytest.raises(ConfigError) as info:
        ConfigReader().read(str(tmp_path / "p.cfg"))
    assert str(info.value).endswith("p.cfg:1: the file is in UTF-16: save it as UTF-8")


def test_file_of_another_kind_is_not_told_line_by_line(tmp_path):
    """The other files of the config are still looked at."""
    (tmp_path / "photo.cfg").write_bytes(b"\0\xff\n" * 100000)
    (tmp_path / "p.cfg").write_text("[include photo.cfg]\n[a]\nx\n")
    with pytest.raises(ConfigErrors) as info:
        ConfigReader().read(str(tmp_path / "p.cfg"))
    texts = str(info.value).split("\n")
    assert len(texts) == 22
    assert "photo.cfg:21: 20 lines of this file are wrong" in texts[-2]
    assert "p.cfg:3: 'x' is not an option" in texts[-1]
