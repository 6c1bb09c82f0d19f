# SPDX-License-Identifier: GPL-3.0-or-later
"""The log file, written by a thread of its own so that nobody waits for a disk.

A full disk costs log lines, never a print: lines that cannot be written are
counted and the count is told once writing works again.
"""

import logging
import os
import queue
import threading
import time

MAX_BYTES = 100 * 1024 * 1024
N_BACKUPS = 5
MAX_QUEUED = 100000             # lines kept while the disk is slow
_ROLLOVER = object()            # in the queue: begin a new file


class QueueHandler(logging.Handler):
    """Formats records and passes them on without waiting."""

    def __init__(self, lines):
        super().__init__()
        self.lines = lines
        self.n_dropped = 0

    def emit(self, record):
        """Queue a record's text; dropped and counted if the queue is full."""
        try:
            self.lines.put_nowait((record.created, self.format(record)))
        except queue.Full:
            self.n_dropped += 1


class RotatingFile:
    """A log file that starts anew at midnight and at a size.

    header() gives the lines that each new file starts with.
    """

    def __init__(self, path, header, max_bytes=MAX_BYTES, n_backups=N_BACKUPS):
        self.path = str(path)
        self.header = header
        self.max_bytes, self.n_backups = max_bytes, n_backups
        self.file = None
        self.day = None
        self.n_lost = 0

    def open(self):
        """Open the file for appending.  Raises OSError."""
        self.file = open(self.path, "ab", buffering=0)

    def write(self, created, text):
        """Write a text (created: s since the epoch); counts it if that fails."""
        day = time.localtime(created)[:3]
        try:
            if self.file is None:
                self.open()
            if self._is_due(day):
                self._rotate()
            self.day = day
            if self.n_lost:
                self._write("%d log lines were lost: the disk was full or failed"
                            % (self.n_lost,))
                self.n_lost = 0
            self._write(text)
        except OSError:
            self.n_lost += 1

    def _write(self, text):
        data = text.encode("utf-8", "backslashreplace") + b"\n"
        written = self.file.write(data)
        if written is not None and written < len(data):
            raise OSError("the disk is full")

    def _is_due(self, day):
        if self.day is not None and day != self.day:
            return True
        return self.file.tell() >= self.max_bytes

    def _rotate(self):
        day = self.day or time.localtime(os.stat(self.path).st_mtime)[:3]
        base = "%s.%04d-%02d-%02d" % (self.path, *day)
        name, number = base, 0
        while os.path.exists(name):
            number += 1
            name = "%s.%d" % (base, number)
        self.file.close()
        self.file = None
        os.rename(self.path, name)
        self.open()
        self._prune()
        for text in self.header():
            self._write(text)

    def roll_over(self):
        """Begin a new file, unless there is nothing in this one."""
        try:
            if self.file is not None and self.file.tell():
                self._rotate()
        except OSError:
            self.n_lost += 1

    def _prune(self):
        import glob
        backups = sorted(glob.glob(glob.escape(self.path) + ".*"),
                         key=lambda path: os.stat(path).st_mtime)
        for old in backups[:-self.n_backups]:
            os.unlink(old)

    def close(self):
        if self.file is not None:
            self.file.close()
            self.file = None


class QueueListener:
    """The log: a queue, its handler for the logging module, its thread."""

    def __init__(self, path, max_bytes=MAX_BYTES):
        self.rollover_info = {}
        self.lines = queue.Queue(MAX_QUEUED)
        self.handler = QueueHandler(self.lines)
        self.output = RotatingFile(path, self._get_header, max_bytes)
        self.output.open()
        self.thread = threading.Thread(target=self._run, name="log", daemon=True)
        self.thread.start()

    def _get_header(self):
        return ["\n".join(filter(None, list(self.rollover_info.values())))]

    def _run(self):
        while True:
            item = self.lines.get()
            if item is None:
                return
            if item is _ROLLOVER:
                self.output.roll_over()
                continue
            self.output.write(*item)
            if self.handler.n_dropped:
                n_dropped, self.handler.n_dropped = self.handler.n_dropped, 0
                self.output.write(item[0], "%d log lines were dropped: the disk is"
                                  " too slow" % (n_dropped,))

    def set_rollover_info(self, name, info):
        """Have info (None: nothing) written at the start of each new file."""
        if info is None:
            self.rollover_info.pop(name, None)
        else:
            self.rollover_info[name] = info

    def roll_over(self):
        """Begin a new file behind what is queued."""
        self.lines.put(_ROLLOVER)

    def clear_rollover_info(self):
        """Forget all infos."""
        self.rollover_info.clear()

    def stop(self):
        """Write what is queued and end the thread."""
        logging.getLogger().removeHandler(self.handler)
        self.lines.put(None)
        self.thread.join()
        self.output.close()


def setup_bg_logging(path, level=logging.INFO):
    """Send the root logger's records to a file; returns the QueueListener.

    Raises OSError if the file cannot be opened.
    """
    listener = QueueListener(path)
    root = logging.getLogger()
    root.addHandler(listener.handler)
    root.setLevel(level)
    return listener
