# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy graph`: plots of a log, of accelerometer data, or of bed meshes.

What a file is shows its text: CSV with the known columns, JSON, a config or a log.
"""

import pathlib
import sys

from klippy.cli import accel_data, graph_accel, graph_mesh, log_reader
from klippy.errors import PrinterError

HELP = "plot a log (load, bandwidth, temperatures, motion), accelerometer data, meshes"
MESH_SIZE = (8., 6.5)
HEAD = 4096                 # characters of a file that show what it is
MESH = "mesh"               # in place of plots: meshes of the log's config
SIZE = (11., 3.)            # inches of one plot
PERCENT = 100.


def add_arguments(parser):
    """Options of `klippy graph`."""
    parser.add_argument("logs", nargs="+", metavar="LOG",
                        help="log files, the oldest first; or a .csv of an"
                             " accelerometer; or a printer.cfg or a status (.json)"
                             " with bed meshes")
    parser.add_argument("-o", "--output", metavar="FILE", default="klippy.png",
                        help="image to write, .png, .svg or .pdf (%(default)s)")
    parser.add_argument("--plots", default=",".join(PLOTS), metavar="NAMES",
                        help="which ones, with commas between (%(default)s)")
    parser.add_argument("--start", type=int, metavar="N",
                        help="only the N-th start of the printer (see klippy log)")


def run(args):
    """Run the command; returns the exit status."""
    try:
        names = choose_plots(args.plots)
        if not draw_other(args.logs, args.plots == MESH, args.output):
            starts = choose_starts(log_reader.read_logs(args.logs), args.start)
            draw(starts, names, args.output)
    except OSError as err:
        print("klippy graph: '%s': %s" % (err.filename or args.output, err.strerror),
              file=sys.stderr)
        return 1
    except (PrinterError, ValueError) as err:
        print("klippy graph: %s" % (err,), file=sys.stderr)
        return 1
    print("wrote %s" % (args.output,))
    return 0


def choose_plots(text):
    """Names of plots out of a text with commas.  Raises PrinterError."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in PLOTS and text != MESH:
            raise PrinterError("there is no plot '%s'; there are %s, and mesh alone"
                               % (name, ", ".join(PLOTS)))
    if not names:
        raise PrinterError("name a plot: %s" % (", ".join(PLOTS),))
    return names


def choose_starts(starts, number):
    """The starts to plot: all with statistics, or one.  Raises PrinterError."""
    if number is not None:
        if not 1 <= number <= len(starts):
            raise PrinterError("the log has %d starts, not one of number %d"
                               % (len(starts), number))
        starts = [starts[number - 1]]
    starts = [start for start in starts if len(start.stats) > 1]
    if not starts:
        raise PrinterError("there are no statistics in the log")
    return starts


def calc_rates(times, values):
    """(times, values a second) between samples of a counter that only grows."""
    rates = [((b - a) / (t - s), t) for s, t, a, b in zip(
        times, times[1:], values, values[1:], strict=False) if t > s and b >= a]
    return [t for _, t in rates], [rate for rate, _ in rates]


class Timeline:
    """Puts the starts one after the other: their clocks may begin anew."""

    def __init__(self, starts):
        self.starts, self.offsets, end = starts, [], 0.
        for start in starts:
            first = start.stats[0].eventtime
            offset = end - first if first < end else 0.
            self.offsets.append(offset)
            end = start.stats[-1].eventtime + offset

    def list_groups(self, key):
        """Groups with a key in any start."""
        return list(dict.fromkeys(group for start in self.starts
                                  for group in start.list_groups(key)))

    def get_series(self, group, key, is_rate=False):
        """(times, values) over all starts, with a gap (nan) between them."""
        all_times, all_values = [], []
        for start, offset in zip(self.starts, self.offsets, strict=True):
            times, values = start.get_series(group, key)
            if is_rate:
                times, values = calc_rates(times, values)
            if all_times and times:
                all_times.append(times[0] + offset)
                all_values.append(float("nan"))
            all_times += [time + offset for time in times]
            all_values += values
        return all_times, all_values


def plot_load(axes, timeline):
    """Share of a core that the host takes, and of the time that mcus are awake."""
    times, values = timeline.get_series("", "cputime", True)
    axes.plot(times, [PERCENT * value for value in values], label="host")
    for mcu in timeline.list_groups("mcu_awake"):
        times, values = timeline.get_series(mcu, "mcu_awake")
        axes.plot(times, [PERCENT * value for value in values], label=mcu)
    axes.set_ylabel("load, %")


def plot_bandwidth(axes, timeline):
    """Bytes a second on the links; what was sent again is drawn too."""
    for mcu in timeline.list_groups("bytes_write"):
        for key, text, style in (("bytes_write", "to", "-"),
                                 ("bytes_read", "from", "--"),
                                 ("bytes_retransmit", "again to", ":")):
            axes.plot(*timeline.get_series(mcu, key, True), style,
                      label="%s %s" % (text, mcu))
    axes.set_ylabel("bytes/s")


def plot_temperatures(axes, timeline):
    """Temperatures, and targets as dashed lines."""
    for name in timeline.list_groups("temp"):
        line, = axes.plot(*timeline.get_series(name, "temp"), label=name)
        times, targets = timeline.get_series(name, "target")
        if any(targets):
            axes.plot(times, targets, "--", color=line.get_color(), linewidth=0.8)
    axes.set_ylabel("degC")


def plot_motion(axes, timeline):
    """Seconds of motion planned ahead, and stalls."""
    axes.plot(*timeline.get_series("", "buffer_time"), label="planned ahead")
    axes.set_ylabel("s")
    others = axes.twinx()
    others.plot(*timeline.get_series("", "print_stall"), "r:")
    others.set_ylabel("stalls", color="r")
    others.set_ylim(bottom=0.)


PLOTS = {"load": plot_load, "bandwidth": plot_bandwidth,
         "temperatures": plot_temperatures, "motion": plot_motion}


def draw_other(paths, wants_mesh, output):
    """Draw a file that is no log, or the meshes of a log; False for plots of a log."""
    with open(paths[0], errors="replace") as stream:
        first = stream.read(HEAD).strip().partition("\n")[0]
    is_csv = accel_data.find_kind(first) is not None
    if not is_csv and paths[0].endswith(".csv"):
        raise PrinterError("%s is no accelerometer data: it must begin with %s or"
                           " %s" % (
            paths[0], ",".join(accel_data.RAW_COLUMNS),
            ",".join(accel_data.PSD_COLUMNS)))
    is_config = paths[0].endswith(".cfg")
    if not (is_csv or is_config or wants_mesh or first.startswith("{")):
        return False
    if len(paths) > 1:
        raise PrinterError("one such file at a time: %s" % (" ".join(paths),))
    pyplot = load_pyplot()
    figure = pyplot.figure(layout="constrained")
    text = pathlib.Path(paths[0]).read_text(errors="replace").strip()
    try:
        if is_csv:
            figure.set_size_inches(SIZE[0], 2.5 * SIZE[1])
            graph_accel.draw(figure, paths[0], text.splitlines())
        else:
            meshes = read_meshes(paths[0], text, first.startswith("{"), is_config)
            figure.set_size_inches(MESH_SIZE[0], MESH_SIZE[1] * len(meshes))
            graph_mesh.draw(figure, meshes)
        figure.savefig(output, dpi=110)
    finally:
        pyplot.close(figure)
    return True


def read_meshes(path, text, is_json, is_config):
    """Meshes of a status, a config, or the last config in a log."""
    if is_json:
        return graph_mesh.read_status(text)
    if not is_config:
        starts = [start for start in log_reader.read_logs([path]) if start.config]
        if not starts:
            raise PrinterError("there is no config in '%s'" % (path,))
        text = starts[len(starts) - 1].config
    meshes = graph_mesh.read_config(path, text)
    if not meshes:
        raise PrinterError("there is no section [bed_mesh <name>] in '%s': meshes get"
                           " there by BED_MESH_PROFILE SAVE and SAVE_CONFIG" % (path,))
    return meshes


def load_pyplot():
    """The plotting library.  Raises PrinterError without it."""
    try:
        import matplotlib
        matplotlib.use("Agg")
        from matplotlib import pyplot
    except ImportError as err:
        raise PrinterError("plots need matplotlib: run pip install"
                           " 'klippy-host[plots]' (%s)" % (err,))
    return pyplot


def draw(starts, names, path):
    """Draw plots below each other, shutdowns as red lines, into a file."""
    pyplot = load_pyplot()
    timeline = Timeline(starts)
    figure, all_axes = pyplot.subplots(
        len(names), 1, sharex=True, squeeze=False, layout="constrained",
        figsize=(SIZE[0], SIZE[1] * len(names)))
    for name, axes in zip(names, all_axes[:, 0], strict=True):
        PLOTS[name](axes, timeline)
        axes.grid(alpha=0.3)
        axes.legend(loc="upper left", fontsize="small")
        for start, offset in zip(starts, timeline.offsets, strict=True):
            for shutdown in start.shutdowns:
                axes.axvline(shutdown.eventtime + offset, color="r", linewidth=0.8)
    all_axes[-1, 0].set_xlabel("s")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
