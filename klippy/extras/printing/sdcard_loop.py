# SPDX-License-Identifier: GPL-3.0-or-later
"""[sdcard_loop]: parts of a printed file that repeat."""


class SDCardLoop:
    """Stack of [runs left, byte where the part starts]; 0 runs: for ever."""

    def __init__(self, config):
        printer = config.get_printer()
        self.sdcard = printer.load_object(config, "virtual_sdcard")
        self.loops = []
        gcode = printer.lookup_object("gcode")
        for name in ("BEGIN", "END", "DESIST"):
            command = "SDCARD_LOOP_" + name
            gcode.register_command(command, getattr(self, "cmd_" + command),
                                   desc=getattr(self, "cmd_%s_help" % command))
        printer.register_event_handler("virtual_sdcard:reset_file",
                                       self.loops.clear)

    def _check_source(self, gcmd):
        if not self.sdcard.is_cmd_from_sd():
            raise gcmd.error("%s is only possible in a file of the virtual SD card"
                             % (gcmd.get_command(),))

    cmd_SDCARD_LOOP_BEGIN_help = "Begin a part of the file that repeats COUNT times"

    def cmd_SDCARD_LOOP_BEGIN(self, gcmd):
        count = gcmd.get_int("COUNT", minval=0)
        self._check_source(gcmd)
        self.loops.append([count, self.sdcard.get_file_position()])

    cmd_SDCARD_LOOP_END_help = "End a part of the file that repeats"

    def cmd_SDCARD_LOOP_END(self, gcmd):
        self._check_source(gcmd)
        if not self.loops:
            raise gcmd.error("SDCARD_LOOP_END without SDCARD_LOOP_BEGIN")
        loop = self.loops[-1]
        if loop[0] == 1:
            self.loops.pop()
            return
        if loop[0]:
            loop[0] -= 1
        self.sdcard.set_file_position(loop[1])

    cmd_SDCARD_LOOP_DESIST_help = "Let all repeating parts end after this run"

    def cmd_SDCARD_LOOP_DESIST(self, gcmd):
        for loop in self.loops:
            loop[0] = 1


def load_config(config):
    return SDCardLoop(config)
