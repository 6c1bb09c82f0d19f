# SPDX-License-Identifier: GPL-3.0-or-later
"""The documentation matches the program: links, options, make targets."""

import argparse
import pathlib
import re

import pytest

from klippy import cli

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), target


@pytest.mark.parametrize("name", [name for name, _ in cli.list_commands()])
def test_every_option_is_described(name):
    text = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
    assert "## klippy " + name in text
    parser = argparse.ArgumentParser()
    cli.find_command(name).add_arguments(parser)
    for action in parser._actions:
        for option in action.option_strings:
            if option not in ("-h", "--help"):
                assert "`%s" % (option,) in text, option


def test_every_make_target_has_a_line_of_help():
    for path in (ROOT / "Makefile", ROOT / "src" / "firmware.mk"):
        text = path.read_text(encoding="utf-8")
        targets = set(re.findall(r"^([a-z]+):", text, re.MULTILINE))
        helped = set(re.findall(r"^([a-z]+):.*## ", text, re.MULTILINE))
        assert targets and targets == helped
