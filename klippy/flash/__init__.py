# SPDX-License-Identifier: GPL-3.0-or-later
"""Getting firmware into boards: what was built, what is attached, how to write."""
