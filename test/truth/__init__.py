# SPDX-License-Identifier: GPL-3.0-or-later
"""Slow, independent models that say where a stepper must be, and when."""
