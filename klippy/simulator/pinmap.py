# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers on the simulated board for the pin names of a printer.cfg.

Every pin name that the file mentions gets a free pin of the simulated
board, in the order of the file, so that a config for any board runs on
it.  Names that the firmware knows itself keep their number.
"""
import re
from dataclasses import dataclass

from klippy.errors import ConfigError

PIN_OPTION = re.compile(r"(^|_)pins?$|^(a|b|c|d)_pin$|_pin_|^adc[12]$")
DESCRIPTION = re.compile(r"^(?P<pull>[\^~]?)\s*(?P<invert>!?)\s*"
                         r"(?:(?P<chip>[^:]+):)?(?P<pin>[^:\s]+)$")


@dataclass(frozen=True)
class PinRef:
    """A pin of a virtual mcu; invert as written with '!'.

    chip: the [adc_scaled] whose pin it is, if any.
    """

    mcu: str
    number: int
    invert: bool
    name: str
    chip: str = ""


class PinMap:
    """Pin numbers of every mcu of a MachineConfig."""

    def __init__(self, config, find_pin=None, n_pins=None):
        """find_pin(name) -> number or -1; n_pins: size of the board."""
        self.mcus = config.list_mcus()
        self.find_pin = find_pin or (lambda name: -1)
        self.n_pins = n_pins
        self.aliases = {mcu: {} for mcu in self.mcus}
        self._read_aliases(config)
        self.chips = self._read_chips(config)
        self.numbers = {mcu: {} for mcu in self.mcus}
        names = self._collect(config)
        for mcu in self.mcus:
            self._allocate(mcu, names[mcu])

    @staticmethod
    def _read_chips(config):
        """{name: mcu} of chips whose pins are those of an mcu."""
        chips = {}
        for section in config.with_prefix("adc_scaled"):
            match = DESCRIPTION.match((section.get("vref_pin") or "").strip())
            if match is not None and " " in section.name:
                chips[section.name.split()[1]] = match["chip"] or "mcu"
        return chips

    def _read_aliases(self, config):
        for section in config.with_prefix("board_pins"):
            mcus = (section.get("mcu") or "mcu").split(",")
            texts = [v for k, v in section.options.items()
                     if k.startswith("aliases")]
            for mcu in (m.strip() for m in mcus):
                if mcu in self.aliases:
                    self._add_aliases(mcu, ",".join(texts))

    def _add_aliases(self, mcu, text):
        for part in text.replace("\n", ",").split(","):
            name, sep, value = (piece.strip() for piece in part.partition("="))
            if sep and not value.startswith("<"):
                self.aliases[mcu][name] = value

    def _collect(self, config):
        names = {mcu: {} for mcu in self.mcus}
        for section in config.sections.values():
            for option, text in section.options.items():
                if not PIN_OPTION.search(option):
                    continue
                for part in text.replace("\n", ",").split(","):
                    self._note_name(names, part)
        return {mcu: list(found) for mcu, found in names.items()}

    def _note_name(self, names, text):
        match = DESCRIPTION.match(text.strip())
        if match is None:
            return
        mcu = (match["chip"] or "mcu").strip()
        mcu = self.chips.get(mcu, mcu)
        if mcu in names:
            names[mcu][self._resolve_alias(mcu, match["pin"])] = True

    def _resolve_alias(self, mcu, name):
        for _ in range(8):
            if name not in self.aliases[mcu]:
                break
            name = self.aliases[mcu][name]
        return name

    def _allocate(self, mcu, names):
        numbers = {n: self.find_pin(n) for n in names}
        taken = {number for number in numbers.values() if number >= 0}
        free = 0
        for name in names:
            if numbers[name] >= 0:
                continue
            while free in taken:
                free += 1
            if self.n_pins is not None and free >= self.n_pins:
                raise ConfigError(
                    "Section '%s' uses %d pins; the simulated board has only %d"
                    % (mcu, len(names), self.n_pins))
            numbers[name] = free
            taken.add(free)
        self.numbers[mcu] = numbers

    def get_pin_map(self, mcu):
        """{pin name: number} of one mcu."""
        return dict(self.numbers.get(mcu, {}))

    def lookup(self, description):
        """PinRef of '[^|~][!][mcu:]name'; None if it is not on an mcu."""
        match = DESCRIPTION.match((description or "").strip())
        if match is None:
            return None
        chip = (match["chip"] or "mcu").strip()
        mcu = self.chips.get(chip, chip)
        if mcu not in self.numbers:
            return None
        name = self._resolve_alias(mcu, match["pin"])
        number = self.numbers[mcu].get(name)
        if number is None:
            return None
        return PinRef(mcu, number, bool(match["invert"]), name,
                      chip if chip in self.chips else "")
