#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw what input shapers leave of a vibration: docs/img/input_shapers.svg.

Lines are theory, dots a simulated resonator driven by the steps.  Needs
matplotlib and numpy.
"""

import pathlib
import sys

import matplotlib
import numpy as np

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[1]
FREQ, DAMPING = 45., 0.


def draw(axes, names):
    """One picture of some shapers."""
    from shaper_resonator import measure
    from truth import shaping
    fine, coarse = np.linspace(15., 90., 301), np.linspace(15., 90., 26)
    for name in names:
        line, = axes.plot(fine, 100 * shaping.vibration(name, FREQ, DAMPING, fine),
                          label=name, lw=1.2)
        axes.plot(coarse, 100 * measure(name, FREQ, DAMPING, coarse), ".",
                  color=line.get_color(), ms=4)
    axes.set(xlabel="frequency of the resonance, Hz", ylim=(0, 100))
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def main():
    """Write the picture."""
    sys.path[:0] = [str(ROOT), str(ROOT / "test"), str(ROOT / "test" / "ext")]
    from truth import shaping
    pyplot.rcParams["svg.hashsalt"] = "shapers"
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 4), sharey=True)
    draw(left, shaping.IMPULSES)
    draw(right, tuple(shaping.KERNELS))
    left.set_ylabel("vibration left, %")
    figure.tight_layout()
    target = ROOT / "docs" / "img" / "input_shapers.svg"
    target.parent.mkdir(exist_ok=True)
    figure.savefig(target, metadata={"Date": None})


if __name__ == "__main__":
    main()
