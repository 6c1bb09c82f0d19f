# SPDX-License-Identifier: GPL-3.0-or-later
"""Firmware of a PRU is loaded by Linux on the same chip (remoteproc)."""

import pathlib

from klippy.errors import PrinterError

# Its names of the cores: by the address of their control registers
CORES = ("4a334000.pru", "4a338000.pru")


def find_cores(root="/"):
    """Folders of both PRUs in /sys; PrinterError if Linux has none."""
    found = {}
    for place in pathlib.Path(root, "sys/class/remoteproc").glob("remoteproc*"):
        found[(place / "name").read_text(encoding="utf-8").strip()] = place
    missing = [name for name in CORES if name not in found]
    if missing:
        raise PrinterError(
            "Linux knows no PRU '%s': run this on the BeagleBone, with the overlay"
            " of its /boot/uEnv.txt that enables the PRUs by remoteproc (AM335X-PRU-"
            "RPROC), not uio" % ("', '".join(missing),))
    return [found[name] for name in CORES]


def stop(core):
    """A core may stand still already, which is no error."""
    state = core / "state"
    if state.read_text(encoding="utf-8").strip() == "running":
        state.write_text("stop", encoding="utf-8")


def install(target, root="/"):
    """Give both cores their programs and start them; Linux does so at each start
    of the computer from then on."""
    cores = find_cores(root)
    names = ["am335x-pru%d-fw" % (i,) for i in range(len(cores))]
    programs = [target.find_file("%d.elf" % (i,), "pru") for i in range(len(cores))]
    try:
        for core in cores:
            stop(core)
        for name, program in zip(names, programs, strict=True):
            path = pathlib.Path(root, "lib/firmware", name)
            path.write_bytes(program.read_bytes())
            print("  %s" % (path,))
        for core, name in zip(cores, names, strict=True):
            (core / "firmware").write_text(name, encoding="utf-8")
            (core / "state").write_text("start", encoding="utf-8")
    except OSError as err:
        raise PrinterError("Cannot install firmware of the PRUs in '%s': %s (sudo make"
                           " flash?)" % (err.filename, err.strerror)) from None
    print("  both PRUs run; the mcu's serial port is /dev/rpmsg_pru30")
