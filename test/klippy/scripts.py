# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of .test files: end-to-end scripts of configs and G-code.

Lines: `CONFIG path`, `DICTIONARY main.dict [mcu=other.dict ...]`, `GCODE path`,
`SHOULD_FAIL`, anything else is inline G-code; `#` starts a comment.  Paths are
relative to the file, dictionaries to the dictionary folder.  A dictionary is for
the CONFIG lines after it.  Configs that follow each other run the same G-code; a
CONFIG after G-code begins anew.
"""

import dataclasses
import pathlib


class ScriptError(Exception):
    """A .test file that cannot be understood."""


@dataclasses.dataclass
class Case:
    """One run: a config, its dictionaries and what to print."""
    script: pathlib.Path
    number: int
    config: pathlib.Path
    dictionaries: dict          # mcu name -> path ("mcu" is the main one)
    gcode: str
    should_fail: bool

    @property
    def name(self):
        return "%s-%d" % (self.script.stem, self.number)


def read_cases(script, dict_folder):
    """All cases of one .test file."""
    cases, state = [], _State(script, dict_folder)
    for number, line in enumerate(script.read_text().splitlines(), 1):
        line = line.split("#", 1)[0].strip()
        if line:
            state.feed(number, line, cases)
    state.finish(cases)
    if not cases:
        raise ScriptError("%s: no CONFIG line" % script)
    return cases


class _State:
    def __init__(self, script, dict_folder):
        self.script, self.dict_folder = script, dict_folder
        self.dictionaries = {}
        self._clear()

    def _clear(self):
        self.configs, self.gcode, self.should_fail = [], [], False

    def feed(self, number, line, cases):
        word, _, rest = line.partition(" ")
        if word == "CONFIG":
            if self.configs and self.gcode:
                self.finish(cases)
            self.configs.append((self._path(number, self.script.parent, rest),
                                 dict(self.dictionaries)))
        elif word == "DICTIONARY":
            self._read_dictionaries(number, rest)
        elif word == "GCODE":
            path = self._path(number, self.script.parent, rest)
            self.gcode.append(path.read_text())
        elif word == "SHOULD_FAIL":
            self.should_fail = True
        else:
            self.gcode.append(line)

    def _path(self, number, folder, name):
        path = (folder / name.strip()).resolve()
        if not path.exists():
            raise ScriptError("%s:%d: there is no %s" % (self.script, number, path))
        return path

    def _read_dictionaries(self, number, rest):
        self.dictionaries = {}
        for word in rest.split():
            mcu, _, name = word.rpartition("=")
            self.dictionaries[mcu or "mcu"] = self.dict_folder / name

    def finish(self, cases):
        for config, dictionaries in self.configs:
            cases.append(Case(self.script, len(cases) + 1, config, dictionaries,
                              "\n".join(self.gcode) + "\n", self.should_fail))
        self._clear()
