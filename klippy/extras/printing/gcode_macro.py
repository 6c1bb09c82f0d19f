# SPDX-License-Identifier: GPL-3.0-or-later
"""[gcode_macro <name>]: commands written as Jinja2 templates of G-code."""

import ast
import json
import logging

import jinja2

from klippy.gcode_command import is_classic

# What an expression of a template can raise.
TEMPLATE_ERRORS = (
    jinja2.TemplateError, ArithmeticError, LookupError, TypeError, ValueError,
    AttributeError, AssertionError, RecursionError, MemoryError)


class StatusProxy:
    """`printer` as templates see it: status of objects, read once each.

    Missing objects raise KeyError, so that Jinja2 takes them for undefined.
    """

    def __init__(self, printer, eventtime=None):
        self._printer = printer
        if eventtime is None:
            eventtime = printer.get_reactor().monotonic()
        self._eventtime = eventtime
        self._known = {}

    def __getitem__(self, name):
        name = str(name).strip()
        known = self._known.get(name)
        if known is None:
            obj = self._printer.lookup_object(name, None)
            if not hasattr(obj, "get_status"):
                raise KeyError(name)
            known = self._known[name] = _copy_plain(obj.get_status(self._eventtime))
        return known

    def __contains__(self, name):
        try:
            self[name]
        except KeyError:
            return False
        return True

    def __iter__(self):
        for name, _ in self._printer.lookup_objects():
            if name in self:
                yield name


def _copy_plain(value):
    """A copy that a template may keep and change; tuples stay what they are."""
    if isinstance(value, dict):
        return {key: _copy_plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_copy_plain(item) for item in value]
    return value


class Template:
    """A compiled template that gives G-code."""

    def __init__(self, owner, env, name, text):
        self.owner, self.name = owner, name
        self.printer, self.gcode = owner.printer, owner.gcode
        try:
            self.template = env.from_string(text)
        except jinja2.TemplateSyntaxError as err:
            lines = text.split("\n")
            shown = lines[err.lineno - 1].strip() if err.lineno <= len(lines) else ""
            raise self.printer.config_error(
                "Error in the template of %s, line %d: %s: '%s'"
                % (name, err.lineno, err.message, shown))

    def create_template_context(self, eventtime=None):
        """What every template can use, beside a macro's own variables."""
        return self.owner.create_template_context(eventtime)

    def render(self, context=None):
        """The G-code, blanks at both ends removed.  Raises CommandError."""
        if context is None:
            context = self.create_template_context()
        try:
            return str(self.template.render(context)).strip()
        except self.gcode.error:
            raise
        except TEMPLATE_ERRORS as err:
            raise self.gcode.error("Error evaluating %s%s: %s: %s" % (
                self.name, _find_template_line(err), type(err).__name__, err))

    def run_gcode_from_command(self, context=None):
        """Run the G-code within the command that runs now."""
        self.gcode.run_script_from_command(self.render(context))


def _find_template_line(err):
    """", line N" of the template that raised err."""
    number, traceback = 0, err.__traceback__
    while traceback is not None:
        if traceback.tb_frame.f_code.co_filename in ("<template>", "<unknown>"):
            number = traceback.tb_lineno
        traceback = traceback.tb_next
    return ", line %d" % (number,) if number else ""


class PrinterGCodeMacro:
    """Object `gcode_macro`: the template environment of all who need one."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.gcode = self.printer.lookup_object("gcode")
        self.env = jinja2.Environment(
            block_start_string="{%", block_end_string="%}",
            variable_start_string="{", variable_end_string="}",
            comment_start_string="{#", comment_end_string="#}",
            trim_blocks=False, extensions=["jinja2.ext.do"])

    def load_template(self, config, option, default=None):
        """Compile the template of an option.  Raises ConfigError."""
        name = "[%s] option '%s'" % (config.get_name(), option)
        text = (config.get(option) if default is None
                else config.get(option, default))
        return Template(self, self.env, name, text)

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
        self.template = printer.load_object(config, "gcode_macro").load_template(
            config, "gcode")
        self.gcode = printer.lookup_object("gcode")
        self.rename_existing = config.get("rename_existing", None)
        self.cmd_desc = config.get("description", "G-Code macro")
        self.variables = _read_variables(config)
        self.is_running = False
        self._register(config)

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
        self.printer.register_event_handler("klippy:connect", self._rename)

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
