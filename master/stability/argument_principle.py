"""Roots outside a circle, counted by how often a function turns around zero along it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.state_space import ComplexArray

_TURN = 1.5
"""Largest turn of the determinant between points of the circle, rad: half a turn would be lost."""
_STEEP = 2.0
"""The same, foretold by the slope at either end; a root opposite to it turns by half as much."""
_NEAR = 1e-4
"""Of the distance between points, for a derivative by a difference."""
_SEEN = 0.5
"""Of its distance to the circle, from where a pole is seen."""
_USUAL = 65
"""Points of half the circle to begin with."""
_ROUNDS = 60
"""Times that points are set between others: then a root is on the circle, but for rounding."""
_ROWS = 12
"""Of a triangular system, solved one after another before others are told of them."""
_MANY = 100_000
"""Points of half the circle, a hundred times the usual: then the function is mostly rounding."""


class TurningLostError(ArithmeticError):
    """A function cannot be followed along a circle."""


def solve_triangular(T: ComplexArray, B: ComplexArray, z: ComplexArray) -> ComplexArray:
    """(z - T)^-1 B for every z, shape (n, n_z n_columns), columns together.

    Row by row within a few rows, whose sum over all that are known is one product of matrices.
    """
    n, m = B.shape
    x = np.empty((n, len(z) * m), dtype=complex)
    over = np.repeat(1.0 / (z - np.diag(T)[:, None]), m, axis=1)
    for last in range(n, 0, -_ROWS):
        first = max(last - _ROWS, 0)
        x[first:last] = np.tile(B[first:last], len(z))
        if last < n:
            x[first:last] += T[first:last, last:] @ x[last:]
        for i in range(first, last)[::-1]:
            if i + 1 < last:
                x[i] += T[i, i + 1 : last] @ x[i + 1 : last]
            x[i] *= over[i]
    return x


class Turning(NamedTuple):
    """A function along the upper half of a circle.

    Attributes
    ----------
    number : int
        How often it turns around zero along the whole circle.
    phi : array
        Angles at which it was looked at.
    slope : array of complex
        Derivative of its logarithm by the angle.
    """

    number: int
    phi: FloatArray
    slope: ComplexArray


def windings(
    turn: Callable[[FloatArray], ComplexArray], poles: ComplexArray, radius: float
) -> Turning:
    """Follow a function, real on the real axis, along a circle.

    `turn` gives its logarithm at angles, with any multiple of 2 pi i.

    Raises
    ------
    TurningLostError
        If it turns between points however many there are, or is not finite at one of them.
    """
    phi = _opposite(poles, radius)
    value, slope = _with_slope(turn, phi, np.diff(phi, append=2.0 * phi[-1] - phi[-2]))
    for _ in range(_ROUNDS):
        # Roots and poles come in clusters, one for each wheel, and may turn it fully between two
        # points. But they are seen in the slope from as far as they are many times over.
        steep = np.abs(slope)
        fast = np.diff(phi) * np.maximum(steep[1:], steep[:-1]) > _STEEP
        wide = np.flatnonzero(fast | (np.abs(_difference(value).imag) > _TURN))
        if not wide.size:
            break
        new, room = _between(phi[wide], phi[wide + 1], steep[wide], steep[wide + 1])
        if len(phi) + len(new) > _MANY:
            raise TurningLostError(f"it still turns between {len(phi)} points of a circle")
        more = _with_slope(turn, new, room)
        phi = np.concatenate([phi, new])
        order = np.argsort(phi, kind="stable")
        phi = phi[order]
        value, slope = (
            np.concatenate([old, its])[order] for old, its in zip((value, slope), more, strict=True)
        )
    total = float(_difference(value).imag.sum())
    # The lower half turns as much as the upper one.
    return Turning(number=round(total / math.pi), phi=phi, slope=slope)


def _between(
    begin: FloatArray, end: FloatArray, first: FloatArray, last: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points in intervals, denser to steep ends, and the room about each."""
    half = 0.5 * (end - begin)[:, None]
    points, rooms = [(begin[:, None] + half).ravel()], [half.ravel()]
    for place, steep, way in ((begin, first, 1.0), (end, last, -1.0)):
        doublings = np.log2(1.0 + half[:, 0] * steep)
        step = 1.0 / np.maximum(steep, 1e-300)[:, None]
        away = step * (2.0 ** np.arange(1, 1 + int(doublings.max())) - 1.0)
        inside = away < 0.75 * half
        points.append((place[:, None] + way * away)[inside])
        rooms.append(np.broadcast_to(step, away.shape)[inside])
    return np.concatenate(points), np.concatenate(rooms)


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
    turn: Callable[[FloatArray], ComplexArray], phi: FloatArray, room: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """A logarithm and its derivative, from a difference that is short against the room there is."""
    step = _NEAR * room
    with np.errstate(divide="ignore", invalid="ignore"):
        both = turn(np.concatenate([phi, phi + step]))
    if not np.isfinite(both).all():  # nan turns by nothing, and would count as such
        raise TurningLostError("a pole or zero is on the circle")
    value, ahead = both[: len(phi)], both[len(phi) :]
    return value, _difference(np.stack([value, ahead]))[0] / step


def _difference(logarithm: ComplexArray) -> ComplexArray:
    """Of neighbours, the imaginary part within half a turn."""
    change = np.diff(logarithm, axis=0)
    turned: ComplexArray = change.real + 1j * np.angle(np.exp(1j * change.imag))
    return turned
