"""A slab: how it bends, as a thin (Kirchhoff) plate with free edges, and moves in its plane."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import ROLL, Direction, Y, Z

from .parameters import Slab

DEGREE_X = 30
"""Highest degree along the slab: 3 kHz modes have some 14 half waves, about two degrees each."""
DEGREE_Y = 16
"""Highest degree across; both leave the modes below 3 kHz converged to 1e-4."""


@dataclass(frozen=True, kw_only=True)
class PlateModes:
    """Mass-normalised modes of one parity across the plate (even: parity 1, odd: -1).

    Attributes
    ----------
    omega : array, shape (n,)
        Natural frequencies of the free plate, rad/s; rigid-body modes are zero.
    coefficients : array, shape (n, n_x, n_y)
        Legendre coefficients along and across; integral of rho h psi^2 over the plate is 1.
    length, width : float
        Sides, m.
    """

    omega: FloatArray
    coefficients: FloatArray
    length: float
    width: float

    def at(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Mode shapes at points, shape (n_points, n), 1/sqrt(kg); x, y from the centre, m."""
        return self._evaluate(x, y, self.coefficients)

    def slope_across(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Their slopes dw/dy at points, shape (n_points, n), 1/(m sqrt(kg))."""
        slopes = legendre.legder(self.coefficients, axis=2).astype(float) * (2 / self.width)
        return self._evaluate(x, y, slopes)

    def curvatures(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Their curvatures d2w/dx2 and d2w/dy2 at points, shape (n_points, n), 1/(m2 sqrt(kg))."""
        sides = (self.length, self.width)
        along, across = (
            legendre.legder(self.coefficients, 2, axis=1 + k).astype(float) * (2 / side) ** 2
            for k, side in enumerate(sides)
        )
        return self._evaluate(x, y, along), self._evaluate(x, y, across)

    def _evaluate(self, x: FloatArray, y: FloatArray, coefficients: FloatArray) -> FloatArray:
        P_x = legendre.legvander(2 * np.asarray(x) / self.length, coefficients.shape[1] - 1)
        P_y = legendre.legvander(2 * np.asarray(y) / self.width, coefficients.shape[2] - 1)
        shapes: FloatArray = np.einsum("pi,pj,nij->pn", P_x, P_y, coefficients, optimize=True)
        return shapes


def no_plate_modes(slab: Slab) -> PlateModes:
    """Modes of a plate that nothing bends: none."""
    return PlateModes(
        omega=np.empty(0), coefficients=np.empty((0, 1, 1)), length=slab.length, width=slab.width
    )


@dataclass(frozen=True, kw_only=True)
class SlabModes:
    """What a slab does for loads of one parity: it bends, and moves sideways as a rigid body.

    Attributes
    ----------
    slab : Slab
        The slab.
    plate : PlateModes
        How it bends.
    sideways : bool
        Whether it shifts and yaws, two more modes: with equal lateral loads on both rails.
    """

    slab: Slab
    plate: PlateModes
    sideways: bool

    @property
    def size(self) -> int:
        """Number of modes."""
        return self.plate.omega.size + 2 * self.sideways

    def per_mass(self, vertical: float, lateral: float) -> FloatArray:
        """Of each mode what a foundation has of something per area, over the slab's mass."""
        areas = [vertical] * self.plate.omega.size + [lateral] * (2 * self.sideways)
        share: FloatArray = np.array(areas) * (1 / self.slab.mass_per_area)
        return share

    def at(self, direction: Direction, x: FloatArray, y: FloatArray) -> FloatArray:
        """Motion of the surface at points, shape (n_points, n), 1/sqrt(kg); x, y from the centre.

        A thin plate's surface turns with it, and above the middle moves sideways as it does; that
        is left out unless the slab tilts rails.
        """
        half = self.slab.thickness / 2
        bent: FloatArray = {
            Z: lambda: self.plate.at(x, y),
            Y: lambda: half * self._tilt(x, y),
            ROLL: lambda: self._tilt(x, y),
        }[direction]()
        shifted = np.zeros((bent.shape[0], 2 * self.sideways))
        if direction is Y and self.sideways:
            shifted[:] = self._across(x)
        return np.concatenate([bent, shifted], axis=1)

    def _tilt(self, x: FloatArray, y: FloatArray) -> FloatArray:
        if self.slab.tilts_rails:
            return self.plate.slope_across(x, y)
        return np.zeros((np.size(x), self.plate.omega.size))

    def _across(self, x: FloatArray) -> FloatArray:
        """Mass-normalised shift and yaw at points x from the centre, shape (n_points, 2)."""
        slab = self.slab
        mass = slab.mass_per_area * slab.length * slab.width
        gyration = np.sqrt((slab.length**2 + slab.width**2) / 12)
        across: FloatArray = np.stack([np.ones_like(x), x / gyration], axis=1) / np.sqrt(mass)
        return across


@lru_cache(maxsize=16)
def free_plate_modes(slab: Slab, parity: int, highest_frequency: float) -> PlateModes:
    """Modes of the free plate up to a frequency, by Ritz with Legendre series.

    The stiffness is D times the integral of
    (w_xx + w_yy)^2 - 2 (1 - nu) (w_xx w_yy - w_xy^2); free edges are natural conditions, so plain
    polynomials are admissible.

    Parameters
    ----------
    slab : Slab
        The plate.
    parity : int
        1 for shapes even across the plate, -1 for odd ones.
    highest_frequency : float
        Hz.

    Returns
    -------
    PlateModes

    References
    ----------
    Leissa, A. W. (1973), The free vibration of rectangular plates, J. Sound Vib. 31(3), 257-293.
    """
    gram_x, gram_y = _gram(DEGREE_X, slab.length), _gram(DEGREE_Y, slab.width)
    keep_y = np.arange(DEGREE_Y + 1) % 2 == (0 if parity == 1 else 1)
    gram_y = {key: G[np.ix_(keep_y, keep_y)] for key, G in gram_y.items()}
    nu = slab.poisson_ratio
    K = (
        np.kron(gram_x["22"], gram_y["00"])
        + np.kron(gram_x["00"], gram_y["22"])
        + nu * (np.kron(gram_x["02"].T, gram_y["02"]) + np.kron(gram_x["02"], gram_y["02"].T))
        + 2 * (1 - nu) * np.kron(gram_x["11"], gram_y["11"])
    )
    M = np.kron(gram_x["00"], gram_y["00"])
    ratio = slab.bending_stiffness / slab.mass_per_area
    top = (2 * np.pi * highest_frequency) ** 2 / ratio
    squared, vectors = eigh(K, M, subset_by_value=(-np.inf, top))
    # Rigid-body modes: translation and pitch are even across the plate, roll is odd.
    squared[: 2 if parity == 1 else 1] = 0.0
    coefficients = np.zeros((squared.size, DEGREE_X + 1, DEGREE_Y + 1))
    coefficients[:, :, keep_y] = vectors.T.reshape(squared.size, DEGREE_X + 1, -1)
    return PlateModes(
        omega=np.sqrt(ratio * squared),
        coefficients=coefficients / np.sqrt(slab.mass_per_area),
        length=slab.length,
        width=slab.width,
    )


def _gram(degree: int, side: float) -> dict[str, FloatArray]:
    """Integrals over the side of products of Legendre polynomials and their derivatives."""
    points, weights = legendre.leggauss(degree + 1)
    orders = [
        legendre.legval(points, legendre.legder(np.eye(degree + 1), m)) * (2 / side) ** m
        for m in range(3)
    ]
    weights = weights * side / 2
    pairs = ((0, 0), (1, 1), (2, 2), (0, 2))
    return {f"{a}{b}": (orders[a] * weights) @ orders[b].T for a, b in pairs}
