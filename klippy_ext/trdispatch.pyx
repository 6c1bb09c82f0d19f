# SPDX-License-Identifier: GPL-3.0-or-later
"""Homing triggers fanned out between mcus by the I/O threads alone."""

cimport cython
from libc.stdint cimport uint32_t, uint64_t, uintptr_t

from klippy_ext.c_trdispatch cimport (
    trdispatch,
    trdispatch_add,
    trdispatch_arm,
    trdispatch_disarm,
    trdispatch_free,
    trdispatch_new,
    trmember_free,
    trmember_setup,
    trmember_tags,
)
from klippy_ext.serialqueue cimport CommandQueue, SerialQueue

# Members that plug-ins' own trdispatch objects may still point to.
kept_members = []


@cython.no_gc_clear
cdef class TrDispatch:
    """The triggers (trsync objects) of one homing move."""

    def __cinit__(self, clock=None):
        self.clock = clock
        self.members = []

    def __init__(self, clock=None):
        self.td = trdispatch_new()
        self.is_owner = True
        if self.td is NULL:
            raise MemoryError()

    def __dealloc__(self):
        cdef TrMember member
        if self.td is NULL or not self.is_owner:
            return
        trdispatch_free(self.td)
        for member in self.members:
            trmember_free(member.member)
            member.member = NULL

    @staticmethod
    def from_pointer(address):
        """Wrap what a plug-in got from trdispatch_alloc(); it stays its own.

        Its members live as long as the process: the plug-in may start it at
        any time.
        """
        cdef TrDispatch self = TrDispatch.__new__(TrDispatch)
        self.td = <trdispatch *><uintptr_t>address
        if self.td is NULL:
            raise ValueError("trdispatch pointer is NULL")
        return self

    def add(self, SerialQueue serialqueue not None, CommandQueue cq not None,
            uint32_t trsync_oid, uint32_t set_timeout_msgtag,
            uint32_t trigger_msgtag, uint32_t state_msgtag):
        """Add an mcu's trsync.  The tags are message numbers.

        Returns its TrMember, which is set up before each start().
        """
        cdef TrMember member = TrMember.__new__(TrMember)
        cdef trmember_tags tags
        tags.oid = trsync_oid
        tags.set_timeout = set_timeout_msgtag
        tags.trigger = trigger_msgtag
        tags.state = state_msgtag
        member.serialqueue = serialqueue
        member.command_queue = cq
        member.member = trdispatch_add(
            self.td, serialqueue.sq, serialqueue.bind(cq), &tags)
        if member.member is NULL:
            raise MemoryError()
        self.members.append(member)
        if not self.is_owner:
            kept_members.append(member)
        return member

    def start(self, uint32_t dispatch_reason):
        """Pass on the first trigger, with this reason, until stop()."""
        with nogil:
            trdispatch_arm(self.td, dispatch_reason)

    def stop(self):
        """Follow the triggers no more; afterwards nothing is sent."""
        with nogil:
            trdispatch_disarm(self.td)


@cython.no_gc_clear
cdef class TrMember:
    """One mcu's trsync in a TrDispatch."""

    def setup(self, uint64_t clock, uint64_t expire_ticks,
              uint64_t min_extend_ticks):
        """Prepare for the next start.

        clock: 64 bit, when the trsync starts; it expires expire_ticks later
        unless reports come.  It is moved on by min_extend_ticks or more.
        """
        if self.member is NULL:
            raise RuntimeError("the trigger's TrDispatch is gone")
        trmember_setup(self.member, clock, expire_ticks, min_extend_ticks)
