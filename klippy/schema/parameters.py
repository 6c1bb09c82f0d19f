# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameters a command asks for, read off its handler and what that calls.

Handlers cannot be run without moving a machine, so their source is read: calls
like gcmd.get_float("SPEED", 5., above=0.), with names and defaults worked out.
"""

import ast
import itertools
import sys
from dataclasses import dataclass, field

from klippy.schema import sources

LIVE = object()             # default that depends on the state of the printer
MAX_DEPTH = 6
_POSITIONAL = {
    "get": ("name", "default", "parser", "minval", "maxval", "above", "below"),
    "get_int": ("name", "default", "minval", "maxval"),
    "get_float": ("name", "default", "minval", "maxval", "above", "below")}
_KINDS = {"get": "str", "get_int": "int", "get_float": "float"}
_GCMD = "gcmd"
_BOUNDS = ("minval", "maxval", "above", "below")


@dataclass
class Parameter:
    """One parameter.  default: None, a value, or LIVE.  kind: str, int, float."""
    name: str
    kind: str
    needed: bool
    default: object = None
    bounds: dict = field(default_factory=dict)


class Reader:
    """Finds the parameters of one handler."""

    def __init__(self):
        self.found = {}
        self.takes_text = self.takes_any = False
        self.seen = set()

    def read(self, func):
        """Take in a handler (function or bound method)."""
        place = sources.find_function(func)
        if place is not None:
            names = [arg.arg for arg in place[0].args.args if arg.arg != "self"]
            gcmd = _GCMD if _GCMD in names else names[0]
            self._visit(place, gcmd, getattr(func, "__self__", None), {}, 0)
        return self

    def _visit(self, place, gcmd, owner, env, depth, looks_first=False):
        node, module = place
        key = node.name, module, node.lineno, repr(sorted(env.items()))
        if depth > MAX_DEPTH or key in self.seen:
            return
        self.seen.add(key)
        scope = Scope(node, module, owner, env)
        scope.looks_first |= looks_first
        for call in ast.walk(node):
            if not isinstance(call, ast.Call):
                continue
            if _is_method_of(call, gcmd):
                self._note_get(call, scope)
            elif any(isinstance(arg, ast.Name) and arg.id == gcmd
                     for arg in call.args):
                self._follow(call, gcmd, scope, depth)

    def _note_get(self, call, scope):
        method = call.func.attr
        if method == "get_raw_command_parameters":
            self.takes_text = True
        elif method == "get_command_parameters":
            self.takes_any = True
        if method not in _POSITIONAL:
            return
        given = dict(zip(_POSITIONAL[method], call.args, strict=False))
        given.update((word.arg, word.value) for word in call.keywords)
        for env in scope.list_bindings(call):
            name = scope.evaluate(given.get("name"), env)
            if isinstance(name, str):
                new = make_parameter(name, method, given, scope, env)
                new.needed &= not scope.looks_first
                self._add(new)

    def _add(self, new):
        old = self.found.setdefault(new.name, new)
        if old is new:
            return
        needed = old.needed and new.needed
        if old.kind == "str" and new.kind != "str":
            self.found[new.name] = old = new
        if old.default is None and not new.needed:
            old.default = new.default
        old.needed = needed

    def _follow(self, call, gcmd, scope, depth):
        for place, owner in scope.list_callees(call.func, gcmd):
            self._enter(call, gcmd, scope, depth, place, owner)

    def _enter(self, call, gcmd, scope, depth, place, owner):
        names = [arg.arg for arg in place[0].args.args]
        if names[:1] in (["self"], ["cls"]):
            names = names[1:]
        passed = next((name for name, arg in zip(names, call.args, strict=False)
                       if isinstance(arg, ast.Name) and arg.id == gcmd), None)
        if passed is None:
            return
        for env in scope.list_bindings(call):
            inner = {}
            for name, arg in zip(names, call.args, strict=False):
                value = scope.evaluate(arg, env)
                if isinstance(value, (str, int, float, tuple, list)):
                    inner[name] = value
            self._visit(place, passed, owner, inner, depth + 1, scope.looks_first)


def _is_method_of(call, gcmd):
    return (isinstance(call.func, ast.Attribute)
            and isinstance(call.func.value, ast.Name)
            and call.func.value.id == gcmd)


def make_parameter(name, method, given, scope, env):
    """The Parameter of a call of gcmd.get() and its like."""
    kind = _KINDS[method]
    if "parser" in given:
        parser = ast.unparse(given["parser"])
        kind = parser if parser in ("int", "float") else "str"
    default, needed = given.get("default"), False
    if default is None:
        value, needed = None, True
    elif scope.is_live(default):
        value = LIVE
    else:
        value = scope.evaluate(default, env, LIVE)
    bounds = {}
    for bound in _BOUNDS:
        limit = given.get(bound)
        if limit is not None:
            value_of = scope.evaluate(limit, env)
            if isinstance(value_of, (int, float)):
                bounds[bound] = value_of
    return Parameter(name, kind, needed, value, bounds)


def bind(target, value):
    """{name: value} of an assignment to a target; ValueError if it does not fit."""
    if isinstance(target, ast.Name):
        return {target.id: value}
    if not isinstance(target, (ast.Tuple, ast.List)) or not isinstance(
            value, (tuple, list)):
        raise ValueError(target)
    found = {}
    for part, one in zip(target.elts, value, strict=True):
        found.update(bind(part, one))
    return found


class Scope:
    """Names within a function: its module, its object, and what its loops run over."""

    def __init__(self, node, module, owner, env):
        self.owner = owner
        self.globals = vars(sys.modules[module])
        self.env = dict(env)
        if owner is not None:
            self.env["self"] = owner
        self.locals = set()
        self.loops = []                 # lists of {name: value}
        # a handler that looks what was given needs nothing
        self.looks_first = False
        for part in ast.walk(node):
            if isinstance(part, ast.Assign):
                self._note_assignment(part)
            elif isinstance(part, (ast.For, ast.comprehension)):
                self._note_loop(part.target, part.iter)
            elif isinstance(part, ast.Attribute):
                self.looks_first |= part.attr == "get_command_parameters"

    def _note_assignment(self, part):
        for target in part.targets:
            pairs = [(target, part.value)]
            if isinstance(target, ast.Tuple) and isinstance(part.value, ast.Tuple):
                pairs = zip(target.elts, part.value.elts, strict=False)
            for name, node in pairs:
                if isinstance(name, ast.Name):
                    self.locals.add(name.id)
                    value = self.evaluate(node, {})
                    if value is not None:
                        self.env.setdefault(name.id, value)

    def _note_loop(self, target, iterable):
        outer = {name: value for rows in self.loops for name, value in rows[0].items()}
        values = self._evaluate_partly(iterable, outer)
        if isinstance(values, dict):
            values = list(values)
        try:
            values = list(values)[:64] if values is not None else []
        except TypeError:
            return
        names = [part.id for part in ast.walk(target) if isinstance(part, ast.Name)]
        rows = []
        self.locals.update(names)
        for value in values:
            try:
                rows.append(bind(target, value))
            except ValueError:
                return
        if rows:
            self.loops.append(rows)

    def _evaluate_partly(self, node, env):
        """As evaluate(), with None for the parts that cannot be told."""
        value = self.evaluate(node, env)
        if value is not None:
            return value
        if isinstance(node, (ast.Tuple, ast.List)):
            return [self._evaluate_partly(part, env) for part in node.elts]
        if (isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
                and node.func.id == "zip"):
            columns = [self._evaluate_partly(arg, env) for arg in node.args]
            length = min((len(c) for c in columns if c is not None), default=0)
            return list(zip(*(c if c is not None else [None] * length
                              for c in columns), strict=False))
        return None

    def list_bindings(self, call):
        """Values of the loops' names that a call uses, one dict a pass."""
        used = {part.id for arg in [*call.args, *(word.value for word in call.keywords)]
                for part in ast.walk(arg) if isinstance(part, ast.Name)}
        loops = [rows for rows in self.loops if used & set(rows[0])]
        for rows in itertools.product(*loops):
            yield {name: value for row in rows for name, value in row.items()}

    def evaluate(self, node, env, otherwise=None):
        """Value of an expression, or otherwise if it cannot be told from here."""
        if node is None:
            return otherwise
        code = compile(ast.fix_missing_locations(ast.Expression(node)), "?", "eval")
        try:
            return eval(code, self.globals, {**self.env, **env})
        except Exception:
            return otherwise

    def is_live(self, node):
        """Whether an expression looks at an object or a local name."""
        return any(isinstance(part, ast.Name)
                   and (part.id == "self" or part.id in self.locals)
                   for part in ast.walk(node))

    def list_callees(self, func, gcmd):
        """[((FunctionDef, module), object)] of what a call may call."""
        if isinstance(func, ast.Subscript):
            table = self.evaluate(func.value, {})
            targets = table.values() if isinstance(table, dict) else ()
            return [(sources.find_function(target), getattr(target, "__self__", None))
                    for target in targets if sources.find_function(target)]
        found = self._find_callee(func, gcmd)
        return [found] if found is not None else []

    def _find_callee(self, func, gcmd):
        if isinstance(func, ast.Name):
            target = self.evaluate(func, {})
            place = sources.find_function(target) if callable(target) else None
            return (place, None) if place else None
        if not isinstance(func, ast.Attribute):
            return None
        owner = self.evaluate(func.value, {})
        place = None
        if isinstance(owner, type(sys)):
            place, owner = sources.find_function(getattr(owner, func.attr, None)), None
        elif owner is not None:
            place = sources.find_method(owner, func.attr)
        if place is None:
            place, owner = sources.find_by_name(func.attr, gcmd), None
        return (place, owner) if place else None
