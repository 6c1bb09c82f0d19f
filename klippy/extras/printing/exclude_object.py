# SPDX-License-Identifier: GPL-3.0-or-later
"""[exclude_object]: leaves out single objects of a print.

Moves between EXCLUDE_OBJECT_START and _END of an excluded object are not made.
What the left-out part would have extruded is taken off all later positions; a
difference in retraction between its two ends is made up for by the next move.
"""

import json


class ExtruderTrack:
    """How the positions of one extruder are shifted.

    offset: mm left out so far; peak: highest position asked for, so that
    peak - position is how far the filament is retracted.
    """

    def __init__(self, position):
        self.offset, self.peak, self.entry_peak = 0., position, None


class ExcludeObject:
    """The objects of the file and the transform that leaves some out."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.gcode = printer.lookup_object("gcode")
        self.gcode_move = printer.load_object(config, "gcode_move")
        self.toolhead = self.next_transform = None
        self.objects, self.excluded_objects = [], []
        self.current_object = None
        self.tracks = {}            # extruder name -> ExtruderTrack
        self.skipped_position = None    # asked for, while moves are left out
        printer.register_event_handler("klippy:connect", self._handle_connect)
        printer.register_event_handler("virtual_sdcard:reset_file", self._reset_file)
        if config.getboolean("enable_exclude_object", True):
            self._register_commands()

    def _register_commands(self):
        for name in ("START", "END", "DEFINE"):
            command = "EXCLUDE_OBJECT_" + name
            self.gcode.register_command(
                command, getattr(self, "cmd_" + command),
                desc=getattr(self, "cmd_%s_help" % command))
        self.gcode.register_command("EXCLUDE_OBJECT", self.cmd_EXCLUDE_OBJECT,
                                    desc=self.cmd_EXCLUDE_OBJECT_help)

    def _handle_connect(self):
        self.toolhead = self.printer.lookup_object("toolhead")

    def get_status(self, eventtime):
        return {"objects": self.objects, "excluded_objects": self.excluded_objects,
                "current_object": self.current_object}

    # Transform of the moves

    def _start_transform(self):
        if self.next_transform is None:
            self.tracks, self.skipped_position = {}, None
            self.next_transform = self.gcode_move.set_move_transform(self, force=True)
            self.gcode_move.reset_last_position()

    def _stop_transform(self):
        if self.next_transform is not None:
            self.gcode_move.set_move_transform(self.next_transform, force=True)
            self.next_transform = None
            self.gcode_move.reset_last_position()
        self.tracks, self.skipped_position = {}, None

    def _get_track(self, position):
        name = self.toolhead.get_extruder().get_name()
        if name not in self.tracks:
            self.tracks[name] = ExtruderTrack(position[3])
        return self.tracks[name]

    def get_position(self):
        """Position as the G-code knows it."""
        position = list(self.next_transform.get_position())
        track = self._get_track(position)
        position[3] += track.offset
        if self.skipped_position is not None and self._is_skipping():
            position[3] = self.skipped_position[3]
        return position

    def _is_skipping(self):
        return self.current_object in self.excluded_objects

    def move(self, newpos, speed):
        """Make a move, or leave it out."""
        track = self._get_track(newpos)
        if self._is_skipping():
            if track.entry_peak is None:
                track.entry_peak = track.peak
            track.peak = max(track.peak, newpos[3])
            self.skipped_position = list(newpos)
            return
        if self.skipped_position is not None:
            self._end_skipping()
        track.peak = max(track.peak, newpos[3])
        shifted = list(newpos)
        shifted[3] -= track.offset
        self.next_transform.move(shifted, speed)

    def _end_skipping(self):
        """Take what was left out off the positions from now on."""
        for track in self.tracks.values():
            if track.entry_peak is not None:
                track.offset += track.peak - track.entry_peak
                track.entry_peak = None
        self.skipped_position = None

    # Objects

    def _reset_file(self):
        self.objects, self.excluded_objects = [], []
        self.current_object = None
        self._stop_transform()

    def _find(self, name):
        return next((item for item in self.objects if item["name"] == name), None)

    def _add(self, definition):
        others = [item for item in self.objects
                  if item["name"] != definition["name"]]
        self.objects = sorted(others + [definition], key=lambda item: item["name"])

    def _exclude(self, name):
        if name not in self.excluded_objects:
            self.excluded_objects = sorted(self.excluded_objects + [name])
            self.gcode.respond_info("Excluding object %s" % (name,))
            self._start_transform()

    cmd_EXCLUDE_OBJECT_START_help = "The G-code of an object begins"

    def cmd_EXCLUDE_OBJECT_START(self, gcmd):
        name = gcmd.get("NAME").upper()
        if self._find(name) is None:
            self._add({"name": name})
        self.current_object = name

    cmd_EXCLUDE_OBJECT_END_help = "The G-code of an object ends"

    def cmd_EXCLUDE_OBJECT_END(self, gcmd):
        name = gcmd.get("NAME", None)
        if self.current_object is None:
            gcmd.respond_info("EXCLUDE_OBJECT_END without EXCLUDE_OBJECT_START")
        elif name is not None and name.upper() != self.current_object:
            gcmd.respond_info("EXCLUDE_OBJECT_END NAME=%s within object %s"
                              % (name.upper(), self.current_object))
        self.current_object = None

    cmd_EXCLUDE_OBJECT_help = "Leave an object out of the print"

    def cmd_EXCLUDE_OBJECT(self, gcmd):
        name = gcmd.get("NAME", "").upper()
        if gcmd.get("RESET", None):
            keep = [item for item in self.excluded_objects if name and item != name]
            self.excluded_objects = keep
        elif name:
            self._exclude(name)
        elif gcmd.get("CURRENT", None):
            if self.current_object is None:
                raise gcmd.error("There is no current object to exclude")
            self._exclude(self.current_object)
        else:
            gcmd.respond_info("Excluded objects: %s"
                              % (" ".join(self.excluded_objects),))

    cmd_EXCLUDE_OBJECT_DEFINE_help = "Describe an object of the file"

    def cmd_EXCLUDE_OBJECT_DEFINE(self, gcmd):
        name = gcmd.get("NAME", "").upper()
        if gcmd.get("RESET", None):
            self._reset_file()
        elif name:
            self._add(_read_definition(gcmd, name))
        elif gcmd.get("JSON", None) is not None:
            gcmd.respond_info("Known objects: %s" % (json.dumps(self.objects),))
        else:
            gcmd.respond_info("Known objects: %s" % (
                " ".join(item["name"] for item in self.objects),))


def _read_definition(gcmd, name):
    """The object's description: name, center, polygon and all else given."""
    definition = {key.lower(): text
                  for key, text in gcmd.get_command_parameters().items()}
    definition["name"] = name
    if "center" in definition:
        definition["center"] = _read_json(gcmd, "[%s]" % (definition["center"],))
    if "polygon" in definition:
        definition["polygon"] = _read_json(gcmd, definition["polygon"])
    return definition


def _read_json(gcmd, text):
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise gcmd.error("Error on '%s': '%s' is no list of numbers"
                         % (gcmd.get_commandline(), text))


def load_config(config):
    return ExcludeObject(config)
