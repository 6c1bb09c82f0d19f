# SPDX-License-Identifier: GPL-3.0-or-later
"""The C surface of plug-ins, as a plug-in uses it, with our own objects."""

import numpy as np
import pytest
from motion_rig import Rig, make_move

from klippy import chelper
from klippy_ext.itersolve import StepperKinematics
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.trapq import TrapQ

pytest.importorskip("cffi")


@pytest.fixture
def native():
    return chelper.get_ffi()


def address(ffi, pointer):
    return int(ffi.cast("uintptr_t", pointer))


def append(lib, tq, t, start, way, v=10.0):
    lib.trapq_append(tq, t, 0.1, 0.5, 0.1, *start, *way, 0.0, v, 10.0 * v)


def test_every_declared_function_is_there(native):
    ffi, lib = native
    for name in ("free trapq_alloc trapq_free trapq_append trapq_finalize_moves"
                 " trapq_extract_old cartesian_stepper_alloc extruder_stepper_alloc"
                 " trdispatch_alloc trdispatch_start trdispatch_stop").split():
        assert callable(getattr(lib, name))
    assert ffi.sizeof("struct pull_move") == 80
    assert chelper.get_ffi() is native


def test_queue_of_a_plug_in_is_one_of_ours(native):
    ffi, lib = native
    theirs = ffi.gc(lib.trapq_alloc(), lib.trapq_free)
    ours = TrapQ.from_pointer(address(ffi, theirs), theirs)
    append(lib, theirs, 1.0, (1.0, 2.0, 3.0), (0.0, 1.0, 0.0))
    ours.check()
    records = ffi.new("struct pull_move[8]")
    count = lib.trapq_extract_old(theirs, records, 8, 0.0, 10.0)
    mine = ours.extract_old(8, 0.0, 10.0)
    assert count == len(mine) == 3
    for r, m in zip(records, mine, strict=False):
        assert (r.print_time, r.move_t, r.start_v, r.accel, r.start_x, r.start_y,
                r.start_z, r.x_r, r.y_r, r.z_r) == m
    lib.trapq_finalize_moves(theirs, 5.0, 5.0)
    assert len(ours.extract_old(8, 0.0, 10.0)) == 1


@pytest.mark.parametrize("axis, way", [(b"x", (1, 0, 0)), (b"y", (0, 1, 0)),
                                       (b"z", (0, 0, 1))])
def test_cartesian_stepper_of_a_plug_in(native, axis, way):
    ffi, lib = native
    theirs = ffi.gc(lib.cartesian_stepper_alloc(axis), lib.free)
    kin = StepperKinematics.from_pointer(address(ffi, theirs), theirs)
    twin = LinearKinematics(*map(float, way))
    assert [kin.is_active_axis(a) for a in "xyz"] == [bool(r) for r in way]
    rig = Rig([kin, twin], 0.0125, start=(5.0, 6.0, 7.0))
    t, _ = rig.add(1.0, make_move(0.1, 0.5, 0.1, rig.start, way, 0.0, 10.0, 100.0))
    rig.run(t + 0.1)
    rig.check(lambda path, at: path.xyz(at) @ np.array(way, dtype=float))
    assert np.array_equal(rig.steps(0)[0], rig.steps(1)[0])


def test_extruder_stepper_of_a_plug_in(native):
    ffi, lib = native
    tq = ffi.gc(lib.trapq_alloc(), lib.trapq_free)
    theirs = ffi.gc(lib.extruder_stepper_alloc(), lib.free)
    kin = StepperKinematics.from_pointer(address(ffi, theirs), theirs)
    kin.set_trapq(TrapQ.from_pointer(address(ffi, tq), tq))
    kin.set_stepcompress(None, 0.01)
    append(lib, tq, 1.0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    kin.generate_steps(2.0)
    kin.check()
    assert abs(kin.get_commanded_pos() - 6.0) <= 0.005
    assert kin.scan_window() == (0.0, 0.0)


def test_wrapper_keeps_the_plug_ins_object_alive(native):
    ffi, lib = native
    released = []
    theirs = ffi.gc(lib.trapq_alloc(),
                    lambda p: (released.append(1), lib.trapq_free(p)))
    ours = TrapQ.from_pointer(address(ffi, theirs), theirs)
    del theirs
    ours.append(1.0, make_move(0.1, 0.5, 0.1, (0, 0, 0), (1, 0, 0), 0.0, 10.0, 100.0))
    assert not released
    del ours
    assert released == [1]


def test_null_and_kindless_are_refused():
    with pytest.raises(ValueError, match="of no kind"):
        StepperKinematics.from_pointer(0)
    with pytest.raises(ValueError, match="of no kind"):
        StepperKinematics().check_active(1.0)
