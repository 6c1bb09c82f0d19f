# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots of bed meshes: of a config's profiles, a log's config, or a status."""

import json
import math
from typing import NamedTuple

from klippy.configfile import parse_float
from klippy.configtext import ConfigStore, FileParser, find_saved_block, split_lines
from klippy.errors import PrinterError, collect

PREFIX = "bed_mesh "
MIN_POINTS = 2


class Mesh(NamedTuple):
    """Heights (mm) in rows from low to high y.  xs, ys: mm."""
    name: str
    xs: tuple
    ys: tuple
    rows: tuple

    @property
    def extremes(self):
        """(least, greatest) height."""
        heights = [height for row in self.rows for height in row]
        return min(heights), max(heights)


def make_mesh(name, low, high, rows):
    """A Mesh between two corners (x, y).  Raises PrinterError."""
    where = "mesh '%s'" % (name,)
    width = len(rows[0]) if rows else 0
    if len(rows) < MIN_POINTS or width < MIN_POINTS:
        raise PrinterError("%s: %d x %d points are no mesh" % (where, width, len(rows)))
    for number, row in enumerate(rows, 1):
        if len(row) != width:
            raise PrinterError("%s: row %d has %d points, the first has %d"
                               % (where, number, len(row), width))
        if not all(math.isfinite(height) for height in row):
            raise PrinterError("%s: a height in row %d is no number" % (where, number))
    if not (low[0] < high[0] and low[1] < high[1]):
        raise PrinterError("%s: from %s to %s is no area" % (where, low, high))
    return Mesh(name, spread(low[0], high[0], width),
                spread(low[1], high[1], len(rows)), tuple(tuple(row) for row in rows))


def spread(low, high, count):
    """Evenly spaced numbers from low to high."""
    return tuple(low + (high - low) * i / (count - 1) for i in range(count))


# Configs

class _Sections:
    """Takes sections of a text into a ConfigStore; includes stay closed."""

    def __init__(self):
        self.store = ConfigStore()

    def begin_section(self, name, place):
        self.store.add_section(name, place)

    def add_option(self, section, name, value, place):
        self.store.set(section, name, value, place)

    def include(self, pattern, place):
        """Profiles are saved in the main file."""


def read_config(path, text):
    """Meshes of the sections [bed_mesh name] of a config text."""
    sections, errors, lines = _Sections(), [], split_lines(text)
    start = find_saved_block(lines)
    FileParser(path, sections, errors).parse(lines[:start])
    if start is not None:
        saved = [line.removeprefix("#*#").removeprefix(" ")
                 for line in lines[start + 2:]]
        FileParser(path, sections, errors).parse(saved, start + 3)
    if errors:
        raise collect(errors)
    return [read_profile(section, dict(sections.store.items(section)))
            for section in sections.store.sections() if section.startswith(PREFIX)]


def read_profile(section, options):
    """The Mesh of a section.  Raises PrinterError."""
    name = section[len(PREFIX):]
    try:
        low = parse_float(options["min_x"]), parse_float(options["min_y"])
        high = parse_float(options["max_x"]), parse_float(options["max_y"])
        rows = [[parse_float(part) for part in line.split(",") if part.strip()]
                for line in options["points"].split("\n") if line.strip()]
    except KeyError as err:
        raise PrinterError("section [%s] has no option %s" % (section, err))
    except ValueError as err:
        raise PrinterError("section [%s]: '%s' is no number" % (section, err))
    return make_mesh(name, low, high, rows)


# Status

def read_status(text):
    """Meshes of a status of the API, as JSON; objects around it do not matter."""
    try:
        found = find_status(json.loads(text))
    except ValueError as err:
        raise PrinterError("it is no JSON: %s" % (err,))
    if found is None:
        raise PrinterError("there is no bed_mesh with a probed_matrix in it")
    try:
        return [make_mesh(found.get("profile_name") or "bed_mesh",
                          found["mesh_min"], found["mesh_max"], found["probed_matrix"])]
    except (KeyError, TypeError, IndexError) as err:
        raise PrinterError("the bed_mesh in it is incomplete: %s" % (err,))


def find_status(data):
    """The first object with a mesh, however deep."""
    if isinstance(data, dict):
        if data.get("probed_matrix"):
            return data
        data = list(data.values())
    if isinstance(data, list):
        return next((found for found in map(find_status, data) if found), None)
    return None


# Plots

def draw(figure, meshes):
    """Draw meshes below each other, each with a colour bar."""
    for mesh, axes in zip(meshes, figure.subplots(len(meshes), 1, squeeze=False)[:, 0],
                          strict=True):
        low, high = mesh.extremes
        colours = axes.pcolormesh(mesh.xs, mesh.ys, mesh.rows, shading="gouraud",
                                  cmap="coolwarm", rasterized=True)
        if high > low:
            lines = axes.contour(mesh.xs, mesh.ys, mesh.rows, levels=8, colors="k",
                                 linewidths=0.5)
            axes.clabel(lines, fontsize="x-small", fmt="%.3f")
        axes.set_aspect("equal")
        axes.set_xlabel("x, mm")
        axes.set_ylabel("y, mm")
        axes.set_title("%s: %.3f to %.3f, range %.3f mm" % (
            mesh.name, low, high, high - low))
        figure.colorbar(colours, ax=axes, label="z, mm")
