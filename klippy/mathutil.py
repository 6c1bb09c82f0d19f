# SPDX-License-Identifier: GPL-3.0-or-later
"""Small pure mathematics: least squares by descent, vectors, circles, medians."""

import math

START_STEP = 0.1
STEP_GROWTH, STEP_SHRINK = 1.1, 0.9
MAX_ROUNDS = 10000


def coordinate_descent(adj_params, params, error_func, tolerance=0.00001):
    """Adjust some values of params until error_func(params) stops falling.

    adj_params: keys to adjust.  params: dict of floats; not changed.
    tolerance: stop when the sum of the step widths is below it.
    Returns a new dict.
    """
    best = dict(params)
    steps = {key: START_STEP for key in adj_params}
    best_error = error_func(best)
    for _ in range(MAX_ROUNDS):
        if sum(steps.values()) <= tolerance:
            break
        for key in steps:
            start = best[key]
            for sign in (1., -1.):
                best[key] = start + sign * steps[key]
                error = error_func(best)
                if error < best_error:
                    best_error = error
                    steps[key] *= STEP_GROWTH
                    break
            else:
                best[key] = start
                steps[key] *= STEP_SHRINK
    return best


def median(values):
    """Middle value; the mean of the middle two of an even number.

    Raises ValueError for none at all.
    """
    ordered = sorted(values)
    if not ordered:
        raise ValueError("the median of no values is not defined")
    middle = len(ordered) // 2
    if len(ordered) % 2:
        return ordered[middle]
    return (ordered[middle - 1] + ordered[middle]) / 2.


def matrix_cross(m1, m2):
    """Vector product of two 3-vectors."""
    return [m1[1] * m2[2] - m1[2] * m2[1], m1[2] * m2[0] - m1[0] * m2[2],
            m1[0] * m2[1] - m1[1] * m2[0]]


def matrix_dot(m1, m2):
    """Scalar product of two 3-vectors."""
    return m1[0] * m2[0] + m1[1] * m2[1] + m1[2] * m2[2]


def matrix_magsq(m1):
    """Squared length of a 3-vector."""
    return matrix_dot(m1, m1)


def matrix_add(m1, m2):
    """Sum of two 3-vectors."""
    return [a + b for a, b in zip(m1, m2, strict=True)]


def matrix_sub(m1, m2):
    """Difference of two 3-vectors."""
    return [a - b for a, b in zip(m1, m2, strict=True)]


def matrix_mul(m1, s):
    """A 3-vector times a number."""
    return [a * s for a in m1]


def trilateration(sphere_coords, radius2):
    """Lower point where three spheres meet.

    sphere_coords: three centres (x, y, z), mm.  radius2: squared radii, mm^2.
    Returns [x, y, z], on the side opposite to the normal (c2-c1) x (c3-c1).
    Raises ValueError if they do not meet or their centres are in a line.
    """
    first, second, third = sphere_coords
    to_second, to_third = matrix_sub(second, first), matrix_sub(third, first)
    d = math.sqrt(matrix_magsq(to_second))
    if not d:
        raise ValueError("two spheres have one centre")
    ex = matrix_mul(to_second, 1. / d)
    i = matrix_dot(ex, to_third)
    across = matrix_sub(to_third, matrix_mul(ex, i))
    j = math.sqrt(matrix_magsq(across))
    if not j:
        raise ValueError("the centres of the spheres lie in a line")
    ey = matrix_mul(across, 1. / j)
    x = (radius2[0] - radius2[1] + d * d) / (2. * d)
    y = (radius2[0] - radius2[2] - x * x + (x - i) ** 2 + j * j) / (2. * j)
    z2 = radius2[0] - x * x - y * y
    if z2 < 0.:
        raise ValueError("the spheres do not meet")
    offset = matrix_add(matrix_mul(ex, x), matrix_mul(ey, y))
    down = matrix_mul(matrix_cross(ex, ey), -math.sqrt(z2))
    return matrix_add(first, matrix_add(offset, down))
