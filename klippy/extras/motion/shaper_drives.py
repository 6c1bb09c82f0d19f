# SPDX-License-Identifier: GPL-3.0-or-later
"""Filament drives that are shaped as the head that lays the filament down.

See docs/input_shaping.md for how a move's filament is split by its axes.
"""

from klippy.errors import CommandError
from klippy.kinematics.extruder import ExtruderStepper, PrinterExtruder


class ShapedDrives:
    """Extruders whose motors follow shapers; names in the order of the config."""

    def __init__(self, printer, names):
        self.printer = printer
        self.names = list(names)

    def find_fault(self):
        """What is wrong with a name, or None."""
        for name in self.names:
            if not isinstance(self.printer.lookup_object(name, None), PrinterExtruder):
                return "there is no extruder '%s'" % (name,)
        return None

    def find_drives(self):
        """All ExtruderSteppers of the printer, whatever they follow."""
        drives = [getattr(found, "extruder_stepper", None)
                  for _, found in self.printer.lookup_objects()]
        return [drive for drive in drives if isinstance(drive, ExtruderStepper)]

    def is_shaped(self, drive):
        """Whether an ExtruderStepper follows one of the extruders."""
        return drive.motion_queue in self.names

    def get_reach(self, path):
        """s of motion, at most, that a drive depends on with this path."""
        windows = [max(drive.drive.scan_window()) for drive in self.find_drives()]
        return max(path.scan_window()) + max(windows, default=0.)

    def apply(self, drive, path, head):
        """Have a drive follow a ShapedPath (None: the plan) on moves of a TrapQ."""
        drive.drive.set_shaper(path if self.is_shaped(drive) else None, head)

    def change(self, names, is_enabled):
        """The same with extruders added or taken away.

        Raises CommandError if there is no such extruder.
        """
        changed = ShapedDrives(self.printer, names)
        fault = changed.find_fault()
        if fault is not None:
            raise CommandError(fault[0].upper() + fault[1:])
        kept = [name for name in self.names if name not in names]
        return ShapedDrives(self.printer, kept + list(names) * is_enabled)
