# SPDX-License-Identifier: GPL-3.0-or-later
"""The printer.cfg as the simulated machine sees it.

The machine only needs to know what is wired to which pin, so it reads
sections as plain text and leaves every complaint about a wrong option to
the printer, which reads the same file.  Only [simulator] is its own.
"""
from dataclasses import dataclass, field

from klippy.errors import ConfigError

REQUIRED = object()


class Section:
    """One section: text options by lower-case name, read with types.

    Offers the part of a config section's interface that sensor curves
    need (getfloat, getint, get_name, error).
    """

    error = ConfigError

    def __init__(self, name, options):
        self.name = name
        self.options = options

    def get_name(self):
        return self.name

    def get(self, option, default=None):
        """Text of an option."""
        return self.options.get(option, default)

    def getfloat(self, option, default=REQUIRED, minval=None, above=None,
                 maxval=None):
        """Number of an option; ConfigError when it is missing or not one.

        Ranges are the printer's business and not checked here.
        """
        return self._parse(option, default, float, "a number")

    def getint(self, option, default=REQUIRED, minval=None):
        """Integer of an option; ConfigError as in getfloat()."""
        return self._parse(option, default, int, "an integer")

    def getboolean(self, option, default=REQUIRED):
        """Truth of an option."""
        text = self.options.get(option)
        if text is None and default is not REQUIRED:
            return default
        return (text or "").strip().lower() in ("1", "true", "yes", "on")

    def _parse(self, option, default, kind, what):
        text = self.options.get(option)
        if text is None:
            if default is not REQUIRED:
                return default
            raise ConfigError("Option '%s' in section '%s' must be specified"
                              % (option, self.name))
        try:
            return kind(text)
        except ValueError as e:
            raise ConfigError("Option '%s' in section '%s' must be %s, not '%s'"
                              % (option, self.name, what, text)) from e


class MachineConfig:
    """All sections by name, in the order of the file."""

    def __init__(self, sections):
        """sections: {name: {option: text}}."""
        self.sections = {
            name: Section(name, {k.lower(): v for k, v in options.items()})
            for name, options in sections.items()}

    @classmethod
    def from_parser(cls, parser):
        """From a configparser object."""
        return cls({name: dict(parser.items(name, raw=True))
                    for name in parser.sections()})

    def get(self, name):
        """Section by name, an empty one when it is not in the file."""
        return self.sections.get(name) or Section(name, {})

    def has(self, name):
        return name in self.sections

    def with_prefix(self, prefix):
        """Sections '<prefix> name' and '<prefix>' in file order."""
        return [s for n, s in self.sections.items()
                if n == prefix or n.startswith(prefix + " ")]

    def list_mcus(self):
        """Names of the micro-controllers, 'mcu' first."""
        others = [n.split(None, 1)[1] for n in self.sections
                  if n.startswith("mcu ")]
        return ["mcu", *others]


def parse_per_name(section, option):
    """{name: number} of an option written 'name=1.5, other=2'."""
    values = {}
    text = section.get(option) or ""
    for part in text.replace("\n", ",").split(","):
        if not part.strip():
            continue
        name, sep, number = part.partition("=")
        try:
            values[name.strip()] = float(number)
        except ValueError:
            sep = ""
        if not sep:
            raise ConfigError(
                "Option '%s' in section 'simulator': '%s' should look like"
                " name=number" % (option, part.strip()))
    return values


@dataclass(frozen=True)
class SimOptions:
    """Options of the [simulator] section; the defaults suit most printers."""

    seed: int = 1
    ambient_temp: float = 25.0
    baud: int = 250000
    latency: float = 0.0002
    clock_freq: int = 0
    firmware: str | None = None
    clock_ppm: dict = field(default_factory=dict)
    heater_power: dict = field(default_factory=dict)
    heat_capacity: dict = field(default_factory=dict)
    heat_loss: dict = field(default_factory=dict)
    start_position: tuple | None = None
    filament_length: dict = field(default_factory=dict)
    filament_jam: dict = field(default_factory=dict)
    filament_diameter: dict = field(default_factory=dict)
    encoder_edge: float = 1.44

    @classmethod
    def from_config(cls, config):
        section = config.get("simulator")
        per_name = {name: parse_per_name(section, name) for name in (
            "clock_ppm", "heater_power", "heat_capacity", "heat_loss",
            "filament_length", "filament_jam", "filament_diameter")}
        return cls(
            seed=section.getint("seed", cls.seed),
            ambient_temp=section.getfloat("ambient_temp", cls.ambient_temp),
            baud=section.getint("baud", cls.baud),
            latency=section.getfloat("latency", cls.latency),
            clock_freq=section.getint("clock_freq", cls.clock_freq),
            firmware=section.get("firmware"),
            encoder_edge=section.getfloat("encoder_edge", cls.encoder_edge),
            start_position=parse_position(section), **per_name)


def parse_position(section):
    """(x, y, z) of the option start_position, None when absent."""
    text = section.get("start_position")
    if text is None:
        return None
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError as e:
        raise ConfigError(
            "Option 'start_position' in section 'simulator' should be"
            " 'x, y, z', not '%s'" % (text,)) from e
    return x, y, z
