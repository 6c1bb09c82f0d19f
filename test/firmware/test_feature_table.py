# SPDX-License-Identifier: GPL-3.0-or-later
"""klippy/mcu/features.toml tells the truth: which option brings which command.

The preprocessor is run over the sources as the build does it, with some options left
out; what the dictionary then lacks is what the table says, no more and no less.
"""
import json
import os
import random
import subprocess
import sys

import firmware_matrix
import pytest
import reduced_firmware
from firmware_matrix import ROOT

from klippy.mcu import features

sys.path.insert(0, str(ROOT / "scripts"))
import feature_table  # noqa: E402

OPTIONS = reduced_firmware.list_options()


def scan(name, removed):
    """(dictionary, chosen options) of a configuration without some options."""
    out = ROOT / "out" / "features" / name
    out.mkdir(parents=True, exist_ok=True)
    text = (ROOT / "test/configs" / (name + ".config")).read_text()
    config = out / "chosen.config"
    config.write_text(text + "".join("CONFIG_%s=n\n" % o for o in sorted(removed)))
    environment = {**os.environ, "KCONFIG_CONFIG": str(config)}
    subprocess.run([sys.executable, "scripts/kconfig.py", "header", str(out)],
                   cwd=ROOT, env=environment, check=True, capture_output=True)
    place = os.path.relpath(out, ROOT) + "/"
    subprocess.run(["make", "-j2", "-f", "src/build.mk", "OUT=" + place,
                    "PYTHON=" + sys.executable, "KCONFIG_CONFIG=" + str(config),
                    place + "decl/stamp"], cwd=ROOT, check=True, capture_output=True)
    chosen = {name for name, value in firmware_matrix.read_options(out).items()
              if name in OPTIONS and value == "y"}
    return json.loads((out / "klipper.dict").read_text()), chosen


def test_it_is_up_to_date():
    """`make docs` writes it."""
    assert feature_table.main(["--check"]) == 0


def test_every_option_is_in_it():
    tree = feature_table.Options()
    wanted = {name for name in tree.syms
              if name.startswith("WANT_") and tree.find_prompt(name)}
    assert wanted == set(OPTIONS) and len(wanted) >= 25
    commands = features.read_table()["commands"]
    for option in OPTIONS:
        assert any([option] in clauses for clauses in commands.values()), option


def list_rows():
    """(configuration, removed options): of the simulator each is left out once."""
    rng = random.Random(7)
    shuffled = rng.sample(OPTIONS, len(OPTIONS))
    third = len(OPTIONS) // 3 + 1
    rows = [("simulator", set())] + [
        ("simulator", set(shuffled[i * third:(i + 1) * third])) for i in range(3)]
    return rows + [(name, set(rng.sample(OPTIONS, 8)))
                   for name in ("linux", "stm32f407")]


@pytest.mark.parametrize("name, removed", list_rows(), ids=lambda value: (
    value if isinstance(value, str) else "%d_left_out" % (len(value),)))
def test_what_a_firmware_lacks(name, removed):
    if firmware_matrix.find_prefix(name) is None:
        pytest.skip(firmware_matrix.say_missing(name))
    table, chosen = scan(name, removed)
    assert not chosen & removed
    missing = set(OPTIONS) - chosen
    for kind, key in (("commands", "commands"), ("responses", "responses"),
                      ("constants", "config"), ("enumerations", "enumerations")):
        has = {text.split()[0] for text in table[key]}
        told = features.read_table()[kind]
        left = {item for item in told if reduced_firmware.is_left(kind, item, missing)}
        # a port may have names and numbers for what is left out
        assert left == set(told) & has or key in ("config", "enumerations")
        assert left <= has, kind
    # what the table does not know is in every firmware of this chip
    if name == "simulator":
        full = json.loads((ROOT / "out-simulator" / "klipper.dict").read_text())
        known = set(features.read_table()["commands"])
        assert ({text for text in full["commands"] if text.split()[0] not in known}
                <= set(table["commands"]))
