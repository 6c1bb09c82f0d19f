# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy demo`: print our sample on our simulated machine."""
from klippy.cli import simulate

HELP = "print the sample cube on the simulated machine"
SAMPLE_CONFIG = "sample-cartesian.cfg"
SAMPLE_JOB = "samples/cube20.gcode"


def add_arguments(parser):
    """Options of `klippy demo`."""
    parser.add_argument("job", nargs="?", help="G-code file to print instead")
    parser.add_argument("--config", metavar="FILE",
                        help="printer.cfg to use instead")
    simulate.add_common_arguments(parser)


def run(args):
    """Run the command; returns the exit status."""
    from klippy.simulator.samples import find_sample
    config = args.config or find_sample(SAMPLE_CONFIG)
    job = args.job or find_sample(SAMPLE_JOB)
    return simulate.run_session(args, config, job)
