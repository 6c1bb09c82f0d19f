# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of .test files: end-to-end scripts of configs and G-code.

Lines: `CONFIG path`, `DICTIONARY main.dict [mcu=other.dict ...]`, `GCODE path`,
`SHOULD_FAIL`, anything else is inline G-code; `#` starts a comment.  Paths are
relative to the file, dictionaries to the dictionary folder.  With several
CONFIG lines each runs with what precedes it since the last run.
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
    if state.config is not None:
        cases.append(state.finish(len(cases) + 1))
    if not cases:
        raise ScriptError("%s: no CONFIG line" % script)
    return cases


class _State:
    def __init__(self, script, dict_folder):
        self.script, self.dict_folder = script, dict_folder
        self.config = None
        self.dictionaries, self.gcode, self.should_fail = {}, [], False

    def feed(self, number, line, cases):
        word, _, rest = line.partition(" ")
        if word == "CONFIG":
            if self.config is not None:
                cases.append(self.finish(len(cases) + 1))
            self.config = self._path(number, self.script.parent, rest)
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

    def finish(self, number):
        return Case(self.script, number, self.config, dict(self.dictionaries),
                    "\n".join(self.gcode) + "\n", self.should_fail)
