# SPDX-License-Identifier: GPL-3.0-or-later
"""Every row of docs/internals/fault_matrix.md names tests that are there."""
import ast
import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "internals" / "fault_matrix.md"
NAME = re.compile(r"`(test/[\w/]+\.py)::(\w+)`")


def read_rows(text):
    """[(fault, what must hold, tests)] of the table."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")]
            for line in text.splitlines() if line.startswith("|")]
    return [row for row in rows[2:] if row]


ROWS = read_rows(PAGE.read_text())


def list_tests(path):
    """Names of the test functions of a file."""
    tree = ast.parse(path.read_text())
    return {node.name for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")}


def test_there_is_a_table():
    assert len(ROWS) > 25 and all(len(row) == 3 for row in ROWS)


@pytest.mark.parametrize("row", ROWS, ids=[row[0] for row in ROWS])
def test_row_names_tests_that_exist(row):
    found = NAME.findall(row[2])
    assert found or row[2].startswith("["), "a row without a test says why in brackets"
    for name, test in found:
        assert test in list_tests(ROOT / name), "%s has no %s" % (name, test)


def test_no_fault_test_is_forgotten():
    """Files of test/faults about links, clients, disks and power are in the table."""
    named = {name for row in ROWS for name, _ in NAME.findall(row[2])}
    for name in ("link_faults", "connection_faults", "hostile_clients", "disk_full",
                 "print_recovery", "late_host", "gcode_faults"):
        assert "test/faults/test_%s.py" % name in named
