# SPDX-License-Identifier: GPL-3.0-or-later
"""[display_template name]: a text made of the printer's state, for panels and lights.

param_x options are what a template can be told; their values are Python literals.
"""
from klippy.extras.gcode_macro import parse_literal

PREFIX = "param_"


class DisplayTemplate:
    """A named template with parameters."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.name = config.get_name().split()[-1]
        self.params = {}
        for option in config.get_prefix_options(PREFIX):
            try:
                self.params[option] = parse_literal(config.get(option))
            except ValueError as err:
                raise config.error("Option '%s' in section '%s': %s"
                                   % (option, config.get_name(), err)) from err
        macros = self.printer.load_object(config, "gcode_macro")
        self.template = macros.load_template(config, "text")

    def get_params(self):
        """{param_x: default}."""
        return self.params

    def read_params(self, gcmd):
        """{param_x: value} of the PARAM_X=... of a command.  Raises CommandError."""
        values = {}
        for key, text in gcmd.get_command_parameters().items():
            name = key.lower()
            if not name.startswith(PREFIX):
                continue
            if name not in self.params:
                raise gcmd.error("display_template '%s' has no %s: known are %s" % (
                    self.name, name, ", ".join(sorted(self.params)) or "none"))
            try:
                values[name] = parse_literal(text)
            except ValueError as err:
                raise gcmd.error("%s=%s: %s" % (name, text, err)) from err
        return values

    def render(self, context, **params):
        """The text; params replace defaults.  Raises CommandError."""
        return self.template.render({**context, **self.params, **params})


def lookup_template(printer, gcmd, name):
    """The template of that name.  Raises CommandError that lists those there are."""
    found = printer.lookup_object("display_template " + name, None)
    if found is None:
        names = [key.split(None, 1)[1]
                 for key, _ in printer.lookup_objects("display_template")]
        raise gcmd.error("There is no [display_template %s]: known are %s"
                         % (name, ", ".join(sorted(names)) or "none"))
    return found


def load_config_prefix(config):
    return DisplayTemplate(config)
