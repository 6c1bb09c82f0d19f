# SPDX-License-Identifier: GPL-3.0-or-later
"""Imports go down the layers of docs/internals/seams.md only."""

import ast
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
RANKS = {"services": 1.5}


def read_table(text):
    """{module: rank} of the table of layers."""
    ranks = {}
    for line in text[text.index("| Layer |"):].splitlines()[2:]:
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) != 2:
            break
        rank = RANKS.get(cells[0])
        for name in cells[1].split():
            ranks[name] = float(cells[0]) if rank is None else rank
    return ranks


def find_python_imports(tree):
    """Names of the modules that a tree imports, with line numbers."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            if node.module == "klippy":
                yield from (("klippy." + a.name, node.lineno) for a in node.names)
            else:
                yield node.module, node.lineno


def find_cimports(text):
    """As find_python_imports(), for .pxd and .pyx."""
    for number, line in enumerate(text.splitlines(), 1):
        match = re.match(r"\s*from\s+([\w.]+)\s+c?import|\s*c?import\s+([\w.]+)", line)
        if match:
            yield match.group(1) or match.group(2), number


def list_imports(path):
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return find_python_imports(ast.parse(text))
    return find_cimports(text)


def find_violations(paths, ranks):
    """Texts for the upward imports and for modules without layer."""
    found = []
    for path in paths:
        parts = path.relative_to(ROOT / "klippy").with_suffix("").parts
        if parts[0] in ("__init__", "units"):
            continue
        rank = ranks.get(parts[0])
        if rank is None:
            found.append("%s has no layer in seams.md" % (path.name,))
            continue
        for name, line in list_imports(path):
            target = name.split(".")
            if target[0] != "klippy" or len(target) < 2:
                continue
            other = ranks.get(target[1])
            if other is not None and other > rank:
                found.append("%s:%d imports %s" % (path.relative_to(ROOT), line, name))
    return found


def list_sources(folder, *suffixes):
    return [path for path in sorted((ROOT / folder).rglob("*"))
            if path.suffix in suffixes]


def read_ranks():
    return read_table((ROOT / "docs/internals/seams.md").read_text(encoding="utf-8"))


def test_table_has_all_layers():
    ranks = read_ranks()
    assert ranks["errors"] == 0. and ranks["gcode"] == 1.5 and ranks["printer"] == 7.


def test_imports_go_down():
    assert find_violations(list_sources("klippy", ".py", ".pxd"), read_ranks()) == []


def test_klippy_ext_imports_nothing_from_klippy():
    bad = [str(path) for path in list_sources("klippy_ext", ".pyx", ".pxd", ".py")
           for name, _ in list_imports(path) if name.split(".")[0] == "klippy"]
    assert bad == []


def test_an_upward_import_is_found():
    ranks = {"errors": 0., "configfile": -1.}
    path = ROOT / "klippy" / "configfile.py"
    assert any("imports klippy.errors" in text
               for text in find_violations([path], ranks))
