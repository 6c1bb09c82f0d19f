# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks for divisions in software that an interrupt can get to.

Reads the disassembly of a linked program: who calls or jumps to whom.  What
interrupts begin with is found by name: handlers and events of timers, as the
sources connect them.  Where addresses are whole words (ARM), also each function
whose address is taken anywhere but in the tables of commands and tasks.
"""

import functools
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
DIVISION = re.compile(
    r"__(aeabi_(u?(i|l)div(mod)?)|u?(div|mod|divmod)[qhsd]i\d)$")
FUNCTION = re.compile(r"^([0-9a-f]+) <([^>]+)>:$")
CALL = re.compile(r"\t(?:b[a-z.]*|cbn?z|r?call|r?jmp)\t.*<([^>+]+)(\+0x[0-9a-f]+)?>")
WORD = re.compile(r"^ *[0-9a-f]+:\t(?:[0-9a-f]{8} +)?\.word\t0x([0-9a-f]{8})")
# How sources name what interrupts run
STARTS = [
    re.compile(r"armcm_connect(?:_system)?\([^;]*?,\s*(\w+)\)"),
    re.compile(r"trsync_add_signal\([^;]*?,\s*(\w+)\)"),
    re.compile(r"\bevent = ([^;}]+)[;}]"),
    re.compile(r"\.(?:apply|follow|rest|is_ready) = (\w+)"),
    re.compile(r"bool\s+(\w+)\(struct timer \*\w*\)"),
]
# Filled by the build: called by the main loop, one after the other
TABLES = re.compile(r"tables|commands|inits|tasks|shutdowns")
# Called through pointers by a task: sensors/bulk.c
BY_TASKS = {"read_samples", "read_sample", "count_waiting"}


def plain(name):
    """A function's name in the source, without what the compiler adds."""
    return name.split(".")[0]


@functools.cache
def list_starts():
    """Names of the functions that sources give to interrupts."""
    names = set()
    for path in sorted((ROOT / "src").rglob("*.[ch]")):
        text = path.read_text()
        for pattern in STARTS:
            for found in pattern.findall(text):
                names |= set(re.findall(r"[a-z]\w+", found))
    return frozenset(names)


def disassemble(prefix, elf):
    return subprocess.run([prefix + "objdump", "-d", str(elf)], check=True,
                          capture_output=True, text=True).stdout


def read_calls(text):
    """({function: functions that it goes on to}, {address: function},
    words between instructions)."""
    calls, places, words, current = {}, {}, set(), None
    for line in text.splitlines():
        head = FUNCTION.match(line)
        if head:
            current = head[2]
            places[int(head[1], 16)] = current
            calls.setdefault(current, set())
            continue
        call = CALL.search(line)
        if call and call[1] != current:
            calls[current].add(call[1])
        word = WORD.match(line)
        if word:
            words.add(int(word[1], 16))
    return calls, places, words


def read_data_words(prefix, elf):
    """Words of initialised variables and of constants that are no tables."""
    text = subprocess.run([prefix + "objdump", "-t", str(elf)], check=True,
                          capture_output=True, text=True).stdout
    dump = subprocess.run(
        [prefix + "objdump", "-s", "-j", ".data", "-j", ".text", str(elf)],
        capture_output=True, text=True).stdout
    memory = {}
    for line in dump.splitlines():
        row = re.match(r" ([0-9a-f]+) ((?:[0-9a-f]{2,8} ){1,4})", line)
        if row:
            data = bytes.fromhex(row[2].replace(" ", ""))
            memory.update((int(row[1], 16) + i, b) for i, b in enumerate(data))
    words = set()
    for line in text.splitlines():
        row = re.match(r"([0-9a-f]{8}) .{6}O \S+\t([0-9a-f]{8}) (?:\.hidden )?(\S+)",
                       line)
        if not row or TABLES.search(row[3]):
            continue
        for at in range(int(row[1], 16), int(row[1], 16) + int(row[2], 16) - 3, 4):
            if all(at + i in memory for i in range(4)):
                words.add(int.from_bytes(bytes(memory[at + i] for i in range(4)),
                                         "little"))
    return words


def find_starts(prefix, elf, graph):
    """Functions of the program that an interrupt may begin with."""
    calls, places, words = graph
    starts = {name for name in calls if plain(name) in list_starts()
              or name.startswith("__vector_")}
    if prefix.startswith("arm-"):
        taken = words | read_data_words(prefix, elf)
        starts |= {places[w - 1] for w in taken if w & 1 and w - 1 in places}
    return {name for name in starts if plain(name) not in BY_TASKS}


def find_divisions(prefix, elf):
    """Ways from an interrupt to a division: ["event > function > __udivsi3"].

    Raises ValueError if nothing was found that interrupts begin with.
    """
    graph = read_calls(disassemble(prefix, elf))
    starts = find_starts(prefix, elf, graph)
    if not starts:
        raise ValueError("%s: no interrupt's function is known" % (elf,))
    came_from, queue, found = dict.fromkeys(starts), sorted(starts), []
    while queue:
        name = queue.pop()
        for target in sorted(graph[0].get(name, ())):
            if DIVISION.match(plain(target)):
                found.append(describe(came_from, name) + " > " + target)
            elif target not in came_from:
                came_from[target] = name
                queue.append(target)
    return sorted(found)


def describe(came_from, name):
    way = []
    while name:
        way.insert(0, name)
        name = came_from[name]
    return " > ".join(way)
