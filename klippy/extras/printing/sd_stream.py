# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines of a G-code file, run block by block.

position is the byte at which the line that runs now starts, next_position the
one where the next line starts; a command may set the latter to jump.
"""

import os

from klippy.errors import CommandError

BLOCK_SIZE = 128 * 1024
MAX_LINE = 1024 * 1024
READ_AHEAD = 8 * BLOCK_SIZE


class BlockReader:
    """Reads a file that was opened for binary reading."""

    def __init__(self, path):
        """Raises OSError."""
        self.path = path
        self.file = open(path, "rb", buffering=0)
        self.size = os.fstat(self.file.fileno()).st_size

    def read(self, position):
        """Bytes from position on, b"" at the end.  Raises CommandError."""
        try:
            descriptor = self.file.fileno()
            data = os.pread(descriptor, BLOCK_SIZE, position)
            os.posix_fadvise(descriptor, position + BLOCK_SIZE, READ_AHEAD,
                             os.POSIX_FADV_WILLNEED)
        except OSError as err:
            raise CommandError("Unable to read '%s' at byte %d: %s"
                               % (self.path, position, err))
        if not data and position < self.size:
            raise CommandError(
                "'%s' ends at byte %d, it had %d bytes when the print started: was"
                " it cut short?" % (self.path, position, self.size))
        return data

    def close(self):
        self.file.close()


class SdStream:
    """Position in a file and the runner of its lines."""

    def __init__(self, reader, gcode):
        self.reader, self.size = reader, reader.size
        self.runner, self.mutex = gcode.runner, gcode.mutex
        self.position = self.next_position = 0
        self.must_stop = self.is_closed = False
        self._forget_block()

    def _forget_block(self):
        self.block, self.offset, self.base = b"", 0, self.next_position
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
        """Run lines until the end of the file, a stop, the end of a block, or
        until somebody else waits to run commands.

        Returns True at the end of the file.  The caller holds the G-code mutex.
        Raises CommandError; position is then at the failed line.
        """
        self.position = self.next_position
        if self.next_position != self.base + self.offset:
            self._forget_block()
        if self._run_block():
            return False
        return self._read_more()

    def _run_block(self):
        """Run the lines of the block; False if it has no complete one left."""
        while not self.must_stop and not self.mutex.n_waiting:
            end = self.runner.find_next(self.block, self.offset)
            if end < 0:
                return False
            self.next_position = self.base + end
            try:
                self.runner.run_found(self.block, self.offset, end)
            except CommandError:
                self.next_position = self.position
                raise
            self.position = self.next_position
            if self.position != self.base + end:
                return True
            self.offset = end
        return True

    def _read_more(self):
        """Append the next piece of the file; True if there is none."""
        rest = self.block[self.offset:]
        if self.is_at_end:
            return not rest
        if len(rest) > MAX_LINE:
            self.next_position = self._find_line_end(len(rest))
            raise CommandError(
                "The line at byte %d of '%s' has more than %d bytes"
                % (self.position, self.reader.path, MAX_LINE))
        data = self.reader.read(self.base + len(self.block))
        self.base, self.offset = self.base + self.offset, 0
        if data:
            self.block = rest + data
            return False
        self.is_at_end = True
        self.block = rest + b"\n" if rest else b""
        return not rest

    def _find_line_end(self, length):
        """Byte behind the newline that ends the line at position."""
        place = self.position + length
        while True:
            data = self.reader.read(place)
            index = data.find(b"\n")
            if index >= 0 or not data:
                return place + index + 1 if data else place
            place += len(data)
