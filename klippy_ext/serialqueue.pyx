# SPDX-License-Identifier: GPL-3.0-or-later
"""Owner of a serial queue: the reliable, clock-ordered link to one mcu.

Methods may be called from any thread on a real link, from the world's thread
on a virtual one.  Whatever may wait does so without the GIL.
"""

import os

cimport cython
from libc.errno cimport errno
from libc.stdint cimport uint8_t, uint64_t
from libc.stdlib cimport free, malloc

from klippy_ext.c_qmsg cimport qmsg, qmsg_free, qsink
from klippy_ext.c_serialqueue cimport (
    SERIALQUEUE_CAN,
    SERIALQUEUE_UART,
    SQCORE_HISTORY,
    clockest,
    cmdqueue,
    serialqueue_add_queue,
    serialqueue_check,
    serialqueue_close,
    serialqueue_free,
    serialqueue_get_clockest,
    serialqueue_get_error,
    serialqueue_get_history,
    serialqueue_get_stats,
    serialqueue_has_input,
    serialqueue_kind,
    serialqueue_open_fd,
    serialqueue_open_file,
    serialqueue_open_virtual,
    serialqueue_pull,
    serialqueue_send,
    serialqueue_set_byte_time,
    serialqueue_set_clockest,
    serialqueue_set_receive_window,
    sqrecord,
    sqstats,
)
from klippy_ext.hostclock cimport HostClock
from klippy_ext.vworld cimport VirtualLink, VirtualWorld

# Bits on the wire for a byte: start and stop bit on a serial line; on CAN a
# frame of 8 bytes takes about 128 bits with its stuffing.
UART_BITS = 10.
CAN_BITS = 16.
KINDS = ("serial", "can", "file")


@cython.no_gc_clear
cdef class CommandQueue:
    """Commands that reach the mcu in the order they were sent.

    CommandQueue() may be made before there is a link: it belongs to the
    first serial queue that it is used with, or to the next when that one
    has been closed.
    """


@cython.no_gc_clear
cdef class SerialQueue:
    """Link to one mcu.  Make it with open_fd() or open_virtual()."""

    def __dealloc__(self):
        if self.sq is not NULL:
            serialqueue_free(self.sq)

    @staticmethod
    def open_fd(HostClock clock not None, int fd, kind, int client_id=0):
        """Serve a descriptor, which stays the caller's.

        kind: "serial" (any stream), "can" (a SocketCAN socket; commands go
        out as client_id, answers come as client_id + 1) or "file" (takes
        all messages at once and answers nothing).
        Raises ValueError for another kind, OSError if it does not work.
        """
        cdef SerialQueue self = SerialQueue.__new__(SerialQueue)
        cdef serialqueue_kind driver = SERIALQUEUE_UART
        if kind not in KINDS:
            raise ValueError(
                "kind of link must be one of %s, not %r"
                % (", ".join(KINDS), kind))
        self.clock = clock
        self.bits_a_byte = UART_BITS
        if kind == "file":
            self.is_file = True
            self.sq = serialqueue_open_file(clock.clock, fd)
        else:
            if kind == "can":
                driver = SERIALQUEUE_CAN
                self.bits_a_byte = CAN_BITS
            self.sq = serialqueue_open_fd(clock.clock, fd, driver, client_id)
        if self.sq is NULL:
            raise OSError(errno, os.strerror(errno))
        return self

    @staticmethod
    def open_virtual(VirtualWorld world not None, VirtualLink link not None):
        """Take the host's end of a link in a virtual world."""
        cdef SerialQueue self = SerialQueue.__new__(SerialQueue)
        if link.world is not world:
            raise ValueError("the link belongs to another world")
        if link.link.has_host:
            raise RuntimeError("the link is in use by another serial queue")
        self.clock = world
        self.link = link
        self.is_virtual = True
        self.bits_a_byte = UART_BITS
        self.sq = serialqueue_open_virtual(world.clock, link.link)
        if self.sq is NULL:
            raise MemoryError()
        world.note_queue(self)
        return self

    def alloc_command_queue(self):
        """A new command queue; it lives as long as the serial queue."""
        cdef CommandQueue queue = CommandQueue.__new__(CommandQueue)
        self.bind(queue)
        return queue

    cdef cmdqueue *bind(self, CommandQueue cq) except NULL:
        """The C object of a command queue, made now if it is free."""
        cdef cmdqueue *queue
        if cq is None:
            raise TypeError("a command queue is needed, not None")
        if cq.owner is self:
            return cq.cq
        if cq.owner is not None and not cq.owner.is_closed:
            raise ValueError("the command queue belongs to another link")
        queue = serialqueue_add_queue(self.sq)
        if queue is NULL:
            raise MemoryError()
        cq.cq = queue
        cq.owner = self
        return queue

    cdef qsink *sink(self, CommandQueue cq) except NULL:
        """Where C producers of messages hand them in; cq keeps it alive."""
        return &self.bind(cq).sink

    def send(self, CommandQueue cq not None, const uint8_t[::1] data,
             uint64_t minclock=0, uint64_t reqclock=0,
             uint64_t notify_id=0):
        """Queue one encoded command of 1 to 59 bytes.

        minclock, reqclock: earliest and required arrival, ticks of the mcu.
        notify_id: not 0 to get a pull() entry when it is acknowledged.
        """
        cdef Py_ssize_t length = data.shape[0]
        cdef const uint8_t *start = &data[0] if length else NULL
        cdef cmdqueue *queue = self.bind(cq)
        cdef int ret
        with nogil:
            ret = serialqueue_send(
                self.sq, queue, start, length, minclock, reqclock, notify_id)
        if ret:
            raise ValueError(
                "a command has 1 to 59 bytes, not %d" % (length,))

    def pull(self):
        """Next received payload or acknowledgement.

        Returns (payload, sent_time, receive_time, notify_id), or None when
        the link is closed or has failed, or (virtual) nothing is there.
        payload is the inside of one block: one or more whole messages; it
        is empty when notify_id is not 0; with notify_id 0 it is when there
        was no memory, and messages are lost.  sent_time is when the newest
        acknowledged block left (s, eventtime), 0. if that is unclear.
        """
        cdef bint wait = not self.is_virtual
        cdef qmsg *m
        with nogil:
            m = serialqueue_pull(self.sq, wait)
        if m is NULL:
            return None
        entry = (<bytes>m.data[:m.len], m.sent_time, m.receive_time,
                 m.notify_id)
        qmsg_free(m)
        return entry

    def set_ready_callback(self, callback):
        """Let the world's take_ready() hand out callback on input."""
        self.ready_callback = callback

    def get_ready_callback(self):
        """The ready callback if there is input for it, else None."""
        if self.ready_callback is None or not serialqueue_has_input(self.sq):
            return None
        return self.ready_callback

    def set_wire_frequency(self, double hz):
        """Bit rate of the wire; 0 if unknown or not a matter."""
        serialqueue_set_byte_time(
            self.sq, self.bits_a_byte / hz if hz > 0. else 0.)

    def set_receive_window(self, int count):
        """Bytes the mcu can hold unprocessed; 0 for no limit."""
        serialqueue_set_receive_window(self.sq, max(count, 0))

    def set_clock_est(self, double freq, double conv_time,
                      uint64_t conv_clock, uint64_t last_clock):
        """Tell how the mcu's clock runs.

        freq: ticks a second of eventtime; conv_clock is the clock at
        conv_time (s); last_clock is certain to have passed.
        """
        cdef clockest ce
        ce.freq = freq
        ce.conv_time = conv_time
        ce.conv_clock = conv_clock
        ce.last_clock = last_clock
        with nogil:
            serialqueue_set_clockest(self.sq, &ce)

    def extend_clock(self, uint64_t clock32):
        """64 bit clock of a 32 bit one within 2^31 ticks of the newest."""
        cdef clockest ce
        serialqueue_get_clockest(self.sq, &ce)
        diff = (clock32 - ce.last_clock) & 0xffffffff
        return ce.last_clock + diff - ((diff & 0x80000000) << 1)

    def get_stats(self):
        """Figures of the link: {name: number}; times in s, bytes, blocks."""
        cdef sqstats stats
        serialqueue_get_stats(self.sq, &stats)
        return stats

    def dump_debug(self):
        """The newest blocks (whole, with header): (sent, received).

        Each is a list of (block, time), oldest first.
        """
        cdef sqrecord *records = <sqrecord *>malloc(
            2 * SQCORE_HISTORY * sizeof(sqrecord))
        cdef size_t n_sent, n_received, i
        if records is NULL:
            raise MemoryError()
        try:
            serialqueue_get_history(
                self.sq, records, &n_sent, records + SQCORE_HISTORY,
                &n_received)
            return (
                [(<bytes>records[i].data[:records[i].len], records[i].time)
                 for i in range(n_sent)],
                [(<bytes>records[i].data[:records[i].len], records[i].time)
                 for i in range(SQCORE_HISTORY, SQCORE_HISTORY + n_received)])
        finally:
            free(records)

    def get_error(self):
        """Error number of the link, 0 while it works."""
        return -serialqueue_get_error(self.sq)

    def check(self):
        """Raise AssertionError if an invariant does not hold (for tests)."""
        cdef int ret = serialqueue_check(self.sq)
        if ret:
            raise AssertionError("serial queue is inconsistent: %d" % (ret,))

    def close(self):
        """Stop, and end all pull() waits.  A file gets all it was sent.

        Raises OSError if a file could not be written.  May be repeated.
        """
        cdef int ret
        self.is_closed = True
        with nogil:
            ret = serialqueue_close(self.sq)
        self.ready_callback = None
        if ret and self.is_file:
            raise OSError(-ret, os.strerror(-ret))
