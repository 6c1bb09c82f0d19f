# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts that make the daemon a service: systemd units and udev rules."""

import dataclasses
import pathlib

# Works installed and in a checkout, whatever the working directory is
LAUNCHER = str(pathlib.Path(__file__).resolve().parents[1] / "klippy.py")

UNIT = """\
# Made by `klippy install-service`.  Own settings belong into a drop-in:
# systemctl edit {name}
[Unit]
Description=Printer control (klippy){instance}
Documentation=https://www.freedesktop.org/software/systemd/man/systemd.service.html
After=network-online.target
Wants=network-online.target
StartLimitIntervalSec=0

[Service]
Type=notify
NotifyAccess=main
User={user}
{groups}WorkingDirectory={data}
ExecStart={python} {launcher} run {data}/config/printer.cfg \\
    --logfile {data}/logs/klippy.log --api-server {data}/comms/klippy.sock \\
    --input-tty {data}/comms/klippy.serial
Restart=always
RestartSec=2
WatchdogSec=30
TimeoutStopSec=20

# Real time
LimitRTPRIO=50
LimitMEMLOCK=infinity
LimitNOFILE=4096
OOMScoreAdjust=-700
CPUWeight=500
IOWeight=500

# What it needs, and nothing more; /tmp: links to other mcus, measurements
UMask=0027
CapabilityBoundingSet=
AmbientCapabilities=
NoNewPrivileges=yes
ProtectSystem=strict
ProtectHome=read-only
ReadWritePaths={data} /tmp
CacheDirectory=klippy
Environment=KLIPPY_CACHE=%C/klippy
DevicePolicy=closed
{devices}
ProtectClock=yes
ProtectControlGroups=yes
ProtectHostname=yes
ProtectKernelLogs=yes
ProtectKernelModules=yes
ProtectKernelTunables=yes
ProtectProc=invisible
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_CAN
RestrictNamespaces=yes
RestrictSUIDSGID=yes
LockPersonality=yes
MemoryDenyWriteExecute=yes
KeyringMode=private
RemoveIPC=yes
SystemCallArchitectures=native
SystemCallFilter=@system-service
SystemCallErrorNumber=EPERM

[Install]
WantedBy=multi-user.target
"""
# Serial ports, terminals of linux processes, and the pins of this computer
DEVICES = ("char-ttyUSB", "char-ttyACM", "char-ttyAMA", "char-ttyS", "char-pts",
           "char-ptm", "char-gpiochip", "char-spi", "char-i2c")
# Groups that own such devices, where a machine has them
GROUPS = ("dialout", "tty", "gpio", "spi", "i2c")

RULES = """\
# Made by `klippy install-service`: boards of printers, for the group {group}.
# ModemManager is told to leave them alone.
SUBSYSTEM!="tty|usb", GOTO="klippy_end"
"""
TTY_RULE = ('SUBSYSTEM=="tty", ATTRS{{idVendor}}=="{vendor}", {product}'
            'GROUP="{group}", MODE="0660", ENV{{ID_MM_DEVICE_IGNORE}}="1"')
BOOT_RULE = ('SUBSYSTEM=="usb", ATTR{{idVendor}}=="{vendor}", '
             'ATTR{{idProduct}}=="{product}", GROUP="{group}", MODE="0660"')
# (vendor, product or None for all, what it is) of USB serial ports
TTYS = (("1d50", "614e", "boards with this firmware"),
        ("1d50", "606f", "CAN adapters"),
        ("1a86", None, "CH340 serial chips"),
        ("0403", None, "FTDI serial chips"),
        ("10c4", None, "CP210x serial chips"),
        ("2341", None, "Arduino boards"),
        ("03eb", None, "Atmel boards"),
        ("2c99", None, "Prusa boards"),
        ("0483", "5740", "STM32 virtual serial ports"))
BOOTLOADERS = (("0483", "df11", "STM32 bootloader (DFU)"),
               ("2e8a", "0003", "RP2040 bootloader"),
               ("2e8a", "000f", "RP2350 bootloader"),
               ("03eb", "6124", "SAM-BA bootloader"),
               ("1d50", "6177", "Katapult bootloader"))


@dataclasses.dataclass(frozen=True)
class Service:
    """What a unit depends on.

    data: the printer_data folder; in a template it holds %i, the printer's name.
    """

    user: str
    data: str
    python: str
    name: str = "klipper"
    is_template: bool = False
    groups: tuple = ()

    @property
    def file_name(self):
        return "%s%s.service" % (self.name, "@" if self.is_template else "")

    def make_unit(self):
        """Text of the unit file."""
        groups = "SupplementaryGroups=%s\n" % (" ".join(self.groups),)
        return UNIT.format(
            name=self.file_name, user=self.user, data=self.data,
            python=_quote(self.python), launcher=_quote(LAUNCHER),
            instance=" of %i" if self.is_template else "",
            groups=groups if self.groups else "",
            devices="\n".join("DeviceAllow=%s rw" % (name,) for name in DEVICES))


def _quote(path):
    """A path as a word of a unit file."""
    return path.replace("%", "%%").replace(" ", "\\x20")


def make_rules(group="dialout"):
    """Text of the udev rules."""
    lines = [RULES.format(group=group).rstrip("\n")]
    for vendor, product, name in TTYS:
        wanted = 'ATTRS{idProduct}=="%s", ' % (product,) if product else ""
        lines += ["# " + name, TTY_RULE.format(vendor=vendor, product=wanted,
                                               group=group)]
    for vendor, product, name in BOOTLOADERS:
        lines += ["# " + name, BOOT_RULE.format(vendor=vendor, product=product,
                                                group=group)]
    return "\n".join([*lines, 'LABEL="klippy_end"']) + "\n"
