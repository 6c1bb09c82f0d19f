# SPDX-License-Identifier: GPL-3.0-or-later
"""The rooms that show every section, and the Sections found in them."""

import importlib
import pathlib
from typing import NamedTuple

import klippy.extras
from klippy import plugins
from klippy.printer import list_section_kinds
from klippy.schema.explore import Room, copy_store, read_store
from klippy.schema.merge import merge
from klippy.simulator.samples import find_sample

HERE = pathlib.Path(__file__).resolve().parent
SAMPLE, MACHINE = "sample-", "machine_"     # starts of the names of files
SCALE = 0.97
BASE_SAMPLE = SAMPLE + "cartesian.cfg"
MACHINE_KINDS = ("printer", "stepper", "carriage", "dual_carriage", "extra_carriage")
NEEDED_KINDS = (*MACHINE_KINDS, "mcu")


def list_rooms():
    """Rooms of all sample machines, of the files in rooms/, and of plug-ins."""
    base_path = pathlib.Path(find_sample(BASE_SAMPLE))
    base = read_store(base_path)
    rooms = [make_machine_room(path.stem, read_store(path))
             for path in sorted(base_path.parent.glob(SAMPLE + "*.cfg"))]
    rooms += [make_machine_room(path.stem, read_more(path, base_path.parent))
              for path in sorted((HERE / "rooms").glob(MACHINE + "*.cfg"))]
    rooms += [scale(room) for room in rooms]
    known = {section for room in rooms for section in room.store.sections()}
    for path in sorted((HERE / "rooms").glob("*.cfg")):
        if path.name.startswith(MACHINE):
            continue
        own = read_store(path)
        known.update(own.sections())
        rooms.append(Room(path.stem, read_store(path, base), own.sections()))
    return rooms + list(make_unknown_rooms(base, known))


def read_more(path, samples):
    """What machine_X.cfg adds to sample-X.cfg, if there is one."""
    sample = samples / (SAMPLE + path.name.removeprefix(MACHINE))
    return read_store(path, read_store(sample) if sample.is_file() else None)


def make_machine_room(name, store):
    """A Room of a whole machine, where its moving parts are explored."""
    for section in store.sections():
        if find_machine_kind(section) not in NEEDED_KINDS:
            store.remove_section(section)
    return Room(name, store, [section for section in store.sections()
                                   if find_machine_kind(section) in MACHINE_KINDS])


def scale(room):
    """The Room with other numbers in [printer], loaded as it is: shows what other
    sections take from there."""
    store = copy_store(room.store)
    for option, text in store.items("printer"):
        try:
            store.set("printer", option, "%.6g" % (float(text) * SCALE,))
        except ValueError:
            pass                    # no number
    return Room(room.name + " scaled", store,
                [target.section for target in room.targets], max_depth=0)


def find_machine_kind(section):
    """stepper_x1 and `stepper x` are steppers."""
    head = section.split()[0].rstrip("0123456789")
    return head if head in NEEDED_KINDS else head.split("_")[0]


def make_unknown_rooms(base, known):
    """A Room for each section kind that no file shows: what plug-ins bring."""
    heads = {name.split()[0] for name in known}
    for kind in list_section_kinds():
        if kind not in heads and not kind.startswith(("stepper_", "_")):
            yield from make_kind_rooms(base, kind)


def make_kind_rooms(base, kind):
    """Rooms of the sections that the module of a kind loads."""
    module = import_extra(kind)
    for entry, name in (("load_config", kind), ("load_config_prefix",
                                                kind + " sample")):
        if hasattr(module, entry):
            store = copy_store(base)
            store.add_section(name)
            yield Room(name, store, [name])


def import_extra(kind):
    """The module of a section kind, None if it cannot be imported."""
    try:
        return importlib.import_module("klippy.extras." + kind)
    except ImportError:
        return None


class Catalog(NamedTuple):
    """What was found.  sections: {kind: Section}.  rooms: where."""
    sections: dict
    rooms: list


def read_catalog(folders=()):
    """The Catalog of all sections there are.

    folders: of plug-ins.  Raises FileNotFoundError if one does not exist.
    """
    add_plugins(folders)
    return explore_rooms(list_rooms())


def read_kind(kind, folders=()):
    """The Catalog of the sections of one module; see read_catalog()."""
    add_plugins(folders)
    base = read_store(find_sample(BASE_SAMPLE))
    return explore_rooms(list(make_kind_rooms(base, kind)))


def add_plugins(folders):
    """Have modules of further folders found."""
    plugins.install()
    for folder in folders:
        plugins.add_folder(klippy.extras, folder)


def explore_rooms(rooms):
    """The Catalog of some Rooms."""
    for room in rooms:
        room.explore()
    return Catalog(merge(rooms), rooms)
