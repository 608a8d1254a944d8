"""Normal contact of wheel and rail, and its balance with what carries it.

Needs numpy only: a copy of this file travels in every FMU that owns a contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MAX_ITERATIONS = 50  # Newton takes 3 or 4; far more means numbers without a physical meaning
RELATIVE_TOLERANCE = 1e-12  # of the compression: four digits above rounding


class ContactError(ArithmeticError):
    """The contact forces could not be found."""


class ContactLaw(Protocol):
    """Force of one contact against its compression, both arrays of one shape."""

    def force(self, compression: FloatArray) -> FloatArray:
        """Contact force (N), compression (m) positive."""

    def stiffness(self, compression: FloatArray) -> FloatArray:
        """Its derivative, N/m."""


@dataclass(frozen=True, kw_only=True)
class LinearContact:
    """A spring that also pulls: what a linear frequency response assumes.

    Attributes
    ----------
    k_H : float
        Stiffness, N/m.
    """

    k_H: float

    def force(self, compression: FloatArray) -> FloatArray:
        """Contact force, N."""
        return self.k_H * compression

    def stiffness(self, compression: FloatArray) -> FloatArray:
        """Stiffness, N/m."""
        return np.full_like(compression, self.k_H)


@dataclass(frozen=True, kw_only=True)
class HertzContact:
    """F = C delta^1.5 in compression, nothing when wheel and rail part.

    Attributes
    ----------
    C : float
        Coefficient, N/m^1.5.
    """

    C: float

    def force(self, compression: FloatArray) -> FloatArray:
        """Contact force, N."""
        closed = np.maximum(compression, 0.0)
        return self.C * closed * np.sqrt(closed)

    def stiffness(self, compression: FloatArray) -> FloatArray:
        """Tangent stiffness, N/m."""
        return 1.5 * self.C * np.sqrt(np.maximum(compression, 0.0))


def hertz_coefficient(
    *, young_modulus: float, poisson_ratio: float, wheel_radius: float, rail_radius: float
) -> float:
    """C of F = C delta^1.5 (N/m^1.5), so that the tangent stiffness is eq. 18 of Xu & Lu.

    Parameters
    ----------
    young_modulus : float
        Of wheel and rail, N/m2.
    poisson_ratio : float
        Of wheel and rail.
    wheel_radius, rail_radius : float
        Radii of curvature, m.

    References
    ----------
    Johnson, K. L. (1985), Contact Mechanics, Cambridge University Press.
    """
    modulus = young_modulus / (1 - poisson_ratio**2)
    return float(2 / 3 * modulus * (wheel_radius * rail_radius) ** 0.25)


def tangent_stiffness(C: float, static_force: float) -> float:
    """k_H = dF/d delta of F = C delta^1.5 at a static force, eq. 18: N/m."""
    return float(1.5 * C ** (2 / 3) * static_force ** (1 / 3))


def coefficient_for(k_H: float, static_force: float) -> float:
    """C of F = C delta^1.5 (N/m^1.5) whose tangent at a static force (N) is k_H (N/m)."""
    return float((k_H / (1.5 * static_force ** (1 / 3))) ** 1.5)


def solve_compression(
    law: ContactLaw, G: FloatArray, gap: FloatArray, guess: FloatArray
) -> FloatArray:
    """Compressions for which the contact forces and what they deflect agree.

    Solves ``delta + G force(delta) = gap`` by Newton's method. With G positive semi-definite and a
    force that never falls with compression, there is one solution.

    Parameters
    ----------
    law : ContactLaw
        The law of every contact.
    G : array, shape (n, n)
        Compliance: by how much unit contact forces push the two bodies apart, m/N.
    gap : array, shape (n,)
        Overlap of the bodies without contact forces, m.
    guess : array, shape (n,)
        Where to start, m.

    Returns
    -------
    array, shape (n,)
        m.

    Raises
    ------
    ContactError
        If the numbers are not finite or Newton's method does not settle.
    """
    delta = guess
    eye = np.eye(gap.size)
    for _ in range(MAX_ITERATIONS):
        residual = delta + G @ law.force(delta) - gap
        change = np.linalg.solve(eye + G * law.stiffness(delta), residual)
        delta = delta - change
        size = float(np.abs(change).max())
        if size <= RELATIVE_TOLERANCE * float(np.abs(delta).max()):
            return delta
        if not np.isfinite(size):
            break
    raise ContactError(
        "the contact forces could not be found: the wheel or rail motions set from outside are "
        f"not finite or far off (largest overlap {np.abs(gap).max():g} m)"
    )
