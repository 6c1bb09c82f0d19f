# SPDX-License-Identifier: GPL-3.0-or-later
"""What a folder of built firmware is for, from its auto.conf."""

import dataclasses
import pathlib
import shlex

from klippy.errors import PrinterError


@dataclasses.dataclass
class Target:
    """Firmware in a folder: its chip and the options it was built with."""

    folder: pathlib.Path
    options: dict

    @property
    def family(self):
        """Name of the chip family: avr, stm32 ..."""
        return self.options["BOARD_DIRECTORY"]

    @property
    def mcu(self):
        """Name of the chip."""
        return self.options["MCU"]

    def read_number(self, name, default=0):
        """A numeric option; the default without it."""
        return int(self.options.get(name) or str(default), 0)

    def has(self, name):
        """True if a yes/no option is set."""
        return self.options.get(name) == "y"

    def find_file(self, suffix, stem="klipper"):
        """Path of <stem><suffix>; PrinterError if it was not built."""
        path = self.folder / (stem + suffix)
        if not path.exists():
            raise PrinterError(
                "There is no '%s': build the firmware first, with 'make' or"
                " 'klippy firmware build'" % (path,))
        return path


def read_target(folder):
    """The Target in a folder such as out/; PrinterError if nothing was built."""
    path = pathlib.Path(folder) / "auto.conf"
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as err:
        raise PrinterError(
            "There is no firmware in '%s' (%s): build it first, with 'make' or"
            " 'klippy firmware build'" % (folder, err.strerror)) from None
    options = {}
    for line in lines:
        name, sep, value = line.partition("=")
        if sep and name.startswith("CONFIG_"):
            options[name[len("CONFIG_"):]] = " ".join(shlex.split(value))
    return Target(pathlib.Path(folder), options)
