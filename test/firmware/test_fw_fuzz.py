# SPDX-License-Identifier: GPL-3.0-or-later
"""The firmware's fuzzer: old inputs again, and a few seconds of new ones."""

import json
import re
import shutil
import sys

import pytest
from fuzz_firmware import CORPUS, OUT, ROOT, build_fuzzer, make_seeds, run_fuzzer

sys.path.insert(0, str(ROOT / "test" / "firmware" / "fakeboard"))
from write_formats import write_formats  # noqa: E402

SMOKE_SECONDS = 4


@pytest.fixture(scope="module")
def fuzzer():
    if not shutil.which("clang"):
        pytest.skip("libFuzzer needs clang")
    return build_fuzzer()


def test_inputs_that_were_once_worth_keeping(fuzzer):
    seeds = make_seeds()
    n_inputs = len([*CORPUS.iterdir(), *seeds.iterdir()])
    assert n_inputs > 100
    result = run_fuzzer(fuzzer, "-runs=0", CORPUS, seeds, capture_output=True,
                        text=True)
    assert result.returncode == 0, result.stderr[-4000:]
    assert "#%d" % (n_inputs + 1) in result.stderr


def test_sessions_reach_most_of_the_firmware(fuzzer):
    """Timers, sensors and buses, not only refusals: some 3 of 10 of the edges."""
    result = run_fuzzer(fuzzer, "-runs=0", make_seeds(), capture_output=True,
                        text=True)
    assert result.returncode == 0, result.stderr[-4000:]
    assert int(re.search(r"INITED cov: (\d+)", result.stderr).group(1)) > 900


def test_new_inputs(fuzzer, tmp_path):
    result = run_fuzzer(fuzzer, "-max_total_time=%d" % (SMOKE_SECONDS,),
                        "-seed=1", tmp_path, CORPUS, make_seeds(),
                        capture_output=True, text=True)
    assert result.returncode == 0, result.stderr[-4000:]
    # the mutator works: what is new came from it
    assert re.search(r"(NEW|REDUCE).*Custom-", result.stderr)


def test_the_mutator_knows_all_commands(fuzzer):
    dictionary = json.loads((ROOT / OUT / "klipper.dict").read_text())
    table = (ROOT / OUT / "fuzz_formats.h").read_text()
    names = set(re.findall(r"/\* (\w+) \*/", table))
    assert names == {text.split()[0] for text in dictionary["commands"]}
    assert len(names) > 80


def test_a_table_of_formats():
    table = write_formats({"commands": {"nop": 3, "go oid=%c clock=%u x_pin=%u"
                                        " n=%hi data=%*s": 200}})
    assert "{ 3, 0, { 0 } }, /* nop */" in table
    assert ("{ 200, 5, { FORMAT_OID, FORMAT_CLOCK, FORMAT_PIN, FORMAT_SIGNED, "
            "FORMAT_BYTES } }, /* go */") in table
