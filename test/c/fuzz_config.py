# SPDX-License-Identifier: GPL-3.0-or-later
"""Fuzz target: any bytes are a config, or a ConfigError that says where."""

import pathlib
import sys

import atheris

with atheris.instrument_imports(include=["klippy.configtext"]):
    from klippy.configtext import ConfigReader
from klippy.errors import ConfigError

PATH = pathlib.Path("printer.cfg")


def read_one(data):
    PATH.write_bytes(data)
    try:
        store = ConfigReader().read(str(PATH))
    except ConfigError as err:
        assert str(err)
        return
    for section in store.sections():
        for option, value in store.items(section):
            assert option and isinstance(value, str)


if __name__ == "__main__":
    atheris.Setup(sys.argv, read_one)
    atheris.Fuzz()
