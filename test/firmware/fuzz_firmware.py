# SPDX-License-Identifier: GPL-3.0-or-later
"""Fuzz the firmware: any bytes at the console of a configured fake board.

    python test/firmware/fuzz_firmware.py --seconds 600

The program is src/ on the fake board, built by clang with libFuzzer and the
address and undefined behaviour sanitizers; its mutator knows the commands of
the dictionary.  New inputs are kept in out/fuzz-firmware/corpus, an input that
breaks something in out/fuzz-firmware/found.  fuzz_seeds.py has whole sessions to start
from.  With --merge the corpus of the
tree takes over what is worth keeping.
"""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys

from fuzz_seeds import write_seeds

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test"))
from own_memory import own_memory  # noqa: E402

OUT = "out/fuzz-firmware/"
CORPUS = pathlib.Path(__file__).with_name("corpus")
MAX_LEN = 1500


def build_fuzzer():
    """The fuzzer's program, brought up to date."""
    env = dict(os.environ, KCONFIG_CONFIG="test/configs/linux.config")
    (ROOT / OUT).mkdir(parents=True, exist_ok=True)
    for args in ([sys.executable, "scripts/kconfig.py", "header", OUT],
                 ["make", "-s", "-f", "src/build.mk", "OUT=" + OUT,
                  "PYTHON=" + sys.executable, "CC=clang", "LTO_FLAGS=",
                  "BOARD=../test/firmware/fakeboard", "FAKE_SANITIZER=fuzzer",
                  OUT + "klipper.elf"]):
        result = subprocess.run(args, cwd=ROOT, env=env, capture_output=True,
                                text=True)
        if result.returncode:
            sys.exit(result.stdout + result.stderr)
    return ROOT / OUT / "klipper.elf"


def make_seeds():
    """Folder of the sessions to start from, for this build's dictionary."""
    folder = make_folder("seeds")
    write_seeds(json.loads((ROOT / OUT / "klipper.dict").read_text()), folder)
    return folder


def make_folder(name):
    folder = ROOT / OUT / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def run_fuzzer(program, *args, **options):
    """Run it with these arguments of libFuzzer; returns the finished process."""
    found = make_folder("found")
    return subprocess.run(
        own_memory([str(program), "-max_len=%d" % (MAX_LEN,), "-timeout=10",
                    "-artifact_prefix=%s/" % (found,), *map(str, args)]),
        cwd=ROOT, **options)


def merge_corpus(program):
    """Make the tree's corpus the smallest that still reaches everything."""
    merged = make_folder("merged")
    shutil.rmtree(merged)
    merged.mkdir()
    result = run_fuzzer(program, "-merge=1", "-use_counters=0", merged, CORPUS,
                        make_folder("corpus"), make_seeds())
    if result.returncode == 0:
        shutil.rmtree(CORPUS)
        shutil.copytree(merged, CORPUS)
        print("the corpus has %d inputs" % len(list(CORPUS.iterdir())))
    return result.returncode


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=600,
                        help="how long to fuzz (default 600)")
    parser.add_argument("--seed", type=int, default=0,
                        help="of libFuzzer; 0, the default: another each time")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--merge", action="store_true",
                        help="take new inputs into the tree's corpus instead")
    args = parser.parse_args()
    program = build_fuzzer()
    if args.merge:
        return merge_corpus(program)
    return run_fuzzer(
        program, "-max_total_time=%d" % (args.seconds,), "-seed=%d" % (args.seed,),
        "-fork=%d" % (args.jobs,), make_folder("corpus"), CORPUS,
        make_seeds()).returncode


if __name__ == "__main__":
    sys.exit(main())
