# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy install-service`: have systemd start the daemon with the machine.

Writes the unit, the udev rules and the printer_data folder; what it did is
printed, so that the same can be done by hand.
"""

import getpass
import grp
import os
import pathlib
import pwd
import re
import shutil
import subprocess
import sys

from klippy.cli import service_files

HELP = "have systemd start the daemon with the machine"
FOLDERS = ("config", "logs", "gcodes", "comms", "systemd")
UNIT_FOLDER = "etc/systemd/system"
RULES_PATH = "etc/udev/rules.d/60-klippy.rules"
NAME = re.compile(r"[A-Za-z0-9_.-]+\Z")


def add_arguments(parser):
    """Options of `klippy install-service`."""
    parser.add_argument("--user", default=os.environ.get("SUDO_USER"),
                        help="user that the daemon runs as (default: who calls)")
    parser.add_argument("--data", metavar="DIR",
                        help="folder of the printer (default: ~/printer_data of the"
                             " user)")
    parser.add_argument("--name", default="klipper",
                        help="name of the service (%(default)s)")
    parser.add_argument("--template", action="store_true",
                        help="a unit for several printers: NAME@<printer>, with data"
                             " in <DIR>_<printer>")
    parser.add_argument("--printer", metavar="PRINTER", action="append", default=[],
                        help="with --template: a printer to set up")
    parser.add_argument("--root", metavar="DIR", default="/",
                        help="write below DIR, as for an image, and start nothing")
    parser.add_argument("--no-start", action="store_true",
                        help="enable, but do not start the service")
    parser.add_argument("--print", dest="is_print", action="store_true",
                        help="only print the unit and the rules")


def run(args):
    """Run the command; returns the exit status."""
    try:
        installer = Installer(args)
        if args.is_print:
            print(installer.service.make_unit())
            print(service_files.make_rules())
            return 0
        installer.write_files()
        if installer.root == pathlib.Path("/"):
            installer.start()
    except PermissionError as err:
        return complain("%s: call it with sudo" % (err,))
    except (OSError, ValueError, subprocess.CalledProcessError) as err:
        return complain(str(err))
    return 0


def complain(text):
    """Print why it cannot be done; returns the exit status."""
    print("klippy install-service: %s" % (text,), file=sys.stderr)
    return 1


def find_groups():
    """Those groups of devices that there are on this machine."""
    known = {entry.gr_name for entry in grp.getgrall()}
    return tuple(name for name in service_files.GROUPS if name in known)


class Installer:
    """Checks the options, then writes files.  Raises ValueError, OSError."""

    def __init__(self, args):
        self.args, self.root = args, pathlib.Path(args.root).absolute()
        for what, name in (("--name", args.name), *(
                ("--printer", name) for name in args.printer)):
            if not NAME.match(name):
                raise ValueError("%s consists of letters, digits and _.-, not '%s'"
                                 % (what, name))
        if args.printer and not args.template:
            raise ValueError("--printer belongs to --template")
        self.account = self._find_account(args.user or getpass.getuser())
        data = args.data or os.path.join(self.account.pw_dir, "printer_data")
        if not os.path.isabs(data) or re.search(r"[\s%\"'\\]", data):
            raise ValueError("--data is an absolute path without spaces, quotes and"
                             " percent signs, not '%s'" % (data,))
        self.data = data.rstrip("/")
        self.service = service_files.Service(
            user=self.account.pw_name, python=sys.executable, name=args.name,
            data=self.data + ("_%i" if args.template else ""),
            is_template=args.template, groups=find_groups())

    @staticmethod
    def _find_account(user):
        try:
            return pwd.getpwnam(user)
        except KeyError:
            raise ValueError("there is no user '%s'" % (user,))

    def write_files(self):
        """Write the unit, the rules and the folders."""
        self._write(self.root / UNIT_FOLDER / self.service.file_name,
                    self.service.make_unit())
        self._write(self.root / RULES_PATH, service_files.make_rules())
        folders = ["%s_%s" % (self.data, name) for name in self.args.printer]
        for folder in folders if self.args.template else [self.data]:
            self._make_data(folder)

    def _make_data(self, folder):
        """Make the folders of a printer; they belong to the user."""
        base = self.root / folder.lstrip("/")
        for path in (base, *(base / name for name in FOLDERS)):
            if not path.is_dir():
                path.mkdir(parents=True)
                if os.geteuid() == 0:
                    os.chown(path, self.account.pw_uid, self.account.pw_gid)
                print("made %s" % (path,))
        if not (base / "config" / "printer.cfg").exists():
            print("put the config of the printer into %s"
                  % (base / "config" / "printer.cfg",))

    @staticmethod
    def _write(path, text):
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(path.name + ".part")
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)
        print("wrote %s" % (path,))

    def start(self):
        """Have systemd and udev read what is new, and start the services."""
        names = [self.service.file_name]
        if self.args.template:
            names = ["%s@%s.service" % (self.args.name, name)
                     for name in self.args.printer]
        commands = [["systemctl", "daemon-reload"]]
        if names:
            now = [] if self.args.no_start else ["--now"]
            commands.append(["systemctl", "enable", *now, *names])
        for command in commands:
            print(" ".join(command))
            subprocess.run(command, check=True)
        if shutil.which("udevadm"):
            command = ["udevadm", "control", "--reload"]
            print(" ".join(command))
            # a container has no udev of its own: the service runs all the same
            if subprocess.run(command).returncode:
                print("udev is not running: its rules count once it is")
