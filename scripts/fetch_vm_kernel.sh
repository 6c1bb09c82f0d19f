#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Fetch Debian's kernel for the tests in a virtual machine (test/vm), once, into a
# cache folder: nothing is installed on this machine.
set -eu

usage() {
    cat <<EOF2
usage: fetch_vm_kernel.sh [FOLDER]

Unpacks the kernel and modules of linux-image-amd64 into FOLDER (default:
\$KLIPPY_VM_KERNEL, else ~/.cache/klippy-vm), which are 70 MB to download.
Needs: apt-get install qemu-system-x86 busybox-static
EOF2
}

case "${1:-}" in -h|--help) usage; exit 0;; esac
folder=${1:-${KLIPPY_VM_KERNEL:-$HOME/.cache/klippy-vm}}
[ -e "$folder/vmlinuz" ] && exit 0
[ "$(uname -m)" = x86_64 ] || { echo "no virtual machine on $(uname -m)"; exit 0; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

package=$(apt-cache depends linux-image-amd64 | sed -n 's/^ *Depends: //p' | head -1)
[ -n "$package" ] || { echo "apt knows no linux-image-amd64: apt-get update?"; exit 1; }
(cd "$work" && apt-get download -q "$package" 2>/dev/null) || {
    echo "cannot download $package: apt-get update?"; exit 1; }
mkdir -p "$folder" "$work/root"
dpkg-deb --fsys-tarfile "$work"/*.deb | tar -x -C "$work/root" --wildcards \
    './boot/vmlinuz-*' './lib/modules/*/kernel/drivers/usb/*' \
    './lib/modules/*/kernel/drivers/net/can/*' './lib/modules/*/kernel/net/*' \
    './lib/modules/*/kernel/fs/*' './lib/modules/*/kernel/drivers/virtio/*' \
    './lib/modules/*/kernel/drivers/scsi/*' './lib/modules/*/kernel/lib/*' \
    './lib/modules/*/kernel/crypto/*' './lib/modules/*/kernel/block/*'
rm -rf "$folder/modules"
mv "$work"/root/lib/modules/*/kernel "$folder/modules"
mv "$work"/root/boot/vmlinuz-* "$folder/vmlinuz"
echo "fetch_vm_kernel: $package is in $folder"
