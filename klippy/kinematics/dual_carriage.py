# SPDX-License-Identifier: GPL-3.0-or-later
"""Two carriages on one axis: which of them prints, and what the other does."""

from klippy.kinematics.carriages import (
    COPY,
    MIRROR,
    PRIMARY,
    find_default_distance,
    make_modes,
)
from klippy.kinematics.limits import AXES

RESTORE_SPEED = 50.


def read_distance(config, first, second):
    """The option safe_distance of two rails (mm)."""
    distance = config.getfloat("safe_distance", None, minval=0.)
    return find_default_distance(first, second) if distance is None else distance


class DualCarriages:
    """Object `dual_carriage` of a CarriageMachine."""

    def __init__(self, machine):
        self.machine = machine
        self.printer = machine.printer
        axes = {c.axis for c in machine.carriages if c.primary is not None}
        self.carriages = [c for c in machine.carriages if c.axis in axes]
        self.saved = {}
        self.printer.add_object("dual_carriage", self)
        gcode = self.printer.lookup_object("gcode")
        for name in ("SET_DUAL_CARRIAGE", "SAVE_DUAL_CARRIAGE_STATE",
                     "RESTORE_DUAL_CARRIAGE_STATE"):
            gcode.register_command(name, getattr(self, "cmd_" + name),
                                   desc=getattr(self, "cmd_%s_help" % (name,)))

    def get_status(self, eventtime):
        """carriages: {name: mode}; and carriage_0, carriage_1 as they were known."""
        status = {"carriages": {c.name: c.mode for c in self.carriages}}
        if len(self.carriages) == 2:
            status.update(("carriage_%d" % i, c.mode)
                          for i, c in enumerate(self.carriages))
        return status

    def _find(self, gcmd):
        name = gcmd.get("CARRIAGE")
        for i, carriage in enumerate(self.carriages):
            if name in (carriage.name, carriage.rail.get_name()) or (
                    len(self.carriages) == 2 and name == str(i)):
                return carriage
        raise gcmd.error("CARRIAGE '%s' is none of the dual carriages: %s" % (
            name, ", ".join(c.name for c in self.carriages)))

    def _calc_places(self, axis):
        position = self.printer.lookup_object("toolhead").get_position()[axis]
        return {c: c.calc_position(position) for c in self.machine.list_carriages(axis)}

    cmd_SET_DUAL_CARRIAGE_help = "Choose the carriage that prints, or let one follow"

    def cmd_SET_DUAL_CARRIAGE(self, gcmd):
        """Give a carriage a MODE: PRIMARY, COPY or MIRROR."""
        carriage = self._find(gcmd)
        mode = gcmd.get("MODE", PRIMARY).upper()
        if mode not in (PRIMARY, COPY, MIRROR):
            raise gcmd.error("MODE '%s' is none of PRIMARY, COPY, MIRROR" % (mode,))
        axis, carriages = carriage.axis, self.machine.list_carriages(carriage.axis)
        if mode == PRIMARY:
            modes = make_modes(carriages, carriage)
        else:
            self._check_follower(gcmd, carriage, mode)
            modes = {c: c.mode for c in carriages}
            modes[carriage] = mode
        self.machine.switch(axis, modes)

    def _check_follower(self, gcmd, carriage, mode):
        letter = AXES[carriage.axis].upper()
        if carriage.mode == PRIMARY:
            raise gcmd.error("CARRIAGE %s is the primary one of %s and cannot follow"
                             " itself: make another one primary first"
                             % (carriage.name, letter))
        if not self.machine.limits.is_homed(carriage.axis):
            raise gcmd.error("Must home axis %s before a carriage gets MODE=%s"
                             % (letter, mode))
        places = self._calc_places(carriage.axis)
        primary = self.machine.find_primary(carriage.axis)
        gap = carriage.safe_distance or primary.safe_distance
        apart = abs(places[carriage] - places[primary])
        if mode == COPY and apart < gap:
            raise gcmd.error("The carriages of %s are %.3f apart, which is less than"
                             " safe_distance, %.3f" % (letter, apart, gap))

    cmd_SAVE_DUAL_CARRIAGE_STATE_help = "Save modes and positions of dual carriages"

    def cmd_SAVE_DUAL_CARRIAGE_STATE(self, gcmd):
        """Keep them under a NAME."""
        places = {}
        for axis in {c.axis for c in self.carriages}:
            places.update(self._calc_places(axis))
        self.saved[gcmd.get("NAME", "default")] = {
            c: (c.mode, places[c]) for c in self.carriages}

    cmd_RESTORE_DUAL_CARRIAGE_STATE_help = "Restore what was saved of dual carriages"

    def cmd_RESTORE_DUAL_CARRIAGE_STATE(self, gcmd):
        """Back to the state NAME; with MOVE=1 also to its positions."""
        name = gcmd.get("NAME", "default")
        if name not in self.saved:
            raise gcmd.error("No state of dual carriages was saved as '%s'" % (name,))
        speed = gcmd.get_float("MOVE_SPEED", RESTORE_SPEED, above=0.)
        is_moving = gcmd.get_int("MOVE", 1)
        state = self.saved[name]
        for axis in sorted({c.axis for c in state}):
            carriages = self.machine.list_carriages(axis)
            if is_moving and self.machine.limits.is_homed(axis):
                self._move_back(axis, carriages, state, speed)
            self.machine.switch(axis, {c: state[c][0] for c in carriages})

    def _move_back(self, axis, carriages, state, speed):
        """Move all carriages, the primary one last."""
        toolhead = self.printer.lookup_object("toolhead")
        for carriage in sorted(carriages, key=lambda c: state[c][0] == PRIMARY):
            self.machine.switch(axis, make_modes(carriages, carriage))
            target = [None] * 3
            target[axis] = state[carriage][1]
            toolhead.manual_move(target, speed)
            if state[carriage][0] != PRIMARY:
                toolhead.flush_step_generation()
