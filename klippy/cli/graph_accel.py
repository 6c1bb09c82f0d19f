# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots of accelerometer files: samples, spectrum, and the shapers that fit."""

from klippy.cli import accel_data
from klippy.cli.accel_data import MAX_FREQ, PSD_COLUMNS
from klippy.extras.shaper_kernels import DESIGNS

PERCENT = 100.


def draw(figure, path, lines):
    """Draw a file into a figure.  Raises PrinterError."""
    names, rows = accel_data.read_columns(path, lines)
    if accel_data.find_kind(lines[0]) == "raw":
        spectrum = accel_data.calc_spectrum(rows)
        upper, lower = figure.subplots(2, 1)
        draw_samples(upper, rows)
    else:
        spectrum = accel_data.make_spectrum(path, names, rows)
        lower = figure.subplots(1, 1)
    draw_spectrum(lower, spectrum)
    draw_shapers(lower.twinx(), spectrum)


def draw_samples(axes, rows):
    """Acceleration over time."""
    times, *columns = zip(*rows, strict=True)
    for name, values in zip("xyz", columns, strict=False):
        axes.plot([time - times[0] for time in times], values, label=name,
                  linewidth=0.6)
    axes.set_xlabel("s")
    axes.set_ylabel("mm/s²")
    axes.legend(loc="upper left", fontsize="small")
    axes.grid(alpha=0.3)


def draw_spectrum(axes, spectrum):
    """Power over frequency, by axis and in all."""
    for name in PSD_COLUMNS[1:]:
        axes.plot(spectrum["freq"], spectrum[name], label=name.removeprefix("psd_"))
    axes.set_xlim(0., min(MAX_FREQ, float(spectrum["freq"][-1])))
    axes.set_ylim(bottom=0.)
    axes.set_xlabel("Hz")
    axes.set_ylabel("(mm/s²)²/Hz")
    axes.legend(loc="upper left", fontsize="small")
    axes.grid(alpha=0.3)


def draw_shapers(axes, spectrum):
    """What the shapers let through, each at its best frequency; smooth ones dotted."""
    fits = accel_data.fit_shapers(spectrum)
    best = min(fits, key=lambda fit: fit.remaining)
    freqs = [freq for freq in spectrum["freq"] if 0. < freq <= MAX_FREQ]
    for fit in fits:
        style = "-" if fit is best else ":" if fit.name in DESIGNS else "--"
        axes.plot(freqs, accel_data.calc_response(fit.name, fit.freq, freqs),
                  style, linewidth=1.2 if fit is best else 0.7,
                  label="%s %d Hz: %.1f %% left" % (fit.name, fit.freq,
                                                    PERCENT * fit.remaining))
    axes.set_ylim(0., 1.)
    axes.set_ylabel("let through")
    axes.legend(loc="upper right", fontsize="small")
