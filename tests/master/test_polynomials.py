"""Polynomials by their values, against those that they are."""

import numpy as np
import pytest
from numpy.polynomial import polynomial as power

from railcosim.master.polynomials import lagrange

POINTS = np.array([-0.7, 0.0, 0.45, 1.0])


@pytest.mark.parametrize("derivative", [0, 1, 2, 3, 4])
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_a_polynomial_is_found_from_as_many_values_as_it_needs(n, derivative):
    coefficients = np.array([0.3, -2.0, 1.5, 0.8])[:n]
    at = np.array([-1.3, 0.2, 2.0])
    found = lagrange(POINTS[:n], at, derivative) @ power.polyval(POINTS[:n], coefficients)
    expected = power.polyval(at, power.polyder(coefficients, derivative))
    # Rounding of four values, a hundred times larger between four points and twice as far out.
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_values_at_the_points_are_themselves():
    np.testing.assert_allclose(lagrange(POINTS, POINTS), np.eye(4), rtol=0, atol=1e-14)
