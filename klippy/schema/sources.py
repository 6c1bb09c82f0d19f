# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions of our modules as syntax trees, also of those that are compiled."""

import ast
import functools
import importlib
import pathlib
import sys


@functools.cache
def read_module(name):
    """{function or Class.method: FunctionDef} of a module; {} without source."""
    module = sys.modules.get(name) or importlib.import_module(name)
    path = pathlib.Path(getattr(module, "__file__", None) or "none.py")
    source = path.with_name(path.name.partition(".")[0] + ".py")
    if not source.is_file():
        return {}
    found = {}
    for node in ast.parse(source.read_text()).body:
        if isinstance(node, ast.FunctionDef):
            found[node.name] = node
        elif isinstance(node, ast.ClassDef):
            found.update((node.name + "." + part.name, part) for part in node.body
                         if isinstance(part, ast.FunctionDef))
    return found


def find_method(owner, name):
    """(FunctionDef, module name) of a method of an object, or None."""
    for base in type(owner).__mro__:
        node = read_module(base.__module__).get(base.__name__ + "." + name) if (
            is_ours(base.__module__)) else None
        if node is not None:
            return node, base.__module__
    return None


def find_function(func):
    """(FunctionDef, module name) of a function or method, or None."""
    name = getattr(func, "__name__", "")
    owner = getattr(func, "__self__", None)
    if owner is not None and not isinstance(owner, type(sys)):
        return find_method(owner, name)
    module = getattr(func, "__module__", None) or ""
    node = read_module(module).get(name) if is_ours(module) else None
    return (node, module) if node is not None else None


def find_by_name(name, parameter):
    """The one method or function of a name with a parameter, of all modules."""
    found = []
    for module in sorted(name for name in sys.modules if is_ours(name)):
        for full, node in read_module(module).items():
            if full.rpartition(".")[2] == name and parameter in [
                    arg.arg for arg in node.args.args]:
                found.append((node, module))
    return found[0] if len(found) == 1 else None


def is_ours(module):
    """Whether a module is one of the host or of a plug-in."""
    return module.startswith("klippy.") and not module.startswith("klippy.schema")
