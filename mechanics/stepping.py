"""Exact steps of modes and rigid bodies under forces that are quadratic in time.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

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
    """s1 = E s0 + P0 g0 + P1 g1 + Q q for s' = lambda s + g; r1 = ... + R0 g0 + R1 g1 for r'' = g.

    In a step h, g goes from g0 to g1 along a line, with a bulge of q in the middle; or it is held
    at the mean of both.
    """

    h: float
    E: ComplexArray
    P0: ComplexArray
    P1: ComplexArray
    Q: ComplexArray
    R0: float
    R1: float


def coefficients(poles: ComplexArray, h: float, *, held: bool = False) -> Coefficients:
    """Exact coefficients of one step, of forces along a line or held at their mean.

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
    phi3: ComplexArray = np.where(small, _series(z, 3), (phi2 - 0.5) / safe)
    end, share = (phi1 / 2, 1 / 4) if held else (phi2, 1 / 6)
    return Coefficients(
        h=h, E=E, P0=h * (phi1 - end), P1=h * end, Q=4 * h * (phi2 - 2 * phi3),
        R0=h**2 * (1 / 2 - share), R1=h**2 * share,
    )  # fmt: skip


def _series(z: ComplexArray, k: int) -> ComplexArray:
    """phi_k(z) = sum_j z^j / (j + k)!, by Horner's rule to j = 20."""
    out = np.ones_like(z)
    for j in range(20, 0, -1):
        out = 1 + z / (j + k) * out
    return out / math.factorial(k)


def free_step(c: Coefficients, state: State, start: Drive) -> State:
    """The step with what `start` does to it."""
    return State(
        c.E * state.s + c.P0 * start.s,
        state.r + c.h * state.v + c.R0 * start.r,
        state.v + (c.h / 2) * start.r,
    )


def add_end(c: Coefficients, state: State, end: Drive) -> None:
    """Add, in place, what `end` does."""
    state.s += c.P1 * end.s
    state.r += c.R1 * end.r
    state.v += (c.h / 2) * end.r


def add_bulge(c: Coefficients, state: State, bulge: Drive) -> None:
    """Add, in place, the effect of a force 4 bulge theta (1 - theta), theta = t / h."""
    state.s += c.Q * bulge.s
    state.r += (c.h**2 / 3) * bulge.r
    state.v += (2 * c.h / 3) * bulge.r
