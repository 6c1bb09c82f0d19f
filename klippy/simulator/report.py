# SPDX-License-Identifier: GPL-3.0-or-later
"""Page of plots of a simulated print; needs numpy and matplotlib."""
import html
import pathlib

from klippy.errors import PrinterError

WIDTH, HEIGHT, DPI = 10.0, 4.2, 100
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 1040px;
       margin: 2rem auto; padding: 0 1rem; color: #1c2330; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
table { border-collapse: collapse; } td { padding: .15rem 1.2rem .15rem 0; }
td + td { font-variant-numeric: tabular-nums; font-weight: 600; }
img { width: 100%; height: auto; border: 1px solid #dde2ea; }
"""


def load_plotting():
    """(numpy, pyplot, collections); PrinterError that tells how to get them."""
    try:
        import matplotlib
        import numpy
        matplotlib.use("Agg")
        from matplotlib import collections, pyplot
    except ImportError as e:
        raise PrinterError("The report needs numpy and matplotlib: run"
                           " pip install 'klippy-host[plots]' (%s)" % e) from e
    return numpy, pyplot, collections


class ReportWriter:
    """Draws the plots of a Recorder into a folder."""

    def __init__(self, folder, recorder):
        self.folder = pathlib.Path(folder)
        self.recorder = recorder
        self.np, self.plt, self.collections = load_plotting()
        self.path = {n: self.np.asarray(c)
                     for n, c in recorder.path.columns.items()}
        self.state = {n: self.np.asarray(c)
                      for n, c in recorder.state.columns.items()}
        starts = [c[0] for c in (self.path["t"], self.state["t"]) if len(c)]
        self.t0 = min(starts, default=0.0)

    def write(self, title, summary):
        """Write report.html and its pictures; returns the page's path.

        summary: [(label, text)].
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        plots = [("toolpath", "Toolpath", self.draw_toolpath),
                 ("speed", "Speed of the nozzle", self.draw_speed),
                 ("temperatures", "Temperatures", self.draw_temperatures),
                 ("steprates", "Step rates", self.draw_step_rates),
                 ("margin", "Queue margin", self.draw_margin)]
        for name, _, draw in plots:
            figure = draw()
            figure.savefig(self.folder / (name + ".png"), dpi=DPI)
            self.plt.close(figure)
        page = self.folder / "report.html"
        page.write_text(make_page(title, summary, plots), encoding="utf-8")
        return page

    def _minutes(self, times):
        return (times - self.t0) / 60.0

    def _make_axes(self, ylabel, xlabel="time (min)"):
        figure, axes = self.plt.subplots(figsize=(WIDTH, HEIGHT),
                                         layout="constrained")
        axes.set_xlabel(xlabel)
        axes.set_ylabel(ylabel)
        axes.grid(alpha=0.3)
        return figure, axes

    def draw_toolpath(self):
        """Where the nozzle really went, seen from above, height as color."""
        figure, axes = self._make_axes("y (mm)", "x (mm)")
        figure.set_size_inches(WIDTH, 0.8 * WIDTH)
        keep = self._find_extruding()
        np = self.np
        points = np.column_stack((self.path["x"], self.path["y"]))
        segments = np.stack((points[:-1], points[1:]), axis=1)[keep[1:]]
        lines = self.collections.LineCollection(
            segments, linewidths=0.5, cmap="viridis", alpha=0.8)
        lines.set_array(self.path["z"][1:][keep[1:]])
        axes.add_collection(lines)
        axes.autoscale()
        axes.set_aspect("equal", "datalim")
        if len(segments):
            figure.colorbar(lines, label="z (mm)", shrink=0.7)
        return figure

    def _find_extruding(self):
        """Samples at which filament moved forward; all, if none did."""
        np = self.np
        keep = np.zeros(len(self.path["t"]), bool)
        for name in self.recorder.steppers:
            if name.startswith("extruder") and len(keep) > 1:
                keep[1:] |= np.diff(self.path[name]) > 0
        return keep if keep.any() else np.ones(len(keep), bool)

    def _calc_rate(self, values):
        elapsed = self.np.diff(self.path["t"])
        return values / self.np.maximum(elapsed, 1e-9)

    def draw_speed(self):
        """Nozzle speed from its sampled positions."""
        figure, axes = self._make_axes("speed (mm/s)")
        deltas = [self.np.diff(self.path[n]) for n in "xyz"]
        speed = self._calc_rate(self.np.sqrt(sum(d * d for d in deltas)))
        axes.plot(self._minutes(self.path["t"][1:]), speed, lw=0.4)
        return figure

    def draw_temperatures(self):
        """Measured temperatures and targets, fan speed in per cent."""
        figure, axes = self._make_axes("temperature (degC)")
        minutes = self._minutes(self.state["t"])
        for name in self.recorder.heater_names:
            line, = axes.plot(minutes, self.state[name], label=name)
            axes.plot(minutes, self.state[name + " target"], ls="--", lw=0.8,
                      color=line.get_color())
        axes.plot(minutes, 100.0 * self.state["fan"], lw=0.8, color="gray",
                  label="part fan (%)")
        axes.legend(loc="center right")
        return figure

    def draw_step_rates(self):
        """Net steps per second of every stepper."""
        figure, axes = self._make_axes("steps/s")
        for name in self.recorder.steppers:
            rate = self._calc_rate(self.np.abs(self.np.diff(self.path[name])))
            axes.plot(self._minutes(self.path["t"][1:]), rate, lw=0.4,
                      label=name)
        if self.recorder.steppers:
            legend = axes.legend(loc="upper right")
            for line in legend.get_lines():
                line.set_linewidth(2.0)
        return figure

    def draw_margin(self):
        """How far the steps sent to the mcu reach ahead of its clock."""
        figure, axes = self._make_axes("planned ahead (s)")
        axes.plot(self._minutes(self.state["t"]), self.state["margin"], lw=0.8)
        axes.set_ylim(bottom=0.0)
        return figure


def make_page(title, summary, plots):
    """Text of report.html."""
    rows = "\n".join("<tr><td>%s</td><td>%s</td></tr>"
                     % (html.escape(label), html.escape(str(text)))
                     for label, text in summary)
    pictures = "\n".join(
        '<h2>%s</h2>\n<img src="%s.png" alt="%s">'
        % (html.escape(text), name, html.escape(text))
        for name, text, _ in plots)
    return ("<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">"
            "\n<title>%s</title>\n<style>%s</style></head>\n<body>\n<h1>%s</h1>"
            "\n<table>\n%s\n</table>\n%s\n</body></html>\n"
            % (html.escape(title), STYLE, html.escape(title), rows, pictures))
