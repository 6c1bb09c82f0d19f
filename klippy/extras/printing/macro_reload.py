# SPDX-License-Identifier: GPL-3.0-or-later
"""RELOAD_GCODE_MACROS: macros as the config files have them now, no restart.

All macros are read and checked first: with an error in any, none is changed.
"""

from klippy.configfile import ConfigWrapper
from klippy.confignames import propose
from klippy.configtext import ConfigReader
from klippy.errors import ConfigError, collect

PREFIX = "gcode_macro "


class MacroReloader:
    """The command; macro_class makes a macro of a section."""

    def __init__(self, printer, macro_class):
        self.printer, self.macro_class = printer, macro_class
        self.gcode = printer.lookup_object("gcode")
        self.gcode.register_command(
            "RELOAD_GCODE_MACROS", self.cmd_RELOAD_GCODE_MACROS,
            desc=self.cmd_RELOAD_GCODE_MACROS_help)

    cmd_RELOAD_GCODE_MACROS_help = "Read the macros of the config files again"

    def cmd_RELOAD_GCODE_MACROS(self, gcmd):
        try:
            store = ConfigReader().read(
                self.printer.get_start_args()["config_file"])
            sections, texts = self._read(store)
            counts = self._apply(sections, texts)
        except ConfigError as err:
            raise gcmd.error("The macros stay as they were.\n%s" % (err,))
        gcmd.respond_info("Macros: %d changed, %d new, %d removed, %d as before"
                          % counts)

    def _find_gone(self, sections):
        """[(section, macro)] of the macros that are in no file any more."""
        return [(name, macro) for name, macro in list(self.printer.objects.items())
                if name.startswith(PREFIX) and name not in sections]

    # Reading

    def _read(self, store):
        """({section: ConfigWrapper}, {section: MacroText}) of all macros."""
        sections, texts, errors = {}, {}, []
        taken = set(self.gcode.ready_gcode_handlers) - {
            macro.alias for name, macro in self._find_gone(store.sections())
            if macro.rename_existing is None}
        for name in store.sections():
            if name.startswith(PREFIX):
                section = sections[name] = ConfigWrapper(
                    self.printer, store, {}, name)
                try:
                    texts[name] = self._read_macro(section, taken)
                except ConfigError as err:
                    if err.place is None:
                        err.place = store.get_place(name)
                    errors.append(err)
        if errors:
            raise collect(errors)
        return sections, texts

    def _read_macro(self, section, taken):
        from klippy.extras.gcode_macro import MacroText
        text = MacroText(section)
        name, store = section.get_name(), section.fileconfig
        known = {option for _, option in section.access_tracking}
        for option in store.options(name):
            if option not in known:
                raise section.make_error(option, "there is no such option%s" % (
                    propose(option, store.asked.get(name, ())),))
        self._check_name(section, text, taken)
        return text

    def _check_name(self, section, text, taken):
        name = section.get_name()
        macro = self.printer.lookup_object(name, None)
        if macro is not None:
            if macro.rename_existing != text.rename_existing:
                raise section.make_error(
                    "rename_existing", "a change of it needs a RESTART")
            return
        alias = name.split()[-1].upper()
        exists = alias in taken
        if (exists and text.rename_existing is None
                and alias not in self.gcode.yielding):
            raise ConfigError(
                "section [%s]: there is a command %s already: give the macro another"
                " name, or set rename_existing" % (name, alias))
        if text.rename_existing is not None and (
                not exists or text.rename_existing.upper() in taken):
            raise section.make_error("rename_existing", (
                "there is a command '%s' already" % (text.rename_existing,) if exists
                else "there is no command '%s' to rename" % (alias,)))

    # Taking over

    def _apply(self, sections, texts):
        """Returns the numbers of macros changed, new, removed and left alone."""
        objects = self.printer.objects
        changed = new = removed = same = 0
        for name, macro in self._find_gone(sections):
            del objects[name]
            macro.unregister()
            removed += 1
        configfile = self.printer.lookup_object("configfile")
        before = configfile.get_status(0.)["config"]
        for name, section in sections.items():
            if name not in objects:
                objects[name] = self.macro_class(section)
                new += 1
            elif before.get(name) != dict(section.fileconfig.items(name)):
                objects[name].change(texts[name])
                changed += 1
            else:
                same += 1
        configfile.replace_sections(PREFIX, sections)
        self.gcode.status_commands = None
        return changed, new, removed, same
