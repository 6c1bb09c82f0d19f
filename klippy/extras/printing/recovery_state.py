# SPDX-License-Identifier: GPL-3.0-or-later
"""What must be known of a print to go on with it after a power cut.

capture() reads it between two lines of the file; restore_*() bring it back.
"""

import os

LIMITS = (("max_velocity", "VELOCITY"), ("max_accel", "ACCEL"),
          ("minimum_cruise_ratio", "MINIMUM_CRUISE_RATIO"),
          ("square_corner_velocity", "SQUARE_CORNER_VELOCITY"))


def identify_file(path):
    """[size, mtime in ns] of a file.  Raises OSError."""
    status = os.stat(path)
    return [status.st_size, status.st_mtime_ns]


def capture(printer, sdcard):
    """State of the print and the printer behind all lines that ran.

    Plain types; mm, degC, s.  Raises OSError if the file cannot be read.
    """
    now = printer.get_reactor().monotonic()
    toolhead = printer.lookup_object("toolhead")
    status = toolhead.get_status(now)
    return {
        "file": sdcard.file_path, "identity": identify_file(sdcard.file_path),
        "byte": sdcard.get_file_position(), "size": sdcard.stream.size,
        "machine": toolhead.get_position()[:3], "extruder": status["extruder"],
        "limits": {name: status[name] for name, _ in LIMITS},
        "coordinates": _capture_coordinates(printer.lookup_object("gcode_move")),
        "heaters": _read_heaters(printer),
        "fans": _read_fans(printer, now),
        "advance": _read_advance(printer, now),
        "mesh": _get_status(printer, "bed_mesh", now).get("profile_name"),
        "objects": _get_status(printer, "exclude_object", now),
        "stats": _get_status(printer, "print_stats", now)}


def _get_status(printer, name, now):
    obj = printer.lookup_object(name, None)
    return dict(obj.get_status(now)) if obj is not None else {}


def _capture_coordinates(gcode_move):
    return {
        "position": gcode_move.last_position[:3],
        "base": gcode_move.base_position[:3],
        "origin": gcode_move.homing_position[:3],
        "e": gcode_move.get_gcode_position()[3],
        "absolute_coord": gcode_move.absolute_coord,
        "absolute_extrude": gcode_move.absolute_extrude,
        "speed": gcode_move.get_gcode_speed(),
        "speed_factor": gcode_move.speed_factor,
        "extrude_factor": gcode_move.extrude_factor}


def restore_coordinates(gcode_move, state):
    """Give the G-code its modes, offsets, factors and E; nothing moves."""
    gcode_move.reset_last_position()
    gcode_move.base_position[:3] = state["base"]
    gcode_move.homing_position[:3] = state["origin"]
    gcode_move.absolute_coord = state["absolute_coord"]
    gcode_move.absolute_extrude = state["absolute_extrude"]
    gcode_move.speed_factor = state["speed_factor"]
    gcode_move.speed = state["speed"] * state["speed_factor"]
    gcode_move.extrude_factor = factor = state["extrude_factor"]
    gcode_move.base_position[3] = gcode_move.last_position[3] - state["e"] * factor


def _read_heaters(printer):
    heaters = printer.lookup_object("heaters", None)
    if heaters is None:
        return {}
    return {name: heater.target_temp for name, heater in heaters.heaters.items()
            if heater.target_temp}


def _read_fans(printer, now):
    """{command: speed} of the fans that commands set."""
    fans = {}
    if printer.lookup_object("fan", None) is not None:
        fans["M106 S%.3f"] = 255. * _get_status(printer, "fan", now)["speed"]
    for name, fan in printer.lookup_objects("fan_generic"):
        command = "SET_FAN_SPEED FAN=%s SPEED=%%.6f" % (name.split()[-1],)
        fans[command] = fan.get_status(now)["speed"]
    return fans


def _read_advance(printer, now):
    """{extruder: [pressure advance, smooth time]}."""
    found = {}
    for name, extruder in printer.lookup_objects("extruder"):
        status = extruder.get_status(now)
        if "pressure_advance" in status:
            found[name] = [status["pressure_advance"], status["smooth_time"]]
    return found


def list_settings(state):
    """G-code that sets what the file has set so far; nothing moves."""
    lines = ["SET_VELOCITY_LIMIT " + " ".join(
        "%s=%.6f" % (word, state["limits"][name]) for name, word in LIMITS)]
    for name, (advance, smooth_time) in state["advance"].items():
        lines.append("SET_PRESSURE_ADVANCE EXTRUDER=%s ADVANCE=%.6f SMOOTH_TIME=%.6f"
                     % (name, advance, smooth_time))
    lines += [command % (speed,) for command, speed in state["fans"].items()]
    if state["mesh"]:
        lines.append('BED_MESH_PROFILE LOAD="%s"' % (state["mesh"],))
    return lines + _list_objects(state["objects"])


def _list_objects(status):
    """G-code that defines the objects of the file, and leaves out some."""
    lines = []
    for item in status.get("objects", ()):
        line = "EXCLUDE_OBJECT_DEFINE NAME=%s" % (item["name"],)
        if "center" in item:
            line += " CENTER=%s" % (",".join("%.6f" % c for c in item["center"]),)
        if "polygon" in item:
            line += " POLYGON=[%s]" % (",".join(
                "[%.6f,%.6f]" % tuple(point) for point in item["polygon"]),)
        lines.append(line)
    lines += ["EXCLUDE_OBJECT NAME=%s" % (name,)
              for name in status.get("excluded_objects", ())]
    if status.get("current_object"):
        lines.append("EXCLUDE_OBJECT_START NAME=%s" % (status["current_object"],))
    return lines
