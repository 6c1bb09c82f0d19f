# SPDX-License-Identifier: GPL-3.0-or-later
"""The C surface that plug-ins reach by `chelper.get_ffi()`.

Only for them: our own modules use the wrappers of klippy_ext.  It opens the
same library, so objects made here and there share one state.
"""

import functools
import os

from klippy.errors import PrinterError

LIBRARY = "libklippyc.so"
DECLARATIONS = """
void free(void *);

struct stepper_kinematics;
struct trapq;
struct trdispatch;
struct pull_move {
    double print_time, move_t;
    double start_v, accel;
    double start_x, start_y, start_z;
    double x_r, y_r, z_r;
};

struct trapq *trapq_alloc(void);
void trapq_free(struct trapq *tq);
void trapq_append(struct trapq *tq, double print_time
    , double accel_t, double cruise_t, double decel_t
    , double start_pos_x, double start_pos_y, double start_pos_z
    , double axes_r_x, double axes_r_y, double axes_r_z
    , double start_v, double cruise_v, double accel);
void trapq_finalize_moves(struct trapq *tq, double print_time
    , double clear_history_time);
int trapq_extract_old(struct trapq *tq, struct pull_move *p, int max
    , double start_time, double end_time);

struct stepper_kinematics *cartesian_stepper_alloc(char axis);
struct stepper_kinematics *extruder_stepper_alloc(void);

struct trdispatch *trdispatch_alloc(void);
void trdispatch_start(struct trdispatch *td, uint32_t dispatch_reason);
void trdispatch_stop(struct trdispatch *td);
"""


@functools.cache
def get_ffi():
    """(ffi, lib) of cffi over the host's C library.

    Raises PrinterError if cffi is not installed.
    """
    try:
        import cffi
    except ImportError:
        raise PrinterError("A plug-in needs the Python module 'cffi': install it with"
                           " pip install cffi")
    import klippy_ext
    path = os.path.join(klippy_ext.__path__[0], LIBRARY)
    ffi = cffi.FFI()
    ffi.cdef(DECLARATIONS)
    return ffi, ffi.dlopen(path)
