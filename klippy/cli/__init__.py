# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: `klippy run|simulate|demo|check|console|dump|...`.

Each module of this package is a sub-command of its name (- for _), with
add_arguments(parser), run(options) -> exit status and maybe HELP.  Arguments
that do not start with a sub-command are those of `run`.
"""

import argparse
import errno
import gc
import importlib
import os
import sys

DEFAULT_COMMAND = "run"
DEFAULT_WIDTH = 80      # columns of a terminal that is none


def find_command(name):
    """The module of a sub-command, None if there is none of that name."""
    if name not in list_names():
        return None
    gc.disable()            # nothing that an import makes is garbage
    try:
        module = importlib.import_module("klippy.cli." + name.replace("-", "_"))
    finally:
        gc.enable()
    return module if hasattr(module, "add_arguments") else None


def list_names():
    """Names of the modules here, as they are written on a command line."""
    names = {entry.name.partition(".") for folder in __path__
             for entry in os.scandir(folder)}
    return sorted(name.replace("_", "-") for name, _, kind in names
                  if kind == "py" and name != "__init__")


def list_commands():
    """Names and modules of the sub-commands."""
    found = [(name, find_command(name)) for name in list_names()]
    return [(name, module) for name, module in found if module is not None]


def read_help(module):
    """One line about a sub-command."""
    text = getattr(module, "HELP", None) or (module.__doc__ or "").strip()
    first = text.split("\n")[0]
    return first.partition(": ")[2].rstrip(".") if first.startswith("`") else first


def print_help():
    """Print what there is."""
    print("usage: klippy <command> [options]      (klippy <command> --help)")
    print("       klippy printer.cfg [options]    the same as klippy run")
    print("       klippy --version\n")
    for name, module in list_commands():
        print("  %-15s %s" % (name, read_help(module)))


class HelpFormatter(argparse.HelpFormatter):
    """Knows its width without shutil, which takes long to import."""

    def __init__(self, prog):
        try:
            width = (int(os.environ.get("COLUMNS") or 0)
                     or os.get_terminal_size().columns)
        except (OSError, ValueError):
            width = DEFAULT_WIDTH
        super().__init__(prog, width=(width or DEFAULT_WIDTH) - 2)


def forget_stdout():
    """Nobody reads the output any more (as with `| head`): write to nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def find_mistake(name):
    """What is wrong with a first argument that is no command; None if nothing.

    It is the name of a config file then, as of the classic command line.
    """
    is_path = name.startswith("-") or "." in name or os.sep in name
    if is_path or os.path.exists(name):
        return None
    from klippy.confignames import propose
    return "there is neither a command nor a config file '%s'%s" % (
        name, propose(name, list_names()) or ": klippy --help lists the commands")


def main(argv=None):
    """Run a command line (default: the process's); returns the exit status."""
    try:
        status = _run(argv)
        sys.stdout.flush()
    except BrokenPipeError:
        forget_stdout()
        return 1
    except OSError as err:
        if err.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        print("klippy: %s: what was to be written is not complete" % (err.strerror,),
              file=sys.stderr)
        forget_stdout()
        return 1
    return status


def _run(argv):
    argv = list(sys.argv[1:] if argv is None else argv)
    if argv[:1] in (["--help"], ["-h"], ["help"]) or not argv:
        print_help()
        return 0 if argv else 2
    if argv[0] == "--version":
        from klippy import sysinfo
        print("klippy " + sysinfo.get_version())
        return 0
    name, module = argv[0], find_command(argv[0])
    if module is None:
        mistake = find_mistake(name)
        if mistake:
            print("klippy: " + mistake, file=sys.stderr)
            return 2
        name, module = DEFAULT_COMMAND, find_command(DEFAULT_COMMAND)
    else:
        argv.pop(0)
    parser = argparse.ArgumentParser(prog="klippy " + name,
                                     description=read_help(module),
                                     formatter_class=HelpFormatter)
    module.add_arguments(parser)
    return module.run(parser.parse_args(argv)) or 0
