# SPDX-License-Identifier: GPL-3.0-or-later
"""Smart load: the printer's extruder pulls in the filament of a Palette 2.

The device tells how much is left.  The extruder pulls a part of that and waits for
the device to see it, again and again: half of what is left, so that not too much
comes, and 50 mm at most, as a splice may be due meanwhile.
"""
from klippy.errors import CommandError, PrinterError

MAX_PART, LONG = 50.0, 70.0         # mm; parts of what is longer
SHORT = 5.0                         # mm; pulled in one piece
FIRST_WAIT, NEXT_WAIT = 6.0, 3.0    # s until the device sees movement
POLL_TIME = 0.1
SCRIPT = """SAVE_GCODE_STATE NAME=_palette2
M83
M220 S100
M221 S100
G1 E%.3f F%.1f
RESTORE_GCODE_STATE NAME=_palette2
M400"""


def choose_part(left):
    """mm to pull next of what is left."""
    if left > LONG:
        return MAX_PART
    return left / 2.0 if left > SHORT else left


class SmartLoad:
    """Loads in a greenlet of its own; one at a time."""

    def __init__(self, palette, speed):
        """palette: with remaining_load_length (mm) and is_splicing.  speed: mm/s."""
        self.palette, self.speed = palette, speed
        self.reactor = palette.reactor
        self.is_active = False

    def start(self):
        """Begin, if it makes sense now.  Raises CommandError."""
        if self.is_active:
            raise CommandError("Palette 2: filament is being loaded already")
        left = self.palette.remaining_load_length
        if left is None or left <= 0.0:
            raise CommandError("Palette 2: there is no filament to load now")
        heater = self.palette.get_extruder().get_heater()
        if not heater.can_extrude:
            raise CommandError("Palette 2: the extruder is too cold to load filament;"
                               " heat it first")
        self.is_active = True
        self.reactor.register_callback(self._run)

    def stop(self):
        """End after the part that is pulled now."""
        self.is_active = False

    def _run(self, eventtime):
        try:
            while self.is_active and (self.palette.remaining_load_length or 0) > 0:
                left = self.palette.remaining_load_length
                if not self.palette.is_splicing:
                    self.palette.gcode.run_script(SCRIPT % (
                        choose_part(left), self.speed * 60.0))
                if not self._wait_for_change(left):
                    self.palette.note_load_failed()
                    return
        except PrinterError:
            # told already by whoever ran the G-code
            self.palette.note_load_failed()
        finally:
            self.is_active = False

    def _wait_for_change(self, left):
        """Wait until the device has seen it all; False if it saw nothing."""
        has_changed, limit = False, self.reactor.monotonic() + FIRST_WAIT
        while self.is_active:
            now = self.reactor.pause(self.reactor.monotonic() + POLL_TIME)
            if self.palette.is_splicing:
                limit = now + FIRST_WAIT
            elif self.palette.remaining_load_length != left:
                left = self.palette.remaining_load_length
                has_changed, limit = True, now + NEXT_WAIT
            if now >= limit:
                return has_changed
        return True
