# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts what the loads of many sections showed together: one declaration an option."""

import re
from dataclasses import dataclass, field

from klippy.configfile import parse_boolean, sentinel

MIN_INDEXED = 4             # names that differ by their number only are one option
EXTRUDER = "extruder<n>"        # the first one has no number
CABLE = "stepper_<letter>"      # of a winch, beyond those with other uses
KINEMATICS = "kinematics of [printer]"
BOUNDS = ("minval", "maxval", "above", "below")
# Reads sensor_type, and what stands between it and a section that is no sensor's
_SENSOR_FACTORY, _HEATER = "heaters", "heater"
_ANY_NUMBER = re.compile(r"(?P<stem>.*?)(?P<index>\d+)\Z")


@dataclass
class Option:
    """One option of a section kind.

    kind, item, seps, count, choices: as in Read.  needed: it must be set (when it
    is read at all).  default: None without one.  sources: {default, minval, maxval,
    above or below: names of the options they are derived from}; a bound that is
    derived has no value of its own.  when: {option: states} in which it is read, None
    always.  States are values, "set" or "unset".
    """
    name: str
    kind: str
    needed: bool
    default: object = None
    item: str = "str"
    seps: tuple = ()
    count: int | None = None
    choices: tuple = ()
    bounds: dict = field(default_factory=dict)
    sources: dict = field(default_factory=dict)
    when: dict | None = None
    is_always: bool = True
    modules: tuple = ()
    is_deprecated: bool = False
    is_of_sensor: bool = False


@dataclass
class Section:
    """One kind of section: its name as `fan`, `led <name>` or `stepper_x<n>`."""
    kind: str
    options: dict = field(default_factory=dict)

    @property
    def has_sensor(self):
        return "sensor_type" in self.options


class Case:
    """A Trial with where it was made, and the state of every option in it."""

    def __init__(self, trial, room, kinematics):
        self.trial, self.reads, self.room = trial, trial.reads, room
        self.states = {name: find_state(read, trial.texts.get(name))
                       for name, read in trial.reads.items()}
        self.states[KINEMATICS] = kinematics


def find_state(read, text):
    """Value of a choice or switch, else "set" or "unset"."""
    if read.kind in ("choice", "bool") or read.option in ("sensor_type", "kinematics"):
        if text is None:
            return None if read.default is sentinel else _show(read.default)
        if read.kind == "bool":
            try:
                return _show(parse_boolean(text))
            except ValueError:
                return None
        return text
    return "unset" if text is None else "set"


def _show(value):
    return str(value) if value is not None else "unset"


def find_kind(section):
    """`led strip` is an `led <name>`, stepper_x1 a `stepper_x<n>`."""
    head, blank, _ = section.partition(" ")
    if blank:
        return head + " <name>"
    match = re.fullmatch(r"(stepper_\w+?|dual_carriage)\d+", section)
    if match:
        return match.group(1) + "<n>"
    if re.fullmatch("stepper_[d-w]", section):
        return CABLE
    return EXTRUDER if re.fullmatch(r"extruder\d*", section) else section


def merge(rooms):
    """The Sections of explored Rooms, by kind."""
    cases, prefixes, deprecated = {}, {}, {}
    for room in rooms:
        kinematics = dict(room.store.items("printer")).get("kinematics", "")
        for target in room.targets:
            kind = find_kind(target.section)
            cases.setdefault(kind, []).extend(
                Case(trial, room.name, kinematics) for trial in target.trials)
            prefixes.setdefault(kind, set()).update(target.prefixes)
            deprecated.setdefault(kind, set()).update(target.deprecated)
    sections = {}
    for kind in sorted(cases):
        sections[kind] = merge_section(kind, cases[kind], prefixes[kind])
        for name in deprecated[kind] & set(sections[kind].options):
            sections[kind].options[name].is_deprecated = True
    return sections


def merge_section(kind, cases, prefixes):
    """The Section of all Cases of a kind."""
    section = Section(kind)
    names = list(dict.fromkeys(name for case in cases for name in case.reads))
    for name in names:
        option = merge_option(name, cases)
        option.is_of_sensor = "sensor_type" in names and is_of_sensor(option)
        section.options[option.name] = option
    name_patterns(section, prefixes)
    index_options(section)
    return section


def is_of_sensor(option):
    """Whether an option is one of the sensor, whatever section has the sensor."""
    if _SENSOR_FACTORY not in option.modules:
        return False
    inner = option.modules[:option.modules.index(_SENSOR_FACTORY)]
    return bool(inner) and _HEATER not in inner


def name_patterns(section, prefixes):
    """Make `variable_<name>` of the options whose names have a known start."""
    for prefix in prefixes:
        names = [name for name in section.options if name.startswith(prefix)
                 and name != prefix]
        for name in names:
            option = section.options.pop(name)
            joint = "" if not prefix or prefix.endswith("_") else "_"
            option.name = prefix + joint + "<name>"
            option.needed = False
            section.options[option.name] = option


def merge_option(name, cases):
    """The Option that all Cases together declare."""
    having = [case for case in cases if name in case.reads]
    good = [case for case in having if case.trial.is_loaded] or having
    first = choose_read(good, name)
    option = Option(name, first.kind, False, item=first.item, seps=first.seps,
                    count=first.count, modules=first.modules)
    if option.kind == "choice":
        option.choices = merge_choices(good, name)
        option.kind = "choice" if option.choices else "str"
    loaded = [case for case in cases if case.trial.is_loaded]
    option.is_always = all(name in case.reads for case in loaded)
    if not option.is_always:
        option.when = find_condition(name, loaded)
    option.needed = all(case.reads[name].default is sentinel for case in good)
    merge_default(option, having, good)
    # two modules may ask for the same name in one section
    same = [case for case in having if case.reads[name].modules == first.modules
            and case.reads[name].kind == option.kind]
    for bound in BOUNDS:
        merge_bound(option, bound, same)
    return option


def choose_read(cases, name):
    """The read that tells most: one with a type rather than plain text."""
    reads = [case.reads[name] for case in cases]
    return next((read for read in reads if read.kind != "str"), reads[0])


def merge_choices(cases, name):
    """The choices; none if they are names that differ from config to config."""
    lists = [case.reads[name].choices for case in cases]
    longest = max(lists, key=len)
    if any(set(choices) - set(longest) for choices in lists):
        return ()
    return tuple(choice for choice in longest if choice is not None)


def merge_default(option, having, good):
    """Note the default: a value, or the options it comes from."""
    values = [case.reads[option.name].default for case in good
              if case.reads[option.name].default is not sentinel]
    if not values:
        return
    option.default = values[0]
    if all(value == values[0] for value in values):
        return
    option.sources["default"] = find_sources(option.name, "default", having)


def merge_bound(option, bound, having):
    """Note a bound: a value, or the options it comes from."""
    values = [getattr(case.reads[option.name], bound) for case in having]
    if all(value == values[0] for value in values):
        if values and values[0] is not None:
            option.bounds[bound] = values[0]
    elif any(value is not None for value in values):
        option.sources[bound] = find_sources(option.name, bound, having)


def find_sources(name, attribute, cases):
    """Options whose value alone made a difference to an attribute of a read."""
    found, known = [], {}
    for case in cases:
        place = case.room, case.trial.section
        known.setdefault((place, frozenset(case.trial.given.items())), case)
    for (place, given), case in known.items():
        for item in given:
            before = known.get((place, given - {item}))
            if before is not None and item[0] not in found and item[0] != name and (
                    getattr(before.reads[name], attribute)
                    != getattr(case.reads[name], attribute)):
                found.append(item[0])
    return sorted(found)


def find_condition(name, cases):
    """{option: states} that tells apart the Cases that read an option."""
    reading = [case for case in cases if name in case.reads]
    others = [case for case in cases if name not in case.reads]
    candidates = list(dict.fromkeys(
        key for case in reading for key in case.states if key != name))
    candidates.sort(key=lambda key: key == KINEMATICS)
    for key in candidates:
        states = {case.states.get(key) for case in reading}
        other_states = {case.states.get(key) for case in others}
        if None in states or states & other_states:
            continue
        # where nobody reads the key it is not set either
        if None not in other_states or not states & list_default_states(key, reading):
            return {key: sorted(states)}
    return None


def list_default_states(key, cases):
    """States of an option that is not set."""
    reads = [case.reads[key] for case in cases if key in case.reads]
    return {"unset", *(_show(read.default) for read in reads)}


def index_options(section):
    """Make `voltage<n>` of voltage1, voltage2, ..."""
    stems = {}
    for name in section.options:
        match = _ANY_NUMBER.match(name)
        if match:
            stems.setdefault(match.group("stem"), []).append(name)
    for stem, names in stems.items():
        if len(names) < MIN_INDEXED:
            continue
        option = section.options[names[len(names) - 1]]
        for name in names:
            del section.options[name]
        option.name = stem + "<n>"
        option.when, option.is_always, option.needed = None, False, False
        section.options[option.name] = option
