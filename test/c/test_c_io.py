# SPDX-License-Identifier: GPL-3.0-or-later
"""The I/O half of the host's C core alone, under sanitizers and a fuzzer."""

import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CSRC = ROOT / "klippy_ext" / "csrc"
CORE = ["msgblock", "qmsg", "rto", "cmdqueue", "sqcore", "sqreceive"]
WORLD = ["hostclock", "serialqueue", "sqvirtual", "vlink", "vmcu", "vtrace", "vworld"]
THREADED = ["hostclock", "realtime", "serialqueue", "sqthread", "trdispatch"]
FLAGS = ["-std=gnu11", "-O1", "-g", "-Wall", "-Wextra", "-Wshadow", "-Wconversion",
         "-Wno-sign-conversion", "-Werror", "-fno-omit-frame-pointer"]
WRAP = ["-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=strdup"]
MEMORY = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


def compile_test(folder, source, modules, flags, compiler="cc"):
    program = folder / pathlib.Path(source).stem
    sources = [str(ROOT / "test/c" / source)]
    sources += [str(CSRC / (name + ".c")) for name in modules]
    subprocess.run([compiler, *FLAGS, *flags, "-I", str(CSRC), "-o", str(program),
                    *sources, "-lm", "-lpthread"], check=True)
    return program


def run(program, *args, **options):
    result = subprocess.run([program, *args], capture_output=True, text=True, **options)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout + result.stderr


def test_protocol_on_a_damaged_link(tmp_path):
    program = compile_test(tmp_path, "sq_lossy.c", [*CORE, "vlink"], MEMORY)
    assert "200 runs" in run(program, "200")


@pytest.mark.parametrize("flags", [MEMORY, ["-fsanitize=thread"]],
                         ids=["memory", "thread"])
def test_threads_of_the_queue(tmp_path, flags):
    program = compile_test(tmp_path, "sq_threads.c", CORE + THREADED, flags)
    output = run(program)
    assert output.count("800 logged, 800 acked") == 2
    assert "link 1: 800 logged, 800 acked, 1 triggers" in output


def make_toy(folder):
    toy = folder / "toy.so"
    subprocess.run(["cc", "-std=gnu11", "-g", "-fPIC", "-shared", "-I", str(CSRC),
                    "-o", str(toy), str(ROOT / "test/c/echo_vmcu.c"),
                    str(CSRC / "msgblock.c")], check=True)
    return toy


def test_world_from_birth_to_death(tmp_path):
    program = compile_test(tmp_path, "vworld_story.c", CORE + WORLD,
                           [*MEMORY, "-ldl"])
    assert "3 mcus" in run(program, str(make_toy(tmp_path)))


def test_every_allocation_that_fails(tmp_path):
    """Who asked is told, or what was lost is sent again; nothing leaks."""
    program = compile_test(tmp_path, "io_memory.c", [*CORE, *WORLD, "trdispatch"],
                           [*MEMORY, *WRAP, "-ldl"])
    output = run(program, str(make_toy(tmp_path)), "1")
    allocations, failed, refused = map(int, re.findall(r"\d+", output))
    assert failed == allocations > 50 and refused > 10


def test_every_allocation_of_descriptors_that_fails(tmp_path):
    """The thread on a descriptor and the file: refused, or the loss is told once."""
    program = compile_test(tmp_path, "sq_memory.c", [*CORE, *THREADED, "sqfile"],
                           [*MEMORY, *WRAP])
    allocations, refused, told = map(int, re.findall(r"\d+", run(program)))
    assert allocations == refused + told and refused > 10 and told >= 16
