# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines of a G-code file, run block by block.

position is the byte at which the line that runs now starts, next_position the
one where the next line starts; a command may set the latter to jump.
"""

import os

from klippy.errors import CommandError, PrinterError
from klippy.gcode_command import shorten

BLOCK_SIZE = 128 * 1024
MAX_LINE = 1024 * 1024
MAX_SHOWN = 120                 # bytes of a line in an error
READ_AHEAD = 8 * BLOCK_SIZE


class ReadError(CommandError):
    """The file cannot be read: no fault of a line of it."""


class BlockReader:
    """Reads a file that was opened for binary reading."""

    def __init__(self, path):
        """Raises OSError."""
        self.path = path
        self.file = open(path, "rb", buffering=0)
        self.size = os.fstat(self.file.fileno()).st_size

    def read(self, position):
        """Bytes from position on, b"" at the end.  Raises ReadError."""
        try:
            descriptor = self.file.fileno()
            data = os.pread(descriptor, BLOCK_SIZE, position)
            os.posix_fadvise(descriptor, position + BLOCK_SIZE, READ_AHEAD,
                             os.POSIX_FADV_WILLNEED)
        except OSError as err:
            raise ReadError("Unable to read '%s' at byte %d: %s"
                            % (self.path, position, err))
        if not data and position < self.size:
            raise ReadError(
                "'%s' ends at byte %d, it had %d bytes when the print started: was"
                " it cut short?" % (self.path, position, self.size))
        return data

    def count_lines(self, end):
        """Number of lines that end before byte end.  Raises ReadError."""
        position = count = 0
        while position < end:
            data = self.read(position)[:end - position]
            count += data.count(b"\n")
            position += len(data)
        return count

    def close(self):
        self.file.close()


class SdStream:
    """Position in a file and the runner of its lines.

    Lines are counted from where the reading began or last jumped to; what lies
    before that is only read when an error asks for a line's number.
    """

    def __init__(self, reader, gcode):
        self.reader, self.size = reader, reader.size
        self.runner, self.mutex = gcode.runner, gcode.mutex
        self.position = self.next_position = self.failed_end = 0
        self.must_stop = self.is_closed = self.must_break = False
        self._forget_block()

    def _forget_block(self):
        self.block, self.offset, self.base = b"", 0, self.next_position
        self.counted_from, self.n_lines = self.next_position, 0
        self.is_at_end = False

    def seek(self, position):
        """Go on at a byte; also from a command of the file itself."""
        self.next_position = position

    def close(self):
        """Close the file; no line of it runs any more."""
        self.must_stop = self.is_closed = True
        self.reader.close()

    def get_context(self):
        """Some bytes before and after the position, from the block in memory."""
        here = min(max(self.position - self.base, 0), len(self.block))
        return (self.block[max(here - 1024, 0):here],
                self.block[here:here + 128])

    def run_lines(self):
        """Run lines until the end of the file, a stop, the end of a block, until
        somebody else waits to run commands, or must_break is set.

        Returns True at the end of the file.  The caller holds the G-code mutex.
        Raises PrinterError; position is then at the failed line, which runs
        again unless pass_line() is called.
        """
        self.position, self.must_break = self.next_position, False
        if self.next_position != self.base + self.offset:
            self._forget_block()
        if self._run_block():
            return False
        return self._read_more()

    def _run_block(self):
        """Run the lines of the block; False if it has no complete one left."""
        while not (self.must_stop or self.must_break or self.mutex.n_waiting):
            end = self.runner.find_next(self.block, self.offset)
            if end < 0:
                return False
            self.next_position = self.base + end
            try:
                self.runner.run_found(self.block, self.offset, end)
            except PrinterError:
                self.next_position, self.failed_end = self.position, self.base + end
                raise
            self.position = self.next_position
            if self.position != self.base + end:
                return True
            self.offset = end
            self.n_lines += 1
        return True

    def _read_more(self):
        """Append the next piece of the file; True if there is none."""
        rest = self.block[self.offset:]
        if self.is_at_end:
            return not rest
        if len(rest) > MAX_LINE:
            self.next_position = self.failed_end = self._find_line_end(len(rest))
            raise CommandError(
                "The line at byte %d of '%s' has more than %d bytes"
                % (self.position, self.reader.path, MAX_LINE))
        self.failed_end = self.position
        data = self.reader.read(self.base + len(self.block))
        self.base, self.offset = self.base + self.offset, 0
        if data:
            self.block = rest + data
            return False
        self.is_at_end = True
        self.block = rest + b"\n" if rest else b""
        return not rest

    def find_failed_line(self):
        """(number from 1 on, text) of the line that failed.

        Number 0 if the file cannot be read; no text if the reading failed.
        """
        try:
            number = self.n_lines + 1 + self.reader.count_lines(self.counted_from)
        except ReadError:
            number = 0
        end = min(self.failed_end - self.base, len(self.block))
        return number, _show(self.block[self.offset:max(end, self.offset)])

    def pass_line(self):
        """Go on with the line behind the one that failed."""
        self.position = self.next_position = self.failed_end
        if self.base + self.offset < self.failed_end <= self.base + len(self.block):
            self.offset = self.failed_end - self.base
            self.n_lines += 1

    def _find_line_end(self, length):
        """Byte behind the newline that ends the line at position."""
        place = self.position + length
        while True:
            data = self.reader.read(place)
            index = data.find(b"\n")
            if index >= 0 or not data:
                return place + index + 1 if data else place
            place += len(data)


def _show(line):
    """Text of a line, or of its beginning, with signs for what is no text."""
    text = line[:MAX_SHOWN].decode("utf-8", "replace").strip(" \t\r\n\ufeff")
    return shorten(text) + ("..." if len(line) > MAX_SHOWN else "")
