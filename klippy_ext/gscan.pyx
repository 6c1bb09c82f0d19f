# SPDX-License-Identifier: GPL-3.0-or-later
"""Plain G0/G1 lines, scanned in C without building a command."""

cimport cython
from cpython.bytes cimport PyBytes_AS_STRING, PyBytes_GET_SIZE
from cpython.unicode cimport PyUnicode_AsUTF8AndSize

from klippy_ext.c_gscan cimport gscan_line, gscan_line_length


@cython.final
cdef class MoveScan:
    """The words of the last plain move line that was scanned.

    mask: bit 0 x, 1 y, 2 z, 3 e, 4 f; the values, in the units of the
    G-code, hold where their bit is set.  They are valid until the next scan:
    read them before anything that may wait.
    """

    cdef bint _scan(self, const char *text, Py_ssize_t size) noexcept:
        self.matched = gscan_line(text, size, &self.found)
        if self.matched:
            self.mask = self.found.mask
            self.x = self.found.value[0]
            self.y = self.found.value[1]
            self.z = self.found.value[2]
            self.e = self.found.value[3]
            self.f = self.found.value[4]
        else:
            self.mask = 0
        return self.matched

    cpdef bint scan(self, str line) except *:
        """True if the line is a plain G0/G1 move; its words are then set.

        Raises TypeError unless line is a str.  False for lone surrogates.
        """
        cdef Py_ssize_t size = 0
        cdef const char *text = NULL
        if line is None:
            raise TypeError("a line is a str, not None")
        try:
            text = PyUnicode_AsUTF8AndSize(line, &size)
        except UnicodeEncodeError:
            self.matched = False
            self.mask = 0
            return False
        return self._scan(text, size)

    cpdef Py_ssize_t next_line(self, bytes block, Py_ssize_t pos) except -2:
        """Scan the line of block that starts at byte pos.

        Returns the position after its newline, or -1 when no newline follows.
        `matched` tells whether it is a plain move.
        Raises ValueError for a position outside the block.
        """
        cdef Py_ssize_t size
        cdef size_t length
        cdef const char *text
        if block is None:
            raise TypeError("a block is bytes, not None")
        size = PyBytes_GET_SIZE(block)
        if pos < 0 or pos > size:
            raise ValueError("position %d is not in a block of %d bytes"
                             % (pos, size))
        text = PyBytes_AS_STRING(block) + pos
        length = gscan_line_length(text, size - pos)
        if not length:
            self.matched = False
            self.mask = 0
            return -1
        self._scan(text, length)
        return pos + length
