# SPDX-License-Identifier: GPL-3.0-or-later
"""What a G-code file asks for: moves, grouped by the stops between them.

Knows the few commands that our test jobs consist of and refuses others, so
that no job is judged by a model that misread it.
"""

import dataclasses
import math

# Without effect on motion.
IGNORED = {"M104", "M105", "M106", "M107", "M117", "M140", "M73", "G21", "M110",
           "SET_FAN_SPEED", "SET_HEATER_TEMPERATURE", "EXCLUDE_OBJECT_DEFINE",
           "EXCLUDE_OBJECT_START", "EXCLUDE_OBJECT_END", "SET_PIN"}
# The machine comes to rest.
STOPS = {"M109", "M190", "M400", "TEMPERATURE_WAIT", "M84", "M18"}
FULL_EXTRUDE_SECTION = 4.       # squares of the nozzle, default limit
# The axis at right angles to the plane, and the letters of the middle
PLANES = {"G17": (2, "IJ"), "G18": (1, "KI"), "G19": (0, "JK")}


@dataclasses.dataclass(frozen=True)
class Limits:
    """What a move may do; mm, s."""
    max_velocity: float
    max_accel: float
    corner_velocity: float = 5.
    cruise_ratio: float = 0.5
    max_z_velocity: float = math.inf
    max_z_accel: float = math.inf
    filament_velocity: float = math.inf     # of moves that only extrude, or retract
    filament_accel: float = math.inf
    filament_jump: float = 1.               # instantaneous_corner_velocity

    @classmethod
    def from_config(cls, config):
        """Limits of {section: {option: text}}."""
        printer = config["printer"]
        velocity = float(printer["max_velocity"])
        accel = float(printer["max_accel"])
        values = dict(
            max_velocity=velocity, max_accel=accel,
            corner_velocity=float(printer.get("square_corner_velocity", 5.)),
            cruise_ratio=float(printer.get("minimum_cruise_ratio", 0.5)),
            max_z_velocity=float(printer.get("max_z_velocity", velocity)),
            max_z_accel=float(printer.get("max_z_accel", accel)))
        if "extruder" in config:
            values.update(_filament_limits(config["extruder"], velocity, accel))
        return cls(**values)


def _filament_limits(section, velocity, accel):
    nozzle = float(section["nozzle_diameter"])
    area = math.pi * (0.5 * float(section["filament_diameter"])) ** 2
    ratio = FULL_EXTRUDE_SECTION * nozzle * nozzle / area
    return dict(
        filament_velocity=float(
            section.get("max_extrude_only_velocity", velocity * ratio)),
        filament_accel=float(section.get("max_extrude_only_accel", accel * ratio)),
        filament_jump=float(section.get("instantaneous_corner_velocity", 1.)))


@dataclasses.dataclass
class Round:
    """An arc in the plane of the two axes after `normal`: mm, rad."""
    normal: int
    middle: tuple
    radius: float
    angle: float                # at the start
    sweep: float                # positive from the first axis to the second


@dataclasses.dataclass
class Wanted:
    """One move as asked for: positions (x, y, z, e) in mm, speed in mm/s."""
    start: tuple
    end: tuple
    speed: float
    limits: Limits
    advance: float = 0.         # pressure advance, s
    arc: Round | None = None    # or else straight


@dataclasses.dataclass
class Sequence:
    """Moves from one rest to the next."""
    moves: list
    pause: float = 0.           # s of rest asked for after it
    ended_by: str = ""


class Reader:
    """Turns lines into sequences; positions after homing are given to it."""

    def __init__(self, limits, start=(0., 0., 0., 0.), advance=0., homed=()):
        self.limits = limits
        self.position = list(start)
        self.base = [0., 0., 0., 0.]
        self.speed = 25.
        self.absolute = self.absolute_e = True
        self.homed = list(homed)        # (x, y, z) after each G28
        self.normal, self.letters = PLANES["G17"]
        self.advance = advance
        self.current = Sequence([])
        self.sequences = []

    def read(self, text):
        """All sequences of a text."""
        for number, line in enumerate(text.splitlines(), 1):
            words = line.split(";", 1)[0].split()
            if not words:
                continue
            try:
                self.feed(words[0].upper(), words[1:])
            except (KeyError, ValueError, IndexError) as e:
                raise ValueError("line %d: %r: %r" % (number, line, e)) from e
        self.stop("end")
        return self.sequences

    def stop(self, name, pause=0.):
        """Come to rest, and stay so for pause s."""
        self.current.ended_by, self.current.pause = name, pause
        self.sequences.append(self.current)
        self.current = Sequence([])

    def feed(self, name, words):
        if name in IGNORED:
            return
        if name in STOPS:
            self.stop(name)
            return
        handler = getattr(self, "do_" + name.replace(".", "_"), None)
        if handler is None:
            raise ValueError("command unknown to the model")
        if "_" in name:
            handler({k.upper(): v for k, v in (w.split("=") for w in words)})
        else:
            handler({w[0].upper(): float(w[1:] or 0.) for w in words})

    def do_G17(self, p):
        self.normal, self.letters = PLANES["G17"]

    def do_G18(self, p):
        self.normal, self.letters = PLANES["G18"]

    def do_G19(self, p):
        self.normal, self.letters = PLANES["G19"]

    def do_G2(self, p):
        # seen from y, x to z is the other way round
        self._add_arc(p, -1. if self.normal != 1 else 1.)

    def do_G3(self, p):
        self._add_arc(p, 1. if self.normal != 1 else -1.)

    def _add_arc(self, p, sign):
        """The middle is taken to where both ends are equally far from it."""
        axes = (self.normal + 1) % 3, (self.normal + 2) % 3
        start = [self.position[axis] for axis in axes]
        middle = [a + p.get(k, 0.) for a, k in zip(start, self.letters, strict=True)]
        self.do_G1(p)
        end = [self.position[axis] for axis in axes]
        chord = [b - a for a, b in zip(start, end, strict=True)]
        length = math.hypot(*chord)
        if length:
            across = (-chord[1] / length, chord[0] / length)
            half = [0.5 * (a + b) for a, b in zip(start, end, strict=True)]
            off = sum((m - h) * n for m, h, n in
                      zip(middle, half, across, strict=True))
            middle = [h + off * n for h, n in zip(half, across, strict=True)]
        first, last = (math.atan2(at[1] - middle[1], at[0] - middle[0])
                       for at in (start, end))
        sweep = (sign * (last - first)) % (2. * math.pi) if length else 0.
        self.current.moves[-1].arc = Round(
            self.normal, tuple(middle), math.dist(start, middle), first,
            sign * (sweep or 2. * math.pi))

    def do_G1(self, p):
        target = list(self.position)
        for i, axis in enumerate("XYZE"):
            if axis not in p:
                continue
            absolute = self.absolute and (axis != "E" or self.absolute_e)
            origin = self.base[i] if absolute else self.position[i]
            target[i] = origin + p[axis]
        if "F" in p:
            self.speed = p["F"] / 60.
        if target != self.position or set(p) & set("IJK"):
            self.current.moves.append(Wanted(
                tuple(self.position), tuple(target), self.speed, self.limits,
                self.advance))
            self.position = target

    do_G0 = do_G1

    def do_G90(self, p):
        self.absolute = True

    def do_G91(self, p):
        self.absolute = False

    def do_M82(self, p):
        self.absolute_e = True

    def do_M83(self, p):
        self.absolute_e = False

    def do_G92(self, p):
        for i, axis in enumerate("XYZE"):
            if axis in p or not p:
                self.base[i] = self.position[i] - p.get(axis, 0.)

    def do_G4(self, p):
        self.stop("G4", p.get("P", 0.) * 0.001 + p.get("S", 0.))

    def do_G28(self, p):
        self.stop("G28")
        self.position[:3] = self.homed.pop(0)
        self.base[:3] = [0., 0., 0.]

    def do_SET_KINEMATIC_POSITION(self, p):
        self.stop("SET_KINEMATIC_POSITION")
        for i, axis in enumerate("XYZ"):
            if axis in p:
                self.position[i] = float(p[axis])

    def do_M204(self, p):
        accel = p["S"] if "S" in p else min(p["P"], p["T"])
        self.limits = dataclasses.replace(self.limits, max_accel=accel)

    def do_SET_VELOCITY_LIMIT(self, p):
        names = {"VELOCITY": "max_velocity", "ACCEL": "max_accel",
                 "SQUARE_CORNER_VELOCITY": "corner_velocity",
                 "MINIMUM_CRUISE_RATIO": "cruise_ratio"}
        self.limits = dataclasses.replace(
            self.limits, **{names[k]: float(v) for k, v in p.items()})

    def do_SET_PRESSURE_ADVANCE(self, p):
        self.advance = float(p["ADVANCE"])
