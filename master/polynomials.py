"""Polynomials by their values, as matrices; over a step tau = 0..1, Legendre's in x = 2 tau - 1.

Only the steps that a component is told of by derivatives are made elsewhere, in place: see
`continuation`.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre
from numpy.polynomial import polynomial as power

from railcosim.master.component import FloatArray

_GAUSS = 16
"""Nodes at which the force is integrated. Three do for a linear law. With Hertz's, an error is left
of a step within which the contact opens: 1e-2 of the energy of a blow shorter than the step; 5
nodes would leave 25 times as much."""


def lagrange(points: FloatArray, at: FloatArray, derivative: int = 0) -> FloatArray:
    """What a polynomial is at some places, by its values at others.

    Parameters
    ----------
    points : array, shape (n_points,)
        Where it is known: different, and best between -1 and 1.
    at : array, shape (n_at,)
        Where it is wanted.
    derivative : int, optional
        Which derivative is.

    Returns
    -------
    array, shape (n_at, n_points)
        Factors of the values.
    """
    degree = len(points) - 1
    derived = power.polyder(np.eye(degree + 1), derivative)
    there = power.polyvander(at, len(derived) - 1) @ derived
    through = power.polyvander(points, degree)
    weights: FloatArray = np.asarray(np.linalg.solve(through.T, there.T).T, dtype=np.float64)
    return weights


def best_fit(degree: int) -> tuple[FloatArray, FloatArray]:
    """Nodes in 0..1, and the Legendre coefficients up to `degree` by the values there.

    Least squares over the whole interval, by Gauss's quadrature.
    """
    x, weight = legendre.leggauss(_GAUSS)
    norm = 2 * np.arange(degree + 1) + 1
    return (x + 1) / 2, norm[:, None] * legendre.legvander(x, degree).T * weight / 2


@lru_cache(maxsize=64)
def paths(
    tau: tuple[float, ...], force_degree: int, degree: int
) -> tuple[tuple[FloatArray, FloatArray], ...]:
    """For each sub-step: value and derivatives at its beginning, with respect to tau.

    By the Legendre coefficients of a force, (degree + 1, force_degree + 1); and by samples at
    `tau`, (degree + 1, n_tau), of the best polynomial to the one through them all.
    """
    nodes, project = best_fit(degree)
    found = []
    for begin, end in pairwise(tau):
        of_force = _derivatives(2 * begin - 1, force_degree, degree, 1.0)
        fit = project @ lagrange(np.array(tau), begin + (end - begin) * nodes)
        found.append((of_force, _derivatives(-1.0, degree, degree, end - begin) @ fit))
    return tuple(found)


def _derivatives(x: float, n: int, orders: int, length: float) -> FloatArray:
    """Derivatives up to `orders` at x of Legendre polynomials up to `n`, of an interval."""
    rows = []
    for order in range(orders + 1):
        derived = legendre.legder(np.eye(n + 1), order)
        rows.append((2 / length) ** order * legendre.legval(x, derived))
    return np.array(rows)


@lru_cache(maxsize=64)
def continued(tau: tuple[float, ...], ratio: float) -> FloatArray:
    """Values at `tau` of a step by those at `tau` of the step before, 1 / ratio as long."""
    return lagrange(np.array(tau), 1 + ratio * np.array(tau))


@lru_cache(maxsize=64)
def end_slopes(tau: tuple[float, ...]) -> FloatArray:
    """Slope at 1 by values at `tau`."""
    slopes: FloatArray = lagrange(np.array(tau), np.ones(1), 1)[0]
    return slopes
