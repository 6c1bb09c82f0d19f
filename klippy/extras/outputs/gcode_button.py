# SPDX-License-Identifier: GPL-3.0-or-later
"""[gcode_button name]: G-code for a button that is pressed or released."""
import logging

# The printer goes on without it
MAY_LACK_FIRMWARE = True


class GCodeButton:
    """Status: state, "PRESSED" or "RELEASED"."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.gcode = self.printer.lookup_object("gcode")
        self.name = config.get_name().split(None, 1)[1]
        self.is_pressed = False
        macro = self.printer.load_object(config, "gcode_macro")
        self.templates = {
            True: macro.load_template(config, "press_gcode"),
            False: macro.load_template(config, "release_gcode", "")}
        self._register(config)
        self.gcode.register_mux_command(
            "QUERY_BUTTON", "BUTTON", self.name, self.cmd_QUERY_BUTTON,
            desc=self.cmd_QUERY_BUTTON_help)

    def _register(self, config):
        buttons = self.printer.load_object(config, "buttons")
        pin = config.get("pin")
        if config.get("analog_range", None) is None:
            buttons.register_debounce_button(pin, self._note_state, config)
            return
        low, high = config.getfloatlist("analog_range", count=2)
        if low > high:
            raise config.error(
                "Option 'analog_range' in section '%s' goes from the smaller to the"
                " greater resistance, not from %s to %s"
                % (config.get_name(), low, high))
        pullup = config.getfloat("analog_pullup_resistor", 4700.0, above=0.0)
        buttons.register_debounce_adc_button(
            pin, low, high, pullup, self._note_state, config)

    def _note_state(self, eventtime, state):
        self.is_pressed = bool(state)
        template = self.templates[self.is_pressed]
        # A script may take its time, other buttons need not wait for it
        self.printer.get_reactor().register_async_callback(
            lambda eventtime: self._run(template))

    def _run(self, template):
        try:
            script = template.render()
            if script:
                self.gcode.run_script(script)
        except self.printer.command_error as err:
            logging.warning("gcode_button %s: %s", self.name, err)
            self.gcode.respond_raw("!! Button %s: %s" % (self.name, err))

    def get_status(self, eventtime=None):
        return {"state": "PRESSED" if self.is_pressed else "RELEASED"}

    cmd_QUERY_BUTTON_help = "Report on the state of a button"

    def cmd_QUERY_BUTTON(self, gcmd):
        gcmd.respond_info("%s: %s" % (self.name, self.get_status()["state"]))


def load_config_prefix(config):
    return GCodeButton(config)
