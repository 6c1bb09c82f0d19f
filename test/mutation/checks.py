# SPDX-License-Identifier: GPL-3.0-or-later
"""Which tests are run against a fault in which source, quickest first."""

import os
import signal
import subprocess
import sys

from builds import ROOT

TIMEOUT = 60  # s of the wall; the tests themselves take 4

# Build, then the program's arguments or the test files.
SCHED = ("fakeboard", "sched", "3")
INJECTION = ("fakeboard", "injection", "1")
INTERLEAVE = ("interleave", "injection", "1", "9")
RACES = ("interleave", "races")
FUZZ = ("fakeboard", "fuzz", "2")
COMMAND = ("simulator", "test_fw_command.py", "test_fw_parser.py",
           "test_fw_shutdowns.py")
MOTION = ("simulator", "test_fw_motion.py", "test_fw_trsync.py")
PINS = ("simulator", "test_fw_io.py", "test_fw_timed_output.py")
ANALOG = (*PINS, "test_fw_trigger_analog.py")
CORE = ("simulator", "test_fw_command.py", "test_fw_parser.py",
        "test_fw_shutdowns.py", "test_fw_io.py", "test_fw_motion.py")

CHECKS = {
    "src/sched.c": [SCHED, CORE, INJECTION, RACES, INTERLEAVE, FUZZ],
    "src/command.c": [COMMAND, FUZZ, INJECTION, MOTION],
    "src/stepper.c": [MOTION, INJECTION, RACES, INTERLEAVE, FUZZ],
    "src/core/oid.c": [COMMAND, MOTION, FUZZ],
    "src/core/arena.c": [COMMAND, MOTION, INTERLEAVE, FUZZ],
    "src/core/basecmd.c": [COMMAND, FUZZ],
    "src/core/load.c": [COMMAND],
    "src/motion/trsync.c": [MOTION, INJECTION, RACES, INTERLEAVE, FUZZ],
    "src/motion/endstop.c": [MOTION, INJECTION, RACES, INTERLEAVE, FUZZ],
    "src/io/timed_output.c": [PINS, INJECTION, RACES,
                        INTERLEAVE, FUZZ],
    "src/io/digital_out.c": [PINS, INJECTION, RACES,
                        INTERLEAVE, FUZZ],
    "src/io/pwm_out.c": [PINS, FUZZ],
    "src/io/analog_in.c": [ANALOG, INJECTION, INTERLEAVE, FUZZ],
}


def make_command(check, program):
    """The arguments and environment of one check of this program."""
    variant, *args = check
    if not args[0].endswith(".py"):
        return [str(program), *args], dict(os.environ)
    paths = [ROOT / "test" / "firmware" / name for name in args]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "--no-header",
               "-p", "no:cacheprovider", "-p", "no:xdist",
               *[str(path) for path in paths if path.exists()]]
    return command, dict(os.environ, SIMULATOR_SO=str(program),
                         PYTHONDONTWRITEBYTECODE="1")


def find_failure(output):
    """What to tell of a failed check: the first failed test, or the end."""
    lines = [line.strip() for line in output.splitlines()
             if line.strip() and "makecontext/swapcontext" not in line]
    failed = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    return (failed or lines[-1:] or [""])[0][:100]


def run_check(check, program):
    """None if the check passes, else why not."""
    command, env = make_command(check, program)
    # timeout(1) ends it even if this process is killed
    command = ["timeout", "-sKILL", str(TIMEOUT + 5), *command]
    process = subprocess.Popen(command, cwd=ROOT, env=env, text=True,
                               errors="replace", stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, start_new_session=True)
    try:
        output, _ = process.communicate(timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return "hangs in %s" % (check[1],)
    if process.returncode == 0:
        return None
    return find_failure(output) or "exit status %d" % (process.returncode,)
