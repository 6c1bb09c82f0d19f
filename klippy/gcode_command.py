# SPDX-License-Identifier: GPL-3.0-or-later
"""One G-code command: its text, its parameters and the way to answer it."""

import math
import re

from klippy.errors import CommandError

REQUIRED = object()         # default of a parameter that must be given

_CLASSIC_NAME = re.compile(r"[A-Z]\d+(\.\d+)?\Z")
_CLASSIC_WORD = re.compile(r"([A-Za-z])([^A-Za-z(;]*)|\([^)]*\)?|;.*")
_TOKEN = re.compile(r"""\s*+(?:
    (?P<end>\Z|[;\#].*)
  | (?P<comment>\([^)]*+\)?)
  | (?P<key>[^\s='"();\#]++)=
    (?P<value>(?:"(?:\\.|[^"\\])*+"|'[^']*+'|\\.|[^\s;"'\\])*+)(?=[\s;]|\Z)
)""", re.VERBOSE | re.DOTALL)
_QUOTING = re.compile(r""""((?:\\.|[^"\\])*)"|'([^']*)'|\\(.)""", re.DOTALL)
_ESCAPE = re.compile(r'\\(["\\])')


# Longest text that an error quotes in full
MAX_QUOTED = 160


def shorten(text):
    """Text of an error's size: what is far too long is cut in the middle, and
    what would steer a terminal is written as an escape."""
    text = str(text)
    if len(text) <= MAX_QUOTED:
        escaped = _escape(text)
        if len(escaped) <= MAX_QUOTED:
            return escaped
    half = MAX_QUOTED // 2
    return "%s ... (%d characters) ... %s" % (
        _escape(text[:half])[:half], len(text), _escape(text[-half:])[-half:])


def _escape(text):
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() else
                   char.encode("unicode_escape").decode("ascii") for char in text)


class Coord(tuple):
    """Immutable position of at least four axes: x, y, z, e and further ones.

    Coord(x, y, z, e), Coord(x=.., y=..) and Coord(sequence); what is not
    given is None.
    """
    __slots__ = ()

    def __new__(cls, *axes, **named):
        if len(axes) == 1 and not isinstance(axes[0], (int, float, type(None))):
            axes = tuple(axes[0])
        values = list(axes) + [None] * (4 - len(axes))
        for index, name in enumerate("xyze"):
            if name in named:
                values[index] = named.pop(name)
        if named:
            raise TypeError("a Coord has no axis %s" % ", ".join(sorted(named)))
        return tuple.__new__(cls, values)

    x = property(lambda self: self[0])
    y = property(lambda self: self[1])
    z = property(lambda self: self[2])
    e = property(lambda self: self[3])

    def __getnewargs__(self):
        return (tuple(self),)

    def __repr__(self):
        return "Coord%s" % (tuple(self),)


def is_classic(name):
    """True for a letter and a number, like G1, M204 or G28.1."""
    return _CLASSIC_NAME.match(name.upper()) is not None


def parse_classic(text, line):
    """Words of a letter and a value: {'X': '10', 'Y': ''}.

    text: the line behind the command.  Raises CommandError for text before
    the first letter and for exponents.
    """
    params, position, previous = {}, 0, None
    for match in _CLASSIC_WORD.finditer(text):
        if text[position:match.start()].strip():
            break
        letter, glued = match.group(1), position == match.start()
        position = match.end()
        if letter is None:
            continue
        if glued and _is_exponent(previous, letter, match.group(2)):
            raise CommandError(
                "A number of '%s' has an exponent: write it in digits"
                % (shorten(line),))
        params[letter.upper()] = match.group(2).strip()
        previous = match
    if text[position:].strip():
        raise CommandError(
            "Malformed command '%s': '%s' is not a letter with a number"
            % (shorten(line), shorten(text[position:].strip())))
    return params


def _is_exponent(previous, letter, value):
    """Whether e or E after a number, in the other case than its word's letter,
    starts an exponent."""
    return (letter in "eE" and value.strip() and previous is not None
            and previous.group(2)[-1:].isdigit()
            and previous.group(1).islower() != letter.islower())


def parse_extended(text, line):
    """KEY=VALUE parameters, values quoted or not: {'KEY': 'VALUE'}.

    text: the line behind the command.  `;` outside quotes, and `#` or `(` where
    a key would start, begin a comment.  Raises CommandError otherwise.
    """
    params, position = {}, 0
    while True:
        match = _TOKEN.match(text, position)
        if match is None:
            raise CommandError(
                "Malformed command '%s': expected KEY=VALUE at '%s'"
                % (shorten(line), shorten(text[position:].strip())))
        if match.group("end") is not None:
            return params
        position = match.end()
        if match.group("key") is not None:
            params[match.group("key").upper()] = _unquote(match.group("value"))


def _unquote(value):
    if '"' not in value and "'" not in value and "\\" not in value:
        return value
    return _QUOTING.sub(_unquote_piece, value)


def _unquote_piece(match):
    double, single, escaped = match.groups()
    if double is not None:
        return _ESCAPE.sub(r"\1", double)
    return escaped if single is None else single


def _parse_finite(text):
    value = float(text)
    if not math.isfinite(value) or "_" in str(text):
        raise ValueError(text)
    return value


def _parse_int(text):
    if "_" in str(text):
        raise ValueError(text)
    return int(text)


class GCodeCommand:
    """A command on its way to its handler.

    Parameters are parsed when they are first asked for, in the form of the
    command: letters with numbers, or KEY=VALUE.
    """
    error = CommandError

    def __init__(self, gcode, command, commandline, params=None, need_ack=False,
                 raw_start=None):
        self._gcode = gcode
        self._command = command
        self._commandline = commandline
        self._params = params
        self._need_ack = need_ack
        self._raw_start = raw_start
        self.respond_info = gcode.respond_info
        self.respond_raw = gcode.respond_raw

    def get_command(self):
        """Name in upper case."""
        return self._command

    def get_commandline(self):
        """The line as written, without line number and checksum."""
        return self._commandline

    def get_command_parameters(self):
        """All parameters: dict of str by upper-case name."""
        if self._params is None:
            text = self._commandline[self._find_raw_start():]
            parse = parse_classic if is_classic(self._command) else parse_extended
            self._params = parse(text, self._commandline)
        return self._params

    def _find_raw_start(self):
        if self._raw_start is None:
            match = re.match(r"\s*\S*", self._commandline)
            self._raw_start = match.end()
            if self._commandline.strip().upper().startswith(self._command):
                blanks = len(self._commandline) - len(self._commandline.lstrip())
                self._raw_start = blanks + len(self._command)
        return self._raw_start

    def get_raw_command_parameters(self):
        """Text behind the command, as written, without a `;` comment."""
        text = self._commandline[self._find_raw_start():]
        return _cut_comment(text).strip()

    def ack(self, msg=None):
        """Answer ok (with msg) if the sender waits for it; True if it did."""
        if not self._need_ack:
            return False
        self._gcode.respond_raw("ok %s" % (msg,) if msg else "ok")
        self._need_ack = False
        return True

    def get(self, name, default=REQUIRED, parser=str, minval=None, maxval=None,
            above=None, below=None):
        """One parameter, parsed and checked.

        Raises CommandError if it is missing (without default), cannot be
        parsed or is out of range.
        """
        text = self.get_command_parameters().get(name)
        if text is None:
            if default is REQUIRED:
                raise self.error("Error on '%s': %s is missing"
                                 % (shorten(self._commandline), name))
            return default
        try:
            value = parser(text)
        except (ValueError, TypeError, OverflowError):
            raise self.error(
                "Error on '%s': unable to parse %s='%s': %s expected"
                % (shorten(self._commandline), name, shorten(text),
                   _KINDS.get(parser, "another value")))
        self._check_range(name, value, minval, maxval, above, below)
        return value

    def _check_range(self, name, value, minval, maxval, above, below):
        if minval is not None and value < minval:
            wanted = "at least %s" % (minval,)
        elif maxval is not None and value > maxval:
            wanted = "at most %s" % (maxval,)
        elif above is not None and value <= above:
            wanted = "above %s" % (above,)
        elif below is not None and value >= below:
            wanted = "below %s" % (below,)
        else:
            return
        raise self.error("Error on '%s': %s is %s, it must be %s"
                         % (shorten(self._commandline), name, value, wanted))

    def get_int(self, name, default=REQUIRED, minval=None, maxval=None):
        """A whole number; see get()."""
        return self.get(name, default, _parse_int, minval, maxval)

    def get_float(self, name, default=REQUIRED, minval=None, maxval=None,
                  above=None, below=None):
        """A finite number; see get()."""
        return self.get(name, default, _parse_finite, minval, maxval, above, below)


_KINDS = {_parse_int: "a whole number", _parse_finite: "a finite number",
          int: "a whole number", float: "a number"}


def _cut_comment(text):
    """Text up to the first `;` outside quotes."""
    quote = ""
    for index, char in enumerate(text):
        if quote:
            if char == quote:
                quote = ""
        elif char == ";":
            return text[:index]
        elif char in "\"'" and char in text[index + 1:]:
            quote = char
    return text
