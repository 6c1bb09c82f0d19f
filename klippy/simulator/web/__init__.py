# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of `klippy demo --web`: a simulated printer one can watch and use."""
