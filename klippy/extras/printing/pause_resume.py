# SPDX-License-Identifier: GPL-3.0-or-later
"""[pause_resume]: PAUSE, RESUME and CANCEL_PRINT, as commands and endpoints."""

STATE_NAME = "PAUSE_STATE"


class PauseResume:
    """Pauses what prints: the virtual SD card, or whoever sends the G-code."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.gcode = printer.lookup_object("gcode")
        self.recover_velocity = config.getfloat("recover_velocity", 50.)
        self.v_sd = None
        self.is_paused = self.sd_paused = self.pause_command_sent = False
        printer.register_event_handler("klippy:connect", self._handle_connect)
        for name in ("PAUSE", "RESUME", "CLEAR_PAUSE", "CANCEL_PRINT"):
            self.gcode.register_command(
                name, getattr(self, "cmd_" + name),
                desc=getattr(self, "cmd_%s_help" % name))
        self.gcode.interrupts.register("PAUSE", self._hurry_pause)
        self.gcode.interrupts.register("CANCEL_PRINT", self._hurry_cancel)
        webhooks = printer.lookup_object("webhooks")
        for path, script in (("cancel", "CANCEL_PRINT"), ("pause", "PAUSE"),
                             ("resume", "RESUME")):
            webhooks.register_endpoint("pause_resume/" + path,
                                       self._make_endpoint(script))

    def _make_endpoint(self, script):
        def run_endpoint(web_request):
            self.gcode.run_script(script)
        return run_endpoint

    def _hurry_pause(self):
        """PAUSE waits for its turn: a line of the file that waits lets it in."""
        if self.v_sd is not None:
            self.v_sd.hurry()

    def _hurry_cancel(self):
        """CANCEL_PRINT waits for its turn: end what runs."""
        self.gcode.interrupts.interrupt_others("CANCEL_PRINT")

    def _handle_connect(self):
        self.v_sd = self.printer.lookup_object("virtual_sdcard", None)

    def get_status(self, eventtime):
        return {"is_paused": self.is_paused}

    def is_sd_active(self):
        """True while the virtual SD card prints."""
        return self.v_sd is not None and self.v_sd.is_active()

    def send_pause_command(self):
        """Stop the source of the print; once until it goes on."""
        if self.pause_command_sent:
            return
        if self.is_sd_active():
            self.sd_paused = True
            self.v_sd.do_pause()
        else:
            self.sd_paused = False
            self.gcode.respond_info("action:paused")
        self.pause_command_sent = True

    def send_resume_command(self):
        """Have the source of the print go on."""
        if self.sd_paused:
            self.v_sd.do_resume()
        else:
            self.gcode.respond_info("action:resumed")
        self.sd_paused = self.pause_command_sent = False

    def note_resumed(self):
        """The virtual SD card prints, whoever had it start or go on."""
        self.is_paused = self.sd_paused = self.pause_command_sent = False

    def pause_within_command(self):
        """PAUSE, by the macro of that name if there is one, from inside the print.

        Paused in any case when it returns or raises CommandError.
        """
        try:
            self.gcode.run_script_from_command("PAUSE")
        finally:
            if not self.is_paused:
                self._pause()

    cmd_PAUSE_help = "Pause the print"

    def cmd_PAUSE(self, gcmd):
        if self.is_paused:
            gcmd.respond_info("Print already paused")
            return
        self._pause()

    def _pause(self):
        self.send_pause_command()
        self.gcode.run_script_from_command("SAVE_GCODE_STATE NAME=" + STATE_NAME)
        self.is_paused = True

    cmd_RESUME_help = "Return to where the print paused and go on"

    def cmd_RESUME(self, gcmd):
        if not self.is_paused:
            gcmd.respond_info("Print is not paused, resume aborted")
            return
        velocity = gcmd.get_float("VELOCITY", self.recover_velocity)
        self.gcode.run_script_from_command(
            "RESTORE_GCODE_STATE NAME=%s MOVE=1 MOVE_SPEED=%.4f"
            % (STATE_NAME, velocity))
        self.send_resume_command()
        self.is_paused = False

    cmd_CLEAR_PAUSE_help = "Forget the pause without going on"

    def cmd_CLEAR_PAUSE(self, gcmd):
        self.is_paused = self.pause_command_sent = False

    cmd_CANCEL_PRINT_help = "Cancel the print"

    def cmd_CANCEL_PRINT(self, gcmd):
        if self.is_sd_active() or self.sd_paused:
            self.v_sd.do_cancel()
            self.sd_paused = False
        else:
            gcmd.respond_info("action:cancel")
        self.cmd_CLEAR_PAUSE(gcmd)


def load_config(config):
    return PauseResume(config)
