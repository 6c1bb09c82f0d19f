# SPDX-License-Identifier: GPL-3.0-or-later
"""[respond]: M118 and RESPOND, text to the terminal and the front-ends."""

PREFIXES = {"echo": "echo:", "command": "//", "error": "!!"}


class Respond:
    """Commands that answer with their text."""

    def __init__(self, config):
        default_type = config.getchoice(
            "default_type", {name: name for name in PREFIXES}, "echo")
        self.default_prefix = config.get("default_prefix", PREFIXES[default_type])
        if not config.getboolean("enable_respond", True):
            return
        gcode = config.get_printer().lookup_object("gcode")
        gcode.register_command("M118", self.cmd_M118, True)
        gcode.register_command("RESPOND", self.cmd_RESPOND, True,
                               desc=self.cmd_RESPOND_help)

    def cmd_M118(self, gcmd):
        gcmd.respond_raw("%s %s" % (self.default_prefix,
                                    gcmd.get_raw_command_parameters()))

    cmd_RESPOND_help = "Send a message, with a prefix, to the terminal"

    def cmd_RESPOND(self, gcmd):
        prefix, joint = self.default_prefix, " "
        kind = gcmd.get("TYPE", None)
        if kind is not None:
            kind = kind.lower()
            if kind == "echo_no_space":
                kind, joint = "echo", ""
            if kind not in PREFIXES:
                raise gcmd.error(
                    "RESPOND TYPE '%s' is unknown: use echo, echo_no_space, command"
                    " or error" % (kind,))
            prefix = PREFIXES[kind]
        prefix = gcmd.get("PREFIX", prefix)
        gcmd.respond_raw("%s%s%s" % (prefix, joint, gcmd.get("MSG", "")))


def load_config(config):
    return Respond(config)
