# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated machine: what is wired to the pins of virtual mcus."""
