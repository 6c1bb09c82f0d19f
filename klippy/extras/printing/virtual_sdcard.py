# SPDX-License-Identifier: GPL-3.0-or-later
"""[virtual_sdcard]: prints G-code files of a folder of the host.

The work greenlet holds the G-code mutex while it runs lines and lets go of it
as soon as somebody else waits for it.  A pause takes effect between two lines
of the file, or of a macro, or within a wait for a temperature; the macro goes
on from there.
"""

import logging
import os

from klippy.errors import CommandInterrupted, PrinterError
from klippy.extras.print_errors import ErrorPolicy, describe
from klippy.extras.sd_stream import BlockReader, SdStream
from klippy.extras.suspended_line import SuspendedLine
from klippy.gcode_run import Run

EXTENSIONS = ("gcode", "g", "gco")


class VirtualSD:
    """The folder, the loaded file and the work on it."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.gcode = printer.lookup_object("gcode")
        self.sdcard_dirname = os.path.normpath(os.path.expanduser(config.get("path")))
        self.with_subdirs = config.getboolean("with_subdirs", False)
        self.print_stats = printer.load_object(config, "print_stats")
        self.error_policy = ErrorPolicy(config, self)
        self.stream = None              # SdStream of the loaded file
        self.file_path = None
        self.work = None                # token of the work that goes on
        self.is_running_lines = False   # the work holds the mutex
        self.suspended = None           # SuspendedLine while others come first
        self.boundary_callbacks = []    # called between two lines, now and then
        self.interruption = ""          # which line was ended before its time
        printer.register_event_handler("klippy:shutdown", self._handle_shutdown)
        self._register_commands()

    def _register_commands(self):
        for name in ("M20", "M21", "M23", "M24", "M25", "M26", "M27"):
            self.gcode.register_command(name, getattr(self, "cmd_" + name))
        self.gcode.interrupts.register("M25", self.hurry)
        for name in ("M28", "M29", "M30"):
            self.gcode.register_command(name, self.cmd_unsupported)
        for name in ("SDCARD_RESET_FILE", "SDCARD_PRINT_FILE"):
            self.gcode.register_command(
                name, getattr(self, "cmd_" + name),
                desc=getattr(self, "cmd_%s_help" % name))

    # State

    def _handle_shutdown(self):
        if self.work is None:
            return
        self.stream.must_stop = True
        if self.suspended is not None:
            self.suspended.end()
        before, after = self.stream.get_context()
        logging.info("virtual_sdcard at byte %d, before: %r",
                     self.stream.position, before)
        logging.info("virtual_sdcard, from there on: %r", after)

    def stats(self, eventtime):
        if not self.is_active():
            return False, ""
        return True, "sd_pos=%d" % (self.stream.position,)

    def get_status(self, eventtime):
        """progress: 0..1; file_position and file_size in bytes; skipped_lines:
        lines of the file that failed and were passed over."""
        return {
            "file_path": self.file_path, "progress": self.progress(),
            "is_active": self.is_active(),
            "file_position": self.stream.position if self.stream else 0,
            "file_size": self.stream.size if self.stream else 0,
            "skipped_lines": self.error_policy.skipped_lines}

    def progress(self):
        """Part of the file that ran, 0..1."""
        if self.stream is None or not self.stream.size:
            return 0.
        return min(1., self.stream.position / self.stream.size)

    def is_active(self):
        """True while a file is printed and not paused."""
        return self.work is not None and not (
            self.suspended is not None and self.stream.must_stop)

    def is_cmd_from_sd(self):
        """True inside a command of the file."""
        return self.is_running_lines

    def get_file_position(self):
        """Byte at which the next line of the file starts."""
        return self.stream.next_position if self.stream else 0

    def set_file_position(self, position):
        """Go on at another byte of the file."""
        if self.stream is not None:
            self.stream.seek(position)

    # Files

    def get_file_list(self, check_subdirs=False):
        """[(name, size)] of the G-code files.  Raises CommandError."""
        try:
            found = list(_walk_files(self.sdcard_dirname, check_subdirs))
        except OSError as err:
            raise self.gcode.error("Unable to list the files of '%s': %s"
                                   % (self.sdcard_dirname, err))
        return sorted(found, key=lambda item: item[0].lower())

    def _load_file(self, gcmd, filename, check_subdirs=False):
        """Open a file by its name, which may be in another case."""
        names = [name for name, _ in self.get_file_list(check_subdirs)]
        if filename not in names:
            by_case = {name.lower(): name for name in names}
            if filename.lower() not in by_case:
                raise gcmd.error("There is no file '%s' in '%s'"
                                 % (filename, self.sdcard_dirname))
            filename = by_case[filename.lower()]
        path = os.path.join(self.sdcard_dirname, filename)
        try:
            reader = BlockReader(path)
        except OSError as err:
            raise gcmd.error("Unable to open the file '%s': %s" % (path, err))
        self.stream, self.file_path = SdStream(reader, self.gcode), path
        self.print_stats.set_current_file(filename)
        gcmd.respond_raw("File opened:%s Size:%d" % (filename, reader.size))
        gcmd.respond_raw("File selected")

    def _close_file(self):
        if self.stream is not None:
            self.stream.close()
        if self.suspended is not None:
            self.work = None
            self.suspended.end_now()
        self.stream = self.file_path = None

    def _reset_file(self):
        if self.stream is not None:
            self.do_pause()
            self._close_file()
        self.error_policy.reset()
        self.print_stats.reset()
        self.printer.send_event("virtual_sdcard:reset_file")

    def load_at(self, gcmd, filename, position):
        """Select a file below the folder, to go on at a byte of it."""
        self._reset_file()
        self._load_file(gcmd, filename, check_subdirs=True)
        self.set_file_position(position)

    # Start and stop

    def ask_boundary(self):
        """Have the boundary callbacks called behind the line that runs."""
        if self.stream is not None:
            self.stream.must_break = True

    def do_resume(self):
        """Start the print of the loaded file, or go on.  Raises CommandError."""
        if self.stream is None or self.stream.is_closed:
            raise self.gcode.error("No file is selected: use M23 or SDCARD_PRINT_FILE")
        if self.is_active() and not self.stream.must_stop:
            raise self.gcode.error("SD busy")
        self.stream.must_stop = False
        pause_resume = self.printer.lookup_object("pause_resume", None)
        if pause_resume is not None:
            pause_resume.note_resumed()
        if self.suspended is not None:
            self.suspended.resume()
        if self.work is None:
            work = self.work = object()
            self.reactor.register_callback(
                lambda eventtime: self._run_work(work, self.stream))

    def do_pause(self):
        """Stop after the line that runs now, if one does."""
        if not self.is_active():
            return
        self.stream.must_stop = True
        if not self.is_running_lines:
            if self.suspended is None:
                self.work = None
            self.print_stats.note_pause()

    def hurry(self):
        """A pause waits for its turn: let it in at the next place that can wait."""
        if self.is_running_lines:
            self.gcode.get_mutex().runs[0].ask_way()

    def give_way(self, run):
        """Let others run, and come back when the print is not paused.

        Called within a line of the file.  Raises CommandInterrupted if the
        print is ended meanwhile.
        """
        self.is_running_lines = False
        self.suspended = SuspendedLine(self.reactor, self.gcode.get_mutex(), run)
        try:
            was_paused = self.suspended.wait_while(lambda: self.stream is not None
                                                   and self.stream.must_stop)
        finally:
            self.suspended = None
        self.is_running_lines = True
        if was_paused:
            self.print_stats.note_start()

    def do_cancel(self):
        """End the print and forget its file."""
        if self.stream is not None:
            self.do_pause()
            self._close_file()
            self.print_stats.note_cancel()

    # Work

    def _run_work(self, work, stream):
        """Run the file until it ends, fails, is paused or work is not wanted."""
        if self.work is not work:
            return
        self.interruption = ""
        logging.info("virtual_sdcard: print from byte %d", stream.next_position)
        self.print_stats.note_start()
        is_at_end, error = False, ""
        while not (stream.must_stop or is_at_end) and self.work is work:
            self.reactor.pause(self.reactor.NOW)
            is_at_end, error = self._run_stretch(work, stream)
        if self.work is work:
            self.work = None
            if self.stream is stream:
                self._note_end(is_at_end, error)

    def _run_stretch(self, work, stream):
        """Run lines under the mutex: (whether the print is at its end, text of
        the error that ends or pauses it)."""
        mutex, run = self.gcode.get_mutex(), Run(owner=self)
        mutex.lock_run(run)
        try:
            if stream.must_stop or self.work is not work:
                return False, ""
            self.is_running_lines = True
            return self._run_lines(stream)
        finally:
            self.is_running_lines = False
            if run.is_holding:
                mutex.unlock()

    def _run_lines(self, stream):
        if self.interruption:
            # whoever ended the line did not end the print
            return self.error_policy.handle_interruption(self.interruption)
        try:
            is_at_end = stream.run_lines()
            for callback in self.boundary_callbacks:
                callback()
            return is_at_end, ""
        except CommandInterrupted as err:
            self.interruption = describe(err, stream, self.print_stats.filename)
            logging.info("virtual_sdcard: %s", self.interruption)
            stream.pass_line()
            return False, ""
        except PrinterError as err:
            return self.error_policy.handle(err, stream, self.print_stats.filename)

    def _note_end(self, is_at_end, error):
        logging.info("virtual_sdcard: print stops at byte %d", self.stream.position)
        if self.printer.is_shutdown():
            is_at_end, error = True, error or self.printer.get_state_message()[0]
        if not is_at_end:
            self.print_stats.note_pause(error)
        elif error:
            self.print_stats.note_error(error)
        else:
            self.print_stats.note_complete()
            self.stream.close()
            self.stream.position = self.stream.size
            self.file_path = None

    # Commands

    def cmd_unsupported(self, gcmd):
        raise gcmd.error("SD write not supported")

    cmd_SDCARD_RESET_FILE_help = "Forget the loaded file; ends its print"

    def cmd_SDCARD_RESET_FILE(self, gcmd):
        if self.is_cmd_from_sd():
            raise gcmd.error("SDCARD_RESET_FILE cannot be run from the file itself")
        self._reset_file()

    cmd_SDCARD_PRINT_FILE_help = "Load a file and print it; may name subfolders"

    def cmd_SDCARD_PRINT_FILE(self, gcmd):
        if self.is_active():
            raise gcmd.error("SD busy")
        self._reset_file()
        self._load_file(gcmd, gcmd.get("FILENAME").lstrip("/"), check_subdirs=True)
        self.do_resume()

    def cmd_M20(self, gcmd):
        gcmd.respond_raw("Begin file list")
        for name, size in self.get_file_list(self.with_subdirs):
            gcmd.respond_raw("%s %d" % (name, size))
        gcmd.respond_raw("End file list")

    def cmd_M21(self, gcmd):
        gcmd.respond_raw("SD card ok")

    def cmd_M23(self, gcmd):
        if self.is_active():
            raise gcmd.error("SD busy")
        self._reset_file()
        self._load_file(gcmd, gcmd.get_raw_command_parameters().lstrip("/"),
                        self.with_subdirs)

    def cmd_M24(self, gcmd):
        self.do_resume()

    def cmd_M25(self, gcmd):
        self.do_pause()

    def cmd_M26(self, gcmd):
        if self.is_active() and not self.is_cmd_from_sd():
            raise gcmd.error("SD busy")
        self.set_file_position(gcmd.get_int("S", minval=0))

    def cmd_M27(self, gcmd):
        if self.stream is None:
            gcmd.respond_raw("Not SD printing.")
        else:
            gcmd.respond_raw("SD printing byte %d/%d"
                             % (self.stream.position, self.stream.size))


def _walk_files(folder, check_subdirs):
    """(path below folder, size) of each G-code file.  Raises OSError."""
    if not check_subdirs:
        for entry in os.scandir(folder):
            if not entry.name.startswith(".") and entry.is_file():
                yield entry.name, entry.stat().st_size
        return
    visited = set()
    for root, folders, names in os.walk(folder, followlinks=True):
        real = os.path.realpath(root)
        if real in visited:
            folders.clear()
            continue
        visited.add(real)
        for name in names:
            path = os.path.join(root, name)
            if (not name.startswith(".") and os.path.exists(path)
                    and name.rpartition(".")[2].lower() in EXTENSIONS):
                yield os.path.relpath(path, folder), os.path.getsize(path)


def load_config(config):
    return VirtualSD(config)
