#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Build the compiler and binutils of the AM335x's PRU from Debian's source
# packages, once, into a cache folder.  Debian has no binaries of them.
set -eu

usage() {
    cat <<EOF
usage: build_pru_tools.sh [FOLDER]

Builds pru-elf binutils and gcc (C only) into FOLDER (default:
\$KLIPPY_PRU_TOOLS, else ~/.cache/klippy-pru), which takes about 20 minutes and
1.5 GB on two cores.  What is there already is not built again.
Needs: apt-get install binutils-source gcc-12-source libgmp-dev libmpfr-dev
       libmpc-dev bison flex texinfo xz-utils
EOF
}

case "${1:-}" in -h|--help) usage; exit 0;; esac
tools=${1:-${KLIPPY_PRU_TOOLS:-$HOME/.cache/klippy-pru}}
work=$tools/build
jobs=$(nproc)
mkdir -p "$work"
PATH=$tools/bin:$PATH
export PATH

say() { echo "build_pru_tools: $(date +%H:%M:%S) $*"; }

need() {
    [ -e "$1" ] || { say "$1 is missing; see --help for packages"; exit 1; }
}

# run LOG COMMAND...: its output goes to a file, whose end is shown on error
run() {
    log=$work/$1.log; shift
    "$@" >>"$log" 2>&1 || { tail -20 "$log"; say "failed, see $log"; exit 1; }
}

unpack() {
    need "$1"
    [ -d "$work/$2" ] && return
    say "unpacking $1"
    mkdir "$work/$2"
    tar -xf "$1" -C "$work/$2" --strip-components=1
}

configure() {
    [ -e "$work/$1-obj/Makefile" ] && return
    mkdir -p "$work/$1-obj"
    name=$1; shift
    (cd "$work/$name-obj" && run "$name" "../$name/configure" --target=pru-elf \
        --prefix="$tools" --disable-nls --disable-werror "$@")
}

build_binutils() {
    [ -x "$tools/bin/pru-elf-ld" ] && return
    unpack "$(echo /usr/src/binutils/binutils-*.tar.xz)" binutils
    say "building binutils"
    configure binutils --disable-gdb --disable-gprofng --enable-plugins
    run binutils make -C "$work/binutils-obj" -j"$jobs"
    run binutils make -C "$work/binutils-obj" install
}

build_gcc() {
    [ -x "$tools/bin/pru-elf-gcc" ] && return
    unpack "$(echo /usr/src/gcc-12/gcc-*.tar.xz)" gcc
    say "building gcc (the longest part)"
    configure gcc --enable-languages=c --disable-bootstrap --disable-libssp \
        --without-headers --with-newlib --disable-shared --disable-threads
    # Debian leaves out the manual, which the makefile would compare with what
    # a program of the build prints
    flags="CFLAGS=-O1 CXXFLAGS=-O1"
    run gcc make -C "$work/gcc-obj" $flags configure-gcc
    run gcc make -C "$work/gcc-obj" $flags -j"$jobs" all-libcpp all-libiberty \
        all-build-libiberty all-libdecnumber all-libbacktrace
    run gcc make -C "$work/gcc-obj/gcc" $flags -j"$jobs" build/genhooks
    touch "$work/gcc-obj/gcc/s-tm-texi"
    run gcc make -C "$work/gcc-obj" $flags -j"$jobs" all-gcc
    touch "$work/gcc-obj/gcc/s-tm-texi"
    run gcc make -C "$work/gcc-obj" $flags install-gcc
}

build_binutils
build_gcc
say "ready in $tools"
