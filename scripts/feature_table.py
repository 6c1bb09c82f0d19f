# SPDX-License-Identifier: GPL-3.0-or-later
"""Write klippy/mcu/features.toml: which option of menuconfig a command needs.

Found in Kconfig, in the conditions of src/Makefile and of the ports, and in the
declarations of the sources.  `--check` only tells whether the file is up to date.
"""

import pathlib
import re
import sys

import kconfig
import kconfiglib

ROOT = pathlib.Path(__file__).resolve().parent.parent
TARGET = ROOT / "klippy" / "mcu" / "features.toml"
# src-$(CONFIG_X) += files, or $(if $(CONFIG_X),file)
RULE = re.compile(r"^[\w-]+-\$\(CONFIG_(\w+)\)\s*\+=\s*(.*)$", re.M)
IF_RULE = re.compile(r"\$\(if \$\(CONFIG_(\w+)\),([^)]*\)?[^)]*)\)")
DECLARATION = re.compile(
    r'(?:DECL_(COMMAND|COMMAND_FLAGS|CONSTANT|CONSTANT_STR)|\b(sendf))'
    r'\(((?:[^"();]|"[^"]*")*)')
TITLES = ("commands", "responses", "constants", "enumerations")
CONDITION = re.compile(r"^\s*#\s*if\s+((?:CONFIG_\w+|\|\||\s)+)$")


class Options:
    """The symbols of Kconfig that a user can choose, and what stands for them."""

    def __init__(self):
        self.syms = kconfig.load_tree().syms

    def find_prompt(self, name):
        """Text of an option in the menu; None if it is in no menu."""
        sym = self.syms.get(name)
        prompts = [node.prompt[0] for node in sym.nodes if node.prompt] if sym else []
        return prompts[0] if prompts else None

    def expand(self, name):
        """The options any of which sets a symbol; None if no option does."""
        if name.startswith("WANT_") and self.find_prompt(name):
            return frozenset([name])
        sym = self.syms.get(name)
        if sym is None or len(sym.defaults) != 1:
            return None
        return self._expand_expression(sym.defaults[0][0])

    def _expand_expression(self, expr):
        if not isinstance(expr, tuple):
            return self.expand(expr.name)
        if expr[0] != kconfiglib.OR:
            return None
        left, right = (self._expand_expression(part) for part in expr[1:])
        return None if left is None or right is None else left | right


def list_conditions():
    """{source below src/: names of the symbols it is built for}."""
    found = {}
    for path in (ROOT / "src" / "Makefile", *sorted(ROOT.glob("src/*/port.mk"))):
        text = re.sub(r"\\\n", " ", path.read_text())
        for name, files in RULE.findall(text) + IF_RULE.findall(text):
            for file in re.findall(r"([\w/-]+\.c)\b", files):
                source = (file[len("src/"):] if file.startswith("src/") else
                          "%s/%s" % (path.parent.name, file.lstrip("/")))
                found.setdefault(source, set()).add(name)
    return found


def list_declarations(text):
    """(kind, format or name, [symbols of each #if around it]) of a source."""
    around, start, found = [], 0, []
    for line in text.splitlines(keepends=True):
        match = CONDITION.match(line)
        if re.match(r"\s*#\s*if", line):
            around.append(re.findall(r"CONFIG_(\w+)", match[1]) if match else [])
        elif re.match(r"\s*#\s*(else|elif)", line):
            around[-1] = []
        elif re.match(r"\s*#\s*endif", line):
            around.pop()
        for declared in DECLARATION.finditer(text, start):
            if declared.start() >= start + len(line):
                break
            if declared.start() >= start:
                words = "".join(re.findall(r'"([^"]*)"', declared[3]))
                found.append((declared[1] or declared[2], words,
                              [names for names in around if names]))
        start += len(line)
    return found


def find_clauses(options, names):
    """Sets of options of each of which one must be chosen."""
    clauses = set()
    for alternatives in names:
        expanded = [options.expand(name) for name in alternatives]
        if None not in expanded:
            clauses.add(frozenset().union(*expanded))
    return {clause for clause in clauses if not any(c < clause for c in clauses)}


def collect():
    """(Options, then clauses by command, by response, by constant, by enumeration)"""
    options, conditions = Options(), list_conditions()
    commands, responses, constants, fields = {}, {}, {}, {}
    for path in sorted(ROOT.glob("src/**/*.c")):
        name = path.relative_to(ROOT / "src").as_posix()
        built_for = [[symbol] for symbol in sorted(conditions.get(name, ()))]
        for kind, text, around in list_declarations(path.read_text()):
            clauses = find_clauses(options, built_for + around)
            word = re.split("[ ,]", text)[0]
            if kind == "sendf":
                responses.setdefault(word, []).append(clauses)
            elif not clauses:
                continue
            elif "COMMAND" in kind:
                commands[word] = clauses
                for field in re.findall(r"(\w+)=%", text):
                    fields.setdefault(field, []).append(clauses)
            elif not word.startswith(("BUS_PINS", "RESERVE_PINS")):
                constants.setdefault(word, []).append(clauses)
    return (options, commands, merge(responses), merge(constants), merge(
        {field: found for field, found in fields.items()
         if re.search(r"(_bus|_type)$", field)}))


def merge(found):
    """What all that declare a name agree on."""
    return {name: clauses[0] for name, clauses in found.items()
            if clauses[0] and all(other == clauses[0] for other in clauses)}


def write_clauses(clauses):
    return "[%s]" % ", ".join(
        "[%s]" % ", ".join('"%s"' % name for name in sorted(clause))
        for clause in sorted(clauses, key=sorted))


def write_table():
    """Text of the table."""
    options, *tables = collect()
    used = {name for table in tables for clauses in table.values()
            for clause in clauses for name in clause}
    lines = ["# SPDX-License-Identifier: GPL-3.0-or-later",
             "# Written by scripts/feature_table.py (make docs) from the firmware's"
             " sources.",
             "# Of each list in a row one option is needed.", "", "[options]"]
    lines += ['%s = "%s"' % (name, options.find_prompt(name)) for name in sorted(used)]
    for title, table in zip(TITLES, tables, strict=True):
        lines += ["", "[%s]" % (title,)]
        lines += ["%s = %s" % (name, write_clauses(table[name]))
                  for name in sorted(table)]
    return "\n".join(lines) + "\n"


def main(argv):
    text = write_table()
    if argv == ["--check"]:
        return int(not TARGET.exists() or TARGET.read_text() != text)
    kconfig.write_if_changed(TARGET, text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
