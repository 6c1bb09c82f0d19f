# SPDX-License-Identifier: GPL-3.0-or-later
"""One kind of wire message: its fields, and its bytes both ways.

See docs/internals/protocol.md for the encoding.  Values of unsigned fields
are 0..2^32-1, of signed ones -2^31..2^31-1; %s kinds are bytes.
"""

import re

from klippy.errors import McuError

FIELD_SIGNED, FIELD_UNSIGNED, FIELD_BYTES = 0, 1, 2
FIELD_KINDS = {
    "%u": FIELD_UNSIGNED, "%i": FIELD_SIGNED, "%hu": FIELD_UNSIGNED,
    "%hi": FIELD_SIGNED, "%c": FIELD_UNSIGNED, "%s": FIELD_BYTES,
    "%.*s": FIELD_BYTES, "%*s": FIELD_BYTES}
FIELD_RANGES = {
    # the texts of commands have clocks of 64 bits; their low 32 are sent
    "%u": (-0x80000000, 0x3fffffffffffffff), "%i": (-0x80000000, 0xffffffff),
    "%hu": (0, 0xffff), "%hi": (-0x8000, 0x7fff),
    # negative: as in invert_step=-1, sent like any other integer
    "%c": (-0x80, 0xff)}
OUTPUT_CODE = re.compile(r"%(?:\.\*s|\*s|hu|hi|[uics%])?")


class error(McuError):
    """A message or dictionary does not follow the wire protocol."""


def put_int(out, value):
    """Append the variable length encoding of a 32 bit integer to a bytearray."""
    value = ((value + 0x80000000) & 0xffffffff) - 0x80000000
    shift = 0
    while shift < 28 and not -(32 << shift) <= value < (96 << shift):
        shift += 7
    while shift:
        out.append(((value >> shift) & 0x7f) | 0x80)
        shift -= 7
    out.append(value & 0x7f)


def get_int(data, pos):
    """Read an integer at data[pos]; returns (signed value, next position)."""
    size = len(data)
    if pos >= size:
        raise error("Message is cut short at byte %d: %s" % (pos, data.hex()))
    byte = data[pos]
    value = byte & 0x7f
    if byte & 0x60 == 0x60:
        value -= 0x80
    pos += 1
    while byte & 0x80:
        if pos >= size:
            raise error("Message is cut short at byte %d: %s" % (pos, data.hex()))
        byte = data[pos]
        value = (value << 7) | (byte & 0x7f)
        pos += 1
    return ((value + 0x80000000) & 0xffffffff) - 0x80000000, pos


def take_bytes(data, pos, count):
    """count bytes at data[pos].  Raises error if there are not so many."""
    if not 0 <= count <= len(data) - pos:
        raise error("Message is cut short: it has %d bytes, not %d, from byte %d: %s"
                    % (len(data) - pos, count, pos, data.hex()))
    return data[pos:pos + count]


class MessageFormat:
    """A command or response of the dictionary.

    name, msgformat, msgid; fields are the names in order.
    """

    def __init__(self, msgid, msgformat, enumerations):
        words = msgformat.split()
        if not words:
            raise error("The dictionary has a message without a name")
        self.msgid, self.msgformat, self.name = msgid, msgformat, words[0]
        self.fields, self.kinds, self.codes, self.enums = [], [], [], []
        self.has_enums = False
        for word in words[1:]:
            field, _, code = word.partition("=")
            if code not in FIELD_KINDS:
                raise error("Message '%s' has a field '%s' of unknown type '%s'"
                            % (self.name, field, code))
            self.fields.append(field)
            self.codes.append(code)
            self.kinds.append(FIELD_KINDS[code])
            enum = find_enumeration(field, enumerations)
            self.enums.append(enum)
            self.has_enums = self.has_enums or enum is not None
        self._header = bytearray()
        put_int(self._header, msgid)

    def encode(self, params):
        """Bytes of the message with the values of all fields, in order."""
        if len(params) != len(self.kinds):
            raise error("Command '%s' takes %d values (%s), not %d"
                        % (self.name, len(self.kinds), self.msgformat, len(params)))
        out = bytearray(self._header)
        for i in range(len(self.kinds)):
            if self.kinds[i] == FIELD_BYTES:
                value = bytes(params[i])
                out.append(len(value))
                out += value
            else:
                put_int(out, int(params[i]))
        return bytes(out)

    def encode_by_name(self, **params):
        """Bytes of the message with its fields given by name."""
        if params.keys() != set(self.fields):
            raise error("Command '%s' takes the fields %s, not %s" % (
                self.name, ", ".join(self.fields) or "none",
                ", ".join(sorted(params)) or "none"))
        return self.encode([params[f] for f in self.fields])

    def parse_text(self, words):
        """Bytes of the message from words of the form 'field=value'."""
        given = dict(word.partition("=")[::2] for word in words)
        if len(given) != len(words) or given.keys() != set(self.fields):
            raise error("'%s' does not have the fields of '%s'" % (
                " ".join([self.name] + list(words)), self.msgformat))
        return self.encode([self._read_value(i, given[f])
                            for i, f in enumerate(self.fields)])

    def _read_value(self, i, text):
        """Value of field i from its text: a number, an enumerated name, hex."""
        enum = self.enums[i]
        if enum is not None and text in enum:
            return enum[text]
        if self.kinds[i] == FIELD_BYTES:
            try:
                return bytes.fromhex(text)
            except ValueError:
                raise error("Field '%s' of command '%s' must be hexadecimal, not '%s'"
                            % (self.fields[i], self.name, text))
        try:
            value = int(text, 0)
        except ValueError:
            known = "a name of its enumeration" if enum is not None else "a number"
            raise error("Field '%s' of command '%s' must be %s, not '%s'"
                        % (self.fields[i], self.name, known, text))
        low, high = FIELD_RANGES[self.codes[i]]
        if not low <= value <= high:
            raise error("Field '%s' of command '%s' must be from %d to %d, not %d"
                        % (self.fields[i], self.name, low, high, value))
        return value

    def decode(self, data, pos, params):
        """Put the fields at data[pos] into the dict params; returns the end."""
        for i in range(len(self.kinds)):
            value, pos = get_int(data, pos)
            kind = self.kinds[i]
            if kind == FIELD_BYTES:
                params[self.fields[i]] = take_bytes(data, pos, value)
                pos += value
            elif kind == FIELD_UNSIGNED:
                params[self.fields[i]] = value & 0xffffffff
            else:
                params[self.fields[i]] = value
        if self.has_enums:
            self._name_values(params)
        return pos

    def _name_values(self, params):
        """Replace enumerated values by their names."""
        for field, enum in zip(self.fields, self.enums, strict=True):
            if enum is not None and field in params:
                value = params[field]
                names = [n for n, v in enum.items() if v == value]
                params[field] = names[0] if names else "?%s" % (value,)

    def format_params(self, params):
        """The message as text, from a dict of its fields."""
        return " ".join([self.name] + [
            "%s=%s" % (f, format_value(params[f])) for f in self.fields])


class OutputFormat:
    """A debug message of the firmware: printf text with values."""

    def __init__(self, msgid, msgformat):
        self.msgid, self.msgformat, self.name = msgid, msgformat, "#output"
        self.kinds = [FIELD_KINDS[code] for code in OUTPUT_CODE.findall(msgformat)
                      if code in FIELD_KINDS]
        self.text = OUTPUT_CODE.sub(
            lambda m: "%s" if m[0] in FIELD_KINDS else "%%", msgformat)

    def decode(self, data, pos, params):
        """As MessageFormat.decode(); the text goes to '#msg'."""
        values = []
        for kind in self.kinds:
            value, pos = get_int(data, pos)
            if kind == FIELD_BYTES:
                values.append(take_bytes(data, pos, value).hex())
                pos += value
            else:
                values.append(value & 0xffffffff if kind else value)
        params["#msg"] = self.text % tuple(values)
        return pos

    def format_params(self, params):
        """The message as text."""
        return "#output %s" % (params["#msg"],)


def format_value(value):
    """Text of a field: numbers as they are, bytes as hex."""
    return value.hex() if isinstance(value, bytes) else str(value)


def find_enumeration(field, enumerations):
    """The enumeration a field takes its names from, by the field's last word."""
    if field in enumerations:
        return enumerations[field]
    for name, values in enumerations.items():
        if field.endswith("_" + name):
            return values
    return None
