# SPDX-License-Identifier: GPL-3.0-or-later
"""Values that follow a [display_template]: rendered twice a second while in use.

One evaluator serves all users; equal templates with equal parameters are rendered
once.  One that fails is told about in the console and taken out of use.
"""
import logging

from klippy.errors import CommandError
from klippy.extras import display_template

PERIOD = 0.5            # s


class Binding:
    """A template, its parameters, and who wants the text."""

    def __init__(self, template, params, callback, flush):
        self.template, self.params = template, params
        self.callback, self.flush = callback, flush
        self.key = (template.name, repr(sorted(params.items())))
        self.last_text = None


class TemplateEvaluator:
    """Renders the templates in use and hands each text out when it changes."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.macros = printer.load_object(config, "gcode_macro")
        self.bindings = {}               # user -> Binding
        self.timer = self.reactor.register_timer(self._render)

    def set_template(self, gcmd, user, callback, flush=None):
        """Obey TEMPLATE=name PARAM_X=... of a command; an empty name ends it.

        user: any key; it has one template at a time.  callback(text) is called when
        the text changes and raises ValueError if it means nothing; flush() once
        after all callbacks.
        """
        name = gcmd.get("TEMPLATE")
        if not name:
            self.remove(user)
            return
        template = display_template.lookup_template(self.printer, gcmd, name)
        self.bindings[user] = Binding(template, template.read_params(gcmd),
                                      callback, flush)
        self.reactor.update_timer(self.timer, self.reactor.NOW)

    def remove(self, user):
        """End the template of a user, if it has one."""
        self.bindings.pop(user, None)

    def _render(self, eventtime):
        context = self.macros.create_template_context(eventtime)
        texts, flushes, failures = {}, [], {}
        for user, binding in list(self.bindings.items()):
            try:
                if self._update(binding, context, texts) and binding.flush:
                    flushes.append(binding.flush)
            except (CommandError, ValueError) as err:
                self.remove(user)
                failures[binding.template.name] = err
        self._tell(failures)
        for flush in dict.fromkeys(flushes):
            flush()
        return eventtime + PERIOD if self.bindings else self.reactor.NEVER

    def _update(self, binding, context, texts):
        """Hand a text out if it is new; True if so."""
        if binding.key not in texts:
            texts[binding.key] = binding.template.render(
                dict(context), **binding.params)
        text = texts[binding.key]
        if text == binding.last_text:
            return False
        binding.last_text = text
        binding.callback(text)
        return True

    def _tell(self, failures):
        """Say once why a template is not used any more."""
        for name, err in failures.items():
            message = "display_template '%s' is not used any more: %s" % (name, err)
            logging.warning("%s", message)
            self.printer.lookup_object("gcode").respond_raw("!! " + message)


def read_number(text, maximum):
    """The number of a template's text, held within 0..maximum.  Raises ValueError."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if value != value:
        raise ValueError("it gives '%s', not a number" % (text,))
    return min(max(value, 0.0), maximum)


def load_config(config):
    return TemplateEvaluator(config)
