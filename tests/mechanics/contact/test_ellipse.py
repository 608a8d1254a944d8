"""Hertz's ellipse against published values, a sphere, crossed cylinders' limits and quadrature."""

import numpy as np
import pytest
from scipy.special import ellipe, ellipkm1

from railcosim.mechanics.contact.ellipse import ellipse, elliptic

STEEL = {"shear_modulus": 82e9, "poisson_ratio": 0.28}


def axis_ratio_to_curvature(g):
    """B/A of the gap A x^2 + B y^2 for a major axis along x, minor over major axis g (Johnson)."""
    K, E = ellipkm1(g**2), ellipe(1 - g**2)
    return (E / g**2 - K) / (K - E)


@pytest.mark.parametrize("complement", [1.0, 1 - 1e-9, 0.9, 0.3, 1e-2, 1e-4])
def test_elliptic_integrals_against_scipy(complement):
    K, D = elliptic(np.array([complement]))
    assert K[0] == pytest.approx(ellipkm1(complement**2), rel=1e-14)
    m = 1 - complement**2
    if m > 1e-3:  # below, scipy's difference K - E loses digits
        expected = (ellipkm1(complement**2) - ellipe(m)) / m
        assert D[0] == pytest.approx(expected, rel=1e-12)
    else:
        assert D[0] == pytest.approx(np.pi / 4 * (1 + 3 / 8 * m), rel=1e-12)  # series, to m^2


def test_published_ellipse():
    """An example of CONTACT: half the curvature along is 0.8 1/m, a/b = 0.5, N 106.7 kN."""
    curvature_y = 1.6 / axis_ratio_to_curvature(0.5)
    patch = ellipse(1.6, curvature_y, **STEEL)
    N = np.array(106.7e3)
    a, b = patch.semi_axes(N)
    assert patch.ratio == pytest.approx(0.5, rel=1e-12)
    # Four digits are printed.
    assert a == pytest.approx(6.304e-3, rel=1e-4)
    assert b == pytest.approx(12.61e-3, rel=5e-4)
    assert patch.approach(N) == pytest.approx(0.07651e-3, rel=1e-4)
    # Theirs is the greatest of an element; 1.5 N / (pi a b) of the printed axes is 640.9 MPa.
    assert patch.pressure(N) == pytest.approx(640.7e6, rel=1e-3)


def test_wheel_on_rail_head():
    """A wheel of 0.43 m on a head of 0.3 m: a is along rolling and the longer one."""
    patch = ellipse(1 / 0.43, 1 / 0.3, shear_modulus=2.059e11 / 2.6, poisson_ratio=0.3)
    N = np.array(79265.0)
    a, b = patch.semi_axes(N)
    assert a == pytest.approx(6.455e-3, rel=1e-4)
    assert b == pytest.approx(5.079e-3, rel=1e-4)
    assert patch.stiffness(N) == pytest.approx(1.3002e9, rel=5e-5)


def test_sphere_on_plane():
    """a^3 = 3 N R / 4 E*, N = 4/3 E* sqrt(R) delta^1.5 (Johnson 4.22, 4.23)."""
    R, N, E = 0.4, np.array(5e4), 82e9 / (1 - 0.28)
    patch = ellipse(1 / R, 1 / R, **STEEL)
    a, b = patch.semi_axes(N)
    assert a == pytest.approx((3 * N * R / (4 * E)) ** (1 / 3), rel=1e-13)
    assert b == pytest.approx(a, rel=1e-13)
    assert pytest.approx(4 / 3 * E * np.sqrt(R), rel=1e-12) == patch.C


def test_turned_by_a_quarter_the_axes_change_places():
    one, other = ellipse(2.3, 11.0, **STEEL), ellipse(11.0, 2.3, **STEEL)
    assert one.along == other.across
    assert one.across == other.along
    assert one.C == other.C
    assert one.ratio > 1  # less curved along: longer along


@pytest.mark.parametrize("g", [0.01, 0.1, 0.3, 0.7, 0.95, 1.0])
def test_any_ratio_is_found(g):
    ratio = axis_ratio_to_curvature(g) if g < 1 else 1.0
    assert ellipse(1.0, ratio, **STEEL).ratio == pytest.approx(1 / g, rel=1e-10)


def test_surfaces_touch_all_over_the_ellipse():
    """Pressure p0 sqrt(1 - r^2) makes the half-spaces fit: at the centre, and at both ends.

    Boussinesq's displacement in polar coordinates about the point: the integral of pressure over
    angle and distance, independent of elliptic integrals.
    """
    A, B, N = 1.1, 2.9, 8e4  # half the curvatures
    patch = ellipse(2 * A, 2 * B, **STEEL)
    a, b = (float(s) for s in patch.semi_axes(np.array(N)))
    p0 = 1.5 * N / (np.pi * a * b)
    theta = np.linspace(0, np.pi, 2000, endpoint=False) + np.pi / 4000

    def sunk(x, y):
        """Of both bodies: (1 - nu) / (pi G) times the integral; a chord's pressure is half a
        circle over it."""
        p, q, r = (
            (np.cos(theta) / a) ** 2 + (np.sin(theta) / b) ** 2,
            x * np.cos(theta) / a**2 + y * np.sin(theta) / b**2,
            1 - (x / a) ** 2 - (y / b) ** 2,
        )
        chord = np.pi / 2 * (r + q**2 / p) / np.sqrt(p)
        return (1 - 0.28) / (np.pi * 82e9) * p0 * chord.mean() * np.pi

    middle = sunk(0, 0)
    assert middle == pytest.approx(float(patch.approach(np.array(N))), rel=1e-10)
    for x, y in ((0.7 * a, 0), (0, 0.7 * b), (0.4 * a, -0.6 * b)):
        assert sunk(x, y) == pytest.approx(middle - A * x**2 - B * y**2, rel=1e-10)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_a_flat_contact_is_refused(bad):
    with pytest.raises(ValueError, match="must be above 0"):
        ellipse(1.0, bad, **STEEL)
