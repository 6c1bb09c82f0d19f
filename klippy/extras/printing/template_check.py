# SPDX-License-Identifier: GPL-3.0-or-later
"""Which templates are known to have no syntax error, from one start to the next.

Checking a hundred macros takes longer than all else at the start.  The texts of
those that were checked are kept in a file of the user's cache folder; a start
that finds the same text, with the same Jinja2 and Python, trusts it.  Without
the file all are checked again.
"""

import json
import logging
import os
import sys
from importlib.machinery import PathFinder


def find_folder():
    """$KLIPPY_CACHE, or a folder among the caches of this user."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return os.environ.get("KLIPPY_CACHE") or os.path.join(base, "klippy")


def describe_checker():
    """Text that changes whenever a check might give another result."""
    spec = PathFinder.find_spec("jinja2")
    if spec is None:
        return ""
    folder = os.path.dirname(spec.origin)
    times = [os.stat(os.path.join(folder, name)).st_mtime_ns
             for name in ("lexer.py", "parser.py", "compiler.py", "filters.py")]
    return "%s %s %s" % (sys.version, folder, times)


class CheckedTexts:
    """The texts that were checked; config_file names the printer they are of."""

    def __init__(self, config_file):
        name = os.path.abspath(config_file or "").strip("/").replace("/", "%")
        self.path = os.path.join(find_folder(), "macros-%s.json" % (name[-200:],))
        self.checker = describe_checker()
        self.known = self._read()
        self.used = set()

    def _read(self):
        try:
            with open(self.path, encoding="utf-8") as source:
                data = json.load(source)
            if data["checker"] == self.checker:
                return set(data["texts"])
        except (OSError, ValueError, TypeError, KeyError):
            pass
        return set()

    def is_known(self, text):
        """True if the text has no syntax error."""
        return text in self.known

    def note(self, text):
        """The text has no syntax error."""
        self.used.add(text)

    def save(self):
        """Remember what was noted, if that is not what the file holds."""
        if self.used == self.known or not self.checker:
            return
        temporary = "%s.%d" % (self.path, os.getpid())
        try:
            os.makedirs(os.path.dirname(self.path), mode=0o700, exist_ok=True)
            with open(temporary, "w", encoding="utf-8") as target:
                json.dump({"checker": self.checker, "texts": sorted(self.used)},
                          target)
            os.replace(temporary, self.path)
            self.known = set(self.used)
        except OSError as err:
            logging.info("templates are checked again at the next start: %s", err)
