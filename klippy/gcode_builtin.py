# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that exist without any config section, and unknown ones."""

from klippy.gcode_command import shorten

# Sent by slicers for firmware of other kinds; harmless to pass over.
IGNORED = {
    "M141": "chamber temperature", "M191": "chamber temperature",
    "M201": "acceleration limits", "M203": "velocity limits",
    "M205": "jerk limits", "M900": "linear advance",
}
# Done already where there is no such device: {command: default of S}
NEEDLESS_WHEN_OFF = {"M104": 0., "M109": 0., "M140": 0., "M190": 0., "M106": 255.}


class CoreCommands:
    """Identification, restart, help, emergency stop and the unknown."""

    def __init__(self, printer, gcode):
        self.printer, self.gcode = printer, gcode
        for name in ("M110", "M112", "M115", "RESTART", "FIRMWARE_RESTART",
                     "ECHO", "STATUS", "HELP"):
            gcode.register_command(name, getattr(self, "cmd_" + name), True,
                                   getattr(self, "cmd_%s_help" % name, None))
        gcode.register_command("LOG_ROLLOVER", self.cmd_LOG_ROLLOVER, True,
                               self.cmd_LOG_ROLLOVER_help, yields=True)
        gcode.interrupts.register("M112", lambda: self.cmd_M112(None))

    def cmd_M110(self, gcmd):
        """Set the line number: lines are not counted here."""

    def cmd_M112(self, gcmd):
        """Emergency stop."""
        self.printer.invoke_shutdown("Shutdown due to M112 command")

    def cmd_M115(self, gcmd):
        """Name and version of the software."""
        version = self.printer.get_start_args().get("software_version")
        answer = "FIRMWARE_NAME:Klipper FIRMWARE_VERSION:%s" % (version,)
        if not gcmd.ack(answer):
            gcmd.respond_info(answer)

    cmd_RESTART_help = "Read the config file again and restart the host"

    def cmd_RESTART(self, gcmd):
        self._request_restart("restart")

    cmd_FIRMWARE_RESTART_help = "Restart the micro-controllers, then the host"

    def cmd_FIRMWARE_RESTART(self, gcmd):
        self._request_restart("firmware_restart")

    def _request_restart(self, result):
        if self.gcode.is_printer_ready:
            toolhead = self.printer.lookup_object("toolhead", None)
            if toolhead is not None:
                print_time = toolhead.get_last_move_time()
                if result == "restart":
                    self.gcode.respond_info("Preparing to restart...", log=False)
                self.printer.send_event("gcode:request_restart", print_time)
                toolhead.dwell(0.500)
                toolhead.wait_moves()
        self.printer.request_exit(result)

    cmd_LOG_ROLLOVER_help = "Begin a new log file"

    def cmd_LOG_ROLLOVER(self, gcmd):
        bglogger = getattr(self.printer, "bglogger", None)
        if bglogger is None:
            raise gcmd.error("LOG_ROLLOVER: there is no log file")
        bglogger.roll_over()

    def cmd_ECHO(self, gcmd):
        """Answer with the line itself."""
        gcmd.respond_info(gcmd.get_commandline(), log=False)

    cmd_STATUS_help = "Report the state of the printer"

    def cmd_STATUS(self, gcmd):
        if self.gcode.is_printer_ready:
            gcmd.respond_info("Klipper state: Ready", log=False)
            return
        message = self.printer.get_state_message()[0]
        gcmd.respond_info("%s\nKlipper state: Not ready" % (message.rstrip(),),
                          log=False)

    cmd_HELP_help = "List the commands that have a help text"

    def cmd_HELP(self, gcmd):
        lines = ["Available extended commands:"]
        if not self.gcode.is_printer_ready:
            lines = ["The printer is not ready: not all commands are available."
                     ] + lines
        help_texts = self.gcode.gcode_help
        for name in sorted(self.gcode.gcode_handlers):
            if name in help_texts:
                lines.append("%-10s: %s" % (name, help_texts[name]))
        gcmd.respond_info("\n".join(lines), log=False)

    def run_unknown(self, gcmd):
        """Answer a command without handler."""
        name = gcmd.get_command()
        if name == "M105":
            gcmd.ack("T:0")
        elif name == "M21":
            return
        elif not self.gcode.is_printer_ready:
            raise gcmd.error(self.printer.get_state_message()[0])
        elif name in IGNORED:
            self._tell_once(name, gcmd)
        elif not (self._select_tool(name) or self._is_needless(name, gcmd)):
            gcmd.respond_info('Unknown command:"%s"' % (shorten(name),))

    def _tell_once(self, name, gcmd):
        told = self.gcode.told_commands
        if name not in told:
            told.add(name)
            gcmd.respond_info("%s (%s) is ignored: set this in the config file"
                              % (name, IGNORED[name]))

    def _select_tool(self, name):
        """Take T<number> for the extruder of that number; False if there is none."""
        if name[:1] != "T" or not name[1:].isdecimal():
            return False
        section = "extruder" + (str(int(name[1:])) if int(name[1:]) else "")
        if self.printer.lookup_object(section, None) is None:
            return False
        self.gcode.run_script_from_command("ACTIVATE_EXTRUDER EXTRUDER=" + section)
        return True

    def _is_needless(self, name, gcmd):
        if name == "M107":
            return True
        default = NEEDLESS_WHEN_OFF.get(name)
        return default is not None and not gcmd.get_float("S", default)
