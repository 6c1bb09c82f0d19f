# SPDX-License-Identifier: GPL-3.0-or-later
"""Small mathematics against what it must give."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from klippy import mathutil


def test_descent_finds_the_minimum_of_a_valley():
    def error(p):
        return (p["x"] - 3.) ** 2 + 10. * (p["y"] + 1.) ** 2 + p["fixed"]
    start = {"x": 0., "y": 0., "fixed": 2.}
    found = mathutil.coordinate_descent(("x", "y"), start, error)
    assert found["x"] == pytest.approx(3., abs=1e-4)
    assert found["y"] == pytest.approx(-1., abs=1e-4)
    assert found["fixed"] == 2. and start["x"] == 0.


def test_median():
    assert mathutil.median([3, 1, 2]) == 2
    assert mathutil.median([4, 1, 2, 3]) == 2.5
    with pytest.raises(ValueError):
        mathutil.median([])


COORDINATE = st.floats(-300., 300.)


@given(st.tuples(COORDINATE, COORDINATE, st.floats(-500., -50.)))
def test_trilateration_finds_the_point_under_three_towers(point):
    towers = [[200. * math.cos(a), 200. * math.sin(a), 0.]
              for a in (math.radians(d) for d in (210., 330., 90.))]
    radius2 = [sum((p - t) ** 2 for p, t in zip(point, tower, strict=True))
               for tower in towers]
    found = mathutil.trilateration(towers, radius2)
    assert found == pytest.approx(list(point), abs=1e-6)


def test_trilateration_without_solution():
    centres = [[0., 0., 0.], [10., 0., 0.], [0., 10., 0.]]
    with pytest.raises(ValueError):
        mathutil.trilateration(centres, [1., 1., 1.])
    with pytest.raises(ValueError):
        mathutil.trilateration([[0.] * 3] * 3, [1., 1., 1.])
    with pytest.raises(ValueError):
        mathutil.trilateration([[0., 0., 0.], [1., 0., 0.], [2., 0., 0.]], [9.] * 3)


def test_vectors():
    assert mathutil.matrix_cross([1, 0, 0], [0, 1, 0]) == [0, 0, 1]
    assert mathutil.matrix_dot([1, 2, 3], [4, 5, 6]) == 32
    assert mathutil.matrix_magsq([1, 2, 2]) == 9
    assert mathutil.matrix_sub(mathutil.matrix_add([1, 2, 3], [1, 1, 1]),
                               mathutil.matrix_mul([1, 1, 1], 1)) == [1, 2, 3]
