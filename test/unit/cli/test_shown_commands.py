# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that pages show are run as they stand there; links lead somewhere."""
import pathlib
import re

import pytest

from klippy import cli

ROOT = pathlib.Path(__file__).resolve().parents[3]
COMMAND = re.compile(r"^ {4,}(?:~/klippy-env/bin/)?klippy (.+)$", re.MULTILINE)
JOB = "G28\nG1 X20 Y20 Z1 F6000\nG1 X40 F3000\nM84\n"


def list_commands(page):
    return COMMAND.findall((ROOT / "docs" / page).read_text())


@pytest.mark.parametrize("page, command", [
    (page, command) for page in ("install.md", "moving.md")
    for command in list_commands(page)])
def test_command_works(page, command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    sample = ROOT / "config/sample-cartesian.cfg"
    (tmp_path / "printer.cfg").write_text(sample.read_text())
    (tmp_path / "job.gcode").write_text(JOB)
    assert cli.main(command.split()) == 0
    assert capsys.readouterr().out


def test_pages_show_commands():
    assert list_commands("install.md") == ["check printer.cfg"]
    assert len(list_commands("moving.md")) == 3


@pytest.mark.parametrize("path", sorted((ROOT / "docs").glob("*.md")),
                         ids=lambda path: path.name)
def test_links_lead_to_pages(path):
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", path.read_text()):
        if "://" not in target:
            assert (path.parent / target).exists(), target
