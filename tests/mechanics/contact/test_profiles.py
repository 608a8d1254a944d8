"""Tabulated profiles against closed forms: a cone on a circle, a circle in a circle, cylinders."""

import numpy as np
import pytest

from railcosim.mechanics.contact.geometry import LEFT, RIGHT, Cone
from railcosim.mechanics.contact.numbers import derivatives
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.contact.profiles import Curve, ProfileError, tabulate
from railcosim.mechanics.contact.wheelset import linear_wheelset

R0, B, R, LAMBDA = 0.46, 0.75, 0.3, 0.05
STEEL = {"shear_modulus": 2.059e11 / 2.6, "poisson_ratio": 0.3}
SIDES = np.array([LEFT, RIGHT])
U = np.linspace(-8e-3, 8e-3, 161)
ANGLE = np.arctan(LAMBDA)
CONE = Cone(radius=R0, half_distance=B, conicity=LAMBDA, head_radius=R, **STEEL)


def circle(radius, angle, half_width=0.05, count=201):
    """An arc that opens downwards, through the origin where its normal has the angle."""
    y = np.linspace(-half_width, half_width, count)
    out, down = radius * np.sin(angle), radius * np.cos(angle)
    return Curve(y, down - np.sqrt(radius**2 - (y - out) ** 2))


def table(wheel, rail, u=U):
    return tabulate(wheel, rail, u, radius=R0, half_distance=B, **STEEL)


def profiled(left, right):
    return Profiled(
        reference_radius=R0, half_distance=B, left=left, right=right,
        shear_modulus=STEEL["shear_modulus"],
    )  # fmt: skip


def line(slope, half_width=0.06):
    y = np.linspace(-half_width, half_width, 41)
    return Curve(y, -slope * y)


@pytest.fixture(scope="module")
def cone():
    one = table(line(LAMBDA), circle(R, ANGLE))
    return profiled(one, one)


def random_coordinates(seed):
    q = np.random.default_rng(seed).normal(size=(2, 8)) * [
        2e-3, 5e-5, 5e-4, 0.1, 3e-3, 4e-4, 5e-5, 1e-3,
    ]  # fmt: skip
    q[:, 1] += 9e-5
    return q


def test_spline_of_a_cubic_and_its_derivatives():
    y = np.linspace(-1, 1, 201)
    curve = Curve(y, np.sin(y))
    at = np.linspace(-0.5, 0.5, 33)  # away from the ends, where the spline does not bend
    z, slope, bend = curve.at(at)
    h = 0.01
    assert z == pytest.approx(np.sin(at), abs=h**4)
    assert slope == pytest.approx(np.cos(at), abs=h**3)
    assert bend == pytest.approx(-np.sin(at), abs=h**2)
    assert curve.at(y)[0] == pytest.approx(np.sin(y), abs=1e-15)


@pytest.mark.parametrize("seed", range(3))
def test_a_tabulated_cone_is_the_cone(cone, seed):
    q = random_coordinates(seed)
    found, exact = cone.touch(q, SIDES), CONE.touch(q, SIDES)
    # The spline through points 0.5 mm apart; rolls to their square, 1e-9 m.
    assert found.compression == pytest.approx(exact.compression, abs=2e-8)
    # A roll of 2e-3 times the slope, on the arm of 0.75 m.
    assert found.gradient == pytest.approx(exact.gradient, abs=1e-4)
    assert found.slope == pytest.approx(exact.slope, abs=2e-5)
    assert found.y == pytest.approx(exact.y, abs=5e-6)
    assert found.radius == pytest.approx(exact.radius, abs=5e-7)
    assert found.rail_y == pytest.approx(exact.rail_y, abs=5e-6)
    assert found.rail_z == pytest.approx(exact.rail_z, abs=5e-7)
    assert found.patch.ellipse.along == pytest.approx(float(exact.patch.ellipse.along), rel=1e-4)
    assert pytest.approx(float(exact.patch.kalker.C11), rel=1e-4) == found.patch.kalker.C11


def test_a_wheelset_on_tabulated_cones(cone):
    found = linear_wheelset(cone, speed=40.0, load=8e4)
    exact = linear_wheelset(CONE, speed=40.0, load=8e4)
    size = np.sqrt(np.outer(np.abs(np.diag(exact.K)) + 1e5, np.abs(np.diag(exact.K)) + 1e5))
    assert np.abs((found.K - exact.K) / size).max() < 2e-3  # of curvatures at knots
    assert pytest.approx(exact.C, rel=1e-3, abs=1.0) == found.C


def test_circle_in_circle():
    """A hollow wheel of radius R_w on a head of R: the line of centres leans as it moves.

    Centres are R_w - R apart; u outwards takes that of the wheel with it, so the normal has
    sin = sin(angle) + u / (R_w - R), and the contact lies on the wheel at R_w times what it turned.
    """
    hollow, angle = 0.5, 0.06
    one = table(circle(hollow, angle), circle(R, angle))
    c = one.columns
    sine = np.sin(angle) + U / (hollow - R)
    assert -c["slope"] / np.sqrt(1 + c["slope"] ** 2) == pytest.approx(sine, abs=2e-5)
    gamma = np.arcsin(sine)
    # From the wheel's centre, below the contact, up along the normal.
    y = hollow * np.sin(angle) - hollow * np.sin(gamma)
    z = hollow * np.cos(angle) - hollow * np.cos(gamma)
    assert c["y"] == pytest.approx(y, abs=1e-5)
    assert c["z"] == pytest.approx(z, abs=1e-6)
    assert c["height"] == pytest.approx((hollow - R) * (np.cos(gamma) - np.cos(angle)), abs=1e-8)
    assert np.cos(gamma) / c["travel"] == pytest.approx(1 / R - 1 / hollow, rel=1e-3)
    # As the wheel goes outwards, it rolls on its greater part: faster than a cone of its angle.
    assert (c["z"][-1] - c["z"][0]) / (U[-1] - U[0]) > 2 * np.tan(angle)


def test_left_and_right_apart():
    """Two different wheels: each is what it is with its own table."""
    one, other = (
        table(line(LAMBDA), circle(R, ANGLE)),
        table(line(0.1), circle(0.2, np.arctan(0.1))),
    )
    both = profiled(one, other)
    q = random_coordinates(4)
    found = both.touch(q, SIDES)
    apart = [profiled(t, t).touch(q, SIDES) for t in (one, other)]
    for i in range(2):
        assert found.radius[i] == apart[i].radius[i]
        assert found.compression[i] == apart[i].compression[i]
    assert found.slope[0] < 0 < found.slope[1]


@pytest.mark.parametrize("seed", range(4))
def test_how_they_press_is_the_gradient_of_an_energy(seed):
    """Also between rows of the table, with profiles of two radii."""
    y = np.linspace(-0.04, 0.04, 161)
    rail = Curve(y, y**2 / 0.6 + 40 * np.maximum(y, 0) ** 3)
    one = table(Curve(y, -0.05 * y - 1.0 * y**2 / 2 - 10 * y**3), rail)
    geometry, q = profiled(one, one), random_coordinates(seed)
    by = derivatives(lambda x: geometry.touch(x, SIDES).compression[..., None], q)[:, 0]
    assert geometry.touch(q, SIDES).gradient == pytest.approx(by, abs=1e-13)
    # The normal is of unit length but for a roll's square.
    length = np.hypot(by[:, 0], by[:, 1])
    assert length == pytest.approx(1, abs=1e-4)


def test_refused():
    with pytest.raises(ProfileError, match="list them outwards"):
        Curve(np.array([0, 1, 1, 2.0]), np.zeros(4))
    with pytest.raises(ProfileError, match="4 to 2000"):
        Curve(np.arange(3.0), np.zeros(3))
    with pytest.raises(ProfileError, match="not finite"):
        Curve(np.arange(4.0), np.array([0, np.nan, 0, 0]))
    with pytest.raises(ProfileError, match="touch at the end"):
        table(line(0.5, 0.02), circle(R, ANGLE))
    with pytest.raises(ProfileError, match="beside its rail"):
        table(line(LAMBDA), circle(R, ANGLE), np.linspace(0, 1, 11))
    one = table(line(LAMBDA), circle(R, ANGLE))
    far = np.full((2, 8), 0.02)
    with pytest.raises(ArithmeticError, match=r"tabulated from -0\.008 to 0\.008"):
        profiled(one, one).touch(far, SIDES)
    with pytest.raises(ProfileError, match="same displacements"):
        profiled(one, table(line(LAMBDA), circle(R, ANGLE), U / 2))
