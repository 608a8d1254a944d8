"""Natural modes of a thin (Kirchhoff) plate with four free edges, by Ritz with Legendre series."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import eigh

from .parameters import Slab

FloatArray = NDArray[np.float64]

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
        P_x = legendre.legvander(2 * np.asarray(x) / self.length, self.coefficients.shape[1] - 1)
        P_y = legendre.legvander(2 * np.asarray(y) / self.width, self.coefficients.shape[2] - 1)
        shapes: FloatArray = np.einsum("pi,pj,nij->pn", P_x, P_y, self.coefficients, optimize=True)
        return shapes


def free_plate_modes(slab: Slab, parity: int, highest_frequency: float) -> PlateModes:
    """Modes of the free plate up to a frequency.

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
        np.stack(
            [
                legendre.legval(points, legendre.legder(c, m)) * (2 / side) ** m
                for c in np.eye(degree + 1)
            ]
        )
        for m in range(3)
    ]
    weights = weights * side / 2
    pairs = ((0, 0), (1, 1), (2, 2), (0, 2))
    return {f"{a}{b}": (orders[a] * weights) @ orders[b].T for a, b in pairs}
