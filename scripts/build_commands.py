# SPDX-License-Identifier: GPL-3.0-or-later
"""Collect the firmware's declarations into tables, headers and the dictionary.

Input: sources preprocessed with DECL_SCAN (see src/core/decl.h), one .decl file
each.  Output: <out>/decl/args.h, one header per source, <out>/decl/tables.c and
klipper.dict.  Files are rewritten only when their text changes.
"""

import argparse
import ast
import json
import operator
import os
import pathlib
import re
import subprocess
import sys
import zlib

RESERVED_IDS = {"identify_response offset=%u data=%.*s": 0,
                "identify offset=%u count=%c": 1}
# Messages that come once or seldom: their numbers may take two bytes
RARE = ("allocate_", "config_", "debug_read", "debug_write", "finalize_",
        "pong ", "query_", "sdio_")
FIRST_STRING_ID = 2
PAYLOAD_MAX = 59
RECORD = re.compile(r"@@DECL\s+(\w+)\s+@\|(.*?)@@END", re.S)
PARAM = re.compile(r"^(\w+)=(%\.\*s|%\*s|%c|%hu|%hi|%u|%i)$")
OUTPUT_PARAM = re.compile(r"%(?:\.\*s|\*s|c|hu|hi|u|i)")
PIN = re.compile(r"(^|_)pin$")
C_TYPES = {"%c": "uint8_t", "%hu": "uint16_t", "%hi": "int16_t",
           "%u": "uint32_t", "%i": "int32_t"}
SIZES = {"%c": 2, "%hu": 3, "%hi": 3, "%u": 5, "%i": 5}
OPERATORS = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod,
    ast.LShift: operator.lshift, ast.RShift: operator.rshift,
    ast.BitOr: operator.or_, ast.BitAnd: operator.and_,
    ast.USub: operator.neg, ast.UAdd: operator.pos,
}


class DeclError(Exception):
    """A declaration that cannot be used."""


def eval_text(text):
    """Value of one or more adjacent C string literals."""
    parts = re.findall(r'"(?:[^"\\]|\\.)*"', text)
    if not parts or re.sub(r'"(?:[^"\\]|\\.)*"|\s', "", text):
        raise DeclError("not a string literal: %s" % text)
    return "".join(ast.literal_eval(part) for part in parts)


def eval_node(node):
    if isinstance(node, ast.Constant) and isinstance(node.value, int):
        return node.value
    if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
        return OPERATORS[type(node.op)](eval_node(node.operand))
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        return OPERATORS[type(node.op)](eval_node(node.left),
                                        eval_node(node.right))
    raise DeclError("not a constant")


def eval_number(text):
    """Value of a C integer expression made of literals."""
    clean = re.sub(r"'(.)'", lambda m: str(ord(m.group(1))), text)
    clean = re.sub(r"\b(0[xX][0-9a-fA-F]+|\d+)[uUlL]+\b", r"\1", clean)
    try:
        return eval_node(ast.parse(clean.strip().replace("/", "//"),
                                   mode="eval").body)
    except (SyntaxError, DeclError):
        raise DeclError("value %r must be an expression of integer literals"
                        % text.strip())


class Message:
    """One format string: its name, parameters and generated C."""

    def __init__(self, fmt, is_output=False):
        self.fmt = fmt
        self.params = []
        if is_output:
            kinds = OUTPUT_PARAM.findall(fmt)
            self.params = [("arg%d" % i, k) for i, k in enumerate(kinds)]
            return
        self.name, *words = fmt.split()
        for word in words:
            match = PARAM.match(word)
            if not match:
                raise DeclError("bad parameter %r in message %r" % (word, fmt))
            self.params.append(match.groups())

    def max_size(self):
        size = 2 + sum(SIZES.get(kind, 1) for name, kind in self.params)
        if size > PAYLOAD_MAX:
            raise DeclError("message %r may exceed %d bytes"
                            % (self.fmt, PAYLOAD_MAX))
        return size

    def write_args(self):
        """The struct that a command handler receives."""
        lines = ["struct args_%s {" % self.name]
        for name, kind in self.params:
            if kind in C_TYPES:
                # A pin's number may exceed its format's nominal size.
                c_type = "uint32_t" if PIN.search(name) else C_TYPES[kind]
                lines.append("    COMMAND_ARG %s %s;" % (c_type, name))
            else:
                lines.append("    COMMAND_ARG uint8_t %s_len;" % name)
                lines.append("    COMMAND_ARG const uint8_t *%s;" % name)
        if not self.params:
            lines.append("    COMMAND_ARG uint8_t nothing;")
        return lines + ["};"]

    def mark_buffers(self):
        """Bit n is set if parameter n is a byte string."""
        return sum(1 << i for i, (_, kind) in enumerate(self.params)
                   if kind not in C_TYPES)

    def count_slots(self):
        return sum(1 if kind in C_TYPES else 2 for _, kind in self.params)

    def write_sender(self, counter, msg_id):
        """A typed function that encodes and sends this message."""
        args, size, puts = [], str(self.max_size()), []
        for name, kind in self.params:
            if kind in C_TYPES:
                args.append("%s %s" % (C_TYPES[kind], name))
                puts.append("command_put_int(p, (uint32_t)%s)" % name)
                continue
            rom = "ROM " if "." in kind else ""
            args += ["uint8_t %s_len" % name,
                     "const %suint8_t *%s" % (rom, name)]
            size = "decl_add_size(%s, %s_len)" % (size, name)
            puts.append("command_put_%s(p, %s_len, %s)"
                        % ("rom" if rom else "bytes", name, name))
        return (["static inline void decl_send_%d(%s)"
                 % (counter, ", ".join(args) or "void"),
                 "{",
                 "    uint8_t *start = command_begin(%s), *p = start;" % size,
                 "    if (!start)", "        return;"]
                + (["    *p++ = %d;" % msg_id] if msg_id < 96 else
                   ["    p = command_put_int(p, %d);" % msg_id])
                + ["    p = %s;" % put for put in puts]
                + ["    command_end(start, p);", "}"])


class Collector:
    """All declarations of one firmware."""

    def __init__(self):
        self.calls = {"init": [], "task": [], "shutdown": []}
        self.commands = {}
        self.responses = set()
        self.outputs = set()
        self.strings = set()
        self.constants = {}
        self.enumerations = {}
        self.initial_pins = []
        self.uses = []
        self.ids = {}
        self.string_ids = {}

    def read_source(self, path, text):
        """Take in the preprocessed text of one source."""
        uses = []
        for kind, body in RECORD.findall(text):
            fields = [field.strip() for field in body.split("@|")]
            try:
                getattr(self, "_take_" + kind, self._take_call)(
                    kind, fields, uses)
            except DeclError as e:
                raise DeclError("%s: %s" % (path, e))
        self.uses.append((path, uses))

    def _take_call(self, kind, fields, uses):
        self.calls[kind].append(fields[0])

    def _take_command(self, kind, fields, uses):
        func, flags, fmt = fields
        message = Message(eval_text(fmt))
        if any(m.name == message.name for _, _, m in self.commands.values()):
            raise DeclError("command %r declared twice" % message.name)
        self.commands[message.fmt] = (func, eval_number(flags), message)

    def _take_response(self, kind, fields, uses):
        fmt = eval_text(fields[1])
        self.responses.add(fmt)
        uses.append((int(fields[0]), "send", Message(fmt)))

    def _take_output(self, kind, fields, uses):
        fmt = eval_text(fields[1])
        self.outputs.add(fmt)
        uses.append((int(fields[0]), "send", Message(fmt, is_output=True)))

    def _take_string(self, kind, fields, uses):
        text = eval_text(fields[1])
        self.strings.add(text)
        uses.append((int(fields[0]), "string", text))

    def _take_constant(self, kind, fields, uses):
        self._set_constant(eval_text(fields[0]), eval_number(fields[1]))

    def _take_constant_str(self, kind, fields, uses):
        self._set_constant(eval_text(fields[0]), eval_text(fields[1]))

    def _set_constant(self, name, value):
        if self.constants.setdefault(name, value) != value:
            raise DeclError("constant %r is both %r and %r"
                            % (name, self.constants[name], value))

    def _take_enumeration(self, kind, fields, uses):
        enum, name = eval_text(fields[0]), eval_text(fields[1])
        value, count = eval_number(fields[2]), eval_number(fields[3])
        entries = self.enumerations.setdefault(enum, {})
        if name in entries:
            raise DeclError("enumeration %r names %r twice" % (enum, name))
        entries[name] = value if count == 1 else [value, count]

    def _take_initial_pins(self, kind, fields, uses):
        names = eval_text(fields[0]).replace(" ", "").split(",")
        self.initial_pins += [name for name in names if name]

    def assign_ids(self):
        """Number messages and strings; the most frequent get one byte."""
        fmts = sorted(self.commands) + sorted(self.responses)
        fmts.sort(key=lambda fmt: fmt.startswith(RARE))
        fmts += sorted(self.outputs)
        missing = set(RESERVED_IDS) - set(fmts)
        if missing:
            raise DeclError("the firmware lacks %s" % ", ".join(missing))
        self.ids = dict(RESERVED_IDS)
        for fmt in fmts:
            if fmt not in self.ids:
                self.ids[fmt] = len(self.ids)
        self.string_ids = {text: FIRST_STRING_ID + i
                           for i, text in enumerate(sorted(self.strings))}
        self.enumerations["static_string_id"] = self.string_ids

    def find_pin(self, name):
        """Number of a pin by its name in the `pin` enumeration."""
        pins = self.enumerations.get("pin", {})
        for first, value in pins.items():
            start, count = value if isinstance(value, list) else (value, 1)
            stem, digits = re.match(r"(.*?)(\d*)$", first).groups()
            match = re.match(r"(.*?)(\d*)$", name)
            if first == name:
                return start
            if match.group(1) == stem and digits and match.group(2):
                offset = int(match.group(2)) - int(digits)
                if 0 <= offset < count:
                    return start + offset
        raise DeclError("INITIAL_PINS names an unknown pin %r" % name)

    def write_dictionary(self, version, build_versions):
        """The JSON text that the host reads."""
        ids = self.ids
        return json.dumps({
            "app": "Klippy", "license": "GNU GPLv3", "version": version,
            "build_versions": build_versions,
            "commands": {f: ids[f] for f in sorted(self.commands)},
            "responses": {f: ids[f] for f in sorted(self.responses)},
            "output": {f: ids[f] for f in sorted(self.outputs)},
            "enumerations": self.enumerations,
            "config": self.constants,
        }, separators=(",", ":"), sort_keys=True)

    def write_args_header(self):
        lines = ["/* Generated. */", "#ifndef DECL_ARGS_H",
                 "#define DECL_ARGS_H", '#include "core/command.h"']
        slots = [m.count_slots() for _, _, m in self.commands.values()]
        lines.append("#define TABLES_MAX_SLOTS %d" % max(slots + [1]))
        lines.append("#define TABLES_MAX_ID %d" % max(self.ids.values()))
        lines += ["static inline uint8_t decl_add_size(uint8_t a, uint8_t b)",
                  "{", "    return a + b < 255 ? (uint8_t)(a + b) : 255;", "}"]
        for fmt in sorted(self.commands):
            func, _, message = self.commands[fmt]
            lines += message.write_args()
            lines.append("void %s(const struct args_%s *args);"
                         % (func, message.name))
        for func in sum(self.calls.values(), []):
            lines.append("void %s(void);" % func)
        return lines + ["#endif"]

    def write_source_header(self, uses):
        lines = ["/* Generated. */", '#include "decl/args.h"']
        for counter, kind, what in uses:
            if kind == "string":
                lines.append("enum { decl_string_%d = %d };"
                             % (counter, self.string_ids[what]))
            else:
                lines += what.write_sender(counter, self.ids[what.fmt])
        return lines

    def write_tables(self, dictionary):
        lines = ["/* Generated. */", "#include <stddef.h>",
                 '#include "core/tables.h"', '#include "decl/args.h"']
        for kind, funcs in self.calls.items():
            lines += ["void tables_run_%ss(void)" % kind, "{"]
            lines += ["    TABLES_CALL(%s);" % func for func in funcs] + ["}"]
        lines += self._write_commands() + self._write_messages()
        lines += self._write_initial_pins()
        packed = zlib.compress(dictionary.encode(), 9)
        lines.append("const ROM uint8_t tables_dictionary[] = {")
        lines += ["    " + "".join("%d," % b for b in packed[i:i + 24])
                  for i in range(0, len(packed), 24)]
        return lines + ["};", "const uint32_t tables_dictionary_size = %d;"
                        % len(packed)]

    def _write_commands(self):
        by_id = {self.ids[fmt]: fmt for fmt in self.commands}
        lines = ["const ROM struct command_entry tables_commands[] = {"]
        for msg_id in range(max(by_id) + 1):
            if msg_id not in by_id:
                lines.append("    { 0 },")
                continue
            func, flags, message = self.commands[by_id[msg_id]]
            lines.append("    { TABLES_HANDLER(%s), %d, %d, TABLES_FLAGS(%d) },"
                         % (func, message.mark_buffers(), len(message.params),
                            flags))
        return lines + ["};", "const uint16_t tables_command_count = %d;"
                        % (max(by_id) + 1)]

    def _write_messages(self):
        sent = {self.ids[what.fmt]: what for _, uses in self.uses
                for _, kind, what in uses if kind == "send"}
        lines = ["const ROM struct message_entry tables_messages[] = {"]
        lines += ["    { %d, %d }," % (sent[i].mark_buffers(),
                                       len(sent[i].params))
                  if i in sent else "    { 0, 0 },"
                  for i in range(max(self.ids.values()) + 1)]
        return lines + ["};"]

    def _write_initial_pins(self):
        rows = ["    { %d, %d }," % (self.find_pin(name.lstrip("!")),
                                     not name.startswith("!"))
                for name in self.initial_pins]
        return (["const ROM struct initial_pin tables_initial_pins[] = {"]
                + (rows or ["    { 0, 0 },"])
                + ["};", "const uint8_t tables_initial_pin_count = %d;"
                   % len(rows)])


def write_if_changed(path, text):
    """Write a file unless it already says just that."""
    if path.exists() and path.read_text() == text:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def run_tool(args):
    """First line that a tool prints, empty if it cannot be run."""
    try:
        result = subprocess.run(args, capture_output=True, text=True,
                                check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return result.stdout.split("\n")[0].strip()


def read_version(root):
    """Version of the sources: as told, from git, or from the VERSION file."""
    told = os.environ.get("KLIPPY_FIRMWARE_VERSION")
    if told:
        return told
    base = (root / "VERSION").read_text().strip()
    commit = run_tool(["git", "-C", str(root), "describe", "--always",
                       "--dirty", "--abbrev=8", "--match=v*"])
    if not commit:
        return "v%s" % base
    return commit if commit.startswith("v") else "v%s-g%s" % (base, commit)


def parse_options(argv):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--tools", default="", help="cc;ld;objcopy to name")
    parser.add_argument("scans", nargs="+", type=pathlib.Path)
    return parser.parse_args(argv)


def main(argv):
    """Run the collection; exit status 1 and a message on a bad declaration."""
    options = parse_options(argv)
    out = options.out
    root = pathlib.Path(__file__).resolve().parent.parent
    collector = Collector()
    try:
        for path in options.scans:
            name = path.relative_to(out).with_suffix("")
            collector.read_source(str(name), path.read_text())
        collector.assign_ids()
        tools = [run_tool([t, "--version"]) for t in options.tools.split(";")]
        text = collector.write_dictionary(
            read_version(root), "; ".join(t for t in tools if t))
        tables = collector.write_tables(text)
    except DeclError as e:
        sys.exit("build_commands: %s" % e)
    files = {"decl/args.h": collector.write_args_header(),
             "decl/tables.c": tables, "klipper.dict": [text]}
    for name, uses in collector.uses:
        files["decl/%s.h" % name] = collector.write_source_header(uses)
    for name, lines in files.items():
        write_if_changed(out / name, "\n".join(lines) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
