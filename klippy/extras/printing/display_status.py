# SPDX-License-Identifier: GPL-3.0-or-later
"""[display_status]: the message and the progress that slicers set."""

M73_TIMEOUT = 5.0       # s after which the progress of the file counts again


class DisplayStatus:
    """M117, M73 and SET_DISPLAY_TEXT."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.expire_progress, self.progress, self.message = 0., None, None
        gcode = self.printer.lookup_object("gcode")
        gcode.register_command("M73", self.cmd_M73)
        gcode.register_command("M117", self.cmd_M117)
        gcode.register_command("SET_DISPLAY_TEXT", self.cmd_SET_DISPLAY_TEXT,
                               desc=self.cmd_SET_DISPLAY_TEXT_help)

    def get_status(self, eventtime):
        """progress: 0..1, of M73 or else of the file; message: text or None."""
        progress = self.progress
        if progress is not None and eventtime > self.expire_progress:
            idle_timeout = self.printer.lookup_object("idle_timeout", None)
            if (idle_timeout is None
                    or idle_timeout.get_status(eventtime)["state"] != "Printing"):
                self.progress = progress = None
        if progress is None:
            sdcard = self.printer.lookup_object("virtual_sdcard", None)
            progress = (sdcard.get_status(eventtime)["progress"]
                        if sdcard is not None else 0.)
        return {"progress": progress, "message": self.message}

    def cmd_M73(self, gcmd):
        percent = gcmd.get_float("P", None)
        if percent is None:
            return
        self.progress = min(1., max(0., percent / 100.))
        now = self.printer.get_reactor().monotonic()
        self.expire_progress = now + M73_TIMEOUT

    def cmd_M117(self, gcmd):
        self.message = gcmd.get_raw_command_parameters() or None

    cmd_SET_DISPLAY_TEXT_help = "Set or clear the message of the display"

    def cmd_SET_DISPLAY_TEXT(self, gcmd):
        self.message = gcmd.get("MSG", None)


def load_config(config):
    return DisplayStatus(config)
