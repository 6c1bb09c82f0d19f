# SPDX-License-Identifier: GPL-3.0-or-later
"""A virtual machine with Debian's kernel, for what only a kernel can show.

It boots in an emulator (QEMU's TCG), sees this machine's files (9p, read only), and
runs one Python program of test/vm/guest, whose output comes back over a serial
port.  Its time is the count of its instructions: how busy this machine is makes no
difference.  Nothing of it touches this machine's kernel.
"""

import os
import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
KERNEL = pathlib.Path(os.environ.get("KLIPPY_VM_KERNEL")
                      or pathlib.Path.home() / ".cache" / "klippy-vm")
BUSYBOX = pathlib.Path("/bin/busybox")
TIMEOUT = 600                   # s, of a machine that hangs
# For the files of this machine
BASE_MODULES = ("virtio_pci", "9pnet_virtio", "9p")
END = "end of the virtual machine:"

INIT = """#!/bin/busybox sh
export PATH=/bin:/sbin:/usr/bin:/usr/sbin
/bin/busybox --install -s /bin
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev
mkdir -p /host /dev/pts /dev/shm
for module in %(modules)s; do insmod /modules/$module.ko || echo "no $module"; done
mount -t 9p -o ro,trans=virtio,version=9p2000.L,cache=loose,msize=524288 host /host
for place in proc sys dev; do mount --bind /$place /host/$place; done
mount -t devpts devpts /host/dev/pts
for place in dev/shm mnt run media; do mount -t tmpfs tmpfs /host/$place; done
ip link set lo up
chroot /host /bin/sh -c 'cd %(root)s && export HOME=/mnt TMPDIR=/mnt \\
  PYTHONDONTWRITEBYTECODE=1 PATH=/usr/sbin:/usr/bin:/sbin:/bin && %(command)s' 2>&1
echo "%(end)s $?"
poweroff -f
"""


def why_not():
    """What is missing for a virtual machine, or an empty text."""
    if not shutil.which("qemu-system-x86_64"):
        return "needs qemu-system-x86"
    if not BUSYBOX.exists() or b"\0/lib64/ld-linux" in BUSYBOX.read_bytes()[:4096]:
        return "needs busybox-static"
    if not (KERNEL / "vmlinuz").exists():
        return "needs Debian's kernel: sh scripts/fetch_vm_kernel.sh"
    return ""


def find_modules(names):
    """Paths of modules and of what they need, in the order to load them."""
    everything = {path.stem.replace("-", "_"): path
                  for path in (KERNEL / "modules").rglob("*.ko")}
    found = {}

    def add(name):
        if name not in found:
            for word in read_depends(everything[name]):
                add(word.replace("-", "_"))
            found[name] = everything[name]
    for name in names:
        if name in everything:                  # or it is part of the kernel
            add(name)
    return found


def read_depends(path):
    """Names of the modules that a module needs."""
    data = path.read_bytes()
    start = data.find(b"\0depends=") + len(b"\0depends=")
    text = data[start:data.index(b"\0", start)].decode()
    return [word for word in text.split(",") if word]


def write_cpio(path, files):
    """An archive as the kernel unpacks it; files: {name: (mode, content)}."""
    with open(path, "wb") as out:
        for name, (mode, data) in {**files, "TRAILER!!!": (0, b"")}.items():
            text = name.encode() + b"\0"
            fields = (0, mode, 0, 0, 1, 0, len(data), 0, 0, 0, 0, len(text), 0)
            head = b"070701" + b"".join(b"%08X" % (f,) for f in fields)
            for part in (head + text, data):
                out.write(part + b"\0" * (-len(part) % 4))


def write_initramfs(path, modules, command):
    """What the kernel starts."""
    found = find_modules((*BASE_MODULES, *modules))
    script = INIT % {"modules": " ".join(found), "root": ROOT, "command": command,
                     "end": END}
    folders = ("bin", "sbin", "usr", "usr/bin", "usr/sbin", "proc", "sys", "dev",
               "modules", "host")
    files = {name: (0o040755, b"") for name in folders}
    files["bin/busybox"] = (0o100755, BUSYBOX.read_bytes())
    files["init"] = (0o100755, script.encode())
    for name, module in found.items():
        files["modules/%s.ko" % (name,)] = (0o100644, module.read_bytes())
    write_cpio(path, files)


def list_usb(path):
    """Options for a USB device behind a socket."""
    return ("-device", "piix3-usb-uhci", "-device", "usb-redir,chardev=device",
            "-chardev", "socket,id=device,path=%s" % (path,))


def run(folder, modules, guest, *args, usb=None):
    """Output of test/vm/guest/<guest>, which must end with status 0.

    usb: path of a socket behind which there is a device (usb-redir); such a
    machine lives in real time, as its device does not stop.
    """
    initramfs = folder / "initramfs"
    command = " ".join([sys.executable, "test/vm/guest/" + guest, *map(str, args)])
    write_initramfs(initramfs, modules, command)
    result = subprocess.run(
        ["qemu-system-x86_64", "-accel", "tcg", "-cpu", "max", "-m", "512",
         *(list_usb(usb) if usb else ("-icount", "shift=1,sleep=off")),
         "-nodefaults", "-display", "none", "-no-reboot", "-serial", "stdio",
         "-kernel", str(KERNEL / "vmlinuz"), "-initrd", str(initramfs),
         "-append", "console=ttyS0 quiet panic=-1 mitigations=off",
         "-virtfs", "local,path=/,mount_tag=host,security_model=none,readonly=on,"
         "multidevs=remap"],
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=TIMEOUT,
        errors="replace", check=False)
    output = result.stdout.replace("\r", "")
    assert END + " 0" in output, output + result.stderr
    return output
