# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes each run of a .test file a test: the host in batch mode, to a file."""

import os
import pathlib
import subprocess
import sys

import pytest

FOLDER = pathlib.Path(__file__).resolve().parent
ROOT = FOLDER.parents[1]
if str(FOLDER) not in sys.path:
    sys.path.insert(0, str(FOLDER))

from dictionaries import DICTIONARIES, build_dictionary  # noqa: E402

import scripts  # noqa: E402

TIMEOUT = 300

def pytest_collect_file(file_path, parent):
    if file_path.suffix == ".test":
        return ScriptFile.from_parent(parent, path=file_path)
    return None


class ScriptFile(pytest.File):
    """A .test file."""

    def collect(self):
        for case in scripts.read_cases(self.path, DICTIONARIES):
            yield CaseItem.from_parent(self, name=case.name, case=case)


class CaseItem(pytest.Item):
    """One run: a config, dictionaries and G-code."""

    def __init__(self, *, case, **kwargs):
        super().__init__(**kwargs)
        self.case = case

    def runtest(self):
        folder = self.config._tmp_path_factory.mktemp(self.case.name)
        log, status = run_case(self.case, folder)
        if bool(status) != self.case.should_fail:
            raise CaseFailure("exit status %d, though it should %s\n%s" % (
                status, "fail" if self.case.should_fail else "not", log))
        if "Traceback" in log:
            raise CaseFailure("an exception escaped:\n" + log)
        if not self.case.should_fail and not (folder / "out.serial").exists():
            raise CaseFailure("nothing was written for the mcu\n" + log)

    def repr_failure(self, excinfo):
        if isinstance(excinfo.value, (CaseFailure, scripts.ScriptError)):
            return "%s\n%s" % (self.case.script, excinfo.value)
        return super().repr_failure(excinfo)

    def reportinfo(self):
        return self.path, 0, self.case.name


class CaseFailure(Exception):
    """A run that did not end as it should."""


def run_case(case, folder):
    """Run the host on a case; returns (tail of its log, exit status)."""
    gcode = folder / "job.gcode"
    gcode.write_text(case.gcode)
    command = [sys.executable, "-m", "klippy", "run", str(case.config),
               "-i", str(gcode), "-o", str(folder / "out.serial"), "-v"]
    for name, path in case.dictionaries.items():
        build_dictionary(path)
        command += ["-d", str(path) if name == "mcu" else "%s=%s" % (name, path)]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True,
                            timeout=TIMEOUT, env=dict(os.environ, PYTHONPATH=str(ROOT)))
    return (result.stdout + result.stderr)[-6000:], result.returncode
