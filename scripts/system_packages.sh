#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Install the Debian packages that a make target needs, or say how.
#
# usage: system_packages.sh run|test|systemd|wheels|vm
#
# Nothing is installed when everything is there already.  Without root (or a
# password-less sudo) the exact command line is printed instead and the script
# exits with 1.
set -eu

usage() {
    echo "usage: $0 run|test|systemd|wheels|vm   (installs what that make target needs)"
}

# missing "package:test command" ...: print the packages whose test fails
missing() {
    for entry in "$@"; do
        package=${entry%%:*}
        check=${entry#*:}
        sh -c "$check" >/dev/null 2>&1 || printf '%s ' "$package"
    done
}

PYTHON=${PYTHON:-python3}
header="$PYTHON -c 'import sysconfig,os,sys; \
sys.exit(not os.path.exists(sysconfig.get_paths()[\"include\"]+\"/Python.h\"))'"

case "${1:-}" in
    -h|--help) usage; exit 0 ;;
    run|test|systemd|wheels|vm) ;;
    *) usage >&2; exit 2 ;;
esac

need=$(missing "gcc:command -v cc" "libc6-dev:test -e /usr/include/stdio.h" \
    "make:command -v make" "git:command -v git" \
    "python3-venv:$PYTHON -c 'import venv, ensurepip'" \
    "python3-dev:$header")
if [ "$1" = test ]; then
    need="$need$(missing "gcc-avr:command -v avr-gcc" \
        "avr-libc:test -d /usr/lib/avr/include" \
        "binutils-avr:command -v avr-objdump" \
        "gcc-arm-none-eabi:command -v arm-none-eabi-gcc" \
        "libnewlib-arm-none-eabi:test -e /usr/include/newlib/stdint.h" \
        "avrdude:command -v avrdude" \
        "stm32flash:command -v stm32flash" \
        "bossa-cli:command -v bossac" \
        "dfu-util:command -v dfu-util" \
        "libusb-1.0-0-dev:test -e /usr/include/libusb-1.0/libusb.h" \
        "libsimavr-dev:test -e /usr/include/simavr/sim_avr.h" \
        "libelf-dev:test -e /usr/include/libelf.h" \
        "clang:command -v clang" \
        "libclang-rt-14-dev:ls /usr/lib/llvm-*/lib/clang/*/lib/linux/libclang_rt.fuzzer*" \
        "valgrind:command -v valgrind" \
        "chromium:command -v chromium || command -v chromium-browser || command -v google-chrome")"
fi
case "$1" in
    systemd) need="$need$(missing "systemd-container:command -v systemd-nspawn")" ;;
    wheels) need="$need$(missing "qemu-user-static:command -v qemu-arm-static" \
        "mmdebstrap:command -v mmdebstrap")" ;;
    vm) need="$need$(missing "qemu-system-x86:command -v qemu-system-x86_64" \
        "busybox-static:test -x /bin/busybox" "iproute2:command -v ip")" ;;
esac
[ -n "$need" ] || exit 0

if [ "$(id -u)" = 0 ]; then
    as_root=""
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    as_root="sudo"
else
    echo "These system packages are missing.  Run this line, then make again:"
    echo "    sudo apt-get install -y --no-install-recommends $need"
    exit 1
fi
command -v apt-get >/dev/null || {
    echo "This is not a Debian-like system: install the counterparts of: $need"
    exit 1
}
echo "Installing system packages: $need"
export DEBIAN_FRONTEND=noninteractive
$as_root apt-get update -q >/dev/null
install_one() {
    $as_root apt-get install -y -q --no-install-recommends "$@" >/dev/null
}
# One by one when the whole set fails: a package another release names
# differently must not keep the rest away.
install_one $need || for package in $need; do
    install_one "$package" || echo "warning: could not install $package"
done
