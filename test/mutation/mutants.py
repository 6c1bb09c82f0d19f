# SPDX-License-Identifier: GPL-3.0-or-later
"""Small faults that a person could have made, found in the text of a C file.

A fault keeps the number and the order of what core/decl.h counts (sendf(),
shutdown(), DECL_*), so that the headers generated for the right text fit.
Only bodies of functions are changed: by the house style they lie between "{"
and "}" in the first column.
"""

import collections
import re
from dataclasses import dataclass

HIDDEN = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:[^"\\\n]|\\.)*"'
                    r"|'(?:[^'\\\n]|\\.)*'|^[ \t]*#(?:[^\n]*\\\n)*[^\n]*",
                    re.S | re.M)
BODY = re.compile(r"^\{\n.*?^\}", re.S | re.M)

# name: (pattern, what may stand for the match)
SWAPS = {
    "relational": (r"(?<= )(?:<=|>=|==|!=|<|>)(?= )", {
        "<": ["<=", ">"], "<=": ["<", ">"], ">": [">=", "<"], ">=": [">", "<"],
        "==": ["!="], "!=": ["=="]}),
    "arithmetic": (r"(?<= )(?:\+=|-=|<<|>>|[-+*/&|^])(?= )|\+\+|--", {
        "+": ["-"], "-": ["+"], "*": ["+"], "/": ["*"], "+=": ["-="],
        "-=": ["+="], "<<": [">>"], ">>": ["<<"], "&": ["|"], "|": ["&"],
        "^": ["|"], "++": ["--"], "--": ["++"]}),
    "logical": (r"(?<= )(?:&&|\|\|)(?= )", {"&&": ["||"], "||": ["&&"]}),
    "constant": (r"\b(?:true|false|TIMER_AGAIN|TIMER_DONE|NULL(?=\)| [|&]))\b"
                 r"|(?<![\w.])(?:0x[0-9a-f]+|\d+)\b", {
        "true": ["false"], "false": ["true"], "TIMER_AGAIN": ["TIMER_DONE"],
        "TIMER_DONE": ["TIMER_AGAIN"]}),
    "bits": (r"~(?=\w)", {"~": [""]}),
}
CONDITION = re.compile(r"\b(?:if|while) \(")
NOT_REMOVED = re.compile(r"(?:return|break|continue|goto|else|do|if|for|while"
                         r"|switch|case|default|static|struct|const|bool|void"
                         r"|u?int\w*|size_t|irq_flag_t|enum|__\w+)\b")
CALL_OR_SET = re.compile(r"[*(&]*[a-z_][\w>.\[\]()*&-]*"
                         r"(?:\(|(?: [-+|&^]?=| <<=| >>=) |\+\+;|--;)")


@dataclass(frozen=True)
class Mutant:
    """One fault: text[start:end] of a file becomes `new`."""

    path: str
    function: str
    operator: str
    line: int
    start: int
    end: int
    new: str
    before: str  # the line as it is, and as it becomes
    after: str
    number: int = 1  # of those in this function that look alike

    def apply(self, text):
        return text[:self.start] + self.new + text[self.end:]

    def __str__(self):
        return "%s:%d %s(), %s: %s  ->  %s" % (
            self.path, self.line, self.function, self.operator, self.before,
            self.after)

    def key(self):
        """What a list can name it by, when lines have moved."""
        number = " %d" % self.number if self.number > 1 else ""
        return self.path, self.function + number, self.before, self.after


def hide(text):
    """The text with comments, strings and directives blanked out."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match.group())
    return HIDDEN.sub(blank, text)


def find_close(text, start):
    """Where the bracket that opens at `start` closes."""
    depth = 0
    for pos in range(start, len(text)):
        depth += {"(": 1, ")": -1}.get(text[pos], 0)
        if not depth:
            return pos
    raise ValueError("no closing bracket")


def change_number(before, number):
    """Off by one; what looks like a flag is only turned over."""
    changed = [str(number - 1)] if number else []
    if number != 1 or before.endswith(("+ ", "- ", "<< ", ">> ")):
        changed.append(str(number + 1))
    return changed


def swap_tokens(body, offset):
    for name, (pattern, others) in SWAPS.items():
        for match in re.finditer(pattern, body):
            token = match.group()
            choices = others.get(token)
            if choices is None and token[0].isdigit():
                choices = change_number(body[:match.start()], int(token, 0))
            for new in choices or []:
                yield name, offset + match.start(), offset + match.end(), new


def invert_conditions(body, offset, text):
    for match in CONDITION.finditer(body):
        start = match.end() - 1
        end = find_close(body, start) + 1
        inside = body[start:end]
        if re.search("[!=]= ", inside) and not re.search(r"&&|\|\|", inside):
            continue  # the same as the relational swap
        start, end = start + offset, end + offset
        yield "inverted", start, end, "(!%s)" % (text[start:end],)


def remove_statements(body, offset, text):
    """`if (0)` instead of nothing: what is counted stays, in its order."""
    for match in re.finditer(r"(?<=[;{}):\n])[ \t]*\n?([ \t]+)(?=\S)", body):
        start = match.end()
        if NOT_REMOVED.match(body, start) or not CALL_OR_SET.match(body, start):
            continue
        end = body.index(";", start) + 1
        if "{" in body[start:end]:
            continue
        statement = text[offset + start:offset + end]
        name = "irq" if statement.startswith("irq_") else "removed"
        yield name, offset + start, offset + end, "{ if (0) %s }" % (statement,)


def drop_irq_save(body, offset):
    for match in re.finditer(r"(?<== )irq_save\(\)", body):
        yield "irq", offset + match.start(), offset + match.end(), "0"


def find_function(code, start):
    """The name of the function whose body begins there."""
    head = code[:start].rsplit("\n\n", 1)[-1]
    return re.search(r"\b(?!__)(\w+)\((?!\()", head).group(1)


def cut_line(text, start, end):
    first = text.rfind("\n", 0, start) + 1
    last = text.find("\n", end)
    return " ".join(text[first:last].split())


def list_mutants(path, text, is_active=lambda line: True):
    """All faults of one file, in the order of its text.

    is_active: takes a line number (from 1), tells whether it is compiled.
    """
    code, found = hide(text), set()
    functions = {}
    for match in BODY.finditer(code):
        body, offset = match.group(), match.start()
        functions[offset] = find_function(code, offset)
        for changes in (swap_tokens(body, offset),
                        invert_conditions(body, offset, text),
                        remove_statements(body, offset, text),
                        drop_irq_save(body, offset)):
            found |= set(changes)
    mutants, alike = [], collections.Counter()
    for name, start, end, new in sorted(found, key=lambda f: (f[1], f[2], f[3])):
        line = text.count("\n", 0, start) + 1
        function = functions[max(f for f in functions if f <= start)]
        shifted = text[:start] + new + text[end:]
        before = cut_line(text, start, end)
        after = cut_line(shifted, start, start + len(new))
        alike[function, before, after] += 1
        if is_active(line):
            mutants.append(Mutant(
                path, function, name, line, start, end, new, before, after,
                alike[function, before, after]))
    return mutants
