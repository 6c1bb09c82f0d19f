# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds names that look like a misspelt one."""


def find_nearest(name, known):
    """The known name most like name, None if none is."""
    by_folded = {str(candidate).lower(): str(candidate) for candidate in known}
    import difflib
    found = difflib.get_close_matches(name.lower(), by_folded, 1, 0.6)
    return by_folded[found[0]] if found else None


def propose(name, known, form="'%s'"):
    """Text that proposes the nearest known name, or nothing."""
    nearest = find_nearest(name, known)
    return "; did you mean %s?" % (form % (nearest,),) if nearest else ""
