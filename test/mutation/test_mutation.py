# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool that makes faults: which it finds, and whether it tells them apart."""

import pathlib
import re
import subprocess
import sys

import pytest

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))
import checks  # noqa: E402
from campaign import Campaign, read_equivalent, report  # noqa: E402
from mutants import Mutant, list_mutants  # noqa: E402

SOURCE = '''\
/* a < b; */
static int limit = 5;

int clip(int a, int b)
{
    int sum = a + b; /* not a - b */

    if (sum >= 5 && a != 0)
        shutdown("a < b");
    irq_disable();
    limit = sum;
    call(sum,
         0x10);
    irq_enable();
    return sum;
}
'''


def list_after(operator):
    return [m.after for m in list_mutants("a.c", SOURCE) if m.operator == operator]


def test_faults_of_each_kind():
    assert list_after("relational") == [
        "if (sum < 5 && a != 0)", "if (sum > 5 && a != 0)", "if (sum >= 5 && a == 0)"]
    assert list_after("arithmetic") == ["int sum = a - b; /* not a - b */"]
    assert list_after("logical") == ["if (sum >= 5 || a != 0)"]
    assert list_after("constant") == [
        "if (sum >= 4 && a != 0)", "if (sum >= 6 && a != 0)",
        "if (sum >= 5 && a != 1)", "15);", "17);"]
    assert list_after("inverted") == ["if (!(sum >= 5 && a != 0))"]
    assert list_after("removed") == [
        '{ if (0) shutdown("a < b"); }', "{ if (0) limit = sum; }",
        "{ if (0) call(sum, 0x10); }"]
    assert list_after("irq") == ["{ if (0) irq_disable(); }",
                                 "{ if (0) irq_enable(); }"]


def test_a_fault_changes_one_place():
    for mutant in list_mutants("a.c", SOURCE):
        text = mutant.apply(SOURCE)
        assert text != SOURCE
        assert text.startswith(SOURCE[:mutant.start])
        assert text.endswith(SOURCE[mutant.end:])
        assert SOURCE.split("\n")[mutant.line - 1].strip().startswith(
            mutant.before.split("(")[0].split()[0])


def test_faults_know_their_function():
    assert {m.function for m in list_mutants("a.c", SOURCE)} == {"clip"}
    names = {m.function for path in checks.CHECKS
             for m in list_mutants(path, (ROOT / path).read_text())}
    assert {"next_run", "sched_run_timer", "advance", "settle", "fire"} < names


def test_only_lines_that_are_compiled():
    lines = {m.line for m in list_mutants("a.c", SOURCE, lambda line: line == 10)}
    assert lines == {10}


def test_all_checked_sources_have_faults():
    for path in checks.CHECKS:
        assert len(list_mutants(path, (ROOT / path).read_text())) > 10, path
    names = {name for check in sum(checks.CHECKS.values(), [])
             for name in check[1:] if name.endswith(".py")}
    assert [n for n in names if not (ROOT / "test/firmware" / n).exists()] == []


def test_what_is_argued_to_change_nothing_is_still_there():
    entries = read_equivalent()
    found = {m.key() for path in checks.CHECKS
             for m in list_mutants(path, (ROOT / path).read_text())}
    assert sorted(set(entries) - found) == []
    assert all(len(reason) > 30 for reason in entries.values())


def test_an_entry_needs_a_reason(tmp_path):
    (tmp_path / "list").write_text("# why\n\nsrc/a.c f\n- a < b\n+ a > b\n")
    with pytest.raises(ValueError, match="no reason given for 'a > b'"):
        read_equivalent(tmp_path / "list")


def test_the_report_counts(capsys):
    mutant = Mutant("src/a.c", "f", "irq", 3, 0, 1, "", "x", "y")
    campaign = Campaign({}, [], 3, {})
    for result, why in (("caught", "test"), ("missed", None), ("skip", "no"),
                        ("caught", "test"), ("caught", "one too many")):
        campaign.note(mutant, 0., result, why)
    assert report(campaign) == 2
    text = capsys.readouterr().out
    assert re.search(r"src/a.c +2 +3\n", text) and "irq " in text
    assert "src/a.c f\n- x\n+ y" in text and "passed over: 1, no" in text


def run_tool(*args):
    return subprocess.run([sys.executable, "test/mutation", *args], cwd=ROOT,
                          capture_output=True, text=True)


def test_two_faults_are_caught():
    result = run_tool("--count", "2", "--seed", "3", "--file", "src/core/oid.c",
                      "--operator", "inverted", "--jobs", "1")
    assert result.returncode == 0, result.stdout + result.stderr
    assert "caught 2 of 2 (seed 3)" in result.stdout
    assert "test_fw_command.py" in result.stdout


def test_sources_without_checks_are_refused():
    result = run_tool("--count", "1", "--file", "src/core/debugcmds.c")
    assert result.returncode == 2 and "invalid choice" in result.stderr
