# SPDX-License-Identifier: GPL-3.0-or-later
"""Jinja2 templates that give G-code, and what they see of the printer.

A template is evaluated as a whole before its first line runs, or, live, line
by line: then it sees what the lines before have done.
"""

# What an expression of a template can raise, beside jinja2.TemplateError
TEMPLATE_ERRORS = (
    ArithmeticError, LookupError, TypeError, ValueError, AttributeError,
    AssertionError, RecursionError, MemoryError)


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


class LiveStatus(StatusProxy):
    """`printer` of live templates: status as it is whenever it is read."""

    def __getitem__(self, name):
        self._known.clear()
        self._eventtime = self._printer.get_reactor().monotonic()
        return super().__getitem__(name)


def _copy_plain(value):
    """A copy that a template may keep and change; tuples stay what they are."""
    if isinstance(value, dict):
        return {key: _copy_plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_copy_plain(item) for item in value]
    return value


class Template:
    """A template that gives G-code.

    It is compiled when first needed, or at once when it is not known to be free
    of errors.  A text without braces is G-code as it is.
    """

    def __init__(self, owner, name, text):
        self.owner, self.name, self.text = owner, name, text
        self.printer, self.gcode = owner.printer, owner.gcode
        self.is_plain = "{" not in text
        self.template = None
        if not self.is_plain:
            if not owner.checked.is_known(text):
                self._compile()
            owner.checked.note(text)

    def _compile(self):
        env = self.owner.get_env()
        from jinja2 import TemplateSyntaxError
        try:
            self.template = env.from_string(self.text)
        except TemplateSyntaxError as err:
            lines = self.text.split("\n")
            shown = lines[err.lineno - 1].strip() if err.lineno <= len(lines) else ""
            raise self.printer.config_error(
                "Error in the template of %s, line %d: %s: '%s'"
                % (self.name, err.lineno, err.message, shown))

    def create_template_context(self, eventtime=None):
        """What every template can use, beside a macro's own variables."""
        return self.owner.create_template_context(eventtime)

    def render(self, context=None):
        """The G-code, blanks at both ends removed.  Raises CommandError."""
        if context is None:
            context = self.create_template_context()
        return "".join(self._generate(context)).strip()

    def _generate(self, context):
        """The pieces of G-code, as they are evaluated.  Raises CommandError."""
        if self.is_plain:
            yield self.text
            return
        if self.template is None:
            self._compile()
        from jinja2 import TemplateError
        pieces = self.template.generate(context)
        while True:
            try:
                piece = next(pieces)
            except StopIteration:
                return
            except self.gcode.error:
                raise
            except (TemplateError, *TEMPLATE_ERRORS) as err:
                raise self.gcode.error("Error evaluating %s%s: %s: %s" % (
                    self.name, _find_template_line(err), type(err).__name__, err))
            yield piece

    def run_gcode_from_command(self, context=None):
        """Run the G-code within the command that runs now."""
        self.gcode.run_script_from_command(self.render(context))

    def run_live_from_command(self, context):
        """Run each line before the next one is evaluated."""
        context = {**context, "printer": LiveStatus(self.printer)}
        rest = ""
        for piece in self._generate(context):
            *lines, rest = (rest + piece).split("\n")
            for line in lines:
                self.gcode.run_script_from_command(line)
        self.gcode.run_script_from_command(rest)


def _find_template_line(err):
    """", line N" of the template that raised err."""
    number, traceback = 0, err.__traceback__
    while traceback is not None:
        if traceback.tb_frame.f_code.co_filename in ("<template>", "<unknown>"):
            number = traceback.tb_lineno
        traceback = traceback.tb_next
    return ", line %d" % (number,) if number else ""
