# SPDX-License-Identifier: GPL-3.0-or-later
"""[gcode_macro <name>]: commands written as Jinja2 templates of G-code."""

import ast
import json
import logging
import math

from klippy.extras.macro_reload import MacroReloader
from klippy.extras.macro_template import StatusProxy, Template
from klippy.extras.template_check import CheckedTexts
from klippy.gcode_command import is_classic

# Jinja2 is loaded so long (s) after the printer is ready, if it is not yet
WARM_UP_DELAY = 5.


class PrinterGCodeMacro:
    """Object `gcode_macro`: the template environment of all who need one."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.gcode = self.printer.lookup_object("gcode")
        self.env = None
        self.checked = CheckedTexts(self.printer.get_start_args().get("config_file"))
        self.printer.register_event_handler("klippy:ready", self._handle_ready)
        self.reloader = MacroReloader(self.printer, GCodeMacro)

    def _handle_ready(self):
        self.checked.save()
        mcu = self.printer.lookup_object("mcu", None)
        if self.checked.used and mcu is not None and not mcu.is_fileoutput():
            reactor = self.printer.get_reactor()
            reactor.register_callback(lambda eventtime: self.get_env(),
                                      reactor.monotonic() + WARM_UP_DELAY)

    def get_env(self):
        """The Jinja2 environment of all templates."""
        if self.env is None:
            import jinja2
            self.env = jinja2.Environment(
                block_start_string="{%", block_end_string="%}",
                variable_start_string="{", variable_end_string="}",
                comment_start_string="{#", comment_end_string="#}",
                trim_blocks=False, extensions=["jinja2.ext.do"])
            # a variable of that name comes first
            self.env.globals["math"] = math
        return self.env

    def load_template(self, config, option, default=None):
        """Compile the template of an option.  Raises ConfigError."""
        name = "[%s] option '%s'" % (config.get_name(), option)
        text = (config.get(option) if default is None
                else config.get(option, default))
        if text.lstrip().startswith("!"):
            from klippy.extras import script_file
            text = script_file.read_script(config, option, text)
        return Template(self, name, text)

    def create_template_context(self, eventtime=None):
        """printer and the actions."""
        return {
            "printer": StatusProxy(self.printer, eventtime),
            "action_emergency_stop": self._action_emergency_stop,
            "action_respond_info": self._action_respond_info,
            "action_log": self._action_log,
            "action_raise_error": self._action_raise_error,
            "action_call_remote_method": self._action_call_remote_method,
        }

    def _action_emergency_stop(self, msg="action_emergency_stop"):
        self.printer.invoke_shutdown("Shutdown due to %s" % (msg,))
        return ""

    def _action_respond_info(self, msg):
        self.gcode.respond_info(str(msg))
        return ""

    def _action_log(self, msg):
        logging.info("macro: %s", msg)
        return ""

    def _action_raise_error(self, msg):
        raise self.printer.command_error(str(msg))

    def _action_call_remote_method(self, method, **kwargs):
        webhooks = self.printer.lookup_object("webhooks")
        try:
            webhooks.call_remote_method(method, **kwargs)
        except self.printer.command_error as err:
            logging.warning("macro: remote method: %s", err)
        return ""


class MacroText:
    """What the config says of a macro."""

    def __init__(self, config):
        macros = config.get_printer().load_object(config, "gcode_macro")
        self.template = macros.load_template(config, "gcode")
        self.rename_existing = config.get("rename_existing", None)
        self.description = config.get("description", "G-Code macro")
        self.is_live = config.getboolean("live", False)
        self.variables = _read_variables(config)


class GCodeMacro:
    """One macro: a command whose handler is a template."""

    def __init__(self, config):
        names = config.get_name().split()
        self.printer = printer = config.get_printer()
        if len(names) != 2:
            raise printer.config_error(
                "Section [%s]: a macro has a name without blanks, like"
                " [gcode_macro MY_MACRO]" % (config.get_name(),))
        self.name, self.alias = names[1], names[1].upper()
        self.gcode = printer.lookup_object("gcode")
        self.text = MacroText(config)
        self.variables = dict(self.text.variables)
        self.rename_existing = self.text.rename_existing
        self.is_running = False
        self._register(config)

    @property
    def template(self):
        """The Template that runs."""
        return self.text.template

    @property
    def cmd_desc(self):
        """Text of HELP."""
        return self.text.description

    def change(self, text):
        """Take over another text; variables that its author did not change keep
        the values they have."""
        old = self.text.variables
        self.variables = {
            name: self.variables[name] if name in old and old[name] == value
            else value for name, value in text.variables.items()}
        self.text = text
        self.gcode.gcode_help[self.alias] = text.description

    def _register(self, config):
        # By its name as the config has it, and as a command
        for name in sorted({self.name, self.alias}):
            self.gcode.register_mux_command(
                "SET_GCODE_VARIABLE", "MACRO", name, self.cmd_SET_GCODE_VARIABLE,
                desc=self.cmd_SET_GCODE_VARIABLE_help)
        if self.rename_existing is None:
            self.gcode.register_command(self.alias, self.cmd, desc=self.cmd_desc)
            return
        if is_classic(self.alias) != is_classic(self.rename_existing):
            raise config.error(
                "[%s] rename_existing '%s': %s" % (
                    config.get_name(), self.rename_existing,
                    "like '%s' it must be a letter with a number" % (self.alias,)
                    if is_classic(self.alias) else
                    "it must not be a letter with a number, '%s' is none either"
                    % (self.alias,)))
        if config.get_printer().lookup_object("gcode").is_printer_ready:
            self._rename()
            return
        self.printer.register_event_handler("klippy:connect", self._rename)

    def unregister(self):
        """Take the macro away; a command that it replaced has its name again."""
        self.gcode.register_command(self.alias, None)
        self.gcode.gcode_help.pop(self.alias, None)
        _, handlers = self.gcode.mux_commands["SET_GCODE_VARIABLE"]
        for name in {self.name, self.alias}:
            handlers.pop(name, None)
        if self.rename_existing is not None:
            existing = self.gcode.register_command(self.rename_existing, None)
            self.gcode.gcode_help.pop(self.rename_existing, None)
            self.gcode.register_command(self.alias, existing)

    def _rename(self):
        """Move the existing command away, once all of them are registered."""
        existing = self.gcode.register_command(self.alias, None)
        if existing is None:
            raise self.printer.config_error(
                "[gcode_macro %s]: there is no command '%s' to rename to '%s'"
                % (self.alias, self.alias, self.rename_existing))
        self.gcode.register_command(
            self.rename_existing, existing,
            desc="Renamed builtin of '%s'" % (self.alias,))
        self.gcode.register_command(self.alias, self.cmd, desc=self.cmd_desc)

    def get_status(self, eventtime):
        """The variables."""
        return self.variables

    cmd_SET_GCODE_VARIABLE_help = "Set the value of a variable of a G-Code macro"

    def cmd_SET_GCODE_VARIABLE(self, gcmd):
        name, text = gcmd.get("VARIABLE"), gcmd.get("VALUE")
        if name not in self.variables:
            raise gcmd.error("Macro %s has no variable '%s': known are %s" % (
                self.alias, name, ", ".join(sorted(self.variables)) or "none"))
        try:
            value = parse_literal(text)
        except ValueError as err:
            raise gcmd.error("Unable to set '%s' to '%s': %s" % (name, text, err))
        self.variables = {**self.variables, name: value}

    def cmd(self, gcmd):
        """Run the macro."""
        if self.is_running:
            raise gcmd.error("Macro %s called recursively" % (self.alias,))
        context = dict(self.variables)
        context.update(self.template.create_template_context())
        context["params"] = gcmd.get_command_parameters()
        context["rawparams"] = gcmd.get_raw_command_parameters()
        self.is_running = True
        try:
            if self.text.is_live:
                self.template.run_live_from_command(context)
            else:
                self.template.run_gcode_from_command(context)
        finally:
            self.is_running = False


def _read_variables(config):
    variables = {}
    for option in config.get_prefix_options("variable_"):
        try:
            variables[option[len("variable_"):]] = parse_literal(config.get(option))
        except ValueError as err:
            raise config.error("[%s] option '%s': %s"
                               % (config.get_name(), option, err))
    return variables


def parse_literal(text):
    """The value of a Python literal that JSON can hold.

    Raises ValueError that says what is wrong.
    """
    try:
        value = ast.literal_eval(text)
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError):
        raise ValueError(
            "'%s' is no number, text in quotes, True, False, None, list or dict"
            % (text,)) from None
    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError):
        raise ValueError("'%s' holds something that JSON cannot" % (text,)) from None
    return value


def load_config(config):
    return PrinterGCodeMacro(config)


def load_config_prefix(config):
    return GCodeMacro(config)
