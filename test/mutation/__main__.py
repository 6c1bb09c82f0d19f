# SPDX-License-Identifier: GPL-3.0-or-later
"""Do the firmware's tests see faults?  Make some, and count.

    python test/mutation --count 100 --seed 1

Each fault is one small change of one line in the firmware's core.  The changed
file is compiled into a host build of the firmware, and the tests of that part
run until the first fails, which is what should happen.  Faults that the
compiler turns into the same program are passed over; so are those argued, one
by one, to change nothing in equivalent.txt.
"""

import argparse
import os
import random
import sys

import builds
import checks
from campaign import Campaign, read_equivalent, report
from mutants import list_mutants


def parse_args(argv):
    parser = argparse.ArgumentParser(
        prog="test/mutation", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100,
                        help="faults to try (default 100; 0: all)")
    parser.add_argument("--seed", type=int, default=1,
                        help="which ones (default 1)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--minimum", type=float, default=90.,
                        help="percent to be caught (default 90)")
    parser.add_argument("--file", choices=sorted(checks.CHECKS), action="append",
                        help="only faults in this source; may be repeated")
    parser.add_argument("--operator", action="append",
                        help="only faults of this kind; may be repeated")
    parser.add_argument("--list", action="store_true",
                        help="list the faults, try none")
    return parser.parse_args(argv)


def choose_mutants(args, variants):
    """All faults that fit the arguments, in the order of the seed."""
    found = []
    for path in args.file or sorted(checks.CHECKS):
        active = variants["simulator"].list_active_lines(path)
        found += list_mutants(path, (builds.ROOT / path).read_text(),
                              active.__contains__)
    if args.operator:
        found = [m for m in found if m.operator in args.operator]
    random.Random(args.seed).shuffle(found)
    return found


def main(argv=None):
    args = parse_args(argv)
    variants = builds.make_variants()
    mutants = choose_mutants(args, variants)
    if args.list:
        print("\n".join(map(str, mutants)))
        return 0
    campaign = Campaign(variants, mutants, args.count or len(mutants),
                        read_equivalent())
    failure = campaign.check_pristine()
    if failure:
        print("this fails without any fault: " + failure)
        return 2
    campaign.run(args.jobs)
    caught, total = report(campaign), len(campaign.results)
    print("caught %d of %d (seed %d)" % (caught, total, args.seed))
    return caught < args.minimum / 100. * total


if __name__ == "__main__":
    sys.exit(main())
