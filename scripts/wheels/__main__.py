# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds wheels for several Pythons and architectures, and tries each.

usage: python scripts/wheels [--list] [--no-smoke] [--again] [--jobs N] [PATTERN ...]

A pattern is a name such as cp311-aarch64, or `cp311-*`.  Wheels are left in
dist/.  What was made from the same sources before is not made again.  The
exit status is 1 if a wheel that was asked for is not there, or does not work.
"""

import argparse
import concurrent.futures
import os
import sys

from making import BUILD, Progress, make_one
from targets import list_targets


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("patterns", nargs="*", metavar="PATTERN")
    parser.add_argument("--list", action="store_true", help="print the names")
    parser.add_argument("--no-smoke", action="store_true", help="only build")
    parser.add_argument("--again", action="store_true",
                        help="build each once more elsewhere and compare the bytes")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1,
                        metavar="N", help="wheels at a time (default: cores)")
    options = parser.parse_args()
    try:
        options.targets = list_targets(options.patterns)
    except ValueError as err:
        parser.error(str(err))
    # what fewer wheels than cores leave goes to each one's compilers
    options.jobs = max(1, min(options.jobs, len(options.targets)))
    options.n_compilers = max(1, (os.cpu_count() or 1) // options.jobs)
    return options


def make_all(options):
    """Make all wheels; returns the exit status."""
    from building import BuildError, translate
    progress = Progress(len(options.targets))
    BUILD.mkdir(parents=True, exist_ok=True)
    progress.tell("all", "translating to C")
    try:
        translate(BUILD / "translate.txt")
    except BuildError as err:
        sys.exit("Cython: %s" % (err,))
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        results = list(pool.map(
            lambda target: make_one(target, options, progress),
            options.targets))
    print()
    for target, result in zip(options.targets, results, strict=True):
        print("%-15s %s" % (target.name, result.text))
    return 0 if all(result.is_good for result in results) else 1


def main():
    """Returns the exit status."""
    options = parse_options()
    if options.list:
        print("\n".join(target.name for target in options.targets))
        return 0
    return make_all(options)


if __name__ == "__main__":
    sys.exit(main())
