# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that show, shift, save and restore the G-code position."""

# What SAVE_GCODE_STATE keeps; of lists, a copy
LISTS = ("base_position", "last_position", "homing_position")
PLAIN = ("absolute_coord", "absolute_extrude", "speed", "speed_factor",
         "extrude_factor")


class PositionCommands:
    """The commands with names of words, and M114, of a GCodeMove."""

    def __init__(self, owner):
        self.owner = owner
        self.printer = owner.printer

    def register(self):
        """Register all commands."""
        register = self.owner.gcode.register_command
        for name in ("SET_GCODE_OFFSET", "SAVE_GCODE_STATE", "RESTORE_GCODE_STATE"):
            register(name, getattr(self, "cmd_" + name),
                     desc=getattr(self, "cmd_%s_help" % (name,)))
        register("M114", self.cmd_M114, when_not_ready=True)
        register("GET_POSITION", self.cmd_GET_POSITION, when_not_ready=True,
                 desc=self.cmd_GET_POSITION_help)

    def cmd_M114(self, gcmd):
        """Tell the position in the coordinates of the G-code."""
        gcmd.respond_raw("X:%.3f Y:%.3f Z:%.3f E:%.3f"
                         % tuple(self.owner.get_gcode_position()[:4]))

    cmd_SET_GCODE_OFFSET_help = "Shift the coordinates of all coming moves"

    def cmd_SET_GCODE_OFFSET(self, gcmd):
        owner = self.owner
        offsets = []
        for index, letter in enumerate("XYZE"):
            adjusted = (owner.homing_position[index]
                        + gcmd.get_float(letter + "_ADJUST", 0.))
            offsets.append(gcmd.get_float(letter, adjusted))
        is_moving = gcmd.get_int("MOVE", 0)
        speed = gcmd.get_float("MOVE_SPEED", owner.speed, above=0.)
        target = list(owner.last_position)
        for index, offset in enumerate(offsets):
            shift = offset - owner.homing_position[index]
            owner.homing_position[index] = offset
            owner.base_position[index] += shift
            target[index] += shift
        if is_moving:
            self._move_to(target, speed)

    def _move_to(self, target, speed):
        """Move without a change of the G-code's own speed."""
        self.owner.last_position = list(target)
        self.owner.make_move(*target[:4], speed)

    cmd_SAVE_GCODE_STATE_help = "Keep position, modes and factors under a name"

    def cmd_SAVE_GCODE_STATE(self, gcmd):
        state = {key: list(getattr(self.owner, key)) for key in LISTS}
        state.update({key: getattr(self.owner, key) for key in PLAIN})
        self.owner.saved_states[gcmd.get("NAME", "default")] = state

    cmd_RESTORE_GCODE_STATE_help = "Bring back what SAVE_GCODE_STATE has kept"

    def cmd_RESTORE_GCODE_STATE(self, gcmd):
        owner, name = self.owner, gcmd.get("NAME", "default")
        state = owner.saved_states.get(name)
        if state is None:
            raise gcmd.error(
                "Unknown g-code state: '%s' (known: %s)"
                % (name, ", ".join(sorted(owner.saved_states)) or "none"))
        is_moving = gcmd.get_int("MOVE", 0)
        speed = gcmd.get_float("MOVE_SPEED", state["speed"], above=0.)
        for key in PLAIN:
            setattr(owner, key, state[key])
        for key in ("base_position", "homing_position"):
            kept = state[key][:len(getattr(owner, key))]
            getattr(owner, key)[:len(kept)] = kept
        # What was extruded since is no reason to extrude it again
        owner.base_position[3] += owner.last_position[3] - state["last_position"][3]
        if is_moving:
            self._move_to(state["last_position"][:3] + owner.last_position[3:], speed)

    cmd_GET_POSITION_help = "Tell the position at every level, from motor to G-code"

    def cmd_GET_POSITION(self, gcmd):
        toolhead = self.printer.lookup_object("toolhead", None)
        if toolhead is None:
            raise gcmd.error("The printer is not ready")
        owner, kinematics = self.owner, toolhead.get_kinematics()
        steppers = kinematics.get_steppers()
        commanded = {s.get_name(): s.get_commanded_position() for s in steppers}
        levels = [
            ("mcu", {s.get_name(): s.get_mcu_position() for s in steppers}),
            ("stepper", commanded),
            ("kinematic", label("XYZ", kinematics.calc_position(commanded))),
            ("toolhead", label("XYZE", toolhead.get_position())),
            ("gcode", label("XYZE", owner.last_position)),
            ("gcode base", label("XYZE", owner.base_position)),
            ("gcode homing", label("XYZ", owner.homing_position))]
        gcmd.respond_info("\n".join("%s: %s" % (name, format_values(values))
                                    for name, values in levels))


def label(letters, values):
    """{letter: value}, as many as there are letters."""
    return {letter: values[i] for i, letter in enumerate(letters)}


def format_values(values):
    """"X:1.000000 Y:?" of a dict of numbers; None is not known."""
    texts = {int: "%d", float: "%.6f", type(None): "?%.0s"}
    return " ".join("%s:%s" % (name, texts[type(value)] % (value,))
                    for name, value in values.items())
