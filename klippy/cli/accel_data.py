# SPDX-License-Identifier: GPL-3.0-or-later
"""Accelerometer files: raw samples or spectra, and the shapers that fit them.

Raw: `#time,accel_x,accel_y,accel_z` and rows of s and mm/s^2.  Spectra:
`freq,psd_x,psd_y,psd_z,psd_xyz` and rows of Hz and (mm/s^2)^2/Hz; further columns
are the responses of shapers.
"""

import cmath
import math
from typing import NamedTuple

from klippy.errors import PrinterError
from klippy.extras.shaper_defs import FAMILIES, make_shaper
from klippy.extras.shaper_kernels import DESIGNS, make_kernel

RAW_COLUMNS = ("time", "accel_x", "accel_y", "accel_z")
PSD_COLUMNS = ("freq", "psd_x", "psd_y", "psd_z", "psd_xyz")
MIN_SAMPLES = 256
WINDOW_TIME = 0.5           # s, of one spectrum that is averaged
MAX_FREQ = 200.             # Hz, of resonances that matter
MIN_FREQ = 5.
SHAPER_FREQS = range(20, 151)
DAMPING = 0.1
KERNEL_PARTS = 128          # even, of Simpson's rule over a smooth shaper
SHAPERS = (*FAMILIES, *DESIGNS)
NOISE_SHARE = 0.05          # of the peak: lower frequencies do not vibrate


class Fit(NamedTuple):
    """A shaper at the frequency that leaves least vibration (share of it)."""
    name: str
    freq: float
    remaining: float


def read_columns(path, lines):
    """(names, rows of numbers) of a CSV file's lines.  Raises PrinterError."""
    names, rows = None, []
    for number, line in enumerate(lines, 1):
        text = line.strip().rstrip(",")
        if not text:
            continue
        cells = [cell.strip() for cell in text.lstrip("# ").split(",")]
        if names is None:
            names = cells
        elif not text.startswith("#"):
            rows.append(read_row(path, number, cells))
    width = max((len(row) for row in rows), default=0)
    for number, row in enumerate(rows, 1):
        if len(row) != width:
            raise PrinterError("%s: row %d has %d numbers, the others have %d: the file"
                               " is damaged" % (path, number, len(row), width))
    return names or [], rows


def read_row(path, number, cells):
    """The numbers of a line.  Raises PrinterError."""
    try:
        row = [float(cell) for cell in cells if cell]
    except ValueError:
        raise PrinterError("%s:%d: '%s' is no row of numbers" % (
            path, number, ",".join(cells)[:60]))
    if not all(math.isfinite(value) for value in row):
        raise PrinterError("%s:%d: a number is not finite" % (path, number))
    return row


def find_kind(first_line):
    """"raw", "psd" or None, by the first line of a file."""
    names = tuple(cell.strip() for cell in first_line.lstrip("# ").split(","))
    if names[:len(RAW_COLUMNS)] == RAW_COLUMNS:
        return "raw"
    return "psd" if names[:2] == PSD_COLUMNS[:2] else None


def calc_spectrum(rows):
    """{"freq", "psd_x", "psd_y", "psd_z", "psd_xyz"} of raw samples.

    Means of the spectra of overlapping windows (Hann); the area below a curve is
    the mean square of its acceleration.  Raises PrinterError.
    """
    import numpy as np
    data = np.array(rows)
    span = data[-1, 0] - data[0, 0] if len(data) else 0.
    if len(data) < MIN_SAMPLES or span <= 0. or np.any(np.diff(data[:, 0]) < 0.):
        raise PrinterError("%d samples over %.3f s: a spectrum needs at least %d, in"
                           " order of time" % (len(data), span, MIN_SAMPLES))
    rate = (len(data) - 1) / span
    size = min(1 << round(math.log2(rate * WINDOW_TIME)), len(data))
    window = np.hanning(size + 1)[:size]
    scale = 2. / (rate * np.sum(window ** 2))
    steps = range(0, len(data) - size + 1, max(1, size // 2))
    spectrum = {"freq": np.fft.rfftfreq(size, 1. / rate)}
    for column, axis in enumerate("xyz", 1):
        pieces = [data[i:i + size, column] for i in steps]
        powers = [abs(np.fft.rfft((piece - piece.mean()) * window)) ** 2
                  for piece in pieces]
        spectrum["psd_" + axis] = scale * np.mean(powers, axis=0)
    spectrum["psd_xyz"] = sum(spectrum["psd_" + axis] for axis in "xyz")
    return spectrum


def make_spectrum(path, names, rows):
    """The columns of a spectra file by name.  Raises PrinterError."""
    import numpy as np
    missing = [name for name in PSD_COLUMNS if name not in names]
    if missing or len(rows) < 3:
        raise PrinterError("%s: a spectrum needs columns %s and at least 3 rows; it has"
                           " no %s" % (path, ", ".join(PSD_COLUMNS),
                                       ", ".join(missing) or "rows"))
    # titles without numbers, as `shapers:`, are no columns
    columns = [name for name in names if name and not name.endswith(":")]
    data = np.array(rows)
    if data.shape[1] < len(columns):
        raise PrinterError("%s: %d columns are named, the rows have %d"
                           % (path, len(columns), data.shape[1]))
    return dict(zip(columns, data.T, strict=False))


def calc_response(name, shaper_freq, freqs, damping=DAMPING):
    """Share of vibration at each of freqs (Hz) that a shaper lets through.

    The vibration is one of that frequency, with damping.
    """
    if name in DESIGNS:
        return calc_smooth_response(name, shaper_freq, freqs, damping)
    shaper = make_shaper(name, shaper_freq, damping)
    shares = []
    for freq in freqs:
        rate = calc_rate(freq, damping)
        last = max(shaper.delays)
        total = sum(weight * cmath.exp(-rate * (last - delay))
                    for weight, delay in zip(shaper.weights, shaper.delays,
                                             strict=True))
        shares.append(abs(total))
    return shares


def calc_rate(freq, damping):
    """What a vibration turns and decays by in a second, in radians."""
    return (2. * math.pi * freq) * complex(damping, math.sqrt(1. - damping * damping))


def calc_smooth_response(name, shaper_freq, freqs, damping):
    """calc_response() of a shaper that has a kernel in place of impulses."""
    import numpy as np
    # the shape of a kernel is the same for all frequencies
    coeffs = make_kernel(name, 1., damping).coeffs
    half = make_kernel(name, 1., damping).half / shaper_freq
    u = np.linspace(-1., 1., KERNEL_PARTS + 1)
    simpson = np.where(np.arange(len(u)) % 2, 4., 2.) * 2. / (3. * KERNEL_PARTS)
    simpson[[0, KERNEL_PARTS]] /= 2.
    weights = simpson * np.polynomial.polynomial.polyval(u, coeffs)
    rates = calc_rate(1., damping) * np.asarray(freqs, dtype=float)
    return list(abs(np.exp(np.outer(-rates * half, 1. - u)) @ weights))


def fit_shapers(spectrum, names=SHAPERS, damping=DAMPING):
    """A Fit each of the shapers, to the sum of the axes."""
    import numpy as np
    freqs, power = spectrum["freq"], spectrum["psd_xyz"]
    is_used = (freqs >= MIN_FREQ) & (freqs <= MAX_FREQ)
    freqs, power = freqs[is_used], power[is_used]
    if not len(freqs) or power.max() <= 0.:
        raise PrinterError("nothing vibrates between %g and %g Hz"
                           % (MIN_FREQ, MAX_FREQ))
    power = np.where(power > NOISE_SHARE * power.max(), power, 0.)
    total = np.sqrt(power).sum()
    fits = []
    for name in names:
        remaining = [(float((np.sqrt(power) * calc_response(
            name, freq, freqs, damping)).sum() / total), freq)
            for freq in SHAPER_FREQS]
        least, freq = min(remaining)
        fits.append(Fit(name, freq, least))
    return fits
