# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds of the firmware in which one source can be replaced quickly."""

import hashlib
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import threading

ROOT = pathlib.Path(__file__).resolve().parents[2]
QUICK = ["-O1", "-fno-lto", "-g0", "-w"]


class CompileError(Exception):
    """The changed text is no C program."""


def run_quiet(args, **options):
    """Run in the tree's root; CompileError with its output if it fails."""
    result = subprocess.run(args, cwd=ROOT, text=True, capture_output=True,
                            **options)
    if result.returncode:
        raise CompileError(result.stdout + result.stderr)
    return result.stdout


class Variant:
    """One way to build the firmware: made when needed, then source by source.

    output: the file that the link makes.  make_args: variables of make.
    """

    def __init__(self, name, config, output, make_args=()):
        self.name, self.output = name, output
        self.out = "out/mutation/%s/" % (name,)
        self.env = dict(os.environ, KCONFIG_CONFIG=config)
        self.make = ["make", "-s", "-f", "src/build.mk", "OUT=" + self.out,
                     "PYTHON=" + sys.executable,
                     "EXTRA_CFLAGS=" + " ".join(QUICK), *make_args]
        self.compile_commands, self.link_command = {}, []
        self.pristine = {}
        self.lock = threading.Lock()

    def prepare(self):
        """Build the right program, and learn how it is built."""
        with self.lock:
            if not self.link_command:
                self._prepare()

    def _prepare(self):
        (ROOT / self.out).mkdir(parents=True, exist_ok=True)
        run_quiet([sys.executable, "scripts/kconfig.py", "header", self.out],
                  env=self.env)
        run_quiet([*self.make, self.out + self.output], env=self.env)
        text = run_quiet([*self.make, "-n", "-B", self.out + self.output],
                         env=self.env).replace("\\\n", " ")
        link = " -o %s" % (self.out + self.output,)
        for line in text.splitlines():
            match = re.search(r" -c (\S+\.c) -o (\S+)", line)
            if match:
                self.compile_commands[match.group(1)] = shlex.split(line)
            elif link in line:
                self.link_command = shlex.split(line)

    def list_active_lines(self, path):
        """Numbers of the lines that the preprocessor leaves in."""
        self.prepare()
        args = [a for a in self.compile_commands[path]
                if a not in ("-c", "-MMD")][:-2]
        active, here, line = set(), False, 0
        for text in run_quiet([*args, "-E"]).splitlines():
            marker = re.match(r'# (\d+) "(.*?)"', text)
            if marker:
                line, here = int(marker.group(1)), marker.group(2) == path
                continue
            if here and text.strip():
                active.add(line)
            line += 1
        return active

    def compile(self, path, source, target):
        args = [str(source) if a == path else a
                for a in self.compile_commands[path] if a != "-MMD"]
        run_quiet([*args[:-1], str(target)])
        return hashlib.sha256(target.read_bytes()).hexdigest()

    def build(self, path, text, folder):
        """Link the program with `path` replaced by `text`, in `folder`.

        Returns the program, or None if the compiler makes the same of both.
        """
        self.prepare()
        folder = folder / self.name
        source = folder / path
        source.parent.mkdir(parents=True, exist_ok=True)
        changed = source.with_suffix(".o")
        with self.lock:
            if path not in self.pristine:
                source.write_text((ROOT / path).read_text())
                self.pristine[path] = self.compile(path, source, changed)
        source.write_text(text)
        if self.compile(path, source, changed) == self.pristine[path]:
            return None
        right = self.out + path.removesuffix(".c") + ".o"
        program = folder / self.output
        link = [str(changed) if a == right else a for a in self.link_command]
        link[link.index("-o") + 1] = str(program)
        run_quiet(link)
        shutil.copy(ROOT / self.out / "klipper.dict", folder)
        return program


def make_variants():
    """All builds that the checks need, by name."""
    fakeboard = "BOARD=../test/firmware/fakeboard"
    linux = "test/configs/linux.config"
    variants = [
        Variant("simulator", "test/configs/simulator.config", "klipper.so"),
        Variant("fakeboard", linux, "klipper.elf", [fakeboard]),
        Variant("interleave", linux, "klipper.elf",
                [fakeboard, "FAKE_SANITIZER=interleave"]),
    ]
    return {variant.name: variant for variant in variants}
