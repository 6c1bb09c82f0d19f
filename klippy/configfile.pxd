# SPDX-License-Identifier: GPL-3.0-or-later

cdef class ConfigWrapper:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object printer
    cdef public object fileconfig
    cdef public dict access_tracking
    cdef public str section
    cdef _get_parsed(self, str option, object default, object parser,
                     bint note_valid, object minval=*, object maxval=*,
                     object above=*, object below=*)
    cdef _note(self, str option, object value)
    cdef _missing(self, str option)
    cdef _parse_element(self, str option, str text, object parser)


cdef class PrinterConfig:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object printer
    cdef public dict access_tracking
    cdef public list warnings
    cdef public dict raw_config
    cdef public dict settings
    cdef public object save
