# SPDX-License-Identifier: GPL-3.0-or-later
"""Configuration of the firmware: menuconfig, olddefconfig, defconfig, header.

usage: kconfig.py menuconfig | olddefconfig | defconfig FILE | header OUT_DIR
The configuration is the file that KCONFIG_CONFIG names (default .config).
`header` writes autoconf.h (every symbol defined, booleans as 0 or 1) and
auto.conf (for make).
"""

import os
import pathlib
import sys

try:
    import kconfiglib
except ImportError:
    sys.exit("The firmware's configuration needs the Python package kconfiglib:"
             "\n    %s -m pip install kconfiglib" % sys.executable)

ROOT = pathlib.Path(__file__).resolve().parent.parent


def config_path():
    return os.environ.get("KCONFIG_CONFIG") or ".config"


def load_tree():
    """Parse Kconfig; warnings about unknown symbols are errors to show."""
    os.environ.setdefault("srctree", str(ROOT))
    kconf = kconfiglib.Kconfig("Kconfig", warn_to_stderr=False)
    kconf.warn_assign_undef = True
    return kconf


def show_warnings(kconf):
    for warning in kconf.warnings:
        print(warning, file=sys.stderr)


def list_symbols(kconf):
    """(name, type, value) of every symbol, in the order of the files."""
    numeric = (kconfiglib.INT, kconfiglib.HEX)
    for sym in kconf.unique_defined_syms:
        if sym.orig_type in (kconfiglib.BOOL, kconfiglib.TRISTATE):
            yield sym.name, "bool", sym.str_value
        elif sym.orig_type in numeric:
            yield sym.name, "int", sym.str_value or "0"
        else:
            yield sym.name, "string", sym.str_value


def write_if_changed(path, text):
    """Write a file unless it already says just that."""
    if path.exists() and path.read_text() == text:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def write_header(kconf, out):
    header, conf = ["/* Generated. */"], []
    for name, kind, value in list_symbols(kconf):
        if kind == "bool":
            header.append("#define CONFIG_%s %d" % (name, value == "y"))
            if value == "y":
                conf.append("CONFIG_%s=y" % name)
            continue
        quoted = '"%s"' % kconfiglib.escape(value) if kind == "string" else value
        header.append("#define CONFIG_%s %s" % (name, quoted))
        conf.append("CONFIG_%s=%s" % (name, value))
    write_if_changed(out / "autoconf.h", "\n".join(header) + "\n")
    write_if_changed(out / "auto.conf", "\n".join(conf) + "\n")


def main(argv):
    """Run one of the commands of the module's usage text."""
    if not argv or (argv[0] in ("defconfig", "header") and len(argv) != 2):
        sys.exit(__doc__)
    kconf = load_tree()
    if argv[0] == "menuconfig":
        import menuconfig
        menuconfig.menuconfig(kconf)
        return
    source = argv[1] if argv[0] == "defconfig" else config_path()
    if not os.path.exists(source):
        sys.exit("No firmware configuration in %r: run make menuconfig, or make"
                 " defconfig TARGET=<name> with a name from test/configs" % source)
    kconf.load_config(source)
    show_warnings(kconf)
    if argv[0] == "header":
        write_header(kconf, pathlib.Path(argv[1]))
    else:
        print(kconf.write_config(config_path()))


if __name__ == "__main__":
    main(sys.argv[1:])
