"""Contact laws against eq. 18, finite differences and scipy's root finder."""

import numpy as np
import pytest
from scipy.optimize import brentq

from railcosim.mechanics.law import (
    HertzContact,
    LinearContact,
    hertz_coefficient,
    tangent_stiffness,
)
from railcosim.mechanics.solve import ContactError, solve_compression
from railcosim.vehicle.parameters import Contact, Vehicle

CONTACT = Contact()
C = hertz_coefficient(
    young_modulus=CONTACT.young_modulus,
    poisson_ratio=CONTACT.poisson_ratio,
    wheel_radius=Vehicle().wheelset.radius,
    rail_radius=CONTACT.rail_radius,
)
HERTZ = HertzContact(C=C)


def test_tangent_stiffness_is_eq_18():
    """k_H = 3.02e7 F^(1/3) by our reading, 1.298 GN/m at the wheel load (paper: 3.1e7 and 1.3)."""
    assert tangent_stiffness(C, 1.0) == pytest.approx(3.02e7, rel=2e-3)  # its three digits
    assert tangent_stiffness(C, Vehicle().wheel_load) == pytest.approx(1.298e9, rel=5e-4)  # four
    # Eq. 18 itself: (3/2 E / (1 - nu^2) sqrt(R_e))^(2/3) F^(1/3), R_e = sqrt(R_w R_r).
    modulus = 2.059e11 / (1 - 0.3**2)
    radius = np.sqrt(0.43 * 0.3)
    assert tangent_stiffness(C, 79e3) == pytest.approx(
        (1.5 * (2 / 3 * modulus * np.sqrt(radius)) ** (2 / 3)) * 79e3 ** (1 / 3), rel=1e-12
    )


def test_hertz_coefficient_of_two_equal_spheres():
    """Johnson: F = 4/3 E* sqrt(R) delta^1.5, 1/E* = 2 (1 - nu^2) / E, 1/R = 1/a + 1/b."""
    E, nu, a = 2.0e11, 0.3, 0.5
    # Equal radii of wheel and rail head, crossed as cylinders are: a sphere of that radius on a
    # plane. Half the modulus of two bodies: 4/3 x E / 2 (1 - nu^2).
    expected = 4 / 3 * E / (2 * (1 - nu**2)) * np.sqrt(a)
    found = hertz_coefficient(young_modulus=E, poisson_ratio=nu, wheel_radius=a, rail_radius=a)
    assert found == pytest.approx(expected, rel=1e-12)


def test_tangent_at_the_static_load_is_the_laws_own():
    load = Vehicle().wheel_load
    delta = np.array([(load / C) ** (2 / 3)])
    assert HERTZ.force(delta)[0] == pytest.approx(load, rel=1e-12)
    assert HERTZ.stiffness(delta)[0] == pytest.approx(tangent_stiffness(C, load), rel=1e-12)


@pytest.mark.parametrize("law", [HERTZ, LinearContact(k_H=1.3e9)], ids=["Hertz", "linear"])
@pytest.mark.parametrize("delta", [1e-6, 9e-5, 1e-3, -1e-4])
def test_stiffness_is_the_derivative(law, delta):
    step = 1e-4 * abs(delta)
    force = law.force(np.array([delta - step, delta + step]))
    difference = (force[1] - force[0]) / (2 * step)
    # Central: (step / delta)^2 / 24 = 4e-10 of Hertz, plus rounding 1e-16 / 1e-4.
    assert law.stiffness(np.array([delta]))[0] == pytest.approx(difference, rel=1e-8)


def test_loss_of_contact():
    apart = np.array([-1.0, -1e-9, 0.0])
    assert np.array_equal(HERTZ.force(apart), np.zeros(3))
    assert np.array_equal(HERTZ.stiffness(apart), np.zeros(3))
    assert LinearContact(k_H=2.0).force(apart)[0] == -2.0  # the linear law pulls


@pytest.mark.parametrize("gap", [-1e-3, 0.0, 1e-7, 1e-4, 5e-3])
@pytest.mark.parametrize("compliance", [1e-12, 1e-9, 1e-7])
def test_one_contact_against_a_root_finder(gap, compliance):
    def residual(delta):
        return delta + compliance * C * max(delta, 0.0) ** 1.5 - gap

    expected = brentq(residual, -1.0, 1.0, xtol=1e-18, rtol=1e-14)
    found = solve_compression(HERTZ, np.array([[compliance]]), np.array([gap]), np.array([gap]))
    # Newton stops at 1e-12 of the compression and converges quadratically.
    assert found[0] == pytest.approx(expected, rel=1e-11, abs=1e-18)


@pytest.mark.parametrize("seed", range(5))
def test_eight_coupled_contacts_balance(seed):
    """Some wheels pressed, some far off the rail."""
    random = np.random.default_rng(seed)
    A = random.normal(size=(8, 8))
    G = 1e-9 * (A @ A.T)
    gap = random.uniform(-2e-4, 4e-4, size=8)
    delta = solve_compression(HERTZ, G, gap, guess=gap)
    force = C * np.maximum(delta, 0) ** 1.5
    # 1e-12 of the compression times the stiffness of the balance, 1 + G k_H = some tens.
    assert delta + G @ force == pytest.approx(gap, abs=1e-10 * np.abs(gap).max())
    assert (force == 0).any() or (delta > 0).all()


def test_the_guess_does_not_matter():
    G, gap = 1e-9 * (np.eye(8) + 0.3), np.linspace(-1e-4, 3e-4, 8)
    near, far = (solve_compression(HERTZ, G, gap, guess=g) for g in (gap, np.full(8, 5e-3)))
    assert near == pytest.approx(far, rel=1e-10, abs=1e-16)  # twice the tolerance of Newton


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_refused(bad):
    gap = np.full(8, 1e-4)
    gap[3] = bad
    with pytest.raises(ContactError, match="not finite or far off"):
        solve_compression(HERTZ, 1e-9 * np.eye(8), gap, guess=np.full(8, 1e-4))
