# SPDX-License-Identifier: GPL-3.0-or-later
"""One line about each option and command, from the files beside the modules.

options.toml: a table has the name of the module that reads the option; `about` is
a line about the section itself.  The table of a section's own module comes first.
commands.toml: a table a command.
"""

import pathlib
import tomllib

import klippy
import klippy.extras

OPTIONS_FILE, COMMANDS_FILE = "options.toml", "commands.toml"
FREE = "*"                  # key of what a command takes beside its parameters
ANY_TABLE = "stepper"               # of what compiled modules read
# Section kinds of the core: the table they have
_CORE_TABLES = (("stepper", "stepper"), ("extruder", "extruder"),
                ("printer", "toolhead"))


class Texts:
    """Texts by table and option."""

    def __init__(self, tables):
        self.tables = tables
        self.asked = set()              # (table, option) that were used

    def _find(self, names, key):
        for name in names:
            text = self.tables.get(name, {}).get(key)
            if text is not None:
                self.asked.add((name, key))
                return text
        return None

    def get_section(self, kind):
        """The line about a section kind, None without one."""
        return self._find(self._list_tables(kind), "about")

    def get_option(self, kind, option):
        """The line about an Option of a section kind, None without one."""
        return self._find([*self._list_tables(kind), *option.modules, ANY_TABLE],
                          option.name)

    @staticmethod
    def _list_tables(kind):
        head = kind.split()[0].replace("<n>", "")
        core = [table for start, table in _CORE_TABLES if head.startswith(start)]
        return [kind, head, *core]


def read_texts(folders=()):
    """The Texts about options, of all modules and of plug-ins in further folders.

    Raises ValueError for a file that is no TOML.
    """
    return Texts(read_tables(OPTIONS_FILE, folders))


def read_command_texts(folders=()):
    """{command: {parameter: line}} of the same; `about` is a line about it.

    A line may be a table with kind and text, for what cannot be read off the
    sources.
    """
    return read_tables(COMMANDS_FILE, folders)


def read_tables(file_name, folders):
    """All tables of the files of a name, those of a table put together."""
    places = [pathlib.Path(klippy.__file__).parent, *klippy.extras.__path__, *folders]
    tables = {}
    for place in places:
        path = pathlib.Path(place, file_name)
        if path.is_file():
            for name, table in tomllib.loads(path.read_text()).items():
                tables.setdefault(name, {}).update(table)
    return tables
