# SPDX-License-Identifier: GPL-3.0-or-later
"""Assemble a program of the PIO blocks of an RP2040 into a header of its words.

    python scripts/pio_assemble.py src/rp2040/can.pio src/rp2040/can_program.h

Knows jmp, wait, in, out, push, pull, mov, set, delays, labels, and the
directives .program, .wrap_target and .wrap; no side-set.  Each program fits at
address 0 only.  Source: RP2040 data sheet, 3.3 and 3.4.
"""

import pathlib
import re
import sys

CONDITIONS = {"": 0, "!x": 1, "x--": 2, "!y": 3, "y--": 4, "x!=y": 5, "pin": 6,
              "!osre": 7}
WAIT_SOURCES = {"gpio": 0, "pin": 1, "irq": 2}
IN_SOURCES = {"pins": 0, "x": 1, "y": 2, "null": 3, "isr": 6, "osr": 7}
OUT_TARGETS = {"pins": 0, "x": 1, "y": 2, "null": 3, "pindirs": 4, "pc": 5,
               "isr": 6, "exec": 7}
MOV_TARGETS = {"pins": 0, "x": 1, "y": 2, "exec": 4, "pc": 5, "isr": 6, "osr": 7}
MOV_SOURCES = {"pins": 0, "x": 1, "y": 2, "null": 3, "status": 5, "isr": 6,
               "osr": 7}
SET_TARGETS = {"pins": 0, "x": 1, "y": 2, "pindirs": 4}
MAX_WORDS = 32


class AssembleError(Exception):
    """A line that cannot be assembled."""


def find(table, name, line):
    if name not in table:
        raise AssembleError("%r: %r is none of %s" % (line, name, ", ".join(table)))
    return table[name]


def read_number(text, limit, line):
    number = int(text, 0)
    if not 0 <= number < limit:
        raise AssembleError("%r: %d is not below %d" % (line, number, limit))
    return number


def encode_queue(words, line, is_pull):
    """push [iffull] [block|noblock], pull [ifempty] [block|noblock]."""
    conditional = "ifempty" if is_pull else "iffull"
    if any(w not in (conditional, "block", "noblock") for w in words):
        raise AssembleError("%r: what is asked of the queue?" % (line,))
    return (0x8000 | is_pull << 7 | (conditional in words) << 6
            | ("noblock" not in words) << 5)


def encode_mov(words, line):
    source, op = words[1], 0
    if source[0] in "!~":
        source, op = source[1:], 1
    elif source.startswith("::"):
        source, op = source[2:], 2
    return (0xA000 | find(MOV_TARGETS, words[0], line) << 5 | op << 3
            | find(MOV_SOURCES, source, line))


def encode(line, labels):
    """Word of an instruction, without its delay."""
    name, *words = line.replace(",", " ").split()
    if name == "jmp":
        condition = words[0] if len(words) == 2 else ""
        return find(CONDITIONS, condition, line) << 5 | find(labels, words[-1], line)
    if name == "wait":
        return (0x2000 | read_number(words[0], 2, line) << 7
                | find(WAIT_SOURCES, words[1], line) << 5
                | read_number(words[2], 32, line))
    if name in ("in", "out"):
        table, code = (IN_SOURCES, 0x4000) if name == "in" else (OUT_TARGETS, 0x6000)
        count = read_number(words[1], 33, line)
        return code | find(table, words[0], line) << 5 | count & 31
    if name in ("push", "pull"):
        return encode_queue(words, line, name == "pull")
    if name == "mov":
        return encode_mov(words, line)
    if name == "set":
        return (0xE000 | find(SET_TARGETS, words[0], line) << 5
                | read_number(words[1], 32, line))
    if name == "nop":
        return encode_mov(["y", "y"], line)
    raise AssembleError("%r: no such instruction" % (line,))


def list_lines(text):
    """(labels, instructions, places): what stands where."""
    labels, lines, places = {}, [], {}
    for raw in text.splitlines():
        line = raw.split(";")[0].strip()
        label = re.fullmatch(r"(public\s+)?(\w+):", line)
        if label:
            labels[label[2]] = len(lines)
            if label[1]:
                places[label[2]] = len(lines)
        elif line == ".wrap_target":
            places["wrap_target"] = len(lines)
        elif line == ".wrap":
            places["wrap"] = len(lines) - 1
        elif line.startswith(".program"):
            places["name"] = line.split()[1]
        elif line:
            lines.append(line)
    return labels, lines, places


def assemble(text):
    """Words of a program, and where its public places are.

    Returns ([int], {name: address}); also of wrap, wrap_target and name.
    Raises AssembleError.
    """
    labels, lines, places = list_lines(text)
    words = []
    for line in lines:
        delay = re.search(r"\[(\d+)\]$", line)
        word = encode(line[:delay.start()] if delay else line, labels)
        words.append(word | (read_number(delay[1], 32, line) << 8 if delay else 0))
    if len(words) > MAX_WORDS:
        raise AssembleError("%d words do not fit" % (len(words),))
    return words, places


def write_header(words, places, source):
    """Text of a header with the words and the places of a program."""
    name = places.pop("name")
    lines = ["/* SPDX-License-Identifier: GPL-3.0-or-later",
             " * Words of %s, made by scripts/pio_assemble.py. */" % (source,),
             "static const uint16_t %s_program[] = {" % (name,)]
    for i in range(0, len(words), 8):
        lines.append("    " + " ".join("0x%04x," % w for w in words[i:i + 8]))
    lines.append("};")
    lines.append("enum { " + ", ".join(
        "%s_%s = %d" % (name.upper(), place.upper(), address)
        for place, address in sorted(places.items())) + " };")
    return "\n".join(lines) + "\n"


def main():
    source, target = sys.argv[1:]
    words, places = assemble(pathlib.Path(source).read_text())
    pathlib.Path(target).write_text(
        write_header(words, places, pathlib.Path(source).name))


if __name__ == "__main__":
    main()
