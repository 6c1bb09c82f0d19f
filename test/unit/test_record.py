# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of klippy/record.py."""
import copy
import pickle

import pytest

from klippy.record import record, replace


@record(frozen=True)
class Point:
    """A place."""

    kind = "point"
    x: float
    y: float = 2.
    name: str | None = None

    def shift(self, by):
        return replace(self, x=self.x + by)


@record
class Options:
    enabled: bool = True
    size: int = 3


def test_values_by_place_name_and_default():
    point = Point(1., name="a")
    assert (point.x, point.y, point.name) == (1., 2., "a")
    assert Point(1., 5., "b").y == 5.
    assert Point.y == 2.
    assert Point.kind == point.kind == "point"
    assert vars(Point(1.)) == {"x": 1., "y": 2., "name": None}


@pytest.mark.parametrize("args, given, text", [
    ((), {}, "misses the value of 'x'"), ((1, 2, 3, 4), {}, "takes 3 values but 4"),
    ((1,), {"z": 1}, "an unknown 'z'"), ((1,), {"x": 1}, "two values of 'x'"),
    ((1,), {"kind": "no field"}, "an unknown 'kind'")])
def test_wrong_values_are_refused(args, given, text):
    with pytest.raises(TypeError, match=r"Point\(\) .*" + text):
        Point(*args, **given)


def test_equal_by_class_and_values():
    assert Point(1.) == Point(1., 2., None) and Point(1.) != Point(1., 3.)
    assert Options() != Point(True, 3)
    assert Point(1.) != (1., 2., None)
    assert {Point(1.): 1}[Point(1.)] == 1
    with pytest.raises(TypeError, match="unhashable"):
        hash(Options())


def test_repr_is_the_call():
    assert repr(Point(1., name="a")) == "Point(x=1.0, y=2.0, name='a')"


def test_only_frozen_ones_stay_as_they_are():
    options = Options()
    options.size = 4
    assert options == Options(size=4)
    with pytest.raises(AttributeError, match="'x' of Point cannot be changed"):
        Point(1.).x = 2.
    with pytest.raises(AttributeError):
        del Point(1.).x


def test_replaced_values_make_a_copy():
    point = Point(1., name="a")
    assert point.shift(2.) == Point(3., name="a") and point.x == 1.
    with pytest.raises(TypeError, match="unknown 'z'"):
        replace(point, z=1)


def test_copies_are_equal():
    point = Point(1., name="a")
    assert copy.copy(point) == copy.deepcopy(point) == point
    assert pickle.loads(pickle.dumps(point)) == point
