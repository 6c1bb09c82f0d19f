# SPDX-License-Identifier: GPL-3.0-or-later
"""[delayed_gcode <name>]: a template of G-code run after some time."""

import logging


class DelayedGCode:
    """A template with a timer."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.name = config.get_name().split()[-1]
        self.gcode = printer.lookup_object("gcode")
        self.template = printer.load_object(config, "gcode_macro").load_template(
            config, "gcode")
        self.duration = config.getfloat("initial_duration", 0., minval=0.)
        self.timer = None
        printer.register_event_handler("klippy:ready", self._handle_ready)
        printer.register_event_handler("klippy:disconnect", self._stop)
        self.gcode.register_mux_command(
            "UPDATE_DELAYED_GCODE", "ID", self.name, self.cmd_UPDATE_DELAYED_GCODE,
            desc=config.get("description", self.cmd_UPDATE_DELAYED_GCODE_help))

    def _handle_ready(self):
        waketime = self.reactor.NEVER
        if self.duration:
            waketime = self.reactor.monotonic() + self.duration
        self.timer = self.reactor.register_timer(self._run, waketime)

    def _stop(self):
        if self.timer is not None:
            self.reactor.unregister_timer(self.timer)
            self.timer = None

    def _run(self, eventtime):
        self.duration = 0.
        try:
            self.gcode.run_script(self.template.render())
        except self.gcode.error as err:
            logging.warning("[delayed_gcode %s] ended by: %s", self.name, err)
        if not self.duration:
            return self.reactor.NEVER
        return self.reactor.monotonic() + self.duration

    cmd_UPDATE_DELAYED_GCODE_help = "Set the time until a delayed_gcode runs"

    def cmd_UPDATE_DELAYED_GCODE(self, gcmd):
        self.duration = gcmd.get_float("DURATION", minval=0.)
        if self.timer is None:
            return
        waketime = self.reactor.NEVER
        if self.duration:
            waketime = self.reactor.monotonic() + self.duration
        self.reactor.update_timer(self.timer, waketime)


def load_config_prefix(config):
    return DelayedGCode(config)
