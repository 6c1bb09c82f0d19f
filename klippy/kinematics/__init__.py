# SPDX-License-Identifier: GPL-3.0-or-later
"""Machines: how the axes of the head become ways of motors, one file a kind."""
