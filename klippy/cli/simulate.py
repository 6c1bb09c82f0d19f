# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy simulate`: print a file on the simulated machine of a config."""
import logging
import sys

from klippy import plugins
from klippy.cli import check
from klippy.errors import ConfigError, PrinterError

DEFAULT_WEB_PORT = 7130
HELP = "print a file on the simulated machine of a printer.cfg"


def add_common_arguments(parser):
    """Options of `simulate` and `demo`."""
    parser.add_argument(
        "--speed", type=float, default=0.0, metavar="N",
        help="virtual seconds a real one (1: real time; default: as fast as"
             " it goes)")
    parser.add_argument("--report", metavar="DIR",
                        help="write report.html and its plots into DIR")
    parser.add_argument("--seed", type=int, metavar="N",
                        help="seed of the simulated world")
    parser.add_argument("--api-server", metavar="PATH",
                        help="serve the API socket at PATH, also after the"
                             " print, until interrupted")
    parser.add_argument("--web", nargs="?", type=int, const=DEFAULT_WEB_PORT,
                        metavar="PORT",
                        help="show the printer on a web page of this computer, also"
                             " after the print, until interrupted (port %d; real time"
                             " unless --speed says another)" % (DEFAULT_WEB_PORT,))
    parser.add_argument("--log", metavar="FILE", help="write the log to FILE")


def add_arguments(parser):
    """Options of `klippy simulate`."""
    parser.add_argument("config", help="printer.cfg")
    parser.add_argument("job", help="G-code file")
    add_common_arguments(parser)


def run(args):
    """Run the command; returns the exit status."""
    return run_session(args, args.config, args.job)


def run_session(args, config, job):
    """Simulate a job with the common options; returns the exit status."""
    from klippy.printer import Printer
    from klippy.simulator.session import SessionOptions, SimSession
    plugins.install()
    try:
        setup_log(args.log)
    except OSError as err:
        print("Error: unable to write the log '%s': %s" % (args.log, err.strerror),
              file=sys.stderr)
        return 1
    options = SessionOptions(
        config=config, job=job, speed=args.speed, seed=args.seed,
        report=args.report, api_server=args.api_server, log_file=args.log,
        web_port=args.web)
    session = SimSession(options, sys.stdout, Printer)
    try:
        return session.run()
    except ConfigError as e:
        # the machine has no places of options; loading the config has them
        for err in check.check(config)[0] or [e]:
            print("Error: %s" % (err,), file=sys.stderr)
        return 1
    except PrinterError as e:
        print("Error: %s" % (e,), file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        session.display.write_message("Interrupted")
        return 0 if session.result is not None and session.result.is_ok else 130


def setup_log(path):
    """Send the log to a file, or nowhere: the terminal is for progress."""
    if path is None:
        logging.getLogger().addHandler(logging.NullHandler())
        return
    logging.basicConfig(filename=path, level=logging.INFO,
                        format="%(levelname)s %(message)s")
