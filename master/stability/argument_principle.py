"""Roots outside a circle, counted by how often a function turns around zero along it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.state_space import ComplexArray

_TURN = 1.0
"""Largest turn of the determinant between points of the circle, rad: half a turn would be lost."""
_NEAR = 1e-4
"""Of the distance between points, for a derivative by a difference."""
_SEEN = 0.5
"""Of its distance to the circle, from where a pole is seen."""
_USUAL = 65
"""Points of half the circle to begin with."""
_ROUNDS = 60
"""Halvings between points: then their distance is rounding, and a root is on the circle."""


def solve_triangular(T: ComplexArray, B: ComplexArray, z: ComplexArray) -> ComplexArray:
    """(z - T)^-1 B for every z, shape (n_z, n, n_columns)."""
    n, m = B.shape
    x = np.zeros((n, len(z), m), dtype=complex)
    for i in range(n)[::-1]:
        known = (T[i, i + 1 :] @ x[i + 1 :].reshape(n - 1 - i, len(z) * m)).reshape(len(z), m)
        x[i] = (known + B[i]) / (z - T[i, i])[:, None]
    return x.transpose(1, 0, 2)


def windings(turn: Callable[[FloatArray], ComplexArray], poles: ComplexArray, radius: float) -> int:
    """How often a function, real on the real axis, turns around zero along a circle.

    `turn` gives its logarithm at angles, with any multiple of 2 pi i.
    """
    phi = _opposite(poles, radius)
    value, slope = _with_slope(turn, phi)
    for _ in range(_ROUNDS):
        # Roots and poles come in clusters, one for each wheel, and may turn it fully between two
        # points. But they are seen in the slope from as far as they are many times over.
        length = np.diff(phi)
        fast = length * np.maximum(np.abs(slope[1:]), np.abs(slope[:-1])) > _TURN
        wide = np.flatnonzero(fast | (np.abs(_difference(value).imag) > _TURN))
        if not wide.size:
            break
        middle = phi[wide] + 0.5 * length[wide]
        new = _with_slope(turn, middle, 0.5 * length[wide])
        phi, value, slope = (
            np.insert(old, wide + 1, more)
            for old, more in zip((phi, value, slope), (middle, *new), strict=True)
        )
    total = float(_difference(value).imag.sum())
    return round(total / math.pi)  # the lower half turns as much as the upper one


def _opposite(poles: ComplexArray, radius: float) -> FloatArray:
    """Angles to begin with: opposite to each pole, near which the function turns fast.

    A pole is seen from half its distance to the circle on either side, so of those that lie
    closely one is enough, and of those far inside none.
    """
    angle, width = np.abs(np.angle(poles)), _SEEN * np.abs(np.abs(poles) - radius)
    usual = np.linspace(0.0, math.pi, _USUAL)
    chosen, last = usual.tolist(), -math.inf
    order = np.argsort(angle)
    for phi, room in zip(angle[order].tolist(), width[order].tolist(), strict=True):
        if phi - last > room and room < math.pi / _USUAL:
            chosen.append(phi)
            last = phi
    return np.unique(chosen)


def _with_slope(
    turn: Callable[[FloatArray], ComplexArray], phi: FloatArray, room: FloatArray | None = None
) -> tuple[ComplexArray, ComplexArray]:
    """A logarithm and its derivative, from a difference that is short against the room there is."""
    if room is None:
        room = np.diff(phi, append=2.0 * phi[-1] - phi[-2])
    step = _NEAR * room
    both = turn(np.concatenate([phi, phi + step]))
    value, ahead = both[: len(phi)], both[len(phi) :]
    return value, _difference(np.stack([value, ahead]))[0] / step


def _difference(logarithm: ComplexArray) -> ComplexArray:
    """Of neighbours, the imaginary part within half a turn."""
    change = np.diff(logarithm, axis=0)
    turned: ComplexArray = change.real + 1j * np.angle(np.exp(1j * change.imag))
    return turned
