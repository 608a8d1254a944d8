"""The free thin plate against published values, closed forms of strips, and its own equation."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import legendre

import railcosim.track.slab as slab_module
from railcosim.track.parameters import Slab
from railcosim.track.slab import free_plate_modes

EVEN, ODD = 1, -1


def quadrature(plate, order=34):
    """Gauss points over the plate, far more than the modes below need; x, y, weights."""
    p, w = legendre.leggauss(order)
    x, y = np.meshgrid(p * plate.length / 2, p * plate.width / 2, indexing="ij")
    return x.ravel(), y.ravel(), np.outer(w, w).ravel() * plate.length * plate.width / 4


def test_square_free_plate():
    """Frequency parameter omega a^2 sqrt(rho h / D), Poisson ratio 0.3."""
    slab = Slab(poisson_ratio=0.3, length=2.0, width=2.0)
    omega = np.concatenate([free_plate_modes(slab, p, 1500).omega for p in (EVEN, ODD)])
    found = np.sort(omega)[3:9] * slab.length**2
    found *= np.sqrt(slab.mass_per_area / slab.bending_stiffness)
    # Converged values of the literature, printed with five digits.
    assert found == pytest.approx([13.468, 19.596, 24.270, 34.801, 34.801, 61.093], abs=6e-4)
    # Leissa (1973), 36 beam functions: a Ritz method too, so above these, by about a per cent.
    leissa = np.array([13.489, 19.789, 24.432, 35.024, 35.024, 61.526])
    assert np.all(found < leissa)
    assert found == pytest.approx(leissa, rel=1e-2)


@pytest.mark.parametrize(("parity", "count"), [(EVEN, 2), (ODD, 1)])
def test_rigid_body_modes(parity, count):
    """Translation and pitch are even across the slab, roll is odd; nothing else is at zero."""
    plate = free_plate_modes(Slab(), parity, 500)
    assert np.sum(plate.omega == 0) == count
    # The lowest mode that bends: the slab as a free beam has 30 Hz.
    assert np.all(plate.omega[count:] > 2 * np.pi * 20)
    x, y = np.array([-2.0, 0.0, 2.0]), np.array([0.3, 0.3, 0.3])
    low = plate.at(x, y)[:, :count]
    # Rigid shapes are straight: no second difference. Rounding of the eigenvectors.
    assert np.abs(low[0] - 2 * low[1] + low[2]).max() < 1e-7 * np.abs(low).max()


@pytest.mark.parametrize("parity", [EVEN, ODD])
def test_modes_are_orthonormal(parity):
    slab = Slab()
    plate = free_plate_modes(slab, parity, 3000)
    x, y, weight = quadrature(plate)
    shapes = plate.at(x, y)
    gram = slab.mass_per_area * shapes.T @ (weight[:, None] * shapes)
    # Rounding; measured 2e-14.
    assert gram == pytest.approx(np.eye(plate.omega.size), abs=1e-12)
    mirrored = plate.at(x, -y)
    assert mirrored == pytest.approx(parity * shapes, rel=1e-9, abs=1e-12 * np.abs(shapes).max())


@pytest.mark.parametrize("parity", [EVEN, ODD])
def test_modes_satisfy_the_plate_equation(parity):
    """D (w_xxxx + 2 w_xxyy + w_yyyy) = rho h omega^2 w, and free edges bear no bending moment.

    The energy that the modes come from knows neither: the strong form is an independent check of
    the coupling terms with Poisson's ratio.
    """
    slab = Slab()
    plate = free_plate_modes(slab, parity, 300)
    rigid = 2 if parity == EVEN else 1
    per_x, per_y = 2 / slab.length, 2 / slab.width

    def derivative(c, in_x, in_y, x, y):
        c = legendre.legder(legendre.legder(c, in_x, axis=0), in_y, axis=1)
        return legendre.legval2d(x * per_x, y * per_y, c) * per_x**in_x * per_y**in_y

    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1.5, 1.5, 7), np.linspace(-0.7, 0.7, 5)))
    edge_x, edge_y = np.full(5, slab.length / 2), np.linspace(-0.7, 0.7, 5)
    for omega, c in zip(plate.omega[rigid:], plate.coefficients[rigid:], strict=True):
        biharmonic = sum(
            factor * derivative(c, i, j, x, y) for factor, i, j in ((1, 4, 0), (2, 2, 2), (1, 0, 4))
        )
        w = derivative(c, 0, 0, x, y)
        inertia = slab.mass_per_area * omega**2 / slab.bending_stiffness
        # Fourth derivatives of polynomials of degree 16: convergence there; measured 8e-5 at most.
        assert np.abs(biharmonic - inertia * w).max() < 2e-4 * inertia * np.abs(w).max()
        moment = derivative(c, 2, 0, edge_x, edge_y)
        moment += slab.poisson_ratio * derivative(c, 0, 2, edge_x, edge_y)
        curvature = np.sqrt(inertia) * np.abs(w).max()
        assert np.abs(moment).max() < 1e-3 * curvature  # measured 6e-4


def test_narrow_strip_bends_as_a_free_beam():
    """omega L^2 sqrt(m / EI) = 22.3733, 61.6728, 120.9034: EI of a beam, without 1 - nu^2."""
    strip = Slab(length=5.0, width=0.2, thickness=0.02)
    omega = free_plate_modes(strip, EVEN, 60).omega[2:5]
    rigidity = strip.young_modulus * strip.thickness**3 / 12
    found = omega * strip.length**2 * np.sqrt(strip.mass_per_area / rigidity)
    # Curvature across is held by the square of width over wave length; measured 7e-5 to 6e-4.
    assert found == pytest.approx([22.3733, 61.6728, 120.9034], rel=1e-3)


def test_narrow_strip_twists_as_a_shaft():
    """St Venant: omega_n = n pi / L x 2 h / b sqrt(G / rho)."""
    strip = Slab(length=5.0, width=0.2, thickness=0.02)
    omega = free_plate_modes(strip, ODD, 200).omega[1:4]
    shear_modulus = strip.young_modulus / (2 * (1 + strip.poisson_ratio))
    speed = 2 * strip.thickness / strip.width * np.sqrt(shear_modulus / strip.density)
    expected = np.arange(1, 4) * np.pi / strip.length * speed
    # Restrained warping adds about (width x wave number)^2 / 24 = 0.6 %; measured 0.04 to 0.36 %.
    assert omega == pytest.approx(expected, rel=6e-3)
    assert np.all(omega > expected)


@pytest.mark.parametrize("parity", [EVEN, ODD])
def test_modes_are_converged_to_3_khz(monkeypatch, parity):
    kept = free_plate_modes(Slab(), parity, 3000).omega
    monkeypatch.setattr(slab_module, "DEGREE_X", slab_module.DEGREE_X + 6)
    monkeypatch.setattr(slab_module, "DEGREE_Y", slab_module.DEGREE_Y + 6)
    finer = free_plate_modes(Slab(), parity, 3000).omega
    assert kept.size == finer.size
    elastic = kept > 0
    # Highest modes 5e-5; Ritz values come down.
    assert kept[elastic] == pytest.approx(finer[elastic], rel=1e-4)


def test_frequencies_scale_as_they_must():
    """omega ~ h sqrt(E / rho) / length^2 at equal proportions."""
    slab = Slab()
    scaled = replace(
        slab, young_modulus=4 * slab.young_modulus, thickness=slab.thickness / 2,
        length=2 * slab.length, width=2 * slab.width, joint=0.0,
    )  # fmt: skip
    one, other = free_plate_modes(slab, EVEN, 400).omega, free_plate_modes(scaled, EVEN, 100).omega
    assert one.size == other.size > 3
    assert other == pytest.approx(one / 4, rel=1e-8)  # rounding of the eigenproblem
