"""Hertz's contact of two bodies that are curved along and across: ellipse, approach, pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray
from .numbers import Numbers

HALVINGS = 8
"""Steps of the arithmetic-geometric mean: it squares its error; 6 do for a ratio of 1e-4."""
ITERATIONS = 20
"""For the ratio of the axes: each leaves a seventh of the error, see `ellipse`."""


@dataclass(frozen=True, kw_only=True)
class Ellipse:
    """The contact ellipse of given curvatures, whatever the load.

    Attributes
    ----------
    along, across : array
        Semi-axes a (along rolling) and b per cube root of the normal force, m/N^(1/3).
    C : array
        Of N = C delta^1.5, N/m^1.5.
    """

    along: FloatArray
    across: FloatArray
    C: FloatArray

    @property
    def ratio(self) -> FloatArray:
        """a/b."""
        return self.along / self.across

    def semi_axes(self, normal: Numbers) -> tuple[Numbers, Numbers]:
        """Semi-axes a along rolling and b across of a normal force (N), m."""
        root = normal ** (1 / 3)
        return self.along * root, self.across * root

    def approach(self, normal: FloatArray) -> FloatArray:
        """By how much the bodies approach, m."""
        return np.asarray((normal / self.C) ** (2 / 3))

    def stiffness(self, normal: FloatArray) -> FloatArray:
        """k_H = dN/d delta, N/m."""
        return np.asarray(1.5 * self.C ** (2 / 3) * normal ** (1 / 3))

    def pressure(self, normal: Numbers) -> Numbers:
        """The greatest, in the middle, N/m2."""
        a, b = self.semi_axes(normal)
        greatest: Numbers = 1.5 * normal / (np.pi * a * b)
        return greatest


def elliptic(complement: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Complete elliptic integrals K and D = (K - E) / k^2 by the arithmetic-geometric mean.

    Parameters
    ----------
    complement : array
        k' = sqrt(1 - k^2), above 0 to 1.

    Returns
    -------
    tuple of array
        K and D; D without cancellation also where k is small.

    References
    ----------
    Abramowitz, M. & Stegun, I. A. (1972), Handbook of Mathematical Functions, 17.6.
    """
    k2 = (1 - complement) * (1 + complement)
    mean, geometric = np.ones_like(complement), complement
    part, share = np.ones_like(complement), np.full_like(complement, 0.5)
    for n in range(HALVINGS):
        mean, geometric = (mean + geometric) / 2, np.sqrt(mean * geometric)
        part = part**2 * k2 / (16 * mean**2)  # c_n^2 / k^2 of the next c_n = c^2 / (4 mean)
        share = share + 2.0**n * part
    K = np.pi / (2 * mean)
    return K, K * share


def ellipse(
    curvature_x: FloatArray | float,
    curvature_y: FloatArray | float,
    *,
    shear_modulus: float,
    poisson_ratio: float,
) -> Ellipse:
    """Contact of two bodies of one material.

    Parameters
    ----------
    curvature_x, curvature_y : array or float
        Sums of both bodies' curvatures along rolling and across, 1/m: 1/r_w, and 1/R for a cone on
        a head of radius R. Both above 0.
    shear_modulus : float
        G of either, N/m2.
    poisson_ratio : float
        Of either.

    Returns
    -------
    Ellipse

    Raises
    ------
    ValueError
        If a curvature is not a number above 0: the bodies would touch along a line.

    References
    ----------
    Johnson, K. L. (1985), Contact Mechanics, Cambridge University Press, section 4.2.
    """
    x, y = np.broadcast_arrays(np.asarray(curvature_x, float), np.asarray(curvature_y, float))
    lesser, greater = np.minimum(x, y), np.maximum(x, y)
    if not (np.all(lesser > 0) and np.all(np.isfinite(greater))):
        raise ValueError(
            f"curvatures of wheel and rail together are {lesser.min():g} to {greater.max():g} 1/m: "
            "must be above 0 along and across"
        )
    ratio = (lesser / greater) ** (1 / 1.75)  # minor over major axis
    for _ in range(ITERATIONS):
        # d log(found) / d log(ratio) is 3/2 at a circle and 2 at a line: 4/7 leaves a seventh.
        K, D = elliptic(ratio)
        found = ratio**2 * D / (K - D)
        ratio = np.minimum(ratio * (lesser / greater / found) ** (4 / 7), 1.0)
    K, D = elliptic(ratio)
    modulus = shear_modulus / (1 - poisson_ratio)
    # The gap is curvature / 2 times the square of the distance along the major axis.
    major = (3 * D / (np.pi * modulus * lesser)) ** (1 / 3)
    approach = 3 * K / (2 * np.pi * modulus * major)  # per N^(2/3)
    long = x <= y
    return Ellipse(
        along=np.where(long, major, ratio * major),
        across=np.where(long, ratio * major, major),
        C=approach**-1.5,
    )
