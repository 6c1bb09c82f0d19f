# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy log`: what a log holds; its configs, shutdowns and statistics as files."""

import csv
import pathlib
import sys

from klippy.cli import forget_stdout, log_reader

HELP = "sum up a log; extract configs, shutdowns, statistics"


def add_arguments(parser):
    """Options of `klippy log`."""
    parser.add_argument("logs", nargs="+", metavar="LOG",
                        help="log files, the oldest first")
    parser.add_argument("--out", metavar="DIR",
                        help="write config-N.cfg, shutdown-N.log, stats-N.csv into DIR")


def run(args):
    """Run the command; returns the exit status."""
    try:
        starts = log_reader.read_logs(args.logs)
        if not starts:
            print("klippy log: there is no printer in this log", file=sys.stderr)
            return 1
        for number, start in enumerate(starts, 1):
            print("\n".join(sum_up(number, start)))
        if args.out:
            extract(starts, pathlib.Path(args.out))
    except BrokenPipeError:
        forget_stdout()
    except OSError as err:
        print("klippy log: %s" % (err,), file=sys.stderr)
        return 1
    return 0


def sum_up(number, start):
    """Lines about one start."""
    n_sections = sum(line.startswith("[") for line in start.config.splitlines())
    yield "Start %d: %d sections, %d lines of statistics" % (
        number, n_sections, len(start.stats))
    times, cpu = start.get_series("", "cputime")
    if len(times) > 1 and times[-1] > times[0]:
        yield "  %.0f s; host %.1f %% of a core" % (
            times[-1] - times[0], 100. * (cpu[-1] - cpu[0]) / (times[-1] - times[0]))
    for mcu in start.list_groups("bytes_retransmit"):
        last = start.stats[-1].groups.get(mcu, {})
        yield "  %s: %d bytes sent, %d of them again, %d bytes invalid" % (
            mcu, last.get("bytes_write", 0), last.get("bytes_retransmit", 0),
            last.get("bytes_invalid", 0))
    _, stalls = start.get_series("", "print_stall")
    if stalls and stalls[-1]:
        yield "  %d stalls: the host was late" % (stalls[-1],)
    for shutdown in start.shutdowns:
        yield "  shutdown at %.1f: %s" % (shutdown.eventtime, shutdown.cause)


def extract(starts, folder):
    """Write the parts of the log as files; equal configs only once."""
    folder.mkdir(parents=True, exist_ok=True)
    n_shutdowns, configs = 0, []
    for number, start in enumerate(starts, 1):
        if start.config and start.config not in configs:
            configs.append(start.config)
            _write(folder / ("config-%d.cfg" % (number,)), start.config + "\n")
        for shutdown in start.shutdowns:
            n_shutdowns += 1
            _write(folder / ("shutdown-%d.log" % (n_shutdowns,)),
                   "\n".join(shutdown.lines) + "\n")
        if start.stats:
            write_stats(folder / ("stats-%d.csv" % (number,)), start.stats)


def _write(path, text):
    path.write_text(text, encoding="utf-8")
    print("wrote %s" % (path,))


def write_stats(path, stats):
    """Write statistics as a table with a column for each number."""
    columns = list(dict.fromkeys((group, key) for entry in stats
                                 for group, values in entry.groups.items()
                                 for key in values))
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(["eventtime", *("%s.%s" % column if column[0] else column[1]
                                       for column in columns)])
        for entry in stats:
            table.writerow([entry.eventtime, *(
                entry.groups.get(group, {}).get(key, "") for group, key in columns)])
    print("wrote %s" % (path,))
