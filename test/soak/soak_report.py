# SPDX-License-Identifier: GPL-3.0-or-later
"""What a soak tells in the end."""
import time


def make_summary(soak):
    """Text: outcomes, what was done, memory, faults."""
    gauges = soak.gauges
    hours = gauges.at_jobs[-1][1] / 3600. if gauges.at_jobs else 0.
    lines = [
        "", "%d jobs in %.1f virtual hours, %.0f s; %d starts of the printer" % (
            soak.number, hours, time.monotonic() - soak.wall_start, soak.boots),
        "outcomes:   " + format_counts(soak.outcomes),
        "deeds:      " + format_counts(soak.deeds),
        "refused:    %d commands; explained lines of error: %d"
        % (soak.n_refused, soak.judge.n_explained),
        "rss:        %s MB (median of each quarter)" % ", ".join(
            "%.1f" % value for value in gauges.list_rss_quarters()),
        "at the end: %d descriptors, %d threads" % gauges.at_jobs[-1][3:]]
    if gauges.at_boots:
        lines.append("between printers, first and last: " + ", ".join(
            "%s %d %d" % (name, gauges.at_boots[0][name], gauges.at_boots[-1][name])
            for name in gauges.at_boots[0]))
    lines.append("faults:     %d" % len(soak.faults))
    return "\n".join(lines + ["  " + fault for fault in soak.faults])


def format_counts(counter):
    return ", ".join("%s %d" % pair for pair in counter.most_common())


def plot(gauges, path):
    """Memory and descriptors over virtual time, as a picture."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    hours = [reading[1] / 3600. for reading in gauges.at_jobs]
    figure, (upper, lower) = pyplot.subplots(2, sharex=True, figsize=(9, 6))
    upper.plot(hours, [reading[2] / 1024. for reading in gauges.at_jobs])
    upper.set_ylabel("RSS, MB")
    upper.set_ylim(bottom=0)
    lower.step(hours, [reading[3] for reading in gauges.at_jobs], label="descriptors")
    lower.step(hours, [reading[4] for reading in gauges.at_jobs], label="threads")
    lower.set_ylim(bottom=0)
    lower.set_xlabel("virtual hours")
    lower.legend()
    figure.tight_layout()
    figure.savefig(path)
