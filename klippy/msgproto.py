# SPDX-License-Identifier: GPL-3.0-or-later
"""The dictionary of one mcu, and messages to and from bytes with it.

Thread safe for reading once process_identify() is done.
"""

import json
import logging
import zlib

from klippy.msgformat import (
    MessageFormat,
    OutputFormat,
    error,
    get_int,
)
from klippy_ext import msgblock

# What is known before there is a dictionary
IDENTIFY_MESSAGES = {
    "identify_response offset=%u data=%.*s": 0,
    "identify offset=%u count=%c": 1}
REQUIRED_KEYS = ("commands", "responses", "config")
# Bytes of the values that a field may have
FIELD_SIZES = {"%c": 1, "%hu": 2, "%hi": 2, "%u": 4, "%i": 4}


class MissingError(error):
    """The firmware lacks something, or has something else of that name.

    kind: command, response, constant or enumeration.  reason: what the user is told
    (see klippy/mcu/features.py), None until somebody has found it out.
    """

    def __init__(self, message, kind, name, is_other=False):
        super().__init__(message)
        self.kind, self.name, self.is_other = kind, name, is_other
        self.reason = None

    def __str__(self):
        if self.reason is None:
            return super().__str__()
        return self.reason[:1].upper() + self.reason[1:]

    def describe(self):
        """Text: what is missing."""
        return "the %s '%s'" % (self.kind, self.name)


class UnknownNameError(error):
    """A field has a name that its enumeration does not have."""


def load_dictionary(data, is_compressed):
    """The dictionary in data (bytes) as a dict.

    Raises error that says in which way the data is bad.
    """
    if is_compressed:
        try:
            data = zlib.decompress(data)
        except zlib.error as err:
            raise error("The dictionary of the firmware (%d bytes) cannot be"
                        " decompressed: %s" % (len(data), err))
    try:
        table = json.loads(data)
    except ValueError as err:
        raise error("The dictionary is not valid JSON: %s" % (err,))
    if not isinstance(table, dict):
        raise error("The dictionary must be a JSON object, not %s"
                    % (type(table).__name__,))
    missing = [k for k in REQUIRED_KEYS if not isinstance(table.get(k), dict)]
    if missing:
        raise error("The dictionary lacks its table%s %s: is it a klipper.dict?"
                    % ("s" if len(missing) > 1 else "", ", ".join(missing)))
    return table


def expand_enumeration(values):
    """Names to numbers, with ranges like {"gpio0": [0, 256]} spelled out."""
    result = {}
    for name, value in values.items():
        if not isinstance(value, list):
            result[name] = value
            continue
        first, count = value
        stem = name.rstrip("0123456789")
        number = int(name[len(stem):] or 0)
        for i in range(count):
            result["%s%d" % (stem, number + i)] = first + i
    return result


def is_number(text):
    """True for the text of a whole number."""
    return text.lstrip("-")[:1].isdigit()


def serves(message, wanted, is_command):
    """True if a message of the dictionary does for the one that the host wants.

    A command must have the same fields, none of them smaller: integers of all sizes
    are sent alike.  A response may have more fields, in any order.
    """
    if is_command:
        return message.fields == wanted.fields and all(
            FIELD_SIZES.get(has, 0) >= FIELD_SIZES.get(needs, 0)
            and (has in FIELD_SIZES) == (needs in FIELD_SIZES)
            for has, needs in zip(message.codes, wanted.codes, strict=True))
    codes = dict(zip(message.fields, message.codes, strict=True))
    return all(field in codes and (codes[field] in FIELD_SIZES) == (code in FIELD_SIZES)
               for field, code in zip(wanted.fields, wanted.codes, strict=True))


def check_name(command, field, name, enum):
    """Raise an error if a field cannot have a name; enum: those it has, or None."""
    if enum is None:
        raise MissingError("Field '%s' of command '%s' has no names in this firmware"
                           % (field, command), "enumeration", field)
    if not (field == "pin" or field.endswith("_pin")) and name not in enum:
        raise UnknownNameError("'%s' is no %s that the firmware knows: it has %s" % (
            name, field, ", ".join(sorted(enum)) or "none"))


def take_payload(block):
    """What a whole block carries."""
    return bytes(block)[2:len(block) - 3]


class MessageParser:
    """Formats, enumerations and constants of one mcu's firmware."""

    error = error

    def __init__(self, warn_prefix=""):
        self.warn_prefix = warn_prefix
        self.messages_by_name = {}
        self.messages_by_format = {}
        self.messages_by_id = {}
        self.command_names = set()
        self._enumerations = {}
        self._constants = {}
        self._raw_data = b""
        self.version = self.build_versions = self.app = self.license = ""
        self._add_messages(IDENTIFY_MESSAGES)

    # Reading the dictionary

    def process_identify(self, data, decompress=True):
        """Take in a dictionary as the mcu or a file gives it (bytes).

        Raises error if it is damaged or not a dictionary.
        """
        try:
            self._take_tables(load_dictionary(data, decompress))
        except error as err:
            raise error(self.warn_prefix + str(err))
        except (AttributeError, LookupError, TypeError, ValueError) as err:
            raise error("%sThe dictionary of the firmware is damaged: %s"
                        % (self.warn_prefix, err))
        self._raw_data = data

    def _take_tables(self, table):
        self._constants = dict(table["config"])
        for name, values in table.get("enumerations", {}).items():
            self._enumerations[name] = expand_enumeration(values)
        self.version = str(table.get("version", ""))
        self.build_versions = str(table.get("build_versions", ""))
        self.app = str(table.get("app", ""))
        self.license = str(table.get("license", ""))
        self._add_messages(table["commands"])
        self._add_messages(table["responses"])
        for text, msgid in table.get("output", {}).items():
            self.messages_by_id[msgid] = OutputFormat(msgid, text)
        self.command_names = {text.split()[0] for text in table["commands"]}

    def fill_enumerations(self, enumerations):
        """Add names to the enumerations: {enumeration: {name: value}}."""
        for name, values in enumerations.items():
            known = self._enumerations.setdefault(name, {})
            for key, value in expand_enumeration(values).items():
                known[key] = value
        self._add_messages({m.msgformat: m.msgid
                            for m in list(self.messages_by_name.values())})

    def _add_messages(self, messages):
        for text, msgid in messages.items():
            if not isinstance(msgid, int):
                raise error("Message '%s' of the dictionary has the id '%s'"
                            % (text, msgid))
            message = MessageFormat(msgid, text, self._enumerations)
            self.messages_by_id[msgid] = message
            self.messages_by_name[message.name] = message
            self.messages_by_format[text] = message

    # Facts about the firmware

    def get_raw_data_dictionary(self):
        """The dictionary as it was read (bytes)."""
        return self._raw_data

    def get_messages(self):
        """All messages as a list of (id, kind, format)."""
        return [(m.msgid, self._kind(m), m.msgformat)
                for _, m in sorted(self.messages_by_id.items())]

    def _kind(self, message):
        if message.name == "#output":
            return "output"
        return "command" if message.name in self.command_names else "response"

    def get_version_info(self):
        """(version, build versions) of the firmware."""
        return self.version, self.build_versions

    def get_app_info(self):
        """(name, license) of the firmware."""
        return self.app, self.license

    def get_enumerations(self):
        """{enumeration: {name: value}}"""
        return {name: dict(values) for name, values in self._enumerations.items()}

    def get_enumeration(self, name):
        """{name: value} of one enumeration, empty if there is none."""
        return self._enumerations.get(name, {})

    def get_constants(self):
        """{name: value} of all constants."""
        return dict(self._constants)

    def get_constant(self, name, default=None, parser=str):
        """A constant, through parser; error if it is absent without default."""
        if name not in self._constants:
            if default is not None:
                return default
            raise MissingError("Firmware constant '%s' of %s not found"
                               % (name, self._describe()), "constant", name)
        value = self._constants[name]
        try:
            return parser(value)
        except (TypeError, ValueError):
            raise error("Firmware constant '%s' of %s has the unusable value '%s'"
                        % (name, self._describe(), value))

    def get_constant_float(self, name, default=None):
        """A constant as float."""
        return self.get_constant(name, default, float)

    def get_constant_int(self, name, default=None):
        """A constant as int."""
        return self.get_constant(name, default, int)

    def _describe(self):
        return "%sfirmware '%s'" % (self.warn_prefix, self.version or "unknown")

    # Looking up messages

    def lookup_command(self, msgformat):
        """The MessageFormat of a command or response of this format.

        One that differs will do if it takes, or has, all that this one does.
        Raises MissingError that tells a missing command from one that differs.
        """
        message = self.messages_by_format.get(msgformat)
        if message is not None:
            return message
        name = msgformat.split()[0]
        other = self.messages_by_name.get(name)
        if other is None:
            raise MissingError("Unknown command: '%s' is not in %s"
                               % (name, self._describe()), "command", name)
        is_command = name in self.command_names
        if serves(other, MessageFormat(0, msgformat, {}), is_command):
            return other
        raise MissingError(
            "Command format mismatch in %s: it has '%s' where the host needs '%s'"
            % (self._describe(), other.msgformat, msgformat),
            "command" if is_command else "response", name, True)

    def lookup_msgid(self, msgformat):
        """Number of a message."""
        return self.lookup_command(msgformat).msgid

    lookup_msgtag = lookup_msgid

    # Text and bytes

    def create_command(self, text):
        """Bytes of a command given as 'name field=value ...'.

        Values are numbers, names of the field's enumeration, or hex for bytes.
        """
        words = text.split()
        if not words:
            raise error("There is no command in '%s'" % (text,))
        return self._find_named(words[0]).parse_text(words[1:])

    def _find_named(self, name):
        message = self.messages_by_name.get(name)
        if message is None:
            import difflib
            near = difflib.get_close_matches(name, self.messages_by_name, 1)
            raise MissingError("Unknown command '%s' for %s%s" % (
                name, self._describe(),
                "; did you mean '%s'?" % (near[0],) if near else ""), "command", name)
        return message

    def check_text(self, text):
        """Check the form of a command as of create_command(), but for its pins.

        Raises MissingError, or UnknownNameError for a name of an enumeration.
        """
        words = text.split()
        message = self._find_named(words[0])
        given = dict(word.partition("=")[::2] for word in words[1:])
        if given.keys() != set(message.fields):
            raise MissingError("it has '%s' where the host needs '%s'" % (
                message.msgformat, text), "command", message.name, True)
        for field, code, enum in zip(message.fields, message.codes, message.enums,
                                     strict=True):
            if code in FIELD_SIZES and not is_number(given[field]):
                check_name(message.name, field, given[field], enum)

    def decode_message(self, data, pos, params):
        """Read one message at data[pos] into the dict params.

        '#name' is set too.  Returns the position behind it.
        """
        start = pos
        msgid, pos = get_int(data, pos)
        message = self.messages_by_id.get(msgid)
        if message is None:
            # where it ends is not known: it takes all the rest
            params["#name"], params["#msg"] = "#unknown", data[start:]
            return len(data)
        params["#name"] = message.name
        return message.decode(data, pos, params)

    def parse_payload(self, data):
        """All messages of a block's payload, as dicts with '#name'.

        What cannot be read is logged and dropped: a link may bring anything.
        """
        result = []
        pos = 0
        while pos < len(data):
            params = {}
            try:
                pos = self.decode_message(data, pos, params)
            except error as err:
                logging.warning("%sbad message dropped: %s", self.warn_prefix, err)
                break
            result.append(params)
        return result

    def parse(self, block):
        """The first message of a whole block."""
        params = {}
        self.decode_message(take_payload(block), 0, params)
        return params

    def format_params(self, params):
        """Text of a decoded message."""
        name = params["#name"]
        if name == "#unknown":
            return "#unknown %s" % (params["#msg"].hex(),)
        if name == "#output":
            return "#output %s" % (params["#msg"],)
        return self.messages_by_name[name].format_params(params)

    def dump_payload(self, data):
        """Text of each message of a payload."""
        return [self.format_params(params) for params in self.parse_payload(data)]

    def dump(self, block):
        """Text lines that describe a whole block."""
        return ["seq: %02x" % (block[1],)] + self.dump_payload(take_payload(block))

    def check_packet(self, data):
        """Size of the block at the start of data, 0: incomplete, < 0: skip."""
        return msgblock.check_block(bytes(data))

    def encode_msgblock(self, seq, cmd):
        """A block with the command bytes cmd."""
        return msgblock.make_block(bytes(cmd), seq)
