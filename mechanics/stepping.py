"""Exact steps of modes and rigid bodies under forces that are quadratic in time.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .arrays import ComplexArray, FloatArray

SMALL = 1.0  # |lambda h| below which the series (20 terms: to rounding) beats the quotients


@dataclass
class State:
    """Modal coordinates s (complex), rigid-body coordinates r and their velocities v."""

    s: ComplexArray
    r: FloatArray
    v: FloatArray

    def copy(self) -> State:
        """An independent copy."""
        return State(self.s.copy(), self.r.copy(), self.v.copy())


@dataclass(frozen=True)
class Drive:
    """Generalised forces: on modes (complex) and on rigid-body coordinates."""

    s: ComplexArray
    r: FloatArray


@dataclass(frozen=True)
class Coefficients:
    """phi_0 .. phi_4 of the poles times a step h, shape (5, n).

    For s' = lambda s + u1 + u2 theta + u3 theta^2 / 2, theta = t / h, the state after the step is
    phi_0 s0 + h (phi_1 u1 + phi_2 u2 + phi_3 u3). On average over it, it is the same of the next
    phis. For rigid-body coordinates, r'' = g, h phi_k becomes h^2 / (k + 1)!.
    """

    h: float
    phi: ComplexArray


def coefficients(poles: ComplexArray, h: float) -> Coefficients:
    """Exact coefficients of a step h.

    References
    ----------
    Hochbruck, M. & Ostermann, A. (2010), Exponential integrators, Acta Numerica 19, 209-286.
    """
    z = poles * h
    small = np.abs(z) < SMALL
    safe = np.where(small, 1.0, z)
    phi = [np.exp(z), np.where(small, _series(z, 1), np.expm1(safe) / safe)]
    for k in (2, 3, 4):
        phi.append(np.where(small, _series(z, k), (phi[-1] - 1 / math.factorial(k - 1)) / safe))
    return Coefficients(h, np.stack(phi))


def _series(z: ComplexArray, k: int) -> ComplexArray:
    """phi_k(z) = sum_j z^j / (j + k)!, by Horner's rule to j = 20."""
    out = np.ones_like(z)
    for j in range(20, 0, -1):
        out = 1 + z / (j + k) * out
    return out / math.factorial(k)


def along(c: Coefficients, state: State, begin: Drive, middle: Drive, end: Drive) -> State:
    """The state after a step of forces along the parabola through three."""
    h = c.h
    return State(
        _under(c, 0, state, begin, middle, end),
        state.r + h * state.v + h**2 * (begin.r / 6 + middle.r / 3),
        state.v + h / 6 * (begin.r + 4 * middle.r + end.r),
    )


def average(c: Coefficients, state: State, begin: Drive, middle: Drive, end: Drive) -> State:
    """Displacements on average over that step; of the velocities nothing is said."""
    h = c.h
    return State(
        _under(c, 1, state, begin, middle, end),
        state.r + h / 2 * state.v + h**2 * (9 * begin.r + 12 * middle.r - end.r) / 120,
        np.zeros_like(state.v),
    )


def _under(
    c: Coefficients, first: int, state: State, begin: Drive, middle: Drive, end: Drive
) -> ComplexArray:
    u1, u2 = begin.s, 4 * middle.s - 3 * begin.s - end.s
    u3 = 4 * (begin.s + end.s - 2 * middle.s)
    p0, p1, p2, p3 = c.phi[first : first + 4]
    moved: ComplexArray = p0 * state.s + c.h * (p1 * u1 + p2 * u2 + p3 * u3)
    return moved


def add_line(c: Coefficients, state: State, mean: Drive, slope: Drive) -> None:
    """Add, in place, what forces mean + slope (2 theta - 1) do in a step."""
    state.s += c.h * (c.phi[1] * (mean.s - slope.s) + 2 * c.phi[2] * slope.s)
    state.r += c.h**2 * (mean.r / 2 - slope.r / 6)
    state.v += c.h * mean.r


def rigid_weight(c: Coefficients, k: int) -> float:
    """Displacement of a rigid-body coordinate by a force that h phi_k weighs for a mode, s^2."""
    return c.h**2 / math.factorial(k + 1)
