"""Exact steps of modes and rigid bodies under forces that are linear in time.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SMALL = 1e-2  # |lambda h| below which the series (next term < 1e-16) beats the quotient


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
    """s1 = E s0 + P0 g0 + P1 g1 for s' = lambda s + g, g linear from g0 to g1 in a step h."""

    h: float
    E: ComplexArray
    P0: ComplexArray
    P1: ComplexArray


def coefficients(poles: ComplexArray, h: float) -> Coefficients:
    """Exact coefficients of one step.

    References
    ----------
    Hochbruck, M. & Ostermann, A. (2010), Exponential integrators, Acta Numerica 19, 209-286.
    """
    z = poles * h
    E = np.exp(z)
    small = np.abs(z) < SMALL
    safe = np.where(small, 1.0, z)
    phi1: ComplexArray = np.where(small, _series(z, 1), np.expm1(safe) / safe)
    phi2: ComplexArray = np.where(small, _series(z, 2), (phi1 - 1) / safe)
    return Coefficients(h=h, E=E, P0=h * (phi1 - phi2), P1=h * phi2)


def _series(z: ComplexArray, k: int) -> ComplexArray:
    """phi_k(z) = sum_j z^j / (j + k)!, by Horner's rule to j = 7."""
    out = np.ones_like(z)
    for j in range(7, 0, -1):
        out = 1 + z / (j + k) * out
    return out / (1.0 if k == 1 else 2.0)


def free_step(c: Coefficients, state: State, start: Drive) -> State:
    """The step with a force falling from `start` to nothing."""
    return State(
        c.E * state.s + c.P0 * start.s,
        state.r + c.h * state.v + (c.h**2 / 3) * start.r,
        state.v + (c.h / 2) * start.r,
    )


def add_end(c: Coefficients, state: State, end: Drive) -> None:
    """Add, in place, the effect of a force rising from nothing to `end`."""
    state.s += c.P1 * end.s
    state.r += (c.h**2 / 6) * end.r
    state.v += (c.h / 2) * end.r
